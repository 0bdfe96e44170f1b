/*
  Adaptive tolerances: -accuracy sets a target error, -step_time_budget a limit on the seconds per
  step.

  -accuracy e: the time step is chosen so that the integrator's error is uniform over the run
  (TSAdapt, error per unit of time), at least a hundredth of -ts_dt, and the tolerance of solves so
  that their estimated error is a tenth of e. The mesh is not changed. Barrier contact may have half
  of e: the width of the barrier is adapted to the error of its gaps, which is proportional to it.
  It is reduced at once, and the step solved again; it is increased only between steps and while the
  energy stored in the gaps hardly grows, which would accelerate the bodies apart. The error of
  contact need not be less than a tenth of the mesh's.

  -step_time_budget s: the time step is the user's. The tolerance of solves is increased when a step
  took longer than s, and reduced when it took less than s / 2. Results differ from run to run.

  Values of the user (-snes_rtol, -ksp_rtol, -ts_adapt_type) are kept.
*/
#include "ledger_impl.h"

#define SOLVERS 0.1 /* fraction of the accuracy for solves */
#define STEPS 0.7   /* fraction for the integrator */
#define GAPS 0.5    /* fraction for gaps of barrier contact */
#define MESH 0.1    /* allowed error of contact, over that of the mesh */
#define AIM 0.5     /* target error of a new width, over the allowed error */
#define ROOM 0.1    /* error over the allowed one below which a width may grow */
#define GROWTH \
  0.01 /* largest energy of gaps from a growing width, over that of the allowed error */
#define LOOSEST 0.3 /* largest relative tolerance of a solve */
#define TIGHTEST 1e-12
#define NOISE 4.      /* factor on the error of a solve */
#define SHORTEST 0.01 /* shortest step over -ts_dt: bounds the cost */

PetscErrorCode SbAdaptiveToleranceSetFromOptions(SbLedger l)
{
  PetscBool given, rtol[2];

  PetscFunctionBeginUser;
  PetscCheck(l->accuracy == 0. || l->budget == 0., PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-accuracy %g and -step_time_budget %g s both choose tolerances; give one of them",
             (double)l->accuracy, (double)l->budget);
  PetscCheck(
    l->budget == 0. || l->run->model->dynamic, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-step_time_budget %g s is about time steps, and -time static has none: give -accuracy",
    (double)l->budget);
  if (l->accuracy > 0. && l->run->model->dynamic) {
    PetscCall(PetscOptionsHasName(NULL, NULL, "-ts_adapt_type", &given));
    if (!given)
      PetscCall(PetscOptionsSetValue(NULL, "-ts_adapt_type", "basic"));
  }
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_rtol", &rtol[0]));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_rtol", &rtol[1]));
  l->may_tune = (PetscBool)(!rtol[0] && !rtol[1] && (l->accuracy > 0. || l->budget > 0.));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the relative tolerance of solves: Newton's, or the linear solver's for one solve per
   step. */
PetscErrorCode SbAdaptiveToleranceSet(SbLedger l, PetscReal rtol)
{
  const SNES snes = l->run->solve.snes;
  KSP ksp;

  PetscFunctionBeginUser;
  l->rtol = PetscMax(TIGHTEST, PetscMin(LOOSEST, rtol));
  PetscCall(SNESGetKSP(snes, &ksp));
  if (l->run->solve.single)
    PetscCall(KSPSetTolerances(ksp, l->rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  else
    PetscCall(
      SNESSetTolerances(snes, PETSC_DEFAULT, l->rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error of the last solves, J^(1/2): if not estimated, the last estimate scaled by the residual. */
static PetscReal left_by_solves(SbLedger l)
{
  const PetscReal part = l->seen_residual > 0. ? l->residual / l->seen_residual : 1.;

  return part * PetscSqrtReal(PetscSqr(l->step_linear) + PetscSqr(l->step_nonlinear));
}

/* Ratio of the error of the last solved step to the allowed one, that of the run times dt / its
   length; less errors of solves, a part of the differences of accelerations that shorter steps
   would not reduce. */
static PetscErrorCode step_error(SbRun run, const SbSolvedStep *step, void *ctx, PetscInt *order,
                                 PetscReal *ratio)
{
  SbLedger l = (SbLedger)ctx;
  const PetscReal allowed =
    STEPS * l->accuracy * PetscSqrtReal(l->stored) * step->dt / run->clock.t_end;
  PetscReal error = 0.;
  PetscBool known;

  PetscFunctionBeginUser;
  *order = l->order;
  *ratio = allowed > 0. ? PetscMax(0., l->step_time - NOISE * left_by_solves(l)) / allowed : 0.;

  // of a quantity of interest only its own error counts
  PetscCall(SbQuantityStepError(l, step, &error, &known));
  if (known)
    *ratio = error / (STEPS * l->accuracy * step->dt / run->clock.t_end);
  if (*ratio > 1. && !l->warned_shortest && step->dt <= 1.001 * SHORTEST * run->clock.dt) {
    l->warned_shortest = PETSC_TRUE;
    PetscCall(SbWarning(
      run->model->comm,
      "t = %g s: -accuracy %g asks for steps %.2g times as long as %g s, which is a hundredth of "
      "-ts_dt: the run goes on with that, and its error is reported at the end; %sa larger "
      "-accuracy, damping, or a smaller -ts_dt where the cost does not matter",
      (double)step->t, (double)l->accuracy, (double)PetscPowReal(*ratio, -1. / (PetscReal)l->order),
      (double)step->dt, l->order == 1 ? "try -time genalpha (of second order), " : "try "));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAdaptiveToleranceAttach(SbLedger l)
{
  const SbRun run = l->run;
  TSAdapt adapt;

  PetscFunctionBeginUser;
  if (l->accuracy > 0. && run->solve.ts) {
    run->monitors.post_solve.error = step_error;
    PetscCall(TSGetAdapt(run->solve.ts, &adapt));

    /* explicit steps are at most the stable one */
    PetscCall(TSAdaptSetStepLimits(adapt, SHORTEST * run->clock.dt,
                                   run->solve.snes && run->solve.J ? 0.1 * run->clock.t_end
                                                                   : run->clock.dt));
  }
  if (l->may_tune && run->solve.snes && run->solve.J)
    PetscCall(SbAdaptiveToleranceSet(l, l->accuracy > 0. ? 0.01 * l->accuracy : 1e-3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adapts the barrier's width to its allowed error; `again`: the step has to be solved with the new
   width. */
static PetscErrorCode update_widths(SbLedger l, const SbSolvedStep *step, PetscBool *again)
{
  PetscReal allowed = GAPS * l->accuracy * PetscSqrtReal(l->stored);
  PetscReal error;
  PetscBool changed;

  PetscFunctionBeginUser;
  if (!(allowed > 0.))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbEstimateGaps(l, step->U, ROOM * allowed, &error));
  if (!(error > 0.))
    PetscFunctionReturn(PETSC_SUCCESS);
  if (error < ROOM * allowed) {
    PetscCall(SbContactSetScaleWidths(&l->run->model->contacts, PetscMin(3., AIM * allowed / error),
                                      step->V ? GROWTH * PetscSqr(allowed) : PETSC_MAX_REAL,
                                      &changed));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (error <= allowed)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* too large, unless the error of the mesh is much larger */
  PetscCall(SbSpaceEstimateCompute(l->space, step->t + step->dt, step->U, step->V, step->A));
  allowed = PetscMax(allowed, MESH * PetscSqrtReal(l->space->total2));
  if (error <= allowed) {
    l->mesh_bounds = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbContactSetScaleWidths(&l->run->model->contacts, AIM * allowed / error, 0., &changed));
  l->narrowed += changed;
  l->width_bounds = (PetscBool)(l->width_bounds || !changed);
  *again = (PetscBool)(*again || changed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAdaptiveToleranceUpdate(SbLedger l, const SbSolvedStep *step, PetscBool *again)
{
  const SbRun run = l->run;
  PetscReal allowed, left;

  PetscFunctionBeginUser;

  /* until something moves, the reference energy is that of the first attempt */
  if (!step->V || step->t == run->clock.t0) {
    SbEnergies e;

    PetscCall(SbModelEnergies(l->run->model, step->U, step->V, &e));
    l->stored = PetscMax(l->stored, e.strain + (step->V ? e.kinetic : 0.));
  }
  if (step->solved && run->model->contacts.npotential)
    PetscCall(update_widths(l, step, again));
  if (!l->may_tune || !step->solved)
    PetscFunctionReturn(PETSC_SUCCESS);
  allowed =
    SOLVERS * l->accuracy * PetscSqrtReal(l->stored) * (step->V ? step->dt / run->clock.t_end : 1.);
  left = left_by_solves(l);
  if (!(left > 0.) || !(allowed > 0.))
    PetscFunctionReturn(PETSC_SUCCESS);
  if (left > allowed) {
    /* a small excess in one of many steps is compensated by the next */
    if (l->rtol > TIGHTEST && left > (step->V ? 3. : 1.) * allowed)
      *again = PETSC_TRUE;
    PetscCall(SbAdaptiveToleranceSet(l, l->rtol * PetscMax(1e-3, 0.3 * allowed / left)));
  } else if (left < 0.1 * allowed)
    PetscCall(SbAdaptiveToleranceSet(l, l->rtol * PetscMin(3., 0.3 * allowed / left)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAdaptiveToleranceAccept(SbLedger l, const SbStep *step)
{
  PetscReal took = step->wall - l->wall;

  PetscFunctionBeginUser;
  if (l->budget == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &took, 1, MPIU_REAL, MPI_MAX, l->run->model->comm));
  l->wall = step->wall;
  if (step->step == l->run->clock.step0)
    PetscFunctionReturn(PETSC_SUCCESS);
  l->nstep++;
  l->nkept += took <= l->budget;
  l->longest = PetscMax(l->longest, took);
  l->total += took;
  if (!l->may_tune || !l->run->solve.J)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (took > 0.9 * l->budget)
    PetscCall(SbAdaptiveToleranceSet(l, 4. * l->rtol));
  else if (took < 0.5 * l->budget)
    PetscCall(SbAdaptiveToleranceSet(l, 0.5 * l->rtol));
  PetscFunctionReturn(PETSC_SUCCESS);
}
