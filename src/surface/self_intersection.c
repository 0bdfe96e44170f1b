/*
  self_intersection.c - whether triangles cut or touch each other beyond the corners that they share.

  Two triangles meet exactly when an edge of one meets the other. With a common corner only the two edges opposite to it need
  be examined; with a common edge only whether one triangle is folded onto the other. Signs of determinants decide:
  orient(a, b, c, d) = (a - d) . (b - d) x (c - d), in double precision where its size is above the bound of its rounding (Shewchuk, "Adaptive
  precision floating-point arithmetic", 1997, the first stage), else in long double, and zero below the bound of that. What is
  in one plane is decided in that plane. Pairs come from a tree of boxes.
*/
#include <float.h>
#include "sbkernel.h"
#include "surface_impl.h"

#define NAMED 3   /* pairs that a message names */
#define PASSES 60 /* of smoothing */
#define FEW 0.02  /* part of the triangles that may cross others and be smoothed */

static int sign_of(long double value, long double bound)
{
  return value > bound ? 1 : value < -bound ? -1 : 0;
}

static int orient_long(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3], const PetscReal d[3])
{
  long double u[3], v[3], w[3], det = 0, size = 0;

  for (int k = 0; k < 3; k++) {
    u[k] = (long double)a[k] - d[k];
    v[k] = (long double)b[k] - d[k];
    w[k] = (long double)c[k] - d[k];
  }
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;

    det += u[k] * (v[i] * w[j] - v[j] * w[i]);
    size += fabsl(u[k]) * (fabsl(v[i] * w[j]) + fabsl(v[j] * w[i]));
  }
  return sign_of(det, 16 * LDBL_EPSILON * size);
}

/* On which side of the plane through a, b, c the point d lies: -1 above (the corners are seen counter-clockwise), 0 in it, 1. */
static int orient(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3], const PetscReal d[3])
{
  PetscReal u[3], v[3], w[3], det = 0, size = 0;

  for (int k = 0; k < 3; k++) {
    u[k] = a[k] - d[k];
    v[k] = b[k] - d[k];
    w[k] = c[k] - d[k];
  }
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;

    det += u[k] * (v[i] * w[j] - v[j] * w[i]);
    size += PetscAbsReal(u[k]) * (PetscAbsReal(v[i] * w[j]) + PetscAbsReal(v[j] * w[i]));
  }
  if (PetscAbsReal(det) > 8 * PETSC_MACHINE_EPSILON * size) return det > 0 ? 1 : -1;
  return orient_long(a, b, c, d);
}

/* ------------------------------------------------------------------ in one plane */

/* The two coordinates of the plane that see most of it. */
static void axes_of(PetscReal const *const t[3], int axis[2])
{
  PetscReal e[3], f[3], n[3];
  int most = 0;

  for (int k = 0; k < 3; k++) {
    e[k] = t[1][k] - t[0][k];
    f[k] = t[2][k] - t[0][k];
  }
  SbCross(e, f, n);
  for (int k = 1; k < 3; k++) {
    if (PetscAbsReal(n[k]) > PetscAbsReal(n[most])) most = k;
  }
  axis[0] = (most + 1) % 3;
  axis[1] = (most + 2) % 3;
}

/* Which side of the line from a to b the point c lies on, in these two coordinates. */
static int orient_plane(const int axis[2], const PetscReal a[3], const PetscReal b[3], const PetscReal c[3])
{
  const int x = axis[0], y = axis[1];
  const long double l = ((long double)a[x] - c[x]) * ((long double)b[y] - c[y]),
                    r = ((long double)a[y] - c[y]) * ((long double)b[x] - c[x]);

  return sign_of(l - r, 8 * LDBL_EPSILON * (fabsl(l) + fabsl(r)));
}

/* Whether c, known to be on the line through a and b, lies between them. */
static PetscBool between(const int axis[2], const PetscReal a[3], const PetscReal b[3], const PetscReal c[3])
{
  for (int k = 0; k < 2; k++) {
    const int x = axis[k];

    if (c[x] < PetscMin(a[x], b[x]) || c[x] > PetscMax(a[x], b[x])) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

static PetscBool segments_meet(const int axis[2], const PetscReal a[3], const PetscReal b[3],
                               const PetscReal c[3], const PetscReal d[3])
{
  const int abc = orient_plane(axis, a, b, c), abd = orient_plane(axis, a, b, d);
  const int cda = orient_plane(axis, c, d, a), cdb = orient_plane(axis, c, d, b);

  if (abc * abd < 0 && cda * cdb < 0) return PETSC_TRUE;
  if (!abc && between(axis, a, b, c)) return PETSC_TRUE;
  if (!abd && between(axis, a, b, d)) return PETSC_TRUE;
  if (!cda && between(axis, c, d, a)) return PETSC_TRUE;
  return (PetscBool)(!cdb && between(axis, c, d, b));
}

/* A segment and a triangle in one plane. */
static PetscBool meet_in_plane(const PetscReal p[3], const PetscReal q[3], PetscReal const *const t[3])
{
  int axis[2], side[3];

  axes_of(t, axis);
  for (int k = 0; k < 3; k++) {
    if (segments_meet(axis, p, q, t[k], t[(k + 1) % 3])) return PETSC_TRUE;
  }
  for (int k = 0; k < 3; k++) side[k] = orient_plane(axis, t[k], t[(k + 1) % 3], p);
  return (PetscBool)(side[0] && side[0] == side[1] && side[1] == side[2]);
}

/* ------------------------------------------------------------------ in space */

static PetscBool segment_meets(const PetscReal p[3], const PetscReal q[3], PetscReal const *const t[3])
{
  const int above = orient(t[0], t[1], t[2], p), below = orient(t[0], t[1], t[2], q);
  int least = 1, most = -1;

  if (above && above == below) return PETSC_FALSE;
  if (!above && !below) return meet_in_plane(p, q, t);
  for (int k = 0; k < 3; k++) {
    const int s = orient(p, q, t[k], t[(k + 1) % 3]);

    least = PetscMin(least, s);
    most = PetscMax(most, s);
  }
  return (PetscBool)(least >= 0 || most <= 0);
}

/* Triangles at one edge, a the corner of one and b that of the other opposite to it. */
static PetscBool folded(const PetscReal p[3], const PetscReal q[3], const PetscReal a[3],
                        const PetscReal b[3])
{
  PetscReal const *const t[3] = {p, q, a};
  int axis[2];

  if (orient(p, q, a, b)) return PETSC_FALSE;
  axes_of(t, axis);
  return (PetscBool)(orient_plane(axis, p, q, a) * orient_plane(axis, p, q, b) >= 0);
}

/* Whether two different triangles have more in common than corners and an edge. */
static PetscBool triangles_cross(const SbTriangles *t, PetscInt f, PetscInt g)
{
  const PetscInt *v[2] = {t->tri + 3 * f, t->tri + 3 * g};
  PetscReal const *x[2][3];
  int ncommon = 0,
      own[2] = {3, 3}; /* sum of the common corners' places: the remainder of 0 + 1 + 2 is the other one */
  int common[2] = {0, 0};

  for (int i = 0; i < 3; i++) {
    x[0][i] = t->x + 3 * v[0][i];
    x[1][i] = t->x + 3 * v[1][i];
    for (int j = 0; j < 3; j++) {
      if (v[0][i] != v[1][j]) continue;
      ncommon++;
      own[0] -= i;
      own[1] -= j;
      common[0] = i;
      common[1] = j;
    }
  }
  if (ncommon == 3) return PETSC_TRUE;
  if (ncommon == 2) return folded(x[0][(own[0] + 1) % 3], x[0][(own[0] + 2) % 3], x[0][own[0]], x[1][own[1]]);
  for (int s = 0; s < 2; s++) {
    for (int k = 0; k < 3; k++) {
      if (ncommon && k != (common[s] + 1) % 3) continue;
      if (segment_meets(x[s][k], x[s][(k + 1) % 3], x[1 - s])) return PETSC_TRUE;
    }
  }
  return PETSC_FALSE;
}

/* ------------------------------------------------------------------ all pairs */

typedef struct {
  PetscInt n; /* pairs found */
  PetscInt pair[NAMED][2];
  PetscBool *crossing; /* [ntri] */
} Search;

/* All pairs, into *s, which has room for the marks. */
static PetscErrorCode find_pairs(const SbTriangles *t, Search *s)
{
  PetscReal(*box)[6];
  SbBoxTree tree;

  PetscFunctionBeginUser;
  s->n = 0;
  PetscCall(PetscArrayzero(s->crossing, t->ntri));
  PetscCall(PetscMalloc1(t->ntri, &box));
  for (PetscInt i = 0; i < t->ntri; i++) SbTriangleBox(t->x, t->tri + 3 * i, box[i]);
  PetscCall(SbBoxTreeCreate(t->ntri, (const PetscReal(*)[6])box, &tree));
  for (PetscInt i = 0, other; i < t->ntri; i++) {
    SbBoxQuery query;

    for (SbBoxQueryBegin(&tree, box[i], &query); SbBoxQueryNext(&query, &other);) {
      if (other <= i || !triangles_cross(t, i, other)) continue;
      if (s->n < NAMED) {
        s->pair[s->n][0] = i;
        s->pair[s->n][1] = other;
      }
      s->crossing[i] = s->crossing[other] = PETSC_TRUE;
      s->n++;
    }
  }
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode name_pairs(const SbTriangleFile *f, const Search *s, const char *why)
{
  const PetscReal *x = f->t->x + 3 * f->t->tri[3 * s->pair[0][0]];
  char text[256] = "";

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < PetscMin(s->n, NAMED); k++) {
    char one[64];

    (void)snprintf(one, sizeof(one), "%s%lld and %lld", k ? ", " : "", (long long)f->number[s->pair[k][0]],
                   (long long)f->number[s->pair[k][1]]);
    PetscCall(PetscStrlcat(text, one, sizeof(text)));
  }
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
          "%s: the surface cuts or touches itself at %" PetscInt_FMT
          " pair%s of triangles: %s%s, near (%.6g, "
          "%.6g, %.6g) m; %s; join the parts into one (meshlab, blender: boolean union), or move them apart",
          f->where, s->n, s->n == 1 ? "" : "s", text, s->n > NAMED ? ", ..." : "", (double)x[0], (double)x[1],
          (double)x[2], why);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ small folds are smoothed out */

/* Vertices of marked triangles; then, `rings` times, of triangles that touch them. */
static PetscErrorCode grow(const SbTriangles *t, const PetscBool crossing[], int rings, PetscBool active[])
{
  PetscBool *before;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 3 * t->ntri; i++)
    active[t->tri[i]] = (PetscBool)(active[t->tri[i]] || crossing[i / 3]);
  PetscCall(PetscMalloc1(t->nvert, &before));
  for (int r = 0; r < rings; r++) {
    PetscCall(PetscArraycpy(before, active, t->nvert));
    for (PetscInt f = 0; f < t->ntri; f++) {
      const PetscInt *v = t->tri + 3 * f;

      if (before[v[0]] || before[v[1]] || before[v[2]])
        active[v[0]] = active[v[1]] = active[v[2]] = PETSC_TRUE;
    }
  }
  PetscCall(PetscFree(before));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Active vertices go half the way to the mean of their neighbours; sum[nvert][4]. */
static void smooth(SbTriangles *t, const PetscBool active[], PetscReal (*sum)[4])
{
  for (PetscInt v = 0; v < t->nvert; v++) sum[v][0] = sum[v][1] = sum[v][2] = sum[v][3] = 0;
  for (PetscInt i = 0; i < 3 * t->ntri; i++) {
    const PetscInt a = t->tri[i], b = t->tri[i % 3 == 2 ? i - 2 : i + 1];

    for (int k = 0; k < 3; k++) {
      sum[a][k] += t->x[3 * b + k];
      sum[b][k] += t->x[3 * a + k];
    }
    sum[a][3]++;
    sum[b][3]++;
  }
  for (PetscInt v = 0; v < t->nvert; v++) {
    for (int k = 0; active[v] && k < 3; k++)
      t->x[3 * v + k] = 0.5 * t->x[3 * v + k] + 0.5 * sum[v][k] / sum[v][3];
  }
}

/* Smooths around what crosses until nothing does; gives up beyond the reach. s: pairs at the start, then those that are left. */
static PetscErrorCode untangle(SbTriangles *t, PetscReal reach, Search *s, SbSurfaceRepairs *m)
{
  PetscBool *active;
  PetscReal *x0, (*sum)[4];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(t->nvert, &active, 3 * (size_t)t->nvert, &x0, t->nvert, &sum));
  PetscCall(PetscArrayzero(active, t->nvert));
  PetscCall(PetscArraycpy(x0, t->x, 3 * (size_t)t->nvert));
  for (int pass = 0; pass < PASSES && s->n && m->untangled <= reach; pass++) {
    PetscReal most = 0;

    PetscCall(grow(t, s->crossing, pass % 4 == 3, active));
    smooth(t, active, sum);
    m->nuntangled = 0;
    for (PetscInt v = 0; v < t->nvert; v++) {
      const PetscReal *a = t->x + 3 * v, *b = x0 + 3 * v, d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
      const PetscReal d2 = SbDot3(d, d);

      m->nuntangled += d2 > 0;
      most = PetscMax(most, d2);
    }
    m->untangled = PetscSqrtReal(most);
    PetscCall(find_pairs(t, s));
  }
  if (s->n || m->untangled > reach) PetscCall(PetscArraycpy(t->x, x0, 3 * (size_t)t->nvert));
  PetscCall(PetscFree3(active, x0, sum));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfaceUntangle(SbTriangleFile *f, PetscReal reach, SbSurfaceRepairs *m)
{
  SbTriangles *t = f->t;
  Search search, left;
  PetscInt ncrossing = 0;
  char why[192] = "", option[SB_OPTION_NAME_MAX];
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(t->ntri, &search.crossing));
  PetscCall(find_pairs(t, &search));
  for (PetscInt i = 0; i < t->ntri; i++) ncrossing += search.crossing[i];
  m->npairs = search.n;
  left = search;
  if (search.n && (PetscReal)ncrossing > FEW * (PetscReal)t->ntri)
    (void)snprintf(why, sizeof(why),
                   "with %" PetscInt_FMT " of %" PetscInt_FMT " triangles it is no small fold", ncrossing,
                   t->ntri);
  else if (search.n && reach > 0) {
    PetscCall(untangle(t, reach, &left, m));
    if (left.n || m->untangled > reach)
      (void)snprintf(why, sizeof(why), "smoothing did not part them within %.3g m (%s)", (double)reach,
                     SbImportOption(f->groups, "untangle", option));
  } else if (search.n)
    (void)snprintf(why, sizeof(why), "%s 0 forbids to smooth it",
                   SbImportOption(f->groups, "untangle", option));
  PetscCall(PetscFree(search.crossing));
  if (why[0]) ierr = name_pairs(f, &search, why);
  PetscFunctionReturn(ierr);
}
