/*
  tet_backends.h - input and output of gmsh and tetgen for tetrahedralize.c. Rank 0 only.
*/
#pragma once
#include "surface_impl.h"

#define SB_TET_MOST 5e7 /* tets that one surface may become */

typedef struct {
  const char *where;    /* begins every message */
  const SbImport *body; /* whose options messages name */
  const SbSurface *surface;
  SbTetOptions options;
  PetscReal size, edge; /* wanted edge, mean edge of the surface */
  PetscReal expected;   /* estimated number of tets */
  PetscBool remesh;     /* the surface gets triangles of the wanted size; else they stay */
} SbTetJob;

/*
  A backend fills x, vert_number, item[3] with the number of the region as tags, item[2] with the facets between regions and
  outside: as tags the triangle of the surface that they are or, remeshed, lie next to.
  Errors: PETSC_ERR_USER_INPUT, PETSC_ERR_FILE_*: the reason why it did not work.
*/
PetscErrorCode SbTetRun_Gmsh(const SbTetJob *job, SbImport *tets);
PetscErrorCode SbTetRun_TetGen(const SbTetJob *job, SbImport *tets);
