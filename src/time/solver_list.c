/*
  Fallback solvers: after a failed linear solve the next solver of a list (SbSolverNextFallback())
  solves the same system, in the same Newton iteration, and stays for the run. If the last one
  fails, the step is halved.

  A post-solve callback of the KSP does this. The KSP is kept, with another type, another
  preconditioner and, if the next solver needs another matrix type, another operator, assembled at
  Newton's iterate.

  Contact with friction has constraints outside the matrix, and the solver preconditions the matrix
  without them. That is far from the system for a body which is stiff compared to its inertia, whose
  rigid motions contact stops: iterations grow with stiffness times step squared over mass, and end
  by rounding. Such a solve ends after a number of iterations that cost about as much as a
  factorisation, and from there on the system is factored with its constraints
  (src/factor/saddle_factor.c) while there is contact.

  Not replaced: solvers chosen by -ksp_type or -pc_type; factorisations of the saddle-point system
  of contact; solves along an arc length; static systems with a free rigid motion (rigid_modes.c),
  which are singular; exact tangents that Newton's method will project (src/newton).

  petsc/private/kspimpl.h: reason and iterations of a solve, and the previous callback, are not
  public.
*/
#include "sbpc.h"
#include "sbsolver.h"
#include "time_impl.h"
#include <petsc/private/kspimpl.h>

#define RATIO 1e4    /* ratio of Young's moduli above which it is named as a cause */
#define NU_HARD 0.45 /* Poisson's ratio above which it is named as a cause */

/* Iterations with constraints outside the matrix after which it is factored with them: as many cost
   about one factorisation of CONSTRAINED_SIZE unknowns, more with the power 2/3 of the size; and
   the largest system that is. 8,649 unknowns of a plate, s: 100 iterations of `rotated` 0.09,
   factorisation by MUMPS 0.11. */
#define CONSTRAINED_MOST 100
#define CONSTRAINED_SIZE 10000
#define CONSTRAINED_LARGEST 200000

typedef struct _p_SbSolverList *SbSolverList;
struct _p_SbSolverList {
  SbRun run;
  PetscBool own;  /* the solver is one of the presets, and may be replaced */
  uint32_t tried; /* bits of the presets that failed */
  PetscErrorCode (*before)(KSP, Vec, Vec,
                           void *); /* the previous post-solve callback; NULL: none */
  void *before_ctx;
  PetscBool again; /* a fallback is solving */
  PetscInt most;   /* limit of iterations with constraints outside the matrix; 0: none */
  PetscInt users;  /* the limit without */
  char failures[384];
};

static PetscErrorCode after_solve(KSP ksp, Vec b, Vec x, void *ctx);

static PetscErrorCode attach(SbSolverList l, KSP ksp)
{
  PetscFunctionBeginUser;
  if (ksp->postsolve == after_solve)
    PetscFunctionReturn(PETSC_SUCCESS);
  l->before = ksp->postsolve;
  l->before_ctx = ksp->postctx;
  PetscCall(KSPSetPostSolve(ksp, after_solve, l));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends "DIVERGED_ITS of cg after 5000 iterations, ..." to l->failures. memory: there was not
   enough. */
static PetscErrorCode describe_failure(SbSolverList l, KSP ksp, Vec b, Vec x, char text[],
                                       size_t size, PetscBool *memory)
{
  const char *reason = KSPConvergedReasons[ksp->reason];
  PetscReal load, residual;
  PCFailedReason failed;
  Mat A;
  Vec r;

  PetscFunctionBeginUser;
  PetscCall(PCGetFailedReason(ksp->pc, &failed));
  *memory = (PetscBool)(failed == PC_FACTOR_OUTMEMORY);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, memory, 1, SB_MPI_BOOL, MPI_LOR, l->run->model->comm));
  if (ksp->reason == KSP_DIVERGED_PC_FAILED)
    PetscCall(
      PetscSNPrintf(text, size, "%s of %s: %s", reason, l->run->solve.solver,
                    *memory ? "not enough memory" : "its set-up met a pivot that is not positive"));
  else {
    PetscCall(KSPGetOperators(ksp, &A, NULL));
    PetscCall(VecDuplicate(b, &r));
    PetscCall(MatMult(A, x, r));
    PetscCall(VecAYPX(r, -1., b));
    PetscCall(VecNorm(b, NORM_2, &load));
    PetscCall(VecNorm(r, NORM_2, &residual));
    PetscCall(VecDestroy(&r));
    PetscCall(PetscSNPrintf(
      text, size, "%s of %s after %" PetscInt_FMT " iterations, %.2g of the residual left", reason,
      l->run->solve.solver, ksp->its, (double)(residual / load)));
  }
  if (!l->again)
    l->failures[0] = 0;
  SbAppend(sizeof(l->failures), l->failures, "%s%s", l->failures[0] ? ", then " : "", text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes the run's KSP to the solver `next`, with the tangent at Newton's iterate. */
static PetscErrorCode replace(SbSolverList l, KSP ksp, const SbSolverPreset *next)
{
  const SbRun run = l->run;
  const SbSpace s = run->model->space;
  const SbSolverPreset *old = run->solve.solver_used;
  const char *prefix;
  PetscReal rtol, atol;
  void *test;
  Vec X;
  PC pc;

  PetscFunctionBeginUser;

  /* remove the options of the old solver and its settings of the KSP, except tolerances */
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, NULL, NULL));
  PetscCall(SbOptionsSetDefaults("", old->options, PETSC_TRUE));
  PetscCall(KSPReset(ksp));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  PetscCall(PCCreate(PetscObjectComm((PetscObject)ksp), &pc));
  PetscCall(PCSetOptionsPrefix(pc, prefix));
  PetscCall(KSPSetPC(ksp, pc));
  PetscCall(PCDestroy(&pc));
  PetscCall(KSPConvergedDefaultCreate(&test));
  PetscCall(KSPSetConvergenceTest(ksp, KSPConvergedDefault, test, KSPConvergedDefaultDestroy));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_FALSE));

  /* another operator if `next` needs another matrix type */
  if (old->create || next->create || old->matrix != next->matrix) {
    PetscCall(MatDestroy(&run->solve.J));
    PetscCall(SbSolverCreateOperator(s, next, &run->solve.J));

    /* the nonsymmetric operator multiplies by run->solve.J anyway */
    if (!run->solve.nonsymmetric.U) {
      Mat *whole = SbConstraintsSeparate(s) ? &run->solve.unprojected : &run->solve.system;

      PetscCall(MatDestroy(whole));
      PetscCall(PetscObjectReference((PetscObject)run->solve.J));
      *whole = run->solve.J;
    }
    if (SbConstraintsSeparate(s)) {
      s->constraints->K = run->solve.J;
      s->constraints->whole = run->solve.unprojected;
    }
    PetscCall(SNESSetJacobian(run->solve.snes, run->solve.system, run->solve.J, NULL, NULL));
  }

  /* the options of the new solver, set up as at the start of a run */
  run->solve.solver_used = next;
  PetscCall(PetscStrncpy(run->solve.solver, next->name, sizeof(run->solve.solver)));
  PetscCall(SbSolverSetUp(run->solve.snes, s, next));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(SbSolverFinish(run->solve.snes, s, next, run->solve.J));
  PetscCall(KSPSetTolerances(ksp, rtol, atol, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(attach(l, ksp));

  /* the tangent at Newton's iterate, in the new matrix */
  run->solve.tangent_known = PETSC_FALSE;
  PetscCall(SNESGetSolution(run->solve.snes, &X));
  PetscCall(SNESComputeJacobian(run->solve.snes, X, run->solve.system, run->solve.J));
  PetscCall(KSPSetOperators(ksp, run->solve.system, run->solve.J));
  PetscCall(SbSolverUpdateSymmetry(ksp, s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether to factor the system with its constraints from now on: the solve failed, or took `most`
   iterations. Not where the tangent itself is the reason, which Newton's method changes, or the
   preconditioner, which has a simpler form. */
static PetscErrorCode factor_constraints(SbSolverList l, KSP ksp, PetscBool *is)
{
  const SbRun run = l->run;
  const SbSpace s = run->model->space;
  const KSPConvergedReason reason = ksp->reason;
  const PetscBool other =
    (PetscBool)(reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC ||
                reason == KSP_DIVERGED_PC_FAILED);
  const char *package;

  PetscFunctionBeginUser;

  /* a factorisation for definite matrices failed by rounding: one for others */
  *is = (PetscBool)(SbConstraintsFactored(s) && s->constraints->definite && !s->tentative &&
                    reason == KSP_DIVERGED_PC_FAILED);
  if (*is) {
    s->constraints->definite = PETSC_FALSE;
    s->constraints->factored_version = -1;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!l->own || !SbConstraintsSeparate(s) || !s->constraints->ntotal || SbConstraintsFactored(s) ||
      run->solve.saddle_choice == 2 || run->solve.solver_used->create || /* it has no matrix */
      other || (reason > 0 && (!l->most || ksp->its < l->most)))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, PETSC_FALSE, &package));
  if (!package)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, s->constraints->definite, &package));
  s->constraints->saddle = run->solve.saddle_used = SB_SADDLE_DIRECT;
  *is = PETSC_TRUE;
  PetscCall(SbWarning(s->comm,
                      "linear solver: %s of %s after %" PetscInt_FMT
                      " iterations with the constraints of contact, which are outside its matrix; "
                      "from here on both are factored together, by %s",
                      KSPConvergedReasons[reason], run->solve.solver, ksp->its, package));
  PetscCall(PetscSNPrintf(run->solve.solver_reason, sizeof(run->solve.solver_reason),
                          "constraints of contact factored with the matrix by %s, after %s of %s "
                          "after %" PetscInt_FMT " iterations",
                          package, KSPConvergedReasons[reason], run->solve.solver, ksp->its));
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, l->users));
  l->most = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves the same system again; the iterations of both solves are counted. */
static PetscErrorCode solve_again(SbSolverList l, KSP ksp, Vec b, Vec x)
{
  const PetscInt its = ksp->its;
  const PetscBool outer = l->again;
  PetscBool forcing;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(x));

  /* keep the relative tolerance of this Newton step (Eisenstat and Walker) */
  PetscCall(SNESKSPGetUseEW(l->run->solve.snes, &forcing));
  PetscCall(SNESKSPSetUseEW(l->run->solve.snes, PETSC_FALSE));
  l->again = PETSC_TRUE;
  PetscCall(KSPSolve(ksp, b, x));
  l->again = outer;
  PetscCall(SNESKSPSetUseEW(l->run->solve.snes, forcing));
  ksp->its += its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode after_solve(KSP ksp, Vec b, Vec x, void *ctx)
{
  SbSolverList l = (SbSolverList)ctx;
  SbRun run = l->run;
  const SbSolverPreset *next = run->solve.solver_used;
  PetscBool memory, factored;
  PetscBool simpler = PETSC_FALSE;
  PetscBool minres, newton;
  KSPConvergedReason reason;
  char text[192], motion[256];
  PetscInt body = -1;
  PetscReal size;
  PC pc;
  Vec X;

  PetscFunctionBeginUser;

  /* the previous callback may set the solve to failed */
  if (l->before)
    PetscCall((*l->before)(ksp, b, x, l->before_ctx));
  PetscCall(factor_constraints(l, ksp, &factored));
  if (ksp->reason > 0) {
    if (!l->again)
      l->failures[0] = 0;
    if (ksp->reason == KSP_CONVERGED_ATOL && !ksp->its && !run->solve.warned_idle) {
      PetscCall(VecNorm(b, NORM_2, &size));
      PetscCall(SbRunWarnIdle(run, "-ksp_atol", size, "the first right-hand side"));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (factored) {
    PetscCall(solve_again(l, ksp, b, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* Newton's method will project the tangent and solve again */
  if (run->model->space->tentative)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(describe_failure(l, ksp, b, x, text, sizeof(text), &memory));

  /* first a simpler form of the same preconditioner: its incomplete factorisation may have broken
     down */
  PetscCall(SbPCConstrainedGetInner(ksp->pc, &pc));

  /* MINRES reports an indefinite preconditioner as an indefinite matrix, or reaches its iteration
     limit */
  reason = ksp->reason;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPMINRES, &minres));
  if (minres && (reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_ITS))
    reason = KSP_DIVERGED_INDEFINITE_PC;
  PetscCall(SbPCTwoLevelSimplify(pc, reason, &simpler));
  if (simpler) {
    PetscCall(solve_again(l, ksp, b, x));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* then the next solver of the list, with a warning: of a preset, in Newton's method, if b is
     finite */
  PetscCall(PetscObjectTypeCompareAny((PetscObject)run->solve.snes, &newton, SB_SNES_NEWTON,
                                      SNESNEWTONLS, SNESKSPONLY, ""));
  PetscCall(SNESGetSolution(run->solve.snes, &X));
  PetscCall(VecNorm(b, NORM_2, &size));
  if (!l->own || !newton || !X || SbConstraintsFactored(run->model->space) ||
      PetscIsInfOrNanReal(size))
    PetscFunctionReturn(PETSC_SUCCESS);

  /* a static system with a free motion is singular for every solver */
  if (!run->model->dynamic)
    PetscCall(SbRunFreeBody(run, &body, sizeof(motion), motion, NULL));
  if (body >= 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbSolverNextFallback(run->model->space, ksp->reason, memory, &l->tried, &next));
  if (!next)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(
    SbWarning(run->model->comm, "linear solver: %s; from here on -solver %s", text, next->name));
  PetscCall(
    PetscSNPrintf(run->solve.solver_reason, sizeof(run->solve.solver_reason), "after %s", text));
  PetscCall(replace(l, ksp, next));
  PetscCall(solve_again(l, ksp, b, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverListCreate(SbRun run)
{
  PetscBool type, pc, limited;
  SbSolverList l;
  KSP ksp;
  const SbSpace s = run->model->space;
  const PetscInt unknowns = 3 * s->Nnode;

  PetscFunctionBeginUser;
  if (!run->solve.J)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&l));
  l->run = run;
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_type", &type));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-pc_type", &pc));
  l->own =
    (PetscBool)(!type && !pc &&
                !run->clock.arc.on); /* arc length needs the inertia from its factorisation */
  PetscCall(SNESGetKSP(run->solve.snes, &ksp));
  PetscCall(attach(l, ksp));
  run->solve.fallbacks = l;

  /* a limit with constraints, where auto chose the solver */
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ksp_max_it", &limited));
  PetscCall(KSPGetTolerances(ksp, NULL, NULL, NULL, &l->users));
  if (l->own && !limited && SbConstraintsSeparate(s) && run->solve.saddle_used == SB_SADDLE_NONE &&
      run->solve.saddle_choice == 0 && !strcmp(run->solve.solver_choice, "auto") &&
      unknowns <= CONSTRAINED_LARGEST)
    l->most =
      (PetscInt)(CONSTRAINED_MOST *
                 PetscMax(1., PetscPowReal((PetscReal)unknowns / CONSTRAINED_SIZE, 2. / 3.)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverListBeginSolve(SbRun run)
{
  const SbSolverList l = run->solve.fallbacks;
  KSP ksp;

  PetscFunctionBeginUser;
  if (!l || !l->most)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(run->solve.snes, &ksp));
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT,
                             SbSpaceIsConstrained(run->model->space) ? l->most : l->users));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverListContactFailed(SbRun run, KSPConvergedReason reason, PetscInt iterations)
{
  SbSolverList l = run->solve.fallbacks;
  PetscBool apart;
  char system[128];

  PetscFunctionBeginUser;
  if (!l)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsHasName(NULL, NULL, "-contact_pc_type", &apart));
  PetscCall(SbContactSystemDescribe(run->solve.contact_choice, system, sizeof(system)));
  PetscCall(PetscSNPrintf(
    l->failures, sizeof(l->failures), "%s of %s after %" PetscInt_FMT " iterations%s",
    KSPConvergedReasons[reason], system, iterations,
    apart ? "; it is the one of -contact_pc_type, which is not replaced: leave it out" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverListExplain(SbRun run, size_t size, char text[])
{
  const SbSolverList l = run->solve.fallbacks;
  const SbSolverPreset *next = run->solve.solver_used;
  uint32_t tried = 0;
  char causes[256] = "";
  const SbModel m = run->model;
  PetscReal nu = 0.;
  PetscReal soft = PETSC_MAX_REAL;
  PetscReal stiff = 0.;
  PetscInt nsliver = 0;
  PetscInt ntet = 0;

  PetscFunctionBeginUser;

  /* properties of the bodies that may cause ill-conditioning: "; nu is up to 0.4999" */
  for (PetscInt k = 0; k < m->nmaterial; k++) {
    nu = PetscMax(nu, SbMaterialPoisson(m->material[k]));
    soft = PetscMin(soft, SbMaterialYoungModulus(m->material[k]));
    stiff = PetscMax(stiff, SbMaterialYoungModulus(m->material[k]));
  }
  for (PetscInt b = 0; b < m->nbody; b++) {
    nsliver += m->body[b].nsliver;
    ntet += m->body[b].ncell;
  }
  if (nsliver)
    SbAppend(sizeof(causes), causes,
             "; %" PetscInt_FMT " of %" PetscInt_FMT
             " tets have an angle below %g degrees: repair the mesh",
             nsliver, ntet, SB_SLIVER);
  if (stiff > RATIO * soft)
    SbAppend(sizeof(causes), causes,
             "; the stiffest material has %.2g times Young's modulus of the softest",
             (double)(stiff / soft));
  if (nu > NU_HARD)
    SbAppend(sizeof(causes), causes, "; nu is up to %g", (double)nu);
  if (l->own)
    PetscCall(PetscSNPrintf(text, size, "linear solver: %s%s", l->failures, causes));
  else {
    PetscCall(
      SbSolverNextFallback(run->model->space, KSP_DIVERGED_ITS, PETSC_FALSE, &tried, &next));
    PetscCall(
      PetscSNPrintf(text, size,
                    "linear solver: %s%s; it is the one of -ksp_type and -pc_type, which are not "
                    "replaced: leave them out%s%s",
                    l->failures, causes, next ? ", or take -solver " : "", next ? next->name : ""));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
