// @ranks 1 2
/*
  Rigid obstacles given by a mesh, and bodies that initially overlap an obstacle.

    mesh       a block that falls on a box and slides over its edge moves in the same way if the box
    is a mesh of tets facets     a triangulated ball that indents and is dragged gives the force of
    the sphere, and no step fails groove     the edge of a block in a groove, with contact at two
    facets of one mesh, against two planes overlap    a block that begins 30 % of its height behind
    a plane is separated: speed, penetration after
               1 and 5 times `recovery`, and energy gained; with every response and element
    at_once    a static run removes the same overlap in its first step
*/
#include "../unit/surface_files.h"
#include "contact.h"

/* ------------------------------------------------------------------ mesh */

/* The box of the obstacle, 0.3 x 0.2 x 0.1 m, below z = 0. */
static void table(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  x[0] = 0.3 * x[0] - 0.2;
  x[1] = 0.2 * x[1] - 0.1;
  x[2] = 0.1 * x[2] - 0.1;
}

static PetscErrorCode fall_on(const char *obstacle, PetscReal *u[], PetscInt *n, Record *r)
{
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("fall on %.20s", obstacle);
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_rotate 1,2,0,15 -body_a_translate -0.02,-0.047,0.03 "
              "-body_a_velocity 0.5,0,-0.5 "
              "-effects gravity,floor -effect_floor_type contact -effect_floor_response projected "
              "-effect_floor_obstacle %s -effect_floor_friction 0.2 -time euler_implicit -ts_dt "
              "0.005 -ts_max_time "
              "0.15 -snes_rtol 1e-12 -ksp_rtol 1e-11" VERIFY_BODY("a", "box:0.1,0.1,0.05:2",
                                                                  "corotated", "2e4", "0.3"),
              obstacle));
  PetscCall(record_solve(&t, r));
  *n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_mesh(void)
{
  PetscReal *u[2];
  PetscInt length;
  Record r[2] = {{.g = 0}, {.g = 0}};
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write((const PetscInt[3]){6, 4, 2}, table, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(fall_on("box:-0.2,-0.1,-0.1,0.1,0.1,0", &u[0], &length, &r[0]));
  PetscCall(fall_on(text, &u[1], &length, &r[1]));
  VERIFY_MORE(record_max(&r[0], "floor_force_z"), 20, "largest force of the box, N");

  /* distances agree up to rounding; friction converges to a tolerance relative to its force, which
     rounding can affect */
  VERIFY_LESS(verify_difference(length, u[0], u[1]), 1e-6,
              "difference of displacements on box and mesh");
  for (int k = 0; k < 2; k++)
    PetscCall(PetscFree(u[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ facets */

#define DRAG_STEPS 20 /* the first half of them downwards */
#define DOWN_STEPS 10
#define DRAG_DT 0.02 /* s */

/* Force of the indenter after each step, N: [DRAG_STEPS + 1][3]. */
static PetscErrorCode drag(const char *obstacle, PetscReal force[])
{
  static const char *const columns[3] = {"tool_force_x", "tool_force_y", "tool_force_z"};
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("facets: %.6s", obstacle);
  PetscCall(
    record_run(&r,
               "-bodies a -effects bed,tool -effect_bed_type fixed -effect_bed_on zmin "
               "-effect_tool_type contact "
               "-effect_tool_response projected -effect_tool_on zmax -effect_tool_obstacle %s "
               "-effect_tool_friction 0.3 "
               "-effect_tool_displacement 0.02*ramp(t/0.2-1);0;-0.01*ramp(t/0.2) -time "
               "euler_implicit -ts_dt %g "
               "-ts_max_time %g" VERIFY_BODY("a", "box:0.1,0.06,0.04:4", "corotated", "2e4", "0.4"),
               obstacle, DRAG_DT, DRAG_DT * DRAG_STEPS));
  VERIFY_NEAR(r.rejected, 0, 0, "steps that failed");
  for (PetscInt i = 0; i < r.n && i <= DRAG_STEPS; i++)
    for (int k = 0; k < 3; k++)
      force[3 * i + k] = record_at(&r, columns[k], i);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Edges of 3 to 5 mm with their vertices on the sphere, one vertex pointing down and ridges along
  the vertex rows of the block. Facet centroids are 0.2 mm inside the sphere: at an indentation of
  10 mm that is 2 % of it and 3 % of the force. Then nodes come into contact and leave one by one,
  at other times than with the sphere; no step fails.
*/
static PetscErrorCode check_facets(void)
{
  PetscReal force[2][3 * (DRAG_STEPS + 1)] = {{0}};
  TestSurface s = {0};
  char path[512], text[600];

  PetscFunctionBeginUser;
  test_surface_sphere(3, &s);
  for (PetscInt v = 0; v < s.nvert; v++)
    for (int k = 0; k < 3; k++)
      s.x[v][k] = 0.015 * s.x[v][k] + (k == 0 ? 0.05 : k == 1 ? 0.031 : 0.055);
  PetscCall(test_file_write(".off", PETSC_FALSE, &s, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(drag("sphere:0.05,0.031,0.055,0.015", force[0]));
  PetscCall(drag(text, force[1]));
  VERIFY_LESS(force[0][3 * DRAG_STEPS + 2], -0.5, "pressed by, N");
  VERIFY_LESS(verify_difference(3 * (DOWN_STEPS + 1), force[0], force[1]), 0.035,
              "difference of facets and sphere");
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ groove */

static PetscErrorCode lie(const char *what, const char *obstacles, PetscReal *strain,
                          PetscReal *weight)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("groove, %s", what);
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_rotate 0,1,0,-45 -body_a_translate 0.001,-0.05,0.005 -time euler_implicit "
    "-ts_dt 0.01 "
    "-ts_max_time 1.2 -effect_l_type contact -effect_l_response projected %s" VERIFY_BODY(
      "a", "box:0.1,0.1,0.1:3", "corotated", "2e4", "0.3"),
    obstacles));
  *strain = record_last(&r, "strain");
  *weight =
    record_last(&r, "l_force_z") + (strstr(obstacles, "l,r") ? record_last(&r, "r_force_z") : 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_groove(void)
{
  PetscReal strain[2], weight[2];
  char path[512], text[700];

  PetscFunctionBeginUser;
  PetscCall(test_file_write(
    ".off", PETSC_FALSE, NULL,
    "OFF 10 7 0\n0 -0.2 0\n0.2 -0.2 0.2\n0.2 -0.2 -0.1\n-0.2 -0.2 -0.1\n-0.2 -0.2 0.2\n"
    "0 0.2 0\n0.2 0.2 0.2\n0.2 0.2 -0.1\n-0.2 0.2 -0.1\n-0.2 0.2 0.2\n5 0 4 3 2 1\n"
    "5 5 6 7 8 9\n4 0 1 6 5\n4 1 2 7 6\n4 2 3 8 7\n4 3 4 9 8\n4 4 0 5 9\n",
    path));
  PetscCall(
    PetscSNPrintf(text, sizeof(text), "-effects gravity,l -effect_l_obstacle mesh:%s", path));
  PetscCall(lie("planes",
                "-effects gravity,l,r -effect_l_obstacle plane:1,0,1,0 -effect_r_type contact "
                "-effect_r_response projected -effect_r_obstacle plane:-1,0,1,0",
                &strain[0], &weight[0]));
  PetscCall(lie("mesh", text, &strain[1], &weight[1]));
  VERIFY_NEAR(weight[1], 9.81, 0.01 * 9.81, "weight in the groove, N");
  VERIFY_NEAR(strain[1], strain[0], 0.02 * strain[0], "strain energy in the groove, J");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ overlap */

#define DEPTH 0.03 /* m, of a height of 0.1 */
#define MASS 1.0   /* kg */
#define STEP 0.005 /* s */
#define RECOVERY 30

/*
  The initial speed of the lowest nodes is v = depth / recovery, 0.2 m/s. If one end of a bar is
  moved with v, the other end moves with 2 v when the wave arrives there; the bar then has the
  energy M v^2, half kinetic and half strain energy. That of its weight is 1e-3 J.
*/
static PetscErrorCode check_overlap(const char *element, const char *response, const char *obstacle)
{
  const PetscReal v = DEPTH * (1 - PetscExpReal(-1. / RECOVERY)) / STEP;
  const PetscBool springs = (PetscBool)(response[0] == 'p' && response[1] == 'e');
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("overlap, %s, %s, %.5s", element, response, obstacle);
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_translate -0.05,-0.05,%g -body_a_element %s -effects gravity,floor "
    "-effect_floor_type "
    "contact -effect_floor_response projected -effect_floor_obstacle %s -effect_floor_response %s "
    "-effect_floor_separation_steps %d -time euler_implicit -ts_dt %g -ts_max_time %g -snes_rtol "
    "1e-8" VERIFY_BODY("a", "box:0.1,0.1,0.1:3", "corotated", "5e4", "0.3"),
    -DEPTH, element, obstacle, response, RECOVERY, STEP, (5 * RECOVERY + 3) * STEP));
  VERIFY_LESS(record_max(&r, "speed"), 2 * v, "fastest node, m/s");
  VERIFY_LESS(record_max(&r, "energy"), MASS * v * v + 1e-3, "energy of the block, J");

  /* springs have a small penetration under the weight */
  for (int k = 1; k <= 5; k += 4)
    VERIFY_NEAR(record_at(&r, "floor_penetration", k * RECOVERY) / DEPTH, PetscExpReal(-k),
                springs ? 2e-3 : 1e-4, "depth after the recovery, once and five times");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ at once */

/* Deep in a mesh its distance field is coarser: the separation direction must still be found. */
static PetscErrorCode check_overlap_mesh(void)
{
  const PetscInt n[3] = {30, 20, 10};
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, table, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(check_overlap("p1", "projected", text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Record r = {0};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_mesh());
  PetscCall(check_groove());
  PetscCall(check_overlap("p1", "projected", "plane:0,0,1,0"));
  verify_case("at once");
  PetscCall(
    record_run(&r, "-bodies a -effects top,floor -effect_top_type fixed -effect_top_on zmax "
                   "-effect_floor_type contact "
                   "-effect_floor_response projected -effect_floor_obstacle plane:0,0,1,0.02 -time "
                   "static" VERIFY_BODY("a", "box:0.1,0.1,0.1:3", "corotated", "5e4", "0.3")));
  VERIFY_LESS(record_last(&r, "floor_penetration"), 1e-7, "depth, m");

  /* E = 5e4 Pa, strain 0.2, area 0.01 m^2: about 100 N */
  VERIFY_MORE(record_last(&r, "floor_force_z"), 90, "force, N");
  if (test_size == 1) {
    PetscCall(check_overlap("cr", "projected", "plane:0,0,1,0"));
    PetscCall(check_overlap("p2", "projected", "plane:0,0,1,0"));
    PetscCall(check_overlap("p1", "augmented", "plane:0,0,1,0"));
    PetscCall(check_overlap("p1", "penalty", "plane:0,0,1,0"));
    PetscCall(check_overlap_mesh());
    PetscCall(check_facets());
  }
  SB_TEST_END();
}
