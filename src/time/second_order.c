/*
  The TSType of the second-order integrators, with the n displacements as unknowns.

  The unknown of a step is the end displacement u1; with s = u1 - u0
    generalized-alpha (Chung and Hulbert 1993; fractions of the new state as in PETSc's TSALPHA2)
      a1 = (s - h v0 - h^2 (1/2 - beta) a0) / (beta h^2),  v1 = v0 + h ((1 - gamma) a0 + gamma a1)
      F(t0 + alpha_f h, u0 + alpha_f s, v0 + alpha_f (v1 - v0), a0 + alpha_m (a1 - a0)) = 0
    Newmark: alpha_m = alpha_f = 1; with contact: below, a0 is the acceleration without contact
    implicit Euler: v1 = s / h, a1 = (v1 - v0) / h (it is not a Newmark method)
    explicit Euler: u1 = u0 + h v0, v1 = v0 + h a0; symplectic: v1 = v0 + h a0, u1 = u0 + h v1; M a0
    = f0

  Barrier contact: its force f = -dB/du is evaluated at the end of the step, the only state known to
  be free of collisions. In Newmark's method, where the mean of both ends would gain energy, it is
  implicit (Kane, Repetto, Ortiz and Marsden 1999), with the stored a without contact:

    u1 = u0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1) + h^2/2 M^-1 f
    v1 = v0 + h ((1 - gamma) a0 + gamma a1) + h M^-1 f

  (the equation of a is that of generalized-alpha at its stage). Newmark's formula for a1 then gives
  a1 + M^-1 f / (2 beta), the residual contains -f / (2 beta), and damping the velocity 2 (u1 - u0)
  / h - v0. The work of the impulse h f over u1 - u0 is at most the decrease of B, as B is convex:
  contact only dissipates.

  With multipliers (SbContact.rigid) generalized-alpha has contact in the same way, with the weight
  alpha_m / (2 beta alpha_f) in its residual. As a force at the end of the step an impact is in a1
  once more in the step that follows: with rho = 1/2 a node that meets a wall with V leaves with
  1.25 V. As an impulse it leaves with V at most.

  The acceleration is part of the state (run->state.A), so a restart continues exactly. A step may
  be repeated once, up to the first time of impact; the remainder is the next step (solve.c). A
  step whose solve fails is halved and repeated; after four good steps its length doubles, up to the
  nominal one. The local error for TSAdapt is h^2 (beta - 1/6) (a1 - a0) (Zienkiewicz and Xie 1991),
  for implicit Euler h^2/2 a1.

  Newmark with contact: the trapezoidal rule with implicit contact forces. With a the acceleration
  without contact, M a = f_ext - f_int(u) - C v, and G^T lambda the contact forces at the end of the
  step (Kane, Repetto, Ortiz and Marsden, "Finite element analysis of nonsmooth contact", CMAME 180,
  1999: beta = 1/4, gamma = 1/2 there, 1/2 and 1 for contact)

    u1 = u0 + h v0 + h^2/4 (a0 + a1) + h^2/2 M^-1 G^T lambda,    v* = v0 + h/2 (a0 + a1) + h M^-1
    G^T lambda.

  So u1 - u0 = h (v0 + v*) / 2, and a linear body gains lambda . (g1 - g0), g the gaps: active nodes
  have g1 = 0, so an impact dissipates energy and persistent contact conserves it. But G v* is not
  zero: a node with g0 = 0 has v* = -v0, and separates in the next step or its force oscillates.
  Hence the velocity at the end is

    v1 = v* + M^-1 G^T mu  with  G v1 = w,

  w the velocities of obstacles: the persistency condition of Laursen and Love (IJNME 53, 2002). As
  the closest velocity in the mass norm it dissipates energy, too, m v^2 / 2 of each impacting node
  with the nodal mass m: an impact of the nodes without restitution, which vanishes with the size of
  the cells. In the next step their a0 and contact force are in balance, and forces are steady.
  (Deuflhard, Krause and Ertel, IJNME 73, 2008, project the predictor instead; their nodes keep the
  velocity before the impact until they part.)

  As s = u1 - u0 Newmark's own formula with a0 gives A = a1 + 2 M^-1 G^T lambda, and M A + C v* +
  f_int(u1) - f_ext = 2 G^T lambda: the solvers need no change. The stored acceleration is a1 + M^-1
  G^T (lambda + mu / h), with the mean contact force over the step, whose product with h is the
  change of momentum.

  petsc/private/tsimpl.h: PETSc has no public way to write a TSType.
*/
#include <petsc/private/tsimpl.h>
#include "time_impl.h"

#define SHORTEST 1e-9 /* shortest step over the nominal one; a failure below that ends the run */

typedef struct {
  SbRun run;
  SbMethodSettings set;
  union {
    struct {
      Vec X0, V0, X1, V1, A1; /* state at the start of the step; state at its end */
      Vec Xa, Va, Aa;         /* stage of generalized-alpha; NULL when the stage is the end */

      /* Newmark with contact: accelerations without contact at start and end; else NULL */
      Vec free0, free1;
      Vec work; /* NULL with explicit methods */
    };
    Vec all[11]; /* the same vectors */
  };
  Vec U, V, A; /* where the equation is evaluated; borrowed */

  /* a step that was divided at a time of impact, s; 0: none. The remainder ends at the original
     time */
  PetscReal remainder, undivided; /* length of its second part, and of both */
  PetscBool started;              /* run->state.A holds the acceleration of the current state */
} SecondOrder;

/* Computes v1 and a1 from the end displacement X. */
static PetscErrorCode end_state(TS ts, Vec X)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const PetscReal h = ts->time_step;
  const PetscReal beta = so->set.beta;
  const PetscReal gamma = so->set.gamma;
  const Vec A0 = so->free0 ? so->free0 : so->run->state.A;

  PetscFunctionBeginUser;
  if (so->set.method == SB_METHOD_EULER_IMPLICIT) {
    PetscCall(VecWAXPY(so->V1, -1., so->X0, X));
    PetscCall(VecScale(so->V1, 1. / h));
    PetscCall(VecWAXPY(so->A1, -1., so->V0, so->V1));
    PetscCall(VecScale(so->A1, 1. / h));
  } else {
    PetscCall(VecWAXPY(so->A1, -1., so->X0, X));
    PetscCall(
      VecAXPBYPCZ(so->A1, -1. / (beta * h), 1. - 0.5 / beta, 1. / (beta * h * h), so->V0, A0));
    PetscCall(VecCopy(so->V0, so->V1));
    if (so->set.separate && !so->Xa)
      PetscCall(VecAXPBYPCZ(so->V1, 2. / h, -2. / h, -1., X, so->X0));
    else
      PetscCall(VecAXPBYPCZ(so->V1, h * (1. - gamma), h * gamma, 1., A0, so->A1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets U, V and A, where the equation is evaluated, and its time. */
static PetscErrorCode stage_state(TS ts, Vec X, PetscReal *t)
{
  SecondOrder *so = (SecondOrder *)ts->data;

  PetscFunctionBeginUser;
  PetscCall(end_state(ts, X));
  *t = ts->ptime + so->set.alpha_f * ts->time_step;
  so->U = so->Xa ? so->Xa : X;
  so->V = so->Xa ? so->Va : so->V1;
  so->A = so->Xa ? so->Aa : so->A1;
  if (so->Xa) {
    PetscCall(VecWAXPY(so->Xa, -1., so->X0, X));
    PetscCall(VecAYPX(so->Xa, so->set.alpha_f, so->X0));
    PetscCall(VecWAXPY(so->Va, -1., so->V0, so->V1));
    PetscCall(VecAYPX(so->Va, so->set.alpha_f, so->V0));
    PetscCall(VecWAXPY(so->Aa, -1., so->run->state.A, so->A1));
    PetscCall(VecAYPX(so->Aa, so->set.alpha_m, so->run->state.A));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Divided by alpha_f, so that the factor of the stiffness in the tangent is one. */
static PetscErrorCode SNESTSFormFunction_SecondOrder(SNES snes, Vec X, Vec F, TS ts)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  PetscReal t = 0.;

  PetscFunctionBeginUser;
  (void)snes;
  PetscCall(stage_state(ts, X, &t));
  PetscCall(TSComputeI2Function(ts, t, so->U, so->V, so->A, F));
  if (so->set.alpha_f != 1.)
    PetscCall(VecScale(F, 1. / so->set.alpha_f));
  if (so->run->model->barrier_apart)
    PetscCall(SbContactSetGradient(&so->run->model->contacts, X, so->run->solve.barrier_weight,
                                   PETSC_TRUE, NULL, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode SNESTSFormJacobian_SecondOrder(SNES snes, Vec X, Mat J, Mat P, TS ts)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const PetscReal h = ts->time_step;
  PetscReal t = 0.;
  PetscReal shift_v = 1. / h;
  PetscReal shift_a = 1. / (h * h);

  PetscFunctionBeginUser;
  (void)snes;
  PetscCall(stage_state(ts, X, &t));
  if (so->set.method == SB_METHOD_GENERALIZED_ALPHA) {
    shift_v = so->set.separate && !so->Xa ? 2. / h : so->set.gamma / (so->set.beta * h);
    shift_a = so->set.alpha_m / (so->set.alpha_f * so->set.beta * h * h);
  }
  PetscCall(TSComputeI2Jacobian(ts, t, so->U, so->V, so->A, shift_v, shift_a, J, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets X1 to the initial guess, with the prescribed values of the end time; explicit: to the
   solution. */
static PetscErrorCode predict(void *ctx)
{
  const TS ts = (TS)ctx;
  SecondOrder *so = (SecondOrder *)ts->data;
  const SbRun run = so->run;
  const PetscReal h = ts->time_step;
  PetscReal part;
  PetscBool warm;
  KSP ksp;

  PetscFunctionBeginUser;
  if (!ts->usessnes) {
    PetscCall(VecWAXPY(so->V1, h, run->state.A, so->V0));
    PetscCall(
      VecWAXPY(so->X1, h, so->set.method == SB_METHOD_EULER_EXPLICIT ? so->V0 : so->V1, so->X0));
    PetscCall(SbModelPrescribe(run->model, ts->ptime + h, so->X1));
    PetscCall(SbFormAcceleration(run, ts->ptime + h, so->X1, so->V1, PETSC_TRUE, so->A1));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecCopy(so->X0, so->X1));
  if (run->solve.velocity_predictor) {
    /* unless that inverts a tet whose law does not admit it */
    PetscCall(SbSpaceLongestStep(run->model->space, so->X0, so->V0, -h, &part));
    if (part == 1.)
      PetscCall(VecAXPY(so->X1, h, so->V0));
  }
  PetscCall(SbModelPrescribe(run->model, ts->ptime + h, so->X1));

  /* one linear solve per step: the update (X <- X - Y) has free flight as initial guess */
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &warm));
  if (run->solve.single && warm) {
    Vec Y;

    PetscCall(SNESGetSolutionUpdate(ts->snes, &Y));
    if (Y)
      PetscCall(VecAXPBY(Y, run->solve.velocity_predictor ? 0. : -h, 0., so->V0));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* R = the residual without contact forces, for contact iterations. */
static PetscErrorCode contact_residual(void *ts, Vec X, Vec R)
{
  SecondOrder *so = (SecondOrder *)((TS)ts)->data;
  PetscReal t = 0.;

  PetscFunctionBeginUser;
  PetscCall(stage_state((TS)ts, X, &t));
  PetscCall(SbModelResidual(so->run->model, t, so->U, so->V, so->A, PETSC_FALSE, R));

  /* Newmark multiplies the contact force at the end by two, that at the start by zero */
  PetscCall(VecScale(R, so->set.impulses ? 0.5 : 1. / so->set.alpha_f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static SbSolvedStep solved_step(TS ts)
{
  const SecondOrder *s = (SecondOrder *)ts->data;

  return (SbSolvedStep){ts->ptime, ts->time_step, s->X0, s->V0,       s->run->state.A,
                        s->X1,     s->V1,         s->A1, ts->usessnes};
}

/* Whether the state at the end is finite, and positions and velocities within SB_LENGTH_MAX. Not
   by norms: MPI_MAX may lose what is not a number. */
static PetscErrorCode is_finite(TS ts, PetscBool *ok)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const Vec state[] = {so->X1, so->V1, so->A1};
  const PetscScalar *x;
  PetscInt n;

  PetscFunctionBeginUser;
  *ok = PETSC_TRUE;
  PetscCall(VecGetLocalSize(so->X1, &n));
  for (int k = 0; k < 3; k++) {
    PetscCall(VecGetArrayRead(state[k], &x));
    if (k < 2)
      *ok = (PetscBool)(*ok && SbLengthsFit(n, x));
    for (PetscInt i = 0; i < n && k == 2; i++)
      *ok = (PetscBool)(*ok && !PetscIsInfOrNanReal(x[i]));
    PetscCall(VecRestoreArrayRead(state[k], &x));
  }
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  A step that ended before it was solved: its velocity keeps what was left of the displacement, w =
  left / h, so that bodies which a collision holds up lose time, not speed. Bodies that touch
  nothing keep all of it, the others as much as makes no energy, and lose what they have too much.
  With the predictor X0 + h V0, E = |V - V0|^2 / 2 + psi at X0 + h V (norms by mass, psi of strain,
  contact and loads): kinetic energy may be |V0|^2 / 2 less the change of psi, which is |V1 - V0|^2
  / 2 less the change of E from X0 to X1.
*/
static PetscErrorCode carry_over(SecondOrder *so, PetscReal h)
{
  enum {
    CHANGED,
    ALONE,
    KINETIC,
    ALONG,
    MORE,
    NSUM
  };
  const SbRun run = so->run;
  const SbSpace s = run->model->space;
  PetscReal sum[NSUM] = {0.}; /* twice energies, J */
  PetscReal change, room;
  PetscReal part = 0.;
  PetscReal factor = 1.;
  const PetscScalar *mass, *v0;
  PetscScalar *v, *w;

  PetscFunctionBeginUser;
  PetscCall(VecNorm(run->solve.left, NORM_INFINITY, &run->solve.longest_left));
  PetscCall(VecScale(run->solve.left, 1. / h));
  PetscCall(VecGetArrayRead(run->state.mass, &mass));
  PetscCall(VecGetArrayRead(so->V0, &v0));
  PetscCall(VecGetArray(so->V1, &v));
  PetscCall(VecGetArray(run->solve.left, &w));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++) {
    sum[CHANGED] += mass[i] * PetscSqr(v[i] - v0[i]);
    if (run->solve.alone[s->node_body[i / 3]]) {
      v[i] += w[i];
      sum[ALONE] += mass[i] * PetscSqr(v[i]);
      continue;
    }
    sum[KINETIC] += mass[i] * PetscSqr(v[i]);
    sum[ALONG] += mass[i] * v[i] * w[i];
    sum[MORE] += mass[i] * PetscSqr(w[i]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, NSUM, MPIU_REAL, MPI_SUM, s->comm));

  /* the largest part <= 1 of w, or a smaller factor of v, within what kinetic energy may be */
  PetscCall(SbNewtonChange(run->solve.snes, &change));
  room = sum[CHANGED] - 2. * change - sum[ALONE] - sum[KINETIC];
  if (room < 0. && sum[KINETIC] > 0.)
    factor = PetscSqrtReal(PetscMax(0., 1. + room / sum[KINETIC]));
  else if (sum[MORE] > 0.)
    part = PetscMin(1., (PetscSqrtReal(PetscSqr(sum[ALONG]) + sum[MORE] * room) - sum[ALONG]) /
                          sum[MORE]);
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (!run->solve.alone[s->node_body[i / 3]] && mass[i] > 0.)
      v[i] = factor * v[i] + part * w[i];
  PetscCall(VecRestoreArray(run->solve.left, &w));
  PetscCall(VecRestoreArray(so->V1, &v));
  PetscCall(VecRestoreArrayRead(so->V0, &v0));
  PetscCall(VecRestoreArrayRead(run->state.mass, &mass));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes velocity and acceleration at the end. */
static PetscErrorCode complete(void *ctx, SNESConvergedReason reason, PetscBool *ok)
{
  const TS ts = (TS)ctx;
  SecondOrder *so = (SecondOrder *)ts->data;
  const SbRun run = so->run;
  const PetscReal h = ts->time_step;
  const char *unsettled = SbContactSetUnsettled(&run->model->contacts);

  PetscFunctionBeginUser;
  if (ts->usessnes)
    PetscCall(end_state(ts, so->X1));
  PetscCall(is_finite(ts, ok));
  *ok = (PetscBool)(*ok && reason > 0 && !unsettled[0]);
  run->solve.longest_left = 0.;
  if (*ok && run->solve.left && reason == SNES_CONVERGED_ITS)
    PetscCall(carry_over(so, h));
  if (*ok && so->set.separate) {
    /* barrier contact: adds its impulse to the velocity, and removes it from the acceleration */
    PetscCall(VecZeroEntries(so->work));
    PetscCall(SbContactSetGradient(&run->model->contacts, so->X1, -1., PETSC_TRUE, NULL, so->work));
    PetscCall(VecPointwiseDivide(so->work, so->work, run->state.mass));
    PetscCall(VecAXPY(so->A1, -0.5 / so->set.beta, so->work));
    PetscCall(VecWAXPY(so->V1, h, so->work, so->V0));
    PetscCall(VecAXPY(so->V1, h * (1. - so->set.gamma), run->state.A));
    PetscCall(VecAXPY(so->V1, h * so->set.gamma, so->A1));
  }
  if (*ok && so->set.impulses) {
    /* contact: adds its impulse to the velocity, and the mean force over the step to the
       acceleration */
    PetscCall(VecCopy(so->V1, so->work));
    if (SbSpaceIsConstrained(run->model->space))
      PetscCall(
        SbContactSetProjectVelocity(&run->model->contacts, ts->ptime + h, h, so->X1, so->V1));
    PetscCall(VecAYPX(so->work, -1., so->V1));
    PetscCall(VecCopy(so->A1, so->free1));
    PetscCall(SbFormAcceleration(run, ts->ptime + h, so->X1, so->V1, PETSC_FALSE, so->free1));
    PetscCall(VecAXPBY(so->A1, 0.5, 0.5, so->free1));
    PetscCall(VecAXPY(so->A1, 1. / h, so->work));
  }
  if (!*ok && !ts->usessnes) {
    char inverted[512];

    PetscCall(SbSpaceDescribeInverted(run->model->space, so->X1, sizeof(inverted), inverted));
    if (inverted[0])
      PetscCall(SbRunFail(run,
                          "step %" PetscInt_FMT
                          " at t = %g s with a length of %g s: %s, as may be a shorter -ts_dt",
                          ts->steps + 1, (double)ts->ptime, (double)h, inverted));
    else
      PetscCall(
        SbRunFail(run,
                  "step %" PetscInt_FMT
                  " at t = %g s: the explicit solution is not finite, or beyond 1e15 m; its step "
                  "of %g s is beyond the stable one (see the header)",
                  ts->steps + 1, (double)ts->ptime, (double)h));
  } else if (!*ok && reason != SNES_CONVERGED_ITERATING) {
    char why[512] = "";
    char diverged[512];
    const char *what = diverged;

    PetscCall(SbRunDescribeDivergence(run, so->X1, reason, sizeof(diverged), diverged));
    if (unsettled[0])
      what = unsettled;
    else if (reason > 0)
      what = "the solution is not finite, or beyond 1e15 m";
    else if (reason == SNES_DIVERGED_LINEAR_SOLVE)
      PetscCall(SbSolverListExplain(run, sizeof(why), why));
    else
      PetscCall(SbContactSetNearest(&run->model->contacts, sizeof(why), why));
    SbRunSuspects(run, sizeof(why), why);
    PetscCall(SbRunFail(run, "step %" PetscInt_FMT " at t = %g s with a length of %g s: %s%s%s",
                        ts->steps + 1, (double)ts->ptime, (double)h, what, why[0] ? "; " : "",
                        why));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The acceleration and the penalty on jumps at the start of a step, and a copy of its state, to
   which a rejected attempt returns. */
static PetscErrorCode begin_step(TS ts)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const SbRun run = so->run;
  PetscBool jumps;

  PetscFunctionBeginUser;

  /* a restarted run has its acceleration: that of generalized-alpha does not follow from the other
     state */
  if (!so->started && run->clock.step0 == 0 && so->set.method != SB_METHOD_EULER_IMPLICIT)
    PetscCall(
      SbFormAcceleration(run, ts->ptime, ts->vec_sol, ts->vec_dot, PETSC_TRUE, run->state.A));

  /* the penalty on jumps of CR and DG for this step */
  PetscCall(SbRunFollowJumps(run, &jumps));
  if (so->free0 && (!so->started || jumps)) {
    PetscCall(VecCopy(run->state.A, so->free0));
    PetscCall(SbFormAcceleration(run, ts->ptime, ts->vec_sol, ts->vec_dot, PETSC_FALSE, so->free0));
  }
  so->started = PETSC_TRUE;

  PetscCall(VecCopy(ts->vec_sol, so->X0));
  PetscCall(VecCopy(ts->vec_dot, so->V0));
  run->solve.stage.U = so->Xa;
  run->solve.stage.start = so->X0;
  run->solve.stage.part = so->set.alpha_f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the error of a solved attempt lets it be accepted, and the length of the next one, s. */
static PetscErrorCode choose_length(TS ts, PetscReal *next, PetscBool *accept)
{
  const SecondOrder *so = (const SecondOrder *)ts->data;
  const SbRun run = so->run;
  PetscReal h = ts->time_step;
  PetscBool fixed;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->adapt, TSADAPTNONE, &fixed));
  if (fixed) {
    /* return to the nominal length: double it after four steps without halving */
    if (run->clock.good_steps >= 3)
      h = PetscMin(2. * ts->time_step, run->clock.dt);

    /* the remainder of a step after a time of impact, and the length from before it */
    if (so->undivided > 0.)
      h = so->remainder > 0. ? so->remainder : so->undivided;
  }
  PetscCall(TSAdaptChoose(ts->adapt, ts, h, NULL, next, accept));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Stresses of viscoelastic bodies and of fibres that contract are those of a time after the last
   step, which ended at U, V. */
static PetscErrorCode stresses_at(SecondOrder *so, PetscReal elapsed, Vec U, Vec V)
{
  const PetscBool second = (PetscBool)(so->set.method == SB_METHOD_GENERALIZED_ALPHA);

  PetscFunctionBeginUser;
  PetscCall(SbSpaceViscousAt(so->run->model->space, elapsed, second, U, V));
  PetscCall(SbSpaceActiveRates(so->run->model->space, elapsed, second, U, V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The end of the attempt becomes the state; next: length of the next step, s. */
static PetscErrorCode accept_step(TS ts, PetscReal next)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const SbRun run = so->run;
  SbRunClock *clock = &run->clock;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(so->A1, run->state.A));
  if (so->free0)
    PetscCall(VecCopy(so->free1, so->free0));
  if (run->monitors.want_energies)
    PetscCall(SbSpaceViscousWork(run->model->space, (Vec[2]){so->X0, ts->vec_sol},
                                 (Vec[2]){so->V0, ts->vec_dot},
                                 &run->state.energies.viscosity_loss));
  PetscCall(SbSpaceViscousAdvance(run->model->space, ts->time_step, so->X0, ts->vec_sol,
                                  run->monitors.want_energies ? &run->state.energies.relaxation_loss
                                                              : NULL));
  PetscCall(stresses_at(so, 0., ts->vec_sol, ts->vec_dot));
  ts->ptime += ts->time_step;
  clock->good_steps = next > ts->time_step ? 0 : clock->good_steps + 1;
  clock->stop_reason[0] = 0;
  ts->time_step = next;

  /* a step up to an impact, or its remainder */
  if (so->remainder > 0.)
    so->remainder = 0.;
  else
    so->undivided = 0.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The length after a failed attempt, s: half of it; or up to the time of impact, which is no
   failure and whose remainder is the next step. */
static PetscReal shorter_length(TS ts, PetscInt *halvings)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const PetscReal impact = so->run->clock.time_of_impact;
  PetscReal next = 0.5 * ts->time_step;

  so->undivided = so->remainder = 0.;
  if (!so->run->solve.rejected_inverted && impact < 1.) {
    next = impact * ts->time_step;
    so->undivided = ts->time_step;
    so->remainder = ts->time_step - next;
    (*halvings)--;
  }
  return next;
}

/* Back to the start of the step, to repeat it with the length `next`, s; *again: that may help.
   solved: its error alone was too large; an explicit step that failed fails with any length. */
static PetscErrorCode reject_attempt(TS ts, PetscBool solved, PetscReal next, PetscInt *halvings,
                                     PetscBool *again)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const SbRun run = so->run;
  SbRunClock *clock = &run->clock;
  const PetscBool hopeless = (PetscBool)((!ts->usessnes && !solved) || clock->stopped);

  PetscFunctionBeginUser;
  PetscCall(VecCopy(so->X0, ts->vec_sol));
  PetscCall(VecCopy(so->V0, ts->vec_dot));
  PetscCall(stresses_at(so, 0., so->X0, so->V0));
  ts->reject++;
  run->counters.rejected++;
  clock->good_steps = 0;

  /* bounds the number of halvings, also when steps in between succeed */
  *again = (PetscBool)(!hopeless && ++*halvings <= clock->max_halvings &&
                       next >= SHORTEST * clock->dt && !SbRunTooShort(run, next));
  if (*again) {
    ts->time_step = next;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  ts->reason = TS_DIVERGED_STEP_REJECTED;
  if (!hopeless && clock->stop_reason[0])
    SbAppend(sizeof(clock->stop_reason), clock->stop_reason,
             "; try a shorter -ts_dt, or loads and motions that begin gently "
             "(docs/guides/when_it_fails.md, R1)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TSStep_SecondOrder(TS ts)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const SbRun run = so->run;
  PetscInt halvings = 0;
  PetscBool again = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(begin_step(ts));
  while (again) {
    const SbAttempt attempt = {solved_step(ts), predict, contact_residual, complete, ts};
    PetscBool ok = PETSC_FALSE;
    PetscBool accept = PETSC_FALSE;
    PetscReal next;

    /* one attempt */
    run->clock.may_end_at_impact =
      (PetscBool)(run->model->contacts.ends_step && !halvings && so->undivided == 0.);
    run->clock.time_of_impact = 1.;
    PetscCall(stresses_at(so, so->set.alpha_f * ts->time_step, so->X0, so->V0));
    PetscCall(SbModelActiveAt(run->model, ts->ptime + so->set.alpha_f * ts->time_step));
    PetscCall(SbRunAttempt(run, &attempt, &ok));
    ts->snes_its = run->counters.newton - run->counters.newton_before + run->counters.newton_step;
    ts->ksp_its = run->counters.linear - run->counters.linear_before + run->counters.linear_step;

    /* its error, and the next length */
    if (ok) {
      PetscCall(VecCopy(so->X1, ts->vec_sol));
      PetscCall(VecCopy(so->V1, ts->vec_dot));
      PetscCall(choose_length(ts, &next, &accept));
    } else
      next = shorter_length(ts, &halvings);

    if (accept) {
      PetscCall(accept_step(ts, next));
      break;
    }
    PetscCall(reject_attempt(ts, ok, next, &halvings, &again));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* order: power of h in the error of one step. */
static PetscErrorCode TSEvaluateWLTE_SecondOrder(TS ts, NormType type, PetscInt *order,
                                                 PetscReal *wlte)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const PetscReal h = ts->time_step;
  PetscReal absolute, relative;

  PetscFunctionBeginUser;
  if (so->run->monitors.post_solve.error) {
    const SbSolvedStep step = solved_step(ts);

    PetscCall((*so->run->monitors.post_solve.error)(so->run, &step,
                                                    so->run->monitors.post_solve.ctx, order, wlte));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (so->set.method == SB_METHOD_GENERALIZED_ALPHA) {
    PetscCall(VecWAXPY(so->work, -1., so->run->state.A, so->A1));
    PetscCall(VecAYPX(so->work, h * h * (so->set.beta - 1. / 6.), so->X1));
    *order = 3;
  } else {
    PetscCall(VecWAXPY(so->work, 0.5 * h * h, so->A1, so->X1));
    *order = 2;
  }
  PetscCall(TSErrorWeightedNorm(ts, so->X1, so->work, type, wlte, &absolute, &relative));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cubic Hermite interpolation between both ends; t lies in the last step. */
static PetscErrorCode TSInterpolate_SecondOrder(TS ts, PetscReal t, Vec X)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const PetscReal h = ts->ptime - ts->ptime_prev;
  const PetscReal s = (t - ts->ptime_prev) / h;

  PetscFunctionBeginUser;
  PetscCall(
    VecAXPBYPCZ(X, 1. - s * s * (3. - 2. * s), s * s * (3. - 2. * s), 0., so->X0, ts->vec_sol));
  PetscCall(
    VecAXPBYPCZ(X, h * s * (1. - s) * (1. - s), -h * s * s * (1. - s), 1., so->V0, ts->vec_dot));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TSSetUp_SecondOrder(TS ts)
{
  SecondOrder *so = (SecondOrder *)ts->data;
  const PetscBool staged = (PetscBool)(so->set.alpha_f != 1. || so->set.alpha_m != 1.);

  PetscFunctionBeginUser;

  /* in the order of the vectors: both ends, stage, accelerations without contact, work */
  for (int k = 0; k < 11; k++) {
    PetscBool needed = PETSC_TRUE;

    if (k >= 5)
      needed = staged;
    if (k >= 8)
      needed = so->set.impulses;
    if (k >= 10)
      needed = ts->usessnes;
    if (needed)
      PetscCall(VecDuplicate(ts->vec_sol, &so->all[k]));
  }
  PetscCall(TSGetAdapt(ts, &ts->adapt));
  PetscCall(TSAdaptCandidatesClear(ts->adapt));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TSReset_SecondOrder(TS ts)
{
  PetscFunctionBeginUser;
  for (int k = 0; k < 11; k++)
    PetscCall(VecDestroy(&((SecondOrder *)ts->data)->all[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode TSDestroy_SecondOrder(TS ts)
{
  PetscFunctionBeginUser;
  PetscCall(TSReset_SecondOrder(ts));
  PetscCall(PetscFree(ts->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSecondOrderSet(TS ts, SbRun run, const SbMethodSettings *settings)
{
  SecondOrder *so = (SecondOrder *)ts->data;

  so->run = run;
  so->set = *settings;
  ts->usessnes = (PetscBool)!SbRunIsExplicit(run);
}

PetscErrorCode SbSecondOrderCreate(TS ts)
{
  SecondOrder *so;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&so));
  ts->data = so;
  ts->ops->setup = TSSetUp_SecondOrder;
  ts->ops->reset = TSReset_SecondOrder;
  ts->ops->destroy = TSDestroy_SecondOrder;
  ts->ops->step = TSStep_SecondOrder;
  ts->ops->evaluatewlte = TSEvaluateWLTE_SecondOrder;
  ts->ops->interpolate = TSInterpolate_SecondOrder;
  ts->ops->snesfunction = SNESTSFormFunction_SecondOrder;
  ts->ops->snesjacobian = SNESTSFormJacobian_SecondOrder;
  ts->default_adapt_type = TSADAPTNONE;
  ts->usessnes = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}
