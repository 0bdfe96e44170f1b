/*
  response_exact.c - the responses `projected` and `multiplier` of nodes: active nodes are
  constrained to the obstacle exactly.

  n . u is prescribed (src/fem/constraint.c), and the constraint force is the multiplier lambda.
  Primal-dual active set: after each solve nodes in tension are released, penetrating nodes are
  added, the normal is updated on a curved obstacle, and the solve is repeated until the set does
  not change (Kikuchi and Oden 1988; Hueeber and Wohlmuth 2005). A node that has been released and
  added several times within a step stays active, so that the loop ends. `projected` eliminates the
  constraints from the solves; `multiplier` has the forces as unknowns of them.
*/
#include "nodes.h"

#define INSTANT 1e-3 /* fraction of a step for the difference quotient of the obstacle's velocity */

PetscBool SbNodeUpdate_Exact(const Nodes *c, PetscReal largest, ContactNode *touch)
{
  if (!touch->on) {
    if (touch->gap >= -NODE_TOLERANCE * c->size)
      return PETSC_TRUE;
    SbNodeEnter(c, touch);
    touch->toggles++;
    return PETSC_FALSE;
  }
  if (touch->facets.along < 0)
    return PETSC_TRUE;
  if (touch->lambda < -NODE_PULLING * largest && touch->toggles < NODE_TOGGLES) {
    touch->on = touch->facets.valley = PETSC_FALSE;
    touch->lambda = 0;
    return PETSC_FALSE;
  }
  touch->lambda = PetscMax(0, touch->lambda);
  if (touch->facets.undecided)
    return PETSC_FALSE;
  return (PetscBool)(PetscAbsReal(touch->gap) <= NODE_TOLERANCE * c->size);
}

/* Velocities at the obstacle after a step: rebound. */
PetscErrorCode SbContactImpactWork_Exact(SbContact contact, PetscReal *work)
{
  const Nodes *c = (const Nodes *)contact;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];

    if (touch->on && touch->rest > 0)
      *work += touch->lambda * (touch->rest - touch->gap0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactScaleRestitution_Exact(SbContact contact, PetscReal share)
{
  Nodes *c = (Nodes *)contact;

  PetscFunctionBeginUser;
  c->contact.bounce.left = share;
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];

    if (touch->rest > 0)
      SbNodeMoveTo(SbRestitutionGap(&c->contact.bounce, touch->gap0, touch->approach), touch);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Velocity of the obstacle at each active node. */
PetscErrorCode SbContactTargetVelocity_Exact(SbContact contact, SbSpace space, const SbStage *stage)
{
  const Nodes *c = (const Nodes *)contact;
  SbPose before, now;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &now));
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t - INSTANT * stage->dt, &before));
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];
    PetscReal x[3], X[3], from[3], to[3], v[3];

    if (!touch->on || touch->facets.along < 0)
      continue;
    place(space, touch->node, stage->u, x);
    SbPoseInvert(&now, x, X);
    SbPoseApply(&before, X, from);
    SbPoseApply(&now, X, to);
    for (int k = 0; k < 3; k++)
      v[k] = (to[k] - from[k]) / (INSTANT * stage->dt);
    SbSpaceGetConstraint(space, touch->facets.along)->velocity = SbDot3(touch->facets.plane.n, v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
