/*
  barrier.h - the response `barrier` of contact and collision (barrier.c).
*/
#pragma once
#include "sbbarrier.h"
#include "effect_impl.h"

/* What the type has read; all borrowed from the data of the type, which `destroy` frees. */
typedef struct {
  const SbEffectOn *on;
  SbObstacle obstacle;                                       /* NULL: bodies meet each other */
  void (*pose)(const void *data, PetscReal t, SbPose *pose); /* of the obstacle */
  PetscReal centre[3]; /* about which torques are, with the obstacle, m */
  PetscBool self;
  PetscReal friction;
  PetscErrorCode (*setup_obstacle)(SbEffect e, SbSpace space, void *data);
} SbBarrierScene;
#define SB_BARRIER_OPTIONS                                                                                   \
  {"barrier_width",                                                                                          \
   SB_OPTION_REAL,                                                                                           \
   1,                                                                                                        \
   "m",                                                                                                      \
   "0",                                                                                                      \
   "[0, inf)",                                                                                               \
   "response barrier: gap below which surfaces push each other; 0: a thousandth of the smallest body, at "   \
   "most half of its shortest edge"},                                                                        \
    {"barrier_pressure",                                                                                     \
     SB_OPTION_REAL,                                                                                         \
     1,                                                                                                      \
     "Pa",                                                                                                   \
     "0",                                                                                                    \
     "[0, inf)",                                                                                             \
     "response barrier: scale of the pressure; 0: a tenth of Young's modulus of the softer side"},           \
  {                                                                                                          \
    "verify", SB_OPTION_BOOL, 1, "", "no", "",                                                               \
      "response barrier: after each step, edges that go through triangles are searched for, and end the run" \
  }
/* Takes the effect over; e->data goes on as the type's own, behind it. Not collective. */
PetscErrorCode SbBarrierCreate(SbEffect e, const SbScope *scope, const SbBarrierScene *scene);
