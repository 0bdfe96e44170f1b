// @ranks 1 3
/*
  Restitution between bodies.

    head-on    stiff blocks and balls in a head-on collision separate with e times their speed, for
    all masses, meshes and
               responses; momentum is conserved, and no energy is gained
    tower      a block that lands on a floor with another one close above it: two impacts of
    different effects in a step oblique    stiff blocks in an oblique collision, with and without
    friction: momentum is conserved, no step gains energy soft       soft balls, for every e: no
    step gains energy self       self-contact of the arms of a soft horseshoe: no step gains energy,
    momentum is conserved
*/
#include "contact.h"

#define TIGHT "-time euler_implicit -snes_rtol 1e-11 -ksp_rtol 1e-11 "
#define STIFF(b, mesh) VERIFY_BODY(b, mesh, "corotated", "1e9", "0.3")
#define MEET "-effect_meet_type contact -effect_meet_restitution %g "

/* The bodies collide; bounds of the energy gain in a step, relative to `energy`, and of the change
   of momentum in a step, relative to the sum of its components. */
static void check_meeting(const Record *r, PetscReal energy, PetscReal gain, PetscReal momentum)
{
  static const char *const v[6] = {"a_vx", "a_vy", "a_vz", "b_vx", "b_vy", "b_vz"};
  PetscReal sum = 0;

  VERIFY_MORE(record_max(r, "meet_contacts"), 0, "pairs");
  VERIFY_LESS(record_gain(r, "energy"), gain * energy, "largest gain of a step, J");
  if (momentum == 0)
    return;
  for (int k = 0; k < 6; k++)
    sum += PetscAbsReal(record_at(r, v[k], 0)); /* bodies of 0.5 to 5 kg */
  VERIFY_LESS(record_size(r, "momentum", PETSC_TRUE), 0.5 * momentum * sum,
              "largest change of momentum, kg m/s");
}

static PetscErrorCode check_pair(const char *what, const char *bodies, PetscReal e)
{
  Record r = {.forces = PETSC_TRUE};
  PetscReal before, after;

  PetscFunctionBeginUser;
  verify_case("%s, e = %g", what, e);
  PetscCall(record_run(&r,
                       TIGHT "-bodies a,b -body_a_velocity 1,0,0 -body_b_translate 0.1207,0,0 "
                             "-body_b_velocity -1,0,0 -effects meet " MEET
                             "-ts_dt 0.01 -ts_max_time 0.04 %s" STIFF("a", "box:0.1,0.1,0.1:2")
                               STIFF("b", "box:0.1,0.1,0.1:2"),
                       (double)e, bodies));
  before = record_at(&r, "a_vx", 0) - record_at(&r, "b_vx", 0);
  after = record_last(&r, "b_vx") - record_last(&r, "a_vx");
  VERIFY_NEAR(after / before, e, 0.01, "relative speed after, of that before");
  VERIFY_LESS(record_max(&r, "net"), 1e-13 * record_max(&r, "push"), "forces of contact in all, N");

  /* stiff bodies: the tolerance of the solves is 1e-11 of the forces */
  check_meeting(&r, record_at(&r, "energy", 0), 1e-9, 2e-10);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_tower(void)
{
  Record r = {.g = 9.81};

  PetscFunctionBeginUser;
  verify_case("tower");
  PetscCall(record_run(
    &r,
    TIGHT "-bodies a,b -body_a_translate 0,0,0.0021 -body_a_velocity 0,0,-1 -body_b_translate "
          "0.01,0.01,0.1024 "
          "-body_b_velocity 0,0,-1 -effects gravity,floor,meet -effect_floor_type contact "
          "-effect_floor_response "
          "barrier -effect_floor_obstacle plane:0,0,1,0 -effect_floor_restitution 1 " MEET
          "-ts_dt 0.001 -ts_max_time 0.03" STIFF("a", "box:0.1,0.1,0.1:2")
            STIFF("b", "box:0.08,0.08,0.08:2"),
    1.));
  VERIFY_MORE(record_last(&r, "b_vz"), 0.5, "speed of the upper block, m/s");
  check_meeting(&r, record_at(&r, "kinetic", 0), 1e-9, 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_oblique(PetscReal friction, PetscReal e)
{
  Record r = {.forces = PETSC_TRUE};

  PetscFunctionBeginUser;
  verify_case("oblique, friction %g, e = %g", friction, e);
  PetscCall(record_run(
    &r,
    TIGHT "-bodies a,b -body_b_translate 0.13,0.03,0.02 -body_b_rotate 1,2,3,20 "
          "-body_a_velocity 0.8,0,0 -body_b_velocity -1,0.2,0 -effects meet " MEET
          "-effect_meet_friction %g -ts_dt 0.001 -ts_max_time 0.05" STIFF("a", "box:0.1,0.1,0.1:2")
            STIFF("b", "box:0.1,0.08,0.1:3"),
    e, friction));
  VERIFY_MORE(record_last(&r, "b_vx") - record_last(&r, "a_vx"), 0,
              "speed at which they part, m/s");
  VERIFY_LESS(record_max(&r, "net"), 1e-13 * record_max(&r, "push"), "forces of contact in all, N");
  verify_show("energy that is left, of that before",
              record_last(&r, "energy") / record_at(&r, "energy", 0));
  check_meeting(&r, record_at(&r, "energy", 0), 1e-6, 1e-10);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_soft(PetscReal young, PetscReal dt, PetscReal e)
{
  Record r = {0};
  char path[512];

  PetscFunctionBeginUser;
  verify_case("soft, E = %g, dt = %g, e = %g", young, dt, e);
  PetscCall(contact_ball_write(4, 0.05, path));
  PetscCall(record_run(
    &r,
    VERIFY_BODY("a", "%s", "corotated", "%g", "0.3") VERIFY_BODY(
      "b", "%s", "corotated", "%g",
      "0.3") "-bodies a,b -body_a_velocity 0.5,0,0 -body_a_angular_velocity 3,5,7 -body_b_density "
             "2000 -body_b_translate 0.11,0.02,0 -body_b_velocity -0.5,0,0 -effects meet " MEET
             "-time euler_implicit -ts_dt %g -ts_max_time 0.1 -snes_rtol 1e-8",
    path, young, path, 2 * young, e, dt));

  /* the energy of rotating co-rotated tets is not exactly convex, even without contact */
  check_meeting(&r, record_at(&r, "energy", 0), 1e-5, 1e-8);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Map of a ring with a gap of 4 % of its circumference. */
static void horseshoe(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal angle = (0.02 + 0.96 * x[0]) * 2 * PETSC_PI;
  const PetscReal r = 0.09 - 0.03 * x[1];

  (void)place;
  x[0] = r * PetscCosReal(angle);
  x[1] = r * PetscSinReal(angle);
  x[2] *= 0.03;
}

static PetscErrorCode check_self(void)
{
  Record r = {.from = 0.05};
  char path[512];

  PetscFunctionBeginUser;
  verify_case("self");
  PetscCall(verify_mesh_write((const PetscInt[3]){24, 2, 2}, horseshoe, NULL, path));
  PetscCall(
    record_run(&r,
               "-bodies a -effects close,meet -effect_close_type body_force -effect_close_density "
               "0;-4e4*y*step(0.0499-t);0 " MEET
               "-effect_meet_self yes -time euler_implicit -ts_dt 0.001 -ts_max_time 0.2 "
               "-snes_rtol 1e-8" VERIFY_BODY("a", "%s", "linear", "1e5", "0.3"),
               1., path));
  check_meeting(&r, record_last(&r, "energy"), 1e-9, 0);
  VERIFY_LESS(record_size(&r, "momentum", PETSC_TRUE), 1e-12, "largest change of momentum, kg m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const PetscReal soft[][3] = {
    {1e5, 0.001, 1}, {1e6, 0.001, 0.5}, {1e7, 0.001, 1}, {1e4, 0.005, 1}};
  char path[2][512], bodies[VERIFY_TEXT / 2];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_pair("blocks", "-body_b_mesh box:0.1,0.1,0.1:3", 0.6));
  PetscCall(
    check_pair("blocks, heavy", "-body_b_mesh box:0.1,0.1,0.1:3 -body_b_density 5000", 0.6));
  PetscCall(check_pair("blocks, equal", "", 1));
  PetscCall(
    check_pair("blocks, CR", "-body_b_density 3000 -body_a_element cr -body_b_element cr", 0.3));
  PetscCall(
    check_pair("blocks, P2", "-body_b_density 3000 -body_a_element p2 -body_b_element p2", 0.3));

  /* a vertex of the first ball hits the centre of a flat part of the second */
  for (int k = 0; k < 2; k++)
    PetscCall(contact_ball_write(4 - k, 0.05, path[k]));
  PetscCall(PetscSNPrintf(bodies, sizeof(bodies),
                          "-body_a_mesh %s -body_b_mesh %s -body_b_density 2000", path[0],
                          path[1]));
  PetscCall(check_pair("balls", bodies, 0.6));
  PetscCall(check_tower());
  PetscCall(check_oblique(0, 1));
  PetscCall(check_oblique(0.3, 0.7));
  if (test_size > 1)
    SB_TEST_END(); /* many solves of small systems: on one rank only */
  for (int k = 0; k < 4; k++)
    PetscCall(check_soft(soft[k][0], soft[k][1], soft[k][2]));
  PetscCall(check_self());
  SB_TEST_END();
}
