/*
  multipliers.c - multipliers of pairs, of the responses `augmented`, `projected` and `multiplier`.

  The constraint of a pair is g >= 0, g its gap beyond the one that it keeps. Its force is that of
  the augmented Lagrangian, <l - c g>, with the multiplier l and the stiffness c = k area
  (pair_energy.c). The forces of a solution become the multipliers of the next solve of the step,
  until they stay (Simo and Laursen 1992): the method of multipliers (Nocedal and Wright, section
  17.4), whose Newton iterations find the active set l - c g > 0 (a semismooth Newton method:
  Hueeber and Wohlmuth, A primal-dual active set strategy for non-linear multibody contact problems,
  CMAME 194, 2005). It takes what redundant constraints, as of surfaces that lie flat on each
  other, leave open.

  Friction likewise: q = t + c u of the slip u since the start of the step, with the multiplier t,
  is the force of a pair that sticks, and what exceeds mu N of it slips (Simo and Laursen). At the
  end t stays, so that u = 0 where a pair sticks. N and directions are those of the solution before.
*/
#include "barrier.h"

#define SETTLED 1e-3     /* tolerance of gaps, over those that are kept */
#define EXACT 1e-10      /* the same of exact constraints in static runs */
#define EXACT_STEPS 1e-5 /* and in time steps */
#define UPDATES 100      /* most updates of multipliers in a step */
#define FALLS 0.9        /* the worst gap falls to this part in ... */
#define STUCK 3          /* ... updates; else it settles no further */
#define LOOSE 0.1        /* then the tolerance without a warning */

static void find_key(const Barrier *b, const SbContactPair *pair, PetscInt key[PAIR_KEY])
{
  key[0] = pair->side;
  key[1] = pair->kind;
  for (int k = 0; k < 4; k++)
    key[2 + k] = SbContactNumber(b->surface, pair->v[k]);
}

static int compare(const PetscInt p[PAIR_KEY], const PetscInt q[PAIR_KEY])
{
  for (int k = 0; k < PAIR_KEY; k++)
    if (p[k] != q[k])
      return p[k] < q[k] ? -1 : 1;
  return 0;
}

static int by_pair(const void *p, const void *q)
{
  return compare(((const PairForce *)p)->key, ((const PairForce *)q)->key);
}

const PairForce *SbMultiplierFind(const Barrier *b, const SbContactPair *pair)
{
  const Multipliers *m = &b->multipliers;
  PetscInt key[PAIR_KEY];
  PetscInt low = 0;
  PetscInt high = m->n;

  find_key(b, pair, key);
  while (low < high) {
    const PetscInt middle = (low + high) / 2;
    const int order = compare(key, m->pair[middle].key);

    if (!order)
      return &m->pair[middle];
    if (order < 0)
      high = middle;
    else
      low = middle + 1;
  }
  return NULL;
}

/* The table of all ranks from entries that each rank counts. Collective. */
static PetscErrorCode share(Barrier *b, PetscInt n, const PairForce mine[])
{
  Multipliers *m = &b->multipliers;
  const PetscInt size = (PetscInt)sizeof(*mine);
  PairForce *all;
  PetscInt total;

  PetscFunctionBeginUser;
  PetscCall(SbAllgatherv(b->surface->space->comm, MPI_BYTE, n * size, mine, &total, &all, NULL));
  m->n = total / size;
  PetscCall(SbReserve(m->n, sizeof(*all), &m->size, &m->pair));
  PetscCall(PetscArraycpy(m->pair, all, m->n));
  PetscCall(PetscFree(all));
  if (m->n)
    qsort(m->pair, (size_t)m->n, sizeof(*m->pair), by_pair);
  b->motion.known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMultipliersUpdate(Barrier *b, PetscBool *again)
{
  const MPI_Comm comm = b->surface->space->comm;
  Multipliers *m = &b->multipliers;
  const PetscReal exact = b->contact.base.effect->dynamic ? EXACT_STEPS : EXACT;
  const PetscReal usual = is_exact(b) ? exact : SETTLED;
  const PetscReal tolerance = b->options.settled > 0. ? b->options.settled : usual;
  PetscReal worst = 0.;
  PairForce *mine;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(b->active.n, &mine));

  /* normal forces */
  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    const SbPairLaw law = SbPairLawOf(b, a);
    PetscReal d[3], wrong;

    if (!counts(b, &a->pair))
      continue;
    SbPairLawEvaluate(&law, a->gap, a->pair.area, d);
    if (d[1] == 0. && a->force == 0.)
      continue;
    wrong = PetscAbsReal(d[1] + a->force) / (law.stiffness * a->pair.area * law.width);
    worst = PetscMax(worst, wrong);
    if (d[1] >= 0.)
      continue;
    mine[n] = (PairForce){.force = -d[1]};
    find_key(b, &a->pair, mine[n++].key);
  }
  qsort(mine, (size_t)n, sizeof(*mine), by_pair);

  /* friction */
  for (PetscInt i = 0; i < b->friction.pairs.n; i++) {
    const FrictionPair *friction = &b->friction.pairs.pair[i];
    const PetscReal scale = friction->stiffness * of_pair(b, b->widths.w, &friction->on.pair);
    PetscReal q[3];
    const PetscReal factor = SbBarrierFactor(b, SbBarrierSticking(b, friction, q));
    PairForce at, *with;

    if (!counts(b, &friction->on.pair))
      continue;
    find_key(b, &friction->on.pair, at.key);
    with = n ? (PairForce *)bsearch(&at, mine, (size_t)n, sizeof(*mine), by_pair) : NULL;
    for (int k = 0; k < 3; k++) {
      q[k] *= factor;
      if (with)
        with->tangent[k] = q[k];
      q[k] -= friction->tangent[k];
    }
    worst = PetscMax(worst, PetscSqrtReal(SbDot3(q, q)) / scale);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPI_MAX, comm));
  PetscCall(
    PetscInfo(NULL, "multipliers, update %" PetscInt_FMT ": gaps are wrong by %g of their width\n",
              m->updates, (double)worst));
  if (!m->updates || worst < FALLS * m->least) {
    m->least = worst;
    m->stuck = 0;
  } else
    m->stuck++;
  if (worst > tolerance && m->stuck < STUCK && m->updates < UPDATES) {
    m->updates++;
    PetscCall(share(b, n, mine));
    PetscCall(SbBarrierFindFriction(b, PETSC_TRUE));
    SbBarrierSwapFriction(b);
    *again = PETSC_TRUE;
  } else if (worst > LOOSE && !m->said) {
    m->said = PETSC_TRUE;
    PetscCall(SbWarning(comm,
                        "effect %s: after %" PetscInt_FMT
                        " updates of its multipliers gaps are wrong by %.2g of the width of %.3g "
                        "m; said once: a larger -effect_%s_stiffness settles sooner",
                        b->contact.base.effect->name, m->updates, (double)worst,
                        (double)b->widths.w[0], b->contact.base.effect->name));
  }
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMultipliersKeep(Multipliers *m)
{
  PetscFunctionBeginUser;
  m->nkept = m->n;
  PetscCall(SbReserve(m->n, sizeof(*m->kept), &m->kept_size, &m->kept));
  PetscCall(PetscArraycpy(m->kept, m->pair, m->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMultipliersRestore(Barrier *b)
{
  Multipliers *m = &b->multipliers;

  PetscFunctionBeginUser;
  m->updates = 0;
  m->n = m->nkept;
  PetscCall(SbReserve(m->n, sizeof(*m->pair), &m->size, &m->pair));
  PetscCall(PetscArraycpy(m->pair, m->kept, m->n));
  if (has_multipliers(b))
    b->motion.known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
