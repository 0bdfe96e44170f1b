/*
  pairs.c - pairs of features (vertex-triangle, edge-edge) that may come into contact, their
  gaps, and the collision-free part of a motion.

  Search. Each vertex has a box around its motion, grown by a margin; those of edges and triangles
  enclose the boxes of their vertices. Trees of boxes, which are refitted, give all pairs of a
  vertex and a triangle, and of two edges, whose boxes are within the reach. They stay valid while
  every vertex stays in its box: iterations that move little, as most do, need no search. A motion
  with too many pairs is halved.

  Safe part of a motion. Additive continuous collision detection (Li, Kaufman and Jiang,
  "Codimensional incremental potential contact", ACM TOG 40(4), 2021, section 5; src/geometry/ccd.c)
  leaves a tenth of each gap. A half-space and a bowl have roots of quadratic polynomials.
*/
#include "pairs.h"
#include "sbgeometry.h"

#define LEFT 0.1 /* fraction of its gap that a pair keeps at least */
#define LEFT_MOST \
  0.5 /* largest gap that is kept, over the reach: a distant pair may come within the reach at once */

static inline void places(const SbContactPair *pair, const PetscReal x[], PetscReal at[12])
{
  for (int k = 0; k < 12; k++)
    at[k] = x[3 * pair->v[k / 3] + k % 3];
}

PetscReal SbContactPairGap(SbContactSurface m, const SbContactPair *pair, const PetscReal x[],
                           SbDistance *g)
{
  PetscReal at[12], r[3], length;

  places(pair, x, at);
  if (!pair->side) {
    SbDistanceFind(pair->kind, at, g);
    return g->d - SbContactPairRadius(m, pair);
  }

  /* the obstacle's vertices 1 and 2: a point of the plane and the tip of its normal; or 1, the
     centre */
  g->weight[0] = 1.;
  g->weight[1] = -1.;
  g->weight[2] = g->weight[3] = 0.;
  for (int i = 0; i < 3; i++) {
    r[i] = at[i] - at[3 + i];
    g->n[i] = m->side == SB_SIDE_PLANE ? at[6 + i] - at[3 + i] : -r[i];
  }
  length = SbNormalise(g->n);
  g->d = m->side == SB_SIDE_PLANE ? SbDot3(g->n, r) : m->radius - length;
  return g->d;
}

#define MARGIN 0.1 /* of the mean edge: least growth of the boxes */
#define CROWD \
  200 /* a motion with more pairs than CROWD (number of vertices + CROWD_LEAST) is halved */
#define CROWD_LEAST 1000
#define CHUNK 256 /* pairs of boxes at once */

/* Features of one kind, those with a node of this rank or the others, with a tree over their
   boxes. */
enum {
  VERTEX,
  TRIANGLE,
  EDGE
};
static const int corners[] = {1, 3, 2};
struct SbContactFeatures {
  PetscInt n, *item;   /* [n] numbers in the mesh */
  PetscReal (*box)[6]; /* [n] */
  SbBoxTree tree;
};

/* Vertices of feature i; `own` is room for one. */
static inline const PetscInt *vertices_of(SbContactSurface m, int kind, PetscInt i, PetscInt *own)
{
  *own = i;
  return kind == VERTEX ? own : kind == TRIANGLE ? m->triangle + 3 * i : m->edge + 2 * i;
}

/* Whether the features of a pair stay farther apart than the reach for all positions of its
   vertices in their boxes: the distance at the centres less the largest displacement of a vertex
   from there. */
static PetscBool stays_apart(SbContactPairs p, const SbContactPair *pair)
{
  const int split = SbContactPairSplit(pair);
  PetscReal at[12];
  PetscReal far[2] = {0., 0.};
  SbDistance g;

  for (int k = 0; k < 4; k++) {
    const PetscReal *box = p->box + 6 * pair->v[k];
    PetscReal square = 0.;

    for (int i = 0; i < 3; i++) {
      at[3 * k + i] = 0.5 * (box[i] + box[3 + i]);
      square += 0.25 * PetscSqr(box[3 + i] - box[i]);
    }
    far[k >= split] = PetscMax(far[k >= split], square);
  }
  SbDistanceFind(pair->kind, at, &g);
  return (PetscBool)(g.d - SbContactPairRadius(p->mesh, pair) >
                     p->reach + PetscSqrtReal(far[0]) + PetscSqrtReal(far[1]));
}

/* Whether the features belong to an overlap (SbContactOverlap.near): such pairs are excluded. */
static inline PetscBool overlaps(SbContactPairs p, const SbContactPair *pair)
{
  const int split = SbContactPairSplit(pair);
  int near[2] = {0, 0};

  for (int k = 0; p->near && k < 4; k++)
    near[k >= split] = PetscMax(near[k >= split], p->near[pair->v[k]]);
  if (!near[0] || !near[1])
    return PETSC_FALSE;
  return (PetscBool)(split == 1 ? near[0] == SB_OVERLAP_INSIDE
                                : PetscMax(near[0], near[1]) >= SB_OVERLAP_INTERSECTED);
}

/* Adds the pair of a vertex i and a triangle j, or of two edges, if they may come into contact. */
static PetscErrorCode add_features(SbContactPairs p, SbPairKind kind, PetscInt i, PetscInt j)
{
  const SbContactSurface m = p->mesh;
  const PetscBool edges = (PetscBool)(kind == SB_PAIR_EDGE_EDGE);
  const PetscInt low = PetscMin(i, j);
  const PetscInt high = PetscMax(i, j);
  const PetscInt *a = edges ? m->edge + 2 * low : &i;
  const PetscInt *b = edges ? m->edge + 2 * high : m->triangle + 3 * j;
  SbContactPair pair = {.kind = kind,
                        .v = {a[0], edges ? a[1] : b[0], edges ? b[0] : b[1], edges ? b[1] : b[2]}};
  const PetscInt one = m->part[a[0]];
  const PetscInt two = m->part[b[0]];
  const PetscInt obstacle = m->space->mesh->nbody;
  PetscBool driven = PETSC_TRUE;

  PetscFunctionBeginUser;

  /* of different bodies, one of them the obstacle if there is one, or self-contact; not both
     prescribed */
  if (one != two ? m->nvertex > m->nbody_vertex && one != obstacle && two != obstacle
                 : !m->self || one == obstacle)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 4; k++) {
    driven = (PetscBool)(driven && m->driven[pair.v[k]]);
    for (int l = SbContactPairSplit(&pair); k < SbContactPairSplit(&pair) && l < 4; l++)
      if (pair.v[k] == pair.v[l])
        PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (driven)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (edges)
    pair.area =
      b[0] >= m->nbody_vertex ? m->edge_area[low] : 0.5 * (m->edge_area[low] + m->edge_area[high]);
  else
    pair.area =
      i < m->nbody_vertex ? m->area[i] : (m->area[b[0]] + m->area[b[1]] + m->area[b[2]]) / 3.;
  if (overlaps(p, &pair) || stays_apart(p, &pair))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(p->n + 1, sizeof(pair), &p->size, &p->pair));
  p->pair[p->n++] = pair;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsCreate(SbContactSurface m, PetscReal reach, SbContactPairs *pairs)
{
  const PetscInt count[] = {m->side == SB_SIDE_NONE ? m->nvertex : m->nbody_vertex, m->ntriangle,
                            m->nedge};
  SbContactPairs p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  *pairs = p;
  p->mesh = m;
  p->reach = reach;
  p->most = PETSC_MAX_INT;
  p->margin = PetscMax(2. * reach, MARGIN * m->mean_edge);
  PetscCall(PetscMalloc2(6 * m->nvertex, &p->box, 3 * m->nvertex, &p->shorter));

  /* features by kind, those of this rank first */
  PetscCall(PetscCalloc1(6, &p->features));
  for (int k = 0; k < 6; k++) {
    struct SbContactFeatures *f = &p->features[k];

    PetscCall(PetscMalloc2(count[k / 2], &f->item, count[k / 2], &f->box));
    for (PetscInt i = 0; i < count[k / 2]; i++) {
      PetscInt own;
      const PetscInt *v = vertices_of(m, k / 2, i, &own);
      PetscBool mine = PETSC_FALSE;

      for (int a = 0; a < corners[k / 2]; a++)
        mine = (PetscBool)(mine || m->mine[v[a]]);
      if (mine == (PetscBool)(k % 2 == 0))
        f->item[f->n++] = i;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPairsDestroy(SbContactPairs *pairs)
{
  PetscFunctionBeginUser;
  if (!*pairs)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 6; k++) {
    struct SbContactFeatures *f = &(*pairs)->features[k];

    PetscCall(SbBoxTreeDestroy(&f->tree));
    PetscCall(PetscFree2(f->item, f->box));
  }
  PetscCall(PetscFree((*pairs)->features));
  PetscCall(PetscFree2((*pairs)->box, (*pairs)->shorter));
  PetscCall(PetscFree((*pairs)->pair));
  PetscCall(PetscFree(*pairs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all vertices stay where the pairs were searched for. */
static PetscBool still_within(SbContactPairs p, const PetscReal x0[], const PetscReal x1[])
{
  for (PetscInt v = 0; v < p->mesh->nvertex; v++) {
    const PetscReal *box = p->box + 6 * v;
    const PetscReal *a = x0 + 3 * v;
    const PetscReal *b = x1 + 3 * v;

    if (!((a[0] >= box[0]) & (a[0] <= box[3]) & (a[1] >= box[1]) & (a[1] <= box[4]) &
          (a[2] >= box[2]) & (a[2] <= box[5]) & (b[0] >= box[0]) & (b[0] <= box[3]) &
          (b[1] >= box[1]) & (b[1] <= box[4]) & (b[2] >= box[2]) & (b[2] <= box[5])))
      return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

PetscErrorCode SbContactPairsFind(SbContactPairs p, const PetscReal x0[], const PetscReal x1[])
{
  /* this rank's features among themselves, and with those of others */
  static const int meeting[5][2] = {{2 * VERTEX, 2 * TRIANGLE},
                                    {2 * VERTEX, 2 * TRIANGLE + 1},
                                    {2 * VERTEX + 1, 2 * TRIANGLE},
                                    {2 * EDGE, 2 * EDGE},
                                    {2 * EDGE, 2 * EDGE + 1}};
  const SbContactSurface m = p->mesh;
  PetscInt found[2 * CHUNK];

  PetscFunctionBeginUser;
  p->full = PETSC_FALSE;
  if (p->known && still_within(p, x0, x1))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  p->known = PETSC_TRUE;
  p->nsearch++;
  p->n = 0;
  for (PetscInt v = 0; v < m->nvertex; v++) {
    PetscReal *box = p->box + 6 * v;

    for (int k = 0; k < 3; k++) {
      box[k] = PetscMin(x0[3 * v + k], x1[3 * v + k]) - p->margin;
      box[3 + k] = PetscMax(x0[3 * v + k], x1[3 * v + k]) + p->margin;
    }
  }

  /* boxes of the features around those of their vertices, grown by half the reach, and the trees
     over them */
  for (int k = 0; k < 6; k++) {
    struct SbContactFeatures *f = &p->features[k];

    for (PetscInt i = 0; i < f->n; i++) {
      PetscInt own;
      const PetscInt *v = vertices_of(m, k / 2, f->item[i], &own);
      const PetscReal grown = 0.5 * p->reach + (v[0] < m->nbody_vertex ? 0. : m->radius);

      for (int c = 0; c < 6; c++)
        f->box[i][c] = p->box[6 * v[0] + c];
      for (int a = 1; a < corners[k / 2]; a++)
        SbBoxMerge(f->box[i], p->box + 6 * v[a]);
      for (int c = 0; c < 6; c++)
        f->box[i][c] += c < 3 ? -grown : grown;
    }
    if (p->nsearch == 1)
      PetscCall(SbBoxTreeCreate(f->n, (const PetscReal(*)[6])f->box, &f->tree));
    else
      PetscCall(SbBoxTreeRefit(&f->tree, (const PetscReal(*)[6])f->box));
  }

  for (int q = 0; q < 5 && !p->full; q++) {
    const struct SbContactFeatures *a = &p->features[meeting[q][0]];
    const struct SbContactFeatures *b = &p->features[meeting[q][1]];
    SbBoxPairs walk;
    PetscInt n;

    SbBoxPairsBegin(&a->tree, &b->tree, 0., &walk);
    while (!p->full && (n = SbBoxPairsNext(&walk, CHUNK, found)) > 0) {
      for (PetscInt k = 0; k < n; k++) {
        const PetscInt i = a->item[found[2 * k]];
        const PetscInt j = b->item[found[2 * k + 1]];

        PetscCall(add_features(p, q < 3 ? SB_PAIR_VERTEX_TRIANGLE : SB_PAIR_EDGE_EDGE, i, j));
      }
      p->full = (PetscBool)(p->n > p->most);
    }
  }

  /* a half-space or a bowl: vertices whose boxes come within the reach */
  for (PetscInt v = 0; v < m->nbody_vertex && m->side != SB_SIDE_NONE; v++) {
    SbContactPair pair = {
      .side = PETSC_TRUE, .v = {v, m->nbody_vertex, m->nvertex - 1, v}, .area = m->area[v]};
    PetscReal way = 0.;
    PetscReal away;
    SbDistance g;

    if (!m->mine[v] || m->driven[v] || (p->near && p->near[v] == SB_OVERLAP_INSIDE))
      continue;
    for (int i = 0; i < 3; i++)
      way += PetscSqr(x1[3 * v + i] - x0[3 * v + i] - x1[3 * m->nbody_vertex + i] +
                      x0[3 * m->nbody_vertex + i]);
    away = PetscMin(SbContactPairGap(m, &pair, x0, &g), SbContactPairGap(m, &pair, x1, &g)) -
           PetscSqrtReal(way);
    if (away >= p->reach + 4. * p->margin)
      continue;
    PetscCall(SbReserve(p->n + 1, sizeof(pair), &p->size, &p->pair));
    p->pair[p->n++] = pair;
  }
  if (p->full)
    p->known = PETSC_FALSE;
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SEARCH], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first time in (0, 1] at which a t^2 + b t + c, positive at 0, is zero; 1 + : none. */
static PetscReal first_root(PetscReal a, PetscReal b, PetscReal c)
{
  const PetscReal disc = b * b - 4. * a * c;
  PetscReal t = 2.;

  if (disc < 0.)
    return t;

  /* the root without cancellation; with c > 0 the smaller positive one is 2 c / (-b + root) where b
     < 0, and where a < 0 (-b - root) / 2 a */
  if (b < 0.)
    t = 2. * c / (-b + PetscSqrtReal(disc));
  else if (a < 0.)
    t = (-b - PetscSqrtReal(disc)) / (2. * a);
  return t;
}

/* The collision-free fraction of the motion for one pair. */
static PetscReal safe_part(SbContactSurface m, const SbContactPair *pair, PetscReal most,
                           const PetscReal x0[], const PetscReal x1[])
{
  PetscReal a[12], b[12], r0[3], dr[3], n0[3], dn[3], left;
  PetscReal part = 1.;
  SbDistance g;

  places(pair, x0, a);
  places(pair, x1, b);
  if (!pair->side) {
    const SbCCDLimits limits = {.radius = SbContactPairRadius(m, pair), .keep = LEFT, .most = most};

    (void)SbTimeOfImpact(pair->kind, a, b, &limits, &part);
    return part;
  }
  left = PetscMin(LEFT * SbContactPairGap(m, pair, x0, &g), most);
  for (int i = 0; i < 3; i++) {
    r0[i] = a[i] - a[3 + i];
    dr[i] = b[i] - b[3 + i] - r0[i];
    n0[i] = a[6 + i] - a[3 + i];
    dn[i] = b[6 + i] - b[3 + i] - n0[i];
  }
  if (m->side == SB_SIDE_PLANE)
    part = first_root(SbDot3(dn, dr), SbDot3(n0, dr) + SbDot3(dn, r0), SbDot3(n0, r0) - left);
  else
    part = first_root(-SbDot3(dr, dr), -2. * SbDot3(r0, dr),
                      PetscSqr(m->radius - left) - SbDot3(r0, r0));
  return PetscMin(1., part);
}

PetscErrorCode SbContactPairsMaxStep(SbContactPairs p, const PetscReal x0[], const PetscReal x1[],
                                     PetscReal *part)
{
  const SbContactSurface m = p->mesh;
  PetscReal whole = 1.;
  PetscReal safe;

  PetscFunctionBeginUser;

  /* halve the motion until it has few enough pairs */
  p->most = PetscMin(CROWD * (PetscInt64)(m->nvertex + CROWD_LEAST), PETSC_MAX_INT / 2);
  PetscCall(SbContactPairsFind(p, x0, x1));
  while (p->full) {
    whole *= 0.5;
    for (PetscInt k = 0; k < 3 * m->nvertex; k++)
      p->shorter[k] = x0[k] + 0.5 * (x1[k] - x0[k]);
    x1 = p->shorter;
    if (whole <= PETSC_SQRT_MACHINE_EPSILON)
      p->most = PETSC_MAX_INT;
    PetscCall(SbContactPairsFind(p, x0, x1));
  }
  p->most = PETSC_MAX_INT;

  *part = 1.;
  for (PetscInt i = 0; i < p->n; i++) {
    const SbContactPair *pair = &p->pair[i];

    if (!m->own[pair->v[0]] && !(pair->v[0] >= m->nbody_vertex && m->own[pair->v[1]]))
      continue;
    if (SbContactPairSweptApart(m, pair, x0, x1, p->reach))
      continue;
    safe = safe_part(m, pair, LEFT_MOST * p->reach, x0, x1);
    *part = PetscMin(*part, safe); /* a macro: its arguments are evaluated twice */
  }
  *part *= whole;
  PetscFunctionReturn(PETSC_SUCCESS);
}
