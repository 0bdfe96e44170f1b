// @ranks 1 3
/*
  Viscoelastic materials against closed forms.

    order       a cube whose skin moves as sin(w t): the deviator and the pressure of Hooke's law
                with two terms each, from the integral of the history; the error at the end falls
                with the square of the step, with every element and implicit integrator
    held        a large stretch and shear in one step, held after it: that of the elastic law times
                1 - sum g (1 - b exp(-(t - h)/tau)), b = (1 - exp(-h/tau)) tau/h, to rounding; laws
                that split shape from volume: deviator and pressure by their own factors
    turning     the same, turned meanwhile through half a turn: the stress turns along
    creep       a bar under a constant traction, and the standard linear solid's compliance
    hysteresis  the loss of a cycle over the frequency, pi G'' gamma^2, and of a viscosity; the
                balance of energy closes
    spin        a body of a viscosity spins freely without loss
    tangent     residuals change by the tangent times the change, the energy by the force
    restart     goes on bit by bit; a support that is released keeps the history
    static      the relaxed law
    errors      of constants, and of what cannot keep a history
*/
#include <unistd.h>
#include "derivatives.h"

#define E 3e5
#define NU 0.3
#define G (E / (2. * (1. + NU)))
#define BULK (E / (3. * (1. - 2. * NU)))
#define CUBE                                                                                   \
  "-bodies cube -body_cube_mesh box:1,1,1:1 -body_cube_young 3e5 -body_cube_poisson 0.3 "      \
  "-body_cube_density 1e-3 -sets skin -set_skin_at body:cube -effects pull -effect_pull_type " \
  "prescribed_displacement -effect_pull_on skin -snes_rtol 1e-11 -solver direct -ksp_rtol 1e-13 "
#define SERIES                                                                         \
  "-body_cube_prony_times 0.1,1 -body_cube_prony_shear 0.3,0.4 -body_cube_prony_bulk " \
  "0.2,0.1 "

/* Mean Cauchy stress over the volume, Pa, on all ranks. */
static PetscErrorCode mean_stress(TestScene *t, PetscReal mean[6])
{
  const SbMesh mesh = t->model->mesh;
  const PetscReal *u;
  PetscReal *sigma, *J;
  PetscReal sum[7] = {0.};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(6 * mesh->ncell_owned, &sigma, mesh->ncell_owned, &J));
  PetscCall(SbSpaceGetLocalRead(t->model->space, t->run->state.U, &u));
  SbSpaceCellState(t->model->space, u, sigma, J, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(t->model->space, t->run->state.U, &u));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscReal V = SbTetDeterminant(mesh->x, mesh->cell + 4 * c) / 6.;

    for (int k = 0; k < 6; k++)
      sum[k] += V * sigma[6 * c + k];
    sum[6] += V;
  }
  PetscCall(PetscFree2(sigma, J));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 7, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  for (int k = 0; k < 6; k++)
    mean[k] = sum[k] / sum[6];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The mean stress at the end of a run, xx yy zz xy yz xz. */
static PetscErrorCode stress_of(PetscReal stress[6], const char *format, ...)
  PETSC_ATTRIBUTE_FORMAT(2, 3);
static PetscErrorCode stress_of(PetscReal stress[6], const char *format, ...)
{
  TestScene t;
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(test_vopen(PETSC_COMM_WORLD, NULL, &t, format, args));
  va_end(args);
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(mean_stress(&t, stress));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscReal largest_difference(const PetscReal a[6], const PetscReal b[6])
{
  PetscReal d = 0.;

  for (int k = 0; k < 6; k++)
    d = PetscMax(d, PetscAbsReal(a[k] - b[k]));
  return d;
}

/* The integral of exp(-(T - s) / tau) w cos(w s) from 0 to T. */
static PetscReal history_of(PetscReal w, PetscReal tau, PetscReal T)
{
  const PetscReal a = 1. / tau;

  return w / (a * a + w * w) *
         (a * PetscCosReal(w * T) + w * PetscSinReal(w * T) - a * PetscExpReal(-a * T));
}

static PetscErrorCode check_order(const char *element, const char *time)
{
  const PetscReal w = 3.;
  const PetscReal T = 0.8;
  const PetscReal shear =
    0.3 * PetscSinReal(w * T) + 0.3 * history_of(w, 0.1, T) + 0.4 * history_of(w, 1., T);
  const PetscReal bulk =
    0.7 * PetscSinReal(w * T) + 0.2 * history_of(w, 0.1, T) + 0.1 * history_of(w, 1., T);
  const PetscReal dev = 2. * G * 0.005 / 3. * shear;
  const PetscReal p = BULK * 0.005 * bulk;
  const PetscReal exact[6] = {p - dev, p - dev, p + 2. * dev, 0., 0., G * 0.01 * shear};
  PetscReal error[3], stress[6];

  PetscFunctionBeginUser;
  verify_case("order, %s, %s", element, time);
  for (int k = 0; k < 3; k++) {
    PetscCall(stress_of(
      stress,
      CUBE SERIES "-body_cube_material linear -body_cube_element %s -effect_pull_displacement "
                  "0.01*sin(3*t)*z;0;0.005*sin(3*t)*z -time %s -ts_dt %g -ts_max_time %g",
      element, time, 0.1 / (1 << k), T));
    error[k] = largest_difference(stress, exact) / exact[5];
  }
  VERIFY_LESS(error[2], 1e-3, "error of the stress");
  VERIFY_NEAR(PetscLog2Real(error[0] / error[1]), 2., 0.1, "order");
  VERIFY_NEAR(PetscLog2Real(error[1] / error[2]), 2., 0.05, "order");
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define H 0.05 /* length of a step, s */
#define HELD                                             \
  "-time newmark -ts_dt 0.05 -effect_pull_displacement " \
  "min(t/0.05,1)*(0.4*x+0.3*y);-min(t/0.05,1)*0.1*y;min(t/0.05,1)*(0.1*z+0.2*x) "

/* 1 - sum of what has relaxed at T of a jump in the first step. */
static PetscReal relaxed(const PetscReal g[2], PetscReal T)
{
  static const PetscReal tau[2] = {0.1, 1.};
  PetscReal factor = 1.;

  for (int i = 0; i < 2; i++)
    factor -=
      g[i] * (1. - (1. - PetscExpReal(-H / tau[i])) * tau[i] / H * PetscExpReal(-(T - H) / tau[i]));
  return factor;
}

/* split: the law splits shape from volume, so that deviator and pressure have factors of their
   own; else both series are the same. */
static PetscErrorCode check_held(const char *law, const char *element, PetscReal nu,
                                 PetscBool split)
{
  const PetscReal shear[2] = {0.3, 0.4};
  const PetscReal bulk[2] = {split ? 0.2 : 0.3, split ? 0.1 : 0.4};
  PetscReal elastic[6], stress[6], exact[6], p;
  PetscReal size = 0.;

  PetscFunctionBeginUser;
  verify_case("held, %s, %s, nu %g", law, element, nu);
  PetscCall(stress_of(elastic,
                      CUBE HELD "-body_cube_material %s -body_cube_element %s -body_cube_poisson "
                                "%g -ts_max_time 0.05",
                      law, element, nu));
  PetscCall(stress_of(
    stress,
    CUBE HELD "-body_cube_material %s -body_cube_element %s -body_cube_poisson %g -ts_max_time "
              "0.3 -body_cube_prony_times 0.1,1 -body_cube_prony_shear 0.3,0.4 "
              "-body_cube_prony_bulk %g,%g",
    law, element, nu, bulk[0], bulk[1]));
  p = (elastic[0] + elastic[1] + elastic[2]) / 3.;
  for (int k = 0; k < 6; k++) {
    const PetscReal mean = k < 3 ? p : 0.;

    exact[k] = relaxed(shear, 0.3) * (elastic[k] - mean) + relaxed(bulk, 0.3) * mean;
    size = PetscMax(size, PetscAbsReal(exact[k]));
  }
  VERIFY_LESS(largest_difference(stress, exact) / size, 1e-9, "error of the stress");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_turning(const char *law, const char *element)
{
  static const PetscReal axis[3] = {0., 0., 1.};
  PetscReal still[6], turned[6], R[9], full[9], back[9], part[9];
  PetscReal size = 0.;
  PetscReal difference = 0.;
  static const int at[9] = {0, 3, 5, 3, 1, 4, 5, 4, 2};

  PetscFunctionBeginUser;
  verify_case("turning, %s, %s", law, element);
  PetscCall(stress_of(
    still, CUBE SERIES HELD "-body_cube_material %s -body_cube_element %s -ts_max_time 0.3", law,
    element));

  /* u = R (1.4 x + 0.3 y, 0.9 y, z + 0.1 z + 0.2 x) - X, R by 10 t about z */
  PetscCall(stress_of(
    turned,
    CUBE SERIES
    "-body_cube_material %s -body_cube_element %s -time newmark -ts_dt 0.05 -ts_max_time 0.3 "
    "-effect_pull_displacement "
    "cos(10*t)*(x+min(t/0.05,1)*(0.4*x+0.3*y))-sin(10*t)*(y-min(t/0.05,1)*0.1*y)-x;"
    "sin(10*t)*(x+min(t/0.05,1)*(0.4*x+0.3*y))+cos(10*t)*(y-min(t/0.05,1)*0.1*y)-y;"
    "min(t/0.05,1)*(0.1*z+0.2*x)",
    law, element));
  verify_rotation(axis, 3., R);
  for (int k = 0; k < 9; k++)
    full[k] = turned[at[k]];
  SbMatTransposeMul(R, full, part);
  SbMatMul(part, R, back);
  for (int k = 0; k < 9; k++) {
    difference = PetscMax(difference, PetscAbsReal(back[k] - still[at[k]]));
    size = PetscMax(size, PetscAbsReal(back[k]));
  }
  VERIFY_LESS(difference / size, 1e-9, "difference of the stress, turned back");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The compliance of E (1 - g + g exp(-t / tau)) under a load that grows for 0.1 s:
   1/E_r - (1/E_r - 1/E) exp(-t / s), E_r = (1 - g) E, s = tau / (1 - g), its mean. */
static PetscErrorCode check_creep(const char *element)
{
  const PetscReal g = 0.6;
  const PetscReal tau = 0.2;
  const PetscReal T = 0.8;
  const PetscReal s = tau / (1. - g);
  const PetscReal rest = 1. / ((1. - g) * E);
  const PetscReal exact =
    30. * (rest - (rest - 1. / E) * PetscExpReal(-T / s) * s * (PetscExpReal(0.1 / s) - 1.) / 0.1);
  const PetscReal tip[3] = {1., 0., 0.};
  PetscReal error[2], u[3];
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("creep, %s", element);
  for (int k = 0; k < 2; k++) {
    PetscCall(test_open(
      &t,
      "-bodies cube -body_cube_mesh box:1,1,1:1 -body_cube_material linear -body_cube_young 3e5 "
      "-body_cube_poisson 0.3 -body_cube_density 1e-3 -body_cube_element %s "
      "-body_cube_prony_times 0.2 -body_cube_prony_shear 0.6 -body_cube_prony_bulk 0.6 -effects "
      "x,y,z,load -effect_x_type fixed -effect_x_on xmin -effect_x_components x -effect_y_type "
      "fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed -effect_z_on zmin "
      "-effect_z_components z -effect_load_type traction -effect_load_on xmax -effect_load_vector "
      "30*min(t/0.1,1);0;0 -time euler_implicit -ts_dt %g -ts_max_time 0.8 -solver direct "
      "-ksp_rtol 1e-13",
      element, 0.05 / (1 << k)));
    PetscCall(verify_solve(&t, element));
    PetscCall(test_value_at(t.model, t.run->state.U, tip, u));
    error[k] = PetscAbsReal(u[0] - exact) / exact;
    PetscCall(test_scene_close(&t));
  }
  VERIFY_LESS(error[1], 2e-3, "error of the displacement");
  VERIFY_NEAR(PetscLog2Real(error[0] / error[1]), 2., 0.2, "order");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Loss of a cycle of the shear gamma (1 - cos(w t)) when it is periodic; the balance closes to the
   rounding of the work. */
static PetscErrorCode check_hysteresis(const char *law, const char *element, const char *constants,
                                       PetscReal w, PetscInt cycles, PetscReal loss_modulus)
{
  const PetscReal period = 2. * PETSC_PI / w;
  const PetscReal gamma = 1e-3;
  PetscReal before = 0.;
  PetscReal lost;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("hysteresis, %s, %s, %s, %g rad/s", law, element, constants, w);
  for (int k = 0; k < 2; k++) {
    const SbEnergies *e;

    PetscCall(test_open(&t,
                        CUBE "-body_cube_material %s -body_cube_element %s %s -time newmark -ts_dt "
                             "%.17g -ts_max_time %.17g -effect_pull_displacement "
                             "%g*(1-cos(%.17g*t))*z;0;0",
                        law, element, constants, period / 100., (PetscReal)(cycles + k) * period,
                        gamma, w));
    t.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(verify_solve(&t, verify_title));
    e = &t.run->state.energies;
    lost = e->relaxation_loss + e->viscosity_loss;
    if (k) {
      VERIFY_NEAR((lost - before) / (PETSC_PI * gamma * gamma * loss_modulus), 1., 3e-3,
                  "loss of a cycle over the closed form");
      VERIFY_LESS(PetscAbsReal(e->integrator_loss) / lost, 1e-8, "error of the balance");
    }
    before = lost;
    PetscCall(test_scene_close(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A body of a viscosity spins about a principal axis: E does not change but for what the
   centrifugal force strains at first. */
static PetscErrorCode check_spin(const char *element)
{
  TestScene t;
  const SbEnergies *e;

  PetscFunctionBeginUser;
  verify_case("spin, %s", element);
  PetscCall(test_open(&t,
                      "-bodies cube -body_cube_mesh box:0.1,0.1,0.1:1 -body_cube_material "
                      "neohookean -body_cube_young 1e7 -body_cube_poisson 0.3 -body_cube_density "
                      "1000 -body_cube_element %s -body_cube_viscosity 1e4 "
                      "-body_cube_prony_times 0.01 -body_cube_prony_shear 0.5 "
                      "-body_cube_angular_velocity 0,0,20 -time newmark -ts_dt 0.002 "
                      "-ts_max_time 0.4 -snes_rtol 1e-10 -solver direct",
                      element));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, verify_title));
  e = &t.run->state.energies;
  VERIFY_LESS((e->viscosity_loss + e->relaxation_loss) / e->kinetic, 1e-3,
              "loss over the kinetic energy");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void ripple(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(20. * x[1]) * x[0];
  v[1] = PetscCosReal(15. * x[2] + 5. * x[0]) * x[0];
  v[2] = PetscSinReal(12. * x[0] + 9. * x[1]) * x[0];
}

/* A bar that bends, within a step: the remainder of the tangent falls with the square of the
   change; the energy's derivative is the force. */
static PetscErrorCode check_tangent(const char *law, const char *element, const char *constants)
{
  TestScene t;
  Vec X, D;

  PetscFunctionBeginUser;
  verify_case("tangent, %s, %s, %s", law, element, constants);
  PetscCall(test_open(&t,
                      "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_material %s "
                      "-body_bar_young 5e4 -body_bar_poisson 0.4 -body_bar_density 1000 "
                      "-body_bar_element %s %s -body_bar_tangent exact -effects hold,gravity "
                      "-effect_hold_type fixed -effect_hold_on xmin -time newmark -ts_dt 0.01 "
                      "-ts_max_time 0.2 -snes_rtol 1e-9 -solver direct",
                      law, element, constants));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(SbSpaceViscousAt(t.model->space, 0.01, PETSC_TRUE, t.run->state.U, t.run->state.V));
  PetscCall(VecDuplicate(t.run->state.U, &X));
  PetscCall(VecDuplicate(X, &D));
  PetscCall(test_fill(t.model, ripple, D));
  PetscCall(SbSpaceZeroPrescribed(t.model->space, PETSC_TRUE, D));

  /* not at the state itself, where viscosities are at their rate */
  PetscCall(VecWAXPY(X, 0.02, D, t.run->state.U));
  PetscCall(verify_derivatives(&t, 0.21, 1e-3, X, D));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&D));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BAR                                                                                     \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_material neohookean -body_bar_young " \
  "5e4 -body_bar_poisson 0.4 -body_bar_density 1000 -body_bar_prony_times 0.02,0.2 "            \
  "-body_bar_prony_shear 0.3,0.4 -body_bar_prony_bulk 0.1,0 -body_bar_viscosity 10 "            \
  "-effects hold,gravity -effect_hold_type fixed -effect_hold_on xmin -time %s "                \
  "-body_bar_element %s -ts_dt 0.01 -snes_rtol 1e-9 -solver direct "

static PetscErrorCode check_restart(const char *time, const char *element)
{
  const char *folder = getenv("TMPDIR");
  char dir[256];
  int id = (int)getpid();
  PetscReal *whole, *again;
  SbEnergies e[2];
  PetscBool same = PETSC_TRUE;
  PetscInt n;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("restart, %s, %s", time, element);
  PetscCallMPI(MPI_Bcast(&id, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCall(PetscSNPrintf(dir, sizeof(dir), "%s/viscous_%d", folder ? folder : "/tmp", id));
  PetscCall(test_open_in(dir, &t,
                         BAR "-ts_max_time 0.2 -checkpoint_every_steps 10 -checkpoint_keep 9 "
                             "-output_fields none -progress false",
                         time, element));
  PetscCall(verify_solve(&t, verify_title));
  n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, &whole));
  e[0] = t.run->state.energies;
  PetscCall(test_scene_close(&t));
  PetscCall(test_open_in(dir, &t,
                         BAR "-ts_max_time 0.2 -checkpoint_every_steps 10 -checkpoint_keep 9 "
                             "-output_fields none -progress false -restart %s/checkpoint_000010.h5",
                         time, element, dir));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(verify_gather(t.model, t.run->state.U, &again));
  e[1] = t.run->state.energies;
  SB_CHECK(t.run->counters.steps == 10, "%d steps after the restart", (int)t.run->counters.steps);
  PetscCall(test_scene_close(&t));
  for (PetscInt i = 0; i < n; i++)
    same = (PetscBool)(same && whole[i] == again[i]);
  SB_CHECK(same, "%s: the restarted run differs", verify_title);
  SB_CHECK(e[0].relaxation_loss == e[1].relaxation_loss && e[0].strain == e[1].strain &&
             e[0].viscosity_loss == e[1].viscosity_loss && e[1].relaxation_loss > 0.,
           "%s: losses %.17g and %.17g, %.17g and %.17g", verify_title, e[0].relaxation_loss,
           e[1].relaxation_loss, e[0].viscosity_loss, e[1].viscosity_loss);
  PetscCall(PetscFree(whole));
  PetscCall(PetscFree(again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The support of another body goes at 0.1 s: the scene is set up again, and the history goes on. */
static PetscErrorCode check_release(const char *element)
{
  const PetscReal tip[3] = {0.4, 0.1, 0.1};
  PetscReal u[2][3];
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("release, %s", element);
  for (int k = 0; k < 2; k++) {
    PetscCall(test_open(&t,
                        BAR "-ts_max_time 0.2 -bodies post,bar -body_post_mesh box:0.1,0.1,0.1:1 "
                            "-body_post_translate 0,1,0 -body_post_material linear "
                            "-body_post_young 1e6 -body_post_poisson 0.3 -body_post_density 1000 "
                            "-effects hold,gravity,more -effect_hold_on bar.xmin -effect_more_type "
                            "fixed -effect_more_on post.xmin %s",
                        "genalpha", element, k ? "-effect_more_until 0.1" : ""));
    PetscCall(test_scene_solve(&t));
    SB_CHECK(!t.run->clock.stop_reason[0] && t.run->clock.t > 0.199, "%s: %g s, %s", verify_title,
             t.run->clock.t, t.run->clock.stop_reason);
    PetscCall(test_value_at(t.model, t.run->state.U, tip, u[k]));
    PetscCall(test_scene_close(&t));
  }
  VERIFY_NEAR(u[1][2] / u[0][2], 1., 1e-7, "fall of the tip over that of one run");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A load path ends at what the elastic law has with the relaxed moduli. */
static PetscErrorCode check_static(const char *element)
{
  const PetscReal shear = 0.3 * G;
  const PetscReal bulk = 0.7 * BULK;
  PetscReal stress[6], other[6];

  PetscFunctionBeginUser;
  verify_case("static, %s", element);
  for (int k = 0; k < 2; k++)
    PetscCall(stress_of(
      k ? other : stress,
      CUBE "-body_cube_material isochoric_neohookean -body_cube_element %s -time static "
           "-effect_pull_displacement 0.4*x+0.3*y;-0.1*y;0.1*z+0.2*x -body_cube_young %.17g "
           "-body_cube_poisson %.17g %s",
      element, k ? 9. * bulk * shear / (3. * bulk + shear) : E,
      k ? (3. * bulk - 2. * shear) / (6. * bulk + 2. * shear) : NU, k ? "" : SERIES));
  VERIFY_LESS(largest_difference(stress, other) / PetscAbsReal(other[0]), 1e-9,
              "difference from the relaxed moduli");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_errors(void)
{
  static const struct {
    const char *options, *names;
  } cases[] = {
    {"-body_cube_prony_times 0.1,0 -body_cube_prony_shear 0.1,0.1", "-body_cube_prony_times|0"},
    {"-body_cube_prony_times 0.1,-2 -body_cube_prony_shear 0.1,0.1", "-body_cube_prony_times|-2"},
    {"-body_cube_prony_times 0.1,1 -body_cube_prony_shear 0.1", "-body_cube_prony_shear|1|2"},
    {"-body_cube_prony_times 0.1,1 -body_cube_prony_shear 0.5,0.5", "-body_cube_prony_shear|1"},
    {"-body_cube_prony_times 0.1,1 -body_cube_prony_bulk 0.5,-0.1", "-body_cube_prony_bulk|-0.1"},
    {"-body_cube_prony_times 0.1,a -body_cube_prony_bulk 0.5,0.1", "-body_cube_prony_times|0.1,a"},
    {"-body_cube_prony_times 0.1", "-body_cube_prony_times"},
    {"-body_cube_prony_shear 0.1", "-body_cube_prony_shear|-body_cube_prony_times"},
    {"-body_cube_prony_times 1 -body_cube_prony_bulk 0.9 -body_cube_poisson 0.1",
     "-body_cube_prony_bulk|neohookean"},
    {"-body_cube_viscosity 1 -time euler_symplectic", "-body_cube_viscosity|-time"},
    {"-body_cube_viscosity 1 -time alpha2", "-body_cube_viscosity|alpha2"},
  };
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("errors");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    char text[VERIFY_TEXT];

    PetscCall(PetscSNPrintf(text, sizeof(text),
                            CUBE "-body_cube_material neohookean -effect_pull_displacement "
                                 "0,0,0 %s",
                            cases[i].options));
    SB_CHECK_ERROR(test_scene_open(text, &t), PETSC_ERR_USER, cases[i].names);
    PetscCall(test_scene_close(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  static const char *const laws[] = {
    "corotated", "stvk", "neohookean", "stable_neohookean", "isochoric_neohookean", "holmes_mow"};
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (int k = 0; k < 4; k++)
    PetscCall(check_order(elements[k], "newmark"));
  PetscCall(check_order("p1", "genalpha"));
  PetscCall(check_order("p2", "euler_implicit"));
  for (int l = 0; l < 6; l++)
    PetscCall(check_held(laws[l], elements[l % 4], NU, PETSC_FALSE));
  for (int k = 0; k < 4; k++)
    PetscCall(check_held("isochoric_neohookean", elements[k], 0.45, PETSC_TRUE));
  for (int l = 0; l < 6; l++)
    PetscCall(check_turning(laws[l], elements[(l + 1) % 4]));
  PetscCall(check_creep("p1"));
  PetscCall(check_creep("p2"));
  for (int k = 0; k < 3; k++) {
    const PetscReal w = k == 0 ? 0.5 : k == 1 ? 4. : 30.;
    const PetscReal loss =
      G * w * (0.3 * 0.1 / (1. + PetscSqr(0.1 * w)) + 0.4 / (1. + PetscSqr(w)));

    PetscCall(check_hysteresis("neohookean", elements[k], SERIES, w, k == 2 ? 30 : 3, loss));
  }
  PetscCall(check_hysteresis("linear", "dg", "-body_cube_viscosity 2e3", 4., 1, 2e3 * 4.));
  PetscCall(check_hysteresis("stvk", "p2", "-body_cube_viscosity 2e3", 30., 1, 2e3 * 30.));
  PetscCall(check_spin("p1"));
  PetscCall(check_spin("p2"));
  for (int l = 0; l < 6; l++) {
    PetscCall(check_tangent(laws[l], elements[l % 4],
                            "-body_bar_prony_times 0.02,0.2 -body_bar_prony_shear 0.3,0.4 "
                            "-body_bar_prony_bulk 0.2,0.1"));
    PetscCall(check_tangent(laws[l], "p2",
                            "-body_bar_prony_times 0.02,0.2 -body_bar_prony_shear 0.3,0.4 "
                            "-body_bar_prony_bulk 0.2,0.1 -body_bar_viscosity 20 "
                            "-body_bar_viscosity_bulk 5"));
  }
  PetscCall(check_restart("newmark", "p1"));
  PetscCall(check_restart("genalpha", "p2"));
  PetscCall(check_restart("euler_implicit", "cr"));
  PetscCall(check_release("p1"));
  PetscCall(check_release("p2"));
  for (int k = 0; k < 4; k++)
    PetscCall(check_static(elements[k]));
  PetscCall(check_errors());
  SB_TEST_END();
}
