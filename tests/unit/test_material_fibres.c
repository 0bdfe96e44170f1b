// @ranks 1
/*
  Laws with fibres: the strip of the adventitia of Gasser, Ogden and Holzapfel (2006), energies as
  printed in any axes, moduli of the transversely isotropic law, axes of their own in each lane,
  directions by formulas, and what is refused.
*/
#include "../laws.h"
#include "material_checks.h"

/* A law from options of the body "sample", after all others of it were removed. */
static PetscErrorCode law_of(const char *law, const char *options, SbMaterial *m)
{
  SbScope scope;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(PetscOptionsInsertString(NULL, options));
  SbScopeSet(&scope, "body", "", "sample");
  PetscCall(SbMaterialCreate(law, &scope, m));
  PetscCall(SbMaterialSetTangent(*m, SB_TANGENT_EXACT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cauchy stresses s_k P_kk of the stretches s. */
static void cauchy(SbMaterial m, const PetscReal s[3], PetscReal sigma[3])
{
  const PetscReal F[9] = {s[0], 0, 0, 0, s[1], 0, 0, 0, s[2]};
  PetscReal P[9];

  stress_of(m, F, P);
  for (int k = 0; k < 3; k++)
    sigma[k] = s[k] * P[4 * k];
}

/* Stress along the first axis of an incompressible strip with free sides: its stretch across is
   found by bisection. */
static PetscReal strip(SbMaterial m, PetscReal l)
{
  PetscReal low = pow(l, -4);
  PetscReal high = 1;
  PetscReal sigma[3];

  for (int i = 0; i < 60; i++) {
    const PetscReal middle = (low + high) / 2;
    const PetscReal s[3] = {l, middle, 1 / (l * middle)};

    cauchy(m, s, sigma);
    if (sigma[1] > sigma[2])
      high = middle;
    else
      low = middle;
  }
  return sigma[0] - sigma[2];
}

static PetscErrorCode test_strip(void)
{
  static const PetscReal stretch[3] = {1.05, 1.1, 1.2};
  static const struct {
    PetscReal kappa, stress[3]; /* kPa */
  } table[] = {{0, {1.272, 2.730, 6.821}}, {0.226, {1.421, 4.070, 48.245}}};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    SbMaterial m;
    char text[512];

    SbFormat(sizeof(text), text,
             "-body_sample_mu 7640 -body_sample_k1 996.6e3 -body_sample_k2 524.6 "
             "-body_sample_angles 49.98,-49.98 -body_sample_sheet 0,1,0 -body_sample_bulk 1e7 "
             "-body_sample_kappa %g",
             (double)table[k].kappa);
    PetscCall(law_of("holzapfel_gasser_ogden", text, &m));
    for (int i = 0; i < 3; i++)
      SB_CHECK_NEAR(strip(m, stretch[i]) / 1e3, table[k].stress[i], 5.1e-4,
                    "stress of the strip, kPa");
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal tension(PetscReal k1, PetscReal k2, PetscReal E)
{
  return E > 0 ? k1 / (2 * k2) * (exp(k2 * E * E) - 1) : 0;
}

/* psi of a law as printed, from C = F^T F with det C = 1 and axes f, s, n. */
static PetscReal printed(const char *law, const PetscReal C[9], const PetscReal a[3][3])
{
  const PetscReal I1 = C[0] + C[4] + C[8];
  PetscReal c[3][3];
  PetscReal square = 0;

  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++) {
      c[i][j] = 0;
      for (int k = 0; k < 9; k++)
        c[i][j] += a[i][k / 3] * C[k] * a[j][k % 3];
    }
  }
  if (!strcmp(law, "holzapfel_gasser_ogden")) {
    PetscReal psi = 300. / 2 * (I1 - 3);

    for (int i = 0; i < 2; i++) {
      const PetscReal b = (i ? -40 : 25) * PETSC_PI / 180;
      const PetscReal I4 =
        cos(b) * cos(b) * c[0][0] + 2 * cos(b) * sin(b) * c[0][1] + sin(b) * sin(b) * c[1][1];

      psi += tension(500, 1.5, 0.1 * (I1 - 3) + 0.7 * (I4 - 1));
    }
    return psi;
  }
  if (!strcmp(law, "guccione")) {
    const PetscReal E[6] = {(c[0][0] - 1) / 2, (c[1][1] - 1) / 2, (c[2][2] - 1) / 2,
                            c[0][1] / 2,       c[0][2] / 2,       c[1][2] / 2};

    return 200. / 2 *
           (exp(8 * E[0] * E[0] + 2 * (E[1] * E[1] + E[2] * E[2] + 2 * E[5] * E[5]) +
                4 * 2 * (E[3] * E[3] + E[4] * E[4])) -
            1);
  }
  if (!strcmp(law, "holzapfel_ogden"))
    return 59. / (2 * 0.8) * (exp(0.8 * (I1 - 3)) - 1) + tension(184, 1.6, c[0][0] - 1) +
           tension(24, 1.1, c[1][1] - 1) + 216. / (2 * 1.4) * (exp(1.4 * c[0][1] * c[0][1]) - 1);
  for (int i = 0; i < 3; i++)
    square += c[0][i] * c[0][i];
  return 100. / 2 * (I1 - 3) + (900. - 300) / 8 * (c[0][0] - 1) * (c[0][0] - 1) +
         (150. - 100) / 2 * (square - c[0][0] * c[0][0]);
}

static const char *const laws[][2] = {
  {"holzapfel_gasser_ogden",
   "-body_sample_mu 300 -body_sample_k1 500 -body_sample_k2 1.5 -body_sample_kappa 0.1 "
   "-body_sample_angles 25,-40 "},
  {"guccione", "-body_sample_c 200 -body_sample_bf 8 -body_sample_bt 2 -body_sample_bfs 4 "},
  {"holzapfel_ogden",
   "-body_sample_a 59 -body_sample_b 0.8 -body_sample_a_f 184 -body_sample_b_f 1.6 "
   "-body_sample_a_s 24 -body_sample_b_s 1.1 -body_sample_a_fs 216 -body_sample_b_fs 1.4 "},
  {"transversely_isotropic",
   "-body_sample_mu 100 -body_sample_mu_fibre 150 -body_sample_young_fibre 900 "},
};

/* In axes that the options give, one direction of any length, the other one not across it. */
static PetscErrorCode test_printed(void)
{
  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    for (int t = 0; t < 20; t++) {
      const PetscReal x[3] = {0, 0, 0};
      const PetscReal skew = 0.5 * uniform();
      PetscReal Q[9], F[9], C[9], R[9], P[9], D[9], a[3][3];
      SbPack axes[9], more[9];
      char text[1024];
      SbMaterial m;
      struct _p_SbMaterial turned;

      random_rotation(Q);
      for (int i = 0; i < 9; i++)
        a[i % 3][i / 3] = Q[i];
      SbFormat(sizeof(text), text,
               "%s -body_sample_poisson 0.4 -body_sample_fibre %.17g,%.17g,%.17g "
               "-body_sample_sheet %.17g,%.17g,%.17g",
               laws[k][1], (double)(3 * a[0][0]), (double)(3 * a[0][1]), (double)(3 * a[0][2]),
               (double)(a[1][0] + skew * a[0][0]), (double)(a[1][1] + skew * a[0][1]),
               (double)(a[1][2] + skew * a[0][2]));
      PetscCall(law_of(laws[k][0], text, &m));
      PetscCall(SbMaterialAxes(m, x, NULL, R));
      SB_CHECK(difference(9, Q, R) < 1e-14, "axes are %g from those given", difference(9, Q, R));

      /* lane 2 has these axes, and its neighbours others */
      for (int l = 0; l < SB_BATCH; l++) {
        random_rotation(D);
        SbPackPut(9, l == 2 ? R : D, l, axes);
        random_rotation(D);
        SbPackPut(9, l == 2 ? R : D, l, more);
      }
      turned = *m;
      turned.axes = (const SbPack *)axes;
      random_deformation(0.25, F);
      const PetscReal J = SbMatDet(F);
      for (int i = 0; i < 9; i++)
        F[i] /= cbrt(J);
      SbMatTransposeMul(F, F, C);
      const PetscReal psi = printed(laws[k][0], C, (const PetscReal(*)[3])a);
      SB_CHECK_NEAR(energy_of(&turned, F), psi, 1e-12 * (SbMaterialYoungModulus(m) + psi),
                    laws[k][0]);
      stress_of(&turned, F, P);
      turned.axes = (const SbPack *)more;
      stress_of(&turned, F, D);
      for (int i = 0; i < 9; i++)
        SB_CHECK(P[i] == D[i], "%s: axes of neighbours change a stress", laws[k][0]);
      turned.axes = (const SbPack *)axes;
      check_derivatives(&turned, F, "order of the Taylor remainder, turned axes");
      PetscCall(SbMaterialDestroy(&m));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Moduli at small strains, K = 1e8 mu: along the fibre E = sigma / e with free sides, and
   shears. */
static PetscErrorCode test_moduli(void)
{
  const PetscReal e = 1e-6;
  const PetscReal s[3] = {1 + e, 1 / sqrt(1 + e), 1 / sqrt(1 + e)};
  PetscReal sigma[3];
  SbMaterial m;
  char text[512];

  PetscFunctionBeginUser;
  SbFormat(sizeof(text), text, "%s -body_sample_bulk 1e10", laws[3][1]);
  PetscCall(law_of(laws[3][0], text, &m));
  cauchy(m, s, sigma);
  SB_CHECK_NEAR((sigma[0] - sigma[2]) / e, 900, 0.01, "Young's modulus along the fibre, Pa");
  for (int k = 0; k < 3; k++) {
    PetscReal F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    PetscReal P[9];
    const int at = k == 0 ? 1 : k == 1 ? 2 : 5;

    F[at] = e;
    stress_of(m, F, P);
    SB_CHECK_NEAR(P[at] / e, k == 2 ? 100 : 150, 1e-3, "shear modulus, Pa");
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Around an axis; without a sheet any direction across. */
static PetscErrorCode test_directions(void)
{
  PetscReal Q[9], unit[9];
  SbMaterial m;
  char text[512];

  PetscFunctionBeginUser;
  SbFormat(sizeof(text), text, "%s -body_sample_bulk 1e6 -body_sample_fibre (-y);x;0", laws[1][1]);
  PetscCall(law_of(laws[1][0], text, &m));
  for (int t = 0; t < 50; t++) {
    const PetscReal x[3] = {uniform(), uniform(), uniform()};
    const PetscReal r = sqrt(x[0] * x[0] + x[1] * x[1]);

    PetscCall(SbMaterialAxes(m, x, NULL, Q));
    SB_CHECK(fabs(Q[0] + x[1] / r) < 1e-14 && fabs(Q[3] - x[0] / r) < 1e-14 && Q[6] == 0,
             "direction %g %g %g", Q[0], Q[3], Q[6]);
    SbMatTransposeMul(Q, Q, unit);
    for (int k = 0; k < 9; k++)
      SB_CHECK_NEAR(unit[k], k % 4 == 0, 1e-14, "orthonormal axes");
    SB_CHECK_NEAR(SbMatDet(Q), 1, 1e-14, "right-handed axes");
  }
  const PetscReal centre[3] = {0, 0, 1};
  SB_CHECK_ERROR(SbMaterialAxes(m, centre, NULL, Q), PETSC_ERR_USER_INPUT,
                 "-body_sample_fibre|(0, 0, 1)");
  PetscCall(SbMaterialDestroy(&m));
  SbFormat(sizeof(text), text, "%s -body_sample_bulk 1e6 -body_sample_sheet x,0,0", laws[1][1]);
  PetscCall(law_of(laws[1][0], text, &m));
  const PetscReal along[3] = {2, 0, 0};
  SB_CHECK_ERROR(SbMaterialAxes(m, along, NULL, Q), PETSC_ERR_USER_INPUT,
                 "-body_sample_sheet|-body_sample_fibre|(2, 0, 0)");
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_errors(void)
{
  static const struct {
    int law;
    const char *options, *names;
  } wrong[] = {
    {0, "-body_sample_bulk 1e6", "-body_sample_sheet|holzapfel_gasser_ogden"},
    {0, "-body_sample_bulk 1e6 -body_sample_k1 -1", "-body_sample_k1|-1"},
    {0, "-body_sample_bulk 1e6 -body_sample_kappa 0.4", "-body_sample_kappa|0.4"},
    {0, "-body_sample_bulk 1e6 -body_sample_angles 10,x", "-body_sample_angles"},
    {0, "-body_sample_bulk 1e6 -body_sample_fibre t,0,1", "-body_sample_fibre"},
    {1, "-body_sample_bulk 1e6 -body_sample_c -2", "-body_sample_c|-2"},
    {1, "-body_sample_bulk 1e6 -body_sample_bf 0", "-body_sample_bf|0"},
    {1, "", "-body_sample_bulk|-body_sample_poisson"},
    {2, "-body_sample_bulk 1e6", "-body_sample_sheet|holzapfel_ogden"},
    {3, "-body_sample_bulk 1e6 -body_sample_mu_fibre -1", "-body_sample_mu_fibre|-1"},
  };
  SbMaterial m = NULL;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(wrong); i++) {
    char text[1024];

    SbFormat(sizeof(text), text, "%s %s", laws[wrong[i].law][1], wrong[i].options);
    SB_CHECK_ERROR(law_of(laws[wrong[i].law][0], text, &m), PETSC_ERR_USER, wrong[i].names);
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  PetscCall(test_strip());
  PetscCall(test_printed());
  PetscCall(test_moduli());
  PetscCall(test_directions());
  PetscCall(test_errors());
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
