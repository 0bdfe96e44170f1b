/*
  Active-set iteration of contact: constraints before a solve of a step, update of the active set after it.
*/
#include "model_impl.h"
#include "sblog.h"

PetscErrorCode SbModelContactResume(SbModel m)
{
  SbSpace s = m->space;

  PetscFunctionBeginUser;
  if (!s->constraints) PetscFunctionReturn(PETSC_SUCCESS);
  SbSpaceClearConstraints(s);
  for (int across = 0; across < 2; across++) { /* first the normals of all effects */
    for (PetscInt e = 0; e < m->nassemble_constraints; e++)
      SbEffectCall(m->assemble_constraints[e], assemble_constraints, s, (PetscBool)across);
  }
  PetscCall(SbSpaceAssembleConstraints(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles the constraints of all effects, and projects U onto them. */
static PetscErrorCode constrain(SbModel m, PetscReal t, Vec U)
{
  PetscFunctionBeginUser;
  if (!m->nassemble_constraints) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbModelContactResume(m));
  PetscCall(SbModelPrescribe(m, t, U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactBeginStep(SbModel m, PetscReal t, PetscReal dt, Vec U0, Vec V0, Vec U)
{
  const PetscReal *u0, *u, *v0 = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(m->space, U0, &u0));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  if (m->nrestitution) {
    SbModelRestitutionBegin(m, dt, U0, V0);
    PetscCall(SbSpaceGetLocalRead(m->space, V0, &v0));
  }
  for (PetscInt e = 0; e < m->nbegin_step; e++)
    SbEffectCall(m->begin_step[e], begin_step, m->space, t, dt, u0, v0, u);
  if (m->nrestitution) PetscCall(SbSpaceRestoreLocalRead(m->space, V0, &v0));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U0, &u0));
  PetscCall(constrain(m, t + dt, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactUpdateActiveSet(SbModel m, PetscReal t, Vec U, Vec R, PetscBool *again)
{
  const PetscReal *u, *r;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  if (!m->nupdate_active_set) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  PetscCall(VecGetArrayRead(R, &r));
  if (m->space->constraints) SbConstraintsComputeForces(m->space, u, r);
  PetscCall(VecRestoreArrayRead(R, &r));
  for (PetscInt e = 0; e < m->nupdate_active_set; e++)
    SbEffectCall(m->update_active_set[e], update_active_set, m->space, u, again);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, again, 1, SB_MPI_BOOL, MPI_LOR, m->comm));
  if (m->nrestitution && !*again && !m->space->rough) PetscCall(SbModelRestitutionUpdate(m, U, again));
  /* a search has changed normals and weights; repeated solves always have the last constraints */
  if (*again || m->space->rough) PetscCall(constrain(m, t, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactTimeOfImpact(SbModel m, PetscReal *part)
{
  PetscFunctionBeginUser;
  *part = 1.;
  for (PetscInt e = 0; e < m->ntime_of_impact; e++) {
    PetscReal mine = 1.;

    SbEffectCall(m->time_of_impact[e], time_of_impact, &mine);
    *part = PetscMin(*part, mine);
  }
  if (m->ntime_of_impact) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, part, 1, MPIU_REAL, MPI_MIN, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactVelocity(SbModel m, PetscReal t, PetscReal dt, Vec U, Vec V)
{
  SbStage stage = {.t = t, .dt = dt, .shift_k = 1.};
  PetscScalar *v;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  for (PetscInt e = 0; e < m->nbegin_step; e++) {
    if (m->begin_step[e]->ops.target_velocity)
      SbEffectCall(m->begin_step[e], target_velocity, m->space, &stage);
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscCall(VecGetArray(V, &v));
  SbConstraintsVelocity(m->space, v);
  PetscCall(VecRestoreArray(V, &v));
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
  for (PetscInt e = 0; e < m->neffect; e++) {
    if (m->effect[e]->ops.gap) SbEffectCall(m->effect[e], gap, m->space, &stage, gap, normal);
  }
  for (PetscInt i = 0; i < m->space->nnode; i++) {
    for (PetscInt k = 0; k < 3 && gap[i] < PETSC_MAX_REAL; k++) normal[3 * i + k] *= gap[i];
  }
  PetscCall(SbSpaceRestoreLocalWrite(m->space, G, &normal));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscCall(PetscFree(gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactForce(SbModel m, PetscReal t, Vec U, Vec F)
{
  SbStage stage = {.t = t, .shift_k = 1.};
  PetscReal *f;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  PetscCall(SbSpaceGetLocalWrite(m->space, F, &f));
  PetscCall(PetscArrayzero(f, 3 * m->space->nnode));
  for (PetscInt e = 0; e < m->neffect; e++) {
    if (m->effect[e]->ops.contact_points && m->effect[e]->ops.force)
      SbEffectCall(m->effect[e], force, m->space, &stage, f);
  }
  if (m->space->constraints) SbConstraintsAddForces(m->space, f);
  PetscCall(SbSpaceRestoreLocalWrite(m->space, F, &f));
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactPoints(SbModel m, PetscReal t, Vec U, SbContactPoints *list)
{
  SbStage stage = {.t = t, .shift_k = 1.};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  for (PetscInt e = 0; e < m->neffect; e++) {
    const PetscInt before = list->n;

    if (!m->effect[e]->ops.contact_points) continue;
    SbEffectCall(m->effect[e], contact_points, m->space, &stage, list);
    for (PetscInt i = before; i < list->n; i++) list->point[i].effect = e;
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}
