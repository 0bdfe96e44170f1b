// @ranks 1
/*
  Classical neo-Hookean: homogeneous states calculated by hand, the energy as printed, the
  small-strain limit, a negative Poisson's ratio.
*/
#include "material_checks.h"

/* psi = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2 */
static PetscReal printed_energy(SbMaterial m, const PetscReal F[9])
{
  const PetscReal J = log(SbMatDet(F));

  return SbMaterialShearModulus(m) / 2 * (SbDot9(F, F) - 3 - 2 * J) +
         SbMaterialVolumetricModulus(m) / 2 * J * J;
}

static void test_states(SbMaterial m)
{
  const PetscReal values[5] = {1e-3, 0.3, 0.8, 1.2, 2};
  const PetscReal mu = SbMaterialShearModulus(m);
  const PetscReal lambda = SbMaterialVolumetricModulus(m);

  for (int k = 0; k < 5; k++) {
    const PetscReal s = values[k];
    const PetscReal q = lambda * log(s) - mu;
    const PetscReal F[9] = {s, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal G[9] = {1, s, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal P[9] = {mu * s + q / s, 0, 0, 0, mu + q, 0, 0, 0, mu + q};
    const PetscReal S[9] = {0, mu * s, 0, mu * s, 0, 0, 0, 0, 0};
    PetscReal A[9], D[9];

    /* to rounding, also where the stress is large */
    stress_of(m, F, A);
    for (int n = 0; n < 9; n++)
      SB_CHECK_NEAR(A[n], P[n], 1e-14 * stress_scale(m) * fabs(log(s)) / s, "uniaxial strain");
    check_stress(m, G, S, "shear stress");
    random_deformation(0.25, D);
    SB_CHECK_NEAR(energy_of(m, D), printed_energy(m, D), 1e-13 * stress_scale(m),
                  "energy as printed");
    SB_CHECK_NEAR(energy_of(m, F), printed_energy(m, F),
                  1e-13 * stress_scale(m) * (1 + log(s) * log(s)), "energy of a uniaxial strain");
  }
}

int main(int argc, char **argv)
{
  static const PetscReal nu[] = {0.3, 0.49, 0};
  SbMaterial m;
  PetscErrorCode ierr;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  for (int k = 0; k < 3; k++) {
    PetscCall(SbMaterialCreateElastic("neohookean", 5e3, nu[k], 1000, &m));
    test_states(m);
    SB_CHECK_ERROR(SbMaterialSetTangent(m, SB_TANGENT_WARPED), PETSC_ERR_USER, "neohookean");
    PetscCall(SbMaterialDestroy(&m));
  }

  /* no energy that is bounded from below */
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  ierr = SbMaterialCreateElastic("neohookean", 5e3, -0.1, 1000, &m);
  PetscCall(PetscPopErrorHandler());
  SB_CHECK(ierr == PETSC_ERR_USER, "nu = -0.1: error %d", (int)ierr);
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
