// @ranks 1
/*
  Edges: made from facets, which are sharp; distances of segments; pairs of edges of tetrahedra against their nearest features by brute force,
  apart, in each other and gone through; motions of two edges against many small steps; what degenerates.
*/
#include "detect_fixture.h"

/* ------------------------------------------------------------------ from facets */

/* The edges of the last world, and how many are sharp. */
static PetscErrorCode count_edges(World *w, PetscInt *n, PetscInt *sharp)
{
  const SbDetectScene *s = &w->scene;

  PetscFunctionBeginUser;
  world_scene(w, PETSC_TRUE, 0, 1);
  PetscCall(world_edges(w));
  *n = w->edges.n;
  *sharp = 0;
  for (PetscInt i = 0; i < *n; i++) {
    const PetscInt *c = w->edges.corner + 4 * i, *v = w->edges.vertex + 2 * i, id = w->edges.id[i];
    const PetscReal *const x[4] = {s->x + 3 * c[0], s->x + 3 * c[1], s->x + 3 * c[2], s->x + 3 * c[3]};

    *sharp += SbEdgeKindOf(x) == SB_EDGE_SHARP;
    SB_CHECK(w->corner_vertex[id] == v[0] && w->corner_vertex[id - id % 3 + (id + 1) % 3] == v[1] &&
               w->corner_vertex[c[2]] == w->corner_vertex[id - id % 3 + (id + 2) % 3],
             "edge %d is not that side of its first facet", (int)i);
    SB_CHECK(c[3] / 3 > id / 3, "edge %d: the first facet has not the lower identity", (int)i);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_made(void)
{
  const PetscReal half[3] = {1, 0.7, 0.4}, X[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -1, 0}};
  const PetscInt squares[3] = {4, 3, 2};
  PetscInt n, sharp, first;
  World w;

  PetscFunctionBeginUser;
  PetscCall(world_create(&w));
  (void)world_box(&w, half, squares);
  PetscCall(count_edges(&w, &n, &sharp));
  SB_CHECK(2 * n == 3 * w.nfacet && sharp == 4 * (4 + 3 + 2), "box: %d edges, %d sharp", (int)n, (int)sharp);
  /* normals of the icosahedron's facets are 42 degrees apart, of the next levels half of that and less */
  for (PetscInt level = 0; level < 3; level++) {
    w.nvertex = w.nfacet = w.npart = 0;
    (void)world_sphere(&w, level);
    PetscCall(count_edges(&w, &n, &sharp));
    SB_CHECK(2 * n == 3 * w.nfacet && sharp == (level ? 0 : 30), "sphere: %d edges, %d sharp", (int)n,
             (int)sharp);
  }
  /* two facets with an edge between them, then a third one there; then one that turns the other way */
  w.nvertex = w.nfacet = 0;
  w.npart = 1;
  first = world_vertex(&w, X[0], 0, PETSC_FALSE);
  for (int i = 1; i < 5; i++) (void)world_vertex(&w, X[i], 0, PETSC_FALSE);
  world_facet(&w, first, first + 1, first + 2);
  world_facet(&w, first + 1, first, first + 4);
  PetscCall(count_edges(&w, &n, &sharp));
  SB_CHECK(n == 1 && !sharp, "two facets of a plane: %d edges, %d sharp", (int)n, (int)sharp);
  world_facet(&w, first + 1, first, first + 3);
  PetscCall(count_edges(&w, &n, &sharp));
  SB_CHECK(n == 0, "three facets at an edge: %d edges", (int)n);
  w.nfacet = 1;
  world_facet(&w, first, first + 1, first + 3);
  PetscCall(count_edges(&w, &n, &sharp));
  SB_CHECK(n == 0, "two facets of opposite orientations: %d edges", (int)n);
  /* the same two with one orientation are a valley, and seen from the other side a ridge */
  for (int i = 0; i < 2; i++) {
    w.nfacet = 0;
    world_facet(&w, first, i ? first + 2 : first + 1, i ? first + 1 : first + 2);
    world_facet(&w, first, i ? first + 1 : first + 3, i ? first + 3 : first + 1);
    PetscCall(count_edges(&w, &n, &sharp));
    SB_CHECK(n == 1 && sharp == i, "%s: %d edges, %d sharp", i ? "ridge" : "valley", (int)n, (int)sharp);
  }
  PetscCall(world_destroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ segments */

static PetscReal point_segment2(const PetscReal p[3], const PetscReal *const b[2])
{
  const PetscReal *const x[3] = {b[0], b[1], b[1]};
  PetscReal w[3], d2;

  (void)SbTriangleClosestPoint(p, x, w, &d2);
  return d2;
}

/* By golden section: the distance from the second segment is convex along the first. */
static PetscReal segments2(const PetscReal *const a[2], const PetscReal *const b[2])
{
  PetscReal lo = 0, hi = 1, best = PetscMin(point_segment2(a[0], b), point_segment2(a[1], b));

  for (int i = 0; i < 90; i++) {
    PetscReal d[2];

    for (int m = 0; m < 2; m++) {
      const PetscReal t = m ? hi - 0.382 * (hi - lo) : lo + 0.382 * (hi - lo);
      PetscReal q[3];

      for (int k = 0; k < 3; k++) q[k] = a[0][k] + t * (a[1][k] - a[0][k]);
      d[m] = point_segment2(q, b);
    }
    best = PetscMin(best, PetscMin(d[0], d[1]));
    if (d[0] < d[1])
      hi = hi - 0.382 * (hi - lo);
    else
      lo = lo + 0.382 * (hi - lo);
  }
  return best;
}

static void check_segments(void)
{
  unsigned state = 3;

  for (int i = 0; i < 4000; i++) {
    PetscReal x[4][3];
    const PetscReal *const a[2] = {x[0], x[1]}, *const b[2] = {x[2], x[3]};
    PetscReal d2;

    for (int q = 0; q < 4; q++) {
      for (int k = 0; k < 3; k++) x[q][k] = number(&state);
    }
    for (int k = 0; k < 3; k++) {
      if (i % 6 == 1) x[3][k] = x[2][k];
      if (i % 6 == 2) x[1][k] = x[0][k];
      if (i % 6 == 3) x[3][k] = x[2][k] + 0.7 * (x[1][k] - x[0][k]); /* parallel */
      if (i % 6 == 4) x[2][k] = x[i / 6 % 2][k];                     /* a common end */
      if (i % 12 == 5) x[1][k] = x[0][k], x[3][k] = x[2][k];
    }
    d2 = SbEdgesDistance2(a, b);
    SB_CHECK(PetscAbsReal(d2 - segments2(a, b)) < 1e-7, "segments %d: squared distance %.12g, not %.12g", i,
             (double)d2, (double)segments2(a, b));
    SB_CHECK_NEAR(SbEdgesDistance2(b, a), d2, 1e-12, "the other way round");
  }
}

/* ------------------------------------------------------------------ tetrahedra */

static const int side[6][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2},
                               {1, 2, 0, 3}, {1, 3, 2, 0}, {2, 3, 0, 1}};
static const int face[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

typedef struct {
  PetscReal x[4][3], x0[4][3];
} Tet;

/* A tetrahedron of positive volume, not too flat. */
static void random_tet(unsigned *state, PetscReal far, Tet *t)
{
  PetscReal e[3][3], n[3], volume;

  do {
    for (int v = 0; v < 4; v++) {
      for (int k = 0; k < 3; k++) t->x[v][k] = number(state) + (k == 2) * far;
    }
    for (int v = 1; v < 4; v++) {
      for (int k = 0; k < 3; k++) e[v - 1][k] = t->x[v][k] - t->x[0][k];
    }
    SbCross(e[0], e[1], n);
    volume = SbDot3(n, e[2]);
  } while (volume < 0.4);
}

/* Edge k, its facets so that the first sees it counter-clockwise: the facets at it are those with corners a b c and b a d. */
static void set_place(const Tet *t, int k, PetscBool moving, SbEdgePlace *p)
{
  PetscReal u[3], v[3], w[3], n[3];
  int c = side[k][2], d = side[k][3];

  for (int i = 0; i < 3; i++) {
    u[i] = t->x[side[k][1]][i] - t->x[side[k][0]][i];
    v[i] = t->x[c][i] - t->x[side[k][0]][i];
    w[i] = t->x[d][i] - t->x[side[k][0]][i];
  }
  SbCross(u, v, n);
  if (SbDot3(n, w) > 0) {
    c = side[k][3];
    d = side[k][2];
  }
  p->thick = 0;
  p->x[0] = t->x[side[k][0]];
  p->x[1] = t->x[side[k][1]];
  p->x[2] = t->x[c];
  p->x[3] = t->x[d];
  for (int q = 0; q < 2; q++) p->x0[q] = moving ? t->x0[side[k][q]] : NULL;
  SbEdgeInto(p);
}

/* Nearest features by examining all: the distance from vertices to faces, and of edges, with the two of the least. */
static void nearest(const Tet t[2], PetscReal *vertices, PetscReal *edges, int which[2])
{
  *vertices = *edges = PETSC_MAX_REAL;
  for (int q = 0; q < 2; q++) {
    for (int i = 0; i < 16; i++) {
      const int *f = face[i % 4];
      const PetscReal *const x[3] = {t[1 - q].x[f[0]], t[1 - q].x[f[1]], t[1 - q].x[f[2]]};
      PetscReal w[3], d2;

      (void)SbTriangleClosestPoint(t[q].x[i / 4], x, w, &d2);
      *vertices = PetscMin(*vertices, PetscSqrtReal(d2));
    }
  }
  for (int i = 0; i < 36; i++) {
    const PetscReal *const a[2] = {t[0].x[side[i / 6][0]], t[0].x[side[i / 6][1]]};
    const PetscReal *const b[2] = {t[1].x[side[i % 6][0]], t[1].x[side[i % 6][1]]};
    const PetscReal d = PetscSqrtReal(SbEdgesDistance2(a, b));

    if (d >= *edges) continue;
    *edges = d;
    which[0] = i / 6;
    which[1] = i % 6;
  }
}

/* Whether an edge of one goes through a face of the other: their features may be far from each other then. */
static PetscBool in_each_other(const Tet t[2])
{
  for (int i = 0; i < 48; i++) {
    const Tet *a = &t[i % 2], *b = &t[1 - i % 2];
    const int *e = side[i / 2 % 6], *f = face[i / 12];
    PetscReal volume[5];

    for (int m = 0; m < 5; m++) { /* of the ends over the face, of the edge around each side of the face */
      const PetscReal *p[4] = {a->x[e[0]], b->x[f[0]], b->x[f[1]], b->x[f[2]]};
      PetscReal d[3][3], n[3];

      if (m == 1) p[0] = a->x[e[1]];
      if (m > 1) p[m - 1] = a->x[e[1]];
      for (int q = 1; q < 4; q++) {
        for (int k = 0; k < 3; k++) d[q - 1][k] = p[q][k] - p[0][k];
      }
      SbCross(d[1], d[2], n);
      volume[m] = SbDot3(d[0], n);
    }
    if ((volume[0] > 0) == (volume[1] > 0)) continue;
    if ((volume[2] > 0) == (volume[3] > 0) && (volume[3] > 0) == (volume[4] > 0)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static void shift(Tet *t, const PetscReal n[3], PetscReal by)
{
  for (int v = 0; v < 4; v++) {
    for (int k = 0; k < 3; k++) t->x[v][k] += by * n[k];
  }
}

/* The pair of edges that are nearest, pushed into each other and through. */
static void push(const Tet apart[2], const int which[2], const SbEdgePair *expected, PetscInt seen[3])
{
  static const PetscReal depth[3] = {0.02, 0.3, 6};
  const PetscBool middle = (PetscBool)(PetscMin(expected->at[0], expected->at[1]) > 0.2 &&
                                       PetscMax(expected->at[0], expected->at[1]) < 0.8);

  for (int i = 0; i < 6; i++) {
    const PetscBool moving = (PetscBool)(i >= 3);
    Tet t[2] = {apart[0], apart[1]};
    SbEdgePlace p[2];
    SbEdgePair pair;
    PetscBool found;

    for (int q = 0; q < 2; q++) {
      for (int v = 0; v < 4; v++) {
        for (int k = 0; k < 3; k++) t[q].x0[v][k] = t[q].x[v][k];
      }
    }
    shift(&t[0], expected->normal, -expected->gap - depth[i % 3]);
    for (int q = 0; q < 2; q++) set_place(&t[q], which[q], moving, &p[q]);
    found = SbEdgesMeet(&p[0], &p[1], 2, &pair);
    /* without a motion the far side is not mistaken for a penetration; with it any depth is one */
    if (i % 3 == 0 && middle) SB_CHECK(found, "edges %g in each other are no pair", (double)depth[i % 3]);
    if (moving) SB_CHECK(found, "edges that went through each other by %g are no pair", (double)depth[i % 3]);
    if (i == 2) SB_CHECK(!found, "edges %g behind each other are a pair", (double)depth[2]);
    if (!found) continue;
    SB_CHECK_NEAR(pair.gap, -depth[i % 3], 1e-12, "depth");
    SB_CHECK_NEAR(SbDot3(pair.normal, expected->normal), 1, 1e-12, "normal");
    seen[i % 3]++;
    /* there and back is not through */
    if (!moving || i != 5) continue;
    t[0] = apart[0];
    for (int v = 0; v < 4; v++) {
      for (int k = 0; k < 3; k++)
        t[0].x0[v][k] = t[0].x[v][k] - (expected->gap + depth[2]) * expected->normal[k];
    }
    for (int q = 0; q < 2; q++) set_place(&t[q], which[q], moving, &p[q]);
    SB_CHECK(!SbEdgesMeet(&p[0], &p[1], 2, &pair) || !pair.crossed, "edges that parted have crossed");
  }
}

static void check_tets(void)
{
  PetscInt pairs = 0, none = 0, seen[3] = {0};
  unsigned state = 29;

  for (int i = 0; i < 6000; i++) {
    Tet t[2];
    PetscReal vertices, edges;
    int which[2] = {0, 0};

    random_tet(&state, 0, &t[0]);
    random_tet(&state, 2.1 + 0.5 * number(&state), &t[1]);
    nearest(t, &vertices, &edges, which);
    if (PetscMin(vertices, edges) < 0.05 || in_each_other(t)) continue;
    for (int k = 0; k < 36; k++) {
      SbEdgePlace p[2];
      SbEdgePair pair;
      const PetscBool those = (PetscBool)(k / 6 == which[0] && k % 6 == which[1]);
      PetscBool found;

      set_place(&t[0], k / 6, PETSC_FALSE, &p[0]);
      set_place(&t[1], k % 6, PETSC_FALSE, &p[1]);
      if (SbEdgeKindOf(p[0].x) < SB_EDGE_SHARP || SbEdgeKindOf(p[1].x) < SB_EDGE_SHARP) continue;
      found = SbEdgesMeet(&p[0], &p[1], 2, &pair);
      if (those && edges < 0.99 * vertices && edges < 2) {
        PetscReal e[3], f[3], n[3];

        for (int m = 0; m < 3; m++) {
          e[m] = p[0].x[1][m] - p[0].x[0][m];
          f[m] = p[1].x[1][m] - p[1].x[0][m];
        }
        SbCross(e, f, n);
        if (SbDot3(n, n) < 0.01 * SbDot3(e, e) * SbDot3(f, f)) continue;
        SB_CHECK(found, "tetrahedra %d: the nearest edges are no pair", i);
        if (!found) continue;
        SB_CHECK_NEAR(pair.gap, edges, 1e-12, "gap");
        SB_CHECK(!pair.crossed, "crossed without a motion");
        push(t, which, &pair, seen);
        pairs++;
      } else if (found) {
        /* the normal is a little out of the cones: then others are hardly nearer */
        SB_CHECK(pair.gap < PetscMin(vertices, edges) + 0.2,
                 "tetrahedra %d: a pair with a gap of %g, nearest %g", i, (double)pair.gap,
                 (double)PetscMin(vertices, edges));
        SB_CHECK(pair.gap > 0, "tetrahedra %d are apart, a pair has a gap of %g", i, (double)pair.gap);
        none++;
      }
    }
  }
  SB_CHECK(pairs > 700 && none < pairs && seen[0] > 1000 && seen[1] > 1000 && seen[2] > 700,
           "%d pairs, %d others, %d %d %d pushed", (int)pairs, (int)none, (int)seen[0], (int)seen[1],
           (int)seen[2]);
}

/* ------------------------------------------------------------------ motions */

#define STEPS 3000

/* Height of the first edge over the second, along the normal, and how far the crossing is from the ends. */
static void look(PetscReal x0[4][3], PetscReal x1[4][3], PetscReal t, PetscReal *height, PetscReal *inside,
                 PetscReal *sine)
{
  PetscReal u[3], v[3], w[3], n[3], a[3], b[3], n2, s, r;

  for (int k = 0; k < 3; k++) {
    PetscReal x[4];

    for (int q = 0; q < 4; q++) x[q] = x0[q][k] + t * (x1[q][k] - x0[q][k]);
    u[k] = x[0] - x[2];
    v[k] = x[1] - x[0];
    w[k] = x[3] - x[2];
  }
  SbCross(v, w, n);
  n2 = SbDot3(n, n);
  SbCross(w, u, a);
  SbCross(v, u, b);
  s = SbDot3(a, n) / n2;
  r = SbDot3(b, n) / n2;
  *height = SbDot3(u, n) / PetscSqrtReal(n2);
  *inside = PetscMin(PetscMin(s, 1 - s), PetscMin(r, 1 - r));
  *sine = PetscSqrtReal(n2 / (SbDot3(v, v) * SbDot3(w, w)));
}

/* What small steps see: 1 through and stays behind, 0 not, -1 too close to say. */
static int stepwise(PetscReal x0[4][3], PetscReal x1[4][3], PetscReal *time)
{
  PetscReal older, before, after, inside, sine;
  int through = 0;

  look(x0, x1, 0, &before, &inside, &sine);
  if (PetscAbsReal(before) < 0.02) return -1;
  older = before;
  for (int i = 1; i <= STEPS; i++) {
    look(x0, x1, (PetscReal)i / STEPS, &after, &inside, &sine);
    if (sine < 0.02) return -1;
    if ((before < 0) != (after < 0)) {
      if (PetscAbsReal(inside) < 0.02) return -1;
      if (inside > 0) {
        through = after < 0;
        *time = (i - 0.5) / STEPS;
      }
    }
    /* it turns around close to the plane */
    if ((after - before) * (before - older) < 0 && PetscAbsReal(before) < 5e-3) return -1;
    older = before;
    before = after;
  }
  return PetscAbsReal(after) < 0.02 ? -1 : after < 0 ? through : 0;
}

static void check_motions(void)
{
  const PetscReal tolerance[2] = {0, 1e-12};
  PetscInt seen[2] = {0};
  unsigned state = 41;

  for (int i = 0; i < 8000; i++) {
    PetscReal x[2][4][3], time = -1, expected_time = -1;
    const PetscReal *const e0[2] = {x[0][0], x[0][1]}, *const e1[2] = {x[1][0], x[1][1]},
                           *const f0[2] = {x[0][2], x[0][3]}, *const f1[2] = {x[1][2], x[1][3]};
    PetscBool behind, through;
    int expected;

    for (int q = 0; q < 4; q++) {
      for (int k = 0; k < 3; k++) {
        x[0][q][k] = number(&state);
        x[1][q][k] = i % 3 ? x[0][q][k] + 0.5 * number(&state) : number(&state);
      }
    }
    for (int k = 0; k < 3 && i % 4 == 0; k++) { /* one is only shifted, the other one stays */
      x[1][1][k] = x[1][0][k] + x[0][1][k] - x[0][0][k];
      x[1][2][k] = x[0][2][k];
      x[1][3][k] = x[0][3][k];
    }
    expected = stepwise(x[0], x[1], &expected_time);
    if (expected < 0) continue;
    seen[expected]++;
    through = SbCCDEdgeEdge(e0, e1, f0, f1, tolerance, &time, &behind);
    SB_CHECK(through == (expected > 0), "motion %d: %s", i,
             expected ? "a passage is missed" : "there is no passage");
    if (through && expected) SB_CHECK_NEAR(time, expected_time, 1. / STEPS, "time of the passage");
  }
  SB_CHECK(seen[0] > 1000 && seen[1] > 200, "%d passages, %d without", (int)seen[1], (int)seen[0]);
}

/* ------------------------------------------------------------------ special */

/* Ridges along x, looking down, over one along `way`, looking up; the upper one at height z, moved along. */
static PetscBool meet(const PetscReal shift_by[3], const PetscReal way[2], const PetscReal from[3],
                      SbEdgePair *pair)
{
  PetscReal x[8][3] = {{-1, 0, 0}, {1, 0, 0}, {0, 0.5, 0.5}, {0, -0.5, 0.5}, {0}}, x0[4][3];
  SbEdgePlace p[2] = {{.thick = 0}, {.thick = 0}};

  for (int k = 0; k < 3; k++) {
    for (int q = 0; q < 4; q++) x[q][k] += shift_by[k];
    for (int q = 0; q < 2; q++) x0[q][k] = from ? x[q][k] - shift_by[k] + from[k] : x[q][k];
  }
  x[4][0] = -(x[5][0] = way[0]);
  x[4][1] = -(x[5][1] = way[1]);
  x[6][0] = -(x[7][0] = -0.5 * way[1]);
  x[6][1] = -(x[7][1] = 0.5 * way[0]);
  x[6][2] = x[7][2] = -0.5;
  for (int k = 0; k < 3; k++) {
    for (int q = 2; q < 4; q++) x0[q][k] = x[q + 2][k];
  }
  for (int q = 0; q < 2; q++) {
    for (int k = 0; k < 4; k++) p[q].x[k] = x[4 * q + k];
    for (int k = 0; k < 2; k++) p[q].x0[k] = from ? x0[2 * q + k] : NULL;
    SbEdgeInto(&p[q]);
  }
  return SbEdgesMeet(&p[0], &p[1], 0.2, pair);
}

static void check_special(void)
{
  const PetscReal cross[2] = {0, 1}, slant[2] = {0.6, 0.8}, along[2] = {1, 0}, nearly[2] = {1, 1e-3};
  SbEdgePair pair;

  SB_CHECK(meet((PetscReal[3]){0, 0, 0.1}, cross, NULL, &pair), "crosswise");
  SB_CHECK_NEAR(pair.gap, 0.1, 1e-15, "gap");
  SB_CHECK_NEAR(pair.normal[2], 1, 1e-15, "normal");
  SB_CHECK(meet((PetscReal[3]){0.3, 0.2, -0.04}, slant, NULL, &pair), "in each other");
  SB_CHECK_NEAR(pair.gap, -0.04, 1e-15, "depth");
  SB_CHECK(!meet((PetscReal[3]){0.3, 0.2, -0.1}, slant, NULL, &pair), "deep in each other");
  SB_CHECK(meet((PetscReal[3]){0, 0, 0}, cross, NULL, &pair) && pair.gap == 0, "touching");
  SB_CHECK(!meet((PetscReal[3]){0, 0, 0.1}, along, NULL, &pair), "parallel");
  SB_CHECK(!meet((PetscReal[3]){0, 0, 0.1}, nearly, NULL, &pair), "nearly parallel");
  SB_CHECK(!meet((PetscReal[3]){1, 0, 0.1}, cross, NULL, &pair), "at a vertex");
  SB_CHECK(!meet((PetscReal[3]){0, 1, 0}, cross, NULL, &pair), "touching at a vertex");
  SB_CHECK(!meet((PetscReal[3]){0, 0, 0.21}, cross, NULL, &pair), "out of reach");
  SB_CHECK(!meet((PetscReal[3]){1.3, 0, 0}, cross, NULL, &pair), "beside it");
  SB_CHECK(meet((PetscReal[3]){0, 0, -3}, cross, (PetscReal[3]){0, 0, 1}, &pair) && pair.crossed,
           "went through");
  SB_CHECK_NEAR(pair.gap, -3, 1e-15, "depth of a passage");
  SB_CHECK(meet((PetscReal[3]){0, 0, -3}, cross, (PetscReal[3]){0, 0, -0.015}, &pair), "lay in contact");
  SB_CHECK(!meet((PetscReal[3]){0, 0, -3}, cross, (PetscReal[3]){0, 0, -0.5}, &pair), "was there before");
  SB_CHECK(!meet((PetscReal[3]){0, 0, -3}, cross, (PetscReal[3]){2.5, 0, 1}, &pair), "passed by");
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_made());
  check_segments();
  check_tets();
  check_motions();
  check_special();
  SB_TEST_END();
}
