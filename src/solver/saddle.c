/*
  The saddle-point system of exact constraints by iterations, for response `multiplier`:

    [ K + S^T k S   G^T ] [ z ]   [ r ]         M_S = [ M             ]
    [ G             0   ] [ m ] = [ 0 ],              [   a G D G^T   ]

  MINRES (Paige and Saunders 1975) with the block-diagonal preconditioner of Murphy, Golub and Wathen (A note on preconditioning for
  indefinite linear systems, 2000), their Schur complement G K^-1 G^T replaced by that of D, about the inverse of K's diagonal, which
  the projection has factored already (constraint.c); M is the preconditioner of K that the run has chosen. The factor a is small: the
  eigenvalues that belong to the constraints then lie in two groups far from the others, at +- 1 / sqrt(a), and the others are those of the
  null space. A joint of two bars, cg_pbjacobi: 598 iterations with a = 1, 231 with 0.1, 91 with 1e-3, 122 with 1e-6, where rounding shows;
  in the null space itself 46. FGMRES where something is not symmetric (friction; an M for Richardson's method), and from the moment on when it
  shows that M is not definite.

  MINRES judges by a norm of displacements and forces mixed. So the answer is projected onto the null space and its residual there, that
  of P^T (K + S^T k S) P, is what decides: it becomes the right-hand side of another round until it is small enough. How far the two
  differ is learnt from round to round. Two rounds in turn that hardly lower it end the solve as failed.

  Where nothing touches, the run's own method takes over.

  petsc/private/kspimpl.h: a KSPType reads right-hand side, tolerances and solution there; PETSc's KSPSHELL does not exist.
*/
#include "solver_impl.h"
#include "sbconstraint.h"
#include "sbsolver.h"
#include <petsc/private/kspimpl.h>

#define SB_KSP_SADDLE "sb_saddle"
#define SMALL 1e-3  /* a */
#define RESTART 100 /* of FGMRES */
#define DIGITS \
  1e-5 /* what a round of MINRES may aim at, relative: M may be symmetric to single precision only */
#define DIGITS_GMRES 1e-10
#define LOSS 10. /* guess of how much less the residual falls than the norm that a round is judged by */

typedef struct {
  SbSpace space; /* borrowed */
  KSP plain;     /* the run's own method */
  PetscBool minres;
  PetscReal loss;   /* how much less the residual fell in the last round than its norm */
  PetscInt version; /* of the constraints that the following are for */
  KSP inner;        /* NULL: none yet */
  Mat S;
  Vec b, x; /* displacements and multipliers of this rank */
  PetscReal
    scale; /* on the constraints, N/m: their residuals are forces then, and their multipliers displacements */
  Vec from, to; /* displacements */
} Saddle;

/* ------------------------------------------------------------------ vectors of both kinds */

static PetscErrorCode unpack(const Saddle *d, Vec both, Vec u, Vec m)
{
  const PetscInt n = 3 * d->space->nnode_owned;
  const PetscScalar *from;
  PetscScalar *to;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(both, &from));
  PetscCall(VecGetArrayWrite(u, &to));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArrayWrite(u, &to));
  if (m) {
    PetscCall(VecGetArrayWrite(m, &to));
    PetscCall(PetscArraycpy(to, from + n, d->space->constraints->exact.n));
    PetscCall(VecRestoreArrayWrite(m, &to));
  }
  PetscCall(VecRestoreArrayRead(both, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* m NULL: zero. */
static PetscErrorCode pack(const Saddle *d, Vec u, Vec m, Vec both)
{
  const PetscInt n = 3 * d->space->nnode_owned, nrow = d->space->constraints->exact.n;
  const PetscScalar *from;
  PetscScalar *to;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayWrite(both, &to));
  PetscCall(VecGetArrayRead(u, &from));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArrayRead(u, &from));
  if (m) {
    PetscCall(VecGetArrayRead(m, &from));
    PetscCall(PetscArraycpy(to + n, from, nrow));
    PetscCall(VecRestoreArrayRead(m, &from));
  } else
    PetscCall(PetscArrayzero(to + n, nrow));
  PetscCall(VecRestoreArrayWrite(both, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the system and its preconditioner */

static PetscErrorCode multiply(Mat S, Vec x, Vec y)
{
  Saddle *d;
  SbConstraints c;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(S, &d));
  c = d->space->constraints;
  PetscCall(unpack(d, x, d->from, c->exact.step));
  PetscCall(SbConstraintsMultiply(c, d->from, d->to));
  PetscCall(VecScale(c->exact.step, d->scale));
  PetscCall(MatMultTransposeAdd(c->exact.push_free, c->exact.step, d->to, d->to));
  PetscCall(MatMult(c->exact.free, d->from, c->exact.work));
  PetscCall(VecScale(c->exact.work, d->scale));
  PetscCall(pack(d, d->to, c->exact.work, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode precondition(PC pc, Vec r, Vec z)
{
  PCFailedReason failed;
  PC outer, M;
  Saddle *d;
  SbConstraints c;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &d));
  c = d->space->constraints;
  PetscCall(KSPGetPC(d->plain, &outer));
  PetscCall(SbPCConstrainedGetInner(outer, &M));
  PetscCall(unpack(d, r, d->from, c->exact.work));
  PetscCall(PCApply(M, d->from, d->to));
  PetscCall(SbConstraintsSolveGram(c));
  PetscCall(VecScale(c->exact.step, 1. / (SMALL * PetscSqr(d->scale))));
  PetscCall(pack(d, d->to, c->exact.step, z));
  PetscCall(PCGetFailedReason(M, &failed));
  if (failed) PetscCall(PCSetFailedReason(pc, failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode forget(Saddle *d)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&d->inner));
  PetscCall(MatDestroy(&d->S));
  PetscCall(VecDestroy(&d->b));
  PetscCall(VecDestroy(&d->x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mean of 1 / (G D G^T)_ii. */
static PetscErrorCode find_scale(SbConstraints c, PetscReal *scale)
{
  Vec d;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(c->gram, &d, NULL));
  PetscCall(MatGetDiagonal(c->gram, d));
  PetscCall(VecReciprocal(d));
  PetscCall(VecSum(d, scale));
  *scale /= (PetscReal)c->exact.N;
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The inner solver for the constraints as they are. */
static PetscErrorCode update(Saddle *d)
{
  const SbSpace s = d->space;
  const PetscInt n = 3 * s->nnode_owned + s->constraints->exact.n, N = 3 * s->Nnode + s->constraints->exact.N;
  PC pc;

  PetscFunctionBeginUser;
  if (d->inner && d->version == s->constraints->version) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(forget(d));
  d->version = s->constraints->version;
  PetscCall(find_scale(s->constraints, &d->scale));
  if (!d->from) {
    PetscCall(SbSpaceCreateVec(s, &d->from));
    PetscCall(VecDuplicate(d->from, &d->to));
  }
  PetscCall(MatCreateShell(s->comm, n, n, N, N, d, &d->S));
  PetscCall(MatShellSetOperation(d->S, MATOP_MULT, SB_OPERATION(multiply)));
  PetscCall(MatSetOption(d->S, MAT_SYMMETRIC, (PetscBool)!s->constraints->nonsymmetric));
  PetscCall(MatCreateVecs(d->S, &d->x, &d->b));
  PetscCall(KSPCreate(s->comm, &d->inner));
  PetscCall(KSPSetOptionsPrefix(d->inner, "saddle_"));
  PetscCall(KSPSetOperators(d->inner, d->S, d->S));
  PetscCall(KSPSetType(d->inner, d->minres ? KSPMINRES : KSPFGMRES));
  PetscCall(KSPGMRESSetRestart(d->inner, RESTART));
  PetscCall(KSPGetPC(d->inner, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, d));
  PetscCall(PCShellSetName(pc, "preconditioner of K, G D G^T"));
  PetscCall(PCShellSetApply(pc, precondition));
  PetscCall(KSPSetFromOptions(d->inner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ a solve */

/* What a solver made of the solve of another one. */
static PetscErrorCode take_over(KSP from, KSP to)
{
  PetscFunctionBeginUser;
  PetscCall(KSPGetIterationNumber(from, &to->its));
  PetscCall(KSPGetConvergedReason(from, &to->reason));
  PetscCall(KSPGetResidualNorm(from, &to->rnorm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve_plain(KSP ksp, Saddle *d)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSetTolerances(d->plain, ksp->rtol, ksp->abstol, ksp->divtol, ksp->max_it));
  PetscCall(KSPSetInitialGuessNonzero(d->plain, (PetscBool)!ksp->guess_zero));
  PetscCall(KSPSolve(d->plain, ksp->vec_rhs, ksp->vec_sol));
  PetscCall(take_over(d->plain, ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x += what the system says for the residual r; r <- b - A x. */
static PetscErrorCode solve_round(KSP ksp, Saddle *d, PetscReal rtol, Vec r)
{
  KSPConvergedReason reason;
  PetscInt its;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &A, NULL));
  PetscCall(pack(d, r, NULL, d->b));
  PetscCall(KSPSetTolerances(d->inner, rtol, 0., 1e10, ksp->max_it - ksp->its));
  PetscCall(KSPSolve(d->inner, d->b, d->x));
  PetscCall(KSPGetIterationNumber(d->inner, &its));
  PetscCall(KSPGetConvergedReason(d->inner, &reason));
  ksp->its += its;
  if (reason == KSP_DIVERGED_INDEFINITE_PC && d->minres) {
    PetscCall(PetscInfo(ksp, "the preconditioner is not definite: FGMRES from now on\n"));
    d->minres = PETSC_FALSE;
    PetscCall(forget(d));
    PetscCall(update(d));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (reason < 0 && reason != KSP_DIVERGED_ITS) ksp->reason = reason;
  PetscCall(unpack(d, d->x, d->to, NULL));
  PetscCall(SbConstraintsProject(d->space->constraints, d->to));
  PetscCall(VecAXPY(ksp->vec_sol, 1., d->to));
  PetscCall(MatMult(A, ksp->vec_sol, r));
  PetscCall(VecAYPX(r, -1., ksp->vec_rhs));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual to begin with into r; the largest that is small enough. */
static PetscErrorCode begin(KSP ksp, Vec r, PetscReal *tolerance)
{
  PetscReal size;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(KSPGetOperators(ksp, &A, NULL));
  if (ksp->guess_zero) {
    PetscCall(VecZeroEntries(ksp->vec_sol));
    PetscCall(VecCopy(ksp->vec_rhs, r));
  } else {
    PetscCall(MatMult(A, ksp->vec_sol, r));
    PetscCall(VecAYPX(r, -1., ksp->vec_rhs));
  }
  PetscCall(VecNorm(ksp->vec_rhs, NORM_2, &size));
  PetscCall(VecNorm(r, NORM_2, &ksp->rnorm));
  *tolerance = PetscMax(ksp->rtol * size, ksp->abstol);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Why the solve ends now; 0: it does not. */
static KSPConvergedReason state_of(KSP ksp, PetscReal tolerance, PetscInt idle)
{
  if (ksp->reason) return ksp->reason;
  if (PetscIsInfOrNanReal(ksp->rnorm)) return KSP_DIVERGED_NANORINF;
  if (ksp->rnorm <= tolerance) return ksp->rnorm <= ksp->abstol ? KSP_CONVERGED_ATOL : KSP_CONVERGED_RTOL;
  if (ksp->its >= ksp->max_it) return KSP_DIVERGED_ITS;
  return idle == 2 ? KSP_DIVERGED_BREAKDOWN : KSP_CONVERGED_ITERATING;
}

static PetscErrorCode solve_saddle(KSP ksp)
{
  Saddle *d = (Saddle *)ksp->data;
  PetscInt idle = 0;
  PetscReal tolerance = 0.;

  PetscFunctionBeginUser;
  ksp->its = 0;
  ksp->reason = KSP_CONVERGED_ITERATING;
  if (!d->space->constraints->exact.N) {
    PetscCall(solve_plain(ksp, d));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(update(d));
  PetscCall(begin(ksp, ksp->work[0], &tolerance));
  while (!(ksp->reason = state_of(ksp, tolerance, idle))) {
    const PetscBool minres = d->minres;
    const PetscReal last = ksp->rnorm;
    const PetscReal aim =
      PetscMax(minres ? DIGITS : DIGITS_GMRES, PetscMin(0.1, tolerance / (d->loss * last)));

    PetscCall(solve_round(ksp, d, aim, ksp->work[0]));
    if (minres != d->minres) continue;
    PetscCall(VecNorm(ksp->work[0], NORM_2, &ksp->rnorm));
    PetscCall(PetscInfo(ksp, "residual %g after %" PetscInt_FMT " iterations, aim %g\n", (double)ksp->rnorm,
                        ksp->its, (double)tolerance));
    d->loss = PetscMax(2., PetscMin(1e4, 2. * ksp->rnorm / (last * aim)));
    idle = ksp->rnorm > 0.9 * last ? idle + 1 : 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_saddle(KSP ksp)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSetWorkVecs(ksp, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_saddle(KSP ksp)
{
  Saddle *d = (Saddle *)ksp->data;

  PetscFunctionBeginUser;
  PetscCall(forget(d));
  PetscCall(KSPDestroy(&d->plain));
  PetscCall(VecDestroy(&d->from));
  PetscCall(VecDestroy(&d->to));
  PetscCall(PetscFree(ksp->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode view_saddle(KSP ksp, PetscViewer viewer)
{
  Saddle *d = (Saddle *)ksp->data;

  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  multipliers as unknowns; where nothing touches:\n"));
  PetscCall(KSPView(d->plain, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_saddle(KSP ksp)
{
  Saddle *d;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&d));
  ksp->data = d;
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_UNPRECONDITIONED, PC_LEFT, 3));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_UNPRECONDITIONED, PC_RIGHT, 2));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_PRECONDITIONED, PC_LEFT, 1));
  PetscCall(KSPSetSupportedNorm(ksp, KSP_NORM_NONE, PC_LEFT, 1));
  ksp->ops->setup = setup_saddle;
  ksp->ops->solve = solve_saddle;
  ksp->ops->destroy = destroy_saddle;
  ksp->ops->view = view_saddle;
  ksp->ops->buildsolution = KSPBuildSolutionDefault;
  ksp->ops->buildresidual = KSPBuildResidualDefault;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbKSPSaddleSet(SbSpace s, KSP ksp)
{
  const char *prefix;
  char type[SB_NAME_MAX];
  KSPType name;
  PetscBool richardson;
  KSP plain;
  Saddle *d;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPGetType(ksp, &name));
  PetscCall(PetscStrncpy(type, name, sizeof(type)));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPCreate(s->comm, &plain));
  PetscCall(KSPSetOptionsPrefix(plain, prefix));
  PetscCall(KSPSetType(plain, type));
  PetscCall(SbKSPPreferTrueResidual(plain));
  PetscCall(KSPSetFromOptions(plain));
  PetscCall(KSPSetPC(plain, pc));
  PetscCall(KSPRegister(SB_KSP_SADDLE, create_saddle));
  PetscCall(KSPSetType(ksp, SB_KSP_SADDLE));
  d = (Saddle *)ksp->data;
  d->space = s;
  d->plain = plain;
  d->loss = LOSS;
  PetscCall(PetscStrcmp(type, KSPRICHARDSON, &richardson));
  d->minres = (PetscBool)(!richardson && !SbSpaceHasNonsymmetricConstraints(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbKSPSaddleGetPlain(KSP ksp, KSP *plain)
{
  PetscBool is;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, SB_KSP_SADDLE, &is));
  *plain = is ? ((Saddle *)ksp->data)->plain : ksp;
  PetscFunctionReturn(PETSC_SUCCESS);
}
