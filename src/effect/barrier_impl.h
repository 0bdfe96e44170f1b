/*
  barrier_impl.h - the response `barrier`: what barrier.c, barrier_forces.c and barrier_output.c share.
*/
#pragma once
#include "barrier.h"
#include "overlap.h"
#include "restitution.h"

/* A pair below its width, at the places that the effect knows. */
typedef struct {
  PetscInt pair;
  PetscReal gap; /* m */
  SbDistance at;
} Active;

/* A pair that friction acts on in this step. */
typedef struct {
  SbContactPair pair;
  PetscReal weight[4], n[3], force; /* mu N, N */
  PetscReal carry
    [3]; /* by which the obstacle's point there moves on in the step beyond its vertices: rotation, m; with the sign of its weights */
  PetscReal slip[3]; /* where the second derivative was asked for last, m */
  PetscBool turns,
    sticks; /* slip went the other way since, so Newton's method takes it for one that sticks */
} Rub;

/* What pushes one way along a direction in this step: what overlaps, or bounces. */
typedef struct {
  PetscInt n, v[5];
  PetscReal weight[5], normal[3];
  PetscReal goal, stiffness; /* of normal . sum weight x, m; N/m */
  PetscReal start, depth;    /* that sum and the overlap when the step began, m */
  PetscBool held;            /* it may pull, too: it pushed when its goal was changed */
  PetscReal arrives;         /* speed of approach of what bounces, m/s */
} Spring;

typedef struct {
  SbBarrierScene scene;
  void *data; /* of the type */
  PetscErrorCode (*destroy)(SbEffect e);
  SbContactMesh mesh;
  SbContactPairs pairs;
  PetscReal width, pressure; /* as given; 0: by body */
  PetscReal *w, *k;          /* [nbody+1] of each body, m, Pa; the obstacle's: none smaller */
  PetscReal scale;           /* of w: of what it is by default, 0..1 (-accuracy) */
  PetscReal wider,
    growth; /* by what factor it may grow when the next step begins, 0: it stays; and the energy of gaps with it, J */
  PetscBool verify, begun, looked; /* the run has begun; what is in each other was looked for */
  PetscReal *x, *u;        /* [nvertex][3] places, m; [nnode_owned][3] displacement that they belong to */
  PetscReal *start;        /* [nvertex][3] when the step began */
  PetscReal *from, *to;    /* [obstacle's vertices][3] at the start and the end of the step */
  PetscReal progress, now; /* how far on that way it is; at which x was made */
  PetscReal *other;        /* [nvertex][3] where a motion leads */
  PetscBool known;         /* x and active are up to date for u and progress */
  PetscInt nactive, size;
  Active *active;
  PetscInt nrub, rub_size;
  Rub *rub;
  SbContactBlocks blocks;    /* of the last second derivative */
  PetscInt nnext, next_size; /* the same with the places and forces at the end of the step */
  Rub *next;
  SbPose pose[2]; /* of the obstacle at the start and the end of the step */
  PetscInt lags,
    nlag; /* solves of a step, at most, each with the friction of the one before; those of this step */
  PetscReal lag_tolerance, lag; /* of what is left then; what it is, a part of mu N of all pairs */
  PetscReal least_lag; /* of the solutions of this step; how many came since without one that is less */
  PetscInt nstuck;
  PetscBool stuck_said;
  PetscReal most_lag;               /* of the run */
  PetscReal slip;                   /* e of friction, m */
  PetscBool overlapping, announced; /* things are in each other; that was said */
  PetscBool parted;                 /* they were when this load step began */
  SbContactOverlap overlap;
  SbOverlap parting;
  PetscReal stiffer;             /* of springs, by what they reached in the last steps */
  PetscInt nspring, spring_size; /* those of overlap on every rank, */
  PetscInt nbounce;              /* then these, of pairs of this rank, that bounce */
  Spring *spring;
  SbRestitution bounce;
  PetscReal least, shortest; /* smallest gap and shortest safe part of the run */
  PetscInt most;             /* pairs */
  SbPairs columns;
  PetscReal energy; /* of the gaps, when the step began, then when it ended, J; this rank's, as all below */
  PetscReal obstacle_power; /* by the obstacle over its way in this step with the forces at its start, J */
  PetscReal step_work;      /* on the bodies in the last step, J */
  PetscReal work, friction_loss; /* since the start, J */
} Barrier;

static inline PetscReal width_of(const Barrier *b, const SbContactPair *pair)
{
  const PetscInt *part = b->mesh->part;

  return PetscMin(b->w[part[pair->v[0]]], b->w[part[pair->v[pair->side ? 1 : 2]]]);
}

static inline PetscReal pressure_of(const Barrier *b, const SbContactPair *pair)
{
  const PetscInt *part = b->mesh->part;

  return PetscMin(b->k[part[pair->v[0]]], b->k[part[pair->v[pair->side ? 1 : 2]]]);
}

/* Whether this rank counts the pair. */
static inline PetscBool counts(const Barrier *b, const SbContactPair *pair)
{
  return (PetscBool)b->mesh->own[pair->v[pair->v[0] < b->mesh->nbody_vertex ? 0 : 1]];
}

/* The places at the local displacements u, and the pairs below their width, in the order of their numbers. Collective. */
PetscErrorCode SbBarrierLook(Barrier *b, const PetscReal u[]);
/* Normal force of a pair, N, its energy, J, and the gradient of that by the pair's vertices, N. */
PetscReal SbBarrierPush(const Barrier *b, const Active *a, PetscReal *energy, PetscReal gradient[12]);
/* Tangential slip u of a pair since the step began, m; its length. */
PetscReal SbBarrierSlip(const Barrier *b, const Rub *rub, PetscReal u[3]);
/* f0'/y of the slip y, 1/m. */
static inline PetscReal SbBarrierSlope(const Barrier *b, PetscReal y)
{
  return y < b->slip ? 2. / b->slip - y / PetscSqr(b->slip) : 1. / y;
}
/* Normal forces and directions at the places known, those of the end of the step (`end`) or its start, into `next`. */
PetscErrorCode SbBarrierFindFriction(Barrier *b, PetscBool end);
/* What is in `next` counts, and the other way round. */
void SbBarrierSwapFriction(Barrier *b);
/* By what friction would change with the normal forces and directions at the end of the step, which are found, as part of mu N: `lag`. Collective. */
PetscErrorCode SbBarrierLag(Barrier *b);
/* Energy of friction, J, its gradient by the pair's vertices, N. */
PetscReal SbBarrierRub(const Barrier *b, const Rub *rub, PetscReal gradient[12]);
/* Finds what is in each other at the places known, and the springs that part it in a step of length dt, s; `first` of a run: errors where they cannot. Collective. */
PetscErrorCode SbBarrierPart(SbEffect e, SbSpace space, PetscReal dt, PetscBool first);
/* normal . sum weight x of a spring at the places known, m. */
static inline PetscReal SbBarrierSpringPlace(const Barrier *b, const Spring *spring)
{
  PetscReal g = 0.;

  for (PetscInt k = 0; k < spring->n; k++)
    g += spring->weight[k] * SbDot3(spring->normal, b->x + 3 * spring->v[k]);
  return g;
}
/* Its force, N, and the gradient of its energy by its vertices, N. */
static inline PetscReal SbBarrierSpring(const Barrier *b, const Spring *spring, PetscReal gradient[15])
{
  const PetscReal all = spring->stiffness * (spring->goal - SbBarrierSpringPlace(b, spring)),
                  force = spring->held ? all : PetscMax(0., all);

  for (int k = 0; k < 15; k++) gradient[k] = -force * spring->weight[k / 3] * spring->normal[k % 3];
  return force;
}
/* f += sign times the gradient of all energies at the places known, N; their sum over the pairs that this rank counts, J. */
PetscReal SbBarrierGradient(const Barrier *b, PetscReal sign, PetscReal f[]);

/* Places of the obstacle's vertices after the part `progress` of its way, into x[nvertex][3]. */
void SbBarrierPlaceObstacle(const Barrier *b, PetscReal progress, PetscReal x[]);

/* Appends a spring of this step. Not collective. */
PetscErrorCode SbBarrierAddSpring(Barrier *b, const Spring *spring);

/* Operations of the effect (sbeffect.h). */
PetscErrorCode SbEffectMeet_Barrier(SbEffect e, SbSpace s, PetscReal dt, const PetscReal u0[],
                                    const PetscReal v0[]);
PetscErrorCode SbEffectRestitution_Barrier(SbEffect e, PetscReal *work);
PetscErrorCode SbEffectScaleRestitution_Barrier(SbEffect e, PetscReal share);
PetscErrorCode SbEffectForce_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[]);
PetscErrorCode SbEffectPotential_Barrier(SbEffect e, SbSpace s, const PetscReal u[], PetscReal *energy,
                                         PetscReal f[]);
PetscErrorCode SbEffectGapForces_Barrier(SbEffect e, SbSpace s, const PetscReal u[], PetscReal f[],
                                         PetscReal *bound);
PetscErrorCode SbEffectHessian_Barrier(SbEffect e, SbSpace s, const PetscReal u[], SbContactHessian kind,
                                       SbBlocks *blocks, PetscReal r[]);
PetscErrorCode SbEffectContactForce_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[]);
PetscErrorCode SbEffectHistory_Barrier(SbEffect e, SbSpace s, const SbStage *stage, const PetscReal r[],
                                       PetscReal values[]);
PetscErrorCode SbEffectContactPoints_Barrier(SbEffect e, SbSpace s, const SbStage *stage,
                                             SbContactPoints *list);
PetscErrorCode SbEffectGap_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal gap[],
                                   PetscReal normal[]);
PetscErrorCode SbEffectSummary_Barrier(SbEffect e, SbSpace s, size_t size, char text[]);
PetscErrorCode SbEffectNearest_Barrier(SbEffect e, SbSpace s, PetscReal *gap, size_t size, char text[]);
