// @ranks 1 2
/*
  Laws of rubber in runs: a bar between smooth plates, pulled to a stretch of 2 or pressed to 0.7,
  by Ogden's law with the constants of Treloar's rubber. The uniaxial state is exact; its lateral
  stretch r leaves the sides without stress: with s = (l, r, r), J = l r^2 and g_k = sum mu_i (s_k
  J^(-1/3))^alpha_i

    (g_2 - g_1) / 3 + K/2 (J^2 - 1) = 0.

  Also: what a body that begins beyond the limit of its law is told.
*/
#include "verify.h"

static const PetscReal mu[3] = {0.63e6, 0.0012e6, -0.01e6};
static const PetscReal alpha[3] = {1.3, 5., -2.};
#define SHEAR 0.4225e6 /* Pa, at rest */

/* Left hand side above at x = ln r, and the energy density. */
static PetscReal residual(PetscReal K, PetscReal l, PetscReal x, PetscReal *psi)
{
  const PetscReal r = PetscExpReal(x);
  const PetscReal J = l * r * r;
  const PetscReal root = PetscPowReal(J, -1. / 3.);
  PetscReal sum = K / 2. * (J * J - 1.);

  *psi = K / 4. * (J * J - 1. - 2. * PetscLogReal(J));
  for (int i = 0; i < 3; i++) {
    const PetscReal one = PetscPowReal(l * root, alpha[i]);
    const PetscReal two = PetscPowReal(r * root, alpha[i]);

    sum += mu[i] * (two - one) / 3.;
    *psi += mu[i] / alpha[i] * (one + 2. * two - 3.);
  }
  return sum;
}

static PetscErrorCode check_bar(const char *element, PetscReal nu, PetscReal l)
{
  const PetscReal K = 2. * SHEAR * (1. + nu) / (3. * (1. - 2. * nu));
  PetscReal x = -0.5 * PetscLogReal(l);
  PetscReal psi, other;
  TestScene t;

  PetscFunctionBeginUser;

  /* Newton's method for the lateral stretch, with the derivative by differences */
  for (int i = 0; i < 50; i++)
    x -= 2e-6 * residual(K, l, x, &psi) /
         (residual(K, l, x + 1e-6, &other) - residual(K, l, x - 1e-6, &other));
  const PetscReal J = l * PetscExpReal(2. * x);

  PetscCall(test_open(
    &t,
    "-bodies cube -body_cube_mesh box:0.1,0.1,0.1:2 -body_cube_material ogden "
    "-body_cube_mu 0.63e6,0.0012e6,-0.01e6 -body_cube_alpha 1.3,5,-2 -body_cube_density 1000 "
    "-body_cube_bulk %.17g -body_cube_element %s "
    "-effects x,y,z,pull -effect_x_type fixed -effect_x_on xmin -effect_x_components x "
    "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed "
    "-effect_z_on zmin -effect_z_components z -effect_pull_type prescribed_displacement "
    "-effect_pull_on zmax -effect_pull_components z -effect_pull_displacement 0,0,%.17g "
    "-time static -solver direct -snes_rtol 1e-11",
    K, element, 0.1 * (l - 1.)));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, element));
  test_print("  bar, %s, nu %g, stretch %g: volume %.9f (exact %.9f), energy %.9f J (%.9f), %d "
             "iterations\n",
             element, nu, l, 1e3 * t.run->state.energies.volume, J, t.run->state.energies.strain,
             1e-3 * psi, (int)t.run->counters.newton);
  SB_CHECK_NEAR(1e3 * t.run->state.energies.volume, J, 1e-7, "volume");
  SB_CHECK_NEAR(t.run->state.energies.strain, 1e-3 * psi, 1e-10 * psi, "energy");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* l^2 + 2/l - 3 with l = 5, without change of the sides, is above jm = 3. */
static PetscErrorCode check_beyond(const char *element)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies bar -body_bar_mesh box:0.1,0.1,0.1:2 -body_bar_material gent "
                      "-body_bar_mu 1e4 -body_bar_jm 3 -body_bar_bulk 1e5 -body_bar_element %s "
                      "-body_bar_displacement 4*x,0,0 -time newmark -ts_dt 1e-3 -ts_max_time 2e-3",
                      element));
  SB_CHECK_ERROR(SbRunSolve(t.run), PETSC_ERR_USER_INPUT, "bar|gent|limit");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  static const PetscReal nus[] = {0.3, 0.4999};

  SB_TEST_BEGIN(argc, argv);
  for (int e = 0; e < 4; e++) {
    for (int n = 0; n < 2; n++) {
      PetscCall(check_bar(elements[e], nus[n], 0.7));
      PetscCall(check_bar(elements[e], nus[n], 2.));
    }
    PetscCall(check_beyond(elements[e]));
  }
  SB_TEST_END();
}
