/*
  mesher.c - the mesher of re-meshing: the hull is filled by SbTetrahedralize(), which keeps its triangles.
*/
#include "sbremesh.h"
#include "sbskin.h"
#include "sbtet.h"

static PetscErrorCode make_skin(const SbHull *hull, SbSkin *skin)
{
  PetscFunctionBeginUser;
  PetscCall(SbSkinCreate(hull->nvert, hull->ntri, hull->nregion, skin));
  PetscCall(PetscArraycpy(skin->x, hull->x, 3 * (size_t)hull->nvert));
  PetscCall(PetscArraycpy(skin->tri, hull->tri, 3 * (size_t)hull->ntri));
  PetscCall(PetscArraycpy(skin->side, hull->side, 2 * (size_t)hull->ntri));
  PetscCall(PetscArrayzero(skin->tags, hull->ntri));
  PetscCall(PetscArrayzero(skin->region_tags, hull->nregion));
  for (PetscInt t = 0; t < hull->ntri; t++) skin->number[t] = t + 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Takes vertices and tets out of an import, which loses them; tets are turned where they need it. */
static PetscErrorCode take(SbImport *im, PetscInt *nvert, PetscReal **x, PetscInt *ncell, PetscInt **cell)
{
  PetscFunctionBeginUser;
  *nvert = im->nvert;
  *ncell = im->item[3].n;
  *x = im->x;
  *cell = im->item[3].vert;
  im->x = NULL;
  im->item[3].vert = NULL;
  for (PetscInt c = 0; c < *ncell; c++) {
    PetscInt *v = *cell + 4 * (size_t)c;
    const PetscInt keep = v[3];

    if (SbTetDet(*x, v) > 0) continue;
    v[3] = v[2];
    v[2] = keep;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMesherDefault(const char *where, const SbHull *hull, PetscReal size, void *ctx,
                               PetscInt *nvert, PetscReal **x, PetscInt *ncell, PetscInt **cell)
{
  SbTetOptions options;
  SbImport im;
  SbSkin skin;
  PetscErrorCode ierr;
  PetscInt none;

  PetscFunctionBeginUser;
  (void)ctx;
  PetscCall(PetscMemzero(&im, sizeof(im)));
  (void)snprintf(im.where, sizeof(im.where), "%s", where);
  PetscCall(SbImportTagSet(&im, 0, NULL, &none));
  PetscCall(SbTetDefaults(&options));
  options.size = size;
  options.surface = SB_TET_KEEP;
  PetscCall(make_skin(hull, &skin));
  ierr = SbTetrahedralize(where, &skin, &options, &im);
  PetscCall(SbSkinDestroy(&skin));
  if (!ierr) PetscCall(take(&im, nvert, x, ncell, cell));
  PetscCall(SbImportDestroy(&im));
  PetscCall(ierr);
  PetscFunctionReturn(PETSC_SUCCESS);
}
