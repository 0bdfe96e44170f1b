/*
  The current volume of a body, V = sum |T| det F over its cells, and its derivatives, for a pressure on the
  whole surface.

  For P1 dV/du acts on surface nodes only. For CR and DG, whose surface has gaps at its edges, the sum of the facets'
  forces does not vanish, but V depends on strains only and is invariant under translations and rotations: resultant force and moment vanish
  to rounding, and the tangent is exact and symmetric.

    dV/dF = |T| cof F,   d cof F_ij / dF_kl = eps_ikm eps_jln F_mn.
*/
#include "fem_impl.h"
#include "sbkernel.h"

void SbSpaceAddVolumeForce(SbSpace s, PetscInt body, const PetscReal x[], PetscReal factor, PetscReal f[])
{
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    for (PetscInt b = region->bstart; region->body == body && b < region->bend; b++) {
      SbPack U[30], F[SB_POINTS][9], P[9], fe[30];

      SbBatchGradients(s, region, b, x, PETSC_FALSE, U, F);
      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal one[9], cofactor[9];

        SbPackGet(9, (const SbPack *)F[0], l, one);
        SbMatCofactor(one, cofactor);
        for (int k = 0; k < 9; k++) P[k][l] = factor * cofactor[k];
      }
      SbCellForce(s->batch_g + 9 * b, s->batch_V[b], (const SbPack *)P, fe);
      sb_scatter_strain(s, region, b, fe, f);
    }
  }
}

PetscErrorCode SbSpaceAddVolumeTangent(SbSpace s, PetscInt body, const PetscReal x[], PetscReal factor, Mat A)
{
  SbValues values;

  PetscFunctionBeginUser;
  PetscCall(SbValuesBegin(A, &values));
  for (PetscInt r = 0; r < s->nregion; r++) {
    const SbRegion *region = &s->region[r];

    for (PetscInt b = region->bstart; region->body == body && b < region->bend; b++) {
      SbPack U[30], F[SB_POINTS][9], C[81], K[10][9] __attribute__((aligned(64)));

      SbBatchGradients(s, region, b, x, PETSC_FALSE, U, F);
      /* C = factor d cof F / dF: one term for each of the two remaining indices j of i and k. */
      for (int c = 0; c < 81; c++) {
        const int i = c / 27, j = c / 9 % 3, k = c / 3 % 3, n = c % 3;
        const PetscReal sign = ((k + 3 - i) % 3 == 1 ? 1. : -1.) * ((n + 3 - j) % 3 == 1 ? 1. : -1.);
        const PetscReal scale = i == k || j == n ? 0. : sign * s->block_scale * factor;

        for (int l = 0; l < SB_BATCH; l++)
          C[c][l] = scale == 0. ? 0. : scale * F[0][3 * (3 - i - k) + 3 - j - n][l];
      }
      SbCellBlocksGeneral(s->batch_g + 9 * b, s->batch_V[b], (const SbPack *)C, K);
      if (region->broken)
        SbInsertBroken(s, &values, b, (const SbPack(*)[9])K);
      else
        SbInsertBatch(s, &values, b, 10, (const SbPack(*)[9])K);
    }
  }
  PetscCall(SbValuesEnd(&values));
  PetscFunctionReturn(PETSC_SUCCESS);
}
