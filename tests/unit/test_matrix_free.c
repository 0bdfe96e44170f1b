// @ranks 1 2 3 4
/* The matrix-free operator equals the assembled tangent with constraints, damping, linear materials
   and rotations. */
#include "../scene.h"

static const char *const scene =
  "-bodies a,b -body_a_mesh box:1,0.5,0.4:4,3,2 -body_a_material corotated -body_a_tangent warped "
  "-body_a_young 1e3 -body_a_poisson 0.3 -body_a_density 10 -body_b_mesh box:0.3,0.5,0.4:2 "
  "-body_b_translate 0,0,2 -body_b_material %s -body_b_young 2e3 -body_b_poisson 0.4 "
  "-body_b_density 7 "
  "-sets left,low -set_left_at plane:1,0,0,0 -set_low_at plane:0,0,1,0 -effects "
  "clamp,slide,damping "
  "-effect_clamp_type fixed -effect_clamp_on left -effect_slide_type fixed -effect_slide_on low "
  "-effect_slide_components z -effect_damping_alpha 0.3 -effect_damping_beta 0.02 %s";

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.4 * PetscSinReal(3. * x[0] + x[1]);
  v[1] = 0.3 * PetscCosReal(2. * x[1] - x[2]) * x[0];
  v[2] = 0.5 * PetscSinReal(x[0] + 4. * x[2]) * x[0];
}

static void other(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(5. * x[1]) + x[0];
  v[1] = PetscCosReal(3. * x[0]);
  v[2] = x[0] * (x[1] - x[2]);
}

/* Zeroes prescribed entries, where the two operators have different multiples of the identity. */
static PetscErrorCode hold(SbSpace s, Vec X)
{
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (PetscInt c = 0; c < 3; c++)
      if (s->fixed[i] & (1 << c))
        x[3 * i + c] = 0.;
  }
  PetscCall(VecRestoreArray(X, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode compare(const char *law)
{
  TestScene t;
  SbStage stage = {.shift_a = 50., .shift_v = 7., .shift_k = 1.};
  PetscReal norm, difference, a, b;
  PetscBool has;
  SbSpace s;
  Vec U, X, W, Y, Z;
  Mat A, F;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, scene, law, ""));
  s = t.model->space;
  PetscCall(SbSpaceAllowsMatrixFree(s, &has));
  SB_CHECK(has, "%s has frames", law);
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(SbSpaceCreateVec(s, &X));
  PetscCall(SbSpaceCreateVec(s, &W));
  PetscCall(SbSpaceCreateVec(s, &Y));
  PetscCall(SbSpaceCreateVec(s, &Z));
  PetscCall(test_fill(t.model, wave, U));
  PetscCall(test_fill(t.model, other, X));
  PetscCall(test_fill(t.model, wave, W));
  PetscCall(hold(s, X));
  PetscCall(hold(s, W));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A));
  PetscCall(SbModelTangent(t.model, 0., stage.shift_v, stage.shift_a, stage.shift_k, U, U, A));
  PetscCall(SbSpaceCreateMatrixFree(s, &F));
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  PetscCall(SbSpaceAssembleTangent(s, &stage, F));
  PetscCall(SbSpaceFinishTangent(s, F));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  PetscCall(MatMult(A, X, Y));
  PetscCall(MatMult(F, X, Z));
  PetscCall(VecDot(W, Z, &a));
  PetscCall(VecAXPY(Z, -1., Y));
  PetscCall(VecNorm(Y, NORM_2, &norm));
  PetscCall(VecNorm(Z, NORM_2, &difference));
  SB_CHECK(norm > 0. && difference < 1e-13 * norm, "%s: the operators differ by %g of %g", law,
           difference, norm);

  /* values at prescribed entries do not affect the free rows */
  PetscCall(test_fill(t.model, other, Y));
  PetscCall(MatMult(F, Y, Z));
  PetscCall(hold(s, Z));
  PetscCall(MatMult(F, X, Y));
  PetscCall(VecAXPY(Z, -1., Y));
  PetscCall(VecNorm(Z, NORM_2, &difference));
  SB_CHECK(difference < 1e-13 * norm, "%s: prescribed entries change free rows by %g of %g", law,
           difference, norm);
  PetscCall(MatMult(F, W, Z));
  PetscCall(VecDot(X, Z, &b));
  SB_CHECK_NEAR(a, b, 1e-13 * PetscAbsReal(a), "symmetry");
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&F));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&W));
  PetscCall(VecDestroy(&Y));
  PetscCall(VecDestroy(&Z));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refuse(const char *law, const char *extra)
{
  TestScene t;
  PetscBool has;
  Mat F;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, scene, law, extra));
  PetscCall(SbSpaceAllowsMatrixFree(t.model->space, &has));
  SB_CHECK(!has, "%s %s is said to have frames", law, extra);
  SB_CHECK_ERROR(SbSpaceCreateMatrixFree(t.model->space, &F), PETSC_ERR_SUP, "");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(compare("corotated -body_b_tangent warped"));
  PetscCall(compare("linear"));
  PetscCall(compare("corotated -body_b_tangent warped -body_b_element p2"));
  PetscCall(compare("linear -body_a_element p2 -body_a_volume pointwise -body_b_element p2"));
  PetscCall(refuse("stvk", ""));
  PetscCall(refuse("linear", "-mass consistent"));
  PetscCall(refuse("linear", "-body_a_element cr"));
  PetscCall(refuse("linear", "-body_b_element dg"));
  PetscCall(refuse("linear", "-body_a_tangent exact"));
  SB_TEST_END();
}
