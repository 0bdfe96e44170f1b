/*
  Original order: vertices, cells and nodes by their number in the scenario, whatever the partition.

  Rank r of p holds the slice of numbers [N r / p, N (r + 1) / p) (PETSc's usual layout). A star forest
  connects each owned entity (a leaf) with its position in a slice (a root); for any number of components.

  Numbers of nodes at faces have gaps. They are closed once, when an order is made: every number that is taken
  marks its position among all possible ones; the count of marks from the lowest rank on is its new number.
*/
#include "output_impl.h"

PetscErrorCode SbOrderCreate(MPI_Comm comm, PetscInt N, PetscInt nowned, const PetscInt original[],
                             SbOrder *order)
{
  PetscLayout layout;
  PetscInt end;

  PetscFunctionBeginUser;
  PetscCall(PetscLayoutCreate(comm, &layout));
  PetscCall(PetscLayoutSetSize(layout, N));
  PetscCall(PetscLayoutSetUp(layout));
  PetscCall(PetscLayoutGetRange(layout, &order->start, &end));
  order->comm = comm;
  order->N = N;
  order->n = end - order->start;
  order->nowned = nowned;
  order->each = 1;
  PetscCall(PetscSFCreate(comm, &order->sf));
  PetscCall(PetscSFSetGraphLayout(order->sf, layout, nowned, NULL, PETSC_COPY_VALUES, original));
  PetscCall(PetscSFSetUp(order->sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderCreateSparse(MPI_Comm comm, PetscInt bound, PetscInt nowned, const PetscInt key[],
                                   SbOrder *order)
{
  SbOrder all;
  PetscInt *mark, *number, before = 0, N;

  PetscFunctionBeginUser;
  PetscCall(SbOrderCreate(comm, bound, nowned, key, &all));
  PetscCall(PetscCalloc1(all.n, &mark));
  PetscCall(PetscMalloc1(nowned, &number));
  for (PetscInt i = 0; i < nowned; i++) number[i] = 1;
  PetscCall(SbForestReduce(all.sf, 1, MPIU_INT, number, mark));
  for (PetscInt i = 0; i < all.n; i++) before += mark[i];
  PetscCallMPI(MPI_Allreduce(&before, &N, 1, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Scan(MPI_IN_PLACE, &before, 1, MPIU_INT, MPI_SUM, comm));
  for (PetscInt i = all.n - 1; i >= 0; i--) before = mark[i] ? mark[i] = before - 1 : before;
  PetscCall(SbForestBroadcast(all.sf, 1, MPIU_INT, mark, number));
  PetscCall(SbOrderCreate(comm, N, nowned, number, order));
  PetscCall(PetscFree(mark));
  PetscCall(PetscFree(number));
  PetscCall(SbOrderDestroy(&all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderRepeat(const SbOrder *order, PetscInt each, SbOrder *repeated)
{
  PetscFunctionBeginUser;
  *repeated = *order;
  repeated->each = order->each * each;
  repeated->N *= each;
  repeated->nowned *= each;
  repeated->start *= each;
  repeated->n *= each;
  PetscCall(PetscObjectReference((PetscObject)order->sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderDestroy(SbOrder *order)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSFDestroy(&order->sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderGather(const SbOrder *order, PetscInt ncomp, const PetscReal owned[], PetscReal slice[])
{
  PetscFunctionBeginUser;
  PetscCall(SbForestReduce(order->sf, order->each * ncomp, MPIU_REAL, owned, slice));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderScatter(const SbOrder *order, PetscInt ncomp, const PetscReal slice[],
                              PetscReal owned[])
{
  PetscFunctionBeginUser;
  PetscCall(SbForestBroadcast(order->sf, order->each * ncomp, MPIU_REAL, slice, owned));
  PetscFunctionReturn(PETSC_SUCCESS);
}
