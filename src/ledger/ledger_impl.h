/*
  ledger_impl.h - data and functions shared by the files of src/ledger.
*/
#pragma once
#include "sbledger.h"

typedef enum {
  SB_ERROR_SPACE,     /* of the mesh: estimate_space.c */
  SB_ERROR_TIME,      /* of the integrator, summed over the steps */
  SB_ERROR_NONLINEAR, /* remaining residual of Newton's method */
  SB_ERROR_LINEAR,    /* remaining residual of the linear solver */
  SB_ERROR_CONTACT,   /* forces on gaps that are not closed */
  SB_ERROR_ROUNDING,  /* of displacements in double precision */
  SB_ERROR_COUNT
} SbErrorSource;

/* estimate_space.c: the error of the space discretisation */

/*
  Estimate of the error |e| of the space discretisation in the energy norm: of the first
  Piola-Kirchhoff stress, to that of the continuum under the loads, inertia and prescribed
  displacements of the moment, in the strain energy norm of Hooke's law in the rotated frame of the
  cell. sqrt(body2 / strain) is the relative error. For CR and DG it is the error inside of cells,
  without the energy of jumps at faces; for P2 that of the deviator and of each cell's mean
  pressure.
*/
typedef struct _p_SbSpaceEstimate *SbSpaceEstimate;
struct _p_SbSpaceEstimate {
  SbModel model;    /* borrowed */
  PetscReal *cell2; /* [ncell_owned] square of the error of each owned cell, J */
  PetscReal *body2; /* [nbody] sums over the cells of each body and all ranks, J */
  PetscReal total2; /* their sum, J */
  PetscReal form2;  /* the same of the form whose products are errors of quantities, J */
  PetscReal
    *strain; /* [nbody] the laws' strain energy of the cells of each body and all ranks, J */
  PetscReal *factor; /* [nbody] cell2, body2 over the square of recovery alone, 1 but for P1 */
  SbRecovery recovery;
  PetscReal *P;          /* [ncell][9] stresses, Pa */
  SbPointStress *stress; /* [ncell] those of P2, NULL without a body of it */
  PetscReal *R;          /* [ncell_owned][9] rotations; NULL when every law is linear */
  PetscReal *psi;        /* [ncell_owned] energy densities, J/m^3 */
  Vec residual;          /* NULL without a body of P1 */
};
/* Patches and links between ranks, once. Collective. The model is borrowed; destroy the
   estimate. */
PetscErrorCode SbSpaceEstimateCreate(SbModel model, SbSpaceEstimate *est);
/*
  SbSpaceEstimateCompute - fills cell2, body2, total2, strain and factor.

  Collective. Input: displacement U (m), velocity V (m/s), acceleration A (m/s^2) at t (s), the last
  two NULL in a static run. Results are the same on any number of ranks up to rounding. Measured:
  0.2 us for a cell of the linear law, 0.4 us of another (the residual: 0.02 to 0.05 us for P1, 0.1
  to 0.2 us for DG), and 155 and 227 bytes for a cell from SbSpaceEstimateCreate() on.
*/
PetscErrorCode SbSpaceEstimateCompute(SbSpaceEstimate est, PetscReal t, Vec U, Vec V, Vec A);
PetscErrorCode
SbSpaceEstimateDestroy(SbSpaceEstimate *est); /* sets *est to NULL; NULL is accepted */

/* the quantity of interest */

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
  PetscReal x[3]; /* displacement: rest position of its vertex or node, on all ranks, m */
  uint64_t set;   /* reaction: bit of the set */
  Vec weight; /* the quantity is its product with displacements, or (reaction) with the residual */
  PetscReal value, least, most; /* current value; extremes over the run */
  PetscInt nlast;               /* dynamic: number of last values known, at most 4 */
  PetscReal last[4], last_t[4]; /* these, newest first, and their times, s */
  PetscReal steepest;           /* largest derivative of the integrator's order + 1 so far, */
  PetscReal worst;              /* and error by the time step */
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
  PetscInt finer_most; /* tets of a finer run, above which there is none */
  struct {
    PetscReal value;                 /* of the quantity, SI */
    PetscInt ncell;                  /* its tets; 0: no finer run */
    char why[256];                   /* why there is none; "": not asked for */
    PetscReal phase[SB_PHASE_COUNT]; /* its seconds, which are not those of the run */
  } finer;

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
  PetscReal kept_t; /* start of the step, whose acceleration is `kept`, s */
  PetscReal shift, before_dt; /* time of `kept` less that; less the time of `before`, 0: none; s */
  Vec w[3];                   /* work vectors */
  Vec delta;                  /* error of the solve, m, for the quantity */

  PetscReal work,
    own_work; /* work of the run and of estimates, in residual evaluations: reproducible */
  PetscReal seconds, solving,
    residuals; /* seconds on this rank: all estimates, solves, residuals */

  /* adaptive_tolerance.c */
  PetscBool may_tune;        /* the program chooses tolerances */
  PetscReal rtol;            /* relative tolerance of solves */
  PetscInt narrowed;         /* number of reductions of contact widths */
  PetscBool warned_shortest; /* -accuracy asks for shorter steps than its shortest */
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
/* Makes x, set and weight (owned) of a quantity for a run. Collective. Error
   (PETSC_ERR_USER_INPUT): no unknown of the set is prescribed. */
PetscErrorCode SbQuantityLocate(SbQuantity *q, SbRun run);
PetscErrorCode SbQuantityAttach(SbLedger l);
/* After re-meshing: warns if the node of the quantity has changed. Collective. */
PetscErrorCode SbQuantityContinue(SbLedger from, SbLedger to);
PetscErrorCode SbQuantityValue(SbLedger l, const SbStep *step);
PetscErrorCode SbQuantityErrors(SbLedger l, const SbStep *step);
/* Error of the quantity by a step just solved over the range of its values, into *error; *known:
   whether it has both. Collective. */
PetscErrorCode SbQuantityStepError(SbLedger l, const SbSolvedStep *step, PetscReal *error,
                                   PetscBool *known);

extern const char *const SbErrorNames[SB_ERROR_COUNT];
