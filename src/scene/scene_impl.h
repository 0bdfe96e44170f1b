/*
  scene_impl.h - shared declarations of src/scene/.
*/
#pragma once
#include "sbledger.h"
#include "sbscene.h"

extern const SbOption SbCommandRows[], SbRunRows[], SbBodyRows[], SbInclusionRows[], SbSetRows[];

/* Reads the sets of -sets, then those that effects name without one, into model->set. Not collective. */
PetscErrorCode SbSceneReadSets(SbModel model);

/* Placement of a copy of a body. */
typedef struct {
  PetscReal x[3], rotate[4], scale, velocity[3]; /* m; axis, degrees; factor; m/s */
} SbPlacement;
/* Reads the n placements of -body_<name>_copies, 0: no copies. Collective; the caller frees. */
PetscErrorCode SbSceneReadCopies(MPI_Comm comm, const char *name, PetscInt *n, SbPlacement **place);
/* Adds a further scale, rotation and translation to the body. */
void SbPlacementAdd(const SbPlacement *place, SbBody *body);

/* Reads the names of bodies, sets or effects from an option of class "": each begins with a letter and has
   letters, digits and underscores, is not a reserved word, and occurs once. `what` is "body", "set" or
   "effect". The caller frees the names with PetscFree(). */
PetscErrorCode SbSceneReadNames(const char *key, const char *what, PetscInt *n, char (**names)[SB_NAME_MAX]);
