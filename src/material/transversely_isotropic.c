/*
  Law of a material with one direction f of its own, in tension and compression alike:

    psi = mu/2 x1 + k/8 (I4 - 1)^2 + (mu_f - mu)/2 (I5 - I4^2) + K/2 theta^2,

  I4 = f . C f and I5 = f . C^2 f of the isochoric part, invariants as in Spencer 1984. For small
  strains and K/mu -> inf it has the shear moduli mu across f and mu_f along f, and Young's modulus
  3 mu + k along f: the three constants of an incompressible material that is isotropic about f.

  In the strain E of fibrous.h, I4 - 1 = 2 Eff and I5 - I4^2 = 4 (Efs^2 + Efn^2). The shear modulus
  at rest is the mean over all directions, mu + k/15 + 2/5 (mu_f - mu).
*/
#include "fibrous.h"

typedef struct {
  SbFibrous fibrous;
  PetscReal mu, b[6]; /* S_n = b_n E_n */
} Transverse;

static void shape_transverse(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                             SbShapeEnergy *w)
{
  const PetscReal c[1] = {((const Transverse *)m->data)->mu / 2};

  (void)x2;
  SbShapePolynomial(1, c, x1, w);
}

SB_KERNEL static void fibre_transverse(const struct _p_SbMaterial *m, int level,
                                       const SbPack E[restrict 6], SbFibreEnergy *restrict w)
{
  const PetscReal *b = ((const Transverse *)m->data)->b;

  SbFibreClear(level, w);
  for (int l = 0; l < SB_BATCH; l++)
    w->W[l] = b[0] / 2 * E[0][l] * E[0][l] + b[1] * (E[1][l] * E[1][l] + E[2][l] * E[2][l]);
  for (int n = 0; level > 0 && n < 3; n++)
    for (int l = 0; l < SB_BATCH; l++)
      w->S[n][l] = b[n] * E[n][l];
  for (int n = 0; level > 1 && n < 3; n++)
    for (int l = 0; l < SB_BATCH; l++)
      w->C[n][n][l] = n ? b[n] / 2 : b[n];
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  Transverse *law = (Transverse *)m->data;
  PetscReal young, along, k;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "mu", &law->mu));
  PetscCall(SbOptionReal(scope, "mu_fibre", &along));
  PetscCall(SbOptionReal(scope, "young_fibre", &young));
  k = young - 3 * law->mu;
  law->b[0] = k;
  law->b[1] = law->b[2] = 2 * (along - law->mu);
  law->fibrous.isochoric.shape = shape_transverse;
  law->fibrous.fibre = fibre_transverse;
  PetscCall(SbFibresRead(m, scope, PETSC_FALSE));
  PetscCall(SbIsochoricSetFromOptions(m, scope, law->mu + k / 15 + 0.4 * (along - law->mu),
                                      "that of mu, mu_fibre and young_fibre"));
  m->rest->fibre = PetscMax(0, PetscMax(k, 2 * (along - law->mu))) + 2 * (law->mu - m->rest->mu);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"mu", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "shear modulus across the fibres"},
  {"mu_fibre", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "shear modulus along the fibres"},
  {"young_fibre", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)",
   "Young's modulus along the fibres, of an incompressible body; 3 mu: they do not stiffen it"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialTransverselyIsotropic = {
  .name = "transversely_isotropic",
  .size = sizeof(Transverse),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .fibres = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_FIBROUS_OPS},
};
