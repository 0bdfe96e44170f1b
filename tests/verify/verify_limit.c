// @ranks 1,2
/*
  Limit loads. A cube of St. Venant-Kirchhoff with Poisson's ratio 0 that is pressed along one axis and stretched by s there carries the nominal
  stress P = E/2 (s^3 - s), which is largest at s = 1/sqrt 3: 0.19245 E.

  A load path that asks for 0.2 E ends there in few steps, says how far it got, and that displacements grow without bound with the load. One that stays
  below gets to its end.
*/
#include "verify.h"

#define CUBE                                                                                                \
  "-bodies a -body_a_mesh box:1,1,1:2 -body_a_material stvk -body_a_young 1 -body_a_poisson 0 "             \
  "-body_a_density 1 -effects x,y,z,press -effect_x_type support -effect_x_on xmin -effect_x_components x " \
  "-effect_y_type support -effect_y_on ymin -effect_y_components y -effect_z_type support -effect_z_on "    \
  "zmin "                                                                                                   \
  "-effect_z_components z -effect_press_type traction -effect_press_on zmax -time static -time_inverted "   \
  "refuse "

static const PetscReal limit = 0.19245008972987526; /* of E */

static PetscErrorCode check_end(PetscReal load, int steps, const char *more)
{
  const PetscReal reached = PetscMin(1., limit / load);
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    verify_open(&t, CUBE "-effect_press_vector 0;0;%.17g -static_steps %d %s", (double)-load, steps, more));
  PetscCall(SbRunSolve(t.run));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %g E in %d steps %s: %.9g in %d steps, softening %g\n    %s\n",
                        (double)load, steps, more, (double)t.run->t_now, (int)t.run->steps_total,
                        (double)t.run->softening, t.run->stop_reason));
  SB_CHECK(reached == 1. || t.run->t_now < reached + 1e-9, "load factor %g beyond the limit",
           (double)t.run->t_now);
  SB_CHECK_NEAR(t.run->t_now, reached, 1e-3 / steps, "load factor reached");
  SB_CHECK(t.run->steps_total <= steps + 60, "%d steps", (int)t.run->steps_total);
  SB_CHECK((t.run->stop_reason[0] == 0) == (reached == 1.), "%s", t.run->stop_reason);
  SB_CHECK(reached == 1. || t.run->softening > 30., "softening %g", (double)t.run->softening);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_end(0.19, 5, "-body_a_tangent exact"));
  PetscCall(check_end(0.2, 10, "-body_a_tangent exact"));
  PetscCall(check_end(0.2, 10, "-body_a_tangent exact_spd"));
  /* increments of rounding: the number of attempts ends it */
  PetscCall(check_end(0.2, 10, "-body_a_tangent exact_spd -static_min_increment 1e-15"));
  SB_TEST_END();
}
