/*
  Error estimates of a run: which steps are estimated, and how the errors of steps accumulate.

  The energy of a propagated error is constant or, with damping, decreases like that of the motion:
  so the errors of steps are summed in the energy norm ("Lady Windermere's fan": Hairer, Norsett,
  Wanner, Solving Ordinary Differential Equations I, II.3).

  Steps are estimated while the work for estimates is below a fixed fraction of the run's, in
  residual evaluations, not seconds, so that repeated runs estimate the same steps. Other steps have
  the error of the last estimated one; with -accuracy the integrator's error is estimated in each.
*/
#include "ledger_impl.h"

#define SHARE 0.08    /* largest fraction of the work for estimates */
#define SPACE_WORK 6. /* cost of the space estimate, in residual evaluations */

const char *const SbErrorNames[SB_ERROR_COUNT] = {"space",  "time",    "nonlinear",
                                                  "linear", "contact", "rounding"};

const SbOption SbLedgerRows[] = {
  {"ledger", SB_OPTION_BOOL, 1, "", "false", "",
   "estimate the error of the result by its sources (mesh, time step, iterations, contact), and "
   "print a "
   "table of them with the seconds spent on each, the error ledger"},
  {"ledger_every", SB_OPTION_INT, 1, "", "0", "[0, inf)",
   "steps between estimates of the spatial discretisation error in history.csv; 0: at the end "
   "only"},
  {"ledger_quantity", SB_OPTION_CHOICE, 1, "", "none", "none|displacement|reaction|volume",
   "quantity of interest whose error is estimated as well: displacement of the node nearest to "
   "ledger_at, "
   "reaction on the prescribed nodes of ledger_on, or volume of all bodies"},
  {"ledger_at", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)",
   "ledger_quantity displacement: its position in the reference configuration"},
  {"ledger_direction", SB_OPTION_REALS, 3, "", "0,0,1", "(-inf, inf)",
   "ledger_quantity displacement and reaction: direction; its length does not matter"},
  {"ledger_on", SB_OPTION_STRING, 1, "", "", "",
   "ledger_quantity reaction: set of its prescribed nodes"},
  {"ledger_finer_most", SB_OPTION_INT, 1, "", "500000", "[0, inf)",
   "static runs with ledger_quantity: the scene is solved once more with p2, on the same tets if "
   "all "
   "bodies are p1, else on tets of half the edges, unless that takes more tets than this; the "
   "difference is the error by the mesh. Else it is estimated by duality; 0: always"},
  {"accuracy", SB_OPTION_REAL, 1, "", "0", "[0, 1)",
   "target relative error in the energy norm, of time steps with ledger_quantity displacement "
   "that of it over its range: chooses time steps, tolerances and the width of "
   "response "
   "barrier; 0: as given by their options"},
  {"step_time_budget", SB_OPTION_REAL, 1, "s", "0", "[0, inf)",
   "wall time that a step may take: tolerances are chosen as tight as it allows; 0: no limit"},
  {0},
};

PetscErrorCode SbLedgerSetFromOptions(SbRun run, SbLedger *ledger)
{
  PetscReal accuracy, budget;
  PetscBool named;
  SbLedger l;

  PetscFunctionBeginUser;
  *ledger = NULL;
  PetscCall(SbOptionBool(&SbRunScope, "ledger", &named));
  PetscCall(SbOptionReal(&SbRunScope, "accuracy", &accuracy));
  PetscCall(SbOptionReal(&SbRunScope, "step_time_budget", &budget));
  if (!named && accuracy == 0. && budget == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt b = 0; b < run->model->nbody; b++)
    PetscCheck(!run->model->body[b].rigid, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-body_%s_rigid: errors are not estimated in scenes with rigid bodies: leave "
               "-ledger, -accuracy and -step_time_budget out",
               run->model->body[b].name);
  PetscCheck(run->solve.preset != SB_TIME_ALPHA2, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-ledger cannot look into the steps of -time alpha2: use -time genalpha, which is the "
             "same method");
  PetscCall(PetscNew(&l));
  l->run = run;
  PetscCall(SbLogNamed("Est", "ledger", &l->event));
  l->accuracy = accuracy;
  l->budget = budget;
  PetscCall(SbOptionInt(&SbRunScope, "ledger_every", &l->every));
  PetscCall(SbOptionInt(&SbRunScope, "ledger_finer_most", &l->finer_most));
  PetscCall(SbQuantitySetFromOptions(l));
  PetscCall(SbAdaptiveToleranceSetFromOptions(l));
  *ledger = l;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void begin(SbLedger l)
{
  (void)PetscLogEventBegin(l->event, 0, 0, 0, 0);
  l->seconds -= MPI_Wtime();
}

static void end(SbLedger l)
{
  l->seconds += MPI_Wtime();
  (void)PetscLogEventEnd(l->event, 0, 0, 0, 0);
}

static PetscErrorCode examine_step(SbRun run, const SbSolvedStep *step, void *ctx, PetscBool *again)
{
  SbLedger l = (SbLedger)ctx;

  PetscFunctionBeginUser;

  /* keep the accelerations for third differences; a repeated step counts once */
  if (step->A0 && l->order == 2 && (!l->kept || step->t != l->kept_t)) {
    Vec spare = l->before;

    if (l->kept) {
      const PetscReal shift = l->shift;

      l->before_dt = step->t - l->kept_t;
      l->shift = SbRunAccelerationShift(run, l->before_dt, shift);
      l->before_dt += l->shift - shift;
    }
    l->before = l->kept;
    l->kept = spare;
    if (!l->kept)
      PetscCall(VecDuplicate(step->A0, &l->kept));
    PetscCall(VecCopy(step->A0, l->kept));
    l->kept_t = step->t;
  }
  l->seen = (PetscBool)(!run->model->dynamic || l->own_work <= SHARE * l->work);

  /* norm of the last residual, N, known from the solver without an evaluation */
  if (step->solved) {
    KSP ksp;

    PetscCall(SNESGetKSP(run->solve.snes, &ksp));
    if (run->solve.single)
      PetscCall(KSPGetResidualNorm(ksp, &l->residual));
    else
      PetscCall(SNESGetFunctionNorm(run->solve.snes, &l->residual));
  }
  if (!l->seen && l->accuracy == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  begin(l);
  if (step->V)
    PetscCall(SbEstimateTime(l, step, l->seen));
  if (l->seen && step->solved) {
    PetscCall(SbEstimateSolver(l, step));
    l->seen_residual = l->residual;
  }
  end(l);
  if (l->accuracy > 0.)
    PetscCall(SbAdaptiveToleranceUpdate(l, step, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an accepted step. */
static PetscErrorCode monitor(SbRun run, const SbStep *step, void *ctx)
{
  SbLedger l = (SbLedger)ctx;
  const PetscBool first = (PetscBool)(step->step == run->clock.step0);
  const PetscReal energy = step->energies.strain + step->energies.kinetic;
  PetscReal scale;

  PetscFunctionBeginUser;
  if (step->again)
    PetscFunctionReturn(PETSC_SUCCESS);
  l->stored = run->model->dynamic ? PetscMax(l->stored, energy) : energy;

  // in residual evaluations: a tangent costs three, an iteration with its preconditioner two
  l->work +=
    run->solve.snes ? 4. * (PetscReal)step->newton + 2. * (PetscReal)step->linear + 1. : 1.;

  /* A static run has the errors of its last solve. In a dynamic one the integrator's errors add up;
     those of linear solves, in changing directions, add in squares, those of linearisation, smooth,
     linearly. The errors of a step without an estimate are scaled by its last residual. */
  if (!first) {
    const PetscReal part = l->seen_residual > 0. ? l->residual / l->seen_residual : 1.;
    PetscReal *linear = &l->error[SB_ERROR_LINEAR];
    PetscReal *nonlinear = &l->error[SB_ERROR_NONLINEAR];
    PetscReal left = step->V ? 1. : 0.;

    /* the fraction that damping leaves: as of the motion, by its power over twice the energy */
    if (step->V && run->state.damping_power > 0. && energy > 0.)
      left = PetscExpReal(-0.5 * PetscMin(step->dt * run->state.damping_power / energy, 2.));
    if (step->V)
      SbEstimateTimeAdd(l, step->dt, left);
    *linear =
      PetscSqrtReal(PetscSqr(left * l->kept_part * *linear) + PetscSqr(part * l->step_linear));
    *nonlinear = left * PetscSqrtReal(l->kept_part) * *nonlinear + part * l->step_nonlinear;
  }

  /* estimates at this state; their cost is added to own_work */
  begin(l);
  if (!first && (step->last || (l->every && step->step % l->every == 0))) {
    const SbModel m = l->run->model;
    PetscReal contact = 0.;

    PetscCall(SbSpaceEstimateCompute(l->space, step->t, step->U, step->V, step->A));
    PetscCall(PetscArraycpy(l->space_error, l->space->body2, m->nbody));
    l->error[SB_ERROR_SPACE] =
      PetscMax(m->dynamic ? l->error[SB_ERROR_SPACE] : 0., PetscSqrtReal(l->space->total2));
    if ((m->contacts.nactive_set || m->contacts.npotential) && step->R)
      PetscCall(SbEstimateContact(l, step, &contact));
    l->error[SB_ERROR_CONTACT] = PetscMax(m->dynamic ? l->error[SB_ERROR_CONTACT] : 0., contact);
    l->own_work += SPACE_WORK;
  }
  if (l->quantity.kind)
    PetscCall(SbQuantityValue(l, step));
  if (step->last && !first) {
    PetscCall(SbEstimateRounding(l, step->t, step->U, &l->error[SB_ERROR_ROUNDING]));
    if (l->quantity.kind)
      PetscCall(SbQuantityErrors(l, step));
  }

  /* relative to the stored energy */
  scale = l->stored > 0. ? 1. / PetscSqrtReal(l->stored) : 0.;
  for (int i = 0; i < SB_ERROR_COUNT; i++)
    l->relative[i] = scale * SbLedgerError(l, i);
  end(l);
  PetscCall(SbAdaptiveToleranceAccept(l, step));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the output field: errors of the frame's state. */
static PetscErrorCode cell_error(SbRun run, const SbStep *step, PetscReal values[])
{
  const SbSpace space = run->model->space;
  SbLedger l = (SbLedger)run->monitors.post_solve.ctx;

  PetscFunctionBeginUser;
  begin(l);
  PetscCall(SbSpaceEstimateCompute(l->space, step->t, step->U, step->V, step->A));
  for (PetscInt b = 0; b < space->nbatch; b++) {
    for (PetscInt i = 0; i < space->batch_n[b]; i++) {
      const PetscInt c = space->batch_cell[b] + i;

      if (c < space->mesh->ncell_owned)
        values[c] = l->space->cell2[c] / space->batch_V[b][i];
    }
  }
  l->own_work += SPACE_WORK;
  end(l);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the accumulated errors for checkpoints. */
static PetscErrorCode carry(SbLedger l)
{
  static const char *const names[] = {"error",         "derivative",     "mean",     "lost",
                                      "tau",           "span",           "stored",   "step_time",
                                      "step_linear",   "step_nonlinear", "offset",   "residual",
                                      "seen_residual", "kept_part",      "work",     "own_work",
                                      "least",         "most",           "steepest", "worst"};
  static const int sizes[] = {SB_ERROR_COUNT, 4, 4}; /* of the first ones; 1 of the others */
  PetscReal *const values[PETSC_STATIC_ARRAY_LENGTH(names)] = {l->error,
                                                               l->derivative,
                                                               l->mean,
                                                               &l->lost,
                                                               &l->tau,
                                                               &l->span,
                                                               &l->stored,
                                                               &l->step_time,
                                                               &l->step_linear,
                                                               &l->step_nonlinear,
                                                               &l->offset,
                                                               &l->residual,
                                                               &l->seen_residual,
                                                               &l->kept_part,
                                                               &l->work,
                                                               &l->own_work,
                                                               &l->quantity.least,
                                                               &l->quantity.most,
                                                               &l->quantity.steepest,
                                                               &l->quantity.worst};
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(names); k++) {
    for (int i = 0; i < (k < PETSC_STATIC_ARRAY_LENGTH(sizes) ? sizes[k] : 1); i++, n++) {
      PetscCheck(n < SB_LEDGER_CHECKPOINT, PETSC_COMM_SELF, PETSC_ERR_PLIB, "More than %d numbers",
                 SB_LEDGER_CHECKPOINT);
      PetscCall(PetscSNPrintf(l->checkpoint[n].name, SB_NAME_MAX, "ledger_%s_%d", names[k], i));
      l->checkpoint[n].value = values[k] + i;
    }
  }
  l->run->monitors.checkpoint = l->checkpoint;
  l->run->monitors.ncheckpoint = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLedgerAttach(SbLedger l)
{
  SbRun run;

  PetscFunctionBeginUser;
  if (!l)
    PetscFunctionReturn(PETSC_SUCCESS);
  run = l->run;
  begin(l);
  PetscCall(SbSpaceEstimateCreate(run->model, &l->space));
  PetscCall(PetscCalloc1(run->model->nbody, &l->space_error));
  for (int i = 0; i < 3; i++)
    PetscCall(VecDuplicate(run->state.U, &l->w[i]));
  PetscCall(VecDuplicate(run->state.U, &l->delta));
  if (run->model->dynamic)
    SbRunLocalError(run, &l->order, &l->c, &l->ahead);
  PetscCall(SbQuantityAttach(l));

  /* columns of history.csv */
  for (int i = 0; i < SB_ERROR_COUNT; i++) {
    SbColumn *c = &l->column[i];

    PetscCall(PetscSNPrintf(c->name, sizeof(c->name), "error_%s", SbErrorNames[i]));
    c->unit = "1";
    c->value = &l->relative[i];
  }
  run->monitors.column = l->column;
  run->monitors.ncolumn = SB_ERROR_COUNT;
  PetscCall(carry(l));
  end(l);
  run->monitors.want_energies = PETSC_TRUE;
  if (run->model->contacts.nactive_set || run->model->contacts.npotential ||
      l->quantity.kind == SB_QUANTITY_REACTION)
    run->monitors.want_residual = PETSC_TRUE;
  run->monitors.post_solve.fn = examine_step;
  run->monitors.post_solve.ctx = l;
  run->monitors.cell_error = cell_error;
  PetscCall(SbRunAddMonitor(run, monitor, l));
  PetscCall(SbAdaptiveToleranceAttach(l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLedgerContinue(SbLedger from, SbLedger to)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < from->run->monitors.ncheckpoint; i++)
    *to->run->monitors.checkpoint[i].value = *from->run->monitors.checkpoint[i].value;
  to->seconds += from->seconds;
  to->solving += from->solving;
  to->residuals += from->residuals;
  to->nstep = from->nstep;
  to->nkept = from->nkept;
  to->longest = from->longest;
  to->total = from->total;
  to->anew = PETSC_TRUE;
  PetscCall(SbQuantityContinue(from, to));
  if (to->may_tune && to->run->solve.snes && to->run->solve.J)
    PetscCall(SbAdaptiveToleranceSet(to, from->rtol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLedgerDestroy(SbLedger *ledger)
{
  SbLedger l = *ledger;

  PetscFunctionBeginUser;
  if (!l)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDestroy(&l->quantity.weight));
  PetscCall(SbSpaceEstimateDestroy(&l->space));
  PetscCall(PetscFree(l->space_error));
  for (int i = 0; i < 3; i++)
    PetscCall(VecDestroy(&l->w[i]));
  PetscCall(VecDestroy(&l->delta));
  PetscCall(VecDestroy(&l->kept));
  PetscCall(VecDestroy(&l->before));
  PetscCall(PetscFree(*ledger));
  PetscFunctionReturn(PETSC_SUCCESS);
}
