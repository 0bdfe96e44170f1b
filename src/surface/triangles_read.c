/*
  triangles_read.c - readers of .stl (text and binary), .obj and .off surfaces.

  Groups of bodies: the solids of a text STL file (solid_1, ... without a name), the objects (o) and groups (g) of an OBJ file.

  STL lists the three corners of each triangle; equal corners are merged later (clean.c). Normals in the file are
  ignored: the order of corners is the orientation. A file is binary if its size matches its number of triangles (80 bytes, the count,
  50 bytes per triangle), whatever its first word is, or if it is larger and has a zero byte near its beginning; bytes
  after the triangles are then ignored with a warning. Keywords in text may be upper case, and `end solid` may be two words. OBJ: the lines v, f, o and g. OFF: the basic format. Faces with more
  than three corners are triangulated, see triangles_add.c.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "triangles.h"

/* ------------------------------------------------------------------ STL */

static uint32_t little(const char *p)
{
  const unsigned char *b = (const unsigned char *)p;

  return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* Reads the next word; `end solid` becomes `endsolid`. */
static PetscErrorCode stl_next(SbScan *s, char word[32])
{
  PetscFunctionBeginUser;
  PetscCall(SbScanWord(s, 32, word));
  if (!strcasecmp(word, "end")) PetscCall(SbScanWord(s, 32 - 3, word + 3));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode stl_word(SbScan *s, const char *wanted)
{
  char word[32];

  PetscFunctionBeginUser;
  PetscCall(stl_next(s, word));
  if (!word[0])
    SB_SCAN_ERROR(s, "the file ends where '%s' is expected; it is truncated, write or copy it again", wanted);
  if (strcasecmp(word, wanted)) SB_SCAN_ERROR(s, "expected '%s', found '%s'", wanted, word);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Reads one or more solids, which together are the surface. */
static PetscErrorCode stl_text(SbScan *s, SbTriangleFile *f)
{
  char word[32];
  PetscInt nsolid = 0;

  PetscFunctionBeginUser;
  /* padding bytes that some programs write at the end */
  while (s->end > s->at && (s->end[-1] == 0 || s->end[-1] == 0x1a)) s->end--;
  PetscCall(stl_next(s, word));
  if (strcasecmp(word, "solid"))
    SB_SCAN_ERROR(s, "expected 'solid', and the size of the file is not that of a binary one: it is no STL "
                     "file, or truncated");
  for (PetscBool open = PETSC_TRUE; word[0];) {
    // the rest of the line is the name of the solid
    if (!strcasecmp(word, "solid")) {
      char name[SB_NAME_MAX], *last;
      const char *const names[1] = {name};
      const char *end;

      nsolid++;
      while (s->at < s->end && (*s->at == ' ' || *s->at == '\t')) s->at++;
      end = (const char *)memchr(s->at, '\n', (size_t)(s->end - s->at));
      if (!end) end = s->end;
      (void)snprintf(name, sizeof(name), "%.*s", (int)PetscMin(end - s->at, (ptrdiff_t)sizeof(name) - 1),
                     s->at);
      for (last = name + strlen(name); last > name && isspace((unsigned char)last[-1]);) *--last = 0;
      if (!name[0]) (void)snprintf(name, sizeof(name), "solid_%" PetscInt_FMT, nsolid);
      PetscCall(SbTrianglesGroups(f, 1, names));
      SbScanEndOfLine(s);
    }
    if (!strcasecmp(word, "endsolid")) SbScanEndOfLine(s); /* repeated name */
    // a facet: normal (ignored), three vertices
    if (open && !strcasecmp(word, "facet")) {
      SbScanEndOfLine(s); /* normal */
      PetscCall(stl_word(s, "outer"));
      PetscCall(stl_word(s, "loop"));
      for (int k = 0; k < 3; k++) {
        PetscReal x[3];

        PetscCall(stl_word(s, "vertex"));
        PetscCall(SbScanPoint(s, "coordinate of a vertex", 0, x));
        PetscCall(SbTrianglesAddVertex(f, x));
      }
      PetscCall(stl_word(s, "endloop"));
      PetscCall(stl_word(s, "endfacet"));
      PetscCall(SbTrianglesAdd(f, f->t->nvert - 3, f->t->nvert - 2, f->t->nvert - 1, f->t->ntri + 1));
    }
    PetscCall(stl_next(s, word));
    if (!strcasecmp(word, "endsolid"))
      open = PETSC_FALSE;
    else if (!strcasecmp(word, "solid"))
      open = PETSC_TRUE;
    else if (word[0] && (!open || strcasecmp(word, "facet")))
      SB_SCAN_ERROR(s, "expected 'facet' or 'endsolid', found '%s'", word);
    if (!word[0] && open)
      SB_SCAN_ERROR(s, "the file ends where 'endsolid' is expected; it is truncated, write or copy it again");
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_STL(SbScan *s, SbTriangleFile *f)
{
  const size_t size = (size_t)(s->end - s->data);
  const uint32_t n = size >= 84 ? little(s->data + 80) : 0;
  const size_t known = 84 + 50 * (size_t)n;

  PetscFunctionBeginUser;
  if (size == known || (size > known && n && memchr(s->data, 0, PetscMin(known, 134)))) {
    if (size > known)
      PetscCall(SbWarning(PETSC_COMM_SELF, "%s: %zu bytes behind the %lld triangles are left out", f->where,
                          size - known, (long long)n));
    // binary: 84 bytes, then 50 per triangle: normal, three vertices, 2 bytes
    s->bytes = PETSC_TRUE;
    for (uint32_t i = 0; i < n; i++) {
      for (int k = 0; k < 3; k++) {
        PetscReal x[3];

        for (int c = 0; c < 3; c++) {
          const uint32_t bits = little(s->token = s->data + 84 + 50 * (size_t)i + 12 + 12 * k + 4 * c);
          float value;

          memcpy(&value, &bits, sizeof(value));
          x[c] = (PetscReal)value;
          if (!isfinite(x[c]))
            SB_SCAN_ERROR(s, "a coordinate of triangle %lld is not a finite number; repair the file",
                          (long long)i + 1);
        }
        PetscCall(SbTrianglesAddVertex(f, x));
      }
      PetscCall(SbTrianglesAdd(f, f->t->nvert - 3, f->t->nvert - 2, f->t->nvert - 1, f->t->ntri + 1));
    }
  } else
    PetscCall(stl_text(s, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ OBJ and OFF */

static PetscErrorCode add_vertex(SbScan *s, SbTriangleFile *f)
{
  PetscReal x[3];

  PetscFunctionBeginUser;
  PetscCall(SbScanPoint(s, "coordinate of a vertex", 0, x));
  PetscCall(SbTrianglesAddVertex(f, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_OBJ(SbScan *s, SbTriangleFile *f)
{
  int64_t nface = 0;
  struct { /* names of the object (o) and the groups (g) of the faces that follow */
    char object[SB_NAME_MAX], group[8][SB_NAME_MAX];
    PetscInt ngroup;
  } names;
  char word[16];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&names, sizeof(names)));
  for (;;) {
    PetscCall(SbScanWord(s, sizeof(word), word));
    if (!word[0]) break;
    if (!strcmp(word, "v")) PetscCall(add_vertex(s, f));
    /* the rest of a line f: vertex numbers from 1, or negative ones counted back from the last vertex; indices
       after a slash are ignored */
    if (!strcmp(word, "f")) {
      int64_t number = ++nface;

      for (;;) {
        char *after;
        long long v;

        if (!SbScanMore(s, '#')) break;
        v = strtoll(s->at, &after, 10);
        if (after == s->at || v == 0 || (*after && !strchr("/ \t\r\n", *after)))
          SB_SCAN_ERROR(s, "expected the number of a vertex, not zero");
        for (s->at = after; s->at < s->end && !strchr(" \t\r\n", *s->at);) s->at++;
        PetscCall(SbTrianglesAddCorner(s, number, v > 0 ? v - 1 : f->t->nvert + v, f));
      }
      PetscCall(SbTrianglesAddFace(s, number, f));
    }
    if (!strcmp(word, "g") || !strcmp(word, "o")) {
      const PetscBool object = (PetscBool)(word[0] == 'o');
      const char *all[9];
      PetscInt n = 0;

      if (object)
        names.object[0] = 0;
      else
        names.ngroup = 0;
      for (;;) {
        char name[SB_NAME_MAX];

        if (!SbScanMore(s, '\n')) break;
        PetscCall(SbScanWord(s, sizeof(name), name));
        if (!object && names.ngroup < 8)
          PetscCall(PetscStrncpy(names.group[names.ngroup++], name, SB_NAME_MAX));
        if (object && !names.object[0]) PetscCall(PetscStrncpy(names.object, name, SB_NAME_MAX));
      }
      if (names.object[0]) all[n++] = names.object;
      for (PetscInt i = 0; i < names.ngroup; i++) all[n++] = names.group[i];
      PetscCall(SbTrianglesGroups(f, n, all));
    }
    SbScanEndOfLine(s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_OFF(SbScan *s, SbTriangleFile *f)
{
  int64_t count[3];
  char word[16];

  PetscFunctionBeginUser;
  SbScanNext(s, '#');
  PetscCall(SbScanWord(s, sizeof(word), word));
  if (strcmp(word, "OFF"))
    SB_SCAN_ERROR(s, "expected 'OFF', found '%s'; only the plain text kind of OFF file is read", word);
  for (int i = 0; i < 3; i++) {
    SbScanNext(s, '#');
    PetscCall(SbScanText(s, "number of vertices, faces and edges", &count[i]));
  }
  PetscCall(SbScanRoom(s, "vertices", count[0], 6, 6));
  PetscCall(SbScanRoom(s, "faces", count[1], 8, 8));
  for (int64_t i = 0; i < count[0]; i++) {
    SbScanNext(s, '#');
    PetscCall(add_vertex(s, f));
    SbScanEndOfLine(s);
  }
  for (int64_t i = 0; i < count[1]; i++) {
    int64_t n, v;

    SbScanNext(s, '#');
    PetscCall(SbScanText(s, "number of corners of a face", &n));
    for (int64_t k = 0; k < n; k++) {
      PetscCall(SbScanText(s, "vertex of a face", &v));
      PetscCall(SbTrianglesAddCorner(s, i + 1, v, f));
    }
    PetscCall(SbTrianglesAddFace(s, i + 1, f));
    SbScanEndOfLine(s); /* colours */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
