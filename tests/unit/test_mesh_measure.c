// What supple-mesh info says of a mesh: counts, sizes and shapes of known bodies, sizes of groups.
// @ranks 1
#include "mesh_same.h"

static PetscErrorCode test_box(void)
{
  SbImport *im;
  SbMeshStatistics f;
  PetscInt64 angles = 0, tets = 0;

  PetscFunctionBeginUser;
  PetscCall(test_read("box:1,2,3:2,4,6", 0, &im));
  PetscCall(SbMeshFileMeasure(im, &f));
  SB_CHECK(f.body.nvert == 3 * 5 * 7 && f.body.ncell == 6 * 48, "%d vertices, %d tets", (int)f.body.nvert,
           (int)f.body.ncell);
  SB_CHECK_NEAR(f.body.volume, 6, 1e-12, "volume");
  SB_CHECK_NEAR(f.area, 22, 1e-12, "area");
  SB_CHECK_NEAR(f.edge[0], 0.5, 1e-14, "shortest edge");
  SB_CHECK_NEAR(f.edge[2], 0.5 * sqrt(3.), 1e-14, "longest edge");
  SB_CHECK(f.nface == (4 * f.body.ncell + f.body.nfacet) / 2, "%d faces", (int)f.nface);
  SB_CHECK(f.body.nvert - f.nedge + f.nface - f.body.ncell == 1, "%d edges", (int)f.nedge);
  /* tets of a cube along a diagonal: angles 45 (2), 60 (1), 90 (3) in each */
  SB_CHECK_NEAR(f.body.min_dihedral, 45, 1e-10, "smallest angle");
  SB_CHECK_NEAR(f.max_dihedral, 90, 1e-6, "largest angle");
  for (int i = 0; i < SB_ANGLE_BINS; i++) angles += f.angle[i];
  for (int i = 0; i < SB_RATIO_BINS; i++) tets += f.ratio[i];
  SB_CHECK(angles == 6 * f.body.ncell, "%lld angles", (long long)angles);
  SB_CHECK(f.angle[4] == 2 * f.body.ncell, "%lld angles from 40 to 50", (long long)f.angle[4]);
  SB_CHECK(tets == f.body.ncell && f.ratio[1] == f.body.ncell, "%lld tets, %lld of ratio 1.25 to 1.5",
           (long long)tets, (long long)f.ratio[1]);
  PetscCall(SbMeshFileDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_groups(void)
{
  SbImport *im;
  SbMeshGroup group;
  PetscBool found = PETSC_TRUE;
  PetscInt seen = 0;

  PetscFunctionBeginUser;
  PetscCall(test_read("tests/data/two_cubes_41.msh", 0, &im));
  for (PetscInt i = 0; found; i++) {
    PetscCall(SbMeshFileGroup(im, i, &group, &found));
    if (!found) continue;
    if (!strcmp(group.name, "left")) {
      seen++;
      SB_CHECK(group.dim == 3 && group.n == 24, "left: %d of dimension %d", (int)group.n, (int)group.dim);
      SB_CHECK_NEAR(group.size, 1, 1e-12, "volume of left");
    } else if (!strcmp(group.name, "both ends")) {
      seen++;
      SB_CHECK(group.dim == 2 && group.n == 8, "both ends: %d", (int)group.n);
      SB_CHECK_NEAR(group.size, 2, 1e-12, "area of both ends");
    } else if (!strcmp(group.name, "edge")) {
      seen++;
      SB_CHECK_NEAR(group.size, 1, 1e-12, "length of edge");
    }
  }
  SB_CHECK(seen == 3, "%d groups seen", (int)seen);
  PetscCall(SbMeshFileDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a run refuses is refused. */
static PetscErrorCode test_refused(void)
{
  SbImport *im;
  SbMeshStatistics f;

  PetscFunctionBeginUser;
  PetscCall(test_read("tests/data/bad_twice.msh", 0, &im));
  SB_CHECK_ERROR(SbMeshFileMeasure(im, &f), PETSC_ERR_USER_INPUT, "body 'b'|tests/data/bad_twice.msh|1");
  PetscCall(SbMeshFileDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_box());
  PetscCall(test_groups());
  PetscCall(test_refused());
  SB_TEST_END();
}
