/*
  friction.h - Coulomb friction of a node and an obstacle that touch, with exact responses and springs.
*/
#pragma once
#include "sbfem.h"

/* Coefficients of an effect, and how its friction settles in a step. */
typedef struct {
  PetscReal mu, mu_kinetic;
  PetscBool exact;     /* what sticks has exact constraints; else springs */
  int updates;         /* within the step */
  PetscReal unsettled; /* largest error of friction after the last solve, as a part of the largest friction */
  PetscBool said;      /* that friction did not settle */
  PetscReal loss;      /* since the start, this rank, J */
} SbFriction;

/* What friction knows of a pair. */
typedef struct {
  PetscInt slide[2]; /* rows of the space across the normal, -1: none */
  PetscBool slides;  /* in the solve; else it sticks */
  PetscBool slid;    /* in the last step */
  PetscBool crowded; /* other obstacles hold its node as well: it sticks by springs as long as it touches */
  int flips;         /* how often that or its direction has turned within the step */
  PetscReal tangent[2][3]; /* across the normal; the first one is where it slides to */
  PetscReal turning;       /* stiffness across where it slides to, N/m */
  PetscReal stretch[3];    /* of the springs that stick, at the start of the step, m */
  PetscReal drag[3];       /* force of friction on the point in the last solve, N */
  PetscReal pressing;      /* normal force of the solve before, N */
} SbFrictionState;

/* A pair as friction sees it for the length of a call; all borrowed. */
typedef struct {
  PetscInt node;           /* its global number */
  const PetscReal *normal; /* [3] */
  const PetscReal *start;  /* [3] displacement from which it slips in this step, m */
  PetscReal *now;          /* [3] displacement of the last solve, m */
  PetscReal k;             /* stiffness of springs, N/m */
  PetscBool rests;         /* other rows say what its normal's row does */
  uint8_t fixed;           /* bit c: component c of the node is prescribed */
  SbFrictionState *grip;
} SbFrictionPair;

/* What a pair begins a step with; touches: it did when the last one ended. Not collective. */
void SbFrictionBegin(SbFrictionState *grip, PetscBool touches);
/* A pair that touches from now on: it sticks or slides as its motion without touching says, by which it is `depth` (m) behind; p->now is that
   motion. */
void SbFrictionEnter(const SbFriction *f, const SbFrictionPair *p, PetscReal depth);
/* Direction that the normal force pushes along, and whether that is not the normal. */
void SbFrictionDirection(const SbFriction *f, const SbFrictionPair *p, PetscReal direction[3],
                         PetscBool *oblique);
/* Rows across the normal of a pair that touches; id: identities of both are id and id + 1, above those of all normals. Not
   collective. */
PetscErrorCode SbFrictionHold(const SbFriction *f, SbSpace space, const SbFrictionPair *p, PetscInt id);
/* What a solve made of them: p->now and the drag. N: normal force; along: the sum of the normal's row, m. */
void SbFrictionRead(const SbFriction *f, SbSpace space, const SbFrictionPair *p, PetscReal N,
                    PetscReal along);
/* Whether a pair sticks or slides from now on. Returns the error of its friction in the last solve, N. N: its normal force. */
PetscReal SbFrictionSettle(const SbFriction *f, const SbFrictionPair *p, PetscReal N);
/* After all pairs: worst of their errors on this rank and largest normal force of all ranks, N; changed: the solve was not right. */
void SbFrictionJudge(SbFriction *f, PetscReal worst, PetscReal largest, PetscBool *changed);
/* Ends a step for a pair; presses: its normal force is positive. */
void SbFrictionAccept(SbFriction *f, const SbFrictionPair *p, PetscBool presses);
/* Ends a step: says once that friction was taken as it was. Collective. */
PetscErrorCode SbFrictionWarn(SbFriction *f, const char effect[], SbSpace space, PetscReal t);
/* What a pair takes from step to step, for checkpoints: state[SB_FRICTION_STATE]. */
#define SB_FRICTION_STATE 9
void SbFrictionSave(const SbFrictionState *grip, PetscReal state[]);
void SbFrictionLoad(const PetscReal state[], SbFrictionState *grip);
