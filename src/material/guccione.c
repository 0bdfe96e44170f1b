/*
  Law of Guccione, McCulloch and Waldman (1991) for passive heart muscle:

    psi = C/2 (exp(Q) - 1) + K/2 theta^2,
    Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2),

  E the strain of the isochoric part in the axes of the cell: fibre f, sheet s, normal n. With bf =
  bt = bfs it is isotropic. s and n may be exchanged or turned about f: the law needs the fibre
  only.

  At rest psi is C/2 Q. Its shear modulus is the mean over all directions, a tenth of the trace over
  strains without change of volume: C (2/3 (bf + 2 bt) + bt + 2 bfs) / 10.
*/
#include "fibrous.h"

typedef struct {
  SbFibrous fibrous;
  PetscReal C, b[6];
} Guccione;

SB_KERNEL static void fibre_guccione(const struct _p_SbMaterial *m, int level,
                                     const SbPack E[restrict 6], SbFibreEnergy *restrict w)
{
  static const PetscReal twice[6] = {1, 2, 2, 1, 2, 1};
  const Guccione *law = (const Guccione *)m->data;
  SbPack part, b[6];

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal Q = 0;

    for (int n = 0; n < 6; n++) {
      b[n][l] = law->b[n] * E[n][l];
      Q += twice[n] * b[n][l] * E[n][l];
    }
    const PetscReal more = expm1(Q);

    w->W[l] = Q > SB_FIBRE_LIMIT ? INFINITY : law->C / 2 * more;
    part[l] = Q > SB_FIBRE_LIMIT ? NAN : law->C * (1 + more);
  }
  for (int n = 0; level > 0 && n < 6; n++)
    for (int l = 0; l < SB_BATCH; l++)
      w->S[n][l] = part[l] * b[n][l];
  for (int n = 0; level > 1 && n < 6; n++) {
    for (int i = 0; i < 6; i++) {
      const PetscReal own = n == i ? law->b[n] / twice[n] : 0;

      for (int l = 0; l < SB_BATCH; l++)
        w->C[n][i][l] = part[l] * (own + 2 * b[n][l] * b[i][l]);
    }
  }
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  Guccione *law = (Guccione *)m->data;
  PetscReal bf, bt, bfs;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "c", &law->C));
  PetscCall(SbOptionReal(scope, "bf", &bf));
  PetscCall(SbOptionReal(scope, "bt", &bt));
  PetscCall(SbOptionReal(scope, "bfs", &bfs));
  law->b[0] = bf;
  law->b[1] = law->b[2] = bfs;
  law->b[3] = law->b[4] = law->b[5] = bt;
  law->fibrous.isochoric.shape = SbFibrousNoMatrix;
  law->fibrous.fibre = fibre_guccione;
  PetscCall(SbFibresRead(m, scope, PETSC_FALSE));
  PetscCall(SbIsochoricSetFromOptions(
    m, scope, law->C * (2. / 3. * (bf + 2 * bt) + bt + 2 * bfs) / 10, "that of c, bf, bt and bfs"));
  m->rest->fibre = law->C * PetscMax(bf, PetscMax(bt, bfs)) - 2 * m->rest->mu;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"c", SB_OPTION_REAL, 1, "Pa", NULL, "(0, inf)", "factor C in psi = C/2 (exp(Q) - 1)"},
  {"bf", SB_OPTION_REAL, 1, "", NULL, "(0, inf)", "factor in Q of the strain along the fibres"},
  {"bt", SB_OPTION_REAL, 1, "", NULL, "(0, inf)", "of strains across them, in two directions"},
  {"bfs", SB_OPTION_REAL, 1, "", NULL, "(0, inf)", "of shear between along and across"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialGuccione = {
  .name = "guccione",
  .size = sizeof(Guccione),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .limited = PETSC_TRUE,
  .fibres = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options, SB_FIBROUS_OPS},
};
