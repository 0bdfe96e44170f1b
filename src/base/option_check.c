/*
  option_check.c - checks options that have not been read: misspelt ones of supple, ones that do not
  apply to this run, and unused ones of PETSc.

  PETSc cannot tell a misspelt option from one that an object created later would read, so it
  reports nothing; here a misspelling of one of its most common options is an error. All options of
  supple are read before the computation starts. A name belongs to supple if it begins with the
  prefix of one of its classes or the first word of a program-wide key, or is a key or within two
  edits of one, without a prefix of PETSc.

  A misspelt option ends the run; a valid but unused one causes a warning with the reason: it is for
  another integrator, type or effect. An option of an unread instance is valid if a list in the
  scenario file has that instance and the class has the key: then the command line has removed it
  from the list. An instance that is in no list is an error.
*/
#include "option.h"

/* Prefixes of PETSc's options that occur in runs of supple. */
static PetscBool looks_like_petsc(const char *name)
{
  return SbHasPrefix(name, "ksp_ pc_ snes_ ts_ mat_ vec_ dm_ is_ sub_ mg_ fieldsplit_ asm_ log_ "
                           "malloc options_ petsc on_error_ "
                           "memory_ fp_trap start_in_debugger stop_for_debugger debugger_ "
                           "citations no_signal_handler info viewer_ "
                           "draw_ display nox saws objects_ checkstack get_total_flops "
                           "skip_petscrc error_output_ shared_tmp "
                           "not_shared_tmp tmp sf_ python blas_ omp_ use_gpu device cuda "
                           "hip event_ help version "
                           "redundant_ est esteig gamg_ hypre ml_ superlu sbaij inner_ coarse_ "
                           "saddle_ telescope_ levels_ prefix_");
}

/* Most common options of PETSc's solvers, and some that differ from them by two letters. */
static const char common[] =
  "-ksp_type -ksp_rtol -ksp_atol -ksp_divtol -ksp_max_it -ksp_min_it -ksp_norm_type -ksp_pc_side "
  "-ksp_monitor -ksp_view -ksp_gmres_restart -ksp_converged_reason -pc_type -pc_side -pc_view "
  "-pc_asm_overlap -pc_asm_type -pc_gasm_overlap -pc_gasm_type -pc_bjacobi_blocks "
  "-pc_factor_mat_solver_type -pc_factor_levels -pc_gamg_type -pc_factor_mat_ordering_type "
  "-pc_hypre_type -pc_jacobi_type -pc_gamg_threshold -pc_mg_levels -pc_mg_type "
  "-pc_gamg_agg_nsmooths "
  "-pc_sor_its -pc_sor_lits -pc_factor_shift_type -snes_type -snes_rtol -snes_atol -snes_stol "
  "-snes_max_it -snes_max_funcs -snes_monitor -snes_view -snes_converged_reason -snes_ksp_ew "
  "-snes_lag_jacobian -snes_linesearch_type";

/* Suggestion for a name unlike any option: a key without its prefix, as -young; the end of a
   program-wide key, as -history_every; its first word as -solver_type or -time_budget
   (-contact_ksp_type is PETSc's). "" if it is not of supple. */
static void guess(const char *name, size_t size, char text[])
{
  const size_t n = strcspn(name, "_"); /* length of its first word, perhaps the whole name */
  const PetscBool more =
    (PetscBool)(!looks_like_petsc(name) &&
                (!name[n] || (name[n + 1] && !looks_like_petsc(name + n + 1))));

  text[0] = 0;
  for (PetscInt i = 0; i < SbTheOptions.nrow && !text[0]; i++) {
    const char *key = SbTheOptions.row[i].row->key;
    const char *klass = SbTheOptions.row[i].klass;
    const size_t length = strlen(key);
    const size_t end = length > strlen(name) + 1 ? length - strlen(name) : 0;
    const PetscBool begins = (PetscBool)!strncasecmp(key, name, n);
    const PetscBool ends = (PetscBool)(end && key[end - 1] == '_' && !strcasecmp(key + end, name));

    if (klass[0]) {
      if (!strcasecmp(key, name))
        SbFormat(size, text, "; did you mean -%s_NAME_%s?", klass, key);
    } else if (more) {
      if ((begins && length == n) || ends)
        SbFormat(size, text, "; did you mean -%s?", key);
      else if (begins && key[n] == '_')
        SbFormat(size, text, "; -help all lists them");
    }
  }
}

/* Class whose prefix the name has; NULL if there is none. */
static const char *class_of(const char *name)
{
  for (PetscInt i = 0; i < SbTheOptions.nrow; i++) {
    const char *klass = SbTheOptions.row[i].klass;
    const size_t n = strlen(klass);

    if (n && !strncasecmp(name, klass, n) && name[n] == '_')
      return klass;
  }
  return NULL;
}

/* Length of the instance in a name, "liver" in "body_liver_young": the longest known one; 0: none.
   read: options of it have been read, else it is only in a list of a file. */
static size_t instance_of(const char *klass, const char *name, PetscBool *read)
{
  const char *at = name + strlen(klass) + 1;
  size_t best = 0;

  *read = PETSC_FALSE;
  for (PetscInt i = 0; i < SbTheOptions.nrecord + SbTheOptions.nlisted; i++) {
    const PetscBool is_read = (PetscBool)(i < SbTheOptions.nrecord);
    const SbOptionRecord *r = &SbTheOptions.record[i];
    const char *instance =
      is_read ? r->scope.instance : SbTheOptions.listed[i - SbTheOptions.nrecord];
    const size_t n = strlen(instance);

    if (is_read && strcmp(r->scope.klass, klass))
      continue;
    if (n <= best || strncasecmp(at, instance, n) || at[n] != '_')
      continue;
    best = n;
    *read = is_read;
  }
  return best;
}

/* Classification of an unread option. */
typedef enum {
  NOT_OURS,
  UNUSED,   /* valid, for another type or setting: `text` is the reason */
  LEFT_OUT, /* valid, of an instance that only a scenario file names: `text` is "effect floor" */
  WRONG     /* invalid: `text` is the message */
} Verdict;

/* Classifies an option with the prefix of a class: valid if some type of the class has its key. */
static Verdict verdict_of_class(const char *klass, const char *name, size_t size, char text[])
{
  const char *instance = name + strlen(klass) + 1;
  const char *key;
  PetscBool read;
  const size_t n = instance_of(klass, name, &read);
  PetscInt ntype = 0;
  char types[512] = "";
  Verdict verdict = WRONG;

  // option for all bodies: "default_young"
  if (!strcmp(klass, "body") &&
      !strncasecmp(instance, SB_OPTION_DEFAULT "_", strlen(SB_OPTION_DEFAULT "_"))) {
    key = instance + strlen(SB_OPTION_DEFAULT "_");
    for (PetscInt i = 0; i < SbTheOptions.nrow; i++)
      if (!strcmp(SbTheOptions.row[i].klass, klass) &&
          !strcasecmp(SbTheOptions.row[i].row->key, key))
        verdict = UNUSED;
    SbFormat(size, text, "no body takes it, as each has one of its own or is of another type");
    return verdict;
  }
  if (!n)
    return WRONG;
  key = instance + n + 1;
  for (const SbOptionRow *r = SbTheOptions.row; r < SbTheOptions.row + SbTheOptions.nrow; r++) {
    PetscBool own;

    if (strcmp(r->klass, klass) || strcasecmp(r->row->key, key))
      continue;

    // whether the row is for all types, or for one of which the instance has been read
    own = (PetscBool)!r->type[0];
    for (PetscInt i = 0; i < SbTheOptions.nrecord && !own; i++) {
      const SbScope *s = &SbTheOptions.record[i].scope;

      own = (PetscBool)(!strcmp(s->klass, klass) && !strcmp(s->type, r->type) &&
                        strlen(s->instance) == n && !strncasecmp(s->instance, instance, n));
    }
    verdict = read ? UNUSED : LEFT_OUT;
    if (!read)
      SbFormat(size, text, "%s %.*s", klass, (int)n, instance);
    else if (own)
      SbFormat(size, text, "%s", r->row->help);
    if (own || !read)
      return verdict;
    SbAppend(sizeof(types), types, "%s%s", ntype++ ? ", " : "", r->type);
  }
  if (ntype)
    SbFormat(size, text, "it is for type%s %s, and the %s %.*s has another one",
             ntype > 1 ? "s" : "", types, klass, (int)n, instance);
  return verdict;
}

static PetscErrorCode find_verdict(const char *name, size_t size, char text[], Verdict *verdict)
{
  char near[3 * SB_OPTION_NAME_MAX] = "";
  char dashed[SB_OPTION_NAME_MAX];
  char why[1024] = "";
  const char *klass = class_of(name);
  const SbOption *row = SbOptionFind(&SbRunScope, name);
  PetscInt n = 0;
  PetscInt room = SbTheOptions.nrecord;
  const char **list;
  char(*names)[SB_OPTION_NAME_MAX], **words;
  int ncommon;
  SbScope scope;

  PetscFunctionBeginUser;
  text[0] = 0;
  *verdict = NOT_OURS;
  PetscCall(PetscSNPrintf(dashed, sizeof(dashed), "-%s", name));
  if (row) {
    *verdict = UNUSED;
    PetscCall(PetscStrncpy(text, row->help, size));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!klass && looks_like_petsc(name) &&
      !SbHasPrefix(name, "ts_")) { /* -ts_dt is an option of supple */
    if (SbHasPrefix(name, "ksp_ pc_ snes_")) {
      PetscCall(PetscStrToArray(common, ' ', &ncommon, &words));
      SbSuggestNames(dashed, ncommon, (const char *const *)words, sizeof(near), near);
      PetscCall(PetscStrToArrayDestroy(ncommon, words));
    }
    if (!near[0] || !strcasecmp(near, dashed))
      PetscFunctionReturn(PETSC_SUCCESS);
    *verdict = WRONG;
    PetscCall(
      PetscSNPrintf(text, size, "%s is not an option of PETSc; did you mean %s?", dashed, near));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (klass) {
    *verdict = verdict_of_class(klass, name, size, text);
    if (*verdict != WRONG)
      PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* similar full names: all options read so far, all program-wide options, and those of all
     instances named in scenario files and of `default` for all bodies; `near` is "" if there is
     none */
  room += SbTheOptions.nrow * (SbTheOptions.nlisted + 1);
  PetscCall(PetscMalloc2(room, &list, room, &names));
  for (PetscInt i = 0; i < SbTheOptions.nrecord; i++)
    list[n++] = SbTheOptions.record[i].name;
  for (PetscInt i = 0; i < SbTheOptions.nrow; i++) {
    const SbOptionRow *r = &SbTheOptions.row[i];
    const PetscInt instances = r->klass[0] ? SbTheOptions.nlisted + !strcmp(r->klass, "body") : 1;

    for (PetscInt j = 0; j < instances; j++) {
      const char *instance = j < SbTheOptions.nlisted ? SbTheOptions.listed[j] : SB_OPTION_DEFAULT;

      SbScopeSet(&scope, r->klass, "", instance);
      SbOptionName(&scope, r->row->key, sizeof(*names), names[n]);
      list[n] = names[n];
      n++;
    }
  }
  SbSuggestNames(dashed, n, list, sizeof(near), near);
  PetscCall(PetscFree2(list, names));
  if (!klass && !near[0])
    guess(name, sizeof(why), why);
  if (!klass && !near[0] && !why[0])
    PetscFunctionReturn(PETSC_SUCCESS);
  *verdict = WRONG;
  if (near[0])
    PetscCall(PetscSNPrintf(why, sizeof(why), "; did you mean %s?", near));
  else if (klass) {
    /* reason for an unread option with the prefix of a class, without a similar name */
    char keys[768] = "";
    char instances[256] = "";
    const char *at = name + strlen(klass) + 1;
    const char *last = NULL;

    /* keys read for the instance of the name: "body liver has mesh, young"; instances of the class
       that have been read: "liver, stone"; "" if there are none */
    for (PetscInt i = 0; i < SbTheOptions.nrecord; i++) {
      const SbOptionRecord *r = &SbTheOptions.record[i];
      const char *instance = r->scope.instance;
      const size_t length = strlen(instance);

      if (strcmp(r->scope.klass, klass))
        continue;
      if (!last || strcmp(last, instance))
        SbAppend(sizeof(instances), instances, "%s%s", last ? ", " : "", instance);
      last = instance;
      if (strncasecmp(at, instance, length) || at[length] != '_')
        continue;
      if (!keys[0])
        SbFormat(sizeof(keys), keys, "%s %s has ", klass, instance);
      SbAppend(sizeof(keys), keys, "%s%s", keys[strlen(keys) - 1] == ' ' ? "" : ", ", r->row->key);
    }
    if (keys[0])
      SbFormat(sizeof(why), why, " here; %s", keys);
    else
      SbFormat(sizeof(why), why, ": it names no %s of this scenario (%s)", klass,
               instances[0] ? instances : "there are none");
  }
  PetscCall(PetscSNPrintf(text, size, "%s is not an option of supple%s", dashed, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionMissing(const SbOptionRecord *r)
{
  const SbOption *row = r->row;
  const size_t before = strlen(r->name) - strlen(row->key) - 1; /* length of "body_liver_" */
  PetscInt nleft;
  PetscInt n = 0;
  char **names, near[SB_OPTION_NAME_MAX];
  const char **list;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsLeftGet(NULL, &nleft, &names, NULL));
  PetscCall(PetscMalloc1(nleft, &list));

  // unread names of the same instance that are not valid options
  for (PetscInt i = 0; i < nleft; i++) {
    const char *key;

    if (strncasecmp(names[i], r->name + 1, before))
      continue;
    key = names[i] + before;
    if (before ? !SbOptionFind(&r->scope, key)
               : !class_of(key) && !looks_like_petsc(key) && !SbOptionFind(&SbRunScope, key))
      list[n++] = names[i];
  }
  SbSuggestNames(r->name + 1, n, list, sizeof(near), near);
  PetscCall(PetscFree(list));
  PetscCall(PetscOptionsLeftRestore(NULL, &nleft, &names, NULL));
  PetscCheck(!near[0], PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s is not an option of supple; did you mean %s?", near, r->name);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s must be given: %s%s%s%s%s", r->name, row->help,
          row->range[0] ? ", in " : "", row->range, row->unit[0] ? ", unit " : "", row->unit);
}

PetscErrorCode SbOptionsCheck(void)
{
  PetscInt nleft;
  PetscInt nbad = 0;
  char **names, first[1024] = "", more[64] = "", (*text)[1024];
  Verdict *verdict;

  PetscFunctionBeginUser;
  PetscCall(SbOptionsCheckPetsc());
  PetscCall(PetscOptionsLeftGet(NULL, &nleft, &names, NULL));
  PetscCall(PetscMalloc2(nleft, &verdict, nleft, &text));
  for (PetscInt i = 0; i < nleft; i++) {
    PetscCall(find_verdict(names[i], sizeof(*text), text[i], &verdict[i]));
    if (verdict[i] == WRONG && !nbad++)
      PetscCall(PetscStrncpy(first, text[i], sizeof(first)));
  }

  /* if there is no error: warnings of valid unused options; those of one excluded instance in one
     line */
  for (PetscInt i = 0; i < nleft && !nbad; i++) {
    PetscInt others = 0;

    if (verdict[i] == UNUSED)
      PetscCall(SbWarning(PETSC_COMM_WORLD, "-%s is unused in this run: %s", names[i], text[i]));
    if (verdict[i] != LEFT_OUT)
      continue;
    for (PetscInt j = i + 1; j < nleft; j++) {
      if (verdict[j] != LEFT_OUT || strcmp(text[i], text[j]))
        continue;
      verdict[j] = NOT_OURS;
      others++;
    }
    if (others)
      PetscCall(PetscSNPrintf(more, sizeof(more), " and %" PetscInt_FMT " more of it are", others));
    PetscCall(
      SbWarning(PETSC_COMM_WORLD,
                "-%s%s unused in this run: the scenario file names the %s, this run does not",
                names[i], others ? more : " is", text[i]));
  }
  PetscCall(PetscFree2(verdict, text));
  PetscCall(PetscOptionsLeftRestore(NULL, &nleft, &names, NULL));
  if (nbad > 1)
    PetscCall(PetscSNPrintf(more, sizeof(more), " (and %" PetscInt_FMT " more like it)", nbad - 1));
  PetscCheck(!nbad, PETSC_COMM_SELF, PETSC_ERR_USER, "%s%s", first, more);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionsUnused(MPI_Comm comm, PetscInt *n)
{
  PetscInt nleft;
  char **names, **values;

  PetscFunctionBeginUser;
  *n = 0; /* SbOptionsCheck() has warned of options of supple */
  PetscCall(PetscOptionsLeftGet(NULL, &nleft, &names, &values));
  for (PetscInt i = 0; i < nleft; i++) {
    PetscBool users = (PetscBool)!SbTheOptions.remembered;

    for (PetscInt j = 0; j < SbTheOptions.nuser && !users; j++)
      users = (PetscBool)!strcasecmp(SbTheOptions.user[j].name, names[i]);
    if (!users ||
        SbHasPrefix(names[i],
                    "citations get_total_flops log_ malloc_ memory_view mpidump no_signal_handler "
                    "nox objects_dump options_left options_view saw_options x_virtual") ||
        class_of(names[i]) || SbOptionFind(&SbRunScope, names[i]))
      continue;
    PetscCall(SbWarning(comm, "nobody read the option -%s%s%s", names[i], values[i] ? " " : "",
                        values[i] ? values[i] : ""));
    (*n)++;
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &nleft, &names, &values));
  PetscFunctionReturn(PETSC_SUCCESS);
}
