/*
  Classical compressible neo-Hookean material (Simo and Pister 1984; Bonet and Wood, "Nonlinear
  continuum mechanics for finite element analysis", 2008, section 6.4.3), as FEBio, dolfinx and
  others have it under this name. With I1 = |F|^2, J = det F, theta = ln J and D = d theta/dF =
  F^-T:

    psi = mu/2 (I1 - 3) - mu theta + lambda/2 theta^2
    P   = mu F + q D,   q = lambda theta - mu
    dP/dF_(ij)(kl) = mu identity - q D_il D_kj + lambda D_ij D_kl.

  psi grows without bound as J falls to zero, for lambda >= 0, and is infinite for J <= 0, where
  stress and tangent are no numbers: Newton's steps end before (src/fem/admissible.c). In stretches:
  flips mu - q / (s_i s_j), twists mu + q / (s_i s_j). lambda/2 theta^2 is not convex beyond J = e:
  the stress of a uniaxial strain falls beyond a stretch of e (lambda >> mu).

  Laws that other programs give this name: Abaqus and SOFA split psi into a part of the shape,
  J^(-2/3) I1, and one of the volume; all agree at small strains, and for nu near 1/2.
*/
#include "material_impl.h"

/* J, theta and D of a lane; theta is -inf where J <= 0. From H = F - I at small strains, where the
   rounding of det F would be that of theta. */
SB_INLINE PetscReal log_det(const PetscReal f[9], PetscReal c[9], PetscReal *theta)
{
  const PetscReal h[9] = {f[0] - 1, f[1], f[2], f[3], f[4] - 1, f[5], f[6], f[7], f[8] - 1};
  PetscReal m[9];

  SbMatCofactor(h, m);
  SbMatCofactor(f, c);
  const PetscReal J = SbDot3(f, c);
  const PetscReal j = h[0] + h[4] + h[8] + m[0] + m[4] + m[8] + SbDot3(h, m);
  *theta = J > 0.5 ? log1p(j) : J > 0 ? log(J) : -INFINITY;
  return J;
}

/* With j = J - 1 = tr H + minors, minors the rest of the expansion of det(I + H): mu tr H - mu
   theta = mu (j - theta) - mu minors has no terms of first order left. */
SB_KERNEL static void energy_neohookean(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack psi)
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9], h[9], theta;

    SbPackGet(9, F, l, f);
    const PetscReal J = log_det(f, c, &theta);
    memcpy(h, f, sizeof(h));
    h[0] -= 1;
    h[4] -= 1;
    h[8] -= 1;
    SbMatCofactor(h, c);
    const PetscReal minors = c[0] + c[4] + c[8] + SbDot3(h, c);
    const PetscReal j = h[0] + h[4] + h[8] + minors;
    const PetscReal value =
      mu * (SbDot9(h, h) / 2 - minors + (j - theta)) + lambda / 2 * theta * theta;

    psi[l] = J > 0 ? value : INFINITY;
  }
}

SB_KERNEL static void stress_neohookean(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack P[restrict 9])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9], theta;

    SbPackGet(9, F, l, f);
    const PetscReal J = log_det(f, c, &theta);
    const PetscReal q = J > 0 ? (lambda * theta - mu) / J : NAN;
    for (int k = 0; k < 9; k++)
      P[k][l] = mu * f[k] + q * c[k];
  }
}

SB_KERNEL static void dilatation_neohookean(const struct _p_SbMaterial *m,
                                            const SbPack F[restrict 9], SbPack theta)
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9], value;

    SbPackGet(9, F, l, f);
    (void)log_det(f, c, &value);
    theta[l] = value;
  }
}

/* D = cof F / J */
SB_KERNEL static void dilatation_gradient_neohookean(const struct _p_SbMaterial *m,
                                                     const SbPack F[restrict 9],
                                                     SbPack D[restrict 9])
{
  (void)m;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], c[9];

    SbPackGet(9, F, l, f);
    SbMatCofactor(f, c);
    const PetscReal J = SbDot3(f, c);
    for (int k = 0; k < 9; k++)
      D[k][l] = J > 0 ? c[k] / J : NAN;
  }
}

/* The tangent mu identity - q D_il D_kj + lambda D_ij D_kl, its negative eigenvalues raised to
   zero. */
SB_KERNEL static void projected(PetscReal mu, PetscReal lambda, const SbPack q,
                                const SbPack F[restrict 9], SbPack C[restrict 81])
{
  SbPack U[9], V[9], s[3], hessian[6], flip[3], twist[3];

  SbStretches(F, U, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal r[3] = {1 / s[0][l], 1 / s[1][l], 1 / s[2][l]};

    hessian[0][l] = mu + (lambda - q[l]) * r[0] * r[0];
    hessian[1][l] = lambda * r[0] * r[1];
    hessian[2][l] = lambda * r[0] * r[2];
    hessian[3][l] = mu + (lambda - q[l]) * r[1] * r[1];
    hessian[4][l] = lambda * r[1] * r[2];
    hessian[5][l] = mu + (lambda - q[l]) * r[2] * r[2];
    for (int k = 0; k < 3; k++) {
      const PetscReal pair = q[l] * r[(k + 1) % 3] * r[(k + 2) % 3];

      flip[k][l] = mu - pair;
      twist[k][l] = mu + pair;
    }
  }
  SbSpectralTangent(U, V, hessian, flip, twist, C);
}

/* C = mu identity - q D_il D_kj + lambda D_ij D_kl */
SB_KERNEL static void exact(PetscReal mu, PetscReal lambda, const SbPack q,
                            const SbPack D[restrict 9], SbPack C[restrict 81])
{
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int il = 3 * (ij / 3) + kl % 3;
      const int kj = 3 * (kl / 3) + ij % 3;
      const PetscReal same = ij == kl ? mu : 0;
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++)
        c[l] = same - q[l] * D[il][l] * D[kj][l] + lambda * D[ij][l] * D[kl][l];
      SbTangentPut(c, ij, kl, C);
    }
  }
}

SB_KERNEL static void tangent_neohookean(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                         SbPack C[restrict 81])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack D[9], q;

  dilatation_neohookean(m, F, q);
  for (int l = 0; l < SB_BATCH; l++)
    q[l] = lambda * q[l] - mu;
  if (m->tangent == SB_TANGENT_EXACT_SPD) {
    projected(mu, lambda, q, F, C);
    return;
  }
  dilatation_gradient_neohookean(m, F, D);
  exact(mu, lambda, q, (const SbPack *)D, C);
}

/* d^2 theta/dF_(ij)(kl) = -D_il D_kj; twists have the eigenvalues 1 / (s_i s_j), flips -1 / (s_i
   s_j), stretches -1 / s_i^2. */
SB_KERNEL static void dilatation_hessian_neohookean(const struct _p_SbMaterial *m,
                                                    const SbPack F[restrict 9], const SbPack p,
                                                    SbPack C[restrict 81])
{
  SbPack D[9], H[81];

  if (m->tangent == SB_TANGENT_EXACT_SPD)
    projected(0, 0, p, F, H);
  else {
    dilatation_gradient_neohookean(m, F, D);
    exact(0, 0, p, (const SbPack *)D, H);
  }
  for (int k = 0; k < 81; k++)
    for (int l = 0; l < SB_BATCH; l++)
      C[k][l] += H[k][l];
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
          .dilatation = dilatation_neohookean,
          .dilatation_gradient = dilatation_gradient_neohookean,
          .dilatation_hessian = dilatation_hessian_neohookean},
};
