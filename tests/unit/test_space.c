// @ranks 1 2 3 4
/*
  Residual, tangent and matrices of a space, for every element and material: the three storage
  formats agree, the tangent is symmetric and the derivative of the residual, which is that of the
  energy; forces balance, mass is complete.
*/
#include "../scene.h"

static const char *const scene_text =
  "-bodies a,b -body_a_mesh box:1,0.5,0.4:3 -body_a_material %s -body_a_young 1e3 -body_a_poisson "
  "0.3 "
  "-body_a_density 10 -body_b_mesh box:0.3,0.5,0.4:2 -body_b_translate 0,0,2 -body_b_material %s "
  "-body_b_young 2e3 -body_b_poisson 0.4 -body_b_density 7 -sets left -set_left_at plane:1,0,0,0 "
  "-effects clamp,damping -effect_clamp_type fixed -effect_clamp_on left -effect_damping_alpha 0.3 "
  "-effect_damping_beta 0.02 -mass %s %s";

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

/* J w with one storage format, its norm, and its difference from that of BAIJ. */
static PetscErrorCode storage(TestScene *t, SbMatrixKind kind, Vec U, Vec V, Vec W, Vec Y)
{
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateMatrix(t->model->space, kind, &A));
  for (int twice = 0; twice < 2; twice++)
    PetscCall(SbModelTangent(t->model, 0., 10., 100., 1., U, V, A));
  PetscCall(MatMult(A, W, Y));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* |F(u + h w) - F(u) - h J w| must decrease as h^2; the shifts define the change of velocity and
   acceleration */
static PetscErrorCode taylor(TestScene *t, int exact, Vec U, Vec V, Vec W)
{
  const PetscReal shift_v = 10.;
  const PetscReal shift_a = 100.;
  Vec F0, F1, X, Vx, A, JW;
  Mat J;
  PetscReal error[2] = {0., 0.};
  PetscReal scale;

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
             "Taylor remainder falls from %g to %g (scale %g)", error[0], error[1], scale);
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&F0));
  PetscCall(VecDestroy(&F1));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&Vx));
  PetscCall(VecDestroy(&A));
  PetscCall(VecDestroy(&JW));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w . F(u) = dE/dh at u + h w, by central differences: their error decreases as h^2, rounding grows
   as 1/h */
static PetscErrorCode energy_slope(TestScene *t, const char *what, Vec U, Vec W)
{
  const PetscReal h = 1e-5;
  SbEnergies e[2];
  PetscScalar power;
  Vec X, F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &X));
  PetscCall(VecDuplicate(U, &F));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecWAXPY(X, k ? -h : h, W, U));
    PetscCall(SbModelEnergies(t->model, X, X, &e[k]));
  }
  PetscCall(SbModelResidual(t->model, 0., U, NULL, NULL, PETSC_FALSE, F));
  PetscCall(VecDot(W, F, &power));
  SB_CHECK(e[0].strain > 0. && power != 0., "%s: strain energy %g J", what, e[0].strain);
  SB_CHECK_NEAR((e[0].strain - e[1].strain) / (2. * h), power,
                1e-6 * PetscAbsReal(power) + 1e-13 * e[0].strain / h, what);
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* w . J v = v . J w for v and w without symmetry */
static PetscErrorCode symmetry(TestScene *t, const char *what, Vec U, Vec V, Vec W)
{
  PetscScalar a, b;
  PetscReal size;
  Vec Y;
  Mat J;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &Y));
  PetscCall(SbSpaceCreateMatrix(t->model->space, SB_MATRIX_AIJ, &J));
  PetscCall(SbModelTangent(t->model, 0., 10., 100., 1., U, V, J));
  PetscCall(MatMult(J, U, Y));
  PetscCall(VecDot(W, Y, &a));
  PetscCall(VecAbs(Y));
  PetscCall(VecSum(Y, &size));
  PetscCall(MatMult(J, W, Y));
  PetscCall(VecDot(U, Y, &b));
  SB_CHECK(a != 0., "%s: nothing to compare", what);
  SB_CHECK_NEAR(a, b, 1e-13 * size, "symmetry of the tangent");
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&Y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Internal forces of free bodies balance, also with jumps: the sum over all nodes of one
   component. */
static PetscErrorCode balance(TestScene *t, const char *what, Vec U, Vec F)
{
  PetscReal norm, total;

  PetscFunctionBeginUser;
  PetscCall(SbModelResidual(t->model, 0., U, NULL, NULL, PETSC_FALSE, F));
  for (PetscInt c = 0; c < 3; c++) {
    PetscCall(VecStrideNorm(F, c, NORM_1, &norm));
    PetscCall(VecStrideSum(F, c, &total));
    SB_CHECK(PetscAbsReal(total) < 1e-12 * norm,
             "%s: internal forces along %" PetscInt_FMT " sum to %g of %g", what, c, total, norm);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lumped mass of all nodes, and the force of unit acceleration with the mass of the scene. */
static PetscErrorCode total_mass(TestScene *t, const char *what, Vec A, Vec F)
{
  const SbSpace s = t->model->space;
  const PetscReal exact = 10. * 0.2 + 7. * 0.06;
  PetscReal sum = 0.;
  PetscReal force;
  SbStage stage = {.shift_k = 1.};
  PetscScalar *f;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    sum += s->node_mass[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(sum, exact, 1e-13 * exact, what);
  PetscCall(VecSet(A, 1.));
  PetscCall(VecZeroEntries(F));
  PetscCall(SbSpaceGetLocalRead(s, A, &stage.a));
  PetscCall(SbSpaceGetLocalWrite(s, F, &f));
  SbSpaceAddInertia(s, &stage, f);
  PetscCall(SbSpaceRestoreLocalWrite(s, F, &f));
  PetscCall(SbSpaceRestoreLocalRead(s, A, &stage.a));
  PetscCall(VecStrideSum(F, 1, &force));
  SB_CHECK_NEAR(force, exact, 1e-13 * exact, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode one_scene(const char *law, const char *mass, const char *extra,
                                PetscBool exact)
{
  TestScene t;
  char text[2048];
  Vec U, V, W, Y[3];
  PetscReal norm, diff;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, scene_text, law, law, mass, extra));
  PetscCall(SbSpaceCreateVec(t.model->space, &U));
  PetscCall(SbSpaceCreateVec(t.model->space, &V));
  PetscCall(SbSpaceCreateVec(t.model->space, &W));
  PetscCall(test_fill(t.model, wave, U));
  PetscCall(test_fill(t.model, shear, V));
  PetscCall(test_fill(t.model, shear, W));
  for (int k = 0; k < 3; k++)
    PetscCall(SbSpaceCreateVec(t.model->space, &Y[k]));
  PetscCall(storage(&t, SB_MATRIX_BAIJ, U, V, W, Y[0]));
  PetscCall(storage(&t, SB_MATRIX_AIJ, U, V, W, Y[1]));
  PetscCall(VecNorm(Y[0], NORM_2, &norm));

  /* partition-independent vectors: the norm is the same on any number of ranks */
  test_print("%s %s %s: |J w| = %.12g\n", law, mass, extra, norm);
  PetscCall(VecAXPY(Y[1], -1., Y[0]));
  PetscCall(VecNorm(Y[1], NORM_2, &diff));
  SB_CHECK(norm > 0. && diff < 1e-13 * norm, "%s: AIJ and BAIJ differ by %g of %g", law, diff,
           norm);
  if (test_size == 1) {
    PetscCall(storage(&t, SB_MATRIX_SBAIJ, U, V, W, Y[2]));
    PetscCall(VecAXPY(Y[2], -1., Y[0]));
    PetscCall(VecNorm(Y[2], NORM_2, &diff));
    SB_CHECK(diff < 1e-13 * norm, "%s: SBAIJ and BAIJ differ by %g of %g", law, diff, norm);
  }
  PetscCall(taylor(&t, exact, U, V, W));

  /* at zero velocity the tangent of damping is complete too: it omits only the dependence of
     damping on the displacement */
  PetscCall(VecZeroEntries(V));
  PetscCall(taylor(&t, strcmp(law, "corotated") || strstr(extra, "exact"), U, V, W));
  PetscCall(PetscSNPrintf(text, sizeof(text), "%s, %s mass %s", law, mass, extra));
  PetscCall(energy_slope(&t, text, U, W));
  PetscCall(symmetry(&t, text, U, V, W));
  PetscCall(balance(&t, text, U, Y[0]));
  PetscCall(total_mass(&t, text, Y[1], Y[0]));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&W));
  for (int k = 0; k < 3; k++)
    PetscCall(VecDestroy(&Y[k]));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each element with each material, beside a body of P1 or of the other element. `exact`: the
   tangent is complete. */
static PetscErrorCode one_element(const char *a, const char *b)
{
  const char *const exact = " -body_a_tangent exact -body_b_tangent exact -effect_damping_beta 0";
  char bodies[256], text[512];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(bodies, sizeof(bodies), "-body_a_element %s -body_b_element %s", a, b));
  PetscCall(one_scene("linear", "lumped", bodies, PETSC_TRUE));
  PetscCall(one_scene("linear", "consistent", bodies, PETSC_TRUE));
  PetscCall(one_scene("corotated", "lumped", bodies, PETSC_FALSE));
  PetscCall(PetscSNPrintf(text, sizeof(text), "%s%s", bodies, exact));
  PetscCall(one_scene("corotated", "lumped", text, PETSC_TRUE));
  PetscCall(one_scene("stvk", "consistent", text, PETSC_TRUE));
  PetscCall(one_scene("stable_neohookean", "lumped", text, PETSC_TRUE));

  /* beta K v: the tangent omits dK/du, so the exact check runs without damping */
  PetscCall(
    PetscSNPrintf(text, sizeof(text), "%s -body_a_tangent exact -body_b_tangent exact", bodies));
  PetscCall(one_scene("corotated", "lumped", text, PETSC_FALSE));
  PetscCall(one_scene("stable_neohookean", "lumped", text, PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(one_element("p1", "p1"));
  PetscCall(one_element("cr", "p1"));
  PetscCall(one_element("dg", "cr"));
  PetscCall(one_element("p1", "dg"));
  PetscCall(one_element("p2", "p1"));
  SB_TEST_END();
}
