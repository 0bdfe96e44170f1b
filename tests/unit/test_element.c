// @ranks 1 3
/* Elements by name: gradients, values at vertices, volume and mass of any tet, each against the
   definition of the basis. */
#include "../test.h"
#include <sbelement.h>

/* phi_a is 1 at its node and 0 at the others: any linear function is reproduced, its gradient and
   its values at vertices. */
static void check_linear(SbElement e, const PetscReal x[4][3], const PetscReal g[4][3],
                         const PetscReal c[4], PetscReal size)
{
  PetscReal value[4];

  for (int a = 0; a < 4; a++) {
    PetscReal node[3]; /* of P1: a vertex; of CR and DG: the centroid of the face opposite to it */

    for (int i = 0; i < 3; i++)
      node[i] = e->nodes_per[0] ? x[a][i] : (x[0][i] + x[1][i] + x[2][i] + x[3][i] - x[a][i]) / 3;
    value[a] = c[0] + SbDot3(c + 1, node);
  }
  for (int j = 0; j < 3; j++) {
    PetscReal sum = 0;

    for (int a = 0; a < 4; a++)
      sum += value[a] * g[a][j];
    SB_CHECK_NEAR(sum, c[1 + j], 1e-12 * (1 + 1 / size), "gradient of a linear function");
  }
  for (int v = 0; v < 4; v++) {
    PetscReal sum = 0;
    PetscReal one = 0;

    for (int a = 0; a < 4; a++) {
      sum += value[a] * e->ops.vertex[v][a];
      one += e->ops.vertex[v][a];
    }
    SB_CHECK_NEAR(sum, c[0] + SbDot3(c + 1, x[v]), 1e-14 * (1 + size),
                  "linear function at a vertex");
    SB_CHECK_NEAR(one, 1, 1e-15, "sum of the basis at a vertex");
  }
}

static void test_tabulate(SbElement e, PetscRandom random)
{
  for (int t = 0; t < 1000; t++) {
    const PetscReal size = pow(10, t % 7 - 3);
    PetscReal x[4][3], g[4][3], V, c[4], edge[9], n[3];

    for (int a = 0; a < 4; a++) {
      for (int i = 0; i < 3; i++) {
        (void)PetscRandomGetValueReal(random, &x[a][i]);
        x[a][i] = size * (0.3 * x[a][i] + (a == i + 1));
      }
    }
    for (int k = 0; k < 4; k++)
      (void)PetscRandomGetValueReal(random, &c[k]);
    e->ops.tabulate((const PetscReal(*)[3])x, &g[1], &V);
    for (int j = 0; j < 3; j++)
      g[0][j] = -(g[1][j] + g[2][j] + g[3][j]);
    check_linear(e, (const PetscReal(*)[3])x, (const PetscReal(*)[3])g, c, size);
    for (int k = 0; k < 9; k++)
      edge[k] = x[1 + k / 3][k % 3] - x[0][k % 3];
    SbCross(edge + 3, edge + 6, n);
    SB_CHECK_NEAR(V, SbDot3(edge, n) / 6, 1e-13 * size * size * size, "volume");
    SB_CHECK(V > 0, "the tet is inverted");
  }
}

/* The unit tet, and the same with two nodes exchanged: V changes its sign, gradients go with their
   nodes. */
static void test_orientation(SbElement e)
{
  const PetscReal x[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const PetscReal y[4][3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
  const PetscReal factor = e->nodes_per[0] ? 1 : -3;
  PetscReal g[3][3], h[3][3], V;

  e->ops.tabulate(x, g, &V);
  SB_CHECK_NEAR(V, 1. / 6, 1e-16, "volume of the unit tet");
  for (int a = 0; a < 3; a++)
    for (int i = 0; i < 3; i++)
      SB_CHECK_NEAR(g[a][i], factor * (a == i), 0, "gradient in the unit tet");
  e->ops.tabulate(y, h, &V);
  SB_CHECK_NEAR(V, -1. / 6, 1e-16, "volume inverted");
  for (int i = 0; i < 3; i++) {
    SB_CHECK_NEAR(h[0][i], g[1][i], 0, "gradient inverted");
    SB_CHECK_NEAR(h[1][i], g[0][i], 0, "gradient inverted");
  }
}

/* Integrals of phi_a and phi_a phi_b over a tet of volume 1, by the rule of four points that is
   exact for squares. */
static void test_mass(SbElement e)
{
  const PetscReal far = (5 - PetscSqrtReal(5)) / 20;
  const PetscReal near = 1 - 3 * far;
  PetscReal first[4] = {0};
  PetscReal second[4][4] = {{0}};

  for (int point = 0; point < 4; point++) {
    PetscReal phi[4] = {0};

    for (int a = 0; a < 4; a++)
      for (int v = 0; v < 4; v++)
        phi[a] += (v == point ? near : far) * e->ops.vertex[v][a];
    for (int a = 0; a < 4; a++) {
      first[a] += phi[a] / 4;
      for (int b = 0; b < 4; b++)
        second[a][b] += phi[a] * phi[b] / 4;
    }
  }
  for (int a = 0; a < 4; a++) {
    SB_CHECK_NEAR(e->ops.mass_lumped, first[a], 1e-15, "lumped mass");
    for (int b = 0; b < 4; b++) {
      SB_CHECK_NEAR(a == b ? e->ops.mass_diagonal : e->ops.mass_coupling, second[a][b], 1e-15,
                    "consistent mass");
    }
  }
  SB_CHECK_NEAR(4 * e->ops.mass_lumped, 1, 1e-15, "lumped mass of a cell");
  SB_CHECK_NEAR(4 * e->ops.mass_diagonal + 12 * e->ops.mass_coupling, 1, 1e-15,
                "consistent mass of a cell");
}

static PetscErrorCode test_one(const char *name, const PetscInt per[4], PetscRandom random)
{
  SbElement e;

  PetscFunctionBeginUser;
  PetscCall(SbElementCreate(name, NULL, &e));
  for (int d = 0; d < 4; d++)
    SB_CHECK(e->nodes_per[d] == per[d], "%s: nodes per entity %d", name, d);
  SB_CHECK((e->gamma0 > 0) == (per[3] > 0) && (e->gamma1 > 0) == !per[0],
           "%s: gamma0 %g, gamma1 %g", name, e->gamma0, e->gamma1);
  test_tabulate(e, random);
  test_orientation(e);
  test_mass(e);
  PetscCall(SbElementDestroy(&e));
  SB_CHECK(!e, "destroy leaves a pointer");
  PetscCall(SbElementDestroy(&e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gamma0 and gamma1 of a body, and that what makes the form indefinite is refused. */
static PetscErrorCode test_options(void)
{
  static const char *const refused[] = {"-body_a_gamma1 0", "-body_a_gamma1 -1", "-body_a_gamma0 0",
                                        "-body_a_gamma0 -4"};
  SbScope body;
  SbElement e;

  PetscFunctionBeginUser;
  SbScopeSet(&body, "body", "", "a");
  PetscCall(PetscOptionsInsertString(NULL, "-body_a_gamma0 7 -body_a_gamma1 0.25"));
  PetscCall(SbElementCreate("dg", &body, &e));
  SB_CHECK(e->gamma0 == 7 && e->gamma1 == 0.25, "gamma0 %g and gamma1 %g were read", e->gamma0,
           e->gamma1);
  PetscCall(SbElementDestroy(&e));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(refused); k++) {
    PetscCall(PetscOptionsClear(NULL));
    PetscCall(PetscOptionsInsertString(NULL, refused[k]));
    SB_CHECK_ERROR(SbElementCreate("dg", &body, &e), PETSC_ERR_USER, refused[k]);
    PetscCall(SbElementDestroy(&e));
  }
  PetscCall(PetscOptionsClear(NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static SbElementType light;
  SbElement e;
  PetscRandom random;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbElementRegisterAll());
  SB_CHECK_ERROR(SbElementCreate("p4", NULL, &e), PETSC_ERR_USER, "\"p4\"");
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 99));
  PetscCall(PetscRandomSeed(random));
  PetscCall(test_one("p1", (const PetscInt[]){1, 0, 0, 0}, random));
  PetscCall(test_one("cr", (const PetscInt[]){0, 0, 1, 0}, random));
  PetscCall(test_one("dg", (const PetscInt[]){0, 0, 0, 4}, random));

  /* an element that a program adds is created by its name */
  SB_CHECK_ERROR(SbElementCreate("light", NULL, &e), PETSC_ERR_USER, "light");
  light = *SbElementFind("p1");
  (void)PetscStrncpy(light.element.name, "light", SB_NAME_MAX);
  light.element.ops.mass_lumped /= 2;
  PetscCall(SbElementRegister(&light));
  PetscCall(SbElementCreate("light", NULL, &e));
  SB_CHECK_NEAR(e->ops.mass_lumped, 1. / 8, 1e-16, "lumped mass of the added element");
  PetscCall(SbElementDestroy(&e));
  PetscCall(test_options());
  PetscCall(PetscRandomDestroy(&random));
  SB_TEST_END();
}
