/*
  Defaults for options of PETSc's objects, in PETSc's database.
*/
#include "sbbase.h"

PetscErrorCode SbOptionsSetDefaults(const char *prefix, const char *options, PetscBool clear)
{
  char **word;
  int n;

  PetscFunctionBeginUser;
  PetscCall(PetscStrToArray(options, ' ', &n, &word));
  for (int k = 0; k < n; k++) {
    const char *key = word[k] + 1;
    const char *value = "";
    char name[128];
    char there[128] = "";
    PetscBool given;

    if (k + 1 < n && word[k + 1][0] != '-')
      value = word[++k];
    if (!strcmp(key, "ksp_type") || !strcmp(key, "pc_type"))
      continue;
    PetscCall(PetscSNPrintf(name, sizeof(name), "-%s%s", prefix, key));
    PetscCall(PetscOptionsGetString(NULL, NULL, name, there, sizeof(there), &given));
    if (!clear && !given)
      PetscCall(PetscOptionsSetValue(NULL, name, value[0] ? value : NULL));
    if (clear && given && !strcmp(there, value))
      PetscCall(PetscOptionsClearValue(NULL, name));
  }
  PetscCall(PetscStrToArrayDestroy(n, word));
  PetscFunctionReturn(PETSC_SUCCESS);
}
