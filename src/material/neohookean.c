/*
  Classical compressible neo-Hookean material (Simo and Pister 1984; Bonet and Wood, "Nonlinear
  continuum mechanics for finite element analysis", 2008, section 6.4.3), as FEBio, dolfinx and
  others have it under this name. With I1 = |F|^2, J = det F, theta = ln J and D = d theta/dF =
  F^-T:

    psi = mu/2 (I1 - 3) - mu theta + lambda/2 theta^2
    P   = mu F + q D,   q = lambda theta - mu
    dP/dF_(ij)(kl) = mu identity - q D_il D_kj + lambda D_ij D_kl.

  psi grows without bound as J falls to zero, for lambda >= 0, and is infinite for J <= 0, where
  stress and tangent are no numbers: Newton's steps end before (src/fem/admissible.c). lambda/2
  theta^2 is not convex beyond J = e: the stress of a uniaxial strain falls beyond a stretch of e
  (lambda >> mu).

  Laws that other programs give this name: Abaqus and SOFA split psi into a part of the shape,
  J^(-2/3) I1, and one of the volume; all agree at small strains, and for nu near 1/2.
*/
#include "invariants.h"

/* With j = J - 1 = tr H + minors, minors the rest of the expansion of det(I + H): mu tr H - mu
   theta = mu (j - theta) - mu minors has no terms of first order left. */
SB_KERNEL static void energy_neohookean(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack psi)
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9];

    SbPackGet(9, F, l, f);
    const SbVolume v = SbVolumeOf(f);
    const PetscReal value =
      mu * (v.square / 2 - v.minors + (v.j - v.log)) + lambda / 2 * v.log * v.log;

    psi[l] = v.J > 0 ? value : INFINITY;
  }
}

SB_KERNEL static void stress_neohookean(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack P[restrict 9])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    const SbVolume v = SbVolumeOf(f);
    const PetscReal q = v.J > 0 ? (lambda * v.log - mu) / v.J : NAN;
    for (int k = 0; k < 9; k++)
      P[k][l] = mu * f[k] + q * c[k];
  }
}

SB_KERNEL static void tangent_neohookean(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                         SbPack C[restrict 81])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack of_I, of_DD, q;

  SbLogVolume(m, F, q);
  for (int l = 0; l < SB_BATCH; l++) {
    of_I[l] = mu;
    of_DD[l] = lambda;
    q[l] = lambda * q[l] - mu;
  }
  SbInvariantTangent(m, F, of_I, NULL, of_DD, q, C);
}

/* With lambda < 0 the energy would fall without bound as J falls to zero. */
static PetscErrorCode set_up_neohookean(SbMaterial m, const SbScope *scope)
{
  PetscFunctionBeginUser;
  PetscCheck(m->rest->nu >= 0, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-%s_%s_poisson %g with the law neohookean: its energy has no least value for a "
             "negative Poisson's ratio; take one in [0, 0.5), or the law stable_neohookean",
             scope->klass, scope->instance[0] ? scope->instance : "<name>", (double)m->rest->nu);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbOption rows[] = {SB_MATERIAL_TANGENT_ROW};

const SbMaterialType SbMaterialNeoHookean = {
  .name = "neohookean",
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .positive = PETSC_TRUE,
  .ops = {.setfromoptions = set_up_neohookean,
          .energy = energy_neohookean,
          .stress = stress_neohookean,
          .tangent = tangent_neohookean,
          .dilatation = SbLogVolume,
          .dilatation_gradient = SbLogVolumeGradient,
          .dilatation_hessian = SbLogVolumeHessian},
};
