/*
  sbeffect.h - layer 7: effects: loads, supports, damping; contact has further operations, in
  sbcontact.h.

  An operation left NULL means "nothing to do" and is never called: the model sorts the effects into
  one list per operation after set-up. An effect that the scenario does not name is never created.
*/
#pragma once
#include "sbfem.h"

typedef struct _p_SbEffect *SbEffect;

/*
  Operations; a star: not collective. u, u0, u1: local displacements [nnode][3], ghosts up to date,
  m; v0: velocities, m/s; f, r0, r1, residual: forces [nnode][3], N, right on owned nodes without
  communication. Numbers are this rank's part. Work is added: the caller gives the first value.
*/
typedef struct {
  /* reads -effect_<name>_...; scope = {"effect", <type>, <name>}; called once, by
     SbEffectCreate() */
  PetscErrorCode (*setfromoptions)(SbEffect e, const SbScope *scope);
  /* declares groups of nodes that it couples, by SbSpaceCouple(), before any effect is set up;
     tangent() adds their blocks by SbSpaceAddCoupling(). Collective */
  PetscErrorCode (*couplings)(SbEffect e, SbSpace space);
  /* finds its nodes, facets, cells; marks prescribed unknowns by SbSpacePrescribe() */
  PetscErrorCode (*setup)(SbEffect e, SbSpace space);
  /* * writes prescribed displacements at time t into space->fixed_value (rows as in
     space->fixed_node), m */
  PetscErrorCode (*prescribe)(SbEffect e, SbSpace space, PetscReal t);
  /* * rotating supports: work of reactions r0 at t0, r1 at t1 along the arc less that along the
     chord, J */
  PetscErrorCode (*turning_work)(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1,
                                 const PetscReal r0[], const PetscReal r1[], PetscReal *work);
  /* * moving supports: adds, over its own nodes with all three displacements, for their positions
     x0 at t0 and x1 at t1 relative to any point, m: 1, x0[3], x1[3], x1 x0^T [9] (row-major); with
     displacements times factor[2] */
  PetscErrorCode (*moments)(SbEffect e, SbSpace space, PetscReal t0, PetscReal t1,
                            const PetscReal factor[2], PetscReal sum[16]);
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
  /* * pressure[nbody] += the pressure of a load on the volume of all cells of a body, by
     SbSpaceAddVolume(), Pa, at t */
  PetscErrorCode (*volume_pressure)(SbEffect e, PetscReal t, PetscReal pressure[]);
  /* of a load step of a static run. stage NULL: it begins, with the history of the last one; else
     it was solved: what changes there, as a tie that tears; changed: the step is to be solved once
     more from its end, with that. accept() follows where nothing changes. Collective */
  PetscErrorCode (*settle)(SbEffect e, SbSpace space, const SbStage *stage, PetscBool *changed);
  /* after a step was accepted */
  PetscErrorCode (*accept)(SbEffect e, SbSpace space, const SbStage *stage);
  /* for checkpoints: history variables as n records of `nstate` numbers each, which identify
     entities by numbers that no partition changes; allocated here, the caller frees */
  PetscErrorCode (*save)(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records);
  /* replaces the history variables by this rank's of the n records of all ranks, u at the time t of
     the checkpoint. SbContactSetResume() then gives the constraints of that time. */
  PetscErrorCode (*load)(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                         const PetscReal records[]);
  /* numbers for the history, with the names in `columns`, summed over the ranks; residual is the
     unbalanced force, on prescribed unknowns the reaction */
  PetscErrorCode (*history)(SbEffect e, SbSpace space, const SbStage *stage,
                            const PetscReal residual[], PetscReal values[]);
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
  SbEffectCavity, SbEffectPointForce, SbEffectFoundation, SbEffectMembrane, SbEffectMass,
  SbEffectFrame, SbEffectWater, SbEffectTie, SbEffectPeriodic, SbEffectJoint, SbEffectSpring,
  SbEffectCable, SbEffectFixed, SbEffectPrescribedDisplacement, SbEffectDamping, SbEffectTorque;

struct _p_SbEffect {
  char name[SB_NAME_MAX];
  char type[SB_NAME_MAX];
  SbEffectOps ops;
  SbEffectOn on; /* empty for a type without the option */
  SbEffectOn to; /* likewise of the option "to": what the sets in `on` are tied to */
  PetscInt nformula;
  SbFormula formula[9]; /* [nformula] of all its options; owned */
  SbFormula time;       /* one of them: factor on a load; NULL for a type without the option */
  PetscLogEvent event;  /* SbEff_<type>, around every operation from `setup` to `history` */
  PetscBool linear; /* force does not depend on u: the tangent stays constant. Default PETSC_TRUE */
  PetscBool steady; /* no formula uses t: a static run multiplies the effect by the load factor */
  PetscReal from,
    until; /* s (or load factor): it acts at times t with from < t <= until; all by default */
  PetscBool dynamic;      /* the run has inertia; known from set-up on */
  PetscBool no_potential; /* its force depends on the path: its work on a closed one is not zero */
  PetscBool holds;        /* its springs may hold a body that nothing else holds */
  PetscBool stiff; /* the stable step of explicit integrators does not know its springs, dampers */
  PetscInt njoined, joined[2]; /* bodies that a joint joins, from set-up on: they may overlap */
  PetscBool prescribed;        /* it prescribes the nodes of its sets in all directions */
  PetscInt nstate;             /* numbers in a record of save() */
  PetscBool by_node; /* the first of them is a node's original number. Default PETSC_FALSE */
  PetscInt ncolumn;  /* history columns, known after set-up */
  const char *const
    *column;      /* [ncolumn] "force_x", ...: <name>_<column>; of the type or of `data` */
  char note[256]; /* note of the set-up for the run's header; "": none */
  void *data;     /* the type's own; freed with the effect */
  struct _p_SbContact *contact; /* sbcontact.h: part of `data`; NULL: it is no contact */
};

/* Whether it acts at a time, or from that time on; ends of steps may be off by rounding. Not
   collective. */
PetscBool SbEffectActs(SbEffect e, PetscReal t);
PetscBool SbEffectActsAfter(SbEffect e, PetscReal t);
/* The effects, of n, whose forces have no potential, in words for a message; "": there are none.
   Not collective. */
void SbEffectsWithoutPotential(PetscInt n, const SbEffect effect[], size_t size, char text[]);
/* Calls an operation that the effect has, within its log event: SbEffectCall(e, force, space,
   stage, f). */
#define SbEffectCall(e, op, ...)                             \
  do {                                                       \
    const SbEffect sb_e_ = (e);                              \
    PetscCall(PetscLogEventBegin(sb_e_->event, 0, 0, 0, 0)); \
    PetscCall((*sb_e_->ops.op)(sb_e_, __VA_ARGS__));         \
    PetscCall(PetscLogEventEnd(sb_e_->event, 0, 0, 0, 0));   \
  } while (0)

/* Warns once of each support of effect[n] that prescribes another value, in its last evaluation, at
   time t, than an earlier one has at the same node. Collective. */
PetscErrorCode SbSupportsWarn(SbSpace space, PetscInt n, SbEffect effect[], PetscReal t);
extern const SbOption SbEffectRows[]; /* of all types */
/* Adds a type, which must live as long as the program, and its option rows. Not collective. */
PetscErrorCode SbEffectRegister(const SbEffectType *type);
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

/* A path given by the options displacement, angle, axis and axis_point; e owns the formulas, and is
   no longer steady where one uses t. position: whether they may use x, y, z. Error:
   PETSC_ERR_USER_INPUT. */
typedef struct {
  SbFormula displacement[3], angle; /* m, degrees */
  PetscReal axis[3], point[3];      /* unit vector; m */
} SbPath;
PetscErrorCode SbPathRead(SbEffect e, const SbScope *scope, PetscBool position, SbPath *path);

/* Boundary facets of owned and ghost cells in the named sets, each once even when it is in several
   of the sets. Collective; the caller releases the array with PetscFree(). Errors
   (PETSC_ERR_USER_INPUT, alike on all ranks): no such set; a set without boundary facets. */
PetscErrorCode SbEffectFacets(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacet **facets);
/* shared[nbody]: how many of these facets of each body are in both. Collective; errors as above. */
PetscErrorCode SbEffectShared(SbSpace space, const SbEffectOn *one, const SbEffectOn *two,
                              PetscInt shared[]);
