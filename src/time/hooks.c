/*
  What happens around a step, on one screen: effects move, the step is solved (second_order.c, static.c), effects accept,
  the energy account is closed, monitors look.

  The account: with R the residual without constraints (the reaction on prescribed unknowns) and f the loads, a step from 0 to 1
  does the work (f0 + f1)/2 . (u1 - u0) by the loads (exact for constant loads: minus the change of their potential),
  (R0 + R1)/2 . (u1 - u0) by moving supports, and loses (p0 + p1)/2 h with p = v . C v to damping. What is missing then
  between start and now was taken (or, negative, given) by the integrator.
*/
#include <stdarg.h>
#include "time_impl.h"

PetscErrorCode SbRunFail(SbRun run, const char *format, ...)
{
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(PetscVSNPrintf(run->stop_reason, sizeof(run->stop_reason), format, NULL, args));
  va_end(args);
  PetscCall(PetscInfo(NULL, "%s\n", run->stop_reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunStepBegin(SbRun run, PetscReal t, PetscReal dt)
{
  SbModel m = run->model;

  PetscFunctionBeginUser;
  for (PetscInt e = 0; e < m->nprestep; e++) SbEffectCall(m->prestep[e], prestep, m->space, t, dt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_effects(SbRun run, PetscInt step, PetscReal t, PetscReal dt)
{
  SbModel m = run->model;
  SbStage stage = {.t = t, .dt = dt, .step = step, .shift_k = 1.};

  PetscFunctionBeginUser;
  if (!m->naccept) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSpaceGetLocalRead(m->space, run->U, &stage.u));
  if (run->V) PetscCall(SbSpaceGetLocalRead(m->space, run->V, &stage.v));
  for (PetscInt e = 0; e < m->naccept; e++) SbEffectCall(m->accept[e], accept, m->space, &stage);
  if (run->V) PetscCall(SbSpaceRestoreLocalRead(m->space, run->V, &stage.v));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Leaves of a residual what is on prescribed unknowns. */
static PetscErrorCode keep_reactions(SbSpace s, Vec R)
{
  PetscScalar *r;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(R, &r));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    if (!(s->fixed[i / 3] & (1 << i % 3))) r[i] = 0.;
  }
  PetscCall(VecRestoreArray(R, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R with the acceleration of the integrator; where it keeps none (TSALPHA2) inertia is left out of the reactions.
   Forces between bodies are taken out. */
static PetscErrorCode unconstrained_residual(SbRun run, PetscReal t, Vec R)
{
  PetscFunctionBeginUser;
  PetscCall(SbModelResidual(run->model, t, run->U, run->V, run->A, PETSC_FALSE, R));
  if (run->model->space->couple) PetscCall(SbSpaceCoupleMeasure(run->model->space, run->U, R));
  if (run->model->space->held) {
    PetscScalar *r;

    PetscCall(VecGetArray(R, &r));
    SbHeldReaction(run->model->space, r);
    PetscCall(VecRestoreArray(R, &r));
  }
  if (SbSpaceCoupleOuter(run->model->space)) {
    if (!run->model->space->held) PetscCall(keep_reactions(run->model->space, R));
    PetscCall(SbSpaceCoupleReaction(run->model->space, R));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Work of a force field over a displacement, on all or only on prescribed unknowns; two times it, this rank's part. */
static PetscErrorCode works(SbRun run, Vec loads, Vec reaction, PetscReal sums[2])
{
  SbSpace s = run->model->space;
  const PetscBool obstacles = (PetscBool)(s->held || SbSpaceCoupleOuter(s));
  const PetscScalar *u, *u0, *f, *f0, *r, *r0;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(run->U, &u));
  PetscCall(VecGetArrayRead(run->previous, &u0));
  PetscCall(VecGetArrayRead(loads, &f));
  PetscCall(VecGetArrayRead(run->loads, &f0));
  PetscCall(VecGetArrayRead(reaction, &r));
  PetscCall(VecGetArrayRead(run->reaction, &r0));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) sums[0] += (f[i] + f0[i]) * (u[i] - u0[i]);
  for (PetscInt k = 0; k < s->nfixed && s->fixed_node[k] < s->nnode_owned; k++) {
    const PetscInt node = s->fixed_node[k];

    for (PetscInt i = 3 * node; i < 3 * node + 3; i++) {
      if (s->fixed[node] & (1 << (i - 3 * node))) sums[1] += (r[i] + r0[i]) * (u[i] - u0[i]);
    }
  }
  /* elsewhere what is left of it is what contact pushes with, now or a step ago */
  for (PetscInt i = 0; obstacles && i < 3 * s->nnode_owned; i++) {
    if (!(s->fixed[i / 3] & (1 << i % 3))) sums[1] += (r[i] + r0[i]) * (u[i] - u0[i]);
  }
  PetscCall(VecRestoreArrayRead(run->U, &u));
  PetscCall(VecRestoreArrayRead(run->previous, &u0));
  PetscCall(VecRestoreArrayRead(loads, &f));
  PetscCall(VecRestoreArrayRead(run->loads, &f0));
  PetscCall(VecRestoreArrayRead(reaction, &r));
  PetscCall(VecRestoreArrayRead(run->reaction, &r0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energies of the new state and the account of the step; `first` opens the account. */
static PetscErrorCode account(SbRun run, PetscReal t, PetscReal dt, PetscBool first)
{
  SbModel m = run->model;
  SbEnergies *e = &run->energies;
  PetscReal sums[2] = {0., 0.}, power = 0.;
  Vec loads, reaction;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(m, run->U, run->V, e));
  PetscCall(VecDuplicate(run->U, &loads));
  PetscCall(VecDuplicate(run->U, &reaction));
  PetscCall(SbModelLoads(m, t, run->U, run->V, loads));
  PetscCall(unconstrained_residual(run, t, reaction));
  if (run->damped) PetscCall(SbModelDampingPower(m, run->U, run->V, &power));
  if (!first) {
    PetscCall(works(run, loads, reaction, sums));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPI_SUM, m->comm));
    e->load_work += 0.5 * sums[0];
    e->drive_work += 0.5 * sums[1];
    e->damping_loss += 0.5 * dt * (power + run->damping_power);
  } else if (run->step0 == 0)
    run->energy_start = e->kinetic + e->strain;
  e->integrator_loss = run->energy_start + e->load_work + e->drive_work - e->damping_loss - e->remesh_loss -
                       e->kinetic - e->strain;
  run->damping_power = power;
  PetscCall(VecDestroy(&run->loads));
  PetscCall(VecDestroy(&run->reaction));
  run->loads = loads;
  run->reaction = reaction;
  if (!run->previous) PetscCall(VecDuplicate(run->U, &run->previous));
  PetscCall(VecCopy(run->U, run->previous));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt, PetscBool last)
{
  const PetscBool first = (PetscBool)(step == run->step0);
  SbStep now = {
    .step = step, .t = t, .dt = dt, .t_end = run->t_end, .U = run->U, .V = run->V, .A = run->A, .last = last};

  PetscFunctionBeginUser;
  run->step_now = step;
  run->t_now = t;
  if (!first) PetscCall(accept_effects(run, step, t, dt));
  if (run->want_energies)
    PetscCall(account(run, t, dt, first));
  else if (run->want_residual) {
    if (!run->reaction) PetscCall(VecDuplicate(run->U, &run->reaction));
    PetscCall(unconstrained_residual(run, t, run->reaction));
  }
  now.R = run->reaction;
  now.energies = run->energies;
  now.step_end = run->fixed_step ? step + (PetscInt)PetscCeilReal((run->t_end - t) / run->dt - 1e-6) : -1;
  now.newton = run->newton_step;
  now.linear = run->linear_step;
  now.rejected = run->rejected_step;
  now.wall = MPI_Wtime() - run->wall_start;
  run->newton_total += now.newton;
  run->linear_total += now.linear;
  run->steps_total += !first;
  for (PetscInt k = 0; k < run->nmonitor; k++) PetscCall(run->monitor[k].fn(run, &now, run->monitor[k].ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}
