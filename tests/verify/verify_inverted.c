// @ranks 1 2
/*
  Runs that reject steps with inverted tets (-time_inverted reject).

    stops     a box whose compression would invert it at 2/3 of the path: every integrator stops
    before that with the reason, within the
              shortest step of it, and without inverted tets; a run that accepts them reaches the
              end with all tets inverted
    mirrored  a body that is inverted initially goes on: the number of inverted tets does not
    increase alpha2    cannot reject steps, and says so
*/
#include "scene.h"

#define BOX                                                                                        \
  "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material stable_neohookean -body_a_young 1e4 " \
  "-body_a_poisson "                                                                               \
  "0.3 -body_a_density 1000 "
#define PRESS \
  BOX "-effects press -effect_press_type prescribed_displacement -effect_press_on boundary "

static PetscErrorCode check_stops(const char *time, PetscReal shortest)
{
  SbEnergies e;
  TestScene s;
  char text[1024];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    PRESS "-effect_press_displacement 0;0;-1.5*t*z -time_max_halvings 4 %s -time_inverted ", time));
  for (int refuse = 0; refuse < 2; refuse++) {

    PetscCall(test_open(&s, "%s%s", text, refuse ? "reject" : "accept"));
    s.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(test_scene_solve(&s));
    e = s.run->state.energies;
    if (refuse) {
      SB_CHECK(strstr(s.run->clock.stop_reason, "inverted") && !e.ninverted && e.min_J > 0.,
               "%s: %d inverted, '%s'", time, (int)e.ninverted, s.run->clock.stop_reason);
      SB_CHECK(s.run->clock.t < 2. / 3 && s.run->clock.t > 2. / 3 - 1.01 * shortest,
               "%s: stops at %.6g", time, s.run->clock.t);
    } else {
      SB_CHECK(!s.run->clock.stop_reason[0] && e.ninverted &&
                 PetscAbsReal(s.run->clock.t - 1.) < 1e-6,
               "%s: t %.6g, '%s'", time, s.run->clock.t, s.run->clock.stop_reason);
    }
    PetscCall(test_scene_close(&s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void mirror(const PetscReal x[3], PetscReal u[3])
{
  u[0] = -2. * x[0];
  u[1] = 0.;
  u[2] = 0.;
}

/* Prescribes the mirror image of the body, which is its initial state. */
static PetscErrorCode check_mirrored(void)
{
  SbEnergies e;
  TestScene s;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(
    PRESS
    "-effect_press_displacement 0*t-2*x;0;0 -time static -static_steps 2 -time_inverted reject",
    &s));
  s.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(test_fill(s.model, mirror, s.run->state.U));
  PetscCall(SbModelEnergies(s.model, s.run->state.U, s.run->state.V, &e));
  SB_CHECK(e.ninverted == s.model->mesh->Ncell, "%d tets are inverted at first", (int)e.ninverted);
  PetscCall(test_scene_solve(&s));
  SB_CHECK(!s.run->clock.stop_reason[0] && s.run->clock.t == 1., "stops at %g s: %s",
           s.run->clock.t, s.run->clock.stop_reason);
  PetscCall(test_scene_close(&s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr;
  TestScene s;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_stops("-time static -static_steps 10", 0.1 / 16));
  PetscCall(check_stops("-time euler_implicit -ts_dt 0.1 -ts_max_time 1", 0.1 / 16));
  PetscCall(check_stops("-time genalpha -ts_dt 0.1 -ts_max_time 1", 0.1 / 16));
  PetscCall(check_stops("-time euler_symplectic -ts_dt 0.001 -ts_max_time 1", 0.02));
  PetscCall(check_mirrored());
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  ierr = test_scene_open(BOX "-time alpha2 -time_inverted reject", &s);
  PetscCall(PetscPopErrorHandler());
  SB_CHECK(ierr == PETSC_ERR_USER, "alpha2 cannot refuse steps: error %d", (int)ierr);
  PetscCall(test_scene_close(&s));
  SB_TEST_END();
}
