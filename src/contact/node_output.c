/*
  node_output.c - output and checkpoints of nodes against an obstacle.
*/
#include "nodes.h"

/* Force of the obstacle on a node at x, N; false: there is none. */
static PetscBool force_on(const Nodes *c, const SbPose *pose, SbSpace space,
                          const ContactNode *touch, const PetscReal x[3], PetscReal f[3])
{
  PetscReal n[3];
  PetscReal normal = SbNodeNormalForce(c, pose, touch, x, n);

  if (normal <= 0)
    return PETSC_FALSE;
  if (c->held)
    normal = SbSpaceGetConstraint(space, touch->facets.along)->force;
  for (int k = 0; k < 3; k++)
    f[k] = normal * n[k] + (c->contact.friction.mu > 0 ? touch->friction.force[k] : 0);
  return PETSC_TRUE;
}

PetscErrorCode SbContactGap_Nodes(SbContact contact, SbSpace space, const SbStage *stage,
                                  PetscReal gap[], PetscReal normal[])
{
  const Nodes *c = (const Nodes *)contact;
  SbPose pose;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &pose));
  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->node[i].node;
    PetscReal x[3], n[3], g;

    place(space, node, stage->u, x);
    g = SbNodeGap(c, &pose, x, n);
    if (g >= gap[node])
      continue;
    gap[node] = g;
    for (int k = 0; k < 3; k++)
      normal[3 * node + k] = n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactPoints_Nodes(SbContact contact, SbSpace space, const SbStage *stage,
                                     SbContactPoints *list)
{
  const Nodes *c = (const Nodes *)contact;
  SbPose pose;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &pose));
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];
    SbContactPoint p = {.body = {space->node_body[touch->node], -1},
                        .id = {0, space->node_orig[touch->node], 0}};

    place(space, touch->node, stage->u, p.x);
    if (!force_on(c, &pose, space, touch, p.x, p.force))
      continue;
    p.gap = SbNodeGap(c, &pose, p.x, p.normal);
    if (exact(c))
      PetscCall(
        PetscArraycpy(p.normal, touch->facets.plane.n, 3)); /* the normal of the constraint */
    PetscCall(SbReserve(list->n + 1, sizeof(p), &list->size, &list->point));
    list->point[list->n++] = p;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force and torque of the obstacle on the bodies, number of active nodes, deepest penetration. */
PetscErrorCode SbEffectHistory_Nodes(SbEffect e, SbSpace space, const SbStage *stage,
                                     const PetscReal residual[], PetscReal values[])
{
  Nodes *c = (Nodes *)e->data;
  PetscReal deepest = 0;
  SbPose pose;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &pose));
  (void)residual;
  for (int k = 0; k < 8; k++)
    values[k] = 0;
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];
    PetscReal x[3], n[3], f[3];

    place(space, touch->node, stage->u, x);
    deepest = PetscMax(deepest, -SbNodeGap(c, &pose, x, n));
    if (!force_on(c, &pose, space, touch, x, f))
      continue;
    SbPartnerAddForce(&c->contact.partner, &pose, x, f, values);
    values[6]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &deepest, 1, MPIU_REAL, MPI_MAX, space->comm));

  /* smaller values are within the tolerance */
  if (!space->rank && deepest > NODE_TOLERANCE * c->size)
    values[7] = deepest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A record has the node's original number, whether it is and was active, right-hand side and normal
   of its constraint, multiplier, gap, and friction state: enough to rebuild the constraints of the
   last solve, and to continue as the uninterrupted run. */
PetscErrorCode SbEffectSave_Nodes(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Nodes *c = (const Nodes *)e->data;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscMalloc1(SB_CONTACT_STATE * c->n, records));
  for (PetscInt i = 0; i < c->n; i++) {
    const ContactNode *touch = &c->node[i];
    PetscReal *r = *records + SB_CONTACT_STATE * *n;

    if (!touch->on && !touch->was && touch->lambda == 0)
      continue;
    r[0] = (PetscReal)space->node_orig[touch->node];
    r[1] = touch->on;
    r[2] = touch->was;
    r[3] = touch->rest;
    r[4] = touch->kept;
    r[5] = touch->lambda;
    r[6] = touch->facets.plane.value;
    r[7] = touch->gap;
    PetscCall(PetscArraycpy(r + 8, touch->facets.plane.n, 3));
    PetscCall(PetscArraycpy(r + 11, touch->facets.surface.n, 3));
    r[14] = touch->friction.slid;
    r[15] = touch->friction.crowded;
    r[16] = touch->friction.turning;
    PetscCall(PetscArraycpy(r + 17, touch->friction.tangent[0], 3));
    PetscCall(PetscArraycpy(r + 20, touch->friction.stretch, 3));
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectLoad_Nodes(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                  PetscInt n, const PetscReal records[])
{
  Nodes *c = (Nodes *)e->data;
  PetscInt *number, *at;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerPose(&c->contact.partner, t, &c->contact.partner.pose[1]));
  PetscCall(PetscMalloc2(c->n, &number, c->n, &at));
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];

    /* nodes without a record are inactive */
    *touch = (ContactNode){.node = touch->node,
                           .cell = touch->cell,
                           .a = touch->a,
                           .facets = {.along = -1},
                           .spring = {.k = touch->spring.k, .stiff = touch->spring.k},
                           .friction = {.slide = {-1, -1}}};
    for (int k = 0; k < 3; k++)
      touch->friction.start[k] = touch->friction.now[k] = u[3 * touch->node + k];
    number[i] = space->node_orig[touch->node];
    at[i] = i;
  }
  PetscCall(PetscSortIntWithArray(c->n, number, at));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *r = records + SB_CONTACT_STATE * i;
    PetscInt place;
    ContactNode *touch;

    PetscCall(PetscFindInt((PetscInt)r[0], c->n, number, &place));
    if (place < 0)
      continue; /* another rank's */
    touch = &c->node[at[place]];
    touch->on = (PetscBool)(r[1] != 0);
    touch->was = (PetscBool)(r[2] != 0);
    touch->rest = r[3];
    touch->kept = r[4];
    touch->lambda = r[5];
    touch->facets.plane.value = r[6];
    touch->gap = r[7];
    PetscCall(PetscArraycpy(touch->facets.plane.n, r + 8, 3));
    PetscCall(PetscArraycpy(touch->facets.surface.n, r + 11, 3));
    touch->friction.slid = touch->friction.slides = (PetscBool)(r[14] != 0);
    touch->friction.crowded = (PetscBool)(r[15] != 0);
    touch->friction.turning = r[16];
    PetscCall(PetscArraycpy(touch->friction.tangent[0], r + 17, 3));
    PetscCall(PetscArraycpy(touch->friction.stretch, r + 20, 3));
    SbFrictionRotate(&c->contact.partner.pose[1], &touch->friction);
  }
  PetscCall(PetscFree2(number, at));
  PetscFunctionReturn(PETSC_SUCCESS);
}
