/*
  volumetric.h - energies of the change of volume, K/2 theta^2 with theta a function of J = det F:

    simo_taylor   theta^2 = (J^2 - 1 - 2 ln J) / 2   convex, infinite at J = 0 (Simo, Taylor 1982)
    quadratic     theta   = J - 1                    finite at J = 0
    logarithmic   theta   = ln J                     infinite at J = 0, not convex beyond J = e

  All from SbVolumeOf(), without loss of digits near J = 1. No numbers for J <= 0, but for the
  dilatation of the quadratic one.
*/
#pragma once
#include "invariants.h"

typedef enum {
  SB_VOLUMETRIC_SIMO_TAYLOR,
  SB_VOLUMETRIC_QUADRATIC,
  SB_VOLUMETRIC_LOGARITHMIC
} SbVolumetric;

#define SB_VOLUMETRIC_CLOSE \
  0.05 /* |J - 1| up to which theta comes from its series: 12 terms are exact */

/* r = theta^2 / j^2 = 1 + j rest of simo_taylor, with j = J - 1. */
SB_INLINE PetscReal SbSimoTaylorSquare(const SbVolume *v, PetscReal *rest)
{
  const PetscReal j = v->j;
  PetscReal series = 0;

  for (int n = 14; n >= 3; n--)
    series = (n % 2 ? -1. : 1.) / n + j * series;
  if (PetscAbsReal(j) > SB_VOLUMETRIC_CLOSE) {
    const PetscReal r = (j + j * j / 2 - v->log) / (j * j);

    *rest = (r - 1) / j;
    return r;
  }
  *rest = series;
  return 1 + j * series;
}

/* theta of simo_taylor; t = J d theta/dJ = (2 + j) / (2 sqrt(r)) and u = J dt/dJ = (J^2 - t^2) /
   theta, from which j was divided out. */
SB_INLINE PetscReal SbSimoTaylor(const SbVolume *v, PetscReal *t, PetscReal *u)
{
  PetscReal rest;
  const PetscReal j = v->j;
  const PetscReal r = SbSimoTaylorSquare(v, &rest);
  const PetscReal root = PetscSqrtReal(r);

  *t = (2 + j) / (2 * root);
  *u = (4 + 3 * j + 4 * rest * v->J * v->J) / (4 * r * root);
  return v->J > 0 ? j * root : -INFINITY;
}

/* theta, t = J d theta/dJ, u = J dt/dJ. */
SB_INLINE PetscReal SbVolumetricDilatation(SbVolumetric kind, const SbVolume *v, PetscReal *t,
                                           PetscReal *u)
{
  if (kind == SB_VOLUMETRIC_QUADRATIC) {
    *t = *u = v->J;
    return v->j;
  }
  if (kind == SB_VOLUMETRIC_LOGARITHMIC) {
    *t = 1;
    *u = 0;
    return v->log;
  }
  return SbSimoTaylor(v, t, u);
}

/* U = theta^2/2, J > 0. */
SB_INLINE PetscReal SbVolumetricEnergy(SbVolumetric kind, const SbVolume *v)
{
  PetscReal rest;

  if (kind == SB_VOLUMETRIC_QUADRATIC)
    return v->j * v->j / 2;
  if (kind == SB_VOLUMETRIC_LOGARITHMIC)
    return v->log * v->log / 2;
  return v->j * v->j * SbSimoTaylorSquare(v, &rest) / 2;
}

/* J dU/dJ; next = J d(J dU/dJ)/dJ. */
SB_INLINE PetscReal SbVolumetricStress(SbVolumetric kind, const SbVolume *v, PetscReal *next)
{
  if (kind == SB_VOLUMETRIC_QUADRATIC) {
    *next = v->J * (v->j + v->J);
    return v->J * v->j;
  }
  if (kind == SB_VOLUMETRIC_LOGARITHMIC) {
    *next = 1;
    return v->log;
  }
  *next = v->J * v->J;
  return v->j * (2 + v->j) / 2;
}
