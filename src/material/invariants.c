/*
  Tangents of isotropic laws psi(I1, J) (invariants.h). With W_i = d psi / d s_i = of_I s_i + q /
  s_i in signed stretches, the projected tangent has

    stretches  W_ii = of_I + 2 of_FD + (of_DD - q) / s_i^2
               W_ij = of_FD (s_i / s_j + s_j / s_i) + of_DD / (s_i s_j)
    flips      of_I - q / (s_i s_j)
    twists     of_I + q / (s_i s_j).
*/
#include "invariants.h"

SB_KERNEL void SbInverseTransposed(const SbPack F[restrict 9], SbPack D[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    const PetscReal J = SbDot3(f, c);
    for (int k = 0; k < 9; k++)
      D[k][l] = J > 0 ? c[k] / J : NAN;
  }
}

SB_KERNEL static void projected(const SbPack F[restrict 9], const SbPack of_I, const SbPack of_FD,
                                const SbPack of_DD, const SbPack q, SbPack C[restrict 81])
{
  SbPack U[9], V[9], s[3], hessian[6], flip[3], twist[3];

  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal r[3] = {1 / s[0][l], 1 / s[1][l], 1 / s[2][l]};

    for (int i = 0, k = 0; i < 3; i++) {
      hessian[k++][l] = of_I[l] + 2 * of_FD[l] + (of_DD[l] - q[l]) * r[i] * r[i];
      for (int j = i + 1; j < 3; j++)
        hessian[k++][l] = of_FD[l] * (s[i][l] * r[j] + s[j][l] * r[i]) + of_DD[l] * r[i] * r[j];
    }
    for (int k = 0; k < 3; k++) {
      const PetscReal pair = q[l] * r[(k + 1) % 3] * r[(k + 2) % 3];

      flip[k][l] = of_I[l] - pair;
      twist[k][l] = of_I[l] + pair;
    }
  }
  SbSpectralTangent(U, V, hessian, flip, twist, C);
}

/* mixed: whether of_FD is not zero. */
SB_INLINE void exact(const SbPack F[restrict 9], const SbPack D[restrict 9], PetscBool mixed,
                     const SbPack of_I, const SbPack of_FD, const SbPack of_DD, const SbPack q,
                     SbPack C[restrict 81])
{
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int il = 3 * (ij / 3) + kl % 3;
      const int kj = 3 * (kl / 3) + ij % 3;
      const PetscReal same = ij == kl;
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        c[l] = same * of_I[l] - q[l] * D[il][l] * D[kj][l] + of_DD[l] * D[ij][l] * D[kl][l];
        if (mixed)
          c[l] += of_FD[l] * (F[ij][l] * D[kl][l] + D[ij][l] * F[kl][l]);
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

SB_KERNEL static void plain(const SbPack F[restrict 9], const SbPack D[restrict 9],
                            const SbPack of_I, const SbPack of_DD, const SbPack q,
                            SbPack C[restrict 81])
{
  exact(F, D, PETSC_FALSE, of_I, NULL, of_DD, q, C);
}

SB_KERNEL static void mixed(const SbPack F[restrict 9], const SbPack D[restrict 9],
                            const SbPack of_I, const SbPack of_FD, const SbPack of_DD,
                            const SbPack q, SbPack C[restrict 81])
{
  exact(F, D, PETSC_TRUE, of_I, of_FD, of_DD, q, C);
}

void SbInvariantTangent(const struct _p_SbMaterial *m, const SbPack F[9], const PetscReal *of_I,
                        const PetscReal *of_FD, const PetscReal *of_DD, const SbPack q,
                        SbPack C[81])
{
  static const SbPack zero = {0};
  const PetscReal *a = of_I ? of_I : zero;
  const PetscReal *b = of_DD ? of_DD : zero;
  SbPack D[9];

  if (m->tangent == SB_TANGENT_EXACT_SPD) {
    projected(F, a, of_FD ? of_FD : zero, b, q, C);
    return;
  }
  SbInverseTransposed(F, D);
  if (of_FD)
    mixed(F, (const SbPack *)D, a, of_FD, b, q, C);
  else
    plain(F, (const SbPack *)D, a, b, q, C);
}

SB_KERNEL void SbLogVolume(const struct _p_SbMaterial *m, const SbPack F[restrict 9], SbPack theta)
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9];

    SbPackGet(9, F, l, f);
    theta[l] = SbVolumeOf(f).log;
  }
}

/* D = F^-T */
void SbLogVolumeGradient(const struct _p_SbMaterial *m, const SbPack F[9], SbPack D[9])
{
  (void)m;
  SbInverseTransposed(F, D);
}

/* d^2 theta/dF_(ij)(kl) = -D_il D_kj; twists have the eigenvalues 1 / (s_i s_j), flips -1 / (s_i
   s_j), stretches -1 / s_i^2. */
SB_KERNEL void SbLogVolumeHessian(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                  const SbPack p, SbPack C[restrict 81])
{
  SbPack H[81];

  SbInvariantTangent(m, F, NULL, NULL, NULL, p, H);
  for (int k = 0; k < 81; k++)
    for (int l = 0; l < SB_BATCH; l++)
      C[k][l] += H[k][l];
}
