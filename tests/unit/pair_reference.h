/*
  pair_reference.h - reference distances of vertices, edges and triangles by enumeration of all
  features, in extended precision; random pairs.
*/
#pragma once
#include <sbgeometry.h>
#include "test.h"

static unsigned pair_state = 1;

/* Uniform in [-1, 1]. */
static inline PetscReal pair_random(void)
{
  return test_random(&pair_state);
}

static inline int pair_vertices(SbPairKind kind)
{
  return kind == SB_PAIR_VERTEX_VERTEX ? 2 : kind == SB_PAIR_VERTEX_EDGE ? 3 : 4;
}

static inline int pair_first(SbPairKind kind)
{
  return kind == SB_PAIR_EDGE_EDGE ? 2 : 1;
}

/* Solves A z = b by elimination with full pivots; false when A is singular. */
static inline int pair_solve(int n, long double A[3][3], long double b[3], long double z[3])
{
  int column[3] = {0, 1, 2};
  long double size = 0;

  for (int i = 0; i < n; i++)
    size = fmaxl(size, A[i][i]);
  for (int k = 0; k < n; k++) {
    int p = k;
    int q = k;
    long double keep;

    for (int i = k; i < n; i++) {
      for (int j = k; j < n; j++) {
        if (fabsl(A[i][j]) > fabsl(A[p][q])) {
          p = i;
          q = j;
        }
      }
    }
    if (!(fabsl(A[p][q]) > 1e-17L * size))
      return 0;
    for (int j = 0; j < n; j++) {
      keep = A[k][j];
      A[k][j] = A[p][j];
      A[p][j] = keep;
    }
    keep = b[k];
    b[k] = b[p];
    b[p] = keep;
    for (int i = 0; i < n; i++) {
      keep = A[i][k];
      A[i][k] = A[i][q];
      A[i][q] = keep;
    }
    p = column[k];
    column[k] = column[q];
    column[q] = p;
    for (int i = k + 1; i < n; i++) {
      const long double f = A[i][k] / A[k][k];

      for (int j = k; j < n; j++)
        A[i][j] -= f * A[k][j];
      b[i] -= f * b[k];
    }
  }
  for (int k = n - 1; k >= 0; k--) {
    long double sum = b[k];

    for (int j = k + 1; j < n; j++)
      sum -= A[k][j] * z[column[j]];
    z[column[k]] = sum / A[k][k];
  }
  return 1;
}

/* The least distance over all features of both sides whose closest points are inside them;
   x[4][3]. */
static inline long double pair_distance(SbPairKind kind, const long double x[])
{
  const int n = pair_vertices(kind);
  const int first = pair_first(kind);
  long double least = HUGE_VALL;

  for (int mask = 1; mask < 1 << n; mask++) {
    int base[2] = {-1, -1};
    int from[3], to[3];
    int m = 0;
    int inside = 1;
    long double A[3][3], b[3];
    long double z[3] = {0, 0, 0};
    long double w[4] = {0, 0, 0, 0};
    long double d2 = 0;
    long double r[3];

    for (int a = 0; a < n; a++) {
      const int side = a >= first;

      if (!(mask >> a & 1))
        continue;
      if (base[side] < 0)
        base[side] = a;
      else if (m < 3) {
        from[m] = base[side];
        to[m++] = a;
      }
    }
    if (base[0] < 0 || base[1] < 0)
      continue;
    for (int k = 0; k < 3; k++)
      r[k] = x[3 * base[0] + k] - x[3 * base[1] + k];
    for (int i = 0; i < m; i++) {
      const int sign = to[i] < first ? 1 : -1;

      b[i] = 0;
      for (int k = 0; k < 3; k++)
        b[i] -= sign * (x[3 * to[i] + k] - x[3 * from[i] + k]) * r[k];
      for (int j = 0; j < m; j++) {
        A[i][j] = 0;
        for (int k = 0; k < 3; k++)
          A[i][j] += sign * (x[3 * to[i] + k] - x[3 * from[i] + k]) * (to[j] < first ? 1 : -1) *
                     (x[3 * to[j] + k] - x[3 * from[j] + k]);
      }
    }
    if (!pair_solve(m, A, b, z))
      continue;
    w[base[0]] = w[base[1]] = 1;
    for (int i = 0; i < m; i++) {
      w[to[i]] = z[i];
      w[from[i]] -= z[i];
    }
    for (int a = 0; a < n; a++)
      inside = inside && w[a] >= 0;
    if (!inside)
      continue;
    for (int k = 0; k < 3; k++) {
      long double c = r[k];

      for (int i = 0; i < m; i++)
        c += z[i] * (to[i] < first ? 1 : -1) * (x[3 * to[i] + k] - x[3 * from[i] + k]);
      d2 += c * c;
    }
    least = fminl(least, sqrtl(d2));
  }
  return least;
}
