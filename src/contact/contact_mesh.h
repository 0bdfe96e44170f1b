/*
  contact_mesh.h - shared by the files about surfaces in contact.
*/
#pragma once
#include "sbbarrier.h"

/* Area of a triangle of the vertices v; n[3], its normal, twice as long. */
static inline PetscReal SbContactTriangleArea(const PetscReal x[], const PetscInt v[3], PetscReal n[3])
{
  PetscReal a[3], b[3];

  for (int i = 0; i < 3; i++) {
    a[i] = x[3 * v[1] + i] - x[3 * v[0] + i];
    b[i] = x[3 * v[2] + i] - x[3 * v[0] + i];
  }
  SbCross(a, b, n);
  return 0.5 * PetscSqrtReal(SbDot3(n, n));
}

/*
  SbContactMeshCrossings - edges that intersect triangles of another body, or of the same one (self), at
                           x[nvertex][3], current positions, m.

  Collective. Output, of all ranks on each: hit[n][2], edge and triangle, ascending; the caller frees it.
  Independent of the pair search.
*/
PetscErrorCode SbContactMeshCrossings(SbContactMesh mesh, PetscBool self, const PetscReal x[], PetscInt *n,
                                      PetscInt **hit);
