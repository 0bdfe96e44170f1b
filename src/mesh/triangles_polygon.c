/*
  triangles_polygon.c - a polygon as triangles between its corners: a fan where that works, else ear by ear.

  Signs are those of areas seen along the polygon's normal (Newell's sum over its edges, which a slightly warped one has, too). An
  ear is a corner that turns left and whose triangle holds no other corner; cut off is the one whose triangle has the largest smallest
  angle, so that corners on a straight line do not end as triangles without area (Meisters, "Polygons have ears", 1975).
*/
#include "sbkernel.h"
#include "triangles.h"

#define CORNERS_MAX 1000 /* of a polygon that is no fan: the search for ears takes their number cubed */
#define THIN 1e-9        /* area over longest edge squared, below which a fan's triangle is not taken */

typedef struct {
  const PetscReal *x;
  PetscReal normal[3];
} Polygon;

/* Newell's normal; its length is twice the area. */
static void find_normal(PetscInt n, const PetscInt vert[], Polygon *p)
{
  const PetscReal *o = p->x + 3 * vert[0];

  for (int k = 0; k < 3; k++) p->normal[k] = 0;
  for (PetscInt i = 1; i + 1 < n; i++) {
    const PetscReal *a = p->x + 3 * vert[i], *b = p->x + 3 * vert[i + 1];
    const PetscReal u[3] = {a[0] - o[0], a[1] - o[1], a[2] - o[2]},
                    v[3] = {b[0] - o[0], b[1] - o[1], b[2] - o[2]};
    PetscReal c[3];

    SbCross(u, v, c);
    for (int k = 0; k < 3; k++) p->normal[k] += c[k];
  }
}

/* Twice the area of a triangle seen along the normal, times the normal's length; longest2: longest edge squared. */
static PetscReal seen_area(const Polygon *p, PetscInt a, PetscInt b, PetscInt c, PetscReal *longest2)
{
  const PetscReal *x = p->x + 3 * a, *y = p->x + 3 * b, *z = p->x + 3 * c;
  const PetscReal u[3] = {y[0] - x[0], y[1] - x[1], y[2] - x[2]},
                  v[3] = {z[0] - x[0], z[1] - x[1], z[2] - x[2]},
                  w[3] = {z[0] - y[0], z[1] - y[1], z[2] - y[2]};
  PetscReal n[3];

  SbCross(u, v, n);
  if (longest2) *longest2 = PetscMax(SbDot3(u, u), PetscMax(SbDot3(v, v), SbDot3(w, w)));
  return SbDot3(n, p->normal);
}

static PetscBool is_fan(const Polygon *p, PetscInt n, const PetscInt vert[], PetscReal length)
{
  PetscReal longest2;

  for (PetscInt i = 1; i + 1 < n; i++) {
    const PetscReal area = seen_area(p, vert[0], vert[i], vert[i + 1], &longest2);

    if (!(area > THIN * longest2 * length)) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* Area over longest edge squared of the triangle at corner i; negative when it is no ear. */
static PetscReal ear_quality(const Polygon *p, PetscInt n, const PetscInt vert[], PetscInt i)
{
  const PetscInt a = vert[(i + n - 1) % n], b = vert[i], c = vert[(i + 1) % n];
  PetscReal longest2;
  const PetscReal area = seen_area(p, a, b, c, &longest2);

  if (!(area > 0)) return -1;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt d = vert[k];

    if (d == a || d == b || d == c) continue;
    if (seen_area(p, a, b, d, NULL) >= 0 && seen_area(p, b, c, d, NULL) >= 0 &&
        seen_area(p, c, a, d, NULL) >= 0)
      return -1;
  }
  return area / longest2;
}

/* Corners are taken out of `left` one by one; what is no polygon without crossings ends as a fan, for the checks to refuse. */
static PetscErrorCode cut_ears(const Polygon *p, PetscInt n, PetscInt left[], int64_t number,
                               SbTriangleFile *f)
{
  PetscFunctionBeginUser;
  while (n > 3) {
    PetscReal best = -1;
    PetscInt ear = 0;

    for (PetscInt i = 0; i < n; i++) {
      const PetscReal quality = ear_quality(p, n, left, i);

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

PetscErrorCode SbTrianglesAddPolygon(SbScan *s, PetscInt n, const PetscInt vert[], int64_t number,
                                     SbTriangleFile *f)
{
  Polygon p = {.x = f->t->x};
  PetscInt left[CORNERS_MAX];
  PetscBool fan = PETSC_TRUE;

  PetscFunctionBeginUser;
  if (n > 3) {
    find_normal(n, vert, &p);
    fan = is_fan(&p, n, vert, PetscSqrtReal(SbDot3(p.normal, p.normal)));
  }
  if (!fan) {
    if (n > CORNERS_MAX)
      SB_SCAN_ERROR(s,
                    "face %lld has %lld corners and is not convex; supple takes up to %d, cut it into parts",
                    (long long)number, (long long)n, CORNERS_MAX);
    PetscCall(PetscArraycpy(left, vert, n));
    PetscCall(cut_ears(&p, n, left, number, f));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (PetscInt i = 1; i + 1 < n; i++) PetscCall(SbTrianglesAdd(f, vert[0], vert[i], vert[i + 1], number));
  PetscFunctionReturn(PETSC_SUCCESS);
}
