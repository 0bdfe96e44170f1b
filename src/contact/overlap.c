/*
  overlap.c - intersections of surfaces, which verify contact, too; penetrations: where, how deep,
  and the separation direction. It shares nothing with the search for pairs but the tree of boxes.

  An edge goes through a triangle where its ends are on different sides of the plane and the line
  passes the three sides in the same sense: signs of volumes of tets. A volume within rounding, also
  that of the coordinates, counts as no intersection: bodies in contact do not intersect.

  Between triangulated surfaces, an edge that intersects a triangle shows which of its ends is
  inside, and the normal there. From these vertices separation direction and depth are propagated
  along edges that intersect nothing, so that neighbours separate to the same side (Heidelberger,
  Teschner, Keiser, Mueller and Gross, "Consistent penetration depth estimation for deformable
  collision response", VMV 2004). Of an edge that enters and leaves a body only the midpoint of the
  inner part counts as inside. The depth is the distance to the surface along the direction.

  Surfaces that are in each other by rounding, or by less than the width of a barrier, touch: no
  point inside is farther from the surface. A vertex inside is joined by edges that intersect
  nothing to other ones inside; where rounding hides an intersection, the winding number decides.

  For a half-space, bowl, sphere and capsule, they follow from the distance.

  Each rank tests its own edges against the triangles near them. Only if some rank finds a
  penetration is the whole surface gathered, and all ranks compute all of it.
*/
#include "pairs.h"
#include "sbgeometry.h"
#include "sbsurface.h"

#define CANCEL 1e-3 /* relative length below which a sum of directions counts as zero */
#define TINY 1e-12  /* of the bodies' size: a vertex nearer to a surface counts as on it */
#define AGAINST \
  0.1 /* |cosine| beyond which separation direction and own outward normal agree or oppose */
#define JITTER \
  1e-7 /* of that size: perturbation of vertices, so that none lies on a triangle or an edge */
#define ROUNDING 64 /* rounding of a volume, in machine epsilons of its products */
#define FAR 4.      /* ray length over depth; beyond it the closest point of the surface is taken */

/* Sign of the volume of a tet, 0 within rounding. */
static int side_of(const PetscReal *a, const PetscReal *b, const PetscReal *c, const PetscReal *d)
{
  PetscReal p[3], q[3], r[3], n[3], volume;
  PetscReal size = 0.;
  PetscReal far = 0.;

  SbSubtract(b, a, p);
  SbSubtract(c, a, q);
  SbSubtract(d, a, r);
  for (int i = 0; i < 3; i++)
    far = PetscMax(far, PetscMax(PetscMax(PetscAbsReal(a[i]), PetscAbsReal(b[i])),
                                 PetscMax(PetscAbsReal(c[i]), PetscAbsReal(d[i]))));
  SbCross(p, q, n);
  volume = SbDot3(n, r);
  for (int i = 0; i < 3; i++)
    size += (PetscAbsReal(p[(i + 1) % 3] * q[(i + 2) % 3]) +
             PetscAbsReal(p[(i + 2) % 3] * q[(i + 1) % 3])) *
            (PetscAbsReal(r[i]) + far);
  if (PetscAbsReal(volume) <= ROUNDING * PETSC_MACHINE_EPSILON * size)
    return 0;
  return volume > 0. ? 1 : -1;
}

/* Whether an edge intersects a triangle. */
static PetscBool goes_through(SbContactSurface m, const PetscReal x[], PetscInt edge, PetscInt t)
{
  const PetscInt *e = m->edge + 2 * edge;
  const PetscInt *v = m->triangle + 3 * t;
  const PetscReal *a = x + 3 * e[0];
  const PetscReal *b = x + 3 * e[1];
  const PetscReal *p = x + 3 * v[0];
  const PetscReal *q = x + 3 * v[1];
  const PetscReal *r = x + 3 * v[2];
  int around;

  /* with an obstacle, contact between bodies belongs to another effect */
  if (m->nvertex > m->nbody_vertex && e[0] < m->nbody_vertex && v[0] < m->nbody_vertex)
    return PETSC_FALSE;
  if (m->part[e[0]] == m->part[v[0]] && (!m->self || e[0] >= m->nbody_vertex))
    return PETSC_FALSE;
  for (int k = 0; k < 6; k++)
    if (e[k / 3] == v[k % 3])
      return PETSC_FALSE;
  if (m->driven[e[0]] && m->driven[e[1]] && m->driven[v[0]] && m->driven[v[1]] && m->driven[v[2]])
    return PETSC_FALSE;
  if (side_of(p, q, r, a) * side_of(p, q, r, b) >= 0)
    return PETSC_FALSE;
  around = side_of(a, b, p, q);
  return (PetscBool)(around && side_of(a, b, q, r) == around && side_of(a, b, r, p) == around);
}

/* Edges that intersect triangles of another body, or of the same one (m->self): hit[n][2], edge and
   triangle, ascending, of all ranks on each; the caller frees it. Collective. */
static PetscErrorCode find_crossings(SbContactSurface m, const PetscReal x[], PetscInt *n,
                                     PetscInt **hits)
{
  PetscInt nmine = 0;
  PetscInt size = 0;
  PetscInt *mine = NULL;
  PetscInt hit;
  SbBoxNearest query;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(SbBoxTreeCreateTriangles(m->ntriangle, m->triangle, x, &tree));
  for (PetscInt e = m->space->rank; e < m->nedge; e += m->space->size) {
    PetscReal around[6];

    SbBoxClear(around);
    for (int k = 0; k < 2; k++)
      SbBoxAdd(around, x + 3 * m->edge[2 * e + k]);
    for (SbBoxNearestBegin(&tree, around, 0, &query); SbBoxNearestNext(&query, &hit);) {
      if (!goes_through(m, x, e, hit))
        continue;
      PetscCall(SbReserve(nmine + 2, sizeof(*mine), &size, &mine));
      mine[nmine++] = e;
      mine[nmine++] = hit;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));

  /* those of all ranks */
  PetscCall(SbAllgatherv(m->space->comm, MPIU_INT, nmine, mine, n, hits, NULL));
  PetscCall(PetscFree(mine));
  *n /= 2;
  PetscCall(SbSortByKeys(*n, 2 * sizeof(**hits), 2, *hits));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Separation directions ("ways") of the vertices while they are propagated. */
typedef struct {
  const PetscReal *x;
  PetscReal *normal;      /* [nvertex][3] outward, unit vectors */
  PetscInt *in;           /* [nvertex] the body that it is inside, -1: none */
  PetscReal *way;         /* [nvertex][3] weighted sum, then the unit direction */
  PetscReal *depth;       /* [nvertex] weighted sum, then the depth, m */
  PetscReal *sum;         /* [nvertex] sum of weights, m^-2 */
  PetscInt *layer;        /* [nvertex] layer of the propagation, from 1; 0: none */
  PetscInt *start, *edge; /* [nvertex+1], edges of each vertex */
  uint8_t *through;       /* [nedge] goes through a triangle */
} Ways;

/* Adds the direction n out of `part`, of depth d, to the weighted sums of vertex v, unless its own
   outward normal points that way. Returns whether it did. */
static PetscBool suggest(Ways *w, PetscInt v, PetscInt part, PetscReal weight, const PetscReal n[3],
                         PetscReal d)
{
  if ((w->layer[v] && w->in[v] != part) || SbDot3(w->normal + 3 * v, n) > AGAINST)
    return PETSC_FALSE;
  w->in[v] = part;
  for (int i = 0; i < 3; i++)
    w->way[3 * v + i] += weight * n[i];
  w->depth[v] += weight * d;
  w->sum[v] += weight;
  return PETSC_TRUE;
}

/* Intersection of edge e and triangle t, as a fraction of the edge; unit normal of the triangle;
   signed distance of the edge's first end, m. */
static PetscReal pierce(SbContactSurface m, const PetscReal x[], PetscInt e, PetscInt t,
                        PetscReal n[3], PetscReal *first)
{
  const PetscInt *v = m->triangle + 3 * t;
  const PetscInt *ends = m->edge + 2 * e;
  const PetscReal length = 2. * SbContactTriangleArea(x, v, n);
  PetscReal p[3], side[2];

  for (int i = 0; i < 3; i++)
    n[i] /= length;
  for (int k = 0; k < 2; k++) {
    SbSubtract(x + 3 * ends[k], x + 3 * v[0], p);
    side[k] = SbDot3(n, p);
  }
  *first = side[0];
  return side[0] / (side[0] - side[1]);
}

/* Adds a point at p with its other side, the triangle of the penetrated body that the ray along the
   separation direction leaves through, if there is any. */
static PetscErrorCode add_inside(SbContactSurface m, const PetscReal x[], const SbBoxTree *tree,
                                 PetscInt part, PetscReal depth, const PetscReal p[3],
                                 SbPenetration *point, SbContactOverlap *o)
{
  PetscReal box[6], goal[3];
  PetscReal nearest = PETSC_MAX_REAL;
  PetscReal best[3] = {0};
  PetscInt t;
  PetscInt exit = -1;
  SbBoxNearest query;

  PetscFunctionBeginUser;
  SbBoxClear(box);
  SbBoxAdd(box, p);
  for (int i = 0; i < 3; i++)
    goal[i] = p[i] + FAR * depth * point->normal[i];
  SbBoxAdd(box, goal);
  for (SbBoxNearestBegin(tree, box, 0, &query); SbBoxNearestNext(&query, &t);) {
    const PetscInt *v = m->triangle + 3 * t;
    const PetscReal *const at[3] = {x + 3 * v[0], x + 3 * v[1], x + 3 * v[2]};
    PetscReal weight[3], length;
    PetscBool out;
    PetscBool own = PETSC_FALSE;

    if (m->part[v[0]] != part)
      continue;
    for (int k = 0; k < 6; k++)
      own = (PetscBool)(own || (k / 3 < point->n && point->v[k / 3] == v[k % 3]));
    if (own || !SbRayTriangle(p, point->normal, at, &length, weight, &out) || !out ||
        length >= nearest)
      continue;
    nearest = length;
    exit = t;
    PetscCall(PetscArraycpy(best, weight, 3));
  }

  /* none: the point of the surface closest to the end of the ray */
  if (exit < 0) {
    PetscReal way[3];
    SbBoxNearest near;

    for (int i = 0; i < 3; i++)
      goal[i] = p[i] + depth * point->normal[i];
    SbBoxClear(box);
    SbBoxAdd(box, goal);
    for (SbBoxNearestBegin(tree, box, PETSC_MAX_REAL, &near); SbBoxNearestNext(&near, &t);) {
      const PetscInt *v = m->triangle + 3 * t;
      const PetscReal *const at[3] = {x + 3 * v[0], x + 3 * v[1], x + 3 * v[2]};
      PetscReal weight[3], d2;
      PetscBool own = PETSC_FALSE;

      if (m->part[v[0]] != part)
        continue;
      for (int k = 0; k < 6; k++)
        own = (PetscBool)(own || (k / 3 < point->n && point->v[k / 3] == v[k % 3]));
      if (own)
        continue;
      (void)SbTriangleClosestPoint(goal, at, weight, &d2);
      if (d2 >= near.limit2)
        continue;
      near.limit2 = d2;
      exit = t;
      PetscCall(PetscArraycpy(best, weight, 3));
    }
    if (exit < 0)
      PetscFunctionReturn(PETSC_SUCCESS);
    for (int i = 0; i < 3; i++) { /* directly towards it */
      way[i] = -p[i];
      for (int k = 0; k < 3; k++)
        way[i] += best[k] * x[3 * m->triangle[3 * exit + k] + i];
    }
    if (SbNormalise(way) <= TINY * m->size || SbDot3(way, point->normal) <= 0.)
      PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(PetscArraycpy(point->normal, way, 3));
  }
  point->depth = 0.;
  if (point->v[0] >= m->nbody_vertex)
    point->area = 0.; /* of the obstacle: the body's area counts */
  for (int k = 0; k < 3; k++) {
    const PetscInt v = m->triangle[3 * exit + k];

    if (point->v[0] >= m->nbody_vertex)
      point->area += m->area[v] / 3.;
    for (int i = 0; i < 3; i++)
      point->depth += best[k] * point->normal[i] * (x[3 * v + i] - p[i]);
    point->v[point->n] = v;
    point->weight[point->n++] = -best[k];
  }
  if (point->depth <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbReserve(o->n + 1, sizeof(*point), &o->size, &o->point));
  o->point[o->n++] = *point;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Propagates directions from the n vertices of list[], layer by layer along edges that intersect
   nothing. */
static void spread_ways(SbContactSurface m, Ways *w, PetscInt n, PetscInt list[])
{
  for (PetscInt first = 0, last = n, layer = 1; first < last; first = last, last = n, layer++) {
    /* means of the sums; a vertex whose directions cancel has none */
    for (PetscInt k = first; k < last; k++) {
      PetscReal *way = w->way + 3 * list[k];
      const PetscReal length = PetscSqrtReal(SbDot3(way, way));

      for (int i = 0; i < 3; i++)
        way[i] = length > CANCEL * w->sum[list[k]] ? way[i] / length : 0.;
      w->depth[list[k]] /= w->sum[list[k]];
    }
    for (PetscInt k = first; k < last; k++) {
      const PetscInt v = list[k];

      for (PetscInt j = w->start[v]; j < w->start[v + 1]; j++) {
        const PetscInt *e = m->edge + 2 * w->edge[j];
        const PetscInt to = e[0] == v ? e[1] : e[0];
        PetscReal r[3];

        if (w->through[w->edge[j]] || (w->layer[to] && w->layer[to] <= layer))
          continue;
        for (int i = 0; i < 3; i++)
          r[i] = w->x[3 * v + i] - w->x[3 * to + i];
        if (!suggest(w, to, w->in[v], 1. / SbDot3(r, r), w->way + 3 * v,
                     SbDot3(r, w->way + 3 * v) + w->depth[v]) ||
            w->layer[to])
          continue;
        w->layer[to] = layer + 1;
        list[n++] = to;
      }
    }
  }
}

/* Work of find_inside(): the directions, the list of vertices that have one so far, the tree of
   triangles. */
typedef struct {
  Ways ways;
  PetscInt n, *list; /* [n] */
  SbBoxTree tree;
} Search;

static PetscErrorCode begin_search(SbContactSurface m, const PetscReal x[], Search *search)
{
  Ways *w = &search->ways;

  PetscFunctionBeginUser;
  *search = (Search){.ways = {.x = x}};
  PetscCall(PetscCalloc7(m->nvertex, &w->in, m->nvertex, &search->list, 3 * m->nvertex, &w->way,
                         m->nvertex, &w->depth, m->nvertex, &w->sum, m->nvertex, &w->layer,
                         m->nedge, &w->through));
  PetscCall(PetscMalloc1(3 * m->nvertex, &w->normal));
  PetscCall(SbContactSurfaceNormals(m, x, w->normal));
  for (PetscInt v = 0; v < m->nvertex; v++) {
    (void)SbNormalise(w->normal + 3 * v);
    w->in[v] = -1;
  }
  PetscCall(SbBucketByKey(2 * m->nedge, m->edge, m->nvertex, &w->start, &w->edge));
  for (PetscInt k = 0; k < 2 * m->nedge; k++)
    w->edge[k] /= 2;
  PetscCall(SbBoxTreeCreateTriangles(m->ntriangle, m->triangle, x, &search->tree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode end_search(Search *search)
{
  Ways *w = &search->ways;

  PetscFunctionBeginUser;
  PetscCall(SbBoxTreeDestroy(&search->tree));
  PetscCall(PetscFree7(w->in, search->list, w->way, w->depth, w->sum, w->layer, w->through));
  PetscCall(PetscFree(w->normal));
  PetscCall(PetscFree(w->start));
  PetscCall(PetscFree(w->edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An edge enters a body at the triangle hit[0] and leaves it at hit[1]: the midpoint between both
   is inside. */
static PetscErrorCode add_midpoint(SbContactSurface m, const Search *search, PetscInt e,
                                   const PetscInt hit[2], SbContactOverlap *o)
{
  const PetscReal *x = search->ways.x;
  const PetscInt *ends = m->edge + 2 * e;
  PetscReal normal[2][3], s[2], unused, p[3];
  PetscReal chord = 0.;
  PetscReal at;
  SbPenetration point = {.n = 2, .v = {ends[0], ends[1]}, .area = m->edge_area[e]};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++)
    s[k] = pierce(m, x, e, hit[k], normal[k], &unused);
  at = 0.5 * (s[0] + s[1]);
  point.weight[0] = 1. - at;
  point.weight[1] = at;
  for (int k = 0; k < 3; k++) {
    point.normal[k] = normal[0][k] + normal[1][k];
    p[k] = (1. - at) * x[3 * ends[0] + k] + at * x[3 * ends[1] + k];
    chord += PetscSqr((s[1] - s[0]) * (x[3 * ends[1] + k] - x[3 * ends[0] + k]));
  }
  if (SbNormalise(point.normal) > CANCEL)
    PetscCall(add_inside(m, x, &search->tree, m->part[m->triangle[3 * hit[0]]],
                         PetscSqrtReal(chord), p, &point, o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An edge goes through triangle t once: one of its ends is inside, and the triangle's normal leads
   out. */
static void mark_end(SbContactSurface m, Search *search, PetscInt e, PetscInt t,
                     SbContactOverlap *o)
{
  Ways *w = &search->ways;
  const PetscReal *x = w->x;
  const PetscInt *ends = m->edge + 2 * e;
  PetscReal normal[3], first, p[3];
  const PetscReal s = pierce(m, x, e, t, normal, &first);
  const PetscInt v = ends[first < 0. ? 0 : 1];

  for (int k = 0; k < 3; k++)
    p[k] = (1. - s) * x[3 * ends[0] + k] + s * x[3 * ends[1] + k] - x[3 * v + k];
  if (suggest(w, v, m->part[m->triangle[3 * t]],
              1. / PetscMax(SbDot3(p, p), PetscSqr(TINY * m->size)), normal, SbDot3(p, normal)) &&
      !w->layer[v]) {
    w->layer[v] = 1;
    search->list[search->n++] = v;
  }
  o->near[v] = SB_OVERLAP_INSIDE;
}

/* What the intersections hit[n][2] of edges and triangles show: midpoints of edges, and ends of
   edges that are inside. */
static PetscErrorCode read_crossings(SbContactSurface m, PetscInt n, const PetscInt hit[],
                                     Search *search, SbContactOverlap *o)
{
  uint8_t *paired; /* an intersection that belongs to an earlier one */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(n, &paired));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt e = hit[2 * i];
    const PetscInt t = hit[2 * i + 1];
    PetscInt j = i + 1;

    search->ways.through[e] = 1;
    for (int k = 0; k < 5; k++) {
      const PetscInt v = k < 2 ? m->edge[2 * e + k] : m->triangle[3 * t + k - 2];

      o->near[v] = PetscMax(o->near[v], SB_OVERLAP_INTERSECTED);
    }
    if (paired[i])
      continue;

    /* whether the edge leaves the same body again */
    while (j < n && hit[2 * j] == e &&
           (paired[j] || m->part[m->triangle[3 * hit[2 * j + 1]]] != m->part[m->triangle[3 * t]]))
      j++;
    if (j < n && hit[2 * j] == e) {
      paired[j] = 1;
      PetscCall(add_midpoint(m, search, e, (const PetscInt[2]){t, hit[2 * j + 1]}, o));
    } else
      mark_end(m, search, e, t, o);
  }
  PetscCall(PetscFree(paired));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices joined to an inside one by an edge that intersects nothing are inside, too. */
static void spread_inside(SbContactSurface m, Search *search, SbContactOverlap *o)
{
  const Ways *w = &search->ways;
  PetscInt *list = search->list;
  PetscInt n = 0;

  for (PetscInt v = 0; v < m->nvertex; v++)
    if (o->near[v] == SB_OVERLAP_INSIDE)
      list[n++] = v;
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt j = w->start[list[k]]; j < w->start[list[k] + 1]; j++) {
      const PetscInt *e = m->edge + 2 * w->edge[j];
      const PetscInt to = e[0] == list[k] ? e[1] : e[0];

      if (w->through[w->edge[j]] || o->near[to] == SB_OVERLAP_INSIDE)
        continue;
      o->near[to] = SB_OVERLAP_INSIDE;
      list[n++] = to;
    }
  }
}

/* Keeps the points whose own outward normal opposes the direction, if there are any. */
static void keep_opposed(const PetscReal normal[], SbContactOverlap *o)
{
  PetscInt nleading = 0;

  for (PetscInt i = 0; i < o->n; i++) {
    const SbPenetration p = o->point[i];
    PetscReal own[3] = {0.};

    for (PetscInt k = 0; k < p.n && p.weight[k] > 0.; k++)
      for (int j = 0; j < 3; j++)
        own[j] += p.weight[k] * normal[3 * p.v[k] + j];
    if (SbDot3(own, p.normal) < -AGAINST * PetscSqrtReal(SbDot3(own, own)))
      o->point[nleading++] = p;
  }
  if (nleading)
    o->n = nleading;
}

/* Points inside triangulated surfaces, from the intersections hit[n][2] of edges and triangles. */
static PetscErrorCode find_inside(SbContactSurface m, const PetscReal x[], PetscInt n,
                                  const PetscInt hit[], SbContactOverlap *o)
{
  Search search;
  const Ways *w = &search.ways;

  PetscFunctionBeginUser;
  PetscCall(begin_search(m, x, &search));
  PetscCall(read_crossings(m, n, hit, &search, o));

  /* directions and depths of the vertices inside */
  spread_ways(m, &search.ways, search.n, search.list);
  for (PetscInt v = 0; v < m->nvertex; v++) {
    SbPenetration point = {.n = 1, .v = {v}, .weight = {1.}, .area = m->area[v]};

    if (!w->layer[v] || SbDot3(w->way + 3 * v, w->way + 3 * v) == 0. || w->depth[v] <= 0.)
      continue;
    PetscCall(PetscArraycpy(point.normal, w->way + 3 * v, 3));
    PetscCall(add_inside(m, x, &search.tree, w->in[v], w->depth[v], x + 3 * v, &point, o));
  }

  spread_inside(m, &search, o);
  keep_opposed(w->normal, o);
  PetscCall(end_search(&search));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A feature that penetrates a half-space, bowl, sphere or capsule. */
static PetscErrorCode add_behind(SbContactSurface m, const PetscReal x[], const SbContactPair *pair,
                                 SbContactOverlap *o)
{
  SbPenetration point = {.n = 0, .area = pair->area};
  PetscBool driven = PETSC_TRUE;
  SbDistance d;
  const PetscReal gap = SbContactPairGap(m, pair, x, &d);
  const PetscReal sign = pair->v[0] >= m->nbody_vertex ? -1. : 1.;

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++)
    driven = (PetscBool)(driven && m->driven[pair->v[k]]);
  if (gap >= 0. || driven || SbDot3(d.n, d.n) == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int pass = 0; pass < 2; pass++) { /* the body's vertices first */
    for (int k = 0; k < 4; k++) {
      if (d.weight[k] == 0. || (pair->v[k] < m->nbody_vertex) != !pass)
        continue;
      o->near[SbContactNumber(m, pair->v[k])] = SB_OVERLAP_INSIDE;
      point.v[point.n] = pair->v[k];
      point.weight[point.n++] = sign * d.weight[k];
    }
  }
  for (int k = 0; k < 3; k++)
    point.normal[k] = sign * d.n[k];
  point.depth = -gap;
  PetscCall(SbReserve(o->n + 1, sizeof(point), &o->size, &o->point));
  o->point[o->n++] = point;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode find_behind(SbContactSurface m, const PetscReal x[], SbContactOverlap *o)
{
  const PetscInt first = m->nbody_vertex;

  PetscFunctionBeginUser;
  for (PetscInt v = 0; v < first && m->side != SB_SIDE_NONE; v++) {
    const SbContactPair pair = {
      .side = PETSC_TRUE, .v = {v, first, m->nvertex - 1, v}, .area = m->area[v]};

    PetscCall(add_behind(m, x, &pair, o));
  }
  if (m->side != SB_SIDE_NONE || m->radius <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt t = 0; t < m->nbody_triangle; t++) {
    const PetscInt *v = m->triangle + 3 * t;

    for (PetscInt k = first; k < m->nvertex; k++) {
      const SbContactPair pair = {.kind = SB_PAIR_VERTEX_TRIANGLE,
                                  .v = {k, v[0], v[1], v[2]},
                                  .area = (m->area[v[0]] + m->area[v[1]] + m->area[v[2]]) / 3.};

      PetscCall(add_behind(m, x, &pair, o));
    }
  }
  for (PetscInt e = 0; m->nvertex - first == 2 && e < m->nedge - 1; e++) {
    const SbContactPair pair = {.kind = SB_PAIR_EDGE_EDGE,
                                .v = {m->edge[2 * e], m->edge[2 * e + 1], first, first + 1},
                                .area = m->edge_area[e]};

    PetscCall(add_behind(m, x, &pair, o));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The triangle of `part` whose closest point to `goal` is nearer than limit, m, -1: none; the
   weights of its vertices there. */
static PetscInt find_closest(SbContactSurface m, const PetscReal x[], const SbBoxTree *tree,
                             PetscInt part, const PetscReal goal[3], PetscReal limit,
                             PetscReal best[3])
{
  PetscReal box[6];
  PetscInt t;
  PetscInt closest = -1;
  SbBoxNearest near;

  SbBoxClear(box);
  SbBoxAdd(box, goal);
  for (SbBoxNearestBegin(tree, box,
                         limit < m->farthest + m->size ? PetscSqr(limit) : PETSC_MAX_REAL, &near);
       SbBoxNearestNext(&near, &t);) {
    const PetscInt *v = m->triangle + 3 * t;
    const PetscReal *const at[3] = {x + 3 * v[0], x + 3 * v[1], x + 3 * v[2]};
    PetscReal weight[3], d2;

    if (m->part[v[0]] != part)
      continue;
    (void)SbTriangleClosestPoint(goal, at, weight, &d2);
    if (d2 >= near.limit2)
      continue;
    near.limit2 = d2;
    closest = t;
    for (int i = 0; i < 3; i++)
      best[i] = weight[i];
  }
  return closest;
}

/* way = from p to the point of a triangle with these weights; returns its length, m. */
static PetscReal towards(SbContactSurface m, const PetscReal x[], PetscInt t,
                         const PetscReal weight[3], const PetscReal p[3], PetscReal way[3])
{
  for (int i = 0; i < 3; i++) {
    way[i] = -p[i];
    for (int k = 0; k < 3; k++)
      way[i] += weight[k] * x[3 * m->triangle[3 * t + k] + i];
  }
  return SbNormalise(way);
}

/* Winding number of the surface of `part` about p. */
static PetscReal winding_about(SbContactSurface m, const PetscReal x[], PetscInt part,
                               const PetscReal p[3])
{
  PetscReal sum = 0.;

  for (PetscInt t = 0; t < m->ntriangle; t++)
    if (m->part[m->triangle[3 * t]] == part)
      sum += SbTriangleSolidAngle(x, m->triangle + 3 * t, p) / (4. * PETSC_PI);
  return PetscAbsReal(sum);
}

/* Whether p, which may be inside `part`, is so by less than o->touch, or not at all; near: it is
   that close to the surface. Raises o->farthest. */
static PetscBool is_near(SbContactSurface m, const PetscReal x[], const SbBoxTree *tree,
                         PetscInt part, const PetscReal p[3], PetscBool *near, SbContactOverlap *o)
{
  PetscReal best[3], way[3];
  const PetscInt t = find_closest(m, x, tree, part, p, o->touch, best);

  const PetscReal d = t >= 0 ? towards(m, x, t, best, p, way) : PETSC_MAX_REAL;
  PetscBool inside;

  /* rounding may lead to vertices outside: only some need to be looked at */
  *near = (PetscBool)(t >= 0);
  if (d <= o->farthest)
    return PETSC_TRUE;
  inside = (PetscBool)(winding_about(m, x, part, p) > 0.5);
  if (*near && inside)
    o->farthest = d;
  return (PetscBool)(*near || !inside);
}

/* o->touches: nothing is inside another part by o->touch or more, by the intersections hit[n][2] of
   edges and triangles. */
static PetscErrorCode find_touching(SbContactSurface m, const PetscReal x[], PetscInt n,
                                    const PetscInt hit[], SbContactOverlap *o)
{
  PetscInt nlist = 0;
  PetscInt *list, *in, *start, *edge;
  uint8_t *through;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc3(m->nvertex, &list, m->nvertex, &in, m->nedge, &through));
  PetscCall(SbBoxTreeCreateTriangles(m->ntriangle, m->triangle, x, &tree));
  PetscCall(SbBucketByKey(2 * m->nedge, m->edge, m->nvertex, &start, &edge));
  o->touches = PETSC_TRUE;
  for (PetscInt v = 0; v < m->nvertex; v++)
    in[v] = -1;
  for (PetscInt i = 0; i < n; i++)
    through[hit[2 * i]] = 1;

  /* the inner part of each edge: to its inner end, or to where it leaves again */
  for (PetscInt i = 0; i < n && o->touches; i++) {
    const PetscInt *ends = m->edge + 2 * hit[2 * i];
    const PetscInt part = m->part[m->triangle[3 * hit[2 * i + 1]]];
    PetscReal normal[3], first, unused, p[3];
    PetscReal s = pierce(m, x, hit[2 * i], hit[2 * i + 1], normal, &first);
    PetscInt other = i;
    PetscBool near;

    o->touching[part] |= SB_TOUCH_ONCE;
    o->touching[m->part[ends[0]]] |= SB_TOUCH_ONCE;
    for (PetscInt k = i - 1; k >= 0 && hit[2 * k] == hit[2 * i]; k--)
      other = m->part[m->triangle[3 * hit[2 * k + 1]]] == part ? k : other;
    for (PetscInt k = i + 1; other == i && k < n && hit[2 * k] == hit[2 * i]; k++)
      other = m->part[m->triangle[3 * hit[2 * k + 1]]] == part ? k : other;
    if (other != i)
      s = 0.5 * (s + pierce(m, x, hit[2 * i], hit[2 * other + 1], normal, &unused));
    else
      s = first < 0. ? 0. : 1.;
    for (int k = 0; k < 3; k++)
      p[k] = (1. - s) * x[3 * ends[0] + k] + s * x[3 * ends[1] + k];
    o->touches = (PetscBool)(m->part[ends[0]] != part && is_near(m, x, &tree, part, p, &near, o));
    if (other != i || in[ends[first < 0. ? 0 : 1]] >= 0)
      continue;
    in[ends[first < 0. ? 0 : 1]] = part;
    list[nlist++] = ends[first < 0. ? 0 : 1];
  }

  /* vertices joined to one inside by edges that intersect nothing */
  for (PetscInt k = 0; k < nlist && o->touches; k++) {
    const PetscInt v = list[k];
    PetscBool near;

    o->touches = is_near(m, x, &tree, in[v], x + 3 * v, &near, o);
    for (PetscInt j = start[v]; near && j < start[v + 1]; j++) {
      const PetscInt *e = m->edge + 2 * (edge[j] / 2);
      const PetscInt to = e[0] == v ? e[1] : e[0];

      if (through[edge[j] / 2] || in[to] >= 0)
        continue;
      in[to] = in[v];
      list[nlist++] = to;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(edge));
  PetscCall(PetscFree3(list, in, through));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of the whole surface, on every rank. */
static PetscErrorCode find_overlap(SbContactSurface m, const PetscReal x[], PetscBool inside,
                                   SbContactOverlap *o)
{
  PetscInt n, *hit;

  PetscFunctionBeginUser;
  PetscCall(find_crossings(m, x, &n, &hit));

  if (n && o->touch > 0. && !inside)
    PetscCall(find_touching(m, x, n, hit, o));

  /* vertices exactly on a surface are on neither side: perturb all by JITTER, the same in every
     run */
  if ((n || inside) && !o->touches) {
    PetscInt nmoved, *other;
    PetscReal *moved;

    PetscCall(PetscMalloc1(3 * m->nvertex, &moved));
    for (PetscInt k = 0; k < 3 * m->nvertex; k++) {
      uint32_t h = (uint32_t)(k + 1) * 2654435761u;

      h = (h ^ (h >> 15)) * 2246822519u;
      h = (h ^ (h >> 13)) * 3266489917u;
      moved[k] = x[k] + JITTER * m->size * (2. * ((PetscReal)(h ^ (h >> 16)) / 4294967296.) - 1.);
    }
    PetscCall(find_crossings(m, moved, &nmoved, &other));
    if (nmoved) {
      PetscCall(PetscFree(hit));
      n = nmoved;
      hit = other;
    } else
      PetscCall(PetscFree(other));
    if (n)
      PetscCall(find_inside(m, nmoved ? moved : x, n, hit, o));
    PetscCall(PetscFree(moved));
  }
  PetscCall(find_behind(m, x, o));
  if (o->touch > 0. && !inside && o->n && !n) {
    o->touches = PETSC_TRUE;
    for (PetscInt i = 0; i < o->n; i++) {
      const SbPenetration *p = &o->point[i];

      o->touching[m->part[p->v[0]]] |= SB_TOUCH_ONCE;
      o->touching[m->space->mesh->nbody] |= SB_TOUCH_ONCE;
      o->farthest = PetscMax(o->farthest, p->depth);
      o->touches = (PetscBool)(o->touches && p->depth < o->touch);
    }
  }
  o->ncrossing = n ? n : o->n;
  if (o->touches)
    o->n = 0;

  /* the first intersection, and the largest depth */
  if (o->ncrossing) {
    const PetscInt v = n ? m->edge[2 * hit[0]] : o->point[0].v[0];

    o->part[0] = m->part[v];
    o->part[1] = n ? m->part[m->triangle[3 * hit[1]]] : m->space->mesh->nbody;
    PetscCall(PetscArraycpy(o->place, x + 3 * v, 3));
  }
  PetscCall(PetscFree(hit));
  o->npoint = o->n;
  for (PetscInt i = 0; i < o->n; i++) {
    o->point[i].number = i;
    o->deepest = PetscMax(o->deepest, o->point[i].depth);
  }

  /* vertices next to the overlap may enter while it separates */
  for (PetscInt e = 0; e < m->nedge; e++) {
    const PetscInt *v = m->edge + 2 * e;

    for (int k = 0; k < 2; k++)
      if (o->near[v[k]] > SB_OVERLAP_ADJACENT && !o->near[v[1 - k]])
        o->near[v[1 - k]] = SB_OVERLAP_ADJACENT;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether an edge of this rank intersects a triangle, or a feature penetrates a round or one-sided
   obstacle, on some rank. */
static PetscErrorCode is_crossed(SbContactSurface m, const PetscReal x[], SbContactOverlap *o,
                                 PetscBool *found)
{
  SbBoxTree tree;
  PetscInt t;

  PetscFunctionBeginUser;
  *found = PETSC_FALSE;
  PetscCall(SbBoxTreeCreateTriangles(m->ntriangle, m->triangle, x, &tree));
  for (PetscInt e = 0; e < m->nkept_edge && !*found; e++) {
    PetscReal around[6];
    SbBoxNearest query;

    SbBoxClear(around);
    for (int k = 0; k < 2; k++)
      SbBoxAdd(around, x + 3 * m->edge[2 * e + k]);
    for (SbBoxNearestBegin(&tree, around, 0, &query); !*found && SbBoxNearestNext(&query, &t);)
      *found = goes_through(m, x, e, t);
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(find_behind(m, x, o));
  *found = (PetscBool)(*found || o->n);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found, 1, SB_MPI_BOOL, MPI_LOR, m->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The points of the whole surface by the numbers here: those of which this rank has all vertices,
   one of them with a node of it. */
static PetscErrorCode take_points(SbContactSurface m, SbContactOverlap *o)
{
  PetscInt n = 0;
  PetscInt *number, *v;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(5 * o->n, &number, 5 * o->n, &v));
  for (PetscInt i = 0; i < o->n; i++)
    for (PetscInt k = 0; k < 5; k++)
      number[5 * i + k] = o->point[i].v[k < o->point[i].n ? k : 0];
  PetscCall(SbContactSurfaceHold(m, 5 * o->n, number, v));
  for (PetscInt i = 0; i < o->n; i++) {
    PetscBool all = PETSC_TRUE;
    PetscBool mine = PETSC_FALSE;

    for (PetscInt k = 0; k < o->point[i].n; k++) {
      all = (PetscBool)(all && v[5 * i + k] >= 0);
      mine = (PetscBool)(mine || (all && m->mine[v[5 * i + k]]));
    }
    if (!all || !mine)
      continue;
    o->point[n] = o->point[i];
    PetscCall(PetscArraycpy(o->point[n].v, v + 5 * i, 5));
    n++;
  }
  o->n = n;
  PetscCall(PetscFree2(number, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactOverlapFind(SbContactSurface m, const PetscReal x[], PetscBool inside,
                                    SbContactOverlap *o)
{
  const PetscInt N = m->nvertex - m->nbody_vertex + m->Nbody_vertex;
  PetscReal *const *follow = SbContactSurfaceFollow(m, x);
  SbContactSurface whole;
  PetscReal *y;
  PetscBool found;

  PetscFunctionBeginUser;
  o->n = o->npoint = o->ncrossing = 0;
  o->deepest = o->farthest = 0.;
  o->touches = PETSC_FALSE;
  if (!o->near) {
    PetscCall(PetscMalloc1(N, &o->near));
    PetscCall(PetscCalloc1(m->space->mesh->nbody + 1, &o->touching));
  }
  PetscCall(PetscArrayzero(o->near, N));
  if (!m->sf) {
    PetscCall(find_overlap(m, x, inside, o));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbContactSurfaceReach(m, 0., x, x));
  x = m->halo ? *follow : x;
  PetscCall(is_crossed(m, x, o, &found));
  o->n = 0;
  PetscCall(PetscArrayzero(o->near, N));
  if (!found && !inside)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactSurfaceGather(m, x, &whole, &y));
  PetscCall(find_overlap(whole, y, inside, o));
  PetscCall(PetscFree(y));
  PetscCall(SbContactSurfaceDestroy(&whole));
  PetscCall(take_points(m, o));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactOverlapFree(SbContactOverlap *o)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(o->point));
  PetscCall(PetscFree(o->near));
  PetscCall(PetscFree(o->touching));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSurfaceIsInside(SbContactSurface m, const PetscReal x[], PetscInt body[2],
                                        PetscBool *found)
{
  const SbMesh mesh = m->space->mesh;
  const PetscInt nbody = mesh->nbody;
  PetscReal *point, *winding;
  PetscMPIInt *speaks;

  PetscFunctionBeginUser;
  *found = PETSC_FALSE;
  PetscCall(PetscCalloc3(nbody, &speaks, 3 * nbody, &point, nbody * nbody, &winding));

  /* the middle of a tet of each body, of the lowest rank that has one */
  for (PetscInt b = 0; b < nbody; b++)
    speaks[b] = PETSC_MPI_INT_MAX;
  for (PetscInt c = 0; c < mesh->ncell_owned; c++)
    speaks[mesh->cell_body[c]] = m->space->rank;
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, speaks, (PetscMPIInt)nbody, MPI_INT, MPI_MIN, m->space->comm));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscInt b = mesh->cell_body[c];

    if (speaks[b] != m->space->rank)
      continue;
    speaks[b] = PETSC_MPI_INT_MAX;
    for (int k = 0; k < 12; k++)
      point[3 * b + k % 3] += 0.25 * mesh->x[3 * mesh->cell[4 * c + k / 3] + k % 3];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, point, (PetscMPIInt)(3 * nbody), MPIU_REAL, MPI_SUM,
                             m->space->comm));

  /* winding number of each surface about it */
  for (PetscInt t = 0; t < m->nkept_triangle; t++) {
    const PetscInt *v = m->triangle + 3 * t;
    const PetscInt to = m->part[v[0]];

    for (PetscInt b = 0; b < nbody; b++)
      if (b != to && m->own[v[0]])
        winding[nbody * b + to] += SbTriangleSolidAngle(x, v, point + 3 * b) / (4. * PETSC_PI);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, winding, (PetscMPIInt)(nbody * nbody), MPIU_REAL,
                             MPI_SUM, m->space->comm));
  for (PetscInt k = 0; k < nbody * nbody && !*found; k++) {
    if (PetscAbsReal(winding[k]) < 0.5)
      continue;
    *found = PETSC_TRUE;
    body[0] = k / nbody;
    body[1] = k % nbody;
  }
  PetscCall(PetscFree3(speaks, point, winding));
  PetscFunctionReturn(PETSC_SUCCESS);
}
