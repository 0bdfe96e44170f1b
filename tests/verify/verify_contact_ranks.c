// @ranks 2 3 4
/*
  The same contacts and the same motion on any number of ranks: two blocks fall on a floor and onto each other, beside a rigid ball that the
  upper one meets as well, without friction. Every rank runs the scene alone, then all run it together.

  Who touches is a decision: the numbers of contacts of every step must be equal. Displacements, velocities and forces differ by what the
  solvers of different rank counts leave: Newton's method ends at 1e-11 of the first residual of a step, and an impact
  multiplies what differs before it.
*/
#include "contact.h"

#define STEPS 60
#define COLUMNS 4

typedef struct {
  PetscInt n, steps;
  PetscReal *u, *v;
  PetscReal column[COLUMNS][STEPS + 1];
} Motion;

static const char *const columns[COLUMNS][2] = {
  {"floor", "contacts"}, {"ball", "contacts"}, {"meet", "contacts"}, {"floor", "force_z"}};

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Motion *m = (Motion *)ctx;

  PetscFunctionBeginUser;
  if (step->step > STEPS) PetscFunctionReturn(PETSC_SUCCESS);
  for (int c = 0; c < COLUMNS; c++)
    PetscCall(contact_column(run, step->t, columns[c][0], columns[c][1], &m->column[c][step->step]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve(MPI_Comm comm, const char *sides, Motion *motion)
{
  TestScene t;
  char text[VERIFY_TEXT];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(motion, sizeof(*motion)));
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-bodies low,high -body_low_mesh box:0.1,0.1,0.05:3 -body_low_material corotated -body_low_young 2e4 "
    "-body_low_poisson 0.3 -body_low_translate 0,0,0.005 -body_low_rotate 0,1,0,4 -body_high_mesh "
    "box:0.08,0.08,0.06:2 "
    "-body_high_material corotated -body_high_young 3e4 -body_high_poisson 0.3 -body_high_translate "
    "0.03,0.013,0.075 "
    "-body_high_rotate 1,1,0,10 -body_high_velocity 0.3,0,-0.6 -effects gravity,floor,ball,meet "
    "-effect_floor_type contact "
    "-effect_floor_obstacle plane:0,0,1,0 -effect_ball_type contact -effect_ball_on high "
    "-effect_ball_obstacle sphere:0.17,0.05,0.07,0.04 -effect_meet_type collision -effect_meet_passes %s "
    "-time euler_implicit -ts_dt 0.003 -ts_max_time %g -snes_rtol 1e-11 -ksp_rtol 1e-10",
    sides, 0.003 * STEPS));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  PetscCall(PetscOptionsInsertString(NULL, text));
  PetscCall(SbSceneCreate(comm, &t.model));
  PetscCall(test_scene_run(&t));
  PetscCall(SbModelSetUp(t.model));
  PetscCall(SbRunSetUp(t.run));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, watch, motion, NULL));
  PetscCall(verify_solve(&t, sides));
  motion->n = verify_numbers(t.model);
  motion->steps = t.run->steps_total;
  PetscCall(verify_gather(t.model, t.run->U, &motion->u));
  PetscCall(verify_gather(t.model, t.run->V, &motion->v));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check(const char *sides, PetscReal tolerance)
{
  Motion alone, together;
  PetscReal off[3], most[3] = {0};
  PetscInt other = 0;

  PetscFunctionBeginUser;
  PetscCall(solve(PETSC_COMM_SELF, sides, &alone));
  PetscCall(solve(PETSC_COMM_WORLD, sides, &together));
  off[0] = verify_difference(3 * alone.n, alone.u, together.u);
  off[1] = verify_difference(3 * alone.n, alone.v, together.v);
  off[2] = verify_difference(STEPS + 1, alone.column[3], together.column[3]);
  for (int c = 0; c < 3; c++) {
    for (int k = 0; k <= STEPS; k++) {
      most[c] = PetscMax(most[c], alone.column[c][k]);
      other += alone.column[c][k] != together.column[c][k];
    }
  }
  PetscCall(PetscPrintf(
    PETSC_COMM_WORLD,
    "  passes %s, %d steps: at most %g, %g and %g contacts with floor, ball and each other, %d numbers "
    "differ; displacement %.1e, velocity %.1e, force %.1e\n",
    sides, (int)alone.steps, (double)most[0], (double)most[1], (double)most[2], (int)other, (double)off[0],
    (double)off[1], (double)off[2]));
  SB_CHECK(alone.steps == together.steps && alone.steps == STEPS, "%s: %d and %d steps", sides,
           (int)alone.steps, (int)together.steps);
  SB_CHECK(most[0] > 3 && most[1] > 0 && most[2] > 3, "%s: something is not met", sides);
  SB_CHECK(!other, "%s: %d numbers of contacts differ", sides, (int)other);
  SB_CHECK(off[0] < tolerance && off[1] < tolerance && off[2] < tolerance,
           "%s: displacement differs by %g, velocity by %g, force by %g", sides, (double)off[0],
           (double)off[1], (double)off[2]);
  PetscCall(PetscFree(alone.u));
  PetscCall(PetscFree(alone.v));
  PetscCall(PetscFree(together.u));
  PetscCall(PetscFree(together.v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check("two", 1e-7));
  if (size == 2) PetscCall(check("one", 1e-7));
  SB_TEST_END();
}
