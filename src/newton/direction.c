/*
  The direction of a Newton step: K p = -F, with K made definite where it has to be.

  Tangent. K is exact at first. At negative curvature or pivots in the linear solver, or if p is no
  descent direction, negative eigenvalues of the cells are set to zero and the system is solved
  again (Longva et al. 2023, "Pitfalls of projection"); after a full step the exact one is tried
  again. Forces without a potential (the free rim of a follower pressure) have equilibria where its
  symmetric part is not definite: the exact tangent is kept if it has as many negative eigenvalues
  as at the start of the load step, or after a full step to a residual below the first.

  Barriers. Their Hessian is the positive part of each pair's, and after a full step the exact one,
  which alone converges superlinearly near the solution. Friction whose slip reversed is treated as
  sticking, and bounded from above where p is no descent direction. An indefinite tangent is shifted
  by the least sufficient multiple of the mass matrix (Nocedal and Wright, algorithm 3.3) before
  cells are filtered: in a collapse nearly all cells have a negative eigenvalue but the assembled
  tangent has few, and filtering leads to steps of a hundredth.
*/
#include "newton_impl.h"

#define ACCURATE 1e-6 /* relative tolerance of an accurate linear solve */
#define STEEP 0.01    /* of the slope of the quadratic model: least slope of E along a direction */
#define SHIFT 0.1     /* least shift of an indefinite tangent, over that of inertia */
#define SHIFT_STIFF 1e-4 /* the same, relative to the mean ratio of stiffness and mass */
#define SHIFTS 8 /* tries, each with a shift SHIFT_MORE times as large, before cells are filtered */
#define SHIFT_MORE 4.
#define SHIFT_NONE 1e-300 /* asks for the least shift */

/* Solves K Y = F, K with the Hessian of barriers, or its substitute, where there is contact. */
static PetscErrorCode solve_linear(SNES snes, KSPConvergedReason *reason)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  PetscInt iterations;

  PetscFunctionBeginUser;
  n->nblock = 0;
  if (p->barrier)
    PetscCall(
      (*p->barrier->hessian)(p->ctx, snes->vec_sol, snes->vec_func, n->kind, n->rhs, &n->nblock));
  if (n->nblock)
    PetscCall((*p->barrier->solve)(p->ctx, snes->jacobian_pre, n->rhs, snes->vec_sol_update, reason,
                                   &iterations));
  else {
    PetscCall(KSPSetOperators(snes->ksp, snes->jacobian, snes->jacobian_pre));
    PetscCall(KSPSolve(snes->ksp, snes->vec_func, snes->vec_sol_update));
    PetscCall(KSPGetIterationNumber(snes->ksp, &iterations));
    PetscCall(KSPGetConvergedReason(snes->ksp, reason));
  }
  snes->linear_its += iterations;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the mass times the shift, 1/s^2, to the tangent; none if the first is below the least (0:
   unknown). */
static PetscErrorCode add_shift(SNES snes, PetscBool first, PetscReal *least, PetscReal *shift)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const Vec diagonal = n->to.r;
  PetscScalar stiff;

  PetscFunctionBeginUser;
  if (*least == 0.) {
    PetscCall(MatGetDiagonal(snes->jacobian_pre, diagonal));
    PetscCall(VecSum(diagonal, &stiff));
    *least = SHIFT_STIFF * PetscRealPart(stiff) / (3. * p->barrier->total_mass);
    if (p->dt > 0.)
      *least = PetscMax(*least, SHIFT / PetscSqr(p->dt));
  }
  if (*shift < *least)
    *shift = first ? 0. : *least;
  if (*shift == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecAXPBY(diagonal, *shift, 0., p->barrier->mass));
  PetscCall(MatDiagonalSet(snes->jacobian_pre, diagonal, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the direction of an exact tangent is to be taken; `negative`: its negative eigenvalues,
   as L D L^T factors an indefinite matrix without an error, and p may descend to a saddle point;
   -1: unknown. */
static PetscErrorCode is_definite(SNES snes, PetscBool descends, PetscInt *negative, PetscBool *is)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;

  PetscFunctionBeginUser;
  *negative = -1;
  if (descends && !n->nblock && p->negative_eigenvalues)
    PetscCall((*p->negative_eigenvalues)(p->ctx, negative));
  if (p->nonsymmetric && p->dt == 0. && !snes->iter)
    n->branch = PetscMax(*negative, 0);
  *is = (PetscBool)(descends && *negative <= n->branch);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonFindDirection(SNES snes, PetscReal *slope)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const Vec Y = snes->vec_sol_update;
  KSPConvergedReason reason;
  PetscReal shift = n->shift / SHIFT_MORE;
  PetscReal least = 0.;
  PetscReal modelled = 0.;
  PetscInt shifts = 0;
  PetscInt negative;
  PetscBool definite;

  /* forces without a potential, near the solution: an indefinite tangent is kept */
  const PetscBool keep =
    (PetscBool)(p->nonsymmetric && n->full && snes->norm < n->initial && !p->barrier);

  PetscFunctionBeginUser;
  n->shift = 0.;
  for (;;) {
    /* a tangent, its direction and the slope of E along it */
    if (p->filter)
      PetscCall((*p->filter)(p->ctx, n->filtered, keep));
    PetscCall(SNESComputeJacobian(snes, snes->vec_sol, snes->jacobian, snes->jacobian_pre));
    if (shift > 0.)
      PetscCall(add_shift(snes, (PetscBool)!shifts, &least, &shift));
    PetscCall(solve_linear(snes, &reason));
    PetscCall(VecDot(snes->vec_func, Y, slope));
    *slope = -*slope;

    if (n->nblock) {
      /* a failure of -pc_type is no evidence of an indefinite tangent */
      if (reason == KSP_DIVERGED_ITS)
        break;

      /* a more convex Hessian of barriers: friction taken as sticking changes the right-hand side,
         and Y has to be a descent direction of E as well */
      PetscCall(VecDot(n->rhs, Y, &modelled));
      if (n->kind != SB_HESSIAN_MAJORIZED &&
          (reason < 0 || *slope >= -STEEP * PetscMax(modelled, 0.))) {
        n->kind = n->kind == SB_HESSIAN_EXACT ? SB_HESSIAN_PROJECTED : SB_HESSIAN_MAJORIZED;
        continue;
      }

      /* a larger shift by the mass */
      if (p->filter && !n->filtered && (reason < 0 || *slope >= 0.) && shifts++ < SHIFTS) {
        shift = shift > 0. ? SHIFT_MORE * shift : SHIFT_NONE;
        continue;
      }
    }
    n->shift = shift;
    if (n->filtered || !p->filter || (keep && reason > 0))
      break;

    /* filtered cells */
    PetscCall(is_definite(snes, (PetscBool)(reason > 0 && *slope < 0.), &negative, &definite));
    if (definite)
      break;
    PetscCall(PetscInfo(snes,
                        "iteration %" PetscInt_FMT
                        ": the exact tangent is not definite (%s, slope %g J, %" PetscInt_FMT
                        " negative eigenvalues)\n",
                        snes->iter, KSPConvergedReasons[reason], (double)*slope, negative));
    n->filtered = n->unstable = PETSC_TRUE;
  }
  if (reason < 0)
    snes->reason = SNES_DIVERGED_LINEAR_SOLVE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonSolveAccurately(SNES snes, PetscReal *slope, PetscBool *better)
{
  Newton *n = (Newton *)snes->data;
  const Vec Y = n->to.r;
  KSPConvergedReason reason;
  PetscReal rtol, left;
  PetscInt iterations;

  PetscFunctionBeginUser;

  /* whether the last solve was a loose one, of Eisenstat and Walker */
  PetscCall(SNESKSPGetUseEW(snes, better));
  PetscCall(KSPGetTolerances(snes->ksp, &rtol, NULL, NULL, NULL));
  PetscCall(KSPGetResidualNorm(snes->ksp, &left));
  *better = (PetscBool)(*better && rtol > ACCURATE && left > ACCURATE * snes->norm);
  if (!*better)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the same system */
  PetscCall(SNESKSPSetUseEW(snes, PETSC_FALSE));
  PetscCall(KSPSetTolerances(snes->ksp, ACCURATE, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(VecZeroEntries(Y));
  PetscCall(KSPSolve(snes->ksp, snes->vec_func, Y));
  PetscCall(SNESKSPSetUseEW(snes, PETSC_TRUE));
  PetscCall(KSPGetIterationNumber(snes->ksp, &iterations));
  PetscCall(KSPGetConvergedReason(snes->ksp, &reason));
  snes->linear_its += iterations;
  *better = (PetscBool)(reason > 0);
  if (!*better)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecCopy(Y, snes->vec_sol_update));
  PetscCall(VecDot(snes->vec_func, Y, slope));
  *slope = -*slope;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonLongestStep(SNES snes, PetscReal *s)
{
  const SbNewtonProblem *p = ((Newton *)snes->data)->problem;
  const Vec X = snes->vec_sol;
  const Vec Y = snes->vec_sol_update;

  PetscFunctionBeginUser;
  if (p->barrier)
    PetscCall((*p->barrier->max_step)(p->ctx, X, Y, s, NULL));
  else if (p->longest)
    PetscCall((*p->longest)(p->ctx, X, Y, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}
