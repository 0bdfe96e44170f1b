/*
  edge_find.c - pairs of a sharp edge and one that is at least bent: which edges are that now, candidates by the detector's own kind, then
  edge_meet.c.

  Sharp edges are usually few: the kind searches a scene of its own in which own sharp edges are the points and all edges that are not flat are
  facets without area, with boxes that hold their motion. On a smooth surface the whole cost is one examine each edge.
*/
#include "detect.h"
#include "edge.h"

#define SELF_REACH 2 /* in reaches: what is nearer at rest is no self-contact (near.c) */

struct SbDetectSharp {
  SbDetector search; /* of the same kind, for candidates */
  SbDetectScene scene;
  PetscInt version; /* of the scene that was given last */
  SbEdgeKind *kind; /* of all edges of the scene, if one is sharp */
  PetscInt kind_size;
  PetscInt n, nown, size;    /* edges that are not flat, own sharp ones first; how many those are; room */
  PetscInt *edge;            /* [n] which ones */
  PetscInt *facet, *vertex;  /* [n][3] ends, the second one twice */
  PetscInt *id;              /* [n] */
  PetscInt *part, *own_part; /* [n], [nown]; for self-contact they differ, so that all meet */
  PetscInt *none;            /* [n] -1: points that are no vertices */
  PetscReal *middle;         /* [nown][3] m */
  SbEdgePlace *place;        /* [n] */
  SbEdgePair *pair;
  PetscInt pair_size;
};
typedef struct SbDetectSharp Sharp;

static PetscErrorCode sharp_free(Sharp *q)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree7(q->edge, q->facet, q->vertex, q->id, q->part, q->own_part, q->none));
  PetscCall(PetscFree2(q->middle, q->place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectSharpDestroy(SbDetector d)
{
  PetscFunctionBeginUser;
  if (!d->sharp) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbDetectorDestroy(&d->sharp->search));
  PetscCall(sharp_free(d->sharp));
  PetscCall(PetscFree(d->sharp->kind));
  PetscCall(PetscFree(d->sharp->pair));
  PetscCall(PetscFree(d->sharp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static SbEdgeKind kind_of(const SbDetectScene *s, PetscInt i)
{
  const PetscInt *c = s->edges->corner + 4 * i;
  const PetscReal *const x[4] = {s->x + 3 * c[0], s->x + 3 * c[1], s->x + 3 * c[2], s->x + 3 * c[3]};

  return SbEdgeKindOf(x);
}

/* Room for n edges; those there are kept. */
static PetscErrorCode reserve(Sharp *q, PetscInt n)
{
  const PetscInt size = n + n / 2 + 64;
  PetscInt *edge;

  PetscFunctionBeginUser;
  if (n <= q->size) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(q->n, &edge));
  PetscCall(PetscArraycpy(edge, q->edge, q->n));
  PetscCall(sharp_free(q));
  PetscCall(PetscMalloc7(size, &q->edge, 3 * size, &q->facet, 3 * size, &q->vertex, size, &q->id, size,
                         &q->part, size, &q->own_part, size, &q->none));
  PetscCall(PetscMalloc2(3 * size, &q->middle, size, &q->place));
  PetscCall(PetscArraycpy(q->edge, edge, q->n));
  PetscCall(PetscFree(edge));
  q->size = size;
  for (PetscInt i = 0; i < size; i++) q->none[i] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add(Sharp *q, PetscInt i, PetscInt *n, PetscBool *same)
{
  PetscFunctionBeginUser;
  if (*n >= q->size) {
    q->n = PetscMax(q->n, *n);
    PetscCall(reserve(q, *n + 1));
  }
  if (*n >= q->n || q->edge[*n] != i) *same = PETSC_FALSE;
  q->edge[(*n)++] = i;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The own sharp edges, then all others that are not flat; none if no own one is sharp. Whether they are those of the last call. */
static PetscErrorCode list_sharp(Sharp *q, const SbDetectScene *s, PetscBool *same)
{
  const SbEdges *e = s->edges;
  const PetscInt before = q->n, before_own = q->nown;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  *same = (PetscBool)(q->version == s->version);
  if (e->n > q->kind_size) {
    PetscCall(PetscFree(q->kind));
    PetscCall(PetscMalloc1(e->n, &q->kind));
    q->kind_size = e->n;
  }
  for (PetscInt i = 0; i < e->nown; i++) {
    q->kind[i] = kind_of(s, i);
    if (q->kind[i] == SB_EDGE_SHARP) PetscCall(add(q, i, &n, same));
  }
  q->nown = n;
  for (PetscInt i = 0; i < e->n && q->nown; i++) {
    if (i >= e->nown) q->kind[i] = kind_of(s, i);
    if (q->kind[i] == SB_EDGE_BENT || (q->kind[i] == SB_EDGE_SHARP && i >= e->nown))
      PetscCall(add(q, i, &n, same));
  }
  q->n = n;
  if (n != before || q->nown != before_own) *same = PETSC_FALSE;
  q->version = s->version;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene in which candidates are searched. */
static void describe(Sharp *q, const SbDetectScene *s, PetscBool same)
{
  const SbEdges *e = s->edges;

  for (PetscInt j = 0; j < q->n; j++) {
    const PetscInt i = q->edge[j], *c = e->corner + 4 * i;

    for (int k = 0; k < 3; k++) {
      q->facet[3 * j + k] = c[k > 0];
      q->vertex[3 * j + k] = e->vertex[2 * i + (k > 0)];
    }
    q->id[j] = e->id[i];
    q->part[j] = s->self ? 2 * e->part[i] + 1 : e->part[i];
    if (j < q->nown) {
      q->own_part[j] = s->self ? 2 * e->part[i] : e->part[i];
      for (int k = 0; k < 3; k++) q->middle[3 * j + k] = 0.5 * (s->x[3 * c[0] + k] + s->x[3 * c[1] + k]);
    }
    q->place[j].thick = e->thick[i];
    for (int k = 0; k < 4; k++) q->place[j].x[k] = s->x + 3 * c[k];
    for (int k = 0; k < 2; k++) q->place[j].x0[k] = s->x0 ? s->x0 + 3 * c[k] : NULL;
    SbEdgeInto(&q->place[j]);
  }
  q->scene = (SbDetectScene){.ncorner = s->ncorner,
                             .x = s->x,
                             .X = s->X,
                             .nfacet = q->n,
                             .facet = q->facet,
                             .facet_vertex = q->vertex,
                             .facet_part = q->part,
                             .facet_id = q->id,
                             .npoint = q->nown,
                             .p = q->middle,
                             .P = q->middle,
                             .p_normal = q->middle,
                             .point_part = q->own_part,
                             .point_id = q->id,
                             .point_vertex = q->none,
                             .point_facet = q->id,
                             .reach = s->reach,
                             .version = q->scene.version + !same};
}

static void box_of(const SbEdgePlace *place, PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = PetscMin(place->x[0][k], place->x[1][k]);
    box[3 + k] = PetscMax(place->x[0][k], place->x[1][k]);
    for (int i = 0; i < 2 && place->x0[0]; i++) {
      box[k] = PetscMin(box[k], place->x0[i][k]);
      box[3 + k] = PetscMax(box[3 + k], place->x0[i][k]);
    }
  }
}

static PetscErrorCode search(Sharp *q)
{
  SbDetector d = q->search;

  PetscFunctionBeginUser;
  PetscCall(SbDetectBegin(d, &q->scene));
  for (PetscInt j = 0; j < q->n; j++) {
    PetscReal *box = d->facet_box + 6 * j;

    box_of(&q->place[j], box);
    if (j < q->nown) PetscCall(PetscArraycpy(d->point_box + 6 * j, box, 6));
    SbBoxGrow(q->scene.reach, box);
  }
  PetscCall(SbDetectCandidates(d, &q->scene));
  d->version = q->scene.version;
  d->nfacet = q->scene.nfacet;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two edges of one part are too close by nature for self-contact. */
static PetscBool belong_together(const SbDetectScene *s, PetscInt i, PetscInt j)
{
  const SbEdges *e = s->edges;
  const PetscInt *a = e->corner + 4 * i, *b = e->corner + 4 * j, *v = e->vertex + 2 * i,
                 *w = e->vertex + 2 * j;
  const PetscReal *const p[2] = {s->X + 3 * a[0], s->X + 3 * a[1]}, *const q[2] = {s->X + 3 * b[0],
                                                                                   s->X + 3 * b[1]};
  const PetscReal limit = SELF_REACH * s->reach;

  if (v[0] == w[0] || v[0] == w[1] || v[1] == w[0] || v[1] == w[1]) return PETSC_TRUE;
  return (PetscBool)(SbEdgesDistance2(p, q) < limit * limit);
}

/* The last pair to its place by the identity of the second edge, among those of its first edge from `first` on. */
static void insert(const SbEdges *e, PetscInt first, PetscInt n, SbEdgePair pair[])
{
  const SbEdgePair last = pair[n];
  PetscInt j = n;

  for (; j > first && e->id[pair[j - 1].edge[1]] > e->id[last.edge[1]]; j--) pair[j] = pair[j - 1];
  pair[j] = last;
}

/* All pairs among the candidates. Each is examined once: from the sharp edge, of two from that with the lower identity. */
static PetscErrorCode narrow(Sharp *q, const SbDetectScene *s, PetscInt *n)
{
  const SbDetector d = q->search;
  const SbEdges *e = s->edges;

  PetscFunctionBeginUser;
  *n = 0;
  for (PetscInt j = 0; j < q->nown; j++) {
    const PetscInt i = q->edge[j], first = *n;

    if (*n + d->start[j + 1] - d->start[j] > q->pair_size) {
      q->pair_size = 2 * *n + d->start[j + 1] - d->start[j] + 64;
      PetscCall(PetscRealloc(sizeof(*q->pair) * (size_t)q->pair_size, &q->pair));
    }
    for (PetscInt c = d->start[j]; c < d->start[j + 1]; c++) {
      const PetscInt other = d->candidate[c], k = q->edge[other];
      SbEdgePair *pair = q->pair + *n;

      if ((q->kind[k] == SB_EDGE_SHARP && e->id[i] >= e->id[k]) ||
          (e->part[i] == e->part[k] && (!s->self || belong_together(s, i, k))))
        continue;
      if (!SbEdgesMeet(&q->place[j], &q->place[other], s->reach, pair)) continue;
      pair->edge[0] = i;
      pair->edge[1] = k;
      insert(e, first, (*n)++, q->pair);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectorFindEdges(SbDetector d, const SbDetectScene *s, PetscInt *n, const SbEdgePair **pair)
{
  PetscBool same;

  PetscFunctionBeginUser;
  PetscCheck(s->reach > 0 && !PetscIsInfOrNanReal(s->reach), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "the reach of contact detection is %g m: it must be positive and finite", (double)s->reach);
  *n = 0;
  *pair = NULL;
  if (!s->edges || !s->edges->nown) PetscFunctionReturn(PETSC_SUCCESS);
  if (!d->sharp) {
    PetscCall(PetscNew(&d->sharp));
    PetscCall(SbDetectorCreate(d->kind, &d->sharp->search));
  }
  PetscCall(list_sharp(d->sharp, s, &same));
  if (!d->sharp->nown) PetscFunctionReturn(PETSC_SUCCESS);
  describe(d->sharp, s, same);
  PetscCall(search(d->sharp));
  PetscCall(narrow(d->sharp, s, n));
  *pair = d->sharp->pair;
  PetscFunctionReturn(PETSC_SUCCESS);
}
