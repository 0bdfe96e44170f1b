/*
  ledger_impl.h - shared by the files of src/ledger.
*/
#pragma once
#include "sbledger.h"

typedef enum {
  SB_QUANTITY_NONE,
  SB_QUANTITY_DISPLACEMENT,
  SB_QUANTITY_REACTION,
  SB_QUANTITY_VOLUME
} SbQuantityKind;

/* The number that the user cares for. */
typedef struct {
  SbQuantityKind kind;
  PetscReal at[3], direction[3];
  char on[SB_NAME_MAX];
  PetscInt node;                /* displacement: the nearest owned node, -1: on another rank */
  PetscReal x[3];               /* its rest position, on all ranks, m */
  uint64_t set;                 /* reaction: bit of the set */
  Vec weight;                   /* reaction: the direction on its prescribed unknowns */
  PetscReal value, least, most; /* now, and over the run */
  PetscReal error[SB_ERROR_COUNT];
} SbQuantity;

#define SB_LEDGER_CARRIED 40 /* at least as many as carry() names */

struct _p_SbLedger {
  SbRun run; /* borrowed */
  PetscLogEvent event;
  PetscInt every;
  PetscReal accuracy, budget; /* 0: not asked for; s per step */
  SbSpaceEstimate space;
  PetscReal *space_error; /* [nbody] of the last estimate, J */
  SbQuantity quantity;

  PetscInt order; /* of the integrator; its constant, and how far velocities are behind (SbRunLocalError) */
  PetscReal c, ahead;
  PetscReal derivative[4], mean[4]; /* energies of derivatives now, J/s^2j; their integrals */
  PetscReal lost, tau, span; /* of time: losses of steps, J^(1/2); sum of c h^(p+1); length of the run, s */
  PetscReal stored;          /* largest energy so far, J */
  PetscReal error[SB_ERROR_COUNT];        /* J^(1/2) */
  PetscReal relative[SB_ERROR_COUNT + 1]; /* as columns of the history; the last one: of the quantity */
  SbColumn column[SB_ERROR_COUNT + 1];
  SbCheckpointValue carried[SB_LEDGER_CARRIED];
  /* of the last step that was examined, J^(1/2) */
  PetscReal step_time, step_linear, step_nonlinear, offset;
  PetscReal residual, seen_residual; /* after the last solve, and at the last step examined, N */
  PetscReal kept_part;               /* of earlier errors of solves: the integrator damps them */
  PetscBool seen;                    /* the step that is about to be accepted was */
  PetscBool anew;                    /* another mesh, on which the old accelerations are in no balance */

  Vec kept, before;            /* accelerations at the start of this step and of the one before, m/s^2 */
  PetscReal kept_t, before_dt; /* s; before_dt 0: there was none */
  Vec w[3];                    /* work */
  Vec delta;                   /* error of the solve, m, for that of the quantity */

  PetscReal work, own_work; /* in residuals, of the run and of the estimates: the same on every run */
  PetscReal seconds, solving, residuals; /* of estimates on this rank: all, linear solves, residuals */

  /* adaptive_tolerance.c */
  PetscBool may_tune; /* tolerances are the program's */
  PetscReal rtol;     /* that the solves aim at */
  PetscInt repeats;   /* solves that were repeated for their accuracy */
  PetscInt narrowed;  /* widths of contact that were */
  PetscBool mesh_bounds,
    width_bounds; /* contact was left worse than its share: the mesh is worse by far; widths are given or as small as can be */
  PetscInt nstep, nkept;          /* of -step_time_budget: steps, and those that took no longer */
  PetscReal wall, longest, total; /* at the last step; s */
};

/* difference.c: factor on D that moves the bodies by a millionth of their size at most, 0 when D is zero. Collective. */
PetscErrorCode SbDifferenceLength(SbLedger l, Vec D, PetscReal *length);
/* X = J^-1 B with the solver and tangent of the last solve, to the relative residual rtol, from zero; its may be NULL. Collective. */
PetscErrorCode SbProbeSolve(SbLedger l, PetscReal rtol, Vec B, Vec X, PetscInt *its);

/* estimate_time.c: error of the step, into step_time and offset; all: also the bounds of the sum over steps. Collective. */
PetscErrorCode SbEstimateTime(SbLedger l, const SbSolvedStep *step, PetscBool all);
/* Adds it to the error of the run, of whose old part damping leaves `left`, 0..1. Not collective. */
void SbEstimateTimeAdd(SbLedger l, PetscReal dt, PetscReal left);
/* Twice the strain energy of a displacement D added to U, as the tangent at U has it, J. Collective. */
PetscErrorCode SbStiffnessForm(SbLedger l, PetscReal t, Vec U, Vec D, PetscReal *form);
/* Sum of the lumped mass times the square of a vector, all ranks. Collective. */
PetscErrorCode SbMassForm(SbLedger l, Vec D, PetscReal *form);
/* estimate_solver.c: what the solves of the step left, into step_linear, step_nonlinear and delta. Collective. */
PetscErrorCode SbEstimateSolver(SbLedger l, const SbSolvedStep *step);
/* Error by rounding of the displacements, J^(1/2). Collective. */
PetscErrorCode SbEstimateRounding(SbLedger l, PetscReal t, Vec U, PetscReal *error);
/* estimate_contact.c: J^(1/2). Collective. */
PetscErrorCode SbEstimateContact(SbLedger l, const SbStep *step, PetscReal *error);
/* Error by the gaps of barrier contact at U, or a bound of it below `enough`, J^(1/2). Collective. */
PetscErrorCode SbEstimateGaps(SbLedger l, Vec U, PetscReal enough, PetscReal *error);

/* adaptive_tolerance.c */
PetscErrorCode SbAdaptiveToleranceSetFromOptions(SbLedger l);
PetscErrorCode SbAdaptiveToleranceAttach(SbLedger l);
PetscErrorCode
SbAdaptiveToleranceSet(SbLedger l, PetscReal rtol); /* the tolerance of solves, where it is the program's */
PetscErrorCode SbAdaptiveToleranceUpdate(SbLedger l, const SbSolvedStep *step, PetscBool *again);
PetscErrorCode SbAdaptiveToleranceAccept(SbLedger l, const SbStep *step);

/* quantity.c */
PetscErrorCode SbQuantitySetFromOptions(SbLedger l, const SbScope *scope);
PetscErrorCode SbQuantityAttach(SbLedger l);
/* After re-meshing: warns if the node of the quantity has changed. Collective. */
PetscErrorCode SbQuantityContinue(SbLedger from, SbLedger to);
PetscErrorCode SbQuantityValue(SbLedger l, const SbStep *step);
PetscErrorCode SbQuantityErrors(SbLedger l, const SbStep *step);

/* Seconds by source and those without one, largest of all ranks. */
typedef struct {
  PetscReal source[SB_ERROR_COUNT], search, setup, output, estimates, total;
} SbLedgerSeconds;
PetscErrorCode SbLedgerGetSeconds(SbLedger l, SbLedgerSeconds *s);
