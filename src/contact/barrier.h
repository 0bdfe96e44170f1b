/*
  barrier.h - the response `barrier`.
*/
#pragma once
#include "contact_impl.h"
#include "pairs.h"

/* A pair with a gap below the width, at the current positions. */
typedef struct {
  SbContactPair pair;
  PetscReal gap; /* m */
  SbDistance at;
} Active;

/* A pair with friction in this step. */
typedef struct {
  Active on;       /* when its normal force was taken */
  PetscReal force; /* mu N, N */
  PetscReal
    rotation[3];     /* displacement of the obstacle's contact point by rotation, beyond that of its
                              vertices, m; with the sign of its weights */
  PetscReal slip[3]; /* at the last Hessian, m */
  PetscBool turns, sticks; /* slip has reversed since: treated as sticking in the Hessian */
} FrictionPair;
typedef struct {
  PetscInt n, size;
  FrictionPair *pair; /* [n] */
} FrictionPairs;

/* A one-sided spring along a direction in this step: separates an overlap, or enforces
   restitution. */
typedef struct {
  SbPenetration at;          /* of restitution: the point of the impact, without depth and area */
  PetscReal goal, stiffness; /* of normal . sum weight x, m; N/m */
  PetscReal start;           /* that sum at the start of the step, m */
  PetscBool held;            /* two-sided: it was active when its goal was changed */
  PetscReal approach;        /* restitution: speed of approach, m/s */
} Spring;

typedef struct {
  Contact contact; /* first, as options are read before the response is known */
  SbContactSurface mesh;
  SbContactPairs pairs;
  PetscReal width, pressure; /* as given; 0: by body */
  PetscReal *w, *k, *mass; /* [nbody+1] width, m, stiffness, Pa, and mass, kg; obstacle: infinite */
  PetscReal scale;         /* w over its default, 0..1 (-accuracy) */
  PetscReal wider,
    growth; /* largest factor on it at the next step, 0: none; growth of energy by it, J */
  PetscBool verify, begun, searched; /* option; the run has begun; overlaps were searched for */
  PetscReal *x,
    *u; /* [nvertex][3] current positions, m; [nnode_owned][3] displacements of them, m */
  PetscReal *start; /* [nvertex][3] at the start of the step, m */
  PetscReal *from,
    *to;            /* [obstacle's vertices][3] positions at the start and the end of the step, m */
  PetscReal now;    /* SbContact.progress of x, the completed fraction of that path */
  PetscReal *other; /* [nvertex][3] end of a motion, m */
  PetscBool known;  /* x and active are up to date for u and progress */
  PetscInt nactive, size;
  Active *active;
  FrictionPairs friction,
    next;                 /* next: with closest points and normal forces at the end of the step */
  SbContactBlocks blocks; /* of a Hessian while it is summed up */
  SbPose pose[2];         /* of the obstacle at the start and the end of the step */
  PetscInt lags, nlag;    /* lagged-friction iterations of a step: the most; of this step */
  PetscReal lag_tolerance, lag; /* tolerance of the lag; the lag, relative to mu N of all pairs */
  PetscReal least_lag; /* least lag of the solutions of this step; number of solutions since */
  PetscInt nstuck;
  PetscBool stuck_said;
  PetscReal most_lag;               /* of the run */
  PetscReal slip;                   /* e of friction, m */
  PetscBool overlapping, announced; /* there is overlap; a warning was given */
  PetscBool parted;                 /* there was at the start of this load step */
  SbContactOverlap overlap;
  PetscReal stiffer; /* factor on the stiffness of springs, by their success in the last steps */
  PetscInt nspring, spring_size; /* those of overlap, the same on every rank, */
  PetscInt nbounce;              /* then those of restitution, of this rank's pairs */
  Spring *spring;
  PetscReal least, shortest; /* smallest gap and shortest safe part of the run */
  PetscInt most;             /* largest number of active pairs of the run */
  PetscInt nsurface, *slot;  /* bodies that take part; [nbody] number among them, -1: it does not */
  PetscInt *place;           /* [nsurface][nsurface] first column of a pair, the lower body first */
  const char **column;       /* [ncolumn] all of the effect; NULL: none of pairs */
  char (*text)[3 * SB_NAME_MAX]; /* names of the columns behind the fixed ones */
  PetscReal
    energy; /* barrier's energy at the start, then at the end of the step, J; this rank's, as below */
  PetscReal
    obstacle_power; /* work along the obstacle's path in this step, forces of its start, J */
  PetscReal work, friction_loss; /* since the start, J */
} Barrier;

/* The value of a pair from those of its sides: width or pressure. */
static inline PetscReal of_pair(const Barrier *b, const PetscReal value[],
                                const SbContactPair *pair)
{
  const PetscInt *part = b->mesh->part;

  return PetscMin(value[part[pair->v[0]]], value[part[pair->v[SbContactPairSplit(pair)]]]);
}

/* Whether this rank counts the pair. */
static inline PetscBool counts(const Barrier *b, const SbContactPair *pair)
{
  return (PetscBool)b->mesh->own[pair->v[pair->v[0] < b->mesh->nbody_vertex ? 0 : 1]];
}

/* Makes e, with its Contact, an effect of the response `barrier`. Not collective. */
PetscErrorCode SbBarrierCreate(SbEffect e, const SbScope *scope);
/* Positions at the local displacements u; pairs with gaps below the width, ordered by number.
   Collective. */
PetscErrorCode SbBarrierUpdate(Barrier *b, const PetscReal u[]);
/* Tangential slip u of a pair since the step began, m; its length. */
PetscReal SbBarrierSlip(const Barrier *b, const FrictionPair *friction, PetscReal u[3]);
/* f0'/y of the slip y, 1/m. */
static inline PetscReal SbBarrierSlope(const Barrier *b, PetscReal y)
{
  return y < b->slip ? 2. / b->slip - y / PetscSqr(b->slip) : 1. / y;
}
/* Into `next` normal forces and directions at the current positions, at the end of the step or its
   start. */
PetscErrorCode SbBarrierFindFriction(Barrier *b, PetscBool end);
/* Swaps `next` and the friction in use. */
void SbBarrierSwapFriction(Barrier *b);
/* Computes `lag` (barrier_terms.c), and `next` at the end of the step. Collective. */
PetscErrorCode SbBarrierLag(Barrier *b);
/* Finds overlaps at the current positions, and the springs that separate them in a step of length
   dt, s; `first` of a run: errors where they cannot. Collective. */
PetscErrorCode SbBarrierSeparate(SbEffect e, SbSpace space, PetscReal dt, PetscBool first);
/* normal . sum weight x of a spring at the current positions, m. */
static inline PetscReal SbBarrierSpringPlace(const Barrier *b, const Spring *spring)
{
  PetscReal g = 0.;

  for (PetscInt k = 0; k < spring->at.n; k++)
    g += spring->at.weight[k] * SbDot3(spring->at.normal, b->x + 3 * spring->at.v[k]);
  return g;
}
/* Its force, N, and the gradient of its energy by its vertices, N. */
static inline PetscReal SbBarrierSpring(const Barrier *b, const Spring *spring,
                                        PetscReal gradient[15])
{
  const PetscReal all = spring->stiffness * (spring->goal - SbBarrierSpringPlace(b, spring));
  const PetscReal force = spring->held ? all : PetscMax(0., all);

  for (int k = 0; k < 15; k++)
    gradient[k] = -force * spring->at.weight[k / 3] * spring->at.normal[k % 3];
  return force;
}
/* A term of the potential at the current positions: active pairs, then those with friction, then
   springs. */
typedef struct {
  PetscInt n, nfirst; /* number of its vertices, and of those of the first side */
  const PetscInt *v;
  PetscBool counts;                 /* this rank counts it */
  PetscReal energy, force;          /* J; normal force, 0 of friction, N */
  PetscReal gradient[15];           /* of the energy by the vertices, N */
  const PetscReal *weight, *normal; /* normal . sum weight x is the gap or its like */
} Term;
static inline PetscInt nterm(const Barrier *b)
{
  return b->begun ? b->nactive + b->friction.n + b->nspring : 0;
}
void SbBarrierTerm(const Barrier *b, PetscInt i, Term *term);

/* x[nvertex][3] = positions, m, at u and after the fraction `progress` of the obstacle's path.
   Collective. */
PetscErrorCode SbBarrierPlace(const Barrier *b, const PetscReal u[], PetscReal progress,
                              PetscReal x[]);

/* Operations (sbcontact.h, sbeffect.h). */
PetscErrorCode SbContactFindImpacts_Barrier(SbContact contact, SbSpace s, PetscReal dt,
                                            const PetscReal u0[], const PetscReal v0[]);
PetscErrorCode SbContactImpactWork_Barrier(SbContact contact, PetscReal *work);
PetscErrorCode SbContactScaleRestitution_Barrier(SbContact contact, PetscReal share);
PetscErrorCode SbEffectForce_Barrier(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[]);
PetscErrorCode SbContactGradient_Barrier(SbContact contact, SbSpace s, const PetscReal u[],
                                         PetscReal *energy, PetscReal f[]);
PetscErrorCode SbContactGapForces_Barrier(SbContact contact, SbSpace s, const PetscReal u[],
                                          PetscReal f[], PetscReal *bound);
PetscErrorCode SbContactHessian_Barrier(SbContact contact, SbSpace s, const PetscReal u[],
                                        SbContactHessian kind, SbBlocks *blocks, PetscReal r[]);
