/*
  recovery.h - a continuous stress from the stresses of the cells.
*/
#pragma once
#include "sbmesh.h"

typedef struct _p_SbRecovery *SbRecovery;
/* Collective. quadratic[nbody]: bodies of P2. The mesh is borrowed; the caller destroys. */
PetscErrorCode SbRecoveryCreate(SbMesh mesh, const PetscBool quadratic[], SbRecovery *recovery);
/*
  SbRecoveryApply - values at the vertices from values in the cells.

  Collective. Input: P[ncell][9], right on owned cells; ghosts are filled in here. The result is read by SbRecoveryCorner() until the next call.
*/
PetscErrorCode SbRecoveryApply(SbRecovery recovery, PetscReal P[]);
/* The nine recovered values at vertex a = 0..3 of an owned cell, seen from its material. Not collective. */
const PetscReal *SbRecoveryCorner(SbRecovery recovery, PetscInt cell, int a);

/* What is known in a cell of P2: stresses at the points of SbRuleQuadratic, and their mean pressure in the cell's own frame, Pa. */
typedef struct SbPointStress {
  PetscReal P[4][9], pressure;
} SbPointStress;
/* The same for bodies of P2, with polynomials of degree two. Collective. stress[ncell], right on owned cells. */
PetscErrorCode SbRecoveryApplyQuadratic(SbRecovery recovery, SbPointStress stress[]);
/* The recovered stress P[9] and the pressure at node a = 0..9 of an owned cell of P2. Not collective. */
PetscReal SbRecoveryNode(SbRecovery recovery, PetscInt cell, int a, PetscReal P[9]);
PetscErrorCode SbRecoveryDestroy(SbRecovery *recovery);
