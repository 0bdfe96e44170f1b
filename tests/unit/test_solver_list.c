// @ranks 1 2
/*
  If a solver fails, the next one of the list solves the same system: no step is rejected, the
  solution agrees with a factorisation, and the run continues with it. A method chosen by the user
  is not replaced, nor is any if a body is free.
*/
#include <sbfactor.h>
#include <sbsolver.h>
#include "../slivers.h"

#define BAR                                                                         \
  "-bodies a -body_a_mesh box:0.3,0.1,0.1:3 -body_a_young 1e5 -body_a_poisson 0.3 " \
  "-body_a_density 1000 "                                                           \
  "-effects gravity,clamp -effect_clamp_type fixed -effect_clamp_on xmin "
#define STATIC BAR "-time static -body_a_material corotated -ksp_rtol 1e-10 "

typedef struct {
  PetscReal tip[3];
  PetscInt newton, linear, rejected;
  char solver[SB_NAME_MAX], stop[1024];
} Outcome;

static PetscErrorCode run(const char *options, const char *more, Outcome *o)
{
  const PetscReal at[3] = {0.3, 0.1, 0.1};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "%s %s", options, more));
  PetscCall(SbRunSolve(t.run));
  PetscCall(test_value_at(t.model, t.run->state.U, at, o->tip));
  o->newton = t.run->counters.newton;
  o->linear = t.run->counters.linear;
  o->rejected = t.run->counters.rejected;
  PetscCall(PetscStrncpy(o->solver, t.run->solve.solver, sizeof(o->solver)));
  PetscCall(PetscStrncpy(o->stop, t.run->clock.stop_reason, sizeof(o->stop)));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A run whose solver fails against one with a factorisation: the same number of Newton iterations
   and the same displacement. */
static PetscErrorCode check_replaced(const char *options, const char *solver, const char *more,
                                     PetscReal tolerance)
{
  char text[256];
  Outcome o, exact;

  PetscFunctionBeginUser;
  PetscCall(run(options, "-solver direct", &exact));
  PetscCall(PetscSNPrintf(text, sizeof(text), "-solver %s %s", solver, more));
  PetscCall(run(options, text, &o));
  SB_CHECK(!o.stop[0] && !exact.stop[0], "%s: %s%s", text, o.stop, exact.stop);
  SB_CHECK(strcmp(o.solver, solver), "%s: not replaced", text);
  SB_CHECK(o.rejected == 0, "%s: %" PetscInt_FMT " steps cut", text, o.rejected);
  SB_CHECK(o.newton == exact.newton,
           "%s: %" PetscInt_FMT " Newton iterations, directly %" PetscInt_FMT, text, o.newton,
           exact.newton);
  for (int c = 0; c < 3; c++)
    SB_CHECK_NEAR(o.tip[c], exact.tip[c], tolerance * PetscAbsReal(exact.tip[2]), text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slivers near nu = 1/2: too few iterations for the pressures, with every matrix format. */
static PetscErrorCode check_slivers(void)
{
  const Slivers s = {.n = {12, 4, 4}, .size = {0.3, 0.1, 0.1}, .part = 0.01, .degrees = 0.1};
  char path[512], text[1024];
  PetscInt made = 0;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(slivers_write(&s, path, &made));
  for (int dg = 0; dg < 2; dg++) {
    PetscCall(PetscSNPrintf(
      text, sizeof(text),
      BAR "-body_a_mesh %s -effect_clamp_on held -sets held -set_held_at plane:1,0,0,0 "
          "-time static -body_a_material linear -body_a_poisson 0.4999 -body_a_element %s",
      path, dg ? "dg" : "cr"));
    PetscCall(check_replaced(text, "pressure", "-ksp_max_it 20", 1e-4));
  }
  PetscCall(test_scene_open(text, &t));
  SB_CHECK(t.model->body[0].nsliver >= made && made > 0,
           "%" PetscInt_FMT " slivers found of %" PetscInt_FMT, t.model->body[0].nsliver, made);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If rounding leaves a residual above the tolerance, 6e-8 of the first one here, Newton's method
   stops. */
static PetscErrorCode check_rounding(void)
{
  const Slivers s = {.n = {8, 4, 4}, .size = {0.3, 0.1, 0.1}, .part = 0.01, .degrees = 0.1};
  char path[512], text[1024];
  PetscInt made = 0;
  Outcome o;

  PetscFunctionBeginUser;
  PetscCall(slivers_write(&s, path, &made));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    BAR "-body_a_mesh %s -effect_clamp_on held -sets held -set_held_at plane:1,0,0,0 "
        "-time static -body_a_material stable_neohookean -body_a_young 5e5 -body_a_poisson "
        "0.4999 -body_a_element cr",
    path));
  PetscCall(run(text, "-time_max_halvings 0", &o));
  SB_CHECK(!o.stop[0] && !o.rejected && o.newton < 40,
           "%s, %" PetscInt_FMT " steps cut, %" PetscInt_FMT " iterations", o.stop, o.rejected,
           o.newton);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Returns the solver that is chosen for a clamped bar with slivers, without solving. */
static PetscErrorCode choose(const char *path, const char *solver, const char *body,
                             char name[SB_NAME_MAX])
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      BAR
                      "-body_a_mesh %s -effect_clamp_on held -sets held -set_held_at plane:1,0,0,0 "
                      "-time static -body_a_material linear %s -solver %s",
                      path, body, solver));
  PetscCall(PetscStrncpy(name, t.run->solve.solver, SB_NAME_MAX));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slivers affect the choice: above the size limit of a full factorisation, auto factorises near nu
   = 1/2, and does not choose `pressure` far from it. */
static PetscErrorCode check_choice(void)
{
  static const PetscReal part[] = {0., 0.01};
  char path[512], chosen[SB_NAME_MAX], direct[SB_NAME_MAX];
  PetscInt made = 0;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    const Slivers s = {.n = {24, 6, 6}, .size = {0.4, 0.1, 0.1}, .part = part[k], .degrees = 0.1};

    PetscCall(slivers_write(&s, path, &made));
    PetscCall(choose(path, "auto", "-body_a_poisson 0.4999 -body_a_element cr", chosen));
    PetscCall(choose(path, "direct", "-body_a_poisson 0.4999 -body_a_element cr", direct));
    SB_CHECK(!strcmp(chosen, k ? direct : "pressure"), "%g of the tets are slivers: auto took %s",
             part[k], chosen);
    PetscCall(choose(path, "auto", "-body_a_poisson 0.3 -body_a_element dg", chosen));
    SB_CHECK(!strcmp(chosen, k ? "cg_two_level" : "pressure"),
             "%g of the tets are slivers, DG, nu 0.3: auto took %s", part[k], chosen);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With the tangent auto the factorisation is that for definite matrices, whichever tangent Newton's
   method has used last; with exact it is one for indefinite ones. */
static PetscErrorCode check_tangent(const char *tangent, PetscBool definite)
{
  const SbSolverProblem problem = {.choice = "direct"};
  const SbSolverPreset *preset;
  const char *package;
  char reason[512];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, STATIC "-body_a_tangent %s -solver direct", tangent));
  PetscCall(SbDirectPackage(t.model->comm, 3 * t.model->space->Nnode, definite, &package));
  SB_CHECK(!strcmp(t.run->solve.solver, package), "%s: %s, not %s", tangent, t.run->solve.solver,
           package);
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(t.model->material[0]->tangent == SB_TANGENT_EXACT, "%s: the tangent was filtered",
           tangent);
  PetscCall(SbSolverChoose(t.model->space, &problem, sizeof(reason), reason, &preset));
  SB_CHECK(!strcmp(preset->name, package), "%s, after the run: %s, not %s", tangent, preset->name,
           package);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A stiff block lands on a plane, with friction: its rigid motions are soft, but the constraints of
   contact, which are outside the matrix, stop them. Whichever solver begins, no solve needs many
   iterations in the end, and the block comes to the same place. */
static PetscErrorCode check_stiff_friction(void)
{
  static const char *const solvers[] = {
    "auto", "direct", "umfpack", "cg_two_level",
    "cholmod -effect_c_response multiplier -saddle_solver iterative"};
  static const char *const bodies[] = {"-body_a_young 1e9", "-body_a_young 1e12",
                                       "-body_a_young 1e10 -body_a_element cr",
                                       "-body_a_young 1e10 -effect_c_response penalty"};
  char text[512];
  Outcome o;

  PetscFunctionBeginUser;
  for (size_t b = 0; b < PETSC_STATIC_ARRAY_LENGTH(bodies); b++) {
    PetscReal height = 0.;

    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(solvers) - (b > 0); k++) {
      PetscCall(PetscSNPrintf(
        text, sizeof(text),
        "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_translate -0.05,-0.05,0.005 "
        "-body_a_material corotated -body_a_poisson 0.4 -effects gravity,c -effect_c_type contact "
        "-effect_c_response projected -effect_c_obstacle plane:0,0,1,0 -effect_c_friction 0.5 "
        "-ts_dt "
        "0.02 -ts_max_time 0.06 %s -solver %s",
        bodies[b], solvers[k]));
      PetscCall(run(text, "", &o));
      SB_CHECK(!o.stop[0], "%s: %s", text, o.stop);
      SB_CHECK(k || o.linear < 500,
               "%s: %" PetscInt_FMT " linear iterations in %" PetscInt_FMT " Newton iterations",
               text, o.linear, o.newton);
      if (k)
        SB_CHECK_NEAR(o.tip[2], height, 1e-8, text);
      else
        height = o.tip[2];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Outcome o;

  SB_TEST_BEGIN(argc, argv);

  /* all matrix formats are replaced by AIJ, static and time-dependent */
  PetscCall(check_replaced(STATIC, "cg", "-ksp_max_it 3", 1e-6));
  PetscCall(check_replaced(STATIC, "cg_icc", "-ksp_max_it 3", 1e-6));
  PetscCall(check_replaced(STATIC, "gauss_seidel", "-ksp_max_it 3", 1e-6));
  PetscCall(
    check_replaced(BAR "-body_a_material corotated -ts_dt 0.02 -ts_max_time 0.1 -ksp_rtol 1e-10",
                   "cg_two_level", "-ksp_max_it 3", 1e-5));
  PetscCall(check_replaced(
    BAR "-body_a_material linear -time newmark -ts_dt 0.02 -ts_max_time 0.1 -ksp_rtol 1e-10",
    "rotated", "-ksp_max_it 1", 1e-5));

  /* nodes on an obstacle, and contact constraints between bodies */
  PetscCall(check_replaced(
    BAR "-body_a_material corotated -ts_dt 0.02 -ts_max_time 0.2 -effects gravity,clamp,floor "
        "-effect_floor_type contact -effect_floor_response projected "
        "-effect_floor_on boundary -effect_floor_obstacle plane:0,0,1,-0.01 -ksp_rtol 1e-10",
    "cg", "-ksp_max_it 5", 1e-4));
  PetscCall(check_replaced(
    BAR "-body_a_material corotated -bodies a,b -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate "
        "0.2,0,0.102 "
        "-body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 -body_b_material corotated "
        "-effect_clamp_on a.xmin -ts_dt 0.02 -ts_max_time 0.1 -effects gravity,clamp,meet "
        "-effect_meet_type contact -ksp_rtol 1e-10",
    "cg", "-ksp_max_it 20", 1e-4));
  PetscCall(check_slivers());
  PetscCall(check_stiff_friction());
  PetscCall(check_rounding());
  PetscCall(check_choice());
  PetscCall(check_tangent("auto", PETSC_TRUE));
  PetscCall(check_tangent("exact", PETSC_FALSE));

  /* the user's own method is not replaced, and the run reports its failure */
  PetscCall(run(STATIC, "-solver cg -ksp_type cg -ksp_max_it 3 -time_max_halvings 0", &o));
  SB_CHECK(o.stop[0] && !strcmp(o.solver, "cg"), "the user's method was replaced by %s", o.solver);

  /* a body without supports: no solver can succeed */
  PetscCall(run(STATIC, "-effect_clamp_components xy -solver cg_jacobi -ksp_max_it 300", &o));
  SB_CHECK(o.stop[0] && !strcmp(o.solver, "cg_jacobi"), "%s was tried on a free body", o.solver);
  SB_TEST_END();
}
