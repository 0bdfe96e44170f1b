/*
  contact_facets.c - constrained nodes where facets of an obstacle's mesh meet.

  There a node may alternate between facets with every update of the active set. At a concave edge ("valley")
  both act: constrained on one of them it penetrates the other one. So it is constrained on both for a solve,
  which gives both forces. If neither is tensile, their resultant is the normal in equilibrium, and the node
  is constrained along it until the end of the step; else the tensile one is released. On two facets it slides
  along the edge, possibly behind a third one, which then replaces the one with the smaller force.

  Elsewhere (convex edges, and with friction) normals are averaged over searches, after many kept.
*/
#include "contact_node.h"

#define VALLEY 2    /* flips of an active node between facets in a step that allow two constraints */
#define AVERAGED 4  /* flips after which normals are averaged */
#define GIVEN_UP 16 /* flips after which it is not constrained on two any more */
#define JUMP 1e-6   /* 1 - cosine: a flip */

static void set_plane(const PetscReal n[3], PetscReal value, PetscReal to[3], PetscReal *to_value)
{
  for (int i = 0; i < 3; i++) to[i] = n[i];
  *to_value = value;
}

/* Right-hand side n . u of the constraint on the plane with normal n at the distance `gap` from x, m. */
static PetscReal level_of(const PetscReal X[3], const PetscReal x[3], PetscReal gap, const PetscReal n[3],
                          const Touch *touch)
{
  return SbDot3(n, x) - SbDot3(n, X) - gap + touch->rest;
}

PetscBool SbContactFlip(const Contact *c, const PetscReal X[3], const PetscReal x[3], PetscReal gap,
                        PetscReal n[3], Touch *touch)
{
  const PetscReal level = level_of(X, x, gap, n, touch), before = touch->level;
  const PetscBool flips = (PetscBool)(SbDot3(n, touch->surface) < 1 - JUMP);
  PetscReal last[3];

  for (int i = 0; i < 3; i++) last[i] = touch->surface[i];
  set_plane(n, level, touch->surface, &touch->level);
  if (flips) touch->flips++;
  if (flips && touch->along >= 0 && c->friction.mu <= 0 && c->bounce.e <= 0 && touch->flips > VALLEY &&
      touch->flips <= GIVEN_UP && gap - touch->rest < -TOLERANCE * c->size) {
    touch->valley = touch->undecided = PETSC_TRUE;
    set_plane(n, level, touch->n, &touch->value);
    set_plane(last, before, touch->other, &touch->other_value);
    return PETSC_TRUE;
  }
  if (touch->flips <= AVERAGED) return PETSC_FALSE;
  if (!flips && PetscAbsReal(gap - touch->rest) > TOLERANCE * c->size) touch->flips++; /* looks are bounded */
  for (int i = 0; i < 3; i++) n[i] = touch->n[i] + (n[i] - touch->n[i]) / (touch->flips - AVERAGED + 1);
  (void)SbNormalise(n);
  return PETSC_FALSE;
}

void SbContactValley(const Contact *c, SbSpace space, const PetscReal x[3], PetscReal gap,
                     const PetscReal n[3], Touch *touch)
{
  const PetscReal *X = space->node_x + 3 * touch->node;
  const PetscReal force = touch->lambda, other = touch->other_lambda, level = level_of(X, x, gap, n, touch);
  PetscReal sum[3];

  touch->undecided = PETSC_TRUE;
  set_plane(n, level, touch->surface, &touch->level);
  if (touch->other_along < 0 || other < 0 || force < 0) { /* one of them is left */
    touch->valley = PETSC_FALSE;
    touch->flips++;
    if (touch->other_along >= 0 && other > force) {
      set_plane(touch->other, touch->other_value, touch->n, &touch->value);
      touch->lambda = other;
    }
  } else if (PetscAbsReal(gap - touch->rest) > TOLERANCE * c->size) {
    touch->flips++; /* and on a third one, or not yet where both meet */
    if (SbDot3(n, touch->other) > 1 - JUMP || SbDot3(n, touch->n) > 1 - JUMP) return;
    if (force > other) set_plane(touch->n, touch->value, touch->other, &touch->other_value);
    set_plane(n, level, touch->n, &touch->value);
    if (touch->flips > GIVEN_UP) touch->valley = PETSC_FALSE;
  } else if (space->rough)
    touch->undecided = PETSC_FALSE; /* a loose solve gives no accurate forces */
  else {
    for (int i = 0; i < 3; i++) sum[i] = force * touch->n[i] + other * touch->other[i];
    touch->lambda = SbNormalise(sum);
    if (touch->lambda > 0) set_plane(sum, SbDot3(sum, x) - SbDot3(sum, X), touch->n, &touch->value);
    touch->valley = PETSC_FALSE;
    touch->flips = KEPT + 1;
  }
}
