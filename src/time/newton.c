/*
  Newton's method as a minimisation.

  The solution u of a step of an implicit integrator, or of a load step, is a stationary point of

    E(u) = a_M/2 |u - u^|_M^2 + psi(u) - f . u + D(u)

  (inertia about the predictor u^, strain, loads, Rayleigh damping); the residual F(u) is its
  gradient. An iteration solves K p = -F and steps by s p with sufficient decrease: E(u + s p) -
  E(u) <= c s F . p (Armijo; Nocedal and Wright, Numerical Optimization, 2006, section 3.1).

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

  Pressure. In static runs the geometric stiffness uses the linearised pressure of a cell after the
  step, as if it were an unknown of its own (src/fem/quadratic.c): spurious changes of volume of a
  full step in bending would give wrong pressures, and steps of a hundredth. The first such step
  raises E far, and the next two bring it back. Time steps are short enough without.

  Tangent. With -body_NAME_tangent auto it is exact. At negative curvature or pivots in the linear
  solver, or if p is no descent direction, negative eigenvalues of the cells are set to zero and the
  system is solved again (Longva et al. 2023, "Pitfalls of projection"); after a full step the exact
  one is tried again. Forces without a potential (the free rim of a follower pressure) have
  equilibria where its symmetric part is not definite: the exact tangent is kept if it has as many
  negative eigenvalues as at the start of the load step, or after a full step to a residual below
  the first; along an ascent direction the residual decides. In a slender body it rises as much as E
  does in rotation, so such a step may be provisional, too: the next ones have to bring the
  residual, or E, below the old value.

  Barrier contact. Its Hessian is the positive part of each pair's, and after a full step the exact
  one, which alone converges superlinearly near the solution. Friction whose slip reversed is
  treated as sticking (src/effect/barrier_forces.c), and bounded from above where p is no descent
  direction. An indefinite tangent is shifted by the least sufficient multiple of the mass matrix
  (Nocedal and Wright, algorithm 3.3) before cells are filtered: in a collapse nearly all cells have
  a negative eigenvalue but the assembled tangent has few, and filtering leads to steps of a
  hundredth.

  Its line search. E follows the quadratic model until new pairs come within the barrier, and rises
  steeply from there. A step that Armijo's rule ends before that gives the next tangent no new
  pairs: so the search bisects between the longest sufficient and the shortest insufficient step
  until the slope has halved. Where E still decreases half as steeply after a full step, the model
  being too stiff, longer steps are tried.
*/
#include <petsc/private/snesimpl.h> /* PETSc has no public way to write a SNESType */
#include "sbsolver.h"
#include "time_impl.h"

#define DECREASE 1e-4   /* Armijo's constant, c above */
#define SHORTEST 1e-7   /* shortest fraction of a step that the line search tries */
#define ROUNDING 1e-11  /* relative rounding of the terms of E */
#define CREEP 0.05      /* fraction of a step that counts as stagnation */
#define CREEPS 5        /* such steps in a row after which a load step is halved */
#define NOTHING 1e-6    /* relative to E's rounding: predicted decrease that counts as none */
#define ACCURATE 1e-6   /* relative tolerance of an accurate linear solve */
#define APPROACHES 50   /* iterations in which prescribed motions have to be completed */
#define UNAVOIDABLE 0.2 /* a step there shorter than this may invert tets */
#define DIFFERENCE 1e-7 /* fraction of a prescribed motion, for finite differences by it */
#define SETTLED 1e-4  /* barrier contact: largest last step, over SbModel.barrier_speed times dt */
#define STICKING 1e-2 /* factor on it with friction, whose forces depend on such small slips */
#define SETTLED_STATIC \
  1e-7 /* the same tolerance in a static run, over the size of the smallest body */
#define SETTLED_LEAST 1e-8 /* least tolerance in time steps of full length, over that size */
#define SETTLED_GAP \
  1e-2              /* largest change of gaps in the last iteration, over the barrier's width */
#define PATIENCE 50 /* barrier contact: iterations between checks of progress */
#define WORTH \
  0.01           /* least decrease of E in these, over all before, to exceed SB_NEWTON_ITERATIONS */
#define EARLY 10 /* iterations in which friction is not lagged: normal forces are updated in each */
#define SHIFT 0.1        /* least shift of an indefinite tangent, over that of inertia */
#define SHIFT_STIFF 1e-4 /* the same, relative to the mean ratio of stiffness and mass */
#define SHIFTS \
  8 /* tries, each with a shift SHIFT_MORE times as large, before cells are projected */
#define SHIFT_MORE 4.
#define WOLFE \
  0.5 /* where more than this fraction of the slope of E is left, a longer step is tried */
#define FARTHER 4. /* factor on a whole step, the first longer one */
#define TRIES 5    /* longer steps, at most */
#define STEEP 0.01 /* of the slope of the quadratic model: least slope of E along a direction */
#define PROVISIONAL \
  1 /* non-monotone steps that may follow each other while E is above where they began */
#define PROVISIONAL_STATIC 2 /* the same in a static run, whose pressures are linearised */

/* The potential at an iterate, as the line search needs it. */
typedef struct {
  Vec x, r;        /* the iterate and its residual; of the last iterate borrowed from the SNES */
  Vec elastic;     /* gradient of the strain energy, N */
  Vec contact;     /* barrier contact: the same of its energy */
  PetscReal norm;  /* norm of the residual, N */
  PetscReal psi;   /* strain energy, J */
  PetscReal gaps;  /* energy of barrier contact, J: part of psi */
  PetscReal rest;  /* slope of all but strain and barrier contact along the step, J */
  PetscReal slope; /* slope of E along the step, J */
  PetscReal s, change; /* fraction of the step; change of E over it, J */
  PetscInt ninverted;
} Iterate;

/* Data of a solve. */
typedef struct {
  SbRun run;
  Iterate from;    /* the last iterate */
  PetscBool known; /* `from` is up to date, but for its slopes */
  Iterate to;      /* a trial */
  Iterate best;    /* barrier contact: the longest sufficient trial */
  Vec rhs;         /* barrier contact: right-hand side of its quadratic model */
  Vec start, step; /* iterate before the provisional steps; the first of them led to start - step */
  PetscReal least; /* rounding of the strain energy of a rotated body: eps E V, J */
  PetscInt provisional;  /* number of provisional steps */
  PetscReal slope;       /* slope of E at `start` along that step, J */
  PetscReal norm;        /* norm of the residual there, N */
  PetscReal first, rise; /* change of E over it, and over all since, J */
  PetscReal change;      /* change of E over the last step, J */
  PetscBool patient; /* barrier contact, without -snes_max_it: may exceed SB_NEWTON_ITERATIONS */
  SbContactSystem system; /* barrier contact: NULL before the first contact */
  SbBlocks blocks;        /* its Hessian at the last linear solve */
  PetscInt nblock;        /* number of its blocks, all ranks */
  PetscInt iterations;    /* iterations of the last linear solve */
  SbContactHessian kind;
  PetscReal shift; /* factor on the mass matrix added to the tangent of the last direction, 1/s^2 */
  PetscBool unstable;  /* an exact tangent of this solve was not positive definite */
  PetscBool whole;     /* the last step was a full one */
  PetscBool rounding;  /* the last step changed nothing beyond rounding */
  PetscInt branch;     /* static, forces without a potential: negative eigenvalues at the start */
  PetscReal tolerance; /* absolute tolerance of the last solve, N */
  PetscReal initial;   /* norm of the first residual, N */
} Newton;

/* Energies and forces of an iterate with a residual; only its norm where that is not finite. */
static PetscErrorCode evaluate(Newton *n, Iterate *at)
{
  const SbRun run = n->run;
  const SbModel m = run->model;
  const PetscReal part = run->solve.stage ? run->solve.stage_part : 1.;
  PetscReal energy;

  PetscFunctionBeginUser;
  at->psi = at->gaps = at->slope = at->rest = 0.;
  at->ninverted = 0;
  PetscCall(VecNorm(at->r, NORM_2, &at->norm));
  if (PetscIsInfOrNanReal(at->norm))
    PetscFunctionReturn(PETSC_SUCCESS);

  /* forces are those of a stage between the start of the step and x, divided by its fraction of the
     step */
  if (run->solve.stage)
    PetscCall(VecAXPBYPCZ(run->solve.stage, 1. - part, part, 0., run->solve.stage_start, at->x));
  PetscCall(SbModelStrainEnergy(m, run->solve.stage ? run->solve.stage : at->x, at->elastic,
                                &at->psi, &at->ninverted));
  at->psi /= PetscSqr(part);

  /* contact is evaluated at x */
  if (m->npotential) {
    PetscCall(VecZeroEntries(at->contact));
    PetscCall(SbModelPotentialGradient(m, at->x, run->solve.barrier_weight, PETSC_TRUE, &energy,
                                       at->contact));
    at->gaps = run->solve.barrier_weight * energy;
    at->psi += at->gaps;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slopes at an iterate along -Y. */
static PetscErrorCode find_slopes(Newton *n, Vec Y, Iterate *at)
{
  const PetscReal part = n->run->solve.stage ? n->run->solve.stage_part : 1.;
  const Vec forces[3] = {at->r, at->elastic, at->contact};
  PetscScalar along[3] = {0., 0., 0.};

  PetscFunctionBeginUser;
  PetscCall(VecMDot(Y, at->contact ? 3 : 2, forces, along));
  at->slope = -along[0];
  at->rest = -along[0] + along[1] / part + along[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves K Y = F, K with the Hessian of barrier contact, or its substitute, where there is
   contact. */
static PetscErrorCode solve_linear(SNES snes, KSPConvergedReason *reason)
{
  Newton *n = (Newton *)snes->data;
  const SbModel m = n->run->model;
  PetscInt iterations;

  PetscFunctionBeginUser;
  n->blocks.n = n->nblock = 0;
  if (m->npotential) {
    PetscCall(SbModelPotentialHessian(m, snes->vec_sol, n->kind, &n->blocks, n->rhs));
    PetscCall(VecAYPX(n->rhs, n->run->solve.barrier_weight, snes->vec_func));
    for (PetscInt k = 0; k < n->blocks.n; k++)
      for (int i = 0; i < 9; i++)
        n->blocks.block[k].H[i] *= n->run->solve.barrier_weight;
    PetscCallMPI(MPI_Allreduce(&n->blocks.n, &n->nblock, 1, MPIU_INT, MPI_SUM, m->comm));
  }
  if (n->nblock) {
    if (!n->system)
      PetscCall(SbContactSystemCreate(m->space, n->run->solve.contact_choice, &n->system));
    PetscCall(SbContactSystemSolve(n->system, snes->jacobian_pre, &n->blocks, PETSC_TRUE, n->rhs,
                                   snes->vec_sol_update, reason, &iterations));
  } else {
    PetscCall(KSPSetOperators(snes->ksp, snes->jacobian, snes->jacobian_pre));
    PetscCall(KSPSolve(snes->ksp, snes->vec_func, snes->vec_sol_update));
    PetscCall(KSPGetIterationNumber(snes->ksp, &iterations));
    PetscCall(KSPGetConvergedReason(snes->ksp, reason));
  }
  snes->linear_its += n->iterations = iterations;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the mass times the shift, 1/s^2, to the tangent; none if the first is below the least (0:
   unknown). */
static PetscErrorCode add_shift(SNES snes, PetscBool first, PetscReal *least, PetscReal *shift)
{
  Newton *n = (Newton *)snes->data;
  const SbModel m = n->run->model;
  PetscScalar stiff;

  PetscFunctionBeginUser;
  if (*least == 0.) {
    PetscCall(MatGetDiagonal(snes->jacobian_pre, n->to.r));
    PetscCall(VecSum(n->to.r, &stiff));
    *least = SHIFT_STIFF * PetscRealPart(stiff) / (3. * m->mass);
    if (m->dynamic)
      *least = PetscMax(*least, SHIFT / PetscSqr(n->run->solve.barrier_dt));
  }
  if (*shift < *least)
    *shift = first ? 0. : *least;
  if (*shift == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecAXPBY(n->to.r, *shift, 0., n->run->state.mass));
  PetscCall(MatDiagonalSet(snes->jacobian_pre, n->to.r, ADD_VALUES));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves for Y, X - Y being the next iterate, and for the slope of E along -Y. */
static PetscErrorCode find_direction(SNES snes, PetscBool *filtered, PetscReal *slope)
{
  Newton *n = (Newton *)snes->data;
  const Vec X = snes->vec_sol;
  const Vec F = snes->vec_func;
  const Vec Y = snes->vec_sol_update;
  const SbModel m = n->run->model;
  KSPConvergedReason reason;
  const PetscBool keep = (PetscBool)(n->run->solve.nonsymmetric.U && n->whole &&
                                     snes->norm < n->initial && !m->npotential);
  PetscReal shift = n->shift / SHIFT_MORE;
  PetscReal least = 0.;
  PetscReal modelled = 0.;
  PetscInt negative;
  PetscInt shifts = 0;

  PetscFunctionBeginUser;
  n->shift = 0.;
  for (;;) {
    PetscCall(SbModelProjectTangent(m, *filtered));
    if (keep)
      m->space->tentative = PETSC_FALSE;
    PetscCall(SNESComputeJacobian(snes, X, snes->jacobian, snes->jacobian_pre));
    if (shift > 0.)
      PetscCall(add_shift(snes, (PetscBool)!shifts, &least, &shift));
    PetscCall(solve_linear(snes, &reason));
    PetscCall(VecDot(F, Y, slope));
    *slope = -*slope;

    /* friction taken as sticking changes the right-hand side: Y has to be a descent direction of E
       as well */
    if (n->nblock)
      PetscCall(VecDot(n->rhs, Y, &modelled));
    if (n->nblock && reason == KSP_DIVERGED_ITS)
      break; /* by -pc_type: not evidence of an indefinite tangent */
    if (n->nblock && n->kind != SB_HESSIAN_MAJORIZED &&
        (reason < 0 || *slope >= -STEEP * PetscMax(modelled, 0.))) {
      n->kind = n->kind == SB_HESSIAN_EXACT ? SB_HESSIAN_PROJECTED : SB_HESSIAN_MAJORIZED;
      continue;
    }
    if (n->nblock && m->may_filter && !*filtered && (reason < 0 || *slope >= 0.) &&
        shifts++ < SHIFTS) {
      shift = shift > 0. ? SHIFT_MORE * shift : 1e-300;
      continue;
    }
    n->shift = shift;
    if (*filtered || !m->may_filter)
      break;
    if (keep && reason > 0)
      break;

    /* L D L^T factors an indefinite matrix without an error, and p may descend to a saddle point */
    negative = -1;
    if (reason > 0 && *slope < 0. && !n->nblock)
      PetscCall(SbSolverCountNegativeEigenvalues(snes, m->space, &negative));
    if (n->run->solve.nonsymmetric.U && !m->dynamic && !snes->iter)
      n->branch = PetscMax(negative, 0);
    if (reason > 0 && *slope < 0. && negative <= n->branch)
      break;
    PetscCall(PetscInfo(snes,
                        "iteration %" PetscInt_FMT
                        ": the exact tangent is not definite (%s, slope %g J, %" PetscInt_FMT
                        " negative eigenvalues)\n",
                        snes->iter, KSPConvergedReasons[reason], (double)*slope, negative));
    *filtered = n->unstable = PETSC_TRUE;
  }
  if (reason < 0) {
    snes->reason = SNES_DIVERGED_LINEAR_SOLVE;
    if (n->nblock)
      PetscCall(SbSolverListContactFailed(n->run, reason, n->iterations));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves once more, to a tolerance of ACCURATE; `better`: the old direction was less accurate. */
static PetscErrorCode solve_accurately(SNES snes, PetscReal *slope, PetscBool *better)
{
  Newton *n = (Newton *)snes->data;
  const Vec F = snes->vec_func;
  const Vec Y = snes->vec_sol_update;
  KSPConvergedReason reason;
  PetscReal rtol, left;
  PetscInt iterations;

  PetscFunctionBeginUser;
  PetscCall(SNESKSPGetUseEW(snes, better));
  PetscCall(KSPGetTolerances(snes->ksp, &rtol, NULL, NULL, NULL));
  PetscCall(KSPGetResidualNorm(snes->ksp, &left));
  *better = (PetscBool)(*better && rtol > ACCURATE && left > ACCURATE * snes->norm);
  if (!*better)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESKSPSetUseEW(snes, PETSC_FALSE));
  PetscCall(KSPSetTolerances(snes->ksp, ACCURATE, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(VecZeroEntries(n->to.r));
  PetscCall(KSPSolve(snes->ksp, F, n->to.r));
  PetscCall(SNESKSPSetUseEW(snes, PETSC_TRUE));
  PetscCall(KSPGetIterationNumber(snes->ksp, &iterations));
  PetscCall(KSPGetConvergedReason(snes->ksp, &reason));
  snes->linear_its += iterations;
  *better = (PetscBool)(reason > 0);
  if (!*better)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecCopy(n->to.r, Y));
  PetscCall(VecDot(F, Y, slope));
  *slope = -*slope;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void swap(Iterate *a, Iterate *b)
{
  const Iterate c = *a;

  *a = *b;
  *b = c;
}

/* Line search from X along -Y, E's slope, J, to the next X and F; s: fraction of Y, in: the
   largest. */
static PetscErrorCode search(SNES snes, PetscReal slope, PetscReal *s)
{
  Newton *n = (Newton *)snes->data;
  const SbModel m = n->run->model;
  const Vec X = snes->vec_sol;
  const Vec F = snes->vec_func;
  const Vec Y = snes->vec_sol_update;
  Iterate *from = &n->from;
  Iterate *to = &n->to;
  Iterate *best = &n->best;

  /* forces without a potential: ascent steps may be provisional, too */
  const PetscBool circulatory =
    (PetscBool)(n->run->solve.nonsymmetric.U && !m->dynamic && !m->npotential);
  PetscBool enough, back, provisional, better,
    flat = PETSC_FALSE, barrier,
    plain = (PetscBool)(n->nblock > 0 || *s < 1.); /* no provisional step into a barrier */
  PetscReal change, noise, total, goal;
  PetscReal undone = 0.;
  PetscReal low = 0., high = 0.; /* parts of the step between which E is lowest; 0: not known yet */
  PetscInt nactive;
  PetscInt tries = 0;

  PetscFunctionBeginUser;
  from->x = X;
  from->r = F;
  if (!n->known)
    PetscCall(evaluate(n, from));
  PetscCall(find_slopes(n, Y, from));
  n->known = PETSC_TRUE;
  best->s = 0.;
  for (;;) {
    /* how E changes */
    change = PETSC_INFINITY;
    noise = 0.;
    PetscCall(VecWAXPY(to->x, -*s, Y, X));
    PetscCall(SNESComputeFunction(snes, to->x, to->r));
    PetscCall(evaluate(n, to));
    if (!PetscIsInfOrNanReal(to->norm)) {
      PetscCall(find_slopes(n, Y, to));
      change = to->psi - from->psi + 0.5 * *s * (from->rest + to->rest);
      noise = n->least + ROUNDING * (PetscAbsReal(to->psi) + PetscAbsReal(from->psi) +
                                     *s * (PetscAbsReal(from->rest) + PetscAbsReal(to->rest)));
      if (PetscIsInfOrNanReal(change))
        change = PETSC_INFINITY;
    }
    PetscCall(PetscInfo(snes,
                        "iteration %" PetscInt_FMT
                        ": %g of the step changes E by %g J (slope %g J), residual %g -> %g N\n",
                        snes->iter, (double)*s, (double)change, (double)slope, (double)from->norm,
                        (double)to->norm));

    /* sufficient decrease; within rounding, or in an ascent without a potential, the residual
       decides */
    total = n->provisional ? n->rise + change : change;
    goal = DECREASE * (n->provisional ? n->slope : *s * slope);
    back = (PetscBool)(circulatory && n->provisional);
    enough = (PetscBool)(slope < 0. && goal < 0. && total <= goal);
    if (slope >= 0. || back || total <= noise)
      enough =
        (PetscBool)(enough || to->norm <= (1. - DECREASE * *s) * (back ? n->norm : from->norm));

    /* at the solution, where residuals are rounding as well */
    n->rounding =
      (PetscBool)(*s == 1. && !enough && slope < 0. && total <= noise && -slope <= NOTHING * noise);
    if (slope < 0. && total <= noise)
      enough = (PetscBool)(enough || -slope <= NOTHING * noise);
    provisional = (PetscBool)(!enough && !plain && (slope < 0. || circulatory) &&
                              n->provisional < (m->dynamic ? PROVISIONAL : PROVISIONAL_STATIC) &&
                              change < PETSC_INFINITY && to->ninverted <= from->ninverted &&
                              to->gaps <= from->gaps);

    /* the minimum of E is before a barrier, or far beyond a full step: bracket it by slopes */
    barrier = (PetscBool)(m->npotential && plain);
    if (barrier && enough && to->slope < 0.)
      low = *s;
    else if (barrier && slope < 0. && (to->gaps > from->gaps || best->s > 0.))
      high = *s;
    if (barrier && enough) {
      flat = (PetscBool)(to->slope >= WOLFE * slope);
      if (best->s == 0. || change < best->change) {
        to->s = *s;
        to->change = change;
        swap(to, best);
      }
    }
    if (best->s > 0.) {
      PetscReal far = 0.;

      if (!flat && tries++ < TRIES) {
        if (high > 0.)
          far = 0.5 * (low + high);
        else if (*s >= 1.) {
          PetscCall(VecScale(Y, FARTHER * *s));
          PetscCall(SbModelPotentialMaxStep(m, X, Y, &far, &nactive));
          PetscCall(VecScale(Y, 1. / (FARTHER * *s)));
          if (far < 1.)
            tries = TRIES;
          far = far > 1.5 / FARTHER ? FARTHER * far * *s : 0.;
        }
      }
      if (far > 0.) {
        *s = far;
        continue;
      }
      swap(to, best);
      *s = to->s;
      change = to->change;
      enough = PETSC_TRUE;
    }
    if (enough || provisional)
      break;

    /* the error of a loose linear solve may exceed the decrease of E that is needed */
    if (n->provisional) {
      PetscCall(solve_accurately(snes, &slope, &better));
      if (better) {
        if (m->npotential)
          PetscCall(SbModelPotentialMaxStep(m, X, Y, s, &nactive)); /* for the new direction */
        PetscCall(find_slopes(n, Y, from));
        continue;
      }
    }

    /* back to before the provisional steps, and a shorter step: to the minimum of a parabola */
    if (n->provisional) {
      PetscCall(VecCopy(n->start, X));
      PetscCall(VecCopy(n->step, Y));
      if (!m->dynamic)
        PetscCall(SbSpaceLinearisePressure(m->space, X, NULL, -1., 1.));
      PetscCall(SNESComputeFunction(snes, X, F));
      PetscCall(evaluate(n, from));
      PetscCall(find_slopes(n, Y, from));
      slope = n->slope;
      change = n->first;
      undone = n->rise;
      n->provisional = 0;
      *s = 1.; /* the first one was full; collision detection may have limited the one from there */
    }
    plain = PETSC_TRUE;
    *s *=
      PetscMax(high > 0. ? 0.3 : 0.1, PetscMin(0.5, -slope * *s / (2. * (change - slope * *s))));
    if (*s < SHORTEST) {
      snes->reason = SNES_DIVERGED_LINE_SEARCH;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
  }

  /* the new iterate; the one before provisional steps is kept until E is below its value */
  if (enough)
    n->provisional = 0;
  else if (!n->provisional++) {
    PetscCall(VecCopy(X, n->start));
    PetscCall(VecCopy(Y, n->step));
    n->slope = slope;
    n->norm = from->norm;
    n->first = change;
    n->rise = 0.;
  }
  n->rise += change;
  n->change = change - undone;

  /* static: the pressures of the next tangent, linearised at the old X (src/fem/quadratic.c) */
  if (!m->dynamic)
    PetscCall(SbSpaceLinearisePressure(m->space, X, Y, -1., *s));
  PetscCall(VecCopy(to->x, X));
  PetscCall(VecCopy(to->r, F));
  snes->norm = to->norm;
  from->x = to->x;
  from->r = to->r;
  swap(from, to);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Barrier contact: from the start of the step to a first X that has the prescribed displacements,
   and obstacles at their end positions. The integrator's predictor is taken if its motion is free
   of contact, else free unknowns begin at the start of the step. A prescribed motion that would
   intersect a surface is part of Newton's steps: the right-hand side has the derivative of the
   residual with respect to it, so that the bodies it pushes move with it. */
static PetscErrorCode approach(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const SbModel m = n->run->model;
  const Vec X = snes->vec_sol;
  const Vec F = snes->vec_func;
  const Vec Y = snes->vec_sol_update;
  const Vec start = n->run->solve.barrier_start;
  const Vec D = n->step;
  PetscReal part;
  PetscReal progress = 0.;
  PetscReal slope, energy;
  PetscInt nactive, inverted, before;

  PetscFunctionBeginUser;
  PetscCall(SbModelPotentialAdvance(m, 0.));
  PetscCall(VecWAXPY(Y, -1., X, start));
  PetscCall(SbModelPotentialMaxStep(m, start, Y, &part, &nactive));
  if (part == 1. && !nactive) {
    PetscCall(SbModelPotentialAdvance(m, 1.));
    PetscCall(VecZeroEntries(Y));
    PetscCall(SbModelPotentialMaxStep(m, X, Y, &part, &nactive));
    if (!nactive)
      PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(SbModelPotentialAdvance(m, 0.));
  }

  /* D: increment of the prescribed displacements */
  PetscCall(VecWAXPY(D, -1., start, X));
  PetscCall(SbSpaceZeroPrescribed(m->space, PETSC_FALSE, D));
  PetscCall(VecCopy(start, X));
  for (int round = 0; round < APPROACHES; round++) {
    PetscBool filtered = PETSC_FALSE;
    PetscReal s, whole;

    /* the rest of the motion at once */
    PetscCall(VecCopy(D, Y));
    PetscCall(VecScale(Y, progress - 1.));
    PetscCall(SbModelPotentialMaxStep(m, X, Y, &part, &nactive));
    if (part == 1.) {
      PetscCall(VecAXPY(X, -1., Y));
      PetscCall(SbModelPotentialAdvance(m, 1.));
      PetscFunctionReturn(PETSC_SUCCESS);
    }

    /* in part, with Newton's steps of the bodies */
    PetscCall(SNESComputeFunction(snes, X, F));
    PetscCall(VecWAXPY(n->to.x, DIFFERENCE, D, X));
    PetscCall(SbModelPotentialAdvance(m, progress + DIFFERENCE));
    PetscCall(SNESComputeFunction(snes, n->to.x, n->to.r));
    PetscCall(SbModelPotentialAdvance(m, progress));
    PetscCall(VecAXPY(n->to.r, -1., F));
    PetscCall(VecAXPY(F, (1. - progress) / DIFFERENCE, n->to.r));
    PetscCall(find_direction(snes, &filtered, &slope));
    if (snes->reason)
      PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(VecAXPY(Y, progress - 1., D));
    PetscCall(SbModelPotentialMaxStep(m, X, Y, &s, &nactive));
    PetscCall(SbModelStrainEnergy(m, X, NULL, &energy, &before));
    for (whole = s;; s *= 0.5) {
      PetscCall(VecWAXPY(n->to.x, -s, Y, X));
      PetscCall(SbModelPotentialAdvance(m, progress + s * (1. - progress)));
      PetscCall(SbModelStrainEnergy(m, n->to.x, NULL, &energy, &inverted));

      /* a prescribed motion may invert a tet unavoidably */
      if (s < SHORTEST ||
          ((inverted <= before || s < UNAVOIDABLE * whole) && !PetscIsInfOrNanReal(energy)))
        break;
    }
    PetscCall(PetscInfo(snes, "approach %d: %g of the rest of the way, of which %g was done\n",
                        round, (double)s, (double)progress));
    snes->iter++;
    if (s < SHORTEST)
      break;
    PetscCall(VecCopy(n->to.x, X));
    progress = s == 1. ? 1. : progress + s * (1. - progress);
    if (progress == 1.)
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  snes->reason = SNES_DIVERGED_LINE_SEARCH;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the step s Y was the last; in barrier contact by its length, as stiff gaps dominate
   residuals. */
static PetscErrorCode converged(SNES snes, PetscReal s)
{
  Newton *n = (Newton *)snes->data;
  const SbRun run = n->run;
  const SbModel m = run->model;
  const PetscReal size = SbBodySmallest(m->nbody, m->body);
  PetscReal longest;
  PetscReal width = PETSC_MAX_REAL;
  PetscReal enough;
  PetscBool springs = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (!n->nblock) {
    PetscCall(SbSNESConverged(snes, snes->iter, snes->xnorm, snes->ynorm, snes->norm));

    /* the residual's rounding may exceed the tolerance */
    if (!snes->reason && n->rounding)
      snes->reason = SNES_CONVERGED_SNORM_RELATIVE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  enough = m->dynamic ? SETTLED * m->barrier_speed * run->solve.barrier_dt : SETTLED_STATIC * size;
  for (PetscInt e = 0; e < m->npotential; e++) {
    springs = (PetscBool)(springs || m->potential[e]->springs);
    width = PetscMin(width, m->potential[e]->width);
  }
  if (springs)
    enough *= STICKING;
  if (m->dynamic)
    enough = PetscMax(enough, SETTLED_LEAST * size * run->solve.barrier_dt / run->clock.dt);
  enough = PetscMin(enough, SETTLED_GAP * width);
  PetscCall(VecNorm(snes->vec_sol_update, NORM_INFINITY, &longest));
  PetscCall(PetscInfo(
    snes, "iteration %" PetscInt_FMT ": the longest step is %g m, of %g m for the last one\n",
    snes->iter, (double)longest, (double)enough));
  if (s >= 1. && longest <= enough)
    snes->reason = SNES_CONVERGED_SNORM_RELATIVE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSolve_Newton(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const Vec X = snes->vec_sol;
  const Vec F = snes->vec_func;
  const Vec Y = snes->vec_sol_update;
  const SbModel m = n->run->model;
  const PetscBool barrier = (PetscBool)(m->npotential > 0);
  PetscBool filtered = PETSC_FALSE;
  PetscReal slope = 0.;
  PetscReal s = 1.;
  PetscReal fall = 0.,
            fall_before = 0.; /* of E in this solve, and until the last check of progress, J */
  PetscInt nactive;
  PetscInt first = 0;
  PetscInt creeps = 0;

  PetscFunctionBeginUser;

  /* where it begins */
  snes->reason = SNES_CONVERGED_ITERATING;
  snes->iter = n->provisional = n->nblock = n->branch = 0;
  n->known = n->whole = n->unstable = PETSC_FALSE;
  n->kind = SB_HESSIAN_PROJECTED;
  n->shift = 0.;
  if (barrier)
    PetscCall(approach(snes));
  if (snes->reason)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!m->dynamic)
    PetscCall(SbSpaceLinearisePressure(m->space, X, NULL, -1., 1.));
  PetscCall(SNESComputeFunction(snes, X, F));
  PetscCall(VecNorm(F, NORM_2, &snes->norm));
  n->initial = snes->norm;
  PetscCall(SNESLogConvergenceHistory(snes, snes->norm, 0));
  PetscCall(SbSNESConverged(snes, 0, 0., 0., snes->norm));
  n->tolerance = snes->ttol = PetscMax(snes->ttol, n->run->solve.warm_start ? n->tolerance : 0.);
  PetscCall(SNESMonitor(snes, 0, snes->norm));

  while (!snes->reason) {
    const PetscInt linear = snes->linear_its;

    PetscCall(SbRunStopAsked(n->run, n->run->clock.step, n->run->clock.t, PETSC_TRUE));
    if (n->run->clock.stopped) {
      snes->reason = SNES_DIVERGED_MAX_IT;
      break;
    }

    /* direction, and largest step */
    PetscCall(find_direction(snes, &filtered, &slope));
    s = 1.;
    if (barrier && !snes->reason)
      PetscCall(SbModelPotentialMaxStep(m, X, Y, &s, &nactive));
    if (!snes->reason)
      PetscCall(search(snes, slope, &s));
    if (snes->reason)
      break;
    n->whole = (PetscBool)(s >= 1.);
    if (n->whole)
      filtered = PETSC_FALSE;
    n->kind = s < 1. ? SB_HESSIAN_PROJECTED : SB_HESSIAN_EXACT;

    /* convergence */
    snes->iter++;
    PetscCall(VecNorm(X, NORM_2, &snes->xnorm));
    PetscCall(VecNorm(Y, NORM_2, &snes->ynorm));
    snes->ynorm *= s;
    PetscCall(SNESLogConvergenceHistory(snes, snes->norm, snes->linear_its - linear));
    PetscCall(converged(snes, s));
    PetscCall(SNESMonitor(snes, snes->iter, snes->norm));

    /* a collapse takes hundreds of descent steps, and halving saves none: go on while E decreases
       enough */
    fall -= n->change;
    if (!snes->reason && snes->iter >= first + snes->max_its &&
        (!n->patient || ((snes->iter - first) % PATIENCE == 0 &&
                         fall - fall_before <= WORTH * PetscAbsReal(fall))))
      snes->reason = SNES_DIVERGED_MAX_IT;
    if ((snes->iter - first) % PATIENCE == 0)
      fall_before = fall;
    if (!barrier && !m->dynamic && !n->provisional)
      creeps = s < CREEP ? creeps + 1 : 0;
    if (!snes->reason && creeps == CREEPS)
      snes->reason = SNES_DIVERGED_LINE_SEARCH;

    /* lagged friction takes the normal forces of this iterate: in each of the first ones, then at
       the end */
    if (barrier && (snes->reason > 0 || (!snes->reason && snes->iter <= EARLY))) {
      PetscBool again;

      PetscCall(SbModelPotentialUpdateFriction(m, X, (PetscBool)(snes->reason > 0), &again));
      if (!again)
        continue;
      snes->reason = SNES_CONVERGED_ITERATING;
      first = snes->iter;
      n->known = PETSC_FALSE;
      PetscCall(SNESComputeFunction(snes, X, F));
      PetscCall(VecNorm(F, NORM_2, &snes->norm));
    }
  }
  PetscCall(SbSpaceLinearisePressure(m->space, NULL, NULL, 0., 0.));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSolveTangent(SbRun run, Vec B, Vec X, PetscInt *iterations, PetscBool *solved)
{
  Newton *n;
  KSPConvergedReason reason;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)run->solve.snes, SB_SNES_NEWTON, solved));
  n = (Newton *)run->solve.snes->data;
  *solved = (PetscBool)(*solved && n->nblock > 0);
  if (!*solved)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactSystemSolve(n->system, run->solve.snes->jacobian_pre, &n->blocks, PETSC_FALSE,
                                 B, X, &reason, iterations));
  if (reason < 0)
    PetscCall(VecZeroEntries(X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESSetUp_Newton(SNES snes)
{
  Newton *n = (Newton *)snes->data;
  const PetscBool barrier = (PetscBool)(n->run->model->npotential > 0);
  Vec *w;

  PetscFunctionBeginUser;
  PetscCall(SNESSetUpMatrices(snes));
  PetscCall(SNESSetWorkVecs(snes, barrier ? 13 : 6));
  w = snes->work;
  n->start = w[0];
  n->step = w[1];
  n->from.elastic = w[2];
  n->to = (Iterate){.x = w[3], .r = w[4], .elastic = w[5]};
  if (barrier) {
    n->rhs = w[6];
    n->from.contact = w[7];
    n->to.contact = w[8];
    n->best = (Iterate){.x = w[9], .r = w[10], .elastic = w[11], .contact = w[12]};
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESReset_Newton(SNES snes)
{
  Newton *n = (Newton *)snes->data;

  PetscFunctionBeginUser;
  PetscCall(SbContactSystemDestroy(&n->system));
  PetscCall(PetscFree(n->blocks.block));
  n->blocks.size = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESDestroy_Newton(SNES snes)
{
  PetscFunctionBeginUser;
  PetscCall(SNESReset_Newton(snes));
  PetscCall(PetscFree(snes->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonCreate(SNES snes)
{
  Newton *n;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&n));
  snes->data = n;
  snes->ops->setup = SNESSetUp_Newton;
  snes->ops->solve = SNESSolve_Newton;
  snes->ops->reset = SNESReset_Newton;
  snes->ops->destroy = SNESDestroy_Newton;
  snes->usesksp = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonUnstable(SNES snes, PetscBool *is)
{
  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SB_SNES_NEWTON, is));
  if (*is)
    *is = ((const Newton *)snes->data)->unstable;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNewtonSetRun(SNES snes, SbRun run)
{
  const SbModel m = run->model;
  PetscBool ours;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SB_SNES_NEWTON, &ours));
  if (ours) {
    Newton *n = (Newton *)snes->data;
    PetscBool given;

    PetscCall(PetscOptionsHasName(((PetscObject)snes)->options, ((PetscObject)snes)->prefix,
                                  "-snes_max_it", &given));
    n->patient = (PetscBool)(m->npotential && !given);
    n->run = run;
    n->least = 0.;
    for (PetscInt b = 0; b < m->nbody; b++)
      n->least += 4. * PETSC_MACHINE_EPSILON * m->material[b]->E * m->body[b].volume;
  }
  PetscCheck(
    ours || !m->npotential, m->comm, PETSC_ERR_USER_INPUT,
    "-snes_type %s does not keep surfaces apart: with contact of response barrier leave it out",
    ((PetscObject)snes)->type_name);
  PetscCall(SbModelProjectTangent(m, (PetscBool)!ours));
  PetscFunctionReturn(PETSC_SUCCESS);
}
