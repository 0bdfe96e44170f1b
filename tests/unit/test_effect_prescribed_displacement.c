/*
  Prescribed displacement: translation by formulas and by a table, rotation about an axis off the
  origin, both at once, single components; reaction and torque; every element, and supports of DG
  faces.
*/
// @ranks 1 3
#include "effect_fixture.h"
#include "../file.h"

static const char *const sets[][2] = {{"top", "plane:0,0,1,1"}, {"bottom", "plane:0,0,1,0"}};

/* Prescribed values of the effect at time t against the function `expected`; nodes of other sets
   are ignored. */
static PetscErrorCode check_values(Fixture *x, SbEffect e, PetscReal t, PetscReal z, int components,
                                   void (*expected)(const PetscReal X[3], PetscReal t,
                                                    PetscReal u[3]))
{
  PetscInt n = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < 3 * x->space->nfixed; i++)
    x->space->fixed_value[i] = -77;
  PetscCall((*e->ops.prescribe)(e, x->space, t));
  for (PetscInt k = 0; k < x->space->nfixed; k++) {
    const PetscReal *X = &x->space->node_x[3 * x->space->fixed_node[k]];
    PetscReal u[3];

    (*expected)(X, t, u);
    for (int c = 0; c < 3; c++) {
      const PetscBool held =
        (components & (1 << c)) && PetscAbsReal(X[2] - z) < 1e-9 ? PETSC_TRUE : PETSC_FALSE;

      SB_CHECK_NEAR(x->space->fixed_value[3 * k + c], held ? u[c] : -77, 1e-15,
                    "prescribed displacement");
      n += held;
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(n > 0, "no value was checked");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rotation by 90 t degrees about the axis through (1, 0, 0) along +z, and translation by t / 2
   along it. */
static void turn_and_lift(const PetscReal X[3], PetscReal t, PetscReal u[3])
{
  const PetscReal a = t * PETSC_PI / 2;
  const PetscReal r[2] = {X[0] - 1, X[1]};

  u[0] = PetscCosReal(a) * r[0] - PetscSinReal(a) * r[1] - r[0];
  u[1] = PetscSinReal(a) * r[0] + PetscCosReal(a) * r[1] - r[1];
  u[2] = t / 2;
}

/* x is given by a table: 0 to 3 m within 2 s, then constant; z is scaled with the position. */
static void table_and_stretch(const PetscReal X[3], PetscReal t, PetscReal u[3])
{
  u[0] = 1.5 * PetscMin(t, 2);
  u[1] = 0;
  u[2] = t * X[0] * X[1];
}

/* A residual tangential to the axis of the effect: force k x (x - c) at each node of the top, in
   the reference state and after rotation. */
static PetscErrorCode check_torque(Fixture *x, SbEffect e)
{
  const PetscReal n = x->space->faces ? 8 : 9; // nodes of the top
  PetscReal mine[4], all[4];
  PetscReal expected = 0;
  const SbStage stage = {.u = x->u};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < x->space->nnode; i++) {
    const PetscReal *X = &x->space->node_x[3 * i];

    turn_and_lift(X, 1, &x->u[3 * i]);
    x->f[3 * i + 0] = -(X[1] + x->u[3 * i + 1]);
    x->f[3 * i + 1] = X[0] + x->u[3 * i] - 1;
    x->f[3 * i + 2] = 1;
  }
  if (!x->space->faces) {
    // Moment of k x r about k: r^2, over 3 x 3 nodes at distances (x - 1)^2 + y^2.
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        expected += (0.5 * i - 1) * (0.5 * i - 1) + 0.25 * j * j;
  } else {
    // The eight triangles of the top: relative to its centre their centroids are at 1/6 and 1/3
    // along x and y, however the diagonals run; so (x - 1)^2 and y^2 both sum to 4 (1/36 + 1/9) +
    // 8/4.
    expected = 46.0 / 9;
  }
  PetscCall((*e->ops.history)(e, x->space, &stage, x->f, mine));
  PetscCallMPI(MPI_Allreduce(mine, all, 4, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK_NEAR(all[2], n, 1e-14, "reaction along the axis");
  SB_CHECK_NEAR(all[3], expected, 1e-13, "torque");

  // A rotation by 90 degrees rotates the sum of forces: r sums to n (-.5, .5), rotated to n (-.5,
  // -.5), k x r to n (.5, -.5).
  SB_CHECK_NEAR(all[0], 0.5 * n, 1e-13, "reaction x");
  SB_CHECK_NEAR(all[1], -0.5 * n, 1e-13, "reaction y");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_element(const char *element, PetscBool held)
{
  Fixture x;
  SbEffect twist, pull;
  char table[512], options[1024];
  FILE *file;

  PetscFunctionBeginUser;
  fixture_use(element, element, held);
  PetscCall(test_file_open(".txt", table, &file));
  if (file)
    fprintf(file, "# t x\n0 0\n2, 3\n");
  PetscCall(test_file_close(file));
  PetscCall(
    fixture_create(PETSC_COMM_WORLD, 1, "box:1,1,1:2", PETSC_STATIC_ARRAY_LENGTH(sets), sets, &x));
  PetscCall(effect_create(
    &x, "twist",
    "-effect_twist_type prescribed_displacement -effect_twist_on top -effect_twist_angle 90*t "
    "-effect_twist_axis 0,0,2 -effect_twist_axis_point 1,0,0 -effect_twist_displacement 0;0;t/2",
    &twist));
  PetscCall(PetscSNPrintf(options, sizeof(options),
                          "-effect_pull_type prescribed_displacement -effect_pull_on bottom "
                          "-effect_pull_components xz -effect_pull_displacement table:%s;0;t*x*y",
                          table));
  PetscCall(effect_create(&x, "pull", options, &pull));
  PetscCall(SbSpacePrescribeDone(x.space));
  SB_CHECK(!twist->steady && twist->linear && !twist->ops.force && twist->ncolumn == 4,
           "a drive moves with time");
  for (int k = 0; k < 4; k++) {
    PetscCall(check_values(&x, twist, 0.75 * k, 1, 7, turn_and_lift));
    PetscCall(check_values(&x, pull, 0.75 * k, 0, 5, table_and_stretch));
  }
  PetscCall(check_torque(&x, twist));
  PetscCall(SbEffectDestroy(&twist));
  PetscCall(SbEffectDestroy(&pull));
  PetscCall(fixture_destroy(&x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(fixture_register());
  PetscCall(check_element("p1", PETSC_FALSE));
  PetscCall(check_element("cr", PETSC_FALSE));
  PetscCall(check_element("dg", PETSC_FALSE));
  PetscCall(check_element("dg", PETSC_TRUE));
  SB_TEST_END();
}
