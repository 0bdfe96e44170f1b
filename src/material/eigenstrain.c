/*
  Strains without stress, of any law: growth, thermal expansion, prestrain, active strain.

  A free cell takes the stretches of F_g without stress, and stores the energy of the elastic part
  of F (Rodriguez, Hoger and McCulloch 1994; Lubarda and Hoger 2002): with A = F_g^-1

    F = F_e F_g,   psi = J_g psi_e(F A),   P = J_g P_e A,   dP = J_g (C_e : dF A) A,

  per volume at rest, J_g = det F_g. F_g is symmetric, with the stretches l along the fibres f and m
  across,

    F_g = l f f^T + m (1 - f f^T),
    l = (1 + g) (1 + g_f) (1 + alpha T) s,   m = (1 + g) (1 + g_p) (1 + alpha T) / sqrt(s),

  g, g_f and g_p growth in all directions, along and across the fibres, T a temperature, and s what
  keeps the volume: (1 + a) of an active strain a (Taber and Perucchio 2000; Ambrosi and Pezzuto
  2012) over (1 + e) of a prestrain e, the strain of the fibres at rest.

  The dilatation of the law (SbMaterialOps) becomes sqrt(J_g) theta(F A), so that lambda/2 of its
  square is part of psi, and with its two derivatives takes the place of theta wherever that is
  apart from psi: in the mean of a P2 cell, in pressures as unknowns. Where theta is a function of
  det F, strains that keep the volume leave it alone.

  linear: the strains are small and subtracted, psi = psi_e(F - (F_g - 1)), J_g = 1: the tangent
  stays constant.

  The force on a strain is dpsi/d ln l: J_g (psi_e - f . M f), M = F_e^T P_e (Mandel, Eshelby).

  src/fem/eigenstrain.c has the strains of the cells and their work.
*/
#include "fibrous.h"

static const struct {
  const char *key;
  PetscBool fibres; /* needs their direction */
} terms[SB_EIGEN_TERMS] = {[SB_EIGEN_ACTIVE] = {"active_strain", PETSC_TRUE},
                           [SB_EIGEN_PRESTRAIN] = {"prestrain", PETSC_TRUE},
                           [SB_EIGEN_GROWTH] = {"growth", PETSC_FALSE},
                           [SB_EIGEN_FIBRE] = {"growth_fibre", PETSC_TRUE},
                           [SB_EIGEN_PLANE] = {"growth_plane", PETSC_TRUE},
                           [SB_EIGEN_TEMPERATURE] = {"temperature", PETSC_FALSE}};

PetscErrorCode SbEigenstrainDestroy(SbEigenstrain *eigen)
{
  PetscFunctionBeginUser;
  if (!*eigen)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (int k = 0; k < SB_EIGEN_TERMS; k++)
    PetscCall(SbFormulaDestroy(&(*eigen)->formula[k]));
  PetscCall(PetscFree(*eigen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the formula of a term; NULL where it is 0. */
static PetscErrorCode read_term(const SbScope *scope, int k, SbEigenstrain e)
{
  PetscReal value = 1;

  PetscFunctionBeginUser;
  SbOptionName(scope, terms[k].key, sizeof(e->option[k]), e->option[k]);
  PetscCall(SbOptionFormulas(scope, terms[k].key, &e->formula[k]));
  e->steady[k] = (PetscBool)!SbFormulaUses(e->formula[k], 't');
  if (e->steady[k] && !SbFormulaUses(e->formula[k], 'x'))
    PetscCall(SbFormulaEval(e->formula[k], 0, NULL, &value));
  if (value == 0)
    PetscCall(SbFormulaDestroy(&e->formula[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An expansion or a field without a temperature, and a temperature without an expansion. */
static PetscErrorCode check_temperature(const SbScope *scope, const struct _p_SbEigenstrain *e)
{
  const char *option = e->option[SB_EIGEN_TEMPERATURE];
  char expansion[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  SbOptionName(scope, "thermal_expansion", sizeof(expansion), expansion);
  PetscCheck(!e->formula[SB_EIGEN_TEMPERATURE] || e->expansion != 0, PETSC_COMM_SELF,
             PETSC_ERR_USER, "%s: the body does not expand with it: give %s, 1/K", option,
             expansion);
  PetscCheck(e->formula[SB_EIGEN_TEMPERATURE] || e->expansion == 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %g 1/K is without effect: give %s, K above that without stress, or leave it out",
             expansion, (double)e->expansion, option);
  PetscCheck(e->formula[SB_EIGEN_TEMPERATURE] || !e->field[0], PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s_field %s is without effect: give %s, which multiplies it, as 1", option, e->field,
             option);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEigenstrainRead(SbMaterial m, const SbScope *scope)
{
  const PetscBool by_det = (PetscBool)(m->type->positive || m->type->jacobian);
  const char *first = NULL;
  PetscReal viscosity[2];
  char times[64];
  SbEigenstrain e;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&e));
  m->eigen = e;
  PetscCall(SbOptionReal(scope, "thermal_expansion", &e->expansion));
  PetscCall(SbOptionString(scope, "temperature_field", sizeof(e->field), e->field));
  for (int k = 0; k < SB_EIGEN_TERMS; k++) {
    PetscCall(read_term(scope, k, e));
    first = e->formula[k] && !first ? e->option[k] : first;
  }
  PetscCall(check_temperature(scope, e));
  if (!first) {
    PetscCall(SbEigenstrainDestroy(&m->eigen));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscStrncpy(e->name, first, sizeof(e->name)));

  /* what changes the volume, and what depends on the place within a cell */
  e->isochoric = by_det;
  for (int k = 0; k < SB_EIGEN_TERMS; k++)
    e->changes = (PetscBool)(e->changes || (e->formula[k] && !e->steady[k]));
  for (int k = SB_EIGEN_GROWTH; k < SB_EIGEN_TERMS; k++)
    e->isochoric = (PetscBool)(e->isochoric && !e->formula[k]);
  for (int k = SB_EIGEN_PRESTRAIN; k < SB_EIGEN_TERMS; k++) {
    e->grows = (PetscBool)(e->grows || e->formula[k]);
    e->varies = (PetscBool)(e->varies || (e->formula[k] && SbFormulaUses(e->formula[k], 'x')));
  }

  PetscCall(SbOptionString(scope, "prony_times", sizeof(times), times));
  PetscCall(SbOptionReal(scope, "viscosity", &viscosity[0]));
  PetscCall(SbOptionReal(scope, "viscosity_bulk", &viscosity[1]));
  PetscCheck(!times[0] && viscosity[0] == 0 && viscosity[1] == 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s: the strain of a viscoelastic material has no such part; leave prony_times and "
             "viscosity out%s",
             first, e->formula[SB_EIGEN_ACTIVE] ? ", or take active_tension" : "");
  for (int k = 0; k < SB_EIGEN_TERMS; k++)
    if (e->formula[k] && terms[k].fibres)
      PetscCall(SbFibresRequire(m, scope, e->option[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEigenstrainAt(const struct _p_SbMaterial *m, const SbEigenPlace *place,
                               SbEigenstretch *stretch)
{
  const SbEigenstrain e = m->eigen;
  PetscReal one[SB_EIGEN_TERMS]; /* 1 + strain */

  PetscFunctionBeginUser;
  for (int k = 0; k < SB_EIGEN_TERMS; k++) {
    const PetscReal *at = k == SB_EIGEN_ACTIVE ? place->centre : place->x;
    const PetscBool hot = (PetscBool)(k == SB_EIGEN_TEMPERATURE);
    PetscReal value = 0;

    one[k] = 1;
    if (!e->formula[k])
      continue;
    PetscCall(SbFormulaEval(e->formula[k], place->t, at, &value));
    value *= (e->steady[k] ? place->load : 1) * (hot ? place->field : 1);
    one[k] += (hot ? e->expansion : 1) * value;
    PetscCheck(one[k] > 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
               "%s is %g%s at t = %g, (%.4g, %.4g, %.4g) m: a body keeps a length, so that a "
               "strain is above -1%s",
               e->option[k], (double)value, hot ? " K" : "", (double)place->t, (double)at[0],
               (double)at[1], (double)at[2], hot ? ", thermal_expansion times temperature" : "");
  }

  /* what changes the volume, and what keeps it */
  const PetscReal all = one[SB_EIGEN_GROWTH] * one[SB_EIGEN_TEMPERATURE];
  const PetscReal along = all * one[SB_EIGEN_FIBRE];
  const PetscReal across = all * one[SB_EIGEN_PLANE];
  const PetscReal shape = one[SB_EIGEN_ACTIVE] / one[SB_EIGEN_PRESTRAIN];

  stretch->along = 1 / (along * shape);
  stretch->across = PetscSqrtReal(shape) / across;
  stretch->root = m->linear ? 1 : across * PetscSqrtReal(along);
  stretch->log[0] = PetscLogReal(along * shape);
  stretch->log[1] = PetscLogReal(across) - PetscLogReal(shape) / 2;
  stretch->active = PetscLogReal(one[SB_EIGEN_ACTIVE]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law of F_e; the warped tangent is that of another matrix. */
static struct _p_SbMaterial elastic(const struct _p_SbMaterial *m)
{
  struct _p_SbMaterial law = *m->inner;

  law.axes = m->axes;
  law.tangent = m->tangent == SB_TANGENT_WARPED ? SB_TANGENT_EXACT_SPD : m->tangent;
  return law;
}

/* B = X A of 3x3 matrices, rows of X. */
SB_KERNEL static void shorten(const struct _p_SbMaterial *m, const SbPack X[restrict 9],
                              SbPack B[restrict 9])
{
  const SbPack *Q = m->axes;

  for (int k = 0; !Q && k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      B[k][l] = m->stretch[1][l] * X[k][l];
  for (int i = 0; Q && i < 3; i++) {
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal f[3] = {Q[0][l], Q[3][l], Q[6][l]};
      const PetscReal a = m->stretch[0][l];
      const PetscReal b = m->stretch[1][l];
      const PetscReal along = X[3 * i][l] * f[0] + X[3 * i + 1][l] * f[1] + X[3 * i + 2][l] * f[2];

      for (int j = 0; j < 3; j++)
        B[3 * i + j][l] = b * X[3 * i + j][l] + (a - b) * along * f[j];
    }
  }
}

/* F - (F_g - 1) */
static void subtract(const struct _p_SbMaterial *m, const SbPack F[9], SbPack Fe[9])
{
  const SbPack *Q = m->axes;

  for (int k = 0; k < 9; k++) {
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal across = 1 / m->stretch[1][l];
      const PetscReal more = Q ? 1 / m->stretch[0][l] - across : 0;

      Fe[k][l] =
        F[k][l] - (k % 4 ? 0 : across - 1) - (Q ? more * Q[3 * (k / 3)][l] * Q[3 * (k % 3)][l] : 0);
    }
  }
}

static void elastic_part(const struct _p_SbMaterial *m, const SbPack F[9], SbPack Fe[9])
{
  if (m->linear)
    subtract(m, F, Fe);
  else
    shorten(m, F, Fe);
}

/* X = r^power X A */
static void pull_back(const struct _p_SbMaterial *m, int power, const SbPack X[9], SbPack B[9])
{
  if (m->linear) {
    memcpy(B, X, 9 * sizeof(SbPack));
    return;
  }
  shorten(m, X, B);
  for (int n = 0; n < power; n++)
    for (int k = 0; k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        B[k][l] *= m->stretch[2][l];
}

static void energy_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi)
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9];

  elastic_part(m, F, Fe);
  law.ops.energy(&law, (const SbPack *)Fe, psi);
  for (int l = 0; l < SB_BATCH; l++)
    psi[l] *= m->stretch[2][l] * m->stretch[2][l];
}

static void stress_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], Pe[9];

  elastic_part(m, F, Fe);
  law.ops.stress(&law, (const SbPack *)Fe, Pe);
  pull_back(m, 2, (const SbPack *)Pe, P);
}

/* C = r^2 (T : dF A) A: rows of 3x3 matrices on both sides; the upper half is computed, and
   copied. add: to C. Without fibres A is a number. */
static void pull_back_tangent(const struct _p_SbMaterial *m, PetscBool add, const SbPack T[81],
                              SbPack C[81])
{
  SbPack half[81];

  for (int k = 0; !m->axes && !m->linear && k < 81; k++) {
    for (int l = 0; l < SB_BATCH; l++) {
      const PetscReal r = m->stretch[2][l];
      const PetscReal both = r * r * m->stretch[1][l] * m->stretch[1][l];

      C[k][l] = (add ? C[k][l] : 0) + both * T[k][l];
    }
  }
  if (!m->axes && !m->linear)
    return;
  for (int ij = 0; ij < 9; ij++)
    pull_back(m, 0, T + 9 * ij, half + 9 * ij);
  for (int kl = 0; kl < 9; kl++) {
    SbPack column[9], both[9];

    for (int ij = 0; ij < 9; ij++)
      memcpy(column[ij], half[9 * ij + kl], sizeof(SbPack));
    pull_back(m, 0, (const SbPack *)column, both);
    for (int ij = 0; ij <= kl; ij++) {
      for (int l = 0; l < SB_BATCH; l++)
        both[ij][l] =
          (add ? C[9 * ij + kl][l] : 0) + m->stretch[2][l] * m->stretch[2][l] * both[ij][l];
      SbTangentPut(both[ij], ij, kl, C);
    }
  }
}

static void tangent_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], T[81];

  elastic_part(m, F, Fe);
  law.ops.tangent(&law, (const SbPack *)Fe, T);
  pull_back_tangent(m, PETSC_FALSE, (const SbPack *)T, C);
}

static void dilatation_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack theta)
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9];

  elastic_part(m, F, Fe);
  law.ops.dilatation(&law, (const SbPack *)Fe, theta);
  for (int l = 0; l < SB_BATCH; l++)
    theta[l] *= m->stretch[2][l];
}

static void gradient_strained(const struct _p_SbMaterial *m, const SbPack F[9], SbPack D[9])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], De[9];

  elastic_part(m, F, Fe);
  law.ops.dilatation_gradient(&law, (const SbPack *)Fe, De);
  pull_back(m, 1, (const SbPack *)De, D);
}

/* What a pressure p in addition to that of a law with a spin adds to its tangent: Z dW Z^T, Z as in
   corotated.c. */
static void spin_hessian(const struct _p_SbMaterial *law, const SbPack F[9], const SbPack p,
                         SbPack T[81])
{
  SbPack R[9], W[2][9];

  law->ops.spin(law, F, NULL, R, W[0]);
  law->ops.spin(law, F, p, R, W[1]);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal Z[9][3], w[9];

    for (int k = 0; k < 9; k++) {
      w[k] = W[1][k][l] - W[0][k][l];
      Z[k][k % 3] = 0;
      Z[k][(k + 1) % 3] = -R[3 * (k / 3) + (k + 2) % 3][l];
      Z[k][(k + 2) % 3] = R[3 * (k / 3) + (k + 1) % 3][l];
    }
    for (int ij = 0; ij < 9; ij++) {
      for (int kl = 0; kl < 9; kl++) {
        T[9 * ij + kl][l] = 0;
        for (int n = 0; n < 9; n++)
          T[9 * ij + kl][l] += Z[ij][n / 3] * w[n] * Z[kl][n % 3];
      }
    }
  }
}

/* p r d^2 theta is r^2 times that of p / r. */
static void hessian_strained(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p,
                             SbPack C[81])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], part;
  SbPack T[81] = {{0}};

  elastic_part(m, F, Fe);
  for (int l = 0; l < SB_BATCH; l++)
    part[l] = p[l] / m->stretch[2][l];
  if (law.ops.spin)
    spin_hessian(&law, (const SbPack *)Fe, part, T);
  else
    law.ops.dilatation_hessian(&law, (const SbPack *)Fe, part, T);
  pull_back_tangent(m, PETSC_TRUE, (const SbPack *)T, C);
}

void SbEigenLaw(struct _p_SbMaterial *m, const struct _p_SbMaterial *law, PetscBool isochoric,
                int step)
{
  m->inner = law;
  m->stretch_step = step;
  m->ops.energy = energy_strained;
  m->ops.stress = stress_strained;
  m->ops.tangent = tangent_strained;
  m->ops.spin = NULL;
  if (!m->linear)
    m->ops.frame = NULL;
  if (isochoric)
    return;
  m->jacobian = PETSC_FALSE; /* theta is known at the points of the law only */
  m->ops.dilatation = dilatation_strained;
  m->ops.dilatation_gradient = gradient_strained;
  if (law->ops.dilatation_hessian || law->ops.spin)
    m->ops.dilatation_hessian = hessian_strained;
}

/* f . X^T Y f and tr X^T Y; without fibres a third of that is along. */
static void along_fibres(const SbPack *Q, const SbPack X[9], const SbPack Y[9], int l,
                         PetscReal *along, PetscReal *all)
{
  PetscReal x[9], y[9];

  SbPackGet(9, X, l, x);
  SbPackGet(9, Y, l, y);
  *all = SbDot9(x, y);
  *along = Q ? 0 : *all / 3;
  for (int i = 0; Q && i < 3; i++) {
    const PetscReal f[3] = {Q[0][l], Q[3][l], Q[6][l]};

    *along += SbDot3(x + 3 * i, f) * SbDot3(y + 3 * i, f);
  }
}

void SbEigenForce(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p, SbPack force[2])
{
  const struct _p_SbMaterial law = elastic(m);
  SbPack Fe[9], P[9], D[9], psi, theta, unit[9];

  elastic_part(m, F, Fe);
  law.ops.energy(&law, (const SbPack *)Fe, psi);
  law.ops.stress(&law, (const SbPack *)Fe, P);
  law.ops.dilatation(&law, (const SbPack *)Fe, theta);
  law.ops.dilatation_gradient(&law, (const SbPack *)Fe, D);
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      unit[k][l] = k % 4 == 0;
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal r = m->stretch[2][l];
    const SbPack *left = (const SbPack *)(m->linear ? unit : Fe);
    PetscReal of_stress[2], of_mean[2];

    along_fibres(m->axes, left, (const SbPack *)P, l, &of_stress[0], &of_stress[1]);
    along_fibres(m->axes, left, (const SbPack *)D, l, &of_mean[0], &of_mean[1]);
    of_stress[1] -= of_stress[0];
    of_mean[1] -= of_mean[0];
    for (int k = 0; k < 2; k++) {
      if (m->linear)
        force[k][l] = -(of_stress[k] + p[l] * of_mean[k]) / m->stretch[k][l];
      else
        force[k][l] = r * r * ((k + 1) * psi[l] - of_stress[k]) +
                      p[l] * r * ((k + 1) * theta[l] / 2 - of_mean[k]);
    }
  }
}
