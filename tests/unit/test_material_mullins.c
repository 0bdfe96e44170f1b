// @ranks 1
/*
  Softening by the first stretch: stress is the derivative of the energy, the tangent that of the
  stress, below and beyond the largest energy so far, of every law that splits shape from volume;
  loading is the law itself, bit by bit; the closed forms of Ogden and Roxburgh; the energy that is
  lost is what their factor takes; positive tangents; what is refused.
*/
#include "../laws.h"
#include "material_checks.h"

#define E 1e6
#define NU 0.45

static const struct _p_SbMullins constants[] = {{1.6, 5e4, 0.2}, {3., 2e4, 0.}, {1.1, 0., 0.1}};

/* A law and a softened copy of it that has had the energy of the shape `most`. */
typedef struct {
  SbMaterial law;
  struct _p_SbMaterial soft;
  SbPack most;
} Softened;

static void soften(Softened *s, const struct _p_SbMullins *mullins, PetscReal most)
{
  for (int l = 0; l < SB_BATCH; l++)
    s->most[l] = most;
  s->soft = *s->law;
  SbMullinsSoften(&s->soft, s->law, mullins);
  s->soft.most = (const SbPack *)&s->most;
}

static PetscReal shape_of(const Softened *s, const PetscReal F[9])
{
  SbPack f[9], W;

  batch(F, f);
  SbMullinsShape(&s->soft, (const SbPack *)f, W);
  return W[2];
}

/* Smallest eigenvalue of the filtered tangent over its largest entry. */
static PetscReal smallest(SbMaterial m, const PetscReal F[9])
{
  PetscReal C[81], D[81];
  PetscReal size = 0;

  m->tangent = SB_TANGENT_EXACT_SPD;
  tangent_of(m, F, C);
  m->tangent = SB_TANGENT_EXACT;
  for (int k = 0; k < 81; k++)
    size = larger(size, fabs(C[k]));
  return project(C, D) / size;
}

static PetscErrorCode test_law(const char *name)
{
  Softened s;

  PetscFunctionBeginUser;
  PetscCall(law_create(name, E, NU, 1e3, &s.law));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(constants); i++) {
    for (int k = 0; k < 4; k++) {
      PetscReal F[9], P[9], Q[9], C[81], B[81], W;

      random_deformation(0.2, F);
      soften(&s, &constants[i], 0);
      W = shape_of(&s, F);
      SB_CHECK(W > 0, "%s: energy of the shape %g", name, W);

      /* loading: the law, less what it lost */
      soften(&s, &constants[i], 0.8 * W);
      stress_of(s.law, F, P);
      stress_of(&s.soft, F, Q);
      tangent_of(s.law, F, C);
      tangent_of(&s.soft, F, B);
      SB_CHECK(!memcmp(P, Q, sizeof(P)) && !memcmp(C, B, sizeof(C)),
               "%s: loading is not the law itself", name);
      SB_CHECK_NEAR(energy_of(&s.soft, F),
                    energy_of(s.law, F) - SbMullinsLost(&constants[i], 0.8 * W), 1e-14 * E, name);

      /* unloading */
      soften(&s, &constants[i], 1.7 * W);
      check_derivatives(&s.soft, F, name);
      SB_CHECK(smallest(&s.soft, F) > -1e-13, "%s: eigenvalue %g of the filtered tangent", name,
               smallest(&s.soft, F));
      check_invariance(&s.soft, F);
    }

    /* nothing is stored at rest, whatever was before */
    const PetscReal rest[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    PetscReal P[9];

    soften(&s, &constants[i], 0.3 * E);
    SB_CHECK_NEAR(energy_of(&s.soft, rest), 0, 1e-15 * E, name);
    stress_of(&s.soft, rest, P);
    for (int k = 0; k < 9; k++)
      SB_CHECK(P[k] == 0, "%s: stress %g at rest", name, P[k]);
    check_lanes(&s.soft);
  }
  PetscCall(SbMaterialDestroy(&s.law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Uniaxial stretches of the isochoric neo-Hookean law at constant volume: the factor of the stress
   that changes the shape; across W = most stress and energy do not jump; the energy lost is the
   integral of 1 - eta. */
static PetscErrorCode test_closed_form(void)
{
  const PetscReal mu = E / (2 * (1 + NU));
  Softened s;

  PetscFunctionBeginUser;
  PetscCall(law_create("isochoric_neohookean", E, NU, 1e3, &s.law));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(constants); i++) {
    const struct _p_SbMullins *a = &constants[i];
    const PetscReal most = mu / 2 * (4 + 1 - 3); /* at the stretch 2 */
    const PetscReal spread = a->m + a->beta * most;
    const int n = 20000;
    PetscReal lost = 0;

    soften(&s, a, most);
    for (int k = 1; k < 16; k++) {
      const PetscReal l = 1 + k / 16.;
      const PetscReal F[9] = {l, 0, 0, 0, 1 / sqrt(l), 0, 0, 0, 1 / sqrt(l)};
      const PetscReal W = mu / 2 * (l * l + 2 / l - 3);
      const PetscReal eta = 1 - erf((most - W) / spread) / a->r;
      PetscReal P[9];
      SbPack f[9], value;

      SB_CHECK_NEAR(shape_of(&s, F), W, 1e-13 * mu, "energy of the shape");
      stress_of(&s.soft, F, P);
      SB_CHECK_NEAR(P[0] - P[8] / (l * sqrt(l)), eta * mu * (l - 1 / (l * l)), 1e-12 * mu,
                    "nominal stress");
      batch(F, f);
      SbMullinsFactor(&s.soft, (const SbPack *)f, value);
      SB_CHECK_NEAR(value[2], eta, 1e-13, "factor");
    }
    for (int k = 0; k < n; k++)
      lost += erf((most - most * (k + 0.5) / n) / spread) / a->r * most / n;
    SB_CHECK_NEAR(SbMullinsLost(a, most) / lost, 1, 1e-7, "energy that is lost");
    SB_CHECK(SbMullinsLost(a, 0) == 0 && SbMullinsLost(a, most / 2) < SbMullinsLost(a, most),
             "losses %g, %g, %g", SbMullinsLost(a, 0), SbMullinsLost(a, most / 2),
             SbMullinsLost(a, most));
    for (int k = 0; k < 2; k++) {
      const PetscReal l = 2 + (k ? 1e-9 : -1e-9);
      const PetscReal F[9] = {l, 0, 0, 0, 1 / sqrt(l), 0, 0, 0, 1 / sqrt(l)};
      PetscReal P[9], Q[9];

      stress_of(&s.soft, F, P);
      stress_of(s.law, F, Q);
      SB_CHECK(difference(9, P, Q) < 1e-6 * mu, "stress jumps by %g", difference(9, P, Q));
      SB_CHECK_NEAR(energy_of(&s.soft, F), energy_of(s.law, F) - SbMullinsLost(a, most), 1e-13 * mu,
                    "energy at the largest one");
    }
  }
  PetscCall(SbMaterialDestroy(&s.law));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode law_of(const char *law, const char *options, SbMaterial *m)
{
  SbScope scope;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(PetscOptionsInsertString(NULL, options));
  SbScopeSet(&scope, "body", "", "sample");
  PetscCall(SbMaterialCreate(law, &scope, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define YOUNG "-body_sample_young 1e6 -body_sample_poisson 0.45 "

static PetscErrorCode test_options(void)
{
  static const struct {
    const char *law, *options, *names;
  } wrong[] = {
    {"isochoric_neohookean", "-body_sample_mullins_r 1 -body_sample_mullins_m 1e4",
     "-body_sample_mullins_r 1|(1, inf)"},
    {"isochoric_neohookean", "-body_sample_mullins_r 0.5 -body_sample_mullins_m 1e4",
     "-body_sample_mullins_r 0.5|(1, inf)"},
    {"isochoric_neohookean", "-body_sample_mullins_r -2 -body_sample_mullins_m 1e4",
     "-body_sample_mullins_r|-2"},
    {"isochoric_neohookean", "-body_sample_mullins_r 2 -body_sample_mullins_m -1",
     "-body_sample_mullins_m|-1|J/m^3"},
    {"isochoric_neohookean", "-body_sample_mullins_r 2 -body_sample_mullins_beta -1",
     "-body_sample_mullins_beta|-1"},
    {"isochoric_neohookean", "-body_sample_mullins_r 2",
     "-body_sample_mullins_m 0|-body_sample_mullins_beta 0"},
    {"isochoric_neohookean", "-body_sample_mullins_m 1e4",
     "-body_sample_mullins_m|-body_sample_mullins_r"},
    {"isochoric_neohookean", "-body_sample_mullins_beta 0.1",
     "-body_sample_mullins_beta|-body_sample_mullins_r"},
    {"isochoric_neohookean",
     "-body_sample_mullins_r 2 -body_sample_mullins_m 1 -body_sample_viscosity 1",
     "-body_sample_mullins_r|viscosity"},
    {"isochoric_neohookean",
     "-body_sample_mullins_r 2 -body_sample_mullins_m 1 -body_sample_active_strain -0.1 "
     "-body_sample_fibre 1,0,0",
     "-body_sample_mullins_r|-body_sample_active_strain"},
    {"neohookean", "-body_sample_mullins_r 2 -body_sample_mullins_m 1",
     "-body_sample_mullins_r|neohookean|-body_sample_material"},
    {"stable_neohookean", "-body_sample_mullins_r 2 -body_sample_mullins_m 1",
     "-body_sample_mullins_r|stable_neohookean"},
    {"linear", "-body_sample_mullins_r 2 -body_sample_mullins_m 1",
     "-body_sample_mullins_r|linear"},
  };
  SbMaterial m = NULL;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(wrong); i++) {
    char text[512];

    SbFormat(sizeof(text), text, YOUNG "%s", wrong[i].options);
    SB_CHECK_ERROR(law_of(wrong[i].law, text, &m), PETSC_ERR_USER, wrong[i].names);
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(law_of("isochoric_neohookean", YOUNG, &m));
  SB_CHECK(!m->mullins, "softening that no option asks for");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(law_of("isochoric_neohookean",
                   YOUNG "-body_sample_mullins_r 2 -body_sample_mullins_m 3e4 "
                         "-body_sample_mullins_beta 0.1",
                   &m));
  SB_CHECK(m->mullins && m->mullins->r == 2 && m->mullins->m == 3e4 && m->mullins->beta == 0.1,
           "constants");
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const char *names[SB_MATERIAL_TYPES];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbMaterialRegisterAll());
  PetscCall(random_begin());
  for (PetscInt i = 0; i < SbMaterialTypes(names); i++)
    if (SbMaterialFind(names[i])->share == 2. / 3.)
      PetscCall(test_law(names[i]));
  PetscCall(test_closed_form());
  PetscCall(test_options());
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
