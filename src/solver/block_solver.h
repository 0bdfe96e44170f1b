/*
  block_solver.h - direct solver for a symmetric positive definite matrix of 3x3 blocks, distributed
  by rows and factored on one rank.
*/
#pragma once
#include "factor.h"

typedef struct _p_SbBlockSolver *SbBlockSolver;
PetscErrorCode SbBlockSolverCreate(MPI_Comm comm, SbBlockSolver *solver);
PetscErrorCode SbBlockSolverDestroy(SbBlockSolver *solver);
/* Symbolic factorisation, as done by SbBlockSolverSetUp() with `changed`; arguments as there.
   Collective. */
PetscErrorCode SbBlockSolverAnalyze(SbBlockSolver solver, PetscInt n, const PetscInt ia[],
                                    const PetscInt ja[]);
/*
  SbBlockSolverSetUp - factors the matrix.

  Collective. Input: n own block rows; ia[n+1], ja: their columns, global, each once;
  block[ia[n]][9], row-major; changed: ia and ja differ from the last call on some rank. Output: ok,
  PETSC_FALSE on all ranks if the matrix is not positive definite.
*/
PetscErrorCode SbBlockSolverSetUp(SbBlockSolver solver, PetscInt n, const PetscInt ia[],
                                  const PetscInt ja[], const PetscReal block[], PetscBool changed,
                                  PetscBool *ok);
/* Operations of a factorisation, entries of the factor. Collective; after
   SbBlockSolverAnalyze(). */
PetscErrorCode SbBlockSolverCost(SbBlockSolver solver, PetscReal *flops, PetscReal *entries);
/* x = A^-1 b, by own rows. Collective. */
PetscErrorCode SbBlockSolverSolve(SbBlockSolver solver, Vec b, Vec x);
