/*
  signed_distance.c - signed distance from a closed triangulated surface.

  The nearest triangle is found by a box tree. The sign is that of the angle-weighted pseudonormal
  at the closest point (Baerentzen and Aanaes, "Signed distance computation using the angle weighted
  pseudonormal", IEEE TVCG 11(3), 2005). Exact up to rounding; nothing is sampled.
*/
#include "sbgeometry.h"

#define TOUCH 1e-9 /* of the size; nearer to an edge or corner the normal is the pseudonormal */

struct _p_SbSignedDistance {
  const PetscReal *x;     /* [nvert][3] m */
  const PetscInt *tri;    /* [ntri][3] */
  const PetscInt *across; /* [ntri][3] neighbour across each edge */
  PetscReal *normal,
    *corner;       /* [ntri][3] unit face normals; [nvert][3] angle-weighted vertex normals */
  PetscReal touch; /* TOUCH times the size of the surface, m */
  SbBoxTree tree;
};

PetscErrorCode SbSignedDistanceCreate(PetscInt nvert, const PetscReal x[], PetscInt ntri,
                                      const PetscInt tri[], const PetscInt across[],
                                      SbSignedDistance *distance)
{
  SbSignedDistance s;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  *distance = s;
  s->x = x;
  s->tri = tri;
  s->across = across;
  PetscCall(SbBoxTreeCreateTriangles(ntri, tri, x, &s->tree));
  for (int k = 0; k < 3 && ntri; k++)
    s->touch = PetscMax(s->touch, TOUCH * (s->tree.hull[3 + k] - s->tree.hull[k]));

  // face normals, and vertex normals weighted by the angles of the faces
  PetscCall(PetscCalloc2(3 * (size_t)ntri, &s->normal, 3 * (size_t)nvert, &s->corner));
  for (PetscInt f = 0; f < ntri; f++) {
    PetscReal e[3][3], c[3];
    PetscReal *n = s->normal + 3 * f;

    for (int k = 0; k < 3; k++)
      SbSubtract(x + 3 * tri[3 * f + (k + 1) % 3], x + 3 * tri[3 * f + k], e[k]);
    SbCross(e[0], e[1], n);
    (void)SbNormalise(n);
    for (int k = 0; k < 3; k++) {
      PetscReal angle;

      SbCross(e[k], e[(k + 2) % 3], c);
      angle = atan2(PetscSqrtReal(SbDot3(c, c)), -SbDot3(e[k], e[(k + 2) % 3]));
      for (int i = 0; i < 3; i++)
        s->corner[3 * tri[3 * f + k] + i] += angle * n[i];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSignedDistanceDestroy(SbSignedDistance *distance)
{
  SbSignedDistance s = *distance;

  PetscFunctionBeginUser;
  if (!s)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbBoxTreeDestroy(&s->tree));
  PetscCall(PetscFree2(s->normal, s->corner));
  PetscCall(PetscFree(*distance));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbSignedDistanceEvaluate(SbSignedDistance s, const PetscReal x[3], PetscReal n[3])
{
  const PetscReal box[6] = {x[0], x[1], x[2], x[0], x[1], x[2]};
  const PetscReal *face;
  PetscReal r[3] = {0, 0, 0};
  PetscReal pseudo[3], length, d, sign;
  SbTriangleFeature feature = SB_FEATURE_FACE;
  SbBoxNearest walk;
  PetscInt f;
  PetscInt nearest = 0;

  // nearest triangle; a point with NaN or infinite coordinates has none
  SbBoxNearestBegin(&s->tree, box, SbDot3(x, x) <= PETSC_MAX_REAL ? PETSC_MAX_REAL : -1, &walk);
  while (SbBoxNearestNext(&walk, &f)) {
    const PetscInt *v = s->tri + 3 * f;
    const PetscReal *const p[3] = {s->x + 3 * v[0], s->x + 3 * v[1], s->x + 3 * v[2]};
    PetscReal w[3], d2;
    const SbTriangleFeature at = SbTriangleClosestPoint(x, p, w, &d2);

    if (d2 >= walk.limit2)
      continue;
    walk.limit2 = d2;
    nearest = f;
    feature = at;
    for (int i = 0; i < 3; i++)
      r[i] = w[0] * (x[i] - p[0][i]) + w[1] * (x[i] - p[1][i]) + w[2] * (x[i] - p[2][i]);
  }

  // closest point inside a face: signed height, smooth across the surface
  face = s->normal + 3 * nearest;
  if (feature == SB_FEATURE_FACE) {
    SbSubtract(x, s->x + 3 * s->tri[3 * nearest], r);
    for (int i = 0; i < 3; i++)
      n[i] = face[i];
    return SbDot3(face, r);
  }

  // closest point on an edge or corner: normal along the connection, or the pseudonormal at tiny
  // distances
  for (int i = 0; i < 3; i++)
    pseudo[i] =
      feature >= SB_FEATURE_EDGE_0
        ? face[i] + s->normal[3 * s->across[3 * nearest + (feature - SB_FEATURE_EDGE_0)] + i]
        : s->corner[3 * s->tri[3 * nearest + feature] + i];
  d = PetscSqrtReal(SbDot3(r, r));
  sign = SbDot3(pseudo, r) < 0 ? -1 : 1;
  length = PetscSqrtReal(SbDot3(pseudo, pseudo));
  for (int i = 0; i < 3; i++)
    if (d > s->touch)
      n[i] = sign * r[i] / d;
    else
      n[i] = length > 0 ? pseudo[i] / length : face[i];
  return sign * d;
}
