/*
  vtk_grid.h - cells and cell arrays of a VTK file, shared by import_vtk.c and import_vtu.c.
*/
#pragma once
#include "meshio_impl.h"

#define SB_VTK_ARRAYS 16    /* largest number of cell arrays that are examined */
#define SB_VTK_REGIONS 1000 /* an array with more distinct values is not a region number */

/* Cells of a grid. All numbers as double, exact for node indices. Arrays: SbImportScratch(). */
typedef struct {
  PetscInt ncell;
  int64_t nconnect;
  double *connect; /* [nconnect] points of the cells, from 0 */
  double *end;     /* [ncell] end of each cell in `connect` */
  double *type;    /* [ncell] VTK's cell type */
  int narray;
  struct {
    char name[SB_NAME_MAX];
    double *value; /* [ncell] */
  } array[SB_VTK_ARRAYS];
} SbVtkGrid;

/*
  SbVtkGridFill - adds the cells of a grid to a body that has its vertices; arrays of integers become groups.

  The array of region numbers (CellEntityIds, gmsh:physical, medit:ref, ...; or the only array) gives the
  groups volume_N, surface_N, ...; another one NAME_volume_N, ... Errors of a cell name import->scan.token.
*/
PetscErrorCode SbVtkGridFill(SbVtkGrid *grid, SbImport *im);
/* Sets the vertices of the body from coordinates x[n][3]; an error names the index of an invalid one. */
PetscErrorCode SbVtkSetPoints(PetscInt n, const double x[], SbImport *im);
