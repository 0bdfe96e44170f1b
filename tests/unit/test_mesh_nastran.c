// Nastran bulk data: continuations by their mark, coordinate systems of points, entries that change
// nodes or elements.
// @ranks 1
#include <sys/stat.h>
#include "mesh_test.h"
#include "../file.h"

static char folder[512];

#define GRIDS "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
#define EDGES                                                                \
  "GRID,5,,.5,0.,0.\nGRID,6,,.5,.5,0.\nGRID,7,,0.,.5,0.\nGRID,8,,0.,0.,.5\n" \
  "GRID,9,,.5,0.,.5\nGRID,10,,0.,.5,.5\n"
#define FIRST "CTETRA         1       1       1       2       3       4       5       6"
#define SECOND "CTETRA         2       1       1       2       3       4       5       6"

/* A tet of volume 1/6 (corners in any order) with its largest coordinates. */
static const struct {
  const char *text;
  PetscReal volume; /* in sixths */
  PetscReal most[3];
  const char *note;
} cases[] = {
  /* by the mark, behind other entries, before its entry, in a large field, beside another one */
  {GRIDS EDGES FIRST "+E0     \nMAT1,1,1.\n+E0            7       8       9      10\n",
   1,
   {1, 1, 1},
   ""},
  {"+E0            7       8       9      10\n" GRIDS EDGES FIRST "+E0\n", 1, {1, 1, 1}, ""},
  {"GRID*                  1                              0.              0.*N1\n"
   "GRID*                  2                              1.              0.*N2\n"
   "*N2                   0.\n*N1                   0.\n"
   "GRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nCTETRA,1,1,1,2,3,4\n",
   1,
   {1, 1, 1},
   ""},
  {GRIDS EDGES FIRST "+A\nCTETRA,3,1,1,2,3,4\n+B             7       8       9      10\n"
                     "+A             7       8       9      10\n" SECOND "+B\n",
   3,
   {1, 1, 1},
   ""},
  /* something in the tenth field that is no mark */
  {GRIDS "CTETRA         1       1       1       2       3       4                0001\n",
   1,
   {1, 1, 1},
   ""},
  /* systems: shifted and turned (z along x), cylindrical, spherical, by nodes, one in another */
  {"CORD2R,5,,5.,0.,0.,6.,0.,0.,\n,5.,1.,0.\nGRID,1,5,0.,0.,0.\nGRID,2,5,1.,0.,0.\n"
   "GRID,3,5,0.,1.,0.\nGRID,4,5,0.,0.,2.\nCTETRA,1,1,1,2,3,4\n",
   2,
   {7, 1, 1},
   ""},
  {"GRDSET,,5\nCORD2C,5,,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\n"
   "GRID,3,,1.,90.,0.\nGRID,4,0,0.,0.,1.\nCTETRA,1,1,1,2,3,4\n",
   1,
   {1, 1, 1},
   ""},
  {"CORD2S,5,,0.,0.,0.,0.,0.,1.,\n,1.,0.,0.\nGRID,1,5,0.,0.,0.\nGRID,2,5,1.,90.,0.\n"
   "GRID,3,5,1.,90.,90.\nGRID,4,5,1.,0.,33.\nCTETRA,1,1,1,2,3,4\n",
   1,
   {1, 1, 1},
   ""},
  {"GRID,1,,1.,0.,0.\nGRID,2,,1.,0.,1.\nGRID,3,,2.,0.,0.\nCORD1R,6,1,2,3\n"
   "CORD2R,7,6,0.,0.,3.,0.,0.,4.,\n,1.,0.,3.\nGRID,4,7,0.,1.,0.\nCTETRA,1,1,1,2,3,4\n",
   1,
   {2, 1, 3},
   ""},
  /* elements that a mesh does not need */
  {GRIDS "CTETRA,1,1,1,2,3,4\nPLOTEL,7,1,2\nCTRIAX6,8,1,1,2,3\n",
   1,
   {1, 1, 1},
   "PLOTEL (1), CTRIAX6 (1)"},
  {GRIDS "CTETRA,1,1,1,2,3,4\nCELAS1,7,1,1,1,2,1\nCONM2,8,1,,1.\n", 1, {1, 1, 1}, "CELAS1 (1)"},
};

static PetscErrorCode test_read(void)
{
  char path[600];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/a.bdf", folder);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    PetscReal most[3] = {-1e9, -1e9, -1e9};
    PetscReal volume = 0;
    SbImport im;

    PetscCall(test_file_put(path, cases[k].text));
    PetscCall(test_import(path, &im));
    for (PetscInt i = 0; i < 3 * im.nvert; i++)
      most[i % 3] = PetscMax(most[i % 3], im.x[i]);
    for (PetscInt i = 0; i < im.item[3].n; i++)
      volume += PetscAbsReal(SbTetDeterminant(im.x, im.item[3].vert + 4 * i));
    SB_CHECK(PetscAbsReal(volume - cases[k].volume) < 1e-12, "case %d: volume %g", (int)k, volume);
    for (int i = 0; i < 3; i++)
      SB_CHECK(PetscAbsReal(most[i] - cases[k].most[i]) < 1e-12,
               "case %d: largest coordinate %d is %g", (int)k, i, most[i]);
    SB_CHECK(!im.nmiddle.n, "case %d: %d edges are off their middle", (int)k, (int)im.nmiddle.n);
    SB_CHECK(!cases[k].note[0] || strstr(im.note, cases[k].note), "case %d: '%s'", (int)k, im.note);
    PetscCall(SbImportDestroy(&im));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refused(void)
{
  static const char *const bad[][2] = {
    {GRIDS EDGES FIRST "+E0\nENDDATA\n", "line 11|'+E0'"},
    {GRIDS EDGES FIRST "+E0\n" SECOND "+E0\nMAT1,1,1.\n+E0            7       8       9      10\n",
     "line 12|'+E0'"},
    {GRIDS EDGES FIRST "\n+E0            7       8       9      10\n", "line 12|'+E0'"},
    {GRIDS "=,*(1),=,*(1.),==\n", "line 5|replication"},
    {GRIDS "GRIDG,9,,1.,1.,1.\n", "line 5|GRIDG"},
    {GRIDS "CHEX20,1,1,1,2,3,4\n", "line 5|CHEX20"},
    {GRIDS "CTETFD,1,1,1,2,3,4\n", "line 5|CTETFD"},
    {GRIDS "CIFHEX,1,1,1,2,3,4\n", "line 5|CIFHEX"},
    {GRIDS "SEMPLN,1,PLANE,1,2,3\n", "line 5|SEMPLN"},
    {GRIDS "BEGIN SUPER=1\n", "line 5|BEGIN"},
    {"CORD2R,5,5,5.,0.,0.,6.,0.,0.,\n,5.,1.,0.\nGRID,1,5,0.,0.,0.\n", "line 1|system 5"},
    {"CORD2R,5,,5.,0.,0.,6.,0.,0.,\n,7.,0.,0.\nGRID,1,5,0.,0.,0.\n", "line 1|system 5|on a line"},
    {"GRID,1,7,0.,0.,0.\n", "line 1|system 7"},
  };
  char path[600];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/bad.nas", folder);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(bad); k++) {
    PetscCall(test_file_put(path, bad[k][0]));
    SB_CHECK_ERROR(test_mesh_use(path), PETSC_ERR_FILE_UNEXPECTED, bad[k][1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesh in several files and folders; messages name the one that is wrong, and its line. */
static PetscErrorCode test_include(void)
{
  static const char *const files[][2] = {
    {"main.bdf", "SOL 101\n$ INCLUDE 'not.bdf'\nINCLUDE 'case.txt'\nBEGIN BULK\n"
                 "include 'sub/\n   mesh.bdf  ' $ in two lines\nSPC1,1,123,1,2\nENDDATA\n"
                 "INCLUDE 'behind.bdf'\n"},
    {"case.txt", "SUBCASE 1\n"},
    {"sub/mesh.bdf",
     "INCLUDE nodes.bdf $ beside this one\nCTETRA,1,7,1,2,3,4\nINCLUDE \"set.bdf\"\n"
     "INCLUDE '..\\case.bdf'\n"},
    {"sub/nodes.bdf", GRIDS},
    {"set.bdf", "SET1,5,1,2,3"}, /* not there beside mesh.bdf */
    {"case.bdf", "$ Femap Property 7 : liver\n"},
    {"wrong.bdf", GRIDS "INCLUDE\n 'wrong.inc'\n"},
    {"deep.bdf", GRIDS "INCLUDE 'wrong.inc'\nCTETRA,1,7,1,2,3,4\n"},
    {"wrong.inc", "$\nGRID,9,,1.,one,1.\n"},
    {"after.bdf", "INCLUDE 'three.inc'\n" GRIDS "CTETRA,1,7,1,2,3,9\n"},
    {"three.inc", "$\n$\n$\n"},
    {"two.bdf", "$\nINCLUDE 'thr\nee.inc'\n" GRIDS "CTETRA,1,7,1,2,3,9\n"},
    {"loop.bdf", "INCLUDE 'sub/loop.inc'\n"},
    {"sub/loop.inc", "$\nINCLUDE '../sub/../loop.bdf'\n"},
    {"none.bdf", GRIDS "INCLUDE 'none.inc'\n"},
    {"open.bdf", GRIDS "INCLUDE 'none.inc\n"},
    {"ends.bdf", "INCLUDE 'ends.inc'\nCTETRA,1,7,1,2,3,4\n"},
    {"ends.inc", GRIDS "ENDDATA\n"},
    {"0.bdf", "INCLUDE '1.bdf'\n"},
    {"1.bdf", "INCLUDE '2.bdf'\n"},
    {"2.bdf", "INCLUDE '3.bdf'\n"},
    {"3.bdf", "INCLUDE '4.bdf'\n"},
    {"4.bdf", "INCLUDE '5.bdf'\n"},
    {"5.bdf", "INCLUDE '6.bdf'\n"},
    {"6.bdf", "INCLUDE '7.bdf'\n"},
    {"7.bdf", "INCLUDE '8.bdf'\n"},
    {"8.bdf", "INCLUDE '9.bdf'\n"},
    {"9.bdf", "$\nINCLUDE '10.bdf'\n"},
    {"10.bdf", GRIDS},
  };
  static const struct {
    const char *name, *words;
    PetscErrorCode code;
  } bad[] = {{"wrong.bdf", "wrong.bdf|line 5|INCLUDE", PETSC_ERR_FILE_UNEXPECTED},
             {"deep.bdf", "wrong.inc line 2|'one'", PETSC_ERR_FILE_UNEXPECTED},
             {"after.bdf", "after.bdf line 6|node 9", PETSC_ERR_FILE_UNEXPECTED},
             {"two.bdf", "two.bdf line 8|node 9", PETSC_ERR_FILE_UNEXPECTED},
             {"loop.bdf", "loop.inc line 2|itself", PETSC_ERR_FILE_UNEXPECTED},
             {"none.bdf", "none.inc", PETSC_ERR_FILE_OPEN},
             {"open.bdf", "open.bdf|line 5|does not end", PETSC_ERR_FILE_UNEXPECTED},
             {"ends.bdf", "ends.inc line 5|ENDDATA", PETSC_ERR_FILE_UNEXPECTED},
             {"0.bdf", "9.bdf line 2|10", PETSC_ERR_FILE_UNEXPECTED}};
  char path[600];
  SbImport im;

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/sub", folder);
  SB_CHECK(!mkdir(path, 0700), "no folder %s", path);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(files); k++) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, files[k][0]);
    PetscCall(test_file_put(path, files[k][1]));
  }
  (void)snprintf(path, sizeof(path), "%s/main.bdf", folder);
  PetscCall(test_import(path, &im));
  SB_CHECK(im.nvert == 4 && test_count(&im, 3, "liver") == 1 && test_count(&im, 0, "spc_1") == 2 &&
             test_count(&im, 0, "set_5") == 3,
           "%d nodes, %d tets", (int)im.nvert, (int)im.item[3].n);
  PetscCall(SbImportDestroy(&im));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(bad); k++) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, bad[k].name);
    SB_CHECK_ERROR(test_mesh_use(path), bad[k].code, bad[k].words);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(folder));
  PetscCall(test_read());
  PetscCall(test_refused());
  PetscCall(test_include());
  SB_TEST_END();
}
