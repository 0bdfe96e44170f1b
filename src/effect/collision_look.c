/*
  collision_look.c - pairs of a point and a surface near it, and of two edges, from search to search: what the detector finds now, with what was known
  of the pair before.

  A step may be tried several times. Each attempt begins with the pairs as the last step left them, so that a failed one leaves no
  trace but for the multipliers of `augmented`: a guess, raised until gaps close, that may take more than one attempt.
*/
#include "collision.h"

#define TURNED 0.7 /* cosine between normals of two searches, below which they are of another place */
#define JUMP \
  0.05 /* of the reach: so much deeper a pair that is constrained began the step, seen from a facet that it is not held by */
#define CORNER 1e-4 /* of the reach: places that may be one (near.c) */

/* Edges that rounding alone tells apart are the same. */
PetscBool SbCollisionLooksFor(const Collision *c, PetscInt mine, PetscInt other)
{
  const PetscReal difference = c->edge[mine] - c->edge[other];

  if (c->both || mine == other) return PETSC_TRUE;
  if (PetscAbsReal(difference) > 1e-6 * c->edge[mine]) return (PetscBool)(difference < 0);
  return (PetscBool)(mine < other);
}

/* What the detector found: points first. */
typedef struct {
  PetscInt nnear, npair;
  const SbNear *near;
  const SbEdgePair *pair;
} Found;

/* The pair of something found, by which it is known from search to search. */
static void name_of(const Collision *c, const Found *found, PetscInt i, Hit *hit)
{
  const SbDetectScene *s = &c->surface->scene;

  if (i < found->nnear) {
    hit->point = found->near[i].point;
    hit->part = hit->body = s->facet_part[found->near[i].facet];
    hit->k = c->point_k[hit->point];
  } else {
    const SbEdgePair *pair = &found->pair[i - found->nnear];

    hit->point = s->npoint + pair->edge[0];
    hit->part = s->edges->id[pair->edge[1]];
    hit->body = s->edges->part[pair->edge[1]];
    hit->k = c->edge_k[pair->edge[0]];
  }
}

/* Displacement of a point less that of its place on the facet, from places x and X. */
static void relative(const SbNear *near, const SbDetectScene *s, const PetscReal p[], const PetscReal x[],
                     PetscReal w[3])
{
  const PetscInt *corner = s->facet + 3 * near->facet;

  for (int i = 0; i < 3; i++) {
    w[i] = p[3 * near->point + i] - s->P[3 * near->point + i];
    for (int k = 0; k < 3; k++) w[i] -= near->weight[k] * (x[3 * corner[k] + i] - s->X[3 * corner[k] + i]);
  }
}

/* The same of the place on the first edge less that on the second. */
static void relative_edges(const SbEdgePair *pair, const SbDetectScene *s, const PetscReal x[],
                           PetscReal w[3])
{
  w[0] = w[1] = w[2] = 0;
  for (int q = 0; q < 4; q++) {
    const PetscInt corner = s->edges->corner[4 * pair->edge[q / 2] + q % 2];
    const PetscReal t = pair->at[q / 2], weight = (q < 2 ? 1 : -1) * (q % 2 ? t : 1 - t);

    for (int i = 0; i < 3; i++) w[i] += weight * (x[3 * corner + i] - s->X[3 * corner + i]);
  }
}

static inline void add_node(Hit *hit, PetscInt node, PetscReal weight)
{
  if (PetscAbsReal(weight) < 1e-14) return;
  hit->node[hit->n] = node;
  hit->weight[hit->n++] = weight;
}

/* Nodes and weights of a pair, where it is, and where it was when the step began. */
static void take_point(const Collision *c, const SbNear *near, Hit *hit)
{
  const SbContactSurface f = c->surface;
  const SbDetectScene *s = &f->scene;

  hit->n = 0;
  add_node(hit, f->space->gnode[f->point_node[near->point]], 1);
  hit->mine = hit->n;
  for (int a = 0; a < 4; a++) {
    PetscReal w = 0;

    for (int k = 0; k < 3; k++) w += near->weight[k] * f->facet_weight[12 * near->facet + 4 * k + a];
    add_node(hit, f->facet_node[4 * near->facet + a], -w);
  }
  relative(near, s, s->p, s->x, hit->now);
  relative(near, s, s->p0 ? s->p0 : s->p, s->x0 ? s->x0 : s->x, hit->start);
}

static void take_edges(const Collision *c, const SbEdgePair *pair, Hit *hit)
{
  const SbContactSurface f = c->surface;
  const SbDetectScene *s = &f->scene;

  hit->n = 0;
  for (int q = 0; q < 2; q++) {
    const PetscReal *weight = f->edge_weight + 8 * pair->edge[q], t = pair->at[q];

    for (int a = 0; a < 4; a++)
      add_node(hit, f->edge_node[4 * pair->edge[q] + a],
               (q ? -1 : 1) * ((1 - t) * weight[a] + t * weight[4 + a]));
    if (!q) hit->mine = hit->n;
  }
  hit->at = pair->at[0];
  relative_edges(pair, s, s->x, hit->now);
  relative_edges(pair, s, s->x0 ? s->x0 : s->x, hit->start);
}

static inline const PetscReal *normal_of(const Found *found, PetscInt i)
{
  return i < found->nnear ? found->near[i].normal : found->pair[i - found->nnear].normal;
}

static inline PetscReal gap_of(const Found *found, PetscInt i)
{
  return i < found->nnear ? found->near[i].gap : found->pair[i - found->nnear].gap;
}

/*
  Normal, weights and gap of a pair as the detector sees it now. A point that was behind this facet when the step began, and not constrained
  there, was not seen before (it came over a rim, or onto another facet, or bodies overlap from the start): putting it in front at once would
  throw it out. So with edges.
*/
static void take_geometry(const Collision *c, const Found *found, PetscInt i, Hit *hit)
{
  const SbEdgePair *pair = i < found->nnear ? NULL : &found->pair[i - found->nnear];
  const PetscReal *normal = normal_of(found, i);
  const PetscReal turned = SbDot3(hit->normal, normal);
  PetscReal before;

  if (pair)
    take_edges(c, pair, hit);
  else
    take_point(c, &found->near[i], hit);
  for (int k = 0; k < 3; k++) hit->normal[k] = normal[k];
  hit->gap = gap_of(found, i);
  hit->value = SbDot3(hit->normal, hit->now) - hit->gap;
  before = SbDot3(hit->normal, hit->now) - SbDot3(hit->normal, hit->start) - hit->gap;
  if (!hit->was || turned < TURNED || before > hit->allowed + JUMP * c->reach)
    hit->allowed = c->overlap.left * PetscMax(0, before);
}

static PetscErrorCode make_room(Collision *c, PetscInt n)
{
  PetscFunctionBeginUser;
  if (n > c->size) {
    c->size = PetscMax(n, 2 * c->size);
    PetscCall(PetscRealloc((size_t)c->size * sizeof(Hit), &c->hit));
    PetscCall(PetscRealloc((size_t)c->size * sizeof(Hit), &c->spare));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool before(const Hit *a, PetscInt point, PetscInt part)
{
  return (PetscBool)(a->point < point || (a->point == point && a->part < part));
}

/* A pair keeps its normal and weights once its gap is closed, or after many searches: on an edge they may change for ever. */
static PetscBool is_settled(const Collision *c, PetscReal gap, const PetscReal normal[3], Hit *hit)
{
  /* at a corner another facet may be as near: then the one that holds does */
  if (PetscAbsReal(gap + hit->allowed) <= CORNER * c->reach && SbDot3(hit->normal, normal) < TURNED &&
      PetscAbsReal(SbCollisionExcess(hit)) <= TOLERANCE * c->surface->size)
    return PETSC_TRUE;
  if (hit->looks++ < FEW_LOOKS) return PETSC_FALSE;
  return (PetscBool)(hit->looks > LOOKS ||
                     PetscAbsReal(gap + hit->allowed - hit->leaves) <= 0.1 * TOLERANCE * c->surface->size);
}

/* A pair that was not found stays when it touches. */
static void keep_lost(const Hit *hit, Hit to[], PetscInt *m)
{
  if (!hit->on) return;
  to[*m] = *hit;
  to[(*m)++].depth = 0;
}

/*
  The pairs found, each with what is known of it from before. Within a step (`within`) a pair that touches and was not found stays
  as it is: it slid over a rim.
*/
static PetscErrorCode merge(Collision *c, const Found *found, PetscBool within)
{
  const SbDetectScene *s = &c->surface->scene;
  const PetscInt n = found->nnear + found->npair;
  PetscInt old = 0, m = 0;
  Hit *swap;

  PetscFunctionBeginUser;
  PetscCall(make_room(c, n + c->nhit));
  for (PetscInt i = 0; i < n; i++) {
    Hit hit = {.row = -1, .grip = {.slide = {-1, -1}}};

    name_of(c, found, i, &hit);
    if (hit.point < s->npoint && !SbCollisionLooksFor(c, s->point_part[hit.point], hit.part)) continue;
    for (; old < c->nhit && before(&c->hit[old], hit.point, hit.part); old++)
      if (within) keep_lost(&c->hit[old], c->spare, &m);
    if (old < c->nhit && c->hit[old].point == hit.point && c->hit[old].part == hit.part) {
      hit = c->hit[old++];
      name_of(c, found, i, &hit); /* what comes from a checkpoint has not all of it */
    }
    if (!within || !hit.on || !is_settled(c, gap_of(found, i), normal_of(found, i), &hit))
      take_geometry(c, found, i, &hit);
    hit.depth = i < found->nnear ? found->near[i].depth : found->pair[i - found->nnear].depth;
    c->spare[m++] = hit;
  }
  for (; old < c->nhit && within; old++) keep_lost(&c->hit[old], c->spare, &m);
  swap = c->hit;
  c->hit = c->spare;
  c->spare = swap;
  c->nhit = m;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCollisionLook(Collision *c, const PetscReal u[], PetscBool within)
{
  const SbDetectScene *s = &c->surface->scene;
  Found found = {0};
  SbDetectStats stats;

  PetscFunctionBeginUser;
  c->surface->scene.deep = c->deep;
  c->surface->scene.p_way = c->way;
  c->surface->scene.p_way_part = c->way_part;
  PetscCall(SbContactSurfaceUpdate(c->surface, c->u0, u, c->reach, c->self, &c->close));
  if (c->close || c->self) {
    PetscCall(SbDetectorFind(c->detector, s, &found.nnear, &found.near));
    PetscCall(SbDetectorGetStats(c->detector, &stats));
    c->looks++;
    c->candidates += stats.candidates;
    PetscCall(SbDetectorFindEdges(c->detector, s, &found.npair, &found.pair));
  }
  PetscCall(merge(c, &found, within));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The multipliers that a failed attempt has raised, with the pairs that have them. */
static void keep_multipliers(Collision *c)
{
  PetscInt old = 0, m = 0;
  Hit *swap;

  for (PetscInt i = 0; i < c->npast; i++) {
    Hit hit = c->past[i];

    while (old < c->nhit && before(&c->hit[old], hit.point, hit.part)) c->spare[m++] = c->hit[old++];
    if (old < c->nhit && c->hit[old].point == hit.point && c->hit[old].part == hit.part) {
      hit.lambda = c->hit[old].lambda;
      hit.on = c->hit[old++].on;
    }
    c->spare[m++] = hit;
  }
  while (old < c->nhit) c->spare[m++] = c->hit[old++];
  swap = c->hit;
  c->hit = c->spare;
  c->spare = swap;
  c->nhit = m;
}

PetscErrorCode SbCollisionRestore(Collision *c)
{
  PetscFunctionBeginUser;
  PetscCall(make_room(c, c->npast + c->nhit));
  if (c->response == AUGMENTED)
    keep_multipliers(c);
  else {
    PetscCall(PetscArraycpy(c->hit, c->past, c->npast));
    c->nhit = c->npast;
  }
  for (PetscInt i = 0; i < c->nhit; i++) {
    c->hit[i].allowed *= c->overlap.left;
    if (c->hit[i].leaves > 0) c->hit[i].on = PETSC_FALSE; /* it rebounded and is free */
    c->hit[i].leaves = c->hit[i].arrives = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCollisionKeep(Collision *c)
{
  PetscFunctionBeginUser;
  if (c->nhit > c->past_size) {
    c->past_size = c->size;
    PetscCall(PetscRealloc((size_t)c->past_size * sizeof(Hit), &c->past));
  }
  PetscCall(PetscArraycpy(c->past, c->hit, c->nhit));
  c->npast = c->nhit;
  PetscFunctionReturn(PETSC_SUCCESS);
}
