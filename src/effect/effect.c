/*
  effect.c - the registry of effects, and how one comes to be from its name in the scenario.

  An effect is created by its constructor, which fills the table of operations and the private data; then it
  reads its options. Everything that needs the mesh waits for its setup operation.
*/
#include "effect_impl.h"
#include "sblog.h"

PetscFunctionList SbEffectList = NULL;

static const SbOption common_rows[] = {
  {"type", SB_OPTION_STRING, 1, "", "", "", "type of the effect; default: its name"},
  {"from", SB_OPTION_REAL, 1, "s", "", "(-inf, inf)",
   "time from which a load, support or prescribed displacement acts (static: load factor)"},
  {"until", SB_OPTION_REAL, 1, "s", "", "(-inf, inf)",
   "time until which the effect acts; a support is released at the end of the step that reaches it"},
};

static PetscErrorCode forget_types(void)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFunctionListDestroy(&SbEffectList));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRegister(const char *type, PetscErrorCode (*create)(SbEffect), PetscInt nrows,
                                const SbOption rows[])
{
  PetscFunctionBeginUser;
  // The first type brings the clean-up; what all types have in common may be registered again and again.
  if (!SbEffectList) PetscCall(PetscRegisterFinalize(forget_types));
  PetscCall(PetscFunctionListAdd(&SbEffectList, type, create));
  PetscCall(SbOptionsRegister("effect", "", PETSC_STATIC_ARRAY_LENGTH(common_rows), common_rows));
  PetscCall(SbOptionsRegister("effect", type, nrows, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectCreate(const char *name, SbEffect *effect)
{
  PetscErrorCode (*create)(SbEffect) = NULL;
  SbEffect e;
  SbScope scope;
  char type[SB_NAME_MAX];

  PetscFunctionBeginUser;
  *effect = NULL;
  PetscCall(SbScopeSet(&scope, "effect", "", name));
  PetscCall(SbOptionString(&scope, "type", sizeof(type), type));
  if (!type[0]) PetscCall(PetscStrncpy(type, name, sizeof(type)));
  PetscCall(PetscFunctionListFind(SbEffectList, type, &create));
  if (!create) {
    char all[512];

    PetscCall(SbListAdvise(SbEffectList, type, sizeof(all), all));
    SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
            "effect %s: there is no effect of type \"%s\"; set -effect_%s_type to one of %s", name, type,
            name, all);
  }

  PetscCall(PetscNew(&e));
  *effect = e;
  PetscCall(PetscStrncpy(e->name, name, sizeof(e->name)));
  PetscCall(PetscStrncpy(e->type, type, sizeof(e->type)));
  PetscCall(SbLogNamed("Eff", type, &e->event));
  e->linear = PETSC_TRUE;
  e->steady = PETSC_TRUE;
  PetscCall((*create)(e));
  PetscCall(SbScopeSet(&scope, "effect", type, name));
  if (e->ops.setfromoptions) PetscCall((*e->ops.setfromoptions)(e, &scope));

  /* when it acts: what comes and goes are loads and supports */
  e->from = PETSC_MIN_REAL;
  e->until = PETSC_MAX_REAL;
  PetscCall(SbOptionReal(&scope, "from", &e->from));
  PetscCall(SbOptionReal(&scope, "until", &e->until));
  if (e->from == PETSC_MIN_REAL && e->until == PETSC_MAX_REAL) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCheck(e->from < e->until, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-effect_%s_from %g s is not before -effect_%s_until %g s", name, (double)e->from, name,
             (double)e->until);
  PetscCheck(
    (e->ops.force || e->ops.prescribe) && !e->ops.begin_step && !e->ops.hessian, PETSC_COMM_SELF,
    PETSC_ERR_USER,
    "-effect_%s_from and _until are for loads, fixed and prescribed_displacement: effects of type %s "
    "act all the time",
    name, type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define ROUNDING 1e-9 /* of a time: by so much ends of steps may be off */

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
  if (!*effect) PetscFunctionReturn(PETSC_SUCCESS);
  if ((*effect)->ops.destroy) PetscCall((*(*effect)->ops.destroy)(*effect));
  PetscCall(PetscFree(*effect));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPointsAdd(SbContactPoints *list, const SbContactPoint *point)
{
  PetscFunctionBeginUser;
  if (list->n == list->size) {
    list->size = PetscMax(64, 2 * list->size);
    PetscCall(PetscRealloc((size_t)list->size * sizeof(SbContactPoint), &list->point));
  }
  list->point[list->n++] = *point;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectMarkPrescribed(SbEffect e, PetscInt nset, SbSet set[])
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; e->prescribed && i < e->prescribed->n; i++) {
    for (PetscInt k = 0; k < nset; k++) {
      PetscBool same;

      PetscCall(PetscStrcmp(set[k].name, e->prescribed->name[i], &same));
      if (same) set[k].prescribed = PETSC_TRUE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectFormulas(const SbScope *scope, const char *key, PetscInt n, PetscBool position,
                                SbFormula formulas[], PetscBool *steady)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionFormulas(scope, key, formulas));
  for (PetscInt i = 0; i < n; i++) {
    PetscBool uses_time, uses_position;

    PetscCall(SbFormulaUses(formulas[i], &uses_time, &uses_position));
    if (uses_time) *steady = PETSC_FALSE;
    if (uses_position && !position) {
      char option[3 * SB_NAME_MAX];

      PetscCall(SbOptionName(scope, key, sizeof(option), option));
      SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
              "%s: this formula may use the time t only, not x, y or z", option);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
