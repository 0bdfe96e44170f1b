// @ranks 1 3
/*
  Fibres that contract, against closed forms.

    factors      of length and velocity: their derivatives
    contraction  a free block of the law neohookean, whose fibres run along x: the stretches for
                 which its stress is zero in all directions, with each relation of force and length,
                 all elements; static and, at rest again, dynamic
    strain       a free block with an active strain is without stress, and a held one has the stress
                 of the law at its inverse, all elements
    isometric    a block that is held all around: its stress is that of the tension alone, T f f^T,
                 all laws; turned, it turns along
    velocity     a block whose fibres are stretched and shortened: their stress with a relation of
                 force and velocity, to the order of the integrator
    load         a tension without t grows with the load factor, as t times it does; by load steps,
                 by arc length
    tangent      residuals change by the tangent times the change, the energy by the force
    filtered     a filtered tangent is positive semi-definite, also where the force falls with the
                 length
    balance      a free bar that contracts and is let go: work is kinetic and strain energy, to
                 second order in the step; its momentum stays zero
    inclusion    a tension of a part of a body, from a table
    explicit     the stable step is shorter with a tension, and holds
    restart      goes on bit by bit; a re-meshed body goes on
    errors       a body without directions, tensions below zero or no number
*/
#include <unistd.h>
#include "strained.h"

#define YOUNG 3e4
#define NU 0.3
#define MU (YOUNG / (2. * (1. + NU)))
#define LAMBDA (YOUNG * NU / ((1. + NU) * (1. - 2. * NU)))
#define CUBE                                                                                  \
  "-bodies cube -body_cube_mesh box:1,1,1:1 -body_cube_young 3e4 -body_cube_poisson 0.3 "     \
  "-body_cube_density 1e-3 -body_cube_fibre 1,0,0 -snes_rtol 1e-11 -solver direct -ksp_rtol " \
  "1e-13 "
#define FREE                                                                            \
  "-effects x,y,z -effect_x_type fixed -effect_x_on xmin -effect_x_components x "       \
  "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed " \
  "-effect_z_on zmin -effect_z_components z "

/* A point with these factors: the derivatives of phi and G by the stretch. */
static PetscErrorCode check_factors(SbLengthRelation length, const SbFibreRate *rate)
{
  const struct _p_SbActive a = {.length = length,
                                .optimum = 1.05,
                                .width = 0.4,
                                .velocity = 1.,
                                .curvature = 0.3,
                                .eccentric = 1.4};
  const PetscReal h = 1e-5;
  PetscReal worst[2] = {0., 0.};

  PetscFunctionBeginUser;
  verify_case("factors, relation %d%s", (int)length, rate ? ", moving" : "");
  for (int n = 0; n <= 60; n++) {
    const PetscReal stretch = 0.4037 + n * 0.02;
    SbPack E, phi, G, c;

    for (int l = 0; l < SB_BATCH; l++)
      E[l] = (PetscSqr(stretch + (l - 1) * h) - 1.) / 2.;
    SbActiveFactors(&a, E, rate, phi, G, c);
    worst[0] = PetscMax(worst[0], PetscAbsReal((phi[2] - phi[0]) / (2. * h) - stretch * G[1]));
    worst[1] = PetscMax(worst[1], PetscAbsReal((G[2] - G[0]) / (2. * h) - c[1] / stretch));
    SB_CHECK(G[1] >= 0. && (!rate || c[1] >= 0.), "%s: G = %g, c = %g", verify_title, G[1], c[1]);
  }
  VERIFY_LESS(worst[0], 1e-7, "error of the derivative of the energy");
  VERIFY_LESS(worst[1], 1e-5, "error of the derivative of the factor");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor of a relation of force and length with the optimum o and the width w. */
static PetscReal factor_of(const char *relation, PetscReal stretch, PetscReal o, PetscReal w)
{
  const PetscReal z = (stretch - o) / w;

  if (!strcmp(relation, "parabola"))
    return PetscMax(0., 1. - z * z);
  return strcmp(relation, "gaussian") ? 1. : PetscExpReal(-z * z);
}

/* The stretch a along and b across the fibres of a free block: its stresses, mu (b - 1/b) + lambda
   ln(a b^2)/b across, are zero. */
static void solve_stretches(const char *relation, PetscReal T, PetscReal o, PetscReal w,
                            PetscReal *a, PetscReal *b)
{
  PetscReal low = 0.05;
  PetscReal high = 1.;

  for (int n = 0; n < 200; n++) {
    PetscReal least = 0.5;
    PetscReal most = 20.;

    *a = 0.5 * (low + high);
    for (int k = 0; k < 200; k++) {
      *b = 0.5 * (least + most);
      if (MU * (*b - 1. / *b) + LAMBDA * PetscLogReal(*a * *b * *b) / *b > 0.)
        most = *b;
      else
        least = *b;
    }
    if (MU * (*a - 1. / *a) + LAMBDA * PetscLogReal(*a * *b * *b) / *a +
          T * factor_of(relation, *a, o, w) * *a >
        0.)
      high = *a;
    else
      low = *a;
  }
}

static PetscErrorCode check_contraction(const char *element, const char *relation, PetscReal o,
                                        PetscReal w)
{
  const PetscReal T = 2e4;
  PetscReal a, b, u[3];

  PetscFunctionBeginUser;
  verify_case("contraction, %s, %s", element, relation);
  solve_stretches(relation, T, o, w, &a, &b);
  PetscCall(strained_corner(
    u,
    CUBE FREE "-body_cube_material neohookean -body_cube_element %s -time static "
              "-body_cube_active_tension 2e4 -body_cube_active_length %s "
              "-body_cube_active_optimum %g -body_cube_active_width %g -static_steps 2",
    element, relation, o, w));
  VERIFY_NEAR(u[0], a - 1., 1e-9, "shortening of the block");
  VERIFY_NEAR(u[1], b - 1., 1e-9, "its widening in y");
  VERIFY_NEAR(u[2], b - 1., 1e-9, "its widening in z");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An active strain g alone: a free block has the stretches 1 + g and (1 + g)^(-1/2) and no energy;
   a held one the stress of F_a^-1, mu (a^2 - 1) along its fibres and mu (1/a - 1) across. */
static PetscErrorCode check_strain(const char *law, const char *element)
{
  const PetscReal g = -0.2;
  const PetscReal a = 1. / (1. + g);
  const PetscReal exact[6] = {MU * (a * a - 1.), MU * (1. / a - 1.), MU * (1. / a - 1.)};
  PetscReal u[3], stress[6];
  PetscReal worst = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("strain, %s, %s", law, element);
  PetscCall(strained_corner(u,
                            CUBE FREE "-body_cube_material %s -body_cube_element %s -time static "
                                      "-body_cube_active_strain -0.2 -static_steps 2",
                            law, element));
  VERIFY_NEAR(u[0], g, 1e-9, "shortening of the block");
  VERIFY_NEAR(u[1], 1. / PetscSqrtReal(1. + g) - 1., 1e-9, "its widening in y");
  VERIFY_NEAR(u[2], 1. / PetscSqrtReal(1. + g) - 1., 1e-9, "its widening in z");
  if (strcmp(law, "neohookean"))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(test_open(&t,
                      CUBE "-body_cube_material %s -body_cube_element %s -sets skin -set_skin_at "
                           "body:cube -effects hold -effect_hold_type fixed -effect_hold_on skin "
                           "-time static -body_cube_active_strain -0.2*t",
                      law, element));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(strained_mean(&t, stress));
  for (int k = 0; k < 6; k++)
    worst = PetscMax(worst, PetscAbsReal(stress[k] - exact[k]));
  VERIFY_LESS(worst / MU, 1e-9, "error of the stress of a held block, over mu");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contraction at the end of a slow motion with damping. */
static PetscErrorCode check_dynamic(const char *element, const char *time)
{
  PetscReal a, b, u[3];

  PetscFunctionBeginUser;
  verify_case("contraction, %s, %s", element, time);
  solve_stretches("none", 2e4, 1., 1., &a, &b);
  PetscCall(strained_corner(
    u,
    CUBE FREE "-body_cube_material neohookean -body_cube_element %s -time %s -ts_dt 0.05 "
              "-ts_max_time 2 -body_cube_active_tension 2e4*min(t,1) "
              "-effects x,y,z,slow -effect_slow_type damping -effect_slow_on cube "
              "-effect_slow_alpha 1e4",
    element, time));
  VERIFY_NEAR(u[0], a - 1., 1e-6, "shortening of the block");
  VERIFY_NEAR(u[2], b - 1., 1e-6, "its widening");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A held block, turned by `degrees` about z: T q q^T with q the fibre (3, 4, 0) / 5, turned. */
static PetscErrorCode check_isometric(const char *law, const char *constants, const char *element,
                                      PetscReal degrees)
{
  const PetscReal T = 6e4;
  const PetscReal angle = degrees * PETSC_PI / 180.;
  const PetscReal q[2] = {0.6 * PetscCosReal(angle) - 0.8 * PetscSinReal(angle),
                          0.6 * PetscSinReal(angle) + 0.8 * PetscCosReal(angle)};
  const PetscReal exact[6] = {T * q[0] * q[0], T * q[1] * q[1], 0., T * q[0] * q[1], 0., 0.};
  const PetscReal *u;
  PetscReal stress[6], *tension;
  PetscReal worst = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("isometric, %s, %s, %g degrees", law, element, degrees);
  PetscCall(test_open(&t,
                      CUBE "-body_cube_material %s %s -body_cube_element %s -body_cube_fibre 3,4,0 "
                           "-body_cube_active_tension 6e4 -sets skin -set_skin_at body:cube "
                           "-effects turn -effect_turn_type prescribed_displacement "
                           "-effect_turn_on skin -effect_turn_angle %g -effect_turn_axis 0,0,1 "
                           "-effect_turn_axis_point 0,0,0 -time static -static_steps 4",
                      law, constants, element, degrees));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(strained_mean(&t, stress));
  for (int k = 0; k < 6; k++)
    worst = PetscMax(worst, PetscAbsReal(stress[k] - exact[k]));
  VERIFY_LESS(worst / T, 1e-9, "error of the stress over the tension");

  /* the field of the tensions */
  PetscCall(PetscMalloc1(t.model->mesh->ncell_owned, &tension));
  PetscCall(SbSpaceGetLocalRead(t.model->space, t.run->state.U, &u));
  SbSpaceActiveTension(t.model->space, u, tension);
  PetscCall(SbSpaceRestoreLocalRead(t.model->space, t.run->state.U, &u));
  for (PetscInt c = 0; c < t.model->mesh->ncell_owned; c++)
    SB_CHECK(PetscAbsReal(tension[c] - T) < 1e-9 * T, "%s: tension %g Pa", verify_title,
             tension[c]);
  PetscCall(PetscFree(tension));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A driven block, whose fibres have the stretch l = 1 + 0.05 (1 - cos(w t))^2: what they add to its
   stress, T g(l) h(v) l^2 / J. */
static PetscErrorCode check_velocity(const char *element, const char *time, PetscReal T,
                                     PetscReal order)
{
  const PetscReal w = 10.;
  const PetscReal most = 2.;
  const PetscReal k = 0.3;
  const PetscReal N = 1.4;
  const PetscReal way = 1. - PetscCosReal(w * T);
  const PetscReal l = 1. + 0.05 * way * way;
  const PetscReal v = 0.1 * way * w * PetscSinReal(w * T) / most;
  const PetscReal c = (N - 1.) / (1. + 1. / k);
  const PetscReal h = v > 0. ? 1. + (N - 1.) * v / (v + c) : (1. + v) / (1. - v / k);
  const PetscReal exact = 2e4 * factor_of("parabola", l, 1.1, 0.6) * h * l;
  PetscReal error[3];

  PetscFunctionBeginUser;
  verify_case("velocity, %s, %s, v = %g", element, time, v);
  for (int n = 0; n < 3; n++) {
    PetscReal stress[2][6];

    for (int i = 0; i < 2; i++) {
      TestScene t;

      PetscCall(test_open(
        &t,
        CUBE
        "-body_cube_material stvk -body_cube_element %s -sets skin -set_skin_at body:cube -effects "
        "pull -effect_pull_type prescribed_displacement -effect_pull_on skin "
        "-effect_pull_displacement 0.05*(1-cos(10*t))^2*x;0;0 -time %s -ts_dt %.17g "
        "-ts_max_time %.17g -body_cube_active_tension %s -body_cube_active_length "
        "parabola -body_cube_active_optimum 1.1 -body_cube_active_width 0.6 "
        "-body_cube_active_velocity 2 -body_cube_active_curvature 0.3 "
        "-body_cube_active_eccentric 1.4",
        element, time, 0.02 / (1 << n), T, i ? "2e4" : "1e-9"));
      PetscCall(verify_solve(&t, verify_title));
      PetscCall(strained_mean(&t, stress[i]));
      PetscCall(test_scene_close(&t));
    }
    error[n] = PetscAbsReal(stress[1][0] - stress[0][0] - exact) / exact;
  }
  VERIFY_LESS(error[2], order > 1. ? 2e-3 : 0.05, "error of the stress of the fibres");
  VERIFY_NEAR(PetscLog2Real(error[1] / error[2]), order, 0.3, "order");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_load(void)
{
  static const char *const ways[] = {
    "-body_cube_active_tension 2e4 -static_steps 1",
    "-body_cube_active_tension 2e4 -static_steps 3",
    "-body_cube_active_tension 2e4*t -static_steps 3",
    "-body_cube_active_tension 2e4 -static_control arc_length -static_steps 3",
    "-body_cube_active_tension 2e4*t -static_control arc_length -static_steps 3"};
  PetscReal a, b, u[3];

  PetscFunctionBeginUser;
  solve_stretches("none", 2e4, 1., 1., &a, &b);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ways); i++) {
    verify_case("load, %s", ways[i]);
    PetscCall(
      strained_corner(u, CUBE FREE "-body_cube_material neohookean -time static %s", ways[i]));
    VERIFY_NEAR(u[0], a - 1., 1e-7, "shortening of the block");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BENT                                                                                  \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_young 5e4 -body_bar_poisson 0.4 "   \
  "-body_bar_density 1000 -body_bar_fibre 1;0.5*z;x -body_bar_material %s -body_bar_element " \
  "%s -effects hold -effect_hold_type fixed -effect_hold_on xmin -time static -static_steps " \
  "4 -body_bar_active_tension 2e4*(1+x)*t -body_bar_active_length %s "                        \
  "-body_bar_active_optimum %g -body_bar_active_width 0.4 -snes_rtol 1e-9 -solver direct %s "

/* Beside a bar that contracts unevenly; moving: in a step whose fibres have a relation of force and
   velocity, too. */
static PetscErrorCode check_tangent(const char *law, const char *element, const char *relation,
                                    PetscBool moving, const char *constants)
{
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("tangent, %s, %s, %s%s, %s", law, element, relation, moving ? ", moving" : "",
              constants);
  PetscCall(test_open(&t, BENT "-body_bar_tangent exact", law, element, relation, 0.9,
                      moving ? "-time genalpha -ts_dt 0.002 -ts_max_time 0.04 "
                               "-body_bar_active_tension 2e4*(1+x)*ramp(50*t) "
                               "-body_bar_active_velocity 3"
                             : constants));
  PetscCall(verify_solve(&t, verify_title));
  if (moving)
    PetscCall(
      SbSpaceActiveRates(t.model->space, 0.002, PETSC_TRUE, t.run->state.U, t.run->state.V));
  PetscCall(strained_tangent(&t));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A soft bar beyond the optimum of its fibres: x . K x along random x, least over their squares. */
static PetscErrorCode check_filtered(const char *law, const char *element)
{
  PetscReal least[2] = {PETSC_MAX_REAL, PETSC_MAX_REAL};
  TestScene t;
  PetscRandom random;
  Vec X, Y;

  PetscFunctionBeginUser;
  verify_case("filtered, %s, %s", law, element);
  PetscCall(test_open(
    &t,
    "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_young 5e2 -body_bar_poisson 0.3 "
    "-body_bar_density 1000 -body_bar_fibre 1,0,0 -body_bar_material %s -body_bar_element %s "
    "-body_bar_active_tension 1e6 -body_bar_active_length gaussian -body_bar_active_optimum 0.7 "
    "-body_bar_active_width 0.3 -effects hold -effect_hold_type fixed -effect_hold_on xmin "
    "-time static -solver direct",
    law, element));
  PetscCall(VecDuplicate(t.run->state.U, &X));
  PetscCall(VecDuplicate(t.run->state.U, &Y));
  PetscCall(PetscRandomCreate(PETSC_COMM_WORLD, &random));
  PetscCall(PetscRandomSetInterval(random, -1., 1.));
  PetscCall(PetscRandomSetSeed(random, 7));
  PetscCall(PetscRandomSeed(random));
  for (int k = 0; k < 2; k++) {
    PetscCall(SbModelProjectTangent(t.model, (PetscBool)k));
    PetscCall(SbModelTangent(t.model, 1., 0., 0., 1., t.run->state.U, NULL, t.run->solve.J));
    for (int n = 0; n < 30; n++) {
      PetscReal form, size;

      PetscCall(VecSetRandom(X, random));
      PetscCall(MatMult(t.run->solve.J, X, Y));
      PetscCall(VecDot(X, Y, &form));
      PetscCall(VecNorm(X, NORM_2, &size));
      least[k] = PetscMin(least[k], form / (size * size));
    }
  }
  SB_CHECK(least[0] < 0., "%s: the exact tangent has x . K x >= %g", verify_title, least[0]);
  SB_CHECK(least[1] > 0., "%s: the filtered tangent has x . K x = %g", verify_title, least[1]);
  PetscCall(PetscRandomDestroy(&random));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&Y));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BAR                                                                                     \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_material neohookean -body_bar_young " \
  "5e4 -body_bar_poisson 0.4 -body_bar_density 1000 -body_bar_fibre 1;0.3*z;0 "                 \
  "-body_bar_active_tension 5e3*(1+x)*sin(20*t)^2 -body_bar_active_length gaussian -time %s "   \
  "-body_bar_element %s -snes_rtol 1e-10 -solver direct "

#define STRAIN "-body_bar_active_tension 0 -body_bar_active_strain -0.1*(1+x)*sin(20*t)^2"

/* order: of the error of the balance; integrators that damp lose energy themselves. */
static PetscErrorCode check_balance(const char *element, const char *time, const char *constants,
                                    PetscReal order)
{
  const PetscReal tip[3] = {0.4, 0.1, 0.1};
  PetscReal error[3], u[3][3];

  PetscFunctionBeginUser;
  verify_case("balance, %s, %s, %s", element, time, constants);
  for (int k = 0; k < 3; k++) {
    const SbEnergies *e;
    TestScene t;

    PetscCall(test_open(&t, BAR "-ts_dt %.17g -ts_max_time 0.08 %s", time, element,
                        0.002 / (1 << k), constants));
    t.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(verify_solve(&t, verify_title));
    e = &t.run->state.energies;
    error[k] = PetscAbsReal(e->integrator_loss) / e->active_work;
    SB_CHECK(e->active_work > 0. && e->load_work == 0. && e->kinetic > 0.01 * e->active_work,
             "%s: work %g J, of loads %g, kinetic energy %g", verify_title, e->active_work,
             e->load_work, e->kinetic);
    for (int i = 0; i < 3; i++)
      SB_CHECK(PetscAbsReal(e->momentum[i]) < 1e-8, "%s: momentum %g kg m/s", verify_title,
               e->momentum[i]);
    PetscCall(test_value_at(t.model, t.run->state.U, tip, u[k]));
    PetscCall(test_scene_close(&t));
  }
  VERIFY_LESS(error[2], 0.02, "error of the balance over the work");
  VERIFY_NEAR(PetscLog2Real(error[1] / error[2]), order, 0.3, "order of the balance");
  VERIFY_LESS(order - PetscLog2Real((u[0][0] - u[1][0]) / (u[1][0] - u[2][0])), 0.3,
              "order less that of the displacement");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Half of the block contracts, by a table; the other half is stretched by it. */
static PetscErrorCode check_inclusion(void)
{
  char path[512];
  PetscReal u[2][3];
  FILE *f;

  PetscFunctionBeginUser;
  verify_case("inclusion");
  PetscCall(test_file_open(".txt", path, &f));
  if (f)
    fprintf(f, "# load factor, Pa\n0 0\n0.5 3e4\n1 1e4\n");
  PetscCall(test_file_close(f));
  for (int k = 0; k < 2; k++)
    PetscCall(strained_corner(
      u[k],
      CUBE "-body_cube_mesh box:1,1,1:2 -body_cube_material neohookean -sets half -set_half_at "
           "box:-1,-1,-1,0.5,2,2 -body_cube_inclusions half -inclusion_half_material corotated "
           "-inclusion_half_young 2e4 -inclusion_half_poisson 0.3 -inclusion_half_fibre 1,0,0 "
           "-effects hold -effect_hold_type fixed -effect_hold_on xmin -time static "
           "-static_steps 4 -inclusion_half_active_tension %s%s",
      k ? "table:" : "1e4*t", k ? path : ""));
  SB_CHECK(u[0][0] < -0.05, "%s: shortening %g", verify_title, -u[0][0]);
  VERIFY_NEAR(u[1][0] / u[0][0], 1., 1e-7, "shortening by the table over that by a formula");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A bar that is held at both ends across its fibres, whose tension of ten times the modulus makes
   it stiff as a string. */
static PetscErrorCode check_explicit(const char *element)
{
  PetscReal dt[2], moved[2];

  PetscFunctionBeginUser;
  verify_case("explicit, %s", element);
  for (int k = 0; k < 2; k++) {
    TestScene t;

    PetscCall(
      test_open(&t,
                "-bodies bar -body_bar_mesh box:0.1,0.1,0.4:1 -body_bar_material "
                "stable_neohookean -body_bar_young 5e3 -body_bar_poisson 0.3 "
                "-body_bar_density 1000 -body_bar_fibre 0,0,1 -body_bar_element %s -effects "
                "hold,push -effect_hold_type fixed -effect_hold_on zmin,zmax "
                "-effect_push_type body_force -effect_push_on bar -effect_push_density "
                "500;0;0 -time euler_symplectic -ts_max_time 0.5 -body_bar_active_tension "
                "%s*ramp(10*t)",
                element, k ? "5e4" : "1"));
    t.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(verify_solve(&t, verify_title));
    dt[k] = t.run->clock.dt;
    moved[k] = t.run->state.energies.max_displacement;
    PetscCall(test_scene_close(&t));
  }
  SB_CHECK(dt[1] < 0.7 * dt[0], "%s: steps of %g s, without a tension of %g s", verify_title, dt[1],
           dt[0]);
  SB_CHECK(moved[1] < 0.5 * moved[0], "%s: motions of %g m, without a tension of %g m",
           verify_title, moved[1], moved[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_restart(const char *time, const char *element, const char *constants)
{
  const char *folder = getenv("TMPDIR");
  char dir[256];
  int id = (int)getpid();
  PetscReal *whole, *again;
  PetscReal work[2];
  PetscBool same = PETSC_TRUE;
  PetscInt n;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("restart, %s, %s, %s", time, element, constants);
  PetscCallMPI(MPI_Bcast(&id, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCall(PetscSNPrintf(dir, sizeof(dir), "%s/active_%d", folder ? folder : "/tmp", id));
  PetscCall(test_open_in(dir, &t,
                         BAR "-ts_dt 0.005 -ts_max_time 0.1 -checkpoint_every_steps 10 "
                             "-checkpoint_keep 9 -output_fields none -progress false %s",
                         time, element, constants));
  PetscCall(verify_solve(&t, verify_title));
  n = 3 * verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, &whole));
  work[0] = t.run->state.energies.active_work;
  PetscCall(test_scene_close(&t));
  PetscCall(
    test_open_in(dir, &t,
                 BAR "-ts_dt 0.005 -ts_max_time 0.1 -checkpoint_every_steps 10 -checkpoint_keep 9 "
                     "-output_fields none -progress false -restart %s/checkpoint_000010.h5 %s",
                 time, element, dir, constants));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(verify_gather(t.model, t.run->state.U, &again));
  work[1] = t.run->state.energies.active_work;
  SB_CHECK(t.run->counters.steps == 10, "%d steps after the restart", (int)t.run->counters.steps);
  PetscCall(test_scene_close(&t));
  for (PetscInt i = 0; i < n; i++)
    same = (PetscBool)(same && whole[i] == again[i]);
  SB_CHECK(same, "%s: the restarted run differs", verify_title);
  SB_CHECK(work[0] == work[1] && work[0] > 0., "%s: works %.17g and %.17g J", verify_title, work[0],
           work[1]);
  PetscCall(PetscFree(whole));
  PetscCall(PetscFree(again));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A finer bar, whose mesh hardly matters, is meshed anew on the way. */
static PetscErrorCode check_remesh(const char *constants)
{
  PetscReal work[2], centre[2];

  PetscFunctionBeginUser;
  verify_case("re-meshing, %s", constants);
  for (int k = 0; k < 2; k++) {
    TestScene t;

    PetscCall(test_open(&t,
                        BAR
                        "-body_bar_mesh box:0.4,0.1,0.1:4 -effects hold -effect_hold_type fixed "
                        "-effect_hold_on xmin -ts_dt 0.005 -ts_max_time 0.08 %s %s",
                        "genalpha", "p2", constants, k ? "-remesh_times 0.04" : ""));
    t.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(test_scene_solve(&t));
    SB_CHECK(!t.run->clock.stop_reason[0] && t.run->clock.t > 0.0799, "%s: %g s, %s", verify_title,
             t.run->clock.t, t.run->clock.stop_reason);
    work[k] = t.run->state.energies.active_work;
    centre[k] = t.run->state.energies.centre[0] - 0.2;
    PetscCall(test_scene_close(&t));
  }
  VERIFY_NEAR(work[1] / work[0], 1., 0.01, "work over that of one mesh");
  VERIFY_NEAR(centre[1] / centre[0], 1., 0.01, "motion of the centre over that of one mesh");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Iterative solvers. */
static PetscErrorCode check_solvers(const char *law, const char *element)
{
  static const char *const solvers[] = {"direct", "rotated", "cg_two_level", "auto"};
  const PetscReal tip[3] = {0.4, 0.1, 0.1};
  PetscReal u[4][3];

  PetscFunctionBeginUser;
  verify_case("solvers, %s, %s", law, element);
  for (int k = 0; k < 4; k++) {
    TestScene t;

    PetscCall(test_open(&t,
                        BAR
                        "-body_bar_material %s -body_bar_active_length none -effects hold "
                        "-effect_hold_type fixed -effect_hold_on xmin -ts_dt 0.005 -ts_max_time "
                        "0.05 -ksp_rtol 1e-9 -solver %s -snes_rtol 1e-8",
                        "euler_implicit", element, law, solvers[k]));
    PetscCall(verify_solve(&t, solvers[k]));
    PetscCall(test_value_at(t.model, t.run->state.U, tip, u[k]));
    PetscCall(test_scene_close(&t));
    VERIFY_NEAR(u[k][0] / u[0][0], 1., 1e-5, solvers[k]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_errors(void)
{
  static const struct {
    const char *options, *names;
    PetscErrorCode code;
    PetscBool later; /* in the run */
  } cases[] = {
    {"-body_cube_material stvk -body_cube_active_tension 1e4",
     "-body_cube_active_tension|stvk|-body_cube_fibre", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material linear -body_cube_fibre 1,0,0 -body_cube_active_tension 1e4 "
     "-body_cube_active_length parabola",
     "-body_cube_active_length|linear", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material corotated -body_cube_tangent warped -body_cube_fibre 1,0,0 "
     "-body_cube_active_tension 1e4 -time euler_implicit -ts_max_time 1 -solver realtime",
     "-solver|realtime|active_tension", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material stvk -body_cube_fibre 0,0,0 -body_cube_active_tension 1e4",
     "-body_cube_fibre|0", PETSC_ERR_USER_INPUT, PETSC_FALSE},
    {"-body_cube_material stvk -body_cube_fibre 1;0;t -body_cube_active_tension 1e4",
     "-body_cube_fibre|t", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material stvk -body_cube_fibre 1,0,0 -body_cube_active_tension 1e4 "
     "-body_cube_active_width 0",
     "-body_cube_active_width|0", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material stvk -body_cube_fibre 1,0,0 -body_cube_active_tension 1e4 "
     "-body_cube_active_velocity 3 -time euler_symplectic -ts_max_time 1",
     "-body_cube_active_velocity|-time", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material stvk -body_cube_fibre 1,0,0 -body_cube_active_tension 1e4*x-9e3",
     "-body_cube_active_tension|-", PETSC_ERR_USER_INPUT, PETSC_TRUE},
    {"-body_cube_material stvk -body_cube_active_strain -0.1",
     "-body_cube_active_strain|stvk|-body_cube_fibre", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_fibre 1,0,0 -body_cube_active_strain -0.1 "
     "-body_cube_prony_times 1 -body_cube_prony_shear 0.1",
     "-body_cube_active_strain|prony_times", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_fibre 1,0,0 -body_cube_active_strain -0.1 "
     "-time euler_symplectic -ts_max_time 1",
     "-body_cube_active_strain|-time", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_fibre 1,0,0 -body_cube_active_strain 0-1-x",
     "-body_cube_active_strain|-1", PETSC_ERR_USER_INPUT, PETSC_TRUE},
    {"-body_cube_material stvk -body_cube_fibre 1,0,0 -body_cube_active_tension log(t-2)",
     "-body_cube_active_tension|log(t-2)|number", PETSC_ERR_USER_INPUT, PETSC_TRUE},
    {"-body_cube_material stvk -body_cube_fibre 1,0,0 -body_cube_active_tension table:none.txt",
     "-body_cube_active_tension|none.txt", PETSC_ERR_USER, PETSC_FALSE},
  };
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("errors");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    char text[VERIFY_TEXT];

    PetscCall(PetscSNPrintf(text, sizeof(text),
                            "-bodies cube -body_cube_mesh box:1,1,1:1 -body_cube_young 3e4 "
                            "-body_cube_poisson 0.3 -body_cube_density 1000 " FREE
                            "-time static %s",
                            cases[i].options));
    if (cases[i].later) {
      PetscCall(test_scene_open(text, &t));
      SB_CHECK_ERROR(test_scene_solve(&t), cases[i].code, cases[i].names);
    } else
      SB_CHECK_ERROR(test_scene_open(text, &t), cases[i].code, cases[i].names);
    PetscCall(test_scene_close(&t));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const elements[] = {"p1", "p2", "cr", "dg"};
  static const char *const relations[] = {"none", "parabola", "gaussian"};
  static const char *const laws[] = {"linear",     "corotated",         "stvk",
                                     "neohookean", "stable_neohookean", "holmes_mow"};
  PetscMPIInt size;
  SbFibreRate rate = {.slope = 2.5};

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (int l = 0; l < SB_BATCH; l++) {
    rate.start[l] = rate.expected[l] = 1.;
    rate.v[l] = -0.2;
  }
  for (int k = 0; k < 3; k++) {
    PetscCall(check_factors((SbLengthRelation)k, NULL));
    PetscCall(check_factors((SbLengthRelation)k, &rate));
  }
  for (int k = 0; k < 4; k++)
    PetscCall(check_contraction(elements[k], "none", 1., 1.));
  PetscCall(check_contraction("p1", "parabola", 1.1, 0.6));
  PetscCall(check_contraction("p2", "gaussian", 0.9, 0.4));
  for (int k = 0; k < 4; k++) {
    PetscCall(check_strain("neohookean", elements[k]));
    PetscCall(check_strain(k % 2 ? "isochoric_neohookean" : "stable_neohookean", elements[k]));
  }
  PetscCall(check_dynamic("p1", "genalpha"));
  PetscCall(check_dynamic("p2", "euler_implicit"));
  PetscCall(check_dynamic("cr", "genalpha"));
  for (int l = 0; l < 6; l++) {
    PetscCall(check_isometric(laws[l], "", elements[l % 4], 0.));
    if (l)
      PetscCall(check_isometric(laws[l], "", elements[(l + 1) % 4], 70.));
  }
  PetscCall(check_isometric(
    "guccione", "-body_cube_c 2e3 -body_cube_bf 8 -body_cube_bt 2 -body_cube_bfs 4", "p2", 30.));
  PetscCall(check_velocity("p1", "newmark", 0.24, 2.));
  PetscCall(check_velocity("p2", "newmark", 0.54, 2.));
  PetscCall(check_velocity("cr", "euler_implicit", 0.24, 1.));
  PetscCall(check_load());
  for (int l = 1; l < 6; l++)
    PetscCall(check_tangent(laws[l], elements[l % 4], relations[l % 3], PETSC_FALSE, ""));
  PetscCall(check_tangent("corotated", "p1", "parabola", PETSC_FALSE, ""));
  PetscCall(check_tangent("neohookean", "p2", "gaussian", PETSC_FALSE, ""));
  PetscCall(check_tangent("stvk", "p1", "none", PETSC_TRUE, ""));
  PetscCall(check_tangent("stable_neohookean", "p2", "gaussian", PETSC_TRUE, ""));
  PetscCall(check_tangent("corotated", "dg", "parabola", PETSC_TRUE, ""));
  for (int k = 0; k < 4; k++)
    PetscCall(check_tangent(k % 2 ? "stable_neohookean" : "holmes_mow", elements[k], "none",
                            PETSC_FALSE, "-body_bar_active_strain -0.15*(1+x)*t"));
  PetscCall(check_tangent("guccione", "p2", "none", PETSC_FALSE,
                          "-body_bar_c 2e3 -body_bar_bf 8 -body_bar_bt 2 -body_bar_bfs 4 "
                          "-body_bar_active_strain -0.15*(1+x)*t"));
  PetscCall(check_filtered("stable_neohookean", "p1"));
  PetscCall(check_filtered("corotated", "p2"));
  if (size == 1) {
    PetscCall(check_balance("p1", "newmark", "", 2.));
    PetscCall(check_balance("p2", "newmark", "-body_bar_active_velocity 2", 2.));
    PetscCall(check_balance("cr", "genalpha", "", 2.));
    PetscCall(check_balance("p2", "newmark", STRAIN, 2.));
    PetscCall(check_explicit("p1"));
    PetscCall(check_explicit("cr"));
    PetscCall(check_remesh("-body_bar_active_velocity 3"));
    PetscCall(check_remesh(STRAIN));
    PetscCall(check_solvers("corotated", "p1"));
    PetscCall(check_solvers("neohookean", "p2"));
  }
  PetscCall(check_inclusion());
  PetscCall(check_restart("genalpha", "dg", STRAIN));
  PetscCall(check_restart("newmark", "p2", "-body_bar_active_velocity 3"));
  PetscCall(check_errors());
  SB_TEST_END();
}
