// @ranks 1,2
/*
  The result of load steps does not depend on their number, although the penalty on the jumps of CR
  and DG depends on the state.

  A cube between two plates to which it is bonded, nearly incompressible, pressed to six tenths of
  its height: in one load step, in many, and by arc length. The penalty grows tenfold at the edges
  of the plates. With the penalty of the start of each step, or one repetition with that of its end,
  the forces of these runs differ by a tenth and more.

  The force is that of the solid, although the pressure is several times the shear modulus: the
  penalty alone would make the cube a quarter too stiff at half of its height.

  A cube confined by smooth walls is in a uniform state, with the force of the law. Cut at a plane
  of symmetry, in plane strain, the bonded block has the force of P2, too.
*/
#include "contact.h"

/* energy, J, and forces on both plates, N */
static PetscErrorCode press(const char *element, const char *way, const char *steps,
                            PetscReal value[3])
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
              "-effect_top_displacement 0;0;-%s -time static %s",
              element, way, steps));
  PetscCall(record_solve(&t, &r));
  value[0] = record_last(&r, "strain");
  PetscCall(contact_column(t.run, 1., "low", "reaction_z", &value[1]));
  PetscCall(contact_column(t.run, 1., "top", "reaction_z", &value[2]));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, int runs)
{
  static const char *const steps[] = {"-static_steps 8", "-static_steps 1",
                                      "-static_control arc_length -static_steps 4"};
  PetscReal energy[3], value[3];

  PetscFunctionBeginUser;
  verify_case("press, %s", element);
  for (int k = 0; k < runs; k++) {
    PetscCall(press(element, "0.04", steps[k], value));
    energy[k] = value[0];
  }
  for (int k = 1; k < runs; k++)
    VERIFY_NEAR(energy[k] / energy[0], 1, 2e-3,
                k == 1 ? "energy with one load step, of that with eight"
                       : "energy by arc length, of that with eight load steps");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P2 with four to eight cells across: 257.5 N at 0.7 of the height, 552 to 554 N at half of it. */
static PetscErrorCode check_force(const char *element)
{
  static const char *const ways[] = {"0.03", "0.05"};
  static const PetscReal newtons[] = {257.5, 553.};
  static const PetscReal tolerance[] = {0.02, 0.16}; /* 5 and 25 % by the penalty alone */

  PetscFunctionBeginUser;
  verify_case("force, %s", element);
  for (int k = 0; k < 2; k++) {
    PetscReal value[3];

    PetscCall(press(element, ways[k], "-static_steps 2", value));
    VERIFY_NEAR(-value[2] / newtons[k], 1, tolerance[k],
                k ? "at half of the height, of that of P2" : "at 0.7 of the height, of that of P2");
    VERIFY_NEAR(-value[1] / value[2], 1, 1e-6, "force on the other plate");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cube confined by smooth walls: the state is uniform, F = diag(1, 1, 1 - s), and its force that
   of the law. */
static PetscErrorCode check_confined(const char *element, PetscReal nu, PetscReal way,
                                     PetscReal newtons)
{
  Record r = {0};
  PetscReal force;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element %s -body_a_material "
    "stable_neohookean -body_a_young 1e5 -body_a_poisson %.17g "
    "-effects low,top,x,y -effect_low_type fixed -effect_low_on zmin "
    "-effect_low_components z -effect_x_type fixed -effect_x_on xmin,xmax -effect_x_components x "
    "-effect_y_type fixed -effect_y_on ymin,ymax -effect_y_components y -effect_top_type "
    "prescribed_displacement -effect_top_on zmax -effect_top_components z "
    "-effect_top_displacement 0;0;-%.17g -time static -static_steps 2 -static_unstable ignore",
    element, nu, way));
  PetscCall(record_solve(&t, &r));
  PetscCall(contact_column(t.run, 1., "top", "reaction_z", &force));
  verify_case("confined, %s, nu %g", element, nu);
  VERIFY_NEAR(-force / newtons, 1, 1e-6, "force, of that of the law");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half of a bonded block in plane strain, pressed to eight tenths of its height; N. */
static PetscErrorCode press_half(const char *element, PetscReal *force)
{
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element %s -body_a_material "
    "stable_neohookean -body_a_young 5e4 -body_a_poisson 0.4999 -effects low,top,x,y "
    "-effect_low_type fixed -effect_low_on zmin -effect_x_type fixed -effect_x_on xmin "
    "-effect_x_components x -effect_y_type fixed -effect_y_on ymin,ymax -effect_y_components y "
    "-effect_top_type prescribed_displacement -effect_top_on zmax -effect_top_displacement "
    "0;0;-0.02 -time static",
    element));
  PetscCall(record_solve(&t, &r));
  PetscCall(contact_column(t.run, 1., "top", "reaction_z", force));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* 1.124 with the penalty alone. */
static PetscErrorCode check_half(void)
{
  PetscReal force[3];

  PetscFunctionBeginUser;
  PetscCall(press_half("p2", &force[0]));
  PetscCall(press_half("cr", &force[1]));
  PetscCall(press_half("dg", &force[2]));
  verify_case("half of a block between plates, plane strain");
  VERIFY_NEAR(force[1] / force[0], 1, 0.05, "force with CR, of that of P2");
  VERIFY_NEAR(force[2] / force[0], 1, 0.05, "force with DG, of that of P2");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("cr", 3));
  PetscCall(check("dg", 2));
  PetscCall(check_force("cr"));
  PetscCall(check_force("dg"));
  PetscCall(check_confined("cr", 0.45, 0.03, 1132.447387));
  PetscCall(check_confined("dg", 0.49, 0.005, 855.563175));
  PetscCall(check_half());
  SB_TEST_END();
}
