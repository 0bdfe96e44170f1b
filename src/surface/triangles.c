/*
  triangles.c - reads the triangles of a surface file; the reader is chosen by the first
  bytes of the file, or its name. Areas, edges, volumes and solid angles (van Oosterom and Strackee
  1983) of triangles.

  For a gmsh file the surface is the boundary of its tets, or, without tets, its triangles.
*/
#include <strings.h>
#include "surface_impl.h"

enum {
  STL,
  OBJ,
  OFF,
  PLY
};
static const SbTriangleFormat formats[] = {
  [STL] = {".stl", SbTrianglesRead_STL},
  [OBJ] = {".obj", SbTrianglesRead_OBJ},
  [OFF] = {".off", SbTrianglesRead_OFF},
  [PLY] = {".ply", SbTrianglesRead_PLY},
  {".poly", SbTrianglesRead_Poly},
  {".smesh", SbTrianglesRead_Poly},
  {".msh", NULL},
};

const SbTriangleFormat *SbTrianglesFormat(const char *path)
{
  const char *dot = strrchr(path, '.');

  for (size_t i = 0; dot && i < PETSC_STATIC_ARRAY_LENGTH(formats); i++)
    if (!strcasecmp(dot, formats[i].extension))
      return &formats[i];
  return NULL;
}

/* The format that the first bytes of a file are of, whatever its name: obj has no mark. */
static const SbTriangleFormat *format_of(const char *path, const SbTriangleFormat *named)
{
  static const char *const heads[] = {"OFF", "COFF", "NOFF", "CNOFF", "STOFF"};
  char text[1024];
  const char *begin;
  size_t n;
  FILE *file;

  if (SbFileOpen(path, 0, &file) || !file)
    return named;
  n = fread(text, 1, sizeof(text) - 1, file);
  (void)fclose(file);
  text[n] = 0;
  begin = text + strspn(text, " \t\r\n");
  n = strcspn(begin, " \t\r\n");
  if (!strncasecmp(begin, "solid", 5) && strstr(begin, "facet") && strstr(begin, "vertex"))
    return &formats[STL];
  if (n == 3 && !strncmp(begin, "ply", 3) && strstr(begin, "format"))
    return &formats[PLY];
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(heads); i++)
    if (n == strlen(heads[i]) && !strncmp(begin, heads[i], n))
      return &formats[OFF];
  return named;
}

PetscErrorCode SbTrianglesReadFile(const char *path, SbTriangleFile *f)
{
  const SbTriangleFormat *named = SbTrianglesFormat(path);
  const SbTriangleFormat *format = format_of(path, named);
  SbImport *im = f->im;
  const SbItems *tri = &im->item[2];
  SbFaces faces = {0};
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  f->path = path;
  if (format != named)
    SbAppend(sizeof(im->note), im->note, "%sread as a file of %s, which it is in spite of its name",
             im->note[0] ? ", " : "", format->extension);
  f->sheets = (PetscBool)(format->read == SbTrianglesRead_Poly);
  if (format->read) {
    PetscCall(SbScanOpen(f->where, path, &im->scan));
    PetscCall((*format->read)(&im->scan, f));
  } else {
    // gmsh: boundary of the tets, else the triangles
    im->surface = PETSC_TRUE;
    PetscCall(SbImportRead_Gmsh(path, im));
    if (im->item[3].n)
      ierr = SbImportCheck(im, &faces);
    for (PetscInt s = 0; !ierr && s < 4 * faces.ncell; s++) {
      const PetscInt *v = im->item[3].vert + 4 * (s / 4);
      const int *a = SbFaceVertex[s % 4];

      if (faces.neighbour[s] >= 0)
        continue;
      ierr = SbTrianglesAdd(f, v[a[0]], v[a[1]], v[a[2]], f->t->ntri + 1);
    }
    PetscCall(SbFacesDestroy(&faces));
    PetscCall(ierr);
    for (PetscInt i = 0; !im->item[3].n && i < tri->n; i++)
      PetscCall(SbTrianglesAdd(f, tri->vert[3 * i], tri->vert[3 * i + 1], tri->vert[3 * i + 2],
                               tri->number[i]));
    for (PetscInt v = 0; v < im->nvert; v++)
      PetscCall(SbTrianglesAddVertex(f, im->x + 3 * v));
  }
  PetscCall(PetscFree(im->scan.data));
  PetscCheck(f->t->ntri, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: holds no triangles; give a closed surface of triangles, or a mesh of tetrahedra",
             f->where);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTrianglesDestroy(SbTriangles *t)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(t->x));
  PetscCall(PetscFree(t->tri));
  PetscCall(PetscFree(t->across));
  PetscCall(PetscMemzero(t, sizeof(*t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscReal SbTriangleArea(const PetscReal x[], const PetscInt v[3], PetscBool *flat)
{
  PetscReal e[3][3], n[3];
  PetscReal longest2 = 0;
  PetscReal twice;

  for (int k = 0; k < 3; k++) {
    SbSubtract(x + 3 * v[(k + 1) % 3], x + 3 * v[k], e[k]);
    longest2 = PetscMax(longest2, SbDot3(e[k], e[k]));
  }
  SbCross(e[0], e[1], n);
  twice = PetscSqrtReal(SbDot3(n, n));
  if (flat)
    *flat = (PetscBool) !(twice > SB_TRIANGLE_FLAT * longest2);
  return 0.5 * twice;
}

PetscReal SbTrianglesMeanEdge(const PetscReal x[], PetscInt ntri, const PetscInt tri[])
{
  PetscReal sum = 0;

  for (PetscInt f = 0; f < ntri; f++) {
    PetscReal around = 0;

    for (PetscInt s = 3 * f; s < 3 * f + 3; s++)
      around += PetscSqrtReal(SbDistance2(x + 3 * tri[SbSlotNext(s)], x + 3 * tri[s]));
    sum += around;
  }
  return ntri ? sum / (3 * (PetscReal)ntri) : 0;
}

void SbTrianglesEdges(const SbTriangles *t, SbKey edge[])
{
  for (PetscInt i = 0; i < 3 * t->ntri; i++)
    edge[i] = (SbKey){SbKeyOfPair(t->tri[i], t->tri[SbSlotNext(i)]), i};
  SbKeysSort(3 * t->ntri, edge);
}

PetscReal SbTetVolumeTo(const PetscReal x[], const PetscInt v[3], const PetscReal o[3])
{
  PetscReal a[3][3], n[3];

  for (int k = 0; k < 3; k++)
    SbSubtract(x + 3 * v[k], o, a[k]);
  SbCross(a[0], a[1], n);
  return SbDot3(n, a[2]) / 6;
}

PetscReal SbTriangleSolidAngle(const PetscReal x[], const PetscInt v[3], const PetscReal o[3])
{
  PetscReal a[3][3], l[3], n[3], down;

  for (int k = 0; k < 3; k++) {
    SbSubtract(x + 3 * v[k], o, a[k]);
    l[k] = PetscSqrtReal(SbDot3(a[k], a[k]));
  }
  SbCross(a[0], a[1], n);
  down = l[0] * l[1] * l[2] + SbDot3(a[0], a[1]) * l[2] + SbDot3(a[1], a[2]) * l[0] +
         SbDot3(a[2], a[0]) * l[1];
  return 2 * atan2(SbDot3(n, a[2]), down);
}
