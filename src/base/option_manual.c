/*
  option_manual.c - reference manual generated from the table of options: for the terminal (-help
  TOPIC) and, for scripts/manual, as a table (-options_table).

  A topic is a class (body), a type (pressure), the first word of options (solver), or any word in
  their names and help texts.
*/
#include "option.h"

/* Options of a first scenario: [class, type, key]. */
static const char *const first_options[][3] = {
  {"", "", "bodies"},      {"body", "", "mesh"},    {"body", "", "material"}, {"body", "", "young"},
  {"body", "", "poisson"}, {"body", "", "density"}, {"body", "", "element"},  {"", "", "effects"},
  {"effect", "", "type"},  {"effect", "", "on"},    {"", "", "time"},         {"", "", "ts_dt"},
  {"", "", "ts_max_time"}, {"", "", "solver"},      {"", "", "output_dir"},
};

/* What the terminal and the table say of each kind of option. */
static const char *const kinds[][2] = {[SB_OPTION_BOOL] = {"true or false", "bool"},
                                       [SB_OPTION_INT] = {"integer", "int"},
                                       [SB_OPTION_REAL] = {"number", "real"},
                                       [SB_OPTION_REALS] = {"number", "real"},
                                       [SB_OPTION_STRING] = {"text", "text"},
                                       [SB_OPTION_NAMES] = {"comma-separated names", "names"},
                                       [SB_OPTION_CHOICE] = {"one of", "choice"},
                                       [SB_OPTION_FORMULA] = {"formula", "formula"}};

static void full_name(const SbOptionRow *r, char name[SB_OPTION_NAME_MAX])
{
  SbFormat(SB_OPTION_NAME_MAX, name, r->klass[0] ? "-%s_<name>_%s" : "-%s%s", r->klass,
           r->row->key);
}

static PetscErrorCode help_row(PetscViewer viewer, const SbOptionRow *r)
{
  const SbOption *row = r->row;
  char name[SB_OPTION_NAME_MAX];
  char number[16] = "";
  const char *between = "";

  PetscFunctionBeginUser;
  full_name(r, name);

  // description of the value: "3 numbers", "euler_implicit|newmark"
  if (row->count > 1)
    PetscCall(PetscSNPrintf(number, sizeof(number), "%" PetscInt_FMT " ", row->count));
  if (row->kind == SB_OPTION_REALS)
    between = "comma-separated ";
  else if (row->count > 1)
    between = "semicolon-separated ";
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %s: %s%s%s%s", name, number, between,
                                   kinds[row->kind][0], row->count > 1 ? "s" : ""));
  if (row->range[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s", strchr("[(", row->range[0]) ? " in" : "",
                                     row->range));
  if (row->unit[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, " %s", row->unit));
  if (!row->preset)
    PetscCall(PetscViewerASCIIPrintf(viewer, ", required"));
  else if (row->preset[0])
    PetscCall(PetscViewerASCIIPrintf(viewer, ", default %s", row->preset));
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n      %s\n", row->help));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prints the options from relevance `least` on, with a headline for each class and type; n: their
   number. */
static PetscErrorCode print_options(PetscViewer viewer, const char *topic, int least, PetscInt *n)
{
  const size_t length = strlen(topic);
  const SbOptionRow *last = NULL;

  PetscFunctionBeginUser;
  *n = 0;
  for (const SbOptionRow *r = SbTheOptions.row; r < SbTheOptions.row + SbTheOptions.nrow; r++) {
    const SbOption *row = r->row;
    char name[SB_OPTION_NAME_MAX];
    int relevance = 0;

    // relevance of the option to the topic: 3: class or type, 2: first word, 1: a word in name or
    // text
    full_name(r, name);
    if (!strcasecmp(r->klass[0] ? r->klass : "run", topic) || !strcasecmp(r->type, topic))
      relevance = 3;
    else if (!r->klass[0] && !strncasecmp(row->key, topic, length) &&
             (!row->key[length] || row->key[length] == '_'))
      relevance = 2;
    else if (strcasestr(name, topic) || strcasestr(row->help, topic) ||
             strcasestr(row->range, topic))
      relevance = 1;
    if (relevance < least)
      continue;

    // headline of a section: "The run", "Every body", "body: corotated"
    if (!last || strcmp(r->klass, last->klass) || strcmp(r->type, last->type)) {
      const char *first = "";

      if (!r->klass[0])
        first = "The run";
      else if (!r->type[0])
        first = "Every ";
      PetscCall(PetscViewerASCIIPrintf(viewer, "\n%s%s%s%s\n", first, r->klass,
                                       r->type[0] ? ": " : "", r->type));
    }
    PetscCall(help_row(viewer, r));
    last = r;
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsHelp(MPI_Comm comm, const char *topic)
{
  const PetscBool all = (PetscBool)!strcasecmp(topic, "all");
  const SbOptionRow *rows = SbTheOptions.row;
  const SbOptionRow *end = rows + SbTheOptions.nrow;
  PetscViewer viewer;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(comm, "", &viewer));

  // usage, options of a first scenario, and further help
  if (!topic[0] || all) {
    char word[SB_NAME_MAX];
    char words[1024] = " ";

    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "supple %s - soft bodies by finite elements on PETSc\n\n"
                                     "  supple SCENARIO.opts [-option value ...]\n"
                                     "  mpirun -n 4 supple SCENARIO.yml [-option value ...]\n"
                                     "  supple -help [TOPIC]\n\nSI units. The last value given "
                                     "wins. Scenarios to start from: scenarios/\n\n"
                                     "A first scene\n",
                                     SB_VERSION));
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(first_options); k++) {
      const char *const *o = first_options[k];

      for (const SbOptionRow *r = rows; r < end; r++)
        if (!strcmp(r->klass, o[0]) && !strcmp(r->type, o[1]) && !strcmp(r->row->key, o[2]))
          PetscCall(help_row(viewer, r));
    }

    // topics with options: classes, their types, and first words that several options of the run
    // share
    PetscCall(PetscViewerASCIIPrintf(viewer, "\nTopics of -help\n"));
    for (const SbOptionRow *r = rows; r < end; r++) {
      if (r->klass[0])
        continue;
      PetscCall(
        PetscSNPrintf(word, sizeof(word), " %.*s ", (int)strcspn(r->row->key, "_"), r->row->key));
      if (!strstr(words, word))
        PetscCall(PetscStrlcat(words, word + 1, sizeof(words)));
    }
    PetscCall(PetscViewerASCIIPrintf(viewer, "  of the run:%s", words));
    for (const SbOptionRow *r = rows; r < end; r++) {
      const PetscBool same = (PetscBool)(r > rows && !strcmp(r->klass, r[-1].klass));

      if (!same && r->klass[0])
        PetscCall(PetscViewerASCIIPrintf(viewer, "\n  %s", r->klass));
      if (r->type[0] && (!same || strcmp(r->type, r[-1].type)))
        PetscCall(
          PetscViewerASCIIPrintf(viewer, "%s %s", same && r[-1].type[0] ? "" : ":", r->type));
    }
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "\n  any other word: the options whose name or text contains it\n"
              "  all: everything; petsc: a run that lists PETSc's own options\n"));
  }
  if (all)
    PetscCall(print_options(viewer, "", 0, &n));

  /* only the options of highest relevance */
  for (int least = 3; topic[0] && !n && least > 0; least--)
    PetscCall(print_options(viewer, topic, least, &n));
  PetscCall(SbViewerClose(comm, "", &viewer));
  PetscCheck(n || !topic[0], comm, PETSC_ERR_USER,
             "-help %s: no option has this word in its name or text; supple -help lists the topics",
             topic);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsTable(MPI_Comm comm, const char *file)
{
  PetscViewer viewer;
  char name[SB_OPTION_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(comm, file, &viewer));
  PetscCall(PetscViewerASCIIPrintf(
    viewer, "class\ttype\toption\tkind\tcount\tunit\trequired\tdefault\trange\tmeaning\n"));
  for (const SbOptionRow *r = SbTheOptions.row; r < SbTheOptions.row + SbTheOptions.nrow; r++) {
    const SbOption *o = r->row;

    full_name(r, name);
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "%s\t%s\t%s\t%s\t%" PetscInt_FMT "\t%s\t%s\t%s\t%s\t%s\n", r->klass, r->type, name,
      kinds[o->kind][1], o->count, o->unit, o->preset ? "no" : "yes", o->preset ? o->preset : "",
      o->range, o->help));
  }
  PetscCall(SbViewerClose(comm, file, &viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}
