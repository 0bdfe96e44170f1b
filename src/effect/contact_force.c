/*
  contact_force.c - pose of the obstacle, contact forces on nodes and their derivatives, the end of a step, history. The
  method is described in contact.c.
*/
#include "contact_node.h"

/* ------------------------------------------------------------------ geometry */

void SbContactPose(const Contact *c, PetscReal t, SbPose *pose)
{
  PetscReal d[3];

  for (int i = 0; i < 3; i++) d[i] = SbFormulaEval(c->displacement[i], t, NULL);
  SbPoseSet(c->axis, SbFormulaEval(c->angle, t, NULL) * PETSC_PI / 180, c->point, d, pose);
}

PetscReal SbContactGap(const Contact *c, const SbPose *pose, const PetscReal x[3], PetscReal n[3])
{
  PetscReal X[3], N[3], gap;

  SbPoseInvert(pose, x, X);
  gap = SbObstacleDistance(c->obstacle, X, N);
  for (int i = 0; i < 3; i++) n[i] = SbDot3(pose->R + 3 * i, N);
  return gap;
}

/* ------------------------------------------------------------------ forces */

/*
  Normal force on a node at x, N; n: the normal. Springs follow the current normal; a constrained node keeps that of its constraint: at edges between
  facets a current one would jump within Newton's method.
*/
static PetscReal normal_force(const Contact *c, const SbPose *pose, const Touch *touch, const PetscReal x[3],
                              PetscReal n[3])
{
  if (c->held) {
    for (int k = 0; k < 3; k++) n[k] = touch->n[k];
    return touch->on && touch->along >= 0 ? SbContactForce(c, touch) : 0;
  }
  return spring(touch, SbContactGap(c, pose, x, n) - touch->rest);
}

PetscErrorCode SbEffectForce_Contact(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Contact *c = (const Contact *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], n[3], normal;

    place(space, touch->node, stage->u, x);
    normal = normal_force(c, &pose, touch, x, n);
    for (int k = 0; k < 3; k++) f[3 * touch->node + k] += normal * n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rotation of the normal is neglected. */
PetscErrorCode SbEffectTangent_Contact(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Contact *c = (const Contact *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], n[3], block[9];

    place(space, touch->node, stage->u, x);
    if (normal_force(c, &pose, touch, x, n) <= 0) continue;
    for (int k = 0; k < 9; k++) block[k] = stage->shift_k * touch->stiff * n[k / 3] * n[k % 3];
    PetscCall(SbSpaceAddSpring(space, A, touch->cell, touch->a, block));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ after a step */

void SbContactStretch(const SbPose *pose, Touch *touch)
{
  for (int k = 0; k < 3; k++) {
    touch->stretch[k] = 0;
    for (int i = 0; i < 3; i++) touch->stretch[k] += pose->R[3 * i + k] * touch->friction.stretch[i];
  }
}

PetscErrorCode SbEffectAccept_Contact(SbEffect e, SbSpace space, const SbStage *stage)
{
  Contact *c = (Contact *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  if (c->friction.mu > 0) PetscCall(SbFrictionWarn(&c->friction, e->name, space, stage->t));
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    PetscReal x[3], n[3];

    place(space, touch->node, stage->u, x);
    if (!exact(c)) touch->on = (PetscBool)(normal_force(c, &pose, touch, x, n) > 0);
    if (c->friction.mu > 0) { /* history variables */
      SbFrictionAccept(&c->friction, touch,
                       (PetscBool)(touch->on && touch->along >= 0 && SbContactForce(c, touch) > 0));
      SbContactStretch(&pose, touch);
    }
    touch->was = (PetscBool)(touch->on && touch->rest <= 0);
    touch->kept = PetscMin(0, touch->rest);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force of the obstacle on a node at x, N. */
static void force_on(const Contact *c, const SbPose *pose, SbSpace space, const Touch *touch,
                     const PetscReal x[3], PetscReal f[3])
{
  PetscReal n[3], normal = normal_force(c, pose, touch, x, n);

  f[0] = f[1] = f[2] = 0;
  if (normal <= 0) return;
  if (c->held) normal = SbSpaceGetConstraint(space, touch->along)->force;
  for (int k = 0; k < 3; k++) f[k] = normal * n[k] + (c->friction.mu > 0 ? touch->friction.force[k] : 0);
}

PetscErrorCode SbEffectGap_Contact(SbEffect e, SbSpace space, const SbStage *stage, PetscReal gap[],
                                   PetscReal normal[])
{
  const Contact *c = (const Contact *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->touch[i].node;
    PetscReal x[3], n[3], g;

    place(space, node, stage->u, x);
    g = SbContactGap(c, &pose, x, n);
    if (g >= gap[node]) continue;
    gap[node] = g;
    for (int k = 0; k < 3; k++) normal[3 * node + k] = n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectContactPoints_Contact(SbEffect e, SbSpace space, const SbStage *stage,
                                             SbContactPoints *list)
{
  const Contact *c = (const Contact *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    SbContactPoint p = {.body = {space->node_body[touch->node], -1},
                        .id = {0, space->node_orig[touch->node], 0}};

    place(space, touch->node, stage->u, p.x);
    if (normal_force(c, &pose, touch, p.x, p.normal) <= 0) continue;
    force_on(c, &pose, space, touch, p.x, p.force);
    p.gap = SbContactGap(c, &pose, p.x, p.normal);
    if (exact(c)) PetscCall(PetscArraycpy(p.normal, touch->n, 3)); /* the normal of the constraint */
    PetscCall(SbContactPointsAdd(list, &p));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force and torque of the obstacle on the bodies, number of active nodes, deepest penetration. */
PetscErrorCode SbEffectHistory_Contact(SbEffect e, SbSpace space, const SbStage *stage,
                                       const PetscReal residual[], PetscReal values[])
{
  Contact *c = (Contact *)e->data;
  PetscReal deepest[2] = {0, 0};
  PetscMPIInt rank;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  (void)residual;
  for (int k = 0; k < 8; k++) values[k] = 0;
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], n[3], f[3], arm[3], moment[3];

    place(space, touch->node, stage->u, x);
    deepest[0] = PetscMax(deepest[0], -SbContactGap(c, &pose, x, n));
    if (normal_force(c, &pose, touch, x, n) <= 0) continue;
    force_on(c, &pose, space, touch, x, f);
    for (int k = 0; k < 3; k++) arm[k] = x[k] - c->point[k] - pose.d[k];
    SbCross(arm, f, moment);
    for (int k = 0; k < 3; k++) {
      values[k] += f[k];
      values[3 + k] += moment[k];
    }
    values[6]++;
  }
  PetscCallMPI(MPI_Allreduce(&deepest[0], &deepest[1], 1, MPIU_REAL, MPI_MAX, space->comm));
  PetscCallMPI(MPI_Comm_rank(space->comm, &rank));
  /* smaller values are within the tolerance */
  if (!rank && deepest[1] > TOLERANCE * c->size) values[7] = deepest[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}
