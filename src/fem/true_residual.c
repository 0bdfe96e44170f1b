/*
  A direct solver's answer is looked at: |b - A x| is computed once more after the solve.

  A singular matrix (a body that can still turn, held by two of its faces only) is factored without complaint by threshold
  pivoting, and FGMRES, which judges by its own recurrence, then reports convergence with a residual larger than the
  right-hand side. Such a solve ends as failed. What rounding leaves is far below the bound: near nu = 1/2, where lambda / mu is a
  million, 1e-5 of the right-hand side.

  petsc/private/kspimpl.h: the reason of a solve has no public setter.
*/
#include "sbsolver.h"
#include <petsc/private/kspimpl.h>

#define AT_MOST 1e-2 /* of the right-hand side, where no more than that is asked for */

static PetscErrorCode look(KSP ksp, Vec b, Vec x, void *ctx)
{
  PetscReal size, residual;
  Mat A;
  Vec r;

  PetscFunctionBeginUser;
  (void)ctx;
  if (ksp->reason <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetOperators(ksp, &A, NULL));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(MatMult(A, x, r));
  PetscCall(VecAYPX(r, -1., b));
  PetscCall(VecNorm(b, NORM_2, &size));
  PetscCall(VecNorm(r, NORM_2, &residual));
  PetscCall(VecDestroy(&r));
  if (PetscIsInfOrNanReal(residual) ||
      residual > PetscMax(PetscMax(AT_MOST, 2. * ksp->rtol) * size, ksp->abstol)) {
    PetscCall(
      PetscInfo(ksp, "true residual %g of a right-hand side of %g\n", (double)residual, (double)size));
    ksp->reason = KSP_DIVERGED_BREAKDOWN;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverLookAtResidual(KSP ksp)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSetPostSolve(ksp, look, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}
