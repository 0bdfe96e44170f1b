// Error messages of invalid files in each format have the file, the line or byte, and a remedy.
// @ranks 1
#include <stdlib.h>
#include <unistd.h>
#include "mesh_test.h"

static char folder[] = "/tmp/sbbad_XXXXXX";

static void write_text(const char *name, const char *text)
{
  char path[128];
  FILE *file;

  (void)snprintf(path, sizeof(path), "%s/%s", folder, name);
  file = fopen(path, "wb");
  if (!file)
    return;
  (void)fputs(text, file);
  (void)fclose(file);
}

static PetscErrorCode use_mesh(const char *name)
{
  char path[128];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/%s", folder, name);
  PetscCall(test_mesh_use(path));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  const char *text, *words; /* words NULL: valid */
} Case;

/* A list of cases that ends with a NULL text. */
static PetscErrorCode test_cases(const char *name, const Case cases[])
{
  PetscFunctionBeginUser;
  for (int i = 0; cases[i].text; i++) {
    write_text(name, cases[i].text);
    if (cases[i].words)
      SB_CHECK_ERROR(use_mesh(name), PETSC_ERR_FILE_UNEXPECTED, cases[i].words);
    else
      SB_CHECK(use_mesh(name) == PETSC_SUCCESS, "%s, case %d", name, i);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_tetgen(void)
{
#define NODES "4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
  static const Case node[] = {
    {NODES, NULL},
    {"4 3 0 0\n1 0 0 0\n2 1 0 0\n4 0 1 0\n5 0 0 1\n", "t.node|line 4|point 4|point 2"},
    {"4 3 0 0\n3 0 0 0\n4 1 0 0\n5 0 1 0\n6 0 0 1\n", "t.node|line 2|number 3"},
    {"4 2 0 0\n", "t.node|line 1|dimension 2|3"},
    {"4 3 0 0\n1 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n", "t.node|line 2"},
    {"4 3 0 0\n1 0 nan 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n", "t.node|line 2|point 1"},
    {"4000000000 3 0 0\n1 0 0 0\n", "t.node|line 1|4000000000 points"},
    {"4 3 900000000 0\n1 0 0 0\n2 0 0 0\n3 0 0 0\n", "t.node|line 1|900000000 attributes"},
    {"0 3 0 0\n", "t.node|line 1|0 points"},
    {NULL, NULL}};
  static const Case ele[] = {
    {"1 4 0\n1 1 2 3 4\n", NULL},
    {"# all\n1 4\n1 1 2 3 4\n", NULL},
    {"1 4 0\n1 1 2 3 5\n", "t.ele|line 2|point 5|1|4"},
    {"1 4 0\n1 0 1 2 3\n", "t.ele|line 2|point 0|1|4"},
    {"1 10 0\n1 1 2 3 4 5 6 7 8 9 10\n", "t.ele|line 2|point 5"},
    {"1 3 0\n1 1 2 3\n", "t.ele|line 1|3 points|4"},
    {"1 4 1\n1 1 2 3 4 1.5\n", "t.ele|line 2|1.5"},
    {"1 4 1\n1 1 2 3 4\n", "t.ele|line 2"},
    {"2 4 0\n1 1 2 3 4\n", "t.ele|line 3"},
    {"1 4 0\n1 1 2 3 4 # one\n", NULL},
    {"1 4 3\n1 1 2 3 4 1 2.5 0\n", NULL},
    {"1 4 0\n1 1 2 3 4 1\n", "t.ele|line 2|tetrahedron 1|4 points|0 attributes"},
    {"1 4 1\n1 1 2 3 4 4 3 2 1 1 2\n", "t.ele|line 2|4 points|1 attributes"},
    {"1 0\n1 1 2 3 4 4 3 2 1 1 2\n", "t.ele|line 2|4 points"},
    {"0 4 0\n", "t.ele"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  write_text("t.ele", "1 4 0\n1 1 2 3 4\n");
  PetscCall(test_cases("t.node", node));
  write_text("t.node", NODES);
  PetscCall(test_cases("t.ele", ele));
  write_text("t.ele", "1 4 0\n1 1 2 3 4\n");
  write_text("t.face", "1 1\n1 1 2 9 5\n");
  SB_CHECK_ERROR(use_mesh("t.ele"), PETSC_ERR_FILE_UNEXPECTED, "t.face|line 2|point 9");
  write_text("alone.ele", "1 4 0\n1 1 2 3 4\n");
  SB_CHECK_ERROR(use_mesh("alone.ele"), PETSC_ERR_FILE_OPEN, "alone.node");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_netgen(void)
{
#define POINTS "4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
  static const Case neutral[] = {
    {POINTS "1\n1 1 2 3 4\n1\n1 1 2 3\n", NULL},
    {POINTS "1\n1 1 2 3 4\n", NULL},
    {POINTS "1\n1 1 2 3 4 5 6 7 8 9 10\n", "line 7|element 1|point 5|4"},
    {"12" /* points */ "\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n2 2 2\n3 3 3\n4 4 4\n5 5 5\n6 6 6\n7 "
     "7 7\n8 8 "
     "8\n1\n1 1 2 3 4 5 6 7 8\n",
     "1 hexahedra"},
    {POINTS "1\n1 1 2 3\n", "line 7|3 points|4"},
    {POINTS "0\n1\n1 1 2 3\n", "1 3-node"},
    {"70000000\n0 0 0\n", "line 1|70000000 points"},
    {"4\n0 0 0\n1 0 0\n0 1 0\n0 0 inf\n", "line 5|node 4"},
    {NULL, NULL}};
  static const Case vol[] = {
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\npoints\n" POINTS, NULL},
    {"mesh2d\n", "v.vol|line 1|'mesh3d'|'mesh2d'"},
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\n", "'points'"},
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 7\npoints\n" POINTS, "v.vol|line 4|element 1|point 7"},
    {"mesh3d\nvolumeelements\n1\n1 9 1 2 3 4\npoints\n" POINTS, "v.vol|line 4|9 points"},
    {"mesh3d\nvolumeelements\n2\n1 4 1 2 3 4\npoints\n" POINTS, "v.vol|line 5|'points'"},
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\npoints\n" POINTS "materials\n1\n1\n",
     NULL}, /* no name */
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\npoints\n" POINTS "materials\n1\nx\n", "'x'"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("n.neu", neutral));
  PetscCall(test_cases("n.mesh", neutral));
  PetscCall(test_cases("v.vol", vol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define HEAD "MeshVersionFormatted 1\nDimension 3\n"
#define VERTICES "Vertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
static const Case medit[] = {
  {HEAD VERTICES "Tetrahedra\n1\n1 2 3 4 7\nEnd\n", NULL},
  {HEAD VERTICES "Corners\n2\n1\n2\nTetrahedra 1 1 2 3 4 7\n# fine\nEnd", NULL},
  {"MeshVersionFormatted 2 Dimension 2\n", "line 1|dimension 2|3"},
  {"solid\n", "line 1|'MeshVersionFormatted'|'solid'"},
  {HEAD "Tetrahedra\n1\n1 2 3 4 7\nEnd\n", "line 3"},
  {HEAD VERTICES "Tetrahedra\n1\n1 2 3 5 7\nEnd\n", "line 11|element 1|vertex 5|4"},
  {HEAD VERTICES "Tetrahedra\n1\n1 2 3 4 7\n", NULL},
  {HEAD "Corners\n1\n1\n", "line 6|'Vertices'"},
  {HEAD VERTICES "Hexahedra\n1\n1 2 3 4 1 2 3 4 0\nEnd\n", "1 hexahedra"},
  {HEAD VERTICES "TetrahedraP2\n1\n1 2 3 4 1 2 3 4 1 5 0\nEnd\n", "element 1|vertex 5 of 4"},
  {HEAD VERTICES "Triangles\n1\n1 2 3 0\nEnd\n", "1 3-node"},
  {HEAD "Vertices\n999999999\n", "999999999 vertices"},
  {NULL, NULL}};

#define VTK                                                                                       \
  "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 " \
  "0 1 0 0 0 "                                                                                    \
  "1\n"
static const Case vtk[] = {
  {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n", NULL},
  {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\nVECTORS v float\n1 2 3\nFIELD f 1\nr "
       "1 1 int\n7\n",
   NULL},
  {"solid\n", "line 1|'# vtk DataFile Version'|VTK"},
  {"# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n", "line 4|POLYDATA|UNSTRUCTURED_GRID"},
  {VTK "CELLS 1 5\n4 0 1 2 4\nCELL_TYPES 1\n10\n", "line 7|cell 0|point 4|3"},
  {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n12\n", "line 7|cell 0|VTK|type 12|4 points|8"},
  {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n99\n", "line 7|cell 0|VTK|type 99"},
  {VTK "CELLS 1 5\n9 0 1 2 3\nCELL_TYPES 1\n10\n", "cell 0|1|9 points"},
  {VTK "CELLS 1 5\n4 0 1 2 3\n", "CELL_TYPES"},
  {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 2\n", "2 cells|1"},
  {VTK
   "CELLS 2 4\nOFFSETS vtktypeint64\n0 9\nCONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\n",
   "line 7|cell 0|9|4"},
  {VTK "CELLS 900000000 5\n", "900000000 cells"},
  {NULL, NULL}};

#define VTU(more, points, cells)                                                                 \
  "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"" more \
  ">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"4\" NumberOfCells='1'>\n<Points>" points       \
  "</Points>\n<Cells>" cells "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
#define X                                                                                        \
  "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 " \
  "1</DataArray>"
#define ARRAY(name, text) \
  "<DataArray type=\"Int64\" Name=\"" name "\" format=\"ascii\">" text "</DataArray>\n"
#define TET ARRAY("connectivity", "0 1 2 3") ARRAY("offsets", "4") ARRAY("types", "10")
static const Case vtu[] = {
  {VTU("", X, TET), NULL},
  {"<VTKFile type=\"PolyData\">\n", "u.vtu|line 1|type 'PolyData'|UnstructuredGrid"},
  {VTU(" compressor=\"vtkLZ4DataCompressor\"", X, TET),
   "line 2|vtkLZ4DataCompressor|vtkZLibDataCompressor"},
  {VTU("", "", TET), "line 5"},
  {VTU("", X, ARRAY("connectivity", "0 1 2 3") ARRAY("offsets", "4")), "line 6|'types'"},
  {VTU("", X, ARRAY("connectivity", "0 1 2 8") ARRAY("offsets", "4") ARRAY("types", "10")),
   "line 6|cell 0|point 8"},
  {VTU("", X, ARRAY("connectivity", "0 1 2 3") ARRAY("offsets", "5") ARRAY("types", "10")),
   "line 6|'connectivity'|5 numbers"},
  {VTU("", X, ARRAY("connectivity", "0 1 x 3") ARRAY("offsets", "4") ARRAY("types", "10")),
   "line 6|'x'"},
  {VTU("",
       "<DataArray type=\"Float32\" NumberOfComponents=\"3\" "
       "format=\"binary\">MAAAAAAA****</DataArray>",
       TET),
   "line 5|''|12 numbers"},
  {VTU("",
       "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>",
       TET),
   "line 5|0"},
  {"<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"4\" "
   "NumberOfCells=\"1\"></Piece><Piece "
   "NumberOfPoints=\"4\" NumberOfCells=\"1\"></Piece></VTKFile>",
   "u.vtu|line 1"},
  {"<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"-4\" "
   "NumberOfCells=\"1\"></Piece></VTKFile>",
   "u.vtu|line 1|NumberOfPoints|'-4'"},
  {NULL, NULL}};

static PetscErrorCode test_abaqus(void)
{
#define NODE "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
  static const Case cases[] = {
    {NODE "*Element, Type=C3D4H, ELSET=all\n1, 1,2,\n3,4\n", NULL}, /* on two lines */
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,5\n", "a.inp|line 7|element 1|node 5"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3\n*STEP\n", "a.inp|line 8|element 1|3|4 nodes"},
    {NODE "*ELEMENT, TYPE=C3D10\n1, 1,2,3,4,1,2,3,4,1,7\n", "a.inp|line 7|element 1|node 7"},
    {NODE "*ELEMENT, TYPE=MASS\n1, 1\n", "no tetrahedra"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n1, 1,2,3,4\n", "element 1"},
    {"*PART, NAME=A\n" NODE "*PART, NAME=A\n" NODE, "a.inp|line 7|part|'A'"},
    {"*INCLUDE\n", "a.inp|line 1|*INCLUDE"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*INSTANCE, NAME=I, PART=P\n1., 0., 0.\n",
     "a.inp|line 8|'P'"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*NSET, NSET=N, GENERATE\n1, 1000000000, 1\n", NULL},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*SURFACE, NAME=S\n1, S5\n", "a.inp|line 9|S5"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*SURFACE, NAME=S\n2, S1\n",
     "a.inp|line 9|surface 'S'|element 2"},
    {"*NODE\n1, 0, zero, 0\n", "a.inp|line 2|node 1|'zero'"},
    {"solid\n", "*NODE"},
    {NULL, NULL}};

  char path[128];
  FILE *file;

  PetscFunctionBeginUser;
  PetscCall(test_cases("a.inp", cases));

  /* many lines that each list all nodes: no valid file of this size does that */
  (void)snprintf(path, sizeof(path), "%s/many.inp", folder);
  file = fopen(path, "w");
  SB_CHECK(file, "%s cannot be written", path);
  (void)fputs(NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*NODE\n", file);
  for (int i = 5; i < 3000; i++)
    (void)fprintf(file, "%d,9,9,9\n", i);
  (void)fputs("*NSET, NSET=N, GENERATE\n", file);
  for (int i = 0; i < 3000; i++)
    (void)fputs("1,9999,1\n", file);
  (void)fclose(file);
  SB_CHECK_ERROR(use_mesh("many.inp"), PETSC_ERR_FILE_UNEXPECTED, "many.inp|members");
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define UNODE                                                                                     \
  "    -1\n  2411\n 1 1 1 11\n 0.D+0 0. 0.\n 2 1 1 11\n 1.D+0 0. 0.\n 3 1 1 11\n 0. 1. 0.\n 4 1 " \
  "1 11\n 0. "                                                                                    \
  "0. 1.E0\n    -1\n"
#define UTET "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 4\n    -1\n"
static const Case unv[] = {
  {UNODE UTET, NULL},
  {"\xef\xbb\xbf" UNODE UTET, NULL},
  {UNODE UTET "    -1\n  2467\n 1 0 0 0 0 0 0 2\nname\n 8 1 0 0 7 3 0 0\n    -1\n", NULL},
  {"solid\n", "u.unv|line 1|-1"},
  {UTET, "body 'b'|line 2"},
  {UNODE "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 9\n    -1\n", "u.unv|line 15|element 1|node 9"},
  {UNODE "    -1\n  2412\n 1 118 2 1 7 4\n 1 2 3 4\n    -1\n",
   "line 14|element 1|kind 118|4 nodes|10"},
  {UNODE "    -1\n  2412\n 1 118 2 1 7 10\n 1 0 2 0 3 0 0 0\n 0 4\n    -1\n",
   "line 15|element 1|node 0"},
  {UNODE "    -1\n  2412\n 1 115 2 1 7 8\n 1 2 3 4 1 2 3 4\n    -1\n", "1 hexahedra"},
  {UNODE "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 4\n", "-1"},
  {UNODE UTET "    -1\n  2467\n 1 0 0 0 0 0 0 1\nname\n 7 8 0 0\n    -1\n", "group 'name'|node 8"},
  {UNODE UTET "    -1\n  2467\n 1 0 0 0 0 0 0 900000\nname\n 7 8 0 0\n    -1\n", "900000 members"},
  {NULL, NULL}};

/* gmsh 4.0: also after a blank line or a UTF-8 byte order mark. */
#define FORMAT40 "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n"
#define ENTITY40 "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 7 0\n$EndEntities\n"
#define NODES40 "$Nodes\n1 4\n1 3 0 4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
static const Case gmsh_40[] = {
  {FORMAT40 ENTITY40 NODES40 "$Elements\n1 1\n1 3 4 1\n1 1 2 3 4\n$EndElements\n", NULL},
  {"\n" FORMAT40 NODES40 "$Elements\n1 1\n1 3 4 1\n1 1 2 3 4\n$EndElements\n", NULL},
  {"\xef\xbb\xbf" FORMAT40 NODES40 "$Elements\n1 1\n1 3 4 1\n1 1 2 3 4\n$EndElements\n", NULL},
  {FORMAT40 NODES40 "$Elements\n1 1\n1 3 4 1\n1 1 2 3 9\n$EndElements\n",
   "g.msh|line 15|element 1|node 9"},
  {FORMAT40 NODES40 "$Elements\n1 2\n1 3 4 1\n1 1 2 3 4\n$EndElements\n", "line 15|2 elements|1"},
  {FORMAT40 "$Nodes\n1 1\n1 7 0 1\n1 0 0 0\n", "line 6|dimension 7"},
  {FORMAT40, "g.msh"},
  {NULL, NULL}};

static PetscErrorCode test_nastran(void)
{
#define GRIDS "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
  static const Case cases[] = {
    {GRIDS "CTETRA,1,5,1,2,3,4\nENDDATA\n", NULL},
    {"\xef\xbb\xbf" GRIDS "CTETRA,1,5,1,2,3,4\nENDDATA\n", NULL}, /* the mark of UTF-8 */
    {GRIDS "CTETRA,1,,1,2,3,4\nSPC1,1,123,7\n", NULL}, /* no property; a point of another kind */
    {"solid\n", "n.bdf|line 2|GRID"},
    {GRIDS "CTETRA,1,5,1,2,3,9\n", "n.bdf|line 5|element 1|node 9"},
    {GRIDS "CTETRA,1,5,1,2,3\n", "line 5"},
    {GRIDS "CTETRA,1,5,1,2,3,x\n", "line 5|'x'"},
    {GRIDS "CTETRA,1,5,1,2,3,4,,\n+,7\n", "line 5|element 1|node 7"},
    {GRIDS "CHEXA,1,5,1,2,3,4,1,2\n,3,4\n", "1 hexahedra"},
    {GRIDS "CTRIA3,1,5,1,2,3\n", "1 3-node"},
    {"GRID,1,,0.,zero,0.\n", "line 1|node 1|'zero'"},
    {"GRID,1,,0.,nan,0.\n", "line 1|node 1|'nan'"},
    {"GRID,1,,0.,1+999,0.\n", "line 1|node 1|'1+999'"},
    {"GRID,1,2,0.,0.,0.\n", "line 1|system 2"},
    {"GRDSET,,3\n" GRIDS, "line 2|system 3"},
    {"GRID,,,0.,0.,0.\n", "line 1"},
    {GRIDS "GRID,3,,5.,0.,0.\nCTETRA,1,5,1,2,3,4\n", "n.bdf|line 5|node 3"},
    {GRIDS "INCLUDE\n", "line 5|INCLUDE"},
    {GRIDS "SPC1,1,123,1,2,3,4,1,2,3,4\n", "line 5|10 fields"},
    {GRIDS "SPC1,1,123,all\n", "line 5|'all'"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("n.bdf", cases));
  SB_CHECK_ERROR(use_mesh("none.bdf"), PETSC_ERR_FILE_OPEN, "none.bdf");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char command[64];

  SB_TEST_BEGIN(argc, argv);
  SB_CHECK(mkdtemp(folder), "no folder %s", folder);
  PetscCall(test_tetgen());
  PetscCall(test_netgen());
  PetscCall(test_cases("m.mesh", medit));
  PetscCall(test_cases("v.vtk", vtk));
  PetscCall(test_cases("u.vtu", vtu));
  PetscCall(test_abaqus());
  PetscCall(test_cases("u.unv", unv));
  PetscCall(test_cases("g.msh", gmsh_40));
  PetscCall(test_nastran());
  (void)snprintf(command, sizeof(command), "rm -rf %s", folder);
  SB_CHECK(!system(command), "%s stays", folder);
  SB_TEST_END();
}
