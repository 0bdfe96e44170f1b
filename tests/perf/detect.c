/*
  Speed of contact detection: detect -facets 10000 -detectors tree,brute -rounds 5 [-motion] [-shuffled]

  Two wavy sheets of squares cut in two lie in each other, a hundred facets to a wave whatever their number, so that each point has the same
  surroundings. The sheets shift a little from call to call. Printed are microseconds per point of a call, `sample NAME us VALUE`, the
  detectors taking turns, and the same of the search for sharp edges, of which there are a few; and what was found. -motion: the way since the last call is examined too. -shuffled: facets and
  vertices in random order, the worst that a mesh can do to the cache.
*/
#include "../../src/contact/edge.h"
#include "perf.h"
#include <sbdetect.h>

#define EDGE 0.01 /* m, of a square */
#define WAVE 20   /* squares in a wave length */
#define REACH 0.5 /* edges */

static const struct {
  const char *name;
  SbDetectKind kind;
} kinds[] = {{"tree", SB_DETECT_TREE}, {"brute", SB_DETECT_BRUTE}};

/* Both sheets: corners are points. */
typedef struct {
  PetscInt m; /* squares along a side of each */
  PetscReal *x, *x0, *X, *normal;
  PetscInt *facet, *facet_part, *facet_id, *point_part, *point_id, *point_facet, *place;
  SbEdges edges;
  SbDetectScene scene;
} Sheets;

static unsigned random_below(unsigned *state, unsigned n)
{
  *state = *state * 1664525u + 1013904223u;
  return (unsigned)(((uint64_t)(*state >> 4) * n) >> 28);
}

static PetscErrorCode sheets_create(PetscInt facets, PetscBool shuffled, PetscBool motion, Sheets *s)
{
  const PetscInt m = PetscMax(2, (PetscInt)(PetscSqrtReal((PetscReal)facets / 4) + 0.5));
  const PetscInt np = 2 * (m + 1) * (m + 1), nf = 4 * m * m;
  /* the lower sheet looks up, the upper one down */
  static const int half[2][2][3] = {{{0, 1, 2}, {0, 2, 3}}, {{0, 2, 1}, {0, 3, 2}}};
  unsigned state = 1;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(s, sizeof(*s)));
  s->m = m;
  PetscCall(PetscMalloc4(3 * np, &s->x, 3 * np, &s->x0, 3 * np, &s->X, 3 * np, &s->normal));
  PetscCall(PetscMalloc7(3 * nf, &s->facet, nf, &s->facet_part, nf, &s->facet_id, np, &s->point_part, np,
                         &s->point_id, np, &s->point_facet, np, &s->place));
  for (PetscInt i = 0; i < np; i++) {
    s->place[i] = s->point_id[i] = i;
    s->point_facet[i] = -1;
  }
  for (PetscInt i = np - 1; shuffled && i > 0; i--) {
    const PetscInt j = (PetscInt)random_below(&state, (unsigned)i + 1), t = s->place[i];

    s->place[i] = s->place[j];
    s->place[j] = t;
  }
  for (PetscInt f = 0; f < nf; f++) {
    const PetscInt part = f / (2 * m * m), i = f / 2 % m, j = f / 2 / m % m;
    const PetscInt v[4] = {i, i + 1, i + 1, i}, w[4] = {j, j, j + 1, j + 1};

    for (int k = 0; k < 3; k++) {
      const int c = half[part][f % 2][k];

      s->facet[3 * f + k] = s->place[part * (m + 1) * (m + 1) + w[c] * (m + 1) + v[c]];
    }
    s->facet_part[f] = part;
    s->facet_id[f] = f;
  }
  for (PetscInt f = nf - 1; shuffled && f > 0; f--) {
    const PetscInt g = (PetscInt)random_below(&state, (unsigned)f + 1), part = s->facet_part[f];

    s->facet_part[f] = s->facet_part[g];
    s->facet_part[g] = part;
    for (int k = 0; k < 3; k++) {
      const PetscInt t = s->facet[3 * f + k];

      s->facet[3 * f + k] = s->facet[3 * g + k];
      s->facet[3 * g + k] = t;
    }
  }
  s->scene = (SbDetectScene){
    .ncorner = np, .x = s->x, .X = s->X, .nfacet = nf, .facet = s->facet, .facet_vertex = s->facet};
  s->scene.facet_part = s->facet_part;
  s->scene.facet_id = s->facet_id;
  s->scene.npoint = np;
  s->scene.p = s->x;
  s->scene.P = s->X;
  s->scene.p_normal = s->normal;
  s->scene.point_part = s->point_part;
  s->scene.point_id = s->scene.point_vertex = s->point_id;
  s->scene.point_facet = s->point_facet;
  if (motion) s->scene.x0 = s->scene.p0 = s->x0;
  s->scene.reach = REACH * EDGE;
  s->scene.version = 1;
  PetscCall(SbEdgesCreate(&s->scene, &s->edges));
  s->scene.edges = &s->edges;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode sheets_destroy(Sheets *s)
{
  PetscFunctionBeginUser;
  PetscCall(SbEdgesDestroy(&s->edges));
  PetscCall(PetscFree4(s->x, s->x0, s->X, s->normal));
  PetscCall(
    PetscFree7(s->facet, s->facet_part, s->facet_id, s->point_part, s->point_id, s->point_facet, s->place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the sheets are at a round: the upper one wanders over the lower one. */
static PetscErrorCode sheets_move(Sheets *s, int round)
{
  const PetscInt n = s->m + 1;

  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(s->x0, s->x, 3 * s->scene.npoint));
  for (PetscInt i = 0; i < s->scene.npoint; i++) {
    const PetscInt v = s->place[i], part = i / (n * n);
    const PetscReal a = 2 * PETSC_PI / (WAVE * EDGE), high = 0.1 * WAVE * EDGE,
                    shift = part ? (0.31 + 0.1 * round) * EDGE : 0;
    const PetscReal x = (PetscReal)(i % n) * EDGE + shift, y = (PetscReal)(i / n % n) * EDGE + shift;
    const PetscReal sx = PetscSinReal(a * x), cx = PetscCosReal(a * x), sy = PetscSinReal(a * y),
                    cy = PetscCosReal(a * y);
    const PetscReal up[3] = {-high * a * cx * sy, -high * a * sx * cy, 1},
                    length = PetscSqrtReal(SbDot3(up, up));

    s->x[3 * v] = x;
    s->x[3 * v + 1] = y;
    s->x[3 * v + 2] = high * sx * sy + (part ? 0.1 * EDGE * PetscSinReal(1.7 * x / EDGE + y / EDGE) : 0);
    for (int k = 0; k < 3; k++) s->normal[3 * v + k] = (part ? -1 : 1) * up[k] / length;
    s->point_part[v] = part;
  }
  PetscCall(PetscArraycpy(s->X, s->x, 3 * s->scene.npoint));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode measure(Sheets *s, const char *names, PetscInt rounds)
{
  SbDetector detector[PETSC_STATIC_ARRAY_LENGTH(kinds)] = {NULL};
  SbDetectStats stats;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(kinds); k++) {
    if (strstr(names, kinds[k].name)) PetscCall(SbDetectorCreate(kinds[k].kind, &detector[k]));
  }
  PetscCall(sheets_move(s, 0));
  for (int round = 1; round <= rounds; round++) {
    PetscCall(sheets_move(s, round));
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(kinds); k++) {
      const SbNear *near;
      const SbEdgePair *pair;
      PerfClock clock, edges;
      PetscInt n, npair;
      char name[32];

      if (!detector[k]) continue;
      clock = perf_start();
      PetscCall(SbDetectorFind(detector[k], &s->scene, &n, &near));
      clock = perf_stop(clock);
      edges = perf_start();
      PetscCall(SbDetectorFindEdges(detector[k], &s->scene, &npair, &pair));
      edges = perf_stop(edges);
      PetscCheck(50 * npair < s->scene.npoint, PETSC_COMM_SELF, PETSC_ERR_PLIB,
                 "The sheets have sharp edges");
      /* the first call allocates and finds the neighbours: it is not counted */
      if (round > 1) PetscCall(perf_sample(kinds[k].name, "us", 1e6 * clock.cpu / (double)s->scene.npoint));
      PetscCall(PetscSNPrintf(name, sizeof(name), "%s_edges", kinds[k].name));
      if (round > 1) PetscCall(perf_sample(name, "us", 1e6 * edges.cpu / (double)s->scene.npoint));
    }
  }
  PetscCall(perf_fact("facets", s->scene.nfacet));
  PetscCall(perf_fact("points", s->scene.npoint));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(kinds); k++) {
    if (!detector[k]) continue;
    PetscCall(SbDetectorGetStats(detector[k], &stats));
    PetscCall(perf_fact("found", stats.found));
    PetscCall(perf_fact("candidates", (double)stats.candidates));
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s\n", stats.text));
    PetscCall(SbDetectorDestroy(&detector[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char names[64] = "tree";
  PetscInt facets = 10000, rounds = 6;
  PetscBool motion = PETSC_FALSE, shuffled = PETSC_FALSE;
  Sheets sheets;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-detectors", sizeof(names), names));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-facets", &facets, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-motion", &motion, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-shuffled", &shuffled, NULL));
  PetscCall(sheets_create(facets, shuffled, motion, &sheets));
  PetscCall(measure(&sheets, names, rounds));
  PetscCall(sheets_destroy(&sheets));
  PetscCall(PetscFinalize());
  return 0;
}
