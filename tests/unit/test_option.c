/*
  test_option.c - table of options: readers, ranges, messages, unread options, the printed scenario,
  the manual.
*/
// @ranks 1 3
#include "file.h"
#include "test.h"

/* Its value; NaN where it has none. */
static PetscReal value_at(SbFormula f, PetscReal t, const PetscReal x[3])
{
  PetscReal value = NAN;

  (void)SbFormulaEval(f, t, x, &value);
  return value;
}

static const SbOption body_rows[] = {
  {"mesh", SB_OPTION_STRING, 1, "", NULL, "", "mesh file"},
  {"scale", SB_OPTION_REAL, 1, "", "1", "(0, inf)", "factor on the file's coordinates"},
  {"translate", SB_OPTION_REALS, 3, "m", "0,0,0", "(-inf, inf)", "shift"},
  {"poisson", SB_OPTION_REAL, 1, "", "0.3", "[0, 0.5)",
   "Poisson's ratio; 0.5 itself is incompressible, use 0.499"},
  {"closed", SB_OPTION_REAL, 1, "", "1", "(0, 1]", "a range with a closed end"},
  {"tags", SB_OPTION_NAMES, 1, "", "", "", "names"},
  {"pull", SB_OPTION_FORMULA, 3, "N", "0; 0; 2*t", "", "force"},
};
static const SbOption law_rows[] = {
  {"young", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "Young's modulus"},
};
static const SbOption other_law_rows[] = {
  {"fibre", SB_OPTION_REAL, 1, "", "1", "", "only another law has it"},
};
static const SbOption run_rows[] = {
  {"bodies", SB_OPTION_NAMES, 1, "", NULL, "", "names of the bodies"},
  {"verbose", SB_OPTION_BOOL, 1, "", "false", "", "say more"},
  {"repeat", SB_OPTION_INT, 1, "", "3", "[1, inf)", "how often"},
  {"integrator", SB_OPTION_CHOICE, 1, "", "newmark", "newmark|genalpha|static", "integrator"},
  {"limit", SB_OPTION_REAL, 1, "s", "", "(0, inf)", "nothing by default"},
  {"ts_dt", SB_OPTION_REAL, 1, "s", "0.01", "(0, inf)", "step"},
  {"write_every", SB_OPTION_REAL, 1, "s", "0.01", "(0, inf)", "how often"},
  {"other", SB_OPTION_REAL, 1, "s", "1", "(0, inf)", "only one integrator reads it"},
};

static SbScope run_scope, body_scope;

static PetscOptions database;

/* Creates a database with `options` and registers the option tables. */
static PetscErrorCode begin(const char *options)
{
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsCreate(&database));
  PetscCall(PetscOptionsPush(database));
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(SbOptionsRegister("", "", PETSC_STATIC_ARRAY_LENGTH(run_rows), run_rows));
  PetscCall(SbOptionsRegister("body", "", PETSC_STATIC_ARRAY_LENGTH(body_rows), body_rows));
  PetscCall(SbOptionsRegister("body", "corotated", PETSC_STATIC_ARRAY_LENGTH(law_rows), law_rows));
  PetscCall(SbOptionsRegister("body", "fibrous", PETSC_STATIC_ARRAY_LENGTH(other_law_rows),
                              other_law_rows));
  SbScopeSet(&run_scope, "", "", "");
  SbScopeSet(&body_scope, "body", "corotated", "liver");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode end(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionsReset());
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&database));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reading one option must fail with this message. */
static PetscErrorCode refused_real(const char *options, const char *key, const char *message)
{
  PetscReal x[3];

  PetscFunctionBeginUser;
  PetscCall(begin(options));
  if (!strcmp(key, "translate"))
    SB_CHECK_ERROR(SbOptionReals(&body_scope, key, x), PETSC_ERR_USER, message);
  else
    SB_CHECK_ERROR(SbOptionReal(&body_scope, key, x), PETSC_ERR_USER, message);
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refused_numbers(void)
{
  PetscFunctionBeginUser;
  PetscCall(refused_real("-body_liver_young -3", "young", "-body_liver_young -3 Pa|(0, inf) Pa"));
  PetscCall(refused_real("-body_liver_young 0", "young", "-body_liver_young 0 Pa|(0, inf) Pa"));
  PetscCall(refused_real("-body_liver_young inf", "young", "-body_liver_young inf Pa|(0, inf) Pa"));
  PetscCall(refused_real("-body_liver_young nan", "young", "-body_liver_young nan Pa|(0, inf) Pa"));
  PetscCall(refused_real("-body_liver_young 5e3x", "young", "-body_liver_young 5e3x"));
  PetscCall(refused_real("", "young", "-body_liver_young|(0, inf)"));
  PetscCall(refused_real("-body_liver_poisson 0.5", "poisson", "-body_liver_poisson 0.5|[0, 0.5)"));
  PetscCall(
    refused_real("-body_liver_poisson -1e-9", "poisson", "-body_liver_poisson -1e-9|[0, 0.5)"));
  PetscCall(refused_real("-body_liver_closed 0", "closed", "-body_liver_closed 0|(0, 1]"));
  PetscCall(
    refused_real("-body_liver_closed 1.0001", "closed", "-body_liver_closed 1.0001|(0, 1]"));
  PetscCall(refused_real("-body_liver_translate 1,2", "translate",
                         "-body_liver_translate 1,2|2 numbers|3"));
  PetscCall(refused_real("-body_liver_translate 1,2,3,4", "translate",
                         "-body_liver_translate 1,2,3,4|4 numbers"));
  PetscCall(
    refused_real("-body_liver_translate 1,,3", "translate", "-body_liver_translate 1,,3|entry 2"));
  PetscCall(refused_real("-body_liver_translate 1,nan,3", "translate",
                         "-body_liver_translate 1,nan,3 m|(-inf, inf) m"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refused_words(void)
{
  PetscBool b;
  PetscInt n;
  int choice;
  char(*names)[SB_NAME_MAX], text[8];
  SbFormula f[3];

  PetscFunctionBeginUser;
  PetscCall(begin("-verbose perhaps -repeat 2.5 -integrator newmrk -body_liver_tags a,,b "
                  "-body_liver_pull 1;2 -bodies -body_liver_mesh long_name.msh"));
  SB_CHECK_ERROR(SbOptionBool(&run_scope, "verbose", &b), PETSC_ERR_USER, "-verbose perhaps");
  SB_CHECK_ERROR(SbOptionInt(&run_scope, "repeat", &n), PETSC_ERR_USER, "-repeat 2.5");
  SB_CHECK_ERROR(SbOptionChoice(&run_scope, "integrator", &choice), PETSC_ERR_USER,
                 "-integrator newmrk|newmark");
  SB_CHECK_ERROR(SbOptionNames(&body_scope, "tags", &n, &names), PETSC_ERR_USER,
                 "-body_liver_tags a,,b|name 2|63 characters");
  SB_CHECK_ERROR(SbOptionFormulas(&body_scope, "pull", f), PETSC_ERR_USER,
                 "-body_liver_pull 1;2|2 formulas|3");
  SB_CHECK_ERROR(SbOptionNames(&run_scope, "bodies", &n, &names), PETSC_ERR_USER, "-bodies");
  SB_CHECK_ERROR(SbOptionString(&body_scope, "mesh", sizeof(text), text), PETSC_ERR_USER,
                 "-body_liver_mesh|7 characters");
  PetscCall(end());
  PetscCall(begin("-repeat 0"));
  SB_CHECK_ERROR(SbOptionInt(&run_scope, "repeat", &n), PETSC_ERR_USER, "-repeat 0|[1, inf)");
  SB_CHECK_ERROR(SbOptionReal(&run_scope, "nonesuch", NULL), PETSC_ERR_PLIB, "'nonesuch'");
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads every option of the table, as a program would, and checks the values of the user or the
   presets. */
static PetscErrorCode read_all(PetscBool given)
{
  PetscReal x[3];
  PetscReal limit = 77;
  PetscBool b;
  PetscInt n, repeat;
  int choice;
  char(*names)[SB_NAME_MAX], text[64];
  SbFormula f[3];

  PetscFunctionBeginUser;
  PetscCall(SbOptionNames(&run_scope, "bodies", &n, &names));
  SB_CHECK(n == 2 && !strcmp(names[0], "liver") && !strcmp(names[1], "stone"), "%d bodies", (int)n);
  PetscCall(PetscFree(names));
  PetscCall(SbOptionBool(&run_scope, "verbose", &b));
  SB_CHECK(b == given, "verbose");
  PetscCall(SbOptionInt(&run_scope, "repeat", &repeat));
  SB_CHECK(repeat == (given ? 12 : 3), "repeat is %d", (int)repeat);
  PetscCall(SbOptionChoice(&run_scope, "integrator", &choice));
  SB_CHECK(choice == (given ? 2 : 0), "integrator is %d", (int)choice);
  PetscCall(SbOptionReal(&run_scope, "limit", &limit));
  SB_CHECK(limit == (given ? 0.1 : 77), "limit is %g", limit);
  PetscCall(SbOptionString(&body_scope, "mesh", sizeof(text), text));
  SB_CHECK(!strcmp(text, "my meshes/liver.msh"), "mesh is '%s'", text);
  PetscCall(SbOptionReal(&body_scope, "scale", &x[0]));
  SB_CHECK(x[0] == (given ? 0.10000000000000002 : 1), "scale is %.17g", x[0]);
  PetscCall(SbOptionReals(&body_scope, "translate", x));
  SB_CHECK(x[0] == (given ? -1 : 0) && x[1] == (given ? 2.5 : 0) && x[2] == (given ? 1e-300 : 0),
           "translate");
  PetscCall(SbOptionReal(&body_scope, "young", &x[0]));
  SB_CHECK(x[0] == 5e3, "young is %g", x[0]);
  PetscCall(SbOptionNames(&body_scope, "tags", &n, &names));
  SB_CHECK(n == (given ? 1 : 0), "%d tags", (int)n);
  PetscCall(PetscFree(names));
  PetscCall(SbOptionFormulas(&body_scope, "pull", f));
  x[0] = 7, x[1] = 8, x[2] = 9;
  SB_CHECK(value_at(f[0], 3, x) == (given ? -7 : 0), "pull 0 is %g", value_at(f[0], 3, x));
  SB_CHECK(value_at(f[2], 3, x) == (given ? 10 : 6), "pull 2 is %g", value_at(f[2], 3, x));
  for (int i = 0; i < 3; i++)
    PetscCall(SbFormulaDestroy(&f[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char as_opts[] = "# a comment\n"
                              "-bodies liver,stone   # another\n"
                              "-verbose\n"
                              "-repeat 12\n"
                              "-integrator static\n"
                              "-limit 0.1\n"
                              "-body_liver_mesh \"my meshes/liver.msh\"\n"
                              "-body_liver_scale 0.10000000000000002\n"
                              "-body_liver_translate -1,2.5,1e-300\n"
                              "-body_liver_young 5e3\n"
                              "-body_liver_tags one\n"
                              "-body_liver_pull \" -x ; 0 ; t + -3 + 2*(2 + 3)\"\n"
                              "-ksp_nothing 1e-7\n";
static const char as_yaml[] = "# a comment\n"
                              "bodies: [liver, stone]\n"
                              "verbose: yes\n"
                              "repeat: 12\n"
                              "integrator: static\n"
                              "limit: 0.1\n"
                              "body:\n"
                              "  liver:\n"
                              "    mesh: my meshes/liver.msh\n"
                              "    scale: 0.10000000000000002\n"
                              "    translate: [-1, 2.5, 1e-300]\n"
                              "    young: 5e3\n"
                              "    tags: [one]\n"
                              "    pull: -x ; 0 ; t + -3 + 2*(2 + 3)\n"
                              "ksp_nothing: 1e-7\n";

/* Option file, YAML, and the scenario printed from each give the same values; presets are not the
   user's. */
static PetscErrorCode test_files(const char *folder)
{
  const char *const source[2] = {as_opts, as_yaml};
  char file[2][PETSC_MAX_PATH_LEN], view[PETSC_MAX_PATH_LEN];
  PetscViewer viewer;
  PetscInt unused;
  const char *value;
  PetscBool set;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(file[0], sizeof(file[0]), "%s/a.opts", folder));
  PetscCall(PetscSNPrintf(file[1], sizeof(file[1]), "%s/a.yml", folder));
  PetscCall(PetscSNPrintf(view, sizeof(view), "%s/view.opts", folder));
  for (int i = 0; i < 2; i++) {
    PetscCall(test_file_put(file[i], source[i]));
    PetscCall(begin(""));
    PetscCall(PetscOptionsInsertFile(PETSC_COMM_WORLD, NULL, file[i], PETSC_TRUE));
    PetscCall(SbOptionsRemember());
    PetscCall(PetscOptionsSetValue(NULL, "-pc_type", "jacobi"));
    PetscCall(read_all(PETSC_TRUE));
    PetscCall(SbOptionsCheck());
    PetscCall(SbOptionsUnused(PETSC_COMM_WORLD, &unused));
    SB_CHECK(unused == 1, "%d options left, not only -ksp_nothing", (int)unused);
    PetscCall(SbViewerOpen(PETSC_COMM_WORLD, view, &viewer));
    PetscCall(SbOptionsView(viewer));
    PetscCall(PetscViewerDestroy(&viewer));
    PetscCall(end());

    PetscCall(begin(""));
    PetscCall(PetscOptionsInsertFile(PETSC_COMM_WORLD, NULL, view, PETSC_TRUE));
    PetscCall(SbOptionsRemember());
    PetscCall(read_all(PETSC_TRUE));
    PetscCall(SbOptionsCheck());
    PetscCall(SbOptionsUnused(PETSC_COMM_WORLD, &unused));
    SB_CHECK(unused == 1, "%d options left, not only -ksp_nothing", (int)unused);
    PetscCall(PetscOptionsFindPair(NULL, NULL, "-ksp_nothing", &value, &set));
    SB_CHECK(set && value && !strcmp(value, "1e-7"), "-ksp_nothing was lost");
    PetscCall(PetscOptionsFindPair(NULL, NULL, "-pc_type", &value, &set));
    SB_CHECK(!set, "a preset of the program was printed as the user's");
    PetscCall(end());
  }
  PetscCall(
    begin("-bodies liver,stone -body_liver_mesh \"my meshes/liver.msh\" -body_liver_young 5e3"));
  PetscCall(read_all(PETSC_FALSE));
  PetscCall(SbOptionsCheck());
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A presets-only value appears in the printed scenario, active, with its full text. */
static PetscErrorCode test_view_text(const char *folder)
{
  char view[PETSC_MAX_PATH_LEN], line[512];
  PetscViewer viewer;
  PetscReal x;
  PetscBool preset = PETSC_FALSE;
  int given = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(view, sizeof(view), "%s/text.opts", folder));
  PetscCall(begin("-body_liver_scale 0.123456789012345678"));
  PetscCall(SbOptionReal(&body_scope, "poisson", &x));
  PetscCall(SbOptionReal(&body_scope, "scale", &x));
  PetscCall(SbViewerOpen(PETSC_COMM_WORLD, view, &viewer));
  PetscCall(SbOptionsView(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(end());
  if (!test_rank) {
    FILE *f = fopen(view, "r");

    while (f && fgets(line, sizeof(line), f)) {
      if (!strncmp(line, "-body_liver_poisson 0.3 ", 24) && strstr(line, "# default; Poisson"))
        preset = PETSC_TRUE;
      if (!strncmp(line, "-body_liver_scale 0.123456789012345678", 38) && !strstr(line, "default"))
        given++;
    }
    if (f)
      (void)fclose(f);
    SB_CHECK(preset, "the preset is not in the printed scenario");
    SB_CHECK(given == 1, "the given value is %d times in the printed scenario", given);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks `options` beside two valid ones; all but "other" are read; the check fails with `message`
   (NULL: it succeeds). */
static PetscErrorCode unread(const char *options, const char *message)
{
  PetscFunctionBeginUser;
  PetscCall(
    begin("-bodies liver,stone -body_liver_mesh \"my meshes/liver.msh\" -body_liver_young 5e3"));
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(read_all(PETSC_FALSE));
  if (message)
    SB_CHECK_ERROR(SbOptionsCheck(), PETSC_ERR_USER, message);
  else
    PetscCall(SbOptionsCheck());
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_check(void)
{
  PetscFunctionBeginUser;
  PetscCall(unread("-body_liver_yuong 3", "-body_liver_yuong|-body_liver_young"));
  PetscCall(unread("-body_livr_young 3", "-body_livr_young|-body_liver_young"));
  PetscCall(unread("-bodeis 3", "-bodeis|-bodies"));
  PetscCall(unread("-integratr 3", "-integratr|-integrator"));
  PetscCall(unread("-body_liver_colour red", "-body_liver_colour|body liver"));
  PetscCall(unread("-body_spleen_mesh a.msh", "-body_spleen_mesh"));

  /* valid but not used by this run: a warning */
  PetscCall(unread("-other 2", NULL));
  PetscCall(
    unread("-body_liver_yuong 3 -body_liver_yung 4", "-body_liver_yung|-body_liver_young|1"));
  PetscCall(unread("-ksp_rtoll 1e-3", "-ksp_rtoll|-ksp_rtol"));
  PetscCall(unread("-ts_dtt 3", "-ts_dtt|-ts_dt"));

  /* option of a class without its prefix, or with the first word of a program-wide option */
  PetscCall(unread("-young 3", "-young|-body_NAME_young"));
  PetscCall(unread("-write_nothing 3", "-write_nothing"));

  /* PETSc's options, and names that resemble no option */
  PetscCall(unread("-ksp_nothing 1e-3 -frobnicate 2 -ts_view 3 -write_ksp_type cg", NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Options of instances that only a scenario file lists are valid, unless the key is misspelt or no
   list names the instance. */
static PetscErrorCode test_left_out(const char *folder)
{
  static const struct {
    const char *options, *message;
  } of[] = {
    {"-body_spleen_mesh a.msh -body_spleen_young 3 -body_spleen_fibre 2", NULL},
    {"-body_liver_fibre 2", NULL},
    {"-body_spleen_yuong 3", "-body_spleen_yuong|-body_spleen_young"},
    {"-body_spelen_young 3", "-body_spelen_young|-body_spleen_young"},
    {"-body_kidney_young 3", "-body_kidney_young"},
  };
  char file[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(file, sizeof(file), "%s/lists.opts", folder));
  PetscCall(test_file_put(file, "-bodies liver,spleen\n-body_spleen_mesh b.msh\n"));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    PetscCall(
      begin("-bodies liver,stone -body_liver_mesh \"my meshes/liver.msh\" -body_liver_young 5e3"));
    PetscCall(SbOptionsFile(PETSC_COMM_WORLD, file));
    PetscCall(PetscOptionsInsertString(NULL, of[i].options));
    PetscCall(read_all(PETSC_FALSE));
    if (of[i].message)
      SB_CHECK_ERROR(SbOptionsCheck(), PETSC_ERR_USER, of[i].message);
    else
      PetscCall(SbOptionsCheck());
    PetscCall(end());
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A required option is missing and a misspelling of it is in the database: the message names the
   misspelling. */
static PetscErrorCode test_missing(void)
{
  PetscReal x;
  PetscInt n;
  char(*names)[SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(begin("-body_liver_yuong 3 -bodis liver"));
  SB_CHECK_ERROR(SbOptionReal(&body_scope, "young", &x), PETSC_ERR_USER,
                 "-body_liver_yuong|-body_liver_young");
  SB_CHECK_ERROR(SbOptionNames(&run_scope, "bodies", &n, &names), PETSC_ERR_USER, "-bodis|-bodies");
  PetscCall(end());

  /* the same key of another instance is not a misspelling */
  PetscCall(begin("-body_livre_young 3"));
  SB_CHECK_ERROR(SbOptionReal(&body_scope, "young", &x), PETSC_ERR_USER,
                 "-body_liver_young|(0, inf)");
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An early check validates a value and counts as reading. */
static PetscErrorCode test_ahead(void)
{
  static const char *const keys[] = {"scale", "translate", "tags", "pull", "mesh"};
  SbScope linear;

  PetscFunctionBeginUser;
  PetscCall(begin(
    "-body_liver_translate 1,2,3 -body_liver_mesh a.msh -verbose -repeat 2 -integrator static"));
  for (int i = 0; i < 5; i++)
    PetscCall(SbOptionCheckEarly(&body_scope, keys[i]));
  for (int i = 1; i < 4; i++)
    PetscCall(SbOptionCheckEarly(&run_scope, run_rows[i].key));
  PetscCall(SbOptionsCheck());
  SB_CHECK(SbOptionFind(&body_scope, "young"), "young exists");
  SB_CHECK(!SbOptionFind(&run_scope, "young"), "a run has no young");
  SbScopeSet(&linear, "body", "linear", "liver");
  SB_CHECK(!SbOptionFind(&linear, "young"), "young belongs to another type");
  PetscCall(end());
  PetscCall(begin("-body_liver_scale -1"));
  SB_CHECK_ERROR(SbOptionCheckEarly(&body_scope, "scale"), PETSC_ERR_USER,
                 "-body_liver_scale -1|(0, inf)");
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Names with underscores are allowed; an ambiguous full name is an error. */
static PetscErrorCode test_underscores(void)
{
  static const SbOption long_rows[] = {
    {"mesh_scale", SB_OPTION_REAL, 1, "", "1", "", "a key with an underscore"}};
  SbScope other;
  PetscReal x;

  PetscFunctionBeginUser;
  PetscCall(begin("-body_liver_mesh_scale 3"));
  PetscCall(SbOptionsRegister("body", "", 1, long_rows));
  SbScopeSet(&other, "body", "corotated", "liver_mesh");
  PetscCall(SbOptionReal(&other, "scale", &x));
  SB_CHECK(x == 3, "scale of liver_mesh is %g", x);
  SB_CHECK_ERROR(SbOptionReal(&body_scope, "mesh_scale", &x), PETSC_ERR_USER,
                 "-body_liver_mesh_scale|body 'liver_mesh'|body 'liver'");
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_nearest(void)
{
  const char *const names[] = {"gravity", "traction", "pressure", "p1", "cr"};
  const char *const solvers[] = {"direct", "cg_hypre", "cg_icc", "cg"};
  char text[64];

  PetscFunctionBeginUser;
  SbSuggestNames("gravty", 5, names, sizeof(text), text);
  SB_CHECK(!strcmp(text, "gravity"), "'%s'", text);
  SbSuggestNames("GRAVITY", 5, names, sizeof(text), text);
  SB_CHECK(!strcmp(text, "gravity"), "'%s'", text);
  SbSuggestNames("c1", 5, names, sizeof(text), text);
  SB_CHECK(!strcmp(text, "p1 or cr"), "'%s'", text);
  SbSuggestNames("rc", 5, names, sizeof(text), text);
  SB_CHECK(!strcmp(text, "cr"), "'%s'", text);
  SbSuggestNames("contact", 5, names, sizeof(text), text);
  SB_CHECK(!text[0], "'%s'", text);

  /* a name that is there twice is said once */
  {
    const char *const twice[] = {"cg_hypre", "gravity", "cg_hypre", "gravity", "cg_hypre"};

    SbSuggestNames("gravty", 5, twice, sizeof(text), text);
    SB_CHECK(!strcmp(text, "gravity"), "'%s'", text);
    SbSuggestNames("hypre", 5, twice, sizeof(text), text);
    SB_CHECK(!strcmp(text, "cg_hypre"), "'%s'", text);
  }

  /* a word of a name, where none is alike */
  SbSuggestNames("hypre", 4, solvers, sizeof(text), text);
  SB_CHECK(!strcmp(text, "cg_hypre"), "'%s'", text);
  SbSuggestNames("hyp", 4, solvers, sizeof(text), text);
  SB_CHECK(!text[0], "'%s'", text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every row is in the table for programs, below the names of its columns. */
static PetscErrorCode test_manual(const char *folder)
{
  char file[PETSC_MAX_PATH_LEN], line[1024];
  int rows = 0;
  int required = 0;
  int tabs = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(file, sizeof(file), "%s/options.tsv", folder));
  PetscCall(begin(""));
  PetscCall(SbOptionsTable(PETSC_COMM_WORLD, file));
  if (!test_rank) {
    FILE *f = fopen(file, "r");

    while (f && fgets(line, sizeof(line), f)) {
      rows++;
      for (const char *c = line; *c; c++)
        tabs += *c == '\t';
      if (strstr(line, "\t-body_<name>_young\treal\t1\tPa\tyes\t\t(0, inf)\t"))
        required++;
    }
    if (f)
      (void)fclose(f);
    SB_CHECK(rows == 1 + 17, "%d lines in the table", rows);
    SB_CHECK(tabs == 9 * rows, "%d tabs in the table", tabs);
    SB_CHECK(required == 1, "young is not marked as required");
  }
  SB_CHECK_ERROR(SbOptionsTable(PETSC_COMM_WORLD, "/nonexistent/folder/options.tsv"),
                 PETSC_ERR_FILE_OPEN, "/nonexistent/folder/options.tsv");
  PetscCall(end());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char folder[512];
  PetscReal x;
  PetscInt n;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(folder));
  PetscCall(test_refused_numbers());

  /* values at the ends of intervals */
  PetscCall(begin("-body_liver_closed 1 -body_liver_poisson 0 -repeat 1"));
  PetscCall(SbOptionReal(&body_scope, "closed", &x));
  SB_CHECK(x == 1, "closed is %g", x);
  PetscCall(SbOptionReal(&body_scope, "poisson", &x));
  SB_CHECK(x == 0, "poisson is %g", x);
  PetscCall(SbOptionInt(&run_scope, "repeat", &n));
  SB_CHECK(n == 1, "repeat is %d", (int)n);
  PetscCall(end());
  PetscCall(test_refused_words());
  PetscCall(test_files(folder));
  PetscCall(test_view_text(folder));
  PetscCall(test_check());
  PetscCall(test_left_out(folder));
  PetscCall(test_missing());
  PetscCall(test_ahead());
  PetscCall(test_underscores());
  PetscCall(test_nearest());
  PetscCall(test_manual(folder));
  SB_TEST_END();
}
