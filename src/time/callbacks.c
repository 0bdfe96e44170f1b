/*
  Callbacks of PETSc's TS and SNES. A tangent that cannot have changed (linear laws, loads
  independent of the displacement, the same shifts) is not assembled again, and the preconditioner
  is reused.
*/
#include "sbsolver.h"
#include "time_impl.h"

#define TINY 1e-10 /* relative difference of shifts that are the same */

static PetscErrorCode form_tangent(SbRun run, PetscReal t, PetscReal shift_v, PetscReal shift_a,
                                   Vec U, Vec V, Mat P)
{
  PetscFunctionBeginUser;
  if (run->model->linear && run->solve.tangent_known &&
      PetscAbsReal(run->solve.shift_v - shift_v) <= TINY * shift_v &&
      PetscAbsReal(run->solve.shift_a - shift_a) <= TINY * shift_a)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbModelTangent(run->model, t, shift_v, shift_a, 1., U, V, P));

  /* a rotated preconditioner needs the displacement of the matrix */
  if (run->solve.solver_used->precondition)
    PetscCall(PetscObjectCompose((PetscObject)P, "sb_state", (PetscObject)U));
  if (run->solve.nonsymmetric.U) {
    PetscCall(VecCopy(U, run->solve.nonsymmetric.U));
    run->solve.nonsymmetric.t = t;
  }
  run->solve.tangent_known = PETSC_TRUE;
  run->solve.shift_v = shift_v;
  run->solve.shift_a = shift_a;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = (J + its nonsymmetric part) x */
static PetscErrorCode multiply(Mat A, Vec x, Vec y)
{
  SbRun run;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &run));
  PetscCall(VecCopy(x, run->solve.nonsymmetric.x));
  PetscCall(SbModelNonsymmetric(run->model, run->solve.nonsymmetric.t, run->solve.nonsymmetric.U,
                                run->solve.nonsymmetric.x, run->solve.nonsymmetric.y));
  PetscCall(MatMult(run->solve.J, x, y));
  PetscCall(VecAXPY(y, 1., run->solve.nonsymmetric.y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormCreateOperator(SbRun run)
{
  const PetscInt n = 3 * run->model->space->nnode_owned;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(run->model->space, &run->solve.nonsymmetric.U));
  PetscCall(SbSpaceCreateVec(run->model->space, &run->solve.nonsymmetric.x));
  PetscCall(SbSpaceCreateVec(run->model->space, &run->solve.nonsymmetric.y));
  PetscCall(MatCreateShell(run->model->comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, run,
                           &run->solve.system));
  PetscCall(MatShellSetOperation(run->solve.system, MATOP_MULT, SB_OPERATION(multiply)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormI2Function(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  PetscFunctionBeginUser;
  (void)ts;
  PetscCall(SbModelResidual(((SbRun)ctx)->model, t, U, V, A, PETSC_TRUE, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormI2Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal shift_v,
                                PetscReal shift_a, Mat J, Mat P, void *ctx)
{
  PetscFunctionBeginUser;
  (void)ts;
  (void)A;
  PetscCall(form_tangent((SbRun)ctx, t, shift_v, shift_a, U, V, P));
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormStaticFunction(SNES snes, Vec U, Vec F, void *ctx)
{
  SbRun run = (SbRun)ctx;

  PetscFunctionBeginUser;
  (void)snes;
  PetscCall(SbModelResidual(run->model, run->model->load, U, NULL, NULL, PETSC_TRUE, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormStaticJacobian(SNES snes, Vec U, Mat J, Mat P, void *ctx)
{
  SbRun run = (SbRun)ctx;

  PetscFunctionBeginUser;
  (void)snes;
  (void)J;
  PetscCall(form_tangent(run, run->model->load, 0., 0., U, NULL, P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFormAcceleration(SbRun run, PetscReal t, Vec U, Vec V, PetscBool constrain, Vec A)
{
  const SbSpace s = run->model->space;
  Vec kept = NULL;

  PetscFunctionBeginUser;
  if (!constrain) {
    PetscCall(VecDuplicate(A, &kept));
    PetscCall(VecCopy(A, kept));
    PetscCall(SbSpaceZeroPrescribed(s, PETSC_FALSE, kept));
  }
  PetscCall(SbModelResidual(run->model, t, U, V, NULL, constrain, A));
  if (s->consistent_mass) {
    Mat M;
    KSP ksp;
    PC pc;

    /* with the consistent mass the system is solved by CG to rounding; the lumped mass is a
       division */
    PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &M));
    PetscCall(SbModelTangent(run->model, 0., 0., 1., 0., run->state.U, run->state.V, M));
    PetscCall(KSPCreate(run->model->comm, &ksp));
    PetscCall(KSPSetOptionsPrefix(ksp, "mass_"));
    PetscCall(KSPSetOperators(ksp, M, M));
    PetscCall(KSPSetType(ksp, KSPCG));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(PCSetType(pc, PCJACOBI));
    PetscCall(KSPSetTolerances(ksp, 1e-14, PETSC_DEFAULT, PETSC_DEFAULT, 500));
    PetscCall(KSPSolve(ksp, A, A));
    PetscCall(KSPDestroy(&ksp));
    PetscCall(MatDestroy(&M));
  } else
    PetscCall(VecPointwiseDivide(A, A, run->state.mass));
  PetscCall(VecScale(A, -1.));
  if (!constrain) {
    PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, A));
    PetscCall(VecAXPY(A, 1., kept));
    PetscCall(VecDestroy(&kept));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
