/*
  Gauss-Seidel from the upper triangle: the sweeps solve with D + L and D + L^T of the rank's own part, compared with PETSc's
  MatSOR() on the same matrix, for P1 and CR, with prescribed nodes.
*/
// @ranks 1 3
#include "../../src/solver/gauss_seidel.h"
#include "../scene.h"

static void pattern(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(5. * x[0] + x[1]);
  v[1] = PetscCosReal(3. * x[1] - 2. * x[2]);
  v[2] = 0.3 + x[0] * x[2];
}

static PetscErrorCode compare(const char *element)
{
  static const MatSORType types[] = {SOR_LOCAL_FORWARD_SWEEP, SOR_LOCAL_BACKWARD_SWEEP};
  char text[1024];
  TestScene t;
  SbSpace s;
  SbStage stage = {.shift_k = 1.};
  PetscReal *inverse, error, size;
  Vec r, z, reference;
  PetscBool positive;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "-bodies b -body_b_mesh box:2,1,1:3 -body_b_element %s -body_b_material linear "
                          "-body_b_young 1e4 -body_b_poisson 0.3 -effects hold -effect_hold_type fixed "
                          "-effect_hold_on xmin -time static -solver cg_pbjacobi",
                          element));
  PetscCall(test_scene_open(text, &t));
  s = t.model->space;
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A));
  PetscCall(SbSpaceAssembleTangent(s, &stage, A));
  PetscCall(SbSpaceFinishTangent(s, A));
  PetscCall(MatCreateVecs(A, &r, &z));
  PetscCall(VecDuplicate(z, &reference));
  PetscCall(test_fill(t.model, pattern, r));
  PetscCall(PetscMalloc1(9 * s->nnode_owned, &inverse));
  PetscCall(SbGaussSeidelSetUp(s, A, inverse, &positive));
  for (int k = 0; k < 2; k++) {
    PetscCall(SbGaussSeidel(s, A, inverse, k ? SB_GAUSS_SEIDEL_BACKWARD : SB_GAUSS_SEIDEL_FORWARD, r, z));
    PetscCall(MatSOR(A, r, 1., (MatSORType)(types[k] | SOR_ZERO_INITIAL_GUESS), 0., 1, 1, reference));
    PetscCall(VecNorm(reference, NORM_2, &size));
    PetscCall(VecAXPY(z, -1., reference));
    PetscCall(VecNorm(z, NORM_2, &error));
    SB_CHECK(error <= 1e-13 * size, "%s, sweep %d: difference %g of %g", element, k, (double)error,
             (double)size);
  }
  SB_CHECK(positive, "%s: a block is not positive", element);
  PetscCall(MatScale(A, -1.));
  PetscCall(SbGaussSeidelSetUp(s, A, inverse, &positive));
  SB_CHECK(!positive, "%s: negative blocks pass", element);
  PetscCall(PetscFree(inverse));
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&z));
  PetscCall(VecDestroy(&reference));
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(compare("p1"));
  PetscCall(compare("cr"));
  SB_TEST_END();
}
