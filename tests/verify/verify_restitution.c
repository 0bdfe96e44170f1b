// @ranks 1 3
/*
  Restitution between bodies.

    head-on    stiff blocks and balls that meet head-on leave each other with e times their speed, whatever their masses, meshes and the
               response; momentum stays, and nothing is gained
    tower      a block that lands on a floor with another one close above it: two effects that bounce in a step
    oblique    stiff blocks that meet at an angle, with friction and without: momentum stays, no step gains energy
    soft       soft balls, whatever e: no step gains energy
    self       the arms of a soft horseshoe that meet: no step gains energy, the momentum stays
*/
#include "contact.h"

#define STIFF                                                                                    \
  "-body_a_material corotated -body_a_young 1e9 -body_a_poisson 0.3 -body_b_material corotated " \
  "-body_b_young 1e9 -body_b_poisson 0.3 "
#define TIGHT "-time euler_implicit -snes_rtol 1e-11 -ksp_rtol 1e-11 "

typedef struct {
  PetscReal v0[6], v[6];     /* velocities of the centres at the start and now, m/s */
  PetscReal momentum, scale; /* largest change of it, kg m/s; sum of mass times speed at the start */
  PetscReal gain, energy;    /* largest of a step, now, J */
  PetscReal start;           /* energy at the start, J */
  PetscReal from;            /* energies count from then on, s */
  PetscReal contacts;
  PetscReal force, net; /* largest of contact on the first body, on all bodies, N */
  PetscReal g;
} Bounce;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Bounce *b = (Bounce *)ctx;
  const SbModel m = run->model;
  PetscReal sum[6] = {0}, mass[2], energy, contacts;
  static PetscReal before[3];

  PetscFunctionBeginUser;
  PetscCall(contact_body_sums(m, step->V, PETSC_TRUE, sum));
  PetscCall(contact_body_masses(m, mass));
  for (PetscInt k = 0; k < 3 * m->nbody; k++) b->v[k] = sum[k] / mass[k / 3];
  if (!step->step) {
    PetscCall(PetscArraycpy(b->v0, b->v, 6));
    for (PetscInt k = 0; k < 3 * m->nbody; k++) b->scale += PetscAbsReal(sum[k]);
    b->start = step->energies.kinetic + step->energies.strain;
  }
  if (step->t > b->from) {
    for (int k = 0; k < 3; k++)
      b->momentum = PetscMax(b->momentum, PetscAbsReal(step->energies.momentum[k] - before[k]));
  }
  for (int k = 0; k < 3; k++) before[k] = step->energies.momentum[k];
  energy = step->energies.kinetic + step->energies.strain + m->mass * b->g * step->energies.centre[2];
  if (step->t > b->from && step->step) b->gain = PetscMax(b->gain, energy - b->energy);
  b->energy = energy;
  PetscCall(contact_column(run, step->t, "meet", "contacts", &contacts));
  b->contacts = PetscMax(b->contacts, contacts);
  PetscCall(contact_body_forces(run, step->t, sum));
  for (int k = 0; k < 3; k++) {
    b->force = PetscMax(b->force, PetscAbsReal(sum[k]));
    if (m->nbody > 1) sum[k] += sum[3 + k];
    b->net = PetscMax(b->net, PetscAbsReal(sum[k]));
  }
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
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, b, NULL));
  PetscCall(verify_solve(&t, what));
  PetscCall(test_scene_close(&t));
  SB_CHECK(b->contacts > 0, "%s: nothing meets", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ head-on */

static PetscErrorCode check_pair(const char *what, const char *bodies, const char *more, PetscReal e)
{
  Bounce b = {0};
  PetscReal ratio;

  PetscFunctionBeginUser;
  PetscCall(bounce(what, &b,
                   "-bodies a,b %s " STIFF TIGHT
                   "-effects meet -effect_meet_type collision -effect_meet_restitution %g -ts_dt 0.01 "
                   "-ts_max_time 0.04 %s",
                   bodies, (double)e, more));
  ratio = (b.v[3] - b.v[0]) / (b.v0[0] - b.v0[3]);
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  %s: e = %g: leave with %.5f of the relative speed, velocities %.4f and %.4f, momentum %.1e of %.2g, "
    "gain %.1e of %.3g J\n",
    what, (double)e, (double)ratio, (double)b.v[0], (double)b.v[3], (double)b.momentum, (double)b.scale,
    (double)b.gain, (double)b.start));
  SB_CHECK_NEAR(ratio, e, 0.01, what);
  SB_CHECK(b.net < 1e-13 * b.force, "%s: the forces of contact are %g N in all, of %g", what, (double)b.net,
           (double)b.force);
  /* stiff bodies: 1e-11 of the forces is what solves aim at */
  SB_CHECK(b.momentum < 2e-10 * b.scale, "%s: momentum changes by %g", what, (double)b.momentum);
  SB_CHECK(b.gain < 1e-9 * b.start, "%s: a step gains %g J", what, (double)b.gain);
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BLOCKS(n, density)                                                                   \
  "-body_a_mesh box:0.1,0.1,0.1:2 -body_a_density 1000 -body_a_velocity 1,0,0 -body_b_mesh " \
  "box:0.1,0.1,0.1:" #n " -body_b_density " #density                                         \
  " -body_b_translate 0.1207,0,0 -body_b_velocity -1,0,0 "

/* A vertex of the first meets the middle of a flat piece of the second. */
static PetscErrorCode check_balls(PetscReal e)
{
  const PetscInt n[2][3] = {{4, 4, 4}, {3, 3, 3}};
  ContactBall ball = {.radius = 0.05};
  char path[2][512], bodies[VERIFY_TEXT];

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) PetscCall(verify_mesh_write(n[k], contact_ball, &ball, path[k]));
  PetscCall(PetscSNPrintf(bodies, sizeof(bodies),
                          "-body_a_mesh %s -body_a_density 1000 -body_a_velocity 1,0,0 -body_b_mesh %s "
                          "-body_b_density 2000 -body_b_translate 0.1207,0,0 -body_b_velocity -1,0,0",
                          path[0], path[1]));
  PetscCall(check_pair("balls", bodies, "", e));
  for (int k = 0; k < 2; k++) PetscCall(test_file_remove(path[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the others */

static PetscErrorCode check_tower(void)
{
  Bounce b = {.g = 9.81};

  PetscFunctionBeginUser;
  PetscCall(
    bounce("tower", &b,
           "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_a_density 1000 -body_a_translate 0,0,0.0021 "
           "-body_a_velocity 0,0,-1 -body_b_mesh box:0.08,0.08,0.08:2 -body_b_density 1000 -body_b_translate "
           "0.01,0.01,0.1024 -body_b_velocity 0,0,-1 " STIFF TIGHT
           "-effects gravity,floor,meet -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 "
           "-effect_floor_restitution 1 -effect_meet_type collision -effect_meet_restitution 1 "
           "-ts_dt 0.001 -ts_max_time 0.03"));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  tower: velocities %.4f and %.4f, gain %.1e of %.3g J\n",
                        (double)b.v[2], (double)b.v[5], (double)b.gain, (double)b.start));
  SB_CHECK(b.v[5] > 0.5, "the upper block leaves with %g m/s", (double)b.v[5]);
  SB_CHECK(b.gain < 1e-9 * b.start, "tower: a step gains %g J", (double)b.gain);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_oblique(const char *response, PetscReal friction, PetscReal e)
{
  Bounce b = {0};

  PetscFunctionBeginUser;
  PetscCall(
    bounce("oblique", &b,
           "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.08,0.1:3 -body_b_translate "
           "0.11,0.03,0.02 -body_b_rotate 1,2,3,20 -body_a_density 1000 -body_b_density 1000 "
           "-body_a_velocity 0.8,0,0 -body_b_velocity -1,0.2,0 " STIFF TIGHT
           "-effects meet -effect_meet_type collision -effect_meet_response %s -effect_meet_friction %g "
           "-effect_meet_restitution %g -ts_dt 0.001 -ts_max_time 0.05",
           response, (double)friction, (double)e));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  oblique, %s, friction %g, e = %g: velocities %.3f and %.3f, momentum %.1e of %.2g, "
                "gain %.1e, %.3g of %.3g J left\n",
                response, (double)friction, (double)e, (double)b.v[0], (double)b.v[3], (double)b.momentum,
                (double)b.scale, (double)b.gain, (double)b.energy, (double)b.start));
  SB_CHECK(b.v[3] > b.v[0], "the blocks stay together");
  SB_CHECK(b.net < 1e-13 * b.force, "the forces of contact are %g N in all, of %g", (double)b.net,
           (double)b.force);
  SB_CHECK(b.momentum < 1e-10 * b.scale, "oblique: momentum changes by %g", (double)b.momentum);
  SB_CHECK(b.gain < 1e-6 * b.start, "oblique: a step gains %g J", (double)b.gain);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_soft(PetscReal young, PetscReal dt, PetscReal e)
{
  const PetscInt n[3] = {4, 4, 4};
  ContactBall ball = {.radius = 0.05};
  Bounce b = {0};
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, contact_ball, &ball, path));
  PetscCall(
    bounce("soft", &b,
           "-bodies a,b -body_a_mesh %s -body_a_density 1000 -body_a_velocity 0.5,0,0 "
           "-body_a_angular_velocity 3,5,7 "
           "-body_b_mesh %s "
           "-body_b_density 2000 -body_b_translate 0.11,0.02,0 -body_b_velocity -0.5,0,0 -body_a_material "
           "corotated -body_a_young %g -body_a_poisson 0.3 -body_b_material corotated -body_b_young %g "
           "-body_b_poisson 0.3 -effects meet -effect_meet_type collision -effect_meet_restitution %g "
           "-time euler_implicit -ts_dt %g -ts_max_time 0.1 -snes_rtol 1e-8",
           path, path, (double)young, (double)(2 * young), (double)e, (double)dt));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  soft, E = %g, dt = %g, e = %g: velocities %.3f and %.3f, largest gain of a step %.1e of %.2g J\n",
    (double)young, (double)dt, (double)e, (double)b.v[0], (double)b.v[3], (double)b.gain, (double)b.start));
  /* the energy of co-rotated tets that turn is not quite convex: also where nothing touches */
  SB_CHECK(b.momentum < 1e-8 * b.scale, "soft: momentum changes by %g", (double)b.momentum);
  SB_CHECK(b.gain < 1e-5 * b.start, "a step gains %g J", (double)b.gain);
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A ring with a gap of a twentieth of its way round. */
static void horseshoe(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  const PetscReal angle = (0.02 + 0.96 * x[0]) * 2 * PETSC_PI, r = 0.09 - 0.03 * x[1];

  (void)n;
  (void)at;
  (void)ctx;
  x[0] = r * PetscCosReal(angle);
  x[1] = r * PetscSinReal(angle);
  x[2] *= 0.03;
}

static PetscErrorCode check_self(PetscReal e)
{
  const PetscInt n[3] = {24, 2, 2};
  Bounce b = {.from = 0.05};
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, horseshoe, NULL, path));
  PetscCall(
    bounce("self", &b,
           "-bodies a -body_a_mesh %s -body_a_density 1000 -body_a_material linear -body_a_young 1e5 "
           "-body_a_poisson 0.3 -effects close,meet -effect_close_type body_force -effect_close_density "
           "0;-4e4*y*step(0.0499-t);0 -effect_meet_type collision -effect_meet_self yes "
           "-effect_meet_restitution %g -time euler_implicit -ts_dt 0.001 -ts_max_time 0.2 -snes_rtol 1e-8",
           path, (double)e));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  self, e = %g: gain %.1e of %.2g J, momentum %.1e\n", (double)e,
                        (double)b.gain, (double)b.energy, (double)b.momentum));
  SB_CHECK(b.gain < 1e-9 * b.energy, "a step gains %g J", (double)b.gain);
  SB_CHECK(b.momentum < 1e-12, "momentum changes by %g", (double)b.momentum);
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_pair("blocks", BLOCKS(3, 1000), "", 0.6));
  PetscCall(check_pair("blocks, multiplier", BLOCKS(3, 5000), "-effect_meet_response multiplier", 0.6));
  PetscCall(check_pair("blocks, one side", BLOCKS(2, 5000), "-effect_meet_passes one", 1));
  PetscCall(check_pair("blocks, CR", BLOCKS(2, 3000), "-body_a_element cr -body_b_element cr", 0.3));
  PetscCall(check_balls(0.6));
  PetscCall(check_tower());
  PetscCall(check_oblique("projected", 0, 1));
  PetscCall(check_oblique("projected", 0.3, 0.7));
  if (size > 1) SB_TEST_END(); /* many solves of small systems: on one rank only */
  PetscCall(check_oblique("multiplier", 0.3, 0.7));
  PetscCall(check_soft(1e5, 0.001, 1));
  PetscCall(check_soft(1e6, 0.001, 0.5));
  PetscCall(check_soft(1e7, 0.001, 1));
  PetscCall(check_soft(1e4, 0.005, 1));
  PetscCall(check_self(1));
  SB_TEST_END();
}
