/*
  contact_pairs.c - which features of the surfaces may meet, how near they are, and how far they may go.

  Search. Each vertex has a box around its motion, grown by a margin; those of edges and triangles hold the boxes of their vertices. Trees of
  boxes give all pairs of a vertex and a triangle, and of two edges, whose boxes are within the reach. They stay valid while every vertex stays in its box: iterations that move
  little, and most do, search for nothing.

  Safe part of a motion. Additive continuous collision detection (Li, Kaufman and Jiang, "Codimensional incremental potential contact", ACM TOG 40(4), 2021,
  section 5; src/geometry/ccd.c) leaves a tenth of each gap. A half-space and a bowl have roots of quadratic polynomials.
*/
#include "sbbarrier.h"
#include "sbgeometry.h"
#include "sblog.h"

#define LEFT 0.1 /* of its gap that a pair keeps at least */

static inline void places(const SbContactPair *pair, const PetscReal x[], PetscReal at[12])
{
  for (int k = 0; k < 12; k++) at[k] = x[3 * pair->v[k / 3] + k % 3];
}

static inline PetscReal radius_of(SbContactMesh m, const SbContactPair *pair)
{
  return pair->v[0] >= m->nbody_vertex || pair->v[2] >= m->nbody_vertex ? m->radius : 0.;
}

PetscReal SbContactPairGap(SbContactMesh m, const SbContactPair *pair, const PetscReal x[], SbDistance *g)
{
  PetscReal at[12], r[3], length;

  places(pair, x, at);
  if (!pair->side) {
    SbDistanceFind(pair->kind, at, g);
    return g->d - radius_of(m, pair);
  }
  /* the obstacle's vertices 1 and 2: a point of the plane and the tip of the normal there, or the centre of the bowl */
  g->weight[0] = 1.;
  g->weight[1] = -1.;
  g->weight[2] = g->weight[3] = 0.;
  for (int i = 0; i < 3; i++) {
    r[i] = at[i] - at[3 + i];
    g->n[i] = m->side == SB_SIDE_PLANE ? at[6 + i] - at[3 + i] : -r[i];
  }
  length = PetscSqrtReal(SbDot3(g->n, g->n));
  for (int i = 0; i < 3; i++) g->n[i] = length > 0. ? g->n[i] / length : 0.;
  g->d = m->side == SB_SIDE_PLANE ? SbDot3(g->n, r) : m->radius - length;
  return g->d;
}

/* ------------------------------------------------------------------ search */

typedef struct {
  SbContactPairs pairs;
  PetscInt item;    /* that the pairs below are of */
  PetscBool vertex; /* item is a vertex, and triangles are met; else a triangle, and vertices other[] are */
  const PetscInt *other;
} Query;

static PetscErrorCode add_pair(SbContactPairs p, const SbContactPair *pair)
{
  PetscFunctionBeginUser;
  if (p->n == p->size) {
    p->size = PetscMax(256, 2 * p->size);
    PetscCall(PetscRealloc((size_t)p->size * sizeof(*p->pair), &p->pair));
  }
  p->pair[p->n++] = *pair;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether features of a and b may meet at all: of different parts or self-contact, not both driven or the obstacle's. */
static inline PetscBool wanted(SbContactPairs p, PetscInt a, PetscInt b)
{
  const SbContactMesh m = p->mesh;

  return (PetscBool)(m->part[a] != m->part[b] ? p->others || m->part[a] == m->space->mesh->nbody ||
                                                  m->part[b] == m->space->mesh->nbody
                                              : p->self && a < m->nbody_vertex);
}

static PetscErrorCode add_vertex_triangle(const Query *from, PetscInt met)
{
  const SbContactPairs p = from->pairs;
  const SbContactMesh m = p->mesh;
  const PetscInt v = from->vertex ? from->item : from->other[met],
                 *tri = m->triangle + 3 * (from->vertex ? met : from->item);
  SbContactPair pair = {.kind = SB_PAIR_VERTEX_TRIANGLE, .v = {v, tri[0], tri[1], tri[2]}};

  PetscFunctionBeginUser;
  if (v == tri[0] || v == tri[1] || v == tri[2] || !wanted(p, v, tri[0])) PetscFunctionReturn(PETSC_SUCCESS);
  if (m->driven[v] && m->driven[tri[0]] && m->driven[tri[1]] && m->driven[tri[2]])
    PetscFunctionReturn(PETSC_SUCCESS);
  if (v < m->nbody_vertex)
    pair.area = m->area[v];
  else
    pair.area = (m->area[tri[0]] + m->area[tri[1]] + m->area[tri[2]]) / 3.;
  PetscCall(add_pair(p, &pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_edge_edge(const Query *from, PetscInt f)
{
  const SbContactPairs p = from->pairs;
  const SbContactMesh m = p->mesh;
  const PetscInt e = from->item, low = PetscMin(e, f), high = PetscMax(e, f), *a = m->edge + 2 * low,
                 *b = m->edge + 2 * high;
  SbContactPair pair = {.kind = SB_PAIR_EDGE_EDGE, .v = {a[0], a[1], b[0], b[1]}};

  PetscFunctionBeginUser;
  /* once, by the lower one where both are of this rank */
  if (f <= e && (f == e || m->mine[m->edge[2 * f]] || m->mine[m->edge[2 * f + 1]]))
    PetscFunctionReturn(PETSC_SUCCESS);
  if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1] || !wanted(p, a[0], b[0]))
    PetscFunctionReturn(PETSC_SUCCESS);
  if (m->driven[a[0]] && m->driven[a[1]] && m->driven[b[0]] && m->driven[b[1]])
    PetscFunctionReturn(PETSC_SUCCESS);
  if (b[0] >= m->nbody_vertex)
    pair.area = m->edge_area[low];
  else
    pair.area = 0.5 * (m->edge_area[low] + m->edge_area[high]);
  PetscCall(add_pair(p, &pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsCreate(SbContactMesh mesh, PetscBool self, PetscBool others, PetscReal reach,
                                    SbContactPairs *pairs)
{
  PetscFunctionBeginUser;
  PetscCall(PetscNew(pairs));
  (*pairs)->mesh = mesh;
  (*pairs)->self = self;
  (*pairs)->others = others;
  (*pairs)->reach = reach;
  (*pairs)->margin = 2. * reach;
  PetscCall(PetscMalloc1(6 * mesh->nvertex, &(*pairs)->box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsDestroy(SbContactPairs *pairs)
{
  PetscFunctionBeginUser;
  if (!*pairs) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*pairs)->box));
  PetscCall(PetscFree((*pairs)->pair));
  PetscCall(PetscFree(*pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all vertices stay where the pairs were searched for. */
static PetscBool still_within(SbContactPairs p, const PetscReal x0[], const PetscReal x1[])
{
  for (PetscInt k = 0; k < 3 * p->mesh->nvertex; k++) {
    const PetscReal *box = p->box + 6 * (k / 3) + k % 3;

    if (!(x0[k] >= box[0] && x0[k] <= box[3] && x1[k] >= box[0] && x1[k] <= box[3])) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Boxes of n features of `size` vertices each, grown by half the reach. */
static PetscErrorCode make_boxes(SbContactPairs p, PetscInt n, PetscInt size, const PetscInt vertex[],
                                 PetscReal (**box)[6])
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, box));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal grown =
      0.5 * p->reach + (vertex[size * i] < p->mesh->nbody_vertex ? 0. : p->mesh->radius);

    SbBoxClear((*box)[i]);
    for (PetscInt k = 0; k < size; k++) SbBoxMerge((*box)[i], p->box + 6 * vertex[size * i + k]);
    for (int k = 0; k < 3; k++) {
      (*box)[i][k] -= grown;
      (*box)[i][3 + k] += grown;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsFind(SbContactPairs p, const PetscReal x0[], const PetscReal x1[])
{
  const SbContactMesh m = p->mesh;
  PetscReal(*vertex)[6], (*edge)[6], (*triangle)[6];
  PetscInt *every, *other, nother = 0;
  Query from = {.pairs = p};
  PetscInt met;
  SbBoxQuery query;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  if (p->known && still_within(p, x0, x1)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  p->known = PETSC_TRUE;
  p->nsearch++;
  p->n = 0;
  for (PetscInt v = 0; v < m->nvertex; v++) {
    PetscReal *box = p->box + 6 * v;

    SbBoxClear(box);
    SbBoxAdd(box, x0 + 3 * v);
    SbBoxAdd(box, x1 + 3 * v);
    for (int k = 0; k < 3; k++) {
      box[k] -= p->margin;
      box[3 + k] += p->margin;
    }
  }
  PetscCall(PetscMalloc1(m->nvertex, &every));
  for (PetscInt v = 0; v < m->nvertex; v++) every[v] = v;
  PetscCall(make_boxes(p, m->nvertex, 1, every, &vertex));
  PetscCall(make_boxes(p, m->ntriangle, 3, m->triangle, &triangle));
  PetscCall(make_boxes(p, m->nedge, 2, m->edge, &edge));
  PetscCall(PetscFree(every));

  /* vertices of this rank and all triangles */
  PetscCall(SbBoxTreeCreate(m->ntriangle, (const PetscReal(*)[6])triangle, &tree));
  from.vertex = PETSC_TRUE;
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    from.item = v;
    if (!m->mine[v]) continue;
    for (SbBoxQueryBegin(&tree, vertex[v], &query); SbBoxQueryNext(&query, &met);)
      PetscCall(add_vertex_triangle(&from, met));
  }
  PetscCall(SbBoxTreeDestroy(&tree));

  /* other vertices, those of other ranks and of the obstacle, and triangles of this rank */
  PetscCall(PetscMalloc1(m->nvertex, &other));
  for (PetscInt v = 0; v < (m->side == SB_SIDE_NONE ? m->nvertex : m->nbody_vertex); v++) {
    if (m->mine[v]) continue;
    PetscCall(PetscArraycpy(vertex[nother], vertex[v], 6));
    other[nother++] = v;
  }
  from.vertex = PETSC_FALSE;
  from.other = other;
  PetscCall(SbBoxTreeCreate(nother, (const PetscReal(*)[6])vertex, &tree));
  for (PetscInt t = 0; t < m->nbody_triangle && nother; t++) {
    const PetscInt *v = m->triangle + 3 * t;

    from.item = t;
    if (!m->mine[v[0]] && !m->mine[v[1]] && !m->mine[v[2]]) continue;
    for (SbBoxQueryBegin(&tree, triangle[t], &query); SbBoxQueryNext(&query, &met);)
      PetscCall(add_vertex_triangle(&from, met));
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(other));

  /* edges of this rank and all edges */
  PetscCall(SbBoxTreeCreate(m->nedge, (const PetscReal(*)[6])edge, &tree));
  for (PetscInt e = 0; e < m->nedge; e++) {
    from.item = e;
    if (!m->mine[m->edge[2 * e]] && !m->mine[m->edge[2 * e + 1]]) continue;
    for (SbBoxQueryBegin(&tree, edge[e], &query); SbBoxQueryNext(&query, &met);)
      PetscCall(add_edge_edge(&from, met));
  }
  PetscCall(SbBoxTreeDestroy(&tree));

  /* a half-space or a bowl: vertices whose boxes come near */
  for (PetscInt v = 0; v < m->nbody_vertex && m->side != SB_SIDE_NONE; v++) {
    SbContactPair pair = {
      .side = PETSC_TRUE, .v = {v, m->nbody_vertex, m->nvertex - 1, v}, .area = m->area[v]};
    PetscReal way = 0., away;
    SbDistance g;

    if (!m->mine[v] || m->driven[v]) continue;
    for (int i = 0; i < 3; i++)
      way +=
        PetscSqr(x1[3 * v + i] - x0[3 * v + i] - x1[3 * m->nbody_vertex + i] + x0[3 * m->nbody_vertex + i]);
    away =
      PetscMin(SbContactPairGap(m, &pair, x0, &g), SbContactPairGap(m, &pair, x1, &g)) - PetscSqrtReal(way);
    if (away < p->reach + 4. * p->margin) PetscCall(add_pair(p, &pair));
  }
  PetscCall(PetscFree(vertex));
  PetscCall(PetscFree(triangle));
  PetscCall(PetscFree(edge));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ safe part of a motion */

/* The first time in (0, 1] at which a t^2 + b t + c, positive at 0, is zero; 1 + : none. */
static PetscReal first_root(PetscReal a, PetscReal b, PetscReal c)
{
  const PetscReal disc = b * b - 4. * a * c;
  PetscReal t = 2.;

  if (disc < 0.) return t;
  /* the root without cancellation; with c > 0 the smaller positive one is 2 c / (-b + root) where b < 0, and where a < 0 (-b - root) / 2 a */
  if (b < 0.)
    t = 2. * c / (-b + PetscSqrtReal(disc));
  else if (a < 0.)
    t = (-b - PetscSqrtReal(disc)) / (2. * a);
  return t;
}

/* The part of the way that is safe for one pair. */
static PetscReal safe_part(SbContactMesh m, const SbContactPair *pair, const PetscReal x0[],
                           const PetscReal x1[])
{
  PetscReal a[12], b[12], r0[3], dr[3], n0[3], dn[3], left, part = 1.;
  SbDistance g;

  places(pair, x0, a);
  places(pair, x1, b);
  if (!pair->side) {
    const SbCCDLimits limits = {.radius = radius_of(m, pair), .keep = LEFT};

    (void)SbTimeOfImpact(pair->kind, a, b, &limits, &part);
    return part;
  }
  left = LEFT * SbContactPairGap(m, pair, x0, &g);
  for (int i = 0; i < 3; i++) {
    r0[i] = a[i] - a[3 + i];
    dr[i] = b[i] - b[3 + i] - r0[i];
    n0[i] = a[6 + i] - a[3 + i];
    dn[i] = b[6 + i] - b[3 + i] - n0[i];
  }
  if (m->side == SB_SIDE_PLANE)
    part = first_root(SbDot3(dn, dr), SbDot3(n0, dr) + SbDot3(dn, r0), SbDot3(n0, r0) - left);
  else
    part = first_root(-SbDot3(dr, dr), -2. * SbDot3(r0, dr), PetscSqr(m->radius - left) - SbDot3(r0, r0));
  return PetscMin(1., part);
}

PetscErrorCode SbContactPairsSafe(SbContactPairs p, const PetscReal x0[], const PetscReal x1[],
                                  PetscReal *part, PetscInt *worst)
{
  const SbContactMesh m = p->mesh;

  PetscFunctionBeginUser;
  PetscCall(SbContactPairsFind(p, x0, x1));
  *part = 1.;
  *worst = -1;
  for (PetscInt i = 0; i < p->n; i++) {
    const SbContactPair *pair = &p->pair[i];
    PetscReal t;

    if (!m->own[pair->v[0]] && !(pair->v[0] >= m->nbody_vertex && m->own[pair->v[1]])) continue;
    t = safe_part(m, pair, x0, x1);
    if (t < *part) {
      *part = t;
      *worst = i;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
