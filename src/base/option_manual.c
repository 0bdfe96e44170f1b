/*
  option_manual.c - reference manual generated from the table of options: for the terminal (-help TOPIC) and,
  for scripts/manual, as a table (-options_table).

  Sections are ordered by class, the run and the bodies first: options of all instances of the class, then
  those of each type. A topic is a class (body), a type (pressure), the first word of options (solver), or any
  word in their names and help texts.
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

/* What the terminal and the table say of each kind of option. */
static const char *const kinds[][2] = {
  [SB_OPTION_BOOL] = {"true or false", "bool"}, [SB_OPTION_INT] = {"integer", "int"},
  [SB_OPTION_REAL] = {"number", "real"},        [SB_OPTION_REALS] = {"number", "real"},
  [SB_OPTION_STRING] = {"text", "text"},        [SB_OPTION_NAMES] = {"comma-separated names", "names"},
  [SB_OPTION_CHOICE] = {"one of", "choice"},    [SB_OPTION_FORMULA] = {"formula", "formula"}};

static PetscErrorCode help_row(PetscViewer viewer, const SbOptionRow *r)
{
  const SbOption *row = r->row;
  char name[SB_OPTION_NAME_MAX], number[16] = "";

  PetscFunctionBeginUser;
  SbFormat(sizeof(name), name, r->klass[0] ? "-%s_<name>_%s" : "-%s%s", r->klass, row->key);
  // description of the value: "3 numbers", "euler_implicit|newmark"
  if (row->count > 1) PetscCall(PetscSNPrintf(number, sizeof(number), "%" PetscInt_FMT " ", row->count));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %s: %s%s%s%s", name, number,
                                   row->kind == SB_OPTION_REALS ? "comma-separated "
                                   : row->count > 1             ? "semicolon-separated "
                                                                : "",
                                   kinds[row->kind][0], row->count > 1 ? "s" : ""));
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

/* Prints the options of a class and type from relevance `least` on, with a headline; adds their number. */
static PetscErrorCode print_type(PetscViewer viewer, const SbOptionRow *first, const char *topic, int least,
                                 PetscBool table, PetscInt *n)
{
  const size_t length = strlen(topic);
  char name[SB_OPTION_NAME_MAX];
  PetscInt printed = 0;

  PetscFunctionBeginUser;
  for (const SbOptionRow *r = first; r < SbTheOptions.row + SbTheOptions.nrow; r++) {
    const SbOption *row = r->row;
    int relevance = 0;

    if (strcmp(r->klass, first->klass) || strcmp(r->type, first->type)) continue;
    // relevance of the option to the topic: 3: class or type, 2: first word, 1: a word in name or text
    SbFormat(sizeof(name), name, r->klass[0] ? "-%s_<name>_%s" : "-%s%s", r->klass, row->key);
    if (!strcasecmp(r->klass[0] ? r->klass : "run", topic) || !strcasecmp(r->type, topic))
      relevance = 3;
    else if (!r->klass[0] && !strncasecmp(row->key, topic, length) &&
             (!row->key[length] || row->key[length] == '_'))
      relevance = 2;
    else if (strcasestr(name, topic) || strcasestr(row->help, topic) || strcasestr(row->range, topic))
      relevance = 1;
    if (relevance < least) continue;
    // headline of a section: "The run", "Every body", "body: corotated"
    if (!printed++ && !table) {
      if (!r->klass[0])
        PetscCall(PetscViewerASCIIPrintf(viewer, "\nThe run\n"));
      else if (!r->type[0])
        PetscCall(PetscViewerASCIIPrintf(viewer, "\nEvery %s\n", r->klass));
      else
        PetscCall(PetscViewerASCIIPrintf(viewer, "\n%s: %s\n", r->klass, r->type));
    }
    // a line for the terminal, or one of the table for scripts, whose columns are those of SbOptionsTable()
    if (table)
      PetscCall(PetscViewerASCIIPrintf(viewer, "%s\t%s\t%s\t%s\t%" PetscInt_FMT "\t%s\t%s\t%s\t%s\t%s\n",
                                       r->klass, r->type, name, kinds[row->kind][1], row->count, row->unit,
                                       row->preset ? "no" : "yes", row->preset ? row->preset : "", row->range,
                                       row->help));
    else
      PetscCall(help_row(viewer, r));
  }
  *n += printed;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether no row before it is of the same class, or class and type. */
static PetscBool is_first(const SbOptionRow *a, PetscBool by_type)
{
  for (const SbOptionRow *b = SbTheOptions.row; b < a; b++)
    if (!strcmp(a->klass, b->klass) && (!by_type || !strcmp(a->type, b->type))) return PETSC_FALSE;
  return PETSC_TRUE;
}

/* Prints all options with at least the relevance `least`; n: their number. */
static PetscErrorCode print_manual(PetscViewer viewer, const char *topic, int least, PetscBool table,
                                   PetscInt *n)
{
  static const char *const order[] = {"", "body", "effect"}; /* then as registered */
  const PetscInt nordered = PETSC_STATIC_ARRAY_LENGTH(order);
  const SbOptionRow *rows = SbTheOptions.row, *end = rows + SbTheOptions.nrow;

  PetscFunctionBeginUser;
  *n = 0;
  for (PetscInt i = -nordered; i < SbTheOptions.nrow; i++) {
    const char *klass = i < 0 ? order[i + nordered] : rows[i].klass;
    PetscBool seen = (PetscBool)(i >= 0 && !is_first(&rows[i], PETSC_FALSE));

    for (PetscInt k = 0; i >= 0 && k < nordered; k++) seen = (PetscBool)(seen || !strcmp(order[k], klass));
    /* options of all instances first, then those of each type */
    for (int typed = 0; typed < 2 && !seen; typed++)
      for (const SbOptionRow *r = rows; r < end; r++)
        if (!strcmp(r->klass, klass) && (r->type[0] != 0) == typed && is_first(r, PETSC_TRUE))
          PetscCall(print_type(viewer, r, topic, least, table, n));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsHelp(MPI_Comm comm, const char *topic)
{
  const PetscBool all = (PetscBool)!strcasecmp(topic, "all");
  const SbOptionRow *rows = SbTheOptions.row, *end = rows + SbTheOptions.nrow;
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

      for (const SbOptionRow *r = rows; r < end; r++)
        if (!strcmp(r->klass, o[0]) && !strcmp(r->type, o[1]) && !strcmp(r->row->key, o[2]))
          PetscCall(help_row(viewer, r));
    }
    // topics with options: classes, their types, and first words that several options of the run share
    PetscCall(PetscViewerASCIIPrintf(viewer, "\nTopics of -help\n"));
    for (const SbOptionRow *r = rows; r < end; r++) {
      if (r->klass[0]) continue;
      PetscCall(PetscSNPrintf(word, sizeof(word), " %.*s ", (int)strcspn(r->row->key, "_"), r->row->key));
      if (!strstr(words, word)) PetscCall(PetscStrlcat(words, word + 1, sizeof(words)));
    }
    PetscCall(PetscViewerASCIIPrintf(viewer, "  of the run:%s", words));
    for (const SbOptionRow *r = rows; r < end; r++) {
      PetscInt types = 0;

      if (!r->klass[0] || !is_first(r, PETSC_FALSE)) continue;
      PetscCall(PetscViewerASCIIPrintf(viewer, "\n  %s", r->klass));
      for (const SbOptionRow *t = r; t < end; t++)
        if (!strcmp(t->klass, r->klass) && t->type[0] && is_first(t, PETSC_TRUE))
          PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s", types++ ? "" : ":", t->type));
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
