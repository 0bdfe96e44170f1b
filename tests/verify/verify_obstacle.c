// @ranks 1 2
/*
  Rigid obstacles given by a mesh, and bodies that overlap an obstacle at first.

    mesh       a block that falls on a box and slides over its edge moves as well when the box is a mesh of tets
    facets     a ball of facets that presses and drags gives the force of the round one, and no step fails
    groove     the edge of a block in a groove, where facets of one mesh push from two sides, against two planes
    overlap    a block that begins 30 % of its height behind a plane is brought out: how fast, how deep it still is after
               1 and 5 times `recovery`, and what energy it gets; with every response and element
    at_once    a static run closes the same overlap in its first step
*/
#include "../unit/surface_files.h"
#include "contact.h"

static PetscErrorCode open_scene(TestScene *t, const char *format, ...)
{
  char text[VERIFY_TEXT];
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(PetscVSNPrintf(text, sizeof(text), format, NULL, args));
  va_end(args);
  PetscCall(test_scene_open(text, t));
  t->run->want_residual = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ mesh */

/* The box of the obstacle, 0.3 x 0.2 x 0.1 m below z = 0. */
static void table(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  (void)n;
  (void)at;
  (void)ctx;
  x[0] = 0.3 * x[0] - 0.2;
  x[1] = 0.2 * x[1] - 0.1;
  x[2] = 0.1 * x[2] - 0.1;
}

typedef struct {
  PetscReal force, most;
} Fall;

static PetscErrorCode watch_fall(SbRun run, const SbStep *step, void *ctx)
{
  Fall *f = (Fall *)ctx;

  PetscFunctionBeginUser;
  PetscCall(contact_column(run, step->t, "floor", "force_z", &f->force));
  f->most = PetscMax(f->most, f->force);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fall_on(const char *obstacle, PetscReal *u[], PetscInt *n, Fall *f)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(f, sizeof(*f)));
  PetscCall(open_scene(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.05:2 -body_a_material corotated -body_a_young 2e4 "
    "-body_a_poisson 0.3 -body_a_density 1000 -body_a_rotate 1,2,0,15 -body_a_translate -0.02,-0.047,0.03 "
    "-body_a_velocity 0.5,0,-0.5 -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_obstacle %s -effect_floor_friction 0.2 -time euler_implicit -ts_dt 0.005 "
    "-ts_max_time 0.15 -snes_rtol 1e-12 -ksp_rtol 1e-11",
    obstacle));
  PetscCall(SbRunAddMonitor(t.run, watch_fall, f, NULL));
  PetscCall(verify_solve(&t, obstacle));
  *n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->U, u));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_mesh(void)
{
  const PetscInt n[3] = {6, 4, 2};
  PetscReal *u[2], off;
  PetscInt length;
  Fall f[2];
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, table, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(fall_on("box:-0.2,-0.1,-0.1,0.1,0.1,0", &u[0], &length, &f[0]));
  PetscCall(fall_on(text, &u[1], &length, &f[1]));
  off = verify_difference(length, u[0], u[1]);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  mesh: displacements differ by %.1e of the largest; force up to %.3g N, at the end "
                        "%.6g and %.6g N\n",
                        (double)off, (double)f[0].most, (double)f[0].force, (double)f[1].force));
  SB_CHECK(f[0].most > 20, "it hit the box with %g N", (double)f[0].most);
  /* distances agree to rounding; friction is settled to a part of its force, which rounding may decide */
  SB_CHECK(off < 1e-6, "on the mesh of the box displacements differ by %g", (double)off);
  for (int k = 0; k < 2; k++) PetscCall(PetscFree(u[k]));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ facets */

#define DRAG_STEPS 20 /* the first half of them downwards */
#define DOWN_STEPS 10
#define DRAG_DT 0.02 /* s */

static PetscErrorCode watch_drag(SbRun run, const SbStep *step, void *ctx)
{
  static const char *const columns[3] = {"force_x", "force_y", "force_z"};
  PetscReal *force = (PetscReal *)ctx + 3 * (PetscInt)PetscFloorReal(step->t / DRAG_DT + 0.5);

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) PetscCall(contact_column(run, step->t, "tool", columns[k], &force[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode drag(const char *obstacle, PetscReal force[])
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(open_scene(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.06,0.04:4 -body_a_material corotated -body_a_young 2e4 "
    "-body_a_poisson 0.4 -body_a_density 1000 -effects bed,tool -effect_bed_type fixed -effect_bed_on zmin "
    "-effect_tool_type contact -effect_tool_on zmax -effect_tool_obstacle %s -effect_tool_friction 0.3 "
    "-effect_tool_displacement 0.02*ramp(t/0.2-1);0;-0.01*ramp(t/0.2) -time euler_implicit -ts_dt %g "
    "-ts_max_time "
    "%g",
    obstacle, DRAG_DT, DRAG_DT * DRAG_STEPS));
  PetscCall(SbRunAddMonitor(t.run, watch_drag, force, NULL));
  PetscCall(verify_solve(&t, obstacle));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  facets: %.6s: %d solves, %d steps failed\n", obstacle,
                        (int)t.run->newton_total, (int)t.run->rejected_total));
  SB_CHECK(!t.run->rejected_total, "%s: %d steps failed", obstacle, (int)t.run->rejected_total);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Edges of 3 to 5 mm with their corners on the sphere, one of them pointing down and ridges along the rows of vertices of the block.
  The middles of facets are 0.2 mm inside of the sphere: at a depth of 10 mm that is 2 % of it and 3 % of the force. Then nodes
  come and go one by one, at other moments than with the sphere; no step fails.
*/
static PetscErrorCode check_facets(void)
{
  PetscReal force[2][3 * (DRAG_STEPS + 1)] = {{0}}, off;
  TestSurface s = {0};
  char path[512], text[600];

  PetscFunctionBeginUser;
  test_surface_sphere(3, &s);
  for (PetscInt v = 0; v < s.nvert; v++) {
    for (int k = 0; k < 3; k++) s.x[v][k] = 0.015 * s.x[v][k] + (k == 0 ? 0.05 : k == 1 ? 0.031 : 0.055);
  }
  PetscCall(test_file_write(".off", PETSC_FALSE, &s, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(drag("sphere:0.05,0.031,0.055,0.015", force[0]));
  PetscCall(drag(text, force[1]));
  off = verify_difference(3 * (DOWN_STEPS + 1), force[0], force[1]);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  facets: downwards forces differ by %.3f of the largest, %.3g N\n", (double)off,
                        (double)force[0][3 * DRAG_STEPS + 2]));
  SB_CHECK(force[0][3 * DRAG_STEPS + 2] < -0.5, "pressed by %g N", (double)force[0][3 * DRAG_STEPS + 2]);
  SB_CHECK(off < 0.035, "the forces of facets and sphere differ by %g", (double)off);
  PetscCall(test_file_remove(path));
  test_surface_free(&s);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ groove */

static PetscErrorCode lie(const char *obstacles, PetscReal *strain, PetscReal *weight)
{
  TestScene t;
  SbEnergies e;
  PetscReal force[2] = {0, 0};

  PetscFunctionBeginUser;
  PetscCall(open_scene(&t,
                       "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_rotate 0,1,0,-45 -body_a_translate "
                       "0.001,-0.05,0.005 -body_a_material corotated -body_a_young 2e4 -body_a_poisson 0.3 "
                       "-body_a_density 1000 -time euler_implicit -ts_dt 0.01 -ts_max_time 1.2 %s",
                       obstacles));
  PetscCall(verify_solve(&t, obstacles));
  PetscCall(SbModelEnergies(t.model, t.run->U, t.run->V, &e));
  PetscCall(contact_column(t.run, 1.2, "l", "force_z", &force[0]));
  if (contact_effect(t.model, "r")) PetscCall(contact_column(t.run, 1.2, "r", "force_z", &force[1]));
  *strain = e.strain;
  *weight = force[0] + force[1];
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_groove(void)
{
  PetscReal strain[2], weight[2];
  char path[512], text[700];

  PetscFunctionBeginUser;
  PetscCall(
    test_file_write(".off", PETSC_FALSE, NULL,
                    "OFF 10 7 0\n0 -0.2 0\n0.2 -0.2 0.2\n0.2 -0.2 -0.1\n-0.2 -0.2 -0.1\n-0.2 -0.2 0.2\n"
                    "0 0.2 0\n0.2 0.2 0.2\n0.2 0.2 -0.1\n-0.2 0.2 -0.1\n-0.2 0.2 0.2\n5 0 4 3 2 1\n"
                    "5 5 6 7 8 9\n4 0 1 6 5\n4 1 2 7 6\n4 2 3 8 7\n4 3 4 9 8\n4 4 0 5 9\n",
                    path));
  PetscCall(PetscSNPrintf(text, sizeof(text),
                          "-effects gravity,l -effect_l_type contact -effect_l_obstacle mesh:%s", path));
  PetscCall(
    lie("-effects gravity,l,r -effect_l_type contact -effect_l_obstacle plane:1,0,1,0 -effect_r_type contact "
        "-effect_r_obstacle plane:-1,0,1,0",
        &strain[0], &weight[0]));
  PetscCall(lie(text, &strain[1], &weight[1]));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  groove: strain energy %.4e J on two planes, %.4e J on a mesh; weight carried %.4f and %.4f N\n",
    (double)strain[0], (double)strain[1], (double)weight[0], (double)weight[1]));
  SB_CHECK_NEAR(weight[1], 9.81, 0.01 * 9.81, "weight in the groove");
  SB_CHECK_NEAR(strain[1], strain[0], 0.02 * strain[0], "strain energy in the groove");
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ overlap */

#define DEPTH 0.03 /* m, of a height of 0.1 */
#define MASS 1.0   /* kg */
#define STEP 0.005 /* s */
#define RECOVERY 30

typedef struct {
  PetscReal speed, energy, depth[2]; /* largest of the steps; depth after 1 and 5 times RECOVERY */
} Overlap;

static PetscErrorCode watch_overlap(SbRun run, const SbStep *step, void *ctx)
{
  Overlap *o = (Overlap *)ctx;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  o->speed = PetscMax(o->speed, e.max_speed);
  o->energy = PetscMax(o->energy, e.kinetic + e.strain);
  for (int k = 0; k < 2; k++) {
    if (step->step != (k ? 5 : 1) * RECOVERY) continue;
    PetscCall(contact_column(run, step->t, "floor", "penetration", &o->depth[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  The lowest nodes begin with the speed v = depth / recovery, 0.2 m/s. A bar that is pushed with v from one end moves with 2 v at the other when the
  wave arrives there, and has the energy M v^2 then: half of it motion, half of it strain. That of its weight is 1e-3 J.
*/
static PetscErrorCode check_overlap(const char *element, const char *response, const char *obstacle)
{
  const PetscReal v = DEPTH * (1 - PetscExpReal(-1. / RECOVERY)) / STEP;
  const PetscBool springs = (PetscBool)(response[0] == 'p' && response[1] == 'e');
  Overlap o;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&o, sizeof(o)));
  PetscCall(open_scene(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material corotated -body_a_young 5e4 "
    "-body_a_poisson 0.3 -body_a_density 1000 -body_a_translate -0.05,-0.05,%g -body_a_element %s -effects "
    "gravity,floor -effect_floor_type contact -effect_floor_obstacle %s -effect_floor_response %s "
    "-effect_floor_separation_steps %d -time euler_implicit -ts_dt %g -ts_max_time %g -snes_rtol 1e-8",
    -DEPTH, element, obstacle, response, RECOVERY, STEP, (5 * RECOVERY + 3) * STEP));
  PetscCall(SbRunAddMonitor(t.run, watch_overlap, &o, NULL));
  PetscCall(verify_solve(&t, "overlap"));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  overlap, %s, %s, %.5s: speed up to %.3f v, energy up to %.3f M v^2, %.3f and %.4f of "
                "the depth after 1 and 5 times recovery\n",
                element, response, obstacle, (double)(o.speed / v), (double)(o.energy / (MASS * v * v)),
                (double)(o.depth[0] / DEPTH), (double)(o.depth[1] / DEPTH)));
  SB_CHECK(o.speed < 2 * v, "a node has %g m/s", (double)o.speed);
  SB_CHECK(o.energy < MASS * v * v + 1e-3, "the block has got %g J", (double)o.energy);
  /* the springs give a little under the weight */
  SB_CHECK_NEAR(o.depth[0] / DEPTH, PetscExpReal(-1), springs ? 2e-3 : 1e-4, "depth after recovery");
  SB_CHECK_NEAR(o.depth[1] / DEPTH, PetscExpReal(-5), springs ? 2e-3 : 1e-4,
                "depth after five times recovery");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ at once */

/* Deep in a mesh its field is coarser: the separation direction is found all the same. */
static PetscErrorCode check_overlap_mesh(void)
{
  const PetscInt n[3] = {30, 20, 10};
  char path[512], text[600];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, table, NULL, path));
  PetscCall(PetscSNPrintf(text, sizeof(text), "mesh:%s", path));
  PetscCall(check_overlap("p1", "projected", text));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_at_once(void)
{
  TestScene t;
  PetscReal depth, force;

  PetscFunctionBeginUser;
  PetscCall(
    open_scene(&t, "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material corotated -body_a_young 5e4 "
                   "-body_a_poisson 0.3 -body_a_density 1000 -effects top,floor -effect_top_type fixed "
                   "-effect_top_on zmax "
                   "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0.02 -time static"));
  PetscCall(verify_solve(&t, "at once"));
  PetscCall(contact_column(t.run, 1, "floor", "penetration", &depth));
  PetscCall(contact_column(t.run, 1, "floor", "force_z", &force));
  /* E = 5e4 Pa, a strain of 0.2 and an area of 0.01 m^2: about 100 N */
  SB_CHECK(depth < 1e-7 && force > 90, "static: %g m deep, %g N", (double)depth, (double)force);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_mesh());
  PetscCall(check_groove());
  PetscCall(check_overlap("p1", "projected", "plane:0,0,1,0"));
  PetscCall(check_at_once());
  if (size == 1) {
    PetscCall(check_overlap("cr", "projected", "plane:0,0,1,0"));
    PetscCall(check_overlap("p1", "augmented", "plane:0,0,1,0"));
    PetscCall(check_overlap("p1", "penalty", "plane:0,0,1,0"));
    PetscCall(check_overlap_mesh());
    PetscCall(check_facets());
  }
  SB_TEST_END();
}
