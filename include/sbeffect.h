/*
  sbeffect.h - layer 5: effects: loads, supports, damping, contact.

  An effect is one file in src/effect/. An operation left NULL means "nothing to do" and is never called: the model
  sorts the effects into one list per operation after set-up. An effect that the scenario does not name is never created.
*/
#pragma once
#include "sbfem.h"
#include "sbsolver.h"

typedef struct _p_SbEffect *SbEffect;

/* Hessian of the contact energy in Newton's method: exact; each pair projected to positive semi-definite; the same with friction majorized by quadratics, as its energy
   has a kink where slip reverses. */
typedef enum { SB_HESSIAN_EXACT, SB_HESSIAN_PROJECTED, SB_HESSIAN_MAJORIZED } SbContactHessian;

/* An active contact point of a body. */
typedef struct {
  PetscInt id[3];      /* identify it within its effect, the same for any partition */
  PetscInt effect;     /* number of the effect in the scenario; filled by the model */
  PetscInt body[2];    /* the body itself and its partner; -1: a rigid obstacle */
  PetscReal x[3];      /* position on body[0], m */
  PetscReal normal[3]; /* outward normal of the partner */
  PetscReal gap;       /* m; negative inside */
  PetscReal force[3];  /* on body[0], with friction, N */
} SbContactPoint;
/* Start with {0}; n = 0 empties it and keeps the memory. Release with PetscFree(list->point). */
typedef struct {
  PetscInt n, size;
  SbContactPoint *point; /* [n] */
} SbContactPoints;

/* Two bodies that are in contact, or nearly so, when a run begins. */
typedef struct {
  PetscInt body[2];  /* nbody: an obstacle */
  PetscReal n[3];    /* unit, from the second to the first */
  PetscReal gap, to; /* the distance along n, and its target, m */
} SbInitialContact;
/* Start with {0}; release with PetscFree(list->touch). */
typedef struct {
  PetscInt n, size;
  SbInitialContact *touch; /* [n] */
} SbInitialContacts;

typedef struct {
  /* reads -effect_<name>_...; scope = {"effect", <type>, <name>}; called once, by SbEffectCreate() */
  PetscErrorCode (*setfromoptions)(SbEffect e, const SbScope *scope);
  /* finds its nodes, facets, cells; marks prescribed unknowns by SbSpacePrescribe(). Collective. */
  PetscErrorCode (*setup)(SbEffect e, SbSpace space);
  /* writes prescribed displacements at time t into space->fixed_value (rows are positions in space->fixed_node). Not collective. */
  PetscErrorCode (*prescribe)(SbEffect e, SbSpace space, PetscReal t);
  /* for rotating supports: work of the reactions r0[nnode_owned][3] at t0 and r1 at t1, N, along the arc, less that of their mean along the chord, J; this rank's. Not collective. */
  PetscErrorCode (*turning_work)(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1, const PetscReal r0[],
                                 const PetscReal r1[], PetscReal *work);
  /* contact, before the first solve of an attempt at a step from t to t + dt: local displacements u0 at t and u as predicted at
     t + dt, m; v0 are the velocities at t, m/s, NULL unless an effect has `restitution`. Collective. */
  PetscErrorCode (*begin_step)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt, const PetscReal u0[],
                               const PetscReal v0[], const PetscReal u[]);
  /* adds the constraints of contact by SbSpaceAddConstraint(): called for all effects first for normal, then for tangential ones (across). Not collective. */
  PetscErrorCode (*assemble_constraints)(SbEffect e, SbSpace space, PetscBool across);
  /* after a solve, for whose solution SbConstraintsComputeForces() has been called: sets `changed` when another solve is needed. Collective. */
  PetscErrorCode (*update_active_set)(SbEffect e, SbSpace space, const PetscReal u[], PetscBool *changed);
  /* after the first solve of an attempt, with -effect_<name>_time_of_impact: the fraction of the step, 0..1, at which the first new point
     comes into contact in the motion without contact; 1: none does. This rank's. Not collective. */
  PetscErrorCode (*time_of_impact)(SbEffect e, PetscReal *part);
  /* restitution (src/model/restitution.c): work of the contact forces of impacts in the last solve, in the frame of the other side,
     J; this rank's. Not collective. */
  PetscErrorCode (*restitution)(SbEffect e, PetscReal *work);
  /* multiplies its coefficients of restitution by `share`, 0..1, in this step, and updates its constraints. Not collective. */
  PetscErrorCode (*scale_restitution)(SbEffect e, PetscReal share);
  /* contact, after the solve of a Newmark step that ends at t: sets the velocity of the obstacle at the end in its constraints
     (SbConstraint.velocity). Not collective. */
  PetscErrorCode (*target_velocity)(SbEffect e, SbSpace space, const SbStage *stage);
  /* f[nnode][3] += contact forces on owned nodes, N, but those of constraints. For output only. Not collective. */
  PetscErrorCode (*contact_force)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[]);
  /* lowers gap[nnode] of owned nodes, m, where a contact candidate is closer, and sets normal[nnode][3] there, towards the node. For
     output only. Not collective. */
  PetscErrorCode (*gap)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal gap[], PetscReal normal[]);
  /* f[nnode][3] += external force, N; must be right on owned nodes without communication */
  PetscErrorCode (*force)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[]);
  /* A -= shift_k d force / d u + shift_v d force / d v by SbSpaceAddCellBlock(), called for (a, b) and for (b, a) */
  PetscErrorCode (*tangent)(SbEffect e, SbSpace space, const SbStage *stage, Mat A);
  /* y[nnode][3] -= shift_k (d force / d u) x, N, of forces whose derivative is far from symmetric and which tangent() leaves out, for the
     direction x[nnode][3], m; must be right on owned nodes without communication; not with constraints beside the matrix */
  PetscErrorCode (*nonsymmetric)(SbEffect e, SbSpace space, const SbStage *stage, const PetscReal x[],
                                 PetscReal y[]);
  /*
    Barrier contact (-effect_NAME_response barrier), whose energy is part of the potential that Newton's method minimises (src/time/newton.c). Collective.

    touching      - at the start t of a run, with first step length dt: adds this rank's pairs whose gap at the local displacements u is too small, or little
                    larger. first: it was the first step, alike on all ranks; else nothing was done.
    begin_barrier - a step from t to t + dt begins with the local displacements u0, and the speed of potential.c, m/s; at the start of the run they may be changed (moved), ghosts too, where surfaces
                    touch. Prescribed motions are at t: `progress` 0.
    meet          - after begin_barrier, for effects with restitution: finds the impacts of the step, from the local displacements u0 and velocities v0 at its start.
    advance       - moves obstacles to the fraction `progress` of their path from t to t + dt, 0..1. Not collective.
    safe          - part: largest collision-free fraction of the motion from the local displacements u0 to u1, and from the present progress to `progress`, for this
                    rank's pairs; nactive: this rank's active pairs at u0.
    nearest       - the smallest gap at the last positions, m, and its pair, in words; PETSC_MAX_REAL and "" without one.
    lag           - lagged friction, at the local displacements u of an iterate or (solved) of a solution: may take normal forces and slip directions from u;
                    again: it did, and the step needs one more solve.
    potential     - energy at the local displacements u, this rank's part, J; f[nnode][3] += its gradient on owned nodes, N.
    hessian       - adds the blocks of its Hessian at u, or of the substitute (SbContactHessian), and to r[nnode][3] on owned nodes, N, the gradient of the
                    substitute's quadratic model less the true gradient.
    gap_forces    - f[nnode][3] += on owned nodes the load that closes the gaps at u to first order, N; `bound`: half of force times gap, which bounds the energy
                    of the error by gaps, this rank's, J.
    scale_width   - multiplies a default width of the barrier by `factor`. Smaller: at once, not below what rounding allows; changed: it did, alike on all ranks. Larger: at the
                    start of the next step, if the barrier's energy grows by at most `growth`, J, and not beyond the default. Not collective.
  */
  PetscErrorCode (*touching)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt, const PetscReal u[],
                             PetscBool *first, SbInitialContacts *list);
  PetscErrorCode (*begin_barrier)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt, PetscReal speed,
                                  PetscReal u0[], PetscBool *moved);
  PetscErrorCode (*meet)(SbEffect e, SbSpace space, PetscReal dt, const PetscReal u0[], const PetscReal v0[]);
  PetscErrorCode (*advance)(SbEffect e, PetscReal progress);
  PetscErrorCode (*safe)(SbEffect e, SbSpace space, const PetscReal u0[], const PetscReal u1[],
                         PetscReal progress, PetscReal *part, PetscInt *nactive);
  PetscErrorCode (*nearest)(SbEffect e, SbSpace space, PetscReal *gap, size_t size, char text[]);
  PetscErrorCode (*lag)(SbEffect e, SbSpace space, const PetscReal u[], PetscBool solved, PetscBool *again);
  PetscErrorCode (*potential)(SbEffect e, SbSpace space, const PetscReal u[], PetscReal *energy,
                              PetscReal f[]);
  PetscErrorCode (*hessian)(SbEffect e, SbSpace space, const PetscReal u[], SbContactHessian kind,
                            SbBlocks *blocks, PetscReal r[]);
  PetscErrorCode (*gap_forces)(SbEffect e, SbSpace space, const PetscReal u[], PetscReal f[],
                               PetscReal *bound);
  PetscErrorCode (*scale_width)(SbEffect e, PetscReal factor, PetscReal growth, PetscBool *changed);
  /* of barrier contact: its work on the bodies in the last accepted step, J; this rank's. Not collective. */
  PetscErrorCode (*work)(SbEffect e, PetscReal *work);
  /* after a step was accepted */
  PetscErrorCode (*accept)(SbEffect e, SbSpace space, const SbStage *stage);
  /* for checkpoints: history variables of the effect, as records of `nstate` numbers each, which identify entities by numbers that no
     partition changes; n of this rank, allocated here, the caller frees. Collective. */
  PetscErrorCode (*save)(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records);
  /* replaces the history variables by this rank's of the n records of all ranks; local displacements u (m) at the time t of the
     checkpoint. assemble_constraints() then gives the constraints of that time. Collective. */
  PetscErrorCode (*load)(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                         const PetscReal records[]);
  /* for re-meshing: renumbers the n records of all ranks from save() for another mesh, in which node from[i] (original number; ascending) is to[i];
     records of removed nodes are dropped. Not collective. */
  PetscErrorCode (*rename)(SbEffect e, PetscInt nnode, const PetscInt from[], const PetscInt to[],
                           PetscInt *n, PetscReal records[]);
  /* numbers for the history: n values with the names given by `columns`; residual[nnode][3] is the unbalanced force, N,
     which on prescribed unknowns is the reaction. Values are this rank's part and are summed. */
  PetscErrorCode (*history)(SbEffect e, SbSpace space, const SbStage *stage, const PetscReal residual[],
                            PetscReal values[]);
  /* adds the active contact points of this rank; for output only. Not collective. */
  PetscErrorCode (*contact_points)(SbEffect e, SbSpace space, const SbStage *stage, SbContactPoints *list);
  /* a line for the summary at the end of a run, "": nothing. Collective. */
  PetscErrorCode (*summary)(SbEffect e, SbSpace space, size_t size, char text[]);
  PetscErrorCode (*destroy)(SbEffect e);
} SbEffectOps;

/* The sets named by the option -effect_<name>_on. */
typedef struct {
  char option[2 * SB_NAME_MAX]; /* full name of the option, for messages */
  PetscInt n;
  char (*name)[SB_NAME_MAX]; /* [n] owned */
} SbEffectOn;

/* A type of effects, one per file in src/effect/. */
typedef struct {
  const char *name;
  size_t size; /* bytes of `data`, zero at first */
  PetscInt nrow, ncolumn;
  const SbOption *row; /* [nrow] its options; "on", and "time" where it is one formula, are read for it */
  const char *const *column; /* [ncolumn] history columns that each effect of the type has */
  SbEffectOps ops;
} SbEffectType;
extern const SbEffectType SbEffectGravity, SbEffectBodyForce, SbEffectTraction, SbEffectPressure,
  SbEffectPointForce, SbEffectFixed, SbEffectPrescribedDisplacement, SbEffectDamping, SbEffectContact;

struct _p_SbEffect {
  char name[SB_NAME_MAX];
  char type[SB_NAME_MAX];
  SbEffectOps ops;
  SbEffectOn on;         /* empty for a type without the option */
  SbFormula time;        /* factor on a load; NULL for a type without the option */
  PetscLogEvent event;   /* SbEff_<type>, around every operation from `setup` to `contact_points` */
  PetscBool linear;      /* force does not depend on u: the tangent stays constant. Default PETSC_TRUE */
  PetscBool steady;      /* no formula uses t: a static run multiplies the effect by the load factor */
  PetscReal from, until; /* s (or load factor): it acts at times t with from < t <= until; all by default */
  PetscBool dynamic;     /* the run has inertia; known from set-up on */
  PetscBool saddle;      /* its constraints are to be solved with their multipliers as unknowns */
  PetscBool euler;       /* made for implicit Euler only. Default PETSC_FALSE */
  PetscBool springs;     /* of contact: springs or friction, not constraints alone. Default PETSC_FALSE */
  PetscBool prescribed;  /* it prescribes the nodes of its sets in all directions */
  PetscInt nstate;       /* numbers in a record of save() */
  PetscReal width;       /* of barrier contact: the smallest width, the gap below which surfaces repel, m */
  PetscInt ncolumn;      /* history columns, known after set-up */
  const char *const
    *column;      /* [ncolumn] "force_x", ...; written as <name>_<column>; owned by the type or by `data` */
  char note[256]; /* note of the set-up for the run's header; "": none */
  void *data;     /* the type's own; freed with the effect */
};

/* Whether it acts at a time, or from that time on; ends of steps may be off by rounding. Not collective. */
PetscBool SbEffectActs(SbEffect e, PetscReal t);
PetscBool SbEffectActsAfter(SbEffect e, PetscReal t);
/* Calls an operation that the effect has, within its log event: SbEffectCall(e, force, space, stage, f). */
#define SbEffectCall(e, op, ...)                             \
  do {                                                       \
    const SbEffect sb_e_ = (e);                              \
    PetscCall(PetscLogEventBegin(sb_e_->event, 0, 0, 0, 0)); \
    PetscCall((*sb_e_->ops.op)(sb_e_, __VA_ARGS__));         \
    PetscCall(PetscLogEventEnd(sb_e_->event, 0, 0, 0, 0));   \
  } while (0)

/* Adds a type, which must live as long as the program, and its option rows. Not collective. */
PetscErrorCode SbEffectRegister(const SbEffectType *type);
/* Names of all types. Not collective. */
#define SB_EFFECT_TYPES 32
PetscInt SbEffectTypes(const char *names[SB_EFFECT_TYPES]);
/*
  SbEffectCreate - an effect of the scenario by its name, with its options read.

  Not collective, but to be called alike on all ranks. The caller destroys the effect with SbEffectDestroy(), also when
  its options were at fault.

  Options read: -effect_<name>_type (by default the name itself is the type) and those of the type.
  Errors: PETSC_ERR_USER_INPUT for an unknown type, with the nearest ones; PETSC_ERR_USER* from the options of the type.
*/
PetscErrorCode SbEffectCreate(const char *name, SbEffect *e);
PetscErrorCode SbEffectDestroy(SbEffect *e); /* sets *e to NULL; NULL is accepted */
/*
  SbEffectMarkPrescribed - marks the sets that the effect prescribes in all directions (SbSet.prescribed), for the space to be made.

  Not collective. Call it for every effect between SbMeshCreate() and SbSpaceCreate(). Names without a set are left to set-up.
*/
void SbEffectMarkPrescribed(SbEffect e, PetscInt nset, SbSet set[]);
