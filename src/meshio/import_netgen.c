/*
  import_netgen.c - reader of Netgen's meshes: .vol, and the neutral format (Netgen manual, "Export
  formats", and files written by Netgen 4 to 6).

  Neutral format: number of points, coordinates; number of tets, each with its subdomain and four
  points; number of surface triangles, each with its boundary condition and three points. Points
  count from 1. A # begins a comment.

  .vol: sections in any order: a word on a line of its own, a count, and that many lines; "surfnr
  bcnr domin domout np p1 p2 p3" for a surface element, "matnr np p1 p2 p3 p4" for a volume element.

  Kept: subdomain or material N is volume_N, boundary condition N is surface_N; the sections
  materials and bcnames of .vol give them names. Curves (edgesegments) are ignored. Second-order
  tets have 10 points and triangles 6, in both formats. Errors: other elements.
*/
#include <ctype.h>
#include "meshio_impl.h"

static PetscErrorCode read_points(SbImport *im)
{
  SbScan *s = &im->scan;
  int64_t n;

  PetscFunctionBeginUser;
  PetscCall(SbScanCount(s, "points", 6, 6, &n));
  PetscCall(SbImportSetVertices(im, (PetscInt)n));
  for (PetscInt v = 0; v < n; v++) {
    PetscCall(SbScanPoint(s, "coordinate", v + 1, im->x + 3 * v));
    SbScanEndOfLine(s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An element line: numbers before the points, among them the group and, in .vol, the number of
   points. */
typedef struct {
  int dim, room; /* dimension; least number of bytes per line */
  int mark,
    nnode; /* positions of group and number of points; nnode -1: all other words are points */
  const char *before[5];
} Layout;

static const Layout neutral_volume = {3, 10, 0, -1, {"subdomain of an element"}};
static const Layout neutral_surface = {2, 8, 0, -1, {"boundary condition of an element"}};
static const Layout vol_volume = {
  3, 12, 0, 1, {"material of an element", "number of points of an element"}};
static const Layout vol_surface = {
  2,
  16,
  1,
  4,
  {"surface of an element", "boundary condition of an element", "domain on one side of an element",
   "domain on the other side of an element", "number of points of an element"}};

static PetscErrorCode read_elements(SbImport *im, const Layout *l)
{
  SbScan *s = &im->scan;

  /* positions of the nodes in gmsh's order; edges 01 02 03 12 13 23 */
  static const int place[10] = {0, 1, 2, 3, 4, 6, 7, 5, 9, 8};
  int64_t n, value[5], nnode, point;
  PetscInt vert[10];

  PetscFunctionBeginUser;
  PetscCall(
    SbScanCount(s, l->dim == 3 ? "volume elements" : "surface elements", l->room, l->room, &n));
  for (int64_t i = 0; i < n; i++) {
    const char *at, *token;
    int type = SB_GMSH_LINE;
    PetscInt tags = 0;

    for (int k = 0; k < 5 && l->before[k]; k++)
      PetscCall(SbScanText(s, l->before[k], &value[k]));

    // number of points: given, or the number of words on the rest of the line
    nnode = l->nnode < 0 ? 0 : value[l->nnode];
    for (at = s->at, token = s->token; l->nnode < 0 && SbScanMore(s, '#'); nnode++)
      while (s->at < s->end && !isspace((unsigned char)*s->at))
        s->at++;
    s->at = at;
    s->token = token;
    while (type < SB_GMSH_NTYPES &&
           (SbGmshTypes[type].dim != l->dim || SbGmshTypes[type].nnode != nnode))
      type++;
    if (type == SB_GMSH_NTYPES)
      SB_SCAN_ERROR(s, "a %s element of %lld points; expected %d or %d",
                    l->dim == 3 ? "volume" : "surface", (long long)nnode, l->dim + 1,
                    l->dim == 3 ? 10 : 6);
    for (int k = 0; k < nnode; k++) {
      PetscCall(SbScanText(s, "point of an element", &point));
      if (point < 1 || point > im->nvert)
        SB_SCAN_ERROR(s, "element %lld uses point %lld of %lld", (long long)i + 1, (long long)point,
                      (long long)im->nvert);
      if (k < 10)
        vert[place[k]] = (PetscInt)(point - 1);
    }
    if (SbGmshIsSimplex(type))
      PetscCall(SbImportTagsAlone(im, l->dim, value[l->mark], NULL, &tags));
    PetscCall(SbImportAddElement(im, type, vert, tags, i + 1));
    SbScanEndOfLine(s);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_NetgenNeutral(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  s->comment = '#';
  PetscCall(read_points(im));
  PetscCall(read_elements(im, &neutral_volume));
  SbScanNext(s);
  if (s->at < s->end)
    PetscCall(read_elements(im, &neutral_surface));
  PetscCall(SbImportCheckTypes(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Goes behind the line that consists of this word; false if there is none. */
static PetscBool find_section(SbScan *s, const char *name)
{
  const char *token = s->token;
  const size_t n = strlen(name);

  for (s->at = s->data; s->at < s->end; SbScanEndOfLine(s)) {
    (void)SbScanMore(s, '\n');
    if (strncmp(s->at, name, n) || (s->at + n < s->end && !isspace((unsigned char)s->at[n])))
      continue;
    s->at = s->token = s->at + n;
    return PETSC_TRUE;
  }
  s->token = token;
  return PETSC_FALSE;
}

/* Reads lines of a number and a name, which may contain blanks. Numbers without elements are
   ignored. */
static PetscErrorCode read_names(SbImport *im, const char *section, PetscInt dim)
{
  SbScan *s = &im->scan;
  int64_t n, number;

  PetscFunctionBeginUser;
  if (!find_section(s, section))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbScanCount(s, "names", 2, 2, &n));
  for (int64_t i = 0; i < n; i++) {
    char name[SB_GROUP_MAX];

    PetscCall(SbScanText(s, "number of a name", &number));
    PetscCall(SbScanRestOfLine(s, sizeof(name), name));
    if (name[0])
      SbImportNameGroup(im, dim, number, name);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbImportRead_Netgen(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  char word[32];

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  s->comment = '#';
  (void)SbScanWord(s, sizeof(word), word);
  if (strcmp(word, "mesh3d"))
    SB_SCAN_ERROR(s, "expected 'mesh3d', found '%s'; this is no mesh of Netgen", word);
  if (!find_section(s, "points"))
    SB_SCAN_ERROR(s, "there is no section 'points'; the file is truncated or damaged");
  PetscCall(read_points(im));
  if (find_section(s, "volumeelements"))
    PetscCall(read_elements(im, &vol_volume));

  /* Netgen appends a suffix to the section name if the lines have more columns */
  if (find_section(s, "surfaceelements") || find_section(s, "surfaceelementsgi") ||
      find_section(s, "surfaceelementsuv"))
    PetscCall(read_elements(im, &vol_surface));
  PetscCall(read_names(im, "materials", 3));
  PetscCall(read_names(im, "bcnames", 2));
  PetscCall(SbImportCheckTypes(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
