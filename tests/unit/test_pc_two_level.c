// @ranks 1 2 3
/*
  Two-level preconditioner: symmetric and positive definite; iteration counts nearly independent of
  the mesh, also on a slender bar where incomplete Cholesky alone fails; agreement with a
  factorisation, with several and supported bodies; reported failures.
*/
#include "../scene.h"
#include <sbpc.h>
#include <sbsolver.h>

#define BODY(name, mesh, more)                                              \
  "-body_" name "_mesh " mesh " -body_" name "_material linear -body_" name \
  "_young 5e4 -body_" name "_poisson 0.3 -body_" name "_density 1000 " more
#define BAR(mesh)                  \
  "-bodies bar " BODY("bar", mesh, \
                      "") "-effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin "
#define STATIC "-time static -solver cg_two_level "
#define SPREAD "-pc_coarse_gathered 0 "

#define BODIES                                                                                     \
  "-bodies bar,tet,held -sets root,foot,floor -set_root_at box:-1,-1,-1,0.001,0.5,1 -set_foot_at " \
  "box:-1,0.9,-1,0.001,1.2,1 -set_floor_at box:-1,0.9,-1,1,1.2,0.001 " BODY(                       \
    "bar", "box:0.4,0.1,0.1:3", "") BODY("tet", "box:0.1,0.1,0.1:1", "-body_tet_translate 0,1,0 ") \
    BODY("held", "box:0.1,0.1,0.1:2",                                                              \
         "-body_held_translate 0,2,0 ") "-effects gravity,clamp,whole,roll,rest "                  \
                                        "-effect_clamp_type fixed "                                \
                                        "-effect_clamp_on root "                                   \
                                        "-effect_whole_type fixed -effect_whole_on held "          \
                                        "-effect_roll_type "                                       \
                                        "fixed -effect_roll_on foot -effect_roll_components x "    \
                                        "-effect_rest_type fixed -effect_rest_on floor "           \
                                        "-effect_rest_components yz "

/* Matrix K + shift M of the scene's space at the reference state, with its own linear solver. */
typedef struct {
  TestScene scene;
  Mat A;
  Vec b, x;
  KSP ksp;
  PC pc;
} System;

static PetscErrorCode assemble(System *y, PetscReal stiffness, PetscReal shift)
{
  SbSpace s = y->scene.model->space;
  const PetscReal *u;
  Vec zero;
  SbStage stage = {0};

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &zero));
  PetscCall(SbSpaceGetLocalRead(s, zero, &u));
  stage.u = u;
  stage.shift_k = stiffness;
  stage.shift_a = shift;
  PetscCall(SbSpaceAssembleTangent(s, &stage, y->A));
  PetscCall(SbSpaceFinishTangent(s, y->A));
  PetscCall(SbSpaceRestoreLocalRead(s, zero, &u));
  PetscCall(VecDestroy(&zero));
  if (y->ksp)
    PetscCall(
      KSPSetOperators(y->ksp, y->A, y->A)); /* as SNES does: KSP examines the matrix only then */
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode system_open(const char *options, PetscReal shift, System *y)
{
  PetscScalar *b;
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &y->scene));
  y->ksp = NULL;
  s = y->scene.model->space;
  PetscCall(SbSpaceCreateMatrix(s, test_size == 1 ? SB_MATRIX_SBAIJ : SB_MATRIX_BAIJ, &y->A));
  PetscCall(assemble(y, 1., shift));
  PetscCall(SbSpaceCreateVec(s, &y->b));
  PetscCall(VecDuplicate(y->b, &y->x));
  PetscCall(VecGetArray(y->b, &b));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    b[i] = s->fixed[i / 3] & (1 << i % 3) ? 0. : (i % 3 == 2 ? -9.81 : 0.3) * s->node_mass[i / 3];
  PetscCall(VecRestoreArray(y->b, &b));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &y->ksp));
  PetscCall(KSPSetType(y->ksp, KSPCG));
  PetscCall(KSPSetNormType(y->ksp, KSP_NORM_UNPRECONDITIONED));
  PetscCall(KSPSetTolerances(y->ksp, 1e-8, 0., PETSC_DEFAULT, 5000));
  PetscCall(KSPSetOperators(y->ksp, y->A, y->A));
  PetscCall(KSPGetPC(y->ksp, &y->pc));
  PetscCall(SbPCTwoLevelCreate(s, y->pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode system_close(System *y)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&y->ksp));
  PetscCall(MatDestroy(&y->A));
  PetscCall(VecDestroy(&y->b));
  PetscCall(VecDestroy(&y->x));
  PetscCall(test_scene_close(&y->scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode true_residual(System *y, PetscReal *relative)
{
  PetscReal b;
  Vec r;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(y->b, &r));
  PetscCall(MatMult(y->A, y->x, r));
  PetscCall(VecAXPY(r, -1., y->b));
  PetscCall(VecNorm(r, NORM_2, relative));
  PetscCall(VecNorm(y->b, NORM_2, &b));
  *relative /= b;
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode iterations(const char *options, PetscInt *its)
{
  KSPConvergedReason reason;
  PetscReal residual;
  System y;

  PetscFunctionBeginUser;
  PetscCall(system_open(options, 0., &y));
  PetscCall(KSPSolve(y.ksp, y.b, y.x));
  PetscCall(KSPGetIterationNumber(y.ksp, its));
  PetscCall(KSPGetConvergedReason(y.ksp, &reason));
  PetscCall(true_residual(&y, &residual));
  SB_CHECK(reason > 0, "%s: %s", options, KSPConvergedReasons[reason]);

  /* the residual of the recurrence and the true one differ by rounding: 1e-16 times the condition
     number of the slender bar, 1e9 */
  SB_CHECK(residual < 1e-6, "%s: the true residual is %g", options, residual);
  PetscCall(system_close(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x . P^-1 y = y . P^-1 x and x . P^-1 x > 0 for random vectors, with a large component in the
   coarse space or none. */
static PetscErrorCode test_symmetry(const char *options, PetscReal shift, const char *what)
{
  PetscRandom random;
  PetscReal xx, yy;
  PetscScalar xPx, yPy, xPy, yPx;
  Vec x, y, Px, Py;
  System a;

  PetscFunctionBeginUser;
  PetscCall(system_open(options, shift, &a));
  PetscCall(KSPSetUp(a.ksp));
  PetscCall(VecDuplicate(a.b, &x));
  PetscCall(VecDuplicate(a.b, &y));
  PetscCall(VecDuplicate(a.b, &Px));
  PetscCall(VecDuplicate(a.b, &Py));
  PetscCall(PetscRandomCreate(PETSC_COMM_WORLD, &random));
  PetscCall(PetscRandomSetInterval(random, -1., 1.));
  for (int k = 0; k < 4; k++) {
    PetscCall(VecSetRandom(x, random));
    PetscCall(VecSetRandom(y, random));
    if (k % 2) { /* smooth, for the coarse space */
      PetscCall(VecShift(x, 3.));
      PetscCall(VecPointwiseMult(y, y, x));
    }
    PetscCall(PCApply(a.pc, x, Px));
    PetscCall(PCApply(a.pc, y, Py));
    PetscCall(VecDot(x, Px, &xPx));
    PetscCall(VecDot(y, Py, &yPy));
    PetscCall(VecDot(x, Py, &xPy));
    PetscCall(VecDot(y, Px, &yPx));
    PetscCall(VecNorm(x, NORM_2, &xx));
    PetscCall(VecNorm(y, NORM_2, &yy));
    SB_CHECK(xPx > 0. && yPy > 0. && xx > 0. && yy > 0., "%s: not positive definite: %g, %g", what,
             xPx, yPy);

    /* rounding of E^-1, whose condition number is below 1e5 here */
    SB_CHECK_NEAR(xPy, yPx, 1e-9 * PetscSqrtReal(xPx * yPy), what);
  }
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  PetscCall(VecDestroy(&Px));
  PetscCall(VecDestroy(&Py));
  PetscCall(system_close(&a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Set-ups of preconditioners so far. */
static PetscErrorCode count_setups(PetscInt *n)
{
  PetscEventPerfInfo info;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventGetPerfInfo(0, SbEvents[SB_EVENT_SOLVER_SETUP], &info));
  *n = info.count;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Renewal with a new matrix; an indefinite operator must fail the solve, and later solves must
   succeed. */
static PetscErrorCode test_renewal(const char *more)
{
  KSPConvergedReason reason;
  PetscInt before, setups, again, its;
  PetscReal residual;
  char text[1024];
  System y;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          BAR("box:0.4,0.1,0.1:4") "-time static -solver cg_jacobi %s", more));
  PetscCall(system_open(text, 0., &y));
  PetscCall(count_setups(&before));
  PetscCall(KSPSolve(y.ksp, y.b, y.x));
  PetscCall(KSPSolve(y.ksp, y.b, y.x));
  PetscCall(count_setups(&setups));
  SB_CHECK(setups - before == 1, "%d set-ups for one matrix", (int)(setups - before));
  PetscCall(assemble(&y, 1., -1e4));
  PetscCall(KSPSolve(y.ksp, y.b, y.x));
  PetscCall(KSPGetConvergedReason(y.ksp, &reason));

  /* multigrid may not detect it: then CG does */
  SB_CHECK(reason == KSP_DIVERGED_PC_FAILED || (more[0] && reason == KSP_DIVERGED_INDEFINITE_MAT),
           "an indefinite operator: %s", KSPConvergedReasons[reason]);
  PetscCall(assemble(&y, 1., 1e3));
  PetscCall(KSPSolve(y.ksp, y.b, y.x));
  PetscCall(KSPGetConvergedReason(y.ksp, &reason));
  PetscCall(KSPGetIterationNumber(y.ksp, &its));
  PetscCall(count_setups(&again));
  PetscCall(true_residual(&y, &residual));
  SB_CHECK(reason > 0 && again - setups == 2, "after it: %s, %d set-ups",
           KSPConvergedReasons[reason], (int)(again - setups));
  SB_CHECK(residual < 2e-8, "after it: residual %g", residual);

  /* the initial guess is the solution: the hook must keep it, and the choice of the initial
     guess */
  PetscCall(KSPSetInitialGuessNonzero(y.ksp, PETSC_TRUE));
  PetscCall(KSPSolve(y.ksp, y.b, y.x));
  PetscCall(KSPGetIterationNumber(y.ksp, &its));
  SB_CHECK(its <= 1, "warm start takes %d iterations", (int)its);
  PetscCall(system_close(&y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distribution of the coarse problem: one rank solves for all aggregates, or each for its own. */
static PetscErrorCode test_spread(void)
{
  static const char *const more[] = {"-pc_coarse_gathered 300 ", SPREAD};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    const char *at;
    char text[4096];
    int naggregate = 0;
    int most = 0;
    System y;

    PetscCall(PetscSNPrintf(
      text, sizeof(text),
      BAR("box:0.4,0.1,0.1:6") "-time static -solver cg_jacobi -pc_coarse_aggregates 100 %s",
      more[k]));
    PetscCall(system_open(text, 0., &y));
    PetscCall(KSPSetUp(y.ksp));
    PetscCall(test_pc_view(y.pc, sizeof(text), text));
    at = strstr(text, " aggregates");
    while (at && at > text && at[-1] != ' ')
      at--;
    if (at)
      naggregate = atoi(at);
    at = strstr(text, "at most ");
    if (at)
      most = atoi(at + 8);
    SB_CHECK(naggregate > 50 &&
               (k && test_size > 1 ? most < naggregate && most * test_size >= naggregate
                                   : strstr(text, "factored by one") != NULL),
             "%s: %d aggregates, at most %d on a rank: %s", more[k], naggregate, most, text);
    PetscCall(system_close(&y));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement of a run with the preset against a factorisation; simple: whether the diagonal must
   have replaced the preset. */
static PetscErrorCode test_solution(const char *scene, PetscBool simple, const char *what)
{
  static const char *const solvers[] = {"-solver direct ", "-solver cg_two_level "};
  PetscReal norm[2];
  PetscReal difference = 0.;
  Vec exact = NULL;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    TestScene t;

    PetscCall(test_open(&t, "%s -ksp_rtol 1e-11 -time static %s", scene, solvers[k]));
    PetscCall(SbRunSolve(t.run));
    SB_CHECK(!t.run->clock.stop_reason[0], "%s: %s", what, t.run->clock.stop_reason);
    PetscCall(VecNorm(t.run->state.U, NORM_2, &norm[k]));
    if (k) {
      char text[4096];
      PetscBool took_over;
      KSP ksp;
      PC pc;

      PetscCall(SNESGetKSP(t.run->solve.snes, &ksp));
      PetscCall(KSPGetPC(ksp, &pc));
      PetscCall(test_pc_view(pc, sizeof(text), text));
      took_over = (PetscBool)!strstr(text, "type: icc");
      SB_CHECK(took_over == simple, "%s: the fine level is %s", what,
               took_over ? "the diagonal" : "incomplete Cholesky");
    }
    if (!k) {
      PetscCall(VecDuplicate(t.run->state.U, &exact));
      PetscCall(VecCopy(t.run->state.U, exact));
    } else {
      PetscCall(VecAXPY(exact, -1., t.run->state.U));
      PetscCall(VecNorm(exact, NORM_2, &difference));
    }
    PetscCall(test_scene_close(&t));
  }
  PetscCall(VecDestroy(&exact));

  /* residual 1e-11, condition number about 1e4 */
  SB_CHECK(norm[0] > 0. && difference < 1e-6 * norm[0], "%s: off by %g of %g", what, difference,
           norm[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscInt coarse, fine, slender, alone, few, many;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscLogDefaultBegin());
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:5") STATIC, 0., "bar"));
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:5") STATIC "-pc_coarse_aggregates 3", 0.,
                          "three aggregates"));

  /* more aggregates than nodes: each is a single node, whose rotations vanish */
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:2") STATIC "-pc_coarse_aggregates 1000", 0.,
                          "single nodes"));
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:3") STATIC "-pc_coarse_aggregates 60", 0.,
                          "pairs of nodes"));
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:5") STATIC "-body_bar_poisson 0.49", 0.,
                          "diagonal as fine level"));
  PetscCall(iterations(BAR("box:0.4,0.1,0.1:6") STATIC, &coarse));
  PetscCall(iterations(BAR("box:0.4,0.1,0.1:12") STATIC, &fine));
  test_print("5k and 41k tets: %d and %d iterations\n", (int)coarse, (int)fine);

  /* incomplete Cholesky alone doubles the iterations; the aggregates grow by 2^(0.3), and the
     iterations with their size */
  SB_CHECK(fine <= 1.6 * coarse, "iterations grow from %d to %d", (int)coarse, (int)fine);
  PetscCall(iterations(BAR("box:6,0.1,0.1:4") STATIC, &slender));
  test_print("slender bar: %d iterations\n", (int)slender);
  SB_CHECK(slender < 150, "%d iterations on a slender bar", (int)slender);

  /* spread over the ranks: a symmetric preconditioner too, and about the iterations of a factor for
     as many aggregates */
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:5") STATIC SPREAD, 0., "spread"));
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:2") STATIC SPREAD "-pc_coarse_aggregates 1000", 0.,
                          "spread, single nodes"));
  PetscCall(test_symmetry(BAR("box:0.4,0.1,0.1:3") STATIC SPREAD "-pc_coarse_aggregates 60", 0.,
                          "spread, pairs of nodes"));
  PetscCall(iterations(
    BAR("box:0.4,0.1,0.1:12") STATIC "-pc_coarse_aggregates 600 -pc_coarse_gathered 600", &few));
  PetscCall(
    iterations(BAR("box:0.4,0.1,0.1:12") STATIC "-pc_coarse_aggregates 600 " SPREAD, &many));
  test_print("600 aggregates: %d iterations, %d with multigrid\n", (int)few, (int)many);
  SB_CHECK(many <= 1.3 * few, "%d iterations with multigrid, %d with a factor", (int)many,
           (int)few);
  PetscCall(iterations(BAR("box:6,0.1,0.1:4") STATIC "-pc_coarse_aggregates 1", &alone));
  SB_CHECK(alone > 4 * slender, "the coarse space does nothing: %d iterations without it, %d with",
           (int)alone, (int)slender);
  PetscCall(test_renewal(""));
  PetscCall(test_renewal(SPREAD));
  PetscCall(test_spread());
  PetscCall(test_solution(BAR("box:0.4,0.1,0.1:5"), PETSC_FALSE, "bar"));

  /* tets thirty times as long as thick: the incomplete factorisation breaks down, except where
     three ranks partition them */
  PetscCall(test_solution(BAR("box:0.4,0.1,0.1:8,4,60") "-body_bar_poisson 0.4",
                          (PetscBool)(test_size < 3), "flat tets"));
  PetscCall(test_solution(BODIES, PETSC_FALSE, "three bodies, one held"));
  PetscCall(test_solution(BODIES SPREAD, PETSC_FALSE, "three bodies, spread"));
  SB_TEST_END();
}
