/*
  What solves see of the constraints of constraint.c: the operator A = P^T (K + S^T k S) P, and M_A^-1 = P M^-1 P^T around any preconditioner M.

  With SB_SADDLE_DIRECT the part of M is taken by the solution of the saddle-point system, which is A's inverse in the null space: one
  iteration and what rounding asks for. Where nothing touches, M itself is used.
*/
#include "solver_impl.h"
#include "sbconstraint.h"
#include "sbsolver.h"
#include "sblog.h"

/* y = (K + F^T k G) x, what was added to K taken away. */
static PetscErrorCode multiply_stiffness(SbConstraints c, Vec x, Vec y)
{
  PetscFunctionBeginUser;
  PetscCall(MatMult(c->K, x, y));
  if (c->added && c->w[0]) { /* before the first constraints there is neither */
    PetscCall(VecPointwiseMult(c->w[0], c->added, x));
    PetscCall(VecAXPY(y, -1., c->w[0]));
  }
  if (c->spring.N) {
    PetscCall(MatMult(c->spring.free, x, c->spring.work));
    PetscCall(VecPointwiseMult(c->spring.work, c->spring.work, c->k));
    PetscCall(MatMultTransposeAdd(c->spring.push_free, c->spring.work, y, y));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The projections of a solve, timed. */
static PetscErrorCode project_force(SbConstraints c, Vec r)
{
  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscCall(SbConstraintsProjectForce(c, r));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode project(SbConstraints c, Vec x)
{
  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscCall(SbConstraintsProject(c, x));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = P^T (K + S^T k S) x for x in the null space, where the iteration stays. */
static PetscErrorCode multiply(Mat A, Vec x, Vec y)
{
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &s));
  PetscCall(multiply_stiffness(s->constraints, x, y));
  PetscCall(project_force(s->constraints, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsCreateOperator(SbSpace s, Mat K, PetscBool singular, SbSaddle saddle, Mat *A)
{
  PetscInt m, n, M, N;

  PetscFunctionBeginUser;
  PetscCall(MatGetLocalSize(K, &m, &n));
  PetscCall(MatGetSize(K, &M, &N));
  PetscCall(MatCreateShell(s->comm, m, n, M, N, s, A));
  PetscCall(MatShellSetOperation(*A, MATOP_MULT, SB_OPERATION(multiply)));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, (PetscBool)!s->constraints->nonsymmetric));
  s->constraints->K = K;
  s->constraints->saddle = saddle;
  if (singular && saddle != SB_SADDLE_DIRECT) {
    PetscCall(SbSpaceCreateVec(s, &s->constraints->anchor));
    PetscCall(SbSpaceCreateVec(s, &s->constraints->added));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsSetMatrix(SbSpace s, Mat K)
{
  PetscFunctionBeginUser;
  s->constraints->K = K;
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define NAME "null space of constraints"

typedef struct {
  SbSpace space;
  PC inner;
} Wrapped;

/* Whether solves go by a factorisation of the saddle-point system now. */
static PetscBool is_factored(SbSpace s)
{
  return (PetscBool)(s->constraints->saddle == SB_SADDLE_DIRECT && s->constraints->exact.N);
}

static PetscErrorCode setup_wrapped(PC pc)
{
  PCFailedReason reason;
  Wrapped *w;
  Mat K;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &w));
  PetscCall(PCGetOperators(pc, NULL, &K));
  PetscCall(PCSetOperators(w->inner, K, K));
  PetscCall(PCSetFailedReason(pc, PC_NOERROR));
  w->space->constraints->matrix++;
  if (is_factored(w->space)) PetscFunctionReturn(PETSC_SUCCESS); /* K alone may be singular */
  PetscCall(PCSetUp(w->inner));
  PetscCall(PCGetFailedReason(w->inner, &reason));
  PetscCall(PCSetFailedReason(pc, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode apply_wrapped(PC pc, Vec r, Vec z)
{
  PCFailedReason reason;
  Wrapped *w;
  SbConstraints c;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &w));
  c = w->space->constraints;
  if (is_factored(w->space)) {
    PetscBool ok;

    PetscCall(VecCopy(r, c->w[1]));
    PetscCall(project_force(c, c->w[1]));
    PetscCall(SbSaddleFactorSolve(w->space, c->w[1], z, &ok));
    if (ok) PetscCall(project(c, z));
    PetscCall(PCSetFailedReason(pc, ok ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!c->exact.N)
    PetscCall(PCApply(w->inner, r, z));
  else {
    PetscCall(VecCopy(r, c->w[1]));
    PetscCall(project_force(c, c->w[1]));
    PetscCall(PCApply(w->inner, c->w[1], z));
    PetscCall(project(c, z));
  }
  PetscCall(PCGetFailedReason(w->inner, &reason));
  if (reason) PetscCall(PCSetFailedReason(pc, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode view_wrapped(PC pc, PetscViewer viewer)
{
  Wrapped *w;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &w));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  between projections into the null space:\n"));
  PetscCall(PCView(w->inner, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_wrapped(PC pc)
{
  Wrapped *w;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &w));
  PetscCall(PCDestroy(&w->inner));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCConstrainedCreate(SbSpace s, PC pc, PC *inner)
{
  const char *prefix;
  Wrapped *w;

  PetscFunctionBeginUser;
  *inner = pc;
  if (!s->constraints) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscNew(&w));
  w->space = s;
  PetscCall(PCCreate(s->comm, &w->inner));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PCSetOptionsPrefix(w->inner, prefix));
  PetscCall(PCSetOptionsPrefix(pc, "rows_"));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, w));
  PetscCall(PCShellSetName(pc, NAME));
  PetscCall(PCShellSetSetUp(pc, setup_wrapped));
  PetscCall(PCShellSetApply(pc, apply_wrapped));
  PetscCall(PCShellSetView(pc, view_wrapped));
  PetscCall(PCShellSetDestroy(pc, destroy_wrapped));
  *inner = w->inner;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCConstrainedGetInner(PC pc, PC *inner)
{
  PetscBool is;
  const char *name = NULL;
  Wrapped *w;

  PetscFunctionBeginUser;
  *inner = pc;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCSHELL, &is));
  if (is) PetscCall(PCShellGetName(pc, &name));
  if (!name || strcmp(name, NAME)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCShellGetContext(pc, &w));
  *inner = w->inner;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCConstrainedIsFactored(PC pc, PetscBool *is)
{
  Wrapped *w;
  PC inner;

  PetscFunctionBeginUser;
  *is = PETSC_FALSE;
  PetscCall(SbPCConstrainedGetInner(pc, &inner));
  if (inner == pc) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCShellGetContext(pc, &w));
  *is = is_factored(w->space);
  PetscFunctionReturn(PETSC_SUCCESS);
}
