/*
  Energies and momenta of a state: 1/2 v.M v, the strain energy of the laws, sum m v, sum x cross m
  v with the current positions x = X + u, the centre of mass, and extremes of speed, displacement
  and det F. One reduction for the sums, one for the extremes.

  With the consistent mass matrix kinetic energy and momenta use it, too; not the centre of mass.
*/
#include "model_impl.h"

PetscErrorCode SbModelEnergies(SbModel m, Vec U, Vec V, SbEnergies *e)
{
  SbSpace s = m->space;
  SbEvaluation at = {.U = U, .V = V};
  const PetscReal *u, *v;
  struct {
    PetscReal kinetic, strain, volume, inverted, momentum[3], angular[3], centre[3];
  } sum = {0};
  PetscReal extreme[3] = {0.}, *p; /* extremes: speed^2, displacement^2, -min J */
  PetscInt ninverted;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_ENERGY], 0, 0, 0, 0));
  PetscCall(SbEvaluationBegin(m, 0., &at));
  u = at.stage.u;
  v = at.stage.v;
  SbSpaceStrainEnergy(s, u, NULL, &sum.strain, &extreme[2], &ninverted, &sum.volume);
  sum.inverted = (PetscReal)ninverted;
  extreme[2] = -extreme[2];

  /* p = M v */
  PetscCall(PetscCalloc1(3 * s->nnode, &p));
  if (V)
    SbSpaceAddInertia(s, &(SbStage){.a = v}, p);
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal x[3], L[3];

    for (PetscInt k = 0; k < 3; k++) {
      x[k] = s->node_x[3 * i + k] + u[3 * i + k];
      sum.centre[k] += s->node_mass[i] * x[k];
      sum.momentum[k] += p[3 * i + k];
    }
    SbCross(x, p + 3 * i, L);
    for (PetscInt k = 0; k < 3; k++)
      sum.angular[k] += L[k];
    if (v)
      sum.kinetic += 0.5 * SbDot3(v + 3 * i, p + 3 * i);
    if (s->rigid && s->element[s->node_body[i]]->rigid)
      continue;
    extreme[1] = PetscMax(extreme[1], SbDot3(u + 3 * i, u + 3 * i));
    if (v)
      extreme[0] = PetscMax(extreme[0], SbDot3(v + 3 * i, v + 3 * i));
  }

  /* extremes of rigid bodies are at their vertices */
  for (PetscInt i = 0; s->rigid && i < 4 * s->mesh->ncell_owned; i++) {
    const PetscReal *basis = SbSpaceCornerBasis(s, i / 4, i % 4);
    const PetscInt *node = s->cell_node + 4 * (i / 4);
    PetscReal there[2][3] = {{0.}};

    if (!SbSpaceCellElement(s, i / 4)->rigid)
      continue;
    for (PetscInt a = 0; a < 4; a++) {
      for (PetscInt k = 0; k < 3; k++) {
        there[0][k] += v ? basis[a] * v[3 * node[a] + k] : 0.;
        there[1][k] += basis[a] * u[3 * node[a] + k];
      }
    }
    for (int k = 0; k < 2; k++)
      extreme[k] = PetscMax(extreme[k], SbDot3(there[k], there[k]));
  }
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCall(PetscFree(p));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, sizeof(sum) / sizeof(PetscReal), MPIU_REAL,
                             MPI_SUM, m->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, extreme, 3, MPIU_REAL, MPI_MAX, m->comm));
  e->kinetic = sum.kinetic;
  e->strain = sum.strain;
  if (s->viscous)
    e->strain += SbSpaceViscousStored(s, -1);
  e->volume = sum.volume;
  e->ninverted = (PetscInt)sum.inverted;
  e->max_speed = PetscSqrtReal(extreme[0]);
  e->max_displacement = PetscSqrtReal(extreme[1]);
  e->min_J = -extreme[2];
  for (PetscInt k = 0; k < 3; k++) {
    e->momentum[k] = sum.momentum[k];
    e->angular[k] = sum.angular[k];
    e->centre[k] = sum.centre[k] / m->mass;
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_ENERGY], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelBodySums(SbModel m, Vec U, Vec V, PetscReal sum[][SB_BODY_SUMS])
{
  const SbSpace s = m->space;
  SbEvaluation at = {.U = U, .V = V};
  PetscReal *p, *strain, unused[3];
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, 0., &at));
  PetscCall(PetscCalloc2(m->nbody, &strain, 3 * s->nnode, &p));
  SbSpaceStrainEnergy(s, at.stage.u, strain, &unused[0], &unused[1], &n, &unused[2]);
  for (PetscInt b = 0; b < m->nbody; b++)
    sum[b][1] += strain[b];
  for (PetscInt b = 0; b < m->nbody && s->viscous && s->rank == 0; b++)
    sum[b][1] += SbSpaceViscousStored(s, b);
  if (V)
    SbSpaceAddInertia(s, &(SbStage){.a = at.stage.v}, p);
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    PetscReal *mine = sum[s->node_body[i / 3]];

    if (V)
      mine[0] += 0.5 * at.stage.v[i] * p[i];
    mine[2 + i % 3] += p[i];
    mine[5 + i % 3] += s->node_mass[i / 3] * (s->node_x[i] + at.stage.u[i]);
  }
  PetscCall(PetscFree2(strain, p));
  PetscCall(SbEvaluationEnd(m, &at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelDampingPower(SbModel m, Vec U, Vec V, PetscReal *power)
{
  SbEvaluation at = {.U = U, .V = V};

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, 0., &at));
  PetscCall(SbSpaceDampingPower(m->space, at.stage.u, at.stage.v, power));
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, power, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelStrainEnergy(SbModel m, Vec U, Vec F, PetscReal *psi, PetscInt *ninverted)
{
  SbEvaluation at = {.U = U, .F = F};
  PetscReal sum[2], unused[2];

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, 0., &at));
  SbSpaceStrainEnergy(m->space, at.stage.u, NULL, &sum[0], &unused[0], ninverted, &unused[1]);
  if (m->space->active)
    sum[0] += SbSpaceActiveEnergy(m->space, at.stage.u);
  if (F)
    PetscCall(SbSpaceAddInternalForce(m->space, &at.stage, at.f));
  PetscCall(SbEvaluationEnd(m, &at));
  sum[1] = (PetscReal)*ninverted;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, m->comm));
  *psi = sum[0];
  *ninverted = (PetscInt)sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelTurned(SbModel m, Vec U, PetscReal angle, PetscReal *share)
{
  SbEvaluation at = {.U = U};
  PetscReal volume[2] = {0., 0.};

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, 0., &at));
  SbSpaceTurned(m->space, at.stage.u, angle, volume);
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, volume, 2, MPIU_REAL, MPI_SUM, m->comm));
  *share = volume[0] > 0. ? volume[1] / volume[0] : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelStepSpeed(SbModel m, PetscReal t, PetscReal dt, Vec U, Vec V,
                                PetscReal *speed)
{
  const SbSpace s = m->space;
  SbEvaluation at = {.U = U, .V = V};
  PetscReal load = 0.;
  PetscReal *f;
  SbEnergies energies;

  PetscFunctionBeginUser;
  *speed = 0.;
  if (!V)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbModelEnergies(m, U, V, &energies));
  if (PetscIsInfOrNanReal(energies.strain))
    energies.strain = 0.;
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbEvaluationBegin(m, t + dt, &at));
  PetscCall(SbModelExternalForces(m, &at.stage, PETSC_TRUE, 1., f));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    load += PetscSqrtReal(SbDot3(f + 3 * i, f + 3 * i));

  /* support forces: internal forces at prescribed nodes */
  if (m->nprescribe) {
    PetscCall(PetscArrayzero(f, 3 * s->nnode));
    PetscCall(SbSpaceAddInternalForce(s, &at.stage, f));
    for (PetscInt i = 0; i < s->nnode_owned; i++)
      if (s->fixed[i])
        load += PetscSqrtReal(SbDot3(f + 3 * i, f + 3 * i));
  }
  PetscCall(SbEvaluationEnd(m, &at));
  PetscCall(PetscFree(f));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &load, 1, MPIU_REAL, MPI_SUM, m->comm));
  *speed = PetscSqrtReal(
    (2. * (energies.kinetic + energies.strain) + load * SbBodySmallest(m->nbody, m->body)) /
    m->mass);
  PetscFunctionReturn(PETSC_SUCCESS);
}
