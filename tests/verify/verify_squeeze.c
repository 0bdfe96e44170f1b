// @ranks 1
/*
  A cushion compressed to half its height between two moving plates; a quarter of it, symmetry
  planes x = 0 and y = 0, no friction.

  Both plates have the same force, which increases in every step, no cell is inverted, and the
  midplane does not move. The work of the plates is the energy of the cushion. With Poisson's ratio
  0.49 the volume is nearly constant, and CR and P2 give the same force (with a jump penalty that
  does not follow the state CR gives less than half of it). With P1, x itself is an admissible test
  function: the integral of the trace of the stress is the sum of x . f, which is minus the height
  times the force.
*/
#include "contact.h"

#define RADIUS 0.05 /* m */
#define STEPS 20

/* Map of a quarter of a block with bulging top and bottom, so that contact begins at the centre. */
static void cushion(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  x[2] = (2 * x[2] - 1) * (1 - 0.15 * (x[0] * x[0] + x[1] * x[1]));
  for (int k = 0; k < 3; k++)
    x[k] *= RADIUS;
}

/* Integral of the trace of the Cauchy stress over the deformed body, N m. */
static PetscErrorCode stress_trace(TestScene *t, PetscReal *integral)
{
  SbSpace s = t->model->space;
  PetscReal *sigma, *J;
  const PetscReal *u;

  PetscFunctionBeginUser;
  *integral = 0;
  PetscCall(PetscMalloc2(6 * s->mesh->ncell_owned, &sigma, s->mesh->ncell_owned, &J));
  PetscCall(SbSpaceGetLocalRead(s, t->run->state.U, &u));
  SbSpaceCellState(s, u, sigma, J, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(s, t->run->state.U, &u));
  for (PetscInt c = 0; c < s->mesh->ncell_owned; c++) {
    const PetscReal V = SbTetDeterminant(s->mesh->x, s->mesh->cell + 4 * c) / 6;

    *integral += (sigma[6 * c] + sigma[6 * c + 1] + sigma[6 * c + 2]) * J[c] * V;
  }
  PetscCall(PetscFree2(sigma, J));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, integral, 1, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_squeeze(const char *element, PetscInt cells, PetscReal poisson,
                                    PetscReal swell, PetscReal newtons)
{
  const PetscInt n[3] = {cells, cells, 2 * cells};
  const PetscReal young = 1e4;
  Record r = {0};
  PetscReal trace, force, work;
  PetscReal apart = 0;
  PetscReal fall = 0;
  PetscReal drift;
  char path[512];
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("squeeze, %s, nu %g", element, poisson);
  PetscCall(verify_mesh_write(n, cushion, NULL, path));
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material stable_neohookean -body_a_young "
    "%g "
    "-body_a_poisson %g -sets x0,y0 -set_x0_at plane:1,0,0,0 -set_y0_at plane:0,1,0,0 -effects "
    "x,y,top,bottom -effect_x_type fixed -effect_x_on x0 -effect_x_components x -effect_y_type "
    "fixed "
    "-effect_y_on y0 -effect_y_components y -effect_top_type contact -effect_top_response "
    "projected "
    "-effect_top_obstacle plane:0,0,-1,%g -effect_top_displacement 0;0;%g*t -effect_bottom_type "
    "contact "
    "-effect_bottom_response projected -effect_bottom_obstacle plane:0,0,1,%g "
    "-effect_bottom_displacement "
    "0;0;%g*t -time static -static_steps %d -snes_rtol 1e-8 -ksp_rtol 1e-8",
    path, element, young, poisson, -RADIUS, -0.5 * RADIUS, -RADIUS, 0.5 * RADIUS, STEPS));
  PetscCall(record_solve(&t, &r));
  PetscCall(stress_trace(&t, &trace));
  work = t.run->state.energies.prescribed_work;
  PetscCall(test_scene_close(&t));
  force = -record_last(&r, "top_force_z");
  for (PetscInt i = 1; i < r.n; i++) {
    const PetscReal top = record_at(&r, "top_force_z", i);

    apart = PetscMax(apart, PetscAbsReal(top + record_at(&r, "bottom_force_z", i)) / -top);
    fall = PetscMax(fall, top - (i > 1 ? record_at(&r, "top_force_z", i - 1) : 0));
  }
  drift = PetscMax(record_max(&r, "centre_z"), -record_min(&r, "centre_z"));
  VERIFY_LESS(apart, 1e-6, "difference of the plates' forces, of the force");
  VERIFY_LESS(fall, 2e-3 * force, "the force fell by, N");
  VERIFY_MORE(record_last(&r, "top_contacts"), 7, "nodes at a plate");
  VERIFY_NEAR(record_last(&r, "bottom_contacts"), record_last(&r, "top_contacts"), 0,
              "nodes at the other one");
  VERIFY_LESS(drift, 1e-7 * RADIUS, "motion of the centre, m");
  VERIFY_MORE(record_min(&r, "min_J"), 0, "least det F");
  for (int k = 0; k < 2; k++)
    VERIFY_LESS(record_max(&r, k ? "top_penetration" : "bottom_penetration"), 1e-6 * RADIUS,
                "behind a plate, m");
  VERIFY_NEAR(record_last(&r, "volume") / record_at(&r, "volume", 0), 1, swell,
              "volume, of that at rest");
  VERIFY_NEAR(work / record_last(&r, "strain"), 1, 0.02, "work of the plates against the energy");

  /* P2 with two cells across is 4 % below P2 with three */
  if (newtons > 0)
    VERIFY_NEAR(force / newtons, 1, 0.05, "force, of that of P2 with three cells across");

  /* the height is now RADIUS */
  if (!strcmp(element, "p1"))
    VERIFY_NEAR(-force * RADIUS / trace, 1, 1e-6,
                "height times force against the trace of the stress");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Contact springs scaled by the bulk modulus, at nu = 0.4999 a thousand times as stiff as by the
   shear modulus, need 1,800 iterations here. */
static PetscErrorCode check_springs(const char *element)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("springs, %s", element);
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_mesh box:0.1,0.1,0.1:3 -body_a_element %s -body_a_material "
    "stable_neohookean "
    "-body_a_young 1e4 -body_a_poisson 0.4999 -body_a_density 1000 -sets top -set_top_at "
    "plane:0,0,1,0.1 -effects hold,weight,floor -effect_hold_type fixed -effect_hold_on top "
    "-effect_weight_type gravity -effect_floor_type contact -effect_floor_response penalty "
    "-effect_floor_obstacle plane:0,0,1,-0.001 -time static",
    element));
  VERIFY_LESS((PetscReal)r.newton, 80, "iterations");

  /* `projected` gives 3.407 N (P2; 3.420 N with 9 cells across); the penetration of the springs,
     0.5 % of the stress over the shear modulus, is below the error of the mesh */
  if (!strcmp(element, "p2"))
    VERIFY_NEAR(record_last(&r, "floor_force_z") / 3.407, 1, 0.01,
                "force, of that without springs");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void block(const VerifyPlace *place, PetscReal x[3])
{
  (void)place;
  for (int k = 0; k < 3; k++)
    x[k] *= (k == 2 ? 2 : 1) * RADIUS;
}

/* The jump penalty changes from step to step: it adds no energy to a block that is thrown onto a
   floor, to two thirds of its height, in steps of any length, s. */
static PetscErrorCode check_thrown(const char *element, PetscReal dt, PetscReal height)
{
  const PetscInt n[3] = {2, 2, 4};
  Record r = {0};
  char path[512];

  PetscFunctionBeginUser;
  verify_case("thrown, %s, steps of %g s", element, dt);
  PetscCall(verify_mesh_write(n, block, NULL, path));
  PetscCall(record_run(
    &r,
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material stable_neohookean -body_a_young "
    "1e4 "
    "-body_a_poisson 0.49 -body_a_density 1000 -body_a_velocity 0,0,-2.5 -effects floor "
    "-effect_floor_type "
    "contact -effect_floor_obstacle plane:0,0,1,-1e-4 -time euler_implicit -ts_dt %g -ts_max_time "
    "0.05",
    path, element, dt));
  VERIFY_LESS(record_gain(&r, "energy"), 1e-6 * record_at(&r, "energy", 0),
              "energy gained in a step, J");

  /* that of P2 on the same mesh; a constant penalty gives some 0.03 m less */
  VERIFY_NEAR(record_last(&r, "centre_z"), height, 0.003, "height of the centre, m");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compressed to a fifth of its height and released, without damping: the jump penalty grows with
   strong compression, and must not add energy. */
static PetscErrorCode check_released(const char *element)
{
  Record r = {0};

  PetscFunctionBeginUser;
  verify_case("released, %s", element);
  PetscCall(
    record_run(&r,
               "-bodies a -body_a_mesh box:0.05,0.05,0.05:2 -body_a_element %s -body_a_material "
               "stable_neohookean "
               "-body_a_young 1e4 -body_a_poisson 0.45 -body_a_density 1000 -effects high,low "
               "-effect_high_type contact "
               "-effect_high_obstacle plane:0,0,-1,-0.0501 -effect_high_displacement "
               "0;0;-0.04*min(1,t/0.2)+0.04*max(0,min(1,(t-0.3)/0.2)) -effect_low_type contact "
               "-effect_low_obstacle "
               "plane:0,0,1,-0.0001 -time newmark -ts_dt 0.004 -ts_max_time 0.6",
               element));

  /* the compressed body has 1 J; the integrator adds 0.035 J, most of it in one step at the fastest
     compression */
  VERIFY_LESS(record_gain(&r, "energy"), 0.1, "energy gained in a step, J");
  VERIFY_LESS(record_last(&r, "energy"), 0.1, "energy at the end, J");
  VERIFY_NEAR(record_last(&r, "centre_z"), 0.025, 0.002, "height of the centre, m");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Compressed to half its height and released in long steps near nu = 1/2, where waves change the
   pressure of a cell: the penalty that depends on it must not make the energy gain of Newmark's
   method unbounded. P1 and P2 gain 6 and 9 % of the energy in half the motion. */
static PetscErrorCode check_waves(const char *element)
{
  Record r = {0};
  TestScene t;

  PetscFunctionBeginUser;
  verify_case("waves, %s", element);
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.06,0.05,0.04:2 -body_a_element %s -body_a_material "
              "stable_neohookean "
              "-body_a_young 1e4 -body_a_poisson 0.499 -body_a_density 1000 -effects high,low "
              "-effect_high_type "
              "contact -effect_high_obstacle plane:0,0,-1,-0.0401 -effect_high_displacement "
              "0;0;-0.02*min(1,t/0.05)+0.02*max(0,min(1,(t-0.06)/0.05)) -effect_low_type contact "
              "-effect_low_obstacle "
              "plane:0,0,1,-0.0001 -time newmark -ts_dt 0.003 -ts_max_time 0.2",
              element));
  PetscCall(record_solve(&t, &r));
  VERIFY_LESS(-t.run->state.energies.integrator_loss, 0.06,
              "energy given, J, of 0.25 J when pressed");
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A cube bonded to two plates and pressed to half its height. With all of lambda by the mean of a
   tet P2 gave up 8 % of its energy between four and six cells, and needed hundreds of
   iterations. */
static PetscErrorCode check_bonded(void)
{
  PetscReal energy[2];

  PetscFunctionBeginUser;
  verify_case("bonded, p2, nu 0.4999");
  for (int k = 0; k < 2; k++) {
    Record r = {0};
    TestScene t;

    PetscCall(test_open(
      &t,
      "-bodies a -body_a_mesh box:0.1,0.1,0.1:%d -body_a_element p2 -body_a_material "
      "stable_neohookean -body_a_young 5e4 -body_a_poisson 0.4999 -effects low,top "
      "-effect_low_type fixed -effect_low_on zmin -effect_top_type prescribed_displacement "
      "-effect_top_on zmax -effect_top_displacement 0;0;-0.05 -time static -static_steps 2",
      k ? 5 : 3));
    PetscCall(record_solve(&t, &r));
    VERIFY_LESS(t.run->counters.newton, 40, "iterations");
    PetscCall(test_scene_close(&t));
    energy[k] = record_last(&r, "strain");
  }
  VERIFY_NEAR(energy[0] / energy[1], 1, 0.03, "energy with three cells across, of that with five");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_squeeze("p1", 4, 0.3, 0.35, 0));
  PetscCall(check_squeeze("cr", 2, 0.49, 0.02, 22.5));
  PetscCall(check_squeeze("cr", 3, 0.49, 0.02, 22.5));
  PetscCall(check_squeeze("p2", 2, 0.49, 0.02, 22.5));
  PetscCall(check_thrown("cr", 1e-3, 0.0551));
  PetscCall(check_thrown("cr", 2.5e-4, 0.0568));
  PetscCall(check_released("cr"));
  PetscCall(check_waves("cr"));
  PetscCall(check_bonded());
  PetscCall(check_springs("p2"));
  PetscCall(check_springs("cr"));
  SB_TEST_END();
}
