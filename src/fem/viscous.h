/*
  viscous.h - what the history of viscoelastic cells (viscous.c) and their stresses
  (viscous_stress.c) share.
*/
#pragma once
#include "fem_impl.h"

/* Rows and columns of the six entries of a symmetric tensor, and how often each is in a product. */
static const int SbHistoryRow[6] = {0, 0, 0, 1, 1, 2};
static const int SbHistoryColumn[6] = {0, 1, 2, 1, 2, 2};
static const PetscReal SbHistoryOften[6] = {1., 2., 2., 1., 2., 1.};

#define SB_WIDTH 8 /* numbers of a point at most: S, theta, m */

/* The array of a point. */
SB_INLINE PetscInt SbHistoryPoint(const SbRegion *region, PetscInt b, int q)
{
  return region->history->npoint * (b - region->bstart) + q;
}

/* E of a law at F, or of `linear` the small strain. */
SB_INLINE void SbHistoryStrain(PetscBool linear, const PetscReal f[9], PetscReal E[6])
{
  for (int k = 0; k < 6; k++) {
    const int i = SbHistoryRow[k];
    const int j = SbHistoryColumn[k];
    PetscReal e = f[3 * i + j] + f[3 * j + i];

    if (!linear)
      e = f[i] * f[j] + f[3 + i] * f[3 + j] + f[6 + i] * f[6 + j];
    E[k] = 0.5 * (i == j ? (linear ? e - 2. : e - 1.) : e);
  }
}

/* S += lambda tr(E) 1 + 2 mu E */
SB_INLINE void SbHistoryAddHooke(PetscReal lambda, PetscReal mu, const PetscReal E[6],
                                 PetscReal S[6])
{
  const PetscReal p = lambda * (E[0] + E[3] + E[5]);

  for (int k = 0; k < 6; k++)
    S[k] += 2. * mu * E[k] + (SbHistoryRow[k] == SbHistoryColumn[k] ? p : 0.);
}
