// @ranks 1 2
/*
  A plate as thin as cloth, one cell thick, falls on a ball and drapes over it. The ball is a rigid obstacle, with friction, or a body constrained
  at its lower end, without.

  No vertex of the plate ends a step inside the rigid ball, in the other one none is deeper than 0.4 of its thickness (rows that others imply
  are not looked after); no cell is inverted, no step gives energy, momentum changes by weight and
  the force of the ball, and at the end the plate hangs down on all sides.
*/
#include "pour.h"

#define G 9.81
#define RADIUS 0.05 /* of the ball, m */
#define SIDE 0.2    /* of the plate, m */
#define THICK 0.004 /* m */
#define DROP 0.01   /* m */

/* How much lower the middle, the middles of the sides and the corners of the plate are, m; the least of their kind. */
static PetscErrorCode lowered(TestScene *t, PetscReal depth[3])
{
  static const PetscInt at[9][3] = {{0, 0, 0}, {1, 0, 1},  {-1, 0, 1}, {0, 1, 1},  {0, -1, 1},
                                    {1, 1, 2}, {1, -1, 2}, {-1, 1, 2}, {-1, -1, 2}};

  PetscFunctionBeginUser;
  depth[0] = depth[1] = depth[2] = PETSC_MAX_REAL;
  for (int k = 0; k < 9; k++) {
    const PetscReal x[3] = {0.5 * SIDE * (PetscReal)at[k][0], 0.5 * SIDE * (PetscReal)at[k][1], DROP};
    PetscReal u[3];

    PetscCall(test_value_at(t->model, t->run->U, x, u));
    depth[at[k][2]] = PetscMin(depth[at[k][2]], -u[2]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_drape(PetscBool rigid, PetscInt cells, PetscInt thick)
{
  const PetscInt n[3] = {4, 4, 4};
  ContactBall ball = {RADIUS, PETSC_FALSE};
  Pour p = {.w = {.obstacle = {rigid ? "ball" : NULL}, .meet = rigid ? NULL : "meet", .g = G}};
  const ContactWatch *const w = &p.w;
  PetscReal depth[3], weight, behind;
  char path[512], how[VERIFY_TEXT / 4];
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(verify_mesh_write(n, contact_ball, &ball, path));
  if (rigid)
    PetscCall(
      PetscSNPrintf(how, sizeof(how),
                    "-bodies cloth -effects gravity,ball -effect_ball_type contact -effect_ball_friction 0.3 "
                    "-effect_ball_obstacle sphere:0,0,%g,%g",
                    -RADIUS, RADIUS));
  else
    PetscCall(PetscSNPrintf(
      how, sizeof(how),
      "-bodies cloth,ball -body_ball_mesh %s -body_ball_translate 0,0,%g -body_ball_material corotated "
      "-body_ball_young 2e5 -body_ball_poisson 0.3 -sets foot -set_foot_at halfspace:0,0,1,%g "
      "-effects gravity,foot,meet -effect_foot_type fixed -effect_foot_on foot "
      "-effect_meet_type collision",
      path, -RADIUS, -1.6 * RADIUS));
  PetscCall(verify_open(
    &t,
    "%s -body_cloth_mesh box:%g,%g,%g:%d,%d,%d -body_cloth_translate %g,%g,%g -body_cloth_material corotated "
    "-body_cloth_young 5e3 -body_cloth_poisson 0.3 -time euler_implicit -ts_dt 0.004 -ts_max_time 0.4 "
    "-snes_rtol 1e-9 "
    "-ksp_rtol 1e-8",
    how, SIDE, SIDE, THICK, (int)cells, (int)cells, (int)thick, -0.5 * SIDE, -0.5 * SIDE, DROP));
  t.run->want_energies = PETSC_TRUE;
  PetscCall(SbRunAddMonitor(t.run, rigid ? contact_watch : pour_watch, &p, NULL));
  PetscCall(verify_solve(&t, "drape"));
  PetscCall(lowered(&t, depth));
  weight = G * 1000 * SIDE * SIDE * THICK;
  behind = PetscMax(w->behind, p.inside);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "  drape, %s, %d cells thick: corners %.4f m lower, sides %.4f m, middle %.4f m; "
                        "energy gained %.1e J in a step, %.3g J "
                        "lost; momentum off by %.1e kg m/s, penetration %.1e m, min J %.3f, fastest %.2g "
                        "m/s, %g pairs, force up to %.3g of the "
                        "weight; %d solves in %d steps, %d cut\n",
                        rigid ? "obstacle" : "body", (int)thick, (double)depth[2], (double)depth[1],
                        (double)depth[0], (double)w->gain, (double)(w->start - w->energy), (double)w->missing,
                        (double)behind, (double)w->min_J, (double)t.run->energies.max_speed,
                        (double)w->contacts, (double)(w->force / weight), (int)t.run->newton_total,
                        (int)t.run->steps_total, (int)t.run->rejected_total));
  SB_CHECK(depth[2] > depth[1] + 0.01 && depth[1] > depth[0] + 0.01 && depth[0] > 0.5 * DROP,
           "the plate does not drape: %g, %g and %g m", (double)depth[2], (double)depth[1], (double)depth[0]);
  SB_CHECK(behind < (rigid ? 1e-6 : 0.4) * THICK, "%g m inside the ball", (double)behind);
  SB_CHECK(w->min_J > 0, "a cell is inverted");
  SB_CHECK(w->gain < 1e-6 * weight * SIDE, "a step gained %g J", (double)w->gain);
  if (rigid) SB_CHECK(w->missing < 1e-5, "momentum changed by %g kg m/s without a force", (double)w->missing);
  PetscCall(test_scene_close(&t));
  PetscCall(test_file_remove(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscMPIInt size;

  SB_TEST_BEGIN(argc, argv);
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(check_drape(PETSC_TRUE, 16, 1));
  if (size == 1)
    PetscCall(check_drape(PETSC_FALSE, 16, 1)); /* many solves of a small system: on one rank only */
  SB_TEST_END();
}
