// @ranks 1 2
/*
  Contact with rigid obstacles.

    press      a block under a load on a plane: uniform stress, the obstacle carries the load, the
    gap is closed fall       a block falls on a plane: no step gains energy (implicit Euler), the
    momentum changes by weight and contact
               force only, and no node is behind the plane at the end of a step
    incline    friction on a slope of tan = 0.5: a block sticks with 0.51, keeps its speed with 0.5,
    slides at g (sin - mu cos) with 0.49 held       static friction balances a load along the floor
    corner     a block slides along a floor and a wall, each with friction: g - mu (N + N')
    indent     a capsule indents a block and is dragged: the four responses give the same force
    bounds     a beam that sags on a plane: the same displacement as by PETSc's solver of
    variational inequalities hertz      a rigid sphere on a half-space: force against approach
*/
#include "hertz.h"

/* ------------------------------------------------------------------ press */

#define LOAD 500.0 /* Pa */

/* A column between two planes of symmetry, loaded from above: u = -p/E (-nu x, -nu y, z), with nu =
   0.3. */
static PetscErrorCode check_press(const char *element, const char *response, PetscReal stiffness,
                                  PetscReal tolerance)
{
  Record r = {0};
  TestScene t;
  PetscReal worst;

  PetscFunctionBeginUser;
  verify_case("press, %s, %s", element, response);
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_element %s -time static -ksp_rtol 1e-12 -snes_rtol 1e-12 -effects "
    "x,y,load,floor -effect_x_type fixed -effect_x_on xmin -effect_x_components x -effect_y_type "
    "fixed -effect_y_on ymin -effect_y_components y -effect_load_type traction -effect_load_on "
    "zmax -effect_load_vector 0;0;%g -effect_floor_type contact -effect_floor_response projected "
    "-effect_floor_on zmin -effect_floor_obstacle plane:0,0,1,0.001 -effect_floor_response %s "
    "-effect_floor_stiffness %g" VERIFY_BODY("a", "box:0.1,0.1,0.05:4", "linear", "1e5", "0.3"),
    element, -LOAD, response, stiffness));
  PetscCall(record_solve(&t, &r));
  PetscCall(contact_stress_error(&t, LOAD, &worst));
  PetscCall(test_scene_close(&t));
  VERIFY_LESS(worst, 1e-6, "stress from uniform, of the load");
  VERIFY_NEAR(record_last(&r, "floor_force_z"), LOAD * 0.01, 1e-6 * LOAD * 0.01,
              "force of the floor, N");
  VERIFY_NEAR(record_last(&r, "floor_penetration"), 0, tolerance, "penetration, m");
  VERIFY_MORE(record_last(&r, "floor_contacts"), 20, "contacts");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ fall */

static PetscErrorCode check_fall(const char *element, const char *response)
{
  const PetscBool exact = (PetscBool)(response[1] == 'r' || response[0] == 'm');
  Record r = {.g = 9.81};

  PetscFunctionBeginUser;
  verify_case("fall, %s, %s", element, response);
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_rotate 1,2,0,20 -body_a_translate 0,0,0.05 -body_a_velocity 0,0,-0.5 "
    "-body_a_element %s -effects gravity,floor -effect_floor_type contact -effect_floor_response "
    "projected -effect_floor_obstacle plane:0,0,1,0 -effect_floor_response %s -time "
    "euler_implicit -ts_dt 0.005 -ts_max_time 0.25 -snes_rtol 1e-11 -ksp_rtol 1e-10" VERIFY_BODY(
      "a", "box:0.1,0.1,0.1:2", "corotated", "1e4", "0.3"),
    element, response));

  /* kinetic and potential energy 0.5 J at the start; momentum 0.7 kg m/s at impact */
  VERIFY_LESS(record_gain(&r, "energy"), 1e-7, "largest gain of a step, J");
  VERIFY_LESS(record_max(&r, "missing"), 1e-7, "momentum that no force explains, kg m/s");
  VERIFY_MORE(record_impulse(&r, "floor_force_z"), 1, "impulse of the floor, N s");
  VERIFY_MORE(record_max(&r, "floor_force_z"), 3 * r.mass * 9.81, "largest force of the floor, N");
  if (exact)
    VERIFY_LESS(record_max(&r, "floor_penetration"), 1e-6 * 0.17, "penetration, m");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ incline */

static PetscErrorCode check_incline(const char *element, const char *response, PetscReal mu)
{
  static const PetscReal time[2] = {0.3, 0.6};
  const PetscReal normal = 9.81 * 2 / PetscSqrtReal(5);
  const PetscReal a = normal * (0.5 - mu);
  PetscReal t[2] = {0}, v[2], x[2], h, way; /* of the centroid along the slope */
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("incline, %s, %s, friction %g", element, response, mu);
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_element %s -effects gravity,floor -effect_gravity_vector %.15g,0,%.15g "
    "-effect_floor_type contact -effect_floor_response projected -effect_floor_obstacle "
    "plane:0,0,1,0 "
    "-effect_floor_friction %g -effect_floor_response %s -time euler_implicit -ts_dt 0.01 "
    "-ts_max_time "
    "0.6" VERIFY_BODY("a", "box:0.1,0.1,0.05:3", "corotated", "1e6", "0.3"),
    element, 0.5 * normal, -normal, mu, response));
  for (PetscInt i = r.n - 1; i >= 0;
       i--) { /* first step that ends there or, after a divided step, later */
    for (int k = 0; k < 2; k++) {
      if (record_at(&r, "t", i) < time[k] - 1e-9)
        continue;
      t[k] = record_at(&r, "t", i);
      v[k] = record_at(&r, "a_vx", i);
      x[k] = record_at(&r, "centre_x", i);
    }
  }
  h = t[1] - t[0];
  way = x[1] - x[0];

  /* solves that take N from the previous solve needed 540 to 910 when the block slides */
  VERIFY_LESS(r.newton, 7 * 60, "solves for 60 steps");
  if (mu > 0.5) {
    VERIFY_NEAR(way, 0, 1e-8, "motion of a block that sticks, m");
    VERIFY_NEAR(v[1], 0, 1e-7, "its velocity, m/s");
  } else {
    /* implicit Euler: x1 - x0 = v0 h + a h (h + dt) / 2 */
    VERIFY_NEAR((v[1] - v[0]) / h, a, 0.01 * a + 1e-6, "acceleration, m/s^2");
    VERIFY_NEAR(way - v[0] * h, 0.5 * a * h * (h + 0.01), 0.01 * 0.5 * a * h * h + 1e-8,
                "distance, m");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ static friction */

static PetscErrorCode check_held(const char *response)
{
  const PetscReal load =
    100 * 0.1 * 0.05; /* N; the weight is 4.9 N, so the friction limit is 1.47 N */
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("held, %s", response);
  PetscCall(record_run(
    &r,
    "-bodies a -effects gravity,side,load,floor -effect_side_type fixed -effect_side_on xmin "
    "-effect_side_components y -effect_load_type traction -effect_load_on xmax -effect_load_vector "
    "100;0;0 "
    "-effect_floor_type contact -effect_floor_response projected -effect_floor_on zmin "
    "-effect_floor_obstacle plane:0,0,1,1e-5 -effect_floor_friction 0.3 -effect_floor_response %s "
    "-time "
    "static" VERIFY_BODY("a", "box:0.1,0.1,0.05:2", "linear", "1e5", "0.3"),
    response));
  VERIFY_NEAR(record_last(&r, "floor_force_x"), -load, 1e-5 * load, "friction against the load, N");
  VERIFY_NEAR(record_last(&r, "floor_force_z"), 0.5 * 9.81, 1e-5 * 0.5 * 9.81, "weight, N");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ corner */

/* Nodes on the common edge are in contact with both planes: friction with one must not reduce the
   force of the other. */
static PetscErrorCode check_corner(const char *response)
{
  const PetscReal push[3] = {-5, 6, -8};
  const PetscReal mu = 0.3;
  const PetscReal a = push[1] + mu * (push[0] + push[2]);
  const PetscReal end = 0.3;
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("corner, %s", response);
  PetscCall(record_run(
    &r,
    "-bodies a -effects gravity,floor,wall -effect_gravity_vector %g,%g,%g -effect_floor_type "
    "contact "
    "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction %g -effect_floor_response %s "
    "-effect_wall_type contact -effect_wall_response projected -effect_wall_obstacle plane:1,0,0,0 "
    "-effect_wall_friction %g -effect_wall_response %s -time euler_implicit -ts_dt 0.01 "
    "-ts_max_time "
    "%g" VERIFY_BODY("a", "box:0.1,0.1,0.1:2", "corotated", "1e5", "0.3"),
    push[0], push[1], push[2], mu, response, mu, response, end));
  VERIFY_NEAR(record_last(&r, "momentum_y"), a * end, 0.01 * a * end,
              "momentum along both, kg m/s");
  VERIFY_NEAR(record_last(&r, "floor_force_z"), -push[2], 1e-3 * -push[2], "force of the floor, N");
  VERIFY_NEAR(record_last(&r, "floor_force_y"), mu * push[2], 2e-3 * mu * -push[2],
              "friction of the floor, N");
  VERIFY_NEAR(record_last(&r, "floor_force_x"), 0, 1e-2 * mu * -push[2],
              "friction across the motion, N");
  VERIFY_LESS(r.newton, 15 * 30, "solves for 30 steps");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ indent */

#define INDENT_STEPS 20
#define INDENT_DT 0.02 /* s */

/* Force of the indenter, N, at the ends of the steps [INDENT_STEPS + 1][3]; at most `most` linear
   solves. */
static PetscErrorCode indent(const char *response, const char *more, PetscInt most,
                             PetscReal force[][3])
{
  static const char *const columns[3] = {"tool_force_x", "tool_force_y", "tool_force_z"};
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("indent, %s %s", response, more);
  PetscCall(record_run(
    &r,
    "-bodies a -effects bed,tool -effect_bed_type fixed -effect_bed_on zmin -effect_tool_type "
    "contact -effect_tool_response projected -effect_tool_on zmax -effect_tool_obstacle "
    "capsule:0.05,0.031,0.055,0.05,0.031,0.155,0.015 -effect_tool_displacement "
    "0.02*ramp(t/0.2-1);0;-0.01*ramp(t/0.2) -effect_tool_response %s -effect_tool_friction 0.3 "
    "-time euler_implicit -ts_dt %g -ts_max_time 0.4 %s" VERIFY_BODY("a", "box:0.1,0.06,0.04:4",
                                                                     "corotated", "2e4", "0.4"),
    response, INDENT_DT, more));

  /* solves that take N from the previous solve needed 1700 to 2400 */
  VERIFY_LESS(r.newton, most, "solves");
  PetscCall(PetscArrayzero(force[0], 3 * (INDENT_STEPS + 1)));
  for (PetscInt i = 1; i < r.n; i++) {
    const PetscReal step = record_at(&r, "t", i) / INDENT_DT;
    const PetscInt at = (PetscInt)PetscFloorReal(step + 0.5);

    if (PetscAbsReal(step - (PetscReal)at) > 1e-7)
      continue; /* a substep */
    for (int k = 0; k < 3; k++)
      force[at][k] = record_at(&r, columns[k], i);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_indent(void)
{
  static const struct {
    const char *response, *more;
    PetscInt solves;
    PetscReal off;
  } others[] = {{"multiplier", "-saddle_solver direct", 900, 5e-3},
                {"multiplier", "-saddle_solver iterative", 900, 5e-3},
                {"augmented", "", 1000, 0.02},
                {"penalty", "-effect_tool_stiffness 100", 1200, 0.02}};
  PetscReal a[INDENT_STEPS + 1][3], b[INDENT_STEPS + 1][3];

  PetscFunctionBeginUser;
  PetscCall(indent("projected", "", 900, a));
  VERIFY_LESS(a[10][2], -0.5, "pressed by, N");
  VERIFY_MORE(a[20][0], 0.1, "dragged by, N");
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(others); k++) {
    PetscCall(indent(others[k].response, others[k].more, others[k].solves, b));
    VERIFY_LESS(verify_difference(3 * (INDENT_STEPS + 1), a[0], b[0]), others[k].off,
                "difference from projected");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bounds */

#define BEAM                                                                              \
  "-bodies a -body_a_mesh box:1,0.2,0.1:2 -body_a_material linear -body_a_young 2e6 "     \
  "-body_a_poisson 0.3 "                                                                  \
  "-body_a_density 100 -body_a_element p1 -time static -ksp_rtol 1e-13 -snes_rtol 1e-12 " \
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

/* Solves the same beam without contact, u_z bounded from below. */
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
  for (PetscInt i = 0; i < m->space->nnode_owned; i++)
    if (!m->space->fixed[i])
      low[3 * i + 2] = floor - m->space->node_x[3 * i + 2];
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
  PetscCall(
    PetscOptionsSetValue(NULL, "-vi_snes_vi_zero_tolerance", "1e-9")); /* m: active bounds */
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

/* A block below the beam, all of which is fixed; the surface of `response` keeps the gap of 1
   mm. */
#define TABLE                                                                                   \
  "-bodies a,table -body_table_mesh box:1.4,0.6,0.1:3,2,1 -body_table_translate "               \
  "-0.213,-0.187,-0.121 -body_table_material linear -body_table_young 2e6 -body_table_poisson " \
  "0.3 "                                                                                        \
  "-body_table_density "                                                                        \
  "100 -effect_hold_type fixed -effect_hold_on table "

/* response: of pairs, NULL: of nodes against a half-space. */
static PetscErrorCode check_bounds(const char *response)
{
  const PetscReal floor = -0.02;
  TestScene t, free;
  PetscReal difference, size;
  Record r = {0};
  Vec U;

  PetscFunctionBeginUser;
  verify_case(response ? response : "bounds");
  if (response)
    PetscCall(test_open(&t,
                        BEAM TABLE "-effects gravity,clamp,hold,floor -effect_floor_type contact "
                                   "-effect_floor_response %s -effect_floor_barrier_width 1e-3",
                        response));
  else
    PetscCall(test_open(
      &t,
      BEAM "-effects gravity,clamp,floor -effect_floor_type contact -effect_floor_response "
           "projected -effect_floor_obstacle plane:0,0,1,%g",
      floor));
  PetscCall(record_solve(&t, &r));

  /* scalar storage, which SNESVI needs */
  PetscCall(test_open(&free, BEAM "%s -solver sor",
                      response ? TABLE "-effects gravity,clamp,hold" : "-effects gravity,clamp"));
  free.model->load = 1;
  PetscCall(VecDuplicate(free.run->state.U, &U));
  PetscCall(solve_bounded(free.model, free.run->solve.J, floor, U));
  PetscCall(VecNorm(U, NORM_INFINITY, &size));
  PetscCall(VecAXPY(U, -1, t.run->state.U));
  PetscCall(VecNorm(U, NORM_INFINITY, &difference));
  VERIFY_MORE(record_last(&r, "floor_contacts"), 2, "nodes that touch");
  VERIFY_LESS(difference, 1e-6 * size, "difference from SNESVI, m");
  PetscCall(VecDestroy(&U));
  PetscCall(test_scene_close(&free));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ hertz */

#define HERTZ_A 0.05 /* contact radius, m; the sphere has radius 1 */

/* Quarter of a block; cells grow with the distance from the corner under the sphere. */
static void hertz_map(const VerifyPlace *place, PetscReal x[3])
{
  const PetscReal g = 3.5;

  (void)place;
  for (int k = 0; k < 3; k++) {
    const PetscReal from = k == 2 ? 1 - x[k] : x[k];

    x[k] = (PetscExpReal(g * from) - 1) / (PetscExpReal(g) - 1);
  }
  x[2] = -x[2];
}

/*
  Hertz: a rigid sphere of radius R with approach d to a half-space has the contact radius a =
  sqrt(R d) and the force 4/3 E / (1 - nu^2) sqrt(R) d^(3/2). The far faces have the displacement of
  a half-space under that point force (Boussinesq); at their distance of 20 a the difference is of
  the order (a/r)^2 of it.
*/
static PetscErrorCode check_hertz(const char *element, PetscInt cells, PetscReal tolerance)
{
  const PetscReal d = HERTZ_A * HERTZ_A;
  const PetscReal E = 1e5;
  const PetscReal P = 4. / 3 * E / (1 - POISSON * POISSON) * PetscPowReal(d, 1.5);
  const PetscInt n[3] = {cells, cells, cells};
  Record record = {0};
  char path[512], far[VERIFY_TEXT / 4];

  PetscFunctionBeginUser;
  verify_case("hertz, %s, %d^3 cells", element, (int)cells);
  PetscCall(verify_mesh_write(n, hertz_map, NULL, path));
  PetscCall(boussinesq(P, E, -1, 0, sizeof(far), far));
  PetscCall(record_run(
    &record,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material linear -body_a_young %g "
    "-body_a_poisson "
    "%g -body_a_density 1 -sets x0,y0,x1,y1,z1,top -set_x0_at plane:1,0,0,0 -set_y0_at "
    "plane:0,1,0,0 "
    "-set_x1_at plane:1,0,0,1 -set_y1_at plane:0,1,0,1 -set_z1_at plane:0,0,1,-1 -set_top_at "
    "plane:0,0,1,0 "
    "-time static -ksp_rtol 1e-10 -effects x,y,far,ball -effect_x_type fixed -effect_x_on x0 "
    "-effect_x_components x -effect_y_type fixed -effect_y_on y0 -effect_y_components y "
    "-effect_far_type "
    "prescribed_displacement -effect_far_on x1,y1,z1 -effect_far_displacement %s "
    "-effect_ball_type contact -effect_ball_response projected "
    "-effect_ball_on top -effect_ball_obstacle sphere:0,0,%.15g,1",
    path, element, E, POISSON, far, 1 - d));
  verify_show("nodes that touch", record_last(&record, "ball_contacts"));
  VERIFY_NEAR(-4 * record_last(&record, "ball_force_z") / P, 1, tolerance,
              "force against that of Hertz");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_press("p1", "projected", 20, 1e-10));
  PetscCall(check_press("cr", "projected", 20, 1e-10));
  PetscCall(check_press("dg", "projected", 20, 1e-10));
  PetscCall(check_press("p1", "multiplier", 20, 1e-10));
  PetscCall(check_press("cr", "multiplier", 20, 1e-10));
  PetscCall(check_press("dg", "multiplier", 20, 1e-10));
  PetscCall(check_press("p2", "projected", 20, 1e-10));
  PetscCall(check_press("p2", "multiplier", 20, 1e-10));
  PetscCall(check_press("p1", "augmented", 20, 1e-7));
  PetscCall(check_press("cr", "penalty", 1e3, 1e-6));
  PetscCall(check_fall("p1", "projected"));
  PetscCall(check_fall("p1", "multiplier"));
  PetscCall(check_incline("p1", "multiplier", 0.49));
  PetscCall(check_incline("p1", "projected", 0.51));
  PetscCall(check_incline("p1", "projected", 0.5)); /* keeps the velocity of its initial settling */
  PetscCall(check_incline("p1", "projected", 0.49));
  PetscCall(check_held("projected"));
  PetscCall(check_corner("projected"));
  PetscCall(check_bounds(NULL));
  PetscCall(check_bounds("projected"));
  PetscCall(check_bounds("multiplier"));
  PetscCall(check_hertz("p1", 8, 0.3));
  PetscCall(check_hertz("p2", 6, 0.02));
  PetscCall(check_incline("p2", "projected", 0.49));
  if (test_size == 1) { /* agreement of ranks is tested by the scenarios drop and indent */
    PetscCall(check_fall("cr", "projected"));
    PetscCall(check_fall("dg", "projected"));
    PetscCall(check_fall("p2", "projected"));
    PetscCall(check_fall("p1", "augmented"));
    PetscCall(check_incline("p2", "augmented", 0.49));
    PetscCall(check_incline("p2", "penalty", 0.51));
    PetscCall(check_incline("cr", "projected", 0.49));
    PetscCall(check_incline("p1", "augmented", 0.49));
    PetscCall(check_incline("p1", "penalty", 0.51));
    PetscCall(check_held("multiplier"));
    PetscCall(check_held("penalty"));
    PetscCall(check_corner("multiplier"));
    PetscCall(check_corner("augmented"));
    PetscCall(check_indent());
    PetscCall(check_hertz("p1", 14, 0.05));
  }
  SB_TEST_END();
}
