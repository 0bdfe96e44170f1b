/*
  Products with block matrices: agreement with AIJ, after changes of the values, and after a copy of
  the matrix. The same for the symmetric diagonal block of this rank.
*/
#include "../scene.h"
#include "sbfem.h"

static const char *const scene_text =
  "-bodies a,b -body_a_mesh box:1,0.5,0.4:3 -body_a_material linear -body_a_young 1e3 "
  "-body_a_poisson 0.3 "
  "-body_a_density 10 -body_b_mesh box:0.3,0.5,0.4:2 -body_b_translate 0,0,2 -body_b_material "
  "linear "
  "-body_b_young 2e3 -body_b_poisson 0.4 -body_b_density 7 -sets left -set_left_at plane:1,0,0,0 "
  "-effects clamp -effect_clamp_type fixed -effect_clamp_on left -solver cg_pbjacobi";

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(3. * x[0] + x[1]) + x[2];
  v[1] = PetscCosReal(2. * x[1] - x[2]);
  v[2] = PetscSinReal(x[0] + 4. * x[2]) - 0.3;
}

/* |A x - B x| against |B x| */
static PetscErrorCode compare(Mat A, Mat B, Vec x, const char *what)
{
  PetscReal difference, size;
  Vec y, z;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, NULL, &y));
  PetscCall(VecDuplicate(y, &z));
  PetscCall(VecSet(y, 7.)); /* what was there before does not count */
  PetscCall(MatMult(A, x, y));
  PetscCall(MatMult(B, x, z));
  PetscCall(VecNorm(z, NORM_2, &size));
  PetscCall(VecAXPY(y, -1., z));
  PetscCall(VecNorm(y, NORM_2, &difference));

  /* sums of some 45 products: rounding is below 1e-14 of the largest product, and the result is not
     small */
  SB_CHECK(size > 1. && difference < 1e-13 * size, "%s: the products differ by %g of %g", what,
           difference, size);
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Product of the local part of this rank only. */
static PetscErrorCode compare_own(Mat A, Mat B, Vec x, const char *what)
{
  Mat own, part;
  Vec xown;

  PetscFunctionBeginUser;
  PetscCall(SbProductGetSymmetric(A, &own));
  PetscCall(MatGetDiagonalBlock(B, &part));
  PetscCall(VecCreateLocalVector(x, &xown));
  PetscCall(VecGetLocalVectorRead(x, xown));
  PetscCall(compare(own, part, xown, what));
  PetscCall(VecRestoreLocalVectorRead(x, xown));
  PetscCall(VecDestroy(&xown));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode one_storage(TestScene *t, SbMatrixKind kind, const char *name, Vec x)
{
  SbSpace s = t->model->space;
  Mat A, B, C;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateMatrix(s, kind, &A));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_AIJ, &B));
  for (int k = 0; k < 2; k++) {
    /* twice with different values: no values of the first product may remain */
    PetscCall(SbModelTangent(t->model, 0., 0., k ? 50. : 3000., 1., x, NULL, A));
    PetscCall(SbModelTangent(t->model, 0., 0., k ? 50. : 3000., 1., x, NULL, B));
    PetscCall(compare(A, B, x, name));
    PetscCall(compare_own(A, B, x, name));
  }
  PetscCall(MatScale(A, 3.));
  PetscCall(MatScale(B, 3.));
  PetscCall(compare_own(A, B, x, name));
  PetscCall(compare(A, B, x, name));
  PetscCall(MatDuplicate(A, MAT_COPY_VALUES, &C));
  PetscCall(MatDestroy(&A));
  PetscCall(compare(C, B, x, name));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&C));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  TestScene t;
  Vec x;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_scene_open(scene_text, &t));
  PetscCall(SbSpaceCreateVec(t.model->space, &x));
  PetscCall(test_fill(t.model, wave, x));
  PetscCall(one_storage(&t, SB_MATRIX_BAIJ, "BAIJ", x));
  if (test_size == 1)
    PetscCall(one_storage(&t, SB_MATRIX_SBAIJ, "SBAIJ", x));
  PetscCall(VecDestroy(&x));
  PetscCall(test_scene_close(&t));
  SB_TEST_END();
}
