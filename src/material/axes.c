/*
  Axes of laws with fibres: the first along the fibres, the second the sheet's direction less what
  it has along the fibres, the third their normal, f x s. Without a sheet the second is the
  coordinate axis that is most across the fibres, made orthogonal: laws that do not need it give the
  same result with any.

  LEAST: sine of the angle between fibre and sheet below which a sheet has no direction.
*/
#include "fibrous.h"

#define LEAST 1e-6

PetscErrorCode SbFibresDestroy(SbFibres *fibres)
{
  PetscFunctionBeginUser;
  if (!*fibres)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < 6; k++)
    PetscCall(SbFormulaDestroy(&(*fibres)->direction[k]));
  PetscCall(PetscFree(*fibres));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error if an option is given that another one leaves without effect: for the instance itself, or
   both for all bodies. */
static PetscErrorCode check_unused(const SbScope *scope, const char *key, const char *instead)
{
  char name[2][3 * SB_NAME_MAX];
  PetscBool own[2];
  SbScope all;

  PetscFunctionBeginUser;
  SbOptionName(scope, key, sizeof(name[0]), name[0]);
  SbOptionName(scope, instead, sizeof(name[1]), name[1]);
  for (int i = 0; i < 2; i++)
    PetscCall(PetscOptionsHasName(NULL, NULL, name[i], &own[i]));
  if (!own[0] && !own[1] && !strcmp(scope->klass, "body")) {
    SbScopeSet(&all, scope->klass, scope->type, SB_OPTION_DEFAULT);
    SbOptionName(&all, key, sizeof(name[0]), name[0]);
    SbOptionName(&all, instead, sizeof(name[1]), name[1]);
    PetscCall(PetscOptionsHasName(NULL, NULL, name[0], &own[0]));
  }
  PetscCheck(!own[0], PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s and %s both give directions: leave one of them out", name[0], name[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The surfaces of the rule and its angles, if there is one. */
static PetscErrorCode read_rule(SbFibres f, const SbScope *scope)
{
  char(*names)[SB_NAME_MAX];
  char option[3 * SB_NAME_MAX], angle[3 * SB_NAME_MAX];
  PetscInt n;

  PetscFunctionBeginUser;
  SbOptionName(scope, "fibre_surfaces", sizeof(option), option);
  PetscCall(SbOptionNames(scope, "fibre_surfaces", &n, &names));
  PetscCheck(!n || n == 4 || n == 5, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s names %" PetscInt_FMT
             " sets; the rule needs four, outer, inner, base and apex, or five, with the inner "
             "surface of a right ventricle",
             option, n);
  PetscCheck(!n || (!f->field[0][0] && !f->field[1][0]), PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: a rule and fields of the mesh file both give directions: leave one of them out",
             option);
  for (PetscInt i = 0; i < n; i++)
    PetscCall(PetscStrncpy(f->surface[i], names[i], sizeof(f->surface[i])));
  PetscCall(PetscFree(names));
  if (!n) {
    PetscBool angles;

    SbOptionName(scope, "fibre_angles", sizeof(angle), angle);
    PetscCall(PetscOptionsHasName(NULL, NULL, angle, &angles));
    PetscCheck(!angles, PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s is of the rule, which needs surfaces: give %s, too, or leave it out", angle,
               option);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbOptionReals(scope, "fibre_angles", f->angle));
  for (int i = 0; i < 4; i++)
    f->angle[i] *= PETSC_PI / 180;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFibresRead(SbMaterial m, const SbScope *scope, PetscBool sheet)
{
  static const char *const key[2] = {"fibre", "sheet"};
  static const char *const field[2] = {"fibre_field", "sheet_field"};
  PetscBool given = PETSC_FALSE;
  SbFibres f;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&f));
  m->fibres = f;
  PetscCall(SbOptionString(scope, "fibre_field", sizeof(f->field[0]), f->field[0]));
  PetscCall(SbOptionString(scope, "sheet_field", sizeof(f->field[1]), f->field[1]));
  PetscCall(read_rule(f, scope));
  for (int i = 0; i < 2; i++) {
    SbOptionName(scope, key[i], sizeof(f->option[i]), f->option[i]);
    if (f->surface[0][0] || f->field[i][0]) {
      PetscCall(check_unused(scope, key[i], f->surface[0][0] ? "fibre_surfaces" : field[i]));
      continue;
    }
    PetscCall(SbOptionFormulas(scope, key[i], f->direction + 3 * i));
    for (int k = 0; k < 3; k++)
      PetscCheck(!SbFormulaUses(f->direction[3 * i + k], 't'), PETSC_COMM_SELF, PETSC_ERR_USER,
                 "%s: directions are those at rest and may use the place x, y, z only, not t",
                 f->option[i]);
  }

  /* 0,0,0, as scenario.opts has it, is none */
  for (int k = 3; k < 6 && f->direction[k]; k++) {
    PetscReal value = 1;

    if (!SbFormulaUses(f->direction[k], 'x'))
      PetscCall(SbFormulaEval(f->direction[k], 0., NULL, &value));
    given = (PetscBool)(given || value != 0);
  }
  given = (PetscBool)(given || f->field[1][0] || f->surface[0][0]);
  PetscCheck(given || !sheet, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s must be given: with these constants the law %s has directions in the plane of "
             "fibre and sheet",
             f->option[1], scope->type);
  if (!given)
    for (int k = 3; k < 6; k++)
      PetscCall(SbFormulaDestroy(&f->direction[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFibresRequire(SbMaterial m, const SbScope *scope, const char *option)
{
  static const char *const keys[] = {"fibre", "fibre_field", "fibre_surfaces"};
  PetscBool has = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (m->fibres)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(keys) && !has; k++)
    PetscCall(SbOptionGiven(scope, keys[k], &has));
  PetscCheck(has, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: fibres of the law %s have no direction: give -%s_%s_fibre, as 1,0,0, or "
             "fibre_field or fibre_surfaces",
             option, m->type->name, scope->klass, scope->instance);
  PetscCall(SbFibresRead(m, scope, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A direction at x, as a unit vector. */
static PetscErrorCode evaluate(const SbFibres f, int i, const PetscReal x[3],
                               const PetscReal *given, PetscReal a[3])
{
  const char *field = given && f->field[i][0] ? "_field" : "";
  PetscReal largest = 0;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    a[k] = given ? given[3 * i + k] : 0;
    if (!given)
      PetscCall(SbFormulaEval(f->direction[3 * i + k], 0., x, &a[k]));
    PetscCheck(!PetscIsInfOrNanReal(a[k]), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s%s is not finite at (%.4g, %.4g, %.4g) m: it must have a direction at the centre "
               "of every tet",
               f->option[i], field, (double)x[0], (double)x[1], (double)x[2]);
    largest = PetscMax(largest, PetscAbsReal(a[k]));
  }
  PetscCheck(largest > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s%s is a vector of length 0 at (%.4g, %.4g, %.4g) m: it must have a direction at "
             "the centre of every tet",
             f->option[i], field, (double)x[0], (double)x[1], (double)x[2]);
  for (int k = 0; k < 3; k++) /* squares of any length are finite */
    a[k] /= largest;
  (void)SbNormalise(a);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMaterialAxes(SbMaterial m, const PetscReal x[3], const PetscReal given[6],
                              PetscReal Q[9])
{
  const SbFibres f = m->fibres;
  const PetscBool rule = (PetscBool)(f->surface[0][0] != 0);
  PetscReal a[3];
  PetscReal b[3] = {0, 0, 0};
  PetscReal n[3];

  PetscFunctionBeginUser;
  PetscCall(evaluate(f, 0, x, rule || f->field[0][0] ? given : NULL, a));
  if (rule || f->field[1][0]) {
    PetscCall(evaluate(f, 1, x, given, b));
  } else if (f->direction[3]) {
    PetscCall(evaluate(f, 1, x, NULL, b));
  } else {
    int least = PetscAbsReal(a[0]) < PetscAbsReal(a[1]) ? 0 : 1;

    least = PetscAbsReal(a[least]) <= PetscAbsReal(a[2]) ? least : 2;
    b[least] = 1;
  }
  const PetscReal along = SbDot3(a, b);
  for (int k = 0; k < 3; k++)
    b[k] -= along * a[k];
  PetscCheck(SbNormalise(b) > LEAST, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "%s is along %s at (%.4g, %.4g, %.4g) m: fibre and sheet must have two directions",
             f->option[1], f->option[0], (double)x[0], (double)x[1], (double)x[2]);
  SbCross(a, b, n);
  for (int k = 0; k < 3; k++) {
    Q[3 * k] = a[k];
    Q[3 * k + 1] = b[k];
    Q[3 * k + 2] = n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
