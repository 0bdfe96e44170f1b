/*
  node_search.c - the facet of an obstacle that a node is constrained on, and its gap.

  Where facets of an obstacle's mesh meet a node may alternate between them with every update of the
  active set. At a concave edge ("valley") both act: constrained on one of them it penetrates the
  other one. So it is constrained on both for a solve, which gives both forces. If neither is
  tensile, their resultant is the normal in equilibrium, and the node is constrained along it until
  the end of the step; else the tensile one is released. On two facets it slides along the edge,
  possibly behind a third one, which then replaces the one with the smaller force. Elsewhere (convex
  edges, and with friction) normals are averaged over searches, after many kept.
*/
#include "nodes.h"

#define VALLEY 2   /* flips of an active node between facets in a step that allow two constraints */
#define AVERAGED 4 /* flips after which normals are averaged */
#define GIVEN_UP 16 /* flips after which it is not constrained on two any more */
#define JUMP 1e-6   /* 1 - cosine: a flip */
#define KEPT 24     /* flips after which a node keeps its plane until the end of the step */

PetscReal SbNodeGap(const Nodes *c, const SbPose *pose, const PetscReal x[3], PetscReal n[3])
{
  PetscReal X[3], N[3], gap;

  SbPoseInvert(pose, x, X);
  gap = SbObstacleDistance(c->contact.partner.obstacle, X, N);
  for (int i = 0; i < 3; i++)
    n[i] = SbDot3(pose->R + 3 * i, N);
  return gap;
}

/* Updates the planes of an active node after a solve, which constrained it to one facet; it is at
   the distance `gap` (m) from the plane of `facet`, whose normal may be averaged with earlier ones.
   Returns whether the node is on another facet now, too. */
static PetscBool flip(const Nodes *c, PetscReal gap, Plane *facet, ContactNode *touch)
{
  const PetscBool flips = (PetscBool)(SbDot3(facet->n, touch->facets.surface.n) < 1 - JUMP);
  const Plane last = touch->facets.surface;
  PetscReal *n = facet->n;

  touch->facets.surface = *facet;
  if (flips)
    touch->facets.flips++;
  if (flips && touch->facets.along >= 0 && c->contact.friction.mu <= 0 &&
      c->contact.bounce.e <= 0 && touch->facets.flips > VALLEY && touch->facets.flips <= GIVEN_UP &&
      gap - touch->rest < -NODE_TOLERANCE * c->size) {
    touch->facets.valley = touch->facets.undecided = PETSC_TRUE;
    touch->facets.plane = *facet;
    touch->facets.other = last;
    return PETSC_TRUE;
  }
  if (touch->facets.flips <= AVERAGED)
    return PETSC_FALSE;
  if (!flips && PetscAbsReal(gap - touch->rest) > NODE_TOLERANCE * c->size)
    touch->facets.flips++; /* looks are bounded */
  for (int i = 0; i < 3; i++)
    n[i] = touch->facets.plane.n[i] +
           (n[i] - touch->facets.plane.n[i]) / (touch->facets.flips - AVERAGED + 1);
  (void)SbNormalise(n);
  return PETSC_FALSE;
}

/* The same of a node that was constrained to two, its displacement being u. */
static void leave_valley(const Nodes *c, SbSpace space, const PetscReal u[3], PetscReal gap,
                         const Plane *facet, ContactNode *touch)
{
  const PetscReal force = touch->lambda;
  const PetscReal other = touch->facets.other_lambda;
  Plane *plane = &touch->facets.plane;

  touch->facets.undecided = PETSC_TRUE;
  touch->facets.surface = *facet;
  if (touch->facets.other_along < 0 || other < 0 || force < 0) { /* one of them is left */
    touch->facets.valley = PETSC_FALSE;
    touch->facets.flips++;
    if (touch->facets.other_along >= 0 && other > force) {
      *plane = touch->facets.other;
      touch->lambda = other;
    }
  } else if (PetscAbsReal(gap - touch->rest) > NODE_TOLERANCE * c->size) {
    touch->facets.flips++; /* and on a third one, or not yet where both meet */
    if (SbDot3(facet->n, touch->facets.other.n) > 1 - JUMP || SbDot3(facet->n, plane->n) > 1 - JUMP)
      return;
    if (force > other)
      touch->facets.other = *plane;
    *plane = *facet;
    if (touch->facets.flips > GIVEN_UP)
      touch->facets.valley = PETSC_FALSE;
  } else if (space->rough)
    touch->facets.undecided = PETSC_FALSE; /* a loose solve gives no accurate forces */
  else {
    Plane sum;

    for (int i = 0; i < 3; i++)
      sum.n[i] = force * plane->n[i] + other * touch->facets.other.n[i];
    touch->lambda = SbNormalise(sum.n);
    sum.value = SbDot3(sum.n, u);
    if (touch->lambda > 0)
      *plane = sum;
    touch->facets.valley = PETSC_FALSE;
    touch->facets.flips = KEPT + 1;
  }
}

/* Gap of the node at x less the gap it is constrained to; updates the plane of that. */
PetscReal SbNodeSearch(const Nodes *c, SbSpace space, const PetscReal x[3], ContactNode *touch)
{
  PetscReal u[3], at[3], gap;
  Plane facet;

  touch->facets.undecided = PETSC_FALSE;
  SbSubtract(x, space->node_x + 3 * touch->node, u);
  if (touch->on && touch->facets.flips > KEPT)
    return SbDot3(touch->facets.plane.n, u) - touch->facets.plane.value;
  gap = SbNodeGap(c, &c->contact.partner.pose[1], x, facet.n);
  for (int i = 0; i < 3; i++)
    at[i] = u[i] - gap * facet.n[i]; /* from the rest position to the surface */
  facet.value = SbDot3(facet.n, at) + touch->rest;
  if (touch->on && touch->facets.valley)
    leave_valley(c, space, u, gap, &facet, touch);
  else if (!c->mesh || !touch->on || !flip(c, gap, &facet, touch)) {
    facet.value = SbDot3(facet.n, at) + touch->rest;
    touch->facets.plane = facet;
  }
  if (!touch->on)
    touch->facets.surface = facet;
  return gap - touch->rest;
}

/* Changes the gap that the node is constrained to. */
void SbNodeMoveTo(PetscReal rest, ContactNode *touch)
{
  touch->facets.plane.value += rest - touch->rest;
  touch->gap -= rest - touch->rest;
  touch->rest = rest;
}

/* Activates a penetrating node. */
void SbNodeEnter(const Nodes *c, ContactNode *touch)
{
  if (!touch->on && c->contact.friction.mu > 0)
    SbFrictionEnter(c, touch, -touch->gap);
  touch->on = PETSC_TRUE;
  if (c->contact.bounce.e > 0 && touch->approach > 0 && touch->rest == 0)
    SbNodeMoveTo(SbRestitutionGap(&c->contact.bounce, touch->gap0, touch->approach), touch);
}

/* Normal force on a node at x, N; n: the normal. Springs follow the current normal; a constrained
   node keeps that of its constraint: at edges between facets a current one would jump within
   Newton's method. */
PetscReal SbNodeNormalForce(const Nodes *c, const SbPose *pose, const ContactNode *touch,
                            const PetscReal x[3], PetscReal n[3])
{
  if (c->held) {
    for (int k = 0; k < 3; k++)
      n[k] = touch->facets.plane.n[k];
    return touch->on && touch->facets.along >= 0 ? contact_force(c, touch) : 0;
  }
  return spring(touch, SbNodeGap(c, pose, x, n) - touch->rest);
}
