/*
  contact.h - what all responses of the effect `contact` share (contact.c).
*/
#pragma once
#include "barrier.h"
#include "overlap.h"
#include "restitution.h"

typedef enum { AUTO, PROJECTED, MULTIPLIER, AUGMENTED, PENALTY, BARRIER } SbResponse;

/* Whether what touches is held exactly. */
static inline PetscBool SbResponseIsExact(SbResponse response)
{
  return (PetscBool)(response == PROJECTED || response == MULTIPLIER);
}

/* Coefficients of an effect, and how its friction settles in a step (friction.c). */
typedef struct {
  PetscReal mu, mu_kinetic;
  PetscBool exact;     /* what sticks has exact constraints; else springs */
  int updates;         /* within the step */
  PetscReal unsettled; /* largest error of friction after the last solve, as a part of the largest friction */
  PetscBool said;      /* that friction did not settle */
  PetscReal loss;      /* since the start, this rank, J */
} SbFriction;

/* Options of all responses. */
typedef struct {
  SbResponse response; /* not AUTO */
  PetscBool cut;       /* steps end where points come into contact */
  SbFriction friction;
  PetscReal stiffness, damping, restitution, separation_steps;
} SbContactOptions;

/* Nodes against an obstacle (contact_node.c): the table of operations, then the options of its own. Not collective. */
PetscErrorCode SbContactCreate_Node(SbEffect e);
PetscErrorCode SbContactOptions_Node(SbEffect e, const SbScope *scope, const SbContactOptions *o);
