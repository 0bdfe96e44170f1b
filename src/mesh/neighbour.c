/*
  neighbour.c - what elements with nodes at faces need of the mesh: who is across a face, and numbers of ghost cells.
*/
#include <petscdmplex.h>
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
  PetscMPIInt size;
  PetscInt npoint, *all;
  MPI_Datatype type;
  PetscSF sf;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(mesh->comm, &size));
  if (size == 1) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(DMPlexGetChart(mesh->dm, NULL, &npoint));
  PetscCall(PetscCalloc1((size_t)n * npoint, &all));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++)
    PetscCall(PetscArraycpy(all + (size_t)n * mesh->cell_point[c], value + (size_t)n * c, n));
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)n, MPIU_INT, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(DMGetPointSF(mesh->dm, &sf));
  PetscCall(PetscSFBcastBegin(sf, type, all, all, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, type, all, all, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  for (PetscInt c = mesh->ncell_owned; c < mesh->ncell; c++)
    PetscCall(PetscArraycpy(value + (size_t)n * c, all + (size_t)n * mesh->cell_point[c], n));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(PETSC_SUCCESS);
}
