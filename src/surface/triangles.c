/*
  triangles.c - the triangles of a file: the reader by the name of the file.

  The boundary of a gmsh file is that of its tets; without tets its triangles are the surface.
*/
#include <strings.h>
#include "sbtet.h"
#include "triangles.h"

/* ------------------------------------------------------------------ gmsh */

/* The faces of tets without a tet beyond; they have no number in the file. */
static PetscErrorCode add_boundary(SbImport *im, SbTriangleFile *f)
{
  SbFaces faces;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&faces, sizeof(faces)));
  ierr = SbImportCheck(im, &faces);
  for (PetscInt s = 0; !ierr && s < 4 * im->item[3].n; s++) {
    const PetscInt *v = im->item[3].vert + 4 * (s / 4);
    const int *a = SbFaceVertex[s % 4];

    if (faces.neighbour[s] >= 0) continue;
    ierr = SbTrianglesAdd(f, v[a[0]], v[a[1]], v[a[2]], f->t->ntri + 1);
  }
  PetscCall(SbFacesDestroy(&faces));
  PetscFunctionReturn(ierr);
}

static PetscErrorCode read_gmsh(const char *path, SbTriangleFile *f)
{
  SbImport im;
  PetscInt none;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(&im, sizeof(im)));
  (void)snprintf(im.where, sizeof(im.where), "%s", f->where);
  im.surface = PETSC_TRUE;
  PetscCall(SbImportTagSet(&im, 0, NULL, &none));
  ierr = SbImportRead_Gmsh(path, &im);
  if (!ierr && im.item[3].n)
    ierr = add_boundary(&im, f);
  else if (!ierr) {
    const SbItems *tri = &im.item[2];

    for (PetscInt i = 0; !ierr && i < tri->n; i++)
      ierr = SbTrianglesAdd(f, tri->vert[3 * i], tri->vert[3 * i + 1], tri->vert[3 * i + 2], tri->number[i]);
  }
  for (PetscInt v = 0; !ierr && v < im.nvert; v++) ierr = SbTrianglesAddVertex(f, im.x + 3 * v);
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(ierr);
}

/* ------------------------------------------------------------------ files */

const SbTriangleFormat *SbTrianglesFormat(const char *path)
{
  static const SbTriangleFormat formats[] = {
    {".stl", SbTrianglesRead_STL, PETSC_FALSE},
    {".obj", SbTrianglesRead_OBJ, PETSC_FALSE},
    {".off", SbTrianglesRead_OFF, PETSC_FALSE},
    {".ply", SbTrianglesRead_PLY, PETSC_FALSE},
    {".poly", SbTrianglesRead_Poly, PETSC_TRUE},
    {".smesh", SbTrianglesRead_Poly, PETSC_TRUE},
    {".msh", NULL, PETSC_FALSE},
  };
  const char *dot = strrchr(path, '.');

  for (size_t i = 0; dot && i < PETSC_STATIC_ARRAY_LENGTH(formats); i++) {
    if (!strcasecmp(dot, formats[i].extension)) return &formats[i];
  }
  return NULL;
}

PetscErrorCode SbTrianglesReadFile(const char *path, SbTriangleFile *f)
{
  const SbTriangleFormat *format = SbTrianglesFormat(path);
  SbScan scan;
  PetscErrorCode ierr;

  PetscFunctionBeginUser;
  f->path = path;
  f->sheets = format->sheets;
  if (!format->read) {
    PetscCall(read_gmsh(path, f));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  ierr = SbScanOpen(f->where, path, &scan);
  if (!ierr) ierr = (*format->read)(&scan, f);
  PetscCall(SbScanClose(&scan));
  PetscCall(PetscFree(f->corner));
  PetscFunctionReturn(ierr);
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
