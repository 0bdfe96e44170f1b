/*
  Products with the tangent for the estimates: finite differences of forces, energies, solves.
*/
#include "ledger_impl.h"
#include "sbsolver.h"

#define PROBE 1e-6 /* finite difference step over the bodies' size: above rounding, nearly linear */

PetscErrorCode SbStiffnessTimes(SbLedger l, PetscReal t, Vec U, Vec D, PetscBool strain, Vec R)
{
  const SbModel m = l->run->model;
  const Vec moved = l->w[1];
  const Vec other = l->w[2];
  PetscReal size;
  PetscReal volume = 0.;
  PetscReal length, energy;
  PetscInt ninverted;

  PetscFunctionBeginUser;

  /* the step moves bodies by at most a millionth of their size */
  PetscCall(VecNorm(D, NORM_INFINITY, &size));
  for (PetscInt b = 0; b < m->nbody; b++)
    volume = PetscMax(volume, m->body[b].volume);
  length = size > 0. ? PROBE * PetscPowReal(volume, 1. / 3.) / size : 0.;
  PetscCall(VecZeroEntries(R));
  if (!(length > 0.))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int side = 0; side < 2; side++) {
    const Vec F = side ? R : other;

    PetscCall(VecWAXPY(moved, side ? length : -length, D, U));
    if (strain)
      PetscCall(SbModelStrainEnergy(m, moved, F, &energy, &ninverted));
    else
      PetscCall(SbModelResidual(m, t, moved, NULL, NULL, PETSC_FALSE, F));
  }
  PetscCall(VecAXPBY(R, -0.5 / length, 0.5 / length, other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMassForm(SbLedger l, Vec D, PetscReal *form)
{
  PetscFunctionBeginUser;
  PetscCall(VecPointwiseMult(l->w[2], l->run->state.mass, D));
  PetscCall(VecDot(l->w[2], D, form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbStiffnessForm(SbLedger l, PetscReal t, Vec U, Vec D, PetscReal *form)
{
  const SbRun run = l->run;
  const Vec moved = l->w[1];
  PetscReal mass;
  PetscBool sum;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(D, &R));

  // whether the last tangent is a matrix K + shift M of the free unknowns with the lumped mass
  sum = (PetscBool)(run->solve.J && run->solve.ts && run->solve.shift_a > 0. &&
                    !run->solve.solver_used->matrix_free);
  if (run->solve.damped || run->model->space->consistent_mass)
    sum = PETSC_FALSE;
  if (sum) {
    PetscCall(VecCopy(D, moved));
    PetscCall(SbSpaceZeroPrescribed(run->model->space, PETSC_TRUE, moved));
    PetscCall(MatMult(run->solve.J, moved, R));
    PetscCall(VecDot(R, moved, form));
    PetscCall(SbMassForm(l, moved, &mass));
    *form = PetscMax(0., *form - run->solve.shift_a * mass);
    l->own_work += 1.;
  } else {
    l->residuals -= MPI_Wtime();
    PetscCall(SbStiffnessTimes(l, t, U, D, PETSC_FALSE, R));
    l->residuals += MPI_Wtime();
    PetscCall(VecDot(R, D, form));
    *form = PetscAbsReal(*form);
    l->own_work += 2.;
  }
  PetscCall(VecDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProbeSolve(SbLedger l, PetscReal rtol, Vec B, Vec X, PetscInt *its)
{
  PetscReal own_rtol, atol;
  PetscBool warm, solved;
  SbRun run = l->run;
  KSP ksp;
  Vec U;

  PetscFunctionBeginUser;
  l->solving -= MPI_Wtime();
  PetscCall(SbRunSolveTangent(run, B, X, its, &solved));
  if (!solved) {
    PetscCall(SNESGetKSP(run->solve.snes, &ksp));

    /* Newton's method had nothing to do: no tangent was assembled */
    if (!run->solve.tangent_known) {
      PetscCall(SNESGetSolution(run->solve.snes, &U));
      if (run->clock.arc.on) /* solves linear systems alone */
        U = run->state.U;
      PetscCall(SNESComputeJacobian(run->solve.snes, U, run->solve.system, run->solve.J));
      PetscCall(KSPSetOperators(ksp, run->solve.system, run->solve.J));
    }
    PetscCall(KSPGetTolerances(ksp, &own_rtol, &atol, NULL, NULL));
    PetscCall(KSPGetInitialGuessNonzero(ksp, &warm));
    PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_FALSE));
    PetscCall(KSPSetTolerances(ksp, rtol, 0., PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(KSPSolve(ksp, B, X));
    PetscCall(KSPGetIterationNumber(ksp, its));
    PetscCall(KSPSetTolerances(ksp, own_rtol, atol, PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(KSPSetInitialGuessNonzero(ksp, warm));
  }
  l->solving += MPI_Wtime();
  PetscFunctionReturn(PETSC_SUCCESS);
}
