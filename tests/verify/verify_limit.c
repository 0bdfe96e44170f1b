// @ranks 1,2
/*
  Limit loads. A cube of St. Venant-Kirchhoff material with Poisson's ratio 0, compressed along one
  axis to the stretch s, has the nominal stress P = E/2 (s^3 - s), which is largest at s = 1/sqrt 3:
  0.19245 E.

  A load path to 0.2 E ends there in few steps, reports the load reached, and that displacements
  grow without bound with the load. A path to a lower load reaches its end. With arc length control
  each equilibrium satisfies the formula, past the maximum, through s = 0, where the height is zero,
  to the inverted branch, which carries 0.2 E; with dead and follower loads, and with all elements.
  A restart continues the same path, also from the end of a load path.

  Follower pressure on part of a surface has no potential. Its load path ends at the limit too; for
  a cantilever curled up by it the number of Newton iterations is bounded, although symmetric parts
  of the tangent are indefinite on the way; likewise for a strip that it pulls by its end.
*/
#include "verify.h"

#define CUBE                                                                                    \
  "-bodies a -body_a_mesh box:1,1,1:2 -body_a_material stvk -body_a_young 1 -body_a_poisson 0 " \
  "-body_a_density 1 -effects x,y,z,press -effect_x_type fixed -effect_x_on xmin "              \
  "-effect_x_components x "                                                                     \
  "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed "         \
  "-effect_z_on zmin "                                                                          \
  "-effect_z_components z -effect_press_on zmax -time static "
#define DEAD "-effect_press_type traction -effect_press_vector 0;0;%.17g "

#define ARC "-static_control arc_length -static_longest_step 10 "
#define OUTPUT "-output_fields none -quiet -checkpoint_every_steps 1 -checkpoint_keep 100"

static const PetscReal limit = 0.19245008972987526; /* of E */

static PetscErrorCode check_end(PetscReal load, int steps, const char *more)
{
  const PetscReal reached = PetscMin(1., limit / load);
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, CUBE DEAD "-time_inverted reject -static_steps %d %s", (double)-load,
                      steps, more));
  PetscCall(SbRunSolve(t.run));
  test_print("  %g E in %d steps %s: %.9g in %d steps, softening %g\n    %s\n", load, steps, more,
             t.run->clock.t, (int)t.run->counters.steps, t.run->solve.softening,
             t.run->clock.stop_reason);
  SB_CHECK(reached == 1. || t.run->clock.t < reached + 1e-9, "load factor %g beyond the limit",
           t.run->clock.t);
  SB_CHECK_NEAR(t.run->clock.t, reached, 1e-3 / steps, "load factor reached");
  SB_CHECK(t.run->counters.steps <= steps + 60, "%d steps", (int)t.run->counters.steps);
  SB_CHECK((t.run->clock.stop_reason[0] == 0) == (reached == 1.), "%s", t.run->clock.stop_reason);
  SB_CHECK(reached == 1. || t.run->solve.softening > 30., "softening %g", t.run->solve.softening);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Path with a follower pressure: it ends at the limit, in few iterations. */
static PetscErrorCode check_follower_end(const char *element)
{
  const PetscReal load = 0.25;
  const PetscReal reached = limit / load;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      CUBE "-static_steps 5 -effect_press_type pressure -effect_press_value %g "
                           "-body_a_element %s",
                      load, element));
  PetscCall(SbRunSolve(t.run));
  test_print("  follower %g E, %s: %.9g in %d steps, %d iterations\n    %s\n", load, element,
             t.run->clock.t, (int)t.run->counters.steps, (int)t.run->counters.newton,
             t.run->clock.stop_reason);

  /* below the limit by the least increment; the iterations are bounded by twice those of the
     slowest element */
  SB_CHECK_NEAR(t.run->clock.t, reached, 1e-3, "load factor");
  SB_CHECK(t.run->solve.softening > 10., "%s: softening %g", element, t.run->solve.softening);
  SB_CHECK(t.run->counters.newton < 280, "%s: %d iterations", element, (int)t.run->counters.newton);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Cantilever that a follower pressure on its upper face curls up. */
static PetscErrorCode check_curl(const char *element, PetscReal nu, PetscReal pressure,
                                 PetscReal iterations)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:1,0.1,0.1:10,2,2 -body_a_material stable_neohookean -body_a_young "
    "1e6 -body_a_poisson %g -body_a_density 1000 -effects hold,press -effect_hold_type "
    "fixed -effect_hold_on xmin -effect_press_type pressure -effect_press_on zmax "
    "-effect_press_value %g -time static -static_steps 10 -body_a_element %s",
    nu, pressure, element));
  PetscCall(verify_solve(&t, "curl"));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD, "  curl, %s, nu %g, %g Pa: %d Newton and %d linear iterations, %d rejected\n",
    element, nu, pressure, (int)t.run->counters.newton, (int)t.run->counters.linear,
    (int)t.run->counters.rejected));

  /* the end of P1's curls by more than 90 degrees in one of the load steps, which is repeated for
     that, and for nothing else */
  SB_CHECK(t.run->clock.t == 1. && t.run->counters.rejected == t.run->counters.turned,
           "%s: load factor %g, %d rejected", element, t.run->clock.t,
           (int)t.run->counters.rejected);
  SB_CHECK(t.run->counters.newton <= iterations, "%s: %d Newton iterations", element,
           (int)t.run->counters.newton);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Clamped strip under a follower pressure that pulls its end. It stays nearly straight, and the more
  it is pulled the less stiff it is in bending: the lowest eigenvalue of the tangent decreases as
  exp(-k length), k^2 = load / (EI); that of its symmetric part is negative from the first load step
  on. Full Newton steps increase the residual, and the next ones reduce it.
*/
static PetscErrorCode check_pull(const char *element, PetscReal nu)
{
  const PetscReal energy = 1.3652e-2; /* J; 20 x 4 x 1 cells of P2, nu = 0.49 */
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.2,0.04,0.01:10,2,1 -body_a_material stable_neohookean "
              "-body_a_young 1e4 -body_a_poisson %g -body_a_density 1000 -effects hold,pull "
              "-effect_hold_type fixed -effect_hold_on xmin -effect_pull_type pressure "
              "-effect_pull_on xmax -effect_pull_value -2000*t -time static -static_steps 20 "
              "-body_a_element %s",
              nu, element));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(verify_solve(&t, "pull"));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  pull, %s, nu %g: %d Newton iterations, %d rejected, strain energy %.5e J\n", element, nu,
    (int)t.run->counters.newton, (int)t.run->counters.rejected, t.run->state.energies.strain));
  SB_CHECK(t.run->clock.t == 1. && !t.run->counters.rejected, "%s: load factor %g, %d rejected",
           element, t.run->clock.t, (int)t.run->counters.rejected);

  /* 1.5 times the measured number */
  SB_CHECK(t.run->counters.newton < 250, "%s: %d Newton iterations", element,
           (int)t.run->counters.newton);

  /* P1 is too stiff by 6 % */
  SB_CHECK_NEAR(t.run->state.energies.strain, energy, 0.08 * energy, "strain energy");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  PetscReal load;  /* load, of E */
  PetscReal error; /* largest difference from the formula, of E */
  PetscReal top;   /* largest load factor */
  PetscReal s;     /* stretch of the last step */
} Branch;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Branch *b = (Branch *)ctx;

  PetscFunctionBeginUser;
  (void)run;
  b->s = 2. * step->energies.centre[2]; /* the base stays at z = 0 */
  b->error =
    PetscMax(b->error, PetscAbsReal(step->t * b->load - 0.5 * (b->s - b->s * b->s * b->s)));
  b->top = PetscMax(b->top, step->t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Opens the cube with a load of 0.2 E. */
static PetscErrorCode open_branch(const char *dir, PetscBool follower, const char *more, Branch *b,
                                  TestScene *t)
{
  char load[128];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(load, sizeof(load),
                          follower ? "-effect_press_type pressure -effect_press_value %.17g" : DEAD,
                          follower ? 0.2 : -0.2));
  PetscCall(test_open_in(dir, t, CUBE "-static_steps 10 %s %s", load, more));
  t->run->monitors.want_energies = PETSC_TRUE;
  *b = (Branch){.load = 0.2};
  PetscCall(SbRunAddMonitor(t->run, watch, b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Solution branch: with a dead load until the inverted cube carries it, with a follower load to
   beyond the limit. */
static PetscErrorCode check_branch(PetscBool follower, const char *more)
{
  TestScene t;
  Branch b;

  PetscFunctionBeginUser;
  PetscCall(open_branch(NULL, follower, more, &b, &t));
  PetscCall(verify_solve(&t, "branch"));
  test_print("  arc length%s: %d steps, %d rejected, top %.6f, s %.9f at the end, error %.1e E\n",
             more, (int)t.run->counters.steps, (int)t.run->counters.rejected, b.top, b.s, b.error);

  /* tolerance of the residual: 1e-8 of the load */
  SB_CHECK(b.error < 1e-7 * b.load, "%s: %g E off the branch", more, b.error);
  SB_CHECK((t.run->clock.t == 1.) == !follower, "%s: the path ended at %.17g", more,
           t.run->clock.t);
  SB_CHECK(follower ? b.s < 0.55 && b.s > 0.4 : b.s < -1., "%s: stretch %g at the end", more, b.s);
  SB_CHECK(b.top <= (follower ? limit / b.load + 1e-7 : 1.), "%s: load factor %g", more, b.top);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Prescribed displacements scale with the load factor: s = 1 - lambda / 2, and Newton's method
   converges as with loads. */
static PetscErrorCode check_drive(void)
{
  TestScene t;
  Branch b = {.load = 0.};

  PetscFunctionBeginUser;
  PetscCall(test_open(&t, CUBE ARC "-static_steps 10 -effect_press_type prescribed_displacement "
                                   "-effect_press_displacement 0;0;-0.5"));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &b));
  PetscCall(verify_solve(&t, "prescribed_displacement"));
  test_print("  drive: %d steps, %d Newton iterations, s %.12f\n", (int)t.run->counters.steps,
             (int)t.run->counters.newton, b.s);
  SB_CHECK(t.run->clock.t == 1. && PetscAbsReal(b.s - 0.5) < 1e-9, "s %.12f at the load factor %g",
           b.s, t.run->clock.t);
  SB_CHECK(t.run->counters.rejected == 0 && t.run->counters.newton <= 5 * t.run->counters.steps,
           "%d Newton iterations in %d steps", (int)t.run->counters.newton,
           (int)t.run->counters.steps);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A restart from a checkpoint within a run, or at the end of a load path, continues on the same
   branch. */
static PetscErrorCode check_restart(const char *first, const char *checkpoint, PetscReal tolerance)
{
  const char *folder = getenv("TMPDIR");
  char dir[256], more[VERIFY_TEXT];
  int id = (int)getpid();
  TestScene t;
  Branch b, whole;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Bcast(&id, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCall(PetscSNPrintf(dir, sizeof(dir), "%s/limit_%d", folder ? folder : "/tmp", id));
  PetscCall(PetscSNPrintf(more, sizeof(more), "%s " OUTPUT, first));
  PetscCall(open_branch(dir, PETSC_FALSE, more, &whole, &t));
  PetscCall(SbRunSolve(t.run));
  PetscCall(test_scene_close(&t));
  PetscCall(PetscSNPrintf(more, sizeof(more),
                          ARC "-static_max_displacement 0.99 -restart %s/%s " OUTPUT, dir,
                          checkpoint));
  PetscCall(open_branch(dir, PETSC_FALSE, more, &b, &t));
  PetscCall(SbRunSolve(t.run));
  test_print("  restart of '%s' at %s: s %.12f and %.12f, error %.1e E\n", first, checkpoint,
             whole.s, b.s, b.error);
  SB_CHECK(t.run->counters.steps > 1 && b.error < 1e-8 * b.load, "%g E off the branch", b.error);
  SB_CHECK(b.s < 0.02 && b.s > -0.3, "stretch %g at the end", b.s);
  SB_CHECK(PetscAbsReal(b.s - whole.s) < tolerance, "restart: %g and %g", b.s, whole.s);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_end(0.19, 5, "-body_a_tangent exact"));

  /* Newton's method with the exact tangent can converge to the inverted cube */
  PetscCall(check_end(0.2, 10, "-body_a_tangent exact -time_inverted reject"));
  PetscCall(check_end(0.2, 10, "-body_a_tangent exact_spd"));

  /* increments as small as rounding: the limit of attempts ends the path */
  PetscCall(check_end(0.2, 10, "-body_a_tangent exact_spd -static_min_increment 1e-15"));
  PetscCall(check_follower_end("p1"));
  PetscCall(check_follower_end("p2"));
  PetscCall(check_follower_end("cr"));
  PetscCall(check_curl("p1", 0.3, 2e4, 90));
  PetscCall(check_curl("p2", 0.3, 8e3, 110));

  /* the symmetric part of the tangent is indefinite from load factors of 0.75 on */
  PetscCall(check_curl("p2", 0.4999, 1.2e3, 250));
  PetscCall(check_pull("p1", 0.4999));
  PetscCall(check_pull("cr", 0.49));
  PetscCall(check_pull("p2", 0.49));
  PetscCall(check_branch(PETSC_FALSE, ARC));
  PetscCall(check_branch(PETSC_FALSE, ARC "-body_a_mesh box:1,1,1:1"));
  PetscCall(check_branch(PETSC_FALSE, ARC "-body_a_element cr"));
  PetscCall(check_branch(PETSC_FALSE, ARC "-body_a_element dg"));
  PetscCall(check_branch(PETSC_FALSE, ARC "-body_a_element p2"));
  PetscCall(check_branch(PETSC_FALSE, ARC "-effect_press_vector 0;0;-0.2*t"));
  PetscCall(check_drive());
  PetscCall(check_branch(PETSC_TRUE, ARC "-static_max_displacement 0.45"));
  PetscCall(check_restart(ARC "-static_max_displacement 0.99", "checkpoint_000005.h5", 1e-9));
  PetscCall(check_restart("", "checkpoint_000018.h5", PETSC_MAX_REAL));
  SB_TEST_END();
}
