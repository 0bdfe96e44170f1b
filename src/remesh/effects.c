/*
  What effects remember of one model (who touches, who sticks), for another one: as a checkpoint would carry it, with the names of nodes changed.

  What does not say how its names change (SbEffectOps.rename) begins again, as at the start of a run.
*/
#include "remesh_impl.h"

/* The records of all ranks, on all of them. */
static PetscErrorCode gather_records(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  PetscReal *own;
  PetscInt nown, total;

  PetscFunctionBeginUser;
  SbEffectCall(e, save, space, &nown, &own);
  PetscCall(SbGatherAll(space->comm, MPIU_REAL, nown * e->nstate, own, &total, records, NULL));
  *n = e->nstate ? total / e->nstate : 0;
  PetscCall(PetscFree(own));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectsHandOver(SbRun from, SbRun to, const SbRenamed *renamed)
{
  const SbModel a = from->model, b = to->model;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(b->space, to->U, &u));
  for (PetscInt k = 0; k < a->neffect; k++) {
    SbEffect e = a->effect[k];
    PetscReal *records;
    PetscInt n;

    if (!e->ops.save || !e->ops.rename) continue;
    PetscCall(gather_records(e, a->space, &n, &records));
    PetscCall((*e->ops.rename)(e, renamed->n, renamed->from, renamed->to, &n, records));
    SbEffectCall(b->effect[k], load, b->space, from->t_now, u, n, records);
    PetscCall(PetscFree(records));
  }
  PetscCall(SbSpaceRestoreLocalRead(b->space, to->U, &u));
  PetscCall(SbModelContactResume(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
