/*
  time_impl.h - shared by the files of src/time.
*/
#pragma once
#define SB_CONTACT_ROUNDS \
  250 /* solves of one step before contact counts as failed; response augmented may take more than 100 */
#define SB_TIME_OF_IMPACT_LEAST 0.05 /* times of impact nearer to an end of a step do not cut it */
#define SB_FORGET 0.9                /* factor per step on the longest recent step */
#define SB_LOOKS 4                   /* most repetitions of a step that a post-solve callback asks for */
#include "sbtime.h"

#define SB_TS_SECOND_ORDER "sb_second_order"

/* The one-step methods of second_order.c. */
typedef enum {
  SB_METHOD_EULER_IMPLICIT,
  SB_METHOD_GENERALIZED_ALPHA,
  SB_METHOD_EULER_EXPLICIT,
  SB_METHOD_EULER_SYMPLECTIC
} SbMethod;
typedef struct {
  SbMethod method;
  PetscReal alpha_m, alpha_f, beta, gamma; /* generalized-alpha; fraction of the new state, as in TSALPHA2 */
  PetscBool impulses;                      /* Newmark with contact: newmark_contact.c */
  PetscBool separate;                      /* Newmark with barrier contact: the acceleration is without it */
} SbMethodSettings;

static inline PetscBool SbRunIsExplicit(SbRun run)
{
  return (PetscBool)(run->preset == SB_TIME_EULER_EXPLICIT || run->preset == SB_TIME_EULER_SYMPLECTIC);
}

PetscErrorCode SbSecondOrderRegister(void);
/* The run gives prescribed displacements, initial acceleration and the lumped mass; it is borrowed. */
void SbSecondOrderSet(TS ts, SbRun run, const SbMethodSettings *settings);

/* step.c: what happens in a step. */
/* How a step from t to t + dt is attempted; vectors and ctx are borrowed. Static runs: t is the load factor. */
typedef struct {
  PetscReal t, dt; /* s */
  Vec U0, U;       /* displacements at its start, and at its end once it is solved, m */
  PetscErrorCode (*predict)(
    void *ctx); /* U: a first guess with the prescribed values; NULL: none is needed */
  PetscErrorCode (*solve)(void *ctx, Vec U, SNESConvergedReason *reason); /* from the displacement in U */
  PetscErrorCode (*residual)(void *ctx, Vec U, Vec R); /* without constraints, N; for contact */
  /* the end state from U in `step`, if ok; else run->stop_reason says why */
  PetscErrorCode (*complete)(void *ctx, SNESConvergedReason reason, SbSolvedStep *step, PetscBool *ok);
  void *ctx;
} SbAttempt;
/* Updates the penalty on jumps of CR and DG by the state (src/fem/jump.c), and accelerations and reactions with it; changed: it did. Explicit integrators, whose stable step
   is that of the rest state, and alpha2, without a pre-step callback, keep the penalty of the rest state. Collective. */
PetscErrorCode SbRunFollowJumps(SbRun run, PetscBool *changed);
/* Attempts a step; ok: it can be accepted. Collective. */
PetscErrorCode SbRunAttempt(SbRun run, const SbAttempt *attempt, PetscBool *ok);
PetscErrorCode
SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt,
                  PetscBool last); /* calls monitors after an accepted step; also once at the start */
#define SB_NEWTON_ITERATIONS 100
/* transfer.c: the post-step function of the TS. */
PetscErrorCode SbRunAfterStep(TS ts);
/* newton.c: Newton's method as a minimisation, a SNESType. Run: the one whose steps snes solves, borrowed; after the type is set. */
#define SB_SNES_NEWTON "newton"
PetscErrorCode SbNewtonRegister(void);
PetscErrorCode SbNewtonSetRun(SNES snes, SbRun run);
/* Whether a tangent of its last solve was found not to be positive definite; never with another SNESType, or where none is `auto`. Not collective. */
PetscErrorCode SbNewtonUnstable(SNES snes, PetscBool *is);

/* stop.c: runs that end early. */
/* Options -wall_time and -stop_grace. */
PetscErrorCode SbRunReadStop(SbRun run, const SbScope *scope);
/* After a step that ended at t (within: while the next one is solved): whether the run is to end there, in run->stopped. Collective. */
PetscErrorCode SbRunStopAsked(SbRun run, PetscInt step, PetscReal t, PetscBool within);
/* While a step is solved: whether it is to be given up. Collective. */
PetscErrorCode SbRunGiveUp(SbRun run, PetscBool *given_up);
PetscErrorCode SbRunFail(SbRun run, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* After a rejected step of length dt, s: a warning when that is much less than the requested length, once until steps have that length again. */
PetscErrorCode SbRunWarnShorter(SbRun run, PetscReal dt);
/* Whether the last step was rejected by inverted.c, and one of length dt, s, would be, too. */
PetscBool SbRunTooShort(SbRun run, PetscReal dt);

/*
  inverted.c, after a step from t to t + dt was solved. Collective; nothing happens without -time_inverted reject.

  U: displacements at its start and at its end. ok: false when the step inverted tets; run->refused and run->stop_reason say so, too.
*/
PetscErrorCode SbRunRejectInverted(SbRun run, PetscReal t, PetscReal dt, const Vec U[2], PetscBool *ok);

/* callbacks.c: the model as PETSc sees it. */
PetscErrorCode SbFormI2Function(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *run);
PetscErrorCode SbFormI2Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal shift_v, PetscReal shift_a,
                                Mat J, Mat P, void *run);
/* run->operator: the shell matrix of linear solves where the assembled one lacks a part of the tangent. Collective. */
PetscErrorCode SbFormCreateOperator(SbRun run);
PetscErrorCode SbFormStaticFunction(SNES snes, Vec U, Vec F, void *run);
PetscErrorCode SbFormStaticJacobian(SNES snes, Vec U, Mat J, Mat P, void *run);
/* A = M^-1 (f_ext - C V - f_int), zero on prescribed unknowns. */
PetscErrorCode SbFormAcceleration(SbRun run, PetscReal t, Vec U, Vec V, Vec A);

/*
  newmark_contact.c, after the solves of a step of Newmark with contact from t - dt to t. Collective.

  Input:
    U       - displacement at t
  In and out:
    V       - velocity at t by Newmark's formulas, m/s; out: with the changes by contact impulses
    A       - acceleration likewise, m/s^2; out: the one with which M A + f_int - f_ext is the mean force of contact
  Output:
    own     - acceleration at t without contact: the next step begins with it
*/
PetscErrorCode SbNewmarkContact(SbRun run, PetscReal t, PetscReal dt, Vec U, Vec V, Vec A, Vec own);
/* own <- the acceleration at t without contact, of the state U, V; A at prescribed unknowns. Collective. */
PetscErrorCode SbNewmarkOwn(SbRun run, PetscReal t, Vec U, Vec V, Vec A, Vec own);

/*
  solver_list.c: when a linear solve of run->snes fails, the next solver of SbSolverNextFallback() is tried on the same system, with one warning
  line, and stays. Nothing is replaced where -ksp_type or -pc_type are the user's.

  Collective, after SbSolverFinish().
*/
PetscErrorCode SbSolverListCreate(SbRun run);
/* After a Newton step whose linear solve failed: "linear solver: ", each solver that was tried with its reason, iterations and residual, what is known of the
   causes, and advice. Collective. */
PetscErrorCode SbSolverListExplain(SbRun run, size_t size, char text[]);
/* Records for that text how the last solve of barrier contact's system failed. Not collective. */
PetscErrorCode SbSolverListContactFailed(SbRun run, KSPConvergedReason reason, PetscInt iterations);

PetscErrorCode SbStaticSolve(SbRun run); /* static.c: the load path */
/* arc_length.c: the path of equilibria with the load factor as an unknown. Collective. Check: after the solver is set up; PETSC_ERR_USER_INPUT for
   contact, and for solvers that take definite matrices only. */
PetscErrorCode SbArcLengthCheck(SbRun run);
PetscErrorCode SbArcLengthSolve(SbRun run);
/* rigid_modes.c, after a static solve: a body that can move rigidly without a force, -1: none is found; how, in words, and as displacements of the nodes, any length (along may be
   NULL). Collective. */
PetscErrorCode SbRunFreeBody(SbRun run, PetscInt *body, size_t size, char motion[], Vec along);
/* Whether the displacements X exceed the bodies' size so far that the matrix must have been singular. Collective. */
PetscErrorCode SbRunTooFar(SbRun run, Vec X, PetscBool *far);

/* energy_balance.c: energies of the state at t, s, and the energy balance of the step of length dt that ended there; `first`: at the start. Collective. */
PetscErrorCode SbRunAccount(SbRun run, PetscReal t, PetscReal dt, PetscBool first);
/* R <- the residual at t with the acceleration of the integrator, without constraints: reactions on prescribed unknowns; where it keeps none
   (TSALPHA2), inertia is left out. Forces between bodies are taken out. Collective. */
PetscErrorCode SbRunReactions(SbRun run, PetscReal t, Vec R);

/*
  SbRunSolveContact - an attempt at a step with contact: solves until the active set does not change, U from its guess to the
  solution. Collective. reason: that of the last solve, SNES_DIVERGED_MAX_IT when the set does not converge.
  With run->may_cut it ends after the first solve when points come into contact within the step: reason is then SNES_CONVERGED_ITERATING, and the
  step is to be repeated with run->arrival of its length.
*/
PetscErrorCode SbRunSolveContact(SbRun run, const SbAttempt *attempt, SNESConvergedReason *reason);
