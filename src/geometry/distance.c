/*
  distance.c - distance of a vertex and a triangle, two edges, ..., with gradient and Hessian.

  The vector between the closest points, from the second side to the first, is r = sum_a w_a x_a, d
  = |r|. Vertices with nonzero weight are the closest feature: two vertices, a vertex and an edge,
  or the interior of both sides. Let t_k = sum_a w_a,k x_a be the derivatives of r by the (none, one
  or two) coordinates on the feature, q_k their dual basis, and c_a = sum_k w_a,k q_k. As r is
  orthogonal to all t_k,

      d,a    = w_a n,                                              n = r / d
      d,ab   = w_a w_b P / d - w_a c_b n^T - w_b n c_a^T - d (c_a . c_b) n n^T

  with P the projection orthogonal to n and all t_k. P is zero in the interior of both sides: no
  term is singular there.

  a grad d grad d^T + b Hess d has rank five at most, on the space spanned by n times three vectors
  of weights with zero sum, and by the two directions orthogonal to n times w. Its projection to the
  positive semi-definite matrices is computed there.

  If both sides are nearly in one plane, r is a small difference of large numbers; where it is less
  accurate than the normal of the plane, n is that normal and d the distance along it.

  Edges: closest points of the lines if on both edges, else the nearest endpoint (after Lumelsky,
  "On fast computation of distance between line segments", 1985; by cross products, as differences
  of squares are inaccurate for nearly parallel edges). Mollifier: Li et al., "Incremental Potential
  Contact", 2020, section 5.
*/
#include "sbgeometry.h"
#include <petscblaslapack.h>

#define ALONG 1e-4     /* sine between edges below which the lines' closest points are inaccurate */
#define PARALLEL 1e-12 /* the same, below which lines count as parallel */

/* Distance of a vertex and an edge a b, if below s->d (squared here); sign: 1 if on the first side,
   else -1.
   */
static inline void try_edge(const PetscReal x[], int vertex, int a, int b, PetscReal sign,
                            SbDistance *s)
{
  PetscReal e[3], r[3], ee, er, t, d2;

  SbSubtract(x + 3 * b, x + 3 * a, e);
  SbSubtract(x + 3 * vertex, x + 3 * a, r);
  ee = SbDot3(e, e);
  er = SbDot3(e, r);
  if (er <= 0)
    t = 0;
  else
    t = er >= ee ? 1 : er / ee;

  // relative to the nearer endpoint, for accuracy
  if (t > 0.5)
    SbSubtract(x + 3 * vertex, x + 3 * b, r);
  for (int k = 0; k < 3; k++)
    r[k] -= (t > 0.5 ? t - 1 : t) * e[k];
  d2 = SbDot3(r, r);
  if (!(d2 < s->d))
    return;
  s->d = d2;
  for (int k = 0; k < 4; k++)
    s->weight[k] = 0;
  s->weight[vertex] = sign;
  s->weight[a] = sign * (t - 1);
  s->weight[b] = -sign * t;
  s->mask = 1 << vertex | (t < 1) << a | (t > 0) << b;
  s->feature = t > 0 && t < 1 ? SB_PAIR_VERTEX_EDGE : SB_PAIR_VERTEX_VERTEX;
  for (int k = 0; k < 3; k++)
    s->n[k] = sign * r[k];
}

/* Distance and unit vector from r = s->n, or the normal if both sides are almost in a plane; size2:
   edge^2.
   */
static inline void finish(const PetscReal between[3], const PetscReal normal[3], PetscReal size2,
                          SbDistance *s)
{
  const PetscReal d2 = SbDot3(s->n, s->n);
  const PetscReal nn = normal ? SbDot3(normal, normal) : 0;

  s->d = PetscSqrtReal(d2);
  if (normal && nn > 0 && nn >= d2 * size2) {
    const PetscReal length = PetscSqrtReal(nn);
    const PetscReal height = SbDot3(between, normal);
    const PetscReal side = height < 0 ? -1 : 1;

    s->d = side * height / length;
    for (int k = 0; k < 3; k++)
      s->n[k] = side * normal[k] / length;
  } else if (s->d > 0) {
    for (int k = 0; k < 3; k++)
      s->n[k] /= s->d;
  }
}

static inline void vertex_triangle(const PetscReal x[], SbDistance *s)
{
  const PetscReal *const corner[3] = {x + 3, x + 6, x + 9};
  PetscReal w[3], d2, e[2][3], normal[3], r[3][3];
  const SbTriangleFeature feature = SbTriangleClosestPoint(x, corner, w, &d2);

  s->weight[0] = 1;
  s->mask = 1;
  for (int a = 0; a < 3; a++) {
    SbSubtract(x, corner[a], r[a]);
    s->weight[1 + a] = -w[a];
    s->mask |= (w[a] != 0 || feature == SB_FEATURE_FACE) << (1 + a);
  }
  if (feature == SB_FEATURE_FACE)
    s->feature = SB_PAIR_VERTEX_TRIANGLE;
  else if ((w[0] != 0) + (w[1] != 0) + (w[2] != 0) == 2)
    s->feature = SB_PAIR_VERTEX_EDGE;
  else
    s->feature = SB_PAIR_VERTEX_VERTEX;
  for (int k = 0; k < 3; k++)
    s->n[k] = w[0] * r[0][k] + w[1] * r[1][k] + w[2] * r[2][k];
  if (feature != SB_FEATURE_FACE) {
    finish(NULL, NULL, 0, s);
    return;
  }
  SbSubtract(corner[1], corner[0], e[0]);
  SbSubtract(corner[2], corner[0], e[1]);
  SbCross(e[0], e[1], normal);
  finish(r[0], normal, PetscMax(SbDot3(e[0], e[0]), SbDot3(e[1], e[1])), s);
}

static inline void edge_edge(const PetscReal x[], SbDistance *s)
{
  PetscReal u[3], v[3], r[3], normal[3], c[3], uu, vv, nn;
  PetscReal a = 0;
  PetscReal b = 0;
  PetscBool inside = PETSC_FALSE;

  SbSubtract(x + 3, x, u);
  SbSubtract(x + 9, x + 6, v);
  SbSubtract(x, x + 6, r);
  uu = SbDot3(u, u);
  vv = SbDot3(v, v);
  SbCross(u, v, normal);
  nn = SbDot3(normal, normal);
  if (nn > PARALLEL * PARALLEL * uu * vv) {
    SbCross(v, r, c);
    a = SbDot3(c, normal) / nn;
    SbCross(u, r, c);
    b = SbDot3(c, normal) / nn;
    inside = (PetscBool)(a > 0 && a < 1 && b > 0 && b < 1);
  }
  *s = (SbDistance){.d = PETSC_MAX_REAL};
  if (inside) {
    const PetscReal w[4] = {1 - a, a, b - 1, -b};

    s->feature = SB_PAIR_EDGE_EDGE;
    s->mask = 15;
    for (int k = 0; k < 4; k++)
      s->weight[k] = w[k];
    for (int k = 0; k < 3; k++)
      s->n[k] = r[k] + a * u[k] - b * v[k];
    s->d = SbDot3(s->n, s->n);
  }
  if (!inside || nn < ALONG * ALONG * uu * vv) {
    try_edge(x, 0, 2, 3, 1, s);
    try_edge(x, 1, 2, 3, 1, s);
    try_edge(x, 2, 0, 1, -1, s);
    try_edge(x, 3, 0, 1, -1, s);
  }
  finish(r, s->feature == SB_PAIR_EDGE_EDGE ? normal : NULL, PetscMax(uu, vv), s);
}

void SbDistanceFind(SbPairKind kind, const PetscReal x[], SbDistance *s)
{
  PetscReal r[3];

  switch (kind) {
  case SB_PAIR_VERTEX_TRIANGLE:
    vertex_triangle(x, s);
    break;
  case SB_PAIR_EDGE_EDGE:
    edge_edge(x, s);
    break;
  case SB_PAIR_VERTEX_EDGE:
    *s = (SbDistance){.d = PETSC_MAX_REAL};
    try_edge(x, 0, 1, 2, 1, s);
    finish(NULL, NULL, 0, s);
    break;
  case SB_PAIR_VERTEX_VERTEX:
    SbSubtract(x, x + 3, r);
    *s = (SbDistance){.feature = kind, .mask = 3, .weight = {1, -1}, .n = {r[0], r[1], r[2]}};
    finish(NULL, NULL, 0, s);
    break;
  }
}

/* c_a of the file header. */
static void point_derivatives(const PetscReal x[], const SbDistance *s, PetscReal c[4][3])
{
  PetscReal t[2][3], q[2][3], normal[3];

  for (int a = 0; a < 4; a++)
    c[a][0] = c[a][1] = c[a][2] = 0;
  if (s->feature == SB_PAIR_VERTEX_EDGE) {
    int end[2];
    int n = 0;
    int npositive = 0;

    // the ends of the edge have weights of equal sign, the vertex of the opposite sign
    for (int a = 0; a < 4; a++)
      npositive += s->weight[a] > 0;
    for (int a = 0; a < 4; a++)
      if (npositive == 1 ? s->weight[a] < 0 : s->weight[a] > 0)
        end[n++] = a;
    SbSubtract(x + 3 * end[1], x + 3 * end[0], t[0]);
    for (int k = 0; k < 3; k++) {
      c[end[1]][k] = t[0][k] / SbDot3(t[0], t[0]);
      c[end[0]][k] = -c[end[1]][k];
    }
  } else if (s->feature != SB_PAIR_VERTEX_VERTEX) {
    const PetscBool face = (PetscBool)(s->feature == SB_PAIR_VERTEX_TRIANGLE);
    PetscReal nn;

    SbSubtract(x + 3, x + (face ? 6 : 0), t[0]);
    SbSubtract(x + (face ? 3 : 6), x + 9, t[1]);
    SbCross(t[0], t[1], normal);
    nn = SbDot3(normal, normal);
    SbCross(t[1], normal, q[0]);
    SbCross(normal, t[0], q[1]);
    for (int k = 0; k < 3; k++) {
      const PetscReal q0 = q[0][k] / nn;
      const PetscReal q1 = q[1][k] / nn;

      c[1][k] = face ? q0 + q1 : q0;
      c[face ? 2 : 0][k] = -q0;
      c[3][k] = -q1;
      if (!face)
        c[2][k] = q1;
    }
  }
}

void SbSymmetricProjectPSD(int n, PetscReal A[])
{
  PetscReal V[12 * 12], lambda[12], work[34 * 12]; /* of LAPACK: (block size + 2) n */
  PetscBLASInt m = n;
  PetscBLASInt nwork = 34 * 12;
  PetscBLASInt info;

  for (int k = 0; k < n * n; k++)
    V[k] = A[k];
  LAPACKsyev_("V", "U", &m, V, &m, lambda, work, &nwork, &info);
  if (info || lambda[0] >= 0)
    return;
  for (int i = 0; i < n; i++) {
    for (int j = 0; j <= i; j++) {
      PetscReal sum = 0;

      for (int k = 0; k < n; k++)
        sum += PetscMax(lambda[k], 0) * V[n * k + i] * V[n * k + j];
      A[n * i + j] = A[n * j + i] = sum;
    }
  }
}

void SbDistanceHessian(const PetscReal x[], const SbDistance *s, const PetscReal factor[2],
                       PetscBool clamp, PetscReal H[])
{
  static const PetscReal h[3][4] = {{.5, .5, -.5, -.5}, {.5, -.5, .5, -.5}, {.5, -.5, -.5, .5}};
  const PetscReal *n = s->n;
  const PetscReal *w = s->weight;
  const PetscReal a = factor[0];
  const PetscReal b = factor[1];
  const PetscReal size = PetscSqrtReal(w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3]);
  int least = PetscAbsReal(n[0]) < PetscAbsReal(n[1]) ? 0 : 1;
  PetscReal c[4][3], m[2][3], along[4][2], alpha[3], C[3][2], K[25], bend[2];

  // two directions m orthogonal to n; components of c_a along them
  if (!(PetscAbsReal(n[least]) < PetscAbsReal(n[2])))
    least = 2;
  point_derivatives(x, s, c);
  for (int k = 0; k < 3; k++)
    m[0][k] = (k == least) - n[least] * n[k];
  (void)SbNormalise(m[0]);
  SbCross(n, m[0], m[1]);
  for (int i = 0; i < 4; i++)
    for (int l = 0; l < 2; l++)
      along[i][l] = SbDot3(c[i], m[l]);
  for (int i = 0; i < 3; i++) {
    alpha[i] = h[i][0] * w[0] + h[i][1] * w[1] + h[i][2] * w[2] + h[i][3] * w[3];
    for (int l = 0; l < 2; l++)
      C[i][l] = h[i][0] * along[0][l] + h[i][1] * along[1][l] + h[i][2] * along[2][l] +
                h[i][3] * along[3][l];
  }

  // 5 x 5 matrix: n times the weights h, and m times w / |w|
  for (int i = 0; i < 3; i++) {
    for (int j = 0; j < 3; j++)
      K[5 * i + j] = a * alpha[i] * alpha[j] - b * s->d * (C[i][0] * C[j][0] + C[i][1] * C[j][1]);
    for (int l = 0; l < 2; l++)
      K[5 * i + 3 + l] = K[5 * (3 + l) + i] = -b * size * C[i][l];
  }
  K[18] = K[24] = s->feature <= SB_PAIR_VERTEX_EDGE ? b * size * size / s->d : 0;
  K[19] = K[23] = 0;
  if (s->feature == SB_PAIR_VERTEX_EDGE) {
    // remove the direction of the edge
    int end = 0;
    PetscReal ee;

    while (along[end][0] == 0 && along[end][1] == 0)
      end++;
    ee = along[end][0] * along[end][0] + along[end][1] * along[end][1];
    bend[0] = along[end][1];
    bend[1] = -along[end][0];
    K[19] = K[23] = K[18] * bend[0] * bend[1] / ee;
    K[24] *= bend[1] * bend[1] / ee;
    K[18] *= bend[0] * bend[0] / ee;
  }
  if (clamp)
    SbSymmetricProjectPSD(5, K);

  // expand to 3 x 3 blocks in the frame (n, m), rotated to global axes; none for vertices of zero
  // weight
  for (int i = 0; i < 4; i++) {
    for (int j = i; j < 4; j++) {
      const PetscReal f = w[i] * w[j] / (size * size);
      PetscReal G[3][3] = {{0}};
      PetscReal R[3][3];
      const PetscBool part = (PetscBool)(s->mask >> i & s->mask >> j & 1);

      for (int k = 0; k < 3 && part; k++) {
        for (int l = 0; l < 3; l++)
          G[0][0] += K[5 * k + l] * h[k][i] * h[l][j];
        for (int l = 0; l < 2; l++) {
          G[0][1 + l] += K[5 * k + 3 + l] * h[k][i] * w[j] / size;
          G[1 + l][0] += K[5 * k + 3 + l] * h[k][j] * w[i] / size;
        }
      }
      for (int k = 0; k < 4 && part; k++)
        G[1 + k / 2][1 + k % 2] = f * K[5 * (3 + k / 2) + 3 + k % 2];
      for (int p = 0; p < 3; p++)
        for (int q = 0; q < 3; q++)
          R[p][q] = n[p] * G[0][q] + m[0][p] * G[1][q] + m[1][p] * G[2][q];
      for (int p = 0; p < 3; p++) {
        for (int q = 0; q < 3; q++) {
          const PetscReal value = R[p][0] * n[q] + R[p][1] * m[0][q] + R[p][2] * m[1][q];

          H[12 * (3 * i + p) + 3 * j + q] = H[12 * (3 * j + q) + 3 * i + p] = value;
        }
      }
    }
  }
}

PetscReal SbEdgeCross(const PetscReal x[], PetscReal g[], PetscReal H[])
{
  PetscReal u[3], v[3], c[3], uu, vv, uv, d[2][3];

  SbSubtract(x + 3, x, u);
  SbSubtract(x + 9, x + 6, v);
  SbCross(u, v, c);

  // |u x v|^2 = (u . u) (v . v) - (u . v)^2: derivatives with respect to u and v, then to the
  // endpoints
  uu = SbDot3(u, u);
  vv = SbDot3(v, v);
  uv = SbDot3(u, v);
  for (int k = 0; k < 3; k++) {
    d[0][k] = 2 * (vv * u[k] - uv * v[k]);
    d[1][k] = 2 * (uu * v[k] - uv * u[k]);
  }
  for (int a = 0; g && a < 4; a++)
    for (int k = 0; k < 3; k++)
      g[3 * a + k] = (a % 2 ? 1 : -1) * d[a / 2][k];
  for (int a = 0; H && a < 4; a++) {
    const PetscReal *e = a / 2 ? v : u;
    const PetscReal *f = a / 2 ? u : v;
    const PetscReal ff = a / 2 ? uu : vv;

    for (int b = 0; b < 4; b++) {
      const PetscReal sign = a % 2 == b % 2 ? 1 : -1;

      for (int p = 0; p < 3; p++) {
        for (int q = 0; q < 3; q++) {
          const PetscReal dd = a / 2 != b / 2 ? 2 * e[p] * f[q] - f[p] * e[q] - (p == q) * uv
                                              : (p == q) * ff - f[p] * f[q];

          H[12 * (3 * a + p) + 3 * b + q] = sign * (2 * dd);
        }
      }
    }
  }
  return SbDot3(c, c);
}
