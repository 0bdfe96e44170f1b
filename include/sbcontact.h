/*
  sbcontact.h - layer 7: contact of bodies with obstacles and with each other.

  A contact is an effect of the type `contact` (SbEffect.contact), with a table of operations of its
  own. The program calls the functions below, for all contacts of a scene at once; none of them
  depends on the partner, an obstacle or another body, or on the response (-effect_NAME_response).
*/
#pragma once
#include "sbeffect.h"
#include "sbsolver.h"

typedef struct _p_SbContact *SbContact;

/* An active contact point of a body. */
typedef struct {
  PetscInt id[3];      /* identify it within its effect, the same for any partition */
  PetscInt effect;     /* number of the effect in the scenario; filled by SbContactSetPoints() */
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
  PetscReal width;   /* distance from which on there is no force, m; 0: unknown */
} SbInitialContact;
/* Start with {0}; release with PetscFree(list->touch). */
typedef struct {
  PetscInt n, size;
  SbInitialContact *touch; /* [n] */
} SbInitialContacts;

/* How far bodies go in a direction, one by one. */
typedef struct {
  PetscInt n;         /* number of bodies */
  PetscReal *part;    /* [n] fraction of the direction that is free of collisions */
  PetscInt *group;    /* [n] a body that it touches, or itself; SbBodyStepsJoin() */
  PetscBool *touches; /* [n] it touches another one or an obstacle */
} SbBodySteps;

/* How bodies that overlap when a static run begins are parted. */
typedef enum {
  SB_PARTED_RIGIDLY,
  SB_PARTED_BY_SUPPORTS, /* moved apart with them, which push them together again */
  SB_PARTED_BY_SPRINGS   /* in the first load step */
} SbParted;

/*
  Operations of a response; a star: not collective. Each may be NULL: nothing is to be done. u, u0,
  u1: local displacements [nnode][3], ghosts up to date, m; v0: velocities, m/s; f, r: forces
  [nnode][3], N, right on owned nodes without communication. Numbers and lists are this rank's part.
  Energies and bounds are added, flags set, `part` lowered: their caller gives the first values.

  A response has an active set (constraints, or springs that an update changes), a potential, which
  Newton's method minimises with the energies of the bodies, or forces of the effect alone.
*/
typedef struct {
  /* at the start t of a run, first step dt: adds pairs whose gap at u is too small, or little
     larger. first: set at the first step, alike on all ranks; else nothing is done */
  PetscErrorCode (*initial_contacts)(SbContact c, SbSpace space, PetscReal t, PetscReal dt,
                                     const PetscReal u[], PetscBool *first,
                                     SbInitialContacts *list);
  /* of a static run, after initial_contacts(): adds pairs of bodies that overlap as whole, with the
     depth as a negative gap; all: false if some have no common direction. Alike on all ranks */
  PetscErrorCode (*overlaps)(SbContact c, SbSpace space, PetscBool *all, SbInitialContacts *list);
  /* of a static run, then: warns of what overlapped, once, and says how it was parted */
  PetscErrorCode (*warn_overlaps)(SbContact c, SbSpace space, SbParted how);
  /* then, where surfaces touch that could not be moved apart rigidly: moves their vertices, u is
     changed, ghosts too; moved: it was, alike on all ranks */
  PetscErrorCode (*part)(SbContact c, SbSpace space, PetscReal t, PetscReal u[], PetscBool *moved);
  /* an attempt at a step from t to t + dt begins with u0 and the speed of SbContactSetBeginStep(),
     m/s */
  PetscErrorCode (*begin_step)(SbContact c, SbSpace space, PetscReal t, PetscReal dt,
                               PetscReal speed, PetscReal u0[]);
  /* * the same attempt goes on from its last solution; without it begin_step() begins again */
  PetscErrorCode (*solve_again)(SbContact c, SbSpace space);
  /* * with restitution, after begin_step() of all contacts: finds the impacts of the step from u0
     and v0 */
  PetscErrorCode (*find_impacts)(SbContact c, SbSpace space, PetscReal dt, const PetscReal u0[],
                                 const PetscReal v0[]);

  /* the active set before the first solve, u as predicted at the end of the step */
  PetscErrorCode (*start_active_set)(SbContact c, SbSpace space, const PetscReal u[]);
  /* * SbSpaceAddConstraint(): of all contacts first normal, then tangential ones (across) */
  PetscErrorCode (*assemble_constraints)(SbContact c, SbSpace space, PetscBool across);
  /* after a solve and SbConstraintsComputeForces(): sets `changed` when another solve is needed */
  PetscErrorCode (*update_active_set)(SbContact c, SbSpace space, const PetscReal u[],
                                      PetscBool *changed);
  /* * after the first solve of an attempt, with SbContact.ends_step: the fraction of the step,
     0..1, at which the first new point comes into contact in the motion without contact; 1: none
     does */
  PetscErrorCode (*time_of_impact)(SbContact c, PetscReal *part);
  /* * after the solve of a Newmark step: sets SbConstraint.velocity, the obstacle's, at its end */
  PetscErrorCode (*target_velocity)(SbContact c, SbSpace space, const SbStage *stage);

  /* the potential: energy += that at u, J; f += its gradient */
  PetscErrorCode (*gradient)(SbContact c, SbSpace space, const PetscReal u[], PetscReal *energy,
                             PetscReal f[]);
  /* adds the blocks of its Hessian at u, or of the substitute (SbContactHessian), and to r, N, the
     gradient of the substitute's quadratic model less the true one */
  PetscErrorCode (*hessian)(SbContact c, SbSpace space, const PetscReal u[], SbContactHessian kind,
                            SbBlocks *blocks, PetscReal r[]);
  /* part: largest collision-free fraction of the motion from u0 to u1, and from the present
     progress to 1; nactive: active pairs at u0; bodies: NULL, or lowered to the same by bodies */
  PetscErrorCode (*max_step)(SbContact c, SbSpace space, const PetscReal u0[], const PetscReal u1[],
                             SbBodySteps *bodies, PetscReal *part, PetscInt *nactive);
  /* exact constraints: adds the rows of those that are active at u */
  PetscErrorCode (*constraints)(SbContact c, SbSpace space, const PetscReal u[],
                                SbConstraintRows *rows);
  /* adds rows of the directions that contact holds at u, of whatever stiffness */
  PetscErrorCode (*holding)(SbContact c, SbSpace space, const PetscReal u[],
                            SbConstraintRows *rows);
  /* lagged friction, at u of an iterate or (solved) of a solution: may take normal forces and slip
     directions from u; again: it did, and the step needs one more solve */
  PetscErrorCode (*update_friction)(SbContact c, SbSpace space, const PetscReal u[],
                                    PetscBool solved, PetscBool *again);

  /* an attempt failed, why: in words; again: the next one is to have the same length, with a
     response that needs no multipliers */
  PetscErrorCode (*fall_back)(SbContact c, SbSpace space, const char *why, PetscBool *again);
  /* the active set has not settled after `rounds` solves: sets SbContact.unsettled */
  PetscErrorCode (*explain)(SbContact c, SbSpace space, PetscInt rounds);

  /* * restitution: work of the forces of impacts in the last solve, in the frame of the other side,
     J */
  PetscErrorCode (*impact_work)(SbContact c, PetscReal *work);
  /* * multiplies coefficients of restitution by `share`, 0..1, in this step, and updates
     constraints */
  PetscErrorCode (*scale_restitution)(SbContact c, PetscReal share);

  /* * lowers gap[nnode] of owned nodes, m, where a contact candidate is closer, and sets
     normal[nnode][3] there, towards the node */
  PetscErrorCode (*gap)(SbContact c, SbSpace space, const SbStage *stage, PetscReal gap[],
                        PetscReal normal[]);
  /* * adds the active contact points */
  PetscErrorCode (*points)(SbContact c, SbSpace space, const SbStage *stage, SbContactPoints *list);
  /* where the smallest gap of all ranks at the last positions is below `gap`, m: lowers it and sets
     `text` to the pair, in words */
  PetscErrorCode (*nearest)(SbContact c, SbSpace space, PetscReal *gap, size_t size, char text[]);
  /* warns of what a run leaves unfinished */
  PetscErrorCode (*warn_at_end)(SbContact c, SbSpace space);
  /* f += the load that closes the gaps at u to first order; bound += half of force times gap, which
     bounds the energy of the error by gaps, J */
  PetscErrorCode (*gap_forces)(SbContact c, SbSpace space, const PetscReal u[], PetscReal f[],
                               PetscReal *bound);
  /* * multiplies a default width by `factor`. Smaller: at once, not below what rounding allows;
     changed: it did, alike on all ranks. Larger: when the next step begins, if the energy grows by
     at most `growth`, J, and not beyond the default */
  PetscErrorCode (*scale_width)(SbContact c, PetscReal factor, PetscReal growth,
                                PetscBool *changed);
} SbContactOps;

/* A contact of the scene; the first member of its effect's data. */
struct _p_SbContact {
  SbEffect effect;         /* its name, options, loads and history */
  PetscInt number;         /* of the effect in the scenario */
  const SbContactOps *ops; /* of its response */
  PetscBool springs;       /* springs or friction, not constraints alone */
  PetscBool exact;         /* its potential has exact constraints */
  PetscBool rigid;         /* its potential has multipliers: forces of constraints, impulses at
                              impact */
  PetscBool saddle;        /* constraints are to be solved with their multipliers as unknowns */
  PetscBool ends_step;     /* a step ends at the first time of impact */
  PetscReal restitution;   /* coefficient; 0: none */
  PetscReal progress;      /* of a potential: obstacles are at this fraction of their path */
  PetscReal width;         /* the smallest gap below which surfaces repel, m */
  PetscReal work;          /* on the bodies in the last accepted step, this rank's, J */
  PetscReal given;         /* strain energy given by moving vertices apart when the run began, J:
                              SbContactGive(); on rank 0, part of the work */
  char unsettled[512];     /* why the solution of this step is none, in words; "": it is one */
};

/* The contacts of a scene. All zero: there is none. */
typedef struct {
  SbSpace space; /* borrowed */
  PetscInt n, nactive_set, npotential;
  SbContact *contact;    /* [n] borrowed, in the order of the scenario */
  SbContact *active_set; /* [nactive_set] those that have one */
  SbContact *potential;  /* [npotential] those that have one */
  SbContact ends_step;   /* the first one with the option time_of_impact; NULL: none */
  PetscInt nexact;       /* potentials with exact constraints */
  PetscInt nrigid;       /* potentials with multipliers */
  PetscBool saddle;      /* some of them have their forces as unknowns */
  PetscInt nconstraint;  /* those with constraints */
  PetscInt nrestitution; /* those with restitution */
  PetscReal speed;       /* of the present step, m/s: SbContactSetBeginStep() */
  struct {
    Vec U0, V0;     /* state at the start of the step; borrowed */
    PetscReal dt;   /* length of the step, s */
    PetscReal left; /* factor on the coefficients of restitution in this step */
    int reductions;
  } bounce; /* only with restitution */
} SbContactSet;

extern const SbEffectType SbEffectContact;

/* Whether an effect is a contact with a potential. */
static inline PetscBool SbEffectHasPotential(SbEffect e)
{
  return (PetscBool)(e->contact && e->contact->ops->gradient);
}

/* The contacts among n effects that are set up. Borrowed: space and effects. Not collective. */
PetscErrorCode SbContactSetCreate(SbSpace space, PetscInt n, const SbEffect effect[],
                                  SbContactSet *contacts);
PetscErrorCode SbContactSetDestroy(SbContactSet *contacts);
/* Whether it is with an obstacle, not of bodies with each other. Not collective. */
PetscBool SbContactHasObstacle(SbContact contact);
/* least[nbody]: distances from the obstacle of contact k at t to the nearest vertex of each body at
   U, m, negative inside; PETSC_MAX_REAL for bodies that it is not for. Collective. */
PetscErrorCode SbContactSetDistances(const SbContactSet *contacts, PetscInt k, PetscReal t, Vec U,
                                     PetscReal least[]);

/*
  In the order of a run; collective.

  Start     - a run begins at t with U, dt being the length of its first step: bodies that touch, in
              a static run also those that overlap, are moved apart rigidly, as far as potentials
              ask for it and supports let them.
  Shift     - then, in a static run: supported bodies that touch or overlap, each other or an
              obstacle, and bodies between them, are moved apart rigidly, by S, as if nothing held
              them, so that a solution can push them together again; of: the first potential with
              such bodies, NULL: nothing was moved. It warns of what overlapped.
  FindPenetrated - the first contact of nodes with some inside its obstacle, where supports hold
              every body along all axes; NULL: there is none.
  Part      - then, for each of the potentials k: vertices of surfaces that still touch are moved
              apart; moved: some were.
  Give      - by the start the bodies got this energy from a contact, J, of which `counted` is in
              the work of its steps already.
  Resume    - after effects have loaded their state from a checkpoint: assembles the constraints.
  BeginStep - an attempt at a step from t to t + dt begins with U0 and V0 (NULL in a static run),
              unchanged until the step ends. speed: SbModelStepSpeed(), the scale of tolerances,
              m/s. again: the same attempt goes on from its last solution, where potentials keep
              their friction and multipliers.
*/
PetscErrorCode SbContactSetStart(const SbContactSet *contacts, PetscReal t, PetscReal dt, Vec U);
PetscErrorCode SbContactSetPart(const SbContactSet *contacts, PetscInt k, PetscReal t, Vec U,
                                PetscBool *moved);
PetscErrorCode SbContactSetShift(const SbContactSet *contacts, PetscReal t, PetscReal dt, Vec U,
                                 Vec S, SbContact *of);
PetscErrorCode SbContactSetFindPenetrated(const SbContactSet *contacts, PetscReal t, Vec U,
                                          SbContact *found);
/* The longest way of a point within `size`, m, of an obstacle's axis in this step, m, over all
   obstacles. Not collective. */
PetscReal SbContactSetObstacleWay(const SbContactSet *contacts, PetscReal size);
/* Not collective. */
void SbContactGive(SbContact c, SbSpace space, PetscReal energy, PetscReal counted);
PetscErrorCode SbContactSetResume(const SbContactSet *contacts);
PetscErrorCode SbContactSetBeginStep(SbContactSet *contacts, PetscReal t, PetscReal dt,
                                     PetscReal speed, PetscBool again, Vec U0, Vec V0);

/*
  The active set, where contacts->nactive_set > 0; collective.

  Start   - before the first solve: U, the guess at the end of the step, is projected onto the
            constraints.
  Update  - after a solve with the residual R without constraints; `again`: the set has changed, U
            is projected onto the new constraints, and another solve is needed.
  TimeOfImpact - after the first solve: part = fraction of the step at which the first new point of
            any rank comes into contact, 1: none.
  ProjectVelocity - V <- the nearest velocity that keeps active contacts closed, after a step of the
            length dt that ended at t with the displacement U.
*/
PetscErrorCode SbContactSetStartActiveSet(const SbContactSet *contacts, Vec U);
PetscErrorCode SbContactSetUpdateActiveSet(SbContactSet *contacts, Vec U, Vec R, PetscBool *again);
PetscErrorCode SbContactSetTimeOfImpact(const SbContactSet *contacts, PetscReal *part);
PetscErrorCode SbContactSetProjectVelocity(const SbContactSet *contacts, PetscReal t, PetscReal dt,
                                           Vec U, Vec V);

/*
  The potential as Newton's method sees it, where contacts->npotential > 0; collective but for
  Advance.

  Advance  - obstacles are at the fraction `progress` of their path in the step.
  MaxStep  - largest collision-free fraction of the motion from X to X - Y over all ranks, by
             continuous collision detection, and the number of active pairs.
  BodySteps - the same by bodies: Z is, for each body, the fraction of Y that is free of collisions
             with the motions of all; bodies that touch each other or are coupled keep a common
             one. part: the least of them, as of MaxStep; farther: others are larger. MaxStep of Z
             may be below 1: a body that is held up is in another one's way. alone[nbody]: what
             touches nothing, and is not held up; NULL: not needed.
  Gradient - F += scale times the gradient of the energy at U, N; free_only: not where prescribed.
             energy: J, or NULL.
  Hessian  - its blocks, and R as the operation `hessian` says, zero at prescribed unknowns.
  UpdateFriction - lagged friction and restitution from X, an iterate of the step or (solved) its
             solution; again: solve again.
*/
void SbContactSetAdvance(const SbContactSet *contacts, PetscReal progress);
PetscErrorCode SbContactSetMaxStep(const SbContactSet *contacts, Vec X, Vec Y, PetscReal *part,
                                   PetscInt *nactive);
PetscErrorCode SbContactSetBodySteps(const SbContactSet *contacts, Vec X, Vec Y, Vec Z,
                                     PetscBool alone[], PetscReal *part, PetscBool *farther);
PetscErrorCode SbContactSetGradient(const SbContactSet *contacts, Vec U, PetscReal scale,
                                    PetscBool free_only, PetscReal *energy, Vec F);
PetscErrorCode SbContactSetHessian(const SbContactSet *contacts, Vec U, SbContactHessian kind,
                                   SbBlocks *blocks, Vec R);
PetscErrorCode SbContactSetUpdateFriction(SbContactSet *contacts, Vec X, PetscBool solved,
                                          PetscBool *again);
/* The rows of exact constraints that are active at X, where contacts->nexact > 0; collective. */
PetscErrorCode SbContactSetConstraints(const SbContactSet *contacts, Vec X, SbConstraintRows *rows);
/* A failed attempt at a step is to be repeated as it is (again), with another response; why it
   failed, in words. Collective. */
PetscErrorCode SbContactSetFallBack(const SbContactSet *contacts, const char *why,
                                    PetscBool *again);
/* The active set has not settled after `rounds` solves: SbContactSetUnsettled() says where.
   Collective. */
PetscErrorCode SbContactSetExplain(const SbContactSet *contacts, PetscInt rounds);
/* Rows of the directions in which potentials hold bodies at X, of whatever response; collective. */
PetscErrorCode SbContactSetHolding(const SbContactSet *contacts, Vec X, SbConstraintRows *rows);
/* Why the solution of a step is none though Newton's method has converged, in words; "": it is one.
   Not collective, the same on all ranks. */
const char *SbContactSetUnsettled(const SbContactSet *contacts);
/* Work of potentials on the bodies in the last accepted step, this rank's, J. */
PetscReal SbContactSetWork(const SbContactSet *contacts);

/*
  Output, after the step that ended at t with the displacement U and with its reactions known;
  collective.

  Gap     - G = gap of each node along the normal of the closest candidate surface, m; 0 where
            nothing is near.
  Force   - F = contact forces on the nodes, N.
  Points  - appends the active contact points of this rank.
  Nearest - the closest pair in the last attempt at a step, in words; "": none.
  WarnAtEnd - of what a run leaves unfinished: surfaces that are still in each other.
*/
PetscErrorCode SbContactSetGap(const SbContactSet *contacts, PetscReal t, Vec U, Vec G);
PetscErrorCode SbContactSetForce(const SbContactSet *contacts, PetscReal t, Vec U, Vec F);
PetscErrorCode SbContactSetPoints(const SbContactSet *contacts, PetscReal t, Vec U,
                                  SbContactPoints *list);
PetscErrorCode SbContactSetNearest(const SbContactSet *contacts, size_t size, char text[]);
PetscErrorCode SbContactSetWarnAtEnd(const SbContactSet *contacts);

/* For the estimate of contact's error; collective. GapForces: F = nodal forces of potentials that
   the gaps at U leave beyond exact contact, N, zero at prescribed unknowns; bound on their energy
   over all ranks, J. ScaleWidths: widths times `factor`, growing by `growth` at most; changed: some
   did. */
PetscErrorCode SbContactSetGapForces(const SbContactSet *contacts, Vec U, Vec F, PetscReal *bound);
PetscErrorCode SbContactSetScaleWidths(const SbContactSet *contacts, PetscReal factor,
                                       PetscReal growth, PetscBool *changed);
