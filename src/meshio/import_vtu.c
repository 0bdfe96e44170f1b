/*
  import_vtu.c - reader of VTK's XML files of unstructured grids, .vtu, and of the files that list
  several of them, .pvtu (VTK User's Guide, "XML file formats").

  Arrays are in DataArray elements as text or base64, or after the mark _ of AppendedData as raw
  bytes or base64. A binary array begins with its length or, if compressed by zlib, with the number
  and sizes of its blocks. Base64 may continue after a final =: some writers encode lengths and data
  separately.

  Kept: tets, triangles, lines and points; cell arrays of integers become groups, see vtk_grid.c.
  Several pieces, in one file or listed, are one grid, cut by the program that wrote it: points of
  different pieces are one where they have the same global number (PointData GlobalIds,
  GlobalNodeId, GlobalPointIds), or, where not all pieces have such numbers, the same position to
  the last bit; points of one piece stay apart. Arrays are kept that all pieces have. Errors: other
  compressors, volume cells other than 4- and 10-node tets.
*/
#include <ctype.h>
#include <stdlib.h>
#include <zlib.h>
#include "meshio_impl.h"
#include "sbgeometry.h"

enum {
  ZLIB_RATIO = 1032
}; /* largest compression ratio of zlib */

/* A tag, from its < to behind its >. */
typedef struct {
  const char *open, *close;
} Tag;

/* A piece: its points, of which each may have a number, and its cells. */
typedef struct {
  SbVtkGrid grid;
  int64_t npoint;
  double *x;      /* [npoint][3] */
  double *global; /* [npoint], or NULL */
  double *wanted; /* [ncell][1 or 3] the array that SbImportWants(), or NULL */
} Piece;

typedef struct {
  SbScan *scan;
  SbImport *im;
  Piece all;         /* the pieces so far */
  SbCount npiece;    /* pieces with points or cells */
  int64_t *start;    /* [npiece] first point of each */
  int64_t ndeclared; /* pieces, empty ones too */
  PetscBool big_endian, zlib;
  int header;              /* bytes of a length field: 4 or 8 */
  const char *xml_end;     /* end of the XML part */
  Tag piece;               /* the piece that is read, from its < to that of the next one */
  const char *appended;    /* first byte after the mark _, or NULL */
  PetscBool appended_text; /* the appended data is base64 */
  const char *cells_at;    /* position of the cells, for messages */
  unsigned char *raw;      /* decoded bytes of the last array */
} Vtu;

/* Finds the next element of this name between `from` and `end`; false if there is none. */
static PetscBool find_element(const char *from, const char *end, const char *name, Tag *tag)
{
  const size_t n = strlen(name);

  for (const char *p = from; p && p < end; p++) {
    p = (const char *)memchr(p, '<', (size_t)(end - p));
    if (!p || (size_t)(end - p) < n + 2)
      return PETSC_FALSE;
    if (strncmp(p + 1, name, n) || !strchr(" \t\r\n/>", p[n + 1]) || !p[n + 1])
      continue;
    tag->open = p;
    tag->close = (const char *)memchr(p, '>', (size_t)(end - p));
    if (tag->close)
      tag->close++;
    return (PetscBool)(tag->close != NULL);
  }
  return PETSC_FALSE;
}

/* Value of an attribute, "" if absent. */
static void attribute(Tag tag, const char *name, size_t size, char value[])
{
  const size_t n = strlen(name);

  value[0] = 0;
  for (const char *p = tag.open; p + n + 2 < tag.close; p++) {
    const char *q = p + 1 + n;
    const char *quote;
    size_t length = 0;

    if (!isspace((unsigned char)*p) || strncmp(p + 1, name, n))
      continue;
    while (q < tag.close && isspace((unsigned char)*q))
      q++;
    if (q >= tag.close || *q++ != '=')
      continue;
    while (q < tag.close && isspace((unsigned char)*q))
      q++;
    if (q >= tag.close || (*q != '"' && *q != '\''))
      continue;
    for (quote = q++; q < tag.close && *q != *quote && length + 1 < size; q++)
      value[length++] = *q;
    value[length] = 0;
    SbCleanName(value, '?');
    return;
  }
}

/* Integer value of an attribute. */
static PetscErrorCode attribute_number(Vtu *v, Tag tag, const char *name, int64_t *n)
{
  char value[32], *end;

  PetscFunctionBeginUser;
  attribute(tag, name, sizeof(value), value);
  *n = strtoll(value, &end, 10);
  v->scan->token = tag.open;
  if (!value[0] || *end || *n < 0)
    SB_SCAN_ERROR(v->scan, "expected a number %s=\"...\", found '%s'", name, value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Decoder of raw or base64 bytes. */
typedef struct {
  const char *at, *end;
  PetscBool text, fill; /* fill: the last digit of a group of four was = */
  uint32_t bits;
  int nbit, ndigit; /* bits not taken yet; digits of the group */
} Bytes;

/* Takes n bytes; false if there are fewer, or where it is no base64. */
static PetscBool take_bytes(Bytes *b, size_t n, unsigned char out[])
{
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

  if (!b->text && (size_t)(b->end - b->at) < n)
    return PETSC_FALSE;
  for (size_t i = 0; i < n; i++) {
    for (; b->text && b->nbit < 8; b->at++) {
      const char *digit;

      while (b->at < b->end && isspace((unsigned char)*b->at))
        b->at++;
      if (b->at >= b->end)
        return PETSC_FALSE;
      digit = *b->at ? strchr(digits, *b->at) : NULL;
      if (digit ? b->fill : *b->at != '=' || b->ndigit < 2)
        return PETSC_FALSE;
      b->bits = b->bits << 6 | (digit ? (uint32_t)(digit - digits) : 0);
      b->nbit = digit ? b->nbit + 6 : 0;
      b->ndigit = (b->ndigit + 1) % 4;
      b->fill = (PetscBool)(!digit && b->ndigit);
    }
    if (b->text)
      b->nbit -= 8;
    out[i] = (unsigned char)(b->text ? b->bits >> b->nbit : (uint32_t)*b->at++);
  }
  return PETSC_TRUE;
}

/* Takes a length field of 4 or 8 bytes. */
static PetscErrorCode take_length(Vtu *v, Bytes *b, const char *name, size_t *length)
{
  unsigned char raw[8];
  double value;

  PetscFunctionBeginUser;
  if (!take_bytes(b, (size_t)v->header, raw))
    SB_SCAN_ERROR(v->scan, "the data of array '%s' is truncated, or no base64", name);
  SbNumbersConvert((SbNumberType){'u', v->header}, v->big_endian, 1, raw, &value);
  if (value > 0x1p40)
    SB_SCAN_ERROR(v->scan, "array '%s' announces %.0f bytes or blocks; it is damaged", name, value);
  *length = (size_t)value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Decompresses an array: number and size of blocks, size of a smaller last one, compressed sizes;
   blocks. */
static PetscErrorCode take_blocks(Vtu *v, Bytes *b, const char *name, size_t want,
                                  unsigned char out[])
{
  size_t nblock, size, last, full;
  size_t *packed = NULL;
  size_t at = 0;
  unsigned char *in = NULL;
  PetscBool small;

  PetscFunctionBeginUser;
  PetscCall(take_length(v, b, name, &nblock));
  PetscCall(take_length(v, b, name, &size));
  PetscCall(take_length(v, b, name, &last));
  full = nblock - (nblock && last);

  // bounds first, so that the sum cannot overflow
  small = (PetscBool)(nblock <= (size_t)(b->end - b->at) && last <= want);
  if (size && full > want / size)
    small = PETSC_FALSE;
  if (!small || full * size + (nblock ? last : 0) != want)
    SB_SCAN_ERROR(
      v->scan, "array '%s' has %zu blocks of %zu bytes, the last of %zu; expected %zu bytes in all",
      name, nblock, size, last, want);
  PetscCall(SbImportScratch(v->im, nblock * sizeof(*packed), &packed));
  for (size_t i = 0; i < nblock; i++)
    PetscCall(take_length(v, b, name, &packed[i]));
  for (size_t i = 0; i < nblock; i++) {
    const size_t n = i + 1 == nblock && last ? last : size;
    uLongf got = (uLongf)n;

    if (packed[i] > (size_t)(b->end - b->at) + 3)
      SB_SCAN_ERROR(v->scan,
                    "a block of array '%s' announces %zu bytes, which the file does not hold", name,
                    packed[i]);
    PetscCall(SbImportScratch(v->im, packed[i], &in));
    if (!take_bytes(b, packed[i], in))
      SB_SCAN_ERROR(v->scan, "the data of array '%s' is truncated, or no base64", name);
    if (uncompress(out + at, &got, in, (uLong)packed[i]) != Z_OK || got != n)
      SB_SCAN_ERROR(v->scan, "a compressed block of array '%s' is damaged", name);
    at += n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the n numbers of the array of this element; *value is allocated. */
static PetscErrorCode read_array(Vtu *v, Tag tag, int64_t n, double **value)
{
  SbScan *s = v->scan;
  SbScan part;
  SbNumberType type;
  Bytes b = {.at = tag.close, .end = s->end, .text = PETSC_TRUE};
  static const char *const kinds[] = {"Int", "UInt", "Float"};
  static const char letters[] = "iuf";
  char format[16], name[64], kind[32];
  PetscBool text, sized;
  size_t want, length;
  int64_t offset, room;

  PetscFunctionBeginUser;
  s->token = tag.open;
  attribute(tag, "type", sizeof(kind), kind);
  type.kind = 0;
  for (int i = 0; i < 3; i++)
    if (!strncmp(kind, kinds[i], strlen(kinds[i])))
      type.kind = letters[i];
  type.size = atoi(kind + strcspn(kind, "0123456789")) / 8;
  sized = (PetscBool)(type.size == 4 || type.size == 8);
  if (type.kind != 'f' && (type.size == 1 || type.size == 2))
    sized = PETSC_TRUE;
  if (!type.kind || !sized)
    SB_SCAN_ERROR(s, "an array of type '%s'; expected one as Float64 or Int32", kind);
  attribute(tag, "format", sizeof(format), format);
  attribute(tag, "Name", sizeof(name), name);

  // where the numbers are: in the element, or in the appended data; how many there can be
  if (!strcmp(format, "appended")) {
    PetscCall(attribute_number(v, tag, "offset", &offset));
    if (!v->appended || offset > s->end - v->appended)
      SB_SCAN_ERROR(s, "the array lies at %lld of the appended data, which the file does not hold",
                    (long long)offset);
    b.at = v->appended + offset;
    b.text = v->appended_text;
  } else if (!format[0] || !strcmp(format, "ascii") || !strcmp(format, "binary")) {
    b.end = (const char *)memchr(tag.close, '<', (size_t)(s->end - tag.close));
    if (!b.end)
      SB_SCAN_ERROR(s, "the array has no end; the file is truncated, write or copy it again");
  } else
    SB_SCAN_ERROR(s, "an array of format '%s'; expected ascii, binary or appended", format);
  text = (PetscBool)(!format[0] || !strcmp(format, "ascii"));
  if (text)
    room = (b.end - b.at) / 2 + 1;
  else
    room = (b.end - b.at) / type.size * (v->zlib ? ZLIB_RATIO : 1);
  if (n > room)
    SB_SCAN_ERROR(
      s, "array '%s' should hold %lld numbers, which is more than the file can contain there", name,
      (long long)n);
  PetscCall(SbImportScratch(v->im, (size_t)n * sizeof(**value), value));

  // text: numbers separated by blanks
  if (text) {
    part = *s;
    part.at = b.at;
    part.end = b.end;
    part.bytes = PETSC_FALSE;
    for (int64_t i = 0; i < n; i++)
      PetscCall(SbScanReal(&part, "value of an array", 0, &(*value)[i]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // n binary numbers of this type
  want = (size_t)n * (size_t)type.size;
  PetscCall(SbImportScratch(v->im, want, &v->raw));
  if (v->zlib)
    PetscCall(take_blocks(v, &b, name, want, v->raw));
  else {
    PetscCall(take_length(v, &b, name, &length));
    if (length != want || !take_bytes(&b, want, v->raw))
      SB_SCAN_ERROR(s, "array '%s' has %zu bytes; expected %zu, or it is truncated, or no base64",
                    name, length, want);
  }
  SbNumbersConvert(type, v->big_endian, (size_t)n, v->raw, *value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Content of an element, from after its > to the < of its end tag. */
static PetscErrorCode content(Vtu *v, const char *name, const char **from, const char **end)
{
  Tag begin, after;
  char closing[32];

  PetscFunctionBeginUser;
  (void)snprintf(closing, sizeof(closing), "/%s", name);
  v->scan->token = v->piece.open;
  if (!find_element(v->piece.open, v->piece.close, name, &begin) ||
      !find_element(begin.close, v->piece.close, closing, &after))
    SB_SCAN_ERROR(
      v->scan, "there is no element %s, or it has no end; the file is truncated or damaged", name);
  *from = begin.close;
  *end = after.open;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the array of this name in the element Cells. */
static PetscErrorCode read_cell_array(Vtu *v, const char *name, int64_t n, double **value)
{
  const char *from, *end;
  Tag tag;
  char found[64];

  PetscFunctionBeginUser;
  PetscCall(content(v, "Cells", &from, &end));
  v->cells_at = v->scan->token = from;
  for (; find_element(from, end, "DataArray", &tag); from = tag.close) {
    attribute(tag, "Name", sizeof(found), found);
    if (strcmp(found, name))
      continue;
    PetscCall(read_array(v, tag, n, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SB_SCAN_ERROR(v->scan, "the element Cells has no array '%s'", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends n numbers, + base, to an array of `have` ones; NULL when it is not there, in one of
   both. */
static PetscErrorCode append(Vtu *v, int64_t have, int64_t n, const double from[], double base,
                             double **to)
{
  PetscFunctionBeginUser;
  PetscCall(SbImportScratch(v->im, (size_t)(have + n) * sizeof(**to), to));
  for (int64_t i = 0; i < n; i++)
    (*to)[have + i] = from[i] + base;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The array that goes on as the one of this name in the grid; -1: there is none. */
static int find_array(const SbVtkGrid *grid, const char *name)
{
  for (int a = 0; a < grid->narray; a++)
    if (!strcmp(grid->array[a].name, name))
      return a;
  return -1;
}

/* Numbers of the points of the piece that no other point of the whole grid has, if it says so. */
static PetscErrorCode read_global(Vtu *v, Piece *one)
{
  static const char *const names[] = {"GlobalNodeId", "GlobalPointIds", "GlobalIds"};
  char wanted[64], found[64];
  Tag tag;
  const char *from, *end;

  PetscFunctionBeginUser;
  if (!find_element(v->piece.open, v->piece.close, "PointData", &tag) || tag.close[-2] == '/')
    PetscFunctionReturn(PETSC_SUCCESS);
  attribute(tag, "GlobalIds", sizeof(wanted), wanted);
  PetscCall(content(v, "PointData", &from, &end));
  for (; find_element(from, end, "DataArray", &tag) && !one->global; from = tag.close) {
    PetscBool take;

    attribute(tag, "Name", sizeof(found), found);
    take = (PetscBool)(found[0] && !strcmp(found, wanted));
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(names) && !wanted[0]; k++)
      take = (PetscBool)(take || !strcmp(found, names[k]));
    if (!take)
      continue;
    PetscCall(read_array(v, tag, one->npoint, &one->global));
    for (int64_t i = 0; i < one->npoint; i++) {
      v->scan->token = tag.open;
      if (!(fabs(one->global[i]) < 1e15) || one->global[i] != PetscFloorReal(one->global[i]))
        SB_SCAN_ERROR(v->scan, "the array '%s' of the points has %g, which is no number of a point",
                      found, one->global[i]);
      one->global[i] += 0.; // no -0
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the piece v->piece; an empty one is not looked at. */
static PetscErrorCode read_piece(Vtu *v, Piece *one)
{
  SbScan *s = v->scan;
  SbVtkGrid *grid = &one->grid;
  const Tag piece = v->piece;
  Tag tag;
  const char *from, *end;
  int64_t ncell;
  int64_t ncomponent = 3;
  double last;
  char value[64], found[64];

  PetscFunctionBeginUser;
  PetscCall(attribute_number(v, piece, "NumberOfPoints", &one->npoint));
  PetscCall(attribute_number(v, piece, "NumberOfCells", &ncell));
  if (one->npoint > PETSC_MAX_INT / 8 || ncell > PETSC_MAX_INT / 8)
    SB_SCAN_ERROR(s, "%lld points and %lld cells are more than this build can number",
                  (long long)one->npoint, (long long)ncell);
  if (!one->npoint && !ncell)
    PetscFunctionReturn(PETSC_SUCCESS);

  // the only array of the element Points
  PetscCall(content(v, "Points", &from, &end));
  s->token = from;
  if (!find_element(from, end, "DataArray", &tag))
    SB_SCAN_ERROR(s, "the element Points has no array");
  PetscCall(attribute_number(v, tag, "NumberOfComponents", &ncomponent));
  if (ncomponent != 3)
    SB_SCAN_ERROR(s, "points of %lld coordinates; expected 3", (long long)ncomponent);
  PetscCall(read_array(v, tag, 3 * one->npoint, &one->x));
  PetscCall(read_global(v, one));

  // cell types, end offsets of cells, then the connectivity
  grid->ncell = (PetscInt)ncell;
  PetscCall(read_cell_array(v, "offsets", ncell, &grid->end));
  PetscCall(read_cell_array(v, "types", ncell, &grid->type));
  last = ncell ? grid->end[ncell - 1] : 0;
  s->token = v->cells_at;
  if (!(last >= 0 && last < 1e12) || last != PetscFloorReal(last))
    SB_SCAN_ERROR(s, "the last of the offsets is %g; expected the number of points of all cells",
                  last);
  grid->nconnect = (int64_t)last;
  PetscCall(read_cell_array(v, "connectivity", grid->nconnect, &grid->connect));

  // cell data with one number per cell; other arrays are skipped
  if (find_element(piece.open, piece.close, "CellData", &tag) && tag.close[-2] != '/') {
    PetscCall(content(v, "CellData", &from, &end));
    for (; find_element(from, end, "DataArray", &tag); from = tag.close) {
      const int a = grid->narray;

      attribute(tag, "NumberOfComponents", sizeof(value), value);
      attribute(tag, "Name", sizeof(found), found);
      if (SbImportWants(v->im, found, value[0] ? atoi(value) : 1))
        PetscCall(read_array(v, tag, v->im->field_width * ncell, &one->wanted));
      if ((value[0] && strcmp(value, "1") != 0) || !strcmp(found, "GlobalCellIds") ||
          !strcmp(found, "GlobalElementId"))
        continue;
      attribute(tag, "type", sizeof(value), value);
      if (!strcmp(value, "String") || !strcmp(value, "Bit"))
        PetscCall(SbImportSkip(v->im, "array %.32s of type %.8s", found, value));
      else if (SbVtkIsGhost(found)) {
        PetscCall(read_array(v, tag, ncell, &grid->ghost));
        SbVtkGhostMarks(found, grid->ncell, grid->ghost);
      } else if (a < SB_VTK_ARRAYS) {
        grid->narray++;
        attribute(tag, "Name", sizeof(grid->array[a].name), grid->array[a].name);
        PetscCall(read_array(v, tag, ncell, &grid->array[a].value));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Appends a piece to those before: indices go on behind their points, arrays only where all have
   them. */
static PetscErrorCode append_piece(Vtu *v, Piece *one)
{
  Piece *all = &v->all;
  SbVtkGrid *grid = &all->grid;
  const SbVtkGrid *its = &one->grid;
  const double shift = (double)all->npoint;

  PetscFunctionBeginUser;
  PetscCall(SbImportGrow(v->im, &v->npiece, sizeof(*v->start), &v->start));
  v->start[v->npiece.n - 1] = all->npoint;
  if (v->npiece.n == 1) {
    *all = *one;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (all->npoint + one->npoint > PETSC_MAX_INT / 8 || grid->ncell + its->ncell > PETSC_MAX_INT / 8)
    SB_SCAN_ERROR(v->scan, "%lld points are more than this build can number",
                  (long long)(all->npoint + one->npoint));
  for (int64_t i = 0; i < its->nconnect; i++)
    if (!(its->connect[i] >= 0 && its->connect[i] < (double)one->npoint))
      SB_SCAN_ERROR(v->scan, "a cell uses point %g; the points of the piece are 0 to %lld",
                    its->connect[i], (long long)one->npoint - 1);
  PetscCall(append(v, 3 * all->npoint, 3 * one->npoint, one->x, 0., &all->x));
  PetscCall(append(v, grid->nconnect, its->nconnect, its->connect, shift, &grid->connect));
  PetscCall(append(v, grid->ncell, its->ncell, its->end, (double)grid->nconnect, &grid->end));
  PetscCall(append(v, grid->ncell, its->ncell, its->type, 0., &grid->type));

  // numbers of points, and marks of ghost cells, which a piece without them does not have
  if (one->global && all->global)
    PetscCall(append(v, all->npoint, one->npoint, one->global, 0., &all->global));
  else
    all->global = NULL;
  if (one->wanted && all->wanted)
    PetscCall(append(v, v->im->field_width * (int64_t)grid->ncell,
                     v->im->field_width * (int64_t)its->ncell, one->wanted, 0., &all->wanted));
  else
    all->wanted = NULL;
  if (one->grid.ghost || grid->ghost) {
    double *none = NULL;

    PetscCall(
      SbImportScratch(v->im, (size_t)PetscMax(grid->ncell, its->ncell) * sizeof(*none), &none));
    for (PetscInt c = 0; c < PetscMax(grid->ncell, its->ncell); c++)
      none[c] = 0;
    if (!grid->ghost)
      PetscCall(append(v, 0, grid->ncell, none, 0., &grid->ghost));
    PetscCall(append(v, grid->ncell, its->ncell, its->ghost ? its->ghost : none, 0., &grid->ghost));
  }
  for (int a = 0; a < grid->narray; a++) {
    const int from = find_array(its, grid->array[a].name);

    if (from >= 0)
      PetscCall(
        append(v, grid->ncell, its->ncell, its->array[from].value, 0., &grid->array[a].value));
    else {
      PetscCall(SbImportSkip(v->im, "array %.32s, which not all pieces have", grid->array[a].name));
      grid->array[a--] = grid->array[--grid->narray];
    }
  }
  all->npoint += one->npoint;
  grid->ncell += its->ncell;
  grid->nconnect += its->nconnect;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A point and what it must have in common with another one, to be the same. */
typedef struct {
  double key[3];
  PetscInt index, piece;
} Point;

static int compare_keys(const Point *p, const Point *q)
{
  for (int k = 0; k < 3; k++)
    if (p->key[k] != q->key[k])
      return p->key[k] < q->key[k] ? -1 : 1;
  return 0;
}

static int compare_points(const void *a, const void *b)
{
  const Point *p = (const Point *)a;
  const Point *q = (const Point *)b;
  const int order = compare_keys(p, q);

  return order ? order : (p->index > q->index) - (p->index < q->index);
}

/* Whether points first..last, of one key, are the same; `size`: of the grid. */
static PetscErrorCode check_same(Vtu *v, const Point *first, const Point *last, double size,
                                 PetscBool *same)
{
  SbScan *s = v->scan;
  const double *x = v->all.x;
  const double *at = x + 3 * first->index;

  PetscFunctionBeginUser;
  *same = (PetscBool)(first->piece != last->piece);
  for (const Point *p = first + 1; p <= last; p++) {
    if (p->piece == p[-1].piece && v->all.global)
      SB_SCAN_ERROR(s,
                    "piece %lld has two points of the global number %.0f; save the grid without "
                    "these numbers, or as one piece",
                    (long long)p->piece + 1, p->key[0]);
    if (p->piece == p[-1].piece && *same)
      SB_SCAN_ERROR(s,
                    "piece %lld has two points at (%g, %g, %g), where a point of piece %lld is, "
                    "too: which of them is the same is not known; save the grid with GlobalNodeId, "
                    "or as one piece",
                    (long long)p->piece + 1, at[0], at[1], at[2],
                    (long long)(p->piece == first->piece ? last : first)->piece + 1);
    for (int k = 0; k < 3; k++)
      if (!(fabs(x[3 * p->index + k] - at[k]) <= 1e-6 * size))
        SB_SCAN_ERROR(s,
                      "the point of global number %.0f is at (%g, %g, %g) in piece %lld, and at "
                      "(%g, %g, %g) in piece %lld",
                      p->key[0], at[0], at[1], at[2], (long long)first->piece + 1, x[3 * p->index],
                      x[3 * p->index + 1], x[3 * p->index + 2], (long long)p->piece + 1);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points that are in several pieces become one, and `connect` follows them. */
static PetscErrorCode join_points(Vtu *v, PetscInt *njoined)
{
  Piece *all = &v->all;
  const PetscInt n = (PetscInt)all->npoint;
  Point *point = NULL;
  PetscInt *at = NULL;
  PetscInt piece = 0;
  PetscInt kept = 0;
  double size = 0;

  PetscFunctionBeginUser;
  PetscCall(SbImportScratch(v->im, (size_t)n * sizeof(*point), &point));
  PetscCall(SbImportScratch(v->im, (size_t)n * sizeof(*at), &at));
  for (PetscInt i = 0; i < n; i++) {
    while (piece + 1 < v->npiece.n && i >= v->start[piece + 1])
      piece++;
    point[i] = (Point){.index = i, .piece = piece};
    for (int k = 0; k < 3; k++) {
      const double x = all->x[3 * i + k];

      if (!isfinite(x))
        SB_SCAN_ERROR(v->scan,
                      "coordinate of point %lld of piece %lld is not a finite number; repair the "
                      "file",
                      (long long)(i - v->start[piece]), (long long)piece + 1);
      point[i].key[k] = all->global ? 0 : x + 0.; // no -0
      size = PetscMax(size, fabs(x - all->x[k]));
    }
    if (all->global)
      point[i].key[0] = all->global[i];
    at[i] = i;
  }
  qsort(point, (size_t)n, sizeof(*point), compare_points);
  for (PetscInt i = 0, j; i < n; i = j + 1) {
    PetscBool same;

    for (j = i; j + 1 < n && !compare_keys(&point[j + 1], &point[i]); j++)
      continue;
    PetscCall(check_same(v, &point[i], &point[j], size, &same));
    for (PetscInt k = i; same && k <= j; k++)
      at[point[k].index] = point[i].index;
  }

  // the first of those that are the same is kept
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt same = at[i];

    at[i] = same == i ? kept++ : at[same];
    for (int k = 0; k < 3 && same == i; k++)
      all->x[3 * at[i] + k] = all->x[3 * i + k];
  }
  for (int64_t i = 0; i < all->grid.nconnect; i++) {
    const double p = all->grid.connect[i];

    if (p >= 0 && p < (double)n && p == PetscFloorReal(p))
      all->grid.connect[i] = (double)at[(PetscInt)p];
  }
  *njoined = n - kept;
  all->npoint = kept;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the parts of the file v->scan, its type, byte order and compression. */
static PetscErrorCode begin_file(Vtu *v, size_t size, char type[])
{
  SbScan *s = v->scan;
  Tag tag;
  char value[64];

  PetscFunctionBeginUser;

  // end of the XML part, beginning of the appended data
  v->xml_end = s->end;
  v->appended = NULL;
  if (find_element(s->data, s->end, "AppendedData", &tag)) {
    v->xml_end = s->token = tag.open;
    attribute(tag, "encoding", sizeof(value), value);
    v->appended_text = (PetscBool)!strcmp(value, "base64");
    s->bytes = (PetscBool)!v->appended_text;
    v->appended = (const char *)memchr(tag.close, '_', (size_t)(s->end - tag.close));
    if (!v->appended)
      SB_SCAN_ERROR(s, "the appended data has no mark _ at its beginning");
    v->appended++;
  }
  if (!find_element(s->data, v->xml_end, "VTKFile", &tag))
    SB_SCAN_ERROR(s, "expected an element VTKFile; this is no XML file of VTK");
  s->token = tag.open;
  attribute(tag, "type", size, type);
  attribute(tag, "byte_order", sizeof(value), value);
  v->big_endian = (PetscBool)!strcmp(value, "BigEndian");
  attribute(tag, "header_type", sizeof(value), value);
  v->header = !strcmp(value, "UInt64") ? 8 : 4;
  attribute(tag, "compressor", sizeof(value), value);
  v->zlib = (PetscBool)(value[0] != 0);
  if (v->zlib && strcmp(value, "vtkZLibDataCompressor") != 0)
    SB_SCAN_ERROR(
      s,
      "compressed by %s; supple knows vtkZLibDataCompressor and uncompressed files (ParaView: "
      "Save Data, Compressor Type)",
      value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads all pieces of the file v->scan. */
static PetscErrorCode read_pieces(Vtu *v)
{
  SbScan *s = v->scan;
  PetscBool more;
  Tag tag, next;
  char type[64];

  PetscFunctionBeginUser;
  PetscCall(begin_file(v, sizeof(type), type));
  if (strcmp(type, "UnstructuredGrid") != 0)
    SB_SCAN_ERROR(s, "a file of type '%s'; expected UnstructuredGrid with tetrahedra", type);
  if (!find_element(s->data, v->xml_end, "Piece", &tag))
    SB_SCAN_ERROR(s, "there is no element Piece; the file is truncated or damaged");
  do {
    Piece one = {.npoint = 0};

    more = find_element(tag.close, v->xml_end, "Piece", &next);
    v->piece = (Tag){tag.open, more ? next.open : v->xml_end};
    s->token = tag.close;
    PetscCall(read_piece(v, &one));
    v->ndeclared++;
    if (one.npoint || one.grid.ncell)
      PetscCall(append_piece(v, &one));
    tag = next;
  } while (more);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the files that a .pvtu, the file v->scan, lists. */
static PetscErrorCode read_listed(Vtu *v, const char *path)
{
  SbScan *s = v->scan;
  SbImport *im = v->im;
  const char *from = s->data;
  char *folder;
  Tag tag;

  PetscFunctionBeginUser;
  PetscCall(SbImportFolder(im, path, &folder));
  for (; find_element(from, s->end, "Piece", &tag); from = tag.close) {
    char source[PETSC_MAX_PATH_LEN];
    char *file = NULL;
    char *where = NULL;
    SbScan other;
    PetscErrorCode ierr;
    size_t room;

    s->token = tag.open;
    attribute(tag, "Source", sizeof(source), source);
    if (!source[0])
      SB_SCAN_ERROR(s, "a Piece without Source=\"...\", the name of its file");
    PetscCall(SbImportBeside(im, folder, source, &file));
    room = sizeof(im->where) + strlen(file) + 4;
    PetscCall(SbImportScratch(im, room, &where));
    (void)snprintf(where, room, "%s: %s", im->where, file);
    ierr = SbScanOpen(where, file, &other);
    v->scan = &other;
    if (!ierr)
      ierr = read_pieces(v);
    v->scan = s;
    PetscCall(PetscFree(other.data));
    PetscCall(ierr);
  }
  s->token = s->data;
  if (!v->ndeclared)
    SB_SCAN_ERROR(s, "there is no element Piece; the file is truncated or damaged");
  v->cells_at = s->data;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_VTU(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  Vtu vtu = {.scan = s, .im = im};
  Vtu *v = &vtu;
  PetscInt njoined = 0;
  char type[64];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  PetscCall(begin_file(v, sizeof(type), type));
  if (!strcmp(type, "PUnstructuredGrid"))
    PetscCall(read_listed(v, path));
  else
    PetscCall(read_pieces(v));
  if (!v->npiece.n)
    SB_SCAN_ERROR(s, "all pieces are empty; write the mesh again");
  if (v->npiece.n > 1) {
    s->token = s->data;
    PetscCall(join_points(v, &njoined));
  }
  if (v->ndeclared > 1) {
    char empty[64] = "";

    if (v->ndeclared > v->npiece.n)
      (void)snprintf(empty, sizeof(empty), " (%lld empty)", (long long)v->ndeclared - v->npiece.n);
    SbImportRemark(im, "%lld pieces%s, %lld points of several pieces joined%s",
                   (long long)v->ndeclared, empty, (long long)njoined,
                   v->all.global ? " by their global numbers" : " where their positions are equal");
  }
  if (v->all.wanted)
    PetscCall(SbImportKeep(im, v->all.grid.ncell, NULL, 0, v->all.wanted));
  PetscCall(SbVtkSetPoints((PetscInt)v->all.npoint, v->all.x, im));
  s->token = v->cells_at;
  PetscCall(SbVtkGridFill(&v->all.grid, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
