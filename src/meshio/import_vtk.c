/*
  import_vtk.c - reader of VTK's legacy files of unstructured grids, text or binary (VTK User's
  Guide, "File formats"; "VTK 5.1 legacy format"): cells with their counts, or as OFFSETS and
  CONNECTIVITY.

  Kept: tets, triangles, lines and points; cell arrays of integers become groups, see vtk_grid.c.
  Point data is skipped. Binary data is big-endian. Errors: other data sets, volume cells other than
  4- and 10-node tets.
*/
#include <strings.h>
#include "meshio_impl.h"

typedef struct {
  SbScan *scan;
  SbImport *im;
  SbVtkGrid grid;
  PetscBool on_cells;   /* the arrays that follow are cell data */
  int64_t ntuple;       /* number of tuples of the arrays that follow */
  const char *cells_at; /* position of the cells, for messages; NULL: not read yet */
} Vtk;

/* Reads n numbers of this type into an array that it allocates; value NULL: skips them. */
static PetscErrorCode read_array(Vtk *v, const char *what, int64_t n, SbNumberType type,
                                 double **value)
{
  SbScan *s = v->scan;
  const size_t bytes = (size_t)n * (size_t)type.size;
  const int least = s->bytes ? type.size : 2;
  PetscReal x;

  PetscFunctionBeginUser;

  // binary data begins after the end of the line
  if (s->bytes)
    SbScanEndOfLine(s);
  PetscCall(SbScanRoom(s, what, n, least, least));
  if (value)
    PetscCall(SbImportScratch(v->im, (size_t)n * sizeof(**value), value));
  for (int64_t i = 0; i < n && !s->bytes; i++) {
    PetscCall(SbScanReal(s, what, 0, &x));
    if (value)
      (*value)[i] = x;
  }
  if (!s->bytes)
    PetscFunctionReturn(PETSC_SUCCESS);
  s->token = s->at;
  if ((size_t)(s->end - s->at) < bytes)
    SB_SCAN_ERROR(s, "the file ends within the %s; it is truncated, write or copy it again", what);
  if (value)
    SbNumbersConvert(type, PETSC_TRUE, (size_t)n, s->at, *value);
  s->at += bytes;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_cells(Vtk *v)
{
  SbScan *s = v->scan;
  SbVtkGrid *grid = &v->grid;
  int64_t n, size;
  int64_t k0 = 0;
  double *all;
  SbNumberType type;
  char word[32];
  const char *at;

  PetscFunctionBeginUser;
  if (v->cells_at)
    SB_SCAN_ERROR(s, "second section CELLS");
  v->cells_at = s->token;
  PetscCall(SbScanCount(s, "cells", 1, 1, &n));
  PetscCall(SbScanCount(s, "numbers in the list of cells", 1, 1, &size));
  at = s->at;
  (void)SbScanWord(s, sizeof(word), word);
  if (!strcasecmp(word, "OFFSETS")) {
    // since version 5: `n` offsets from 0 to the number of points, then the points
    PetscCall(SbScanType(s, &type));
    PetscCall(read_array(v, "offsets", n, type, &grid->end));
    for (int64_t c = 0; c + 1 < n; c++)
      grid->end[c] = grid->end[c + 1]; /* drop the first offset, 0 */
    (void)SbScanWord(s, sizeof(word), word);
    if (strcasecmp(word, "CONNECTIVITY"))
      SB_SCAN_ERROR(s, "expected CONNECTIVITY, found '%s'", word);
    PetscCall(SbScanType(s, &type));
    PetscCall(read_array(v, "points of cells", size, type, &grid->connect));
    grid->ncell = (PetscInt)PetscMax(n - 1, 0);
    grid->nconnect = size;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  s->at = at;
  grid->ncell = (PetscInt)n;

  // before version 5: [n, p1 ... pn] for each cell; the points move together
  PetscCall(read_array(v, "list of cells", size, (SbNumberType){'i', 4}, &grid->connect));
  PetscCall(SbImportScratch(v->im, (size_t)grid->ncell * sizeof(double), &grid->end));
  all = grid->connect;
  for (PetscInt c = 0; c < grid->ncell; c++) {
    const double npoint = k0 < size ? all[k0] : 0;

    if (!(npoint >= 1 && npoint <= (double)(size - k0 - 1)) || npoint != PetscFloorReal(npoint))
      SB_SCAN_ERROR(
        s, "cell %lld of %lld has %g points, more than the section announces or less than one",
        (long long)c, (long long)grid->ncell, npoint);
    for (int64_t k = 0; k < (int64_t)npoint; k++)
      grid->connect[grid->nconnect++] = all[k0 + 1 + k];
    k0 += 1 + (int64_t)npoint;
    grid->end[c] = (double)grid->nconnect;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Skips n values of a kind that a mesh does not need: bits, or text (a line each; in binary with
   its length before it). */
static PetscErrorCode skip_values(Vtk *v, const char *kind, int64_t n)
{
  SbScan *s = v->scan;

  PetscFunctionBeginUser;
  PetscCall(SbScanRoom(s, "values of an array", n, 1, 1));
  SbScanEndOfLine(s);
  if (!strcasecmp(kind, "bit") && s->bytes) {
    if (s->end - s->at < (n + 7) / 8)
      SB_SCAN_ENDS(s, "the %s", "bits");
    s->at += (n + 7) / 8;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  for (int64_t i = 0; i < n; i++) {
    const unsigned char *p = (const unsigned char *)s->at;
    int more;
    uint64_t length;

    s->token = s->at;
    if (s->at >= s->end)
      SB_SCAN_ENDS(s, "a value of type %s", kind);
    if (!strcasecmp(kind, "bit")) {
      PetscReal bit;

      PetscCall(SbScanReal(s, "bit", 0, &bit));
      continue;
    }
    if (!s->bytes) {
      SbScanEndOfLine(s);
      continue;
    }

    // the two highest bits say in how many bytes the length stands
    more = 3 - (p[0] >> 6);
    if (more > 1)
      more = more == 3 ? 7 : 3;
    if (s->end - s->at < 1 + more)
      SB_SCAN_ENDS(s, "the %s", "length of a text");
    length = p[0] & 0x3f;
    for (int k = 1; k <= more; k++)
      length = length << 8 | p[k];
    s->at += 1 + more;
    if (length > (uint64_t)(s->end - s->at))
      SB_SCAN_ENDS(s, "the %s", "text");
    s->at += length;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the type of an array; one of bits or text is skipped, with its values, and type.size is
   0. */
static PetscErrorCode take_type(Vtk *v, const char *name, int64_t ncomponent, int64_t ntuple,
                                SbNumberType *type)
{
  static const char *const others[] = {"bit", "string", "utf8_string", "variant"};
  SbScan *s = v->scan;
  const char *at = s->at;
  char word[32];

  PetscFunctionBeginUser;
  type->size = 0;
  (void)SbScanWord(s, sizeof(word), word);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(others); i++) {
    if (strcasecmp(word, others[i]) != 0)
      continue;
    if (ncomponent < 0 || ncomponent > 1024 || ntuple < 0 || ntuple > PETSC_MAX_INT)
      SB_SCAN_ERROR(s, "array '%s' of %lld components and %lld tuples", name, (long long)ncomponent,
                    (long long)ntuple);
    PetscCall(SbImportSkip(v->im, "array %.32s of type %s", name, others[i]));
    PetscCall(skip_values(v, word, ncomponent * ntuple));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  s->at = at;
  PetscCall(SbScanType(s, type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads an array of `ncomponent` numbers per tuple; kept if it has one number per cell. */
static PetscErrorCode read_data(Vtk *v, const char *name, int64_t ncomponent, int64_t ntuple,
                                SbNumberType type)
{
  SbVtkGrid *grid = &v->grid;

  PetscFunctionBeginUser;
  if (ncomponent < 0 || ncomponent > 1024)
    SB_SCAN_ERROR(v->scan, "array '%s' of %lld components; expected up to 1024", name,
                  (long long)ncomponent);
  PetscCall(SbScanRoom(v->scan, "tuples", ntuple, 1, 1));
  if (v->on_cells && SbImportWants(v->im, name, ncomponent)) {
    double *value = NULL;

    PetscCall(read_array(v, "data of cells", ncomponent * ntuple, type, &value));
    PetscCall(SbImportKeep(v->im, (PetscInt)ntuple, NULL, 0, value));
  } else if (v->on_cells && ncomponent == 1 && ntuple == grid->ncell && SbVtkIsGhost(name)) {
    PetscCall(read_array(v, "data of cells", ntuple, type, &grid->ghost));
    SbVtkGhostMarks(name, grid->ncell, grid->ghost);
  } else if (v->on_cells && ncomponent == 1 && ntuple == grid->ncell &&
             grid->narray < SB_VTK_ARRAYS) {
    const int a = grid->narray++;

    PetscCall(PetscStrncpy(grid->array[a].name, name, sizeof(grid->array[a].name)));
    PetscCall(read_array(v, "data of cells", ntuple, type, &grid->array[a].value));
  } else
    PetscCall(read_array(v, "data", ncomponent * ntuple, type, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_section(Vtk *v, const char *section)
{
  static const struct {
    const char *name;
    int ncomponent;
  } tuples[] = {{"VECTORS", 3}, {"NORMALS", 3}, {"TENSORS", 9}, {"TENSORS6", 6}};
  SbScan *s = v->scan;
  const PetscBool on_cells = (PetscBool)!strcasecmp(section, "CELL_DATA");
  SbNumberType type;
  const PetscBool kept = v->on_cells;
  char name[SB_NAME_MAX], word[32], kind[32];
  double *x = NULL;
  int64_t n;
  int64_t ncomponent = 1;
  int64_t ntuple;
  size_t k = 0;

  PetscFunctionBeginUser;
  while (k < PETSC_STATIC_ARRAY_LENGTH(tuples) && strcasecmp(section, tuples[k].name))
    k++;
  if (!strcasecmp(section, "POINTS")) {
    if (v->im->x)
      SB_SCAN_ERROR(s, "second section POINTS");
    PetscCall(SbScanCount(s, "points", 3, 3, &n));
    PetscCall(SbScanType(s, &type));
    PetscCall(read_array(v, "coordinates", 3 * n, type, &x));
    PetscCall(SbVtkSetPoints((PetscInt)n, x, v->im));
  } else if (!strcasecmp(section, "CELLS")) {
    PetscCall(read_cells(v));
  } else if (!strcasecmp(section, "CELL_TYPES")) {
    PetscCall(SbScanText(s, "number of types of cells", &n));
    if (!v->cells_at || n != v->grid.ncell)
      SB_SCAN_ERROR(s, "%lld types of cells for %lld cells", (long long)n,
                    (long long)v->grid.ncell);
    PetscCall(read_array(v, "types of cells", n, (SbNumberType){'i', 4}, &v->grid.type));
  } else if (on_cells || !strcasecmp(section, "POINT_DATA")) {
    // cells or points to which the following arrays belong
    n = on_cells ? v->grid.ncell : v->im->nvert;
    if (!v->im->x || !v->cells_at)
      SB_SCAN_ERROR(s, "data before the sections POINTS and CELLS");
    PetscCall(SbScanText(s, "number of data", &v->ntuple));
    if (v->ntuple != n)
      SB_SCAN_ERROR(s, "data for %lld %s; there are %lld", (long long)v->ntuple,
                    on_cells ? "cells" : "points", (long long)n);
    v->on_cells = on_cells;
  } else if (!strcasecmp(section, "SCALARS")) {
    // SCALARS name type [components] / LOOKUP_TABLE name / numbers
    const char *at, *type_at, *values_at;

    (void)SbScanWord(s, sizeof(name), name);
    type_at = s->at;
    (void)SbScanWord(s, sizeof(kind), kind);
    if (SbScanMore(s, '\n'))
      PetscCall(SbScanText(s, "number of components", &ncomponent));
    at = s->at;
    (void)SbScanWord(s, sizeof(word), word);
    if (strcasecmp(word, "LOOKUP_TABLE"))
      s->at = at;
    else
      (void)SbScanWord(s, sizeof(word), word);
    values_at = s->at;
    if (!strcasecmp(kind, "bit")) {
      PetscCall(SbImportSkip(v->im, "array %.32s of type %s", name, "bit"));
      PetscCall(skip_values(v, kind, PetscMin(PetscMax(ncomponent, 0), 1024) * v->ntuple));
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    s->at = type_at;
    PetscCall(SbScanType(s, &type));
    s->at = values_at;
    PetscCall(read_data(v, name, ncomponent, v->ntuple, type));
  } else if (!strcasecmp(section, "FIELD")) {
    // FIELD name n, then n times: name components tuples type / numbers
    (void)SbScanWord(s, sizeof(word), word);
    PetscCall(SbScanCount(s, "arrays in a field", 8, 8, &n));
    for (int64_t i = 0; i < n; i++) {
      (void)SbScanWord(s, sizeof(name), name);
      if (!strcmp(name, "METADATA")) {
        do
          SbScanEndOfLine(s);
        while (SbScanMore(s, '\n'));
        (void)SbScanWord(s, sizeof(name), name);
      }
      PetscCall(SbScanText(s, "number of components", &ncomponent));
      PetscCall(SbScanText(s, "number of tuples", &ntuple));
      PetscCall(take_type(v, name, ncomponent, ntuple, &type));
      if (type.size)
        PetscCall(read_data(v, name, ncomponent, ntuple, type));
    }
  } else if (!strcasecmp(section, "COLOR_SCALARS")) {
    // numbers from 0 to 1, in binary a byte each
    (void)SbScanWord(s, sizeof(name), name);
    PetscCall(SbScanText(s, "number of components", &ncomponent));
    PetscCall(SbImportSkip(v->im, "%s %.32s", "COLOR_SCALARS", name));
    v->on_cells = PETSC_FALSE;
    PetscCall(read_data(v, name, ncomponent, v->ntuple, (SbNumberType){'u', 1}));
    v->on_cells = kept;
  } else if (!strcasecmp(section, "TEXTURE_COORDINATES")) {
    (void)SbScanWord(s, sizeof(name), name);
    PetscCall(SbScanText(s, "number of components", &ncomponent));
    PetscCall(SbScanType(s, &type));
    PetscCall(SbImportSkip(v->im, "%s %.32s", section, name));
    v->on_cells = PETSC_FALSE;
    PetscCall(read_data(v, name, ncomponent, v->ntuple, type));
    v->on_cells = kept;
  } else if (!strcasecmp(section, "GLOBAL_IDS") || !strcasecmp(section, "PEDIGREE_IDS") ||
             !strcasecmp(section, "EDGE_FLAGS")) {
    (void)SbScanWord(s, sizeof(name), name);
    PetscCall(SbImportSkip(v->im, "%s %.32s", section, name));
    v->on_cells = PETSC_FALSE;
    PetscCall(take_type(v, name, 1, v->ntuple, &type));
    if (type.size)
      PetscCall(read_data(v, name, 1, v->ntuple, type));
    v->on_cells = kept;
  } else if (!strcasecmp(section, "LOOKUP_TABLE")) {
    // 4 bytes or 4 numbers per entry
    (void)SbScanWord(s, sizeof(name), name);
    PetscCall(SbScanCount(s, "colours", 1, 1, &n));
    PetscCall(read_array(v, "colours", 4 * n, (SbNumberType){'u', 1}, NULL));
  } else if (!strcasecmp(section, "METADATA")) {
    // a block of lines up to an empty line
    do
      SbScanEndOfLine(s);
    while (SbScanMore(s, '\n'));
  } else if (k < PETSC_STATIC_ARRAY_LENGTH(tuples)) {
    (void)SbScanWord(s, sizeof(name), name);
    PetscCall(SbScanType(s, &type));
    PetscCall(read_data(v, name, tuples[k].ncomponent, v->ntuple, type));
  } else
    SB_SCAN_ERROR(s, "expected a section, as POINTS or CELLS, found '%s'", section);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_VTK(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  Vtk v = {.scan = s, .im = im};
  const char *missing = NULL;
  char name[32], word[32], kind[32];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));

  // header: text or binary, unstructured grid
  if ((size_t)(s->end - s->at) < 5 || strncasecmp(s->at, "# vtk", 5))
    SB_SCAN_ERROR(s, "expected '# vtk DataFile Version'; this is no legacy file of VTK");
  SbScanEndOfLine(s);
  SbScanEndOfLine(s); /* title */
  (void)SbScanWord(s, sizeof(kind), kind);
  if (strcasecmp(kind, "ASCII") && strcasecmp(kind, "BINARY"))
    SB_SCAN_ERROR(s, "expected ASCII or BINARY, found '%s'", kind);
  s->bytes = (PetscBool)!strcasecmp(kind, "BINARY");
  (void)SbScanWord(s, sizeof(word), word);
  if (strcasecmp(word, "DATASET"))
    SB_SCAN_ERROR(s, "expected DATASET, found '%s'", word);
  (void)SbScanWord(s, sizeof(word), word);
  if (strcasecmp(word, "UNSTRUCTURED_GRID"))
    SB_SCAN_ERROR(s, "data set %s; expected UNSTRUCTURED_GRID with tetrahedra", word);
  while (SbScanWord(s, sizeof(name), name))
    PetscCall(read_section(&v, name));
  if (!im->x)
    missing = "POINTS, with at least one,";
  else if (!v.cells_at)
    missing = "CELLS";
  else if (!v.grid.type)
    missing = "CELL_TYPES";
  if (missing)
    SB_SCAN_ERROR(s, "the file ends before the section %s; it is truncated, write or copy it again",
                  missing);
  s->token = v.cells_at;
  PetscCall(SbVtkGridFill(&v.grid, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
