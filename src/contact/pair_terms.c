/*
  pair_terms.c - the pairs of surfaces at an iterate, their energy and its
  derivatives, and those of friction, described in surfaces.c.
*/
#include "surfaces.h"

PetscErrorCode SbSurfacesPlace(const Surfaces *b, const PetscReal u[], PetscReal progress,
                               PetscReal x[])
{
  const PetscInt first = 3 * b->surface->nbody_vertex;

  PetscFunctionBeginUser;
  PetscCall(SbContactSurfaceGetPositions(b->surface, u, x));
  for (PetscInt k = first; k < 3 * b->surface->nvertex; k++)
    x[k] = progress == 1. ? b->motion.to[k - first]
                          : b->motion.from[k - first] +
                              progress * (b->motion.to[k - first] - b->motion.from[k - first]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSurfacesUpdate(Surfaces *b, const PetscReal u[])
{
  const PetscInt n = 3 * b->surface->space->nnode_owned;
  PetscBool same;

  PetscFunctionBeginUser;
  if (!b->motion.begun)
    PetscFunctionReturn(PETSC_SUCCESS); /* no pair is active */
  PetscCall(PetscArraycmp(u, b->motion.u, b->motion.known ? n : 0, &same));
  same = (PetscBool)(b->motion.known && same && b->motion.progress == b->contact.base.progress);
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, SB_MPI_BOOL, MPI_LAND, b->surface->space->comm));
  if (same)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArraycpy(b->motion.u, u, n));
  b->motion.progress = b->contact.base.progress;
  b->motion.known = PETSC_TRUE;
  PetscCall(SbSurfacesPlace(b, u, b->contact.base.progress, b->motion.x));
  PetscCall(SbContactPairsFind(b->pairs, b->motion.x, b->motion.x));
  b->active.n = 0;
  for (PetscInt i = 0; i < b->pairs->n; i++) {
    const SbContactPair *pair = &b->pairs->pair[i];
    const PairForce *known = has_multipliers(b) ? SbMultiplierFind(b, pair) : NULL;
    Active a = {.pair = *pair, .force = known ? known->force : 0.};

    if (!known &&
        SbContactPairSweptApart(b->surface, pair, b->motion.x, b->motion.x, b->widths.w[0]))
      continue;
    a.gap = SbContactPairGap(b->surface, pair, b->motion.x, &a.at);
    a.width = width_of(b, pair);
    if (!known && a.gap >= a.width)
      continue;
    PetscCall(
      SbReserve(b->active.n + 1, sizeof(*b->active.pair), &b->active.size, &b->active.pair));
    b->active.pair[b->active.n++] = a;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbPairNormalForce(const Surfaces *b, const Active *a, PetscReal *energy,
                            PetscReal gradient[12])
{
  const SbPairLaw law = SbPairLawOf(b, a);
  PetscReal force = 0.;
  PetscReal w2 = 0.;

  SbPairEnergy(b->surface, &a->pair, &law, a->gap, &a->at, b->motion.x, energy, gradient,
               PETSC_FALSE, NULL);
  for (int k = 0; k < 4; k++) {
    force -= a->at.weight[k] * SbDot3(gradient + 3 * k, a->at.n);
    w2 += PetscSqr(a->at.weight[k]);
  }
  return PetscMax(0., force / w2);
}

/* f += sign times the gradient of n vertices, distributed to their owned nodes, N. */
static void spread(const Surfaces *b, PetscInt n, const PetscInt vertex[], PetscReal sign,
                   const PetscReal gradient[], PetscReal f[])
{
  const SbContactSurface m = b->surface;

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt v = vertex[k];

    if (v >= m->nbody_vertex)
      continue;
    for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
      if (m->node[j] < 0 || m->node[j] >= m->space->nnode_owned)
        continue;
      for (int i = 0; i < 3; i++)
        f[3 * m->node[j] + i] += sign * m->weight[j] * gradient[3 * k + i];
    }
  }
}

/* An equilibrium gap g is proportional to the width w, so the error of the state is w du/dw to
   first order: (K + H) w du/dw = sum b'' g n, H the Hessian of the barrier. Its sign does not
   matter here. */
PetscErrorCode SbContactGapForces_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                           PetscReal f[], PetscReal *bound)
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbSurfacesUpdate(b, u));
  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    const SbContactPair *pair = &a->pair;
    const SbPairLaw law = SbPairLawOf(b, a);
    PetscReal d[3], energy, gradient[12];
    const PetscReal force = SbPairNormalForce(b, a, &energy, gradient);
    PetscReal part;

    SbPairLawEvaluate(&law, a->gap, pair->area, d);
    if (d[1] >= 0.)
      continue;
    if (counts(b, pair))
      *bound += 0.5 * force * a->gap;
    part = d[0] != 0. ? energy / d[0] : 1.; /* nearly parallel edges count less */
    for (int k = 0; k < 12; k++)
      gradient[k] = part * d[2] * a->gap * a->at.weight[k / 3] * a->at.n[k % 3];
    spread(b, pair->side ? 1 : 4, pair->v, 1., gradient, f);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbPairTerm(const Surfaces *b, PetscInt i, Term *t)
{
  const PetscInt k = i - b->active.n;

  if (k < b->friction.pairs.n) {
    const Active *a = k < 0 ? &b->active.pair[i] : &b->friction.pairs.pair[k].on;

    t->n = 4;
    t->nfirst = SbContactPairSplit(&a->pair);
    t->v = a->pair.v;
    t->counts = counts(b, &a->pair);
    t->weight = a->at.weight;
    t->normal = a->at.n;
    t->force = 0.;
    if (k < 0)
      t->force = SbPairNormalForce(b, a, &t->energy, t->gradient);
    else {
      const FrictionPair *friction = &b->friction.pairs.pair[k];
      const PetscReal most = PetscSqr(friction->force) / friction->stiffness;
      PetscReal q[3];
      const PetscReal p = SbPairSticking(b, friction, q);

      for (int c = 0; c < 12; c++)
        t->gradient[c] = SbPairFrictionFactor(b, p) * t->weight[c / 3] * q[c % 3];
      if (b->options.sticks)
        t->energy = most * (p < 1. ? 0.5 * p * p : p - 0.5) -
                    0.5 * SbDot3(friction->tangent, friction->tangent) / friction->stiffness;
      else
        t->energy = most * (p < 1. ? p * p - p * p * p / 3. + 1. / 3. : p);
    }
  } else {
    const Spring *spring = &b->springs.spring[k - b->friction.pairs.n];

    t->n = spring->at.n;
    for (t->nfirst = 0; t->nfirst < t->n && spring->at.weight[t->nfirst] > 0.; t->nfirst++)
      continue;
    t->v = spring->at.v;
    t->weight = spring->at.weight;
    t->normal = spring->at.normal;
    t->counts = counts_spring(b, spring);
    t->force = SbSpringForce(b, spring, t->gradient);
    t->energy = 0.5 * t->force * (spring->goal - SbSpringPlace(b, spring));
  }
}

/* f += sign times the gradient of all energies at the current positions, N; returns this rank's
   sum, J. */
PetscReal SbSurfacesAddGradient(const Surfaces *b, PetscReal sign, PetscReal f[])
{
  PetscReal sum = 0.;

  for (PetscInt i = 0; i < nterm(b); i++) {
    Term t;

    SbPairTerm(b, i, &t);
    spread(b, t.n, t.v, sign, t.gradient, f);
    if (t.counts)
      sum += t.energy;
  }
  return sum;
}

PetscErrorCode SbEffectForce_Surfaces(SbEffect e, SbSpace s, const SbStage *stage, PetscReal f[])
{
  Surfaces *b = (Surfaces *)e->data;

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbSurfacesUpdate(b, stage->u));
  (void)SbSurfacesAddGradient(b, -1., f);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactGradient_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                          PetscReal *energy, PetscReal f[])
{
  Surfaces *b = (Surfaces *)contact;

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbSurfacesUpdate(b, u));
  *energy += SbSurfacesAddGradient(b, 1., f);

  /* pairs whose slip has reversed since the Hessian was evaluated */
  for (PetscInt i = 0; i < b->friction.pairs.n; i++) {
    PetscReal slip[3];

    (void)SbPairSlip(b, &b->friction.pairs.pair[i], slip);
    if (SbDot3(slip, b->friction.pairs.pair[i].slip) < 0.)
      b->friction.pairs.pair[i].turns = PETSC_TRUE;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the blocks of a Hessian by n vertices where one of both has nodes here; H[144], or with
   `weight` H[9] with respect to the weighted sum of positions. */
static PetscErrorCode add_blocks(Surfaces *b, PetscInt n, const PetscInt vertex[],
                                 const PetscReal weight[], const PetscReal H[])
{
  const SbContactSurface m = b->surface;

  PetscFunctionBeginUser;
  for (PetscInt p = 0; p < n; p++) {
    for (PetscInt q = p; q < n; q++) {
      const PetscInt v = vertex[p];
      const PetscInt w = vertex[q];
      PetscReal block[9];

      if (v >= m->nbody_vertex || w >= m->nbody_vertex || !(m->mine[v] | m->mine[w]))
        continue;
      for (int k = 0; weight && k < 9; k++)
        block[k] = weight[p] * weight[q] * H[k];
      PetscCall(
        SbContactBlocksAdd(&b->blocks, v, w, weight ? block : H + 36 * p + 3 * q, weight ? 3 : 12));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A pair of nearly parallel edges, which counts less, and one that is pressed together, have no
   row. */
SbPairLaw SbPairMatrixLaw(const Surfaces *b, const Active *a, PetscBool *row)
{
  SbPairLaw law = SbPairLawOf(b, a);
  PetscReal d[3];

  *row = PETSC_FALSE;
  if (!is_exact(b) || a->gap < SB_GUARD * law.width ||
      SbPairIsMollified(b->surface, &a->pair, a->gap, &a->at, b->motion.x))
    return law;
  SbPairLawEvaluate(&law, a->gap, a->pair.area, d);
  *row = (PetscBool)(d[1] < 0.);
  law.force = -d[1];
  law.width = a->gap;
  law.stiffness /= STIFFER;
  return law;
}

PetscErrorCode SbContactHessian_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                         SbContactHessian kind, SbBlocks *blocks, PetscReal r[])
{
  Surfaces *b = (Surfaces *)contact;
  PetscReal energy, gradient[12], H[144];

  PetscFunctionBeginUser;
  (void)s;
  PetscCall(SbSurfacesUpdate(b, u));

  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    PetscBool row;
    const SbPairLaw law = SbPairMatrixLaw(b, a, &row);

    SbPairEnergy(b->surface, &a->pair, &law, a->gap, &a->at, b->motion.x, &energy, gradient,
                 (PetscBool)(kind != SB_HESSIAN_EXACT), H);
    PetscCall(add_blocks(b, a->pair.side ? 1 : 4, a->pair.v, NULL, H));
  }

  /* friction a q, its derivative by the slip c (a (I - n n - q q/q^2) + (a p)' q q/q^2); a bound
     from above has a instead of (a p)'. A sliding pair whose slip reversed in the last trial step
     is treated as sticking, with the force q. If a full step leaves it beyond mu N, it slides. */
  for (PetscInt i = 0; i < b->friction.pairs.n; i++) {
    FrictionPair *friction = &b->friction.pairs.pair[i];
    PetscReal T[9], q[3];
    const PetscReal p = SbPairSticking(b, friction, q);
    PetscReal factor = SbPairFrictionFactor(b, p);
    const PetscBool slides = (PetscBool)(p >= (b->options.sticks ? SLIDES : 1.));
    PetscReal curve = 0.;

    if (!slides)
      curve = b->options.sticks ? 1. : 2. - 2. * p;
    (void)SbPairSlip(b, friction, friction->slip);
    friction->sticks =
      (PetscBool)(slides && kind != SB_HESSIAN_MAJORIZED &&
                  (friction->turns || (friction->sticks && kind != SB_HESSIAN_EXACT)));
    friction->turns = PETSC_FALSE;
    if (friction->sticks) {
      PetscReal force[12];

      for (int k = 0; k < 12; k++)
        force[k] = (1. - factor) * friction->on.at.weight[k / 3] * q[k % 3];
      spread(b, friction->on.pair.side ? 1 : 4, friction->on.pair.v, 1., force, r);
      factor = curve = 1.;
    } else if (kind == SB_HESSIAN_MAJORIZED)
      curve = factor;
    for (int k = 0; k < 9; k++) {
      T[k] = factor * ((k % 4 ? 0. : 1.) - friction->on.at.n[k / 3] * friction->on.at.n[k % 3]);
      if (p > 0.)
        T[k] += (curve - factor) * q[k / 3] * q[k % 3] / PetscSqr(p * friction->force);
      T[k] *= friction->stiffness / (SbFrictionSticks(b, friction, p) ? STIFFER : 1.);
    }
    PetscCall(add_blocks(b, friction->on.pair.side ? 1 : 4, friction->on.pair.v,
                         friction->on.at.weight, T));
  }

  /* active springs */
  for (PetscInt i = 0; i < b->springs.n; i++) {
    const Spring *spring = &b->springs.spring[i];
    PetscReal T[9];

    if (!spring->held && SbSpringPlace(b, spring) >= spring->goal)
      continue;
    for (int k = 0; k < 9; k++)
      T[k] = spring->stiffness * spring->at.normal[k / 3] * spring->at.normal[k % 3];
    PetscCall(add_blocks(b, spring->at.n, spring->at.v, spring->at.weight, T));
  }
  PetscCall(SbContactBlocksToNodes(b->surface, &b->blocks, blocks));
  PetscFunctionReturn(PETSC_SUCCESS);
}
