/*
  Laws with fibres (fibrous.h): energy, stress and tangent from Wf(E).

  With a = J^(-2/3), D = F^-T, S = Q (dWf/dE) Q^T, C = F^T F, s = S : C and T = F S,

    dE  = a (sym(F^T dF) - (D : dF) C / 3) in the axes of the cell,
    P   = a (T - s/3 D),
    dP  = dE : d2Wf/dE2 : dE + a (d_ik S_jl - 2/3 (D_ij T_kl + T_ij D_kl) + 2/9 s D_ij D_kl
          + s/3 D_il D_kj).

  E comes from F - I, so that nothing is lost at small strains. The projected tangent is that of the
  sum, cell by cell: there is no eigensystem in closed form.

  Holzapfel, Nonlinear solid mechanics, 2000, chapter 6; Gasser, Ogden and Holzapfel 2006.
*/
#include "fibrous.h"

#define SWEEPS 12        /* at most; 6 or 7 are needed */
#define NEGLIGIBLE 1e-17 /* off-diagonal entry over the largest one that is left */
#define ROUNDING 4e-15   /* of the largest entry: what eigenvalues are below zero by rounding */

/* Of a batch. No numbers for J <= 0. */
typedef struct {
  SbPack a;    /* J^(-2/3) */
  SbPack C[6]; /* F^T F in the axes */
  SbPack E[6]; /* isochoric strain in the axes */
} Strains;

static const int row[6] = {0, 0, 0, 1, 1, 2};
static const int column[6] = {0, 1, 2, 1, 2, 2};
static const int at[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
static const PetscReal twice[6] = {1, 2, 2, 1, 2, 1};

static const SbPack unit[9] = {[0] = {[0 ... SB_BATCH - 1] = 1},
                               [4] = {[0 ... SB_BATCH - 1] = 1},
                               [8] = {[0 ... SB_BATCH - 1] = 1}};

static const SbPack *axes_of(const struct _p_SbMaterial *m)
{
  return m->axes ? m->axes : unit;
}

SB_KERNEL static void strains(const SbPack Q[restrict 9], const SbPack F[restrict 9], Strains *s)
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], q[9], g[9], e[9], t[9];

    SbPackGet(9, F, l, f);
    SbPackGet(9, Q, l, q);
    const SbVolume v = SbVolumeOf(f);
    const PetscReal h[9] = {f[0] - 1, f[1], f[2], f[3], f[4] - 1, f[5], f[6], f[7], f[8] - 1};
    SbMatTransposeMul(h, h, g);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        e[3 * i + j] = (h[3 * i + j] + h[3 * j + i] + g[3 * i + j]) / 2;
    SbMatTransposeMul(q, e, t);
    SbMatMul(t, q, e);
    const PetscReal grown = expm1(-2. / 3. * v.log);
    const PetscReal a = v.J > 0 ? 1 + grown : NAN;

    s->a[l] = a;
    for (int n = 0; n < 6; n++) {
      const PetscReal one = row[n] == column[n];
      const PetscReal strain = e[3 * row[n] + column[n]];

      s->C[n][l] = one + 2 * strain;
      s->E[n][l] = a * strain + one * grown / 2;
    }
  }
}

void SbFibreClear(int level, SbFibreEnergy *w)
{
  memset(w->W, 0, sizeof(w->W));
  if (level > 0)
    memset(w->S, 0, sizeof(w->S));
  if (level > 1)
    memset(w->C, 0, sizeof(w->C));
}

SB_KERNEL void SbFibreAddExponential(PetscReal k1, PetscReal k2, PetscBool both,
                                     const PetscReal G[6], int level, const SbPack E[restrict 6],
                                     SbFibreEnergy *restrict w)
{
  SbPack first, second;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal x = 0;

    for (int n = 0; n < 6; n++)
      x += twice[n] * G[n] * E[n][l];
    x = both || !(x < 0) ? x : 0;
    const PetscReal y = k2 * x * x;
    const PetscReal more = expm1(y);
    const PetscReal part = y > SB_FIBRE_LIMIT ? NAN : 1 + more;
    const PetscReal on = both || x > 0;

    w->W[l] += y > SB_FIBRE_LIMIT ? INFINITY : k1 / 2 * (k2 > 0 ? more / k2 : x * x);
    first[l] = k1 * x * part;
    second[l] = on * k1 * (1 + 2 * y) * part;
  }
  for (int n = 0; level > 0 && n < 6; n++)
    for (int l = 0; l < SB_BATCH; l++)
      w->S[n][l] += G[n] * first[l];
  for (int n = 0; level > 1 && n < 6; n++)
    for (int i = 0; i < 6; i++)
      for (int l = 0; l < SB_BATCH; l++)
        w->C[n][i][l] += G[n] * G[i] * second[l];
}

SB_KERNEL void SbFibrousNoMatrix(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2,
                                 SbShapeEnergy *w)
{
  (void)m;
  (void)x1;
  (void)x2;
  for (int l = 0; l < SB_BATCH; l++)
    w->W[l] = w->W1[l] = w->W11[l] = 0;
}

void SbFibrousEnergy(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi)
{
  Strains s;
  SbFibreEnergy w;

  SbIsochoricEnergy(m, F, psi);
  strains(axes_of(m), F, &s);
  ((const SbFibrous *)m->data)->fibre(m, 0, (const SbPack *)s.E, &w);
  for (int l = 0; l < SB_BATCH; l++)
    psi[l] = s.a[l] > 0 ? psi[l] + w.W[l] : INFINITY;
}

/* S in the frame of F, and s = S : C. */
SB_INLINE void turn(const SbPack Q[9], const Strains *s, const SbFibreEnergy *w, int l,
                    PetscReal S[9], PetscReal *trace)
{
  PetscReal q[9], own[9], t[9];

  *trace = 0;
  SbPackGet(9, Q, l, q);
  for (int k = 0; k < 9; k++)
    own[k] = w->S[at[k]][l];
  for (int n = 0; n < 6; n++)
    *trace += twice[n] * w->S[n][l] * s->C[n][l];
  SbMatMul(q, own, t);
  SbMatMulTranspose(t, q, S);
}

SB_KERNEL static void add_stress(const SbPack Q[restrict 9], const Strains *s,
                                 const SbFibreEnergy *w, const SbPack F[restrict 9],
                                 const SbPack D[restrict 9], SbPack P[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], S[9], T[9], trace;

    SbPackGet(9, F, l, f);
    turn(Q, s, w, l, S, &trace);
    SbMatMul(f, S, T);
    for (int k = 0; k < 9; k++)
      P[k][l] += s->a[l] * (T[k] - trace / 3 * D[k][l]);
  }
}

void SbFibrousStress(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9])
{
  Strains s;
  SbFibreEnergy w;
  SbPack D[9];

  SbIsochoricStress(m, F, P);
  strains(axes_of(m), F, &s);
  ((const SbFibrous *)m->data)->fibre(m, 1, (const SbPack *)s.E, &w);
  SbInverseTransposed(F, D);
  add_stress(axes_of(m), &s, &w, F, (const SbPack *)D, P);
}

/* B[n] = w_n dE_n/dF, and Y = d2Wf/dE2 B; S, T and s as above. */
SB_KERNEL static void directions(const SbPack Q[restrict 9], const Strains *s,
                                 const SbFibreEnergy *w, const SbPack F[restrict 9],
                                 const SbPack D[restrict 9], SbPack B[restrict 6][9],
                                 SbPack S[restrict 9], SbPack T[restrict 9], SbPack trace)
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], q[9], g[9], own[9], t[9];

    SbPackGet(9, F, l, f);
    SbPackGet(9, Q, l, q);
    SbMatMul(f, q, g);
    for (int n = 0; n < 6; n++)
      for (int k = 0; k < 9; k++)
        B[n][k][l] = twice[n] * s->a[l] *
                     ((g[3 * (k / 3) + row[n]] * q[3 * (k % 3) + column[n]] +
                       g[3 * (k / 3) + column[n]] * q[3 * (k % 3) + row[n]]) /
                        2 -
                      D[k][l] * s->C[n][l] / 3);
    turn(Q, s, w, l, own, &trace[l]);
    SbMatMul(f, own, t);
    SbPackPut(9, own, l, S);
    SbPackPut(9, t, l, T);
  }
}

SB_KERNEL static void add_tangent(const Strains *s, const SbFibreEnergy *w,
                                  const SbPack B[restrict 6][9], const SbPack D[restrict 9],
                                  const SbPack S[restrict 9], const SbPack T[restrict 9],
                                  const SbPack trace, SbPack C[restrict 81])
{
  SbPack Y[6][9];

  for (int n = 0; n < 6; n++) {
    for (int k = 0; k < 9; k++) {
      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = 0;

        for (int i = 0; i < 6; i++)
          sum += w->C[n][i][l] * B[i][k][l];
        Y[n][k][l] = sum;
      }
    }
  }
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int i = ij / 3;
      const int j = ij % 3;
      const int k = kl / 3;
      const int n = kl % 3;
      const PetscReal same = i == k;
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = 0;

        for (int e = 0; e < 6; e++)
          sum += B[e][ij][l] * Y[e][kl][l];
        c[l] =
          C[9 * ij + kl][l] + sum +
          s->a[l] *
            (same * S[3 * j + n][l] - 2. / 3. * (D[ij][l] * T[kl][l] + T[ij][l] * D[kl][l]) +
             trace[l] * (2. / 9. * D[ij][l] * D[kl][l] + D[3 * i + n][l] * D[3 * k + j][l] / 3));
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

/* Whether C is positive semi-definite but for rounding, by its Cholesky factor: least > 0. */
SB_KERNEL static void least_pivot(const SbPack C[restrict 81], SbPack least)
{
  SbPack L[81], shift;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal most = 0;

    for (int k = 0; k < 9; k++)
      most = PetscMax(most, C[10 * k][l]);
    shift[l] = ROUNDING * most;
    least[l] = 1;
  }
  for (int j = 0; j < 9; j++) {
    for (int i = j; i < 9; i++) {
      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = C[9 * i + j][l] + (i == j ? shift[l] : 0);

        for (int k = 0; k < j; k++)
          sum -= L[9 * i + k][l] * L[9 * j + k][l];
        if (i == j) {
          least[l] = sum > 0 ? least[l] : 0;
          L[10 * j][l] = PetscSqrtReal(sum > 0 ? sum : 1);
        } else {
          L[9 * i + j][l] = sum / L[10 * j][l];
        }
      }
    }
  }
}

/* One sweep of Jacobi's method: A <- V A V^T, rows of V likewise; turned: in which lanes a rotation
   was not negligible. */
SB_KERNEL static void sweep(const SbPack size, SbPack A[restrict 81], SbPack V[restrict 81],
                            SbPack turned)
{
  SbPack c, s;

  for (int l = 0; l < SB_BATCH; l++)
    turned[l] = 0;
  for (int p = 0; p < 8; p++) {
    for (int q = p + 1; q < 9; q++) {
      for (int l = 0; l < SB_BATCH; l++) {
        const PetscReal off = A[9 * p + q][l];
        const PetscBool on = (PetscBool)(PetscAbsReal(off) > NEGLIGIBLE * size[l]);
        const PetscReal z = (A[10 * q][l] - A[10 * p][l]) / (2 * (on ? off : 1));
        const PetscReal t =
          on ? (z < 0 ? -1 : 1) / (PetscAbsReal(z) + PetscSqrtReal(1 + z * z)) : 0;

        turned[l] += on;
        c[l] = 1 / PetscSqrtReal(1 + t * t);
        s[l] = t * c[l];
      }
      for (int k = 0; k < 9; k++) {
        for (int l = 0; l < SB_BATCH; l++) {
          const PetscReal x = A[9 * k + p][l];
          const PetscReal y = A[9 * k + q][l];
          const PetscReal v = V[9 * p + k][l];
          const PetscReal u = V[9 * q + k][l];

          A[9 * k + p][l] = c[l] * x - s[l] * y;
          A[9 * k + q][l] = s[l] * x + c[l] * y;
          V[9 * p + k][l] = c[l] * v - s[l] * u;
          V[9 * q + k][l] = s[l] * v + c[l] * u;
        }
      }
      for (int k = 0; k < 9; k++) {
        for (int l = 0; l < SB_BATCH; l++) {
          const PetscReal x = A[9 * p + k][l];
          const PetscReal y = A[9 * q + k][l];

          A[9 * p + k][l] = c[l] * x - s[l] * y;
          A[9 * q + k][l] = s[l] * x + c[l] * y;
        }
      }
    }
  }
}

/* C = sum of w v v^T over the eigenvalues w > 0, in lanes with least = 0. */
SB_KERNEL static void recompose(const SbPack A[restrict 81], const SbPack V[restrict 81],
                                const SbPack least, SbPack C[restrict 81])
{
  for (int i = 0; i < 9; i++) {
    for (int k = i; k < 9; k++) {
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = 0;

        for (int e = 0; e < 9; e++)
          sum += (A[10 * e][l] > 0 ? A[10 * e][l] : 0) * V[9 * e + i][l] * V[9 * e + k][l];
        c[l] = least[l] > 0 ? C[9 * i + k][l] : sum;
      }
      SbTangentPut(c, i, k, C);
    }
  }
}

/* Raises the negative eigenvalues to zero, of the lanes that have some; others stay as they are,
   and do not depend on them. */
static void project(SbPack C[81])
{
  PetscReal more = 0;
  SbPack least, size, turned, A[81], V[81];

  least_pivot((const SbPack *)C, least);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal sum = 0;

    size[l] = 0;
    for (int k = 0; k < 81; k++) {
      sum += C[k][l];
      size[l] = PetscMax(size[l], PetscAbsReal(C[k][l]));
    }
    if (PetscIsInfOrNanReal(sum))
      least[l] = 1;
    for (int k = 0; k < 81; k++) {
      A[k][l] = least[l] > 0 ? 0 : C[k][l];
      V[k][l] = k % 10 == 0;
    }
    more += 1 - least[l];
  }
  if (more == 0)
    return;
  for (int n = 0; n < SWEEPS && more > 0; n++) {
    sweep(size, A, V, turned);
    more = 0;
    for (int l = 0; l < SB_BATCH; l++)
      more += turned[l];
  }
  recompose((const SbPack *)A, (const SbPack *)V, least, C);
}

void SbFibrousTangent(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81])
{
  struct _p_SbMaterial exact = *m;
  Strains s;
  SbFibreEnergy w;
  SbPack D[9], B[6][9], S[9], T[9], trace;

  exact.tangent = SB_TANGENT_EXACT;
  SbIsochoricTangent(&exact, F, C);
  strains(axes_of(m), F, &s);
  ((const SbFibrous *)m->data)->fibre(m, 2, (const SbPack *)s.E, &w);
  SbInverseTransposed(F, D);
  directions(axes_of(m), &s, &w, F, (const SbPack *)D, B, S, T, trace);
  add_tangent(&s, &w, (const SbPack(*)[9])B, (const SbPack *)D, (const SbPack *)S,
              (const SbPack *)T, trace, C);
  if (m->tangent == SB_TANGENT_EXACT_SPD)
    project(C);
}
