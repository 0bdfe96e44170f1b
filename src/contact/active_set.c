/*
  active_set.c - the active-set iteration of contact: constraints before a solve of a step, update
  of the active set after it.
*/
#include "contact_impl.h"

PetscErrorCode SbContactSetResume(const SbContactSet *contacts)
{
  const SbSpace s = contacts->space;

  PetscFunctionBeginUser;
  if (!contacts->n || !s->constraints)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbSpaceClearConstraints(s);
  for (int across = 0; across < 2; across++) /* first the normals of all contacts */
    for (PetscInt k = 0; k < contacts->n; k++)
      CONTACT_CALL(contacts->contact[k], assemble_constraints, s, (PetscBool)across);
  PetscCall(SbSpaceAssembleConstraints(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles the constraints of all contacts, and projects U onto them; prescribed displacements are
   those of the end of the step already. */
static PetscErrorCode constrain(const SbContactSet *contacts, Vec U)
{
  PetscScalar *u;

  PetscFunctionBeginUser;
  if (!contacts->nconstraint)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactSetResume(contacts));
  PetscCall(VecGetArray(U, &u));
  SbSpaceSetPrescribed(contacts->space, u);
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetStartActiveSet(const SbContactSet *contacts, Vec U)
{
  const SbSpace s = contacts->space;
  const PetscReal *u;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt k = 0; k < contacts->n; k++)
    CONTACT_CALL(contacts->contact[k], start_active_set, s, u);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCall(constrain(contacts, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetUpdateActiveSet(SbContactSet *contacts, Vec U, Vec R, PetscBool *again)
{
  const SbSpace s = contacts->space;
  const PetscReal *u, *r;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  PetscCall(VecGetArrayRead(R, &r));
  if (s->constraints)
    SbConstraintsComputeForces(s, u, r);
  PetscCall(VecRestoreArrayRead(R, &r));
  for (PetscInt k = 0; k < contacts->n; k++)
    CONTACT_CALL(contacts->contact[k], update_active_set, s, u, again);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, again, 1, SB_MPI_BOOL, MPI_LOR, s->comm));
  if (contacts->nrestitution && !*again && !s->rough)
    PetscCall(SbContactSetCheckRestitution(contacts, U, again));

  /* a search has changed normals and weights; repeated solves always have the last constraints */
  if (*again || s->rough)
    PetscCall(constrain(contacts, U));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetTimeOfImpact(const SbContactSet *contacts, PetscReal *part)
{
  PetscFunctionBeginUser;
  *part = 1.;
  for (PetscInt k = 0; k < contacts->n; k++)
    if (contacts->contact[k]->ends_step)
      CONTACT_CALL(contacts->contact[k], time_of_impact, part);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, part, 1, MPIU_REAL, MPI_MIN, contacts->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSetProjectVelocity(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                           Vec U, Vec V)
{
  const SbSpace s = contacts->space;
  SbStage stage = {.t = t, .dt = dt, .shift_k = 1.};
  PetscScalar *v;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  for (PetscInt k = 0; k < contacts->n; k++)
    CONTACT_CALL(contacts->contact[k], target_velocity, s, &stage);
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCall(VecGetArray(V, &v));
  SbConstraintsPrescribe(s, PETSC_TRUE, v);
  PetscCall(VecRestoreArray(V, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}
