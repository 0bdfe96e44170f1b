// @ranks 1 3
/*
  Growth, thermal expansion and prestrain, against closed forms.

    free         a free block that grows is without stress and has the new size, all elements, laws
    of
                 each kind, also near nu = 1/2; along fibres and across them; static and dynamic
    held         a held block has the stress of its law at the inverse of the stretches, in the
    frame of
                 its fibres
    linear field a free body with a linear temperature is without stress: exact for P2
    load         a strain without t grows with the load factor, as t times it does; by load steps,
    by
                 arc length
    tangent      residuals change by the tangent times the change, the energy by the force
    strip        two layers with different expansions: Timoshenko's curvature
    LE11         NAFEMS, solid cylinder, taper and sphere with a temperature
    balance      a free bar that grows unevenly: work is kinetic and strain energy, to second order
    in
                 the step; its momentum stays zero
    restart      goes on bit by bit; a re-meshed body goes on
    errors       strains below -1, a temperature without an expansion, laws and integrators
*/
#include <unistd.h>
#include "curved.h"
#include "strained.h"

#define YOUNG 3e4
#define CUBE                                                                                   \
  "-bodies cube -body_cube_mesh box:1,1,1:1 -body_cube_young 3e4 -body_cube_density 1e-3 "     \
  "-snes_rtol 1e-11 -solver direct -ksp_rtol 1e-13 -body_cube_material %s -body_cube_element " \
  "%s -body_cube_poisson %g "
#define FREE                                                                            \
  "-effects x,y,z -effect_x_type fixed -effect_x_on xmin -effect_x_components x "       \
  "-effect_y_type fixed -effect_y_on ymin -effect_y_components y -effect_z_type fixed " \
  "-effect_z_on zmin -effect_z_components z "
#define HELD                                                                                 \
  "-sets skin -set_skin_at body:cube -effects hold -effect_hold_type fixed -effect_hold_on " \
  "skin "

/* Largest component of the stress of cells and of the pressure of the law, Pa. */
static PetscErrorCode largest_stress(TestScene *t, PetscReal *most)
{
  const PetscInt n = t->model->mesh->ncell_owned;
  const PetscReal *u;
  PetscReal *sigma;

  PetscFunctionBeginUser;
  *most = 0.;
  PetscCall(PetscMalloc1(7 * n, &sigma));
  PetscCall(SbSpaceGetLocalRead(t->model->space, t->run->state.U, &u));
  SbSpaceCellState(t->model->space, u, sigma, NULL, NULL, sigma + 6 * n);
  PetscCall(SbSpaceRestoreLocalRead(t->model->space, t->run->state.U, &u));
  for (PetscInt i = 0; i < 7 * n; i++)
    *most = PetscMax(*most, PetscAbsReal(sigma[i]));
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 1, MPIU_REAL, MPI_MAX, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A free block with these options has the displacement u at its corner, and no stress. */
static PetscErrorCode check_free(const char *law, const char *element, PetscReal nu,
                                 const char *options, const PetscReal exact[3], PetscReal tolerance)
{
  PetscReal u[3], most;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("free, %s, %s, %g, %s", law, element, nu, options);
  PetscCall(test_open(&t, CUBE FREE "-static_steps 2 %s", law, element, nu, options));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(largest_stress(&t, &most));
  VERIFY_LESS(most / YOUNG, tolerance, "stress over Young's modulus");
  PetscCall(test_scene_close(&t));
  PetscCall(strained_corner(u, CUBE FREE "-static_steps 2 %s", law, element, nu, options));
  for (int k = 0; k < 3; k++)
    VERIFY_NEAR(u[k], exact[k], tolerance, "displacement of the corner");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The stress of a held block whose fibres are along (3, 4, 0) / 5: of the stretches l along them
   and m across. */
static PetscErrorCode check_held(const char *law, const char *element, PetscReal nu,
                                 const char *options, PetscReal l, PetscReal m)
{
  const PetscReal mu = YOUNG / (2. * (1. + nu));
  const PetscReal lambda = YOUNG * nu / ((1. + nu) * (1. - 2. * nu));
  const PetscReal grown = l * m * m;
  PetscReal along, across, stress[6], theta;
  PetscReal worst = 0.;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("held, %s, %s, %g, %s", law, element, nu, options);
  if (!strcmp(law, "linear")) {
    theta = -(l - 1.) - 2. * (m - 1.);
    along = -2. * mu * (l - 1.) + lambda * theta;
    across = -2. * mu * (m - 1.) + lambda * theta;
  } else if (!strcmp(law, "corotated")) {
    theta = 1. / l + 2. / m - 3.;
    along = grown / l * (2. * mu * (1. / l - 1.) + lambda * theta);
    across = grown / m * (2. * mu * (1. / m - 1.) + lambda * theta);
  } else {
    theta = -PetscLogReal(grown);
    along = grown * (mu * (1. / (l * l) - 1.) + lambda * theta);
    across = grown * (mu * (1. / (m * m) - 1.) + lambda * theta);
  }
  const PetscReal more = along - across;
  const PetscReal exact[6] = {
    across + 0.36 * more, across + 0.64 * more, across, 0.48 * more, 0., 0.};
  PetscCall(test_open(&t,
                      CUBE HELD "-body_cube_fibre 3,4,0 -time static -static_steps 2 "
                                "-body_cube_mesh box:1,1,1:2 %s",
                      law, element, nu, options));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(strained_mean(&t, stress));
  for (int k = 0; k < 6; k++)
    worst = PetscMax(worst, PetscAbsReal(stress[k] - exact[k]));
  VERIFY_LESS(worst / PetscAbsReal(along), 1e-8, "error of the stress, relative");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* u = alpha T0 stretched by a temperature 10 + 20 x - 30 y: strains are linear, the displacement
   quadratic. */
static PetscErrorCode check_linear_field(const char *element, PetscReal nu)
{
  PetscReal most;
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("linear field, %s, %g", element, nu);
  PetscCall(test_open(&t,
                      CUBE "-body_cube_mesh box:1,1,1:2 -time static -sets a,b,c -set_a_at "
                           "box:-1,-1,-1,0.1,0.1,0.1 -set_b_at box:0.9,-1,-1,2,0.1,0.1 -set_c_at "
                           "box:-1,0.9,-1,0.1,2,0.1 -effects a,b,c -effect_a_type fixed "
                           "-effect_a_on a -effect_b_type fixed -effect_b_on b "
                           "-effect_b_components yz -effect_c_type fixed -effect_c_on c "
                           "-effect_c_components z -body_cube_thermal_expansion 1e-4 "
                           "-body_cube_temperature 10+20*x-30*y",
                      "linear", element, nu));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(largest_stress(&t, &most));
  VERIFY_LESS(most / (YOUNG * 1e-4 * 30.), 1e-9, "stress over E alpha T");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_load(void)
{
  static const char *const ways[] = {"0.3 -static_steps 1", "0.3 -static_steps 3",
                                     "0.3*t -static_steps 3",
                                     "0.3 -static_control arc_length -static_steps 3",
                                     "0.3*t -static_control arc_length -static_steps 3"};
  PetscReal u[3];

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ways); i++) {
    verify_case("load, %s", ways[i]);
    PetscCall(strained_corner(u, CUBE FREE "-time static -body_cube_growth %s", "neohookean", "p2",
                              0.3, ways[i]));
    VERIFY_NEAR(u[0], 0.3, 1e-7, "displacement of the corner");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A slow motion with damping, at rest at its end. */
static PetscErrorCode check_dynamic(const char *element, const char *time)
{
  PetscReal u[3];

  PetscFunctionBeginUser;
  verify_case("dynamic, %s, %s", element, time);
  PetscCall(strained_corner(u,
                            CUBE FREE
                            "-time %s -ts_dt 0.05 -ts_max_time 2 -body_cube_growth 0.2*min(t,1) "
                            "-body_cube_thermal_expansion 1e-3 -body_cube_temperature "
                            "-100*min(t,1) -effects x,y,z,slow -effect_slow_type damping "
                            "-effect_slow_on cube -effect_slow_alpha 1e4",
                            "stable_neohookean", element, 0.45, time));
  VERIFY_NEAR(u[0], 1.2 * 0.9 - 1., 1e-6, "displacement of the corner");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The law linear keeps its stable step. */
static PetscErrorCode check_explicit(const char *element)
{
  PetscReal u[3];

  PetscFunctionBeginUser;
  verify_case("explicit, %s", element);
  PetscCall(strained_corner(u,
                            CUBE FREE
                            "-body_cube_density 1 -time euler_symplectic -ts_max_time 0.4 "
                            "-body_cube_growth 0.2*min(10*t,1) -effects x,y,z,slow "
                            "-effect_slow_type damping -effect_slow_on cube -effect_slow_alpha 200",
                            "linear", element, 0.3));
  VERIFY_NEAR(u[0], 0.2, 1e-6, "displacement of the corner");
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BENT                                                                                   \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_young 5e4 -body_bar_poisson %g "     \
  "-body_bar_density 1000 -body_bar_material %s -body_bar_element %s -body_bar_tangent exact " \
  "-effects hold -effect_hold_type fixed -effect_hold_on xmin -time static -static_steps 4 "   \
  "-snes_rtol 1e-9 -solver direct %s "
#define SKEW "-body_bar_fibre 1;0.5*z;x "

static PetscErrorCode check_tangent(const char *law, const char *element, PetscReal nu,
                                    const char *options)
{
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("tangent, %s, %s, %g, %s", law, element, nu, options);
  PetscCall(test_open(&t, BENT, nu, law, element, options));
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(strained_tangent(&t));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of two layers of the thickness h/2, with moduli in the ratio n, of which one expands by e:
   Timoshenko (1925). */
static PetscReal curvature(PetscReal h, PetscReal n, PetscReal e)
{
  return 24. * e / (h * (12. + (1. + n) * (1. + 1. / n)));
}

static PetscErrorCode check_strip(const char *law, PetscReal tolerance)
{
  const PetscReal exact = curvature(1., 2., 1e-4);
  const PetscReal from[3] = {2., 0., 0.5};
  const PetscReal to[3] = {6., 0., 0.5};
  PetscReal k[2];

  PetscFunctionBeginUser;
  verify_case("strip, %s", law);
  for (int n = 0; n < 2; n++) {
    PetscReal u[2][3], at[2][3];
    TestScene t;

    PetscCall(
      test_open(&t,
                "-bodies strip -body_strip_mesh box:8,0.5,1:%d,%d,%d -body_strip_element p2 "
                "-body_strip_material %s -body_strip_young 1e6 -body_strip_poisson 0.3 "
                "-body_strip_density 1 -sets low,end,side,corner -set_low_at "
                "box:-1,-1,-1,9,1,0.501 -set_end_at plane:1,0,0,0 -set_side_at plane:0,1,0,0 "
                "-set_corner_at box:-1,-1,-1,0.01,1,0.01 -body_strip_inclusions low "
                "-inclusion_low_material %s -inclusion_low_young 2e6 -inclusion_low_poisson 0.3 "
                "-inclusion_low_density 1 -inclusion_low_thermal_expansion 1e-5 "
                "-inclusion_low_temperature 10 -effects x,y,z -effect_x_type fixed -effect_x_on "
                "end -effect_x_components x -effect_y_type fixed -effect_y_on side "
                "-effect_y_components y -effect_z_type fixed -effect_z_on corner "
                "-effect_z_components z -time static -static_steps 1 -solver direct",
                8 << n, 1 << n, 2 << n, law, law));
    PetscCall(verify_solve(&t, verify_title));

    /* w = w_0 + k x^2 / 2 of the middle line, away from the ends */
    for (int i = 0; i < 2; i++) {
      for (int c = 0; c < 3; c++)
        at[i][c] = i ? to[c] : from[c];
      PetscCall(test_value_at(t.model, t.run->state.U, at[i], u[i]));
    }
    k[n] = 2. * (u[1][2] - u[0][2]) / (PetscSqr(to[0]) - PetscSqr(from[0]));
    test_print("  curvature over Timoshenko's, %d cells along: %g\n", 8 << n, k[n] / exact);
    PetscCall(test_scene_close(&t));
  }
  VERIFY_NEAR(k[1] / exact, 1., tolerance, "curvature over Timoshenko's");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The profile of LE11, a quarter of the turn: x = (across, around, along) in [0, 1]. Cells are
   finer towards A, where the stress is steep: on even ones of this number it is -98.5 MPa. */
static void cylinder(PetscReal x[3])
{
  const PetscReal finer = 1.7;
  static const PetscReal outer[3][2] = {{1.2124, 0.7}, {1.1062, 1.045}, {1., 1.39}};
  const PetscReal s = x[2] < 0.25 ? PetscPowReal(4. * x[2], finer) : 4. * x[2];
  const PetscReal across = PetscPowReal(x[0], finer);
  const int k = (int)PetscMin(3., PetscFloorReal(s));
  const PetscReal p = s - k;
  const PetscReal angle = x[1] * PETSC_PI / 2.;
  const PetscReal half = PetscSqrtReal(0.5);
  PetscReal in[2], out[2];

  if (k < 2) {
    in[0] = PetscCosReal(s * PETSC_PI / 8.);
    in[1] = PetscSinReal(s * PETSC_PI / 8.);
  } else {
    in[0] = half;
    in[1] = half + (s - 2.) / 2. * (1.79 - half);
  }
  if (k == 0) {
    out[0] = 1.4 * PetscCosReal(p * PETSC_PI / 6.);
    out[1] = 1.4 * PetscSinReal(p * PETSC_PI / 6.);
  } else {
    for (int i = 0; i < 2; i++) {
      const PetscReal end = k == 3 ? (i ? 1.79 : 1.) : outer[k][i];

      out[i] = outer[k - 1][i] + p * (end - outer[k - 1][i]);
    }
  }
  const PetscReal r = in[0] + across * (out[0] - in[0]);
  const PetscReal z = in[1] + across * (out[1] - in[1]);

  x[0] = r * PetscCosReal(angle);
  x[1] = r * PetscSinReal(angle);
  x[2] = z;
}

/* sigma_zz at A, (1, 0, 0), MPa. */
static PetscErrorCode stress_at_A(TestScene *t, PetscReal *stress)
{
  const SbMesh mesh = t->model->mesh;
  PetscReal sum[2] = {0., 0.};
  SbNodalStress nodal;

  PetscFunctionBeginUser;
  PetscCall(SbNodalStressCreate(t->model->space, &nodal));
  PetscCall(SbNodalStressCompute(nodal, t->run->state.U));
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++) {
    const PetscReal *x = mesh->x + 3 * mesh->cell[i];
    PetscReal sigma[6];

    if (PetscAbsReal(x[0] - 1.) + PetscAbsReal(x[1]) + PetscAbsReal(x[2]) > 1e-9)
      continue;
    SbNodalStressAt(nodal, i / 4, (int)(i % 4), sigma);
    sum[0] += sigma[2] / 1e6;
    sum[1] += 1.;
  }
  PetscCall(SbNodalStressDestroy(&nodal));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  *stress = sum[0] / sum[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_le11(void)
{
  PetscReal stress[2];

  PetscFunctionBeginUser;
  verify_case("LE11");
  for (int k = 0; k < 2; k++) {
    const PetscInt n[3] = {2 * (k + 1), 4 * (k + 1), 12 * (k + 1)};
    char mesh[512];
    TestScene t;

    PetscCall(curved_box_write(n, cylinder, mesh));
    PetscCall(test_open(
      &t,
      "-bodies a -body_a_mesh %s -body_a_element p2 -body_a_material linear -body_a_young 210e9 "
      "-body_a_poisson 0.3 -body_a_density 7800 -body_a_thermal_expansion 2.3e-4 "
      "-body_a_temperature sqrt(x^2+y^2)+z -sets x,y,ends,top -set_x_at plane:1,0,0,0 -set_y_at "
      "plane:0,1,0,0 -set_ends_at plane:0,0,1,0 -set_top_at plane:0,0,1,1.79 -effects "
      "x,y,z -effect_x_type fixed -effect_x_on x -effect_x_components x -effect_y_type fixed "
      "-effect_y_on y -effect_y_components y -effect_z_type fixed -effect_z_on ends,top "
      "-effect_z_components z -time static -static_steps 1 -solver direct",
      mesh));
    PetscCall(verify_solve(&t, verify_title));
    PetscCall(stress_at_A(&t, &stress[k]));
    test_print("  sigma_zz at A, %d tets: %g MPa\n", (int)t.model->mesh->Ncell, stress[k]);
    PetscCall(test_scene_close(&t));
  }
  VERIFY_NEAR(stress[1], -105., 1.05, "stress at A, MPa");
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define BAR                                                                                 \
  "-bodies bar -body_bar_mesh box:0.4,0.1,0.1:1 -body_bar_material %s -body_bar_young 5e4 " \
  "-body_bar_poisson 0.4 -body_bar_density 1000 -time %s -body_bar_element %s -snes_rtol "  \
  "1e-10 -solver direct -ts_dt %.17g -ts_max_time %g "
#define EVEN "-body_bar_growth 0.1*(1+x)*sin(20*t)^2 "
#define UNEVEN                                                              \
  "-body_bar_fibre 1;0.3*z;0 -body_bar_growth_fibre 0.2*(1+x)*sin(20*t)^2 " \
  "-body_bar_growth_plane -0.1*sin(20*t)^2 "

static PetscErrorCode check_balance(const char *law, const char *element, const char *time,
                                    const char *options)
{
  PetscReal error[3];

  PetscFunctionBeginUser;
  verify_case("balance, %s, %s, %s, %s", law, element, time, options);
  for (int k = 0; k < 3; k++) {
    const SbEnergies *e;
    TestScene t;

    PetscCall(test_open(&t, BAR "%s", law, time, element, 0.002 / (1 << k), 0.08, options));
    t.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(verify_solve(&t, verify_title));
    e = &t.run->state.energies;
    error[k] = PetscAbsReal(e->integrator_loss) / e->growth_work;
    SB_CHECK(e->growth_work > 0. && e->load_work == 0. && e->active_work == 0. &&
               e->kinetic > 0.01 * e->growth_work,
             "%s: work %g J, of loads %g, of fibres %g, kinetic energy %g", verify_title,
             e->growth_work, e->load_work, e->active_work, e->kinetic);
    for (int i = 0; i < 3; i++)
      SB_CHECK(PetscAbsReal(e->momentum[i]) < 1e-8, "%s: momentum %g kg m/s", verify_title,
               e->momentum[i]);
    PetscCall(test_scene_close(&t));
  }
  VERIFY_LESS(error[2], 0.02, "error of the balance over the work");
  VERIFY_NEAR(PetscLog2Real(error[1] / error[2]), 2., 0.3, "order of the balance");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_restart(const char *element)
{
  const char *folder = getenv("TMPDIR");
  char dir[256];
  int id = (int)getpid();
  PetscReal *x[2];
  PetscReal work[2];
  PetscInt n = 0;
  PetscBool same = PETSC_TRUE;

  PetscFunctionBeginUser;
  verify_case("restart, %s", element);
  PetscCallMPI(MPI_Bcast(&id, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCall(PetscSNPrintf(dir, sizeof(dir), "%s/growth_%d", folder ? folder : "/tmp", id));
  for (int k = 0; k < 2; k++) {
    char again[512] = "";
    TestScene t;

    if (k)
      PetscCall(PetscSNPrintf(again, sizeof(again), "-restart %s/checkpoint_000010.h5", dir));
    PetscCall(test_open_in(dir, &t,
                           BAR UNEVEN "-checkpoint_every_steps 10 -checkpoint_keep 9 "
                                      "-output_fields growth -progress false %s",
                           "neohookean", "genalpha", element, 0.005, 0.1, again));
    PetscCall(verify_solve(&t, verify_title));
    n = 3 * verify_numbers(t.model);
    PetscCall(verify_gather(t.model, t.run->state.U, &x[k]));
    work[k] = t.run->state.energies.growth_work;
    SB_CHECK(t.run->counters.steps == (k ? 10 : 20), "%d steps", (int)t.run->counters.steps);
    PetscCall(test_scene_close(&t));
  }
  for (PetscInt i = 0; i < n; i++)
    same = (PetscBool)(same && x[0][i] == x[1][i]);
  SB_CHECK(same, "%s: the restarted run differs", verify_title);
  SB_CHECK(work[0] == work[1] && work[0] > 0., "%s: works %.17g and %.17g J", verify_title, work[0],
           work[1]);
  PetscCall(PetscFree(x[0]));
  PetscCall(PetscFree(x[1]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A finer bar is meshed anew on the way. */
static PetscErrorCode check_remesh(void)
{
  PetscReal work[2];

  PetscFunctionBeginUser;
  verify_case("re-meshing");
  for (int k = 0; k < 2; k++) {
    TestScene t;

    PetscCall(
      test_open(&t,
                BAR EVEN "-body_bar_mesh box:0.4,0.1,0.1:4 -effects hold -effect_hold_type fixed "
                         "-effect_hold_on xmin %s",
                "neohookean", "genalpha", "p2", 0.005, 0.08, k ? "-remesh_times 0.04" : ""));
    t.run->monitors.want_energies = PETSC_TRUE;
    PetscCall(test_scene_solve(&t));
    SB_CHECK(!t.run->clock.stop_reason[0] && t.run->clock.t > 0.0799, "%s: %g s, %s", verify_title,
             t.run->clock.t, t.run->clock.stop_reason);
    work[k] = t.run->state.energies.growth_work;
    PetscCall(test_scene_close(&t));
  }
  VERIFY_NEAR(work[1] / work[0], 1., 0.02, "work over that of one mesh");
  PetscFunctionReturn(PETSC_SUCCESS);
}

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
                        BAR UNEVEN "-effects hold -effect_hold_type fixed -effect_hold_on xmin "
                                   "-ksp_rtol 1e-9 -solver %s -snes_rtol 1e-8",
                        law, "euler_implicit", element, 0.005, 0.05, solvers[k]));
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
    {"-body_cube_material stvk -body_cube_growth_fibre 0.1",
     "-body_cube_growth_fibre|stvk|-body_cube_fibre", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material stvk -body_cube_prestrain 0.1",
     "-body_cube_prestrain|stvk|-body_cube_fibre", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_growth 0.1 -body_cube_prony_times 1 "
     "-body_cube_prony_shear 0.1",
     "-body_cube_growth|prony_times", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_growth 0.1 -time euler_symplectic -ts_max_time 1",
     "-body_cube_growth|-time", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_temperature 10",
     "-body_cube_temperature|-body_cube_thermal_expansion|1/K", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_thermal_expansion 1e-5",
     "-body_cube_temperature|-body_cube_thermal_expansion|1e-05", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_temperature_field heat",
     "-body_cube_temperature|heat", PETSC_ERR_USER, PETSC_FALSE},
    {"-body_cube_material neohookean -body_cube_growth 0-1-x", "-body_cube_growth|-1",
     PETSC_ERR_USER_INPUT, PETSC_TRUE},
    {"-body_cube_material neohookean -body_cube_thermal_expansion 1e-3 -body_cube_temperature "
     "-2e3*t",
     "-body_cube_temperature|-2000|K", PETSC_ERR_USER_INPUT, PETSC_TRUE},
    {"-body_cube_material neohookean -body_cube_growth log(t-2)",
     "-body_cube_growth|log(t-2)|number", PETSC_ERR_USER_INPUT, PETSC_TRUE},
    {"-body_cube_material corotated -body_cube_tangent warped -body_cube_growth 0.1 -time "
     "euler_implicit -ts_max_time 1 -solver realtime",
     "-solver|realtime|growth", PETSC_ERR_USER, PETSC_FALSE},
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
  static const char *const laws[] = {"linear",     "corotated",         "stvk",
                                     "neohookean", "stable_neohookean", "isochoric_neohookean"};
  static const PetscReal all[3] = {0.2, 0.2, 0.2};
  static const PetscReal along[3] = {0.1, 0.3, 0.1};
  const PetscReal shorter[3] = {PetscSqrtReal(1.25) - 1., -0.2, PetscSqrtReal(1.25) - 1.};
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));

  /* stress is zero up to the tolerance of solves, over a bulk modulus of 1700 times Young's near
     1/2 */
  for (int l = 0; l < 6; l++) {
    for (int k = 0; k < 4; k++) {
      const PetscReal nu = (l + k) % 2 ? 0.4999 : 0.3;

      PetscCall(
        check_free(laws[l], elements[k], nu, "-time static -body_cube_growth 0.2", all, 1e-8));
    }
    PetscCall(check_free(laws[l], elements[l % 4], 0.4999,
                         "-time static -body_cube_fibre 0,1,0 -body_cube_growth_fibre 0.3 "
                         "-body_cube_growth_plane 0.1",
                         along, 1e-8));
  }
  PetscCall(check_free("guccione", "p2", 0.3,
                       "-body_cube_c 2e3 -body_cube_bf 8 -body_cube_bt 2 -body_cube_bfs 4 -time "
                       "static -body_cube_fibre 0,1,0 -body_cube_growth_fibre 0.3 "
                       "-body_cube_growth_plane 0.1",
                       along, 1e-8));
  PetscCall(check_free("stvk", "cr", 0.3,
                       "-time static -body_cube_thermal_expansion 2e-3 -body_cube_temperature "
                       "100*t",
                       all, 1e-8));
  PetscCall(check_free("neohookean", "p2", 0.45,
                       "-time static -body_cube_fibre 0,1,0 -body_cube_prestrain 0.25", shorter,
                       1e-8));
  PetscCall(check_free("corotated", "dg", 0.45,
                       "-time static -body_cube_fibre 0,1,0 -body_cube_active_strain -0.2", shorter,
                       1e-8));
  for (int k = 0; k < 4; k++) {
    PetscCall(check_held(k % 2 ? "neohookean" : "corotated", elements[k], 0.3,
                         "-body_cube_growth_fibre 0.3", 1.3, 1.));
    PetscCall(check_held(k % 2 ? "corotated" : "neohookean", elements[k], 0.4999,
                         "-body_cube_growth_plane 0.01 -body_cube_growth 0.02", 1.02, 1.02 * 1.01));
    PetscCall(check_held("linear", elements[k], 0.45,
                         "-body_cube_growth_fibre 0.01 -body_cube_growth_plane -0.02", 1.01, 0.98));
  }
  PetscCall(check_held("neohookean", "p2", 0.4,
                       "-body_cube_prestrain 0.1 -body_cube_thermal_expansion 1e-3 "
                       "-body_cube_temperature 50",
                       1.05 / 1.1, 1.05 * PetscSqrtReal(1.1)));
  PetscCall(check_linear_field("p2", 0.3));
  PetscCall(check_linear_field("p2", 0.4999));
  PetscCall(check_load());
  PetscCall(check_dynamic("p1", "genalpha"));
  PetscCall(check_dynamic("p2", "euler_implicit"));
  PetscCall(check_dynamic("dg", "genalpha"));
  PetscCall(check_explicit("p1"));
  PetscCall(check_explicit("p2"));
  for (int l = 1; l < 6; l++) {
    PetscCall(check_tangent(laws[l], elements[l % 4], 0.4, "-body_bar_growth 0.3*(1+x)*t"));
    PetscCall(check_tangent(laws[l], elements[(l + 2) % 4], 0.45,
                            SKEW "-body_bar_growth_fibre 0.3*(1+5*z)*t -body_bar_growth_plane "
                                 "-0.1*t -body_bar_prestrain 0.1*x"));
    PetscCall(check_tangent(laws[l], "p2", 0.49,
                            SKEW "-body_bar_growth 0.2*(1+8*z)*t -body_bar_growth_fibre 0.1"));
  }
  PetscCall(check_tangent("gent", "p2", 0.4,
                          SKEW "-body_bar_growth 0.2*(1+8*z)*t -body_bar_growth_fibre 0.1 "
                               "-body_bar_mu 1.8e4 -body_bar_jm 60"));
  PetscCall(check_restart("cr"));
  PetscCall(check_restart("p2"));
  if (size == 1) {
    PetscCall(check_strip("linear", 0.01));
    PetscCall(check_strip("neohookean", 0.01));
    PetscCall(check_le11());
    PetscCall(check_balance("neohookean", "p1", "newmark", EVEN));
    PetscCall(check_balance("stable_neohookean", "p2", "newmark", UNEVEN));
    PetscCall(check_balance("corotated", "p2", "newmark", EVEN));
    PetscCall(check_balance("linear", "cr", "newmark", UNEVEN));
    PetscCall(check_remesh());
    PetscCall(check_solvers("corotated", "p1"));
    PetscCall(check_solvers("neohookean", "p2"));
  }
  PetscCall(check_errors());
  SB_TEST_END();
}
