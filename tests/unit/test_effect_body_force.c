/*
  Body force: force and moment of quadratic densities on everything and on a part; time in the density and as a factor; the
  same on every number of ranks; with every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"lower", "box:-1,-1,-1,2,2,0.5"}, {"block", "body:block"}, {"shell", "plane:0,0,1,0"}};

/* b = (1 + x, 2 y^2, x z) on the unit cube. */
static PetscErrorCode check_whole(Fixture *x, Fixture *serial)
{
  const PetscReal F[3] = {1.5, 2.0 / 3, 0.25};
  // M = integral X x b: (y x z - z 2 y^2, z (1 + x) - x x z, x 2 y^2 - y (1 + x)).
  const PetscReal M[3] = {1.0 / 8 - 1.0 / 3, 3.0 / 4 - 1.0 / 6, 1.0 / 3 - 3.0 / 4};
  SbEffect e, es;

  PetscFunctionBeginUser;
  PetscCall(effect_create(x, "pull", "-effect_pull_type body_force -effect_pull_density 1+x;2*y^2;x*z", &e));
  PetscCall(effect_create(serial, "pull", "", &es));
  SB_CHECK(e->linear && e->steady && !e->ops.tangent, "constant in time");
  PetscCall(effect_force(x, e, 1));
  PetscCall(effect_force(serial, es, 1));
  PetscCall(check_resultant(x, F, M, 1, "quadratic body force"));
  PetscCall(check_serial(x, serial, 1, "parallel and serial body force at a node"));
  PetscCall(SbEffectDestroy(&e));
  PetscCall(SbEffectDestroy(&es));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_part(Fixture *x)
{
  const PetscReal F[3] = {0, 0, 4}, M[3] = {2, -2, 0};
  SbEffect e;

  PetscFunctionBeginUser;
  // 8 N/m^3 on the lower half, also when it is named twice.
  PetscCall(effect_create(
    x, "half", "-effect_half_type body_force -effect_half_on lower,lower -effect_half_density 0;0;8", &e));
  PetscCall(effect_force(x, e, 0));
  PetscCall(check_resultant(x, F, M, 4, "half the cube"));
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    if (x->space->node_x[3 * i + 2] > 0.75) SB_CHECK(x->f[3 * i + 2] == 0, "force outside the set");
  }
  PetscCall(SbEffectDestroy(&e));
  SB_CHECK_ERROR(
    effect_create(x, "flat", "-effect_flat_type body_force -effect_flat_on shell -effect_flat_density 0;0;8",
                  &e),
    PETSC_ERR_USER_INPUT, "-effect_flat_on|set shell|9 vertices");
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_time(Fixture *x)
{
  const PetscReal F[3] = {3 * 5 * 0.5, 0, 0}, M[3] = {0, 3 * 5 * 0.25, -3 * 5 * 0.25};
  SbEffect e;

  PetscFunctionBeginUser;
  PetscCall(effect_create(
    x, "grow", "-effect_grow_type body_force -effect_grow_density t*x;0;0 -effect_grow_time 2+t", &e));
  SB_CHECK(!e->steady && e->linear, "changes with time");
  PetscCall(effect_force(x, e, 0.25));
  PetscCall(effect_force(x, e, 3));
  PetscCall(check_resultant(x, F, M, 10, "density and factor of time"));
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  Fixture x, serial;

  PetscFunctionBeginUser;
  fixture_use(element, element, PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(
    fixture_create(PETSC_COMM_SELF, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &serial));
  PetscCall(check_whole(&x, &serial));
  PetscCall(check_part(&x));
  PetscCall(check_time(&x));
  PetscCall(fixture_destroy(&x));
  PetscCall(fixture_destroy(&serial));
  PetscCall(PetscOptionsClear(NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1"));
  PetscCall(check_element("cr"));
  PetscCall(check_element("dg"));
  SB_TEST_END();
}
