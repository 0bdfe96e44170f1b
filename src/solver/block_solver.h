/*
  block_solver.h - a symmetric positive definite matrix of 3x3 blocks, whose rows are spread over the ranks, factored on one of them.
*/
#pragma once
#include "factor.h"

typedef struct _p_SbBlockSolver *SbBlockSolver;
PetscErrorCode SbBlockSolverCreate(MPI_Comm comm, SbBlockSolver *solver);
PetscErrorCode SbBlockSolverDestroy(SbBlockSolver *solver);
/* Order of elimination and pattern of the factor, as SbBlockSolverSetUp() finds them with `changed`. Collective. */
PetscErrorCode SbBlockSolverAnalyze(SbBlockSolver solver, PetscInt n, const PetscInt ia[],
                                    const PetscInt ja[]);
/*
  SbBlockSolverSetUp - factors the matrix.

  Collective. Input: n own block rows; ia[n+1], ja: their columns, global, each once; block[ia[n]][9], row-major; changed, ia and ja are
  others than in the last call on some rank. Output: ok, PETSC_FALSE on all ranks where the matrix is not positive definite.
*/
PetscErrorCode SbBlockSolverSetUp(SbBlockSolver solver, PetscInt n, const PetscInt ia[], const PetscInt ja[],
                                  const PetscReal block[], PetscBool changed, PetscBool *ok);
/* Floating-point operations of a factorisation, and entries of the factor. Collective; after SbBlockSolverAnalyze(). */
PetscErrorCode SbBlockSolverCost(SbBlockSolver solver, PetscReal *flops, PetscReal *entries);
/* x = A^-1 b of own rows, [n][3]; they may be the same. Collective. */
PetscErrorCode SbBlockSolverSolve(SbBlockSolver solver, const PetscReal b[], PetscReal x[]);
