/*
  isochoric.h - laws of rubber and tissue with the change of shape apart from that of volume,

    psi = W(F J^(-1/3)) + K/2 theta(J)^2,

  with moduli of their own. What they share: the change of volume (volumetric.h), the options
  `bulk`, `poisson` and `volumetric`, and, of those with W(x1, x2) in the invariants of the
  isochoric part, x1 = J^(-2/3) |F|^2 - 3, x2 = J^(-4/3) |cof F|^2 - 3, energy, stress and tangent.
*/
#pragma once
#include "volumetric.h"

/* W, J/m^3, and its derivatives by x1 and x2, Pa. */
typedef struct {
  SbPack W, W1, W2, W11, W12, W22;
} SbShapeEnergy;

/* Begins the data of a law of this kind. */
typedef struct {
  SbVolumetric volumetric;
  PetscBool second; /* whether W depends on x2; if not, nothing of x2 is computed or read */
  /* W at x1 and x2 of a batch; infinite with derivatives that are no numbers beyond a limit of
     stretch. NULL of a law of the principal stretches, which has operations of its own. */
  void (*shape)(const struct _p_SbMaterial *m, const SbPack x1, const SbPack x2, SbShapeEnergy *w);
} SbIsochoric;

/* K */
SB_INLINE PetscReal SbIsochoricBulk(const struct _p_SbMaterial *m)
{
  return m->rest->lambda + 2. / 3. * m->rest->mu;
}

SB_INLINE SbVolumetric SbIsochoricVolumetric(const struct _p_SbMaterial *m)
{
  return ((const SbIsochoric *)m->data)->volumetric;
}

/* W = c[0] x1 + c[1] x1^2 + ... of n terms, n >= 1, for a law without x2. */
SB_INLINE void SbShapePolynomial(int n, const PetscReal c[], const SbPack x1, SbShapeEnergy *w)
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal x = x1[l];
    PetscReal value = 0;
    PetscReal first = 0;
    PetscReal second = 0;

    for (int k = n; k >= 1; k--) {
      value = (value + c[k - 1]) * x;
      first = first * x + k * c[k - 1];
      if (k > 1)
        second = second * x + k * (k - 1) * c[k - 1];
    }
    w->W[l] = value;
    w->W1[l] = first;
    w->W11[l] = second;
  }
}

/* SbMaterialOps of a law W(x1, x2); the dilatation also of one of the principal stretches. */
void SbIsochoricEnergy(const struct _p_SbMaterial *m, const SbPack F[9], SbPack psi);
void SbIsochoricStress(const struct _p_SbMaterial *m, const SbPack F[9], SbPack P[9]);
void SbIsochoricTangent(const struct _p_SbMaterial *m, const SbPack F[9], SbPack C[81]);
void SbIsochoricDilatation(const struct _p_SbMaterial *m, const SbPack F[9], SbPack theta);
void SbIsochoricDilatationGradient(const struct _p_SbMaterial *m, const SbPack F[9], SbPack D[9]);
void SbIsochoricDilatationHessian(const struct _p_SbMaterial *m, const SbPack F[9], const SbPack p,
                                  SbPack C[81]);

#define SB_ISOCHORIC_OPS                                                                   \
  .energy = SbIsochoricEnergy, .stress = SbIsochoricStress, .tangent = SbIsochoricTangent, \
  SB_ISOCHORIC_DILATATION
#define SB_ISOCHORIC_DILATATION                                                              \
  .dilatation = SbIsochoricDilatation, .dilatation_gradient = SbIsochoricDilatationGradient, \
  .dilatation_hessian = SbIsochoricDilatationHessian

/* q D_il D_kj and of_DD D_ij D_kl are of the change of volume: of_DD, and the pressure q, of a
   batch. J <= 0: no numbers. */
void SbIsochoricPressure(const struct _p_SbMaterial *m, const SbPack F[9], SbPack q, SbPack of_DD);

/*
  SbIsochoricSetFromOptions - reads bulk or poisson and volumetric, and sets the stiffness at rest.

  mu: shear modulus at rest, Pa; formula: how it follows from the options of the law, for the error.
  Errors: PETSC_ERR_USER for mu <= 0, and unless one of bulk and poisson is given. Not collective.
*/
PetscErrorCode SbIsochoricSetFromOptions(SbMaterial m, const SbScope *scope, PetscReal mu,
                                         const char *formula);

/* Option rows of every law of this kind; `poisson` is one of every body. */
#define SB_ISOCHORIC_ROWS                                                                      \
  SB_MATERIAL_TANGENT_ROW,                                                                     \
    {"bulk",                                                                                   \
     SB_OPTION_REAL,                                                                           \
     1,                                                                                        \
     "Pa",                                                                                     \
     "",                                                                                       \
     "(0, inf)",                                                                               \
     "bulk modulus K at rest, in place of poisson: nu = (3 K - 2 mu) / "                       \
     "(6 K + 2 mu)"},                                                                          \
  {                                                                                            \
    "volumetric", SB_OPTION_CHOICE, 1, "", "simo_taylor", "simo_taylor|quadratic|logarithmic", \
      "energy of the change of volume: K/4 (J^2 - 1 - 2 ln J), K/2 (J - 1)^2 or K/2 (ln J)^2"  \
  }
