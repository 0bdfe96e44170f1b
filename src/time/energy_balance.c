/*
  Energy balance. R: residual without constraints (reaction on prescribed unknowns), f: loads. The
  work in a step from 0 to 1 is (f0 + f1)/2 . (u1 - u0) by loads (exact for constant ones: minus the
  change of their potential), (R0 + R1)/2 . (u1 - u0) by moving supports (rotating ones: moment
  times angle), by fibres that contract as by loads, and by strains without stress likewise
  (src/fem/eigenstrain.c); damping dissipates (p0 + p1)/2
  h, p = v . C v. Barrier contact integrates its own work (src/contact/surfaces.c), as the energy of
  its gaps may change much in a step. The rest of the difference between the energies at the start
  and now was dissipated (negative: added) by the integrator. A stable implicit one adds little; if
  one adds most of the energy, it is unstable, and the run means nothing from there on.
*/
#include "time_impl.h"

#define GIVEN 0.5 /* energy added by an unstable integrator, over the largest energy so far */

/* Energy that rounding may give: of strains of the size of machine epsilon, times a stress of
   Young's modulus, J. */
static PetscReal rounding(const SbModel m)
{
  PetscReal sum = 0.;

  for (PetscInt b = 0; b < m->nbody; b++)
    sum += SbMaterialYoungModulus(m->material[b]) * m->body[b].volume;
  return PETSC_MACHINE_EPSILON * sum;
}

PetscErrorCode SbRunReactions(SbRun run, PetscReal t, Vec R)
{
  const SbSpace s = run->model->space;
  const PetscReal *u;
  PetscScalar *r;

  PetscFunctionBeginUser;
  PetscCall(
    SbModelResidual(run->model, t, run->state.U, run->state.V, run->state.A, PETSC_FALSE, R));
  if (s->constraints) {
    /* keep reactions at prescribed unknowns, and contact forces */
    PetscCall(SbSpaceGetLocalRead(s, run->state.U, &u));
    PetscCall(VecGetArray(R, &r));
    SbConstraintsComputeForces(s, u, r);
    SbConstraintsReactions(s, r);
    PetscCall(VecRestoreArray(R, &r));
    PetscCall(SbSpaceRestoreLocalRead(s, run->state.U, &u));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAccount(SbRun run, PetscReal t, PetscReal dt, PetscBool first)
{
  SbModel m = run->model;
  SbEnergies *e = &run->state.energies;
  PetscReal work[4], power = 0.,
                     own[2] = {0., 0.}; /* of contact, of rotating supports: this rank's */
  Vec loads, reaction;
  Vec active = NULL;

  PetscFunctionBeginUser;
  PetscCall(SbModelActiveAt(m, t));
  PetscCall(SbModelEnergies(m, run->state.U, run->state.V, e));
  PetscCall(VecDuplicate(run->state.U, &loads));
  PetscCall(VecDuplicate(run->state.U, &reaction));
  PetscCall(SbModelLoads(m, t, run->state.U, run->state.V, loads));

  /* loads without barrier contact, which has its own work */
  if (m->contacts.npotential)
    PetscCall(SbContactSetGradient(&m->contacts, run->state.U, 1., PETSC_FALSE, NULL, loads));
  own[0] += SbContactSetWork(&m->contacts);
  PetscCall(SbRunReactions(run, t, reaction));
  if (m->space->active) {
    PetscCall(VecDuplicate(run->state.U, &active));
    PetscCall(SbModelActiveForce(m, t, run->state.U, active));
  }
  if (m->space->eigen) {
    PetscReal strained[2];

    PetscCall(SbModelEigenWork(m, t, run->state.U, first, strained));
    e->active_work += strained[0];
    e->growth_work += strained[1];
  }
  if (run->solve.damped)
    PetscCall(SbModelDampingPower(m, run->state.U, run->state.V, &power));
  if (!first) {
    const PetscScalar *before, *now;
    Vec moved;

    /* twice the work of loads and reactions: at prescribed unknowns, and where contact acts or just
       did */
    PetscCall(VecDuplicate(run->state.U, &moved));
    PetscCall(VecWAXPY(moved, -1., run->state.previous, run->state.U));
    PetscCall(VecDot(loads, moved, &work[0]));
    PetscCall(VecDot(run->state.loads, moved, &work[1]));
    if (active) {
      PetscReal of_fibres[2];

      PetscCall(VecDot(active, moved, &of_fibres[0]));
      PetscCall(VecDot(run->state.active, moved, &of_fibres[1]));
      e->active_work += 0.5 * (of_fibres[0] + of_fibres[1]);
    }
    if (!m->space->constraints)
      PetscCall(SbSpaceZeroPrescribed(m->space, PETSC_FALSE, moved));
    PetscCall(VecDot(reaction, moved, &work[2]));
    PetscCall(VecDot(run->state.reaction, moved, &work[3]));
    PetscCall(VecDestroy(&moved));

    /* work of reactions along rotations beyond that of their mean along the chord */
    PetscCall(VecGetArrayRead(run->state.reaction, &before));
    PetscCall(VecGetArrayRead(reaction, &now));
    for (PetscInt k = 0; k < m->nprescribe; k++) {
      if (!m->prescribe[k]->ops.turning_work)
        continue;
      SbEffectCall(m->prescribe[k], turning_work, m->space, t - dt, t, before, now, &own[1]);
    }
    PetscCall(VecRestoreArrayRead(reaction, &now));
    PetscCall(VecRestoreArrayRead(run->state.reaction, &before));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, own, 2, MPIU_REAL, MPI_SUM, m->comm));
    e->load_work += 0.5 * (work[0] + work[1]) + own[0];
    e->prescribed_work += 0.5 * (work[2] + work[3]) + own[1];
    e->damping_loss += 0.5 * dt * (power + run->state.damping_power);
  } else if (run->clock.step0 == 0) {
    /* contact may have moved surfaces apart already */
    PetscCallMPI(MPI_Allreduce(own, &e->load_work, 1, MPIU_REAL, MPI_SUM, m->comm));
    run->state.energy_start = e->kinetic + e->strain - e->load_work;
  }
  e->integrator_loss = run->state.energy_start + e->load_work + e->prescribed_work -
                       e->damping_loss - e->remesh_loss - e->kinetic - e->strain;
  if (m->space->viscous)
    e->integrator_loss -= e->relaxation_loss + e->viscosity_loss;
  if (m->space->softening)
    e->integrator_loss -= e->mullins_loss;
  e->integrator_loss += e->active_work + e->growth_work;
  run->state.energy_most = PetscMax(run->state.energy_most, e->kinetic + e->strain);
  if (m->dynamic && !run->monitors.warned_gain &&
      -e->integrator_loss > GIVEN * run->state.energy_most + rounding(m)) {
    const char *advice = ", or -time genalpha or euler_implicit, which damp";
    char names[256];

    if (run->solve.fast)
      advice = ", or -contact_quality exact, which solves them";
    else if (run->solve.soft)
      advice =
        ", or -body_<name>_tangent exact_spd: one solve with a warped tangent may gain energy";
    else if (run->solve.preset == SB_TIME_EULER_IMPLICIT)
      advice = "";
    run->monitors.warned_gain = PETSC_TRUE;
    SbEffectsWithoutPotential(m->neffect, m->effect, sizeof(names), names);
    if (names[0])
      PetscCall(SbWarning(
        m->comm,
        "t = %g s: the energy balance is off by %.3g of the %.3g J that bodies have: the force of "
        "%s "
        "has no potential (a pressure on an open surface), and its work in a step of %g s is known "
        "from the two ends only; a shorter -ts_dt tells whether the integrator gives energy, too",
        (double)t, (double)-e->integrator_loss, (double)(e->kinetic + e->strain), names,
        (double)dt));
    else
      PetscCall(SbWarning(
        m->comm,
        "t = %g s: of the %.3g J that bodies have, the integrator gave %.3g J: it is unstable with "
        "steps of %g s; try a shorter -ts_dt%s",
        (double)t, (double)(e->kinetic + e->strain), (double)-e->integrator_loss, (double)dt,
        advice));
  }
  run->state.damping_power = power;
  PetscCall(VecDestroy(&run->state.loads));
  PetscCall(VecDestroy(&run->state.reaction));
  PetscCall(VecDestroy(&run->state.active));
  run->state.loads = loads;
  run->state.active = active;
  run->state.reaction = reaction;
  if (!run->state.previous)
    PetscCall(VecDuplicate(run->state.U, &run->state.previous));
  PetscCall(VecCopy(run->state.U, run->state.previous));
  PetscFunctionReturn(PETSC_SUCCESS);
}
