/*
  option_read.c - conversion of option texts to checked values.

  A number must be the whole text; it is compared with the interval of its row, "[a, b)", whose ends
  may be inf. NaN is in no interval. The error message has the option, value, interval, unit and
  help text; advice about an excluded end belongs to the help text of the row.
*/
#include <ctype.h>
#include "formula.h"
#include "option.h"

/* Copies [begin, end), trimmed; returns whether it fits. */
static PetscBool copy_trimmed(const char *begin, const char *end, size_t size, char text[])
{
  size_t n;

  while (begin < end && isspace((unsigned char)*begin))
    begin++;
  while (end > begin && isspace((unsigned char)end[-1]))
    end--;
  n = (size_t)(end - begin);
  if (n >= size)
    return PETSC_FALSE;
  memcpy(text, begin, n);
  text[n] = 0;
  return PETSC_TRUE;
}

/* Number of items between separators: "a,b" has two, "" and "  " have none. */
static PetscInt count_pieces(const char *text, char separator)
{
  PetscInt n = 1;

  while (isspace((unsigned char)*text))
    text++;
  if (!*text)
    return 0;
  for (; *text; text++)
    n += *text == separator;
  return n;
}

/* Removes the next item from *text. */
static PetscBool next_piece(const char **text, char separator, size_t size, char piece[])
{
  const char *end = strchr(*text, separator);
  PetscBool fits;

  if (!end)
    end = *text + strlen(*text);
  fits = copy_trimmed(*text, end, size, piece);
  *text = *end ? end + 1 : end;
  return fits;
}

static PetscBool parse_real(const char *text, PetscReal *value)
{
  char *end;

  *value = strtod(text, &end);
  return (PetscBool)(end != text && !*end);
}

/* Raises the error of a number out of its range. */
static PetscErrorCode check_range(const SbOptionRecord *r, PetscReal x)
{
  PetscBool in;
  const char *unit = r->row->unit;
  const char *blank = unit[0] ? " " : "";
  char open, close;
  double lo, hi;

  PetscFunctionBeginUser;

  /* whether x is in "[a, b)"; an empty range has all numbers but NaN; an invalid one is an internal
     error */
  in = (PetscBool)(x == x);
  if (r->row->range[0]) {
    PetscCheck(sscanf(r->row->range, "%c%lf,%lf%c", &open, &lo, &hi, &close) == 4 &&
                 strchr("([", open) && strchr(")]", close),
               PETSC_COMM_SELF, PETSC_ERR_PLIB,
               "Unreadable range '%s' in a row of the option table", r->row->range);
    in = (PetscBool)((open == '[' ? x >= lo : x > lo) && (close == ']' ? x <= hi : x < hi));
  }

  /* lengths also end where computing with them would overflow; infinite ones say "no limit" */
  if (!strcmp(r->row->unit, "m") && PetscAbsReal(x) > SB_LENGTH_MAX && !PetscIsInfReal(x))
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s %s is beyond 1e15 m, the largest length: %s",
            r->name, r->text, r->row->help);
  PetscCheck(in, PETSC_COMM_SELF, PETSC_ERR_USER, "%s %s%s%s is outside %s%s%s: %s", r->name,
             r->text, blank, unit, r->row->range[0] ? r->row->range : "the numbers", blank, unit,
             r->row->help);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Record of an option of this kind, with the user's text or else the default. */
static PetscErrorCode text_of(const SbScope *scope, const char *key, SbOptionKind kind,
                              const SbOptionRecord **record)
{
  const SbOption *row;
  SbOptionRecord *r = NULL;
  const char *value = NULL;
  SbScope where;
  PetscBool given, range;

  PetscFunctionBeginUser;
  PetscCall(SbOptionNeed(scope, key, &row));
  PetscCall(SbOptionFindValue(scope, key, &where, &value, &given));
  PetscCall(SbOptionFindRecord(&where, row, &r));
  PetscCheck(row->kind == kind, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "Option %s has kind %d, asked for as %d", r->name, (int)row->kind, (int)kind);
  r->given = given;
  range = (PetscBool)(row->range[0] == '(' || row->range[0] == '[');
  SbFormat(sizeof(r->want), r->want, "%s%s%s%s", range || row->unit[0] ? " in " : "",
           range ? row->range : "", range && row->unit[0] ? " " : "", row->unit);
  if (r->given && !value && row->kind == SB_OPTION_BOOL)
    value = "true";
  PetscCheck(!r->given || value, PETSC_COMM_SELF, PETSC_ERR_USER, "%s has no value%s: %s%s",
             r->name, r->want, row->help,
             row->kind == SB_OPTION_FORMULA ? "; write -x as 0-x, or PETSc takes it for an option"
                                            : "");
  if (!r->given && !row->preset)
    PetscCall(SbOptionMissing(r));
  PetscCall(PetscFree(r->text));
  PetscCall(PetscStrallocpy(r->given ? value : row->preset, &r->text));
  *record = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the default is empty: the caller's value is kept. */
static PetscBool is_absent(const SbOptionRecord *r)
{
  return (PetscBool)(!r->given && !r->text[0]);
}

PetscErrorCode SbOptionBool(const SbScope *scope, const char *key, PetscBool *value)
{
  static const char *const words[] = {"false", "true", "no", "yes", "off",
                                      "on",    "0",    "1",  "n",   "y"};
  const SbOptionRecord *r;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_BOOL, &r));
  if (is_absent(r))
    PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(words); i++) {
    if (strcasecmp(r->text, words[i]))
      continue;
    *value = i % 2 ? PETSC_TRUE : PETSC_FALSE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "%s %s is neither true nor false: %s", r->name, r->text,
          r->row->help);
}

PetscErrorCode SbOptionInt(const SbScope *scope, const char *key, PetscInt *value)
{
  const SbOptionRecord *r;
  char *end;
  long long n;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_INT, &r));
  if (is_absent(r))
    PetscFunctionReturn(PETSC_SUCCESS);
  n = strtoll(r->text, &end, 10);
  PetscCheck(end != r->text && !*end, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s is not an integer%s: %s", r->name, r->text, r->want, r->row->help);
  PetscCall(check_range(r, (PetscReal)n));
  PetscCheck(n >= PETSC_MIN_INT && n <= PETSC_MAX_INT, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s is too large for this build of PETSc, whose integers end at %" PetscInt_FMT,
             r->name, r->text, PETSC_MAX_INT);
  *value = (PetscInt)n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionReal(const SbScope *scope, const char *key, PetscReal *value)
{
  const SbOptionRecord *r;
  PetscReal x;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_REAL, &r));
  if (is_absent(r))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(parse_real(r->text, &x), PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s is not a number%s: %s", r->name, r->text, r->want, r->row->help);
  PetscCall(check_range(r, x));
  *value = x;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionReals(const SbScope *scope, const char *key, PetscReal value[])
{
  const SbOptionRecord *r;
  const char *text;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_REALS, &r));
  if (is_absent(r))
    PetscFunctionReturn(PETSC_SUCCESS);
  n = count_pieces(r->text, ',');
  PetscCheck(n == r->row->count, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s has %" PetscInt_FMT " number%s, needs %" PetscInt_FMT
             "%s with commas between them: %s",
             r->name, r->text, n, n == 1 ? "" : "s", r->row->count, r->want, r->row->help);
  text = r->text;
  for (PetscInt i = 0; i < n; i++) {
    char piece[64];
    PetscReal x;

    PetscCheck(next_piece(&text, ',', sizeof(piece), piece) && parse_real(piece, &x),
               PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s %s: entry %" PetscInt_FMT " is not a number%s: %s", r->name, r->text, i + 1,
               r->want, r->row->help);
    PetscCall(check_range(r, x));
    value[i] = x;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionString(const SbScope *scope, const char *key, size_t size, char value[])
{
  const SbOptionRecord *r;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_STRING, &r));
  PetscCheck(copy_trimmed(r->text, r->text + strlen(r->text), size, value), PETSC_COMM_SELF,
             PETSC_ERR_USER, "%s is longer than %d characters: %s", r->name, (int)size - 1,
             r->row->help);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionNames(const SbScope *scope, const char *key, PetscInt *n,
                             char (**names)[SB_NAME_MAX])
{
  const SbOptionRecord *r;
  const char *text;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_NAMES, &r));
  *n = count_pieces(r->text, ',');
  PetscCall(PetscCalloc1(*n, names));
  text = r->text;
  for (PetscInt i = 0; i < *n; i++) {
    char *name = (*names)[i];

    if (next_piece(&text, ',', SB_NAME_MAX, name) && name[0])
      continue;
    PetscCall(PetscFree(*names));
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER,
            "%s %s: name %" PetscInt_FMT " is empty or longer than %d characters: %s", r->name,
            r->text, i + 1, SB_NAME_MAX - 1, r->row->help);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionChoice(const SbScope *scope, const char *key, void *choice)
{
  const SbOptionRecord *r;
  char **words, near[2 * SB_NAME_MAX];
  int n;
  int found = -1;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_CHOICE, &r));
  if (is_absent(r))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscStrToArray(r->row->range, '|', &n, &words));
  for (int i = 0; i < n; i++)
    if (!strcmp(words[i], r->text))
      found = i;
  SbSuggestNames(r->text, n, (const char *const *)words, sizeof(near), near);
  PetscCall(PetscStrToArrayDestroy(n, words));
  PetscCheck(found >= 0, PETSC_COMM_SELF, PETSC_ERR_USER, "%s %s is not one of %s%s%s%s: %s",
             r->name, r->text, r->row->range, near[0] ? " (did you mean " : "", near,
             near[0] ? "?)" : "", r->row->help);
  *(int *)choice = found;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionSecond(const SbScope *scope, const char *key, PetscBool *second)
{
  int choice = *second;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(scope, key, &choice));
  *second = (PetscBool)(choice == 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionFormulas(const SbScope *scope, const char *key, SbFormula formulas[])
{
  const SbOptionRecord *r;
  const char *text;
  PetscInt n, count;

  PetscFunctionBeginUser;
  PetscCall(text_of(scope, key, SB_OPTION_FORMULA, &r));
  count = r->row->count;
  for (PetscInt i = 0; i < count; i++)
    formulas[i] = NULL;
  if (is_absent(r))
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!strcmp(r->text, "live") && !strcmp(scope->klass, "effect")) {
    for (PetscInt i = 0; i < count; i++)
      PetscCall(SbFormulaNew(r->name, &formulas[i]));
    PetscCall(SbLiveCreate(r->name, r->row, formulas));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // formulas are separated by semicolons or by commas outside parentheses; replace those by
  // semicolons
  if (count > 1 && !strchr(r->text, ';')) {
    int depth = 0;

    for (char *c = r->text; *c; c++) {
      depth += (*c == '(') - (*c == ')');
      if (*c == ',' && !depth)
        *c = ';';
    }
  }
  n = count_pieces(r->text, ';');
  PetscCheck(n == count, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s has %" PetscInt_FMT " formula%s, needs %" PetscInt_FMT "%s: %s", r->name,
             r->text, n, n == 1 ? "" : "s", count,
             count == 1 ? "" : " with semicolons or commas between them", r->row->help);
  text = r->text;
  for (PetscInt i = 0; i < n; i++) {
    char piece[PETSC_MAX_PATH_LEN];

    PetscCheck(next_piece(&text, ';', sizeof(piece), piece) && piece[0], PETSC_COMM_SELF,
               PETSC_ERR_USER,
               "%s %s: formula %" PetscInt_FMT " is empty or longer than %d characters: %s",
               r->name, r->text, i + 1, (int)sizeof(piece) - 1, r->row->help);
    PetscCall(SbFormulaCreate(PETSC_COMM_WORLD, piece, r->name, &formulas[i]));
    if (!strcmp(r->row->unit, "m"))
      formulas[i]->largest = SB_LENGTH_MAX;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOptionCheckEarly(const SbScope *scope, const char *key)
{
  const SbOption *row;
  PetscReal x[SB_OPTION_COUNT_MAX];
  PetscInt n;
  PetscBool b;
  int choice;
  char text[PETSC_MAX_PATH_LEN], (*names)[SB_NAME_MAX] = NULL;
  SbFormula f[SB_OPTION_COUNT_MAX] = {NULL};

  PetscFunctionBeginUser;
  PetscCall(SbOptionNeed(scope, key, &row));
  if (row->kind == SB_OPTION_BOOL)
    PetscCall(SbOptionBool(scope, key, &b));
  if (row->kind == SB_OPTION_INT)
    PetscCall(SbOptionInt(scope, key, &n));
  if (row->kind == SB_OPTION_REAL)
    PetscCall(SbOptionReal(scope, key, x));
  if (row->kind == SB_OPTION_REALS)
    PetscCall(SbOptionReals(scope, key, x));
  if (row->kind == SB_OPTION_STRING)
    PetscCall(SbOptionString(scope, key, sizeof(text), text));
  if (row->kind == SB_OPTION_NAMES)
    PetscCall(SbOptionNames(scope, key, &n, &names));
  if (row->kind == SB_OPTION_CHOICE)
    PetscCall(SbOptionChoice(scope, key, &choice));
  if (row->kind == SB_OPTION_FORMULA)
    PetscCall(SbOptionFormulas(scope, key, f));
  PetscCall(PetscFree(names));
  for (int i = 0; i < SB_OPTION_COUNT_MAX; i++)
    PetscCall(SbFormulaDestroy(&f[i]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
