/*
  contact.h - shared by all responses of the effect `contact` (contact.c).
*/
#pragma once
#include "barrier.h"
#include "overlap.h"
#include "restitution.h"

typedef enum { AUTO, PROJECTED, MULTIPLIER, AUGMENTED, PENALTY, BARRIER } SbResponse;

/* Whether constraints are exact. */
static inline PetscBool SbResponseIsExact(SbResponse response)
{
  return (PetscBool)(response == PROJECTED || response == MULTIPLIER);
}

/* Coefficients of friction of an effect, and convergence in a step (friction.c). */
typedef struct {
  PetscReal mu, mu_kinetic;
  PetscBool exact; /* sticking by exact constraints; else by springs */
  int updates;     /* number of updates within the step */
  PetscReal error; /* largest error of friction after the last solve, relative to the largest friction */
  PetscBool said;  /* the warning that friction did not converge was given */
  PetscReal loss;  /* dissipation since the start, this rank's, J */
} SbFriction;

/* Options of all responses. */
typedef struct {
  SbResponse response; /* not AUTO */
  PetscBool cut;       /* steps end at the first time of impact */
  SbFriction friction;
  PetscReal stiffness, damping, restitution, separation_steps;
} SbContactOptions;

/* Nodes against an obstacle (contact_node.c): the table of operations, then the options of its own. Not collective. */
PetscErrorCode SbContactCreate_Node(SbEffect e);
PetscErrorCode SbContactOptions_Node(SbEffect e, const SbScope *scope, const SbContactOptions *o);
