/*
  sbsurface.h - layer 2: closed surfaces of triangles, of bodies and of rigid obstacles, and the
  tets that fill them.
*/
#pragma once
#include "sbmesh.h"

/* the surface of a body and its tets; rank 0 only */

/* Whether a file holds a surface by its name: reading it fills it with tets, as body->tet says. */
PetscBool SbMeshFileIsSurface(const char *path);
/* Defaults of SbTetOptions; values of -body_<name>_tet_... for a mesh that is a surface. Not
   collective. */
void SbTetDefaults(SbTetOptions *options);
PetscErrorCode SbTetOptionsRead(const SbScope *scope, const char *mesh, SbTetOptions *options);
/* Reads the option `key` of a scope: the places with finer tets, sphere:x,y,z,r,size or
   box:x0,y0,z0,x1,y1,z1,size (m), separated by ; "": none. Error: PETSC_ERR_USER_INPUT. */
PetscErrorCode SbTetNearRead(const SbScope *scope, const char *key, SbTetOptions *options);

/*
  Surfaces that cut space into regions; every triangle knows the region on each of its sides.
  SbSurfaceDestroy(). A body without inner surfaces has one region: side is {-1, 0} for triangles
  seen counter-clockwise from outside.
*/
typedef struct {
  PetscInt nvert, ntri, nregion;
  PetscReal *x;    /* [nvert][3], every vertex is used by a triangle */
  PetscInt *tri;   /* [ntri][3] */
  PetscInt *tags;  /* [ntri] tag set in the import that the tets go to, 0: of no group */
  int64_t *number; /* [ntri] in the file, for messages */
  PetscInt
    *side; /* [ntri][2] region in front (corners counter-clockwise) and behind; -1: nothing there */
  PetscInt *region_tags; /* [nregion] tag set of the tets of each region */
} SbSurface;

PetscErrorCode SbSurfaceCreate(PetscInt nvert, PetscInt ntri, PetscInt nregion, SbSurface *surface);
PetscErrorCode SbSurfaceDestroy(SbSurface *surface);
/* Volume of each region, volume[nregion], NULL: not wanted; returns the mean edge of the
   triangles. */
PetscReal SbSurfaceMeasure(const SbSurface *surface, PetscReal volume[]);

/*
  SbTetrahedralize - fills regions with tets of about one size. Not collective.

  Input:
    where   - begins every message
    surface - closed; no two triangles cut each other; lengths in any unit
    options - size in that unit, mesher, whether the triangles are kept
  Output:
    body - zeroed or with groups and tag sets alone: gets x, vert_number, item[3] with the tags of
    its region,
           item[2] with every triangle whose tag set is not empty, and note. With SB_TET_KEEP the
           first surface->nvert vertices are those of the surface, bit by bit and in order, and its
           triangles are the facets of the tets, inner ones too.

  Errors: PETSC_ERR_USER_INPUT, one line with the messages of gmsh and tetgen and a remedy; then
  body has no mesh.
*/
PetscErrorCode SbTetrahedralize(const char *where, const SbSurface *surface,
                                const SbTetOptions *options, SbImport *body);

typedef struct {
  PetscInt nvert, ntri;
  PetscReal area, volume; /* m^2; enclosed, m^3, if it is closed */
  PetscBool closed;       /* of tets, not a surface of the file */
  PetscBool curved;       /* the mesh has curved edges: four triangles for each facet */
} SbSurfaceFacts;
/*
  SbMeshFileSurface - writes the surface of a mesh of tets, oriented outwards: .stl, .obj, .ply.

  Not collective. Input: group - "", or the region or surface of the file that is written alone; of
  a region all of its surface, also where it meets others; path. The mesh is checked as for a run.
  Errors: PETSC_ERR_USER_INPUT, PETSC_ERR_FILE_WRITE, one line with the group or file.
*/
PetscErrorCode SbMeshFileSurface(SbImport *import, const char *group, const char *path,
                                 SbSurfaceFacts *facts);

/* The reader of a body that is a surface, which becomes tets by body->tet. */
PetscErrorCode SbImportRead_Surface(const char *path, SbImport *body);
extern const SbOption SbTetRows[];

/* the surface of a rigid obstacle */

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
