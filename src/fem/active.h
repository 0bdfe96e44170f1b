/*
  active.h - what the tensions of fibres that contract (active.c) and their stresses
  (active_stress.c) share.
*/
#pragma once
#include "fem_impl.h"
#include "sbkernel.h"

/* Fibres at a point: v = F f, linear: f; phi, G and c as SbActiveFactors(). */
typedef struct {
  SbPack f[3], v[3], E, phi, G, c;
} SbFibrePoint;

/* f, v and E of cells with the axes Q. */
void SbFibresStrain(PetscBool linear, const SbPack Q[9], const SbPack F[9], SbFibrePoint *x);
/* Fibres of cells of batch b at point q; returns their tensions, Pa. */
const PetscReal *SbFibresAt(const SbRegion *region, PetscInt b, int q, const SbPack F[9],
                            SbFibrePoint *x);
