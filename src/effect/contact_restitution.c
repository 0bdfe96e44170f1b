/*
  contact_restitution.c - velocities at a rigid obstacle: restitution of impacting nodes (law and energy:
  src/model/restitution.c), and the obstacle's velocity at active nodes.
*/
#include "contact_node.h"

#define INSTANT 1e-3 /* fraction of a step for the difference quotient of the obstacle's velocity */

PetscBool SbContactComes(const Contact *c, const SbPose *from, const PetscReal x0[3], const PetscReal v0[3],
                         Touch *touch)
{
  PetscReal n[3], X[3], x1[3], v = 0;

  touch->approach = 0;
  if (!v0 || touch->was || touch->rest < 0) return PETSC_FALSE;
  touch->gap0 = PetscMax(0, SbContactGap(c, from, x0, n));
  /* the obstacle's point there moves with it */
  SbPoseInvert(from, x0, X);
  SbPoseApply(&c->to, X, x1);
  for (int i = 0; i < 3; i++) v -= n[i] * (v0[i] - (x1[i] - x0[i]) / c->bounce.dt);
  touch->approach = PetscMax(0, v);
  return SbRestitutionApproaches(&c->bounce, touch->gap0, v);
}

/* Changes the gap that the node is constrained to. */
static void move_to(PetscReal rest, Touch *touch)
{
  touch->value += rest - touch->rest;
  touch->gap -= rest - touch->rest;
  touch->rest = rest;
}

void SbContactHit(const Contact *c, Touch *touch)
{
  if (touch->approach > 0 && touch->rest == 0)
    move_to(SbRestitutionGap(&c->bounce, touch->gap0, touch->approach), touch);
}

PetscErrorCode SbEffectRestitution_Contact(SbEffect e, PetscReal *work)
{
  const Contact *c = (const Contact *)e->data;

  PetscFunctionBeginUser;
  *work = 0;
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];

    if (touch->on && touch->rest > 0) *work += touch->lambda * (touch->rest - touch->gap0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectScaleRestitution_Contact(SbEffect e, PetscReal share)
{
  Contact *c = (Contact *)e->data;

  PetscFunctionBeginUser;
  c->bounce.left = share;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    if (touch->rest > 0) move_to(SbRestitutionGap(&c->bounce, touch->gap0, touch->approach), touch);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Velocity of the obstacle at each active node. */
PetscErrorCode SbEffectTargetVelocity_Contact(SbEffect e, SbSpace space, const SbStage *stage)
{
  const Contact *c = (const Contact *)e->data;
  SbPose before, now;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &now);
  SbContactPose(c, stage->t - INSTANT * stage->dt, &before);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], X[3], from[3], to[3], v[3];

    if (!touch->on || touch->along < 0) continue;
    place(space, touch->node, stage->u, x);
    SbPoseInvert(&now, x, X);
    SbPoseApply(&before, X, from);
    SbPoseApply(&now, X, to);
    for (int k = 0; k < 3; k++) v[k] = (to[k] - from[k]) / (INSTANT * stage->dt);
    SbSpaceGetConstraint(space, touch->along)->velocity = SbDot3(touch->n, v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
