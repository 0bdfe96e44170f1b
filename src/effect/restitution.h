/*
  restitution.h - Newton's law of restitution for one point that meets something within a step; told in src/model/restitution.c.
*/
#pragma once
#include "sbbase.h"

#define SB_RESTITUTION_EARLY 1e-6 /* of the way: who just does not arrive arrives, a flat base at once */

/* What the points of an effect have left of their speed. */
typedef struct {
  PetscReal e;    /* coefficient of restitution; 0: nothing bounces */
  PetscReal left; /* part of it that is left in this step */
  PetscReal dt;   /* length of the step, s */
} SbRestitution;

/* Begins an attempt at a step. */
static inline void SbRestitutionBegin(SbRestitution *r, PetscReal dt)
{
  r->left = 1;
  r->dt = dt;
}

/* Whether a point at gap0 (m) will be behind the other at the end of the step, with its speed towards it (m/s). */
static inline PetscBool SbRestitutionApproaches(const SbRestitution *r, PetscReal gap0, PetscReal speed)
{
  return (PetscBool)(speed > 0 && r->dt * speed * (1 + SB_RESTITUTION_EARLY) >= gap0);
}

/* Gap that it is constrained at when it is to be there: where it leaves to, m; 0: it does not bounce. */
static inline PetscReal SbRestitutionGap(const SbRestitution *r, PetscReal gap0, PetscReal speed)
{
  return speed > 0 ? gap0 + r->dt * r->left * r->e * speed : 0;
}
