/*
  The pressure of each cell that goes with lambda: p = -lambda theta(F), theta the change of volume as the law measures it.

  Where poisson is near 0.5 lambda is large and theta small. P1 has fewer displacements than such cells have conditions on
  their volume: it locks, and p alternates between neighbours. CR and DG satisfy the conditions in the mean of each cell and
  p converges (Crouzeix and Raviart 1973; Hansbo and Larson 2002). For DG the strain is that of the means of the two sides.
*/
#include "fem_impl.h"

void SbSpaceCellPressure(SbSpace s, const PetscReal x[], PetscReal pressure[])
{
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    for (PetscInt b = region->bstart; region->owned && b < region->bend; b++) {
      const SbPoints at = SbBatchPoints(s, region, b);
      SbPack F[SB_POINTS][9], p[SB_POINTS];

      SbBatchState(s, region, b, x, F, NULL, NULL, p);
      for (PetscInt l = 0; l < s->batch_n[b]; l++) {
        pressure[s->batch_cell[b] + l] = 0.;
        for (int q = 0; q < at.n; q++) pressure[s->batch_cell[b] + l] += p[q][l] * at.weight[q][l];
      }
    }
  }
}
