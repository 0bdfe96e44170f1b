/*
  cell_neighbours.c - what elements with nodes at faces need of the mesh: who is across a face, and numbers of ghost cells.
*/
#include "mesh_impl.h"

PetscErrorCode SbMeshNeighbours(SbMesh mesh, PetscInt **neighbour)
{
  SbFaces faces;

  PetscFunctionBeginUser;
  PetscCall(SbFacesCreate(mesh->nvert, mesh->ncell, mesh->cell, &faces));
  *neighbour = faces.neighbour;
  faces.neighbour = NULL;
  PetscCall(SbFacesDestroy(&faces));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode broadcast(PetscSF sf, PetscInt n, MPI_Datatype one, void *value)
{
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)n, one, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(PetscSFBcastBegin(sf, type, value, value, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, type, value, value, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshBroadcastCells(SbMesh mesh, PetscInt n, MPI_Datatype type, void *value)
{
  PetscFunctionBeginUser;
  if (mesh->cell_sf) PetscCall(broadcast(mesh->cell_sf, n, type, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbMeshBroadcastVertices(SbMesh mesh, PetscInt n, MPI_Datatype type, void *value)
{
  PetscFunctionBeginUser;
  if (!mesh->cell_sf) PetscFunctionReturn(PETSC_SUCCESS);
  if (!mesh->vert_sf) {
    const PetscInt nghost = mesh->nvert - mesh->nvert_owned;
    PetscLayout layout;
    PetscInt *leaf;

    PetscCall(PetscMalloc1(nghost, &leaf));
    for (PetscInt i = 0; i < nghost; i++) leaf[i] = mesh->nvert_owned + i;
    PetscCall(PetscLayoutCreateFromSizes(mesh->comm, mesh->nvert_owned, PETSC_DECIDE, 1, &layout));
    PetscCall(PetscSFCreate(mesh->comm, &mesh->vert_sf));
    PetscCall(PetscSFSetGraphLayout(mesh->vert_sf, layout, nghost, leaf, PETSC_COPY_VALUES,
                                    mesh->gvert + mesh->nvert_owned));
    PetscCall(PetscLayoutDestroy(&layout));
    PetscCall(PetscFree(leaf));
  }
  PetscCall(broadcast(mesh->vert_sf, n, type, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}
