/*
  triangles.c - reads the triangles of a surface file; the reader is chosen by the file name.

  For a gmsh file the surface is the boundary of its tets, or, without tets, its triangles.
*/
#include <strings.h>
#include "sbtet.h"
#include "triangles.h"

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

  for (size_t i = 0; dot && i < PETSC_STATIC_ARRAY_LENGTH(formats); i++)
    if (!strcasecmp(dot, formats[i].extension)) return &formats[i];
  return NULL;
}

PetscErrorCode SbTrianglesReadFile(const char *path, SbTriangleFile *f)
{
  const SbTriangleFormat *format = SbTrianglesFormat(path);
  SbImport *im = f->im;
  const SbItems *tri = &im->item[2];
  SbFaces faces = {0};
  PetscErrorCode ierr = PETSC_SUCCESS;

  PetscFunctionBeginUser;
  f->path = path;
  f->sheets = format->sheets;
  if (format->read) {
    PetscCall(SbScanOpen(f->where, path, &im->scan));
    PetscCall((*format->read)(&im->scan, f));
  } else {
    // gmsh: boundary of the tets, else the triangles
    im->surface = PETSC_TRUE;
    PetscCall(SbImportRead_Gmsh(path, im));
    if (im->item[3].n) ierr = SbImportCheck(im, &faces);
    for (PetscInt s = 0; !ierr && s < 4 * faces.ncell; s++) {
      const PetscInt *v = im->item[3].vert + 4 * (s / 4);
      const int *a = SbFaceVertex[s % 4];

      if (faces.neighbour[s] >= 0) continue;
      ierr = SbTrianglesAdd(f, v[a[0]], v[a[1]], v[a[2]], f->t->ntri + 1);
    }
    PetscCall(SbFacesDestroy(&faces));
    PetscCall(ierr);
    for (PetscInt i = 0; !im->item[3].n && i < tri->n; i++)
      PetscCall(
        SbTrianglesAdd(f, tri->vert[3 * i], tri->vert[3 * i + 1], tri->vert[3 * i + 2], tri->number[i]));
    for (PetscInt v = 0; v < im->nvert; v++) PetscCall(SbTrianglesAddVertex(f, im->x + 3 * v));
  }
  PetscCall(PetscFree(im->scan.data));
  PetscCheck(f->t->ntri, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s: holds no triangles; give a closed surface of triangles, or a mesh of tetrahedra", f->where);
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
