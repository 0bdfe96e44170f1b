/*
  import_tetgen.c - reader of TetGen's meshes: NAME.node and NAME.ele, with optional NAME.face and
  NAME.edge (TetGen 1.5 manual, section 5.2).

  Each file begins with a line of counts; each further line is one item: its number, then its
  values. Point numbers begin at 0 or 1, as in the first line of NAME.node. A # begins a comment.
  Values at the end of a line beyond the announced ones (neighbours of faces, by tetgen -nn) are
  ignored; for tets they are an error.

  Kept: the first attribute of a tet is its region, volume_N; a marker of a face, edge or point, not
  0, is surface_N, curve_N or point_N. Second-order meshes (tetgen -o2) have faces of 6 points and
  edges of 3. Attributes must be integers.
*/
#include "meshio_impl.h"

/* Files of a mesh: extension, items, and the counts on the first line. */
static const struct {
  const char *ending, *count, *title, *mark;
  int dim, ncount,
    room; /* dimension; numbers read from the first line; least number of bytes per item */
} files[] = {
  {".node", "number of points", "points", "marker of a point", 0, 4, 8},
  {".ele", "number of tetrahedra", "tetrahedra", "attribute of a tetrahedron", 3, 3, 10},
  {".face", "number of faces", "faces", "marker of a face", 2, 2, 8},
  {".edge", "number of edges", "edges", "marker of an edge", 1, 2, 6},
};

/* Requires another value on this line. */
static PetscErrorCode on_line(SbScan *s, const char *what)
{
  PetscFunctionBeginUser;
  if (!SbScanMore(s, '#'))
    SB_SCAN_ERROR(s, "the line ends where the %s is expected", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads one file: the line of counts, then a line for each item: number, coordinates or points,
   attributes, marker. A marker of 0 is a group for tets only. */
static PetscErrorCode read_file(SbImport *im, int f)
{
  static const int types[2][4] = {{SB_GMSH_POINT, SB_GMSH_LINE, SB_GMSH_TRIANGLE, SB_GMSH_TET},
                                  {SB_GMSH_POINT, SB_GMSH_LINE3, SB_GMSH_TRIANGLE6, SB_GMSH_TET10}};

  /* positions of the nodes in gmsh's order; edges 23 03 01 12 13 02 */
  static const int place[10] = {0, 1, 2, 3, 8, 7, 4, 5, 9, 6};
  SbScan *s = &im->scan;
  const int dim = files[f].dim;
  int type, npoint;
  int64_t count[4] = {0, 0, 0, 0};
  int64_t number, first, point;
  PetscReal attribute;

  PetscFunctionBeginUser;

  /* the first count is required, the others default to 0 */
  PetscCall(SbScanText(s, files[f].count, &count[0]));
  for (int i = 1; i < files[f].ncount && SbScanMore(s, '#'); i++)
    PetscCall(SbScanText(s, "count or mark of the first line", &count[i]));
  SbScanEndOfLine(s);
  if (dim == 0 && count[1] != 3 && count[1] != 0)
    SB_SCAN_ERROR(s, "the points have dimension %lld; expected 3", (long long)count[1]);
  PetscCall(SbScanRoom(s, files[f].title, count[0], files[f].room, files[f].room));
  if (dim == 0) {
    PetscCall(SbScanRoom(s, "attributes", count[2], 2, 2));
    if (!count[0])
      SB_SCAN_ERROR(s, "0 points; when they stand in a .poly or .smesh file, let TetGen write the "
                       "mesh (tetgen -p)");
    PetscCall(SbImportSetVertices(im, (PetscInt)count[0]));
  }
  if (dim == 3 && count[1] != 0 && count[1] != 4 && count[1] != 10)
    SB_SCAN_ERROR(s, "elements of %lld points; expected 4 or 10", (long long)count[1]);

  /* only the file of the tets has the order of the elements */
  type = types[dim == 3 ? count[1] == 10 : im->count[SB_GMSH_TET10] > 0][dim];
  npoint = SbGmshTypes[type].nnode;
  for (PetscInt i = 0; i < count[0]; i++) {
    const int64_t marks = count[files[f].ncount - 1];
    PetscInt vert[10] = {i};
    PetscInt tags = 0;

    PetscCall(SbScanText(s, dim ? "number of an item" : "number of a point", &number));

    // point numbers are consecutive; a point has coordinates, a tet, face or edge has points
    if (dim == 0)
      im->vert_number[i] = number;
    first = im->vert_number[0];
    if (dim == 0 && first != 0 && first != 1)
      SB_SCAN_ERROR(s, "the first point has number %lld; TetGen counts from 0 or 1",
                    (long long)number);
    if (dim == 0 && number != first + i)
      SB_SCAN_ERROR(s, "point %lld follows point %lld; TetGen numbers them without gaps",
                    (long long)number, (long long)(first + i - 1));
    for (int k = 0; k < (dim ? npoint : 3); k++) {
      PetscCall(on_line(s, dim ? "number of a point" : "coordinate"));
      if (dim == 0) {
        PetscCall(SbScanReal(s, "coordinate", number, &im->x[3 * i + k]));
        if (!isfinite(im->x[3 * i + k]))
          SB_SCAN_ERROR(s, "coordinate of point %lld is not a finite number; repair the file",
                        (long long)number);
        continue;
      }
      PetscCall(SbScanText(s, "number of a point", &point));
      if (point < first || point - first >= im->nvert)
        SB_SCAN_ERROR(s, "point %lld is not in the .node file, which holds %lld to %lld",
                      (long long)point, (long long)first, (long long)(first + im->nvert - 1));
      vert[place[k]] = (PetscInt)(point - first);
    }
    for (int64_t k = 0; dim == 0 && k < count[2]; k++) {
      PetscCall(on_line(s, "attribute of a point"));
      PetscCall(SbScanReal(s, "attribute of a point", 0, &attribute));
    }

    // the marker: an integer, written with or without decimals
    if (dim ? marks > 0 : marks && SbScanMore(s, '#')) {
      PetscReal mark;

      PetscCall(on_line(s, files[f].mark));
      PetscCall(SbScanReal(s, files[f].mark, 0, &mark));
      if (!(PetscAbsReal(mark) < 1e15) || mark != PetscFloorReal(mark))
        SB_SCAN_ERROR(
          s, "the %s is %g; supple takes it for the number of a group, which is a whole one",
          files[f].mark, (double)mark);
      if (mark != 0 || dim == 3)
        PetscCall(SbImportTagsAlone(im, dim, (int64_t)mark, NULL, &tags));
    }

    // more points than announced for a tet are an error
    for (int64_t k = 1; dim == 3 && k < count[2] && SbScanMore(s, '#'); k++)
      PetscCall(SbScanReal(s, files[f].mark, 0, &attribute));
    if (dim == 3 && SbScanMore(s, '#'))
      SB_SCAN_ERROR(
        s,
        "tetrahedron %lld goes on behind its %d points and %lld attributes, which the first line "
        "announces; correct that line",
        (long long)number, npoint, (long long)count[2]);
    PetscCall(SbImportAddElement(im, type, vert, tags, number));
    SbScanEndOfLine(s);
  }
  if (dim == 3)
    PetscCall(SbImportCheckTypes(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_TetGen(const char *path, SbImport *im)
{
  const size_t all = strlen(im->where);
  const size_t tail = strlen(path);
  const int lead = all >= tail && !strcmp(im->where + all - tail, path) ? (int)(all - tail) : 0;
  const char *dot = strrchr(path, '.');
  size_t stem = tail;

  PetscFunctionBeginUser;

  /* name without extension */
  for (size_t f = 0; dot && f < PETSC_STATIC_ARRAY_LENGTH(files); f++)
    if (!strcmp(dot, files[f].ending))
      stem = (size_t)(dot - path);
  for (int f = 0; f < 4; f++) {
    char name[PETSC_MAX_PATH_LEN + 8];
    char *where = NULL;
    PetscBool exists = PETSC_TRUE;

    /* faces and edges are optional */
    (void)snprintf(name, sizeof(name), "%.*s%s", (int)stem, path, files[f].ending);
    if (f > 1)
      PetscCall(PetscTestFile(name, 'r', &exists));
    if (!exists)
      continue;

    /* error messages name this file */
    PetscCall(SbImportScratch(im, sizeof(im->where) + 8, &where));
    (void)snprintf(where, sizeof(im->where) + 8, "%.*s%s", lead, im->where, name);
    PetscCall(PetscFree(im->scan.data));
    PetscCall(SbScanOpen(where, name, &im->scan));
    im->scan.comment = '#';
    PetscCall(read_file(im, f));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
