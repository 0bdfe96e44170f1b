// @ranks 1
// @long
/*
  Hertz contact (hertz.h) with CR and DG (P2: verify_quadratic_contact.c), and of one body on a
  rigid plane.
*/
#include "hertz.h"

/* CR and DG, whose points are the centroids of faces: their meshes are coarser, with about as many
   unknowns. The gap of the barrier adds up to 1.5 % to the force. */
static PetscErrorCode check_element(const Pair *p, const char *element, PetscInt cells,
                                    PetscReal tolerance)
{
  const Case c = {cells, 0.12, 5e-3, element, NULL};
  PetscReal force;

  PetscFunctionBeginUser;
  PetscCall(hertz(p, &c, &force));
  SB_CHECK_NEAR(force, 1, tolerance, "force against that of Hertz");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Only the upper body, on a rigid plane: E1 is infinite. */
static PetscErrorCode check_plane(const char *element, PetscInt cells, PetscReal tolerance)
{
  const PetscReal young = 1e5;
  const PetscReal d = PetscSqr(0.12) / RADIUS;
  const PetscReal P =
    4. / 3 * young / (1 - PetscSqr(POISSON)) * PetscSqrtReal(RADIUS) * PetscPowReal(d, 1.5);
  const PetscInt n[3] = {cells, cells, cells};
  Block block = {.fine = 0.25, .side = 1, .radius = RADIUS};
  PetscReal force, reaction, contacts;
  char path[512], far[VERIFY_TEXT / 4];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, bend, &block, path));
  PetscCall(boussinesq(P, young, 1, -d, sizeof(far), far));
  PetscCall(test_open(
    &t,
    "-bodies b -body_b_mesh %s -body_b_element %s -body_b_material linear -body_b_young %g "
    "-body_b_poisson %g -sets x0,y0,meet,bx,by,bz -set_x0_at plane:1,0,0,0 -set_y0_at "
    "plane:0,1,0,0 "
    "-set_meet_at plane:0,0,1,0,%g -set_bx_at box:1,0,0.01,1,1,1 -set_by_at box:0,1,0.01,1,1,1 "
    "-set_bz_at plane:0,0,1,1 -time static -ksp_rtol 1e-8 -solver cg_two_level -effects "
    "x,y,high,floor "
    "-effect_x_type fixed -effect_x_on x0 -effect_x_components x -effect_y_type fixed -effect_y_on "
    "y0 "
    "-effect_y_components y -effect_high_type prescribed_displacement -effect_high_on bx,by,bz "
    "-effect_high_displacement %s -effect_floor_type contact -effect_floor_response projected "
    "-effect_floor_on meet -effect_floor_obstacle plane:0,0,1,0",
    path, element, young, POISSON, 3 * d, far));
  t.run->monitors.want_residual = PETSC_TRUE;
  PetscCall(verify_solve(&t, "plane"));
  PetscCall(contact_column(t.run, 1, "floor", "force_z", &force));
  PetscCall(contact_column(t.run, 1, "floor", "contacts", &contacts));
  PetscCall(contact_column(t.run, 1, "high", "reaction_z", &reaction));
  test_print("  sphere on a rigid plane, %s, %d^3 cells: %g points touch, force %.4f of the "
             "formula's, the drive pushes with %.4f, %d solves\n",
             element, (int)cells, contacts, 4 * force / P, -4 * reaction / P,
             (int)t.run->counters.newton);
  SB_CHECK_NEAR(4 * force / P, 1, tolerance, "force of the plane against that of Hertz");
  SB_CHECK_NEAR(-reaction, force, 1e-3 * force, "force of the drive against that of the plane");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const Pair sphere = {"sphere on a half-space", {1e5, 3e5}, {0, RADIUS}};
  static const Pair spheres = {"two spheres", {1e5, 1e5}, {2 * RADIUS, 2 * RADIUS}};

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_element(&sphere, "cr", 10, 0.04));
  PetscCall(check_element(&sphere, "dg", 10, 0.04));
  PetscCall(check_element(&spheres, "cr", 10, 0.04));
  PetscCall(check_plane("p1", CELLS, 0.03));
  PetscCall(check_plane("cr", 10, 0.03));
  PetscCall(check_plane("dg", 10, 0.03));
  PetscCall(check_plane("p2", 10, 0.03));
  SB_TEST_END();
}
