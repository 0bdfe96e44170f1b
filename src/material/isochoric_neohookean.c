/*
  Neo-Hookean material with the change of shape apart from that of volume (Flory 1961; Simo and
  Taylor 1982), as Abaqus, deal.II, SOFA and others have it, nearly incompressible ones above all.
  With I1 = |F|^2, J = det F, D = F^-T and the bulk modulus K = lambda + 2/3 mu:

    psi = mu/2 (J^(-2/3) I1 - 3) + K/2 theta^2,   theta^2 = (J^2 - 1 - 2 ln J) / 2
    P   = a F + q D,   a = mu J^(-2/3),   q = K/2 (J^2 - 1) - a I1 / 3
    dP/dF_(ij)(kl) = a identity - 2/3 a (F_ij D_kl + D_ij F_kl) + (2/9 a I1 + K J^2) D_ij D_kl
                     - q D_il D_kj.

  theta has the sign of J - 1. A change of volume alone has a pressure that does not depend on mu,
  and with K much larger than mu the stress in an incompressible motion is that of the classical
  law. K/4 (J^2 - 1 - 2 ln J) is convex, unlike (ln J)^2; both are infinite at J = 0, where this
  law ends as the classical one does (neohookean.c).
*/
#include "volumetric.h"

/* Without material.c, which knows the laws. */
SB_INLINE PetscReal bulk_modulus(const struct _p_SbMaterial *m)
{
  return m->rest->lambda + 2. / 3. * m->rest->mu;
}

/* psi_mu = mu/2 (I1 - 3 + 3 e + e (I1 - 3)) with e = J^(-2/3) - 1 = expm1(x); the terms of first
   order of I1 - 3 and 3 x cancel in (j - ln J) - minors. */
SB_KERNEL static void energy_isochoric(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       SbPack psi)
{
  const PetscReal mu = m->rest->mu;
  const PetscReal K = bulk_modulus(m);

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], rest;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    const PetscReal x = -2. / 3. * v.log;
    const PetscReal e = expm1(x);
    const PetscReal growth = 2 * (v.j - v.minors) + v.square;
    const PetscReal shape = 2 * ((v.j - v.log) - v.minors) + v.square + 3 * (e - x) + e * growth;
    const PetscReal value = mu / 2 * shape + K / 2 * v.j * v.j * SbSimoTaylorSquare(&v, &rest);

    psi[l] = v.J > 0 ? value : INFINITY;
  }
}

/* a, q and I1 of a lane; no numbers for J <= 0. */
SB_INLINE void coefficients(const struct _p_SbMaterial *m, const PetscReal f[9], PetscReal *a,
                            PetscReal *q, PetscReal *I1, PetscReal *J)
{
  const SbVolume v = SbVolumeOf(f);

  *J = v.J;
  *I1 = SbDot9(f, f);
  *a = v.J > 0 ? m->rest->mu * exp(-2. / 3. * v.log) : NAN;
  *q = bulk_modulus(m) / 2 * v.j * (2 + v.j) - *a * *I1 / 3;
}

SB_KERNEL static void stress_isochoric(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       SbPack P[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9], a, q, I1, J;

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    coefficients(m, f, &a, &q, &I1, &J);
    for (int k = 0; k < 9; k++)
      P[k][l] = a * f[k] + q / J * c[k];
  }
}

SB_KERNEL static void tangent_isochoric(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack C[restrict 81])
{
  SbPack of_I, of_FD, of_DD, q;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], I1, J;

    SbPackGet(9, F, l, f);
    coefficients(m, f, &of_I[l], &q[l], &I1, &J);
    of_FD[l] = -2. / 3. * of_I[l];
    of_DD[l] = 2. / 9. * of_I[l] * I1 + bulk_modulus(m) * J * J;
  }
  SbInvariantTangent(m, F, of_I, of_FD, of_DD, q, C);
}

SB_KERNEL static void dilatation_isochoric(const struct _p_SbMaterial *m,
                                           const SbPack F[restrict 9], SbPack theta)
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], t, u;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    theta[l] = SbSimoTaylor(&v, &t, &u);
  }
}

/* t D */
SB_KERNEL static void dilatation_gradient_isochoric(const struct _p_SbMaterial *m,
                                                    const SbPack F[restrict 9],
                                                    SbPack D[restrict 9])
{
  (void)m;
  SbInverseTransposed(F, D);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], t, u;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    (void)SbSimoTaylor(&v, &t, &u);
    for (int k = 0; k < 9; k++)
      D[k][l] *= t;
  }
}

/* d^2 theta/dF_(ij)(kl) = u D_ij D_kl - t D_il D_kj */
SB_KERNEL static void dilatation_hessian_isochoric(const struct _p_SbMaterial *m,
                                                   const SbPack F[restrict 9], const SbPack p,
                                                   SbPack C[restrict 81])
{
  SbPack of_DD, q, H[81];

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], t, u;

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    (void)SbSimoTaylor(&v, &t, &u);
    of_DD[l] = p[l] * u;
    q[l] = p[l] * t;
  }
  SbInvariantTangent(m, F, NULL, NULL, of_DD, q, H);
  for (int k = 0; k < 81; k++)
    for (int l = 0; l < SB_BATCH; l++)
      C[k][l] += H[k][l];
}

static const SbOption rows[] = {SB_MATERIAL_TANGENT_ROW};

const SbMaterialType SbMaterialIsochoricNeoHookean = {
  .name = "isochoric_neohookean",
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .share = 2. / 3.,
  .ops = {.energy = energy_isochoric,
          .stress = stress_isochoric,
          .tangent = tangent_isochoric,
          .dilatation = dilatation_isochoric,
          .dilatation_gradient = dilatation_gradient_isochoric,
          .dilatation_hessian = dilatation_hessian_isochoric},
};
