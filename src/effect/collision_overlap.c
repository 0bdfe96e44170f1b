/*
  collision_overlap.c - points inside bodies that no pair holds: which separation direction, and how deep.

  What comes in while a run goes on is seen as it comes. What is in from the start, or got in past what is examined, is found as a point in a tet
  (src/contact/inside.c). It may be deeper than the reach, and there the nearest place of the surface
  is no separation direction: neighbours would be pushed to different sides. So ways are given as by Heidelberger, Teschner, Keiser, Mueller and
  Gross, "Consistent penetration depth estimation for deformable collision response", VMV 2004: edges that go through the other surface
  tell their inner end the normal there, weighted by the inverse square of the distance; from these points they spread along edges to those
  inside. Depth and place are then where the way leads out. They stay until no pair is deeper than half the reach, where the nearest place will do.

  Points of CR and DG are on facets: there an edge tells both its facets.
*/
#include "collision.h"
#include "sbkernel.h"
#include <limits.h>

#define GRAZE 1e-6  /* of an edge: nearer to its inner end it touches a facet and does not go through it */
#define ALONG 0.2   /* cosine between edge and normal, below which the edge runs along the facet */
#define CANCEL 1e-6 /* of the weights: the remainder of ways that oppose each other is none */
#define BLIND \
  8 /* reaches, four edges: without a separation direction the nearest places are searched for so deep */
#define SHALLOW 0.5 /* of the reach: what is less deep needs no separation direction but the nearest place */
#define PATIENCE 3  /* steps that a point may be inside without a pair: edges and rims take so long */
#define AGAIN 30    /* steps after which one that has got no pair is examined again */

static PetscErrorCode deepest_of(const Collision *c, PetscReal *deepest)
{
  PetscFunctionBeginUser;
  *deepest = 0;
  for (PetscInt i = 0; i < c->nhit; i++) *deepest = PetscMax(*deepest, -c->hit[i].gap);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, deepest, 1, MPIU_REAL, MPI_MAX, c->surface->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ separation directions */

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
static PetscInt carrier(const SbContactSurface f, PetscInt facet, int q)
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

/* Whether an own edge is one of P1, whose ends are nodes. */
static inline PetscBool of_vertices(const Collision *c, PetscInt edge)
{
  return (PetscBool)(c->surface->space->element[c->surface->scene.edges->part[edge]]->nodes_per[0] > 0);
}

static PetscErrorCode create_ways(const Collision *c, Ways *w)
{
  const SbContactSurface f = c->surface;
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

/* An own edge from one of its ends on, which may leave a part. */
typedef struct {
  PetscInt edge, part;
  int from; /* the inner end, 0 or 1 */
} Leaving;

/*
  Where an edge leaves a part through a facet, its inner end gets the facet's normal, and the corners of the facet the opposite one. `clear`: only when it
  goes through it, and not along it.
*/
static PetscErrorCode add_entry(const Collision *c, const Leaving *l, PetscInt facet, PetscBool clear,
                                Vec sum)
{
  const SbDetectScene *s = &c->surface->scene;
  const PetscReal *const x[3] = {s->x + 3 * s->facet[3 * facet], s->x + 3 * s->facet[3 * facet + 1],
                                 s->x + 3 * s->facet[3 * facet + 2]};
  const PetscReal *a = s->x + 3 * s->edges->corner[4 * l->edge + l->from],
                  *b = s->x + 3 * s->edges->corner[4 * l->edge + 1 - l->from];
  PetscReal u[3], v[3], n[4], way[4], weight[3], t, length, edge2, inner;
  PetscInt node;
  PetscBool out;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    way[k] = b[k] - a[k];
    u[k] = x[1][k] - x[0][k];
    v[k] = x[2][k] - x[0][k];
  }
  if (!SbRayTriangle(a, way, x, &t, weight, &out) || !out || t < GRAZE || t > (clear ? 1 - GRAZE : 1 + GRAZE))
    PetscFunctionReturn(PETSC_SUCCESS);
  SbCross(u, v, n);
  length = PetscSqrtReal(SbDot3(n, n));
  edge2 = SbDot3(way, way);
  inner = t * t * edge2;
  if (!(length > 0) || (clear && SbDot3(n, way) < ALONG * length * PetscSqrtReal(edge2)))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 3; k++) n[k] /= length * inner;
  n[3] = 1 / inner;
  for (int q = 0; q < 2; q++) { /* of CR and DG both facets; what is outside does not take it */
    if (of_vertices(c, l->edge) && q != l->from) continue;
    node = c->surface->edge_carrier[2 * l->edge + q];
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

/*
  Edges that may leave a part: from an end inside to one that is not, with P1; of CR and DG, which do not know their ends, those of facets
  inside, both ways. Listed in leaving[], room for 4 w->n.
*/
static PetscErrorCode find_leaving(const Collision *c, Ways *w, PetscInt *n, Leaving leaving[])
{
  const SbContactSurface f = c->surface;
  const PetscReal *end;
  PetscReal *inside;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(w->known));
  PetscCall(VecGetArray(w->known, &inside));
  for (PetscInt i = 0; i < f->scene.npoint; i++)
    inside[4 * f->point_node[i]] = (PetscReal)(c->way_part[i] + 1);
  PetscCall(VecRestoreArray(w->known, &inside));
  PetscCall(bring_ends(w));
  PetscCall(VecGetArrayRead(w->ends, &end));
  *n = 0;
  for (PetscInt i = 0; i < w->n; i++) {
    const PetscInt part[2] = {(PetscInt)end[8 * i] - 1, (PetscInt)end[8 * i + 4] - 1};

    for (int q = 0; q < 2; q++) {
      if (part[q] < 0 || (part[0] == part[1] && (q || of_vertices(c, i)))) continue;
      leaving[(*n)++] = (Leaving){i, part[q], q};
      if (!of_vertices(c, i)) leaving[(*n)++] = (Leaving){i, part[q], 1 - q};
    }
  }
  PetscCall(VecRestoreArrayRead(w->ends, &end));
  PetscCall(VecZeroEntries(w->known));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* These edges against all facets of the parts: few of the one, and seldom. In its own part an edge meets its neighbours at its ends, which does not count. */
static PetscErrorCode find_entries(const Collision *c, PetscBool clear, Ways *w)
{
  const SbDetectScene *s = &c->surface->scene;
  Leaving *leaving;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(4 * w->n, &leaving));
  PetscCall(find_leaving(c, w, &n, leaving));
  PetscCall(VecZeroEntries(w->sum));
  for (PetscInt f = 0; f < s->nfacet && n; f++) {
    PetscReal low[3], high[3];

    for (int k = 0; k < 3; k++) {
      const PetscReal a = s->x[3 * s->facet[3 * f] + k], b = s->x[3 * s->facet[3 * f + 1] + k],
                      d = s->x[3 * s->facet[3 * f + 2] + k], slack = GRAZE * c->reach;

      low[k] = PetscMin(a, PetscMin(b, d)) - slack;
      high[k] = PetscMax(a, PetscMax(b, d)) + slack;
    }
    for (PetscInt j = 0; j < n; j++) {
      const PetscInt *corner = s->edges->corner + 4 * leaving[j].edge;

      if (leaving[j].part == s->facet_part[f] &&
          !apart(s->x + 3 * corner[0], s->x + 3 * corner[1], low, high))
        PetscCall(add_entry(c, &leaving[j], f, clear, w->sum));
    }
  }
  PetscCall(PetscFree(leaving));
  PetscCall(VecAssemblyBegin(w->sum));
  PetscCall(VecAssemblyEnd(w->sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those that are there already. */
static PetscErrorCode know_ways(const Collision *c, Ways *w)
{
  PetscReal *known;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(w->known, &known));
  for (PetscInt i = 0; i < c->surface->scene.npoint; i++) {
    const PetscReal *way = c->way + 3 * i;
    PetscReal *to = known + 4 * c->surface->point_node[i];

    for (int k = 0; k < 3; k++) to[k] = way[k];
    to[3] = SbDot3(way, way) > 0;
  }
  PetscCall(VecRestoreArray(w->known, &known));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points inside that have none take the way that their sum says; how many on all ranks. */
static PetscErrorCode take_ways(const Collision *c, Ways *w, PetscInt *n)
{
  const SbContactSurface f = c->surface;
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

/*
  The separation directions for the points inside c->way_part; those that get none are in no part afterwards. First by edges that go through a facet. Where
  surfaces have planes in common, or nearly, edges run along facets or end on them, which tells less: only what has got no way by then goes by these.
*/
static PetscErrorCode find_ways(Collision *c)
{
  const PetscInt npoint = c->surface->scene.npoint;
  PetscInt n;
  Ways w;

  PetscFunctionBeginUser;
  PetscCall(create_ways(c, &w));
  for (int pass = 0; pass < 2; pass++) {
    PetscCall(find_entries(c, (PetscBool)!pass, &w));
    PetscCall(know_ways(c, &w));
    PetscCall(take_ways(c, &w, &n));
    do {
      PetscCall(spread(&w));
      PetscCall(take_ways(c, &w, &n));
    } while (n > 0);
  }
  PetscCall(destroy_ways(&w));
  for (PetscInt i = 0; i < npoint; i++) {
    if (!(SbDot3(c->way + 3 * i, c->way + 3 * i) > 0)) c->way_part[i] = -1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ how deep */

/* How many points on all ranks have a pair along their separation direction. */
static PetscErrorCode count_led(const Collision *c, PetscInt *n)
{
  PetscFunctionBeginUser;
  *n = 0;
  for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++)
    *n += c->way && c->way_part[c->hit[i].point] == c->hit[i].part;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 1, MPIU_INT, MPI_SUM, c->surface->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Two bodies, one with points inside the other that have no separation direction, of which the last search found no pair: a nbody + b, the same on all ranks;
  -1: none. What came in where the effect does not have the surface of the other is none of its business.
*/
static PetscErrorCode find_unmet(const Collision *c, const PetscInt inside[], PetscInt *unmet)
{
  const SbDetectScene *s = &c->surface->scene;
  const PetscInt nbody = c->surface->space->mesh->nbody;
  PetscInt(*count)[2]; /* [nbody][nbody] points of the first in the second, and pairs of the two */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(nbody * nbody, &count));
  for (PetscInt i = 0; i < s->npoint; i++) {
    if (inside[i] >= 0 && inside[i] != s->point_part[i] && c->whole[inside[i]] && c->way_part[i] != inside[i])
      count[s->point_part[i] * nbody + inside[i]][0]++;
  }
  for (PetscInt i = 0; i < c->nhit; i++) {
    const PetscInt a = SbCollisionFirst(c, &c->hit[i]), b = c->hit[i].body;

    count[a * nbody + b][1]++;
    count[b * nbody + a][1]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)(2 * nbody * nbody), MPIU_INT, MPI_SUM,
                             c->surface->space->comm));
  *unmet = -1;
  for (PetscInt i = 0; i < nbody * nbody && *unmet < 0; i++) {
    if (count[i][0] && !count[i][1]) *unmet = i;
  }
  PetscCall(PetscFree(count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is in a body without a separation direction: an error when a run begins. Within a run it was searched for as far as it goes, and may come out by itself. */
static PetscErrorCode tell_unmet(SbEffect e, const PetscInt inside[], PetscInt unmet, PetscBool begins)
{
  const Collision *c = (const Collision *)e->data;
  const SbDetectScene *s = &c->surface->scene;
  const SbMesh mesh = c->surface->space->mesh;
  const char *in = mesh->body[unmet / mesh->nbody].name, *out = mesh->body[unmet % mesh->nbody].name;
  PetscReal x[3] = {-PETSC_MAX_REAL, -PETSC_MAX_REAL, -PETSC_MAX_REAL};
  PetscMPIInt rank, first = INT_MAX;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(c->surface->space->comm, &rank));
  for (PetscInt i = 0; i < s->npoint && first == INT_MAX; i++) {
    if (s->point_part[i] * mesh->nbody + inside[i] != unmet || inside[i] < 0) continue;
    first = rank;
    PetscCall(PetscArraycpy(x, s->p + 3 * i, 3));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, c->surface->space->comm));
  PetscCallMPI(MPI_Bcast(x, 3, MPIU_REAL, first, c->surface->space->comm));
  PetscCheck(
    !begins, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "body %s lies inside body %s, at (%g, %g, %g) m, deeper than %g m below its surface: -effect_%s_type "
    "collision cannot tell which way it came in; move one of them (-body_%s_translate), or name sets of "
    "one of them only (-effect_%s_on)",
    in, out, (double)x[0], (double)x[1], (double)x[2], (double)(BLIND * c->reach), e->name, in, e->name);
  PetscCall(SbWarning(
    c->surface->space->comm,
    "the effect %s: body %s has points inside body %s, at (%g, %g, %g) m, and sees no separation direction "
    "of it; shorter steps (-ts_dt) keep bodies from getting there",
    e->name, in, out, (double)x[0], (double)x[1], (double)x[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points in tets, and how many on all ranks, without those that lie in contact: the nearest place is their separation direction. */
static PetscErrorCode find_inside(const Collision *c, const PetscReal u[], PetscInt inside[], PetscInt *n)
{
  PetscFunctionBeginUser;
  PetscCall(SbInsideFind(c->inside, u, c->self, inside));
  *n = 0;
  for (PetscInt i = 0, j = 0; i < c->surface->scene.npoint; i++) {
    const PetscBool led = (PetscBool)(c->way && c->way_part[i] >= 0 && c->way_part[i] == inside[i]);
    PetscBool lies = PETSC_FALSE;

    for (; j < c->nhit && c->hit[j].point <= i; j++) {
      if (c->hit[j].point == i && c->hit[j].part == inside[i] && c->hit[j].gap >= -SHALLOW * c->reach)
        lies = PETSC_TRUE;
    }
    if (lies && !led) inside[i] = -1;
    *n += inside[i] >= 0;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, n, 1, MPIU_INT, MPI_SUM, c->surface->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Looks twice as far as long as half of it is not yet as deep as what was found, ends of ways are still found, or `blind` m are not reached. */
static PetscErrorCode look_deeper(Collision *c, const PetscReal u[], PetscReal blind)
{
  PetscReal range = PetscMax(c->reach, c->deep), deepest;
  PetscInt led, before = 0;

  PetscFunctionBeginUser;
  PetscCall(deepest_of(c, &deepest));
  PetscCall(count_led(c, &led));
  while (range < c->surface->size && (2 * deepest > range || range < blind || led > before)) {
    before = led;
    c->deep = range *= 2;
    PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
    PetscCall(deepest_of(c, &deepest));
    PetscCall(count_led(c, &led));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points inside that are not constrained along the way that they have, which was out of another part, or leads nowhere any more, have none. */
static void forget_ways(const Collision *c, const PetscInt inside[])
{
  const PetscInt npoint = c->surface->scene.npoint;

  for (PetscInt i = 0, j = 0; i < npoint; i++) {
    PetscBool held = PETSC_FALSE;

    for (; j < c->nhit && c->hit[j].point <= i; j++) {
      if (c->hit[j].point == i && c->hit[j].part == c->way_part[i] && c->hit[j].gap < 0) held = PETSC_TRUE;
    }
    if (inside[i] < 0 || held) continue;
    c->way_part[i] = -1;
    c->way[3 * i] = c->way[3 * i + 1] = c->way[3 * i + 2] = 0;
  }
}

/*
  The separation directions of what points in tets are in; and those at the rim of it, which lie on its surface and have pairs behind. Ways that are
  there from before stay while they lead something out.
*/
static PetscErrorCode lead_out(Collision *c, const PetscReal u[], const PetscInt inside[])
{
  const PetscInt npoint = c->surface->scene.npoint;

  PetscFunctionBeginUser;
  if (!c->way) {
    PetscCall(PetscCalloc2(3 * npoint, &c->way, npoint, &c->way_part));
    for (PetscInt i = 0; i < npoint; i++) c->way_part[i] = -1;
  }
  forget_ways(c, inside);
  for (PetscInt i = 0; i < npoint; i++) {
    if (c->way_part[i] < 0) c->way_part[i] = inside[i];
  }
  for (PetscInt i = 0; i < c->nhit && !SbCollisionOfEdges(c, &c->hit[i]); i++) {
    if (c->hit[i].gap < -SHALLOW * c->reach && c->way_part[c->hit[i].point] < 0)
      c->way_part[c->hit[i].point] = c->hit[i].part;
  }
  PetscCall(find_ways(c));
  PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
  PetscCall(look_deeper(c, u, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Ways lead out at any depth. Where surfaces do not go through each other (faces that lie in one plane, a body in another) nearest places have to do, up
  to a few layers of cells.
*/
PetscErrorCode SbCollisionFindOverlap(SbEffect e, const PetscReal u[])
{
  Collision *c = (Collision *)e->data;
  const PetscBool begins = (PetscBool)!c->begun;
  PetscInt *inside, n, unmet;

  PetscFunctionBeginUser;
  c->begun = PETSC_TRUE;
  PetscCall(SbCollisionLook(c, u, PETSC_FALSE));
  PetscCall(PetscMalloc1(c->surface->scene.npoint, &inside));
  PetscCall(find_inside(c, u, inside, &n));
  if (n) {
    PetscCall(look_deeper(c, u, BLIND * c->reach));
    PetscCall(lead_out(c, u, inside));
    PetscCall(find_unmet(c, inside, &unmet));
    if (unmet >= 0) PetscCall(tell_unmet(e, inside, unmet, begins));
  }
  PetscCall(PetscFree(inside));
  PetscCall(SbCollisionFollowOverlap(c));
  c->nhit = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCollisionFollowOverlap(Collision *c)
{
  PetscReal deepest;

  PetscFunctionBeginUser;
  if (!(c->deep > 0)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(deepest_of(c, &deepest));
  c->deep = deepest > SHALLOW * c->reach ? PetscMin(c->deep, 2 * deepest) : 0;
  if (c->deep == 0) PetscCall(PetscFree2(c->way, c->way_part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ while a run goes on */

PetscErrorCode SbCollisionWatchInside(SbEffect e, PetscReal t, const PetscReal u[])
{
  Collision *c = (Collision *)e->data;
  const PetscInt npoint = c->surface->scene.npoint;
  PetscInt *inside, late = 0;

  PetscFunctionBeginUser;
  if ((!c->close && !c->self) || t == c->watched) PetscFunctionReturn(PETSC_SUCCESS);
  c->watched = t;
  PetscCall(PetscMalloc1(npoint, &inside));
  PetscCall(SbInsideFind(c->inside, u, c->self, inside));
  for (PetscInt i = 0, j = 0; i < npoint; i++) {
    PetscBool held = PETSC_FALSE;

    for (; j < c->npast && c->past[j].point <= i; j++) {
      if (c->past[j].point == i && c->past[j].part == inside[i]) held = PETSC_TRUE;
    }
    if (inside[i] < 0 || held || !SbCollisionLooksFor(c, c->surface->scene.point_part[i], inside[i]))
      c->alone[i] = 0;
    else if (++c->alone[i] == PATIENCE)
      late = 1;
  }
  PetscCall(PetscFree(inside));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &late, 1, MPIU_INT, MPI_MAX, c->surface->space->comm));
  if (!late) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < npoint; i++) {
    if (c->alone[i] == PATIENCE) c->alone[i] = -AGAIN;
  }
  PetscCall(SbCollisionFindOverlap(e, u));
  PetscFunctionReturn(PETSC_SUCCESS);
}
