// @ranks 1 2
/*
  Newmark with contact (src/time/second_order.c).

    wall      an elastic bar hits a wall: contact duration and rebound speed against the wave
    solution and implicit Euler; no step gains energy bars      two bars collide: they exchange
    their velocities, apart from the effect of the mass of the contact nodes; momentum ball      a
    soft ball bounces on a plane: no step gains energy, the momentum changes by the forces rest
    a block at rest on a plane, and one on another: forces are the weights, and constant push
    an accelerating plane pushes a block
*/
#include "contact.h"

#define SPEED 0.1                          /* m/s; bars are 1 m long, waves run at 10 m/s */
#define ENERGY (0.5 * 2.5 * SPEED * SPEED) /* J, of one bar */
#define TOUCH (1e-3 * 2.5) /* N, of the force of the wave solution: threshold of contact */
#define BAR(b) VERIFY_BODY(b, "box:1,0.05,0.05:1", "linear", "1e5", "0")
#define BLOCK(b, poisson) VERIFY_BODY(b, "box:0.1,0.1,0.1:2", "linear", "1e5", poisson)
#define EXACT " -ksp_rtol 1e-11 -snes_rtol 1e-11 "

/* Bars: remaining fractions of relative speed and energy, first and last time of contact, s, and
   energy gain, J. */
typedef struct {
  PetscReal speed, energy, first, last, gain;
} Left;

static PetscErrorCode check_wall(const char *time, const char *more, PetscReal dt, Left *left)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("wall, %s, dt = %g %s", time, dt, more);
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_velocity %g,0,0 -body_a_translate %.15g,0,0 -effects wall "
    "-effect_wall_type contact -effect_wall_response projected -effect_wall_on xmin "
    "-effect_wall_obstacle plane:1,0,0,0 -time %s -ts_dt %g -ts_max_time %g %s" EXACT BAR("a"),
    -SPEED, SPEED * 10.3 * dt, time, dt, 0.24 + 12 * dt, more));
  *left =
    (Left){.speed = record_last(&r, "a_vx") / SPEED, .energy = record_last(&r, "energy") / ENERGY};
  record_span(&r, "wall_force_x", TOUCH, &left->first, &left->last);
  VERIFY_NEAR(left->last - left->first, 0.2, 0.02, "time at the wall, s");
  VERIFY_LESS(record_gain(&r, "energy"), 1e-12, "largest gain of a step, J");
  verify_show("largest force, N", record_max(&r, "wall_force_x"));
  verify_show("part of the speed that is left", left->speed);
  verify_show("part of the energy that is left", left->energy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compares with implicit Euler: larger fractions of both remain. */
static void check_better(const Left *left, const Left *euler, PetscBool energy)
{
  /* the end node of 20 cells has 1/40 of the mass */
  if (energy)
    VERIFY_LESS(1 - left->energy, 0.4 * (1 - euler->energy),
                "energy lost, with implicit Euler more");
  VERIFY_MORE(left->speed, euler->speed + 0.02, "speed that is left, with implicit Euler less");
}

static PetscErrorCode collide(const char *time, const char *more, Left *left)
{
  Record r = {0};
  PetscReal change;

  PetscFunctionBeginUser;
  verify_case("bars, %s %s", time, more);
  PetscCall(record_run(
    &r,
    "-bodies a,b -body_a_velocity %g,0,0 -body_b_velocity %g,0,0 -body_b_translate 1.002,0,0 "
    "-effects meet "
    "-effect_meet_type contact -time %s -ts_dt 0.0005 -ts_max_time 0.25 %s" EXACT BAR("a") BAR("b"),
    SPEED, -SPEED, time, more));
  left->speed = (record_last(&r, "b_vx") - record_last(&r, "a_vx")) / (2 * SPEED);
  left->energy = record_last(&r, "energy") / (2 * ENERGY);
  left->gain = record_gain(&r, "energy");
  record_span(&r, "meet_normal_force", TOUCH, &left->first, &left->last);
  change = PetscMax(record_max(&r, "momentum_x") - record_at(&r, "momentum_x", 0),
                    record_at(&r, "momentum_x", 0) - record_min(&r, "momentum_x"));
  VERIFY_NEAR(left->first, 0.01, 0.003,
              "first touch, s"); /* the barrier width is reached earlier */
  VERIFY_NEAR(left->last - left->first, 0.2, 0.01, "time of contact, s");

  /* tolerance of the gaps, 1e-7 of the size, times the force of the wave solution */
  VERIFY_LESS(left->gain, 2e-7 * 2.5, "largest gain of a step, J");
  VERIFY_LESS(change, 1e-10 * 2.5 * SPEED, "change of momentum, kg m/s");
  verify_show("part of the velocities that is exchanged", left->speed);
  verify_show("part of the energy that is left", left->energy);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_bars(void)
{
  static const char *const more[] = {"", "-body_a_element cr -body_b_element cr",
                                     "-body_a_element p2 -body_b_element p2"};
  Left euler, left;

  PetscFunctionBeginUser;
  PetscCall(collide("euler_implicit", "", &euler));
  for (int k = 0; k < 3; k++) {
    PetscCall(collide("newmark", more[k], &left));
    check_better(&left, &euler, (PetscBool)!k);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_ball(const char *material, PetscReal tolerance)
{
  Record r = {.g = 9.81};
  char path[512];

  PetscFunctionBeginUser;
  verify_case("ball, %s", material);
  PetscCall(contact_ball_write(4, 0.05, path));
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_translate 0,0,0.1 -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_response projected -effect_floor_obstacle plane:0,0,1,0 -time newmark -ts_dt "
    "0.001 -ts_max_time 0.6" EXACT VERIFY_BODY("a", "%s", "%s", "5e4", "0.3"),
    path, material));
  VERIFY_MORE(record_starts(&r, "floor_contacts"), 2, "landings");
  VERIFY_LESS(record_gain(&r, "energy"), tolerance * record_at(&r, "energy", 0),
              "largest gain of a step, J");
  VERIFY_LESS(record_max(&r, "missing"), 1e-9, "momentum that no force explains, kg m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest second difference of a force over the steps after `from`. */
static PetscReal roughness(const Record *r, const char *name)
{
  PetscReal most = 0;

  for (PetscInt i = 2; i < r->n; i++) {
    if (record_at(r, "t", i - 2) < r->from)
      continue;
    most = PetscMax(most, PetscAbsReal(record_at(r, name, i) - 2 * record_at(r, name, i - 1) +
                                       record_at(r, name, i - 2)));
  }
  return most;
}

/* A block on a floor and another one on it come to rest by damping: 9.81 N each. */
static PetscErrorCode check_rest(void)
{
  static const char *const force[2] = {"floor_force_z", "meet_normal_force"};
  Record r = {.from = 0.8 - 1e-9};

  PetscFunctionBeginUser;
  verify_case("rest");
  PetscCall(record_run(
    &r, "-bodies a,b -body_b_translate 0,0,0.1 -effects gravity,damp,floor,meet -effect_damp_type "
        "damping "
        "-effect_damp_alpha 30 -effect_damp_beta 1e-3 -effect_floor_type contact "
        "-effect_floor_obstacle "
        "plane:0,0,1,0 -effect_meet_type contact -time newmark -ts_dt 0.004 -ts_max_time 0.85" EXACT
          BLOCK("a", "0.3") BLOCK("b", "0.3")));

  /* normal forces of pairs at edges are slightly inclined */
  for (int k = 0; k < 2; k++) {
    VERIFY_NEAR(record_min(&r, force[k]), k ? 9.81 : 19.62, k ? 0.1 : 1e-3, "smallest force, N");
    VERIFY_NEAR(record_max(&r, force[k]), k ? 9.81 : 19.62, k ? 0.1 : 1e-3, "largest force, N");
  }
  VERIFY_LESS(PetscMax(roughness(&r, force[0]), roughness(&r, force[1])), 2e-3,
              "change to and fro, N");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block on a plane, initially without stress: it oscillates without damping, and the force
   oscillates smoothly with it. */
static PetscErrorCode check_smooth(void)
{
  Record r = {.from = 0.02 - 1e-9};

  PetscFunctionBeginUser;
  verify_case("smooth");
  PetscCall(record_run(
    &r,
    "-bodies a -effects weight,floor -effect_floor_type contact -effect_floor_response projected "
    "-effect_floor_on zmin -effect_floor_obstacle plane:0,0,1,0 -effect_weight_type body_force "
    "-effect_weight_density 0;0;-9810*ramp(t/0.2) -time newmark -ts_dt 0.0005 -ts_max_time "
    "0.3" EXACT BLOCK("a", "0")));
  VERIFY_NEAR(record_max(&r, "floor_force_z"), 10, 1, "largest force, N");
  VERIFY_LESS(roughness(&r, "floor_force_z"), 0.02, "change to and fro, N");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A floor with an acceleration of 10 m/s^2 lifts a soft block: they move together. */
static PetscErrorCode check_push(const char *response)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("push, %s", response);
  PetscCall(
    record_run(&r,
               "-bodies a -effects damp,floor -effect_damp_type damping -effect_damp_beta 2e-3 "
               "-effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle "
               "plane:0,0,1,0 -effect_floor_displacement 0;0;5*t*t -effect_floor_response %s -time "
               "newmark -ts_dt 0.001 -ts_max_time 0.2" EXACT BLOCK("a", "0.3"),
               response));
  VERIFY_NEAR(record_last(&r, "a_vz"), 2, 0.02, "speed of the block, m/s");
  VERIFY_LESS(record_max(&r, "missing"), 1e-3, "momentum that no force explains, kg m/s");
  VERIFY_NEAR(record_max(&r, "floor_penetration"), 0, 0, "penetration, m");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Left euler, left, other;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_rest());
  if (test_size == 1)
    PetscCall(check_push("projected"));
  PetscCall(check_push("multiplier"));
  PetscCall(check_smooth());
  if (test_size > 1)
    SB_TEST_END(); /* many steps of small systems: on one rank only */
  PetscCall(check_ball("linear", 1e-9));
  PetscCall(check_ball("corotated", 1e-4));
  PetscCall(check_wall("euler_implicit", "", 0.0005, &euler));
  PetscCall(check_wall("newmark", "", 0.0005, &left));
  check_better(&left, &euler, PETSC_TRUE);
  PetscCall(check_wall("newmark", "-effect_wall_time_of_impact yes", 0.0005, &other));
  VERIFY_NEAR(other.energy, left.energy, 0.01, "energy with steps cut at the arrival");
  PetscCall(check_wall("newmark", "", 0.002, &left));
  PetscCall(check_wall("newmark", "-effect_wall_response multiplier", 0.002, &other));
  VERIFY_NEAR(other.speed, left.speed, 1e-6, "speed with multipliers");
  VERIFY_NEAR(other.energy, left.energy, 1e-6, "energy with multipliers");
  PetscCall(check_bars());
  SB_TEST_END();
}
