/*
  Helpers of the estimates: step lengths of finite differences of forces, and
  solves with the last tangent.
*/
#include "ledger_impl.h"

#define PROBE 1e-6 /* finite difference step over the bodies' size: above rounding, nearly linear */

PetscErrorCode SbDifferenceLength(SbLedger l, Vec D, PetscReal *length)
{
  const SbModel m = l->run->model;
  PetscReal size, volume = 0.;

  PetscFunctionBeginUser;
  PetscCall(VecNorm(D, NORM_INFINITY, &size));
  for (PetscInt b = 0; b < m->nbody; b++) volume = PetscMax(volume, m->body[b].volume);
  *length = size > 0. ? PROBE * PetscPowReal(volume, 1. / 3.) / size : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbeSolve(SbLedger l, PetscReal rtol, Vec B, Vec X, PetscInt *its)
{
  PetscReal own_rtol, atol, dtol;
  PetscInt max_it, own_its;
  PetscBool warm, solved;
  KSP ksp;

  PetscFunctionBeginUser;
  l->solving -= MPI_Wtime();
  PetscCall(SbRunSolveTangent(l->run, B, X, its ? its : &own_its, &solved));
  l->solving += MPI_Wtime();
  if (solved) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(l->run->snes, &ksp));
  PetscCall(KSPGetTolerances(ksp, &own_rtol, &atol, &dtol, &max_it));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &warm));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_FALSE));
  PetscCall(KSPSetTolerances(ksp, rtol, 0., dtol, max_it));
  l->solving -= MPI_Wtime();
  PetscCall(KSPSolve(ksp, B, X));
  l->solving += MPI_Wtime();
  if (its) PetscCall(KSPGetIterationNumber(ksp, its));
  PetscCall(KSPSetTolerances(ksp, own_rtol, atol, dtol, max_it));
  PetscCall(KSPSetInitialGuessNonzero(ksp, warm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
