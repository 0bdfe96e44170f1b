/*
  contact_state.c - history variables of nodes in contact with an obstacle, for checkpoints.

  A record has the node's original number, whether it is and was active, right-hand side and normal of its constraint, multiplier, gap, and
  friction state: enough to rebuild the constraints of the last solve, and to continue as the uninterrupted run.
*/
#include "contact_node.h"

PetscErrorCode SbEffectSave_Contact(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Contact *c = (const Contact *)e->data;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscMalloc1(SB_CONTACT_STATE * c->n, records));
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    const PetscReal head[8] = {(PetscReal)space->node_orig[touch->node],
                               touch->on,
                               touch->was,
                               touch->rest,
                               touch->kept,
                               touch->lambda,
                               touch->value,
                               touch->gap};
    PetscReal *r = *records + SB_CONTACT_STATE * *n;

    if (!touch->on && !touch->was && touch->lambda == 0) continue;
    PetscCall(PetscArraycpy(r, head, 8));
    PetscCall(PetscArraycpy(r + 8, touch->n, 3));
    PetscCall(PetscArraycpy(r + 11, touch->surface, 3));
    SbFrictionSave(&touch->friction, r + 14);
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectLoad_Contact(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                                    const PetscReal records[])
{
  Contact *c = (Contact *)e->data;
  PetscInt *number, *at;

  PetscFunctionBeginUser;
  SbContactPose(c, t, &c->to);
  PetscCall(PetscMalloc2(c->n, &number, c->n, &at));
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    /* nodes without a record are inactive */
    touch->on = touch->was = touch->idle = PETSC_FALSE;
    touch->along = -1;
    touch->rest = touch->kept = touch->lambda = touch->gap = touch->approach = 0;
    touch->friction = (SbFrictionState){.slide = {-1, -1}};
    for (int k = 0; k < 3; k++) {
      touch->start[k] = touch->now[k] = u[3 * touch->node + k];
      touch->stretch[k] = 0;
    }
    number[i] = space->node_orig[touch->node];
    at[i] = i;
  }
  PetscCall(PetscSortIntWithArray(c->n, number, at));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *r = records + SB_CONTACT_STATE * i;
    PetscInt place;
    Touch *touch;

    PetscCall(PetscFindInt((PetscInt)r[0], c->n, number, &place));
    if (place < 0) continue; /* another rank's */
    touch = &c->touch[at[place]];
    touch->on = (PetscBool)(r[1] != 0);
    touch->was = (PetscBool)(r[2] != 0);
    touch->rest = r[3];
    touch->kept = r[4];
    touch->lambda = r[5];
    touch->value = r[6];
    touch->gap = r[7];
    PetscCall(PetscArraycpy(touch->n, r + 8, 3));
    PetscCall(PetscArraycpy(touch->surface, r + 11, 3));
    SbFrictionLoad(r + 14, &touch->friction);
    SbContactStretch(&c->to, touch);
  }
  PetscCall(PetscFree2(number, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRename_Contact(SbEffect e, PetscInt nnode, const PetscInt from[], const PetscInt to[],
                                      PetscInt *n, PetscReal records[])
{
  PetscInt kept = 0;

  PetscFunctionBeginUser;
  (void)e;
  for (PetscInt i = 0; i < *n; i++) {
    PetscReal *r = records + SB_CONTACT_STATE * i;
    PetscInt place;

    PetscCall(PetscFindInt((PetscInt)r[0], nnode, from, &place));
    if (place < 0) continue;
    r[0] = (PetscReal)to[place];
    PetscCall(PetscArraymove(records + SB_CONTACT_STATE * kept, r, SB_CONTACT_STATE));
    kept++;
  }
  *n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}
