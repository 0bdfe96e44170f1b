/*
  effect.c - the registry of effects, and their creation by name.

  An effect gets the operations of its type and private data of zeros; then it reads its options.
  Everything that needs the mesh waits for its setup operation.
*/
#include "effect_impl.h"

static const SbEffectType *types[SB_EFFECT_TYPES];
static PetscInt ntype;

const SbOption SbEffectRows[] = {
  {"type", SB_OPTION_STRING, 1, "", "", "", "type of the effect; default: its name"},
  {"from", SB_OPTION_REAL, 1, "s", "", "(-inf, inf)",
   "time from which a load, support or prescribed displacement acts (static: load factor)"},
  {"until", SB_OPTION_REAL, 1, "s", "", "(-inf, inf)",
   "time until which the effect acts; a support is released at the end of the step that reaches "
   "it"},
  {0},
};

PetscErrorCode SbEffectRegister(const SbEffectType *type)
{
  PetscInt i = 0;

  PetscFunctionBeginUser;

  // Repeated registration is allowed: SbOptionsReset() may have removed the options.
  while (i < ntype && types[i] != type)
    i++;
  PetscCheck(i < SB_EFFECT_TYPES, PETSC_COMM_SELF, PETSC_ERR_PLIB, "No room for effects of type %s",
             type->name);
  if (i == ntype)
    types[ntype++] = type;
  PetscCall(SbOptionsRegister("effect", "", PETSC_DECIDE, SbEffectRows));
  PetscCall(SbOptionsRegister("effect", type->name, type->nrow, type->row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbEffectTypes(const char *names[SB_EFFECT_TYPES])
{
  for (PetscInt i = 0; i < ntype; i++)
    names[i] = types[i]->name;
  return ntype;
}

PetscErrorCode SbEffectCreate(const char *name, SbEffect *effect)
{
  const SbEffectType *is = NULL;
  SbEffect e;
  SbScope scope;
  char type[SB_NAME_MAX];

  PetscFunctionBeginUser;
  *effect = NULL;
  SbScopeSet(&scope, "effect", "", name);
  PetscCall(SbOptionString(&scope, "type", sizeof(type), type));
  if (!type[0])
    PetscCall(PetscStrncpy(type, name, sizeof(type)));
  for (PetscInt i = 0; i < ntype; i++)
    if (!strcmp(types[i]->name, type))
      is = types[i];
  if (!is) {
    const char *names[SB_EFFECT_TYPES];
    char all[512];

    SbSuggestName(type, SbEffectTypes(names), names, sizeof(all), all);
    SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
            "effect %s: there is no effect of type \"%s\"; set -effect_%s_type to one of %s", name,
            type, name, all);
  }

  PetscCall(PetscNew(&e));
  *effect = e;
  PetscCall(PetscStrncpy(e->name, name, sizeof(e->name)));
  PetscCall(PetscStrncpy(e->type, type, sizeof(e->type)));
  PetscCall(SbLogNamed("Eff", type, &e->event));
  e->linear = e->steady = PETSC_TRUE;
  e->ops = is->ops;
  e->column = is->column;
  e->ncolumn = is->ncolumn;
  if (is->size)
    PetscCall(PetscCalloc(is->size, &e->data));
  SbScopeSet(&scope, "effect", type, name);

  /* the sets that it acts on, and the factor on a load */
  for (PetscInt i = 0; i < is->nrow; i++)
    if (!strcmp(is->row[i].key, "on")) {
      SbOptionName(&scope, "on", sizeof(e->on.option), e->on.option);
      PetscCall(SbOptionNames(&scope, "on", &e->on.n, &e->on.name));
    } else if (!strcmp(is->row[i].key, "to")) {
      SbOptionName(&scope, "to", sizeof(e->to.option), e->to.option);
      PetscCall(SbOptionNames(&scope, "to", &e->to.n, &e->to.name));
    } else if (!strcmp(is->row[i].key, "time"))
      PetscCall(SbEffectFormulas(e, &scope, "time", 1, PETSC_FALSE, &e->time));
  if (e->ops.setfromoptions)
    PetscCall((*e->ops.setfromoptions)(e, &scope));

  /* time in which it acts, for loads and supports */
  e->from = PETSC_MIN_REAL;
  e->until = PETSC_MAX_REAL;
  PetscCall(SbOptionReal(&scope, "from", &e->from));
  PetscCall(SbOptionReal(&scope, "until", &e->until));
  if (e->from == PETSC_MIN_REAL && e->until == PETSC_MAX_REAL)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(e->from < e->until, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-effect_%s_from %g s is not before -effect_%s_until %g s", name, (double)e->from,
             name, (double)e->until);
  PetscCheck((e->ops.force || e->ops.prescribe) && !e->contact, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-effect_%s_from and _until are for loads, fixed and prescribed_displacement: effects "
             "of type %s "
             "act all the time",
             name, type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define ROUNDING 1e-9   /* relative rounding of the end of a step */
#define DIFFERENCE 1e-6 /* of the run: half the time over which a formula is differentiated */

PetscBool SbEffectActs(SbEffect e, PetscReal t)
{
  const PetscReal slack = ROUNDING * PetscAbsReal(t);

  return (PetscBool)(t > e->from + slack && t <= e->until + slack);
}

PetscBool SbEffectActsAfter(SbEffect e, PetscReal t)
{
  const PetscReal slack = ROUNDING * PetscAbsReal(t);

  return (PetscBool)(t >= e->from - slack && t < e->until - slack);
}

PetscErrorCode SbEffectDestroy(SbEffect *effect)
{
  PetscFunctionBeginUser;
  if (!*effect)
    PetscFunctionReturn(PETSC_SUCCESS);
  if ((*effect)->ops.destroy)
    PetscCall((*(*effect)->ops.destroy)(*effect));
  for (PetscInt i = 0; i < (*effect)->nformula; i++)
    PetscCall(SbFormulaDestroy(&(*effect)->formula[i]));
  PetscCall(PetscFree((*effect)->on.name));
  PetscCall(PetscFree((*effect)->to.name));
  PetscCall(PetscFree((*effect)->data));
  PetscCall(PetscFree(*effect));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectValueAt(SbEffect e, SbFormula formula, PetscReal t, PetscReal *value)
{
  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(formula, t, NULL, value));
  if (!e->dynamic && !SbFormulaUses(formula, 't'))
    *value *= t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRateAt(SbEffect e, SbFormula formula, PetscReal t, PetscReal *rate)
{
  PetscReal end = 1;
  PetscReal before, after, first, last;

  PetscFunctionBeginUser;
  *rate = 0;
  if (!e->dynamic || !SbFormulaUses(formula, 't'))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-ts_max_time", &end, NULL));
  before = PetscMax(PetscMin(t, 0), t - DIFFERENCE * end);
  after = t + DIFFERENCE * end;
  PetscCall(SbFormulaEval(formula, before, NULL, &first));
  PetscCall(SbFormulaEval(formula, after, NULL, &last));
  *rate = (last - first) / (after - before);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectFormulas(SbEffect e, const SbScope *scope, const char *key, PetscInt n,
                                PetscBool position, SbFormula formulas[])
{
  PetscFunctionBeginUser;
  e->nformula += n;
  PetscCall(SbOptionFormulas(scope, key, e->formula + e->nformula - n));
  for (PetscInt i = 0; i < n; i++) {
    formulas[i] = e->formula[e->nformula - n + i];
    if (SbFormulaUses(formulas[i], 't'))
      e->steady = PETSC_FALSE;
    if (SbFormulaUses(formulas[i], 'x') && !position) {
      char option[3 * SB_NAME_MAX];

      SbOptionName(scope, key, sizeof(option), option);
      SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
              "%s: this formula may use the time t only, not x, y or z", option);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPathRead(SbEffect e, const SbScope *scope, PetscBool position, SbPath *path)
{
  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(e, scope, "displacement", 3, position, path->displacement));
  PetscCall(SbEffectFormulas(e, scope, "angle", 1, PETSC_FALSE, &path->angle));
  PetscCall(SbOptionReals(scope, "axis", path->axis));
  PetscCall(SbOptionReals(scope, "axis_point", path->point));
  PetscCheck(SbNormalise(path->axis) > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_axis: 0,0,0 is no direction", e->name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbEffectsWithoutPotential(PetscInt n, const SbEffect effect[], size_t size, char text[])
{
  text[0] = 0;
  for (PetscInt e = 0; e < n; e++)
    if (effect[e]->no_potential)
      SbAppend(size, text, "%s%s", text[0] ? ", " : "", effect[e]->name);
}
