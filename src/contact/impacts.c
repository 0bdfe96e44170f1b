/*
  impacts.c - restitution of pairs by one-sided springs along fixed directions (separation.c).

  Restitution (its energy: restitution.c). At the start of a step the vertices are moved
  in free flight. A pair whose gap falls to the barrier's width, or nearly, on this path has the
  direction n and the weights of its closest points there, and the speed of approach v = -n . sum
  weight v. In this step a spring holds it at or above

      n . sum weight x = g0 + h e v,   g0 the same sum when the step begins,

  which is stiff relative to the lighter body, as whole bodies collide. Pairs already within the
  width get none, so that a body at rest stays at rest.

  The law is for bodies that are stiff within a step. A body of the length L, the cube root of its
  volume, with the wave speed c = sqrt(E / density) rebounds with e - 2.8 e (1 + e) (L / c h)^2 of
  the relative speed, as measured with two balls; the rest is in vibrations, which implicit Euler
  dissipates (docs/reports/contact.md).
*/
#include "surfaces.h"

#define RIGID 1e5  /* restitution: stiffness over mass of the lighter body / dt^2 */
#define EARLY 0.05 /* extension of the path over its length: near misses count as impacts */
#define REST 0.999 /* of the width: a smaller gap is contact */
#define KEEP 0.01  /* tolerance of the impact's position, over the gap above the width */

/* Fraction of the motion from x0 to x1 at which the pair's gap falls to w; 2: none. */
static PetscReal meets(const Surfaces *b, const SbContactPair *pair, const PetscReal x0[],
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
static PetscBool find_spring(const Surfaces *b, const SbContactPair *pair, const PetscReal x[],
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
  spring->start = SbSpringPlace(b, spring);
  for (PetscInt k = 0; k < spring->at.n; k++)
    spring->approach -=
      spring->at.weight[k] * SbDot3(spring->at.normal, b->motion.other + 3 * spring->at.v[k]);
  spring->approach = (spring->approach + spring->start) / b->contact.bounce.dt;
  return (PetscBool)(spring->approach > 0.);
}

/* Says which body of an impact is not stiff within a step of length dt. Collective. */
static PetscErrorCode warn_of_soft(Surfaces *b, PetscReal dt)
{
  const SbSpace s = b->surface->space;
  PetscReal least = PETSC_INFINITY;
  PetscInt which = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = b->springs.n - b->springs.nbounce; i < b->springs.n; i++) {
    for (PetscInt k = 0; k < b->springs.spring[i].at.n; k++) {
      const PetscInt body = b->surface->part[b->springs.spring[i].at.v[k]];
      const PetscReal crossings =
        body < s->mesh->nbody ? SbRestitutionCrossings(s, body, dt) : PETSC_INFINITY;

      which = crossings < least ? body : which;
      least = PetscMin(least, crossings);
    }
  }
  PetscCall(SbRestitutionWarnSoft(b->contact.base.effect, &b->contact.bounce, s, dt, least, which));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactFindImpacts_Surfaces(SbContact contact, SbSpace s, PetscReal dt,
                                             const PetscReal u0[], const PetscReal v0[])
{
  Surfaces *b = (Surfaces *)contact;
  const SbContactSurface m = b->surface;
  PetscReal *u1, *x;

  PetscFunctionBeginUser;
  b->springs.nbounce = 0;
  b->contact.bounce.left = 1.;
  b->contact.bounce.dt = dt;

  /* free flight */
  PetscCall(PetscMalloc1(3 * s->nnode, &u1));
  for (PetscInt i = 0; i < 3 * s->nnode; i++)
    u1[i] = u0[i] + dt * v0[i];
  PetscCall(SbSurfacesUpdate(b, u0));
  PetscCall(SbSurfacesPlace(b, u1, 1., b->motion.other));
  PetscCall(PetscFree(u1));
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.other));
  PetscCall(PetscMalloc1(3 * m->nvertex, &x));

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
    spring.at.number = b->springs.n;
    PetscCall(SbReserve(b->springs.n + 1, sizeof(spring), &b->springs.size, &b->springs.spring));
    b->springs.spring[b->springs.n++] = spring;
    b->springs.nbounce++;
  }
  PetscCall(PetscFree(x));
  PetscCall(warn_of_soft(b, dt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactImpactWork_Surfaces(SbContact contact, PetscReal *work)
{
  const Surfaces *b = (const Surfaces *)contact;
  PetscReal push[15];

  PetscFunctionBeginUser;
  for (PetscInt i = b->springs.n - b->springs.nbounce; i < b->springs.n; i++) {
    const Spring *spring = &b->springs.spring[i];

    if (counts_spring(b, spring))
      *work += SbSpringForce(b, spring, push) * (SbSpringPlace(b, spring) - spring->start);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactScaleRestitution_Surfaces(SbContact contact, PetscReal share)
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  b->contact.bounce.left = share;
  for (PetscInt i = b->springs.n - b->springs.nbounce; i < b->springs.n; i++) {
    Spring *spring = &b->springs.spring[i];

    /* a goal lowered below the spring's deflection would release it: keep it active for the next
       iteration */
    spring->held = (PetscBool)(SbSpringPlace(b, spring) < spring->goal);
    spring->goal = spring->start + SbRestitutionGap(&b->contact.bounce, 0., spring->approach);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
