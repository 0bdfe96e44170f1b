/*
  contact_impl.h - the effect `contact`: shared by responses of nodes (nodes.c, friction_nodes.c)
  and of surfaces (barrier.h).
*/
#pragma once
#include "obstacle.h"
#include "sbcontact.h"
#include "sblog.h"

/* Calls an operation of a contact, if there is one, within the log event of its effect; PHASE: with
   its time added to the contact phase as well. */
#define CONTACT_CALL(c, op, ...)                                       \
  do {                                                                 \
    const SbContact sb_c_ = (c);                                       \
    if (sb_c_->ops->op) {                                              \
      PetscCall(PetscLogEventBegin(sb_c_->effect->event, 0, 0, 0, 0)); \
      PetscCall((*sb_c_->ops->op)(sb_c_, __VA_ARGS__));                \
      PetscCall(PetscLogEventEnd(sb_c_->effect->event, 0, 0, 0, 0));   \
    }                                                                  \
  } while (0)
#define PHASE_CALL(c, op, ...)                                             \
  do {                                                                     \
    PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0)); \
    CONTACT_CALL(c, op, __VA_ARGS__);                                      \
    PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));   \
  } while (0)

typedef enum {
  AUTO,
  PROJECTED,
  MULTIPLIER,
  AUGMENTED,
  PENALTY,
  BARRIER
} SbResponse;

/* Coefficients of friction of an effect, and convergence in a step. */
typedef struct {
  PetscReal mu, mu_kinetic;
  int updates; /* number of updates within the step */
  PetscReal
    error; /* largest error of friction after the last solve, relative to the largest friction */
  PetscBool said; /* the warning that friction did not converge was given */
} SbFriction;

/* Gradual resolution of penetration: its depth falls to 1/e in `separation_steps` whole steps; a
   shorter step resolves less of it, at the same speed. */
typedef struct {
  PetscReal
    recovery; /* factor on the depth in a whole step, exp(-1/separation_steps); 0: resolved at once */
  PetscReal longest; /* step so far, s */
  PetscReal left;    /* factor on the depth in this step */
} SbOverlap;

static inline void SbOverlapBegin(SbOverlap *o, PetscReal dt)
{
  o->longest = PetscMax(o->longest, dt);
  o->left = o->recovery > 0 ? PetscPowReal(o->recovery, dt / o->longest) : 0;
}

/* Newton's law of restitution for the impact of a point (restitution.c). */
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

/* Friction state of a node. */
typedef struct {
  PetscInt slide[2]; /* tangential constraints, -1: none */
  PetscBool slides;  /* slides in the solve; else it sticks */
  PetscBool slid;    /* slid in the last step */
  PetscBool crowded; /* also constrained by other effects: sticks by springs while in contact */
  int flips;         /* changes of stick and slip, or reversals, within the step */
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
typedef struct {
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
  PetscBool valley;       /* constrained on two facets during a solve */
  PetscBool undecided;    /* another solve is needed for that */
  Plane other;            /* the second one */
  PetscInt other_along;   /* as along */
  PetscReal other_lambda; /* N */
  PetscReal
    rest; /* gap it is constrained to: 0, minus the remaining overlap, or that of a rebound, m */
  PetscReal kept;     /* springs: the same at the end of the last step, m */
  PetscReal gap;      /* after the last solve, beyond `rest`, m */
  PetscReal approach; /* restitution: speed of approach, m/s; 0: no rebound */
  PetscReal stiff;    /* of the spring in this step with its damper, N/m */
  PetscReal before;   /* damper: force from the node's gap at the start of the step, N */
  PetscReal lambda;   /* multiplier of the last solve, N */
  PetscReal
    wrong; /* constraints as springs: force at its position less that of the last solve, N */
  SbFrictionState friction;
  PetscReal start[3]; /* displacement with which it would stick, m */
  PetscReal now[3];   /* that of the last solve, m */
  PetscReal
    stretch[3]; /* of springs that stick, in the obstacle's rest frame, after the last step, m */
} Touch;

typedef struct {
  struct _p_SbContact base; /* first: what the program sees */
  SbResponse response;      /* not AUTO */
  SbObstacle obstacle;      /* NULL: contact between bodies */
  PetscReal scale, at[3];   /* of the file of a mesh */
  SbPath path; /* of the obstacle; torques are about the point of its axis, which moves with it */
  PetscBool self, pairs; /* between bodies: self-contact; columns for each pair of bodies */
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
  PetscBool first;  /* the step has not been solved yet */
  PetscReal impact; /* fraction of the step at the first time of impact, 1: none */
  SbPose from, to;  /* of the obstacle at the start and the end of the step */
} Contact;

/* Whether active nodes are constrained exactly. */
static inline PetscBool exact(const Contact *c)
{
  return (PetscBool)(c->response == PROJECTED || c->response == MULTIPLIER);
}

/* The obstacle's pose at time t. */
void SbContactPose(const Contact *c, PetscReal t, SbPose *pose);
/* Destroys what the Contact owns. */
PetscErrorCode SbContactDestroy(SbEffect e);

/* Makes e, with its Contact, an effect of nodes against an obstacle. Not collective. */
PetscErrorCode SbContactNodesCreate(SbEffect e, const SbScope *scope);

/* Friction (friction_nodes.c). Not collective. Begin: a step; touches: active at the end of the
   last one. Enter: activates it: it sticks or slides by its motion without contact, which
   penetrates by `depth` (m). Direction: of the contact force. Constrain: adds its tangential
   constraints. Read: their forces after a solve, N being the normal force. */
void SbFrictionBegin(SbFrictionState *friction, PetscBool touches);
void SbFrictionEnter(const Contact *c, Touch *touch, PetscReal depth);
void SbFrictionDirection(const Contact *c, const Touch *touch, PetscReal push[3]);
PetscErrorCode SbFrictionConstrain(const Contact *c, SbSpace space, Touch *touch);
void SbFrictionRead(const Contact *c, SbSpace space, Touch *touch, PetscReal N);
/* Updates stick or slip of a node with the normal force N; returns the error of its friction, N. */
PetscReal SbFrictionUpdate(const Contact *c, Touch *touch, PetscReal N);
/* Accepts a step for a node; presses: its normal force is positive. */
void SbFrictionAccept(const Contact *c, Touch *touch, PetscBool presses);
#define SB_CONTACT_STATE 23 /* numbers in a record of a node */

/* restitution.c: energy check of a converged step; `again`: coefficients were reduced.
   Collective. */
PetscErrorCode SbContactSetCheckRestitution(SbContactSet *contacts, Vec U, PetscBool *again);
