// history.csv: columns, exact values, effects and probes, which rows are written, continuation
// after a restart.
#include "output_fixture.h"

static char dir[512];

/* Column `name` of row `row` (0 is the first row of numbers) of the file; NAN if it is absent. */
static PetscReal value_of(const char *text, const char *name, int row)
{
  const size_t length = strlen(name);
  int column = 0;
  int found = -1;
  const char *p;
  const char *end = strchr(text, '\n');

  for (p = text; p < end; p += strcspn(p, ",\n") + 1, column++)
    if (strcspn(p, ",\n") == length && !strncmp(p, name, length))
      found = column;
  if (found < 0)
    return NAN;
  for (p = end + 1; *p == '#' || row-- > 0; p = strchr(p, '\n') + 1)
    if (!strchr(p, '\n'))
      return NAN;
  for (column = 0; column < found; column++)
    p += strcspn(p, ",\n") + 1;
  return strtod(p, NULL);
}

static PetscInt count_rows(const char *text)
{
  PetscInt n = 0;

  for (const char *p = text; (p = strchr(p, '\n')); p++)
    n += p[1] && p[1] != '#';
  return n;
}

static PetscErrorCode test_values(void)
{
  TestScene scene;
  char *text, *units;
  int columns[2] = {1, 1};
  PetscReal x[3], u[3], v[3], a[3];

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir,
    HELD EULER
    "-output_fields none -probes tip,near -probe_tip_at 0.4,0.1,0.2 -probe_near_at 0.29,0.04,0.12",
    &scene));
  SB_CHECK(scene.run->monitors.want_energies && scene.run->monitors.want_residual,
           "energies and residual are not asked for");
  for (PetscInt k = 0; k <= 3; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 3)));
  PetscCall(fixture_read(dir, "history.csv", &text));
  SB_CHECK(count_rows(text) == 4, "%d rows", (int)count_rows(text));
  SB_CHECK(value_of(text, "step", 2) == 2, "step");
  SB_CHECK(value_of(text, "time", 3) == 3 * 0.1, "time %.17g", value_of(text, "time", 3));
  SB_CHECK(value_of(text, "dt", 0) == 0 && value_of(text, "dt", 1) == 0.1, "dt");
  SB_CHECK(value_of(text, "kinetic", 2) == 102 && value_of(text, "strain", 2) == 202, "energies");
  SB_CHECK(value_of(text, "total", 2) == 102. + 202. - 302. - 400., "total %g",
           value_of(text, "total", 2));
  SB_CHECK(value_of(text, "min_J", 1) == 1. / 3., "a third has lost digits: %.17g",
           value_of(text, "min_J", 1));
  SB_CHECK(value_of(text, "inverted", 1) == 7 && value_of(text, "newton", 1) == 2 &&
             value_of(text, "linear", 1) == 30,
           "counts");

  // 2 x 3 constrained vertices, 0.5 N each
  SB_CHECK_NEAR(value_of(text, "hold_reaction_y", 1), 3., 1e-14, "sum of the reactions");
  x[0] = 0.4, x[1] = 0.1, x[2] = 0.2;
  motion(x, 0.2, u, v, a);
  SB_CHECK_NEAR(value_of(text, "tip_ux", 2), u[0], 1e-16, "probe tip");
  SB_CHECK_NEAR(value_of(text, "tip_uy", 2), u[1], 1e-16, "probe tip");
  x[0] = 0.3, x[1] = 0., x[2] = 0.1; // the nearest vertex of the box
  motion(x, 0.2, u, v, a);
  SB_CHECK_NEAR(value_of(text, "near_ux", 2), u[0], 1e-16, "probe near");
  units = strchr(text, '\n') + 1;
  SB_CHECK(!strncmp(units, "#1,s,s,J,", 9), "the second line is not units: %.20s", units);
  for (char *p = text; *p != '\n'; p++)
    columns[0] += *p == ',';
  for (char *p = units; *p != '\n'; p++)
    columns[1] += *p == ',';
  SB_CHECK(columns[0] == columns[1], "%d names, %d units", columns[0], columns[1]);
  PetscCall(PetscFree(text));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of equidistant vertices the one with the smallest original number is selected, on any number of
   ranks. */
static PetscErrorCode test_tie(void)
{
  TestScene scene;
  SbProbe *probe;
  const PetscReal middle[3] = {0.05, 0.05, 0.05};
  PetscInt expected = PETSC_MAX_INT;
  SbMesh mesh;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir, BOX EULER "-output_fields none -probes p -probe_p_at 0.05,0.05,0.05", &scene));
  probe = ((SbOutput)scene.run->monitors.output)->probe;
  mesh = scene.model->mesh;
  for (PetscInt i = 0; i < mesh->nvert_owned; i++) {
    PetscBool corner = PETSC_TRUE; // of the first small cube
    for (int c = 0; c < 3; c++)
      corner = (PetscBool)(corner && PetscAbsReal(PetscAbsReal(mesh->x[3 * i + c] - middle[c]) -
                                                  0.05) < 1e-9);
    if (corner)
      expected = PetscMin(expected, mesh->vert_orig[i]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &expected, 1, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD));

  // the eight corners are equally near but for rounding
  SB_CHECK_NEAR(PetscAbsReal(probe->x[0] - 0.05), 0.05, 1e-12, "the probe sits at a corner");
  SB_CHECK(probe->original >= expected, "vertex %d, smallest corner %d", (int)probe->original,
           (int)expected);
  SB_CHECK(probe->local < 0 || mesh->vert_orig[probe->local] == probe->original,
           "the owner holds another vertex");
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_every(void)
{
  TestScene scene;
  char *text;

  PetscFunctionBeginUser;
  PetscCall(
    test_scene_open_in(dir, BOX EULER "-output_fields none -output_history_every 4", &scene));
  for (PetscInt k = 0; k <= 10; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 10)));
  PetscCall(fixture_read(dir, "history.csv", &text));
  SB_CHECK(count_rows(text) == 4 && value_of(text, "step", 2) == 8 &&
             value_of(text, "step", 3) == 10,
           "every fourth row and the last: %d rows", (int)count_rows(text));
  PetscCall(PetscFree(text));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A row without its end, as after a kill: it and the rows after the checkpoint are removed, the
   others remain. */
static PetscErrorCode test_restart(void)
{
  TestScene scene;
  char *text, path[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  PetscCall(
    test_scene_open_in(dir, BOX EULER "-output_fields none -checkpoint_every_steps 4", &scene));
  for (PetscInt k = 0; k <= 6; k++)
    PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
  PetscCall(test_scene_close(&scene));
  if (!test_rank) {
    FILE *f;

    SbFormat(sizeof(path), path, "%s/history.csv", dir);
    f = fopen(path, "a");
    (void)fprintf(f, "7,0.7,0.1,10");
    (void)fclose(f);
  }
  PetscCall(test_scene_open_in(dir, BOX EULER "-output_fields none -restart latest", &scene));
  PetscCall(fixture_read(dir, "history.csv", &text));
  SB_CHECK(count_rows(text) == 5 && value_of(text, "step", 4) == 4, "after the restart: %d rows",
           (int)count_rows(text));
  PetscCall(PetscFree(text));
  for (PetscInt k = 4; k <= 6; k++)
    PetscCall(fixture_step(&scene, k, 0.1, (PetscBool)(k == 6)));
  PetscCall(fixture_read(dir, "history.csv", &text));
  SB_CHECK(count_rows(text) == 7 && value_of(text, "step", 4) == 4 &&
             value_of(text, "step", 5) == 5,
           "a row is doubled");
  PetscCall(PetscFree(text));
  PetscCall(test_scene_close(&scene));

  // with other columns the old file is kept under another name
  PetscCall(test_open_in(
    dir, &scene,
    BOX EULER "-output_fields none -restart %s/checkpoint_000004.h5 -probes p -probe_p_at 0,0,0",
    dir));
  PetscCall(fixture_step(&scene, 4, 0.1, PETSC_TRUE));
  SB_CHECK(fixture_exists(dir, "history_before_000004.csv"),
           "the history with other columns is gone");
  PetscCall(fixture_read(dir, "history.csv", &text));
  SB_CHECK(count_rows(text) == 1 && value_of(text, "p_ux", 0) == 0., "the new history has %d rows",
           (int)count_rows(text));
  PetscCall(PetscFree(text));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_values());
  PetscCall(test_tie());
  PetscCall(test_every());
  PetscCall(test_restart());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
