/*
  recovery.h - a continuous stress field recovered from the stresses of the cells.
*/
#pragma once
#include "sbelement.h"
#include "sbmesh.h"

typedef struct _p_SbRecovery *SbRecovery;
/* Collective. Mesh and element[nbody] are borrowed; the caller destroys *recovery. */
PetscErrorCode SbRecoveryCreate(SbMesh mesh, const SbElement element[], SbRecovery *recovery);
/*
  SbRecoveryApply - values at the vertices from values in the cells.

  Collective. Input: P[ncell][9], set on owned cells; ghosts are updated here. SbRecoveryCorner() returns the
  result until the next call.
*/
PetscErrorCode SbRecoveryApply(SbRecovery recovery, PetscReal P[]);
/* The nine recovered values at vertex a = 0..3 of an owned cell, for its material. Not collective. */
const PetscReal *SbRecoveryCorner(SbRecovery recovery, PetscInt cell, int a);

/* Stress of a P2 cell, Pa: Piola's at the points of SbRuleQuadratic, mean pressure in the rotated frame. */
typedef struct SbPointStress {
  PetscReal P[4][9], pressure;
} SbPointStress;
/* The same for P2 bodies, with polynomials of degree two. Collective. stress[ncell], set on owned cells. */
PetscErrorCode SbRecoveryApplyQuadratic(SbRecovery recovery, SbPointStress stress[]);
/* The recovered stress P[9] and, returned, pressure at node a = 0..9 of an owned P2 cell. Not collective. */
PetscReal SbRecoveryNode(SbRecovery recovery, PetscInt cell, int a, PetscReal P[9]);
PetscErrorCode SbRecoveryDestroy(SbRecovery *recovery);
