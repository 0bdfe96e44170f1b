/*
  barrier_restitution.c - Newton's law of restitution with the response `barrier` (its energy: src/model/restitution.c).

  At the start of a step the vertices are moved in free flight. A pair whose gap falls to the barrier's width, or nearly, on this path has
  the direction n and the weights of its closest points there, and the speed of approach v = -n . sum weight v. In this step a one-sided spring holds it at or above

      n . sum weight x = g0 + h e v,   g0 the same sum when the step begins,

  which is stiff relative to the lighter body, as whole bodies collide. Pairs already within the width get none, so that a body at rest stays at rest.
*/
#include "barrier_impl.h"

#define STIFF 1e5  /* stiffness over mass of the lighter body / dt^2 */
#define EARLY 0.05 /* extension of the path over its length: near misses count as impacts */
#define REST 0.999 /* of the width: a smaller gap is contact */
#define KEEP 0.01  /* tolerance of the impact's position, over the gap above the width */

/* Fraction of the motion from x0 to x1 at which the pair's gap falls to w; 2: none. */
static PetscReal meets(const Barrier *b, const SbContactPair *pair, const PetscReal x0[],
                       const PetscReal x1[], PetscReal w)
{
  const SbContactMesh m = b->mesh;
  const PetscBool round =
    (PetscBool)(pair->v[0] >= m->nbody_vertex || pair->v[pair->side ? 1 : 2] >= m->nbody_vertex);
  const SbCCDLimits limits = {.radius = round ? m->radius : 0., .separation = w, .keep = KEEP};
  const PetscReal gap = SbContactPairGap(m, pair, x0, &(SbDistance){0});
  PetscReal from[12], to[12], part;

  if (gap < REST * w) return 2.;
  if (pair->side) {
    part = gap - SbContactPairGap(m, pair, x1, &(SbDistance){0});
    return part > 0. && part * (1. + EARLY) >= gap - w ? PetscMin(1., (gap - w) / part) : 2.;
  }
  for (int k = 0; k < 12; k++) {
    const PetscInt i = 3 * pair->v[k / 3] + k % 3;

    from[k] = x0[i];
    to[k] = x0[i] + (1. + EARLY) * (x1[i] - x0[i]);
  }
  if (!SbTimeOfImpact(pair->kind, from, to, &limits, &part)) return 2.;
  return PetscMin(1., part * (1. + EARLY));
}

/* The spring of a pair at the positions x of its impact; false: it does not approach. Vertices with positive weights come first, those of bodies before others. */
static PetscBool find_spring(const Barrier *b, const SbContactPair *pair, const PetscReal x[], Spring *spring)
{
  const SbContactMesh m = b->mesh;
  const PetscBool turned = (PetscBool)(pair->v[0] >= m->nbody_vertex);
  SbDistance d;

  (void)SbContactPairGap(m, pair, x, &d);
  *spring = (Spring){0};
  for (int pass = 0; pass < 2; pass++) {
    for (int k = 0; k < (pair->side ? 2 : 4); k++) {
      const PetscReal weight = turned ? -d.weight[k] : d.weight[k];

      if (pass ? weight >= 0. : weight <= 0.) continue;
      spring->v[spring->n] = pair->v[k];
      spring->weight[spring->n++] = weight;
    }
  }
  for (int i = 0; i < 3; i++) spring->normal[i] = turned ? -d.n[i] : d.n[i];
  for (PetscInt k = 0; k < spring->n; k++) {
    const PetscInt v = 3 * spring->v[k];

    spring->start += spring->weight[k] * SbDot3(spring->normal, b->x + v);
    spring->approach -= spring->weight[k] * SbDot3(spring->normal, b->other + v);
  }
  spring->approach = (spring->approach + spring->start) / b->bounce.dt;
  return (PetscBool)(spring->approach > 0.);
}

PetscErrorCode SbEffectMeet_Barrier(SbEffect e, SbSpace s, PetscReal dt, const PetscReal u0[],
                                    const PetscReal v0[])
{
  Barrier *b = (Barrier *)e->data;
  const SbContactMesh m = b->mesh;
  PetscReal *u1, *x;

  PetscFunctionBeginUser;
  b->nbounce = 0;
  if (b->bounce.e <= 0.) PetscFunctionReturn(PETSC_SUCCESS);
  SbRestitutionBegin(&b->bounce, dt);

  /* free flight */
  PetscCall(PetscMalloc2(3 * s->nnode, &u1, 3 * m->nvertex, &x));
  for (PetscInt i = 0; i < 3 * s->nnode; i++) u1[i] = u0[i] + dt * v0[i];
  PetscCall(SbBarrierUpdate(b, u0));
  PetscCall(SbContactMeshGetPositions(m, u1, NULL, b->other));
  SbBarrierPlaceObstacle(b, 1., b->other);
  PetscCall(SbContactPairsFind(b->pairs, b->x, b->other));
  b->known = PETSC_FALSE;

  /* impacts on it */
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscReal w = width_of(b, pair);
    const PetscInt part[2] = {m->part[pair->v[0]], m->part[pair->v[pair->side ? 1 : 2]]};
    PetscReal at, mass = PETSC_MAX_REAL;
    Spring spring;

    if (SbContactPairSweptApart(m, pair, b->x, b->other, w)) continue;
    at = meets(b, pair, b->x, b->other, w);
    if (at > 1.) continue;
    for (int k = 0; k < (pair->side ? 3 : 4); k++) {
      for (int j = 0; j < 3; j++) {
        const PetscInt c = 3 * pair->v[k] + j;

        x[c] = b->x[c] + at * (b->other[c] - b->x[c]);
      }
    }
    if (!find_spring(b, pair, x, &spring)) continue;
    for (int k = 0; k < 2; k++) {
      if (part[k] < s->mesh->nbody)
        mass = PetscMin(mass, s->material[part[k]]->density * s->mesh->body[part[k]].volume);
    }
    spring.stiffness = STIFF * mass / PetscSqr(dt);
    spring.goal = spring.start + SbRestitutionGap(&b->bounce, 0., spring.approach);
    PetscCall(SbBarrierAddSpring(b, &spring));
    b->nbounce++;
  }
  PetscCall(PetscFree2(u1, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRestitution_Barrier(SbEffect e, PetscReal *work)
{
  const Barrier *b = (const Barrier *)e->data;
  PetscReal push[15];

  PetscFunctionBeginUser;
  *work = 0.;
  for (PetscInt i = b->nspring - b->nbounce; i < b->nspring; i++) {
    const Spring *spring = &b->spring[i];

    if (b->mesh->own[spring->v[0]])
      *work += SbBarrierSpring(b, spring, push) * (SbBarrierSpringPlace(b, spring) - spring->start);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectScaleRestitution_Barrier(SbEffect e, PetscReal share)
{
  Barrier *b = (Barrier *)e->data;

  PetscFunctionBeginUser;
  b->bounce.left = share;
  for (PetscInt i = b->nspring - b->nbounce; i < b->nspring; i++) {
    Spring *spring = &b->spring[i];

    /* a goal lowered below the spring's deflection would release it: keep it active for the next iteration */
    spring->held = (PetscBool)(SbBarrierSpringPlace(b, spring) < spring->goal);
    spring->goal = spring->start + SbRestitutionGap(&b->bounce, 0., spring->approach);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
