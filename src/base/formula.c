/*
  formula.c - formulas of time and position: a recursive descent parser makes postfix code for a
  stack machine.

    expression = term { (+|-) term }
    term       = unary { (*|/) unary }
    unary      = (+|-) unary | power
    power      = primary [ ^ unary ]              so -2^2 = -4 and 2^3^2 = 2^9
    primary    = number | t | x | y | z | pi | function ( expression {, expression} ) | ( expression
    )

  The code has no branches, so its stack depth is known when it is compiled; formulas that need a
  deeper stack are an error. Not supported: comparisons (use step(a)), units, user-defined names.
*/
#include <ctype.h>
#include "formula.h"

static PetscReal step_of(PetscReal a)
{
  return a < 0 ? 0 : 1;
}

static PetscReal clamp_of(PetscReal a, PetscReal lo, PetscReal hi)
{
  if (a < lo)
    return lo;
  return a > hi ? hi : a;
}

static PetscReal ramp_of(PetscReal a)
{
  return clamp_of(a, 0, 1);
}

static const struct {
  const char *name;
  int narg;
  PetscReal (*f1)(PetscReal);
  PetscReal (*f2)(PetscReal, PetscReal);
  PetscReal (*f3)(PetscReal, PetscReal, PetscReal);
} functions[] = {
  {"sin", 1, sin, NULL, NULL},      {"cos", 1, cos, NULL, NULL},
  {"tan", 1, tan, NULL, NULL},      {"asin", 1, asin, NULL, NULL},
  {"acos", 1, acos, NULL, NULL},    {"atan", 1, atan, NULL, NULL},
  {"atan2", 2, NULL, atan2, NULL},  {"exp", 1, exp, NULL, NULL},
  {"log", 1, log, NULL, NULL},      {"sqrt", 1, sqrt, NULL, NULL},
  {"abs", 1, fabs, NULL, NULL},     {"min", 2, NULL, fmin, NULL},
  {"max", 2, NULL, fmax, NULL},     {"floor", 1, floor, NULL, NULL},
  {"tanh", 1, tanh, NULL, NULL},    {"step", 1, step_of, NULL, NULL},
  {"ramp", 1, ramp_of, NULL, NULL}, {"clamp", 3, NULL, NULL, clamp_of},
};
static const char *const variables[] = {"t", "x", "y", "z", "pi"}; /* and a constant */

#define SUM "+-" /* operators of a rank; PRODUCT binds closer */
#define PRODUCT "*/"

/* The compiler: a text, and the position in it. */
typedef struct {
  const char *text;  /* the complete formula */
  const char *next;  /* first unread character */
  const char *where; /* name of the option, for messages */
  SbFormula formula;
  int nesting, depth; /* depth of the recursion; depth of the stack at this point of the code */
} Parser;

static PetscErrorCode expression(Parser *p, const char *operators);

static void skip_blanks(Parser *p)
{
  while (isspace((unsigned char)*p->next))
    p->next++;
}

/* Raises a one-line error that says what is wrong and in which column, from 1. */
static PetscErrorCode complain(const Parser *p, const char *at, const char *what)
{
  PetscFunctionBeginUser;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s: column %d of '%s': %s", p->where,
          (int)(at - p->text) + 1, p->text, what);
}

static PetscErrorCode emit(Parser *p, char op, int index, PetscReal number, int change)
{
  PetscFunctionBeginUser;
  p->formula->step[p->formula->nstep++] = (SbFormulaStep){op, index, number, change};
  p->depth += change;
  if (p->depth > SB_FORMULA_STACK)
    PetscCall(complain(p, p->next, "the formula is nested too deeply"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode expect(Parser *p, char c)
{
  char what[32];

  PetscFunctionBeginUser;
  skip_blanks(p);
  PetscCall(PetscSNPrintf(what, sizeof(what), "expected '%c'", c));
  if (*p->next != c)
    PetscCall(complain(p, p->next, what));
  p->next++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode word(Parser *p)
{
  const char *begin = p->next;
  char name[32];
  size_t n = 0;
  const char *known[PETSC_STATIC_ARRAY_LENGTH(functions) + 5];
  char near[128] = "";
  char what[256];
  PetscInt nknown = 0;

  PetscFunctionBeginUser;
  for (; isalnum((unsigned char)*p->next) || *p->next == '_'; p->next++)
    if (n + 1 < sizeof(name))
      name[n++] = *p->next;
  name[n] = 0;
  for (int i = 0; i < 5; i++) {
    if (strcmp(name, variables[i]))
      continue;
    if (i < 4)
      p->formula->uses[i > 0] = PETSC_TRUE;
    PetscCall(emit(p, i < 4 ? 'v' : 'n', i, PETSC_PI, 1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(functions); i++) {
    if (strcmp(name, functions[i].name))
      continue;

    // function call: sin(expression), atan2(expression, expression), ...
    PetscCall(expect(p, '('));
    for (int k = 0; k < functions[i].narg; k++) {
      if (k)
        PetscCall(expect(p, ','));
      PetscCall(expression(p, SUM));
    }
    PetscCall(expect(p, ')'));
    PetscCall(emit(p, 'f', (int)i, 0, 1 - functions[i].narg));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // an unknown name: suggest similar ones
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(functions); i++)
    known[nknown++] = functions[i].name;
  for (int i = 0; i < 5; i++)
    known[nknown++] = variables[i];
  if (n > 1)
    SbSuggestNames(name, nknown, known, sizeof(near), near);
  PetscCall(PetscSNPrintf(
    what, sizeof(what), "unknown name '%s'; %s%s%s", name, near[0] ? "did you mean " : "", near,
    near[0] ? "?"
            : "a formula knows t (s), x, y, z (m), pi and functions such as sin, sqrt, ramp"));
  PetscCall(complain(p, begin, what));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode unary(Parser *p)
{
  PetscFunctionBeginUser;
  if (++p->nesting > 4 * SB_FORMULA_STACK)
    PetscCall(complain(p, p->next, "the formula is nested too deeply"));
  skip_blanks(p);
  if (*p->next == '-' || *p->next == '+') {
    const PetscBool minus = (PetscBool)(*p->next++ == '-');

    PetscCall(unary(p));
    if (minus)
      PetscCall(emit(p, 'm', 0, 0, 0));
  } else {
    const unsigned char c = (unsigned char)*p->next;

    // a number, a name or an expression in parentheses
    if (isdigit(c) || (c == '.' && isdigit((unsigned char)p->next[1]))) {
      char *end;
      const PetscReal number = strtod(p->next, &end);

      p->next = end;
      PetscCall(emit(p, 'n', 0, number, 1));
    } else if (isalpha(c)) {
      PetscCall(word(p));
    } else if (c == '(') {
      p->next++;
      PetscCall(expression(p, SUM));
      PetscCall(expect(p, ')'));
    } else {
      PetscCall(complain(p, p->next,
                         c ? "expected a number, a name or '('" : "the formula ends too early"));
    }
    skip_blanks(p);
    if (*p->next == '^') {
      p->next++;
      PetscCall(unary(p));
      PetscCall(emit(p, '^', 0, 0, -1));
    }
  }
  p->nesting--;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Operands joined by the operators of one rank, SUM or PRODUCT. */
static PetscErrorCode expression(Parser *p, const char *operators)
{
  const PetscBool sum = (PetscBool)(operators[0] == '+');

  PetscFunctionBeginUser;
  for (char op = 0;; op = *p->next++) {
    PetscCall(sum ? expression(p, PRODUCT) : unary(p));
    if (op)
      PetscCall(emit(p, op, 0, 0, -1));
    skip_blanks(p);
    if (!*p->next || !strchr(operators, *p->next))
      break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether one of n arguments is not a number. C's min, max and pow, and comparisons, would lose it:
   a formula would have a value where it has none. */
static PetscBool any_nan(const PetscReal a[], int n)
{
  for (int i = 0; i < n; i++)
    if (PetscIsNanReal(a[i]))
      return PETSC_TRUE;
  return PETSC_FALSE;
}

/* The value, whatever it is. */
static PetscReal evaluate(SbFormula f, PetscReal t, const PetscReal x[3])
{
  PetscReal stack[SB_FORMULA_STACK + 2]; /* the first value is at stack[1] */
  PetscReal *a = stack;                  /* the last value */

  if (!f->step)
    return SbFormulaEvalTable(f, t);
  for (PetscInt i = 0; i < f->nstep; i++) {
    const SbFormulaStep *s = &f->step[i];

    /* Operands are on top of the stack, the first one deepest; the result replaces the first. */
    a += s->change;
    switch (s->op) {
    case 'n':
      a[0] = s->number;
      break;
    case 'v':
      a[0] = s->index ? x[s->index - 1] : t;
      break;
    case '+':
      a[0] += a[1];
      break;
    case '-':
      a[0] -= a[1];
      break;
    case '*':
      a[0] *= a[1];
      break;
    case '/':
      a[0] /= a[1];
      break;
    case '^':
      a[0] = any_nan(a, 2) ? (PetscReal)NAN : pow(a[0], a[1]);
      break;
    case 'm':
      a[0] = -a[0];
      break;
    case 'f':
      if (any_nan(a, functions[s->index].narg))
        a[0] = (PetscReal)NAN;
      else if (functions[s->index].f1)
        a[0] = functions[s->index].f1(a[0]);
      else if (functions[s->index].f2)
        a[0] = functions[s->index].f2(a[0], a[1]);
      else
        a[0] = functions[s->index].f3(a[0], a[1], a[2]);
      break;
    }
  }
  return a[0];
}

PetscErrorCode SbFormulaEval(SbFormula f, PetscReal t, const PetscReal x[3], PetscReal *value)
{
  char at[128] = "";
  PetscReal v;

  PetscFunctionBeginUser;
  v = evaluate(f, t, x);
  *value = v;
  if (PetscAbsReal(v) <= f->largest)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* where and when: snprintf() as PetscSNPrintf() would write "0." */
  if (f->uses[0])
    SbFormat(sizeof(at), at, " at t = %.10g s", (double)t);
  if (f->uses[1] && x)
    SbAppend(sizeof(at), at, ", x,y,z = %g,%g,%g m", (double)x[0], (double)x[1], (double)x[2]);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: %s is %s%s", f->where,
          f->text ? f->text : "its value",
          PetscIsNanReal(v)        ? "not a number"
          : PetscIsInfOrNanReal(v) ? "infinite"
                                   : "beyond 1e15 m",
          at);
}

PetscBool SbFormulaUses(SbFormula f, char variable)
{
  return f->uses[variable == 'x'];
}

PetscErrorCode SbFormulaDestroy(SbFormula *formula)
{
  PetscFunctionBeginUser;
  if (!*formula)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbLiveForget(*formula);
  PetscCall(PetscFree((*formula)->text));
  PetscCall(PetscFree((*formula)->where));
  PetscCall(PetscFree((*formula)->step));
  PetscCall(PetscFree((*formula)->row));
  PetscCall(PetscFree(*formula));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormulaNew(const char *where, SbFormula *formula)
{
  PetscFunctionBeginUser;
  PetscCall(PetscNew(formula));
  PetscCall(PetscStrallocpy(where, &(*formula)->where));
  (*formula)->largest = PETSC_MAX_REAL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormulaCreate(MPI_Comm comm, const char *text, const char *where,
                               SbFormula *formula)
{
  SbFormula f;
  Parser p = {.text = text, .next = text, .where = where};

  PetscFunctionBeginUser;
  PetscCall(SbFormulaNew(where, formula));
  f = *formula;
  PetscCall(PetscStrallocpy(text, &f->text));
  skip_blanks(&p);
  if (!strncmp(p.next, "table:", 6)) {
    f->uses[0] = PETSC_TRUE;
    PetscCall(SbFormulaReadTable(comm, p.next + 6, where, f));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* each instruction comes from at least one character of the text */
  PetscCall(PetscMalloc1(strlen(text) + 1, &f->step));
  p.formula = f;
  PetscCall(expression(&p, SUM));
  if (*p.next)
    PetscCall(complain(&p, p.next, "expected an operator"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
