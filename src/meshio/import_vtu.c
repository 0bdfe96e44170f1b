/*
  import_vtu.c - reader of VTK's XML files of unstructured grids, .vtu (VTK User's Guide, "XML file
  formats").

  Arrays are in DataArray elements as text or base64, or after the mark _ of AppendedData as raw
  bytes or base64. A binary array begins with its length or, if compressed by zlib, with the number
  and sizes of its blocks. Base64 may continue after a final =: some writers encode lengths and data
  separately.

  Kept: tets, triangles, lines and points; cell arrays of integers become groups, see vtk_grid.c.
  Several pieces are one grid, cut by the program that wrote it: points of different pieces at the
  same position are one, and arrays are kept that all pieces have. Errors: ghost cells, which are in
  two pieces; other compressors, volume cells other than 4- and 10-node tets.
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

typedef struct {
  SbScan *scan;
  SbImport *im;
  SbVtkGrid grid;
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

/* Appends n numbers to an array of `have` ones, of indices (or ends) that `base` comes before. */
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

/* Reads the piece v->piece into a grid of its own, with its points. */
static PetscErrorCode read_piece(Vtu *v, SbVtkGrid *grid, int64_t *npoint, double **x)
{
  SbScan *s = v->scan;
  const Tag piece = v->piece;
  Tag tag;
  const char *from, *end;
  int64_t ncell;
  int64_t ncomponent = 3;
  double last;
  char value[64], found[64];

  PetscFunctionBeginUser;
  PetscCall(attribute_number(v, piece, "NumberOfPoints", npoint));
  PetscCall(attribute_number(v, piece, "NumberOfCells", &ncell));
  if (*npoint > PETSC_MAX_INT / 8 || ncell > PETSC_MAX_INT / 8)
    SB_SCAN_ERROR(s, "%lld points and %lld cells are more than this build can number",
                  (long long)*npoint, (long long)ncell);

  // the only array of the element Points
  PetscCall(content(v, "Points", &from, &end));
  s->token = from;
  if (!find_element(from, end, "DataArray", &tag))
    SB_SCAN_ERROR(s, "the element Points has no array");
  PetscCall(attribute_number(v, tag, "NumberOfComponents", &ncomponent));
  if (ncomponent != 3)
    SB_SCAN_ERROR(s, "points of %lld coordinates; expected 3", (long long)ncomponent);
  PetscCall(read_array(v, tag, 3 * *npoint, x));

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
    for (; find_element(from, end, "DataArray", &tag) && grid->narray < SB_VTK_ARRAYS;
         from = tag.close) {
      const int a = grid->narray;

      attribute(tag, "NumberOfComponents", sizeof(value), value);
      attribute(tag, "Name", sizeof(found), found);
      if (!strcmp(value, "3") && SbImportWants(v->im, found)) {
        double *vector = NULL;

        PetscCall(read_array(v, tag, 3 * grid->ncell, &vector));
        PetscCall(SbImportKeep(v->im, (PetscInt)grid->ncell, NULL, 0, vector));
      }
      if (value[0] && strcmp(value, "1") != 0)
        continue;
      attribute(tag, "type", sizeof(value), value);
      if (!strcmp(value, "String") || !strcmp(value, "Bit")) {
        attribute(tag, "Name", sizeof(found), found);
        PetscCall(SbImportSkip(v->im, "array %.32s of type %.8s", found, value));
        continue;
      }
      grid->narray++;
      attribute(tag, "Name", sizeof(grid->array[a].name), grid->array[a].name);
      PetscCall(read_array(v, tag, grid->ncell, &grid->array[a].value));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Points of different pieces at the same position become one: x[n][3], and the indices in
   `connect`. */
static PetscErrorCode join_points(Vtu *v, int64_t *n, double x[])
{
  PetscInt *map, *at;
  PetscReal *y;
  PetscInt kept = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(*n, &map, *n, &at, 3 * *n, &y));
  for (int64_t i = 0; i < 3 * *n; i++)
    y[i] = x[i];
  PetscCall(SbWeld((PetscInt)*n, y, 0., PETSC_TRUE, map));
  for (PetscInt i = 0; i < *n; i++) {
    if (map[i] == i) {
      for (int k = 0; k < 3; k++)
        x[3 * kept + k] = x[3 * i + k];
      at[i] = kept++;
    } else
      at[i] = at[map[i]];
  }
  for (int64_t i = 0; i < v->grid.nconnect; i++) {
    const double point = v->grid.connect[i];

    if (point >= 0 && point < (double)*n && point == PetscFloorReal(point))
      v->grid.connect[i] = (double)at[(PetscInt)point];
  }
  *n = kept;
  PetscCall(PetscFree3(map, at, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads all pieces as one grid. */
static PetscErrorCode read_pieces(Vtu *v, int64_t *npoint, double **x)
{
  SbScan *s = v->scan;
  SbVtkGrid *grid = &v->grid;
  PetscInt npiece = 0;
  Tag tag, next;

  PetscFunctionBeginUser;
  if (!find_element(s->data, v->xml_end, "Piece", &tag))
    SB_SCAN_ERROR(s, "there is no element Piece; the file is truncated or damaged");
  for (;; tag = next) {
    SbVtkGrid one = {.ncell = 0};
    const PetscBool more = find_element(tag.close, v->xml_end, "Piece", &next);
    int64_t n;
    double *y = NULL;

    v->piece = (Tag){tag.open, more ? next.open : v->xml_end};
    s->token = tag.close;
    PetscCall(read_piece(v, &one, &n, &y));
    if (!npiece++ && !more) {
      *grid = one;
      *npoint = n;
      *x = y;
      PetscFunctionReturn(PETSC_SUCCESS);
    }

    // a copy of a cell of another piece is marked by a number
    for (int a = 0; a < one.narray; a++)
      for (PetscInt c = 0; c < one.ncell && !strncmp(one.array[a].name, "vtkGhost", 8); c++)
        if (one.array[a].value[c] != 0) {
          s->token = tag.open;
          SB_SCAN_ERROR(s,
                        "piece %lld has ghost cells, which are in another piece, too; save the "
                        "grid without them (ParaView: Merge Blocks, Clean to Grid)",
                        (long long)npiece);
        }

    // appended to those before: indices go on behind their points, arrays only where all have them
    if (*npoint + n > PETSC_MAX_INT / 8 || grid->ncell + one.ncell > PETSC_MAX_INT / 8)
      SB_SCAN_ERROR(s, "%lld points are more than this build can number", (long long)(*npoint + n));
    PetscCall(append(v, 3 * *npoint, 3 * n, y, 0., x));
    PetscCall(
      append(v, grid->nconnect, one.nconnect, one.connect, (double)*npoint, &grid->connect));
    PetscCall(append(v, grid->ncell, one.ncell, one.end, (double)grid->nconnect, &grid->end));
    PetscCall(append(v, grid->ncell, one.ncell, one.type, 0., &grid->type));
    for (int a = 0; a < (npiece == 1 ? one.narray : grid->narray); a++) {
      const int from = npiece == 1 ? a : find_array(&one, grid->array[a].name);

      if (npiece == 1) {
        grid->array[a] = one.array[a];
        grid->narray = a + 1;
      } else if (from >= 0)
        PetscCall(
          append(v, grid->ncell, one.ncell, one.array[from].value, 0., &grid->array[a].value));
      else {
        PetscCall(
          SbImportSkip(v->im, "array %.32s, which not all pieces have", grid->array[a].name));
        grid->array[a--] = grid->array[--grid->narray];
      }
    }
    *npoint += n;
    grid->ncell += one.ncell;
    grid->nconnect += one.nconnect;
    if (!more)
      break;
  }

  PetscCall(join_points(v, npoint, *x));
  SbImportRemark(v->im, "%lld pieces, joined where their points are at the same positions",
                 (long long)npiece);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_VTU(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  Vtu vtu = {.scan = s, .im = im};
  Vtu *v = &vtu;
  Tag tag;
  int64_t npoint = 0;
  double *x = NULL;
  char value[64];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));

  // end of the XML part, beginning of the appended data
  v->xml_end = s->end;
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

  // type, byte order and compression of the file
  if (!find_element(s->data, v->xml_end, "VTKFile", &tag))
    SB_SCAN_ERROR(s, "expected an element VTKFile; this is no XML file of VTK");
  s->token = tag.open;
  attribute(tag, "type", sizeof(value), value);
  if (strcmp(value, "UnstructuredGrid"))
    SB_SCAN_ERROR(s, "a file of type '%s'; expected UnstructuredGrid with tetrahedra", value);
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
  PetscCall(read_pieces(v, &npoint, &x));
  PetscCall(SbVtkSetPoints((PetscInt)npoint, x, im));
  s->token = v->cells_at;
  PetscCall(SbVtkGridFill(&v->grid, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
