/*
  Integrators by name: each preset is a method of second_order.c with its parameters; options of the
  user, and PETSc's own (-ts_, -snes_, -ksp_, -pc_), have precedence.

    euler_implicit    first order, damps; never gains energy in linear runs
    newmark           second order, (1/4, 1/2) conserves energy in linear runs
    genalpha          second order, damps high frequencies; parameters from the spectral radius at
    infinity
    euler_symplectic  explicit, first order, bounded energy below the stable step
    euler_explicit    explicit, first order, gains energy and is unstable: a baseline
    alpha2            PETSc's TSALPHA2, for comparison
    static            equilibrium without inertia: load steps
*/
#include <complex.h>
#include "time_impl.h"

#define STABLE 0.9   /* of the stable step: length of explicit ones */
#define ALLOWED 2e-4 /* allowed error of an adaptive step, over half the size of the largest body */
#define FREQUENCY 0.03 /* of the oscillator, over the step's, for the local error */

#define NAMES "euler_implicit|newmark|genalpha|euler_symplectic|euler_explicit|alpha2|static"
const char *const SbIntegrators = NAMES;

/* The presets' methods; alpha2 and static have their own solves. */
static const SbMethod methods[] = {[SB_TIME_EULER_IMPLICIT] = SB_METHOD_EULER_IMPLICIT,
                                   [SB_TIME_NEWMARK] = SB_METHOD_GENERALIZED_ALPHA,
                                   [SB_TIME_GENALPHA] = SB_METHOD_GENERALIZED_ALPHA,
                                   [SB_TIME_EULER_SYMPLECTIC] = SB_METHOD_EULER_SYMPLECTIC,
                                   [SB_TIME_EULER_EXPLICIT] = SB_METHOD_EULER_EXPLICIT,
                                   [SB_TIME_STATIC] = SB_METHOD_EULER_IMPLICIT};

void SbRunIntegrator(SbRun run, size_t size, char name[])
{
  const char *word = SbIntegrators;

  for (int i = 0; i < (int)run->solve.preset; i++)
    word = strchr(word, '|') + 1;
  SbFormat(size, name, "%.*s", (int)strcspn(word, "|"), word);
}

const SbOption SbTimeRows[] = {
  {"time", SB_OPTION_CHOICE, 1, "", "euler_implicit", NAMES,
   "time integrator, or static equilibrium"},
  {"ts_dt", SB_OPTION_REAL, 1, "s", "0.01", "(0, inf)",
   "length of a time step (the first one with -ts_adapt_type basic); explicit integrators take 0.9 "
   "of the stable step unless given"},
  {"ts_max_time", SB_OPTION_REAL, 1, "s", "1", "(0, inf)", "end of the simulated time"},
  {"time_spectral_radius", SB_OPTION_REAL, 1, "", "0.5", "[0, 1]",
   "genalpha: spectral radius at infinite frequency, the amplitude of the highest frequencies that "
   "is left after a step; 1: no damping, 0: they vanish in one step"},
  {"time_newmark_beta", SB_OPTION_REAL, 1, "", "0.25", "(0, 0.5]", "newmark: beta"},
  {"time_newmark_gamma", SB_OPTION_REAL, 1, "", "0.5", "[0.5, 1]",
   "newmark: gamma; more than 1/2 damps and is first order"},
  {"time_predictor", SB_OPTION_CHOICE, 1, "", "none", "none|velocity",
   "first guess of Newton's method in a step: the old displacement, or u + dt v. With one linear "
   "solve per step (-snes_type ksponly) velocity is far more accurate, but may be unstable unless "
   "the tangent is exact_spd"},
  {"time_max_halvings", SB_OPTION_INT, 1, "", "10", "[0, 60]",
   "how often a step that fails is halved and repeated before the run stops"},
  {"time_inverted", SB_OPTION_CHOICE, 1, "", "auto", "auto|accept|reject",
   "a step that inverts tets (det F <= 0): accept, and count them; or reject, halve it and try "
   "again, and stop when that does not help; auto: reject in load steps of a static run with stvk, "
   "whose stress has a maximum in compression, else accept"},
  {"live_speed", SB_OPTION_REAL, 1, "m/s", "0.2", "(0, inf)",
   "-effect_<name>_displacement live (interactive): largest speed at which the effect moves to the "
   "position that the file live.txt in output_dir names (lines `NAME x y z`, m)"},
  {"live_angular_speed", SB_OPTION_REAL, 1, "degrees/s", "90", "(0, inf)",
   "-effect_<name>_angle live (interactive): largest angular speed; other live options take their "
   "new value in the next step"},
  {"live_pace", SB_OPTION_REAL, 1, "", "1", "[0, inf)",
   "interactive runs: largest ratio of simulated time to real time; a faster run waits; 0: no "
   "limit"},
  {"wall_time", SB_OPTION_STRING, 1, "", "", "",
   "wall time limit of the program, h:mm:ss or d-hh:mm:ss: the run stops in time to write a "
   "checkpoint, with exit code 75, and -restart latest resumes it; empty: no limit"},
  {"stop_grace", SB_OPTION_REAL, 1, "s", "10", "[0, inf)",
   "after a signal to stop (SIGTERM, SIGHUP, SIGINT, SIGUSR1): time in which the current step may "
   "be "
   "finished; then it is abandoned, and the run ends with the step before"},
  {"saddle_solver", SB_OPTION_CHOICE, 1, "", "auto", "auto|direct|iterative",
   "contact with response multiplier: how the saddle-point system of displacements and Lagrange "
   "multipliers is solved: by a factorisation with the multipliers condensed, or by projected "
   "iterations in the null space of the constraints; auto goes by size"},
  {"contact_solver", SB_OPTION_CHOICE, 1, "", "auto", "auto|direct|iterative",
   "contact with response barrier: how linear systems are solved: by a factorisation, or by CG "
   "whose coarse space contains the unknowns in contact; auto takes iterations while they are less "
   "work"},
  {"contact_quality", SB_OPTION_CHOICE, 1, "", "exact", "exact|fast",
   "contact with response barrier and implicit Euler. exact: steps are solved to -snes_rtol; fast: "
   "for interactive runs and large heaps: steps end after -snes_max_it Newton iterations, 1 unless "
   "given, in which each body goes as far as collision detection lets it. Nothing passes through "
   "anything; impacts last some steps and lose energy, heaps settle later; velocities keep what "
   "was left of the step, which the summary reports"},
  {"static_steps", SB_OPTION_INT, 1, "", "1", "[1, 1000000]",
   "static: equal load steps from zero to full load"},
  {"static_adapt", SB_OPTION_BOOL, 1, "", "true", "",
   "give a load step up early that shorter ones reach in fewer iterations; false: only when its "
   "solve fails"},
  {"static_min_increment", SB_OPTION_REAL, 1, "", "1e-4", "(0, 1]",
   "static: smallest load increment, as a fraction of a load step; below it the run stops, and "
   "says whether a limit load is likely"},
  {"static_unstable", SB_OPTION_CHOICE, 1, "", "warn", "warn|error|ignore",
   "static: what to do where the equilibrium of a load step is unstable, as that of a straight "
   "column above its buckling load: the tangent has negative eigenvalues. warn: say so, with the "
   "mode's place; error: the run ends there, after its output; ignore: do not look"},
  {"static_control", SB_OPTION_CHOICE, 1, "", "load", "load|arc_length",
   "static: load control, or arc-length control along the equilibrium path, which continues past "
   "limit points; both end where the load factor reaches 1"},
  {"static_max_steps", SB_OPTION_INT, 1, "", "1000", "[1, inf)",
   "arc_length: largest number of steps; the run ends there"},
  {"static_max_displacement", SB_OPTION_REAL, 1, "m", "0", "[0, inf)",
   "arc_length: the run ends when the displacement of any node exceeds this; 0: no limit"},
  {"static_longest_step", SB_OPTION_REAL, 1, "", "0", "[0, inf)",
   "arc_length: largest increment of arc length, as a multiple of the first one, whose load "
   "increment is 1/-static_steps; 0: no limit, they adapt to the bend of the path"},
  {0},
};

PetscErrorCode SbTimeRegister(void)
{
  PetscFunctionBeginUser;
  PetscCall(TSRegister(SB_TS_SECOND_ORDER, SbSecondOrderCreate));
  PetscCall(SNESRegister(SB_SNES_NEWTON, SbNewtonCreate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parameters of a preset's method. */
static SbMethodSettings method_settings(SbRun run)
{
  const PetscReal r = run->solve.spectral_radius;
  const PetscReal m = (2. - r) / (1. + r);
  const PetscReal f = 1. / (1. + r);
  SbMethodSettings set = {.method = methods[run->solve.preset], .alpha_m = 1., .alpha_f = 1.};

  if (run->solve.preset == SB_TIME_NEWMARK) {
    set.beta = run->solve.newmark[0];
    set.gamma = run->solve.newmark[1];
    set.impulses = (PetscBool)(run->model->contacts.nactive_set > 0);
    set.separate = (PetscBool)(run->model->contacts.npotential > 0);
  }
  if (run->solve.preset == SB_TIME_GENALPHA) {
    set.alpha_m = m;
    set.alpha_f = f;
    set.beta = 0.25 * PetscSqr(1. + m - f);
    set.gamma = 0.5 + m - f;
    set.separate = (PetscBool)(run->model->contacts.nrigid > 0);
  }
  return set;
}

/* Eigenvalue z of generalized-alpha for an undamped oscillator of frequency w, h = 1, nearest to
   exp(i w): of m d^2 + w^2 f g = 0 below, by fixed-point iteration, as w is small. */
static double complex alpha_eigenvalue(const SbMethodSettings *s, double w)
{
  double complex z = cexp(I * w);

  for (int i = 0; i < 50; i++) {
    const double complex d = z - 1, m = 1 - s->alpha_m + s->alpha_m * z,
                         f = 1 - s->alpha_f + s->alpha_f * z;
    const double complex g = 1 - s->gamma + s->gamma * z + (0.5 - s->beta + s->beta * z) * d;

    z = 1 + I * w * csqrt(f * g / m);
  }
  return z;
}

void SbRunLocalError(SbRun run, PetscInt *order, PetscReal *c, PetscReal *ahead)
{
  const SbMethodSettings s = method_settings(run);
  const double w = FREQUENCY;
  double complex z = 0.;

  *order = 1;
  *ahead = 0.;
  switch (s.method) {
  case SB_METHOD_EULER_IMPLICIT:
    z = 1 / (1 - I * w);
    break;
  case SB_METHOD_GENERALIZED_ALPHA:
    z = alpha_eigenvalue(&s, w);
    if (PetscAbsReal(s.gamma - 0.5 - s.alpha_m + s.alpha_f) < 1e-9)
      *order = 2;
    break;
  case SB_METHOD_EULER_EXPLICIT:
    z = 1 + I * w;
    break;
  case SB_METHOD_EULER_SYMPLECTIC:
    z = cexp(2 * I * asin(w / 2)); /* the method is central differences */
    *order = 2;
    *ahead = 0.5;
    break;
  }
  *c = (PetscReal)(cabs(z - cexp(I * w)) / pow(w, (double)*order + 1));
}

/* The equation of motion holds at a fraction of the step, m ((1 - a_m) a_0 + a_m a_1) = f(t_0 + a_f
   h): with a_0 and a_1 the accelerations at t_0 + before and t_1 + shift, linear in time. */
PetscReal SbRunAccelerationShift(SbRun run, PetscReal dt, PetscReal before)
{
  const SbMethodSettings s = method_settings(run);

  return ((s.alpha_f - s.alpha_m) * dt - (1. - s.alpha_m) * before) / s.alpha_m;
}

static PetscErrorCode step_accepted(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx)
{
  SbRun run = (SbRun)ctx;
  TSConvergedReason reason;
  PetscInt newton, linear;
  PetscReal previous;

  PetscFunctionBeginUser;
  (void)U;

  /* TSSolve calls monitors again after an interpolation, with step -1 */
  if (step < 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TSGetSNESIterations(ts, &newton));
  PetscCall(TSGetKSPIterations(ts, &linear));
  PetscCall(TSGetPrevTime(ts, &previous));
  PetscCall(TSGetConvergedReason(ts, &reason));
  run->counters.newton_step = newton + run->counters.newton_before - run->counters.newton;
  run->counters.linear_step = linear + run->counters.linear_before - run->counters.linear;
  PetscCall(SbRunStepAccepted(
    run, step, t, step == run->clock.step0 ? 0. : t - previous,
    (PetscBool)((reason > 0 && !run->clock.paused) || t >= run->clock.t_end * (1. - 1e-12))));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Re-meshing and requests to stop, before monitors. */
static PetscErrorCode after_step(TS ts)
{
  TSConvergedReason reason;
  PetscReal t, before;
  PetscInt step;
  SbRun run;

  PetscFunctionBeginUser;
  PetscCall(TSGetApplicationContext(ts, &run));
  PetscCall(TSGetConvergedReason(ts, &reason));
  PetscCall(TSGetTime(ts, &t));
  if (reason || t >= run->clock.t_end * (1. - 1e-12))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TSGetStepNumber(ts, &step));
  PetscCall(TSGetPrevTime(ts, &before));
  run->monitors.post_step.dt = t - before;
  if (run->monitors.post_step.fn)
    PetscCall((*run->monitors.post_step.fn)(run, step, t, t - before, run->monitors.post_step.ctx,
                                            &run->clock.paused));
  PetscCall(SbRunStopAsked(run, step, t, PETSC_FALSE));
  if (run->clock.paused || run->clock.stopped)
    PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_USER));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The length of explicit steps: a part of the stable one unless it is given. */
static PetscErrorCode choose_stable_step(SbRun run)
{
  const SbModel m = run->model;
  PetscReal stable;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceActiveMost(m->space, run->clock.t0, run->clock.t_end));
  PetscCall(SbSpaceStableStep(m->space, &stable));
  if (!run->clock.dt_given)
    run->clock.dt = STABLE * stable;
  else if (run->clock.dt > stable)
    PetscCall(SbWarning(m->comm,
                        "-ts_dt %g s is beyond the stable step of this mesh and material, %g s: "
                        "expect the solution to blow up",
                        (double)run->clock.dt, (double)stable));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Allowed displacement error per step of adaptive runs, over the size of the largest body, twice
   the largest distance of a node from the centre of its body: independent of units and
   orientation. */
static PetscErrorCode set_tolerance(SbRun run)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  PetscReal(*middle)[4], size = 0.;
  PetscReal atol = 0.;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(m->nbody, &middle));
  PetscCall(SbModelCentres(m, NULL, middle));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal r[3];

    SbSubtract(s->node_x + 3 * i, middle[s->node_body[i]], r);
    size = PetscMax(size, SbDot3(r, r));
  }
  PetscCall(PetscFree(middle));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &size, 1, MPIU_REAL, MPI_MAX, m->comm));
  size = PetscSqrtReal(size);
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-ts_atol", &atol, NULL));
  PetscCheck(atol <= size, m->comm, PETSC_ERR_USER_INPUT,
             "-ts_atol %g m allows a step an error beyond the radius of the largest body, %.4g m, "
             "so any step is accepted: give less (%.1g m without the option)",
             (double)atol, (double)size, (double)(ALLOWED * size));
  PetscCall(TSSetTolerances(run->solve.ts, ALLOWED * size, NULL, 0., NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSetUpIntegrator(SbRun run)
{
  const SbModel m = run->model;
  const SbMethodSettings settings = method_settings(run);
  TSAdapt adapt;
  Vec F;

  PetscFunctionBeginUser;
  if (SbRunIsExplicit(run))
    PetscCall(choose_stable_step(run));

  /* the equation of motion and its integrator */
  PetscCall(SbSpaceCreateVec(m->space, &F));
  PetscCall(TSCreate(m->comm, &run->solve.ts));
  PetscCall(TSSetProblemType(run->solve.ts, TS_NONLINEAR));
  PetscCall(TS2SetSolution(run->solve.ts, run->state.U, run->state.V));
  PetscCall(TSSetI2Function(run->solve.ts, F, SbFormI2Function, run));
  PetscCall(TSSetI2Jacobian(run->solve.ts, run->solve.system, run->solve.J, SbFormI2Jacobian, run));
  PetscCall(VecDestroy(&F));
  if (run->solve.preset == SB_TIME_ALPHA2) {
    PetscCall(TSSetType(run->solve.ts, TSALPHA2));
    PetscCall(TSAlpha2SetRadius(run->solve.ts, run->solve.spectral_radius));
  } else
    PetscCall(TSSetType(run->solve.ts, SB_TS_SECOND_ORDER));

  /* fixed steps, unless PETSc's options say otherwise; a failure is told in words */
  PetscCall(set_tolerance(run));
  PetscCall(TSGetAdapt(run->solve.ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscCall(TSSetMaxSteps(run->solve.ts, PETSC_MAX_INT));
  PetscCall(TSSetExactFinalTime(run->solve.ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(TSSetErrorIfStepFails(run->solve.ts, PETSC_FALSE));

  /* solvers; -ts_dt has been read, and is set below */
  if (SB_TS_DT_RENAMED)
    PetscCall(PetscOptionsClearValue(NULL, "-ts_dt"));
  PetscCall(TSGetSNES(run->solve.ts, &run->solve.snes));
  PetscCall(SbRunSetUpSolver(run));

  /* end time and step length; monitors */
  PetscCall(TSSetMaxTime(run->solve.ts, run->clock.t_end));
  PetscCall(TSSetTimeStep(run->solve.ts, run->clock.dt));
  PetscCall(TSMonitorSet(run->solve.ts, step_accepted, run, NULL));
  PetscCall(TSSetApplicationContext(run->solve.ts, run));
  PetscCall(TSSetPostStep(run->solve.ts, after_step));
  PetscCall(PetscObjectTypeCompare((PetscObject)adapt, TSADAPTNONE, &run->clock.fixed));
  m->barrier_apart =
    (PetscBool)(m->contacts.npotential && run->solve.preset != SB_TIME_EULER_IMPLICIT);
  if (m->barrier_apart)
    run->solve.barrier_weight =
      (settings.separate ? 0.5 * settings.alpha_m / settings.beta : 1.) / settings.alpha_f;
  if (run->solve.preset != SB_TIME_ALPHA2)
    SbSecondOrderSet(run->solve.ts, run, &settings);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunIntegrate(SbRun run)
{
  TSConvergedReason reason;
  PetscInt step;
  PetscReal t, dt;

  PetscFunctionBeginUser;
  PetscCall(TSSetStepNumber(run->solve.ts, run->clock.step0));
  PetscCall(TSSetTime(run->solve.ts, run->clock.t0));
  PetscCall(TSSolve(run->solve.ts, run->state.U));

  /* PETSc's own integrators give no reason of a failure */
  PetscCall(TSGetConvergedReason(run->solve.ts, &reason));
  PetscCall(TSGetStepNumber(run->solve.ts, &step));
  PetscCall(TSGetTime(run->solve.ts, &t));
  PetscCall(TSGetTimeStep(run->solve.ts, &dt));
  run->clock.cut_short =
    (PetscBool)(reason == TS_CONVERGED_ITS && t < run->clock.t_end * (1. - 1e-12));
  if (run->clock.cut_short)
    PetscCall(SbWarning(run->model->comm,
                        "-ts_max_steps ends the run after step %" PetscInt_FMT
                        " at t = %g s, before -ts_max_time %g s",
                        step, (double)t, (double)run->clock.t_end));
  if (reason < 0 && !run->clock.stop_reason[0] && !run->clock.stopped)
    PetscCall(
      SbRunFail(run,
                "step %" PetscInt_FMT
                " at t = %g s with a length of %g s: %s; try a shorter -ts_dt, or -time genalpha, "
                "which tries shorter ones by itself (docs/guides/when_it_fails.md, R1)",
                step + 1, (double)t, (double)dt, TSConvergedReasons[reason]));
  PetscFunctionReturn(PETSC_SUCCESS);
}
