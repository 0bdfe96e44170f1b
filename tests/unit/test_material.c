// @ranks 1 3
/* Creation of materials by name and from options, errors, and moduli derived from E, nu and
   density. */
#include "../test.h"
#include <sbmaterial.h>

/* Options of a body, one set for each material, read as the program does. */
static PetscErrorCode create(const char *law, const char *young, const char *poisson,
                             const char *density, const char *tangent, SbMaterial *m)
{
  const char *keys[4] = {"young", "poisson", "density", "tangent"};
  const char *values[4] = {young, poisson, density, tangent};
  SbScope scope;

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    char name[64];

    PetscCall(PetscSNPrintf(name, sizeof(name), "-body_b%s_%s", law, keys[k]));
    if (values[k])
      PetscCall(PetscOptionsSetValue(NULL, name, values[k]));
    else
      PetscCall(PetscOptionsClearValue(NULL, name));
  }
  *m = NULL;
  SbScopeSet(&scope, "body", "", "b");
  PetscCall(PetscStrlcat(scope.instance, law, sizeof(scope.instance)));
  PetscCall(SbMaterialCreate(law, &scope, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_options(void)
{
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(create("corotated", "5e3", "0.25", "1060", NULL, &m));
  SB_CHECK_NEAR(SbMaterialYoungModulus(m), 5e3, 0, "E");
  SB_CHECK_NEAR(SbMaterialShearModulus(m), 2e3, 1e-9, "mu");
  SB_CHECK_NEAR(SbMaterialVolumetricModulus(m), 2e3, 1e-9, "lambda");
  SB_CHECK_NEAR(SbMaterialWaveModulus(m), 6e3, 1e-9, "wave modulus");
  SB_CHECK(m->tangent == SB_TANGENT_EXACT_SPD && !m->linear, "defaults of the co-rotated law");
  PetscCall(SbMaterialDestroy(&m));
  SB_CHECK(!m, "destroy leaves a pointer");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("corotated", "5e3", "0.25", NULL, "warped", &m));
  SB_CHECK(m->tangent == SB_TANGENT_WARPED && m->ops.frame, "warped from the options");
  SB_CHECK_NEAR(m->density, 1000, 0, "density by default");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("stable_neohookean", "5e3", "-0.25", "1", "exact_spd", &m));
  SB_CHECK(m->tangent == SB_TANGENT_EXACT_SPD, "exact_spd of stable_neohookean");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("stvk", "5e3", "0.4999", "1", NULL, &m));
  SB_CHECK(m->tangent == SB_TANGENT_EXACT_SPD, "default of stvk");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("linear", "1e12", "0", "1", NULL, &m));
  SB_CHECK(m->linear && SbMaterialVolumetricModulus(m) == 0, "linear law");
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refusals(void)
{
  static const struct {
    const char *law, *young, *poisson, *density, *tangent, *names;
  } refused[] = {
    {"corotatd", "5e3", "0.25", "1", NULL, "\"corotatd\""},
    {"corotated", NULL, "0.25", "1", NULL, "-body_bcorotated_young|(0, inf)"},
    {"corotated", "-1", "0.25", "1", NULL, "-body_bcorotated_young -1 Pa|(0, inf) Pa"},
    {"corotated", "5e3", NULL, "1", NULL, "-body_bcorotated_poisson|(-1, 0.5)"},
    {"corotated", "5e3", "0.5", "1", NULL, "-body_bcorotated_poisson 0.5|(-1, 0.5)"},
    {"corotated", "5e3", "-1", "1", NULL, "-body_bcorotated_poisson -1|(-1, 0.5)"},
    {"corotated", "5e3", "0.3", "0", NULL, "-body_bcorotated_density 0 kg/m^3|(0, inf) kg/m^3"},
    {"corotated", "5e3", "0.3", "1", "exakt", "-body_bcorotated_tangent exakt|exact"},
    {"stvk", "5e3", "0.3", "1", "warped", "-body_bstvk_tangent warped"},
  };
  SbMaterial m;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(refused); k++)
    SB_CHECK_ERROR(create(refused[k].law, refused[k].young, refused[k].poisson, refused[k].density,
                          refused[k].tangent, &m),
                   PETSC_ERR_USER, refused[k].names);
  SB_CHECK_ERROR(SbMaterialCreateElastic("rubber", 1, 0.3, 1, &m), PETSC_ERR_USER, "\"rubber\"");
  PetscCall(create("linear", "1", "0", "1", NULL, &m));
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbMaterialRegisterAll());
  PetscCall(test_options());
  PetscCall(test_refusals());
  PetscCall(SbOptionsReset());
  PetscCall(PetscOptionsClear(NULL));
  SB_TEST_END();
}
