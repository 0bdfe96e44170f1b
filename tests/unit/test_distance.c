// @ranks 1
/* Distances of vertices, edges and triangles, their derivatives, and the mollifier of parallel
   edges. */
#include <sbkernel.h>
#include "pair_reference.h"

#define NRANDOM 120000

/* Pair from one of several families, some of them degenerate; returns its size. */
static PetscReal make_pair(int i, PetscReal x[12])
{
  static const PetscReal sizes[] = {1, 1e-6, 1, 1e4};
  const PetscReal size = sizes[i / 11 % 4];
  const int a = i / 44 % 4;
  const int b = (a + 1 + i / 176 % 3) % 4;

  for (int k = 0; k < 12; k++)
    x[k] = pair_random();
  for (int k = 0; k < 3; k++) {
    switch (i % 11) {
    case 0:
    case 1:
      break;
    case 2:
      x[3 * a + k] = x[3 * b + k];
      break; /* coincident vertices */
    case 3:
      x[3 * a + k] = x[3 * b + k] + 1e-9 * x[3 * a + k];
      break; /* nearly coincident */
    case 4:
      x[9 + k] = x[6 + k] + (x[3 + k] - x[k]) * 0.7;
      break; /* parallel edges */
    case 5:
      x[9 + k] = x[6 + k] - (x[3 + k] - x[k]) + 1e-7 * x[9 + k];
      break; /* nearly parallel edges */
    case 6:
      x[9 + k] = 0.3 * x[3 + k] + 0.7 * x[6 + k] + 1e-6 * x[9 + k];
      break; /* sliver triangle */
    case 7:
      x[3 * k + 2] = 0.25;
      x[11] = 0.25;
      break; /* coplanar */
    case 8:
      x[3 * k + 2] = 0.25 + 1e-11 * x[3 * k + 2];
      x[11] = 0.25;
      break; /* nearly coplanar */
    case 9:
      x[k] = 0.2 * x[3 + k] + 0.3 * x[6 + k] + 0.5 * x[9 + k] + 1e-7 * x[k];
      break; /* close to a triangle */
    default:
      x[6 + k] = -0.4 * x[9 + k] + 0.4 * x[k] + x[3 + k] + 1e-6 * x[6 + k];
      break; /* close edges */
    }
  }
  for (int k = 0; k < 12; k++)
    x[k] *= size;
  return size;
}

static void check_random(void)
{
  PetscInt seen[4][4] = {{0}};

  for (int i = 0; i < NRANDOM; i++) {
    const SbPairKind kind = (SbPairKind)(i / 704 % 4);
    const int n = pair_vertices(kind);
    PetscReal x[12];
    PetscReal size = make_pair(i, x);
    PetscReal side[2] = {0, 0};
    PetscReal off = 0;
    PetscReal nn = 0;
    long double y[12], d;
    SbDistance s;

    for (int k = 0; k < 12; k++)
      y[k] = x[k];
    d = pair_distance(kind, y);
    SbDistanceFind(kind, x, &s);
    seen[kind][s.feature]++;
    SB_CHECK_NEAR(s.d, d, 4e-15 * size, "distance");

    /* closest points: in both primitives, weights of sum one, at the returned distance along the
       normal */
    for (int a = 0; a < n; a++) {
      side[a >= pair_first(kind)] += s.weight[a];
      if ((a < pair_first(kind) ? s.weight[a] : -s.weight[a]) < 0)
        off = 1;
      if (!(s.mask >> a & 1) && s.weight[a] != 0)
        off = 1;
    }
    SB_CHECK_NEAR(side[0], 1, 1e-15, "weights of the first side");
    SB_CHECK_NEAR(side[1], -1, 1e-15, "weights of the second side");
    SB_CHECK(off == 0, "pair %d: a weight has the wrong sign, or belongs to no feature", i);
    for (int k = 0; k < 3; k++) {
      PetscReal r = 0;

      for (int a = 0; a < n; a++)
        r += s.weight[a] * x[3 * a + k];
      off = PetscMax(off, PetscAbsReal(r - s.d * s.n[k]));
      nn += s.n[k] * s.n[k];
    }
    SB_CHECK_NEAR(off, 0, 1e-13 * size,
                  "the closest points are not as far from each other as the distance");
    if (s.d > 0)
      SB_CHECK_NEAR(nn, 1, 1e-14, "squared length of the direction");
  }
  for (int k = SB_PAIR_VERTEX_VERTEX; k <= SB_PAIR_EDGE_EDGE; k++) {
    for (int f = SB_PAIR_VERTEX_VERTEX; f <= SB_PAIR_EDGE_EDGE; f++) {
      const PetscBool can =
        (PetscBool)(f <= k && !(f == SB_PAIR_VERTEX_TRIANGLE && k == SB_PAIR_EDGE_EDGE));

      SB_CHECK(can ? seen[k][f] > 1000 : !seen[k][f], "pairs of kind %d with feature %d: %d", k, f,
               (int)seen[k][f]);
    }
  }
}

/* First and second derivatives of d against central differences along random directions, where the
   closest feature does not change. */
static void check_derivatives(void)
{
  PetscInt seen[4] = {0};

  for (int i = 0; i < 40000; i++) {
    const SbPairKind kind = (SbPairKind)(i % 4);
    const int n = 3 * pair_vertices(kind);
    const PetscReal step = i % 8 < 4 ? 1e-4 : 1e-5;
    const PetscReal both[2] = {pair_random(), pair_random()};
    const PetscReal hessian[2] = {0, 1};
    PetscReal x[12] = {0};
    PetscReal v[12] = {0};
    PetscReal H[144], G[144];
    PetscReal Hv[12] = {0};
    PetscReal slope = 0;
    PetscReal error = 0;
    PetscReal size = 0;
    PetscReal sum = 0;
    PetscReal other = 0;
    PetscBool same = PETSC_TRUE;
    PetscBool regular = PETSC_TRUE;
    SbDistance s[3];

    for (int k = 0; k < n; k++) {
      x[k] = pair_random();
      v[k] = pair_random();
    }
    SbDistanceFind(kind, x, &s[0]);
    for (int j = 1; j < 3; j++) {
      PetscReal y[12] = {0};

      for (int k = 0; k < n; k++)
        y[k] = x[k] + (j == 1 ? step : -step) * v[k];
      SbDistanceFind(kind, y, &s[j]);
      same = (PetscBool)(same && s[j].mask == s[0].mask && SbDot3(s[j].n, s[0].n) > 0);
    }
    SbDistanceHessian(x, &s[0], hessian, PETSC_FALSE, H);
    for (int k = 0; k < 144; k++) {
      size = PetscMax(size, PetscAbsReal(H[k]));
      other = PetscMax(other, PetscAbsReal(H[k] - H[12 * (k % 12) + k / 12]));
    }
    regular = (PetscBool)(size < 30 && s[0].d > 0.03); /* otherwise the third derivative is large */
    SB_CHECK_NEAR(other, 0, 1e-14 * size, "asymmetry of the second derivative");
    if (!same || !regular)
      continue;
    seen[s[0].feature]++;
    for (int k = 0; k < n; k++)
      slope += s[0].weight[k / 3] * s[0].n[k % 3] * v[k];
    SB_CHECK_NEAR((s[1].d - s[2].d) / (2 * step), slope, 2e4 * step * step + 1e-10,
                  "derivative of the distance");
    for (int k = 0; k < n; k++) {
      for (int l = 0; l < n; l++)
        Hv[k] += H[12 * k + l] * v[l];
      error = PetscMax(error, PetscAbsReal(Hv[k] - (s[1].weight[k / 3] * s[1].n[k % 3] -
                                                    s[2].weight[k / 3] * s[2].n[k % 3]) /
                                                     (2 * step)));
    }
    SB_CHECK_NEAR(error, 0, 2e6 * step * step + 1e-9, "second derivative of the distance");

    /* the factors; zero rows of vertices that the kind does not have */
    SbDistanceHessian(x, &s[0], both, PETSC_FALSE, G);
    for (int k = 0; k < 144; k++) {
      const int a = k / 12;
      const int b = k % 12;
      const PetscReal g = s[0].weight[a / 3] * s[0].n[a % 3] * s[0].weight[b / 3] * s[0].n[b % 3];

      sum = PetscMax(sum, PetscAbsReal(G[k] - both[0] * g - both[1] * H[k]));
      if (a >= n || b >= n)
        sum = PetscMax(sum, PetscAbsReal(H[k]));
    }
    SB_CHECK_NEAR(sum, 0, 1e-14 * (1 + size), "factors of the derivatives");
  }
  for (int f = 0; f < 4; f++)
    SB_CHECK(seen[f] > 1000, "feature %d: %d", f, (int)seen[f]);
}

/* Smallest value of y . A y / y . y after a few steps of power iteration on s - A. */
static PetscReal least_eigenvalue(const PetscReal A[144])
{
  PetscReal y[12];
  PetscReal size = 0;
  PetscReal value = 0;

  for (int k = 0; k < 144; k++)
    size += PetscAbsReal(A[k]);
  if (size == 0)
    return 0;
  for (int k = 0; k < 12; k++)
    y[k] = pair_random();
  for (int i = 0; i < 60; i++) {
    PetscReal z[12];
    PetscReal yy = 0;

    for (int k = 0; k < 12; k++) {
      z[k] = size * y[k];
      for (int l = 0; l < 12; l++)
        z[k] -= A[12 * k + l] * y[l];
      yy += z[k] * z[k];
    }
    for (int k = 0; k < 12; k++)
      y[k] = z[k] / PetscSqrtReal(yy);
  }
  for (int k = 0; k < 144; k++)
    value += y[k / 12] * A[k] * y[k % 12];
  return value;
}

/* P is the positive semidefinite part of A if P and P - A have no negative eigenvalues and P (P -
   A) = 0. */
static void check_part(const PetscReal A[144], const PetscReal P[144], const char *what)
{
  PetscReal N[144];
  PetscReal size = 0;
  PetscReal product = 0;

  for (int k = 0; k < 144; k++) {
    N[k] = P[k] - A[k];
    size = PetscMax(size, PetscAbsReal(A[k]));
  }
  SB_CHECK(least_eigenvalue(P) > -1e-12 * size, "%s: a part is left", what);
  SB_CHECK(least_eigenvalue(N) > -1e-12 * size, "%s: something was added", what);
  for (int i = 0; i < 12; i++) {
    for (int j = 0; j < 12; j++) {
      PetscReal sum = 0;

      for (int k = 0; k < 12; k++)
        sum += P[12 * i + k] * N[12 * k + j];
      product = PetscMax(product, PetscAbsReal(sum));
    }
  }
  SB_CHECK_NEAR(product, 0, 1e-12 * size * size, what);
}

static void check_clamp(void)
{
  for (int i = 0; i < 2000; i++) {
    const SbPairKind kind = (SbPairKind)(i % 4);
    const PetscReal factor[2] = {PetscAbsReal(pair_random()),
                                 pair_random() * PetscPowReal(10, i % 3)};
    PetscReal x[12], A[144], P[144];
    SbDistance s;

    (void)make_pair(i % 11 < 2 || i % 11 > 8 ? i : 0, x);
    SbDistanceFind(kind, x, &s);
    if (s.d < 1e-6)
      continue;
    SbDistanceHessian(x, &s, factor, PETSC_FALSE, A);
    SbDistanceHessian(x, &s, factor, PETSC_TRUE, P);
    check_part(A, P, "clamped derivative of a distance");
    for (int k = 0; k < 144; k++)
      A[k] = P[k] = k % 12 <= k / 12 ? pair_random() : A[12 * (k % 12) + k / 12];
    for (int k = 0; k < 144; k++)
      A[k] = P[k] = A[12 * PetscMax(k / 12, k % 12) + PetscMin(k / 12, k % 12)];
    SbSymmetricProjectPSD(12, P);
    check_part(A, P, "clamped matrix");
  }
}

static void check_cross(void)
{
  const PetscReal step = 1e-4;

  for (int i = 0; i < 4000; i++) {
    PetscReal x[12], v[12], value[3], g[3][12], H[144], y[12];
    PetscReal slope = 0;
    PetscReal error = 0;
    PetscReal u[3], w[3], c[3];

    for (int k = 0; k < 12; k++) {
      x[k] = pair_random();
      v[k] = pair_random();
    }
    for (int k = 0; k < 3; k++) {
      u[k] = x[3 + k] - x[k];
      w[k] = x[9 + k] - x[6 + k];
    }
    SbCross(u, w, c);
    value[0] = SbEdgeCross(x, g[0], H);
    SB_CHECK_NEAR(value[0], SbDot3(c, c), 1e-14, "cross product of edges");
    for (int j = 1; j < 3; j++) {
      for (int k = 0; k < 12; k++)
        y[k] = x[k] + (j == 1 ? step : -step) * v[k];
      value[j] = SbEdgeCross(y, g[j], NULL);
    }
    for (int k = 0; k < 12; k++)
      slope += g[0][k] * v[k];
    SB_CHECK_NEAR((value[1] - value[2]) / (2 * step), slope, 1e-4, "its derivative");
    for (int k = 0; k < 12; k++) {
      PetscReal sum = 0;

      for (int l = 0; l < 12; l++)
        sum += H[12 * k + l] * v[l];
      error = PetscMax(error, PetscAbsReal(sum - (g[1][k] - g[2][k]) / (2 * step)));
    }
    SB_CHECK_NEAR(error, 0, 1e-4, "its second derivative");
    for (int k = 0; k < 3; k++)
      y[6 + k] = (y[9 + k] = x[k]) - x[3 + k] + x[k]; /* parallel */
    for (int k = 0; k < 6; k++)
      y[k] = x[k];
    SB_CHECK_NEAR(SbEdgeCross(y, NULL, NULL), 0, 1e-30, "cross product of parallel edges");
  }
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  check_random();

  /* a vertex above a triangle and two crossing edges, at gaps below the rounding error of
     differences, far from the origin too */
  for (int i = 0; i < 20; i++) {
    const PetscReal gap = PetscPowReal(2, -3 * i);
    const PetscReal far = i % 2 ? 1 : 0;
    const PetscReal over[12] = {0.3 + far, 0.3, gap, far, 0, 0, 1 + far, 0, 0, far, 1, 0};
    const PetscReal cross[12] = {far - 1, 0.125, gap, far + 1,     -0.25, gap,
                                 far,     -1,    0,   far + 0.125, 1,     0};
    SbDistance s;

    SbDistanceFind(SB_PAIR_VERTEX_TRIANGLE, over, &s);
    SB_CHECK(s.feature == SB_PAIR_VERTEX_TRIANGLE, "closest feature %d", (int)s.feature);
    SB_CHECK_NEAR(s.d, gap, 1e-15 * gap, "distance over a triangle");
    SB_CHECK_NEAR(s.n[2], 1, 1e-15, "direction over a triangle");
    SbDistanceFind(SB_PAIR_EDGE_EDGE, cross, &s);
    SB_CHECK(s.feature == SB_PAIR_EDGE_EDGE, "closest feature %d", (int)s.feature);
    SB_CHECK_NEAR(s.d, gap, 1e-15 * gap, "distance over an edge");
    SB_CHECK_NEAR(s.n[2], 1, 1e-15, "direction over an edge");
  }
  check_derivatives();
  check_clamp();
  check_cross();
  SB_TEST_END();
}
