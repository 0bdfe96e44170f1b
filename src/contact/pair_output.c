/*
  pair_output.c - output of contact of surfaces: history columns, contact points, gaps at nodes, the
  closest pair and the summary.
*/
#include "surfaces.h"

#define PAIRS 200 /* most pairs of bodies with columns */
#define TWO 4     /* columns of two bodies */
#define ONE 2     /* and of one with itself, whose net force is zero */

/* The bodies that take part; with -effect_X_pairs columns for each pair of them behind those of
   e. */
PetscErrorCode SbSurfacesFindBodies(SbEffect e, SbMesh mesh)
{
  static const char *const two_names[TWO] = {"force_x", "force_y", "force_z", "contacts"};
  static const char *const one_names[ONE] = {"normal_force", "contacts"};
  Surfaces *p = (Surfaces *)e->data;
  const PetscBool self = p->options.self;
  const PetscInt fixed = e->ncolumn;
  PetscInt n = fixed;
  PetscInt64 npair;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(mesh->nbody, &p->columns.slot));
  for (PetscInt i = 0; i < mesh->nbody; i++)
    p->columns.slot[i] = -1;
  for (PetscInt v = 0; v < p->surface->nbody_vertex; v++)
    p->columns.slot[p->surface->part[v]] = 0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, p->columns.slot, (PetscMPIInt)mesh->nbody, MPIU_INT,
                             MPI_MAX, mesh->comm));
  for (PetscInt i = 0; i < mesh->nbody; i++)
    if (p->columns.slot[i] == 0)
      p->columns.slot[i] = p->columns.nsurface++;
  PetscCheck(
    p->columns.nsurface > 1 || self, mesh->comm, PETSC_ERR_USER_INPUT,
    "The effect %s has only one body to examine: give -effect_%s_self yes for a body that may meet "
    "itself, more sets with -effect_%s_on, or -effect_%s_obstacle",
    e->name, e->name, e->name, e->name);
  if (!p->options.pairs)
    PetscFunctionReturn(PETSC_SUCCESS);
  npair = (PetscInt64)p->columns.nsurface * (p->columns.nsurface - 1) / 2 +
          (self ? p->columns.nsurface : 0);
  PetscCheck(
    npair <= PAIRS, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_pairs yes: the %" PetscInt_FMT " bodies of -effect_%s_on make %" PetscInt64_FMT
    " pairs, more than the %d that history.csv may have columns for: name fewer sets, or use "
    "-output_contacts yes",
    e->name, p->columns.nsurface, e->name, npair, PAIRS);
  PetscCall(PetscMalloc3(n + TWO * (PetscInt)npair, &p->columns.column, TWO * npair,
                         &p->columns.text, p->columns.nsurface * p->columns.nsurface,
                         &p->columns.place));
  PetscCall(PetscArraycpy(p->columns.column, e->column, n));
  for (PetscInt a = 0; a < mesh->nbody; a++) {
    for (PetscInt b = a; b < mesh->nbody; b++) {
      if (p->columns.slot[a] < 0 || p->columns.slot[b] < 0 || (a == b && !self))
        continue;
      p->columns.place[p->columns.nsurface * p->columns.slot[a] + p->columns.slot[b]] = n;
      for (int k = 0; k < (a == b ? ONE : TWO); k++, n++) {
        char *name = p->columns.text[n - fixed];

        SbFormat(sizeof(p->columns.text[0]), name, "%s_%s_%s", mesh->body[a].name,
                 mesh->body[b].name, (a == b ? one_names : two_names)[k]);
        for (PetscInt i = 0; i < n; i++)
          PetscCheck(strcmp(name, p->columns.column[i]), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
                     "-effect_%s_pairs yes: history.csv would have two columns %s_%s: give a body "
                     "another name",
                     e->name, e->name, name);
        p->columns.column[n] = name;
      }
    }
  }
  e->column = p->columns.column;
  e->ncolumn = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force and torque of an obstacle, or forces between bodies; energy of the barrier; work and loss
   so far. */
PetscErrorCode SbEffectHistory_Surfaces(SbEffect e, SbSpace s, const SbStage *stage,
                                        const PetscReal r[], PetscReal values[])
{
  /* of bodies, and of an obstacle */
  enum {
    CONTACTS,
    PENETRATION,
    GAP,
    ENERGY,
    LOSS,
    LAG,
    UNGUARDED
  };
  static const int places[2][7] = {{0, 1, 7, 8, 6, 9, 10}, {6, 7, 8, 9, 10, 11, 12}};
  Surfaces *b = (Surfaces *)e->data;
  const int *at = places[b->contact.partner.obstacle != NULL];
  PetscReal least[2] = {PETSC_MAX_REAL, 0.}; /* gap, minus depth */
  SbPose pose;

  PetscFunctionBeginUser;
  (void)r;
  PetscCall(PetscArrayzero(values, e->ncolumn));
  if (!b->contact.partner.obstacle)
    values[5] = b->sums.work + b->contact.base.given;
  if (!b->motion.begun)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSurfacesUpdate(b, stage->u));
  for (PetscInt i = 0; i < b->active.n; i++)
    least[0] = PetscMin(least[0], b->active.pair[i].gap);
  for (PetscInt i = 0; i < b->springs.n; i++) /* of the overlaps found at the start of the step */
    least[1] = PetscMin(least[1], SbSpringPlace(b, &b->springs.spring[i]) -
                                    b->springs.spring[i].at.depth - b->springs.spring[i].start);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, least, 2, MPIU_REAL, MPI_MIN, s->comm));
  if (b->contact.partner.obstacle)
    PetscCall(SbPartnerPose(&b->contact.partner, stage->t, &pose));
  for (PetscInt i = 0; i < nterm(b); i++) {
    PetscReal force[3] = {0.};
    PetscReal *columns;
    PetscInt one, two;
    Term t;

    SbPairTerm(b, i, &t);
    if (!t.counts)
      continue;
    values[at[CONTACTS]] += (i < b->active.n && is_barrier(b)) || t.force > 0.;
    if (i < b->active.n && !has_multipliers(b))
      values[at[ENERGY]] += t.energy;

    /* force and torque of the obstacle on the bodies */
    for (PetscInt k = 0; b->contact.partner.obstacle && k < t.n; k++) {
      const PetscReal *g = t.gradient + 3 * k;

      if (t.v[k] < b->surface->nbody_vertex)
        SbPartnerAddForce(&b->contact.partner, &pose, b->motion.x + 3 * t.v[k],
                          (const PetscReal[3]){-g[0], -g[1], -g[2]}, values);
    }
    if (b->contact.partner.obstacle)
      continue;

    /* forces between two bodies, or of one on itself, and their columns */
    for (int k = 0; k < 3 * t.nfirst; k++)
      force[k % 3] -= t.gradient[k];
    values[3] += t.force;
    if (i >= b->active.n && i < b->active.n + b->friction.pairs.n)
      values[4] += PetscSqrtReal(SbDot3(force, force));
    if (!b->columns.column)
      continue;
    one = b->surface->part[t.v[0]];
    two = b->surface->part[t.v[t.n - 1]];
    columns = values + b->columns.place[b->columns.nsurface * b->columns.slot[PetscMin(one, two)] +
                                        b->columns.slot[PetscMax(one, two)]];
    columns[one == two ? 1 : 3] += t.force > 0.;
    if (one == two)
      columns[0] += t.force;
    for (int k = 0; k < 3 && one != two; k++)
      columns[k] += one > two ? force[k] : -force[k];
  }
  values[at[LOSS]] = b->friction.loss;
  if (s->rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  values[at[GAP]] = least[0] == PETSC_MAX_REAL ? 0. : least[0];
  values[at[PENETRATION]] = 0. - least[1]; /* not -0 */
  values[at[LAG]] = b->friction.lag;
  values[at[UNGUARDED]] =
    b->separation.overlapping ? (PetscReal)b->separation.overlap.ncrossing : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The contact point of a term: its place on the body, the force there; the gap is left to the
   caller. */
static SbContactPoint point_of(const Surfaces *b, const Term *t)
{
  const PetscInt *part = b->surface->part;
  const PetscInt nbody = b->surface->space->mesh->nbody;
  const PetscInt first = part[t->v[0]];
  const PetscInt second = part[t->v[t->nfirst]];
  const PetscBool turned = (PetscBool)(first == nbody);
  SbContactPoint p = {
    .id = {SbContactNumber(b->surface, t->v[0]), SbContactNumber(b->surface, t->v[1]),
           t->n > 2 ? SbContactNumber(b->surface, t->v[2]) : 0},
    .body = {turned ? second : first, turned || second == nbody ? -1 : second},
  };
  PetscReal sum = 0.;

  for (PetscInt k = turned ? t->nfirst : 0; k < (turned ? t->n : t->nfirst); k++) {
    sum += PetscAbsReal(t->weight[k]);
    for (int j = 0; j < 3; j++) {
      p.x[j] += PetscAbsReal(t->weight[k]) * b->motion.x[3 * t->v[k] + j];
      p.force[j] -= t->gradient[3 * k + j];
    }
  }
  for (int j = 0; j < 3; j++) {
    p.x[j] /= sum;
    p.normal[j] = turned ? -t->normal[j] : t->normal[j];
  }
  return p;
}

PetscErrorCode SbContactPoints_Surfaces(SbContact contact, SbSpace s, const SbStage *stage,
                                        SbContactPoints *list)
{
  Surfaces *b = (Surfaces *)contact;
  PetscBool *told;

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbSurfacesUpdate(b, stage->u));
  PetscCall(PetscCalloc1(nterm(b), &told));
  for (PetscInt i = 0; i < nterm(b); i++) {
    const PetscInt spring = i - b->active.n - b->friction.pairs.n;
    SbContactPoint p, other;
    SbDistance d;
    Term t;

    SbPairTerm(b, i, &t);
    if (told[i] || !t.counts)
      continue;
    p = point_of(b, &t);
    if (spring >= 0) { /* separates an overlap, or rebounds */
      p.id[0] = -1 - b->springs.spring[spring].at.number;
      p.id[1] = SbContactNumber(b->surface, t.v[0]);
      p.id[2] = SbContactNumber(b->surface, t.v[t.n - 1]);
      p.gap = SbSpringPlace(b, &b->springs.spring[spring]);
      if (spring < b->springs.n - b->springs.nbounce)
        p.gap -= b->springs.spring[spring].start + b->springs.spring[spring].at.depth;
    } else if (i >= b->active.n) /* friction of a pair in contact only at the start of the step */
      p.gap = SbContactPairGap(b->surface, &b->friction.pairs.pair[i - b->active.n].on.pair,
                               b->motion.x, &d);
    else
      p.gap = b->active.pair[i].gap;

    /* friction there */
    for (PetscInt k = b->active.n; i < b->active.n && k < b->active.n + b->friction.pairs.n; k++) {
      const SbContactPair *pair = &b->active.pair[i].pair;
      const SbContactPair *with = &b->friction.pairs.pair[k - b->active.n].on.pair;

      if (memcmp(pair, with, offsetof(SbContactPair, area)))
        continue; /* not the same features */
      SbPairTerm(b, k, &t);
      other = point_of(b, &t);
      for (int j = 0; j < 3; j++)
        p.force[j] += other.force[j];
      told[k] = PETSC_TRUE;
      break;
    }
    PetscCall(SbReserve(list->n + 1, sizeof(p), &list->size, &list->point));
    list->point[list->n++] = p;
  }
  PetscCall(PetscFree(told));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactGap_Surfaces(SbContact contact, SbSpace s, const SbStage *stage,
                                     PetscReal gap[], PetscReal normal[])
{
  Surfaces *b = (Surfaces *)contact;
  const SbContactSurface m = b->surface;

  PetscFunctionBeginUser;
  PetscCall(SbSurfacesUpdate(b, stage->u));
  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    const PetscInt *vertex = a->pair.v;

    for (int k = 0; k < 4; k++) {
      const PetscInt v = vertex[k];

      if (v >= m->nbody_vertex || a->at.weight[k] == 0.)
        continue;
      for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
        const PetscInt node = m->node[j];

        if (node < 0 || node >= s->nnode_owned || a->gap >= gap[node])
          continue;
        gap[node] = a->gap;
        for (int i3 = 0; i3 < 3; i3++)
          normal[3 * node + i3] = (a->at.weight[k] > 0. ? 1. : -1.) * a->at.n[i3];
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectSummary_Surfaces(SbEffect e, SbSpace s, size_t size, char text[])
{
  Surfaces *b = (Surfaces *)e->data;
  PetscReal value[3] = {b->record.least, b->record.shortest, -(PetscReal)b->record.most};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value, 3, MPIU_REAL, MPI_MIN, s->comm));
  SbFormat(size, text, "nothing came nearer than %.3g m", (double)b->widths.w[0]);
  if (value[2] == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbFormat(size, text,
           "%.0f pairs at most on a rank, smallest gap %.3g m of a width of %.3g m, shortest safe "
           "part of an "
           "iteration %.2g",
           -(double)value[2], (double)value[0], (double)b->widths.w[0], (double)value[1]);
  if (b->contact.friction.mu > 0.)
    SbAppend(size, text, ", friction lagged behind normal forces by at most %.2g of itself",
             (double)b->friction.most);
  if (b->fall_back.n)
    SbAppend(size, text, ", %" PetscInt_FMT " steps with the response barrier", b->fall_back.n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactWarnAtEnd_Surfaces(SbContact contact, SbSpace s)
{
  const Surfaces *b = (const Surfaces *)contact;
  const SbEffect e = contact->effect;

  PetscFunctionBeginUser;
  PetscCheck(e->dynamic || !b->separation.overlapping, s->comm, PETSC_ERR_USER_INPUT,
             "The effect %s: surfaces that were in each other when the run began still are, at "
             "(%g, %g, %g) m and elsewhere, by %" PetscInt_FMT
             " intersections: what pushes them there are springs, not contact. Move the bodies "
             "apart in the meshes, or by -body_NAME_translate, or give more -static_steps",
             e->name, (double)b->separation.overlap.place[0],
             (double)b->separation.overlap.place[1], (double)b->separation.overlap.place[2],
             b->separation.overlap.ncrossing);
  if (b->separation.overlapping)
    PetscCall(SbWarning(
      s->comm,
      "effect %s: surfaces that were in each other when the run began still are at the end, by "
      "%" PetscInt_FMT
      " intersections: what pushes them there are springs, not contact. Let the run go on, give "
      "more -static_steps or a smaller -effect_%s_separation_steps, or move the bodies apart "
      "in the meshes",
      e->name, b->separation.overlap.ncrossing, e->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactNearest_Surfaces(SbContact contact, SbSpace s, PetscReal *gap, size_t size,
                                         char text[])
{
  const Surfaces *b = (const Surfaces *)contact;
  const SbEffect e = contact->effect;
  const PetscReal *x = b->motion.x;
  const Active *least = NULL;
  PetscBool held = PETSC_FALSE;
  struct {
    double gap;
    int rank;
  } mine, first;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < b->active.n; i++)
    if (!least || b->active.pair[i].gap < least->gap)
      least = &b->active.pair[i];
  mine.gap = least ? (double)least->gap : PETSC_MAX_REAL;
  mine.rank = s->rank;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_DOUBLE_INT, MPI_MINLOC, s->comm));
  if (first.gap >= *gap)
    PetscFunctionReturn(PETSC_SUCCESS);
  *gap = first.gap;
  if (s->rank == first.rank) {
    const SbContactPair *pair = &least->pair;
    const PetscInt part[2] = {b->surface->part[pair->v[0]],
                              b->surface->part[pair->v[SbContactPairSplit(pair)]]};
    const char *name[2];

    for (int k = 0; k < 2; k++)
      name[k] = part[k] < s->mesh->nbody ? s->mesh->body[part[k]].name : "the obstacle";
    for (int k = 0; k < 4 && !pair->side; k++)
      held = (PetscBool)(held || (b->surface->part[pair->v[k]] < s->mesh->nbody &&
                                  b->surface->driven[pair->v[k]]));
    SbFormat(size, text, "effect %s: %s and %s are %.2g m apart at (%.4g, %.4g, %.4g) m%s", e->name,
             name[0], name[1], first.gap, (double)x[3 * pair->v[0]], (double)x[3 * pair->v[0] + 1],
             (double)x[3 * pair->v[0] + 2],
             held ? ", beside nodes that a support holds, which cannot give way" : "");
  }
  PetscCallMPI(MPI_Bcast(text, (PetscMPIInt)size, MPI_CHAR, first.rank, s->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
