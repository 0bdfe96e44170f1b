/*
  surface_impl.h - what the files of src/surface/ share: from a file to a surface with regions, boxes around its triangles. Rank 0 only.
*/
#pragma once
#include "sbgeometry.h"
#include "sbsurface.h"
#include "triangles.h"

/*
  SbSurfaceRead - a surface from a file, repaired and checked, with its regions; groups and im->note are those of the body `im`. Not collective.

  Input: path; im->where, im->scale (1 afterwards: the surface is in metres), im->tet (weld and untangle).
  Errors: PETSC_ERR_FILE_*, PETSC_ERR_USER_INPUT, one line that names the triangles and what to do; then there is no surface.
*/
PetscErrorCode SbSurfaceRead(const char *path, SbImport *im, SbSurface *body_surface);

/* Repairs, for the note of the body. */
typedef struct {
  PetscReal tolerance, moved;  /* vertices within this distance were joined, and the largest such distance */
  PetscInt nwelded;            /* vertices joined with another */
  PetscInt ncollapsed;         /* triangles that lost an edge thereby, left out */
  PetscInt ndoubled;           /* triangles given twice, left out */
  PetscInt nwall;              /* pairs of triangles back to back: one is kept as a wall between regions */
  PetscInt nflat;              /* triangles without area, taken into their neighbour */
  PetscInt nturned;            /* triangles turned to the side of their neighbours */
  PetscInt ncavity;            /* parts taken as cavities */
  PetscInt npairs, nuntangled; /* triangles that cut each other, and vertices moved to part them */
  PetscReal untangled;         /* by how much */
  PetscInt nidle;              /* triangles with nothing on both sides, left out */
  PetscInt ninner;             /* triangles of an obstacle with material on both sides, left out */
} SbSurfaceRepairs;

/* Joins vertices no farther apart than the tolerance; leaves out what collapses, doubles and unused vertices. */
PetscErrorCode SbSurfaceMergeVertices(SbTriangleFile *file, PetscReal tolerance, SbSurfaceRepairs *repairs);
/* Takes triangles without area into their neighbours; refuses those that have none to go to, and open edges. */
PetscErrorCode SbSurfaceRepairTriangles(SbTriangleFile *file, SbSurfaceRepairs *repairs);
/* Takes small folds apart by moving vertices no farther than the reach; refuses all else that cuts or touches itself. */
PetscErrorCode SbSurfaceUntangle(SbTriangleFile *file, PetscReal reach, SbSurfaceRepairs *repairs);
/* The regions: fills side of each triangle; regions get groups region_1, ... and those that the file names. */
PetscErrorCode SbSurfaceFindRegions(SbTriangleFile *file, SbSurfaceRepairs *repairs, SbSurface *surface);
