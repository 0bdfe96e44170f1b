/*
  scene_impl.h - shared by the files of src/scene.
*/
#pragma once
#include "sbledger.h"
#include "sbscene.h"

/* Option rows of the command line and of the scene. */
PetscErrorCode SbCommandRegister(void);
PetscErrorCode SbSceneRegister(void);
PetscErrorCode SbSetsRegister(void);

/* Sets of -sets, then those that effects name without a definition; fills model->set. Not collective, same on all ranks. */
PetscErrorCode SbSceneReadSets(SbModel model);

/* Where a copy of a body is. */
typedef struct {
  PetscReal x[3], rotate[4], scale, velocity[3]; /* m; axis and degrees; 1; m/s */
} SbPlacement;
/* Those of -body_<name>_copies, n of them, 0: it is one body; a file is read by rank 0. Collective; the caller frees. */
PetscErrorCode SbSceneReadCopies(MPI_Comm comm, const char *name, PetscInt *n, SbPlacement **place);
/* Applies further scale, rotation and translation to the body. */
void SbPlacementAdd(const SbPlacement *place, SbBody *body);

/*
  Names of bodies, sets or effects, as an option of class "" gives them: each begins with a letter, goes on with letters,
  digits and underscores, is no word of its own meaning, and is there once. `what` is "body", "set" or "effect".
  PetscFree the names.
*/
PetscErrorCode SbSceneReadNames(const char *key, const char *what, PetscInt *n, char (**names)[SB_NAME_MAX]);
