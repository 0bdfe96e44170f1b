/*
  Traction: force and moment on one face and on two faces that are named with an overlap; a total force; a dead load does
  not follow the deformation; time; the same on every number of ranks; with every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {
  {"top", "plane:0,0,1,1"}, {"east", "plane:1,0,0,1"}, {"tip", "sphere:1,1,1,0.1"}};

static PetscErrorCode check_vector(Fixture *x, Fixture *serial)
{
  // q = (x^2, 1 + y, x y) on z = 1: F and M = integral (y q_z - q_y, q_x - x q_z, x q_y - y q_x).
  const PetscReal F[3] = {1.0 / 3, 1.5, 0.25};
  const PetscReal M[3] = {1.0 / 6 - 1.5, 1.0 / 3 - 1.0 / 6, 0.75 - 1.0 / 6};
  SbEffect e, es;

  PetscFunctionBeginUser;
  PetscCall(effect_create(
    x, "wind", "-effect_wind_type traction -effect_wind_on top -effect_wind_vector x^2;1+y;x*y", &e));
  PetscCall(effect_create(serial, "wind", "", &es));
  SB_CHECK(e->linear && e->steady && !e->ops.tangent, "constant in time");
  PetscCall(effect_force(x, e, 1));
  PetscCall(effect_force(serial, es, 1));
  PetscCall(check_resultant(x, F, M, 1, "traction on the top"));
  PetscCall(check_serial(x, serial, 1, "parallel and serial traction at a node"));

  // The load is the same on a deformed body.
  deform(x, 1);
  deform(serial, 0);
  PetscCall(effect_force(x, e, 1));
  PetscCall(check_serial(x, serial, 1, "dead load"));
  deform(x, 0);
  PetscCall(SbEffectDestroy(&e));
  PetscCall(SbEffectDestroy(&es));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_total(Fixture *x)
{
  // 6 N over two faces of 1 m^2 each, centred at (.5, .5, 1) and (1, .5, .5): it acts at (.75, .5, .75).
  const PetscReal F[3] = {6, -12, 18};
  const PetscReal M[3] = {0.5 * F[2] - 0.75 * F[1], 0.75 * F[0] - 0.75 * F[2], 0.75 * F[1] - 0.5 * F[0]};
  const PetscReal G[3] = {3 * (F[0] + 2), 3 * F[1], 3 * F[2]};
  const PetscReal N[3] = {3 * M[0], 3 * (M[1] + 2 * 0.75), 3 * (M[2] - 2 * 0.5)};
  SbEffect e;

  PetscFunctionBeginUser;
  PetscCall(effect_create(
    x, "push", "-effect_push_type traction -effect_push_on top,east,top -effect_push_total 6,-12,18", &e));
  PetscCall(effect_force(x, e, 0));
  PetscCall(check_resultant(x, F, M, 20, "total force over two faces"));
  PetscCall(SbEffectDestroy(&e));
  // Total and vector together, 2 N in x by the latter, and three times that at t = 2.
  PetscCall(effect_create(x, "push", "-effect_push_vector 1;0;0 -effect_push_time 1+t", &e));
  SB_CHECK(!e->steady, "changes with time");
  PetscCall(effect_force(x, e, 2));
  PetscCall(check_resultant(x, G, N, 20, "total force and traction"));
  PetscCall(SbEffectDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element, PetscBool held)
{
  Fixture x, serial;
  SbEffect e;

  PetscFunctionBeginUser;
  fixture_use(element, element, held);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(
    fixture_create(PETSC_COMM_SELF, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &serial));
  PetscCall(check_vector(&x, &serial));
  PetscCall(check_total(&x));
  SB_CHECK_ERROR(
    effect_create(&x, "dot", "-effect_dot_type traction -effect_dot_on tip -effect_dot_total 0,0,1", &e),
    PETSC_ERR_USER_INPUT, "-effect_dot_on|set tip|1 vertices|0 boundary|0 tetrahedra");
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
  PetscCall(check_element("p1", PETSC_FALSE));
  PetscCall(check_element("cr", PETSC_FALSE));
  PetscCall(check_element("dg", PETSC_FALSE));
  // A face with a support bears loads as any other.
  PetscCall(check_element("dg", PETSC_TRUE));
  SB_TEST_END();
}
