/*
  Point force: the total on one vertex and on a face, each node its share; time; the same on every number of ranks.
*/
// @ranks 1 3
#include "effect_fixture.h"

static const char *const sets[][2] = {{"top", "plane:0,0,1,1"}, {"tip", "sphere:1,1,1,0.1"}};

int main(int argc, char **argv)
{
  // 9 nodes on the top, symmetric about (.5, .5, 1).
  const PetscReal F[3] = {9, -18, 27}, M[3] = {0.5 * 27 + 18, 9 - 0.5 * 27, -9 - 4.5};
  const PetscReal G[3] = {0, 12, 0}, N[3] = {-12, 0, 12};
  Fixture x, serial;
  SbEffect e, es;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(
    fixture_create(PETSC_COMM_SELF, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &serial));
  PetscCall(effect_create(
    &x, "lift", "-effect_lift_type point_force -effect_lift_on tip,top -effect_lift_vector 9;-18;27", &e));
  PetscCall(effect_create(&serial, "lift", "", &es));
  SB_CHECK(e->linear && e->steady, "constant");
  PetscCall(effect_force(&x, e, 0));
  PetscCall(effect_force(&serial, es, 0));
  PetscCall(check_resultant(&x, F, M, 30, "force on the nodes of the top"));
  PetscCall(check_serial(&x, &serial, 30, "parallel and serial force at a node"));
  for (PetscInt i = 0; i < x.space->nnode_owned; i++) {
    SB_CHECK_NEAR(x.f[3 * i + 2], x.space->node_x[3 * i + 2] > 1 - 1e-9 ? 3 : 0, 1e-14, "share of a node");
  }
  PetscCall(SbEffectDestroy(&e));
  PetscCall(SbEffectDestroy(&es));

  PetscCall(effect_create(
    &x, "poke",
    "-effect_poke_type point_force -effect_poke_on tip -effect_poke_vector 0;3*t;0 -effect_poke_time t", &e));
  SB_CHECK(!e->steady, "changes with time");
  PetscCall(effect_force(&x, e, 2));
  PetscCall(check_resultant(&x, G, N, 12, "force on one vertex"));
  PetscCall(SbEffectDestroy(&e));
  CHECK_MESSAGE(
    effect_create(&x, "bad", "-effect_bad_type point_force -effect_bad_on tip -effect_bad_vector 0;x;0", &e),
    "-effect_bad_vector");
  PetscCall(SbEffectDestroy(&e));
  PetscCall(fixture_destroy(&x));
  PetscCall(fixture_destroy(&serial));
  SB_TEST_END();
}
