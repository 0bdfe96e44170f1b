/*
  Cell kernels: tets with four nodes and constant basis gradients, vectorised over the lanes.

  F = I + sum_a u_a g_a^T and f_a = V P g_a. With Hooke's tensor rotated by R, C_(ij)(kl) = R_ip
  R_kq (lambda d_pj d_ql + mu d_pq d_jl + mu d_pl d_jq), contracting with g_a,j and g_b,l, and h = R
  g, the block is

    K_ab = V (lambda h_a h_b^T + mu h_b h_a^T + mu (h_a . h_b) I),

  which needs no triple product. The derivative of the rotation, dP = R [W y]x, y = axial(R^T dF -
  dF^T R), adds V [h_a]x R W R^T [h_b]x^T; as [a]x [b]x^T = (a . b) I - b a^T, W = -mu I turns 2 mu
  dF into Hooke's mu.

  g_0 = -(g_1 + g_2 + g_3): only nodes 1..3 are computed, and since K_ba = K_ab^T only six blocks of
  them; the blocks of node 0 are minus sums. So a translation of the cell gives zero force, up to
  rounding.
*/
#include <sbelement.h>

/* F = one I + (u_1 - u_0) g_1^T + (u_2 - u_0) g_2^T + (u_3 - u_0) g_3^T */
SB_KERNEL void SbCellGradient(const SbPack g[restrict 9], const SbPack u[restrict 12],
                              PetscReal one, SbPack F[restrict 9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    for (int i = 0; i < 3; i++) {
      const PetscReal d1 = u[3 + i][l] - u[i][l];
      const PetscReal d2 = u[6 + i][l] - u[i][l];
      const PetscReal d3 = u[9 + i][l] - u[i][l];

      for (int j = 0; j < 3; j++)
        F[3 * i + j][l] = d1 * g[j][l] + d2 * g[3 + j][l] + d3 * g[6 + j][l] + (i == j ? one : 0.);
    }
  }
}

SB_KERNEL void SbCellForce(const SbPack g[restrict 9], const PetscReal V[restrict SB_BATCH],
                           const SbPack P[restrict 9], SbPack f[restrict 12])
{
  for (int l = 0; l < SB_BATCH; l++) {
    for (int i = 0; i < 3; i++) {
      const PetscReal p0 = V[l] * P[3 * i][l];
      const PetscReal p1 = V[l] * P[3 * i + 1][l];
      const PetscReal p2 = V[l] * P[3 * i + 2][l];
      PetscReal t[3];

      for (int a = 0; a < 3; a++)
        t[a] = p0 * g[3 * a][l] + p1 * g[3 * a + 1][l] + p2 * g[3 * a + 2][l];
      f[i][l] = -(t[0] + t[1] + t[2]);
      for (int a = 0; a < 3; a++)
        f[3 + 3 * a + i][l] = t[a];
    }
  }
}

/* Block of two rotated gradients, lv = lambda V, mv = mu V, as a diagonal one (bitwise
   symmetric). */
SB_INLINE void diagonal_block(PetscReal lv, PetscReal mv, const PetscReal h[3], PetscReal K[9])
{
  const PetscReal d = mv * SbDot3(h, h);
  const PetscReal c = lv + mv;
  const PetscReal h0 = c * h[0];
  const PetscReal h1 = c * h[1];

  K[0] = h0 * h[0] + d;
  K[1] = K[3] = h0 * h[1];
  K[2] = K[6] = h0 * h[2];
  K[4] = h1 * h[1] + d;
  K[5] = K[7] = h1 * h[2];
  K[8] = c * h[2] * h[2] + d;
}

SB_INLINE void coupling_block(PetscReal lv, PetscReal mv, const PetscReal ha[3],
                              const PetscReal hb[3], PetscReal K[9])
{
  const PetscReal d = mv * SbDot3(ha, hb);

  for (int i = 0; i < 3; i++) {
    const PetscReal x = lv * ha[i];
    const PetscReal y = mv * hb[i];

    for (int k = 0; k < 3; k++)
      K[3 * i + k] = x * hb[k] + y * ha[k] + (i == k ? d : 0);
  }
}

/* Blocks of lane l from those of nodes 1..3, B = 11 12 13 22 23 33: these, and those of node 0. */
SB_INLINE void put_blocks(const PetscReal B[6][9], int l, SbPack K[10][9])
{
  PetscReal K01[9], K02[9], K03[9];

  SbPackPut(9, B[0], l, K[4]);
  SbPackPut(9, B[1], l, K[5]);
  SbPackPut(9, B[2], l, K[6]);
  SbPackPut(9, B[3], l, K[7]);
  SbPackPut(9, B[4], l, K[8]);
  SbPackPut(9, B[5], l, K[9]);
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) {
      const int ik = 3 * i + k;
      const int ki = 3 * k + i;

      K01[ik] = -(B[0][ik] + B[1][ki] + B[2][ki]);
      K02[ik] = -(B[1][ik] + B[3][ik] + B[4][ki]);
      K03[ik] = -(B[2][ik] + B[4][ik] + B[5][ik]);
    }
  }
  SbPackPut(9, K01, l, K[1]);
  SbPackPut(9, K02, l, K[2]);
  SbPackPut(9, K03, l, K[3]);
  for (int i = 0; i < 3; i++) {
    for (int k = 0; k < 3; k++) {
      const int upper = i < k ? 3 * i + k : 3 * k + i;

      K[0][3 * i + k][l] = -(K01[upper] + K02[upper] + K03[upper]);
    }
  }
}

SB_KERNEL void SbCellBlocksIsotropic(const SbPack g[restrict 9],
                                     const PetscReal V[restrict SB_BATCH], PetscReal lambda,
                                     PetscReal mu, const SbPack R[restrict 9],
                                     SbPack K[restrict 10][9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal lv = lambda * V[l];
    const PetscReal mv = mu * V[l];
    PetscReal r[9], e[9], h[9], B[6][9];

    SbPackGet(9, R, l, r);
    SbPackGet(9, g, l, e);
    SbMatMulTranspose(e, r, h); /* row a = R g_a */
    diagonal_block(lv, mv, h, B[0]);
    coupling_block(lv, mv, h, h + 3, B[1]);
    coupling_block(lv, mv, h, h + 6, B[2]);
    diagonal_block(lv, mv, h + 3, B[3]);
    coupling_block(lv, mv, h + 3, h + 6, B[4]);
    diagonal_block(lv, mv, h + 6, B[5]);
    put_blocks((const PetscReal(*)[9])B, l, K);
  }
}

/* Rows t_i = h x (columns of W), the matrix [h]x W. */
SB_INLINE void cross_columns(const PetscReal h[3], const PetscReal W[9], PetscReal T[9])
{
  for (int n = 0; n < 3; n++) {
    T[n] = h[1] * W[6 + n] - h[2] * W[3 + n];
    T[3 + n] = h[2] * W[n] - h[0] * W[6 + n];
    T[6 + n] = h[0] * W[3 + n] - h[1] * W[n];
  }
}

/* K = 2 mu (ha . hb) I + lambda ha hb^T + T [hb]x^T with T = [ha]x W; lv = lambda V, mv = mu V, T
   times V. */
SB_INLINE void spin_block(PetscReal lv, PetscReal mv, const PetscReal ha[3], const PetscReal T[9],
                          const PetscReal hb[3], PetscReal K[9])
{
  const PetscReal d = 2 * mv * SbDot3(ha, hb);

  for (int i = 0; i < 3; i++) {
    const PetscReal x = lv * ha[i];
    const PetscReal *t = T + 3 * i;

    K[3 * i] = x * hb[0] + (hb[1] * t[2] - hb[2] * t[1]);
    K[3 * i + 1] = x * hb[1] + (hb[2] * t[0] - hb[0] * t[2]);
    K[3 * i + 2] = x * hb[2] + (hb[0] * t[1] - hb[1] * t[0]);
    K[3 * i + i] += d;
  }
}

SB_INLINE void copy_upper(PetscReal K[9])
{
  K[3] = K[1];
  K[6] = K[2];
  K[7] = K[5];
}

SB_KERNEL void SbCellBlocksCorotated(const SbPack g[restrict 9],
                                     const PetscReal V[restrict SB_BATCH], PetscReal lambda,
                                     PetscReal mu, const SbPack R[restrict 9],
                                     const SbPack W[restrict 9], SbPack K[restrict 10][9])
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal lv = lambda * V[l];
    const PetscReal mv = mu * V[l];
    PetscReal r[9], e[9], h[9], w[9], x[9], T1[9], T2[9], T3[9], B[6][9];

    SbPackGet(9, R, l, r);
    SbPackGet(9, g, l, e);
    SbPackGet(9, W, l, w);
    for (int k = 0; k < 9; k++)
      w[k] *= V[l];
    SbMatMulTranspose(e, r, h); /* row a = R g_a */
    SbMatMul(r, w, x);
    SbMatMulTranspose(x, r, w);
    cross_columns(h, w, T1);
    cross_columns(h + 3, w, T2);
    cross_columns(h + 6, w, T3);
    spin_block(lv, mv, h, T1, h, B[0]);
    spin_block(lv, mv, h, T1, h + 3, B[1]);
    spin_block(lv, mv, h, T1, h + 6, B[2]);
    spin_block(lv, mv, h + 3, T2, h + 3, B[3]);
    spin_block(lv, mv, h + 3, T2, h + 6, B[4]);
    spin_block(lv, mv, h + 6, T3, h + 6, B[5]);
    copy_upper(B[0]);
    copy_upper(B[3]);
    copy_upper(B[5]);
    put_blocks((const PetscReal(*)[9])B, l, K);
  }
}

/* For each pair (i, k) of components the slice M_jl = C_(ij)(kl) gives G M G^T with the gradients
   as rows of G: its entry (a, b) is K_ab,ik, and since C_(kj)(il) = M_lj also K_ba,ki. Six slices
   suffice. */
SB_KERNEL void SbCellBlocksGeneral(const SbPack g[restrict 9], const PetscReal V[restrict SB_BATCH],
                                   const SbPack C[restrict 81], SbPack K[restrict 10][9])
{
  static const int pair[3][3] = {{4, 5, 6}, {5, 7, 8}, {6, 8, 9}};

  for (int i = 0; i < 3; i++) {
    for (int k = i; k < 3; k++) {
      SbPack B[9];

      for (int l = 0; l < SB_BATCH; l++) {
        PetscReal G[9], M[9], T[9], b[9];

        for (int j = 0; j < 3; j++)
          for (int n = 0; n < 3; n++)
            M[3 * j + n] = C[9 * (3 * i + j) + 3 * k + n][l];
        SbPackGet(9, g, l, G);
        SbMatMulTranspose(M, G, T);
        SbMatMul(G, T, b);
        for (int m = 0; m < 9; m++)
          B[m][l] = V[l] * b[m];
      }
      for (int a = 0; a < 3; a++) {
        for (int b = a; b < 3; b++) {
          for (int l = 0; l < SB_BATCH; l++) {
            K[pair[a][b]][3 * i + k][l] = B[3 * a + b][l];
            K[pair[a][b]][3 * k + i][l] = B[3 * b + a][l];
          }
        }
      }
    }
  }
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal B[6][9];

    for (int p = 0; p < 6; p++)
      SbPackGet(9, (const SbPack *)K[4 + p], l, B[p]);
    put_blocks((const PetscReal(*)[9])B, l, K);
  }
}
