// @ranks 1 2
/*
  A ball bounces on a plane, with implicit Euler and with generalized-alpha.

  The energy including gravity never exceeds the initial one: exactly for implicit Euler, within the
  stated fraction of the fall energy for generalized-alpha. In every step the momentum changes by
  weight and the force of the plane. For generalized-alpha these act at the stage, where M a = force
  - weight with a = a0 + alpha_m (a1 - a0), and so

      p1 - p0 = h (force - weight) + h (gamma - alpha_m) M (a1 - a0).

  No vertex is behind the plane at the end of a step, and each rebound is lower than the previous
  one.
*/
#include "contact.h"

#define G 9.81
#define RADIUS 0.05 /* m */
#define HEIGHT 0.05 /* m, height of the fall */
#define RISES 16

typedef struct {
  PetscReal alpha_m, alpha_f, gamma;
  Vec U, V, A;      /* after the last step */
  PetscReal before; /* momentum then, z, kg m/s */
  PetscReal
    missing; /* change of momentum that weight and the stage's force do not explain, kg m/s */
  PetscReal impulse; /* of the stage's force, N s */
} Bounce;

static PetscErrorCode check_momentum(SbRun run, const SbStep *step, Bounce *b)
{
  const SbModel m = run->model;
  PetscReal a0[3] = {0};
  PetscReal a1[3] = {0};
  PetscReal force = 0;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(contact_body_sums(m, b->A, PETSC_TRUE, a0));
  PetscCall(contact_body_sums(m, step->A, PETSC_TRUE, a1));

  // Interpolates to the stage, in place: S0 + alpha (S1 - S0).
  PetscCall(VecAXPBY(b->U, b->alpha_f, 1 - b->alpha_f, step->U));
  PetscCall(VecAXPBY(b->V, b->alpha_f, 1 - b->alpha_f, step->V));
  PetscCall(VecAXPBY(b->A, b->alpha_m, 1 - b->alpha_m, step->A));
  PetscCall(VecDuplicate(step->U, &R));
  PetscCall(SbModelResidual(m, step->t, b->U, b->V, b->A, PETSC_FALSE, R));
  PetscCall(contact_column_of(run, step->t, R, "floor", "force_z", &force));
  PetscCall(VecDestroy(&R));
  b->impulse += step->dt * force;
  b->missing = PetscMax(
    b->missing,
    PetscAbsReal(step->energies.momentum[2] - b->before -
                 step->dt * (force - G * m->mass + (b->gamma - b->alpha_m) * (a1[2] - a0[2]))));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Bounce *b = (Bounce *)ctx;
  PetscScalar *a;

  PetscFunctionBeginUser;
  if (step->step > 0)
    PetscCall(check_momentum(run, step, b));
  else {
    PetscCall(VecDuplicate(step->U, &b->U));
    PetscCall(VecDuplicate(step->U, &b->V));
    PetscCall(VecDuplicate(step->U, &b->A));
  }
  PetscCall(VecCopy(step->U, b->U));
  PetscCall(VecCopy(step->V, b->V));
  PetscCall(VecCopy(step->A, b->A));

  /* the integrator computes its initial acceleration after the monitors have the initial state */
  if (step->step == 0) {
    PetscCall(VecGetArray(b->A, &a));
    for (PetscInt i = 0; i < run->model->space->nnode_owned; i++)
      a[3 * i + 2] = -G;
    PetscCall(VecRestoreArray(b->A, &a));
  }
  b->before = step->energies.momentum[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* bound: energy gain relative to the energy of the fall; landings: minimum number of impacts. */
static PetscErrorCode check_bounce(const char *time, PetscReal bound, PetscInt landings)
{
  const PetscBool alpha = (PetscBool)!strcmp(time, "genalpha");
  const PetscReal rho = 0.5; /* generalized-alpha of Chung and Hulbert with this spectral radius */
  Bounce b = {.alpha_m = alpha ? (2 - rho) / (1 + rho) : 1, .alpha_f = alpha ? 1 / (1 + rho) : 1};
  Record r = {.g = G};
  PetscReal fall, rise[RISES] = {0}; /* J; largest height of the centre after each landing, m */
  PetscInt landed = 0;
  char path[512];
  TestScene t;

  PetscFunctionBeginUser;
  b.gamma = alpha ? 0.5 + b.alpha_m - b.alpha_f : 1;
  verify_case("bounce, %s", time);
  PetscCall(contact_ball_write(4, RADIUS, path));
  PetscCall(test_open(&t,
                      "-bodies a -body_a_rotate 1,2,3,20 -body_a_translate 0,0,%g -effects "
                      "gravity,floor -effect_floor_type "
                      "contact -effect_floor_response projected -effect_floor_obstacle "
                      "plane:0,0,1,0 -time %s -ts_dt 0.002 "
                      "-ts_max_time 0.8 -snes_rtol 1e-10 -ksp_rtol 1e-9" VERIFY_BODY(
                        "a", "%s", "corotated", "5e4", "0.3"),
                      RADIUS + HEIGHT, time, path));
  PetscCall(SbRunAddMonitor(t.run, watch, &b));
  PetscCall(record_solve(&t, &r));
  PetscCall(test_scene_close(&t));
  PetscCall(VecDestroy(&b.U));
  PetscCall(VecDestroy(&b.V));
  PetscCall(VecDestroy(&b.A));
  fall = G * r.mass * HEIGHT;
  for (PetscInt i = 0; i < r.n; i++) {
    const PetscBool lies = (PetscBool)(i && record_at(&r, "floor_contacts", i) > 0);

    landed += lies && (i == 1 || !(record_at(&r, "floor_contacts", i - 1) > 0));
    if (!lies && landed < RISES)
      rise[landed] = PetscMax(rise[landed], record_at(&r, "centre_z", i) - RADIUS);
  }
  VERIFY_LESS(record_max(&r, "energy") - record_at(&r, "energy", 0), bound * fall,
              "energy above that of the start, J");
  VERIFY_LESS(b.missing, 1e-8, "momentum that no force explains, kg m/s");
  VERIFY_MORE(landed, landings - 1, "landings");
  VERIFY_MORE(record_max(&r, "floor_force_z"), 3 * G * r.mass, "largest force, N");
  for (int k = 1; k < landings; k++) {
    VERIFY_MORE(rise[k], 0, "rise, m");
    VERIFY_LESS(rise[k], rise[k - 1], "rise against the one before, m");
  }
  VERIFY_LESS(record_max(&r, "floor_penetration"), 1e-6 * RADIUS, "behind the plane, m");
  verify_show("impulse, N s", b.impulse);
  verify_show("impulse by the history, N s", record_impulse(&r, "floor_force_z"));
  verify_show("largest gain of a step, of the fall", record_gain(&r, "energy") / fall);
  verify_show("lost at the end, of the fall",
              (record_at(&r, "energy", 0) - record_last(&r, "energy")) / fall);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_bounce("euler_implicit", 1e-9, 2));
  PetscCall(check_bounce("genalpha", 0.01, 3));
  SB_TEST_END();
}
