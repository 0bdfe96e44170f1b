/*
  names.c - lists of names in a scenario.

  Names of bodies, sets and effects are parts of option names: -body_<name>_young. These are case-insensitive
  in PETSc, hence names must differ in more than case. PETSc also takes `-body_young` for a missing
  `-body_1_young`: a part of a name that has only digits could read another name's option, and is an error.
*/
#include <ctype.h>
#include "scene_impl.h"

#define NAME_LENGTH 31 /* PETSc allows 63 characters of an option's name in YAML files */

/* Describes what is wrong with a name; NULL if it is valid. */
static const char *name_problem(const char *name)
{
  PetscBool only_digits = PETSC_FALSE;

  if (strlen(name) > NAME_LENGTH) return "is longer than 31 characters";
  if (!isalpha((unsigned char)name[0])) return "does not begin with a letter";
  for (const char *c = name; *c; c++)
    if (!isalnum((unsigned char)*c) && *c != '_') return "may hold letters, digits and underscores only";
  for (const char *c = name; *c; c++) {
    if (*c == '_') {
      if (!c[1] || c[1] == '_') return "has an underscore without a word after it";
      only_digits = PETSC_TRUE;
    } else if (!isdigit((unsigned char)*c))
      only_digits = PETSC_FALSE;
    if (only_digits && *c != '_' && (c[1] == '_' || !c[1]))
      return "has a part of digits only; leave out the underscore before it";
  }
  if (!strcasecmp(name, "all") || !strcasecmp(name, "boundary"))
    return "has a meaning of its own where sets are named";
  return NULL;
}

PetscErrorCode SbSceneReadNames(const char *key, const char *what, PetscInt *n, char (**names)[SB_NAME_MAX])
{
  char problem[4 * SB_NAME_MAX] = "";

  PetscFunctionBeginUser;
  PetscCall(SbOptionNames(&SbRunScope, key, n, names));
  // the first invalid name
  for (PetscInt i = 0; i < *n && !problem[0]; i++) {
    const char *name = (*names)[i], *wrong = name_problem(name);

    if (!strcmp(what, "body") && !strcasecmp(name, SB_OPTION_DEFAULT))
      wrong = "stands for all bodies in -body_default_young and the like";
    if (wrong) PetscCall(PetscSNPrintf(problem, sizeof(problem), "the name '%s' %s", name, wrong));
    for (PetscInt j = 0; j < i && !problem[0]; j++) {
      const char *hint = strcmp(name, (*names)[j]) ? " (upper and lower case count as one)" : "";

      if (strcasecmp(name, (*names)[j])) continue;
      PetscCall(PetscSNPrintf(problem, sizeof(problem),
                              "two are named '%s'%s; every %s needs a name of its own", name, hint, what));
    }
  }
  if (problem[0]) PetscCall(PetscFree(*names));
  PetscCheck(!problem[0], PETSC_COMM_SELF, PETSC_ERR_USER, "-%s: %s", key, problem);
  PetscFunctionReturn(PETSC_SUCCESS);
}
