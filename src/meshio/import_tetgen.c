/*
  import_tetgen.c - reader of TetGen's meshes: NAME.node and NAME.ele, with NAME.face and NAME.edge when they are there
  (TetGen 1.5 manual, section 5.2).

  Every file begins with a line of counts; each line after that is one item: its number, then its values. Numbers of points begin at 0 or
  1, as the first line of NAME.node says. A # begins a comment. What stands at the end of a line beyond the announced values (TetGen's -nn
  writes neighbours there) is not read.

  Kept: the first attribute of a tet is its region, volume_N; the marker of a face, an edge or a point other than 0 is surface_N,
  curve_N or point_N. Refused: tets of 10 nodes, attributes that are no whole numbers.
*/
#include "gmsh_types.h"

typedef struct {
  SbScan scan;
  char where[PETSC_MAX_PATH_LEN + 2 * SB_NAME_MAX + 8]; /* as that of the body, with the name of this file */
  SbImport *im;
  int64_t first; /* number of the first point: 0 or 1 */
  int64_t count[SB_GMSH_NTYPES];
} TetGen;

/* ------------------------------------------------------------------ names */

static const char *const endings[] = {".node", ".ele", ".face", ".edge"};

/* The name without one of TetGen's endings. */
static void stem_of(const char *path, size_t size, char stem[])
{
  char *dot;

  (void)snprintf(stem, size, "%s", path);
  dot = strrchr(stem, '.');
  for (size_t i = 0; dot && i < PETSC_STATIC_ARRAY_LENGTH(endings); i++) {
    if (strcmp(dot, endings[i])) continue;
    *dot = 0;
    return;
  }
}

/* Opens stem + ending; the messages of the file name it in place of what the scenario says. */
static PetscErrorCode open_part(TetGen *t, const char *path, const char *stem, const char *ending)
{
  char name[PETSC_MAX_PATH_LEN + 8];
  const size_t all = strlen(t->im->where), tail = strlen(path);
  const int lead = all >= tail && !strcmp(t->im->where + all - tail, path) ? (int)(all - tail) : 0;

  PetscFunctionBeginUser;
  (void)snprintf(name, sizeof(name), "%s%s", stem, ending);
  (void)snprintf(t->where, sizeof(t->where), "%.*s%s", lead, t->im->where, name);
  PetscCall(SbScanOpen(t->where, name, &t->scan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscBool part_exists(const char *stem, const char *ending)
{
  char name[PETSC_MAX_PATH_LEN + 8];
  PetscBool exists = PETSC_FALSE;

  (void)snprintf(name, sizeof(name), "%s%s", stem, ending);
  (void)PetscTestFile(name, 'r', &exists);
  return exists;
}

/* ------------------------------------------------------------------ lines */

/* The line of counts: the first is needed, those left out are 0. */
static PetscErrorCode read_counts(TetGen *t, const char *what, int n, int64_t count[])
{
  PetscFunctionBeginUser;
  for (int i = 1; i < n; i++) count[i] = 0;
  SbScanNext(&t->scan, '#');
  PetscCall(SbScanText(&t->scan, what, &count[0]));
  for (int i = 1; i < n && SbScanMore(&t->scan, '#'); i++)
    PetscCall(SbScanText(&t->scan, "count or mark of the first line", &count[i]));
  PetscCall(SbScanEndOfLine(&t->scan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A value that must stand on this line. */
static PetscErrorCode on_line(TetGen *t, const char *what)
{
  PetscFunctionBeginUser;
  if (!SbScanMore(&t->scan, '#')) SB_SCAN_ERROR(&t->scan, "the line ends where the %s is expected", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A whole number, written with or without decimals. */
static PetscErrorCode read_mark(TetGen *t, const char *what, int64_t *mark)
{
  PetscReal value = 0;

  PetscFunctionBeginUser;
  PetscCall(on_line(t, what));
  PetscCall(SbScanReal(&t->scan, what, 0, &value));
  if (!(PetscAbsReal(value) < 1e15) || value != PetscFloorReal(value))
    SB_SCAN_ERROR(&t->scan, "the %s is %g; supple takes it for the number of a group, which is a whole one",
                  what, (double)value);
  *mark = (int64_t)value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ .node */

/* counts: points, dimension, attributes, marks */
static PetscErrorCode read_node(TetGen *t, PetscInt v, const int64_t count[4])
{
  SbScan *s = &t->scan;
  PetscReal attribute;
  PetscInt tags;
  int64_t mark;

  PetscFunctionBeginUser;
  SbScanNext(s, '#');
  PetscCall(SbScanText(s, "number of a point", &t->im->vert_number[v]));
  if (!v) t->first = t->im->vert_number[0];
  if (!v && t->first != 0 && t->first != 1)
    SB_SCAN_ERROR(s, "the first point has number %lld; TetGen counts from 0 or 1", (long long)t->first);
  if (t->im->vert_number[v] != t->first + v)
    SB_SCAN_ERROR(s, "point %lld follows point %lld; TetGen numbers them without gaps",
                  (long long)t->im->vert_number[v], (long long)(t->first + v - 1));
  for (int i = 0; i < 3; i++) {
    PetscCall(on_line(t, "coordinate"));
    PetscCall(SbScanReal(s, "coordinate", t->im->vert_number[v], &t->im->x[3 * v + i]));
    if (!isfinite(t->im->x[3 * v + i]))
      SB_SCAN_ERROR(s, "coordinate of point %lld is not a finite number; repair the file",
                    (long long)t->im->vert_number[v]);
  }
  for (int64_t i = 0; i < count[2]; i++) {
    PetscCall(on_line(t, "attribute of a point"));
    PetscCall(SbScanReal(s, "attribute of a point", 0, &attribute));
  }
  if (count[3] && SbScanMore(s, '#')) {
    PetscCall(read_mark(t, "marker of a point", &mark));
    if (mark) PetscCall(SbImportTagsAlone(t->im, 0, mark, NULL, &tags));
    if (mark) PetscCall(SbImportAddItem(t->im, 0, &v, tags, t->im->vert_number[v]));
  }
  PetscCall(SbScanEndOfLine(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_nodes(TetGen *t)
{
  int64_t count[4];

  PetscFunctionBeginUser;
  PetscCall(read_counts(t, "number of points", 4, count));
  if (count[1] != 3 && count[1] != 0)
    SB_SCAN_ERROR(&t->scan, "the points have dimension %lld; expected 3", (long long)count[1]);
  PetscCall(SbScanRoom(&t->scan, "points", count[0], 8, 8));
  PetscCall(SbScanRoom(&t->scan, "attributes", count[2], 2, 2));
  if (!count[0])
    SB_SCAN_ERROR(
      &t->scan, "0 points; when they stand in a .poly or .smesh file, let TetGen write the mesh (tetgen -p)");
  PetscCall(SbImportSetVertices(t->im, (PetscInt)count[0]));
  for (PetscInt v = 0; v < count[0]; v++) PetscCall(read_node(t, v, count));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ .ele, .face, .edge */

/* Items of one dimension: number, points, mark. A mark of 0 is one only for tets. */
static PetscErrorCode read_items(TetGen *t, int dim, int64_t n, PetscBool marks)
{
  static const char *const what[4] = {"", "marker of an edge", "marker of a face",
                                      "attribute of a tetrahedron"};
  SbScan *s = &t->scan;
  PetscInt vert[4], tags;
  int64_t number, mark;

  PetscFunctionBeginUser;
  for (int64_t i = 0; i < n; i++) {
    int64_t point;

    SbScanNext(s, '#');
    PetscCall(SbScanText(s, "number of an item", &number));
    // corners of the item
    for (int k = 0; k < dim + 1; k++) {
      PetscCall(on_line(t, "number of a point"));
      PetscCall(SbScanText(&t->scan, "number of a point", &point));
      if (point < t->first || point - t->first >= t->im->nvert)
        SB_SCAN_ERROR(&t->scan, "point %lld is not in the .node file, which holds %lld to %lld",
                      (long long)point, (long long)t->first, (long long)(t->first + t->im->nvert - 1));
      vert[k] = (PetscInt)(point - t->first);
    }
    mark = tags = 0;
    if (marks) PetscCall(read_mark(t, what[dim], &mark));
    if (marks && (mark || dim == 3)) PetscCall(SbImportTagsAlone(t->im, dim, mark, NULL, &tags));
    if (tags || dim == 3 || (dim == 2 && t->im->surface))
      PetscCall(SbImportAddItem(t->im, dim, vert, tags, number));
    PetscCall(SbScanEndOfLine(s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_tets(TetGen *t)
{
  int64_t count[3];

  PetscFunctionBeginUser;
  PetscCall(read_counts(t, "number of tetrahedra", 3, count));
  if (count[1] == 0) count[1] = 4;
  PetscCall(SbScanRoom(&t->scan, "tetrahedra", count[0], 10, 10));
  if (count[1] != 4 && count[1] != 10)
    SB_SCAN_ERROR(&t->scan, "elements of %lld points; expected 4", (long long)count[1]);
  t->count[count[1] == 4 ? SB_GMSH_TET : 11] = count[0]; /* 11: of 10 nodes */
  PetscCall(SbGmshCheckTypes(t->im, t->count));
  PetscCall(read_items(t, 3, count[0], (PetscBool)(count[2] > 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_faces(TetGen *t)
{
  int64_t count[2];

  PetscFunctionBeginUser;
  PetscCall(read_counts(t, "number of faces", 2, count));
  PetscCall(SbScanRoom(&t->scan, "faces", count[0], 8, 8));
  PetscCall(read_items(t, 2, count[0], (PetscBool)(count[1] > 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_edges(TetGen *t)
{
  int64_t count[2];

  PetscFunctionBeginUser;
  PetscCall(read_counts(t, "number of edges", 2, count));
  PetscCall(SbScanRoom(&t->scan, "edges", count[0], 6, 6));
  PetscCall(read_items(t, 1, count[0], (PetscBool)(count[1] > 0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ all files */

PetscErrorCode SbImportRead_TetGen(const char *path, SbImport *im)
{
  static PetscErrorCode (*const read[])(TetGen *) = {read_nodes, read_tets, read_faces, read_edges};
  char stem[PETSC_MAX_PATH_LEN];
  TetGen t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&t, sizeof(t)));
  t.im = im;
  stem_of(path, sizeof(stem), stem);
  for (int i = 0; i < 4; i++) {
    PetscErrorCode ierr;

    if (i > 1 && !part_exists(stem, endings[i])) continue; /* faces and edges need not be there */
    ierr = open_part(&t, path, stem, endings[i]);
    if (!ierr) ierr = read[i](&t);
    PetscCall(SbScanClose(&t.scan));
    PetscCall(ierr);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
