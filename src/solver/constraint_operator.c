/*
  Solves with constraints outside the matrix K (src/fem/constraint.c): the operator A = P (K + F^T k
  G) P, and M_A^-1 = P M^-1 P around any preconditioner M. If K lacks a part of the tangent, A has
  the complete one, and K is the preconditioner's matrix.

  With SB_SADDLE_DIRECT a factorisation of the projected matrix replaces M. It is the inverse of A
  in the null space, so that one iteration is enough, up to rounding. Without active constraints M
  itself is used.
*/
#include "sbpc.h"
#include "solver_impl.h"

/* x <- P x, with its log event. */
static PetscErrorCode project(SbSpace s, Vec x)
{
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscCall(VecGetArray(x, &a));
  SbConstraintsProject(s, a);
  PetscCall(VecRestoreArray(x, &a));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = P (K + F^T k G) x for x in the null space, to which the iteration is confined. */
static PetscErrorCode multiply(Mat A, Vec x, Vec y)
{
  const PetscScalar *from;
  PetscScalar *to;
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &s));
  PetscCall(MatMult(s->constraints->whole, x, y));
  PetscCall(VecGetArrayRead(x, &from));
  PetscCall(VecGetArray(y, &to));
  SbConstraintsAddTangent(s, from, to);
  PetscCall(VecRestoreArray(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscCall(project(s, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsCreateOperator(SbSpace s, Mat K, Mat whole, PetscBool singular,
                                           SbSaddle saddle, Mat *A)
{
  const PetscInt n = 3 * s->nnode_owned;

  PetscFunctionBeginUser;
  PetscCall(MatCreateShell(s->comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, s, A));
  PetscCall(MatShellSetOperation(*A, MATOP_MULT, SB_OPERATION(multiply)));
  PetscCall(
    MatSetOption(*A, MAT_SYMMETRIC, (PetscBool)(!s->constraints->nonsymmetric && whole == K)));
  s->constraints->K = K;
  s->constraints->whole = whole;
  s->constraints->saddle = saddle;
  s->constraints->definite = (PetscBool)!singular;
  if (singular && saddle != SB_SADDLE_DIRECT)
    PetscCall(PetscCalloc1(n, &s->constraints->added));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define NAME "null space of constraints"

typedef struct {
  SbSpace space;
  PC inner;
  Vec r; /* projected residual */
} Wrapped;

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

  /* no set-up of M: K alone may be singular */
  if (SbConstraintsFactored(w->space))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCSetUp(w->inner));
  PetscCall(PCGetFailedReason(w->inner, &reason));
  PetscCall(PCSetFailedReason(pc, reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode apply_wrapped(PC pc, Vec r, Vec z)
{
  PCFailedReason reason;
  PetscBool factored;
  Wrapped *w;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &w));
  factored = SbConstraintsFactored(w->space);
  if (w->space->constraints->nexact) {
    if (!w->r)
      PetscCall(VecDuplicate(r, &w->r));
    PetscCall(VecCopy(r, w->r));
    PetscCall(project(w->space, w->r));
    r = w->r;
  }
  if (factored)
    PetscCall(SbSaddleFactorSolve(w->space, r, z, &reason));
  else {
    PetscCall(PCApply(w->inner, r, z));
    PetscCall(PCGetFailedReason(w->inner, &reason));
  }
  if (w->space->constraints->nexact && !reason)
    PetscCall(project(w->space, z));
  if (reason || factored)
    PetscCall(PCSetFailedReason(pc, reason));
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
  PetscCall(VecDestroy(&w->r));
  PetscCall(PetscFree(w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCConstrainedCreate(SbSpace s, PC pc, PC *inner)
{
  const char *prefix;
  Wrapped *w;

  PetscFunctionBeginUser;
  *inner = pc;
  if (!SbConstraintsSeparate(s))
    PetscFunctionReturn(PETSC_SUCCESS);
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
  Wrapped *w;

  PetscFunctionBeginUser;
  PetscCall(SbPCShellFind(pc, NAME, &w));
  *inner = w ? w->inner : pc;
  PetscFunctionReturn(PETSC_SUCCESS);
}
