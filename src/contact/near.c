/*
  near.c - the narrow phase: from candidates to contacts.

  Nearest points of triangles are those of closest_point.c. Which side the point is on is told
  by the pseudonormal there (Baerentzen and Aanaes, "Signed distance computation using the angle weighted pseudonormal", IEEE TVCG
  11(3), 2005): of a face its normal, of an edge the sum of its facets' normals, of a vertex their sum weighted by their angles. Facets
  belong together by the identities of their vertices, so that the open joints of CR and DG are closed.

  For each point and each other part, of the facets within reach the nearest counts that
  - is a nearest place of the surface around it, not only of its own facet: elsewhere the pseudonormal means nothing;
  - sees the point on the side where the nearest facet of all sees it: behind a thin plate one is not inside;
  - faces the point: their normals oppose each other. In a thin plate that a point has entered the back may be nearer than the front,
    but the separation direction is the front;
  - agrees with the motion: when the point went through the part's surface in this step, the normal must not point to the far side of
    where it came in, and the point must have been in front of the place: one that came over a rim is not pushed out sideways.
  When there is none, and the point went through a facet that faces it, that facet is the contact: this is how a thin plate stops what is
  past it at the end of the step. Points that were inside already when the step began are found up to the scene's `deep`.
*/
#include "detect.h"

#define TIE 1e-12     /* of the reach: distances that are equal; the lower identity of the facet then wins */
#define TIE_TIME 1e-9 /* of the step: passages at the same time */
#define TOUCH 1e-9    /* of the reach: places that are one */
#define AT \
  1e-4 /* of the reach: nearer than this the way to an edge or corner is no direction to push along */
#define FACING 1e-6 /* cosine: normals oppose each other by more than rounding */
#define START \
  0.1 /* of the reach: so far behind a facet a point may begin the step and still be in front: it lay in contact */
#define FLAT 1e-12   /* area over squared length, below which a triangle has no normal */
#define AHEAD 16     /* candidates: facets are fetched so far ahead */
#define SELF_REACH 2 /* in reaches: what is nearer at rest is no self-contact */

/* A facet near a point, or one that it went through. */
struct SbDetectHit {
  PetscInt part, facet, id;
  SbTriangleFeature place;
  PetscBool behind; /* crossing: the point lay just behind the facet when the step began */
  PetscReal key;    /* distance, m; crossing: time */
  PetscReal weight[3];
};
typedef struct SbDetectHit Hit;

/* One point and what it meets. */
typedef struct {
  const struct _p_SbDetector *d;
  const SbDetectScene *s;
  const SbDetectRings *rings;
  PetscInt point;
  const PetscReal *p, *normal;
  PetscInt nhit, ncross;
  Hit *hit, *cross;
} Look;

/* ------------------------------------------------------------------ triangles */

static inline void corners(const SbDetectScene *s, const PetscReal x[], PetscInt facet, const PetscReal *c[3])
{
  for (int k = 0; k < 3; k++) c[k] = x + 3 * s->facet[3 * facet + k];
}

static inline void subtract(const PetscReal a[3], const PetscReal b[3], PetscReal c[3])
{
  for (int k = 0; k < 3; k++) c[k] = a[k] - b[k];
}

/* p minus the point with these weights. */
static inline void away(const PetscReal p[3], const PetscReal *const x[3], const PetscReal w[3],
                        PetscReal r[3])
{
  for (int k = 0; k < 3; k++)
    r[k] = w[0] * (p[k] - x[0][k]) + w[1] * (p[k] - x[1][k]) + w[2] * (p[k] - x[2][k]);
}

/* Unit normal; false and zero when the triangle has no area. */
static PetscBool unit_normal(const PetscReal *const x[3], PetscReal n[3])
{
  PetscReal v[3], w[3], length, scale;

  subtract(x[1], x[0], v);
  subtract(x[2], x[0], w);
  SbCross(v, w, n);
  length = PetscSqrtReal(SbDot3(n, n));
  scale = PetscMax(SbDot3(v, v), SbDot3(w, w));
  if (!(length > FLAT * scale)) {
    n[0] = n[1] = n[2] = 0;
    return PETSC_FALSE;
  }
  for (int k = 0; k < 3; k++) n[k] /= length;
  return PETSC_TRUE;
}

/* Angle at corner k. */
static PetscReal angle(const PetscReal *const x[3], int k)
{
  PetscReal a[3], b[3], c[3];

  subtract(x[(k + 1) % 3], x[k], a);
  subtract(x[(k + 2) % 3], x[k], b);
  SbCross(a, b, c);
  return atan2(PetscSqrtReal(SbDot3(c, c)), SbDot3(a, b));
}

/* ------------------------------------------------------------------ neighbours */

PetscErrorCode SbDetectRingsDestroy(SbDetector d)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree3(d->rings.vertex, d->rings.ring_start, d->rings.ring));
  d->ring_size = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners of one mesh vertex by part and identity of the facet: sums do not depend on the partition. */
static void sort_ring(const SbDetectScene *s, PetscInt n, PetscInt ring[])
{
  for (PetscInt i = 1; i < n; i++) {
    const PetscInt c = ring[i], f = c / 3;
    PetscInt j = i;

    for (; j > 0; j--) {
      const PetscInt g = ring[j - 1] / 3;

      if (s->facet_part[g] < s->facet_part[f] ||
          (s->facet_part[g] == s->facet_part[f] && s->facet_id[g] <= s->facet_id[f]))
        break;
      ring[j] = ring[j - 1];
    }
    ring[j] = c;
  }
}

PetscErrorCode SbDetectRingsUpdate(SbDetector d, const SbDetectScene *s)
{
  SbDetectRings *r = &d->rings;
  const PetscInt n = 3 * s->nfacet;
  PetscInt *key;

  PetscFunctionBeginUser;
  if (d->same_facets) PetscFunctionReturn(PETSC_SUCCESS);
  if (n > d->ring_size || !r->ring) {
    PetscCall(SbDetectRingsDestroy(d));
    PetscCall(PetscMalloc3(n, &r->vertex, n + 1, &r->ring_start, n, &r->ring));
    d->ring_size = n;
  }
  PetscCall(PetscMalloc1(n, &key));
  for (PetscInt i = 0; i < n; i++) {
    key[i] = s->facet_vertex[i];
    r->ring[i] = i;
  }
  PetscCall(PetscSortIntWithArray(n, key, r->ring));
  r->nvertex = 0;
  for (PetscInt i = 0, end; i < n; i = end) {
    for (end = i + 1; end < n && key[end] == key[i];) end++;
    sort_ring(s, end - i, r->ring + i);
    for (PetscInt j = i; j < end; j++) {
      if (j == i || s->facet_part[r->ring[j] / 3] != s->facet_part[r->ring[j - 1] / 3])
        r->ring_start[r->nvertex++] = j;
      r->vertex[r->ring[j]] = r->nvertex - 1;
    }
  }
  r->ring_start[r->nvertex] = n;
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Next facet after ring place *j that has the edge or vertex `place` of `facet`, with the corner of it; false: no more. */
static PetscBool next_around(const SbDetectRings *r, PetscInt facet, SbTriangleFeature place, PetscInt *j,
                             PetscInt *g, int *corner)
{
  const int k = place % 3;
  const PetscInt a = r->vertex[3 * facet + k], b = r->vertex[3 * facet + (k + 1) % 3];

  for (*j = *j < 0 ? r->ring_start[a] : *j + 1; *j < r->ring_start[a + 1]; (*j)++) {
    const PetscInt *v;

    *g = r->ring[*j] / 3;
    *corner = (int)(r->ring[*j] % 3);
    v = r->vertex + 3 * *g;
    if (place <= SB_FEATURE_CORNER_2 || v[0] == b || v[1] == b || v[2] == b) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* ------------------------------------------------------------------ which side */

static inline void add(PetscReal a, const PetscReal n[3], PetscReal sum[3])
{
  for (int k = 0; k < 3; k++) sum[k] += a * n[k];
}

static PetscBool normalise(PetscReal n[3])
{
  const PetscReal length = PetscSqrtReal(SbDot3(n, n));

  if (!(length > FLAT)) return PETSC_FALSE;
  for (int k = 0; k < 3; k++) n[k] /= length;
  return PETSC_TRUE;
}

/*
  Where a facet without area lies around the place, those beyond it are not its neighbours by identity: then all near facets of the part
  count whose nearest point is the same.
*/
static void pseudonormal_by_place(const Look *look, const Hit *h, const PetscReal r[3], PetscReal sum[3])
{
  sum[0] = sum[1] = sum[2] = 0;
  for (PetscInt i = 0; i < look->nhit; i++) {
    const Hit *o = look->hit + i;
    const PetscReal *x[3];
    PetscReal n[3], other[3];

    if (o->part != h->part) continue;
    corners(look->s, look->s->x, o->facet, x);
    away(look->p, x, o->weight, other);
    subtract(other, r, other);
    if (SbDot3(other, other) > TOUCH * TOUCH * look->s->reach * look->s->reach || !unit_normal(x, n))
      continue;
    add(o->place <= SB_FEATURE_CORNER_2 ? angle(x, o->place) : PETSC_PI, n, sum);
  }
}

/* Pseudonormal at a hit's place on an edge or corner, r away from the point; false when the normals cancel out. */
static PetscBool pseudonormal(const Look *look, const Hit *h, const PetscReal r[3], PetscReal sum[3])
{
  PetscBool flat = PETSC_FALSE;
  PetscInt j = -1, g;
  int corner;

  sum[0] = sum[1] = sum[2] = 0;
  while (next_around(look->rings, h->facet, h->place, &j, &g, &corner)) {
    const PetscReal *x[3];
    PetscReal n[3];

    corners(look->s, look->s->x, g, x);
    if (!unit_normal(x, n))
      flat = PETSC_TRUE;
    else
      add(h->place <= SB_FEATURE_CORNER_2 ? angle(x, corner) : 1, n, sum);
  }
  if (flat) pseudonormal_by_place(look, h, r, sum);
  return normalise(sum);
}

/* Of the facets around a hit's edge or corner, the normal that opposes the point's most: flush rims press along their faces. */
static PetscBool opposing_normal(const Look *look, const Hit *h, PetscReal normal[3])
{
  PetscReal least = -FACING;
  PetscInt j = -1, g;
  int corner;

  while (next_around(look->rings, h->facet, h->place, &j, &g, &corner)) {
    const PetscReal *x[3];
    PetscReal n[3];

    corners(look->s, look->s->x, g, x);
    if (!unit_normal(x, n) || SbDot3(look->normal, n) >= least) continue;
    least = SbDot3(look->normal, n);
    for (int k = 0; k < 3; k++) normal[k] = n[k];
  }
  return (PetscBool)(least < -FACING);
}

/* Whether none of the facets around the place is nearer. */
static PetscBool is_nearest_around(const Look *look, const Hit *h)
{
  const PetscReal limit = h->key - TIE * look->s->reach;
  PetscInt j = -1, g;
  int corner;

  if (limit <= 0) return PETSC_TRUE;
  while (next_around(look->rings, h->facet, h->place, &j, &g, &corner)) {
    const PetscReal *x[3];
    PetscReal w[3], d2;

    if (g == h->facet) continue;
    corners(look->s, look->s->x, g, x);
    (void)SbTriangleClosestPoint(look->p, x, w, &d2);
    if (d2 < limit * limit) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Signed distance and its direction at a hit; false when it has none. */
static PetscBool measure(const Look *look, const Hit *h, SbNear *near)
{
  const PetscReal *x[3];
  PetscReal r[3], n[3], side;

  corners(look->s, look->s->x, h->facet, x);
  away(look->p, x, h->weight, r);
  if (h->place == SB_FEATURE_FACE) {
    if (!unit_normal(x, n)) return PETSC_FALSE;
    near->gap = SbDot3(r, n);
  } else if (h->key < AT * look->s->reach) {
    if (!opposing_normal(look, h, n)) return PETSC_FALSE; /* all facets around it are at the point */
    near->gap = SbDot3(r, n);
  } else {
    if (!is_nearest_around(look, h) || !pseudonormal(look, h, r, n)) return PETSC_FALSE;
    side = SbDot3(r, n) < 0 ? -1 : 1;
    near->gap = side * h->key;
    for (int k = 0; k < 3; k++) n[k] = side * r[k] / h->key;
  }
  near->point = look->point;
  near->facet = h->facet;
  near->crossed = PETSC_FALSE;
  for (int k = 0; k < 3; k++) {
    near->weight[k] = h->weight[k];
    near->normal[k] = n[k];
  }
  return PETSC_TRUE;
}

/* ------------------------------------------------------------------ one point */

/* Whether point and facet of one part are too close by nature for self-contact. */
static PetscBool belong_together(const SbDetectScene *s, PetscInt point, PetscInt facet)
{
  const PetscReal limit = SELF_REACH * s->reach;
  const PetscInt vertex = s->point_vertex[point], *v = s->facet_vertex + 3 * facet;
  const PetscReal *x[3];
  PetscReal w[3], d2;

  if (vertex >= 0 && (v[0] == vertex || v[1] == vertex || v[2] == vertex)) return PETSC_TRUE;
  if (s->point_facet[point] >= 0 && s->point_facet[point] == s->facet_id[facet]) return PETSC_TRUE;
  corners(s, s->X, facet, x);
  (void)SbTriangleClosestPoint(s->P + 3 * point, x, w, &d2);
  return (PetscBool)(d2 < limit * limit);
}

static void set_hit(const Look *look, PetscInt facet, PetscReal key, Hit *h)
{
  h->part = look->s->facet_part[facet];
  h->facet = facet;
  h->id = look->s->facet_id[facet];
  h->key = key;
}

/* Whether the boxes come so near each other, over the step, that the point may have been in the facet or just behind it. */
static PetscBool may_cross(const struct _p_SbDetector *d, const SbDetectScene *s, PetscInt point,
                           PetscInt facet)
{
  const PetscReal *p = d->point_box + 6 * point, *f = d->facet_box + 6 * facet,
                  less = SbDetectRange(s) - START * s->reach;

  return (PetscBool)(p[0] <= f[3] - less && f[0] + less <= p[3] && p[1] <= f[4] - less &&
                     f[1] + less <= p[4] && p[2] <= f[5] - less && f[2] + less <= p[5]);
}

/* Whether the point went through the facet. One that lay behind it from the start counts only when they face each other. */
static PetscBool crossed(const Look *look, PetscInt facet, Hit *h)
{
  const SbDetectScene *s = look->s;
  const PetscReal tolerance[2] = {START * s->reach, TOUCH * s->reach};
  const PetscReal *x[3], *x0[3];
  PetscReal n[3];

  corners(s, s->x, facet, x);
  corners(s, s->x0, facet, x0);
  if (!SbCCDPointTriangle(s->p0 + 3 * look->point, look->p, x0, x, tolerance, &h->key, &h->behind))
    return PETSC_FALSE;
  return (PetscBool)(unit_normal(x, n) && (!h->behind || SbDot3(n, look->normal) < -FACING));
}

/*
  Facets that are examined soon lie anywhere in memory: first their corners' numbers, later the corners. `left`: candidates of all points
  from here on. Always inlined: a call of what only fetches is left out by the compiler, as without effect.
*/
SB_INLINE void prefetch_facets(const SbDetectScene *s, const PetscInt candidate[], PetscInt left)
{
  if (left > 2 * AHEAD) {
    const PetscInt f = candidate[2 * AHEAD];

    __builtin_prefetch(s->facet + 3 * f);
    __builtin_prefetch(s->facet_part + f);
  }
  if (left > AHEAD) {
    const PetscInt *c = s->facet + 3 * candidate[AHEAD];

    for (int k = 0; k < 3; k++) {
      __builtin_prefetch(s->x + 3 * c[k]);
      if (s->x0) __builtin_prefetch(s->x0 + 3 * c[k]);
    }
  }
}

/* Which candidates are within reach, and which were gone through. */
static void look_closely(Look *look, PetscInt n, const PetscInt candidate[], PetscInt left,
                         PetscInt64 *looked)
{
  const SbDetectScene *s = look->s;
  const PetscReal range2 = SbDetectRange(s) * SbDetectRange(s);
  const PetscBool led = (PetscBool)(s->p_way && s->p_way_part[look->point] == s->point_part[look->point]);

  look->nhit = look->ncross = 0;
  for (PetscInt j = 0; j < n; j++) {
    const PetscInt f = candidate[j];
    Hit *h = look->hit + look->nhit, *c = look->cross + look->ncross;
    const PetscReal *x[3];
    const PetscBool own = (PetscBool)(s->point_part[look->point] == s->facet_part[f]);
    PetscBool close, through;
    PetscReal d2;

    prefetch_facets(s, candidate + j, left - j);
    (*looked)++;
    corners(s, s->x, f, x);
    h->place = SbTriangleClosestPoint(look->p, x, h->weight, &d2);
    close = (PetscBool)(d2 <= (own && !led ? s->reach * s->reach : range2)); /* deeper is its own far side */
    through = (PetscBool)(s->x0 && may_cross(look->d, s, look->point, f) && crossed(look, f, c));
    if (!close && !through) continue;
    if (own && belong_together(s, look->point, f)) continue;
    if (close) {
      set_hit(look, f, PetscSqrtReal(d2), h);
      look->nhit++;
    }
    if (through) {
      set_hit(look, f, c->key, c);
      look->ncross++;
    }
  }
}

static inline PetscBool before(const Hit *a, const Hit *b)
{
  if (a->part != b->part) return (PetscBool)(a->part < b->part);
  if (a->key != b->key) return (PetscBool)(a->key < b->key);
  return (PetscBool)(a->id < b->id);
}

/* By part, key and identity: shell sort, for the few that there usually are and for the many that there may be. */
static void sort(PetscInt n, Hit h[])
{
  static const PetscInt gaps[] = {86961, 33936, 13776, 4592, 1968, 861, 336, 112, 48, 21, 7, 3, 1};

  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(gaps); k++) {
    const PetscInt gap = gaps[k];

    for (PetscInt i = gap; i < n; i++) {
      const Hit a = h[i];
      PetscInt j = i;

      for (; j >= gap && before(&a, h + j - gap); j -= gap) h[j] = h[j - gap];
      h[j] = a;
    }
  }
}

/* Of hits in order, how many from the first on have the same part and, but for the tolerance, the same key; those by identity. */
static PetscInt ties(PetscInt n, Hit h[], PetscReal tolerance)
{
  PetscInt m = 1;

  while (m < n && h[m].part == h[0].part && h[m].key <= h[0].key + tolerance) m++;
  for (PetscInt i = 1; i < m; i++) {
    const Hit a = h[i];
    PetscInt j = i;

    for (; j > 0 && a.id < h[j - 1].id; j--) h[j] = h[j - 1];
    h[j] = a;
  }
  return m;
}

/* Sets the depth; `nearest`: distance of the surface, m. Returns true. */
static inline PetscBool in_by(PetscReal nearest, SbNear *near)
{
  near->depth = near->gap < 0 ? PetscMin(nearest, -near->gap) : 0;
  return PETSC_TRUE;
}

/* Whether the point was in front of the place of contact, along its normal, when the step began, or up to `behind` m behind it. */
static PetscBool was_in_front(const Look *look, const SbNear *near, PetscReal behind)
{
  const PetscReal *x0[3];
  PetscReal r[3];

  corners(look->s, look->s->x0, near->facet, x0);
  away(look->s->p0 + 3 * look->point, x0, near->weight, r);
  return (PetscBool)(SbDot3(r, near->normal) > -behind);
}

/* The nearest of n hits of one part that is a contact; `entry`: where the point came in, NULL: it did not; `in`: the hit of that. */
static PetscBool nearest(const Look *look, PetscInt n, Hit h[], const SbNear *entry, const Hit *in,
                         SbNear *near)
{
  const PetscReal behind = (entry && in->behind ? START : AT) * look->s->reach;
  PetscBool sided = PETSC_FALSE, inside = PETSC_FALSE;

  for (PetscInt i = 0; i < n;) {
    const PetscInt end = i + ties(n - i, h + i, TIE * look->s->reach);

    for (; i < end; i++) {
      if (!measure(look, h + i, near)) continue;
      /* on the surface itself rounding tells the side: the next nearest place decides */
      if (!sided && PetscAbsReal(near->gap) > TOUCH * look->s->reach) {
        inside = (PetscBool)(near->gap < 0);
        sided = PETSC_TRUE;
      }
      if ((!sided || (near->gap < 0) == inside) && SbDot3(look->normal, near->normal) < -FACING &&
          (!entry || (SbDot3(near->normal, entry->normal) > FACING &&
                      (near->gap >= 0 || was_in_front(look, near, behind)))))
        return (PetscBool)(near->gap <= look->s->reach && in_by(h[0].key, near));
    }
  }
  return PETSC_FALSE;
}

/* The contact with a facet that the point went through; false when they do not face each other. */
static PetscBool passage(const Look *look, const Hit *c, SbNear *near)
{
  const PetscReal *x[3];
  PetscReal r[3], d2;

  corners(look->s, look->s->x, c->facet, x);
  (void)unit_normal(x, near->normal);
  (void)SbTriangleClosestPoint(look->p, x, near->weight, &d2);
  subtract(look->p, x[0], r);
  near->gap = SbDot3(r, near->normal);
  (void)in_by(PETSC_MAX_REAL, near);
  near->point = look->point;
  near->facet = c->facet;
  near->crossed = PETSC_TRUE;
  return (PetscBool)(SbDot3(look->normal, near->normal) < -FACING);
}

/* Where the given way leads out of the part; false when the point is not in it. */
static PetscBool along_way(const Look *look, PetscInt n, const Hit h[], SbNear *near)
{
  const PetscReal *way = look->s->p_way + 3 * look->point;
  PetscReal least = PETSC_MAX_REAL;
  PetscInt id = -1;
  PetscBool out = PETSC_FALSE;

  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *x[3];
    PetscReal weight[3], t;
    PetscBool leads;

    corners(look->s, look->s->x, h[i].facet, x);
    if (!SbRayTriangle(look->p, way, x, &t, weight, &leads) || t > least || (t == least && h[i].id > id))
      continue;
    least = t;
    id = h[i].id;
    out = leads;
    near->facet = h[i].facet;
    for (int k = 0; k < 3; k++) near->weight[k] = weight[k];
  }
  if (!out) return PETSC_FALSE;
  near->point = look->point;
  near->crossed = PETSC_FALSE;
  near->gap = -least;
  for (int k = 0; k < 3; k++) near->normal[k] = way[k];
  return in_by(h[0].key, near);
}

/* Of n hits of one part, how many the nearest place is searched for among: of its own part a point also has deeper ones when it is separated from it. */
static PetscInt nearby(const Look *look, PetscInt part, PetscInt n, const Hit h[])
{
  while (n > 0 && part == look->s->point_part[look->point] && h[n - 1].key > look->s->reach) n--;
  return n;
}

/* Contacts of one point, at most one with each part, in order of the parts; how many. */
static PetscInt contacts(Look *look, SbNear near[])
{
  PetscInt n = 0;

  sort(look->nhit, look->hit);
  sort(look->ncross, look->cross);
  for (PetscInt i = 0, j = 0, inext, jnext; i < look->nhit || j < look->ncross; i = inext, j = jnext) {
    const PetscInt a = i < look->nhit ? look->hit[i].part : PETSC_MAX_INT;
    const PetscInt b = j < look->ncross ? look->cross[j].part : PETSC_MAX_INT, part = PetscMin(a, b);
    PetscBool into, found;
    SbNear entry;

    for (inext = i; inext < look->nhit && look->hit[inext].part == part;) inext++;
    for (jnext = j; jnext < look->ncross && look->cross[jnext].part == part;) jnext++;
    if (jnext > j) (void)ties(jnext - j, look->cross + j, TIE_TIME);
    into = (PetscBool)(jnext > j && passage(look, look->cross + j, &entry));
    found = (PetscBool)(look->s->p_way && look->s->p_way_part[look->point] == part &&
                        along_way(look, inext - i, look->hit + i, near + n));
    if (!found)
      found = nearest(look, nearby(look, part, inext - i, look->hit + i), look->hit + i,
                      jnext > j ? &entry : NULL, look->cross + j, near + n);
    if (!found && into) {
      near[n] = entry;
      if (inext > i) (void)in_by(look->hit[i].key, &near[n]);
      found = PETSC_TRUE;
    }
    if (found) n++;
  }
  return n;
}

/* ------------------------------------------------------------------ all points */

static PetscErrorCode reserve_hits(SbDetector d, PetscInt n)
{
  PetscFunctionBeginUser;
  if (n <= d->hit_size) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree(d->hit));
  PetscCall(PetscMalloc1(2 * (size_t)n, &d->hit));
  d->hit_size = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Room for n contacts more than the `used` ones. */
static PetscErrorCode reserve_near(SbDetector d, PetscInt used, PetscInt n)
{
  PetscFunctionBeginUser;
  if (used + n <= d->near_size) PetscFunctionReturn(PETSC_SUCCESS);
  d->near_size = used + n + used / 2 + 64;
  PetscCall(PetscRealloc(sizeof(*d->near) * (size_t)d->near_size, &d->near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDetectNarrow(SbDetector d, const SbDetectScene *s, PetscInt *n)
{
  Look look = {.d = d, .s = s, .rings = &d->rings};
  PetscInt most = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->npoint; i++) most = PetscMax(most, d->start[i + 1] - d->start[i]);
  PetscCall(
    reserve_hits(d, most + 1)); /* one more: the next hit is made in place before it is known to be one */
  look.hit = d->hit;
  look.cross = d->hit + d->hit_size;
  *n = 0;
  d->stats.candidates = 0;
  for (PetscInt i = 0; i < s->npoint; i++) {
    look.point = i;
    look.p = s->p + 3 * i;
    look.normal = s->p_normal + 3 * i;
    look_closely(&look, d->start[i + 1] - d->start[i], d->candidate + d->start[i],
                 d->start[s->npoint] - d->start[i], &d->stats.candidates);
    if (!look.nhit && !look.ncross) continue;
    PetscCall(reserve_near(d, *n, look.nhit + look.ncross + 1));
    *n += contacts(&look, d->near + *n);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
