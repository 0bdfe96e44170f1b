/*
  Law of Yeoh (1993) for filled rubber: a cubic in the first invariant of the isochoric part,

    psi = c1 x1 + c2 x1^2 + c3 x1^3 + K/2 theta^2,   x1 = J^(-2/3) I1 - 3

  (isochoric.h). The shear modulus at rest is 2 c1; c2 < 0 makes it fall with the strain, c3 > 0
  makes it rise again, as chains reach their full length.
*/
#include "isochoric.h"

typedef struct {
  SbIsochoric isochoric;
  PetscReal c[3];
} Yeoh;

SB_KERNEL static void shape_yeoh(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                                 SbShapeEnergy *w)
{
  (void)x2;
  SbShapePolynomial(3, ((const Yeoh *)m->data)->c, x1, w);
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  Yeoh *law = (Yeoh *)m->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "c1", &law->c[0]));
  PetscCall(SbOptionReal(scope, "c2", &law->c[1]));
  PetscCall(SbOptionReal(scope, "c3", &law->c[2]));
  law->isochoric.shape = shape_yeoh;
  PetscCall(SbIsochoricSetFromOptions(m, scope, 2 * law->c[0], "2 c1"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"c1", SB_OPTION_REAL, 1, "Pa", NULL, "(-inf, inf)",
   "factor of x1 = J^(-2/3) I1 - 3 in the energy; the shear modulus at rest is 2 c1"},
  {"c2", SB_OPTION_REAL, 1, "Pa", "0", "(-inf, inf)", "factor of x1^2 in the energy"},
  {"c3", SB_OPTION_REAL, 1, "Pa", "0", "(-inf, inf)", "factor of x1^3 in the energy"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialYeoh = {
  .name = "yeoh",
  .size = sizeof(Yeoh),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_ISOCHORIC_OPS},
};
