/*
  collision.h - pairs of a point and a surface near it, and of two edges: what collision.c and collision_look.c share.
*/
#pragma once
#include "contact.h"
#include "sbdetect.h"

#define FEW_LOOKS 3    /* how often normal and weights of a row are taken again within a step in any case */
#define LOOKS 8        /* and how often while its gap is not closed */
#define TOLERANCE 1e-7 /* of the size of the bodies: largest penetration that counts as touching */
#define NODES SB_FRICTION_NODES

static inline PetscBool exact(SbResponse response)
{
  return SbResponseIsExact(response);
}

/*
  A point and the surface of another part, or its own, near it: `point` and `part`. Or two edges: `point` is the number of points and own
  edge, `part` the identity of the other edge. Hits are in the order of both, those of points first.
*/
typedef struct {
  PetscInt point, part;
  PetscInt body;           /* of the surface, or of the other edge */
  PetscInt n, node[NODES]; /* global numbers; the point's first */
  PetscInt mine,
    held;       /* how many of them are the point's or the first edge's, and how many were in the last rows */
  PetscReal at; /* of edges: place on the first one, 0 at its first end */
  PetscReal weight
    [NODES]; /* of the relative displacement w: 1, minus the facet's; those of the first edge, minus the other's */
  PetscReal normal[3];
  PetscReal value;            /* n . w that closes the gap, m */
  PetscReal gap;              /* at the last search, by its row once that is settled, m */
  PetscReal depth;            /* in each other at the last search, 0 also when it was not found, m */
  PetscReal start[3], now[3]; /* w at the start of the step and at the last search, m */
  PetscReal allowed;          /* penetration that was there before and is taken back step by step, m */
  PetscReal gap0, arrives;    /* restitution, at the start of the step: m; speed of approach, m/s */
  PetscReal leaves;           /* gap that it is constrained at while it bounces, else 0, m */
  PetscReal k;                /* stiffness of springs, N/m */
  PetscBool on;               /* it touches */
  PetscBool was;              /* it touched at the end of the last step, and did not bounce */
  int toggles, looks;         /* within the step */
  PetscBool rests;            /* other rows say it */
  PetscInt row;               /* of the space, -1: none */
  PetscReal lambda;           /* multiplier, N */
  SbFrictionState grip;       /* friction */
} Hit;

typedef struct {
  SbEffectOn on;
  SbContactSurface surface;
  SbDetector detector;
  SbResponse response;
  PetscBool self, both;
  SbFriction friction;
  PetscReal stiffness, reach;
  PetscReal damping; /* of springs, s */
  PetscReal damp;    /* the same in steps */
  SbOverlap overlap;
  PetscReal *edge;    /* [nbody] mean edge of the surfaces, m: the finer one looks */
  PetscBool *whole;   /* [nbody] the effect has all of the body's surface */
  PetscReal *point_k; /* [npoint] N/m */
  PetscReal *edge_k;  /* [own edges] the same of an edge, N/m */
  PetscReal *u0;      /* [nnode][3] displacement at the start of the step, m */
  PetscReal *flight;  /* [nnode][3] that at its end if nothing had a force, m; NULL without restitution */
  SbRestitution bounce;
  PetscInt nhit, size, npast, past_size;
  Hit *hit, *spare; /* by point and part */
  Hit *past;        /* [npast] as the last step left them: each attempt at a step begins there */
  PetscBool cut;    /* steps end where points come into contact */
  PetscBool begun;  /* overlap that was there when the run began has been searched for */
  PetscBool close;  /* boxes of two bodies met at the last search */
  SbInside inside;
  signed char *alone; /* [npoint] for how many steps a point has been inside without a pair */
  PetscReal watched;  /* beginning of the last step for which that was examined: it may be tried again, s */
  PetscReal *
    way; /* [npoint][3] unit vectors: separation directions of overlap, zero: none; NULL while there is none */
  PetscInt *way_part; /* [npoint] out of which part, -1: none */
  PetscReal deep;     /* so deep points are searched for, m; 0: by the reach, as all come from outside */
  PetscBool first;    /* the step has not been solved yet */
  PetscReal arrival;  /* the part of it after which the first point arrives, 1: none */
  PetscReal work;     /* of the contact forces since the start, this rank, J */
  PetscInt64 looks, candidates; /* of this rank: at surfaces, and at pairs of a point and a facet */
  SbPairs pairs;
} Collision;

/*
  SbCollisionLook - finds the pairs again for local displacements u, m, each with what is known of it from before.

  Collective. `within`: a look within a step; what touches then stays, found or not. Else only what is found stays.
*/
PetscErrorCode SbCollisionLook(Collision *c, const PetscReal u[], PetscBool within);
/* Of two surfaces, whether the points of `mine` search for `other`. Not collective. */
PetscBool SbCollisionLooksFor(const Collision *c, PetscInt mine, PetscInt other);
/* collision_overlap.c: sets c->deep and separation directions by the overlap that is there at local displacements u, m. Collective;
   clears the pairs. Error when a run begins: a body deep inside another, without a separation direction. */
PetscErrorCode SbCollisionFindOverlap(SbEffect e, const PetscReal u[]);
/*
  Does so when points have been inside for some steps that no pair holds, c->past being the pairs at local displacements u, m. Collective. `t`: when the
  step begins, s; further attempts at it are not counted.
*/
PetscErrorCode SbCollisionWatchInside(SbEffect e, PetscReal t, const PetscReal u[]);
/* Less, when less is left of it. Collective if c->deep is not 0. */
PetscErrorCode SbCollisionFollowOverlap(Collision *c);
/* The pairs as the last step left them; what an attempt at this step that failed has made of them is forgotten,
   but for the multipliers of `augmented`. Not collective. */
PetscErrorCode SbCollisionRestore(Collision *c);
/* Remembers the pairs as this step leaves them. Not collective. */
PetscErrorCode SbCollisionKeep(Collision *c);

/* Whether the pair is one of edges. */
static inline PetscBool SbCollisionOfEdges(const Collision *c, const Hit *hit)
{
  return (PetscBool)(hit->point >= c->surface->scene.npoint);
}
/* Gap beyond the one that it is constrained at, m. */
static inline PetscReal SbCollisionExcess(const Hit *hit)
{
  return hit->gap + hit->allowed - hit->leaves;
}

/* n . w at which it is constrained, m. */
static inline PetscReal SbCollisionPlace(const Hit *hit)
{
  return hit->value - hit->allowed + hit->leaves;
}

/* The part of a damper's force that is for where the pair was when the step began, N: k damping (g - g0) / dt, g0 < 0. */
static inline PetscReal SbCollisionBefore(const Collision *c, const Hit *hit)
{
  const PetscReal *n = hit->normal, *s = hit->start;

  if (c->damp <= 0) return 0;
  return hit->k * c->damp * PetscMin(0, n[0] * s[0] + n[1] * s[1] + n[2] * s[2] - SbCollisionPlace(hit));
}

/* Normal force after a solve, N. */
static inline PetscReal SbCollisionForce(const Collision *c, const Hit *hit)
{
  if (exact(c->response)) return hit->lambda;
  return PetscMax(0,
                  hit->lambda + SbCollisionBefore(c, hit) - hit->k * (1 + c->damp) * SbCollisionExcess(hit));
}

/* Coefficients of the relative displacement along a direction. */
static inline void SbCollisionCoef(const Hit *hit, const PetscReal direction[3], PetscReal coef[3 * NODES])
{
  for (PetscInt k = 0; k < 3 * hit->n; k++) coef[k] = hit->weight[k / 3] * direction[k % 3];
}

/*
  Restitution (collision_rebound.c). Fly: c->flight from local displacements u0 and u (prescribed ones are taken from it) and velocities
  v0. Meet: for each pair of the look there, what it is constrained at if it is to be. Hit: it is to be. Not collective.
*/
void SbCollisionFly(Collision *c, SbSpace space, const PetscReal u0[], const PetscReal v0[],
                    const PetscReal u[]);
void SbCollisionMeet(Collision *c);
void SbCollisionHit(const Collision *c, Hit *hit);
PetscErrorCode SbEffectRestitution_Collision(SbEffect e, PetscReal *work);
PetscErrorCode SbEffectScaleRestitution_Collision(SbEffect e, PetscReal share);

/* The body whose point or edge the pair begins with. */
PetscInt SbCollisionFirst(const Collision *c, const Hit *hit);
#define SB_COLLISION_IDS (PETSC_MAX_INT / 3)

/* collision_friction.c, by the functions of friction.h. The pair touches from now on. */
void SbCollisionFrictionEnter(const Collision *c, Hit *hit);
/* Coefficients that the normal force of a pair pushes along, if not its own (oblique). */
void SbCollisionFrictionPush(const Collision *c, Hit *hit, PetscReal push[3 * NODES], PetscBool *oblique);
/* Constraints across the normal of hit i, which touches; id: identity of its normal constraint. Not collective. */
PetscErrorCode SbCollisionFrictionHold(const Collision *c, SbSpace space, PetscInt i, PetscInt id);
/* What a solve made of them; along: the sum of the normal's row, m. */
void SbCollisionFrictionRead(const Collision *c, SbSpace space, PetscReal along, Hit *hit);
/* Who sticks and who slides from now on; changed: the solve was not right. largest: normal force of all pairs, N. Not collective. */
void SbCollisionFrictionSettle(Collision *c, PetscReal largest, PetscBool *changed);
/* Ends a step. Collective. */
PetscErrorCode SbCollisionFrictionAccept(Collision *c, const char effect[], SbSpace space, PetscReal t);

/* collision_state.c, for checkpoints. */
#define SB_COLLISION_STATE (12 + SB_FRICTION_STATE) /* numbers in a record */
PetscErrorCode SbEffectSave_Collision(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records);
PetscErrorCode SbEffectLoad_Collision(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                                      const PetscReal records[]);
PetscErrorCode SbEffectRename_Collision(SbEffect e, PetscInt nnode, const PetscInt from[],
                                        const PetscInt to[], PetscInt *n, PetscReal records[]);

/* collision_pairs.c: values += this rank's part of the columns of pairs. Not collective. */
void SbCollisionPairsHistory(const Collision *c, SbSpace space, PetscReal values[]);
/* Operation of the effect (sbeffect.h). */
PetscErrorCode SbEffectContactPoints_Collision(SbEffect e, SbSpace space, const SbStage *stage,
                                               const PetscReal residual[], SbContactPoints *list);
