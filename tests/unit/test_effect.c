/*
  Registry of effects: types by name and by option, unknown types, options of the wrong kind; a
  second registration after a reset of the option table.
*/
// @ranks 1 3
#include "effect_fixture.h"

static PetscErrorCode no_space(SbEffect e, SbSpace space)
{
  PetscFunctionBeginUser;
  (void)e;
  (void)space;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbEffectType bare = {.name = "bare", .ops = {.setup = no_space}};

static PetscErrorCode test_types(void)
{
  SbEffect e;
  PetscBool same;

  PetscFunctionBeginUser;

  // The name is the type unless the option has another one.
  PetscCall(SbEffectCreate("gravity", &e));
  PetscCall(PetscStrcmp(e->type, "gravity", &same));
  SB_CHECK(same, "type %s", e->type);
  SB_CHECK(e->ops.force && !e->ops.tangent && !e->ops.prescribe && !e->ops.setup,
           "operations of gravity");
  SB_CHECK(e->linear && e->steady, "gravity is linear and steady");
  PetscCall(SbEffectDestroy(&e));
  SB_CHECK(!e, "destroy sets NULL");
  PetscCall(SbEffectDestroy(&e));

  PetscCall(
    PetscOptionsInsertString(NULL, "-effect_moon_type gravity -effect_moon_vector 0,0,-1.62"));
  PetscCall(SbEffectCreate("moon", &e));
  PetscCall(PetscStrcmp(e->type, "gravity", &same));
  SB_CHECK(same, "type %s", e->type);
  PetscCall(PetscStrcmp(e->name, "moon", &same));
  SB_CHECK(same, "name %s", e->name);
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_errors(void)
{
  /* Options stay set for the cases behind them. */
  static const struct {
    const char *options, *name;
    PetscErrorCode code;
    const char *words;
  } cases[] = {
    {"", "gravty", PETSC_ERR_USER_INPUT, "gravity"},
    {"", "qqqqqqqqqqqq", PETSC_ERR_USER_INPUT,
     "body_force"}, /* no similar name: the message lists all */
    {"-effect_lid_type tractoin", "lid", PETSC_ERR_USER_INPUT, "-effect_lid_type"},
    {"", "lid", PETSC_ERR_USER_INPUT, "traction"},
    /* neither a traction nor a total force; a position where only time is valid; a missing required
       option */
    {"-effect_lid_type traction -effect_lid_on top", "lid", PETSC_ERR_USER_INPUT,
     "-effect_lid_total"},
    {"-effect_air_type pressure -effect_air_on top -effect_air_value 5*x", "air",
     PETSC_ERR_USER_INPUT, "-effect_air_value"},
    {"-effect_hold_type fixed", "hold", PETSC_ERR_USER, "-effect_hold_on"},
    {"-effect_push_type prescribed_displacement -effect_push_on top", "push", PETSC_ERR_USER_INPUT,
     "-effect_push_displacement"},
    {"-effect_push_angle 10 -effect_push_axis 0,0,0", "push", PETSC_ERR_USER_INPUT,
     "-effect_push_axis"},
    {"-effect_thick_type damping -effect_thick_alpha -1", "thick", PETSC_ERR_USER,
     "-effect_thick_alpha"},
  };
  SbEffect e;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    PetscCall(PetscOptionsInsertString(NULL, cases[k].options));
    SB_CHECK_ERROR(SbEffectCreate(cases[k].name, &e), cases[k].code, cases[k].words);
    PetscCall(SbEffectDestroy(&e));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbEffect e;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(test_types());
  PetscCall(test_errors());

  /* a type that a program adds */
  PetscCall(SbEffectRegister(&bare));
  PetscCall(SbEffectCreate("bare", &e));
  SB_CHECK(e->ops.setup == no_space, "operations of a new type");
  SB_CHECK(e->linear && e->steady && !e->ncolumn, "defaults");
  PetscCall(SbEffectDestroy(&e));

  // A fresh option table needs the types again.
  PetscCall(SbOptionsReset());
  PetscCall(SbEffectRegister(&SbEffectGravity));
  PetscCall(SbEffectCreate("gravity", &e));
  SB_CHECK(e != NULL, "after a reset");
  PetscCall(SbEffectDestroy(&e));
  SB_TEST_END();
}
