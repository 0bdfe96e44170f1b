/*
  barrier_impl.h - the response `barrier`: shared by the files barrier*.c.
*/
#pragma once
#include "barrier.h"
#include "overlap.h"
#include "restitution.h"

/* A pair with a gap below the width, at the current positions. */
typedef struct {
  PetscInt pair;
  PetscReal gap; /* m */
  SbDistance at;
} Active;

/* A pair with friction in this step. */
typedef struct {
  SbContactPair pair;
  PetscReal weight[4], n[3], force; /* mu N, N */
  PetscReal rotation
    [3]; /* displacement of the obstacle's contact point by rotation, beyond that of its vertices, m; with the sign of its weights */
  PetscReal slip[3];       /* at the last Hessian, m */
  PetscBool turns, sticks; /* slip has reversed since: treated as sticking in the Hessian */
} FrictionPair;

/* A one-sided spring along a direction in this step: separates an overlap, or enforces restitution. */
typedef struct {
  PetscInt n, v[5];
  PetscReal weight[5], normal[3];
  PetscReal goal, stiffness; /* of normal . sum weight x, m; N/m */
  PetscReal start, depth;    /* that sum and the penetration at the start of the step, m */
  PetscBool held;            /* two-sided: it was active when its goal was changed */
  PetscReal approach;        /* restitution: speed of approach, m/s */
} Spring;

typedef struct {
  SbBarrierScene scene;
  void *data; /* data of the type contact */
  PetscErrorCode (*destroy)(SbEffect e);
  SbContactMesh mesh;
  SbContactPairs pairs;
  PetscReal width, pressure; /* as given; 0: by body */
  PetscReal *w,
    *k; /* [nbody+1] width, m, and stiffness, Pa, of each body; of the obstacle infinite, so that the body's apply */
  PetscReal scale; /* w over its default, 0..1 (-accuracy) */
  PetscReal wider,
    growth; /* largest factor on it at the next step, 0: none; largest growth of the barrier's energy by it, J */
  PetscBool verify, begun, searched; /* option; the run has begun; overlaps were searched for */
  PetscReal *x, *u;        /* [nvertex][3] current positions, m; [nnode_owned][3] displacements of them, m */
  PetscReal *start;        /* [nvertex][3] at the start of the step, m */
  PetscReal *from, *to;    /* [obstacle's vertices][3] positions at the start and the end of the step, m */
  PetscReal progress, now; /* completed fraction of that path; the one of x */
  PetscReal *other;        /* [nvertex][3] end of a motion, m */
  PetscBool known;         /* x and active are up to date for u and progress */
  PetscInt nactive, size;
  Active *active;
  PetscInt nfriction, friction_size;
  FrictionPair *friction;
  SbContactBlocks blocks;    /* of the last Hessian */
  PetscInt nnext, next_size; /* the same with closest points and normal forces at the end of the step */
  FrictionPair *next;
  SbPose pose[2];               /* of the obstacle at the start and the end of the step */
  PetscInt lags, nlag;          /* lagged-friction iterations of a step: the most; of this step */
  PetscReal lag_tolerance, lag; /* tolerance of the lag; the lag, relative to mu N of all pairs */
  PetscReal least_lag;          /* least lag of the solutions of this step; number of solutions since */
  PetscInt nstuck;
  PetscBool stuck_said;
  PetscReal most_lag;               /* of the run */
  PetscReal slip;                   /* e of friction, m */
  PetscBool overlapping, announced; /* there is overlap; a warning was given */
  PetscBool parted;                 /* there was at the start of this load step */
  SbContactOverlap overlap;
  SbOverlap parting;
  PetscReal stiffer;             /* factor on the stiffness of springs, by their success in the last steps */
  PetscInt nspring, spring_size; /* those of overlap, the same on every rank, */
  PetscInt nbounce;              /* then those of restitution, of this rank's pairs */
  Spring *spring;
  SbRestitution bounce;
  PetscReal least, shortest; /* smallest gap and shortest safe part of the run */
  PetscInt most;             /* largest number of active pairs of the run */
  SbPairs columns;
  PetscReal energy; /* barrier's energy at the start, then at the end of the step, J; this rank's, as below */
  PetscReal obstacle_power;      /* work along the obstacle's path in this step, forces of its start, J */
  PetscReal step_work;           /* on the bodies in the last step, J */
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

/* Positions at the local displacements u, and the pairs with gaps below the width, in the order of their numbers. Collective. */
PetscErrorCode SbBarrierUpdate(Barrier *b, const PetscReal u[]);
/* Normal force of a pair, N, its energy, J, and the gradient of that by the pair's vertices, N. */
PetscReal SbBarrierForce(const Barrier *b, const Active *a, PetscReal *energy, PetscReal gradient[12]);
/* Tangential slip u of a pair since the step began, m; its length. */
PetscReal SbBarrierSlip(const Barrier *b, const FrictionPair *friction, PetscReal u[3]);
/* f0'/y of the slip y, 1/m. */
static inline PetscReal SbBarrierSlope(const Barrier *b, PetscReal y)
{
  return y < b->slip ? 2. / b->slip - y / PetscSqr(b->slip) : 1. / y;
}
/* Normal forces and directions at the current positions, at the end of the step (`end`) or its start, into `next`. */
PetscErrorCode SbBarrierFindFriction(Barrier *b, PetscBool end);
/* Swaps `next` and the friction in use. */
void SbBarrierSwapFriction(Barrier *b);
/* Computes `lag` (barrier_friction.c), with the normal forces and directions at the end of the step in `next`. Collective. */
PetscErrorCode SbBarrierLag(Barrier *b);
/* Energy of friction, J, its gradient by the pair's vertices, N. */
PetscReal SbBarrierFriction(const Barrier *b, const FrictionPair *friction, PetscReal gradient[12]);
/* Finds overlaps at the current positions, and the springs that separate them in a step of length dt, s; `first` of a run: errors where they cannot. Collective. */
PetscErrorCode SbBarrierSeparate(SbEffect e, SbSpace space, PetscReal dt, PetscBool first);
/* normal . sum weight x of a spring at the current positions, m. */
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
/* f += sign times the gradient of all energies at the current positions, N; returns their sum over this rank's pairs, J. */
PetscReal SbBarrierGradient(const Barrier *b, PetscReal sign, PetscReal f[]);

/* Positions of the obstacle's vertices after the fraction `progress` of its path, into x[nvertex][3], m. */
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
