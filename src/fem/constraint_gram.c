/*
  The direct solver for the constraints of constraint.c and constraint_velocity.c: their Gram matrix has the constraints of all ranks, which are few, and is
  factored on each of them.
*/
#include "fem_impl.h"
#include "sbconstraint.h"

PetscErrorCode SbConstraintsCreateGramSolver(SbSpace s, Mat gram, KSP *solver)
{
  PetscMPIInt size;
  KSP inner;
  PC pc;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  PetscCall(KSPCreate(s->comm, solver));
  PetscCall(KSPSetOptionsPrefix(*solver, "rows_"));
  PetscCall(KSPSetOperators(*solver, gram, gram));
  PetscCall(KSPSetType(*solver, KSPPREONLY));
  PetscCall(KSPGetPC(*solver, &pc));
  if (size > 1) {
    PetscCall(PCSetType(pc, PCREDUNDANT));
    PetscCall(PCRedundantGetKSP(pc, &inner));
    PetscCall(KSPSetType(inner, KSPPREONLY));
    PetscCall(KSPGetPC(inner, &pc));
  }
  PetscCall(PCSetType(pc, s->constraints->tilted ? PCLU : PCCHOLESKY));
  PetscCall(KSPSetUp(*solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}
