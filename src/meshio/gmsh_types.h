/*
  gmsh_types.h - the types of elements as gmsh numbers them.
*/
#pragma once
#include "meshio_impl.h"

enum { SB_GMSH_LINE = 1, SB_GMSH_TRIANGLE = 2, SB_GMSH_TET = 4, SB_GMSH_POINT = 15, SB_GMSH_NTYPES = 32 };
typedef struct {
  const char *name; /* "4-node tetrahedra" */
  int dim, nnode;
} SbGmshType;
extern const SbGmshType SbGmshTypes[SB_GMSH_NTYPES];

/*
  SbGmshCheckTypes - what was read must be a mesh of 4-node tets and of nothing else in the volume (or triangles, for a surface).

  Not collective. Input: count[SB_GMSH_NTYPES] - elements by type. Errors: PETSC_ERR_FILE_UNEXPECTED, which says what is there.
*/
PetscErrorCode SbGmshCheckTypes(const SbImport *im, const int64_t count[]);
