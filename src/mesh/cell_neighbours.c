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

PetscErrorCode SbMeshBroadcastCells(SbMesh mesh, PetscInt n, PetscInt value[])
{
  MPI_Datatype type;

  PetscFunctionBeginUser;
  if (!mesh->cell_sf) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)n, MPIU_INT, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(PetscSFBcastBegin(mesh->cell_sf, type, value, value, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(mesh->cell_sf, type, value, value, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}
