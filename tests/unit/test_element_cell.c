// @ranks 1
/*
  Cell kernels on random tets, a different one in each lane: gradients of affine maps, forces as
  derivatives of the energy, blocks as derivatives of the forces, vanishing terms, and a patch of
  tets under constant strain.
*/
#include "../laws.h"
#include "material_checks.h"
#include <sbelement.h>

typedef struct {
  SbPack X[12], g[9], V; /* corners, gradients, volumes */
} Cells;

static void make_cells(SbElement e, PetscReal size, Cells *c)
{
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal x[4][3], g[3][3], V;

    for (int a = 0; a < 4; a++)
      for (int i = 0; i < 3; i++)
        x[a][i] = size * (0.15 * uniform() + (a == i + 1));
    e->ops.tabulate((const PetscReal(*)[3])x, g, &V);
    SbPackPut(12, &x[0][0], l, c->X);
    SbPackPut(9, &g[0][0], l, c->g);
    c->V[l] = V;
  }
}

/* u = (A - I) X + b, with different A and b in each lane. */
static void affine(const Cells *c, const SbPack A[9], const SbPack b[3], SbPack u[12])
{
  for (int l = 0; l < SB_BATCH; l++) {
    for (int k = 0; k < 12; k++) {
      const int a = k / 3;
      const int i = k % 3;

      u[k][l] = b[i][l] - c->X[k][l];
      for (int j = 0; j < 3; j++)
        u[k][l] += A[3 * i + j][l] * c->X[3 * a + j][l];
    }
  }
}

static void force_of(SbMaterial m, const Cells *c, const SbPack u[12], SbPack f[12])
{
  SbPack F[9], P[9];

  SbCellGradient(c->g, u, 1., F);
  m->ops.stress(m, (const SbPack *)F, P);
  SbCellForce(c->g, c->V, (const SbPack *)P, f);
}

static void random_state(const Cells *c, PetscReal size, SbPack A[9], SbPack u[12])
{
  SbPack b[3];

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal F[9];

    random_deformation(size, F);
    SbPackPut(9, F, l, A);
    for (int i = 0; i < 3; i++)
      b[i][l] = c->X[1][l] * uniform();
  }
  affine(c, (const SbPack *)A, (const SbPack *)b, u);
}

static PetscReal lane_difference(int n, const SbPack a[], const SbPack b[])
{
  PetscReal worst = 0;

  for (int k = 0; k < n; k++)
    worst = larger(worst, difference(SB_BATCH, a[k], b[k]));
  return worst;
}

static void test_gradient(SbElement e)
{
  for (int t = 0; t < 100; t++) {
    Cells c;
    SbPack A[9], u[12], F[9], H[9];

    make_cells(e, pow(10, t % 7 - 3), &c);
    random_state(&c, 0.5, A, u);
    SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
    SB_CHECK(lane_difference(9, (const SbPack *)A, (const SbPack *)F) < 1e-13,
             "F of an affine map is off by %g",
             lane_difference(9, (const SbPack *)A, (const SbPack *)F));
    SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 0., H);
    for (int k = 0; k < 9; k += 4)
      for (int l = 0; l < SB_BATCH; l++)
        H[k][l] += 1;
    SB_CHECK(lane_difference(9, (const SbPack *)A, (const SbPack *)H) < 1e-13,
             "the rate of an affine map is wrong");
    for (int k = 0; k < 12; k++)
      for (int l = 0; l < SB_BATCH; l++)
        u[k][l] = 1e3 * (1 + k % 3);
    SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
    for (int k = 0; k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        SB_CHECK(F[k][l] == (k % 4 == 0), "F of a translation is not I");
  }
}

/* Force = d(V psi)/du by central differences of step 1e-5 size: truncation about 1e-10, rounding
   1e-11 of E size^2; laws with fibres are exponential, with larger third derivatives. */
static void test_force(SbElement e, SbMaterial m)
{
  const PetscReal size = 0.01;
  const PetscReal h = 1e-5 * size;

  for (int t = 0; t < 10; t++) {
    Cells c;
    SbPack A[9], u[12], f[12], F[9], plus, minus;

    make_cells(e, size, &c);
    random_state(&c, 0.25, A, u);
    force_of(m, &c, (const SbPack *)u, f);
    for (int k = 0; k < 12; k++) {
      for (int l = 0; l < SB_BATCH; l++)
        u[k][l] += h;
      SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
      m->ops.energy(m, (const SbPack *)F, plus);
      for (int l = 0; l < SB_BATCH; l++)
        u[k][l] -= 2 * h;
      SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
      m->ops.energy(m, (const SbPack *)F, minus);
      for (int l = 0; l < SB_BATCH; l++) {
        u[k][l] += h;
        SB_CHECK_NEAR(f[k][l], c.V[l] * (plus[l] - minus[l]) / (2 * h),
                      (m->type->fibres ? 1e-7 : 1e-8) * SbMaterialYoungModulus(m) * size * size,
                      "force against energy");
      }
    }
    for (int k = 0; k < 3; k++) {
      for (int l = 0; l < SB_BATCH; l++) {
        SB_CHECK_NEAR(f[k][l] + f[3 + k][l] + f[6 + k][l] + f[9 + k][l], 0,
                      1e-14 * SbMaterialYoungModulus(m) * size * size, "sum of forces");
      }
    }
  }
}

/* Entry (3 a + i, 3 b + k) of the cell matrix from the ten blocks. */
static PetscReal entry(const SbPack K[10][9], int row, int column, int l)
{
  const int a = row / 3;
  const int i = row % 3;
  const int b = column / 3;
  const int k = column % 3;

  for (int p = 0; p < 10; p++) {
    if (SbPairA[p] == a && SbPairB[p] == b)
      return K[p][3 * i + k][l];
    if (SbPairA[p] == b && SbPairB[p] == a)
      return K[p][3 * k + i][l];
  }
  return NAN;
}

/* Blocks of a row sum to zero; diagonal blocks are bitwise symmetric. */
static void check_block_sums(const SbPack K[10][9], PetscReal scale)
{
  static const int diagonal[4] = {0, 4, 7, 9};

  for (int l = 0; l < SB_BATCH; l++) {
    for (int row = 0; row < 12; row++) {
      for (int k = 0; k < 3; k++) {
        const PetscReal sum = entry(K, row, k, l) + entry(K, row, 3 + k, l) +
                              entry(K, row, 6 + k, l) + entry(K, row, 9 + k, l);

        SB_CHECK_NEAR(sum, 0, 1e-14 * scale, "sum of blocks");
      }
    }
    for (int a = 0; a < 4; a++) {
      for (int k = 0; k < 9; k++) {
        SB_CHECK(K[diagonal[a]][k][l] == K[diagonal[a]][3 * (k % 3) + k / 3][l],
                 "a diagonal block is not symmetric");
      }
    }
  }
}

/* Exact tangents: blocks against central differences of the force. exact_spd: the specialised form
   against the general one. */
static PetscErrorCode test_blocks(SbElement e, SbMaterial m, SbTangentKind kind)
{
  const PetscReal size = 0.01;
  const PetscReal h = 1e-5 * size;

  PetscFunctionBeginUser;
  if (!m->linear)
    PetscCall(SbMaterialSetTangent(m, kind));
  for (int t = 0; t < 10; t++) {
    Cells c;
    SbPack A[9], u[12], F[9], C[81], K[10][9], J[10][9], plus[12], minus[12];

    make_cells(e, size, &c);
    random_state(&c, 0.25, A, u);
    SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
    m->ops.tangent(m, (const SbPack *)F, C);
    SbCellBlocksGeneral((const SbPack *)c.g, c.V, (const SbPack *)C, K);
    check_block_sums((const SbPack(*)[9])K, stress_scale(m) * size);
    for (int column = 0; kind == SB_TANGENT_EXACT && column < 12; column++) {
      for (int l = 0; l < SB_BATCH; l++)
        u[column][l] += h;
      force_of(m, &c, (const SbPack *)u, plus);
      for (int l = 0; l < SB_BATCH; l++)
        u[column][l] -= 2 * h;
      force_of(m, &c, (const SbPack *)u, minus);
      for (int l = 0; l < SB_BATCH; l++) {
        u[column][l] += h;
        for (int row = 0; row < 12; row++) {
          SB_CHECK_NEAR(entry((const SbPack(*)[9])K, row, column, l),
                        (plus[row][l] - minus[row][l]) / (2 * h),
                        (m->type->limited ? 2e-7 : 1e-7) * SbMaterialYoungModulus(m) * size,
                        "block against force");
        }
      }
    }
    if (m->ops.spin) {
      SbPack R[9], W[9];

      m->ops.spin(m, (const SbPack *)F, NULL, R, W);
      SbCellBlocksCorotated((const SbPack *)c.g, c.V, SbMaterialVolumetricModulus(m),
                            SbMaterialShearModulus(m), (const SbPack *)R, (const SbPack *)W, J);
      check_block_sums((const SbPack(*)[9])J, stress_scale(m) * size);
      for (int p = 0; p < 10; p++) {
        SB_CHECK(lane_difference(9, (const SbPack *)J[p], (const SbPack *)K[p]) <
                   1e-13 * stress_scale(m) * size,
                 "block %d from the spin is %g from the general one", p,
                 lane_difference(9, (const SbPack *)J[p], (const SbPack *)K[p]));
      }
    }
    if (m->linear) {
      SbPack R[9];

      m->ops.frame(m, (const SbPack *)F, R);
      SbCellBlocksIsotropic((const SbPack *)c.g, c.V, SbMaterialVolumetricModulus(m),
                            SbMaterialShearModulus(m), (const SbPack *)R, J);
      check_block_sums((const SbPack(*)[9])J, stress_scale(m) * size);
      for (int p = 0; p < 10; p++) {
        SB_CHECK(lane_difference(9, (const SbPack *)J[p], (const SbPack *)K[p]) <
                   1e-14 * stress_scale(m) * size,
                 "isotropic block %d is not the general one", p);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warped: K v is the force of R hooke(sym(R^T H(v))), and K is positive semi-definite: v . K v >=
   0. */
static PetscErrorCode test_warped(SbElement e, SbMaterial m)
{
  const PetscReal size = 10;

  PetscFunctionBeginUser;
  PetscCall(SbMaterialSetTangent(m, SB_TANGENT_WARPED));
  for (int t = 0; t < 50; t++) {
    Cells c;
    SbPack A[9], u[12], v[12], F[9], R[9], H[9], W[9], dP[9], f[12], K[10][9], J[10][9];

    make_cells(e, size, &c);
    random_state(&c, 0.6, A, u);
    for (int k = 0; k < 12; k++)
      for (int l = 0; l < SB_BATCH; l++)
        v[k][l] = uniform();
    SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
    m->ops.frame(m, (const SbPack *)F, R);
    SbCellBlocksIsotropic((const SbPack *)c.g, c.V, SbMaterialVolumetricModulus(m),
                          SbMaterialShearModulus(m), (const SbPack *)R, K);
    for (int k = 0; k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        W[k][l] = k % 4 == 0 ? -SbMaterialShearModulus(m) : 0;
    SbCellBlocksCorotated((const SbPack *)c.g, c.V, SbMaterialVolumetricModulus(m),
                          SbMaterialShearModulus(m), (const SbPack *)R, (const SbPack *)W, J);
    for (int p = 0; p < 10; p++) {
      SB_CHECK(lane_difference(9, (const SbPack *)J[p], (const SbPack *)K[p]) <
                 1e-14 * stress_scale(m) * size,
               "block %d with W = -mu I is not Hooke's", p);
    }
    check_block_sums((const SbPack(*)[9])K, stress_scale(m) * size);
    SbCellGradient((const SbPack *)c.g, (const SbPack *)v, 0., H);
    SbMaterialDampingStress(m, (const SbPack *)F, (const SbPack *)H, dP);
    SbCellForce((const SbPack *)c.g, c.V, (const SbPack *)dP, f);
    for (int l = 0; l < SB_BATCH; l++) {
      PetscReal power = 0;

      for (int row = 0; row < 12; row++) {
        PetscReal sum = 0;

        for (int column = 0; column < 12; column++)
          sum += entry((const SbPack(*)[9])K, row, column, l) * v[column][l];
        SB_CHECK_NEAR(sum, f[row][l], 1e-13 * stress_scale(m) * size,
                      "warped K v against the damping stress");
        power += sum * v[row][l];
      }
      SB_CHECK(power > 0, "v . K v is %g", power);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Zero force after any rotation and translation, in steps of 15 degrees. */
static void test_rotation(SbElement e, SbMaterial m)
{
  const PetscReal axis[3] = {1, 2, 3};
  Cells c;

  make_cells(e, 1, &c);
  for (int degree = 0; degree <= 360; degree += 15) {
    SbPack A[9], b[3], u[12], f[12];
    PetscReal Q[9];

    axis_rotation(axis, degree * PETSC_PI / 180, Q);
    for (int l = 0; l < SB_BATCH; l++) {
      SbPackPut(9, Q, l, A);
      for (int i = 0; i < 3; i++)
        b[i][l] = 3 - i;
    }
    affine(&c, (const SbPack *)A, (const SbPack *)b, u);
    force_of(m, &c, (const SbPack *)u, f);
    for (int k = 0; k < 12; k++)
      for (int l = 0; l < SB_BATCH; l++)
        SB_CHECK_NEAR(f[k][l], 0, 1e-12 * SbMaterialYoungModulus(m), "force of a rotated cell");
  }
}

/*
  Patch test: the unit cube cut into twelve tets around an off-centre interior point. Under constant
  strain the interior point is in equilibrium, and the forces on the corners sum to zero and to the
  virial sum_a f_a X_a^T = V P.
*/
static void test_patch(SbElement e, SbMaterial m)
{
  static const int face[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                  {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  PetscReal X[9][3] = {{0}};
  PetscReal f[9][3] = {{0}};
  PetscReal F[9], P[9];
  PetscReal virial[9] = {0};
  PetscReal volume = 0;

  for (int k = 0; k < 8; k++)
    for (int i = 0; i < 3; i++)
      X[k][i] = (k >> i) & 1;
  X[8][0] = 0.35;
  X[8][1] = 0.6;
  X[8][2] = 0.45;
  random_deformation(0.3, F);
  for (int start = 0; start < 12; start += 4) {
    Cells c;
    SbPack A[9];
    SbPack b[3] = {{0}};
    SbPack u[12], fe[12];

    for (int l = 0; l < SB_BATCH; l++) {
      const int *corner = face[start + l % 4];
      const int node[4] = {8, corner[0], corner[1], corner[2]};
      PetscReal x[4][3], g[3][3], V;

      for (int a = 0; a < 4; a++)
        memcpy(x[a], X[node[a]], sizeof(x[a]));
      e->ops.tabulate((const PetscReal(*)[3])x, g, &V);
      SbPackPut(12, &x[0][0], l, c.X);
      SbPackPut(9, &g[0][0], l, c.g);
      SbPackPut(9, F, l, A);
      c.V[l] = V;
    }
    affine(&c, (const SbPack *)A, (const SbPack *)b, u);
    force_of(m, &c, (const SbPack *)u, fe);
    for (int l = 0; l < 4; l++) {
      const int *corner = face[start + l];
      const int node[4] = {8, corner[0], corner[1], corner[2]};

      SB_CHECK(c.V[l] > 0, "tet %d of the patch is inverted", start + l);
      volume += c.V[l];
      for (int k = 0; k < 12; k++)
        f[node[k / 3]][k % 3] += fe[k][l];
    }
  }
  stress_of(m, F, P);
  SB_CHECK_NEAR(volume, 1, 1e-14, "volume of the patch");
  for (int i = 0; i < 3; i++) {
    SB_CHECK_NEAR(f[8][i], 0, 1e-13 * stress_scale(m), "force on the inner point of the patch");
    for (int j = 0; j < 3; j++) {
      for (int k = 0; k < 9; k++)
        virial[3 * i + j] += f[k][i] * X[k][j];
      SB_CHECK_NEAR(virial[3 * i + j], P[3 * i + j], 1e-13 * stress_scale(m),
                    "virial of the patch");
    }
  }
}

/* The same cell in several lanes, among others, gives bitwise the same result. */
static void test_lanes(SbElement e)
{
  Cells c;
  SbPack u[12], R[9], C[81], F[9], f[12], K[10][9], J[10][9], S[10][9];
  PetscInt different = 0;

  make_cells(e, 1, &c);
  for (int l = 0; l < SB_BATCH; l++) {
    /* even lanes equal lane 0 */
    for (int k = 0; k < 81; k++)
      C[k][l] = l % 2 ? uniform() : l ? C[k][0] : uniform();
    for (int k = 0; k < 12; k++)
      u[k][l] = l % 2 ? NAN : l ? u[k][0] : uniform();
    for (int k = 0; k < 9; k++)
      R[k][l] = l % 2 ? uniform() : l ? R[k][0] : uniform();
    for (int k = 0; k < 9; k++)
      c.g[k][l] = l % 2 ? c.g[k][l] : c.g[k][0];
    c.V[l] = l % 2 ? c.V[l] : c.V[0];
  }
  SbCellGradient((const SbPack *)c.g, (const SbPack *)u, 1., F);
  SbCellForce((const SbPack *)c.g, c.V, (const SbPack *)F, f);
  SbCellBlocksIsotropic((const SbPack *)c.g, c.V, 3, 2, (const SbPack *)R, K);
  SbCellBlocksGeneral((const SbPack *)c.g, c.V, (const SbPack *)C, J);
  SbCellBlocksCorotated((const SbPack *)c.g, c.V, 3, 2, (const SbPack *)R, (const SbPack *)C, S);
  for (int l = 2; l < SB_BATCH; l += 2) {
    for (int k = 0; k < 9; k++)
      different += F[k][l] != F[k][0];
    for (int k = 0; k < 12; k++)
      different += f[k][l] != f[k][0];
    for (int k = 0; k < 90; k++)
      different += K[k / 9][k % 9][l] != K[k / 9][k % 9][0] ||
                   J[k / 9][k % 9][l] != J[k / 9][k % 9][0] ||
                   S[k / 9][k % 9][l] != S[k / 9][k % 9][0];
  }
  SB_CHECK(!different, "%d numbers depend on their neighbours", (int)different);
}

int main(int argc, char **argv)
{
  const char *laws[SB_MATERIAL_TYPES];
  PetscInt n;
  SbElement e;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(random_begin());
  PetscCall(SbMaterialRegisterAll());
  PetscCall(SbElementRegisterAll());
  PetscCall(SbElementCreate("p1", NULL, &e));
  test_gradient(e);
  test_lanes(e);
  n = SbMaterialTypes(laws);
  for (PetscInt k = 0; k < n; k++) {
    SbMaterial m;

    PetscCall(law_create(laws[k], 2e4, 0.35, 1000, &m));
    test_force(e, m);
    PetscCall(test_blocks(e, m, SB_TANGENT_EXACT));
    PetscCall(test_blocks(e, m, SB_TANGENT_EXACT_SPD));
    test_patch(e, m);
    if (!m->linear)
      test_rotation(e, m);
    if (m->ops.spin)
      PetscCall(test_warped(e, m));
    PetscCall(SbMaterialDestroy(&m));
  }
  PetscCall(SbElementDestroy(&e));
  PetscCall(PetscRandomDestroy(&the_random));
  SB_TEST_END();
}
