// @ranks 1 2 3
/*
  Nodes constrained along directions of their own: the projected tangent is symmetric and positive, a solve keeps n . u, the
  force that it takes is the residual's, axes as directions do what a support does, and no partition changes it.
*/
#include "../scene.h"

#define SCENE                                                                                             \
  "-bodies a -body_a_mesh box:1,0.5,0.4:3 -body_a_material linear -body_a_young 1e3 -body_a_poisson 0.3 " \
  "-body_a_density 10 -effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin -time static "

static const PetscReal nonsymmetric[3] = {0.36, 0.48, 0.8};

static void wave(const PetscReal x[3], PetscReal v[3])
{
  v[0] = 0.01 * (PetscSinReal(3. * x[0] + x[1]) + x[2]);
  v[1] = 0.01 * (PetscCosReal(2. * x[1] - x[2]));
  v[2] = 0.01 * (PetscSinReal(x[0] + 4. * x[2]) - 0.3);
}

static PetscBool at_end(SbSpace s, PetscInt node)
{
  return (PetscBool)(s->node_x[3 * node] > 1 - 1e-9);
}

/* Nodes at x = 1 along n, on each rank those that it owns. */
static PetscErrorCode hold_end(SbSpace s, const PetscReal n[3], PetscReal value)
{
  PetscFunctionBeginUser;
  SbSpaceClearNodalConstraints(s);
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (at_end(s, i))
      SB_CHECK(SbSpaceAddNodalConstraint(s, i, n, value) == 0, "the first direction of node %d", (int)i);
  }
  PetscCall(SbSpaceAssembleNodalConstraints(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fill(Vec x, unsigned state)
{
  PetscScalar *v;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArray(x, &v));
  for (PetscInt i = 0; i < n; i++) {
    state = state * 1664525u + 1013904223u;
    v[i] = (PetscScalar)(state >> 8) / (1 << 24) - 0.5;
  }
  PetscCall(VecRestoreArray(x, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y.A x = x.A y, x.A x > 0, and A keeps the directions: n.(A x) = s n.x with one s > 0 at a node. */
static PetscErrorCode check_matrix(TestScene *t, const char *what)
{
  SbSpace s = t->model->space;
  PetscScalar xAy, yAx, xAx, *v;
  Vec x, y, z;

  PetscFunctionBeginUser;
  PetscCall(SbModelTangent(t->model, 1, 0, 0, 1, t->run->U, NULL, t->run->J));
  PetscCall(VecDuplicate(t->run->U, &x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecDuplicate(x, &z));
  PetscCall(fill(x, 1));
  PetscCall(fill(y, 2));
  PetscCall(MatMult(t->run->J, x, z));
  PetscCall(VecDot(y, z, &yAx));
  PetscCall(VecDot(x, z, &xAx));
  PetscCall(MatMult(t->run->J, y, z));
  PetscCall(VecDot(x, z, &xAy));
  SB_CHECK(xAx > 0, "%s: not positive", what);
  SB_CHECK(PetscAbsReal(xAy - yAx) <= 1e-12 * PetscAbsReal(xAx), "%s: x.A y = %.16g, y.A x = %.16g", what,
           (double)xAy, (double)yAx);
  /* what is free at constrained nodes makes no force along the directions */
  PetscCall(VecGetArray(x, &v));
  SbNodalConstraintsProject(s, v);
  PetscCall(VecRestoreArray(x, &v));
  PetscCall(MatMult(t->run->J, x, z));
  PetscCall(VecGetArray(z, &v));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (at_end(s, i)) SB_CHECK_NEAR(SbDot3(v + 3 * i, nonsymmetric), 0, 1e-10, what);
  }
  PetscCall(VecRestoreArray(z, &v));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_oblique(const char *element, const char *solver)
{
  TestScene t;
  char text[1024];
  PetscReal total[2] = {0, 0};
  const PetscReal *u, *r;
  SbSpace s;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), SCENE "-ksp_rtol 1e-12 -body_a_element %s -solver %s", element,
                          solver));
  PetscCall(test_scene_open(text, &t));
  s = t.model->space;
  SB_CHECK(!s->nodal, "a scene that holds nothing has no memory for it");
  PetscCall(SbSpaceCreateNodalConstraints(s));
  PetscCall(test_fill(t.model, wave, t.run->U));
  PetscCall(hold_end(s, nonsymmetric, 0.02));
  PetscCall(check_matrix(&t, solver));
  PetscCall(VecZeroEntries(t.run->U));
  t.model->load = 1;
  PetscCall(SbModelPrescribe(t.model, 1, t.run->U));
  PetscCall(SNESSolve(t.run->snes, NULL, t.run->U));
  PetscCall(VecDuplicate(t.run->U, &R));
  PetscCall(SbModelResidual(t.model, 1, t.run->U, NULL, NULL, PETSC_FALSE, R));
  PetscCall(VecGetArrayRead(t.run->U, &u));
  PetscCall(VecGetArrayRead(R, &r));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (at_end(s, i)) {
      const PetscReal force = SbSpaceGetNodalConstraintForce(s, i, 0, r + 3 * i);

      SB_CHECK_NEAR(SbDot3(u + 3 * i, nonsymmetric), 0.02, 1e-14, "n.u");
      for (int k = 0; k < 3; k++)
        SB_CHECK_NEAR(r[3 * i + k], force * nonsymmetric[k], 1e-7, "the residual is along n");
      total[0] += force * nonsymmetric[2];
    }
    if (s->node_x[3 * i] < 1e-9) total[0] += r[3 * i + 2];
  }
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscCall(VecRestoreArrayRead(t.run->U, &u));
  PetscCallMPI(MPI_Allreduce(&total[0], &total[1], 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  /* supports of DG carry their force elsewhere; then only the directions count */
  if (!s->dirichlet_node) SB_CHECK_NEAR(total[1], 10 * 0.2 * 9.81, 1e-6, "both ends carry the weight");
  PetscCall(VecDestroy(&R));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Constrained along x and y one after the other, not orthogonal: as by a support of x and y. */
static PetscErrorCode check_axes(const char *element)
{
  const PetscReal x[3] = {1, 0, 0}, skew[3] = {0.6, 0.8, 0}, z[3] = {0, 0, 1};
  TestScene t, other;
  PetscReal difference, size;
  char text[1024];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          SCENE "-ksp_rtol 1e-12 -body_a_element %s -effects gravity,clamp,end "
                                "-effect_end_type fixed -effect_end_on xmax -effect_end_components xy",
                          element));
  PetscCall(test_scene_open(text, &other));
  PetscCall(SbRunSolve(other.run));
  /* the choice of auto may be a solver that cannot hold nodes: it comes before they are */
  PetscCall(PetscSNPrintf(text, sizeof(text), SCENE "-ksp_rtol 1e-12 -solver cg_two_level -body_a_element %s",
                          element));
  PetscCall(test_scene_open(text, &t));
  PetscCall(SbSpaceCreateNodalConstraints(t.model->space));
  SbSpaceClearNodalConstraints(t.model->space);
  for (PetscInt i = 0; i < t.model->space->nnode_owned; i++) {
    if (at_end(t.model->space, i)) {
      SB_CHECK(SbSpaceAddNodalConstraint(t.model->space, i, x, 0) == 0, "first");
      SB_CHECK(SbSpaceAddNodalConstraint(t.model->space, i, skew, 0) == 1, "second");
      SB_CHECK(SbSpaceAddNodalConstraint(t.model->space, i, x, 3) == -1,
               "a direction that is constrained already");
    } else if (t.model->space->fixed[i] == 7)
      SB_CHECK(SbSpaceAddNodalConstraint(t.model->space, i, z, 3) == -1, "a node that a support holds");
  }
  PetscCall(SbSpaceAssembleNodalConstraints(t.model->space));
  PetscCall(SbRunSolve(t.run));
  PetscCall(VecNorm(t.run->U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(t.run->U, -1., other.run->U));
  PetscCall(VecNorm(t.run->U, NORM_INFINITY, &difference));
  SB_CHECK(size > 1e-4 && difference < 1e-8 * size, "%s: support and directions differ by %g of %g", element,
           (double)difference, (double)size);
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_close(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_oblique("p1", "cg_icc")); /* SBAIJ on one rank */
  PetscCall(check_oblique("p1", "cg_gamg"));
  PetscCall(check_oblique("p1", "rotated"));
  PetscCall(check_oblique("cr", "cg_two_level"));
  PetscCall(check_oblique("dg", "cg_jacobi"));
  PetscCall(check_axes("p1"));
  PetscCall(check_oblique("p2", "cg_two_level"));
  PetscCall(check_axes("cr"));
  PetscCall(check_axes("p2"));
  SB_TEST_END();
}
