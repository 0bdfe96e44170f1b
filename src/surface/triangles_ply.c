/*
  triangles_ply.c - reader of .ply surfaces (Stanford polygon format 1.0): text, and binary in both
  byte orders.

  The header lists the properties of each element with their order and types. Read: x, y and z of
  `vertex`, the list vertex_indices (or vertex_index) of `face`; everything else is skipped.
  Triangle strips are an error.
*/
#include "surface_impl.h"

enum {
  ELEMENTS_MAX = 16,
  PROPERTIES_MAX = 64
};

typedef struct {
  SbNumberType type, count; /* type of values; of a list's length, size 0: a single value */
  int axis;                 /* 0, 1, 2: coordinate of a vertex; 3: corners of a face; -1: ignored */
} Property;

typedef struct {
  char name[32];
  int64_t n;
  int nproperty;
  Property property[PROPERTIES_MAX];
} Element;

typedef struct {
  SbScan *s;
  PetscBool big_endian;
  int nelement;
  Element element[ELEMENTS_MAX];
} Ply;

static PetscErrorCode read_property(Ply *p)
{
  Element *e;
  Property *q;
  char word[32];
  const char *before;
  PetscBool coordinate, corners;

  PetscFunctionBeginUser;
  if (!p->nelement)
    SB_SCAN_ERROR(p->s, "a property stands before the first element");
  e = &p->element[p->nelement - 1];
  if (e->nproperty == PROPERTIES_MAX)
    SB_SCAN_ERROR(p->s, "an element has more than %d properties", PROPERTIES_MAX);
  q = &e->property[e->nproperty++];
  *q = (Property){.axis = -1};
  before = p->s->at;
  (void)SbScanWord(p->s, sizeof(word), word);
  if (!strcmp(word, "list"))
    PetscCall(SbScanType(p->s, &q->count));
  else
    p->s->at = before;
  PetscCall(SbScanType(p->s, &q->type));
  (void)SbScanWord(p->s, sizeof(word), word);
  coordinate = (PetscBool)(word[0] >= 'x' && word[0] <= 'z' && !word[1]);
  corners = (PetscBool)(!strcmp(word, "vertex_indices") || !strcmp(word, "vertex_index"));
  if (!strcmp(e->name, "vertex") && coordinate && !q->count.size)
    q->axis = word[0] - 'x';
  if (!strcmp(e->name, "face") && corners && q->count.size)
    q->axis = 3;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_header(Ply *p)
{
  char word[32];
  PetscBool format = PETSC_FALSE;
  PetscBool binary = PETSC_FALSE;

  PetscFunctionBeginUser;

  // first line, then one keyword per line
  (void)SbScanWord(p->s, sizeof(word), word);
  if (strcmp(word, "ply"))
    SB_SCAN_ERROR(p->s, "expected 'ply', found '%s'; it is no PLY file", word);
  for (;;) {
    SbScanEndOfLine(p->s);
    if (!SbScanWord(p->s, sizeof(word), word))
      SB_SCAN_ENDS(p->s, "'%s'", "end_header");
    if (!strcmp(word, "end_header"))
      break;
    if (!strcmp(word, "format")) {
      // text, or binary in either byte order
      (void)SbScanWord(p->s, sizeof(word), word);
      if (strcmp(word, "ascii") && strcmp(word, "binary_little_endian") &&
          strcmp(word, "binary_big_endian"))
        SB_SCAN_ERROR(
          p->s, "format '%s'; expected ascii, binary_little_endian or binary_big_endian", word);
      binary = (PetscBool)(word[0] == 'b');
      p->big_endian = (PetscBool)!strcmp(word, "binary_big_endian");
      format = PETSC_TRUE;
    } else if (!strcmp(word, "element")) {
      // an element, followed by its properties
      Element *e;

      if (p->nelement == ELEMENTS_MAX)
        SB_SCAN_ERROR(p->s, "the file has more than %d kinds of elements", ELEMENTS_MAX);
      e = &p->element[p->nelement++];
      PetscCall(PetscMemzero(e, sizeof(*e)));
      (void)SbScanWord(p->s, sizeof(e->name), e->name);
      PetscCall(SbScanText(p->s, "number of elements", &e->n));
      if (!strcmp(e->name, "tristrips"))
        SB_SCAN_ERROR(p->s, "the file holds triangle strips; write it with single faces");
    } else if (!strcmp(word, "property"))
      PetscCall(read_property(p));
    else if (strcmp(word, "comment") && strcmp(word, "obj_info"))
      SB_SCAN_ERROR(p->s, "'%s' is no line of a PLY header", word);
  }
  if (!format)
    SB_SCAN_ERROR(p->s, "the header has no line 'format'");
  SbScanEndOfLine(p->s);
  p->s->binary = p->s->bytes = binary;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads a number of any type. */
static PetscErrorCode read_value(Ply *p, SbNumberType type, const char *what, double *value)
{
  SbScan *s = p->s;

  PetscFunctionBeginUser;
  if (!s->binary) {
    PetscCall(SbScanReal(s, what, 0, value));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  s->token = s->at;
  if (s->end - s->at < type.size)
    SB_SCAN_ENDS(s, "the %s", what);
  SbNumbersConvert(type, p->big_endian, 1, s->at, value);
  s->at += type.size;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads all items of an element; `add` false: passes over them. */
static PetscErrorCode read_items(Ply *p, const Element *e, PetscBool add, SbTriangleFile *f)
{
  SbScan *s = p->s;

  PetscFunctionBeginUser;
  for (int64_t i = 0; i < e->n; i++) {
    PetscReal x[3] = {0, 0, 0};

    for (const Property *q = e->property; q < e->property + e->nproperty; q++) {
      const char *what = q->axis == 3 ? "vertex of a face" : "value of a property";
      int64_t n = 1;
      double value = 0;

      if (q->count.size) {
        PetscCall(read_value(p, q->count, "length of a list", &value));
        if (!(value >= 0 && value <= 4294967295. && value == floor(value)))
          SB_SCAN_ERROR(s, "a list has %g entries; the file is damaged", value);
        n = (int64_t)value;
        PetscCall(SbScanRoom(s, "entries of a list", n, 2, q->type.size));
      }
      for (int64_t c = 0; c < n; c++) {
        PetscCall(read_value(p, q->type, what, &value));
        if (q->axis != 3 || !add)
          continue;
        if (!(value >= 0 && value < (double)f->t->nvert))
          SB_SCAN_ERROR(s, "face %lld uses a vertex that is not there (%g, from 0, of %lld)",
                        (long long)i + 1, value, (long long)f->t->nvert);
        PetscCall(SbTrianglesAddCorner(s, i + 1, (int64_t)value, f));
      }
      if (q->axis == 3 && add)
        PetscCall(SbTrianglesAddFace(s, i + 1, f));
      if (q->axis < 0 || q->axis == 3)
        continue;
      if (!isfinite(value))
        SB_SCAN_ERROR(s, "the coordinate is not a finite number; repair the file");
      x[q->axis] = value;
    }
    if (!strcmp(e->name, "vertex"))
      PetscCall(SbTrianglesAddVertex(f, x));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_PLY(SbScan *s, SbTriangleFile *f)
{
  Ply ply = {.s = s};
  Ply *p = &ply;
  const Element *early = NULL;
  const char *begin = NULL;
  const char *first;

  PetscFunctionBeginUser;
  PetscCall(read_header(p));
  for (const Element *e = p->element; e < p->element + p->nelement; e++) {
    int64_t bytes = 0;
    int axes = 0;

    // coordinates are required; check the number of items against the file size
    for (const Property *q = e->property; q < e->property + e->nproperty; q++) {
      bytes += q->count.size ? q->count.size : q->type.size;
      axes |= q->axis >= 0 ? 1 << q->axis : 0;
    }
    if (!strcmp(e->name, "vertex") && axes != 7)
      SB_SCAN_ERROR(s, "the vertices have no properties x, y and z");
    if (!strcmp(e->name, "face") && axes != 8)
      SB_SCAN_ERROR(s, "the faces have no list vertex_indices");
    if (!bytes && e->n)
      SB_SCAN_ERROR(s, "the element '%s' has no properties", e->name);
    PetscCall(SbScanRoom(s, e->name, e->n, PetscMax(1, 2 * e->nproperty), PetscMax(1, bytes)));

    // faces that precede the vertices are read behind them
    first = !strcmp(e->name, "face") && !f->t->nvert ? s->at : NULL;
    if (first && early)
      SB_SCAN_ERROR(s, "two elements 'face' before the vertices; write the vertices first");
    early = first ? e : early;
    begin = first ? first : begin;
    PetscCall(read_items(p, e, (PetscBool)!first, f));
  }
  if (early) {
    s->at = begin;
    PetscCall(read_items(p, early, PETSC_TRUE, f));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
