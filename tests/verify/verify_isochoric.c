// @ranks 1 2
/*
  The neo-Hookean law with the change of shape apart from that of volume.

    bar   pulled and pressed to a stretch of 0.5 (CR, DG: 0.7) or 2 between smooth plates:
          the uniaxial state is exact. With the lateral stretch r and J = s r^2, a = mu J^(-2/3):
          K/2 (J^2 - 1) = a (s^2 - r^2) / 3, from a stress-free side
    cook  Cook's membrane at finite strains, plane strain, mu 0.4225 N/mm^2, nu 0.3, 1 N/mm of
    shear:
          14.74 mm in the middle of the end (the quasi-static tutorial of deal.II; Abaqus)
*/
#include "cells.h"
#include "verify.h"

#define E 1e5

/* The lateral stretch: Newton's method for ln r, with the derivative by differences. */
static PetscReal residual(PetscReal mu, PetscReal K, PetscReal s, PetscReal x)
{
  const PetscReal r2 = PetscExpReal(2. * x);
  const PetscReal J = s * r2;

  return K / 2. * (J * J - 1.) - mu * PetscPowReal(J, -2. / 3.) * (s * s - r2) / 3.;
}

static PetscReal lateral(PetscReal mu, PetscReal K, PetscReal s)
{
  PetscReal x = -0.5 * PetscLogReal(s);

  for (int i = 0; i < 50; i++)
    x -=
      2e-6 * residual(mu, K, s, x) / (residual(mu, K, s, x + 1e-6) - residual(mu, K, s, x - 1e-6));
  return PetscExpReal(x);
}

static PetscErrorCode check_bar(const char *element, PetscReal nu, PetscReal s)
{
  const PetscReal mu = E / (2. * (1. + nu));
  const PetscReal K = E / (3. * (1. - 2. * nu));
  const PetscReal r = lateral(mu, K, s);
  const PetscReal J = s * r * r;
  const PetscReal energy =
    1e-3 * (0.5 * mu * (PetscPowReal(J, -2. / 3.) * (s * s + 2. * r * r) - 3.) +
            0.25 * K * (J * J - 1. - 2. * PetscLogReal(J)));
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies cube -body_cube_mesh box:0.1,0.1,0.1:2 -body_cube_material isochoric_neohookean "
    "-body_cube_young 1e5 -body_cube_density 1000 -body_cube_poisson %.17g -body_cube_element %s "
    "-effects x,y,z,pull -effect_x_type fixed -effect_x_on xmin -effect_x_components x "
    "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed "
    "-effect_z_on zmin -effect_z_components z -effect_pull_type prescribed_displacement "
    "-effect_pull_on zmax -effect_pull_components z -effect_pull_displacement 0,0,%.17g "
    "-time static -solver direct -snes_rtol 1e-11",
    nu, element, 0.1 * (s - 1.)));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, element));
  test_print("  bar, %s, nu %g, stretch %g: volume %.9f (exact %.9f), energy %.9f J (%.9f), %d "
             "iterations\n",
             element, nu, s, 1e3 * t.run->state.energies.volume, J, t.run->state.energies.strain,
             energy, (int)t.run->counters.newton);
  SB_CHECK_NEAR(1e3 * t.run->state.energies.volume, J, 1e-7, "volume");
  SB_CHECK_NEAR(t.run->state.energies.strain, energy, 1e-7 * energy, "energy");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_cook(const char *element)
{
  const PetscReal middle[3] = {48., 52., 0.};
  PetscReal u[3];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh meshes/cook.msh -body_a_material isochoric_neohookean -body_a_element "
    "%s -body_a_young 1.0985 -body_a_poisson 0.3 -body_a_density 1 -effects hold,plane,pull "
    "-effect_hold_type fixed -effect_hold_on left -effect_plane_type fixed -effect_plane_on all "
    "-effect_plane_components z -effect_pull_type traction -effect_pull_on right "
    "-effect_pull_vector 0;1/16;0 -time static -solver direct",
    element));
  PetscCall(verify_solve(&t, element));
  PetscCall(verify_value_at(t.model, t.run->state.U, middle, u));
  test_print("  Cook, %s: %.4f mm (reference 14.74), %d iterations\n", element, u[1],
             (int)t.run->counters.newton);
  SB_CHECK_NEAR(u[1], 14.74, 1.5e-3 * 14.74, "middle of Cook's membrane");
  SB_CHECK(t.run->counters.newton <= 15, "%d iterations", (int)t.run->counters.newton);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  static const PetscReal nus[] = {0.3, 0.4999};
  static const PetscReal pressed[] = {0.5, 0.5, 0.7, 0.7}; /* CR and DG jump further on */

  SB_TEST_BEGIN(argc, argv);
  for (int e = 0; e < 4; e++) {
    for (int n = 0; n < 2; n++) {
      PetscCall(check_bar(elements[e], nus[n], pressed[e]));
      PetscCall(check_bar(elements[e], nus[n], 2.));
    }
  }
  PetscCall(check_cook("p2"));
  PetscCall(check_cook("cr"));
  SB_TEST_END();
}
