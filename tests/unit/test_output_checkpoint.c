// Checkpoints: every bit is restored, on any number of ranks; which ones are kept; errors of
// incompatible ones. @ranks 1 2 3
#include "output_fixture.h"

#define HASH_OF_BOX 0x1e14294dea8e2209u

static char dir[512];

/* Largest difference between the vectors of the run and the motion at time t. */
static PetscReal difference(TestScene *scene, PetscReal t)
{
  const SbSpace space = scene->model->space;
  const PetscScalar *state[3];
  PetscReal worst = 0.;
  Vec vec[3] = {scene->run->state.U, scene->run->state.V, scene->run->state.A};

  for (int k = 0; k < 3; k++)
    (void)VecGetArrayRead(vec[k], &state[k]);
  for (PetscInt i = 0; i < space->nnode_owned; i++) {
    PetscReal m[3][3];

    motion(space->node_x + 3 * i, t, m[0], m[1], m[2]);
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++)
        worst = PetscMax(worst, PetscAbsReal(state[k][3 * i + c] - m[k][c]));
  }
  for (int k = 0; k < 3; k++)
    (void)VecRestoreArrayRead(vec[k], &state[k]);
  return worst;
}

static PetscErrorCode test_round_trip(void)
{
  TestScene scene;

  PetscFunctionBeginUser;
  PetscCall(
    test_scene_open_in(dir, HELD EULER "-output_fields none -checkpoint_every_time 0.25", &scene));
  SB_CHECK(scene.run->monitors.want_energies, "works and losses are part of the state");
  scene.run->state.energy_start = 1. / 7.;
  for (PetscInt k = 0; k <= 9; k++)
    PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
  PetscCall(test_scene_close(&scene));

  // due at 0.3, 0.5, 0.8; the two newest are kept
  SB_CHECK(!fixture_exists(dir, "checkpoint_000003.h5") &&
             fixture_exists(dir, "checkpoint_000005.h5") &&
             fixture_exists(dir, "checkpoint_000008.h5"),
           "other checkpoints than 5 and 8 are kept");
  SB_CHECK(!fixture_exists(dir, "checkpoint.tmp"), "a temporary file is left");
  PetscCall(test_open_in(dir, &scene,
                         HELD EULER "-output_fields none -restart %s/checkpoint_000005.h5", dir));
  SB_CHECK(scene.run->clock.step0 == 5 && scene.run->clock.t0 == 5 * 0.1,
           "restart at step %d, t = %.17g", (int)scene.run->clock.step0, scene.run->clock.t0);
  SB_CHECK(difference(&scene, 0.5) == 0., "the state differs by %g", difference(&scene, 0.5));
  SB_CHECK(scene.run->state.energy_start == 1. / 7. &&
             scene.run->state.energies.load_work == 305. &&
             scene.run->state.energies.prescribed_work == 400.,
           "running totals: %.17g %g %g", scene.run->state.energy_start,
           scene.run->state.energies.load_work, scene.run->state.energies.prescribed_work);
  SB_CHECK(!fixture_exists(dir, "checkpoint_000008.h5"),
           "a checkpoint of what is computed again is still there");
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every node is restored, with any element; a different element is an error. */
static PetscErrorCode test_elements(void)
{
  static const char *const elements[] = {
    "-body_a_element p1", "-body_a_element cr", "-body_a_element dg",
    "-body_a_element cr -bodies a,b,c -body_b_element p1 -body_c_element dg",
    "-body_a_element cr -bodies a,b,c -body_b_element p2 -body_c_element p2"};
  static const char more[] =
    " -body_b_mesh box:0.4,0.1,0.2:4,1,2 -body_b_translate 0,0.3,0 -body_b_material linear "
    "-body_b_young 1 -body_b_poisson 0 -body_c_mesh box:0.4,0.1,0.2:2,2,2 -body_c_translate "
    "0,0.6,0 -body_c_material linear -body_c_young 1 -body_c_poisson 0 -output_fields none ";
  TestScene scene;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(elements); i++) {
    PetscCall(test_open_in(dir, &scene, HELD EULER "%s %s -checkpoint_every_steps 1",
                           i >= 3 ? more : "-output_fields none", elements[i]));
    for (PetscInt k = 0; k <= 1; k++)
      PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
    PetscCall(test_scene_close(&scene));
    PetscCall(test_open_in(dir, &scene, HELD EULER "%s %s -restart latest",
                           i >= 3 ? more : "-output_fields none", elements[i]));
    SB_CHECK(difference(&scene, 0.1) == 0., "'%s': the state differs by %g", elements[i],
             difference(&scene, 0.1));
    PetscCall(test_scene_close(&scene));
    SB_CHECK_ERROR(test_open_in(dir, &scene, HELD EULER "%s %s -body_a_element %s -restart latest",
                                i >= 3 ? more : "-output_fields none", elements[i],
                                i == 0 || i == 2 ? "cr" : "dg"),
                   PETSC_ERR_USER_INPUT, "'-body_a_element cr'");
    PetscCall(test_scene_close(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Length of the next step: that of the interrupted run, unless the new run has a different step or
   end. */
static PetscErrorCode test_next_step(void)
{
  static const struct {
    const char *more;
    PetscReal dt;
  } cases[] = {{"", 0.025},
               {" -ts_dt 0.05", 0.05},
               {" -ts_max_time 2", 0.1},
               {" -ts_adapt_type basic", 0.025}};
  TestScene scene;
  PetscReal dt;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    PetscCall(
      test_scene_open_in(dir, BOX EULER "-output_fields none -checkpoint_every_steps 1", &scene));
    PetscCall(fixture_step(&scene, 0, 0.1, PETSC_FALSE));
    PetscCall(TSSetTimeStep(scene.run->solve.ts, 0.025));
    PetscCall(fixture_step(&scene, 1, 0.1, PETSC_FALSE));
    PetscCall(test_scene_close(&scene));
    PetscCall(
      test_open_in(dir, &scene, BOX EULER "-output_fields none -restart latest%s", cases[i].more));
    PetscCall(TSGetTimeStep(scene.run->solve.ts, &dt));
    SB_CHECK(dt == cases[i].dt, "'%s': next step %g, expected %g", cases[i].more, dt, cases[i].dt);
    PetscCall(test_scene_close(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The hash of the mesh is independent of the partition, and depends on every coordinate and
   cell. */
static PetscErrorCode test_hash(void)
{
  static const struct {
    const char *mesh;
    PetscBool same;
  } cases[] = {{"-body_a_mesh box:0.4,0.1,0.2:4,1,2", PETSC_TRUE},
               {"-body_a_mesh box:0.4,0.1,0.2:4,1,2 -body_a_translate 0,0,1e-15", PETSC_FALSE},
               {"-body_a_mesh box:0.4,0.1,0.2:4,2,1", PETSC_FALSE}};
  uint64_t hash[PETSC_STATIC_ARRAY_LENGTH(cases)];
  TestScene scene;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    PetscCall(
      test_open_in(dir, &scene, "-bodies a %s" MATERIAL EULER "-output_fields J", cases[i].mesh));
    hash[i] = ((SbOutput)scene.run->monitors.output)->mesh_hash;
    SB_CHECK((hash[i] == hash[0]) == (cases[i].same != PETSC_FALSE), "hash of '%s'", cases[i].mesh);
    PetscCall(test_scene_close(&scene));
  }

  // found once on one rank: the same on any number
  SB_CHECK(hash[0] == HASH_OF_BOX, "hash 0x%llx", (unsigned long long)hash[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes a folder with a checkpoint of step 1; a scene that restarts from it must fail. */
static PetscErrorCode test_refused(void)
{
  static const char *const others[] = {" -body_a_young 1001", " -body_a_material stvk",
                                       " -mass consistent", " -body_a_mesh box:0.4,0.1,0.2:4,2,2",
                                       " -restart nowhere.h5"};
  TestScene scene;

  PetscFunctionBeginUser;
  PetscCall(
    test_scene_open_in(dir, BOX EULER "-output_fields none -checkpoint_every_steps 1", &scene));
  for (PetscInt k = 0; k <= 1; k++)
    PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
  PetscCall(test_scene_close(&scene));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(others); i++) {
    SB_CHECK_ERROR(
      test_open_in(dir, &scene, BOX EULER "-output_fields none -restart latest%s", others[i]),
      i < 4 ? PETSC_ERR_USER_INPUT : PETSC_ERR_FILE_READ,
      i < 4 ? "checkpoint_000001.h5" : "nowhere.h5");
    SB_CHECK(fixture_exists(dir, "checkpoint_000001.h5"),
             "'%s': refused, but the folder was cleared", others[i]);
    PetscCall(test_scene_close(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes a number of a file on rank 0: a high exponent bit of a real one, bit 1 of others.
   old: takes the sum of scalars away, as older files have none. Returns the number's name. */
static const char *damage(const char *path, const char *text, size_t size, int number,
                          PetscBool old, char name[SB_NAME_MAX])
{
  hid_t file, attribute, type;
  unsigned char bytes[8];
  int64_t format = 1;

  fixture_write(path, text, size);
  file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
  if (number >= 0) {
    attribute = H5Aopen_by_idx(file, ".", H5_INDEX_NAME, H5_ITER_INC, (hsize_t)number, H5P_DEFAULT,
                               H5P_DEFAULT);
    (void)H5Aget_name(attribute, SB_NAME_MAX, name);
    type = H5Aget_type(attribute);
    (void)H5Aread(attribute, type, bytes);
    if (H5Tget_class(type) == H5T_FLOAT)
      bytes[7] ^= 0x40;
    else
      bytes[0] ^= 2;
    (void)H5Awrite(attribute, type, bytes);
    (void)H5Tclose(type);
    (void)H5Aclose(attribute);
  }
  if (old) {
    (void)H5Adelete(file, "scalars_checksum");
    attribute = H5Aopen(file, "format", H5P_DEFAULT);
    (void)H5Awrite(attribute, H5T_NATIVE_INT64, &format);
    (void)H5Aclose(attribute);
  }
  (void)H5Fclose(file);
  return name;
}

/* Any number and the text of the options may be damaged: the checkpoint before is taken. Files of
   format 1 are read, unless their time or step cannot be one. */
static PetscErrorCode test_damage(void)
{
  static const char scene_text[] = HELD EULER "-output_fields none -checkpoint_every_steps 1 ";
  TestScene scene;
  char path[PETSC_MAX_PATH_LEN];
  char name[SB_NAME_MAX] = "options";
  char *text, *options;
  size_t size;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(test_scene_open_in(dir, scene_text, &scene));
  for (PetscInt k = 0; k <= 2; k++)
    PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
  PetscCall(test_scene_close(&scene));
  SbFormat(sizeof(path), path, "%s/checkpoint_000002.h5", dir);
  PetscCall(fixture_read_file(path, &text, &size));
  SB_CHECK(text, "no checkpoint of step 2");
  options = text ? (char *)memmem(text, size, "-body_a_young 1000", 18) : NULL;
  SB_CHECK(options, "no options in the checkpoint");

  // -3: whole, -2: whole and old, -1: the options; then each number until there is none
  for (int i = -3; text && i < 64; i++) {
    const PetscInt expected = i < -1 ? 2 : 1;

    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    if (i == -1)
      options[16] ^= 1;
    name[0] = 0;
    if (!rank)
      damage(path, text, size, i, (PetscBool)(i == -2), name);
    if (i == -1)
      options[16] ^= 1;
    PetscCallMPI(MPI_Bcast(name, SB_NAME_MAX, MPI_CHAR, 0, PETSC_COMM_WORLD));
    if (i >= 0 && !name[0])
      break;
    PetscCall(test_open_in(dir, &scene, "%s -restart latest", scene_text));
    SB_CHECK(scene.run->clock.step0 == expected && scene.run->clock.t0 == 0.1 * (double)expected,
             "number %d, %s: restart at step %d, t = %g", i, name, (int)scene.run->clock.step0,
             scene.run->clock.t0);
    PetscCall(test_scene_close(&scene));

    // of an old file what no run can have
    if (strcmp(name, "time") && strcmp(name, "dt_next"))
      continue;
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    if (!rank)
      damage(path, text, size, i, PETSC_TRUE, name);
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    PetscCall(test_open_in(dir, &scene, "%s -restart latest", scene_text));
    SB_CHECK(scene.run->clock.step0 == 1, "old file, %s: restart at step %d", name,
             (int)scene.run->clock.step0);
    PetscCall(test_scene_close(&scene));
  }
  PetscCall(PetscFree(text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A table with other numbers is another scenario. */
static PetscErrorCode test_table(void)
{
  static const char *const rows[] = {"0 0\n1 1\n", "0 0\n1 2\n"};
  TestScene scene;
  char path[PETSC_MAX_PATH_LEN];
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  SbFormat(sizeof(path), path, "%s/table.csv", dir);
  for (int k = 0; k < 3; k++) {
    PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
    if (!rank)
      fixture_write(path, rows[k / 2], strlen(rows[k / 2]));
    if (k < 2)
      PetscCall(test_open_in(dir, &scene,
                             BOX EULER "-output_fields none -checkpoint_every_steps 1 -effects g "
                                       "-effect_g_type gravity -effect_g_time table:%s %s",
                             path, k ? "-restart latest" : ""));
    else
      SB_CHECK_ERROR(test_open_in(dir, &scene,
                                  BOX EULER "-output_fields none -effects g -effect_g_type gravity "
                                            "-effect_g_time table:%s -restart latest",
                                  path),
                     PETSC_ERR_USER_INPUT, "table.csv");
    for (PetscInt i = 0; i <= 1 && !k; i++)
      PetscCall(fixture_step(&scene, i, 0.1, PETSC_FALSE));
    PetscCall(test_scene_close(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_round_trip());
  PetscCall(test_elements());
  PetscCall(test_next_step());
  PetscCall(test_hash());
  PetscCall(test_refused());
  PetscCall(test_damage());
  PetscCall(test_table());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
