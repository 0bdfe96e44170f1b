// @ranks 1
/*
  Stable neo-Hookean: the energy as published, homogeneous states calculated by hand, the
  small-strain limit.
*/
#include "material_checks.h"

/* Smith, de Goes, Kim 2018: psi = a/2 (I - 3) + b/2 (J - alpha)^2 - a/2 log(I + 1), alpha = 1 +
   3a/(4b). */
static PetscReal printed_energy(SbMaterial m, const PetscReal F[9])
{
  const PetscReal a = 4 * SbMaterialShearModulus(m) / 3;
  const PetscReal b = SbMaterialVolumetricModulus(m) + 5 * SbMaterialShearModulus(m) / 6;
  const PetscReal alpha = 1 + 3 * a / (4 * b);
  const PetscReal I1 = SbDot9(F, F);
  const PetscReal J = SbMatDet(F);

  return a / 2 * (I1 - 3) + b / 2 * ((J - alpha) * (J - alpha) - (1 - alpha) * (1 - alpha)) -
         a / 2 * log((I1 + 1) / 4);
}

static void test_states(SbMaterial m)
{
  const PetscReal values[5] = {-0.4, 0.5, 0.8, 1.2, 2};
  const PetscReal mu = SbMaterialShearModulus(m);
  const PetscReal b = SbMaterialVolumetricModulus(m) + 5 * mu / 6;

  for (int k = 0; k < 5; k++) {
    const PetscReal s = values[k];
    const PetscReal g = values[k];
    const PetscReal shear = 4 * mu / 3 * (s * s + 2) / (s * s + 3);
    const PetscReal p = b * (s - 1) - mu;
    const PetscReal F[9] = {s, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal G[9] = {1, g, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal P[9] = {shear * s + p, 0, 0, 0, shear + p * s, 0, 0, 0, shear + p * s};
    const PetscReal h = 4 * mu / 3 * (3 + g * g) / (4 + g * g);
    const PetscReal S[9] = {h - mu, h * g, 0, mu * g, h - mu, 0, 0, 0, h - mu};
    PetscReal D[9];

    check_stress(m, F, P, "uniaxial stress");
    check_stress(m, G, S, "shear stress");
    random_deformation(0.8, D);
    SB_CHECK_NEAR(energy_of(m, D), printed_energy(m, D), 1e-12 * stress_scale(m),
                  "energy as printed");
  }
}

int main(int argc, char **argv)
{
  SbMaterial m;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  for (int k = 0; k < 3; k++) {
    PetscCall(SbMaterialCreateElastic("stable_neohookean", 5e3,
                                      k == 0   ? 0.3
                                      : k == 1 ? 0.49
                                               : 0,
                                      1000, &m));
    test_states(m);
    check_inversion(m, PETSC_TRUE);
    SB_CHECK_ERROR(SbMaterialSetTangent(m, SB_TANGENT_WARPED), PETSC_ERR_USER, "stable_neohookean");
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
