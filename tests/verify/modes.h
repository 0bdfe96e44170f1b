/*
  modes.h - lowest eigenvalues w^2 of K x = w^2 M x by subspace iteration with the program's
  stiffness and mass matrices, also for free bodies: the factorised matrix is K + shift M.
*/
#pragma once
#include "verify.h"
#include "sbfactor.h"
#include "sbsolver.h"
#include <petscblaslapack.h>

#define MODES_BLOCK 16

/* Y = M X with the lumped mass; zero on prescribed unknowns. */
static inline PetscErrorCode modes_times_mass(SbSpace s, Vec X, Vec Y)
{
  PetscScalar *y;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(X, Y));
  PetscCall(VecGetArray(Y, &y));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    y[i] *= s->fixed[i / 3] & (1 << i % 3) ? 0. : s->node_mass[i / 3];
  PetscCall(VecRestoreArray(Y, &y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factorisation of K + shift M (1/s^2) at the displacement U. Collective. */
static inline PetscErrorCode modes_factor(SbModel m, PetscReal shift, Vec U, KSP *ksp)
{
  const char *package;
  Mat A;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateMatrix(m->space, SB_MATRIX_AIJ, &A));
  PetscCall(SbModelTangent(m, 0., 0., shift, 1., U, NULL, A));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, ksp));
  PetscCall(KSPSetOperators(*ksp, A, A));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(SbDirectPackage(PETSC_COMM_WORLD, 3 * m->space->Nnode, PETSC_TRUE, &package));
  PetscCheck(package, PETSC_COMM_WORLD, PETSC_ERR_SUP,
             "This PETSc has neither SuiteSparse nor MUMPS");
  PetscCall(SbPCDirectSet(pc, package, PETSC_TRUE));
  PetscCall(PCSetFromOptions(pc));
  PetscCall(SbPCCheckPivots(pc));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rayleigh-Ritz procedure: X, MX = M X_old, Z = A^-1 MX become the next X; value = eigenvalues of
   A, ascending. */
static inline PetscErrorCode modes_ritz(SbSpace s, Vec X[], Vec MX[], Vec Z[],
                                        PetscReal value[MODES_BLOCK])
{
  const PetscBLASInt n = MODES_BLOCK;
  const PetscBLASInt lwork = 4 * MODES_BLOCK;
  PetscScalar a[MODES_BLOCK * MODES_BLOCK], b[MODES_BLOCK * MODES_BLOCK], work[4 * MODES_BLOCK];
  PetscBLASInt type = 1;
  PetscBLASInt info;

  PetscFunctionBeginUser;
  for (int i = 0; i < MODES_BLOCK; i++)
    PetscCall(VecMDot(MX[i], MODES_BLOCK, Z, a + MODES_BLOCK * i));
  for (int i = 0; i < MODES_BLOCK; i++)
    PetscCall(modes_times_mass(s, Z[i], MX[i]));
  for (int i = 0; i < MODES_BLOCK; i++)
    PetscCall(VecMDot(MX[i], MODES_BLOCK, Z, b + MODES_BLOCK * i));
  LAPACKsygv_(&type, "V", "U", &n, a, &n, b, &n, value, work, &lwork, &info);
  PetscCheck(!info, PETSC_COMM_WORLD, PETSC_ERR_LIB, "LAPACK's sygv fails with %d", (int)info);
  for (int i = 0; i < MODES_BLOCK; i++) {
    PetscCall(VecSet(X[i], 0.));
    PetscCall(VecMAXPY(X[i], MODES_BLOCK, a + MODES_BLOCK * i, Z));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lowest MODES_BLOCK eigenvalues, 1/s^2, the first half of them to 1e-6; `shift` (1/s^2) is of the
   same magnitude. Collective. */
static inline PetscErrorCode modes_lowest(SbModel m, PetscReal shift, PetscReal value[MODES_BLOCK])
{
  PetscReal last = 0.;
  PetscRandom random;
  Vec *X, *MX, *Z, U;
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(m->space, &U));
  PetscCall(VecDuplicateVecs(U, MODES_BLOCK, &X));
  PetscCall(VecDuplicateVecs(U, MODES_BLOCK, &MX));
  PetscCall(VecDuplicateVecs(U, MODES_BLOCK, &Z));
  PetscCall(modes_factor(m, shift, U, &ksp));
  PetscCall(PetscRandomCreate(PETSC_COMM_WORLD, &random));
  for (int i = 0; i < MODES_BLOCK; i++)
    PetscCall(VecSetRandom(X[i], random));
  PetscCall(PetscRandomDestroy(&random));
  for (int k = 0; k < 60; k++) {
    for (int i = 0; i < MODES_BLOCK; i++) {
      PetscCall(modes_times_mass(m->space, X[i], MX[i]));
      PetscCall(KSPSolve(ksp, MX[i], Z[i]));
    }
    PetscCall(modes_ritz(m->space, X, MX, Z, value));
    if (PetscAbsReal(value[MODES_BLOCK / 2] - last) < 1e-6 * value[MODES_BLOCK / 2])
      break;
    last = value[MODES_BLOCK / 2];
  }
  for (int i = 0; i < MODES_BLOCK; i++)
    value[i] -= shift;
  PetscCall(VecDestroyVecs(MODES_BLOCK, &X));
  PetscCall(VecDestroyVecs(MODES_BLOCK, &MX));
  PetscCall(VecDestroyVecs(MODES_BLOCK, &Z));
  PetscCall(VecDestroy(&U));
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}
