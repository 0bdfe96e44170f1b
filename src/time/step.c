/*
  One step, dynamic or static, from its start to its acceptance; see second_order.c, static.c.

    begin   effects move, surfaces are updated, candidates of contact are found; a guess
    repeat  solves: gradient and Hessian of the incremental potential, linear solve, largest safe
            length, line search (src/newton); contact set (solve.c); post-solve callback
    accept  state, history of effects, energies (energy_balance.c), monitors; the next length
    follows
            in second_order.c and static.c
*/
#include "time_impl.h"

#define SHORT 0.13 /* step over the requested one, below which a warning follows: three halvings */
#define FORGET 0.9 /* decay per step of the recorded longest step */
#define REPEATED \
  30 /* solves of a load step after which its penalty on jumps has to be that of its end: 6 to 8 where \
        a cube is pressed to half or to 0.4 */
#define FULL 0.9 /* step over the requested one, from which on it counts as that */

PetscErrorCode SbRunFollowJumps(SbRun run, PetscBool *changed)
{
  const SbModel m = run->model;
  SbStepsOf steps = SB_STEPS_IN_TIME;

  PetscFunctionBeginUser;
  *changed = PETSC_FALSE;
  if (!run->solve.J || run->solve.preset == SB_TIME_ALPHA2)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (run->solve.preset == SB_TIME_NEWMARK)
    steps = SB_STEPS_UNDAMPED;
  if (!m->dynamic)
    steps = SB_STEPS_OF_LOAD;
  PetscCall(SbModelFollowJumps(m, run->clock.t, run->state.U, steps, changed));
  if (!m->dynamic || !*changed)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the acceleration follows from the changed forces */
  PetscCall(SbRunRestartAcceleration(run));
  if (run->state.reaction)
    PetscCall(SbRunReactions(run, run->clock.t, run->state.reaction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Updates the penalty on jumps from the end U of a load step; again: by more than a percent. times:
   counts that, and ends it with a warning. */
static PetscErrorCode repeat_for_jumps(SbRun run, PetscReal t, Vec U, PetscInt *times,
                                       PetscBool *again)
{
  PetscFunctionBeginUser;
  PetscCall(SbModelFollowJumps(run->model, t, U, SB_STEPS_OF_LOAD, again));
  if (!*again || ++*times < REPEATED)
    PetscFunctionReturn(PETSC_SUCCESS);
  *again = PETSC_FALSE;
  if (!run->monitors.warned_jumps)
    PetscCall(SbWarning(
      run->model->comm,
      "load factor %g: the penalty on jumps of elements cr and dg has not settled after "
      "%" PetscInt_FMT
      " solves of the load step: the result depends on the number of load steps. Give more "
      "-static_steps, or -body_<name>_element p2",
      (double)t, *times));
  run->monitors.warned_jumps = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunRepeat(SbRun run, PetscReal t, Vec U, PetscInt *times, PetscBool *again)
{
  PetscFunctionBeginUser;
  PetscCall(repeat_for_jumps(run, t, U, times, again));
  if (*again)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbModelSettle(run->model, t, U, again));
  if (*again)
    run->solve.tangent_known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warns of much shorter steps, once until they have the requested length again. */
static PetscErrorCode warn_short(SbRun run, PetscReal dt)
{
  const PetscBool dynamic = run->model->dynamic;

  PetscFunctionBeginUser;
  if (!run->clock.stop_reason[0] || run->clock.stopped || run->monitors.warned_short ||
      dt > SHORT * run->clock.dt)
    PetscFunctionReturn(PETSC_SUCCESS);
  run->monitors.warned_short = PETSC_TRUE;
  PetscCall(SbWarning(
    run->model->comm,
    "steps had to be halved to %.2g of their length, and more: %s. It goes on; if it gets slow, "
    "try %s, or loads and motions that begin gently (docs/guides/when_it_fails.md)",
    (double)(dt / run->clock.dt), run->clock.stop_reason,
    dynamic ? "a shorter -ts_dt from the start" : "more -static_steps"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stresses that depend on the step are those of a time after its start, s. */
static PetscErrorCode stresses_at(SbSpace s, const SbSolvedStep *step, PetscReal elapsed)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceViscousAt(s, elapsed, PETSC_TRUE, step->U0, step->V0));
  PetscCall(SbSpaceActiveRates(s, elapsed, PETSC_TRUE, step->U0, step->V0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The post-solve callback, which evaluates the end of the step: again, more accurately? */
static PetscErrorCode ask_about(SbRun run, const SbSolvedStep *step, PetscBool *again)
{
  const SbSpace s = run->model->space;
  const PetscReal part = run->solve.stage.part;
  const PetscBool staged =
    (PetscBool)((s->viscous || s->active) && step->U0 && step->V0 && part != 1.);

  PetscFunctionBeginUser;
  if (staged)
    PetscCall(stresses_at(s, step, step->dt));
  PetscCall((*run->monitors.post_solve.fn)(run, step, run->monitors.post_solve.ctx, again));
  if (staged)
    PetscCall(stresses_at(s, step, part * step->dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAttempt(SbRun run, const SbAttempt *a, PetscBool *ok)
{
  const SbModel m = run->model;
  const SbSolvedStep *step = &a->step;
  SNESConvergedReason reason = SNES_CONVERGED_ITS;
  PetscBool again = PETSC_TRUE;
  PetscBool warm = PETSC_FALSE;
  PetscBool borne = PETSC_FALSE; /* the penalty on jumps was adapted to a failed solve */
  PetscInt follows = 0;
  int asked = 0;

  PetscFunctionBeginUser;
  if (!m->dynamic) {
    PetscCall(SbModelFollowJumps(m, step->t, step->U0, SB_STEPS_OF_LOAD, NULL));
    PetscCall(SbModelSettle(m, step->t, NULL, NULL));
  }
  while (again) {
    /* begin: effects move, surfaces are updated, candidates of contact are found; a guess */
    PetscCall(SbRunBeginSolve(run, a, warm));

    /* the solution from there; explicit: the guess */
    if (!SbRunIsExplicit(run))
      PetscCall(SbRunSolveStep(run, a, &reason));

    /* the state at the end, or the reason of failure */
    PetscCall((*a->complete)(a->ctx, reason, ok));

    /* a response whose forces do not settle may go on with another one */
    again = PETSC_FALSE;
    if (!*ok && reason != SNES_CONVERGED_ITERATING && !run->clock.stopped)
      PetscCall(SbContactSetFallBack(&m->contacts, run->clock.stop_reason, &again));
    if (again)
      continue;

    /* a penalty on jumps that was too small for the stress at the end makes cells wrinkle, so that
       no equilibrium is found: once more with that of where the solve came to */
    if (!*ok && !m->dynamic && reason == SNES_DIVERGED_LINE_SEARCH && !borne &&
        !run->clock.stopped) {
      borne = PETSC_TRUE;
      PetscCall(SbModelBearStress(m, step->t + step->dt, step->U, &again));
      if (again) {
        run->solve.tangent_known = PETSC_FALSE;
        continue;
      }
    }

    /* repeat a load step with what its end changes */
    if (*ok && !m->dynamic) {
      PetscCall(SbRunRepeat(run, step->t + step->dt, step->U, &follows, &warm));
      again = warm;
      if (warm)
        continue;
    }
    warm = PETSC_FALSE;

    /* the post-solve callback may request a more accurate solution */
    again = PETSC_FALSE;
    if (*ok && run->monitors.post_solve.fn && asked++ < SB_MAX_RESOLVES)
      PetscCall(ask_about(run, step, &again));
  }

  /* -time_inverted reject */
  PetscCall(SbRunRejectInverted(run, step->t, step->dt, (Vec[2]){step->U0, step->U}, ok));
  if (*ok)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* effects and prescribed motions of the start of the step, in case the run ends there */
  if (!m->dynamic)
    PetscCall(SbModelSettle(m, step->t, NULL, NULL));
  SbContactSetAdvance(&m->contacts, 0.);
  PetscCall(warn_short(run, step->dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Effects save their history of the step. */
static PetscErrorCode save_history(SbRun run, PetscInt step, PetscReal t, PetscReal dt)
{
  const SbModel m = run->model;
  SbStage stage = {.t = t, .dt = dt, .step = step, .shift_k = 1.};

  PetscFunctionBeginUser;
  if (!m->naccept)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &stage.u));
  if (run->state.V)
    PetscCall(SbSpaceGetLocalRead(m->space, run->state.V, &stage.v));
  for (PetscInt e = 0; e < m->naccept; e++)
    SbEffectCall(m->accept[e], accept, m->space, &stage);
  if (run->state.V)
    PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.V, &stage.v));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode call_monitors(SbRun run, const SbStep *step)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < run->monitors.n; k++)
    PetscCall(run->monitors.list[k].fn(run, step, run->monitors.list[k].ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the iterations and rejections of the step to the totals. */
static void count(SbRunCounters *c, PetscBool first, PetscReal left, SbStep *now)
{
  now->newton = c->newton_step;
  now->linear = c->linear_step;
  now->rejected = c->rejected - c->rejected_seen;
  c->newton += now->newton;
  c->linear += now->linear;
  c->steps += !first;
  c->unsolved += !first && left > 0.;
  c->most_left = first ? c->most_left : PetscMax(c->most_left, left);
  c->rejected_seen = c->rejected;
  c->newton_step = c->linear_step = 0;
}

PetscErrorCode SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt,
                                 PetscBool last)
{
  SbRunClock *clock = &run->clock;
  const PetscBool first = (PetscBool)(step == clock->step0);
  const PetscReal begun = MPI_Wtime();
  SbStep now = {.step = step,
                .t = t,
                .dt = dt,
                .t_end = clock->t_end,
                .step_end = -1,
                .U = run->state.U,
                .V = run->state.V,
                .A = run->state.A};
  PetscBool jumps;

  PetscFunctionBeginUser;
  clock->t = t;
  if (first)
    PetscCall(SbRunFollowJumps(run, &jumps));

  /* monitors have seen this step already, before it was known to be the last one */
  if (run->monitors.last.U && run->monitors.last.step == step) {
    if (!clock->stopped || first)
      PetscFunctionReturn(PETSC_SUCCESS);
    now = run->monitors.last;
    now.last = now.again = PETSC_TRUE;
    PetscCall(call_monitors(run, &now));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* the clock */
  clock->step = step;
  now.last = (PetscBool)(last || clock->stopped);
  if (!first)
    clock->stop.longest_step =
      PetscMax(FORGET * clock->stop.longest_step, begun - clock->stop.step_begun);
  if (dt > FULL * clock->dt)
    run->monitors.warned_short = PETSC_FALSE;
  if (clock->fixed)
    now.step_end = step + (PetscInt)PetscCeilReal((clock->t_end - t) / clock->dt - 1e-6);

  /* history of effects and materials, energies, reactions */
  if (!first) {
    PetscCall(save_history(run, step, t, dt));
    PetscCall(SbSpaceMullinsAdvance(run->model->space, run->state.U,
                                    run->monitors.want_energies ? &run->state.energies.mullins_loss
                                                                : NULL));
  }
  if (run->monitors.want_energies)
    PetscCall(SbRunAccount(run, t, dt, first));
  else if (run->monitors.want_residual) {
    if (!run->state.reaction)
      PetscCall(VecDuplicate(run->state.U, &run->state.reaction));
    PetscCall(SbRunReactions(run, t, run->state.reaction));
  }
  PetscCall(SbModelWarnStrained(run->model, t, run->state.U));
  PetscCall(SbModelActiveAt(run->model, t));
  now.R = run->state.reaction;
  now.energies = run->state.energies;

  /* monitors */
  count(&run->counters, first, run->solve.longest_left, &now);
  now.wall = MPI_Wtime() - clock->wall_start;
  PetscCall(call_monitors(run, &now));
  run->monitors.last = now;

  /* interactive values of the next step */
  if (SbLiveCount())
    PetscCall(SbLiveAdvance(run->model->comm, t));
  clock->stop.step_begun = MPI_Wtime();
  clock->stop.longest_output = PetscMax(clock->stop.longest_output, clock->stop.step_begun - begun);
  PetscFunctionReturn(PETSC_SUCCESS);
}
