/*
  version.h - what -version says of the two programs.
*/
#pragma once
#include "sbbase.h"

/* Prints name, version, commit, compiler and its flags, PETSc. Collective. */
PetscErrorCode SbVersionPrint(MPI_Comm comm, const char *program);
