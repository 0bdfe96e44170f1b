// @ranks 1 2
/*
  A cloth-like plate, one cell thick, falls on a ball and drapes over it. The ball is a rigid
  obstacle, with friction, or a body fixed at its lower end, without.

  No vertex of the plate is inside the rigid ball at the end of a step; in the deformable one the
  penetration is below 0.4 of the plate's thickness (redundant constraints are not corrected); no
  cell is inverted, no step gains energy, the momentum changes by weight and the force of the ball,
  and at the end the plate hangs down on all sides.
*/
#include "pour.h"

#define G 9.81
#define RADIUS 0.05 /* of the ball, m */
#define SIDE 0.2    /* of the plate, m */
#define THICK 0.004 /* m */
#define DROP 0.01   /* m */

static PetscErrorCode check_drape(PetscBool rigid, PetscInt cells, PetscInt thick)
{
  /* the plate's centre, the centres of its sides and its corners, each with its place in the
     minimum depths below the start, m */
  static const PetscInt at[9][3] = {{0, 0, 0}, {1, 0, 1},  {-1, 0, 1}, {0, 1, 1},  {0, -1, 1},
                                    {1, 1, 2}, {1, -1, 2}, {-1, 1, 2}, {-1, -1, 2}};
  Record r = {.g = G};
  PetscReal depth[3] = {PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL};
  PetscReal weight, behind;
  PetscReal inside = 0;
  char path[512], how[VERIFY_TEXT / 4];
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("drape, %s, %d cells thick", rigid ? "obstacle" : "body", (int)thick);
  PetscCall(contact_ball_write(4, RADIUS, path));
  if (rigid)
    PetscCall(PetscSNPrintf(how, sizeof(how),
                            "-bodies cloth -effects gravity,ball -effect_ball_type contact "
                            "-effect_ball_response projected -effect_ball_friction 0.3 "
                            "-effect_ball_obstacle sphere:0,0,%g,%g",
                            -RADIUS, RADIUS));
  else
    PetscCall(PetscSNPrintf(
      how, sizeof(how),
      "-bodies cloth,ball -body_ball_mesh %s -body_ball_translate 0,0,%g "
      "-body_ball_material corotated -body_ball_young 2e5 -body_ball_poisson 0.3 -sets foot "
      "-set_foot_at halfspace:0,0,1,%g -effects gravity,foot,meet -effect_foot_type fixed "
      "-effect_foot_on foot -effect_meet_type contact",
      path, -RADIUS, -1.6 * RADIUS));
  PetscCall(test_open(
    &t,
    "%s -body_cloth_mesh box:%g,%g,%g:%d,%d,%d -body_cloth_translate %g,%g,%g "
    "-body_cloth_material corotated -body_cloth_young 5e3 -body_cloth_poisson 0.3 "
    "-time euler_implicit -ts_dt 0.004 -ts_max_time 0.4 -snes_rtol 1e-9 -ksp_rtol 1e-8",
    how, SIDE, SIDE, THICK, (int)cells, (int)cells, (int)thick, -0.5 * SIDE, -0.5 * SIDE, DROP));
  if (!rigid)
    PetscCall(SbRunAddMonitor(t.run, pour_watch, &inside));
  PetscCall(record_solve(&t, &r));
  for (int k = 0; k < 9; k++) {
    const PetscReal x[3] = {0.5 * SIDE * (PetscReal)at[k][0], 0.5 * SIDE * (PetscReal)at[k][1],
                            DROP};
    PetscReal u[3];

    PetscCall(test_value_at(t.model, t.run->state.U, x, u));
    depth[at[k][2]] = PetscMin(depth[at[k][2]], -u[2]);
  }
  PetscCall(test_scene_close(&t));
  weight = G * 1000 * SIDE * SIDE * THICK;
  behind = rigid ? record_max(&r, "ball_penetration") : inside;
  verify_show("solves", (PetscReal)r.newton);
  VERIFY_MORE(depth[2], depth[1] + 0.01, "corners are lower by, m");
  VERIFY_MORE(depth[1], depth[0] + 0.01, "middles of the sides are lower by, m");
  VERIFY_MORE(depth[0], 0.5 * DROP, "the middle is lower by, m");
  VERIFY_LESS(behind, (rigid ? 1e-6 : 0.4) * THICK, "inside the ball, m");
  VERIFY_MORE(record_min(&r, "min_J"), 0, "least det F");
  VERIFY_LESS(record_gain(&r, "energy"), 1e-6 * weight * SIDE, "largest gain of a step, J");
  if (rigid)
    VERIFY_LESS(record_max(&r, "missing"), 1e-5, "momentum that no force explains, kg m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_drape(PETSC_TRUE, 16, 1));
  if (test_size == 1)
    PetscCall(
      check_drape(PETSC_FALSE, 16, 1)); /* many solves of a small system: on one rank only */
  SB_TEST_END();
}
