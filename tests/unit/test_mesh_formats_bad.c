// What is wrong with a file of each format is said with the file, the line or byte, and what to do.
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
  if (file) (void)fputs(text, file);
  if (file) (void)fclose(file);
}

static PetscErrorCode use_mesh(const char *name)
{
  char path[128];
  SbBody body;
  SbImport im;
  SbFaces faces;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/%s", folder, name);
  body = test_body("b", path);
  memset(&im, 0, sizeof(im));
  memset(&faces, 0, sizeof(faces));
  ierr = SbImportRead(&body, &im);
  if (!ierr) ierr = SbImportCheck(&im, &faces);
  PetscCall(SbImportDestroy(&im));
  PetscCall(SbFacesDestroy(&faces));
  PetscFunctionReturn(ierr);
}

typedef struct {
  const char *text, *words; /* words NULL: it is sound */
} Case;

/* A list of cases that ends with an empty text. */
static PetscErrorCode test_cases(const char *name, const Case cases[])
{
  PetscFunctionBeginUser;
  for (int i = 0; cases[i].text; i++) {
    write_text(name, cases[i].text);
    if (cases[i].words)
      TEST_MESSAGE(use_mesh(name), PETSC_ERR_FILE_UNEXPECTED, cases[i].words);
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
    {"4 3 0 0\n1 0 0 0\n2 1 0 0\n4 0 1 0\n5 0 0 1\n",
     "t.node line 4: point 4 follows point 2; TetGen numbers them without gaps"},
    {"4 3 0 0\n3 0 0 0\n4 1 0 0\n5 0 1 0\n6 0 0 1\n",
     "t.node line 2: the first point has number 3; TetGen counts from 0 or 1"},
    {"4 2 0 0\n", "t.node line 1: the points have dimension 2; expected 3"},
    {"4 3 0 0\n1 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n",
     "t.node line 2: the line ends where the coordinate is expected"},
    {"4 3 0 0\n1 0 nan 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n",
     "t.node line 2: coordinate of point 1 is not a finite number"},
    {"4000000000 3 0 0\n1 0 0 0\n",
     "t.node line 1: 4000000000 points are announced, the rest of the file cannot hold more than"},
    {"4 3 900000000 0\n1 0 0 0\n2 0 0 0\n3 0 0 0\n", "t.node line 1: 900000000 attributes are announced"},
    {"0 3 0 0\n", "t.node line 1: 0 points; when they stand in a .poly or .smesh file, let TetGen write the "
                  "mesh (tetgen -p)"},
    {NULL, NULL}};
  static const Case ele[] = {
    {"1 4 0\n1 1 2 3 4\n", NULL},
    {"# all\n1 4\n1 1 2 3 4\n", NULL},
    {"1 4 0\n1 1 2 3 5\n", "t.ele line 2: point 5 is not in the .node file, which holds 1 to 4"},
    {"1 4 0\n1 0 1 2 3\n", "t.ele line 2: point 0 is not in the .node file, which holds 1 to 4"},
    {"1 10 0\n1 1 2 3 4 5 6 7 8 9 10\n", "t.ele: holds 1 10-node tetrahedra; supple needs 4-node ones"},
    {"1 3 0\n1 1 2 3\n", "t.ele line 1: elements of 3 points; expected 4"},
    {"1 4 1\n1 1 2 3 4 1.5\n",
     "t.ele line 2: the attribute of a tetrahedron is 1.5; supple takes it for the number of a group"},
    {"1 4 1\n1 1 2 3 4\n", "t.ele line 2: the line ends where the attribute of a tetrahedron is expected"},
    {"2 4 0\n1 1 2 3 4\n",
     "t.ele line 3: the file ends where the number of an item is expected; it is truncated"},
    {"0 4 0\n", "t.ele: holds no tetrahedra"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  write_text("t.ele", "1 4 0\n1 1 2 3 4\n");
  PetscCall(test_cases("t.node", node));
  write_text("t.node", NODES);
  PetscCall(test_cases("t.ele", ele));
  write_text("t.ele", "1 4 0\n1 1 2 3 4\n");
  write_text("t.face", "1 1\n1 1 2 9 5\n");
  TEST_MESSAGE(use_mesh("t.ele"), PETSC_ERR_FILE_UNEXPECTED,
               "t.face line 2: point 9 is not in the .node file");
  write_text("alone.ele", "1 4 0\n1 1 2 3 4\n");
  TEST_MESSAGE(use_mesh("alone.ele"), PETSC_ERR_FILE_OPEN,
               "alone.node: cannot open the file (No such file or directory)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_netgen(void)
{
#define POINTS "4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
  static const Case neutral[] = {
    {POINTS "1\n1 1 2 3 4\n1\n1 1 2 3\n", NULL},
    {POINTS "1\n1 1 2 3 4\n", NULL},
    {POINTS "1\n1 1 2 3 4 5 6 7 8 9 10\n", "line 7: element 1 uses point 5 of 4"},
    {"12" /* points */ "\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n2 2 2\n3 3 3\n4 4 4\n5 5 5\n6 6 6\n7 7 7\n8 8 "
     "8\n1\n1 1 2 3 4 5 6 7 8 9 10\n",
     "holds 1 10-node tetrahedra; supple needs 4-node ones"},
    {POINTS "1\n1 1 2 3\n", "line 7: a volume element of 3 points; expected 4"},
    {POINTS "0\n1\n1 1 2 3\n", "is a surface: 1 3-node triangles and no tetrahedra"},
    {"70000000\n0 0 0\n", "line 1: 70000000 points are announced"},
    {"4\n0 0 0\n1 0 0\n0 1 0\n0 0 inf\n", "line 5: coordinate of node 4 is not a finite number"},
    {NULL, NULL}};
  static const Case vol[] = {
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\npoints\n" POINTS, NULL},
    {"mesh2d\n", "v.vol line 1: expected 'mesh3d', found 'mesh2d'; this is no mesh of Netgen"},
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\n", "there is no section 'points'"},
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 7\npoints\n" POINTS, "v.vol line 4: element 1 uses point 7 of 4"},
    {"mesh3d\nvolumeelements\n1\n1 9 1 2 3 4\npoints\n" POINTS,
     "v.vol line 4: a volume element of 9 points; expected 4"},
    {"mesh3d\nvolumeelements\n2\n1 4 1 2 3 4\npoints\n" POINTS,
     "v.vol line 5: expected the material of an element, found 'points'"},
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\npoints\n" POINTS "materials\n1\n1\n", NULL}, /* no name */
    {"mesh3d\nvolumeelements\n1\n1 4 1 2 3 4\npoints\n" POINTS "materials\n1\nx\n",
     "expected the number of a name, found 'x'"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("n.neu", neutral));
  PetscCall(test_cases("n.mesh", neutral));
  PetscCall(test_cases("v.vol", vol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_medit(void)
{
#define HEAD "MeshVersionFormatted 1\nDimension 3\n"
#define VERTICES "Vertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
  static const Case cases[] = {
    {HEAD VERTICES "Tetrahedra\n1\n1 2 3 4 7\nEnd\n", NULL},
    {HEAD VERTICES "Corners\n2\n1\n2\nTetrahedra 1 1 2 3 4 7\n# fine\nEnd", NULL},
    {"MeshVersionFormatted 2 Dimension 2\n", "line 1: dimension 2; expected 3"},
    {"solid\n", "line 1: expected 'MeshVersionFormatted', found 'solid'; this is no text file of Medit"},
    {HEAD "Tetrahedra\n1\n1 2 3 4 7\nEnd\n", "line 3: elements before the section Vertices"},
    {HEAD VERTICES "Tetrahedra\n1\n1 2 3 5 7\nEnd\n", "line 11: element 1 uses vertex 5 of 4"},
    {HEAD VERTICES "Tetrahedra\n1\n1 2 3 4 7\n",
     "the file ends where a section, or 'End', is expected; it is truncated"},
    {HEAD VERTICES "Hexahedra\n1\n1 2 3 4 1 2 3 4 0\nEnd\n",
     "holds 1 hexahedra; supple simulates tetrahedra only"},
    {HEAD VERTICES "TetrahedraP2\n1\n1 2 3 4 1 2 3 4 1 2 0\nEnd\n",
     "holds 1 10-node tetrahedra; supple needs 4-node ones"},
    {HEAD VERTICES "Triangles\n1\n1 2 3 0\nEnd\n", "is a surface: 1 3-node triangles and no tetrahedra"},
    {HEAD "Vertices\n999999999\n", "999999999 vertices are announced"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("m.mesh", cases));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_vtk(void)
{
#define VTK                                                                                                 \
  "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 " \
  "1\n"
  static const Case cases[] = {
    {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n", NULL},
    {VTK
     "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\nVECTORS v float\n1 2 3\nFIELD f 1\nr 1 1 int\n7\n",
     NULL},
    {"solid\n", "line 1: expected '# vtk DataFile Version'; this is no legacy file of VTK"},
    {"# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n",
     "line 4: data set POLYDATA; expected UNSTRUCTURED_GRID"},
    {VTK "CELLS 1 5\n4 0 1 2 4\nCELL_TYPES 1\n10\n", "line 7: cell 0 uses point 4; the points are 0 to 3"},
    {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n12\n",
     "line 7: cell 0, of VTK's type 12, has 4 points; expected 8"},
    {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n99\n",
     "line 7: cell 0 is of VTK's type 99; supple simulates tetrahedra"},
    {VTK "CELLS 1 11\n10 0 1 2 3 0 1 2 3 0 1\nCELL_TYPES 1\n24\n",
     "holds 1 10-node tetrahedra; supple needs 4-node ones"},
    {VTK "CELLS 1 5\n9 0 1 2 3\nCELL_TYPES 1\n10\n",
     "cell 0 of 1 has 9 points, more than the section announces"},
    {VTK "CELLS 1 5\n4 0 1 2 3\n", "the file ends before the section CELL_TYPES; it is truncated"},
    {VTK "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 2\n", "data for 2 cells; there are 1"},
    {VTK "CELLS 2 4\nOFFSETS vtktypeint64\n0 9\nCONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\n",
     "line 7: the points of cell 0 end at 9; expected a whole number above 0, up to 4"},
    {VTK "CELLS 900000000 5\n", "900000000 cells are announced"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("v.vtk", cases));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_vtu(void)
{
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
  static const Case cases[] = {
    {VTU("", X, TET), NULL},
    {"<VTKFile type=\"PolyData\">\n",
     "u.vtu line 1: a file of type 'PolyData'; expected UnstructuredGrid with tetrahedra"},
    {VTU(" compressor=\"vtkLZ4DataCompressor\"", X, TET),
     "line 2: compressed by vtkLZ4DataCompressor; supple knows vtkZLibDataCompressor"},
    {VTU("", "", TET), "line 5: the element Points has no array"},
    {VTU("", X, ARRAY("connectivity", "0 1 2 3") ARRAY("offsets", "4")),
     "line 6: the element Cells has no array 'types'"},
    {VTU("", X, ARRAY("connectivity", "0 1 2 8") ARRAY("offsets", "4") ARRAY("types", "10")),
     "line 6: cell 0 uses point 8"},
    {VTU("", X, ARRAY("connectivity", "0 1 2 3") ARRAY("offsets", "5") ARRAY("types", "10")),
     "line 6: array 'connectivity' should hold 5 numbers, which is more than stand there"},
    {VTU("", X, ARRAY("connectivity", "0 1 x 3") ARRAY("offsets", "4") ARRAY("types", "10")),
     "line 6: expected the value of an array, found 'x'"},
    {VTU("",
         "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">MAAAAAAA****</DataArray>",
         TET),
     "line 5: array '' should hold 12 numbers, which is more than the rest of the file can tell"},
    {VTU("", "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>", TET),
     "line 5: the array lies at 0 of the appended data, which the file does not hold"},
    {"<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"></Piece><Piece "
     "NumberOfPoints=\"4\" "
     "NumberOfCells=\"1\"></Piece></VTKFile>",
     "u.vtu line 1: the grid is in several pieces; save it in one"},
    {"<VTKFile type=\"UnstructuredGrid\"><Piece NumberOfPoints=\"-4\" NumberOfCells=\"1\"></Piece></VTKFile>",
     "u.vtu line 1: expected a number NumberOfPoints=\"...\", found '-4'"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("u.vtu", cases));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_abaqus(void)
{
#define NODE "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"
  static const Case cases[] = {
    {NODE "*Element, Type=C3D4H, ELSET=all\n1, 1,2,\n3,4\n", NULL}, /* on two lines */
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,5\n", "a.inp line 7: element 1 uses node 5, which is not there"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3\n*STEP\n", "a.inp line 8: element 1 ends after 3 of 4 nodes"},
    {NODE "*ELEMENT, TYPE=C3D10\n1, 1,2,3,4,1,2,3,4,1,2\n",
     "holds 1 10-node tetrahedra; supple needs 4-node ones"},
    {NODE "*ELEMENT, TYPE=MASS\n1, 1\n",
     "a.inp line 6: elements of type 'MASS'; supple knows C3D4 tetrahedra"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n1, 1,2,3,4\n", "element 1 is given twice; supple reads one part"},
    {"*PART, NAME=A\n" NODE "*PART, NAME=B\n", "a.inp line 7: a second *PART; supple reads one part"},
    {"*INCLUDE, INPUT=more.inp\n", "a.inp line 1: *INCLUDE: another file holds a part of the mesh"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*INSTANCE, NAME=I, PART=P\n1., 0., 0.\n",
     "a.inp line 9: the instance is moved or turned"},
    {NODE "*NSET, NSET=N, GENERATE\n1, 1000000000, 1\n", "a.inp line 7: the sets have more than 0 members"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*SURFACE, NAME=S\n1, S5\n",
     "a.inp line 9: side 'S5' of a surface; expected S1 to S4"},
    {NODE "*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n*SURFACE, NAME=S\n2, S1\n",
     "a.inp line 9: surface 'S' has a side of element 2, which is not there"},
    {"*NODE\n1, 0, zero, 0\n", "a.inp line 2: expected a coordinate of node 1, found 'zero'"},
    {"solid\n", "there is no *NODE in it; this is no input file of Abaqus"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("a.inp", cases));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_unv(void)
{
#define UNODE                                                                                               \
  "    -1\n  2411\n 1 1 1 11\n 0.D+0 0. 0.\n 2 1 1 11\n 1.D+0 0. 0.\n 3 1 1 11\n 0. 1. 0.\n 4 1 1 11\n 0. " \
  "0. 1.E0\n    -1\n"
#define UTET "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 4\n    -1\n"
  static const Case cases[] = {
    {UNODE UTET, NULL},
    {"\xef\xbb\xbf" UNODE UTET, NULL},
    {UNODE UTET "    -1\n  2467\n 1 0 0 0 0 0 0 2\nname\n 8 1 0 0 7 3 0 0\n    -1\n", NULL},
    {"solid\n", "u.unv line 1: expected a line of -1; this is no universal file, or it is damaged"},
    {UTET, "elements before the nodes"},
    {UNODE "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 9\n    -1\n",
     "u.unv line 15: element 1 uses node 9, which is not there"},
    {UNODE "    -1\n  2412\n 1 118 2 1 7 4\n 1 2 3 4\n    -1\n",
     "line 14: element 1 of kind 118 has 4 nodes; expected 10"},
    {UNODE "    -1\n  2412\n 1 115 2 1 7 8\n 1 2 3 4 1 2 3 4\n    -1\n",
     "holds 1 hexahedra; supple simulates tetrahedra only"},
    {UNODE "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 4\n",
     "the file ends where a line of -1 is expected; it is truncated"},
    {UNODE UTET "    -1\n  2467\n 1 0 0 0 0 0 0 1\nname\n 7 8 0 0\n    -1\n",
     "group 'name' lists node 8, which is not there"},
    {UNODE UTET "    -1\n  2467\n 1 0 0 0 0 0 0 900000\nname\n 7 8 0 0\n    -1\n",
     "900000 members of a group are announced"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("u.unv", cases));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Nothing gets to the gmsh library that it would take for a script. */
static PetscErrorCode test_library(void)
{
  static const Case cases[] = {
    {"\n$MeshFormat\n4.0 0 8\n$EndMeshFormat\n",
     "g.msh line 1: a file of version 4.0 must begin with $MeshFormat; remove what stands before it"},
    {"\xef\xbb\xbf$MeshFormat\n4.0 0 8\n$EndMeshFormat\n",
     "g.msh line 1: a file of version 4.0 must begin with $MeshFormat"},
    {"$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", "g.msh: gmsh finds no mesh in it"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("g.msh", cases));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_nastran(void)
{
#define GRIDS "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
  static const Case cases[] = {
    {GRIDS "CTETRA,1,5,1,2,3,4\nENDDATA\n", NULL},
    {"\xef\xbb\xbf" GRIDS "CTETRA,1,5,1,2,3,4\nENDDATA\n", NULL}, /* the mark of UTF-8 */
    {GRIDS "CTETRA,1,,1,2,3,4\nSPC1,1,123,7\n", NULL},            /* no property; a point of another kind */
    {"solid\n", "n.bdf line 2: there is no GRID up to here; this is no bulk data of Nastran"},
    {GRIDS "CTETRA,1,5,1,2,3,9\n", "n.bdf line 5: element 1 uses node 9, which is not there"},
    {GRIDS "CTETRA,1,5,1,2,3\n", "line 5: the node of an element is missing"},
    {GRIDS "CTETRA,1,5,1,2,3,x\n", "line 5: expected the node of an element, found 'x'"},
    {GRIDS "CTETRA,1,5,1,2,3,4,,\n+,7\n", "holds 1 10-node tetrahedra; supple needs 4-node ones"},
    {GRIDS "CHEXA,1,5,1,2,3,4,1,2\n,3,4\n", "holds 1 hexahedra; supple simulates tetrahedra only"},
    {GRIDS "CTRIA3,1,5,1,2,3\n", "is a surface: 1 3-node triangles and no tetrahedra"},
    {"GRID,1,,0.,zero,0.\n", "line 1: expected the coordinate of node 1, found 'zero'"},
    {"GRID,1,,0.,nan,0.\n", "line 1: expected the coordinate of node 1, found 'nan'"},
    {"GRID,1,,0.,1+999,0.\n", "line 1: expected the coordinate of node 1, found '1+999'"},
    {"GRID,1,2,0.,0.,0.\n",
     "line 1: node 1 is given in coordinate system 2; write all nodes in the basic one"},
    {"GRDSET,,3\n" GRIDS, "line 1: GRDSET gives the nodes in coordinate system 3"},
    {"GRID,,,0.,0.,0.\n", "line 1: the number of a node is missing"},
    {GRIDS "GRID,3,,5.,0.,0.\nCTETRA,1,5,1,2,3,4\n",
     "n.bdf line 5: node 3 is given twice; renumber the nodes"},
    {GRIDS "INCLUDE 'more.bdf'\n", "line 5: INCLUDE is not followed; put all into one file"},
    {GRIDS "SPC1,1,123,1,2,3,4,1,2,3,4\n", "line 5: the line has more than 10 fields"},
    {GRIDS "SPC1,1,123,all\n", "line 5: expected the node of a set, found 'all'"},
    {NULL, NULL}};

  PetscFunctionBeginUser;
  PetscCall(test_cases("n.bdf", cases));
  TEST_MESSAGE(use_mesh("none.bdf"), PETSC_ERR_FILE_OPEN,
               "none.bdf: cannot open the file (No such file or directory)");
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char command[64];

  SB_TEST_BEGIN(argc, argv);
  SB_CHECK(mkdtemp(folder), "no folder %s", folder);
  PetscCall(test_tetgen());
  PetscCall(test_netgen());
  PetscCall(test_medit());
  PetscCall(test_vtk());
  PetscCall(test_vtu());
  PetscCall(test_abaqus());
  PetscCall(test_unv());
  PetscCall(test_library());
  PetscCall(test_nastran());
  (void)snprintf(command, sizeof(command), "rm -rf %s", folder);
  SB_CHECK(!system(command), "%s stays", folder);
  SB_TEST_END();
}
