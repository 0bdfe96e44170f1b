// Meshes in checkpoints: every bit is restored, and a damaged one is an error.
// @ranks 1 2
#include "memory_mesh_fixture.h"

static char dir[512];

static PetscErrorCode write_two(void)
{
  SbMemoryMesh *in_memory;
  TestScene scene;

  PetscFunctionBeginUser;
  PetscCall(fixture_given(&in_memory));
  PetscCall(fixture_open_given(
    dir, GIVEN_SCENE EULER "-output_fields none -checkpoint_every_steps 1", in_memory, &scene));
  for (PetscInt k = 0; k <= 5; k++)
    PetscCall(fixture_step(&scene, k, 0.1, PETSC_FALSE));
  PetscCall(test_scene_close(&scene));
  SB_CHECK(fixture_exists(dir, "checkpoint_000004.h5") &&
             fixture_exists(dir, "checkpoint_000005.h5"),
           "no checkpoints");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_back(PetscInt step)
{
  SbMemoryMesh *expected, *g;
  TestScene scene;

  PetscFunctionBeginUser;
  PetscCall(fixture_given(&expected));
  PetscCall(
    fixture_open_given(dir, GIVEN_SCENE EULER "-output_fields none -restart latest", NULL, &scene));
  g = scene.model->body[0].in_memory;
  SB_CHECK(scene.run->clock.step0 == step, "goes on from step %d, not %d",
           (int)scene.run->clock.step0, (int)step);
  SB_CHECK(g && g->step == GIVEN_STEP && g->mass == GIVEN_MASS && g->bound == GIVEN_BOUND,
           "numbers of the mesh");
  if (g && !test_rank) {
    SB_CHECK(g->nvert == 5 && g->ncell == 2 && g->ntri == 1, "%d vertices, %d tets, %d triangles",
             (int)g->nvert, (int)g->ncell, (int)g->ntri);
    SB_CHECK(!memcmp(g->x, expected->x, 15 * sizeof(*g->x)), "places");
    SB_CHECK(!memcmp(g->cell, expected->cell, 8 * sizeof(*g->cell)), "tets");
    SB_CHECK(!memcmp(g->tri, expected->tri, 3 * sizeof(*g->tri)), "triangles");
    SB_CHECK(!memcmp(g->vert_set, expected->vert_set, 5 * sizeof(*g->vert_set)),
             "sets of vertices");
    SB_CHECK(!memcmp(g->cell_set, expected->cell_set, 2 * sizeof(*g->cell_set)), "sets of tets");
    SB_CHECK(g->tri_set[0] == expected->tri_set[0], "set of the triangle");
  }
  PetscCall(SbMemoryMeshDestroy(&expected));
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Changes a number in an array of the newest file. */
static PetscErrorCode damage(const char *array, hid_t type, const void *value, hsize_t n)
{
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/checkpoint_000005.h5", dir);
  if (!test_rank) {
    const hid_t file = H5Fopen(path, H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t set = H5Dopen2(file, array, H5P_DEFAULT);
    const hid_t all = H5Dget_space(set);
    const hid_t first = H5Screate_simple(1, &n, NULL);
    const hsize_t start[2] = {0, 0};
    const hsize_t count[2] = {1, n};

    (void)H5Sselect_hyperslab(all, H5S_SELECT_SET, start, NULL, count, NULL);
    SB_CHECK(H5Dwrite(set, type, first, all, H5P_DEFAULT, value) >= 0, "%s cannot be damaged",
             array);
    (void)H5Sclose(first);
    (void)H5Sclose(all);
    (void)H5Dclose(set);
    (void)H5Fclose(file);
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  static const double moved = 0.125;
  static const int far = 1000000;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(write_two());
  PetscCall(check_back(5));

  /* an invalid vertex number must not be read beyond the end: the older checkpoint is used */
  PetscCall(write_two());
  PetscCall(damage("mesh_a/cells", H5T_NATIVE_INT, &far, 1));
  PetscCall(check_back(4));
  PetscCall(write_two());
  PetscCall(damage("mesh_a/x", H5T_NATIVE_DOUBLE, &moved, 1));
  PetscCall(check_back(4));
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
