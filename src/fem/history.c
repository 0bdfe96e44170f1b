/*
  History variables of cells as records of numbers, for checkpoints and re-meshing: those of
  viscoelastic materials (viscous.c) and of materials that soften (mullins.c). A material has one of
  both. The record of a cell has, point by point, what the arrays of its region have there.
*/
#include "fem_impl.h"

/* Of a region: numbers at each point, x[batch][npoint][n]. */
typedef struct {
  SbPack *x;
  PetscInt n;
  PetscBool carried; /* to another mesh, as the mean of the points of a cell */
} Part;

/* Without a history: 0 points. */
static int parts_of(const SbRegion *region, Part part[2])
{
  const struct _p_SbStressHistory *h = region->history;
  const struct _p_SbSoftening *a = region->softening;

  part[0] = part[1] = (Part){NULL, 0, PETSC_FALSE};
  if (a) {
    part[0] = (Part){a->most, 1, PETSC_TRUE};
    return a->npoint;
  }
  if (!h)
    return 0;
  part[0] = (Part){h->last, h->width, PETSC_FALSE};
  part[1] = (Part){h->branch, h->width * region->material->viscous->n, PETSC_TRUE};
  return h->npoint;
}

PetscErrorCode SbHistoryCreate(SbSpace s)
{
  PetscInt all[3] = {0, 0,
                     0}; /* numbers of a cell, whether there are viscoelastic, softened ones */

  PetscFunctionBeginUser;
  PetscCall(SbViscousCreate(s));
  PetscCall(SbMullinsCreate(s));
  for (PetscInt r = 0; r < s->nregion; r++) {
    Part part[2];
    const int npoint = parts_of(&s->region[r], part);

    all[0] = PetscMax(all[0], npoint * (part[0].n + part[1].n));
    all[1] = PetscMax(all[1], s->region[r].history != NULL);
    all[2] = PetscMax(all[2], s->region[r].softening != NULL);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, 3, MPIU_INT, MPI_MAX, s->comm));
  s->nhistory = all[0];
  s->viscous = (PetscBool)all[1];
  s->softening = (PetscBool)all[2];
  if (s->viscous)
    PetscCall(SbLogNamed("Mat", "viscous", &s->viscous_event));
  if (s->softening)
    PetscCall(SbLogNamed("Mat", "mullins", &s->softening_event));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the history of a lane to or from x. */
static void copy_lane(const SbRegion *region, PetscInt b, int l, PetscBool out, PetscReal x[])
{
  Part part[2];
  const int npoint = parts_of(region, part);

  for (int q = 0; q < npoint; q++) {
    for (const Part *p = part; p < part + 2; p++) {
      SbPack *here = p->x + p->n * (npoint * (b - region->bstart) + q);

      for (PetscInt k = 0; k < p->n; k++, x++)
        if (out)
          *x = here[k][l];
        else
          here[k][l] = *x;
    }
  }
}

PetscErrorCode SbSpaceGetHistory(SbSpace s, PetscReal x[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(x, s->nhistory * s->mesh->ncell_owned));
  for (PetscInt b = 0; b < s->nbatch_owned; b++)
    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      copy_lane(s->batch_region[b], b, (int)l, PETSC_TRUE,
                x + s->nhistory * (s->batch_cell[b] + l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceSetHistory(SbSpace s, const PetscReal own[])
{
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->nhistory * s->mesh->ncell, &x));
  PetscCall(PetscArraycpy(x, own, s->nhistory * s->mesh->ncell_owned));
  PetscCall(SbForestBroadcast(s->mesh->cell_sf, s->nhistory, MPIU_REAL, x, x));

  /* padding repeats the first cell */
  for (PetscInt b = 0; b < s->nbatch; b++)
    for (int l = 0; l < SB_BATCH; l++)
      copy_lane(s->batch_region[b], b, l, PETSC_FALSE,
                x + s->nhistory * (s->batch_cell[b] + (l < s->batch_n[b] ? l : 0)));
  PetscCall(PetscFree(x));
  s->viscous_began = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceMeanHistory(SbSpace s, const PetscBool of_body[], PetscBool back,
                                  PetscInt stride, PetscReal x[])
{
  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    Part part[2];
    const int npoint = parts_of(s->batch_region[b], part);
    const PetscInt before = part[0].carried ? 0 : part[0].n;    /* numbers of a point ahead of */
    const PetscInt n = part[0].carried ? part[0].n : part[1].n; /* those that are carried */

    if (!npoint || !of_body[s->batch_region[b]->body])
      continue;
    for (PetscInt l = 0; l < s->batch_n[b]; l++) {
      PetscReal *record = x + stride * (s->batch_cell[b] + l);
      PetscReal mean[SB_HISTORY_POINT] = {0.};

      for (PetscInt k = 0; k < n * npoint && !back; k++)
        mean[k % n] += record[(before + n) * (k / n) + before + k % n] / npoint;
      if (back)
        PetscCall(PetscArraycpy(mean, record, n));
      PetscCall(PetscArrayzero(record, stride));
      if (!back)
        PetscCall(PetscArraycpy(record, mean, n));
      for (PetscInt k = 0; k < n * npoint && back; k++)
        record[(before + n) * (k / n) + before + k % n] = mean[k % n];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
