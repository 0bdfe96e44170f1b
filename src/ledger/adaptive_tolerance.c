/*
  Adaptive tolerances: -accuracy by a target error, -step_time_budget by a limit on the seconds of a step.

  -accuracy e: steps are as long as the integrator's loss allows, which is shared out over the run (TSAdapt, error per unit of time), and the
  solves leave a tenth of e, which the estimate of each step holds them to. The mesh is as it is.
  Contact that keeps a gap leaves half of e: the width below which surfaces push each other follows the error of its gaps, which is in proportion to it. A width becomes smaller at once, and the step is
  solved again; it becomes larger only between steps and as far as what the gaps store hardly grows by that, as bodies would be thrown apart. Contact need not be better than a tenth of the mesh's error.

  -step_time_budget s: the time step is yours. Solves are looser when a step took longer than s, and tighter when it took less than half of it. What they do
  depends on the machine, and no two runs are the same.

  A tolerance that the user gave (-snes_rtol, -ksp_rtol, -ts_adapt_type) stays.
*/
#include "ledger_impl.h"

#define SOLVERS 0.1 /* of the accuracy is left to solves */
#define STEPS 0.7   /* of it to the integrator */
#define GAPS 0.5    /* of it to contact that keeps a gap */
#define MESH 0.1    /* of the mesh's error, that contact may have */
#define AIM 0.5     /* target of a new width, over the allowed error */
#define ROOM 0.1    /* error below which a width may grow, over the allowed one */
#define GROWTH 0.01 /* of the energy of the allowed error: by how much that of gaps may grow with a width */
#define LOOSEST 0.3 /* relative residual */
#define TIGHTEST 1e-12
#define NOISE 4.      /* factor on the error of a solve */
#define SHORTEST 1e-6 /* step, of the run */

PetscErrorCode SbAdaptiveToleranceSetFromOptions(SbLedger l)
{
  PetscBool given, rtol[2];

  PetscFunctionBeginUser;
  PetscCheck(l->accuracy == 0. || l->budget == 0., PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-accuracy %g and -step_time_budget %g s both choose tolerances; give one of them",
             (double)l->accuracy, (double)l->budget);
  PetscCheck(l->budget == 0. || l->run->model->dynamic, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-step_time_budget %g s is about time steps, and -time static has none: give -accuracy",
             (double)l->budget);
  if (l->accuracy > 0. && l->run->model->dynamic) {
    PetscCall(PetscOptionsHasName(NULL, NULL, "-ts_adapt_type", &given));
    if (!given) PetscCall(PetscOptionsSetValue(NULL, "-ts_adapt_type", "basic"));
  }
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_rtol", &rtol[0]));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_rtol", &rtol[1]));
  l->may_tune = (PetscBool)(!rtol[0] && !rtol[1] && (l->accuracy > 0. || l->budget > 0.));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The relative tolerance of solves: Newton's, or the linear solver's where there is one solve per step. */
PetscErrorCode SbAdaptiveToleranceSet(SbLedger l, PetscReal rtol)
{
  const SNES snes = l->run->snes;
  PetscReal atol, old, stol, linear, latol, dtol;
  PetscInt max_it, max_f, linear_max;
  PetscBool single;
  KSP ksp;

  PetscFunctionBeginUser;
  l->rtol = PetscMax(TIGHTEST, PetscMin(LOOSEST, rtol));
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &single));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(SNESGetTolerances(snes, &atol, &old, &stol, &max_it, &max_f));
  PetscCall(KSPGetTolerances(ksp, &linear, &latol, &dtol, &linear_max));
  if (single)
    PetscCall(KSPSetTolerances(ksp, l->rtol, latol, dtol, linear_max));
  else
    PetscCall(SNESSetTolerances(snes, atol, l->rtol, stol, max_it, max_f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the solves of the step that was just solved left, J^(1/2): of one that was not examined, by its residual. */
static PetscReal left_by_solves(SbLedger l)
{
  const PetscReal part = l->seen_residual > 0. ? l->residual / l->seen_residual : 1.;

  return part * PetscSqrtReal(PetscSqr(l->step_linear) + PetscSqr(l->step_nonlinear));
}

/* Error of the step that was just solved over what it may have: that of the whole run shared out over its time. What solves leave is in the
   differences of accelerations, too, the more so the shorter a step is: no shorter one would help against that. */
static PetscErrorCode step_error(SbRun run, const SbSolvedStep *step, void *ctx, PetscInt *order,
                                 PetscReal *ratio)
{
  SbLedger l = (SbLedger)ctx;
  const PetscReal allowed = STEPS * l->accuracy * PetscSqrtReal(l->stored) * step->dt / run->t_end;
  const PetscReal noise = NOISE * left_by_solves(l);

  PetscFunctionBeginUser;
  *order = l->order;
  *ratio = allowed > 0. ? PetscMax(0., l->step_time - noise) / allowed : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAdaptiveToleranceAttach(SbLedger l)
{
  const SbRun run = l->run;
  TSAdapt adapt;

  PetscFunctionBeginUser;
  if (l->accuracy > 0. && run->ts) {
    run->post_solve.error = step_error;
    PetscCall(TSGetAdapt(run->ts, &adapt));
    /* explicit steps are no longer than the stable one */
    PetscCall(
      TSAdaptSetStepLimits(adapt, SHORTEST * run->t_end, run->snes && run->J ? 0.1 * run->t_end : run->dt));
  }
  if (l->may_tune && run->snes && run->J)
    PetscCall(SbAdaptiveToleranceSet(l, l->accuracy > 0. ? 0.01 * l->accuracy : 1e-3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Holds the gaps of contact to their share; `again`: the step has to be solved with the new width. */
static PetscErrorCode update_widths(SbLedger l, const SbSolvedStep *step, PetscBool *again)
{
  PetscReal allowed = GAPS * l->accuracy * PetscSqrtReal(l->stored), error, mesh = 0.;
  PetscBool changed;

  PetscFunctionBeginUser;
  if (!(allowed > 0.)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbEstimateGaps(l, step->U, ROOM * allowed, &error));
  if (!(error > 0.)) PetscFunctionReturn(PETSC_SUCCESS);
  if (error < ROOM * allowed) {
    PetscCall(SbModelScaleBarrierWidths(l->run->model, PetscMin(3., AIM * allowed / error),
                                        step->V ? GROWTH * PetscSqr(allowed) : PETSC_MAX_REAL, &changed));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (error <= allowed) PetscFunctionReturn(PETSC_SUCCESS);

  /* too large, unless the mesh is worse by far */
  PetscCall(SbSpaceEstimateCompute(l->space, step->t + step->dt, step->U, step->V, step->A));
  for (PetscInt b = 0; b < l->run->model->nbody; b++) mesh += l->space->body2[b];
  mesh = PetscSqrtReal(mesh);
  allowed = PetscMax(allowed, MESH * mesh);
  if (error <= allowed) {
    l->mesh_bounds = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbModelScaleBarrierWidths(l->run->model, AIM * allowed / error, 0., &changed));
  l->narrowed += changed;
  l->width_bounds = (PetscBool)(l->width_bounds || !changed);
  *again = (PetscBool)(*again || changed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAdaptiveToleranceUpdate(SbLedger l, const SbSolvedStep *step, PetscBool *again)
{
  const SbRun run = l->run;
  const PetscReal part = step->V ? step->dt / run->t_end : 1.;
  PetscReal allowed, left;

  PetscFunctionBeginUser;
  /* until something has moved, the energy that counts is that of the first attempt */
  if (!step->V || step->t == run->t0) {
    SbEnergies e;

    PetscCall(SbModelEnergies(l->run->model, step->U, step->V, &e));
    l->stored = PetscMax(l->stored, e.strain + (step->V ? e.kinetic : 0.));
  }
  if (step->solved && run->model->npotential) PetscCall(update_widths(l, step, again));
  if (!l->may_tune || !step->solved) PetscFunctionReturn(PETSC_SUCCESS);
  allowed = SOLVERS * l->accuracy * PetscSqrtReal(l->stored) * part;
  left = left_by_solves(l);
  if (!(left > 0.) || !(allowed > 0.)) PetscFunctionReturn(PETSC_SUCCESS);
  if (left > allowed) {
    /* a little too much in one step of many is made up for by the next */
    if (l->rtol > TIGHTEST && left > (step->V ? 3. : 1.) * allowed) {
      *again = PETSC_TRUE;
      l->repeats++;
    }
    PetscCall(SbAdaptiveToleranceSet(l, l->rtol * PetscMax(1e-3, 0.3 * allowed / left)));
  } else if (left < 0.1 * allowed)
    PetscCall(SbAdaptiveToleranceSet(l, l->rtol * PetscMin(3., 0.3 * allowed / left)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAdaptiveToleranceAccept(SbLedger l, const SbStep *step)
{
  PetscReal took = step->wall - l->wall;

  PetscFunctionBeginUser;
  if (l->budget == 0.) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &took, 1, MPIU_REAL, MPI_MAX, l->run->model->comm));
  l->wall = step->wall;
  if (step->step == l->run->step0) PetscFunctionReturn(PETSC_SUCCESS);
  l->nstep++;
  l->nkept += took <= l->budget;
  l->longest = PetscMax(l->longest, took);
  l->total += took;
  if (!l->may_tune || !l->run->J) PetscFunctionReturn(PETSC_SUCCESS);
  if (took > 0.9 * l->budget)
    PetscCall(SbAdaptiveToleranceSet(l, 4. * l->rtol));
  else if (took < 0.5 * l->budget)
    PetscCall(SbAdaptiveToleranceSet(l, 0.5 * l->rtol));
  PetscFunctionReturn(PETSC_SUCCESS);
}
