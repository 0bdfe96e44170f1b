/*
  Barriers: from the start of the step to a first X that has the prescribed displacements, and
  obstacles at their end positions.

  The initial guess is taken if its motion is free of contact, else free unknowns begin at the start
  of the step. A prescribed motion that would intersect a surface is part of Newton's steps: the
  right-hand side has the derivative of the residual with respect to it, so that the bodies it
  pushes move with it.
*/
#include "newton_impl.h"

#define APPROACHES 50   /* iterations in which prescribed motions have to be completed */
#define UNAVOIDABLE 0.2 /* a step there shorter than this may invert tets */
#define DIFFERENCE 1e-7 /* fraction of a prescribed motion, for finite differences by it */

/* Whether the motion from the start of the step to the initial guess X, and X itself, are free of
   contact; if not, obstacles are back at the start of their motion. */
static PetscErrorCode guess_is_free(SNES snes, PetscBool *is)
{
  const SbNewtonProblem *p = ((Newton *)snes->data)->problem;
  const SbNewtonBarrier *b = p->barrier;
  const Vec X = snes->vec_sol;
  const Vec Y = snes->vec_sol_update;
  PetscReal part;
  PetscInt nactive;

  PetscFunctionBeginUser;
  *is = PETSC_FALSE;
  PetscCall((*b->advance)(p->ctx, 0.));
  PetscCall(VecWAXPY(Y, -1., X, b->start));
  PetscCall((*b->max_step)(p->ctx, b->start, Y, &part, &nactive));
  if (part < 1. || nactive)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall((*b->advance)(p->ctx, 1.));
  PetscCall(VecZeroEntries(Y));
  PetscCall((*b->max_step)(p->ctx, X, Y, &part, &nactive));
  *is = (PetscBool)!nactive;
  if (!*is)
    PetscCall((*b->advance)(p->ctx, 0.));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Y: Newton's step for the rest of the prescribed motion D, of which `progress` was done. */
static PetscErrorCode find_direction(SNES snes, Vec D, PetscReal progress)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const Vec X = snes->vec_sol;
  const Vec F = snes->vec_func;
  PetscReal slope;

  PetscFunctionBeginUser;

  /* the residual, and its finite difference by the motion */
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(VecWAXPY(n->to.x, DIFFERENCE, D, X));
  PetscCall((*p->barrier->advance)(p->ctx, progress + DIFFERENCE));
  PetscCall(SNESComputeFunction(snes, n->to.x, n->to.r));
  PetscCall((*p->barrier->advance)(p->ctx, progress));
  PetscCall(VecAXPY(n->to.r, -1., F));
  PetscCall(VecAXPY(F, (1. - progress) / DIFFERENCE, n->to.r));

  n->filtered = PETSC_FALSE;
  PetscCall(SbNewtonFindDirection(snes, &slope));
  if (!snes->reason)
    PetscCall(VecAXPY(snes->vec_sol_update, progress - 1., D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The next iterate, in n->to.x, at the fraction s of Y: without a collision, and without more
   inverted tets, unless a prescribed motion inverts them unavoidably. */
static PetscErrorCode find_step(SNES snes, PetscReal progress, PetscReal *s)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const SbNewtonBarrier *b = p->barrier;
  const Vec X = snes->vec_sol;
  const Vec Y = snes->vec_sol_update;
  PetscReal energy, whole;
  PetscInt before, inverted;

  PetscFunctionBeginUser;
  PetscCall((*b->max_step)(p->ctx, X, Y, s, NULL));
  PetscCall((*b->inverted)(p->ctx, X, &energy, &before));
  for (whole = *s;; *s *= 0.5) {
    PetscCall(VecWAXPY(n->to.x, -*s, Y, X));
    PetscCall((*b->advance)(p->ctx, progress + *s * (1. - progress)));
    PetscCall((*b->inverted)(p->ctx, n->to.x, &energy, &inverted));
    if (*s < SHORTEST ||
        ((inverted <= before || *s < UNAVOIDABLE * whole) && !PetscIsInfOrNanReal(energy)))
      break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonApproach(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  const SbNewtonBarrier *b = p->barrier;
  const Vec X = snes->vec_sol;
  const Vec Y = snes->vec_sol_update;
  const Vec D = n->provisional.Y; /* work vector: increment of the prescribed displacements */
  PetscReal part, s;
  PetscReal progress = 0.;
  PetscBool is_free;

  PetscFunctionBeginUser;

  /* the solution of the last solve, which its iterations led to */
  if (p->warm_start) {
    PetscCall((*b->advance)(p->ctx, 1.));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(guess_is_free(snes, &is_free));
  if (is_free)
    PetscFunctionReturn(PETSC_SUCCESS);

  PetscCall(VecWAXPY(D, -1., b->start, X));
  PetscCall((*p->prescribed_part)(p->ctx, D));
  PetscCall(VecCopy(b->start, X));
  for (int round = 0; round < APPROACHES; round++) {
    /* the rest of the motion at once */
    PetscCall(VecCopy(D, Y));
    PetscCall(VecScale(Y, progress - 1.));
    PetscCall((*b->max_step)(p->ctx, X, Y, &part, NULL));
    if (part == 1.) {
      PetscCall(VecAXPY(X, -1., Y));
      PetscCall((*b->advance)(p->ctx, 1.));
      PetscFunctionReturn(PETSC_SUCCESS);
    }

    /* in part, with Newton's steps of the bodies */
    PetscCall(find_direction(snes, D, progress));
    if (snes->reason)
      PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(find_step(snes, progress, &s));
    PetscCall(PetscInfo(snes, "approach %d: %g of the rest of the way, of which %g was done\n",
                        round, (double)s, (double)progress));
    snes->iter++;
    if (s < SHORTEST)
      break;
    PetscCall(VecCopy(n->to.x, X));
    progress = s == 1. ? 1. : progress + s * (1. - progress);
    if (progress == 1.)
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  snes->reason = SNES_DIVERGED_LINE_SEARCH;
  PetscFunctionReturn(PETSC_SUCCESS);
}
