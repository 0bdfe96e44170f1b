/*
  The solves of a step; with contact of nodes an active-set iteration: solve and update the active
  set until it stays.

  Later solves start near their solution, and a tolerance relative to their first residual could be
  below the rounding of large contact forces. So all solves of a step have the absolute tolerance of
  the first one; while the active set changes, that in time steps is a thousand times larger
  ("rough" solves).

  The nonlinear solver. Newton's method (src/newton) for nonlinear models, one linear solve for
  linear ones; tolerances independent of units. Newton's linear solves are as exact as its progress
  (Eisenstat and Walker), unless the user sets a tolerance. In a static run whose matrix lacks a
  part of the tangent (the free rim of a follower pressure), a factorisation is no exact solve, and
  changes of volume dominate the residual: loose solves make it linear near nu = 1/2.
*/
#include "sbsolver.h"
#include "time_impl.h"

#define DIGITS 1e-11    /* rounding of a residual, over the forces of contact and supports */
#define LOOSER 1e3      /* factor on the tolerance of rough solves */
#define ROUGH 1e-3      /* largest tolerance of rough solves, over the first residual */
#define ROUGH_ROUNDS 10 /* number of iterations after which solves are no longer rough */
#define ROUNDS \
  250 /* largest number of solves per step; response augmented may take more than 100 */
#define APART 0.05 /* least distance of a time of impact from the ends of a step, over its length */
#define FORCING 0.1         /* loosest relative tolerance of Newton's linear solves */
#define FORCING_BESIDE 1e-6 /* the same where the matrix lacks a part of the tangent */
#define RESIDUAL 1e-13      /* rounding of residuals, over (stress modulus) x (area of the body) */

/* Tolerances of the solves of a step. */
typedef struct {
  KSP ksp;
  PetscReal atol, rtol, linear_rtol, linear_atol; /* as set by the user */
  PetscReal size;  /* first residual of the step, N; 0: the user's tolerances */
  PetscReal least; /* rounding of residuals, N */
} Tolerances;

static PetscErrorCode set_tolerances(SbRun run, const Tolerances *tol, PetscBool rough)
{
  const PetscBool single = run->solve.single;
  const PetscReal rtol = single ? tol->linear_rtol : tol->rtol;
  const PetscReal part = rough ? PetscMax(rtol, PetscMin(ROUGH, LOOSER * rtol)) : rtol;
  const PetscReal atol =
    PetscMax(PetscMax(tol->atol, tol->least), (rough ? part : tol->rtol) * tol->size);
  const PetscReal linear = (single ? 1 : 0.1) * PetscMax(tol->least, part * tol->size);

  PetscFunctionBeginUser;
  PetscCall(SNESSetTolerances(run->solve.snes, atol, tol->rtol, PETSC_DEFAULT, PETSC_DEFAULT,
                              PETSC_DEFAULT));
  PetscCall(KSPSetTolerances(tol->ksp, PETSC_DEFAULT, PetscMax(tol->linear_atol, linear),
                             PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The tolerances of all solves of a step, from its guess U. */
static PetscErrorCode find_tolerances(SbRun run, const SbAttempt *attempt, Tolerances *tol)
{
  const SNES snes = run->solve.snes;
  const Vec U = attempt->step.U;
  const Vec R = run->solve.R;

  PetscFunctionBeginUser;
  PetscCall(SNESGetKSP(snes, &tol->ksp));
  PetscCall(SNESGetTolerances(snes, &tol->atol, &tol->rtol, NULL, NULL, NULL));
  PetscCall(KSPGetTolerances(tol->ksp, &tol->linear_rtol, &tol->linear_atol, NULL, NULL));

  /* scale of rounding: contact and support forces, as a body at rest has a residual of rounding
     only */
  tol->least = 0.;
  if (SbSpaceIsConstrained(run->model->space)) {
    PetscCall((*attempt->residual)(attempt->ctx, U, R));
    PetscCall(VecNorm(R, NORM_2, &tol->least));
    tol->least = PetscIsInfOrNanReal(tol->least) ? 0 : DIGITS * tol->least;
  }

  /* the first residual */
  PetscCall(SNESComputeFunction(snes, U, R));
  PetscCall(VecNorm(R, NORM_2, &tol->size));
  if (PetscIsInfOrNanReal(tol->size))
    tol->size = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From the displacement in U. */
static PetscErrorCode solve(SbRun run, Vec U, SNESConvergedReason *reason)
{
  PetscInt newton, linear;

  PetscFunctionBeginUser;
  PetscCall(SNESSolve(run->solve.snes, NULL, U));
  PetscCall(SNESGetConvergedReason(run->solve.snes, reason));
  PetscCall(SNESGetIterationNumber(run->solve.snes, &newton));
  PetscCall(SNESGetLinearSolveIterations(run->solve.snes, &linear));
  run->counters.newton_step += newton;
  run->counters.linear_step += linear;
  if (!newton && *reason == SNES_CONVERGED_FNORM_ABS) {
    PetscReal norm;

    PetscCall(SNESGetFunctionNorm(run->solve.snes, &norm));
    PetscCall(SbRunWarnIdle(run, "-snes_atol", norm, "the first residual"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first time of impact, as a fraction of the step, if it may end there. */
static PetscErrorCode find_impact(SbRun run)
{
  const SbModel m = run->model;
  PetscReal *impact = &run->clock.time_of_impact;

  PetscFunctionBeginUser;
  PetscCall(SbContactSetTimeOfImpact(&m->contacts, impact));
  if (*impact < APART || *impact > 1. - APART)
    *impact = 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix has the constraints of the last active set. */
static void forget_tangent(SbRun run)
{
  const SbSpace s = run->model->space;

  if (!run->model->dynamic || (s->constraints && !SbConstraintsSeparate(s)))
    run->solve.tangent_known = PETSC_FALSE;
}

PetscErrorCode SbRunBeginSolve(SbRun run, const SbAttempt *attempt, PetscBool warm)
{
  const SbModel m = run->model;
  const SbSolvedStep *step = &attempt->step;

  PetscFunctionBeginUser;
  if (m->contacts.n) {
    PetscReal speed;

    PetscCall(SbModelStepSpeed(m, step->t, step->dt, step->U0, run->state.V, &speed));
    PetscCall(
      SbContactSetBeginStep(&m->contacts, step->t, step->dt, speed, warm, step->U0, run->state.V));
    PetscCall(SbRunWarnLongWay(run, step));

    /* a run that goes on from a checkpoint knew no contact yet when it found its reactions */
    if (run->state.reaction && m->contacts.npotential && run->clock.step0 > 0 &&
        run->clock.step == run->clock.step0)
      PetscCall(SbRunReactions(run, run->clock.t, run->state.reaction));
  }
  PetscCall(SbPotentialBegin(run->solve.potential, step, warm));
  if (!warm)
    PetscCall((*attempt->predict)(attempt->ctx));
  if (m->contacts.nactive_set) {
    PetscCall(SbContactSetStartActiveSet(&m->contacts, step->U));
    forget_tangent(run);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSolveStep(SbRun run, const SbAttempt *attempt, SNESConvergedReason *reason)
{
  const SbModel m = run->model;
  const SbSolvedStep *step = &attempt->step;
  const Vec U = step->U;
  const PetscBool constrained = SbSpaceIsConstrained(m->space);
  PetscBool rough = (PetscBool)(constrained && m->dynamic);
  PetscBool again = PETSC_TRUE;
  Tolerances tol;

  PetscFunctionBeginUser;
  if (!m->contacts.nactive_set) {
    PetscCall(solve(run, U, reason));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!run->solve.R)
    PetscCall(VecDuplicate(U, &run->solve.R));
  PetscCall(find_tolerances(run, attempt, &tol));

  for (PetscInt round = 1;; round++) {
    /* a solve; the first one without contact has the user's tolerances */
    if (constrained || round > 1)
      PetscCall(set_tolerances(run, &tol, rough));
    PetscCall(SbSolverUpdateSymmetry(tol.ksp, m->space));
    PetscCall(SbSolverListBeginSolve(run));
    PetscCall(solve(run, U, reason));
    if (*reason <= 0)
      break;
    run->counters.contact_rounds = round;

    /* the active set */
    PetscCall((*attempt->residual)(attempt->ctx, U, run->solve.R));
    m->space->rough = rough;
    PetscCall(SbContactSetUpdateActiveSet(&m->contacts, U, run->solve.R, &again));
    if (round == 1 && run->clock.may_end_at_impact) {
      PetscCall(find_impact(run));
      if (run->clock.time_of_impact < 1.) {
        *reason = SNES_CONVERGED_ITERATING;
        break;
      }
    }

    /* until it stays, in a solve that is not rough */
    if (!again && !rough)
      break;
    if (!again || round == ROUGH_ROUNDS)
      rough = PETSC_FALSE;
    forget_tangent(run);
    PetscCall(SbRunStopAsked(run, run->clock.step, run->clock.t, PETSC_TRUE));
    if (run->clock.stopped || round == ROUNDS) {
      PetscCall(SbContactSetExplain(&m->contacts, round));
      *reason = SNES_DIVERGED_MAX_IT;
      break;
    }
  }

  /* the user's tolerances */
  tol.size = tol.least = 0.;
  PetscCall(set_tolerances(run, &tol, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Error for a -snes_type that cannot solve the equations here: others ask for bounds, for functions
   of a part of the mesh, or for smoothers of their own, or stop after a number of sweeps. */
static PetscErrorCode check_type(MPI_Comm comm)
{
  static const char *const works[] = {
    SB_SNES_NEWTON, SNESNEWTONLS, SNESNEWTONTR, "newtontrdc", SNESKSPONLY, SNESQN, SNESNCG,
  };
  char type[SB_NAME_MAX] = SB_SNES_NEWTON;
  char list[256] = "";
  PetscBool is = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, "-snes_type", type, sizeof(type), NULL));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(works); i++) {
    is = (PetscBool)(is || !strcmp(works[i], type));
    SbAppend(sizeof(list), list, "%s%s", list[0] ? ", " : "", works[i]);
  }
  PetscCheck(is, comm, PETSC_ERR_USER,
             "-snes_type %s does not solve the equations here: choose one of %s, "
             "or leave it out",
             type, list);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Type and tolerances of the SNES, before the user's options. */
static PetscErrorCode choose_snes(SbRun run)
{
  const SbModel m = run->model;
  const SNES snes = run->solve.snes;
  PetscReal force = 0.;
  PetscBool asked;
  SNESType type = SB_SNES_NEWTON;

  PetscFunctionBeginUser;

  /* PETSc's line searches need PETSc's Newton loop, and TSALPHA2 has its own stages */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-snes_linesearch_type", &asked));
  if (asked || run->solve.preset == SB_TIME_ALPHA2)
    type = SNESNEWTONLS;
  if (m->linear)
    type = SNESKSPONLY;
  PetscCall(SNESSetType(snes, type));

  /* near nu = 1/2 the modulus is lambda, as the pressure is lambda times the rounding error of the
     change of volume */
  for (PetscInt b = 0; b < m->nbody; b++) {
    const SbMaterial law = m->material[b];

    force += (SbMaterialYoungModulus(law) + 0.01 * PetscAbsReal(SbMaterialVolumetricModulus(law))) *
             PetscPowReal(m->body[b].volume, 2. / 3.);
  }
  run->solve.rounding = RESIDUAL * force;
  PetscCall(SNESSetDivergenceTolerance(snes, SB_UNLIMITED_REAL));
  PetscCall(SNESSetTolerances(snes, run->solve.rounding, m->dynamic ? 1e-6 : 1e-8, 0.,
                              SB_NEWTON_ITERATIONS, SB_UNLIMITED));
  PetscCall(SNESSetErrorIfNotConverged(snes, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSetUpSolver(SbRun run)
{
  const SbModel m = run->model;
  const SNES snes = run->solve.snes;
  const PetscReal most = !m->dynamic && m->nnonsymmetric ? FORCING_BESIDE : FORCING;
  PetscBool asked, newton, rtol;

  PetscFunctionBeginUser;
  PetscCall(check_type(m->comm));
  PetscCall(choose_snes(run));
  PetscCall(SbSolverSetUp(snes, m->space, run->solve.solver_used));

  /* PETSc's own options override all settings so far, those of the TS as well */
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
