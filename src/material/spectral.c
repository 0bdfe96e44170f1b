/*
  Eigenvalues on lanes: symmetric 3x3 matrices, signed stretches of F, and tangents without their negative part.

  SbSymEig: cyclic Jacobi without branches. A rotation by t = tan(angle), t = h / (d +- sqrt(d^2 + h^2)) with
  d = A_qq - A_pp and h = 2 A_pq, the smaller root, zeroes A_pq. Convergence is quadratic, in the end cubic for 3x3: five
  sweeps of three rotations bring every matrix to rounding.

  SbSpectralTangent: the tangent of an isotropic energy is diagonal in known matrices (Smith, de Goes, Kim, "Analytic
  eigensystems for isotropic distortion energies", 2019, sections 4 and 5). With F = U diag(s) V^T, columns u_i and v_i:
  three twists (u_i v_j^T - u_j v_i^T) / sqrt(2), three flips (u_i v_j^T + u_j v_i^T) / sqrt(2), and three stretches
  sum_i q_i u_i v_i^T with the eigenvectors q of the Hessian of psi(s). C is the sum of the outer products of these
  matrices, each scaled by the root of its eigenvalue or zero: positive semi-definite by construction.
*/
#include "material_impl.h"

#define SWEEPS 5

/* Rotation of axes p and q, r the third: diagonal entries, A_pq, A_rp, A_rq, columns p and q of V. */
SB_INLINE void rotate(PetscReal *pp, PetscReal *qq, PetscReal *pq, PetscReal *rp, PetscReal *rq,
                      PetscReal Vp[3], PetscReal Vq[3])
{
  const PetscReal d = *qq - *pp, h = 2 * *pq, r = fabs(d) + sqrt(d * d + h * h) + 1e-300;
  const PetscReal t = (d < 0 ? -h : h) / r, c = 1 / sqrt(1 + t * t), s = t * c, arp = *rp, arq = *rq;

  *pp -= t * *pq;
  *qq += t * *pq;
  *pq = 0;
  *rp = c * arp - s * arq;
  *rq = s * arp + c * arq;
  for (int k = 0; k < 3; k++) {
    const PetscReal vp = Vp[k], vq = Vq[k];

    Vp[k] = c * vp - s * vq;
    Vq[k] = s * vp + c * vq;
  }
}

SB_KERNEL void SbSymEig(const SbLane S[restrict 6], SbLane s[restrict 3], SbLane V[restrict 9])
{
  SbLane A[6], T[9]; /* T: eigenvectors as rows */

  for (int l = 0; l < SB_BATCH; l++) {
    for (int k = 0; k < 6; k++) A[k][l] = S[k][l];
    for (int k = 0; k < 9; k++) T[k][l] = k % 4 == 0;
  }
  for (int sweep = 0; sweep < SWEEPS; sweep++) {
    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal a[6], t[9];

      SbLaneGet(6, A, l, a);
      SbLaneGet(9, T, l, t);
      rotate(&a[0], &a[3], &a[1], &a[2], &a[4], t, t + 3);
      rotate(&a[0], &a[5], &a[2], &a[1], &a[4], t, t + 6);
      rotate(&a[3], &a[5], &a[4], &a[1], &a[2], t + 3, t + 6);
      SbLanePut(6, a, l, A);
      SbLanePut(9, t, l, T);
    }
  }
  for (int l = 0; l < SB_BATCH; l++) {
    s[0][l] = A[0][l];
    s[1][l] = A[3][l];
    s[2][l] = A[5][l];
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) V[3 * i + j][l] = T[3 * j + i][l];
    }
  }
}

SB_KERNEL void SbStretches(const SbLane F[restrict 9], SbLane U[restrict 9], SbLane s[restrict 3],
                           SbLane V[restrict 9])
{
  SbLane R[9], S[6];

  SbPolar(F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], r[9], a[9];

    SbLaneGet(9, F, l, f);
    SbLaneGet(9, R, l, r);
    SbMatTransposeMul(r, f, a);
    S[0][l] = a[0];
    S[1][l] = (a[1] + a[3]) / 2;
    S[2][l] = (a[2] + a[6]) / 2;
    S[3][l] = a[4];
    S[4][l] = (a[5] + a[7]) / 2;
    S[5][l] = a[8];
  }
  SbSymEig((const SbLane *)S, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9], v[9], u[9];

    SbLaneGet(9, R, l, r);
    SbLaneGet(9, V, l, v);
    SbMatMul(r, v, u);
    SbLanePut(9, u, l, U);
  }
}

/* E[m] = root of eigenvalue m times its matrix, for the twist and the flip of the axes i and j. */
SB_KERNEL static void shear_modes(const SbLane U[restrict 9], const SbLane V[restrict 9], int i, int j,
                                  const SbLane flip, const SbLane twist, SbLane Eflip[restrict 9],
                                  SbLane Etwist[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal f = sqrt(flip[l] > 0 ? flip[l] / 2 : 0), t = sqrt(twist[l] > 0 ? twist[l] / 2 : 0);

    for (int p = 0; p < 3; p++) {
      for (int q = 0; q < 3; q++) {
        const PetscReal ij = U[3 * p + i][l] * V[3 * q + j][l], ji = U[3 * p + j][l] * V[3 * q + i][l];

        Eflip[3 * p + q][l] = f * (ij + ji);
        Etwist[3 * p + q][l] = t * (ij - ji);
      }
    }
  }
}

/* The same for the stretch with eigenvalue m and eigenvector Q[.][k] of the Hessian. */
SB_KERNEL static void stretch_mode(const SbLane U[restrict 9], const SbLane V[restrict 9], const SbLane m,
                                   const SbLane Q[restrict 9], int k, SbLane E[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal root = sqrt(m[l] > 0 ? m[l] : 0), q0 = root * Q[k][l], q1 = root * Q[3 + k][l],
                    q2 = root * Q[6 + k][l];

    for (int p = 0; p < 3; p++) {
      for (int q = 0; q < 3; q++) {
        E[3 * p + q][l] = q0 * U[3 * p][l] * V[3 * q][l] + q1 * U[3 * p + 1][l] * V[3 * q + 1][l] +
                          q2 * U[3 * p + 2][l] * V[3 * q + 2][l];
      }
    }
  }
}

SB_KERNEL void SbSpectralTangent(const SbLane U[restrict 9], const SbLane V[restrict 9],
                                 const SbLane hessian[restrict 6], const SbLane flip[restrict 3],
                                 const SbLane twist[restrict 3], SbLane C[restrict 81])
{
  SbLane m[3], Q[9], E[9][9];

  for (int k = 0; k < 3; k++) shear_modes(U, V, (k + 1) % 3, (k + 2) % 3, flip[k], twist[k], E[k], E[3 + k]);
  SbSymEig(hessian, m, Q);
  for (int k = 0; k < 3; k++) stretch_mode(U, V, m[k], (const SbLane *)Q, k, E[6 + k]);
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      SbLane c;

      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = E[0][ij][l] * E[0][kl][l];

        for (int k = 1; k < 9; k++) sum += E[k][ij][l] * E[k][kl][l];
        c[l] = sum;
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}
