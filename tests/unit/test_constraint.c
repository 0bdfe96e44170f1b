// @ranks 1 2 3 4
/*
  Constraints of single nodes, projected in the matrix and outside it: a solve preserves n . u, the
  constraint force is the residual along the normals, directions act like supports, a body on
  constraints or stiff springs only equals the body on a support, with every solver and by a
  factorisation, which also counts negative eigenvalues.
*/
#include <sbsolver.h>
#include "../scene.h"

#define SCENE                                                                         \
  "-bodies a -body_a_mesh box:1,0.5,0.4:3 -body_a_material linear -body_a_young 1e3 " \
  "-body_a_poisson 0.3 "                                                              \
  "-body_a_density 10 -ksp_rtol 1e-12 -time static "
#define CLAMP "-effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin "
#define FREE "-effects gravity "
#define WEIGHT (10 * 0.2 * 9.81)

typedef enum {
  PROJECTED,
  BESIDE,
  FACTORED
} How;

static const PetscReal oblique[3] = {0.36, 0.48, 0.8};

static PetscErrorCode open_scene(const char *options, const char *element, const char *solver,
                                 How how, PetscBool nonsymmetric, TestScene *t)
{
  char text[1024];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), SCENE "%s -body_a_element %s -solver %s", options,
                          element, solver));
  *t = (TestScene){0};
  PetscCall(test_options(text));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &t->model));
  PetscCall(test_scene_run(t));
  t->run->solve.saddle = (PetscBool)(how == FACTORED);
  t->run->solve.saddle_choice = how == FACTORED ? 1 : 0;
  PetscCall(SbModelSetUp(t->model));
  SB_CHECK(!t->model->space->constraints, "a scene that constrains nothing has no memory for it");
  PetscCall(SbSpaceCreateConstraints(t->model->space, (PetscBool)(how != PROJECTED), nonsymmetric));
  PetscCall(SbRunSetUp(t->run));
  SbSpaceClearConstraints(t->model->space);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool at_end(SbSpace s, PetscInt node, PetscReal x)
{
  return (PetscBool)(PetscAbsReal(s->node_x[3 * node] - x) < 1e-9);
}

/* Constraint n . u = value at a node; stiffness < 0: exact. */
static PetscErrorCode add(SbSpace s, PetscInt node, const PetscReal n[3], const PetscReal push[3],
                          PetscReal value, PetscReal stiffness, PetscInt *number)
{
  SbConstraint c = {
    .node = node, .value = value, .spring = (PetscBool)(stiffness >= 0), .stiffness = stiffness};

  PetscFunctionBeginUser;
  PetscCall(PetscArraycpy(c.n, n, 3));
  PetscCall(PetscArraycpy(c.push, push, 3));
  PetscCall(SbSpaceAddConstraint(s, &c, number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fill(Vec x, unsigned state)
{
  PetscScalar *v;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArray(x, &v));
  for (PetscInt i = 0; i < n; i++)
    v[i] = 0.5 * test_random(&state);
  PetscCall(VecRestoreArray(x, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y.A x = x.A y and x.A x > 0 for free unknowns, and A x has no force along the constrained
   directions. */
static PetscErrorCode check_operator(TestScene *t, const char *what)
{
  SbSpace s = t->model->space;
  PetscScalar xAy, yAx, xAx, *v;
  Vec x, y, z;

  PetscFunctionBeginUser;
  PetscCall(SbModelTangent(t->model, 1, 0, 0, 1, t->run->state.U, NULL, t->run->solve.J));
  PetscCall(VecDuplicate(t->run->state.U, &x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecDuplicate(x, &z));
  PetscCall(fill(x, 1));
  PetscCall(fill(y, 2));
  PetscCall(SbSpaceProjectAdmissible(s, x));
  PetscCall(SbSpaceProjectAdmissible(s, y));
  PetscCall(MatMult(t->run->solve.system, y, z));
  PetscCall(VecDot(x, z, &xAy));
  PetscCall(MatMult(t->run->solve.system, x, z));
  PetscCall(VecDot(y, z, &yAx));
  PetscCall(VecDot(x, z, &xAx));
  SB_CHECK(xAx > 0, "%s: not positive", what);
  SB_CHECK(PetscAbsReal(xAy - yAx) <= 1e-12 * PetscAbsReal(xAx), "%s: x.A y = %.16g, y.A x = %.16g",
           what, xAy, yAx);
  PetscCall(VecGetArray(z, &v));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    if (at_end(s, i, 1))
      SB_CHECK_NEAR(SbDot3(v + 3 * i, oblique), 0, 1e-10, what);
  PetscCall(VecRestoreArray(z, &v));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* End of a clamped bar constrained along an oblique direction, and loaded along it or, mu > 0, as
   in sliding friction. */
static PetscErrorCode check_oblique(const char *element, const char *solver, How how, PetscReal mu)
{
  const PetscReal push[3] = {oblique[0] + mu * 0.8, oblique[1] - mu * 0.6, oblique[2]};
  PetscReal total[2] = {0, 0};
  const PetscReal *u, *r;
  PetscInt number;
  TestScene t;
  KSP ksp;
  SbSpace s;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(open_scene(CLAMP, element, solver, how, (PetscBool)(mu > 0), &t));
  s = t.model->space;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (!at_end(s, i, 1))
      continue;
    PetscCall(add(s, i, oblique, push, 0.02, -1, &number));
    SB_CHECK(number >= 0, "the first direction of node %d", (int)i);
  }
  PetscCall(SbSpaceAssembleConstraints(s));
  SB_CHECK(SbSpaceIsConstrained(s) && s->constraints->tilted == (mu > 0), "there are constraints");
  if (mu <= 0)
    PetscCall(check_operator(&t, solver));
  PetscCall(VecZeroEntries(t.run->state.U));
  PetscCall(SNESGetKSP(t.run->solve.snes, &ksp));
  PetscCall(SbSolverUpdateSymmetry(ksp, s));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->clock.stop_reason[0], "%s: %s", solver, t.run->clock.stop_reason);

  /* displacement of the end, and its constraint force */
  PetscCall(VecDuplicate(t.run->state.U, &R));
  PetscCall(SbModelResidual(t.model, 1, t.run->state.U, NULL, NULL, PETSC_FALSE, R));
  PetscCall(SbSpaceGetLocalRead(s, t.run->state.U, &u));
  PetscCall(VecGetArrayRead(R, &r));
  SbConstraintsComputeForces(s, u, r);
  for (PetscInt k = 0; k < s->constraints->n; k++) {
    const SbConstraint *c = SbSpaceGetConstraint(s, k);

    SB_CHECK_NEAR(SbDot3(u + 3 * c->node, oblique), 0.02, 1e-14, "n.u");
    SB_CHECK_NEAR(c->sum, 0.02, 1e-14, "its sum");
    for (int i = 0; i < 3; i++)
      SB_CHECK_NEAR(r[3 * c->node + i], c->force * push[i], 1e-7,
                    "the residual is along what pushes");
    total[0] += c->force * push[2];
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    if (at_end(s, i, 0))
      total[0] += r[3 * i + 2];
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscCall(SbSpaceRestoreLocalRead(s, t.run->state.U, &u));
  PetscCallMPI(MPI_Allreduce(&total[0], &total[1], 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));

  /* supports of DG carry their force elsewhere; then only the directions count */
  if (!s->dirichlet_node)
    SB_CHECK_NEAR(total[1], WEIGHT, 1e-6, "both ends carry the weight");
  PetscCall(VecDestroy(&R));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode compare(const TestScene *t, const TestScene *other, PetscReal tolerance,
                              const char *what)
{
  PetscReal size, difference;

  PetscFunctionBeginUser;
  PetscCall(VecNorm(other->run->state.U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(t->run->state.U, -1., other->run->state.U));
  PetscCall(VecNorm(t->run->state.U, NORM_INFINITY, &difference));
  SB_CHECK(size > 1e-4 && difference < tolerance * size, "%s: differs by %g of %g", what,
           difference, size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Constraints along x and y, added one after the other and not orthogonal: equal to a support of x
   and y. */
static PetscErrorCode check_axes(const char *element, How how)
{
  const PetscReal x[3] = {1, 0, 0};
  const PetscReal skew[3] = {0.6, 0.8, 0};
  const PetscReal z[3] = {0, 0, 1};
  TestScene t, other;
  PetscInt number;

  PetscFunctionBeginUser;
  PetscCall(test_open(&other,
                      SCENE CLAMP
                      "-body_a_element %s -effects gravity,clamp,end "
                      "-effect_end_type fixed -effect_end_on xmax -effect_end_components xy",
                      element));
  PetscCall(SbRunSolve(other.run));
  PetscCall(open_scene(CLAMP, element, "cg_two_level", how, PETSC_FALSE, &t));
  for (PetscInt i = 0; i < t.model->space->nnode_owned; i++) {
    if (at_end(t.model->space, i, 1)) {
      PetscCall(add(t.model->space, i, x, x, 0, -1, &number));
      SB_CHECK(number >= 0, "first");
      PetscCall(add(t.model->space, i, skew, skew, 0, -1, &number));
      SB_CHECK(number >= 0, "second");
      PetscCall(add(t.model->space, i, x, x, 3, -1, &number));
      SB_CHECK(number == -1, "a direction that is constrained already");
    } else if (t.model->space->fixed[i] == 7) {
      PetscCall(add(t.model->space, i, z, z, 3, -1, &number));
      SB_CHECK(number == -1, "a node that a support holds");
    }
  }
  PetscCall(SbSpaceAssembleConstraints(t.model->space));
  PetscCall(SbRunSolve(t.run));
  PetscCall(compare(&t, &other, 1e-8, element));
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_close(&other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body that only constraints support: exact ones or, stiffness >= 0, springs; negative: the
   negative eigenvalues are counted. */
static PetscErrorCode check_carried(const char *solver, How how, PetscReal stiffness, PetscInt most,
                                    PetscBool negative, const TestScene *clamped)
{
  PetscInt number, count;
  TestScene t;
  KSP ksp;
  PC pc;
  Vec z;

  PetscFunctionBeginUser;
  PetscCall(open_scene(FREE, "p1", solver, how, PETSC_FALSE, &t));
  for (PetscInt i = 0; i < t.model->space->nnode_owned; i++) {
    for (int k = 0; k < 3 && at_end(t.model->space, i, 0); k++) {
      const PetscReal n[3] = {k == 0, k == 1, k == 2};

      PetscCall(add(t.model->space, i, n, n, 0, stiffness, &number));
    }
  }
  PetscCall(SbSpaceAssembleConstraints(t.model->space));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->clock.stop_reason[0], "%s: %s", solver, t.run->clock.stop_reason);
  SB_CHECK(t.run->counters.linear < most, "%s: %d iterations", solver, (int)t.run->counters.linear);
  SB_CHECK(!t.model->space->constraints->added == (how != BESIDE), "%s: anchors", solver);

  /* K has no negative eigenvalue in the null space of the constraints; all of -K are negative */
  if (negative) {
    PetscCall(SbSolverCountNegativeEigenvalues(t.run->solve.snes, t.model->space, &count));
    SB_CHECK(count == 0, "%" PetscInt_FMT " negative eigenvalues", count);
    PetscCall(MatScale(t.run->solve.J, -1.));
    PetscCall(SNESGetKSP(t.run->solve.snes, &ksp));
    PetscCall(KSPGetPC(ksp, &pc));
    PetscCall(VecDuplicate(t.run->state.U, &z));
    PetscCall(PCSetUp(pc));
    PetscCall(PCApply(pc, t.run->state.U, z));
    PetscCall(VecDestroy(&z));
    PetscCall(SbSolverCountNegativeEigenvalues(t.run->solve.snes, t.model->space, &count));
    SB_CHECK(count == 3 * t.model->space->Nnode - t.model->space->constraints->nexact,
             "%" PetscInt_FMT " negative eigenvalues", count);
  }
  PetscCall(
    compare(&t, clamped, stiffness < 0 ? 1e-8 : 1e-4, solver)); /* springs have an error of 1/k */
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const packages[] = {"cholmod", "umfpack", "mumps"};
  TestScene clamped;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_oblique("p1", "cg_icc", PROJECTED, 0)); /* SBAIJ on one rank */
  PetscCall(check_oblique("p1", "cg_gamg", PROJECTED, 0));
  PetscCall(check_oblique("p1", "rotated", PROJECTED, 0));
  PetscCall(check_oblique("cr", "cg_two_level", PROJECTED, 0));
  PetscCall(check_oblique("dg", "cg_jacobi", PROJECTED, 0));
  PetscCall(check_oblique("p2", "cg_two_level", PROJECTED, 0));
  PetscCall(check_oblique("p1", "cg_icc", BESIDE, 0));
  PetscCall(check_oblique("p1", "cg_icc", BESIDE, 0.4));
  PetscCall(check_oblique("cr", "cg_two_level", BESIDE, 0.4));
  PetscCall(check_oblique("p1", "cg_icc", FACTORED, 0));
  PetscCall(check_oblique("cr", "cg_two_level", FACTORED, 0.4));
  PetscCall(check_axes("p1", PROJECTED));
  PetscCall(check_axes("cr", PROJECTED));
  PetscCall(check_axes("p2", PROJECTED));
  PetscCall(check_axes("p1", BESIDE));
  PetscCall(check_axes("cr", FACTORED));

  PetscCall(test_scene_open(SCENE CLAMP "-solver direct", &clamped));
  PetscCall(SbRunSolve(clamped.run));
  PetscCall(check_carried("cg_icc", PROJECTED, -1, 120, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_pbjacobi", BESIDE, -1, 120, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_icc", BESIDE, -1, 120, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_two_level", BESIDE, -1, 120, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_gamg", BESIDE, -1, 120, PETSC_FALSE, &clamped));
  PetscCall(check_carried("gauss_seidel", BESIDE, -1, 20000, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_icc", FACTORED, -1, 5, PETSC_FALSE, &clamped));
  PetscCall(check_carried("direct", FACTORED, -1, 5, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_gamg", FACTORED, -1, 5, PETSC_FALSE, &clamped));
  PetscCall(check_carried("cg_icc", BESIDE, 1e9, 2000, PETSC_FALSE, &clamped));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(packages); k++) {
    PetscBool has;

    PetscCall(SbHasPackage(packages[k], &has));
    if (!has)
      continue;
    PetscCall(check_carried(packages[k], BESIDE, -1, 120, PETSC_FALSE, &clamped));
    if (!strcmp(packages[k], "mumps"))
      PetscCall(check_carried("cg_icc", FACTORED, -1, 5, PETSC_TRUE, &clamped));
  }
  PetscCall(test_scene_close(&clamped));
  SB_TEST_END();
}
