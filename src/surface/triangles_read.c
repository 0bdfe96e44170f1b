/*
  triangles_read.c - readers of .stl (text and binary), .obj and .off surfaces.

  Groups of bodies: the solids of a text STL file (solid_1, ... without a name), the objects (o) and
  groups (g) of an OBJ file.

  STL lists the three corners of each triangle; equal corners are merged later (clean.c). Normals in
  the file are ignored: the order of corners is the orientation. A file is binary if its size
  matches its number of triangles (80 bytes, the count, 50 bytes per triangle), whatever its first
  word is, or if it is larger and has a zero byte near its beginning; bytes after the triangles are
  then ignored with a warning. Keywords in text may be upper case, and `end solid` may be two words.
  OBJ: the lines v, f, o and g. OFF: text, also with colours, normals or texture coordinates (COFF,
  NOFF, STOFF). Faces with more than three corners are triangulated, see triangles_add.c.
*/
#include <ctype.h>
#include <stdlib.h>
#include <strings.h>
#include "surface_impl.h"

static PetscErrorCode add_vertex(SbScan *s, SbTriangleFile *f)
{
  PetscReal x[3];

  PetscFunctionBeginUser;
  PetscCall(SbScanPoint(s, "coordinate of a vertex", 0, x));
  PetscCall(SbTrianglesAddVertex(f, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether there is a next word; `end solid` becomes `endsolid`. */
static PetscBool stl_next(SbScan *s, char word[32])
{
  const PetscBool there = SbScanWord(s, 32, word);

  if (!strcasecmp(word, "end"))
    (void)SbScanWord(s, 32 - 3, word + 3);
  return there;
}

/* Reads one or more solids, which together are the surface. */
static PetscErrorCode stl_text(SbScan *s, SbTriangleFile *f)
{
  static const char *const facet[] = {"outer",  "loop",    "vertex",  "vertex",
                                      "vertex", "endloop", "endfacet"};
  char word[32];
  PetscInt nsolid = 0;
  PetscBool open = PETSC_FALSE;

  PetscFunctionBeginUser;

  /* padding bytes that some programs write at the end */
  while (s->end > s->at && (s->end[-1] == 0 || s->end[-1] == 0x1a))
    s->end--;
  while (stl_next(s, word) || !nsolid) {
    if (!nsolid && strcasecmp(word, "solid"))
      SB_SCAN_ERROR(
        s, "expected 'solid', and the size of the file is not that of a binary one: it is no STL "
           "file, or truncated");
    if (!strcasecmp(word, "solid")) {
      // the rest of the line is the name of the solid
      char name[SB_NAME_MAX], *last;
      const char *const names[1] = {name};
      const char *begin;

      nsolid++;
      open = PETSC_TRUE;
      (void)SbScanMore(s, '\n');
      begin = s->at;
      SbScanEndOfLine(s);
      (void)snprintf(name, sizeof(name), "%.*s",
                     (int)PetscMin(s->at - begin, (ptrdiff_t)sizeof(name) - 1), begin);
      for (last = name + strlen(name); last > name && isspace((unsigned char)last[-1]);)
        *--last = 0;
      if (!name[0])
        (void)snprintf(name, sizeof(name), "solid_%" PetscInt_FMT, nsolid);
      PetscCall(SbTrianglesGroups(f, 1, names));
    } else if (!strcasecmp(word, "endsolid")) {
      open = PETSC_FALSE;
      SbScanEndOfLine(s); /* repeated name */
    } else if (open && !strcasecmp(word, "facet")) {
      // the normal is ignored
      SbScanEndOfLine(s);
      for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(facet); k++) {
        if (!stl_next(s, word))
          SB_SCAN_ENDS(s, "'%s'", facet[k]);
        if (strcasecmp(word, facet[k]))
          SB_SCAN_ERROR(s, "expected '%s', found '%s'", facet[k], word);
        if (facet[k][0] == 'v')
          PetscCall(add_vertex(s, f));
      }
      PetscCall(
        SbTrianglesAdd(f, f->t->nvert - 3, f->t->nvert - 2, f->t->nvert - 1, f->t->ntri + 1));
    } else if (open && (!strcasecmp(word, "color") || !strcasecmp(word, "attribute"))) {
      PetscCall(SbImportSkip(f->im, "lines %s", word));
      SbScanEndOfLine(s);
    } else
      SB_SCAN_ERROR(s, "expected 'facet' or 'endsolid', found '%s'", word);
  }
  if (open && !f->t->ntri)
    SB_SCAN_ENDS(s, "'%s'", "endsolid");
  if (open)
    PetscCall(SbWarning(PETSC_COMM_SELF,
                        "%s: the last solid has no endsolid; the file may be truncated", f->where));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_STL(SbScan *s, SbTriangleFile *f)
{
  const size_t size = (size_t)(s->end - s->data);
  double n = 0;
  size_t known;

  PetscFunctionBeginUser;
  if (size >= 84)
    SbNumbersConvert((SbNumberType){'u', 4}, PETSC_FALSE, 1, s->data + 80, &n);
  known = 84 + 50 * (size_t)n;
  if (size != known && !(size > known && n > 0 && memchr(s->data, 0, PetscMin(known, 134)))) {
    PetscCall(stl_text(s, f));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (size > known)
    PetscCall(SbWarning(PETSC_COMM_SELF, "%s: %zu bytes behind the %.0f triangles are left out",
                        f->where, size - known, n));

  // binary: 84 bytes, then 50 per triangle: normal, three vertices, 2 bytes
  s->bytes = PETSC_TRUE;
  for (size_t at = 84; at < known; at += 50) {
    double x[9];

    SbNumbersConvert((SbNumberType){'f', 4}, PETSC_FALSE, 9, s->data + at + 12, x);
    for (int k = 0; k < 9; k++) {
      s->token = s->data + at + 12 + 4 * k;
      if (!isfinite(x[k]))
        SB_SCAN_ERROR(s, "a coordinate of triangle %lld is not a finite number; repair the file",
                      (long long)f->t->ntri + 1);
      if (k % 3 == 2)
        PetscCall(SbTrianglesAddVertex(f, x + k - 2));
    }
    PetscCall(SbTrianglesAdd(f, f->t->nvert - 3, f->t->nvert - 2, f->t->nvert - 1, f->t->ntri + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Curved surfaces of an OBJ file, whose shape no line of vertices gives, and a file within it. */
static PetscErrorCode obj_other(SbScan *s, const char *word, SbTriangleFile *f)
{
  static const char *const curved[] = {"curv", "curv2", "surf", "bsp", "bzp", "cdc", "cdp"};

  PetscFunctionBeginUser;
  if (!strcmp(word, "call") || !strcmp(word, "csh"))
    SB_SCAN_ERROR(s, "the line '%s' calls another file; put all into one", word);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(curved); i++)
    if (!strcmp(word, curved[i]))
      PetscCall(SbImportSkip(f->im, "curved lines and surfaces (%s)", word));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Joins lines that end with a backslash to the next ones: a tabulator that positions count as the
   end of a line. */
static void join_lines(SbScan *s)
{
  for (char *p = s->data; p < s->end; p++) {
    const size_t n = p + 1 < s->end && p[1] == '\r' ? 2 : 1;

    if (*p != '\\' || p + n >= s->end || p[n] != '\n')
      continue;
    memset(p, ' ', n);
    p[n] = '\v';
  }
}

PetscErrorCode SbTrianglesRead_OBJ(SbScan *s, SbTriangleFile *f)
{
  int64_t nface = 0;
  char name[9][SB_NAME_MAX],
    more[SB_NAME_MAX]; /* the object (o), then the groups (g) of what follows */
  PetscInt nname[2] = {0, 0};
  char word[16];

  PetscFunctionBeginUser;
  join_lines(s);
  while (SbScanWord(s, sizeof(word), word)) {
    if (!strcmp(word, "v"))
      PetscCall(add_vertex(s, f));
    PetscCall(obj_other(s, word, f));

    /* the rest of a line f: vertex numbers from 1, or negative ones counted back from the last
       vertex; indices after a slash are ignored */
    if (!strcmp(word, "f") || !strcmp(word, "fo")) {
      nface++;
      while (SbScanMore(s, '#')) {
        char *after;
        const long long v = strtoll(s->at, &after, 10);

        if (after == s->at || v == 0 || (*after && !strchr("/ \t\v\r\n", *after)))
          SB_SCAN_ERROR(s, "expected the number of a vertex, not zero");
        for (s->at = after; s->at < s->end && !strchr(" \t\v\r\n", *s->at);)
          s->at++;
        PetscCall(SbTrianglesAddCorner(s, nface, v > 0 ? v - 1 : f->t->nvert + v, f));
      }
      PetscCall(SbTrianglesAddFace(s, nface, f));
    }
    if (!strcmp(word, "g") || !strcmp(word, "o")) {
      const int kind = word[0] == 'g'; /* at most one object and eight groups */
      const char *all[9];
      PetscInt n = 0;

      for (nname[kind] = 0; SbScanMore(s, '\n');) {
        const PetscBool room = (PetscBool)(nname[kind] < (kind ? 8 : 1));

        (void)SbScanWord(s, SB_NAME_MAX, room ? name[kind + nname[kind]] : more);
        nname[kind] += room;
      }
      if (nname[0])
        all[n++] = name[0];
      for (PetscInt i = 0; i < nname[1]; i++)
        all[n++] = name[1 + i];
      PetscCall(SbTrianglesGroups(f, n, all));
    }
    SbScanEndOfLine(s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesRead_OFF(SbScan *s, SbTriangleFile *f)
{
  int64_t nvert, nface, nedge;
  char word[16];
  const char *type = word;
  const char *at;

  PetscFunctionBeginUser;
  s->comment = '#';

  // OFF; before it ST, C, N where vertices have more values, which stand behind the coordinates;
  // the word may be missing
  at = s->at;
  (void)SbScanWord(s, sizeof(word), word);
  type += strncmp(type, "ST", 2) ? 0 : 2;
  type += *type == 'C';
  type += *type == 'N';
  if (isdigit((unsigned char)word[0]) && !strchr(word, 'O'))
    s->at = at;
  else if (strcmp(type, "OFF"))
    SB_SCAN_ERROR(s,
                  "expected 'OFF' (or COFF, NOFF, STOFF), found '%s'; it is no OFF file of points "
                  "with three coordinates",
                  word);
  at = s->at;
  if (SbScanWord(s, sizeof(word), word) && !strcasecmp(word, "BINARY"))
    SB_SCAN_ERROR(s, "a binary OFF file; write it as text");
  s->at = at;
  PetscCall(SbScanCount(s, "vertices", 6, 6, &nvert));
  PetscCall(SbScanCount(s, "faces", 8, 8, &nface));
  PetscCall(SbScanText(s, "number of edges", &nedge));
  for (int64_t i = 0; i < nvert; i++) {
    PetscCall(add_vertex(s, f));
    SbScanEndOfLine(s);
  }
  for (int64_t i = 0; i < nface; i++) {
    int64_t n, v;

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
