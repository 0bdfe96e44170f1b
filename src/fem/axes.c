/*
  Directions of the cells of laws with fibres, or that contract: evaluated once, at the centres of
  the straight tets at rest, of owned cells and ghosts alike, so that nothing is sent. A re-meshed
  body evaluates them for its new tets, and a restarted run again.
*/
#include "fem_impl.h"

static PetscErrorCode find(SbSpace s, SbRegion *region)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(9 * (region->bend - region->bstart), &region->axes));
  for (PetscInt b = region->bstart; b < region->bend; b++) {
    for (PetscInt l = 0; l < SB_BATCH; l++) {
      const PetscInt cell = s->batch_cell[b] + (l < s->batch_n[b] ? l : 0);
      const PetscReal *given = s->mesh->direction ? s->mesh->direction + 6 * cell : NULL;
      PetscReal x[3], Q[9];

      SbCellCentre(s->mesh, cell, x);
      PetscCall(SbMaterialAxes(region->material, x, given, Q));
      SbPackPut(9, Q, (int)l, region->axes + 9 * (b - region->bstart));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceFindAxes(SbSpace s)
{
  SbCaughtError caught = {0, ""};
  PetscBool any = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < s->mesh->nbody; b++)
    for (PetscInt i = -1; i < s->mesh->body[b].ninclusion; i++)
      any =
        (PetscBool)(any || s->material[i < 0 ? b : s->mesh->body[b].inclusion[i].material]->fibres);
  if (!any)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt r = 0; r < s->nregion && !caught.code; r++)
    if (s->region[r].material->fibres)
      SB_CATCH(&caught, find(s, &s->region[r]));
  PetscCall(SbCaughtRaise(s->comm, &caught));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSpaceCellAxis(SbSpace s, int axis, PetscReal value[])
{
  for (PetscInt b = 0; b < s->nbatch_owned; b++) {
    const SbRegion *region = s->batch_region[b];
    const SbPack *Q = region->axes ? region->axes + 9 * (b - region->bstart) : NULL;

    for (PetscInt l = 0; l < s->batch_n[b]; l++)
      for (int k = 0; k < 3; k++)
        value[3 * (s->batch_cell[b] + l) + k] = Q ? Q[3 * k + axis][l] : 0.;
  }
}
