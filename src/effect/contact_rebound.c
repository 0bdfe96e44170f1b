/*
  contact_rebound.c - restitution: a node that meets the obstacle within a step leaves it with the velocity v+ = -e v-.

  Newton's law in Moreau's form (Moreau 1988; Jean, "The non-smooth contact dynamics method", CMAME 177, 1999) for the normal velocity of
  a node relative to the obstacle: v+ + e v- >= 0, force >= 0, and one of them zero, for nodes that would be behind the obstacle at
  the end of the step, with the velocity v- or by what the solves find. v- is the velocity when the step begins. Implicit Euler has
  v+ = (gap1 - gap0) / h: the node is held at

      gap1 = gap0 + h e |v-|,

  or let go when that takes a pull and it moves beyond; in the next step it is free. Force and elasticity are solved for together, so what
  bounces is all that moves with the node within a step: a body that is stiff against its inertia, sqrt(k/m) h >> 1, bounces as a
  whole. In a soft one the node's share is small, whatever e is; it bounces by its elasticity (Doyen, Ern, Piperno, SIAM J. Sci.
  Comput. 33, 2011).

  Energy. With W = sum h N v+ over these nodes and D = 1/2 |v1 - v0|^2 in the norm of the mass, a step of implicit Euler with a convex
  strain energy gains at most W - D plus the work of the loads. After each solve W <= D is seen to, in the frame of the obstacle: where
  it does not hold, all e are reduced and the step is solved again. For a body that arrives unstressed and stiff W / D =
  2 e / (1 + e) <= 1, so that nothing is reduced there.

  The first step of a run, or after a restart, knows no v-: nobody rebounds in it.
*/
#include "contact.h"

#define REDUCTIONS 8 /* of e within a step; then it is 0 */
#define SAFE 0.9     /* of the reduction that would do if W grew with e */
#define EARLY \
  1e-6 /* of the way of a step: who would only just not arrive arrives, so that a flat base does so at once */
#define ROUND 1e-9 /* of D: W that counts as not larger */

PetscErrorCode SbReboundCreate(Contact *c, SbSpace space)
{
  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(3 * space->nnode_owned, &c->u0, 3 * space->nnode_owned, &c->v0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReboundBegin(Contact *c, SbSpace space, PetscReal dt, const PetscReal u0[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(c->u0, u0, 3 * space->nnode_owned));
  c->dt = dt;
  c->share = 1;
  c->reductions = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReboundEnd(Contact *c, SbSpace space, const PetscReal v[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(c->v0, v, 3 * space->nnode_owned));
  c->known = PETSC_TRUE;
  for (PetscInt i = 0; i < c->n; i++) c->touch[i].was = (PetscBool)(c->touch[i].on && c->touch[i].rest <= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the node leaves to, or 0. */
static inline PetscReal leaves_to(const Contact *c, const Touch *touch)
{
  return touch->arrives > 0 ? touch->gap0 + c->dt * c->share * c->restitution * touch->arrives : 0;
}

PetscBool SbRebound(const Contact *c, const SbPose *from, const PetscReal x0[3], Touch *touch)
{
  PetscReal n[3], X[3], x1[3], v = 0;

  touch->arrives = 0;
  if (!c->known || touch->was || touch->rest < 0) return PETSC_FALSE;
  touch->gap0 = PetscMax(0, SbContactGap(c, from, x0, n));
  /* the obstacle's point there moves with it */
  SbPoseInvert(from, x0, X);
  SbPoseApply(&c->to, X, x1);
  for (int i = 0; i < 3; i++) v -= n[i] * (c->v0[3 * touch->node + i] - (x1[i] - x0[i]) / c->dt);
  touch->arrives = PetscMax(0, v);
  return (PetscBool)(v > 0 && c->dt * v * (1 + EARLY) >= touch->gap0);
}

/* The node is held elsewhere. */
static void move_to(PetscReal rest, Touch *touch)
{
  touch->value += rest - touch->rest;
  touch->gap -= rest - touch->rest;
  touch->rest = rest;
}

void SbReboundHit(const Contact *c, Touch *touch)
{
  if (touch->arrives > 0 && touch->rest == 0) move_to(leaves_to(c, touch), touch);
}

/* W and D of the step, J, of all ranks; `wait`: who touches is not settled everywhere. */
static PetscErrorCode measure_energy(const Contact *c, SbSpace space, const PetscReal u[], PetscBool *wait,
                                     PetscReal *W, PetscReal *D)
{
  PetscReal sums[3] = {0, 0, *wait ? 1 : 0};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];

    if (touch->on && touch->rest > 0) sums[0] += touch->lambda * (touch->rest - touch->gap0);
  }
  for (PetscInt i = 0; i < 3 * space->nnode_owned; i++)
    sums[1] += 0.5 * space->node_mass[i / 3] * PetscSqr((u[i] - c->u0[i]) / c->dt - c->v0[i]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPIU_REAL, MPI_SUM, space->comm));
  *W = sums[0];
  *D = sums[1];
  *wait = (PetscBool)(sums[2] > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbReboundSettle(Contact *c, SbSpace space, const PetscReal u[], PetscBool *changed)
{
  PetscBool wait = *changed;
  PetscReal W, D;

  PetscFunctionBeginUser;
  PetscCall(measure_energy(c, space, u, &wait, &W, &D));
  if (wait || space->rough || W <= D * (1 + ROUND)) PetscFunctionReturn(PETSC_SUCCESS);
  c->share *= ++c->reductions < REDUCTIONS ? SAFE * D / W : 0;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    if (touch->rest > 0) move_to(leaves_to(c, touch), touch);
  }
  *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
