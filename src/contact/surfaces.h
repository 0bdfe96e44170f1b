/*
  surfaces.h - contact of surfaces, by any response: barrier, or springs on the same pairs with
  multipliers (multipliers.c).
*/
#pragma once
#include "contact_impl.h"
#include "pairs.h"

/* Least sum of squared weights of the vertices of a pair that are not prescribed, for it to be
   moved apart; of a free pair it is one or more. */
#define SB_LEVER 0.25

/* A pair that may have a force at the current positions: with a gap below the width, or with a
   multiplier. */
typedef struct {
  SbContactPair pair;
  PetscReal gap;   /* m */
  PetscReal width; /* gap from which on it has no force, m */
  PetscReal force; /* its multiplier, N */
  SbDistance at;
} Active;

/* The multipliers of a pair. */
#define PAIR_KEY 6
typedef struct {
  PetscInt key[PAIR_KEY]; /* side, kind, numbers of its vertices (SbContactNumber()) */
  PetscReal force;        /* normal, N */
  PetscReal tangent[3];   /* friction: that against a slip of the first side, N */
} PairForce;

/* Multipliers above zero, the same on every rank. */
typedef struct {
  PetscInt n, size;
  PairForce *pair; /* [n] in the order of pairs */
} PairForces;
typedef struct {
  PairForces now;         /* of the next solve */
  PairForces kept;        /* forces of the last accepted step, with which an attempt begins */
  PetscInt updates;       /* in this step */
  PetscReal least;        /* smallest error of gaps of its solutions, over the width */
  PetscInt stuck;         /* updates since */
  PetscBool said;         /* the warning that they do not settle was given */
  PetscReal softer;       /* factor on the springs of exact constraints in load steps */
  PetscReal begun, tried; /* load factor where the last attempt began, and its increment; 0: none */
} Multipliers;

/* A pair with friction in this step. */
typedef struct {
  Active on;            /* when its normal force was taken */
  PetscReal force;      /* mu N, N */
  PetscReal stiffness;  /* c of a pair that sticks, N/m */
  PetscReal tangent[3]; /* t, its multiplier, N; 0: the response has none */
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
  PetscReal width, pressure; /* m, Pa; 0: by body */
  PetscReal stiffness;       /* factor on that of springs */
  PetscBool sticks;          /* friction has multipliers, so that pairs stick */
  PetscReal slip_speed;      /* of smooth friction in time steps, m/s; 0: by the step's speed */
  PetscReal settled;         /* tolerance of multipliers, over the width; 0: by default */
  PetscBool once;            /* of the barrier: what pairs share counts once */
  PetscBool self, pairs;     /* between bodies: self-contact; columns for each pair of bodies */
  PetscBool verify;
  SbContactSearch search;
  PetscInt friction_solves;     /* most lagged-friction iterations of a step; 0: by default */
  PetscReal friction_tolerance; /* of the lag */
} SurfaceOptions;

/* Positions of the surfaces' vertices within a step. */
typedef struct {
  PetscBool begun;     /* the run has begun */
  PetscBool accepted;  /* a step was accepted in this run */
  PetscBool from_rest; /* this is the first load step, without forces at its start */
  PetscReal *x,
    *u; /* [nvertex][3], of SbContactSurfaceCreateArray(): current ones, m; [nnode_owned][3] displacements of them, m */
  PetscReal *start;     /* [nvertex][3] at the start of the step, m */
  PetscReal *from, *to; /* [obstacle's vertices][3] at the start and the end of the step, m */
  PetscReal *other;     /* [nvertex][3] end of a motion, m */
  PetscReal *force,
    *begin;           /* load steps with multipliers, at the start of the step, [nnode_owned][3]:
                               forces of pairs, N; displacements, m. NULL: there are none yet */
  PetscReal progress; /* SbContact.progress of x, the completed fraction of the obstacle's path */
  PetscBool known;    /* x and the active pairs are up to date for u and progress */
} SurfaceMotion;

/* By body, [nbody+1]; the obstacle's are infinite. */
typedef struct {
  PetscReal *w, *k, *mass; /* width, m; stiffness (SbPairLaw), Pa or Pa/m; mass, kg */
  PetscReal *guard;        /* pressure of a barrier, Pa */
  PetscReal *spring;       /* stiffness of springs, Pa/m */
  PetscReal scale;         /* w over its default, 0..1 (-accuracy) */
  PetscReal wider,
    growth; /* largest factor on it at the next step, 0: none; growth of energy by it, J */
} SurfaceWidths;

typedef struct {
  PetscInt n, size;
  Active *pair; /* [n] ordered by number */
} ActivePairs;

typedef struct {
  FrictionPairs pairs; /* in use */
  FrictionPairs next;  /* with closest points and normal forces at the end of the step */
  PetscReal slip;      /* sticking slip e, m */
  PetscInt nlag;       /* lagged-friction iterations of this step */
  PetscReal lag;       /* the last lag, relative to mu N of all pairs */
  PetscReal least;     /* least lag of the solutions of this step */
  PetscInt nstuck;     /* number of solutions since */
  PetscBool said;      /* the warning that it does not settle was given */
  PetscReal most;      /* largest lag of the run */
  PetscReal loss;      /* since the start, this rank's, J */
} PairFriction;

#define SB_TOUCH 0.9 /* of the width: surfaces less deep in each other only touch at the start */

/* Overlap of surfaces, and how it is separated. */
typedef struct {
  PetscBool overlapping; /* there is some */
  PetscBool parted;      /* there was some at the start of this load step */
  PetscBool searched;    /* it was searched for when the run began */
  PetscBool announced;   /* it was named */
  char found[512];       /* what the warning says of it, until it was given */
  PetscBool resumed;     /* the run goes on in the middle of it */
  PetscInt opening;      /* steps since nothing intersects any more */
  uint8_t
    *rims; /* as SbContactOverlap.near: prescribed vertices inside another body beside prescribed
                    ones of it; NULL: there are none */
  PetscReal sunk;    /* largest depth of surfaces that only touch, at the start, m */
  PetscReal stiffer; /* factor on the stiffness of springs, by their success in the last steps */
  SbContactOverlap overlap;
} Separation;

typedef struct {
  PetscInt n, size; /* those of overlap, then those of restitution: of this rank's points, pairs */
  PetscInt nbounce; /* the latter */
  Spring *spring;   /* [n] */
} Springs;

/* This rank's sums, J. */
typedef struct {
  PetscReal energy;         /* of the barrier at the start, then at the end of the step */
  PetscReal obstacle_power; /* work along the obstacle's path in this step, forces of its start */
  PetscReal work;           /* on the bodies since the start */
} SurfaceSums;

/* Of the run, for the summary. */
typedef struct {
  PetscReal least, shortest; /* smallest gap, m; shortest safe part of an iteration */
  PetscInt most;             /* largest number of active pairs */
} SurfaceRecord;

/* History columns of pairs of bodies. */
typedef struct {
  PetscInt nsurface, *slot; /* bodies that take part; [nbody] number among them, -1: it does not */
  PetscInt *place;          /* [nsurface][nsurface] first column of a pair, the lower body first */
  const char **column;      /* [ncolumn] all of the effect; NULL: none of pairs */
  char (*text)[3 * SB_NAME_MAX]; /* names of the columns behind the fixed ones */
} PairColumns;

/* A step that is repeated with the barrier (fall_back.c). */
typedef struct {
  PetscBool may, now;  /* -effect_X_unsettled barrier; the next attempt has the barrier */
  SbResponse response; /* of all other steps */
  PetscInt n;          /* number of such steps */
} FallBack;

typedef struct {
  Contact contact; /* first */
  SurfaceOptions options;
  FallBack fall_back;
  SbContactSurface surface;
  SbContactPairs pairs;
  SurfaceMotion motion;
  SurfaceWidths widths;
  ActivePairs active;
  Multipliers multipliers;
  PairFriction friction;
  Separation separation;
  Springs springs;
  SbContactBlocks blocks; /* of a Hessian while it is summed up */
  SurfaceSums sums;
  SurfaceRecord record;
  PairColumns columns;
} Surfaces;

#define RIM 1e-6 /* rounding of the distance of prescribed vertices */

/* The value of a pair from those of its sides: width or pressure. */
static inline PetscReal of_pair(const Surfaces *b, const PetscReal value[],
                                const SbContactPair *pair)
{
  const PetscInt *part = b->surface->part;

  return PetscMin(value[part[pair->v[0]]], value[part[pair->v[SbContactPairSplit(pair)]]]);
}

/* The gap from which on a pair has no force, m: of one with prescribed vertices on both sides at
   most the distance of these, which nothing can move apart. */
static inline PetscReal width_of(const Surfaces *b, const SbContactPair *pair)
{
  const PetscReal w = of_pair(b, b->widths.w, pair);

  return pair->rims ? PetscMin(w, (1. - RIM) * SbContactPairRimGap(b->surface, pair, b->motion.x))
                    : w;
}

static inline PetscBool is_barrier(const Surfaces *b)
{
  return (PetscBool)(b->contact.response == BARRIER);
}

/* Whether constraints are enforced exactly: by a null space, or with multipliers as unknowns. */
static inline PetscBool is_exact(const Surfaces *b)
{
  return (PetscBool)(b->contact.response == PROJECTED || b->contact.response == MULTIPLIER);
}

/* Whether forces have multipliers. */
static inline PetscBool has_multipliers(const Surfaces *b)
{
  return (PetscBool)(is_exact(b) || b->contact.response == AUGMENTED);
}

/* Whether there is a table of multipliers: of forces, of friction, or of both. */
static inline PetscBool has_table(const Surfaces *b)
{
  return (PetscBool)(has_multipliers(b) || b->options.sticks);
}

/* How a pair resists. */
#define STIFFER 10. /* springs of exact constraints, over those of `augmented` */
static inline SbPairLaw SbPairLawOf(const Surfaces *b, const Active *a)
{
  return (SbPairLaw){.spring = (PetscBool)!is_barrier(b),
                     .width = a->width,
                     .stiffness = (is_exact(b) ? STIFFER : 1.) * of_pair(b, b->widths.k, &a->pair),
                     .force = a->force,
                     .guard = of_pair(b, b->widths.guard, &a->pair)};
}
/* The same of its part in the matrix of linear systems; row: the rest is in a row. */
SbPairLaw SbPairMatrixLaw(const Surfaces *b, const Active *a, PetscBool *row);

/* Whether this rank counts the pair. */
static inline PetscBool counts(const Surfaces *b, const SbContactPair *pair)
{
  return (PetscBool)b->surface->own[pair->v[pair->v[0] < b->surface->nbody_vertex ? 0 : 1]];
}

/* Whether this rank counts the spring: by its first vertex of a body. */
static inline PetscBool counts_spring(const Surfaces *b, const Spring *spring)
{
  PetscInt k = 0;

  while (k < spring->at.n - 1 && spring->at.v[k] >= b->surface->nbody_vertex)
    k++;
  return (PetscBool)b->surface->own[spring->at.v[k]];
}

/* Makes e, with its Contact, an effect of surfaces in contact. Not collective. */
PetscErrorCode SbSurfacesCreate(SbEffect e, const SbScope *scope);
/* Positions at the local displacements u; pairs with gaps below the width, ordered by number.
   Collective. */
PetscErrorCode SbSurfacesUpdate(Surfaces *b, const PetscReal u[]);
/* Tangential slip u of a pair since the step began, m; its length. */
static inline PetscReal SbPairSlip(const Surfaces *b, const FrictionPair *friction, PetscReal u[3])
{
  PetscReal normal = 0.;

  for (int i = 0; i < 3; i++) {
    u[i] = -b->contact.base.progress * friction->rotation[i];
    for (int k = 0; k < 4; k++)
      u[i] += friction->on.at.weight[k] * (b->motion.x[3 * friction->on.pair.v[k] + i] -
                                           b->motion.start[3 * friction->on.pair.v[k] + i]);
    normal += u[i] * friction->on.at.n[i];
  }
  for (int i = 0; i < 3; i++)
    u[i] -= normal * friction->on.at.n[i];
  return PetscSqrtReal(SbDot3(u, u));
}
/* q = t + c u of the slip u, the force of a pair that sticks; its length over Coulomb's limit. */
static inline PetscReal SbPairSticking(const Surfaces *b, const FrictionPair *friction,
                                       PetscReal q[3])
{
  (void)SbPairSlip(b, friction, q);
  for (int i = 0; i < 3; i++)
    q[i] = friction->tangent[i] + friction->stiffness * q[i];
  return PetscSqrtReal(SbDot3(q, q)) / friction->force;
}
/* A pair slides beyond this part of Coulomb's limit: below 1, as one that slid in the last step is
   at the limit but for rounding. */
#define SLIDES (1. - 1e-6)

/* Whether the rest of its stiffness is in rows. */
static inline PetscBool SbFrictionSticks(const Surfaces *b, const FrictionPair *friction,
                                         PetscReal p)
{
  return (PetscBool)(is_exact(b) && b->options.sticks && (p < SLIDES || friction->sticks));
}
/* The friction force over q, of its length p over Coulomb's limit. */
static inline PetscReal SbPairFrictionFactor(const Surfaces *b, PetscReal p)
{
  if (p >= 1.)
    return 1. / p;
  return b->options.sticks ? 1. : 2. - p;
}
/* Normal force of a pair, N, its energy, J, and the gradient of that by the pair's vertices, N. */
PetscReal SbPairNormalForce(const Surfaces *b, const Active *active, PetscReal *energy,
                            PetscReal gradient[12]);
/* f += sign times the gradient of all energies at the current positions, N; returns this rank's
   sum, J. */
PetscReal SbSurfacesAddGradient(const Surfaces *b, PetscReal sign, PetscReal f[]);
/* The bodies that take part; with -effect_X_pairs columns for each pair of them behind those of
   e. */
PetscErrorCode SbSurfacesFindBodies(SbEffect e, SbMesh mesh);
/* Into `next` normal forces and directions at the current positions, at the end of the step or its
   start. */
PetscErrorCode SbSurfacesFindFriction(Surfaces *b, PetscBool end);
/* Swaps `next` and the friction in use. */
void SbSurfacesSwapFriction(Surfaces *b);
/* Computes `lag` (friction_pairs.c), and `next` at the end of the step. Collective. */
PetscErrorCode SbSurfacesLag(Surfaces *b);
/* Finds overlaps at the current positions, and the springs that separate them in a step of length
   dt, s; `first` of a run: errors where they cannot; touch: those below the barrier's width only
   touch, and get no springs. Collective. */
PetscErrorCode SbSurfacesSeparate(SbEffect e, SbSpace space, PetscReal dt, PetscBool first,
                                  PetscBool touch);
/* normal . sum weight x of a spring at the current positions, m. */
static inline PetscReal SbSpringPlace(const Surfaces *b, const Spring *spring)
{
  PetscReal g = 0.;

  for (PetscInt k = 0; k < spring->at.n; k++)
    g += spring->at.weight[k] * SbDot3(spring->at.normal, b->motion.x + 3 * spring->at.v[k]);
  return g;
}
/* Its force, N, and the gradient of its energy by its vertices, N. */
static inline PetscReal SbSpringForce(const Surfaces *b, const Spring *spring,
                                      PetscReal gradient[15])
{
  const PetscReal all = spring->stiffness * (spring->goal - SbSpringPlace(b, spring));
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
static inline PetscInt nterm(const Surfaces *b)
{
  return b->motion.begun ? b->active.n + b->friction.pairs.n + b->springs.n : 0;
}
void SbPairTerm(const Surfaces *b, PetscInt i, Term *term);

/* x[nvertex][3] = positions, m, at u and after the fraction `progress` of the obstacle's path.
   Collective. */
PetscErrorCode SbSurfacesPlace(const Surfaces *b, const PetscReal u[], PetscReal progress,
                               PetscReal x[]);

/* Multipliers of pairs (pair_forces.c): what a pair is found by; the order of that, for qsort() and
   bsearch(); the multipliers of a pair, NULL: it has none. */
void SbPairKey(const Surfaces *b, const SbContactPair *pair, PetscInt key[PAIR_KEY]);
int SbPairForceOrder(const void *p, const void *q);
const PairForce *SbMultiplierFind(const Surfaces *b, const SbContactPair *pair);
/* Multipliers (multipliers.c). Update: takes the forces at the
   current positions, of a solution, for the friction of the next one as well; `again`: they have
   changed by more than a tolerance. Collective. */
PetscErrorCode SbMultipliersUpdate(Surfaces *b, PetscBool *again);
/* Keep: those of an accepted step. Restore: an attempt begins, perhaps after one that failed. */
PetscErrorCode SbMultipliersKeep(Surfaces *b);
PetscErrorCode SbMultipliersRestore(Surfaces *b);
/* Steps with the barrier (fall_back.c). Begin: an attempt, with which response. */
void SbSurfacesBeginResponse(Surfaces *b);
PetscErrorCode SbContactFallBack_Surfaces(SbContact contact, SbSpace s, const char *why,
                                          PetscBool *again);
/* Exact constraints (exact_pairs.c). */
PetscErrorCode SbContactConstraints_Pairs(SbContact contact, SbSpace s, const PetscReal u[],
                                          SbConstraintRows *rows);
PetscErrorCode SbContactHolding_Pairs(SbContact contact, SbSpace s, const PetscReal u[],
                                      SbConstraintRows *rows);

/* Operations (sbcontact.h, sbeffect.h). */
PetscErrorCode SbContactFindImpacts_Surfaces(SbContact contact, SbSpace s, PetscReal dt,
                                             const PetscReal u0[], const PetscReal v0[]);
PetscErrorCode SbContactImpactWork_Surfaces(SbContact contact, PetscReal *work);
PetscErrorCode SbContactScaleRestitution_Surfaces(SbContact contact, PetscReal share);
PetscErrorCode SbEffectForce_Surfaces(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[]);
PetscErrorCode SbContactGradient_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                          PetscReal *energy, PetscReal f[]);
PetscErrorCode SbContactGapForces_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                           PetscReal f[], PetscReal *bound);
PetscErrorCode SbContactHessian_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                         SbContactHessian kind, SbBlocks *blocks, PetscReal r[]);
PetscErrorCode SbContactUpdateFriction_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                                PetscBool solved, PetscBool *again);
PetscErrorCode SbContactGap_Surfaces(SbContact contact, SbSpace s, const SbStage *stage,
                                     PetscReal gap[], PetscReal normal[]);
PetscErrorCode SbContactPoints_Surfaces(SbContact contact, SbSpace s, const SbStage *stage,
                                        SbContactPoints *list);
PetscErrorCode SbContactWarnAtEnd_Surfaces(SbContact contact, SbSpace s);
PetscErrorCode SbContactWarnOverlaps_Surfaces(SbContact contact, SbSpace s, SbParted how);
PetscErrorCode SbContactNearest_Surfaces(SbContact contact, SbSpace s, PetscReal *gap, size_t size,
                                         char text[]);
PetscErrorCode SbEffectHistory_Surfaces(SbEffect e, SbSpace s, const SbStage *stage,
                                        const PetscReal r[], PetscReal values[]);
PetscErrorCode SbEffectSummary_Surfaces(SbEffect e, SbSpace s, size_t size, char text[]);
