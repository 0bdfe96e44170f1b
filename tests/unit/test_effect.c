/*
  Registry of effects: types by name and by option, unknown types, options of the wrong kind; a second
  registration after a reset of the option table.
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
  SB_CHECK(e->ops.force && !e->ops.tangent && !e->ops.prescribe && !e->ops.setup, "operations of gravity");
  SB_CHECK(e->linear && e->steady, "gravity is linear and steady");
  PetscCall(SbEffectDestroy(&e));
  SB_CHECK(!e, "destroy sets NULL");
  PetscCall(SbEffectDestroy(&e));

  PetscCall(PetscOptionsInsertString(NULL, "-effect_moon_type gravity -effect_moon_vector 0,0,-1.62"));
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
  SbEffect e;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(SbEffectCreate("gravty", &e), PETSC_ERR_USER_INPUT, "gravity");
  PetscCall(SbEffectDestroy(&e));
  // No similar name: the message lists all.
  SB_CHECK_ERROR(SbEffectCreate("qqqqqqqqqqqq", &e), PETSC_ERR_USER_INPUT, "body_force");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsInsertString(NULL, "-effect_lid_type tractoin"));
  SB_CHECK_ERROR(SbEffectCreate("lid", &e), PETSC_ERR_USER_INPUT, "-effect_lid_type");
  SB_CHECK_ERROR(SbEffectCreate("lid", &e), PETSC_ERR_USER_INPUT, "traction");
  PetscCall(SbEffectDestroy(&e));

  // Neither a traction nor a total force; a position where only time is valid; a missing required option.
  PetscCall(PetscOptionsInsertString(NULL, "-effect_lid_type traction -effect_lid_on top"));
  SB_CHECK_ERROR(SbEffectCreate("lid", &e), PETSC_ERR_USER_INPUT, "-effect_lid_total");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(
    PetscOptionsInsertString(NULL, "-effect_air_type pressure -effect_air_on top -effect_air_value 5*x"));
  SB_CHECK_ERROR(SbEffectCreate("air", &e), PETSC_ERR_USER_INPUT, "-effect_air_value");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsInsertString(NULL, "-effect_hold_type fixed"));
  SB_CHECK_ERROR(SbEffectCreate("hold", &e), PETSC_ERR_USER, "-effect_hold_on");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsInsertString(NULL, "-effect_push_type prescribed_displacement -effect_push_on top"));
  SB_CHECK_ERROR(SbEffectCreate("push", &e), PETSC_ERR_USER_INPUT, "-effect_push_displacement");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsInsertString(NULL, "-effect_push_angle 10 -effect_push_axis 0,0,0"));
  SB_CHECK_ERROR(SbEffectCreate("push", &e), PETSC_ERR_USER_INPUT, "-effect_push_axis");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(PetscOptionsInsertString(NULL, "-effect_thick_type damping -effect_thick_alpha -1"));
  SB_CHECK_ERROR(SbEffectCreate("thick", &e), PETSC_ERR_USER, "-effect_thick_alpha");
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_registration(void)
{
  SbEffect e;

  PetscFunctionBeginUser;
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbEffectRegister(&SbEffectGravity));
  PetscCall(SbEffectRegister(&SbEffectBodyForce));
  PetscCall(SbEffectRegister(&SbEffectTraction));
  PetscCall(SbEffectRegister(&SbEffectPressure));
  PetscCall(SbEffectRegister(&SbEffectPointForce));
  PetscCall(SbEffectRegister(&SbEffectFixed));
  PetscCall(SbEffectRegister(&SbEffectPrescribedDisplacement));
  PetscCall(SbEffectRegister(&SbEffectDamping));
  PetscCall(test_types());
  PetscCall(test_errors());
  PetscCall(test_registration());
  SB_TEST_END();
}
