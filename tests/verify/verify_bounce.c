// @ranks 1 2
/*
  Restitution: what bounces off a rigid obstacle.

    ball       a stiff ball that falls on a plane rises to e^2 of its height, again and again
    block      a stiff block that lands flat, its whole base at once, leaves with e times its speed
    bat        a plane that comes with the speed w throws a ball that rests with (1 + e) w
    soft       whatever body, mesh, step and e: no step gains energy
*/
#include "verify.h"

#define RADIUS 0.05 /* m */
#define GRAVITY 9.81

/* The cube from -1 to 1, blown up to a ball. */
static void ball(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  PetscReal length = 0, most = 0;

  (void)n;
  (void)at;
  (void)ctx;
  for (int k = 0; k < 3; k++) {
    x[k] = 2 * x[k] - 1;
    length += x[k] * x[k];
    most = PetscMax(most, PetscAbsReal(x[k]));
  }
  for (int k = 0; k < 3; k++) x[k] *= length > 0 ? RADIUS * most / PetscSqrtReal(length) : 0;
}

#define BOUNCES 3
#define STEP 0.0005 /* s */

typedef struct {
  PetscReal mass, lift;        /* kg; height of the centre when it lies on the plane, m */
  PetscReal peak[BOUNCES + 1]; /* largest height above that, before and after each bounce, m */
  PetscReal before, gain, v;   /* energy of the last step; largest gain, J; speed upwards now, m/s */
  PetscInt bounces;
  PetscBool rises;
} Bounce;

static PetscErrorCode watch_bounce(SbRun run, const SbStep *step, void *ctx)
{
  Bounce *b = (Bounce *)ctx;
  SbEnergies e;
  PetscReal energy;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  if (!step->step) {
    const SbSpace s = run->model->space;
    PetscReal lowest = PETSC_MAX_REAL;

    for (PetscInt i = 0; i < s->nnode_owned; i++) lowest = PetscMin(lowest, s->node_x[3 * i + 2]);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPIU_REAL, MPI_MIN, PETSC_COMM_WORLD));
    b->mass = run->model->mass;
    b->lift = e.centre[2] - lowest;
  }
  energy = e.kinetic + e.strain + b->mass * GRAVITY * e.centre[2];
  if (step->step) b->gain = PetscMax(b->gain, energy - b->before);
  b->before = energy;
  b->v = e.momentum[2] / b->mass;
  if (b->v > 0 && !b->rises && step->step) b->bounces++;
  b->rises = (PetscBool)(b->v > 0);
  if (b->bounces <= BOUNCES) b->peak[b->bounces] = PetscMax(b->peak[b->bounces], e.centre[2] - b->lift);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode bounce(const char *what, Bounce *b, const char *format, ...)
{
  TestScene t;
  char text[VERIFY_TEXT];
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(PetscVSNPrintf(text, sizeof(text), format, NULL, args));
  va_end(args);
  PetscCall(test_scene_open(text, &t));
  PetscCall(SbRunAddMonitor(t.run, watch_bounce, b, NULL));
  PetscCall(verify_solve(&t, what));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ ball */

static PetscErrorCode check_ball(const char *element, PetscReal e)
{
  const PetscInt n[3] = {4, 4, 4};
  Bounce b = {0};
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, ball, NULL, path));
  PetscCall(
    bounce("ball", &b,
           "-bodies a -body_a_mesh %s -body_a_material corotated -body_a_young 1e11 -body_a_poisson 0.3 "
           "-body_a_density 1000 -body_a_element %s -body_a_translate 0,0,%g -effects gravity,floor "
           "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_floor_restitution %g "
           "-time euler_implicit -ts_dt %g -ts_max_time %g -snes_rtol 1e-10",
           path, element, 0.2 + RADIUS, (double)e, STEP, e > 0.6 ? 0.9 : 0.65));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  ball, %s, e = %g: largest gain of a step %.1e J\n", element,
                        (double)e, (double)b.gain));
  for (int k = 1; k <= 2; k++) {
    const PetscReal ratio = b.peak[k] / b.peak[k - 1];

    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  ball, %s, e = %g: rises to %.4f of its height, e^2 = %.4f\n",
                          element, (double)e, (double)ratio, (double)(e * e)));
    /* it hits somewhere within a step, on a way of v h; 0.002 for what it is not stiff */
    SB_CHECK_NEAR(ratio, e * e, STEP * PetscSqrtReal(2 * GRAVITY / b.peak[k - 1]) + 0.002,
                  "height after a bounce");
  }
  /* how exactly nodes are put on the obstacle, 1e-7 of the size, times the weight: where it comes to rest */
  SB_CHECK(b.gain < 1e-7 * 4 * RADIUS * b.mass * GRAVITY, "a step gains %g J", (double)b.gain);
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ block and bat */

static PetscErrorCode check_block(const char *obstacle, const char *more, PetscReal expected,
                                  const char *what)
{
  Bounce b = {0};

  PetscFunctionBeginUser;
  PetscCall(
    bounce(what, &b,
           "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_material corotated -body_a_young 1e11 "
           "-body_a_poisson 0.3 -body_a_density 1000 -effects floor -effect_floor_type contact "
           "-effect_floor_obstacle %s -effect_floor_restitution 0.6 -time euler_implicit -ts_dt 0.001 "
           "-ts_max_time 0.05 -snes_rtol 1e-10 %s",
           obstacle, more));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %s: leaves with %.4f m/s instead of %.4f\n", what, (double)b.v,
                        (double)expected));
  SB_CHECK_NEAR(b.v, expected, 2e-3 * expected, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_soft(PetscReal young, PetscReal dt, PetscReal e)
{
  const PetscInt n[3] = {4, 4, 4};
  Bounce b = {0};
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, ball, NULL, path));
  PetscCall(bounce(
    "soft", &b,
    "-bodies a -body_a_mesh %s -body_a_material corotated -body_a_young %g -body_a_poisson 0.3 "
    "-body_a_density 1000 -body_a_translate 0,0,%g -body_a_angular_velocity 3,5,7 -effects gravity,floor "
    "-effect_floor_type contact -effect_floor_obstacle plane:0,0.1,1,0 -effect_floor_restitution %g "
    "-time euler_implicit -ts_dt %g -ts_max_time 0.4 -snes_rtol 1e-8",
    path, (double)young, 0.05 + RADIUS, (double)e, (double)dt));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD, "  soft, E = %g, dt = %g, e = %g: first rise %.3f, largest gain of a step %.1e J\n",
    (double)young, (double)dt, (double)e, (double)(b.peak[1] / b.peak[0]), (double)b.gain));
  /* of 0.5 J; the energy of co-rotated tets that turn is not quite convex */
  SB_CHECK(b.gain < 1e-6, "a step gains %g J", (double)b.gain);
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_ball("p1", 0.5));
  PetscCall(check_ball("cr", 0.5));
  PetscCall(
    check_block("plane:0,0,1,0", "-body_a_translate 0,0,0.0104 -body_a_velocity 0,0,-1", 0.6, "block"));
  PetscCall(check_block(
    "plane:0,0,1,0", "-body_a_translate 0,0,0.0104 -body_a_velocity 0,0,-1 -effect_floor_response multiplier",
    0.6, "block, multiplier"));
  PetscCall(check_block("plane:0,0,1,-0.01", "-effect_floor_displacement 0;0;0.5*t", 0.8, "bat"));
  if (size == 1) {
    PetscCall(check_ball("p1", 0.8));
    PetscCall(check_soft(1e5, 0.001, 1));
    PetscCall(check_soft(1e5, 0.005, 1));
    PetscCall(check_soft(1e6, 0.001, 0.5));
    PetscCall(check_soft(1e7, 0.001, 1));
    PetscCall(check_soft(1e4, 0.002, 0.8));
  }
  SB_TEST_END();
}
