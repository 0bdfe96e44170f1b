/*
  The account of energies. With R the residual without constraints (the reaction on prescribed unknowns) and f the loads, a step from 0 to 1
  does the work (f0 + f1)/2 . (u1 - u0) by the loads (exact for constant loads: minus the change of their potential),
  (R0 + R1)/2 . (u1 - u0) by moving supports, and loses (p0 + p1)/2 h with p = v . C v to damping. What contact by barrier does it
  knows itself (src/effect/barrier.c): the energy of its gaps may change by much within a step. What is missing then
  between start and now was taken (or, negative, given) by the integrator. None of the implicit ones gives much while it is stable; one
  that gives most of what there is will go on, and what the run shows from there on is no motion of a body.
*/
#include "time_impl.h"

#define GIVEN 0.5 /* of the largest energy so far: what an integrator has given when it is unstable */

PetscErrorCode SbRunReactions(SbRun run, PetscReal t, Vec R)
{
  const SbSpace s = run->model->space;
  const PetscReal *u;
  PetscScalar *r;

  PetscFunctionBeginUser;
  PetscCall(SbModelResidual(run->model, t, run->U, run->V, run->A, PETSC_FALSE, R));
  if (s->constraints) {
    /* what is on prescribed unknowns, and what contact has exerted */
    PetscCall(SbSpaceGetLocalRead(s, run->U, &u));
    PetscCall(VecGetArray(R, &r));
    SbConstraintsComputeForces(s, u, r);
    SbConstraintsReactions(s, r);
    PetscCall(VecRestoreArray(R, &r));
    PetscCall(SbSpaceRestoreLocalRead(s, run->U, &u));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAccount(SbRun run, PetscReal t, PetscReal dt, PetscBool first)
{
  SbModel m = run->model;
  SbEnergies *e = &run->energies;
  PetscReal sums[2] = {0., 0.}, power = 0., contact = 0.;
  Vec loads, reaction;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(m, run->U, run->V, e));
  PetscCall(VecDuplicate(run->U, &loads));
  PetscCall(VecDuplicate(run->U, &reaction));
  PetscCall(SbModelLoads(m, t, run->U, run->V, loads));
  if (m->npotential) PetscCall(SbModelPotentialWork(m, run->U, &contact, loads));
  PetscCall(SbRunReactions(run, t, reaction));
  if (run->damped) PetscCall(SbModelDampingPower(m, run->U, run->V, &power));
  if (!first) {
    const SbSpace s = run->model->space;
    const PetscBool obstacles = (PetscBool)(s->constraints != NULL);
    const PetscScalar *u, *u0, *f, *f0, *r, *r0;

    /* Work of a force field over a displacement, on all or only on prescribed unknowns; two times it, this rank's part. */
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
    /* elsewhere the remainder of it is what contact exerts, now or a step ago */
    for (PetscInt i = 0; obstacles && i < 3 * s->nnode_owned; i++) {
      if (!(s->fixed[i / 3] & (1 << i % 3))) sums[1] += (r[i] + r0[i]) * (u[i] - u0[i]);
    }
    PetscCall(VecRestoreArrayRead(run->U, &u));
    PetscCall(VecRestoreArrayRead(run->previous, &u0));
    PetscCall(VecRestoreArrayRead(loads, &f));
    PetscCall(VecRestoreArrayRead(run->loads, &f0));
    PetscCall(VecRestoreArrayRead(reaction, &r));
    PetscCall(VecRestoreArrayRead(run->reaction, &r0));
    sums[0] += 2. * contact;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPI_SUM, m->comm));
    e->load_work += 0.5 * sums[0];
    e->prescribed_work += 0.5 * sums[1];
    e->damping_loss += 0.5 * dt * (power + run->damping_power);
  } else if (run->step0 == 0)
    run->energy_start = e->kinetic + e->strain;
  e->integrator_loss = run->energy_start + e->load_work + e->prescribed_work - e->damping_loss -
                       e->remesh_loss - e->kinetic - e->strain;
  run->energy_most = PetscMax(run->energy_most, e->kinetic + e->strain);
  if (m->dynamic && !run->gain_said && -e->integrator_loss > GIVEN * run->energy_most) {
    run->gain_said = PETSC_TRUE;
    PetscCall(
      SbWarning(m->comm,
                "t = %g s: of the %.3g J that bodies have, the integrator gave %.3g J: it is unstable with "
                "steps of %g s; try a shorter -ts_dt, or -time genalpha or euler_implicit, which damp",
                (double)t, (double)(e->kinetic + e->strain), (double)-e->integrator_loss, (double)dt));
  }
  run->damping_power = power;
  PetscCall(VecDestroy(&run->loads));
  PetscCall(VecDestroy(&run->reaction));
  run->loads = loads;
  run->reaction = reaction;
  if (!run->previous) PetscCall(VecDuplicate(run->U, &run->previous));
  PetscCall(VecCopy(run->U, run->previous));
  PetscFunctionReturn(PETSC_SUCCESS);
}
