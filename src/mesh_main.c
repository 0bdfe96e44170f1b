/*
  mesh_main.c - main program of supple-mesh.

    supple-mesh COMMAND FILE [OUT] [-option value ...]

  It uses the same readers and checks as supple.
*/
#include <signal.h>
#include "tool/tool.h"
#include "version.h"

static PetscErrorCode supple_mesh(MPI_Comm comm, int argc, char *argv[])
{
  SbToolLine line;
  SbTool tool;

  PetscFunctionBeginUser;
  PetscCall(SbErrorHandlerInstall(comm, "supple-mesh"));
  PetscCall(SbToolCommandLine(&argc, argv, &line));
  PETSC_COMM_WORLD = comm; /* where PETSc begins */
  PetscCall(SbOptionsInitialize(&argc, &argv, NULL));
  PetscCall(SbErrorCatchCrashes());
  SbMemoryReturnLarge();
  (void)SbThreadsSetOne();
  (void)signal(SIGPIPE, SIG_IGN);
  if (line.help) {
    PetscCall(SbToolHelp());
  } else if (line.version) {
    PetscCall(SbVersionPrint(comm, "supple-mesh"));
  } else {
    PetscCall(SbToolSetFromOptions(&line, &tool));
    PetscCall(SbToolRun(&tool));
  }
  PetscCall(SbStandardOutputCheck(comm));
  PetscCall(SbOptionsReset());
  PetscCall(PetscFinalize());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  if (!SbMemoryIsEnough("supple-mesh") || MPI_Init(&argc, &argv))
    return 1;
  return SbErrorFinish(supple_mesh(MPI_COMM_WORLD, argc, argv));
}
