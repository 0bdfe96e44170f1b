/*
  nodes.h - responses of nodes of a surface against a rigid obstacle: projected and multiplier
  (response_exact.c), penalty and augmented (response_springs.c).
*/
#pragma once
#include "contact_impl.h"

/* n . u = value, m, of a node with the displacement u. */
typedef struct {
  PetscReal n[3], value;
} Plane;

/* The facets of the obstacle that a node is constrained on. */
typedef struct {
  Plane surface;          /* of the facet at the last search, n outward */
  Plane plane;            /* on which it is constrained */
  PetscInt along;         /* its constraint; -1: redundant, or inactive */
  int flips;              /* changes of facet while active, within the step */
  PetscBool valley;       /* constrained on two facets during a solve */
  PetscBool undecided;    /* another solve is needed for that */
  Plane other;            /* the second one */
  PetscInt other_along;   /* as along */
  PetscReal other_lambda; /* N */
} NodeFacets;

/* Spring of a node. */
typedef struct {
  PetscReal k;      /* stiffness, N/m */
  PetscReal stiff;  /* the same in this step with its damper, N/m */
  PetscReal before; /* damper: force from the node's gap at the start of the step, N */
  PetscReal wrong;  /* with constraints: force at its position less that of the last solve, N */
  PetscBool idle;   /* it does not act before the first solve of the step */
} NodeSpring;

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
  PetscReal kept[3];       /* the same in the obstacle's rest frame, after the last step, m */
  PetscReal start[3];      /* displacement with which it would stick, m */
  PetscReal now[3];        /* that of the last solve, m */
  PetscReal force[3];      /* friction force on the node in the last solve, N */
  PetscReal pressing;      /* normal force of the solve before, N */
} SbFrictionState;

/* A node of the surface that this rank owns. */
typedef struct {
  PetscInt node, cell, a; /* local node, a cell that has it, as its node a */
  PetscBool on;           /* active; with springs: at the end of the last step */
  PetscBool was;          /* active at the end of the last step, without rebound */
  int toggles;            /* activations within the step */
  PetscReal gap0;         /* gap when the step began, m; with `time_of_impact yes` or restitution */
  PetscReal gap;          /* after the last solve, beyond `rest`, m */
  PetscReal
    rest; /* gap it is constrained to: 0, minus the remaining overlap, or that of a rebound, m */
  PetscReal kept;     /* springs: the same at the end of the last step, m */
  PetscReal from[3];  /* where it is when the step begins, in the obstacle's rest frame, m */
  PetscReal lambda;   /* multiplier of the last solve, N */
  PetscReal approach; /* restitution: speed of approach, m/s; 0: no rebound */
  NodeFacets facets;
  NodeSpring spring;
  SbFrictionState friction;
} ContactNode;

/* A node for messages. */
typedef struct {
  double by;   /* 0: none; what is wrong, over the largest contact force */
  double x[3]; /* m */
  PetscInt body;
} NodePlace;

typedef struct {
  Contact contact;     /* first */
  PetscReal stiffness; /* factor on that of springs */
  PetscReal damping;   /* s */
  PetscBool held;      /* active nodes are constrained; else force() acts on them */
  PetscBool mesh;      /* the obstacle has facets */
  PetscBool first;     /* the step has not been solved yet */
  PetscBool passed;    /* the warning of nodes that passed through the obstacle was given */
  PetscReal impact;    /* fraction of the step at the first time of impact, 1: none */
  PetscReal size;      /* of the bodies, m */
  NodePlace wrong;     /* a node that the last update changed */
  NodePlace pulled;    /* the node that stays active against the largest pull */
  PetscBool said;      /* the warning of such a node was given */
  struct {
    int told;       /* what was said of the facets (node_facets.c) */
    PetscInt n;     /* number of the facets of own cells; 0: nodes see all of the obstacle */
    SbFacet *facet; /* [n] */
  } between;        /* the nodes */
  PetscInt n;
  ContactNode *node; /* [n] */
} Nodes;

#define NODE_TOLERANCE 1e-7 /* tolerance of penetration, over the size of the bodies */
#define NODE_TOGGLES 3      /* activations of a node within a step after which it stays active */
#define NODE_PULLING 1e-6 /* tension at which a node is released, over the largest contact force */
#define NODE_PULLED 1e-3  /* tension of a node that stays active all the same, for a warning */
#define NODE_SETTLED 1e-4 /* tolerance of spring forces and of friction, over the largest */

/* Whether active nodes are constrained exactly. */
static inline PetscBool exact(const Nodes *c)
{
  return (PetscBool)(c->contact.response == PROJECTED || c->contact.response == MULTIPLIER);
}

/* Position of a node, m. */
static inline void place(SbSpace space, PetscInt node, const PetscReal u[], PetscReal x[3])
{
  for (int i = 0; i < 3; i++)
    x[i] = space->node_x[3 * node + i] + u[3 * node + i];
}

/* Force of spring and damper, N, also in tension; gap: relative to `rest`, m. */
static inline PetscReal pull(const ContactNode *node, PetscReal gap)
{
  return node->lambda + node->spring.before - node->spring.stiff * gap;
}

/* Normal force of a spring, N. */
static inline PetscReal spring(const ContactNode *node, PetscReal gap)
{
  return node->spring.idle ? 0 : PetscMax(0, pull(node, gap));
}

/* The same of any response after a solve, N. */
static inline PetscReal contact_force(const Nodes *c, const ContactNode *node)
{
  return exact(c) ? node->lambda : spring(node, node->gap);
}

/* Makes e, with its Nodes, an effect of nodes against an obstacle. Not collective. */
PetscErrorCode SbContactNodesCreate(SbEffect e, const SbScope *scope);

/* Search (node_search.c). Not collective. Gap: of a point from the obstacle in a pose, m, and the
   normal there. Search: of the node at x less the gap it is constrained to, m; updates the planes
   of that. MoveTo: changes the gap that the node is constrained to. Enter: activates a penetrating
   node. */
PetscReal SbNodeGap(const Nodes *c, const SbPose *pose, const PetscReal x[3], PetscReal n[3]);
PetscReal SbNodeSearch(const Nodes *c, SbSpace space, const PetscReal x[3], ContactNode *node);
void SbNodeMoveTo(PetscReal rest, ContactNode *node);
void SbNodeEnter(const Nodes *c, ContactNode *node);

/*
  Facets between their nodes (node_facets.c).

  Create - keeps those of own cells. Not collective.
  Check  - in the accepted state at t, s or a load factor, with the obstacle in a pose: warns, once
           for a contact, of an obstacle that is thinner than a facet near it, and of one that is in
           a facet whose nodes do not feel it. Collective.
*/
PetscErrorCode SbNodeFacetsCreate(Nodes *c, SbSpace space, PetscInt n, const SbFacet facet[]);
PetscErrorCode SbNodeFacetsCheck(Nodes *c, SbSpace space, PetscReal t, const SbPose *pose,
                                 const PetscReal u[]);
PetscErrorCode SbNodeFacetsDestroy(Nodes *c);

/* Whether the active set was right for a node, largest: the largest contact force, N; changes it if
   not (response_exact.c, response_springs.c). */
PetscBool SbNodeUpdate_Exact(const Nodes *c, PetscReal largest, ContactNode *node);
PetscBool SbNodeUpdate_Springs(const Nodes *c, PetscReal largest, ContactNode *node);
/* Normal force on a node at x, N; n: the normal. */
PetscReal SbNodeNormalForce(const Nodes *c, const SbPose *pose, const ContactNode *node,
                            const PetscReal x[3], PetscReal n[3]);
/* Operations of exact responses (response_exact.c), of springs (response_springs.c), and of output
   and checkpoints (node_output.c). */
PetscErrorCode SbContactImpactWork_Exact(SbContact contact, PetscReal *work);
PetscErrorCode SbContactScaleRestitution_Exact(SbContact contact, PetscReal share);
PetscErrorCode SbContactTargetVelocity_Exact(SbContact contact, SbSpace space,
                                             const SbStage *stage);
PetscErrorCode SbEffectForce_Springs(SbEffect e, SbSpace space, const SbStage *stage,
                                     PetscReal f[]);
PetscErrorCode SbEffectTangent_Springs(SbEffect e, SbSpace space, const SbStage *stage, Mat A);
PetscErrorCode SbContactGap_Nodes(SbContact contact, SbSpace space, const SbStage *stage,
                                  PetscReal gap[], PetscReal normal[]);
PetscErrorCode SbContactPoints_Nodes(SbContact contact, SbSpace space, const SbStage *stage,
                                     SbContactPoints *list);
PetscErrorCode SbEffectHistory_Nodes(SbEffect e, SbSpace space, const SbStage *stage,
                                     const PetscReal residual[], PetscReal values[]);
#define SB_CONTACT_STATE 23 /* numbers in a record of a node */
PetscErrorCode SbEffectSave_Nodes(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records);
PetscErrorCode SbEffectLoad_Nodes(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                  PetscInt n, const PetscReal records[]);

/* Friction (friction_nodes.c). Not collective. Begin: a step; touches: active at the end of the
   last one. Enter: activates it: it sticks or slides by its motion without contact, which
   penetrates by `depth` (m). Direction: of the contact force. Constrain: adds its tangential
   constraints. Read: their forces after a solve, N being the normal force. */
void SbFrictionBegin(SbFrictionState *friction, PetscBool touches);
void SbFrictionEnter(const Nodes *c, ContactNode *node, PetscReal depth);
void SbFrictionDirection(const Nodes *c, const ContactNode *node, PetscReal push[3]);
PetscErrorCode SbFrictionConstrain(const Nodes *c, SbSpace space, ContactNode *node);
void SbFrictionRead(const Nodes *c, SbSpace space, ContactNode *node, PetscReal N);
/* Updates stick or slip of a node with the normal force N; returns the error of its friction, N. */
PetscReal SbFrictionUpdate(const Nodes *c, ContactNode *node, PetscReal N);
/* Accepts a step for a node; presses: its normal force is positive. */
void SbFrictionAccept(const Nodes *c, ContactNode *node, PetscBool presses);
/* Rotates the deflection of a node's springs with the obstacle. */
void SbFrictionRotate(const SbPose *pose, SbFrictionState *friction);
