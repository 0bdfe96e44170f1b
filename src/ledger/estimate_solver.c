/*
  Error of the solves of a step: with F the residual of its equations at the solution and J their tangent, the missing correction is
  delta = J^-1 F, and the energy of the error 1/2 delta . F (of state: J holds inertia, too). One more solve, to a tenth, gives it: a
  fraction of the iterations of the step.

  With one linear solve per step that is the linear solver's; with Newton's method, whose iteration ends by its own tolerance and whose linear solves are as
  accurate as that needs, all of it is Newton's. What its steps leave has one direction and adds up.
*/
#include "ledger_impl.h"

#define ROUGHLY 0.1 /* relative tolerance of delta */

/* What the next step leaves of an error like delta, in which inertia has the share shift_a delta.M delta of the energy delta.J delta: of an oscillation of
   the frequency w implicit Euler leaves 1 / (1 + (w h)^2)^(1/2), which is the root of that share. Other methods do not damp so, but
   their next solve sees the residual that was left, in the acceleration. */
static PetscErrorCode damp(SbLedger l, PetscReal energy)
{
  PetscReal mass;

  PetscFunctionBeginUser;
  l->kept_part = 1.;
  if (!(energy > 0.)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMassForm(l, l->delta, &mass));
  l->kept_part = PetscMin(1., PetscSqrtReal(l->run->shift_a * mass / energy));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEstimateSolver(SbLedger l, const SbSolvedStep *step)
{
  const SNES snes = l->run->snes;
  PetscReal energy;
  PetscInt its;
  PetscBool single;
  Vec F = l->w[0];

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &single));
  l->residuals -= MPI_Wtime();
  PetscCall(SNESComputeFunction(snes, step->U, F));
  l->residuals += MPI_Wtime();
  PetscCall(SbProbeSolve(l, ROUGHLY, F, l->delta, &its));
  PetscCall(VecDot(l->delta, F, &energy));
  l->step_linear = single ? PetscSqrtReal(0.5 * PetscAbsReal(energy)) : 0.;
  l->step_nonlinear = single ? 0. : PetscSqrtReal(0.5 * PetscAbsReal(energy));
  if (step->V) PetscCall(damp(l, PetscAbsReal(energy)));
  l->own_work += 1. + 2. * (PetscReal)its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each displacement is off by up to half its last digit, in no direction that is preferred: signs by a hash of the node. */
PetscErrorCode SbEstimateRounding(SbLedger l, PetscReal t, Vec U, PetscReal *error)
{
  const SbSpace s = l->run->model->space;
  const PetscScalar *u;
  PetscScalar *d;
  PetscReal form;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArray(l->w[0], &d));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    const uint32_t hash = (uint32_t)(3 * s->node_orig[i / 3] + i % 3) * 2654435761u;

    d[i] = (hash >> 31 ? 0.5 : -0.5) * PETSC_MACHINE_EPSILON * u[i];
  }
  PetscCall(VecRestoreArray(l->w[0], &d));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(SbStiffnessForm(l, t, U, l->w[0], &form));
  /* once in a static run; in each step of a dynamic one, without a sign that stays */
  *error =
    PetscSqrtReal(0.5 * form * PetscMax(1., (PetscReal)(s->mesh && l->run->ts ? l->run->steps_total : 1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
