// Mesh of a scene on any number of ranks: local meshes agree with the global one, errors are raised
// on all ranks. @ranks 1 2 3 4
#include "../../src/mesh/mesh_impl.h"
#include "mesh_test.h"
#include <sbsurface.h>

#define DATA "tests/data/"

enum {
  NSET = 5
};

static PetscErrorCode make_scene(SbBody body[3], SbSet set[NSET])
{
  PetscFunctionBeginUser;
  body[0] = test_body("cubes", DATA "two_cubes_22_bin.msh");
  body[1] = test_body("bar", "box:2,0.5,0.5:4");
  body[2] = test_body("tets", DATA "odd.msh");
  body[1].translate[2] = 3;
  body[2].scale = 0.5;
  PetscCall(test_set("wall", "group:wall", &set[0]));
  PetscCall(test_set("inner", "group:inner", &set[1]));
  PetscCall(test_set("low", "halfspace:1,0,0,0.6", &set[2]));
  PetscCall(test_set("bar", "body:bar", &set[3]));
  PetscCall(test_set("hull", "boundary", &set[4]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Every rank builds the whole mesh again and compares its local mesh with it. */
static PetscErrorCode compare_with_whole(SbMesh mesh, const SbMergedMesh *whole)
{
  PetscInt wrong_vert = 0;
  PetscInt wrong_cell = 0;

  PetscFunctionBeginUser;
  SB_CHECK(mesh->Nvert == whole->nvert && mesh->Ncell == whole->ncell, "%d vertices, %d cells",
           (int)mesh->Nvert, (int)mesh->Ncell);
  for (PetscInt v = 0; v < mesh->nvert; v++) {
    const SbVertexData *p = &whole->vertex[mesh->vert_orig[v]];

    wrong_vert += p->body != mesh->vert_body[v] || p->set != mesh->vert_set[v];
    for (int i = 0; i < 3; i++)
      wrong_vert += p->x[i] != mesh->x[3 * v + i];
  }
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    const PetscInt orig = mesh->cell_orig[c];
    const SbCellData *p = &whole->data[orig];

    wrong_cell += p->body != mesh->cell_body[c] || p->set != mesh->cell_set[c];
    for (int a = 0; a < 4; a++) {
      wrong_cell += whole->cell[4 * orig + a] != mesh->vert_orig[mesh->cell[4 * c + a]];
      wrong_cell += p->face[a] != mesh->face_set[4 * c + a];
    }
  }
  SB_CHECK(!wrong_vert && !wrong_cell, "%d wrong entries of vertices, %d of cells", (int)wrong_vert,
           (int)wrong_cell);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A value of each owned cell arrives at all its ghosts. */
static PetscErrorCode check_broadcast(SbMesh mesh)
{
  PetscInt *value;
  PetscInt wrong = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(2 * mesh->ncell, &value));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    value[2 * c] = c < mesh->ncell_owned ? mesh->cell_orig[c] : -1;
    value[2 * c + 1] = c < mesh->ncell_owned ? -mesh->cell_orig[c] : 1;
  }
  PetscCall(SbForestBroadcast(mesh->cell_sf, 2, MPIU_INT, value, value));
  for (PetscInt c = 0; c < mesh->ncell; c++)
    wrong += value[2 * c] != mesh->cell_orig[c] || value[2 * c + 1] != -mesh->cell_orig[c];
  SB_CHECK(!wrong, "%d cells with the number of another one", (int)wrong);
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* With nodes at faces: every cell at a vertex of an owned cell is local, exactly once. Counted over
   all ranks by the corners of owned cells. */
static PetscErrorCode check_layer(SbMesh mesh)
{
  PetscInt *around, *total;
  PetscInt missing = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(mesh->Nvert, &around, mesh->Nvert, &total));
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++)
    total[mesh->vert_orig[mesh->cell[i]]]++;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, total, (int)mesh->Nvert, MPIU_INT, MPI_SUM, mesh->comm));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++)
    around[mesh->vert_orig[mesh->cell[i]]]++;
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++) {
    const PetscInt v = mesh->vert_orig[mesh->cell[i]];

    missing += around[v] != total[v];
  }
  SB_CHECK(!missing, "%d corners of owned cells without all their cells", (int)missing);
  PetscCall(PetscFree2(around, total));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_scene(const char *partitioner, PetscBool face_nodes)
{
  SbBody body[3], body_again[3];
  SbSet set[NSET], set_again[NSET];
  SbMesh mesh;
  SbMergedMesh whole;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsSetValue(NULL, "-petscpartitioner_type", partitioner));
  PetscCall(make_scene(body, set));
  PetscCall(make_scene(body_again, set_again));
  body[0].other_nodes = face_nodes;
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 3, body, NSET, set, &mesh));
  PetscCall(SbMeshValidate(mesh));
  PetscCall(
    SbMergedMeshCreate(PETSC_COMM_SELF, SB_READING_AUTO, 3, body_again, NSET, set_again, &whole));
  PetscCall(compare_with_whole(mesh, &whole));
  PetscCall(check_broadcast(mesh));
  if (face_nodes)
    PetscCall(check_layer(mesh));

  // What rank 0 found is the same on all ranks.
  SB_CHECK(!memcmp(set, set_again, sizeof(set)), "counts of the sets");
  for (int b = 0; b < 3; b++) {
    SB_CHECK(body[b].ncell == body_again[b].ncell && body[b].volume == body_again[b].volume &&
               !strcmp(body[b].note, body_again[b].note),
             "findings of body %d", b);
  }
  SB_CHECK(set[0].nvert == 5 && set[0].nfacet == 4 && set[3].ncell == body[1].ncell,
           "%d vertices, %d facets in the wall", (int)set[0].nvert, (int)set[0].nfacet);
  PetscCall(SbMergedMeshDestroy(&whole));
  PetscCall(SbMeshDestroy(&mesh));
  SB_CHECK(!mesh, "the mesh is gone");
  PetscCall(SbMeshDestroy(&mesh));
  PetscCall(PetscOptionsClearValue(NULL, "-petscpartitioner_type"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Few more tets than ranks, or fewer: some ranks are idle, the mesh is complete. */
static PetscErrorCode test_few(const char *file, PetscInt ncell)
{
  SbBody body = test_body("b", file);
  SbMesh mesh;

  PetscFunctionBeginUser;
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, 0, NULL, &mesh));
  PetscCall(SbMeshValidate(mesh));
  SB_CHECK(mesh->Ncell == ncell, "%d cells", (int)mesh->Ncell);
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertices of one rank have close numbers: the largest difference within a cell of a slender
   bar. */
static PetscErrorCode test_order(void)
{
  SbBody body = test_body("b", "box:60,2,2:60,2,2");
  SbMesh mesh;
  PetscInt width = 0;

  PetscFunctionBeginUser;
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, 0, NULL, &mesh));
  for (PetscInt c = 0; c < mesh->ncell; c++) {
    for (int a = 0; a < 4; a++) {
      for (int b = 0; b < a; b++) {
        const PetscInt v = mesh->cell[4 * c + a];
        const PetscInt w = mesh->cell[4 * c + b];

        if (v < mesh->nvert_owned && w < mesh->nvert_owned)
          width = PetscMax(width, PetscAbsInt(v - w));
      }
    }
  }

  /* three layers of 9 vertices; the numbering of a middle rank also starts at one of its two
     ends */
  SB_CHECK(width <= 27, "bandwidth %d", (int)width);
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create(const char *file, const char *set_text)
{
  SbBody body = test_body("liver", file);
  SbSet set;
  SbMesh mesh = NULL;

  PetscFunctionBeginUser;
  if (set_text)
    PetscCall(test_set("clamp", set_text, &set));
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, set_text ? 1 : 0, &set, &mesh));
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The validation detects the damage that it is made for; all ranks have the damage, so that all
   stop at the same check. */
static PetscErrorCode test_validation(void)
{
  SbBody body = test_body("b", "box:1,1,1:4");
  SbMesh mesh;
  PetscInt keep;

  PetscFunctionBeginUser;
  PetscCall(SbMeshCreate(PETSC_COMM_WORLD, 1, &body, 0, NULL, &mesh));
  keep = mesh->cell[0];
  mesh->cell[0] = mesh->cell[1];
  mesh->cell[1] = keep;
  SB_CHECK_ERROR(SbMeshValidate(mesh), PETSC_ERR_PLIB, "Cell");
  mesh->cell[1] = mesh->cell[0];
  mesh->cell[0] = keep;
  keep = mesh->vert_orig[0];
  mesh->vert_orig[0] = mesh->vert_orig[1];
  SB_CHECK_ERROR(SbMeshValidate(mesh), PETSC_ERR_PLIB, "vertex numbers");
  mesh->vert_orig[0] = keep;
  for (PetscInt s = 0; s < 4 * mesh->ncell_owned; s++)
    mesh->face_set[s] &= ~SB_ON_BOUNDARY;
  SB_CHECK_ERROR(SbMeshValidate(mesh), PETSC_ERR_PLIB, "boundary facets");
  PetscCall(SbMeshDestroy(&mesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(SbLogInitialize());
  PetscCall(SbOptionsRegister("", "", PETSC_DECIDE, SbMeshRows));
  PetscCall(SbOptionsRegister("body", "", PETSC_DECIDE, SbTetRows));
  PetscCall(test_scene("metis", PETSC_FALSE));
  PetscCall(test_scene("metis", PETSC_TRUE));
  PetscCall(test_scene("bisection", PETSC_FALSE));
  PetscCall(test_few(DATA "two_tets.msh", 2));
  PetscCall(test_few("box:1,1,1:1", 6));
  PetscCall(test_order());

  /* only rank 0 reads, but all ranks return the same error and message */
  SB_CHECK_ERROR(create(DATA "none.msh", NULL), PETSC_ERR_FILE_OPEN,
                 "body 'liver'|tests/data/none.msh");
  SB_CHECK_ERROR(create(DATA "bad_nan.msh", NULL), PETSC_ERR_FILE_UNEXPECTED, "line 9|node 4");
  SB_CHECK_ERROR(create(DATA "bad_twice.msh", NULL), PETSC_ERR_USER_INPUT, "1|3");
  SB_CHECK_ERROR(create("box:1,1,1:2", "group:ymix"), PETSC_ERR_USER_INPUT, "group 'ymix'");
  SB_CHECK_ERROR(create("box:1,1,1:2", "sphere:3,0,0,1"), PETSC_ERR_USER_INPUT, "set 'clamp'|0|1");
  PetscCall(test_validation());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
