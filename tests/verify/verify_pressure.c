// @ranks 1 2
/*
  A bar in a fluid: clamped at one end, under its own weight, with a follower pressure from minus
  the shear modulus to plus that on its five free faces, nu = 0.4999. The pressure compresses it and
  does nothing else: the displacement of its end does not change. For CR and DG, whose own facets do
  not meet at their edges, forces facet by facet would change it by -27 % at half the shear modulus,
  and by +82 % at minus that.

  With the pressure on the four sides only it also stretches. There P2 is the reference.
*/
#include "verify.h"

#define NU 0.4999
#define YOUNG 5e5
#define SIDES "ymin,ymax,zmin,zmax"

/* Displacement of the bar's lower end, m. */
static PetscErrorCode solve(const char *element, int n, const char *on, PetscReal pressure,
                            PetscReal u[3])
{
  const PetscReal end[3] = {0.4, 0., 0.};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.4,0.1,0.1:%d -body_a_element %s -body_a_material "
    "stable_neohookean "
    "-body_a_young %g -body_a_poisson %.17g -body_a_density 1000 -effects gravity,clamp,fluid "
    "-effect_gravity_vector 0,0,-9.81 -effect_clamp_type fixed -effect_clamp_on xmin "
    "-effect_fluid_type pressure -effect_fluid_on %s -effect_fluid_value %.17g -time static "
    "-solver direct -snes_rtol 1e-9",
    n, element, YOUNG, NU, on, pressure * YOUNG / (2. * (1. + NU))));
  PetscCall(verify_solve(&t, element));
  PetscCall(test_value_at(t.model, t.run->state.U, end, u));
  test_print("  %s, %d cells, %g mu on %s: %.6f %.6f m; %d steps, %d Newton, %d linear\n", element,
             n, (double)pressure, on, (double)u[0], (double)u[2], (int)t.run->counters.steps,
             (int)t.run->counters.newton, (int)t.run->counters.linear);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_bar(const char *element, int n)
{
  const PetscReal pressure[] = {-1., 0.25, 1.};
  PetscReal alone[3], u[3], quadratic[3], expected;

  PetscFunctionBeginUser;
  PetscCall(solve(element, n, "xmax," SIDES, 0., alone));
  for (int k = 0; k < 3; k++) {
    PetscCall(solve(element, n, "xmax," SIDES, pressure[k], u));

    /* of the volume: 1e-4 */
    SB_CHECK_NEAR(u[2], alone[2], 2e-4 * PetscAbsReal(alone[2]), "deflection in a fluid");
  }
  if (n == 2)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* deflections by those without pressure, as nodes are at other places */
  PetscCall(solve("p2", n, SIDES, 0., quadratic));
  expected = 1. / quadratic[2];
  PetscCall(solve("p2", n, SIDES, 0.05, quadratic));
  expected *= quadratic[2];
  PetscCall(solve(element, n, SIDES, 0.05, u));
  SB_CHECK(expected > 1.1, "the sides change the deflection to %g of it only", expected);
  SB_CHECK_NEAR(u[2] / alone[2], expected, 0.01, "deflection with pressure on the sides");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_bar("cr", 2));
  PetscCall(check_bar("cr", 3));
  PetscCall(check_bar("dg", 2));
  SB_TEST_END();
}
