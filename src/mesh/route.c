/*
  route.c - records of fixed size to other ranks, and answers to them: a star forest from the
  records that a rank gets to those that others send, in the order of the ranks. Records to the own
  rank take the same way, so that callers need no special case.
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
  PetscInt64 total = 0;
  PetscInt *count, *next;
  PetscSFNode *place;
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscCalloc2(size, &count, size, &next));
  PetscCall(PetscMalloc1(n, &place));
  for (PetscInt i = 0; i < n; i++)
    count[dest[i]]++;

  // records that come from each rank, and where they begin, which that rank is told
  PetscCallMPI(MPI_Alltoall(count, 1, MPIU_INT, next, 1, MPIU_INT, comm));
  for (PetscMPIInt r = 0; r < size; r++) {
    count[r] = (PetscInt)PetscMin(total, PETSC_MAX_INT);
    total += next[r];
  }
  PetscCheck(total <= PETSC_MAX_INT, PETSC_COMM_SELF, PETSC_ERR_SUP,
             "One rank would get %lld records of the mesh, this build counts to %" PetscInt_FMT
             "; take more ranks",
             (long long)total, PETSC_MAX_INT);
  PetscCallMPI(MPI_Alltoall(count, 1, MPIU_INT, next, 1, MPIU_INT, comm));
  for (PetscInt i = 0; i < n; i++)
    place[i] = (PetscSFNode){dest[i], next[dest[i]]++};
  PetscCall(PetscFree2(count, next));
  *route = (SbRoute){.nsend = n, .nrecv = (PetscInt)total, .which = which, .place = place};
  PetscCall(PetscFree(dest));
  PetscCall(PetscSFCreate(comm, &route->sf));
  PetscCall(
    PetscSFSetGraph(route->sf, route->nrecv, n, NULL, PETSC_COPY_VALUES, place, PETSC_USE_POINTER));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteDestroy(SbRoute *route)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSFDestroy(&route->sf));
  PetscCall(PetscFree(route->which));
  PetscCall(PetscFree(route->place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteSend(const SbRoute *route, size_t unit, const PetscInt which[],
                           const void *record, void *received)
{
  char *out = NULL;
  char *in;

  PetscFunctionBeginUser;
  if (which)
    PetscCall(PetscMalloc(unit * (size_t)route->nsend, &out));
  for (PetscInt i = 0; which && i < route->nsend; i++)
    memcpy(out + unit * (size_t)i, (const char *)record + unit * (size_t)which[i], unit);
  PetscCall(PetscMalloc(unit * (size_t)route->nrecv, &in));
  PetscCall(SbForestReduce(route->sf, (PetscInt)unit, MPI_BYTE, which ? out : record, in));
  PetscCall(PetscFree(out));
  *(void **)received = in;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbRouteReply(const SbRoute *route, size_t unit, const void *answer, void *result)
{
  PetscFunctionBeginUser;
  PetscCall(SbForestBroadcast(route->sf, (PetscInt)unit, MPI_BYTE, answer, result));
  PetscFunctionReturn(PETSC_SUCCESS);
}
