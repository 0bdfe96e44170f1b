// @ranks 1 2
/*
  Snap-through of Williams' toggle ("An approach to the non-linear behaviour of the members of a
  rigid jointed plane framework with finite deflections", Q. J. Mech. Appl. Math. 17, 1964): two
  straight members of span l = 12.943 in each, clamped at the far ends and rigidly connected in the
  middle, at a height of H = 0.386 in; section 0.753 in x 0.243 in, E = 1.03e7 lb/in^2. The load in
  the middle has a maximum, decreases, and increases again. The published maximum by Williams'
  theory is 34.0392 lb. Here one half is a solid, with Poisson's ratio 0 as for beams.

  With the compression N = k^2 E I, slope a = H/l and the deflection delta of the middle, a shallow
  beam has

    P = 2 N (a + B),   B = -delta / (l - 2/k tan(k l/2)),   N l / E A = a delta - 1/2 int w'^2 dx,
    w' = B (1 - cos k x - tan(k l/2) sin k x),

  from which N follows for each delta. Neglected are terms of a^2, the shear of the members and
  finite strains: about 0.1 % each.
*/
#include "verify.h"

#define SPAN 12.943
#define RISE 0.386
#define DEPTH 0.243
#define WIDTH 0.753
#define YOUNG 1.03e7
#define LIMIT 34.0392 /* published largest load, lb */

/* Difference between the required shortening of a member and its shortening under the compression
   N, and the load, lb. */
static PetscReal excess(PetscReal N, PetscReal delta, PetscReal *P)
{
  const PetscReal EI = YOUNG * WIDTH * DEPTH * DEPTH * DEPTH / 12.;
  const PetscReal EA = YOUNG * WIDTH * DEPTH;
  const PetscReal l = SPAN;
  const PetscReal a = RISE / l;
  const PetscReal k = PetscSqrtReal(N / EI);
  const PetscReal q = k * l;
  const PetscReal t = PetscTanReal(q / 2.);
  const PetscReal s = PetscSinReal(q);
  const PetscReal c = PetscCosReal(q);
  const PetscReal B = -delta / (l - 2. * t / k);
  const PetscReal square = l + t * t * (l / 2. - s * c / (2. * k)) + (l / 2. + s * c / (2. * k)) -
                           2. * t * (1. - c) / k - 2. * s / k + t * s * s / k;

  *P = 2. * N * (a + B);
  return a * delta - 0.5 * B * B * square - N * l / EA;
}

static PetscReal toggle_load(PetscReal delta)
{
  PetscReal low = 1e-3, high = 2000., P = 0.; /* k l < pi */

  for (int i = 0; i < 100; i++) {
    const PetscReal N = 0.5 * (low + high);

    if (excess(N, delta, &P) > 0.)
      low = N;
    else
      high = N;
  }
  return P;
}

static void member(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal depth =
    DEPTH * PetscSqrtReal(1. + PetscSqr(RISE / SPAN)); /* of a vertical section */

  x[1] = RISE * x[0] + depth * (x[1] - 0.5);
  x[0] *= SPAN;
  x[2] *= SPAN / (PetscReal)place->n[0];
}

typedef struct {
  PetscReal full;    /* load at the factor 1, lb */
  PetscReal error;   /* largest difference of loads, lb */
  PetscReal top;     /* largest load before it falls, lb */
  PetscReal bottom;  /* smallest one behind that, lb */
  PetscReal last[2]; /* delta, in, and load, lb */
  PetscReal end[3];  /* reference position of the centre */
} Toggle;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Toggle *g = (Toggle *)ctx;
  PetscReal u[3], P, expected;

  PetscFunctionBeginUser;
  PetscCall(test_value_at(run->model, step->U, g->end, u));
  P = step->t * g->full;
  expected = step->step ? toggle_load(-u[1]) : 0.;
  g->error = PetscMax(g->error, PetscAbsReal(P - expected));
  if (g->bottom == PETSC_MAX_REAL)
    g->top = PetscMax(g->top, P);
  if (P < g->top)
    g->bottom = PetscMin(g->bottom, P);
  g->last[0] = -u[1];
  g->last[1] = P;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_toggle(const char *element, PetscInt nx, PetscInt ny, PetscReal *error,
                                   PetscReal *top)
{
  const PetscInt n[3] = {nx, ny, 1};
  char mesh[512];
  TestScene t;
  Toggle g = {.full = 50., .bottom = PETSC_MAX_REAL, .end = {SPAN, RISE, 0.}};

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, member, NULL, mesh));
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material stvk -body_a_young %.17g "
    "-body_a_poisson 0 -body_a_density 1 -sets far,middle -set_far_at plane:1,0,0,0 "
    "-set_middle_at plane:1,0,0,%.17g -effects clamp,symmetry,plane,load -effect_clamp_type fixed "
    "-effect_clamp_on far -effect_symmetry_type fixed -effect_symmetry_on middle "
    "-effect_symmetry_components x -effect_plane_type fixed -effect_plane_on all "
    "-effect_plane_components z "
    "-effect_load_type traction -effect_load_on middle -effect_load_total 0,%.17g,0 -time static "
    "-static_control arc_length -static_steps 5 -static_longest_step 1",
    mesh, element, YOUNG, SPAN, -0.5 * g.full * SPAN / (double)nx / WIDTH));
  PetscCall(SbRunAddMonitor(t.run, watch, &g));
  PetscCall(verify_solve(&t, "toggle"));
  test_print("  %s, %d x %d cells: %d steps, %d rejected, %d Newton iterations; load %.4f lb, then "
             "%.4f lb, %.1f lb at %.4f in; error %.3f lb\n",
             element, (int)nx, (int)ny, (int)t.run->counters.steps, (int)t.run->counters.rejected,
             (int)t.run->counters.newton, g.top, g.bottom, g.last[1], g.last[0], g.error);
  SB_CHECK(g.last[1] == g.full, "the load ended at %g lb", g.last[1]);
  SB_CHECK(g.bottom < g.top - 1., "the load fell from %g to %g lb", g.top, g.bottom);
  SB_CHECK(t.run->counters.bifurcations == 0, "bifurcation");
  *error = g.error / g.full;
  *top = g.top;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal error[2], top[2], limit;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_toggle("cr", 108, 2, &error[0], &top[0]));
  PetscCall(check_toggle("cr", 216, 4, &error[1], &top[1]));
  limit = verify_extrapolate(top[0], top[1], 2.);
  test_print("  limit load: extrapolated %.3f lb, published %g lb\n", limit, LIMIT);
  SB_CHECK(error[1] < 0.03, "%g of the load off the curve", error[1]);
  SB_CHECK(error[1] < 0.4 * error[0], "%g and %g of the load off the curve", error[0], error[1]);
  SB_CHECK_NEAR(limit, LIMIT, 0.01 * LIMIT, "limit load");
  PetscCall(check_toggle("p2", 54, 1, &error[0], &top[0]));
  SB_CHECK(error[0] < 0.02, "P2: %g of the load off the curve", error[0]);
  SB_CHECK_NEAR(top[0], LIMIT, 0.01 * LIMIT, "limit load, P2");
  SB_TEST_END();
}
