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
#include "sbsolver.h"

#define FORCING 0.1         /* loosest relative tolerance of Newton's linear solves */
#define FORCING_BESIDE 1e-6 /* the same where the matrix lacks a part of the tangent */

#define NAMES "euler_implicit|newmark|genalpha|euler_symplectic|euler_explicit|alpha2|static"
const char *const SbIntegrators = NAMES;

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
   "of the "
   "stable step unless given"},
  {"ts_max_time", SB_OPTION_REAL, 1, "s", "1", "(0, inf)", "end of the simulated time"},
  {"time_spectral_radius", SB_OPTION_REAL, 1, "", "0.5", "[0, 1]",
   "genalpha: spectral radius at infinite frequency, the amplitude of the highest frequencies that "
   "is left "
   "after a step; 1: no damping, 0: they vanish in one step"},
  {"time_newmark_beta", SB_OPTION_REAL, 1, "", "0.25", "(0, 0.5]", "newmark: beta"},
  {"time_newmark_gamma", SB_OPTION_REAL, 1, "", "0.5", "[0.5, 1]",
   "newmark: gamma; more than 1/2 damps and is first order"},
  {"time_predictor", SB_OPTION_CHOICE, 1, "", "none", "none|velocity",
   "first guess of Newton's method in a step: the old displacement, or u + dt v. With one linear "
   "solve per "
   "step (-snes_type ksponly) velocity is far more accurate, but may be unstable unless the "
   "tangent is "
   "exact_spd"},
  {"time_max_halvings", SB_OPTION_INT, 1, "", "10", "[0, 60]",
   "how often a step that fails is halved and repeated before the run stops"},
  {"time_inverted", SB_OPTION_CHOICE, 1, "", "auto", "auto|accept|reject",
   "a step that inverts tets (det F <= 0): accept, and count them; or reject, halve it and try "
   "again, and "
   "stop when that does not help; auto: reject in load steps of a static run with stvk, whose "
   "stress has a "
   "maximum in compression, else accept"},
  {"live_speed", SB_OPTION_REAL, 1, "m/s", "0.2", "(0, inf)",
   "-effect_<name>_displacement live (interactive): largest speed at which the effect moves to the "
   "position "
   "that the file live.txt in output_dir names (lines `NAME x y z`, m)"},
  {"live_angular_speed", SB_OPTION_REAL, 1, "degrees/s", "90", "(0, inf)",
   "-effect_<name>_angle live (interactive): largest angular speed; other live options take their "
   "new value "
   "in the next step"},
  {"live_pace", SB_OPTION_REAL, 1, "", "1", "[0, inf)",
   "interactive runs: largest ratio of simulated time to real time; a faster run waits; 0: no "
   "limit"},
  {"wall_time", SB_OPTION_STRING, 1, "", "", "",
   "wall time limit of the program, h:mm:ss or d-hh:mm:ss: the run stops in time to write a "
   "checkpoint, with "
   "exit code 75, and -restart latest resumes it; empty: no limit"},
  {"stop_grace", SB_OPTION_REAL, 1, "s", "10", "[0, inf)",
   "after a signal to stop (SIGTERM, SIGINT, SIGUSR1): time in which the current step may be "
   "finished; then "
   "it is abandoned, and the run ends with the step before"},
  {"saddle_solver", SB_OPTION_CHOICE, 1, "", "auto", "auto|direct|iterative",
   "contact with response multiplier: how the saddle-point system of displacements and Lagrange "
   "multipliers "
   "is solved: by a factorisation with the multipliers condensed, or by projected iterations in "
   "the null "
   "space of the constraints; auto goes by size"},
  {"contact_solver", SB_OPTION_CHOICE, 1, "", "auto", "auto|direct|iterative",
   "contact with response barrier: how linear systems are solved: by a factorisation, or by CG "
   "whose coarse "
   "space contains the unknowns in contact; auto takes iterations while they are less work"},
  {"static_steps", SB_OPTION_INT, 1, "", "1", "[1, 1000000]",
   "static: equal load steps from zero to full load"},
  {"static_min_increment", SB_OPTION_REAL, 1, "", "1e-4", "(0, 1]",
   "static: smallest load increment, as a fraction of a load step; below it the run stops, and "
   "says whether "
   "a limit load is likely"},
  {"static_control", SB_OPTION_CHOICE, 1, "", "load", "load|arc_length",
   "static: load control, or arc-length control along the equilibrium path, which continues past "
   "limit "
   "points; both end where the load factor reaches 1"},
  {"static_max_steps", SB_OPTION_INT, 1, "", "1000", "[1, inf)",
   "arc_length: largest number of steps; the run ends there"},
  {"static_max_displacement", SB_OPTION_REAL, 1, "m", "0", "[0, inf)",
   "arc_length: the run ends when the displacement of any node exceeds this; 0: no limit"},
  {"static_longest_step", SB_OPTION_REAL, 1, "", "10", "(0, inf)",
   "arc_length: largest increment of arc length, as a multiple of the first one, whose load "
   "increment is "
   "1/-static_steps"},
  {0},
};

PetscErrorCode SbTimeRegister(void)
{
  PetscFunctionBeginUser;
  PetscCall(TSRegister(SB_TS_SECOND_ORDER, SbSecondOrderCreate));
  PetscCall(SNESRegister(SB_SNES_NEWTON, SbNewtonCreate));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunCreate(SbModel model, SbRun *run)
{
  SbRun r;
  int inverted;
  PetscBool barrier = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&r));
  r->solve.barrier_weight = 1.;
  r->model = model;
  PetscCall(SbOptionChoice(&SbRunScope, "time", &r->solve.preset));
  model->dynamic = (PetscBool)(r->solve.preset != SB_TIME_STATIC);
  if (model->dynamic) {
    char text[64];
    PetscBool given, given_new;

    /* every PETSc accepts both names of the step option: -ts_time_step is the new one */
    PetscCall(PetscOptionsHasName(NULL, NULL, "-ts_dt", &given));
    PetscCall(PetscOptionsGetString(NULL, NULL, "-ts_time_step", text, sizeof(text), &given_new));
    if (given_new && !given)
      PetscCall(PetscOptionsSetValue(NULL, "-ts_dt", text));
    PetscCall(SbOptionReal(&SbRunScope, "ts_dt", &r->clock.dt));
    PetscCall(SbOptionGiven(&SbRunScope, "ts_dt", &r->clock.dt_given));
    PetscCall(SbOptionReal(&SbRunScope, "ts_max_time", &r->clock.t_end));
    PetscCall(SbOptionSecond(&SbRunScope, "time_predictor", &r->solve.velocity_predictor));
  } else {
    PetscCall(SbOptionInt(&SbRunScope, "static_steps", &r->clock.static_steps));
    PetscCall(SbOptionReal(&SbRunScope, "static_min_increment", &r->clock.min_increment));
    PetscCall(SbOptionSecond(&SbRunScope, "static_control", &r->clock.arc.on));
    r->clock.t_end = 1.;
    r->clock.dt = 1. / (PetscReal)r->clock.static_steps;
  }
  if (r->clock.arc.on) {
    PetscCall(SbOptionInt(&SbRunScope, "static_max_steps", &r->clock.arc.steps));
    PetscCall(SbOptionReal(&SbRunScope, "static_max_displacement", &r->clock.arc.displacement));
    PetscCall(SbOptionReal(&SbRunScope, "static_longest_step", &r->clock.arc.longest));

    /* the arc-length method needs exact tangents: `auto` becomes exact */
    for (PetscInt k = 0; k < model->nmaterial; k++) {
      char option[3 * SB_NAME_MAX];
      PetscBool given;

      if (model->material[k]->linear || model->material[k]->tangent == SB_TANGENT_EXACT)
        continue;
      SbFormat(sizeof(option), option, "-%s_%s_tangent", k < model->nbody ? "body" : "inclusion",
               model->material[k]->name);
      PetscCall(PetscOptionsHasName(NULL, NULL, option, &given));
      PetscCheck(!given, model->comm, PETSC_ERR_USER_INPUT,
                 "-static_control arc_length needs exact tangents: leave %s out, or make it exact",
                 option);
      PetscCall(SbMaterialSetTangent(model->material[k], SB_TANGENT_EXACT));
      model->material[k]->adaptive = PETSC_FALSE;
    }
  }
  if (r->solve.preset == SB_TIME_GENALPHA || r->solve.preset == SB_TIME_ALPHA2)
    PetscCall(SbOptionReal(&SbRunScope, "time_spectral_radius", &r->solve.spectral_radius));
  if (r->solve.preset == SB_TIME_NEWMARK) {
    PetscCall(SbOptionReal(&SbRunScope, "time_newmark_beta", &r->solve.newmark[0]));
    PetscCall(SbOptionReal(&SbRunScope, "time_newmark_gamma", &r->solve.newmark[1]));
  }
  PetscCall(SbRunReadStop(r));
  PetscCall(SbOptionInt(&SbRunScope, "time_max_halvings", &r->clock.max_halvings));
  PetscCall(SbOptionChoice(&SbRunScope, "time_inverted", &inverted));
  r->solve.reject_inverted = (PetscBool)(inverted == 2);
  for (PetscInt k = 0; k < model->nmaterial && !inverted && !model->dynamic && !r->clock.arc.on;
       k++)
    r->solve.reject_inverted = (PetscBool)(r->solve.reject_inverted || model->material[k]->softens);
  PetscCheck(!r->solve.reject_inverted || r->solve.preset != SB_TIME_ALPHA2, PETSC_COMM_SELF,
             PETSC_ERR_USER,
             "-time_inverted reject: -time alpha2 cannot reject steps; take genalpha, which is the "
             "same method");
  for (PetscInt e = 0; e < model->neffect; e++) {
    r->solve.saddle = (PetscBool)(r->solve.saddle || model->effect[e]->saddle);
    barrier = (PetscBool)(barrier || model->effect[e]->ops.hessian);
  }
  if (r->solve.saddle)
    PetscCall(SbOptionChoice(&SbRunScope, "saddle_solver", &r->solve.saddle_choice));
  if (barrier)
    PetscCall(SbOptionChoice(&SbRunScope, "contact_solver", &r->solve.contact_choice));
  PetscCall(SbSolverSetFromOptions(r->solve.solver_choice, sizeof(r->solve.solver_choice)));
  *run = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parameters of a preset's method. */
static SbMethodSettings method_settings(SbRun run)
{
  const PetscReal r = run->solve.spectral_radius;
  const PetscReal m = (2. - r) / (1. + r);
  const PetscReal f = 1. / (1. + r);
  const PetscReal *n = run->solve.newmark;
  const PetscBool impulses = (PetscBool)(run->model->nbegin_step > 0);
  const PetscBool separate = (PetscBool)(run->model->npotential > 0);
  SbMethodSettings set = {.method = SB_METHOD_EULER_IMPLICIT, .alpha_m = 1., .alpha_f = 1.};

  if (run->solve.preset == SB_TIME_NEWMARK)
    set = (SbMethodSettings){SB_METHOD_GENERALIZED_ALPHA, 1., 1., n[0], n[1], impulses, separate};
  if (run->solve.preset == SB_TIME_GENALPHA)
    set = (SbMethodSettings){SB_METHOD_GENERALIZED_ALPHA,
                             m,
                             f,
                             0.25 * PetscSqr(1. + m - f),
                             0.5 + m - f,
                             PETSC_FALSE,
                             PETSC_FALSE};
  if (run->solve.preset == SB_TIME_EULER_EXPLICIT)
    set.method = SB_METHOD_EULER_EXPLICIT;
  if (run->solve.preset == SB_TIME_EULER_SYMPLECTIC)
    set.method = SB_METHOD_EULER_SYMPLECTIC;
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
  const PetscBool alpha = (PetscBool)(s.method == SB_METHOD_GENERALIZED_ALPHA);
  const PetscBool symplectic = (PetscBool)(s.method == SB_METHOD_EULER_SYMPLECTIC);
  const double w = 0.03;
  const double complex z = s.method == SB_METHOD_EULER_IMPLICIT   ? 1 / (1 - I * w)
                           : s.method == SB_METHOD_EULER_EXPLICIT ? 1 + I * w
                           : symplectic
                             ? cexp(2 * I * asin(w / 2)) /* the method is central differences */
                             : alpha_eigenvalue(&s, w);

  *order =
    symplectic || (alpha && PetscAbsReal(s.gamma - 0.5 - s.alpha_m + s.alpha_f) < 1e-9) ? 2 : 1;
  *c = (PetscReal)(cabs(z - cexp(I * w)) / pow(w, (double)*order + 1));
  *ahead = symplectic ? 0.5 : 0;
}

/* SNES: Newton for nonlinear models, one linear solve for linear ones; tolerances independent of
   units. PETSc's own options override all settings so far, those of the TS as well. Newton's linear
   solves are as exact as its progress (Eisenstat and Walker), unless the user sets a tolerance. In
   a static run whose matrix lacks a part of the tangent (the free rim of a follower pressure), a
   factorisation is no exact solve, and changes of volume dominate the residual: loose solves make
   it linear near nu = 1/2. */
static PetscErrorCode set_up_snes(SbRun run)
{
  const SbModel m = run->model;
  const SNES snes = run->solve.snes;
  const PetscReal most = !m->dynamic && m->nnonsymmetric ? FORCING_BESIDE : FORCING;
  PetscReal force = 0.;
  PetscBool asked, newton, rtol;

  PetscFunctionBeginUser;

  /* residuals below 1e-13 of (stress modulus) x (area of the body) are rounding; near nu = 1/2 the
     modulus is lambda, as the pressure is lambda times the rounding error of the change of
     volume */
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbMaterial law = m->material[b];

    force += (law->E + 0.01 * law->lambda) * PetscPowReal(m->body[b].volume, 2. / 3.);
  }

  /* PETSc's line searches need PETSc's Newton loop, and TSALPHA2 has its own stages */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_linesearch_type", &asked));
  PetscCall(SNESSetType(snes, m->linear                                      ? SNESKSPONLY
                              : asked || run->solve.preset == SB_TIME_ALPHA2 ? SNESNEWTONLS
                                                                             : SB_SNES_NEWTON));
  PetscCall(SNESSetDivergenceTolerance(snes, SB_UNLIMITED_REAL));
  PetscCall(SNESSetTolerances(snes, 1e-13 * force, m->dynamic ? 1e-6 : 1e-8, 0.,
                              SB_NEWTON_ITERATIONS, SB_UNLIMITED));
  PetscCall(SNESSetErrorIfNotConverged(snes, PETSC_FALSE));
  PetscCall(SbSolverSetUp(snes, m->space, run->solve.solver_used));
  if (run->solve.ts)
    PetscCall(TSSetFromOptions(run->solve.ts));
  else
    PetscCall(SNESSetFromOptions(snes));
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &run->solve.single));
  PetscCall(SbSolverFinish(snes, m->space, run->solve.solver_used, run->solve.J));
  PetscCall(SbPotentialCreate(run));

  /* forcing terms */
  PetscCall(
    PetscObjectTypeCompareAny((PetscObject)snes, &newton, SB_SNES_NEWTON, SNESNEWTONLS, ""));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_ksp_ew", &asked));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_rtol", &rtol));
  if (!newton || asked || rtol)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESKSPSetUseEW(snes, PETSC_TRUE));
  PetscCall(SNESKSPSetParametersEW(snes, 2, most, most, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT,
                                   PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
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

static PetscErrorCode set_up_ts(SbRun run)
{
  const SbModel m = run->model;
  const SbSpace s = m->space;
  const SbMethodSettings settings = method_settings(run);
  PetscReal(*middle)[4], size = 0.;
  TSAdapt adapt;
  Vec F;

  PetscFunctionBeginUser;
  if (SbRunIsExplicit(run)) {
    /* the stable step of explicit integrators */
    PetscReal stable;

    PetscCall(SbSpaceStableStep(s, &stable));
    if (!run->clock.dt_given)
      run->clock.dt = 0.9 * stable;
    else if (run->clock.dt > stable)
      PetscCall(SbWarning(
        m->comm,
        "-ts_dt %g s is beyond the stable step of this mesh and material, %g s: expect the "
        "solution to blow up",
        (double)run->clock.dt, (double)stable));
  }

  /* the equation of motion and its integrator */
  PetscCall(SbSpaceCreateVec(s, &F));
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

  /* allowed displacement error per step of adaptive runs, over the size of the largest body, twice
     the largest distance of a node from the centre of its body: independent of units and
     orientation */
  PetscCall(PetscMalloc1(m->nbody, &middle));
  PetscCall(SbModelCentres(m, NULL, middle));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal r[3];

    SbSubtract(s->node_x + 3 * i, middle[s->node_body[i]], r);
    size = PetscMax(size, SbDot3(r, r));
  }
  PetscCall(PetscFree(middle));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &size, 1, MPIU_REAL, MPI_MAX, m->comm));
  PetscCall(TSSetTolerances(run->solve.ts, 2e-4 * PetscSqrtReal(size), NULL, 0., NULL));
  PetscCall(TSGetAdapt(run->solve.ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscCall(TSSetMaxSteps(run->solve.ts, PETSC_MAX_INT));
  PetscCall(TSSetExactFinalTime(run->solve.ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(TSSetErrorIfStepFails(run->solve.ts, PETSC_FALSE));

  /* solvers; -ts_dt has been read, and is set below */
  if (SB_TS_DT_RENAMED)
    PetscCall(PetscOptionsClearValue(NULL, "-ts_dt"));
  PetscCall(TSGetSNES(run->solve.ts, &run->solve.snes));
  PetscCall(set_up_snes(run));

  /* end time and step length; monitors */
  PetscCall(TSSetMaxTime(run->solve.ts, run->clock.t_end));
  PetscCall(TSSetTimeStep(run->solve.ts, run->clock.dt));
  PetscCall(TSMonitorSet(run->solve.ts, step_accepted, run, NULL));
  PetscCall(TSSetApplicationContext(run->solve.ts, run));
  PetscCall(TSSetPostStep(run->solve.ts, after_step));
  PetscCall(PetscObjectTypeCompare((PetscObject)adapt, TSADAPTNONE, &run->clock.fixed));
  m->barrier_apart = (PetscBool)(m->npotential && run->solve.preset != SB_TIME_EULER_IMPLICIT);
  if (m->barrier_apart)
    run->solve.barrier_weight = settings.separate ? 0.5 / settings.beta : 1. / settings.alpha_f;
  if (run->solve.preset != SB_TIME_ALPHA2)
    SbSecondOrderSet(run->solve.ts, run, &settings);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors unless barrier contact has its potential and is alone, and other contact has several
   solves per step and, where needed, a matrix that can be projected. */
static PetscErrorCode check_contact(SbRun run, PetscBool explicit)
{
  const SbModel m = run->model;
  const PetscBool implicit = (PetscBool)(!explicit && run->solve.preset != SB_TIME_ALPHA2);
  const PetscBool matrix =
    (PetscBool)(!run->solve.solver_used->matrix_free && strcmp(run->solve.solver, "pressure"));
  const char *name;

  PetscFunctionBeginUser;
  for (PetscInt e = 0; e < m->neffect; e++)
    PetscCheck(
      !m->effect[e]->euler || run->solve.preset == SB_TIME_EULER_IMPLICIT, m->comm,
      PETSC_ERR_USER_INPUT,
      "-effect_%s_restitution needs -time euler_implicit, whose velocities are those of a step",
      m->effect[e]->name);
  if (m->npotential) {
    name = m->potential[0]->name;
    PetscCheck(
      implicit, m->comm, PETSC_ERR_USER_INPUT,
      "-effect_%s_response barrier needs -time euler_implicit, newmark, genalpha or static", name);
    PetscCheck(
      run->solve.preset == SB_TIME_EULER_IMPLICIT || !m->dynamic || !m->space->consistent_mass,
      m->comm, PETSC_ERR_USER_INPUT,
      "-effect_%s_response barrier with -time newmark or genalpha needs -mass lumped", name);
    PetscCheck(!m->nbegin_step, m->comm, PETSC_ERR_USER_INPUT,
               "-effect_%s_response barrier and -effect_%s_response of another kind do not go "
               "together: give "
               "both the same",
               name, m->begin_step[0]->name);
    PetscCheck(
      matrix, m->comm, PETSC_ERR_USER_INPUT,
      "-solver %s has no complete matrix, to which the effect %s could add: use -solver auto or "
      "cg_two_level",
      run->solve.solver, name);
  }
  if (!m->nbegin_step)
    PetscFunctionReturn(PETSC_SUCCESS);
  name = m->begin_step[0]->name;
  PetscCheck(implicit, m->comm, PETSC_ERR_USER_INPUT,
             "The effect %s needs several solves in a step: use -time euler_implicit, newmark, "
             "genalpha or static",
             name);
  if (run->solve.preset == SB_TIME_NEWMARK) {
    /* its contact needs the trapezoidal rule, the lumped mass, and forces on constrained nodes
       only */
    PetscCheck(
      run->solve.newmark[0] == 0.25 && run->solve.newmark[1] == 0.5, m->comm, PETSC_ERR_USER_INPUT,
      "-time newmark with the effect %s needs -time_newmark_beta 0.25 and -time_newmark_gamma 0.5, "
      "not %g and %g: else impacts may gain energy",
      name, (double)run->solve.newmark[0], (double)run->solve.newmark[1]);
    PetscCheck(
      !m->space->consistent_mass, m->comm, PETSC_ERR_USER_INPUT,
      "-time newmark with the effect %s needs -mass lumped: velocities of contact are corrected "
      "node by node",
      name);
    for (PetscInt e = 0; e < m->nbegin_step; e++)
      PetscCheck(!m->begin_step[e]->springs, m->comm, PETSC_ERR_USER_INPUT,
                 "-time newmark gains energy by springs and friction of the effect %s: give "
                 "-effect_%s_response "
                 "projected or multiplier and no friction, or use euler_implicit or genalpha",
                 m->begin_step[e]->name, m->begin_step[e]->name);
  }
  PetscCheck(
    m->dynamic || !m->ntime_of_impact, m->comm, PETSC_ERR_USER_INPUT,
    "-effect_%s_time_of_impact yes is about the length of time steps, and -time static has none: "
    "leave it out",
    m->ntime_of_impact ? m->time_of_impact[0]->name : "");
  PetscCheck(run->solve.preset != SB_TIME_GENALPHA || !m->ntime_of_impact, m->comm,
             PETSC_ERR_USER_INPUT,
             "-time genalpha gains energy with -effect_%s_time_of_impact yes: it takes the "
             "acceleration of a "
             "short step, in which nodes are stopped, into a long one; use euler_implicit",
             m->ntime_of_impact ? m->time_of_impact[0]->name : "");
  PetscCheck(
    matrix || (!run->solve.solver_used->matrix_free && !m->nassemble_constraints), m->comm,
    PETSC_ERR_USER_INPUT,
    "-solver %s has no complete matrix, in which the effect %s could constrain nodes: use -solver "
    "rotated or cg_two_level",
    run->solve.solver, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSetUp(SbRun run)
{
  const SbModel m = run->model;
  const PetscBool explicit = SbRunIsExplicit(run);
  const SbSpace s = m->space;
  PetscBool warped = PETSC_FALSE;
  PetscScalar *mass;
  char reason[128];

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++)
    if (s->alpha[b] != 0. || s->beta[b] != 0.)
      run->solve.damped = m->dynamic;
  PetscCall(SbSpaceCreateVec(s, &run->state.mass));
  PetscCall(VecGetArrayWrite(run->state.mass, &mass));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    mass[i] = s->node_mass[i / 3];
  PetscCall(VecRestoreArrayWrite(run->state.mass, &mass));
  PetscCall(SbSpaceCreateVec(s, &run->state.U));
  if (m->dynamic) {
    PetscCall(SbSpaceCreateVec(s, &run->state.V));
    if (run->solve.preset != SB_TIME_ALPHA2)
      PetscCall(SbSpaceCreateVec(s, &run->state.A));
  }
  PetscCheck(m->dynamic || !SbLiveCount(), m->comm, PETSC_ERR_USER_INPUT,
             "-effect_<name>_... live: interactive values need a time, and -time static has "
             "none: choose -time euler_implicit, newmark or genalpha");
  if (!m->dynamic)
    m->load = run->clock.t0; /* a static run starts with load factor t0 */
  PetscCall(SbModelInitialState(m, run->state.U, run->state.V));
  if (run->clock.arc.on) {
    PetscCall(SbSpaceCreateVec(s, &run->state.path));
    PetscCall(SbSolverChooseIndefinite(m->comm, sizeof(run->solve.solver_choice),
                                       run->solve.solver_choice));
  }
  PetscCall(SbSolverChoose(s, m->dynamic, m->linear, explicit, run->solve.solver_choice,
                           &run->solve.solver_used, run->solve.solver_reason,
                           sizeof(run->solve.solver_reason)));
  PetscCall(
    PetscStrncpy(run->solve.solver, run->solve.solver_used->name, sizeof(run->solve.solver)));
  PetscCall(check_contact(run, explicit));

  /* the solver for barrier contact, for the log's header */
  if (m->npotential) {
    PetscCall(SbContactSystemDescribe(run->solve.contact_choice, reason, sizeof(reason)));
    SbAppend(sizeof(run->solve.solver_reason), run->solve.solver_reason, "; %s", reason);
  }
  if (run->solve.saddle) {
    PetscCall(SbSaddleChoose(s, m->dynamic, run->solve.saddle_choice, &run->solve.saddle_used,
                             reason, sizeof(reason)));
    SbAppend(sizeof(run->solve.solver_reason), run->solve.solver_reason, "; %s", reason);
  }

  /* the matrix, and the operator for constraints outside of it */
  if (!explicit) {
    PetscCall(SbSolverCreateOperator(s, run->solve.solver_used, &run->solve.J));
    if (m->nnonsymmetric)
      PetscCall(SbFormCreateOperator(run));
    else {
      PetscCall(PetscObjectReference((PetscObject)run->solve.J));
      run->solve.system = run->solve.J;
    }
    if (SbConstraintsSeparate(s)) {
      run->solve.unprojected = run->solve.system;
      PetscCall(SbConstraintsCreateOperator(s, run->solve.J, run->solve.unprojected,
                                            (PetscBool)!m->dynamic, run->solve.saddle_used,
                                            &run->solve.system));
    }
  }
  PetscCheck(!run->solve.solver_used->matrix_free || !m->ntangent, m->comm, PETSC_ERR_USER,
             "-solver %s works without a matrix, and the effect %s adds to it: use -solver rotated",
             run->solve.solver, m->tangent[0]->name);
  if (m->dynamic)
    PetscCall(set_up_ts(run));
  else {
    Vec F;

    run->clock.fixed = (PetscBool)!run->clock.arc.on;
    PetscCall(SbSpaceCreateVec(s, &F));
    PetscCall(SNESCreate(m->comm, &run->solve.snes));
    PetscCall(SNESSetFunction(run->solve.snes, F, SbFormStaticFunction, run));
    PetscCall(
      SNESSetJacobian(run->solve.snes, run->solve.system, run->solve.J, SbFormStaticJacobian, run));
    PetscCall(VecDestroy(&F));
    PetscCall(set_up_snes(run));
    if (run->clock.arc.on)
      PetscCall(SbArcLengthCheck(run));
  }
  PetscCall(SbSolverListCreate(run));

  /* PETSc's options may have changed the preset */
  if (!explicit) {
    PetscCall(SbSolverDescribe(run->solve.snes, s, sizeof(run->solve.solver_parts),
                               run->solve.solver_parts));
    if (run->solve.solver_used->by_type ||
        (run->solve.solver_used->direct &&
         !strstr(run->solve.solver_parts, run->solve.solver_used->package)))
      PetscCall(
        PetscStrncpy(run->solve.solver, run->solve.solver_parts, sizeof(run->solve.solver)));
  }

  /* one solve per step, with a tangent maybe too soft: no bound on the energy
     (docs/reference/theory.md) */
  for (PetscInt k = 0; k < m->nmaterial; k++)
    warped = (PetscBool)(warped || m->material[k]->tangent == SB_TANGENT_WARPED);
  if (run->solve.velocity_predictor && !m->linear && run->solve.single && warped)
    PetscCall(SbWarning(
      s->comm,
      "-snes_type ksponly with -time_predictor velocity and a warped tangent may gain energy "
      "without bound: give -body_<name>_tangent exact_spd, or leave the predictor out"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAddMonitor(SbRun run, SbMonitorFn fn, void *ctx)
{
  PetscFunctionBeginUser;
  PetscCheck(run->monitors.n < (PetscInt)PETSC_STATIC_ARRAY_LENGTH(run->monitors.list),
             PETSC_COMM_SELF, PETSC_ERR_PLIB, "More than %d monitors",
             (int)PETSC_STATIC_ARRAY_LENGTH(run->monitors.list));
  run->monitors.list[run->monitors.n].fn = fn;
  run->monitors.list[run->monitors.n++].ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSolve(SbRun run)
{
  const SbModel m = run->model;
  const char *unit = m->dynamic ? " s" : "";

  PetscFunctionBeginUser;

  /* effects that act only before or after the run */
  for (PetscInt k = 0; k < m->neffect && !run->clock.arc.on && run->clock.wall_start == 0.; k++) {
    const SbEffect e = m->effect[k];
    const PetscBool before = (PetscBool)(e->until <= 0.);

    if (before || e->from >= run->clock.t_end)
      PetscCall(SbWarning(
        m->comm, "the effect %s never acts: -effect_%s_%s %g%s, and the run goes from 0 to %g%s",
        e->name, e->name, before ? "until" : "from", (double)(before ? e->until : e->from), unit,
        (double)run->clock.t_end, unit));
  }
  if (run->clock.wall_start == 0.)
    run->clock.wall_start = MPI_Wtime();
  run->clock.paused = PETSC_FALSE;
  run->monitors.last.U = NULL;
  if (m->npotential)
    PetscCall(SbModelPotentialStart(m, run->clock.t0, run->clock.dt, run->state.U));
  if (run->solve.ts) {
    TSConvergedReason reason;
    PetscInt step;
    PetscReal t, dt;

    PetscCall(TSSetStepNumber(run->solve.ts, run->clock.step0));
    PetscCall(TSSetTime(run->solve.ts, run->clock.t0));
    PetscCall(TSSolve(run->solve.ts, run->state.U));

    /* PETSc's own integrators give no reason of a failure */
    PetscCall(TSGetConvergedReason(run->solve.ts, &reason));
    PetscCall(TSGetStepNumber(run->solve.ts, &step));
    PetscCall(TSGetTime(run->solve.ts, &t));
    PetscCall(TSGetTimeStep(run->solve.ts, &dt));
    if (reason < 0 && !run->clock.stop_reason[0] && !run->clock.stopped)
      PetscCall(SbRunFail(
        run,
        "step %" PetscInt_FMT
        " at t = %g s with a length of %g s: %s; try a shorter -ts_dt, or -time genalpha, which "
        "tries shorter ones by itself (docs/guides/when_it_fails.md, R1)",
        step + 1, (double)t, (double)dt, TSConvergedReasons[reason]));
  } else if (run->clock.arc.on)
    PetscCall(SbArcLengthSolve(run));
  else
    PetscCall(SbStaticSolve(run));
  run->counters.seconds_solve = MPI_Wtime() - run->clock.wall_start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunDestroy(SbRun *run)
{
  SbRun r = *run;
  Vec *const vectors[] = {&r->solve.R,
                          &r->solve.nonsymmetric.U,
                          &r->solve.nonsymmetric.x,
                          &r->solve.nonsymmetric.y,
                          &r->state.U,
                          &r->state.V,
                          &r->state.A,
                          &r->state.loads,
                          &r->state.reaction,
                          &r->state.previous,
                          &r->state.path,
                          &r->state.mass};

  PetscFunctionBeginUser;
  if (!r)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (r->monitors.output_destroy)
    PetscCall(r->monitors.output_destroy(r));
  PetscCall(PetscFree(r->solve.fallbacks));
  PetscCall(SbPotentialDestroy(&r->solve.potential));
  if (!r->solve.ts)
    PetscCall(SNESDestroy(&r->solve.snes));
  PetscCall(TSDestroy(&r->solve.ts));
  PetscCall(MatDestroy(&r->solve.system));
  PetscCall(MatDestroy(&r->solve.unprojected));
  PetscCall(MatDestroy(&r->solve.J));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(vectors); k++)
    PetscCall(VecDestroy(vectors[k]));
  PetscCall(PetscFree(*run));
  PetscFunctionReturn(PETSC_SUCCESS);
}
