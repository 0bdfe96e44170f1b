/*
  vtk_grid.h - cells as VTK's files hold them, on their way to a body: what import_vtk.c and import_vtu.c share.
*/
#pragma once
#include "meshio_impl.h"

#define SB_VTK_ARRAYS 16    /* cell arrays that are examined */
#define SB_VTK_REGIONS 1000 /* an array of more different values is no number of regions */

/* All numbers as double: exact for every position of a node. Arrays are those of the reader, see SbImportScratch(). */
typedef struct {
  PetscInt ncell;
  int64_t nconnect;
  double *connect; /* [nconnect] points, from 0 */
  double *end;     /* [ncell] where the points of a cell end in `connect` */
  double *type;    /* [ncell] VTK's type of cell */
  int narray;
  struct {
    char name[SB_NAME_MAX];
    double *value; /* [ncell] */
  } array[SB_VTK_ARRAYS];
} SbVtkGrid;

/*
  SbVtkGridFill - the cells of a grid as items of a body whose vertices are there; arrays of whole numbers become groups. Not collective.

  The array of regions (CellEntityIds, gmsh:physical, medit:ref, region, ...; or the only one) gives the groups volume_N, surface_N,
  ...; each other one NAME_volume_N, ... Errors of a cell name the position import->scan.token.
*/
PetscErrorCode SbVtkGridFill(SbVtkGrid *grid, SbImport *im);
/* Coordinates, [nvert][3], into the body; number i of a bad one is named. */
PetscErrorCode SbVtkSetPoints(PetscInt n, const double x[], SbImport *im);
