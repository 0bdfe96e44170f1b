/*
  The solves of a step; with contact an active-set iteration: solve and update the active set until
  it stays.

  Later solves start near their solution, and a tolerance relative to their first residual could be
  below the rounding of large contact forces. So all solves of a step have the absolute tolerance of
  the first one; while the active set changes, that in time steps is a thousand times larger
  ("rough" solves).
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

/* Tolerances of the solvers as set by the user. */
typedef struct {
  PetscReal atol, rtol, linear_rtol, linear_atol;
  KSP ksp;
} Aim;

/* Sets the tolerances of a step with the first residual `size`, N; 0: the user's. least: rounding,
   N. */
static PetscErrorCode set_aim(SbRun run, const Aim *aim, PetscReal size, PetscReal least,
                              PetscBool rough)
{
  const PetscReal rtol = run->solve.single ? aim->linear_rtol : aim->rtol;
  const PetscReal part = rough ? PetscMax(rtol, PetscMin(ROUGH, LOOSER * rtol)) : rtol;
  const PetscReal atol = PetscMax(PetscMax(aim->atol, least), (rough ? part : aim->rtol) * size);
  const PetscReal linear = (run->solve.single ? 1 : 0.1) * PetscMax(least, part * size);

  PetscFunctionBeginUser;
  PetscCall(SNESSetTolerances(run->solve.snes, atol, aim->rtol, PETSC_DEFAULT, PETSC_DEFAULT,
                              PETSC_DEFAULT));
  PetscCall(KSPSetTolerances(aim->ksp, PETSC_DEFAULT, PetscMax(aim->linear_atol, linear),
                             PETSC_DEFAULT, PETSC_DEFAULT));
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
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRunSolveStep(SbRun run, const SbAttempt *attempt, SNESConvergedReason *reason)
{
  const SbModel m = run->model;
  const SNES snes = run->solve.snes;
  const SbSolvedStep *step = &attempt->step;
  const Vec U = step->U;
  const PetscBool projected =
    (PetscBool)(m->space->constraints && !SbConstraintsSeparate(m->space));
  PetscBool again = PETSC_TRUE;
  PetscBool rough, constrained;
  PetscReal size;
  PetscReal least = 0;
  Aim aim;

  PetscFunctionBeginUser;
  if (!m->nbegin_step) {
    PetscCall(solve(run, U, reason));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!run->solve.R)
    PetscCall(VecDuplicate(U, &run->solve.R));

  /* tolerances as set by the user */
  PetscCall(SNESGetKSP(snes, &aim.ksp));
  PetscCall(SNESGetTolerances(snes, &aim.atol, &aim.rtol, NULL, NULL, NULL));
  PetscCall(KSPGetTolerances(aim.ksp, &aim.linear_rtol, &aim.linear_atol, NULL, NULL));

  /* the initial active set */
  PetscCall(SbModelContactBeginStep(m, step->t, step->dt, step->U0, run->state.V, U));
  constrained = SbSpaceIsConstrained(m->space);
  rough = (PetscBool)(constrained && m->dynamic);

  /* the matrix has the old constraints */
  if (projected || !m->dynamic)
    run->solve.tangent_known = PETSC_FALSE;
  if (constrained) {
    /* scale of rounding: contact and support forces, as a body at rest has a residual of rounding
       only */
    PetscCall((*attempt->residual)(attempt->ctx, U, run->solve.R));
    PetscCall(VecNorm(run->solve.R, NORM_2, &least));
    least = PetscIsInfOrNanReal(least) ? 0 : DIGITS * least;
  }

  /* the tolerance of all solves of this step: that of the first one */
  PetscCall(SNESComputeFunction(snes, U, run->solve.R));
  PetscCall(VecNorm(run->solve.R, NORM_2, &size));
  if (PetscIsInfOrNanReal(size))
    size = 0;

  /* solves until the active set does not change; the first one without contact has the user's
     tolerances */
  for (PetscInt round = 1;; round++) {
    if (constrained || round > 1)
      PetscCall(set_aim(run, &aim, size, least, rough));
    PetscCall(SbSolverUpdateSymmetry(aim.ksp, m->space));
    PetscCall(solve(run, U, reason));
    if (*reason <= 0)
      break;
    run->counters.contact_rounds = round;
    PetscCall((*attempt->residual)(attempt->ctx, U, run->solve.R));
    m->space->rough = rough;
    PetscCall(SbModelContactUpdateActiveSet(m, step->t + step->dt, U, run->solve.R, &again));
    if (round == 1 && run->clock.may_end_at_impact) {
      /* the first time of impact, if the step may end there */
      for (PetscInt e = 0; e < m->ntime_of_impact; e++)
        SbEffectCall(m->time_of_impact[e], time_of_impact, &run->clock.time_of_impact);
      PetscCallMPI(
        MPI_Allreduce(MPI_IN_PLACE, &run->clock.time_of_impact, 1, MPIU_REAL, MPI_MIN, m->comm));
      if (run->clock.time_of_impact < APART || run->clock.time_of_impact > 1. - APART)
        run->clock.time_of_impact = 1.;
      if (run->clock.time_of_impact < 1.)
        *reason = SNES_CONVERGED_ITERATING;
    }
    if ((!again && !rough) || !*reason)
      break;
    if (!again || round == ROUGH_ROUNDS)
      rough = PETSC_FALSE;
    if (projected || !m->dynamic)
      run->solve.tangent_known = PETSC_FALSE;
    PetscCall(SbRunStopAsked(run, run->clock.step, run->clock.t, PETSC_TRUE));
    if (run->clock.stopped || round == ROUNDS) {
      *reason = SNES_DIVERGED_MAX_IT;
      break;
    }
  }
  PetscCall(set_aim(run, &aim, 0, 0, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}
