// @ranks 1 2
/*
  Contact springs with dampers: a stiff block hits a plane, with response `penalty`. It is a mass on
  a spring k and a dashpot k tau without tension: the rebound speed is that of this oscillator.
*/
#include "contact.h"

#define SIDE 0.05 /* m */
#define MASS (1000 * SIDE * SIDE * SIDE)
#define SPEED 0.1   /* m/s */
#define YOUNG 1e7   /* Pa */
#define FACTOR 1e-3 /* `stiffness` */
#define STEP 1e-4   /* s */

/* Speed of the oscillator after the impact, with steps a hundred times as short. */
static PetscReal leaving(PetscReal k, PetscReal tau)
{
  const PetscReal h = STEP / 100;
  PetscReal x = 0;
  PetscReal v = -SPEED;

  do {
    const PetscReal force = PetscMax(0, -k * x - k * tau * v);

    v += h / MASS * force;
    x += h * v;
  } while (x < 0 || v < 0);
  return v;
}

/* k: of all springs, N/m; set when there is no damper, by the largest force, SPEED sqrt(k MASS). */
static PetscErrorCode check(const char *what, const char *scene, PetscReal tau, PetscReal *k)
{
  Record r = {0};
  PetscReal speed;

  PetscFunctionBeginUser;
  verify_case("%s, damping %g s", what, tau);
  PetscCall(record_run(
    &r,
    "-body_a_velocity 0,0,%g -effect_meet_response penalty -effect_meet_stiffness %g "
    "-effect_meet_damping %g "
    "-time euler_implicit -ts_dt %g -ts_max_time 0.06 -snes_rtol 1e-10 -bodies %s" VERIFY_BODY(
      "a", "box:0.05,0.05,0.05:1", "linear", "%g", "0.3"),
    -SPEED, FACTOR, tau, STEP, scene, YOUNG));
  if (tau == 0)
    *k = PetscSqr(record_max(&r, "meet_force_z") / SPEED) / MASS;
  verify_show("springs, N/m", *k);
  speed = PetscSqrtReal(2 * record_last(&r, "kinetic") / MASS);
  VERIFY_NEAR(speed, leaving(*k, tau), 0.02 * SPEED, "speed after the impact, m/s");

  /* the springs return a part of the kinetic energy */
  VERIFY_LESS(speed, SPEED * (1 + PETSC_SMALL), "speed after the impact, m/s");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const plane = "a -effects meet -effect_meet_type contact "
                                   "-effect_meet_obstacle plane:0,0,1,-1e-4";
  static const char *const rows = "a -effects meet -effect_meet_type contact -effect_meet_obstacle "
                                  "plane:0,0,1,-1e-4 -effect_meet_friction 0.3";
  PetscReal k;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("plane", plane, 0, &k));
  PetscCall(check("plane", plane, 0.0055, &k));
  PetscCall(check("plane, rows", rows, 0.0055, &k));
  SB_TEST_END();
}
