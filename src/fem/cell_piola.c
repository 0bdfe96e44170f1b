/*
  The stress of each cell in the frame of the rest state, with the rotation that turns it into the cell's own. For DG F is that of the means of
  the two sides. P2 has one stress at each point: then that of a cell is their mean.
*/
#include "fem_impl.h"
#include "sbkernel.h"

void SbSpaceCellPiola(SbSpace s, const PetscReal x[], PetscReal P[], PetscReal R[], PetscReal psi[],
                      PetscReal point[])
{
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    for (PetscInt b = region->bstart; region->owned && b < region->bend; b++) {
      SbPack F[4][9], stress[4][9], energy[4], rotation[9];
      const PetscInt n = SbBatchState(s, region, b, x, F, stress, energy, NULL);

      for (PetscInt i = 0; point && region->quadratic && i < n * s->batch_n[b]; i++)
        SbPackGet(9, (const SbPack *)stress[i % n], (int)(i / n), point + 9 * (n * s->batch_cell[b] + i));

      /* means over the points */
      for (PetscInt q = 1; q < n; q++) {
        for (int l = 0; l < SB_BATCH; l++) {
          for (int k = 0; k < 9; k++) {
            F[0][k][l] += (F[q][k][l] - F[0][k][l]) / (PetscReal)(q + 1);
            stress[0][k][l] += (stress[q][k][l] - stress[0][k][l]) / (PetscReal)(q + 1);
          }
          energy[0][l] += (energy[q][l] - energy[0][l]) / (PetscReal)(q + 1);
        }
      }
      if (R && region->material->linear) {
        for (int k = 0; k < 9; k++) {
          for (int l = 0; l < SB_BATCH; l++) rotation[k][l] = k % 4 == 0;
        }
      } else if (R)
        SbPolar((const SbPack *)F[0], rotation);
      for (int l = 0; l < s->batch_n[b]; l++) {
        const PetscInt c = s->batch_cell[b] + l;

        SbPackGet(9, (const SbPack *)stress[0], l, P + 9 * c);
        if (R) SbPackGet(9, (const SbPack *)rotation, l, R + 9 * c);
        psi[c] = energy[0][l];
      }
    }
  }
}
