/*
  material_impl.h - shared by the laws: their list, the stiffness at rest, the projection of an
  isotropic tangent.
*/
#pragma once
#include <sbmaterial.h>

/* The laws, each a constant SbMaterialType in a file of its own: a new one is a line here. */
#define SB_MATERIAL_LAWS(LAW)          \
  LAW(SbMaterialLinear)                \
  LAW(SbMaterialCorotated)             \
  LAW(SbMaterialStVK)                  \
  LAW(SbMaterialNeoHookean)            \
  LAW(SbMaterialIsochoricNeoHookean)   \
  LAW(SbMaterialStableNeoHookean)      \
  LAW(SbMaterialHolmesMow)             \
  LAW(SbMaterialMooneyRivlin)          \
  LAW(SbMaterialYeoh)                  \
  LAW(SbMaterialOgden)                 \
  LAW(SbMaterialGent)                  \
  LAW(SbMaterialArrudaBoyce)           \
  LAW(SbMaterialTransverselyIsotropic) \
  LAW(SbMaterialHolzapfelGasserOgden)  \
  LAW(SbMaterialGuccione)              \
  LAW(SbMaterialHolzapfelOgden)

#define SB_DECLARE_LAW(law) extern const SbMaterialType law;
SB_MATERIAL_LAWS(SB_DECLARE_LAW)
#undef SB_DECLARE_LAW

/* Stiffness at rest: Young's modulus, Pa, and Poisson's ratio as given, and what follows from them;
   or, where a law calls SbMaterialSetLame(), the other way round. */
struct _p_SbElastic {
  PetscReal E, nu;
  PetscReal lambda, mu; /* Lame parameters, Pa; lambda 0: without the volumetric part */
  /* Of a law with fibres, Pa: at rest psi is at most lambda/2 tr(E)^2 + (mu + fibre/2) E : E */
  PetscReal fibre;
};

PetscErrorCode SbFibresDestroy(SbFibres *fibres);

/* active.c: reads the tension of fibres into m->active; NULL: there is none. Then m has fibres.
   Errors: PETSC_ERR_USER as SbFibresRequire(), and for what the linear law cannot have. */
PetscErrorCode SbActiveRead(SbMaterial m, const SbScope *scope);
PetscErrorCode SbActiveDestroy(SbActive *active);

/* eigenstrain.c: reads the strains without stress into m->eigen; NULL: there are none. Errors:
   PETSC_ERR_USER for a viscoelastic material, a temperature without an expansion or the other way
   round, and as SbFibresRequire(). */
PetscErrorCode SbEigenstrainRead(SbMaterial m, const SbScope *scope);
PetscErrorCode SbEigenstrainDestroy(SbEigenstrain *eigen);

/* viscous.c: reads the series and the viscosity of a body into m->viscous; NULL: it has neither.
   Errors: PETSC_ERR_USER for what is no fraction, time or viscosity. */
PetscErrorCode SbViscousRead(SbMaterial m, const SbScope *scope);
/* The relaxed law, once there are the copies `step` and `relaxed`, and the state of a run that has
   not begun. Error: PETSC_ERR_USER for a series that the law does not admit. */
PetscErrorCode SbViscousRelax(SbMaterial m, const SbScope *scope);

/* mullins.c: reads the constants of softening into m->mullins; NULL: there is none. After the
   tension of fibres and the series. Errors: PETSC_ERR_USER for constants out of range, and for laws
   and options that softening does not go with. */
PetscErrorCode SbMullinsRead(SbMaterial m, const SbScope *scope);

/* Option row of a law without a warped tangent. */
#define SB_MATERIAL_TANGENT_ROW                                                          \
  {                                                                                      \
    "tangent", SB_OPTION_CHOICE, 1, "", "auto", "auto|exact|exact_spd",                  \
      "tangent stiffness: exact; exact_spd, exact with each cell projected to positive " \
      "semi-definite, for CG"                                                            \
  }

/* r = R of a lane, S = sym(R^T F) as 00 01 02 11 12 22. */
SB_INLINE void SbStretchTensor(const SbPack F[9], const SbPack R[9], int l, PetscReal r[9],
                               SbPack S[6])
{
  PetscReal f[9], s[9];

  SbPackGet(9, F, l, f);
  SbPackGet(9, R, l, r);
  SbMatTransposeMul(r, f, s);
  S[0][l] = s[0];
  S[1][l] = (s[1] + s[3]) / 2;
  S[2][l] = (s[2] + s[6]) / 2;
  S[3][l] = s[4];
  S[4][l] = (s[5] + s[7]) / 2;
  S[5][l] = s[8];
}

/*
  SbSpectralTangent - tangent C[81] of an isotropic energy psi(s0, s1, s2), negative eigenvalues set
  to zero.

  Input, Pa, with (i, j, k) cyclic: hessian[6] = d^2 psi / ds_i ds_j as 00 01 02 11 12 22;
    flip[k]  = (psi_i - psi_j) / (s_i - s_j), eigenvalue of the symmetric shear of the axes i and j;
    twist[k] = (psi_i + psi_j) / (s_i + s_j), eigenvalue of the rotation about axis k; psi_i = d psi
    / d s_i.
*/
void SbSpectralTangent(const SbPack U[9], const SbPack V[9], const SbPack hessian[6],
                       const SbPack flip[3], const SbPack twist[3], SbPack C[81]);
/* The same with its negative eigenvalues. */
void SbSpectralTangentExact(const SbPack U[9], const SbPack V[9], const SbPack hessian[6],
                            const SbPack flip[3], const SbPack twist[3], SbPack C[81]);

/* C_(ij)(kl) = C_(kl)(ij) = c */
SB_INLINE void SbTangentPut(const SbPack c, int ij, int kl, SbPack C[81])
{
  for (int l = 0; l < SB_BATCH; l++)
    C[9 * ij + kl][l] = c[l];
  for (int l = 0; l < SB_BATCH; l++)
    C[9 * kl + ij][l] = c[l];
}
