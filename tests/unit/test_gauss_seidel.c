/*
  Gauss-Seidel with the upper triangle: the sweeps solve with D + L^T and, from an initial guess, D
  + L of the rank's diagonal block, compared with PETSc's MatSOR() on the same matrix, for P1, P2
  and CR, with prescribed nodes; the residual returned by the first one equals that of a product.
*/
// @ranks 1 3
#include "../../src/pc/gauss_seidel.h"
#include "../scene.h"

static void pattern(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(5. * x[0] + x[1]);
  v[1] = PetscCosReal(3. * x[1] - 2. * x[2]);
  v[2] = 0.3 + x[0] * x[2];
}

static PetscErrorCode compare(const char *element)
{
  TestScene scene;
  SbSpace s;
  SbStage stage = {.shift_k = 1.};
  PetscReal *inverse, error, size;
  Vec r, z, t, left, reference;
  PetscBool positive;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&scene,
              "-bodies b -body_b_mesh box:2,1,1:3 -body_b_element %s -body_b_material linear "
              "-body_b_young 1e4 -body_b_poisson 0.3 -effects hold -effect_hold_type fixed "
              "-effect_hold_on xmin -time static -solver cg_pbjacobi",
              element));
  s = scene.model->space;
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A));
  PetscCall(SbSpaceAssembleTangent(s, &stage, A));
  PetscCall(SbSpaceFinishTangent(s, A));
  PetscCall(MatCreateVecs(A, &r, &z));
  PetscCall(VecDuplicate(z, &t));
  PetscCall(VecDuplicate(z, &left));
  PetscCall(VecDuplicate(z, &reference));
  PetscCall(test_fill(scene.model, pattern, r));
  PetscCall(PetscMalloc1(9 * s->nnode_owned, &inverse));
  PetscCall(SbGaussSeidelSetUp(A, inverse, NULL, &positive));
  for (int k = 0; k < 2; k++) {
    // r - A z by a product, and D + L or D + L^T on it by PETSc
    if (!k)
      PetscCall(VecCopy(r, left));
    else {
      PetscCall(MatMult(A, z, left));
      PetscCall(VecAYPX(left, -1., r));
      PetscCall(VecNorm(left, NORM_2, &size));
      PetscCall(VecAXPY(t, -1., left));
      PetscCall(VecNorm(t, NORM_2, &error));
      SB_CHECK(error <= 1e-13 * size, "%s: residual off by %g of %g", element, error, size);
    }
    PetscCall(MatSOR(A, left, 1.,
                     (MatSORType)((k ? SOR_LOCAL_FORWARD_SWEEP : SOR_LOCAL_BACKWARD_SWEEP) |
                                  SOR_ZERO_INITIAL_GUESS),
                     0., 1, 1, reference));
    if (k) {
      PetscCall(VecAXPY(reference, 1., z));
      PetscCall(SbGaussSeidelUp(A, inverse, NULL, r, z, t));
    } else
      PetscCall(SbGaussSeidelDown(A, inverse, NULL, r, z, t));
    PetscCall(VecNorm(reference, NORM_2, &size));
    PetscCall(VecAXPY(reference, -1., z));
    PetscCall(VecNorm(reference, NORM_2, &error));
    SB_CHECK(error <= 1e-13 * size, "%s, sweep %d: difference %g of %g", element, k, error, size);
  }
  SB_CHECK(positive, "%s: a block is not positive", element);
  PetscCall(MatScale(A, -1.));
  PetscCall(SbGaussSeidelSetUp(A, inverse, NULL, &positive));
  SB_CHECK(!positive, "%s: negative blocks pass", element);
  PetscCall(PetscFree(inverse));
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&z));
  PetscCall(VecDestroy(&t));
  PetscCall(VecDestroy(&left));
  PetscCall(VecDestroy(&reference));
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(compare("p1"));
  PetscCall(compare("p2"));
  PetscCall(compare("cr"));
  SB_TEST_END();
}
