/*
  collision_state.c - what pairs take from step to step, for checkpoints.

  A record is a pair by the identities of its point and the other body, or of its two edges: whether it touches and did so, the overlap that
  it may keep, multiplier, normal, and its friction. Nodes and weights are found again where the bodies are. One more record per rank has
  the sums that are reported, and one per point that is inside without a pair for how long it has been.
*/
#include "collision.h"

enum { POINT, EDGES, SUMS, ALONE }; /* what a record is */

static void write_record(const Collision *c, const Hit *hit, PetscReal r[])
{
  const SbDetectScene *s = &c->surface->scene;
  const PetscBool edges = SbCollisionOfEdges(c, hit);

  r[0] = edges ? EDGES : POINT;
  r[1] = (PetscReal)(edges ? s->edges->id[hit->point - s->npoint] : s->point_id[hit->point]);
  r[2] = (PetscReal)hit->part;
  r[3] = hit->on;
  r[4] = hit->was;
  r[5] = hit->allowed;
  r[6] = hit->lambda;
  r[7] = hit->gap;
  r[8] = hit->value;
  for (int k = 0; k < 3; k++) r[9 + k] = hit->normal[k];
  SbFrictionSave(&hit->grip, r + 12);
}

static Hit read_record(const PetscReal r[], PetscInt point)
{
  Hit hit = {.point = point,
             .part = (PetscInt)r[2],
             .on = (PetscBool)(r[4] != 0), /* what is on and was not has rebounded, and is free */
             .was = (PetscBool)(r[4] != 0),
             .allowed = r[5],
             .lambda = r[6],
             .gap = r[7],
             .value = r[8],
             .row = -1};

  for (int k = 0; k < 3; k++) hit.normal[k] = r[9 + k];
  SbFrictionLoad(r + 12, &hit.grip);
  return hit;
}

PetscErrorCode SbEffectSave_Collision(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Collision *c = (const Collision *)e->data;
  const SbDetectScene *s = &c->surface->scene;
  PetscInt nalone = 0;
  PetscReal *r;

  PetscFunctionBeginUser;
  (void)space;
  for (PetscInt i = 0; i < s->npoint; i++) nalone += c->alone[i] != 0;
  PetscCall(PetscCalloc1(SB_COLLISION_STATE * (c->npast + 1 + nalone), records));
  r = *records;
  r[0] = SUMS;
  r[1] = c->work;
  r[2] = c->friction.loss;
  r[3] = c->overlap.longest;
  r[4] = c->deep;
  *n = 1;
  for (PetscInt i = 0; i < c->npast; i++) {
    const Hit *hit = &c->past[i];

    if (hit->on || hit->was || hit->allowed > 0 || hit->lambda != 0)
      write_record(c, hit, r + SB_COLLISION_STATE * (*n)++);
  }
  for (PetscInt i = 0; i < s->npoint; i++) {
    PetscReal *to = r + SB_COLLISION_STATE * *n;

    if (!c->alone[i]) continue;
    to[0] = ALONE;
    to[1] = (PetscReal)s->point_id[i];
    to[2] = c->alone[i];
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int by_pair(const void *a, const void *b)
{
  const Hit *p = (const Hit *)a, *q = (const Hit *)b;

  if (p->point != q->point) return p->point < q->point ? -1 : 1;
  return (p->part > q->part) - (p->part < q->part);
}

/* Identities of a rank's points, or edges, in ascending order, and where they are. */
typedef struct {
  PetscInt n, first;
  PetscInt *id, *at;
} Names;

static PetscErrorCode sort_names(PetscInt n, PetscInt first, const PetscInt id[], Names *names)
{
  PetscFunctionBeginUser;
  names->n = n;
  names->first = first;
  PetscCall(PetscMalloc2(n, &names->id, n, &names->at));
  for (PetscInt i = 0; i < n; i++) {
    names->id[i] = id[i];
    names->at[i] = i;
  }
  PetscCall(PetscSortIntWithArray(n, names->id, names->at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectLoad_Collision(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                                      const PetscReal records[])
{
  Collision *c = (Collision *)e->data;
  const SbDetectScene *s = &c->surface->scene;
  PetscReal sums[2] = {0, 0};
  PetscMPIInt rank;
  Names names[2];

  PetscFunctionBeginUser;
  (void)t;
  PetscCallMPI(MPI_Comm_rank(space->comm, &rank));
  PetscCall(sort_names(s->npoint, 0, s->point_id, &names[POINT]));
  PetscCall(sort_names(s->edges->nown, s->npoint, s->edges->id, &names[EDGES]));
  PetscCall(PetscRealloc((size_t)PetscMax(n, 1) * sizeof(Hit), &c->past));
  c->past_size = PetscMax(n, 1);
  c->npast = c->nhit = 0;
  c->work = c->friction.loss = 0;
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *r = records + SB_COLLISION_STATE * i;
    const Names *of = &names[r[0] == EDGES];
    PetscInt place;

    if (r[0] == SUMS && !rank) {
      c->work += r[1];
      c->friction.loss += r[2];
    }
    if (r[0] == SUMS) {
      sums[0] = PetscMax(sums[0], r[3]);
      sums[1] = PetscMax(sums[1], r[4]);
      continue;
    }
    PetscCall(PetscFindInt((PetscInt)r[1], of->n, of->id, &place));
    if (place < 0) continue;
    if (r[0] == ALONE)
      c->alone[of->at[place]] = (signed char)r[2];
    else
      c->past[c->npast++] = read_record(r, of->first + of->at[place]);
  }
  if (c->npast) qsort(c->past, (size_t)c->npast, sizeof(Hit), by_pair);
  for (int k = 0; k < 2; k++) PetscCall(PetscFree2(names[k].id, names[k].at));
  PetscCall(PetscArraycpy(c->u0, u, 3 * space->nnode));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPIU_REAL, MPI_MAX, space->comm));
  c->overlap.longest = sums[0];
  c->overlap.left = 1; /* the step that ended has taken its part */
  c->begun = PETSC_TRUE;
  if (sums[1] > 0)
    PetscCall(SbCollisionFindOverlap(e, u)); /* separation directions of what is left are found again */
  PetscCall(SbCollisionRestore(c));
  PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points keep their names but for their numbers; edges are named by their facets, which are others now, and are searched for again. */
PetscErrorCode SbEffectRename_Collision(SbEffect e, PetscInt nnode, const PetscInt from[],
                                        const PetscInt to[], PetscInt *n, PetscReal records[])
{
  PetscInt kept = 0;

  PetscFunctionBeginUser;
  (void)e;
  for (PetscInt i = 0; i < *n; i++) {
    PetscReal *r = records + SB_COLLISION_STATE * i;
    PetscInt place = -1;

    if (r[0] == POINT) PetscCall(PetscFindInt((PetscInt)r[1], nnode, from, &place));
    if (place >= 0) r[1] = (PetscReal)to[place];
    if (place < 0 && r[0] != SUMS) continue;
    PetscCall(PetscArraymove(records + SB_COLLISION_STATE * kept, r, SB_COLLISION_STATE));
    kept++;
  }
  *n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}
