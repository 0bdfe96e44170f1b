// @ranks 1
/*
  Search for pairs of contact: the hash and the trees give the same pairs in the same order, from
  search to search of a motion, none while they stay in their boxes; on several ranks each has those
  of its own features, and all together those of one, while a rank's table gets smaller.
*/
#include "../sheets.h"

#define MOST_RANKS 8

/* The pairs of one rank at three instants by both searches; pairs of the rank's own first
   vertices at the end, entries of the hash before. */
static PetscErrorCode check_sheets(const SheetsShape *shape, PetscInt *npair, PetscInt *nentry)
{
  PetscReal *x[2];
  SbContactPairs pairs[2];
  PetscInt count[3];
  Sheets sheets;

  PetscFunctionBeginUser;
  PetscCall(sheets_create(shape, &sheets));
  PetscCall(PetscMalloc2(3 * sheets.surface.nvertex, &x[0], 3 * sheets.surface.nvertex, &x[1]));
  for (int s = 0; s < 2; s++)
    PetscCall(
      SbContactPairsCreate(&sheets.surface, 0.05, s ? SB_SEARCH_TREE : SB_SEARCH_HASH, &pairs[s]));
  for (int instant = 0; instant < 4; instant++) {
    sheets_move(&sheets, 0.5 * instant, x[0]);
    sheets_move(&sheets, instant % 2 ? 0.5 * instant : 3. + instant, x[1]);
    if (instant == 3) /* one vertex goes far: a search */
      x[1][7] += 1e4;
    for (int s = 0; s < 2; s++)
      PetscCall(SbContactPairsFind(pairs[s], x[0], x[1]));
    if (instant == 2) {
      SbSpatialHashCount(pairs[0]->hash, count);
      *nentry = count[1];
    }
    SB_CHECK(pairs[0]->nsearch == pairs[1]->nsearch && pairs[0]->nsearch == PetscMax(1, instant),
             "%d and %d searches", (int)pairs[0]->nsearch, (int)pairs[1]->nsearch);
    SB_CHECK(pairs[0]->n == pairs[1]->n && pairs[0]->n > 50, "%d and %d pairs", (int)pairs[0]->n,
             (int)pairs[1]->n);
    for (PetscInt i = 0; i < PetscMin(pairs[0]->n, pairs[1]->n); i++) {
      const SbContactPair *p = &pairs[0]->pair[i];
      const SbContactPair *q = &pairs[1]->pair[i];
      PetscBool same;

      PetscCall(PetscArraycmp(p->v, q->v, 4, &same));
      SB_CHECK(same && p->kind == q->kind && p->area == q->area && p->side == q->side,
               "pair %d is another one", (int)i);
    }
  }
  *npair = 0;
  for (PetscInt i = 0; i < pairs[0]->n; i++)
    *npair += sheets.surface.own[pairs[0]->pair[i].v[0]];
  for (int s = 0; s < 2; s++)
    PetscCall(SbContactPairsDestroy(&pairs[s]));
  PetscCall(PetscFree2(x[0], x[1]));
  PetscCall(sheets_destroy(&sheets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscInt npair, nentry;
  PetscInt one = 0;
  PetscInt all = 0;
  PetscInt entries[2] = {0, 0};

  PetscCall(SbLogInitialize());
  for (int k = 0; k < 8; k++) {
    const SheetsShape shape = {.nfacet = 1500,
                               .size = 1,
                               .self = (PetscBool)(k & 1),
                               .shuffled = (PetscBool)(k >> 1 & 1),
                               .plate = (PetscBool)(k >> 2)};

    PetscCall(check_sheets(&shape, &npair, &nentry));
  }
  for (PetscMPIInt rank = -1; rank < MOST_RANKS; rank++) {
    const SheetsShape shape = {
      .nfacet = 3000, .rank = PetscMax(0, rank), .size = rank < 0 ? 1 : MOST_RANKS};

    PetscCall(check_sheets(&shape, &npair, &nentry));
    *(rank < 0 ? &one : &all) += npair;
    entries[rank >= 0] = PetscMax(entries[rank >= 0], nentry);
  }
  SB_CHECK(one == all, "%d pairs on one rank, %d on %d", (int)one, (int)all, MOST_RANKS);
  SB_CHECK(entries[1] < entries[0] / 2, "%d entries on one rank, %d on one of %d", (int)entries[0],
           (int)entries[1], MOST_RANKS);
  SB_TEST_END();
}
