/*
  nodes.c - nodes of the surface against a rigid obstacle, with Coulomb friction.

  A node at x has the gap g = signed distance from the obstacle in its current pose, and the normal
  n there. Nodes are those of the surface: vertices of P1, centroids of boundary faces of CR and DG
  (there g is the mean gap of the face), vertices and edges of P2. A uniform pressure acts on the
  edge nodes of P2 alone, as exact responses reproduce; springs have the areas of the four triangles
  over the six nodes of a facet.

  Responses `projected` and `multiplier` constrain active nodes exactly (response_exact.c),
  `penalty` and `augmented` have springs (response_springs.c). Here is what they share: the nodes,
  the start of a step, and the update of the active set after each solve, until it does not change.
  On which facet of an obstacle a node is constrained is in node_search.c.

  Friction (friction_nodes.c) is solved together with N. With it all responses use constraints:
  `projected` exact ones, with solves in their null space, `penalty` and `augmented` springs, linear
  while normals and the active set stay fixed, that is, in each solve. A sticking node stays where
  it was on the moving obstacle.

  Penetration at the start of a step is resolved gradually: its depth falls to 1/e in
  `separation_steps` steps. With springs that is the depth beyond their deflection. A static run
  resolves it in the first load step, by parts where that is cut.

  Nodes are tested at the ends of steps. One that passed through a thin obstacle in a step, or
  through one that jumped, is found afterwards, and a warning says so.

  Restitution: its law and energy are in restitution.c.
*/
#include "nodes.h"

#define STIFFEST 11. /* of the shear modulus: lambda + 2 mu at nu = 0.45 */
#define EARLY 1e-6   /* of the path of a rebounding node: near misses count as impacts */
#define LATE \
  1e-2 /* tolerance of friction after UPDATES solves of a step, with a warning; else it is halved */
#define UPDATES 30
#define WALK 100 /* most steps of a walk by the distance; it ends at a surface that it grazes */

static PetscErrorCode setup_nodes(SbEffect e, SbSpace space)
{
  Nodes *c = (Nodes *)e->data;
  PetscReal box[6] = {0};
  SbFacet *facet;
  PetscInt n, *slot;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerSetUp(e, space->comm, &c->contact.partner));
  PetscCheck(c->damping <= 0 || e->dynamic, space->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_damping %g s: a static run has no speed to damp; leave it out", e->name,
             (double)c->damping);
  c->contact.overlap.by_load = (PetscBool)!e->dynamic;
  PetscCall(SbEffectFacets(space, &e->on, &n, &facet));
  PetscCall(PetscMalloc1(6 * n, &c->node));
  PetscCall(PetscMalloc1(space->nnode, &slot));
  for (PetscInt i = 0; i < space->nnode; i++)
    slot[i] = -1;
  for (PetscInt i = 0; i < n; i++)
    PetscCheck(
      !SbSpaceCellElement(space, facet[i].cell)->rigid, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
      "effect %s: body '%s' is rigid, which has no nodes on its surface: take "
      "-effect_%s_response barrier, with -time euler_implicit, newmark, genalpha or static",
      e->name, space->mesh->body[space->mesh->cell_body[facet[i].cell]].name, e->name);

  /* nodes of the facets with their shares of area and stiffness; slot[]: their indices, -1: none
     yet */
  for (PetscInt i = 0; i < n; i++) {
    const SbFacet *f = &facet[i];
    const PetscInt *per = SbSpaceCellElement(space, f->cell)->nodes_per;
    const SbMaterial m = space->material[space->mesh->cell_material[f->cell]];
    PetscReal parts[2] = {1, 1}; /* of the area that a vertex has, and the middle of an edge */

    if (per[0])
      parts[0] = per[1] ? 12 : 3;
    if (per[1])
      parts[1] = 4;
    for (PetscInt a = 0; a < (per[1] ? SB_CELL_NODES : 4); a++) {
      const PetscInt node = SbSpaceCellNode(space, f->cell, a);
      const PetscReal share = f->area / parts[a >= 4];
      const int *edge = a < 4 ? NULL : SbTetEdge[a - 4];

      /* at the vertex behind the facet; the node of CR and DG with its number is on the facet */
      const PetscBool behind =
        (PetscBool)(edge ? edge[0] == f->face || edge[1] == f->face : a == f->face);
      ContactNode *touch;

      if (node >= space->nnode_owned || behind != (PetscBool)!per[0])
        continue;
      if (slot[node] < 0) {
        slot[node] = c->n++;
        c->node[slot[node]] =
          (ContactNode){.node = node, .cell = f->cell, .a = a, .facets = {.along = -1}};
      }
      touch = &c->node[slot[node]];
      touch->spring.k += c->stiffness *
                         PetscMin(SbMaterialWaveModulus(m), STIFFEST * SbMaterialShearModulus(m)) *
                         share / f->height;
      touch->spring.stiff = touch->spring.k;
    }
  }
  PetscCall(SbNodeFacetsCreate(c, space, n, facet));
  PetscCall(PetscFree(slot));
  PetscCall(PetscFree(facet));
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    for (int k = 0; k < 3; k++)
      box[k] = PetscMax(box[k], space->mesh->body[b].bbox[3 + k] - space->mesh->body[b].bbox[k]);
  c->size = PetscSqrtReal(SbDot3(box, box));
  if (c->held)
    PetscCall(SbSpaceCreateConstraints(space, (PetscBool)(c->contact.response == MULTIPLIER),
                                       (PetscBool)(c->contact.friction.mu > 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Time of impact of a node that was separated and penetrates now, in the motion without contact. */
static void find_impact(Nodes *c, const ContactNode *touch)
{
  const PetscReal small = NODE_TOLERANCE * c->size;

  if (!c->contact.base.ends_step || touch->was || touch->gap0 <= small || touch->gap >= -small)
    return;
  c->impact = PetscMin(c->impact, touch->gap0 / (touch->gap0 - touch->gap));
}

static PetscErrorCode time_of_impact_nodes(SbContact contact, PetscReal *part)
{
  Nodes *c = (Nodes *)contact;

  PetscFunctionBeginUser;
  *part = PetscMin(*part, c->impact);

  /* springs of new contacts have acted for a whole step */
  for (PetscInt i = 0; c->impact < 1 && i < c->n; i++)
    if (!c->node[i].was)
      c->node[i].lambda = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step from t to t + dt begins with u0: the obstacle's path, what is left of a penetration, and
   where each node would stick. */
static PetscErrorCode begin_step_nodes(SbContact contact, SbSpace space, PetscReal t, PetscReal dt,
                                       PetscReal speed, PetscReal u0[])
{
  Nodes *c = (Nodes *)contact;

  PetscFunctionBeginUser;
  (void)speed;
  PetscCall(SbPartnerBeginStep(t, dt, &c->contact.partner));
  c->contact.friction.updates = 0;
  c->first = PETSC_TRUE;
  c->contact.base.unsettled[0] = 0;
  c->impact = 1;
  SbOverlapBegin(&c->contact.overlap, t, dt);
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    PetscReal x0[3], X0[3], x1[3], n[3], gap0, depth;

    touch->toggles = touch->facets.flips = 0;
    touch->facets.valley = PETSC_FALSE;

    /* a cut attempt restarts with the initial active set; a failed one keeps the active set found
       so far */
    if (c->contact.base.ends_step || c->contact.bounce.e > 0)
      touch->on = touch->was;
    touch->spring.idle = (PetscBool)(c->contact.base.ends_step && !touch->was && !exact(c));
    touch->approach = 0;
    place(space, touch->node, u0, x0);
    SbPoseInvert(&c->contact.partner.pose[0], x0, touch->from);
    gap0 = SbNodeGap(c, &c->contact.partner.pose[0], x0, n);
    if (c->contact.base.ends_step)
      touch->gap0 = gap0;

    /* with springs penetration includes their deflection; projected nodes are where they were
       constrained */
    depth = touch->was && !exact(c) ? -touch->kept : -gap0;
    touch->rest = depth > NODE_TOLERANCE * c->size ? -c->contact.overlap.left * depth : 0;

    /* the damper of a step of implicit Euler is a stiffer spring and a constant force: k damping (g
       - g0) / dt, g0 < 0 the gap at its start */
    touch->spring.stiff = touch->spring.k;
    if (c->damping > 0 && dt > 0) {
      touch->spring.stiff += touch->spring.k * c->damping / dt;
      touch->spring.before = touch->spring.k * c->damping / dt * PetscMin(0, gap0 - touch->rest);
    }
    if (c->contact.friction.mu <= 0)
      continue;

    /* its initial position moved with the obstacle: it sticks there, also if contact begins in this
       step */
    SbPoseInvert(&c->contact.partner.pose[0], x0, X0);
    SbPoseApply(&c->contact.partner.pose[1], X0, x1);
    for (int k = 0; k < 3; k++) {
      touch->friction.start[k] = x1[k] - space->node_x[3 * touch->node + k];
      touch->friction.stretch[k] =
        SbDot3(c->contact.partner.pose[1].R + 3 * k, touch->friction.kept);
    }
    SbFrictionBegin(&touch->friction, touch->on);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a node would reach the obstacle in this step at its speed of approach. */
static PetscBool comes(const Nodes *c, const ContactNode *touch)
{
  return (PetscBool)(touch->approach > 0 &&
                     c->contact.bounce.dt * touch->approach * (1 + EARLY) >= touch->gap0);
}

/* Restitution: speeds of approach of nodes that were separated. */
static PetscErrorCode find_impacts_nodes(SbContact contact, SbSpace space, PetscReal dt,
                                         const PetscReal u0[], const PetscReal v0[])
{
  Nodes *c = (Nodes *)contact;
  PetscReal least = PETSC_INFINITY;
  PetscInt which = 0;

  PetscFunctionBeginUser;
  c->contact.bounce.left = 1;
  c->contact.bounce.dt = dt;
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    PetscReal x0[3], X0[3], x1[3], n[3];
    PetscReal v = 0;

    if (touch->was || touch->rest < 0)
      continue;
    place(space, touch->node, u0, x0);
    touch->gap0 = PetscMax(0, SbNodeGap(c, &c->contact.partner.pose[0], x0, n));
    SbPoseInvert(&c->contact.partner.pose[0], x0, X0);
    SbPoseApply(&c->contact.partner.pose[1], X0, x1);
    for (int k = 0; k < 3; k++)
      v -= n[k] * (v0[3 * touch->node + k] - (x1[k] - x0[k]) / dt);
    touch->approach = PetscMax(0, v);
    if (comes(c, touch)) {
      const PetscInt body = space->node_body[touch->node];
      const PetscReal crossings = SbRestitutionCrossings(space, body, dt);

      which = crossings < least ? body : which;
      least = PetscMin(least, crossings);
    }
  }
  PetscCall(SbRestitutionWarnSoft(contact->effect, &c->contact.bounce, space, dt, least, which));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The active set at the predicted displacement u. */
static PetscErrorCode start_nodes(SbContact contact, SbSpace space, const PetscReal u[])
{
  Nodes *c = (Nodes *)contact;
  const PetscReal touching = contact->effect->dynamic ? 0. : NODE_TOLERANCE * c->size;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    PetscReal x[3];

    place(space, touch->node, u, x);
    touch->gap = SbNodeSearch(c, space, x, touch);
    find_impact(c, touch);
    for (int k = 0; k < 3; k++)
      touch->friction.now[k] = u[3 * touch->node + k];

    /* constraints: nodes that penetrate, or would at their speed of approach, in static runs also
       those that touch, as nothing else may hold the body; springs: those that push, or touch */
    if (exact(c)) {
      if (touch->gap < touching || comes(c, touch))
        SbNodeEnter(c, touch);
    } else if (c->held) {
      if (spring(touch, touch->gap) > 0 || (touch->gap < touching && !touch->spring.idle))
        SbNodeEnter(c, touch);
      else
        touch->on = PETSC_FALSE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constraints of active nodes: normal, or tangential (across). */
static PetscErrorCode constrain_nodes(SbContact contact, SbSpace space, PetscBool across)
{
  Nodes *c = (Nodes *)contact;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    SbConstraint row = {.node = touch->node, .value = touch->facets.plane.value};

    if (across) {
      if (touch->facets.along >= 0 && c->contact.friction.mu > 0)
        PetscCall(SbFrictionConstrain(c, space, touch));
      continue;
    }
    touch->facets.along = touch->facets.other_along = touch->friction.slide[0] =
      touch->friction.slide[1] = -1;
    if (!touch->on)
      continue;
    for (int k = 0; k < 3; k++)
      row.n[k] = row.push[k] = touch->facets.plane.n[k];
    if (c->contact.friction.mu > 0)
      SbFrictionDirection(c, touch, row.push);
    if (!exact(c)) {
      row.spring = PETSC_TRUE;
      row.stiffness = touch->spring.stiff;
      row.constant = touch->lambda + touch->spring.before;
    }
    PetscCall(SbSpaceAddConstraint(space, &row, &touch->facets.along));
    if (!touch->facets.valley)
      continue;
    for (int k = 0; k < 3; k++)
      row.n[k] = row.push[k] = touch->facets.other.n[k];
    row.value = touch->facets.other.value;
    PetscCall(SbSpaceAddConstraint(space, &row, &touch->facets.other_along));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Notes a node, if it is worse. */
static void note(SbSpace space, const ContactNode *touch, const PetscReal u[], PetscReal by,
                 NodePlace *worst)
{
  PetscReal x[3];

  if ((double)by <= worst->by)
    return;
  place(space, touch->node, u, x);
  *worst = (NodePlace){.by = (double)by,
                       .x = {(double)x[0], (double)x[1], (double)x[2]},
                       .body = space->node_body[touch->node]};
}

static PetscErrorCode update_nodes(SbContact contact, SbSpace space, const PetscReal u[],
                                   PetscBool *changed)
{
  Nodes *c = (Nodes *)contact;
  PetscReal largest = 0;
  PetscReal worst = 0;
  PetscBool mine = PETSC_FALSE;
  PetscBool wait;

  PetscFunctionBeginUser;

  /* gap and multiplier of every node; the largest multiplier of all ranks */
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    const PetscReal pushed =
      touch->facets.along < 0 ? 0 : SbSpaceGetConstraint(space, touch->facets.along)->force;
    PetscReal x[3], wrong[3];

    for (int k = 0; k < 3; k++) {
      touch->friction.now[k] = u[3 * touch->node + k];
      wrong[k] = pushed * touch->facets.plane.n[k];
    }
    if (touch->facets.along >= 0 && c->contact.friction.mu > 0)
      SbFrictionRead(c, space, touch, pushed);
    if (exact(c))
      touch->lambda = touch->on ? pushed : 0;
    if (touch->facets.valley)
      touch->facets.other_lambda =
        touch->facets.other_along < 0
          ? 0
          : SbSpaceGetConstraint(space, touch->facets.other_along)->force;
    place(space, touch->node, u, x);
    touch->gap = SbNodeSearch(c, space, x, touch);
    largest = PetscMax(largest, contact_force(c, touch));
    if (!exact(c) && c->held) {
      const PetscReal force = touch->on && touch->toggles >= NODE_TOGGLES ? pull(touch, touch->gap)
                                                                          : contact_force(c, touch);

      for (int k = 0; k < 3; k++)
        wrong[k] -= force * touch->facets.plane.n[k];
      touch->spring.wrong = PetscSqrtReal(SbDot3(wrong, wrong));
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPI_MAX, space->comm));
  c->wrong.by = c->pulled.by = 0.;
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    PetscReal error;

    /* after the first solve of a step: times of impact; from now on all springs act */
    if (c->first && c->contact.base.ends_step) {
      if (!touch->on || !exact(c))
        find_impact(c, touch);
      if (touch->spring.idle && touch->gap < 0)
        mine = PETSC_TRUE;
      touch->spring.idle = PETSC_FALSE;
    }
    if (exact(c) && touch->facets.along >= 0 && touch->toggles >= NODE_TOGGLES &&
        touch->lambda < -NODE_PULLED * largest)
      note(space, touch, u, -touch->lambda / largest, &c->pulled);
    if (!(exact(c) ? SbNodeUpdate_Exact(c, largest, touch)
                   : SbNodeUpdate_Springs(c, largest, touch))) {
      mine = PETSC_TRUE;
      note(space, touch, u, 1., &c->wrong);
    }

    /* stick and slip */
    if (c->contact.friction.mu <= 0 || !touch->on || touch->facets.along < 0)
      continue;
    error = SbFrictionUpdate(c, touch, contact_force(c, touch));
    if (largest > 0.)
      note(space, touch, u, PetscMin(1., error / (c->contact.friction.mu * largest)), &c->wrong);
    worst = PetscMax(worst, error); /* a macro: its arguments are evaluated twice */
  }
  c->first = PETSC_FALSE;
  if (c->contact.friction.mu > 0) {
    c->contact.friction.updates++;
    c->contact.friction.error = largest > 0 ? worst / (c->contact.friction.mu * largest) : 0;
    if (c->contact.friction.error > (c->contact.friction.updates > UPDATES ? LATE : NODE_SETTLED))
      mine = PETSC_TRUE;
  }

  /* release springs in tension once all else has converged, a few times */
  wait = mine;
  if (c->held && !exact(c))
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &wait, 1, SB_MPI_BOOL, MPI_LOR, space->comm));
  for (PetscInt i = 0; c->held && !exact(c) && !wait && i < c->n; i++) {
    ContactNode *touch = &c->node[i];

    if (!touch->on || touch->toggles >= 2 * NODE_TOGGLES ||
        pull(touch, touch->gap) >= -NODE_PULLING * largest)
      continue;
    touch->on = PETSC_FALSE;
    mine = PETSC_TRUE;
  }
  if (mine)
    *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a node that is at `to` in the obstacle's rest frame passed through it in the step: it is
   outside at both ends, on different sides, and a walk by the distance on the line between them
   meets the surface. */
static PetscBool passed_through(const Nodes *c, const ContactNode *touch, const PetscReal to[3])
{
  const SbObstacle obstacle = c->contact.partner.obstacle;
  const PetscReal small = NODE_TOLERANCE * c->size;
  const PetscReal way = PetscSqrtReal(SbDistance2(touch->from, to));
  PetscReal n[2][3], x[3];
  PetscReal gap = SbObstacleDistance(obstacle, touch->from, n[0]);
  PetscReal along = 0.;

  if (gap <= small || way <= gap || SbObstacleDistance(obstacle, to, n[1]) <= small ||
      SbDot3(n[0], n[1]) >= 0.)
    return PETSC_FALSE;
  for (int k = 0; k < WALK && gap > small; k++) {
    along += gap;
    if (along >= way)
      return PETSC_FALSE;
    for (int i = 0; i < 3; i++)
      x[i] = touch->from[i] + along / way * (to[i] - touch->from[i]);
    gap = SbObstacleDistance(obstacle, x, n[1]);
  }
  return (PetscBool)(gap <= small);
}

/* The first warning of nodes that passed through the obstacle in the step that ended at t. */
static PetscErrorCode warn_of_passing(Nodes *c, SbSpace space, PetscReal t, const SbPose *pose,
                                      const PetscReal u[])
{
  struct {
    int has, rank;
  } first = {0, space->rank};
  PetscReal at[3] = {0.};

  PetscFunctionBeginUser;
  if (c->passed || c->contact.partner.obstacle->shape == PLANE ||
      c->contact.partner.obstacle->shape == BOWL)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < c->n && !first.has; i++) {
    PetscReal X[3];

    place(space, c->node[i].node, u, at);
    SbPoseInvert(pose, at, X);
    first.has = passed_through(c, &c->node[i], X);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_2INT, MPI_MAXLOC, space->comm));
  if (!first.has)
    PetscFunctionReturn(PETSC_SUCCESS);
  c->passed = PETSC_TRUE;
  PetscCallMPI(MPI_Bcast(at, 3, MPIU_REAL, first.rank, space->comm));
  PetscCall(SbWarning(space->comm,
                      "effect %s: in the step to t = %g s a node passed through the obstacle, to "
                      "(%g, %g, %g) m, as nodes are tested at the ends of steps only; said once: "
                      "-effect_%s_response barrier, or shorter steps, keep it out",
                      c->contact.base.effect->name, (double)t, (double)at[0], (double)at[1],
                      (double)at[2], c->contact.base.effect->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The worst place of all ranks. Collective. */
static PetscErrorCode find_worst(SbSpace space, NodePlace *place)
{
  struct {
    double by;
    int rank;
  } most = {place->by, space->rank};

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE_INT, MPI_MAXLOC, space->comm));
  PetscCallMPI(MPI_Bcast(place, (PetscMPIInt)sizeof(*place), MPI_BYTE, most.rank, space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Which node changes still. */
static PetscErrorCode explain_nodes(SbContact contact, SbSpace space, PetscInt rounds)
{
  Nodes *c = (Nodes *)contact;
  const char *name = contact->effect->name;

  PetscFunctionBeginUser;
  PetscCall(find_worst(space, &c->wrong));
  if (c->wrong.by > 0.)
    SbFormat(sizeof(contact->unsettled), contact->unsettled,
             "effect %s: after %" PetscInt_FMT
             " solves its active set has not settled: a node of %s at (%g, %g, %g) m touches the "
             "obstacle and leaves it in turn, or its friction changes; -effect_%s_response barrier "
             "has no active set",
             name, rounds, space->mesh->body[c->wrong.body].name, c->wrong.x[0], c->wrong.x[1],
             c->wrong.x[2], name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first warning of a node that ended the step that ended at t on the obstacle though it
   pulls. */
static PetscErrorCode warn_of_pull(Nodes *c, SbSpace space, PetscReal t)
{
  const char *name = c->contact.base.effect->name;

  PetscFunctionBeginUser;
  if (c->said || !exact(c))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_worst(space, &c->pulled));
  if (c->pulled.by <= 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  c->said = PETSC_TRUE;
  PetscCall(SbWarning(space->comm,
                      "effect %s: in the step to %g a node of %s at (%g, %g, %g) m came to the "
                      "obstacle %d times, and stays there though it pulls by %.2g of the largest "
                      "contact force; said once: shorter steps, or -effect_%s_response barrier, "
                      "which has no active set",
                      name, (double)t, space->mesh->body[c->pulled.body].name, c->pulled.x[0],
                      c->pulled.x[1], c->pulled.x[2], NODE_TOGGLES, c->pulled.by, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode accept_nodes(SbEffect e, SbSpace space, const SbStage *stage)
{
  Nodes *c = (Nodes *)e->data;
  PetscReal most = c->contact.friction.error;
  SbPose pose;

  PetscFunctionBeginUser;
  c->contact.base.work = 0.; /* that of the start is counted */
  PetscCall(SbPartnerPose(&c->contact.partner, stage->t, &pose));
  PetscCall(warn_of_passing(c, space, stage->t, &pose, stage->u));
  PetscCall(warn_of_pull(c, space, stage->t));
  PetscCall(SbNodeFacetsCheck(c, space, stage->t, &pose, stage->u));
  if (c->contact.friction.updates > UPDATES && !c->contact.friction.said) { /* alike on all ranks */
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, space->comm));
    c->contact.friction.said = (PetscBool)(most > NODE_SETTLED);
    if (c->contact.friction.said)
      PetscCall(SbWarning(
        space->comm,
        "at t = %g s the friction of the effect %s settled to %.1g of the largest only, not to "
        "%g; said once: smaller steps make it more exact",
        (double)stage->t, e->name, (double)most, NODE_SETTLED));
  }
  for (PetscInt i = 0; i < c->n; i++) {
    ContactNode *touch = &c->node[i];
    PetscReal x[3], n[3];

    place(space, touch->node, stage->u, x);
    if (!exact(c))
      touch->on = (PetscBool)(SbNodeNormalForce(c, &pose, touch, x, n) > 0);
    if (c->contact.friction.mu > 0) { /* history variables */
      SbFrictionAccept(
        c, touch,
        (PetscBool)(touch->on && touch->facets.along >= 0 && contact_force(c, touch) > 0));
      SbFrictionRotate(&pose, &touch->friction);
    }
    touch->was = (PetscBool)(touch->on && touch->rest <= 0);
    touch->kept = PetscMin(0, touch->rest);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_nodes(SbEffect e)
{
  Nodes *c = (Nodes *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbPartnerDestroy(&c->contact.partner));
  PetscCall(SbNodeFacetsDestroy(c));
  PetscCall(PetscFree(c->node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Constraints: exact ones, or springs that act along with friction. */
static const SbContactOps constraint_ops = {
  .begin_step = begin_step_nodes,
  .find_impacts = find_impacts_nodes,
  .start_active_set = start_nodes,
  .assemble_constraints = constrain_nodes,
  .update_active_set = update_nodes,
  .explain = explain_nodes,
  .time_of_impact = time_of_impact_nodes,
  .impact_work = SbContactImpactWork_Exact,
  .scale_restitution = SbContactScaleRestitution_Exact,
  .target_velocity = SbContactTargetVelocity_Exact,
  .gap = SbContactGap_Nodes,
  .points = SbContactPoints_Nodes,
};

/* Forces of springs on the nodes, with multipliers or impacts that an update changes, or
   without. */
static const SbContactOps spring_ops = {
  .begin_step = begin_step_nodes,
  .start_active_set = start_nodes,
  .update_active_set = update_nodes,
  .explain = explain_nodes,
  .time_of_impact = time_of_impact_nodes,
  .gap = SbContactGap_Nodes,
  .points = SbContactPoints_Nodes,
};
static const SbContactOps penalty_ops = {
  .begin_step = begin_step_nodes,
  .start_active_set = start_nodes,
  .gap = SbContactGap_Nodes,
  .points = SbContactPoints_Nodes,
};

static const SbEffectOps constraint_effect = {
  .setup = setup_nodes,
  .accept = accept_nodes,
  .history = SbEffectHistory_Nodes,
  .save = SbEffectSave_Nodes,
  .load = SbEffectLoad_Nodes,
  .destroy = destroy_nodes,
};
static const SbEffectOps spring_effect = {
  .setup = setup_nodes,
  .force = SbEffectForce_Springs,
  .tangent = SbEffectTangent_Springs,
  .accept = accept_nodes,
  .history = SbEffectHistory_Nodes,
  .save = SbEffectSave_Nodes,
  .load = SbEffectLoad_Nodes,
  .destroy = destroy_nodes,
};

PetscErrorCode SbContactNodesCreate(SbEffect e, const SbScope *scope)
{
  static const char *const columns[] = {"force_x",  "force_y",  "force_z",  "torque_x",
                                        "torque_y", "torque_z", "contacts", "penetration"};
  Nodes *c = (Nodes *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "friction_kinetic", &c->contact.friction.mu_kinetic));
  if (c->contact.friction.mu_kinetic < 0)
    c->contact.friction.mu_kinetic = c->contact.friction.mu;
  PetscCheck(c->contact.friction.mu_kinetic <= c->contact.friction.mu, PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT,
             "-effect_%s_friction_kinetic %g is above -effect_%s_friction %g: sliding would "
             "start and stop in turn",
             e->name, (double)c->contact.friction.mu_kinetic, e->name,
             (double)c->contact.friction.mu);
  PetscCall(SbOptionSecond(scope, "time_of_impact", &c->contact.base.ends_step));
  PetscCall(SbOptionReal(scope, "stiffness", &c->stiffness));
  PetscCall(SbOptionReal(scope, "damping", &c->damping));
  PetscCheck(
    c->damping <= 0 || c->contact.response == PENALTY, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_damping %g s is for springs that give: it needs -effect_%s_response penalty",
    e->name, (double)c->damping, e->name);
  PetscCheck(c->contact.bounce.e <= 0 || exact(c), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_restitution %g needs -effect_%s_response projected, multiplier or barrier",
             e->name, (double)c->contact.bounce.e, e->name);
  PetscCheck(
    c->contact.bounce.e <= 0 || !c->contact.base.ends_step, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_restitution %g and -effect_%s_time_of_impact yes do not go together: a step "
    "that ends at the impact has no rebound; leave one of them out",
    e->name, (double)c->contact.bounce.e, e->name);

  /* loads and history of the effect; exact constraints and friction give forces by constraints,
     else force() acts */
  c->mesh = (PetscBool)(c->contact.partner.obstacle->shape == MESH);
  c->held = (PetscBool)(exact(c) || c->contact.friction.mu > 0);
  e->ops = c->held ? constraint_effect : spring_effect;
  e->nstate = SB_CONTACT_STATE;
  e->by_node = PETSC_TRUE;
  e->column = columns;
  e->ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns);
  e->linear = c->held;

  /* the response */
  c->contact.base.saddle = (PetscBool)(c->contact.response == MULTIPLIER);
  c->contact.base.springs = (PetscBool)(!exact(c) || c->contact.friction.mu > 0);
  if (c->held)
    c->contact.base.ops = &constraint_ops;
  else
    c->contact.base.ops =
      c->contact.response == AUGMENTED || c->contact.base.ends_step ? &spring_ops : &penalty_ops;
  PetscFunctionReturn(PETSC_SUCCESS);
}
