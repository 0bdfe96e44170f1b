/*
  intersection.c - intersection of a segment and a triangle, and of two triangles beyond their
  common corners.

  Two triangles intersect if and only if an edge of one intersects the other. With a common corner
  only the two opposite edges are tested; with a common edge, whether one triangle is folded onto
  the other. Decisions are made by the signs of determinants, orient(a, b, c, d) = (a - d) . (b - d)
  x (c - d), in double precision if above the rounding error bound (Shewchuk, "Adaptive precision
  floating-point arithmetic", 1997, the first stage), else in long double, and zero below the bound
  of that. Coplanar cases are decided in two dimensions.
*/
#include <float.h>
#include "sbgeometry.h"

static int sign_of(long double value, long double bound)
{
  return (value > bound) - (value < -bound);
}

static int orient_long(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3],
                       const PetscReal d[3])
{
  long double u[3], v[3], w[3];
  long double det = 0;
  long double size = 0;

  for (int k = 0; k < 3; k++) {
    u[k] = (long double)a[k] - d[k];
    v[k] = (long double)b[k] - d[k];
    w[k] = (long double)c[k] - d[k];
  }
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3;
    const int j = (k + 2) % 3;

    det += u[k] * (v[i] * w[j] - v[j] * w[i]);
    size += fabsl(u[k]) * (fabsl(v[i] * w[j]) + fabsl(v[j] * w[i]));
  }
  return sign_of(det, 16 * LDBL_EPSILON * size);
}

/* Side of the plane a b c on which d lies: -1 above (counter-clockwise seen from d), 0 on it, 1
   below. */
static int orient(const PetscReal a[3], const PetscReal b[3], const PetscReal c[3],
                  const PetscReal d[3])
{
  PetscReal u[3], v[3], w[3];
  PetscReal det = 0;
  PetscReal size = 0;

  SbSubtract(a, d, u);
  SbSubtract(b, d, v);
  SbSubtract(c, d, w);
  for (int k = 0; k < 3; k++) {
    const int i = (k + 1) % 3;
    const int j = (k + 2) % 3;

    det += u[k] * (v[i] * w[j] - v[j] * w[i]);
    size += PetscAbsReal(u[k]) * (PetscAbsReal(v[i] * w[j]) + PetscAbsReal(v[j] * w[i]));
  }
  if (PetscAbsReal(det) > 8 * PETSC_MACHINE_EPSILON * size)
    return det > 0 ? 1 : -1;
  return orient_long(a, b, c, d);
}

/* The two coordinates in which the projected area of the triangle is largest. */
static void axes_of(PetscReal const *const t[3], int axis[2])
{
  PetscReal e[3], f[3], n[3];
  int most = 0;

  SbSubtract(t[1], t[0], e);
  SbSubtract(t[2], t[0], f);
  SbCross(e, f, n);
  for (int k = 1; k < 3; k++)
    if (PetscAbsReal(n[k]) > PetscAbsReal(n[most]))
      most = k;
  axis[0] = (most + 1) % 3;
  axis[1] = (most + 2) % 3;
}

/* Side of the line from a to b on which c lies, in these two coordinates. */
static int orient_plane(const int axis[2], const PetscReal a[3], const PetscReal b[3],
                        const PetscReal c[3])
{
  const int x = axis[0];
  const int y = axis[1];
  const long double l = ((long double)a[x] - c[x]) * ((long double)b[y] - c[y]);
  const long double r = ((long double)a[y] - c[y]) * ((long double)b[x] - c[x]);

  return sign_of(l - r, 8 * LDBL_EPSILON * (fabsl(l) + fabsl(r)));
}

/* Whether c, collinear with a and b, is between them. */
static PetscBool between(const int axis[2], const PetscReal a[3], const PetscReal b[3],
                         const PetscReal c[3])
{
  const int x = axis[0];
  const int y = axis[1];

  return (PetscBool)(c[x] >= PetscMin(a[x], b[x]) && c[x] <= PetscMax(a[x], b[x]) &&
                     c[y] >= PetscMin(a[y], b[y]) && c[y] <= PetscMax(a[y], b[y]));
}

static PetscBool segments_meet(const int axis[2], const PetscReal a[3], const PetscReal b[3],
                               const PetscReal c[3], const PetscReal d[3])
{
  const int abc = orient_plane(axis, a, b, c);
  const int abd = orient_plane(axis, a, b, d);
  const int cda = orient_plane(axis, c, d, a);
  const int cdb = orient_plane(axis, c, d, b);

  if (abc * abd < 0 && cda * cdb < 0)
    return PETSC_TRUE;

  // an endpoint of one on the other
  return (PetscBool)((!abc && between(axis, a, b, c)) || (!abd && between(axis, a, b, d)) ||
                     (!cda && between(axis, c, d, a)) || (!cdb && between(axis, c, d, b)));
}

/* Whether a segment and a triangle in one plane intersect. */
static PetscBool meet_in_plane(const PetscReal p[3], const PetscReal q[3],
                               PetscReal const *const t[3])
{
  int axis[2], side[3];

  axes_of(t, axis);
  for (int k = 0; k < 3; k++)
    if (segments_meet(axis, p, q, t[k], t[(k + 1) % 3]))
      return PETSC_TRUE;
  for (int k = 0; k < 3; k++)
    side[k] = orient_plane(axis, t[k], t[(k + 1) % 3], p);
  return (PetscBool)(side[0] && side[0] == side[1] && side[1] == side[2]);
}

PetscBool SbSegmentMeetsTriangle(const PetscReal p[3], const PetscReal q[3],
                                 PetscReal const *const t[3])
{
  const int above = orient(t[0], t[1], t[2], p);
  const int below = orient(t[0], t[1], t[2], q);
  int least = 1;
  int most = -1;

  if (above && above == below)
    return PETSC_FALSE;
  if (!above && !below)
    return meet_in_plane(p, q, t);
  for (int k = 0; k < 3; k++) {
    const int s = orient(p, q, t[k], t[(k + 1) % 3]);

    least = PetscMin(least, s);
    most = PetscMax(most, s);
  }
  return (PetscBool)(least >= 0 || most <= 0);
}

/* Whether two triangles with the common edge pq, opposite corners a and b, are folded onto each
   other. */
static PetscBool folded(const PetscReal p[3], const PetscReal q[3], const PetscReal a[3],
                        const PetscReal b[3])
{
  PetscReal const *const t[3] = {p, q, a};
  int axis[2];

  if (orient(p, q, a, b))
    return PETSC_FALSE;
  axes_of(t, axis);
  return (PetscBool)(orient_plane(axis, p, q, a) * orient_plane(axis, p, q, b) >= 0);
}

PetscBool SbTrianglesCross(const PetscReal x[], const PetscInt a[3], const PetscInt b[3])
{
  const PetscInt *v[2] = {a, b};
  PetscReal const *c[2][3];
  int ncommon = 0;
  int own[2] = {3, 3}; /* with two common corners: position of the third one */
  int common[2] = {0, 0};

  for (int i = 0; i < 3; i++) {
    c[0][i] = x + 3 * v[0][i];
    c[1][i] = x + 3 * v[1][i];
    for (int j = 0; j < 3; j++) {
      if (v[0][i] != v[1][j])
        continue;
      ncommon++;
      own[0] -= i;
      own[1] -= j;
      common[0] = i;
      common[1] = j;
    }
  }
  if (ncommon == 3)
    return PETSC_TRUE;
  if (ncommon == 2)
    return folded(c[0][(own[0] + 1) % 3], c[0][(own[0] + 2) % 3], c[0][own[0]], c[1][own[1]]);
  for (int s = 0; s < 2; s++) {
    for (int k = 0; k < 3; k++) {
      if (ncommon && k != (common[s] + 1) % 3)
        continue;
      if (SbSegmentMeetsTriangle(c[s][k], c[s][(k + 1) % 3], c[1 - s]))
        return PETSC_TRUE;
    }
  }
  return PETSC_FALSE;
}
