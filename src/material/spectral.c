/*
  Vectorised eigenvalues: symmetric 3x3 matrices, stretches of F, tangents without negative ones.

  SbSymEig: in closed form except for three Newton steps, without iterated rotations (similar to
  Eberly, "A robust eigensolver for 3x3 symmetric matrices", 2014). With m = tr(S)/3, A = (S - m
  I)/p and 6 p^2 = |S - m I|^2 the eigenvalues of A are the roots of y^3 - 3 y = det A. The one with
  the sign of det A has |y| in [sqrt(3), 2] and lies at least sqrt(3) from the others: Newton's
  method converges quadratically from the start, and the largest column of adj(A - y I) is the
  eigenvector without loss of accuracy. A 2x2 problem in the plane normal to it remains: one
  rotation.

  SbSpectralTangent: the tangent of an isotropic energy has known eigenmatrices (Smith, de Goes,
  Kim, "Analytic eigensystems for isotropic distortion energies", 2019, sections 4 and 5). With F =
  U diag(s) V^T, columns u_i and v_i: three twists (u_i v_j^T - u_j v_i^T) / sqrt(2), three flips
  (u_i v_j^T + u_j v_i^T) / sqrt(2), and three stretches sum_i q_i u_i v_i^T with the eigenvectors q
  of the Hessian of psi(s). C is the sum of the outer products of these matrices, times the root of
  its eigenvalue or zero.
*/
#include "material_impl.h"

/* Unit eigenvector of A = 00 01 02 11 12 22 for the isolated eigenvalue y: largest column of adj(A
   - y I). */
SB_INLINE void isolated_vector(const PetscReal A[6], PetscReal y, PetscReal v[3])
{
  const PetscReal a = A[0] - y;
  const PetscReal b = A[3] - y;
  const PetscReal c = A[5] - y;
  const PetscReal d = A[1];
  const PetscReal e = A[2];
  const PetscReal f = A[4];
  const PetscReal aa = b * c - f * f;
  const PetscReal bb = a * c - e * e;
  const PetscReal cc = a * b - d * d;
  const PetscReal ab = e * f - d * c;
  const PetscReal ac = d * f - e * b;
  const PetscReal bc = d * e - a * f;
  const PetscReal first = bb > aa ? bb : aa;

  v[0] = cc > first ? ac : bb > aa ? ab : aa;
  v[1] = cc > first ? bc : bb > aa ? bb : ab;
  v[2] = cc > first ? cc : bb > aa ? bc : ac;
  const PetscReal n = 1 / sqrt(SbDot3(v, v));
  for (int k = 0; k < 3; k++)
    v[k] *= n;
}

/* Unit vectors u, w with (u, w, v) right-handed (Duff and others, "Building an orthonormal basis",
   2017). */
SB_INLINE void plane_of(const PetscReal v[3], PetscReal u[3], PetscReal w[3])
{
  const PetscReal sign = v[2] < 0 ? -1 : 1;
  const PetscReal a = -1 / (sign + v[2]);
  const PetscReal b = v[0] * v[1] * a;

  u[0] = 1 + sign * v[0] * v[0] * a;
  u[1] = sign * b;
  u[2] = -sign * v[0];
  w[0] = b;
  w[1] = sign + v[1] * v[1] * a;
  w[2] = -v[1];
}

SB_INLINE void sym_mul(const PetscReal A[6], const PetscReal u[3], PetscReal Au[3])
{
  Au[0] = A[0] * u[0] + A[1] * u[1] + A[2] * u[2];
  Au[1] = A[1] * u[0] + A[3] * u[1] + A[4] * u[2];
  Au[2] = A[2] * u[0] + A[4] * u[1] + A[5] * u[2];
}

SB_INLINE void sym_eig(const PetscReal S[6], PetscReal s[3], PetscReal V[9])
{
  const PetscReal mean = (S[0] + S[3] + S[5]) / 3;
  PetscReal A[6] = {S[0] - mean, S[1], S[2], S[3] - mean, S[4], S[5] - mean};
  PetscReal v[3], u[3], w[3], Au[3], Aw[3];

  /* deviator of unit size; zero if S is a multiple of I, when any basis is correct */
  const PetscReal diagonal = A[0] * A[0] + A[3] * A[3] + A[5] * A[5];
  const PetscReal rest = A[1] * A[1] + A[2] * A[2] + A[4] * A[4];
  const PetscReal p = sqrt(diagonal / 6 + rest / 3);
  const PetscReal inverse = 1 / (p + 1e-300);
  for (int k = 0; k < 6; k++)
    A[k] *= inverse;
  const PetscReal det = A[0] * (A[3] * A[5] - A[4] * A[4]) - A[1] * (A[1] * A[5] - A[4] * A[2]) +
                        A[2] * (A[1] * A[4] - A[3] * A[2]);

  /* root >= sqrt(3) with root^3 - 3 root = 2 t, t in [0, 1]: a parabola (error 0.003), Newton
     steps */
  const PetscReal t = fabs(det) < 2 ? fabs(det) / 2 : 1;
  PetscReal root = 1.7320508 + t * (0.3333333 - 0.0653841 * t);
  for (int step = 0; step < 3; step++)
    root = 2 * (root * root * root + t) / (3 * (root * root - 1));
  const PetscReal y = det < 0 ? -root : root;
  isolated_vector(A, y, v);

  /* the 2x2 problem in the plane: a rotation by the smaller angle of tan = +-h / (|d| + sqrt(d^2 +
     h^2)) */
  plane_of(v, u, w);
  sym_mul(A, u, Au);
  sym_mul(A, w, Aw);
  const PetscReal uu = SbDot3(u, Au);
  const PetscReal ww = SbDot3(w, Aw);
  const PetscReal d = ww - uu;
  const PetscReal h = 2 * SbDot3(u, Aw);
  const PetscReal x = fabs(d) + sqrt(d * d + h * h) + 1e-150;
  const PetscReal n = 1 / sqrt(x * x + h * h);
  const PetscReal cosine = x * n;
  const PetscReal sine = (d < 0 ? -h : h) * n;
  const PetscReal shift = cosine * sine * h;
  for (int k = 0; k < 3; k++) {
    V[3 * k] = cosine * u[k] - sine * w[k];
    V[3 * k + 1] = sine * u[k] + cosine * w[k];
    V[3 * k + 2] = v[k];
  }
  s[0] = mean + p * (cosine * cosine * uu + sine * sine * ww - shift);
  s[1] = mean + p * (sine * sine * uu + cosine * cosine * ww + shift);
  s[2] = mean + p * y;
}

SB_KERNEL void SbSymEig(const SbPack S[restrict 6], SbPack s[restrict 3], SbPack V[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal a[6], e[3], v[9];

    SbPackGet(6, S, l, a);
    sym_eig(a, e, v);
    SbPackPut(3, e, l, s);
    SbPackPut(9, v, l, V);
  }
}

SB_KERNEL void SbStretches(const SbPack F[restrict 9], SbPack U[restrict 9], SbPack s[restrict 3],
                           SbPack V[restrict 9])
{
  SbPack R[9], S[6];

  SbPolar(F, R);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9];

    SbStretchTensor(F, R, l, r, S);
  }
  SbSymEig(S, s, V);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal r[9], v[9], u[9];

    SbPackGet(9, R, l, r);
    SbPackGet(9, V, l, v);
    SbMatMul(r, v, u);
    SbPackPut(9, u, l, U);
  }
}

/* E[m] = root of eigenvalue m times its eigenmatrix, for the twist and the flip of the axes i and
   j. */
SB_KERNEL static void shear_modes(const SbPack U[restrict 9], const SbPack V[restrict 9], int i,
                                  int j, const SbPack flip, const SbPack twist,
                                  SbPack Eflip[restrict 9], SbPack Etwist[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal f = sqrt(flip[l] > 0 ? flip[l] / 2 : 0);
    const PetscReal t = sqrt(twist[l] > 0 ? twist[l] / 2 : 0);

    for (int p = 0; p < 3; p++) {
      for (int q = 0; q < 3; q++) {
        const PetscReal ij = U[3 * p + i][l] * V[3 * q + j][l];
        const PetscReal ji = U[3 * p + j][l] * V[3 * q + i][l];

        Eflip[3 * p + q][l] = f * (ij + ji);
        Etwist[3 * p + q][l] = t * (ij - ji);
      }
    }
  }
}

/* The same for the stretch with eigenvalue m and eigenvector Q[.][k] of the Hessian. */
SB_KERNEL static void stretch_mode(const SbPack U[restrict 9], const SbPack V[restrict 9],
                                   const SbPack m, const SbPack Q[restrict 9], int k,
                                   SbPack E[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal root = sqrt(m[l] > 0 ? m[l] : 0);
    const PetscReal q0 = root * Q[k][l];
    const PetscReal q1 = root * Q[3 + k][l];
    const PetscReal q2 = root * Q[6 + k][l];

    for (int p = 0; p < 3; p++) {
      for (int q = 0; q < 3; q++) {
        E[3 * p + q][l] = q0 * U[3 * p][l] * V[3 * q][l] + q1 * U[3 * p + 1][l] * V[3 * q + 1][l] +
                          q2 * U[3 * p + 2][l] * V[3 * q + 2][l];
      }
    }
  }
}

SB_KERNEL void SbSpectralTangent(const SbPack U[restrict 9], const SbPack V[restrict 9],
                                 const SbPack hessian[restrict 6], const SbPack flip[restrict 3],
                                 const SbPack twist[restrict 3], SbPack C[restrict 81])
{
  SbPack m[3], Q[9], E[9][9];

  for (int k = 0; k < 3; k++)
    shear_modes(U, V, (k + 1) % 3, (k + 2) % 3, flip[k], twist[k], E[k], E[3 + k]);
  SbSymEig(hessian, m, Q);
  for (int k = 0; k < 3; k++)
    stretch_mode(U, V, m[k], Q, k, E[6 + k]);
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = E[0][ij][l] * E[0][kl][l];

        for (int k = 1; k < 9; k++)
          sum += E[k][ij][l] * E[k][kl][l];
        c[l] = sum;
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}

/* The parts of the axes i and j: with A = u_i v_j^T and B = u_j v_i^T the flip and the twist are
   f/2 (A + B)(A + B) + t/2 (A - B)(A - B), that is A (p A + m B) + B (m A + p B) with p and m = (f
   +- t) / 2. */
SB_KERNEL static void shear_pair(const SbPack U[restrict 9], const SbPack V[restrict 9], int i,
                                 int j, const SbPack flip, const SbPack twist, SbPack A[restrict 9],
                                 SbPack B[restrict 9], SbPack YA[restrict 9], SbPack YB[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal plus = (flip[l] + twist[l]) / 2;
    const PetscReal minus = (flip[l] - twist[l]) / 2;

    for (int p = 0; p < 3; p++) {
      for (int q = 0; q < 3; q++) {
        const PetscReal ij = U[3 * p + i][l] * V[3 * q + j][l];
        const PetscReal ji = U[3 * p + j][l] * V[3 * q + i][l];

        A[3 * p + q][l] = ij;
        B[3 * p + q][l] = ji;
        YA[3 * p + q][l] = plus * ij + minus * ji;
        YB[3 * p + q][l] = minus * ij + plus * ji;
      }
    }
  }
}

/* The parts of the stretches: E_k = u_k v_k^T, Y_k = sum_n W_kn E_n. */
SB_KERNEL static void stretch_parts(const SbPack U[restrict 9], const SbPack V[restrict 9],
                                    const SbPack W[restrict 6], SbPack E[restrict 3][9],
                                    SbPack Y[restrict 3][9])
{
  static const int at[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

  for (int l = 0; l < SB_BATCH; l++) {
    for (int pq = 0; pq < 9; pq++) {
      PetscReal e[3];

      for (int k = 0; k < 3; k++)
        E[k][pq][l] = e[k] = U[3 * (pq / 3) + k][l] * V[3 * (pq % 3) + k][l];
      for (int k = 0; k < 3; k++)
        Y[k][pq][l] = W[at[k][0]][l] * e[0] + W[at[k][1]][l] * e[1] + W[at[k][2]][l] * e[2];
    }
  }
}

SB_KERNEL void SbSpectralTangentExact(const SbPack U[restrict 9], const SbPack V[restrict 9],
                                      const SbPack hessian[restrict 6],
                                      const SbPack flip[restrict 3], const SbPack twist[restrict 3],
                                      SbPack C[restrict 81])
{
  SbPack E[9][9], Y[9][9];

  stretch_parts(U, V, hessian, E, Y);
  for (int k = 0; k < 3; k++)
    shear_pair(U, V, (k + 1) % 3, (k + 2) % 3, flip[k], twist[k], E[3 + k], E[6 + k], Y[3 + k],
               Y[6 + k]);
  for (int ij = 0; ij < 9; ij++) {
    for (int kl = ij; kl < 9; kl++) {
      SbPack c;

      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal sum = E[0][ij][l] * Y[0][kl][l];

        for (int k = 1; k < 9; k++)
          sum += E[k][ij][l] * Y[k][kl][l];
        c[l] = sum;
      }
      SbTangentPut(c, ij, kl, C);
    }
  }
}
