/*
  triangles.h - a surface of triangles on its way from a file to a rigid obstacle: what the files triangles*.c share. Rank 0 only.
*/
#pragma once
#include "mesh_impl.h"

/* Filled by a reader, item by item. */
typedef struct {
  const char *where; /* begins every message */
  SbTriangles *t;
  PetscInt vert_size, tri_size; /* allocated */
  int64_t *number;              /* [ntri] of the face in the file, from 1; owned by who reads */
} SbTriangleFile;

/* Readers. Errors name the file, and the line or byte. Not collective. */
PetscErrorCode SbTrianglesRead_STL(const char *path, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OBJ(const char *path, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OFF(const char *path, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_Gmsh(const char *path, SbTriangleFile *file);
/* Appends a vertex, or a triangle of vertices that are there. */
PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *file, const PetscReal x[3]);
PetscErrorCode SbTrianglesAdd(SbTriangleFile *file, PetscInt a, PetscInt b, PetscInt c, int64_t number);

/*
  SbTrianglesCheck - closed, of one orientation, around a volume; fills neighbours, volume and mean edge, turns what is inside out.

  Not collective. Errors: PETSC_ERR_USER_INPUT, one line that names the triangle and what to do.
*/
PetscErrorCode SbTrianglesCheck(SbTriangleFile *file);
