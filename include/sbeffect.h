/*
  sbeffect.h - layer 3: what acts on the bodies beyond their own elasticity and inertia.

  An effect is one file in src/effect/. An operation left NULL means "nothing to do" and is never called: the model
  sorts the effects into one list per operation after set-up. An effect that the scenario does not name is never created.
*/
#pragma once
#include "sbfem.h"

typedef struct _p_SbEffect *SbEffect;

typedef struct {
  /* reads -effect_<name>_...; scope = {"effect", <type>, <name>} */
  PetscErrorCode (*setfromoptions)(SbEffect e, const SbScope *scope);
  /* finds its nodes, facets, cells; marks prescribed unknowns by SbSpaceFix(). Collective. */
  PetscErrorCode (*setup)(SbEffect e, SbSpace space);
  /* writes prescribed displacements at time t into space->fixed_value (rows from SbSpaceFixedIndex()). Not collective. */
  PetscErrorCode (*prescribe)(SbEffect e, SbSpace space, PetscReal t);
  /* once before each attempt at a step */
  PetscErrorCode (*prestep)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt);
  /* f[nnode][3] += external force, N; must be right on owned nodes without communication */
  PetscErrorCode (*force)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[]);
  /* A -= d force / d u (and shift_v d force / d v) by SbSpaceAddCellBlock() */
  PetscErrorCode (*tangent)(SbEffect e, SbSpace space, const SbStage *stage, Mat A);
  /* after a step was accepted */
  PetscErrorCode (*accept)(SbEffect e, SbSpace space, const SbStage *stage);
  /* numbers for the history: n values with the names given by `columns`; residual[nnode][3] is the unbalanced force, N,
     which on prescribed unknowns is the reaction. Values are this rank's part and are summed. */
  PetscErrorCode (*history)(SbEffect e, SbSpace space, const SbStage *stage, const PetscReal residual[], PetscReal values[]);
  PetscErrorCode (*destroy)(SbEffect e);
} SbEffectOps;

struct _p_SbEffect {
  char        name[SB_NAME_MAX];
  char        type[SB_NAME_MAX];
  SbEffectOps ops;
  PetscBool   linear;         /* force does not depend on u: the tangent stays constant. Default PETSC_TRUE */
  PetscBool   steady;         /* force does not depend on t either */
  PetscInt    ncolumn;        /* history columns */
  const char *column[8];      /* "force_x", ...; written as <name>_<column> */
  void       *data;
};

extern PetscFunctionList SbEffectList;
PetscErrorCode SbEffectRegister(const char *type, PetscErrorCode (*create)(SbEffect), PetscInt nrows, const SbOption rows[]);
/* type: -effect_<name>_type, by default the name itself. Unknown: error with the nearest types. */
PetscErrorCode SbEffectCreate(const char *name, SbEffect *e);
PetscErrorCode SbEffectDestroy(SbEffect *e);

/* Constructors, one per file in src/effect/. */
PetscErrorCode SbEffectRegister_Gravity(void);
PetscErrorCode SbEffectRegister_BodyForce(void);
PetscErrorCode SbEffectRegister_Traction(void);
PetscErrorCode SbEffectRegister_Pressure(void);
PetscErrorCode SbEffectRegister_PointForce(void);
PetscErrorCode SbEffectRegister_Support(void);
PetscErrorCode SbEffectRegister_Drive(void);
PetscErrorCode SbEffectRegister_Damping(void);
