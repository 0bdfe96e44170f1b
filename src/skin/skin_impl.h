/*
  skin_impl.h - what the files of src/skin/ share: from a file to a surface with regions, boxes around its triangles. Rank 0 only.
*/
#pragma once
#include "sbskin.h"
#include "triangles.h"

/* Volume of each region, volume[nregion]; returns the mean edge of the triangles. */
PetscReal SbSkinMeasure(const SbSkin *surface, PetscReal volume[]);
/*
  SbSkinRead - a surface from a file, mended and checked, with its regions; groups and im->note are those of the body `im`. Not collective.

  Input: path; im->where, im->scale (1 afterwards: the surface is in metres), im->tet (weld and untangle).
  Errors: PETSC_ERR_FILE_*, PETSC_ERR_USER_INPUT, one line that names the triangles and what to do; then there is no skin.
*/
PetscErrorCode SbSkinRead(const char *path, SbImport *im, SbSkin *skin);

/* What was found and mended, for the note of the body. */
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
} SbMended;

/* Joins vertices no farther apart than the tolerance; leaves out what collapses, doubles and unused vertices. */
PetscErrorCode SbSkinWeld(SbTriangleFile *file, PetscReal tolerance, SbMended *mended);
/* Takes triangles without area into their neighbours; refuses those that have none to go to, and open edges. */
PetscErrorCode SbSkinClose(SbTriangleFile *file, SbMended *mended);
/* Takes small folds apart by moving vertices no farther than the reach; refuses all else that cuts or touches itself. */
PetscErrorCode SbSkinCross(SbTriangleFile *file, PetscReal reach, SbMended *mended);
/* The regions: fills side of each triangle; regions get groups region_1, ... and those that the file names. */
PetscErrorCode SbSkinRegions(SbTriangleFile *file, SbMended *mended, SbSkin *surface);

/* ------------------------------------------------------------------ boxes.c: which boxes meet a box */

/* A tree over boxes; nodes[1] is the root, the children of k are 2 k and 2 k + 1. */
typedef struct {
  PetscInt n, nleaf;   /* boxes; leaves, a power of two */
  PetscInt *order;     /* [n] boxes in the order of the leaves */
  PetscReal (*box)[6]; /* [2 nleaf] lower and upper corner of each node */
} SbBoxTree;
PetscErrorCode SbBoxTreeCreate(PetscInt n, const PetscReal (*box)[6], SbBoxTree *tree);
PetscErrorCode SbBoxTreeDestroy(SbBoxTree *tree);
/* Box of a triangle, vert[3]. */
void SbTriangleBox(const PetscReal x[], const PetscInt vert[], PetscReal box[6]);
/* Calls visit(ctx, i) for each box that meets the given one, until it returns an error. */
PetscErrorCode SbBoxTreeVisit(const SbBoxTree *tree, const PetscReal box[6],
                              PetscErrorCode (*visit)(void *ctx, PetscInt i), void *ctx);
