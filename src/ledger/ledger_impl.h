/*
  ledger_impl.h - data and functions shared by the files of src/ledger.
*/
#pragma once
#include "sbledger.h"

typedef enum {
  SB_QUANTITY_NONE,
  SB_QUANTITY_DISPLACEMENT,
  SB_QUANTITY_REACTION,
  SB_QUANTITY_VOLUME
} SbQuantityKind;

/* The quantity of interest. */
typedef struct {
  SbQuantityKind kind;
  PetscReal at[3], direction[3];
  char on[SB_NAME_MAX];
  PetscInt node;  /* displacement: the nearest owned node, -1: on another rank */
  PetscReal x[3]; /* rest position of that node, on all ranks, m */
  uint64_t set;   /* reaction: bit of the set */
  Vec weight;     /* reaction: direction of the force, at the prescribed unknowns of the set */
  PetscReal value, least, most; /* current value; extremes over the run */
  PetscReal error[SB_ERROR_COUNT];
} SbQuantity;

#define SB_LEDGER_CHECKPOINT 40 /* upper bound of the values listed by carry() */

struct _p_SbLedger {
  SbRun run; /* borrowed */
  PetscLogEvent event;
  PetscInt every;
  PetscReal accuracy, budget; /* target error, s per step; 0: not set */
  SbSpaceEstimate space;
  PetscReal *space_error; /* [nbody] last estimate, J */
  SbQuantity quantity;

  PetscInt order; /* order of the integrator; error constant, lag of velocities (SbRunLocalError) */
  PetscReal c, ahead;
  PetscReal derivative[4], mean[4]; /* current energies of derivatives, J/s^2j; their integrals */
  PetscReal lost, tau,
    span;           /* integrator: sum of errors, J^(1/2); sum of c h^(p+1); length of the run, s */
  PetscReal stored; /* largest energy so far, J */
  PetscReal error[SB_ERROR_COUNT];    /* [source] errors of the run, J^(1/2) */
  PetscReal relative[SB_ERROR_COUNT]; /* the same, relative: columns of the history */
  SbColumn column[SB_ERROR_COUNT];
  SbCheckpointValue checkpoint[SB_LEDGER_CHECKPOINT];
  /* errors of the last estimated step, J^(1/2) */
  PetscReal step_time, step_linear, step_nonlinear, offset;
  PetscReal residual,
    seen_residual;     /* residual norm after the last solve; at the last estimated step, N */
  PetscReal kept_part; /* fraction of earlier errors of solves after the integrator's damping */
  PetscBool seen;      /* the step about to be accepted was estimated */
  PetscBool anew;      /* after re-meshing: old accelerations are not in equilibrium */

  Vec kept, before; /* accelerations at the start of this step and of the one before, m/s^2 */
  PetscReal kept_t, before_dt; /* time of `kept`; length of the step before, 0: none; s */
  Vec w[3];                    /* work vectors */
  Vec delta;                   /* error of the solve, m, for the quantity */

  PetscReal work,
    own_work; /* work of the run and of estimates, in residual evaluations: reproducible */
  PetscReal seconds, solving,
    residuals; /* seconds on this rank: all estimates, solves, residuals */

  /* adaptive_tolerance.c */
  PetscBool may_tune; /* the program chooses tolerances */
  PetscReal rtol;     /* relative tolerance of solves */
  PetscInt narrowed;  /* number of reductions of contact widths */
  PetscBool mesh_bounds,
    width_bounds;        /* contact may exceed its share: mesh error is larger; width fixed */
  PetscInt nstep, nkept; /* -step_time_budget: number of steps; of those within the budget */
  PetscReal wall, longest, total; /* seconds at the last step; longest step; sum */
};

/* Error of a source at the end of the run, J^(1/2). */
static inline PetscReal SbLedgerError(SbLedger l, int source)
{
  return l->error[source] + (source == SB_ERROR_TIME ? l->offset : 0.);
}

/* difference.c: R = derivative along D of the residual at U, or (strain) of the gradient of the
   strain energy, N. Collective, not for D or R among l->w[1], l->w[2]. */
PetscErrorCode SbStiffnessTimes(SbLedger l, PetscReal t, Vec U, Vec D, PetscBool strain, Vec R);
/* Twice the strain energy of a displacement D, by the tangent at U, J. Collective. */
PetscErrorCode SbStiffnessForm(SbLedger l, PetscReal t, Vec U, Vec D, PetscReal *form);
/* Sum of the lumped mass times the square of a vector other than l->w[2], all ranks. Collective. */
PetscErrorCode SbMassForm(SbLedger l, Vec D, PetscReal *form);
/* X = J^-1 B with the solver and tangent of the last solve, to rtol, from zero; its: iterations. */
PetscErrorCode SbProbeSolve(SbLedger l, PetscReal rtol, Vec B, Vec X, PetscInt *its);

/* estimate_time.c: error of the step, into step_time, offset; `all`: also bounds of the sum.
   Collective. */
PetscErrorCode SbEstimateTime(SbLedger l, const SbSolvedStep *step, PetscBool all);
/* Adds the error of the step to that of the run, of which damping leaves the part `left`. Not
   collective. */
void SbEstimateTimeAdd(SbLedger l, PetscReal dt, PetscReal left);
/* estimate_solver.c: errors of the step's solves, into step_linear, step_nonlinear and delta.
   Collective. */
PetscErrorCode SbEstimateSolver(SbLedger l, const SbSolvedStep *step);
/* Error from rounding of the displacements, J^(1/2). Collective. */
PetscErrorCode SbEstimateRounding(SbLedger l, PetscReal t, Vec U, PetscReal *error);
/* estimate_contact.c: error from contact, J^(1/2). Collective. */
PetscErrorCode SbEstimateContact(SbLedger l, const SbStep *step, PetscReal *error);
/* Error from the gaps of barrier contact at U, or a bound of it below `enough`, J^(1/2).
   Collective. */
PetscErrorCode SbEstimateGaps(SbLedger l, Vec U, PetscReal enough, PetscReal *error);

/* adaptive_tolerance.c */
PetscErrorCode SbAdaptiveToleranceSetFromOptions(SbLedger l);
PetscErrorCode SbAdaptiveToleranceAttach(SbLedger l);
PetscErrorCode SbAdaptiveToleranceSet(SbLedger l,
                                      PetscReal rtol); /* sets the tolerance of solves */
PetscErrorCode SbAdaptiveToleranceUpdate(SbLedger l, const SbSolvedStep *step, PetscBool *again);
PetscErrorCode SbAdaptiveToleranceAccept(SbLedger l, const SbStep *step);

/* quantity.c */
PetscErrorCode SbQuantitySetFromOptions(SbLedger l);
PetscErrorCode SbQuantityAttach(SbLedger l);
/* After re-meshing: warns if the node of the quantity has changed. Collective. */
PetscErrorCode SbQuantityContinue(SbLedger from, SbLedger to);
PetscErrorCode SbQuantityValue(SbLedger l, const SbStep *step);
PetscErrorCode SbQuantityErrors(SbLedger l, const SbStep *step);

extern const char *const SbErrorNames[SB_ERROR_COUNT];
