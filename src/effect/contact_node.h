/*
  contact_node.h - nodes of the surface against a rigid obstacle: what contact_node.c, contact_facets.c, contact_force.c, contact_restitution.c and friction.c share.
*/
#pragma once
#include "contact.h"
#include "sbcontact.h"

#define TOLERANCE 1e-7 /* of the size of the bodies: largest penetration that counts as touching */

/* What friction knows of a node. */
typedef struct {
  PetscInt slide[2];       /* constraints across the normal, -1: none */
  PetscBool slides;        /* in the solve; else it sticks */
  PetscBool slid;          /* in the last step */
  PetscBool crowded;       /* others hold the node as well: it sticks by springs as long as it touches */
  int flips;               /* how often that or its direction has turned within the step */
  PetscReal tangent[2][3]; /* across the normal; the first one is where it slides to */
  PetscReal turning;       /* stiffness across where it slides to, N/m */
  PetscReal stretch[3];    /* of the springs that stick, at the start of the step, m */
  PetscReal drag[3];       /* force of friction on the node in the last solve, N */
  PetscReal pressing;      /* normal force of the solve before, N */
} SbFrictionState;

/* A node of the surface that this rank owns. */
typedef struct {
  PetscInt node, cell, a; /* local node, a cell that has it, as its node a */
  PetscReal k;            /* stiffness of the springs, N/m */
  PetscBool on;           /* it touches; with springs: it did at the end of the last step */
  PetscBool was;          /* it touched at the end of the last step, and did not bounce */
  PetscBool idle;         /* its spring waits for the first solve of the step */
  PetscReal gap0;         /* gap when the step began, m; with `time_of_impact yes` or restitution */
  int toggles, flips;     /* how often it came within the step, and while held changed facets */
  PetscInt along;         /* its constraint; -1: others say it, or it does not touch */
  PetscReal surface[3];   /* normal of the obstacle at the last search */
  PetscReal level;        /* n . u on the plane of that facet, m */
  PetscBool valley;       /* it is constrained on two facets for the time of a solve (contact_facets.c) */
  PetscBool undecided;    /* the solves go on for that */
  PetscReal other[3], other_value; /* the second one, as n and value */
  PetscInt other_along;            /* as along */
  PetscReal other_lambda;          /* N */
  PetscReal n[3];                  /* normal that it is constrained along, outwards from the obstacle */
  PetscReal value;                 /* n . u that puts it on the obstacle, m */
  PetscReal rest;    /* gap that it is constrained at: 0, minus what overlaps, or where it bounces to, m */
  PetscReal kept;    /* springs: the same at the end of the last step, m */
  PetscReal gap;     /* after the last solve, beyond `rest`, m */
  PetscReal arrives; /* restitution: speed towards the obstacle at first, m/s; 0: it does not bounce */
  PetscReal stiff;   /* of the spring in this step with its damper, N/m */
  PetscReal before;  /* damper: force for where the node was when the step began, N */
  PetscReal lambda;  /* multiplier of the last solve, N */
  PetscReal wrong; /* constraints as springs: force that its place asks for, less that of the last solve, N */
  SbFrictionState grip; /* friction */
  PetscReal start[3];   /* displacement with which it would stick, m */
  PetscReal now[3];     /* that of the last solve, m */
  PetscReal stretch[3]; /* of springs that stick, in the obstacle's rest frame, after the last step, m */
} Touch;

typedef struct {
  SbObstacle obstacle;
  SbResponse response;
  PetscBool held;   /* touching nodes are constrained; else they are pushed by force() */
  PetscBool facets; /* the obstacle is a mesh */
  SbFriction friction;
  PetscReal stiffness, damping; /* s */
  SbOverlap overlap;
  PetscReal scale, at[3]; /* of the file of a mesh */
  SbFormula displacement[3], angle;
  PetscReal axis[3], point[3];
  SbRestitution bounce;
  PetscInt n;
  Touch *touch;      /* [n] */
  PetscReal size;    /* of the bodies, m */
  PetscBool cut;     /* steps end where nodes arrive */
  PetscBool first;   /* the step has not been solved yet */
  PetscReal arrival; /* the part of it after which the first node arrives, 1: none */
  SbPose to;         /* at the end of the step */
} Contact;

/* Whether touching nodes are constrained exactly. */
static inline PetscBool exact(const Contact *c)
{
  return SbResponseIsExact(c->response);
}

/* The obstacle's pose at time t. */
void SbContactPose(const Contact *c, PetscReal t, SbPose *pose);
/* Gap of a point, m, and the normal there. */
PetscReal SbContactGap(const Contact *c, const SbPose *pose, const PetscReal x[3], PetscReal n[3]);

static inline void place(SbSpace space, PetscInt node, const PetscReal u[], PetscReal x[3])
{
  for (int i = 0; i < 3; i++) x[i] = space->node_x[3 * node + i] + u[3 * node + i];
}

/* What springs and dampers give, N, also when they pull. */
static inline PetscReal pull(const Touch *touch, PetscReal gap)
{
  return touch->lambda + touch->before - touch->stiff * gap;
}

/* Normal force of the springs, N; gap: beyond what the node is constrained at. */
static inline PetscReal spring(const Touch *touch, PetscReal gap)
{
  return touch->idle ? 0 : PetscMax(0, pull(touch, gap));
}

/* The same of any response after a solve, N. */
static inline PetscReal SbContactForce(const Contact *c, const Touch *touch)
{
  return exact(c) ? touch->lambda : spring(touch, touch->gap);
}

/*
  contact_facets.c: where a held node goes that has been solved for and is at x now, X at rest, by `gap` (m) off the facet with the normal n; its planes
  for the next solve. Flip: it was constrained on one facet; whether it goes on on another one. Valley: it was on two. Not collective.
*/
PetscBool SbContactFlip(const Contact *c, const PetscReal X[3], const PetscReal x[3], PetscReal gap,
                        PetscReal n[3], Touch *touch);
void SbContactValley(const Contact *c, SbSpace space, const PetscReal x[3], PetscReal gap,
                     const PetscReal n[3], Touch *touch);
/* Whether a node is constrained on the plane that it has till the step ends. */
PetscBool SbContactKept(const Touch *touch);

/*
  Friction (friction.c). Not collective but for Warn. Begin: a step; touches: the node did when the last one ended. Enter: it touches from now on: it sticks or slides as its motion
  without touching says, by which it is `depth` (m) behind. Direction: of the normal force. Hold: adds its constraints across the
  normal. Read: what a solve made of them, N being the normal force.
*/
void SbFrictionBegin(SbFrictionState *grip, PetscBool touches);
void SbFrictionEnter(const SbFriction *f, Touch *touch, PetscReal depth);
void SbFrictionDirection(const SbFriction *f, const Touch *touch, PetscReal push[3]);
PetscErrorCode SbFrictionHold(const SbFriction *f, SbSpace space, Touch *touch);
void SbFrictionRead(const SbFriction *f, SbSpace space, Touch *touch, PetscReal N);
/* Whether a node sticks or slides from now on. Returns the error of its friction in the last solve, N. N: its normal force. */
PetscReal SbFrictionSettle(const SbFriction *f, Touch *touch, PetscReal N);
/* After all nodes: worst of their errors on this rank and largest normal force of all ranks, N; changed: the solve was not right. */
void SbFrictionJudge(SbFriction *f, PetscReal worst, PetscReal largest, PetscBool *changed);
/* Ends a step for a node; presses: its normal force is positive. */
void SbFrictionAccept(SbFriction *f, Touch *touch, PetscBool presses);
/* Ends a step: says once that friction was taken as it was. Collective. */
PetscErrorCode SbFrictionWarn(SbFriction *f, const char effect[], SbSpace space, PetscReal t);
/* What it takes from step to step, for checkpoints: state[SB_FRICTION_STATE]. */
#define SB_FRICTION_STATE 9
void SbFrictionSave(const SbFrictionState *grip, PetscReal state[]);
void SbFrictionLoad(const PetscReal state[], SbFrictionState *grip);

/*
  Restitution (contact_restitution.c), of a node at x0 with the velocity v0 (m/s; NULL: not known) when the step begins. Comes: it will be
  behind the obstacle at that speed. Hit: it is to be constrained.
*/
PetscBool SbContactComes(const Contact *c, const SbPose *from, const PetscReal x0[3], const PetscReal v0[3],
                         Touch *touch);
void SbContactHit(const Contact *c, Touch *touch);

/* Operations of the effect (sbeffect.h). */
PetscErrorCode SbEffectForce_Contact(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[]);
PetscErrorCode SbEffectTangent_Contact(SbEffect e, SbSpace space, const SbStage *stage, Mat A);
PetscErrorCode SbEffectTargetVelocity_Contact(SbEffect e, SbSpace space, const SbStage *stage);
PetscErrorCode SbEffectRestitution_Contact(SbEffect e, PetscReal *work);
PetscErrorCode SbEffectScaleRestitution_Contact(SbEffect e, PetscReal share);
PetscErrorCode SbEffectAccept_Contact(SbEffect e, SbSpace space, const SbStage *stage);
PetscErrorCode SbEffectGap_Contact(SbEffect e, SbSpace space, const SbStage *stage, PetscReal gap[],
                                   PetscReal normal[]);
PetscErrorCode SbEffectContactPoints_Contact(SbEffect e, SbSpace space, const SbStage *stage,
                                             SbContactPoints *list);
PetscErrorCode SbEffectHistory_Contact(SbEffect e, SbSpace space, const SbStage *stage,
                                       const PetscReal residual[], PetscReal values[]);
#define SB_CONTACT_STATE (14 + SB_FRICTION_STATE) /* numbers in a record */
PetscErrorCode SbEffectSave_Contact(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records);
PetscErrorCode SbEffectLoad_Contact(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                                    const PetscReal records[]);
PetscErrorCode SbEffectRename_Contact(SbEffect e, PetscInt nnode, const PetscInt from[], const PetscInt to[],
                                      PetscInt *n, PetscReal records[]);
/* Takes the stretch of a node's springs along with the obstacle. */
void SbContactStretch(const SbPose *pose, Touch *touch);
