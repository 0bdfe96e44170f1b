// @ranks 1 2
/*
  A ball is dropped on a plane and bounces, with implicit Euler and with generalized-alpha.

  Energy with the potential of gravity never exceeds that of the start: at all by implicit Euler, but for the stated part of the fall's
  energy by generalized-alpha. In every step momentum changes by weight and the force of the plane. For generalized-alpha these act at
  the stage, where M a = force - weight with a = a0 + alpha_m (a1 - a0), and so

      p1 - p0 = h (force - weight) + h (gamma - alpha_m) M (a1 - a0).

  No vertex ends a step behind the plane, and each rise is lower than the one before.
*/
#include "contact.h"

#define G 9.81
#define RADIUS 0.05 /* m */
#define HEIGHT 0.05 /* m, of the fall */
#define RISES 16

typedef struct {
  ContactWatch w;
  PetscReal alpha_m, alpha_f, gamma;
  Vec U, V, A;           /* after the last step */
  PetscReal missing;     /* change of momentum that weight and the stage's force do not explain, kg m/s */
  PetscReal impulse;     /* of the stage's force, N s */
  PetscReal rise[RISES]; /* highest place of the centre after each landing, m */
} Bounce;

static PetscErrorCode total(SbModel m, Vec A, PetscReal *sum)
{
  PetscReal all[3];

  PetscFunctionBeginUser;
  PetscCall(contact_body_sums(m, A, PETSC_TRUE, all));
  *sum = all[2];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* S = S0 + alpha (S1 - S0), in the place of S0. */
static PetscErrorCode to_stage(PetscReal alpha, Vec S0, Vec S1)
{
  PetscFunctionBeginUser;
  PetscCall(VecAXPBY(S0, alpha, 1 - alpha, S1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_momentum(SbRun run, const SbStep *step, PetscReal before, Bounce *b)
{
  const SbModel m = run->model;
  const PetscReal weight = G * m->mass;
  PetscReal a0 = 0, a1 = 0, force = 0;
  Vec R;

  PetscFunctionBeginUser;
  PetscCall(total(m, b->A, &a0));
  PetscCall(total(m, step->A, &a1));
  PetscCall(to_stage(b->alpha_f, b->U, step->U));
  PetscCall(to_stage(b->alpha_f, b->V, step->V));
  PetscCall(to_stage(b->alpha_m, b->A, step->A));
  PetscCall(VecDuplicate(step->U, &R));
  PetscCall(SbModelResidual(m, step->t, b->U, b->V, b->A, PETSC_FALSE, R));
  PetscCall(contact_column_of(run, step->t, R, "floor", "force_z", &force));
  PetscCall(VecDestroy(&R));
  b->impulse += step->dt * force;
  b->missing =
    PetscMax(b->missing, PetscAbsReal(step->energies.momentum[2] - before -
                                      step->dt * (force - weight + (b->gamma - b->alpha_m) * (a1 - a0))));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The acceleration that the integrator begins with, which it finds after the monitors have seen the start. */
static PetscErrorCode fall_freely(SbModel m, Vec A)
{
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(A, &a));
  for (PetscInt i = 0; i < m->space->nnode_owned; i++) a[3 * i + 2] = -G;
  PetscCall(VecRestoreArray(A, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Bounce *b = (Bounce *)ctx;
  const PetscReal before = b->w.momentum[2];

  PetscFunctionBeginUser;
  PetscCall(contact_watch(run, step, &b->w));
  if (step->step > 0)
    PetscCall(check_momentum(run, step, before, b));
  else {
    PetscCall(VecDuplicate(step->U, &b->U));
    PetscCall(VecDuplicate(step->U, &b->V));
    PetscCall(VecDuplicate(step->U, &b->A));
  }
  PetscCall(VecCopy(step->U, b->U));
  PetscCall(VecCopy(step->V, b->V));
  PetscCall(VecCopy(step->A, b->A));
  if (step->step == 0) PetscCall(fall_freely(run->model, b->A));
  if (!b->w.lands && b->w.landings < RISES)
    b->rise[b->w.landings] = PetscMax(b->rise[b->w.landings], step->energies.centre[2] - RADIUS);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bounds: energy above the start as a part of that of the fall; how many landings there must be. */
static PetscErrorCode check_bounce(const char *time, PetscReal bound, PetscInt landings)
{
  const PetscBool alpha = (PetscBool)!strcmp(time, "genalpha");
  const PetscReal rho = 0.5; /* generalized-alpha of Chung and Hulbert with this spectral radius */
  const PetscInt n[3] = {4, 4, 4};
  ContactBall ball = {RADIUS, PETSC_FALSE};
  Bounce b = {.w = {.obstacle = {"floor"}, .g = G}};
  PetscReal fall, weight;
  char path[512];
  TestScene t;

  PetscFunctionBeginUser;
  b.alpha_m = alpha ? (2 - rho) / (1 + rho) : 1;
  b.alpha_f = alpha ? 1 / (1 + rho) : 1;
  b.gamma = alpha ? 0.5 + b.alpha_m - b.alpha_f : 1;
  PetscCall(verify_mesh_write(n, contact_ball, &ball, path));
  PetscCall(verify_open(
    &t,
    "-bodies a -body_a_mesh %s -body_a_material corotated -body_a_young 5e4 -body_a_poisson 0.3 "
    "-body_a_density 1000 "
    "-body_a_rotate 1,2,3,20 -body_a_translate 0,0,%g -effects gravity,floor -effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,0 -time %s -ts_dt 0.002 -ts_max_time 0.8 -snes_rtol 1e-10 -ksp_rtol "
    "1e-9",
    path, RADIUS + HEIGHT, time));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &b, NULL));
  PetscCall(verify_solve(&t, time));
  weight = G * t.model->mass;
  fall = weight * HEIGHT;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  bounce, %s: %d landings, rises of %.4f %.4f %.4f %.4f m, energy at most %.1e of "
                        "the fall's above the start, "
                        "%.1e gained in a step, now %.3f lost; momentum off by %.1e kg m/s; impulse %.4f N s "
                        "(history %.4f), largest force "
                        "%.3g of the weight; penetration %.1e m; %d solves in %d steps, %d cut\n",
                        time, (int)b.w.landings, (double)b.rise[0], (double)b.rise[1], (double)b.rise[2],
                        (double)b.rise[3], (double)(b.w.most / fall), (double)(b.w.gain / fall),
                        (double)((b.w.start - b.w.energy) / fall), (double)b.missing, (double)b.impulse,
                        (double)b.w.impulse, (double)(b.w.force / weight), (double)b.w.behind,
                        (int)t.run->newton_total, (int)t.run->steps_total, (int)t.run->rejected_total));
  SB_CHECK(b.w.most <= bound * fall, "%s: energy is %g J above that of the start", time, (double)b.w.most);
  SB_CHECK(b.missing < 1e-8, "%s: momentum changed by %g kg m/s without a force", time, (double)b.missing);
  SB_CHECK(b.w.landings >= landings && b.w.force > 3 * weight, "%s: %d landings, %g N", time,
           (int)b.w.landings, (double)b.w.force);
  for (int k = 1; k <= landings - 1; k++)
    SB_CHECK(b.rise[k] > 0 && b.rise[k] < b.rise[k - 1], "%s: rise %d is %g m, the one before %g m", time, k,
             (double)b.rise[k], (double)b.rise[k - 1]);
  SB_CHECK(b.w.behind < 1e-6 * RADIUS, "%s: %g m behind the plane", time, (double)b.w.behind);
  PetscCall(VecDestroy(&b.U));
  PetscCall(VecDestroy(&b.V));
  PetscCall(VecDestroy(&b.A));
  PetscCall(test_scene_close(&t));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_bounce("euler_implicit", 1e-9, 2));
  PetscCall(check_bounce("genalpha", 0.01, 3));
  SB_TEST_END();
}
