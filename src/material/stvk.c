/*
  St. Venant-Kirchhoff: E = (F^T F - I)/2, psi = mu E : E + lambda/2 tr(E)^2, P = F (2 mu E + lambda
  tr(E) I).

  Tangent: dP_ij = dF_il S_lj + mu (F F^T)_ik dF_kj + mu F_il dF_kl F_kj + lambda F_ij F_kl dF_kl,
  with S = 2 mu E + lambda tr(E) I. In signed stretches psi_i = s_i (lambda tr(E) + mu (s_i^2 - 1)),
  for exact_spd.

  The law softens in compression and does not resist inversion (P = 0 at s = 0): for moderate
  strains only.
*/
#include "material_impl.h"

/* f = F of lane l, e = its Green strain. */
SB_INLINE void green_strain(const SbPack F[9], int l, PetscReal f[9], PetscReal e[9])
{
  SbPackGet(9, F, l, f);
  SbMatTransposeMul(f, f, e);
  for (int k = 0; k < 9; k++)
    e[k] = (e[k] - (k % 4 == 0)) / 2;
}

SB_KERNEL static void energy_stvk(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                  SbPack psi)
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], e[9];

    green_strain(F, l, f, e);
    const PetscReal tr = e[0] + e[4] + e[8];
    psi[l] = mu * SbDot9(e, e) + lambda / 2 * tr * tr;
  }
}

SB_KERNEL static void stress_stvk(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                  SbPack P[restrict 9])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], e[9], p[9];

    green_strain(F, l, f, e);
    const PetscReal pressure = lambda * (e[0] + e[4] + e[8]);
    for (int k = 0; k < 9; k++)
      e[k] = 2 * mu * e[k] + (k % 4 == 0 ? pressure : 0);
    SbMatMul(f, e, p);
    SbPackPut(9, p, l, P);
  }
}

/* theta = tr(E) */
SB_KERNEL static void dilatation_stvk(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                      SbPack theta)
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], e[9];

    green_strain(F, l, f, e);
    theta[l] = e[0] + e[4] + e[8];
  }
}

SB_KERNEL static void tangent_spd(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                  SbPack C[restrict 81])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack U[9], V[9], s[3], hessian[6], flip[3], twist[3];

  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal a = s[0][l];
    const PetscReal b = s[1][l];
    const PetscReal c = s[2][l];
    const PetscReal p = lambda * (a * a + b * b + c * c - 3) / 2 - mu;

    hessian[0][l] = p + (lambda + 3 * mu) * a * a;
    hessian[1][l] = lambda * a * b;
    hessian[2][l] = lambda * a * c;
    hessian[3][l] = p + (lambda + 3 * mu) * b * b;
    hessian[4][l] = lambda * b * c;
    hessian[5][l] = p + (lambda + 3 * mu) * c * c;
    flip[0][l] = p + mu * (b * b + b * c + c * c);
    flip[1][l] = p + mu * (c * c + c * a + a * a);
    flip[2][l] = p + mu * (a * a + a * b + b * b);
    twist[0][l] = p + mu * (b * b - b * c + c * c);
    twist[1][l] = p + mu * (c * c - c * a + a * a);
    twist[2][l] = p + mu * (a * a - a * b + b * b);
  }
  SbSpectralTangent(U, V, hessian, flip, twist, C);
}

SB_KERNEL static void tangent_stvk(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                   SbPack C[restrict 81])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack S[9], B[9]; /* B = mu F F^T */

  if (m->tangent == SB_TANGENT_EXACT_SPD) {
    tangent_spd(m, F, C);
    return;
  }
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], e[9], b[9];

    green_strain(F, l, f, e);
    const PetscReal pressure = lambda * (e[0] + e[4] + e[8]);
    SbMatMulTranspose(f, f, b);
    for (int k = 0; k < 9; k++) {
      S[k][l] = 2 * mu * e[k] + (k % 4 == 0 ? pressure : 0);
      B[k][l] = mu * b[k];
    }
  }
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int i = ij / 3;
      const int j = ij % 3;
      const int k = kl / 3;
      const int n = kl % 3;
      const PetscReal same_row = i == k;
      const PetscReal same_column = j == n;
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        c[l] = lambda * F[ij][l] * F[kl][l] + mu * F[3 * i + n][l] * F[3 * k + j][l] +
               same_row * S[3 * n + j][l] + same_column * B[3 * i + k][l];
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

/* d theta/dF = F */
static void dilatation_gradient_stvk(const struct _p_SbMaterial *m, const SbPack F[9], SbPack D[9])
{
  (void)m;
  memcpy(D, F, 9 * sizeof(SbPack));
}

/* d^2 theta/dF^2 is the identity. */
static void dilatation_hessian_stvk(const struct _p_SbMaterial *m, const SbPack F[9],
                                    const SbPack p, SbPack C[81])
{
  const PetscBool filter = (PetscBool)(m->tangent == SB_TANGENT_EXACT_SPD);

  (void)F;
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      C[10 * k][l] += filter && p[l] < 0. ? 0. : p[l];
}

static const SbOption rows[] = {SB_MATERIAL_TANGENT_ROW};

const SbMaterialType SbMaterialStVK = {
  .name = "stvk",
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .softens = PETSC_TRUE,
  .ops = {.energy = energy_stvk,
          .stress = stress_stvk,
          .tangent = tangent_stvk,
          .dilatation = dilatation_stvk,
          .dilatation_gradient = dilatation_gradient_stvk,
          .dilatation_hessian = dilatation_hessian_stvk},
};
