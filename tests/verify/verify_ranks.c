// @ranks 2 3 4
/*
  The same scene on one rank and on all: every rank runs it alone, then all run it together.
  Displacements, velocities (by original node number) and scalars of the last state must agree.

  Tolerances, relative to the largest value: 1e-10 if the linear system is solved directly or not at
  all; 1e-8 if Newton's method stops at 1e-9 of its first residual, the difference between solvers
  on different numbers of ranks.
*/
#include "verify.h"

typedef struct {
  PetscInt n, steps;
  PetscReal *u, *v; /* [n][3], v is NULL in a static run */
  SbEnergies e;
} State;

static PetscErrorCode solve(MPI_Comm comm, const char *options, State *state)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_on(comm, NULL, options, &t));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, options));
  *state = (State){
    .n = verify_numbers(t.model), .steps = t.run->counters.steps, .e = t.run->state.energies};
  PetscCall(verify_gather(t.model, t.run->state.U, &state->u));
  if (t.run->state.V)
    PetscCall(verify_gather(t.model, t.run->state.V, &state->v));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy(State *state)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(state->u));
  PetscCall(PetscFree(state->v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest difference of energies, momenta and volume, each relative to the largest of its kind. */
static PetscReal scalars(const SbEnergies *a, const SbEnergies *b)
{
  const PetscReal ea[6] = {a->kinetic,         a->strain,       a->load_work,
                           a->prescribed_work, a->damping_loss, a->integrator_loss};
  const PetscReal eb[6] = {b->kinetic,         b->strain,       b->load_work,
                           b->prescribed_work, b->damping_loss, b->integrator_loss};
  PetscReal d = verify_difference(6, ea, eb);

  d = PetscMax(d, verify_difference(3, a->centre, b->centre));
  d = PetscMax(d, verify_difference(1, &a->volume, &b->volume));
  d = PetscMax(d, verify_difference(1, &a->min_J, &b->min_J));
  if (a->kinetic > 0.) {
    d = PetscMax(d, verify_difference(3, a->momentum, b->momentum));
    d = PetscMax(d, verify_difference(3, a->angular, b->angular));
  }
  return d;
}

static PetscErrorCode check(const char *what, PetscReal tolerance, const char *options)
{
  State alone, together;
  PetscReal du;
  PetscReal dv = 0.;
  PetscReal de;

  PetscFunctionBeginUser;
  PetscCall(solve(PETSC_COMM_SELF, options, &alone));
  PetscCall(solve(PETSC_COMM_WORLD, options, &together));
  du = verify_difference(3 * alone.n, alone.u, together.u);
  if (alone.v)
    dv = verify_difference(3 * alone.n, alone.v, together.v);
  de = scalars(&alone.e, &together.e);
  test_print("  %-28s %3d steps: displacement %.1e, velocity %.1e, scalars %.1e\n", what,
             (int)alone.steps, du, dv, de);
  SB_CHECK(alone.n == together.n && alone.steps == together.steps,
           "%s: %d numbers of nodes and %d steps, %d and %d alone", what, (int)together.n,
           (int)together.steps, (int)alone.n, (int)alone.steps);
  SB_CHECK(du <= tolerance && dv <= tolerance && de <= tolerance,
           "%s: displacement %g, velocity %g, scalars %g", what, du, dv, de);
  PetscCall(destroy(&alone));
  PetscCall(destroy(&together));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BAR                                                                                 \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:3 -body_bar_young 1e5 -body_bar_poisson 0.4 " \
  "-body_bar_density 1000 "
#define CLAMP "-effect_clamp_type fixed -effect_clamp_on xmin "
#define TWO                                                                                       \
  "-bodies bar,block -body_bar_mesh box:0.4,0.1,0.1:2 -body_bar_young 1e5 -body_bar_poisson 0.4 " \
  "-body_bar_density 1000 -body_block_mesh tests/data/two_cubes_41.msh -body_block_scale 0.1 "    \
  "-body_block_translate 0,0,0.5 -body_block_young 2e5 -body_block_poisson 0.3 "                  \
  "-body_block_density 500 "                                                                      \
  "-body_block_velocity 0.3,0,1 -body_block_angular_velocity 1,2,3 "

/* Bodies with nodes at faces, alone and beside one of P1: fixed, with tractions, pressure and
   damping. */
static PetscErrorCode check_element(const char *bar, const char *block)
{
  char text[VERIFY_TEXT], what[64], elements[1024];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(what, sizeof(what), "static, %s", bar));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    BAR CLAMP
    "-body_bar_mesh box:0.4,0.1,0.1:2 -body_bar_element %s -body_bar_young 1e6 "
    "-body_bar_material stable_neohookean -body_bar_tangent exact -effects gravity,clamp,pull,air "
    "-effect_pull_type traction -effect_pull_on xmax -effect_pull_vector 0;300;100 "
    "-effect_air_type pressure -effect_air_on zmax -effect_air_value 500 -time static "
    "-snes_rtol 1e-9 -solver direct",
    bar));
  PetscCall(check(what, 1e-8, text));
  PetscCall(PetscSNPrintf(elements, sizeof(elements),
                          TWO CLAMP
                          "-body_bar_element %s -body_block_element %s -effect_clamp_on bar.xmin ",
                          bar, block));
  PetscCall(PetscSNPrintf(what, sizeof(what), "newmark, %s and %s", bar, block));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "%s -body_bar_material linear -body_block_material linear -effects "
    "gravity,clamp,damping -effect_damping_alpha 0.3 -effect_damping_beta 0.001 -time "
    "newmark -ts_dt 0.01 -ts_max_time 0.1 -solver direct -ksp_rtol 1e-13",
    elements));
  PetscCall(check(what, 1e-10, text));
  PetscCall(PetscSNPrintf(what, sizeof(what), "genalpha, %s and %s", bar, block));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "%s -body_bar_material stvk -body_bar_tangent exact -body_block_material corotated "
    "-effects gravity,clamp -time genalpha -ts_dt 0.01 -ts_max_time 0.05 -snes_rtol 1e-9 -solver "
    "direct",
    elements));
  PetscCall(check(what, 1e-8, text));
  PetscCall(PetscSNPrintf(what, sizeof(what), "explicit, %s and %s", bar, block));
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "%s -body_bar_material corotated -body_block_material stable_neohookean "
                          "-effects gravity,clamp -time euler_symplectic -ts_max_time 0.005",
                          elements));
  PetscCall(check(what, 1e-10, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("static, linear", 1e-10,
                  BAR CLAMP "-body_bar_material linear -effects gravity,clamp -time static"));
  PetscCall(check("static, iterative solver", 1e-8,
                  BAR CLAMP "-body_bar_material linear -effects gravity,clamp -time static -solver "
                            "cg_two_level -ksp_rtol 1e-11"));
  PetscCall(
    check("static, stable_neohookean, driven", 1e-8,
          BAR CLAMP
          "-body_bar_material stable_neohookean -effects clamp,pull,air -effect_pull_type "
          "prescribed_displacement -effect_pull_on xmax -effect_pull_angle 60*t -effect_pull_axis "
          "1,0,0 -effect_pull_axis_point 0,0.05,0.05 -effect_air_type pressure -effect_air_on zmax "
          "-effect_air_value 1000 -time static -static_steps 3 -snes_rtol 1e-9"));
  PetscCall(
    check("newmark, linear, two bodies", 1e-10,
          TWO CLAMP
          "-body_bar_material linear -body_block_material linear -effects gravity,clamp,damping "
          "-effect_damping_alpha 0.3 -effect_damping_beta 0.001 -effect_clamp_on bar.xmin "
          "-time newmark -ts_dt 0.01 -ts_max_time 0.3 -ksp_rtol 1e-13"));
  PetscCall(check("newmark, co-rotated", 1e-8,
                  BAR CLAMP
                  "-body_bar_material corotated -effects gravity,clamp -time newmark -ts_dt 0.01 "
                  "-ts_max_time 0.3 -snes_rtol 1e-9"));
  PetscCall(check(
    "genalpha, two bodies", 1e-8,
    TWO "-body_bar_material stvk -body_block_material stable_neohookean -effects gravity,hold,push "
        "-effect_hold_type fixed -effect_hold_on bar.xmin -effect_push_type traction "
        "-effect_push_on bar.xmax "
        "-effect_push_vector 0;300*sin(9*t);0 -time genalpha -ts_dt 0.01 -ts_max_time 0.3 "
        "-snes_rtol 1e-9"));
  PetscCall(check("adaptive", 1e-8,
                  BAR CLAMP
                  "-body_bar_material corotated -effects gravity,clamp -time newmark -ts_dt 0.01 "
                  "-ts_max_time 0.3 -ts_adapt_type basic -snes_rtol 1e-9"));
  PetscCall(check(
    "viscoelastic", 1e-8,
    TWO
    "-body_bar_material neohookean -body_bar_prony_times 0.02,0.2 -body_bar_prony_shear 0.3,0.4 "
    "-body_bar_prony_bulk 0.1,0.1 -body_bar_viscosity 20 -body_bar_element p2 "
    "-body_block_material stvk -body_block_prony_times 0.05 -body_block_prony_shear 0.5 "
    "-effects gravity,hold -effect_hold_type fixed -effect_hold_on bar.xmin -time genalpha "
    "-ts_dt 0.01 -ts_max_time 0.2 -snes_rtol 1e-9 -solver direct"));
  PetscCall(
    check("active", 1e-8,
          TWO "-body_bar_material neohookean -body_bar_fibre 1;z;0 -body_bar_active_tension "
              "5e3*(1+x)*sin(8*t)^2 -body_bar_active_velocity 4 -body_bar_element p2 "
              "-body_block_material stvk -body_block_fibre 0,0,1 -body_block_active_tension 2e3 "
              "-body_block_active_length gaussian -effects gravity,hold -effect_hold_type fixed "
              "-effect_hold_on bar.xmin -time genalpha -ts_dt 0.01 -ts_max_time 0.2 -snes_rtol "
              "1e-9 -solver direct"));
  PetscCall(check("growth", 1e-8,
                  TWO "-body_bar_material neohookean -body_bar_fibre 1;z;0 -body_bar_growth_fibre "
                      "0.2*(1+x)*sin(8*t)^2 -body_bar_growth 0.1*z -body_bar_element p2 "
                      "-body_block_material stvk -body_block_thermal_expansion 1e-4 "
                      "-body_block_temperature 300*sin(20*t)*x -effects gravity,hold "
                      "-effect_hold_type fixed -effect_hold_on bar.xmin -time genalpha -ts_dt 0.01 "
                      "-ts_max_time 0.2 -snes_rtol 1e-9 -solver direct"));
  PetscCall(
    check("explicit, consistent mass", 1e-10,
          TWO CLAMP
          "-body_bar_material corotated -body_block_material stvk -effects gravity,clamp "
          "-effect_clamp_on bar.xmin -mass consistent -time euler_symplectic -ts_max_time 0.05"));
  PetscCall(check_element("cr", "p1"));
  PetscCall(check_element("dg", "cr"));
  PetscCall(check_element("p2", "dg"));
  SB_TEST_END();
}
