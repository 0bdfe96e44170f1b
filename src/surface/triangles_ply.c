/*
  triangles_ply.c - surfaces from .ply files (Stanford polygon format 1.0): text, and binary of both byte orders.

  The header lists which properties an element has, in which order and of which types. Of `vertex` x, y and z are taken, of `face` the
  list vertex_indices (or vertex_index); everything else is walked over. Triangle strips are refused.
*/
#include <stdlib.h>
#include "triangles.h"

enum { ELEMENTS_MAX = 16, PROPERTIES_MAX = 64 };

/* Types by their two names. */
static const struct {
  const char *name, *other;
  int size;
  char kind; /* i signed, u unsigned, f floating */
} types[] = {
  {"char", "int8", 1, 'i'},     {"uchar", "uint8", 1, 'u'},    {"short", "int16", 2, 'i'},
  {"ushort", "uint16", 2, 'u'}, {"int", "int32", 4, 'i'},      {"uint", "uint32", 4, 'u'},
  {"float", "float32", 4, 'f'}, {"double", "float64", 8, 'f'},
};
enum { NTYPE = (int)PETSC_STATIC_ARRAY_LENGTH(types) };

typedef struct {
  int type, count; /* count: type of a list's length, -1 for a single value */
  int axis;        /* 0, 1, 2: a coordinate of a vertex; 3: the corners of a face; -1: nothing of use */
} Property;

typedef struct {
  char name[32];
  int64_t n;
  int nproperty;
  Property property[PROPERTIES_MAX];
} Element;

typedef struct {
  SbScan *s;
  SbTriangleFile *f;
  PetscBool binary, swap;
  int nelement;
  Element element[ELEMENTS_MAX];
} Ply;

/* ------------------------------------------------------------------ header */

static PetscErrorCode read_type(Ply *p, int *type)
{
  char word[32];

  PetscFunctionBeginUser;
  PetscCall(SbScanWord(p->s, sizeof(word), word));
  for (*type = 0; *type < NTYPE; (*type)++) {
    if (!strcmp(word, types[*type].name) || !strcmp(word, types[*type].other))
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  SB_SCAN_ERROR(
    p->s, "'%s' is no type of a property; expected char, uchar, short, ushort, int, uint, float or double",
    word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_property(Ply *p)
{
  static const char *const coordinates[3] = {"x", "y", "z"};
  Element *e;
  Property *q;
  char word[32];
  const char *before;

  PetscFunctionBeginUser;
  if (!p->nelement) SB_SCAN_ERROR(p->s, "a property stands before the first element");
  e = &p->element[p->nelement - 1];
  if (e->nproperty == PROPERTIES_MAX)
    SB_SCAN_ERROR(p->s, "an element has more than %d properties", PROPERTIES_MAX);
  q = &e->property[e->nproperty++];
  *q = (Property){.count = -1, .axis = -1};
  before = p->s->at;
  PetscCall(SbScanWord(p->s, sizeof(word), word));
  if (!strcmp(word, "list"))
    PetscCall(read_type(p, &q->count));
  else
    p->s->at = before;
  PetscCall(read_type(p, &q->type));
  PetscCall(SbScanWord(p->s, sizeof(word), word));
  for (int k = 0; k < 3; k++) {
    if (!strcmp(e->name, "vertex") && !strcmp(word, coordinates[k]) && q->count < 0) q->axis = k;
  }
  if (!strcmp(e->name, "face") && (!strcmp(word, "vertex_indices") || !strcmp(word, "vertex_index")) &&
      q->count >= 0)
    q->axis = 3;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_header(Ply *p)
{
  char word[32];
  PetscBool format = PETSC_FALSE;

  PetscFunctionBeginUser;
  // the first line, then one keyword per line
  PetscCall(SbScanWord(p->s, sizeof(word), word));
  if (strcmp(word, "ply")) SB_SCAN_ERROR(p->s, "expected 'ply', found '%s'; it is no PLY file", word);
  for (;;) {
    PetscCall(SbScanEndOfLine(p->s));
    PetscCall(SbScanWord(p->s, sizeof(word), word));
    if (!word[0])
      SB_SCAN_ERROR(p->s,
                    "the file ends where 'end_header' is expected; it is truncated, write or copy it again");
    if (!strcmp(word, "end_header")) break;
    if (!strcmp(word, "format")) {
      // text, or binary in the order of bytes of this machine or the other one
      const uint16_t one = 1;
      const PetscBool little = (PetscBool)(*(const unsigned char *)&one == 1);

      PetscCall(SbScanWord(p->s, sizeof(word), word));
      if (strcmp(word, "ascii") && strcmp(word, "binary_little_endian") && strcmp(word, "binary_big_endian"))
        SB_SCAN_ERROR(p->s, "format '%s'; expected ascii, binary_little_endian or binary_big_endian", word);
      p->binary = (PetscBool)(word[0] == 'b');
      p->swap = (PetscBool)(p->binary && little != (PetscBool)!strcmp(word, "binary_little_endian"));
      format = PETSC_TRUE;
    } else if (!strcmp(word, "element")) {
      // a kind of element, whose properties follow
      Element *e;

      if (p->nelement == ELEMENTS_MAX)
        SB_SCAN_ERROR(p->s, "the file has more than %d kinds of elements", ELEMENTS_MAX);
      e = &p->element[p->nelement++];
      PetscCall(PetscMemzero(e, sizeof(*e)));
      PetscCall(SbScanWord(p->s, sizeof(e->name), e->name));
      PetscCall(SbScanText(p->s, "number of elements", &e->n));
      if (!strcmp(e->name, "tristrips"))
        SB_SCAN_ERROR(p->s, "the file holds triangle strips; write it with single faces");
    } else if (!strcmp(word, "property"))
      PetscCall(read_property(p));
    else if (strcmp(word, "comment") && strcmp(word, "obj_info"))
      SB_SCAN_ERROR(p->s, "'%s' is no line of a PLY header", word);
  }
  if (!format) SB_SCAN_ERROR(p->s, "the header has no line 'format'");
  PetscCall(SbScanEndOfLine(p->s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ values */

/* A number of any type. */
static PetscErrorCode read_value(Ply *p, int type, const char *what, double *value)
{
  SbScan *s = p->s;
  const int size = types[type].size;
  unsigned char byte[8];
  uint64_t bits = 0;

  PetscFunctionBeginUser;
  if (!p->binary) {
    PetscCall(SbScanReal(s, what, 0, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  s->token = s->at;
  if (s->end - s->at < size)
    SB_SCAN_ERROR(s, "the file ends where the %s is expected; it is truncated, write or copy it again", what);
  memcpy(byte, s->at, (size_t)size);
  s->at += size;
  for (int i = 0; p->swap && i < size / 2; i++) {
    const unsigned char keep = byte[i];

    byte[i] = byte[size - 1 - i];
    byte[size - 1 - i] = keep;
  }
  if (types[type].kind == 'f' && size == 8)
    memcpy(value, byte, 8);
  else if (types[type].kind == 'f') {
    float single;

    memcpy(&single, byte, 4);
    *value = single;
  } else {
    const uint16_t one = 1;
    const PetscBool little = (PetscBool)(*(const unsigned char *)&one == 1);

    for (int i = 0; i < size; i++) bits |= (uint64_t)byte[i] << 8 * (little ? i : size - 1 - i);
    *value = (double)bits;
    if (types[type].kind == 'i' && bits >> (8 * size - 1)) *value -= ldexp(1, 8 * size);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether so many things can be in the rest of the file. */
static PetscErrorCode check_room(Ply *p, const char *what, int64_t n, int64_t text_bytes,
                                 int64_t binary_bytes)
{
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  p->s->binary = p->binary;
  ierr = SbScanRoom(p->s, what, n, text_bytes, binary_bytes);
  p->s->binary = PETSC_FALSE;
  PetscFunctionReturn(ierr);
}

static PetscErrorCode read_count(Ply *p, const Property *q, int64_t *n)
{
  double value;

  PetscFunctionBeginUser;
  PetscCall(read_value(p, q->count, "length of a list", &value));
  if (!(value >= 0 && value <= 4294967295. && value == floor(value)))
    SB_SCAN_ERROR(p->s, "a list has %g entries; the file is damaged", value);
  *n = (int64_t)value;
  PetscCall(check_room(p, "entries of a list", *n, 2, types[q->type].size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_face(Ply *p, const Property *q, int64_t number)
{
  int64_t n;
  double value;

  PetscFunctionBeginUser;
  PetscCall(read_count(p, q, &n));
  for (int64_t k = 0; k < n; k++) {
    PetscCall(read_value(p, q->type, "vertex of a face", &value));
    if (!(value >= 0 && value < (double)p->f->t->nvert))
      SB_SCAN_ERROR(p->s, "face %lld uses a vertex that is not there (%g, from 0, of %lld)",
                    (long long)number, value, (long long)p->f->t->nvert);
    PetscCall(SbTrianglesAddCorner(p->s, number, (int64_t)value, p->f));
  }
  PetscCall(SbTrianglesAddFace(p->s, number, p->f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_all(Ply *p)
{
  PetscFunctionBeginUser;
  PetscCall(read_header(p));
  p->s->bytes = p->binary;
  for (int k = 0; k < p->nelement; k++) {
    int64_t bytes = 0;
    int axes = 0;

    // coordinates must be there; the least number of bytes of an item bounds how many the file can hold
    for (int i = 0; i < p->element[k].nproperty; i++) {
      const Property *q = &p->element[k].property[i];

      bytes += q->count >= 0 ? types[q->count].size : types[q->type].size;
      axes |= q->axis >= 0 ? 1 << q->axis : 0;
    }
    if (!strcmp(p->element[k].name, "vertex") && axes != 7)
      SB_SCAN_ERROR(p->s, "the vertices have no properties x, y and z");
    if (!strcmp(p->element[k].name, "face") && axes != 8)
      SB_SCAN_ERROR(p->s, "the faces have no list vertex_indices");
    if (!bytes && p->element[k].n)
      SB_SCAN_ERROR(p->s, "the element '%s' has no properties", p->element[k].name);
    PetscCall(check_room(p, p->element[k].name, p->element[k].n, PetscMax(1, 2 * p->element[k].nproperty),
                         PetscMax(1, bytes)));
    // one vertex, face or whatever: its properties in their order
    for (int64_t i = 0; i < p->element[k].n; i++) {
      PetscReal x[3] = {0, 0, 0};
      double value;

      for (int j = 0; j < p->element[k].nproperty; j++) {
        const Property *q = &p->element[k].property[j];
        int64_t n = 1;

        if (q->axis == 3) {
          PetscCall(read_face(p, q, i + 1));
          continue;
        }
        if (q->count >= 0) PetscCall(read_count(p, q, &n));
        for (int64_t c = 0; c < n; c++) PetscCall(read_value(p, q->type, "value of a property", &value));
        if (q->axis < 0) continue;
        if (!isfinite(value)) SB_SCAN_ERROR(p->s, "the coordinate is not a finite number; repair the file");
        x[q->axis] = value;
      }
      if (!strcmp(p->element[k].name, "vertex")) PetscCall(SbTrianglesAddVertex(p->f, x));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode ply_file(SbScan *s, SbTriangleFile *f)
{
  Ply *p;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  p->s = s;
  p->f = f;
  ierr = read_all(p);
  PetscCall(PetscFree(p));
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbTrianglesRead_PLY(const char *path, SbTriangleFile *f)
{
  return SbTrianglesScan(path, ply_file, f);
}
