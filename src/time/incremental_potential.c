/*
  The incremental potential of a step, as Newton's method (src/newton) minimises it: what its
  function and Jacobian do not tell is here, from the model.

  Strain is that of a stage between the start of the step and the iterate X, with methods that
  evaluate forces there: with w its fraction of the step, the residual is divided by w, and the
  energy is psi(u_0 + w (X - u_0)) / w^2. Barrier contact is evaluated at X, with the weight that
  the integrator gives its force.

  Stresses. In static runs the geometric stiffness uses the linearised stresses after the step, as
  if they were unknowns of their own (src/fem/linear_stress.c). Time steps are short enough without;
  constraints of nodes, which change from solve to solve, are solved again from a solution.

  Barrier contact is solved when the last step is a full one, and below a part of the way of the
  fastest body in a time step (static: of the size of the smallest body), and below a part of the
  barrier's width.
*/
#include "sbsolver.h"
#include "time_impl.h"

#define SETTLED 1e-4  /* largest last step, over SbContactSet.speed times dt */
#define STICKING 1e-2 /* factor on it with friction, whose forces depend on such small slips */
#define SETTLED_STATIC \
  1e-7 /* the same tolerance in a static run, over the size of the smallest body */
#define SETTLED_LEAST 1e-8 /* least tolerance in time steps of full length, over that size */
#define SETTLED_GAP \
  1e-2 /* largest change of gaps in the last iteration, over the barrier's width */

/* What Newton's method minimises; owned by the run. */
struct _p_SbPotential {
  SbRun run; /* borrowed */
  SbNewtonProblem problem;
  SbNewtonBarrier barrier;

  /* the last linear system with barrier contact */
  SbContactSystem system; /* owned; NULL before the first contact */
  SbBlocks blocks;        /* Hessian of the barriers; owned */
  SbConstraintRows rows;  /* exact constraints; owned */
  PetscInt nblock;        /* number of its blocks, all ranks */
};

/* The stage of X, which may be the start of the step. */
static PetscErrorCode find_stage(SbRun run, Vec X)
{
  const Vec start = run->solve.stage.start;
  const PetscReal part = run->solve.stage.part;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(X, run->solve.stage.U));
  if (X != start)
    PetscCall(VecAXPBY(run->solve.stage.U, 1. - part, part, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode energy(void *ctx, Vec X, SbNewtonEnergy *value, Vec strain, Vec contact)
{
  const SbRun run = ((SbPotential)ctx)->run;
  const SbModel m = run->model;
  const Vec stage = run->solve.stage.U;
  const PetscReal part = run->solve.stage.part;

  PetscFunctionBeginUser;

  /* strain at the stage */
  if (stage)
    PetscCall(find_stage(run, X));
  PetscCall(SbModelStrainEnergy(m, stage ? stage : X, strain, &value->strain, &value->ninverted));
  if (stage && part != 1.) {
    value->strain /= PetscSqr(part);
    PetscCall(VecScale(strain, 1. / part));
  }

  /* contact at X */
  value->contact = 0.;
  if (m->contacts.npotential) {
    PetscReal gaps;

    PetscCall(VecZeroEntries(contact));
    PetscCall(
      SbContactSetGradient(&m->contacts, X, run->solve.barrier_weight, PETSC_TRUE, &gaps, contact));
    value->contact = run->solve.barrier_weight * gaps;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode filter(void *ctx, PetscBool filtered, PetscBool required)
{
  const SbModel m = ((SbPotential)ctx)->run->model;

  PetscFunctionBeginUser;
  PetscCall(SbModelProjectTangent(m, filtered));
  if (required)
    m->space->tentative = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode negative_eigenvalues(void *ctx, PetscInt *n)
{
  const SbRun run = ((SbPotential)ctx)->run;

  PetscFunctionBeginUser;
  PetscCall(SbSolverCountNegativeEigenvalues(run->solve.snes, run->model->space, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode linearise(void *ctx, Vec X, Vec Y, PetscReal s)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceLineariseStress(((SbPotential)ctx)->run->model->space, X, Y, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode freeze(void *ctx, Vec X)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceMullinsFreeze(((SbPotential)ctx)->run->model->space, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode interrupted(void *ctx, PetscBool *is)
{
  const SbRun run = ((SbPotential)ctx)->run;

  PetscFunctionBeginUser;
  PetscCall(SbRunStopAsked(run, run->clock.step, run->clock.t, PETSC_TRUE));
  *is = run->clock.stopped;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No tet is inverted whose law does not admit it, neither at X nor at the stage. */
static PetscErrorCode longest(void *ctx, Vec X, Vec Y, PetscReal *part)
{
  const SbRun run = ((SbPotential)ctx)->run;
  const SbSpace space = run->model->space;
  const Vec stage = run->solve.stage.U;
  const PetscReal at = run->solve.stage.part;
  PetscReal there;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceLongestStep(space, X, Y, 1., part));
  if (!stage || !space->positive)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(find_stage(run, X));
  PetscCall(SbSpaceLongestStep(space, stage, Y, at, &there));
  *part = PetscMin(*part, there);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode max_step(void *ctx, Vec X, Vec Y, PetscReal *part, PetscInt *nactive)
{
  PetscInt n;
  PetscReal admissible;

  PetscFunctionBeginUser;
  PetscCall(SbContactSetMaxStep(&((SbPotential)ctx)->run->model->contacts, X, Y, part, &n));
  PetscCall(longest(ctx, X, Y, &admissible));
  *part = PetscMin(*part, admissible);
  if (nactive)
    *nactive = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode body_steps(void *ctx, Vec X, Vec Y, Vec Z, PetscReal *part,
                                 PetscBool *farther)
{
  const SbRun run = ((SbPotential)ctx)->run;
  PetscReal admissible;

  PetscFunctionBeginUser;
  PetscCall(SbContactSetBodySteps(&run->model->contacts, X, Y, Z, run->solve.alone, part, farther));
  PetscCall(longest(ctx, X, Y, &admissible));
  *part = PetscMin(*part, admissible);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode advance(void *ctx, PetscReal fraction)
{
  PetscFunctionBeginUser;
  SbContactSetAdvance(&((SbPotential)ctx)->run->model->contacts, fraction);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode prescribed_part(void *ctx, Vec D)
{
  PetscFunctionBeginUser;
  PetscCall(SbSpaceZeroPrescribed(((SbPotential)ctx)->run->model->space, PETSC_FALSE, D));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode inverted(void *ctx, Vec X, PetscReal *psi, PetscInt *n)
{
  PetscFunctionBeginUser;
  PetscCall(SbModelStrainEnergy(((SbPotential)ctx)->run->model, X, NULL, psi, n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode hessian(void *ctx, Vec X, Vec F, SbContactHessian kind, Vec rhs,
                              PetscInt *nblock)
{
  SbPotential q = (SbPotential)ctx;
  const SbModel m = q->run->model;
  const PetscReal weight = q->run->solve.barrier_weight;

  PetscFunctionBeginUser;
  q->blocks.n = 0;
  PetscCall(SbContactSetHessian(&m->contacts, X, kind, &q->blocks, rhs));
  PetscCall(VecAYPX(rhs, weight, F));
  for (PetscInt k = 0; k < q->blocks.n; k++)
    for (int i = 0; i < 9; i++)
      q->blocks.block[k].H[i] *= weight;
  PetscCallMPI(MPI_Allreduce(&q->blocks.n, &q->nblock, 1, MPIU_INT, MPI_SUM, m->comm));
  *nblock = q->nblock;
  q->rows.n = q->rows.nentry = 0;
  if (q->nblock && m->contacts.nexact)
    PetscCall(SbContactSetConstraints(&m->contacts, X, &q->rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(void *ctx, Mat P, Vec rhs, Vec Y, KSPConvergedReason *reason,
                            PetscInt *iterations)
{
  SbPotential q = (SbPotential)ctx;
  const SbRun run = q->run;

  PetscFunctionBeginUser;
  if (!q->system)
    PetscCall(SbContactSystemCreate(run->model->space, run->solve.contact_choice, &q->system));
  if (run->model->contacts.nexact)
    PetscCall(SbContactSystemSolveConstrained(q->system, P, &q->blocks, run->model->contacts.saddle,
                                              &q->rows, run->solve.barrier_weight, rhs, Y, reason,
                                              iterations));
  else
    PetscCall(
      SbContactSystemSolve(q->system, P, &q->blocks, PETSC_TRUE, rhs, Y, reason, iterations));
  if (*reason < 0)
    PetscCall(SbSolverListContactFailed(run, *reason, *iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode step_tolerance(void *ctx, PetscReal *longest)
{
  const SbPotential q = (SbPotential)ctx;
  const SbModel m = q->run->model;
  const PetscReal size = SbBodySmallest(m->nbody, m->body);
  const PetscReal dt = q->problem.dt;
  PetscReal width = PETSC_MAX_REAL;
  PetscBool springs = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt e = 0; e < m->contacts.npotential; e++) {
    springs = (PetscBool)(springs || m->contacts.potential[e]->springs);
    width = PetscMin(width, m->contacts.potential[e]->width);
  }
  *longest = m->dynamic ? SETTLED * m->contacts.speed * dt : SETTLED_STATIC * size;
  if (springs)
    *longest *= STICKING;
  if (m->dynamic)
    *longest = PetscMax(*longest, SETTLED_LEAST * size * dt / q->run->clock.dt);
  *longest = PetscMin(*longest, SETTLED_GAP * width);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode update_friction(void *ctx, Vec X, PetscBool solved, PetscBool *again)
{
  PetscFunctionBeginUser;
  PetscCall(
    SbContactSetUpdateFriction(&((SbPotential)ctx)->run->model->contacts, X, solved, again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPotentialCreate(SbRun run)
{
  const SbModel m = run->model;
  const SNES snes = run->solve.snes;
  const PetscBool nodes = (PetscBool)(m->contacts.n > m->contacts.npotential);
  SNESType type;
  PetscBool newton;
  SbPotential q;

  PetscFunctionBeginUser;
  PetscCall(SNESGetType(snes, &type));
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SB_SNES_NEWTON, &newton));
  PetscCheck(
    newton || !m->contacts.npotential, m->comm, PETSC_ERR_USER_INPUT,
    "-snes_type %s does not keep surfaces apart: with contact of response barrier leave it out",
    type);
  PetscCall(PetscNew(&q));
  run->solve.potential = q;
  q->run = run;
  q->barrier = (SbNewtonBarrier){.max_step = max_step,
                                 .body_steps = body_steps,
                                 .advance = advance,
                                 .inverted = inverted,
                                 .hessian = hessian,
                                 .solve = solve,
                                 .step_tolerance = step_tolerance,
                                 .update_friction = update_friction,
                                 .mass = run->state.mass,
                                 .total_mass = m->mass};
  q->problem = (SbNewtonProblem){.energy = energy,
                                 .filter = m->may_filter ? filter : NULL,
                                 .negative_eigenvalues = negative_eigenvalues,
                                 .linearise = m->dynamic || nodes ? NULL : linearise,
                                 .freeze = m->space->softening ? freeze : NULL,
                                 .longest = m->space->positive ? longest : NULL,
                                 .prescribed_part = prescribed_part,
                                 .interrupted = interrupted,
                                 .barrier = m->contacts.npotential ? &q->barrier : NULL,
                                 .ctx = q,
                                 .nonsymmetric = (PetscBool)(run->solve.nonsymmetric.U != NULL)};

  /* -contact_quality fast */
  if (run->solve.fast) {
    q->problem.iterations = 1;
    PetscCall(PetscOptionsGetInt(NULL, NULL, "-snes_max_it", &q->problem.iterations, NULL));
    PetscCall(VecDuplicate(run->state.U, &run->solve.left));
    PetscCall(VecZeroEntries(run->solve.left));
    PetscCall(PetscCalloc1(m->nbody, &run->solve.alone));
    q->problem.left = run->solve.left;
  }

  q->problem.quadratic = (PetscBool)!m->dynamic;
  for (PetscInt k = 0; k < m->nmaterial; k++)
    if (!m->material[k]->adaptive && m->material[k]->tangent != SB_TANGENT_EXACT)
      q->problem.quadratic = PETSC_FALSE;

  /* rounding of the strain energy of a rotated body: eps E V */
  for (PetscInt b = 0; b < m->nbody; b++)
    q->problem.rounding +=
      4. * PETSC_MACHINE_EPSILON * SbMaterialYoungModulus(m->material[b]) * m->body[b].volume;
  PetscCall(SbNewtonSetProblem(snes, &q->problem));
  PetscCall(SbModelProjectTangent(m, (PetscBool)!newton));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPotentialBegin(SbPotential q, const SbSolvedStep *step, PetscBool warm)
{
  const SbModel m = q->run->model;

  PetscFunctionBeginUser;
  q->problem.dt = m->dynamic ? step->dt : 0.;
  q->problem.warm_start = warm;
  q->problem.may_give_up =
    (PetscBool)(q->run->clock.may_give_up && q->problem.quadratic && !q->problem.nonsymmetric);
  q->problem.start = m->contacts.npotential ? NULL : step->U0;
  if (!m->contacts.npotential)
    PetscFunctionReturn(PETSC_SUCCESS);
  q->barrier.start = step->U0;
  q->nblock = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPotentialDestroy(SbPotential *potential)
{
  SbPotential q = *potential;

  PetscFunctionBeginUser;
  if (!q)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbContactSystemDestroy(&q->system));
  PetscCall(PetscFree(q->blocks.block));
  PetscCall(SbConstraintRowsFree(&q->rows));
  PetscCall(PetscFree(*potential));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SbContactSystem SbPotentialContactSystem(SbPotential q)
{
  return q && q->nblock ? q->system : NULL;
}

PetscErrorCode SbRunSolveTangent(SbRun run, Vec B, Vec X, PetscInt *iterations, PetscBool *solved)
{
  const SbPotential q = run->solve.potential;
  PetscInt fresh = 0;
  KSPConvergedReason reason;
  Vec U, F, rhs;

  PetscFunctionBeginUser;

  /* Newton's method had nothing to do in this step: its barriers are those at its start */
  if (!q->nblock && q->problem.barrier) {
    PetscCall(SNESGetSolution(run->solve.snes, &U));
    PetscCall(VecDuplicate(U, &F));
    PetscCall(VecDuplicate(U, &rhs));
    PetscCall(VecZeroEntries(F));
    PetscCall(hessian(q, U, F, SB_HESSIAN_PROJECTED, rhs, &fresh));
    if (fresh)
      PetscCall(SNESComputeJacobian(run->solve.snes, U, run->solve.system, run->solve.J));
    PetscCall(VecDestroy(&F));
    PetscCall(VecDestroy(&rhs));
  }
  *solved = (PetscBool)(q->nblock > 0);
  if (!*solved)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!q->system)
    PetscCall(SbContactSystemCreate(run->model->space, run->solve.contact_choice, &q->system));
  PetscCall(SbContactSystemSolve(q->system, run->solve.J, &q->blocks, (PetscBool)(fresh > 0), B, X,
                                 &reason, iterations));
  if (reason < 0)
    PetscCall(VecZeroEntries(X));
  PetscFunctionReturn(PETSC_SUCCESS);
}
