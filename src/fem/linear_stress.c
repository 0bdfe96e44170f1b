/*
  Stresses of a linearisation, for the tangents of static runs.

  A step du of Newton's method satisfies linearised equations, but the stress S(u + du) has an error
  of second order: a rotation by w stretches by w^2/2, and in bending this error is orders of
  magnitude above any stress, the more so near nu = 1/2. It makes the geometric stiffness useless,
  and the next step with it. With the stresses as unknowns and S = S(E(u)) as a second equation the
  tangent after the step has

    S_lin = S(u) + dS/dE : dE,   dE = sym(F^T dF),

  and after the elimination of dS the right-hand side is still the residual of u (Magisano, Leonetti
  and Garcea, Int. J. Numer. Methods Eng. 109, 2017: mixed integration points). Both formulations
  have the same solution, and the same matrix pattern.

  The tangent of a law at F consists of the geometric part, dP_iK = dF_iL S_LK, and of the rest.
  Where theta is J - 1, the rest holds the pressure p = (lambda + share mu) theta, too. So the
  tangent is that with p_lin, and its geometric part is exchanged:

    C(F) + (p_lin - p(F)) d2 theta/dF2 + I (x) (S_lin - F^-1 (P(F) + (p_lin - p(F)) d theta/dF)).

  P2: at each point with the law there and its own p; the pressure of the cell's mean is linearised
  likewise, and is part of S. Where theta is J - 1 its second derivative is exact (tangent.c), while
  S has it at the points of the law, which makes no difference at the solution.

  Cells that soften (mullins.c): the stress that is linearised is that of the law without softening.
  Its part of the shape is multiplied by the factor at F, which is bounded, where the slope of the
  softened stress is steep up to the largest stretch so far, and not beyond.

  Not handled: co-rotated cells, which have linearised pressures of P2's mean only: their stress
  turns with them.
*/
#include "fem_impl.h"
#include "sbgeometry.h"

static const int row[6] = {0, 0, 0, 1, 1, 2};
static const int column[6] = {0, 1, 2, 1, 2, 2};

#define LEAST 1e-2 /* det F below which a cell counts as degenerate: without geometric stiffness */

/* What a point has besides its law: pressures in addition to the law's own, Pa, tension. */
typedef struct {
  SbPack p;       /* of the law's dilatation */
  SbPack hessian; /* of the mean, in the second derivative, */
  SbPack stress;  /* and in the stress */
} Extra;

/* S[9] = F^-1 A, zero where F is degenerate. */
SB_INLINE void pull_back(const PetscReal F[9], const PetscReal A[9], PetscReal S[9])
{
  PetscReal c[9];
  PetscReal J;

  SbMatCofactor(F, c);
  J = SbDot3(F, c);
  SbMatTransposeMul(c, A, S);
  for (int k = 0; k < 9; k++)
    S[k] = J > LEAST ? S[k] / J : 0.;
}

/* The exact tangent of a law at F with these pressures, its stress S(F), and D = d theta/dF. */
static void evaluate(const struct _p_SbMaterial *law, const SbPack F[9], const Extra *extra,
                     SbPack C[81], SbPack S[9], SbPack D[9])
{
  struct _p_SbMaterial m = *law;
  SbPack P[9], p;

  m.tangent = SB_TANGENT_EXACT;
  m.ops.tangent(&m, F, C);
  m.ops.stress(&m, F, P);
  m.ops.dilatation_gradient(&m, F, D);
  for (int l = 0; l < SB_BATCH; l++)
    p[l] = extra->p[l] + extra->hessian[l];
  m.ops.dilatation_hessian(&m, F, p, C);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], stress[9], s[9];

    SbPackGet(9, F, l, f);
    for (int k = 0; k < 9; k++)
      stress[k] = P[k][l] + (extra->p[l] + extra->stress[l]) * D[k][l];
    pull_back(f, stress, s);
    SbPackPut(9, s, l, S);
  }
}

/* The linearised stress of a law that softens: the part of the pressures is left as it is. */
static void soften(const struct _p_SbMaterial *m, const SbPack F[9], const SbLinearStress *stress,
                   const SbPack mean, const SbPack D[9], SbPack S[6])
{
  SbPack eta;

  SbMullinsFactor(m, F, eta);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal p = stress->p[l] + (mean ? mean[l] : 0.);
    PetscReal f[9], d[9], s[9];

    SbPackGet(9, F, l, f);
    SbPackGet(9, D, l, d);
    pull_back(f, d, s);
    for (int k = 0; k < 6; k++)
      S[k][l] = eta[l] * stress->S[k][l] +
                (1. - eta[l]) * p * 0.5 * (s[3 * row[k] + column[k]] + s[3 * column[k] + row[k]]);
  }
}

void SbLinearStressTangent(const struct _p_SbMaterial *m, const SbPack F[9],
                           const SbLinearStress *stress, const SbPack hessian, const SbPack mean,
                           SbPack C[81])
{
  static const int at[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
  const PetscReal modulus = SbMaterialDilatationModulus(m);
  Extra extra;
  SbPack S[9], D[9], softened[6], theta;
  const SbPack *goal = stress->S;

  m->ops.dilatation(m, F, theta);
  for (int l = 0; l < SB_BATCH; l++) {
    extra.p[l] = stress->p[l] - modulus * theta[l];
    extra.hessian[l] = hessian ? hessian[l] : 0.;
    extra.stress[l] = mean ? mean[l] : 0.;
  }
  evaluate(m, F, &extra, C, S, D);
  if (m->most) {
    soften(m, F, stress, mean, (const SbPack *)D, softened);
    goal = (const SbPack *)softened;
  }
  for (int k = 0; k < 27; k++) {
    const int i = k / 9;
    const int n = k % 9;
    const SbPack *lin = goal + at[n];
    SbPack *c = C + 9 * (3 * i + n / 3) + 3 * i + n % 3;
    const SbPack *s = (const SbPack *)S + n;
    const SbPack *t = (const SbPack *)S + 3 * (n % 3) + n / 3;

    for (int l = 0; l < SB_BATCH; l++)
      (*c)[l] += (*lin)[l] - 0.5 * ((*s)[l] + (*t)[l]);
  }
  for (int l = 0; m->tangent == SB_TANGENT_EXACT_SPD && l < SB_BATCH; l++) {
    PetscReal c[81];

    SbPackGet(81, (const SbPack *)C, l, c);
    SbSymmetricProjectPSD(9, c);
    SbPackPut(81, c, l, C);
  }
}

/* From a value a part of the way to the goal; the whole way forgets the value, which may be that of
   an iterate without finite stress. */
SB_INLINE PetscReal go(PetscReal from, PetscReal goal, PetscReal part)
{
  return part == 1. ? goal : from + part * (goal - from);
}

/* The stress of a law after a step with the gradient H (NULL: before one), a part of the way from
   the last one; mean: its pressure at F, that of the last tangent, its change. */
static void linearise(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack *H,
                      const SbPack mean[3], PetscReal part, SbLinearStress *stress)
{
  const PetscReal modulus = SbMaterialDilatationModulus(m);
  Extra used;
  SbPack C[81], D[9], P[9], S[9], theta;

  m->ops.stress(m, F, P);
  m->ops.dilatation(m, F, theta);
  for (int l = 0; H && l < SB_BATCH; l++) {
    used.p[l] = stress->p[l] - modulus * theta[l];
    used.hessian[l] = used.stress[l] = mean[1][l];
  }
  if (H)
    evaluate(m, F, &used, C, S, D);
  else
    m->ops.dilatation_gradient(m, F, D);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], A[9], s[9];
    PetscReal change = 0.;

    /* the stress at F */
    SbPackGet(9, F, l, f);
    for (int k = 0; k < 9; k++)
      A[k] = P[k][l] + mean[0][l] * D[k][l];

    /* its change: dP less the geometric part */
    if (H) {
      PetscReal h[9], last[9], geometric[9];

      SbPackGet(9, H, l, h);
      SbPackGet(9, (const SbPack *)S, l, last);
      SbMatMul(h, last, geometric);
      for (int k = 0; k < 9; k++) {
        change += D[k][l] * h[k];
        A[k] += mean[2][l] * D[k][l] - geometric[k];
        for (int n = 0; n < 9; n++)
          A[k] += C[9 * k + n][l] * h[n];
      }
    }
    pull_back(f, A, s);
    for (int k = 0; k < 6; k++) {
      const PetscReal goal = 0.5 * (s[3 * row[k] + column[k]] + s[3 * column[k] + row[k]]);

      stress->S[k][l] = go(stress->S[k][l], goal, part);
    }
    stress->p[l] = go(stress->p[l], modulus * (theta[l] + change), part);
  }
}

/* The pressure of P2's mean, tension: at the state, the last one, its change by the step; updates
   the last one. */
static void linearise_mean(const struct _p_SbMaterial *m, const SbPoints *at, const SbPack x[30],
                           const SbPack F[SB_POINTS][9], const SbPack *dx, PetscReal part,
                           SbPack pressure, SbPack mean[3])
{
  const PetscReal lambda = SbMaterialMeanModulus(m);
  SbPack b[30];

  SbQuadraticVolume(m, at, x, F, mean[0], dx ? b : NULL);
  memcpy(mean[1], pressure, sizeof(SbPack));
  memset(mean[2], 0, sizeof(SbPack));
  for (int k = 0; dx && k < 30; k++)
    for (int l = 0; l < SB_BATCH; l++)
      mean[2][l] += b[k][l] * dx[k][l];
  for (int l = 0; l < SB_BATCH; l++) {
    mean[2][l] *= (*at->V)[l] > 0. ? lambda / (*at->V)[l] : 0.;
    pressure[l] = go(pressure[l], mean[0][l] + mean[2][l], part);
  }
}

PetscErrorCode SbSpaceLineariseStress(SbSpace s, Vec U, Vec step, PetscReal part)
{
  const PetscReal *u;
  const PetscReal *du = NULL;

  PetscFunctionBeginUser;
  s->linear_stress = (PetscBool)(U && !s->linear);
  if (!s->linear_stress)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!s->pressure)
    PetscCall(PetscCalloc1(s->nbatch, &s->pressure));
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  if (step)
    PetscCall(SbSpaceGetLocalRead(s, step, &du));
  if (step)
    SbEigenForgetKept(s);
  else
    SbEigenExchangeKept(s);
  for (PetscInt r = 0; r < s->nregion; r++) {
    SbRegion *region = &s->region[r];
    const SbMaterial law = region->pointwise;
    const PetscBool points = (PetscBool)(law->ops.dilatation_hessian != NULL);
    const PetscBool mean = (PetscBool)(region->quadratic && law != region->material);

    if (region->history || region->material->linear || (!points && !mean) ||
        region->bstart == region->bend)
      continue;
    if (points && !region->stress)
      PetscCall(PetscCalloc1((region->bend - region->bstart) * SbBatchPoints(s, region->bstart).n,
                             &region->stress));
    for (PetscInt b = region->bstart; b < region->bend; b++) {
      const SbPoints at = SbBatchPoints(s, b);
      SbPack x[30], dx[30], F[SB_POINTS][9], H[SB_POINTS][9];
      SbPack pressure[3] = {{0.}};
      struct _p_SbMaterial own, without, whole;
      const struct _p_SbMaterial *here = SbBatchLaw(region, law, b, &own);

      if (region->softening) {
        without = SbMullinsLaw(here);
        here = &without;
      }
      SbBatchGradients(s, b, u, PETSC_FALSE, x, F);
      if (step) {
        SbBatchGradients(s, b, du, PETSC_TRUE, dx, H);
        for (int k = 0; k < 30; k++)
          for (int l = 0; l < SB_BATCH; l++)
            dx[k][l] = -dx[k][l];
        for (int k = 0; k < 9 * at.n; k++)
          for (int l = 0; l < SB_BATCH; l++)
            H[k / 9][k % 9][l] = -H[k / 9][k % 9][l];
      }
      if (mean)
        linearise_mean(SbBatchVolumeLaw(region, b, &whole), &at, (const SbPack *)x,
                       (const SbPack(*)[9])F, step ? (const SbPack *)dx : NULL, step ? part : 1.,
                       s->pressure[b], pressure);
      for (int q = 0; points && q < at.n; q++) {
        SbPointLaw(region, b, q, &own);
        linearise(here, (const SbPack *)F[q], step ? (const SbPack *)H[q] : NULL,
                  (const SbPack *)pressure, step ? part : 1.,
                  &region->stress[at.n * (b - region->bstart) + q]);
      }
    }
  }
  if (!step)
    SbEigenExchangeKept(s);
  if (step)
    PetscCall(SbSpaceRestoreLocalRead(s, step, &du));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}
