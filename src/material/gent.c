/*
  Law of Gent (1996) for rubber whose chains have a full length:

    psi = -mu/2 jm ln(1 - x1/jm) + K/2 theta^2,   x1 = J^(-2/3) I1 - 3

  (isochoric.h). mu is the shear modulus at rest; jm the limit of x1, at which the energy is
  infinite: in uniaxial tension the stretch l with l^2 + 2/l - 3 = jm. With jm -> inf it is the law
  of isochoric_neohookean.c.
*/
#include "isochoric.h"

typedef struct {
  SbIsochoric isochoric;
  PetscReal mu, jm;
} Gent;

SB_KERNEL static void shape_gent(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                                 SbShapeEnergy *w)
{
  const Gent *law = (const Gent *)m->data;

  (void)x2;
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal part = x1[l] / law->jm;
    const PetscReal left = part < 1 ? 1 - part : NAN;

    w->W[l] = part >= 1 ? INFINITY : -law->mu / 2 * law->jm * log1p(-part);
    w->W1[l] = law->mu / 2 / left;
    w->W11[l] = law->mu / 2 / law->jm / (left * left);
  }
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  Gent *law = (Gent *)m->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "mu", &law->mu));
  PetscCall(SbOptionReal(scope, "jm", &law->jm));
  law->isochoric.shape = shape_gent;
  PetscCall(SbIsochoricSetFromOptions(m, scope, law->mu, "mu"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"mu", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "shear modulus at rest"},
  {"jm", SB_OPTION_REAL, 1, "", NULL, "(0, inf)",
   "limit of x1 = J^(-2/3) I1 - 3, at which the energy is infinite: l^2 + 2/l - 3 at the longest "
   "uniaxial stretch l; 30 to 100 for rubber, 0.4 to 3 for tissue"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialGent = {
  .name = "gent",
  .size = sizeof(Gent),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .limited = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_ISOCHORIC_OPS},
};
