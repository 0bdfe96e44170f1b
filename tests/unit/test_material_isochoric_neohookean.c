// @ranks 1
/*
  Neo-Hookean law with the change of shape apart from that of volume: homogeneous states calculated
  by hand, the energy as printed, the dilatation and its derivative on both sides of the change from
  the series, an inverted state.
*/
#include "material_checks.h"

/* psi = mu/2 (J^(-2/3) I1 - 3) + K/4 (J^2 - 1 - 2 ln J) */
static PetscReal printed_energy(SbMaterial m, const PetscReal F[9])
{
  const PetscReal J = SbMatDet(F);

  return SbMaterialShearModulus(m) / 2 * (pow(J, -2. / 3.) * SbDot9(F, F) - 3) +
         SbMaterialBulkModulus(m) / 4 * (J * J - 1 - 2 * log(J));
}

static void test_states(SbMaterial m)
{
  static const PetscReal values[] = {1e-3, 0.3, 0.8, 0.97, 1.03, 1.2, 2};
  const PetscReal mu = SbMaterialShearModulus(m);
  const PetscReal K = SbMaterialBulkModulus(m);

  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(values); k++) {
    const PetscReal s = values[k];
    const PetscReal a = mu * pow(s, -2. / 3.);
    const PetscReal q = K / 2 * (s * s - 1) - a * (s * s + 2) / 3;
    const PetscReal F[9] = {s, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal P[9] = {a * s + q / s, 0, 0, 0, a + q, 0, 0, 0, a + q};
    const PetscReal G[9] = {1, s, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal d = mu * s * s / 3;
    const PetscReal S[9] = {-d, mu * s, 0, mu * s + d * s, -d, 0, 0, 0, -d};
    const PetscReal B[9] = {s, 0, 0, 0, s, 0, 0, 0, s};
    const PetscReal J = s * s * s;
    const PetscReal hydrostatic = K / 2 * (J - 1 / J) * s * s;
    PetscReal A[9], D[9];

    stress_of(m, F, A);
    for (int n = 0; n < 9; n++)
      SB_CHECK_NEAR(A[n], P[n], 1e-13 * (stress_scale(m) + fabs(P[0])), "uniaxial strain");
    check_stress(m, G, S, "shear stress");

    /* of a change of volume alone: K/2 (J - 1/J), whatever mu is */
    stress_of(m, B, A);
    for (int n = 0; n < 9; n++)
      SB_CHECK_NEAR(A[n], n % 4 ? 0 : hydrostatic, 1e-12 * (mu + fabs(hydrostatic)), "pressure");
    random_deformation(0.25, D);
    SB_CHECK_NEAR(energy_of(m, D), printed_energy(m, D), 1e-13 * stress_scale(m),
                  "energy as printed");
    SB_CHECK_NEAR(energy_of(m, F), printed_energy(m, F),
                  1e-13 * (stress_scale(m) + fabs(printed_energy(m, F))),
                  "energy of a uniaxial strain");
  }
}

/* theta and its derivatives by J to rounding, near J = 1 and where the series ends, against exact
   terms: theta theta' = (J - 1/J)/2 and theta'^2 + theta theta'' = (1 + 1/J^2)/2. */
static void test_dilatation(SbMaterial m)
{
  static const PetscReal values[] = {-0.6, -0.051, -0.0499, -1e-3, -1e-8,
                                     0,    1e-6,   0.0499,  0.051, 3};

  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(values); k++) {
    const PetscReal J = 1 + values[k];
    const PetscReal j = J - 1; /* exact */
    const PetscReal F[9] = {J, 0, 0, 0, 1, 0, 0, 0, 1};
    const PetscReal theta = dilatation_of(m, F);
    SbPack f[9], p;
    SbPack c[81] = {{0}};
    PetscReal D[9];

    gradient_of(m, F, D);
    batch(F, f);
    for (int l = 0; l < SB_BATCH; l++)
      p[l] = 1;
    m->ops.dilatation_hessian(m, (const SbPack *)f, p, c);
    SB_CHECK_NEAR(2 * theta * D[0], j * (1 + J) / J, 1e-14 * fabs(j) * (1 + 1 / J),
                  "theta d theta/dJ");
    SB_CHECK_NEAR(D[0] * D[0] + theta * c[0][2], (1 + 1 / (J * J)) / 2, 1e-12 / (J * J),
                  "second derivative of theta^2");
  }
}

int main(int argc, char **argv)
{
  static const PetscReal nu[] = {0.3, 0.4999, 0, -0.3};
  const PetscReal inverted[9] = {-0.1, 0, 0, 0, 1, 0, 0, 0, 1};
  SbMaterial m;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(nu); k++) {
    PetscReal P[9];

    PetscCall(SbMaterialCreateElastic("isochoric_neohookean", 5e3, nu[k], 1000, &m));
    test_states(m);
    test_dilatation(m);
    stress_of(m, inverted, P);
    SB_CHECK(isinf(energy_of(m, inverted)) && isnan(P[0]), "inverted: energy %g, stress %g",
             energy_of(m, inverted), P[0]);
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
