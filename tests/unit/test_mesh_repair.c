// Repair: each kind of damage is found, counted and removed; damage that cannot be repaired is an
// error. @ranks 1
#include "mesh_same.h"

static PetscErrorCode repaired(SbImport *im, PetscReal merge_tolerance, SbRepair *r,
                               SbMeshStatistics *facts)
{
  PetscFunctionBeginUser;
  PetscCall(SbMeshFileRepair(im, merge_tolerance, r));
  PetscCall(SbMeshFileMeasure(im, facts));
  SB_CHECK(!strstr(facts->body.note, "unused") && !strstr(facts->body.note, "inverted") &&
             !strstr(facts->body.note, "no face"),
           "still to note: %s", facts->body.note);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gives every tet separate vertices, shifted by up to `by`. */
static PetscErrorCode tear(SbImport *im, PetscReal by)
{
  const PetscInt n = 4 * im->item[3].n;
  PetscRandom random;
  PetscReal *x, r;

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &random));
  PetscCall(PetscRandomSetInterval(random, -1, 1));
  PetscCall(PetscRandomSetSeed(random, 7));
  PetscCall(PetscRandomSeed(random));
  PetscCall(PetscMalloc1(3 * (size_t)n, &x));
  for (PetscInt i = 0; i < n; i++) {
    for (int k = 0; k < 3; k++) {
      PetscCall(PetscRandomGetValueReal(random, &r));
      x[3 * i + k] = im->x[3 * im->item[3].vert[i] + k] + by * r;
    }
    im->item[3].vert[i] = i;
  }
  PetscCall(PetscFree(im->x));
  PetscCall(PetscFree(im->vert_number));
  PetscCall(PetscMalloc1(n, &im->vert_number));
  for (PetscInt i = 0; i < n; i++)
    im->vert_number[i] = i + 1;
  im->x = x;
  im->nvert = n;
  for (int d = 0; d < 3; d++)
    im->item[d].n = 0;
  PetscCall(PetscRandomDestroy(&random));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_weld(void)
{
  SbImport *im;
  SbRepair r;
  SbMeshStatistics facts;

  PetscFunctionBeginUser;
  PetscCall(test_read("box:1,1,1:4", 0, &im));
  PetscCall(tear(im, 1e-12));
  PetscCall(repaired(im, -1, &r, &facts));
  SB_CHECK(r.nwelded == 4 * 384 - 125, "%d welded", (int)r.nwelded);
  SB_CHECK(r.nunused == 0, "%d unused", (int)r.nunused);
  SB_CHECK(facts.body.nvert == 125 && facts.body.ncell == 384 && facts.body.npart == 1,
           "%d vertices, %d tets, %d parts", (int)facts.body.nvert, (int)facts.body.ncell,
           (int)facts.body.npart);
  SB_CHECK_NEAR(facts.body.volume, 1, 1e-10, "volume");
  SB_CHECK_NEAR(r.merge_tolerance, 1e-9 * sqrt(3.), 1e-11, "tolerance");
  PetscCall(test_free(&im));

  PetscCall(test_read("box:1,1,1:4", 0, &im));
  PetscCall(tear(im, 0));
  PetscCall(repaired(im, 0, &r, &facts));
  SB_CHECK(r.nwelded == 0 && facts.body.npart == 384, "%d welded, %d parts", (int)r.nwelded,
           (int)facts.body.npart);
  PetscCall(test_free(&im));

  /* a tolerance above the cell size: tets collapse, and the remaining mesh is valid */
  PetscCall(test_read("box:1,1,1:4", 0, &im));
  PetscCall(repaired(im, 0.3, &r, &facts));
  SB_CHECK(r.nwelded > 0 && r.ncollapsed > 0 && facts.body.ncell > 0, "%d welded, %d collapsed",
           (int)r.nwelded, (int)r.ncollapsed);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two groups with one tet, given twice; a flat tet between others; an inverted one; an unused
   vertex. */
static PetscErrorCode test_all_at_once(void)
{
  SbImport *im;
  SbRepair r;
  SbMeshStatistics facts;
  PetscInt group, tags, v[4], *first;
  char text[256];

  PetscFunctionBeginUser;
  PetscCall(test_read("tests/data/two_cubes_41.msh", 0, &im));
  first = im->item[3].vert;
  PetscCall(SbImportGroup(im, 3, 99, "again", &group));
  PetscCall(SbImportTagSet(im, 1, &group, &tags));
  for (int a = 0; a < 4; a++)
    v[a] = first[3 - a];
  PetscCall(SbImportAddItem(im, 3, v, tags, 1000));
  for (int a = 0; a < 4; a++)
    v[a] = im->item[3].vert[4 + PetscMin(a, 2)];
  PetscCall(SbImportAddItem(im, 3, v, tags, 1001));
  for (int a = 0; a < 3; a++)
    v[a] = im->item[2].vert[a];
  PetscCall(SbImportAddItem(im, 2, v, 0, 1002));
  v[0] = im->item[3].vert[8];
  im->item[3].vert[8] = im->item[3].vert[9];
  im->item[3].vert[9] = v[0];
  PetscCall(repaired(im, -1, &r, &facts));
  SB_CHECK(r.nduplicate == 1 && r.ncollapsed == 1 && r.nturned == 1 && r.nitem == 1 && r.nflat == 0,
           "%d again, %d collapsed, %d turned, %d items, %d flat", (int)r.nduplicate,
           (int)r.ncollapsed, (int)r.nturned, (int)r.nitem, (int)r.nflat);
  SB_CHECK(facts.body.ncell == 48, "%d tets", (int)facts.body.ncell);
  SB_CHECK_NEAR(facts.body.volume, 2, 1e-12, "volume");
  test_groups_of(im, 3, 0, sizeof(text), text);
  SB_CHECK(strstr(text, "99 again") && strstr(text, " left"), "the first tet is in '%s'", text);
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Removal of a flat tet between its neighbours leaves a slit; that of one on the boundary does
   not. */
static PetscErrorCode test_flat(void)
{
  static const PetscInt ring[5] = {0, 1, 2, 3, 0};
  SbImport im = {0};
  SbRepair r;
  SbMeshStatistics facts;
  PetscInt v[4];

  PetscFunctionBeginUser;
  (void)snprintf(im.where, sizeof(im.where), "flat");
  PetscCall(SbImportTagSet(&im, 0, NULL, &v[0]));

  /* a square 0 1 2 3 that is itself a flat tet, with a pyramid above and one below, divided along
     the two diagonals */
  PetscCall(SbImportSetVertices(&im, 6));
  {
    static const PetscReal x[18] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, .5, .5, 1, .5, .5, -1};

    PetscCall(PetscArraycpy(im.x, x, 18));
  }
  for (PetscInt i = 0; i < 6; i++)
    im.vert_number[i] = i + 1;
  PetscCall(SbImportAddItem(&im, 3, ring, 0, 1));
  PetscCall(SbImportAddItem(&im, 3, (PetscInt[4]){0, 1, 2, 4}, 0, 2));
  PetscCall(SbImportAddItem(&im, 3, (PetscInt[4]){0, 2, 3, 4}, 0, 3));
  PetscCall(SbImportAddItem(&im, 3, (PetscInt[4]){0, 3, 1, 5}, 0, 4));
  PetscCall(SbImportAddItem(&im, 3, (PetscInt[4]){1, 3, 2, 5}, 0, 5));
  PetscCall(repaired(&im, -1, &r, &facts));
  SB_CHECK(r.nflat == 1 && r.nslit == 1, "%d flat, %d slits", (int)r.nflat, (int)r.nslit);
  SB_CHECK(facts.body.ncell == 4 && facts.body.nfacet == 12, "%d tets, %d facets",
           (int)facts.body.ncell, (int)facts.body.nfacet);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A curved edge is removed with the flat tet that alone has it: the repaired mesh can be read
   again. */
static PetscErrorCode test_curved_edges(void)
{
  static const PetscInt flat[4] = {0, 1, 2, 3};
  static const PetscInt end[2][2] = {{1, 2}, {0, 7}};
  SbImport *im, *again;
  SbRepair r;

  PetscFunctionBeginUser;
  PetscCall(test_read("box:1,1,1:1", 0, &im));
  PetscCall(SbImportAddItem(im, 3, flat, 0, 7));
  PetscCall(PetscMalloc1(2, &im->middle));
  im->nmiddle = (SbCount){2, 2};
  for (int i = 0; i < 2; i++)
    im->middle[i] = (SbMiddle){.end = {end[i][0], end[i][1]}, .node = -1, .off = {0, 0, 0.1}};
  PetscCall(SbMeshFileRepair(im, -1, &r));
  SB_CHECK(r.nflat == 1 && im->item[3].n == 6, "%d flat, %d tets", (int)r.nflat,
           (int)im->item[3].n);
  SB_CHECK(im->nmiddle.n == 1 && im->middle[0].end[1] == 7, "%d curved edges", (int)im->nmiddle.n);
  PetscCall(test_round(im, "repaired.h5", SB_MESH_H5, &again));
  test_same(im, again, "repaired");
  PetscCall(test_free(&again));
  PetscCall(test_free(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SbImport *im;
  SbRepair r;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_weld());
  PetscCall(test_all_at_once());
  PetscCall(test_flat());
  PetscCall(test_curved_edges());

  /* what cannot be repaired */
  PetscCall(test_read("tests/data/bad_flat.msh", 0, &im));
  SB_CHECK_ERROR(SbMeshFileRepair(im, -1, &r), PETSC_ERR_USER_INPUT,
                 "body 'b'|tests/data/bad_flat.msh");
  PetscCall(test_free(&im));
  PetscCall(test_read("tests/data/bad_three.msh", 0, &im));
  SB_CHECK_ERROR(SbMeshFileRepair(im, -1, &r), PETSC_ERR_USER_INPUT,
                 "body 'b'|tests/data/bad_three.msh|2");
  PetscCall(test_free(&im));
  SB_TEST_END();
}
