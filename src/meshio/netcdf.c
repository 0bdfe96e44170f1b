/*
  netcdf.c - header of netCDF's classic format (NetCDF User's Guide, "File Format Specification"):
  versions 1, 2 (offsets of 64 bits) and 5 (counts of 64 bits).

  After the magic bytes and the number of records come three lists: dimensions, attributes of the
  file, variables. All numbers are big-endian, all lengths multiples of four bytes. Variables of
  records (steps of time) are interleaved and not needed for a mesh: they are left out.
*/
#include "foreign.h"

enum {
  DIMENSION = 10,
  VARIABLE = 11,
  ATTRIBUTE = 12
}; /* marks of lists */

typedef struct {
  SbForeign *file;
  SbScan *scan;
  int version;
  SbCount ndim;
  int64_t *size; /* [ndim]; 0: records */
} Header;

static const struct {
  char kind;
  int size;
} types[] = {{0, 0},   {'i', 1}, {'c', 1}, {'i', 2}, {'i', 4}, {'f', 4},
             {'f', 8}, {'u', 1}, {'u', 2}, {'u', 4}, {'i', 8}, {'u', 8}};

/* A count: 4 bytes, in version 5 8. */
static PetscErrorCode read_count(Header *h, const char *what, int64_t *n)
{
  PetscFunctionBeginUser;
  PetscCall(SbScanInt(h->scan, h->version == 5 ? 8 : 4, what, n));
  if (*n < 0 || *n > (int64_t)1 << 50)
    SB_SCAN_ERROR(h->scan, "%lld as %s; the file is damaged", (long long)*n, what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Passes over n bytes and the fill up to a multiple of four. */
static PetscErrorCode pass(Header *h, int64_t n)
{
  PetscFunctionBeginUser;
  n = (n + 3) / 4 * 4;
  h->scan->token = h->scan->at;
  if (n > h->scan->end - h->scan->at)
    SB_SCAN_ENDS(h->scan, "%lld bytes of the header", (long long)n);
  h->scan->at += n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_name(Header *h, char name[SB_NAME_MAX])
{
  int64_t n;
  const char *at;

  PetscFunctionBeginUser;
  PetscCall(read_count(h, "length of a name", &n));
  at = h->scan->at;
  PetscCall(pass(h, n));
  (void)snprintf(name, SB_NAME_MAX, "%.*s", (int)PetscMin(n, SB_NAME_MAX - 1), at);
  SbCleanName(name, '?');
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mark and length of a list. */
static PetscErrorCode read_list(Header *h, int mark, int64_t *n)
{
  int64_t found;

  PetscFunctionBeginUser;
  PetscCall(SbScanInt(h->scan, 4, "mark of a list", &found));
  PetscCall(read_count(h, "length of a list", n));
  if (found != (*n ? mark : found ? mark : 0))
    SB_SCAN_ERROR(h->scan, "a list with the mark %lld, where %d is expected; the file is damaged",
                  (long long)found, mark);
  PetscCall(SbScanRoom(h->scan, "entries of a list", *n, 8, 8));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Type of numbers. */
static PetscErrorCode read_type(Header *h, int64_t *type)
{
  PetscFunctionBeginUser;
  PetscCall(SbScanInt(h->scan, 4, "type of numbers", type));
  if (*type < 1 || *type >= (int64_t)PETSC_STATIC_ARRAY_LENGTH(types))
    SB_SCAN_ERROR(h->scan, "numbers of type %lld, which netCDF does not have", (long long)*type);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A list of attributes; of the one elem_type the text. */
static PetscErrorCode read_attributes(Header *h, char element_type[SB_NAME_MAX])
{
  int64_t n, count, type;

  PetscFunctionBeginUser;
  PetscCall(read_list(h, ATTRIBUTE, &n));
  for (int64_t i = 0; i < n; i++) {
    char name[SB_NAME_MAX];
    const char *at;

    PetscCall(read_name(h, name));
    PetscCall(read_type(h, &type));
    PetscCall(read_count(h, "length of an attribute", &count));
    at = h->scan->at;
    PetscCall(pass(h, count * types[type].size));
    if (element_type && types[type].kind == 'c' && !strcmp(name, "elem_type"))
      SbForeignText(at, (size_t)count, 0, SB_NAME_MAX, element_type);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_variable(Header *h)
{
  SbForeign *f = h->file;
  SbVariable v = {.n = 1, .size = {1, 1}};
  PetscBool of_records = PETSC_FALSE;
  int64_t ndim, type, bytes;

  PetscFunctionBeginUser;
  PetscCall(read_name(h, v.name));
  PetscCall(read_count(h, "number of dimensions", &ndim));
  PetscCall(SbScanRoom(h->scan, "dimensions", ndim, 4, 4));
  v.ndim = (int)PetscMin(ndim, 1000);
  for (int64_t d = 0; d < ndim; d++) {
    int64_t k;

    PetscCall(read_count(h, "number of a dimension", &k));
    if (k >= h->ndim.n)
      SB_SCAN_ERROR(h->scan, "'%s' has the dimension %lld of %lld", v.name, (long long)k,
                    (long long)h->ndim.n);
    of_records = (PetscBool)(of_records || !h->size[k]);
    if (d < 2)
      v.size[d] = h->size[k];
    if (h->size[k] && v.n > ((int64_t)1 << 50) / h->size[k])
      SB_SCAN_ERROR(h->scan, "'%s' announces more numbers than a file can hold", v.name);
    v.n *= h->size[k];
  }
  PetscCall(read_attributes(h, v.element_type));
  PetscCall(read_type(h, &type));
  PetscCall(read_count(h, "size of a variable", &bytes));
  PetscCall(SbScanInt(h->scan, h->version == 1 ? 4 : 8, "place of a variable", &v.begin));
  v.type = (SbNumberType){types[type].kind, types[type].size};
  if (of_records)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbImportGrow(f->im, &f->nvariable, sizeof(v), &f->variable));
  f->variable[f->nvariable.n - 1] = v;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNetcdfHeader(SbForeign *f)
{
  SbScan *s = &f->im->scan;
  const int one = 1;
  Header h = {.file = f, .scan = s};
  int64_t n;

  PetscFunctionBeginUser;
  s->bytes = s->binary = PETSC_TRUE;
  s->swap = (PetscBool)(*(const char *)&one == 1);
  if (s->end - s->at < 8 || memcmp(s->at, "CDF", 3) != 0)
    SB_SCAN_ERROR(s, "expected the letters CDF; this is no file of netCDF");
  h.version = (unsigned char)s->at[3];
  if (h.version != 1 && h.version != 2 && h.version != 5)
    SB_SCAN_ERROR(s, "netCDF's format of version %d; supple reads 1, 2, 5 and those in HDF5",
                  h.version);
  s->at += 4;

  /* the number of records is -1 while a file is written */
  s->at += h.version == 5 ? 8 : 4;
  if (s->at > s->end)
    SB_SCAN_ENDS(s, "the %s", "number of records");
  PetscCall(read_list(&h, DIMENSION, &n));
  for (int64_t i = 0; i < n; i++) {
    char name[SB_NAME_MAX];

    PetscCall(read_name(&h, name));
    PetscCall(SbImportGrow(f->im, &h.ndim, sizeof(*h.size), &h.size));
    PetscCall(read_count(&h, "size of a dimension", &h.size[i]));
  }
  PetscCall(read_attributes(&h, NULL));
  PetscCall(read_list(&h, VARIABLE, &n));
  for (int64_t i = 0; i < n; i++)
    PetscCall(read_variable(&h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbVariable *SbNetcdfFind(const SbForeign *f, const char *name)
{
  for (PetscInt k = 0; k < f->nvariable.n; k++)
    if (!strcmp(f->variable[k].name, name))
      return &f->variable[k];
  return NULL;
}
