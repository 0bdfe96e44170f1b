/*
  barrier_output.c - output of the response `barrier`: forces, contact points, gaps, history, summary.
*/
#include "barrier_impl.h"

PetscErrorCode SbEffectContactForce_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[])
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  (void)SbBarrierGradient(b, -1., f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* values += force, N, and torque, N m, of the obstacle on the bodies, from the gradient of an energy with respect to n vertices. */
static void add_force(const Barrier *b, const SbPose *pose, PetscInt n, const PetscInt v[],
                      const PetscReal gradient[], PetscReal values[6])
{
  for (PetscInt k = 0; k < n; k++) {
    PetscReal arm[3], moment[3];

    if (v[k] >= b->mesh->nbody_vertex) continue;
    for (int j = 0; j < 3; j++) arm[j] = b->x[3 * v[k] + j] - b->scene.centre[j] - pose->d[j];
    SbCross(arm, gradient + 3 * k, moment);
    for (int j = 0; j < 3; j++) {
      values[j] -= gradient[3 * k + j];
      values[3 + j] -= moment[j];
    }
  }
}

/* The bodies of a pair, and the force on the first one from the gradient of its energy, N. */
static void force_between(const Barrier *b, const SbContactPair *pair, const PetscReal gradient[12],
                          PetscInt body[2], PetscReal force[3])
{
  const int split = pair->kind == SB_PAIR_EDGE_EDGE ? 2 : 1;

  body[0] = b->mesh->part[pair->v[0]];
  body[1] = b->mesh->part[pair->v[2]];
  for (int j = 0; j < 3; j++) {
    force[j] = 0.;
    for (int k = 0; k < split; k++) force[j] -= gradient[3 * k + j];
  }
}

/* Largest current depth of the overlaps found at the start of the step, m. */
static PetscReal deepest_of(const Barrier *b)
{
  PetscReal deepest = 0.;

  for (PetscInt i = 0; i < b->nspring; i++)
    deepest =
      PetscMax(deepest, b->spring[i].depth + b->spring[i].start - SbBarrierSpringPlace(b, &b->spring[i]));
  return deepest;
}

PetscErrorCode SbEffectHistory_Barrier(SbEffect e, SbSpace s, const SbStage *stage, const PetscReal r[],
                                       PetscReal values[])
{
  Barrier *b = (Barrier *)e->data;
  PetscReal least = PETSC_MAX_REAL, gradient[12], push[15], energy, force[3], *v = values;
  PetscInt body[2];
  PetscMPIInt rank;
  SbPose pose;

  PetscFunctionBeginUser;
  (void)r;
  PetscCall(PetscArrayzero(values, e->ncolumn));
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  for (PetscInt i = 0; i < b->nactive; i++) least = PetscMin(least, b->active[i].gap);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_REAL, MPI_MIN, s->comm));
  if (least == PETSC_MAX_REAL) least = 0.;
  PetscCallMPI(MPI_Comm_rank(s->comm, &rank));

  /* an obstacle: force, torque, contacts, penetration, gap, energy, friction_loss, friction_lag, unguarded */
  if (b->scene.obstacle) {
    (*b->scene.pose)(b->data, stage->t, &pose);
    for (PetscInt i = 0; i < b->nactive; i++) {
      const SbContactPair *pair = &b->pairs->pair[b->active[i].pair];

      if (!counts(b, pair)) continue;
      (void)SbBarrierForce(b, &b->active[i], &energy, gradient);
      add_force(b, &pose, pair->side ? 1 : 4, pair->v, gradient, v);
      v[6]++;
      v[9] += energy;
    }
    for (PetscInt i = 0; i < b->nfriction; i++) {
      const SbContactPair *pair = &b->friction[i].pair;

      if (!counts(b, pair)) continue;
      (void)SbBarrierFriction(b, &b->friction[i], gradient);
      add_force(b, &pose, pair->side ? 1 : 4, pair->v, gradient, v);
    }
    for (PetscInt i = 0; i < b->nspring; i++) {
      const Spring *spring = &b->spring[i];

      if (!b->mesh->own[spring->v[0]]) continue;
      v[6] += SbBarrierSpring(b, spring, push) > 0.;
      add_force(b, &pose, spring->n, spring->v, push, v);
    }
    v[10] = b->friction_loss;
    if (!rank) {
      v[7] = deepest_of(b);
      v[8] = least;
      v[11] = b->lag;
      v[12] = b->overlapping ? (PetscReal)b->overlap.ncrossing : 0.;
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* bodies: contacts, penetration, its mean, normal force, friction force, work, friction_loss, gap, energy, friction_lag, unguarded, pairs */
  for (PetscInt i = 0; i < b->nactive; i++) {
    const SbContactPair *pair = &b->pairs->pair[b->active[i].pair];
    PetscReal normal;

    if (!counts(b, pair)) continue;
    normal = SbBarrierForce(b, &b->active[i], &energy, gradient);
    v[0]++;
    v[3] += normal;
    v[8] += energy;
    force_between(b, pair, gradient, body, force);
    SbPairsAdd(&b->columns, body[0], body[1], normal, force, values);
  }
  for (PetscInt i = 0; i < b->nfriction; i++) {
    if (!counts(b, &b->friction[i].pair)) continue;
    (void)SbBarrierFriction(b, &b->friction[i], gradient);
    force_between(b, &b->friction[i].pair, gradient, body, force);
    v[4] += PetscSqrtReal(SbDot3(force, force));
    SbPairsAdd(&b->columns, body[0], body[1], 0., force, values);
  }
  for (PetscInt i = 0; i < b->nspring; i++) {
    const Spring *spring = &b->spring[i];
    PetscReal normal;

    if (!b->mesh->own[spring->v[0]]) continue;
    normal = SbBarrierSpring(b, spring, push);
    body[0] = b->mesh->part[spring->v[0]];
    body[1] = b->mesh->part[spring->v[spring->n - 1]];
    for (int j = 0; j < 3; j++) force[j] = normal * spring->normal[j];
    v[0] += normal > 0.;
    v[3] += normal;
    SbPairsAdd(&b->columns, body[0], body[1], normal, force, values);
  }
  if (!rank) v[1] = deepest_of(b);
  v[5] = b->work;
  v[6] = b->friction_loss;
  if (!rank) {
    v[7] = least;
    v[9] = b->lag;
    v[10] = b->overlapping ? (PetscReal)b->overlap.ncrossing : 0.;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contact point of a pair: its closest point on the body, normal and gap. */
static SbContactPoint point_of(const Barrier *b, const SbContactPair *pair, const PetscReal weight[4],
                               const PetscReal n[3], PetscReal gap)
{
  const SbContactMesh m = b->mesh;
  const PetscInt nbody = m->space->mesh->nbody, first = m->part[pair->v[0]],
                 second = m->part[pair->v[pair->side ? 1 : 2]];
  const PetscBool turned = (PetscBool)(first == nbody);
  const int split = pair->kind == SB_PAIR_EDGE_EDGE && !pair->side ? 2 : 1;
  SbContactPoint p = {.gap = gap};

  for (int k = 0; k < 3; k++) p.id[k] = pair->v[k];
  p.body[0] = turned ? second : first;
  p.body[1] = turned || second == nbody ? -1 : second;
  for (int k = 0; k < 4; k++) {
    for (int j = 0; j < 3 && (turned ? k >= split : k < split); j++)
      p.x[j] += PetscAbsReal(weight[k]) * b->x[3 * pair->v[k] + j];
  }
  for (int j = 0; j < 3; j++) p.normal[j] = turned ? -n[j] : n[j];
  return p;
}

/* p.force -= the gradient of an energy with respect to the vertices of the point's side. */
static void push_point(const Barrier *b, const SbContactPair *pair, const PetscReal gradient[12],
                       SbContactPoint *p)
{
  const PetscBool turned = (PetscBool)(pair->v[0] >= b->mesh->nbody_vertex);
  const int split = pair->kind == SB_PAIR_EDGE_EDGE && !pair->side ? 2 : 1;

  for (int k = 0; k < (pair->side ? 1 : 4); k++) {
    for (int j = 0; j < 3 && (turned ? k >= split : k < split); j++) p->force[j] -= gradient[3 * k + j];
  }
}

PetscErrorCode SbEffectContactPoints_Barrier(SbEffect e, SbSpace s, const SbStage *stage,
                                             SbContactPoints *list)
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;
  PetscReal energy, gradient[12];
  PetscBool *told;

  PetscFunctionBeginUser;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  PetscCall(PetscCalloc1(b->nfriction, &told));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];
    SbContactPoint p;

    if (!counts(b, pair)) continue;
    p = point_of(b, pair, a->at.weight, a->at.n, a->gap);
    (void)SbBarrierForce(b, a, &energy, gradient);
    push_point(b, pair, gradient, &p);

    /* friction there */
    for (PetscInt k = 0; k < b->nfriction; k++) {
      const FrictionPair *friction = &b->friction[k];
      PetscBool same;

      PetscCall(PetscArraycmp(friction->pair.v, pair->v, 4, &same));
      if (!same || friction->pair.kind != pair->kind || friction->pair.side != pair->side) continue;
      (void)SbBarrierFriction(b, friction, gradient);
      push_point(b, pair, gradient, &p);
      told[k] = PETSC_TRUE;
      break;
    }
    PetscCall(SbContactPointsAdd(list, &p));
  }

  /* friction of pairs in contact only at the start of the step */
  for (PetscInt k = 0; k < b->nfriction; k++) {
    const FrictionPair *friction = &b->friction[k];
    SbContactPoint p;
    SbDistance d;

    if (told[k] || !counts(b, &friction->pair)) continue;
    p = point_of(b, &friction->pair, friction->weight, friction->n,
                 SbContactPairGap(m, &friction->pair, b->x, &d));
    (void)SbBarrierFriction(b, friction, gradient);
    push_point(b, &friction->pair, gradient, &p);
    PetscCall(SbContactPointsAdd(list, &p));
  }
  PetscCall(PetscFree(told));

  /* springs that separate overlaps */
  for (PetscInt i = 0; i < b->nspring; i++) {
    const Spring *spring = &b->spring[i];
    const PetscInt first = m->part[spring->v[0]], second = m->part[spring->v[spring->n - 1]];
    SbContactPoint p = {.id = {-1 - i, spring->v[0], spring->v[spring->n - 1]}};
    PetscReal push[15], force, sum = 0.;

    if (!m->own[spring->v[0]]) continue;
    force = SbBarrierSpring(b, spring, push);
    p.body[0] = first;
    p.body[1] = second == s->mesh->nbody ? -1 : second;
    p.gap = SbBarrierSpringPlace(b, spring);
    if (i < b->nspring - b->nbounce) p.gap -= spring->start + spring->depth;
    for (PetscInt k = 0; k < spring->n && spring->weight[k] > 0.; k++) {
      sum += spring->weight[k];
      for (int j = 0; j < 3; j++) p.x[j] += spring->weight[k] * b->x[3 * spring->v[k] + j];
    }
    for (int j = 0; j < 3; j++) {
      p.x[j] /= sum;
      p.normal[j] = spring->normal[j];
      p.force[j] = force * spring->normal[j];
    }
    PetscCall(SbContactPointsAdd(list, &p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectGap_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal gap[],
                                   PetscReal normal[])
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;

  PetscFunctionBeginUser;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  for (PetscInt i = 0; i < b->nactive; i++) {
    const Active *a = &b->active[i];
    const SbContactPair *pair = &b->pairs->pair[a->pair];

    for (int k = 0; k < (pair->side ? 1 : 4); k++) {
      const PetscInt v = pair->v[k];

      if (v >= m->nbody_vertex || a->at.weight[k] == 0.) continue;
      for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
        const PetscInt node = m->node[j];

        if (node < 0 || node >= s->nnode_owned || a->gap >= gap[node]) continue;
        gap[node] = a->gap;
        for (int i3 = 0; i3 < 3; i3++)
          normal[3 * node + i3] = (a->at.weight[k] > 0. ? 1. : -1.) * a->at.n[i3];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectSummary_Barrier(SbEffect e, SbSpace s, size_t size, char text[])
{
  Barrier *b = (Barrier *)e->data;
  PetscReal value[2] = {b->least, b->shortest};
  PetscInt most = b->most;
  char note[96] = "";

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 2, MPIU_REAL, MPI_MIN, s->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_INT, MPI_MAX, s->comm));
  if (b->scene.friction > 0.)
    (void)snprintf(note, sizeof(note), ", friction lagged behind normal forces by at most %.2g of itself",
                   (double)b->most_lag);
  if (most)
    (void)snprintf(text, size,
                   "%" PetscInt_FMT " pairs at most on a rank, smallest gap %.3g m of a width of %.3g m, "
                   "shortest safe part of an iteration %.2g%s",
                   most, (double)value[0], (double)b->w[0], (double)value[1], note);
  else
    (void)snprintf(text, size, "nothing came nearer than %.3g m", (double)b->w[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectNearest_Barrier(SbEffect e, SbSpace s, PetscReal *gap, size_t size, char text[])
{
  const Barrier *b = (const Barrier *)e->data;
  const PetscReal *x = b->x;
  const Active *least = NULL;
  struct {
    double gap;
    int rank;
  } mine, first;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(s->comm, &rank));
  for (PetscInt i = 0; i < b->nactive; i++) {
    if (!least || b->active[i].gap < least->gap) least = &b->active[i];
  }
  mine.gap = least ? (double)least->gap : PETSC_MAX_REAL;
  mine.rank = rank;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_DOUBLE_INT, MPI_MINLOC, s->comm));
  *gap = first.gap;
  text[0] = 0;
  if (first.gap == PETSC_MAX_REAL) PetscFunctionReturn(PETSC_SUCCESS);
  if (rank == first.rank) {
    const SbContactPair *pair = &b->pairs->pair[least->pair];
    const PetscInt part[2] = {b->mesh->part[pair->v[0]], b->mesh->part[pair->v[pair->side ? 1 : 2]]};
    const char *name[2];

    for (int k = 0; k < 2; k++)
      name[k] = part[k] < s->mesh->nbody ? s->mesh->body[part[k]].name : "the obstacle";
    PetscCall(PetscSNPrintf(text, size, "effect %s: %s and %s are %.2g m apart at (%.4g, %.4g, %.4g) m",
                            e->name, name[0], name[1], first.gap, (double)x[3 * pair->v[0]],
                            (double)x[3 * pair->v[0] + 1], (double)x[3 * pair->v[0] + 2]));
  }
  PetscCallMPI(MPI_Bcast(text, (PetscMPIInt)size, MPI_CHAR, first.rank, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
