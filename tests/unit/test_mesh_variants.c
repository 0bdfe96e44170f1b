// Files as other programs write them, with what a mesh does not need, or their sections in another
// order: read, and said.
// @ranks 1
#include <sys/stat.h>
#include <sbsurface.h>
#include "../../src/surface/surface_impl.h"
#include "mesh_test.h"
#include "../file.h"

static char folder[512];

#define VTK                                                                                       \
  "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 " \
  "0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\n"
#define REGION "SCALARS region int 1\nLOOKUP_TABLE default\n7\n"
#define XML                                                                                    \
  "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">\n" \
  "<UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray "      \
  "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 "          \
  "1</DataArray></Points><Cells><DataArray type=\"Int64\" Name=\"connectivity\" "              \
  "format=\"ascii\">0 1 2 3</DataArray><DataArray type=\"Int64\" Name=\"offsets\" "            \
  "format=\"ascii\">4</DataArray><DataArray type=\"Int64\" Name=\"types\" "                    \
  "format=\"ascii\">10</DataArray></Cells>"
#define XML_END "</Piece></UnstructuredGrid></VTKFile>\n"
#define NODES "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
#define NODES41 "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
#define ENTITIES41 "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 7 0\n$EndEntities\n"
#define UNODE                                                                               \
  "    -1\n  2411\n 1 1 1 11\n 0. 0. 0.\n 2 1 1 11\n 1. 0. 0.\n 3 1 1 11\n 0. 1. 0.\n 4 1 " \
  "1 11\n 0. 0. 1.\n"
#define UTET "    -1\n  2412\n 1 111 2 1 7 4\n 1 2 3 4\n"
#define UEND "    -1\n"
#define UMIDDLE                                                        \
  " 5 1 1 11\n .5 0. 0.\n 6 1 1 11\n .5 .5 0.\n 7 1 1 11\n 0. .5 0.\n" \
  " 8 1 1 11\n 0. 0. .5\n 9 1 1 11\n .5 0. .5\n 10 1 1 11\n 0. .5 .5\n"

/* Two tets that share a facet, in two pieces; the second one has its points in another order. */
#define REGION_ARRAY(n) \
  "<DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">" n "</DataArray>"
#define PIECES(more)                                                                            \
  XML "<CellData>" REGION_ARRAY(                                                                \
    "7") "</CellData></Piece><Piece NumberOfPoints=\"4\" "                                      \
         "NumberOfCells=\"1\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" "    \
         "format=\"ascii\">1 1 1 0 0 1 1 0 0 0 1 0</DataArray></Points><Cells><DataArray "      \
         "type=\"Int64\" Name=\"connectivity\" format=\"ascii\">2 3 1 0</DataArray><DataArray " \
         "type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray><DataArray "            \
         "type=\"Int64\" "                                                                      \
         "Name=\"types\" format=\"ascii\">10</DataArray></Cells><CellData>" more REGION_ARRAY(  \
           "8") "</CellData>" XML_END

/* One tet of volume 1/6. */
static const struct {
  const char *name, *text;
  int dim; /* -1: no group */
  const char *group, *note;
} meshes[] = {
  {"a.vtk", VTK "COLOR_SCALARS rgb 3\n1 0 0\n" REGION, 3, "volume_7", "COLOR_SCALARS rgb (1)"},
  {"a.vtk", VTK "GLOBAL_IDS g vtkIdType\n0\nPEDIGREE_IDS p int\n5\n" REGION, 3, "volume_7",
   "GLOBAL_IDS g (1), PEDIGREE_IDS p (1)"},
  {"a.vtk", VTK "FIELD f 2\nname 1 1 string\nfat tissue\nregion 1 1 int\n7\n", 3, "volume_7",
   "name of type string"},
  {"a.vtk", VTK "SCALARS flag bit\nLOOKUP_TABLE default\n1\n" REGION, 3, "volume_7",
   "flag of type bit"},
  {"a.vtk", VTK REGION "POINT_DATA 4\nTEXTURE_COORDINATES t 2 float\n0 0 1 0 1 1 0 1\n", 3,
   "volume_7", "TEXTURE_COORDINATES t"},
  {"a.vtk", XML XML_END, -1, "", "in spite of its name"},
  {"a.vtu", VTK REGION, 3, "volume_7", "in spite of its name"},
  {"a.vtu",
   XML
   "<CellData><DataArray type=\"String\" Name=\"s\" format=\"ascii\">97 0</DataArray><DataArray "
   "type=\"Int32\" Name=\"r\" format=\"ascii\">7</DataArray></CellData>" XML_END,
   3, "volume_7", "array s of type String"},
  {"a.inp",
   "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" NODES "$Elements\n1\n1 4 2 7 1 1 2 3 4\n"
   "$EndElements\n",
   3, "volume_7", "in spite of its name"},
  {"a.msh",
   "$MeshFormat\n2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n7 \"meat\"\n$EndPhysicalNames\n" NODES
   "$Elements\n1\n1 4 2 7 1 1 2 3 4\n$EndElements\n",
   3, "meat", ""},
  {"a.msh",
   "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$ParametricNodes\n4\n1 0 0 0 0 1\n2 1 0 0 1 2 .5\n"
   "3 0 1 0 2 3 .5 .5\n4 0 0 1 3 1\n$EndParametricNodes\n"
   "$Elements\n1\n1 4 2 7 1 1 2 3 4\n$EndElements\n",
   3, "volume_7", ""},
  {"a.msh",
   "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 4 1 4\n0 1 1 1\n1\n0 0 0\n2 1 1 3\n2\n3\n"
   "4\n1 0 0 .1 .2\n0 1 0 .3 .4\n0 0 1 .5 .6\n$EndNodes\n"
   "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n" ENTITIES41,
   3, "volume_7", ""},
  {"a.msh",
   "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" NODES41
   "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n" ENTITIES41
   "$PhysicalNames\n1\n3 7 \"K\xc3\xb6rper\"\n$EndPhysicalNames\n",
   3, "K\xc3\xb6rper", ""},
  {"a.mesh",
   "MeshVersionFormatted 1\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
   "Tetrahedra\n1\n1 2 3 4 7\n",
   3, "volume_7", "no End"},
  {"a.mesh",
   "MeshVersionFormatted 1\rDimension 3\rVertices\r4\r0 0 0 0\r1 0 0 0\r0 1 0 0\r0 0 1 0\r"
   "Tetrahedra\r1\r1 2 3 4 7\rEnd\r",
   3, "volume_7", ""},
  {"a.mesh",
   "MeshVersionFormatted 1\nDimension 3\nTriangles 1\n1 2 3 9\nTetrahedra 1\n1 2 3 4 7\n"
   "Vertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nEnd\n",
   3, "volume_7", ""},
  {"a.unv", "SDRC export of a part\n\n" UNODE UEND UTET UEND, 3, "volume_2", ""},
  {"a.unv", UNODE UEND "made by hand\n\n" UTET UEND "and of no use\n", 3, "volume_2", ""},
  {"a.unv",
   "    -1\n   164\n 5mm (milli-newton)  2\n 1.0D+03 1. 1.\n 273.\n" UEND UNODE UEND UTET UEND, 3,
   "volume_2", "units of 0.001 m"},
  {"a.unv", UNODE UEND UTET "2 136 1 1 7 2\n 1 2\n" UEND, 3, "volume_2",
   "elements of kind 136 (1)"},
  {"a.unv",
   UNODE UMIDDLE UEND "    -1\n  2412\n 2 22 3 1 7 3\n 0 0 0\n 1 5 2\n 1 118 2 1 7 10\n"
                      " 1 5 2 6 3 7 8 9\n 10 4\n" UEND,
   1, "curve_3", ""},
};

/* The boundary of such a tet, outwards. */
static const struct {
  const char *name, *text, *group;
} surfaces[] = {
  {"b.obj",
   "v 0 0 0\nv 1 0 0\nv 0 \\\n1 0\nv 0 0 1\no K\xc3\xb6rper\nf 1 \\\n 3 2\nf 1\\\r\n 2 4\n"
   "fo 2/1/1 3//2 4\nf 1 4 3\nsurf 0 1 0 1 1\n",
   "K\xc3\xb6rper"},
  {"b.off",
   "COFF\n4 4 0\n0 0 0 255 0 0 255\n1 0 0 255 0 0 255\n0 1 0 255 0 0 255\n0 0 1 255 0 0 "
   "255\n3 0 2 1\n3 0 1 3\n3 1 2 3 255 0 0\n3 0 3 2\n",
   NULL},
  {"b.off",
   "NOFF\n4 4 0\n0 0 0 1 0 0\n1 0 0 1 0 0\n0 1 0 1 0 0\n0 0 1 1 0 0\n3 0 2 1\n3 0 1 3\n"
   "3 1 2 3\n3 0 3 2\n",
   NULL},
  {"b.off", "4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n", NULL},
  {"b.ply",
   "ply\nformat ascii 1.0\nelement face 4\nproperty list uchar int vertex_indices\nelement "
   "vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n3 0 2 1\n"
   "3 0 1 3\n3 1 2 3\n3 0 3 2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n",
   NULL},
#define FACET(a, b, c)                                                                  \
  "facet normal 0 0 0\nouter loop\nvertex " a "\nvertex " b "\nvertex " c "\nendloop\n" \
  "endfacet\ncolor 1 0 0\n"
  {"b.stl",
   "solid s\n" FACET("0 0 0", "0 1 0", "1 0 0") FACET("0 0 0", "1 0 0", "0 0 1")
     FACET("1 0 0", "0 1 0", "0 0 1") FACET("0 0 0", "0 0 1", "0 1 0") "endsolid\n",
   "s"},
  {"b.stl",
   "solid s\n" FACET("0 0 0", "0 1 0", "1 0 0") FACET("0 0 0", "1 0 0", "0 0 1")
     FACET("1 0 0", "0 1 0", "0 0 1") FACET("0 0 0", "0 0 1", "0 1 0"),
   "s"},
  // contents beat the ending
  {"b.obj",
   "solid s\n" FACET("0 0 0", "0 1 0", "1 0 0") FACET("0 0 0", "1 0 0", "0 0 1")
     FACET("1 0 0", "0 1 0", "0 0 1") FACET("0 0 0", "0 0 1", "0 1 0") "endsolid\n",
   "s"},
  {"b.stl", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n", NULL},
  {"b.off",
   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
   "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 "
   "1\n"
   "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
   NULL},
};

/* Files that would be read as something else, or of another kind. */
static const char *const bad[][3] = {
  {"c.neu", "        CONTROL INFO 2.4.6\n", "GAMBIT"},
  {"c.vtk", "<?xml version=\"1.0\"?>\n<febio_spec version=\"3.0\">\n", "line 3|febio_spec"},
  {"c.unv", UNODE UEND "    -1\n   780\n 1 111 1 1 1 1 7 4\n 1 2 3 4\n" UEND, "line 13|780|2412"},
  {"c.unv", UNODE UEND "    -1\n  2412\n 1 117 2 1 7 2\n 1 2\n" UEND, "line 14|kind 117"},
  {"c.unv",
   "    -1\n  2420\n 1\npart\n 5 1 0\nCS5\n 1. 0. 0.\n 0. 1. 0.\n 0. 0. 1.\n 0. 0. 0.\n" UEND
   "    -1\n  2411\n 1 5 1 11\n 0. 0. 0.\n" UEND,
   "line 14|node 1|coordinate system 5"},
  {"c.unv", "a letter\n  -1 of it\n", "line 1|-1"},
  {"c.mesh", "MeshVersionFormatted 1\nDimension 3\nTetrahedra 1\n1 2 3 4 7\nEnd\n",
   "line 3|Vertices"},
  {"c.mesh",
   "MeshVersionFormatted 1\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
   "TetrahedraP2Ordering\n1\n1 2 3 4\nEnd\n",
   "line 9|TetrahedraP2Ordering"},
};

/* A piece: its points, numbers of them or "", its tets and data of these. */
#define GRID(body) \
  "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>" body "</UnstructuredGrid></VTKFile>\n"
#define PIECE(n, x, global, m, connect, ends, types, data)                                  \
  "<Piece NumberOfPoints=\"" n "\" NumberOfCells=\"" m "\">" global                         \
  "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">" x "</DataArray></Points>" \
  "<Cells><DataArray type=\"Int64\" Name=\"connectivity\">" connect "</DataArray>"          \
  "<DataArray type=\"Int64\" Name=\"offsets\">" ends "</DataArray>"                         \
  "<DataArray type=\"UInt8\" Name=\"types\">" types "</DataArray></Cells><CellData>" data   \
  "</CellData></Piece>"
#define IDS(id) \
  "<PointData><DataArray type=\"Int64\" Name=\"GlobalNodeId\">" id "</DataArray></PointData>"
#define GHOST(g) "<DataArray type=\"UInt8\" Name=\"vtkGhostType\">" g "</DataArray>"
#define EMPTY "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"></Piece>"
#define FOUR "0 0 0 1 0 0 0 1 0 0 0 1 "
#define FIRST(global, data) PIECE("4", FOUR, global, "1", "0 1 2 3", "4", "10", data)
#define OTHER(global, data) \
  PIECE("4", "1 1 1 -0 0 1 1 0 0 0 1 0", global, "1", "2 3 1 0", "4", "10", data)
/* the second piece with the tet of the first one as a ghost, in another order of points */
#define WITH_GHOST(marks)                                                                 \
  PIECE("5", "1 1 1 0 0 1 1 0 0 0 1 0 0 0 0", "", "2", "2 3 1 0 4 2 3 1", "4 8", "10 10", \
        GHOST(marks))

/* Grids in several pieces and files: two tets of volume 1/6 and 2/6 with a common facet. */
static PetscErrorCode test_pieces(void)
{
  static const struct {
    const char *text;
    int nvert, ntet;
    const char *note;
  } good[] = {
    {PIECES("<DataArray type=\"Int32\" Name=\"g\" format=\"ascii\">1</DataArray>"), 5, 2,
     "2 pieces, 3 points of several pieces joined where"},
    {GRID(FIRST("", "") EMPTY OTHER("", "")), 5, 2, "3 pieces (1 empty), 3 points"},
    {GRID(FIRST(IDS("7 1 2 3"), "") OTHER(IDS("9 3 1 2"), "")), 5, 2,
     "3 points of several pieces joined by"},
    /* as the numbers say, though the positions are equal */
    {GRID(FIRST(IDS("7 1 2 3"), "") OTHER(IDS("9 4 1 2"), "")), 6, 2,
     "2 points of several pieces joined by"},
    /* not all pieces have numbers */
    {GRID(FIRST(IDS("7 1 2 3"), "") OTHER("", "")), 5, 2,
     "3 points of several pieces joined where"},
    {GRID(FIRST("", "") WITH_GHOST("0 1")), 5, 2, "1 ghost cells"},
    {GRID(FIRST("", GHOST("16")) WITH_GHOST("2 33")), 5, 2, "1 ghost cells"},
    /* a file of one piece */
    {GRID(WITH_GHOST("0 1")), 5, 1, "1 ghost cells"},
    /* points of one piece stay apart where no other piece has one */
    {GRID(PIECE("8", FOUR FOUR, "", "2", "0 1 2 3 4 5 6 7", "4 8", "10 10", "")
            PIECE("4", "5 5 5 6 5 5 5 6 5 5 5 6", "", "1", "0 1 2 3", "4", "10", "")),
     12, 3, "0 points of several pieces"},
    {"<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid><PPoints/><Piece Source=\"one.vtu\"/>"
     "<Piece Source='parts\\other.vtu'/></PUnstructuredGrid></VTKFile>\n",
     5, 2, "2 pieces, 3 points"},
  };
  static const char *const wrong[][2] = {
    {GRID(FIRST("", "") OTHER("", "")
            PIECE("8", FOUR FOUR, "", "2", "0 1 2 3 4 5 6 7", "4 8", "10 10", "")),
     "piece 3|(0, 0, 0)|piece 1"},
    {GRID(FIRST(IDS("7 1 2 2"), "") OTHER(IDS("9 3 1 2"), "")), "piece 1|number 2"},
    {GRID(FIRST(IDS("7 1 2 3"), "") OTHER(IDS("3 9 1 2"), "")), "number 3|(1, 1, 1)"},
    {GRID(FIRST(IDS("7 1 2 .5"), "") OTHER(IDS("3 9 1 2"), "")), "GlobalNodeId|0.5"},
    {GRID(FIRST("", "") PIECE("4", "1 1 1 0 0 1 1 0 0 0 1 nan", "", "1", "2 3 1 0", "4", "10", "")),
     "point 3 of piece 2"},
    {GRID(FIRST("", "") PIECE("4", "1 1 1 0 0 1 1 0 0 0 1 0", "", "1", "2 3 1 4", "4", "10", "")),
     "point 4"},
    {GRID(FIRST("", "") FIRST("", "")), "0 and 1|same four nodes"},
    {GRID(EMPTY EMPTY), "empty"},
    {"<VTKFile type=\"PUnstructuredGrid\"><Piece Source=\"none.vtu\"/></VTKFile>\n", "none.vtu"},
    {"<VTKFile type=\"PUnstructuredGrid\">\n<Piece NumberOfPoints=\"4\"/></VTKFile>\n",
     "line 2|Source"},
    {"<VTKFile type=\"PUnstructuredGrid\"></VTKFile>\n", "Piece"},
    {"<VTKFile type=\"PUnstructuredGrid\"><Piece Source=\"bad.vtu\"/></VTKFile>\n",
     "bad.vtu: |bad.vtu|'PUnstructuredGrid'"},
    {"<VTKFile type=\"PUnstructuredGrid\"><Piece Source=\"cut.vtu\"/></VTKFile>\n",
     "cut.vtu line 1|truncated"},
  };
  static const char *const files[][2] = {{"one.vtu", GRID(FIRST("", ""))},
                                         {"parts/other.vtu", GRID(OTHER("", ""))},
                                         {"cut.vtu", "<VTKFile type=\"UnstructuredGrid\"><Piece "
                                                     "NumberOfPoints=\"1\" NumberOfCells=\"1\">"}};
  char path[600];

  PetscFunctionBeginUser;
  (void)snprintf(path, sizeof(path), "%s/parts", folder);
  SB_CHECK(!mkdir(path, 0700), "no folder %s", path);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(files); k++) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, files[k][0]);
    PetscCall(test_file_put(path, files[k][1]));
  }
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(good); k++) {
    SbImport im;

    (void)snprintf(path, sizeof(path), "%s/pieces.%s", folder, k % 2 ? "vtu" : "pvtu");
    PetscCall(test_file_put(path, good[k].text));
    PetscCall(test_import(path, &im));
    SB_CHECK(im.nvert == good[k].nvert && im.item[3].n == good[k].ntet,
             "pieces %d: %d vertices, %d tets", (int)k, (int)im.nvert, (int)im.item[3].n);
    SB_CHECK(strstr(im.note, good[k].note) != NULL, "pieces %d: note '%s'", (int)k, im.note);
    SB_CHECK(k || (test_count(&im, 3, "volume_7") == 1 && test_count(&im, 3, "volume_8") == 1),
             "pieces lost their regions");
    SB_CHECK(!im.ngroup || !k, "pieces %d: marks of ghosts became groups", (int)k);
    PetscCall(SbImportDestroy(&im));
  }
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(wrong); k++) {
    PetscErrorCode code = PETSC_ERR_FILE_UNEXPECTED;

    (void)snprintf(path, sizeof(path), "%s/bad.vtu", folder);
    PetscCall(test_file_put(path, wrong[k][0]));
    if (strstr(wrong[k][0], "none.vtu"))
      code = PETSC_ERR_FILE_OPEN;
    if (strstr(wrong[k][1], "same four nodes"))
      code = PETSC_ERR_USER_INPUT;
    SB_CHECK_ERROR(test_mesh_use(path), code, wrong[k][1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char path[600];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(folder));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(meshes); k++) {
    PetscReal volume = 0;
    SbImport im;

    (void)snprintf(path, sizeof(path), "%s/%s", folder, meshes[k].name);
    PetscCall(test_file_put(path, meshes[k].text));
    PetscCall(test_import(path, &im));
    for (PetscInt i = 0; i < im.item[3].n; i++)
      volume += PetscAbsReal(SbTetDeterminant(im.x, im.item[3].vert + 4 * i));
    SB_CHECK(im.nvert == 4 && PetscAbsReal(volume - 1) < 1e-12, "mesh %d: %d vertices, volume %g",
             (int)k, (int)im.nvert, volume);
    SB_CHECK(meshes[k].dim < 0 || test_count(&im, meshes[k].dim, meshes[k].group) == 1,
             "mesh %d has no group %s", (int)k, meshes[k].group);
    SB_CHECK(meshes[k].note[0] ? strstr(im.note, meshes[k].note) != NULL : !im.note[0],
             "mesh %d: note '%s'", (int)k, im.note);
    PetscCall(SbImportDestroy(&im));
  }
  PetscCall(test_pieces());
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(surfaces); k++) {
    const PetscReal at[3] = {0, 0, 0};
    SbTriangles t;
    SbSurface s;
    SbImport im = {.scale = 1};
    PetscInt none;

    (void)snprintf(path, sizeof(path), "%s/%s", folder, surfaces[k].name);
    PetscCall(test_file_put(path, surfaces[k].text));
    PetscCall(SbTrianglesRead(PETSC_COMM_WORLD, "-x", path, 1, at, &t));
    SB_CHECK(t.ntri == 4 && PetscAbsReal(t.volume - 1. / 6) < 1e-12, "surface %d: volume %g",
             (int)k, (double)t.volume);
    PetscCall(SbTrianglesDestroy(&t));
    SbTetDefaults(&im.tet);
    PetscCall(SbImportTagSet(&im, 0, NULL, &none));
    PetscCall(SbSurfaceRead(path, &im, &s));
    for (PetscInt g = none = 0; surfaces[k].group && g < im.ngroup; g++)
      none += !strcmp(im.group[g].name, surfaces[k].group);
    SB_CHECK(none == (surfaces[k].group != NULL), "surface %d has %d groups %s", (int)k, (int)none,
             surfaces[k].group);
    PetscCall(SbSurfaceDestroy(&s));
    PetscCall(SbImportDestroy(&im));
  }
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(bad); k++) {
    (void)snprintf(path, sizeof(path), "%s/%s", folder, bad[k][0]);
    PetscCall(test_file_put(path, bad[k][1]));
    SB_CHECK_ERROR(test_mesh_use(path), PETSC_ERR_FILE_UNEXPECTED, bad[k][2]);
  }
  SB_TEST_END();
}
