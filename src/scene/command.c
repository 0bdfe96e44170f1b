/*
  command.c - the command line: options of the program itself, and errors that PETSc would ignore.

  PETSc takes the word after an option as its value and ignores every other word; so `-translate 0,
  0, 1` would become `-translate 0,`. Such words are an error here. PETSc reads option files on rank
  0 while the other ranks wait: missing files are found before, and those with options that no file
  may give (base/option_source.c).
*/
#include "scene_impl.h"

const SbOption SbCommandRows[] = {
  {"error_trace", SB_OPTION_BOOL, 1, "", "false", "",
   "print the stack of calls with every error, also of the input"},
  {"help", SB_OPTION_BOOL, 1, "", "false", "",
   "print usage and topics, or the options of a topic, and end; -help all: every option; -help "
   "petsc runs "
   "and lists PETSc's own"},
  {"version", SB_OPTION_BOOL, 1, "", "false", "",
   "print version, commit and compiler flags of supple and the version of PETSc, and end"},
  {"options_file", SB_OPTION_STRING, 1, "", "", "",
   "the scenario, .opts or .yml; its name can also be the first word of the command line"},
  {"scenario_view", SB_OPTION_STRING, 1, "", "", "",
   "check the scenario, write it with every default filled in to this file (without one: standard "
   "output), "
   "and end"},
  {"options_table", SB_OPTION_STRING, 1, "", "", "",
   "write the table of options as tab-separated text, one option per line, to this file (without "
   "one: "
   "standard output), and end"},
  {0},
};

/* Whether a word is this option, with one dash or two. */
static PetscBool is_option(const char *word, const char *key)
{
  return (PetscBool)!strcasecmp(word + 1 + (word[1] == '-'), key);
}

/* Whether rank 0 can read an option file, which is then recorded; else sets command->problem.
   Collective. */
static PetscBool readable(MPI_Comm comm, const char *file, SbCommand *command)
{
  char why[3 * SB_NAME_MAX + 192] = "";
  PetscMPIInt rank;

  (void)MPI_Comm_rank(comm, &rank);
  if (!rank) {
    FILE *f;
    const char *reason = SbFileOpen(file, 0, &f);

    if (f)
      (void)fclose(f);
    if (reason)
      SbFormat(sizeof(why), why, "%s", reason);
    else
      SbOptionsRefused(file, sizeof(why), why);
  }
  (void)MPI_Bcast(why, sizeof(why), MPI_CHAR, 0, comm);
  if (!why[0]) {
    if (command->nfile < (PetscInt)PETSC_STATIC_ARRAY_LENGTH(command->file))
      command->file[command->nfile++] = file;
    return PETSC_TRUE;
  }
  if (!command->problem[0])
    (void)snprintf(command->problem, sizeof(command->problem), "cannot read the option file %s: %s",
                   file, why);
  return PETSC_FALSE;
}

/* Handles one option with its value (NULL: none); returns whether it remains on the command
   line. */
static PetscBool take_option(MPI_Comm comm, const char *name, const char *value, SbCommand *command)
{
  if (is_option(name, "help") || !strcmp(name, "-h")) {
    if (value && !strcasecmp(value, "petsc"))
      return PETSC_TRUE;
    command->help = value ? value : "";
  } else if (is_option(name, "scenario_view")) {
    command->view = value ? value : "";
  } else if (is_option(name, "options_table")) {
    command->table = value ? value : "-";
  } else if (is_option(name, "version")) {
    command->version = PETSC_TRUE;
  } else if (value &&
             (!strcasecmp(name, "-options_file") || !strcasecmp(name, "-options_file_yaml"))) {
    SbErrorSetFile(value);
    return readable(comm, value, command);
  } else {
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscErrorCode SbCommandLine(MPI_Comm comm, int *argc, char *argv[], SbCommand *command)
{
  int kept = 1;

  PetscFunctionBeginUser;
  memset(command, 0, sizeof(*command));
  for (int i = 1; i < *argc;) {
    PetscBool option;
    PetscBool next_is_option = PETSC_TRUE;
    int words;

    PetscCall(PetscOptionsValidKey(argv[i], &option));
    if (i + 1 < *argc)
      PetscCall(PetscOptionsValidKey(argv[i + 1], &next_is_option));
    words = option && !next_is_option ? 2 : 1;
    if (option) {
      const PetscBool stays = take_option(comm, argv[i], words == 2 ? argv[i + 1] : NULL, command);

      if (stays)
        argv[kept++] = argv[i];
      if (stays && words == 2 && !is_option(argv[i], "help"))
        argv[kept++] = argv[i + 1];
    } else if (i == 1) {
      argv[kept++] = argv[1];
      SbErrorSetFile(argv[1]);
      if (readable(comm, argv[1], command))
        command->scenario = argv[1];
    } else if (!command->problem[0]) {
      (void)snprintf(
        command->problem, sizeof(command->problem),
        strpbrk(argv[i], "./")
          ? "the word '%s' in the command line belongs to no option: a run has one option file, "
            "the first word; more come by -options_file"
          : "the word '%s' in the command line belongs to no option (an option begins with a "
            "dash, -%s; a value with blanks needs quotes)",
        argv[i], argv[i]);
    }
    i += words;
  }
  argv[kept] = NULL;
  *argc = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}
