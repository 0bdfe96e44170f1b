// Abaqus input files: keywords that change nodes or elements are honoured or refused by name; parts
// and instances; elements that a mesh does not need.
// @ranks 1
#include "mesh_test.h"
#include "../file.h"

static char folder[512];

/* The corner of a cube of edge 1, a tet of volume 1/6. */
#define NODE "*NODE, NSET=n\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
#define TET "*ELEMENT, TYPE=C3D4, ELSET=e\n1, 1,2,3,4\n"
#define PART "*PART, NAME=P\n" NODE TET "*ELSET, ELSET=s\n1\n*SURFACE, NAME=w\ns, S1\n*END PART\n"

typedef struct {
  const char *text;
  PetscInt nvert, ntet;
  PetscReal volume; /* in sixths */
  const char *group;
  int dim;
  PetscInt ngroup; /* number of items of the group */
  PetscReal most[3];
  const char *note;
} Case;

static const Case cases[] = {
  /* radius, angle, height; radius, longitude, latitude */
  {"*NODE, SYSTEM=C\n1,0,0,0\n2,1,0,0\n3,1,90.,0\n4,0,0,1\n" TET,
   4,
   1,
   1,
   "e",
   3,
   1,
   {1, 1, 1},
   ""},
  {"*node , system = s\n1,0,0,0\n2,1,0,0\n3,1,90.,0\n4,1,17,90\n" TET,
   4,
   1,
   1,
   "e",
   3,
   1,
   {1, 1, 1},
   ""},
  /* of contact pairs, and what joins nodes, is said */
  {NODE TET "*TIE, NAME=t\na,b\n*STEP\n*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\na,b\n",
   4,
   1,
   1,
   "e",
   3,
   1,
   {1, 1, 1},
   "*TIE (1), *MODEL CHANGE (1)"},
  /* shifted; axes x -> z, y -> x */
  {"*SYSTEM\n5,0,0\n" NODE TET, 4, 1, 1, "e", 3, 1, {6, 1, 1}, ""},
  {"*SYSTEM\n0,0,2,0,0,3\n7,0,2\n*NODE\n1,0,0,0\n2,3,0,0\n3,0,2,0\n4,0,0,1\n" TET,
   4,
   1,
   6,
   "e",
   3,
   1,
   {2, 1, 5},
   ""},
  /* a keyword on two lines; exponents of Fortran */
  {"*NODE,\n NSET=n\n1,0,0,0\n2,1.D0,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT, "
   "TYPE=C3D4,\nELSET=e\n1,1,2,3,4\n",
   4,
   1,
   1,
   "e",
   3,
   1,
   {1, 1, 1},
   ""},
  /* rules */
  {"*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n11,9,0,0\n12,10,0,0\n13,9,1,0\n14,9,0,1\n"
   "*ELEMENT, TYPE=C3D4, ELSET=e\n1,1,2,3,4\n*ELGEN, ELSET=g\n1,2,10,5\n",
   8,
   2,
   2,
   "g",
   3,
   2,
   {10, 1, 1},
   ""},
  {NODE TET "*NCOPY, OLD SET=n, CHANGE NUMBER=10, NEW SET=m, SHIFT\n9,0,0\n\n"
            "*ELCOPY, OLD SET=e, ELEMENT SHIFT=3, SHIFT NODES=10, NEW SET=f\n",
   8,
   2,
   2,
   "f",
   3,
   1,
   {10, 1, 1},
   ""},
  {"*NODE\n1,0,0,0\n3,2,0,0\n4,0,1,0\n5,0,0,1\n*NGEN, NSET=line\n1,3,1\n"
   "*ELEMENT, TYPE=C3D4, ELSET=e\n1,1,2,4,5\n2,2,3,4,5\n",
   5,
   2,
   2,
   "line",
   0,
   3,
   {2, 1, 1},
   ""},
  /* arcs, around a node and around coordinates */
  {"*NODE\n1,0,1,1\n3,0,-1,1\n4,1,0,0\n5,0,0,0\n*NGEN, LINE=C, NSET=line\n1,3,1,5\n"
   "*ELEMENT, TYPE=C3D4, ELSET=e\n1,1,2,5,4\n2,2,3,5,4\n",
   5,
   2,
   2.8284271247461903,
   "line",
   0,
   3,
   {1, 1, 1.4142135623730951},
   ""},
  {"*NODE\n1,0,6,1\n3,0,4,1\n4,1,5,0\n5,0,5,0\n*NGEN, LINE=C, NSET=line\n1,3,1,,0,5,0\n"
   "*ELEMENT, TYPE=C3D4, ELSET=e\n1,1,2,5,4\n2,2,3,5,4\n",
   5,
   2,
   2.8284271247461903,
   "line",
   0,
   3,
   {1, 6, 1.4142135623730951},
   ""},
  {"*NODE\n1,0,0,0\n2,0,1,0\n3,0,0,1\n101,2,0,0\n102,2,1,0\n103,2,0,1\n*NSET, NSET=a\n1,2,3\n"
   "*NSET, NSET=b\n101,102,103\n*NFILL, NSET=all\na,b,2,50\n"
   "*ELEMENT, TYPE=C3D4, ELSET=e\n1,1,2,3,51\n2,51,52,53,101\n",
   9,
   2,
   2,
   "all",
   0,
   9,
   {2, 1, 1},
   ""},
  {NODE TET "*NSET, NSET=x, ELSET=e\n", 4, 1, 1, "x", 0, 4, {1, 1, 1}, ""},
  /* instances: not moved; turned about an axis; twice, with a set of the same name outside */
  {PART "*INSTANCE, NAME=I, PART=p\n0., 0., 0.\n*END INSTANCE\n*NODE\n1, 9,9,9\n"
        "*NSET, NSET=top, INSTANCE=I\n4\n",
   5,
   1,
   1,
   "top",
   0,
   1,
   {9, 9, 9},
   ""},
  {PART "*INSTANCE, NAME=I, PART=P\n0,0,3\n5,0,0,5,0,1,180.\n*END INSTANCE\n",
   4,
   1,
   1,
   "w",
   2,
   1,
   {10, 0, 4},
   ""},
  {PART
   "*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*INSTANCE, NAME=J, PART=P\n0,0,7\n*END INSTANCE\n"
   "*ELSET, ELSET=s\nI.s, J.1\n",
   8,
   2,
   2,
   "s",
   3,
   2,
   {1, 1, 8},
   ""},
  {PART
   "*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*INSTANCE, NAME=J, PART=P\n0,0,7\n*END INSTANCE\n",
   8,
   2,
   2,
   "J.w",
   2,
   1,
   {1, 1, 8},
   ""},
  {PART
   "*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*INSTANCE, NAME=J, PART=P\n0,0,7\n*END INSTANCE\n",
   8,
   2,
   2,
   "J",
   3,
   1,
   {1, 1, 8},
   ""},
  {PART "*PART, NAME=Q\n*NODE\n1,4,0,0\n2,5,0,0\n3,4,1,0\n4,4,0,1\n" TET "*END PART\n",
   8,
   2,
   2,
   "Q",
   3,
   1,
   {5, 1, 1},
   ""},
  /* what a mesh does not need */
  {NODE TET "*ELEMENT, TYPE=SPRINGA\n7,1,2\n8,1,3\n*ELEMENT, TYPE=MASS, ELSET=m\n9,1\n*ELEMENT, "
            "TYPE=GAPUNI\n10,1,2\n",
   4,
   1,
   1,
   "e",
   3,
   1,
   {1, 1, 1},
   "SPRINGA"},
  {NODE TET "*SURFACE, NAME=k, TYPE=NODE\nn\n", 4, 1, 1, "e", 3, 1, {1, 1, 1}, "surface k"},
  {"*NODE\r1,0,0,0\r2,1,0,0\r3,0,1,0\r4,0,0,1\r*ELEMENT, TYPE=C3D4, "
   "ELSET=K\xc3\xb6rper\r1,1,2,3,4\r",
   4,
   1,
   1,
   "K\xc3\xb6rper",
   3,
   1,
   {1, 1, 1},
   ""},
};

static PetscErrorCode test_read(void)
{
  char path[600];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/a.inp", folder);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    const Case *c = &cases[k];
    PetscReal most[3] = {-1e9, -1e9, -1e9};
    PetscReal volume = 0;
    SbImport im;

    PetscCall(test_file_put(path, c->text));
    PetscCall(test_import(path, &im));
    for (PetscInt i = 0; i < 3 * im.nvert; i++)
      most[i % 3] = PetscMax(most[i % 3], im.x[i]);
    for (PetscInt i = 0; i < im.item[3].n; i++)
      volume += PetscAbsReal(SbTetDeterminant(im.x, im.item[3].vert + 4 * i));
    SB_CHECK(im.nvert == c->nvert && im.item[3].n == c->ntet, "case %d: %d nodes, %d tets", (int)k,
             (int)im.nvert, (int)im.item[3].n);
    SB_CHECK_NEAR(volume, c->volume, 1e-12, "volume of the tets");
    for (int i = 0; i < 3; i++)
      SB_CHECK(PetscAbsReal(most[i] - c->most[i]) < 1e-12, "case %d: largest coordinate %d is %g",
               (int)k, i, most[i]);
    SB_CHECK(test_count(&im, c->dim, c->group) == c->ngroup, "case %d: %d in group %s", (int)k,
             (int)test_count(&im, c->dim, c->group), c->group);
    SB_CHECK(c->note[0] ? strstr(im.note, c->note) != NULL : !im.note[0], "case %d: '%s'", (int)k,
             im.note);
    for (PetscInt v = 0; v < im.nvert; v++)
      SB_CHECK(im.vert_number[v] > 0 && im.vert_number[v] < 1000, "case %d: node number %lld",
               (int)k, (long long)im.vert_number[v]);
    PetscCall(SbImportDestroy(&im));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_refused(void)
{
  static const char *const bad[][2] = {
    {"*NODE, SYSTEM=X\n1,0,0,0\n", "line 1|SYSTEM=X"},
    {NODE TET "*STEP\n*STATIC\n*MODEL CHANGE, REMOVE\ne\n", "line 10|*MODEL CHANGE with REMOVE"},
    {NODE TET "*STEP\n*MODEL CHANGE, TYPE=ELEMENT, ADD\ne\n", "line 9|*MODEL CHANGE with ADD"},
    {NODE TET "*REFINE MESH, LIMIT=50\n", "line 8|*REFINE MESH"},
    {NODE "*NGEN, LINE=P\n1,2,1\n", "line 6|*NGEN with LINE"},
    {"*NODE\n1,1,0,0\n3,-1,0,0\n*NGEN, LINE=C\n1,3,1\n", "line 5|half a circle"},
    {"*NODE\n1,1,0,0\n3,0,1,0\n*NGEN, LINE=C\n1,3,1,,.5,0,0\n", "line 5|radii"},
    {"*NODE\n1,1,0,0\n3,0,1,0\n*NGEN, LINE=C\n1,3,1,,0,0,0,0,0,-1\n", "line 5|normal"},
    {NODE "*NGEN\n1,9,1\n", "line 7|node 9"},
    {NODE "*NGEN\n1,2,0\n", "line 7|*NGEN"},
    {NODE "*NFILL, BIAS=0.5\nn,n,2,50\n", "line 6|*NFILL with BIAS"},
    {NODE "*NFILL\nn,m,2,50\n", "line 7|'m'"},
    {NODE "*NCOPY, OLD SET=n, CHANGE NUMBER=10, REFLECT=LINE\n", "line 6|*NCOPY with REFLECT"},
    {NODE "*NCOPY, OLD SET=n, CHANGE NUMBER=10, SHIFT\n1,0,0\n0,0,0,0,0,1,90\n", "line 8|rotation"},
    {NODE TET "*ELGEN\n9,2,1,1\n", "line 9|element 9"},
    {NODE TET "*ELGEN\n1,2000000000,1,1\n", "line 9|*ELGEN"},
    {NODE TET "*ELCOPY, OLD SET=e, ELEMENT SHIFT=1, SHIFT NODES=1, REFLECT\n",
     "line 8|*ELCOPY with REFLECT"},
    {NODE TET "*IMPERFECTION, FILE=x\n", "line 8|*IMPERFECTION"},
    {NODE TET "*NMAP\n", "line 8|*NMAP"},
    {NODE TET "*ADJUST, NODE SET=n, SURFACE=s\n", "line 8|*ADJUST"},
    {"*SYSTEM\n0,0,0,1,0,0\n" NODE TET, "line 1|*SYSTEM"},
    {"*SYSTEM\n0,0,0,1,0,0\n2,0,0\n" NODE TET, "line 1|*SYSTEM"},
    {NODE "*ELEMENT, TYPE=C3D8\n1,1,2,3,4,1,2,3,4\n*SURFACE, NAME=s\n1, S6\n", "hexahedra"},
    {NODE "*ELEMENT, TYPE=COH3D6\n1,1,2,3,1,2,3\n", "line 6|COH3D6"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4,4\n", "line 7|element 1"},
    {PART "*INSTANCE, NAME=I, PART=Q\n*END INSTANCE\n", "'Q'"},
    {PART "*INSTANCE, NAME=I, PART=P\n*END INSTANCE\n*NSET, NSET=x, INSTANCE=J\n1\n", "'J'"},
  };
  char path[600];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/bad.inp", folder);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(bad); k++) {
    PetscCall(test_file_put(path, bad[k][0]));
    SB_CHECK_ERROR(test_mesh_use(path), PETSC_ERR_FILE_UNEXPECTED, bad[k][1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesh in several files; messages name the one that is wrong, and its line. */
static PetscErrorCode test_include(void)
{
  static const char *const files[][2] = {
    {"main.inp", "*INCLUDE, INPUT=part.inc\n*ELSET, ELSET=s\n1\n"},
    {"part.inc", "** nodes\n*NODE, input=nodes.txt, NSET=n\n4,0,0,1\n" TET},
    {"nodes.txt", "1,0,0,0\n2,1,0,0\n3,0,1,0"},
    {"wrong.inp", "**\n*INCLUDE, INPUT=wrong.inc\n" NODE "*ELEMENT, TYPE=C3D4\n1,1,2,3,9\n"},
    {"wrong.inc", "*NODE\n9,1,one,1\n"},
    {"after.inp", "**\n*INCLUDE, INPUT=empty.inc\n" NODE "*ELEMENT, TYPE=C3D4\n1,1,2,3,9\n"},
    {"empty.inc", "** nothing\n**\n"},
    {"loop.inp", "*INCLUDE, INPUT=loop.inc\n"},
    {"loop.inc", "**\n*INCLUDE, INPUT=loop.inc\n"},
    {"none.inp", NODE "*INCLUDE, INPUT=none.inc\n"},
  };
  static const struct {
    const char *name, *words;
    PetscErrorCode code;
  } bad[] = {{"wrong.inp", "wrong.inc line 2|'one'", PETSC_ERR_FILE_UNEXPECTED},
             {"after.inp", "after.inp line 9|node 9", PETSC_ERR_FILE_UNEXPECTED},
             {"loop.inp", "loop.inc line 2|itself", PETSC_ERR_FILE_UNEXPECTED},
             {"none.inp", "none.inc", PETSC_ERR_FILE_OPEN}};
  char path[600];
  SbImport im;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(files); k++) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, files[k][0]);
    PetscCall(test_file_put(path, files[k][1]));
  }
  (void)snprintf(path, sizeof(path), "%s/main.inp", folder);
  PetscCall(test_import(path, &im));
  SB_CHECK(im.nvert == 4 && im.item[3].n == 1 && test_count(&im, 0, "n") == 4 &&
             test_count(&im, 3, "s") == 1,
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
