// Statistics of supple-mesh info: counts, sizes and shapes of known bodies, sizes of groups.
// @ranks 1
#include "../../src/meshio/meshio_impl.h"
#include "mesh_same.h"

static PetscErrorCode test_box(void)
{
  SbImport *im;
  SbMeshStatistics f;
  PetscInt64 angles = 0;
  PetscInt64 tets = 0;

  PetscFunctionBeginUser;
  PetscCall(test_read("box:1,2,3:2,4,6", 0, &im));
  PetscCall(SbMeshFileMeasure(im, &f));
  SB_CHECK(f.body.nvert == 3 * 5 * 7 && f.body.ncell == 6 * 48, "%d vertices, %d tets",
           (int)f.body.nvert, (int)f.body.ncell);
  SB_CHECK_NEAR(f.body.volume, 6, 1e-12, "volume");
  SB_CHECK_NEAR(f.area, 22, 1e-12, "area");
  SB_CHECK_NEAR(f.edge[0], 0.5, 1e-14, "shortest edge");
  SB_CHECK_NEAR(f.edge[2], 0.5 * sqrt(3.), 1e-14, "longest edge");
  SB_CHECK(f.nface == (4 * f.body.ncell + f.body.nfacet) / 2, "%d faces", (int)f.nface);
  SB_CHECK(f.body.nvert - f.nedge + f.nface - f.body.ncell == 1, "%d edges", (int)f.nedge);

  /* tets of a cube along a diagonal: angles 45 (2), 60 (1), 90 (3) in each */
  SB_CHECK_NEAR(f.body.min_dihedral, 45, 1e-10, "smallest angle");
  SB_CHECK_NEAR(f.max_dihedral, 90, 1e-6, "largest angle");
  for (int i = 0; i < SB_ANGLE_BINS; i++)
    angles += f.angle[i];
  for (int i = 0; i < SB_RATIO_BINS; i++)
    tets += f.ratio[i];
  SB_CHECK(angles == 6 * f.body.ncell, "%lld angles", (long long)angles);
  SB_CHECK(f.angle[4] == 2 * f.body.ncell, "%lld angles from 40 to 50", (long long)f.angle[4]);
  SB_CHECK(tets == f.body.ncell && f.ratio[1] == f.body.ncell,
           "%lld tets, %lld of ratio 1.25 to 1.5", (long long)tets, (long long)f.ratio[1]);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_groups(void)
{
  static const struct {
    const char *name;
    PetscInt dim, n; /* n 0: not checked */
    PetscReal size;
  } known[] = {{"left", 3, 24, 1}, {"both ends", 2, 8, 2}, {"edge", 1, 0, 1}};
  SbImport *im;
  PetscInt seen = 0;
  PetscInt n;
  PetscReal size;

  PetscFunctionBeginUser;
  PetscCall(test_read("tests/data/two_cubes_41.msh", 0, &im));
  for (PetscInt i = 0; i < im->ngroup; i++) {
    const SbGroup *group = &im->group[i];

    PetscCall(SbMeshFileGroup(im, i, &n, &size));
    for (int k = 0; k < 3; k++) {
      if (strcmp(group->name, known[k].name))
        continue;
      seen++;
      if (known[k].n)
        SB_CHECK(group->dim == known[k].dim && n == known[k].n, "%s: %d of dimension %d",
                 group->name, (int)n, (int)group->dim);
      SB_CHECK_NEAR(size, known[k].size, 1e-12, group->name);
    }
  }
  SB_CHECK(seen == 3, "%d groups seen", (int)seen);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Quarter of a hollow cylinder with radii 1 and 2 and height 1. */
static void cylinder(PetscReal x[3])
{
  const PetscReal r = 1 + x[0];
  const PetscReal angle = 0.5 * PETSC_PI * x[1];

  x[0] = r * PetscCosReal(angle);
  x[1] = r * PetscSinReal(angle);
}

/*
  As a mesh of n x n x n cells, vertices and nodes of edges in their places, with the region of
  radii below 1.5 and the curve of radius 1 at the bottom. What is measured over the exact value,
  less 1: volume, region, whole surface, outside, inside, bottom, curve.
*/
static PetscErrorCode measure_cylinder(PetscInt n, PetscBool curved, PetscReal error[7])
{
  static const char *const names[7] = {"volume", "core", "surface", "xmax", "xmin", "zmin", "arc"};
  const PetscReal exact[7] = {3 * PETSC_PI / 4, 1.25 * PETSC_PI / 4, 2 + 3 * PETSC_PI, PETSC_PI,
                              PETSC_PI / 2,     3 * PETSC_PI / 4,    PETSC_PI / 2};
  PetscReal largest;
  PetscReal value[7] = {0};
  PetscInt tags[2];
  SbMeshStatistics f;
  char path[64];
  SbImport *im;

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "box:1,1,1:%d", (int)n);
  PetscCall(test_read(path, 0, &im));
  PetscCall(SbImportTagsAlone(im, 3, 1, "core", &tags[0]));
  PetscCall(SbImportTagsAlone(im, 1, 1, "arc", &tags[1]));
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    const PetscInt *v = im->item[3].vert + 4 * c;
    PetscReal mean = 0;

    for (int a = 0; a < 4; a++)
      mean += im->x[3 * v[a]] / 4;
    if (mean < 0.5)
      im->item[3].tags[c] = tags[0];
  }
  for (PetscInt j = 0; j < n; j++)
    PetscCall(
      SbImportAddItem(im, 1, (const PetscInt[]){(n + 1) * j, (n + 1) * (j + 1)}, tags[1], j + 1));
  for (PetscInt i = 0; i < 6 * im->item[3].n && curved; i++) {
    const PetscInt *v = im->item[3].vert + 4 * (i / 6);
    const PetscInt a = v[SbTetEdge[i % 6][0]];
    const PetscInt b = v[SbTetEdge[i % 6][1]];
    PetscReal p[3][3];
    SbMiddle m = {.end = {PetscMin(a, b), PetscMax(a, b)}, .node = -1};

    for (int k = 0; k < 3; k++) {
      p[0][k] = im->x[3 * a + k];
      p[1][k] = im->x[3 * b + k];
      p[2][k] = 0.5 * (p[0][k] + p[1][k]);
    }
    for (int q = 0; q < 3; q++)
      cylinder(p[q]);
    for (int k = 0; k < 3; k++)
      m.off[k] = p[2][k] - 0.5 * (p[0][k] + p[1][k]);
    PetscCall(SbReserve(++im->nmiddle.n, sizeof(m), &im->nmiddle.capacity, &im->middle));
    im->middle[im->nmiddle.n - 1] = m;
  }
  for (PetscInt v = 0; v < im->nvert; v++)
    cylinder(im->x + 3 * v);
  PetscCall(SbImportMiddles(im, NULL, &largest));
  for (PetscInt g = 0; g < im->ngroup; g++) {
    PetscReal size;
    PetscInt count;

    PetscCall(SbMeshFileGroup(im, g, &count, &size));
    for (int k = 0; k < 7; k++)
      if (!strcmp(im->group[g].name, names[k]))
        value[k] = size;
  }
  PetscCall(SbMeshFileMeasure(im, &f));
  value[0] = f.body.volume;
  value[2] = f.area;
  for (int k = 0; k < 7; k++) {
    error[k] = PetscAbsReal(value[k] / exact[k] - 1);
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "  %d cells, %s, %s: %.6g, error %.2e\n", (int)n,
                          curved ? "curved" : "straight", names[k], value[k], error[k]));
  }
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal error[2][2][7];
  SbImport *im;
  SbMeshStatistics f;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_box());
  PetscCall(test_groups());

  /* sizes of curved bodies, their regions, surfaces and curves converge with order 4, those of
     straight ones with order 2 */
  for (int curved = 0; curved < 2; curved++)
    for (int k = 0; k < 2; k++)
      PetscCall(measure_cylinder(k ? 8 : 4, (PetscBool)curved, error[curved][k]));
  for (int k = 0; k < 7; k++) {
    SB_CHECK(error[1][0][k] < 0.02 * error[0][0][k], "%d: error %g, %g straight", k, error[1][0][k],
             error[0][0][k]);
    SB_CHECK(error[1][0][k] > 14 * error[1][1][k], "%d: errors %g, %g", k, error[1][0][k],
             error[1][1][k]);
  }

  /* errors of a run are errors here too */
  PetscCall(test_read("tests/data/bad_twice.msh", 0, &im));
  SB_CHECK_ERROR(SbMeshFileMeasure(im, &f), PETSC_ERR_USER_INPUT,
                 "body 'b'|tests/data/bad_twice.msh|1");
  PetscCall(test_free(&im));
  SB_TEST_END();
}
