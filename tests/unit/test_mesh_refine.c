// Refinement: eight children that fill their parent, groups, orientation, bounded shape quality;
// unique edges. @ranks 1
#include "mesh_same.h"

/* Vertices, edges, faces and cells of a ball: v - e + f - c = 1. */
static PetscErrorCode test_edges(void)
{
  SbImport *im;
  SbImportEdges edges;
  SbFaces faces;
  PetscInt found = 0;

  PetscFunctionBeginUser;
  PetscCall(test_read("box:1,2,3:2", 0, &im));
  PetscCall(SbImportEdgesCreate(im, &edges));
  PetscCall(SbFacesCreate(im->nvert, im->item[3].n, im->item[3].vert, &faces));
  SB_CHECK(im->nvert - edges.nedge + (4 * im->item[3].n + faces.nboundary) / 2 - im->item[3].n == 1,
           "%d vertices, %d edges, %d tets", (int)im->nvert, (int)edges.nedge, (int)im->item[3].n);
  for (PetscInt a = 0; a < im->nvert; a++) {
    for (PetscInt e = edges.start[a]; e < edges.start[a + 1]; e++)
      found += SbImportEdgesFind(&edges, edges.high[e], a) == e &&
               SbImportEdgesFind(&edges, a, edges.high[e]) == e;
  }
  SB_CHECK(found == edges.nedge, "%d of %d edges found", (int)found, (int)edges.nedge);
  SB_CHECK(SbImportEdgesFind(&edges, 0, im->nvert - 1) == -1, "corners that no edge joins");
  PetscCall(SbImportEdgesDestroy(&edges));
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Six times the volume of the children of cell c, and that of the smallest child. */
static PetscReal family(const SbImport *im, PetscInt c, PetscReal *smallest)
{
  PetscReal sum = 0;

  *smallest = PETSC_MAX_REAL;
  for (PetscInt k = 8 * c; k < 8 * c + 8; k++) {
    const PetscReal det = SbTetDeterminant(im->x, im->item[3].vert + 4 * k);

    sum += det;
    *smallest = PetscMin(*smallest, det);
  }
  return sum;
}

/* The children of each tet have its total volume and its groups; all are positive, none has less
   than an eighth. */
static PetscErrorCode test_children(const char *path)
{
  SbImport *im, *fine;
  PetscReal worst = 0;
  PetscReal least = 1;
  char of_parent[512], of_child[512];

  PetscFunctionBeginUser;
  PetscCall(test_read(path, 0, &im));
  PetscCall(test_read(path, 0, &fine));
  PetscCall(SbMeshFileRefine(fine));
  for (int d = 0; d < 4; d++) {
    SB_CHECK(fine->item[d].n == im->item[d].n << d, "%s: %d of dimension %d from %d", path,
             (int)fine->item[d].n, d, (int)im->item[d].n);
    for (PetscInt i = 0; i < fine->item[d].n; i++) {
      test_groups_of(im, d, i >> d, sizeof(of_parent), of_parent);
      test_groups_of(fine, d, i, sizeof(of_child), of_child);
      if (strcmp(of_parent, of_child))
        SB_CHECK(0, "%s: '%s' from '%s'", path, of_child, of_parent);
    }
  }
  for (PetscInt c = 0; c < im->item[3].n; c++) {
    const PetscReal det = SbTetDeterminant(im->x, im->item[3].vert + 4 * c);
    PetscReal smallest;
    const PetscReal sum = family(fine, c, &smallest);

    worst = PetscMax(worst, PetscAbsReal(sum / det - 1));
    least = PetscMin(least, 8 * smallest / det);
  }
  SB_CHECK(worst < 1e-13, "%s: volumes differ by %g", path, worst);
  SB_CHECK(least > 1 - 1e-12, "%s: a child has %g of its share", path, least);
  PetscCall(test_free(&im));
  PetscCall(test_free(&fine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After five refinements the shapes are worse than after the first one only within the bound of the
   method. */
static PetscErrorCode test_shapes(void)
{
  SbImport *im;
  SbMeshStatistics facts;
  PetscReal first = 0;

  PetscFunctionBeginUser;
  PetscCall(test_read("tests/data/one_tet.msh", 0, &im));
  for (int k = 0; k < 5; k++) {
    PetscCall(SbMeshFileRefine(im));
    PetscCall(SbMeshFileMeasure(im, &facts));
    if (!k)
      first = facts.body.max_radius_ratio;
  }
  SB_CHECK(im->item[3].n == 32768, "%d tets", (int)im->item[3].n);
  SB_CHECK(facts.body.max_radius_ratio < 1.5 * first, "radius ratio %g after %g",
           facts.body.max_radius_ratio, first);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The children of curved tets are curved by the map of their parents: exact volumes up to rounding,
   no folds, also for children of children. */
static PetscErrorCode test_curved(const char *path)
{
  SbImport *im;
  SbMeshStatistics facts;
  PetscReal volume = 0;
  PetscReal straight = 0;
  PetscInt nedge = 0;

  PetscFunctionBeginUser;
  PetscCall(test_read(path, 0, &im));
  PetscCall(SbMeshFileMeasure(im, &facts));
  straight = facts.body.volume;
  PetscCall(test_curve(im));
  for (int k = 0; k < 3; k++) {
    if (k)
      PetscCall(SbMeshFileRefine(im));
    PetscCall(SbMeshFileMeasure(im, &facts));
    if (!k)
      volume = facts.body.volume;
    SB_CHECK(!strstr(facts.body.note, "refused"), "%s: %s", path, facts.body.note);
    SB_CHECK(im->nmiddle.n > 3 * nedge, "%s: %d curved edges after %d", path, (int)im->nmiddle.n,
             (int)nedge);
    SB_CHECK_NEAR(facts.body.volume, volume, 1e-13 * volume, "volume of curved tets");
    nedge = im->nmiddle.n;
  }
  SB_CHECK(PetscAbsReal(volume - straight) > 1e-4 * straight,
           "%s: volume %g with edges as with none", path, volume);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbImport *im;
  SbMeshStatistics coarse, fine;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_edges());
  PetscCall(test_children("tests/data/two_cubes_41.msh"));
  PetscCall(test_children("box:1,2,3:2"));

  /* a refined mesh is valid, its triangles are faces, and the boundary has four facets for each of
     the old ones */
  PetscCall(test_read("tests/data/two_cubes_41.msh", 0, &im));
  PetscCall(SbMeshFileMeasure(im, &coarse));
  PetscCall(SbMeshFileRefine(im));
  PetscCall(SbMeshFileMeasure(im, &fine));
  SB_CHECK(im->nlost == 0, "%d triangles are no faces", (int)im->nlost);
  SB_CHECK(fine.body.nfacet == 4 * coarse.body.nfacet, "%d facets", (int)fine.body.nfacet);
  SB_CHECK(fine.body.nvert == coarse.body.nvert + coarse.nedge, "%d vertices",
           (int)fine.body.nvert);
  SB_CHECK_NEAR(fine.body.volume, coarse.body.volume, 1e-13, "volume");
  SB_CHECK_NEAR(fine.area, coarse.area, 1e-12, "area");
  PetscCall(test_free(&im));
  PetscCall(test_shapes());
  PetscCall(test_curved("tests/data/two_cubes_41.msh"));
  PetscCall(test_curved("box:1,2,3:2"));
  SB_TEST_END();
}
