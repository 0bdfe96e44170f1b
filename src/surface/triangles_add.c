/*
  triangles_add.c - adds vertices, triangles and polygons of a file to a surface; polygons are
  triangulated without new vertices: as a fan if possible, else by ear clipping.

  Areas are projected along the polygon's normal (Newell's sum over its edges, valid for slightly
  non-planar polygons). An ear is a convex corner whose triangle contains no other corner; the ear
  with the best ratio of area to longest edge squared is cut first, so that collinear corners do not
  end as flat triangles (Meisters, "Polygons have ears", 1975). Polygons inside a polygon are
  connected to it by bridges: pairs of coincident edges of opposite directions.
*/
#include <ctype.h>
#include "surface_impl.h"

#define CORNERS_MAX \
  1000 /* corners of a non-convex polygon, at most: ear clipping is cubic in their number */
#define LOOPS_MAX 100 /* polygons of one facet, at most */
#define THIN 1e-9     /* smallest area over longest edge squared of the triangles of a fan */

PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *f, const PetscReal x[3])
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  PetscCall(SbReserve(t->nvert + 1, 3 * sizeof(PetscReal), &f->vert_size, &t->x));
  PetscCall(PetscArraycpy(t->x + 3 * t->nvert, x, 3));
  t->nvert++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesAdd(SbTriangleFile *f, PetscInt a, PetscInt b, PetscInt c, int64_t number)
{
  SbTriangles *t = f->t;

  PetscFunctionBeginUser;
  if (t->ntri == f->tri_size) {
    f->tri_size = PetscMax(256, 2 * f->tri_size);
    PetscCall(PetscRealloc(3 * (size_t)f->tri_size * sizeof(PetscInt), &t->tri));
    PetscCall(SbImportScratch(f->im, (size_t)f->tri_size * sizeof(int64_t), &f->number));
    PetscCall(SbImportScratch(f->im, (size_t)f->tri_size * sizeof(PetscInt), &f->tags));
  }
  PetscCall(PetscArraycpy(t->tri + 3 * t->ntri, ((const PetscInt[3]){a, b, c}), 3));
  f->tags[t->ntri] = f->now;
  f->number[t->ntri++] = number;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesGroups(SbTriangleFile *f, PetscInt n, const char *const names[])
{
  PetscInt group[16];

  PetscFunctionBeginUser;
  n = PetscMin(n, 16);
  for (PetscInt i = 0; i < n; i++) {
    char name[SB_GROUP_MAX];
    uint64_t hash = 0xcbf29ce484222325u; /* number of a group that has only a name (FNV-1a hash) */

    PetscCall(PetscStrncpy(name, names[i], sizeof(name)));
    for (char *c = name; *c; c++) {
      if (isspace((unsigned char)*c))
        *c = '_';
      hash = (hash ^ (unsigned char)*c) * 0x100000001b3u;
    }
    PetscCall(SbImportGroup(f->im, 2, (int64_t)(hash >> 2), name, &group[i]));
  }
  PetscCall(SbImportTagSet(f->im, n, group, &f->now));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The vertices of all polygons, and the normal of one. */
typedef struct {
  const PetscReal *x;
  PetscReal normal[3];
} Polygon;

/* Newell's normal; its length is twice the area. */
static void find_normal(PetscInt n, const PetscInt vert[], Polygon *p)
{
  const PetscReal *o = p->x + 3 * vert[0];

  for (int k = 0; k < 3; k++)
    p->normal[k] = 0;
  for (PetscInt i = 1; i + 1 < n; i++) {
    PetscReal u[3], v[3], c[3];

    SbSubtract(p->x + 3 * vert[i], o, u);
    SbSubtract(p->x + 3 * vert[i + 1], o, v);
    SbCross(u, v, c);
    for (int k = 0; k < 3; k++)
      p->normal[k] += c[k];
  }
}

/* Twice the projected area of a triangle times the length of the normal; longest2: longest edge
   squared. */
static PetscReal seen_area(const Polygon *p, PetscInt a, PetscInt b, PetscInt c,
                           PetscReal *longest2)
{
  const PetscReal *x = p->x + 3 * a;
  const PetscReal *y = p->x + 3 * b;
  const PetscReal *z = p->x + 3 * c;
  PetscReal u[3], v[3], w[3], n[3];

  SbSubtract(y, x, u);
  SbSubtract(z, x, v);
  SbSubtract(z, y, w);
  SbCross(u, v, n);
  if (longest2)
    *longest2 = PetscMax(SbDot3(u, u), PetscMax(SbDot3(v, v), SbDot3(w, w)));
  return SbDot3(n, p->normal);
}

/* Ear clipping, removes corners from left[]; later checks refuse the result of a self-intersecting
   one. */
static PetscErrorCode cut_ears(const Polygon *p, PetscInt n, PetscInt left[], int64_t number,
                               SbTriangleFile *f)
{
  PetscFunctionBeginUser;
  while (n > 3) {
    PetscReal best = 0;
    PetscInt ear = 0;

    // the ear with the best quality, area over longest edge squared; a corner within makes it none
    for (PetscInt i = 0; i < n; i++) {
      const PetscInt a = left[(i + n - 1) % n];
      const PetscInt b = left[i];
      const PetscInt c = left[(i + 1) % n];
      PetscReal longest2;
      PetscReal quality = seen_area(p, a, b, c, &longest2);

      quality /= longest2;
      for (PetscInt k = 0; k < n && quality > best; k++) {
        const PetscInt d = left[k];

        if (d == a || d == b || d == c)
          continue;
        if (seen_area(p, a, b, d, NULL) >= 0 && seen_area(p, b, c, d, NULL) >= 0 &&
            seen_area(p, c, a, d, NULL) >= 0)
          quality = 0;
      }
      if (quality > best) {
        best = quality;
        ear = i;
      }
    }
    PetscCall(SbTrianglesAdd(f, left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n], number));
    PetscCall(PetscArraymove(left + ear, left + ear + 1, n - ear - 1));
    n--;
  }
  PetscCall(SbTrianglesAdd(f, left[0], left[1], left[2], number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode too_many(SbScan *s, PetscInt n, int64_t number)
{
  PetscFunctionBeginUser;
  SB_SCAN_ERROR(
    s, "face %lld has %lld corners and is not convex; supple takes up to %d, cut it into parts",
    (long long)number, (long long)n, CORNERS_MAX);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Triangulates a polygon, convex or not, without new vertices. */
static PetscErrorCode add_polygon(SbScan *s, PetscInt n, const PetscInt vert[], int64_t number,
                                  SbTriangleFile *f)
{
  Polygon p = {.x = f->t->x};
  PetscInt left[CORNERS_MAX];
  PetscInt o = 0;
  PetscBool fan = PETSC_TRUE;

  PetscFunctionBeginUser;
  if (n > 3) {
    // the fan at the lexicographically smallest corner: the triangulation is independent of the
    // first corner
    for (PetscInt i = 1; i < n; i++) {
      const PetscReal *a = p.x + 3 * vert[i];
      const PetscReal *b = p.x + 3 * vert[o];
      int k = 0;

      while (k < 2 && a[k] == b[k])
        k++;
      if (a[k] < b[k])
        o = i;
    }
    find_normal(n, vert, &p);

    // all its triangles must have a positive projected area
    for (PetscInt i = 1; i + 1 < n && fan; i++) {
      PetscReal longest2;
      const PetscReal area =
        seen_area(&p, vert[o], vert[(o + i) % n], vert[(o + i + 1) % n], &longest2);

      fan = (PetscBool)(area > THIN * longest2 * PetscSqrtReal(SbDot3(p.normal, p.normal)));
    }
  }
  for (PetscInt i = 1; i + 1 < n && fan; i++)
    PetscCall(SbTrianglesAdd(f, vert[o], vert[(o + i) % n], vert[(o + i + 1) % n], number));
  if (fan)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (n > CORNERS_MAX)
    PetscCall(too_many(s, n, number));
  PetscCall(PetscArraycpy(left, vert, n));
  PetscCall(cut_ears(&p, n, left, number, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesAddCorner(SbScan *s, int64_t number, int64_t v, SbTriangleFile *f)
{
  PetscFunctionBeginUser;
  if (v < 0 || v >= f->t->nvert)
    SB_SCAN_ERROR(s, "face %lld uses a vertex that is not there (%lld of %lld)", (long long)number,
                  (long long)v + 1, (long long)f->t->nvert);
  PetscCall(SbImportGrow(f->im, &f->ncorner, sizeof(*f->corner), &f->corner));
  f->corner[f->ncorner.n - 1] = (PetscInt)v;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesAddFace(SbScan *s, int64_t number, SbTriangleFile *f)
{
  const PetscInt n = f->ncorner.n;

  PetscFunctionBeginUser;
  f->ncorner.n = 0;
  if (n < 3)
    SB_SCAN_ERROR(s, "face %lld has %lld corners; it needs three", (long long)number, (long long)n);
  PetscCall(add_polygon(s, n, f->corner, number, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nested polygons of a facet. */
typedef struct {
  Polygon p;
  PetscInt n;            /* number of polygons */
  const PetscInt *start; /* [n + 1] first corner of each polygon */
  const PetscInt *vert;
} Loops;

static PetscInt corners_of(const Loops *l, PetscInt k)
{
  return l->start[k + 1] - l->start[k];
}

/* Signed projected area of polygon k; the sign is its orientation. */
static PetscReal loop_area(const Loops *l, PetscInt k)
{
  Polygon one = {.x = l->p.x};

  find_normal(corners_of(l, k), l->vert + l->start[k], &one);
  return SbDot3(one.normal, l->p.normal);
}

/* Smallest polygon around a point of the plane, other than `except`; -1 if there is none. */
static PetscInt loop_around(const Loops *l, const PetscReal x[3], PetscInt except)
{
  const PetscReal *m = l->p.normal;
  const int larger = PetscAbsReal(m[0]) > PetscAbsReal(m[1]) ? 0 : 1;
  const int most = PetscAbsReal(m[larger]) > PetscAbsReal(m[2]) ? larger : 2;
  const int u = (most + 1) % 3;
  const int v = (most + 2) % 3;
  PetscInt best = -1;

  for (PetscInt k = 0; k < l->n; k++) {
    PetscBool inside = PETSC_FALSE;

    // even-odd rule, in the two coordinates with the largest projection
    for (PetscInt i = l->start[k]; i < l->start[k + 1]; i++) {
      const PetscReal *a = l->p.x + 3 * l->vert[i];
      const PetscReal *b = l->p.x + 3 * l->vert[i + 1 < l->start[k + 1] ? i + 1 : l->start[k]];

      if ((a[v] > x[v]) != (b[v] > x[v]) &&
          x[u] < a[u] + (b[u] - a[u]) * (x[v] - a[v]) / (b[v] - a[v]))
        inside = (PetscBool)!inside;
    }
    if (k == except || !inside)
      continue;
    if (best < 0 || PetscAbsReal(loop_area(l, k)) < PetscAbsReal(loop_area(l, best)))
      best = k;
  }
  return best;
}

/* Whether the segment from a to b intersects an edge of the polygon without a common vertex. */
static PetscBool meets_edge(const Polygon *p, PetscInt a, PetscInt b, PetscInt n,
                            const PetscInt vert[])
{
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt c = vert[i];
    const PetscInt d = vert[(i + 1) % n];

    if (c == a || c == b || d == a || d == b)
      continue;
    if (seen_area(p, a, b, c, NULL) * seen_area(p, a, b, d, NULL) <= 0 &&
        seen_area(p, c, d, a, NULL) * seen_area(p, c, d, b, NULL) <= 0)
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Triangulates the area between polygon k and the polygons directly inside it. */
static PetscErrorCode add_between(SbScan *s, const Loops *l, PetscInt k, const PetscInt parent[],
                                  int64_t number, SbTriangleFile *f)
{
  const PetscInt m = corners_of(l, k);
  const PetscInt *loop = l->vert + l->start[k];
  const PetscBool against = (PetscBool)(loop_area(l, k) < 0);
  PetscInt left[CORNERS_MAX];
  PetscInt n = m;
  PetscBool alone = PETSC_TRUE;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < l->n; i++)
    alone = (PetscBool)(alone && parent[i] != k);
  if (alone) {
    PetscCall(add_polygon(s, m, loop, number, f));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (m > CORNERS_MAX)
    PetscCall(too_many(s, m, number));
  for (PetscInt i = 0; i < m; i++)
    left[i] = loop[against ? m - 1 - i : i];
  for (PetscInt inner = 0; inner < l->n; inner++) {
    const PetscInt ninner = corners_of(l, inner);
    const PetscInt *other = l->vert + l->start[inner];
    const int step = loop_area(l, inner) > 0 ? -1 : 1;
    PetscReal best = PETSC_MAX_REAL;
    PetscInt i = 0;
    PetscInt j = 0;

    if (parent[inner] != k)
      continue;
    if (n + ninner + 2 > CORNERS_MAX)
      PetscCall(too_many(s, n + ninner + 2, number));

    // shortest bridge from corner i of the outer polygon to corner j of the inner one that
    // intersects no edge
    for (PetscInt a = 0; a < n; a++) {
      for (PetscInt b = 0; b < ninner; b++) {
        const PetscReal *x = l->p.x + 3 * left[a];
        const PetscReal *y = l->p.x + 3 * other[b];
        const PetscReal d[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]};
        const PetscReal d2 = SbDot3(d, d);
        PetscBool blocked =
          (PetscBool)(d2 >= best || meets_edge(&l->p, left[a], other[b], n, left));

        for (PetscInt c = 0; c < l->n && !blocked; c++)
          blocked = meets_edge(&l->p, left[a], other[b], corners_of(l, c), l->vert + l->start[c]);
        if (blocked)
          continue;
        best = d2;
        i = a;
        j = b;
      }
    }
    if (best == PETSC_MAX_REAL)
      SB_SCAN_ERROR(s, "the polygons of facet %lld cross each other; repair it", (long long)number);

    // insert the inner polygon, with opposite orientation, and the two bridge edges
    PetscCall(PetscArraymove(left + i + ninner + 2, left + i, n - i));
    for (PetscInt c = 0; c <= ninner; c++)
      left[i + 1 + c] = other[((j + step * c) % ninner + ninner) % ninner];
    n += ninner + 2;
  }
  PetscCall(cut_ears(&l->p, n, left, number, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesAddLoops(SbScan *s, PetscInt nloop, const PetscInt start[],
                                   const PetscInt vert[], PetscInt nhole, const PetscReal hole[],
                                   int64_t number, SbTriangleFile *f)
{
  Loops l = {{.x = f->t->x}, nloop, start, vert};
  PetscInt parent[LOOPS_MAX];
  PetscInt largest = 0;
  PetscBool empty[LOOPS_MAX] = {PETSC_FALSE};

  PetscFunctionBeginUser;
  if (!nloop)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (nloop > LOOPS_MAX)
    SB_SCAN_ERROR(s, "facet %lld has %lld polygons; supple takes up to %d, cut it into parts",
                  (long long)number, (long long)nloop, LOOPS_MAX);
  for (PetscInt k = 0; k < nloop; k++) {
    Polygon one = {.x = l.p.x};

    find_normal(start[k + 1] - start[k], vert + start[k], &one);
    if (k && SbDot3(one.normal, one.normal) <= SbDot3(l.p.normal, l.p.normal))
      continue;
    PetscCall(PetscArraycpy(l.p.normal, one.normal, 3));
    largest = k;
  }
  for (PetscInt k = 0; k < nloop; k++)
    parent[k] = k == largest ? -1 : loop_around(&l, l.p.x + 3 * vert[start[k]], k);
  for (PetscInt h = 0; h < nhole; h++) {
    const PetscInt k = loop_around(&l, hole + 3 * h, -1);

    if (k < 0)
      SB_SCAN_ERROR(s, "hole %lld of facet %lld lies in no polygon of it", (long long)h + 1,
                    (long long)number);
    empty[k] = PETSC_TRUE;
  }
  for (PetscInt k = 0; k < nloop; k++)
    if (!empty[k])
      PetscCall(add_between(s, &l, k, parent, number, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}
