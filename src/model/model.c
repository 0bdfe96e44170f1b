/*
  The model: the semi-discrete equation M a + C v + f_int(u) = f_ext(t, u, v) of a scene.

  Set-up makes one list of effects per operation; an evaluation calls the effects in these lists.
  A static run has no M and no C, and loads and prescribed displacements are multiplied by the load
  factor.
*/
#include "model_impl.h"

#define SETTLED \
  1e-4 /* change of the energy of jumps by new penalties, over the strain energy, for which a load \
          step is repeated */

PetscErrorCode SbModelDestroy(SbModel *model)
{
  SbModel m = *model;

  PetscFunctionBeginUser;
  if (!m)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt e = 0; e < m->neffect; e++)
    PetscCall(SbEffectDestroy(&m->effect[e]));
  PetscCall(PetscFree(m->effect));
  PetscCall(PetscFree(m->lists));
  PetscCall(SbContactSetDestroy(&m->contacts));
  PetscCall(SbSpaceDestroy(&m->space));
  PetscCall(SbMeshDestroy(&m->mesh));
  for (PetscInt k = 0; k < m->nmaterial; k++)
    PetscCall(SbMaterialDestroy(&m->material[k]));
  for (PetscInt b = 0; b < m->nbody; b++) {
    PetscCall(SbElementDestroy(&m->element[b]));
    PetscCall(SbMemoryMeshDestroy(&m->body[b].in_memory));
    for (int k = 0; k < 3; k++) {
      PetscCall(SbFormulaDestroy(&m->start[b].displacement[k]));
      PetscCall(SbFormulaDestroy(&m->start[b].velocity[k]));
    }
  }
  PetscCall(PetscFree3(m->body, m->element, m->start));
  PetscCall(PetscFree(m->material));
  PetscCall(PetscFree(m->set));
  PetscCall(PetscFree(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error for an inclusion without tets. */
static PetscErrorCode check_inclusions(SbModel m)
{
  PetscInt *count;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(m->nmaterial, &count));
  for (PetscInt c = 0; c < m->mesh->ncell_owned; c++)
    count[m->mesh->cell_material[c]]++;
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)m->nmaterial, MPIU_INT, MPI_SUM, m->comm));
  for (PetscInt b = 0; b < m->nbody; b++) {
    for (PetscInt k = 0; k < m->body[b].ninclusion; k++) {
      const PetscInt i = m->body[b].inclusion[k].material;

      PetscCheck(count[i], m->comm, PETSC_ERR_USER_INPUT,
                 "-body_%s_inclusions: '%s' holds no tetrahedra of this body that an earlier "
                 "inclusion has not taken",
                 m->body[b].name, m->material[i]->name);
    }
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Scales densities so that a re-meshed body keeps its mass. */
static PetscErrorCode match_mass(SbModel m, PetscInt b)
{
  const SbMesh mesh = m->mesh;
  PetscReal mass = 0.;
  PetscReal factor;

  PetscFunctionBeginUser;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt *vert = mesh->cell + 4 * c;

    if (mesh->cell_body[c] != b)
      continue;
    mass +=
      m->material[mesh->cell_material[c]]->density *
      (mesh->cell_set[c] & SB_CURVED ? SbTetCurvedVolume(mesh->x, vert, mesh->edge_off + 18 * c)
                                     : SbTetDeterminant(mesh->x, vert) / 6.);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &mass, 1, MPIU_REAL, MPI_SUM, m->comm));
  factor = m->body[b].in_memory->mass / mass;
  m->material[b]->density *= factor;
  for (PetscInt k = 0; k < m->body[b].ninclusion; k++)
    m->material[m->body[b].inclusion[k].material]->density *= factor;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists of the effects that have an operation, in scenario order, one after the other in
   m->lists. */
#define NLIST 8
#define SORT_INTO_LIST(m, op)                                        \
  do {                                                               \
    PetscCheck(nlist++ < NLIST, (m)->comm, PETSC_ERR_PLIB, "NLIST"); \
    (m)->op = list;                                                  \
    for (PetscInt i_ = 0; i_ < (m)->neffect; i_++)                   \
      if ((m)->effect[i_]->ops.op)                                   \
        (m)->op[(m)->n##op++] = (m)->effect[i_];                     \
    list += (m)->n##op;                                              \
  } while (0)

PetscErrorCode SbModelSetUp(SbModel m)
{
  PetscReal mass = 0.;
  PetscInt nlist = 0;
  PetscBool coupled = PETSC_FALSE;
  PetscBool validate;
  SbEffect *list;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++) {
    const PetscInt *per = m->element[b]->nodes_per;

    m->body[b].other_nodes = (PetscBool)(!per[0] || per[1]);
    m->body[b].edge_nodes = (PetscBool)(per[1] > 0);
  }
  PetscCall(SbMeshCreate(m->comm, m->nbody, m->body, m->nset, m->set, &m->mesh));
  if (m->nmaterial > m->nbody)
    PetscCall(check_inclusions(m));
  for (PetscInt b = 0; b < m->nbody; b++)
    if (m->body[b].in_memory && m->body[b].in_memory->mass > 0.)
      PetscCall(match_mass(m, b));
  for (PetscInt k = 0; k < m->nmaterial; k++)
    m->may_filter = (PetscBool)(m->may_filter || m->material[k]->adaptive);

  /* skip supports that do not act at this time; the sets that others prescribe in all directions */
  for (PetscInt e = 0; e < m->neffect; e++) {
    SbEffect effect = m->effect[e];

    if (effect->ops.prescribe && !SbEffectActsAfter(effect, m->t_begin)) {
      effect->ops.setup = NULL;
      effect->ops.prescribe = NULL;
      continue;
    }
    for (PetscInt k = 0; effect->prescribed && k < m->nset * effect->on.n; k++)
      if (!strcmp(m->set[k % m->nset].name, effect->on.name[k / m->nset]))
        m->set[k % m->nset].prescribed = PETSC_TRUE;
  }
  PetscCall(SbModelStiffenRigid(m));
  PetscCall(SbCellFieldsFind(m->mesh, m->material));
  PetscCall(SbSpaceCreate(m->mesh, m->material, m->element, &m->space));
  PetscCall(SbSpaceWarnShapes(m->space));
  m->load = 1.;
  m->linear = m->space->linear;

  /* nodes that effects couple, before arrays over nodes are made */
  for (PetscInt e = 0; e < m->neffect; e++) {
    if (!m->effect[e]->ops.couplings)
      continue;
    SbEffectCall(m->effect[e], couplings, m->space);
    coupled = PETSC_TRUE;
  }
  if (coupled)
    PetscCall(SbSpaceCoupleDone(m->space));

  /* supports first: other effects need the prescribed unknowns */
  for (PetscInt k = 0; k < 2 * m->neffect; k++) {
    SbEffect effect = m->effect[k % m->neffect];

    if ((k < m->neffect) != (effect->ops.prescribe != NULL))
      continue;
    effect->dynamic = m->dynamic;
    if (effect->ops.setup)
      SbEffectCall(effect, setup, m->space);
    m->linear = (PetscBool)(m->linear && effect->linear);
  }
  PetscCall(SbSpacePrescribeDone(m->space));
  PetscCall(PetscMalloc1(NLIST * m->neffect, &m->lists));
  list = m->lists;
  SORT_INTO_LIST(m, prescribe);
  SORT_INTO_LIST(m, force);
  SORT_INTO_LIST(m, tangent);
  SORT_INTO_LIST(m, nonsymmetric);
  SORT_INTO_LIST(m, volume_pressure);
  SORT_INTO_LIST(m, settle);
  SORT_INTO_LIST(m, accept);
  SORT_INTO_LIST(m, history);
  PetscCall(SbContactSetCreate(m->space, m->neffect, m->effect, &m->contacts));
  PetscCall(SbModelCheckRepeated(m));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++)
    mass += m->space->node_mass[i];
  PetscCallMPI(MPI_Allreduce(&mass, &m->mass, 1, MPIU_REAL, MPI_SUM, m->comm));
  PetscCall(SbOptionBool(&SbRunScope, "validate", &validate));
  if (!validate)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMeshValidate(m->mesh));
  PetscCall(SbSpaceValidate(m->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelCentres(SbModel m, Vec U, PetscReal centre[][4])
{
  const SbSpace s = m->space;
  const PetscScalar *u = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(&centre[0][0], 4 * m->nbody));
  if (U)
    PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal *c = centre[s->node_body[i]];

    c[3] += s->node_mass[i];
    for (PetscInt k = 0; k < 3; k++)
      c[k] += s->node_mass[i] * (s->node_x[3 * i + k] + (u ? u[3 * i + k] : 0.));
  }
  if (U)
    PetscCall(VecRestoreArrayRead(U, &u));
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, centre, (PetscMPIInt)(4 * m->nbody), MPIU_REAL, MPI_SUM, m->comm));
  for (PetscInt b = 0; b < m->nbody; b++)
    for (PetscInt k = 0; k < 3; k++)
      centre[b][k] /= centre[b][3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEvaluationBegin(SbModel m, PetscReal t, SbEvaluation *e)
{
  PetscFunctionBeginUser;
  e->stage = (SbStage){.t = t, .shift_k = 1.};
  PetscCall(SbSpaceGetLocalRead(m->space, e->U, &e->stage.u));
  if (e->V)
    PetscCall(SbSpaceGetLocalRead(m->space, e->V, &e->stage.v));
  if (e->A)
    PetscCall(SbSpaceGetLocalRead(m->space, e->A, &e->stage.a));
  if (e->F)
    PetscCall(SbSpaceGetLocalWrite(m->space, e->F, &e->f));
  if (e->F)
    PetscCall(PetscArrayzero(e->f, 3 * m->space->nnode));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEvaluationEnd(SbModel m, SbEvaluation *e)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceRestoreLocalRead(m->space, e->U, &e->stage.u));
  if (e->V)
    PetscCall(SbSpaceRestoreLocalRead(m->space, e->V, &e->stage.v));
  if (e->A)
    PetscCall(SbSpaceRestoreLocalRead(m->space, e->A, &e->stage.a));
  if (e->F)
    PetscCall(SbSpaceRestoreLocalWrite(m->space, e->F, &e->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelExternalForces(SbModel m, const SbStage *stage, PetscBool apart,
                                     PetscReal sign, PetscReal f[])
{
  const PetscInt n = 3 * m->space->nnode;

  PetscFunctionBeginUser;
  if (!m->nforce)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_EFFECTS], 0, 0, 0, 0));

  /* constant ones first: they have a common factor */
  for (PetscInt e = 0; e < m->nforce; e++)
    if (m->force[e]->steady && SbEffectActs(m->force[e], stage->t))
      SbEffectCall(m->force[e], force, m->space, stage, f);
  if (m->load != 1.)
    for (PetscInt i = 0; i < n; i++)
      f[i] *= m->load;
  for (PetscInt e = 0; e < m->nforce; e++)
    if (!m->force[e]->steady && !(apart && SbEffectHasPotential(m->force[e])) &&
        SbEffectActs(m->force[e], stage->t))
      SbEffectCall(m->force[e], force, m->space, stage, f);
  if (sign != 1.)
    for (PetscInt i = 0; i < n; i++)
      f[i] *= sign;
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_EFFECTS], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelActiveAt(SbModel m, PetscReal t)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceActiveAt(m->space, t, m->dynamic ? 1. : t));
  PetscCall(SbSpaceEigenAt(m->space, t, m->dynamic ? 1. : t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelEigenWork(SbModel m, PetscReal t, Vec U, PetscBool first, PetscReal work[2])
{
  SbEvaluation e = {.U = U};

  PetscFunctionBeginUser;
  PetscCall(SbModelActiveAt(m, t));
  PetscCall(SbEvaluationBegin(m, t, &e));
  SbSpaceEigenWork(m->space, e.stage.u, first, work);
  PetscCall(SbEvaluationEnd(m, &e));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, work, 2, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelActiveForce(SbModel m, PetscReal t, Vec U, Vec F)
{
  SbEvaluation e = {.U = U, .F = F};

  PetscFunctionBeginUser;
  PetscCall(SbModelActiveAt(m, t));
  PetscCall(SbEvaluationBegin(m, t, &e));
  SbSpaceAddActiveForce(m->space, e.stage.u, e.f);
  PetscCall(SbEvaluationEnd(m, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelResidual(SbModel m, PetscReal t, Vec U, Vec V, Vec A, PetscBool constrain,
                               Vec F)
{
  SbEvaluation e = {.U = U, .V = V, .A = A, .F = F};

  PetscFunctionBeginUser;
  PetscCall(SbModelActiveAt(m, t));
  PetscCall(SbEvaluationBegin(m, t, &e));
  PetscCall(
    SbModelExternalForces(m, &e.stage, (PetscBool)(constrain && m->barrier_apart), -1., e.f));
  PetscCall(SbSpaceAddInternalForce(m->space, &e.stage, e.f));
  if (A || V)
    SbSpaceAddInertia(m->space, &e.stage, e.f);
  if (m->space->constraints)
    SbConstraintsResidual(m->space, e.stage.u, constrain, e.f);
  PetscCall(SbEvaluationEnd(m, &e));

  /* guesses have the prescribed values */
  if (constrain)
    PetscCall(SbSpaceZeroPrescribed(m->space, PETSC_TRUE, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelLoads(SbModel m, PetscReal t, Vec U, Vec V, Vec F)
{
  SbEvaluation e = {.U = U, .V = V, .F = F};

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, t, &e));
  PetscCall(SbModelExternalForces(m, &e.stage, PETSC_FALSE, 1., e.f));
  PetscCall(SbEvaluationEnd(m, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelTangent(SbModel m, PetscReal t, PetscReal shift_v, PetscReal shift_a,
                              PetscReal shift_k, Vec U, Vec V, Mat A)
{
  SbEvaluation e = {.U = U, .V = V};

  PetscFunctionBeginUser;
  if (shift_k != 0.)
    PetscCall(SbModelActiveAt(m, t));
  PetscCall(SbEvaluationBegin(m, t, &e));
  e.stage.shift_a = shift_a;
  e.stage.shift_v = shift_v;
  e.stage.shift_k = shift_k;
  PetscCall(SbSpaceAssembleTangent(m->space, &e.stage, A));
  for (PetscInt k = 0; k < m->ntangent; k++) {
    if (!SbEffectActs(m->tangent[k], t))
      continue;

    /* in a static run the load factor, except for formulas of t, which is the load factor there:
       they prescribe the load path themselves */
    m->space->block_scale = m->tangent[k]->steady ? m->load : 1.;
    SbEffectCall(m->tangent[k], tangent, m->space, &e.stage, A);
  }
  PetscCall(SbSpaceFinishTangent(m->space, A));
  PetscCall(SbEvaluationEnd(m, &e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelNonsymmetric(SbModel m, PetscReal t, Vec U, Vec X, Vec Y)
{
  SbEvaluation e = {.U = U, .F = Y};
  const PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(SbEvaluationBegin(m, t, &e));
  PetscCall(SbSpaceGetLocalRead(m->space, X, &x));
  for (PetscInt k = 0; k < m->nnonsymmetric; k++) {
    if (!SbEffectActs(m->nonsymmetric[k], t))
      continue;
    e.stage.shift_k = m->nonsymmetric[k]->steady ? m->load : 1.;
    SbEffectCall(m->nonsymmetric[k], nonsymmetric, m->space, &e.stage, x, e.f);
  }
  PetscCall(SbSpaceRestoreLocalRead(m->space, X, &x));
  PetscCall(SbEvaluationEnd(m, &e));
  PetscCall(SbSpaceProjectAdmissible(m->space, Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SbSpaceFollowJumps() with the pressures of loads at t. */
static PetscErrorCode follow_jumps(SbModel m, PetscReal t, Vec U, SbStepsOf steps, PetscReal enough,
                                   PetscBool *changed)
{
  PetscReal *even = NULL;
  PetscReal *all;

  PetscFunctionBeginUser;
  if (m->nvolume_pressure && m->space->jump)
    PetscCall(PetscCalloc1(2 * m->nbody, &even));
  all = even ? even + m->nbody : NULL;
  for (PetscInt k = 0; k < m->nvolume_pressure && even; k++) {
    const SbEffect effect = m->volume_pressure[k];

    if (!SbEffectActs(effect, t))
      continue;
    PetscCall(PetscArrayzero(even, m->nbody));
    SbEffectCall(effect, volume_pressure, t, even);
    for (PetscInt b = 0; b < m->nbody; b++)
      all[b] += (effect->steady && !m->dynamic ? t : 1.) * even[b];
  }
  PetscCall(SbSpaceFollowJumps(m->space, U, all, steps, enough, changed));
  PetscCall(PetscFree(even));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelFollowJumps(SbModel m, PetscReal t, Vec U, SbStepsOf steps,
                                  PetscBool *changed)
{
  PetscReal enough = 0.;

  PetscFunctionBeginUser;
  if (changed && m->space->jump && !m->space->linear && steps == SB_STEPS_OF_LOAD) {
    const PetscReal *u;
    PetscReal least, volume;
    PetscInt inverted;

    PetscCall(SbSpaceGetLocalRead(m->space, U, &u));
    SbSpaceStrainEnergy(m->space, u, NULL, &enough, &least, &inverted, &volume);
    PetscCall(SbSpaceRestoreLocalRead(m->space, U, &u));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &enough, 1, MPIU_REAL, MPI_SUM, m->comm));
    enough *= SETTLED;
  }
  PetscCall(follow_jumps(m, t, U, steps, enough, changed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelBearStress(SbModel m, PetscReal t, Vec U, PetscBool *changed)
{
  PetscFunctionBeginUser;
  PetscCall(follow_jumps(m, t, U, SB_STEPS_FAILED, 0., changed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelProjectTangent(SbModel m, PetscBool filter)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->nmaterial; k++)
    if (m->material[k]->adaptive)
      PetscCall(
        SbMaterialSetTangent(m->material[k], filter ? SB_TANGENT_EXACT_SPD : SB_TANGENT_EXACT));
  m->space->tentative = (PetscBool)(m->may_filter && !filter);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelSettle(SbModel m, PetscReal t, Vec U, PetscBool *changed)
{
  SbStage stage = {.t = t, .shift_k = 1.};

  PetscFunctionBeginUser;
  if (changed)
    *changed = PETSC_FALSE;
  if (!m->nsettle)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (U)
    PetscCall(SbSpaceGetLocalRead(m->space, U, &stage.u));
  for (PetscInt e = 0; e < m->nsettle; e++) {
    PetscBool here = PETSC_FALSE;

    SbEffectCall(m->settle[e], settle, m->space, U ? &stage : NULL, &here);
    if (changed)
      *changed = (PetscBool)(*changed || here);
  }
  if (U)
    PetscCall(SbSpaceRestoreLocalRead(m->space, U, &stage.u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelPrescribe(SbModel m, PetscReal t, Vec U)
{
  SbSpace s = m->space;
  PetscScalar *u;

  PetscFunctionBeginUser;
  if (!m->nprescribe && !s->constraints)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt e = 0; e < m->nprescribe; e++)
    if (m->prescribe[e]->steady)
      SbEffectCall(m->prescribe[e], prescribe, s, t);
  for (PetscInt k = 0; k < 3 * s->nfixed; k++)
    s->fixed_value[k] *= m->load;
  for (PetscInt k = 0; s->vertex_value && k < 3 * s->mesh->nvert; k++)
    s->vertex_value[k] *= s->vertex_value[k] != 0. ? m->load : 1.; /* 0 of no support, load inf */
  for (PetscInt e = 0; e < m->nprescribe; e++)
    if (!m->prescribe[e]->steady)
      SbEffectCall(m->prescribe[e], prescribe, s, t);
  PetscCall(SbSupportsWarn(s, m->nprescribe, m->prescribe, t));
  PetscCall(VecGetArray(U, &u));
  SbSpaceSetPrescribed(s, u);
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbModelInitialState(SbModel m, Vec U, Vec V)
{
  SbSpace s = m->space;
  PetscReal(*centre)[4];
  PetscScalar *u, *v;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(U));
  PetscCall(VecGetArray(U, &v));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const SbStart *start = &m->start[s->node_body[i]];

    for (int k = 0; start->moved && k < 3; k++)
      PetscCall(SbFormulaEval(start->displacement[k], 0., s->node_x + 3 * i, &v[3 * i + k]));
  }
  PetscCall(VecRestoreArray(U, &v));
  PetscCall(SbModelPrescribe(m, 0., U));
  if (!V) {
    PetscCall(VecGetArray(U, &v));
    PetscCall(SbSpaceRigidStart(s, v, NULL));
    PetscCall(VecRestoreArray(U, &v));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscMalloc1(m->nbody, &centre));
  PetscCall(SbModelCentres(m, NULL, centre));
  PetscCall(VecGetArray(V, &v));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const SbBody *body = &m->body[s->node_body[i]];
    const SbStart *start = &m->start[s->node_body[i]];
    PetscReal r[3], spin[3];

    SbSubtract(s->node_x + 3 * i, centre[s->node_body[i]], r);
    SbCross(body->angular_velocity, r, spin);
    for (PetscInt k = 0; k < 3; k++) {
      PetscReal more = 0.;

      if (start->velocity[k])
        PetscCall(SbFormulaEval(start->velocity[k], 0., s->node_x + 3 * i, &more));
      v[3 * i + k] = body->velocity[k] + spin[k] + more;
      if (s->fixed[i] & (1 << k))
        v[3 * i + k] = 0.;
    }
  }
  PetscCall(VecGetArray(U, &u));
  PetscCall(SbSpaceRigidStart(s, u, v));
  PetscCall(VecRestoreArray(U, &u));
  PetscCall(VecRestoreArray(V, &v));
  PetscCall(PetscFree(centre));
  PetscFunctionReturn(PETSC_SUCCESS);
}
