/*
  Directions of the cells of laws with fibres: evaluated once, at the centres of the straight tets
  at rest, of owned cells and ghosts alike, so that nothing is sent. A re-meshed body evaluates them
  for its new tets, and a restarted run again.
*/
#include "fem_impl.h"

PetscErrorCode SbSpaceFindAxes(SbSpace s)
{
  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];

    if (!region->material->type->fibres)
      continue;
    PetscCall(PetscMalloc1(9 * (region->bend - region->bstart), &region->axes));
    for (PetscInt b = region->bstart; b < region->bend; b++) {
      for (PetscInt l = 0; l < SB_BATCH; l++) {
        const PetscInt cell = s->batch_cell[b] + (l < s->batch_n[b] ? l : 0);
        PetscReal x[3] = {0., 0., 0.};
        PetscReal Q[9];

        for (int k = 0; k < 12; k++)
          x[k % 3] += s->mesh->x[3 * s->mesh->cell[4 * cell + k / 3] + k % 3] / 4.;
        PetscCall(SbMaterialAxes(region->material, x, Q));
        SbPackPut(9, Q, (int)l, region->axes + 9 * (b - region->bstart));
      }
    }
  }
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
