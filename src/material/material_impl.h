/*
  material_impl.h - shared by the laws: constructors, Hooke's stiffness at rest, projection of an isotropic tangent.
*/
#pragma once
#include <sbmaterial.h>

PetscErrorCode SbMaterialCreate_Linear(SbMaterial m);
PetscErrorCode SbMaterialCreate_Corotated(SbMaterial m);
PetscErrorCode SbMaterialCreate_StVK(SbMaterial m);
PetscErrorCode SbMaterialCreate_NeoHookean(SbMaterial m);

/* Lame parameters, Pa. */
typedef struct {
  PetscReal lambda, mu;
} SbLame;

/*
  SbMaterialSetHooke - sets m->data to an SbLame from E and nu, and the law's operations for its stiffness.

  Not collective. Sets shear_modulus, bulk_modulus, volumetric_modulus and wave_speed of the table. For laws with Hooke's tensor as tangent
  at rest; other laws set their own operations.
*/
PetscErrorCode SbMaterialSetHooke(SbMaterial m);
/* Lame parameters of a law that called SbMaterialSetHooke(). */
SB_INLINE const SbLame *sb_lame(const struct _p_SbMaterial *m)
{
  return (const SbLame *)m->data;
}

/* Options of laws with the tangents exact and exact_spd: reads and checks `tangent`. */
PetscErrorCode SbMaterialSetFromOptions_Exact(SbMaterial m, const SbScope *scope);
PetscErrorCode SbMaterialSetTangent_Exact(SbMaterial m, SbTangentKind kind);

/*
  SbSpectralTangent - tangent C[81] of an isotropic energy psi(s0, s1, s2), with negative eigenvalues set to zero.

  Input, Pa, with (i, j, k) cyclic: hessian[6] = d^2 psi / ds_i ds_j as 00 01 02 11 12 22;
    flip[k]  = (psi_i - psi_j) / (s_i - s_j), eigenvalue of the symmetric shear of the axes i and j;
    twist[k] = (psi_i + psi_j) / (s_i + s_j), eigenvalue of the rotation about axis k; psi_i = d psi / d s_i.
*/
void SbSpectralTangent(const SbPack U[9], const SbPack V[9], const SbPack hessian[6], const SbPack flip[3],
                       const SbPack twist[3], SbPack C[81]);

/* C_(ij)(kl) = C_(kl)(ij) = c */
SB_INLINE void SbTangentPut(const SbPack c, int ij, int kl, SbPack C[81])
{
  for (int l = 0; l < SB_BATCH; l++) C[9 * ij + kl][l] = c[l];
  for (int l = 0; l < SB_BATCH; l++) C[9 * kl + ij][l] = c[l];
}
