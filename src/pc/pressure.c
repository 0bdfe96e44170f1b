/*
  Nearly incompressible CR and DG: the pressures of the cells as unknowns of the iteration.

  The condition number of K = A + B^T C^-1 B (pressure_operator.c) grows with lambda. K u = r is
  equivalent to

    [ A  B^T ] [u]   [r]
    [ B  -C  ] [p] = [0],      C = V / lambda,

  which stays well conditioned up to lambda = infinity: with one pressure per cell, CR satisfies the
  inf-sup condition on every mesh (Crouzeix and Raviart 1973), so that the diagonal S = C + 1.5 V /
  (2 mu) approximates C + B A^-1 B^T. GMRES with the upper triangular preconditioner of A^
  (levels.c) and -S on its right takes a number of iterations that depends neither on lambda nor
  on the mesh. Benzi, Golub and Liesen (2005), Numerical solution of saddle point problems, sections
  10 and 8.

  The outer iteration is iterative refinement: the residual f - K u is computed again and is the
  next right-hand side. -ksp_rtol applies to it; the iterations reported are those of GMRES. f - K u
  = r_u - B^T C^-1 r_p contains the residual of the cells times lambda, and GMRES minimises a norm
  with these weights, up to lambda = 1e4 mu. Beyond that double precision is the limit: at nu =
  0.499999 the rounding error of K u is eps |B^T| C^-1 |B| |u| for any solver. A residual below four
  times this is accepted, with a line of -info, unless it is so large that the matrix must be
  singular.

  Not handled: inertia in S; time steps far below the time in which a shear wave crosses a cell take
  more iterations.

  petsc/private/kspimpl.h: else the outer solver would report its few corrections as iterations.
*/
#include "pressure.h"
#include <petsc/private/kspimpl.h>

#define RESTART 120  /* restart length of GMRES: 80 took 97 iterations instead of 81 on 64 ranks */
#define MARGIN 0.3   /* target of GMRES over the target of the whole solve */
#define TIGHTER 0.03 /* factor on it after a correction that did not reduce the residual */
#define OF_PART \
  1e-2 /* tolerance of GMRES where the operator has terms that K lacks, which FGMRES corrects */
#define AT_MOST 1e-2 /* largest accepted residual over the right-hand side */
#define ROUNDING 4.  /* accepted residual, over the rounding error of K u */

typedef struct {
  SbSpace space;
  SbPressureOperator op; /* operator of the last set-up */
  KSP inner;
  Mat M;
  Vec x, b, t;               /* vectors of the mixed system; vector of the nodes */
  KSP ksp;                   /* solver with the convergence test below; borrowed */
  PetscReal target, last;    /* target of the residual norm; the last residual norm, N */
  PetscReal size, margin;    /* norm of the right-hand side, N; current value of MARGIN */
  PetscInt its, limit, slow; /* iterations of GMRES, their limit; corrections without effect */
} Pressure;

/* Product with the mixed system. */
static PetscErrorCode MatMult_Mixed(Mat M, Vec X, Vec Y)
{
  const PetscScalar *x;
  PetscScalar *y;
  PetscInt n;
  Pressure *s;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(M, &s));
  n = 3 * s->space->nnode_owned;
  PetscCall(VecGetArrayRead(X, &x));
  PetscCall(VecGetArray(Y, &y));
  PetscCall(SbPressureOperatorApply(s->op, x, x + n, y, y + n));
  for (PetscInt c = 0; c < s->space->mesh->ncell_owned; c++)
    y[n + c] = s->op->weight[c] * (y[n + c] - s->op->C[c] * x[n + c]);
  PetscCall(VecRestoreArray(Y, &y));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* p = -S^-1 r_p, u = A^ (r_u - B^T p). */
static PetscErrorCode PCApply_Mixed(PC pc, Vec R, Vec Z)
{
  SbPressureOperator op;
  const PetscScalar *r;
  PetscScalar *z, *t;
  PetscInt n;
  Pressure *s;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &s));
  op = s->op;
  n = 3 * s->space->nnode_owned;
  PetscCall(VecGetArray(Z, &z));
  PetscCall(VecGetArrayRead(R, &r));
  PetscCall(VecGetArray(s->t, &t));
  for (PetscInt c = 0; c < s->space->mesh->ncell_owned; c++)
    z[n + c] = -r[n + c] / (op->weight[c] * op->S[c]);
  PetscCall(PetscArraycpy(t, r, n));
  PetscCall(SbPressureOperatorAddGradient(op, z + n, PETSC_FALSE, -1., t));
  PetscCall(VecRestoreArray(s->t, &t));
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscCall(VecPlaceArray(op->b, z));
  PetscCall(SbLevelsApply(op->levels, s->t, op->b));
  PetscCall(VecResetArray(op->b));
  PetscCall(VecRestoreArray(Z, &z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Pressure(PC pc)
{
  PetscBool positive;
  Pressure *s;
  Mat K;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscCall(PCGetOperators(pc, NULL, &K));
  PetscCall(MatShellGetContext(K, &s->op));
  if (!s->inner) {
    const PetscInt n = 3 * s->space->nnode_owned + s->space->mesh->ncell_owned;
    PC inner;

    PetscCall(MatCreateShell(s->space->comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, s, &s->M));
    PetscCall(MatShellSetOperation(s->M, MATOP_MULT, SB_OPERATION(MatMult_Mixed)));
    PetscCall(MatSetUp(s->M));
    PetscCall(MatCreateVecs(s->M, &s->x, &s->b));
    PetscCall(MatCreateVecs(s->op->levels->A[0], &s->t, NULL));
    PetscCall(KSPCreate(s->space->comm, &s->inner));
    PetscCall(KSPSetOptionsPrefix(s->inner, "pressure_"));
    PetscCall(KSPSetOperators(s->inner, s->M, s->M));
    PetscCall(KSPSetType(s->inner, KSPGMRES));
    PetscCall(KSPGMRESSetRestart(s->inner, RESTART));
    PetscCall(SbKSPRefineOrthogonalization(s->inner));
    PetscCall(KSPSetPCSide(s->inner, PC_RIGHT));
    PetscCall(KSPSetNormType(s->inner, KSP_NORM_UNPRECONDITIONED));
    PetscCall(KSPGetPC(s->inner, &inner));
    PetscCall(PCSetType(inner, PCSHELL));
    PetscCall(PCShellSetContext(inner, s));
    PetscCall(PCShellSetName(inner, "nodes and pressures"));
    PetscCall(PCShellSetApply(inner, PCApply_Mixed));
    PetscCall(KSPSetFromOptions(s->inner));
  }
  PetscCall(SbLevelsSetUp(s->op->levels, &positive));
  PetscCall(PCSetFailedReason(pc, positive ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One correction: z = K^-1 r to the required accuracy. */
static PetscErrorCode PCApply_Pressure(PC pc, Vec r, Vec z)
{
  KSPConvergedReason reason;
  const PetscScalar *from;
  PetscScalar *to;
  PetscReal norm, rtol;
  PetscInt its, n;
  Pressure *s;
  Mat A, K;

  PetscFunctionBeginUser;

  // relative tolerance: target of the whole solve over the current residual
  PetscCall(PCShellGetContext(pc, &s));
  n = 3 * s->space->nnode_owned;
  PetscCall(PCGetOperators(pc, &A, &K));
  PetscCall(VecNorm(r, NORM_2, &norm));
  rtol = A == K ? PetscMin(0.5, PetscMax(1e-10, s->margin * s->target / norm)) : OF_PART;

  // the right-hand side, zero for the pressures
  PetscCall(VecZeroEntries(s->b));
  PetscCall(VecGetArray(s->b, &to));
  PetscCall(VecGetArrayRead(r, &from));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArrayRead(r, &from));
  PetscCall(VecRestoreArray(s->b, &to));

  // the solve; its iterations count against the limit
  PetscCall(KSPSetTolerances(s->inner, rtol, 0., PETSC_DEFAULT, PetscMax(1, s->limit - s->its)));
  PetscCall(KSPSolve(s->inner, s->b, s->x));
  PetscCall(KSPGetIterationNumber(s->inner, &its));
  PetscCall(KSPGetConvergedReason(s->inner, &reason));
  s->its += its;
  if (reason < 0 && reason != KSP_DIVERGED_ITS)
    PetscCall(PCSetFailedReason(pc, PC_SUBPC_ERROR));

  // the displacements of the solution
  PetscCall(VecGetArrayRead(s->x, &from));
  PetscCall(VecGetArray(z, &to));
  PetscCall(PetscArraycpy(to, from, n));
  PetscCall(VecRestoreArray(z, &to));
  PetscCall(VecRestoreArrayRead(s->x, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc's test; then whether the residual is one of rounding or stagnates. */
static PetscErrorCode converged(KSP ksp, PetscInt it, PetscReal norm, KSPConvergedReason *reason,
                                void *ctx)
{
  PetscReal level;
  Pressure *s;
  Vec x;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(KSPConvergedDefault(ksp, it, norm, reason, ctx));
  if (*reason || !it) {
    s->last = norm;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (s->its >= s->limit)
    *reason = KSP_DIVERGED_ITS;
  if (norm > 0.5 * s->last) {
    s->slow++;
    s->margin *= TIGHTER;
  }
  s->last = norm;
  PetscCall(KSPGetSolution(ksp, &x));
  PetscCall(SbPressureOperatorRounding(s->op, x, &level));
  PetscCall(PetscInfo(
    ksp, "residual %g after %" PetscInt_FMT " iterations, wanted %g, rounding of K u %g\n",
    (double)norm, s->its, (double)s->target, (double)level));
  if (norm <= PetscMin(ROUNDING * level, AT_MOST * s->size))
    *reason = KSP_CONVERGED_ATOL;
  else if (s->slow > 2)
    *reason = KSP_DIVERGED_BREAKDOWN;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPreSolve_Pressure(PC pc, KSP ksp, Vec b, Vec x)
{
  PetscReal rtol, atol, norm;
  void *test;
  Pressure *s;

  PetscFunctionBeginUser;
  (void)x;
  PetscCall(PCShellGetContext(pc, &s));
  if (s->ksp != ksp) {
    PetscCall(KSPConvergedDefaultCreate(&test));
    PetscCall(KSPSetConvergenceTest(ksp, converged, test, KSPConvergedDefaultDestroy));
    s->ksp = ksp;
  }
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, NULL, &s->limit));
  PetscCall(VecNorm(b, NORM_2, &norm));
  s->target = PetscMax(rtol * norm, atol);
  s->size = norm;
  s->its = s->slow = 0;
  s->margin = MARGIN;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPostSolve_Pressure(PC pc, KSP ksp, Vec b, Vec x)
{
  Pressure *s;

  PetscFunctionBeginUser;
  (void)b;
  (void)x;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " corrections, %" PetscInt_FMT " iterations\n", ksp->its,
                      s->its));
  ksp->its = s->its;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_Pressure(PC pc, PetscViewer viewer)
{
  Pressure *s;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  nodes, and pressures of the cells as unknowns\n"));
  if (s->inner)
    PetscCall(KSPView(s->inner, viewer));
  if (s->op && s->op->levels->multigrid)
    PetscCall(PCView(s->op->levels->multigrid, viewer));
  else if (s->op)
    PetscCall(KSPView(s->op->levels->coarse, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Pressure(PC pc)
{
  Pressure *s;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &s));
  PetscCall(KSPDestroy(&s->inner));
  PetscCall(MatDestroy(&s->M));
  PetscCall(VecDestroy(&s->x));
  PetscCall(VecDestroy(&s->b));
  PetscCall(VecDestroy(&s->t));
  PetscCall(PetscFree(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCPressureCreate(SbSpace space, PC pc)
{
  Pressure *s;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&s));
  s->space = space;
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, s));
  PetscCall(PCShellSetName(pc, "pressure"));
  PetscCall(PCShellSetSetUp(pc, PCSetUp_Pressure));
  PetscCall(PCShellSetApply(pc, PCApply_Pressure));
  PetscCall(PCShellSetPreSolve(pc, PCPreSolve_Pressure));
  PetscCall(PCShellSetPostSolve(pc, PCPostSolve_Pressure));
  PetscCall(PCShellSetView(pc, PCView_Pressure));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_Pressure));
  PetscFunctionReturn(PETSC_SUCCESS);
}
