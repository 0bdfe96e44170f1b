/*
  scene_impl.h - shared declarations of src/scene/.
*/
#pragma once
#include "sbledger.h"
#include "sbscene.h"

extern const SbOption SbCommandRows[], SbRunRows[], SbBodyRows[], SbInclusionRows[], SbSetRows[];

/* Placement of a copy of a body. */
typedef struct {
  PetscReal x[3], rotate[4], scale, velocity[3]; /* m; axis, degrees; factor; m/s */
} SbPlacement;
/* Reads the n placements of -body_<name>_copies, 0: no copies. Collective; the caller frees. */
PetscErrorCode SbSceneReadCopies(MPI_Comm comm, const char *name, PetscInt *n, SbPlacement **place);
/* Adds a further scale, rotation and translation to the body. */
void SbPlacementAdd(const SbPlacement *place, SbBody *body);
