/*
  weld.c - merges points within a tolerance; removes unused points.
*/
#include "sbgeometry.h"

PetscErrorCode SbWeld(PetscInt n, const PetscReal x[], PetscReal tolerance, PetscBool chains,
                      PetscInt map[])
{
  PetscReal(*box)[6], largest = 0, grown;
  SbBoxTree tree;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, &box));
  for (PetscInt v = 0; v < n; v++) {
    for (int k = 0; k < 6; k++)
      box[v][k] = x[3 * v + k % 3];
    for (int k = 0; k < 3; k++)
      largest = PetscMax(largest, PetscAbsReal(x[3 * v + k]));
    PetscAssert(SbLengthsFit(3, x + 3 * v), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
                "Point %" PetscInt_FMT " is beyond the largest length", v);
  }
  PetscCall(SbBoxTreeCreate(n, (const PetscReal(*)[6])box, &tree));
  grown = tolerance + SB_BOX_ROUNDING * PETSC_MACHINE_EPSILON * largest;
  for (PetscInt v = 0, w; v < n; v++) {
    PetscReal around[6];
    SbBoxNearest query;

    map[v] = v;
    for (int k = 0; k < 6; k++)
      around[k] = box[v][k] + (k < 3 ? -grown : grown);
    for (SbBoxNearestBegin(&tree, around, 0, &query); SbBoxNearestNext(&query, &w);) {
      if (w >= v || SbDistance2(box[v], box[w]) > tolerance * tolerance)
        continue;
      if (chains)
        (void)SbUnionJoin(map, v, w);
      else if (map[w] == w)
        map[v] = PetscMin(map[v], w);
    }
  }
  for (PetscInt v = 0; v < n; v++)
    map[v] = SbUnionRoot(map, v);
  PetscCall(SbBoxTreeDestroy(&tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbUnionLabel(PetscInt n, PetscInt up[])
{
  PetscInt count = 0;

  for (PetscInt i = 0; i < n; i++)
    up[i] = SbUnionRoot(up, i);

  // roots precede the other points of their tree; a root's entry becomes its label
  for (PetscInt i = 0; i < n; i++)
    up[i] = up[i] == i ? count++ : up[up[i]];
  return count;
}

PetscErrorCode SbDropUnusedPoints(PetscInt *n, PetscReal x[], PetscInt nused, PetscInt used[])
{
  PetscInt *map;
  PetscInt kept = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(*n, &map));
  for (PetscInt i = 0; i < nused; i++)
    map[used[i]] = 1;
  for (PetscInt v = 0; v < *n; v++) {
    if (!map[v])
      continue;
    PetscCall(PetscArraymove(x + 3 * kept, x + 3 * v, 3));
    map[v] = kept++;
  }
  *n = kept;
  for (PetscInt i = 0; i < nused; i++)
    used[i] = map[used[i]];
  PetscCall(PetscFree(map));
  PetscFunctionReturn(PETSC_SUCCESS);
}
