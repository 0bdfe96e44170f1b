// FEBio's input files of versions 1.2 to 4.0: parts, sets and surfaces, edge nodes, what is skipped
// and said, damaged ones.
// @ranks 1
#include "mesh_test.h"
#include "../file.h"

static char folder[512];

#define NODES                                                                            \
  "<Nodes>\n<node id=\"1\">0,0,0</node><node id=\"2\"> 1.0, 0 ,0 </node>\n"              \
  "<node id=\"3\">0,1e0,0</node>\n<node id=\"4\">0,0,1</node><!-- <node id=\"5\"> -->\n" \
  "<node id=\"7\">1,1,1</node></Nodes>\n"
#define SPEC(version) \
  "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<febio_spec version=\"" version "\">\n"
#define EDGES                                                                                \
  "<node id=\"11\">.5,0,0</node><node id=\"12\">.5,.5,0</node><node id=\"13\">0,.5,0</node>" \
  "<node id=\"14\">0,0,.5</node><node id=\"15\">.5,0,.5</node><node id=\"16\">0,.6,.5</node>"

/* Two tets on both sides of a face, volumes 1/6 and 1/3. */
static const struct {
  const char *text;
  struct {
    PetscInt dim;
    const char *name;
    PetscInt n;
  } group[4];
  const char *note; /* a part of it; "": there is none */
} cases[] = {
  {SPEC("1.2") "<Material><material id=\"1\" name=\"bone\" type=\"x\"><k>1</k></material>"
               "<material id=\"2\" type=\"y\"/></Material>\n<Geometry>" NODES
               "<Elements><tet4 id=\"1\" mat=\"1\">1,2,3,4</tet4><tet4 id=\"2\" mat=\"2\">2, 3, 4,"
               "7</tet4></Elements></Geometry></febio_spec>\n",
   {{3, "bone", 1}, {3, "volume_2", 1}},
   "section Material"},
  {SPEC("2.0") "<Module type=\"solid\"/><Geometry>" NODES
               "<Elements type=\"tet4\" mat=\"1\" elset=\"a\"><elem id=\"1\">1,2,3,4</elem>"
               "</Elements><Elements type='TET4' mat='1' elset='b'><elem id='2'>2,3,4,7</elem>"
               "</Elements><NodeSet name=\"low\"><node id=\"1\"/><node id=\"2\"/></NodeSet>"
               "</Geometry></febio_spec>",
   {{3, "a", 1}, {3, "b", 1}, {0, "low", 2}},
   ""},
  {SPEC("2.5") "<Geometry>" NODES
               "<Elements type=\"tet4\" mat=\"1\" name=\"a &amp; b\"><elem id=\"1\">1,2,3,4</elem>"
               "<elem id=\"2\">2,3,4,7</elem></Elements><NodeSet name=\"p\"><node id=\"7\"/>"
               "<NodeSet node_set=\"q\"/></NodeSet><NodeSet name=\"q\"><node_list>1, 2:4:2"
               "</node_list></NodeSet><Surface name=\"s\"><tri3 id=\"1\">1,2,3</tri3>"
               "<tri3 id=\"2\">1,2,4</tri3></Surface><DiscreteSet name=\"d\"><delem>1,2</delem>"
               "</DiscreteSet></Geometry></febio_spec>",
   {{3, "a & b", 2}, {0, "p", 4}, {0, "q", 3}, {2, "s", 2}},
   "DiscreteSet (1)"},
  {SPEC("3.0") "<Mesh>" NODES "<Elements type=\"tet4\" name=\"all\"><elem id=\"1\">1,2,3,4</elem>"
               "<elem id=\"2\">2,3,4,7</elem></Elements><ElementSet name=\"one\"><e id=\"2\"/>"
               "</ElementSet><NodeSet name=\"p\"><n id=\"7\"/></NodeSet></Mesh>"
               "<Boundary><bc/></Boundary></febio_spec>",
   {{3, "all", 2}, {3, "one", 1}, {0, "p", 1}},
   "section Boundary (1)"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\" name=\"all\"><elem id=\"1\">1,2,3,4</elem>"
               "<elem id=\"2\">2,3,4,7</elem></Elements><NodeSet name=\"p\">1,2,<!-- 3 -->\n4"
               "</NodeSet><ElementSet name=\"one\">1</ElementSet></Mesh><MeshDomains>"
               "<SolidDomain name=\"all\" mat=\"m\"/></MeshDomains></febio_spec>",
   {{3, "all", 2}, {0, "p", 3}, {3, "one", 1}},
   ""},
  {SPEC("4.0\" units=\"mm-N-s") "<Mesh>" NODES
                                "<Elements type=\"tet4\" name=\"all\"><elem id=\"1\">1,2,3,4"
                                "</elem><elem id=\"2\">2,3,4,7</elem></Elements></Mesh>"
                                "</febio_spec>\n",
   {{3, "all", 2}},
   "units of 0.001 m"},
};

/* What must be refused, and what the message says. */
static const char *const bad[][2] = {
  {SPEC("4.0") "<Mesh>" NODES "<Elements from=\"other.feb\"/></Mesh></febio_spec>",
   "line 8|Elements|other.feb"},
  {SPEC("4.0") "<Mesh>" NODES "</Mesh></febio_spec>", "no tetrahedra"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"hex8\" name=\"h\"><elem id=\"1\">1,2,3,4,7,1,2,3"
               "</elem></Elements></Mesh></febio_spec>",
   "hexahedra"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"blob\"><elem id=\"1\">1</elem></Elements>",
   "line 8|blob"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3</elem></Elements>",
   "element 9|3 nodes"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,44</elem></Elements>"
               "</Mesh></febio_spec>",
   "element 9|node 44"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,4", "truncated"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,4</elem>"
               "<elem id=\"9\">2,3,4,7</elem></Elements></Mesh></febio_spec>",
   "element 9 is given twice"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,4</elem></Elements>"
               "<NodeSet name=\"p\">1,8</NodeSet></Mesh></febio_spec>",
   "'p'|node 8"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,4</elem></Elements>"
               "<NodeSet name=\"p\">1:4000</NodeSet></Mesh></febio_spec>",
   "'p'|1 to 4000"},
  {SPEC("4.0") "<Mesh>" NODES "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,4</elem></Elements>"
               "<Surface name=\"s\"><tri3 id=\"1\">1,2,8</tri3></Surface></Mesh></febio_spec>",
   "'s'|node 8"},
  {SPEC("2.5") "<Geometry from=\"other.feb\"/></febio_spec>", "other.feb"},
  {SPEC("2.5") "<Geometry><Part name=\"a\"></Part></Geometry></febio_spec>", "Part"},
  {SPEC("2.5") "<Geometry><Nodes><node id=\"1\">0,x,0</node>", "line 3|node 1|second"},
  {SPEC("2.5") "<Geometry><Nodes></Geometry></febio_spec>", "line 3|Nodes"},
  {"<febio_spec version=\"2.5\"", "no end '>'"},
};

static PetscErrorCode test_read(void)
{
  char path[600];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/a.feb", folder);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(cases); k++) {
    PetscReal volume = 0;
    SbImport im;

    PetscCall(test_file_put(path, cases[k].text));
    PetscCall(test_import(path, &im));
    for (PetscInt i = 0; i < im.item[3].n; i++)
      volume += PetscAbsReal(SbTetDeterminant(im.x, im.item[3].vert + 4 * i));
    SB_CHECK(im.nvert == 5 && im.item[3].n == 2 && PetscAbsReal(volume - 3) < 1e-12,
             "case %d: %d vertices, volume %g", (int)k, (int)im.nvert, volume);
    for (int g = 0; g < 4 && cases[k].group[g].name; g++) {
      const PetscInt n = test_count(&im, cases[k].group[g].dim, cases[k].group[g].name);

      SB_CHECK(n == cases[k].group[g].n, "case %d: group %s has %d", (int)k, cases[k].group[g].name,
               (int)n);
    }
    SB_CHECK(cases[k].note[0] ? strstr(im.note, cases[k].note) != NULL : !im.note[0],
             "case %d: note '%s'", (int)k, im.note);
    PetscCall(SbImportDestroy(&im));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Edge nodes are those of edges 12 23 31 14 24 34; only that of 34 is off its middle. */
static PetscErrorCode test_second_order(void)
{
  static const char *const elements[] = {
    "<Elements type=\"tet10\"><elem id=\"1\">1,2,3,4,11,12,13,14,15,16</elem></Elements>",
    "<node id=\"21\">.3,.3,0</node>",
    "<Elements type=\"tet15\"><elem id=\"1\">1,2,3,4,11,12,13,14,15,16,21,21,21,21,21</elem>"
    "</Elements>"};
  char path[600], text[4096];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/a.feb", folder);
  for (int k = 0; k < 2; k++) {
    SbImport im;

    (void)snprintf(text, sizeof(text),
                   SPEC("3.0") "<Mesh>" NODES "<Nodes>" EDGES
                               "%s</Nodes>%s<Surface name=\"s\"><tri6 id=\"1\">1,2,3,11,12,13"
                               "</tri6></Surface></Mesh></febio_spec>",
                   k ? elements[1] : "", elements[2 * k]);
    PetscCall(test_file_put(path, text));
    PetscCall(test_import(path, &im));
    SB_CHECK(im.item[3].n == 1 && im.nmiddle.n == 1 && test_count(&im, 2, "s") == 1,
             "second order %d: %d tets, %d curved edges", k, (int)im.item[3].n, (int)im.nmiddle.n);
    SB_CHECK(im.nmiddle.n == 1 && PetscAbsReal(im.middle[0].off[1] - 0.1) < 1e-12,
             "second order %d: another edge is curved", k);
    SB_CHECK((strstr(im.note, "tet15") != NULL) == (k == 1), "note '%s'", im.note);
    PetscCall(SbImportDestroy(&im));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A set that lists an element which is not there is said. */
static PetscErrorCode test_missing_element(void)
{
  char path[600];
  SbImport im;

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/a.feb", folder);
  PetscCall(test_file_put(
    path, SPEC("4.0") "<Mesh>" NODES
                      "<Elements type=\"tet4\"><elem id=\"9\">1,2,3,4</elem></Elements><ElementSet "
                      "name=\"some\">9,10</ElementSet></Mesh></febio_spec>"));
  PetscCall(test_import(path, &im));
  SB_CHECK(test_count(&im, 3, "some") == 1 && strstr(im.note, "missing elements of group 'some'"),
           "note '%s'", im.note);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char path[600];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(folder));
  PetscCall(test_read());
  PetscCall(test_second_order());
  PetscCall(test_missing_element());
  (void)snprintf(path, sizeof(path), "%s/b.feb", folder);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(bad); k++) {
    PetscCall(test_file_put(path, bad[k][0]));
    SB_CHECK_ERROR(test_mesh_use(path), PETSC_ERR_FILE_UNEXPECTED, bad[k][1]);
  }
  SB_TEST_END();
}
