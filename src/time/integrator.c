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

  for (int i = 0; i < (int)run->preset; i++)
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
  r->barrier_weight = 1.;
  r->model = model;
  PetscCall(SbOptionChoice(&SbRunScope, "time", &r->preset));
  model->dynamic = (PetscBool)(r->preset != SB_TIME_STATIC);
  if (model->dynamic) {
    char text[64];
    PetscBool given, given_new;

    /* every PETSc accepts both names of the step option: -ts_time_step is the new one */
    PetscCall(PetscOptionsHasName(NULL, NULL, "-ts_dt", &given));
    PetscCall(PetscOptionsGetString(NULL, NULL, "-ts_time_step", text, sizeof(text), &given_new));
    if (given_new && !given)
      PetscCall(PetscOptionsSetValue(NULL, "-ts_dt", text));
    PetscCall(SbOptionReal(&SbRunScope, "ts_dt", &r->dt));
    PetscCall(SbOptionGiven(&SbRunScope, "ts_dt", &r->dt_given));
    PetscCall(SbOptionReal(&SbRunScope, "ts_max_time", &r->t_end));
    PetscCall(SbOptionSecond(&SbRunScope, "time_predictor", &r->velocity_predictor));
  } else {
    PetscCall(SbOptionInt(&SbRunScope, "static_steps", &r->static_steps));
    PetscCall(SbOptionReal(&SbRunScope, "static_min_increment", &r->min_increment));
    PetscCall(SbOptionSecond(&SbRunScope, "static_control", &r->arc.on));
    r->t_end = 1.;
    r->dt = 1. / (PetscReal)r->static_steps;
  }
  if (r->arc.on) {
    PetscCall(SbOptionInt(&SbRunScope, "static_max_steps", &r->arc.steps));
    PetscCall(SbOptionReal(&SbRunScope, "static_max_displacement", &r->arc.displacement));
    PetscCall(SbOptionReal(&SbRunScope, "static_longest_step", &r->arc.longest));

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
  if (r->preset == SB_TIME_GENALPHA || r->preset == SB_TIME_ALPHA2)
    PetscCall(SbOptionReal(&SbRunScope, "time_spectral_radius", &r->spectral_radius));
  if (r->preset == SB_TIME_NEWMARK) {
    PetscCall(SbOptionReal(&SbRunScope, "time_newmark_beta", &r->newmark[0]));
    PetscCall(SbOptionReal(&SbRunScope, "time_newmark_gamma", &r->newmark[1]));
  }
  PetscCall(SbRunReadStop(r));
  PetscCall(SbOptionInt(&SbRunScope, "time_max_halvings", &r->max_halvings));
  PetscCall(SbOptionChoice(&SbRunScope, "time_inverted", &inverted));
  r->reject_inverted = (PetscBool)(inverted == 2);
  for (PetscInt k = 0; k < model->nmaterial && !inverted && !model->dynamic && !r->arc.on; k++)
    r->reject_inverted = (PetscBool)(r->reject_inverted || model->material[k]->softens);
  PetscCheck(!r->reject_inverted || r->preset != SB_TIME_ALPHA2, PETSC_COMM_SELF, PETSC_ERR_USER,
             "-time_inverted reject: -time alpha2 cannot reject steps; take genalpha, which is the "
             "same method");
  for (PetscInt e = 0; e < model->neffect; e++) {
    r->saddle =
      (PetscBool)(r->saddle || (model->effect[e]->contact && model->effect[e]->contact->saddle));
    barrier = (PetscBool)(barrier || SbEffectHasPotential(model->effect[e]));
  }
  if (r->saddle)
    PetscCall(SbOptionChoice(&SbRunScope, "saddle_solver", &r->saddle_choice));
  if (barrier)
    PetscCall(SbOptionChoice(&SbRunScope, "contact_solver", &r->contact_choice));
  PetscCall(SbSolverSetFromOptions(r->solver_choice, sizeof(r->solver_choice)));
  *run = r;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The parameters of a preset's method. */
static SbMethodSettings method_settings(SbRun run)
{
  const PetscReal r = run->spectral_radius;
  const PetscReal m = (2. - r) / (1. + r);
  const PetscReal f = 1. / (1. + r);
  const PetscReal *n = run->newmark;
  const PetscBool impulses = (PetscBool)(run->model->contacts.nactive_set > 0);
  const PetscBool separate = (PetscBool)(run->model->contacts.npotential > 0);
  SbMethodSettings set = {.method = SB_METHOD_EULER_IMPLICIT, .alpha_m = 1., .alpha_f = 1.};

  if (run->preset == SB_TIME_NEWMARK)
    set = (SbMethodSettings){SB_METHOD_GENERALIZED_ALPHA, 1., 1., n[0], n[1], impulses, separate};
  if (run->preset == SB_TIME_GENALPHA)
    set = (SbMethodSettings){SB_METHOD_GENERALIZED_ALPHA,
                             m,
                             f,
                             0.25 * PetscSqr(1. + m - f),
                             0.5 + m - f,
                             PETSC_FALSE,
                             PETSC_FALSE};
  if (run->preset == SB_TIME_EULER_EXPLICIT)
    set.method = SB_METHOD_EULER_EXPLICIT;
  if (run->preset == SB_TIME_EULER_SYMPLECTIC)
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
  const SNES snes = run->snes;
  const PetscReal most = !m->dynamic && m->nnonsymmetric ? FORCING_BESIDE : FORCING;
  PetscReal force = 0.;
  PetscBool asked, newton, rtol;

  PetscFunctionBeginUser;

  /* residuals below 1e-13 of (stress modulus) x (area of the body) are rounding; near nu = 1/2 the
     modulus is lambda, as the pressure is lambda times the rounding error of the change of
     volume */
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbMaterial law = m->material[b];

    force += (SbMaterialYoungModulus(law) + 0.01 * SbMaterialVolumetricModulus(law)) *
             PetscPowReal(m->body[b].volume, 2. / 3.);
  }

  /* PETSc's line searches need PETSc's Newton loop, and TSALPHA2 has its own stages */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_linesearch_type", &asked));
  PetscCall(SNESSetType(snes, m->linear                                ? SNESKSPONLY
                              : asked || run->preset == SB_TIME_ALPHA2 ? SNESNEWTONLS
                                                                       : SB_SNES_NEWTON));
  PetscCall(SNESSetDivergenceTolerance(snes, SB_UNLIMITED_REAL));
  PetscCall(SNESSetTolerances(snes, 1e-13 * force, m->dynamic ? 1e-6 : 1e-8, 0.,
                              SB_NEWTON_ITERATIONS, SB_UNLIMITED));
  PetscCall(SNESSetErrorIfNotConverged(snes, PETSC_FALSE));
  PetscCall(SbSolverSetUp(snes, m->space, run->solver_used));
  if (run->ts)
    PetscCall(TSSetFromOptions(run->ts));
  else
    PetscCall(SNESSetFromOptions(snes));
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &run->single));
  PetscCall(SbSolverFinish(snes, m->space, run->solver_used, run->J));
  PetscCall(SbNewtonSetRun(snes, run));

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
  run->newton_step = newton + run->newton_before - run->newton_total;
  run->linear_step = linear + run->linear_before - run->linear_total;
  PetscCall(
    SbRunStepAccepted(run, step, t, step == run->step0 ? 0. : t - previous,
                      (PetscBool)((reason > 0 && !run->paused) || t >= run->t_end * (1. - 1e-12))));
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
  if (reason || t >= run->t_end * (1. - 1e-12))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(TSGetStepNumber(ts, &step));
  PetscCall(TSGetPrevTime(ts, &before));
  run->after.dt = t - before;
  if (run->after.fn)
    PetscCall((*run->after.fn)(run, step, t, t - before, run->after.ctx, &run->paused));
  PetscCall(SbRunStopAsked(run, step, t, PETSC_FALSE));
  if (run->paused || run->stopped)
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
    if (!run->dt_given)
      run->dt = 0.9 * stable;
    else if (run->dt > stable)
      PetscCall(SbWarning(
        m->comm,
        "-ts_dt %g s is beyond the stable step of this mesh and material, %g s: expect the "
        "solution to blow up",
        (double)run->dt, (double)stable));
  }

  /* the equation of motion and its integrator */
  PetscCall(SbSpaceCreateVec(s, &F));
  PetscCall(TSCreate(m->comm, &run->ts));
  PetscCall(TSSetProblemType(run->ts, TS_NONLINEAR));
  PetscCall(TS2SetSolution(run->ts, run->U, run->V));
  PetscCall(TSSetI2Function(run->ts, F, SbFormI2Function, run));
  PetscCall(TSSetI2Jacobian(run->ts, run->operator, run->J, SbFormI2Jacobian, run));
  PetscCall(VecDestroy(&F));
  if (run->preset == SB_TIME_ALPHA2) {
    PetscCall(TSSetType(run->ts, TSALPHA2));
    PetscCall(TSAlpha2SetRadius(run->ts, run->spectral_radius));
  } else
    PetscCall(TSSetType(run->ts, SB_TS_SECOND_ORDER));

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
  PetscCall(TSSetTolerances(run->ts, 2e-4 * PetscSqrtReal(size), NULL, 0., NULL));
  PetscCall(TSGetAdapt(run->ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscCall(TSSetMaxSteps(run->ts, PETSC_MAX_INT));
  PetscCall(TSSetExactFinalTime(run->ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(TSSetErrorIfStepFails(run->ts, PETSC_FALSE));

  /* solvers; -ts_dt has been read, and is set below */
  if (SB_TS_DT_RENAMED)
    PetscCall(PetscOptionsClearValue(NULL, "-ts_dt"));
  PetscCall(TSGetSNES(run->ts, &run->snes));
  PetscCall(set_up_snes(run));

  /* end time and step length; monitors */
  PetscCall(TSSetMaxTime(run->ts, run->t_end));
  PetscCall(TSSetTimeStep(run->ts, run->dt));
  PetscCall(TSMonitorSet(run->ts, step_accepted, run, NULL));
  PetscCall(TSSetApplicationContext(run->ts, run));
  PetscCall(TSSetPostStep(run->ts, after_step));
  PetscCall(PetscObjectTypeCompare((PetscObject)adapt, TSADAPTNONE, &run->fixed_step));
  m->barrier_apart = (PetscBool)(m->contacts.npotential && run->preset != SB_TIME_EULER_IMPLICIT);
  if (m->barrier_apart)
    run->barrier_weight = settings.separate ? 0.5 / settings.beta : 1. / settings.alpha_f;
  if (run->preset != SB_TIME_ALPHA2)
    SbSecondOrderSet(run->ts, run, &settings);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors unless barrier contact has its potential and is alone, and other contact has several
   solves per step and, where needed, a matrix that can be projected. */
static PetscErrorCode check_contact(SbRun run, PetscBool explicit)
{
  const SbModel m = run->model;
  const PetscBool implicit = (PetscBool)(!explicit && run->preset != SB_TIME_ALPHA2);
  const PetscBool matrix =
    (PetscBool)(!run->solver_used->matrix_free && strcmp(run->solver, "pressure"));
  const char *name;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < m->contacts.n; k++)
    PetscCheck(
      m->contacts.contact[k]->restitution <= 0. || run->preset == SB_TIME_EULER_IMPLICIT, m->comm,
      PETSC_ERR_USER_INPUT,
      "-effect_%s_restitution needs -time euler_implicit, whose velocities are those of a step",
      m->contacts.contact[k]->effect->name);
  if (m->contacts.npotential) {
    name = m->contacts.potential[0]->effect->name;
    PetscCheck(
      implicit, m->comm, PETSC_ERR_USER_INPUT,
      "-effect_%s_response barrier needs -time euler_implicit, newmark, genalpha or static", name);
    PetscCheck(run->preset == SB_TIME_EULER_IMPLICIT || !m->dynamic || !m->space->consistent_mass,
               m->comm, PETSC_ERR_USER_INPUT,
               "-effect_%s_response barrier with -time newmark or genalpha needs -mass lumped",
               name);
    PetscCheck(!m->contacts.nactive_set, m->comm, PETSC_ERR_USER_INPUT,
               "-effect_%s_response barrier and -effect_%s_response of another kind do not go "
               "together: give "
               "both the same",
               name, m->contacts.active_set[0]->effect->name);
    PetscCheck(
      matrix, m->comm, PETSC_ERR_USER_INPUT,
      "-solver %s has no complete matrix, to which the effect %s could add: use -solver auto or "
      "cg_two_level",
      run->solver, name);
  }
  if (!m->contacts.nactive_set)
    PetscFunctionReturn(PETSC_SUCCESS);
  name = m->contacts.active_set[0]->effect->name;
  PetscCheck(implicit, m->comm, PETSC_ERR_USER_INPUT,
             "The effect %s needs several solves in a step: use -time euler_implicit, newmark, "
             "genalpha or static",
             name);
  if (run->preset == SB_TIME_NEWMARK) {
    /* its contact needs the trapezoidal rule, the lumped mass, and forces on constrained nodes
       only */
    PetscCheck(
      run->newmark[0] == 0.25 && run->newmark[1] == 0.5, m->comm, PETSC_ERR_USER_INPUT,
      "-time newmark with the effect %s needs -time_newmark_beta 0.25 and -time_newmark_gamma 0.5, "
      "not %g and %g: else impacts may gain energy",
      name, (double)run->newmark[0], (double)run->newmark[1]);
    PetscCheck(
      !m->space->consistent_mass, m->comm, PETSC_ERR_USER_INPUT,
      "-time newmark with the effect %s needs -mass lumped: velocities of contact are corrected "
      "node by node",
      name);
    for (PetscInt e = 0; e < m->contacts.nactive_set; e++)
      PetscCheck(!m->contacts.active_set[e]->springs, m->comm, PETSC_ERR_USER_INPUT,
                 "-time newmark gains energy by springs and friction of the effect %s: give "
                 "-effect_%s_response "
                 "projected or multiplier and no friction, or use euler_implicit or genalpha",
                 m->contacts.active_set[e]->effect->name, m->contacts.active_set[e]->effect->name);
  }
  PetscCheck(
    m->dynamic || !m->contacts.ends_step, m->comm, PETSC_ERR_USER_INPUT,
    "-effect_%s_time_of_impact yes is about the length of time steps, and -time static has none: "
    "leave it out",
    m->contacts.ends_step ? m->contacts.ends_step->effect->name : "");
  PetscCheck(run->preset != SB_TIME_GENALPHA || !m->contacts.ends_step, m->comm,
             PETSC_ERR_USER_INPUT,
             "-time genalpha gains energy with -effect_%s_time_of_impact yes: it takes the "
             "acceleration of a "
             "short step, in which nodes are stopped, into a long one; use euler_implicit",
             m->contacts.ends_step ? m->contacts.ends_step->effect->name : "");
  PetscCheck(
    matrix || (!run->solver_used->matrix_free && !m->contacts.nconstraint), m->comm,
    PETSC_ERR_USER_INPUT,
    "-solver %s has no complete matrix, in which the effect %s could constrain nodes: use -solver "
    "rotated or cg_two_level",
    run->solver, name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSetUp(SbRun run)
{
  const SbModel m = run->model;
  const PetscBool explicit = SbRunIsExplicit(run);
  const SbSpace s = m->space;
  PetscBool warped = PETSC_FALSE;
  SbSolverProblem problem;
  PetscScalar *mass;
  char reason[128];

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < m->nbody; b++)
    if (s->alpha[b] != 0. || s->beta[b] != 0.)
      run->damped = m->dynamic;
  PetscCall(SbSpaceCreateVec(s, &run->mass));
  PetscCall(VecGetArrayWrite(run->mass, &mass));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    mass[i] = s->node_mass[i / 3];
  PetscCall(VecRestoreArrayWrite(run->mass, &mass));
  PetscCall(SbSpaceCreateVec(s, &run->U));
  if (m->dynamic) {
    PetscCall(SbSpaceCreateVec(s, &run->V));
    if (run->preset != SB_TIME_ALPHA2)
      PetscCall(SbSpaceCreateVec(s, &run->A));
  }
  PetscCheck(m->dynamic || !SbLiveCount(), m->comm, PETSC_ERR_USER_INPUT,
             "-effect_<name>_... live: interactive values need a time, and -time static has "
             "none: choose -time euler_implicit, newmark or genalpha");
  if (!m->dynamic)
    m->load = run->t0; /* a static run starts with load factor t0 */
  PetscCall(SbModelInitialState(m, run->U, run->V));
  if (run->arc.on) {
    PetscCall(SbSpaceCreateVec(s, &run->path));
    PetscCall(SbSolverChooseIndefinite(m->comm, sizeof(run->solver_choice), run->solver_choice));
  }
  problem = (SbSolverProblem){m->dynamic, m->linear, explicit, run->solver_choice};
  PetscCall(
    SbSolverChoose(s, &problem, sizeof(run->solver_reason), run->solver_reason, &run->solver_used));
  PetscCall(PetscStrncpy(run->solver, run->solver_used->name, sizeof(run->solver)));
  PetscCall(check_contact(run, explicit));

  /* the solver for barrier contact, for the log's header */
  if (m->contacts.npotential) {
    PetscCall(SbContactSystemDescribe(run->contact_choice, reason, sizeof(reason)));
    SbAppend(sizeof(run->solver_reason), run->solver_reason, "; %s", reason);
  }
  if (run->saddle) {
    PetscCall(
      SbSaddleChoose(s, m->dynamic, run->saddle_choice, &run->saddle_used, reason, sizeof(reason)));
    SbAppend(sizeof(run->solver_reason), run->solver_reason, "; %s", reason);
  }

  /* the matrix, and the operator for constraints outside of it */
  if (!explicit) {
    PetscCall(SbSolverCreateOperator(s, run->solver_used, &run->J));
    if (m->nnonsymmetric)
      PetscCall(SbFormCreateOperator(run));
    else {
      PetscCall(PetscObjectReference((PetscObject)run->J));
      run->operator= run->J;
    }
    if (SbConstraintsSeparate(s)) {
      run->whole = run->operator;
      PetscCall(SbConstraintsCreateOperator(s, run->J, run->whole, (PetscBool)!m->dynamic,
                                            run->saddle_used, &run->operator));
    }
  }
  PetscCheck(!run->solver_used->matrix_free || !m->ntangent, m->comm, PETSC_ERR_USER,
             "-solver %s works without a matrix, and the effect %s adds to it: use -solver rotated",
             run->solver, m->tangent[0]->name);
  if (m->dynamic)
    PetscCall(set_up_ts(run));
  else {
    Vec F;

    run->fixed_step = (PetscBool)!run->arc.on;
    PetscCall(SbSpaceCreateVec(s, &F));
    PetscCall(SNESCreate(m->comm, &run->snes));
    PetscCall(SNESSetFunction(run->snes, F, SbFormStaticFunction, run));
    PetscCall(SNESSetJacobian(run->snes, run->operator, run->J, SbFormStaticJacobian, run));
    PetscCall(VecDestroy(&F));
    PetscCall(set_up_snes(run));
    if (run->arc.on)
      PetscCall(SbArcLengthCheck(run));
  }
  PetscCall(SbSolverListCreate(run));

  /* PETSc's options may have changed the preset */
  if (!explicit) {
    PetscCall(SbSolverDescribe(run->snes, s, sizeof(run->solver_parts), run->solver_parts));
    if (run->solver_used->by_type ||
        (run->solver_used->direct && !strstr(run->solver_parts, run->solver_used->package)))
      PetscCall(PetscStrncpy(run->solver, run->solver_parts, sizeof(run->solver)));
  }

  /* one solve per step, with a tangent maybe too soft: no bound on the energy
     (docs/reference/theory.md) */
  for (PetscInt k = 0; k < m->nmaterial; k++)
    warped = (PetscBool)(warped || m->material[k]->tangent == SB_TANGENT_WARPED);
  if (run->velocity_predictor && !m->linear && run->single && warped)
    PetscCall(SbWarning(
      s->comm,
      "-snes_type ksponly with -time_predictor velocity and a warped tangent may gain energy "
      "without bound: give -body_<name>_tangent exact_spd, or leave the predictor out"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunAddMonitor(SbRun run, SbMonitorFn fn, void *ctx)
{
  PetscFunctionBeginUser;
  PetscCheck(run->nmonitor < (PetscInt)PETSC_STATIC_ARRAY_LENGTH(run->monitor), PETSC_COMM_SELF,
             PETSC_ERR_PLIB, "More than %d monitors", (int)PETSC_STATIC_ARRAY_LENGTH(run->monitor));
  run->monitor[run->nmonitor].fn = fn;
  run->monitor[run->nmonitor++].ctx = ctx;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSolve(SbRun run)
{
  const SbModel m = run->model;
  const char *unit = m->dynamic ? " s" : "";

  PetscFunctionBeginUser;

  /* effects that act only before or after the run */
  for (PetscInt k = 0; k < m->neffect && !run->arc.on && run->wall_start == 0.; k++) {
    const SbEffect e = m->effect[k];
    const PetscBool before = (PetscBool)(e->until <= 0.);

    if (before || e->from >= run->t_end)
      PetscCall(SbWarning(
        m->comm, "the effect %s never acts: -effect_%s_%s %g%s, and the run goes from 0 to %g%s",
        e->name, e->name, before ? "until" : "from", (double)(before ? e->until : e->from), unit,
        (double)run->t_end, unit));
  }
  if (run->wall_start == 0.)
    run->wall_start = MPI_Wtime();
  run->paused = PETSC_FALSE;
  run->seen.U = NULL;
  PetscCall(SbContactSetStart(&m->contacts, run->t0, run->dt, run->U));
  if (run->ts) {
    TSConvergedReason reason;
    PetscInt step;
    PetscReal t, dt;

    PetscCall(TSSetStepNumber(run->ts, run->step0));
    PetscCall(TSSetTime(run->ts, run->t0));
    PetscCall(TSSolve(run->ts, run->U));

    /* PETSc's own integrators give no reason of a failure */
    PetscCall(TSGetConvergedReason(run->ts, &reason));
    PetscCall(TSGetStepNumber(run->ts, &step));
    PetscCall(TSGetTime(run->ts, &t));
    PetscCall(TSGetTimeStep(run->ts, &dt));
    if (reason < 0 && !run->stop_reason[0] && !run->stopped)
      PetscCall(SbRunFail(
        run,
        "step %" PetscInt_FMT
        " at t = %g s with a length of %g s: %s; try a shorter -ts_dt, or -time genalpha, which "
        "tries shorter ones by itself (docs/guides/when_it_fails.md, R1)",
        step + 1, (double)t, (double)dt, TSConvergedReasons[reason]));
  } else if (run->arc.on)
    PetscCall(SbArcLengthSolve(run));
  else
    PetscCall(SbStaticSolve(run));
  run->seconds_solve = MPI_Wtime() - run->wall_start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunDestroy(SbRun *run)
{
  SbRun r = *run;
  Vec *const vectors[] = {
    &r->R, &r->nonsymmetric.U, &r->nonsymmetric.x, &r->nonsymmetric.y, &r->U,    &r->V,
    &r->A, &r->loads,          &r->reaction,       &r->previous,       &r->path, &r->mass};

  PetscFunctionBeginUser;
  if (!r)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (r->output_destroy)
    PetscCall(r->output_destroy(r));
  PetscCall(PetscFree(r->solver_list));
  if (!r->ts)
    PetscCall(SNESDestroy(&r->snes));
  PetscCall(TSDestroy(&r->ts));
  PetscCall(MatDestroy(&r->operator));
  PetscCall(MatDestroy(&r->whole));
  PetscCall(MatDestroy(&r->J));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(vectors); k++)
    PetscCall(VecDestroy(vectors[k]));
  PetscCall(PetscFree(*run));
  PetscFunctionReturn(PETSC_SUCCESS);
}
