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
  to->step0 = to->step_now = from->step_now;
  to->t0 = to->t_now = from->t_now;
  to->model->load =
    to->model->dynamic ? 1. : from->t_now; /* a failed attempt has changed the load factor */
  to->energies = from->energies;
  to->energy_start = from->energy_start;
  to->energy_most = from->energy_most;
  to->gain_said = from->gain_said;
  to->newton_total = to->newton_before = from->newton_total;
  to->linear_total = to->linear_before = from->linear_total;
  to->rejected_total = to->rejected_seen = from->rejected_total;
  to->steps_total = from->steps_total;
  to->wall_start = from->wall_start;
  to->stop = from->stop;

  /* fixed steps return to their nominal length, also after a shortened one */
  if (!SbRunIsExplicit(to) || from->dt_given)
    to->dt = from->dt;
  to->dt_given = from->dt_given;
  if (to->ts) {
    PetscCall(TSGetTimeStep(from->ts, &dt));
    if (to->fixed_step)
      dt = to->dt;
    PetscCall(TSSetTimeStep(to->ts, PetscMin(dt, to->t_end - from->t_now)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunRestartAcceleration(SbRun run)
{
  Vec own;

  PetscFunctionBeginUser;
  if (!run->A || !(SbRunIsExplicit(run) ||
                   (run->preset == SB_TIME_NEWMARK && !run->model->contacts.nactive_set)))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(run->A, &own));
  PetscCall(SbFormAcceleration(run, run->t_now, run->U, run->V, PETSC_TRUE, own));
  PetscCall(SbSpaceZeroPrescribed(run->model->space, PETSC_FALSE, run->A));
  PetscCall(VecAXPY(run->A, 1., own));
  PetscCall(VecDestroy(&own));
  PetscFunctionReturn(PETSC_SUCCESS);
}
