/*
  Gravity: weight and its moment about the origin for two boxes; the factor of time; nothing on other ranks' nodes
  lost; with every element, also mixed.
*/
// @ranks 1 3
#include "effect_fixture.h"

static PetscErrorCode check_elements(const char *block, const char *other)
{
  // Unit boxes centred at (0.5, 0.5, 0.5) and (3.5, 0.5, 0.5), 1200 kg each: W = 2400 g at their common centre (2, .5, .5).
  const PetscReal W[3] = {2400.0, -2.0 * 2400, 3.0 * 2400};
  const PetscReal M[3] = {0.5 * W[2] - 0.5 * W[1], 0.5 * W[0] - 2 * W[2], 2 * W[1] - 0.5 * W[0]};
  Fixture x, serial;
  SbEffect e, es;
  PetscReal F2[3], M2[3], F0[3] = {0, 0, 0};

  PetscFunctionBeginUser;
  fixture_use(block, other, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 2, "box:1,1,1:2", 0, NULL, &x));
  PetscCall(fixture_create(PETSC_COMM_SELF, 2, "box:1,1,1:2", 0, NULL, &serial));
  PetscCall(effect_create(&x, "gravity", "-effect_gravity_vector 1,-2,3", &e));
  PetscCall(SbEffectCreate("gravity", &es));
  SB_CHECK(e->linear && e->steady, "constant gravity is steady");
  PetscCall(effect_force(&x, e, 7));
  PetscCall(effect_force(&serial, es, 7));
  PetscCall(check_resultant(&x, W, M, 2400, "weight"));
  PetscCall(check_serial(&x, &serial, 2400, "parallel and serial weight of a node"));
  PetscCall(SbEffectDestroy(&e));
  PetscCall(SbEffectDestroy(&es));

  // Gravity that is switched on over 2 s.
  PetscCall(effect_create(
    &x, "slow", "-effect_slow_type gravity -effect_slow_vector 1,-2,3 -effect_slow_time ramp(t/2)", &e));
  SB_CHECK(!e->steady && e->linear, "gravity with a time function is not steady");
  PetscCall(effect_force(&x, e, 0.5));
  for (int c = 0; c < 3; c++) {
    F2[c] = 0.25 * W[c];
    M2[c] = 0.25 * M[c];
  }
  PetscCall(check_resultant(&x, F2, M2, 2400, "a quarter of the weight"));
  PetscCall(effect_force(&x, e, 0));
  PetscCall(check_resultant(&x, F0, F0, 2400, "no weight at the start"));
  PetscCall(SbEffectDestroy(&e));

  // The default is earth's.
  PetscCall(PetscOptionsClearValue(NULL, "-effect_gravity_vector"));
  PetscCall(SbEffectCreate("gravity", &e));
  PetscCall(effect_force(&x, e, 0));
  PetscCall(resultant(&x, F2, M2));
  SB_CHECK_NEAR(F2[2], -9.81 * 2400, 1e-8, "weight on earth");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(fixture_destroy(&x));
  PetscCall(fixture_destroy(&serial));
  PetscCall(PetscOptionsClear(NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_elements("p1", "p1"));
  PetscCall(check_elements("cr", "cr"));
  PetscCall(check_elements("dg", "p1"));
  PetscCall(check_elements("cr", "dg"));
  SB_TEST_END();
}
