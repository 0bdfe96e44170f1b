/*
  friction_nodes.c - Coulomb friction of pairs in contact: |T| <= mu N, and T = -mu N along the slip
  if it slides.

  A sticking pair has two exact tangential constraints, or two springs. A sliding pair has its
  contact force along n - mu d, d the direction of the slip, so that friction uses N of the same
  solve; a spring normal to d adapts the direction. After a solve a sticking pair with more than mu
  N slides, and one that slid backwards sticks: a semismooth Newton method (Alart and Curnier 1991;
  Hueeber, Stadler, Wohlmuth 2008).

  The slip is that of the step, as in implicit Euler, plus with springs their deflection at its
  start.

  A node in the corner of two obstacles cannot stick to both by exact constraints: they would be
  redundant. Such a pair sticks by springs while in contact.
*/
#include "nodes.h"

#define FLIPS \
  10 /* changes of a pair between stick and slip within a step, after which it has springs */
#define STIFF \
  1e-3 /* smallest relative difference of trial force and limit, for the stiffness across */

void SbFrictionBegin(SbFrictionState *g, PetscBool touches)
{
  if (!touches) { /* a point that comes into contact in this step sticks to its initial position */
    for (int k = 0; k < 3; k++)
      g->stretch[k] = 0;
    g->pressing = 0;
    g->slid = g->crowded = PETSC_FALSE;
  }
  g->slides = g->slid;
  g->flips = 0;
}

/* Whether a pair sticks by springs. */
static inline PetscBool springs(const Nodes *c, const SbFrictionState *g)
{
  return (PetscBool)(!exact(c) || g->crowded);
}

/* Whether a pair that alternates has secant springs of the last solve (Kacanov's method), slow but
   robust. */
static inline PetscBool careful(const SbFrictionState *g)
{
  return (PetscBool)(g->flips > FLIPS);
}

static PetscReal coefficient(const Nodes *c, const SbFrictionState *g)
{
  return g->slid ? c->contact.friction.mu_kinetic : c->contact.friction.mu;
}

/* Tangential part of a vector; returns its length. */
static PetscReal across(const PetscReal n[3], PetscReal v[3])
{
  const PetscReal along = SbDot3(n, v);

  for (int k = 0; k < 3; k++)
    v[k] -= along * n[k];
  return PetscSqrtReal(SbDot3(v, v));
}

/* Tangential slip of the step plus earlier deflection of springs, m; returns its length. */
static PetscReal slip(const ContactNode *touch, PetscReal s[3])
{
  for (int k = 0; k < 3; k++)
    s[k] = touch->friction.stretch[k] + touch->friction.now[k] - touch->friction.start[k];
  return across(touch->facets.plane.n, s);
}

/* Rotates the two tangents, the first one along v or its tangential part. */
static void turn(ContactNode *touch, const PetscReal v[3])
{
  const PetscReal *n = touch->facets.plane.n;
  SbFrictionState *g = &touch->friction;
  PetscReal t[3] = {v[0], v[1], v[2]};
  PetscReal length = across(n, t);

  if (length <= 1e-12 * PetscSqrtReal(SbDot3(v, v))) {
    const int k = PetscAbsReal(n[0]) < 0.6 ? 0 : 1;

    for (int i = 0; i < 3; i++)
      t[i] = i == k;
    length = across(n, t);
  }
  for (int i = 0; i < 3; i++)
    g->tangent[0][i] = t[i] / length;
  SbCross(n, g->tangent[0], g->tangent[1]);
}

void SbFrictionEnter(const Nodes *c, ContactNode *touch, PetscReal depth)
{
  SbFrictionState *g = &touch->friction;
  PetscReal s[3];
  const PetscReal length = slip(touch, s);
  const PetscReal most = coefficient(c, g) * PetscMax(0, depth);

  g->slides = (PetscBool)(length > most);
  if (!g->slides)
    return;
  g->turning = touch->spring.k * most / length;
  turn(touch, s);
}

void SbFrictionDirection(const Nodes *c, const ContactNode *touch, PetscReal push[3])
{
  const SbFrictionState *g = &touch->friction;
  PetscReal t[3], length, part;

  for (int k = 0; k < 3; k++)
    t[k] = g->tangent[0][k];
  length = across(touch->facets.plane.n, t);
  part = g->slides && !careful(g) && length > 0 ? coefficient(c, g) / length : 0;
  for (int k = 0; k < 3; k++)
    push[k] = touch->facets.plane.n[k] - part * t[k];
}

PetscErrorCode SbFrictionConstrain(const Nodes *c, SbSpace space, ContactNode *touch)
{
  SbFrictionState *g = &touch->friction;

  PetscFunctionBeginUser;
  if (g->slides)
    turn(touch, g->tangent[0]);
  else { /* drop prescribed components; the second tangent must be a free direction */
    const uint8_t bits = space->fixed[touch->node];
    const PetscReal fixed[3] = {bits == 1, bits == 2, bits == 4};
    PetscReal v[3];

    SbCross(touch->facets.plane.n, fixed, v);
    turn(touch, SbDot3(v, v) > 1e-12 ? v : g->tangent[0]);
  }
  for (int q = 0; q < 2; q++) {
    const PetscReal *t = g->tangent[q];
    SbConstraint row = {.node = touch->node,
                        .value = SbDot3(t, touch->friction.start) - SbDot3(t, g->stretch)};

    for (int k = 0; k < 3; k++)
      row.n[k] = row.push[k] = t[k];
    if (!g->slides && !springs(c, g) && !careful(g)) {
      PetscCall(SbSpaceAddConstraint(space, &row, &g->slide[q]));
      if (g->slide[q] >= 0)
        continue;
      g->crowded = PETSC_TRUE; /* constraints of other effects hold it */
    }
    row.spring = PETSC_TRUE;
    if (!careful(g) && !g->slides)
      row.stiffness = touch->spring.k;
    else if (careful(g) || q)
      row.stiffness = g->turning;
    PetscCall(SbSpaceAddConstraint(space, &row, &g->slide[q]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbFrictionRead(const Nodes *c, SbSpace space, ContactNode *touch, PetscReal N)
{
  SbFrictionState *g = &touch->friction;

  for (int k = 0; k < 3; k++)
    g->force[k] =
      g->slides && !careful(g) ? -coefficient(c, g) * PetscMax(0, N) * g->tangent[0][k] : 0;
  for (int q = 0; q < 2; q++) {
    const PetscReal force = SbSpaceGetConstraint(space, g->slide[q])->force;

    for (int k = 0; k < 3; k++)
      g->force[k] += force * g->tangent[q][k];
  }
}

/* The same by springs for a pair that alternates (SbFrictionUpdate()); N is the mean of both
   solves. */
static PetscReal update_by_secant(const Nodes *c, PetscReal before, ContactNode *touch)
{
  SbFrictionState *g = &touch->friction;
  const PetscReal mu = coefficient(c, g);
  const PetscReal most = mu * PetscMax(0, g->pressing);
  PetscReal s[3], wrong[3];
  const PetscReal length = slip(touch, s);
  const PetscReal part = length > 0 ? PetscMin(touch->spring.k, most / length) : touch->spring.k;

  for (int k = 0; k < 3; k++)
    wrong[k] = g->force[k] + part * s[k];
  g->slides = (PetscBool)(touch->spring.k * length > most);
  g->pressing = 0.5 * (before + g->pressing);
  g->turning = length > 0 ? PetscMin(touch->spring.k, mu * PetscMax(0, g->pressing) / length)
                          : touch->spring.k;
  if (g->slides)
    turn(touch, s);
  return PetscSqrtReal(SbDot3(wrong, wrong));
}

/* Updates stick or slip of a pair; returns the error of its friction, N. With T the force opposing
   the slip s and a stiffness k, the trial force is T + k s, or k s with springs. It slides where
   that is longer than mu N, with T = mu N along it; the derivative of that direction is the
   stiffness across it. */
static PetscReal update(const Nodes *c, ContactNode *touch)
{
  SbFrictionState *g = &touch->friction;
  const PetscReal most = coefficient(c, g) * PetscMax(0, g->pressing);
  const PetscBool slid = g->slides;
  PetscReal s[3], trial[3];
  PetscReal wrong[3] = {0};
  PetscReal size;

  slip(touch, s);
  for (int k = 0; k < 3; k++)
    trial[k] = touch->spring.k * s[k] - (springs(c, g) ? 0 : g->force[k]);
  size = PetscSqrtReal(SbDot3(trial, trial));

  /* slid backwards: sticks */
  g->slides = (PetscBool)(size > most && (!slid || SbDot3(trial, g->tangent[0]) >= 0));
  if (g->slides) {
    const PetscReal over = springs(c, g) ? size : PetscMax(size - most, STIFF * size);

    if (!slid || SbDot3(trial, g->tangent[0]) < 0.5 * size)
      g->flips++;
    for (int k = 0; k < 3; k++)
      wrong[k] = g->force[k] + most / size * trial[k];
    g->turning = touch->spring.k * most / over;
    turn(touch, trial);
  } else if (slid) {
    g->flips++;
    for (int k = 0; k < 3; k++)
      wrong[k] = touch->spring.k * s[k];
  }
  return PetscSqrtReal(SbDot3(wrong, wrong));
}

PetscReal SbFrictionUpdate(const Nodes *c, ContactNode *touch, PetscReal N)
{
  SbFrictionState *g = &touch->friction;
  const PetscReal before = g->pressing;
  PetscReal error;

  g->pressing = N;
  if (g->slide[0] < 0)
    return 0;
  error = careful(g) ? update_by_secant(c, before, touch) : update(c, touch);
  if (careful(g) && g->flips < 2 * FLIPS) { /* begins now */
    g->flips = 2 * FLIPS;
    g->turning = touch->spring.k;
  }
  return error;
}

void SbFrictionAccept(const Nodes *c, ContactNode *touch, PetscBool presses)
{
  SbFrictionState *g = &touch->friction;

  if (!presses) { /* nothing holds it where it was */
    for (int k = 0; k < 3; k++)
      g->stretch[k] = g->force[k] = 0;
    g->slid = g->crowded = PETSC_FALSE;
    return;
  }
  g->slid = g->slides;
  for (int k = 0; k < 3; k++)
    g->stretch[k] = springs(c, g) ? -g->force[k] / touch->spring.k : 0;
}

void SbFrictionRotate(const SbPose *pose, SbFrictionState *g)
{
  const PetscReal *R = pose->R;
  const PetscReal *s = g->stretch;

  for (int k = 0; k < 3; k++)
    g->kept[k] = R[k] * s[0] + R[3 + k] * s[1] + R[6 + k] * s[2];
}
