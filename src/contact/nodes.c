/*
  nodes.c - nodes of the surface against a rigid obstacle, with Coulomb friction.

  A node at x has the gap g = signed distance from the obstacle in its current pose, and the normal
  n there. Nodes are those of the surface: vertices of P1, centroids of boundary faces of CR and DG
  (there g is the mean gap of the face), vertices and edges of P2. A uniform pressure acts on the
  edge nodes of P2 alone, as exact responses reproduce; springs have the areas of the four triangles
  over the six nodes of a facet.

  Response `projected`: active nodes are constrained to the obstacle (src/fem/constraint.c): n . u
  is prescribed, and the constraint force is the multiplier lambda. Primal-dual active set: after
  each solve nodes in tension are released, penetrating nodes are added, the normal is updated on a
  curved obstacle, and the solve is repeated until the set does not change (Kikuchi and Oden 1988;
  Hueeber and Wohlmuth 2005). A node that has been released and added several times within a step
  stays active, so that the loop ends. `multiplier`: the same with the forces as unknowns of the
  solves.

  Response `penalty`: springs, N = k <-g>, <x> = max(x, 0), with k from the stiffness of the cell
  behind, near incompressibility that of nu = 0.45: a surface deforms by shear, and springs stiffer
  by orders make E so ill-conditioned that the line search takes tiny steps. `augmented`: the
  penalty with a multiplier, N = <lambda - k g>, updated after each solve until penetration is
  within the tolerance (Simo and Laursen 1992).

  Friction (friction_nodes.c) is solved together with N. With it all responses use constraints:
  `projected` exact ones, with solves in their null space, `penalty` and `augmented` springs, linear
  while normals and the active set stay fixed, that is, in each solve. A sticking node stays where
  it was on the moving obstacle.

  Penetration at the start of a step is resolved gradually: its depth falls to 1/e in
  `separation_steps` steps. With springs that is the depth beyond their deflection. A static run
  resolves it at once.

  Restitution: its law and energy are in src/model/restitution.c.

  Where facets of an obstacle's mesh meet a node may alternate between them with every update of the
  active set. At a concave edge ("valley") both act: constrained on one of them it penetrates the
  other one. So it is constrained on both for a solve, which gives both forces. If neither is
  tensile, their resultant is the normal in equilibrium, and the node is constrained along it until
  the end of the step; else the tensile one is released. On two facets it slides along the edge,
  possibly behind a third one, which then replaces the one with the smaller force. Elsewhere (convex
  edges, and with friction) normals are averaged over searches, after many kept.
*/
#include "contact_impl.h"

#define STIFFEST 11. /* of the shear modulus: lambda + 2 mu at nu = 0.45 */
#define TOGGLES 3    /* activations of a node within a step after which it stays active */
#define PULLING 1e-6 /* tension at which a node is released, over the largest contact force */
#define EARLY 1e-6   /* of the path of a rebounding node: near misses count as impacts */
#define INSTANT 1e-3 /* fraction of a step for the difference quotient of the obstacle's velocity */
#define SETTLED 1e-4 /* tolerance of spring forces and of friction, over the largest of them */
#define LATE \
  1e-2 /* that of friction after UPDATES solves of a step, with a warning; else it is halved */
#define UPDATES 30
#define TOLERANCE 1e-7 /* tolerance of penetration, over the size of the bodies */
#define VALLEY 2   /* flips of an active node between facets in a step that allow two constraints */
#define AVERAGED 4 /* flips after which normals are averaged */
#define GIVEN_UP 16 /* flips after which it is not constrained on two any more */
#define JUMP 1e-6   /* 1 - cosine: a flip */
#define KEPT 24     /* flips after which a node keeps its plane until the end of the step */

PetscErrorCode SbContactDestroy(SbEffect e)
{
  Contact *c = (Contact *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbObstacleDestroy(&c->obstacle));
  PetscCall(PetscFree(c->touch));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbContactPose(const Contact *c, PetscReal t, SbPose *pose)
{
  PetscReal d[3];

  for (int i = 0; i < 3; i++)
    d[i] = SbFormulaEval(c->path.displacement[i], t, NULL);
  SbPoseSet(c->path.axis, SbFormulaEval(c->path.angle, t, NULL) * PETSC_PI / 180, c->path.point, d,
            pose);
}

/* Gap of a point, m, and the normal there. */
static PetscReal gap_at(const Contact *c, const SbPose *pose, const PetscReal x[3], PetscReal n[3])
{
  PetscReal X[3], N[3], gap;

  SbPoseInvert(pose, x, X);
  gap = SbObstacleDistance(c->obstacle, X, N);
  for (int i = 0; i < 3; i++)
    n[i] = SbDot3(pose->R + 3 * i, N);
  return gap;
}

static PetscErrorCode setup_nodes(SbEffect e, SbSpace space)
{
  Contact *c = (Contact *)e->data;
  PetscReal box[6] = {0};
  SbFacet *facet;
  PetscInt n, *slot;

  PetscFunctionBeginUser;
  PetscCall(SbObstacleSetUp(c->obstacle, space->comm, c->scale, c->at, sizeof(e->note), e->note));
  PetscCheck(c->damping <= 0 || e->dynamic, space->comm, PETSC_ERR_USER_INPUT,
             "-effect_%s_damping %g s: a static run has no speed to damp; leave it out", e->name,
             (double)c->damping);
  if (!e->dynamic)
    c->overlap.recovery = 0;
  PetscCall(SbEffectFacets(space, &e->on, &n, &facet));
  PetscCall(PetscMalloc1(6 * n, &c->touch));
  PetscCall(PetscMalloc1(space->nnode, &slot));
  for (PetscInt i = 0; i < space->nnode; i++)
    slot[i] = -1;

  /* nodes of the facets with their shares of area and stiffness; slot[]: their indices, -1: none
     yet */
  for (PetscInt i = 0; i < n; i++) {
    const SbFacet *f = &facet[i];
    const PetscInt *per = SbSpaceCellElement(space, f->cell)->nodes_per;
    const SbMaterial m = space->material[space->mesh->cell_material[f->cell]];

    for (PetscInt a = 0; a < (per[1] ? SB_CELL_NODES : 4); a++) {
      const PetscInt node = SbSpaceCellNode(space, f->cell, a);
      const PetscReal share = f->area / (!per[0] ? 1 : a >= 4 ? 4 : per[1] ? 12 : 3);
      const int *edge = a < 4 ? NULL : SbTetEdge[a - 4];

      /* at the vertex behind the facet; the node of CR and DG with its number is on the facet */
      const PetscBool behind =
        (PetscBool)(edge ? edge[0] == f->face || edge[1] == f->face : a == f->face);
      Touch *touch;

      if (node >= space->nnode_owned || behind != (PetscBool)!per[0])
        continue;
      if (slot[node] < 0) {
        slot[node] = c->n++;
        c->touch[slot[node]] = (Touch){.node = node, .cell = f->cell, .a = a, .along = -1};
      }
      touch = &c->touch[slot[node]];
      touch->k +=
        c->stiffness * PetscMin(SbMaterialWaveModulus(m), STIFFEST * m->mu) * share / f->height;
      touch->stiff = touch->k;
    }
  }
  PetscCall(PetscFree(slot));
  PetscCall(PetscFree(facet));
  for (PetscInt b = 0; b < space->mesh->nbody; b++)
    for (int k = 0; k < 3; k++)
      box[k] = PetscMax(box[k], space->mesh->body[b].bbox[3 + k] - space->mesh->body[b].bbox[k]);
  c->size = PetscSqrtReal(SbDot3(box, box));
  if (c->held)
    PetscCall(SbSpaceCreateConstraints(space, (PetscBool)(c->response == MULTIPLIER),
                                       (PetscBool)(c->friction.mu > 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position of a node. */
static void place(SbSpace space, PetscInt node, const PetscReal u[], PetscReal x[3])
{
  for (int i = 0; i < 3; i++)
    x[i] = space->node_x[3 * node + i] + u[3 * node + i];
}

/* Force of spring and damper, N, also in tension. */
static PetscReal pull(const Touch *touch, PetscReal gap)
{
  return touch->lambda + touch->before - touch->stiff * gap;
}

/* Normal force of the springs, N; gap: relative to `rest`. */
static PetscReal spring(const Touch *touch, PetscReal gap)
{
  return touch->idle ? 0 : PetscMax(0, pull(touch, gap));
}

/* The same of any response after a solve, N. */
static PetscReal contact_force(const Contact *c, const Touch *touch)
{
  return exact(c) ? touch->lambda : spring(touch, touch->gap);
}

/* Updates the planes of an active node after a solve, which constrained it to one facet; it is at
   the distance `gap` (m) from the plane of `facet`, whose normal may be averaged with earlier ones.
   Returns whether the node is on another facet now, too. */
static PetscBool flip(const Contact *c, PetscReal gap, Plane *facet, Touch *touch)
{
  const PetscBool flips = (PetscBool)(SbDot3(facet->n, touch->surface.n) < 1 - JUMP);
  const Plane last = touch->surface;
  PetscReal *n = facet->n;

  touch->surface = *facet;
  if (flips)
    touch->flips++;
  if (flips && touch->along >= 0 && c->friction.mu <= 0 && c->bounce.e <= 0 &&
      touch->flips > VALLEY && touch->flips <= GIVEN_UP &&
      gap - touch->rest < -TOLERANCE * c->size) {
    touch->valley = touch->undecided = PETSC_TRUE;
    touch->plane = *facet;
    touch->other = last;
    return PETSC_TRUE;
  }
  if (touch->flips <= AVERAGED)
    return PETSC_FALSE;
  if (!flips && PetscAbsReal(gap - touch->rest) > TOLERANCE * c->size)
    touch->flips++; /* looks are bounded */
  for (int i = 0; i < 3; i++)
    n[i] = touch->plane.n[i] + (n[i] - touch->plane.n[i]) / (touch->flips - AVERAGED + 1);
  (void)SbNormalise(n);
  return PETSC_FALSE;
}

/* The same of a node that was constrained to two, its displacement being u. */
static void leave_valley(const Contact *c, SbSpace space, const PetscReal u[3], PetscReal gap,
                         const Plane *facet, Touch *touch)
{
  const PetscReal force = touch->lambda;
  const PetscReal other = touch->other_lambda;
  Plane *plane = &touch->plane;

  touch->undecided = PETSC_TRUE;
  touch->surface = *facet;
  if (touch->other_along < 0 || other < 0 || force < 0) { /* one of them is left */
    touch->valley = PETSC_FALSE;
    touch->flips++;
    if (touch->other_along >= 0 && other > force) {
      *plane = touch->other;
      touch->lambda = other;
    }
  } else if (PetscAbsReal(gap - touch->rest) > TOLERANCE * c->size) {
    touch->flips++; /* and on a third one, or not yet where both meet */
    if (SbDot3(facet->n, touch->other.n) > 1 - JUMP || SbDot3(facet->n, plane->n) > 1 - JUMP)
      return;
    if (force > other)
      touch->other = *plane;
    *plane = *facet;
    if (touch->flips > GIVEN_UP)
      touch->valley = PETSC_FALSE;
  } else if (space->rough)
    touch->undecided = PETSC_FALSE; /* a loose solve gives no accurate forces */
  else {
    Plane sum;

    for (int i = 0; i < 3; i++)
      sum.n[i] = force * plane->n[i] + other * touch->other.n[i];
    touch->lambda = SbNormalise(sum.n);
    sum.value = SbDot3(sum.n, u);
    if (touch->lambda > 0)
      *plane = sum;
    touch->valley = PETSC_FALSE;
    touch->flips = KEPT + 1;
  }
}

/* Gap of the node at x less the gap it is constrained to; updates the plane of that. */
static PetscReal search(const Contact *c, SbSpace space, const PetscReal x[3], Touch *touch)
{
  PetscReal u[3], at[3], gap;
  Plane facet;

  touch->undecided = PETSC_FALSE;
  SbSubtract(x, space->node_x + 3 * touch->node, u);
  if (touch->on && touch->flips > KEPT)
    return SbDot3(touch->plane.n, u) - touch->plane.value;
  gap = gap_at(c, &c->to, x, facet.n);
  for (int i = 0; i < 3; i++)
    at[i] = u[i] - gap * facet.n[i]; /* from the rest position to the surface */
  facet.value = SbDot3(facet.n, at) + touch->rest;
  if (touch->on && touch->valley)
    leave_valley(c, space, u, gap, &facet, touch);
  else if (!c->facets || !touch->on || !flip(c, gap, &facet, touch)) {
    facet.value = SbDot3(facet.n, at) + touch->rest;
    touch->plane = facet;
  }
  if (!touch->on)
    touch->surface = facet;
  return gap - touch->rest;
}

/* Changes the gap that the node is constrained to. */
static void move_to(PetscReal rest, Touch *touch)
{
  touch->plane.value += rest - touch->rest;
  touch->gap -= rest - touch->rest;
  touch->rest = rest;
}

/* Activates a penetrating node. */
static void enter(const Contact *c, Touch *touch)
{
  if (!touch->on && c->friction.mu > 0)
    SbFrictionEnter(c, touch, -touch->gap);
  touch->on = PETSC_TRUE;
  if (c->bounce.e > 0 && touch->approach > 0 && touch->rest == 0)
    move_to(SbRestitutionGap(&c->bounce, touch->gap0, touch->approach), touch);
}

/* Time of impact of a node that was separated and penetrates now, in the motion without contact. */
static void find_impact(Contact *c, const Touch *touch)
{
  const PetscReal small = TOLERANCE * c->size;

  if (!c->base.ends_step || touch->was || touch->gap0 <= small || touch->gap >= -small)
    return;
  c->impact = PetscMin(c->impact, touch->gap0 / (touch->gap0 - touch->gap));
}

static PetscErrorCode time_of_impact_nodes(SbContact contact, PetscReal *part)
{
  Contact *c = (Contact *)contact;

  PetscFunctionBeginUser;
  *part = PetscMin(*part, c->impact);

  /* springs of new contacts have acted for a whole step */
  for (PetscInt i = 0; c->impact < 1 && i < c->n; i++)
    if (!c->touch[i].was)
      c->touch[i].lambda = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A step from t to t + dt begins with u0: the obstacle's path, what is left of a penetration, and
   where each node would stick. */
static PetscErrorCode begin_step_nodes(SbContact contact, SbSpace space, PetscReal t, PetscReal dt,
                                       PetscReal speed, PetscReal u0[])
{
  Contact *c = (Contact *)contact;

  PetscFunctionBeginUser;
  (void)speed;
  SbContactPose(c, t, &c->from);
  SbContactPose(c, t + dt, &c->to);
  c->friction.updates = 0;
  c->first = PETSC_TRUE;
  c->impact = 1;
  SbOverlapBegin(&c->overlap, dt);
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    PetscReal x0[3], X0[3], x1[3], n[3], gap0, depth;

    touch->toggles = touch->flips = 0;
    touch->valley = PETSC_FALSE;

    /* a cut attempt restarts with the initial active set; a failed one keeps the active set found
       so far */
    if (c->base.ends_step || c->bounce.e > 0)
      touch->on = touch->was;
    touch->idle = (PetscBool)(c->base.ends_step && !touch->was && !exact(c));
    touch->approach = 0;
    place(space, touch->node, u0, x0);
    gap0 = gap_at(c, &c->from, x0, n);
    if (c->base.ends_step)
      touch->gap0 = gap0;

    /* with springs penetration includes their deflection; projected nodes are where they were
       constrained */
    depth = touch->was && !exact(c) ? -touch->kept : -gap0;
    touch->rest = depth > TOLERANCE * c->size ? -c->overlap.left * depth : 0;

    /* the damper of a step of implicit Euler is a stiffer spring and a constant force: k damping (g
       - g0) / dt, g0 < 0 the gap at its start */
    touch->stiff = touch->k;
    if (c->damping > 0 && dt > 0) {
      touch->stiff += touch->k * c->damping / dt;
      touch->before = touch->k * c->damping / dt * PetscMin(0, gap0 - touch->rest);
    }
    if (c->friction.mu <= 0)
      continue;

    /* its initial position moved with the obstacle: it sticks there, also if contact begins in this
       step */
    SbPoseInvert(&c->from, x0, X0);
    SbPoseApply(&c->to, X0, x1);
    for (int k = 0; k < 3; k++) {
      touch->start[k] = x1[k] - space->node_x[3 * touch->node + k];
      touch->friction.stretch[k] = SbDot3(c->to.R + 3 * k, touch->stretch);
    }
    SbFrictionBegin(&touch->friction, touch->on);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restitution: speeds of approach of nodes that were separated. */
static PetscErrorCode find_impacts_nodes(SbContact contact, SbSpace space, PetscReal dt,
                                         const PetscReal u0[], const PetscReal v0[])
{
  Contact *c = (Contact *)contact;

  PetscFunctionBeginUser;
  c->bounce.left = 1;
  c->bounce.dt = dt;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    PetscReal x0[3], X0[3], x1[3], n[3];
    PetscReal v = 0;

    if (touch->was || touch->rest < 0)
      continue;
    place(space, touch->node, u0, x0);
    touch->gap0 = PetscMax(0, gap_at(c, &c->from, x0, n));
    SbPoseInvert(&c->from, x0, X0);
    SbPoseApply(&c->to, X0, x1);
    for (int k = 0; k < 3; k++)
      v -= n[k] * (v0[3 * touch->node + k] - (x1[k] - x0[k]) / dt);
    touch->approach = PetscMax(0, v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The active set at the predicted displacement u. */
static PetscErrorCode start_nodes(SbContact contact, SbSpace space, const PetscReal u[])
{
  Contact *c = (Contact *)contact;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    PetscReal x[3];

    place(space, touch->node, u, x);
    touch->gap = search(c, space, x, touch);
    find_impact(c, touch);
    for (int k = 0; k < 3; k++)
      touch->now[k] = u[3 * touch->node + k];

    /* constraints: nodes that penetrate, or would at their speed of approach; springs: those that
       push */
    if (exact(c)) {
      const PetscBool comes =
        (PetscBool)(touch->approach > 0 &&
                    c->bounce.dt * touch->approach * (1 + EARLY) >= touch->gap0);

      if (touch->gap < 0 || comes)
        enter(c, touch);
    } else if (c->held) {
      if (spring(touch, touch->gap) > 0)
        enter(c, touch);
      else
        touch->on = PETSC_FALSE;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The constraints of active nodes: normal, or tangential (across). */
static PetscErrorCode constrain_nodes(SbContact contact, SbSpace space, PetscBool across)
{
  Contact *c = (Contact *)contact;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    SbConstraint row = {.node = touch->node, .value = touch->plane.value};

    if (across) {
      if (touch->along >= 0 && c->friction.mu > 0)
        PetscCall(SbFrictionConstrain(c, space, touch));
      continue;
    }
    touch->along = touch->other_along = touch->friction.slide[0] = touch->friction.slide[1] = -1;
    if (!touch->on)
      continue;
    for (int k = 0; k < 3; k++)
      row.n[k] = row.push[k] = touch->plane.n[k];
    if (c->friction.mu > 0)
      SbFrictionDirection(c, touch, row.push);
    if (!exact(c)) {
      row.spring = PETSC_TRUE;
      row.stiffness = touch->stiff;
      row.constant = touch->lambda + touch->before;
    }
    PetscCall(SbSpaceAddConstraint(space, &row, &touch->along));
    if (!touch->valley)
      continue;
    for (int k = 0; k < 3; k++)
      row.n[k] = row.push[k] = touch->other.n[k];
    row.value = touch->other.value;
    PetscCall(SbSpaceAddConstraint(space, &row, &touch->other_along));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the active set was right for this node; changes it if not. */
static PetscBool update_constraint(const Contact *c, PetscReal largest, Touch *touch)
{
  if (!touch->on) {
    if (touch->gap >= -TOLERANCE * c->size)
      return PETSC_TRUE;
    enter(c, touch);
    touch->toggles++;
    return PETSC_FALSE;
  }
  if (touch->along < 0)
    return PETSC_TRUE;
  if (touch->lambda < -PULLING * largest && touch->toggles < TOGGLES) {
    touch->on = touch->valley = PETSC_FALSE;
    touch->lambda = 0;
    return PETSC_FALSE;
  }
  touch->lambda = PetscMax(0, touch->lambda);
  if (touch->undecided)
    return PETSC_FALSE;
  return (PetscBool)(PetscAbsReal(touch->gap) <= TOLERANCE * c->size);
}

/* Whether a spring's force agrees with its position; for `augmented`, which updates the multiplier,
   also whether the penetration is within the tolerance. */
static PetscBool update_spring(const Contact *c, PetscReal largest, Touch *touch)
{
  const PetscReal force = spring(touch, touch->gap);
  PetscBool right = PETSC_TRUE;

  if (c->held) {
    if (!touch->on && force > 0) {
      enter(c, touch);
      touch->toggles++;
    } else if (force <= 0 && touch->toggles < TOGGLES)
      touch->on = PETSC_FALSE;
    right = (PetscBool)(touch->wrong <= SETTLED * largest);
  }
  if (c->response == PENALTY)
    return right;
  if (force > 0 ? PetscAbsReal(touch->gap) <= TOLERANCE * c->size : touch->lambda <= 0)
    return right;
  touch->lambda = force;
  return PETSC_FALSE;
}

static PetscErrorCode update_nodes(SbContact contact, SbSpace space, const PetscReal u[],
                                   PetscBool *changed)
{
  Contact *c = (Contact *)contact;
  PetscReal largest = 0;
  PetscReal worst = 0;
  PetscBool mine = PETSC_FALSE;
  PetscBool wait;

  PetscFunctionBeginUser;

  /* gap and multiplier of every node; the largest multiplier of all ranks */
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    const PetscReal pushed =
      touch->along < 0 ? 0 : SbSpaceGetConstraint(space, touch->along)->force;
    PetscReal x[3], wrong[3];

    for (int k = 0; k < 3; k++) {
      touch->now[k] = u[3 * touch->node + k];
      wrong[k] = pushed * touch->plane.n[k];
    }
    if (touch->along >= 0 && c->friction.mu > 0)
      SbFrictionRead(c, space, touch, pushed);
    if (exact(c))
      touch->lambda = touch->on ? pushed : 0;
    if (touch->valley)
      touch->other_lambda =
        touch->other_along < 0 ? 0 : SbSpaceGetConstraint(space, touch->other_along)->force;
    place(space, touch->node, u, x);
    touch->gap = search(c, space, x, touch);
    largest = PetscMax(largest, contact_force(c, touch));
    if (!exact(c) && c->held) {
      const PetscReal force =
        touch->on && touch->toggles >= TOGGLES ? pull(touch, touch->gap) : contact_force(c, touch);

      for (int k = 0; k < 3; k++)
        wrong[k] -= force * touch->plane.n[k];
      touch->wrong = PetscSqrtReal(SbDot3(wrong, wrong));
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPIU_REAL, MPI_MAX, space->comm));
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    PetscReal error;

    /* after the first solve of a step: times of impact; from now on all springs act */
    if (c->first && c->base.ends_step) {
      if (!touch->on || !exact(c))
        find_impact(c, touch);
      if (touch->idle && touch->gap < 0)
        mine = PETSC_TRUE;
      touch->idle = PETSC_FALSE;
    }
    if (!(exact(c) ? update_constraint(c, largest, touch) : update_spring(c, largest, touch)))
      mine = PETSC_TRUE;

    /* stick and slip */
    if (c->friction.mu <= 0 || !touch->on || touch->along < 0)
      continue;
    error = SbFrictionUpdate(c, touch, contact_force(c, touch));
    worst = PetscMax(worst, error); /* a macro: its arguments are evaluated twice */
  }
  c->first = PETSC_FALSE;
  if (c->friction.mu > 0) {
    c->friction.updates++;
    c->friction.error = largest > 0 ? worst / (c->friction.mu * largest) : 0;
    if (c->friction.error > (c->friction.updates > UPDATES ? LATE : SETTLED))
      mine = PETSC_TRUE;
  }

  /* release springs in tension once all else has converged, a few times */
  wait = mine;
  if (c->held && !exact(c))
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &wait, 1, SB_MPI_BOOL, MPI_LOR, space->comm));
  for (PetscInt i = 0; c->held && !exact(c) && !wait && i < c->n; i++) {
    Touch *touch = &c->touch[i];

    if (!touch->on || touch->toggles >= 2 * TOGGLES ||
        pull(touch, touch->gap) >= -PULLING * largest)
      continue;
    touch->on = PETSC_FALSE;
    mine = PETSC_TRUE;
  }
  if (mine)
    *changed = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Velocities at the obstacle after a step: rebound. */
static PetscErrorCode impact_work_nodes(SbContact contact, PetscReal *work)
{
  const Contact *c = (const Contact *)contact;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];

    if (touch->on && touch->rest > 0)
      *work += touch->lambda * (touch->rest - touch->gap0);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode scale_restitution_nodes(SbContact contact, PetscReal share)
{
  Contact *c = (Contact *)contact;

  PetscFunctionBeginUser;
  c->bounce.left = share;
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    if (touch->rest > 0)
      move_to(SbRestitutionGap(&c->bounce, touch->gap0, touch->approach), touch);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Velocity of the obstacle at each active node. */
static PetscErrorCode target_velocity_nodes(SbContact contact, SbSpace space, const SbStage *stage)
{
  const Contact *c = (const Contact *)contact;
  SbPose before, now;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &now);
  SbContactPose(c, stage->t - INSTANT * stage->dt, &before);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], X[3], from[3], to[3], v[3];

    if (!touch->on || touch->along < 0)
      continue;
    place(space, touch->node, stage->u, x);
    SbPoseInvert(&now, x, X);
    SbPoseApply(&before, X, from);
    SbPoseApply(&now, X, to);
    for (int k = 0; k < 3; k++)
      v[k] = (to[k] - from[k]) / (INSTANT * stage->dt);
    SbSpaceGetConstraint(space, touch->along)->velocity = SbDot3(touch->plane.n, v);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Normal force on a node at x, N; n: the normal. Springs follow the current normal; a constrained
   node keeps that of its constraint: at edges between facets a current one would jump within
   Newton's method. */
static PetscReal normal_force(const Contact *c, const SbPose *pose, const Touch *touch,
                              const PetscReal x[3], PetscReal n[3])
{
  if (c->held) {
    for (int k = 0; k < 3; k++)
      n[k] = touch->plane.n[k];
    return touch->on && touch->along >= 0 ? contact_force(c, touch) : 0;
  }
  return spring(touch, gap_at(c, pose, x, n) - touch->rest);
}

static PetscErrorCode force_nodes(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
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
    for (int k = 0; k < 3; k++)
      f[3 * touch->node + k] += normal * n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rotation of the normal is neglected. */
static PetscErrorCode tangent_nodes(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Contact *c = (const Contact *)e->data;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], n[3], block[9];

    place(space, touch->node, stage->u, x);
    if (normal_force(c, &pose, touch, x, n) <= 0)
      continue;
    for (int k = 0; k < 9; k++)
      block[k] = stage->shift_k * touch->stiff * n[k / 3] * n[k % 3];
    PetscCall(SbSpaceAddSpring(space, A, touch->cell, touch->a, block));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rotates the deflection of a node's springs with the obstacle. */
static void rotate_stretch(const SbPose *pose, Touch *touch)
{
  const PetscReal *R = pose->R;
  const PetscReal *s = touch->friction.stretch;

  for (int k = 0; k < 3; k++)
    touch->stretch[k] = R[k] * s[0] + R[3 + k] * s[1] + R[6 + k] * s[2];
}

static PetscErrorCode accept_nodes(SbEffect e, SbSpace space, const SbStage *stage)
{
  Contact *c = (Contact *)e->data;
  PetscReal most = c->friction.error;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  if (c->friction.updates > UPDATES && !c->friction.said) { /* alike on all ranks */
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, space->comm));
    c->friction.said = (PetscBool)(most > SETTLED);
    if (c->friction.said)
      PetscCall(SbWarning(
        space->comm,
        "at t = %g s the friction of the effect %s settled to %.1g of the largest only, not to "
        "%g; said once: smaller steps make it more exact",
        (double)stage->t, e->name, (double)most, SETTLED));
  }
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];
    PetscReal x[3], n[3];

    place(space, touch->node, stage->u, x);
    if (!exact(c))
      touch->on = (PetscBool)(normal_force(c, &pose, touch, x, n) > 0);
    if (c->friction.mu > 0) { /* history variables */
      SbFrictionAccept(c, touch,
                       (PetscBool)(touch->on && touch->along >= 0 && contact_force(c, touch) > 0));
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
  PetscReal n[3];
  PetscReal normal = normal_force(c, pose, touch, x, n);

  if (normal <= 0)
    return PETSC_FALSE;
  if (c->held)
    normal = SbSpaceGetConstraint(space, touch->along)->force;
  for (int k = 0; k < 3; k++)
    f[k] = normal * n[k] + (c->friction.mu > 0 ? touch->friction.force[k] : 0);
  return PETSC_TRUE;
}

static PetscErrorCode gap_nodes(SbContact contact, SbSpace space, const SbStage *stage,
                                PetscReal gap[], PetscReal normal[])
{
  const Contact *c = (const Contact *)contact;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const PetscInt node = c->touch[i].node;
    PetscReal x[3], n[3], g;

    place(space, node, stage->u, x);
    g = gap_at(c, &pose, x, n);
    if (g >= gap[node])
      continue;
    gap[node] = g;
    for (int k = 0; k < 3; k++)
      normal[3 * node + k] = n[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode points_nodes(SbContact contact, SbSpace space, const SbStage *stage,
                                   SbContactPoints *list)
{
  const Contact *c = (const Contact *)contact;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    SbContactPoint p = {.body = {space->node_body[touch->node], -1},
                        .id = {0, space->node_orig[touch->node], 0}};

    place(space, touch->node, stage->u, p.x);
    if (!force_on(c, &pose, space, touch, p.x, p.force))
      continue;
    p.gap = gap_at(c, &pose, p.x, p.normal);
    if (exact(c))
      PetscCall(PetscArraycpy(p.normal, touch->plane.n, 3)); /* the normal of the constraint */
    PetscCall(SbReserve(list->n + 1, sizeof(p), &list->size, &list->point));
    list->point[list->n++] = p;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Force and torque of the obstacle on the bodies, number of active nodes, deepest penetration. */
static PetscErrorCode history_nodes(SbEffect e, SbSpace space, const SbStage *stage,
                                    const PetscReal residual[], PetscReal values[])
{
  Contact *c = (Contact *)e->data;
  PetscReal deepest = 0;
  SbPose pose;

  PetscFunctionBeginUser;
  SbContactPose(c, stage->t, &pose);
  (void)residual;
  for (int k = 0; k < 8; k++)
    values[k] = 0;
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal x[3], n[3], f[3], arm[3], moment[3];

    place(space, touch->node, stage->u, x);
    deepest = PetscMax(deepest, -gap_at(c, &pose, x, n));
    if (!force_on(c, &pose, space, touch, x, f))
      continue;
    for (int k = 0; k < 3; k++)
      arm[k] = x[k] - c->path.point[k] - pose.d[k];
    SbCross(arm, f, moment);
    for (int k = 0; k < 3; k++) {
      values[k] += f[k];
      values[3 + k] += moment[k];
    }
    values[6]++;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &deepest, 1, MPIU_REAL, MPI_MAX, space->comm));

  /* smaller values are within the tolerance */
  if (!space->rank && deepest > TOLERANCE * c->size)
    values[7] = deepest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A record has the node's original number, whether it is and was active, right-hand side and normal
   of its constraint, multiplier, gap, and friction state: enough to rebuild the constraints of the
   last solve, and to continue as the uninterrupted run. */
static PetscErrorCode save_nodes(SbEffect e, SbSpace space, PetscInt *n, PetscReal **records)
{
  const Contact *c = (const Contact *)e->data;

  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscMalloc1(SB_CONTACT_STATE * c->n, records));
  for (PetscInt i = 0; i < c->n; i++) {
    const Touch *touch = &c->touch[i];
    PetscReal *r = *records + SB_CONTACT_STATE * *n;

    if (!touch->on && !touch->was && touch->lambda == 0)
      continue;
    r[0] = (PetscReal)space->node_orig[touch->node];
    r[1] = touch->on;
    r[2] = touch->was;
    r[3] = touch->rest;
    r[4] = touch->kept;
    r[5] = touch->lambda;
    r[6] = touch->plane.value;
    r[7] = touch->gap;
    PetscCall(PetscArraycpy(r + 8, touch->plane.n, 3));
    PetscCall(PetscArraycpy(r + 11, touch->surface.n, 3));
    r[14] = touch->friction.slid;
    r[15] = touch->friction.crowded;
    r[16] = touch->friction.turning;
    PetscCall(PetscArraycpy(r + 17, touch->friction.tangent[0], 3));
    PetscCall(PetscArraycpy(r + 20, touch->friction.stretch, 3));
    (*n)++;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode load_nodes(SbEffect e, SbSpace space, PetscReal t, const PetscReal u[],
                                 PetscInt n, const PetscReal records[])
{
  Contact *c = (Contact *)e->data;
  PetscInt *number, *at;

  PetscFunctionBeginUser;
  SbContactPose(c, t, &c->to);
  PetscCall(PetscMalloc2(c->n, &number, c->n, &at));
  for (PetscInt i = 0; i < c->n; i++) {
    Touch *touch = &c->touch[i];

    /* nodes without a record are inactive */
    *touch = (Touch){.node = touch->node,
                     .cell = touch->cell,
                     .a = touch->a,
                     .k = touch->k,
                     .stiff = touch->k,
                     .along = -1,
                     .friction = {.slide = {-1, -1}}};
    for (int k = 0; k < 3; k++)
      touch->start[k] = touch->now[k] = u[3 * touch->node + k];
    number[i] = space->node_orig[touch->node];
    at[i] = i;
  }
  PetscCall(PetscSortIntWithArray(c->n, number, at));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *r = records + SB_CONTACT_STATE * i;
    PetscInt place;
    Touch *touch;

    PetscCall(PetscFindInt((PetscInt)r[0], c->n, number, &place));
    if (place < 0)
      continue; /* another rank's */
    touch = &c->touch[at[place]];
    touch->on = (PetscBool)(r[1] != 0);
    touch->was = (PetscBool)(r[2] != 0);
    touch->rest = r[3];
    touch->kept = r[4];
    touch->lambda = r[5];
    touch->plane.value = r[6];
    touch->gap = r[7];
    PetscCall(PetscArraycpy(touch->plane.n, r + 8, 3));
    PetscCall(PetscArraycpy(touch->surface.n, r + 11, 3));
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

/* Constraints: exact ones, or springs that act along with friction. */
static const SbContactOps constraint_ops = {
  .begin_step = begin_step_nodes,
  .find_impacts = find_impacts_nodes,
  .start_active_set = start_nodes,
  .assemble_constraints = constrain_nodes,
  .update_active_set = update_nodes,
  .time_of_impact = time_of_impact_nodes,
  .impact_work = impact_work_nodes,
  .scale_restitution = scale_restitution_nodes,
  .target_velocity = target_velocity_nodes,
  .gap = gap_nodes,
  .points = points_nodes,
};

/* Forces of springs on the nodes, with multipliers or impacts that an update changes, or
   without. */
static const SbContactOps spring_ops = {
  .begin_step = begin_step_nodes,
  .start_active_set = start_nodes,
  .update_active_set = update_nodes,
  .time_of_impact = time_of_impact_nodes,
  .gap = gap_nodes,
  .points = points_nodes,
};
static const SbContactOps penalty_ops = {
  .begin_step = begin_step_nodes,
  .start_active_set = start_nodes,
  .gap = gap_nodes,
  .points = points_nodes,
};

static const SbEffectOps constraint_effect = {
  .setup = setup_nodes,
  .accept = accept_nodes,
  .history = history_nodes,
  .save = save_nodes,
  .load = load_nodes,
  .destroy = SbContactDestroy,
};
static const SbEffectOps spring_effect = {
  .setup = setup_nodes,
  .force = force_nodes,
  .tangent = tangent_nodes,
  .accept = accept_nodes,
  .history = history_nodes,
  .save = save_nodes,
  .load = load_nodes,
  .destroy = SbContactDestroy,
};

PetscErrorCode SbContactNodesCreate(SbEffect e, const SbScope *scope)
{
  static const char *const columns[] = {"force_x",  "force_y",  "force_z",  "torque_x",
                                        "torque_y", "torque_z", "contacts", "penetration"};
  Contact *c = (Contact *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReal(scope, "friction_kinetic", &c->friction.mu_kinetic));
  if (c->friction.mu_kinetic < 0)
    c->friction.mu_kinetic = c->friction.mu;
  PetscCheck(c->friction.mu_kinetic <= c->friction.mu, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_friction_kinetic %g is above -effect_%s_friction %g: sliding would "
             "start and stop in turn",
             e->name, (double)c->friction.mu_kinetic, e->name, (double)c->friction.mu);
  PetscCall(SbOptionSecond(scope, "time_of_impact", &c->base.ends_step));
  PetscCall(SbOptionReal(scope, "stiffness", &c->stiffness));
  PetscCall(SbOptionReal(scope, "damping", &c->damping));
  PetscCheck(
    c->damping <= 0 || c->response == PENALTY, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_damping %g s is for springs that give: it needs -effect_%s_response penalty",
    e->name, (double)c->damping, e->name);
  PetscCheck(c->bounce.e <= 0 || exact(c), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-effect_%s_restitution %g needs -effect_%s_response projected, multiplier or barrier",
             e->name, (double)c->bounce.e, e->name);
  PetscCheck(
    c->bounce.e <= 0 || !c->base.ends_step, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
    "-effect_%s_restitution %g and -effect_%s_time_of_impact yes do not go together: a step "
    "that ends at the impact has no rebound; leave one of them out",
    e->name, (double)c->bounce.e, e->name);

  /* loads and history of the effect; exact constraints and friction give forces by constraints,
     else force() acts */
  c->held = (PetscBool)(exact(c) || c->friction.mu > 0);
  e->ops = c->held ? constraint_effect : spring_effect;
  e->nstate = SB_CONTACT_STATE;
  e->by_node = PETSC_TRUE;
  e->column = columns;
  e->ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns);
  e->linear = c->held;

  /* the response */
  c->base.saddle = (PetscBool)(c->response == MULTIPLIER);
  c->base.springs = (PetscBool)(!exact(c) || c->friction.mu > 0);
  if (c->held)
    c->base.ops = &constraint_ops;
  else
    c->base.ops = c->response == AUGMENTED || c->base.ends_step ? &spring_ops : &penalty_ops;
  PetscFunctionReturn(PETSC_SUCCESS);
}
