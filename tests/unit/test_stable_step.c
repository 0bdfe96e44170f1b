// @ranks 1 3
/* Stable step of explicit runs: an oscillator with a known frequency, and bodies run just below and
   above it. */
#include "../scene.h"

/* Linear elasticity with twice the stiffness of E and nu. */
static PetscErrorCode options_doubled(SbMaterial m, const SbScope *scope)
{
  PetscFunctionBeginUser;
  (void)scope;
  SbMaterialSetLame(m, 2. * SbMaterialVolumetricModulus(m), 2. * SbMaterialShearModulus(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One tet fixed at its base: the apex moves along z with w^2 = (lambda + 2 mu) / (rho H^2 / 4), the
   highest frequency. */
static PetscErrorCode check_oscillator(const char *law, PetscReal stiffer, PetscReal alpha,
                                       PetscReal beta, const char *more, PetscReal share)
{
  const PetscReal E = 1e3;
  const PetscReal nu = 0.25;
  const PetscReal rho = 8.;
  const PetscReal H = 0.5;
  const PetscReal mu = E / (2. * (1. + nu));
  const PetscReal lambda = E * nu / ((1. + nu) * (1. - 2. * nu));
  const PetscReal w = PetscSqrtReal(stiffer * (lambda + 2. * mu) / (share * rho * H * H));
  const PetscReal zeta = 0.5 * (alpha / w + beta * w);
  TestScene t;
  PetscReal dt;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh tests/data/one_tet.msh -body_a_material %s "
                      "-body_a_young %g -body_a_poisson %g "
                      "-body_a_density %g -sets base -set_base_at plane:0,0,1,0 -effects "
                      "hold,damping -effect_hold_type fixed "
                      "-effect_hold_on base -effect_damping_alpha %g -effect_damping_beta %g -time "
                      "euler_symplectic %s",
                      law, E, nu, rho, alpha, beta, more));
  PetscCall(SbSpaceStableStep(t.model->space, &dt));
  SB_CHECK_NEAR(dt, 2. * (PetscSqrtReal(1. + zeta * zeta) - zeta) / w, 1e-12 * dt,
                "stable step of the oscillator");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy after 400 steps of `factor` times the stable one, relative to the initial energy. */
static PetscErrorCode energy_ratio(const char *body, PetscReal factor, PetscReal *ratio)
{
  SbEnergies before, after;
  TestScene t;
  PetscReal dt;
  char text[1024];

  PetscFunctionBeginUser;
  PetscCall(
    PetscSNPrintf(text, sizeof(text),
                  "-bodies a %s -body_a_material linear -body_a_young 1e5 -body_a_density 1000 "
                  "-body_a_velocity 1,2,3 -body_a_angular_velocity 1,2,3 -time euler_symplectic",
                  body));
  PetscCall(test_scene_open(text, &t));
  PetscCall(SbSpaceStableStep(t.model->space, &dt));
  PetscCall(test_scene_close(&t));
  PetscCall(
    test_open(&t, "%s -ts_dt %.17g -ts_max_time %.17g", text, factor * dt, 400.001 * factor * dt));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &before));
  PetscCall(SbRunSolve(t.run));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &after));
  *ratio = (after.kinetic + after.strain) / before.kinetic;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_body(const char *body)
{
  PetscReal below, above;

  PetscFunctionBeginUser;

  /* the estimate by the power method may exceed the exact value by a few percent, and is never
     below it */
  PetscCall(energy_ratio(body, 0.95, &below));
  PetscCall(energy_ratio(body, 1.05, &above));
  SB_CHECK(below < 30., "%s: 0.95 of the stable step multiplies the energy by %g", body, below);
  SB_CHECK(!(above < 1e6), "%s: 1.05 of it by %g only", body, above);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static SbMaterialType doubled;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_oscillator("linear", 1., 0., 0., "", 0.25));
  PetscCall(check_oscillator("linear", 1., 3., 0.02, "", 0.25));

  /* the stable step uses the stiffness of the material, not E and nu */
  doubled = *SbMaterialFind("linear");
  doubled.name = "doubled";
  doubled.ops.setfromoptions = options_doubled;
  PetscCall(SbMaterialRegister(&doubled));
  PetscCall(check_oscillator("doubled", 2., 0., 0., "", 0.25));

  /* bound of the consistent mass: 1/5 of the lumped one, here 1/20 of the tet */
  PetscCall(check_oscillator("linear", 1., 0., 0., "-mass consistent", 0.05));
  PetscCall(check_body("-body_a_mesh box:0.2,0.1,0.1:1 -body_a_poisson 0.3 -effects clamp "
                       "-effect_clamp_type fixed -effect_clamp_on xmin"));
  PetscCall(
    check_body("-body_a_mesh box:1,1,1:4 -body_a_poisson 0 -effects clamp -effect_clamp_type fixed "
               "-effect_clamp_on xmin"));
  PetscCall(check_body("-body_a_mesh box:1,1,1:4 -body_a_poisson 0.49 -effects clamp "
                       "-effect_clamp_type fixed -effect_clamp_on xmin"));
  SB_TEST_END();
}
