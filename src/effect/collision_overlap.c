/*
  collision_overlap.c - overlap that is there when a run begins: how deep it is, and which way out of it.

  Later, what comes in is seen as it comes. What is in from the start may be deeper than the reach, and there the nearest place of the surface
  is no way out: neighbours would be pushed to different sides. So ways are given as by Heidelberger, Teschner, Keiser, Mueller and
  Gross, "Consistent penetration depth estimation for deformable collision response", VMV 2004: edges that go through the other surface
  tell their inner end the normal there, weighted by the inverse square of the distance; from these points they spread along edges to those
  inside. Depth and place are then where the way leads out. They stay until the bodies have parted.

  Points of CR and DG are on facets: there an edge tells both its facets.
*/
#include "collision.h"
#include "sbkernel.h"
#include <limits.h>

#define GRAZE 1e-6  /* of an edge: nearer to its ends it touches a facet and does not go through it */
#define CANCEL 1e-6 /* of the weights: what is left of ways that oppose each other is none */
#define BLIND 8     /* reaches, four edges: overlap is looked for so deep without a sign of it */

static PetscErrorCode deepest_of(const Collision *c, PetscReal *deepest)
{
  PetscFunctionBeginUser;
  *deepest = 0;
  for (PetscInt i = 0; i < c->nhit; i++) *deepest = PetscMax(*deepest, -c->hit[i].gap);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, deepest, 1, MPIU_REAL, MPI_MAX, c->surface->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How far boxes of two surfaces are in each other at most, m. */
static PetscErrorCode boxes_overlap(const Collision *c, PetscReal *most)
{
  const SbDetectScene *s = &c->surface->scene;
  const PetscInt nbody = c->surface->space->mesh->nbody;
  PetscReal *box; /* [nbody][6] lower corners, negative upper ones */

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(6 * nbody, &box));
  for (PetscInt i = 0; i < 6 * nbody; i++) box[i] = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < s->npoint; i++) {
    PetscReal *mine = box + 6 * s->point_part[i];

    for (int k = 0; k < 3; k++) {
      mine[k] = PetscMin(mine[k], s->p[3 * i + k]);
      mine[3 + k] = PetscMin(mine[3 + k], -s->p[3 * i + k]);
    }
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, box, (PetscMPIInt)(6 * nbody), MPIU_REAL, MPI_MIN, c->surface->space->comm));
  *most = 0;
  for (PetscInt a = 0; a < nbody; a++) {
    for (PetscInt b = 0; b < a; b++) {
      PetscReal least = PETSC_MAX_REAL;

      for (int k = 0; k < 3; k++)
        least = PetscMin(least, PetscMin(-box[6 * a + 3 + k], -box[6 * b + 3 + k]) -
                                  PetscMax(box[6 * a + k], box[6 * b + k]));
      *most = PetscMax(*most, least);
    }
  }
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ ways out */

/* What own edges connect, as nodes; global vectors with four numbers for each node: a way times its weight, and the weight. */
typedef struct {
  PetscInt n;
  const PetscInt *node; /* [n][2] global numbers */
  PetscReal *w;         /* [n] inverse square of the length, m^-2 */
  Vec known, sum;       /* ways that are known; what neighbours say */
  Vec ends;             /* [n][2][4] those of the ends of own edges */
  VecScatter scatter;
} Ways;

/* The node that carries corner q of a facet: its own with P1, that of the facet with CR and DG. */
static PetscInt carrier(const SbSurface f, PetscInt facet, int q)
{
  const PetscReal *w = f->facet_weight + 12 * facet;
  const PetscReal size = PetscAbsReal(w[4 * q]) + PetscAbsReal(w[4 * q + 1]) + PetscAbsReal(w[4 * q + 2]) +
                         PetscAbsReal(w[4 * q + 3]);
  PetscReal most = 0;
  int at = 0;

  for (int a = 0; a < 4; a++) {
    const PetscReal here =
      size == 1 ? w[4 * q + a] : w[a] + w[4 + a] + w[8 + a]; /* at the corner, or in the middle */

    if (here > most) at = a;
    most = PetscMax(most, here);
  }
  return f->facet_node[4 * facet + at];
}

static PetscErrorCode create_ways(const Collision *c, Ways *w)
{
  const SbSurface f = c->surface;
  const SbDetectScene *s = &f->scene;
  IS from;

  PetscFunctionBeginUser;
  w->n = s->edges->nown;
  w->node = f->edge_carrier;
  PetscCall(PetscMalloc1(w->n, &w->w));
  for (PetscInt i = 0; i < s->edges->nown; i++) {
    const PetscReal *a = s->x + 3 * s->edges->corner[4 * i], *b = s->x + 3 * s->edges->corner[4 * i + 1];
    PetscReal r[3];

    for (int k = 0; k < 3; k++) r[k] = b[k] - a[k];
    w->w[i] = 1 / PetscMax(SbDot3(r, r), PETSC_MACHINE_EPSILON * c->reach * c->reach);
  }
  PetscCall(VecCreate(f->space->comm, &w->known));
  PetscCall(VecSetBlockSize(w->known, 4));
  PetscCall(VecSetSizes(w->known, 4 * f->space->nnode_owned, PETSC_DETERMINE));
  PetscCall(VecSetType(w->known, VECSTANDARD));
  PetscCall(VecDuplicate(w->known, &w->sum));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 8 * w->n, &w->ends));
  PetscCall(ISCreateBlock(PETSC_COMM_SELF, 4, 2 * w->n, w->node, PETSC_USE_POINTER, &from));
  PetscCall(VecScatterCreate(w->known, from, w->ends, NULL, &w->scatter));
  PetscCall(ISDestroy(&from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_ways(Ways *w)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(w->w));
  PetscCall(VecDestroy(&w->known));
  PetscCall(VecDestroy(&w->sum));
  PetscCall(VecDestroy(&w->ends));
  PetscCall(VecScatterDestroy(&w->scatter));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w->ends from w->known. */
static PetscErrorCode bring_ends(Ways *w)
{
  PetscFunctionBeginUser;
  PetscCall(VecScatterBegin(w->scatter, w->known, w->ends, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(w->scatter, w->known, w->ends, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where an edge goes through a facet, its inner end gets the facet's normal, and the corners of the facet the opposite one. */
static PetscErrorCode add_entry(const Collision *c, PetscInt edge, PetscInt facet, Vec sum)
{
  const SbDetectScene *s = &c->surface->scene;
  const PetscReal *const x[3] = {s->x + 3 * s->facet[3 * facet], s->x + 3 * s->facet[3 * facet + 1],
                                 s->x + 3 * s->facet[3 * facet + 2]};
  const PetscReal *a = s->x + 3 * s->edges->corner[4 * edge], *b = s->x + 3 * s->edges->corner[4 * edge + 1];
  PetscReal u[3], v[3], n[4], way[4], weight[3], t, length, inner;
  PetscInt node;
  PetscBool out;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    way[k] = b[k] - a[k];
    u[k] = x[1][k] - x[0][k];
    v[k] = x[2][k] - x[0][k];
  }
  if (!SbRayMeets(a, way, x, &t, weight, &out) || t < GRAZE || t > 1 - GRAZE)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbCross(u, v, n);
  length = PetscSqrtReal(SbDot3(n, n));
  inner = out ? t : 1 - t; /* of the edge, from the inner end */
  inner *= inner * SbDot3(way, way);
  if (!(length > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 3; k++) n[k] /= length * inner;
  n[3] = 1 / inner;
  for (int q = 0; q < 2; q++) { /* what is outside does not take it */
    node = c->surface->edge_carrier[2 * edge + q];
    PetscCall(VecSetValuesBlocked(sum, 1, &node, n, ADD_VALUES));
  }
  for (int q = 0; q < 3; q++) {
    node = carrier(c->surface, facet, q);
    for (int k = 0; k < 3; k++) way[k] = -weight[q] * n[k];
    way[3] = weight[q] * n[3];
    PetscCall(VecSetValuesBlocked(sum, 1, &node, way, ADD_VALUES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool apart(const PetscReal a[3], const PetscReal b[3], const PetscReal low[3],
                              const PetscReal high[3])
{
  for (int k = 0; k < 3; k++) {
    if (PetscMax(a[k], b[k]) < low[k] || PetscMin(a[k], b[k]) > high[k]) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Which edges have one end inside: those alone can go through a surface once. Listed in cut[], room for w->n. */
static PetscErrorCode find_cut(const Collision *c, Ways *w, PetscInt *n, PetscInt cut[])
{
  const SbSurface f = c->surface;
  const PetscReal *end;
  PetscReal *inside;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(w->known));
  PetscCall(VecGetArray(w->known, &inside));
  for (PetscInt i = 0; i < f->scene.npoint; i++) inside[4 * f->point_node[i]] = c->way_part[i] >= 0;
  PetscCall(VecRestoreArray(w->known, &inside));
  PetscCall(bring_ends(w));
  PetscCall(VecGetArrayRead(w->ends, &end));
  *n = 0;
  for (PetscInt i = 0; i < w->n; i++) {
    if (end[8 * i] != end[8 * i + 4]) cut[(*n)++] = i;
  }
  PetscCall(VecRestoreArrayRead(w->ends, &end));
  PetscCall(VecZeroEntries(w->known));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* These edges against all facets of other parts, once in a run. */
static PetscErrorCode find_entries(const Collision *c, Ways *w)
{
  const SbDetectScene *s = &c->surface->scene;
  PetscInt n = 0, *cut;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(w->n, &cut));
  PetscCall(find_cut(c, w, &n, cut));
  PetscCall(VecZeroEntries(w->sum));
  for (PetscInt f = 0; f < s->nfacet && n; f++) {
    PetscReal low[3], high[3];

    for (int k = 0; k < 3; k++) {
      const PetscReal a = s->x[3 * s->facet[3 * f] + k], b = s->x[3 * s->facet[3 * f + 1] + k],
                      d = s->x[3 * s->facet[3 * f + 2] + k];

      low[k] = PetscMin(a, PetscMin(b, d));
      high[k] = PetscMax(a, PetscMax(b, d));
    }
    for (PetscInt j = 0; j < n; j++) {
      const PetscInt *corner = s->edges->corner + 4 * cut[j];

      if (s->edges->part[cut[j]] == s->facet_part[f] ||
          apart(s->x + 3 * corner[0], s->x + 3 * corner[1], low, high))
        continue;
      PetscCall(add_entry(c, cut[j], f, w->sum));
    }
  }
  PetscCall(PetscFree(cut));
  PetscCall(VecAssemblyBegin(w->sum));
  PetscCall(VecAssemblyEnd(w->sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points inside that have none take the way that their sum says; how many on all ranks. */
static PetscErrorCode take_ways(const Collision *c, Ways *w, PetscInt *n)
{
  const SbSurface f = c->surface;
  const PetscReal *sum;
  PetscReal *known;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(VecGetArrayRead(w->sum, &sum));
  PetscCall(VecGetArray(w->known, &known));
  for (PetscInt i = 0; i < f->scene.npoint; i++) {
    const PetscInt node = f->point_node[i];
    PetscReal *way = c->way + 3 * i;
    const PetscReal *of = sum + 4 * node, length = PetscSqrtReal(SbDot3(of, of));

    if (c->way_part[i] < 0 || SbDot3(way, way) > 0 || !(length > CANCEL * of[3])) continue;
    for (int k = 0; k < 3; k++) known[4 * node + k] = way[k] = of[k] / length;
    known[4 * node + 3] = 1;
    (*n)++;
  }
  PetscCall(VecRestoreArray(w->known, &known));
  PetscCall(VecRestoreArrayRead(w->sum, &sum));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 1, MPIU_INT, MPI_SUM, f->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Known ways go to the other ends of edges. */
static PetscErrorCode spread(Ways *w)
{
  const PetscReal *end;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(w->sum));
  PetscCall(bring_ends(w));
  PetscCall(VecGetArrayRead(w->ends, &end));
  for (PetscInt i = 0; i < 2 * w->n; i++) {
    PetscReal way[4];

    for (int k = 0; k < 4; k++) way[k] = w->w[i / 2] * end[4 * i + k];
    PetscCall(VecSetValuesBlocked(w->sum, 1, &w->node[i ^ 1], way, ADD_VALUES));
  }
  PetscCall(VecRestoreArrayRead(w->ends, &end));
  PetscCall(VecAssemblyBegin(w->sum));
  PetscCall(VecAssemblyEnd(w->sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The ways out for the points that the last look found inside: of the part in which they are deepest. */
static PetscErrorCode find_ways(Collision *c)
{
  const PetscInt npoint = c->surface->scene.npoint;
  PetscReal *deepest;
  PetscInt n;
  Ways w;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(3 * npoint, &c->way, npoint, &c->way_part));
  PetscCall(PetscCalloc1(npoint, &deepest));
  for (PetscInt i = 0; i < npoint; i++) c->way_part[i] = -1;
  for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
    const Hit *hit = &c->hit[i];

    if (-hit->gap <= deepest[hit->point]) continue;
    deepest[hit->point] = -hit->gap;
    c->way_part[hit->point] = hit->part;
  }
  PetscCall(PetscFree(deepest));
  PetscCall(create_ways(c, &w));
  PetscCall(find_entries(c, &w));
  PetscCall(take_ways(c, &w, &n));
  while (n > 0) {
    PetscCall(spread(&w));
    PetscCall(take_ways(c, &w, &n));
  }
  PetscCall(destroy_ways(&w));
  for (PetscInt i = 0; i < npoint; i++) {
    if (!(SbDot3(c->way + 3 * i, c->way + 3 * i) > 0)) c->way_part[i] = -1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ how deep */

/* One point of each body, and whether the effect is not on it; the same on all ranks. */
typedef struct {
  PetscReal x[3], none;
} Sample;

static PetscErrorCode sample_bodies(const Collision *c, PetscInt nbody, Sample sample[])
{
  const SbDetectScene *s = &c->surface->scene;
  const MPI_Comm comm = c->surface->space->comm;
  PetscMPIInt rank, *first; /* the rank that takes the point */
  PetscInt *point;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(PetscMalloc2(nbody, &first, nbody, &point));
  PetscCall(PetscArrayzero(sample, nbody));
  for (PetscInt b = 0; b < nbody; b++) first[b] = INT_MAX;
  for (PetscInt i = s->npoint - 1; i >= 0; i--) {
    first[s->point_part[i]] = rank;
    point[s->point_part[i]] = i;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, first, (PetscMPIInt)nbody, MPI_INT, MPI_MIN, comm));
  for (PetscInt b = 0; b < nbody; b++) {
    if (first[b] != rank) continue;
    for (int k = 0; k < 3; k++) sample[b].x[k] = s->p[3 * point[b] + k];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sample, (PetscMPIInt)(4 * nbody), MPIU_REAL, MPI_SUM, comm));
  for (PetscInt b = 0; b < nbody; b++) sample[b].none = first[b] == INT_MAX;
  PetscCall(PetscFree2(first, point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A body that lies in the flesh of another, so deep that none of the looks found it, has no way out that could be told: half-lines from a point of
  it leave the other once more than they enter. Two of three have to, as one may run along an edge. A body in a hollow is not meant.
*/
static PetscErrorCode refuse_swallowed(const Collision *c, const char name[])
{
  static const PetscReal way[3][3] = {{0.81, 0.47, 0.35}, {-0.29, 0.87, -0.41}, {0.13, -0.38, 0.92}};
  const SbDetectScene *s = &c->surface->scene;
  const SbMesh mesh = c->surface->space->mesh;
  const PetscInt nbody = mesh->nbody;
  Sample *sample;
  /* [nbody][nbody]: leavings less entries of half-lines from the first by facets of the second, and pairs that the last look saw */
  PetscReal(*leave)[4];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(nbody, &sample));
  PetscCall(PetscCalloc1(nbody * nbody, &leave));
  PetscCall(sample_bodies(c, nbody, sample));
  for (PetscInt i = 0; i < c->nhit; i++) {
    const PetscInt a = SbCollisionFirst(c, &c->hit[i]), b = c->hit[i].body;

    leave[a * nbody + b][3]++;
    leave[b * nbody + a][3]++;
  }
  for (PetscInt f = 0; f < c->surface->nfacet_owned; f++) {
    const PetscReal *const x[3] = {s->x + 3 * s->facet[3 * f], s->x + 3 * s->facet[3 * f + 1],
                                   s->x + 3 * s->facet[3 * f + 2]};

    for (PetscInt b = 0; b < nbody; b++) {
      for (int k = 0; k < 3 && b != s->facet_part[f]; k++) {
        PetscReal t, weight[3];
        PetscBool out;

        if (SbRayMeets(sample[b].x, way[k], x, &t, weight, &out))
          leave[b * nbody + s->facet_part[f]][k] += out ? 1 : -1;
      }
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, leave, (PetscMPIInt)(4 * nbody * nbody), MPIU_REAL, MPI_SUM,
                             c->surface->space->comm));
  for (PetscInt i = 0; i < nbody * nbody; i++) {
    const PetscInt a = i / nbody, b = i % nbody;

    PetscCheck(
      sample[a].none > 0 || leave[i][3] > 0 || (leave[i][0] > 0) + (leave[i][1] > 0) + (leave[i][2] > 0) < 2,
      PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
      "body %s lies inside body %s, at (%g, %g, %g) m, deeper than %g m below its surface: -effect_%s_type "
      "collision cannot tell which way it came in; move one of them (-body_%s_translate), or name sets of "
      "one "
      "of them only (-effect_%s_on)",
      mesh->body[a].name, mesh->body[b].name, (double)sample[a].x[0], (double)sample[a].x[1],
      (double)sample[a].x[2], (double)PetscMax(c->deep, c->reach), name, mesh->body[a].name, name);
  }
  PetscCall(PetscFree(leave));
  PetscCall(PetscFree(sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Around the places where surfaces go through each other depths begin with 0: the range is doubled until it holds twice all of them. Faces
  that lie in one plane hide those places: so where boxes overlap, a few layers of cells are looked through in any case.
*/
PetscErrorCode SbCollisionFindOverlap(SbEffect e, const PetscReal u[])
{
  Collision *c = (Collision *)e->data;
  PetscReal range = c->reach, deepest, blind;

  PetscFunctionBeginUser;
  c->begun = PETSC_TRUE;
  PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
  PetscCall(deepest_of(c, &deepest));
  PetscCall(boxes_overlap(c, &blind));
  blind = PetscMin(blind, BLIND * c->reach);
  while ((2 * deepest > range || range < blind) && range < c->surface->size) {
    c->deep = range *= 2;
    PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
    PetscCall(deepest_of(c, &deepest));
  }
  if (blind > 0) PetscCall(refuse_swallowed(c, e->name));
  PetscCall(SbCollisionFollowOverlap(c));
  if (c->deep > 0) PetscCall(find_ways(c));
  c->nhit = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCollisionFollowOverlap(Collision *c)
{
  PetscReal deepest;

  PetscFunctionBeginUser;
  if (!(c->deep > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(deepest_of(c, &deepest));
  c->deep = 2 * deepest > c->reach ? PetscMin(c->deep, 2 * deepest) : 0;
  if (c->deep == 0) PetscCall(PetscFree2(c->way, c->way_part));
  PetscFunctionReturn(PETSC_SUCCESS);
}
