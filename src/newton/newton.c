/*
  Newton's method as a minimisation.

  The solution u of a step of an implicit integrator, or of a load step, is a stationary point of
  the incremental potential

    E(u) = a_M/2 |u - u^|_M^2 + psi(u) - f . u + D(u) + B(u)

  (inertia about the predictor u^, strain, loads, Rayleigh damping, barriers); the residual F(u) is
  its gradient. An iteration solves K p = -F (direction.c) and steps by s p with sufficient decrease
  of E (search.c). Armijo's rule and the references: Nocedal and Wright, Numerical Optimization,
  2006.

  Barriers. The first iterate is free of intersections (approach.c), and a step is at most as long
  as collision detection allows. Stiff gaps dominate the residual, so that the length of the last
  step decides; but in light contact short steps are large forces, so that these have to be in
  balance as well, within rounding. Friction is lagged: in each of the first iterations it takes the
  normal forces of the iterate, then at the solution, and the method goes on from there until they
  stay.
*/
#include "newton_impl.h"

#define STAGNANT 0.05    /* fraction of a step that counts as stagnation */
#define STAGNANT_STEPS 5 /* such steps in a row after which a load step is halved */
#define BALANCE 1e-2     /* barriers: largest residual of a solution, over the forces of contact */
#define BALANCING \
  5 /* steps in a row that are short enough after which the residual is taken for rounding */
#define PATIENCE 50 /* barriers: iterations between checks of progress */
#define WORTH \
  0.01          /* least decrease of E in these, over all before, to exceed SB_NEWTON_ITERATIONS */
#define SLOW 15 /* iterations after which a load step that may be shortened is given up, */
#define QUADRATIC 0.1   /* unless each one reduces the residual to this fraction */
#define DIFFERENCE 1e-7 /* fraction of a prescribed motion, for finite differences by it */
#define EARLY 10 /* iterations in which friction is not lagged: normal forces are updated in each */

/* Static: the first iteration, from the last equilibrium. Where displacements are prescribed, the
   rest of the guess X stays behind them and the cells between are distorted; so the right-hand side
   has the derivative of the residual by the prescribed motion D, and the bodies move with it. A law
   whose slope jumps would have one in this derivative and another one in the tangent. */
static PetscErrorCode predict(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const Vec X = snes->vec_sol;
  const Vec Y = snes->vec_sol_update;
  const Vec F = snes->vec_func;
  const Vec D = n->provisional.Y; /* work vector */
  const Vec guess = n->provisional.X;
  SbNewtonEnergy energy;
  PetscReal slope, prescribed, other;

  /* a guess that differs by prescribed motions */
  PetscFunctionBeginUser;
  PetscCall(VecWAXPY(D, -1., p->start, X));
  PetscCall(VecCopy(D, guess));
  PetscCall((*p->prescribed_part)(p->ctx, D));
  PetscCall(VecAXPY(guess, -1., D));
  PetscCall(VecNorm(D, NORM_INFINITY, &prescribed));
  PetscCall(VecNorm(guess, NORM_INFINITY, &other));
  if (prescribed == 0. || other > 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecCopy(X, guess));
  if (p->freeze)
    PetscCall((*p->freeze)(p->ctx, p->start));
  PetscCall((*p->linearise)(p->ctx, p->start, NULL, 1.));

  /* the residual of the linearised problem */
  PetscCall(VecWAXPY(n->to.x, DIFFERENCE, D, p->start));
  PetscCall(SNESComputeFunction(snes, n->to.x, n->to.r));
  PetscCall(VecCopy(p->start, X));
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(VecAXPY(n->to.r, -1., F));
  PetscCall(VecAXPY(F, 1. / DIFFERENCE, n->to.r));
  PetscCall(VecNorm(F, NORM_2, &snes->norm));

  /* its solution */
  PetscCall(SbNewtonFindDirection(snes, &slope));
  if (p->freeze)
    PetscCall((*p->freeze)(p->ctx, NULL));
  if (!snes->reason)
    PetscCall(VecAXPY(Y, -1., D));
  else
    PetscCall(VecAYPX(Y, 0., D));
  PetscCall(VecAXPY(X, -1., Y));
  PetscCall((*p->energy)(p->ctx, X, &energy, n->to.elastic, NULL));
  if (snes->reason || energy.ninverted || PetscIsInfOrNanReal(energy.strain)) {
    PetscCall(VecCopy(guess, X));
    PetscCall((*p->linearise)(p->ctx, X, NULL, 1.));
    snes->reason = SNES_CONVERGED_ITERATING;
    PetscCall(PetscInfo(snes, "without prediction\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall((*p->linearise)(p->ctx, p->start, Y, 1.));
  snes->iter = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first iterate, and its residual. */
static PetscErrorCode begin(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;

  PetscFunctionBeginUser;
  snes->reason = SNES_CONVERGED_ITERATING;
  snes->iter = n->provisional.n = n->nblock = n->branch = n->first = n->stagnant = n->nshort = 0;
  n->known = n->full = n->unstable = n->filtered = PETSC_FALSE;
  n->kind = SB_HESSIAN_PROJECTED;
  n->shift = n->fall = n->fall_checked = 0.;
  if (p->barrier)
    PetscCall(SbNewtonApproach(snes));
  n->filtered = PETSC_FALSE;
  if (p->iterations)
    PetscCall(VecZeroEntries(p->left));
  if (snes->reason)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (p->linearise)
    PetscCall((*p->linearise)(p->ctx, snes->vec_sol, NULL, 1.));
  if (p->linearise && p->start && !p->warm_start)
    PetscCall(predict(snes));
  PetscCall(SNESComputeFunction(snes, snes->vec_sol, snes->vec_func));
  PetscCall(VecNorm(snes->vec_func, NORM_2, &snes->norm));
  n->initial = snes->norm;
  PetscCall(SNESLogConvergenceHistory(snes, snes->norm, 0));
  PetscCall(SbSNESConverged(snes, 0, 0., 0., snes->norm));
  n->tolerance = snes->ttol = PetscMax(snes->ttol, p->warm_start ? n->tolerance : 0.);
  PetscCall(SNESMonitor(snes, 0, snes->norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the step s Y was the last: by the residual; with barriers by its length, and the balance
   of forces. */
static PetscErrorCode check_convergence(SNES snes, PetscReal s)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  PetscReal longest, enough, forces;

  PetscFunctionBeginUser;
  if (!n->nblock) {
    PetscCall(SbSNESConverged(snes, snes->iter, snes->xnorm, snes->ynorm, snes->norm));

    /* the residual's rounding may exceed the tolerance */
    if (!snes->reason && n->rounding)
      snes->reason = SNES_CONVERGED_SNORM_RELATIVE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall((*p->barrier->step_tolerance)(p->ctx, &enough));
  PetscCall(VecNorm(snes->vec_sol_update, NORM_INFINITY, &longest));
  PetscCall(PetscInfo(
    snes, "iteration %" PetscInt_FMT ": the longest step is %g m, of %g m for the last one\n",
    snes->iter, (double)longest, (double)enough));
  n->nshort = s >= 1. && longest <= enough ? n->nshort + 1 : 0;
  if (!n->nshort)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(n->from.contact, NORM_2, &forces));
  if (n->nshort < BALANCING &&
      snes->norm > PetscMax(BALANCE * forces, PetscMax(snes->ttol, snes->abstol)))
    PetscFunctionReturn(PETSC_SUCCESS);
  snes->reason = SNES_CONVERGED_SNORM_RELATIVE;
  n->nshort = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether there is too little progress to go on. A collapse takes hundreds of descent steps, and
   halving saves none: the patient go on while E decreases enough. */
static void check_progress(SNES snes, PetscReal s)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const PetscInt iterations = snes->iter - n->first;
  const PetscBool check = (PetscBool)(iterations % PATIENCE == 0);
  PetscBool worth;

  n->fall -= n->change;
  worth = (PetscBool)(n->fall - n->fall_checked > WORTH * PetscAbsReal(n->fall));
  if (!snes->reason && iterations >= snes->max_its && (!n->patient || (check && !worth)))
    snes->reason = SNES_DIVERGED_MAX_IT;
  if (check)
    n->fall_checked = n->fall;

  /* a load step that does not converge quadratically */
  if (!snes->reason && p->may_give_up && snes->iter >= SLOW && snes->norm > QUADRATIC * n->before)
    snes->reason = SNES_DIVERGED_LINE_SEARCH;
  n->before = snes->norm;

  /* very short load steps */
  if (!p->barrier && p->dt == 0. && !n->provisional.n)
    n->stagnant = s < STAGNANT ? n->stagnant + 1 : 0;
  if (!snes->reason && n->stagnant == STAGNANT_STEPS)
    snes->reason = SNES_DIVERGED_LINE_SEARCH;
}

/* Lagged friction takes the normal forces of this iterate: in each of the first ones, then at the
   end, which it may undo. */
static PetscErrorCode update_friction(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const PetscBool solved = (PetscBool)(snes->reason > 0);
  const PetscBool early = (PetscBool)(!snes->reason && snes->iter <= EARLY);
  PetscBool again;

  PetscFunctionBeginUser;
  if (!solved && !early)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall((*p->barrier->update_friction)(p->ctx, snes->vec_sol, solved, &again));
  if (!again)
    PetscFunctionReturn(PETSC_SUCCESS);
  snes->reason = SNES_CONVERGED_ITERATING;
  n->first = snes->iter;
  n->known = PETSC_FALSE;
  PetscCall(SNESComputeFunction(snes, snes->vec_sol, snes->vec_func));
  PetscCall(VecNorm(snes->vec_func, NORM_2, &snes->norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The longest safe fraction s of the step. What is held up by a collision holds up only what it
   touches: other bodies share no energy with it, so that Y shortened body by body descends, too. */
static PetscErrorCode find_longest(SNES snes, PetscReal *slope, PetscReal *s)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const Vec Y = snes->vec_sol_update;
  const Vec Z = n->rhs; /* work vector */
  PetscBool farther;
  PetscReal along;

  PetscFunctionBeginUser;
  n->held = 1.;
  if (p->iterations)
    PetscCall(VecCopy(Y, p->left));
  if (!p->barrier || !p->barrier->body_steps) {
    PetscCall(SbNewtonLongestStep(snes, s));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall((*p->barrier->body_steps)(p->ctx, snes->vec_sol, Y, Z, s, &farther));
  if (!farther)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDot(snes->vec_func, Z, &along));
  if (-along > *s * *slope)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(snes,
                      "iteration %" PetscInt_FMT ": %g of the step for bodies that are held "
                      "up; slope %g -> %g J\n",
                      snes->iter, (double)*s, (double)*slope, -(double)along));
  PetscCall(VecCopy(Z, Y));
  *slope = -along;
  n->held = *s;
  *s = 1.;
  PetscCall(SbNewtonLongestStep(snes, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A limited number of iterations: after the last of them the solve ends where it is, at an X free
   of intersections. */
static PetscErrorCode end_early(SNES snes, PetscReal s)
{
  const SbNewtonProblem *p = ((Newton *)snes->data)->problem;

  PetscFunctionBeginUser;
  if (snes->reason > 0)
    PetscCall(VecZeroEntries(p->left));
  else if (snes->iter >= p->iterations) {
    PetscCall(VecAXPBY(p->left, s, -1., snes->vec_sol_update));
    snes->reason = SNES_CONVERGED_ITS;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSolve_Newton(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const Vec X = snes->vec_sol;
  const Vec Y = snes->vec_sol_update;
  PetscReal slope, s, part;
  PetscBool interrupted = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(begin(snes));
  while (!snes->reason) {
    const PetscInt linear = snes->linear_its;

    if (p->interrupted)
      PetscCall((*p->interrupted)(p->ctx, &interrupted));
    if (interrupted) {
      snes->reason = SNES_DIVERGED_MAX_IT;
      break;
    }

    /* direction, largest safe step, line search */
    PetscCall(SbNewtonFindDirection(snes, &slope));
    s = 1.;
    if (!snes->reason)
      PetscCall(find_longest(snes, &slope, &s));
    if (!snes->reason && !p->barrier && s < SHORTEST)
      snes->reason = SNES_DIVERGED_LINE_SEARCH;
    if (!snes->reason)
      PetscCall(SbNewtonSearch(snes, slope, &s));
    if (snes->reason)
      break;
    part = s;
    s *= n->held;

    /* a full step: the next tangent is exact */
    n->full = (PetscBool)(s >= 1.);
    n->filtered = (PetscBool)(n->filtered && !n->full);
    n->kind = s < 1. ? SB_HESSIAN_PROJECTED : SB_HESSIAN_EXACT;

    /* convergence */
    snes->iter++;
    PetscCall(VecNorm(X, NORM_2, &snes->xnorm));
    PetscCall(VecNorm(Y, NORM_2, &snes->ynorm));
    snes->ynorm *= s;
    PetscCall(SNESLogConvergenceHistory(snes, snes->norm, snes->linear_its - linear));
    PetscCall(check_convergence(snes, s));
    PetscCall(SNESMonitor(snes, snes->iter, snes->norm));
    check_progress(snes, s);
    if (p->barrier)
      PetscCall(update_friction(snes));
    if (p->iterations)
      PetscCall(end_early(snes, part));
  }
  if (p->linearise)
    PetscCall((*p->linearise)(p->ctx, NULL, NULL, 0.));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSetUp_Newton(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const PetscBool barrier = (PetscBool)(n->problem->barrier != NULL);
  Vec *w;

  PetscFunctionBeginUser;
  PetscCall(SNESSetUpMatrices(snes));
  PetscCall(SNESSetWorkVecs(snes, barrier ? 13 : 6));
  w = snes->work;
  n->provisional.X = w[0];
  n->provisional.Y = w[1];
  n->from.elastic = w[2];
  n->to = (Iterate){.x = w[3], .r = w[4], .elastic = w[5]};
  if (barrier) {
    n->rhs = w[6];
    n->from.contact = w[7];
    n->to.contact = w[8];
    n->best = (Iterate){.x = w[9], .r = w[10], .elastic = w[11], .contact = w[12]};
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESDestroy_Newton(SNES snes)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(snes->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonCreate(SNES snes)
{
  Newton *n;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&n));
  snes->data = n;
  snes->ops->setup = SNESSetUp_Newton;
  snes->ops->solve = SNESSolve_Newton;
  snes->ops->destroy = SNESDestroy_Newton;
  snes->usesksp = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonUnstable(SNES snes, PetscBool *is)
{
  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SB_SNES_NEWTON, is));
  if (*is)
    *is = ((const Newton *)snes->data)->unstable;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonChange(SNES snes, PetscReal *change)
{
  PetscFunctionBeginUser;
  *change = ((const Newton *)snes->data)->change;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonSetProblem(SNES snes, const SbNewtonProblem *problem)
{
  PetscBool ours, given;
  Newton *n;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SB_SNES_NEWTON, &ours));
  if (!ours)
    PetscFunctionReturn(PETSC_SUCCESS);
  n = (Newton *)snes->data;
  PetscCall(PetscOptionsHasName(((PetscObject)snes)->options, ((PetscObject)snes)->prefix,
                                "-snes_max_it", &given));
  n->patient = (PetscBool)(problem->barrier && !given);
  n->problem = problem;
  PetscFunctionReturn(PETSC_SUCCESS);
}
