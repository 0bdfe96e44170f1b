// @ranks 1 3
/*
  Effects on bodies of every element, in complete runs.

    supports    a bar under its weight and a traction: reaction and its moment balance the loads;
    with DG, supports by
                penalty and by the mean displacement converge to the same solution with the order of
                the method
    drive       both ends of a bar move and rotate by prescribed displacements: it follows without
    strain and without reaction mixed       bodies of different elements in one scene: each support
    carries its own body flight      initial velocity and spin of a free body: momenta are those of
    the rigid body initially, and are conserved motion      a clamped bar oscillates: energy is
    conserved with Newmark; symplectic Euler agrees with it, below its largest step pressure    a
    body under pressure on its whole surface does not move
*/
#include "verify.h"

#define BODY " -body_a_young 1e5 -body_a_poisson 0.3 -body_a_density 1000 "
#define EXACT " -ksp_rtol 1e-13 -snes_rtol 1e-13 -snes_stol 0 "

/* Name in messages and options of body a. */
static const char *const kinds[][2] = {
  {"p1", " -body_a_element p1"},      {"cr", " -body_a_element cr"},
  {"dg weak", " -body_a_element dg"}, {"dg strong", " -body_a_element dg -body_a_dirichlet strong"},
  {"p2", " -body_a_element p2"},
};
#define NKIND ((int)PETSC_STATIC_ARRAY_LENGTH(kinds))

/* Force, N, of the residual at prescribed unknowns of a body, and its moment, N m, about the origin
   of the reference configuration. */
static PetscErrorCode reaction(const TestScene *t, PetscInt body, PetscReal sum[6])
{
  const SbSpace s = t->model->space;
  const PetscScalar *r;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &R));
  PetscCall(SbModelResidual(t->model, 1., t->run->state.U, NULL, NULL, PETSC_FALSE, R));
  PetscCall(VecGetArrayRead(R, &r));
  PetscCall(PetscArrayzero(sum, 6));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal *x = s->node_x + 3 * i;
    PetscReal f[3];

    if (s->node_body[i] != body || !s->fixed[i])
      continue;
    for (int k = 0; k < 3; k++)
      f[k] = s->fixed[i] & (1 << k) ? r[3 * i + k] : 0.;
    for (int k = 0; k < 3; k++) {
      sum[k] += f[k];
      sum[3 + k] += x[(k + 1) % 3] * f[(k + 2) % 3] - x[(k + 2) % 3] * f[(k + 1) % 3];
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 6, MPIU_REAL, MPI_SUM, t->model->comm));
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscCall(VecDestroy(&R));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ supports */

/* Strain energy of a bar of n cells across, kind as above. Small strains: equilibrium in the
   reference configuration. */
static PetscErrorCode bar(int kind, PetscInt n, PetscReal *strain)
{
  // 2 kg at (.1, .05, .05), and 3 N along y, 6 N along z spread over the end x = 0.2.
  const PetscReal w = 2 * 9.81;
  const PetscReal balance[6] = {0, -3, w - 6, 0.05 * (w - 6 + 3), 0.2 * 6 - 0.1 * w, -0.2 * 3};
  PetscReal sum[6];
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.2,0.1,0.1:%d" BODY
              "%s -body_a_material linear -effects gravity,clamp,pull -effect_clamp_type fixed "
              "-effect_clamp_on xmin -effect_pull_type traction -effect_pull_on xmax "
              "-effect_pull_total 0,3,6 -time static -solver direct" EXACT,
              (int)n, kinds[kind][1]));
  PetscCall(verify_solve(&t, kinds[kind][0]));
  PetscCall(reaction(&t, 0, sum));
  for (int k = 0; k < 6; k++)
    SB_CHECK_NEAR(sum[k], balance[k], 1e-8, kinds[kind][0]);
  PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &e));
  *strain = e.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_supports(void)
{
  PetscReal strain[NKIND][2], difference[2];

  PetscFunctionBeginUser;
  for (int kind = 0; kind < NKIND; kind++)
    for (int k = 0; k < 2; k++)
      PetscCall(bar(kind, k ? 4 : 2, &strain[kind][k]));
  for (int k = 0; k < 2; k++)
    difference[k] = PetscAbsReal(strain[2][k] / strain[3][k] - 1.);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  supports: strain energy of weak and strong ones differs by %.1e, %.1e "
                        "on a mesh half as wide\n",
                        difference[0], difference[1]));

  /* second order: a quarter; the tolerance covers the singular stress at the edge of the clamp */
  SB_CHECK(difference[0] < 5e-3 && difference[1] < 0.35 * difference[0],
           "weak and strong supports differ by %g, %g", difference[0], difference[1]);

  /* the singular edge again: all elements are within a few percent, P1 is stiff */
  for (int kind = 1; kind < 4; kind++)
    SB_CHECK_NEAR(strain[kind][1] / strain[3][1], 1, 2e-3, kinds[kind][0]);
  SB_CHECK(strain[0][1] < strain[1][1], "P1 is softer than CR");

  /* P2 against itself on 12 cells across: -0.19 % on 4, where DG has +1.05 % */
  SB_CHECK_NEAR(strain[4][1] / 0.038789, 1, 3e-3, "P2");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ drive */

static PetscErrorCode check_drive(int kind)
{
  PetscReal sum[6];
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(
    &t,
    "-bodies a -body_a_mesh box:0.2,0.1,0.1:2" BODY
    "%s -body_a_material corotated -effects hand -effect_hand_type prescribed_displacement "
    "-effect_hand_on xmin,xmax -effect_hand_angle 40*t -effect_hand_axis 1,2,3 "
    "-effect_hand_axis_point 0.1,0,0 -effect_hand_displacement t;0;0.5*t -time static "
    "-static_steps 4 "
    "-solver direct" EXACT,
    kinds[kind][1]));
  PetscCall(verify_solve(&t, kinds[kind][0]));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, NULL, &e));
  PetscCall(reaction(&t, 0, sum));

  // Rounding: stresses of 1e-16 E on 0.1 x 0.1 m, strains of 1e-16; plus Newton's tolerance.
  SB_CHECK_NEAR(e.strain, 0, 1e-12, kinds[kind][0]);
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(sum[k], 0, 1e-7, kinds[kind][0]);

  // Every node follows, interior ones too.
  {
    const SbSpace s = t.model->space;
    const PetscScalar *x;
    PetscReal R[9];
    PetscReal away = 0.;

    verify_rotation((const PetscReal[3]){1, 2, 3}, 40. * PETSC_PI / 180., R);
    PetscCall(VecGetArrayRead(t.run->state.U, &x));
    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      const PetscReal r[3] = {s->node_x[3 * i] - 0.1, s->node_x[3 * i + 1], s->node_x[3 * i + 2]};
      const PetscReal move[3] = {1, 0, 0.5};
      PetscReal y[3];

      verify_apply(R, r, y);
      for (int k = 0; k < 3; k++)
        away = PetscMax(away, PetscAbsReal(x[3 * i + k] - (move[k] + y[k] - r[k])));
    }
    PetscCall(VecRestoreArrayRead(t.run->state.U, &x));
    SB_CHECK(away < 1e-9, "%s: a node is %g m from where the drive takes it", kinds[kind][0], away);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ mixed */

static PetscErrorCode check_mixed(void)
{
  const char *element[] = {"p1", "cr", "dg", "p2"};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(
    "-bodies a,b,c,d -body_a_mesh box:0.2,0.1,0.1:2 -body_b_mesh box:0.1,0.2,0.1:2 -body_c_mesh "
    "box:0.1,0.1,0.2:2 -body_d_mesh box:0.2,0.1,0.1:1 -body_d_material stvk -body_d_element p2 "
    "-body_d_translate 0,2,0 -body_d_young 1e5 -body_d_poisson 0.4 -body_d_density 200 "
    "-body_a_material "
    "linear -body_b_material corotated -body_c_material stable_neohookean -body_b_element cr "
    "-body_c_element dg "
    "-body_b_translate 1,0,0 -body_c_translate 2,0,0" BODY
    "-body_b_young 2e5 -body_c_young 1e5 -body_b_poisson 0.3 -body_c_poisson 0.45 -body_b_density "
    "500 "
    "-body_c_density 250 -sets low,tip -set_low_at plane:0,0,1,0 -effects gravity,stand,poke "
    "-effect_stand_type fixed -effect_stand_on low -effect_poke_type point_force -effect_poke_on "
    "tip "
    "-effect_poke_vector 0.01;0.02;0.03 -time static -solver direct "
    "-set_tip_at box:-1,-1,0.09,3,1,1" EXACT,
    &t));
  PetscCall(verify_solve(&t, "four bodies"));
  for (PetscInt b = 0; b < 4; b++) {
    const PetscReal density[] = {1000, 500, 250, 200};
    PetscReal sum[6];

    // 5 x 3 vertices of a and of b are in the set, three layers of 9 of c, and none of d.
    const PetscReal poke = (b < 2 ? 15. : b == 2 ? 27. : 0.) / 57.;

    PetscCall(reaction(&t, b, sum));
    SB_CHECK_NEAR(sum[0], -0.01 * poke, 1e-9, element[b]);
    SB_CHECK_NEAR(sum[1], -0.02 * poke, 1e-9, element[b]);
    SB_CHECK_NEAR(sum[2], 9.81 * density[b] * 2e-3 - 0.03 * poke, 1e-8, element[b]);
  }
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ flight */

typedef struct {
  PetscReal start[6], worst; /* momenta; largest deviation of linear momentum, kg m/s */
} Flight;

static PetscErrorCode watch_flight(SbRun run, const SbStep *step, void *ctx)
{
  Flight *f = (Flight *)ctx;
  SbEnergies e;

  PetscFunctionBeginUser;
  PetscCall(SbModelEnergies(run->model, step->U, step->V, &e));
  for (int k = 0; k < 3 && step->step == 0; k++) {
    f->start[k] = e.momentum[k];
    f->start[3 + k] = e.angular[k];
  }
  for (int k = 0; k < 3; k++) {
    f->worst = PetscMax(f->worst, PetscAbsReal(e.momentum[k] - f->start[k]));
    f->worst = PetscMax(f->worst, PetscAbsReal(e.angular[k] - f->start[3 + k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_flight(int kind, const char *mass)
{
  Flight f = {.worst = 0.};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.2,0.1,0.1:4" BODY
              "%s -body_a_material corotated -body_a_velocity 1,2,3 "
              "-body_a_angular_velocity 3,0,0 -mass %s -time euler_symplectic -ts_max_time 0.01",
              kinds[kind][1], mass));
  PetscCall(SbRunAddMonitor(t.run, watch_flight, &f));
  PetscCall(verify_solve(&t, kinds[kind][0]));
  SB_CHECK(t.run->counters.steps > 5, "%d steps", (int)t.run->counters.steps);
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(f.start[k], 2 * (k + 1), 1e-12, "momentum at the start");

  /* 2 kg about its long axis: J w = 2 (0.1^2 + 0.1^2) / 12 * 3 with its mass everywhere; then r
     cross p of the centre */
  if (mass[0] == 'c')
    SB_CHECK_NEAR(f.start[3], 0.01 + 0.05 * 6 - 0.05 * 4, 1e-12, "angular momentum at the start");
  SB_CHECK_NEAR(f.start[4], 0.05 * 2 - 0.1 * 6, 1e-12, "angular momentum at the start");
  SB_CHECK(f.worst < 1e-11, "%s: momenta change by %g", kinds[kind][0], f.worst);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ motion */

/* A clamped bar with an initial upward velocity: the sum of energies and the strain energy at the
   end. */
static PetscErrorCode swing(int kind, const char *time, PetscReal energy[2])
{
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_open(&t,
                      "-bodies a -body_a_mesh box:0.2,0.1,0.1:2" BODY
                      "%s -body_a_material linear -body_a_velocity 0,0,0.1 -effects clamp "
                      "-effect_clamp_type fixed -effect_clamp_on xmin -ts_max_time 0.02 %s",
                      kinds[kind][1], time));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &e));
  energy[0] = e.kinetic + e.strain;
  PetscCall(verify_solve(&t, kinds[kind][0]));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &e));
  energy[0] = (e.kinetic + e.strain) / energy[0];
  energy[1] = e.strain;
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_motion(int kind)
{
  PetscReal implicit[2], explicit[2];

  PetscFunctionBeginUser;
  PetscCall(swing(kind, "-time newmark -ts_dt 2e-4 -solver direct" EXACT, implicit));
  SB_CHECK_NEAR(implicit[0], 1, 1e-10, kinds[kind][0]);
  PetscCall(swing(kind, "-time euler_symplectic", explicit));
  test_print("  %s: strain energy at the end %.6g by Newmark, %.6g by symplectic Euler\n",
             kinds[kind][0], implicit[1], explicit[1]);

  /* the steps resolve the oscillation, not the fastest waves that the start excites in the bar */
  SB_CHECK_NEAR(explicit[1] / implicit[1], 1, 0.05, kinds[kind][0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ pressure */

static PetscErrorCode check_pressure(int kind)
{
  SbEnergies e;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a -body_a_mesh box:0.2,0.1,0.1:2" BODY
              "%s -body_a_material stable_neohookean -body_a_angular_velocity 0,0,20 -effects sea "
              "-effect_sea_type pressure -effect_sea_on boundary -effect_sea_value 2e4 "
              "-time euler_implicit -ts_dt 5e-3 -ts_max_time 0.05 -solver direct" EXACT,
              kinds[kind][1]));
  PetscCall(verify_solve(&t, kinds[kind][0]));
  PetscCall(SbModelEnergies(t.model, t.run->state.U, t.run->state.V, &e));
  for (int k = 0; k < 3; k++)
    SB_CHECK_NEAR(e.momentum[k], 0, 1e-10, kinds[kind][0]);

  /* p / (3 K) = 2e4 * 3 (1 - 0.6) / (3 * 1e5) in each direction, not yet reached, and with
     extension by the spin */
  SB_CHECK(e.volume < 0.95 * 2e-3 && e.volume > 0.6 * 2e-3, "%s: volume %g", kinds[kind][0],
           e.volume);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_supports());
  PetscCall(check_mixed());
  for (int kind = 0; kind < NKIND; kind++) {
    PetscCall(check_drive(kind));
    PetscCall(check_motion(kind));
    if (kind == 3)
      continue; // without a support like dg weak
    PetscCall(check_flight(kind, "lumped"));
    PetscCall(check_flight(kind, "consistent"));
    PetscCall(check_pressure(kind));
  }
  SB_TEST_END();
}
