/*
  time_impl.h - types and functions shared by the files of src/time.
*/
#pragma once
#include "sbtime.h"

#define SB_MAX_RESOLVES 4 /* most repetitions of a step by a post-solve callback */
#define SB_TS_SECOND_ORDER "sb_second_order"
#define SB_TURN (30. * PETSC_PI / 180.)       /* of supports in a load step, rad */
#define SB_TURN_CELLS (90. * PETSC_PI / 180.) /* of cells, rad */

extern const char *const SbIntegrators; /* "euler_implicit|newmark|..." in the order of the enum */

/* The one-step methods of second_order.c. */
typedef enum {
  SB_METHOD_EULER_IMPLICIT,
  SB_METHOD_GENERALIZED_ALPHA,
  SB_METHOD_EULER_EXPLICIT,
  SB_METHOD_EULER_SYMPLECTIC
} SbMethod;
typedef struct {
  SbMethod method;
  PetscReal alpha_m, alpha_f, beta,
    gamma;            /* generalized-alpha; fractions of the new state, as in TSALPHA2 */
  PetscBool impulses; /* Newmark with contact */
  PetscBool separate; /* the acceleration excludes contact's potential, whose impulse is separate */
} SbMethodSettings;

static inline PetscBool SbRunIsExplicit(SbRun run)
{
  return (PetscBool)(run->solve.preset == SB_TIME_EULER_EXPLICIT ||
                     run->solve.preset == SB_TIME_EULER_SYMPLECTIC);
}

PetscErrorCode SbSecondOrderCreate(TS ts);
/* run: source of prescribed displacements, initial acceleration and lumped mass; borrowed. */
void SbSecondOrderSet(TS ts, SbRun run, const SbMethodSettings *settings);

/* step.c: data and functions of a step, all borrowed. */
typedef struct {
  SbSolvedStep step; /* its vectors: as far as known */
  PetscErrorCode (*predict)(
    void *ctx); /* U: a guess with the prescribed values; explicit: the solution */
  PetscErrorCode (*residual)(void *ctx, Vec U,
                             Vec R); /* residual without constraints, N; for contact */
  /* computes the end state from U; if not ok run->clock.stop_reason is the reason */
  PetscErrorCode (*complete)(void *ctx, SNESConvergedReason reason, PetscBool *ok);
  void *ctx;
} SbAttempt;
/* Updates the penalty on jumps of CR and DG (src/fem/jump.c), then accelerations and reactions.
   Explicit integrators, for their stable step, and alpha2 use the penalty of the rest state.
   Collective. */
PetscErrorCode SbRunFollowJumps(SbRun run, PetscBool *changed);
/* What the end U of a load step changes, at the load factor t: the penalty on jumps of CR and DG,
   effects such as ties that tear. again: the step is to be solved once more, from U; times: how
   often the penalty changed, which ends with a warning. Collective. */
PetscErrorCode SbRunRepeat(SbRun run, PetscReal t, Vec U, PetscInt *times, PetscBool *again);
/* Attempts a step; ok: it can be accepted. Collective. */
PetscErrorCode SbRunAttempt(SbRun run, const SbAttempt *attempt, PetscBool *ok);
PetscErrorCode
SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt,
                  PetscBool last); /* saves history, calls monitors; also at the start */

/* incremental_potential.c: what Newton's method minimises, for run->solve.snes. Create: after the
   type of the SNES is known. Collective. */
typedef struct _p_SbPotential *SbPotential;
PetscErrorCode SbPotentialCreate(SbRun run);
PetscErrorCode SbPotentialDestroy(SbPotential *potential);
/* Before a solve of the step; warm: it starts from the last one's solution, with its tolerance.
   Collective. */
PetscErrorCode SbPotentialBegin(SbPotential potential, const SbSolvedStep *step, PetscBool warm);

/* The last system with barrier contact, borrowed; NULL: none in the last solve. Not collective. */
SbContactSystem SbPotentialContactSystem(SbPotential potential);

/* stop.c: early end of runs. */
/* Options -wall_time and -stop_grace. */
PetscErrorCode SbRunReadStop(SbRun run);
/* After a step that ended at t (within: in the next solve): sets run->clock.stopped if it is to
   end. Collective. */
PetscErrorCode SbRunStopAsked(SbRun run, PetscInt step, PetscReal t, PetscBool within);
PetscErrorCode SbRunFail(SbRun run, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Appends to the reason of a failed Newton's method the effects that it may be due to. */
void SbRunSuspects(SbRun run, size_t size, char text[]);
/* Whether inverted.c rejected the last step, and would reject one of length dt, s. */
PetscBool SbRunTooShort(SbRun run, PetscReal dt);

/* inverted.c, after a step from t to t + dt was solved. Collective; nothing without -time_inverted
   reject or a law that does not admit inverted tets. U: displacements at its start and end. Not ok:
   it inverted tets; sets run->solve.rejected_inverted, stop_reason. */
PetscErrorCode SbRunRejectInverted(SbRun run, PetscReal t, PetscReal dt, const Vec U[2],
                                   PetscBool *ok);

/* Why Newton's method diverged: its reason, or that the first iterate X has an inverted tet whose
   law does not admit it. Collective. */
PetscErrorCode SbRunDescribeDivergence(SbRun run, Vec X, SNESConvergedReason reason, size_t size,
                                       char text[]);

/* callbacks.c: the model for PETSc's TS and SNES. */
PetscErrorCode SbFormI2Function(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *run);
PetscErrorCode SbFormI2Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal shift_v,
                                PetscReal shift_a, Mat J, Mat P, void *run);
/* run->solve.system: the shell matrix of linear solves where the matrix lacks a part.
   Collective. */
PetscErrorCode SbFormCreateOperator(SbRun run);
PetscErrorCode SbFormStaticFunction(SNES snes, Vec U, Vec F, void *run);
PetscErrorCode SbFormStaticJacobian(SNES snes, Vec U, Mat J, Mat P, void *run);
/* A = M^-1 (f_ext - C V - f_int), 0 where prescribed; without `constrain` no contact, and A is kept
   there. */
PetscErrorCode SbFormAcceleration(SbRun run, PetscReal t, Vec U, Vec V, PetscBool constrain, Vec A);

/* solver_list.c, after SbSolverFinish(): solvers of run->solve.snes that fail are replaced from
   here on. */
PetscErrorCode SbSolverListCreate(SbRun run);
/* Before each solve: limits iterations while contact has constraints outside the matrix. Not
   collective. */
PetscErrorCode SbSolverListBeginSolve(SbRun run);
/* Message after a failed linear solve: solvers tried, with reasons, likely causes, advice.
   Collective. */
PetscErrorCode SbSolverListExplain(SbRun run, size_t size, char text[]);
/* Stores for that message how the last solve of the barrier contact system failed. Not
   collective. */
PetscErrorCode SbSolverListContactFailed(SbRun run, KSPConvergedReason reason, PetscInt iterations);

PetscErrorCode SbStaticSolve(SbRun run); /* static.c: load steps */
/* Before them: bodies that touch or overlap were shifted by S, and supports bring them back; NULL:
   only their surfaces were moved apart, or nothing was. What they have of strain energy in
   equilibrium, beyond `strain`, J, is work of the contact c. Collective. */
PetscErrorCode SbStaticPush(SbRun run, Vec S, SbContact c, PetscReal strain);
/* turn.c. The largest angle, rad, by which moving supports turn a set of nodes from the load factor
   `from` to `to`, and the effect that does. Collective. */
PetscErrorCode SbRunSupportsTurn(SbRun run, PetscReal from, PetscReal to, PetscReal *angle,
                                 SbEffect *effect);
/* Length of a load step from there, at most `length` and not below `least`, in which supports turn
   by less than SB_TURN. Collective. */
PetscErrorCode SbRunCutTurn(SbRun run, PetscReal from, PetscReal least, PetscReal *length);
/* Share of the volume that turns by more than SB_TURN_CELLS between two displacements.
   Collective. */
PetscErrorCode SbRunTurned(SbRun run, Vec U0, Vec U1, PetscReal *share);
/* stability.c, after a static solve, before the step is accepted: warns if the equilibrium
   run->state.U at this load factor is unstable, unless the step can be cut and the one before was
   stable: again, a shorter one is to be tried. stop: the run has to end after this step, with
   run->stability.text. Collective. */
PetscErrorCode SbRunCheckStable(SbRun run, PetscReal factor, PetscBool last, PetscBool may_cut,
                                PetscBool *again, PetscBool *stop);
/* arc_length.c: equilibrium path with the load factor as an unknown. Collective. Check: after the
   solver is set up; PETSC_ERR_USER_INPUT for contact, and solvers for definite matrices only. */
PetscErrorCode SbArcLengthCheck(SbRun run);
PetscErrorCode SbArcLengthSolve(SbRun run);
/* rigid_modes.c, after a static solve: a body with a free rigid motion, -1: none; motion: in words;
   along: as displacements, not normalised (may be NULL). Collective. */
PetscErrorCode SbRunFreeBody(SbRun run, PetscInt *body, size_t size, char motion[], Vec along);
/* way[nbody], m: the mean displacement of each body without supports between two states, 0 of one
   with supports; carried (or NULL): the longest displacement of a node of the latter, m.
   Collective. */
PetscErrorCode SbRunFreeWays(SbRun run, Vec from, Vec to, PetscReal way[], PetscReal *carried);
/* Whether a body without supports went farther from the state to X than its own size, beyond what
   supported bodies and obstacles did: what contact lets slip has no equilibrium nearby. Its name,
   and its mean displacement in the step, m; NULL: none. Collective. */
PetscErrorCode SbRunLostBody(SbRun run, Vec X, const char **name, PetscReal *way);
/* Whether displacements X exceed the bodies' size by far: the matrix must have been singular.
   Collective. */
PetscErrorCode SbRunTooFar(SbRun run, Vec X, PetscBool *far);

/* energy_balance.c: energies and balance of the step dt that ended at t; first: the start.
   Collective. */
PetscErrorCode SbRunAccount(SbRun run, PetscReal t, PetscReal dt, PetscBool first);
/* R = the residual at t without constraints: reactions on prescribed unknowns; for TSALPHA2, which
   stores no acceleration, without inertia. Contact forces between bodies are excluded.
   Collective. */
PetscErrorCode SbRunReactions(SbRun run, PetscReal t, Vec R);

/* integrator.c. Set-up: the TS, with its SNES. Integrate: the time loop, its failure in
   run->clock.stop_reason. Collective. */
PetscErrorCode SbRunSetUpIntegrator(SbRun run);
PetscErrorCode SbRunIntegrate(SbRun run);
/* contact_check.c: errors unless integrator and solver go with the contact of the scene. */
PetscErrorCode SbRunCheckContact(SbRun run);

/* solve.c. */
/* Type, tolerances and options of run->solve.snes, and of the TS. Collective. */
PetscErrorCode SbRunSetUpSolver(SbRun run);
/* Before each solve of an attempt: effects move, surfaces are updated, candidates of contact are
   found; warm: U is the last solution, else the predictor's guess. Collective. */
PetscErrorCode SbRunBeginSolve(SbRun run, const SbAttempt *attempt, PetscBool warm);
/* Solves a step by run->solve.snes, with contact until the active set does not change; U: initial
   guess, then solution. Collective. reason: of the last solve; SNES_DIVERGED_MAX_IT if the active
   set does not converge. With run->clock.may_end_at_impact, if nodes come into contact within the
   step, it ends after the first solve with SNES_CONVERGED_ITERATING: to be repeated with the
   fraction run->clock.time_of_impact of its length. */
PetscErrorCode SbRunSolveStep(SbRun run, const SbAttempt *attempt, SNESConvergedReason *reason);
/* Warns, once, of a body that would go farther than its size in the step and meets something on the
   way. Collective. */
PetscErrorCode SbRunWarnLongWay(SbRun run, const SbSolvedStep *step);

/* Warns, once, that the user's absolute tolerance `option` is above `norm`, N, of `what`, so that
   the run begins without an iteration; norm: of a solve that ended so, above rounding where there
   is something to solve. Collective. */
PetscErrorCode SbRunWarnIdle(SbRun run, const char *option, PetscReal norm, const char *what);
