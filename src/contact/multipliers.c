/*
  multipliers.c - multipliers of pairs: of gaps with augmented, projected and multiplier; of
  friction.

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
#include "surfaces.h"

#define SETTLED 1e-3     /* tolerance of gaps, over those that are kept */
#define EXACT 1e-10      /* the same of exact constraints in static runs */
#define EXACT_STEPS 1e-5 /* and in time steps */
#define UPDATES 100      /* most updates of multipliers in a step */
#define LOOSE 0.1        /* then the tolerance, for a step to be accepted all the same */
#define FALLS 0.9        /* the worst gap falls to this part in ... */
#define STUCK 3          /* ... updates; else a loose one settles no further */

/* What multipliers are wrong by, over the width, and where. */
typedef struct {
  PetscReal by;
  PetscInt body[2];
  PetscReal x[3];
} Wrong;

static void find_worse(const Surfaces *b, const SbContactPair *pair, PetscReal by, Wrong *worst)
{
  if (by <= worst->by)
    return;
  worst->by = by;
  worst->body[0] = b->surface->part[pair->v[0]];
  worst->body[1] = b->surface->part[pair->v[SbContactPairSplit(pair)]];
  for (int k = 0; k < 3; k++)
    worst->x[k] = b->motion.x[3 * pair->v[0] + k];
}

/* mine[n], in order: the forces of a solution, of pairs that this rank counts; the caller frees. */
static PetscErrorCode find_forces(const Surfaces *b, PetscInt *n, PairForce **mine, Wrong *worst)
{
  PairForce *list;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(b->active.n, mine));
  list = *mine;
  *n = 0;
  *worst = (Wrong){.by = 0.};

  /* normal forces */
  for (PetscInt i = 0; i < b->active.n; i++) {
    const Active *a = &b->active.pair[i];
    const SbPairLaw law = SbPairLawOf(b, a);
    SbPairLaw constraint = law; /* without what bears a pair that is pressed together */
    PetscReal d[3], c[3];

    if (!counts(b, &a->pair))
      continue;
    SbPairLawEvaluate(&law, a->gap, a->pair.area, d);
    if (d[1] == 0. && a->force == 0.)
      continue;
    constraint.guard = 0.;
    SbPairLawEvaluate(&constraint, a->gap, a->pair.area, c);
    if (has_multipliers(b))
      find_worse(b, &a->pair,
                 PetscAbsReal(c[1] + a->force) / (law.stiffness * a->pair.area * law.width), worst);
    if (d[1] >= 0.)
      continue;
    list[*n] = (PairForce){.force = -d[1]};
    SbPairKey(b, &a->pair, list[(*n)++].key);
  }
  if (*n)
    qsort(list, (size_t)*n, sizeof(*list), SbPairForceOrder);

  /* friction */
  for (PetscInt i = 0; i < b->friction.pairs.n && b->options.sticks; i++) {
    const FrictionPair *friction = &b->friction.pairs.pair[i];
    const PetscReal scale = friction->stiffness * of_pair(b, b->widths.w, &friction->on.pair);
    PetscReal q[3];
    const PetscReal factor = SbPairFrictionFactor(b, SbPairSticking(b, friction, q));
    PairForce at, *with;

    if (!counts(b, &friction->on.pair))
      continue;
    SbPairKey(b, &friction->on.pair, at.key);
    with = *n ? (PairForce *)bsearch(&at, list, (size_t)*n, sizeof(*list), SbPairForceOrder) : NULL;
    for (int k = 0; k < 3; k++) {
      q[k] *= factor;
      if (with)
        with->tangent[k] = q[k];
      q[k] -= friction->tangent[k];
    }
    find_worse(b, &friction->on.pair, PetscSqrtReal(SbDot3(q, q)) / scale, worst);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The table of all ranks from entries that each rank counts. Collective. */
static PetscErrorCode share(const Surfaces *b, PetscInt n, const PairForce mine[],
                            PairForces *table)
{
  const PetscInt size = (PetscInt)sizeof(*mine);
  PairForce *all;
  PetscInt total;

  PetscFunctionBeginUser;
  PetscCall(SbAllgatherv(b->surface->space->comm, MPI_BYTE, n * size, mine, &total, &all, NULL));
  table->n = total / size;
  PetscCall(SbReserve(table->n, sizeof(*all), &table->size, &table->pair));
  PetscCall(PetscArraycpy(table->pair, all, table->n));
  PetscCall(PetscFree(all));
  if (table->n)
    qsort(table->pair, (size_t)table->n, sizeof(*table->pair), SbPairForceOrder);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces that are not settled: a step with multipliers of gaps fails, or goes on with a warning, as
   others of friction alone do. */
static PetscErrorCode complain(Surfaces *b, const Wrong *worst, PetscBool fails)
{
  const SbSpace s = b->surface->space;
  const SbEffect e = b->contact.base.effect;
  struct {
    double by;
    int rank;
  } most = {worst->by, s->rank};
  Wrong at = *worst;
  const char *name[2];
  char text[384];

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE_INT, MPI_MAXLOC, s->comm));
  PetscCallMPI(MPI_Bcast(&at, (PetscMPIInt)sizeof(at), MPI_BYTE, most.rank, s->comm));
  for (int k = 0; k < 2; k++)
    name[k] = at.body[k] < s->mesh->nbody ? s->mesh->body[at.body[k]].name : "the obstacle";
  SbFormat(sizeof(text), text,
           "effect %s: after %" PetscInt_FMT
           " updates the multipliers of %s with %s near (%g, %g, %g) m are wrong by %.2g of the "
           "width of %.3g m",
           e->name, b->multipliers.updates, name[0], name[1], (double)at.x[0], (double)at.x[1],
           (double)at.x[2], (double)at.by, (double)b->widths.w[0]);
  if (has_multipliers(b) && fails)
    SbFormat(sizeof(b->contact.base.unsettled), b->contact.base.unsettled,
             "%s, and settle no further: -effect_%s_response barrier needs none; "
             "-effect_%s_multiplier_tolerance %.1g goes on all the same",
             text, e->name, e->name, 2. * (double)at.by);
  else if (!b->multipliers.said) {
    b->multipliers.said = PETSC_TRUE;
    PetscCall(SbWarning(s->comm, "%s; said once", text));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMultipliersUpdate(Surfaces *b, PetscBool *again)
{
  const MPI_Comm comm = b->surface->space->comm;
  Multipliers *m = &b->multipliers;
  const PetscReal exact = b->contact.base.effect->dynamic ? EXACT_STEPS : EXACT;
  const PetscReal usual = is_exact(b) ? exact : SETTLED;
  const PetscReal tolerance = b->options.settled > 0. ? b->options.settled : usual;
  const PetscReal loose = PetscMax(tolerance, LOOSE);
  PetscReal by;
  PairForce *mine;
  PetscInt n;
  Wrong worst;

  PetscFunctionBeginUser;
  b->contact.base.unsettled[0] = 0;
  PetscCall(find_forces(b, &n, &mine, &worst));
  by = worst.by;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &by, 1, MPIU_REAL, MPI_MAX, comm));
  PetscCall(
    PetscInfo(NULL, "multipliers, update %" PetscInt_FMT ": gaps are wrong by %g of their width\n",
              m->updates, (double)by));
  if (!m->updates || by < FALLS * m->least) {
    m->least = by;
    m->stuck = 0;
  } else
    m->stuck++;
  if (by > tolerance && (by > loose || m->stuck < STUCK) && m->updates < UPDATES) {
    m->updates++;
    PetscCall(share(b, n, mine, &m->now));
    PetscCall(SbSurfacesFindFriction(b, PETSC_TRUE));
    SbSurfacesSwapFriction(b);
    b->motion.known = PETSC_FALSE;
    *again = PETSC_TRUE;
  } else if (by > loose)
    PetscCall(complain(b, &worst, PETSC_TRUE));
  else if (has_multipliers(b) && by > PetscMax(tolerance, SETTLED))
    PetscCall(complain(b, &worst, PETSC_FALSE));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMultipliersKeep(Surfaces *b)
{
  PairForce *mine;
  PetscInt n;
  Wrong worst;

  PetscFunctionBeginUser;
  if (!has_table(b))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_forces(b, &n, &mine, &worst));
  PetscCall(share(b, n, mine, &b->multipliers.kept));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMultipliersRestore(Surfaces *b)
{
  Multipliers *m = &b->multipliers;

  PetscFunctionBeginUser;
  m->updates = 0;
  b->contact.base.unsettled[0] = 0;
  m->now.n = m->kept.n;
  PetscCall(SbReserve(m->now.n, sizeof(*m->now.pair), &m->now.size, &m->now.pair));
  PetscCall(PetscArraycpy(m->now.pair, m->kept.pair, m->now.n));
  if (has_table(b))
    b->motion.known = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
