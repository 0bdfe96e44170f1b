// @ranks 1 2
/*
  Newmark with contact (src/time/newmark_contact.c).

    wall      an elastic bar flies onto a wall: duration and speed after against the wave solution and implicit Euler; no step gains energy
    bars      two bars collide: they exchange their velocities but for what the ends' own mass takes; momentum
    ball      a soft ball that falls on a plane again and again: no step gains energy, forces explain the momentum
    rest      a block that lies on a plane, and one on another: forces are the weights, and steady
    push      a plane that speeds up takes a block along
    absent    what touches nothing moves as without contact
*/
#include "contact.h"

#define SPEED 0.1 /* m/s; bars are 1 m long, waves run at 10 m/s */

/* ------------------------------------------------------------------ bars */

typedef struct {
  PetscReal first, last, before;           /* of contact, s */
  PetscReal velocity[2];                   /* m/s */
  PetscReal gain, energy, momentum, start; /* J, J, kg m/s */
  const char *name, *column;
  PetscReal force; /* largest, N */
} Flight;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Flight *b = (Flight *)ctx;
  const SbModel m = run->model;
  const PetscReal energy = step->energies.kinetic + step->energies.strain;
  PetscReal sum[6] = {0}, mass[2], force;

  PetscFunctionBeginUser;
  PetscCall(contact_body_sums(m, step->V, PETSC_TRUE, sum));
  PetscCall(contact_body_masses(m, mass));
  for (PetscInt k = 0; k < m->nbody; k++) b->velocity[k] = sum[3 * k] / mass[k];
  PetscCall(contact_column(run, step->t, b->name, b->column, &force));
  if (force > 1e-3 * 2.5) {
    if (b->first == 0) b->first = b->before;
    b->last = step->t;
  }
  b->force = PetscMax(b->force, force);
  if (step->step)
    b->gain = PetscMax(b->gain, energy - b->energy);
  else
    b->start = step->energies.momentum[0];
  b->momentum = PetscMax(b->momentum, PetscAbsReal(step->energies.momentum[0] - b->start));
  b->energy = energy;
  b->before = step->t;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fly(Flight *b, const char *format, ...)
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
  PetscCall(verify_solve(&t, "flight"));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define ENERGY (0.5 * 2.5 * SPEED * SPEED) /* J, of a bar */
#define BAR(b)                                                                                         \
  " -body_" #b "_mesh box:1,0.05,0.05:1 -body_" #b "_material linear -body_" #b "_young 1e5 -body_" #b \
  "_poisson 0 -body_" #b "_density 1000 "
#define EXACT " -ksp_rtol 1e-11 -snes_rtol 1e-11 "

/* What is left of speed and energy. */
static PetscErrorCode check_wall(const char *time, const char *more, PetscReal dt, PetscReal left[2])
{
  Flight b = {.name = "wall", .column = "force_x"};

  PetscFunctionBeginUser;
  PetscCall(
    fly(&b,
        "-bodies a" BAR(a) "-body_a_velocity %g,0,0 -body_a_translate %.15g,0,0 -effects wall "
                           "-effect_wall_type contact -effect_wall_on xmin "
                           "-effect_wall_obstacle plane:1,0,0,0 -time %s -ts_dt %g -ts_max_time %g %s" EXACT,
        (double)-SPEED, (double)(SPEED * 10.3 * dt), time, (double)dt, (double)(0.24 + 12 * dt), more));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  wall, %s, dt = %g%s: touches for %.4f s (0.2), leaves with %.4f of the speed and "
                        "%.4f of the energy, largest force %.3f N, gain %.1e J\n",
                        time, (double)dt, more, (double)(b.last - b.first), (double)(b.velocity[0] / SPEED),
                        (double)(b.energy / ENERGY), (double)b.force, (double)b.gain));
  SB_CHECK(b.gain < 1e-12, "wall, %s: a step gains %g J", time, (double)b.gain);
  SB_CHECK_NEAR(b.last - b.first, 0.2, 0.02, "time at the wall");
  left[0] = b.velocity[0] / SPEED;
  left[1] = b.energy / ENERGY;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_walls(void)
{
  PetscReal euler[2], left[2], other[2];

  PetscFunctionBeginUser;
  PetscCall(check_wall("euler_implicit", "", 0.0005, euler));
  PetscCall(check_wall("newmark", "", 0.0005, left));
  /* the node at the end of 20 cells has 1/40 of the mass */
  SB_CHECK(1 - left[1] < 0.4 * (1 - euler[1]), "%g of the energy is left, with implicit Euler %g",
           (double)left[1], (double)euler[1]);
  SB_CHECK(left[0] > euler[0] + 0.02, "%g of the speed is left, with implicit Euler %g", (double)left[0],
           (double)euler[0]);
  PetscCall(check_wall("newmark", " -effect_wall_time_of_impact yes", 0.0005, other));
  SB_CHECK_NEAR(other[1], left[1], 0.01, "energy with steps cut at the arrival");
  PetscCall(check_wall("newmark", "", 0.002, left));
  PetscCall(check_wall("newmark", " -effect_wall_response multiplier", 0.002, other));
  for (int k = 0; k < 2; k++) SB_CHECK_NEAR(other[k], left[k], 1e-6, "with multipliers");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What is left of the difference of velocities, and of the energy. */
static PetscErrorCode collide(const char *time, const char *more, PetscReal left[2], PetscReal *gain)
{
  Flight b = {.name = "meet", .column = "normal_force"};

  PetscFunctionBeginUser;
  PetscCall(fly(
    &b,
    "-bodies a,b" BAR(a)
      BAR(b) "-body_a_velocity %g,0,0 -body_b_velocity %g,0,0 -body_b_translate 1.002,0,0 "
             "-effects meet -effect_meet_type collision -time %s -ts_dt 0.0005 -ts_max_time 0.25 %s" EXACT,
    (double)SPEED, (double)-SPEED, time, more));
  left[0] = (b.velocity[1] - b.velocity[0]) / (2 * SPEED);
  left[1] = b.energy / (2 * ENERGY);
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  bars, %s%s: touch from %.4f to %.4f s (0.01 to 0.21), exchange %.4f of their velocities, keep %.4f "
    "of the energy, momentum %.1e, gain %.1e J\n",
    time, more, (double)b.first, (double)b.last, (double)left[0], (double)left[1], (double)b.momentum,
    (double)b.gain));
  SB_CHECK_NEAR(b.first, 0.01, 0.002, "first touch");
  SB_CHECK_NEAR(b.last - b.first, 0.2, 0.01, "time of contact");
  /* how exactly gaps are closed, 1e-7 of the size, times the force of the wave solution */
  SB_CHECK(b.gain < 2e-7 * 2.5, "bars, %s%s: a step gains %g J", time, more, (double)b.gain);
  *gain = b.gain;
  SB_CHECK(b.momentum < 1e-10 * 2.5 * SPEED, "momentum changes by %g", (double)b.momentum);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_bars(void)
{
  PetscReal euler[2], left[2], gain;

  PetscFunctionBeginUser;
  PetscCall(collide("euler_implicit", "", euler, &gain));
  PetscCall(collide("newmark", "", left, &gain));
  SB_CHECK(gain < 1e-12, "a step gains %g J", (double)gain);
  SB_CHECK(1 - left[1] < 0.4 * (1 - euler[1]), "%g of the energy is left, with implicit Euler %g",
           (double)left[1], (double)euler[1]);
  SB_CHECK(left[0] > euler[0] + 0.02, "%g of the velocities are exchanged, with implicit Euler %g",
           (double)left[0], (double)euler[0]);
  PetscCall(collide("newmark", " -effect_meet_response multiplier", left, &gain));
  SB_CHECK(left[0] > euler[0] + 0.02, "%g of the velocities are exchanged, with implicit Euler %g",
           (double)left[0], (double)euler[0]);
  PetscCall(collide("newmark", " -body_a_element cr -body_b_element cr", left, &gain));
  SB_CHECK(left[0] > euler[0] + 0.02, "%g of the velocities are exchanged, with implicit Euler %g",
           (double)left[0], (double)euler[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ ball */

static PetscErrorCode check_ball(const char *material, PetscReal tolerance)
{
  const PetscInt n[3] = {4, 4, 4};
  ContactBall ball = {.radius = 0.05};
  ContactWatch w = {.obstacle = {"floor"}, .g = 9.81};
  TestScene t;
  char path[512];

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, contact_ball, &ball, path));
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_material %s -body_a_young 5e4 -body_a_poisson 0.3 "
    "-body_a_density 1000 -body_a_translate 0,0,0.1 -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,0 -time newmark -ts_dt 0.001 -ts_max_time 0.6" EXACT,
    path, material));
  PetscCall(contact_watch_add(&t, &w));
  PetscCall(verify_solve(&t, "ball"));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  ball, %s: %d landings, energy %.4f J at first, %.4f at the end, gain of a step "
                        "%.1e, momentum off by %.1e\n",
                        material, (int)w.landings, (double)w.start, (double)w.energy, (double)w.gain,
                        (double)w.missing));
  SB_CHECK(w.landings >= 3, "%d landings", (int)w.landings);
  SB_CHECK(w.gain < tolerance * w.start, "ball, %s: a step gains %g J", material, (double)w.gain);
  SB_CHECK(w.missing < 1e-9, "momentum changes by %g without a force", (double)w.missing);
  PetscCall(test_scene_close(&t));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ rest and push */

typedef struct {
  const char *name[2], *column[2];
  PetscReal from;                   /* examined from then on, s */
  PetscReal last[2][2];             /* forces of the last two steps, N */
  PetscReal rough, low[2], high[2]; /* largest second difference; bounds, N */
  PetscInt n;
} Rest;

static PetscErrorCode watch_rest(SbRun run, const SbStep *step, void *ctx)
{
  Rest *r = (Rest *)ctx;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2 && r->name[k]; k++) {
    PetscReal force;

    PetscCall(contact_column(run, step->t, r->name[k], r->column[k], &force));
    if (step->t < r->from) continue;
    if (r->n >= 2) r->rough = PetscMax(r->rough, PetscAbsReal(force - 2 * r->last[k][1] + r->last[k][0]));
    r->last[k][0] = r->last[k][1];
    r->last[k][1] = force;
    r->low[k] = r->n ? PetscMin(r->low[k], force) : force;
    r->high[k] = r->n ? PetscMax(r->high[k], force) : force;
  }
  if (step->t >= r->from) r->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block on a floor and one on it, which settle by damping: 9.81 N each. */
static PetscErrorCode check_rest(const char *response)
{
  Rest r = {.name = {"floor", "meet"}, .column = {"force_z", "normal_force"}, .from = 0.8};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate 0,0,0.1 "
    "-body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 "
    "-body_b_material linear -body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 "
    "-effects gravity,damp,floor,meet -effect_damp_type damping -effect_damp_alpha 30 -effect_damp_beta 1e-3 "
    "-effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_response %s -effect_meet_type collision "
    "-effect_meet_response %s "
    "-time newmark -ts_dt 0.004 -ts_max_time 0.85" EXACT,
    response, response));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_rest, &r, NULL));
  PetscCall(verify_solve(&t, "rest"));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  rest, %s: floor %.6f to %.6f N (19.62), between %.6f to %.6f (9.81), from step to step %.1e N\n",
    response, (double)r.low[0], (double)r.high[0], (double)r.low[1], (double)r.high[1], (double)r.rough));
  SB_CHECK_NEAR(r.low[0], 19.62, 1e-3, "smallest force of the floor");
  SB_CHECK_NEAR(r.high[0], 19.62, 1e-3, "largest force of the floor");
  SB_CHECK_NEAR(r.low[1], 9.81, 1e-3, "smallest force between the blocks");
  SB_CHECK_NEAR(r.high[1], 9.81, 1e-3, "largest force between the blocks");
  SB_CHECK(r.rough < 1e-4, "forces change by %g N to and fro", (double)r.rough);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A block on a plane that begins to lie there without stress: it moves up and down for ever, and the force with it, smoothly. */
static PetscErrorCode check_smooth(void)
{
  Rest r = {.name = {"floor"}, .column = {"force_z"}, .from = 0.02};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t, "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material linear -body_a_young "
        "1e5 -body_a_poisson 0 -body_a_density 1000 "
        "-effects weight,floor -effect_floor_type contact -effect_floor_on zmin "
        "-effect_floor_obstacle plane:0,0,1,0 -effect_weight_type body_force "
        "-effect_weight_density 0;0;-9810*ramp(t/0.2) -time newmark -ts_dt 0.0005 -ts_max_time 0.3" EXACT));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch_rest, &r, NULL));
  PetscCall(verify_solve(&t, "smooth"));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  smooth: force up to %.4f N, from step to step %.1e N\n",
                        (double)r.high[0], (double)r.rough));
  SB_CHECK(r.high[0] > 9 && r.high[0] < 11, "force up to %g N", (double)r.high[0]);
  SB_CHECK(r.rough < 0.02, "it changes by %g N to and fro", (double)r.rough);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A floor that speeds up by 10 m/s^2 lifts a soft block: it goes along. */
static PetscErrorCode check_push(const char *response)
{
  ContactWatch w = {.obstacle = {"floor"}};
  TestScene t;
  PetscReal velocity[3];

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 "
    "-body_a_density 1000 "
    "-effects damp,floor -effect_damp_type damping -effect_damp_beta 2e-3 -effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_displacement 0;0;5*t*t -effect_floor_response %s "
    "-time newmark -ts_dt 0.001 -ts_max_time 0.2" EXACT,
    response));
  PetscCall(contact_watch_add(&t, &w));
  PetscCall(verify_solve(&t, "push"));
  PetscCall(contact_body_sums(t.model, t.run->V, PETSC_TRUE, velocity));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  push, %s: speed %.6f m/s (2), force at most %.4f N (10), momentum off by %.1e, behind %.1e m\n",
    response, (double)velocity[2], (double)w.force, (double)w.missing, (double)w.behind));
  SB_CHECK_NEAR(velocity[2], 2, 0.02, "speed of the block");
  SB_CHECK(w.missing < 1e-3, "momentum changes by %g without a force", (double)w.missing);
  SB_CHECK(w.behind == 0, "the floor goes through the block");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ absent */

#define SWING                                                                                                \
  "-bodies a,b -body_a_mesh box:0.4,0.1,0.1:2 -body_a_material corotated -body_a_young 1e5 -body_a_poisson " \
  "0.3 -body_a_density 1000 "                                                                                \
  "-body_b_mesh box:0.1,0.1,0.1:1 -body_b_translate 0,0,3 -body_b_material corotated -body_b_young 1e5 "     \
  "-body_b_poisson 0.3 -body_b_density 1000 "                                                                \
  "-time newmark -ts_dt 0.005 -ts_max_time 0.2 -solver cg_icc -effect_clamp_type fixed -effect_clamp_on "    \
  "xmin " EXACT

static PetscErrorCode check_absent(void)
{
  TestScene t, alone;
  PetscReal size, difference;

  PetscFunctionBeginUser;
  PetscCall(verify_open(&alone, SWING "-effects gravity,clamp"));
  PetscCall(verify_solve(&alone, "alone"));
  PetscCall(verify_open(
    &t, SWING "-effects gravity,clamp,meet,floor -effect_meet_type collision -effect_floor_type contact "
              "-effect_floor_obstacle plane:0,0,1,-5"));
  PetscCall(verify_solve(&t, "absent"));
  PetscCall(VecNorm(t.run->U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(t.run->U, -1., alone.run->U));
  PetscCall(VecNorm(t.run->U, NORM_INFINITY, &difference));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD, "  absent: differs by %.1e of %.2g m\n", (double)difference, (double)size));
  SB_CHECK(size > 0.01 && difference <= 1e-8 * size, "what is never touched changes the motion by %g of %g m",
           (double)difference, (double)size);
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_close(&alone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_rest("projected"));
  if (size == 1) PetscCall(check_rest("multiplier"));
  if (size == 1) PetscCall(check_push("projected"));
  PetscCall(check_push("multiplier"));
  PetscCall(check_smooth());
  PetscCall(check_absent());
  if (size > 1) SB_TEST_END(); /* many steps of small systems: on one rank only */
  PetscCall(check_ball("linear", 1e-9));
  PetscCall(check_ball("corotated", 1e-4));
  PetscCall(check_walls());
  PetscCall(check_bars());
  SB_TEST_END();
}
