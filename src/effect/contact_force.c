/*
  contact_force.c - the obstacle, contact forces on nodes and their derivatives, the end of a step, history,
  checkpoints. The method is described in contact_node.c.
*/
#include "contact_node.h"

/* ------------------------------------------------------------------ the obstacle */

PetscErrorCode SbContactSetUpObstacle(SbEffect e, SbSpace space, Contact *c)
{
  char option[3 * SB_NAME_MAX], note[192] = "";

  PetscFunctionBeginUser;
  SbFormat(sizeof(option), option, "-effect_%s_obstacle", e->name);
  PetscCall(SbObstacleSetUp(c->obstacle, space->comm, option, c->scale, c->at, sizeof(note), note));
  if (note[0]) SbAppend(sizeof(e->note), e->note, "%s%s", e->note[0] ? "; " : "", note);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactDestroy(SbEffect e)
{
  Contact *c = (Contact *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbObstacleDestroy(&c->obstacle));
  PetscCall(SbPathDestroy(&c->path));
  PetscCall(PetscFree(c->touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbContactPose(const Contact *c, PetscReal t, SbPose *pose)
{
  PetscReal d[3];

  for (int i = 0; i < 3; i++) d[i] = SbFormulaEval(c->path.displacement[i], t, NULL);
  SbPoseSet(c->path.axis, SbFormulaEval(c->path.angle, t, NULL) * PETSC_PI / 180, c->path.point, d, pose);
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
  Normal force on a node at x, N; n: the normal. Springs follow the current normal; a constrained node keeps
  that of its constraint: at edges between facets a current one would jump within Newton's method.
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

/* Rotates the deflection of a node's springs with the obstacle. */
static void rotate_stretch(const SbPose *pose, Touch *touch)
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
      rotate_stretch(&pose, touch);
    }
    touch->was = (PetscBool)(touch->on && touch->rest <= 0);
    touch->kept = PetscMin(0, touch->rest);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force of the obstacle on a node at x, N; false: there is none. */
static PetscBool force_on(const Contact *c, const SbPose *pose, SbSpace space, const Touch *touch,
                          const PetscReal x[3], PetscReal f[3])
{
  PetscReal n[3], normal = normal_force(c, pose, touch, x, n);

  if (normal <= 0) return PETSC_FALSE;
  if (c->held) normal = SbSpaceGetConstraint(space, touch->along)->force;
  for (int k = 0; k < 3; k++) f[k] = normal * n[k] + (c->friction.mu > 0 ? touch->friction.force[k] : 0);
  return PETSC_TRUE;
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
    if (!force_on(c, &pose, space, touch, p.x, p.force)) continue;
    p.gap = SbContactGap(c, &pose, p.x, p.normal);
    if (exact(c)) PetscCall(PetscArraycpy(p.normal, touch->n, 3)); /* the normal of the constraint */
    PetscCall(SbReserve(list->n + 1, sizeof(p), &list->size, &list->point));
    list->point[list->n++] = p;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force and torque of the obstacle on the bodies, number of active nodes, deepest penetration. */
PetscErrorCode SbEffectHistory_Contact(SbEffect e, SbSpace space, const SbStage *stage,
                                       const PetscReal residual[], PetscReal values[])
{
  Contact *c = (Contact *)e->data;
  PetscReal deepest = 0;
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
    deepest = PetscMax(deepest, -SbContactGap(c, &pose, x, n));
    if (!force_on(c, &pose, space, touch, x, f)) continue;
    for (int k = 0; k < 3; k++) arm[k] = x[k] - c->path.point[k] - pose.d[k];
    SbCross(arm, f, moment);
    for (int k = 0; k < 3; k++) {
      values[k] += f[k];
      values[3 + k] += moment[k];
    }
    values[6]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &deepest, 1, MPIU_REAL, MPI_MAX, space->comm));
  PetscCallMPI(MPI_Comm_rank(space->comm, &rank));
  /* smaller values are within the tolerance */
  if (!rank && deepest > TOLERANCE * c->size) values[7] = deepest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ checkpoints */

/*
  A record has the node's original number, whether it is and was active, right-hand side and normal of its
  constraint, multiplier, gap, and friction state: enough to rebuild the constraints of the last solve, and to
  continue as the uninterrupted run.
*/
PetscErrorCode SbEffectSave_Contact(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Contact *c = (const Contact *)e->data;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscMalloc1(SB_CONTACT_STATE * c->n, records));
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    const PetscReal head[8] = {(PetscReal)space->node_orig[touch->node],
                               touch->on,
                               touch->was,
                               touch->rest,
                               touch->kept,
                               touch->lambda,
                               touch->value,
                               touch->gap};
    PetscReal *r = *records + SB_CONTACT_STATE * *n;

    if (!touch->on && !touch->was && touch->lambda == 0) continue;
    PetscCall(PetscArraycpy(r, head, 8));
    PetscCall(PetscArraycpy(r + 8, touch->n, 3));
    PetscCall(PetscArraycpy(r + 11, touch->surface, 3));
    r[14] = touch->friction.slid;
    r[15] = touch->friction.crowded;
    r[16] = touch->friction.turning;
    PetscCall(PetscArraycpy(r + 17, touch->friction.tangent[0], 3));
    PetscCall(PetscArraycpy(r + 20, touch->friction.stretch, 3));
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectLoad_Contact(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[], PetscInt n,
                                    const PetscReal records[])
{
  Contact *c = (Contact *)e->data;
  PetscInt *number, *at;

  PetscFunctionBeginUser;
  SbContactPose(c, t, &c->to);
  PetscCall(PetscMalloc2(c->n, &number, c->n, &at));
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    /* nodes without a record are inactive */
    touch->on = touch->was = touch->idle = PETSC_FALSE;
    touch->along = -1;
    touch->rest = touch->kept = touch->lambda = touch->gap = touch->approach = 0;
    touch->friction = (SbFrictionState){.slide = {-1, -1}};
    for (int k = 0; k < 3; k++) {
      touch->start[k] = touch->now[k] = u[3 * touch->node + k];
      touch->stretch[k] = 0;
    }
    number[i] = space->node_orig[touch->node];
    at[i] = i;
  }
  PetscCall(PetscSortIntWithArray(c->n, number, at));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *r = records + SB_CONTACT_STATE * i;
    PetscInt place;
    Touch *touch;

    PetscCall(PetscFindInt((PetscInt)r[0], c->n, number, &place));
    if (place < 0) continue; /* another rank's */
    touch = &c->touch[at[place]];
    touch->on = (PetscBool)(r[1] != 0);
    touch->was = (PetscBool)(r[2] != 0);
    touch->rest = r[3];
    touch->kept = r[4];
    touch->lambda = r[5];
    touch->value = r[6];
    touch->gap = r[7];
    PetscCall(PetscArraycpy(touch->n, r + 8, 3));
    PetscCall(PetscArraycpy(touch->surface, r + 11, 3));
    touch->friction.slid = touch->friction.slides = (PetscBool)(r[14] != 0);
    touch->friction.crowded = (PetscBool)(r[15] != 0);
    touch->friction.turning = r[16];
    PetscCall(PetscArraycpy(touch->friction.tangent[0], r + 17, 3));
    PetscCall(PetscArraycpy(touch->friction.stretch, r + 20, 3));
    rotate_stretch(&c->to, touch);
  }
  PetscCall(PetscFree2(number, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRename_Contact(SbEffect e, PetscInt nnode, const PetscInt from[], const PetscInt to[],
                                      PetscInt *n, PetscReal records[])
{
  PetscInt kept = 0;

  PetscFunctionBeginUser;
  (void)e;
  for (PetscInt i = 0; i < *n; i++) {
    PetscReal *r = records + SB_CONTACT_STATE * i;
    PetscInt place;

    PetscCall(PetscFindInt((PetscInt)r[0], nnode, from, &place));
    if (place < 0) continue;
    r[0] = (PetscReal)to[place];
    PetscCall(PetscArraymove(records + SB_CONTACT_STATE * kept, r, SB_CONTACT_STATE));
    kept++;
  }
  *n = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}
