/* forest.c - star forests: exchange of data between ranks by numbers that all of them know. */
#include "mesh_impl.h"

PetscErrorCode SbForestCreate(MPI_Comm comm, PetscInt nroot, PetscInt n, const PetscInt root[],
                              PetscSF *forest)
{
  PetscLayout layout;

  PetscFunctionBeginUser;
  PetscCall(PetscLayoutCreateFromSizes(comm, nroot, PETSC_DETERMINE, 1, &layout));
  PetscCall(PetscSFCreate(comm, forest));
  PetscCall(PetscSFSetGraphLayout(*forest, layout, n, NULL, PETSC_COPY_VALUES, root));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForestRanks(PetscSF forest, PetscInt **start, PetscMPIInt **user)
{
  const PetscInt *degree;
  PetscInt nroot, nleaf;
  PetscMPIInt *mine, rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)forest), &rank));
  PetscCall(PetscSFGetGraph(forest, &nroot, &nleaf, NULL, NULL));
  PetscCall(PetscSFComputeDegreeBegin(forest, &degree));
  PetscCall(PetscSFComputeDegreeEnd(forest, &degree));
  PetscCall(PetscCalloc1(nroot + 1, start));
  for (PetscInt v = 0; v < nroot; v++)
    (*start)[v + 1] = (*start)[v] + degree[v];
  PetscCall(PetscMalloc1((*start)[nroot], user));
  PetscCall(PetscMalloc1(nleaf, &mine));
  for (PetscInt i = 0; i < nleaf; i++)
    mine[i] = rank;
  PetscCall(PetscSFGatherBegin(forest, MPI_INT, mine, *user));
  PetscCall(PetscSFGatherEnd(forest, MPI_INT, mine, *user));
  PetscCall(PetscFree(mine));
  for (PetscInt v = 0; v < nroot; v++)
    PetscCall(PetscSortMPIInt(degree[v], *user + (*start)[v]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* MPI type of n contiguous items of type `one`. */
static PetscErrorCode create_type(PetscInt n, MPI_Datatype one, MPI_Datatype *type)
{
  PetscMPIInt count;

  PetscFunctionBeginUser;
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCallMPI(MPI_Type_contiguous(count, one, type));
  PetscCallMPI(MPI_Type_commit(type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForestReduce(PetscSF sf, PetscInt n, MPI_Datatype one, const void *leaf,
                              void *root)
{
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCall(create_type(n, one, &type));
  PetscCall(PetscSFReduceBegin(sf, type, leaf, root, MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(sf, type, leaf, root, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbForestBroadcast(PetscSF sf, PetscInt n, MPI_Datatype one, const void *root,
                                 void *leaf)
{
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCall(create_type(n, one, &type));
  PetscCall(PetscSFBcastBegin(sf, type, root, leaf, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, type, root, leaf, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}
