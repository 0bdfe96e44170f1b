// @ranks 1
/*
  Contact detection: all kinds of detector find the same contacts, to the last bit, in random and in degenerate scenes; what is found does
  not depend on the order of facets and points, nor on place, direction and unit of length.
*/
#include "detect_fixture.h"

static const SbDetectKind kinds[] = {SB_DETECT_BRUTE, SB_DETECT_TREE};
#define KINDS ((int)PETSC_STATIC_ARRAY_LENGTH(kinds))

/* How often something happened, over all scenes: the tests must not be empty. */
static struct {
  PetscInt scenes, contacts, inside, crossed, none, edges, edges_in, edges_crossed;
} seen;

/* ------------------------------------------------------------------ random worlds */

/* A row of boxes that touch with equal faces, edges or corners, in no direction but those of the axes. */
static void touching_boxes(World *w, unsigned *state)
{
  const PetscReal half[3] = {0.25, 0.25, 0.25};
  const PetscInt n[3] = {1 + choice(state, 3), 1 + choice(state, 3), 1 + choice(state, 3)};
  PetscReal at[3] = {0, 0, 0};

  for (int b = 0; b < 4; b++) {
    const PetscInt first = world_box(w, half, n);

    for (PetscInt i = first; i < w->nvertex; i++) {
      for (int k = 0; k < 3; k++) {
        w->X[i][k] += at[k];
        w->x[i][k] = w->x0[i][k] = w->X[i][k];
      }
    }
    for (int k = 0; k < 3; k++) at[k] += 0.5 * (PetscReal)choice(state, 2);
  }
}

static void random_parts(World *w, unsigned *state)
{
  const PetscInt parts = 2 + choice(state, 4);

  for (PetscInt b = 0; b < parts; b++) {
    PetscInt first;
    SbPose pose;

    if (choice(state, 2))
      first = world_sphere(w, choice(state, 3));
    else {
      const PetscReal half[3] = {1, 0.7, choice(state, 2) ? 0.02 : 0.5};
      const PetscInt n[3] = {1 + choice(state, 4), 1 + choice(state, 4), 1};

      first = world_box(w, half, n);
    }
    random_pose(state, 0.8, &pose);
    world_place(w, first, 0.4 + 0.2 * number(state), &pose);
  }
}

/* Moves all parts, turns none: x differs from x0 by a motion of each part and some more of each vertex. */
static void set_going(World *w, unsigned *state, PetscReal speed)
{
  PetscReal d[8][3];

  for (int b = 0; b < 8; b++) {
    for (int k = 0; k < 3; k++) d[b][k] = speed * number(state);
  }
  for (PetscInt i = 0; i < w->nvertex; i++) {
    for (int k = 0; k < 3; k++)
      w->x0[i][k] = w->x[i][k] - d[w->vertex_part[i] % 8][k] - 0.1 * speed * number(state);
  }
}

/* Facets without area: vertices fall onto their neighbours, or onto the middle of the opposite edge. */
static void flatten(World *w, unsigned *state)
{
  for (int i = 0; i < 6; i++) {
    const PetscInt f = choice(state, w->nfacet), *v = w->facet[f];

    for (int k = 0; k < 3; k++) {
      w->x[v[0]][k] = i % 2 ? w->x[v[1]][k] : 0.5 * (w->x[v[1]][k] + w->x[v[2]][k]);
      w->x0[v[0]][k] = i % 2 ? w->x0[v[1]][k] : 0.5 * (w->x0[v[1]][k] + w->x0[v[2]][k]);
    }
  }
}

/* One facet that is larger than all else, and a part far away. */
static void huge_and_far(World *w)
{
  const PetscReal far[3] = {0.1, 0.1, 0.1};
  const PetscInt n[3] = {1, 1, 1}, first = w->nvertex;
  const PetscReal X[3][3] = {{-700, -600, 0.05}, {800, -500, 0.04}, {10, 900, 0.06}};
  PetscInt second;

  w->npart++;
  for (int i = 0; i < 3; i++) (void)world_vertex(w, X[i], first, PETSC_FALSE);
  world_facet(w, first, first + 1, first + 2);
  second = world_box(w, far, n);
  for (PetscInt i = second; i < w->nvertex; i++) w->x[i][0] = w->x0[i][0] = w->X[i][0] += 1e6;
}

/* Scene number k of many, with all that the number switches on. */
static PetscErrorCode random_world(World *w, unsigned k)
{
  unsigned state = 77 * k + 1;

  PetscFunctionBeginUser;
  w->nvertex = w->nfacet = w->npart = 0;
  if (k % 5 == 4)
    touching_boxes(w, &state);
  else
    random_parts(w, &state);
  if (k % 7 == 3) huge_and_far(w);
  if (k % 2) set_going(w, &state, k % 4 == 1 ? 0.05 : 0.8);
  if (k % 3 == 2) flatten(w, &state);
  w->scene.self = (PetscBool)(k % 6 >= 4);
  world_scene(w, (PetscBool)(k % 4 != 2), k % 8 == 6 ? 1e-3 : 0, k % 9 == 1 ? 0.4 : 0.06);
  if (!(k % 2)) w->scene.x0 = w->scene.p0 = NULL;
  PetscCall(world_edges(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the same from all */

static PetscBool equal(const SbNear *a, const SbNear *b)
{
  for (int k = 0; k < 3; k++) {
    if (a->weight[k] != b->weight[k] || a->normal[k] != b->normal[k]) return PETSC_FALSE;
  }
  return (PetscBool)(a->point == b->point && a->facet == b->facet && a->gap == b->gap &&
                     a->depth == b->depth && a->crossed == b->crossed);
}

/* What is true of any contact. */
static void check_contact(const SbDetectScene *s, const SbNear *a, unsigned k)
{
  const PetscReal *n = a->normal, *w = a->weight;
  PetscReal r[3], along;

  SB_CHECK(w[0] >= 0 && w[1] >= 0 && w[2] >= 0 && PetscAbsReal(w[0] + w[1] + w[2] - 1) < 1e-14,
           "scene %u: weights %g %g %g", k, (double)w[0], (double)w[1], (double)w[2]);
  SB_CHECK_NEAR(SbDot3(n, n), 1, 1e-13, "length of the normal");
  SB_CHECK(SbDot3(n, s->p_normal + 3 * a->point) < 0, "scene %u: normals that do not oppose each other", k);
  SB_CHECK(a->crossed || PetscAbsReal(a->gap) <= s->reach, "scene %u: gap %g", k, (double)a->gap);
  SB_CHECK(s->self || s->facet_part[a->facet] != s->point_part[a->point], "scene %u: own part", k);
  for (int i = 0; i < 3; i++) {
    r[i] = s->p[3 * a->point + i];
    for (int c = 0; c < 3; c++) r[i] -= w[c] * s->x[3 * s->facet[3 * a->facet + c] + i];
  }
  along = SbDot3(r, n);
  SB_CHECK_NEAR(along, a->gap, 1e-9 * s->reach, "the gap along the normal");
  SB_CHECK(a->depth >= 0 && a->depth <= PetscMax(0, -a->gap), "scene %u: depth %g, gap %g", k,
           (double)a->depth, (double)a->gap);
  if (!a->crossed) {
    /* very near an edge or corner the gap is along a facet's normal there */
    SB_CHECK_NEAR(SbDot3(r, r), a->gap * a->gap, 1e-8 * s->reach * s->reach, "the gap to the nearest point");
    if (SbDot3(r, r) > 1e-8 * s->reach * s->reach)
      SB_CHECK_NEAR(SbDot3(r, r), a->gap * a->gap, 1e-9 * s->reach * s->reach,
                    "the gap to the nearest point");
  }
}

static PetscBool equal_pairs(const SbEdgePair *a, const SbEdgePair *b)
{
  for (int k = 0; k < 3; k++) {
    if (a->normal[k] != b->normal[k]) return PETSC_FALSE;
  }
  for (int k = 0; k < 2; k++) {
    if (a->edge[k] != b->edge[k] || a->at[k] != b->at[k]) return PETSC_FALSE;
  }
  return (PetscBool)(a->gap == b->gap && a->depth == b->depth && a->crossed == b->crossed);
}

/* Corner k of an edge. */
static const PetscReal *end_of(const SbDetectScene *s, PetscInt edge, int k)
{
  return s->x + 3 * s->edges->corner[4 * edge + k];
}

/* What is true of any pair of edges. */
static void check_pair(const SbDetectScene *s, const SbEdgePair *a, unsigned k)
{
  const SbEdges *e = s->edges;
  PetscReal r[3], e0, e1, part = 0;
  SbEdgeKind kind[2];

  SB_CHECK(s->self || e->part[a->edge[0]] != e->part[a->edge[1]], "scene %u: edges of one part", k);
  for (int q = 0; q < 2; q++) {
    const PetscReal *const x[4] = {end_of(s, a->edge[q], 0), end_of(s, a->edge[q], 1),
                                   end_of(s, a->edge[q], 2), end_of(s, a->edge[q], 3)};
    PetscReal d[3], along;

    SB_CHECK(a->at[q] >= 0 && a->at[q] <= 1, "scene %u: place %g", k, (double)a->at[q]);
    kind[q] = SbEdgeKindOf(x);
    for (int i = 0; i < 3; i++) d[i] = x[1][i] - x[0][i];
    along = SbDot3(d, a->normal) / PetscSqrtReal(SbDot3(d, d));
    SB_CHECK_NEAR(along, 0, 1e-12, "normal across the edge");
  }
  SB_CHECK(kind[0] == SB_EDGE_SHARP && kind[1] != SB_EDGE_FLAT, "scene %u: a smooth edge", k);
  SB_CHECK(kind[1] == SB_EDGE_BENT || e->id[a->edge[0]] < e->id[a->edge[1]], "scene %u: the wrong order", k);
  for (int i = 0; i < 3; i++) {
    e0 = (1 - a->at[0]) * end_of(s, a->edge[0], 0)[i] + a->at[0] * end_of(s, a->edge[0], 1)[i];
    e1 = (1 - a->at[1]) * end_of(s, a->edge[1], 0)[i] + a->at[1] * end_of(s, a->edge[1], 1)[i];
    r[i] = e0 - e1;
    part = PetscMax(part, PetscAbsReal(e0));
  }
  SB_CHECK_NEAR(SbDot3(a->normal, a->normal), 1, 1e-13, "length of the normal");
  SB_CHECK_NEAR(SbDot3(r, a->normal), a->gap, 1e-12 * (part + s->reach), "the gap along the normal");
  if (a->crossed) return;
  SB_CHECK(PetscAbsReal(a->gap) <= s->reach, "scene %u: gap %g", k, (double)a->gap);
  SB_CHECK_NEAR(PetscSqrtReal(SbDot3(r, r)), PetscAbsReal(a->gap), 1e-9 * (part + s->reach),
                "nearest places");
}

static PetscErrorCode check_same_edges(SbDetector detector[], const World *w, unsigned k)
{
  const SbEdgePair *pair[KINDS];
  const PetscInt *id = w->edges.id;
  PetscInt n[KINDS];

  PetscFunctionBeginUser;
  for (int i = 0; i < KINDS; i++) {
    PetscCall(SbDetectorFindEdges(detector[i], &w->scene, &n[i], &pair[i]));
    SB_CHECK(n[i] == n[0], "scene %u: kind %d finds %d pairs of edges, brute force %d", k, i, (int)n[i],
             (int)n[0]);
    for (PetscInt j = 0; n[i] == n[0] && j < n[0]; j++) {
      if (equal_pairs(pair[0] + j, pair[i] + j)) continue;
      SB_CHECK(0, "scene %u: pair of edges %d of kind %d is another one", k, (int)j, i);
      break;
    }
  }
  for (PetscInt j = 0; j < n[0]; j++) {
    const SbEdgePair *a = pair[0] + j;

    check_pair(&w->scene, a, k);
    seen.edges_in += a->gap < 0;
    seen.edges_crossed += a->crossed;
    SB_CHECK(!j || a[-1].edge[0] < a->edge[0] ||
               (a[-1].edge[0] == a->edge[0] && id[a[-1].edge[1]] < id[a->edge[1]]),
             "scene %u: pair of edges %d is out of order", k, (int)j);
  }
  seen.edges += n[0];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_same(SbDetector detector[], const World *w, unsigned k)
{
  const SbNear *near[KINDS];
  PetscInt n[KINDS];

  PetscFunctionBeginUser;
  for (int i = 0; i < KINDS; i++) {
    PetscCall(SbDetectorFind(detector[i], &w->scene, &n[i], &near[i]));
    SB_CHECK(n[i] == n[0], "scene %u: kind %d finds %d contacts, brute force %d", k, i, (int)n[i], (int)n[0]);
    for (PetscInt j = 0; n[i] == n[0] && j < n[0]; j++) {
      if (equal(near[0] + j, near[i] + j)) continue;
      SB_CHECK(0, "scene %u: contact %d of kind %d is another one", k, (int)j, i);
      break;
    }
  }
  for (PetscInt j = 0; j < n[0]; j++) {
    check_contact(&w->scene, near[0] + j, k);
    seen.inside += near[0][j].gap < 0;
    seen.crossed += near[0][j].crossed;
    if (!j) continue;
    SB_CHECK(near[0][j - 1].point < near[0][j].point ||
               (near[0][j - 1].point == near[0][j].point &&
                w->scene.facet_part[near[0][j - 1].facet] < w->scene.facet_part[near[0][j].facet]),
             "scene %u: contact %d is out of order", k, (int)j);
  }
  seen.scenes++;
  seen.contacts += n[0];
  seen.none += n[0] == 0;
  PetscCall(check_same_edges(detector, w, k));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_random(void)
{
  SbDetector detector[KINDS];
  World w;

  PetscFunctionBeginUser;
  PetscCall(world_create(&w));
  for (int i = 0; i < KINDS; i++) PetscCall(SbDetectorCreate(kinds[i], &detector[i]));
  for (unsigned k = 0; k < 720; k++) {
    PetscCall(random_world(&w, k));
    PetscCall(check_same(detector, &w, k));
    /* the same facets elsewhere: nothing that depends on the place may be kept */
    for (PetscInt i = 0; i < 3 * w.scene.ncorner; i++) w.corner[0][i] *= 0.95;
    PetscCall(check_same(detector, &w, k));
  }
  /* no facets, no points, neither */
  w.scene.version++;
  for (int k = 0; k < 3; k++) {
    if (k) w.scene.npoint = 0;
    if (k != 1) w.scene.nfacet = w.scene.ncorner = w.edges.n = w.edges.nown = 0;
    PetscCall(check_same(detector, &w, 9999));
  }
  for (int i = 0; i < KINDS; i++) PetscCall(SbDetectorDestroy(&detector[i]));
  PetscCall(world_destroy(&w));
  SB_CHECK(seen.contacts > 20000 && seen.inside > 5000 && seen.crossed > 1000 && seen.none < 400,
           "%d scenes, %d contacts, %d inside, %d crossed, %d scenes without", (int)seen.scenes,
           (int)seen.contacts, (int)seen.inside, (int)seen.crossed, (int)seen.none);
  SB_CHECK(seen.edges > 500 && seen.edges_in > 300 && seen.edges_crossed > 150,
           "%d pairs of edges, %d in each other, %d crossed", (int)seen.edges, (int)seen.edges_in,
           (int)seen.edges_crossed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ whatever the order */

/* Turns the lists of facets and points around, with their identities. */
static void turn_around(World *w)
{
  SbDetectScene *s = &w->scene;

  for (PetscInt f = 0, g = s->nfacet - 1; f < g; f++, g--) {
    for (int k = 0; k < 6; k++) {
      PetscInt *a = (k < 3 ? w->corners : w->corner_vertex) + 3 * f + k % 3, *b = a + 3 * (g - f), t = *a;

      *a = *b;
      *b = t;
    }
    for (int k = 0; k < 2; k++) {
      PetscInt *list = k ? w->part : w->facet_id, t = list[f];

      list[f] = list[g];
      list[g] = t;
    }
  }
  for (PetscInt i = 0, j = s->npoint - 1; i < j; i++, j--) {
    PetscInt *list[4] = {w->point_part, w->point_id, w->point_vertex, w->point_facet};

    for (int k = 0; k < 4; k++) {
      const PetscInt t = list[k][i];

      list[k][i] = list[k][j];
      list[k][j] = t;
    }
    for (int k = 0; k < 12; k++) {
      PetscReal *a = (k < 9 ? w->point[k / 3] : w->normal) + 3 * i + k % 3, *b = a + 3 * (j - i), t = *a;

      *a = *b;
      *b = t;
    }
  }
  s->version++;
}

static PetscErrorCode check_order(void)
{
  SbDetector detector[2];
  PetscInt compared = 0;
  World w;

  PetscFunctionBeginUser;
  PetscCall(world_create(&w));
  for (int i = 0; i < 2; i++) PetscCall(SbDetectorCreate(SB_DETECT_TREE, &detector[i]));
  for (unsigned k = 0; k < 180; k++) {
    const SbNear *a, *b;
    PetscInt na, nb, first = 0;

    PetscCall(random_world(&w, k));
    PetscCall(SbDetectorFind(detector[0], &w.scene, &na, &a));
    turn_around(&w);
    PetscCall(SbDetectorFind(detector[1], &w.scene, &nb, &b));
    SB_CHECK(na == nb, "scene %u: %d contacts, turned around %d", k, (int)na, (int)nb);
    /* the points come in the opposite order, the parts of each in the same */
    for (PetscInt end = na; na == nb && end > 0; end = first) {
      const PetscInt point = a[end - 1].point;

      for (first = end - 1; first > 0 && a[first - 1].point == point;) first--;
      for (PetscInt j = first; j < end; j++) {
        SbNear other = b[na - end + j - first];

        other.point = w.scene.npoint - 1 - other.point;
        other.facet = w.scene.nfacet - 1 - other.facet;
        SB_CHECK(equal(a + j, &other), "scene %u: contact %d is another one when turned around", k, (int)j);
        compared++;
      }
    }
  }
  SB_CHECK(compared > 2000, "%d contacts compared", (int)compared);
  for (int i = 0; i < 2; i++) PetscCall(SbDetectorDestroy(&detector[i]));
  PetscCall(world_destroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ wherever it is */

/* The scene moved as a whole and scaled. */
static void move_all(World *w, PetscReal scale, const SbPose *pose)
{
  PetscReal *list[6] = {w->corner[0], w->corner[1], w->corner[2], w->point[0], w->point[1], w->point[2]};
  PetscReal y[3], none[3] = {0, 0, 0}, n[3];

  for (int m = 0; m < 6; m++) {
    for (PetscInt i = 0; i < (m < 3 ? w->scene.ncorner : w->scene.npoint); i++) {
      for (int k = 0; k < 3; k++) y[k] = scale * list[m][3 * i + k];
      SbPoseApply(pose, y, list[m] + 3 * i);
    }
  }
  SbPoseApply(pose, none, y);
  for (PetscInt i = 0; i < w->scene.npoint; i++) {
    SbPoseApply(pose, w->normal + 3 * i, n);
    for (int k = 0; k < 3; k++) w->normal[3 * i + k] = n[k] - y[k];
  }
  w->scene.reach *= scale;
}

static PetscErrorCode check_place(PetscReal scale, PetscBool exact)
{
  SbDetector detector[2];
  PetscInt compared = 0;
  SbPose pose;
  World w;

  PetscFunctionBeginUser;
  PetscCall(world_create(&w));
  for (int i = 0; i < 2; i++) PetscCall(SbDetectorCreate(SB_DETECT_TREE, &detector[i]));
  for (unsigned k = 0; k < 360; k++) {
    const PetscReal z[3] = {0, 0, 1}, none[3] = {0, 0, 0};
    const SbNear *a, *b;
    PetscInt na, nb;
    unsigned state = k;

    /* in degenerate scenes rounding decides which of two equal ones is found */
    if (k % 5 == 4 || k % 7 == 3 || k % 3 == 2) continue;
    PetscCall(random_world(&w, k));
    PetscCall(SbDetectorFind(detector[0], &w.scene, &na, &a));
    if (exact)
      SbPoseSet(z, 0, none, none, &pose);
    else
      random_pose(&state, 3 * scale, &pose);
    move_all(&w, scale, &pose);
    PetscCall(SbDetectorFind(detector[1], &w.scene, &nb, &b));
    SB_CHECK(na == nb, "scene %u, scale %g: %d contacts, moved %d", k, (double)scale, (int)na, (int)nb);
    for (PetscInt j = 0; na == nb && j < na; j++) {
      PetscReal n[3];

      for (int i = 0; i < 3; i++) n[i] = SbDot3(pose.R + 3 * i, a[j].normal);
      SB_CHECK(a[j].point == b[j].point && a[j].crossed == b[j].crossed, "scene %u: contact %d", k, (int)j);
      SB_CHECK_NEAR(b[j].gap / scale, a[j].gap, 1e-13, "the gap of the moved scene");
      SB_CHECK_NEAR(SbDot3(n, b[j].normal), 1, 1e-9, "the normal of the moved scene");
      compared++;
    }
  }
  SB_CHECK(compared > 2000, "%d contacts compared", (int)compared);
  for (int i = 0; i < 2; i++) PetscCall(SbDetectorDestroy(&detector[i]));
  PetscCall(world_destroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ statistics, errors */

static PetscErrorCode check_stats(void)
{
  SbDetector detector = NULL;
  SbDetectStats stats;
  const SbNear *near;
  PetscInt n;
  World w;

  PetscFunctionBeginUser;
  PetscCall(SbDetectorDestroy(&detector));
  SB_CHECK_ERROR(SbDetectorCreate((SbDetectKind)17, &detector), PETSC_ERR_ARG_OUTOFRANGE, "kind 17");
  PetscCall(world_create(&w));
  PetscCall(SbDetectorCreate(SB_DETECT_TREE, &detector));
  PetscCall(random_world(&w, 3)); /* with a huge facet */
  PetscCall(SbDetectorFind(detector, &w.scene, &n, &near));
  PetscCall(SbDetectorGetStats(detector, &stats));
  SB_CHECK(stats.found == n && n > 0 && stats.candidates >= n, "%d found, %d candidates", (int)stats.found,
           (int)stats.candidates);
  SB_CHECK(stats.memory > 0 && stats.rebuilt == 1, "%d bytes, built %d times", (int)stats.memory,
           (int)stats.rebuilt);
  SB_CHECK(strstr(stats.text, "levels"), "it says: %s", stats.text);
  w.scene.reach = 0;
  SB_CHECK_ERROR(SbDetectorFind(detector, &w.scene, &n, &near), PETSC_ERR_ARG_OUTOFRANGE, "0");
  PetscCall(SbDetectorDestroy(&detector));
  SB_CHECK(!detector, "not NULL after it was destroyed");
  PetscCall(world_destroy(&w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_random());
  PetscCall(check_order());
  PetscCall(check_place(1, PETSC_FALSE));
  PetscCall(check_place(1e-6, PETSC_FALSE));
  PetscCall(check_place(1e3, PETSC_FALSE));
  PetscCall(check_place(1e-6, PETSC_TRUE));
  PetscCall(check_stats());
  SB_TEST_END();
}
