/*
  import_vtu.c - reader of VTK's XML files of unstructured grids, .vtu (VTK User's Guide, "XML file formats").

  Arrays are in DataArray elements as text or base64, or after the mark _ of AppendedData as raw bytes or base64. A binary array
  begins with its length or, if compressed by zlib, with the number and sizes of its blocks. Base64 may continue after a final =:
  some writers encode lengths and data separately.

  Kept: tets, triangles, lines and points; cell arrays of integers become groups, see vtk_grid.h. Errors:
  several pieces, other compressors, volume cells other than 4- and 10-node tets.
*/
#include <ctype.h>
#include <stdlib.h>
#include <zlib.h>
#include "vtk_grid.h"

enum { ZLIB_RATIO = 1032 }; /* largest compression ratio of zlib */

typedef struct {
  SbScan *scan;
  SbImport *im;
  SbVtkGrid grid;
  PetscBool big_endian, zlib;
  int header;              /* bytes of a length field: 4 or 8 */
  const char *xml_end;     /* end of the XML part */
  const char *appended;    /* first byte after the mark _, or NULL */
  PetscBool appended_text; /* the appended data is base64 */
  const char *cells_at;    /* position of the cells, for messages */
  unsigned char *raw;      /* decoded bytes of the last array */
} Vtu;

/* ------------------------------------------------------------------ XML */

/* Finds the next element of this name before `end`: `open` at its <, `close` after its >; false if there is none. */
static PetscBool find_element(const char *from, const char *end, const char *name, const char **open,
                              const char **close)
{
  const size_t n = strlen(name);

  for (const char *p = from; p && p < end; p++) {
    p = (const char *)memchr(p, '<', (size_t)(end - p));
    if (!p || (size_t)(end - p) < n + 2) return PETSC_FALSE;
    if (strncmp(p + 1, name, n) || !strchr(" \t\r\n/>", p[n + 1]) || !p[n + 1]) continue;
    *open = p;
    *close = (const char *)memchr(p, '>', (size_t)(end - p));
    if (!*close) return PETSC_FALSE;
    (*close)++;
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Value of an attribute, "" if absent. */
static void attribute(const char *open, const char *close, const char *name, size_t size, char value[])
{
  const size_t n = strlen(name);

  value[0] = 0;
  for (const char *p = open; p + n + 2 < close; p++) {
    const char *q = p + 1 + n, *quote;
    size_t length = 0;

    if (!isspace((unsigned char)*p) || strncmp(p + 1, name, n)) continue;
    while (q < close && isspace((unsigned char)*q)) q++;
    if (q >= close || *q++ != '=') continue;
    while (q < close && isspace((unsigned char)*q)) q++;
    if (q >= close || (*q != '"' && *q != '\'')) continue;
    for (quote = q++; q < close && *q != *quote && length + 1 < size; q++)
      value[length++] = isprint((unsigned char)*q) ? *q : '?';
    value[length] = 0;
    return;
  }
}

/* Integer value of an attribute. */
static PetscErrorCode attribute_number(Vtu *v, const char *open, const char *close, const char *name,
                                       int64_t *n)
{
  char value[32], *end;

  PetscFunctionBeginUser;
  attribute(open, close, name, sizeof(value), value);
  *n = strtoll(value, &end, 10);
  v->scan->token = open;
  if (!value[0] || *end || *n < 0)
    SB_SCAN_ERROR(v->scan, "expected a number %s=\"...\", found '%s'", name, value);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bytes */

/* Decoder of raw or base64 bytes. */
typedef struct {
  const char *at, *end;
  PetscBool text;
  unsigned char held[3];
  int nheld, from;
} Bytes;

/* Decodes four base64 characters to at most three bytes; false at the end, or at a character that is not base64. */
static PetscBool next_quad(Bytes *b)
{
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  uint32_t bits = 0;
  int n = 0, padding = 0;

  while (n < 4) {
    const char *found;
    int digit;

    while (b->at < b->end && isspace((unsigned char)*b->at)) b->at++;
    if (b->at >= b->end) return PETSC_FALSE;
    found = *b->at ? strchr(digits, *b->at) : NULL;
    digit = found ? (int)(found - digits) : -1;
    if (digit < 0 && !(*b->at == '=' && n >= 2)) return PETSC_FALSE;
    padding += digit < 0;
    if (digit >= 0 && padding) return PETSC_FALSE;
    bits = bits << 6 | (uint32_t)PetscMax(digit, 0);
    b->at++;
    n++;
  }
  for (int i = 0; i < 3; i++) b->held[i] = (unsigned char)(bits >> (16 - 8 * i));
  b->nheld = 3 - padding;
  b->from = 0;
  return PETSC_TRUE;
}

/* Takes n bytes; false if there are fewer. */
static PetscBool take_bytes(Bytes *b, size_t n, unsigned char out[])
{
  if (!b->text) {
    if ((size_t)(b->end - b->at) < n) return PETSC_FALSE;
    memcpy(out, b->at, n);
    b->at += n;
    return PETSC_TRUE;
  }
  for (size_t i = 0; i < n; i++) {
    while (b->from >= b->nheld) {
      if (!next_quad(b)) return PETSC_FALSE;
    }
    out[i] = b->held[b->from++];
  }
  return PETSC_TRUE;
}

/* Takes a length field of 4 or 8 bytes. */
static PetscErrorCode take_length(Vtu *v, Bytes *b, const char *name, size_t *length)
{
  unsigned char raw[8];
  uint64_t value = 0;

  PetscFunctionBeginUser;
  if (!take_bytes(b, (size_t)v->header, raw))
    SB_SCAN_ERROR(v->scan, "the data of array '%s' is truncated, or no base64", name);
  for (int i = 0; i < v->header; i++)
    value |= (uint64_t)raw[i] << 8 * (v->big_endian ? v->header - 1 - i : i);
  if (value > (uint64_t)1 << 40)
    SB_SCAN_ERROR(v->scan, "array '%s' announces %llu bytes or blocks; it is damaged", name,
                  (unsigned long long)value);
  *length = (size_t)value;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ arrays */

/* Decompresses an array: number of blocks, block size, size of a smaller last block, compressed size of each; then the blocks. */
static PetscErrorCode take_blocks(Vtu *v, Bytes *b, const char *name, size_t want, unsigned char out[])
{
  size_t nblock, size, last, full, *packed = NULL, at = 0;
  unsigned char *in = NULL;

  PetscFunctionBeginUser;
  PetscCall(take_length(v, b, name, &nblock));
  PetscCall(take_length(v, b, name, &size));
  PetscCall(take_length(v, b, name, &last));
  full = nblock - (nblock && last);
  if (nblock > (size_t)(b->end - b->at) || last > want || (size && full > want / size) ||
      full * size + (nblock ? last : 0) != want)
    SB_SCAN_ERROR(v->scan,
                  "array '%s' has %zu blocks of %zu bytes, the last of %zu; expected %zu bytes in all", name,
                  nblock, size, last, want);
  PetscCall(SbImportScratch(v->im, nblock * sizeof(*packed), &packed));
  for (size_t i = 0; i < nblock; i++) PetscCall(take_length(v, b, name, &packed[i]));
  for (size_t i = 0; i < nblock; i++) {
    const size_t n = i + 1 == nblock && last ? last : size;
    uLongf got = (uLongf)n;

    if (packed[i] > (size_t)(b->end - b->at) + 3)
      SB_SCAN_ERROR(v->scan, "a block of array '%s' announces %zu bytes, which the file does not hold", name,
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

/* Reads the n numbers of the array whose element is from open to close; *value is allocated. */
static PetscErrorCode read_array(Vtu *v, const char *open, const char *close, int64_t n, double **value)
{
  SbNumberType type;
  Bytes b;
  char format[16], name[64];
  size_t room, want, length;
  char kind[32];
  unsigned char *raw;
  int64_t offset;

  PetscFunctionBeginUser;
  v->scan->token = open;
  attribute(open, close, "type", sizeof(kind), kind);
  type.kind = !strncmp(kind, "Int", 3)     ? 'i'
              : !strncmp(kind, "UInt", 4)  ? 'u'
              : !strncmp(kind, "Float", 5) ? 'f'
                                           : 0;
  type.size = atoi(kind + strcspn(kind, "0123456789")) / 8;
  if (!type.kind || (type.size != 1 && type.size != 2 && type.size != 4 && type.size != 8) ||
      (type.kind == 'f' && type.size < 4))
    SB_SCAN_ERROR(v->scan, "an array of type '%s'; expected one as Float64 or Int32", kind);
  attribute(open, close, "format", sizeof(format), format);
  attribute(open, close, "Name", sizeof(name), name);
  if (!strcmp(format, "ascii") || !format[0]) {
    const char *end = (const char *)memchr(close, '<', (size_t)(v->scan->end - close));
    SbScan s;

    if (!end) SB_SCAN_ERROR(v->scan, "the array has no end; the file is truncated, write or copy it again");
    if (n > (end - close) / 2 + 1)
      SB_SCAN_ERROR(v->scan, "array '%s' should hold %lld numbers, which is more than stand there", name,
                    (long long)n);
    PetscCall(SbImportScratch(v->im, (size_t)n * sizeof(**value), value));
    // text: numbers separated by blanks
    s = *v->scan;
    s.at = close;
    s.end = end;
    s.bytes = PETSC_FALSE;
    for (size_t i = 0; i < (size_t)n; i++) {
      PetscReal x;

      PetscCall(SbScanReal(&s, "value of an array", 0, &x));
      (*value)[i] = x;
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  // inline or appended binary data
  b = (Bytes){close, v->scan->end, PETSC_TRUE, {0}, 0, 0};
  if (!strcmp(format, "appended")) {
    PetscCall(attribute_number(v, open, close, "offset", &offset));
    if (!v->appended || offset > v->scan->end - v->appended)
      SB_SCAN_ERROR(v->scan, "the array lies at %lld of the appended data, which the file does not hold",
                    (long long)offset);
    b.at = v->appended + offset;
    b.text = v->appended_text;
  } else if (!strcmp(format, "binary")) {
    b.end = (const char *)memchr(close, '<', (size_t)(v->scan->end - close));
    if (!b.end) SB_SCAN_ERROR(v->scan, "the array has no end; the file is truncated, write or copy it again");
  } else
    SB_SCAN_ERROR(v->scan, "an array of format '%s'; expected ascii, binary or appended", format);
  room = (size_t)(b.end - b.at) / (size_t)type.size;
  if ((uint64_t)n > (v->zlib ? ZLIB_RATIO : 1) * (uint64_t)room)
    SB_SCAN_ERROR(v->scan,
                  "array '%s' should hold %lld numbers, which is more than the rest of the file can contain",
                  name, (long long)n);
  PetscCall(SbImportScratch(v->im, (size_t)n * sizeof(**value), value));
  // n binary numbers of this type
  want = (size_t)n * (size_t)type.size;
  length = want;
  PetscCall(SbImportScratch(v->im, want, &v->raw));
  raw = v->raw;
  if (v->zlib)
    PetscCall(take_blocks(v, &b, name, want, raw));
  else {
    PetscCall(take_length(v, &b, name, &length));
    if (length != want || !take_bytes(&b, want, raw))
      SB_SCAN_ERROR(v->scan, "array '%s' has %zu bytes; expected %zu, or it is truncated, or no base64", name,
                    length, want);
  }
  SbNumbersConvert(type, v->big_endian, (size_t)n, raw, (*value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the parts of a grid */

/* Content of an element, from after its > to the < of its end tag. */
static PetscErrorCode content(Vtu *v, const char *name, const char **from, const char **end)
{
  const char *open, *close;
  char closing[32];

  PetscFunctionBeginUser;
  (void)snprintf(closing, sizeof(closing), "/%s", name);
  v->scan->token = v->scan->data;
  if (!find_element(v->scan->data, v->xml_end, name, &open, from) ||
      !find_element(*from, v->xml_end, closing, end, &close))
    SB_SCAN_ERROR(v->scan, "there is no element %s, or it has no end; the file is truncated or damaged",
                  name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads the array of this name in the element Cells. */
static PetscErrorCode read_cell_array(Vtu *v, const char *name, int64_t n, double **value)
{
  const char *from, *end, *open, *close;
  char found[64];

  PetscFunctionBeginUser;
  PetscCall(content(v, "Cells", &from, &end));
  v->cells_at = v->scan->token = from;
  for (; find_element(from, end, "DataArray", &open, &close); from = close) {
    attribute(open, close, "Name", sizeof(found), found);
    if (strcmp(found, name)) continue;
    PetscCall(read_array(v, open, close, n, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  SB_SCAN_ERROR(v->scan, "the element Cells has no array '%s'", name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ the file */

PetscErrorCode SbImportRead_VTU(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  Vtu vtu = {.scan = s, .im = im}, *v = &vtu;
  const char *open, *close, *open2, *close2, *from, *end;
  char text[16];
  int64_t npoint, ncell, ncomponent = 3;
  double *x = NULL, last;
  SbVtkGrid *grid = &v->grid;
  char value[64];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  // end of the XML part, beginning of the appended data
  v->xml_end = s->end;
  if (find_element(s->data, s->end, "AppendedData", &open, &close)) {
    v->xml_end = s->token = open;
    attribute(open, close, "encoding", sizeof(text), text);
    v->appended_text = (PetscBool)!strcmp(text, "base64");
    s->bytes = (PetscBool)!v->appended_text;
    v->appended = (const char *)memchr(close, '_', (size_t)(s->end - close));
    if (!v->appended) SB_SCAN_ERROR(s, "the appended data has no mark _ at its beginning");
    v->appended++;
  }
  // type, byte order and compression of the file
  if (!find_element(s->data, v->xml_end, "VTKFile", &open, &close))
    SB_SCAN_ERROR(s, "expected an element VTKFile; this is no XML file of VTK");
  s->token = open;
  attribute(open, close, "type", sizeof(value), value);
  if (strcmp(value, "UnstructuredGrid"))
    SB_SCAN_ERROR(s, "a file of type '%s'; expected UnstructuredGrid with tetrahedra", value);
  attribute(open, close, "byte_order", sizeof(value), value);
  v->big_endian = (PetscBool)!strcmp(value, "BigEndian");
  attribute(open, close, "header_type", sizeof(value), value);
  v->header = !strcmp(value, "UInt64") ? 8 : 4;
  attribute(open, close, "compressor", sizeof(value), value);
  v->zlib = (PetscBool)(value[0] != 0);
  if (v->zlib && strcmp(value, "vtkZLibDataCompressor") != 0)
    SB_SCAN_ERROR(s,
                  "compressed by %s; supple knows vtkZLibDataCompressor and uncompressed files (ParaView: "
                  "Save Data, Compressor Type)",
                  value);
  if (!find_element(s->data, v->xml_end, "Piece", &open, &close))
    SB_SCAN_ERROR(s, "there is no element Piece; the file is truncated or damaged");
  s->token = close;
  if (find_element(close, v->xml_end, "Piece", &open2, &close2))
    SB_SCAN_ERROR(s, "the grid is in several pieces; save it in one (ParaView: Merge Blocks, Clean to Grid)");
  PetscCall(attribute_number(v, open, close, "NumberOfPoints", &npoint));
  PetscCall(attribute_number(v, open, close, "NumberOfCells", &ncell));
  if (npoint > PETSC_MAX_INT / 8 || ncell > PETSC_MAX_INT / 8)
    SB_SCAN_ERROR(s, "%lld points and %lld cells are more than this build can number", (long long)npoint,
                  (long long)ncell);
  // the only array of the element Points
  PetscCall(content(v, "Points", &from, &end));
  v->scan->token = from;
  if (!find_element(from, end, "DataArray", &open, &close))
    SB_SCAN_ERROR(v->scan, "the element Points has no array");
  PetscCall(attribute_number(v, open, close, "NumberOfComponents", &ncomponent));
  if (ncomponent != 3)
    SB_SCAN_ERROR(v->scan, "points of %lld coordinates; expected 3", (long long)ncomponent);
  PetscCall(read_array(v, open, close, 3 * npoint, &x));
  PetscCall(SbVtkSetPoints((PetscInt)npoint, x, v->im));
  // cell types, end offsets of cells, then the connectivity
  grid->ncell = (PetscInt)ncell;
  PetscCall(read_cell_array(v, "offsets", ncell, &grid->end));
  PetscCall(read_cell_array(v, "types", ncell, &grid->type));
  last = ncell ? grid->end[ncell - 1] : 0;
  v->scan->token = v->cells_at;
  if (!(last >= 0 && last < 1e12) || last != PetscFloorReal(last))
    SB_SCAN_ERROR(v->scan, "the last of the offsets is %g; expected the number of points of all cells", last);
  grid->nconnect = (int64_t)last;
  PetscCall(read_cell_array(v, "connectivity", grid->nconnect, &grid->connect));
  // cell data with one number per cell; other arrays are skipped
  if (find_element(s->data, v->xml_end, "CellData", &open, &from) && from[-2] != '/') {
    PetscCall(content(v, "CellData", &from, &end));
    for (; find_element(from, end, "DataArray", &open, &close) && grid->narray < SB_VTK_ARRAYS;
         from = close) {
      const int a = grid->narray;

      attribute(open, close, "NumberOfComponents", sizeof(text), text);
      if (text[0] && strcmp(text, "1") != 0) continue;
      grid->narray++;
      grid->array[a].value = NULL;
      attribute(open, close, "Name", sizeof(grid->array[a].name), grid->array[a].name);
      PetscCall(read_array(v, open, close, grid->ncell, &grid->array[a].value));
    }
  }
  s->token = v->cells_at;
  PetscCall(SbVtkGridFill(&v->grid, im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
