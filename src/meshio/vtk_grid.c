/*
  vtk_grid.c - conversion of the cells of VTK files to the items of a body.

  Cell types are those of vtkCellType.h, counted by gmsh's types, for common error messages.
*/
#include <strings.h>
#include "meshio_impl.h"

/* VTK's cell types, and gmsh's types. nnode 0: any number of nodes. */
static const struct {
  int type, gmsh, nnode;
} cells[] = {{1, 15, 1},   {2, 15, 0},  {3, 1, 2},   {4, 1, 0},    {5, 2, 3},    {8, 3, 4},
             {9, 3, 4},    {10, 4, 4},  {11, 5, 8},  {12, 5, 8},   {13, 6, 6},   {14, 7, 5},
             {21, 8, 3},   {22, 9, 6},  {23, 16, 8}, {24, 11, 10}, {25, 17, 20}, {26, 18, 15},
             {27, 19, 13}, {28, 10, 9}, {29, 12, 27}};

/* Names of arrays that number regions, in order of preference. */
static const char *const region_names[] = {
  "CellEntityIds", "gmsh:physical", "medit:ref", "region",     "regions",
  "RegionId",      "RegionIds",     "material",  "MaterialId", "MaterialIds",
  "subdomain",     "label",         "labels",    "cell_tags",  "tag"};

PetscErrorCode SbVtkSetPoints(PetscInt n, const double x[], SbImport *im)
{
  PetscFunctionBeginUser;
  PetscCall(SbImportSetVertices(im, n));
  for (PetscInt v = 0; v < n; v++) {
    im->vert_number[v] = v;
    for (int i = 0; i < 3; i++) {
      im->x[3 * v + i] = x[3 * v + i];
      if (!isfinite(x[3 * v + i]))
        SB_SCAN_ERROR(&im->scan, "coordinate of point %lld is not a finite number; repair the file",
                      (long long)v);
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbVtkGhostMarks(const char *name, PetscInt n, double mark[])
{
  /* bits of vtkDataSetAttributes::CellGhostTypes: DUPLICATECELL, REFINEDCELL, HIDDENCELL; a level
     above 0 is a copy */
  const unsigned left_out = strcmp(name, "vtkGhostType") ? ~0U : 1U | 8U | 32U;

  for (PetscInt c = 0; c < n; c++)
    mark[c] = mark[c] > 0 && mark[c] < 256 ? ((unsigned)mark[c] & left_out) != 0 : 0;
}

PetscErrorCode SbVtkGridFill(SbVtkGrid *grid, SbImport *im)
{
  SbScan *s = &im->scan;
  int64_t begin = 0;
  int64_t end;
  PetscBool use[SB_VTK_ARRAYS];
  PetscInt vert[10] = {0};
  PetscInt tags;
  double *sorted;
  int regions = -1;
  PetscInt nghost = 0;
  int type;
  int nuse = 0;

  PetscFunctionBeginUser;

  // arrays that become groups, and the array of region numbers among them
  PetscCall(PetscMalloc1(grid->ncell, &sorted));
  for (int a = 0; a < grid->narray; a++) {
    const double *value = grid->array[a].value;
    PetscInt different = 1;

    // arrays of integers with few distinct values
    use[a] = PETSC_TRUE;
    for (PetscInt c = 0; c < grid->ncell && use[a]; c++)
      use[a] = (PetscBool)(PetscAbsReal(value[c]) < 1e12 && value[c] == PetscFloorReal(value[c]));
    if (!use[a])
      continue;
    PetscCall(PetscArraycpy(sorted, value, grid->ncell));
    PetscCall(PetscRealSortSemiOrdered(grid->ncell, sorted));
    for (PetscInt c = 1; c < grid->ncell; c++)
      different += sorted[c] != sorted[c - 1];
    use[a] = (PetscBool)(different <= SB_VTK_REGIONS);
    nuse += use[a];
  }
  PetscCall(PetscFree(sorted));
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(region_names) && regions < 0; k++)
    for (int a = 0; a < grid->narray && regions < 0; a++)
      if (use[a] && (nuse == 1 || !strcasecmp(grid->array[a].name, region_names[k])))
        regions = a;
  for (PetscInt c = 0; c < grid->ncell; c++, begin = end) {
    const double value = grid->end[c];
    const double vtk = grid->type[c];
    size_t i = 0;

    // a cell has at least one point, and its end is in the list
    if (!(value > (double)begin && value <= (double)grid->nconnect) ||
        value != PetscFloorReal(value))
      SB_SCAN_ERROR(
        s, "the points of cell %lld end at %g; expected a whole number above %lld, up to %lld",
        (long long)c, value, (long long)begin, (long long)grid->nconnect);
    end = (int64_t)value;
    while (i < PETSC_STATIC_ARRAY_LENGTH(cells) && vtk != cells[i].type)
      i++;
    if (i == PETSC_STATIC_ARRAY_LENGTH(cells))
      SB_SCAN_ERROR(
        s,
        "cell %lld is of VTK's type %g; supple simulates tetrahedra (type 10), with points, lines "
        "and triangles for groups",
        (long long)c, vtk);
    if (cells[i].nnode && end - begin != cells[i].nnode)
      SB_SCAN_ERROR(s, "cell %lld, of VTK's type %g, has %lld points; expected %d", (long long)c,
                    vtk, (long long)(end - begin), cells[i].nnode);
    type = cells[i].gmsh;

    // points of the cell, checked
    for (int64_t k = 0; k < end - begin; k++) {
      const double point = grid->connect[begin + k];

      if (!(point >= 0 && point < (double)im->nvert) || point != PetscFloorReal(point))
        SB_SCAN_ERROR(s, "cell %lld uses point %g; the points are 0 to %lld", (long long)c, point,
                      (long long)im->nvert - 1);
      if (k < 10)
        vert[SbGmshNode((int)k)] = (PetscInt)point;
    }

    // a copy of a cell that is in another piece
    if (grid->ghost && grid->ghost[c] != 0) {
      nghost++;
      continue;
    }

    // a simplex, but not a polyline or several points, gets a group from each array in use
    tags = 0;
    if (SbGmshIsSimplex(type) && end - begin == SbGmshTypes[type].nnode) {
      const int dim = SbGmshTypes[type].dim;
      PetscInt group[SB_VTK_ARRAYS];
      PetscInt n = 0;

      for (int a = 0; a < grid->narray; a++) {
        const PetscInt known = im->ngroup;
        const int64_t number = use[a] ? (int64_t)grid->array[a].value[c] : 0;
        const PetscBool other = (PetscBool)(a != regions);

        if (!use[a])
          continue;

        /* region numbers are unchanged; numbers of other arrays are shifted to be distinct */
        PetscCall(
          SbImportGroup(im, dim, number + (other ? (int64_t)(a + 1) << 42 : 0), NULL, &group[n]));
        if (im->ngroup > known)
          (void)snprintf(im->group[group[n]].name, SB_GROUP_MAX, "%.40s%s%s_%lld",
                         other ? grid->array[a].name : "", other ? "_" : "", SbGroupKinds[dim],
                         (long long)number);
        n++;
      }
      PetscCall(SbImportTagSet(im, n, group, &tags));
    }
    PetscCall(SbImportAddElement(im, type, vert, tags, c));
  }
  if (nghost)
    SbImportRemark(im, "%lld ghost cells left out", (long long)nghost);
  PetscCall(SbImportCheckTypes(im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
