/*
  One step, dynamic or static, from its start to its acceptance; see second_order.c, static.c.

    attempt: predictor, Newton's method in the active-set iteration of contact, post-solve callback,
    rejection accepted: effects save their history, the energy balance is updated
    (energy_balance.c), monitors called
*/
#include "time_impl.h"

#define SHORT 0.13 /* step over the requested one, below which a warning follows: three halvings */
#define FORGET 0.9 /* decay per step of the recorded longest step */

PetscErrorCode SbRunFollowJumps(SbRun run, PetscBool *changed)
{
  const SbModel m = run->model;

  PetscFunctionBeginUser;
  *changed = PETSC_FALSE;
  if (!run->solve.J || run->solve.preset == SB_TIME_ALPHA2)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceFollowJumps(m->space, run->state.U,
                               !m->dynamic                            ? SB_STEPS_OF_LOAD
                               : run->solve.preset == SB_TIME_NEWMARK ? SB_STEPS_UNDAMPED
                                                                      : SB_STEPS_IN_TIME,
                               changed));
  if (!m->dynamic || !*changed)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the acceleration follows from the changed forces */
  PetscCall(SbRunRestartAcceleration(run));
  if (run->state.reaction)
    PetscCall(SbRunReactions(run, run->clock.t, run->state.reaction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAttempt(SbRun run, const SbAttempt *a, PetscBool *ok)
{
  const SbSolvedStep *step = &a->step;
  SNESConvergedReason reason = SNES_CONVERGED_ITS;
  PetscBool again = PETSC_TRUE;
  PetscBool warm = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (!run->model->dynamic)
    PetscCall(SbSpaceFollowJumps(run->model->space, step->U0, SB_STEPS_OF_LOAD, NULL));
  for (int solves = 0; again; solves++) {
    /* begin the solve */
    PetscCall(SbPotentialBegin(run->solve.potential, step, warm));

    /* the predictor, and the solution from there; with contact by active-set iterations */
    if (!warm)
      PetscCall((*a->predict)(a->ctx));
    if (!SbRunIsExplicit(run))
      PetscCall(SbRunSolveStep(run, a, &reason));

    /* the state at the end, or the reason of failure */
    PetscCall((*a->complete)(a->ctx, reason, ok));

    /* the penalty on jumps is that of the start: repeat a load step, maybe long, once with that of
       its end */
    if (*ok && !run->model->dynamic && !warm) {
      PetscCall(SbSpaceFollowJumps(run->model->space, step->U, SB_STEPS_OF_LOAD, &warm));
      if (warm)
        continue;
    }
    warm = PETSC_FALSE;

    /* the post-solve callback may request a more accurate solution */
    again = PETSC_FALSE;
    if (*ok && run->monitors.post_solve.fn && solves < SB_MAX_RESOLVES)
      PetscCall((*run->monitors.post_solve.fn)(run, step, run->monitors.post_solve.ctx, &again));
  }

  /* -time_inverted reject */
  PetscCall(SbRunRejectInverted(run, step->t, step->dt, (Vec[2]){step->U0, step->U}, ok));

  /* restore prescribed motions to the start of the step, in case the run ends there */
  if (!*ok && run->model->npotential)
    PetscCall(SbModelPotentialAdvance(run->model, 0.));

  /* warn of much shorter steps, once until they have the requested length again */
  if (!*ok && run->clock.stop_reason[0] && !run->clock.stopped && !run->monitors.warned_short &&
      step->dt <= SHORT * run->clock.dt) {
    run->monitors.warned_short = PETSC_TRUE;
    PetscCall(SbWarning(
      run->model->comm,
      "steps had to be halved to %.2g of their length, and more: %s. It goes on; if it gets "
      "slow, try %s, or loads and motions that begin gently (docs/guides/when_it_fails.md)",
      (double)(step->dt / run->clock.dt), run->clock.stop_reason,
      run->model->dynamic ? "a shorter -ts_dt from the start" : "more -static_steps"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt,
                                 PetscBool last)
{
  const PetscBool first = (PetscBool)(step == run->clock.step0);
  const PetscReal begun = MPI_Wtime();
  const SbModel m = run->model;
  SbStage stage = {.t = t, .dt = dt, .step = step, .shift_k = 1.};
  PetscBool jumps;
  SbStep now = {.step = step,
                .t = t,
                .dt = dt,
                .t_end = run->clock.t_end,
                .U = run->state.U,
                .V = run->state.V,
                .A = run->state.A};

  PetscFunctionBeginUser;
  run->clock.t = t;
  if (first)
    PetscCall(SbRunFollowJumps(run, &jumps));

  /* monitors have seen this step already, before it was known to be the last one */
  if (run->monitors.last.U && run->monitors.last.step == step) {
    if (!run->clock.stopped || first)
      PetscFunctionReturn(PETSC_SUCCESS);
    now = run->monitors.last;
    now.last = now.again = PETSC_TRUE;
    for (PetscInt k = 0; k < run->monitors.n; k++)
      PetscCall(run->monitors.list[k].fn(run, &now, run->monitors.list[k].ctx));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  now.last = (PetscBool)(last || run->clock.stopped);
  if (!first)
    run->clock.stop.longest_step =
      PetscMax(FORGET * run->clock.stop.longest_step, begun - run->clock.stop.step_begun);
  if (dt > 0.9 * run->clock.dt)
    run->monitors.warned_short = PETSC_FALSE;

  /* effects save their history */
  run->clock.step = step;
  if (!first && m->naccept) {
    PetscCall(SbSpaceGetLocalRead(m->space, run->state.U, &stage.u));
    if (run->state.V)
      PetscCall(SbSpaceGetLocalRead(m->space, run->state.V, &stage.v));
    for (PetscInt e = 0; e < m->naccept; e++)
      SbEffectCall(m->accept[e], accept, m->space, &stage);
    if (run->state.V)
      PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.V, &stage.v));
    PetscCall(SbSpaceRestoreLocalRead(m->space, run->state.U, &stage.u));
  }

  /* energy balance */
  if (run->monitors.want_energies)
    PetscCall(SbRunAccount(run, t, dt, first));
  else if (run->monitors.want_residual) {
    if (!run->state.reaction)
      PetscCall(VecDuplicate(run->state.U, &run->state.reaction));
    PetscCall(SbRunReactions(run, t, run->state.reaction));
  }

  /* call monitors */
  now.R = run->state.reaction;
  now.energies = run->state.energies;
  now.step_end = run->clock.fixed
                   ? step + (PetscInt)PetscCeilReal((run->clock.t_end - t) / run->clock.dt - 1e-6)
                   : -1;
  now.newton = run->counters.newton_step;
  now.linear = run->counters.linear_step;
  now.rejected = run->counters.rejected - run->counters.rejected_seen;
  now.wall = MPI_Wtime() - run->clock.wall_start;
  run->counters.newton += now.newton;
  run->counters.linear += now.linear;
  run->counters.steps += !first;
  run->counters.rejected_seen = run->counters.rejected;
  run->counters.newton_step = run->counters.linear_step = 0;
  for (PetscInt k = 0; k < run->monitors.n; k++)
    PetscCall(run->monitors.list[k].fn(run, &now, run->monitors.list[k].ctx));
  run->monitors.last = now;
  if (SbLiveCount())
    PetscCall(SbLiveAdvance(m->comm, t));
  run->clock.stop.step_begun = MPI_Wtime();
  run->clock.stop.longest_output =
    PetscMax(run->clock.stop.longest_output, run->clock.stop.step_begun - begun);
  PetscFunctionReturn(PETSC_SUCCESS);
}
