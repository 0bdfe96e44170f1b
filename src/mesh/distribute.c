/*
  distribute.c - from rank 0 to all: DMPlex of cells and vertices, partition, one layer of overlap, data of the points.

  The DM is not interpolated (no faces, no edges): P1 needs none, and making them costs more than everything here. What
  belongs to a cell or vertex travels in one broadcast over the composition of the two migrations. Coordinates are set
  once, on the final DM. Rank 0 frees each part of what it has read when it is handed on.
*/
#include <petscdmplex.h>
#include "mesh_impl.h"

/* Everything on rank 0. */
static PetscErrorCode create_serial(MPI_Comm comm, SbWhole *w, DM *dm)
{
  PetscFunctionBeginUser;
  PetscCall(DMCreate(comm, dm));
  PetscCall(DMSetType(*dm, DMPLEX));
  PetscCall(DMSetDimension(*dm, 3));
  PetscCall(DMPlexBuildFromCellList(*dm, w->ncell, w->nvert, 4, w->cell));
  PetscCall(PetscFree(w->cell));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the DM by its distributed version with overlap; sf leads from the points of the old one to those of the new. */
static PetscErrorCode migrate(const char *type, SbWhole *w, DM *dm, PetscSF *sf)
{
  PetscPartitioner part;
  DM apart, overlapped;
  PetscSF sf_apart, sf_overlap;

  PetscFunctionBeginUser;
  PetscCall(DMPlexGetPartitioner(*dm, &part));
  PetscCall(PetscPartitionerSetType(part, type));
  PetscCall(PetscPartitionerSetFromOptions(part));
  PetscCall(SbPartitionerSetNeighbours(part, w->ncell, w->neighbour));
  PetscCall(DMPlexSetPartitionBalance(*dm, PETSC_TRUE)); /* vertices between ranks go to both sides alike */
  PetscCall(DMPlexDistribute(*dm, 0, &sf_apart, &apart));
  PetscCall(DMDestroy(dm));
  PetscCall(PetscFree(w->neighbour));
  PetscCall(DMPlexDistributeOverlap(apart, 1, &sf_overlap, &overlapped));
  PetscCall(DMDestroy(&apart));
  PetscCall(PetscSFCompose(sf_apart, sf_overlap, sf));
  PetscCall(PetscSFDestroy(&sf_apart));
  PetscCall(PetscSFDestroy(&sf_overlap));
  *dm = overlapped;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode send_points(PetscSF sf, const SbWhole *w, SbPoint point[])
{
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(SbPoint), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(PetscSFBcastBegin(sf, type, w->point, point, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, type, w->point, point, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode set_coordinates(DM dm, const SbPoint point[])
{
  PetscInt vStart, vEnd;
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(DMPlexGetDepthStratum(dm, 0, &vStart, &vEnd));
  PetscCall(PetscMalloc1(3 * (size_t)(vEnd - vStart), &x));
  for (PetscInt v = vStart; v < vEnd; v++) {
    for (int i = 0; i < 3; i++) x[3 * (v - vStart) + i] = point[v].u.x[i];
  }
  PetscCall(DMPlexBuildCoordinatesFromCellList(dm, 3, x));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDistribute(MPI_Comm comm, const char *partitioner, SbWhole *w, DM *dm, SbPoint **point)
{
  PetscMPIInt size;
  PetscInt npoint;
  PetscSF sf = NULL;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(create_serial(comm, w, dm));
  if (size > 1) PetscCall(migrate(partitioner, w, dm, &sf));
  PetscCall(DMPlexGetChart(*dm, NULL, &npoint));
  PetscCall(PetscMalloc1(npoint, point));
  if (sf)
    PetscCall(send_points(sf, w, *point));
  else
    PetscCall(PetscArraycpy(*point, w->point, npoint));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(SbWholeDestroy(w));
  PetscCall(set_coordinates(*dm, *point));
  PetscFunctionReturn(PETSC_SUCCESS);
}
