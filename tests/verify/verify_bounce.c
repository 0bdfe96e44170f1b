// @ranks 1 2
/*
  Restitution at a rigid obstacle.

    ball       a stiff ball that falls on a plane rises to e^2 of its height, repeatedly
    block      a stiff block that lands flat on its base leaves with e times its speed
    bat        a plane that moves with the speed w throws a resting ball with (1 + e) w
    soft       soft bodies of any mesh, time step and e: no step gains energy
*/
#include "contact.h"

#define RADIUS 0.05 /* m */
#define GRAVITY 9.81
#define STEP 0.0005 /* s */

static PetscErrorCode check_ball(const char *element, PetscReal e)
{
  Record r = {.g = GRAVITY};
  PetscReal peak[3] = {
    0}; /* largest height of the centre over that at rest on the plane, before and after each bounce, m */
  int bounces = 0;
  char path[512];

  PetscFunctionBeginUser;
  verify_case("ball, %s, e = %g", element, e);
  PetscCall(contact_ball_write(4, RADIUS, path));
  PetscCall(
    record_run(&r,
               "-bodies a -body_a_element %s -body_a_translate 0,0,%g -effects gravity,floor "
               "-effect_floor_type contact "
               "-effect_floor_response projected -effect_floor_obstacle plane:0,0,1,0 "
               "-effect_floor_restitution %g "
               "-time euler_implicit -ts_dt %g -ts_max_time %g -snes_rtol 1e-10" VERIFY_BODY(
                 "a", "%s", "corotated", "1e11", "0.3"),
               element, 0.2 + RADIUS, e, STEP, e > 0.6 ? 0.9 : 0.65, path));
  for (PetscInt i = 0; i < r.n; i++) {
    const PetscReal height =
      record_at(&r, "centre_z", i) - (record_at(&r, "centre_z", 0) - r.lowest);

    bounces += i && record_at(&r, "momentum_z", i) > 0 && !(record_at(&r, "momentum_z", i - 1) > 0);
    if (bounces < 3)
      peak[bounces] = PetscMax(peak[bounces], height);
  }

  /* the impact is anywhere within a step, on a path of v h; 0.002 for the finite stiffness */
  for (int k = 1; k < 3; k++)
    VERIFY_NEAR(peak[k] / peak[k - 1], e * e,
                STEP * PetscSqrtReal(2 * GRAVITY / peak[k - 1]) + 0.002,
                "part of the height after a bounce");

  /* accuracy of nodes on the obstacle, 1e-7 of the size, times the weight: when the ball comes to
     rest */
  VERIFY_LESS(record_gain(&r, "energy"), 1e-7 * 4 * RADIUS * r.mass * GRAVITY,
              "largest gain of a step, J");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_block(const char *what, const char *obstacle, const char *more,
                                  PetscReal expected)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("%s", what);
  PetscCall(record_run(
    &r,
    "-bodies a -effects floor -effect_floor_type contact -effect_floor_response projected "
    "-effect_floor_obstacle %s -effect_floor_restitution 0.6 -time euler_implicit -ts_dt 0.001 "
    "-ts_max_time "
    "0.05 -snes_rtol 1e-10 %s" VERIFY_BODY("a", "box:0.1,0.1,0.1:3", "corotated", "1e11", "0.3"),
    obstacle, more));
  VERIFY_NEAR(record_last(&r, "a_vz"), expected, 2e-3 * expected,
              "speed with which it leaves, m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_soft(PetscReal young, PetscReal dt, PetscReal e)
{
  Record r = {.g = GRAVITY};
  char path[512];

  PetscFunctionBeginUser;
  verify_case("soft, E = %g, dt = %g, e = %g", young, dt, e);
  PetscCall(contact_ball_write(4, RADIUS, path));
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_translate 0,0,%g -body_a_angular_velocity 3,5,7 -effects gravity,floor "
    "-effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle "
    "plane:0,0.1,1,0 -effect_floor_restitution %g -time euler_implicit -ts_dt %g -ts_max_time 0.4 "
    "-snes_rtol 1e-8" VERIFY_BODY("a", "%s", "corotated", "%g", "0.3"),
    0.05 + RADIUS, e, dt, path, young));

  /* of 0.5 J; the energy of rotating co-rotated tets is not exactly convex */
  VERIFY_LESS(record_gain(&r, "energy"), 1e-6, "largest gain of a step, J");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char falls[] = "-body_a_translate 0,0,0.0104 -body_a_velocity 0,0,-1 ";
  static const PetscReal soft[][3] = {
    {1e5, 0.001, 1}, {1e5, 0.005, 1}, {1e6, 0.001, 0.5}, {1e7, 0.001, 1}, {1e4, 0.002, 0.8}};
  char multiplier[256];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(
    PetscSNPrintf(multiplier, sizeof(multiplier), "%s -effect_floor_response multiplier", falls));
  PetscCall(check_ball("p1", 0.5));
  PetscCall(check_ball("cr", 0.5));
  PetscCall(check_ball("p2", 0.5));
  PetscCall(check_block("block", "plane:0,0,1,0", falls, 0.6));
  PetscCall(check_block("block, multiplier", "plane:0,0,1,0", multiplier, 0.6));
  PetscCall(check_block("bat", "plane:0,0,1,-0.01", "-effect_floor_displacement 0;0;0.5*t", 0.8));
  if (test_size > 1)
    SB_TEST_END();
  PetscCall(check_ball("p1", 0.8));
  for (int k = 0; k < 5; k++)
    PetscCall(check_soft(soft[k][0], soft[k][1], soft[k][2]));
  SB_TEST_END();
}
