// @ranks 1
/* Second derivatives by pairs of surface vertices, distributed to nodes: equal to S^T H S of dense
   matrices, each entry once, none at prescribed components. */
#include "../../src/contact/pairs.h"
#include "pair_reference.h"

#define NV 7 /* vertices, the last one with its nodes on other ranks alone */
#define NN 9 /* vertices; the nodes of the last one are only on other ranks */
#define OWN 6
#define EACH 3   /* nodes of a vertex */
#define NPAIR 40 /* number of blocks; some are for the same two vertices, in either order */

int main(int argc, char **argv)
{
  struct _p_SbSpace space = {.nnode_owned = OWN, .nnode = NN, .Nnode = NN};
  struct _p_SbContactSurface m = {.space = &space, .nbody_vertex = NV, .nvertex = NV};
  PetscInt start[NV + 1], node[NV * EACH];
  PetscInt count[OWN][NN] = {{0}};
  PetscReal weight[NV * EACH];
  uint8_t fixed[NV * EACH];
  uint8_t mine[NV] = {0};
  uint8_t prescribed[NN] = {0, 7, 0, 5, 0, 0, 2, 0, 7};
  static PetscReal H[3 * NV][3 * NV], S[3 * NV][3 * NN], wanted[3 * NN][3 * NN],
    got[3 * OWN][3 * NN];
  SbContactBlocks blocks = {0};
  SbBlocks spread = {0};

  SB_TEST_BEGIN(argc, argv);

  /* vertices with nodes in common; node numbers are global ones, too */
  for (PetscInt v = 0; v <= NV; v++)
    start[v] = EACH * v;
  for (PetscInt j = 0; j < NV * EACH; j++) {
    const PetscInt v = j / EACH;

    node[j] = v == NV - 1 ? OWN + j % EACH : (v + 2 * (j % EACH)) % NN;
    weight[j] = pair_random();
    fixed[j] = prescribed[node[j]];
    mine[v] = (uint8_t)(mine[v] || node[j] < OWN);
    for (int k = 0; k < 3; k++)
      S[3 * v + k][3 * node[j] + k] = prescribed[node[j]] >> k & 1 ? 0. : weight[j];
  }
  m.start = start;
  m.node = m.gnode = node;
  m.weight = weight;
  m.fixed = fixed;
  m.mine = mine;

  /* two rounds, so that data kept from one round to the next are tested */
  for (int round = 0; round < 2; round++) {
    PetscCall(PetscArrayzero(&H[0][0], 9 * NV * NV));
    for (int k = 0; k < NPAIR; k++) {
      const PetscInt v = (5 * k + round) % NV;
      const PetscInt w = (k * k + 3) % NV;
      PetscReal block[12];

      for (int e = 0; e < 12; e++)
        block[e] = pair_random();
      for (int e = 0; e < 9 && v == w; e++)
        block[4 * (e / 3) + e % 3] = block[4 * (e % 3) + e / 3];
      PetscCall(SbContactBlocksAdd(&blocks, v, w, block, 4));
      for (int e = 0; e < 9; e++) {
        H[3 * v + e / 3][3 * w + e % 3] += block[4 * (e / 3) + e % 3];
        if (v != w)
          H[3 * w + e % 3][3 * v + e / 3] += block[4 * (e / 3) + e % 3];
      }
    }
    SB_CHECK(blocks.n <= NV * (NV + 1) / 2, "%d pairs of %d vertices", (int)blocks.n, NV);
    spread.n = 0;
    PetscCall(SbContactBlocksToNodes(&m, &blocks, &spread));
  }

  /* against dense matrices */
  for (int i = 0; i < 3 * NN; i++) {
    for (int j = 0; j < 3 * NN; j++) {
      wanted[i][j] = 0.;
      for (int p = 0; p < 3 * NV; p++)
        for (int q = 0; q < 3 * NV; q++)
          wanted[i][j] += S[p][i] * H[p][q] * S[q][j];
    }
  }
  for (PetscInt k = 0; k < spread.n; k++) {
    const PetscInt i = spread.block[k].v[0];
    const PetscInt j = spread.block[k].v[1];

    SB_CHECK(i < OWN && prescribed[i] != 7 && prescribed[j] != 7, "a block of nodes %d and %d",
             (int)i, (int)j);
    count[i][j]++;
    for (int e = 0; e < 9; e++)
      got[3 * i + e / 3][3 * j + e % 3] = spread.block[k].H[e];
  }
  for (int i = 0; i < OWN; i++)
    for (int j = 0; j < NN; j++)
      SB_CHECK(count[i][j] <= 1, "%d blocks of nodes %d and %d", (int)count[i][j], i, j);
  for (int i = 0; i < 3 * OWN; i++) {
    for (int j = 0; j < 3 * NN; j++)
      SB_CHECK(PetscAbsReal(got[i][j] - wanted[i][j]) < 1e-12, "unknowns %d and %d: %g, not %g", i,
               j, got[i][j], wanted[i][j]);
  }
  PetscCall(PetscFree(spread.block));
  PetscCall(PetscFree(blocks.block));
  PetscCall(PetscFree(blocks.slot));
  SB_TEST_END();
}
