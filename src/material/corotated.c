/*
  Co-rotated: F = R S with the rotation R of SbPolar(), psi = mu |F - R|^2 + lambda/2 (R : F - 3)^2.

  P = 2 mu (F - R) + lambda tr(S - I) R is its gradient: R is stationary for R : F, so dR drops out
  of dpsi.

  Tangents. With q = tr(S), kappa = lambda (q - 3) - 2 mu,
    dP = 2 mu dF + lambda (R : dF) R + kappa dR,   dR = R [w]x,   (q I - S) w = axial(R^T dF - dF^T
    R),
  which follows from R^T F staying symmetric. This is `exact`. The eigenvalues of dP/dF are 2 mu, 2
  mu + 3 lambda and, for the twist about the principal axis k, 2 mu + 2 kappa / (q - s_k) with q -
  s_k = s_i + s_j >= 0 (Smith, de Goes, Kim, "Analytic eigensystems for isotropic distortion
  energies", 2019, section 4.1): only the twists can be negative, and `exact_spd` raises those to
  zero by limiting kappa / (s_i + s_j) to -mu. `warped` leaves out kappa dR, and takes the symmetric
  part of the identity in this frame: Hooke's tensor.

  Where s_i + s_j = 0 the rotation and the force are discontinuous: `exact` bounds the determinant
  of (q I - S) from below, `exact_spd` each s_i + s_j.
*/
#include "material_impl.h"

#define SMALLEST_DET 1e-9 /* least determinant of q I - S, which is 8 at rest */
#define SMALLEST_SUM 1e-2 /* least sum of two stretches, 2 at rest */

SB_KERNEL static void energy_corotated(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       SbPack psi)
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack R[9];

  SbPolar(F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], r[9];

    SbPackGet(9, F, l, f);
    SbPackGet(9, R, l, r);
    const PetscReal tr = SbDot9(r, f) - 3;
    for (int k = 0; k < 9; k++)
      f[k] -= r[k];
    psi[l] = mu * SbDot9(f, f) + lambda / 2 * tr * tr;
  }
}

SB_KERNEL static void stress_corotated(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                       SbPack P[restrict 9])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack R[9];

  SbPolar(F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], r[9];

    SbPackGet(9, F, l, f);
    SbPackGet(9, R, l, r);
    const PetscReal p = lambda * (SbDot9(r, f) - 3);
    for (int k = 0; k < 9; k++)
      P[k][l] = 2 * mu * (f[k] - r[k]) + p * r[k];
  }
}

/* theta = tr(S - I) = R : F - 3 */
SB_KERNEL static void dilatation_corotated(const struct _p_SbMaterial *m,
                                           const SbPack F[restrict 9], SbPack theta)
{
  SbPack R[9];

  (void)m;
  SbPolar(F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], r[9];

    SbPackGet(9, F, l, f);
    SbPackGet(9, R, l, r);
    theta[l] = SbDot9(r, f) - 3;
  }
}

static void frame_corotated(const struct _p_SbMaterial *m, const SbPack F[9], SbPack R[9])
{
  (void)m;
  SbPolar(F, R);
}

/* W = kappa (q I - S)^-1 */
SB_KERNEL static void twist_exact(const SbPack S[restrict 6], const SbPack kappa,
                                  SbPack W[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal a = S[3][l] + S[5][l];
    const PetscReal b = S[0][l] + S[5][l];
    const PetscReal c = S[0][l] + S[3][l];
    const PetscReal d = -S[1][l];
    const PetscReal e = -S[2][l];
    const PetscReal f = -S[4][l];
    const PetscReal A0 = b * c - f * f;
    const PetscReal A1 = e * f - d * c;
    const PetscReal A2 = d * f - e * b;
    const PetscReal det = a * A0 + d * A1 + e * A2;
    const PetscReal w = kappa[l] / (det > SMALLEST_DET ? det : SMALLEST_DET);

    W[0][l] = w * A0;
    W[1][l] = W[3][l] = w * A1;
    W[2][l] = W[6][l] = w * A2;
    W[4][l] = w * (a * c - e * e);
    W[5][l] = W[7][l] = w * (d * e - a * f);
    W[8][l] = w * (a * b - d * d);
  }
}

/* The same with kappa / (s_i + s_j) limited to -mu, by the eigenvectors of S. */
SB_KERNEL static void twist_spd(PetscReal mu, const SbPack S[restrict 6], const SbPack kappa,
                                SbPack W[restrict 9])
{
  SbPack s[3], V[9];

  SbSymEig(S, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal q = s[0][l] + s[1][l] + s[2][l];
    PetscReal v[9], w[3];

    SbPackGet(9, V, l, v);
    for (int k = 0; k < 3; k++) {
      const PetscReal sum = q - s[k][l] > SMALLEST_SUM ? q - s[k][l] : SMALLEST_SUM;
      const PetscReal limit = -mu * sum;

      w[k] = (kappa[l] > limit ? kappa[l] : limit) / sum;
    }
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) {
        W[3 * i + j][l] = w[0] * v[3 * i] * v[3 * j] + w[1] * v[3 * i + 1] * v[3 * j + 1] +
                          w[2] * v[3 * i + 2] * v[3 * j + 2];
      }
    }
  }
}

SB_KERNEL static void spin_corotated(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                     const SbPack p, SbPack R[restrict 9], SbPack W[restrict 9])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack S[6], kappa;

  SbPolar(F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9];

    SbStretchTensor(F, R, l, r, S);
    kappa[l] = lambda * (S[0][l] + S[3][l] + S[5][l] - 3) - 2 * mu;
  }
  for (int l = 0; p && l < SB_BATCH; l++)
    kappa[l] += p[l];
  if (m->tangent == SB_TANGENT_EXACT_SPD)
    twist_spd(mu, S, kappa, W);
  else
    twist_exact(S, kappa, W);
}

/* C = 2 mu identity + lambda R R + Z W Z^T with the columns R [e_n]x of Z: in row (i, j) only
   columns j+1 and j+2 (cyclic) are nonzero, -R_i,j+2 and R_i,j+1. */
SB_KERNEL static void tangent_corotated(const struct _p_SbMaterial *m, const SbPack F[restrict 9],
                                        SbPack C[restrict 81])
{
  const PetscReal mu = m->rest->mu;
  const PetscReal lambda = m->rest->lambda;
  SbPack R[9], W[9], ZW[27];

  spin_corotated(m, F, NULL, R, W);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9], w[9];

    SbPackGet(9, R, l, r);
    SbPackGet(9, W, l, w);
    for (int ij = 0; ij < 9; ij++) {
      const int i = ij / 3;
      const int j1 = (ij + 1) % 3;
      const int j2 = (ij + 2) % 3;

      for (int n = 0; n < 3; n++)
        ZW[3 * ij + n][l] = r[3 * i + j1] * w[3 * j2 + n] - r[3 * i + j2] * w[3 * j1 + n];
    }
  }
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      const int l1 = (kl + 1) % 3;
      const int l2 = (kl + 2) % 3;
      const int k = 3 * (kl / 3);
      const PetscReal identity = ij == kl ? 2 * mu : 0;
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        c[l] = identity + lambda * R[ij][l] * R[kl][l] + ZW[3 * ij + l2][l] * R[k + l1][l] -
               ZW[3 * ij + l1][l] * R[k + l2][l];
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

static const SbOption rows[] = {
  {"tangent", SB_OPTION_CHOICE, 1, "", "auto", "auto|warped|exact|exact_spd",
   "tangent stiffness: warped, Hooke's tensor rotated with the cell (stiffness warping, positive "
   "definite); "
   "exact; exact_spd, exact with each cell projected to positive semi-definite"},
};

const SbMaterialType SbMaterialCorotated = {
  .name = "corotated",
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.energy = energy_corotated,
          .stress = stress_corotated,
          .tangent = tangent_corotated,
          .spin = spin_corotated,
          .dilatation = dilatation_corotated,
          .dilatation_gradient = frame_corotated},
};
