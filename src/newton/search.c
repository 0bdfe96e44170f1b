/*
  The line search: from X by s p = -s Y, with sufficient decrease of the potential,

    E(u + s p) - E(u) <= c s F . p    (Armijo; Nocedal and Wright, section 3.1).

  The change of E. Strain energy is evaluated directly; the rest of F is linear in u but for
  follower loads and contact, so the trapezoidal rule gives its work: psi(u + s p) - psi(u) + s/2
  (r(0) + r(s)), r = (F - dpsi/du) . p. Where that is within rounding, near the solution, the norm
  of the residual decides.

  Provisional steps. In bending and rotation a full step stretches what should rotate: E rises far,
  and the next step brings it back; a monotone search takes very many short steps instead of five
  full ones. So a full step that inverts no tet and meets no barrier may raise E; the next one has
  to bring E below the old value, by an accurate linear solve if need be, else the search starts
  again from the old iterate (watchdog technique: Chamberlain et al. 1982; Nocedal and Wright,
  section 15.6).

  Linearised stresses (SbNewtonProblem.linearise). Those of the state after a full step in bending
  would be wrong by what it stretches spuriously, and steps a hundredth; stresses that are
  linearised at the old iterate are not. The first such step raises E far, and some of the next ones
  bring it back; of one that would invert tets a part is taken. If they do not, a load step that can
  be shortened is given up.

  Forces without a potential. Along an ascent direction of a static run the residual decides. In a
  slender body it rises as much as E does in rotation, so such a step may be provisional, too: the
  next ones have to bring the residual, or E, below the old value.

  Barriers. E follows the quadratic model until new pairs come within the barrier, and rises steeply
  from there. A step that Armijo's rule ends before that gives the next tangent no new pairs: so the
  search bisects between the longest sufficient and the shortest insufficient step until the slope
  has halved. Where E still decreases half as steeply after a full step, the model being too stiff,
  longer steps are tried.
*/
#include "newton_impl.h"

#define DECREASE 1e-4  /* Armijo's constant, c above */
#define ROUNDING 1e-11 /* relative rounding of the terms of E */
#define NOTHING 1e-6   /* relative to E's rounding: predicted decrease that counts as none */
#define WOLFE \
  0.5 /* where more than this fraction of the slope of E is left, a longer step is tried */
#define FARTHER 4. /* factor on a whole step, the first longer one */
#define TRIES 5    /* longer steps, at most */
#define PROVISIONAL \
  1 /* non-monotone steps that may follow each other while E is above where they began */
#define PROVISIONAL_LINEARISED 8 /* the same where stresses are linearised */
#define PROVISIONAL_ASCENT 3     /* and the first one is in a direction of ascent */
#define STAYS 0.5  /* static: least decrease of a residual within the rounding of E that counts */
#define INTACT 0.1 /* least part of a provisional step, for one that inverts no tet */

/* A line search. */
typedef struct {
  SNES snes;
  Newton *n;
  PetscReal slope;       /* of E at X along -Y, J */
  PetscReal s;           /* fraction of Y of the trial */
  PetscBool circulatory; /* forces without a potential: ascent steps may be provisional, too */
  PetscBool monotone;    /* no provisional step, as one into a barrier */

  /* the trial, in n->to */
  PetscReal change, noise; /* of E, and its rounding, J */
  PetscReal total;       /* change of E since it was below its value before provisional steps, J */
  PetscBool enough;      /* it is sufficient */
  PetscBool provisional; /* it may be taken all the same */

  /* barriers */
  PetscReal low, high; /* fractions between which E is lowest; 0: not known yet */
  PetscBool flat;      /* the slope has halved */
  int tries;           /* longer steps so far */

  PetscReal undone; /* change of E over provisional steps that were undone, J */
} Search;

static void swap(Iterate *a, Iterate *b)
{
  const Iterate c = *a;

  *a = *b;
  *b = c;
}

/* Energies and forces of an iterate with a residual; only its norm where that is not finite. */
static PetscErrorCode evaluate(const Newton *n, Iterate *at)
{
  const SbNewtonProblem *p = n->problem;
  SbNewtonEnergy energy = {0};

  PetscFunctionBeginUser;
  at->psi = at->gaps = at->slope = at->rest = 0.;
  at->ninverted = 0;
  PetscCall(VecNorm(at->r, NORM_2, &at->norm));
  if (PetscIsInfOrNanReal(at->norm))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall((*p->energy)(p->ctx, at->x, &energy, at->elastic, at->contact));
  at->psi = energy.strain + energy.contact;
  at->gaps = energy.contact;
  at->ninverted = energy.ninverted;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slopes at an iterate along -Y. */
static PetscErrorCode find_slopes(Vec Y, Iterate *at)
{
  const Vec forces[3] = {at->r, at->elastic, at->contact};
  PetscScalar along[3] = {0., 0., 0.};

  PetscFunctionBeginUser;
  PetscCall(VecMDot(Y, at->contact ? 3 : 2, forces, along));
  at->slope = -along[0];
  at->rest = -along[0] + along[1] + along[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The trial at s: how E changes. */
static PetscErrorCode evaluate_trial(Search *q)
{
  const SNES snes = q->snes;
  const Iterate *from = &q->n->from;
  Iterate *to = &q->n->to;

  PetscFunctionBeginUser;
  q->change = PETSC_INFINITY;
  q->noise = 0.;
  PetscCall(VecWAXPY(to->x, -q->s, snes->vec_sol_update, snes->vec_sol));
  PetscCall(SNESComputeFunction(snes, to->x, to->r));
  PetscCall(evaluate(q->n, to));
  if (!PetscIsInfOrNanReal(to->norm)) {
    PetscCall(find_slopes(snes->vec_sol_update, to));
    q->change = to->psi - from->psi + 0.5 * q->s * (from->rest + to->rest);
    q->noise = q->n->problem->rounding +
               ROUNDING * (PetscAbsReal(to->psi) + PetscAbsReal(from->psi) +
                           q->s * (PetscAbsReal(from->rest) + PetscAbsReal(to->rest)));
    if (PetscIsInfOrNanReal(q->change))
      q->change = PETSC_INFINITY;
  }
  PetscCall(PetscInfo(snes,
                      "iteration %" PetscInt_FMT
                      ": %g of the step changes E by %g J (slope %g J), residual %g -> %g N\n",
                      snes->iter, (double)q->s, (double)q->change, (double)q->slope,
                      (double)from->norm, (double)to->norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the trial is sufficient. */
static void judge(Search *q)
{
  Newton *n = q->n;
  const Iterate *from = &n->from;
  const Iterate *to = &n->to;
  const PetscBool descent = (PetscBool)(q->slope < 0.);
  const PetscReal goal = DECREASE * (n->provisional.n ? n->provisional.slope : q->s * q->slope);
  const PetscReal nothing = NOTHING * q->noise;
  PetscReal before = from->norm;
  PetscBool within, no_potential, stays;

  /* sufficient decrease of E */
  q->total = n->provisional.n ? n->provisional.rise + q->change : q->change;
  within = (PetscBool)(q->total <= q->noise);
  q->enough = (PetscBool)(descent && goal < 0. && q->total <= goal);

  /* within rounding, or in an ascent without a potential, the residual decides */
  no_potential = (PetscBool)(q->circulatory && n->provisional.n);
  if (no_potential)
    before = n->provisional.norm;
  if (!descent || no_potential || within)
    q->enough = (PetscBool)(q->enough || to->norm <= (1. - DECREASE * q->s) * before);

  /* at the solution, where residuals are rounding as well */
  stays = (PetscBool)(!q->enough || (n->problem->quadratic && to->norm > STAYS * before));
  n->rounding =
    (PetscBool)(q->s == 1. && n->held == 1. && stays && descent && within && -q->slope <= nothing);
  if (descent && within)
    q->enough = (PetscBool)(q->enough || -q->slope <= nothing);
}

/* Whether a trial that is not sufficient may be a provisional step. */
static void allow_provisional(Search *q)
{
  const Newton *n = q->n;
  const Iterate *from = &n->from;
  const Iterate *to = &n->to;
  const PetscReal slope = n->provisional.n ? n->provisional.slope : q->slope;
  PetscInt most = PROVISIONAL;

  if (n->problem->linearise)
    most = slope < 0. ? PROVISIONAL_LINEARISED : PROVISIONAL_ASCENT;

  q->provisional = (PetscBool)(!q->enough && !q->monotone && (q->slope < 0. || q->circulatory) &&
                               n->provisional.n < most && q->change < PETSC_INFINITY &&
                               to->ninverted <= from->ninverted && to->gaps <= from->gaps);
}

/* Barriers: the next fraction to try, towards the minimum of E; 0: none. */
static PetscErrorCode next_bracketed(Search *q, PetscReal *next)
{
  const SNES snes = q->snes;
  const SbNewtonProblem *p = q->n->problem;
  const Vec Y = snes->vec_sol_update;
  const PetscReal factor = FARTHER * q->s;
  PetscReal safe;

  PetscFunctionBeginUser;
  *next = 0.;
  if (q->flat || q->tries++ >= TRIES)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (q->high > 0.) {
    *next = 0.5 * (q->low + q->high);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (q->s < 1. || q->n->held < 1.)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* beyond a whole step, as far as there is no collision */
  PetscCall(VecScale(Y, factor));
  PetscCall((*p->barrier->max_step)(p->ctx, snes->vec_sol, Y, &safe, NULL));
  PetscCall(VecScale(Y, 1. / factor));
  if (safe < 1.)
    q->tries = TRIES;
  if (safe > 1.5 / FARTHER)
    *next = FARTHER * safe * q->s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Barriers: the minimum of E is before one, or far beyond a full step: brackets it by slopes;
   `again`: to try the new s, else the best trial is taken if there is one. */
static PetscErrorCode bracket(Search *q, PetscBool *again)
{
  const Iterate *from = &q->n->from;
  Iterate *to = &q->n->to;
  Iterate *best = &q->n->best;
  PetscReal next;

  PetscFunctionBeginUser;
  *again = PETSC_FALSE;
  if (q->enough && to->slope < 0.)
    q->low = q->s;
  else if (q->slope < 0. && (to->gaps > from->gaps || best->s > 0.))
    q->high = q->s;

  /* the best trial */
  if (q->enough) {
    q->flat = (PetscBool)(to->slope >= WOLFE * q->slope);
    if (best->s == 0. || q->change < best->change) {
      to->s = q->s;
      to->change = q->change;
      swap(to, best);
    }
  }
  if (best->s == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);

  PetscCall(next_bracketed(q, &next));
  if (next > 0.) {
    q->s = next;
    *again = PETSC_TRUE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  swap(to, best);
  q->s = to->s;
  q->change = to->change;
  q->enough = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After provisional steps: the error of a loose linear solve may exceed the decrease of E that is
   needed. `again`: there is a better direction. */
static PetscErrorCode improve_direction(Search *q, PetscBool *again)
{
  const SNES snes = q->snes;

  PetscFunctionBeginUser;
  PetscCall(SbNewtonSolveAccurately(snes, &q->slope, again));
  if (!*again)
    PetscFunctionReturn(PETSC_SUCCESS);
  q->n->held = 1.;
  PetscCall(SbNewtonLongestStep(snes, &q->s));
  PetscCall(find_slopes(snes->vec_sol_update, &q->n->from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Back to before the provisional steps, and to the first of them. */
static PetscErrorCode undo_provisional(Search *q)
{
  Newton *n = q->n;
  const SbNewtonProblem *p = n->problem;
  const Vec X = q->snes->vec_sol;
  const Vec Y = q->snes->vec_sol_update;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(n->provisional.X, X));
  PetscCall(VecCopy(n->provisional.Y, Y));
  if (p->linearise)
    PetscCall((*p->linearise)(p->ctx, X, NULL, 1.));
  PetscCall(SNESComputeFunction(q->snes, X, q->snes->vec_func));
  PetscCall(evaluate(n, &n->from));
  PetscCall(find_slopes(Y, &n->from));
  q->slope = n->provisional.slope;
  q->change = n->provisional.first;
  q->undone = n->provisional.rise;
  n->provisional.n = 0;
  n->held = 1.;
  q->s = n->provisional.part; /* collision detection may have limited the one from there */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A shorter step: to the minimum of a parabola. */
static void shorten(Search *q)
{
  const PetscReal linear = q->slope * q->s;
  const PetscReal parabola = -linear / (2. * (q->change - linear));

  q->monotone = PETSC_TRUE;
  q->s *= PetscMax(q->high > 0. ? 0.3 : 0.1, PetscMin(0.5, parabola));
}

/* The trial becomes the next iterate; the one before provisional steps is kept until E is below its
   value. */
static PetscErrorCode take(Search *q)
{
  Newton *n = q->n;
  const SbNewtonProblem *p = n->problem;
  const SNES snes = q->snes;

  PetscFunctionBeginUser;
  if (q->enough)
    n->provisional.n = 0;
  else if (!n->provisional.n++) {
    PetscCall(VecCopy(snes->vec_sol, n->provisional.X));
    PetscCall(VecCopy(snes->vec_sol_update, n->provisional.Y));
    n->provisional.slope = q->slope;
    n->provisional.norm = n->from.norm;
    n->provisional.first = q->change;
    n->provisional.part = q->s;
    n->provisional.rise = 0.;
  }
  n->provisional.rise += q->change;
  n->change = q->change - q->undone;

  /* the stresses of the next tangent, linearised at the old X */
  if (p->linearise)
    PetscCall((*p->linearise)(p->ctx, snes->vec_sol, snes->vec_sol_update, q->s));
  PetscCall(VecCopy(n->to.x, snes->vec_sol));
  PetscCall(VecCopy(n->to.r, snes->vec_func));
  snes->norm = n->to.norm;
  n->from.x = n->to.x;
  n->from.r = n->to.r;
  swap(&n->from, &n->to);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonSearch(SNES snes, PetscReal slope, PetscReal *s)
{
  Newton *n = (Newton *)snes->data;
  const SbNewtonProblem *p = n->problem;
  PetscBool again;
  Search q = {.snes = snes, .n = n, .slope = slope, .s = *s};

  PetscFunctionBeginUser;
  q.circulatory = (PetscBool)(p->nonsymmetric && p->dt == 0. && !p->barrier);
  q.monotone = (PetscBool)(p->barrier && (n->nblock > 0 || q.s < 1. || n->held < 1.));

  /* where it begins */
  n->from.x = snes->vec_sol;
  n->from.r = snes->vec_func;
  if (!n->known)
    PetscCall(evaluate(n, &n->from));
  PetscCall(find_slopes(snes->vec_sol_update, &n->from));
  n->known = PETSC_TRUE;
  n->best.s = 0.;

  for (;;) {
    PetscCall(evaluate_trial(&q));
    judge(&q);
    allow_provisional(&q);
    if (p->barrier && q.monotone) {
      PetscCall(bracket(&q, &again));
      if (again)
        continue;
    }
    if (q.enough || q.provisional)
      break;

    /* linearised stresses: a part of the step that inverts no tet */
    if (p->linearise && !q.monotone && q.s > 2. * INTACT && n->to.ninverted > n->from.ninverted) {
      q.s *= 0.5;
      continue;
    }

    /* a shorter load step needs fewer iterations */
    if (p->may_give_up) {
      snes->reason = SNES_DIVERGED_LINE_SEARCH;
      *s = q.s;
      PetscFunctionReturn(PETSC_SUCCESS);
    }

    /* the search goes on with a better direction, or from the iterate before provisional steps */
    if (n->provisional.n) {
      PetscCall(improve_direction(&q, &again));
      if (again)
        continue;
      PetscCall(undo_provisional(&q));
    }
    shorten(&q);
    if (q.s < SHORTEST) {
      snes->reason = SNES_DIVERGED_LINE_SEARCH;
      *s = q.s;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }
  PetscCall(take(&q));
  *s = q.s;
  PetscFunctionReturn(PETSC_SUCCESS);
}
