// @ranks 2 3 4
/*
  Contact on any number of ranks gives the same motion: two blocks fall on a floor and onto each
  other, next to a rigid ball that the upper one hits too, without friction. Every rank runs the
  scene alone, then all ranks run it together.

  The active set is discrete: the number of contacts of every step must be equal. Displacements,
  velocities and forces may differ by solver tolerances, which depend on the number of ranks:
  Newton's method stops at 1e-11 of the first residual of a step, and an impact amplifies earlier
  differences.
*/
#include "contact.h"

#define STEPS 60

typedef struct {
  PetscInt n;
  PetscReal *u, *v;
  Record r;
} Motion;

static PetscErrorCode solve(MPI_Comm comm, const char *element, Motion *motion)
{
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(motion, sizeof(*motion)));
  PetscCall(test_open_on(
    comm, NULL, &t,
    "-bodies low,high -body_low_mesh box:0.1,0.1,0.05:3 -body_low_material corotated "
    "-body_low_young 2e4 "
    "-body_low_poisson 0.3 -body_low_translate 0,0,0.005 -body_low_rotate 0,1,0,4 -body_high_mesh "
    "box:0.08,0.08,0.06:2 -body_high_material corotated -body_high_young 3e4 -body_high_poisson "
    "0.3 "
    "-body_high_translate 0.03,0.013,0.075 -body_high_rotate 1,1,0,10 -body_high_velocity "
    "0.3,0,-0.6 "
    "-effects gravity,floor,ball,meet -effect_floor_type contact -effect_floor_obstacle "
    "plane:0,0,1,0 "
    "-effect_ball_type contact -effect_ball_on high -effect_ball_obstacle "
    "sphere:0.17,0.05,0.07,0.04 "
    "-effect_meet_type contact -time euler_implicit -ts_dt 0.003 -ts_max_time %g -snes_rtol 1e-11 "
    "-ksp_rtol "
    "1e-10 -body_high_element %s",
    0.003 * STEPS, element));
  PetscCall(record_solve(&t, &motion->r));
  motion->n = verify_numbers(t.model);
  PetscCall(verify_gather(t.model, t.run->state.U, &motion->u));
  PetscCall(verify_gather(t.model, t.run->state.V, &motion->v));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *element, PetscReal tolerance)
{
  static const char *const contacts[3] = {"floor_contacts", "ball_contacts", "meet_contacts"};
  Motion m[2]; /* on one rank, on all ranks */
  PetscReal force[2][STEPS + 1] = {{0}};

  PetscFunctionBeginUser;
  for (int k = 0; k < 2; k++) {
    PetscCall(solve(k ? PETSC_COMM_WORLD : PETSC_COMM_SELF, element, &m[k]));
    VERIFY_NEAR(m[k].r.steps, STEPS, 0, "steps");
    for (PetscInt i = 0; i < m[k].r.n && i <= STEPS; i++)
      force[k][i] = record_at(&m[k].r, "floor_force_z", i);
  }
  for (int c = 0; c < 3; c++) {
    PetscInt other = 0;

    for (PetscInt i = 0; i < m[0].r.n && i < m[1].r.n; i++)
      other += record_at(&m[0].r, contacts[c], i) != record_at(&m[1].r, contacts[c], i);
    VERIFY_MORE(record_max(&m[0].r, contacts[c]), c == 1 ? 0 : 3, contacts[c]);
    VERIFY_NEAR(other, 0, 0, "numbers of contacts that differ");
  }
  VERIFY_LESS(verify_difference(3 * m[0].n, m[0].u, m[1].u), tolerance,
              "difference of displacements");
  VERIFY_LESS(verify_difference(3 * m[0].n, m[0].v, m[1].v), tolerance, "difference of velocities");
  VERIFY_LESS(verify_difference(STEPS + 1, force[0], force[1]), tolerance, "difference of forces");
  for (int k = 0; k < 2; k++) {
    PetscCall(PetscFree(m[k].u));
    PetscCall(PetscFree(m[k].v));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check("p1", 1e-7));
  PetscCall(check("p2", 1e-7));
  SB_TEST_END();
}
