// @ranks 1 2
/*
  The classical neo-Hookean law, whose energy is infinite where det F <= 0.

    bar       pulled and pressed to a stretch of 0.5 to 2 between smooth plates, with P1, CR, DG and
              P2: the uniaxial state, mu (s^2 - r^2) = sigma J, mu (r^2 - 1) + lambda ln J = 0 with
              J = s r^2, is exact
    squeeze   a cube pressed to a quarter between plates that hold it, in one load step and in time
              steps that move a plate by more than a tet: no tet inverts, and each run ends
    step      a Newton step ends where the first det F is a tenth of that before
    errors    an inverted initial state and an explicit step that inverts are errors that name body,
              tet and the stable law; alpha2 is refused
*/
#include "verify.h"

#define E 1e5
#define CUBE                                                                       \
  "-bodies cube -body_cube_mesh box:0.1,0.1,0.1:4 -body_cube_material neohookean " \
  "-body_cube_young 1e5 -body_cube_density 1000 "
#define PLATES                                                                      \
  "-effects low,high -effect_low_type fixed -effect_low_on zmin -effect_high_type " \
  "prescribed_displacement -effect_high_on zmax "

/* Lateral stretch r of a bar with the stretch s, free at its sides: Newton's method for ln r. */
static PetscReal lateral(PetscReal nu, PetscReal s)
{
  const PetscReal mu = E / (2. * (1. + nu));
  const PetscReal lambda = E * nu / ((1. + nu) * (1. - 2. * nu));
  PetscReal x = 0.;

  for (int i = 0; i < 50; i++) {
    const PetscReal r2 = PetscExpReal(2. * x);

    x -= (mu * (r2 - 1.) + lambda * (PetscLogReal(s) + 2. * x)) / (2. * mu * r2 + 2. * lambda);
  }
  return PetscExpReal(x);
}

static PetscErrorCode check_bar(const char *element, PetscReal nu, PetscReal s)
{
  const PetscReal r = lateral(nu, s);
  const PetscReal mu = E / (2. * (1. + nu));
  const PetscReal J = PetscLogReal(s * r * r);
  const PetscReal energy = 1e-3 * (0.5 * mu * (s * s + 2. * r * r - 3. - 2. * J) +
                                   0.5 * E * nu / ((1. + nu) * (1. - 2. * nu)) * J * J);
  PetscReal volume;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    CUBE "-body_cube_poisson %.17g -body_cube_element %s -effects x,y,z,pull -effect_x_type fixed "
         "-effect_x_on xmin -effect_x_components x -effect_y_type fixed -effect_y_on ymin "
         "-effect_y_components y -effect_z_type fixed -effect_z_on zmin -effect_z_components z "
         "-effect_pull_type prescribed_displacement -effect_pull_on zmax -effect_pull_components z "
         "-effect_pull_displacement 0,0,%.17g -time static -solver direct -snes_rtol 1e-11",
    nu, element, 0.1 * (s - 1.)));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, element));
  volume = t.run->state.energies.volume;
  test_print("  bar, %s, nu %g, stretch %g: volume %.9f (exact %.9f), energy %.9f J (%.9f)\n",
             element, nu, s, 1e3 * volume, s * r * r, t.run->state.energies.strain, energy);
  SB_CHECK_NEAR(1e3 * volume, s * r * r, 1e-7, "volume");
  SB_CHECK_NEAR(t.run->state.energies.strain, energy, 1e-7 * energy, "energy");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_squeezed(const char *element, const char *more)
{
  const SbRunCounters *c;
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, CUBE PLATES "-body_cube_element %s %s", element, more));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, "squeeze"));
  e = t.run->state.energies;
  c = &t.run->counters;
  test_print("  squeeze, %s, %s: det F down to %.3f, %d steps, %d rejected, %d iterations\n",
             element, more, e.min_J, (int)c->steps, (int)c->rejected, (int)c->newton);
  SB_CHECK(!e.ninverted && e.min_J > 0. && !PetscIsInfOrNanReal(e.strain),
           "squeeze, %s: det F down to %g, strain energy %g J", element, e.min_J, e.strain);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void flatten(const PetscReal x[3], PetscReal v[3])
{
  v[0] = v[1] = 0.;
  v[2] = 4. * x[2];
}

/* Along u = -s (0, 0, 4 z) det F = 1 - 4 s. */
static PetscErrorCode check_step(void)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  PetscReal part;
  TestScene t;
  Vec Y;

  PetscFunctionBeginUser;
  for (int k = 0; k < 4; k++) {
    PetscCall(test_open(&t, CUBE "-body_cube_poisson 0.3 -body_cube_element %s", elements[k]));
    PetscCall(VecDuplicate(t.run->state.U, &Y));
    PetscCall(test_fill(t.model, flatten, Y));
    PetscCall(SbSpaceLongestStep(t.model->space, t.run->state.U, Y, 1., &part));
    SB_CHECK_NEAR(part, 0.9 / 4., 1e-9, "longest step");
    PetscCall(SbSpaceLongestStep(t.model->space, t.run->state.U, Y, -1., &part));
    SB_CHECK(part == 1., "a stretch is limited to %g", part);
    PetscCall(VecDestroy(&Y));
    PetscCall(test_scene_close(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error of a run that cannot start, or the reason of one that stops. */
static PetscErrorCode check_error(const char *what, const char *options)
{
  char text[512];
  PetscErrorCode ierr;
  PetscReal at[3];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &t));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  ierr = SbRunSolve(t.run);
  PetscCall(PetscPopErrorHandler());
  if (ierr) {
    SB_CHECK(ierr == PETSC_ERR_USER_INPUT, "%s: error %d", what, (int)ierr);
    PetscCall(SbSpaceDescribeInverted(t.model->space, t.run->state.U, sizeof(text), text));
  } else
    PetscCall(PetscStrncpy(text, t.run->clock.stop_reason, sizeof(text)));
  SB_CHECK(strstr(text, "body cube") && strstr(text, "stable_neohookean") && strstr(text, "tet "),
           "%s: '%s'", what, text);
  const char *place = strstr(text, "around (");
  SB_CHECK(place && sscanf(place, "around (%lg, %lg, %lg)", &at[0], &at[1], &at[2]) == 3 &&
             at[2] > 0. && at[2] < 0.1,
           "%s: no place in '%s'", what, text);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  PetscErrorCode ierr;
  TestScene t;

  SB_TEST_BEGIN(argc, argv);
  for (int k = 0; k < 4; k++) {
    PetscCall(check_bar(elements[k], 0.3, 0.5));
    PetscCall(check_bar(elements[k], 0.49, 2.));
  }
  for (int k = 0; k < 4; k++) {
    PetscCall(check_squeezed(
      elements[k], "-body_cube_poisson 0.3 -time static -effect_high_displacement 0,0,-0.075"));
    if (k != 2)
      PetscCall(check_squeezed(elements[k],
                               "-body_cube_poisson 0.3 -time euler_implicit -ts_dt 0.01 "
                               "-ts_max_time 0.02 "
                               "-effect_high_displacement 0;0;-0.075*t/0.02"));
  }
  PetscCall(check_step());
  PetscCall(check_error("initial state", CUBE "-body_cube_poisson 0.3 -time newmark "
                                              "-body_cube_displacement 0;0;-1.5*z*step(z-0.05)"));
  PetscCall(check_error("explicit",
                        CUBE PLATES "-body_cube_poisson 0.3 -time euler_symplectic "
                                    "-body_cube_velocity 0,0,-20 "
                                    "-effect_high_displacement 0,0,0 -ts_max_time 0.1"));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  ierr = test_scene_open(CUBE "-body_cube_poisson 0.3 -time alpha2", &t);
  PetscCall(PetscPopErrorHandler());
  SB_CHECK(ierr == PETSC_ERR_USER, "alpha2 cannot reject steps: error %d", (int)ierr);
  PetscCall(test_scene_close(&t));
  SB_TEST_END();
}
