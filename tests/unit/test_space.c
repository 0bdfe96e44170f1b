// @ranks 1 2 3 4
/* Residual, tangent and matrices of a space: the three storages agree, the tangent is the derivative, forces balance. */
#include "../scene.h"

static const char *const scene_text =
  "-bodies a,b -body_a_mesh box:1,0.5,0.4:3 -body_a_material %s -body_a_young 1e3 -body_a_poisson 0.3 "
  "-body_a_density 10 "
  "-body_b_mesh box:0.3,0.5,0.4:2 -body_b_translate 0,0,2 -body_b_material %s -body_b_young 2e3 "
  "-body_b_poisson 0.4 -body_b_density 7 "
  "-sets left -set_left_at plane:1,0,0,0 -effects clamp,damping -effect_clamp_type support -effect_clamp_on "
  "left "
  "-effect_damping_alpha 0.3 -effect_damping_beta 0.02 -mass %s %s";

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.05 * PetscSinReal(3. * x[0] + x[1]);
  v[1] = 0.04 * PetscCosReal(2. * x[1] - x[2]) * x[0];
  v[2] = 0.06 * PetscSinReal(x[0] + 4. * x[2]) * x[0];
}

static void shear(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(5. * x[1]) * x[0];
  v[1] = PetscCosReal(3. * x[0]) * x[0];
  v[2] = x[0] * (x[1] - x[2]);
}

/* J w from one storage, its norm and its distance to the BAIJ one */
static PetscErrorCode storage(TestScene *t, SbMatrixKind kind, Vec U, Vec V, Vec W, Vec Y)
{
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateMatrix(t->model->space, kind, &A));
  for (int twice = 0; twice < 2; twice++) PetscCall(SbModelTangent(t->model, 0., 10., 100., 1., U, V, A));
  PetscCall(MatMult(A, W, Y));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |F(u + h w) - F(u) - h J w| must fall with h^2; velocity and acceleration follow as the shifts say */
static PetscErrorCode taylor(TestScene *t, int exact, Vec U, Vec V, Vec W)
{
  const PetscReal shift_v = 10., shift_a = 100.;
  Vec F0, F1, X, Vx, A, JW;
  Mat J;
  PetscReal error[2] = {0., 0.}, scale;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &F0));
  PetscCall(VecDuplicate(U, &F1));
  PetscCall(VecDuplicate(U, &X));
  PetscCall(VecDuplicate(U, &Vx));
  PetscCall(VecDuplicate(U, &A));
  PetscCall(VecDuplicate(U, &JW));
  PetscCall(VecZeroEntries(A));
  PetscCall(SbSpaceCreateMatrix(t->model->space, SB_MATRIX_BAIJ, &J));
  PetscCall(SbModelTangent(t->model, 0., shift_v, shift_a, 1., U, V, J));
  PetscCall(SbModelResidual(t->model, 0., U, V, A, PETSC_TRUE, F0));
  PetscCall(MatMult(J, W, JW));
  PetscCall(VecNorm(JW, NORM_2, &scale));
  for (int k = 0; k < 2; k++) {
    const PetscReal h = k ? 1e-4 : 2e-4;

    PetscCall(VecWAXPY(X, h, W, U));
    PetscCall(VecWAXPY(Vx, h * shift_v, W, V));
    PetscCall(VecCopy(W, A));
    PetscCall(VecScale(A, h * shift_a));
    PetscCall(SbModelResidual(t->model, 0., X, Vx, A, PETSC_TRUE, F1));
    PetscCall(VecAXPY(F1, -1., F0));
    PetscCall(VecAXPY(F1, -h, JW));
    PetscCall(VecNorm(F1, NORM_2, &error[k]));
  }
  if (exact)
    SB_CHECK(error[0] < 1e-11 * scale || error[0] / error[1] > 3.7,
             "Taylor remainder falls from %g to %g (scale %g)", (double)error[0], (double)error[1],
             (double)scale);
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&F0));
  PetscCall(VecDestroy(&F1));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&Vx));
  PetscCall(VecDestroy(&A));
  PetscCall(VecDestroy(&JW));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode one_scene(const char *law, const char *mass, const char *extra, PetscBool exact)
{
  TestScene t;
  char text[2048];
  Vec U, V, W, Y[3];
  PetscReal norm, diff, total;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscSNPrintf(text, sizeof(text), scene_text, law, law, mass, extra));
  PetscCall(test_scene_open(text, &t));
  PetscCall(SbSpaceCreateVec(t.model->space, &U));
  PetscCall(SbSpaceCreateVec(t.model->space, &V));
  PetscCall(SbSpaceCreateVec(t.model->space, &W));
  PetscCall(test_fill(t.model, wave, U));
  PetscCall(test_fill(t.model, shear, V));
  PetscCall(test_fill(t.model, shear, W));
  for (int k = 0; k < 3; k++) PetscCall(SbSpaceCreateVec(t.model->space, &Y[k]));
  PetscCall(storage(&t, SB_MATRIX_BAIJ, U, V, W, Y[0]));
  PetscCall(storage(&t, SB_MATRIX_AIJ, U, V, W, Y[1]));
  PetscCall(VecNorm(Y[0], NORM_2, &norm));
  /* the same partition-independent vectors: the norm is the same number on any rank count */
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s %s %s: |J w| = %.12g\n", law, mass, extra, (double)norm));
  PetscCall(VecAXPY(Y[1], -1., Y[0]));
  PetscCall(VecNorm(Y[1], NORM_2, &diff));
  SB_CHECK(norm > 0. && diff < 1e-13 * norm, "%s: AIJ and BAIJ differ by %g of %g", law, (double)diff,
           (double)norm);
  if (size == 1) {
    PetscCall(storage(&t, SB_MATRIX_SBAIJ, U, V, W, Y[2]));
    PetscCall(VecAXPY(Y[2], -1., Y[0]));
    PetscCall(VecNorm(Y[2], NORM_2, &diff));
    SB_CHECK(diff < 1e-13 * norm, "%s: SBAIJ and BAIJ differ by %g of %g", law, (double)diff, (double)norm);
  }
  PetscCall(taylor(&t, exact, U, V, W));
  /* at rest the tangent of damping is complete too: it leaves out only how it changes with the displacement */
  PetscCall(VecZeroEntries(V));
  PetscCall(taylor(&t, strcmp(law, "corotated") || strstr(extra, "exact"), U, V, W));
  /* internal forces of free bodies balance: the sum over all unknowns of one direction */
  PetscCall(SbModelResidual(t.model, 0., U, NULL, NULL, PETSC_FALSE, Y[0]));
  for (PetscInt c = 0; c < 3; c++) {
    PetscCall(VecStrideNorm(Y[0], c, NORM_1, &norm));
    PetscCall(VecStrideSum(Y[0], c, &total));
    SB_CHECK(PetscAbsReal(total) < 1e-12 * norm,
             "%s: internal forces along %" PetscInt_FMT " sum to %g of %g", law, c, (double)total,
             (double)norm);
  }
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&W));
  for (int k = 0; k < 3; k++) PetscCall(VecDestroy(&Y[k]));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(one_scene("linear", "lumped", "", PETSC_TRUE));
  PetscCall(one_scene("linear", "consistent", "", PETSC_TRUE));
  PetscCall(one_scene("corotated", "lumped", "", PETSC_FALSE));
  /* beta K v: the tangent leaves out dK/du, so the exact check runs without damping */
  PetscCall(one_scene("corotated", "lumped",
                      "-body_a_tangent exact -body_b_tangent exact -effect_damping_beta 0", PETSC_TRUE));
  PetscCall(one_scene("corotated", "lumped", "-body_a_tangent exact -body_b_tangent exact", PETSC_FALSE));
  PetscCall(one_scene("neohookean", "lumped", "-body_a_tangent exact -body_b_tangent exact", PETSC_FALSE));
  PetscCall(one_scene("stvk", "consistent",
                      "-body_a_tangent exact -body_b_tangent exact -effect_damping_beta 0", PETSC_TRUE));
  PetscCall(one_scene("neohookean", "lumped",
                      "-body_a_tangent exact -body_b_tangent exact -effect_damping_beta 0", PETSC_TRUE));
  SB_TEST_END();
}
