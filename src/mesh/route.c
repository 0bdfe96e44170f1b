/*
  route.c - sparse communication of fixed-size records: one all-to-all exchange of counts, then one
  of the records; replies return by the reverse route. Records to the own rank take the same route,
  so that callers need no special case.
*/
#include "mesh_impl.h"

PetscErrorCode SbRouteAdd(SbRouteList *list, PetscInt item, PetscMPIInt rank)
{
  PetscFunctionBeginUser;
  PetscCall(SbReserve(list->n + 1, sizeof(*list->item), &list->room[0], &list->item));
  PetscCall(SbReserve(list->n + 1, sizeof(*list->rank), &list->room[1], &list->rank));
  list->item[list->n] = item;
  list->rank[list->n++] = rank;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteCreate(MPI_Comm comm, PetscInt n, PetscInt *which, PetscMPIInt *dest,
                             SbRoute *route)
{
  PetscFunctionBeginUser;
  *route = (SbRoute){.comm = comm, .nsend = n, .which = which, .dest = dest};
  PetscCallMPI(MPI_Comm_size(comm, &route->size));
  PetscCall(PetscCalloc5(route->size, &route->scount, route->size, &route->sfirst, route->size,
                         &route->rcount, route->size, &route->rfirst, n, &route->position));
  for (PetscInt i = 0; i < n; i++)
    route->scount[dest[i]]++;
  PetscCallMPI(MPI_Alltoall(route->scount, 1, MPI_INT, route->rcount, 1, MPI_INT, comm));

  // offsets of the records of each rank: sums of the counts before it
  for (int k = 0; k < 2; k++) {
    const PetscMPIInt *count = k ? route->rcount : route->scount;
    PetscMPIInt *first = k ? route->rfirst : route->sfirst;
    PetscInt64 total = 0;

    for (PetscMPIInt r = 0; r < route->size; r++) {
      PetscCall(PetscMPIIntCast((PetscInt)PetscMin(total, PETSC_MAX_INT), &first[r]));
      total += count[r];
    }
    PetscCheck(
      total <= PETSC_MPI_INT_MAX, PETSC_COMM_SELF, PETSC_ERR_SUP,
      "One rank would send or get %lld records of the mesh, MPI counts to %d; take more ranks",
      (long long)total, PETSC_MPI_INT_MAX);
    route->nrecv = (PetscInt)total;
  }
  for (PetscInt i = 0; i < n; i++)
    route->position[i] = route->sfirst[dest[i]]++;
  for (PetscMPIInt r = 0; r < route->size; r++)
    route->sfirst[r] -= route->scount[r];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteDestroy(SbRoute *route)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(route->which));
  PetscCall(PetscFree(route->dest));
  PetscCall(
    PetscFree5(route->scount, route->sfirst, route->rcount, route->rfirst, route->position));
  PetscCall(PetscMemzero(route, sizeof(*route)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode exchange(const SbRoute *route, size_t unit, PetscBool back, const void *out,
                               void *in)
{
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Type_contiguous((int)unit, MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Alltoallv(
    out, back ? route->rcount : route->scount, back ? route->rfirst : route->sfirst, type, in,
    back ? route->scount : route->rcount, back ? route->sfirst : route->rfirst, type, route->comm));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteSend(const SbRoute *route, size_t unit, const PetscInt which[],
                           const void *record, void *received)
{
  char *out, *in;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc(unit * (size_t)route->nsend, &out));
  for (PetscInt i = 0; i < route->nsend; i++)
    memcpy(out + unit * (size_t)route->position[i],
           (const char *)record + unit * (size_t)(which ? which[i] : i), unit);
  PetscCall(PetscMalloc(unit * (size_t)route->nrecv, &in));
  PetscCall(exchange(route, unit, PETSC_FALSE, out, in));
  PetscCall(PetscFree(out));
  *(void **)received = in;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteReply(const SbRoute *route, size_t unit, const void *answer, void *result)
{
  char *in;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc(unit * (size_t)route->nsend, &in));
  PetscCall(exchange(route, unit, PETSC_TRUE, answer, in));
  for (PetscInt i = 0; i < route->nsend; i++)
    memcpy((char *)result + unit * (size_t)i, in + unit * (size_t)route->position[i], unit);
  PetscCall(PetscFree(in));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscMPIInt SbRouteSource(const SbRoute *route, PetscInt i)
{
  PetscMPIInt low = 0;
  PetscMPIInt high = route->size;

  while (high - low > 1) {
    const PetscMPIInt middle = low + (high - low) / 2;

    if (route->rfirst[middle] <= i)
      low = middle;
    else
      high = middle;
  }
  return low;
}
