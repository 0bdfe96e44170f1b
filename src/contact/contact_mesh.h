/*
  contact_mesh.h - what the files about surfaces in contact share.
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
  SbContactMeshCrossings - edges that go through triangles of another part, or of the same one (self), at x.

  Collective. Output, of all ranks on each: hit[n][2], edge and triangle, ascending; the caller frees it. It knows nothing of pairs and motions.
*/
PetscErrorCode SbContactMeshCrossings(SbContactMesh mesh, PetscBool self, const PetscReal x[], PetscInt *n,
                                      PetscInt **hit);
