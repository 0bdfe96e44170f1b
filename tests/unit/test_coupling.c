/*
  Couplings: a spring between two nodes of different bodies that share no cell. On any number of
  ranks, for each element: the tangent with its blocks against finite differences of the residual,
  an equilibrium by the program's solver, the two forces opposite and equal, the same on one rank.
  Without couplings the space has nothing of them.
*/
// @ranks 1 3
#include "../scene.h"

#define STIFFNESS 300.0 /* N/m; the natural length is 1 m, and the nodes are farther apart */

/* The nodes at two corners, opposite each other but for a shift. */
static const PetscReal corner[2][3] = {{1., 1., 1.}, {3., 0., 1.}};
static const char spring[] = ",pull -effect_pull_type spring -effect_pull_points a:1,1,1;b:3,0,1 "
                             "-effect_pull_stiffness 300 -effect_pull_length 1";

/* From the one over a pulley of the ground to the other, and back. */
static const char cable[] =
  ",pull -effect_pull_type cable -effect_pull_points "
  "a:0.9,0.7,0.6;ground:2,0.5,2;b:3.1,0.2,0.9;a:0.6,1,0.4 -effect_pull_stiffness 300 "
  "-effect_pull_tension 20";

/* ------------------------------------------------------------------ the scene */

static const char bodies[] =
  "-bodies a,b -body_a_mesh box:1,1,1:2 -body_b_mesh box:1,1,1:2 -body_b_translate 3,0,0 "
  "-body_a_material stable_neohookean -body_b_material stable_neohookean -body_a_young 1e4 "
  "-body_b_young 2e4 "
  "-body_a_poisson 0.3 -body_b_poisson 0.3 -body_a_density 1000 -body_b_density 1000 "
  "-effect_left_type fixed -effect_left_on a.xmin -effect_right_type fixed -effect_right_on b.xmax "
  "-time static -static_steps 2 -validate yes ";

static PetscErrorCode open_scene(MPI_Comm comm, const char *element, const char *effects,
                                 TestScene *t)
{
  char options[TEST_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(options, sizeof(options),
                          "%s -body_a_element %s -body_b_element %s -effects left,right%s", bodies,
                          element, element, effects));
  PetscCall(test_scene_open_on(comm, NULL, options, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A x against the difference quotient of the residual. */
static PetscErrorCode check_tangent(SbModel m, const char *element)
{
  const SbSpace s = m->space;
  const PetscReal h = 1e-6;
  PetscReal error, size;
  PetscScalar *x;
  PetscRandom random;
  Vec U, X, Y, F[2];
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateMatrix(s, s->size == 1 ? SB_MATRIX_SBAIJ : SB_MATRIX_AIJ, &A));
  PetscCall(SbSpaceCreateVec(s, &U));
  PetscCall(VecDuplicate(U, &X));
  PetscCall(VecDuplicate(U, &Y));
  PetscCall(VecDuplicate(U, &F[0]));
  PetscCall(VecDuplicate(U, &F[1]));
  PetscCall(PetscRandomCreate(s->comm, &random));
  PetscCall(PetscRandomSetInterval(random, -1., 1.));
  PetscCall(VecSetRandom(U, random));
  PetscCall(VecScale(U, 0.02));

  /* a direction along which the two nodes move most */
  PetscCall(VecSetRandom(X, random));
  PetscCall(VecScale(X, 0.01));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    for (int k = 0; k < 2; k++)
      if (SbDistance2(s->node_x + 3 * i, corner[k]) < 0.15)
        for (int j = 0; j < 3; j++)
          x[3 * i + j] += 1. - k + 0.3 * j;
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, X));
  PetscCall(SbSpaceZeroPrescribed(s, PETSC_TRUE, U));

  PetscCall(SbModelTangent(m, 1., 0., 0., 1., U, NULL, A));
  PetscCall(MatMult(A, X, Y));
  for (int k = 0; k < 2; k++) {
    PetscCall(VecAXPY(U, k ? -2. * h : h, X));
    PetscCall(SbModelResidual(m, 1., U, NULL, NULL, PETSC_TRUE, F[k]));
  }
  PetscCall(VecAXPBY(F[0], -0.5 / h, 0.5 / h, F[1]));
  PetscCall(VecNorm(Y, NORM_2, &size));
  PetscCall(VecAXPY(F[0], -1., Y));
  PetscCall(VecNorm(F[0], NORM_2, &error));
  SB_CHECK(error <= 1e-6 * size, "%s: the tangent is off by %g of itself", element,
           (double)(error / size));
  PetscCall(PetscRandomDestroy(&random));
  for (int k = 0; k < 2; k++)
    PetscCall(VecDestroy(&F[k]));
  PetscCall(VecDestroy(&Y));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&U));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves, and checks the equilibrium; force[3] on the first node, N. */
static PetscErrorCode solve(TestScene *t, const char *element, PetscReal force[3])
{
  const SbModel m = t->model;
  const SbSpace s = m->space;
  SbStage stage = {.t = 1., .shift_k = 1.};
  PetscReal sum[12] = {0.};
  PetscReal norm, size;
  PetscReal *f;
  const PetscScalar *r;
  Vec F;

  PetscFunctionBeginUser;
  PetscCall(SbRunSolve(t->run));
  SB_CHECK(!t->run->clock.stop_reason[0], "%s: %s", element, t->run->clock.stop_reason);

  /* the two forces: opposite and equal, without a moment */
  PetscCall(PetscCalloc1(3 * s->nnode, &f));
  PetscCall(SbSpaceGetLocalRead(s, t->run->state.U, &stage.u));
  for (PetscInt e = 0; e < m->neffect; e++)
    if (m->effect[e]->ops.couplings)
      PetscCall((*m->effect[e]->ops.force)(m->effect[e], s, &stage, f));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal x[3], moment[3];

    for (int k = 0; k < 3; k++)
      x[k] = s->node_x[3 * i + k] + stage.u[3 * i + k];
    SbCross(x, f + 3 * i, moment);
    for (int k = 0; k < 3; k++) {
      sum[3 * s->node_body[i] + k] += f[3 * i + k];
      sum[6 + k] += moment[k];
    }
  }
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->state.U, &stage.u));
  PetscCall(PetscFree(f));

  /* supports react with the same forces; all else is in equilibrium */
  PetscCall(VecDuplicate(t->run->state.U, &F));
  PetscCall(SbModelResidual(m, 1., t->run->state.U, NULL, NULL, PETSC_FALSE, F));
  PetscCall(VecGetArrayRead(F, &r));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    if (s->node_body[i / 3] == 0 && s->fixed[i / 3])
      sum[9 + i % 3] += r[i];
  PetscCall(VecRestoreArrayRead(F, &r));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 12, MPIU_REAL, MPI_SUM, s->comm));
  PetscCall(SbModelResidual(m, 1., t->run->state.U, NULL, NULL, PETSC_TRUE, F));
  PetscCall(VecNorm(F, NORM_2, &norm));
  PetscCall(VecDestroy(&F));
  size = PetscSqrtReal(SbDot3(sum, sum));
  SB_CHECK(size > 100., "%s: the spring pulls with %g N only", element, (double)size);
  SB_CHECK(norm < 1e-6 * size, "%s: the residual is %g N, the force %g N", element, (double)norm,
           (double)size);
  for (int k = 0; k < 3; k++) {
    SB_CHECK(PetscAbsReal(sum[k] + sum[3 + k]) < 1e-12 * size, "%s: force %g N, reaction %g N",
             element, (double)sum[k], (double)sum[3 + k]);
    SB_CHECK(PetscAbsReal(sum[6 + k]) < 1e-11 * size, "%s: a moment of %g N m", element,
             (double)sum[6 + k]);
    SB_CHECK(PetscAbsReal(sum[k] + sum[9 + k]) < 1e-6 * size, "%s: spring %g N, support %g N",
             element, (double)sum[k], (double)sum[9 + k]);
    force[k] = sum[k];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  TestScene t;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(open_scene(PETSC_COMM_WORLD, "p1", "", &t));
  SB_CHECK(!t.model->space->couplings.n && !t.model->space->coupled &&
             t.model->space->nnode == t.model->space->nnode_cell && !t.model->space->plan->coupling,
           "a scene without couplings has nothing of them");
  PetscCall(test_scene_close(&t));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(elements); k++) {
    PetscReal force[3], alone[3];

    PetscCall(open_scene(PETSC_COMM_WORLD, elements[k], cable, &t));
    PetscCall(check_tangent(t.model, elements[k]));
    PetscCall(test_scene_close(&t));
    PetscCall(open_scene(PETSC_COMM_WORLD, elements[k], spring, &t));
    PetscCall(check_tangent(t.model, elements[k]));
    PetscCall(solve(&t, elements[k], force));
    PetscCall(test_scene_close(&t));
    PetscCall(open_scene(PETSC_COMM_SELF, elements[k], spring, &t));
    PetscCall(solve(&t, elements[k], alone));
    PetscCall(test_scene_close(&t));
    for (int i = 0; i < 3; i++)
      SB_CHECK(PetscAbsReal(force[i] - alone[i]) < 1e-6 * STIFFNESS,
               "%s: force %g N, on one rank %g N", elements[k], (double)force[i], (double)alone[i]);
  }
  SB_TEST_END();
}
