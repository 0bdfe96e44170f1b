// Body with a mesh in memory: vertices, tets, sets, inclusions and mass are the given ones.
// @ranks 1 2
#include "memory_mesh_fixture.h"

static PetscErrorCode check_mesh(SbModel m)
{
  const SbMesh mesh = m->mesh;
  PetscInt marked = 0;

  PetscFunctionBeginUser;
  SB_CHECK(mesh->Nvert == 5 && mesh->Ncell == 2, "%d vertices, %d tets", (int)mesh->Nvert,
           (int)mesh->Ncell);
  for (PetscInt v = 0; v < mesh->nvert; v++) {
    const PetscInt o = mesh->vert_orig[v];

    for (int k = 0; k < 3; k++)
      SB_CHECK(mesh->x[3 * v + k] == given_x[o][k], "vertex %d is elsewhere", (int)o);
    SB_CHECK(!(mesh->vert_set[v] & GIVEN_SIDE) == (o == 1 || o == 4), "vertex %d: sets 0x%llx",
             (int)o, (unsigned long long)mesh->vert_set[v]);
  }
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscInt o = mesh->cell_orig[c];

    for (int a = 0; a < 4; a++) {
      const PetscInt v = mesh->vert_orig[mesh->cell[4 * c + a]];

      SB_CHECK(v == given_cell[o][a], "corner %d of tet %d is %d", a, (int)o, (int)v);
      if (!(mesh->face_set[4 * c + a] & GIVEN_SIDE))
        continue;
      SB_CHECK(o == 0 && v == 1, "face %d of tet %d is in the set", a, (int)o);
      marked += c < mesh->ncell_owned;
    }
    SB_CHECK(!(mesh->cell_set[c] & GIVEN_CORE) == !o && mesh->cell_material[c] == o,
             "tet %d: sets 0x%llx, material %d", (int)o, (unsigned long long)mesh->cell_set[c],
             (int)mesh->cell_material[c]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &marked, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  SB_CHECK(marked == 1, "%d faces are in the set", (int)marked);
  SB_CHECK_NEAR(m->mass, GIVEN_MASS, 1e-14, "mass");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Empty arrays, and NULL. */
static PetscErrorCode check_empty(void)
{
  SbMemoryMesh *g;

  PetscFunctionBeginUser;
  PetscCall(SbMemoryMeshCreate(0, 0, 0, 0, &g));
  SB_CHECK(!g->step && g->mass == 0. && g->bound == 0., "numbers of an empty mesh");
  PetscCall(SbMemoryMeshDestroy(&g));
  SB_CHECK(!g, "it is gone");
  PetscCall(SbMemoryMeshDestroy(&g));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  char dir[512];
  SbMemoryMesh *in_memory;
  TestScene scene;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_empty());
  PetscCall(test_file_folder(dir));
  PetscCall(fixture_given(&in_memory));
  PetscCall(fixture_open_given(dir, GIVEN_SCENE EULER "-output_fields none", in_memory, &scene));
  PetscCall(check_mesh(scene.model));
  PetscCall(test_scene_close(&scene));
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
