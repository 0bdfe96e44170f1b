/*
  triangles_measure.c - areas, edges, volumes and solid angles (van Oosterom and Strackee 1983) of triangles.
*/
#include "triangles.h"

static const PetscReal *corner(const SbTriangles *t, PetscInt f, int k)
{
  return t->x + 3 * t->tri[3 * f + k];
}

PetscReal SbTriangleArea(const SbTriangles *t, PetscInt f, PetscBool *flat)
{
  PetscReal e[3][3], n[3], longest2 = 0, twice;

  for (int k = 0; k < 3; k++) {
    SbSubtract(corner(t, f, (k + 1) % 3), corner(t, f, k), e[k]);
    longest2 = PetscMax(longest2, SbDot3(e[k], e[k]));
  }
  SbCross(e[0], e[1], n);
  twice = PetscSqrtReal(SbDot3(n, n));
  if (flat) *flat = (PetscBool) !(twice > SB_TRIANGLE_FLAT * longest2);
  return 0.5 * twice;
}

PetscReal SbTrianglesMeanEdge(const SbTriangles *t)
{
  PetscReal sum = 0;

  for (PetscInt f = 0; f < t->ntri; f++) {
    PetscReal around = 0;

    for (int k = 0; k < 3; k++)
      around += PetscSqrtReal(SbDistance2(corner(t, f, (k + 1) % 3), corner(t, f, k)));
    sum += around;
  }
  return t->ntri ? sum / (3 * (PetscReal)t->ntri) : 0;
}

void SbTrianglesEdges(const SbTriangles *t, SbKey edge[])
{
  for (PetscInt i = 0; i < 3 * t->ntri; i++)
    edge[i] = (SbKey){SbKeyOfPair(t->tri[i], t->tri[SbSlotNext(i)]), i};
  SbKeysSort(3 * t->ntri, edge);
}

PetscReal SbTetVolumeTo(const SbTriangles *t, PetscInt f, const PetscReal o[3])
{
  PetscReal a[3][3], n[3];

  for (int k = 0; k < 3; k++) SbSubtract(corner(t, f, k), o, a[k]);
  SbCross(a[0], a[1], n);
  return SbDot3(n, a[2]) / 6;
}

PetscReal SbTriangleSolidAngle(const PetscReal x[], const PetscInt v[3], const PetscReal o[3])
{
  PetscReal a[3][3], l[3], n[3], down;

  for (int k = 0; k < 3; k++) {
    SbSubtract(x + 3 * v[k], o, a[k]);
    l[k] = PetscSqrtReal(SbDot3(a[k], a[k]));
  }
  SbCross(a[0], a[1], n);
  down =
    l[0] * l[1] * l[2] + SbDot3(a[0], a[1]) * l[2] + SbDot3(a[1], a[2]) * l[0] + SbDot3(a[2], a[0]) * l[1];
  return 2 * atan2(SbDot3(n, a[2]), down);
}
