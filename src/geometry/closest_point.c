/*
  closest_point.c - closest point of a triangle to a point, and intersection of a ray with a
  triangle.

  Closest point by the Voronoi regions of Ericson, "Real-Time Collision Detection", 2005, 5.1.5.
*/
#include "sbgeometry.h"

#define FLAT 1e-12     /* flat triangle: largest area over squared edge length */
#define SLIM 1e-4      /* slim triangle, where rounding may change the region: likewise */
#define RIM 1e-6       /* tolerance of barycentric coordinates: rays through edges hit */
#define PARALLEL 1e-10 /* parallel ray: largest triple product over squared edge length */

/* r = p minus the point with barycentric coordinates w. */
static inline void away(const PetscReal p[3], const PetscReal *const x[3], const PetscReal w[3],
                        PetscReal r[3])
{
  for (int k = 0; k < 3; k++)
    r[k] = w[0] * (p[k] - x[0][k]) + w[1] * (p[k] - x[1][k]) + w[2] * (p[k] - x[2][k]);
}

static SbTriangleFeature put(SbTriangleFeature place, PetscReal w0, PetscReal w1, PetscReal w2,
                             PetscReal w[3])
{
  w[0] = w0;
  w[1] = w1;
  w[2] = w2;
  return place;
}

/* Closest point on the three edges, if its squared distance is less than d2. */
static SbTriangleFeature closest_edge(const PetscReal p[3], const PetscReal *const x[3],
                                      SbTriangleFeature place, PetscReal w[3], PetscReal *d2)
{
  for (int k = 0; k < 3; k++) {
    const int l = (k + 1) % 3;
    PetscReal e[3], r[3], length2, t, other;

    SbSubtract(x[l], x[k], e);
    SbSubtract(p, x[k], r);
    length2 = SbDot3(e, e);
    t = length2 > 0 ? PetscMax(0, PetscMin(1, SbDot3(r, e) / length2)) : 0;
    for (int i = 0; i < 3; i++)
      r[i] -= t * e[i];
    other = SbDot3(r, r);
    if (other >= *d2)
      continue;
    *d2 = other;
    w[k] = 1 - t;
    w[l] = t;
    w[(k + 2) % 3] = 0;
    if (t <= 0)
      place = (SbTriangleFeature)k;
    else if (t >= 1)
      place = (SbTriangleFeature)l;
    else
      place = (SbTriangleFeature)(SB_FEATURE_EDGE_0 + k);
  }
  return place;
}

SbTriangleFeature SbTriangleClosestPoint(const PetscReal p[3], const PetscReal *const x[3],
                                         PetscReal w[3], PetscReal *d2)
{
  PetscReal ab[3], ac[3], r[3], d[6], area[3];
  SbTriangleFeature place;

  // products of the edges at corner 0 with vectors from corners to p; unnormalised barycentric
  // coordinates
  SbSubtract(x[1], x[0], ab);
  SbSubtract(x[2], x[0], ac);
  for (int k = 0; k < 3; k++) {
    SbSubtract(p, x[k], r);
    d[2 * k] = SbDot3(ab, r);
    d[2 * k + 1] = SbDot3(ac, r);
  }
  area[2] = d[0] * d[3] - d[2] * d[1];
  area[1] = d[4] * d[1] - d[0] * d[5];
  area[0] = d[2] * d[5] - d[4] * d[3];

  // Voronoi regions of the corners, of the edges, then the face
  if (d[0] <= 0 && d[1] <= 0)
    place = put(SB_FEATURE_CORNER_0, 1, 0, 0, w);
  else if (d[2] >= 0 && d[3] <= d[2])
    place = put(SB_FEATURE_CORNER_1, 0, 1, 0, w);
  else if (d[5] >= 0 && d[4] <= d[5])
    place = put(SB_FEATURE_CORNER_2, 0, 0, 1, w);
  else if (area[2] <= 0 && d[0] >= 0 && d[2] <= 0 && d[0] > d[2]) {
    const PetscReal t = d[0] / (d[0] - d[2]);
    place = put(SB_FEATURE_EDGE_0, 1 - t, t, 0, w);
  } else if (area[1] <= 0 && d[1] >= 0 && d[5] <= 0 && d[1] > d[5]) {
    const PetscReal t = d[1] / (d[1] - d[5]);
    place = put(SB_FEATURE_EDGE_2, 1 - t, 0, t, w);
  } else if (area[0] <= 0 && d[3] >= d[2] && d[4] >= d[5] && d[3] - d[2] + d[4] - d[5] > 0) {
    const PetscReal t = (d[3] - d[2]) / (d[3] - d[2] + d[4] - d[5]);
    place = put(SB_FEATURE_EDGE_1, 0, 1 - t, t, w);
  } else {
    const PetscReal scale = PetscMax(d[0] - d[2], d[1] - d[5]); /* squared lengths of ab, ac */
    const PetscReal total = area[0] + area[1] + area[2];

    // barycentric coordinates; for slim triangles also test the edges
    *d2 = PETSC_MAX_REAL;
    if (total > FLAT * FLAT * scale * scale) {
      w[1] = area[1] / total;
      w[2] = area[2] / total;
      w[0] = PetscMax(0, 1 - w[1] - w[2]);
      away(p, x, w, r);
      *d2 = SbDot3(r, r);
      if (total > SLIM * SLIM * scale * scale)
        return SB_FEATURE_FACE;
    }
    return closest_edge(p, x, SB_FEATURE_FACE, w, d2);
  }
  away(p, x, w, r);
  *d2 = SbDot3(r, r);
  return place;
}

PetscBool SbRayTriangle(const PetscReal p[3], const PetscReal way[3], const PetscReal *const x[3],
                        PetscReal *t, PetscReal weight[3], PetscBool *out)
{
  PetscReal e1[3], e2[3], r[3], c[3], det;

  /* Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997 */
  SbSubtract(x[1], x[0], e1);
  SbSubtract(x[2], x[0], e2);
  SbSubtract(p, x[0], r);
  SbCross(way, e2, c);
  det = SbDot3(e1, c);
  if (!(PetscAbsReal(det) > PARALLEL * SbDot3(e1, e1) * PetscSqrtReal(SbDot3(way, way))))
    return PETSC_FALSE;
  weight[1] = SbDot3(r, c) / det;
  SbCross(r, e1, c);
  weight[2] = SbDot3(way, c) / det;
  *t = SbDot3(e2, c) / det;
  *out = (PetscBool)(det < 0);
  for (int k = 1; k < 3; k++)
    weight[k] = PetscAbsReal(weight[k]) < RIM ? 0 : weight[k];
  weight[0] = 1 - weight[1] - weight[2];
  if (PetscAbsReal(weight[0]) < RIM) {
    weight[0] = 0;
    weight[1] /= weight[1] + weight[2];
    weight[2] = 1 - weight[1];
  }
  return (PetscBool)(*t >= 0 && weight[0] >= 0 && weight[1] >= 0 && weight[2] >= 0);
}
