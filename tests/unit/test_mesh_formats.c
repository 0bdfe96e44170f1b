// One mesh in every format gives the same tets, regions and surfaces. Files of tests/data are from
// gmsh 4.8 (two_cubes.*; .med and .cgns of 4.15), netCDF 4.9 (.exo), VTK 9.7 (two_cubes_*.vtu,
// _51.vtk), TetGen 1.5 and Netgen 6; the other files are written here. @ranks 1
#include "../file.h"
#include "mesh_test.h"

#define DATA "tests/data/"

/* ------------------------------------------------------------------ items of a group, in vertex
   numbers of the reference */

typedef struct {
  PetscInt v[4];
} Row;

static int compare_rows(const void *a, const void *b)
{
  return memcmp(a, b, sizeof(Row));
}

/* Items of one dimension in a group (NULL: all), with vertices renumbered by map[] and sorted; the
   items are sorted too. */
static PetscErrorCode list_items(const SbImport *im, const PetscInt map[], int dim,
                                 const char *name, PetscInt *n, Row **rows)
{
  PetscFunctionBeginUser;
  *n = 0;
  PetscCall(PetscCalloc1(im->item[dim].n + 1, rows));
  for (PetscInt i = 0; i < im->item[dim].n; i++) {
    PetscInt *v = (*rows)[*n].v;

    if (name && !test_in_group(im, im->item[dim].tags[i], name))
      continue;
    for (int k = 0; k <= dim; k++) {
      const PetscInt vert = im->item[dim].vert[(dim + 1) * i + k];

      v[k] = map ? map[vert] : vert;
    }
    PetscCall(PetscSortInt(dim + 1, v));
    (*n)++;
  }
  qsort(*rows, (size_t)*n, sizeof(Row), compare_rows);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vertex of the reference with the same coordinates, for each vertex. */
static void map_vertices(const char *path, const SbImport *im, const SbImport *reference,
                         PetscInt map[])
{
  for (PetscInt v = 0; v < im->nvert; v++) {
    map[v] = -1;
    for (PetscInt w = 0; w < reference->nvert; w++) {
      PetscReal d = 0;

      for (int i = 0; i < 3; i++)
        d = PetscMax(d, PetscAbsReal(im->x[3 * v + i] - reference->x[3 * w + i]));
      if (d < 1e-12)
        map[v] = w;
    }
    SB_CHECK(map[v] >= 0, "%s: vertex %d is not in the mesh", path, (int)v);
  }
}

static PetscErrorCode same_group(const char *path, const SbImport *im, const SbImport *reference,
                                 const PetscInt map[], int dim, const char *name, const char *as)
{
  PetscInt n, expected;
  Row *rows, *expected_rows;

  PetscFunctionBeginUser;
  PetscCall(list_items(im, map, dim, name, &n, &rows));
  PetscCall(list_items(reference, NULL, dim, as, &expected, &expected_rows));
  SB_CHECK(expected > 0, "the mesh has no group '%s'", as ? as : "");
  SB_CHECK(n == expected, "%s: %d items of dimension %d in '%s' instead of %d", path, (int)n, dim,
           name ? name : "all", (int)expected);
  SB_CHECK(n != expected || !memcmp(rows, expected_rows, (size_t)n * sizeof(Row)),
           "%s: other items in '%s'", path, name ? name : "all");
  PetscCall(PetscFree(rows));
  PetscCall(PetscFree(expected_rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  int dim;
  const char *name, *as; /* group in the file, group in the reference */
} Same;

/* Compares a file with the reference; the list of groups ends with a NULL name. */
static PetscErrorCode test_file(const char *path, const SbImport *reference, const Same same[])
{
  SbImport im;
  PetscInt *map;

  PetscFunctionBeginUser;
  PetscCall(test_import(path, &im));
  SB_CHECK(im.nvert == reference->nvert, "%s: %d vertices", path, (int)im.nvert);
  PetscCall(PetscMalloc1(im.nvert, &map));
  map_vertices(path, &im, reference, map);
  PetscCall(same_group(path, &im, reference, map, 3, NULL, NULL));
  for (int i = 0; same[i].name; i++)
    PetscCall(same_group(path, &im, reference, map, same[i].dim, same[i].name, same[i].as));
  PetscCall(PetscFree(map));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ files of gmsh and VTK */

static PetscErrorCode test_foreign(const SbImport *reference)
{
  static const Same names[] = {
    {3, "left", "left"},           {3, "all", "all"},       {2, "wall", "wall"},
    {2, "both ends", "both ends"}, {2, "inner", "inner"},   {2, "surface_77", "surface_77"},
    {1, "edge", "edge"},           {0, "corner", "corner"}, {0, NULL, NULL}};
  static const Same numbers[] = {
    {3, "volume_1", "left"},       {3, "volume_2", "all"},    {2, "surface_3", "wall"},
    {2, "surface_4", "both ends"}, {2, "surface_5", "inner"}, {2, "surface_77", "surface_77"},
    {1, "curve_78", "edge"},       {0, "point_79", "corner"}, {0, NULL, NULL}};
  static const Same sets[] = {
    {3, "left", "left"},   {3, "all", "all"},   {2, "wall", "wall"}, {2, "both_ends", "both ends"},
    {2, "inner", "inner"}, {1, "edge", "edge"}, {0, NULL, NULL}};
  static const Same entities[] = {{3, "volume_1", "left"},   {2, "surface_1", "wall"},
                                  {2, "surface_2", "inner"}, {2, "surface_7", "surface_77"},
                                  {1, "curve_1", "edge"},    {0, NULL, NULL}};
  static const Same med[] = {
    {3, "left", "left"},           {3, "all", "all"},       {2, "wall", "wall"},
    {2, "both ends", "both ends"}, {2, "inner", "inner"},   {2, "G_2D_77", "surface_77"},
    {1, "edge", "edge"},           {0, "corner", "corner"}, {0, NULL, NULL}};
  static const Same cgns[] = {{3, "left", "left"},           {3, "all", "all"},
                              {3, "5_V_1", "left"},          {2, "wall", "wall"},
                              {2, "both ends", "both ends"}, {2, "inner", "inner"},
                              {2, "77", "surface_77"},       {1, "edge", "edge"},
                              {0, "corner", "corner"},       {0, NULL, NULL}};
  static const Same exodus[] = {
    {3, "left", "left"},           {3, "all", "all"},       {2, "wall", "wall"},
    {2, "both ends", "both ends"}, {2, "inner", "inner"},   {2, "surface_77", "surface_77"},
    {1, "edge", "edge"},           {0, "corner", "corner"}, {0, NULL, NULL}};
  static const Same cell_data[] = {{3, "volume_1", "left"},
                                   {2, "surface_3", "wall"},
                                   {2, "surface_5", "inner"},
                                   {2, "surface_4", "surface_77"},
                                   {1, "curve_78", "edge"},
                                   {0, "point_79", "corner"},
                                   {0, NULL, NULL}};
  static const struct {
    const char *path;
    const Same *same;
  } files[] = {
    {DATA "two_cubes_1.msh", numbers},
    {DATA "two_cubes_40.msh", names},
    {DATA "two_cubes.inp", sets},
    {DATA "two_cubes.unv", sets},
    {DATA "two_cubes.unv", entities},
    {DATA "two_cubes.med", med},
    {DATA "two_cubes.cgns", cgns},
    {DATA "two_cubes.exo", exodus},
    {DATA "two_cubes_64bit.exo", exodus},
    {DATA "two_cubes_cdf5.exo", exodus},
    {DATA "two_cubes_hdf5.exo", exodus},
    {DATA "two_cubes.mesh", entities},
    {DATA "two_cubes.bdf", entities},
    {DATA "two_cubes.vtk", cell_data},
    {DATA "two_cubes_51.vtk", cell_data},
    {DATA "two_cubes_51_bin.vtk", cell_data},
    {DATA "two_cubes_ascii.vtu", cell_data},
    {DATA "two_cubes_base64.vtu", cell_data},
    {DATA "two_cubes_zlib.vtu", cell_data},
    {DATA "two_cubes_raw.vtu", cell_data},
    {DATA "two_cubes_raw_zlib.vtu", cell_data},
    {DATA "two_cubes_appended64.vtu", cell_data},
  };

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(files); i++)
    PetscCall(test_file(files[i].path, reference, files[i].same));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ files written by the test */

/* Marker of an item in written files: 1 and 2 for left and right tets, 3 for the wall, 5 for inner,
   9 for other triangles; 0 otherwise. */
static int mark_of(const SbImport *im, int dim, PetscInt i)
{
  const PetscInt tags = im->item[dim].tags[i];

  if (dim == 3)
    return test_in_group(im, tags, "left") ? 1 : 2;
  if (test_in_group(im, tags, "wall"))
    return 3;
  return test_in_group(im, tags, "inner") ? 5 : dim == 2 ? 9 : 0;
}

static void write_vert(FILE *file, const SbImport *im, int dim, PetscInt i, int first)
{
  for (int k = 0; k <= dim; k++)
    fprintf(file, " %d", (int)im->item[dim].vert[(dim + 1) * i + k] + first);
}

/* TetGen files, numbered from `first`, with comments and blank lines. */
static void write_tetgen(const char *stem, const SbImport *im, int first)
{
  char path[256];
  FILE *file;

  (void)snprintf(path, sizeof(path), "%s.node", stem);
  file = fopen(path, "w");
  fprintf(file, "# points\n%d 3 1 1\n\n", (int)im->nvert);
  for (PetscInt v = 0; v < im->nvert; v++)
    fprintf(file, "%d %.17g %.17g %.17g 0.5 %d # one\n", (int)v + first, im->x[3 * v],
            im->x[3 * v + 1], im->x[3 * v + 2], v == 4 ? 79 : 0);
  fclose(file);
  (void)snprintf(path, sizeof(path), "%s.ele", stem);
  file = fopen(path, "w");
  fprintf(file, "  %d 4 1\n", (int)im->item[3].n);
  for (PetscInt i = 0; i < im->item[3].n; i++) {
    fprintf(file, "%d", (int)i + first);
    write_vert(file, im, 3, i, first);
    fprintf(file, " %d.0\n", mark_of(im, 3, i));
  }
  fclose(file);
  (void)snprintf(path, sizeof(path), "%s.face", stem);
  file = fopen(path, "w");
  fprintf(file, "%d 1\n", (int)im->item[2].n);
  for (PetscInt i = 0; i < im->item[2].n; i++) {
    fprintf(file, "%d", (int)i + first);
    write_vert(file, im, 2, i, first);
    fprintf(file, " %d -1 7\n", mark_of(im, 2, i)); /* with neighbours, as tetgen -nn writes them */
  }
  fclose(file);
}

static void write_neutral(const char *path, const SbImport *im)
{
  FILE *file = fopen(path, "w");

  fprintf(file, "%d\n", (int)im->nvert);
  for (PetscInt v = 0; v < im->nvert; v++)
    fprintf(file, "  %.17g  %.17g  %.17g\n", im->x[3 * v], im->x[3 * v + 1], im->x[3 * v + 2]);
  for (int dim = 3; dim > 1; dim--) {
    fprintf(file, "%d\n", (int)im->item[dim].n);
    for (PetscInt i = 0; i < im->item[dim].n; i++) {
      fprintf(file, "%d", mark_of(im, dim, i));
      write_vert(file, im, dim, i, 1);
      fprintf(file, "\n");
    }
  }
  fclose(file);
}

/* Netgen volume file with the points last; a name with a blank, an empty name, and a name without
   triangles. */
static void write_vol(const char *path, const SbImport *im)
{
  FILE *file = fopen(path, "w");

  fprintf(file,
          "mesh3d\ndimension\n3\ngeomtype\n0\n\n# surfnr bcnr domin domout np p1 p2 "
          "p3\nsurfaceelementsgi\n%d\n",
          (int)im->item[2].n);
  for (PetscInt i = 0; i < im->item[2].n; i++) {
    fprintf(file, " 1 %d 1 0 3", mark_of(im, 2, i));
    write_vert(file, im, 2, i, 1);
    fprintf(file, " 4 5 6\n");
  }
  fprintf(file, "# matnr np p1 p2 p3 p4\nvolumeelements\n%d\n", (int)im->item[3].n);
  for (PetscInt i = 0; i < im->item[3].n; i++) {
    fprintf(file, "%d 4", mark_of(im, 3, i));
    write_vert(file, im, 3, i, 1);
    fprintf(file, "\n");
  }
  fprintf(file, "points\n%d\n", (int)im->nvert);
  for (PetscInt v = 0; v < im->nvert; v++)
    fprintf(file, "  %.17g  %.17g  %.17g\n", im->x[3 * v], im->x[3 * v + 1], im->x[3 * v + 2]);
  fprintf(
    file,
    "\nmaterials\n3\n1 the left one\n2 \n3\nbcnames\n3\n3 wall\n4 nowhere\n5 inner\nendmesh\n");
  fclose(file);
}

/* Tet and side number of a triangle: S1 is opposite the fourth node, S2 the third, S3 the first, S4
   the second. */
static void find_side(const SbImport *im, PetscInt triangle, int *tet, int *side)
{
  static const int opposite[4] = {3, 4, 2, 1}; /* side opposite node i */

  for (PetscInt c = 0; c < im->item[3].n; c++) {
    int n = 0;
    int other = -1;

    for (int i = 0; i < 4; i++) {
      PetscBool on = PETSC_FALSE;

      for (int k = 0; k < 3; k++)
        on = (PetscBool)(on || im->item[2].vert[3 * triangle + k] == im->item[3].vert[4 * c + i]);
      n += on;
      if (!on)
        other = i;
    }
    if (n == 3) {
      *tet = (int)c + 1;
      *side = opposite[other];
    }
  }
}

/* One part and its instance; generated sets, a set of other sets that are defined later, and
   surfaces of element sides. */
static void write_abaqus(const char *path, const SbImport *im)
{
  FILE *file = fopen(path, "w");
  int nleft = 0;
  int tet = 0;
  int side = 0;

  fprintf(file, "*Heading\n** two cubes\n*Part, name=Thing\n*NODE, NSET=Everything\n");
  for (PetscInt v = 0; v < im->nvert; v++)
    fprintf(file, "%d, %.17g, %.17g, %.17g\n", (int)v + 1, im->x[3 * v], im->x[3 * v + 1],
            im->x[3 * v + 2]);
  fprintf(file, "*Element, type=C3D4\n");
  for (PetscInt i = 0; i < im->item[3].n; i++) {
    fprintf(file, "%d", (int)i + 1);
    for (int k = 0; k < 4; k++)
      fprintf(file, ", %d", (int)im->item[3].vert[4 * i + k] + 1);
    fprintf(file, "\n");
    if (mark_of(im, 3, i) != 1)
      continue;
    SB_CHECK(i == nleft, "the tets on the left are not the first ones");
    nleft++;
  }
  fprintf(file, "*Elset, elset=Whole\nLeft, \"Right\"\n*Elset, elset=left, generate\n1, %d\n",
          nleft);
  fprintf(file,
          "*Elset, elset=Right, generate\n%d, %d, 1\n*Solid Section, elset=Whole, "
          "material=M\n1.,\n*End Part\n",
          nleft + 1, (int)im->item[3].n);
  fprintf(file,
          "*Assembly, name=A\n*Instance, name=Thing-1, part=Thing\n*End Instance\n*Nset, nset=Tip, "
          "instance=Thing-1\n %d,\n",
          (int)im->item[0].vert[0] + 1);
  for (int all = 0; all < 2; all++) {
    fprintf(file, "*Surface, type=ELEMENT, name=%s\n", all ? "Sides" : "Wall");
    for (PetscInt i = 0; i < im->item[2].n; i++) {
      if (!all && mark_of(im, 2, i) != 3)
        continue;
      find_side(im, i, &tet, &side);
      fprintf(file, "Thing-1.%d, S%d\n", tet, side);
    }
  }
  fprintf(file, "*End Assembly\n*Step\n*End Step\n");
  fclose(file);
}

/* Node in one of four Nastran formats: free with commas, short fields with tabs, long fields, short
   fields without the letter of the exponent. */
static void write_grid(FILE *file, int way, int label, const PetscReal x[3])
{
  if (way == 0)
    fprintf(file, "grid,%d,,%.4f,%.4f,%.4f $ free\n", label, x[0], x[1], x[2]);
  else if (way == 1)
    fprintf(file, "GRID\t%d\t0\t%.4f\t%.4f\t%.4f\r\n", label, x[0], x[1], x[2]);
  else if (way == 2)
    fprintf(file, "GRID*   %16d%16s%16.9f%16.9f*G%d\n*G%-6d%16.9E\n", label, "", x[0], x[1], label,
            label, x[2]);
  else
    fprintf(file, "%-8s%8d%8s%6.2f-2%6.2f+0%8.4f\n", "GRID", label, "", 100 * x[0], x[1], x[2]);
}

/* Nastran deck with executive section and ENDDATA; elements before their points, names in the
   comments of four programs, sets of nodes. */
static void write_nastran(const char *path, const SbImport *im)
{
  FILE *file = fopen(path, "w");

  fprintf(file, "SOL 101\nCEND\nSET 4 = 1,2\nGRID 1 2 3\nBEGIN BULK\n");
  fprintf(file,
          "$ANSA_NAME_COMMENT;1;PSOLID;the left one;NO;NO;\n$ANSA_NAME_COMMENT;1;MAT1;steel;NO;\n");
  fprintf(
    file,
    "$HMNAME PROP                   2\"right\" 4\n$ Femap with NX Nastran Property 3 : wall\n");
  fprintf(
    file,
    "MAT1,7,1.,,.3\n$ Elements and Element Properties for region : inner\n,,\nPSHELL,5,1,1.\n");
  fprintf(file, "PSOLID,1,7\n+,0\n");
  for (PetscInt i = 0; i < im->item[3].n; i++) {
    fprintf(file, "CTETRA  %8d%8d", (int)i + 1, mark_of(im, 3, i));
    for (int k = 0; k < 4; k++)
      fprintf(file, "%8d", (int)im->item[3].vert[4 * i + k] + 1);
    fprintf(file, "\n$ a comment\n\n");
  }
  for (int dim = 2; dim > 0; dim--) {
    for (PetscInt i = 0; i < im->item[dim].n; i++) {
      fprintf(file, "%s,%d,%d", dim == 2 ? "CTRIA3" : "CBAR", 1000 * dim + (int)i,
              dim == 2 ? mark_of(im, 2, i) : 78);
      for (int k = 0; k <= dim; k++)
        fprintf(file, ",%d", (int)im->item[dim].vert[(dim + 1) * i + k] + 1);
      fprintf(file, ",0.,0.,1.\n");
    }
  }
  for (PetscInt v = 0; v < im->nvert; v++)
    write_grid(file, (int)v % 4, (int)v + 1, im->x + 3 * v);
  fprintf(file, "SPC1,3,123,%d,%d,,%d,THRU,\n+,%d,900,THRU,999\n", (int)im->item[0].vert[0] + 1,
          (int)im->item[0].vert[0] + 1, (int)im->item[0].vert[0] + 1, (int)im->item[0].vert[0] + 1);
  fprintf(file, "SPC,4,%d,123,0.\nSET1,5,%d\nENDDATA\n ,1,2,3,4,5,6,7,8,9,10,11\nGRID,1\n",
          (int)im->item[0].vert[0] + 1, (int)im->item[0].vert[0] + 1);
  fclose(file);
}

static PetscErrorCode test_written(const SbImport *reference, const char *folder)
{
  static const Same marks[] = {
    {3, "volume_1", "left"}, {2, "surface_3", "wall"}, {2, "surface_5", "inner"}, {0, NULL, NULL}};
  static const Same names[] = {{3, "the left one", "left"},
                               {2, "wall", "wall"},
                               {2, "inner", "inner"},
                               {2, "surface_9", "surface_77"},
                               {0, NULL, NULL}};
  static const Same sets[] = {{3, "Left", "left"}, {3, "Whole", NULL},   {2, "Wall", "wall"},
                              {2, "Sides", NULL},  {0, "Tip", "corner"}, {0, NULL, NULL}};
  static const Same deck[] = {{3, "the_left_one", "left"}, {2, "wall", "wall"},
                              {2, "inner", "inner"},       {1, "curve_78", "edge"},
                              {0, "spc_3", "corner"},      {0, "spc_4", "corner"},
                              {0, "set_5", "corner"},      {0, NULL, NULL}};
  char path[256], stem[200];
  SbImport im;

  PetscFunctionBeginUser;
  for (int first = 0; first < 2; first++) {
    (void)snprintf(stem, sizeof(stem), "%s/from_%d.1", folder, first);
    write_tetgen(stem, reference, first);
    PetscCall(test_file(stem, reference, marks)); /* also without an ending */
    (void)snprintf(path, sizeof(path), "%s.ele", stem);
    PetscCall(test_file(path, reference, marks));
    (void)snprintf(path, sizeof(path), "%s.node", stem);
    PetscCall(test_file(path, reference, marks));
  }
  (void)snprintf(path, sizeof(path), "%s/neutral.mesh",
                 folder); /* an ending it shares with Medit */
  write_neutral(path, reference);
  PetscCall(test_file(path, reference, marks));
  (void)snprintf(path, sizeof(path), "%s/names.vol", folder);
  write_vol(path, reference);
  PetscCall(test_file(path, reference, names));
  (void)snprintf(path, sizeof(path), "%s/sets.inp", folder);
  write_abaqus(path, reference);
  PetscCall(test_file(path, reference, sets));
  (void)snprintf(path, sizeof(path), "%s/deck.Bdf", folder);
  write_nastran(path, reference);
  PetscCall(test_file(path, reference, deck));
  PetscCall(test_import(path, &im));
  SB_CHECK(im.item[0].n == 1, "%d points for three sets of one node", (int)im.item[0].n);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ files of TetGen and Netgen */

/* Unit cube with side markers 11 to 16 and region 7: tetgen -pqaAfenn. */
static PetscErrorCode test_tetgen(void)
{
  SbImport im;
  char name[32];
  PetscInt sides = 0;

  PetscFunctionBeginUser;
  PetscCall(test_import(DATA "tetgen.ele", &im));
  SB_CHECK(im.nvert == 26 && im.item[3].n == 36, "%d vertices, %d tets", (int)im.nvert,
           (int)im.item[3].n);
  SB_CHECK(test_count(&im, 3, "volume_7") == 36, "%d tets in region 7",
           (int)test_count(&im, 3, "volume_7"));
  for (int side = 11; side <= 16; side++) {
    const int axis = (const int[]){2, 2, 1, 0, 1, 0}[side - 11];
    const int at = (const int[]){0, 1, 0, 1, 1, 0}[side - 11];

    (void)snprintf(name, sizeof(name), "surface_%d", side);
    SB_CHECK(test_count(&im, 2, name) > 0, "no face on side %d", side);
    for (PetscInt i = 0; i < im.item[2].n; i++) {
      if (!test_in_group(&im, im.item[2].tags[i], name))
        continue;
      sides++;
      for (int k = 0; k < 3; k++)
        SB_CHECK_NEAR(im.x[3 * im.item[2].vert[3 * i + k] + axis], at, 1e-12,
                      "coordinate on its side");
    }
  }
  SB_CHECK(sides == 48, "%d faces on the sides", (int)sides);
  SB_CHECK(test_count(&im, 0, "point_5") == 1, "%d points with marker 5",
           (int)test_count(&im, 0, "point_5"));
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Two unit cubes side by side, with names of materials and boundary conditions; the neutral format
   has numbers only. */
static PetscErrorCode test_netgen(void)
{
  SbImport vol, neu;
  PetscInt outer = 0;

  PetscFunctionBeginUser;
  PetscCall(test_import(DATA "netgen.vol", &vol));
  PetscCall(test_import(DATA "netgen.neu", &neu));
  SB_CHECK(vol.nvert == 12 && vol.item[3].n == 12, "%d vertices, %d tets", (int)vol.nvert,
           (int)vol.item[3].n);
  SB_CHECK(test_count(&vol, 3, "left") == 6 && test_count(&vol, 3, "right") == 6, "%d and %d tets",
           (int)test_count(&vol, 3, "left"), (int)test_count(&vol, 3, "right"));
  SB_CHECK(test_count(&vol, 2, "left_side") > 0 && test_count(&vol, 2, "right_side") > 0,
           "no sides");
  for (PetscInt i = 0; i < vol.item[3].n; i++) {
    PetscReal middle = 0;

    for (int k = 0; k < 4; k++)
      middle += vol.x[3 * vol.item[3].vert[4 * i + k]] / 4;
    SB_CHECK(test_in_group(&vol, vol.item[3].tags[i], middle < 1 ? "left" : "right"),
             "tet %d at %g", (int)i, middle);
  }
  SB_CHECK(neu.nvert == 12 && neu.item[3].n == 12, "%d vertices, %d tets", (int)neu.nvert,
           (int)neu.item[3].n);
  SB_CHECK(test_count(&neu, 3, "volume_1") == 6, "%d tets in volume_1",
           (int)test_count(&neu, 3, "volume_1"));
  for (PetscInt i = 0; i < vol.item[2].n; i++)
    outer += vol.item[2].tags[i] != 0;
  SB_CHECK(outer == vol.item[2].n && neu.item[2].n == vol.item[2].n, "%d and %d triangles",
           (int)outer, (int)neu.item[2].n);
  PetscCall(SbImportDestroy(&vol));
  PetscCall(SbImportDestroy(&neu));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define UNV(label, x) label " 0 0 11\n" x "\n"

/* One second-order tet in each format's node order: the nodes of edges 02, 13 and 23 are displaced
   from the edge midpoints by multiples of 0.1. */
static PetscErrorCode test_second_order(const char *folder)
{
  static const struct {
    const char *name, *text;
  } file[] = {
    {"q.msh",
     "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0.5 "
     "0 "
     "0\n6 0.5 0.5 0\n7 -0.1 0.5 0\n"
     "8 0 0 0.5\n9 0 0.5 0.7\n10 0.5 0.3 0.5\n$EndNodes\n$Elements\n1\n1 11 0 1 2 3 4 5 6 7 8 9 "
     "10\n$EndElements\n"},
    {"q.vtk", "# vtk DataFile Version 3.0\nq\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 "
              "double\n0 0 0\n1 0 0\n0 1 "
              "0\n0 0 1\n0.5 0 0\n0.5 0.5 0\n"
              "-0.1 0.5 0\n0 0 0.5\n0.5 0.3 0.5\n0 0.5 0.7\nCELLS 1 11\n10 0 1 2 3 4 5 6 7 8 "
              "9\nCELL_TYPES 1\n24\n"},
    {"q.inp", "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,0.5,0,0\n6,0.5,0.5,0\n7,-0.1,0.5,0\n8,"
              "0,0,0.5\n9,"
              "0.5,0.3,0.5\n10,0,0.5,0.7\n"
              "*ELEMENT, TYPE=C3D10\n1,1,2,3,4,5,6,7,8,9,10\n"},
    {"q.bdf",
     "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\nGRID,7,,-.1,.5,0."
     "\nGRID,9,,.5,.3,.5\nGRID,10,,0.,.5,.7\n"
     "CTETRA,1,1,1,2,3,4,,,+\n+,7,,9,10\nENDDATA\n"},
    /* node positions in each format's order; a triangle and, where the format has them, a line
       identify the corners */
    {"q.unv",
     "    -1\n  2411\n" UNV("1", "0 0 0") UNV("2", "1 0 0") UNV("3", "0 1 0") UNV("4", "0 0 1")
       UNV("5", ".5 0 0") UNV("6", ".5 .5 0") UNV("7", "-.1 .5 0") UNV("8", "0 0 .5")
         UNV("9", "0 .5 .7")
           UNV("10", ".5 .3 .5") "    -1\n    -1\n  2412\n1 118 1 1 7 10\n1 5 2 6 3 7 8 10\n9 4\n"
                                 "2 92 9 1 7 6\n1 5 2 6 3 7\n3 24 8 1 7 3\n0 0 0\n1 5 2\n    -1\n"},
    {"q.mesh",
     "MeshVersionFormatted 2\nDimension 3\nVertices\n10\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
     ".5 0 0 0\n.5 .5 0 0\n-.1 .5 0 0\n0 0 .5 0\n0 .5 .7 0\n.5 .3 .5 0\n"
     "TetrahedraP2\n1\n1 2 3 4 5 6 7 8 10 9 1\nTrianglesP2\n1\n1 2 3 5 6 7 9\n"
     "EdgesP2\n1\n1 2 5 8\nEnd\n"},
    {"q.vol",
     "mesh3d\nvolumeelements\n1\n1 10 1 2 3 4 5 7 8 6 10 9\nsurfaceelements\n1\n"
     "1 9 1 0 6 1 2 3 6 7 5\npoints\n10\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n.5 0 0\n.5 .5 0\n-.1 .5 0\n"
     "0 0 .5\n0 .5 .7\n.5 .3 .5\n"},
    {"q.neu",
     "10\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n.5 0 0\n.5 .5 0\n-.1 .5 0\n0 0 .5\n0 .5 .7\n.5 .3 .5\n"
     "1\n1 1 2 3 4 5 7 8 6 10 9\n1\n9 1 2 3 6 7 5\n"},
    {"q.node",
     "10 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 .5 0 0\n6 .5 .5 0\n7 -.1 .5 0\n8 0 0 .5\n"
     "9 0 .5 .7\n10 .5 .3 .5\n"},
    {"q.face", "1 1\n1 1 2 3 6 7 5 9\n"},
    {"q.edge", "1 1\n1 1 2 5 8\n"},
    {"q.ele", "1 10 0\n1 1 2 3 4 9 8 5 6 10 7\n"}};
  static const struct {
    PetscInt end[2];
    PetscReal off[3];
  } expected[3] = {{{0, 2}, {-0.1, 0, 0}}, {{1, 3}, {0, 0.3, 0}}, {{2, 3}, {0, 0, 0.2}}};

  PetscFunctionBeginUser;
  for (size_t f = 0; f < PETSC_STATIC_ARRAY_LENGTH(file); f++) {
    char path[128];
    TestMesh m;

    (void)snprintf(path, sizeof(path), "%s/%s", folder, file[f].name);
    PetscCall(test_file_put(path, file[f].text));

    /* TetGen's mesh is read by the last of its files */
    if (strstr(file[f].name, ".node") || strstr(file[f].name, ".face") ||
        strstr(file[f].name, ".edge"))
      continue;
    PetscCall(test_mesh_read(test_body("b", path), &m));
    for (int dim = 1; dim <= 2; dim++) {
      static const char *const with_lines = ".unv .mesh .ele";
      static const char *const with_triangles = ".unv .mesh .vol .neu .ele";
      const PetscBool there =
        (PetscBool)(strstr(dim == 1 ? with_lines : with_triangles, file[f].name + 1) != NULL);

      SB_CHECK(test_count(&m.im, dim, dim == 1 ? "curve_8" : "surface_9") == (PetscInt)there,
               "%s: %d of dimension %d", file[f].name, (int)m.im.item[dim].n, dim);
    }
    SB_CHECK(m.im.nvert == 4 && m.im.item[3].n == 1 && m.im.nunused == 0 && m.im.nmiddle.n == 3,
             "%s: %d vertices, %d tets, %d unused, %d edges off the middle", file[f].name,
             (int)m.im.nvert, (int)m.im.item[3].n, (int)m.im.nunused, (int)m.im.nmiddle.n);
    for (int i = 0; i < 3 && m.im.nmiddle.n == 3; i++) {
      const SbMiddle *e = &m.im.middle[i];
      PetscReal off = 0;

      for (int k = 0; k < 3; k++)
        off = PetscMax(off, PetscAbsReal(e->off[k] - expected[i].off[k]));
      SB_CHECK(e->end[0] == expected[i].end[0] && e->end[1] == expected[i].end[1] && off < 1e-14,
               "%s: edge %d-%d off by %g", file[f].name, (int)e->end[0], (int)e->end[1], off);
    }
    PetscCall(SbImportDestroy(&m.im));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char folder[] = "/tmp/sbformats_XXXXXX";
  char command[64];
  SbImport reference, im;

  SB_TEST_BEGIN(argc, argv);
  SB_CHECK(mkdtemp(folder), "no folder %s", folder);
  PetscCall(test_import(DATA "two_cubes_41.msh", &reference));
  PetscCall(test_foreign(&reference));
  PetscCall(test_written(&reference, folder));
  PetscCall(test_second_order(folder));

  /* the region numbers of a VTK file with a second array are preserved by conversion */
  PetscCall(test_import(DATA "two_cubes.vtk", &im));
  for (PetscInt g = 0; g < im.ngroup; g++) {
    const char *number = strrchr(im.group[g].name, '_');

    SB_CHECK(number && strtoll(number + 1, NULL, 10) == (long long)im.group[g].tag,
             "'%s' has the number %lld", im.group[g].name, (long long)im.group[g].tag);
  }
  PetscCall(SbImportDestroy(&im));
  PetscCall(SbImportDestroy(&reference));
  PetscCall(test_tetgen());
  PetscCall(test_netgen());
  (void)snprintf(command, sizeof(command), "rm -rf %s", folder);
  SB_CHECK(!system(command), "%s stays", folder);
  SB_TEST_END();
}
