// @ranks 1 2
/*
  Newton's method, and the treatment of its failures.

    quadratic   quadratic convergence with the exact tangent; linear with the warped one, and the
    same
                solution; also with CR and DG
    load steps  a static solution does not depend on the number of load steps, and passes through
    those of partial loads
    long steps  implicit Euler with steps of 1 s, many periods long, converges to the static
    solution adaptive    the error of an adaptive run is proportional to its tolerance
    cuts        a step whose solve fails is halved and repeated, later steps grow again; at the
    limit the run stops with the reason
                and keeps the last valid state
    silent      a linear solver that stops at its iteration limit makes the step fail
    one solve   -snes_type ksponly solves one linear system per step
*/
#include "verify.h"

#define BAR                                                                         \
  "-bodies a -body_a_mesh box:0.4,0.1,0.1:2 -body_a_young 1e5 -body_a_poisson 0.3 " \
  "-body_a_density 1000 "
#define CLAMP "-effect_clamp_type fixed -effect_clamp_on xmin "
#define TIGHT "-snes_rtol 1e-11 -ksp_rtol 1e-12 "

static const PetscReal end[3] = {0.4, 0.05, 0.05};

/* ------------------------------------------------------------------ quadratic */

static void ripple(const PetscReal x[3], PetscReal v[3])
{
  v[0] = x[0] * PetscSinReal(20. * x[1]);
  v[1] = x[0] * PetscCosReal(15. * x[2]);
  v[2] = x[0] * PetscSinReal(9. * x[0] + 1.);
}

static PetscErrorCode check_order(const char *element, const char *law, const char *tangent,
                                  PetscReal expected, PetscReal at[3])
{
  PetscReal error[2];
  PetscReal order = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    BAR CLAMP
    "-body_a_element %s -body_a_material %s -body_a_tangent %s -effects gravity,clamp,air "
    "-effect_air_type pressure -effect_air_on boundary -effect_air_value 2000 %s -time "
    "static " TIGHT,
    element, law, tangent,
    strcmp(element, "p1") ? "-effect_air_follower false -body_a_young 1e6" : ""));
  PetscCall(verify_solve(&t, law));
  PetscCall(test_value_at(t.model, t.run->state.U, end, at));
  PetscCall(verify_newton(&t, ripple, 1e-3, error, &order));
  test_print("  %s %-10s %-9s: %2d iterations to the answer; a disturbance of 1e-3, 1e-4 becomes "
             "%.1e, %.1e: order %.2f\n",
             element, law, tangent, (int)t.run->counters.newton, error[0], error[1], order);
  SB_CHECK_NEAR(order, expected, 0.1, "order of Newton's method");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  All materials and tangents of an element. P1 on this mesh is twice too stiff; CR and DG are not,
  and get a stiffer bar. Their pressure has a fixed direction: of the tangent of a follower pressure
  on part of the surface the matrix has a part only (src/effect/pressure.c).
*/
static PetscErrorCode check_orders(const char *element)
{
  PetscReal exact[3], other[3];

  PetscFunctionBeginUser;
  PetscCall(check_order(element, "stvk", "exact", 2., exact));
  PetscCall(check_order(element, "stable_neohookean", "exact", 2., exact));
  PetscCall(check_order(element, "corotated", "exact", 2., exact));
  PetscCall(check_order(element, "corotated", "warped", 1., other));
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(other[k], exact[k], 1e-9 * PetscAbsReal(exact[2]), "answer with warped");
  PetscCall(check_order(element, "corotated", "exact_spd", 1., other));
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(other[k], exact[k], 1e-9 * PetscAbsReal(exact[2]), "answer with exact_spd");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ load steps */

typedef struct {
  PetscReal load[16], u[16][3],
    strain0; /* end of the bar at each step; strain energy at the first one */
  PetscInt n;
} Path;

static PetscErrorCode watch_path(SbRun run, const SbStep *step, void *ctx)
{
  Path *p = (Path *)ctx;

  PetscFunctionBeginUser;
  if (p->n == 16)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!p->n)
    p->strain0 = step->energies.strain;
  p->load[p->n] = step->t;
  PetscCall(test_value_at(run->model, step->U, end, p->u[p->n]));
  p->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* All constant loads are multiplied by the load factor: gravity, pressure, a displaced end. A
   stiffer bar for CR and DG, as above. */
static PetscErrorCode follow(const char *element, const char *law, int steps, PetscReal load,
                             Path *path)
{
  TestScene t;

  PetscFunctionBeginUser;
  *path = (Path){.n = 0};
  PetscCall(test_open(
    &t,
    BAR CLAMP "-body_a_element %s -body_a_material %s -effects gravity,clamp,air,push "
              "-effect_gravity_vector 0,0,%g -effect_air_type pressure -effect_air_on zmax "
              "-effect_air_value %g -effect_push_type prescribed_displacement -effect_push_on xmax "
              "-effect_push_components y -effect_push_displacement 0;%g;0 -time static "
              "-static_steps %d %s " TIGHT,
    element, law, -9.81 * (double)load, 100. * (double)load, 0.1 * (double)load, steps,
    strcmp(element, "p1") ? "-body_a_young 1e6" : ""));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_path, path));
  PetscCall(verify_solve(&t, law));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_path(const char *element, const char *law)
{
  /* a stiffer bar has larger initial residuals, to which Newton's tolerance is relative */
  const PetscReal tolerance = strcmp(element, "p1") ? 1e-8 : 1e-9;
  Path four, one, half;

  PetscFunctionBeginUser;
  PetscCall(follow(element, law, 4, 1., &four));
  PetscCall(follow(element, law, 1, 1., &one));
  PetscCall(follow(element, law, 1, 0.5, &half));
  SB_CHECK(four.n == 5 && four.load[2] == 0.5, "%s: %d states", law, (int)four.n);
  SB_CHECK(four.strain0 == 0. && four.u[0][2] == 0.,
           "%s: the path begins with a strain energy of %g J", law, four.strain0);
  test_print(
    "  %s %-10s: end of the bar, 4 load steps and 1 differ by %.1e, the halfway state by %.1e\n",
    element, law, verify_difference(3, one.u[one.n - 1], four.u[4]),
    verify_difference(3, half.u[half.n - 1], four.u[2]));
  SB_CHECK(verify_difference(3, one.u[one.n - 1], four.u[4]) < tolerance,
           "%s: one step and four differ", law);
  SB_CHECK(verify_difference(3, half.u[half.n - 1], four.u[2]) < tolerance,
           "%s: half the load and half the way differ", law);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ time-dependent runs */

typedef struct {
  PetscReal u[3], t;           /* end of the bar, time reached */
  PetscReal shortest, longest; /* steps, s */
  PetscInt steps, rejected, newton;
  char reason[512];
} Result;

static PetscErrorCode watch_step(SbRun run, const SbStep *step, void *ctx)
{
  Result *r = (Result *)ctx;

  PetscFunctionBeginUser;
  (void)run;
  r->t = step->t;
  if (step->step == 0)
    PetscFunctionReturn(PETSC_SUCCESS);
  r->shortest = PetscMin(r->shortest, step->dt);
  r->longest = PetscMax(r->longest, step->dt);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode swing(const char *options, Result *r)
{
  TestScene t;

  PetscFunctionBeginUser;
  *r = (Result){.shortest = PETSC_MAX_REAL};
  PetscCall(test_open(&t, BAR CLAMP "-effects gravity,clamp %s", options));
  PetscCall(SbRunAddMonitor(t.run, watch_step, r));
  PetscCall(SbRunSolve(t.run));
  PetscCall(test_value_at(t.model, t.run->state.U, end, r->u));
  r->steps = t.run->counters.steps;
  r->rejected = t.run->counters.rejected;
  r->newton = t.run->counters.newton;
  PetscCall(PetscStrncpy(r->reason, t.run->clock.stop_reason, sizeof(r->reason)));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sudden gravity: short steps first, longer ones later; the error decreases with the tolerance (the
   exponent depends on the order). */
static PetscErrorCode check_adaptive(const char *preset)
{
  Result fine, r;
  PetscReal error[3];
  PetscInt steps[3];
  char text[512];

  PetscFunctionBeginUser;
  PetscCall(
    swing("-body_a_material corotated -time newmark -ts_dt 0.0005 -ts_max_time 0.4 " TIGHT, &fine));
  for (int k = 0; k < 3; k++) {
    PetscCall(PetscSNPrintf(text, sizeof(text),
                            "-body_a_material corotated -time %s -ts_dt 0.01 -ts_max_time 0.4 "
                            "-ts_adapt_type basic -ts_atol %g " TIGHT,
                            preset, PetscPowRealInt(10., -4 - k)));
    PetscCall(swing(text, &r));
    SB_CHECK(!r.reason[0], "%s", r.reason);
    SB_CHECK_NEAR(r.t, 0.4, 1e-12, "end of an adaptive run");
    SB_CHECK(r.longest > 1.2 * r.shortest, "adaptive steps of %g to %g s", r.shortest, r.longest);
    error[k] = PetscAbsReal(r.u[2] - fine.u[2]);
    steps[k] = r.steps;
    PetscCall(PetscPrintf(
      PETSC_COMM_WORLD,
      "  adaptive %s, tolerance %.0e m: %3d steps of %.5f to %.5f s, %d rejected, error %.1e m\n",
      preset, PetscPowRealInt(10., -4 - k), (int)r.steps, r.shortest, r.longest, (int)r.rejected,
      error[k]));
    SB_CHECK(r.rejected < 3 + r.steps / 10, "%d of %d steps were rejected", (int)r.rejected,
             (int)r.steps);

    /* errors of the steps accumulate and keep oscillating */
    SB_CHECK(error[k] < 2. * (PetscReal)r.steps * PetscPowRealInt(10., -4 - k), "error of %g m",
             error[k]);
  }
  SB_CHECK(steps[2] > steps[1] && steps[1] > steps[0], "%d, %d, %d steps", (int)steps[0],
           (int)steps[1], (int)steps[2]);
  SB_CHECK(error[2] < 0.2 * error[0], "errors of %g and %g m", error[0], error[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Three iterations are too few for steps of 0.05 s and enough for shorter ones. */
static PetscErrorCode check_cuts(void)
{
  Result whole, cut, stopped;

  PetscFunctionBeginUser;
  PetscCall(
    swing("-body_a_material stable_neohookean -body_a_tangent exact -time newmark -ts_dt 0.0005 "
          "-ts_max_time 0.2 ",
          &whole));
  PetscCall(
    swing("-body_a_material stable_neohookean -body_a_tangent exact -time newmark -ts_dt 0.05 "
          "-ts_max_time 0.2 -snes_max_it 3 " TIGHT,
          &cut));
  test_print("  3 iterations allowed: %d steps of %.5f to %.5f s, %d attempts rejected; end %.5f "
             "m, %.5f m with short steps\n",
             (int)cut.steps, cut.shortest, cut.longest, (int)cut.rejected, cut.u[2], whole.u[2]);
  SB_CHECK(!cut.reason[0], "%s", cut.reason);
  SB_CHECK(cut.rejected > 0 && cut.shortest < 0.05, "no step was cut");
  SB_CHECK(cut.longest > 1.9 * cut.shortest, "steps do not grow again");
  SB_CHECK_NEAR(cut.t, 0.2, 1e-12, "end of a run with cut steps");
  SB_CHECK_NEAR(cut.u[2], whole.u[2], 0.03 * PetscAbsReal(whole.u[2]), "end of the bar");
  PetscCall(
    swing("-body_a_material stable_neohookean -body_a_tangent exact -time newmark -ts_dt 0.05 "
          "-ts_max_time 0.2 -snes_max_it 1 -time_max_halvings 2 " TIGHT,
          &stopped));
  test_print("  1 iteration, 2 cuts allowed: stops at %g s: %s\n", stopped.t, stopped.reason);
  SB_CHECK(stopped.reason[0] && stopped.t < 0.2 && stopped.rejected == 3,
           "the run went on to %g s after %d rejections: %s", stopped.t, (int)stopped.rejected,
           stopped.reason);
  SB_CHECK(stopped.t > 0. || (stopped.u[0] == 0. && stopped.u[1] == 0. && stopped.u[2] == 0.),
           "the state at the stop is not the last good one");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_silent(const char *options)
{
  Result r;

  PetscFunctionBeginUser;
  PetscCall(swing(options, &r));
  test_print("  one linear iteration: %s\n", r.reason);
  SB_CHECK(r.reason[0] && !r.steps, "%s: %d steps passed", options, (int)r.steps);
  SB_CHECK(strstr(r.reason, "linear solver") != NULL,
           "the reason does not name the linear solver: %s", r.reason);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Result settled, rest, one, full;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_orders("p1"));
  PetscCall(check_orders("cr"));
  PetscCall(check_orders("dg"));
  PetscCall(check_orders("p2"));
  PetscCall(check_path("p1", "linear"));
  PetscCall(check_path("p1", "corotated"));
  PetscCall(check_path("p1", "stvk"));
  PetscCall(check_path("p1", "stable_neohookean"));
  PetscCall(check_path("cr", "corotated"));
  PetscCall(check_path("dg", "stable_neohookean"));
  PetscCall(check_path("p2", "stable_neohookean"));
  PetscCall(swing("-body_a_material corotated -time static " TIGHT, &rest));
  PetscCall(swing("-body_a_material corotated -time euler_implicit -ts_dt 1 -ts_max_time 30 " TIGHT,
                  &settled));
  test_print("  %d steps of 1 s end %.1e from the static answer\n", (int)settled.steps,
             verify_difference(3, rest.u, settled.u));
  SB_CHECK(!settled.reason[0] && !rest.reason[0], "%s%s", settled.reason, rest.reason);
  SB_CHECK(verify_difference(3, rest.u, settled.u) < 1e-6, "long steps end at %g", settled.u[2]);
  PetscCall(check_adaptive("newmark"));
  PetscCall(check_adaptive("euler_implicit"));
  PetscCall(check_cuts());
  PetscCall(check_silent(
    "-body_a_material linear -time static -solver cg_jacobi -ksp_type cg -ksp_max_it 1"));
  PetscCall(check_silent(
    "-body_a_material corotated -time static -solver cg_jacobi -ksp_type cg -ksp_max_it 1"));
  PetscCall(check_silent(
    "-body_a_material linear -time newmark -ts_dt 0.1 -ts_max_time 1 -solver cg_jacobi "
    "-ksp_type cg -ksp_max_it 1"));
  PetscCall(
    check_silent("-body_a_material corotated -time euler_implicit -ts_dt 0.1 -ts_max_time 1 "
                 "-snes_type ksponly -solver cg_jacobi -ksp_type cg -ksp_max_it 1"));
  PetscCall(swing("-body_a_material corotated -time euler_implicit -ts_dt 0.01 -ts_max_time 0.3 "
                  "-snes_type ksponly",
                  &one));
  PetscCall(
    swing("-body_a_material corotated -time euler_implicit -ts_dt 0.01 -ts_max_time 0.3", &full));
  test_print("  ksponly: %d solves in %d steps, Newton %d; end %.5f and %.5f m\n", (int)one.newton,
             (int)one.steps, (int)full.newton, one.u[2], full.u[2]);
  SB_CHECK(one.newton == 30 && one.steps == 30 && !one.reason[0], "%d solves in %d steps",
           (int)one.newton, (int)one.steps);
  SB_CHECK(full.newton > 30, "Newton took %d iterations", (int)full.newton);
  SB_CHECK_NEAR(one.u[2], full.u[2], 0.05 * PetscAbsReal(full.u[2]),
                "end of the bar with one solve per step");
  SB_TEST_END();
}
