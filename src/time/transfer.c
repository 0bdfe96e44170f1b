/*
  Continuation of a run with another model of the same scene, after re-meshing. Integrators whose
  acceleration follows from the residual (the explicit ones, Newmark) recompute it; that of implicit
  Euler and generalized-alpha is a history variable.
*/
#include "time_impl.h"

PetscErrorCode SbRunTransferState(SbRun from, SbRun to)
{
  PetscReal dt;

  PetscFunctionBeginUser;
  to->clock.step0 = to->clock.step = from->clock.step;
  to->clock.t0 = to->clock.t = from->clock.t;
  to->model->load =
    to->model->dynamic ? 1. : from->clock.t; /* a failed attempt has changed the load factor */
  to->state.energies = from->state.energies;
  to->state.energy_start = from->state.energy_start;
  to->state.energy_most = from->state.energy_most;
  to->monitors.warned_gain = from->monitors.warned_gain;
  to->counters.newton = to->counters.newton_before = from->counters.newton;
  to->counters.linear = to->counters.linear_before = from->counters.linear;
  to->counters.rejected = to->counters.rejected_seen = from->counters.rejected;
  to->counters.steps = from->counters.steps;
  to->counters.unsolved = from->counters.unsolved;
  to->counters.most_left = from->counters.most_left;
  to->clock.wall_start = from->clock.wall_start;
  to->clock.stop = from->clock.stop;

  /* fixed steps return to their nominal length, also after a shortened one */
  if (!SbRunIsExplicit(to) || from->clock.dt_given)
    to->clock.dt = from->clock.dt;
  to->clock.dt_given = from->clock.dt_given;
  if (to->solve.ts) {
    PetscCall(TSGetTimeStep(from->solve.ts, &dt));
    if (to->clock.fixed)
      dt = to->clock.dt;
    PetscCall(TSSetTimeStep(to->solve.ts, PetscMin(dt, to->clock.t_end - from->clock.t)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunRestartAcceleration(SbRun run)
{
  Vec own;

  PetscFunctionBeginUser;
  if (!run->state.A || !(SbRunIsExplicit(run) || (run->solve.preset == SB_TIME_NEWMARK &&
                                                  !run->model->contacts.nactive_set)))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(run->state.A, &own));
  PetscCall(SbFormAcceleration(run, run->clock.t, run->state.U, run->state.V, PETSC_TRUE, own));
  PetscCall(SbSpaceZeroPrescribed(run->model->space, PETSC_FALSE, run->state.A));
  PetscCall(VecAXPY(run->state.A, 1., own));
  PetscCall(VecDestroy(&own));
  PetscFunctionReturn(PETSC_SUCCESS);
}
