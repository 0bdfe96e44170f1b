/*
  remesh.h - a simple mesher for tests: connects every triangle of the surface with one interior
  point.
*/
#pragma once
#include "../src/remesh/remesh_impl.h"
#include "scene.h"

/* Mesher for star-shaped surfaces around the centre. ctx: NULL, or an int that counts the calls. */
static inline PetscErrorCode fixture_cone(const char *where, const SbSurface *hull, PetscReal size,
                                          void *ctx, SbTets *tets)
{
  PetscFunctionBeginUser;
  (void)where;
  (void)size;
  if (ctx)
    (*(int *)ctx)++;
  tets->nvert = hull->nvert + 1;
  tets->ncell = hull->ntri;
  PetscCall(PetscCalloc1(3 * tets->nvert, &tets->x));
  PetscCall(PetscMalloc1(4 * tets->ncell, &tets->cell));
  PetscCall(PetscArraycpy(tets->x, hull->x, 3 * hull->nvert));
  for (PetscInt i = 0; i < 3 * hull->nvert; i++)
    tets->x[3 * hull->nvert + i % 3] += hull->x[i] / (PetscReal)hull->nvert;
  for (PetscInt t = 0; t < hull->ntri; t++) {
    const PetscInt v[4] = {hull->nvert, hull->tri[3 * t], hull->tri[3 * t + 1],
                           hull->tri[3 * t + 2]};

    PetscCall(PetscArraycpy(tets->cell + 4 * t, v, 4));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A mesher that fails. */
static inline PetscErrorCode fixture_refuse(const char *where, const SbSurface *hull,
                                            PetscReal size, void *ctx, SbTets *tets)
{
  PetscFunctionBeginUser;
  (void)hull;
  (void)size;
  (void)ctx;
  (void)tets;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "%s: the mesher of the test refuses", where);
}
