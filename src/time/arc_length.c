/*
  Arc-length method for static runs: an unknown load factor lambda, and the length l of a step
  prescribed,

    R(u, lambda) = f_int(u) - f_ext(u, lambda) = 0,   |d| = l,   d = u - u_n,

  so that the path continues past limit points of load and displacement. |d| is the mass-weighted
  root mean square, in m, with prescribed displacements: a cylindrical constraint (Crisfield,
  Comput. Struct. 13, 1981). Both equations are linearised together (Schweizerhof and Wriggers,
  Comput. Methods Appl. Mech. Eng. 59, 1986). With the exact tangent K and q = -dR/dlambda an
  iteration takes two solves with one factorisation,

    K r = -R,   K v = q,   dlambda = ((l^2 - |d|^2)/2 - (d, r)) / (d, v),   du = r + dlambda v.

  The predictor is along v, with the sign of (v, d), d the last step (de Souza Neto and Feng,
  Comput. Methods Appl. Mech. Eng. 179, 1999): unlike the sign of the determinant or of the work of
  the loads it is right at limit points and after bifurcations. The first step has the load
  increment 1 / static_steps, later ones are longer while iterations are few and the path is
  straight, shorter where it bends. A step that does not converge, or ends at a large angle to its
  predictor (on another branch), is halved.

  q is a finite difference of residuals, exact for loads proportional to lambda; with moving
  supports and formulas of t (here lambda) its step is small. The last step is solved at lambda = 1.

  K has negative eigenvalues after limit loads. If the factorisation counts them, a change of their
  number while the load does not turn is a bifurcation: reported, not followed. Not handled:
  contact, re-meshing.
*/
#include "sbsolver.h"
#include "time_impl.h"

#define DESIRED 6.  /* number of iterations below which steps become longer */
#define TURN .3     /* and angle between a step and its predictor */
#define MOST 25     /* largest number of iterations; then a step is halved */
#define STRAIGHT .8 /* largest angle between a step and its predictor; then it is halved, too */
#define FINE 1e-6   /* step of lambda for q where R is not linear in it */

typedef struct {
  SbRun run;
  union {
    struct {
      Vec weight; /* mass of each displacement over the total mass */
      Vec X, d, r, v, q,
        begin;   /* end of the step; d, r, v, q as above; v at the start of the step */
      Vec w, du; /* work vector; correction of X */
    };
    Vec all[9]; /* the same vectors */
  };
  PetscReal factor, delta; /* lambda at X; its finite difference step for q */
  PetscReal load;          /* |q| at the start of the run, N */
  PetscInt negative; /* negative eigenvalues of K at the start of the last step; -1: unknown */
  PetscReal turned;  /* sign of dlambda at the start of the last step */
  PetscReal angle;   /* between the step and its predictor, which measures the path's curvature */
} Path;

/* Weighted product (a, b), m^2. */
static PetscErrorCode product(Path *p, Vec a, Vec b, PetscReal *value)
{
  PetscFunctionBeginUser;
  PetscCall(VecPointwiseMult(p->w, p->weight, a));
  PetscCall(VecDot(p->w, b, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the load factor, and its prescribed displacements in X. */
static PetscErrorCode put_at(Path *p, PetscReal factor)
{
  PetscFunctionBeginUser;
  p->factor = p->run->model->load = factor;
  PetscCall(SbModelPrescribe(p->run->model, factor, p->X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* r = R(X, lambda) */
static PetscErrorCode residual(Path *p, PetscReal *norm)
{
  PetscFunctionBeginUser;
  PetscCall(SNESComputeFunction(p->run->solve.snes, p->X, p->r));
  PetscCall(VecNorm(p->r, NORM_2, norm));
  PetscCall(SNESSetFunctionNorm(p->run->solve.snes, *norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(Path *p, Vec b, Vec x, PetscBool *ok)
{
  KSPConvergedReason reason;
  PetscInt its;
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(SNESGetKSP(p->run->solve.snes, &ksp));
  PetscCall(KSPSetOperators(ksp, p->run->solve.system, p->run->solve.J));
  PetscCall(VecZeroEntries(x));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  p->run->counters.linear_step += its;
  *ok = (PetscBool)(reason > 0);
  if (!*ok)
    PetscCall(SbRunFail(p->run, "load factor %g: the linear solver ended with %s",
                        (double)p->factor, KSPConvergedReasons[reason]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Assembles K at X, and solves for v; r: the residual at X. */
static PetscErrorCode tangent(Path *p, PetscBool *ok)
{
  const SbRun run = p->run;
  const PetscReal factor = p->factor;

  PetscFunctionBeginUser;
  PetscCall(SNESComputeJacobian(run->solve.snes, p->X, run->solve.system, run->solve.J));
  run->counters.newton_step++;

  /* q; w: derivative of the prescribed displacements by lambda */
  PetscCall(VecCopy(p->X, p->w));
  PetscCall(put_at(p, factor + p->delta));
  PetscCall(SNESComputeFunction(run->solve.snes, p->X, p->q));
  PetscCall(VecAXPBY(p->q, 1. / p->delta, -1. / p->delta, p->r));
  PetscCall(VecAYPX(p->w, -1., p->X));
  PetscCall(put_at(p, factor));
  PetscCall(solve(p, p->q, p->v, ok));
  PetscCall(VecAXPY(p->v, 1. / p->delta, p->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Newton's method from X for R and the length l of the step; l = 0: for R at fixed lambda. */
static PetscErrorCode correct(Path *p, PetscReal l, PetscInt *its, PetscBool *ok)
{
  PetscReal atol, rtol, norm, dd, dr, dv;
  PetscReal more = 0.;

  PetscFunctionBeginUser;
  PetscCall(SNESGetTolerances(p->run->solve.snes, &atol, &rtol, NULL, NULL, NULL));
  for (*its = 0;; (*its)++) {
    PetscCall(residual(p, &norm));
    *ok = (PetscBool)(norm <= PetscMax(atol, rtol * p->load));
    if (*ok)
      break;
    if (PetscIsInfOrNanReal(norm) || PetscIsInfOrNanReal(p->factor)) {
      PetscCall(
        SbRunFail(p->run, "forces that are no numbers after %" PetscInt_FMT " iterations", *its));
      break;
    }
    if (*its == MOST) {
      PetscCall(SbRunFail(
        p->run, "load factor %g: the residual is still %g N after %" PetscInt_FMT " iterations",
        (double)p->factor, (double)norm, *its));
      break;
    }
    PetscCall(tangent(p, ok));
    if (!*ok)
      break;
    PetscCall(VecAXPBY(p->q, -1., 0., p->r));
    PetscCall(solve(p, p->q, p->du, ok));
    if (!*ok)
      break;
    if (l > 0.) {
      PetscCall(VecWAXPY(p->d, -1., p->run->state.U, p->X));
      PetscCall(product(p, p->d, p->d, &dd));
      PetscCall(product(p, p->d, p->du, &dr));
      PetscCall(product(p, p->d, p->v, &dv));
      more = (0.5 * (l * l - dd) - dr) / dv;
    }
    PetscCall(VecAXPY(p->du, more, p->v));
    PetscCall(VecAXPY(p->X, 1., p->du));
    PetscCall(put_at(p, p->factor + more));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same with what the X that it ends with changes; follows: the repetitions of this step, which
   its, the measure for the length of the next one, leaves out. */
static PetscErrorCode correct_followed(Path *p, PetscReal l, PetscInt *follows, PetscInt *its,
                                       PetscBool *ok)
{
  PetscBool again;
  PetscInt more;

  PetscFunctionBeginUser;
  PetscCall(correct(p, l, its, ok));
  while (*ok) {
    PetscCall(SbRunRepeat(p->run, p->factor, p->X, follows, &again));
    if (!again)
      break;
    PetscCall(correct(p, l, &more, ok));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Attempts a step of length l from U with the load factor `from`; sign: of the initial change of
   the load. */
static PetscErrorCode attempt(Path *p, PetscReal from, PetscReal l, PetscReal sign, PetscInt *its,
                              PetscBool *ok)
{
  const SbRun run = p->run;
  PetscReal vv, dd, dv;
  PetscBool far;
  PetscBool again = (PetscBool)(run->monitors.post_solve.fn != NULL);
  PetscInt follows = 0;
  PetscInt more;

  PetscFunctionBeginUser;
  PetscCall(SbModelFollowJumps(run->model, from, run->state.U, SB_STEPS_OF_LOAD, NULL));
  PetscCall(SbModelSettle(run->model, from, NULL, NULL));
  PetscCall(product(p, p->begin, p->begin, &vv));
  PetscCall(VecWAXPY(p->X, sign * l / PetscSqrtReal(vv), p->begin, run->state.U));
  PetscCall(put_at(p, from + sign * l / PetscSqrtReal(vv)));
  PetscCall(correct_followed(p, l, &follows, its, ok));

  /* too large an angle: another branch */
  PetscCall(VecWAXPY(p->d, -1., run->state.U, p->X));
  PetscCall(product(p, p->d, p->d, &dd));
  PetscCall(product(p, p->d, p->begin, &dv));
  p->angle = PetscAcosReal(PetscMax(-1., PetscMin(1., sign * dv / PetscSqrtReal(dd * vv))));
  if (*ok && !(p->angle <= STRAIGHT)) {
    *ok = PETSC_FALSE;
    PetscCall(SbRunFail(run, "load factor %g: the path turns too sharply", (double)p->factor));
  }
  PetscCall(SbRunTooFar(run, p->X, &far));
  if (far)
    *ok = PETSC_FALSE;

  /* past the end of the path: solve at lambda = 1 */
  if (*ok && from < 1. && p->factor > 1.) {
    PetscCall(VecWAXPY(p->X, (1. - from) / (p->factor - from), p->d, run->state.U));
    PetscCall(put_at(p, 1.));
    PetscCall(correct_followed(p, l = 0., &follows, &more, ok));
    *its += more;
  }
  for (int i = 0; i < SB_MAX_RESOLVES && again && *ok; i++) {
    const SbSolvedStep step = {.t = from, .dt = p->factor - from, .U = p->X, .solved = PETSC_TRUE};

    again = PETSC_FALSE;
    PetscCall((*run->monitors.post_solve.fn)(run, &step, run->monitors.post_solve.ctx, &again));
    if (again)
      PetscCall(correct_followed(p, l, &follows, &more, ok));
  }
  PetscCall(SbRunRejectInverted(run, from, p->factor - from, (Vec[2]){run->state.U, p->X}, ok));
  if (!*ok)
    PetscCall(SbModelSettle(run->model, from, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* v at the equilibrium U, in `begin`; reports a bifurcation since the last step. */
static PetscErrorCode begin_step(Path *p, PetscReal *sign, PetscBool *ok)
{
  const SbRun run = p->run;
  PetscInt negative;
  PetscReal norm, along;

  PetscFunctionBeginUser;
  PetscCall(SbModelFollowJumps(run->model, p->factor, run->state.U, SB_STEPS_OF_LOAD, NULL));
  PetscCall(residual(p, &norm));
  PetscCall(tangent(p, ok));
  if (!*ok)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecCopy(p->v, p->begin));
  if (p->load == 0.)
    PetscCall(VecNorm(p->q, NORM_2, &p->load));
  PetscCall(product(p, run->state.path, p->begin, &along));
  *sign = along < 0. ? -1. : 1.;
  PetscCall(SbSolverCountNegativeEigenvalues(run->solve.snes, run->model->space, &negative));
  if (run->solve.nonsymmetric.U)
    negative = -1; /* the matrix lacks a part of K: its inertia is unknown */
  if (negative >= 0 && p->negative >= 0 &&
      PetscAbsInt(negative - p->negative) != (*sign != p->turned) && !run->counters.bifurcations++)
    PetscCall(SbWarning(run->model->comm,
                        "load factor %g: the tangent has %" PetscInt_FMT
                        " negative eigenvalues, a step before %" PetscInt_FMT
                        ", and the load does not turn: a bifurcation was passed, and other "
                        "equilibria may be reached by a small imperfection",
                        (double)p->factor, negative, p->negative));
  p->negative = negative;
  p->turned = *sign;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbArcLengthCheck(SbRun run)
{
  const SbModel m = run->model;
  const char *name = "";
  PetscBool cg, cholmod;
  KSP ksp;

  PetscFunctionBeginUser;
  if (m->contacts.npotential)
    name = m->contacts.potential[0]->effect->name;
  if (m->contacts.nactive_set)
    name = m->contacts.active_set[0]->effect->name;
  PetscCheck(!m->contacts.nactive_set && !m->contacts.npotential, m->comm, PETSC_ERR_USER_INPUT,
             "-static_control arc_length does not know contact (effect %s): use -static_control "
             "load, or a dynamic run with damping",
             name);
  PetscCall(SNESGetKSP(run->solve.snes, &ksp));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPCG, &cg));
  PetscCall(PetscStrcmp(run->solve.solver, "cholmod", &cholmod));
  PetscCheck(!cg && !cholmod, m->comm, PETSC_ERR_USER_INPUT,
             "-static_control arc_length meets indefinite matrices, which -solver %s does not "
             "take: leave -solver to auto, or give mumps or umfpack",
             run->solve.solver);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors and weights at the start of the path, at the load factor `factor`. */
static PetscErrorCode begin_path(Path *p, PetscReal factor)
{
  const SbRun run = p->run;
  const SbModel m = run->model;
  PetscReal most;

  PetscFunctionBeginUser;
  for (int k = 0; k < 9; k++)
    PetscCall(VecDuplicate(run->state.U, &p->all[k]));
  PetscCall(VecAXPBY(p->weight, 1. / m->mass, 0., run->state.mass));

  /* whether R is linear in lambda */
  PetscCall(VecZeroEntries(p->X));
  PetscCall(put_at(p, 1.));
  PetscCall(VecNorm(p->X, NORM_INFINITY, &most));
  p->delta = most > 0. ? FINE : 1.;
  for (PetscInt e = 0; e < m->nforce; e++)
    p->delta = m->force[e]->steady ? p->delta : FINE;
  for (PetscInt e = 0; e < m->nprescribe; e++)
    p->delta = m->prescribe[e]->steady ? p->delta : FINE;
  for (PetscInt k = 0; k < m->nmaterial; k++)
    p->delta = m->material[k]->eigen || (m->material[k]->active && !m->material[k]->active->steady)
                 ? FINE
                 : p->delta;
  PetscCall(VecCopy(run->state.U, p->X));
  PetscCall(put_at(p, factor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Length of the first step, m: by the load increment 1 / static_steps or, after a load path, its
   displacement per load. */
static PetscErrorCode first_length(Path *p, PetscReal factor, PetscReal *length)
{
  const SbRun run = p->run;
  PetscReal rate, uu;

  PetscFunctionBeginUser;
  PetscCall(product(p, p->begin, p->begin, &rate));
  PetscCheck(rate > 0., run->model->comm, PETSC_ERR_USER_INPUT,
             "-static_control arc_length: no effect loads or moves the bodies more with the "
             "load factor");
  rate = PetscSqrtReal(rate);
  if (factor > 0.) {
    PetscCall(product(p, run->state.U, run->state.U, &uu));
    rate = PetscMin(rate, PetscSqrtReal(uu) / factor);
  }
  *length = run->clock.arc.first = rate / (PetscReal)run->clock.static_steps;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X becomes the state after a step of the length l in `its` iterations; l: length of the next one,
   along whose direction state.path is. */
static PetscErrorCode accept_step(Path *p, PetscInt its, PetscReal *l)
{
  const SbRun run = p->run;
  const Vec path = run->state.path;
  PetscReal length;

  PetscFunctionBeginUser;
  PetscCall(VecWAXPY(path, -1., run->state.U, p->X));
  PetscCall(product(p, path, path, &length));
  *l *= PetscMin(PetscMax(1., PetscMin(2., PetscSqrtReal(DESIRED / (PetscReal)PetscMax(its, 1)))),
                 TURN / PetscMax(p->angle, 0.5 * TURN));
  if (run->clock.arc.longest > 0.)
    *l = PetscMin(*l, run->clock.arc.longest * run->clock.arc.first);
  PetscCall(VecScale(path, *l / PetscSqrtReal(length)));
  PetscCall(VecCopy(p->X, run->state.U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether a node has moved as far as -static_max_displacement. */
static PetscErrorCode has_moved_far(SbRun run, PetscBool *is)
{
  const SbModel m = run->model;
  const PetscScalar *u;
  PetscReal most = 0.;

  PetscFunctionBeginUser;
  *is = PETSC_FALSE;
  if (run->clock.arc.displacement == 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecGetArrayRead(run->state.U, &u));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++)
    most = PetscMax(most, PetscSqr(u[3 * i]) + PetscSqr(u[3 * i + 1]) + PetscSqr(u[3 * i + 2]));
  PetscCall(VecRestoreArrayRead(run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, m->comm));
  *is = (PetscBool)(PetscSqrtReal(most) >= run->clock.arc.displacement);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Why no step of the length l succeeded after the load factor `factor`. */
static PetscErrorCode explain_end(SbRun run, PetscReal factor, PetscReal l)
{
  char why[sizeof(run->clock.stop_reason)], motion[256];
  PetscInt body;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(why, run->clock.stop_reason, sizeof(why)));
  PetscCall(SbRunFreeBody(run, &body, sizeof(motion), motion, NULL));
  if (body >= 0 && !run->counters.steps)
    PetscCall(
      SbRunFail(run, "load factor %g: nothing holds the body %s against %s; hold it by a support",
                (double)factor, run->model->body[body].name, motion));
  else
    PetscCall(SbRunFail(run,
                        "the path reached the load factor %.7g, and no step of %.1e of the first "
                        "one's length was found to go on: %s",
                        (double)factor, (double)(2. * l / run->clock.arc.first), why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbArcLengthSolve(SbRun run)
{
  const SbModel m = run->model;
  SbRunClock *clock = &run->clock;
  PetscReal factor = clock->t0;
  PetscReal sign = 1.;
  PetscReal l;
  PetscInt step = clock->step0;
  PetscInt halvings = 0;
  PetscInt its;
  PetscBool last = (PetscBool)(factor == 1.);
  PetscBool known = PETSC_FALSE;
  PetscBool unstable = PETSC_FALSE;
  PetscBool again;
  PetscBool ok;
  Path p = {.run = run, .negative = -1};

  PetscFunctionBeginUser;
  PetscCheck(!run->monitors.post_step.fn, m->comm, PETSC_ERR_USER_INPUT,
             "-static_control arc_length does not know re-meshing: leave the options -remesh_ out");
  PetscCall(begin_path(&p, factor));
  PetscCall(SbRunStepAccepted(run, step, factor, 0., last));
  PetscCall(product(&p, run->state.path, run->state.path, &l));
  l = PetscSqrtReal(l);
  while (!last) {
    /* direction and length of the step */
    if (!known) {
      PetscCall(VecCopy(run->state.U, p.X));
      PetscCall(put_at(&p, factor));
      PetscCall(begin_step(&p, &sign, &ok));
      if (!ok)
        break;
      known = PETSC_TRUE;
    }
    if (l == 0.)
      PetscCall(first_length(&p, factor, &l));

    /* a step along it, halved on failure */
    PetscCall(attempt(&p, factor, l, sign, &its, &ok));
    if (!ok) {
      run->counters.rejected++;
      run->solve.tangent_known = PETSC_FALSE;
      if (clock->stopped) {
        PetscCall(SbRunStepAccepted(run, step, factor, 0., PETSC_TRUE));
        break;
      }
      l *= 0.5;
      if (++halvings <= clock->max_halvings && l >= clock->min_increment * clock->arc.first)
        continue;
      break;
    }

    /* the new equilibrium, and the length of the next step */
    clock->stop_reason[0] = 0;
    known = PETSC_FALSE;
    halvings = 0;
    PetscCall(accept_step(&p, its, &l));

    /* the end of the path */
    PetscCall(has_moved_far(run, &last));
    last = (PetscBool)(last || p.factor == 1.);
    if (!last && step + 1 - clock->step0 == clock->arc.steps) {
      last = PETSC_TRUE;
      PetscCall(SbWarning(
        m->comm, "the path ended after -static_max_steps %" PetscInt_FMT ", at the load factor %g",
        clock->arc.steps, (double)p.factor));
    }
    if (!last)
      PetscCall(SbRunStopAsked(run, step + 1, p.factor, PETSC_FALSE));
    PetscCall(SbRunCheckStable(run, p.factor, last, PETSC_FALSE, &again, &unstable));
    last = (PetscBool)(last || clock->stopped || unstable);
    PetscCall(SbRunStepAccepted(run, ++step, p.factor, p.factor - factor, last));
    factor = p.factor;
  }
  if (unstable)
    PetscCall(SbRunFail(run, "%s", run->stability.text));
  else if (clock->stop_reason[0] && !clock->stopped && !run->solve.rejected_inverted)
    PetscCall(explain_end(run, factor, l));
  for (int k = 0; k < 9; k++)
    PetscCall(VecDestroy(&p.all[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
