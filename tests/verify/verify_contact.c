// @ranks 1 2
/*
  Contact with rigid obstacles.

    press      a block under a load on a plane: the stress is uniform, the obstacle carries the load, its gap is closed
    fall       a block falls on a plane: no step gives energy (implicit Euler), the momentum changes by weight and contact
               force alone, and no node ends a step behind the plane
    incline    friction: 0.51 holds a block on a slope of tan = 0.5, with 0.5 it keeps its speed, with 0.49 it slides at g (sin - mu cos)
    held       a static run in which friction alone holds a block against a load along the floor
    corner     a block slides along a floor and a wall, each with friction: g - mu (N + N')
    indent     a capsule presses and drags: the four responses give the same force
    bounds     a beam that sags on a plane: PETSc's solver of variational inequalities finds the same displacement
    hertz      a rigid sphere on a half-space: force against approach
    nothing    an obstacle that is never touched changes nothing
*/
#include "verify.h"

enum { FX, FY, FZ, TX, TY, TZ, CONTACTS, PENETRATION, NVALUE };

static SbEffect find_contact(SbModel m)
{
  for (PetscInt e = 0; e < m->neffect; e++) {
    if (m->effect[e]->ops.begin_step) return m->effect[e];
  }
  return NULL;
}

/* Columns of the history of the only contact, on every rank. */
static PetscErrorCode contact_values(SbRun run, PetscReal t, PetscReal values[NVALUE])
{
  SbModel m = run->model;
  SbEffect e = find_contact(m);
  SbStage stage = {.t = t, .shift_k = 1};
  const PetscReal *r;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(run->U, &R));
  PetscCall(SbModelResidual(m, t, run->U, run->V, run->A, PETSC_FALSE, R));
  PetscCall(SbSpaceGetLocalRead(m->space, R, &r));
  PetscCall(SbSpaceGetLocalRead(m->space, run->U, &stage.u));
  PetscCall((*e->ops.history)(e, m->space, &stage, r, values));
  PetscCall(SbSpaceRestoreLocalRead(m->space, run->U, &stage.u));
  PetscCall(SbSpaceRestoreLocalRead(m->space, R, &r));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, values, NVALUE, MPIU_REAL, MPI_SUM, m->comm));
  PetscCall(VecDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ press */

#define LOAD 500.0 /* Pa */

/* A column between two planes of symmetry, loaded from above: u = -p/E (-nu x, -nu y, z), with nu = 0.3. */
static PetscErrorCode check_press(const char *element, const char *response, PetscReal stiffness,
                                  PetscReal tolerance)
{
  TestScene t;
  PetscReal values[NVALUE], worst = 0, *sigma;
  const PetscReal *u;
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.05:4 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 "
    "-body_a_density 1000 -body_a_element %s -time static -ksp_rtol 1e-12 -snes_rtol 1e-12 "
    "-effects x,y,load,floor -effect_x_type fixed -effect_x_on xmin -effect_x_components x "
    "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_load_type traction "
    "-effect_load_on zmax -effect_load_vector 0;0;%g -effect_floor_type contact -effect_floor_on zmin "
    "-effect_floor_obstacle plane:0,0,1,0.001 -effect_floor_response %s -effect_floor_stiffness %g",
    element, -LOAD, response, (double)stiffness));
  PetscCall(verify_solve(&t, "press"));
  s = t.model->space;
  PetscCall(contact_values(t.run, 1, values));
  PetscCall(PetscMalloc1(6 * s->mesh->ncell_owned, &sigma));
  PetscCall(SbSpaceGetLocalRead(s, t.run->U, &u));
  PetscCall(SbSpaceCellState(s, u, sigma, NULL, NULL));
  PetscCall(SbSpaceRestoreLocalRead(s, t.run->U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    for (int k = 0; k < 6; k++)
      worst = PetscMax(worst, PetscAbsReal(sigma[6 * c + k] + (k == 2 ? LOAD : 0)) / LOAD);
  }
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  press, %s, %s: stress %.1e of the load from uniform, force %.1e from the load's, "
                        "penetration %.1e m\n",
                        element, response, (double)worst, (double)(values[FZ] / (LOAD * 0.01) - 1),
                        (double)values[PENETRATION]));
  SB_CHECK(worst < 1e-6, "%s, %s: the stress is %g of the load from uniform", element, response,
           (double)worst);
  SB_CHECK_NEAR(values[FZ], LOAD * 0.01, 1e-6 * LOAD * 0.01, "the floor carries the load");
  SB_CHECK_NEAR(values[PENETRATION], 0, tolerance, "penetration");
  SB_CHECK(values[CONTACTS] > 20, "%g contacts", (double)values[CONTACTS]);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ fall */

typedef struct {
  PetscReal p, energy;                              /* of the last step, kg m/s and J */
  PetscReal gain, momentum, deepest, impulse, most; /* largest of the steps; impulse: their sum; SI */
} Fall;

#define FALL_MASS 1.0 /* kg */
#define FALL_G 9.81

static PetscErrorCode watch_fall(SbRun run, const SbStep *step, void *ctx)
{
  Fall *f = (Fall *)ctx;
  PetscReal values[NVALUE], energy;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  energy = e.kinetic + e.strain + FALL_MASS * FALL_G * e.centre[2];
  if (step->step > 0) {
    PetscCall(contact_values(run, step->t, values));
    f->gain = PetscMax(f->gain, energy - f->energy);
    f->momentum = PetscMax(f->momentum,
                           PetscAbsReal(e.momentum[2] - f->p - step->dt * (values[FZ] - FALL_MASS * FALL_G)));
    f->deepest = PetscMax(f->deepest, values[PENETRATION]);
    f->impulse += step->dt * values[FZ];
    f->most = PetscMax(f->most, values[FZ]);
  }
  f->p = e.momentum[2];
  f->energy = energy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_fall(const char *element, const char *response)
{
  const PetscBool exact = (PetscBool)(response[1] == 'r' || response[0] == 'm');
  Fall f;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&f, sizeof(f)));
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material corotated -body_a_young 1e4 "
    "-body_a_poisson 0.3 -body_a_density 1000 -body_a_rotate 1,2,0,20 -body_a_translate 0,0,0.05 "
    "-body_a_velocity 0,0,-0.5 -body_a_element %s -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_response %s -time euler_implicit -ts_dt 0.005 "
    "-ts_max_time 0.25 -snes_rtol 1e-11 -ksp_rtol 1e-10",
    element, response));
  PetscCall(SbRunAddMonitor(t.run, watch_fall, &f, NULL));
  PetscCall(verify_solve(&t, "fall"));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  fall, %s, %s: energy gained in a step %.1e J, momentum off by %.1e kg m/s, "
                        "penetration %.1e m, impulse %.3f N s\n",
                        element, response, (double)f.gain, (double)f.momentum, (double)f.deepest,
                        (double)f.impulse));
  /* 0.5 J of kinetic energy and weight at the start; 0.7 kg m/s on impact */
  SB_CHECK(f.gain < 1e-7, "%s: a step gains %g J", response, (double)f.gain);
  SB_CHECK(f.momentum < 1e-7, "%s: momentum %g", response, (double)f.momentum);
  SB_CHECK(f.impulse > 1 && f.most > 3 * FALL_MASS * FALL_G, "%s: it hit the floor with %g N s, %g N",
           response, (double)f.impulse, (double)f.most);
  if (exact) SB_CHECK(f.deepest < 1e-6 * 0.17, "%s: %g m deep", response, (double)f.deepest);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ incline */

typedef struct {
  PetscReal from, to, t[2], v[2], x[2]; /* velocity and place of the centre along the slope at two times */
} Slide;

static PetscErrorCode watch_slide(SbRun run, const SbStep *step, void *ctx)
{
  Slide *s = (Slide *)ctx;
  SbEnergies e;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    const PetscReal at = k ? s->to : s->from;

    /* the first step that ends there or, when some were cut, behind it */
    if (step->t < at - 1e-9 || s->t[k] > 0) continue;
    s->t[k] = step->t;
    PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
    s->v[k] = e.momentum[0] / 0.5;
    s->x[k] = e.centre[0];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_incline(const char *element, const char *response, PetscReal mu)
{
  const PetscReal normal = 9.81 * 2 / PetscSqrtReal(5), a = normal * (0.5 - mu);
  Slide s = {.from = 0.3, .to = 0.6};
  TestScene t;
  PetscReal h, distance;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.05:3 -body_a_material corotated -body_a_young 1e6 "
    "-body_a_poisson 0.3 -body_a_density 1000 -body_a_element %s -effects gravity,floor "
    "-effect_gravity_vector %.15g,0,%.15g -effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 "
    "-effect_floor_friction %g -effect_floor_response %s -time euler_implicit -ts_dt 0.01 -ts_max_time 0.6",
    element, (double)(0.5 * normal), (double)-normal, (double)mu, response));
  PetscCall(SbRunAddMonitor(t.run, watch_slide, &s, NULL));
  PetscCall(verify_solve(&t, "incline"));
  h = s.t[1] - s.t[0];
  distance = s.x[1] - s.x[0];
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  incline, %s, %s, mu = %g: in %g s it moved by %.4e m, acceleration %.5f m/s^2, %d solves\n", element,
    response, (double)mu, (double)h, (double)distance, (double)((s.v[1] - s.v[0]) / h),
    (int)t.run->newton_total));
  /* with the N of the solve before it took 540 to 910 where it slides */
  SB_CHECK(t.run->newton_total < 7 * 60, "%s, mu = %g: %d solves for 60 steps", response, (double)mu,
           (int)t.run->newton_total);
  if (mu > 0.5) {
    SB_CHECK_NEAR(distance, 0, 1e-8, "a block that sticks");
    SB_CHECK_NEAR(s.v[1], 0, 1e-7, "its velocity");
  } else {
    /* implicit Euler: x1 - x0 = v0 h + a h (h + dt) / 2 */
    SB_CHECK_NEAR((s.v[1] - s.v[0]) / h, a, 0.01 * a + 1e-6, "acceleration");
    SB_CHECK_NEAR(distance - s.v[0] * h, 0.5 * a * h * (h + 0.01), 0.01 * 0.5 * a * h * h + 1e-8, "distance");
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ held */

static PetscErrorCode check_held(const char *response)
{
  const PetscReal load = 100 * 0.1 * 0.05; /* of a weight of 4.9 N, friction could hold 1.47 N */
  PetscReal values[NVALUE];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.05:2 -body_a_material linear -body_a_young 1e5 -body_a_poisson 0.3 "
    "-body_a_density 1000 -effects gravity,side,load,floor -effect_side_type fixed -effect_side_on xmin "
    "-effect_side_components y -effect_load_type traction -effect_load_on xmax -effect_load_vector 100;0;0 "
    "-effect_floor_type contact -effect_floor_on zmin -effect_floor_obstacle plane:0,0,1,1e-5 "
    "-effect_floor_friction 0.3 -effect_floor_response %s -time static",
    response));
  PetscCall(verify_solve(&t, "held"));
  PetscCall(contact_values(t.run, 1, values));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  held, %s: friction %.6f N, %d solves\n", response,
                        (double)values[FX], (int)t.run->newton_total));
  SB_CHECK_NEAR(values[FX], -load, 1e-5 * load, "friction against the load");
  SB_CHECK_NEAR(values[FZ], 0.5 * 9.81, 1e-5 * 0.5 * 9.81, "weight");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ corner */

/* Nodes of the edge between touch both: what holds them must not take from each other's force. */
static PetscErrorCode check_corner(const char *response)
{
  const PetscReal push[3] = {-5, 6, -8}, mu = 0.3, a = push[1] + mu * (push[0] + push[2]), end = 0.3;
  PetscReal values[NVALUE];
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material corotated -body_a_young 1e5 "
    "-body_a_poisson 0.3 -body_a_density 1000 -effects gravity,floor,wall -effect_gravity_vector %g,%g,%g "
    "-effect_floor_type contact -effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction %g "
    "-effect_floor_response %s -effect_wall_type contact -effect_wall_obstacle plane:1,0,0,0 "
    "-effect_wall_friction %g -effect_wall_response %s -time euler_implicit -ts_dt 0.01 -ts_max_time %g",
    (double)push[0], (double)push[1], (double)push[2], (double)mu, response, (double)mu, response,
    (double)end));
  PetscCall(verify_solve(&t, "corner"));
  PetscCall(SbModelEnergies(t.model, t.run->U, t.run->V, &e));
  PetscCall(contact_values(t.run, end, values)); /* of the floor, which is the first one */
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD,
                "  corner, %s: velocity %.5f of %.5f m/s, floor %.5f N upwards and %.5f N back, %d solves\n",
                response, (double)e.momentum[1], (double)(a * end), (double)values[FZ], (double)values[FY],
                (int)t.run->newton_total));
  SB_CHECK_NEAR(e.momentum[1], a * end, 0.01 * a * end, "velocity along both");
  SB_CHECK_NEAR(values[FZ], -push[2], 1e-3 * -push[2], "force of the floor");
  SB_CHECK_NEAR(values[FY], mu * push[2], 2e-3 * mu * -push[2], "friction of the floor");
  SB_CHECK_NEAR(values[FX], 0, 1e-2 * mu * -push[2], "the floor's friction across the motion");
  SB_CHECK(t.run->newton_total < 15 * 30, "%s: %d solves for 30 steps", response, (int)t.run->newton_total);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ indent */

#define INDENT_STEPS 20
#define INDENT_DT 0.02 /* s */

typedef struct {
  PetscReal force[INDENT_STEPS + 1][3];
} Indent;

static PetscErrorCode watch_indent(SbRun run, const SbStep *step, void *ctx)
{
  Indent *f = (Indent *)ctx;
  PetscReal values[NVALUE];
  PetscInt at;

  PetscFunctionBeginUser;
  if (!step->step) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(contact_values(run, step->t, values));
  at = (PetscInt)PetscFloorReal(step->t / INDENT_DT + 0.5);
  if (PetscAbsReal(step->t - (PetscReal)at * INDENT_DT) > 1e-9) PetscFunctionReturn(PETSC_SUCCESS); /* cut */
  for (int k = 0; k < 3; k++) f->force[at][k] = values[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode indent(const char *response, const char *more, PetscInt most, Indent *f)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(f, sizeof(*f)));
  PetscCall(
    verify_open(&t,
                "-bodies a -body_a_mesh box:0.1,0.06,0.04:4 -body_a_material corotated -body_a_young 2e4 "
                "-body_a_poisson 0.4 -body_a_density 1000 -effects bed,tool -effect_bed_type fixed "
                "-effect_bed_on zmin -effect_tool_type contact -effect_tool_on zmax "
                "-effect_tool_obstacle capsule:0.05,0.031,0.055,0.05,0.031,0.155,0.015 "
                "-effect_tool_displacement 0.02*ramp(t/0.2-1);0;-0.01*ramp(t/0.2) -effect_tool_response %s "
                "-effect_tool_friction 0.3 "
                "-time euler_implicit -ts_dt 0.02 -ts_max_time 0.4 %s",
                response, more));
  PetscCall(SbRunAddMonitor(t.run, watch_indent, f, NULL));
  PetscCall(verify_solve(&t, response));
  /* with the N of the solve before it took 1700 to 2400 */
  SB_CHECK(t.run->newton_total < most, "%s %s: %d solves", response, more, (int)t.run->newton_total);
  PetscCall(
    PetscPrintf(PETSC_COMM_WORLD, "  indent, %s %s: %d solves\n", response, more, (int)t.run->newton_total));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void compare_indent(const Indent *a, const Indent *b, PetscReal tolerance, const char *what)
{
  const PetscReal off = verify_difference(3 * (INDENT_STEPS + 1), &a->force[0][0], &b->force[0][0]);

  (void)PetscPrintf(PETSC_COMM_WORLD, "  indent: %s and projected differ by %.2e of the largest force\n",
                    what, (double)off);
  SB_CHECK(off < tolerance, "%s and projected differ by %g", what, (double)off);
}

static PetscErrorCode check_indent(void)
{
  Indent a, b;

  PetscFunctionBeginUser;
  PetscCall(indent("projected", "", 900, &a));
  SB_CHECK(a.force[10][2] < -0.5 && a.force[20][0] > 0.1, "pressed by %g N, dragged by %g N",
           (double)-a.force[10][2], (double)a.force[20][0]);
  PetscCall(indent("multiplier", "-saddle_solver direct", 900, &b));
  compare_indent(&a, &b, 5e-3, "multiplier");
  PetscCall(indent("multiplier", "-saddle_solver iterative", 900, &b));
  compare_indent(&a, &b, 5e-3, "multiplier by iterations");
  PetscCall(indent("augmented", "", 1000, &b));
  compare_indent(&a, &b, 0.02, "augmented");
  PetscCall(indent("penalty", "-effect_tool_stiffness 100", 1200, &b));
  compare_indent(&a, &b, 0.02, "penalty");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bounds */

#define BEAM                                                                                              \
  "-bodies a -body_a_mesh box:1,0.2,0.1:2 -body_a_material linear -body_a_young 2e6 -body_a_poisson 0.3 " \
  "-body_a_density 100 -body_a_element p1 -time static -ksp_rtol 1e-13 -snes_rtol 1e-12 "                 \
  "-effect_clamp_type fixed -effect_clamp_on xmin "

static PetscErrorCode vi_function(SNES snes, Vec U, Vec F, void *ctx)
{
  PetscFunctionBeginUser;
  (void)snes;
  PetscCall(SbModelResidual((SbModel)ctx, 1, U, NULL, NULL, PETSC_TRUE, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode vi_jacobian(SNES snes, Vec U, Mat A, Mat P, void *ctx)
{
  PetscFunctionBeginUser;
  (void)snes;
  (void)P;
  PetscCall(SbModelTangent((SbModel)ctx, 1, 0, 0, 1, U, NULL, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same beam without contact, u_z bounded from below. */
static PetscErrorCode solve_bounded(SbModel m, Mat A, PetscReal floor, Vec U)
{
  PetscScalar *low;
  SNESConvergedReason reason;
  SNES snes;
  SNESLineSearch search;
  KSP ksp;
  PC pc;
  Vec lower, upper, F;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(U, &lower));
  PetscCall(VecDuplicate(U, &upper));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(VecSet(lower, PETSC_NINFINITY));
  PetscCall(VecSet(upper, PETSC_INFINITY));
  PetscCall(VecGetArray(lower, &low));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) {
    if (!m->space->fixed[i]) low[3 * i + 2] = floor - m->space->node_x[3 * i + 2];
  }
  PetscCall(VecRestoreArray(lower, &low));
  PetscCall(SNESCreate(m->comm, &snes));
  PetscCall(SNESSetType(snes, SNESVINEWTONRSLS));
  PetscCall(SNESSetFunction(snes, F, vi_function, m));
  PetscCall(SNESSetJacobian(snes, A, A, vi_jacobian, m));
  PetscCall(SNESVISetVariableBounds(snes, lower, upper));
  PetscCall(SNESGetLineSearch(snes, &search));
  PetscCall(SNESLineSearchSetType(search, SB_LINESEARCH_NONE));
  PetscCall(SNESSetTolerances(snes, 1e-7, 1e-9, 0, 200, PETSC_DEFAULT));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCJACOBI));
  PetscCall(KSPSetTolerances(ksp, 1e-13, 1e-14, PETSC_DEFAULT, 10000));
  PetscCall(SNESSetOptionsPrefix(snes, "vi_"));
  PetscCall(PetscOptionsSetValue(NULL, "-vi_snes_vi_zero_tolerance", "1e-9")); /* m: what lies on a bound */
  PetscCall(SNESSetFromOptions(snes));
  PetscCall(SNESSolve(snes, NULL, U));
  PetscCall(SNESGetConvergedReason(snes, &reason));
  SB_CHECK(reason > 0, "SNESVI: %s", SNESConvergedReasons[reason]);
  PetscCall(SNESDestroy(&snes));
  PetscCall(VecDestroy(&lower));
  PetscCall(VecDestroy(&upper));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_bounds(void)
{
  const PetscReal floor = -0.02;
  TestScene t, free;
  PetscReal difference, size, values[NVALUE];
  Vec U;

  PetscFunctionBeginUser;
  PetscCall(verify_open(&t,
                        BEAM "-effects gravity,clamp,floor -effect_floor_type contact "
                             "-effect_floor_obstacle plane:0,0,1,%g",
                        (double)floor));
  PetscCall(verify_solve(&t, "bounds"));
  PetscCall(contact_values(t.run, 1, values));
  PetscCall(
    verify_open(&free, BEAM "-effects gravity,clamp -solver sor" /* scalar storage, which SNESVI needs */));
  free.model->load = 1;
  PetscCall(VecDuplicate(free.run->U, &U));
  PetscCall(solve_bounded(free.model, free.run->J, floor, U));
  PetscCall(VecNorm(U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(U, -1, t.run->U));
  PetscCall(VecNorm(U, NORM_INFINITY, &difference));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  bounds: %g nodes touch, SNESVI differs by %.1e of the displacement\n",
                        (double)values[CONTACTS], (double)(difference / size)));
  SB_CHECK(values[CONTACTS] >= 3, "%g contacts", (double)values[CONTACTS]);
  SB_CHECK(difference < 1e-6 * size, "SNESVI differs by %g of %g", (double)difference, (double)size);
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&free));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ hertz */

#define HERTZ_A 0.05 /* radius of contact, m; that of the sphere is 1 */
#define HERTZ_SIZE 1.0

/* A quarter of a block, its cells growing with the distance from the corner where the sphere presses. */
static void hertz_map(const PetscInt n[3], const PetscInt at[3], PetscReal x[3], void *ctx)
{
  const PetscReal g = 3.5;

  (void)n;
  (void)at;
  (void)ctx;
  for (int k = 0; k < 3; k++) {
    const PetscReal from = k == 2 ? 1 - x[k] : x[k];

    x[k] = HERTZ_SIZE * (PetscExpReal(g * from) - 1) / (PetscExpReal(g) - 1);
  }
  x[2] = -x[2];
}

/*
  Hertz: a rigid sphere of radius R pushed by d into a half-space has contact of radius a = sqrt(R d) and takes the force
  4/3 E / (1 - nu^2) sqrt(R) d^(3/2). Far faces move as the half-space does under that force at a point (Boussinesq); there,
  20 a away, the rest is of the order (a/r)^2 of it.
*/
static PetscErrorCode check_hertz(PetscInt cells, PetscReal tolerance)
{
  const PetscReal d = HERTZ_A * HERTZ_A, E = 1e5, nu = 0.3;
  const PetscReal P = 4. / 3 * E / (1 - nu * nu) * PetscPowReal(d, 1.5);
  const PetscInt n[3] = {cells, cells, cells};
  PetscReal values[NVALUE];
  char path[512], r[64], sideways[256];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, hertz_map, NULL, path));
  PetscCall(PetscSNPrintf(r, sizeof(r), "sqrt(x^2+y^2+z^2)"));
  /* radial part over the distance from the axis, and the depth is -z */
  PetscCall(PetscSNPrintf(sideways, sizeof(sideways), "%.15g*(-z/%s^3-%.15g/(%s*(%s-z)))",
                          (double)(P * (1 + nu) / (2 * PETSC_PI * E)), r, (double)(1 - 2 * nu), r, r));
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_material linear -body_a_young %g -body_a_poisson %g -body_a_density 1 "
    "-sets x0,y0,x1,y1,z1,top -set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -set_x1_at plane:1,0,0,1 "
    "-set_y1_at plane:0,1,0,1 -set_z1_at plane:0,0,1,-1 -set_top_at plane:0,0,1,0 -time static "
    "-ksp_rtol 1e-10 -effects x,y,far,ball -effect_x_type fixed -effect_x_on x0 -effect_x_components x "
    "-effect_y_type fixed -effect_y_on y0 -effect_y_components y -effect_far_type prescribed_displacement "
    "-effect_far_on x1,y1,z1 -effect_far_displacement x*%s;y*%s;%.15g*(%.15g/%s+z^2/%s^3) "
    "-effect_ball_type contact -effect_ball_on top -effect_ball_obstacle sphere:0,0,%.15g,1",
    path, (double)E, (double)nu, sideways, sideways, (double)(-P * (1 + nu) / (2 * PETSC_PI * E)),
    (double)(2 * (1 - nu)), r, r, (double)(1 - d)));
  PetscCall(verify_solve(&t, "hertz"));
  PetscCall(contact_values(t.run, 1, values));
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD, "  hertz, %d^3 cells: %g nodes touch, force %.4f of the formula's, %d solves\n",
    (int)cells, (double)values[CONTACTS], (double)(-4 * values[FZ] / P), (int)t.run->newton_total));
  SB_CHECK_NEAR(-4 * values[FZ] / P, 1, tolerance, "force against that of Hertz");
  PetscCall(test_scene_close(&t));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ nothing */

static PetscErrorCode check_nothing(void)
{
  static const char *const extra[] = {"-effects gravity",
                                      "-effects gravity,floor -effect_floor_type contact "
                                      "-effect_floor_obstacle plane:0,0,1,-5 -effect_floor_friction 0.3"};
  PetscReal *u[2], off;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    TestScene t;

    PetscCall(verify_open(
      &t,
      "-bodies a -body_a_mesh box:0.1,0.1,0.1:2 -body_a_material corotated -body_a_young 1e4 "
      "-body_a_poisson 0.3 -body_a_density 1000 -body_a_angular_velocity 1,2,3 -time euler_implicit "
      "-ts_dt 0.01 -ts_max_time 0.1 -snes_rtol 1e-12 %s",
      extra[k]));
    PetscCall(verify_solve(&t, "nothing"));
    n = 3 * verify_numbers(t.model);
    PetscCall(verify_gather(t.model, t.run->U, &u[k]));
    PetscCall(test_scene_close(&t));
  }
  off = verify_difference(n, u[0], u[1]);
  SB_CHECK(off < 1e-10, "an obstacle far away moves the body by %g", (double)off);
  for (int k = 0; k < 2; k++) PetscCall(PetscFree(u[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_press("p1", "projected", 20, 1e-10));
  PetscCall(check_press("cr", "projected", 20, 1e-10));
  PetscCall(check_press("dg", "projected", 20, 1e-10));
  PetscCall(check_press("p1", "multiplier", 20, 1e-10));
  PetscCall(check_press("cr", "multiplier", 20, 1e-10));
  PetscCall(check_press("dg", "multiplier", 20, 1e-10));
  PetscCall(check_press("p1", "augmented", 20, 1e-7));
  PetscCall(check_press("cr", "penalty", 1e3, 1e-6));
  PetscCall(check_fall("p1", "projected"));
  PetscCall(check_fall("p1", "multiplier"));
  PetscCall(check_incline("p1", "multiplier", 0.49));
  PetscCall(check_incline("p1", "projected", 0.51));
  PetscCall(check_incline("p1", "projected", 0.5)); /* keeps what it got when it lay down */
  PetscCall(check_incline("p1", "projected", 0.49));
  PetscCall(check_held("projected"));
  PetscCall(check_corner("projected"));
  PetscCall(check_bounds());
  PetscCall(check_nothing());
  PetscCall(check_hertz(8, 0.3));
  if (size == 1) { /* that other ranks agree is what the scenarios drop and indent show */
    PetscCall(check_fall("cr", "projected"));
    PetscCall(check_fall("dg", "projected"));
    PetscCall(check_fall("p1", "augmented"));
    PetscCall(check_incline("cr", "projected", 0.49));
    PetscCall(check_incline("p1", "augmented", 0.49));
    PetscCall(check_incline("p1", "penalty", 0.51));
    PetscCall(check_held("multiplier"));
    PetscCall(check_held("penalty"));
    PetscCall(check_corner("multiplier"));
    PetscCall(check_corner("augmented"));
    PetscCall(check_indent());
    PetscCall(check_hertz(14, 0.05));
  }
  SB_TEST_END();
}
