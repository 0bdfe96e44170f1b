/*
  P2 tetrahedron: nodes at vertices and edges, quadratic basis. With the barycentric coordinates l_i

    phi_i = l_i (2 l_i - 1) at vertex i,   phi_ij = 4 l_i l_j at the middle of edge ij,
    grad phi_i = (4 l_i - 1) grad l_i,     grad phi_ij = 4 (l_j grad l_i + l_i grad l_j).

  So at a point the gradient is that of a P1 tet with the vertex displacements u_i' = (4 l_i - 1)
  u_i + sum_j 4 l_j u_ij, and the results of P1's kernels are mapped back by the transpose: this
  file has both maps.

  Stresses are evaluated at the four points of the rule of degree 2 (Keast 1986), each with a
  quarter of the volume. Cubic functions, as det F of a linear F, by the rule of degree 3 with five.

  Tets with curved edges are P1 tets with other corners at each point of SbRuleQuintic
  (quadratic_map.c).

  Mass / (density V): the consistent one is the integral of phi_a phi_b; lumped (Hinton, Rock and
  Zienkiewicz 1976) is its diagonal, scaled to the mass of the tet: row sums at vertices would be
  negative, -1/20.
*/
#include <sbelement.h>

#define NEAR 0.58541019662496845 /* (5 + 3 sqrt 5) / 20 */
#define FAR 0.13819660112501052  /* (5 - sqrt 5) / 20 */

const SbPointRule SbRuleQuadratic = {
  4,
  {{NEAR, FAR, FAR, FAR}, {FAR, NEAR, FAR, FAR}, {FAR, FAR, NEAR, FAR}, {FAR, FAR, FAR, NEAR}},
  {0.25, 0.25, 0.25, 0.25}};
const SbPointRule SbRuleCubic = {5,
                                 {{0.25, 0.25, 0.25, 0.25},
                                  {1. / 2, 1. / 6, 1. / 6, 1. / 6},
                                  {1. / 6, 1. / 2, 1. / 6, 1. / 6},
                                  {1. / 6, 1. / 6, 1. / 2, 1. / 6},
                                  {1. / 6, 1. / 6, 1. / 6, 1. / 2}},
                                 {-0.8, 0.45, 0.45, 0.45, 0.45}};

SB_KERNEL void SbQuadraticAt(const PetscReal L[4], const SbPack U[restrict 30],
                             SbPack u[restrict 12])
{
  for (int k = 0; k < 12; k++)
    for (int l = 0; l < SB_BATCH; l++)
      u[k][l] = (4 * L[k / 3] - 1) * U[k][l];
  for (int e = 0; e < 6; e++) {
    const int i = SbTetEdge[e][0];
    const int j = SbTetEdge[e][1];

    for (int k = 0; k < 3; k++) {
      for (int l = 0; l < SB_BATCH; l++) {
        const PetscReal four = 4 * U[12 + 3 * e + k][l];

        u[3 * i + k][l] += L[j] * four;
        u[3 * j + k][l] += L[i] * four;
      }
    }
  }
}

SB_KERNEL void SbQuadraticAdd(const PetscReal L[4], const SbPack f[restrict 12],
                              SbPack F[restrict 30])
{
  for (int k = 0; k < 12; k++)
    for (int l = 0; l < SB_BATCH; l++)
      F[k][l] += (4 * L[k / 3] - 1) * f[k][l];
  for (int e = 0; e < 6; e++) {
    const int i = SbTetEdge[e][0];
    const int j = SbTetEdge[e][1];

    for (int k = 0; k < 3; k++)
      for (int l = 0; l < SB_BATCH; l++)
        F[12 + 3 * e + k][l] += 4 * (L[j] * f[3 * i + k][l] + L[i] * f[3 * j + k][l]);
  }
}

/* Vertices on which gradient a depends, with their factors at L: one for a vertex, two for an
   edge. */
SB_INLINE int gradient_of(int a, const PetscReal L[4], int vertex[2], PetscReal factor[2])
{
  if (a < 4) {
    vertex[0] = a;
    factor[0] = 4 * L[a] - 1;
    return 1;
  }
  for (int k = 0; k < 2; k++) {
    vertex[k] = SbTetEdge[a - 4][k];
    factor[k] = 4 * L[SbTetEdge[a - 4][1 - k]];
  }
  return 2;
}

SB_KERNEL void SbQuadraticBlocks(const SbPointRule *rule, const SbPack B[restrict][10][9],
                                 const SbPack factor, const SbPack b[restrict 30],
                                 SbPack K[restrict SB_PAIRS][9])
{
  static const int pair[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}};
  SbPack scaled[30];

  for (int k = 0; k < 30; k++)
    for (int l = 0; l < SB_BATCH; l++)
      scaled[k][l] = factor[l] * b[k][l];

  for (int p = 0; p < SB_PAIRS; p++) {
    PetscReal weight[4 * SB_POINTS];
    const SbPack *block[4 * SB_POINTS];
    int turned[4 * SB_POINTS];
    int n = 0;

    // sum over the points of the P1 blocks that contribute
    for (int q = 0; q < rule->n; q++) {
      PetscReal fa[2], fb[2];
      int va[2], vb[2];
      const int na = gradient_of(SbPairA[p], rule->L[q], va, fa);
      const int nb = gradient_of(SbPairB[p], rule->L[q], vb, fb);

      for (int k = 0; k < na * nb; k++, n++) {
        const int i = va[k / nb];
        const int j = vb[k % nb];

        weight[n] = fa[k / nb] * fb[k % nb];
        block[n] = B[q][pair[i][j]];
        turned[n] = i > j;
      }
    }
    for (int e = 0; e < 9; e++) {
      const int other = 3 * (e % 3) + e / 3;
      const PetscReal *x = scaled[3 * SbPairA[p] + e / 3];
      const PetscReal *y = b[3 * SbPairB[p] + e % 3];
      SbPack sum;

      for (int l = 0; l < SB_BATCH; l++)
        sum[l] = x[l] * y[l];
      for (int k = 0; k < n; k++) {
        const PetscReal *from = block[k][turned[k] ? other : e];

        for (int l = 0; l < SB_BATCH; l++)
          sum[l] += weight[k] * from[l];
      }
      for (int l = 0; l < SB_BATCH; l++)
        K[p][e][l] = sum[l];
    }
  }
}

/* With gradients g of barycentric coordinates the second derivative of det F along u at a, v at b
   is (u x v) . F (g_a x g_b). */
SB_KERNEL void SbQuadraticAddJacobian(const PetscReal L[4], const SbPack g[restrict 9],
                                      const SbPack F[restrict 9],
                                      const PetscReal weight[restrict SB_BATCH],
                                      SbPack K[restrict SB_PAIRS][9])
{
  SbPack x[4][4][3];

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal h[4][3], f[9], c[3];

    SbPackGet(9, F, l, f);
    for (int k = 0; k < 3; k++) {
      for (int a = 1; a < 4; a++)
        h[a][k] = g[3 * (a - 1) + k][l];
      h[0][k] = -(h[1][k] + h[2][k] + h[3][k]);
    }
    for (int i = 0; i < 4; i++) {
      for (int j = 0; j < 4; j++) {
        SbCross(h[i], h[j], c);
        for (int k = 0; k < 3; k++)
          x[i][j][k][l] = weight[l] * SbDot3(f + 3 * k, c);
      }
    }
  }
  for (int p = 0; p < SB_PAIRS; p++) {
    PetscReal fa[2], fb[2];
    int va[2], vb[2];
    const int na = gradient_of(SbPairA[p], L, va, fa);
    const int nb = gradient_of(SbPairB[p], L, vb, fb);

    if (SbPairA[p] == SbPairB[p])
      continue;
    for (int k = 0; k < na * nb; k++) {
      const PetscReal w = fa[k / nb] * fb[k % nb];
      const SbPack *c = x[va[k / nb]][vb[k % nb]];

      for (int l = 0; l < SB_BATCH; l++) {
        K[p][1][l] += w * c[2][l];
        K[p][3][l] -= w * c[2][l];
        K[p][2][l] -= w * c[1][l];
        K[p][6][l] += w * c[1][l];
        K[p][5][l] += w * c[0][l];
        K[p][7][l] -= w * c[0][l];
      }
    }
  }
}

PetscReal SbQuadraticMass(int a, int b)
{
  const int low = PetscMin(a, b);
  const int high = PetscMax(a, b);

  if (high < 4)
    return a == b ? 1. / 70 : 1. / 420;
  const int *e = SbTetEdge[high - 4];
  if (low < 4)
    return low == e[0] || low == e[1] ? -1. / 105 : -1. / 70;
  const int *d = SbTetEdge[low - 4];
  const int shared = (d[0] == e[0]) + (d[0] == e[1]) + (d[1] == e[0]) + (d[1] == e[1]);
  if (shared == 2)
    return 8. / 105;
  return shared ? 4. / 105 : 2. / 105;
}
