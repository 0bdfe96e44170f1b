/*
  mesher.c - tetrahedralisation of the hull by SbTetrahedralize(), which keeps its triangles.

  The tets depend on the last bits of the coordinates, and these on the number of ranks, because
  solvers sum in different orders. So coordinates are rounded to a thousandth of an edge, and the
  same body gets the same tets on any number of ranks. Where this fails for the rounded surface, as
  where it nearly touches itself, exact coordinates are used. The vertices of the hull keep their
  positions in either case.
*/
#include "remesh_impl.h"

#define BITS 10 /* an edge is 2^10 to 2^11 rounding steps */
#define AHEAD \
  0.3 /* shift over a rounding step; 1/2 would put round numbers where rounding is ambiguous */

PetscErrorCode SbMesherDefault(const char *where, const SbSurface *hull, PetscReal size, void *ctx,
                               SbTets *tets)
{
  const PetscReal step =
    PetscPowReal(2, PetscFloorReal(PetscLog2Real(SbSurfaceMeasure(hull, NULL))) - BITS);
  SbTetOptions options;
  SbSurface rounded = *hull;
  SbImport im;
  PetscErrorCode ierr = PETSC_ERR_USER_INPUT;
  PetscInt none;

  PetscFunctionBeginUser;
  (void)ctx;
  SbTetDefaults(&options);
  options.surface = SB_TET_KEEP;
  PetscCall(PetscMalloc1(3 * (size_t)hull->nvert, &rounded.x));
  for (int exact = 0; exact < 2 && ierr; exact++) {
    PetscCall(PetscMemzero(&im, sizeof(im)));
    (void)snprintf(im.where, sizeof(im.where), "%s", where);
    PetscCall(SbImportTagSet(&im, 0, NULL, &none));
    options.size = exact ? size : step * PetscMax(1, PetscFloorReal(size / step));
    for (PetscInt i = 0; i < 3 * hull->nvert; i++)
      rounded.x[i] = exact ? hull->x[i] : step * PetscFloorReal(hull->x[i] / step + AHEAD);
    if (!exact)
      PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
    ierr = SbTetrahedralize(where, &rounded, &options, &im);
    if (!exact)
      PetscCall(PetscPopErrorHandler());
    if (ierr)
      PetscCall(SbImportDestroy(&im));
  }
  PetscCall(PetscFree(rounded.x));
  PetscCall(ierr);

  // vertices and tets move to the caller; inverted tets are reoriented
  *tets = (SbTets){.nvert = im.nvert, .ncell = im.item[3].n, .x = im.x, .cell = im.item[3].vert};
  im.x = NULL;
  im.item[3].vert = NULL;
  for (PetscInt c = 0; c < tets->ncell; c++) {
    PetscInt *v = tets->cell + 4 * (size_t)c;
    const PetscInt keep = v[3];

    if (SbTetDeterminant(tets->x, v) > 0)
      continue;
    v[3] = v[2];
    v[2] = keep;
  }
  PetscCall(SbImportDestroy(&im));
  PetscFunctionReturn(PETSC_SUCCESS);
}
