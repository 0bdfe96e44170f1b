/*
  test_formula.c - formulas and tables: values against C arithmetic, messages of invalid ones.
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

static PetscErrorCode value(const char *text, PetscReal expected)
{
  SbFormula f;

  PetscFunctionBeginUser;
  PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, text, "-test", &f));

  /* the same operations in the same order give bitwise the same result */
  SB_CHECK(value_at(f, 4, X) == expected, "%s is %.17g, expected %.17g", text, value_at(f, 4, X),
           expected);
  PetscCall(SbFormulaDestroy(&f));
  SB_CHECK(!f, "destroyed formula is not NULL");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_values(void)
{
  const PetscReal t = 4;
  const PetscReal x = X[0];
  const PetscReal y = X[1];
  const PetscReal z = X[2];

  PetscFunctionBeginUser;
  PetscCall(value("2", 2));
  PetscCall(value(" .5e1 ", 5));
  PetscCall(value("1+2*3", 7));
  PetscCall(value("(1+2)*3", 9));
  PetscCall(value("10-4-3", 3));
  PetscCall(value("24/4/3", 2));
  PetscCall(value("2^3^2", 512));
  PetscCall(value("-2^2", -4));
  PetscCall(value("2^-1", 0.5));
  PetscCall(value("--3", 3));
  PetscCall(value("2*-3", -6));
  PetscCall(value("+t", 4));
  PetscCall(value("x+10*y+100*z+1000*t", x + 10 * y + 100 * z + 1000 * t));
  PetscCall(value("pi", PETSC_PI));
  PetscCall(value("sin(2*pi*t/3)", PetscSinReal(2 * PETSC_PI * t / 3)));
  PetscCall(value("cos(x)+tan(x)", cos(x) + tan(x)));
  PetscCall(value("asin(x)+acos(x)", asin(x) + acos(x)));
  PetscCall(value("atan(z)-atan2(y,z)", atan(z) - atan2(y, z)));
  PetscCall(value("exp(y)*log(z)", exp(y) * log(z)));
  PetscCall(value("sqrt(abs(y))", sqrt(2.0)));
  PetscCall(value("min(y,z)+10*max(y,z)", 28));
  PetscCall(value("floor(y/4)", -1));
  PetscCall(value("tanh(x)", tanh(x)));
  PetscCall(value("step(0)+10*step(-1e-300)+100*step(t)", 101));
  PetscCall(value("ramp(-1)+10*ramp(x)+100*ramp(2)", 105));
  PetscCall(value("clamp(t,0,3)+10*clamp(y,-1,3)+100*clamp(x,0,1)", 43));
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

/* Creation must fail with a message that contains these names; partial results are freed. */
static PetscErrorCode refused(const char *text, const char *names)
{
  SbFormula f = NULL;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(SbFormulaCreate(PETSC_COMM_WORLD, text, "-test", &f), PETSC_ERR_USER, names);
  PetscCall(SbFormulaDestroy(&f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refused(void)
{
  char deep[1024], nested[1024];

  PetscFunctionBeginUser;
  PetscCall(refused("", "-test|column 1|''"));
  PetscCall(refused("2*", "-test|column 3|'2*'"));
  PetscCall(refused("2 3", "-test|column 3|'2 3'"));
  PetscCall(refused("2x", "-test|column 2|'2x'"));
  PetscCall(refused("(1+2", "-test|column 5|'(1+2'|')'"));
  PetscCall(refused("1+2)", "-test|column 4|'1+2)'"));
  PetscCall(refused("sin t", "-test|column 5|'sin t'|'('"));
  PetscCall(refused("atan2(1)", "-test|column 8|'atan2(1)'|','"));
  PetscCall(refused("sin(1,2)", "-test|column 6|'sin(1,2)'|')'"));
  PetscCall(refused("3*sqtr(2)", "-test|column 3|'3*sqtr(2)'|name 'sqtr'|sqrt"));
  PetscCall(refused("2*s", "-test|column 3|'2*s'|name 's'"));
  PetscCall(refused("t & 1", "-test|column 3|'t & 1'"));
  PetscCall(refused("inf", "-test|column 1|name 'inf'"));

  /* 300 open brackets; a sum whose terms all remain on the stack */
  memset(deep, '(', 300);
  deep[300] = 0;
  PetscCall(refused(deep, "-test|column 257"));
  nested[0] = 0;
  for (int i = 0; i < 70; i++)
    PetscCall(PetscStrlcat(nested, "1-(", sizeof(nested)));
  PetscCall(refused(nested, "-test|column 194"));
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
  char file[512];
  FILE *empty;
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_values());
  PetscCall(test_uses());
  PetscCall(test_not_finite());
  PetscCall(test_refused());
  PetscCall(test_tables());
  SB_TEST_END();
}
