/*
  Original order: vertices and cells by their number in the scenario, whatever the partition.

  Rank r of p holds the slice of numbers [N r / p, N (r + 1) / p) (PETSc's usual layout). A star forest connects each owned
  entity (a leaf) with its place in a slice (a root); it is built once and moves any number of components at once.
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
  PetscCall(PetscSFCreate(comm, &order->sf));
  PetscCall(PetscSFSetGraphLayout(order->sf, layout, nowned, NULL, PETSC_COPY_VALUES, original));
  PetscCall(PetscSFSetUp(order->sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderDestroy(SbOrder *order)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSFDestroy(&order->sf));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode unit_create(PetscInt ncomp, MPI_Datatype *unit)
{
  PetscMPIInt n;

  PetscFunctionBeginUser;
  PetscCall(PetscMPIIntCast(ncomp, &n));
  PetscCallMPI(MPI_Type_contiguous(n, MPIU_REAL, unit));
  PetscCallMPI(MPI_Type_commit(unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderGather(const SbOrder *order, PetscInt ncomp, const PetscReal owned[], PetscReal slice[])
{
  MPI_Datatype unit;

  PetscFunctionBeginUser;
  PetscCall(unit_create(ncomp, &unit));
  PetscCall(PetscSFReduceBegin(order->sf, unit, owned, slice, MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(order->sf, unit, owned, slice, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbOrderScatter(const SbOrder *order, PetscInt ncomp, const PetscReal slice[],
                              PetscReal owned[])
{
  MPI_Datatype unit;

  PetscFunctionBeginUser;
  PetscCall(unit_create(ncomp, &unit));
  PetscCall(PetscSFBcastBegin(order->sf, unit, slice, owned, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(order->sf, unit, slice, owned, MPI_REPLACE));
  PetscCallMPI(MPI_Type_free(&unit));
  PetscFunctionReturn(PETSC_SUCCESS);
}
