/*
  time_impl.h - types and functions shared by the files of src/time.
*/
#pragma once
#define SB_CONTACT_ROUNDS \
  250 /* largest number of solves per step with contact; response augmented may take more than 100 */
#define SB_TIME_OF_IMPACT_LEAST \
  0.05 /* least distance of a time of impact from the ends of a step, over its length, for a division */
#define SB_FORGET 0.9 /* decay per step of the recorded longest step */
#define SB_LOOKS 4    /* most repetitions of a step by a post-solve callback */
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
  PetscReal alpha_m, alpha_f, beta, gamma; /* generalized-alpha; fractions of the new state, as in TSALPHA2 */
  PetscBool impulses;                      /* Newmark with contact: newmark_contact.c */
  PetscBool separate;                      /* Newmark with barrier contact: the acceleration excludes it */
} SbMethodSettings;

static inline PetscBool SbRunIsExplicit(SbRun run)
{
  return (PetscBool)(run->preset == SB_TIME_EULER_EXPLICIT || run->preset == SB_TIME_EULER_SYMPLECTIC);
}

PetscErrorCode SbSecondOrderRegister(void);
/* run: source of prescribed displacements, initial acceleration and lumped mass; borrowed. */
void SbSecondOrderSet(TS ts, SbRun run, const SbMethodSettings *settings);

/* step.c: one step. */
/* Data and functions of a step from t to t + dt; vectors and ctx are borrowed. Static runs: t is the load factor. */
typedef struct {
  PetscReal t, dt;                      /* start and length, s */
  Vec U0, U;                            /* displacements at the start; at the end, once solved, m */
  PetscErrorCode (*predict)(void *ctx); /* sets U to an initial guess with the prescribed values */
  PetscErrorCode (*solve)(void *ctx, Vec U, SNESConvergedReason *reason); /* solves from the guess in U */
  PetscErrorCode (*residual)(void *ctx, Vec U, Vec R); /* residual without constraints, N; for contact */
  /* computes the end state from U, in `step`; if not ok run->stop_reason is the reason */
  PetscErrorCode (*complete)(void *ctx, SNESConvergedReason reason, SbSolvedStep *step, PetscBool *ok);
  void *ctx;
} SbAttempt;
/* Updates the penalty on jumps of CR and DG from the state (src/fem/jump.c), and accelerations and reactions with it; changed: whether it has changed. Explicit integrators, whose stable step
   is that of the rest state, and alpha2, without a pre-step callback, use the penalty of the rest state. Collective. */
PetscErrorCode SbRunFollowJumps(SbRun run, PetscBool *changed);
/* Attempts a step; ok: it can be accepted. Collective. */
PetscErrorCode SbRunAttempt(SbRun run, const SbAttempt *attempt, PetscBool *ok);
PetscErrorCode SbRunStepAccepted(SbRun run, PetscInt step, PetscReal t, PetscReal dt,
                                 PetscBool last); /* saves history, calls monitors; also at the start */
#define SB_NEWTON_ITERATIONS 100
/* transfer.c: the post-step function of the TS. */
PetscErrorCode SbRunAfterStep(TS ts);
/* newton.c: Newton's method as a minimisation, a SNESType. run: the run that snes solves, borrowed; call it after SNESSetType(). */
#define SB_SNES_NEWTON "newton"
PetscErrorCode SbNewtonRegister(void);
PetscErrorCode SbNewtonSetRun(SNES snes, SbRun run);
/* Whether a tangent of the last solve was found indefinite; false for another SNESType, or if no tangent is `auto`. Not collective. */
PetscErrorCode SbNewtonUnstable(SNES snes, PetscBool *is);

/* stop.c: early end of runs. */
/* Options -wall_time and -stop_grace. */
PetscErrorCode SbRunReadStop(SbRun run);
/* After a step that ended at t (within: during the solve of the next one): sets run->stopped if the run is to end. Collective. */
PetscErrorCode SbRunStopAsked(SbRun run, PetscInt step, PetscReal t, PetscBool within);
PetscErrorCode SbRunFail(SbRun run, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* After a rejected step of length dt, s: warns if dt is much less than the requested length, once until steps have that length again. */
PetscErrorCode SbRunWarnShorter(SbRun run, PetscReal dt);
/* Whether inverted.c rejected the last step, and would reject one of length dt, s. */
PetscBool SbRunTooShort(SbRun run, PetscReal dt);

/*
  inverted.c, after a step from t to t + dt was solved. Collective; nothing happens without -time_inverted reject.

  U: displacements at its start and at its end. ok: false if the step inverted tets; run->refused and run->stop_reason are set then.
*/
PetscErrorCode SbRunRejectInverted(SbRun run, PetscReal t, PetscReal dt, const Vec U[2], PetscBool *ok);

/* callbacks.c: the model for PETSc's TS and SNES. */
PetscErrorCode SbFormI2Function(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *run);
PetscErrorCode SbFormI2Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal shift_v, PetscReal shift_a,
                                Mat J, Mat P, void *run);
/* run->operator: the shell matrix of linear solves if the assembled one lacks a part of the tangent. Collective. */
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
    V       - velocity at t by Newmark's formulas, m/s; out: after contact impulses
    A       - acceleration likewise, m/s^2; out: M A + f_int - f_ext is the mean force of contact
  Output:
    own     - acceleration at t without contact, for the next step
*/
PetscErrorCode SbNewmarkContact(SbRun run, PetscReal t, PetscReal dt, Vec U, Vec V, Vec A, Vec own);
/* own = the acceleration at t without contact, from U and V; at prescribed unknowns that of A. Collective. */
PetscErrorCode SbNewmarkOwn(SbRun run, PetscReal t, Vec U, Vec V, Vec A, Vec own);

/*
  solver_list.c: after a failed linear solve of run->snes the next solver of SbSolverNextFallback() solves the same system, with one warning
  line, and replaces the old one. Without effect if the user has set -ksp_type or -pc_type.

  Collective, after SbSolverFinish().
*/
PetscErrorCode SbSolverListCreate(SbRun run);
/* Message after a failed linear solve of Newton's method: "linear solver: ", each solver that was tried with its reason, iterations and residual, likely
   causes, and advice. Collective. */
PetscErrorCode SbSolverListExplain(SbRun run, size_t size, char text[]);
/* Stores for that message how the last solve of the barrier contact system failed. Not collective. */
PetscErrorCode SbSolverListContactFailed(SbRun run, KSPConvergedReason reason, PetscInt iterations);

PetscErrorCode SbStaticSolve(SbRun run); /* static.c: load steps */
/* arc_length.c: equilibrium path with the load factor as an unknown. Collective. Check: after the solver is set up; PETSC_ERR_USER_INPUT for
   contact, and for solvers for definite matrices only. */
PetscErrorCode SbArcLengthCheck(SbRun run);
PetscErrorCode SbArcLengthSolve(SbRun run);
/* rigid_modes.c, after a static solve: a body with a free rigid motion, -1: none found; how: the motion in words; along: as displacements of the nodes, not normalised (may be
   NULL). Collective. */
PetscErrorCode SbRunFreeBody(SbRun run, PetscInt *body, size_t size, char motion[], Vec along);
/* Whether the displacements X exceed the bodies' size so much that the matrix must have been singular. Collective. */
PetscErrorCode SbRunTooFar(SbRun run, Vec X, PetscBool *far);

/* energy_balance.c: energies at t, s, and the energy balance of the step of length dt that ended there; `first`: at the start. Collective. */
PetscErrorCode SbRunAccount(SbRun run, PetscReal t, PetscReal dt, PetscBool first);
/* R = the residual at t with the acceleration of the integrator, without constraints: reactions on prescribed unknowns; for TSALPHA2, which stores
   none, without inertia. Contact forces between bodies are excluded. Collective. */
PetscErrorCode SbRunReactions(SbRun run, PetscReal t, Vec R);

/*
  SbRunSolveContact - active-set iteration of a step with contact: solves until the active set does not change; U: initial guess, then the
  solution. Collective. reason: that of the last solve, SNES_DIVERGED_MAX_IT if the active set does not converge.
  With run->may_end_at_impact it ends after the first solve if nodes come into contact within the step: reason is then SNES_CONVERGED_ITERATING, and the
  step is to be repeated with the fraction run->time_of_impact of its length.
*/
PetscErrorCode SbRunSolveContact(SbRun run, const SbAttempt *attempt, SNESConvergedReason *reason);
