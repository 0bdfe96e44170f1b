/*
  contact_impl.h - the effect `contact`: shared by responses of nodes (nodes.c, friction_nodes.c)
  and of surfaces (surfaces.h).
*/
#pragma once
#include "obstacle.h"
#include "sbcontact.h"

/* Calls an operation of a contact, if there is one, within the log event of its effect; PHASE: with
   its time added to the contact phase as well. */
#define CONTACT_CALL(c, op, ...)                                       \
  do {                                                                 \
    const SbContact sb_c_ = (c);                                       \
    if (sb_c_->ops->op) {                                              \
      PetscCall(PetscLogEventBegin(sb_c_->effect->event, 0, 0, 0, 0)); \
      PetscCall((*sb_c_->ops->op)(sb_c_, __VA_ARGS__));                \
      PetscCall(PetscLogEventEnd(sb_c_->effect->event, 0, 0, 0, 0));   \
    }                                                                  \
  } while (0)
#define PHASE_CALL(c, op, ...)                                             \
  do {                                                                     \
    PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0)); \
    CONTACT_CALL(c, op, __VA_ARGS__);                                      \
    PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT], 0, 0, 0, 0));   \
  } while (0)

/* Two parts touch, bodies or an obstacle: bodies keep a common length of steps. */
void SbBodyStepsJoin(SbBodySteps *bodies, PetscInt one, PetscInt two);

typedef enum {
  AUTO,
  PROJECTED,
  MULTIPLIER,
  AUGMENTED,
  PENALTY,
  BARRIER
} SbResponse;

/* The other side of a contact if that is a rigid obstacle, and its motion. */
typedef struct {
  SbObstacle obstacle;    /* NULL: contact between bodies */
  PetscReal scale, at[3]; /* of the file of a mesh */
  SbPath path;            /* torques are about the point of its axis, which moves with it */
  SbPose pose[2];         /* at the start and the end of the step */
} SbPartner;

/* Coefficients of friction of an effect, and convergence in a step. */
typedef struct {
  PetscReal mu, mu_kinetic;
  int updates; /* number of updates within the step */
  PetscReal
    error; /* largest error of friction after the last solve, relative to the largest friction */
  PetscBool said; /* the warning that friction did not converge was given */
} SbFriction;

/* Gradual resolution of penetration: its depth falls to 1/e in `separation_steps` whole steps; a
   shorter step resolves less of it, at the same speed. A static run resolves it in the first load
   step; where that is cut, in proportion to its parts. */
typedef struct {
  PetscBool by_load; /* in the first load step */
  PetscReal
    recovery; /* factor on the depth in a whole step, exp(-1/separation_steps); 0: resolved at once */
  PetscReal longest; /* step so far, s */
  PetscReal left;    /* factor on the depth in this step */
} SbOverlap;

/* A step from t to t + dt, s or load factors. */
static inline void SbOverlapBegin(SbOverlap *o, PetscReal t, PetscReal dt)
{
  o->longest = PetscMax(o->longest, dt);
  o->left = 0;
  if (o->by_load && t + dt < o->longest)
    o->left = (o->longest - t - dt) / (o->longest - t);
  else if (!o->by_load && o->recovery > 0)
    o->left = PetscPowReal(o->recovery, dt / o->longest);
}

/* Newton's law of restitution for the impact of a point (restitution.c). */
typedef struct {
  PetscReal e;    /* coefficient of restitution; 0: none */
  PetscReal left; /* factor on it in this step */
  PetscReal dt;   /* length of the step, s */
  PetscBool said; /* that a body is too soft for it */
} SbRestitution;

/* How often an elastic wave crosses a body in dt, by its Young's modulus, density and volume. */
PetscReal SbRestitutionCrossings(SbSpace space, PetscInt body, PetscReal dt);
/*
  SbRestitutionWarnSoft - warns, once, of an impact of a body that is not stiff within a step.

  Collective. Input: the fewest crossings in dt of bodies of this rank that hit something, and which
  body that is; infinity: none does.
*/
PetscErrorCode SbRestitutionWarnSoft(SbEffect effect, SbRestitution *bounce, SbSpace space,
                                     PetscReal dt, PetscReal crossings, PetscInt body);
/* Gap at the end of the step to which a rebounding point is constrained, m; 0: no rebound. */
static inline PetscReal SbRestitutionGap(const SbRestitution *r, PetscReal gap0, PetscReal speed)
{
  return speed > 0 ? gap0 + r->dt * r->left * r->e * speed : 0;
}

/* What every response has. */
typedef struct {
  struct _p_SbContact base; /* first: what the program sees */
  SbResponse response;      /* not AUTO */
  SbPartner partner;
  SbFriction friction;
  SbOverlap overlap;
  SbRestitution bounce;
} Contact;

/*
  The obstacle (partner.c). Collective: SetUp.

  Read     - the options of an obstacle and its path; without one nothing is done.
  SetUp    - reads the file of a mesh; appends a line about it to the effect's note.
  Pose     - where it is at time t. Error: PETSC_ERR_USER_INPUT where its path is not a number.
  BeginStep - its poses at both ends of a step from t to t + dt.
  AddForce - adds the force f on a body at x, N, and its torque about the axis, N m, to values[6];
             pose: at that time.
*/
PetscErrorCode SbPartnerRead(SbEffect e, const SbScope *scope, SbPartner *partner);
PetscErrorCode SbPartnerSetUp(SbEffect e, MPI_Comm comm, SbPartner *partner);
PetscErrorCode SbPartnerDestroy(SbPartner *partner);
PetscErrorCode SbPartnerPose(const SbPartner *partner, PetscReal t, SbPose *pose);
PetscErrorCode SbPartnerBeginStep(PetscReal t, PetscReal dt, SbPartner *partner);
void SbPartnerAddForce(const SbPartner *partner, const SbPose *pose, const PetscReal x[3],
                       const PetscReal f[3], PetscReal values[]);

/* restitution.c: energy check of a converged step; `again`: coefficients were reduced.
   Collective. */
PetscErrorCode SbContactSetCheckRestitution(SbContactSet *contacts, Vec U, PetscBool *again);

/* inside.c: an error where a body is wholly inside an obstacle at t with the displacement U.
   Collective. */
PetscErrorCode SbContactSetCheckInside(const SbContactSet *contacts, PetscReal t, Vec U);

/* repeated.c: an error where two contacts treat the same surfaces. Collective. */
PetscErrorCode SbContactSetCheckRepeated(const SbContactSet *contacts);
