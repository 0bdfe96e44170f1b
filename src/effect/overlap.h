/*
  overlap.h - gradual resolution of penetration: fraction of the depth that remains at the end of a step.

  It decays to 1/e in `separation_steps` whole steps. A shorter step resolves less of it, at the same speed.
*/
#pragma once
#include "sbbase.h"

typedef struct {
  PetscReal recovery; /* factor on the depth in a whole step, exp(-1/separation_steps); 0: resolved at once */
  PetscReal longest;  /* step so far, s */
  PetscReal left;     /* factor on the depth in this step */
} SbOverlap;

/* steps: as the option says. */
static inline void SbOverlapSet(SbOverlap *o, PetscReal steps)
{
  *o = (SbOverlap){.recovery = steps > 1 ? PetscExpReal(-1 / steps) : 0};
}

static inline void SbOverlapBegin(SbOverlap *o, PetscReal dt)
{
  o->longest = PetscMax(o->longest, dt);
  o->left = o->recovery > 0 ? PetscPowReal(o->recovery, dt / o->longest) : 0;
}
