/*
  Law of Holzapfel and Ogden (2009) for passive heart muscle, with fibres f and sheets s:

    psi = a/(2 b) (exp(b x1) - 1) + sum_(i = f, s) a_i/(2 b_i) (exp(b_i <I4i - 1>^2) - 1)
          + a_fs/(2 b_fs) (exp(b_fs I8^2) - 1) + K/2 theta^2,

  I4i = i . C i and I8 = f . C s of the isochoric part; fibres and sheets bear tension only. In the
  strain E of fibrous.h I4f - 1 = 2 Eff, I8 = 2 Efs. At rest the shear modulus is a + a_fs/5: the
  mean over all directions, as a_fs resists one of five shears.
*/
#include "fibrous.h"

typedef struct {
  SbFibrous fibrous;
  PetscReal a, b;
  PetscReal of[3][2]; /* a_i, b_i of fibre, sheet, and both */
} HolzapfelOgden;

SB_KERNEL static void shape_ho(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                               SbShapeEnergy *w)
{
  const HolzapfelOgden *law = (const HolzapfelOgden *)m->data;

  (void)x2;
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal y = law->b * x1[l];
    const PetscReal more = expm1(y);
    const PetscReal part = y > SB_FIBRE_LIMIT ? NAN : 1 + more;

    w->W[l] = y > SB_FIBRE_LIMIT ? INFINITY : law->a / 2 * (law->b > 0 ? more / law->b : x1[l]);
    w->W1[l] = law->a / 2 * part;
    w->W11[l] = law->a / 2 * law->b * part;
  }
}

static void fibre_ho(const struct _p_SbMaterial *m, int level, const SbPack E[6], SbFibreEnergy *w)
{
  static const PetscReal G[3][6] = {{2, 0, 0, 0, 0, 0}, {0, 0, 0, 2, 0, 0}, {0, 1, 0, 0, 0, 0}};
  const HolzapfelOgden *law = (const HolzapfelOgden *)m->data;

  SbFibreClear(level, w);
  for (int i = 0; i < 3; i++)
    if (law->of[i][0] > 0)
      SbFibreAddExponential(law->of[i][0], law->of[i][1], (PetscBool)(i == 2), G[i], level, E, w);
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  static const char *const key[3][2] = {{"a_f", "b_f"}, {"a_s", "b_s"}, {"a_fs", "b_fs"}};
  HolzapfelOgden *law = (HolzapfelOgden *)m->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "a", &law->a));
  PetscCall(SbOptionReal(scope, "b", &law->b));

  // without a stiffness its exponent is not read, so that it is said to be unused
  for (int i = 0; i < 3; i++) {
    PetscCall(SbOptionReal(scope, key[i][0], &law->of[i][0]));
    if (law->of[i][0] > 0)
      PetscCall(SbOptionReal(scope, key[i][1], &law->of[i][1]));
  }
  law->fibrous.isochoric.shape = shape_ho;
  law->fibrous.fibre = fibre_ho;
  PetscCall(SbFibresRead(m, scope, (PetscBool)(law->of[1][0] > 0 || law->of[2][0] > 0)));
  PetscCall(SbIsochoricSetFromOptions(m, scope, law->a + law->of[2][0] / 5, "a + a_fs / 5"));
  m->rest->fibre = PetscMax(PetscMax(4 * law->of[0][0], 4 * law->of[1][0]), 1.6 * law->of[2][0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"a", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "shear modulus of the matrix"},
  {"b", SB_OPTION_REAL, 1, "", NULL, "[0, inf)", "how fast it stiffens"},
  {"a_f", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)", "stiffness of the fibres in tension"},
  {"b_f", SB_OPTION_REAL, 1, "", "0", "[0, inf)", "how fast they stiffen"},
  {"a_s", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)", "stiffness of the sheets in tension"},
  {"b_s", SB_OPTION_REAL, 1, "", "0", "[0, inf)", "how fast they stiffen"},
  {"a_fs", SB_OPTION_REAL, 1, "Pa", "0", "[0, inf)", "of shear between fibre and sheet"},
  {"b_fs", SB_OPTION_REAL, 1, "", "0", "[0, inf)", "how fast it stiffens"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialHolzapfelOgden = {
  .name = "holzapfel_ogden",
  .size = sizeof(HolzapfelOgden),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .limited = PETSC_TRUE,
  .fibres = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_FIBROUS_OPS},
};
