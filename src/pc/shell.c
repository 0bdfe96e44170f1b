/*
  Preconditioners of our own are PCSHELLs of PETSc, and known by their names.
*/
#include "sbpc.h"

PetscErrorCode SbPCShellFind(PC pc, const char *name, void *context)
{
  const char *own = NULL;
  PetscBool is;

  PetscFunctionBeginUser;
  *(void **)context = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCSHELL, &is));
  if (is)
    PetscCall(PCShellGetName(pc, &own));
  if (own && !strcmp(own, name))
    PetscCall(PCShellGetContext(pc, context));
  PetscFunctionReturn(PETSC_SUCCESS);
}
