/*
  array.c - growing arrays, bucket sort, gathering over all ranks.
*/
#include "sbbase.h"

PetscErrorCode SbReserve(PetscInt need, size_t unit, PetscInt *size, void *array)
{
  PetscFunctionBeginUser;
  if (need <= *size)
    PetscFunctionReturn(PETSC_SUCCESS);
  *size = PetscMax(PetscMax(need, 2 * *size), 16);
  PetscCall(PetscRealloc((size_t)*size * unit, (void **)array));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBucketByKey(PetscInt n, const PetscInt key[], PetscInt nkey, PetscInt **start,
                             PetscInt **item)
{
  PetscInt *first;

  PetscFunctionBeginUser;

  /* counts are offset by two, so that filling leaves first[k] at the first position of key k */
  PetscCall(PetscCalloc1((size_t)nkey + 2, &first));
  for (PetscInt i = 0; i < n; i++)
    if (key[i] >= 0 && key[i] < nkey)
      first[key[i] + 2]++;
  for (PetscInt k = 0; k < nkey; k++)
    first[k + 2] += first[k + 1];
  PetscCall(PetscMalloc1(first[nkey + 1], item));
  for (PetscInt i = 0; i < n; i++)
    if (key[i] >= 0 && key[i] < nkey)
      (*item)[first[key[i] + 1]++] = i;
  *start = first;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int compare_keys(const void *a, const void *b, void *nkey)
{
  const PetscInt *p = (const PetscInt *)a;
  const PetscInt *q = (const PetscInt *)b;

  for (int k = 0; k < *(int *)nkey; k++)
    if (p[k] != q[k])
      return p[k] < q[k] ? -1 : 1;
  return 0;
}

PetscErrorCode SbSortByKeys(PetscInt n, size_t size, int nkey, void *item)
{
  PetscFunctionBeginUser;
  if (n > 1)
    PetscCall(PetscTimSort(n, item, size, compare_keys, &nkey));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbAllgatherv(MPI_Comm comm, MPI_Datatype type, PetscInt n, const void *mine,
                            PetscInt *total, void *all, PetscInt *before)
{
  PetscMPIInt nrank, rank, size, count, *counts, *offsets;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &nrank));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Type_size(type, &size));
  PetscCall(PetscMalloc2(nrank, &counts, nrank, &offsets));
  PetscCall(PetscMPIIntCast(n, &count));
  PetscCallMPI(MPI_Allgather(&count, 1, MPI_INT, counts, 1, MPI_INT, comm));
  *total = 0;
  for (PetscMPIInt r = 0; r < nrank; r++) {
    PetscCall(PetscMPIIntCast(*total, &offsets[r]));
    *total += counts[r];
  }
  if (before)
    *before = offsets[rank];
  PetscCall(PetscMalloc((size_t)*total * (size_t)size, (void **)all));
  PetscCallMPI(MPI_Allgatherv(mine, count, type, *(void **)all, counts, offsets, type, comm));
  PetscCall(PetscFree2(counts, offsets));
  PetscFunctionReturn(PETSC_SUCCESS);
}
