// @ranks 1 2
/*
  Contact between bodies.

    stack      a block on a block with another mesh, loaded from above: uniform stress if the method
    can represent it, the
               lower block carries the load, gaps are closed
    bars       two equal bars that collide end to end: contact duration and exchange of velocities
    of the wave solution
    momentum   oblique collision of two free blocks, with friction: momentum and angular momentum
    are conserved, energy never increases slope      friction between two bodies: a block on a slope
    of tan 0.5 sticks with a coefficient of 0.51, and slides with 0.49
*/
#include "contact.h"

/* ------------------------------------------------------------------ stack */

#define LOAD 500.0 /* Pa */
#define BLOCK(b, mesh) VERIFY_BODY(b, mesh, "linear", "1e5", "0.3")

static PetscErrorCode check_stack(const char *element, int upper, PetscReal tolerance)
{
  PetscReal worst, force[6];
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("stack, %s, %d on 2", element, upper);
  PetscCall(test_open(
    &t,
    "-bodies a,b -body_b_translate 0,0,0.05 -body_a_element %s -body_b_element %s -sets "
    "x0,y0,bottom,top "
    "-set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -set_bottom_at plane:0,0,1,0 -set_top_at "
    "plane:0,0,1,0.1 -time static -ksp_rtol 1e-12 -snes_rtol 1e-12 -effects x,y,z,load,meet "
    "-effect_x_type "
    "fixed -effect_x_on x0 -effect_x_components x -effect_y_type fixed -effect_y_on y0 "
    "-effect_y_components "
    "y -effect_z_type fixed -effect_z_on bottom -effect_z_components z -effect_load_type traction "
    "-effect_load_on top -effect_load_vector 0;0;%g -effect_meet_type contact" BLOCK(
      "a", "box:0.1,0.1,0.05:2") BLOCK("b", "box:0.1,0.1,0.05:%d"),
    element, element, -LOAD, upper));
  PetscCall(record_solve(&t, &r));
  PetscCall(contact_stress_error(&t, LOAD, &worst));
  PetscCall(contact_body_forces(t.run, 1, force));
  PetscCall(test_scene_close(&t));
  VERIFY_LESS(worst, tolerance, "stress from uniform, of the load");

  /* pairs at edges have small lateral forces */
  VERIFY_NEAR(record_last(&r, "meet_normal_force"), LOAD * 0.01, 0.01 * LOAD * 0.01,
              "load on the lower block, N");
  VERIFY_NEAR(record_last(&r, "meet_penetration"), 0, 1e-7 * 0.2, "penetration, m");
  VERIFY_NEAR(force[5], LOAD * 0.01, 1e-6 * LOAD * 0.01, "contact force on the upper block, N");
  VERIFY_NEAR(force[2] + force[5], 0, 1e-9 * LOAD * 0.01, "contact forces of both blocks, N");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bars */

#define SPEED 0.1 /* m/s, speed of each bar */

/* Length 1, wave speed 10: in contact for 0.2 s from t = 0.01, then with exchanged velocities. */
static PetscErrorCode check_bars(const char *element)
{
  Record r = {0};
  PetscReal first, last;

  PetscFunctionBeginUser;
  verify_case("bars, %s", element);
  PetscCall(record_run(
    &r,
    "-bodies a,b -body_b_translate 1.002,0,0 -body_a_element %s -body_b_element %s "
    "-body_a_velocity %g,0,0 "
    "-body_b_velocity %g,0,0 -effects meet -effect_meet_type contact -time euler_implicit -ts_dt "
    "0.0005 "
    "-ts_max_time 0.25 -ksp_rtol 1e-10" VERIFY_BODY("a", "box:1,0.05,0.05:1", "linear", "1e5", "0")
      VERIFY_BODY("b", "box:1,0.05,0.05:1", "linear", "1e5", "0"),
    element, element, SPEED, -SPEED));
  record_span(&r, "meet_contacts", 0, &first, &last);
  VERIFY_NEAR(first, 0.01, 0.003, "first touch, s"); /* the barrier width is reached earlier */
  VERIFY_NEAR(last - first, 0.2, 0.01, "time of contact, s");
  VERIFY_NEAR(record_last(&r, "a_vx"), -SPEED, 0.1 * SPEED, "velocity of the first bar, m/s");
  VERIFY_NEAR(record_last(&r, "b_vx"), SPEED, 0.1 * SPEED, "velocity of the second bar, m/s");
  VERIFY_LESS(record_size(&r, "momentum", PETSC_FALSE), 1e-8 * 2.5 * SPEED, "momentum, kg m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ momentum */

static PetscErrorCode check_momentum(const char *element, PetscReal friction)
{
  Record r = {0};
  PetscReal first, last;

  PetscFunctionBeginUser;
  verify_case("momentum, %s, friction %g", element, friction);
  PetscCall(record_run(
    &r,
    "-bodies a,b -body_b_translate 0.11,0.03,0.02 -body_b_rotate 1,2,3,20 -body_a_element %s "
    "-body_b_element "
    "%s -body_a_velocity 0.8,0,0 -body_b_velocity -1,0,0 -effects meet -effect_meet_type contact "
    "-effect_meet_friction %g -time euler_implicit -ts_dt 0.001 -ts_max_time 0.1 -ksp_rtol 1e-11 "
    "-snes_rtol "
    "1e-11" VERIFY_BODY("a", "box:0.1,0.1,0.1:2", "corotated", "2e4", "0.3")
      VERIFY_BODY("b", "box:0.1,0.08,0.1:3", "corotated", "2e4", "0.3"),
    element, element, friction));
  record_span(&r, "meet_contacts", 0, &first, &last);
  VERIFY_MORE(last - first, 0.005, "time of contact, s");
  VERIFY_MORE(record_last(&r, "b_vx") - record_last(&r, "a_vx"), 0,
              "speed at which they part, m/s");
  VERIFY_LESS(record_size(&r, "momentum", PETSC_FALSE), 1e-9 / PetscSqrtReal(3),
              "momentum, kg m/s");
  verify_show("angular momentum, kg m^2/s", record_size(&r, "angular", PETSC_FALSE));
  verify_show("largest gain of a step, J", record_gain(&r, "energy"));
  verify_show("taken by friction, J", record_last(&r, "meet_friction_loss"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ slope */

/* A stiff block on a stiff one, gravity as on a slope of tan 0.5: its speed along the slope is that
   of a rigid block. */
static PetscErrorCode check_slope(PetscReal mu, PetscReal tolerance)
{
  const PetscReal c = 9.81 / PetscSqrtReal(1.25);
  const PetscReal end = 0.2;
  const PetscReal rigid = PetscMax(0.5 - mu, 0) * c * end;
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("slope of 0.5, friction %g", mu);
  PetscCall(record_run(
    &r,
    "-bodies a,b -body_b_translate 0.02,0.021,0.05 -sets bottom -set_bottom_at plane:0,0,1,0 -time "
    "euler_implicit -ts_dt 0.002 -ts_max_time %g -effects gravity,hold,meet -effect_gravity_vector "
    "%g,0,%g "
    "-effect_hold_type fixed -effect_hold_on bottom -effect_meet_type contact "
    "-effect_meet_friction "
    "%g" VERIFY_BODY("a", "box:0.3,0.1,0.05:1", "linear", "1e7", "0.3")
      VERIFY_BODY("b", "box:0.06,0.06,0.03:1", "linear", "1e7", "0.3"),
    end, 0.5 * c, -c, mu));
  VERIFY_NEAR(record_last(&r, "b_vx"), rigid, tolerance, "speed, m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);

  /* stress of single tets: areas of pairs at edges and corners differ from those of a uniform
     pressure; errors of 11 to 19 % */
  PetscCall(check_stack("p1", 3, 0.2));
  PetscCall(check_stack("cr", 2, 0.25));
  PetscCall(check_stack("p2", 2, 0.25));
  PetscCall(check_bars("p1"));
  PetscCall(check_momentum("dg", 0));
  PetscCall(check_momentum("p2", 0.3));
  PetscCall(check_momentum("p1", 0.3));
  if (test_size > 1)
    SB_TEST_END(); /* many solves of a small system: on one rank only */
  PetscCall(check_stack("p1", 2, 0.2));
  PetscCall(check_bars("cr"));
  PetscCall(check_bars("p2"));
  PetscCall(check_momentum("p1", 0));

  /* friction sticks below 1e-4 of the speed scale of the step, which for weights and supports is
     some m/s */
  PetscCall(check_slope(0.51, 2e-4));
  PetscCall(check_slope(0.49, 0.08 * 0.01 * 1.755));
  PetscCall(check_slope(0.2, 0.01 * 0.3 * 1.755));
  SB_TEST_END();
}
