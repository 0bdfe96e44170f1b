/*
  response_springs.c - the responses `penalty` and `augmented` of nodes: springs between the nodes
  and the obstacle.

  `penalty`: N = k <-g>, <x> = max(x, 0), with k from the stiffness of the cell behind, near
  incompressibility that of nu = 0.45: a surface deforms by shear, and springs stiffer by orders
  make E so ill-conditioned that the line search takes tiny steps. `augmented`: the penalty with a
  multiplier, N = <lambda - k g>, updated after each solve until penetration is within the tolerance
  (Simo and Laursen 1992).

  Without friction the springs are forces of the effect. With it they are constraints with a
  stiffness, linear while normals and the active set stay fixed, that is, in each solve.
*/
#include "nodes.h"

/* Whether a spring's force agrees with its position; for `augmented`, which updates the multiplier,
   also whether the penetration is within the tolerance. */
PetscBool SbNodeUpdate_Springs(const Nodes *c, PetscReal largest, ContactNode *touch)
{
  const PetscReal force = spring(touch, touch->gap);
  PetscBool right = PETSC_TRUE;

  if (c->held) {
    if (!touch->on && force > 0) {
      SbNodeEnter(c, touch);
      touch->toggles++;
    } else if (force <= 0 && touch->toggles < NODE_TOGGLES)
      touch->on = PETSC_FALSE;
    right = (PetscBool)(touch->spring.wrong <= NODE_SETTLED * largest);
  }
  if (c->contact.response == PENALTY)
    return right;
  if (force > 0 ? PetscAbsReal(touch->gap) <= NODE_TOLERANCE * c->size : touch->lambda <= 0)
    return right;
  touch->lambda = force;
  return PETSC_FALSE;
}

PetscErrorCode SbEffectForce_Springs(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Nodes *c = (const Nodes *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &pose));
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];
    PetscReal x[3], n[3], normal;

    place(space, touch->node, stage->u, x);
    normal = SbNodeNormalForce(c, &pose, touch, x, n);
    for (int k = 0; k < 3; k++)
      f[3 * touch->node + k] += normal * n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rotation of the normal is neglected. Springs that touch without force resist in static runs,
   as nothing else may hold the body: at that place both slopes are right. */
PetscErrorCode SbEffectTangent_Springs(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Nodes *c = (const Nodes *)e->data;
  const PetscReal touching = e->dynamic ? 0. : NODE_TOLERANCE * c->size;
  SbPose pose;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &pose));
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];
    PetscReal x[3], n[3], block[9];

    place(space, touch->node, stage->u, x);
    if (SbNodeNormalForce(c, &pose, touch, x, n) <= 0 &&
        (c->held || touch->spring.idle || touch->lambda != 0. ||
         SbNodeGap(c, &pose, x, n) - touch->rest > touching))
      continue;
    for (int k = 0; k < 9; k++)
      block[k] = stage->shift_k * touch->spring.stiff * n[k / 3] * n[k % 3];
    PetscCall(SbSpaceAddSpring(space, A, touch->cell, touch->a, block));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
