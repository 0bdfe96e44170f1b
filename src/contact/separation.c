/*
  separation.c - one-sided springs along fixed directions: they separate overlaps, enforce
  restitution.

  A spring has the energy k/2 (g - goal)^2 while g = n . sum weight x is below a goal; each step has
  new ones.

  Overlap. Each penetrating point (overlap.c) is moved out by a part of its depth in
  each step, so that the depth falls to 1/e in -effect_X_separation_steps steps; by the width of the
  barrier at least, and in a static run at once. Springs that reach less than half of that get
  stiffer. Pairs of the overlap are excluded from barrier and collision detection until there is
  none left.

  Restitution (its energy: restitution.c). At the start of a step the vertices are moved
  in free flight. A pair whose gap falls to the barrier's width, or nearly, on this path has the
  direction n and the weights of its closest points there, and the speed of approach v = -n . sum
  weight v. In this step a spring holds it at or above

      n . sum weight x = g0 + h e v,   g0 the same sum when the step begins,

  which is stiff relative to the lighter body, as whole bodies collide. Pairs already within the
  width get none, so that a body at rest stays at rest.
*/
#include "barrier.h"

#define STIFF 10.     /* static run: stiffness over that of the barrier */
#define SAME 1e-5     /* of the bodies' size: positions this close coincide */
#define ROUNDING 1e-9 /* of that size: a smaller initial depth counts as touching */
#define RIGID 1e5     /* restitution: stiffness over mass of the lighter body / dt^2 */
#define EARLY 0.05    /* extension of the path over its length: near misses count as impacts */
#define REST 0.999    /* of the width: a smaller gap is contact */
#define KEEP 0.01     /* tolerance of the impact's position, over the gap above the width */

/* Whether two bodies coincide: then no separation direction exists. */
static PetscBool same_place(const Barrier *b, const PetscInt body[2])
{
  const SbContactSurface m = b->surface;
  PetscReal box[2][6];
  PetscReal most = 0.;

  for (int k = 0; k < 2; k++) {
    SbBoxClear(box[k]);
    for (PetscInt v = 0; v < m->nbody_vertex; v++)
      if (m->part[v] == body[k])
        SbBoxAdd(box[k], b->motion.x + 3 * v);
  }
  for (int i = 0; i < 6; i++)
    most = PetscMax(most, PetscAbsReal(box[0][i] - box[1][i]));
  return (PetscBool)(most < SAME * m->size);
}

PetscErrorCode SbBarrierSeparate(SbEffect e, SbSpace s, PetscReal dt, PetscBool first)
{
  Barrier *b = (Barrier *)e->data;
  const SbContactSurface m = b->surface;
  SbContactOverlap *o = &b->separation.overlap;
  PetscBool inside = PETSC_FALSE;
  PetscInt body[2] = {0, 0};

  PetscFunctionBeginUser;
  b->springs.n = 0;
  if (first && !b->contact.partner.obstacle)
    PetscCall(SbContactSurfaceIsInside(m, b->motion.x, body, &inside));
  PetscCall(SbContactOverlapFind(m, b->motion.x, inside, o));
  PetscCheck(!inside || (o->n && !same_place(b, body)), s->comm, PETSC_ERR_USER_INPUT,
             "The effect %s: body %s is inside body %s when the run begins, or in the same place; "
             "move one of them by "
             "-body_%s_translate",
             e->name, s->mesh->body[body[0]].name, s->mesh->body[body[1]].name,
             s->mesh->body[body[0]].name);
  b->separation.overlapping =
    (PetscBool)(o->ncrossing > 0 && (!first || !o->n || o->deepest > ROUNDING * m->size));

  /* a body wholly inside the obstacle has no separation direction */
  if (first && b->contact.partner.obstacle && !b->separation.overlapping) {
    SbPose pose;

    SbPartnerPose(&b->contact.partner, 0., &pose);
    for (PetscInt v = 0; v < m->nbody_vertex; v++) {
      const char *name = s->mesh->body[m->part[v]].name;
      const PetscReal *x = b->motion.x + 3 * v;
      PetscReal X[3], n[3];

      SbPoseInvert(&pose, x, X);
      PetscCheck(m->driven[v] ||
                   SbObstacleDistance(b->contact.partner.obstacle, X, n) > -SAME * m->size,
                 s->comm, PETSC_ERR_USER_INPUT,
                 "The effect %s: %s is inside the obstacle when the run begins, at (%g, %g, %g) m; "
                 "move it by "
                 "-body_%s_translate",
                 e->name, name, (double)x[0], (double)x[1], (double)x[2], name);
    }
  }
  if (b->pairs->near || b->separation.overlapping)
    b->pairs->known = PETSC_FALSE;
  b->pairs->near = b->separation.overlapping ? o->near : NULL;
  b->motion.known = PETSC_FALSE;
  if (!b->separation.overlapping)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* excludes pairs of gap zero, too, as of a vertex in a triangle */
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    SbDistance d;

    if (SbContactPairGap(m, pair, b->motion.x, &d) > SAME * m->size)
      continue;
    for (int k = 0; k < 4; k++)
      o->near[pair->v[k]] = SB_OVERLAP_INSIDE;
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, o->near, (PetscMPIInt)m->nvertex, MPI_UINT8_T, MPI_MAX, s->comm));
  b->pairs->known = PETSC_FALSE;

  /* warns once, naming what overlaps */
  if (!b->separation.announced) {
    const char *name[2];

    for (int k = 0; k < 2; k++)
      name[k] = o->part[k] < s->mesh->nbody ? s->mesh->body[o->part[k]].name : "the obstacle";
    PetscCheck(
      o->n > 0, s->comm, PETSC_ERR_USER_INPUT,
      "The effect %s: %s and %s overlap at (%g, %g, %g) m, and no separation direction was found: "
      "%" PetscInt_FMT " edges intersect triangles; move one of them by -body_NAME_translate",
      e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2],
      o->ncrossing);
    PetscCall(SbWarning(
      s->comm,
      "The effect %s: %s and %s overlap at (%g, %g, %g) m when the run begins; %" PetscInt_FMT
      " points are up to %g m deep. They are separated gradually (-effect_%s_separation_steps); "
      "until then "
      "they may pass through each other there",
      e->name, name[0], name[1], (double)o->place[0], (double)o->place[1], (double)o->place[2],
      o->n, (double)o->deepest, e->name));
  }
  b->separation.announced = PETSC_TRUE;

  if (e->dynamic)
    SbOverlapBegin(&b->contact.overlap, dt);
  for (PetscInt i = 0; i < o->n; i++) {
    const SbPenetration *p = &o->point[i];
    const PetscInt one = m->part[p->v[0]];
    const PetscInt two = m->part[p->v[p->n - 1]];
    const PetscReal w = PetscMin(b->widths.w[one], b->widths.w[two]);
    const PetscReal k = PetscMin(b->widths.k[one], b->widths.k[two]);
    const PetscReal all = p->depth + 0.5 * w;
    Spring spring = {
      .at = *p, .stiffness = b->separation.stiffer * k * p->area / w * (e->dynamic ? 1. : STIFF)};

    spring.start = SbBarrierSpringPlace(b, &spring);
    spring.goal =
      spring.start +
      (e->dynamic ? PetscMin(all, PetscMax(w, all * (1. - b->contact.overlap.left))) : all);
    PetscCall(SbReserve(b->springs.n + 1, sizeof(spring), &b->springs.size, &b->springs.spring));
    b->springs.spring[b->springs.n++] = spring;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fraction of the motion from x0 to x1 at which the pair's gap falls to w; 2: none. */
static PetscReal meets(const Barrier *b, const SbContactPair *pair, const PetscReal x0[],
                       const PetscReal x1[], PetscReal w)
{
  const SbContactSurface m = b->surface;
  const SbCCDLimits limits = {
    .radius = SbContactPairRadius(m, pair), .separation = w, .keep = KEEP};
  const PetscReal gap = SbContactPairGap(m, pair, x0, &(SbDistance){0});
  PetscReal from[12], to[12], part;

  if (gap < REST * w)
    return 2.;
  if (pair->side) {
    part = gap - SbContactPairGap(m, pair, x1, &(SbDistance){0});
    return part > 0. && part * (1. + EARLY) >= gap - w ? PetscMin(1., (gap - w) / part) : 2.;
  }
  for (int k = 0; k < 12; k++) {
    const PetscInt i = 3 * pair->v[k / 3] + k % 3;

    from[k] = x0[i];
    to[k] = x0[i] + (1. + EARLY) * (x1[i] - x0[i]);
  }
  if (!SbTimeOfImpact(pair->kind, from, to, &limits, &part))
    return 2.;
  return PetscMin(1., part * (1. + EARLY));
}

/* The spring of a pair at the positions x of its impact; false: it does not approach. Vertices with
   positive weights come first, those of bodies before others. */
static PetscBool find_spring(const Barrier *b, const SbContactPair *pair, const PetscReal x[],
                             Spring *spring)
{
  const SbContactSurface m = b->surface;
  const PetscBool turned = (PetscBool)(pair->v[0] >= m->nbody_vertex);
  SbDistance d;

  (void)SbContactPairGap(m, pair, x, &d);
  *spring = (Spring){0};
  for (int pass = 0; pass < 2; pass++) {
    for (int k = 0; k < (pair->side ? 2 : 4); k++) {
      const PetscReal weight = turned ? -d.weight[k] : d.weight[k];

      if (pass ? weight >= 0. : weight <= 0.)
        continue;
      spring->at.v[spring->at.n] = pair->v[k];
      spring->at.weight[spring->at.n++] = weight;
    }
  }
  for (int i = 0; i < 3; i++)
    spring->at.normal[i] = turned ? -d.n[i] : d.n[i];
  spring->start = SbBarrierSpringPlace(b, spring);
  for (PetscInt k = 0; k < spring->at.n; k++)
    spring->approach -=
      spring->at.weight[k] * SbDot3(spring->at.normal, b->motion.other + 3 * spring->at.v[k]);
  spring->approach = (spring->approach + spring->start) / b->contact.bounce.dt;
  return (PetscBool)(spring->approach > 0.);
}

PetscErrorCode SbContactFindImpacts_Barrier(SbContact contact, SbSpace s, PetscReal dt,
                                            const PetscReal u0[], const PetscReal v0[])
{
  Barrier *b = (Barrier *)contact;
  const SbContactSurface m = b->surface;
  PetscReal *u1, *x;

  PetscFunctionBeginUser;
  b->springs.nbounce = 0;
  b->contact.bounce.left = 1.;
  b->contact.bounce.dt = dt;

  /* free flight */
  PetscCall(PetscMalloc2(3 * s->nnode, &u1, 3 * m->nvertex, &x));
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    u1[i] = u0[i] + dt * v0[i];
  PetscCall(SbBarrierUpdate(b, u0));
  PetscCall(SbBarrierPlace(b, u1, 1., b->motion.other));
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.other));

  /* impacts on it */
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PetscReal w = of_pair(b, b->widths.w, pair);
    PetscReal at;
    Spring spring;

    if (SbContactPairSweptApart(m, pair, b->motion.x, b->motion.other, w))
      continue;
    at = meets(b, pair, b->motion.x, b->motion.other, w);
    if (at > 1.)
      continue;
    for (int k = 0; k < (pair->side ? 9 : 12); k++) {
      const PetscInt c = 3 * pair->v[k / 3] + k % 3;

      x[c] = b->motion.x[c] + at * (b->motion.other[c] - b->motion.x[c]);
    }
    if (!find_spring(b, pair, x, &spring))
      continue;
    spring.stiffness = RIGID * of_pair(b, b->widths.mass, pair) / PetscSqr(dt);
    spring.goal = spring.start + SbRestitutionGap(&b->contact.bounce, 0., spring.approach);
    PetscCall(SbReserve(b->springs.n + 1, sizeof(spring), &b->springs.size, &b->springs.spring));
    b->springs.spring[b->springs.n++] = spring;
    b->springs.nbounce++;
  }
  PetscCall(PetscFree2(u1, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactImpactWork_Barrier(SbContact contact, PetscReal *work)
{
  const Barrier *b = (const Barrier *)contact;
  PetscReal push[15];

  PetscFunctionBeginUser;
  for (PetscInt i = b->springs.n - b->springs.nbounce; i < b->springs.n; i++) {
    const Spring *spring = &b->springs.spring[i];

    if (b->surface->own[spring->at.v[0]])
      *work += SbBarrierSpring(b, spring, push) * (SbBarrierSpringPlace(b, spring) - spring->start);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactScaleRestitution_Barrier(SbContact contact, PetscReal share)
{
  Barrier *b = (Barrier *)contact;

  PetscFunctionBeginUser;
  b->contact.bounce.left = share;
  for (PetscInt i = b->springs.n - b->springs.nbounce; i < b->springs.n; i++) {
    Spring *spring = &b->springs.spring[i];

    /* a goal lowered below the spring's deflection would release it: keep it active for the next
       iteration */
    spring->held = (PetscBool)(SbBarrierSpringPlace(b, spring) < spring->goal);
    spring->goal = spring->start + SbRestitutionGap(&b->contact.bounce, 0., spring->approach);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
