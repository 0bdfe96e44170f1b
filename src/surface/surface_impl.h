/*
  surface_impl.h - shared declarations of src/surface/: from a file to a surface with regions. Rank 0 only.
*/
#pragma once
#include "sbsurface.h"
#include "triangles.h"

/*
  SbSurfaceRead - reads a surface, repairs and checks it, and finds its regions; sets groups and im->note of
  the body `im`. Not collective.

  Input: path; im->where, im->scale (1 afterwards: the surface is in metres), im->tet (merge_tolerance and
  untangle).
  Errors: PETSC_ERR_FILE_*, PETSC_ERR_USER_INPUT, one line that names the triangles and a remedy; no surface
  is left.
*/
PetscErrorCode SbSurfaceRead(const char *path, SbImport *im, SbSurface *body_surface);

/* Counts of repairs, for the note of the body. */
typedef struct {
  PetscReal tolerance, moved; /* merge tolerance, m; largest distance of merged vertices, m */
  PetscInt nwelded;           /* vertices merged with another one */
  PetscInt ncollapsed;        /* triangles removed because two of their corners were merged */
  PetscInt ndoubled;          /* duplicate triangles removed */
  PetscInt nwall;   /* pairs of coincident triangles of opposite orientation: one is kept as a wall */
  PetscInt nflat;   /* flat triangles merged into their neighbours */
  PetscInt nturned; /* triangles reversed for consistent orientation */
  PetscInt ncavity; /* parts that are cavities */
  PetscInt npairs, nuntangled; /* pairs of intersecting triangles; vertices moved by smoothing */
  PetscReal untangled;         /* largest displacement by smoothing, m */
  PetscInt nidle;              /* triangles without material on either side, removed */
  PetscInt ninner;             /* triangles of an obstacle with material on both sides, removed */
} SbSurfaceRepairs;

/* Merges vertices within the tolerance, m; removes collapsed and duplicate triangles and unused vertices. */
PetscErrorCode SbSurfaceMergeVertices(SbTriangleFile *file, PetscReal tolerance, SbSurfaceRepairs *repairs);
/* Merges flat triangles into their neighbours. Errors: remaining flat triangles, open edges. */
PetscErrorCode SbSurfaceRepairTriangles(SbTriangleFile *file, SbSurfaceRepairs *repairs);
/* Removes small self-intersections by moving vertices at most by `reach`, m. Error: some remain. */
PetscErrorCode SbSurfaceUntangle(SbTriangleFile *file, PetscReal reach, SbSurfaceRepairs *repairs);
/* Finds the regions: the sides of each triangle; they get the groups region_1, ... and those of the file. */
PetscErrorCode SbSurfaceFindRegions(SbTriangleFile *file, SbSurfaceRepairs *repairs, SbSurface *surface);
