/*
  The norm in the convergence test of linear solves, and checks of their solutions.

  The unpreconditioned (true) residual is used wherever the method computes it and the user does not
  choose a norm; else (minres) the method's default.

  After a direct solve |b - A x| is computed once.

  Threshold pivoting factors a singular matrix (a body that can still rotate) without an error;
  FGMRES, which tests its recurrence, then reports convergence with a true residual larger than the
  right-hand side. Such a solve fails here. Residuals of rounding are far below the bound: near nu =
  1/2, with lambda / mu a million, 1e-5 of the right-hand side.

  The same check follows a solve with another norm where no Newton step tests the residual, and one
  that ends early by the absolute tolerance, as CG does when the preconditioner maps its residual to
  zero.

  petsc/private/kspimpl.h: the converged reason has no public setter, the supported norms of a
  method no public getter.
*/
#include "solver_impl.h"
#include <petsc/private/kspimpl.h>

#define AT_MOST 1e-2 /* largest true residual over the right-hand side, unless 2 rtol is larger */

/* After a solve; early, not NULL: only one that has ended by the absolute tolerance. */
static PetscErrorCode check_residual(KSP ksp, Vec b, Vec x, void *early)
{
  PetscReal size, residual;
  PetscBool single;
  Mat A;
  Vec r;

  PetscFunctionBeginUser;
  if (early && ksp->reason != KSP_CONVERGED_ATOL)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &single));

  /* a fixed number of iterations is not convergence */
  if (ksp->reason <= 0 || (ksp->reason == KSP_CONVERGED_ITS && !single))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPGetOperators(ksp, &A, NULL));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(MatMult(A, x, r));
  PetscCall(VecAYPX(r, -1., b));
  PetscCall(VecNorm(b, NORM_2, &size));
  PetscCall(VecNorm(r, NORM_2, &residual));
  PetscCall(VecDestroy(&r));
  if (PetscIsInfOrNanReal(residual) ||
      residual > PetscMax(PetscMax(AT_MOST, 2. * ksp->rtol) * size, ksp->abstol)) {
    PetscCall(PetscInfo(ksp, "true residual %g of a right-hand side of %g\n", (double)residual,
                        (double)size));
    ksp->reason = KSP_DIVERGED_BREAKDOWN;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* KSPConvergedDefault() with abstol as a tolerance of the true residual. */
static PetscErrorCode converged(KSP ksp, PetscInt n, PetscReal norm, KSPConvergedReason *reason,
                                void *ctx)
{
  PetscReal size;

  PetscFunctionBeginUser;
  (void)ctx;
  *reason = KSP_CONVERGED_ITERATING;
  if (!n) {
    PetscCall(VecNorm(ksp->vec_rhs, NORM_2, &size));
    ksp->rnorm0 = norm;
    ksp->ttol = PetscMax(ksp->rtol, size > 0. ? ksp->abstol / size : 1.) * norm;
  }
  if (PetscIsInfOrNanReal(norm))
    *reason = KSP_DIVERGED_NANORINF;
  else if (norm <= ksp->ttol)
    *reason = KSP_CONVERGED_RTOL;
  else if (norm >= ksp->divtol * ksp->rnorm0 && n)
    *reason = KSP_DIVERGED_DTOL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Priority of a norm in ksp's method, with the user's side if set; 0: not supported. */
static PetscInt norm_support(KSP ksp, KSPNormType norm)
{
  PetscInt best = 0;

  for (PCSide side = PC_LEFT; side < PC_SIDE_MAX; side++)
    if (ksp->pc_side_set == PC_SIDE_DEFAULT || ksp->pc_side_set == side)
      best = PetscMax(best, ksp->normsupporttable[norm][side]);
  return best;
}

PetscErrorCode SbKSPPreferTrueResidual(KSP ksp)
{
  PetscBool norm, side;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_norm_type", &norm));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_pc_side", &side));
  if (!norm && !side && norm_support(ksp, KSP_NORM_UNPRECONDITIONED))
    PetscCall(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbKSPFinish(KSP ksp, PetscBool direct, PetscBool alone, PetscBool forces)
{
  const KSPNormType asked = ksp->normtype_set;
  PetscInt any = 0;
  PetscBool always, other, users;
  char norms[128] = "";
  KSPNormType norm;
  KSPType type;

  PetscFunctionBeginUser;

  /* whether the method has the norm and the side */
  for (norm = KSP_NORM_NONE; norm < KSP_NORM_MAX; norm++) {
    if (!norm_support(ksp, norm))
      continue;
    any += asked == KSP_NORM_DEFAULT || asked == norm;
    PetscCall(PetscStrlcat(norms, norms[0] ? ", " : "", sizeof(norms)));
    PetscCall(PetscStrlcat(norms, KSPNormTypes[norm], sizeof(norms)));
  }
  PetscCall(KSPGetType(ksp, &type));
  PetscCheck(any, PetscObjectComm((PetscObject)ksp), PETSC_ERR_USER,
             "-ksp_type %s has no %s%s%s%s: choose -ksp_norm_type from %s, or -ksp_type fgmres",
             type, asked == KSP_NORM_DEFAULT ? "" : "-ksp_norm_type ",
             asked == KSP_NORM_DEFAULT ? "" : KSPNormTypes[asked],
             ksp->pc_side_set == PC_SIDE_DEFAULT ? "" : " -ksp_pc_side ",
             ksp->pc_side_set == PC_SIDE_DEFAULT ? "" : PCSides[ksp->pc_side_set],
             norms[0] ? norms : "none with that side");

  /* inside Newton's method no check: its next residual is a better test than norms of different
     scale */
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &always));
  PetscCall(KSPGetNormType(ksp, &norm));
  other = (PetscBool)(norm == KSP_NORM_PRECONDITIONED || norm == KSP_NORM_NATURAL);
  if ((direct && norm == KSP_NORM_UNPRECONDITIONED) || (alone && other))
    always = PETSC_TRUE;
  if (always || alone)
    PetscCall(KSPSetPostSolve(ksp, check_residual, always ? NULL : ksp));

  /* the absolute tolerance */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_convergence_test", &users));
  if (forces && other && !users)
    PetscCall(KSPSetConvergenceTest(ksp, converged, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}
