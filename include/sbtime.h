/*
  sbtime.h - layer 5: presets of the integrators, the second-order TSType, what happens around each step.
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
  Vec R; /* residual without constraints: reactions on prescribed unknowns; NULL unless somebody asked */
  SbEnergies energies;     /* filled when some monitor needs them (SbRun.want_energies) */
  PetscInt newton, linear; /* iterations of this step */
  PetscInt rejected;       /* rejected attempts, this step */
  PetscReal wall;          /* seconds since the time loop began */
  PetscBool last;
  PetscBool again; /* it was seen before, and turned out to be the last one: the next one was given up */
} SbStep;

typedef struct _p_SbRun *SbRun;

/*
  A step as it was solved, before it becomes the state: the solver can still evaluate its equations at U. All vectors are lent;
  V, A and those of the start are NULL in a static run, where t is the load factor.
*/
typedef struct {
  PetscReal t, dt;  /* start and length, s */
  Vec U0, V0, A0;   /* start */
  Vec U, V, A;      /* end */
  PetscBool solved; /* by SbRun.snes; else explicitly */
} SbSolvedStep;
/* `again`: the equations are to be solved once more, from U on. Collective. */
typedef PetscErrorCode (*SbStepSolvedFn)(SbRun run, const SbSolvedStep *step, void *ctx, PetscBool *again);

/* A number that history.csv shows after those of effects; the same on all ranks. */
typedef struct {
  char name[SB_NAME_MAX];
  const char *unit;
  const PetscReal *value; /* borrowed */
} SbColumn;

/* A number that a checkpoint carries over a restart; the same on all ranks. Names begin with who asks for it. */
typedef struct {
  char name[SB_NAME_MAX];
  PetscReal *value; /* borrowed */
} SbCheckpointValue;

typedef PetscErrorCode (*SbMonitorFn)(SbRun run, const SbStep *step, void *ctx);
/* After a step that ended at t was solved and before monitors see it: whether the time loop is to come back then. Collective. */
typedef PetscErrorCode (*SbPauseFn)(SbRun run, PetscInt step, PetscReal t, PetscReal dt, void *ctx,
                                    PetscBool *pause);

/* One simulation: model, solver, integrator, monitors. */
struct _p_SbRun {
  SbModel model; /* borrowed */
  SbIntegrator preset;
  TS ts;           /* NULL in a static run */
  SNES snes;       /* of the TS, or own in a static run; borrowed from ts when there is one */
  Mat J, operator; /* tangent; what solves see of it: J itself, its projection (sbfem.h, SbConstraints), or
                     with what it lacks (SbModelNonsymmetric()) */
  Mat whole;       /* what constraints project beside the matrix: J with what it lacks; NULL without such */
  struct {
    Vec U, x, y; /* displacement of J; factor and product; NULL where J lacks nothing */
    PetscReal t; /* J's time or load factor */
  } nonsymmetric;
  Vec U, V, A;            /* A: acceleration of the last step, state of the integrator */
  Vec R;                  /* residual for contact; NULL without */
  Vec guard_start;        /* guarded contact: displacement when the attempt at a step began; borrowed */
  PetscReal guard_dt;     /* its length, s */
  PetscReal guard_weight; /* of its forces at the end of a step in the residual that is solved */
  Vec stage,
    stage_start; /* where the integrator evaluates forces, stage_start + stage_part (X - stage_start), in a solve for X; NULL: at X */
  PetscReal stage_part;
  PetscBool dt_given, velocity_predictor, fixed_step, damped;
  PetscBool reject_inverted, rejected_inverted; /* steps that invert tets; the last attempt was such a one */
  PetscBool may_end_at_impact;                  /* this attempt may end where points come into contact */
  PetscInt contact_round;                       /* solves of this step for who touches, 0: without contact */
  PetscBool shortened;                          /* it was said that steps had to be much shorter */
  PetscReal time_of_impact;                     /* the part of the step at which it did, 1: it did not */
  PetscReal spectral_radius, newmark[2];        /* newmark: beta, gamma */
  PetscInt max_halvings, static_steps;
  PetscBool goes_on;       /* a solve from another one's solution, to that one's tolerance */
  PetscReal min_increment; /* static: smallest load increment as a part of 1 / static_steps */
  PetscReal softening;     /* static: |du|/dlambda of the last step over that of the slowest; 0: none */
  struct {
    PetscBool on;   /* static: steps along the path of equilibria, with the load factor as an unknown */
    PetscInt steps; /* at most so many */
    PetscReal longest, first; /* longest step as a multiple of the first, and that one, m; 0: not known */
    PetscReal displacement;   /* at which the path ends, m; 0: at none */
  } arc;
  Vec path; /* with arc.on the last step's displacement, as long as the next step; zero at the start */
  PetscInt bifurcations;   /* that a factorisation has shown */
  PetscBool free_body;     /* static, without contact: nothing holds some body; no shorter load steps */
  PetscBool tangent_known; /* J holds the tangent for shift_v, shift_a */
  PetscReal shift_v, shift_a;
  PetscBool saddle;        /* some effect asks for multipliers as unknowns */
  PetscInt saddle_choice;  /* -saddle_solver: 0 by size, 1 direct, 2 iterative */
  PetscInt contact_choice; /* -contact_solver: likewise */
  SbSaddle saddle_used;
  char solver_choice[SB_NAME_MAX]; /* as the scenario says: "auto" or a name */
  const struct _SbSolverPreset *solver_used;
  char solver[SB_NAME_MAX];       /* preset chosen, "cg_gamg"; with -pc_type what solves, "cg, gamg" */
  char solver_parts[SB_NAME_MAX]; /* what solves at first, "cg, cholesky of mumps"; "" without systems */
  char solver_reason[256];
  struct _p_SbSolverList *solver_list; /* what happens when it fails (solver_list.c); NULL without systems */
  PetscInt nmonitor;
  struct {
    SbMonitorFn fn;
    void *ctx;
  } monitor[8];
  struct {
    SbStepSolvedFn fn; /* examines each step that was solved; NULL: nobody does */
    void *ctx;
    /* error of the step that was just solved over what is allowed, which falls with the power `order` of its length, for adaptive steps;
       NULL: displacements are compared with -ts_atol */
    PetscErrorCode (*error)(SbRun run, const SbSolvedStep *step, void *ctx, PetscInt *order,
                            PetscReal *ratio);
  } post_solve;
  struct {
    SbPauseFn fn; /* asked after each step; NULL: nobody asks */
    PetscReal dt; /* of the step asked about last; of a restart from a pause; else 0 */
    void *ctx;
  } after;
  struct {
    PetscBool listens;                      /* somebody may ask the run to stop */
    PetscReal wall_time, grace;             /* s; 0: no such limit; that a step has after a signal */
    PetscReal begun;                        /* MPI_Wtime() when options were read */
    PetscReal step_begun;                   /* likewise of the step */
    PetscReal longest_step, longest_output; /* s, of late; of what monitors write after a step */
  } stop;
  PetscBool stopped; /* the run ends because it was asked to, and can go on; stop_reason says who */
  SbStep seen;       /* what monitors saw last */
  PetscBool paused;  /* SbRunSolve() came back because of that; nothing has ended */
  PetscInt ncolumn;
  const SbColumn *column; /* [ncolumn] of history.csv; borrowed */
  PetscInt ncarried;
  const SbCheckpointValue *carried; /* [ncarried] in checkpoints; borrowed */
  /* values[ncell_owned] = energy of the error of space discretisation per rest volume, J/m^3; NULL: nobody estimates it. Collective. */
  PetscErrorCode (*cell_error)(SbRun run, const SbStep *step, PetscReal values[]);
  PetscBool want_energies, want_residual;
  SbEnergies energies;    /* running totals of work and dissipation */
  PetscReal energy_most;  /* the largest kinetic + strain so far (kept over restarts), J */
  PetscBool gain_said;    /* that the integrator is unstable */
  PetscReal energy_start; /* kinetic + strain at the start of the run (kept over restarts), J */
  PetscInt step0;         /* first step and time when restarted */
  PetscReal t0;
  PetscInt step_now; /* of the last accepted step */
  PetscReal t_now;
  PetscInt newton_total, linear_total, rejected_total, steps_total;
  PetscReal good_steps; /* dynamic: steps accepted since one was shortened, or they became longer again */
  PetscInt newton_before, linear_before; /* of the runs that this one goes on from */
  PetscReal wall_start, seconds_solve;
  PetscReal dt, t_end; /* length of a step (the first one when adaptive) and end, s */
  PetscInt newton_step, linear_step, rejected_step; /* iterations and rejections of the current step */
  PetscInt rejected_seen;
  Vec loads, reaction,
    previous; /* f_ext and residual at the last step, its displacement: for works; only with want_energies */
  PetscReal damping_power; /* at the last step, W */
  char stop_reason[1024];  /* why the run ended early; empty when it reached its end */
  void *output;            /* what src/output keeps for this run; NULL when no output was asked for */
  PetscErrorCode (*output_destroy)(SbRun run); /* frees it; called by SbRunDestroy() when not NULL */
};

/*
  SbRunLocalError - what one step of the integrator of a dynamic run loses, for small steps: in the norm of the energy c h^(p+1)
  |d^(p+1) (u, v) / dt^(p+1)|.

  Not collective. Output: order p and constant c, from the eigenvalue of the method for an undamped oscillator; `ahead`, the time in lengths of a
  step by which symplectic Euler's velocities are behind, whose error does not add up; 0 for the others.
*/
void SbRunLocalError(SbRun run, PetscInt *order, PetscReal *c, PetscReal *ahead);
/* X = (K + H)^-1 B with the tangent K of the last direction of Newton's method and the second derivative H of guarded contact, where surfaces pushed each other there (solved). Collective. */
PetscErrorCode SbRunSolveTangent(SbRun run, Vec B, Vec X, PetscInt *iterations, PetscBool *solved);
PetscErrorCode SbTimeRegister(void); /* option rows and the TSType */
PetscErrorCode SbRunCreate(SbModel model,
                           SbRun *run); /* reads the options -time, -solver, ...; nothing is computed yet */
PetscErrorCode
SbRunSetUp(SbRun run); /* after SbModelSetUp(): vectors, matrix, solver, integrator. Collective */
PetscErrorCode SbRunAddMonitor(SbRun run, SbMonitorFn fn, void *ctx);
/* From now on SIGTERM, SIGINT and SIGUSR1 end the run after its step: SbRun.stopped. A second SIGINT ends the process. Of one run at a time. */
PetscErrorCode SbRunCatchSignals(SbRun run);
/* After SbRunSetUp(). */
void SbRunSetPause(SbRun run, SbPauseFn fn, void *ctx);
/*
  SbRunTransferState - `to` goes on where `from` has come to, on another model of the same scene. Collective.

  After SbRunSetUp(to), before monitors are added. Takes over totals, work and dissipation, the step and its time, and lengths of steps; with explicit
  integrators that is the stable one of the new model, unless it was given. U, V and A are the caller's to fill.
*/
PetscErrorCode SbRunTransferState(SbRun from, SbRun to);
/* A <- the acceleration with which the integrator goes on at t_now from U and V: where it takes the one of the residual, that one; but A stays
   as it is where displacements are prescribed, and with integrators that keep their own. Collective. */
PetscErrorCode SbRunRestartAcceleration(SbRun run);
PetscErrorCode SbRunSolve(
  SbRun run); /* the whole time loop or load path; an early end is in run->stop_reason, not an error */
PetscErrorCode SbRunDestroy(SbRun *run);
