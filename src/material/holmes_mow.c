/*
  Law of Holmes and Mow (1990) for cartilage and other tissue whose stiffness grows with the strain
  and with compaction. With I1 = |F|^2, I2 = |cof F|^2, J = det F and M = lambda + 2 mu, the modulus
  of confined compression:

    psi = M/(4 beta) (exp(Q) - 1),
    Q   = beta/M [(2 mu - lambda) (I1 - 3) + lambda (I2 - 3) - 2 M ln J],

  which is Hooke's law at rest, and infinite for J <= 0. With the strain E = (F^T F - I) / 2

    Q   = 2 beta [tr E - ln J + lambda/M (tr(E)^2 - E : E)],
    P = exp(Q) F [M C^-1 E + lambda (tr(E) I - E)],   C = F^T F,

  without terms that cancel at rest. In principal stretches, with W_i = exp(Q) g_i,

    W_ij = exp(Q) (dg_i/ds_j + 4 beta/M g_i g_j),   g_i = (2 mu - lambda + lambda (I1 - s_i^2))
    s_i/2 - M/(2 s_i).

  theta is ln J, and psi_mu what remains of psi beside lambda/2 theta^2.
*/
#include "invariants.h"

#define LIMIT 250. /* exponent beyond which psi is infinite */

typedef struct {
  PetscReal beta,
    lambda; /* lambda as the law has it, Pa, also where the volumetric part is left out */
} HolmesMow;

/* Of a lane: the factor M/(4 beta) of psi, and what m lacks of lambda in lambda/2 theta^2, Pa. */
typedef struct {
  PetscReal mu, lambda, M, factor;
  PetscReal trace;   /* of the strain E */
  PetscReal exp;     /* exp(Q); no number beyond the limits */
  PetscReal more;    /* exp(Q) - 1; infinite there */
  PetscReal missing; /* Pa */
} Point;

SB_INLINE Point point_of(const struct _p_SbMaterial *m, const PetscReal f[9], const SbVolume *v,
                         PetscReal E[9])
{
  const HolmesMow *law = (const HolmesMow *)m->data;
  const PetscReal h[9] = {f[0] - 1, f[1], f[2], f[3], f[4] - 1, f[5], f[6], f[7], f[8] - 1};
  Point p = {.mu = m->rest->mu, .lambda = law->lambda};
  PetscReal square[9], minors[9];

  SbMatTransposeMul(h, h, square);
  for (int k = 0; k < 9; k++)
    E[k] = (h[k] + h[3 * (k % 3) + k / 3] + square[k]) / 2;
  p.trace = E[0] + E[4] + E[8];

  /* det C - 1: of the same rounding as E, so that no first-order terms are left of tr E - ln J */
  SbMatCofactor(E, minors);
  const PetscReal more =
    2 * p.trace + 4 * (minors[0] + minors[4] + minors[8]) + 8. / 3 * SbDot9(E, minors);
  const PetscReal log = v->J > 0.5 ? log1p(more) / 2 : v->log;

  p.M = p.lambda + 2 * p.mu;
  p.factor = p.M / (4 * law->beta);
  p.missing = m->rest->lambda - p.lambda;
  const PetscReal Q =
    2 * law->beta * (p.trace - log + p.lambda / p.M * (p.trace * p.trace - SbDot9(E, E)));
  const PetscBool inside = (PetscBool)(v->J > 0 && Q <= LIMIT);
  p.more = inside ? expm1(Q) : INFINITY;
  p.exp = inside ? 1 + p.more : NAN;
  return p;
}

SB_KERNEL static void energy_holmes_mow(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack psi)
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], E[9];

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    const Point p = point_of(m, f, &v, E);
    psi[l] = p.factor * p.more;
    if (p.missing != 0 && v.J > 0)
      psi[l] += p.missing / 2 * v.log * v.log;
  }
}

SB_KERNEL static void stress_holmes_mow(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack P[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9], E[9], D[9], S[9], first[9], second[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    const SbVolume v = SbVolumeOf(f);
    const Point p = point_of(m, f, &v, E);
    for (int k = 0; k < 9; k++) {
      D[k] = c[k] / v.J;
      S[k] = p.lambda * ((k % 4 ? 0 : p.trace) - E[k]);
    }

    /* F C^-1 = F^-T */
    SbMatMul(D, E, first);
    SbMatMul(f, S, second);
    for (int k = 0; k < 9; k++)
      P[k][l] = p.exp * (p.M * first[k] + second[k]) + p.missing * v.log * D[k];
  }
}

SB_KERNEL static void tangent_holmes_mow(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                         SbPack C[restrict 81])
{
  SbPack U[9], V[9], s[3], hessian[6], flip[3], twist[3];

  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal t[3] = {s[0][l], s[1][l], s[2][l]};
    const PetscReal I1 = SbDot3(t, t);
    PetscReal f[9], E[9], g[3];

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    const Point p = point_of(m, f, &v, E);
    const PetscReal a = 2 * p.mu - p.lambda;
    const PetscReal q = p.missing * v.log;

    for (int i = 0; i < 3; i++)
      g[i] = ((a + p.lambda * (I1 - t[i] * t[i])) * t[i] - p.M / t[i]) / 2;
    for (int i = 0, k = 0; i < 3; i++) {
      for (int j = i; j < 3; j++, k++) {
        const PetscReal own = (a + p.lambda * (I1 - t[i] * t[i]) + p.M / (t[i] * t[i])) / 2;

        hessian[k][l] = p.exp * ((i == j ? own : p.lambda * t[i] * t[j]) + g[i] * g[j] / p.factor) +
                        (p.missing - (i == j ? q : 0)) / (t[i] * t[j]);
      }
    }
    for (int k = 0; k < 3; k++) {
      const PetscReal x = t[(k + 1) % 3];
      const PetscReal y = t[(k + 2) % 3];
      const PetscReal squares = x * x + y * y;

      flip[k][l] =
        p.exp * (a + p.lambda * (I1 - squares - x * y) + p.M / (x * y)) / 2 - q / (x * y);
      twist[k][l] =
        p.exp * (a + p.lambda * (I1 - squares + x * y) - p.M / (x * y)) / 2 + q / (x * y);
    }
  }
  if (m->tangent == SB_TANGENT_EXACT_SPD)
    SbSpectralTangent(U, V, (const SbPack *)hessian, (const SbPack *)flip, (const SbPack *)twist,
                      C);
  else
    SbSpectralTangentExact(U, V, (const SbPack *)hessian, (const SbPack *)flip,
                           (const SbPack *)twist, C);
}

static PetscErrorCode set_up_holmes_mow(SbMaterial m, const SbScope *scope)
{
  HolmesMow *law = (HolmesMow *)m->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "beta", &law->beta));
  law->lambda = m->rest->lambda;
  PetscCheck(m->rest->nu >= 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_poisson %g with the law holmes_mow: its energy has no least value for a "
             "negative Poisson's ratio; take one in [0, 0.5)",
             scope->klass, scope->instance[0] ? scope->instance : "<name>", (double)m->rest->nu);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"beta", SB_OPTION_REAL, 1, "", "1", "(0, inf)",
   "how fast the stiffness grows with the strain: psi = M/(4 beta) (exp(Q) - 1), Q of the size of "
   "beta times the square of the strain"},
  SB_MATERIAL_TANGENT_ROW};

const SbMaterialType SbMaterialHolmesMow = {
  .name = "holmes_mow",
  .size = sizeof(HolmesMow),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .limited = PETSC_TRUE,
  .ops = {.setfromoptions = set_up_holmes_mow,
          .energy = energy_holmes_mow,
          .stress = stress_holmes_mow,
          .tangent = tangent_holmes_mow,
          .dilatation = SbLogVolume,
          .dilatation_gradient = SbLogVolumeGradient,
          .dilatation_hessian = SbLogVolumeHessian},
};
