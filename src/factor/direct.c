/*
  Direct solvers by MUMPS or SuiteSparse, on any number of ranks.

  MUMPS factors a distributed matrix. CHOLMOD (positive definite matrices) and UMFPACK (any), both
  of SuiteSparse, work on one rank: on several, PCTELESCOPE gathers the matrix and each right-hand
  side there, and the others wait: cheaper than to factor the matrix on every rank (PCREDUNDANT),
  and up to SB_DIRECT_SMALL unknowns cheaper than MUMPS (docs/reports/gathered.md).
*/
#include "sbfactor.h"

PetscErrorCode SbDirectPackage(MPI_Comm comm, PetscInt unknowns, PetscBool definite,
                               const char **package)
{
  const char *order[4];
  PetscBool reproducible;
  PetscMPIInt size;
  int n = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(SbOptionBool(&SbRunScope, "reproducible", &reproducible));
  if (definite && (size == 1 || unknowns <= SB_DIRECT_SMALL))
    order[n++] = MATSOLVERCHOLMOD;
  if (size == 1 || !reproducible)
    order[n++] = MATSOLVERMUMPS;
  if (definite)
    order[n++] = MATSOLVERCHOLMOD;
  order[n++] = MATSOLVERUMFPACK;
  *package = NULL;
  for (int k = 0; k < n && !*package; k++) {
    PetscBool has;

    PetscCall(SbHasPackage(order[k], &has));
    if (has)
      *package = order[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCDirectSet(PC pc, const char *package, PetscBool symmetric)
{
  const PetscBool mumps = (PetscBool)!strcmp(package, MATSOLVERMUMPS);
  const PetscBool umfpack = (PetscBool)!strcmp(package, MATSOLVERUMFPACK);
  const char *options = "-mat_cholmod_factor supernodal -mat_cholmod_print 0";
  const char *outer;
  char prefix[96];
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)pc), &size));
  PetscCall(PCGetOptionsPrefix(pc, &outer));
  PetscCall(PetscSNPrintf(prefix, sizeof(prefix), "%s%s", outer ? outer : "",
                          size > 1 && !mumps ? "telescope_" : ""));
  if (size == 1 || mumps) {
    PetscCall(PCSetType(pc, umfpack || !symmetric ? PCLU : PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, package));
  } else {
    PetscCall(PCSetType(pc, PCTELESCOPE));
    PetscCall(PCTelescopeSetReductionFactor(pc, size));
    PetscCall(PCSetApplicationContext(
      pc, (void *)(uintptr_t)package)); /* its options are set at the first set-up */
  }

  /* MUMPS counts all negative pivots only if the last front is not distributed; CHOLMOD otherwise
     factors small indefinite matrices, by L D L^T, and a failure is the solver's reason */
  if (mumps)
    options = "-mat_mumps_icntl_13 1 -mat_mumps_icntl_14 100";
  else if (umfpack)
    options = "-mat_umfpack_ordering METIS";
  PetscCall(SbOptionsSetDefaults(prefix, options, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCDirectGathered(PC pc, const char **package)
{
  PetscBool is;

  PetscFunctionBeginUser;
  *package = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCTELESCOPE, &is));
  if (is)
    PetscCall(PCGetApplicationContext(pc, (void *)package));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCDirectCountNegative(PC pc, PetscInt *negative)
{
  PetscBool cholesky;
  MatSolverType type = NULL;
  PetscInt serial_root;
  PetscMPIInt nrank;
  Mat F;

  PetscFunctionBeginUser;
  *negative = -1;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &cholesky));
  if (cholesky)
    PetscCall(PCFactorGetMatSolverType(pc, &type));
  if (!type || strcmp(type, MATSOLVERMUMPS))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCFactorGetMatrix(pc, &F));
  PetscCall(MatMumpsGetIcntl(F, 13, &serial_root));
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)F), &nrank));
  if (nrank == 1 || serial_root == 1)
    PetscCall(MatGetInertia(F, negative, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}
