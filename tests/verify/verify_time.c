// @ranks 1 3
/*
  Integrators against exact solutions of their recurrences. One linear tet fixed at its base is an
  oscillator: its apex moves along z with w^2 = V (lambda + 2 mu) / (H^2 m), m = rho V / 4. With q =
  v + i w u an undamped step multiplies q by
    implicit Euler 1 / (1 - i w h), explicit Euler 1 + i w h, Newmark (1/4, 1/2) (1 + i w h / 2) /
    (1 - i w h / 2),
  from which the usual formulas of amplitude factor and period elongation follow. With CR and DG,
  whose tet has more than one mode: the order from steps of h, h/2 and h/4 of a small bar, and free
  fall.
*/
#include <complex.h>
#undef I
#include "../scene.h"

#define HEIGHT 0.5
static const double complex unit = 1.0i;
static const PetscReal young = 1000., nu = 0.25, rho = 8., v0 = 0.2;

/* share: fraction of the tet's mass at the apex, 1/4 lumped and 1/10 consistent */
static PetscReal frequency(PetscReal share)
{
  const PetscReal lambda = young * nu / ((1. + nu) * (1. - 2. * nu));
  const PetscReal mu = young / (2. * (1. + nu));

  return PetscSqrtReal((lambda + 2. * mu) / (share * rho * HEIGHT * HEIGHT));
}

/* Runs n steps of length h; returns u and v of the apex along z. */
static PetscErrorCode oscillate(const char *options, PetscInt n, PetscReal h, PetscReal *u,
                                PetscReal *v)
{
  const PetscReal apex[3] = {0., 0., HEIGHT};
  PetscReal value[3];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh tests/data/one_tet.msh -body_a_material linear -body_a_young %g "
    "-body_a_poisson %g -body_a_density %g -body_a_velocity 0,0,%g -sets base "
    "-set_base_at plane:0,0,1,0 -effects hold,damping -effect_hold_type fixed "
    "-effect_hold_on base -ts_dt %.17g -ts_max_time %.17g -ksp_rtol 1e-14 -solver cg_jacobi %s",
    young, nu, rho, v0, h, h * n, options));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->clock.stop_reason[0] && t.run->counters.steps == n, "%s: %s", options,
           t.run->clock.stop_reason);
  PetscCall(test_value_at(t.model, t.run->state.U, apex, value));
  *u = value[2];
  PetscCall(test_value_at(t.model, t.run->state.V, apex, value));
  *v = value[2];
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_oscillator(const char *options, int kind)
{
  const PetscReal w = frequency(0.25);
  const PetscInt n = 25;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++) {
    const PetscReal wh = k == 0 ? 0.1 : k == 1 ? 0.5 : 1.;
    double complex factor, q;
    PetscReal u, v;

    factor = kind == 0   ? 1. / (1. - unit * wh)
             : kind == 1 ? 1. + unit * wh
                         : (1. + 0.5 * unit * wh) / (1. - 0.5 * unit * wh);
    q = v0 * cpow(factor, (double)n);
    PetscCall(oscillate(options, n, wh / w, &u, &v));
    SB_CHECK_NEAR(w * u, cimag(q), 1e-10 * cabs(q), options);
    SB_CHECK_NEAR(v, creal(q), 1e-10 * cabs(q), options);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error at a fixed time against the exact oscillation, damped by alpha and beta, decreases with
   the order of the method. */
static PetscErrorCode check_order(const char *options, PetscReal share, PetscReal alpha,
                                  PetscReal beta, int order)
{
  const PetscReal w = frequency(share);
  const PetscReal zeta = 0.5 * (alpha / w + beta * w);
  const PetscReal T = 1.3 / w;
  const PetscReal wd = w * PetscSqrtReal(1. - zeta * zeta);
  const PetscReal decay = v0 * PetscExpReal(-zeta * w * T);
  const PetscReal exact_u = decay / wd * PetscSinReal(wd * T);
  const PetscReal exact_v = decay * (PetscCosReal(wd * T) - zeta * w / wd * PetscSinReal(wd * T));
  PetscReal error[2], u, v;
  char text[512];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), "%s -effect_damping_alpha %g -effect_damping_beta %g",
                          options, alpha, beta));
  for (int k = 0; k < 2; k++) {
    PetscCall(oscillate(text, 50 << k, T / (50 << k), &u, &v));
    error[k] = PetscAbsReal(w * (u - exact_u)) + PetscAbsReal(v - exact_v);
  }
  SB_CHECK_NEAR(PetscLog2Real(error[0] / error[1]), order, 0.06, text);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Free body under gravity: the fall is g h^2 n (n + 1) / 2 with implicit Euler, g t^2 / 2 with
   Newmark. */
static PetscErrorCode check_free_fall(const char *element, const char *preset, PetscReal expected)
{
  TestScene t;
  PetscReal value[3];

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:0.2,0.1,0.1:2 -body_a_element %s "
                      "-body_a_material corotated -body_a_young 1e4 -body_a_poisson 0.3 "
                      "-body_a_density 1000 -effects gravity -time %s -ts_dt 0.01 -ts_max_time 0.5 "
                      "-snes_rtol 1e-10",
                      element, preset));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(t.run->counters.steps == 50, "%s: %" PetscInt_FMT " steps instead of 50", preset,
           t.run->counters.steps);
  for (int k = 0; k < 2; k++) {
    const PetscReal at[3] = {0.2 * k, 0.1 * k, 0.05};

    PetscCall(test_value_at(t.model, t.run->state.U, at, value));
    SB_CHECK_NEAR(value[2], expected, 1e-7 * PetscAbsReal(expected), preset);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement and velocity of the end of a bar that bends under gravity. */
static PetscErrorCode bend(const char *element, const char *options, PetscInt n, PetscReal value[6])
{
  const PetscReal end[3] = {0.2, 0.05, 0.05};
  const PetscReal T = 0.02;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.2,0.1,0.1:1 -body_a_element %s -body_a_material linear "
    "-body_a_young 1e4 -body_a_poisson 0.3 -body_a_density 1000 -effects gravity,hold,damping "
    "-effect_damping_alpha 2 -effect_damping_beta 0.002 -effect_hold_type fixed "
    "-effect_hold_on xmin -ts_dt %.17g -ts_max_time %.17g -ksp_rtol 1e-14 -solver direct %s",
    element, T / (PetscReal)n, T, options));
  PetscCall(SbRunSolve(t.run));
  SB_CHECK(!t.run->clock.stop_reason[0] && t.run->counters.steps == n, "%s: %s", options,
           t.run->clock.stop_reason);
  PetscCall(test_value_at(t.model, t.run->state.U, end, value));
  PetscCall(test_value_at(t.model, t.run->state.V, end, value + 3));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Steps of h, h/2, h/4: the differences decrease with the order of the method; a first-order one
   needs smaller steps to show it. */
static PetscErrorCode check_bar_order(const char *element, const char *options, int order)
{
  PetscReal x[3][6], order_u, order_v;

  PetscFunctionBeginUser;
  for (int k = 0; k < 3; k++)
    PetscCall(bend(element, options, (order == 1 ? 60 : 20) << k, x[k]));
  order_u = PetscLog2Real((x[0][2] - x[1][2]) / (x[1][2] - x[2][2]));
  order_v = PetscLog2Real((x[0][5] - x[1][5]) / (x[1][5] - x[2][5]));
  test_print("  %s %s: order %.3f of displacements, %.3f of velocities\n", element, options,
             order_u, order_v);
  SB_CHECK_NEAR(order_u, order, 0.1, options);
  SB_CHECK_NEAR(order_v, order, 0.1, options);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "cr", "dg", "p2"};
  PetscReal u[2], v[2];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_oscillator("-time euler_implicit", 0));
  PetscCall(check_oscillator("-time euler_explicit", 1));
  PetscCall(check_oscillator("-time newmark", 2));
  PetscCall(check_oscillator("-time newmark -time_predictor velocity", 2));
  PetscCall(check_oscillator("-time genalpha -time_spectral_radius 1", 2));
  PetscCall(check_order("-time euler_implicit", 0.25, 0., 0., 1));
  PetscCall(check_order("-time euler_implicit", 0.25, 2., 0.002, 1));
  PetscCall(check_order("-time euler_explicit", 0.25, 2., 0.002, 1));
  PetscCall(check_order("-time euler_symplectic", 0.25, 0., 0., 1));
  PetscCall(check_order("-time newmark", 0.25, 0., 0., 2));
  PetscCall(check_order("-time newmark", 0.25, 2., 0.002, 2));
  PetscCall(check_order("-time newmark -mass consistent", 0.1, 0., 0., 2));
  PetscCall(check_order("-time genalpha -time_spectral_radius 0.5", 0.25, 0., 0., 2));
  PetscCall(check_order("-time genalpha -time_spectral_radius 0", 0.25, 2., 0.002, 2));

  /* highest frequencies: one step of generalized-alpha at w h = 1e4 leaves the spectral radius (in
     a norm of u, v, a: examine the decay over steps) */
  PetscCall(
    oscillate("-time genalpha -time_spectral_radius 0.5", 20, 1e4 / frequency(0.25), &u[0], &v[0]));
  PetscCall(
    oscillate("-time genalpha -time_spectral_radius 0.5", 24, 1e4 / frequency(0.25), &u[1], &v[1]));

  /* a double root: the factor per step approaches 0.5 from above, (n + 4)/n 0.5^4 for n = 20 */
  SB_CHECK(PetscAbsReal(v[1]) < PetscAbsReal(v[0]) * 0.0625 * 1.5,
           "generalized-alpha damps %g to %g in four steps", v[0], v[1]);
  for (int e = 1; e < 4; e++) {
    PetscCall(check_bar_order(elements[e], "-time euler_implicit", 1));
    PetscCall(check_bar_order(elements[e], "-time newmark", 2));
    PetscCall(check_bar_order(elements[e], "-time newmark -mass consistent", 2));
  }
  for (int e = 0; e < 4; e++) {
    PetscCall(check_free_fall(elements[e], "euler_implicit", -9.81 * 1e-4 * 50 * 51 / 2));
    PetscCall(check_free_fall(elements[e], "newmark", -0.5 * 9.81 * 0.25));
    PetscCall(check_free_fall(elements[e], "genalpha", -0.5 * 9.81 * 0.25));
  }
  SB_TEST_END();
}
