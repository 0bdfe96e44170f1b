// The gmsh library in a child process: its results, and messages when it fails, crashes or hangs.
// @ranks 1 3
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>
#include "mesh_test.h"
#include "sbmeshio.h"

static PetscErrorCode run(const char *doing, PetscReal seconds, SbGmshWork work, void *ctx,
                          SbImport *im)
{
  const SbGmshJob job = {im->where, doing, seconds, work, ctx};

  PetscFunctionBeginUser;
  PetscCall(SbGmshRun(&job, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Runs a task and frees it. */
static PetscErrorCode try_work(PetscReal seconds, SbGmshWork work, void *ctx)
{
  SbImport im = {0};
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  (void)snprintf(im.where, sizeof(im.where), "body 'b': thing");
  ierr = run("made tetrahedra", seconds, work, ctx, &im);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(ierr);
}

/* ------------------------------------------------------------------ volume from a surface */

/* Unit cube as twelve triangles of a discrete surface; its volume mesh has the size that ctx points
   to. */
static PetscErrorCode mesh_cube(const SbGmsh *gmsh, void *ctx, SbImport *result)
{
  double x[24];
  size_t tag[8];
  size_t tri[36] = {1, 3, 2, 2, 3, 4, 5, 6, 7, 6, 8, 7, 1, 2, 5, 2, 6, 5,
                    3, 7, 4, 4, 7, 8, 1, 5, 3, 3, 5, 7, 2, 4, 6, 4, 8, 6};
  int surface = 1;
  int loop = 1;
  int volume = 1;
  size_t *number, ntet, *node, nnode, *vertex, nvert, nx, nparameter;
  double *place, *parameter;

  PetscFunctionBeginUser;
  for (int v = 0; v < 8; v++) {
    tag[v] = (size_t)v + 1;
    for (int i = 0; i < 3; i++)
      x[3 * v + i] = v >> i & 1;
  }
  SB_GMSH(gmsh, ModelAddDiscreteEntity, 2, surface, NULL, 0);
  SB_GMSH(gmsh, ModelMeshAddNodes, 2, surface, tag, 8, x, 24, NULL, 0);
  SB_GMSH(gmsh, ModelMeshAddElementsByType, surface, 2, NULL, 0, tri, 36);
  SB_GMSH(gmsh, ModelGeoAddSurfaceLoop, &surface, 1, loop);
  SB_GMSH(gmsh, ModelGeoAddVolume, &loop, 1, volume);
  SB_GMSH0(gmsh, ModelGeoSynchronize);
  SB_GMSH(gmsh, OptionSetNumber, "Mesh.MeshSizeMax", *(const double *)ctx);
  SB_GMSH(gmsh, ModelMeshGenerate, 3);

  // tags of nodes are 1, 2, ...
  SB_GMSH(gmsh, ModelMeshGetNodes, &vertex, &nvert, &place, &nx, &parameter, &nparameter, -1, -1, 0,
          0);
  PetscCall(SbImportSetVertices(result, (PetscInt)nvert));
  for (size_t v = 0; v < nvert; v++) {
    result->vert_number[v] = (int64_t)v + 1;
    for (int i = 0; i < 3; i++)
      result->x[3 * (vertex[v] - 1) + (size_t)i] = place[3 * v + (size_t)i];
  }
  SB_GMSH(gmsh, ModelMeshGetElementsByType, 4, &number, &ntet, &node, &nnode, volume, 0, 1);
  for (size_t c = 0; c < ntet; c++) {
    PetscInt vert[4];

    for (int a = 0; a < 4; a++)
      vert[a] = (PetscInt)node[4 * c + (size_t)a] - 1;
    PetscCall(SbImportAddItem(result, 3, vert, 0, (int64_t)number[c]));
  }
  gmsh->Free(vertex);
  gmsh->Free(place);
  gmsh->Free(parameter);
  gmsh->Free(number);
  gmsh->Free(node);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_cube(void)
{
  SbImport im = {0};
  SbMeshStatistics facts;
  double size = 0.5;

  PetscFunctionBeginUser;
  (void)snprintf(im.where, sizeof(im.where), "body 'b': cube");
  PetscCall(run("made tetrahedra", 60, mesh_cube, &size, &im));
  SB_CHECK(im.item[3].n >= 6 && im.nvert >= 8, "%d tets, %d vertices", (int)im.item[3].n,
           (int)im.nvert);
  PetscCall(SbMeshFileMeasure(&im, &facts));
  SB_CHECK_NEAR(facts.body.volume, 1, 1e-12, "volume");

  /* more items can be added to the body */
  PetscCall(SbImportAddItem(&im, 3, (PetscInt[]){0, 1, 2, 3}, 0, 1));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ errors */

static PetscErrorCode crash(const SbGmsh *gmsh, void *ctx, SbImport *result)
{
  (void)gmsh, (void)ctx, (void)result;
  PetscFunctionBeginUser;
  (void)raise(SIGSEGV);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode hang(const SbGmsh *gmsh, void *ctx, SbImport *result)
{
  (void)gmsh, (void)ctx, (void)result;
  PetscFunctionBeginUser;
  for (;;)
    (void)sleep(1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode leave(const SbGmsh *gmsh, void *ctx, SbImport *result)
{
  (void)gmsh, (void)ctx, (void)result;
  PetscFunctionBeginUser;
  _exit(3);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode refuse(const SbGmsh *gmsh, void *ctx, SbImport *result)
{
  (void)gmsh, (void)result;
  PetscFunctionBeginUser;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s", (const char *)ctx);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode fail_in_gmsh(const SbGmsh *gmsh, void *ctx, SbImport *result)
{
  (void)ctx, (void)result;
  PetscFunctionBeginUser;
  SB_GMSH(gmsh, OptionSetNumber, "Nowhere.AtAll", 1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_failures(void)
{
  PetscFunctionBeginUser;
  SB_CHECK_ERROR(try_work(60, crash, NULL), PETSC_ERR_FILE_UNEXPECTED, "body 'b'");
  SB_CHECK_ERROR(try_work(1.5, hang, NULL), PETSC_ERR_FILE_UNEXPECTED, "body 'b'|1.5 s");
  SB_CHECK_ERROR(try_work(60, leave, NULL), PETSC_ERR_FILE_UNEXPECTED, "body 'b'|code 3");
  SB_CHECK_ERROR(try_work(60, refuse, "seven is too many"), PETSC_ERR_USER_INPUT,
                 "seven is too many");
  SB_CHECK_ERROR(try_work(60, fail_in_gmsh, NULL), PETSC_ERR_FILE_UNEXPECTED, "body 'b'");
  SB_CHECK_ERROR(try_work(60, fail_in_gmsh, NULL), PETSC_ERR_FILE_UNEXPECTED, "Nowhere.AtAll");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Without a work function that calls it, the library is not loaded in this process. */
static PetscErrorCode test_not_loaded(void)
{
  char line[512];
  FILE *maps = fopen("/proc/self/maps", "r");
  PetscBool found = PETSC_FALSE;

  PetscFunctionBeginUser;
  while (maps && fgets(line, sizeof(line), maps))
    found = (PetscBool)(found || strstr(line, "libgmsh"));
  if (maps)
    fclose(maps);
  SB_CHECK(!found, "libgmsh is loaded in the program itself");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  int rank;

  SB_TEST_BEGIN(argc, argv);
  rank = test_rank;
  if (!test_rank) {
    PetscCall(test_cube());
    PetscCall(test_failures());
    PetscCall(test_not_loaded());
  }

  /* MPI still works after the child processes, and the other ranks have waited */
  PetscCallMPI(MPI_Bcast(&rank, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  SB_CHECK(rank == 0, "rank %d from rank 0", (int)rank);
  SB_TEST_END();
}
