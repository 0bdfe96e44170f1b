// @ranks 1 2 3
/* Every row of the solver table solves the same linear bar; a matrix that is not positive definite
   fails with CHOLMOD and with no other package; the choice by `auto` has a reason, and is that
   of the table of docs/reports/solver_choice.md; a solve at its
   limit fails. */
#include "sbfactor.h"
#include "../../src/solver/choice.h"
#include "../scene.h"

#define BAR                                                                                       \
  "-bodies bar -body_bar_mesh box:0.3,0.1,0.1:3 -body_bar_material linear -body_bar_young 1e4 "   \
  "-body_bar_poisson 0.3 -body_bar_density 1000 "                                                 \
  "-effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin -time static -ksp_rtol " \
  "1e-10 "

static PetscErrorCode tip(const char *options, PetscReal *z, char stop[512], PetscInt *iterations)
{
  const PetscReal at[3] = {0.3, 0.1, 0.1};
  PetscReal value[3];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, BAR "%s", options));
  SB_CHECK(t.run->solve.solver_reason[0], "no reason for the solver %s", t.run->solve.solver);
  PetscCall(SbRunSolve(t.run));
  PetscCall(test_value_at(t.model, t.run->state.U, at, value));
  PetscCall(PetscStrncpy(stop, t.run->clock.stop_reason, 512));
  *z = value[2];
  *iterations = t.run->counters.linear;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solves A x = b for random b; returns the reason and |b - A x| / |b|. */
static PetscErrorCode solve(KSP ksp, Mat A, KSPConvergedReason *reason, PetscReal *residual)
{
  PetscRandom random;
  PetscReal size;
  Vec x, b, r;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(PetscRandomCreate(PETSC_COMM_WORLD, &random));
  PetscCall(VecSetRandom(b, random));
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, reason));
  PetscCall(MatMult(A, x, r));
  PetscCall(VecAYPX(r, -1., b));
  PetscCall(VecNorm(b, NORM_2, &size));
  PetscCall(VecNorm(r, NORM_2, residual));
  *residual /= size;
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factorises an indefinite matrix, a definite one, and both again; then a zero matrix, which no
   package factorises, and a definite one. Only CHOLMOD fails on indefinite matrices, on all
   ranks. */
static PetscErrorCode check_indefinite(const char *package, KSPType type)
{
  /* 1/s^2; the lowest natural frequency of the bar is about 40 rad/s */
  const PetscReal shift[6] = {-1e5, 0., -1e5, 0., 0., 0.};
  const PetscBool fails = (PetscBool)!strcmp(package, MATSOLVERCHOLMOD);
  TestScene t;
  PetscBool has;
  Mat A;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SbHasPackage(package, &has));
  if (!has)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(test_scene_open(BAR "-time euler_implicit -ts_dt 0.01", &t));
  PetscCall(SbSpaceCreateMatrix(t.model->space, SB_MATRIX_AIJ, &A));
  PetscCall(KSPCreate(PETSC_COMM_WORLD, &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "indefinite_"));
  PetscCall(KSPSetType(ksp, type));
  PetscCall(KSPSetTolerances(ksp, 1e-12, PETSC_DEFAULT, PETSC_DEFAULT, 20));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(SbPCDirectSet(pc, package, PETSC_TRUE));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(SbPCCheckPivots(pc));
  for (int k = 0; k < 6; k++) {
    KSPConvergedReason reason;
    PetscReal residual;

    PetscCall(SbModelTangent(t.model, 0., 0., shift[k], 1., t.run->state.U, NULL, A));
    if (k == 4)
      PetscCall(MatZeroEntries(A));
    PetscCall(solve(ksp, A, &reason, &residual));
    if (k == 4)
      SB_CHECK(reason < 0, "%s, zeros: %s", package, KSPConvergedReasons[reason]);
    else if (fails && shift[k] < 0.)
      SB_CHECK(reason == KSP_DIVERGED_PC_FAILED, "%s, indefinite: %s", package,
               KSPConvergedReasons[reason]);
    else
      SB_CHECK(reason > 0 && residual < 1e-10, "%s, matrix %d: %s, residual %g", package, k,
               KSPConvergedReasons[reason], residual);
  }
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A rotated factorisation serves up to near nu = 1/2; close to it DG took hundreds of times the
   iterations of other solvers. */
static PetscErrorCode check_choice(const char *element, const char *nu, PetscBool turns)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.3,0.1,0.1:1 -body_a_young 1e6 -body_a_poisson %s "
              "-body_a_element %s -body_a_material corotated -ts_dt 0.02 -solver auto",
              nu, element));
  SB_CHECK((PetscBool)!strcmp(t.run->solve.solver, "rotated") == turns, "%s, nu %s: auto took %s",
           element, nu, t.run->solve.solver);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If ranks share more nodes than a rotated factorisation supports, another solver is used. */
static PetscErrorCode check_meeting(const char *solver, const char *most, PetscBool turns)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_young 1e6 -body_a_poisson 0.3 "
              "-body_a_material corotated -body_a_tangent warped -effects gravity -ts_dt 0.02 "
              "-ts_max_time 0.02 -solver %s -pc_rotated_interface %s",
              solver, most));
  SB_CHECK((PetscBool)!strcmp(t.run->solve.solver, strcmp(solver, "auto") ? solver : "rotated") ==
             turns,
           "%s, at most %s nodes: %s was taken, %s", solver, most, t.run->solve.solver,
           t.run->solve.solver_reason);
  SB_CHECK(turns || !strcmp(t.run->solve.solver, "cg_two_level"), "with many ranks %s was taken",
           t.run->solve.solver);
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->clock.stop_reason[0] && t.run->counters.steps == 1, "%s: %s",
           t.run->solve.solver, t.run->clock.stop_reason);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Position of a bar after some time steps with large rotations. */
static PetscErrorCode swing(const char *element, const char *options, PetscReal x[3])
{
  const PetscReal at[3] = {0.4, 0.1, 0.1};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:2 -body_bar_material corotated -body_bar_tangent "
    "warped -body_bar_young 2e4 -body_bar_poisson 0.4 -body_bar_density 1000 -body_bar_element %s "
    "-effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin -time newmark -ts_dt "
    "0.04 -ts_max_time 0.24 -snes_rtol 1e-11 -snes_max_it 200 -time_max_halvings 0 %s",
    element, options));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->clock.stop_reason[0], "%s, %s: %s", element, options, t.run->clock.stop_reason);
  PetscCall(test_value_at(t.model, t.run->state.U, at, x));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "swing, %s, %s: %.9f, %" PetscInt_FMT " Newton, %" PetscInt_FMT
                        " linear iterations\n",
                        element, options, x[2], t.run->counters.newton, t.run->counters.linear));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix-free operator and its rotated factor give the same state as an assembled matrix and a
   factorisation. */
static PetscErrorCode check_realtime(const char *element)
{
  PetscReal exact[3], x[3];

  PetscFunctionBeginUser;
  PetscCall(swing(element, "-solver direct", exact));
  PetscCall(swing(element, "-solver realtime", x));
  SB_CHECK(exact[2] < -0.1, "%s: the bar fell by %g only", element, exact[2]);
  for (int c = 0; c < 3; c += 2)
    SB_CHECK_NEAR(x[c], exact[c], 1e-7 * PetscAbsReal(exact[2]), element);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor does not contain the face terms of these elements. */
static PetscErrorCode check_faces(const char *element)
{
  TestScene t;

  PetscFunctionBeginUser;
  SB_CHECK_ERROR(
    test_open(&t,
              "-bodies bar -body_bar_mesh box:1,1,1:1 -body_bar_material linear -body_bar_young "
              "1e3 -body_bar_poisson 0.3 -body_bar_density 1 -body_bar_element %s "
              "-ts_dt 0.1 -solver realtime",
              element),
    PETSC_ERR_USER, "-solver realtime");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define NONE "none" /* this PETSc has no factorisation */

/* The choice on both sides of every limit. What a row leaves out: auto, static, P1, one rank, a
   mesh without slivers, and CHOLMOD as the package. */
static PetscErrorCode check_table(void)
{
  static const struct {
    SbSolverFacts f;
    const char *solver;
  } of[] = {
    /* nothing to solve; the user's choice */
    {{.unknowns = 900, .problem.explicit_run = PETSC_TRUE, .problem.choice = "direct"}, "cg"},
    {{.unknowns = 900, .problem.choice = "direct"}, "cholmod"},
    {{.unknowns = 900, .problem.choice = "direct", .package = NONE}, NULL},
    {{.unknowns = 900, .problem.choice = "sor"}, "sor"},
    {{.unknowns = 90000, .problem.choice = "rotated", .interface = 9, .interface_most = 9},
     "rotated"},
    {{.unknowns = 90000, .problem.choice = "rotated", .interface = 10, .interface_most = 9},
     "cg_two_level"},

    /* the rotated factorisation */
    {{.unknowns = 60000, .problem.dynamic = PETSC_TRUE}, "rotated"},
    {{.unknowns = 60001, .problem.dynamic = PETSC_TRUE}, "cg_two_level"},
    {{.unknowns = 60000, .problem.dynamic = PETSC_TRUE, .problem.linear = PETSC_TRUE},
     "cg_two_level"},
    {{.unknowns = 60000, .problem.dynamic = PETSC_TRUE, .minres = PETSC_TRUE}, "cg_two_level"},
    {{.unknowns = 120000, .problem.dynamic = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.49},
     "rotated"},
    {{.unknowns = 120001, .problem.dynamic = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.49},
     "cg_two_level"},
    {{.unknowns = 60000, .problem.dynamic = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.491},
     "rotated"},
    {{.unknowns = 60001, .problem.dynamic = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.491},
     "cg_two_level"},
    {{.unknowns = 60000, .problem.dynamic = PETSC_TRUE, .cr_dg = PETSC_TRUE, .face_nu = 0.4999},
     "rotated"},
    {{.unknowns = 60000, .problem.dynamic = PETSC_TRUE, .cr_dg = PETSC_TRUE, .face_nu = 0.49991},
     "pressure"},

    /* many ranks: neither a rotated factorisation nor one by a package, but near nu = 1/2 */
    {{.unknowns = 900, .problem.dynamic = PETSC_TRUE, .interface = 9, .interface_most = 9},
     "rotated"},
    {{.unknowns = 900,
      .problem.dynamic = PETSC_TRUE,
      .interface = 10,
      .interface_most = 9,
      .nu = 0.45},
     "cg_two_level"},
    {{.unknowns = 900,
      .problem.dynamic = PETSC_TRUE,
      .interface = 10,
      .interface_most = 9,
      .nu = 0.451},
     "cholmod"},

    /* P2 */
    {{.unknowns = 5000, .p2 = PETSC_TRUE, .nu = 0.49}, "cholmod"},
    {{.unknowns = 5001, .p2 = PETSC_TRUE, .nu = 0.49}, "cg_p_multigrid"},
    {{.unknowns = 5001, .p2 = PETSC_TRUE, .nu = 0.491}, "cholmod"},
    {{.unknowns = 30000, .p2 = PETSC_TRUE, .indefinite = PETSC_TRUE, .nu = 0.49}, "cholmod"},
    {{.unknowns = 30001, .p2 = PETSC_TRUE, .indefinite = PETSC_TRUE, .nu = 0.49}, "cg_p_multigrid"},
    {{.unknowns = 30000, .p2 = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.45}, "cholmod"},
    {{.unknowns = 30001, .p2 = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.45}, "cg_p_multigrid"},
    {{.unknowns = 30001, .p2 = PETSC_TRUE, .slivers = PETSC_TRUE, .nu = 0.451}, "cholmod"},
    {{.unknowns = 200000, .p2 = PETSC_TRUE, .nu = 0.491}, "cholmod"},
    {{.unknowns = 200001, .p2 = PETSC_TRUE, .nu = 0.491}, "pressure"},
    {{.unknowns = 90000, .p2 = PETSC_TRUE, .nu = 0.491, .problem.dynamic = PETSC_TRUE}, "pressure"},
    {{.unknowns = 200001, .p2 = PETSC_TRUE, .nu = 0.491, .constraints = PETSC_TRUE},
     "cg_p_multigrid"},
    {{.unknowns = 200001, .p2 = PETSC_TRUE, .nu = 0.491, .coupled = PETSC_TRUE}, "cg_p_multigrid"},

    /* P1 */
    {{.unknowns = 30000}, "cholmod"},
    {{.unknowns = 30000, .package = NONE}, "cg_two_level"},
    {{.unknowns = 30001}, "cg_two_level"},
    {{.unknowns = 80000, .nu = 0.4995}, "cg_two_level"},
    {{.unknowns = 80000, .nu = 0.49951}, "cholmod"},
    {{.unknowns = 80000, .nu = 0.49951, .package = NONE}, "cg_two_level"},
    {{.unknowns = 80001, .nu = 0.49951}, "cg_two_level"},
    {{.unknowns = 80000, .nu = 0.49951, .problem.dynamic = PETSC_TRUE}, "cg_two_level"},
    {{.unknowns = 200000, .nu = 0.45, .slivers = PETSC_TRUE}, "cg_two_level"},
    {{.unknowns = 200000, .nu = 0.451, .slivers = PETSC_TRUE}, "cholmod"},
    {{.unknowns = 200001, .nu = 0.451, .slivers = PETSC_TRUE}, "cg_two_level"},

    /* CR and DG */
    {{.unknowns = 30000, .cr_dg = PETSC_TRUE, .face_nu = 0.3}, "cholmod"},
    {{.unknowns = 30001, .cr_dg = PETSC_TRUE, .face_nu = 0.3}, "pressure"},
    {{.unknowns = 80000, .cr_dg = PETSC_TRUE, .face_nu = 0.4999}, "pressure"},
    {{.unknowns = 30001, .cr_dg = PETSC_TRUE, .face_nu = 0.3, .slivers = PETSC_TRUE},
     "cg_two_level"},
    {{.unknowns = 90000, .cr_dg = PETSC_TRUE, .face_nu = 0.45, .problem.dynamic = PETSC_TRUE},
     "cg_two_level"},
    {{.unknowns = 90000, .cr_dg = PETSC_TRUE, .face_nu = 0.451, .problem.dynamic = PETSC_TRUE},
     "pressure"},
    {{.unknowns = 90000,
      .cr_dg = PETSC_TRUE,
      .dg = PETSC_TRUE,
      .face_nu = 0.3,
      .problem.dynamic = PETSC_TRUE},
     "pressure"},
    {{.unknowns = 30001, .cr_dg = PETSC_TRUE, .face_nu = 0.3, .constraints = PETSC_TRUE},
     "cg_two_level"},
    {{.unknowns = 30001, .face_nu = 0.3}, "cg_two_level"},
  };

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(of); k++) {
    SbSolverFacts f = of[k].f;
    const SbSolverPreset *preset;
    char reason[512];

    f.ranks = f.interface ? 16 : 1;
    f.faces = (PetscBool)(f.face_nu > 0.);
    if (f.faces)
      f.nu = PetscMax(f.nu, f.face_nu);
    else
      f.face_nu = -1.;
    if (!f.problem.choice)
      f.problem.choice = "auto";
    if (!f.package)
      f.package = MATSOLVERCHOLMOD;
    else if (!strcmp(f.package, NONE))
      f.package = NULL;
    preset = SbSolverChooseByFacts(&f, sizeof(reason), reason);
    SB_CHECK(!preset == !of[k].solver && (!preset || !strcmp(preset->name, of[k].solver)),
             "row %d: %s, not %s; %s", (int)k, preset ? preset->name : "none",
             of[k].solver ? of[k].solver : "none", reason);
    SB_CHECK(reason[0] && !strchr(reason, '{'), "row %d: %s", (int)k, reason);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const solvers[] = {
    "auto",         "cg",      "cg_jacobi", "cg_pbjacobi",  "cg_icc",  "cg_ssor",
    "cg_two_level", "cg_gamg", "cg_hypre",  "gauss_seidel", "sor",     "cholmod",
    "umfpack",      "mumps",   "direct",    "rotated",      "realtime"};
  PetscReal z, exact;
  PetscInt iterations;
  char stop[512], text[128];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_table());
  PetscCall(tip("-solver cg_pbjacobi", &exact, stop, &iterations));
  SB_CHECK(exact < -1e-3 && !stop[0], "cg_pbjacobi: tip at %g, %s", exact, stop);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(solvers); k++) {
    static const char *const packages[] = {"cholmod", "umfpack", "mumps", "hypre"};
    PetscBool has = PETSC_TRUE;

    for (size_t p = 0; p < PETSC_STATIC_ARRAY_LENGTH(packages); p++)
      if (strstr(solvers[k], packages[p]))
        PetscCall(SbHasPackage(packages[p], &has));
    if (!has)
      continue;
    PetscCall(PetscSNPrintf(text, sizeof(text), "-solver %s", solvers[k]));
    PetscCall(tip(text, &z, stop, &iterations));
    SB_CHECK(!stop[0], "%s: %s", solvers[k], stop);

    /* residual 1e-10; the condition number of this bar is about 1e4 */
    SB_CHECK_NEAR(z, exact, 1e-6 * PetscAbsReal(exact), solvers[k]);
    test_print("%-14s %" PetscInt_FMT " iterations\n", solvers[k], iterations);
  }
  PetscCall(tip("-solver cg_jacobi -ksp_type cg -ksp_max_it 3 -time_max_halvings 2", &z, stop,
                &iterations));
  SB_CHECK(stop[0], "three iterations passed as a solution");
  SB_CHECK(strstr(stop, "DIVERGED_ITS"), "the reason does not name the limit: %s", stop);
  PetscCall(check_indefinite(MATSOLVERCHOLMOD, KSPPREONLY));
  PetscCall(check_indefinite(MATSOLVERCHOLMOD, KSPCG));
  PetscCall(check_indefinite(MATSOLVERCHOLMOD, KSPMINRES));
  PetscCall(check_indefinite(MATSOLVERUMFPACK, KSPFGMRES));
  PetscCall(check_indefinite(MATSOLVERMUMPS, KSPFGMRES));
  PetscCall(check_choice("p1", "0.499999", PETSC_TRUE));
  for (size_t k = 0; k < 3; k++) {
    static const char *const turning[] = {"auto", "rotated", "realtime"};

    PetscCall(check_meeting(turning[k], "1500", PETSC_TRUE));
    PetscCall(check_meeting(turning[k], "3", (PetscBool)(test_size == 1)));
  }
  PetscCall(check_realtime("p1"));
  PetscCall(check_realtime("p2"));
  PetscCall(check_faces("cr"));
  PetscCall(check_faces("dg"));
  PetscCall(check_choice("cr", "0.4999", PETSC_TRUE));
  PetscCall(check_choice("cr", "0.499999", PETSC_FALSE));
  PetscCall(check_choice("dg", "0.499999", PETSC_FALSE));
  SB_TEST_END();
}
