/*
  pair_energy.c - the potential of a contact pair and its derivatives.

  Barrier: the energy of a gap d below the width w, s = d / w, per area (Li et al., "Incremental
  potential contact", ACM TOG 39(4), 2020, in the physical form of ipc-toolkit):

    b = -k w (s - 1)^2 ln s,   b' = k (-2 (s - 1) ln s - (s - 1)^2 / s),
    b'' = k/w (-2 ln s - 2 (s - 1)/s - (s^2 - 1)/s^2)

  Spring: with the multiplier l and c = k area, the augmented Lagrangian of the constraint d >= w
  (Nocedal and Wright, Numerical Optimization, section 17.4), whose force is <l + c (w - d)>, <x> =
  max(x, 0):

    b = (<l + c (w - d)>^2 - l^2) / (2 c)

  A spring that is pressed together would leave its pair to collision detection, whose steps get
  ever shorter: below a part of the width it has a barrier as well.

  Nearly parallel edges a, b: the closest points are discontinuous. The energy of an edge pair is
  multiplied by (2 - y) y, y = c/e, c = |a x b|^2, where c < e (the same article, section 5);
  vertex-triangle pairs supply the rest. There e = 1e-3 |a|^2 |b|^2 at rest; here also e <= 2 |a|
  |b| ((d + r)^2 - r^2), with the radius r of an obstacle: crossing edges have their ends farther
  apart than the gap d, so vertex-triangle pairs are inactive; without it gaps fell to 1e-9 m, with
  tiny Newton steps (docs/reports/contact.md).

  What pairs share: where the closest point of a vertex is on a side or a corner of triangles, all
  pairs with these triangles are as near, and a vertex that slides from face to face crosses a ridge
  of energy, which pushes sideways. With -effect_X_weights once the lower features are taken off
  again (the inclusion and exclusion of Li et al., "Convergent incremental potential contact", arXiv
  2307.15908, 2023): over all triangles, the sum

    sum_triangles b(d) - sum_sides b(d) + sum_corners b(d)

  is b of the smallest distance where the part of the surface that is near is flat or convex: the
  features within a distance form an open disk, whose Euler characteristic is 1. Each triangle has
  its part of its sides and corners (SbContactSurface.share), so that a pair has the same vertices
  as before. Pairs of edges likewise: of an end, all but one of the edges there are taken off. What
  is not handled: pairs of edges that cross between flat surfaces, whose vertices hold them apart
  already, count all the same; how many there are depends on where the meshes lie.
*/
#include "pairs.h"

#define MOLLIFIED 1e-3 /* e / (|a|^2 |b|^2) */
#define NEAR 2.        /* bound of e / (|a| |b| ((d + r)^2 - r^2)) */

void SbBarrier(PetscReal d, PetscReal w, PetscReal k, PetscReal area, PetscReal b[3])
{
  const PetscReal s = d / w;

  b[0] = b[1] = b[2] = 0.;
  if (s >= 1.)
    return;
  if (s <= 0.) {
    b[0] = PETSC_INFINITY;
    return;
  }
  b[0] = -k * area * w * PetscSqr(s - 1.) * PetscLogReal(s);
  b[1] = k * area * (-2. * (s - 1.) * PetscLogReal(s) - PetscSqr(s - 1.) / s);
  b[2] = k * area / w * (-2. * PetscLogReal(s) - 2. * (s - 1.) / s - (s * s - 1.) / (s * s));
}

void SbPairLawEvaluate(const SbPairLaw *law, PetscReal d, PetscReal area, PetscReal b[3])
{
  const PetscReal c = law->stiffness * area;
  const PetscReal force = PetscMax(0., law->force + c * (law->width - d));

  if (!law->spring) {
    SbBarrier(d, law->width, law->stiffness, area, b);
    return;
  }
  b[0] = (PetscSqr(force) - PetscSqr(law->force)) / (2. * c);
  b[1] = -force;
  b[2] = force > 0. ? c : 0.;
  if (d < SB_GUARD * law->width && law->guard > 0.) {
    PetscReal near[3];

    SbBarrier(d, SB_GUARD * law->width, law->guard, area, near);
    for (int k = 0; k < 3; k++)
      b[k] += near[k];
  }
}

/* The factor p on the energy of edges with c, d, r as above and rest = |a|^2 |b|^2, and its
   derivatives: f = (p, p_d, p_c, p_dd, p_dc, p_cc). Unchanged where p = 1. */
static void mollify(PetscReal c, PetscReal rest, PetscReal d, PetscReal r, PetscReal f[6])
{
  const PetscReal square = d * (d + 2. * r);
  const PetscReal near = NEAR * PetscSqrtReal(rest) * square;
  const PetscReal slope = 2. * (d + r) / square;
  const PetscReal e = PetscMin(MOLLIFIED * rest, near);
  const PetscReal y = c / e;

  if (y >= 1.)
    return;
  f[0] = (2. - y) * y;
  f[1] = f[3] = f[4] = 0.;
  f[2] = 2. * (1. - y) / e;
  f[5] = -2. / (e * e);
  if (e < near)
    return;
  f[1] = -2. * y * (1. - y) * slope;
  f[3] = y * (4. * (1. - y) * (slope * slope - 1. / square) - 2. * y * slope * slope);
  f[4] = -2. * (1. - 2. * y) * slope / e;
}

/* A feature of a pair whose energy counts with a factor: its distance by the pair's vertices. */
typedef struct {
  PetscReal factor;
  SbDistance at;
} Part;
#define PARTS 8

/* The lower features of a pair at at[4][3] that are nearer than the width; returns how many. */
static int find_parts(const SbContactPair *pair, PetscReal width, PetscReal radius,
                      const PetscReal at[12], Part part[PARTS])
{
  /* a vertex, and an edge or a vertex; numbers of `share`, the second -1: none */
  static const int of_triangle[6][5] = {{0, 1, 2, 0, -1},  {0, 2, 3, 1, -1},  {0, 3, 1, 2, -1},
                                        {0, 1, -1, 3, -1}, {0, 2, -1, 4, -1}, {0, 3, -1, 5, -1}};
  static const int of_edges[8][5] = {{0, 2, 3, 0, -1}, {1, 2, 3, 1, -1}, {2, 0, 1, 2, -1},
                                     {3, 0, 1, 3, -1}, {0, 2, -1, 0, 2}, {0, 3, -1, 0, 3},
                                     {1, 2, -1, 1, 2}, {1, 3, -1, 1, 3}};
  const PetscBool edges = (PetscBool)(pair->kind == SB_PAIR_EDGE_EDGE);
  int n = 0;

  for (int i = 0; i < (edges ? 8 : 6); i++) {
    const int *of = edges ? of_edges[i] : of_triangle[i];
    const PetscBool edge = (PetscBool)(of[2] >= 0);
    PetscReal factor = pair->share[of[3]] * (of[4] < 0 ? 1. : pair->share[of[4]]);
    PetscReal x[9];
    SbDistance g;

    if (factor == 0.)
      continue;
    if (edge)
      factor = -factor;
    for (int k = 0; k < (edge ? 9 : 6); k++)
      x[k] = at[3 * of[k / 3] + k % 3];
    SbDistanceFind(edge ? SB_PAIR_VERTEX_EDGE : SB_PAIR_VERTEX_VERTEX, x, &g);
    if (g.d - radius >= width)
      continue;
    part[n].factor = factor;
    part[n].at = (SbDistance){.feature = g.feature, .d = g.d, .n = {g.n[0], g.n[1], g.n[2]}};
    for (int k = 0; k < (edge ? 3 : 2); k++) {
      part[n].at.weight[of[k]] = g.weight[k];
      part[n].at.mask |= (g.mask >> k & 1) << of[k];
    }
    n++;
  }
  return n;
}

/* |a|^2 |b|^2 of the edges of a pair at rest. */
static PetscReal lengths_at_rest(SbContactSurface m, const SbContactPair *pair)
{
  PetscReal rest = 1.;

  for (int k = 0; k < 4; k += 2)
    rest *= SbDistance2(m->X + 3 * pair->v[k], m->X + 3 * pair->v[k + 1]);
  return rest;
}

PetscBool SbPairIsMollified(SbContactSurface m, const SbContactPair *pair, PetscReal gap,
                            const SbDistance *g, const PetscReal x[])
{
  PetscReal at[12];
  PetscReal f[6] = {1.};

  if (pair->kind != SB_PAIR_EDGE_EDGE)
    return PETSC_FALSE;
  for (int k = 0; k < 12; k++)
    at[k] = x[3 * pair->v[k / 3] + k % 3];
  mollify(SbEdgeCross(at, NULL, NULL), lengths_at_rest(m, pair), gap, g->d - gap, f);
  return (PetscBool)(f[0] < 1.);
}

/* The energy p S, S = sum of f b(d) over the pair and its parts, p the factor of mollify(). */
static void sum_parts(SbContactSurface m, const SbContactPair *pair, const SbPairLaw *law,
                      PetscReal gap, const SbDistance *g, const PetscReal at[12], int n,
                      const Part part[], PetscReal *energy, PetscReal gradient[12], PetscBool clamp,
                      PetscReal H[144])
{
  PetscReal f[6] = {1.};
  PetscReal sum = 0.;
  PetscReal slope[12] = {0.};
  PetscReal across[12] = {0.};
  PetscReal p[12], C[144], D[144], nearer[12];

  /* S and its derivatives */
  for (int k = 0; k < 144 && H; k++)
    H[k] = 0.;
  for (int i = -1; i < n; i++) {
    const SbDistance *d = i < 0 ? g : &part[i].at;
    const PetscReal factor = i < 0 ? 1. : part[i].factor;
    PetscReal b[3];

    SbPairLawEvaluate(law, d->d - (g->d - gap), factor * pair->area, b);
    sum += b[0];
    for (int k = 0; k < 12; k++)
      slope[k] += b[1] * d->weight[k / 3] * d->n[k % 3];
    if (H) {
      const PetscReal factors[2] = {b[2], b[1]};

      SbDistanceHessian(at, d, factors, PETSC_FALSE, D);
      for (int k = 0; k < 144; k++)
        H[k] += D[k];
    }
  }

  /* p S: its derivatives by d and c = |a x b|^2 */
  if (pair->kind == SB_PAIR_EDGE_EDGE)
    mollify(SbEdgeCross(at, across, H ? C : NULL), lengths_at_rest(m, pair), gap, g->d - gap, f);
  *energy = f[0] * sum;
  for (int k = 0; k < 12; k++) {
    nearer[k] = g->weight[k / 3] * g->n[k % 3];
    p[k] = f[1] * nearer[k] + f[2] * across[k];
    gradient[k] = f[0] * slope[k] + p[k] * sum;
  }
  if (H && f[0] < 1.) {
    const PetscReal factors[2] = {f[3], f[1]};

    SbDistanceHessian(at, g, factors, PETSC_FALSE, D);
    for (int i = 0; i < 12; i++)
      for (int j = 0; j < 12; j++)
        H[12 * i + j] = f[0] * H[12 * i + j] + p[i] * slope[j] + slope[i] * p[j] +
                        sum * (D[12 * i + j] + f[2] * C[12 * i + j] + f[5] * across[i] * across[j] +
                               f[4] * (nearer[i] * across[j] + across[i] * nearer[j]));
  }
  if (H && clamp)
    SbSymmetricProjectPSD(12, H);
}

void SbPairEnergy(SbContactSurface m, const SbContactPair *pair, const SbPairLaw *law,
                  PetscReal gap, const SbDistance *g, const PetscReal x[], PetscReal *energy,
                  PetscReal gradient[12], PetscBool clamp, PetscReal H[144])
{
  PetscReal b[3], at[12], across[12], C[144];
  PetscReal f[6] = {1.};

  SbPairLawEvaluate(law, gap, pair->area, b);
  for (int k = 0; k < 12; k++) {
    at[k] = x[3 * pair->v[k / 3] + k % 3];
    gradient[k] = g->weight[k / 3] * g->n[k % 3];
  }

  /* a half-space has no curvature; that of a bowl is positive */
  if (pair->side) {
    *energy = b[0];
    for (int i = 0; i < 12 && H; i++) {
      for (int j = 0; j < 12; j++) {
        H[12 * i + j] = b[2] * gradient[i] * gradient[j];
        if (m->side == SB_SIDE_BOWL && i < 3 && j < 3)
          H[12 * i + j] -= b[1] / (m->radius - gap) * ((i == j) - g->n[i] * g->n[j]);
      }
    }
    for (int k = 0; k < 12; k++)
      gradient[k] *= b[1];
    return;
  }

  if (!law->spring) {
    Part part[PARTS];
    const int n = find_parts(pair, law->width, g->d - gap, at, part);

    if (n) {
      sum_parts(m, pair, law, gap, g, at, n, part, energy, gradient, clamp, H);
      return;
    }
  }

  /* nearly parallel edges: the factor of mollify() */
  if (pair->kind == SB_PAIR_EDGE_EDGE)
    mollify(SbEdgeCross(at, across, H ? C : NULL), lengths_at_rest(m, pair), gap, g->d - gap, f);
  *energy = f[0] * b[0];

  /* E_dd dd dd + E_d d2d + E_cc dc dc + E_c d2c + E_dc (dd dc + dc dd) of E(d, c), or its positive
     part */
  if (H) {
    const PetscReal factor[2] = {f[0] * b[2] + 2. * f[1] * b[1] + f[3] * b[0],
                                 f[0] * b[1] + f[1] * b[0]};

    SbDistanceHessian(at, g, factor, (PetscBool)(clamp && f[0] == 1.), H);
    if (f[0] < 1.) {
      for (int i = 0; i < 12; i++) {
        for (int j = 0; j < 12; j++)
          H[12 * i + j] +=
            b[0] * (f[5] * across[i] * across[j] + f[2] * C[12 * i + j]) +
            (f[2] * b[1] + f[4] * b[0]) * (across[i] * gradient[j] + gradient[i] * across[j]);
      }
      if (clamp)
        SbSymmetricProjectPSD(12, H);
    }
  }
  for (int k = 0; k < 12; k++)
    gradient[k] =
      (f[0] * b[1] + f[1] * b[0]) * gradient[k] + (f[0] < 1. ? f[2] * b[0] * across[k] : 0.);
}
