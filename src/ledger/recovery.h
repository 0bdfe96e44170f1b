/*
  recovery.h - a continuous stress from the stresses of the cells.
*/
#pragma once
#include "sbmesh.h"

typedef struct _p_SbRecovery *SbRecovery;
/* Collective. The mesh is borrowed; the caller destroys. */
PetscErrorCode SbRecoveryCreate(SbMesh mesh, SbRecovery *recovery);
/*
  SbRecoveryApply - values at the vertices from values in the cells.

  Collective. Input: P[ncell][9], right on owned cells; ghosts are filled in here. The result is read by SbRecoveryCorner() until the next call.
*/
PetscErrorCode SbRecoveryApply(SbRecovery recovery, PetscReal P[]);
/* The nine recovered values at vertex a = 0..3 of an owned cell, seen from its material. Not collective. */
const PetscReal *SbRecoveryCorner(SbRecovery recovery, PetscInt cell, int a);
PetscErrorCode SbRecoveryDestroy(SbRecovery *recovery);
