// @ranks 1 2 3
/*
  Response `multiplier` against `projected`: the same nonlinear problem with another linear solver,
  hence the same converged solution.

    pressed    a body supported by contact only, between two fixed obstacles: its matrix alone is
    singular corner     one and two obstacles at a node, next to a symmetry plane: linearly
    dependent constraints drive      a moving obstacle: its work and its force in the energy balance
    limit      reaching the iteration limit is a failed solve
    bent       a cantilever bent onto a plane by a pressure: as many iterations although the
    pressure's tangent is nonsymmetric, and not the crumpled
               equilibrium that is close to the shape without the plane
*/
#include "verify.h"

static PetscErrorCode solve(const char *scene, const char *more, PetscReal **u, PetscInt *n,
                            SbEnergies *e)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, "%s %s", scene, more));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, more));
  *n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, u));
  *e = t.run->state.energies;
  test_print("  %s: %d solves, %d iterations\n", more, (int)t.run->counters.newton,
             (int)t.run->counters.linear);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares a scene with more[1..] to the same scene with more[0], `projected`. */
static PetscErrorCode compare(const char *name, const char *scene, PetscInt n,
                              const char *const more[], PetscReal tolerance)
{
  PetscReal *exact, *u;
  PetscInt size;
  SbEnergies e0, e;

  PetscFunctionBeginUser;
  test_print("  %s\n", name);
  PetscCall(solve(scene, more[0], &exact, &size, &e0));
  for (PetscInt k = 1; k < n; k++) {
    PetscReal off, work;

    PetscCall(solve(scene, more[k], &u, &size, &e));
    off = verify_difference(size, exact, u);
    work = PetscAbsReal(e.prescribed_work - e0.prescribed_work) +
           PetscAbsReal(e.load_work - e0.load_work); /* relative to the elastic energy */
    test_print("    differs by %.1e, works by %.1e of %.3g J\n", off, work, e0.strain);
    SB_CHECK(off < tolerance, "%s, %s: differs from projected by %g", name, more[k], off);
    SB_CHECK(work < 1e-4 * e0.strain, "%s, %s: works %g and %g J, projected %g and %g", name,
             more[k], e.prescribed_work, e.load_work, e0.prescribed_work, e0.load_work);
    PetscCall(PetscFree(u));
  }
  PetscCall(PetscFree(exact));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define LAW(name)                                                                                  \
  "-body_" name "_material linear -body_" name "_young 1e5 -body_" name "_poisson 0.3 -body_" name \
  "_density 1000 "
#define SETTLED 1e-8 /* tolerance of displacements; they agree to 5e-10 */
#define EXACT "-ksp_rtol 1e-12 -snes_rtol 1e-11 "

/* ------------------------------------------------------------------ obstacles */

/* A block on a floor, under another obstacle and beside symmetry planes: only contact supports it
   in z. */
#define PRESSED                                                                                \
  "-bodies a -body_a_mesh box:0.1,0.1,0.05:3 " LAW(                                            \
    "a") "-time static -effects x,y,floor,roof -effect_x_type fixed -effect_x_on xmin "        \
         "-effect_x_components "                                                               \
         "x -effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_floor_type " \
         "contact "                                                                            \
         "-effect_floor_response projected -effect_floor_on zmin -effect_floor_obstacle "      \
         "plane:0,0,1,0.0005 "                                                                 \
         "-effect_roof_type contact -effect_roof_response projected -effect_roof_on zmax "     \
         "-effect_roof_obstacle sphere:0.05,0.04,0.148,0.1 "
#define BOTH(response) "-effect_floor_response " response " -effect_roof_response " response " "

static const char *const pressed[] = {
  BOTH("projected"),
  BOTH("multiplier") "-saddle_solver direct",
  BOTH("multiplier") "-saddle_solver direct -solver cg_icc",
  BOTH("multiplier") "-saddle_solver iterative",
  BOTH("multiplier") "-saddle_solver iterative -solver cg_icc",
  "-effect_floor_response multiplier -effect_roof_response projected"};

/* A wedge of two planes at a small angle under the same nodes, nearly the same plane twice, and a
   wall at supported nodes. */
#define CORNER                                                                                \
  "-bodies a -body_a_mesh box:0.1,0.1,0.05:3 " LAW(                                           \
    "a") "-time static -effects x,gravity,top,floor,tilted,again,wall -effect_x_type fixed "  \
         "-effect_x_on "                                                                      \
         "xmin -effect_x_components x -effect_gravity_vector 0,-20,-9.81 "                    \
         "-effect_top_type prescribed_displacement -effect_top_on zmax "                      \
         "-effect_top_displacement 0;0.0004*t;-0.001*t -effect_floor_type contact "           \
         "-effect_floor_response projected -effect_floor_on zmin -effect_floor_obstacle "     \
         "plane:0,0,1,0 "                                                                     \
         "-effect_again_type contact -effect_again_response projected -effect_again_on zmin " \
         "-effect_again_obstacle plane:0,0,1,3e-9 -effect_tilted_type contact "               \
         "-effect_tilted_response projected -effect_tilted_on zmin "                          \
         "-effect_tilted_obstacle plane:0,0.05,1,0.003 -effect_wall_type contact "            \
         "-effect_wall_response projected -effect_wall_on xmin -effect_wall_obstacle "        \
         "plane:1,0,0,0 "
#define FOUR(response)                                                   \
  "-effect_floor_response " response " -effect_again_response " response \
  " -effect_tilted_response " response " -effect_wall_response " response " "

static const char *const corner[] = {FOUR("projected"), FOUR("multiplier") "-saddle_solver direct",
                                     FOUR("multiplier") "-saddle_solver iterative -solver cg_icc"};

/* A ball that indents a clamped block and is dragged along it, without friction. */
#define DRIVE                                                                                   \
  "-bodies a -body_a_mesh box:0.1,0.06,0.04:3 -body_a_material corotated -body_a_young 2e4 "    \
  "-body_a_poisson 0.4 -body_a_density 1000 -effects bed,tool -effect_bed_type fixed "          \
  "-effect_bed_on zmin "                                                                        \
  "-effect_tool_type contact -effect_tool_response projected -effect_tool_on zmax "             \
  "-effect_tool_obstacle sphere:0.05,0.031,0.07,0.03 "                                          \
  "-effect_tool_displacement 0.01*ramp(t/0.1-1);0;-0.008*ramp(t/0.1) -ts_dt 0.02 -ts_max_time " \
  "0.16 "

static const char *const drive[] = {"-effect_tool_response projected -time euler_implicit",
                                    "-effect_tool_response multiplier -saddle_solver direct",
                                    "-effect_tool_response multiplier -saddle_solver iterative"};
static const char *const alpha[] = {"-effect_tool_response projected -time genalpha",
                                    "-effect_tool_response multiplier -time genalpha"};

/* ------------------------------------------------------------------ limit */

/* ------------------------------------------------------------------ bent */

#define BENT                                                                                       \
  "-bodies a -body_a_mesh box:0.3,0.1,0.1:2 -body_a_material stable_neohookean -body_a_young 1e5 " \
  "-body_a_poisson "                                                                               \
  "0.3 "                                                                                           \
  "-body_a_density 1000 -time static -effects clamp,load,floor -effect_clamp_type fixed "          \
  "-effect_clamp_on "                                                                              \
  "xmin "                                                                                          \
  "-effect_load_type pressure -effect_load_on zmax -effect_floor_type contact "                    \
  "-effect_floor_obstacle "                                                                        \
  "plane:0,0,1,-0.02 "

static PetscErrorCode bend(const char *more, PetscReal *strain, PetscInt *newton)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, BENT "%s", more));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, more));
  *strain = t.run->state.energies.strain;
  *newton = t.run->counters.newton;
  test_print("  bent, %s: %.9g J, %d iterations\n", more, *strain, (int)*newton);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_bent(void)
{
  PetscReal strain[3];
  PetscInt newton[3];

  PetscFunctionBeginUser;
  PetscCall(
    bend("-effect_load_value 4000 -effect_floor_response projected", &strain[0], &newton[0]));
  PetscCall(bend("-effect_load_value 4000 -effect_floor_response multiplier -saddle_solver direct",
                 &strain[1], &newton[1]));
  PetscCall(
    bend("-effect_load_value 4000 -effect_floor_response multiplier -saddle_solver iterative",
         &strain[2], &newton[2]));
  for (int k = 1; k < 3; k++) {
    SB_CHECK(PetscAbsReal(strain[k] - strain[0]) < 1e-6 * strain[0], "%g J, projected %g J",
             strain[k], strain[0]);

    /* the same Newton's method, with directions that differ by the tolerance; without the boundary
       term 110 and 201 iterations instead of 83 */
    SB_CHECK(newton[k] < 1.2 * newton[0], "%d iterations, projected %d", (int)newton[k],
             (int)newton[0]);
  }

  /* CR: one load step instead of four */
  PetscCall(
    bend("-effect_load_value 1200 -effect_load_follower no -body_a_element cr -static_steps 4",
         &strain[0], &newton[0]));
  PetscCall(bend("-effect_load_value 1200 -effect_load_follower no -body_a_element cr", &strain[1],
                 &newton[1]));
  SB_CHECK(PetscAbsReal(strain[1] - strain[0]) < 1e-6 * strain[0], "%g J, in four steps %g J",
           strain[1], strain[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  TestScene t;

  SB_TEST_BEGIN(argc, argv);

  /* many solves of small systems: on several ranks only the cases that differ there */
  PetscCall(compare("pressed", PRESSED EXACT, test_size > 1 ? 4 : 6, pressed, 1e-5));
  PetscCall(compare("corner", CORNER EXACT, 3, corner, 1e-8));
  PetscCall(test_scene_open(PRESSED BOTH("multiplier") "-saddle_solver iterative -solver cg_icc "
                                                       "-ksp_max_it 5 -time_max_halvings 1",
                            &t));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(strstr(t.run->clock.stop_reason, "DIVERGED_ITS"), "five iterations: \"%s\"",
           t.run->clock.stop_reason);
  PetscCall(test_scene_close(&t));
  if (test_size == 1) {
    PetscCall(compare("prescribed_displacement", DRIVE EXACT, 3, drive, 10 * SETTLED));
    PetscCall(compare("prescribed_displacement", DRIVE EXACT, 2, alpha, 10 * SETTLED));
  }
  if (test_size < 3)
    PetscCall(check_bent());
  SB_TEST_END();
}
