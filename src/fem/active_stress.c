/*
  Stress and tangent of fibres that contract, at a point of a cell (src/material/active.c).

  Laws: at F = 1 + H the strain of a fibre is E = f . H f + |H f|^2 / 2; linear: f . H f, and the
  stress is T f f^T, constant.
*/
#include "active.h"

SB_KERNEL void SbFibresStrain(PetscBool linear, const SbPack Q[restrict 9],
                              const SbPack F[restrict 9], SbFibrePoint *restrict x)
{
  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal f[3] = {Q[0][l], Q[3][l], Q[6][l]};
    PetscReal h[3];

    for (int i = 0; i < 3; i++) {
      h[i] = -f[i];
      for (int j = 0; j < 3; j++)
        h[i] += F[3 * i + j][l] * f[j];
      x->f[i][l] = f[i];
      x->v[i][l] = linear ? f[i] : f[i] + h[i];
    }
    x->E[l] = SbDot3(f, h) + (linear ? 0. : SbDot3(h, h) / 2.);
  }
}

const PetscReal *SbFibresAt(const SbRegion *region, PetscInt b, int q, const SbPack F[9],
                            SbFibrePoint *x)
{
  const struct _p_SbContraction *a = region->contraction;
  const PetscInt k = b - region->bstart;

  SbFibresStrain(region->material->linear, (const SbPack *)region->axes + 9 * k, F, x);
  SbActiveFactors(region->material->active, x->E, a->moving ? &a->rate[a->npoint * k + q] : NULL,
                  x->phi, x->G, x->c);
  return a->tension[k];
}

SB_KERNEL static void add_stress(const PetscReal *restrict T, const SbFibrePoint *restrict x,
                                 SbPack P[restrict 9])
{
  for (int k = 0; k < 9; k++)
    for (int l = 0; l < SB_BATCH; l++)
      P[k][l] += T[l] * x->G[l] * x->v[k / 3][l] * x->f[k % 3][l];
}

void SbActiveStress(const SbRegion *region, PetscInt b, int q, const SbPack F[9], SbPack P[9])
{
  SbFibrePoint x;
  const PetscReal *T = SbFibresAt(region, b, q, F, &x);

  add_stress(T, &x, P);
}

/* K_ab += W T (g_a . f) (g_b . f) (g I + c v v^T / l^2); filtered: without negative eigenvalues. */
SB_KERNEL static void add_blocks(const PetscReal *restrict T, const SbFibrePoint *restrict x,
                                 PetscBool filtered, const SbPack g[restrict 9], const SbPack W,
                                 SbPack K[restrict 10][9])
{
  SbPack s[4], B[9];

  for (int l = 0; l < SB_BATCH; l++) {
    const PetscReal c = filtered ? PetscMax(x->c[l], -x->G[l]) : x->c[l];
    const PetscReal square = PetscMax(1. + 2. * x->E[l], PETSC_MACHINE_EPSILON);

    s[0][l] = 0.;
    for (int a = 1; a < 4; a++) {
      s[a][l] = 0.;
      for (int j = 0; j < 3; j++)
        s[a][l] += g[3 * (a - 1) + j][l] * x->f[j][l];
      s[0][l] -= s[a][l];
    }
    for (int k = 0; k < 9; k++)
      B[k][l] =
        W[l] * T[l] * ((k % 4 ? 0. : x->G[l]) + c * x->v[k / 3][l] * x->v[k % 3][l] / square);
  }
  for (int p = 0; p < 10; p++)
    for (int k = 0; k < 9; k++)
      for (int l = 0; l < SB_BATCH; l++)
        K[p][k][l] += s[SbPairA[p]][l] * s[SbPairB[p]][l] * B[k][l];
}

void SbActiveBlocks(const SbRegion *region, const struct _p_SbMaterial *law, PetscInt b, int q,
                    const SbPack g[9], const SbPack W, const SbPack F[9], SbPack K[10][9])
{
  SbFibrePoint x;
  const PetscReal *T;

  if (law->linear)
    return;
  T = SbFibresAt(region, b, q, F, &x);
  add_blocks(T, &x, (PetscBool)(law->tangent != SB_TANGENT_EXACT), g, W, K);
}
