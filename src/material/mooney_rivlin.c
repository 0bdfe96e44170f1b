/*
  Polynomials of Rivlin in the invariants of the isochoric part (Mooney 1940; Rivlin and Saunders
  1951), with two, three, five or nine terms:

    psi = sum c_pq x1^p x2^q + K/2 theta^2,   1 <= p + q <= 3,   x1 = J^(-2/3) I1 - 3, x2 alike

  (isochoric.h). The shear modulus at rest is 2 (c10 + c01). c10 alone is the law of
  isochoric_neohookean.c, with mu = 2 c10.
*/
#include "isochoric.h"

static const char *const keys[9] = {"c10", "c01", "c20", "c11", "c02", "c30", "c21", "c12", "c03"};

typedef struct {
  SbIsochoric isochoric;
  PetscReal c[9]; /* in the order of keys */
} MooneyRivlin;

SB_KERNEL static void shape_mooney(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                                   SbShapeEnergy *w)
{
  const PetscReal *c = ((const MooneyRivlin *)m->data)->c;

  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal x = x1[l];
    const PetscReal y = x2[l];

    w->W[l] = x * (c[0] + x * (c[2] + x * c[5]) + y * (c[3] + x * c[6])) +
              y * (c[1] + y * (c[4] + y * c[8] + x * c[7]));
    w->W1[l] = c[0] + x * (2 * c[2] + 3 * x * c[5] + 2 * y * c[6]) + y * (c[3] + y * c[7]);
    w->W2[l] = c[1] + y * (2 * c[4] + 3 * y * c[8] + 2 * x * c[7]) + x * (c[3] + x * c[6]);
    w->W11[l] = 2 * (c[2] + 3 * x * c[5] + y * c[6]);
    w->W12[l] = c[3] + 2 * (x * c[6] + y * c[7]);
    w->W22[l] = 2 * (c[4] + 3 * y * c[8] + x * c[7]);
  }
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  MooneyRivlin *law = (MooneyRivlin *)m->data;

  PetscFunctionBeginUser;
  for (int k = 0; k < 9; k++)
    PetscCall(SbOptionReal(scope, keys[k], &law->c[k]));
  law->isochoric.shape = shape_mooney;
  for (int k = 1; k < 9; k++)
    law->isochoric.second =
      (PetscBool)(law->isochoric.second || (k != 2 && k != 5 && law->c[k] != 0));
  PetscCall(SbIsochoricSetFromOptions(m, scope, 2 * (law->c[0] + law->c[1]), "2 (c10 + c01)"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define TERM(key, product)                                                                  \
  {                                                                                         \
    key, SB_OPTION_REAL, 1, "Pa", "0", "(-inf, inf)", "factor of " product " in the energy" \
  }

static const SbOption rows[] = {
  {"c10", SB_OPTION_REAL, 1, "Pa", NULL, "(-inf, inf)",
   "factor of x1 = J^(-2/3) I1 - 3 in the energy; the shear modulus at rest is 2 (c10 + c01)"},
  {"c01", SB_OPTION_REAL, 1, "Pa", "0", "(-inf, inf)",
   "factor of x2 = J^(-4/3) I2 - 3 in the energy"},
  TERM("c20", "x1^2"),
  TERM("c11", "x1 x2"),
  TERM("c02", "x2^2"),
  TERM("c30", "x1^3"),
  TERM("c21", "x1^2 x2"),
  TERM("c12", "x1 x2^2"),
  TERM("c03", "x2^3"),
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialMooneyRivlin = {
  .name = "mooney_rivlin",
  .size = sizeof(MooneyRivlin),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_ISOCHORIC_OPS},
};
