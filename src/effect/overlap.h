/*
  overlap.h - overlap that is there when a step begins: how much of it is left when the step ends.

  It is not thrown out but taken back to 1/e in `recovery` whole steps. A step that was cut takes back less, so that what moves out moves no
  faster.
*/
#pragma once
#include "sbbase.h"

typedef struct {
  PetscReal recovery; /* part of a depth that is left after a whole step; 0: all overlap closes at once */
  PetscReal longest;  /* step so far, s */
  PetscReal left;     /* part of a depth that is left after this step */
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
