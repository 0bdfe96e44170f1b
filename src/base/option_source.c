/*
  option_source.c - where options come from: the command line, scenario files, the environment.

  Scenarios come from others. PETSc has options that load libraries, run other programs or open
  connections; a file cannot give them, only the command line and the environment can, which are the
  user's own. They are looked for before PetscInitialize(), which obeys them, with PETSc's own
  database: aliases, prefixes, YAML and files in files count. PETSc also reads .petscrc in the home
  folder and in the working folder; supple does not. Options in PETSC_OPTIONS and PETSC_OPTIONS_YAML
  count, and are listed.
*/
#include <stdlib.h>
#include "option.h"

/* Options of PETSc that a file cannot give, by their beginnings: libraries, debuggers, X windows,
   films (a command line of ffmpeg), a web server. */
static const char refused[] = "dll_ start_in_debugger stop_for_debugger on_error_attach_debugger "
                              "on_error_emacs debugger_ display draw_ saws python viewer_socket";

/* Whether PETSc would run Python code of this name for an option. */
static PetscBool is_python(const char *name)
{
  const size_t n = strlen(name);
  const size_t m = strlen("python_type");

  return (PetscBool)(n >= m && !strcasecmp(name + n - m, "python_type"));
}

PetscErrorCode SbOptionsInitialize(int *argc, char ***argv, const char *file)
{
  PetscErrorCode ierr;
  PetscBool given = PETSC_FALSE;
  char **words;

  PetscFunctionBeginUser;

  /* PETSc keeps the list of words until the program ends; an answer of the user's stays */
  for (int i = 1; i < *argc; i++)
    given = (PetscBool)(given || !strcasecmp((*argv)[i], "-skip_petscrc"));
  if (!given) {
    static char skip[] = "-skip_petscrc";

    words = (char **)calloc((size_t)*argc + 2, sizeof(*words));
    if (words) {
      memcpy(words, *argv, (size_t)*argc * sizeof(*words));
      words[(*argc)++] = skip;
      *argv = words;
    }
  }
  ierr = PetscInitialize(argc, argv, file, NULL);
  if (!ierr && !given)
    PetscCall(PetscOptionsClearValue(NULL, "-skip_petscrc"));
  PetscFunctionReturn(ierr);
}

/* Adds the options of a file to a database, as PETSc reads it: a line has an option and its value,
   or an alias. PETSc's own reader needs MPI types that PetscInitialize() makes. False: it names a
   file that is not readable by this name. */
static PetscBool insert_file(PetscOptions database, const char *path, int depth)
{
  static const char blanks[] = " \t\r\n";
  const size_t length = strlen(path);
  const PetscBool mark = (PetscBool)(length > 5 && !strcasecmp(path + length - 5, ":yaml"));
  const char *dot = strrchr(path, '.');
  const PetscBool yaml = (PetscBool)(mark || (dot && (!strcasecmp(dot, ".yml") || //
                                                      !strcasecmp(dot, ".yaml"))));
  char name[PETSC_MAX_PATH_LEN];
  char *line = NULL;
  size_t room = 0;
  FILE *f;
  PetscBool good = PETSC_TRUE;

  SbFormat(sizeof(name), name, "%.*s", (int)(mark ? length - 5 : length), path);
  (void)SbFileOpen(name, 0, &f);
  if (!f || depth > 16) {
    if (f)
      (void)fclose(f);
    return PETSC_FALSE;
  }
  if (yaml && getdelim(&line, &room, 0, f) > 0) {
    const char *inner = NULL;
    PetscBool given = PETSC_FALSE;

    (void)PetscOptionsInsertStringYAML(database, line);
    (void)PetscOptionsFindPair(database, NULL, "-options_file", &inner, &given);
    if (given && inner) {
      SbFormat(sizeof(name), name, "%s", inner);
      good = insert_file(database, name, depth + 1);
    }
  }
  for (; good && !yaml && getline(&line, &room, f) >= 0;) {
    char *rest;
    char *word, *value, *more;
    char text[PETSC_MAX_PATH_LEN];

    line[strcspn(line, "#")] = 0;
    word = strtok_r(line, blanks, &rest);
    value = word ? strtok_r(NULL, blanks, &rest) : NULL;
    more = value ? strtok_r(NULL, blanks, &rest) : NULL;
    if (!word)
      continue;
    if (!strcasecmp(word, "alias") && more)
      (void)PetscOptionsSetAlias(database, value, more);
    if (word[0] != '-')
      continue;
    if (!strcasecmp(word, "-options_file") || !strcasecmp(word, "-options_file_yaml")) {
      SbFormat(sizeof(text), text, "%s%s", value ? value : "",
               word[strlen("-options_file")] ? ":yaml" : "");
      good = insert_file(database, text, depth + 1);
    } else {
      SbFormat(sizeof(text), text, "%s %s", word, value ? value : "");
      (void)PetscOptionsInsertString(database, text);
    }
  }
  free(line);
  (void)fclose(f);
  return good;
}

void SbOptionsRefused(const char *file, size_t size, char why[])
{
  PetscOptions database = NULL;
  PetscErrorCode ierr;
  PetscInt n = 0;
  char **names, **values;

  why[0] = 0;

  /* what PETSc cannot parse is an error of PetscInitialize() */
  (void)PetscPushErrorHandler(PetscReturnErrorHandler, NULL);

  /* the parser looks into the default database, which exists from the first value on */
  (void)PetscOptionsSetValue(NULL, "-skip_petscrc", NULL);
  (void)PetscOptionsClearValue(NULL, "-skip_petscrc");
  ierr = PetscOptionsCreate(&database);
  if (!ierr && !insert_file(database, file, 0))
    SbFormat(size, why,
             "it has -options_file with a file that cannot be read, or that names itself");
  if (!ierr)
    ierr = PetscOptionsLeftGet(database, &n, &names, &values);
  if (!ierr) {
    for (PetscInt i = 0; i < n && !why[0]; i++)
      if (SbHasPrefix(names[i], refused) || is_python(names[i]))
        SbFormat(size, why,
                 "it has -%s, which can only stand on the command line, as it makes PETSc load "
                 "libraries, run programs or open connections",
                 names[i]);
    (void)PetscOptionsLeftRestore(database, &n, &names, &values);
  }
  (void)PetscOptionsDestroy(&database);
  (void)PetscPopErrorHandler();
}

/* The user's value of an option as remembered: the command line may have replaced another one. */
static PetscBool counts(const char *name, const char *value)
{
  for (PetscInt i = 0; i < SbTheOptions.nuser; i++) {
    const SbOptionUser *user = &SbTheOptions.user[i];

    if (!strcasecmp(user->name, name))
      return (PetscBool)!strcmp(user->value ? user->value : "", value ? value : "");
  }
  return PETSC_FALSE;
}

PetscErrorCode SbOptionsEnvironment(size_t size, char text[])
{
  static const char *const variables[] = {"PETSC_OPTIONS", "PETSC_OPTIONS_YAML"};

  PetscFunctionBeginUser;
  text[0] = 0;
  for (int k = 0; k < 2; k++) {
    const char *given = getenv(variables[k]);
    PetscOptions database;
    PetscInt n;
    char **names, **values;

    if (!given || !given[0])
      continue;
    PetscCall(PetscOptionsCreate(&database));
    if (k)
      PetscCall(PetscOptionsInsertStringYAML(database, given));
    else
      PetscCall(PetscOptionsInsertString(database, given));
    PetscCall(PetscOptionsLeftGet(database, &n, &names, &values));
    for (PetscInt i = 0; i < n; i++)
      if (counts(names[i], values[i]))
        SbAppend(size, text, "%s-%s%s%s", text[0] ? " " : "", names[i], values[i] ? " " : "",
                 values[i] ? values[i] : "");
    PetscCall(PetscOptionsLeftRestore(database, &n, &names, &values));
    PetscCall(PetscOptionsDestroy(&database));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
