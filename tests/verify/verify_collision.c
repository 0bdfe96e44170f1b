// @ranks 1 2
/*
  Contact between bodies.

    stack      a block on a block with another mesh, loaded from above: the stress is uniform where the method can give that, the
               lower block carries the load, gaps are closed
    bars       two equal bars that collide end to end: time of contact and exchange of velocities of the wave solution
    momentum   two free blocks collide obliquely, with friction: momentum and angular momentum stay, energy is never gained
    responses  the same meeting by exact constraints in both ways, multipliers raised on springs, and stiff springs
    miss       a body that touches nothing moves as if the other were not there
    slope      friction between two bodies: a block stays on one of tan 0.5 with 0.51, and slides with 0.49
*/
#include "verify.h"

enum { CONTACTS, DEEPEST, MEAN, NORMAL, FRICTION, WORK, LOSS, NVALUE };

/* History columns of the first effect of contact, on every rank. */
static PetscErrorCode collision_values(SbRun run, PetscReal values[NVALUE])
{
  SbModel m = run->model;
  SbStage stage = {.shift_k = 1};
  SbEffect e = NULL;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < m->neffect && !e; i++) e = m->effect[i]->ops.begin_step ? m->effect[i] : NULL;
  PetscCall((*e->ops.history)(e, m->space, &stage, NULL, values));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, values, NVALUE, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ stack */

#define LOAD 500.0 /* Pa */

/* Largest deviation of the stress from uniaxial pressure, as a part of it. */
static PetscErrorCode stress_error(TestScene *t, PetscReal *worst)
{
  SbSpace s = t->model->space;
  PetscReal *sigma;
  const PetscReal *u;

  PetscFunctionBeginUser;
  *worst = 0;
  PetscCall(PetscMalloc1(6 * s->mesh->ncell_owned, &sigma));
  PetscCall(SbSpaceGetLocalRead(s, t->run->U, &u));
  PetscCall(SbSpaceCellState(s, u, sigma, NULL, NULL));
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->U, &u));
  for (PetscInt c = 0; c < 6 * s->mesh->ncell_owned; c++)
    *worst = PetscMax(*worst, PetscAbsReal(sigma[c] + (c % 6 == 2 ? LOAD : 0)) / LOAD);
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, worst, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The field of contact forces: what the lower block carries the upper one with, and nothing in all. */
static PetscErrorCode check_forces(TestScene *t)
{
  const SbModel m = t->model;
  const PetscScalar *f;
  PetscReal sum[2] = {0, 0};
  Vec R, F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(t->run->U, &R));
  PetscCall(VecDuplicate(R, &F));
  PetscCall(SbModelResidual(m, 1, t->run->U, NULL, NULL, PETSC_FALSE, R));
  PetscCall(SbModelContactForce(m, 1, t->run->U, R, F));
  PetscCall(VecGetArrayRead(F, &f));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) sum[m->space->node_body[i]] += f[3 * i + 2];
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, m->comm));
  SB_CHECK_NEAR(sum[1], LOAD * 0.01, 1e-6 * LOAD * 0.01, "contact force on the upper block");
  SB_CHECK_NEAR(sum[0] + sum[1], 0, 1e-9 * LOAD * 0.01, "contact forces of both blocks");
  PetscCall(VecDestroy(&R));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_stack(const char *element, const char *response, const char *sides, int upper,
                                  PetscReal tolerance)
{
  PetscReal values[NVALUE], worst;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.1,0.1,0.05:2 -body_b_mesh box:0.1,0.1,0.05:%d -body_b_translate 0,0,0.05 "
    "-body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 -body_a_element %s "
    "-body_b_material linear -body_b_young 1e5 -body_b_poisson 0.3 -body_b_density 1000 -body_b_element %s "
    "-sets x0,y0,bottom,top -set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -set_bottom_at plane:0,0,1,0 "
    "-set_top_at plane:0,0,1,0.1 -time static -ksp_rtol 1e-12 -snes_rtol 1e-12 -effects x,y,z,load,meet "
    "-effect_x_type fixed -effect_x_on x0 -effect_x_components x -effect_y_type fixed -effect_y_on y0 "
    "-effect_y_components y -effect_z_type fixed -effect_z_on bottom -effect_z_components z "
    "-effect_load_type traction -effect_load_on top -effect_load_vector 0;0;%g -effect_meet_type collision "
    "-effect_meet_response %s -effect_meet_passes %s -effect_meet_stiffness 100",
    upper, element, element, -LOAD, response, sides));
  PetscCall(verify_solve(&t, "stack"));
  PetscCall(stress_error(&t, &worst));
  PetscCall(collision_values(t.run, values));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  stack, %s, %s, %s, %d on 2: stress %.1e of the load from uniform, force %.1e from "
                        "the load's, penetration %.1e m\n",
                        element, response, sides, upper, (double)worst,
                        (double)(values[NORMAL] / (LOAD * 0.01) - 1), (double)values[DEEPEST]));
  SB_CHECK(worst < tolerance, "%s, %s, %s, %d on 2: the stress is %g of the load from uniform", element,
           response, sides, upper, (double)worst);
  SB_CHECK_NEAR(values[NORMAL], LOAD * 0.01, 1e-6 * LOAD * 0.01, "the lower block carries the load");
  SB_CHECK_NEAR(values[DEEPEST], 0, 1e-7 * 0.2, "penetration");
  PetscCall(check_forces(&t));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bars */

#define SPEED 0.1 /* m/s, of each towards the other */

typedef struct {
  PetscReal first, last; /* times of contact, s */
  PetscReal velocity[2]; /* of the bars at the end, m/s */
  PetscReal momentum, angular, gain, energy, deepest;
} Meeting;

/* Mean velocity of the bodies along x. */
static PetscErrorCode mean_velocity(SbModel m, Vec V, PetscReal velocity[2])
{
  PetscReal sum[4] = {0};
  const PetscScalar *v;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) {
    sum[m->space->node_body[i]] += m->space->node_mass[i] * v[3 * i];
    sum[2 + m->space->node_body[i]] += m->space->node_mass[i];
  }
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, m->comm));
  velocity[0] = sum[0] / sum[2];
  velocity[1] = sum[1] / sum[3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Meeting *b = (Meeting *)ctx;
  PetscReal values[NVALUE], energy, size = 0, turn = 0;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  PetscCall(collision_values(run, values));
  PetscCall(mean_velocity(run->model, step->V, b->velocity));
  if (values[CONTACTS] > 0) {
    if (b->first == 0) b->first = step->t;
    b->last = step->t;
  }
  energy = e.kinetic + e.strain;
  if (step->step > 0) b->gain = PetscMax(b->gain, energy - b->energy);
  b->energy = energy;
  for (int k = 0; k < 3; k++) {
    size += PetscSqr(e.momentum[k]);
    turn += PetscSqr(e.angular[k]);
  }
  b->momentum = PetscMax(b->momentum, PetscSqrtReal(size));
  b->angular = PetscMax(b->angular, PetscSqrtReal(turn));
  b->deepest = PetscMax(b->deepest, values[DEEPEST]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Length 1, wave speed 10: in touch for 0.2 s from t = 0.01, then each with the other's velocity. */
static PetscErrorCode check_bars(const char *element)
{
  Meeting b = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:1,0.05,0.05:1 -body_b_mesh box:1,0.05,0.05:1 -body_b_translate 1.002,0,0 "
    "-body_a_material linear -body_a_young 1e5 -body_a_poisson 0 -body_a_density 1000 -body_a_element %s "
    "-body_b_material linear -body_b_young 1e5 -body_b_poisson 0 -body_b_density 1000 -body_b_element %s "
    "-body_a_velocity %g,0,0 -body_b_velocity %g,0,0 -effects meet -effect_meet_type collision "
    "-time euler_implicit -ts_dt 0.0005 -ts_max_time 0.25 -ksp_rtol 1e-10",
    element, element, SPEED, -SPEED));
  PetscCall(SbRunAddMonitor(t.run, watch, &b, NULL));
  PetscCall(verify_solve(&t, "bars"));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  bars, %s: in touch from %.4f to %.4f s (0.01 to 0.21), velocities %.4f and %.4f of the "
                "speed (-1, 1), momentum %.1e\n",
                element, (double)b.first, (double)b.last, (double)(b.velocity[0] / SPEED),
                (double)(b.velocity[1] / SPEED), (double)b.momentum));
  SB_CHECK_NEAR(b.first, 0.01, 0.002, "first touch");
  SB_CHECK_NEAR(b.last - b.first, 0.2, 0.01, "time of contact");
  SB_CHECK_NEAR(b.velocity[0], -SPEED, 0.1 * SPEED, "velocity of the first bar");
  SB_CHECK_NEAR(b.velocity[1], SPEED, 0.1 * SPEED, "velocity of the second bar");
  SB_CHECK(b.momentum < 1e-8 * 2.5 * SPEED, "%s: momentum %g", element, (double)b.momentum);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ momentum */

static PetscErrorCode check_momentum(const char *element, const char *response, PetscReal friction)
{
  Meeting b = {0};
  PetscReal values[NVALUE];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.08,0.1:3 -body_b_translate "
    "0.11,0.03,0.02 "
    "-body_b_rotate 1,2,3,20 -body_a_material corotated -body_a_young 2e4 -body_a_poisson 0.3 "
    "-body_a_density 1000 "
    "-body_b_material corotated -body_b_young 2e4 -body_b_poisson 0.3 -body_b_density 1000 -body_a_element "
    "%s "
    "-body_b_element %s -body_a_velocity 0.8,0,0 -body_b_velocity -1,0,0 -effects meet -effect_meet_type "
    "collision "
    "-effect_meet_response %s -effect_meet_friction %g -time euler_implicit -ts_dt 0.001 -ts_max_time 0.1 "
    "-ksp_rtol 1e-11 -snes_rtol 1e-11",
    element, element, response, (double)friction));
  PetscCall(SbRunAddMonitor(t.run, watch, &b, NULL));
  PetscCall(verify_solve(&t, "momentum"));
  PetscCall(collision_values(t.run, values));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  momentum, %s, %s, friction %g: in touch from %.3f to %.3f s, momentum %.3e, angular %.3e, "
                "gain %.1e J of %.3g, penetration %.1e m, friction took %.2g J, velocities %.3f %.3f\n",
                element, response, (double)friction, (double)b.first, (double)b.last, (double)b.momentum,
                (double)b.angular, (double)b.gain, (double)b.energy, (double)b.deepest, (double)values[LOSS],
                (double)b.velocity[0], (double)b.velocity[1]));
  SB_CHECK(b.first > 0 && b.last > b.first + 0.005, "the blocks do not meet");
  SB_CHECK(b.velocity[0] < b.velocity[1], "the blocks pass through each other");
  SB_CHECK(b.momentum < 1e-9, "momentum changed to %g", (double)b.momentum);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ responses */

/* A block pressed onto a wider one at an angle, with friction between them: force and displacement by each response. */
static PetscErrorCode press(const char *response, PetscReal stiffness, PetscReal values[NVALUE],
                            PetscReal u[3], PetscInt *solves)
{
  static const PetscReal at[3] = {0.1, 0.02, 0.1};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.2,0.1,0.05:2 -body_b_mesh box:0.08,0.06,0.05:2 -body_b_translate "
    "0.06,0.02,0.05 "
    "-body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 -body_b_material "
    "linear "
    "-body_b_young 2e5 -body_b_poisson 0.3 -body_b_density 1000 -sets bottom,top -set_bottom_at "
    "plane:0,0,1,0 "
    "-set_top_at plane:0,0,1,0.1 -time static -static_steps 4 -effects hold,push,meet -effect_hold_type "
    "fixed "
    "-effect_hold_on bottom -effect_push_type prescribed_displacement -effect_push_on top "
    "-effect_push_displacement "
    "0.0005*t;0;-0.002*t -effect_meet_type collision -effect_meet_response %s -effect_meet_stiffness %g "
    "-effect_meet_friction 0.4 -ksp_rtol 1e-10 -snes_rtol 1e-10",
    response, (double)stiffness));
  PetscCall(verify_solve(&t, "responses"));
  PetscCall(collision_values(t.run, values));
  PetscCall(test_value_at(t.model, t.run->U, at, u));
  *solves = t.run->newton_total;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_responses(void)
{
  PetscReal exact[NVALUE], values[NVALUE], u0[3], u[3];
  PetscInt solves;

  PetscFunctionBeginUser;
  PetscCall(press("projected", 20, exact, u0, &solves));
  /* friction of the same solve: what had to wait for normal forces took some hundred */
  SB_CHECK(solves > 4 && solves < 60, "%d solves for four steps with friction", (int)solves);
  PetscCall(press("multiplier", 20, values, u, &solves));
  SB_CHECK_NEAR(values[NORMAL], exact[NORMAL], 1e-5 * exact[NORMAL], "normal force with multipliers");
  SB_CHECK_NEAR(values[FRICTION], exact[FRICTION], 1e-4 * exact[NORMAL], "friction with multipliers");
  for (int k = 0; k < 3; k++) SB_CHECK_NEAR(u[k], u0[k], 1e-4 * 0.002, "displacement with multipliers");
  for (int q = 0; q < 2; q++) {
    PetscCall(press(q ? "penalty" : "augmented", q ? 1000 : 20, values, u, &solves));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "  responses, %s: normal force %.6g N (projected %.6g), friction %.4g (%.4g)\n",
                          q ? "penalty" : "augmented", (double)values[NORMAL], (double)exact[NORMAL],
                          (double)values[FRICTION], (double)exact[FRICTION]));
    SB_CHECK_NEAR(values[NORMAL], exact[NORMAL], 2e-3 * exact[NORMAL], "normal force");
    SB_CHECK_NEAR(values[FRICTION], exact[FRICTION], 0.05 * exact[FRICTION],
                  "friction"); /* elastic slip differs with the springs */
  }
  SB_CHECK(exact[NORMAL] > 1 && exact[FRICTION] > 0.05 * exact[NORMAL], "the blocks do not press");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ miss */

#define APART                                                                                            \
  "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.1,0.1:2 -body_b_translate 0.3,0,0 " \
  "-body_a_material corotated -body_a_young 2e4 -body_a_poisson 0.3 -body_a_density 1000 "               \
  "-body_a_angular_velocity "                                                                            \
  "0,3,9 "                                                                                               \
  "-body_b_material corotated -body_b_young 2e4 -body_b_poisson 0.3 -body_b_density 1000 "               \
  "-body_b_angular_velocity "                                                                            \
  "2,0,-5 "                                                                                              \
  "-time euler_implicit -ts_dt 0.005 -ts_max_time 0.1 -ksp_rtol 1e-10 -snes_rtol 1e-10 -solver cg_icc "

static PetscErrorCode check_miss(void)
{
  TestScene t, alone;
  PetscReal size, difference;

  PetscFunctionBeginUser;
  PetscCall(verify_open(&alone, APART));
  PetscCall(verify_solve(&alone, "alone"));
  PetscCall(verify_open(&t, APART "-effects meet -effect_meet_type collision"));
  PetscCall(verify_solve(&t, "miss"));
  PetscCall(VecNorm(t.run->U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(t.run->U, -1., alone.run->U));
  PetscCall(VecNorm(t.run->U, NORM_INFINITY, &difference));
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD, "  miss: differs by %.1e of %.2g m\n", (double)difference, (double)size));
  SB_CHECK(size > 0.01 && difference <= 1e-9 * size, "what is never touched changes the motion by %g of %g m",
           (double)difference, (double)size);
  PetscCall(test_scene_close(&t));
  PetscCall(test_scene_close(&alone));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ slope */

/* A stiff block on a stiff one, gravity as on a slope of tan 0.5: its speed along the slope. */
static PetscErrorCode slide(PetscReal mu, PetscReal end, PetscReal *velocity)
{
  const PetscReal g = 9.81, c = g / PetscSqrtReal(1.25);
  PetscReal both[2];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a,b -body_a_mesh box:0.3,0.1,0.05:1 -body_b_mesh box:0.06,0.06,0.03:1 -body_b_translate "
    "0.02,0.021,0.05 "
    "-body_a_material linear -body_a_young 1e7 -body_a_poisson 0.3 -body_a_density 1000 -body_b_material "
    "linear "
    "-body_b_young 1e7 -body_b_poisson 0.3 -body_b_density 1000 -sets bottom -set_bottom_at plane:0,0,1,0 "
    "-time euler_implicit -ts_dt 0.002 -ts_max_time %g -effects gravity,hold,meet -effect_gravity_vector "
    "%g,0,%g "
    "-effect_hold_type fixed -effect_hold_on bottom -effect_meet_type collision -effect_meet_friction %g",
    (double)end, (double)(0.5 * c), (double)-c, (double)mu));
  PetscCall(verify_solve(&t, "slope"));
  PetscCall(mean_velocity(t.model, t.run->V, both));
  *velocity = both[1];
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_slope(void)
{
  const PetscReal c = 9.81 / PetscSqrtReal(1.25), end = 0.2;
  PetscReal sticks, slides, fast;

  PetscFunctionBeginUser;
  PetscCall(slide(0.51, end, &sticks));
  PetscCall(slide(0.49, end, &slides));
  PetscCall(slide(0.2, end, &fast));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  slope of 0.5 after %g s: with 0.51 %.2e m/s, with 0.49 %.5f (rigid %.5f), with 0.2 %.5f (%.5f)\n",
    (double)end, (double)sticks, (double)slides, (double)(0.01 * c * end), (double)fast,
    (double)(0.3 * c * end)));
  SB_CHECK(PetscAbsReal(sticks) < 1e-4, "with 0.51 the block moves at %g m/s", (double)sticks);
  SB_CHECK_NEAR(slides, 0.01 * c * end, 0.05 * 0.01 * c * end, "speed with 0.49");
  SB_CHECK_NEAR(fast, 0.3 * c * end, 0.01 * 0.3 * c * end, "speed with 0.2");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_stack("p1", "projected", "one", 3, 0.2));
  PetscCall(check_stack("p1", "multiplier", "two", 3, 1e-6));
  PetscCall(check_stack("cr", "projected", "one", 2, 1e-6));
  PetscCall(check_bars("p1"));
  PetscCall(check_momentum("p1", "augmented", 0));
  PetscCall(check_momentum("dg", "projected", 0));
  PetscCall(check_momentum("p1", "projected", 0.3));
  PetscCall(check_miss());
  if (size > 1) SB_TEST_END(); /* many solves of a small system: on one rank only */
  PetscCall(check_stack("p1", "projected", "one", 2, 1e-6));
  PetscCall(check_stack("p1", "projected", "two", 3, 1e-6));
  PetscCall(check_stack("cr", "multiplier", "one", 2, 1e-6));
  PetscCall(check_stack("p1", "augmented", "one", 2, 1e-4));
  PetscCall(check_bars("cr"));
  PetscCall(check_momentum("p1", "projected", 0));
  PetscCall(check_momentum("p1", "multiplier", 0));
  PetscCall(check_momentum("p1", "penalty", 0));
  PetscCall(check_responses());
  PetscCall(check_slope());
  SB_TEST_END();
}
