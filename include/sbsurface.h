/* sbsurface.h - layer 2: closed surfaces of triangles and the tets that fill them. Rank 0 only. */
#pragma once
#include "sbmeshio.h"

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

/* The reader of a body that is a surface, which becomes tets by body->tet. */
PetscErrorCode SbImportRead_Surface(const char *path, SbImport *body);
extern const SbOption SbTetRows[];
