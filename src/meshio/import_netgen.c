/*
  import_netgen.c - reader of Netgen's meshes: .vol, and the neutral format (Netgen manual, "Export formats", and what Netgen 4 to 6
  writes).

  Neutral: the number of points, their coordinates; the number of tets, each with its subdomain and four points; the number of
  surface triangles, each with its boundary condition and three points. Points count from 1. A # begins a comment.

  .vol: sections, each a word on a line of its own, a count, and that many lines; "surfnr bcnr domin domout np p1 p2 p3" for a surface
  element, "matnr np p1 p2 p3 p4" for a volume element. Sections come in any order, hence each is searched for.

  Kept: subdomain or material N is volume_N, boundary condition N is surface_N; the sections materials and bcnames of .vol give
  them names. Curves (edgesegments) are left out. Refused: elements of more nodes.
*/
#include <ctype.h>
#include "gmsh_types.h"

typedef struct {
  SbScan scan;
  SbImport *im;
  int64_t count[SB_GMSH_NTYPES];
} Netgen;

enum {
  QUAD = 3,
  HEX = 5,
  PRISM = 6,
  PYRAMID = 7,
  TRIANGLE6 = 9,
  TET10 = 11,
  HEX20 = 17,
  PRISM15 = 18,
  PYRAMID13 = 19
};

/* Type of an element by its dimension and number of nodes; 0 when there is none. */
static int type_of(int dim, int64_t nnode)
{
  static const struct {
    int dim, nnode, type;
  } types[] = {{2, 3, SB_GMSH_TRIANGLE}, {2, 4, QUAD},     {2, 6, TRIANGLE6}, {3, 4, SB_GMSH_TET},
               {3, 5, PYRAMID},          {3, 6, PRISM},    {3, 8, HEX},       {3, 10, TET10},
               {3, 13, PYRAMID13},       {3, 15, PRISM15}, {3, 20, HEX20}};

  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(types); i++) {
    if (types[i].dim == dim && types[i].nnode == nnode) return types[i].type;
  }
  return 0;
}

static PetscErrorCode read_points(Netgen *g)
{
  SbScan *s = &g->scan;
  int64_t n;

  PetscFunctionBeginUser;
  SbScanNext(s, '#');
  PetscCall(SbScanText(s, "number of points", &n));
  PetscCall(SbScanRoom(s, "points", n, 6, 6));
  PetscCall(SbImportSetVertices(g->im, (PetscInt)n));
  for (PetscInt v = 0; v < n; v++) {
    g->im->vert_number[v] = v + 1;
    SbScanNext(s, '#');
    PetscCall(SbScanPoint(s, "coordinate", v + 1, g->im->x + 3 * v));
    PetscCall(SbScanEndOfLine(s));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The nodes of one element, and the element when it is of use. */
static PetscErrorCode read_element(Netgen *g, int dim, int64_t nnode, int64_t mark, int64_t number)
{
  SbScan *s = &g->scan;
  const int type = type_of(dim, nnode);
  PetscInt vert[4], tags;
  int64_t point;

  PetscFunctionBeginUser;
  if (!type)
    SB_SCAN_ERROR(s, "a %s element of %lld points; expected %d", dim == 3 ? "volume" : "surface",
                  (long long)nnode, dim + 1);
  for (int i = 0; i < nnode; i++) {
    PetscCall(SbScanText(s, "point of an element", &point));
    if (point < 1 || point > g->im->nvert)
      SB_SCAN_ERROR(s, "element %lld uses point %lld of %lld", (long long)number, (long long)point,
                    (long long)g->im->nvert);
    if (i < 4) vert[i] = (PetscInt)(point - 1);
  }
  g->count[type]++;
  if (type == SB_GMSH_TET || type == SB_GMSH_TRIANGLE) {
    PetscCall(SbImportTagsAlone(g->im, dim, mark, NULL, &tags));
    PetscCall(SbImportAddItem(g->im, dim, vert, tags, number));
  }
  PetscCall(SbScanEndOfLine(s));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ neutral format */

/* Words on the rest of this line; stays where it is. */
static int words_left(SbScan *s)
{
  const char *at = s->at, *token = s->token;
  int n = 0;

  for (; SbScanMore(s, '#'); n++) {
    while (s->at < s->end && !isspace((unsigned char)*s->at)) s->at++;
  }
  s->at = at;
  s->token = token;
  return n;
}

static PetscErrorCode read_neutral_elements(Netgen *g, int dim, const char *what)
{
  SbScan *s = &g->scan;
  int64_t n, mark;

  PetscFunctionBeginUser;
  SbScanNext(s, '#');
  PetscCall(SbScanText(s, what, &n));
  PetscCall(SbScanRoom(s, dim == 3 ? "volume elements" : "surface elements", n, 2 * dim + 4, 2 * dim + 4));
  for (int64_t i = 0; i < n; i++) {
    SbScanNext(s, '#');
    PetscCall(
      SbScanText(s, dim == 3 ? "subdomain of an element" : "boundary condition of an element", &mark));
    PetscCall(read_element(g, dim, words_left(s), mark, i + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_neutral(const char *path, Netgen *g)
{
  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(g->im->where, path, &g->scan));
  PetscCall(read_points(g));
  PetscCall(read_neutral_elements(g, 3, "number of volume elements"));
  SbScanNext(&g->scan, '#');
  if (g->scan.at < g->scan.end) PetscCall(read_neutral_elements(g, 2, "number of surface elements"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ .vol */

/* To what follows the line that holds only this word; false when there is none. */
static PetscBool find_section(SbScan *s, const char *name)
{
  const size_t n = strlen(name);
  const char *p = s->data;

  while (p && p < s->end) {
    const char *line = p;

    while (p < s->end && (*p == ' ' || *p == '\t')) p++;
    if ((size_t)(s->end - p) >= n && !strncmp(p, name, n) &&
        (p + n == s->end || isspace((unsigned char)p[n]))) {
      s->at = s->token = p + n;
      return PETSC_TRUE;
    }
    p = (const char *)memchr(line, '\n', (size_t)(s->end - line));
    if (p) p++;
  }
  return PETSC_FALSE;
}

static PetscErrorCode read_volume_elements(Netgen *g)
{
  SbScan *s = &g->scan;
  int64_t n, material, nnode;

  PetscFunctionBeginUser;
  if (!find_section(s, "volumeelements")) PetscFunctionReturn(PETSC_SUCCESS);
  SbScanNext(s, '#');
  PetscCall(SbScanText(s, "number of volume elements", &n));
  PetscCall(SbScanRoom(s, "volume elements", n, 12, 12));
  for (int64_t i = 0; i < n; i++) {
    SbScanNext(s, '#');
    PetscCall(SbScanText(s, "material of an element", &material));
    PetscCall(SbScanText(s, "number of points of an element", &nnode));
    PetscCall(read_element(g, 3, nnode, material, i + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Netgen writes the word with an ending that tells what else stands at the end of the lines. */
static PetscErrorCode read_surface_elements(Netgen *g)
{
  SbScan *s = &g->scan;
  int64_t n, surface, condition, domain, nnode;

  PetscFunctionBeginUser;
  if (!find_section(s, "surfaceelements") && !find_section(s, "surfaceelementsgi") &&
      !find_section(s, "surfaceelementsuv"))
    PetscFunctionReturn(PETSC_SUCCESS);
  SbScanNext(s, '#');
  PetscCall(SbScanText(s, "number of surface elements", &n));
  PetscCall(SbScanRoom(s, "surface elements", n, 16, 16));
  for (int64_t i = 0; i < n; i++) {
    SbScanNext(s, '#');
    PetscCall(SbScanText(s, "surface of an element", &surface));
    PetscCall(SbScanText(s, "boundary condition of an element", &condition));
    PetscCall(SbScanText(s, "domain on one side of an element", &domain));
    PetscCall(SbScanText(s, "domain on the other side of an element", &domain));
    PetscCall(SbScanText(s, "number of points of an element", &nnode));
    PetscCall(read_element(g, 2, nnode, condition, i + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lines of a number and a name, which may hold blanks. Numbers that no element has are left out. */
static PetscErrorCode read_names(Netgen *g, const char *section, PetscInt dim)
{
  SbScan *s = &g->scan;
  const PetscInt known = g->im->ngroup;
  int64_t n, number;
  PetscInt group;

  PetscFunctionBeginUser;
  if (!find_section(s, section)) PetscFunctionReturn(PETSC_SUCCESS);
  SbScanNext(s, '#');
  PetscCall(SbScanText(s, "number of names", &n));
  PetscCall(SbScanRoom(s, "names", n, 2, 2));
  for (int64_t i = 0; i < n; i++) {
    char name[SB_GROUP_MAX];
    size_t length = 0;

    SbScanNext(s, '#');
    PetscCall(SbScanText(s, "number of a name", &number));
    if (!SbScanMore(s, '\n')) continue; /* it has no name */
    for (; s->at < s->end && *s->at != '\n'; s->at++) {
      if (length + 1 >= sizeof(name))
        SB_SCAN_ERROR(s, "the name is longer than %zu characters", sizeof(name) - 1);
      name[length++] = isprint((unsigned char)*s->at) ? *s->at : ' ';
    }
    while (length && name[length - 1] == ' ') length--;
    name[length] = 0;
    for (group = 0; group < known; group++) {
      if (g->im->group[group].dim == dim && g->im->group[group].tag == number)
        PetscCall(PetscStrncpy(g->im->group[group].name, name, SB_GROUP_MAX));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode read_vol(const char *path, Netgen *g)
{
  SbScan *s = &g->scan;
  char word[32];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(g->im->where, path, s));
  SbScanNext(s, '#');
  PetscCall(SbScanWord(s, sizeof(word), word));
  if (strcmp(word, "mesh3d"))
    SB_SCAN_ERROR(s, "expected 'mesh3d', found '%s'; this is no mesh of Netgen", word);
  if (!find_section(s, "points"))
    SB_SCAN_ERROR(s, "there is no section 'points'; the file is truncated or damaged");
  PetscCall(read_points(g));
  PetscCall(read_volume_elements(g));
  PetscCall(read_surface_elements(g));
  PetscCall(read_names(g, "materials", 3));
  PetscCall(read_names(g, "bcnames", 2));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ files */

static PetscErrorCode with_file(const char *path, PetscErrorCode (*read)(const char *, Netgen *),
                                SbImport *im)
{
  Netgen g;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&g, sizeof(g)));
  g.im = im;
  ierr = (*read)(path, &g);
  if (!ierr) ierr = SbGmshCheckTypes(im, g.count);
  PetscCall(SbScanClose(&g.scan));
  PetscFunctionReturn(ierr);
}

PetscErrorCode SbImportRead_Netgen(const char *path, SbImport *im)
{
  return with_file(path, read_vol, im);
}

PetscErrorCode SbImportRead_NetgenNeutral(const char *path, SbImport *im)
{
  return with_file(path, read_neutral, im);
}
