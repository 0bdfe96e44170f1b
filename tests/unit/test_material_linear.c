// @ranks 1
/* Linear elasticity: homogeneous states, and the false stress that it must show under
   rotation. */
#include "material_checks.h"

static void test_states(SbMaterial m)
{
  const PetscReal stretches[4] = {0.5, 0.8, 1.2, 2};
  const PetscReal l = SbMaterialVolumetricModulus(m);
  const PetscReal mu = SbMaterialShearModulus(m);

  for (int k = 0; k < 4; k++) {
    const PetscReal a = stretches[k];
    const PetscReal g = a - 0.3;
    const PetscReal c = cos(a);
    const PetscReal s = sin(a);
    const PetscReal F[9] = {a, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal G[9] = {1, g, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal Q[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
    const PetscReal p = l * (a - 1);
    const PetscReal P[9] = {p + 2 * mu * (a - 1), 0, 0, 0, p, 0, 0, 0, p};
    const PetscReal S[9] = {0, mu * g, 0, mu * g, 0, 0, 0, 0, 0};
    const PetscReal x = 2 * (mu + l) * (c - 1);
    const PetscReal T[9] = {x, 0, 0, 0, x, 0, 0, 0, 2 * l * (c - 1)};

    check_stress(m, F, P, "uniaxial stress");
    SB_CHECK_NEAR(energy_of(m, F), (l / 2 + mu) * (a - 1) * (a - 1),
                  1e-12 * SbMaterialYoungModulus(m), "energy");
    check_stress(m, G, S, "shear stress");
    check_stress(m, Q, T, "false stress of a rotation");
  }
}

int main(int argc, char **argv)
{
  static const PetscReal nu[3] = {0.3, 0.4999, -0.4};
  SbMaterial m;
  PetscReal F[9], H[9], R[9], dP[9], P[9], C[81], CH[9];
  SbPack f[9], r[9];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  for (int k = 0; k < 3; k++) {
    PetscCall(SbMaterialCreateElastic("linear", 5e3, nu[k], 1000, &m));
    SB_CHECK(m->linear, "flags");
    test_states(m);
    for (int t = 0; t < 50; t++) {
      random_deformation(0.3, F);
      for (int i = 0; i < 9; i++)
        H[i] = uniform();
      tangent_of(m, F, C);
      contract(C, H, CH);
      damping_of(m, F, H, dP);
      SB_CHECK(difference(9, CH, dP) < 1e-13 * stress_scale(m), "damping is %g from C : H",
               difference(9, CH, dP));

      /* the damping stress of F - I is the stress */
      for (int i = 0; i < 9; i++)
        H[i] = F[i] - (i % 4 == 0);
      stress_of(m, F, P);
      damping_of(m, F, H, dP);
      SB_CHECK(difference(9, P, dP) < 1e-13 * stress_scale(m), "damping is %g from the stress",
               difference(9, P, dP));
    }
    batch(F, f);
    m->ops.frame(m, (const SbPack *)f, r);
    SbPackGet(9, (const SbPack *)r, 2, R);
    for (int i = 0; i < 9; i++)
      SB_CHECK(R[i] == (i % 4 == 0), "the frame of the linear law is not I");
    SB_CHECK_ERROR(SbMaterialSetTangent(m, SB_TANGENT_WARPED), PETSC_ERR_USER, "linear");
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
