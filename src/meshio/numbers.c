/*
  numbers.c - map from the numbers of nodes, elements or groups in a file to their indices in
  memory.

  Consecutive numbers need nothing but the first one, others a hash table, at most half full.
*/
#include "meshio_impl.h"

/* Slot of a number, or the free one for it. */
static PetscInt *find_slot(const SbNumbers *s, int64_t number)
{
  PetscInt k = (PetscInt)((uint64_t)number * 0x9e3779b97f4a7c15u >> 33) & (s->nslot - 1);

  while (s->slot[k] >= 0 && s->number[s->slot[k]] != number)
    k = (k + 1) & (s->nslot - 1);
  return &s->slot[k];
}

PetscErrorCode SbNumbersAdd(SbNumbers *s, int64_t number)
{
  PetscFunctionBeginUser;
  PetscCall(SbReserve(s->n + 1, sizeof(*s->number), &s->capacity, &s->number));
  s->number[s->n++] = number;
  if (!s->nslot && (uint64_t)number - (uint64_t)s->number[0] == (uint64_t)s->n - 1)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (2 * s->n > s->nslot) {
    for (s->nslot = 64; s->nslot < 4 * s->n;)
      s->nslot *= 2;
    PetscCall(PetscFree(s->slot));
    PetscCall(PetscMalloc1(s->nslot, &s->slot));
    for (PetscInt k = 0; k < s->nslot; k++)
      s->slot[k] = -1;
    for (PetscInt i = 0; i < s->n; i++)
      *find_slot(s, s->number[i]) = i;
  }
  *find_slot(s, number) = s->n - 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNumbersDestroy(SbNumbers *s)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(s->number));
  PetscCall(PetscFree(s->slot));
  PetscCall(PetscMemzero(s, sizeof(*s)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbNumbersFind(const SbNumbers *s, int64_t number)
{
  uint64_t at;

  if (s->nslot)
    return *find_slot(s, number);
  at = s->n ? (uint64_t)number - (uint64_t)s->number[0] : 0;
  return at < (uint64_t)s->n ? (PetscInt)at : -1;
}
