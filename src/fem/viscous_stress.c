/*
  Stress, energy and tangent of a viscoelastic material at a point: those of the law of the step,
  and what is constant in it (viscous.c).
*/
#include "viscous.h"

/* T and what viscosities add to it at F. */
SB_INLINE void stress_at(const SbRegion *region, const SbPack dead[], const SbPack F[9], int l,
                         PetscReal f[9], PetscReal S[6])
{
  const PetscReal *hooke = region->history->hooke;
  PetscReal E[6];

  SbPackGet(9, F, l, f);
  SbPackGet(6, dead, l, S);
  if (hooke[0] == 0. && hooke[1] == 0.)
    return;
  SbHistoryStrain(region->material->linear, f, E);
  SbHistoryAddHooke(hooke[0], hooke[1], E, S);
}

SB_KERNEL static void add_stress(const SbRegion *region, const SbPack dead[],
                                 const SbPack F[restrict 9], SbPack P[restrict 9])
{
  const PetscBool linear = region->material->linear;

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], S[6];

    stress_at(region, dead, F, l, f, S);
    const PetscReal full[9] = {S[0], S[1], S[2], S[1], S[3], S[4], S[2], S[4], S[5]};
    for (int k = 0; k < 9; k++)
      P[k][l] += linear ? full[k]
                        : f[3 * (k / 3)] * full[k % 3] + f[3 * (k / 3) + 1] * full[3 + k % 3] +
                            f[3 * (k / 3) + 2] * full[6 + k % 3];
  }
}

void SbViscousStress(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                     const SbPack F[9], SbPack P[9])
{
  const struct _p_SbStressHistory *h = region->history;
  const SbPack *dead = (const SbPack *)h->dead + h->width * SbHistoryPoint(region, b, q);
  const PetscReal scale = region->material->viscous->scale;
  SbPack D[9];

  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      P[k][l] *= scale;
  if (!h->acting)
    return;
  add_stress(region, dead, F, P);
  if (!h->pressures)
    return;
  law->ops.dilatation_gradient(law, F, D);
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      P[k][l] += dead[6][l] * D[k][l];
}

void SbViscousEnergy(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                     const SbPack F[9], SbPack psi)
{
  const struct _p_SbStressHistory *h = region->history;
  const SbViscous v = region->material->viscous;
  const SbPack *dead = (const SbPack *)h->dead + h->width * SbHistoryPoint(region, b, q);
  SbPack theta = {0};

  /* at the end of a step what is stored in equilibrium */
  if (v->elapsed == 0. || !h->acting) {
    if (!h->mean) {
      struct _p_SbMaterial own = *v->relaxed;

      own.axes = law->axes;
      own.ops.energy(&own, F, psi);
    }
    for (int l = 0; l < SB_BATCH; l++)
      psi[l] *= v->relaxed_scale;
    return;
  }
  if (h->pressures)
    law->ops.dilatation(law, F, theta);
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], E[6], S[6], all[6];

    SbPackGet(6, dead, l, S);
    stress_at(region, dead, F, l, f, all);
    SbHistoryStrain(region->material->linear, f, E);
    psi[l] = v->scale * psi[l] + dead[6][l] * theta[l];

    /* T : E, and half of what viscosities add */
    for (int k = 0; k < 6; k++)
      psi[l] += SbHistoryOften[k] * 0.5 * (S[k] + all[k]) * E[k];
  }
}

void SbViscousPressure(const SbRegion *region, PetscInt b, int q, SbPack p)
{
  const struct _p_SbStressHistory *h = region->history;
  const PetscReal *constant = h->dead[h->width * SbHistoryPoint(region, b, q) + 6];

  for (int l = 0; l < SB_BATCH; l++)
    p[l] = region->material->viscous->scale * p[l] - (h->acting ? constant[l] : 0.);
}

void SbViscousMean(const SbRegion *region, PetscInt b, PetscBool energy, PetscReal *factor,
                   const PetscReal **constant)
{
  static const SbPack none = {0};
  const struct _p_SbStressHistory *h = region->history;
  const SbViscous v = region->material->viscous;
  const PetscBool relaxed = (PetscBool)(!h->acting || (energy && v->elapsed == 0.));
  const PetscReal points = SbMaterialVolumetricModulus(region->pointwise);
  const PetscReal lambda = SbMaterialVolumetricModulus(relaxed ? v->relaxed : v->step);

  *factor = (relaxed ? v->relaxed_scale : v->scale) * (lambda - points) /
            SbMaterialMeanModulus(region->material);
  *constant = relaxed ? none : h->dead[h->width * SbHistoryPoint(region, b, 0) + 7];
}

SB_KERNEL static void add_blocks(const SbRegion *region, const SbPack stress[], PetscBool geometric,
                                 const SbPack g[restrict 9], const SbPack W,
                                 const SbPack F[restrict 9], SbPack K[restrict 10][9])
{
  const PetscReal *hooke = region->history->hooke;
  const PetscBool linear = region->material->linear;
  const PetscBool viscosity = (PetscBool)(hooke[0] != 0. || hooke[1] != 0.);

  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], S[6], G[4][3], A[4][3], h[4][3], B[9];

    SbPackGet(9, F, l, f);
    SbPackGet(6, stress, l, S);
    for (int k = 0; linear && k < 9; k++)
      f[k] = k % 4 ? 0. : 1.;
    const PetscReal full[9] = {S[0], S[1], S[2], S[1], S[3], S[4], S[2], S[4], S[5]};
    SbMatMulTranspose(f, f, B);
    for (int j = 0; j < 3; j++) {
      G[1][j] = g[j][l];
      G[2][j] = g[3 + j][l];
      G[3][j] = g[6 + j][l];
      G[0][j] = -(G[1][j] + G[2][j] + G[3][j]);
    }
    for (int a = 0; a < 4; a++) {
      for (int j = 0; j < 3; j++) {
        A[a][j] = W[l] * SbDot3(full + 3 * j, G[a]);
        h[a][j] = SbDot3(f + 3 * j, G[a]);
      }
    }
    for (int p = 0; p < 10; p++) {
      const int a = SbPairA[p];
      const int b = SbPairB[p];
      const PetscReal spring = geometric ? SbDot3(A[a], G[b]) : 0.;
      const PetscReal dot = W[l] * hooke[1] * SbDot3(G[a], G[b]);

      K[p][0][l] += spring;
      K[p][4][l] += spring;
      K[p][8][l] += spring;
      for (int e = 0; viscosity && e < 9; e++)
        K[p][e][l] += dot * B[e] + W[l] * (hooke[1] * h[b][e / 3] * h[a][e % 3] +
                                           hooke[0] * h[a][e / 3] * h[b][e % 3]);
    }
  }
}

void SbViscousBlocks(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                     const SbPack g[9], const SbPack W, const SbPack F[9], SbPack K[10][9])
{
  const struct _p_SbStressHistory *h = region->history;
  const SbPack *dead = (const SbPack *)h->dead + h->width * SbHistoryPoint(region, b, q);
  SbPack S[6], s[3], V[9];

  if (!h->acting)
    return;
  for (int l = 0; l < SB_BATCH; l++) {
    PetscReal f[9], one[6];

    stress_at(region, dead, F, l, f, one);
    SbPackPut(6, one, l, S);
  }

  /* filtered: without the negative eigenvalues of the stress */
  if (law->tangent == SB_TANGENT_EXACT_SPD && !law->linear) {
    SbSymEig((const SbPack *)S, s, V);
    for (int k = 0; k < 6; k++) {
      for (int l = 0; l < SB_BATCH; l++) {
        S[k][l] = 0.;
        for (int j = 0; j < 3; j++)
          S[k][l] += PetscMax(s[j][l], 0.) * V[3 * SbHistoryRow[k] + j][l] *
                     V[3 * SbHistoryColumn[k] + j][l];
      }
    }
  }
  add_blocks(region, (const SbPack *)S, (PetscBool)(!law->linear && !law->ops.frame), g, W, F, K);
}
