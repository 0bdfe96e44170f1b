// @ranks 1 2
/*
  Oblique frictionless collision of two free blocks: effect of contact on the angular momentum.

  Implicit Euler itself changes it. From x1 = x0 + h v1 and M (v1 - v0) = h f,

      L1 - L0 = h sum x1 x f + h sum m v1 x v0,

  where the internal forces have no torque. The difference to the last sum is the torque of the
  contact forces: it is zero because the contact energy of a pair is invariant under rotation of
  both bodies.
*/
#include "contact.h"

typedef struct {
  Vec V;              /* after the last step */
  PetscReal L[3];     /* then, kg m^2/s */
  PetscReal missing;  /* largest change that implicit Euler does not explain, kg m^2/s */
  PetscReal torque;   /* largest torque of all contact forces about the origin, times the step */
  PetscReal rest;     /* largest difference between the two */
  PetscReal given[3]; /* accumulated angular impulse of contact on the first body */
  PetscReal most;     /* its largest value */
  PetscReal contacts, momentum;
} Turn;

/* Torque of the contact forces on each body about the origin, N m: torque[2][3]. */
static PetscErrorCode torques(SbRun run, const SbStep *step, PetscReal torque[6])
{
  const SbSpace s = run->model->space;
  const PetscScalar *f, *u;
  Vec F;

  PetscFunctionBeginUser;
  PetscCall(PetscArrayzero(torque, 6));
  PetscCall(VecDuplicate(step->U, &F));
  PetscCall(SbContactSetForce(&run->model->contacts, step->t, step->U, F));
  PetscCall(VecGetArrayRead(F, &f));
  PetscCall(VecGetArrayRead(step->U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal x[3], moment[3];

    for (int k = 0; k < 3; k++)
      x[k] = s->node_x[3 * i + k] + u[3 * i + k];
    SbCross(x, f + 3 * i, moment);
    for (int k = 0; k < 3; k++)
      torque[3 * s->node_body[i] + k] += moment[k];
  }
  PetscCall(VecRestoreArrayRead(step->U, &u));
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCall(VecDestroy(&F));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, torque, 6, MPIU_REAL, MPI_SUM, run->model->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* sum m v1 x v0, N m s/s. */
static PetscErrorCode euler(SbModel m, Vec V1, Vec V0, PetscReal sum[3])
{
  const SbSpace s = m->space;
  const PetscScalar *v1, *v0;

  PetscFunctionBeginUser;
  sum[0] = sum[1] = sum[2] = 0;
  PetscCall(VecGetArrayRead(V1, &v1));
  PetscCall(VecGetArrayRead(V0, &v0));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal c[3];

    SbCross(v1 + 3 * i, v0 + 3 * i, c);
    for (int k = 0; k < 3; k++)
      sum[k] += s->node_mass[i] * c[k];
  }
  PetscCall(VecRestoreArrayRead(V0, &v0));
  PetscCall(VecRestoreArrayRead(V1, &v1));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPI_SUM, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Turn *w = (Turn *)ctx;
  const SbEnergies *e = &step->energies;
  PetscReal torque[6], own[3], contacts, missing[3], both[3];

  PetscFunctionBeginUser;
  if (step->step == 0)
    PetscCall(VecDuplicate(step->V, &w->V));
  else {
    PetscCall(euler(run->model, step->V, w->V, own));
    PetscCall(torques(run, step, torque));
    PetscCall(contact_column(run, step->t, "meet", "contacts", &contacts));
    for (int k = 0; k < 3; k++) {
      missing[k] = e->angular[k] - w->L[k] - step->dt * own[k];
      both[k] = step->dt * (torque[k] + torque[3 + k]);
      w->given[k] += step->dt * torque[k];
    }
    w->missing = PetscMax(w->missing, PetscSqrtReal(SbDot3(missing, missing)));
    w->torque = PetscMax(w->torque, PetscSqrtReal(SbDot3(both, both)));
    for (int k = 0; k < 3; k++)
      both[k] -= missing[k];
    w->rest = PetscMax(w->rest, PetscSqrtReal(SbDot3(both, both)));
    w->most = PetscMax(w->most, PetscSqrtReal(SbDot3(w->given, w->given)));
    w->contacts = PetscMax(w->contacts, contacts);
    for (int k = 0; k < 3; k++)
      w->momentum = PetscMax(w->momentum, PetscAbsReal(e->momentum[k]));
  }
  PetscCall(VecCopy(step->V, w->V));
  for (int k = 0; k < 3; k++)
    w->L[k] = e->angular[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* rest: relative error of the linear solves; CR: the force of a face under pressure is along the
   jump at the start of the step (src/fem/jump.c), which rotates slightly within the step. */
static PetscErrorCode check(const char *element, PetscReal dt, PetscReal rest)
{
  const PetscReal tolerance = 1e-12;
  Turn w = {.most = 0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(
    test_open(&t,
              "-bodies a,b -body_a_mesh box:0.1,0.1,0.1:2 -body_b_mesh box:0.1,0.08,0.1:3 "
              "-body_b_translate 0.13,0.03,0.02 -body_b_rotate 1,2,3,20 -body_a_material corotated "
              "-body_a_young 2e4 "
              "-body_a_poisson 0.3 -body_a_element %s -body_b_material corotated -body_b_young 2e4 "
              "-body_b_poisson 0.3 "
              "-body_b_element %s -body_a_velocity 0.8,0,0 -body_b_velocity -1,0,0 -effects meet "
              "-effect_meet_type contact -time euler_implicit -ts_dt %g -ts_max_time 0.1 -ksp_rtol "
              "1e-11 -snes_rtol "
              "1e-12",
              element, element, dt));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, &w));
  PetscCall(verify_solve(&t, "angular"));
  test_print(
    "  %s, steps of %g ms: bodies turned each other by %.3e kg m^2/s, off in a "
    "step by %.1e, torque of all contacts %.1e, without it %.1e, %g pairs, momentum %.1e\n",
    element, 1000 * dt, w.most, w.missing, w.torque, w.rest, w.contacts, w.momentum);
  SB_CHECK(w.contacts > 3 && w.most > 1e-4, "%s: the blocks do not meet", element);
  SB_CHECK(w.rest < rest * w.most,
           "%s: angular momentum changed by %g kg m^2/s that no contact explains", element, w.rest);
  SB_CHECK(w.torque < tolerance * w.most,
           "%s: contact changed the angular momentum by %g of %g kg m^2/s", element, w.torque,
           w.most);
  SB_CHECK(w.momentum < 1e-11, "momentum %g kg m/s", w.momentum);
  PetscCall(VecDestroy(&w.V));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("p1", 0.001, 1e-10));
  PetscCall(check("cr", 0.001, 5e-6));
  PetscCall(check("p2", 0.001, 1e-10));
  if (test_size > 1)
    SB_TEST_END(); /* many solves of a small system: on one rank only */
  PetscCall(check("p1", 0.0005, 1e-10));
  SB_TEST_END();
}
