/*
  Active-set iteration of contact: constraints before a solve of a step, update of the active set
  after it.
*/
#include "model_impl.h"
#include "sblog.h"

PetscErrorCode SbModelContactResume(SbModel m)
{
  SbSpace s = m->space;

  PetscFunctionBeginUser;
  if (!s->constraints)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbSpaceClearConstraints(s);
  for (int across = 0; across < 2; across++) /* first the normals of all effects */
    for (PetscInt e = 0; e < m->nassemble_constraints; e++)
      SbEffectCall(m->assemble_constraints[e], assemble_constraints, s, (PetscBool)across);
  PetscCall(SbSpaceAssembleConstraints(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles the constraints of all effects, and projects U onto them. */
static PetscErrorCode constrain(SbModel m, PetscReal t, Vec U)
{
  PetscFunctionBeginUser;
  if (!m->nassemble_constraints)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbModelContactResume(m));
  PetscCall(SbModelPrescribe(m, t, U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactBeginStep(SbModel m, PetscReal t, PetscReal dt, Vec U0, Vec V0, Vec U)
{
  SbEvaluation start = {.U = U0, .V = m->nrestitution ? V0 : NULL};
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbEvaluationBegin(m, t, &start));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  if (m->nrestitution)
    m->bounce = (struct _SbBounce){.U0 = U0, .V0 = V0, .dt = dt, .left = 1.};
  for (PetscInt e = 0; e < m->nbegin_step; e++)
    SbEffectCall(m->begin_step[e], begin_step, m->space, t, dt, start.stage.u, start.stage.v, u);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCall(SbEvaluationEnd(m, &start));
  PetscCall(constrain(m, t + dt, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactUpdateActiveSet(SbModel m, PetscReal t, Vec U, Vec R, PetscBool *again)
{
  const PetscReal *u, *r;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  if (!m->nupdate_active_set)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
  PetscCall(VecGetArrayRead(R, &r));
  if (m->space->constraints)
    SbConstraintsComputeForces(m->space, u, r);
  PetscCall(VecRestoreArrayRead(R, &r));
  for (PetscInt e = 0; e < m->nupdate_active_set; e++)
    SbEffectCall(m->update_active_set[e], update_active_set, m->space, u, again);
  PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, again, 1, SB_MPI_BOOL, MPI_LOR, m->comm));
  if (m->nrestitution && !*again && !m->space->rough)
    PetscCall(SbModelRestitutionUpdate(m, U, again));

  /* a search has changed normals and weights; repeated solves always have the last constraints */
  if (*again || m->space->rough)
    PetscCall(constrain(m, t, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactVelocity(SbModel m, PetscReal t, PetscReal dt, Vec U, Vec V)
{
  SbEvaluation e = {.U = U};
  PetscScalar *v;

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, t, &e));
  e.stage.dt = dt;
  for (PetscInt k = 0; k < m->nbegin_step; k++)
    if (m->begin_step[k]->ops.target_velocity)
      SbEffectCall(m->begin_step[k], target_velocity, m->space, &e.stage);
  PetscCall(SbEvaluationEnd(m, &e));
  PetscCall(VecGetArray(V, &v));
  SbConstraintsPrescribe(m->space, PETSC_TRUE, v);
  PetscCall(VecRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactGap(SbModel m, PetscReal t, Vec U, Vec G)
{
  SbEvaluation e = {.U = U, .F = G};
  PetscReal *gap;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->space->nnode, &gap));
  PetscCall(SbEvaluationBegin(m, t, &e));
  for (PetscInt i = 0; i < m->space->nnode; i++)
    gap[i] = PETSC_MAX_REAL;
  for (PetscInt k = 0; k < m->neffect; k++)
    if (m->effect[k]->ops.gap)
      SbEffectCall(m->effect[k], gap, m->space, &e.stage, gap, e.f);
  for (PetscInt i = 0; i < 3 * m->space->nnode; i++)
    if (gap[i / 3] < PETSC_MAX_REAL)
      e.f[i] *= gap[i / 3];
  PetscCall(SbEvaluationEnd(m, &e));
  PetscCall(PetscFree(gap));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactForce(SbModel m, PetscReal t, Vec U, Vec F)
{
  SbEvaluation e = {.U = U, .F = F};

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, t, &e));
  for (PetscInt k = 0; k < m->neffect; k++)
    if (m->effect[k]->ops.contact_points && m->effect[k]->ops.force)
      SbEffectCall(m->effect[k], force, m->space, &e.stage, e.f);
  if (m->space->constraints)
    SbConstraintsAddForces(m->space, e.f);
  PetscCall(SbEvaluationEnd(m, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelContactPoints(SbModel m, PetscReal t, Vec U, SbContactPoints *list)
{
  SbEvaluation e = {.U = U};

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, t, &e));
  for (PetscInt k = 0; k < m->neffect; k++) {
    const PetscInt before = list->n;

    if (!m->effect[k]->ops.contact_points)
      continue;
    SbEffectCall(m->effect[k], contact_points, m->space, &e.stage, list);
    for (PetscInt i = before; i < list->n; i++)
      list->point[i].effect = k;
  }
  PetscCall(SbEvaluationEnd(m, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}
