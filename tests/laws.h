/*
  laws.h - any law of the registry with a given stiffness at rest, for tests that loop over all.

  A law with moduli of its own needs a row in the table below, or the tests say so.
*/
#pragma once
#include <sbmaterial.h>
#include <string.h>
#include "test.h"

/* Options of a law in typical proportions, for a shear modulus of 1: "key number number ... of the
   shear modulus" or "key=text". */
static const struct {
  const char *law;
  struct {
    const char *key;
    double value[3]; /* in shear moduli; 0: no more */
    const char *text;
  } option[10];
} law_samples[] = {
  {"mooney_rivlin",
   {{"c10", {0.4}, NULL},
    {"c01", {0.1}, NULL},
    {"c20", {-0.01}, NULL},
    {"c11", {0.004}, NULL},
    {"c02", {0.002}, NULL},
    {"c30", {0.003}, NULL},
    {"c21", {0.0005}, NULL},
    {"c12", {0.0004}, NULL},
    {"c03", {0.0003}, NULL}}},
  {"yeoh",
   {{"c1", {0.5}, NULL},
    {"c2", {-0.01}, NULL},
    {"c3", {0.001}, NULL},
    {"volumetric", {0}, "quadratic"}}},
  {"ogden",
   {{"mu", {0.63 / 0.4225, 0.0012 / 0.4225, -0.01 / 0.4225}, NULL}, {"alpha", {0}, "1.3,5,-2"}}},
  {"gent", {{"mu", {1}, NULL}, {"jm", {0}, "60"}, {"volumetric", {0}, "logarithmic"}}},
  {"arruda_boyce",
   {{"mu",
     {1 / (1 + 3. / 5 / 9 + 99. / 175 / 81 + 513. / 875 / 729 + 42039. / 67375 / 6561)},
     NULL},
    {"lambda_m", {0}, "3"}}},
  {"transversely_isotropic",
   {{"mu", {0.7}, NULL}, {"mu_fibre", {1.1}, NULL}, {"young_fibre", {3 * 0.7 + 15 * 0.14}, NULL}}},
  {"holzapfel_gasser_ogden",
   {{"mu", {1}, NULL},
    {"k1", {0.8}, NULL},
    {"k2", {0}, "0.5"},
    {"kappa", {0}, "0.1"},
    {"angles", {0}, "30,-50"},
    {"sheet", {0}, "0,1,0"}}},
  {"guccione", {{"c", {1 / 1.8}, NULL}, {"bf", {0}, "8"}, {"bt", {0}, "2"}, {"bfs", {0}, "4"}}},
  {"holzapfel_ogden",
   {{"a", {0.9}, NULL},
    {"b", {0}, "0.6"},
    {"a_f", {1.2}, NULL},
    {"b_f", {0}, "0.8"},
    {"a_s", {0.4}, NULL},
    {"b_s", {0}, "0.5"},
    {"a_fs", {0.5}, NULL},
    {"b_fs", {0}, "0.4"},
    {"sheet", {0}, "0,1,0"}}},
};

/*
  law_moduli - options of a law with moduli of its own, for the body `name`, Young's modulus E (Pa)
  and Poisson's ratio nu, beside material, young and poisson, which the scene gives; "" for another
  law. Valid until the next call. Not collective.
*/
static inline const char *law_moduli(const char *law, const char *name, double E, double nu)
{
  static char text[1024];
  const SbMaterialType *type = SbMaterialFind(law);
  const double mu = E / (2 * (1 + nu));
  PetscBool found = PETSC_FALSE;

  text[0] = 0;
  if (!type || !type->own_moduli)
    return text;
  for (size_t i = 0; i < sizeof(law_samples) / sizeof(*law_samples); i++) {
    if (strcmp(law_samples[i].law, law))
      continue;
    found = PETSC_TRUE;
    for (int k = 0; k < 10 && law_samples[i].option[k].key; k++) {
      SbAppend(sizeof(text), text, " -body_%s_%s ", name, law_samples[i].option[k].key);
      if (law_samples[i].option[k].text)
        SbAppend(sizeof(text), text, "%s", law_samples[i].option[k].text);
      for (int n = 0; n < 3 && law_samples[i].option[k].value[n] != 0; n++)
        SbAppend(sizeof(text), text, "%s%.17g", n ? "," : "",
                 mu * law_samples[i].option[k].value[n]);
    }
  }
  SB_CHECK(found, "%s has moduli of its own and no row in tests/laws.h", law);
  return text;
}

/* Whether a law does not split shape from volume and is unstable near nu = 1/2: lambda > 2 mu. */
static inline PetscBool law_is_compressible(const char *law)
{
  return (PetscBool)!strcmp(law, "holmes_mow");
}

/* SbMaterialCreateElastic() for any law. The caller destroys the material. Not collective. */
static inline PetscErrorCode law_create(const char *law, PetscReal E, PetscReal nu,
                                        PetscReal density, SbMaterial *m)
{
  const SbMaterialType *type = SbMaterialFind(law);
  char text[256];
  SbScope scope;

  PetscFunctionBeginUser;
  if (!type || !type->own_moduli) {
    PetscCall(SbMaterialCreateElastic(law, E, nu, density, m));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscOptionsInsertString(NULL, law_moduli(law, "sample", (double)E, (double)nu)));
  SbFormat(sizeof(text), text, "-body_sample_poisson %.17g -body_sample_density %.17g", (double)nu,
           (double)density);
  PetscCall(PetscOptionsInsertString(NULL, text));
  SbScopeSet(&scope, "body", "", "sample");
  PetscCall(SbMaterialCreate(law, &scope, m));
  PetscCall(SbMaterialSetTangent(*m, SB_TANGENT_EXACT));
  PetscFunctionReturn(PETSC_SUCCESS);
}
