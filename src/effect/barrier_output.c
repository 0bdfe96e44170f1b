/*
  barrier_output.c - output of the response `barrier`: forces, contact points, gaps, history, summary.
*/
#include "barrier_impl.h"

#define PAIRS 200 /* most pairs of bodies with columns */

/* Columns for each pair of bodies. */
static const char *const apart_names[] = {"force_x", "force_y", "force_z", "contacts"};
static const char *const self_names[] = {"normal_force", "contacts"};
#define APART 4 /* columns of two bodies */
#define SELF 2  /* and of one with itself, whose net force is zero */

PetscErrorCode SbPairsSetUp(SbEffect e, SbMesh mesh, PetscBool self, SbPairs *p)
{
  const PetscInt fixed = e->ncolumn;
  const PetscInt64 npair = (PetscInt64)p->nsurface * (p->nsurface - 1) / 2 + (self ? p->nsurface : 0);
  PetscInt n = fixed;

  PetscFunctionBeginUser;
  PetscCheck(npair <= PAIRS, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_pairs yes: the %" PetscInt_FMT " bodies of -effect_%s_on make %" PetscInt64_FMT
             " pairs, more than the %d that history.csv may have columns for: name fewer sets, or use "
             "-output_contacts yes",
             e->name, p->nsurface, e->name, npair, PAIRS);
  PetscCall(PetscMalloc3(n + APART * (PetscInt)npair, &p->column, APART * npair, &p->text,
                         p->nsurface * p->nsurface, &p->place));
  PetscCall(PetscArraycpy(p->column, e->column, n));
  for (PetscInt a = 0; a < mesh->nbody; a++) {
    for (PetscInt b = a; b < mesh->nbody; b++) {
      if (p->slot[a] < 0 || p->slot[b] < 0 || (a == b && !self)) continue;
      p->place[p->nsurface * p->slot[a] + p->slot[b]] = n;
      for (int k = 0; k < (a == b ? SELF : APART); k++, n++) {
        char *name = p->text[n - fixed];

        SbFormat(sizeof(p->text[0]), name, "%s_%s_%s", mesh->body[a].name, mesh->body[b].name,
                 (a == b ? self_names : apart_names)[k]);
        for (PetscInt i = 0; i < n; i++)
          PetscCheck(
            strcmp(name, p->column[i]), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
            "-effect_%s_pairs yes: history.csv would have two columns %s_%s: give a body another name",
            e->name, e->name, name);
        p->column[n] = name;
      }
    }
  }
  e->column = p->column;
  e->ncolumn = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force and torque of an obstacle, or forces between bodies; energy of the barrier; work and loss so far. */
PetscErrorCode SbEffectHistory_Barrier(SbEffect e, SbSpace s, const SbStage *stage, const PetscReal r[],
                                       PetscReal values[])
{
  /* of bodies, and of an obstacle */
  enum { CONTACTS, PENETRATION, GAP, ENERGY, LOSS, LAG, UNGUARDED };
  static const int places[2][7] = {{0, 1, 7, 8, 6, 9, 10}, {6, 7, 8, 9, 10, 11, 12}};
  Barrier *b = (Barrier *)e->data;
  const SbPairs *p = &b->columns;
  const int *at = places[b->contact->obstacle != NULL];
  PetscReal least = PETSC_MAX_REAL;
  SbPose pose;

  PetscFunctionBeginUser;
  (void)r;
  PetscCall(PetscArrayzero(values, e->ncolumn));
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  for (PetscInt i = 0; i < b->nactive; i++) least = PetscMin(least, b->active[i].gap);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_REAL, MPI_MIN, s->comm));
  if (b->contact->obstacle) SbContactPose(b->contact, stage->t, &pose);
  for (PetscInt i = 0; i < nterm(b); i++) {
    PetscReal force[3] = {0.}, *columns;
    PetscInt one, two;
    Term t;

    SbBarrierTerm(b, i, &t);
    if (!t.counts) continue;
    values[at[CONTACTS]] += i < b->nactive || t.force > 0.;
    if (i < b->nactive) values[at[ENERGY]] += t.energy;

    /* force and torque of the obstacle on the bodies */
    for (PetscInt k = 0; b->contact->obstacle && k < t.n; k++) {
      PetscReal arm[3], moment[3];

      if (t.v[k] >= b->mesh->nbody_vertex) continue;
      for (int j = 0; j < 3; j++) arm[j] = b->x[3 * t.v[k] + j] - b->contact->path.point[j] - pose.d[j];
      SbCross(arm, t.gradient + 3 * k, moment);
      for (int j = 0; j < 3; j++) {
        values[j] -= t.gradient[3 * k + j];
        values[3 + j] -= moment[j];
      }
    }
    if (b->contact->obstacle) continue;

    /* forces between two bodies, or of one on itself, and their columns */
    for (int k = 0; k < 3 * t.nfirst; k++) force[k % 3] -= t.gradient[k];
    values[3] += t.force;
    if (i >= b->nactive && i < b->nactive + b->friction.n) values[4] += PetscSqrtReal(SbDot3(force, force));
    if (!p->column) continue;
    one = b->mesh->part[t.v[0]];
    two = b->mesh->part[t.v[t.n - 1]];
    columns = values + p->place[p->nsurface * p->slot[PetscMin(one, two)] + p->slot[PetscMax(one, two)]];
    columns[one == two ? 1 : 3] += t.force > 0.;
    if (one == two) columns[0] += t.force;
    for (int k = 0; k < 3 && one != two; k++) columns[k] += one > two ? force[k] : -force[k];
  }
  if (!b->contact->obstacle) values[5] = b->work;
  values[at[LOSS]] = b->friction_loss;
  if (s->rank) PetscFunctionReturn(PETSC_SUCCESS);
  values[at[GAP]] = least == PETSC_MAX_REAL ? 0. : least;
  values[at[LAG]] = b->lag;
  values[at[UNGUARDED]] = b->overlapping ? (PetscReal)b->overlap.ncrossing : 0.;
  for (PetscInt i = 0; i < b->nspring; i++) /* of the overlaps found at the start of the step */
    values[at[PENETRATION]] = PetscMax(values[at[PENETRATION]], b->spring[i].at.depth + b->spring[i].start -
                                                                  SbBarrierSpringPlace(b, &b->spring[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contact point of a term: its place on the body, the force there; the gap is left to the caller. */
static SbContactPoint point_of(const Barrier *b, const Term *t)
{
  const PetscInt *part = b->mesh->part, nbody = b->mesh->space->mesh->nbody, first = part[t->v[0]],
                 second = part[t->v[t->nfirst]];
  const PetscBool turned = (PetscBool)(first == nbody);
  SbContactPoint p = {
    .id = {t->v[0], t->v[1], t->v[2]},
    .body = {turned ? second : first, turned || second == nbody ? -1 : second},
  };
  PetscReal sum = 0.;

  for (PetscInt k = turned ? t->nfirst : 0; k < (turned ? t->n : t->nfirst); k++) {
    sum += PetscAbsReal(t->weight[k]);
    for (int j = 0; j < 3; j++) {
      p.x[j] += PetscAbsReal(t->weight[k]) * b->x[3 * t->v[k] + j];
      p.force[j] -= t->gradient[3 * k + j];
    }
  }
  for (int j = 0; j < 3; j++) {
    p.x[j] /= sum;
    p.normal[j] = turned ? -t->normal[j] : t->normal[j];
  }
  return p;
}

PetscErrorCode SbEffectContactPoints_Barrier(SbEffect e, SbSpace s, const SbStage *stage,
                                             SbContactPoints *list)
{
  Barrier *b = (Barrier *)e->data;
  PetscBool *told;

  PetscFunctionBeginUser;
  (void)s;
  if (!b->begun) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBarrierUpdate(b, stage->u));
  PetscCall(PetscCalloc1(nterm(b), &told));
  for (PetscInt i = 0; i < nterm(b); i++) {
    const PetscInt spring = i - b->nactive - b->friction.n;
    SbContactPoint p, other;
    SbDistance d;
    Term t;

    SbBarrierTerm(b, i, &t);
    if (told[i] || !t.counts) continue;
    p = point_of(b, &t);
    if (spring >= 0) { /* separates an overlap, or rebounds */
      p.id[0] = -1 - spring;
      p.id[1] = t.v[0];
      p.id[2] = t.v[t.n - 1];
      p.gap = SbBarrierSpringPlace(b, &b->spring[spring]);
      if (spring < b->nspring - b->nbounce) p.gap -= b->spring[spring].start + b->spring[spring].at.depth;
    } else if (i >= b->nactive) /* friction of a pair in contact only at the start of the step */
      p.gap = SbContactPairGap(b->mesh, &b->friction.pair[i - b->nactive].pair, b->x, &d);
    else
      p.gap = b->active[i].gap;

    /* friction there */
    for (PetscInt k = b->nactive; i < b->nactive && k < b->nactive + b->friction.n; k++) {
      const SbContactPair *pair = &b->pairs->pair[b->active[i].pair],
                          *with = &b->friction.pair[k - b->nactive].pair;
      PetscBool same;

      PetscCall(PetscArraycmp(pair->v, with->v, 4, &same));
      if (!same || pair->kind != with->kind || pair->side != with->side) continue;
      SbBarrierTerm(b, k, &t);
      other = point_of(b, &t);
      for (int j = 0; j < 3; j++) p.force[j] += other.force[j];
      told[k] = PETSC_TRUE;
      break;
    }
    PetscCall(SbReserve(list->n + 1, sizeof(p), &list->size, &list->point));
    list->point[list->n++] = p;
  }
  PetscCall(PetscFree(told));
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
    const PetscInt *vertex = b->pairs->pair[a->pair].v;

    for (int k = 0; k < 4; k++) {
      const PetscInt v = vertex[k];

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
  if (b->contact->friction.mu > 0.)
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

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < b->nactive; i++)
    if (!least || b->active[i].gap < least->gap) least = &b->active[i];
  mine.gap = least ? (double)least->gap : PETSC_MAX_REAL;
  mine.rank = s->rank;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_DOUBLE_INT, MPI_MINLOC, s->comm));
  if (first.gap >= *gap) PetscFunctionReturn(PETSC_SUCCESS);
  *gap = first.gap;
  if (s->rank == first.rank) {
    const SbContactPair *pair = &b->pairs->pair[least->pair];
    const PetscInt part[2] = {b->mesh->part[pair->v[0]], b->mesh->part[pair->v[SbContactPairSplit(pair)]]};
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
