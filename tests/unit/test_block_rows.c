// @ranks 1 2 3
/* Rows of an operator as blocks: those of AIJ, BAIJ, a matrix-free operator and (one rank) SBAIJ
   are the same, and they are what MatMult does. */
#include "sbfem.h"
#include "../scene.h"

static const char *const scene =
  "-bodies a -body_a_mesh box:1,0.5,0.4:4,3,2 -body_a_material corotated -body_a_tangent warped "
  "-body_a_young 1e3 -body_a_poisson 0.3 -body_a_density 10 -sets left,low -set_left_at "
  "plane:1,0,0,0 "
  "-set_low_at plane:0,0,1,0 -effects clamp,slide -effect_clamp_type fixed -effect_clamp_on left "
  "-effect_slide_type fixed -effect_slide_on low -effect_slide_components z -body_a_element ";

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.4 * PetscSinReal(3. * x[0] + x[1]);
  v[1] = 0.3 * PetscCosReal(2. * x[1] - x[2]) * x[0];
  v[2] = 0.5 * PetscSinReal(x[0] + 4. * x[2]) * x[0];
}

typedef struct {
  PetscInt n, *node, *ia, *ja;
  PetscReal *block;
} Rows;

/* Every second owned node in reverse order: rows are returned in the requested order. */
static PetscErrorCode get(SbSpace s, Mat A, Rows *r)
{
  PetscFunctionBeginUser;
  r->n = 0;
  PetscCall(PetscMalloc2(s->nnode_owned, &r->node, s->nnode_owned + 1, &r->ia));
  for (PetscInt i = s->nnode_owned - 1; i >= 0; i -= 2)
    r->node[r->n++] = i;
  PetscCall(SbSpaceGetRows(s, A, r->n, r->node, r->ia, NULL, NULL));
  PetscCall(PetscMalloc2(r->ia[r->n], &r->ja, 9 * r->ia[r->n], &r->block));
  PetscCall(SbSpaceGetRows(s, A, r->n, r->node, r->ia, r->ja, r->block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode put(Rows *r)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(r->node, r->ia));
  PetscCall(PetscFree2(r->ja, r->block));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest difference from the rows of `to`; prescribed diagonal entries need only be positive in
   both. */
static PetscReal difference(SbSpace s, const Rows *r, const Rows *to)
{
  PetscReal worst = 0.;

  for (PetscInt k = 0; k < r->n; k++) {
    const PetscInt i = r->node[k];

    for (PetscInt at = r->ia[k]; at < r->ia[k + 1]; at++) {
      if (r->ja[at] != to->ja[at])
        return PETSC_MAX_REAL;
      for (PetscInt e = 0; e < 9; e++) {
        const PetscReal x = r->block[9 * at + e];
        const PetscReal y = to->block[9 * at + e];

        if (r->ja[at] == i && e % 4 == 0 && s->fixed[i] & (1 << e / 3)) {
          if (x <= 0. || y <= 0.)
            return PETSC_MAX_REAL;
        } else
          worst = PetscMax(worst, PetscAbsReal(x - y));
      }
    }
  }
  return worst;
}

/* |rows times x - A x| */
static PetscErrorCode against_product(SbSpace s, Mat A, const Rows *r, Vec X, PetscReal *worst)
{
  const PetscReal *x;
  const PetscScalar *y;
  Vec Y;

  PetscFunctionBeginUser;
  *worst = 0.;
  PetscCall(VecDuplicate(X, &Y));
  PetscCall(MatMult(A, X, Y));
  PetscCall(SbSpaceGetLocalRead(s, X, &x));
  PetscCall(VecGetArrayRead(Y, &y));
  for (PetscInt k = 0; k < r->n; k++) {
    for (PetscInt c = 0; c < 3; c++) {
      PetscReal sum = -y[3 * r->node[k] + c];

      for (PetscInt at = r->ia[k]; at < r->ia[k + 1]; at++)
        for (PetscInt e = 0; e < 3; e++)
          sum += r->block[9 * at + 3 * c + e] * x[3 * r->ja[at] + e];
      *worst = PetscMax(*worst, PetscAbsReal(sum));
    }
  }
  PetscCall(VecRestoreArrayRead(Y, &y));
  PetscCall(SbSpaceRestoreLocalRead(s, X, &x));
  PetscCall(VecDestroy(&Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element)
{
  static const char *const names[4] = {"AIJ", "BAIJ", "matrix-free operator", "SBAIJ"};
  TestScene t;
  SbStage stage = {.shift_a = 50., .shift_v = 0., .shift_k = 1.};
  PetscReal worst;
  int kinds;
  SbSpace s;
  Rows rows[4];
  Mat A[4];
  Vec U, X;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "%s%s", scene, element));
  s = t.model->space;
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(SbSpaceCreateVec(s, &X));
  PetscCall(test_fill(t.model, wave, U));
  PetscCall(test_fill(t.model, wave, X));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_AIJ, &A[0]));
  PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_BAIJ, &A[1]));
  PetscCall(SbSpaceCreateMatrixFree(s, &A[2]));
  for (int k = 0; k < 2; k++)
    PetscCall(SbModelTangent(t.model, 0., stage.shift_v, stage.shift_a, 1., U, NULL, A[k]));
  kinds = test_size == 1 ? 4 : 3;
  if (kinds == 4) {
    PetscCall(SbSpaceCreateMatrix(s, SB_MATRIX_SBAIJ, &A[3]));
    PetscCall(SbModelTangent(t.model, 0., stage.shift_v, stage.shift_a, 1., U, NULL, A[3]));
  }
  PetscCall(SbSpaceGetLocalRead(s, U, &stage.u));
  PetscCall(SbSpaceAssembleTangent(s, &stage, A[2]));
  PetscCall(SbSpaceRestoreLocalRead(s, U, &stage.u));
  for (int k = 0; k < kinds; k++)
    PetscCall(get(s, A[k], &rows[k]));
  for (int k = 0; k < kinds; k++) {
    SB_CHECK(rows[k].n == (s->nnode_owned + 1) / 2, "%s: %" PetscInt_FMT " rows", names[k],
             rows[k].n);

    /* entries are up to about 1e3 */
    worst = difference(s, &rows[k], &rows[1]);
    SB_CHECK(worst < 1e-10, "%s, %s: rows differ from BAIJ by %g", element, names[k], worst);
    PetscCall(against_product(s, A[k], &rows[k], X, &worst));
    SB_CHECK(worst < 1e-10, "%s, %s: rows differ from the product by %g", element, names[k], worst);
  }
  for (int k = 0; k < kinds; k++) {
    PetscCall(put(&rows[k]));
    PetscCall(MatDestroy(&A[k]));
  }
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&X));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_element("p1"));
  PetscCall(check_element("p2"));
  SB_TEST_END();
}
