// @ranks 1 2
/*
  Energy and momentum over many steps.

    drift      Newmark (1/4, 1/2) on a linear body: energy is conserved up to rounding for 1e5 steps
    (one rank) decay      implicit Euler on a linear body: energy decreases in every step, and the
    integrator's loss in the energy
               balance is exactly 1/2 dv.M dv + 1/2 du.K du of the steps
    account    a nonlinear body with loads, prescribed motion and damping: the residual of the
    energy balance is O(h^2) for Newmark turning    the end of a bar rotates by 9 degrees per step:
    implicit Euler gains no energy, nor does a static load path grip       two obstacles rotate the
    end of a bar by 2 degrees per step: the same swing      a soft bar of CR or DG is released under
    its weight: the jump penalty follows the bending pressure, and gains no energy
    momentum   free flight with spin: linear momentum up to rounding with every integrator; angular
    momentum up to rounding with
               symplectic Euler, which conserves it, else to the order of the method
*/
#include "verify.h"

#define BODY " -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 "
#define TIGHT " -ksp_rtol 1e-14 -snes_rtol 1e-14 -snes_stol 0 "

/* ------------------------------------------------------------------ drift */

typedef struct {
  PetscReal start, largest; /* J; largest deviation from start, relative */
  PetscInt every;
} Drift;

static PetscErrorCode watch_drift(SbRun run, const SbStep *step, void *ctx)
{
  Drift *d = (Drift *)ctx;
  SbEnergies e;

  PetscFunctionBeginUser;
  if (step->step % d->every)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  if (step->step == 0)
    d->start = e.kinetic + e.strain;
  d->largest = PetscMax(d->largest, PetscAbsReal((e.kinetic + e.strain) / d->start - 1.));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_drift(const char *element, PetscInt steps)
{
  Drift d = {.every = 100};
  TestScene t;
  double begin = MPI_Wtime();

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.2,0.1,0.1:1" BODY
    "-body_a_element %s -body_a_material linear -body_a_velocity 0.1,0,0.3 -effects clamp "
    "-effect_clamp_type fixed -effect_clamp_on xmin -time newmark -ts_dt 0.003 -ts_max_time "
    "%.17g" TIGHT,
    element, 0.003 * (double)steps));
  PetscCall(SbRunAddMonitor(t.run, watch_drift, &d));
  PetscCall(verify_solve(&t, "drift"));
  SB_CHECK(PetscAbsInt(t.run->counters.steps - steps) <= 1, "%d steps", (int)t.run->counters.steps);
  test_print("  drift of Newmark, %s, over %d steps: %.1e of the energy (%.0f s)\n", element,
             (int)t.run->counters.steps, d.largest, MPI_Wtime() - begin);

  /* rounding of one step if all signs are equal: 1e-15 for P1, more for elements with more unknowns
     (4.4e-15 on one machine, below 4e-15 on others) */
  SB_CHECK(d.largest < (strcmp(element, "p1") ? 8e-15 : 1e-15) * (double)steps,
           "%s: energy drifts by %g in %d steps", element, d.largest, (int)steps);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ decay */

typedef struct {
  Vec U, V, F; /* last step; work vectors */
  PetscReal energy, loss;
  PetscInt ups;
} Decay;

/* Adds 1/2 dv.M dv + 1/2 du.K du; K du is the force of du, because the body is linear. */
static PetscErrorCode watch_decay(SbRun run, const SbStep *step, void *ctx)
{
  Decay *d = (Decay *)ctx;
  const PetscReal energy = step->energies.kinetic + step->energies.strain;
  SbEnergies e;

  PetscFunctionBeginUser;
  if (!d->U) {
    PetscCall(VecDuplicate(step->U, &d->U));
    PetscCall(VecDuplicate(step->U, &d->V));
  } else {
    d->ups += energy > d->energy * (1. + 1e-13);
    PetscCall(VecAYPX(d->U, -1., step->U));
    PetscCall(VecAYPX(d->V, -1., step->V));
    PetscCall(SbModelEnergies(run->model, d->U, d->V, &e));
    d->loss += e.kinetic + e.strain;
  }
  d->energy = energy;
  PetscCall(VecCopy(step->U, d->U));
  PetscCall(VecCopy(step->V, d->V));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_decay(const char *element, PetscReal h)
{
  Decay d = {.U = NULL};
  SbEnergies *e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.2,0.1,0.1:2" BODY
    "-body_a_element %s -body_a_material linear -body_a_velocity 0.1,0,0.3 -effects clamp "
    "-effect_clamp_type fixed -effect_clamp_on xmin -time euler_implicit -ts_dt %.17g "
    "-ts_max_time %.17g" TIGHT,
    element, h, 100. * h));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_decay, &d));
  PetscCall(verify_solve(&t, "decay"));
  e = &t.run->state.energies;
  test_print(
    "  implicit Euler, %s, h %g s: energy left %.3e of the start, account off by %.1e of it\n",
    element, h, (e->kinetic + e->strain) / t.run->state.energy_start,
    PetscAbsReal(e->integrator_loss - d.loss) / t.run->state.energy_start);
  SB_CHECK(d.ups == 0, "%s, h %g: energy rises in %d of 100 steps", element, h, (int)d.ups);
  SB_CHECK_NEAR(e->integrator_loss, d.loss, 1e-12 * t.run->state.energy_start,
                "loss of implicit Euler");
  PetscCall(VecDestroy(&d.U));
  PetscCall(VecDestroy(&d.V));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ energy balance */

/* Residual of the energy balance after half a second, relative to the work and the damping loss. */
static PetscErrorCode missing(const char *preset, const char *element, const char *law, PetscReal h,
                              PetscReal *loss)
{
  SbEnergies *e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.2,0.1,0.1:2" BODY
    "-body_a_element %s -body_a_material %s -effects gravity,damping,hand,wind "
    "-effect_damping_alpha 1 "
    "-effect_damping_beta 0.002 -effect_hand_type prescribed_displacement -effect_hand_on xmin "
    "-effect_hand_displacement 0.05*sin(6*t)^2;0;0.03*t^2 -effect_wind_type traction "
    "-effect_wind_on xmax "
    "-effect_wind_vector 0;500*t;0 -time %s -ts_dt %.17g -ts_max_time 0.5" TIGHT,
    element, law, preset, h));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, "account"));
  e = &t.run->state.energies;
  *loss = e->integrator_loss /
          (PetscAbsReal(e->load_work) + PetscAbsReal(e->prescribed_work) + e->damping_loss);
  test_print("  account of %s, %s %s, h %g s: loads %.4f J, drive %.4f J, damping %.4f J, kinetic "
             "%.4f J, strain %.4f J; missing %.1e of that\n",
             preset, element, law, h, e->load_work, e->prescribed_work, e->damping_loss, e->kinetic,
             e->strain, *loss);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* order 0: not checked, because CR and DG faces lose or gain some energy where their force reaches
   its bounds. */
static PetscErrorCode check_account(const char *preset, const char *element, const char *law,
                                    int order, PetscReal bound)
{
  PetscReal loss[2];

  PetscFunctionBeginUser;
  PetscCall(missing(preset, element, law, 0.0025, &loss[0]));
  PetscCall(missing(preset, element, law, 0.00125, &loss[1]));
  SB_CHECK(PetscAbsReal(loss[1]) < bound, "%s, %s, %s: %g of the work is missing", preset, element,
           law, loss[1]);
  if (order)
    SB_CHECK_NEAR(PetscLog2Real(PetscAbsReal(loss[0] / loss[1])), order, 0.3, preset);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ swing */

typedef struct {
  PetscReal least, largest; /* J; of the integrator's loss, and of the strain energy */
} Swing;

static PetscErrorCode watch_swing(SbRun run, const SbStep *step, void *ctx)
{
  Swing *w = (Swing *)ctx;

  PetscFunctionBeginUser;
  (void)run;
  w->least = PetscMin(w->least, step->energies.integrator_loss);
  w->largest = PetscMax(w->largest, step->energies.strain);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Energy gain: little above the residual of the integrator, 4e-4; penalties on whole jumps gained
   an eighth. Bounds of forces lose 1 % in a second. */
static PetscErrorCode check_swing(const char *element)
{
  Swing w = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.4,0.1,0.1:2 -body_a_element %s -body_a_material "
    "stable_neohookean "
    "-body_a_young "
    "3e4 -body_a_poisson 0.45 -body_a_density 1000 -effects gravity,clamp -effect_gravity_vector "
    "0,0,-9.81 "
    "-effect_clamp_type fixed -effect_clamp_on xmin -time newmark -ts_dt 0.005 -ts_max_time 1",
    element));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_swing, &w));
  PetscCall(verify_solve(&t, "swing"));
  test_print("  swing, %s: strain energy up to %.2f J, given %.1e J, lost %.1e J\n", element,
             w.largest, -w.least, t.run->state.energies.integrator_loss);
  SB_CHECK(-w.least < 5e-3 * w.largest, "%s: %g J were given", element, -w.least);
  SB_CHECK(t.run->state.energies.integrator_loss < 0.02 * w.largest, "%s: %g J were lost", element,
           t.run->state.energies.integrator_loss);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ momentum */

static PetscErrorCode fly(const char *preset, const char *element, const char *law, PetscReal h,
                          PetscReal change[2])
{
  SbEnergies before, after;
  PetscReal size[2] = {0., 0.};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:0.3,0.2,0.1:1" BODY
                      "-body_a_element %s -body_a_material %s -body_a_velocity 0.3,-0.2,0.1 "
                      "-body_a_angular_velocity 1,2,6 -time %s -ts_dt %.17g -ts_max_time 0.1" TIGHT,
                      element, law, preset, h));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &before));
  PetscCall(verify_solve(&t, preset));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &after));
  change[0] = change[1] = 0.;
  for (int k = 0; k < 3; k++) {
    change[0] += PetscSqr(after.momentum[k] - before.momentum[k]);
    change[1] += PetscSqr(after.angular[k] - before.angular[k]);
    size[0] += PetscSqr(before.momentum[k]);
    size[1] += PetscSqr(before.angular[k]);
  }
  for (int k = 0; k < 2; k++)
    change[k] = PetscSqrtReal(change[k] / size[k]);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* order: of the angular momentum; 0: exact; -1: not checked */
static PetscErrorCode check_flight(const char *preset, const char *element, const char *law,
                                   PetscReal h, int order)
{
  PetscReal coarse[2], fine[2];

  PetscFunctionBeginUser;
  PetscCall(fly(preset, element, law, h, coarse));
  PetscCall(fly(preset, element, law, 0.5 * h, fine));
  test_print("  free flight, %-16s %s %-10s h %g, %g s: momentum changes by %.1e %.1e, angular "
             "momentum by %.1e %.1e\n",
             preset, element, law, h, 0.5 * h, coarse[0], fine[0], coarse[1], fine[1]);
  SB_CHECK(coarse[0] < 1e-12 && fine[0] < 1e-12, "%s, %s, %s: momentum changes by %g and %g",
           preset, element, law, coarse[0], fine[0]);
  if (!order)
    SB_CHECK(fine[1] < 1e-11, "%s, %s, %s: angular momentum changes by %g", preset, element, law,
             fine[1]);
  if (order > 0)
    SB_CHECK_NEAR(PetscLog2Real(coarse[1] / fine[1]), order, 0.3, preset);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ turning */

static PetscErrorCode watch_gain(SbRun run, const SbStep *step, void *ctx)
{
  PetscReal *gain = (PetscReal *)ctx;

  PetscFunctionBeginUser;
  (void)run;
  *gain = PetscMax(*gain, -step->energies.integrator_loss);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The trapezoidal rule gains at most 2e-5 in these scenes; work along chords instead of arcs would
   gain `chord`. */
static PetscErrorCode check_gain(const char *what, PetscReal chord, const char *text)
{
  TestScene t;
  PetscReal gain = 0.;
  PetscReal given;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(text, &t));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_gain, &gain));
  PetscCall(verify_solve(&t, what));
  given = t.run->state.energies.prescribed_work + t.run->state.energies.load_work;
  test_print("  %s: gain %.1e of the work %g J\n", what, gain / given, given);
  SB_CHECK(given > 0. && gain < 0.1 * chord * given, "%s: gain %g J, work %g J", what, gain, given);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_turning(const char *time, const char *element)
{
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-bodies a -body_a_mesh box:0.3,0.1,0.1:2" BODY
    "-body_a_element %s -body_a_material stable_neohookean -effects "
    "clamp,end -effect_clamp_type fixed -effect_clamp_on "
    "xmin -effect_end_type prescribed_displacement -effect_end_on xmax -effect_end_displacement "
    "0;0;0.01*t -effect_end_angle 90*t -effect_end_axis 1,0,0 -effect_end_axis_point 0,0.05,0.05 "
    "-time %s",
    element, time));
  PetscCall(check_gain("turning", 3e-3, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define ROD(name, x)                                                               \
  " -effect_" name "_type contact -effect_" name "_response barrier -effect_" name \
  "_obstacle capsule:" x ",-0.1,0.28," x ",0.1,0.28,0.01 -effect_" name            \
  "_axis 0,0,1 -effect_" name "_axis_point 0,0,0 -effect_" name "_angle 40*t "

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  if (test_size == 1)
    PetscCall(check_drift("p1", 100000));
  if (test_size == 1)
    PetscCall(check_drift("cr", 10000));
  if (test_size == 1)
    PetscCall(check_drift("dg", 10000));
  if (test_size == 1)
    PetscCall(check_drift("p2", 10000));
  PetscCall(check_decay("p1", 0.002));
  PetscCall(check_decay("p1", 0.05));
  PetscCall(check_decay("cr", 0.002));
  PetscCall(check_decay("dg", 0.002));
  PetscCall(check_decay("p2", 0.002));
  PetscCall(check_account("newmark", "p1", "corotated", 2, 1e-3));
  PetscCall(check_account("euler_implicit", "p1", "corotated", 1, 0.1));
  PetscCall(check_account("newmark", "cr", "corotated", 0, 6e-4));
  PetscCall(check_account("newmark", "dg", "corotated", 0, 6e-4));
  PetscCall(check_account("newmark", "p2", "corotated", 2, 1e-3));
  PetscCall(check_turning("euler_implicit -ts_dt 0.1 -ts_max_time 1", "p1"));
  PetscCall(check_turning("static -static_steps 10", "p2"));
  PetscCall(check_gain(
    "grip", 9.5e-4,
    "-bodies a -body_a_mesh box:0.1,0.1,0.3:2,2,6 -body_a_translate -0.05,-0.05,0" BODY
    "-body_a_material stable_neohookean -effects clamp,left,right -effect_clamp_type fixed "
    "-effect_clamp_on zmin -time static -static_steps 20" ROD("left", "-0.0612")
      ROD("right", "0.0612")));
  PetscCall(check_swing("cr"));
  PetscCall(check_swing("dg"));
  PetscCall(check_flight("euler_implicit", "p1", "corotated", 2e-3, 1));
  PetscCall(check_flight("newmark", "p1", "corotated", 2e-3, 2));
  PetscCall(check_flight("genalpha", "p1", "stvk", 2e-3, 2));
  PetscCall(check_flight("euler_symplectic", "p1", "corotated", 2e-4, 0));
  PetscCall(check_flight("newmark", "cr", "corotated", 2e-3, 2));
  PetscCall(check_flight("newmark", "dg", "corotated", 2e-3, 2));
  PetscCall(check_flight("newmark", "p2", "corotated", 2e-3, 2));
  if (test_size > 1)
    SB_TEST_END(); /* materials and short steps do not depend on ranks */
  PetscCall(check_flight("newmark", "p1", "stable_neohookean", 2e-3, 2));
  PetscCall(check_flight("genalpha", "p1", "linear", 2e-3, -1));
  PetscCall(check_flight("alpha2", "p1", "corotated", 2e-3, -1));
  PetscCall(check_flight("euler_symplectic", "p1", "stable_neohookean", 2e-4, 0));
  PetscCall(check_flight("euler_explicit", "p1", "corotated", 5e-5, 1));
  for (int e = 0; e < 3; e++) {
    static const char *const elements[] = {"cr", "dg", "p2"};
    const char *element = elements[e];

    PetscCall(check_flight("genalpha", element, "stvk", 2e-3, 2));
    PetscCall(check_flight("newmark", element, "linear", 2e-3, -1));
    PetscCall(check_flight("euler_symplectic", element, "corotated", 1e-4, 0));
    PetscCall(check_flight("euler_symplectic", element, "stable_neohookean", 1e-4, 0));
  }
  SB_TEST_END();
}
