/*
  option_manual.c - reference manual generated from the table of options: for the terminal (-help TOPIC) and, for scripts/manual, as a table (-options_table).

  Sections are ordered by class, the run and the bodies first: options of all instances of the class, then those of each type. A topic is a class (body), a
  type (pressure), the first word of options (solver), or any word in their names and help texts.
*/
#include "option.h"

#define USAGE                                    \
  "  supple SCENARIO.opts [-option value ...]\n" \
  "  mpirun -n 4 supple SCENARIO.yml [-option value ...]\n"

/* Options of a first scenario: [class, type, key]. */
static const char *const first_options[][3] = {
  {"", "", "bodies"},      {"body", "", "mesh"},    {"body", "", "material"}, {"body", "", "young"},
  {"body", "", "poisson"}, {"body", "", "density"}, {"body", "", "element"},  {"", "", "effects"},
  {"effect", "", "type"},  {"effect", "", "on"},    {"", "", "time"},         {"", "", "ts_dt"},
  {"", "", "ts_max_time"}, {"", "", "solver"},      {"", "", "output_dir"},
};

static PetscErrorCode help_row(PetscViewer viewer, const SbOptionBlock *block, const SbOption *row)
{
  char name[SB_OPTION_NAME_MAX], value[64], number[16] = "";
  static const char *const kinds[] = {
    [SB_OPTION_BOOL] = "true or false", [SB_OPTION_INT] = "integer",
    [SB_OPTION_REAL] = "number",        [SB_OPTION_REALS] = "number",
    [SB_OPTION_STRING] = "text",        [SB_OPTION_NAMES] = "comma-separated names",
    [SB_OPTION_CHOICE] = "one of",      [SB_OPTION_FORMULA] = "formula"};
  const char *with;

  PetscFunctionBeginUser;
  PetscCall(SbOptionManualName(block, row, sizeof(name), name));
  // description of the value: "3 numbers", "euler_implicit|newmark"
  with = row->kind == SB_OPTION_REALS ? "comma-separated " : row->count > 1 ? "semicolon-separated " : "";
  if (row->count > 1) PetscCall(PetscSNPrintf(number, sizeof(number), "%" PetscInt_FMT " ", row->count));
  PetscCall(PetscSNPrintf(value, sizeof(value), "%s%s%s%s", number, with, kinds[row->kind],
                          row->count > 1 ? "s" : ""));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %s: %s", name, value));
  if (row->range[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s", strchr("[(", row->range[0]) ? " in" : "", row->range));
  if (row->unit[0]) PetscCall(PetscViewerASCIIPrintf(viewer, " %s", row->unit));
  if (!row->preset)
    PetscCall(PetscViewerASCIIPrintf(viewer, ", required"));
  else if (row->preset[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, ", default %s", row->preset));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n      %s\n", row->help));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Relevance of an option to a topic: 3: its class or type, 2: its first word, 1: a word in its name or text, 0: none. */
static PetscErrorCode answers(const SbOptionBlock *block, const SbOption *row, const char *topic, int *how)
{
  const size_t n = strlen(topic);
  char name[SB_OPTION_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbOptionManualName(block, row, sizeof(name), name));
  *how = 0;
  if (!strcasecmp(block->klass[0] ? block->klass : "run", topic) || !strcasecmp(block->type, topic))
    *how = 3;
  else if (!block->klass[0] && !strncasecmp(row->key, topic, n) && (!row->key[n] || row->key[n] == '_'))
    *how = 2;
  else if (strcasestr(name, topic) || strcasestr(row->help, topic) || strcasestr(row->range, topic))
    *how = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints the options of a class and type with at least the relevance `least`, under one headline; adds their number to *n. */
static PetscErrorCode print_type(PetscViewer viewer, const SbOptionBlock *first, const char *topic, int least,
                                 PetscBool table, PetscInt *n)
{
  PetscInt printed = 0;
  int how = 0;

  PetscFunctionBeginUser;
  for (const SbOptionBlock *b = first; b < SbTheOptions.block + SbTheOptions.nblock; b++) {
    if (strcmp(b->klass, first->klass) || strcmp(b->type, first->type)) continue;
    for (PetscInt i = 0; i < b->n; i++) {
      PetscCall(answers(b, &b->rows[i], topic, &how));
      if (how < least) continue;
      // headline of a section: "The run", "Every body", "body: corotated"
      if (!printed++ && !table) {
        if (!first->klass[0])
          PetscCall(PetscViewerASCIIPrintf(viewer, "\nThe run\n"));
        else if (!first->type[0])
          PetscCall(PetscViewerASCIIPrintf(viewer, "\nEvery %s\n", first->klass));
        else
          PetscCall(PetscViewerASCIIPrintf(viewer, "\n%s: %s\n", first->klass, first->type));
      }
      // one line of the table for scripts; its columns are those of SbOptionsTable()
      if (table) {
        static const char *const kinds[] = {
          [SB_OPTION_BOOL] = "bool",     [SB_OPTION_INT] = "int",        [SB_OPTION_REAL] = "real",
          [SB_OPTION_REALS] = "real",    [SB_OPTION_STRING] = "text",    [SB_OPTION_NAMES] = "names",
          [SB_OPTION_CHOICE] = "choice", [SB_OPTION_FORMULA] = "formula"};
        char name[SB_OPTION_NAME_MAX];

        PetscCall(SbOptionManualName(b, &b->rows[i], sizeof(name), name));
        PetscCall(PetscViewerASCIIPrintf(
          viewer, "%s\t%s\t%s\t%s\t%" PetscInt_FMT "\t%s\t%s\t%s\t%s\t%s\n", b->klass, b->type, name,
          kinds[b->rows[i].kind], b->rows[i].count, b->rows[i].unit, b->rows[i].preset ? "no" : "yes",
          b->rows[i].preset ? b->rows[i].preset : "", b->rows[i].range, b->rows[i].help));
      } else
        PetscCall(help_row(viewer, b, &b->rows[i]));
    }
  }
  *n += printed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool is_first(PetscInt i, PetscBool by_type)
{
  const SbOptionBlock *a = &SbTheOptions.block[i];

  for (const SbOptionBlock *b = SbTheOptions.block; b < a; b++)
    if (!strcmp(a->klass, b->klass) && (!by_type || !strcmp(a->type, b->type))) return PETSC_FALSE;
  return PETSC_TRUE;
}

/* Prints all options with at least the relevance `least`; n: their number. */
static PetscErrorCode print_manual(PetscViewer viewer, const char *topic, int least, PetscBool table,
                                   PetscInt *n)
{
  static const char *const order[] = {"", "body", "effect"}; /* then as registered */
  const PetscInt nordered = PETSC_STATIC_ARRAY_LENGTH(order);

  PetscFunctionBeginUser;
  *n = 0;
  for (PetscInt i = -nordered; i < SbTheOptions.nblock; i++) {
    const char *klass = i < 0 ? order[i + nordered] : SbTheOptions.block[i].klass;
    PetscBool seen = PETSC_FALSE;

    for (PetscInt k = 0; i >= 0 && k < nordered; k++) seen = (PetscBool)(seen || !strcmp(order[k], klass));
    if (seen || (i >= 0 && !is_first(i, PETSC_FALSE))) continue;
    /* options of all instances first, then those of each type */
    for (int typed = 0; typed < 2; typed++) {
      for (PetscInt j = 0; j < SbTheOptions.nblock; j++) {
        const SbOptionBlock *b = &SbTheOptions.block[j];

        if (!strcmp(b->klass, klass) && (b->type[0] != 0) == typed && b->n && is_first(j, PETSC_TRUE))
          PetscCall(print_type(viewer, b, topic, least, table, n));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsHelp(MPI_Comm comm, const char *topic)
{
  const PetscBool all = (PetscBool)!strcasecmp(topic, "all");
  PetscViewer viewer;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(comm, "", &viewer));
  // usage, options of a first scenario, and further help
  if (!topic[0] || all) {
    char word[SB_NAME_MAX], words[1024] = " ";

    PetscCall(PetscViewerASCIIPrintf(viewer, "supple %s - soft bodies by finite elements on PETSc\n\n%s",
                                     SB_VERSION, USAGE));
    PetscCall(PetscViewerASCIIPrintf(
      viewer,
      "  supple -help [TOPIC]\n\nSI units. The last value given wins. Scenarios to start from: scenarios/\n\n"
      "A first scene\n"));
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(first_options); k++) {
      const char *const *o = first_options[k];

      for (PetscInt i = 0; i < SbTheOptions.nblock; i++) {
        const SbOptionBlock *b = &SbTheOptions.block[i];
        const SbOption *row = NULL;

        if (strcmp(b->klass, o[0]) || strcmp(b->type, o[1])) continue;
        for (PetscInt r = 0; r < b->n && !row; r++) row = strcmp(b->rows[r].key, o[2]) ? NULL : &b->rows[r];
        if (row) PetscCall(help_row(viewer, b, row));
      }
    }
    // topics with options: classes, their types, and first words that several options of the run share
    PetscCall(PetscViewerASCIIPrintf(viewer, "\nTopics of -help\n"));
    for (PetscInt i = 0; i < SbTheOptions.nblock; i++) {
      const SbOptionBlock *b = &SbTheOptions.block[i];

      for (PetscInt k = 0; !b->klass[0] && k < b->n; k++) {
        PetscCall(
          PetscSNPrintf(word, sizeof(word), " %.*s ", (int)strcspn(b->rows[k].key, "_"), b->rows[k].key));
        if (!strstr(words, word)) PetscCall(PetscStrlcat(words, word + 1, sizeof(words)));
      }
    }
    PetscCall(PetscViewerASCIIPrintf(viewer, "  of the run:%s", words));
    for (PetscInt i = 0; i < SbTheOptions.nblock; i++) {
      const SbOptionBlock *b = &SbTheOptions.block[i];
      PetscInt types = 0;

      if (!b->klass[0] || !is_first(i, PETSC_FALSE)) continue;
      PetscCall(PetscViewerASCIIPrintf(viewer, "\n  %s", b->klass));
      for (PetscInt j = i; j < SbTheOptions.nblock; j++) {
        const SbOptionBlock *t = &SbTheOptions.block[j];

        if (!strcmp(t->klass, b->klass) && t->type[0] && is_first(j, PETSC_TRUE))
          PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s", types++ ? "" : ":", t->type));
      }
    }
    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "\n  any other word: the options whose name or text contains it\n"
                                     "  all: everything; petsc: a run that lists PETSc's own options\n"));
  }
  if (all) PetscCall(print_manual(viewer, "", 0, PETSC_FALSE, &n));
  /* only the options of highest relevance */
  for (int least = 3; topic[0] && !n && least > 0; least--)
    PetscCall(print_manual(viewer, topic, least, PETSC_FALSE, &n));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCheck(n || !topic[0], comm, PETSC_ERR_USER,
             "-help %s: no option has this word in its name or text; supple -help lists the topics", topic);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsTable(MPI_Comm comm, const char *file)
{
  PetscViewer viewer;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(comm, file, &viewer));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "class\ttype\toption\tkind\tcount\tunit\trequired\tdefault\trange\tmeaning\n"));
  PetscCall(print_manual(viewer, "", 0, PETSC_TRUE, &n));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
