// @ranks 1 2
/*
  PETSc's -ksp_type, -pc_type and -ksp_norm_type combined with every preset of -solver, for all
  elements, static and dynamic, with and without contact: each run gives the solution of the default
  solver, or ends before the computation with one line that names the option. Expected errors are a
  table here, so an unexpected one fails the test too.

  Every method with every preconditioner is run in each case. With presets all combinations are run
  where `whole` is set, or with the argument "all"; elsewhere the methods that differ most.
*/
#include "../scene.h"

#define LAW(name)                                                          \
  "-body_" name "_material corotated -body_" name "_young 1e5 -body_" name \
  "_poisson 0.3 -body_" name "_density 1000 "
#define BAR "-bodies a -body_a_mesh box:0.2,0.1,0.1:2 " LAW("a")
#define HELD "-effect_clamp_type fixed -effect_clamp_on xmin "
#define STATIC BAR "-effects gravity,clamp " HELD "-time static "
#define STEPS "-ts_dt 0.01 -ts_max_time 0.02 "
#define DYNAMIC BAR "-effects gravity,clamp " HELD STEPS
#define PAIR                                                                                       \
  "-bodies a,b -body_a_mesh box:0.2,0.1,0.05:1 -body_b_mesh box:0.08,0.06,0.05:1 "                 \
  "-body_b_translate "                                                                             \
  "0.06,0.021,0.05 " LAW("a")                                                                      \
    LAW("b") "-sets bottom,top -set_bottom_at plane:0,0,1,0 -set_top_at plane:0,0,1,0.1 -effects " \
             "hold,push,meet -effect_hold_type fixed -effect_hold_on bottom "                      \
             "-effect_push_type prescribed_displacement -effect_push_on top -effect_meet_type "    \
             "contact "
#define DRAG STEPS "-effect_push_displacement 0.1*t;0;-0.1*t "

typedef struct {
  const char *name, *options;
  PetscBool whole;
} Case;

static const Case cases[] = {
  {"static, p1", STATIC, PETSC_TRUE},
  {"static, cr", STATIC "-body_a_element cr ", PETSC_FALSE},
  {"static, dg", STATIC "-body_a_element dg ", PETSC_FALSE},
  {"dynamic, p1", DYNAMIC, PETSC_FALSE},
  {"dynamic, cr", DYNAMIC "-body_a_element cr ", PETSC_FALSE},
  {"dynamic, dg", DYNAMIC "-body_a_element dg ", PETSC_FALSE},
  {"obstacle",
   BAR "-effects gravity,floor -effect_floor_type contact -effect_floor_response projected "
       "-effect_floor_on zmin -effect_floor_obstacle plane:0,0,1,0 " STEPS,
   PETSC_FALSE},
  {"pairs", PAIR DRAG, PETSC_TRUE},
};
static const char *const methods[] = {"cg", "fcg", "minres", "gmres", "fgmres", "bcgs", "preonly"};
static const char *const types[] = {"jacobi",   "bjacobi", "icc", "gamg", "hypre",
                                    "cholesky", "lu",      "asm", "none"};
static const char *const presets[] = {
  "auto",         "direct",  "cg",       "cg_jacobi",    "cg_pbjacobi",   "cg_icc",  "cg_ssor",
  "cg_two_level", "cg_gamg", "cg_hypre", "gauss_seidel", "sor",           "cholmod", "umfpack",
  "mumps",        "rotated", "realtime", "pressure",     "cg_p_multigrid"};
/* Norms that a method supports, from PETSc's manual. */
static const char *const norms[][2] = {
  {"cg", " none preconditioned unpreconditioned natural "},
  {"fcg", " none preconditioned unpreconditioned natural "},
#if PETSC_VERSION_LT(3, 20, 0)
  {"minres", " none preconditioned "},
#else /* written again: KSPMINRESSetUseQLP() */
  {"minres", " none preconditioned unpreconditioned "},
#endif
  {"gmres", " none preconditioned unpreconditioned "},
  {"fgmres", " none unpreconditioned "},
  {"bcgs", " none preconditioned unpreconditioned "},
};

/* Runs a case with additional options; x: 2-norm of the displacement vector, m. */
static PetscErrorCode run(const Case *c, const char *more, PetscErrorCode *code, PetscReal *x,
                          char stop[512])
{
  char text[2048];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "%s -ksp_rtol 1e-6 -snes_rtol 1e-5 -ksp_gmres_restart 100 %s", c->options,
                          more));
  *x = 0.;
  sb_test_text[0] = stop[0] = 0;
  PetscCall(PetscPushErrorHandler(sb_test_keep, NULL));
  *code = test_scene_open(text, &t);
  if (!*code)
    *code = SbRunSolve(t.run);
  PetscCall(PetscPopErrorHandler());
  if (!*code) {
    PetscCall(VecNorm(t.run->state.U, NORM_2, x));
    PetscCall(PetscStrncpy(stop, t.run->clock.stop_reason, 512));
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Expects the solution `exact` (0: any), or an error that names `option`. */
static PetscErrorCode check(const Case *c, const char *more, PetscReal exact, const char *option)
{
  PetscErrorCode code;
  PetscReal x;
  char stop[512];

  PetscFunctionBeginUser;
  PetscCall(run(c, more, &code, &x, stop));
  if (option) {
    SB_CHECK(code == PETSC_ERR_USER || code == PETSC_ERR_USER_INPUT,
             "%s, %s: not refused, code %d, %s", c->name, more, (int)code, sb_test_text);
    SB_CHECK(sb_test_names(sb_test_text, option) && !strchr(sb_test_text, '\n'), "%s, %s: %s",
             c->name, more, sb_test_text);
  } else {
    SB_CHECK(!code && !stop[0], "%s, %s: code %d, %s%s", c->name, more, (int)code, sb_test_text,
             stop);
    if (!code && !stop[0] && exact > 0.)
      /* with contact between surfaces Newton's method stops by the length of its step */
      SB_CHECK(PetscAbsReal(x - exact) <= (strcmp(c->name, "pairs") ? 1e-4 : 1e-3) * exact,
               "%s, %s: %.10g, not %.10g", c->name, more, x, exact);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether this PETSc has the package that a type or a preset needs here. */
static PetscErrorCode available(const char *name, PetscBool *has)
{
  const char *package = !strcmp(name, "cg_hypre") ? "hypre" : name;

  PetscFunctionBeginUser;
  *has = PETSC_TRUE;
  if (!strcmp(package, "hypre") || !strcmp(package, "cholmod") || !strcmp(package, "umfpack") ||
      !strcmp(package, "mumps"))
    PetscCall(SbHasPackage(package, has));
  if (test_size > 1 && (!strcmp(name, "lu") || !strcmp(name, "cholesky")))
    PetscCall(SbHasPackage("mumps", has));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Option that the error of -ksp_type with -pc_type names; NULL: no error. */
static const char *refused(const char *method, const char *type)
{
  if (test_size > 1 && !strcmp(type, "icc"))
    return "-pc_type icc";
  return strcmp(method, "preonly") || !strcmp(type, "cholesky") || !strcmp(type, "lu")
           ? NULL
           : "-ksp_type preonly";
}

/* Option that the error of a preset names if the user keeps its preconditioner. */
static const char *refused_preset(const Case *c, const char *method, const char *preset)
{
  const PetscBool direct = (PetscBool)(!strcmp(preset, "cholmod") || !strcmp(preset, "mumps") ||
                                       !strcmp(preset, "umfpack") || !strcmp(preset, "direct"));

  if (!strcmp(preset, "realtime"))
    return "-solver realtime";
  if (!strcmp(preset, "cg_p_multigrid"))
    return "-solver cg_p_multigrid";
  if (!strcmp(preset, "pressure") && !strstr(c->options, "element"))
    return "-solver pressure";
  if (!strcmp(method, "minres") && !strcmp(preset, "rotated"))
    return "-ksp_type minres";
  if (strcmp(method, "preonly"))
    return NULL;
  if (!strcmp(preset, "auto") && strstr(c->options, "static"))
    return NULL; /* a factorisation */
  return direct ? NULL : "-ksp_type preonly";
}

static PetscErrorCode check_case(const Case *c, PetscBool all)
{
  PetscErrorCode code;
  PetscReal exact;
  PetscBool has;
  char stop[512], more[256];

  PetscFunctionBeginUser;
  PetscCall(run(c, "", &code, &exact, stop));
  SB_CHECK(!code && !stop[0] && exact > 0., "%s: code %d, %s%s", c->name, (int)code, sb_test_text,
           stop);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(methods); k++) {
    for (size_t p = 0; p < PETSC_STATIC_ARRAY_LENGTH(types); p++) {
      PetscCall(available(types[p], &has));
      if (!has)
        continue;
      PetscCall(
        PetscSNPrintf(more, sizeof(more), "-ksp_type %s -pc_type %s", methods[k], types[p]));
      PetscCall(check(c, more, exact, refused(methods[k], types[p])));
    }
  }
  for (size_t s = 0; s < PETSC_STATIC_ARRAY_LENGTH(presets); s++) {
    PetscCall(available(presets[s], &has));
    if (!has)
      continue;
    for (size_t p = 0; all && p < PETSC_STATIC_ARRAY_LENGTH(types); p++) {
      PetscCall(available(types[p], &has));
      if (!has)
        continue;
      PetscCall(PetscSNPrintf(more, sizeof(more), "-solver %s -pc_type %s", presets[s], types[p]));
      PetscCall(check(c, more, exact, refused("cg", types[p])));
    }
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(methods); k++) {
      if (!all && strcmp(methods[k], "minres") && strcmp(methods[k], "bcgs") &&
          strcmp(methods[k], "preonly"))
        continue;
      PetscCall(
        PetscSNPrintf(more, sizeof(more), "-solver %s -ksp_type %s", presets[s], methods[k]));
      PetscCall(check(c, more, exact, refused_preset(c, methods[k], presets[s])));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Tests every norm of every method. */
static PetscErrorCode check_norms(const Case *c)
{
  static const char *const all[] = {"none", "preconditioned", "unpreconditioned", "natural"};
  PetscErrorCode code;
  PetscReal exact;
  char stop[512], more[256];

  PetscFunctionBeginUser;
  PetscCall(run(c, "", &code, &exact, stop));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(norms); k++) {
    for (size_t n = 0; n < PETSC_STATIC_ARRAY_LENGTH(all); n++) {
      char word[32];

      PetscCall(PetscSNPrintf(word, sizeof(word), " %s ", all[n]));
      PetscCall(PetscSNPrintf(more, sizeof(more),
                              "-ksp_type %s -pc_type bjacobi -ksp_norm_type %s%s", norms[k][0],
                              all[n], n ? "" : " -ksp_convergence_test skip -ksp_max_it 25"));

      /* a fixed number of iterations instead of a norm leaves an unknown error */
      PetscCall(
        check(c, more, n ? exact : 0., strstr(norms[k][1], word) ? NULL : "-ksp_norm_type"));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* GAMG with contact springs, which stiffen the matrix from one Newton iteration to the next. */
static PetscErrorCode check_springs(void)
{
  static const Case springs = {
    "springs",
    "-bodies a -body_a_mesh box:0.4,0.1,0.1:2 -body_a_material linear -body_a_young 1e6 "
    "-body_a_poisson 0.3 -effects gravity,clamp,floor " HELD
    "-effect_floor_type contact -effect_floor_on zmin -effect_floor_response penalty "
    "-effect_floor_obstacle plane:0,0,1,-0.008 -time static ",
    PETSC_FALSE};
  PetscErrorCode code;
  PetscReal exact;
  char stop[512];

  PetscFunctionBeginUser;
  PetscCall(run(&springs, "", &code, &exact, stop));
  SB_CHECK(!code && !stop[0], "springs: code %d, %s%s", (int)code, sb_test_text, stop);
  PetscCall(check(&springs, "-ksp_type cg -pc_type gamg", exact, NULL));
  PetscCall(check(&springs, "-ksp_type minres -pc_type gamg", exact, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact between surfaces is solved with the user's method and preconditioner, and with the
   settings that these need: incomplete factors of blocks of CR are indefinite without a shift. A
   solve that reaches its limit does not show an indefinite tangent; the message names the
   option. */
static PetscErrorCode check_barrier(void)
{
  static const Case barrier = {"barrier",
                               "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_element cr "
                               "-body_a_material stable_neohookean -body_a_young "
                               "1e6 -body_a_poisson 0.3 -effects gravity,clamp,floor " HELD
                               "-effect_floor_type contact -effect_floor_response barrier "
                               "-effect_floor_obstacle box:0.2,-1,-1,1,1,-0.003 -time static ",
                               PETSC_FALSE};
  static const char *const more[] = {"-ksp_type cg -pc_type bjacobi", "-ksp_type cg -pc_type asm",
                                     "-ksp_type minres -pc_type bjacobi",
                                     "-ksp_type gmres -pc_type asm",
                                     "-ksp_type cg -pc_type bjacobi -sub_pc_type icc"};
  PetscErrorCode code;
  PetscReal exact;
  char stop[512];

  PetscFunctionBeginUser;
  PetscCall(run(&barrier, "", &code, &exact, stop));
  SB_CHECK(!code && !stop[0], "barrier: code %d, %s%s", (int)code, sb_test_text, stop);

  /* a factorisation needs 7 Newton iterations; without the shift 60 and more are needed, so load
     steps are halved */
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(more); k++) {
    char text[256];

    PetscCall(
      PetscSNPrintf(text, sizeof(text), "%s -snes_max_it 20 -time_max_halvings 0", more[k]));
    PetscCall(check(&barrier, text, exact, NULL));
  }
  PetscCall(run(&barrier, "-contact_pc_type none -contact_ksp_max_it 5 -static_min_increment 0.5",
                &code, &exact, stop));
  SB_CHECK(!code && sb_test_names(stop, "-contact_pc_type"), "code %d, %s", (int)code, stop);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A package that PETSc's option selects is the solver's name; options that only another
   preconditioner reads are not set; a linear load step whose solve fails is not halved. */
static PetscErrorCode check_said(void)
{
  PetscBool has, set;
  PetscReal largest;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(SbHasPackage("umfpack", &has));
  if (has) {
    PetscCall(test_scene_open(STATIC "-pc_factor_mat_solver_type umfpack ", &t));
    SB_CHECK(!strcmp(t.run->solve.solver, "umfpack") &&
               strstr(t.run->solve.solver_parts, "lu of umfpack"),
             "%s, %s", t.run->solve.solver, t.run->solve.solver_parts);
    PetscCall(test_scene_close(&t));
  }
  PetscCall(test_scene_open(
    STATIC "-body_a_material linear -ksp_type cg -pc_type none -ksp_max_it 2 ", &t));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-pc_asm_type", &set));
  SB_CHECK(!set, "-pc_asm_type is set without -pc_type asm");
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(t.run->clock.stop_reason[0] && t.run->counters.rejected == 1,
           "%d steps are rejected, '%s'", (int)t.run->counters.rejected, t.run->clock.stop_reason);
  PetscCall(test_scene_close(&t));

  // PETSc 3.18: CG ends as converged if the preconditioner maps its residual to zero, as a matrix
  // of updates does before its first update.
  PetscCall(test_scene_open(STATIC "-body_a_material linear -ksp_type cg -pc_type lmvm ", &t));
  PetscCall(SbRunSolve(t.run));
  PetscCall(VecNorm(t.run->state.U, NORM_INFINITY, &largest));
  SB_CHECK(t.run->clock.stop_reason[0] || largest > 0., "the zero displacement is an answer");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++)
    PetscCall(
      check_case(&cases[i], (PetscBool)(cases[i].whole || (argc > 1 && !strcmp(argv[1], "all")))));
  PetscCall(check_norms(&cases[0]));
  PetscCall(check_springs());
  PetscCall(check_barrier());
  PetscCall(check_said());
  SB_TEST_END();
}
