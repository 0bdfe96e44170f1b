/*
  Transfers history variables of effects (active contact, friction) to the new model, like a checkpoint with
  renumbered nodes.

  Records of effects that do not say so (SbEffect.by_node) name no nodes.
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

    // renumber the nodes that they begin with; drop those of removed nodes
    if (e->by_node) {
      total = n;
      n = 0;
      for (PetscInt i = 0; i < total; i++) {
        PetscReal *record = records + e->nstate * i;
        PetscInt place;

        PetscCall(PetscFindInt((PetscInt)record[0], renamed->n, renamed->from, &place));
        if (place < 0) continue;
        record[0] = (PetscReal)renamed->to[place];
        PetscCall(PetscArraymove(records + e->nstate * n, record, e->nstate));
        n++;
      }
    }
    SbEffectCall(b->effect[k], load, b->space, from->t_now, u, n, records);
    PetscCall(PetscFree(records));
  }
  PetscCall(SbSpaceRestoreLocalRead(b->space, to->U, &u));
  PetscCall(SbModelContactResume(b));
  PetscFunctionReturn(PETSC_SUCCESS);
}
