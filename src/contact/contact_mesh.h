/*
  contact_mesh.h - what the files about surfaces in contact share.
*/
#pragma once
#include "sbbarrier.h"

/*
  SbContactMeshCrossings - edges that go through triangles of another part, or of the same one (self), at x.

  Collective. Output, of all ranks on each: hit[n][2], edge and triangle, ascending; the caller frees it. It knows nothing of pairs and motions.
*/
PetscErrorCode SbContactMeshCrossings(SbContactMesh mesh, PetscBool self, const PetscReal x[], PetscInt *n,
                                      PetscInt **hit);
