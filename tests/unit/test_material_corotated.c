// @ranks 1
/* Co-rotated material: published homogeneous states, the three tangents, degenerate F. */
#include "material_checks.h"

static void test_states(SbMaterial m)
{
  const PetscReal values[5] = {0.1, 0.5, 0.8, 1.2, 2};
  const PetscReal l = SbMaterialVolumetricModulus(m);
  const PetscReal mu = SbMaterialShearModulus(m);

  for (int k = 0; k < 5; k++) {
    const PetscReal a = values[k];
    const PetscReal g = values[k];
    const PetscReal r = sqrt(4 + g * g);
    const PetscReal s = g / r;
    const PetscReal c = 2 / r;
    const PetscReal q = l * (r - 2);
    const PetscReal F[9] = {a, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal G[9] = {1, g, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal P[9] = {(l + 2 * mu) * (a - 1), 0, 0, 0, l * (a - 1), 0, 0, 0, l * (a - 1)};

    /* F = R S with R = [c s; -s c]: P = 2 mu (F - R) + q R */
    const PetscReal S[9] = {2 * mu * (1 - c) + q * c,
                            2 * mu * (g - s) + q * s,
                            0,
                            2 * mu * s - q * s,
                            2 * mu * (1 - c) + q * c,
                            0,
                            0,
                            0,
                            q};

    check_stress(m, F, P, "uniaxial stress");
    SB_CHECK_NEAR(energy_of(m, F), (l / 2 + mu) * (a - 1) * (a - 1),
                  1e-12 * SbMaterialYoungModulus(m), "energy");
    check_stress(m, G, S, "shear stress");
  }
}

/* warped: R hooke(sym(R^T H)), from the frame and from the damping stress. */
static PetscErrorCode test_warped(SbMaterial m)
{
  PetscFunctionBeginUser;
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_WARPED));
  SB_CHECK(m->ops.frame != NULL, "the warped tangent has no frame");
  for (int t = 0; t < 100; t++) {
    PetscReal F[9], H[9], R[9], B[9], S[9], P[9], dP[9];
    SbPack f[9], r[9];

    random_deformation(0.4, F);
    for (int k = 0; k < 9; k++)
      H[k] = uniform();
    batch(F, f);
    m->ops.frame(m, (const SbPack *)f, r);
    SbPackGet(9, (const SbPack *)r, 2, R);
    SbMatTransposeMul(R, H, B);
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) {
        S[3 * i + j] = SbMaterialShearModulus(m) * (B[3 * i + j] + B[3 * j + i]) +
                       (i == j ? SbMaterialVolumetricModulus(m) * (B[0] + B[4] + B[8]) : 0);
      }
    }
    SbMatMul(R, S, P);
    damping_of(m, F, H, dP);
    SB_CHECK(difference(9, P, dP) < 1e-13 * stress_scale(m), "damping stress is off by %g",
             difference(9, P, dP));
  }
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
  SB_CHECK(!m->ops.frame && m->ops.spin, "the exact tangent has a frame, or no spin");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Collapsed and mirrored cells: all results are finite. */
static PetscErrorCode test_degenerate(SbMaterial m)
{
  const PetscReal F[5][9] = {{0},
                             {1, 0, 0, 0, 0, 0, 0, 0, 0},
                             {1, 0, 0, 0, 1, 0, 0, 0, 0},
                             {1, 0, 0, 0, 1, 0, 0, 0, -1},
                             {-1, 0, 0, 0, -1, 0, 0, 0, -1}};
  PetscReal P[9], C[81];

  PetscFunctionBeginUser;
  for (int k = 0; k < 5; k++) {
    for (int kind = SB_TANGENT_EXACT; kind <= SB_TANGENT_EXACT_SPD; kind++) {
      PetscCall(SbMaterialSetTangent(m, (SbTangentKind)kind));
      tangent_of(m, F[k], C);
      for (int i = 0; i < 81; i++)
        SB_CHECK(isfinite(C[i]), "tangent %d of degenerate F %d is %g", kind, k, C[i]);
    }
    stress_of(m, F[k], P);
    for (int i = 0; i < 9; i++)
      SB_CHECK(isfinite(P[i]), "stress of degenerate F %d is %g", k, P[i]);
    SB_CHECK(energy_of(m, F[k]) > 0.1 * SbMaterialShearModulus(m),
             "energy of degenerate F %d is %g", k, energy_of(m, F[k]));
  }
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_EXACT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbMaterial m;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  for (int k = 0; k < 3; k++) {
    PetscCall(SbMaterialCreateElastic("corotated", 5e3,
                                      k == 0   ? 0.3
                                      : k == 1 ? 0.49
                                               : 0,
                                      1000, &m));
    SB_CHECK(m->tangent == SB_TANGENT_WARPED && m->ops.frame,
             "the warped tangent is not the default");
    test_states(m);
    check_inversion(m, PETSC_TRUE);
    PetscCall(test_warped(m));
    PetscCall(test_degenerate(m));
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
