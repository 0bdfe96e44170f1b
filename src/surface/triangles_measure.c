/*
  triangles_measure.c - areas, volumes and solid angles (van Oosterom and Strackee 1983) of surface triangles; sorted edges of a surface.
*/
#include "sbkernel.h"
#include "triangles.h"

static const PetscReal *corner(const SbTriangles *t, PetscInt f, int k)
{
  return t->x + 3 * t->tri[3 * f + k];
}

PetscReal SbTriangleMeasure(const SbTriangles *t, PetscInt f, PetscReal *longest2, PetscReal *around)
{
  PetscReal e[3][3], n[3];

  *longest2 = *around = 0;
  for (int k = 0; k < 3; k++) {
    PetscReal l2;

    SbSubtract(corner(t, f, (k + 1) % 3), corner(t, f, k), e[k]);
    l2 = SbDot3(e[k], e[k]);
    *longest2 = PetscMax(*longest2, l2);
    *around += PetscSqrtReal(l2);
  }
  SbCross(e[0], e[1], n);
  return PetscSqrtReal(SbDot3(n, n));
}

/* ------------------------------------------------------------------ edges */

void SbTrianglesEdges(const SbTriangles *t, SbKey edge[])
{
  for (PetscInt i = 0; i < 3 * t->ntri; i++)
    edge[i] = (SbKey){SbKeyOfPair(t->tri[i], t->tri[i % 3 == 2 ? i - 2 : i + 1]), i};
  SbKeysSort(3 * t->ntri, edge);
}

PetscReal SbTetVolumeTo(const SbTriangles *t, PetscInt f, const PetscReal o[3])
{
  PetscReal a[3][3], n[3];

  for (int k = 0; k < 3; k++) SbSubtract(corner(t, f, k), o, a[k]);
  SbCross(a[0], a[1], n);
  return SbDot3(n, a[2]) / 6;
}

PetscReal SbTriangleSolidAngle(const SbTriangles *t, PetscInt f, const PetscReal o[3])
{
  PetscReal a[3][3], l[3], n[3], down;

  for (int k = 0; k < 3; k++) {
    SbSubtract(corner(t, f, k), o, a[k]);
    l[k] = PetscSqrtReal(SbDot3(a[k], a[k]));
  }
  SbCross(a[0], a[1], n);
  down =
    l[0] * l[1] * l[2] + SbDot3(a[0], a[1]) * l[2] + SbDot3(a[1], a[2]) * l[0] + SbDot3(a[2], a[0]) * l[1];
  return 2 * atan2(SbDot3(n, a[2]), down);
}
