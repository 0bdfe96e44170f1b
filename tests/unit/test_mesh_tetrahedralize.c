// Tets from closed surfaces: exact volumes of nested regions, kept triangles, number of tets by
// size, both backends, error messages. @ranks 1 3
#include "../../src/surface/surface_impl.h"
#include "mesh_test.h"
#include "surface_files.h"

/* Surface of one region with counter-clockwise triangles as seen from outside, or of two: the
   triangles from `inner` on bound the second region. */
static PetscErrorCode make_skin(const TestSurface *t, PetscInt inner, SbSurface *s)
{
  PetscFunctionBeginUser;
  PetscCall(SbSurfaceCreate(t->nvert, t->ntri, inner < t->ntri ? 2 : 1, s));
  for (PetscInt v = 0; v < t->nvert; v++)
    for (int k = 0; k < 3; k++)
      s->x[3 * v + k] = t->x[v][k];
  for (PetscInt f = 0; f < t->ntri; f++) {
    for (int k = 0; k < 3; k++)
      s->tri[3 * f + k] = t->tri[f][k];
    s->side[2 * f] = f < inner ? -1 : 0;
    s->side[2 * f + 1] = f < inner ? 0 : 1;
    s->number[f] = f + 1;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume of the tets of each tag set. */
static void measure(const SbImport *im, PetscInt n, PetscReal volume[])
{
  for (PetscInt i = 0; i < n; i++)
    volume[i] = 0;
  for (PetscInt c = 0; c < im->item[3].n; c++)
    volume[im->item[3].tags[c]] +=
      PetscAbsReal(SbTetDeterminant(im->x, im->item[3].vert + 4 * c)) / 6;
}

/* A sphere within a sphere, each a separate region; the triangles are preserved. */
static PetscErrorCode check_kept(SbTetBackend backend)
{
  TestSurface t = {0};
  SbSurface s;
  SbTetOptions options;
  SbImport im = {0};
  SbFaces faces;
  PetscInt slots[2], none, group[2], nin;
  PetscReal want[2], got[3];

  PetscFunctionBeginUser;
  test_surface_sphere(2, &t);
  nin = t.ntri;
  test_surface_shifted_copy(&t, 0.4, 0.1);
  PetscCall(make_skin(&t, nin, &s));
  PetscCall(SbImportTagSet(&im, 0, NULL, &none));
  for (int r = 0; r < 2; r++) {
    PetscCall(SbImportGroup(&im, 3, r + 1, NULL, &group[r]));
    PetscCall(SbImportTagSet(&im, 1, &group[r], &s.region_tags[r]));
  }
  for (PetscInt f = nin; f < t.ntri; f++)
    s.tags[f] = s.region_tags[0];
  (void)SbSurfaceMeasure(&s, want);
  SbTetDefaults(&options);
  options.backend = backend;
  options.surface = SB_TET_KEEP;
  PetscCall(SbTetrahedralize("test", &s, &options, &im));
  measure(&im, 3, got);
  SB_CHECK_NEAR(got[s.region_tags[0]], want[0], 1e-11, "outer region");
  SB_CHECK_NEAR(got[s.region_tags[1]], want[1], 1e-11, "inner region");
  SB_CHECK(im.item[3].n > 400 && im.item[3].n < 8000, "%d tets", (int)im.item[3].n);
  SB_CHECK(im.item[2].n == nin, "%d triangles of groups", (int)im.item[2].n);
  for (PetscInt i = 0; i < 3 * s.nvert; i++)
    SB_CHECK(im.x[i] == s.x[i], "vertex %d moved", (int)i / 3);
  PetscCall(SbImportCheck(&im, &faces));
  SB_CHECK(faces.nboundary == nin, "%d facets", (int)faces.nboundary);
  for (PetscInt f = 0; f < t.ntri; f++) {
    const PetscInt n = SbFacesFind(&faces, s.tri + 3 * f, slots);

    SB_CHECK(n == (f < nin ? 1 : 2), "triangle %d has %d tets", (int)f, (int)n);
  }
  PetscCall(SbFacesDestroy(&faces));
  PetscCall(SbImportDestroy(&im));
  PetscCall(SbSurfaceDestroy(&s));
  test_surface_free(&t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unit sphere at three sizes: half the size gives about eight times as many tets, none of them
   bad. */
static PetscErrorCode check_sizes(void)
{
  const PetscReal sizes[3] = {0.5, 0.35, 0.25};
  TestSurface t = {0};
  SbSurface s;
  SbTetOptions options;
  PetscReal per[3];

  PetscFunctionBeginUser;
  test_surface_sphere(3, &t);
  PetscCall(make_skin(&t, t.ntri, &s));
  for (int k = 0; k < 3; k++) {
    SbImport im = {0};
    SbMeshStatistics facts;
    const SbBody *body = &facts.body;
    PetscReal volume;
    PetscInt none;

    PetscCall(SbImportTagSet(&im, 0, NULL, &none));
    SbTetDefaults(&options);
    options.size = sizes[k];
    options.surface = SB_TET_REMESH;
    PetscCall(SbTetrahedralize("test", &s, &options, &im));
    measure(&im, 1, &volume);
    SB_CHECK_NEAR(volume, 4 * PETSC_PI / 3, 0.12 * 4 * PETSC_PI / 3, "sphere");
    per[k] = (PetscReal)im.item[3].n * sizes[k] * sizes[k] * sizes[k];
    SB_CHECK(per[k] > 3 * PETSC_SQRT2 * volume && per[k] < 12 * PETSC_SQRT2 * volume,
             "size %g: %d tets", sizes[k], (int)im.item[3].n);
    PetscCall(SbMeshFileMeasure(&im, &facts));
    SB_CHECK(body->min_dihedral > 8, "size %g: smallest dihedral angle %g", sizes[k],
             body->min_dihedral);
    SB_CHECK(strstr(body->note, "surface remeshed"), "'%s'", body->note);
    PetscCall(SbImportDestroy(&im));
  }
  for (int k = 1; k < 3; k++)
    SB_CHECK(per[k] / per[0] > 0.6 && per[k] / per[0] < 1.7, "sizes 0 and %d: %g and %g", k, per[0],
             per[k]);
  PetscCall(SbSurfaceDestroy(&s));
  test_surface_free(&t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A ring thinner than the size: gmsh's new surface would lose its volume, which is detected; tetgen
   preserves the triangles, and a note gives the reason. */
static PetscErrorCode check_second_road(void)
{
  const PetscInt n[2] = {60, 10};
  TestSurface t = {0};
  SbSurface s;
  SbTetOptions options;
  SbImport im = {0};
  PetscReal want, got;

  PetscFunctionBeginUser;
  test_surface_torus(1, 0.1, n, &t);
  PetscCall(make_skin(&t, t.ntri, &s));
  (void)SbSurfaceMeasure(&s, &want);
  SbTetDefaults(&options);
  options.size = 0.4;
  options.surface = SB_TET_REMESH;
  PetscCall(SbTetrahedralize("test", &s, &options, &im));
  measure(&im, 1, &got);
  SB_CHECK_NEAR(got, want, 1e-9, "ring");
  SB_CHECK(strstr(im.note, "by tetgen, surface kept"), "'%s'", im.note);
  SB_CHECK(strstr(im.note, "(before that gmsh: its tets fill "), "'%s'", im.note);
  PetscCall(SbImportDestroy(&im));
  options.backend = SB_TET_GMSH;
  SB_CHECK_ERROR(SbTetrahedralize("test", &s, &options, &im), PETSC_ERR_USER_INPUT, "region 1");
  options.backend = SB_TET_AUTO;
  options.seconds = 1e-3;
  SB_CHECK_ERROR(SbTetrahedralize("test", &s, &options, &im), PETSC_ERR_USER_INPUT,
                 "0.001 s|-seconds");
  PetscCall(SbSurfaceDestroy(&s));
  test_surface_free(&t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What neither backend supports: two intersecting boxes that bypass the checks. */
static PetscErrorCode check_failure(void)
{
  const PetscReal lo[3] = {0, 0, 0};
  const PetscReal hi[3] = {1, 1, 1};
  const PetscReal lo2[3] = {0.5, 0.4, 0.3};
  const PetscReal hi2[3] = {1.5, 1.6, 1.7};
  TestSurface t = {0};
  SbSurface s;
  SbTetOptions options;
  SbImport im = {0};

  PetscFunctionBeginUser;
  test_surface_box(lo, hi, PETSC_FALSE, &t);
  test_surface_box(lo2, hi2, PETSC_FALSE, &t);
  PetscCall(make_skin(&t, t.ntri, &s));
  SbTetDefaults(&options);
  SB_CHECK_ERROR(SbTetrahedralize("test", &s, &options, &im), PETSC_ERR_USER_INPUT, "gmsh|tetgen");
  SB_CHECK_ERROR(SbTetrahedralize("test", &s, &options, &im), PETSC_ERR_USER_INPUT, "test|gmsh");
  SB_CHECK(!im.x && !im.item[3].n, "something is left");
  options.size = 1e-6;
  SB_CHECK_ERROR(SbTetrahedralize("test", &s, &options, &im), PETSC_ERR_USER_INPUT,
                 "1e-06 m|-size");
  for (PetscInt f = 0; f < t.ntri; f++)
    s.side[2 * f] = 0, s.side[2 * f + 1] = -1;
  SB_CHECK_ERROR(SbTetrahedralize("test", &s, &options, &im), PETSC_ERR_USER_INPUT,
                 "region 1|-2.68");
  PetscCall(SbSurfaceDestroy(&s));
  test_surface_free(&t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  if (!test_rank) {
    PetscCall(check_kept(SB_TET_GMSH));
    PetscCall(check_kept(SB_TET_TETGEN));
    PetscCall(check_sizes());
    PetscCall(check_second_road());
    PetscCall(check_failure());
  }
  SB_TEST_END();
}
