/*
  Law of Holzapfel, Gasser and Ogden for arteries and other tissue with families of fibres, with
  dispersion (Gasser, Ogden and Holzapfel 2006):

    psi = mu/2 x1 + sum_i k1/(2 k2) (exp(k2 <E_i>^2) - 1) + K/2 theta^2,
    E_i = kappa (I1 - 3) + (1 - 3 kappa) (a_i . C a_i - 1),

  I1 and C those of the isochoric part, <E> = E where a family is stretched, E > 0, else 0. Family i
  lies in the plane of the first two axes of the cell, at the angle b_i to the first:
  a_i = cos b_i f + sin b_i s. kappa 0: all fibres along a_i; 1/3: none has a direction. At rest
  the fibres bear nothing, and the shear modulus is mu.

  E_i = 2 H_i : E with H_i = kappa I + (1 - 3 kappa) a_i a_i^T, in the strain E of fibrous.h.
*/
#include "fibrous.h"

#define FAMILIES 8 /* at most */

typedef struct {
  SbFibrous fibrous;
  PetscReal mu, k1, k2, kappa;
  PetscInt n;
  PetscReal G[FAMILIES][6]; /* 2 H_i in the axes */
} Hgo;

static void shape_hgo(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                      SbShapeEnergy *w)
{
  const PetscReal c[1] = {((const Hgo *)m->data)->mu / 2};

  (void)x2;
  SbShapePolynomial(1, c, x1, w);
}

static void fibre_hgo(const struct _p_SbMaterial *m, int level, const SbPack E[6], SbFibreEnergy *w)
{
  const Hgo *law = (const Hgo *)m->data;

  SbFibreClear(level, w);
  for (PetscInt i = 0; i < law->n; i++)
    SbFibreAddExponential(law->k1, law->k2, PETSC_FALSE, law->G[i], level, E, w);
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  Hgo *law = (Hgo *)m->data;
  PetscReal angle[FAMILIES];
  PetscBool plane = PETSC_FALSE;
  char text[512], option[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "mu", &law->mu));
  PetscCall(SbOptionReal(scope, "k1", &law->k1));
  PetscCall(SbOptionReal(scope, "k2", &law->k2));
  PetscCall(SbOptionReal(scope, "kappa", &law->kappa));
  PetscCheck(law->kappa <= 1. / 3., PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_kappa %g: the dispersion is in [0, 1/3]", scope->klass, scope->instance,
             (double)law->kappa);
  SbOptionName(scope, "angles", sizeof(option), option);
  PetscCall(SbOptionString(scope, "angles", sizeof(text), text));
  law->n = SbParseNumbers(text, FAMILIES, angle);
  PetscCheck(law->n > 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s is no list of 1 to %d numbers with commas between them: one for each family of "
             "fibres, in degrees",
             option, text, FAMILIES);
  for (PetscInt i = 0; i < law->n; i++) {
    const PetscReal b = angle[i] * PETSC_PI / 180;
    const PetscReal c = PetscCosReal(b);
    const PetscReal s = PetscSinReal(b);
    const PetscReal part = 1 - 3 * law->kappa;
    const PetscReal H[6] = {
      law->kappa + part * c * c, part * c * s, 0, law->kappa + part * s * s, 0, law->kappa};

    for (int n = 0; n < 6; n++)
      law->G[i][n] = 2 * H[n];
    plane = (PetscBool)(plane || angle[i] != 0);
  }
  law->fibrous.isochoric.shape = shape_hgo;
  law->fibrous.fibre = fibre_hgo;
  PetscCall(SbFibresRead(m, scope, plane));
  PetscCall(SbIsochoricSetFromOptions(m, scope, law->mu, "mu"));
  for (PetscInt i = 0; i < law->n; i++)
    m->rest->fibre += law->k1 * SbFibreSquare(law->G[i]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"mu", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "shear modulus of the matrix"},
  {"k1", SB_OPTION_REAL, 1, "Pa", NULL, "[0, inf)",
   "stiffness of a family of fibres at small stretches, in psi = k1/(2 k2) (exp(k2 E^2) - 1)"},
  {"k2", SB_OPTION_REAL, 1, "", NULL, "[0, inf)", "how fast the fibres stiffen; 0: k1/2 E^2"},
  {"kappa", SB_OPTION_REAL, 1, "", "0", "[0, 0.33333333333333337]",
   "dispersion: 0, all fibres of a family along its direction, to 1/3, in all directions alike"},
  {"angles", SB_OPTION_STRING, 1, "degree", "0", "",
   "one number for each family of fibres, up to 8 with commas: the angle of its direction to "
   "`fibre`, in the plane of fibre and sheet"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialHolzapfelGasserOgden = {
  .name = "holzapfel_gasser_ogden",
  .size = sizeof(Hgo),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .limited = PETSC_TRUE,
  .fibres = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_FIBROUS_OPS},
};
