/*
  The current volume of a body, V = sum |T| det F over its cells, and derivatives, for pressure all
  around.

  For P1 dV/du acts on surface nodes only. For CR and DG, whose surface has gaps at its edges, the
  sum of the facets' forces does not vanish, but V depends on strains only and is invariant under
  translations and rotations: resultant force and moment vanish to rounding, and the tangent is
  exact and symmetric.

    dV/dF = |T| cof F,   d cof F_ij / dF_kl = eps_ikm eps_jln F_mn.
*/
#include "fem_impl.h"
#include "sbkernel.h"

PetscErrorCode SbSpaceAddVolume(SbSpace s, PetscInt body, const PetscReal x[], PetscReal factor,
                                PetscReal f[], Mat A)
{
  SbMatBlocks values;

  PetscFunctionBeginUser;
  if (A)
    PetscCall(SbMatGetBlocks(A, PETSC_TRUE, &values));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    SbPack U[30], F[SB_POINTS][9], P[9], fe[30], C[81], scale,
      K[10][9] __attribute__((aligned(64)));

    if (s->batch_region[b]->body != body)
      continue;
    SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
    if (A) {
      memset(C, 0, sizeof(C));
      for (int l = 0; l < SB_BATCH; l++)
        scale[l] = s->block_scale * factor;
      SbAddCofactorTangent((const SbPack *)F[0], scale, C);
      SbCellBlocksGeneral(s->batch_g + 9 * b, s->batch_V[b], (const SbPack *)C, K);
      SbInsertBatch(s, &values, b, 10, s->batch_region[b]->broken, (const SbPack(*)[9])K);
      continue;
    }
    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal one[9], cofactor[9];

      SbPackGet(9, (const SbPack *)F[0], l, one);
      SbMatCofactor(one, cofactor);
      for (int k = 0; k < 9; k++)
        P[k][l] = factor * cofactor[k];
    }
    SbCellForce(s->batch_g + 9 * b, s->batch_V[b], (const SbPack *)P, fe);
    sb_scatter_strain(s, b, fe, f);
  }
  if (A)
    PetscCall(SbMatRestoreBlocks(&values));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbSpaceVolume(SbSpace s, PetscInt body, const PetscReal x[])
{
  PetscReal volume = 0.;

  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    SbPack U[30], F[SB_POINTS][9];

    if (s->batch_region[b]->body != body)
      continue;
    SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal one[9];

      SbPackGet(9, (const SbPack *)F[0], l, one);
      volume += s->batch_V[b][l] * SbMatDet(one);
    }
  }
  return volume;
}
