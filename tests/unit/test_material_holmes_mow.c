// @ranks 1
/*
  Holmes and Mow's law against its closed form in confined compression,

    P = M/2 (s^2 - 1) s^(-2 beta - 1) exp(beta (s^2 - 1)),   M = lambda + 2 mu,

  its energy as printed, in invariants, and its limits.
*/
#include "../laws.h"
#include "material_checks.h"

static PetscErrorCode law_of(const char *beta, PetscReal nu, SbMaterial *m)
{
  char text[256];
  SbScope scope;

  PetscFunctionBeginUser;
  SbFormat(sizeof(text), text,
           "-body_sample_young 1e6 -body_sample_poisson %g -body_sample_density 1000 "
           "-body_sample_beta %s",
           (double)nu, beta);
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(PetscOptionsInsertString(NULL, text));
  SbScopeSet(&scope, "body", "", "sample");
  PetscCall(SbMaterialCreate("holmes_mow", &scope, m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *text, PetscReal nu)
{
  const PetscReal beta = atof(text);
  const PetscReal lambda = 1e6 * nu / ((1 + nu) * (1 - 2 * nu));
  const PetscReal mu = 1e6 / (2 * (1 + nu));
  const PetscReal M = lambda + 2 * mu;
  SbMaterial m;

  PetscFunctionBeginUser;
  PetscCall(law_of(text, nu, &m));
  for (PetscReal s = 0.3; s < 1.55; s += 0.1) {
    const PetscReal F[9] = {1, 0, 0, 0, 1, 0, 0, 0, s};
    const PetscReal closed = M / 2 * (s * s - 1) * pow(s, -2 * beta - 1) * exp(beta * (s * s - 1));
    PetscReal P[9];

    stress_of(m, F, P);
    SB_CHECK_NEAR(P[8], closed, 1e-12 * (fabs(closed) + M), "confined stress");
  }
  for (int k = 0; k < 5; k++) {
    PetscReal F[9], c[9];

    for (int i = 0; i < 9; i++)
      F[i] = (i % 4 == 0) + 0.1 * sin(3. * i + 7. * k);
    SbMatCofactor(F, c);
    const PetscReal Q = beta / M *
                        ((2 * mu - lambda) * (SbDot9(F, F) - 3) + lambda * (SbDot9(c, c) - 3) -
                         2 * M * log(SbDot3(F, c)));

    SB_CHECK_NEAR(energy_of(m, F), M / (4 * beta) * (exp(Q) - 1), 1e-10 * M, "energy as printed");
  }
  {
    const PetscReal flat[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1e-80};
    const PetscReal mirror[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1};

    SB_CHECK(isinf(energy_of(m, flat)), "finite at no volume, beta %g", (double)beta);
    SB_CHECK(isinf(energy_of(m, mirror)), "finite behind a mirror");
  }
  PetscCall(SbMaterialDestroy(&m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbMaterialRegisterAll());
  PetscCall(check("2", 0.1));
  PetscCall(check("1", 0.3));
  PetscCall(check("1.5", 0.));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
