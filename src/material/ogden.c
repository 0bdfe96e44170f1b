/*
  Law of Ogden (1972) for rubber and soft tissue, in the principal stretches l_k = J^(-1/3) s_k of
  the isochoric part:

    psi = sum_i mu_i/alpha_i (l_1^alpha_i + l_2^alpha_i + l_3^alpha_i - 3) + K/2 theta^2,

  with any real alpha_i but 0. The shear modulus at rest is sum mu_i alpha_i / 2: Ogden's own
  constants, of which Abaqus's and FEBio's differ by factors (docs/reference/materials.md). With b_k
  = ln l_k, g_k = sum mu_i l_k^alpha_i, h_k = sum mu_i alpha_i l_k^alpha_i and T_k = g_k - mean(g),

    P = U diag(T_k / s_k) V^T + q F^-T,   d T_i/d ln s_j = h_i d_ij - h_i/3 - h_j/3 + sum(h)/9.

  The tangent comes from its analytic eigensystem (Smith, de Goes, Kim 2019, sections 4 and 5). The
  flips (W_i - W_j) / (s_i - s_j), W_i = (T_i + q) / s_i, need no small differences: with the
  geometric mean m of l_i and l_j, and d = ln(s_i / s_j),

    (l_i^a - l_j^a) / (s_i - s_j) = a m^a / sqrt(s_i s_j) * shc(a d/2) / shc(d/2),   shc(x) =
    sinh(x) / x,

  which is exact for equal stretches, too. q as in isochoric.c.
*/
#include "isochoric.h"

#define TERMS 20 /* at most */

typedef struct {
  SbIsochoric isochoric;
  PetscInt n;
  PetscReal mu[TERMS], alpha[TERMS];
} Ogden;

/* ln s_k less its mean, and 1/s_k, of a lane; no numbers where a stretch is not positive. */
SB_INLINE void logarithms(const SbPack s[3], int l, PetscReal b[3], PetscReal r[3])
{
  PetscReal mean = 0;

  for (int k = 0; k < 3; k++) {
    r[k] = 1 / s[k][l];
    b[k] = log(s[k][l]);
    mean += b[k] / 3;
  }
  for (int k = 0; k < 3; k++)
    b[k] -= mean;
}

/* Terms of first order of l^alpha - 1 add up to nothing. */
SB_KERNEL static void energy_ogden(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                   SbPack psi)
{
  const Ogden *law = (const Ogden *)m->data;
  const SbVolumetric kind = law->isochoric.volumetric;
  const PetscReal K = SbIsochoricBulk(m);
  SbPack U[9], s[3], V[9];

  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], b[3], r[3];
    PetscReal sum = 0;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    logarithms((const SbPack *)s, l, b, r);
    for (PetscInt i = 0; i < law->n; i++) {
      const PetscReal a = law->alpha[i];

      for (int k = 0; k < 3; k++)
        sum += law->mu[i] / a * (expm1(a * b[k]) - a * b[k]);
    }
    const PetscReal value = sum + K * SbVolumetricEnergy(kind, &v);
    psi[l] = v.J > 0 && value == value ? value : INFINITY;
  }
}

/* T_k of a lane; unless they are NULL h_k, and half[3 i + k] = l_k^(alpha_i / 2). */
SB_INLINE void deviator(const Ogden *law, const PetscReal b[3], PetscReal T[3], PetscReal h[3],
                        PetscReal half[3 * TERMS])
{
  for (int k = 0; k < 3; k++) {
    T[k] = 0;
    if (h)
      h[k] = 0;
    for (PetscInt i = 0; i < law->n; i++) {
      const PetscReal a = law->alpha[i];
      const PetscReal root = expm1(a * b[k] / 2);
      const PetscReal power = root * (2 + root);

      T[k] += law->mu[i] * power;
      if (h)
        h[k] += law->mu[i] * a * (1 + power);
      if (half)
        half[3 * i + k] = 1 + root;
    }
  }
  const PetscReal mean = (T[0] + T[1] + T[2]) / 3;
  for (int k = 0; k < 3; k++)
    T[k] -= mean;
}

SB_KERNEL static void stress_ogden(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                   SbPack P[restrict 9])
{
  const Ogden *law = (const Ogden *)m->data;
  SbPack U[9], s[3], V[9], D[9], q, of_DD;

  SbStretches(F, U, s, V);
  SbInverseTransposed(F, D);
  SbIsochoricPressure(m, F, q, of_DD);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal u[9], v[9], p[9], b[3], r[3], T[3];

    SbPackGet(9, (const SbPack *)U, l, u);
    SbPackGet(9, (const SbPack *)V, l, v);
    logarithms((const SbPack *)s, l, b, r);
    deviator(law, b, T, NULL, NULL);
    for (int k = 0; k < 9; k++)
      u[k] *= T[k % 3] * r[k % 3];
    SbMatMulTranspose(u, v, p);
    for (int k = 0; k < 9; k++)
      P[k][l] = p[k] + q[l] * D[k][l];
  }
}

/* sinh(x) / x for |x| <= 1, by its series, whose rest is below rounding. */
SB_INLINE PetscReal sinh_over(PetscReal x)
{
  static const PetscReal c[8] = {
    1. / 6,        1. / 120,         1. / 5040,           1. / 362880,
    1. / 39916800, 1. / 6227020800., 1. / 1.307674368e12, 1. / 3.55687428096e14};
  const PetscReal y = x * x;
  PetscReal sum = c[7];

  for (int n = 6; n >= 0; n--)
    sum = c[n] + sum * y;
  return 1 + sum * y;
}

/* (T_i - T_j) / (s_i - s_j), i, j, k being three axes: by the quotient where the stretches are far
   apart. As the b add up to zero, (l_i l_j)^(a/2) = l_k^(-a/2). */
SB_INLINE PetscReal divided(const Ogden *law, const PetscReal b[3], const PetscReal T[3],
                            const PetscReal half[3 * TERMS], const PetscReal s[3], int i, int j,
                            int k)
{
  const PetscReal d = b[i] - b[j];
  PetscReal sum = 0;

  if (PetscAbsReal(d) > 1)
    return (T[i] - T[j]) / (s[i] - s[j]);
  for (PetscInt n = 0; n < law->n; n++) {
    const PetscReal a = law->alpha[n];
    const PetscReal x = a * d / 2;
    const PetscReal *e = half + 3 * n;
    const PetscReal ratio = e[i] / e[j];
    const PetscReal part = PetscAbsReal(x) > 1 ? (ratio - 1 / ratio) / (2 * x) : sinh_over(x);

    sum += law->mu[n] * a * part / e[k];
  }
  return sum / (PetscSqrtReal(s[i] * s[j]) * sinh_over(d / 2));
}

/* The eigensystem of W + q ln J: hessian, flips and twists of SbSpectralTangent(). */
SB_KERNEL static void eigensystem(const Ogden *law, const SbPack s[restrict 3], const SbPack q,
                                  const SbPack of_DD, SbPack hessian[restrict 6],
                                  SbPack flip[restrict 3], SbPack twist[restrict 3])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal x[3] = {s[0][l], s[1][l], s[2][l]};
    PetscReal b[3], r[3], T[3], h[3], half[3 * TERMS];

    logarithms(s, l, b, r);
    deviator(law, b, T, h, half);
    const PetscReal ninth = (h[0] + h[1] + h[2]) / 9;
    for (int i = 0, n = 0; i < 3; i++) {
      for (int j = i; j < 3; j++, n++) {
        PetscReal c = ninth - (h[i] + h[j]) / 3 + of_DD[l];

        if (i == j)
          c += h[i] - T[i] - q[l];
        hessian[n][l] = c * r[i] * r[j];
      }
    }
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3;
      const int j = (k + 2) % 3;
      const PetscReal middle = ((T[i] + T[j]) / 2 + q[l]) * r[i] * r[j];

      flip[k][l] = divided(law, b, T, half, x, i, j, k) * (r[i] + r[j]) / 2 - middle;
      twist[k][l] = ((T[i] + q[l]) * r[i] + (T[j] + q[l]) * r[j]) / (x[i] + x[j]);
    }
  }
}

/* Exact: the change of volume apart, by cofactors, which are right to rounding of K alone. */
static void tangent_ogden(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  static const SbPack zero = {0};
  SbPack U[9], s[3], V[9], q, of_DD, hessian[6], flip[3], twist[3], volume[81];

  SbStretches(F, U, s, V);
  SbIsochoricPressure(m, F, q, of_DD);
  if (m->tangent == SB_TANGENT_EXACT_SPD) {
    eigensystem((const Ogden *)m->data, (const SbPack *)s, q, of_DD, hessian, flip, twist);
    SbSpectralTangent((const SbPack *)U, (const SbPack *)V, (const SbPack *)hessian,
                      (const SbPack *)flip, (const SbPack *)twist, C);
    return;
  }
  eigensystem((const Ogden *)m->data, (const SbPack *)s, zero, zero, hessian, flip, twist);
  SbSpectralTangentExact((const SbPack *)U, (const SbPack *)V, (const SbPack *)hessian,
                         (const SbPack *)flip, (const SbPack *)twist, C);
  SbInvariantTangent(m, F, NULL, NULL, of_DD, q, volume);
  for (int k = 0; k < 81; k++)
    for (int l = 0; l < SB_BATCH; l++)
      C[k][l] += volume[k][l];
}

/* Reads a list of numbers; n: their number. */
static PetscErrorCode read_list(const SbScope *scope, const char *key, PetscInt *n,
                                PetscReal value[TERMS])
{
  char text[1024], option[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  SbOptionName(scope, key, sizeof(option), option);
  PetscCall(SbOptionString(scope, key, sizeof(text), text));
  *n = SbParseNumbers(text, TERMS, value);
  PetscCheck(*n > 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s is no list of 1 to %d numbers with commas between them: one for each term of "
             "the law",
             option, text, TERMS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode set_from_options(SbMaterial m, const SbScope *scope)
{
  Ogden *law = (Ogden *)m->data;
  PetscReal mu = 0;
  PetscInt n;
  char first[3 * SB_NAME_MAX], second[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  SbOptionName(scope, "mu", sizeof(first), first);
  SbOptionName(scope, "alpha", sizeof(second), second);
  PetscCall(read_list(scope, "mu", &law->n, law->mu));
  PetscCall(read_list(scope, "alpha", &n, law->alpha));
  PetscCheck(n == law->n, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s has %" PetscInt_FMT " and %s %" PetscInt_FMT
             " numbers: each term of the law takes one of both",
             first, law->n, second, n);
  for (PetscInt i = 0; i < n; i++) {
    PetscCheck(law->alpha[i] != 0, PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s: number %" PetscInt_FMT
               " is 0; exponents are in (-inf, 0) or (0, inf): leave the term out",
               second, i + 1);
    mu += law->mu[i] * law->alpha[i] / 2;
  }
  PetscCall(SbIsochoricSetFromOptions(m, scope, mu, "the sum of mu alpha / 2"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {
  {"mu", SB_OPTION_STRING, 1, "Pa", NULL, "",
   "factors mu_i of the terms, up to 20 numbers with commas; the shear modulus at rest is the sum "
   "of mu_i alpha_i / 2"},
  {"alpha", SB_OPTION_STRING, 1, "", NULL, "",
   "exponents alpha_i of the terms, as many numbers as mu has, none of them 0"},
  SB_ISOCHORIC_ROWS};

const SbMaterialType SbMaterialOgden = {
  .name = "ogden",
  .size = sizeof(Ogden),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .own_moduli = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.setfromoptions = set_from_options,
          .energy = energy_ogden,
          .stress = stress_ogden,
          .tangent = tangent_ogden,
          SB_ISOCHORIC_DILATATION},
};
