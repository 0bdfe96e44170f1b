/*
  friction_pairs.c - friction of pairs: -effect_X_sticking exact by multipliers (multipliers.c),
  smooth by the energy of surfaces.c.

  Normal forces and slip directions of friction are those of an earlier state y: the start of the
  step, or the solve before. A solution x has the friction F(x; y) instead of F(x; x). The lag is
  sum |F(x; x) - F(x; y)| over the nodes, relative to the sum of mu N over the pairs: the change of
  normal forces, closest points and slip directions. Fixed-point iterations, one solve each, end
  when it is small (Li et al. 2020, section 5.7). They converge if a change of friction changes
  normal forces by less than itself.
*/
#include "surfaces.h"

#define LAGS 100 /* largest number of lagged-friction iterations of a load step */
#define STUCK \
  5 /* successive solutions whose lag stays above FALLS times the least: it does not converge */
#define FALLS 0.9
#define MUCH \
  0.5 /* lag over mu N above which a time step is solved once more, as where contact begins */
#define PARTINGS 20 /* solves of a load step that separate overlaps */

/* Its multiplier, turned to the tangent plane of now and within Coulomb's limit. */
static void find_tangent(const Surfaces *b, FrictionPair *friction)
{
  const PairForce *known = SbMultiplierFind(b, &friction->on.pair);
  const PetscReal *n = friction->on.at.n;
  PetscReal length;

  if (!known)
    return;
  for (int i = 0; i < 3; i++)
    friction->tangent[i] = known->tangent[i] - SbDot3(known->tangent, n) * n[i];
  length = PetscSqrtReal(SbDot3(friction->tangent, friction->tangent));
  for (int i = 0; i < 3 && length > friction->force; i++)
    friction->tangent[i] *= friction->force / length;
}

/* Displacement in the step of the obstacle's contact point by rotation, beyond that of its
   vertices. */
static void find_rotation(const Surfaces *b, PetscBool end, FrictionPair *friction)
{
  const SbContactSurface m = b->surface;
  const PetscInt *v = friction->on.pair.v;
  const PetscReal *weight = friction->on.at.weight;
  const PetscReal *n = friction->on.at.n;
  PetscReal X[3];
  PetscReal at[3] = {0};
  PetscReal other[3];
  PetscReal sign = 0.;

  for (int k = 0; k < 4; k++) {
    if (v[k] >= m->nbody_vertex || weight[k] == 0.)
      continue;
    sign = weight[k] > 0. ? 1. : -1.;
    for (int i = 0; i < 3; i++)
      at[i] += PetscAbsReal(weight[k]) * b->motion.x[3 * v[k] + i];
  }
  for (int i = 0; i < 3; i++)
    at[i] -= sign * friction->on.gap * n[i];
  SbPoseInvert(&b->contact.partner.pose[end], at, X);
  SbPoseApply(&b->contact.partner.pose[!end], X, other);
  for (int i = 0; i < 3; i++)
    friction->rotation[i] = sign * (end ? at[i] - other[i] : other[i] - at[i]);
  for (int k = 0; k < 4; k++) {
    const PetscInt o = 3 * (v[k] - m->nbody_vertex);

    for (int i = 0; i < 3 && o >= 0; i++)
      friction->rotation[i] += weight[k] * (b->motion.to[o + i] - b->motion.from[o + i]);
  }
}

PetscErrorCode SbSurfacesFindFriction(Surfaces *b, PetscBool end)
{
  PetscFunctionBeginUser;
  b->friction.next.n = 0;
  for (PetscInt i = 0; b->contact.friction.mu > 0. && i < b->active.n; i++) {
    PetscReal energy, gradient[12];
    FrictionPair friction = {.on = b->active.pair[i]};

    friction.force = b->contact.friction.mu * SbPairNormalForce(b, &friction.on, &energy, gradient);
    if (friction.force <= 0.)
      continue;
    friction.stiffness = friction.force / b->friction.slip;
    if (b->options.sticks) {
      friction.stiffness =
        (is_exact(b) ? STIFFER : 1.) *
        of_pair(b, is_barrier(b) ? b->widths.spring : b->widths.k, &friction.on.pair) *
        friction.on.pair.area;
      find_tangent(b, &friction);
    }
    if (b->contact.partner.obstacle)
      find_rotation(b, end, &friction);
    PetscCall(SbReserve(b->friction.next.n + 1, sizeof(*b->friction.next.pair),
                        &b->friction.next.size, &b->friction.next.pair));
    b->friction.next.pair[b->friction.next.n++] = friction;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSurfacesSwapFriction(Surfaces *b)
{
  const FrictionPairs friction = b->friction.pairs;

  b->friction.pairs = b->friction.next;
  b->friction.next = friction;
}

PetscErrorCode SbSurfacesLag(Surfaces *b)
{
  const SbSpace s = b->surface->space;
  PetscReal *f;
  PetscReal sum[2] = {0.};

  PetscFunctionBeginUser;
  PetscCall(SbSurfacesFindFriction(b, PETSC_TRUE));

  /* the normal forces cancel */
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  (void)SbSurfacesAddGradient(b, 1., f);
  SbSurfacesSwapFriction(b);
  (void)SbSurfacesAddGradient(b, -1., f);
  SbSurfacesSwapFriction(b);
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    sum[0] += PetscSqrtReal(SbDot3(f + 3 * i, f + 3 * i));
  for (PetscInt i = 0; i < b->friction.next.n; i++)
    sum[1] += counts(b, &b->friction.next.pair[i].on.pair) ? b->friction.next.pair[i].force : 0.;
  PetscCall(PetscFree(f));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, s->comm));
  b->friction.lag = sum[1] > 0. ? sum[0] / sum[1] : 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether friction of the last solution differs from that of the next one by more than it may, and
   a further solve may help. */
static PetscErrorCode needs_more(SbEffect e, Surfaces *b, PetscBool last, PetscBool solved,
                                 PetscBool *more)
{
  PairFriction *f = &b->friction;
  const PetscReal most =
    e->dynamic && !b->options.friction_solves ? MUCH : b->options.friction_tolerance;

  PetscFunctionBeginUser;
  PetscCall(SbSurfacesLag(b));
  if (f->lag < FALLS * f->least) {
    f->least = f->lag;
    f->nstuck = 0;
  } else
    f->nstuck += solved;
  *more = (PetscBool)(!last && f->nstuck < STUCK && f->lag > most);
  if (*more || e->dynamic || f->said || f->lag <= b->options.friction_tolerance)
    PetscFunctionReturn(PETSC_SUCCESS);
  f->said = PETSC_TRUE;
  PetscCall(SbWarning(
    b->surface->space->comm,
    "effect %s: friction does not settle, from solve to solve its forces change by %.2g of "
    "Coulomb's limit; try more -static_steps, or motion (-time euler_implicit)",
    e->name, (double)f->lag));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a solve: friction takes the normal forces and directions of the solution, while its lag is
   large. How many solves a step may have: those of the option; a time step two, both of solutions;
   a load step LAGS, of which the first ones separate overlaps. */
PetscErrorCode SbContactUpdateFriction_Surfaces(SbContact contact, SbSpace s, const PetscReal u[],
                                                PetscBool solved, PetscBool *again)
{
  Surfaces *b = (Surfaces *)contact;
  const SbEffect e = contact->effect;
  const PetscInt given = b->options.friction_solves;
  const PetscInt most = e->dynamic ? 2 : LAGS;
  const PetscBool parts = (PetscBool)(!e->dynamic && b->separation.overlapping);
  PetscBool last, more;

  PetscFunctionBeginUser;
  if (b->contact.friction.mu <= 0. && !parts)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (e->dynamic && !given && !solved)
    PetscFunctionReturn(PETSC_SUCCESS);
  last = (PetscBool)(++b->friction.nlag >= (given ? given : most));
  if (last && (given || e->dynamic))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSurfacesUpdate(b, u));

  /* in a static run overlaps are separated within the step */
  if (parts && b->friction.nlag < PARTINGS) {
    PetscCall(SbSurfacesSeparate(e, s, 0., PETSC_FALSE, PETSC_FALSE));
    b->separation.parted = *again = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(needs_more(e, b, last, solved, &more));
  if (!more)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbSurfacesSwapFriction(b);
  *again = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
