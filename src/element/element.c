/*
  Creation of elements by name.
*/
#include "element_impl.h"

PetscFunctionList SbElementList = NULL;

static PetscErrorCode destroy_list(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListDestroy(&SbElementList));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementRegister(const char *name, PetscErrorCode (*create)(SbElement))
{
  PetscFunctionBeginUser;
  if (!SbElementList) PetscCall(PetscRegisterFinalize(destroy_list));
  PetscCall(PetscFunctionListAdd(&SbElementList, name, create));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementRegisterAll(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbElementRegister("p1", SbElementCreate_P1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementCreate(const char *name, SbElement *element)
{
  PetscErrorCode (*create)(SbElement) = NULL;
  SbElement e;

  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListFind(SbElementList, name, &create));
  if (!create) {
    const char **names;
    int n;
    char all[256] = "";

    PetscCall(PetscFunctionListGet(SbElementList, &names, &n));
    for (int k = 0; k < n && names[k]; k++) {
      PetscCall(PetscStrlcat(all, k ? ", " : "", sizeof(all)));
      PetscCall(PetscStrlcat(all, names[k], sizeof(all)));
    }
    PetscCall(PetscFree(names));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "there is no element \"%s\": choose one of %s", name, all);
  }
  PetscCall(PetscNew(&e));
  PetscCall(PetscStrncpy(e->name, name, sizeof(e->name)));
  PetscCall((*create)(e));
  *element = e;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbElementDestroy(SbElement *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(*e));
  PetscFunctionReturn(PETSC_SUCCESS);
}
