/*
  Search for pairs of contact by the spatial hash and by trees of boxes: search -facets 2000
  [-motion] [-self] [-shuffled] [-plate] [-rounds 8]

  Two wavy sheets move by a tenth of an edge from search to search, so that each one searches anew;
  with -motion the search is along a motion of a whole edge. Microseconds of processor time per
  feature (vertices, edges and triangles), the two searches by turns; their pairs are compared.
*/
#include "../sheets.h"
#include "perf.h"

int main(int argc, char **argv)
{
  static const char *const names[] = {"hash", "tree"};
  SB_TEST_BEGIN(argc, argv);
  SheetsShape shape = {.nfacet = 2000, .size = 1};
  PetscInt rounds = 8;
  PetscInt repeat;
  PetscReal ahead, nfeature, *x[2];
  PetscBool motion = PETSC_FALSE;
  SbContactPairs pairs[2];
  Sheets sheets;

  PetscCall(SbLogInitialize());
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-facets", &shape.nfacet, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-motion", &motion, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-self", &shape.self, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-shuffled", &shape.shuffled, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-plate", &shape.plate, NULL));
  PetscCall(sheets_create(&shape, &sheets));
  nfeature = (PetscReal)(sheets.surface.nvertex + sheets.surface.ntriangle + sheets.surface.nedge);
  repeat = PetscMax(1, (PetscInt)(2e5 / nfeature));
  ahead = motion ? 3. : 0.;
  PetscCall(PetscMalloc2(3 * sheets.surface.nvertex, &x[0], 3 * sheets.surface.nvertex, &x[1]));
  for (int s = 0; s < 2; s++)
    PetscCall(
      SbContactPairsCreate(&sheets.surface, 0.05, s ? SB_SEARCH_TREE : SB_SEARCH_HASH, &pairs[s]));
  for (PetscInt round = 0; round <= rounds; round++) {
    for (int s = 0; s < 2; s++) {
      double sum = 0.;

      for (PetscInt k = 0; k < repeat; k++) {
        const PetscReal t = 0.3 * (PetscReal)(round + k % 2);
        PerfClock start;

        sheets_move(&sheets, t, x[0]);
        sheets_move(&sheets, t + ahead, x[1]);
        pairs[s]->known = PETSC_FALSE;
        start = perf_start();
        PetscCall(SbContactPairsFind(pairs[s], x[0], x[1]));
        sum += perf_stop(start).cpu;
      }
      if (round > 0) /* the first one allocates and builds */
        PetscCall(perf_sample(names[s], "us/feature", 1e6 * sum / nfeature / (double)repeat));
    }
    SB_CHECK(pairs[0]->n == pairs[1]->n && !memcmp(pairs[0]->pair, pairs[1]->pair,
                                                   (size_t)pairs[0]->n * sizeof(*pairs[0]->pair)),
             "%d and %d pairs", (int)pairs[0]->n, (int)pairs[1]->n);
  }
  PetscCall(perf_fact("features", (double)nfeature));
  PetscCall(perf_fact("candidates", (double)pairs[0]->ncandidate));
  PetscCall(perf_fact("pairs", (double)pairs[0]->n));
  for (int s = 0; s < 2; s++)
    PetscCall(SbContactPairsDestroy(&pairs[s]));
  PetscCall(PetscFree2(x[0], x[1]));
  PetscCall(sheets_destroy(&sheets));
  SB_TEST_END();
}
