/*
  version.c - version, commit and settings of the build. The Makefile gives the last two, and links
  this file into the programs only, so that a new commit does not link every test again.
*/
#include "version.h"

#ifndef SB_COMMIT
  #define SB_COMMIT ""
  #define SB_BUILT ""
#endif
#if defined(__clang__)
  #define COMPILER __VERSION__
#else
  #define COMPILER "GCC " __VERSION__
#endif

PetscErrorCode SbVersionPrint(MPI_Comm comm, const char *program)
{
  const char *commit = SB_COMMIT;
  const char *built = SB_BUILT;
  char petsc[256];

  PetscFunctionBeginUser;
  PetscCall(PetscGetVersion(petsc, sizeof(petsc)));
  PetscCall(PetscPrintf(comm, "%s %s\ncommit %s\n%s: %s\n%s\n", program, SB_VERSION,
                        commit[0] ? commit : "not known: built outside of a checkout", COMPILER,
                        built[0] ? built : "flags are not known", petsc));
  PetscFunctionReturn(PETSC_SUCCESS);
}
