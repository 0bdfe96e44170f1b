/*
  import_medit.c - reader of Medit's text files, .mesh ("MEDIT: an interactive mesh visualization
  software", P. Frey, INRIA RT-0253, 2001), also written by mmg, CGAL and FreeFEM.

  A keyword is followed by a count and that many lines of numbers, the last one a reference: N gives
  the group volume_N, surface_N or curve_N, 0 none except for tets. A # begins a comment. Other
  keywords (Corners, Ridges, Normals, Required...) are skipped with their numbers. Elements may come
  before their vertices. Errors: binary
  files (.meshb), volume elements other than tets of 4 or 10 nodes.
*/
#include <ctype.h>
#include "meshio_impl.h"

#define MOST_EARLY 32 /* sections of elements before the vertices */

/* Keywords of elements, and gmsh's element types. */
static const struct {
  const char *word;
  int type;
} elements[] = {{"Tetrahedra", 4},    {"Triangles", 2},   {"Edges", 1},  {"Quadrilaterals", 3},
                {"Hexahedra", 5},     {"Hexaedra", 5},    {"Prisms", 6}, {"Pyramids", 7},
                {"TetrahedraP2", 11}, {"TrianglesP2", 9}, {"EdgesP2", 8}};

static PetscErrorCode read_elements(SbImport *im, int type)
{
  SbScan *s = &im->scan;
  const int dim = SbGmshTypes[type].dim;
  const int nnode = SbGmshTypes[type].nnode;
  int64_t n, point, reference;
  PetscInt vert[10];

  PetscFunctionBeginUser;
  if (!im->x)
    SB_SCAN_ERROR(s, "elements, and no section Vertices");
  PetscCall(SbScanCount(s, SbGmshTypes[type].name, 2 * nnode, 2 * nnode, &n));
  for (int64_t i = 0; i < n; i++) {
    PetscInt tags = 0;

    for (int k = 0; k < nnode; k++) {
      PetscCall(SbScanText(s, "vertex of an element", &point));
      if (point < 1 || point > im->nvert)
        SB_SCAN_ERROR(s, "element %lld uses vertex %lld of %lld", (long long)i + 1,
                      (long long)point, (long long)im->nvert);
      if (k < 10)
        vert[SbGmshNode(k)] = (PetscInt)(point - 1);
    }
    PetscCall(SbScanText(s, "reference of an element", &reference));
    if (SbGmshIsSimplex(type) && (reference || dim == 3))
      PetscCall(SbImportTagsAlone(im, dim, reference, NULL, &tags));
    PetscCall(SbImportAddElement(im, type, vert, tags, i + 1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sections of volume elements of other kinds or orders begin with these words. */
static const char *const solids[] = {"Tetrahedra", "Hexahedra", "Prism", "Pyramid", "Polyhedra"};

PetscErrorCode SbImportRead_Medit(const char *path, SbImport *im)
{
  SbScan *s = &im->scan;
  char word[32];
  int64_t n, dimension;
  PetscReal reference;
  struct {
    const char *at;
    int type;
  } early[MOST_EARLY]; /* sections of elements before the vertices */
  int nearly = 0;

  PetscFunctionBeginUser;
  PetscCall(SbScanOpen(im->where, path, s));
  s->comment = '#';
  SbScanNext(s);

  // a neutral file of Netgen, which has the same extension, begins with a number
  if (s->at < s->end && isdigit((unsigned char)*s->at)) {
    PetscCall(PetscFree(s->data));
    PetscCall(SbImportRead_NetgenNeutral(path, im));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  (void)SbScanWord(s, sizeof(word), word);
  if (strcmp(word, "MeshVersionFormatted"))
    SB_SCAN_ERROR(s, "expected 'MeshVersionFormatted', found '%s'; this is no text file of Medit",
                  word);
  for (;;) {
    PetscBool known = PETSC_FALSE;

    // skip other sections: go to the next word that is not a number
    for (SbScanNext(s); s->at < s->end && !isalpha((unsigned char)*s->at); SbScanNext(s))
      while (s->at < s->end && !isspace((unsigned char)*s->at))
        s->at++;
    if (!SbScanWord(s, sizeof(word), word)) {
      if (!im->x)
        SB_SCAN_ENDS(s, "the section '%s'", "Vertices");
      SbImportRemark(im, "the file has no End, and may be truncated");
      break;
    }
    if (!strcmp(word, "End"))
      break;

    // coordinates and a reference, which is ignored
    if (!strcmp(word, "Vertices")) {
      if (im->x)
        SB_SCAN_ERROR(s, "second section Vertices");
      PetscCall(SbScanCount(s, "vertices", 8, 8, &n));
      PetscCall(SbImportSetVertices(im, (PetscInt)n));
      for (PetscInt v = 0; v < n; v++) {
        PetscCall(SbScanPoint(s, "coordinate", v + 1, im->x + 3 * v));
        PetscCall(SbScanReal(s, "reference", v + 1, &reference));
      }
    }
    if (!strcmp(word, "Dimension")) {
      PetscCall(SbScanText(s, "dimension", &dimension));
      if (dimension != 3)
        SB_SCAN_ERROR(s, "dimension %lld; expected 3", (long long)dimension);
    }
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(elements) && !known; i++) {
      known = (PetscBool)!strcmp(word, elements[i].word);
      if (known && !im->x && nearly < MOST_EARLY) {
        early[nearly].at = s->at;
        early[nearly++].type = elements[i].type;
      } else if (known)
        PetscCall(read_elements(im, elements[i].type));
    }
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(solids) && !known; i++)
      if (!strncmp(word, solids[i], strlen(solids[i])))
        SB_SCAN_ERROR(s, "section %s; supple reads Tetrahedra, and TetrahedraP2 in Medit's order",
                      word);
  }
  for (int i = 0; i < nearly; i++) {
    s->at = s->token = early[i].at;
    PetscCall(read_elements(im, early[i].type));
  }
  PetscCall(SbImportCheckTypes(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
