/*
  sbtime.h - layer 9: presets of the integrators, the second-order TSType, steps and their monitors.
*/
#pragma once
#include "sbmodel.h"

typedef enum {
  SB_TIME_EULER_IMPLICIT,
  SB_TIME_NEWMARK,
  SB_TIME_GENALPHA,
  SB_TIME_EULER_SYMPLECTIC,
  SB_TIME_EULER_EXPLICIT,
  SB_TIME_ALPHA2,
  SB_TIME_STATIC
} SbIntegrator;
extern const char *const SbIntegrators; /* "euler_implicit|newmark|..." in the order of the enum */

/* What a monitor sees after each accepted step (and once before the first). */
typedef struct {
  PetscInt step;
  PetscReal t, dt; /* s; in a static run t is the load factor, 0..1 */
  PetscReal t_end;
  PetscInt step_end; /* last step if it is known from dt, else -1 */
  Vec U, V, A;       /* V, A NULL in a static run */
  Vec R;             /* residual without constraints: reactions; NULL unless SbRun.want_residual */
  SbEnergies energies;     /* filled when some monitor needs them (SbRun.want_energies) */
  PetscInt newton, linear; /* iterations of this step */
  PetscInt rejected;       /* rejected attempts, this step */
  PetscReal wall;          /* seconds since the time loop began */
  PetscBool last;
  PetscBool again; /* repeated call: the step was the last one, as the next one failed */
} SbStep;

typedef struct _p_SbRun *SbRun;

/*
  A step as solved, before it becomes the state: the solver can still evaluate its equations at U.
  All vectors are lent; velocities and accelerations are NULL in a static run, where t is the load
  factor.
*/
typedef struct {
  PetscReal t, dt;  /* start and length, s */
  Vec U0, V0, A0;   /* start */
  Vec U, V, A;      /* end */
  PetscBool solved; /* by SbRun.snes; else explicitly */
} SbSolvedStep;
/* `again`: the equations are to be solved once more, from U on. Collective. */
typedef PetscErrorCode (*SbStepSolvedFn)(SbRun run, const SbSolvedStep *step, void *ctx,
                                         PetscBool *again);

/* A number that history.csv shows after those of effects; the same on all ranks. */
typedef struct {
  char name[SB_NAME_MAX];
  const char *unit;
  const PetscReal *value; /* borrowed */
} SbColumn;

/* A number that is saved in checkpoints; the same on all ranks. Names begin with the owner's. */
typedef struct {
  char name[SB_NAME_MAX];
  PetscReal *value; /* borrowed */
} SbCheckpointValue;

typedef PetscErrorCode (*SbMonitorFn)(SbRun run, const SbStep *step, void *ctx);
/* One simulation: model, solver, integrator, monitors. */
struct _p_SbRun {
  SbModel model; /* borrowed */
  SbIntegrator preset;
  TS ts;     /* NULL in a static run */
  SNES snes; /* of the TS, or own in a static run; borrowed from ts when there is one */
  Mat J;     /* tangent */
  Mat
  operator; /* of linear solves: J, its projection (SbConstraints), or J plus SbModelNonsymmetric() */
  Mat
    whole; /* the operator that constraints project: J plus SbModelNonsymmetric(); NULL: J is complete */
  struct {
    Vec U, x, y; /* displacement of J; factor and product; NULL where J is complete */
    PetscReal t; /* J's time or load factor */
  } nonsymmetric;
  Vec U, V, A;       /* A: acceleration of the last step, state of the integrator */
  Vec mass;          /* lumped mass of each displacement, kg; 0 on supports, which are prescribed */
  Vec R;             /* residual for contact; NULL without */
  Vec barrier_start; /* barrier contact: displacement at the start of the step; borrowed */
  PetscReal barrier_dt;     /* its length, s */
  PetscReal barrier_weight; /* weight of its end-of-step forces in the residual of the solve */
  Vec stage,
    stage_start; /* forces are those at stage_start + stage_part (X - stage_start); NULL: at X */
  PetscReal stage_part;
  PetscBool dt_given, velocity_predictor, fixed_step, damped;
  PetscBool single; /* one linear solve per step instead of Newton's method */
  PetscBool reject_inverted,
    rejected_inverted;         /* -time_inverted; the last attempt was rejected by it */
  PetscBool may_end_at_impact; /* this attempt may end where points come into contact */
  PetscInt contact_round;      /* active-set iterations of this step, 0: without contact */
  PetscBool shortened;         /* the warning of much shorter steps was given */
  PetscReal time_of_impact;    /* fraction of the step at which it ended, 1: it did not */
  PetscReal spectral_radius, newmark[2]; /* newmark: beta, gamma */
  PetscInt max_halvings, static_steps;
  PetscBool goes_on; /* a solve that starts from the last one's solution, with its tolerance */
  PetscReal min_increment; /* static: smallest load increment as a part of 1 / static_steps */
  PetscReal softening; /* static: |du|/dlambda of the last step over that of the slowest; 0: none */
  struct {
    PetscBool
      on; /* static: steps along the path of equilibria, with the load factor as an unknown */
    PetscInt steps; /* largest number */
    PetscReal longest,
      first;                /* longest step over the first; length of the first, m, 0: not known */
    PetscReal displacement; /* -static_max_displacement, m; 0: no limit */
  } arc;
  Vec
    path; /* with arc.on: direction of the last step, scaled to the next step's length; zero at the start */
  PetscInt bifurcations; /* number detected by changes of negative pivots */
  PetscBool
    free_body; /* static, without contact: some body can move rigidly; load steps are not halved */
  PetscBool tangent_known; /* J holds the tangent for shift_v, shift_a */
  PetscReal shift_v, shift_a;
  PetscBool saddle;   /* some effect asks for multipliers as unknowns */
  int saddle_choice;  /* -saddle_solver: 0 by size, 1 direct, 2 iterative */
  int contact_choice; /* -contact_solver: likewise */
  SbSaddle saddle_used;
  char solver_choice[SB_NAME_MAX]; /* -solver: "auto" or a name */
  const struct _SbSolverPreset *solver_used;
  char solver[SB_NAME_MAX]; /* preset chosen, "cg_gamg"; with -pc_type its methods, "cg, gamg" */
  char solver_parts
    [SB_NAME_MAX]; /* methods at the start, "cg, cholesky of mumps"; "": no linear systems */
  char solver_reason[256];
  struct _p_SbSolverList *solver_list; /* fallbacks (solver_list.c); NULL without linear systems */
  PetscInt nmonitor;
  struct {
    SbMonitorFn fn;
    void *ctx;
  } monitor[8];
  struct {
    SbStepSolvedFn fn; /* called after each solve of a step; NULL: none */
    void *ctx;
    /* for adaptive steps: error over the allowed one, as dt to the power `order`; NULL: by
       -ts_atol */
    PetscErrorCode (*error)(SbRun, const SbSolvedStep *step, void *ctx, PetscInt *order,
                            PetscReal *ratio);
  } post_solve;
  struct {
    /* after the solve of a step that ended at t, before monitors: whether SbRunSolve() returns;
       NULL: none */
    PetscErrorCode (*fn)(SbRun, PetscInt step, PetscReal t, PetscReal dt, void *ctx,
                         PetscBool *pause);
    PetscReal
      dt; /* length of the last step that it was called for, or of a restart from a pause; else 0 */
    void *ctx;
  } after;
  struct {
    PetscBool listens;          /* signals are caught, or there is a wall time limit */
    PetscReal wall_time, grace; /* s, 0: no limit; time for the current step after a signal */
    PetscReal begun;            /* MPI_Wtime() when options were read */
    PetscReal step_begun;       /* likewise of the step */
    PetscReal longest_step,
      longest_output; /* s, recent maxima: of a step, and of the output after it */
  } stop;
  PetscBool stopped; /* the run was asked to end, and can be restarted; why: stop_reason */
  SbStep seen;       /* last argument of monitors */
  PetscBool paused;  /* SbRunSolve() returned by `after`; the run continues */
  PetscInt ncolumn;
  const SbColumn *column; /* [ncolumn] of history.csv; borrowed */
  PetscInt ncarried;
  const SbCheckpointValue *carried; /* [ncarried] in checkpoints; borrowed */
  /* values[ncell_owned] = energy of the error in space, J/m^3 at rest; NULL: no estimate.
     Collective. */
  PetscErrorCode (*cell_error)(SbRun run, const SbStep *step, PetscReal values[]);
  PetscBool want_energies, want_residual;
  SbEnergies energies;    /* running totals of work and dissipation */
  PetscReal energy_most;  /* the largest kinetic + strain so far (kept over restarts), J */
  PetscBool gain_said;    /* the warning of an unstable integrator was given */
  PetscReal energy_start; /* kinetic + strain at the start of the run (kept over restarts), J */
  PetscInt step0;         /* first step and time when restarted */
  PetscReal t0;
  PetscInt step_now; /* of the last accepted step */
  PetscReal t_now;
  PetscInt newton_total, linear_total, rejected_total, steps_total;
  PetscReal
    good_steps; /* dynamic: steps accepted since one was shortened, or they became longer again */
  PetscInt newton_before, linear_before; /* of the runs before a re-meshing */
  PetscReal wall_start, seconds_solve;
  PetscReal dt, t_end;               /* length of a step (the first one when adaptive) and end, s */
  PetscInt newton_step, linear_step; /* iterations of the current step */
  PetscInt rejected_seen;            /* rejections up to the last step */
  Vec loads, reaction,
    previous;              /* with want_energies: f_ext, residual, displacement of the last step */
  PetscReal damping_power; /* at the last step, W */
  char stop_reason[1024];  /* why the run ended early; empty when it reached its end */
  void *output;            /* data of src/output; NULL without output */
  PetscErrorCode (*output_destroy)(
    SbRun run); /* frees it; called by SbRunDestroy() when not NULL */
};

/*
  SbRunLocalError - local error of the integrator: in the energy norm c h^(p+1) |d^(p+1) (u, v) /
  dt^(p+1)|


  Not collective. Output: order p, constant c, from the method's eigenvalue for an undamped
  oscillator; `ahead`: steps by which symplectic Euler's velocities lag, an error that does not
  accumulate.
*/
void SbRunLocalError(SbRun run, PetscInt *order, PetscReal *c, PetscReal *ahead);
/* X = (K + H)^-1 B, K the last tangent, H the Hessian of barrier contact; solved: any contact.
   Collective. */
PetscErrorCode SbRunSolveTangent(SbRun run, Vec B, Vec X, PetscInt *iterations, PetscBool *solved);
extern const SbOption SbTimeRows[];
PetscErrorCode SbTimeRegister(void); /* the TSType and the SNESType */
/* Reads the options -time, -solver, ...; nothing is computed yet. */
PetscErrorCode SbRunCreate(SbModel model, SbRun *run);
/* Name of the integrator, e.g. "newmark". */
void SbRunIntegrator(SbRun run, size_t size, char name[]);
/* After SbModelSetUp(): vectors, matrix, solver, integrator. Collective. */
PetscErrorCode SbRunSetUp(SbRun run);
PetscErrorCode SbRunAddMonitor(SbRun run, SbMonitorFn fn, void *ctx);
/* From now on SIGTERM, SIGINT, SIGUSR1 end the only run after its step, a second SIGINT the
   process. */
PetscErrorCode SbRunCatchSignals(SbRun run);
/*
  SbRunTransferState - continues the run `from` as the run `to` of a re-meshed model. Collective.

  After SbRunSetUp(to), before monitors are added. Takes over totals, works, the step and its time,
  and lengths of steps (explicit: the stable one of the new model, unless given). U, V and A: the
  caller's.
*/
PetscErrorCode SbRunTransferState(SbRun from, SbRun to);
/* Recomputes A at t_now from U and V by the residual, except at prescribed displacements, and not
   with integrators whose acceleration is a history variable. Collective. */
PetscErrorCode SbRunRestartAcceleration(SbRun run);
/* The whole time loop or load path; an early end is in run->stop_reason, not an error. */
PetscErrorCode SbRunSolve(SbRun run);
PetscErrorCode SbRunDestroy(SbRun *run);
