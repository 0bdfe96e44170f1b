/*
  Contact around the solves of a step: who touches, what is held, whether that was right.
*/
#include "sbmodel.h"

/* All effects write what they hold. */
static PetscErrorCode write_holds(SbModel m)
{
  SbSpace s = m->space;

  PetscFunctionBeginUser;
  if (s->held) SbSpaceHoldClear(s);
  if (s->couple) SbSpaceCoupleClear(s);
  for (PetscInt e = 0; e < m->nhold; e++) SbEffectCall(m->hold[e], hold, s);
  if (s->held) PetscCall(SbSpaceHoldDone(s));
  if (s->couple) PetscCall(SbSpaceCoupleDone(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same, and the displacement goes there. */
static PetscErrorCode hold(SbModel m, PetscReal t, Vec U)
{
  PetscFunctionBeginUser;
  if (!m->nhold) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(write_holds(m));
  PetscCall(SbModelPrescribe(m, t, U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactResume(SbModel m)
{
  PetscFunctionBeginUser;
  if (m->nhold) PetscCall(write_holds(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactBegin(SbModel m, PetscReal t, PetscReal dt, Vec U0, Vec V0, Vec U)
{
  const PetscReal *u0, *u, *v0 = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(m->space, U0, &u0));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  if (m->nrebound) {
    PetscCall(SbModelReboundBegin(m, dt, U0, V0));
    PetscCall(SbSpaceGetLocalRead(m->space, V0, &v0));
  }
  for (PetscInt e = 0; e < m->ntouch; e++) SbEffectCall(m->touch[e], touch, m->space, t, dt, u0, v0, u);
  if (m->nrebound) PetscCall(SbSpaceRestoreLocalRead(m->space, V0, &v0));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U0, &u0));
  PetscCall(hold(m, t + dt, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactSettle(SbModel m, PetscReal t, Vec U, Vec R, PetscBool *again)
{
  const PetscReal *u, *r;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  if (!m->nsettle) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  if (m->space->couple) PetscCall(SbSpaceCoupleMeasure(m->space, U, R));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  for (PetscInt e = 0; e < m->nsettle; e++) SbEffectCall(m->settle[e], settle, m->space, u, r, again);
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, again, 1, SB_MPI_BOOL, MPI_LOR, m->comm));
  if (m->nrebound && !*again && !m->space->rough) PetscCall(SbModelReboundSettle(m, U, again));
  /* a look changes normals and weights: rows that are solved again are those of the last look */
  if (*again || m->space->rough) PetscCall(hold(m, t, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactArrival(SbModel m, PetscReal *part)
{
  PetscFunctionBeginUser;
  *part = 1.;
  for (PetscInt e = 0; e < m->narrive; e++) {
    PetscReal mine = 1.;

    SbEffectCall(m->arrive[e], arrive, &mine);
    *part = PetscMin(*part, mine);
  }
  if (m->narrive) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, part, 1, MPIU_REAL, MPI_MIN, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactVelocity(SbModel m, PetscReal t, PetscReal dt, Vec U, Vec V)
{
  SbStage stage = {.t = t, .dt = dt, .shift_k = 1.};
  PetscScalar *v;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  for (PetscInt e = 0; e < m->ntouch; e++) {
    if (m->touch[e]->ops.rate) SbEffectCall(m->touch[e], rate, m->space, &stage);
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  if (m->space->held) {
    PetscCall(VecGetArray(V, &v));
    SbHeldVelocity(m->space, v);
    PetscCall(VecRestoreArray(V, &v));
  }
  if (m->space->couple) PetscCall(SbCoupleVelocity(m->space, dt, V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactGap(SbModel m, PetscReal t, Vec U, Vec G)
{
  SbStage stage = {.t = t, .shift_k = 1.};
  PetscReal *gap, *normal;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->space->nnode, &gap));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  PetscCall(SbSpaceGetLocalWrite(m->space, G, &normal));
  PetscCall(PetscArrayzero(normal, 3 * m->space->nnode));
  for (PetscInt i = 0; i < m->space->nnode; i++) gap[i] = PETSC_MAX_REAL;
  for (PetscInt e = 0; e < m->ntouch; e++) {
    if (m->touch[e]->ops.near) SbEffectCall(m->touch[e], near, m->space, &stage, gap, normal);
  }
  for (PetscInt i = 0; i < m->space->nnode; i++) {
    for (PetscInt k = 0; k < 3 && gap[i] < PETSC_MAX_REAL; k++) normal[3 * i + k] *= gap[i];
  }
  PetscCall(SbSpaceRestoreLocalWrite(m->space, G, &normal));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscCall(PetscFree(gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactForce(SbModel m, PetscReal t, Vec U, Vec R, Vec F)
{
  SbStage stage = {.t = t, .shift_k = 1.};
  const PetscReal *r;
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  PetscCall(SbSpaceGetLocalWrite(m->space, F, &f));
  PetscCall(PetscArrayzero(f, 3 * m->space->nnode));
  for (PetscInt e = 0; e < m->ntouch; e++) {
    if (m->touch[e]->ops.push) SbEffectCall(m->touch[e], push, m->space, &stage, r, f);
  }
  PetscCall(SbSpaceRestoreLocalWrite(m->space, F, &f));
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  if (m->space->couple) PetscCall(SbSpaceCoupleForce(m->space, U, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactPlaces(SbModel m, PetscReal t, Vec U, Vec R, SbPlaces *list)
{
  SbStage stage = {.t = t, .shift_k = 1.};
  const PetscReal *r;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  for (PetscInt e = 0; e < m->neffect; e++) {
    const PetscInt before = list->n;

    if (!m->effect[e]->ops.places) continue;
    SbEffectCall(m->effect[e], places, m->space, &stage, r, list);
    for (PetscInt i = before; i < list->n; i++) list->place[i].effect = e;
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}
