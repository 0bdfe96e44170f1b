/*
  Error of the solves of a step: with F the residual at the computed solution and J the tangent, the
  missing correction is delta = J^-1 F, the energy of the error 1/2 delta . F (J includes inertia).
  One more linear solve, to a tenth, takes a fraction of the iterations of the step.

  With one linear solve per step this is the error of the linear solver; with Newton's method, whose
  tolerance also controls the linear solves, all of it is assigned to Newton's. Errors of its steps
  add up.
*/
#include "ledger_impl.h"

#define ROUGHLY 0.1 /* relative tolerance of delta */

PetscErrorCode SbEstimateSolver(SbLedger l, const SbSolvedStep *step)
{
  const PetscBool single = l->run->solve.single;
  const Vec F = l->w[0];
  PetscReal energy, error, mass;
  PetscInt its;

  PetscFunctionBeginUser;
  l->residuals -= MPI_Wtime();
  PetscCall(SNESComputeFunction(l->run->solve.snes, step->U, F));
  l->residuals += MPI_Wtime();
  PetscCall(SbProbeSolve(l, ROUGHLY, F, l->delta, &its));
  PetscCall(VecDot(l->delta, F, &energy));
  energy = PetscAbsReal(energy);
  error = PetscSqrtReal(0.5 * energy);
  l->step_linear = single ? error : 0.;
  l->step_nonlinear = single ? 0. : error;
  if (step->V)
    l->kept_part = 1.;
  if (step->V && energy > 0.) {
    /* factor of the next step on an error like delta: implicit Euler has 1 / (1 + (w h)^2)^(1/2)
       for frequency w, the root of the fraction of inertia, shift_a delta.M delta, in the energy.
       Other methods do not damp like this, but the acceleration passes the remaining residual to
       their next solve. */
    PetscCall(SbMassForm(l, l->delta, &mass));
    l->kept_part = PetscMin(1., PetscSqrtReal(l->run->solve.shift_a * mass / energy));
  }
  l->own_work += 1. + 2. * (PetscReal)its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rounding error of half the last digit of displacements, in random directions: signs by a hash of
   nodes. */
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

  /* once in a static run; in each step of a dynamic one, with random signs */
  *error = PetscSqrtReal(0.5 * form *
                         PetscMax(1., l->run->solve.ts ? (PetscReal)l->run->counters.steps : 1.));
  PetscFunctionReturn(PETSC_SUCCESS);
}
