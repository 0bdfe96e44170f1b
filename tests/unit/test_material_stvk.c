// @ranks 1
/* St. Venant-Kirchhoff: published homogeneous states. */
#include "material_checks.h"

static void test_states(SbMaterial m)
{
  const PetscReal values[5] = {0.1, 0.5, 0.8, 1.2, 2};
  const PetscReal l = SbMaterialVolumetricModulus(m);
  const PetscReal mu = SbMaterialShearModulus(m);

  for (int k = 0; k < 5; k++) {
    const PetscReal a = values[k];
    const PetscReal g = values[k];
    const PetscReal t = l * (a * a - 1) / 2;
    const PetscReal q = l * g * g / 2;
    const PetscReal F[9] = {a, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal G[9] = {1, g, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal P[9] = {(l / 2 + mu) * a * (a * a - 1), 0, 0, 0, t, 0, 0, 0, t};

    /* E = [0 g/2; g/2 g^2/2] */
    const PetscReal S[9] = {
      q + mu * g * g, mu * g + (l / 2 + mu) * g * g * g, 0, mu * g, q + mu * g * g, 0, 0, 0, q};

    check_stress(m, F, P, "uniaxial stress");
    SB_CHECK_NEAR(energy_of(m, F), (l / 2 + mu) * (a * a - 1) * (a * a - 1) / 4,
                  1e-12 * SbMaterialYoungModulus(m), "energy");
    check_stress(m, G, S, "shear stress");
  }
}

int main(int argc, char **argv)
{
  SbMaterial m;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  for (int k = 0; k < 3; k++) {
    PetscCall(SbMaterialCreateElastic("stvk", 5e3, k == 0 ? 0.3 : k == 1 ? 0.49 : 0, 1000, &m));
    test_states(m);
    SB_CHECK_ERROR(SbMaterialSetTangent(m, SB_TANGENT_WARPED), PETSC_ERR_USER, "stvk");
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
