/*
  signed_distance.h - signed distance from a closed surface of triangles.
*/
#pragma once
#include "sbtriangles.h"

typedef struct _p_SbShell *SbSignedDistance;

/*
  SbSignedDistanceCreate - the grid that finds near triangles, made once.

  Not collective; every rank makes the same. Takes the arrays of the triangles over, also when it fails: *triangles is zeroed.

  Input: option - for messages; triangles; cell - edge of a grid cell, m; 0: the mean edge of the triangles, or as much larger as it
  takes to stay within the usual memory.
  Errors: PETSC_ERR_USER_INPUT when the cell asks for more than SB_SIGNED_DISTANCE_CELLS cells.
*/
#define SB_SIGNED_DISTANCE_CELLS 16000000
PetscErrorCode SbSignedDistanceCreate(const char *option, SbTriangles *triangles, PetscReal cell,
                                      SbSignedDistance *shell);
PetscErrorCode SbSignedDistanceDestroy(SbSignedDistance *shell);
/* Signed distance of a point, m, negative inside, and the unit outward normal; see signed_distance.c for what is exact. Not collective. */
PetscReal SbSignedDistanceEvaluate(SbSignedDistance shell, const PetscReal x[3], PetscReal normal[3]);
/* Cells along x, y, z, their edge (m), and the bytes that all of it takes on each rank. */
void SbSignedDistanceGetSize(SbSignedDistance shell, PetscInt cells[3], PetscReal *cell, PetscInt64 *bytes,
                             PetscInt *ntri);
