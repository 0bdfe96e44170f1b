/*
  Laws psi = W(x1, x2) + K/2 theta(J)^2 (isochoric.h): energy, stress and tangent from W.

  With I1 = |F|^2, I2 = |cof F|^2, a = J^(-2/3), D = F^-T and B = I1 F - F F^T F,

    P = 2 a W1 (F - I1/3 D) + 2 a^2 W2 (B - 2/3 I2 D) + q D,   q = K J d(theta^2/2)/dJ,

  at rest exact zeros in each bracket. As a function of I1, I2 and J (subscripts: derivatives),

    dP/dF_(ij)(kl) = 2 (psi_1 + psi_2 I1) identity - 2 psi_2 (d_ik C_jl + b_ik d_jl + F_il F_kj)
      + 4 psi_2 F_ij F_kl - p D_il D_kj + a quadratic form of F, B and D,

  C = F^T F, b = F F^T, p = J psi_J. The quadratic form has 4 psi_11, 4 psi_12, 4 psi_22, 2 J
  psi_1J, 2 J psi_2J and J (J psi_J)_J. In signed stretches, with W_i = d psi/d s_i and the third
  axis k,

    flips  2 psi_1 + 2 psi_2 (s_k^2 - s_i s_j) - p / (s_i s_j)
    twists 2 psi_1 + 2 psi_2 (s_k^2 + s_i s_j) + p / (s_i s_j).

  Flory 1961; Ogden, Non-linear elastic deformations, 1984, chapter 4; Holzapfel, Nonlinear solid
  mechanics, 2000, chapter 6. The analytic eigensystem: Smith, de Goes, Kim 2019.
*/
#include "isochoric.h"

#define NEAR 0.5 /* |ln J| up to which x1 and x2 come from F - I */

/* Of a batch. No numbers for J <= 0. */
typedef struct {
  SbPack a;          /* J^(-2/3) */
  SbPack I1, I2;     /* of F */
  SbPack x1, x2;     /* of its isochoric part */
  SbPack U, q, next; /* theta^2/2, J dU/dJ, J d(J dU/dJ)/dJ */
} Measures;

/* x1 = growth + 3 e + e growth with growth = I1 - 3 and e = J^(-2/3) - 1 = expm1(x), and x2 alike:
   terms of first order cancel in j - ln J, from H = F - I. cof F = I + G, G = tr H I - H^T + cof
   H. */
SB_INLINE void measure(SbVolumetric kind, PetscBool second, const SbPack F[9], Measures *s)
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    const PetscReal x = -2. / 3. * v.log;
    const PetscReal e = expm1(x);
    const PetscReal first = 2 * ((v.j - v.log) - v.minors) + v.square + 3 * (e - x);
    const PetscReal growth = 2 * (v.j - v.minors) + v.square;
    const PetscBool near = (PetscBool)(PetscAbsReal(v.log) < NEAR);

    s->a[l] = v.J > 0 ? 1 + e : NAN;
    s->I1[l] = SbDot9(f, f);
    s->x1[l] = near ? first + e * growth : s->a[l] * s->I1[l] - 3;
    s->U[l] = SbVolumetricEnergy(kind, &v);
    s->q[l] = SbVolumetricStress(kind, &v, &s->next[l]);
    s->x2[l] = s->I2[l] = 0;
    if (second) {
      const PetscReal h[9] = {f[0] - 1, f[1], f[2], f[3], f[4] - 1, f[5], f[6], f[7], f[8] - 1};
      const PetscReal tr = h[0] + h[4] + h[8];
      const PetscReal y = 2 * x;
      const PetscReal g = e * (2 + e);
      PetscReal G[9];

      SbMatCofactor(f, c);
      s->I2[l] = SbDot9(c, c);
      SbMatCofactor(h, c);
      const PetscReal pairs = c[0] + c[4] + c[8];
      for (int k = 0; k < 9; k++)
        G[k] = (k % 4 == 0 ? tr : 0) - h[3 * (k % 3) + k / 3] + c[k];
      const PetscReal rest = 2 * pairs - 4 * v.minors + SbDot9(G, G);
      s->x2[l] = near ? 4 * (v.j - v.log) + rest + 3 * (g - y) + g * (4 * v.j + rest)
                      : s->a[l] * s->a[l] * s->I2[l] - 3;
    }
  }
}

SB_KERNEL static void measure_first(SbVolumetric kind, const SbPack F[restrict 9], Measures *s)
{
  measure(kind, PETSC_FALSE, F, s);
}

SB_KERNEL static void measure_both(SbVolumetric kind, const SbPack F[restrict 9], Measures *s)
{
  measure(kind, PETSC_TRUE, F, s);
}

/* The measures and W of a batch. */
static void evaluate(const struct _p_SbMaterial *m, const SbPack F[9], Measures *s,
                     SbShapeEnergy *w)
{
  const SbIsochoric *law = (const SbIsochoric *)m->data;

  (law->second ? measure_both : measure_first)(law->volumetric, F, s);
  law->shape(m, s->x1, s->x2, w);
}

void SbIsochoricEnergy(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi)
{
  const PetscReal K = SbIsochoricBulk(m);
  Measures s;
  SbShapeEnergy w;

  evaluate(m, F, &s, &w);
  for (int l = 0; l < SB_BATCH; l++)
    psi[l] = s.a[l] > 0 ? w.W[l] + K * s.U[l] : INFINITY;
}

SB_INLINE void stress(PetscReal K, PetscBool second, const Measures *s, const SbShapeEnergy *w,
                      const SbPack F[9], SbPack P[9])
{
  SbPack D[9];

  SbInverseTransposed(F, D);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], C[9], fc[9];
    const PetscReal one = 2 * s->a[l] * w->W1[l];
    const PetscReal third = s->I1[l] / 3;
    const PetscReal q = K * s->q[l];

    SbPackGet(9, F, l, f);
    for (int k = 0; k < 9; k++)
      P[k][l] = one * (f[k] - third * D[k][l]) + q * D[k][l];
    if (second) {
      const PetscReal two = 2 * s->a[l] * s->a[l] * w->W2[l];
      const PetscReal thirds = 2 * s->I2[l] / 3;

      SbMatTransposeMul(f, f, C);
      SbMatMul(f, C, fc);
      for (int k = 0; k < 9; k++)
        P[k][l] += two * (s->I1[l] * f[k] - fc[k] - thirds * D[k][l]);
    }
  }
}

SB_KERNEL static void stress_first(PetscReal K, const Measures *s, const SbShapeEnergy *w,
                                   const SbPack F[restrict 9], SbPack P[restrict 9])
{
  stress(K, PETSC_FALSE, s, w, F, P);
}

SB_KERNEL static void stress_both(PetscReal K, const Measures *s, const SbShapeEnergy *w,
                                  const SbPack F[restrict 9], SbPack P[restrict 9])
{
  stress(K, PETSC_TRUE, s, w, F, P);
}

void SbIsochoricStress(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9])
{
  Measures s;
  SbShapeEnergy w;

  evaluate(m, F, &s, &w);
  (((const SbIsochoric *)m->data)->second ? stress_both : stress_first)(SbIsochoricBulk(m), &s, &w,
                                                                        F, P);
}

/* Coefficients of the tangent. Those of F, B, D: of FF, FB, FD, BB, BD, DD. */
typedef struct {
  SbPack one, two; /* 2 psi_1, 2 psi_2 */
  SbPack p;        /* J psi_J */
  SbPack form[6];
} Coefficients;

SB_INLINE void coefficients(PetscReal K, PetscBool second, const Measures *s,
                            const SbShapeEnergy *w, Coefficients *c)
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal a = s->a[l];
    const PetscReal i1 = a * s->I1[l];
    const PetscReal W1 = w->W1[l];
    const PetscReal W11 = w->W11[l];

    c->one[l] = 2 * a * W1;
    c->two[l] = 0;
    c->p[l] = K * s->q[l] - 2 * W1 * i1 / 3;
    c->form[0][l] = 4 * a * a * W11;
    c->form[1][l] = c->form[3][l] = c->form[4][l] = 0;
    c->form[2][l] = -4 * a * (W1 + i1 * W11) / 3;
    c->form[5][l] = K * s->next[l] + 4 * i1 * (W1 + i1 * W11) / 9;
    if (second) {
      const PetscReal i2 = a * a * s->I2[l];
      const PetscReal W2 = w->W2[l];
      const PetscReal W12 = w->W12[l];
      const PetscReal W22 = w->W22[l];

      c->two[l] = 2 * a * a * W2;
      c->p[l] -= 4 * W2 * i2 / 3;
      c->form[0][l] += 2 * c->two[l];
      c->form[1][l] = 4 * a * a * a * W12;
      c->form[2][l] -= 8 * a * i2 * W12 / 3;
      c->form[3][l] = 4 * a * a * a * a * W22;
      c->form[4][l] = -4 * a * a * (2 * W2 + i1 * W12 + 2 * i2 * W22) / 3;
      c->form[5][l] += 16 * i2 * (W2 + i1 * W12 + i2 * W22) / 9;
    }
  }
}

/* y = the quadratic form of (F, B, D) times one of its tensors: rows of the coefficients. */
SB_INLINE void rows_of(PetscBool second, const Coefficients *c, const SbPack F[9],
                       const SbPack B[9], const SbPack D[9], SbPack YF[9], SbPack YB[9],
                       SbPack YD[9])
{
  for (int k = 0; k < 9; k++) {
    for (int l = 0; l < SB_BATCH; l++) {
      YF[k][l] = c->form[0][l] * F[k][l] + c->form[2][l] * D[k][l];
      YD[k][l] = c->form[2][l] * F[k][l] + c->form[5][l] * D[k][l];
      if (second) {
        YF[k][l] += c->form[1][l] * B[k][l];
        YD[k][l] += c->form[4][l] * B[k][l];
        YB[k][l] = c->form[1][l] * F[k][l] + c->form[3][l] * B[k][l] + c->form[4][l] * D[k][l];
      }
    }
  }
}

SB_INLINE void exact(PetscReal K, PetscBool second, const Measures *s, const SbShapeEnergy *w,
                     const SbPack F[9], SbPack C[81])
{
  SbPack D[9], B[9], right[9], left[9], YF[9], YB[9], YD[9], c;
  Coefficients of;

  coefficients(K, second, s, w, &of);
  SbInverseTransposed(F, D);
  for (int l = 0; second && l < SB_BATCH; l++) {
    PetscReal f[9], r[9], fr[9], b[9];

    SbPackGet(9, F, l, f);
    SbMatTransposeMul(f, f, r);
    SbMatMulTranspose(f, f, b);
    SbMatMul(f, r, fr);
    SbPackPut(9, r, l, right);
    SbPackPut(9, b, l, left);
    for (int k = 0; k < 9; k++)
      B[k][l] = s->I1[l] * f[k] - fr[k];
  }
  rows_of(second, &of, F, (const SbPack *)B, (const SbPack *)D, YF, YB, YD);
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int i = ij / 3;
      const int j = ij % 3;
      const int k = kl / 3;
      const int n = kl % 3;
      const PetscReal same = ij == kl;
      const PetscReal row = i == k;
      const PetscReal column = j == n;

      for (int l = 0; l < SB_BATCH; l++) {
        c[l] = same * of.one[l] - of.p[l] * D[3 * i + n][l] * D[3 * k + j][l] +
               F[ij][l] * YF[kl][l] + D[ij][l] * YD[kl][l];
        if (second)
          c[l] += B[ij][l] * YB[kl][l] +
                  of.two[l] * (same * s->I1[l] - row * right[3 * j + n][l] -
                               column * left[3 * i + k][l] - F[3 * i + n][l] * F[3 * k + j][l]);
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

SB_KERNEL static void exact_first(PetscReal K, const Measures *s, const SbShapeEnergy *w,
                                  const SbPack F[restrict 9], SbPack C[restrict 81])
{
  exact(K, PETSC_FALSE, s, w, F, C);
}

SB_KERNEL static void exact_both(PetscReal K, const Measures *s, const SbShapeEnergy *w,
                                 const SbPack F[restrict 9], SbPack C[restrict 81])
{
  exact(K, PETSC_TRUE, s, w, F, C);
}

SB_KERNEL static void projected(PetscReal K, PetscBool second, const Measures *measures,
                                const SbShapeEnergy *w, const SbPack F[restrict 9],
                                SbPack C[restrict 81])
{
  SbPack U[9], V[9], s[3], hessian[6], flip[3], twist[3];
  Coefficients c;

  coefficients(K, second, measures, w, &c);
  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal x[3] = {s[0][l], s[1][l], s[2][l]};
    const PetscReal r[3] = {1 / x[0], 1 / x[1], 1 / x[2]};
    PetscReal b[3];

    for (int i = 0; i < 3; i++)
      b[i] = x[i] * (x[(i + 1) % 3] * x[(i + 1) % 3] + x[(i + 2) % 3] * x[(i + 2) % 3]);
    for (int i = 0, k = 0; i < 3; i++) {
      for (int j = i; j < 3; j++, k++) {
        hessian[k][l] = c.form[0][l] * x[i] * x[j] + c.form[1][l] * (x[i] * b[j] + b[i] * x[j]) +
                        c.form[2][l] * (x[i] * r[j] + r[i] * x[j]) + c.form[3][l] * b[i] * b[j] +
                        c.form[4][l] * (b[i] * r[j] + r[i] * b[j]) + c.form[5][l] * r[i] * r[j];
        if (i == j)
          hessian[k][l] +=
            c.one[l] + c.two[l] * (measures->I1[l] - 3 * x[i] * x[i]) - c.p[l] * r[i] * r[i];
      }
    }
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3;
      const int j = (k + 2) % 3;
      const PetscReal pair = c.two[l] * x[i] * x[j] + c.p[l] * r[i] * r[j];
      const PetscReal middle = c.one[l] + c.two[l] * x[k] * x[k];

      flip[k][l] = middle - pair;
      twist[k][l] = middle + pair;
    }
  }
  SbSpectralTangent(U, V, hessian, flip, twist, C);
}

void SbIsochoricTangent(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  const PetscBool second = ((const SbIsochoric *)m->data)->second;
  const PetscReal K = SbIsochoricBulk(m);
  Measures s;
  SbShapeEnergy w;

  evaluate(m, F, &s, &w);
  if (m->tangent == SB_TANGENT_EXACT_SPD)
    projected(K, second, &s, &w, F, C);
  else
    (second ? exact_both : exact_first)(K, &s, &w, F, C);
}

/* the change of volume */

SB_KERNEL void SbIsochoricDilatation(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                     SbPack theta)
{
  const SbVolumetric kind = SbIsochoricVolumetric(m);

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], t, u;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    theta[l] = SbVolumetricDilatation(kind, &v, &t, &u);
  }
}

/* t D */
SB_KERNEL void SbIsochoricDilatationGradient(const struct _p_SbMaterial *m,
                                             const SbPack F[restrict 9], SbPack D[restrict 9])
{
  const SbVolumetric kind = SbIsochoricVolumetric(m);

  SbInverseTransposed(F, D);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], t, u;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    (void)SbVolumetricDilatation(kind, &v, &t, &u);
    for (int k = 0; k < 9; k++)
      D[k][l] *= t;
  }
}

/* d^2 theta/dF_(ij)(kl) = u D_ij D_kl - t D_il D_kj */
SB_KERNEL void SbIsochoricDilatationHessian(const struct _p_SbMaterial *m,
                                            const SbPack F[restrict 9], const SbPack p,
                                            SbPack C[restrict 81])
{
  const SbVolumetric kind = SbIsochoricVolumetric(m);
  SbPack of_DD, q, H[81];

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], t, u;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    (void)SbVolumetricDilatation(kind, &v, &t, &u);
    of_DD[l] = p[l] * u;
    q[l] = p[l] * t;
  }
  SbInvariantTangent(m, F, NULL, NULL, of_DD, q, H);
  for (int k = 0; k < 81; k++)
    for (int l = 0; l < SB_BATCH; l++)
      C[k][l] += H[k][l];
}

SB_KERNEL void SbIsochoricPressure(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                   SbPack q, SbPack of_DD)
{
  const SbVolumetric kind = SbIsochoricVolumetric(m);
  const PetscReal K = SbIsochoricBulk(m);

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], next;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    const PetscReal slope = SbVolumetricStress(kind, &v, &next);
    q[l] = v.J > 0 ? K * slope : NAN;
    of_DD[l] = K * next;
  }
}

/* options */

PetscErrorCode SbIsochoricSetFromOptions(SbMaterial m, const SbScope *scope, PetscReal mu,
                                         const char *formula)
{
  SbIsochoric *law = (SbIsochoric *)m->data;
  PetscBool bulk, poisson;
  PetscReal value = 0;
  char first[3 * SB_NAME_MAX], second[3 * SB_NAME_MAX];
  SbScope all;

  PetscFunctionBeginUser;
  SbOptionName(scope, "material", sizeof(first), first);
  PetscCheck(mu > 0 && PetscIsNormalReal(mu), PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s %s: the shear modulus at rest, %s, is %g Pa; it must be in (0, inf) Pa", first,
             scope->type, formula, (double)mu);
  PetscCall(SbOptionChoice(scope, "volumetric", &law->volumetric));

  /* which one is given; that of the body goes before one of all bodies */
  PetscCall(SbOptionGiven(scope, "bulk", &bulk));
  PetscCall(SbOptionGiven(scope, "poisson", &poisson));
  SbOptionName(scope, "bulk", sizeof(first), first);
  SbOptionName(scope, "poisson", sizeof(second), second);
  PetscCheck(bulk || poisson, PETSC_COMM_SELF, PETSC_ERR_USER,
             "%s or %s must be given: the material law %s takes the resistance to a change of "
             "volume as a bulk modulus, Pa, or by Poisson's ratio, in (-1, 0.5)",
             first, second, scope->type);
  if (bulk && poisson) {
    PetscCall(PetscOptionsHasName(NULL, NULL, first, &bulk));
    PetscCall(PetscOptionsHasName(NULL, NULL, second, &poisson));
    if (!bulk && !poisson) {
      SbScopeSet(&all, scope->klass, scope->type, SB_OPTION_DEFAULT);
      SbOptionName(&all, "bulk", sizeof(first), first);
      SbOptionName(&all, "poisson", sizeof(second), second);
    }
    PetscCheck(bulk != poisson, PETSC_COMM_SELF, PETSC_ERR_USER,
               "%s and %s both give the resistance to a change of volume: leave one of them out",
               first, second);
  }
  PetscCall(SbOptionReal(scope, bulk ? "bulk" : "poisson", &value));
  if (bulk) {
    SbMaterialSetLame(m, value - 2. / 3. * mu, mu);
  } else {
    SbMaterialSetLame(m, 2 * mu * value / (1 - 2 * value), mu);
    m->rest->nu = value;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
