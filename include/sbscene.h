/*
  sbscene.h - layer 6: from an option file to a model.
*/
#pragma once
#include "sboutput.h"

PetscErrorCode SbRegisterAll(void);                       /* every type and option row of the program, in one readable list */
PetscErrorCode SbSceneCreate(MPI_Comm comm, SbModel *model); /* reads -bodies, -sets, -effects; nothing is computed yet */
