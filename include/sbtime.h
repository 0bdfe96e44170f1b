/*
  sbtime.h - layer 9: presets of the integrators, the second-order TSType, steps and their monitors.
*/
#pragma once
#include "sbmodel.h"
#include "sbnewton.h"

typedef enum {
  SB_TIME_EULER_IMPLICIT,
  SB_TIME_NEWMARK,
  SB_TIME_GENALPHA,
  SB_TIME_EULER_SYMPLECTIC,
  SB_TIME_EULER_EXPLICIT,
  SB_TIME_ALPHA2,
  SB_TIME_STATIC
} SbIntegrator;

/* What a monitor sees after each accepted step (and once before the first). */
typedef struct {
  PetscInt step;
  PetscReal t, dt; /* s; in a static run t is the load factor, 0..1 */
  PetscReal t_end;
  PetscInt step_end; /* last step if it is known from dt, else -1 */
  Vec U, V, A;       /* V, A NULL in a static run */
  Vec R; /* residual without constraints: reactions; NULL unless SbRunMonitors.want_residual */
  SbEnergies energies;     /* filled when some monitor needs them (SbRunMonitors.want_energies) */
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
  PetscBool solved; /* by SbRunSolver.snes; else explicitly */
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

/* What the bodies have now, and the balance of their energy so far. Vectors: [nnode][3], owned. */
typedef struct {
  Vec U; /* displacement, m */
  Vec V; /* velocity, m/s; NULL in a static run */
  Vec A; /* acceleration of the last step, state of the integrator, m/s^2; NULL: static, alpha2 */
  Vec mass; /* lumped mass of each displacement, kg; 0 on supports, which are prescribed */
  Vec path; /* arc length: direction of the last step, scaled to the next step's length, m; zero at
               the start; else NULL */
  SbEnergies energies;    /* of the last step, and running totals of work and dissipation, J */
  PetscReal energy_start; /* kinetic + strain at the start of the run (kept over restarts), J */
  PetscReal energy_most;  /* the largest kinetic + strain so far (kept over restarts), J */

  /* at the last step, for the works of the next one; with monitors.want_energies, else NULL */
  Vec loads;               /* f_ext, N */
  Vec active;              /* force of fibres that contract, N; NULL: none */
  Vec reaction;            /* residual without constraints, N; also with monitors.want_residual */
  Vec previous;            /* displacement, m */
  PetscReal damping_power; /* W */
} SbRunState;

/* Where the run is, how long its steps are and where it ends. t: s; in a static run the load
   factor, 0..1, and so are lengths of steps. */
typedef struct {
  PetscReal t;           /* of the last accepted step */
  PetscInt step;         /* its number */
  PetscReal t0;          /* where the run began: 0 unless restarted */
  PetscInt step0;        /* likewise the number of its step */
  PetscReal dt, t_end;   /* length of a step (the first one when adaptive), and the end */
  PetscBool dt_given;    /* -ts_dt was given */
  PetscBool fixed;       /* steps have the length dt, but for failures */
  PetscInt max_halvings; /* of a step that fails */
  PetscReal good_steps; /* dynamic: accepted since one was shortened, or they became longer again */
  PetscReal wall_start; /* MPI_Wtime() at the start of the time loop, s; 0: not begun */

  /* static */
  PetscInt static_steps;   /* equal load steps to full load */
  PetscBool adapt;         /* static: load steps are shortened early, */
  PetscBool may_give_up;   /* and the one to be solved may be */
  PetscReal min_increment; /* smallest load increment as a part of 1 / static_steps */
  struct {
    PetscBool on;      /* steps along the path of equilibria, with the load factor as unknown */
    PetscInt steps;    /* largest number */
    PetscReal longest; /* longest step over the first */
    PetscReal first;   /* length of the first step, m; 0: not known */
    PetscReal displacement; /* -static_max_displacement, m; 0: no limit */
  } arc;

  /* steps that end where points come into contact */
  PetscBool may_end_at_impact; /* this attempt may */
  PetscReal time_of_impact;    /* fraction of the step at which it ended, 1: it did not */

  /* the early end */
  struct {
    PetscBool listens;        /* signals are caught, or there is a wall time limit */
    PetscReal wall_time;      /* limit, s; 0: none */
    PetscReal grace;          /* time for the current step after a signal, s */
    PetscReal begun;          /* MPI_Wtime() when options were read */
    PetscReal step_begun;     /* likewise of the step */
    PetscReal longest_step;   /* recent maximum of a step, s */
    PetscReal longest_output; /* recent maximum of the output after it, s */
  } stop;
  PetscBool cut_short;    /* -ts_max_steps ended the run before t_end */
  PetscBool paused;       /* SbRunSolve() returned by monitors.post_step; the run continues */
  PetscBool stopped;      /* the run was asked to end, and can be restarted; why: stop_reason */
  char stop_reason[1024]; /* why the run ended early, or a step failed; empty: neither */
} SbRunClock;

/* How a step is solved: integrator, matrices, linear and nonlinear solver. */
typedef struct {
  /* the integrator */
  SbIntegrator preset;
  PetscReal spectral_radius; /* of generalized-alpha at infinite frequency */
  PetscReal newmark[2];      /* beta, gamma */
  PetscBool velocity_predictor;
  PetscBool damped; /* some body has Rayleigh damping; false in a static run */
  TS ts;            /* owned; NULL in a static run */
  SNES snes;        /* of the TS, or own in a static run; borrowed from ts when there is one */

  /* matrices, owned; NULL with explicit integrators */
  Mat J;                      /* tangent */
  Mat system;                 /* of linear solves: J, its projection (SbConstraints), or J plus
                                 SbModelNonsymmetric() */
  Mat unprojected;            /* the operator that constraints project: J plus
                                 SbModelNonsymmetric(); NULL: J is complete */
  PetscBool tangent_known;    /* J holds the tangent for shift_v, shift_a */
  PetscReal shift_v, shift_a; /* factors of damping, 1/s, and mass, 1/s^2, in it */
  struct {
    Vec U;       /* displacement of J, m; owned; NULL where J is complete */
    Vec x, y;    /* factor and product; owned */
    PetscReal t; /* J's time or load factor */
  } nonsymmetric;

  /* the solve of an attempt */
  Vec R; /* residual for contact, N; owned; NULL without */
  struct {
    Vec U;     /* forces are those at U = start + part (X - start), m; NULL: at X */
    Vec start; /* displacement at the start of the step, m; both borrowed */
    PetscReal part;
  } stage;
  PetscReal barrier_weight; /* of barrier contact's forces, those at X, in the residual */
  PetscBool single;         /* one linear solve per step instead of Newton's method */
  PetscBool soft;           /* with a tangent that may be softer than the forces */
  PetscBool fast;           /* -contact_quality fast: a limited number of iterations; */
  Vec left;         /* then what its direction had beyond the solution, m; owned; else NULL; and */
  PetscBool *alone; /* [nbody] then what touches nothing in the last iteration; owned; else NULL */
  PetscReal longest_left; /* the largest displacement of it in the last step, m; 0: it was solved */

  /* attempts that are not accepted */
  PetscBool reject_inverted;   /* -time_inverted reject */
  PetscBool rejected_inverted; /* the last attempt was rejected by it */
  PetscBool free_body; /* static, without contact: some body can move rigidly; load steps are not
                          halved */
  PetscReal softening; /* static: |du|/dlambda of the last step over that of the slowest; 0: none */

  /* the linear solver */
  char solver_choice[SB_NAME_MAX]; /* -solver: "auto" or a name */
  const struct _SbSolverPreset *solver_used;
  char solver[SB_NAME_MAX]; /* preset chosen, "cg_gamg"; with -pc_type its methods, "cg, gamg" */
  char solver_parts[SB_NAME_MAX]; /* methods at the start, "cg, cholesky of mumps"; "": no linear
                                     systems */
  char solver_reason[256];
  PetscReal rounding;    /* of residuals, N: default absolute tolerance */
  PetscBool warned_idle; /* of an absolute tolerance that let the run begin without an iteration */
  struct _p_SbPotential *potential;  /* that Newton's method minimises; owned */
  struct _p_SbSolverList *fallbacks; /* solver_list.c; owned; NULL without linear systems */
  PetscBool saddle;                  /* some effect asks for multipliers as unknowns */
  int saddle_choice;                 /* -saddle_solver: 0 by size, 1 direct, 2 iterative */
  SbSaddle saddle_used;
  int contact_choice; /* -contact_solver: likewise */
} SbRunSolver;

/* -static_unstable */
typedef enum {
  SB_UNSTABLE_WARN,
  SB_UNSTABLE_ERROR,
  SB_UNSTABLE_IGNORE
} SbUnstable;

/* Stability of static equilibria (stability.c). */
typedef struct {
  int action;                           /* SbUnstable; SB_UNSTABLE_IGNORE in a dynamic run */
  Mat K;                                /* exact tangent; owned; NULL before the first use */
  PetscBool warned;                     /* that the last equilibrium is unstable */
  PetscReal since;                      /* load factor at which it became so */
  PetscInt nknown, nunknown, nunstable; /* load steps: examined, without a result, unstable */
  char text[512];                       /* what is unstable at the last such step */
} SbRunStability;

/* Totals of the run, kept over re-meshings; iterations are those of Newton and of linear solves. */
typedef struct {
  PetscInt steps, newton, linear, rejected; /* accepted steps, iterations, rejected attempts */
  PetscInt newton_step, linear_step;     /* iterations of the current step, not yet in the totals */
  PetscInt newton_before, linear_before; /* iterations of the runs before a re-meshing */
  PetscInt rejected_seen;                /* rejected attempts up to the last step */
  PetscInt unsolved; /* accepted steps that ended before they were solved (-contact_quality fast) */
  PetscReal most_left;     /* the largest displacement that one of them left, m */
  PetscInt contact_rounds; /* active-set iterations of this step, 0: without contact */
  PetscInt turned;         /* load steps that were cut as they would turn supports or cells far */
  PetscInt bifurcations;   /* arc length: detected by changes of negative pivots */
  PetscReal seconds_solve; /* wall time of the time loop */
} SbRunCounters;

/* Who looks at the run, and what for. */
typedef struct {
  PetscInt n;
  struct {
    SbMonitorFn fn;
    void *ctx; /* borrowed */
  } list[8];
  PetscBool want_energies, want_residual; /* some monitor needs them in SbStep */
  SbStep last;                            /* last argument of monitors; U NULL: none yet */
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
    PetscReal dt; /* length of the last step that it was called for, or of a restart from a pause;
                     else 0 */
    void *ctx;
  } post_step;

  /* numbers that others add to output */
  PetscInt ncolumn, ncheckpoint;
  const SbColumn *column;              /* [ncolumn] of history.csv; borrowed */
  const SbCheckpointValue *checkpoint; /* [ncheckpoint] in checkpoints; borrowed */
  /* values[ncell_owned] = energy of the error in space, J/m^3 at rest; NULL: no estimate.
     Collective. */
  PetscErrorCode (*cell_error)(SbRun run, const SbStep *step, PetscReal values[]);

  /* warnings that were given */
  PetscBool warned_short; /* of much shorter steps */
  PetscBool warned_jumps; /* of a penalty on jumps that has not settled */
  PetscBool warned_gain;  /* of an unstable integrator */
  PetscBool warned_way;   /* of a step that is long beside a body that meets something */

  void *output;                                /* data of src/output; NULL without output */
  PetscErrorCode (*output_destroy)(SbRun run); /* frees it, in SbRunDestroy(); NULL: none */
} SbRunMonitors;

/* One simulation. */
struct _p_SbRun {
  SbModel model; /* borrowed */
  SbRunState state;
  SbRunClock clock;
  SbRunSolver solve;
  SbRunCounters counters;
  SbRunStability stability;
  SbRunMonitors monitors;
};

/*
  SbRunLocalError - local error of the integrator: in the energy norm c h^(p+1) |d^(p+1) (u, v) /
  dt^(p+1)|


  Not collective. Output: order p, constant c, from the method's eigenvalue for an undamped
  oscillator; `ahead`: steps by which symplectic Euler's velocities lag, an error that does not
  accumulate.
*/
void SbRunLocalError(SbRun run, PetscInt *order, PetscReal *c, PetscReal *ahead);
/* The time of the acceleration at the end of a step of length dt, less that end, s; before: the
   same at its start. That of generalized-alpha lies within the step. Not collective. */
PetscReal SbRunAccelerationShift(SbRun run, PetscReal dt, PetscReal before);
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
/* From now on SIGTERM, SIGHUP, SIGINT, SIGUSR1 end the only run after its step, a second SIGINT the
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
/* The whole time loop or load path; an early end is in run->clock.stop_reason, not an error. */
PetscErrorCode SbRunSolve(SbRun run);
/* Instead of it: monitors see the state that the run would begin with, and nothing is solved.
   Collective. */
PetscErrorCode SbRunShow(SbRun run);
PetscErrorCode SbRunDestroy(SbRun *run);
