// @ranks 1 2
/*
  Convergence of P1 on a manufactured solution without divergence: on the unit cube, with phi = (sin pi x sin pi y sin pi z)^2,

    u = (phi_y - phi_z, phi_z - phi_x, phi_x - phi_y),   u = 0 on the boundary,   f = -mu Lap u,   E = 3.

  The force does not contain lambda, so the exact answer is the same at every Poisson's ratio and what changes is the
  element's alone. P1 converges with order 2 in L2 and 1 in H1. Near nu = 1/2 it locks: not here on the mirrored cells of a
  box, which leave it enough displacements without divergence, but as soon as the vertices are moved.

  Errors relative to the norm of u, by a rule of degree 5 on each tet (Walkington 2000). Orders from n = 8 to 16 are a
  little below the limit, because a period of u has only n cells: 0.1 is allowed for that.
*/
#include "verify.h"

/* Values a, a', a'', a''' of sin^2(pi x). */
static void factor(PetscReal x, PetscReal a[4])
{
  const PetscReal s = PetscSinReal(2. * PETSC_PI * x), c = PetscCosReal(2. * PETSC_PI * x);

  a[0] = 0.5 * (1. - c);
  a[1] = PETSC_PI * s;
  a[2] = 2. * PETSC_PI * PETSC_PI * c;
  a[3] = -4. * PETSC_PI * PETSC_PI * PETSC_PI * s;
}

/* u[3] and its gradient G[3*i+j] = du_i/dx_j. */
static void exact(const PetscReal x[3], PetscReal u[3], PetscReal G[9])
{
  PetscReal a[3][4];

  for (int k = 0; k < 3; k++) factor(x[k], a[k]);
  for (int i = 0; i < 3; i++) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;

    u[i] = a[i][0] * (a[j][1] * a[k][0] - a[j][0] * a[k][1]);
    G[3 * i + i] = a[i][1] * (a[j][1] * a[k][0] - a[j][0] * a[k][1]);
    G[3 * i + j] = a[i][0] * (a[j][2] * a[k][0] - a[j][1] * a[k][1]);
    G[3 * i + k] = a[i][0] * (a[j][1] * a[k][1] - a[j][0] * a[k][2]);
  }
}

/* The formula of -mu Lap u_i as text: the variables of sin^2 written out. */
static PetscErrorCode force_formula(PetscReal mu, int i, char text[], size_t size)
{
  static const char *const name = "xyz";
  const char p = name[i], q = name[(i + 1) % 3], r = name[(i + 2) % 3];
  char a[4][3][64];

  PetscFunctionBeginUser;
  for (int v = 0; v < 3; v++) {
    const char c = v == 0 ? p : v == 1 ? q : r;

    PetscCall(PetscSNPrintf(a[0][v], 64, "sin(pi*%c)^2", c));
    PetscCall(PetscSNPrintf(a[1][v], 64, "pi*sin(2*pi*%c)", c));
    PetscCall(PetscSNPrintf(a[2][v], 64, "2*pi^2*cos(2*pi*%c)", c));
    PetscCall(PetscSNPrintf(a[3][v], 64, "(-4*pi^3*sin(2*pi*%c))", c));
  }
  PetscCall(PetscSNPrintf(text, size, "-%.17g*(%s*(%s*%s-%s*%s)+%s*(%s*%s+%s*%s-%s*%s-%s*%s))", (double)mu,
                          a[2][0], a[1][1], a[0][2], a[0][1], a[1][2], a[0][0], a[3][1], a[0][2], a[1][1],
                          a[2][2], a[2][1], a[1][2], a[0][1], a[3][2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Barycentric points and weights (sum 1) of degree 5. */
static void rule(PetscReal b[14][4], PetscReal w[14])
{
  const PetscReal a[2] = {0.31088591926330060980, 0.092735250310891226402}, e = 0.045503704125649649492;
  const PetscReal wa[2] = {0.11268792571801585080, 0.073493043116361949544}, we = 0.042546020777081466438;
  int n = 0;

  for (int orbit = 0; orbit < 2; orbit++) {
    for (int c = 0; c < 4; c++, n++) {
      for (int d = 0; d < 4; d++) b[n][d] = c == d ? 1. - 3. * a[orbit] : a[orbit];
      w[n] = wa[orbit];
    }
  }
  for (int c = 0; c < 4; c++) {
    for (int d = c + 1; d < 4; d++, n++) {
      for (int i = 0; i < 4; i++) b[n][i] = i == c || i == d ? 0.5 - e : e;
      w[n] = we;
    }
  }
}

/* Adds the squares of a tet: L2 error, H1 error, and of u itself. F = I + grad u_h. */
static void add_cell(const PetscReal x[4][3], const PetscReal u[4][3], const PetscReal F[9], PetscReal volume,
                     PetscReal sum[4])
{
  PetscReal b[14][4], w[14];

  rule(b, w);
  for (int q = 0; q < 14; q++) {
    PetscReal p[3] = {0., 0., 0.}, uh[3] = {0., 0., 0.}, ue[3], G[9];

    for (int a = 0; a < 4; a++) {
      for (int k = 0; k < 3; k++) {
        p[k] += b[q][a] * x[a][k];
        uh[k] += b[q][a] * u[a][k];
      }
    }
    exact(p, ue, G);
    for (int k = 0; k < 3; k++) {
      sum[0] += w[q] * volume * PetscSqr(uh[k] - ue[k]);
      sum[2] += w[q] * volume * PetscSqr(ue[k]);
    }
    for (int k = 0; k < 9; k++) {
      sum[1] += w[q] * volume * PetscSqr(F[k] - (k % 4 == 0) - G[k]);
      sum[3] += w[q] * volume * PetscSqr(G[k]);
    }
  }
}

static PetscErrorCode errors(SbModel m, Vec U, PetscReal error[2])
{
  SbSpace s = m->space;
  const PetscReal *u;
  PetscReal sum[4] = {0., 0., 0., 0.};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceGetLocalRead(s, U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    PetscReal x[4][3], v[4][3], g[3][3], V, F[9] = {1., 0., 0., 0., 1., 0., 0., 0., 1.};

    for (int a = 0; a < 4; a++) {
      for (int k = 0; k < 3; k++) {
        x[a][k] = s->node_x[3 * s->cell_node[4 * c + a] + k];
        v[a][k] = u[3 * s->cell_node[4 * c + a] + k];
      }
    }
    m->element[0]->ops.tabulate((const PetscReal(*)[3])x, g, &V);
    for (int k = 0; k < 9; k++) {
      for (int a = 0; a < 3; a++) F[k] += (v[a + 1][k / 3] - v[0][k / 3]) * g[a][k % 3];
    }
    add_cell((const PetscReal(*)[3])x, (const PetscReal(*)[3])v, F, V, sum);
  }
  PetscCall(SbSpaceRestoreLocalRead(s, U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, m->comm));
  error[0] = PetscSqrtReal(sum[0] / sum[2]);
  error[1] = PetscSqrtReal(sum[1] / sum[3]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inner vertices moved at random by up to 0.2 cells. */
static void move_vertex(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  PetscBool inner = PETSC_TRUE;

  for (int k = 0; k < 3; k++) inner = (PetscBool)(inner && at[k] > 0 && at[k] < n[k]);
  for (int k = 0; k < 3 && inner; k++) {
    PetscReal r;

    (void)PetscRandomGetValueReal((PetscRandom)ctx, &r);
    x[k] += (0.4 * r - 0.2) / (PetscReal)n[k];
  }
}

static PetscErrorCode write_mesh(PetscInt n, char path[512])
{
  PetscRandom random;

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetSeed(random, 8));
  PetscCall(PetscRandomSeed(random));
  PetscCall(verify_mesh_write((const PetscInt[3]){n, n, n}, move_vertex, random, path));
  PetscCall(PetscRandomDestroy(&random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(PetscInt n, PetscReal nu, PetscBool distorted, PetscReal error[2])
{
  const PetscReal mu = 3. / (2. * (1. + nu));
  TestScene t;
  char text[VERIFY_TEXT], f[3][512], mesh[512];

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) PetscCall(force_formula(mu, i, f[i], sizeof(f[i])));
  if (distorted)
    PetscCall(write_mesh(n, mesh));
  else
    PetscCall(PetscSNPrintf(mesh, sizeof(mesh), "box:1,1,1:%d", (int)n));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young 3 -body_a_poisson "
    "%.17g -body_a_density 1 -effects hold,load -effect_hold_type support -effect_hold_on boundary "
    "-effect_load_type body_force -effect_load_density %s;%s;%s -time static",
    mesh, (double)nu, f[0], f[1], f[2]));
  PetscCall(test_scene_open(text, &t));
  PetscCall(verify_solve(&t, "manufactured solution"));
  PetscCall(errors(t.model, t.run->U, error));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %-9s nu %-6g n %2d: L2 %.4f  H1 %.4f\n",
                        distorted ? "distorted" : "regular", (double)nu, (int)n, (double)error[0],
                        (double)error[1]));
  PetscCall(test_scene_close(&t));
  if (distorted) PetscCall(verify_mesh_remove(mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal coarse[2], fine[2], locked[2];

  SB_TEST_BEGIN(argc, argv);
  for (int distorted = 0; distorted < 2; distorted++) {
    PetscReal order[2];

    PetscCall(solve(8, 0.3, (PetscBool)distorted, coarse));
    PetscCall(solve(16, 0.3, (PetscBool)distorted, fine));
    PetscCall(solve(16, 0.4999, (PetscBool)distorted, locked));
    for (int k = 0; k < 2; k++) order[k] = PetscLog2Real(coarse[k] / fine[k]);
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  orders at nu 0.3: L2 %.3f  H1 %.3f\n", (double)order[0],
                          (double)order[1]));
    SB_CHECK_NEAR(order[0], 2., 0.1, "order in L2");
    SB_CHECK_NEAR(order[1], 1., 0.1, "order in H1");
    SB_CHECK(fine[0] < 0.06 && fine[1] < 0.2, "errors of n = 16: %g and %g", (double)fine[0],
             (double)fine[1]);
    /* known, and printed: the answer is too small, but never larger than the exact one is away from zero */
    SB_CHECK(locked[0] > fine[0] && locked[0] < 1., "nu 0.4999: an error of %g", (double)locked[0]);
  }
  SB_TEST_END();
}
