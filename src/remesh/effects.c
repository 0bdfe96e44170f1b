/*
  Transfers history variables of effects (active contact, friction) to the new model, like a checkpoint with
  renumbered nodes.

  Records of effects without the operation `rename` name no nodes.
*/
#include "remesh_impl.h"

PetscErrorCode SbEffectsHandOver(SbRun from, SbRun to, const SbRenamed *renamed)
{
  const SbModel a = from->model, b = to->model;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(b->space, to->U, &u));
  for (PetscInt k = 0; k < a->neffect; k++) {
    SbEffect e = a->effect[k];
    PetscReal *records, *own;
    PetscInt n, nown, total;

    if (!e->ops.save) continue;
    // gather the records of all ranks on each rank
    SbEffectCall(e, save, a->space, &nown, &own);
    PetscCall(SbAllgatherv(a->space->comm, MPIU_REAL, nown * e->nstate, own, &total, &records, NULL));
    n = e->nstate ? total / e->nstate : 0;
    PetscCall(PetscFree(own));
    if (e->ops.rename) PetscCall((*e->ops.rename)(e, renamed->n, renamed->from, renamed->to, &n, records));
    SbEffectCall(b->effect[k], load, b->space, from->t_now, u, n, records);
    PetscCall(PetscFree(records));
  }
  PetscCall(SbSpaceRestoreLocalRead(b->space, to->U, &u));
  PetscCall(SbModelContactResume(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
