// @ranks 1
/*
  The narrow phase of contact detection against geometry that is known: nearest points of triangles, signed distances to boxes, spheres and
  stars with their normals, edges and corners, self-contact, thin plates that are hit fast.
*/
#include "detect_fixture.h"

static const PetscReal axes[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};

/* ------------------------------------------------------------------ triangles */

static PetscReal distance2(const PetscReal a[3], const PetscReal b[3])
{
  const PetscReal r[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};

  return SbDot3(r, r);
}

/* Squared distance to a segment by golden section: the distance is convex along it. */
static PetscReal segment2(const PetscReal p[3], const PetscReal a[3], const PetscReal b[3])
{
  PetscReal lo = 0, hi = 1, q[3];

  for (int i = 0; i < 90; i++) {
    PetscReal d[2];

    for (int m = 0; m < 2; m++) {
      const PetscReal t = m ? hi - 0.382 * (hi - lo) : lo + 0.382 * (hi - lo);

      for (int k = 0; k < 3; k++) q[k] = a[k] + t * (b[k] - a[k]);
      d[m] = distance2(p, q);
    }
    if (d[0] < d[1])
      hi = hi - 0.382 * (hi - lo);
    else
      lo = lo + 0.382 * (hi - lo);
  }
  for (int k = 0; k < 3; k++) q[k] = a[k] + lo * (b[k] - a[k]);
  return distance2(p, q);
}

/* The same to a triangle: of the segments along x1 x2, the shorter the nearer to x0, the nearest is searched for like above. */
static PetscReal triangle2(const PetscReal p[3], const PetscReal *const x[3])
{
  PetscReal lo = 0, hi = 1, best = segment2(p, x[1], x[2]);

  for (int i = 0; i < 90; i++) {
    PetscReal d[2];

    for (int m = 0; m < 2; m++) {
      const PetscReal t = m ? hi - 0.382 * (hi - lo) : lo + 0.382 * (hi - lo);
      PetscReal a[3], b[3];

      for (int k = 0; k < 3; k++) {
        a[k] = x[1][k] + t * (x[0][k] - x[1][k]);
        b[k] = x[2][k] + t * (x[0][k] - x[2][k]);
      }
      d[m] = segment2(p, a, b);
    }
    best = PetscMin(best, PetscMin(d[0], d[1]));
    if (d[0] < d[1])
      hi = hi - 0.382 * (hi - lo);
    else
      lo = lo + 0.382 * (hi - lo);
  }
  return best;
}

static void check_triangles(void)
{
  PetscInt place[7] = {0};
  unsigned state = 11;

  for (int i = 0; i < 3000; i++) {
    const PetscReal slim = i % 3 == 1 ? pow(10, -1 - i % 15) : 1;
    PetscReal c[3][3], p[3], q[3] = {0, 0, 0}, w[3], d2, true2;
    const PetscReal *const x[3] = {c[0], c[1], c[2]};
    SbTriangleFeature at;

    for (int k = 0; k < 3; k++) {
      p[k] = 1.5 * number(&state);
      for (int m = 0; m < 3; m++) c[m][k] = number(&state);
    }
    for (int k = 0; k < 3; k++) {
      const PetscReal s = i % 2 ? 0.4 : 1.7; /* the slim ones: c near a point of the line through a and b */

      if (i % 3 == 1) c[2][k] = c[0][k] + s * (c[1][k] - c[0][k]) + slim * number(&state);
      if (i % 12 == 2) c[2][k] = c[i / 12 % 2][k];
      if (i % 24 == 5) c[1][k] = c[2][k] = c[0][k];
      if (i % 24 == 17) c[i / 24 % 3][k] = 0.5 * (c[(i / 24 + 1) % 3][k] + c[(i / 24 + 2) % 3][k]);
    }
    at = SbTriangleClosestPoint(p, x, w, &d2);
    place[at]++;
    for (int m = 0; m < 3; m++) {
      SB_CHECK(w[m] >= 0 && w[m] <= 1, "triangle %d: weight %g", i, (double)w[m]);
      for (int k = 0; k < 3; k++) q[k] += w[m] * c[m][k];
    }
    true2 = triangle2(p, x);
    SB_CHECK_NEAR(w[0] + w[1] + w[2], 1, 1e-15, "sum of the weights");
    SB_CHECK_NEAR(distance2(p, q), d2, 1e-13, "distance of the point that the weights give");
    /* golden section stops at the root of rounding; regions of slim triangles may be the wrong one by their height */
    SB_CHECK(PetscAbsReal(d2 - true2) < 1e-7 * PetscMax(slim, 0.1),
             "triangle %d, slim %g: squared distance %.12g, not %.12g", i, (double)slim, (double)d2,
             (double)true2);
    for (int m = 0; m < 3; m++) {
      const PetscBool zero =
        (PetscBool)(at == SB_FEATURE_FACE     ? 0
                    : at >= SB_FEATURE_EDGE_0 ? m == ((int)at - SB_FEATURE_EDGE_0 + 2) % 3
                                              : m != (int)at);

      if (zero) SB_CHECK(w[m] == 0, "triangle %d: weight %d is %g at place %d", i, m, (double)w[m], (int)at);
    }
  }
  for (int k = 0; k < 7; k++) SB_CHECK(place[k] > 50, "place %d: %d times", k, (int)place[k]);
}

/* ------------------------------------------------------------------ signed distances */

/* The contacts of probes; there is one part, so at most one each: which[i] is that of probe i, NULL: none. */
static PetscErrorCode find(SbDetector d, const World *w, const SbNear *which[])
{
  const SbNear *near;
  PetscInt n;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < w->scene.npoint; i++) which[i] = NULL;
  PetscCall(SbDetectorFind(d, &w->scene, &n, &near));
  for (PetscInt j = 0; j < n; j++) which[near[j].point] = near + j;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_box(SbDetector d, World *w)
{
  const PetscReal half[3] = {0.5, 0.4, 0.3};
  const PetscInt n[3] = {3, 2, 4};
  PetscReal p[500][3], normal[500][3], expected[500][3], gap[500];
  const SbNear *near[500];
  unsigned state = 23;
  SbObstacle box;

  PetscFunctionBeginUser;
  PetscCall(SbObstacleCreate("-box", "box:-0.5,-0.4,-0.3,0.5,0.4,0.3", &box));
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_box(w, half, n);
  world_scene(w, PETSC_TRUE, 0, 1);
  for (int i = 0; i < 500; i++) {
    for (int k = 0; k < 3; k++) p[i][k] = (i % 2 ? 1 : 1.7) * half[k] * number(&state);
    gap[i] = SbObstacleDistance(box, p[i], expected[i]);
    for (int k = 0; k < 3; k++) normal[i][k] = -expected[i][k];
  }
  world_probe(w, 500, p, NULL, normal);
  PetscCall(find(d, w, near));
  for (int i = 0; i < 500; i++) {
    SB_CHECK(near[i], "box: nothing at point %d", i);
    if (!near[i]) continue;
    SB_CHECK_NEAR(near[i]->gap, gap[i], 1e-14, "signed distance to a box");
    SB_CHECK_NEAR(SbDot3(near[i]->normal, expected[i]), 1, 1e-13, "normal of a box");
  }
  PetscCall(SbObstacleDestroy(&box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* On the surface itself, at edges and corners and right beside them: the direction of one of the faces there. */
static PetscErrorCode check_touching(SbDetector d, World *w)
{
  const PetscReal half[3] = {0.5, 0.4, 0.3}, e = 1e-12;
  const PetscInt n[3] = {2, 2, 2};
  PetscReal p[54][3], normal[54][3], expected[54][3];
  const SbNear *near[54];

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_box(w, half, n);
  world_scene(w, PETSC_TRUE, 0, 0.1);
  for (int i = 0; i < 54; i++) {
    const PetscInt side[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 % 3 - 1};
    const PetscReal length =
      PetscSqrtReal((PetscReal)(side[0] * side[0] + side[1] * side[1] + side[2] * side[2]));

    for (int k = 0; k < 3; k++) {
      expected[i][k] = length > 0 ? (PetscReal)side[k] / length : 0;
      normal[i][k] = -expected[i][k];
      p[i][k] = (PetscReal)side[k] * half[k] + (i < 27 ? 0 : e * (PetscReal)side[(k + 1) % 3]);
    }
  }
  world_probe(w, 54, p, NULL, normal);
  PetscCall(find(d, w, near));
  for (int i = 0; i < 54; i++) {
    PetscBool face = PETSC_FALSE;

    if (i % 27 == 13) {
      SB_CHECK(!near[i], "the middle of the box is within reach");
      continue;
    }
    SB_CHECK(near[i], "touching: nothing at point %d", i);
    if (!near[i]) continue;
    SB_CHECK_NEAR(near[i]->gap, 0, 2 * e, "gap of a touching point");
    for (int k = 0; k < 3; k++) {
      const PetscReal outside = near[i]->normal[k] * (PetscReal)(i % 27 / (k ? k == 1 ? 3 : 9 : 1) % 3 - 1);

      face = (PetscBool)(face || PetscAbsReal(outside - 1) < 1e-12);
    }
    SB_CHECK(face, "touching point %d: normal %g %g %g", i, (double)near[i]->normal[0],
             (double)near[i]->normal[1], (double)near[i]->normal[2]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A vertex of another box on the rim of this one's top, flush with its side but for rounding, and a little in or above the top: it meets
  the top, whatever side of the side it is on.
*/
static PetscErrorCode check_flush(SbDetector d, World *w)
{
  const PetscReal half[3] = {0.5, 0.4, 0.3}, c = PetscSqrtReal(0.5);
  const PetscReal aside[5] = {0, 1.2e-16, -1.2e-16, 5e-12, -5e-12}, up[3] = {0, 1e-8, -1e-8};
  const PetscInt n[3] = {2, 2, 2};
  PetscReal p[15][3], normal[15][3];
  const SbNear *near[15];

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_box(w, half, n);
  world_scene(w, PETSC_TRUE, 0, 0.1);
  for (int i = 0; i < 15; i++) {
    p[i][0] = half[0] + aside[i % 5];
    p[i][1] = 0.13;
    p[i][2] = half[2] + up[i / 5];
    normal[i][0] = c; /* its own side and bottom */
    normal[i][1] = 0;
    normal[i][2] = -c;
  }
  world_probe(w, 15, p, NULL, normal);
  PetscCall(find(d, w, near));
  for (int i = 0; i < 15; i++) {
    SB_CHECK(near[i], "a vertex %g m beside the side and %g m above the top meets nothing",
             (double)aside[i % 5], (double)up[i / 5]);
    if (!near[i]) continue;
    SB_CHECK_NEAR(near[i]->gap, up[i / 5], 1e-15, "gap of a vertex that is flush with a side");
    SB_CHECK_NEAR(near[i]->normal[2], 1, 1e-15, "its normal");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_sphere(SbDetector d, World *w)
{
  PetscReal p[400][3], normal[400][3], edge2 = 0;
  const SbNear *near[400];
  unsigned state = 31;

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_sphere(w, 4);
  for (PetscInt f = 0; f < w->nfacet; f++)
    edge2 = PetscMax(edge2, distance2(w->X[w->facet[f][0]], w->X[w->facet[f][1]]));
  world_scene(w, PETSC_TRUE, 0, 0.5);
  for (int i = 0; i < 400; i++) {
    PetscReal length, radius = 1 + 0.4 * number(&state);

    for (int k = 0; k < 3; k++) p[i][k] = number(&state);
    length = PetscSqrtReal(SbDot3(p[i], p[i]));
    for (int k = 0; k < 3; k++) {
      normal[i][k] = -p[i][k] / length;
      p[i][k] *= radius / length;
    }
  }
  world_probe(w, 400, p, NULL, normal);
  PetscCall(find(d, w, near));
  for (int i = 0; i < 400; i++) {
    const PetscReal gap = PetscSqrtReal(SbDot3(p[i], p[i])) - 1;

    SB_CHECK(near[i], "sphere: nothing at gap %g", (double)gap);
    if (!near[i]) continue;
    /* facets lie below the sphere by at most half their squared circumradius, a third of the edge's square */
    SB_CHECK(near[i]->gap >= gap - 1e-14 && near[i]->gap <= gap + edge2 / 6, "gap %g, of the sphere %g",
             (double)near[i]->gap, (double)gap);
    /* inside, the normal of a facet differs from that of the sphere by at most its circumradius */
    SB_CHECK(SbDot3(near[i]->normal, normal[i]) < -1 + edge2 / 3, "normal at gap %g", (double)gap);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Bodies with sharp edges and deep dents. Each place is examined by six points that face six ways: the nearest contact of all is the
  nearest point of the surface, and its sign tells inside from outside.
*/
static PetscErrorCode check_stars(SbDetector d, World *w)
{
  PetscReal p[600][3], normal[600][3];
  const SbNear *near[600];
  PetscInt in = 0;

  PetscFunctionBeginUser;
  for (unsigned star = 0; star < 24; star++) {
    const PetscReal apart = star % 3 == 2 ? 1e-7 : 0;
    unsigned state = 100 + star;

    w->nvertex = w->nfacet = w->npart = 0;
    (void)world_sphere(w, star % 2);
    for (PetscInt v = 0; v < w->nvertex; v++) {
      const PetscReal r = star % 4 < 2 ? 0.8 + 0.55 * number(&state) : 1;

      for (int k = 0; k < 3; k++) w->x[v][k] = w->X[v][k] *= r * (star % 4 >= 2 && k == 2 ? 0.02 : 1);
    }
    world_scene(w, PETSC_TRUE, apart, 3);
    for (int i = 0; i < 600; i++) {
      for (int k = 0; k < 3; k++) {
        p[i][k] = i % 6 ? p[i - 1][k] : 0.9 * (star % 4 >= 2 && k == 2 ? 0.05 : 1) * number(&state);
        normal[i][k] = axes[i % 6][k];
      }
    }
    world_probe(w, 600, p, NULL, normal);
    PetscCall(find(d, w, near));
    for (int i = 0; i < 600; i += 6) {
      const PetscReal *x[3];
      PetscReal best = PETSC_MAX_REAL, d2, weight[3];
      const SbNear *a = NULL;

      for (int k = 0; k < 6; k++) {
        if (near[i + k] && (!a || PetscAbsReal(near[i + k]->gap) < PetscAbsReal(a->gap))) a = near[i + k];
      }
      for (PetscInt f = 0; f < w->nfacet; f++) {
        for (int k = 0; k < 3; k++) x[k] = w->x[w->facet[f][k]];
        (void)SbTriangleClosestPoint(p[i], x, weight, &d2);
        best = PetscMin(best, PetscSqrtReal(d2));
      }
      SB_CHECK(a, "star %u: nothing at point %d", star, i / 6);
      if (!a || best < 1e-5) continue;
      SB_CHECK_NEAR(PetscAbsReal(a->gap), best, apart > 0 ? 3e-7 : 1e-14, "distance to a star");
      SB_CHECK((a->gap < 0) == inside_star(w, p[i]), "star %u: gap %g at a point that is %s", star,
               (double)a->gap, inside_star(w, p[i]) ? "inside" : "outside");
      in += a->gap < 0;
    }
  }
  SB_CHECK(in > 300 && in < 2000, "%d of 2400 points are inside", (int)in);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A wedge whose sharp edge is whole in the facet above, halved in the two below, with a facet without area in between: the facets on the two
  sides of the edge are no neighbours by identity.
*/
static PetscErrorCode check_sliver(SbDetector d, World *w)
{
  static const PetscReal X[5][3] = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0.05}, {-1, 0, -0.05}, {0, 0, 0}};
  static const PetscInt facets[6][3] = {{0, 1, 2}, {1, 4, 3}, {4, 0, 3}, {1, 0, 4}, {1, 3, 2}, {0, 2, 3}};
  PetscReal p[100][3], normal[100][3];
  const SbNear *near[100];
  unsigned state = 41;

  PetscFunctionBeginUser;
  for (int first = 0; first < 6; first++) {
    w->nvertex = w->nfacet = 0;
    w->npart = 1;
    for (int v = 0; v < 5; v++) (void)world_vertex(w, X[v], 0, PETSC_FALSE);
    /* each facet once is the one with the lowest identity */
    for (int f = 0; f < 6; f++) {
      const PetscInt *v = facets[(first + f) % 6];

      world_facet(w, v[0], v[1], v[2]);
    }
    world_scene(w, PETSC_TRUE, 0, 0.2);
    for (int i = 0; i < 100; i++) {
      const PetscReal angle = 1.4 * number(&state);

      normal[i][0] = -PetscCosReal(angle);
      normal[i][1] = 0;
      normal[i][2] = -PetscSinReal(angle);
      for (int k = 0; k < 3; k++) p[i][k] = -0.1 * normal[i][k];
      p[i][1] = i ? 0.8 * number(&state) : 0;
    }
    world_probe(w, 100, p, NULL, normal);
    PetscCall(find(d, w, near));
    for (int i = 0; i < 100; i++) {
      SB_CHECK(near[i], "wedge: nothing at point %d", i);
      if (!near[i]) continue;
      SB_CHECK_NEAR(near[i]->gap, 0.1, 1e-15, "distance to the edge of a wedge");
      SB_CHECK_NEAR(SbDot3(near[i]->normal, normal[i]), -1, 1e-14, "normal at the edge of a wedge");
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ self-contact */

/* A strip along x, flat at rest, folded to that radius of its middle surface: two arms, 2 (radius - half its thickness) apart. */
static void fold(World *w, PetscReal radius)
{
  for (PetscInt v = 0; v < w->nvertex; v++) {
    const PetscReal s = w->X[v][0], z = w->X[v][2], bend = PETSC_PI / 2;
    const PetscReal a = PetscMax(-bend, PetscMin(bend, s / radius)), more = PetscAbsReal(s) - bend * radius;

    w->x[v][0] = (radius - z) * PetscSinReal(a);
    w->x[v][1] = w->X[v][1];
    w->x[v][2] = radius - (radius - z) * PetscCosReal(a) + PetscMax(0, more);
  }
}

static PetscErrorCode check_strip(SbDetector d, World *w, PetscReal thick, PetscReal radius,
                                  PetscBool vertices, PetscBool motion)
{
  const PetscReal half[3] = {1, 0.2, thick}, gap = 2 * (radius - thick);
  const PetscInt n[3] = {60, 4, 1};
  PetscInt expected = 0, found, arms = 0;
  const SbNear *near;

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_box(w, half, n);
  w->scene.self = PETSC_TRUE;
  world_scene(w, vertices, 0, 0.08);
  PetscCall(SbDetectorFind(d, &w->scene, &found, &near));
  SB_CHECK(found == 0, "a flat strip at rest has %d contacts with itself", (int)found);
  fold(w, radius);
  world_scene(w, vertices, 0, 0.08);
  if (!motion) w->scene.x0 = w->scene.p0 = NULL;
  /* the inner side of the arms, away from the bend and from the tips */
  for (PetscInt i = 0; i < w->scene.npoint; i++) {
    const PetscReal *P = w->scene.P + 3 * i;

    if (P[2] > 0.99 * thick && PetscAbsReal(P[0]) > 0.25) expected++;
  }
  PetscCall(SbDetectorFind(d, &w->scene, &found, &near));
  for (PetscInt j = 0; j < found; j++) {
    const PetscReal *P = w->scene.P + 3 * near[j].point;

    if (PetscAbsReal(P[0]) < 0.25) continue;
    SB_CHECK(P[2] > 0.99 * thick, "the outer side is in contact");
    SB_CHECK_NEAR(near[j].gap, gap, 1e-13, "gap between the arms");
    SB_CHECK_NEAR(near[j].normal[0], P[0] > 0 ? 1 : -1, 1e-12, "normal between the arms");
    arms++;
  }
  SB_CHECK(arms == expected && arms > 100, "%d contacts of the folded strip, expected %d", (int)arms,
           (int)expected);
  w->scene.self = PETSC_FALSE;
  PetscCall(SbDetectorFind(d, &w->scene, &found, &near));
  SB_CHECK(found == 0, "%d contacts with itself where none are wanted", (int)found);
  /* made like this: what is near at rest does not count */
  for (PetscInt v = 0; v < w->nvertex; v++) {
    for (int k = 0; k < 3; k++) w->X[v][k] = w->x[v][k];
  }
  w->scene.self = PETSC_TRUE;
  world_scene(w, vertices, 0, 0.08);
  PetscCall(SbDetectorFind(d, &w->scene, &found, &near));
  SB_CHECK(found == 0, "a strip that is folded at rest has %d contacts with itself", (int)found);
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_sphere(w, 3);
  world_scene(w, vertices, 0, 0.1);
  w->scene.self = PETSC_TRUE;
  PetscCall(SbDetectorFind(d, &w->scene, &found, &near));
  SB_CHECK(found == 0, "a sphere at rest has %d contacts with itself", (int)found);
  w->scene.self = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ thin plates */

#define PLATE 0.01 /* half the thickness */

/* A plate at z = 0 that moves by `up` along z in the step; probes from p0 to p; all turned by the pose. */
static PetscErrorCode hit_plate(SbDetector d, World *w, PetscReal up, PetscInt n, PetscReal p[][3],
                                PetscReal p0[][3], PetscReal normal[][3], PetscBool motion,
                                const SbPose *pose, const SbNear *near[])
{
  const PetscReal half[3] = {0.5, 0.5, PLATE}, none[3] = {0, 0, 0};
  const PetscInt cells[3] = {4, 4, 1};
  PetscReal q[3][400][3], y[3];

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_box(w, half, cells);
  for (PetscInt v = 0; v < w->nvertex; v++) {
    y[0] = w->X[v][0];
    y[1] = w->X[v][1];
    y[2] = w->X[v][2] - up;
    SbPoseApply(pose, w->X[v], w->x[v]);
    SbPoseApply(pose, y, w->x0[v]);
  }
  world_scene(w, PETSC_TRUE, 0, 0.05);
  SbPoseApply(pose, none, y);
  for (PetscInt i = 0; i < n; i++) {
    SbPoseApply(pose, p[i], q[0][i]);
    SbPoseApply(pose, p0[i], q[1][i]);
    SbPoseApply(pose, normal[i], q[2][i]);
    for (int k = 0; k < 3; k++) q[2][i][k] -= y[k];
  }
  world_probe(w, n, q[0], motion ? q[1] : NULL, q[2]);
  PetscCall(find(d, w, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contact must be with the front: its gap, and whether it was found by its motion. */
static void check_front(const SbNear *a, const SbPose *pose, PetscReal gap, PetscBool crossed,
                        const char *what)
{
  const PetscReal up[3] = {pose->R[2], pose->R[5], pose->R[8]};

  SB_CHECK(a, "%s: nothing at gap %g", what, (double)gap);
  if (!a) return;
  SB_CHECK_NEAR(a->gap, gap, 1e-13, what);
  SB_CHECK_NEAR(SbDot3(a->normal, up), 1, 1e-12, what);
  SB_CHECK(a->crossed == crossed, "%s: crossed is %d", what, (int)a->crossed);
}

/* Straight through, aimed at vertices, edges and insides of the plate's facets, to all depths. */
static PetscErrorCode check_through(SbDetector d, World *w, const SbPose *pose, PetscReal up)
{
  static const PetscReal depths[] = {-0.03, -0.001, 0.001, 0.009, 0.011, 0.019, 0.021, 0.04, 0.06, 0.5};
  PetscReal p[170][3], p0[170][3], normal[170][3];
  const SbNear *near[170];

  PetscFunctionBeginUser;
  for (size_t m = 0; m < PETSC_STATIC_ARRAY_LENGTH(depths); m++) {
    const PetscReal depth = depths[m];
    PetscInt n = 0;
    unsigned state = 3;

    for (int i = 0; i < 13; i++) {
      for (int j = 0; j < 13; j++, n++) {
        /* at the vertices, in the middle of the edges and elsewhere; not at the rim of the plate */
        const PetscReal x = (i - 6) / 16., y = (j - 6) / 16., angle = n % 2 ? 0 : 1.4 * number(&state);

        for (int k = 0; k < 2; k++) p[n][k] = p0[n][k] = k ? y : x;
        p[n][2] = PLATE - depth;
        p0[n][2] = PLATE + 0.45 - up;
        /* obliquely, so that the way goes through (x, y) at the front */
        if (n % 3 == 1 && up == 0) {
          p0[n][0] += 0.2 * 0.45;
          p[n][0] -= 0.2 * depth;
        }
        normal[n][0] = PetscSinReal(angle);
        normal[n][1] = 0;
        normal[n][2] = -PetscCosReal(angle);
      }
    }
    PetscCall(hit_plate(d, w, up, n, p, p0, normal, PETSC_TRUE, pose, near));
    for (PetscInt i = 0; i < n; i++) {
      check_front(near[i], pose, -depth, (PetscBool)(depth > 2 * PLATE), "a plate that is hit fast");
    }
    if (depth < 2 * PLATE) continue;
    PetscCall(hit_plate(d, w, up, n, p, p0, normal, PETSC_FALSE, pose, near));
    for (PetscInt i = 0; i < n; i++)
      SB_CHECK(!near[i], "found behind the plate without examining the motion");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is no passage, or a special one. Starts and ends of points that all face downwards but for the last number. */
static PetscErrorCode check_passages(SbDetector d, World *w, const SbPose *pose)
{
  /* x0, z0, x, z, z component of the normal (the rest is x), gap expected (9: none), found by its motion */
  static const PetscReal way[][7] = {
    {0.61, 0.4, 0.61, -0.4, -1, 9, 0},         /* beside the plate */
    {0.1, -0.4, 0.1, 0.4, -1, 9, 0},           /* from behind, looking back */
    {0.1, 0.4, 0.1, -0.4, 1, 9, 0},            /* looking away from what it passes */
    {0.1, 0.4, 0.1, 0.08, -1, 9, 0},           /* not there yet */
    {0.1, 0.005, 0.1, 0.03, -1, 0.02, 0},      /* inside, and out again at the front */
    {0.1, PLATE, 0.1, -0.4, -1, -0.41, 1},     /* lay on it */
    {0.1, 0.0075, 0.1, -0.4, -1, -0.41, 1},    /* lay on it, pressed in a little */
    {0.1, 0.4, 0.1, -0.03, 0.1, 9, 0},         /* sideways and back a little: never constrained at the back */
    {0.1, 0.4, 0.1, 0.0095, -0.1, -0.0005, 0}, /* sideways, just inside */
    {0.3, 0.4, -0.3, -0.4, -0.6, -0.41, 1},    /* obliquely */
    {0.52, 0.03, 0.47, 0.005, -1, -0.005, 0},  /* in through the corner */
    {0.45, 0.03, 0.35, 0.0125, -1, 0.0025, 0}, /* along above it */
    {0.1, -0.4, 0.1, -0.012, -1, 9, 0},        /* comes to the back, looking away from it */
  };
  const PetscInt n = PETSC_STATIC_ARRAY_LENGTH(way);
  PetscReal p[20][3], p0[20][3], normal[20][3];
  const SbNear *near[20];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal start[3] = {way[i][0], 0.07, way[i][1]}, end[3] = {way[i][2], 0.07, way[i][3]};
    const PetscReal facing[3] = {PetscSqrtReal(1 - way[i][4] * way[i][4]), 0, way[i][4]};

    for (int k = 0; k < 3; k++) {
      p0[i][k] = start[k];
      p[i][k] = end[k];
      normal[i][k] = facing[k];
    }
  }
  PetscCall(hit_plate(d, w, 0, n, p, p0, normal, PETSC_TRUE, pose, near));
  for (PetscInt i = 0; i < n; i++) {
    if (way[i][5] < 9)
      check_front(near[i], pose, way[i][5], (PetscBool)(way[i][6] > 0), "a way to the plate");
    else
      SB_CHECK(!near[i], "way %d: a contact with gap %g", (int)i, near[i] ? (double)near[i]->gap : 0.);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point that slides over a ball on a straight line: it cuts through it, but is in front of it in the end. */
static PetscErrorCode check_grazing(SbDetector d, World *w)
{
  const PetscReal p0[1][3] = {{-0.3, 0.02, 1}}, p[1][3] = {{0.3, 0.01, 1}}, normal[1][3] = {{0, 0, -1}};
  const SbNear *near[1];

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  (void)world_sphere(w, 3);
  for (PetscInt v = 0; v < w->nvertex; v++) w->x[v][2] = w->x0[v][2] += 0.01;
  world_scene(w, PETSC_TRUE, 0, 0.1);
  world_probe(w, 1, p, p0, normal);
  PetscCall(find(d, w, near));
  SB_CHECK(near[0] && !near[0]->crossed && near[0]->gap > 0.02,
           "what only grazed a ball is constrained where it came in");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two plates that lie on each other, a little too close; together they are thinner than the reach. Only the sides between them meet. */
static PetscErrorCode check_stack(SbDetector d, World *w)
{
  const PetscReal below[3] = {0.5, 0.5, PLATE}, above[3] = {0.4, 0.4, PLATE}, overlap = 0.001;
  const PetscInt cells[3] = {8, 8, 1};
  PetscInt n, meeting = 0;
  const SbNear *near;

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  for (PetscInt v = world_box(w, below, cells); v < w->nvertex; v++) w->x[v][2] = w->x0[v][2] -= PLATE;
  for (PetscInt v = world_box(w, above, cells); v < w->nvertex; v++)
    w->x[v][2] = w->x0[v][2] += PLATE - overlap;
  for (int motion = 0; motion < 2; motion++) {
    world_scene(w, PETSC_TRUE, 0, 0.06);
    if (!motion) w->scene.x0 = w->scene.p0 = NULL;
    PetscCall(SbDetectorFind(d, &w->scene, &n, &near));
    for (PetscInt j = 0; j < n; j++) {
      const PetscReal *p = w->scene.p + 3 * near[j].point;

      SB_CHECK(PetscAbsReal(p[2]) < 2 * overlap, "the far side of a plate is in contact: z = %g, gap %g",
               (double)p[2], (double)near[j].gap);
      if (PetscMax(PetscAbsReal(p[0]), PetscAbsReal(p[1])) > 0.399) continue;
      SB_CHECK_NEAR(near[j].gap, -overlap, 1e-15, "gap between two plates");
      meeting++;
    }
  }
  /* 7 x 7 points of the upper one, as many of the lower one: twice */
  SB_CHECK(meeting == 4 * 49, "%d contacts between two plates", (int)meeting);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscReal z[3] = {0, 0, 1}, none[3] = {0, 0, 0};
  const SbDetectKind kinds[] = {SB_DETECT_TREE, SB_DETECT_BRUTE};
  unsigned state = 8;
  SbDetector d;
  SbPose pose;
  World w;

  SB_TEST_BEGIN(argc, argv);
  check_triangles();
  PetscCall(world_create(&w));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(kinds); i++) {
    PetscCall(SbDetectorCreate(kinds[i], &d));
    PetscCall(check_box(d, &w));
    PetscCall(check_touching(d, &w));
    PetscCall(check_flush(d, &w));
    PetscCall(check_sphere(d, &w));
    PetscCall(check_stars(d, &w));
    PetscCall(check_sliver(d, &w));
    for (int k = 0; k < 4; k++) {
      PetscCall(check_strip(d, &w, 0.05, 0.08, (PetscBool)(k % 2), (PetscBool)(k / 2)));
      /* thin: the far side of the other arm is within reach, too */
      PetscCall(check_strip(d, &w, 0.01, 0.02, (PetscBool)(k % 2), (PetscBool)(k / 2)));
    }
    PetscCall(check_grazing(d, &w));
    PetscCall(check_stack(d, &w));
    SbPoseSet(z, 0, none, none, &pose);
    for (int k = 0; k < 3; k++) {
      PetscCall(check_through(d, &w, &pose, 0));
      PetscCall(check_through(d, &w, &pose, 0.3));
      PetscCall(check_through(d, &w, &pose, 0.45 + 0.2));
      PetscCall(check_passages(d, &w, &pose));
      random_pose(&state, 1, &pose);
    }
    PetscCall(SbDetectorDestroy(&d));
  }
  PetscCall(world_destroy(&w));
  SB_TEST_END();
}
