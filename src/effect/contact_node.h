/*
  contact_node.h - nodes against a rigid obstacle: shared by contact_node.c and friction.c.
*/
#pragma once
#include "contact.h"

/* Friction state of a node. */
typedef struct {
  PetscInt slide[2];       /* tangential constraints, -1: none */
  PetscBool slides;        /* slides in the solve; else it sticks */
  PetscBool slid;          /* slid in the last step */
  PetscBool crowded;       /* also constrained by other effects: sticks by springs while in contact */
  int flips;               /* changes of stick and slip, or reversals, within the step */
  PetscReal tangent[2][3]; /* tangents; the first one is the slip direction */
  PetscReal turning;       /* tangential stiffness normal to the slip direction, N/m */
  PetscReal stretch[3];    /* deflection of sticking springs at the start of the step, m */
  PetscReal force[3];      /* friction force on the node in the last solve, N */
  PetscReal pressing;      /* normal force of the solve before, N */
} SbFrictionState;

/* n . u = value, m, of a node with the displacement u. */
typedef struct {
  PetscReal n[3], value;
} Plane;

/* A node of the surface that this rank owns. */
struct _p_Touch {
  PetscInt node, cell, a; /* local node, a cell that has it, as its node a */
  PetscReal k;            /* stiffness of the springs, N/m */
  PetscBool on;           /* active; with springs: at the end of the last step */
  PetscBool was;          /* active at the end of the last step, without rebound */
  PetscBool idle;         /* its spring does not act before the first solve of the step */
  PetscReal gap0;         /* gap when the step began, m; with `time_of_impact yes` or restitution */
  int toggles, flips;     /* activations within the step; changes of facet while active */
  PetscInt along;         /* its constraint; -1: redundant, or inactive */
  Plane surface;          /* of the obstacle's facet at the last search, n outward */
  Plane plane;            /* on which it is constrained */
  PetscBool valley;       /* constrained on two facets during a solve  */
  PetscBool undecided;    /* another solve is needed for that */
  Plane other;            /* the second one */
  PetscInt other_along;   /* as along */
  PetscReal other_lambda; /* N */
  PetscReal rest;     /* gap it is constrained to: 0, minus the remaining overlap, or that of a rebound, m */
  PetscReal kept;     /* springs: the same at the end of the last step, m */
  PetscReal gap;      /* after the last solve, beyond `rest`, m */
  PetscReal approach; /* restitution: speed of approach, m/s; 0: no rebound */
  PetscReal stiff;    /* of the spring in this step with its damper, N/m */
  PetscReal before;   /* damper: force from the node's gap at the start of the step, N */
  PetscReal lambda;   /* multiplier of the last solve, N */
  PetscReal wrong;    /* constraints as springs: force at its position less that of the last solve, N */
  SbFrictionState friction;
  PetscReal start[3];   /* displacement with which it would stick, m */
  PetscReal now[3];     /* that of the last solve, m */
  PetscReal stretch[3]; /* of springs that stick, in the obstacle's rest frame, after the last step, m */
};

/* Friction (friction.c). Not collective but for Warn. Begin: a step; touches: active at the end of the last
   one. Enter: activates it: it sticks or slides by its motion without contact, which penetrates by `depth`
   (m). Direction: of the contact force. Constrain: adds its tangential constraints. Read: their forces after
   a solve, N being the normal force. */
void SbFrictionBegin(SbFrictionState *friction, PetscBool touches);
void SbFrictionEnter(const SbFriction *f, Touch *touch, PetscReal depth);
void SbFrictionDirection(const SbFriction *f, const Touch *touch, PetscReal push[3]);
PetscErrorCode SbFrictionConstrain(const SbFriction *f, SbSpace space, Touch *touch);
void SbFrictionRead(const SbFriction *f, SbSpace space, Touch *touch, PetscReal N);
/* Updates stick or slip of a node with the normal force N; returns the error of its friction, N. */
PetscReal SbFrictionUpdate(const SbFriction *f, Touch *touch, PetscReal N);
/* After all nodes: worst of these errors, largest normal force of all ranks, N; changed: too large. */
void SbFrictionJudge(SbFriction *f, PetscReal worst, PetscReal largest, PetscBool *changed);
/* Accepts a step for a node; presses: its normal force is positive. */
void SbFrictionAccept(const SbFriction *f, Touch *touch, PetscBool presses);
/* At the end of a step: warns once of friction that did not converge. Collective. */
PetscErrorCode SbFrictionWarn(SbFriction *f, const char effect[], SbSpace space, PetscReal t);
#define SB_CONTACT_STATE 23 /* numbers in a record of a node */
