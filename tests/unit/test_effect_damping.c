/*
  Damping: coefficients for the named bodies, for all bodies by default, summed over effects;
  invalid body names; dissipated power, with every element.
*/
// @ranks 1 3
#include "effect_fixture.h"

/* Body b has alpha[b] and beta[b]. */
static void check_bodies(const Fixture *x, const PetscReal alpha[2], const PetscReal beta[2])
{
  for (PetscInt b = 0; b < 2; b++) {
    SB_CHECK_NEAR(x->space->alpha[b], alpha[b], 0, "alpha");
    SB_CHECK_NEAR(x->space->beta[b], beta[b], 0, "beta");
  }
}

/* Dissipated power v.C v, with C v the force that damping adds; a translation has the
   mass-proportional part only. */
static PetscErrorCode check_power(const char *block, const char *other, PetscBool held)
{
  static const char *const sets[][2] = {{"bottom", "plane:0,0,1,0"}};
  Fixture x;
  SbEffect e[2];
  SbStage stage = {.shift_k = 1};
  PetscReal *v, sum[2], all[2];

  PetscFunctionBeginUser;
  fixture_use(block, other, held);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 2, "box:1,1,1:2", 1, sets, &x));
  PetscCall(
    effect_create(&x, "damping", "-effect_damping_alpha 0.5 -effect_damping_beta 0.25", &e[0]));
  PetscCall(effect_create(&x, "thick",
                          "-effect_thick_type damping -effect_thick_on other -effect_thick_alpha 1 "
                          "-effect_thick_beta 0.01",
                          &e[1]));
  PetscCall(PetscMalloc1(3 * x.space->nnode, &v));
  deform(&x, 0.1);
  stage.u = x.u;
  for (int rigid = 0; rigid < 2; rigid++) {
    for (PetscInt i = 0; i < 3 * x.space->nnode; i++)
      v[i] = rigid ? 2 : PetscSinReal(2 * x.space->node_x[i] + (PetscReal)(i % 3) * x.u[i / 3 * 3]);

    // Minus the elastic force, plus the total force: the difference is C v.
    PetscCall(PetscArrayzero(x.f, 3 * x.space->nnode));
    stage.v = NULL;
    PetscCall(SbSpaceAddInternalForce(x.space, &stage, x.f));
    for (PetscInt i = 0; i < 3 * x.space->nnode; i++)
      x.f[i] = -x.f[i];
    stage.v = v;
    PetscCall(SbSpaceAddInternalForce(x.space, &stage, x.f));
    SbSpaceAddInertia(x.space, &stage, x.f);
    sum[0] = 0;
    for (PetscInt i = 0; i < 3 * x.space->nnode_owned; i++)
      sum[0] += v[i] * x.f[i];
    PetscCall(SbSpaceDampingPower(x.space, x.u, v, &sum[1]));
    PetscCallMPI(MPI_Allreduce(sum, all, 2, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
    SB_CHECK_NEAR(all[0], all[1], 1e-12 * all[1], "damping power");

    // 1200 kg with alpha 0.5/s and as much with 1.5/s, v^2 = 12 m^2/s^2.
    if (rigid)
      SB_CHECK_NEAR(all[1], 12 * DENSITY * (0.5 + 1.5), 1e-8, "damping power of a translation");
    SB_CHECK(all[1] > 1, "damping power %g W shows nothing", all[1]);
  }
  PetscCall(PetscFree(v));
  for (int i = 0; i < 2; i++)
    PetscCall(SbEffectDestroy(&e[i]));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Fixture x;
  SbEffect e[3];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_power("p1", "p1", PETSC_FALSE));
  PetscCall(check_power("cr", "p1", PETSC_FALSE));
  PetscCall(check_power("dg", "cr", PETSC_TRUE));
  PetscCall(check_power("p1", "dg", PETSC_FALSE));
  PetscCall(check_power("p2", "cr", PETSC_TRUE));
  fixture_use("p1", "p1", PETSC_FALSE);
  PetscCall(fixture_create(PETSC_COMM_WORLD, 2, "box:1,1,1:2", 0, NULL, &x));
  check_bodies(&x, (const PetscReal[2]){0, 0}, (const PetscReal[2]){0, 0});
  PetscCall(
    effect_create(&x, "damping", "-effect_damping_alpha 0.5 -effect_damping_beta 0.25", &e[0]));
  check_bodies(&x, (const PetscReal[2]){0.5, 0.5}, (const PetscReal[2]){0.25, 0.25});
  PetscCall(effect_create(&x, "thick",
                          "-effect_thick_type damping -effect_thick_on other,other "
                          "-effect_thick_alpha 1 -effect_thick_beta 0.01",
                          &e[1]));
  check_bodies(&x, (const PetscReal[2]){0.5, 1.5}, (const PetscReal[2]){0.25, 0.25 + 0.01});
  for (int i = 0; i < 2; i++) {
    SB_CHECK(!e[i]->ops.force && !e[i]->ops.tangent && !e[i]->ops.accept,
             "nothing to do at run time");
    PetscCall(SbEffectDestroy(&e[i]));
  }
  SB_CHECK_ERROR(
    effect_create(&x, "wrong", "-effect_wrong_type damping -effect_wrong_on blok", &e[2]),
    PETSC_ERR_USER_INPUT, "block");
  PetscCall(SbEffectDestroy(&e[2]));
  check_bodies(&x, (const PetscReal[2]){0.5, 1.5}, (const PetscReal[2]){0.25, 0.25 + 0.01});
  PetscCall(fixture_destroy(&x));
  SB_TEST_END();
}
