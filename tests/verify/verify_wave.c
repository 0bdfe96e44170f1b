// @ranks 1 2
/*
  Wave in a bar (nu = 0, one-dimensional), fixed at x = 0, with a force N suddenly applied to its
  free end. A velocity front runs to the fixed end and back, c = sqrt(E / rho), and the displacement
  of the end is a triangle wave,

    u(t) = N c t / (E A) up to 2 N L / (E A) at t = 2 L / c and back to 0 at 4 L / c.

  The middle is at rest until L / (2 c) and then moves as u = N (c t - L/2) / (E A) until the wave
  returns. Newmark, half a cell per step. The mesh smooths the corners: a front spreads over
  cells^(1/3) cells, so the largest error decreases as cells^(-2/3) only, the mean one faster.
*/
#include "verify.h"

static const PetscReal L = 1., E = 1e5, rho = 1000., N = 100. /* Pa, force over area */;

typedef struct {
  PetscReal c;           /* m/s */
  PetscReal top, top_t;  /* highest point of the end and its time, m, s */
  PetscReal error, mean; /* largest and mean error of the end over a period, of the amplitude */
  PetscReal
    middle; /* largest error of the centre until the wave returns to it, relative to the amplitude */
  PetscInt n;
} Wave;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  const PetscReal at_end[3] = {L, 0., 0.};
  const PetscReal at_middle[3] = {0.5 * L, 0., 0.};
  const PetscReal amplitude = 2. * N * L / E;
  Wave *w = (Wave *)ctx;
  PetscReal end[3], middle[3], exact;

  PetscFunctionBeginUser;
  PetscCall(test_value_at(run->model, step->U, at_end, end));
  PetscCall(test_value_at(run->model, step->U, at_middle, middle));
  exact = N / E * (step->t < 2. * L / w->c ? w->c * step->t : 4. * L - w->c * step->t);
  w->error = PetscMax(w->error, PetscAbsReal(end[0] - exact) / amplitude);
  w->mean += PetscAbsReal(end[0] - exact) / amplitude;
  w->n++;
  if (end[0] > w->top) {
    w->top = end[0];
    w->top_t = step->t;
  }
  if (step->t <= 1.5 * L / w->c) {
    exact = N / E * PetscMax(0., w->c * step->t - 0.5 * L);
    w->middle = PetscMax(w->middle, PetscAbsReal(middle[0] - exact) / amplitude);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode run_wave(const char *element, int cells, Wave *w)
{
  TestScene t;

  PetscFunctionBeginUser;
  *w = (Wave){.c = PetscSqrtReal(E / rho)};
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:1,0.02,0.02:%d,2,2 -body_a_element %s -body_a_material linear "
    "-body_a_young %g -body_a_poisson 0 -body_a_density %g -effects wall,pull -effect_wall_type "
    "fixed -effect_wall_on xmin -effect_pull_type traction -effect_pull_on xmax "
    "-effect_pull_vector %g;0;0 -time newmark -ts_dt %.17g -ts_max_time %.17g",
    cells, element, E, rho, N, 0.5 * L / (cells * w->c), 4. * L / w->c));
  PetscCall(SbRunAddMonitor(t.run, watch, w));
  PetscCall(verify_solve(&t, "wave"));
  w->mean /= (PetscReal)w->n;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  %s, %3d cells: highest point %.5f mm at %.5f s (2 mm at 0.2 s), error "
                        "of the end: mean %.4f, largest "
                        "%.4f of that; of the middle: largest %.4f\n",
                        element, cells, 1e3 * w->top, w->top_t, w->mean, w->error, w->middle));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Wave coarse, fine;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(run_wave("p1", 50, &coarse));
  PetscCall(run_wave("p1", 100, &fine));
  SB_CHECK_NEAR(fine.top, 2. * N * L / E, 0.01 * 2. * N * L / E, "highest point of the end");
  SB_CHECK_NEAR(fine.top_t, 2. * L / fine.c, 0.01 * 2. * L / fine.c, "its time");
  SB_CHECK_NEAR(coarse.error / fine.error, PetscPowReal(2., 2. / 3.), 0.15,
                "fall of the largest error");
  SB_CHECK(coarse.mean / fine.mean > PetscPowReal(2., 2. / 3.), "mean error falls by %g only",
           coarse.mean / fine.mean);
  SB_CHECK(fine.error < 0.015 && fine.mean < 0.001 && fine.middle < 0.005,
           "errors of %g, %g and %g", fine.error, fine.mean, fine.middle);

  /* a front is not smooth: on half as many cells P2 is no worse than P1, and no better */
  PetscCall(run_wave("p2", 50, &fine));
  SB_CHECK(fine.error < 1.2 * coarse.error && fine.mean < 1.2 * coarse.mean,
           "P2: errors of %g and %g", fine.error, fine.mean);
  SB_TEST_END();
}
