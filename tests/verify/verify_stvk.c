// @ranks 1
/*
  Structural benchmarks CSM1 and CSM2 of Turek and Hron ("Proposal for numerical benchmarking of
  fluid-structure interaction between an elastic object and laminar incompressible flow", 2006): a
  St. Venant-Kirchhoff beam, plane strain, 0.02 m thick, from the circle (0.2, 0.2) of radius 0.05 m
  to x = 0.6 m, bends under gravity. Displacement of (0.6, 0.2).

  The mesh is a box whose left side is mapped to the arc, one layer of cells between two planes with
  u_z = 0. Cook's membrane, (0,0) (48,44) (48,60) (0,44), left side fixed, uniform shear 1/16 on the
  right one, small strains, plane strain too, is the second mapped box.

  P1 is too stiff in bending on coarse meshes, with errors of order h^2: two meshes are extrapolated
  (Richardson).
*/
#include "locking.h"

static PetscErrorCode check_csm(const char *what, PetscReal mu, PetscReal ux, PetscReal uy)
{
  PetscReal u[2][3], limit[2];
  LockingCost cost;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscCall(locking_beam(8 << k, mu, "-body_a_material stvk", u[k], &cost));
    test_print("    %s, %d cells across: %.6g %.6g, %d Newton iterations\n", what, 8 << k, u[k][0],
               u[k][1], (int)cost.newton);
  }
  for (int k = 0; k < 2; k++)
    limit[k] = verify_extrapolate(u[0][k], u[1][k], 2.);
  test_print("  %s: extrapolated %.6f %.6f mm (reference %.6f %.6f)\n", what, 1e3 * limit[0],
             1e3 * limit[1], 1e3 * ux, 1e3 * uy);

  /* the finer mesh has an error of 1 %, its extrapolation must be at least ten times better */
  SB_CHECK_NEAR(u[1][1], uy, 0.015 * PetscAbsReal(uy), what);
  SB_CHECK_NEAR(limit[0], ux, 3e-3 * PetscAbsReal(ux), what);
  SB_CHECK_NEAR(limit[1], uy, 1e-3 * PetscAbsReal(uy), what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The corner (0, 44) is singular: the order is unknown, three meshes give it. */
static PetscErrorCode check_cook(PetscReal nu, PetscReal uy)
{
  const PetscReal corner[3] = {48., 60., 0.};
  PetscReal u[3], v[3], limit;
  TestScene t;
  char mesh[512];

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    const PetscInt n[3] = {16 << k, 16 << k, 1};

    PetscCall(verify_mesh_write(n, locking_cook_map, NULL, mesh));
    PetscCall(test_open(
      &t,
      "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young 1 -body_a_poisson %.17g "
      "-body_a_density 1 "
      "-sets left,right -set_left_at plane:1,0,0,0 -set_right_at plane:1,0,0,48 "
      "-effects hold,plane,pull -effect_hold_type fixed -effect_hold_on left "
      "-effect_plane_type fixed -effect_plane_on all -effect_plane_components z -effect_pull_type "
      "traction -effect_pull_on right -effect_pull_vector 0;1/16;0 -time static",
      mesh, nu));
    PetscCall(verify_solve(&t, "Cook"));
    PetscCall(test_value_at(t.model, t.run->state.U, corner, u));
    test_print("    Cook, %d x %d cells: %.6g %.6g\n", (int)n[0], (int)n[1], u[0], u[1]);
    PetscCall(test_scene_close(&t));
    v[k] = u[1];
  }
  limit = verify_aitken(v);
  test_print("  Cook's membrane, nu %g: extrapolated %.4f m (reference %.4f)\n", nu, limit, uy);
  SB_CHECK_NEAR(limit, uy, 5e-3 * uy, "corner of Cook's membrane");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_csm("CSM1", 0.5e6, -7.1878e-3, -66.103e-3));
  PetscCall(check_csm("CSM2", 2e6, -0.46901e-3, -16.974e-3));
  PetscCall(check_cook(1. / 3., 22.6106));
  PetscCall(check_cook(0.4999, 19.4285));
  SB_TEST_END();
}
