/*
  The history of cells that soften (src/material/mullins.c has the law): at each point the largest
  energy of the shape of all states that were accepted, from that where the run begins on. Within a
  step it is constant, so that a rejected attempt leaves nothing. The law of a batch is exchanged by
  the softened one (SbBatchLaw()), which kernels do not notice.

  Ghosts have the history of their owners to the last bit, as lanes do not depend on each other.
*/
#include "fem_impl.h"

PetscErrorCode SbMullinsCreate(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    struct _p_SbSoftening *a;

    if (!region->material->mullins)
      continue;
    PetscCall(PetscNew(&a));
    region->softening = a;
    a->npoint = SbBatchPoints(s, region->bstart).n;
    PetscCall(PetscCalloc1(a->npoint * (region->bend - region->bstart), &a->most));
    PetscCall(PetscCalloc1(a->npoint * (region->bend - region->bstart), &a->factor));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMullinsDestroy(SbRegion *region)
{
  PetscFunctionBeginUser;
  if (!region->softening)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(region->softening->most));
  PetscCall(PetscFree(region->softening->factor));
  PetscCall(PetscFree(region->softening));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of batch b go on to x; returns what its owned cells lose by that, J. */
static PetscReal advance(SbSpace s, PetscInt b, const PetscReal x[])
{
  const SbRegion *region = s->batch_region[b];
  const struct _p_SbMullins *constants = region->material->mullins;
  const SbPoints at = SbBatchPoints(s, b);
  PetscReal lost = 0.;
  SbPack U[30], F[SB_POINTS][9], W;
  struct _p_SbMaterial own;

  (void)SbBatchLaw(region, region->pointwise, b, &own);
  SbBatchGradients(s, b, x, PETSC_FALSE, U, F);
  for (int q = 0; q < at.n; q++) {
    PetscReal *most = region->softening->most[at.n * (b - region->bstart) + q];

    SbMullinsShape(&own, (const SbPack *)F[q], W);
    for (int l = 0; l < SB_BATCH; l++) {
      if (!(W[l] > most[l]))
        continue;
      if (b < s->nbatch_owned && l < s->batch_n[b])
        lost += at.weight[q][l] * (*at.V)[l] *
                (SbMullinsLost(constants, W[l]) - SbMullinsLost(constants, most[l]));
      most[l] = W[l];
    }
  }
  return lost;
}

PetscErrorCode SbSpaceMullinsAdvance(SbSpace s, Vec U, PetscReal *loss)
{
  PetscReal lost = 0.;
  const PetscReal *u;

  PetscFunctionBeginUser;
  if (!s->softening)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(s->softening_event, 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt b = 0; b < s->nbatch; b++)
    if (s->batch_region[b]->softening)
      lost += advance(s, b, u);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  if (loss) {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lost, 1, MPIU_REAL, MPI_SUM, s->comm));
    *loss += lost;
  }
  PetscCall(PetscLogEventEnd(s->softening_event, 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceMullinsFreeze(SbSpace s, Vec U)
{
  const PetscReal *u = NULL;

  PetscFunctionBeginUser;
  if (U)
    PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    struct _p_SbSoftening *a = region->softening;
    SbPack x[30], F[SB_POINTS][9];
    struct _p_SbMaterial own;

    if (!a)
      continue;
    a->frozen = PETSC_FALSE;
    for (PetscInt b = region->bstart; U && b < region->bend; b++) {
      (void)SbBatchLaw(region, region->pointwise, b, &own);
      SbBatchGradients(s, b, u, PETSC_FALSE, x, F);
      for (int q = 0; q < a->npoint; q++) {
        SbPointLaw(region, b, q, &own);
        SbMullinsFactor(&own, (const SbPack *)F[q],
                        a->factor[a->npoint * (b - region->bstart) + q]);
      }
    }
    a->frozen = (PetscBool)(U != NULL);
  }
  if (U)
    PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpaceMullinsFactor(SbSpace s, const PetscReal u[], PetscReal value[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPoints at = SbBatchPoints(s, b);
    SbPack U[30], F[SB_POINTS][9], eta;
    struct _p_SbMaterial own;

    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      value[s->batch_cell[b] + l] = region->softening ? 0. : 1.;
    if (!region->softening)
      continue;
    (void)SbBatchLaw(region, region->pointwise, b, &own);
    SbBatchGradients(s, b, u, PETSC_FALSE, U, F);
    for (int q = 0; q < at.n; q++) {
      SbPointLaw(region, b, q, &own);
      SbMullinsFactor(&own, (const SbPack *)F[q], eta);
      for (PetscInt l = 0; l < s->batch_n[b]; l++)
        value[s->batch_cell[b] + l] += at.weight[q][l] * eta[l];
    }
  }
}
