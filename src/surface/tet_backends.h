/*
  tet_backends.h - interface of the mesh generators gmsh and tetgen, used by tetrahedralize.c. Rank 0 only.
*/
#pragma once
#include "surface_impl.h"

#define SB_TET_MOST 5e7 /* largest expected number of tets for one surface */

typedef struct {
  const char *where;    /* beginning of error messages */
  const SbImport *body; /* body whose options messages name */
  const SbSurface *surface;
  SbTetOptions options;
  PetscReal size, edge; /* target edge length, mean edge length of the surface */
  PetscBool remesh;     /* remesh the surface with triangles of the target size; else keep its triangles */
} SbTetJob;

/* Each backend sets x, vert_number, item[3] with the region number as tags, and item[2], the facets between
   regions and outside, with the number of a surface triangle as tags: the facet's own or, after remeshing,
   the nearest one. Errors: PETSC_ERR_USER_INPUT, PETSC_ERR_FILE_*: the reason of the failure. */
PetscErrorCode SbTetRun_Gmsh(const SbTetJob *job, SbImport *tets);
PetscErrorCode SbTetRun_TetGen(const SbTetJob *job, SbImport *tets);
