/*
  Cells of P2: strains at the four points of SbRuleQuadratic, and the part of the energy that goes with the change of volume.

  A law is psi = psi_mu(F) + lambda/2 theta(F)^2 (SbMaterialOps.pressure). Taken at every point, theta would have to vanish at all of them
  near nu = 1/2, and the element locks. Here the energy of a cell is

    W = sum_q w_q V psi_mu(F_q) + V lambda/2 m^2,   m = (1/V) int theta dV:

  one condition per cell, a pressure that is constant in it (P2/P0; Simo, Taylor and Pister 1985 for J - 1). Force, tangent and stress follow from
  W. Where theta is J - 1, m is the exact change of the volume of the cell: det F is cubic. Otherwise m is that of the four points,
  which is exact for the linear law and St. Venant's and Kirchhoff's.

  Pressures of single cells may oscillate where the mesh is coarse and held all around; means over the cells around a vertex do not.

  Not handled: curved cells. Edges are straight at rest.
*/
#include "fem_impl.h"

void SbQuadraticGradients(const SbPack g[9], const SbPack U[30], PetscBool rate, SbPack F[4][9])
{
  for (int q = 0; q < 4; q++) {
    SbPack u[12];

    SbQuadraticAt(SbRuleQuadratic.L[q], U, u);
    if (rate)
      SbCellGradientRate(g, (const SbPack *)u, F[q]);
    else
      SbCellGradient(g, (const SbPack *)u, F[q]);
  }
}

void SbQuadraticVolume(const struct _p_SbMaterial *m, const SbPack g[9], const SbPack V, const SbPack U[30],
                       const SbPack F[4][9], SbPack pressure, SbPack b[30])
{
  const SbPointRule *rule = m->jacobian ? &SbRuleCubic : &SbRuleQuadratic;
  const PetscReal lambda = m->ops.volumetric_modulus(m);

  for (int l = 0; l < SB_BATCH; l++) pressure[l] = 0.;
  if (b) memset(b, 0, 30 * sizeof(SbPack));
  for (int q = 0; q < rule->n; q++) {
    SbPack u[12], here[9], D[9], p, W, f[12];
    const SbPack *at = F ? F[q] : NULL;

    if (m->jacobian) {
      SbQuadraticAt(rule->L[q], U, u);
      SbCellGradient(g, (const SbPack *)u, here);
      at = (const SbPack *)here;
    }
    if (m->linear || m->ops.frame || m->ops.spin) {
      // theta = R : F - 3, with its derivative at once
      m->ops.volumetric(m, at, D);
      for (int l = 0; l < SB_BATCH; l++) p[l] = 3. * lambda;
      for (int k = 0; k < 9; k++) {
        for (int l = 0; l < SB_BATCH; l++) p[l] -= lambda * D[k][l] * at[k][l];
      }
    } else {
      m->ops.pressure(m, at, p);
      if (b) m->ops.volumetric(m, at, D);
    }
    for (int l = 0; l < SB_BATCH; l++) pressure[l] -= rule->weight[q] * p[l];
    if (!b) continue;
    for (int l = 0; l < SB_BATCH; l++) W[l] = rule->weight[q] * V[l];
    SbCellForce(g, W, (const SbPack *)D, f);
    SbQuadraticAdd(rule->L[q], (const SbPack *)f, b);
  }
}

PetscInt SbBatchState(SbSpace s, const SbRegion *region, PetscInt b, const PetscReal x[], SbPack F[4][9],
                      SbPack P[4][9], SbPack psi[4], SbPack pressure[4])
{
  const SbMaterial m = region->pointwise;
  const SbPack *g = s->batch_g + 9 * b;
  const PetscInt n = region->quadratic ? 4 : 1;
  SbPack U[30], p;

  if (region->quadratic) {
    sb_gather_nodes(10, sb_quadratic_nodes(s, b), x, U);
    SbQuadraticGradients(g, (const SbPack *)U, PETSC_FALSE, F);
  } else {
    sb_gather_strain(s, region, b, x, U);
    SbCellGradient(g, (const SbPack *)U, F[0]);
  }
  for (PetscInt q = 0; q < n; q++) {
    if (P) m->ops.stress(m, (const SbPack *)F[q], P[q]);
    if (psi) m->ops.energy(m, (const SbPack *)F[q], psi[q]);
    if (pressure) m->ops.pressure(m, (const SbPack *)F[q], pressure[q]);
  }
  if (m == region->material) return n;

  /* what the mean adds */
  const PetscReal lambda = region->material->ops.volumetric_modulus(region->material);

  SbQuadraticVolume(region->material, g, s->batch_V[b], (const SbPack *)U, (const SbPack(*)[9])F, p, NULL);
  for (PetscInt q = 0; q < n; q++) {
    SbPack D[9];

    if (P) region->material->ops.volumetric(region->material, (const SbPack *)F[q], D);
    for (int k = 0; P && k < 9; k++) {
      for (int l = 0; l < SB_BATCH; l++) P[q][k][l] += p[l] * D[k][l];
    }
    for (int l = 0; l < SB_BATCH; l++) {
      if (psi) psi[q][l] += p[l] * p[l] / (2. * lambda);
      if (pressure) pressure[q][l] = -p[l];
    }
  }
  return n;
}
