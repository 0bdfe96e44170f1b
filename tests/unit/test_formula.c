/*
  test_formula.c - formulas and tables: the cases of tests/data/formulas.txt, values and errors.
*/
// @ranks 1 3
#include "../../src/base/formula.h"
#include "file.h"
#include "test.h"

static const PetscReal X[3] = {0.5, -2, 3};

/* Its value; NaN where it has none. */
static PetscReal value_at(SbFormula f, PetscReal t, const PetscReal x[3])
{
  PetscReal value = NAN;

  (void)SbFormulaEval(f, t, x, &value);
  return value;
}

/* Creation must fail with a message that contains these names; partial results are freed. */
static PetscErrorCode refused(const char *text, const char *names)
{
  SbFormula f = NULL;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(SbFormulaCreate(PETSC_COMM_WORLD, text, "-test", &f), PETSC_ERR_USER, names);
  PetscCall(SbFormulaDestroy(&f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode value(const char *text, PetscReal expected)
{
  SbFormula f;
  PetscReal v;

  PetscFunctionBeginUser;
  PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, text, "-test", &f));
  if (PetscIsInfOrNanReal(expected))
    SB_CHECK_ERROR(SbFormulaEval(f, 4, X, &v), PETSC_ERR_USER_INPUT, "-test");
  else
    PetscCall(SbFormulaEval(f, 4, X, &v));
  SB_CHECK(v == expected || PetscAbsReal(v - expected) <= 1e-14 * PetscAbsReal(expected) ||
             (v != v && expected != expected),
           "%s is %.17g, expected %.17g", text, v, expected);
  PetscCall(SbFormulaDestroy(&f));
  SB_CHECK(!f, "destroyed formula is not NULL");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The cases that the evaluator of the Python package passes, too: FORMULA|=VALUE,
   FORMULA|!COLUMN|NAME|... */
static PetscErrorCode test_cases(void)
{
  FILE *f = fopen("tests/data/formulas.txt", "r");
  char line[1024], names[512];
  int n = 0;

  PetscFunctionBeginUser;
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "tests/data/formulas.txt");
  for (; fgets(line, sizeof(line), f); n++) {
    char *expected = strchr(line, '|');
    char *more;

    line[strcspn(line, "\n")] = 0;
    if (line[0] == '#' || !expected)
      continue;
    *expected++ = 0;
    more = strchr(expected, '|');
    if (more)
      *more++ = 0;
    if (expected[0] == '=') {
      PetscCall(value(line, strtod(expected + 1, NULL)));
    } else {
      SbFormat(sizeof(names), names, "-test|column %s of%s%s", expected + 1, more ? "|" : "",
               more ? more : "");
      PetscCall(refused(line, names));
    }
  }
  (void)fclose(f);
  SB_CHECK(n > 70, "only %d cases", n);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_uses(void)
{
  static const struct {
    const char *text;
    PetscBool time, place;
  } cases[] = {
    {"2*pi", PETSC_FALSE, PETSC_FALSE},
    {"sin(t)", PETSC_TRUE, PETSC_FALSE},
    {"x*y", PETSC_FALSE, PETSC_TRUE},
    {"t*z", PETSC_TRUE, PETSC_TRUE},
  };
  SbFormula f;

  PetscFunctionBeginUser;
  for (int i = 0; i < 4; i++) {
    PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, cases[i].text, "-test", &f));
    SB_CHECK(SbFormulaUses(f, 't') == cases[i].time && SbFormulaUses(f, 'x') == cases[i].place,
             "%s: time %d, place %d", cases[i].text, SbFormulaUses(f, 't'), SbFormulaUses(f, 'x'));
    PetscCall(SbFormulaDestroy(&f));
  }

  /* without a dependence on position, x may be NULL */
  PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, "3*t", "-test", &f));
  SB_CHECK(value_at(f, 2, NULL) == 6, "3*t");
  PetscCall(SbFormulaDestroy(&f));
  PetscCall(SbFormulaDestroy(&f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Values that are not finite are errors with option, formula, time and place; of lengths also those
   that are too large. */
static PetscErrorCode test_not_finite(void)
{
  static const struct {
    const char *text;
    PetscReal largest;
    const char *names; /* of the error at t = 4; NULL: it is valid */
  } cases[] = {
    {"sqrt(3-t)", PETSC_MAX_REAL, "-test|sqrt(3-t)|not a number|t = 4 s"},
    {"1/(t-4)", PETSC_MAX_REAL, "-test|1/(t-4)|infinite|t = 4 s"},
    {"-exp(1e3*t)", PETSC_MAX_REAL, "-test|infinite|t = 4 s"},
    {"log(y)", PETSC_MAX_REAL, "-test|not a number|0.5,-2,3"},
    {"log(y-t)", PETSC_MAX_REAL, "-test|not a number|t = 4 s|0.5,-2,3"},
    {"1e400", PETSC_MAX_REAL, "-test|infinite"},
    {"1e38", PETSC_MAX_REAL, NULL},
    {"0-1e38*t", SB_LENGTH_MAX, "-test|beyond 1e15 m|t = 4 s"},
    {"1e15", SB_LENGTH_MAX, NULL},
  };
  PetscReal v;
  SbFormula f;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, cases[i].text, "-test", &f));
    f->largest = cases[i].largest;
    if (cases[i].names)
      SB_CHECK_ERROR(SbFormulaEval(f, 4, X, &v), PETSC_ERR_USER_INPUT, cases[i].names);
    else
      PetscCall(SbFormulaEval(f, 4, X, &v));
    PetscCall(SbFormulaDestroy(&f));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a formula from a table with this content, in a folder that all ranks share. */
static PetscErrorCode table(const char *file, const char *content, const char *line, SbFormula *f)
{
  char text[PETSC_MAX_PATH_LEN], message[2 * PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(test_file_put(file, content));
  PetscCall(PetscSNPrintf(text, sizeof(text), "table:%s", file));
  if (line) {
    PetscCall(PetscSNPrintf(message, sizeof(message), "-test|%s|%s", file, line));
    PetscCall(refused(text, message));
  } else
    PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, text, "-test", f));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_tables(void)
{
  char file[512], text[600];
  FILE *empty;
  PetscMPIInt rank;
  SbFormula f;

  PetscFunctionBeginUser;
  PetscCall(test_file_open(".txt", file, &empty));
  PetscCall(test_file_close(empty));

  PetscCall(table(file, "# t value\n0 1\n\n 1, 3 # here\r\n2\t5\n4;-5", NULL, &f));
  SB_CHECK(SbFormulaUses(f, 't') && !SbFormulaUses(f, 'x'), "a table is a function of time");
  SB_CHECK(value_at(f, -1, NULL) == 1 && value_at(f, 9, NULL) == -5, "constant outside");
  SB_CHECK(value_at(f, 1, NULL) == 3 && value_at(f, 2, NULL) == 5, "at the rows");
  SB_CHECK(value_at(f, 0.25, NULL) == 1.5 && value_at(f, 3, NULL) == 0, "in between");
  PetscCall(SbFormulaDestroy(&f));
  PetscCall(table(file, "3 8\n", NULL, &f));
  SB_CHECK(value_at(f, 0, NULL) == 8, "a single row");
  PetscCall(SbFormulaDestroy(&f));

  PetscCall(table(file, "0 1\n1 x\n", "line 2", &f));
  PetscCall(table(file, "0 1\n1\n", "line 2", &f));
  PetscCall(table(file, "0 1 2\n", "line 1", &f));
  PetscCall(table(file, "0 nan\n", "line 1", &f));
  PetscCall(table(file, "0 1\n2 1\n2 3\n", "line 3|2 s", &f));
  PetscCall(table(file, "# nothing\n", "", &f));
  PetscCall(refused("table:/nonexistent.txt", "-test|/nonexistent.txt"));

  /* what has no end, and a pipe that nobody writes to */
  PetscCall(refused("table:/dev/zero", "-test|/dev/zero|regular"));
  PetscCall(test_file_open(".pipe", file, &empty));
  PetscCall(test_file_close(empty));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!rank)
    SB_CHECK(!unlink(file) && !mkfifo(file, 0600), "no pipe %s", file);
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscCall(PetscSNPrintf(text, sizeof(text), "table:%s", file));
  PetscCall(refused(text, "-test|regular"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* test_formula -formulas FILE: the value of each line of a file, or ! and the column of its error,
   for tests/verify/formulas.py, which compares them with those of python/supple. */
static PetscErrorCode print_values(const char *path)
{
  const PetscReal place[3] = {0.5, -2, 3};
  FILE *file = fopen(path, "r");
  char *line = NULL;
  size_t size = 0;
  ssize_t n;

  PetscFunctionBeginUser;
  PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "%s", path);
  while ((n = getline(&line, &size, file)) > 0) {
    PetscErrorCode ierr;
    SbFormula f;

    line[n - 1] = 0;
    PetscCall(PetscPushErrorHandler(sb_test_keep, NULL));
    ierr = SbFormulaCreate(PETSC_COMM_SELF, line, "-test", &f);
    PetscCall(PetscPopErrorHandler());
    if (ierr) {
      const char *column = strstr(sb_test_text, "column ");

      printf("!%d\n", column ? atoi(column + 7) : -1);
      continue;
    }
    printf("%.17g\n", (double)value_at(f, 4, place));
    PetscCall(SbFormulaDestroy(&f));
  }
  free(line);
  (void)fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool compare;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscOptionsGetString(NULL, NULL, "-formulas", path, sizeof(path), &compare));
  if (compare) {
    PetscCall(print_values(path));
    PetscCall(PetscFinalize());
    return 0;
  }
  PetscCall(test_cases());
  PetscCall(test_uses());
  PetscCall(test_not_finite());
  PetscCall(test_tables());
  SB_TEST_END();
}
