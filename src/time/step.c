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
  if (!run->J || run->preset == SB_TIME_ALPHA2)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceFollowJumps(m->space, run->U,
                               !m->dynamic                      ? SB_STEPS_OF_LOAD
                               : run->preset == SB_TIME_NEWMARK ? SB_STEPS_UNDAMPED
                                                                : SB_STEPS_IN_TIME,
                               changed));
  if (!m->dynamic || !*changed)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* the acceleration follows from the changed forces */
  PetscCall(SbRunRestartAcceleration(run));
  if (run->reaction)
    PetscCall(SbRunReactions(run, run->t_now, run->reaction));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAttempt(SbRun run, const SbAttempt *a, PetscBool *ok)
{
  const SbSolvedStep *step = &a->step;
  SNESConvergedReason reason = SNES_CONVERGED_ITS;
  PetscBool again = PETSC_TRUE;

  PetscFunctionBeginUser;
  if (!run->model->dynamic)
    PetscCall(SbSpaceFollowJumps(run->model->space, step->U0, SB_STEPS_OF_LOAD, NULL));
  run->goes_on = PETSC_FALSE;
  for (int solves = 0; again; solves++) {
    /* contact begins the step */
    if (run->model->contacts.n) {
      PetscReal speed;

      PetscCall(SbModelStepSpeed(run->model, step->t, step->dt, step->U0, run->V, &speed));
      PetscCall(
        SbContactSetBeginStep(&run->model->contacts, step->t, step->dt, speed, step->U0, run->V));
      run->barrier_start = step->U0;
      run->barrier_dt = step->dt;
    }

    /* the predictor, and the solution from there; with contact by active-set iterations */
    if (!run->goes_on)
      PetscCall((*a->predict)(a->ctx));
    if (!SbRunIsExplicit(run))
      PetscCall(SbRunSolveStep(run, a, &reason));

    /* the state at the end, or the reason of failure */
    PetscCall((*a->complete)(a->ctx, reason, ok));

    /* the penalty on jumps is that of the start: repeat a load step, maybe long, once with that of
       its end */
    if (*ok && !run->model->dynamic && !run->goes_on) {
      PetscCall(SbSpaceFollowJumps(run->model->space, step->U, SB_STEPS_OF_LOAD, &run->goes_on));
      if (run->goes_on)
        continue;
    }
    run->goes_on = PETSC_FALSE;

    /* the post-solve callback may request a more accurate solution */
    again = PETSC_FALSE;
    if (*ok && run->post_solve.fn && solves < SB_LOOKS)
      PetscCall((*run->post_solve.fn)(run, step, run->post_solve.ctx, &again));
  }

  /* -time_inverted reject */
  PetscCall(SbRunRejectInverted(run, step->t, step->dt, (Vec[2]){step->U0, step->U}, ok));

  /* restore prescribed motions to the start of the step, in case the run ends there */
  if (!*ok)
    SbContactSetAdvance(&run->model->contacts, 0.);

  /* warn of much shorter steps, once until they have the requested length again */
  if (!*ok && run->stop_reason[0] && !run->stopped && !run->shortened &&
      step->dt <= SHORT * run->dt) {
    run->shortened = PETSC_TRUE;
    PetscCall(SbWarning(
      run->model->comm,
      "steps had to be halved to %.2g of their length, and more: %s. It goes on; if it gets "
      "slow, try %s, or loads and motions that begin gently (docs/guides/when_it_fails.md)",
      (double)(step->dt / run->dt), run->stop_reason,
      run->model->dynamic ? "a shorter -ts_dt from the start" : "more -static_steps"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt,
                                 PetscBool last)
{
  const PetscBool first = (PetscBool)(step == run->step0);
  const PetscReal begun = MPI_Wtime();
  const SbModel m = run->model;
  SbStage stage = {.t = t, .dt = dt, .step = step, .shift_k = 1.};
  PetscBool jumps;
  SbStep now = {
    .step = step, .t = t, .dt = dt, .t_end = run->t_end, .U = run->U, .V = run->V, .A = run->A};

  PetscFunctionBeginUser;
  run->t_now = t;
  if (first)
    PetscCall(SbRunFollowJumps(run, &jumps));

  /* monitors have seen this step already, before it was known to be the last one */
  if (run->seen.U && run->seen.step == step) {
    if (!run->stopped || first)
      PetscFunctionReturn(PETSC_SUCCESS);
    now = run->seen;
    now.last = now.again = PETSC_TRUE;
    for (PetscInt k = 0; k < run->nmonitor; k++)
      PetscCall(run->monitor[k].fn(run, &now, run->monitor[k].ctx));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  now.last = (PetscBool)(last || run->stopped);
  if (!first)
    run->stop.longest_step =
      PetscMax(FORGET * run->stop.longest_step, begun - run->stop.step_begun);
  if (dt > 0.9 * run->dt)
    run->shortened = PETSC_FALSE;

  /* effects save their history */
  run->step_now = step;
  if (!first && m->naccept) {
    PetscCall(SbSpaceGetLocalRead(m->space, run->U, &stage.u));
    if (run->V)
      PetscCall(SbSpaceGetLocalRead(m->space, run->V, &stage.v));
    for (PetscInt e = 0; e < m->naccept; e++)
      SbEffectCall(m->accept[e], accept, m->space, &stage);
    if (run->V)
      PetscCall(SbSpaceRestoreLocalRead(m->space, run->V, &stage.v));
    PetscCall(SbSpaceRestoreLocalRead(m->space, run->U, &stage.u));
  }

  /* energy balance */
  if (run->want_energies)
    PetscCall(SbRunAccount(run, t, dt, first));
  else if (run->want_residual) {
    if (!run->reaction)
      PetscCall(VecDuplicate(run->U, &run->reaction));
    PetscCall(SbRunReactions(run, t, run->reaction));
  }

  /* call monitors */
  now.R = run->reaction;
  now.energies = run->energies;
  now.step_end =
    run->fixed_step ? step + (PetscInt)PetscCeilReal((run->t_end - t) / run->dt - 1e-6) : -1;
  now.newton = run->newton_step;
  now.linear = run->linear_step;
  now.rejected = run->rejected_total - run->rejected_seen;
  now.wall = MPI_Wtime() - run->wall_start;
  run->newton_total += now.newton;
  run->linear_total += now.linear;
  run->steps_total += !first;
  run->rejected_seen = run->rejected_total;
  run->newton_step = run->linear_step = 0;
  for (PetscInt k = 0; k < run->nmonitor; k++)
    PetscCall(run->monitor[k].fn(run, &now, run->monitor[k].ctx));
  run->seen = now;
  if (SbLiveCount())
    PetscCall(SbLiveAdvance(m->comm, t));
  run->stop.step_begun = MPI_Wtime();
  run->stop.longest_output = PetscMax(run->stop.longest_output, run->stop.step_begun - begun);
  PetscFunctionReturn(PETSC_SUCCESS);
}
