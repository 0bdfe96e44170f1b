// Written meshes are read back unchanged: all formats, overlapping groups, orientation, order.
// @ranks 1
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>
#include "../../src/meshio/meshio_impl.h"
#include "mesh_same.h"

#define DATA "tests/data/"

static const struct {
  const char *name;
  SbMeshFormat format;
} formats[] = {
  {"a.msh", SB_MESH_AUTO},         {"b.msh", SB_MESH_MSH41_BINARY}, {"c.msh", SB_MESH_MSH22},
  {"d.msh", SB_MESH_MSH22_BINARY}, {"e.h5", SB_MESH_AUTO},
};

static PetscErrorCode test_formats(const char *path, PetscBool curved)
{
  SbImport *im, *again;
  SbRepair done;

  PetscFunctionBeginUser;
  PetscCall(test_read(path, 0, &im));
  if (curved)
    PetscCall(test_curve(im));
  SB_CHECK(im->nmiddle.n > 0 || !curved, "no curved edges");
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(formats); i++) {
    char what[128];

    (void)snprintf(what, sizeof(what), "%s%s as %s", path, curved ? ", curved," : "",
                   formats[i].name);
    PetscCall(test_round(im, formats[i].name, formats[i].format, &again));

    /* version 2.2 repeats items of several groups; the reader merges tets and repairs the others */
    if (formats[i].format == SB_MESH_MSH22 || formats[i].format == SB_MESH_MSH22_BINARY)
      PetscCall(SbMeshFileRepair(again, 0, &done));
    test_same(im, again, what);
    PetscCall(test_free(&again));
  }
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An inverted tet, unused vertices, and coordinates that need all digits are preserved. */
static PetscErrorCode test_as_it_is(void)
{
  SbImport *im, *again;

  PetscFunctionBeginUser;
  PetscCall(test_read(DATA "odd.msh", 0, &im));
  im->x[0] = 0.1 + 1e-17;
  im->x[1] = 1. / 3;
  im->x[2] = -4.9406564584124654e-324;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(formats); i++) {
    PetscCall(test_round(im, formats[i].name, formats[i].format, &again));
    SB_CHECK(again->nvert == 10, "%s: %d vertices", formats[i].name, (int)again->nvert);
    test_same(im, again, formats[i].name);
    PetscCall(test_free(&again));
  }
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* gmsh numbers groups from 1 on: others get an unused number and keep their name. */
static PetscErrorCode test_numbers(void)
{
  SbImport *im, *again;
  PetscInt group, tags;
  char text[256];

  PetscFunctionBeginUser;
  PetscCall(test_read("box:1,1,1:1", 0, &im));
  PetscCall(SbImportGroup(im, 3, -7, "deep", &group));
  PetscCall(SbImportTagSet(im, 1, &group, &tags));
  im->item[3].tags[2] = tags;
  PetscCall(test_round(im, "n.msh", SB_MESH_AUTO, &again));
  test_groups_of(again, 3, 2, sizeof(text), text);
  SB_CHECK(!strcmp(text, "3 1 deep"), "'%s'", text);
  PetscCall(test_free(&again));
  PetscCall(test_round(im, "n.h5", SB_MESH_AUTO, &again));
  test_groups_of(again, 3, 2, sizeof(text), text);
  SB_CHECK(!strcmp(text, "3 -7 deep"), "'%s'", text);
  PetscCall(test_free(&again));
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char path[512], part[520];
  struct rlimit whole, few;
  SbImport *im;

  SB_TEST_BEGIN(argc, argv);
  for (int curved = 0; curved < 2; curved++) {
    PetscCall(test_formats(DATA "two_cubes_41.msh", (PetscBool)curved));
    PetscCall(test_formats("box:1,2,1.5:3", (PetscBool)curved));
  }
  PetscCall(test_as_it_is());
  PetscCall(test_numbers());

  /* files that cannot be written */
  PetscCall(test_read("box:1,1,1:1", 0, &im));
  SB_CHECK_ERROR(SbMeshFileWrite(im, "mesh.stl", SB_MESH_AUTO), PETSC_ERR_USER_INPUT, "mesh.stl");
  SB_CHECK_ERROR(SbMeshFileWrite(im, "/nowhere/mesh.msh", SB_MESH_AUTO), PETSC_ERR_FILE_WRITE,
                 "/nowhere/mesh.msh.part");
  SB_CHECK_ERROR(SbMeshFileWrite(im, "/nowhere/mesh.h5", SB_MESH_AUTO), PETSC_ERR_FILE_WRITE,
                 "/nowhere/mesh.h5.part");
  PetscCall(test_path("full.msh", path));
  (void)snprintf(part, sizeof(part), "%s.part", path);
  SB_CHECK(!getrlimit(RLIMIT_FSIZE, &whole) && signal(SIGXFSZ, SIG_IGN) != SIG_ERR, "no limit");
  few = (struct rlimit){100, whole.rlim_max};
  SB_CHECK(!setrlimit(RLIMIT_FSIZE, &few), "no limit of 100 bytes");
  SB_CHECK_ERROR(SbMeshFileWrite(im, path, SB_MESH_AUTO), PETSC_ERR_FILE_WRITE, path);
  SB_CHECK(!setrlimit(RLIMIT_FSIZE, &whole), "the limit stays");

  /* a link that somebody has put in the place of the new file is replaced, not followed */
  (void)unlink(part);
  SB_CHECK(!symlink("/dev/full", part), "no link to /dev/full");
  PetscCall(SbMeshFileWrite(im, path, SB_MESH_AUTO));
  PetscCall(test_free(&im));
  SB_TEST_END();
}
