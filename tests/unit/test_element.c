// @ranks 1 3
/* Elements by name, and P1: gradients and volume of any tet, mass. */
#include "../test.h"
#include <sbelement.h>

static void test_tabulate(SbElement e, PetscRandom random)
{
  for (int t = 0; t < 1000; t++) {
    const PetscReal size = pow(10, t % 7 - 3);
    PetscReal x[4][3], g[4][3], V, c[4], sum = 0;

    for (int a = 0; a < 4; a++) {
      for (int i = 0; i < 3; i++) {
        (void)PetscRandomGetValueReal(random, &x[a][i]);
        x[a][i] = size * (0.3 * x[a][i] + (a == i + 1));
      }
    }
    for (int k = 0; k < 4; k++) (void)PetscRandomGetValueReal(random, &c[k]);
    e->ops.tabulate((const PetscReal(*)[3])x, &g[1], &V);
    /* phi_a is 1 at its node and 0 at the others: any linear function is reproduced */
    for (int j = 0; j < 3; j++) {
      g[0][j] = -(g[1][j] + g[2][j] + g[3][j]);
      sum = 0;
      for (int a = 0; a < 4; a++) sum += (c[0] + c[1] * x[a][0] + c[2] * x[a][1] + c[3] * x[a][2]) * g[a][j];
      SB_CHECK_NEAR(sum, c[1 + j], 1e-12 * (1 + 1 / size), "gradient of a linear function");
    }
    PetscReal edge[9], n[3];
    for (int k = 0; k < 9; k++) edge[k] = x[1 + k / 3][k % 3] - x[0][k % 3];
    SbCross(edge + 3, edge + 6, n);
    SB_CHECK_NEAR(V, SbDot3(edge, n) / 6, 1e-13 * size * size * size, "volume");
    SB_CHECK(V > 0, "the tet is inside out");
  }
}

/* The unit tet, and the same with two nodes exchanged: V changes its sign, gradients go with their nodes. */
static void test_orientation(SbElement e)
{
  const PetscReal x[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                  y[4][3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  PetscReal g[3][3], h[3][3], V;

  e->ops.tabulate(x, g, &V);
  SB_CHECK_NEAR(V, 1. / 6, 1e-16, "volume of the unit tet");
  for (int a = 0; a < 3; a++) {
    for (int i = 0; i < 3; i++) SB_CHECK_NEAR(g[a][i], a == i, 0, "gradient in the unit tet");
  }
  e->ops.tabulate(y, h, &V);
  SB_CHECK_NEAR(V, -1. / 6, 1e-16, "volume inside out");
  for (int i = 0; i < 3; i++) {
    SB_CHECK_NEAR(h[0][i], g[1][i], 0, "gradient inside out");
    SB_CHECK_NEAR(h[1][i], g[0][i], 0, "gradient inside out");
  }
}

int main(int argc, char **argv)
{
  SbElement e;
  PetscRandom random;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbElementRegisterAll());
  SB_CHECK_ERROR(SbElementCreate("p2", NULL, &e), "unknown element");
  PetscCall(SbElementCreate("p1", NULL, &e));
  SB_CHECK(e->nodes_per[0] == 1 && !e->nodes_per[1] && !e->nodes_per[2] && !e->nodes_per[3], "nodes of p1");
  SB_CHECK_NEAR(4 * e->ops.mass_lumped, 1, 1e-15, "lumped mass");
  SB_CHECK_NEAR(4 * e->ops.mass_diagonal + 12 * e->ops.mass_coupling, 1, 1e-15, "consistent mass");
  SB_CHECK_NEAR(e->ops.mass_diagonal, 2 * e->ops.mass_coupling, 1e-16, "mass of linear functions");
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 99));
  PetscCall(PetscRandomSeed(random));
  test_tabulate(e, random);
  test_orientation(e);
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(SbElementDestroy(&e));
  SB_CHECK(!e, "destroy leaves a pointer");
  PetscCall(SbElementDestroy(&e));
  SB_TEST_END();
}
