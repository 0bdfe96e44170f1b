/*
  The stress of each cell in the frame of the rest state, with the rotation that turns it into the cell's own. For DG F is that of the means of
  the two sides.
*/
#include "fem_impl.h"
#include "sbkernel.h"

PetscErrorCode SbSpaceCellPiola(SbSpace s, const PetscReal x[], PetscReal P[], PetscReal R[], PetscReal psi[])
{
  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];
    const SbMaterial m = region->material;

    for (PetscInt b = region->bstart; region->owned && b < region->bend; b++) {
      SbLane u[12], F[9], stress[9], rotation[9], energy;

      sb_gather_strain(s, region, b, x, u);
      SbCellGradient(s->batch_g + 9 * b, (const SbLane *)u, F);
      m->ops.stress(m, (const SbLane *)F, stress);
      m->ops.energy(m, (const SbLane *)F, energy);
      if (R && m->linear) {
        for (int k = 0; k < 9; k++) {
          for (int l = 0; l < SB_BATCH; l++) rotation[k][l] = k % 4 == 0;
        }
      } else if (R)
        SbPolar((const SbLane *)F, rotation);
      for (int l = 0; l < s->batch_n[b]; l++) {
        const PetscInt c = s->batch_cell[b] + l;

        SbLaneGet(9, (const SbLane *)stress, l, P + 9 * c);
        if (R) SbLaneGet(9, (const SbLane *)rotation, l, R + 9 * c);
        psi[c] = energy[l];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
