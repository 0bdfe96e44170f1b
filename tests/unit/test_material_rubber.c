// @ranks 1
/*
  Laws of rubber against closed forms and published numbers: nominal stress of uniaxial, equibiaxial
  and planar stretches with the pressure eliminated, Ogden's table of 1972, the energy as printed,
  the change of volume by each of its functions, equal and nearly equal stretches, limits of
  stretch, stability.

  Treloar's rubber by Ogden (1972): mu 0.63, 0.0012, -0.01 MPa, alpha 1.3, 5, -2.
*/
#include "../laws.h"
#include "material_checks.h"

enum {
  UNIAXIAL,
  EQUIBIAXIAL,
  PLANAR
};

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

static void stretches(int mode, PetscReal l, PetscReal s[3])
{
  s[0] = l;
  s[1] = mode == UNIAXIAL ? 1 / sqrt(l) : mode == EQUIBIAXIAL ? l : 1;
  s[2] = 1 / (s[0] * s[1]);
}

/* P_1 - P_3 s_3 / s_1: the nominal stress along the first axis of an incompressible body, the third
   side free. */
static PetscReal nominal(SbMaterial m, int mode, PetscReal l)
{
  PetscReal s[3], P[9];

  stretches(mode, l, s);
  const PetscReal F[9] = {s[0], 0, 0, 0, s[1], 0, 0, 0, s[2]};
  stress_of(m, F, P);
  return P[0] - P[8] * s[2] / s[0];
}

/* 2 (1 - s3^2/s1^2) (W1 + s2^2 W2) s1: Rivlin's formula for W(I1, I2). */
static PetscReal rivlin(const PetscReal s[3], PetscReal W1, PetscReal W2)
{
  return 2 * (s[0] - s[2] * s[2] / s[0]) * (W1 + s[1] * s[1] * W2);
}

/* dW/dI1 and dW/dI2 as in the headers of the laws' files. */
static void printed_slopes(const char *law, PetscReal x, PetscReal y, PetscReal W[2])
{
  W[1] = 0;
  if (!strcmp(law, "mooney_rivlin")) {
    W[0] = 2e5 + 2 * -3e3 * x + 500 * y + 3 * 40 * x * x + 2 * 30 * x * y + 20 * y * y;
    W[1] = 5e4 + 500 * x + 2 * 600 * y + 30 * x * x + 2 * 20 * x * y + 3 * 10 * y * y;
  } else if (!strcmp(law, "yeoh")) {
    W[0] = 3e5 - 2 * 2e3 * x + 3 * 80 * x * x;
  } else if (!strcmp(law, "gent")) {
    W[0] = 4e5 / 2 / (1 - x / 70);
  } else {
    const PetscReal whole = x + 3;
    const PetscReal n = 2.8 * 2.8;

    W[0] = 3e5 * (1. / 2 + whole / 10 / n + 33. / 1050 * pow(whole / n, 2) +
                  76. / 7000 * pow(whole / n, 3) + 2595. / 673750 * pow(whole / n, 4));
  }
}

static const char *const rubber[][2] = {
  {"mooney_rivlin", "-body_sample_c10 2e5 -body_sample_c01 5e4 -body_sample_c20 -3e3 "
                    "-body_sample_c11 500 -body_sample_c02 600 -body_sample_c30 40 "
                    "-body_sample_c21 30 -body_sample_c12 20 -body_sample_c03 10 "},
  {"yeoh", "-body_sample_c1 3e5 -body_sample_c2 -2e3 -body_sample_c3 80 "},
  {"gent", "-body_sample_mu 4e5 -body_sample_jm 70 "},
  {"arruda_boyce", "-body_sample_mu 3e5 -body_sample_lambda_m 2.8 "},
};

static PetscErrorCode test_closed_forms(void)
{
  static const PetscReal values[] = {0.4, 0.9, 1.001, 1.5, 2.5, 4};
  static const char *const volumes[] = {"simo_taylor", "quadratic", "logarithmic"};

  PetscFunctionBeginUser;
  for (int k = 0; k < 12; k++) {
    const char *law = rubber[k / 3][0];
    char text[1024];
    SbMaterial m;

    SbFormat(sizeof(text), text, "%s -body_sample_poisson 0.49 -body_sample_volumetric %s",
             rubber[k / 3][1], volumes[k % 3]);
    PetscCall(law_of(law, text, &m));
    for (int mode = UNIAXIAL; mode <= PLANAR; mode++) {
      for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(values); i++) {
        PetscReal s[3], W[2];

        stretches(mode, values[i], s);
        const PetscReal I1 = SbDot3(s, s);
        const PetscReal I2 = 1 / (s[0] * s[0]) + 1 / (s[1] * s[1]) + 1 / (s[2] * s[2]);
        printed_slopes(law, I1 - 3, I2 - 3, W);
        const PetscReal expected = rivlin(s, W[0], W[1]);
        SB_CHECK_NEAR(nominal(m, mode, values[i]), expected,
                      1e-10 * fabs(expected) + 1e-9 * fabs(values[i] - 1), law);
      }
    }
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define TRELOAR "-body_sample_mu 0.63e6,0.0012e6,-0.01e6 -body_sample_alpha 1.3,5,-2 "

/* psi of a law of Ogden as printed, with K/2 (J - 1)^2. */
static PetscReal printed_ogden(SbMaterial m, const PetscReal s[3])
{
  static const PetscReal mu[3] = {0.63e6, 0.0012e6, -0.01e6};
  static const PetscReal alpha[3] = {1.3, 5, -2};
  const PetscReal J = s[0] * s[1] * s[2];
  PetscReal psi = SbMaterialBulkModulus(m) / 2 * (J - 1) * (J - 1);

  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++)
      psi += mu[i] / alpha[i] * (pow(s[k] / cbrt(J), alpha[i]) - 1);
  return psi;
}

static PetscErrorCode test_ogden(void)
{
  static const struct {
    int mode;
    PetscReal l, stress; /* MPa */
  } table[] = {{UNIAXIAL, 1.39, 0.3399},    {UNIAXIAL, 3.02, 0.8854},    {UNIAXIAL, 6.4, 3.0933},
               {EQUIBIAXIAL, 1.31, 0.4663}, {EQUIBIAXIAL, 3.43, 1.4738}, {PLANAR, 1.87, 0.6426},
               {PLANAR, 4.96, 1.7785}};
  static const PetscReal mu[3] = {0.63e6, 0.0012e6, -0.01e6};
  static const PetscReal alpha[3] = {1.3, 5, -2};
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(law_of("ogden", TRELOAR "-body_sample_bulk 1e9 -body_sample_volumetric quadratic", &m));
  SB_CHECK_NEAR(SbMaterialShearModulus(m), 0.4225e6, 1e-9, "shear modulus at rest, Pa");
  SB_CHECK_NEAR(SbMaterialBulkModulus(m), 1e9, 1e-6, "bulk modulus at rest, Pa");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(table); i++) {
    PetscReal s[3];
    PetscReal expected = 0;

    stretches(table[i].mode, table[i].l, s);
    for (int k = 0; k < 3; k++)
      expected += mu[k] * (pow(s[0], alpha[k]) - pow(s[2], alpha[k])) / s[0];
    const PetscReal P = nominal(m, table[i].mode, table[i].l);
    SB_CHECK_NEAR(P / 1e6, table[i].stress, 5.1e-5, "nominal stress of Treloar's rubber, MPa");

    /* K = 1e9 Pa at a J that is 1 to rounding only */
    SB_CHECK_NEAR(P, expected, 1e-10 * expected + 1e-6, "nominal stress in closed form");
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(
    law_of("ogden", TRELOAR "-body_sample_poisson 0.4 -body_sample_volumetric quadratic", &m));
  for (int i = 0; i < 50; i++) {
    const PetscReal s[3] = {1 + 0.6 * uniform(), 1 + 0.6 * uniform(), 1 + 0.6 * uniform()};
    const PetscReal psi = printed_ogden(m, s);
    PetscReal F[9];

    with_stretches(s[0], s[1], s[2], F);
    SB_CHECK_NEAR(energy_of(m, F), psi, 1e-12 * (SbMaterialYoungModulus(m) + psi), "energy");
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* c10 with mu/2, and a single term of Ogden's with alpha 2, are isochoric_neohookean. */
static PetscErrorCode test_neohookean(void)
{
  static const char *const same[][2] = {
    {"mooney_rivlin", "-body_sample_c10 1e3 -body_sample_poisson 0.45"},
    {"yeoh", "-body_sample_c1 1e3 -body_sample_poisson 0.45"},
    {"ogden", "-body_sample_mu 2e3 -body_sample_alpha 2 -body_sample_poisson 0.45"},
    {"gent", "-body_sample_mu 2e3 -body_sample_jm 1e13 -body_sample_poisson 0.45"},
    {"arruda_boyce", "-body_sample_mu 2e3 -body_sample_lambda_m 1e7 -body_sample_poisson 0.45"},
  };
  SbMaterial m, reference;

  PetscFunctionBeginUser;
  PetscCall(SbMaterialCreateElastic("isochoric_neohookean", 5.8e3, 0.45, 1000, &reference));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(same); i++) {
    PetscCall(law_of(same[i][0], same[i][1], &m));
    for (int t = 0; t < 30; t++) {
      PetscReal F[9], P[9], Q[9], C[81], D[81];

      random_deformation(0.3, F);
      stress_of(m, F, P);
      stress_of(reference, F, Q);
      tangent_of(m, F, C);
      tangent_of(reference, F, D);
      SB_CHECK_NEAR(energy_of(m, F), energy_of(reference, F), 1e-10 * stress_scale(m), same[i][0]);
      SB_CHECK(difference(9, P, Q) < 1e-10 * stress_scale(m), "%s: stress off by %g", same[i][0],
               difference(9, P, Q));
      SB_CHECK(difference(81, C, D) < 1e-10 * stress_scale(m), "%s: tangent off by %g", same[i][0],
               difference(81, C, D));
    }
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(SbMaterialDestroy(&reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P = K J dtheta^2/2 of a change of volume alone, whatever the law. */
static PetscErrorCode test_volumes(void)
{
  static const char *const volumes[] = {"simo_taylor", "quadratic", "logarithmic"};
  static const PetscReal values[] = {0.5, 0.98, 1.0001, 1.3};

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    char text[256];
    SbMaterial m;

    SbFormat(sizeof(text), text, TRELOAR "-body_sample_bulk 3e6 -body_sample_volumetric %s",
             volumes[k]);
    PetscCall(law_of("ogden", text, &m));
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(values); i++) {
      const PetscReal s = values[i];
      const PetscReal J = s * s * s;
      const PetscReal slopes[3] = {(J - 1 / J) / 2, J - 1, log(J) / J};
      const PetscReal F[9] = {s, 0, 0, 0, s, 0, 0, 0, s};
      PetscReal P[9];

      stress_of(m, F, P);
      for (int n = 0; n < 9; n++)
        SB_CHECK_NEAR(P[n], n % 4 ? 0 : 3e6 * slopes[k] * s * s, 1e-7, volumes[k]);
    }
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tangent against central differences of the stress, whose error is about 1e-9 of the
   modulus. */
static void check_tangent(SbMaterial m, const PetscReal F[9], const char *what)
{
  const PetscReal t = 1e-5;
  PetscReal C[81];
  PetscReal worst = 0;

  tangent_of(m, F, C);
  for (int k = 0; k < 9; k++) {
    PetscReal up[9], down[9], P[9], Q[9];

    memcpy(up, F, sizeof(up));
    memcpy(down, F, sizeof(down));
    up[k] += t;
    down[k] -= t;
    stress_of(m, up, P);
    stress_of(m, down, Q);
    for (int i = 0; i < 9; i++)
      worst = larger(worst, fabs((P[i] - Q[i]) / (2 * t) - C[9 * i + k]));
  }
  SB_CHECK(worst < (m->type->fibres ? 2e-7 : 2e-8) * stress_scale(m),
           "%s, %s: tangent off by %g of %g Pa", m->type->name, what, worst, stress_scale(m));
}

static PetscErrorCode test_equal_stretches(void)
{
  const char *laws[SB_MATERIAL_TYPES];
  const PetscInt n = SbMaterialTypes(laws);

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) {
    SbMaterial m;

    if (!SbMaterialFind(laws[i])->own_moduli)
      continue;
    PetscCall(PetscOptionsClear(NULL));
    PetscCall(law_create(laws[i], 1e3, 0.45, 1000, &m));
    for (int power = 4; power <= 16; power++) {
      const PetscReal d = power == 16 ? 0 : pow(10, -power);
      PetscReal F[9], P[9], Q[9], H[9], CH[9], C[81];
      char what[64];

      SbFormat(sizeof(what), what, "stretches apart by %g", (double)d);
      with_stretches(1.3, 1.3 + d, 0.7, F);
      check_tangent(m, F, what);
      with_stretches(0.8, 1.5, 0.8 - d, F);
      check_tangent(m, F, what);
      with_stretches(1.1, 1.1 + d, 1.1 - d, F);
      if (!m->type->fibres || d > 1e-4) /* where fibres begin to bear the tangent jumps */
        check_tangent(m, F, what);

      /* without rounding of turned axes: the exact tangent takes the stress from d = 0 to d, up to
         the second order */
      const PetscReal E[9] = {1.3, 0, 0, 0, 1.3, 0, 0, 0, 0.7};
      for (int k = 0; k < 9; k++) {
        H[k] = d * (k == 4) + d * (k == 1);
        F[k] = E[k] + H[k];
      }
      stress_of(m, E, P);
      stress_of(m, F, Q);
      tangent_of(m, E, C);
      contract(C, H, CH);
      for (int k = 0; k < 9; k++)
        Q[k] -= P[k] + CH[k];
      SB_CHECK(sqrt(SbDot9(Q, Q)) < 20 * stress_scale(m) * d * d + 1e-14 * stress_scale(m),
               "%s, %s: stress off by %g", laws[i], what, sqrt(SbDot9(Q, Q)));
    }
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Beyond the limit of a law of Gent the energy is infinite and no stress a number: l^2 + 2/l - 3 =
   jm. */
static PetscErrorCode test_limit(void)
{
  const PetscReal l = 3;
  const PetscReal jm = l * l + 2 / l - 3;
  SbMaterial m;
  char text[256];

  PetscFunctionBeginUser;
  SbFormat(sizeof(text), text, "-body_sample_mu 1e3 -body_sample_jm %.17g -body_sample_bulk 1e6",
           (double)jm);
  PetscCall(law_of("gent", text, &m));
  for (int beyond = 0; beyond < 2; beyond++) {
    const PetscReal s = l + (beyond ? 1e-6 : -1e-6);
    const PetscReal F[9] = {s, 0, 0, 0, 1 / sqrt(s), 0, 0, 0, 1 / sqrt(s)};
    PetscReal P[9];

    stress_of(m, F, P);
    SB_CHECK(isinf(energy_of(m, F)) == beyond && isfinite(P[0]) == !beyond,
             "stretch %g of %g: energy %g, stress %g", (double)s, (double)l, energy_of(m, F), P[0]);
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Terms with mu alpha > 0 are stable, at large moduli too. */
static PetscErrorCode check_stable(const char *constants)
{
  PetscReal stretch;
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(law_of("ogden", constants, &m));
  for (int mode = 0; mode < 3; mode++) {
    for (int tension = 0; tension < 2; tension++) {
      SbMaterialFindUnstable(m, mode, (PetscBool)tension, &stretch);
      SB_CHECK(stretch == 0, "%s, mode %d: unstable at %g", constants, mode, (double)stretch);
    }
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Treloar's rubber is stable; Mooney's law with c01 < 0 is not in equibiaxial tension. */
static PetscErrorCode test_stability(void)
{
  PetscReal stretch;
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(check_stable(TRELOAR "-body_sample_bulk 1e9"));
  PetscCall(check_stable("-body_sample_mu 1e3 -body_sample_alpha 20 -body_sample_bulk 1e6"));
  PetscCall(check_stable("-body_sample_mu 1e3 -body_sample_alpha 50 -body_sample_bulk 1e6"));

  /* W = c10 x1 + c01 x2 at e1 = e2 = ln l, e3 = -2 ln l: the change e1 = -e2 has the modulus 8 (c10
     l^2 + c01 l^-2) > 0, e1 = e2 has 8 (c10 (l^2 + 2 l^-4) + c01 (l^-2 + 2 l^4)) */
  PetscCall(law_of("mooney_rivlin",
                   "-body_sample_c10 1e5 -body_sample_c01 -2e4 -body_sample_bulk 1e9", &m));
  SbMaterialFindUnstable(m, EQUIBIAXIAL, PETSC_TRUE, &stretch);
  const PetscReal l = stretch;
  const PetscReal value =
    pow(l, 2) + 2 * pow(l, -4) - 0.2 * (pow(l, -2) + 2 * pow(l, 4)); /* falls with l */
  SB_CHECK(l > 1.5 && value < 1e-6 && value > -0.1,
           "Mooney's law with c01 < 0: unstable at %g, where the modulus is %g c10", (double)l,
           (double)value);
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is refused, and which option the error names. */
static PetscErrorCode test_errors(void)
{
  static const struct {
    const char *law, *options, *names;
  } wrong[] = {
    {"ogden", "-body_sample_mu 1e3,2e3 -body_sample_alpha 2 -body_sample_bulk 1e6",
     "-body_sample_mu|2|-body_sample_alpha|1"},
    {"ogden", "-body_sample_mu 1e3,2e3 -body_sample_alpha 2,0 -body_sample_bulk 1e6",
     "-body_sample_alpha|2"},
    {"ogden", "-body_sample_mu 1e3,x -body_sample_alpha 2,3 -body_sample_bulk 1e6",
     "-body_sample_mu 1e3,x"},
    {"ogden", "-body_sample_mu -1e3 -body_sample_alpha 2 -body_sample_bulk 1e6",
     "-body_sample_material|ogden|-1000"},
    {"ogden", "-body_sample_alpha 2 -body_sample_bulk 1e6", "-body_sample_mu"},
    {"mooney_rivlin", "-body_sample_c10 1e3 -body_sample_c01 -2e3 -body_sample_bulk 1e6",
     "-body_sample_material|mooney_rivlin|c10|c01|-2000"},
    {"mooney_rivlin", "-body_sample_c10 1e3", "-body_sample_bulk|-body_sample_poisson"},
    {"yeoh", "-body_sample_c1 1e3 -body_sample_bulk 1e6 -body_sample_poisson 0.4",
     "-body_sample_bulk|-body_sample_poisson"},
    {"yeoh", "-body_sample_c1 1e3 -body_sample_bulk -1", "-body_sample_bulk -1"},
    {"gent", "-body_sample_mu 1e3 -body_sample_jm 0 -body_sample_bulk 1e6", "-body_sample_jm 0"},
    {"arruda_boyce", "-body_sample_mu 1e3 -body_sample_lambda_m 1 -body_sample_bulk 1e6",
     "-body_sample_lambda_m 1"},
  };
  SbMaterial m = NULL;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(wrong); i++) {
    SB_CHECK_ERROR(law_of(wrong[i].law, wrong[i].options, &m), PETSC_ERR_USER, wrong[i].names);
    PetscCall(SbMaterialDestroy(&m));
  }
  SB_CHECK_ERROR(SbMaterialCreateElastic("yeoh", 1, 0.3, 1, &m), PETSC_ERR_USER, "yeoh");

  /* a bulk modulus of the body goes before a Poisson's ratio of all */
  PetscCall(
    law_of("yeoh", "-body_sample_c1 1e3 -body_sample_bulk 1e6 -body_default_poisson 0.4", &m));
  SB_CHECK_NEAR(SbMaterialBulkModulus(m), 1e6, 1e-8, "bulk modulus");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(law_of("yeoh", "-body_sample_c1 1e3 -body_default_poisson 0.4", &m));
  SB_CHECK_NEAR(SbMaterialPoisson(m), 0.4, 0, "Poisson's ratio");
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  PetscCall(test_closed_forms());
  PetscCall(test_ogden());
  PetscCall(test_neohookean());
  PetscCall(test_volumes());
  PetscCall(test_equal_stretches());
  PetscCall(test_limit());
  PetscCall(test_stability());
  PetscCall(test_errors());
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
