/*
  collision_friction.c - Coulomb friction between a point and a surface: |T| <= mu N, and what slides has T = -mu N along its slip.

  A pair sticks or slides. What sticks does not move across the normal: two exact rows with `projected`, two springs with `penalty`
  and `augmented`. What slides takes its friction with the normal force: that one pushes along n - mu d, d the direction of the slip,
  so that N is of the same solve and nothing waits for it. Across d a spring turns it. After a solve what sticks with more than mu N
  begins to slide, and what slid backwards sticks: a semismooth Newton method (Alart and Curnier 1991; Hueeber, Stadler, Wohlmuth
  2008), an active set in rows instead of a tangent.

  The slip is that of the step, as implicit Euler has it; with springs it has the stretch that was there before.
*/
#include "collision.h"

#define SETTLED 1e-4 /* of the largest friction: error that is left */
#define LATE 1e-2    /* the same after UPDATES solves, with a warning; what does not get there is cut */
#define UPDATES 30   /* solves of a step with friction */
#define FLIPS 10     /* of a pair within a step, after which it has springs */
#define STIFF \
  1e-3 /* smallest difference of trial force and limit that the stiffness across the slip sees, relative */

void SbFrictionBegin(Hit *hit)
{
  if (!hit->on) { /* a point that arrives in this step sticks to where it was at its start */
    for (int k = 0; k < 3; k++) hit->stretch[k] = 0;
    hit->pressing = 0;
    hit->slid = PETSC_FALSE;
  }
  hit->slides = hit->slid;
  hit->flips = 0;
}

/* Whether a pair that cannot decide has springs of the solve before: a secant (Kacanov's method), slow and sure. */
static inline PetscBool careful(const Hit *hit)
{
  return (PetscBool)(hit->flips > FLIPS);
}

static PetscReal coefficient(const Collision *c, const Hit *hit)
{
  return hit->slid ? c->mu_kinetic : c->mu;
}

/* Part of a vector across the normal; returns its length. */
static PetscReal across(const PetscReal n[3], PetscReal v[3])
{
  const PetscReal along = SbDot3(n, v);

  for (int k = 0; k < 3; k++) v[k] -= along * n[k];
  return PetscSqrtReal(SbDot3(v, v));
}

/* Slip of the step and what springs were stretched by before, across the normal, m; returns its length. */
static PetscReal slip(const Hit *hit, PetscReal s[3])
{
  for (int k = 0; k < 3; k++) s[k] = hit->stretch[k] + hit->now[k] - hit->start[k];
  return across(hit->normal, s);
}

/* Turns the two directions across the normal, the first one along v or what is left of it. */
static void turn(Hit *hit, const PetscReal v[3])
{
  const PetscReal *n = hit->normal;
  PetscReal t[3] = {v[0], v[1], v[2]}, length = across(n, t);

  if (length <= 1e-12 * PetscSqrtReal(SbDot3(v, v))) {
    const int k = PetscAbsReal(n[0]) < 0.6 ? 0 : 1;

    for (int i = 0; i < 3; i++) t[i] = i == k;
    length = across(n, t);
  }
  for (int i = 0; i < 3; i++) hit->tangent[0][i] = t[i] / length;
  SbCross(n, hit->tangent[0], hit->tangent[1]);
}

void SbFrictionPush(const Collision *c, const Hit *hit, PetscReal push[3 * NODES], PetscBool *oblique)
{
  const PetscReal mu = coefficient(c, hit);
  PetscReal t[3], direction[3], length;

  *oblique = (PetscBool)(hit->slides && !careful(hit));
  if (!*oblique) return;
  for (int k = 0; k < 3; k++) t[k] = hit->tangent[0][k];
  length = across(hit->normal, t);
  for (int k = 0; k < 3; k++) direction[k] = hit->normal[k] - (length > 0 ? mu / length * t[k] : 0);
  SbCollisionCoef(hit, direction, push);
}

PetscErrorCode SbFrictionHold(const Collision *c, SbSpace space, PetscInt i)
{
  Hit *hit = &c->hit[i];
  PetscReal coef[3 * NODES];

  PetscFunctionBeginUser;
  if (hit->rests) PetscFunctionReturn(PETSC_SUCCESS);
  turn(hit, hit->tangent[0]);
  for (int q = 0; q < 2; q++) {
    const PetscReal *t = hit->tangent[q], rest = SbDot3(t, hit->start) - SbDot3(t, hit->stretch);
    PetscReal stiffness = hit->k;

    SbCollisionCoef(hit, t, coef);
    if (!hit->slides && exact(c->response) && !careful(hit)) { /* normals of all pairs come first */
      const PetscInt id = SB_COLLISION_IDS + 2 * SbCollisionId(c, i) + q;

      PetscCall(SbSpaceCoupleRow(space, id, hit->n, hit->node, coef, NULL, rest, &hit->slide[q]));
      continue;
    }
    if (careful(hit))
      stiffness = hit->turning;
    else if (hit->slides)
      stiffness = q ? hit->turning : 0;
    PetscCall(SbSpaceCoupleSpring(space, hit->n, hit->node, coef, NULL, rest, stiffness, 0, &hit->slide[q]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbFrictionRead(const Collision *c, SbSpace space, PetscReal along, Hit *hit)
{
  const PetscReal N = PetscMax(0, SbCollisionForce(c, hit));

  for (int k = 0; k < 3; k++) hit->drag[k] = 0;
  if (hit->slide[0] < 0) return;
  for (int k = 0; k < 3; k++) {
    if (!hit->rests) hit->now[k] = along * hit->normal[k];
    if (hit->slides && !careful(hit)) hit->drag[k] = -coefficient(c, hit) * N * hit->tangent[0][k];
  }
  for (int q = 0; q < 2; q++) {
    PetscReal force, at;

    SbSpaceCoupleGet(space, hit->slide[q], &force, &at);
    if (SbSpaceCoupleRests(space, hit->slide[q])) { /* others hold it there */
      force = 0;
      at = SbDot3(hit->tangent[q], hit->start) - SbDot3(hit->tangent[q], hit->stretch);
    }
    for (int k = 0; k < 3; k++) {
      hit->drag[k] += force * hit->tangent[q][k];
      if (!hit->rests) hit->now[k] += at * hit->tangent[q][k];
    }
  }
}

/* The same with springs for a pair that cannot decide; N is halfway between this solve's and the one before. */
static PetscReal settle_carefully(const Collision *c, PetscReal before, Hit *hit)
{
  const PetscReal mu = coefficient(c, hit), most = mu * PetscMax(0, hit->pressing);
  PetscReal s[3], wrong[3];
  const PetscReal length = slip(hit, s), part = length > 0 ? PetscMin(hit->k, most / length) : hit->k;

  for (int k = 0; k < 3; k++) wrong[k] = hit->drag[k] + part * s[k];
  hit->slides = (PetscBool)(hit->k * length > most);
  hit->pressing = 0.5 * (before + hit->pressing);
  hit->turning = length > 0 ? PetscMin(hit->k, mu * PetscMax(0, hit->pressing) / length) : hit->k;
  if (hit->slides) turn(hit, s);
  return PetscSqrtReal(SbDot3(wrong, wrong));
}

/*
  What a pair does from now on; returns the error of its friction, N. With T the force against the slip s and a stiffness k, a trial force
  is T + k s, or with springs k s alone. It slides where that is longer than mu N, with T = mu N along it; the derivative of that
  direction is the stiffness across it.
*/
static PetscReal settle(const Collision *c, Hit *hit)
{
  const PetscReal most = coefficient(c, hit) * PetscMax(0, hit->pressing);
  const PetscBool springs = (PetscBool)(!exact(c->response)), slid = hit->slides;
  PetscReal s[3], trial[3], wrong[3] = {0}, size;

  slip(hit, s);
  for (int k = 0; k < 3; k++) trial[k] = hit->k * s[k] - (springs ? 0 : hit->drag[k]);
  size = PetscSqrtReal(SbDot3(trial, trial));
  /* what slid backwards went too far */
  hit->slides = (PetscBool)(size > most && (!slid || SbDot3(trial, hit->tangent[0]) >= 0));
  if (hit->slides) {
    const PetscReal over = springs ? size : PetscMax(size - most, STIFF * size);

    if (!slid || SbDot3(trial, hit->tangent[0]) < 0.5 * size) hit->flips++;
    for (int k = 0; k < 3; k++) wrong[k] = hit->drag[k] + most / size * trial[k];
    hit->turning = hit->k * most / over;
    turn(hit, trial);
  } else if (slid) {
    hit->flips++;
    for (int k = 0; k < 3; k++) wrong[k] = hit->k * s[k];
  }
  return PetscSqrtReal(SbDot3(wrong, wrong));
}

void SbFrictionSettle(Collision *c, PetscReal largest, PetscBool *changed)
{
  PetscReal worst = 0;

  c->updates++;
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];
    const PetscReal before = hit->pressing;
    PetscReal error;

    if (!hit->on || hit->row < 0) continue;
    hit->pressing = SbCollisionForce(c, hit);
    if (hit->slide[0] < 0) continue;
    error = careful(hit) ? settle_carefully(c, before, hit) : settle(c, hit);
    if (careful(hit) && hit->flips < 2 * FLIPS) { /* begins now */
      hit->flips = 2 * FLIPS;
      hit->turning = hit->k;
    }
    worst = PetscMax(worst, error);
  }
  c->unsettled = largest > 0 ? worst / (c->mu * largest) : 0;
  if (c->unsettled > (c->updates > UPDATES ? LATE : SETTLED)) *changed = PETSC_TRUE;
}

/* Says once that friction was taken as it was. Collective. */
static PetscErrorCode warn_unsettled(Collision *c, const char effect[], SbSpace space, PetscReal t)
{
  PetscReal most = c->unsettled;

  PetscFunctionBeginUser;
  if (c->updates <= UPDATES || c->said) PetscFunctionReturn(PETSC_SUCCESS); /* alike on all ranks */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, space->comm));
  if (most <= SETTLED) PetscFunctionReturn(PETSC_SUCCESS);
  c->said = PETSC_TRUE;
  PetscCall(SbWarning(space->comm,
                      "at t = %g s the friction of the effect %s settled to %.1g of the largest only, not to "
                      "%g; said once: smaller steps make it more exact",
                      (double)t, effect, (double)most, SETTLED));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFrictionAccept(Collision *c, const char effect[], SbSpace space, PetscReal t)
{
  PetscFunctionBeginUser;
  PetscCall(warn_unsettled(c, effect, space, t));
  for (PetscInt i = 0; i < c->nhit; i++) {
    Hit *hit = &c->hit[i];

    if (!hit->on || SbCollisionForce(c, hit) <= 0) { /* nothing holds it where it was */
      for (int k = 0; k < 3; k++) hit->stretch[k] = hit->drag[k] = 0;
      hit->slid = PETSC_FALSE;
      continue;
    }
    hit->slid = hit->slides;
    for (int k = 0; k < 3; k++) {
      c->loss -= hit->drag[k] * (hit->now[k] - hit->start[k]);
      hit->stretch[k] = exact(c->response) ? 0 : -hit->drag[k] / hit->k;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
