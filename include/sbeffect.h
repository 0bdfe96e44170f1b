/*
  sbeffect.h - layer 5: effects: loads, supports, damping, contact.

  An operation left NULL means "nothing to do" and is never called: the model sorts the effects into
  one list per operation after set-up. An effect that the scenario does not name is never created.
*/
#pragma once
#include "sbfem.h"
#include "sbsolver.h"

typedef struct _p_SbEffect *SbEffect;

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

/*
  Operations; a star: not collective. u, u0, u1: local displacements [nnode][3], ghosts up to date,
  m; v0: velocities, m/s; f, r0, r1, residual: forces [nnode][3], N, right on owned nodes without
  communication. Numbers and lists are this rank's part. Work, energies and bounds are added, flags
  set, `part` of time_of_impact() lowered: their caller gives the first values.
*/
typedef struct {
  /* reads -effect_<name>_...; scope = {"effect", <type>, <name>}; called once, by
     SbEffectCreate() */
  PetscErrorCode (*setfromoptions)(SbEffect e, const SbScope *scope);
  /* finds its nodes, facets, cells; marks prescribed unknowns by SbSpacePrescribe() */
  PetscErrorCode (*setup)(SbEffect e, SbSpace space);
  /* * writes prescribed displacements at time t into space->fixed_value (rows as in
     space->fixed_node), m */
  PetscErrorCode (*prescribe)(SbEffect e, SbSpace space, PetscReal t);
  /* * rotating supports: work of reactions r0 at t0, r1 at t1 along the arc less that along the
     chord, J */
  PetscErrorCode (*turning_work)(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1,
                                 const PetscReal r0[], const PetscReal r1[], PetscReal *work);
  /* contact, before the first solve of an attempt at a step from t to t + dt: u0 and v0 at t, u as
     predicted at t + dt; v0 is NULL unless an effect has `restitution` */
  PetscErrorCode (*begin_step)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt,
                               const PetscReal u0[], const PetscReal v0[], const PetscReal u[]);
  /* * SbSpaceAddConstraint() for contact: of all effects first normal, then tangential ones
     (across) */
  PetscErrorCode (*assemble_constraints)(SbEffect e, SbSpace space, PetscBool across);
  /* after a solve and SbConstraintsComputeForces(): sets `changed` when another solve is needed */
  PetscErrorCode (*update_active_set)(SbEffect e, SbSpace space, const PetscReal u[],
                                      PetscBool *changed);
  /* * after the first solve of an attempt, with the option time_of_impact: the fraction of the
     step, 0..1, at which the first new point comes into contact in the motion without contact; 1:
     none does */
  PetscErrorCode (*time_of_impact)(SbEffect e, PetscReal *part);
  /* * restitution: work of the forces of impacts in the last solve, in the frame of the other side,
     J */
  PetscErrorCode (*restitution)(SbEffect e, PetscReal *work);
  /* * multiplies coefficients of restitution by `share`, 0..1, in this step, and updates
     constraints */
  PetscErrorCode (*scale_restitution)(SbEffect e, PetscReal share);
  /* * contact, after the solve of a Newmark step: sets SbConstraint.velocity, the obstacle's, at
     its end */
  PetscErrorCode (*target_velocity)(SbEffect e, SbSpace space, const SbStage *stage);
  /* * output: lowers gap[nnode] of owned nodes, m, where a contact candidate is closer, and sets
     normal[nnode][3] there, towards the node */
  PetscErrorCode (*gap)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal gap[],
                        PetscReal normal[]);
  /* f += external force; of contact: but that of constraints */
  PetscErrorCode (*force)(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[]);
  /* A -= shift_k d force / d u + shift_v d force / d v by SbSpaceAddCellBlock(), for (a, b) and for
     (b, a) */
  PetscErrorCode (*tangent)(SbEffect e, SbSpace space, const SbStage *stage, Mat A);
  /* y[nnode][3] -= shift_k (d force / d u) x, N, of forces whose derivative is far from symmetric
     and which tangent() leaves out, for the direction x[nnode][3], m; right on owned nodes without
     communication; not with constraints beside the matrix */
  PetscErrorCode (*nonsymmetric)(SbEffect e, SbSpace space, const SbStage *stage,
                                 const PetscReal x[], PetscReal y[]);

  /*
    Barrier contact (-effect_NAME_response barrier), whose energy is part of the potential that
    Newton's method minimises (src/newton/newton.c).

    touching      - at the start t of a run, first step dt: adds pairs whose gap at u is too small,
    or little
                    larger. first: set at the first step, alike on all ranks; else nothing is done.
    begin_barrier - a step from t to t + dt begins with u0 and the speed of potential.c, m/s; where
    surfaces
                    touch when the run begins, u0 is changed, ghosts too. Sets `progress` to 0.
    meet          - after begin_barrier, for restitution: finds the impacts of the step, from u0 and
    v0. safe          - part: largest collision-free fraction of the motion from u0 to u1, and from
    the present
                    progress to 1; nactive: active pairs at u0.
    nearest       - where the smallest gap of all ranks at the last positions is below `gap`, m:
    lowers it
                    and sets `text` to the pair, in words.
    lag           - lagged friction, at u of an iterate or (solved) of a solution: may take normal
    forces and
                    slip directions from u; again: it did, and the step needs one more solve.
    potential     - energy += that at u, J; f += its gradient.
    hessian       - adds the blocks of its Hessian at u, or of the substitute (SbContactHessian),
    and to
                    r[nnode][3], N, the gradient of the substitute's quadratic model less the true
                    one.
    gap_forces    - f += the load that closes the gaps at u to first order; bound += half of force
    times gap,
                    which bounds the energy of the error by gaps, J.
    scale_width   - * multiplies a default width of the barrier by `factor`. Smaller: at once, not
    below what
                    rounding allows; changed: it did, alike on all ranks. Larger: when the next step
                    begins, if the barrier's energy grows by at most `growth`, J, and not beyond the
                    default.
  */
  PetscErrorCode (*touching)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt,
                             const PetscReal u[], PetscBool *first, SbInitialContacts *list);
  PetscErrorCode (*begin_barrier)(SbEffect e, SbSpace space, PetscReal t, PetscReal dt,
                                  PetscReal speed, PetscReal u0[]);
  PetscErrorCode (*meet)(SbEffect e, SbSpace space, PetscReal dt, const PetscReal u0[],
                         const PetscReal v0[]);
  PetscErrorCode (*safe)(SbEffect e, SbSpace space, const PetscReal u0[], const PetscReal u1[],
                         PetscReal *part, PetscInt *nactive);
  PetscErrorCode (*nearest)(SbEffect e, SbSpace space, PetscReal *gap, size_t size, char text[]);
  PetscErrorCode (*lag)(SbEffect e, SbSpace space, const PetscReal u[], PetscBool solved,
                        PetscBool *again);
  PetscErrorCode (*potential)(SbEffect e, SbSpace space, const PetscReal u[], PetscReal *energy,
                              PetscReal f[]);
  PetscErrorCode (*hessian)(SbEffect e, SbSpace space, const PetscReal u[], SbContactHessian kind,
                            SbBlocks *blocks, PetscReal r[]);
  PetscErrorCode (*gap_forces)(SbEffect e, SbSpace space, const PetscReal u[], PetscReal f[],
                               PetscReal *bound);
  PetscErrorCode (*scale_width)(SbEffect e, PetscReal factor, PetscReal growth, PetscBool *changed);

  /* after a step was accepted */
  PetscErrorCode (*accept)(SbEffect e, SbSpace space, const SbStage *stage);
  /* for checkpoints: history variables as n records of `nstate` numbers each, which identify
     entities by numbers that no partition changes; allocated here, the caller frees */
  PetscErrorCode (*save)(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records);
  /* replaces the history variables by this rank's of the n records of all ranks, u at the time t of
     the checkpoint. assemble_constraints() then gives the constraints of that time. */
  PetscErrorCode (*load)(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                         const PetscReal records[]);
  /* numbers for the history, with the names in `columns`, summed over the ranks; residual is the
     unbalanced force, on prescribed unknowns the reaction */
  PetscErrorCode (*history)(SbEffect e, SbSpace space, const SbStage *stage,
                            const PetscReal residual[], PetscReal values[]);
  /* * output: adds the active contact points */
  PetscErrorCode (*contact_points)(SbEffect e, SbSpace space, const SbStage *stage,
                                   SbContactPoints *list);
  /* a line for the summary at the end of a run, "": nothing */
  PetscErrorCode (*summary)(SbEffect e, SbSpace space, size_t size, char text[]);
  PetscErrorCode (*destroy)(SbEffect e);
} SbEffectOps;

/* The sets named by the option -effect_<name>_on. */
typedef struct {
  char option[2 * SB_NAME_MAX]; /* full name of the option, for messages */
  PetscInt n;
  char (*name)[SB_NAME_MAX]; /* [n] owned */
} SbEffectOn;

/* A type of effects. */
typedef struct {
  const char *name;
  size_t size; /* bytes of `data`, zero at first */
  PetscInt nrow, ncolumn;
  const SbOption
    *row; /* [nrow] its options; "on", and "time" where it is one formula, are read for it */
  const char *const *column; /* [ncolumn] history columns that each effect of the type has */
  SbEffectOps ops;
} SbEffectType;
extern const SbEffectType SbEffectGravity, SbEffectBodyForce, SbEffectTraction, SbEffectPressure,
  SbEffectPointForce, SbEffectFixed, SbEffectPrescribedDisplacement, SbEffectDamping,
  SbEffectContact;

struct _p_SbEffect {
  char name[SB_NAME_MAX];
  char type[SB_NAME_MAX];
  SbEffectOps ops;
  SbEffectOn on; /* empty for a type without the option */
  PetscInt nformula;
  SbFormula formula[5]; /* [nformula] of all its options; owned */
  SbFormula time;       /* one of them: factor on a load; NULL for a type without the option */
  PetscLogEvent event;  /* SbEff_<type>, around every operation from `setup` to `contact_points` */
  PetscBool linear; /* force does not depend on u: the tangent stays constant. Default PETSC_TRUE */
  PetscBool steady; /* no formula uses t: a static run multiplies the effect by the load factor */
  PetscReal from,
    until; /* s (or load factor): it acts at times t with from < t <= until; all by default */
  PetscBool dynamic; /* the run has inertia; known from set-up on */
  PetscBool saddle;  /* its constraints are to be solved with their multipliers as unknowns */
  PetscBool euler;   /* made for implicit Euler only. Default PETSC_FALSE */
  PetscBool
    springs; /* of contact: springs or friction, not constraints alone. Default PETSC_FALSE */
  PetscBool prescribed; /* it prescribes the nodes of its sets in all directions */
  PetscInt nstate;      /* numbers in a record of save() */
  PetscBool by_node;    /* the first of them is a node's original number. Default PETSC_FALSE */
  PetscReal
    progress; /* of barrier contact: obstacles are at this fraction of their path in the step */
  PetscReal
    width; /* of barrier contact: the smallest width, the gap below which surfaces repel, m */
  PetscReal work; /* of barrier contact: on the bodies in the last accepted step, this rank's, J */
  PetscInt ncolumn; /* history columns, known after set-up */
  const char *const
    *column;      /* [ncolumn] "force_x", ...: <name>_<column>; of the type or of `data` */
  char note[256]; /* note of the set-up for the run's header; "": none */
  void *data;     /* the type's own; freed with the effect */
};

/* Whether it acts at a time, or from that time on; ends of steps may be off by rounding. Not
   collective. */
PetscBool SbEffectActs(SbEffect e, PetscReal t);
PetscBool SbEffectActsAfter(SbEffect e, PetscReal t);
/* Calls an operation that the effect has, within its log event: SbEffectCall(e, force, space,
   stage, f). */
#define SbEffectCall(e, op, ...)                             \
  do {                                                       \
    const SbEffect sb_e_ = (e);                              \
    PetscCall(PetscLogEventBegin(sb_e_->event, 0, 0, 0, 0)); \
    PetscCall((*sb_e_->ops.op)(sb_e_, __VA_ARGS__));         \
    PetscCall(PetscLogEventEnd(sb_e_->event, 0, 0, 0, 0));   \
  } while (0)

extern const SbOption SbEffectRows[]; /* of all types */
/* Adds a type, which must live as long as the program, and its option rows. Not collective. */
PetscErrorCode SbEffectRegister(const SbEffectType *type);
/* Names of all types. Not collective. */
#define SB_EFFECT_TYPES 32
PetscInt SbEffectTypes(const char *names[SB_EFFECT_TYPES]);
/*
  SbEffectCreate - an effect of the scenario by its name, with its options read.

  Not collective, but to be called alike on all ranks. The caller destroys the effect with
  SbEffectDestroy(), also when its options were at fault.

  Options read: -effect_<name>_type (by default the name itself is the type) and those of the type.
  Errors: PETSC_ERR_USER_INPUT for an unknown type, with the nearest ones; PETSC_ERR_USER* from its
  options.
*/
PetscErrorCode SbEffectCreate(const char *name, SbEffect *e);
PetscErrorCode SbEffectDestroy(SbEffect *e); /* sets *e to NULL; NULL is accepted */
