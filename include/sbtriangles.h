/*
  sbtriangles.h - layer 2: a closed surface of triangles from a file, as a rigid obstacle.
*/
#pragma once
#include "sbmesh.h"

/* A closed surface of triangles with an inside, of a rigid obstacle. Arrays are owned. */
typedef struct {
  PetscInt nvert, ntri;
  PetscReal *x;     /* [nvert][3] m */
  PetscInt *tri;    /* [ntri][3] vertices, counter-clockwise seen from outside */
  PetscInt *across; /* [ntri][3] triangle beyond edge k, which runs from corner k to the next */
  PetscReal volume; /* enclosed, m^3 */
  PetscBool turned; /* it was inverted in the file */
} SbTriangles;
/*
  SbTrianglesRead - a closed surface from a file, x <- scale x + at: .stl (text or binary), .obj,
  .off, or .msh (gmsh: the boundary of its tets or, without tets, its triangles).

  Collective; rank 0 reads and checks, every rank gets all of it.

  Input: option - for messages; path; scale > 0; at, m.
  Repairs are named in a warning: vertices that differ by rounding; duplicate, flat and wrongly
  oriented triangles; an inverted surface; triangles with material on both sides, of touching
  solids, are left out. Errors: PETSC_ERR_FILE_*, PETSC_ERR_USER_INPUT, alike on all ranks, one line
  with option, file, line or triangle (numbered as in the file) and what to do: unreadable; open;
  more than two triangles at an edge; no volume.
*/
PetscErrorCode SbTrianglesRead(MPI_Comm comm, const char *option, const char *path, PetscReal scale,
                               const PetscReal at[3], SbTriangles *triangles);
PetscErrorCode SbTrianglesDestroy(SbTriangles *triangles);
/* Solid angle of the triangle of the vertices v seen from o, positive if o is behind it. */
PetscReal SbTriangleSolidAngle(const PetscReal x[], const PetscInt v[3], const PetscReal o[3]);
