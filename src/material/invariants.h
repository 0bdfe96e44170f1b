/*
  invariants.h - isotropic laws psi(I1, J), I1 = |F|^2, J = det F: the change of volume without
  loss of digits, and the tangent from its coefficients.
*/
#pragma once
#include "material_impl.h"

/* Of a lane. From H = F - I, J - 1 has no rounding of size 1 at small strains. */
typedef struct {
  PetscReal J, j; /* j = J - 1 = tr H + minors */
  PetscReal minors;
  PetscReal square; /* |H|^2; I1 - 3 = 2 tr H + |H|^2 */
  PetscReal log;    /* ln J; -inf for J <= 0 */
} SbVolume;

SB_INLINE SbVolume SbVolumeOf(const PetscReal f[9])
{
  const PetscReal h[9] = {f[0] - 1, f[1], f[2], f[3], f[4] - 1, f[5], f[6], f[7], f[8] - 1};
  PetscReal c[9];
  SbVolume v;

  SbMatCofactor(f, c);
  v.J = SbDot3(f, c);
  SbMatCofactor(h, c);
  v.minors = c[0] + c[4] + c[8] + SbDot3(h, c);
  v.j = h[0] + h[4] + h[8] + v.minors;
  v.square = SbDot9(h, h);
  v.log = v.J > 0.5 ? log1p(v.j) : v.J > 0 ? log(v.J) : -INFINITY;
  return v;
}

/* D = F^-T = cof F / J; no number for J <= 0. */
void SbInverseTransposed(const SbPack F[9], SbPack D[9]);

/*
  SbInvariantTangent - C_(ij)(kl) = of_I identity + of_FD (F_ij D_kl + D_ij F_kl) + of_DD D_ij D_kl
  - q D_il D_kj, D = F^-T, with negative eigenvalues raised to zero if m->tangent says so.

  A coefficient that is NULL is zero; q is not. Of psi(I1, J): of_I = 2 psi_1, of_FD = 2 J psi_1J,
  of_DD = J (J psi_J)_J, q = J psi_J.
*/
void SbInvariantTangent(const struct _p_SbMaterial *m, const SbPack F[9], const PetscReal *of_I,
                        const PetscReal *of_FD, const PetscReal *of_DD, const SbPack q,
                        SbPack C[81]);

/* The dilatation theta = ln J and its derivatives (SbMaterialOps); no numbers for J <= 0. */
void SbLogVolume(const struct _p_SbMaterial *m, const SbPack F[9], SbPack theta);
void SbLogVolumeGradient(const struct _p_SbMaterial *m, const SbPack F[9], SbPack D[9]);
void SbLogVolumeHessian(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p,
                        SbPack C[81]);
