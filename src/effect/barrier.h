/*
  barrier.h - the response `barrier` of contact (barrier.c).
*/
#pragma once
#include "sbbarrier.h"
#include "effect_impl.h"

/* Columns of the history for each pair of bodies (pair_columns.c). */
typedef struct {
  PetscBool wanted;
  PetscInt fixed, nskin;         /* columns of the effect before them; bodies that have a surface here */
  PetscInt *slot;                /* [nbody] number among these bodies, or -1 */
  PetscInt *place;               /* [nskin][nskin] first column of a pair, the lower body first */
  const char **column;           /* [ncolumn] all of the effect */
  char (*text)[3 * SB_NAME_MAX]; /* names of the columns behind the fixed ones */
} SbPairs;
/* Names the columns, when they are wanted, behind those of e; takes_part[nbody]: has a surface here. Not collective. */
PetscErrorCode SbPairsSetUp(SbEffect e, SbMesh mesh, const PetscBool takes_part[], PetscBool self,
                            SbPairs *pairs);
/* values += what a pair of the bodies `first` and `second` does: force on the first, N. Not collective. */
void SbPairsAdd(const SbPairs *pairs, PetscInt first, PetscInt second, PetscReal normal_force,
                const PetscReal force[3], PetscReal values[]);
PetscErrorCode SbPairsFree(SbPairs *pairs);

/* What the type has read; all borrowed from the data of the type, which `destroy` frees. */
typedef struct {
  const SbEffectOn *on;
  SbObstacle obstacle;                                       /* NULL: bodies meet each other */
  void (*pose)(const void *data, PetscReal t, SbPose *pose); /* of the obstacle */
  PetscReal centre[3]; /* about which torques are, with the obstacle, m */
  PetscBool self;
  PetscReal friction, restitution;
  PetscBool pairs; /* columns for each pair of bodies */
  PetscErrorCode (*setup_obstacle)(SbEffect e, SbSpace space, void *data);
} SbBarrierScene;
/* Takes the effect over; e->data goes on as the type's own, behind it. Not collective. */
PetscErrorCode SbBarrierCreate(SbEffect e, const SbScope *scope, const SbBarrierScene *scene);
