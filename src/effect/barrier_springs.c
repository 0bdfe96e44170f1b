/*
  barrier_springs.c - one-sided springs along fixed directions, which separate initial overlaps and enforce restitution.

  A spring has the energy k/2 (g - goal)^2 while g = n . sum weight x is below its goal. Overlaps and springs are found anew in each step.

  Overlap. Each penetrating point (src/contact/overlap.c) is moved out by a part of its depth in each step, so that the depth falls to 1/e in -effect_X_separation_steps steps; by the width
  of the barrier at least, and in a static run at once. Springs that reach less than half of that get stiffer. Pairs of the overlap are excluded from barrier and collision detection until there is none left.
*/
#include "barrier_impl.h"

#define STIFF 10.     /* static run: stiffness over that of the barrier */
#define SAME 1e-5     /* of the bodies' size: positions this close coincide */
#define ROUNDING 1e-9 /* of that size: a smaller initial depth counts as touching */

PetscErrorCode SbBarrierAddSpring(Barrier *b, const Spring *spring)
{
  PetscFunctionBeginUser;
  if (b->nspring == b->spring_size) {
    b->spring_size = PetscMax(64, 2 * b->spring_size);
    PetscCall(PetscRealloc((size_t)b->spring_size * sizeof(*b->spring), &b->spring));
  }
  b->spring[b->nspring++] = *spring;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Excludes pairs of gap zero, as of a vertex in a triangle, while there is overlap. */
static PetscErrorCode exempt_nearest(Barrier *b)
{
  const SbContactMesh m = b->mesh;
  uint8_t *near = b->overlap.near;

  PetscFunctionBeginUser;
  PetscCall(SbContactPairsFind(b->pairs, b->x, b->x));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    SbDistance d;

    if (SbContactPairGap(m, pair, b->x, &d) > SAME * m->size) continue;
    for (int k = 0; k < 4; k++) near[pair->v[k]] = SB_OVERLAP_INSIDE;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, near, (PetscMPIInt)m->nvertex, MPI_UINT8_T, MPI_MAX, m->space->comm));
  PetscCall(SbContactPairsIgnore(b->pairs, near));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Warns once, naming what overlaps. */
static PetscErrorCode announce(SbEffect e, const SbSpace s, const SbContactOverlap *o)
{
  const char *name[2];

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++)
    name[k] = o->part[k] < s->mesh->nbody ? s->mesh->body[o->part[k]].name : "the obstacle";
  PetscCheck(o->n > 0, s->comm, PETSC_ERR_USER_INPUT,
             "The effect %s: %s and %s overlap at (%g, %g, %g) m, and no separation direction was found: "
             "%" PetscInt_FMT " edges intersect triangles; move one of them by -body_NAME_translate",
             e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2],
             o->ncrossing);
  PetscCall(SbWarning(
    s->comm,
    "The effect %s: %s and %s overlap at (%g, %g, %g) m when the run begins; %" PetscInt_FMT
    " points are up to %g m deep. They are separated gradually (-effect_%s_separation_steps); until then "
    "they may pass through each other there",
    e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2], o->n,
    (double)o->deepest, e->name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether two bodies coincide: then no separation direction exists. */
static PetscBool same_place(const Barrier *b, const PetscInt body[2])
{
  const SbContactMesh m = b->mesh;
  PetscReal box[2][6], most = 0.;

  for (int k = 0; k < 2; k++) {
    SbBoxClear(box[k]);
    for (PetscInt v = 0; v < m->nbody_vertex; v++) {
      if (m->part[v] == body[k]) SbBoxAdd(box[k], b->x + 3 * v);
    }
  }
  for (int i = 0; i < 6; i++) most = PetscMax(most, PetscAbsReal(box[0][i] - box[1][i]));
  return (PetscBool)(most < SAME * m->size);
}

/* Error if a body is wholly inside the obstacle: no separation direction exists. x: initial positions. */
static PetscErrorCode check_obstacle(SbEffect e, SbSpace s, PetscReal t)
{
  const Barrier *b = (const Barrier *)e->data;
  const SbContactMesh m = b->mesh;
  SbPose pose;

  PetscFunctionBeginUser;
  (*b->scene.pose)(b->data, t, &pose);
  for (PetscInt v = 0; v < m->nbody_vertex; v++) {
    PetscReal X[3], n[3];

    SbPoseInvert(&pose, b->x + 3 * v, X);
    PetscCheck(m->driven[v] || SbObstacleDistance(b->scene.obstacle, X, n) > -SAME * m->size, s->comm,
               PETSC_ERR_USER_INPUT,
               "The effect %s: %s is inside the obstacle when the run begins, at (%g, %g, %g) m; move it by "
               "-body_%s_translate",
               e->name, s->mesh->body[m->part[v]].name, (double)b->x[3 * v], (double)b->x[3 * v + 1],
               (double)b->x[3 * v + 2], s->mesh->body[m->part[v]].name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBarrierSeparate(SbEffect e, SbSpace s, PetscReal dt, PetscBool first)
{
  Barrier *b = (Barrier *)e->data;
  SbContactOverlap *o = &b->overlap;
  const PetscBool before = b->overlapping;
  PetscBool inside = PETSC_FALSE;
  PetscInt body[2] = {0, 0};

  PetscFunctionBeginUser;
  b->nspring = 0;
  if (first && !b->scene.obstacle) PetscCall(SbContactMeshIsInside(b->mesh, b->x, body, &inside));
  PetscCall(SbContactOverlapFind(b->mesh, b->scene.self, b->x, inside, o));
  PetscCheck(
    !inside || (o->n && !same_place(b, body)), s->comm, PETSC_ERR_USER_INPUT,
    "The effect %s: body %s is inside body %s when the run begins, or in the same place; move one of them by "
    "-body_%s_translate",
    e->name, s->mesh->body[body[0]].name, s->mesh->body[body[1]].name, s->mesh->body[body[0]].name);
  b->overlapping =
    (PetscBool)(o->ncrossing > 0 && (!first || !o->n || o->deepest > ROUNDING * b->mesh->size));
  if (first && b->scene.obstacle && !b->overlapping) PetscCall(check_obstacle(e, s, 0.));
  PetscCall(SbContactPairsIgnore(b->pairs, b->overlapping ? o->near : NULL));
  b->known = PETSC_FALSE;
  if (!b->overlapping) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(exempt_nearest(b));
  if (!before && !b->announced) PetscCall(announce(e, s, o));
  b->announced = PETSC_TRUE;

  if (e->dynamic) SbOverlapBegin(&b->parting, dt);
  for (PetscInt i = 0; i < o->n; i++) {
    const SbPenetration *p = &o->point[i];
    const PetscInt one = b->mesh->part[p->v[0]], two = b->mesh->part[p->v[p->n - 1]];
    const PetscReal w = PetscMin(b->w[one], b->w[two]), k = PetscMin(b->k[one], b->k[two]),
                    all = p->depth + 0.5 * w;
    Spring spring = {.n = p->n, .stiffness = b->stiffer * k * p->area / w};

    if (!e->dynamic) spring.stiffness *= STIFF;
    PetscCall(PetscArraycpy(spring.v, p->v, 5));
    PetscCall(PetscArraycpy(spring.weight, p->weight, 5));
    PetscCall(PetscArraycpy(spring.normal, p->normal, 3));
    spring.depth = p->depth;
    spring.start = SbBarrierSpringPlace(b, &spring);
    spring.goal =
      spring.start + (e->dynamic ? PetscMin(all, PetscMax(w, all * (1. - b->parting.left))) : all);
    PetscCall(SbBarrierAddSpring(b, &spring));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
