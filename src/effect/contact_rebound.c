/*
  contact_rebound.c - restitution of nodes that meet a rigid obstacle. The law and what it does to the energy are told in
  src/model/rebound.c.
*/
#include "contact.h"

PetscBool SbContactComes(const Contact *c, const SbPose *from, const PetscReal x0[3], const PetscReal v0[3],
                         Touch *touch)
{
  PetscReal n[3], X[3], x1[3], v = 0;

  touch->arrives = 0;
  if (!v0 || touch->was || touch->rest < 0) return PETSC_FALSE;
  touch->gap0 = PetscMax(0, SbContactGap(c, from, x0, n));
  /* the obstacle's point there moves with it */
  SbPoseInvert(from, x0, X);
  SbPoseApply(&c->to, X, x1);
  for (int i = 0; i < 3; i++) v -= n[i] * (v0[i] - (x1[i] - x0[i]) / c->bounce.dt);
  touch->arrives = PetscMax(0, v);
  return SbReboundComes(&c->bounce, touch->gap0, v);
}

/* The node is held elsewhere. */
static void move_to(PetscReal rest, Touch *touch)
{
  touch->value += rest - touch->rest;
  touch->gap -= rest - touch->rest;
  touch->rest = rest;
}

void SbContactHit(const Contact *c, Touch *touch)
{
  if (touch->arrives > 0 && touch->rest == 0)
    move_to(SbReboundTo(&c->bounce, touch->gap0, touch->arrives), touch);
}

PetscErrorCode SbEffectRebound_Contact(SbEffect e, PetscReal *work)
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

PetscErrorCode SbEffectCurb_Contact(SbEffect e, PetscReal share)
{
  Contact *c = (Contact *)e->data;

  PetscFunctionBeginUser;
  c->bounce.left = share;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    if (touch->rest > 0) move_to(SbReboundTo(&c->bounce, touch->gap0, touch->arrives), touch);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
