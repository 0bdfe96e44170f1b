/*
  contact.h - the effect `contact` (contact.c): shared by responses of nodes (contact_node.c) and of surfaces.
*/
#pragma once
#include "effect_impl.h"
#include "sbcontact.h"

typedef enum { AUTO, PROJECTED, MULTIPLIER, AUGMENTED, PENALTY, BARRIER } SbResponse;

/* Coefficients of friction of an effect, and convergence in a step (friction.c). */
typedef struct {
  PetscReal mu, mu_kinetic;
  PetscBool exact; /* sticking by exact constraints; else by springs */
  int updates;     /* number of updates within the step */
  PetscReal error; /* largest error of friction after the last solve, relative to the largest friction */
  PetscBool said;  /* the warning that friction did not converge was given */
} SbFriction;

/* Gradual resolution of penetration: its depth falls to 1/e in `separation_steps` whole steps; a shorter step
   resolves less of it, at the same speed. */
typedef struct {
  PetscReal recovery; /* factor on the depth in a whole step, exp(-1/separation_steps); 0: resolved at once */
  PetscReal longest;  /* step so far, s */
  PetscReal left;     /* factor on the depth in this step */
} SbOverlap;

static inline void SbOverlapBegin(SbOverlap *o, PetscReal dt)
{
  o->longest = PetscMax(o->longest, dt);
  o->left = o->recovery > 0 ? PetscPowReal(o->recovery, dt / o->longest) : 0;
}

/* Newton's law of restitution for the impact of a point (src/model/restitution.c). */
typedef struct {
  PetscReal e;    /* coefficient of restitution; 0: none */
  PetscReal left; /* factor on it in this step */
  PetscReal dt;   /* length of the step, s */
} SbRestitution;

/* Gap at the end of the step to which a rebounding point is constrained, m; 0: no rebound. */
static inline PetscReal SbRestitutionGap(const SbRestitution *r, PetscReal gap0, PetscReal speed)
{
  return speed > 0 ? gap0 + r->dt * r->left * r->e * speed : 0;
}

typedef struct _p_Touch Touch; /* contact_node.h */

typedef struct {
  SbResponse response;    /* not AUTO */
  SbObstacle obstacle;    /* NULL: contact between bodies */
  PetscReal scale, at[3]; /* of the file of a mesh */
  SbPath path;            /* of the obstacle; torques are about the point of its axis, which moves with it */
  PetscBool self, pairs;  /* between bodies: self-contact; columns for each pair of bodies */
  SbFriction friction;
  SbOverlap overlap;
  SbRestitution bounce;

  /* nodes against an obstacle */
  PetscReal stiffness, damping; /* s */
  PetscBool held;               /* active nodes are constrained; else force() acts on them */
  PetscBool facets;             /* the obstacle is a mesh */
  PetscInt n;
  Touch *touch;     /* [n] */
  PetscReal size;   /* of the bodies, m */
  PetscBool cut;    /* steps end at the first time of impact */
  PetscBool first;  /* the step has not been solved yet */
  PetscReal impact; /* fraction of the step at the first time of impact, 1: none */
  SbPose to;        /* at the end of the step */
} Contact;

/* Whether active nodes are constrained exactly. */
static inline PetscBool exact(const Contact *c)
{
  return (PetscBool)(c->response == PROJECTED || c->response == MULTIPLIER);
}

/* The obstacle's pose at time t. */
void SbContactPose(const Contact *c, PetscReal t, SbPose *pose);
/* Reads the obstacle's file, if it is a mesh, and adds to the effect's note. Collective. */
PetscErrorCode SbContactSetUpObstacle(SbEffect e, SbSpace space);
/* Destroys what the Contact owns. */
PetscErrorCode SbContactDestroy(SbEffect e);

/* Operations of nodes against an obstacle. */
extern const SbEffectOps SbContactNodeOps;
