/*
  barrier.h - the response `barrier` of contact (barrier.c).
*/
#pragma once
#include "sbbarrier.h"
#include "effect_impl.h"

/* Columns of the history for each pair of bodies (pair_columns.c). */
typedef struct {
  PetscBool wanted;
  PetscInt fixed, nsurface; /* columns of the effect before those of pairs; bodies whose surface takes part */
  PetscInt *slot;           /* [nbody] number among these bodies, or -1 */
  PetscInt *place;          /* [nsurface][nsurface] first column of a pair, the lower body first */
  const char **column;      /* [ncolumn] all of the effect */
  char (*text)[3 * SB_NAME_MAX]; /* names of the columns behind the fixed ones */
} SbPairs;
/* Appends the columns of pairs, if wanted, to those of e; takes_part[nbody]: the body's surface takes part. Not collective. */
PetscErrorCode SbPairsSetUp(SbEffect e, SbMesh mesh, const PetscBool takes_part[], PetscBool self,
                            SbPairs *pairs);
/* Adds a contact pair of the bodies `first` and `second` to values[]: force on the first, N. Not collective. */
void SbPairsAdd(const SbPairs *pairs, PetscInt first, PetscInt second, PetscReal normal_force,
                const PetscReal force[3], PetscReal values[]);
PetscErrorCode SbPairsFree(SbPairs *pairs);

/* Options read by the type contact; all borrowed from its data, which `destroy` frees. */
typedef struct {
  const SbEffectOn *on;
  SbObstacle obstacle;                                       /* NULL: contact between bodies */
  void (*pose)(const void *data, PetscReal t, SbPose *pose); /* of the obstacle */
  PetscReal centre[3]; /* reference point of torques, moving with the obstacle, m */
  PetscBool self;
  PetscReal friction, restitution;
  PetscBool pairs; /* columns for each pair of bodies */
  PetscErrorCode (*setup_obstacle)(SbEffect e, SbSpace space, void *data);
} SbBarrierScene;
/* Makes e an effect of this response: replaces its operations, keeps e->data of the type beside its own. Not collective. */
PetscErrorCode SbBarrierCreate(SbEffect e, const SbScope *scope, const SbBarrierScene *scene);
