/*
  locate.c - which tet holds a point.

  With the weights w of the corners of a tet (barycentric coordinates) the point lies in it when none is negative. Outside, negative ones are set to
  zero and the others scaled to the sum 1; the distance is that from the point so found. It is not less than the distance of the tet, so the tree of
  boxes need not be searched farther than that.
*/
#include "sbgeometry.h"

PetscReal SbTetDeterminant(const PetscReal x[], const PetscInt v[4])
{
  PetscReal e[3][3], n[3];

  for (int k = 0; k < 3; k++) SbSubtract(x + 3 * v[k + 1], x + 3 * v[0], e[k]);
  SbCross(e[1], e[2], n);
  return SbDot3(e[0], n);
}

struct _p_SbLocator {
  const PetscInt *cell;
  const PetscReal *x;
  SbBoxTree tree; /* tets without volume, or inverted, have empty boxes */
};

PetscErrorCode SbLocatorCreate(PetscInt ncell, const PetscInt cell[], const PetscReal x[], SbLocator *locator)
{
  SbLocator l;
  PetscReal(*box)[6];

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&l));
  *locator = l;
  l->cell = cell;
  l->x = x;
  PetscCall(PetscMalloc1(ncell, &box));
  for (PetscInt c = 0; c < ncell; c++) {
    SbBoxClear(box[c]);
    if (!(SbTetDeterminant(x, cell + 4 * c) > 0)) continue;
    for (int a = 0; a < 4; a++) SbBoxAdd(box[c], x + 3 * cell[4 * c + a]);
  }
  PetscCall(SbBoxTreeCreate(ncell, (const PetscReal(*)[6])box, &l->tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbLocatorDestroy(SbLocator *locator)
{
  PetscFunctionBeginUser;
  if (*locator) PetscCall(SbBoxTreeDestroy(&(*locator)->tree));
  PetscCall(PetscFree(*locator));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volumes of the tets that the point makes with the faces, over that of the tet. */
void SbTetBarycentric(const PetscReal x[], const PetscInt v[4], const PetscReal p[3], PetscReal w[4])
{
  PetscReal e[3][3], r[3], n[3], det;

  for (int k = 0; k < 3; k++) SbSubtract(x + 3 * v[k + 1], x + 3 * v[0], e[k]);
  SbSubtract(p, x + 3 * v[0], r);
  SbCross(e[1], e[2], n);
  det = SbDot3(e[0], n);
  w[1] = SbDot3(r, n) / det;
  SbCross(r, e[2], n);
  w[2] = SbDot3(e[0], n) / det;
  SbCross(e[1], r, n);
  w[3] = SbDot3(e[0], n) / det;
  w[0] = 1 - w[1] - w[2] - w[3];
}

PetscReal SbLocatorFind(SbLocator l, const PetscReal p[3], PetscInt *cell, PetscReal weight[4])
{
  const PetscReal box[6] = {p[0], p[1], p[2], p[0], p[1], p[2]};
  PetscReal deepest = 0;
  SbBoxNearest nearest;
  PetscInt c;

  *cell = -1;
  for (int a = 0; a < 4; a++) weight[a] = 0;
  for (SbBoxNearestBegin(&l->tree, box, PETSC_MAX_REAL, &nearest); SbBoxNearestNext(&nearest, &c);) {
    PetscReal w[4], depth, sum = 0, d2 = 0;

    // moves the weights into the tet
    SbTetBarycentric(l->x, l->cell + 4 * c, p, w);
    depth = PetscMin(PetscMin(w[0], w[1]), PetscMin(w[2], w[3]));
    if (depth < 0) {
      for (int a = 0; a < 4; a++) sum += w[a] = PetscMax(w[a], 0);
      for (int a = 0; a < 4; a++) w[a] /= sum;
      for (int k = 0; k < 3; k++) {
        PetscReal r = p[k];

        for (int a = 0; a < 4; a++) r -= w[a] * l->x[3 * l->cell[4 * c + a] + k];
        d2 += r * r;
      }
    }
    if (d2 > nearest.limit2) continue;
    if (*cell >= 0 && d2 == nearest.limit2 && (depth < deepest || (depth == deepest && c > *cell))) continue;
    nearest.limit2 = d2;
    deepest = depth;
    *cell = c;
    for (int a = 0; a < 4; a++) weight[a] = w[a];
  }
  return *cell < 0 ? PETSC_MAX_REAL : PetscSqrtReal(nearest.limit2);
}
