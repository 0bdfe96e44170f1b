// @ranks 1 3
/* Creation of laws by name and from options, what is refused and how, numbers derived from E, nu and density. */
#include "../test.h"
#include <sbmaterial.h>

/* Options of a body, one for each law, read as the program does. */
static PetscErrorCode create(const char *law, const char *young, const char *poisson, const char *density,
                             const char *tangent, SbMaterial *m)
{
  const char *keys[4] = {"young", "poisson", "density", "tangent"},
             *values[4] = {young, poisson, density, tangent};
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
  PetscCall(SbScopeSet(&scope, "body", "", "b"));
  PetscCall(PetscStrlcat(scope.instance, law, sizeof(scope.instance)));
  PetscCall(SbMaterialCreate(law, &scope, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_options(void)
{
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(create("corotated", "5e3", "0.25", "1060", NULL, &m));
  SB_CHECK_NEAR(m->E, 5e3, 0, "E");
  SB_CHECK_NEAR(m->ops.shear_modulus(m), 2e3, 1e-9, "mu");
  SB_CHECK_NEAR(m->ops.volumetric_modulus(m), 2e3, 1e-9, "lambda");
  SB_CHECK_NEAR(m->ops.wave_speed(m), sqrt(6e3 / 1060), 1e-12, "wave speed");
  SB_CHECK(m->tangent == SB_TANGENT_EXACT_SPD && !m->linear, "defaults of the co-rotated law");
  PetscCall(SbMaterialDestroy(&m));
  SB_CHECK(!m, "destroy leaves a pointer");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("corotated", "5e3", "0.25", NULL, "warped", &m));
  SB_CHECK(m->tangent == SB_TANGENT_WARPED && m->ops.frame, "warped from the options");
  SB_CHECK_NEAR(m->density, 1000, 0, "density by default");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("neohookean", "5e3", "-0.25", "1", "exact_spd", &m));
  SB_CHECK(m->tangent == SB_TANGENT_EXACT_SPD, "exact_spd of neohookean");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("stvk", "5e3", "0.4999", "1", NULL, &m));
  SB_CHECK(m->tangent == SB_TANGENT_EXACT_SPD, "default of stvk");
  PetscCall(SbMaterialDestroy(&m));
  PetscCall(create("linear", "1e12", "0", "1", NULL, &m));
  SB_CHECK(m->linear && m->ops.volumetric_modulus(m) == 0, "linear law");
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refusals(void)
{
  SbMaterial m;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(create("corotatd", "5e3", "0.25", "1", NULL, &m), "unknown law");
  SB_CHECK_ERROR(create("corotated", NULL, "0.25", "1", NULL, &m), "no Young's modulus");
  SB_CHECK_ERROR(create("corotated", "-1", "0.25", "1", NULL, &m), "negative Young's modulus");
  SB_CHECK_ERROR(create("corotated", "5e3", NULL, "1", NULL, &m), "no Poisson's ratio");
  SB_CHECK_ERROR(create("corotated", "5e3", "0.5", "1", NULL, &m), "Poisson's ratio 0.5");
  SB_CHECK_ERROR(create("corotated", "5e3", "-1", "1", NULL, &m), "Poisson's ratio -1");
  SB_CHECK_ERROR(create("corotated", "5e3", "0.3", "0", NULL, &m), "density 0");
  SB_CHECK_ERROR(create("corotated", "5e3", "0.3", "1", "exakt", &m), "unknown tangent");
  SB_CHECK_ERROR(create("stvk", "5e3", "0.3", "1", "warped", &m), "warped tangent of stvk");
  SB_CHECK_ERROR(SbMaterialCreateElastic("linear", PETSC_INFINITY, 0.3, 1, &m), "infinite Young's modulus");
  SB_CHECK_ERROR(SbMaterialCreateElastic("linear", 1, NAN, 1, &m), "Poisson's ratio NaN");
  SB_CHECK_ERROR(SbMaterialCreateElastic("linear", 1, 0.5, 1, &m), "Poisson's ratio 0.5 from a number");
  SB_CHECK_ERROR(SbMaterialCreateElastic("linear", 0, 0.3, 1, &m), "Young's modulus 0 from a number");
  SB_CHECK_ERROR(SbMaterialCreateElastic("linear", 1, 0.3, 0, &m), "density 0 from a number");
  SB_CHECK_ERROR(SbMaterialCreateElastic("rubber", 1, 0.3, 1, &m), "unknown law from a number");
  PetscCall(create("linear", "1", "0", "1", NULL, &m));
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static char the_message[1024];
static PetscErrorCode keep_message(MPI_Comm comm, int line, const char *function, const char *file,
                                   PetscErrorCode n, PetscErrorType p, const char *message, void *ctx)
{
  (void)comm;
  (void)line;
  (void)function;
  (void)file;
  (void)ctx;
  if (p == PETSC_ERROR_INITIAL) (void)snprintf(the_message, sizeof(the_message), "%s", message);
  return n;
}

/* The message for a misspelt law names the option, the law and what there is. */
static PetscErrorCode test_message(void)
{
  const char *parts[] = {
    "-body_bcorotatd_material", "\"corotatd\"", "did you mean corotated", "linear", "stvk", "neohookean"};
  SbMaterial m;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscPushErrorHandler(keep_message, NULL));
  ierr = create("corotatd", "1", "0", "1", NULL, &m);
  PetscCall(PetscPopErrorHandler());
  SB_CHECK(ierr == PETSC_ERR_USER, "error code %d", (int)ierr);
  for (size_t k = 0; k < sizeof(parts) / sizeof(parts[0]); k++) {
    SB_CHECK(strstr(the_message, parts[k]) != NULL, "\"%s\" is missing in \"%s\"", parts[k], the_message);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbMaterialRegisterAll());
  PetscCall(test_options());
  PetscCall(test_refusals());
  PetscCall(test_message());
  PetscCall(SbOptionsReset());
  PetscCall(PetscOptionsClear(NULL));
  SB_TEST_END();
}
