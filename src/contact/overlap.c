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
  inner part counts as inside. The depth of such a point is the distance to the surface along the
  direction. Faces of two bodies in a common plane are on neither side of each other: directions
  come from surfaces that are drawn in by 1e-8 or so, each body by a distance of its own.

  How deep bodies are in each other when a run begins is the largest distance of a point of one
  surface, inside, from the other surface: no motion shorter than that separates them. Corners,
  middles of edges and parts of triangles are probed. Surfaces that are in each other by rounding,
  or by less than the width of a barrier, only touch.

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
#define JITTER 1e-7 /* of that size: largest distance by which surfaces are drawn in */
#define RANDOM 0.05 /* of the difference between two parts: largest random displacement */
#define FLAT 1e-7   /* of the trace: directions in which normals hardly differ */
#define SPIKE 4.    /* largest displacement of a corner over that of its planes */
#define COMMON 1.5 /* longest distance along a common direction over the longest of single points */
#define KEPT \
  0.5              /* of its way, for the direction of the steps before: bodies that are held deform
                         meanwhile, and are let go of when it changes */
#define ALONG 0.7  /* cosine of a common way and the descent of the volume: as good as 1 */
#define ASTRAY 0.1 /* least one that counts */
#define ALIKE 0.9999        /* cosine of directions that are not both tried */
#define DIRECTIONS 64       /* most that are tried for a common way */
#define SAME_DISTANCE 1e-10 /* relative: triangles that share the closest point */
#define DEEPER 1.1  /* a part of a triangle that may be deeper by this factor is looked at */
#define LEVELS 3    /* times that a triangle is cut in four for that */
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

/* Whether an end of edge e that goes through triangle t is prescribed, and only just behind it, or
   on it but for the distance that surfaces are drawn in by, where the triangle has prescribed
   vertices: nothing can move them apart. */
static PetscBool at_rim(SbContactSurface m, const PetscReal x[], const PetscInt e[2], PetscInt t)
{
  const PetscInt *v = m->triangle + 3 * t;
  PetscReal n[3], r[3];
  PetscReal y[12];
  PetscReal length;
  int ny = 6;
  PetscBool at = PETSC_FALSE;
  SbDistance d;

  if (m->rim <= 0. || !(m->driven[v[0]] | m->driven[v[1]] | m->driven[v[2]]))
    return PETSC_FALSE;
  length = 2. * SbContactTriangleArea(x, v, n);
  for (int k = 0; k < 2; k++) {
    SbSubtract(x + 3 * v[0], x + 3 * e[k], r);
    at = (PetscBool)(at || (m->driven[e[k]] && SbDot3(n, r) < m->rim * length &&
                            SbDot3(n, r) > -2. * JITTER * m->size * length));
  }
  if (at || !m->driven[e[0]] || !m->driven[e[1]])
    return at;
  for (int k = 0; k < 9; k++) {
    if (k < 6)
      y[k] = x[3 * e[k / 3] + k % 3];
    if (m->driven[v[k / 3]])
      y[ny++] = x[3 * v[k / 3] + k % 3];
  }
  if (ny == 12)
    SbDistanceFind(SB_PAIR_EDGE_EDGE, y, &d);
  else { /* the vertex first */
    for (int k = 0; k < 3; k++) {
      const PetscReal vertex = y[6 + k];

      y[6 + k] = y[k];
      y[k] = vertex;
    }
    SbDistanceFind(SB_PAIR_VERTEX_EDGE, y, &d);
  }
  return (PetscBool)(d.d < m->rim);
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
  if (!around || side_of(a, b, q, r) != around || side_of(a, b, r, p) != around)
    return PETSC_FALSE;
  return (PetscBool)!at_rim(m, x, e, t);
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

/* A point inside `part`, before its other side is known. */
typedef struct {
  SbPenetration at; /* vertices and weights of the point itself, direction, area */
  PetscInt part;
  PetscReal depth, p[3]; /* expected along the direction; position, m */
  PetscReal inside;      /* distance from the surface, m */
} Point;

/* Work of find_inside(): the directions, the list of vertices that have one so far, the tree of
   triangles, the points. */
typedef struct {
  Ways ways;
  PetscInt n, *list; /* [n] */
  PetscInt *inner;   /* [nvertex] the part that it is inside, by intersections alone; -1: none */
  SbBoxTree tree;
  PetscInt npoint, point_size;
  Point *point; /* [npoint] */
} Search;

static PetscErrorCode begin_search(SbContactSurface m, const PetscReal x[], Search *search)
{
  Ways *w = &search->ways;

  PetscFunctionBeginUser;
  *search = (Search){.ways = {.x = x}};
  PetscCall(PetscCalloc7(m->nvertex, &w->in, m->nvertex, &search->list, 3 * m->nvertex, &w->way,
                         m->nvertex, &w->depth, m->nvertex, &w->sum, m->nvertex, &w->layer,
                         m->nedge, &w->through));
  PetscCall(PetscMalloc2(3 * m->nvertex, &w->normal, m->nvertex, &search->inner));
  PetscCall(SbContactSurfaceNormals(m, x, w->normal));
  for (PetscInt v = 0; v < m->nvertex; v++) {
    (void)SbNormalise(w->normal + 3 * v);
    w->in[v] = search->inner[v] = -1;
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
  PetscCall(PetscFree2(w->normal, search->inner));
  PetscCall(PetscFree(w->start));
  PetscCall(PetscFree(w->edge));
  PetscCall(PetscFree(search->point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode add_point(const Point *point, Search *search)
{
  PetscFunctionBeginUser;
  PetscCall(SbReserve(search->npoint + 1, sizeof(*point), &search->point_size, &search->point));
  search->point[search->npoint++] = *point;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An edge enters a body at the triangle hit[0] and leaves it at hit[1]: the midpoint between both
   is inside. */
static PetscErrorCode add_midpoint(SbContactSurface m, PetscInt e, const PetscInt hit[2],
                                   Search *search)
{
  const PetscReal *x = search->ways.x;
  const PetscInt *ends = m->edge + 2 * e;
  PetscReal normal[2][3], s[2], unused;
  PetscReal chord = 0.;
  PetscReal at;
  Point point = {.at = {.n = 2, .v = {ends[0], ends[1]}, .area = m->edge_area[e]},
                 .part = m->part[m->triangle[3 * hit[0]]]};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++)
    s[k] = pierce(m, x, e, hit[k], normal[k], &unused);
  at = 0.5 * (s[0] + s[1]);
  point.at.weight[0] = 1. - at;
  point.at.weight[1] = at;
  for (int k = 0; k < 3; k++) {
    point.at.normal[k] = normal[0][k] + normal[1][k];
    point.p[k] = (1. - at) * x[3 * ends[0] + k] + at * x[3 * ends[1] + k];
    chord += PetscSqr((s[1] - s[0]) * (x[3 * ends[1] + k] - x[3 * ends[0] + k]));
  }
  point.depth = PetscSqrtReal(chord);
  if (SbNormalise(point.at.normal) <= CANCEL)
    for (int k = 0; k < 3; k++)
      point.at.normal[k] = 0.;
  PetscCall(add_point(&point, search));
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
  search->inner[v] = m->part[m->triangle[3 * t]];
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
      PetscCall(add_midpoint(m, e, (const PetscInt[2]){t, hit[2 * j + 1]}, search));
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
      search->inner[to] = search->inner[list[k]];
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

/* Distance of p from the surface of `part`, m, negative outside. At an edge or a corner the sign is
   that of the triangle that p faces most; where no other triangle meets there the surface ends, and
   p is outside. */
static PetscReal depth_at(SbContactSurface m, const PetscReal x[], const SbBoxTree *tree,
                          PetscInt part, const PetscReal p[3])
{
  const PetscReal box[6] = {p[0], p[1], p[2], p[0], p[1], p[2]};
  PetscReal depth = -PETSC_MAX_REAL;
  PetscReal least = PETSC_MAX_REAL;
  PetscReal facing = -1.;
  PetscInt n = 0; /* triangles at that distance */
  PetscInt t;
  SbBoxNearest near;

  for (SbBoxNearestBegin(tree, box, PETSC_MAX_REAL, &near); SbBoxNearestNext(&near, &t);) {
    const PetscInt *v = m->triangle + 3 * t;
    const PetscReal *const at[3] = {x + 3 * v[0], x + 3 * v[1], x + 3 * v[2]};
    PetscReal weight[3], normal[3], r[3], d2, height;
    PetscBool face;

    if (m->part[v[0]] != part)
      continue;
    face = (PetscBool)(SbTriangleClosestPoint(p, at, weight, &d2) == SB_FEATURE_FACE);
    if (d2 > (1. + SAME_DISTANCE) * least)
      continue;
    if (d2 < (1. - SAME_DISTANCE) * least) {
      n = 0;
      facing = -1.;
    }
    n += face ? 2 : 1;
    least = PetscMin(least, d2);
    near.limit2 = (1. + SAME_DISTANCE) * least;
    (void)SbContactTriangleArea(x, v, normal);
    (void)SbNormalise(normal);
    SbSubtract(p, at[0], r);
    height = SbDot3(normal, r);
    if (PetscAbsReal(height) <= facing)
      continue;
    facing = PetscAbsReal(height);
    depth = face ? -height : PetscSqrtReal(d2) * (height < 0. ? 1. : -1.);
  }
  return n > 1 ? depth : -PetscAbsReal(depth);
}

/* Length of the ray from p along n until it leaves the surface of `part`, m; limit: it does not
   within that. */
static PetscReal way_out(SbContactSurface m, const PetscReal x[], const SbBoxTree *tree,
                         PetscInt part, const PetscReal p[3], const PetscReal n[3], PetscReal limit)
{
  PetscReal box[6], end[3];
  PetscReal least = limit;
  PetscInt t;
  SbBoxNearest query;

  SbBoxClear(box);
  SbBoxAdd(box, p);
  for (int i = 0; i < 3; i++)
    end[i] = p[i] + limit * n[i];
  SbBoxAdd(box, end);
  for (SbBoxNearestBegin(tree, box, 0, &query); SbBoxNearestNext(&query, &t);) {
    const PetscInt *v = m->triangle + 3 * t;
    const PetscReal *const at[3] = {x + 3 * v[0], x + 3 * v[1], x + 3 * v[2]};
    PetscReal weight[3], length;
    PetscBool out;

    if (m->part[v[0]] == part && SbRayTriangle(p, n, at, &length, weight, &out) && out)
      least = PetscMin(least, length);
  }
  return least;
}

/* Longest distance to the surface of the points of two parts in each other, those of part[0] along
   n and those of part[1] against it, m; limit: it is not shorter. */
static PetscReal longest_way(SbContactSurface m, const Search *search, const PetscInt part[2],
                             const PetscReal n[3], PetscReal limit)
{
  const PetscReal back[3] = {-n[0], -n[1], -n[2]};
  PetscReal most = 0.;

  for (PetscInt i = 0; i < search->npoint && most < limit; i++) {
    const Point *point = &search->point[i];
    const PetscInt own = m->part[point->at.v[0]];
    const PetscBool forth = (PetscBool)(own == part[0] && point->part == part[1]);

    if (forth || (own == part[1] && point->part == part[0]))
      most = PetscMax(most, way_out(m, search->ways.x, &search->tree, point->part, point->p,
                                    forth ? n : back, limit));
  }
  return most;
}

/* The direction in which the volume that two parts share falls fastest, as seen by the points:
   minus the sum of the areas of part[0] inside part[1], plus that of the other; 0: they cancel. */
static void find_descent(SbContactSurface m, const Search *search, const PetscInt part[2],
                         PetscReal way[3])
{
  PetscReal all = 0.;

  for (int k = 0; k < 3; k++)
    way[k] = 0.;
  for (PetscInt i = 0; i < search->npoint; i++) {
    const Point *p = &search->point[i];
    const PetscInt own = m->part[p->at.v[0]];
    const PetscBool forth = (PetscBool)(own == part[0] && p->part == part[1]);

    if (!forth && (own != part[1] || p->part != part[0]))
      continue;
    all += p->at.area;
    for (PetscInt j = 0; j < p->at.n; j++)
      for (int k = 0; k < 3; k++)
        way[k] += (forth ? -1. : 1.) * p->at.area * p->at.weight[j] *
                  search->ways.normal[3 * p->at.v[j] + k];
  }
  if (SbNormalise(way) <= ASTRAY * all)
    for (int k = 0; k < 3; k++)
      way[k] = 0.;
}

/*
  A direction n in which two parts separate as a whole: of the normals of their triangles that edges
  go through, hit[n][2], their mean and find_descent(), the one with the shortest way for all points
  over the cosine to the latter. So faces part along their normal, where edges that go through their
  sides, too, would lead elsewhere, and a finger leaves through the hole that it made. `most`:
  longest way of the points each along its own direction, m, or distance of one from the surface;
  one that is much longer is of surfaces that wrap around each other. Returns the way, m; 0: there
  is none.
*/
static PetscReal find_common_way(SbContactSurface m, const Search *search, PetscInt n,
                                 const PetscInt hit[], const PetscInt part[2], PetscReal most,
                                 const PetscReal before[3], PetscReal way[3])
{
  const PetscReal limit = COMMON * most;
  PetscReal tried[DIRECTIONS][3];
  PetscReal mean[3] = {0.};
  PetscReal descent[3];
  PetscReal least = limit * ALONG / ASTRAY;
  PetscReal found = 0.;
  int ntried = 0;

  find_descent(m, search, part, descent);
  for (PetscInt i = -1; i <= n + 1; i++) {
    const PetscBool of_hit = (PetscBool)(i >= 0 && i < n);
    const PetscInt t = of_hit ? hit[2 * i + 1] : -1;
    const PetscInt inner = of_hit ? m->part[m->edge[2 * hit[2 * i]]] : part[0];
    const PetscInt outer = of_hit ? m->part[m->triangle[3 * t]] : part[1];
    const PetscReal sign = inner == part[0] && outer == part[1] ? 1. : -1.;
    PetscReal normal[3], length, cosine;
    PetscBool again = PETSC_FALSE;

    if (inner != part[sign > 0. ? 0 : 1] || outer != part[sign > 0. ? 1 : 0])
      continue;
    if (of_hit)
      (void)SbContactTriangleArea(search->ways.x, m->triangle + 3 * t, normal);
    for (int k = 0; k < 3 && !of_hit; k++)
      normal[k] = i < 0 ? before[k] : i == n ? mean[k] : descent[k];
    if ((i == n + 1 && found > 0.) || SbNormalise(normal) <= 0.)
      continue;
    for (int k = 0; k < 3; k++) {
      normal[k] *= sign;
      mean[k] += of_hit ? normal[k] : 0.;
    }
    for (int k = 0; k < ntried; k++)
      again = (PetscBool)(again || SbDot3(tried[k], normal) > ALIKE);
    if (again || (of_hit && ntried == DIRECTIONS - 2))
      continue;
    for (int k = 0; k < 3; k++)
      tried[ntried][k] = normal[k];
    ntried++;
    cosine = SbDot3(descent, descent) > 0.
               ? PetscMin(1., PetscMax(SbDot3(descent, normal), ASTRAY) / ALONG)
               : 1.;
    length = longest_way(m, search, part, normal, PetscMin(limit, cosine * least));
    if (length >= PetscMin(limit, cosine * least) || length <= 0.)
      continue;
    least = (i < 0 ? KEPT : 1.) * length / cosine;
    found = length;
    for (int k = 0; k < 3; k++)
      way[k] = normal[k];
  }
  return found;
}

/* The points of two parts get one direction, if there is one. */
static PetscErrorCode agree_on_way(SbContactSurface m, PetscInt n, const PetscInt hit[],
                                   const PetscInt part[2], Search *search, SbContactOverlap *o)
{
  PetscReal most = 0.;
  PetscReal way[3] = {0.};
  PetscReal length;
  PetscInt at = 0;

  PetscFunctionBeginUser;
  while (at < o->nway && (o->way[at].part[0] != part[0] || o->way[at].part[1] != part[1]))
    at++;
  if (at == o->nway) {
    PetscCall(SbReserve(at + 1, sizeof(*o->way), &o->way_size, &o->way));
    o->way[o->nway++] = (SbOverlapWay){.part = {part[0], part[1]}};
  }
  for (PetscInt i = 0; i < search->npoint; i++) {
    const Point *p = &search->point[i];
    const PetscInt own = m->part[p->at.v[0]];

    if ((own != part[0] || p->part != part[1]) && (own != part[1] || p->part != part[0]))
      continue;
    most = PetscMax(most, p->inside);
    most = PetscMax(most, SbDot3(p->at.normal, p->at.normal) > 0.
                            ? way_out(m, search->ways.x, &search->tree, p->part, p->p, p->at.normal,
                                      FAR * p->depth)
                            : p->depth);
  }
  length = find_common_way(m, search, n, hit, part, most, o->way[at].n, way);
  if (length > 0.)
    PetscCall(PetscArraycpy(o->way[at].n, way, 3));
  for (PetscInt i = 0; i < search->npoint && length > 0.; i++) {
    Point *p = &search->point[i];
    const PetscInt own = m->part[p->at.v[0]];
    const PetscBool forth = (PetscBool)(own == part[0] && p->part == part[1]);

    if (!forth && (own != part[1] || p->part != part[0]))
      continue;
    p->depth = length;
    for (int k = 0; k < 3; k++)
      p->at.normal[k] = forth ? way[k] : -way[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each two parts of which an edge of one goes through a triangle of the other. */
static PetscErrorCode agree_on_ways(SbContactSurface m, PetscInt n, const PetscInt hit[],
                                    Search *search, SbContactOverlap *o)
{
  PetscInt npair = 0;
  PetscInt *pair;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(2 * n, &pair));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt one = m->part[m->edge[2 * hit[2 * i]]];
    const PetscInt two = m->part[m->triangle[3 * hit[2 * i + 1]]];

    if (one == two)
      continue;
    pair[2 * npair] = PetscMin(one, two);
    pair[2 * npair++ + 1] = PetscMax(one, two);
  }
  PetscCall(SbSortByKeys(npair, 2 * sizeof(*pair), 2, pair));
  for (PetscInt i = 0; i < npair; i++)
    if (!i || pair[2 * i] != pair[2 * i - 2] || pair[2 * i + 1] != pair[2 * i - 1])
      PetscCall(agree_on_way(m, n, hit, pair + 2 * i, search, o));
  PetscCall(PetscFree(pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points inside triangulated surfaces, from the intersections hit[n][2] of edges and triangles. */
static PetscErrorCode find_inside(SbContactSurface m, const PetscReal x[], PetscInt n,
                                  const PetscInt hit[], SbContactOverlap *o)
{
  Search search;
  const Ways *w = &search.ways;
  PetscInt ninside = 0;

  PetscFunctionBeginUser;
  PetscCall(begin_search(m, x, &search));
  PetscCall(read_crossings(m, n, hit, &search, o));

  /* directions and depths of the vertices inside */
  spread_ways(m, &search.ways, search.n, search.list);
  spread_inside(m, &search, o);
  for (PetscInt v = 0; v < m->nvertex; v++) {
    Point point = {.at = {.n = 1, .v = {v}, .weight = {1.}, .area = m->area[v]},
                   .part = w->layer[v] ? w->in[v] : search.inner[v],
                   .depth = PetscMax(w->depth[v], 0.)};

    if (point.part < 0)
      continue;
    for (int k = 0; k < 3; k++) {
      point.at.normal[k] = w->way[3 * v + k];
      point.p[k] = x[3 * v + k];
    }
    PetscCall(add_point(&point, &search));
  }

  /* an edge that goes through a rim twice has no part inside */
  for (PetscInt i = 0; i < search.npoint; i++) {
    Point p = search.point[i];

    if (m->part[p.at.v[0]] != p.part)
      p.inside = depth_at(m, x, &search.tree, p.part, p.p);
    if (p.inside >= 0.)
      search.point[ninside++] = p;
  }
  search.npoint = ninside;
  PetscCall(agree_on_ways(m, n, hit, &search, o));
  for (PetscInt i = 0; i < search.npoint; i++) {
    Point *p = &search.point[i];

    if (p->depth > 0. && SbDot3(p->at.normal, p->at.normal) > 0.)
      PetscCall(add_inside(m, x, &search.tree, p->part, p->depth, p->p, &p->at, o));
  }

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

/* The largest depth of points of surfaces that are in each other, and where it is. */
typedef struct {
  SbContactSurface m;
  const PetscReal *x;
  SbBoxTree tree;
  PetscReal depth, place[3]; /* m */
  PetscInt part[2];          /* of the surface with the point, of the one around it */
} Deepest;

/* A point p of the surface of part[0] that may be inside part[1]; returns its depth, m. */
static PetscReal probe(Deepest *d, const PetscInt part[2], const PetscReal p[3])
{
  const PetscReal depth = depth_at(d->m, d->x, &d->tree, part[1], p);

  if (depth > d->depth) {
    d->depth = depth;
    for (int i = 0; i < 3; i++)
      d->place[i] = p[i];
    for (int i = 0; i < 2; i++)
      d->part[i] = part[i];
  }
  return depth;
}

/* The centroid of a triangle with the corners c, then of its four parts, while they may be deeper:
   depth changes by a distance at most. */
static void probe_triangle(Deepest *d, const PetscInt part[2], const PetscReal c[9], int level)
{
  PetscReal mid[9], centre[3], reach;
  PetscReal far = 0.;

  for (int i = 0; i < 3; i++)
    centre[i] = (c[i] + c[3 + i] + c[6 + i]) / 3.;
  for (int k = 0; k < 3; k++)
    far = PetscMax(far, SbDistance2(centre, c + 3 * k));
  reach = probe(d, part, centre) + PetscSqrtReal(far);
  if (!level || reach <= DEEPER * d->depth)
    return;
  for (int k = 0; k < 9; k++)
    mid[k] = 0.5 * (c[k] + c[(k + 3) % 9]);
  probe_triangle(d, part, mid, level - 1);
  for (int k = 0; k < 3; k++) {
    PetscReal corner[9];

    for (int i = 0; i < 3; i++) {
      corner[i] = c[3 * k + i];
      corner[3 + i] = mid[3 * k + i];
      corner[6 + i] = mid[3 * ((k + 2) % 3) + i];
    }
    probe_triangle(d, part, corner, level - 1);
  }
}

/* Surfaces near an overlap: list[n][2], triangles and the parts that they may be in. */
typedef struct {
  PetscInt n, size, *list;
  PetscInt *start, *triangle; /* [nvertex+1], triangles of each vertex */
} Inner;

/* Adds the triangles around vertex v, if v2 >= 0 those with both. */
static PetscErrorCode add_inner(SbContactSurface m, PetscInt v, PetscInt v2, PetscInt part,
                                Inner *inner)
{
  PetscFunctionBeginUser;
  PetscCall(SbReserve(inner->n + 2 * (inner->start[v + 1] - inner->start[v]), sizeof(*inner->list),
                      &inner->size, &inner->list));
  for (PetscInt j = inner->start[v]; j < inner->start[v + 1]; j++) {
    const PetscInt *w = m->triangle + 3 * inner->triangle[j];

    if (v2 >= 0 && w[0] != v2 && w[1] != v2 && w[2] != v2)
      continue;
    inner->list[inner->n++] = inner->triangle[j];
    inner->list[inner->n++] = part;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where edges that go through triangles, hit[n][2], show surfaces that are in each other: middles
   of edges that leave again are probed; ends inside, and vertices joined to them by edges that
   intersect nothing, give the triangles around them. y: positions at which hit[] was found. self: a
   surface intersects itself. */
static PetscErrorCode find_inner(const PetscReal y[], PetscInt n, const PetscInt hit[], Deepest *d,
                                 Inner *inner, PetscBool *self)
{
  const SbContactSurface m = d->m;
  PetscInt nlist = 0;
  PetscInt *list, *in, *start, *edge;
  uint8_t *through;

  PetscFunctionBeginUser;
  *self = PETSC_FALSE;
  PetscCall(PetscCalloc3(m->nvertex, &list, m->nvertex, &in, m->nedge, &through));
  PetscCall(SbBucketByKey(2 * m->nedge, m->edge, m->nvertex, &start, &edge));
  for (PetscInt v = 0; v < m->nvertex; v++)
    in[v] = -1;
  for (PetscInt i = 0; i < n; i++)
    through[hit[2 * i]] = 1;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt *ends = m->edge + 2 * hit[2 * i];
    const PetscInt *corner = m->triangle + 3 * hit[2 * i + 1];
    const PetscInt part[2] = {m->part[ends[0]], m->part[corner[0]]};
    PetscReal normal[3], first, unused, p[3];
    const PetscReal s = pierce(m, y, hit[2 * i], hit[2 * i + 1], normal, &first);
    const PetscInt v = ends[first < 0. ? 0 : 1];
    PetscInt j = i + 1;

    if (part[0] == part[1]) {
      *self = PETSC_TRUE;
      continue;
    }
    PetscCall(add_inner(m, ends[0], ends[1], part[1], inner));
    PetscCall(add_inner(m, corner[0], corner[1], part[0], inner));
    for (; j < n && hit[2 * j] == hit[2 * i]; j++) {
      const PetscReal at = 0.5 * (s + pierce(m, y, hit[2 * i], hit[2 * j + 1], normal, &unused));

      for (int k = 0; k < 3; k++)
        p[k] = (1. - at) * d->x[3 * ends[0] + k] + at * d->x[3 * ends[1] + k];
      (void)probe(d, part, p);
    }
    if (in[v] >= 0)
      continue;
    in[v] = part[1];
    list[nlist++] = v;
  }
  for (PetscInt k = 0; k < nlist; k++) {
    const PetscInt v = list[k];

    PetscCall(add_inner(m, v, -1, in[v], inner));
    for (PetscInt j = start[v]; j < start[v + 1]; j++) {
      const PetscInt *e = m->edge + 2 * (edge[j] / 2);
      const PetscInt to = e[0] == v ? e[1] : e[0];

      if (through[edge[j] / 2] || in[to] >= 0)
        continue;
      in[to] = in[v];
      list[nlist++] = to;
    }
  }
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(edge));
  PetscCall(PetscFree3(list, in, through));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* o->farthest of surfaces of different parts, and where; o->touches: it is less than o->touch. */
static PetscErrorCode find_depth(SbContactSurface m, const PetscReal x[], const PetscReal y[],
                                 PetscInt n, const PetscInt hit[], SbContactOverlap *o)
{
  Deepest d = {.m = m, .x = x, .part = {-1, -1}};
  Inner inner = {0};
  PetscBool self;

  PetscFunctionBeginUser;
  PetscCall(SbBoxTreeCreateTriangles(m->ntriangle, m->triangle, x, &d.tree));
  PetscCall(
    SbBucketByKey(3 * m->ntriangle, m->triangle, m->nvertex, &inner.start, &inner.triangle));
  for (PetscInt k = 0; k < 3 * m->ntriangle; k++)
    inner.triangle[k] /= 3;
  PetscCall(find_inner(y, n, hit, &d, &inner, &self));
  inner.n /= 2;
  PetscCall(SbSortByKeys(inner.n, 2 * sizeof(*inner.list), 2, inner.list));

  /* corners first: what is deep tells which triangles need no closer look */
  for (int level = -1; level <= LEVELS; level += LEVELS + 1) {
    for (PetscInt i = 0; i < inner.n; i++) {
      const PetscInt *v = m->triangle + 3 * inner.list[2 * i];
      const PetscInt part[2] = {m->part[v[0]], inner.list[2 * i + 1]};
      PetscReal c[9];

      if (part[0] == part[1] || (i && inner.list[2 * i] == inner.list[2 * i - 2] &&
                                 inner.list[2 * i + 1] == inner.list[2 * i - 1]))
        continue;
      for (int k = 0; k < 9; k++)
        c[k] = x[3 * v[k / 3] + k % 3];
      for (int k = 0; k < 3 && level < 0; k++)
        (void)probe(&d, part, c + 3 * k);
      if (level >= 0)
        probe_triangle(&d, part, c, level);
    }
  }
  o->farthest = d.depth;
  if (d.part[0] >= 0) {
    PetscCall(PetscArraycpy(o->part, d.part, 2));
    PetscCall(PetscArraycpy(o->place, d.place, 3));
  }
  o->touches = (PetscBool)(!self && o->farthest < o->touch);
  for (PetscInt i = 0; i < n && o->touches; i++) {
    o->touching[m->part[m->edge[2 * hit[2 * i]]]] |= SB_TOUCH_ONCE;
    o->touching[m->part[m->triangle[3 * hit[2 * i + 1]]]] |= SB_TOUCH_ONCE;
  }
  PetscCall(SbBoxTreeDestroy(&d.tree));
  PetscCall(PetscFree(inner.start));
  PetscCall(PetscFree(inner.triangle));
  PetscCall(PetscFree(inner.list));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves (A + e I) u = b, e a small part of the trace of the symmetric A. */
static void solve_nearly(const PetscReal A[9], const PetscReal b[3], PetscReal u[3])
{
  PetscReal B[9], C[9];
  PetscReal det;

  for (int k = 0; k < 9; k++)
    B[k] = A[k] + (k % 4 ? 0. : FLAT * (A[0] + A[4] + A[8]));
  SbMatCofactor(B, C);
  det = SbDot3(B, C);
  for (int i = 0; i < 3; i++)
    u[i] = det > 0. ? SbDot3(C + 3 * i, b) / det : 0.;
}

/*
  y[nvertex][3] of SbContactSurfaceCreateArray(): x with all planes of a part's surface moved
  inwards by the same distance, up to JITTER of the size, and vertices by a little more at random,
  the same in every run. Distances of two parts differ, so that faces in a common plane are so no
  longer: the sides of one part are wholly within those of the other, and only what really overlaps
  intersects. Collective.
*/
static PetscErrorCode draw_in(SbContactSurface m, const PetscReal x[], PetscReal y[])
{
  const PetscReal unit = JITTER * m->size / (PetscReal)(m->space->mesh->nbody + 1);
  PetscReal *sum; /* [nvertex][12] of n n^T and n of the triangles around */

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(12 * m->nvertex, &sum));
  for (PetscInt t = 0; t < m->ntriangle; t++) {
    PetscReal n[3];

    (void)SbContactTriangleArea(x, m->triangle + 3 * t, n);
    if (SbNormalise(n) <= 0.)
      continue;
    for (int k = 0; k < 3; k++) {
      PetscReal *to = sum + 12 * m->triangle[3 * t + k];

      for (int i = 0; i < 9; i++)
        to[i] += n[i / 3] * n[i % 3];
      for (int i = 0; i < 3; i++)
        to[9 + i] += n[i];
    }
  }
  for (PetscInt v = 0; v < m->nvertex; v++) {
    PetscReal way[3], length;

    solve_nearly(sum + 12 * v, sum + 12 * v + 9, way);
    length = PetscSqrtReal(SbDot3(way, way));
    for (int i = 0; i < 3; i++) {
      uint32_t h = (uint32_t)(3 * SbContactNumber(m, v) + i + 1) * 2654435761u;

      h = (h ^ (h >> 15)) * 2246822519u;
      h = (h ^ (h >> 13)) * 3266489917u;
      y[3 * v + i] = x[3 * v + i] -
                     unit * (PetscReal)(m->part[v] + 1) * way[i] / PetscMax(1., length / SPIKE) +
                     RANDOM * unit * (2. * ((PetscReal)(h ^ (h >> 16)) / 4294967296.) - 1.);
    }
  }
  PetscCall(PetscFree(sum));
  PetscCall(SbContactSurfaceUpdate(m, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Penetrations of the whole surface, on every rank. */
static PetscErrorCode find_overlap(SbContactSurface m, const PetscReal x[], PetscBool inside,
                                   SbContactOverlap *o)
{
  PetscInt n, nmoved, *hit, *other;
  PetscReal *moved = NULL;
  const PetscReal *at = x; /* positions of what is taken */

  PetscFunctionBeginUser;
  PetscCall(find_crossings(m, x, &n, &hit));

  /* vertices exactly on a surface are on neither side, nor are faces in a common plane */
  if (n || inside || o->coplanar) {
    PetscCall(PetscMalloc1(3 * m->nvertex, &moved));
    PetscCall(draw_in(m, x, moved));
    PetscCall(find_crossings(m, moved, &nmoved, &other));
    if (nmoved) {
      PetscCall(PetscFree(hit));
      n = nmoved;
      hit = other;
      at = moved;
    } else
      PetscCall(PetscFree(other));
  }
  if (n) {
    o->part[0] = m->part[m->edge[2 * hit[0]]];
    o->part[1] = m->part[m->triangle[3 * hit[1]]];
    PetscCall(PetscArraycpy(o->place, x + 3 * m->edge[2 * hit[0]], 3));
    if (o->touch > 0.)
      PetscCall(find_depth(m, x, at, n, hit, o));
    if (!o->touches || inside) {
      o->touches = PETSC_FALSE;
      PetscCall(find_inside(m, at, n, hit, o));
    }
    for (PetscInt i = 0; i < n && !o->touches; i++) {
      o->touching[m->part[m->edge[2 * hit[2 * i]]]] |= SB_TOUCH_OVERLAP;
      o->touching[m->part[m->triangle[3 * hit[2 * i + 1]]]] |= SB_TOUCH_OVERLAP;
    }
  }
  PetscCall(PetscFree(moved));
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

  if (o->ncrossing && !n) {
    o->part[0] = m->part[o->point[0].v[0]];
    o->part[1] = m->space->mesh->nbody;
    PetscCall(PetscArraycpy(o->place, x + 3 * o->point[0].v[0], 3));
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

PetscErrorCode SbContactOverlapCreate(SbContactSurface m, SbContactOverlap *o)
{
  PetscFunctionBeginUser;
  if (o->near)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(m->nvertex - m->nbody_vertex + m->Nbody_vertex, &o->near));
  PetscCall(PetscCalloc1(m->space->mesh->nbody + 1, &o->touching));
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
  PetscCall(SbContactOverlapCreate(m, o));
  PetscCall(PetscArrayzero(o->near, N));
  for (PetscInt k = 0; k <= m->space->mesh->nbody; k++)
    o->touching[k] &= ~SB_TOUCH_OVERLAP;
  if (!m->sf) {
    PetscCall(find_overlap(m, x, inside, o));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbContactSurfaceReach(m, 0., x, x));
  x = m->halo ? *follow : x;
  PetscCall(is_crossed(m, x, o, &found));
  if (!found && o->coplanar) {
    PetscReal *moved;

    PetscCall(PetscMalloc1(3 * m->nvertex, &moved));
    PetscCall(draw_in(m, x, moved));
    PetscCall(is_crossed(m, moved, o, &found));
    PetscCall(PetscFree(moved));
  }
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
  PetscCall(PetscFree(o->way));
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
