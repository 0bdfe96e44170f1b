// @ranks 1,2
/*
  The result of load steps does not depend on their number, although the penalty on the jumps of CR
  and DG depends on the state.

  A cube between two plates to which it is bonded, nearly incompressible, pressed to six tenths of
  its height: in one load step, in many, and by arc length. The penalty grows tenfold at the edges
  of the plates. With the penalty of the start of each step, or one repetition with that of its end,
  the forces of these runs differ by a tenth and more.
*/
#include "contact.h"

static PetscErrorCode press(const char *element, const char *steps, PetscReal *energy)
{
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element %s -body_a_material "
              "stable_neohookean "
              "-body_a_young 5e4 -body_a_poisson 0.4999 -effects low,top -effect_low_type fixed "
              "-effect_low_on zmin -effect_top_type prescribed_displacement -effect_top_on zmax "
              "-effect_top_displacement 0;0;-0.04 -time static %s",
              element, steps));
  PetscCall(record_solve(&t, &r));
  PetscCall(test_scene_close(&t));
  *energy = record_last(&r, "strain");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, int runs)
{
  static const char *const steps[] = {"-static_steps 8", "-static_steps 1",
                                      "-static_control arc_length -static_steps 4"};
  PetscReal energy[3];

  PetscFunctionBeginUser;
  verify_case("press, %s", element);
  for (int k = 0; k < runs; k++)
    PetscCall(press(element, steps[k], &energy[k]));
  for (int k = 1; k < runs; k++)
    VERIFY_NEAR(energy[k] / energy[0], 1, 2e-3,
                k == 1 ? "energy with one load step, of that with eight"
                       : "energy by arc length, of that with eight load steps");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("cr", 3));
  PetscCall(check("dg", 2));
  SB_TEST_END();
}
