/*
  restitution.h - Newton's law of restitution for the impact of a point (src/model/restitution.c).
*/
#pragma once
#include "sbbase.h"

#define SB_RESTITUTION_EARLY 1e-6 /* of the path: near misses count as impacts */

/* Restitution of an effect. */
typedef struct {
  PetscReal e;    /* coefficient of restitution; 0: none */
  PetscReal left; /* factor on it in this step */
  PetscReal dt;   /* length of the step, s */
} SbRestitution;

/* Begins an attempt at a step. */
static inline void SbRestitutionBegin(SbRestitution *r, PetscReal dt)
{
  r->left = 1;
  r->dt = dt;
}

/* Whether a point at gap0 (m) would penetrate at the end of the step with this speed of approach (m/s). */
static inline PetscBool SbRestitutionApproaches(const SbRestitution *r, PetscReal gap0, PetscReal speed)
{
  return (PetscBool)(speed > 0 && r->dt * speed * (1 + SB_RESTITUTION_EARLY) >= gap0);
}

/* Gap at the end of the step to which a rebounding point is constrained, m; 0: no rebound. */
static inline PetscReal SbRestitutionGap(const SbRestitution *r, PetscReal gap0, PetscReal speed)
{
  return speed > 0 ? gap0 + r->dt * r->left * r->e * speed : 0;
}
