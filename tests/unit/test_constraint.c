// @ranks 1 2 3 4
/*
  Rows between nodes: two halves of a bar joined vertex by vertex are the whole bar, with every solver, by exact constraints and in
  the limit by springs; rows said twice change nothing; the rows' forces carry the weight of the free half; the projected
  operator is symmetric. All of it also with the multipliers as unknowns, by a factorisation (which takes the free half without
  anchors) and by iterations. What is factored for them tells how many eigenvalues are negative.
*/
#include "sbconstraint.h"
#include <sbsolver.h>
#include "../scene.h"

#define REST                                                                                             \
  "-effects gravity,clamp -effect_gravity_vector 1,2,-9.81 -effect_clamp_type fixed -effect_clamp_on f " \
  "-sets f -set_f_at plane:1,0,0,0 -time static -ksp_rtol 1e-11 "
#define WHOLE                                                                                             \
  "-bodies a -body_a_mesh box:1,0.5,0.5:2 -body_a_material linear -body_a_young 1e4 -body_a_poisson 0.3 " \
  "-body_a_density 100 " REST
#define HALVES                                                                                           \
  "-bodies a,b -body_a_mesh box:0.5,0.5,0.5:2 -body_b_mesh box:0.5,0.5,0.5:2 -body_b_translate 0.5,0,0 " \
  "-body_a_material linear -body_a_young 1e4 -body_a_poisson 0.3 -body_a_density 100 "                   \
  "-body_b_material linear -body_b_young 1e4 -body_b_poisson 0.3 -body_b_density 100 " REST

typedef struct {
  PetscReal x[3], body, gnode;
} Node;

/* The nodes at x = 1/2 on every rank. */
static PetscErrorCode gather(SbSpace s, PetscInt *n, Node **all)
{
  PetscMPIInt size, mine = 0, *count, *offset;
  Node *own;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  PetscCall(PetscMalloc3(s->nnode_owned, &own, size, &count, size, &offset));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal *x = s->node_x + 3 * i;

    if (PetscAbsReal(x[0] - 0.5) > 1e-9) continue;
    own[mine] = (Node){{x[0], x[1], x[2]}, (PetscReal)s->node_body[i], (PetscReal)s->gnode[i]};
    mine++;
  }
  mine *= 5;
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, count, 1, MPI_INT, s->comm));
  offset[0] = 0;
  for (PetscMPIInt r = 1; r < size; r++) offset[r] = offset[r - 1] + count[r - 1];
  *n = (offset[size - 1] + count[size - 1]) / 5;
  PetscCall(PetscMalloc1(*n, all));
  PetscCallMPI(MPI_Allgatherv(own, mine, MPIU_REAL, *all, count, offset, MPIU_REAL, s->comm));
  PetscCall(PetscFree3(own, count, offset));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u_b - u_a = 0 at each pair, said by the owner of b's node; `stiffness` < 0: exactly. */
static PetscErrorCode join(SbSpace s, PetscReal stiffness, PetscBool twice)
{
  PetscInt n = 0, row, joined = 0;
  Node *node;

  PetscFunctionBeginUser;
  PetscCall(gather(s, &n, &node));
  SbSpaceClearConstraints(s);
  for (PetscInt b = 0; b < n; b++) {
    if (node[b].body != 1. || node[b].gnode < (PetscReal)s->gnode_start ||
        node[b].gnode >= (PetscReal)(s->gnode_start + s->nnode_owned))
      continue;
    for (PetscInt a = 0; a < n; a++) {
      if (node[a].body != 0. || PetscAbsReal(node[a].x[1] - node[b].x[1]) > 1e-9 ||
          PetscAbsReal(node[a].x[2] - node[b].x[2]) > 1e-9)
        continue;
      for (int k = 0; k < 3; k++) {
        const PetscInt g[2] = {(PetscInt)node[b].gnode, (PetscInt)node[a].gnode};
        PetscReal coef[6] = {0};

        coef[k] = 1;
        coef[3 + k] = -1;
        for (int again = 0; again <= (int)twice; again++) {
          if (stiffness < 0)
            PetscCall(SbSpaceAddConstraint(s,
                                           6 * (int)(1e4 * node[b].x[1] + 1e2 * node[b].x[2]) + 2 * k + again,
                                           2, g, coef, NULL, 0, &row));
          else
            PetscCall(SbSpaceAddPenaltyConstraint(s, 2, g, coef, NULL, 0, stiffness, 0, &row));
        }
      }
      joined++;
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &joined, 1, MPIU_INT, MPI_SUM, s->comm));
  SB_CHECK(joined == 9, "%d pairs of nodes at the joint, not 9", (int)joined);
  PetscCall(SbSpaceAssembleConstraints(s));
  PetscCall(PetscFree(node));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode open_halves(const char *solver, SbSaddle saddle, TestScene *t)
{
  char text[2048];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), HALVES "-solver %s", solver));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  PetscCall(PetscOptionsInsertString(NULL, text));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &t->model));
  PetscCall(test_scene_run(t));
  t->run->saddle = (PetscBool)(saddle != SB_SADDLE_NONE);
  t->run->saddle_choice = (PetscInt)saddle;
  PetscCall(SbModelSetUp(t->model));
  PetscCall(SbSpaceCreateConstraints(t->model->space, PETSC_FALSE));
  PetscCall(SbRunSetUp(t->run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the rows exert in all: the weight of the free half. */
static PetscErrorCode check_force(TestScene *t, const char *what)
{
  const PetscReal weight[3] = {12.5 * 1, 12.5 * 2, -12.5 * 9.81};
  PetscReal sum[3] = {0}, force, at, most = 0;
  PetscInt n = 0;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(t->run->U, &R));
  PetscCall(SbModelResidual(t->model, 1, t->run->U, NULL, NULL, PETSC_FALSE, R));
  PetscCall(SbSpaceComputeConstraintForces(t->model->space, t->run->U, R));
  PetscCall(VecDestroy(&R));
  for (PetscInt i = 0; i < t->model->space->nnode_owned; i++)
    n += t->model->space->node_body[i] == 1 && PetscAbsReal(t->model->space->node_x[3 * i] - 0.5) < 1e-9;
  for (PetscInt row = 0; row < 3 * n; row++) {
    SbSpaceGetConstraint(t->model->space, row, &force, &at);
    sum[row % 3] += force;
    most = PetscMax(most, PetscAbsReal(at));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPI_SUM, t->model->comm));
  for (int k = 0; k < 3; k++)
    SB_CHECK(PetscAbsReal(sum[k] + weight[k]) < 1e-6 * 12.5, "%s: force %d of the joint is %.10g, not %.10g",
             what, k, (double)sum[k], (double)-weight[k]);
  SB_CHECK(most < 1e-12, "%s: the joint opens by %g m", what, (double)most);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode compare(TestScene *t, const TestScene *whole, PetscReal tolerance, const char *what)
{
  static const PetscReal at[4][3] = {{1, 0, 0}, {1, 0.5, 0.25}, {0.75, 0.25, 0.5}, {0.25, 0, 0.5}};

  PetscFunctionBeginUser;
  for (int p = 0; p < 4; p++) {
    PetscReal u[3], v[3];

    PetscCall(test_value_at(t->model, t->run->U, at[p], u));
    PetscCall(test_value_at(whole->model, whole->run->U, at[p], v));
    for (int k = 0; k < 3; k++)
      SB_CHECK(PetscAbsReal(u[k] - v[k]) < tolerance * 0.1,
               "%s: u[%d] = %.10g at point %d, the whole bar's %.10g", what, k, (double)u[k], p,
               (double)v[k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_joint(const char *solver, SbSaddle saddle, PetscInt most, const TestScene *whole)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(open_halves(solver, saddle, &t));
  PetscCall(join(t.model->space, -1, PETSC_FALSE));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->stop_reason[0], "%s: %s", solver, t.run->stop_reason);
  PetscCall(compare(&t, whole, 1e-8, solver));
  PetscCall(check_force(&t, solver));
  SB_CHECK(t.run->linear_total < most, "%s: %d iterations", solver, (int)t.run->linear_total);
  SB_CHECK(!t.model->space->constraints->added == (saddle == SB_SADDLE_DIRECT), "%s: anchors", solver);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_limits(SbSaddle saddle, const TestScene *whole)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(open_halves("cg_icc", saddle, &t));
  PetscCall(join(t.model->space, -1, PETSC_TRUE));
  PetscCall(SbRunSolve(t.run));
  PetscCall(compare(&t, whole, 1e-8, "rows said twice"));
  PetscCall(test_scene_close(&t));
  PetscCall(open_halves("cg_icc", saddle, &t));
  PetscCall(join(t.model->space, 1e9, PETSC_FALSE));
  PetscCall(SbRunSolve(t.run));
  PetscCall(compare(&t, whole, 1e-5, "springs"));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y.A x = x.A y for x, y in the null space. */
static PetscErrorCode check_operator(void)
{
  PetscScalar xAy, yAx;
  PetscRandom random;
  Vec x, y, z;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(open_halves("cg_icc", SB_SADDLE_NONE, &t));
  PetscCall(SbModelTangent(t.model, 1, 0, 0, 1, t.run->U, NULL, t.run->J));
  PetscCall(join(t.model->space, -1, PETSC_FALSE));
  PetscCall(VecDuplicate(t.run->U, &x));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecDuplicate(x, &z));
  PetscCall(PetscRandomCreate(t.model->comm, &random));
  PetscCall(VecSetRandom(x, random));
  PetscCall(VecSetRandom(y, random));
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(SbConstraintsPrescribe(t.model->space, x));
  PetscCall(SbConstraintsPrescribe(t.model->space, y));
  PetscCall(MatMult(t.run->operator, x, z));
  PetscCall(VecDot(y, z, &yAx));
  PetscCall(MatMult(t.run->operator, y, z));
  PetscCall(VecDot(x, z, &xAy));
  SB_CHECK(PetscAbsReal(xAy - yAx) <= 1e-11 * PetscAbsReal(xAy), "x.A y = %.16g, y.A x = %.16g", (double)xAy,
           (double)yAx);
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&z));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Negative eigenvalues in the null space of the rows, said once or twice: none of K, all of -K. */
static PetscErrorCode check_negative(PetscBool twice)
{
  PetscInt negative;
  TestScene t;
  KSP ksp;
  Vec z;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(open_halves("cg_icc", SB_SADDLE_DIRECT, &t));
  PetscCall(join(t.model->space, -1, twice));
  PetscCall(SbRunSolve(t.run));
  PetscCall(SbSolverCountNegativeEigenvalues(t.run->snes, t.model->space, &negative));
  SB_CHECK(negative == 0, "%" PetscInt_FMT " negative eigenvalues", negative);
  PetscCall(MatScale(t.run->J, -1.));
  PetscCall(SNESGetKSP(t.run->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(VecDuplicate(t.run->U, &z));
  PetscCall(PCSetUp(pc));
  PetscCall(PCApply(pc, t.run->U, z));
  PetscCall(VecDestroy(&z));
  PetscCall(SbSolverCountNegativeEigenvalues(t.run->snes, t.model->space, &negative));
  SB_CHECK(negative == 3 * (t.model->space->Nnode - 9), "%" PetscInt_FMT " negative eigenvalues", negative);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const packages[] = {"cholmod", "umfpack", "mumps"};
  TestScene whole;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_scene_open(WHOLE "-solver direct", &whole));
  PetscCall(SbRunSolve(whole.run));
  PetscCall(check_joint("cg_pbjacobi", SB_SADDLE_NONE, 120, &whole));
  PetscCall(check_joint("cg_icc", SB_SADDLE_NONE, 120, &whole));
  PetscCall(check_joint("cg_two_level", SB_SADDLE_NONE, 120, &whole));
  PetscCall(check_joint("cg_gamg", SB_SADDLE_NONE, 120, &whole));
  PetscCall(check_joint("cg_icc", SB_SADDLE_DIRECT, 5, &whole));
  PetscCall(check_joint("direct", SB_SADDLE_DIRECT, 5, &whole));
  PetscCall(check_joint("cg_gamg", SB_SADDLE_DIRECT, 5, &whole));
  PetscCall(check_joint("gauss_seidel", SB_SADDLE_NONE, 5000, &whole));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(packages); k++) {
    PetscBool has;

    PetscCall(SbHasPackage(packages[k], &has));
    if (!has) continue;
    PetscCall(check_joint(packages[k], SB_SADDLE_NONE, 120, &whole));
    if (strcmp(packages[k], "mumps")) continue;
    PetscCall(check_negative(PETSC_FALSE));
    PetscCall(check_negative(PETSC_TRUE));
  }
  PetscCall(check_limits(SB_SADDLE_NONE, &whole));
  PetscCall(check_limits(SB_SADDLE_DIRECT, &whole));
  PetscCall(check_operator());
  PetscCall(test_scene_close(&whole));
  SB_TEST_END();
}
