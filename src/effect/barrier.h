/*
  barrier.h - the response `barrier` of contact (barrier.c).
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
/* Takes the effect over; e->data goes on as the type's own, behind it. Not collective. */
PetscErrorCode SbBarrierCreate(SbEffect e, const SbScope *scope, const SbBarrierScene *scene);
