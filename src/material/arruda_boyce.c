/*
  Eight-chain law of Arruda and Boyce (1993) for rubber, by the first five terms of the series of
  the inverse Langevin function, as Abaqus and CalculiX have it: finite at every stretch, within 3 %
  of the exact force up to 0.7 of the full length of the chains. With I1' = J^(-2/3) I1,

    psi = mu sum_i C_i / lambda_m^(2 i - 2) (I1'^i - 3^i) + K/2 theta^2,
    C = 1/2, 1/20, 11/1050, 19/7000, 519/673750,

  a polynomial of x1 = I1' - 3 (isochoric.h). lambda_m is the stretch of a chain at its full length,
  mu the shear modulus of long chains; that at rest is mu (1 + 3/(5 lm^2) + 99/(175 lm^4) + 513/(875
  lm^6) + 42039/(67375 lm^8)), lm = lambda_m.
*/
#include "isochoric.h"

#define TERMS 5

typedef struct {
  SbIsochoric isochoric;
  PetscReal c[TERMS]; /* of x1, x1^2, ..., Pa */
} ArrudaBoyce;

SB_KERNEL static void shape_arruda(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                                   SbShapeEnergy *w)
{
  (void)x2;
  SbShapePolynomial(TERMS, ((const ArrudaBoyce *)m->data)->c, x1, w);
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  static const PetscReal series[TERMS] = {1. / 2, 1. / 20, 11. / 1050, 19. / 7000, 519. / 673750};
  ArrudaBoyce *law = (ArrudaBoyce *)m->data;
  PetscReal mu = 0;
  PetscReal full = 0;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "mu", &mu));
  PetscCall(SbOptionReal(scope, "lambda_m", &full));

  /* (x1 + 3)^i - 3^i = sum_k binomial(i, k) 3^(i - k) x1^k */
  for (int i = 1; i <= TERMS; i++) {
    PetscReal term = mu * series[i - 1] * PetscPowReal(3. / (full * full), i - 1) * 3;

    for (int k = 1; k <= i; k++) {
      term *= (i - k + 1) / (3. * k);
      law->c[k - 1] += term;
    }
  }
  law->isochoric.shape = shape_arruda;
  PetscCall(SbIsochoricSetFromOptions(m, scope, 2 * law->c[0], "that of mu and lambda_m"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"mu", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)",
   "shear modulus of long chains; that at rest is mu (1 + 3/(5 lambda_m^2) + ...)"},
  {"lambda_m", SB_OPTION_REAL, 1, "", NULL, "(1, inf)",
   "stretch of a chain at its full length, the root of the number of its links"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialArrudaBoyce = {
  .name = "arruda_boyce",
  .size = sizeof(ArrudaBoyce),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_ISOCHORIC_OPS},
};
