/*
  numbers.c - map from the numbers of nodes or elements in a file to their indices in memory.

  A table if the numbers are dense, else pairs sorted by number.
*/
#include <stdlib.h>
#include "meshio_impl.h"

static int compare_numbers(const void *a, const void *b)
{
  const int64_t p = ((const SbNumbered *)a)->number, q = ((const SbNumbered *)b)->number;

  return (p > q) - (p < q);
}

PetscErrorCode SbNumbersCreate(PetscInt n, const int64_t number[], SbNumbers *index)
{
  int64_t lo = n ? number[0] : 0, hi = lo;

  PetscFunctionBeginUser;
  PetscCall(SbNumbersDestroy(index));
  for (PetscInt v = 1; v < n; v++) {
    lo = PetscMin(lo, number[v]);
    hi = PetscMax(hi, number[v]);
  }
  index->n = n;
  index->first = lo;
  if ((uint64_t)hi - (uint64_t)lo < 16 * (uint64_t)n + 1024) {
    index->ntable = hi - lo + 1;
    // dense numbers: a table
    PetscCall(PetscMalloc1((size_t)index->ntable, &index->table));
    for (int64_t i = 0; i < index->ntable; i++) index->table[i] = -1;
    for (PetscInt v = 0; v < n; v++) {
      PetscInt *slot = index->table + (number[v] - index->first);

      if (*slot >= 0) {
        index->repeated = PETSC_TRUE;
        index->twice = number[v];
      }
      *slot = v;
    }
  } else {
    // sparse numbers: sorted pairs
    PetscCall(PetscMalloc1(n, &index->sorted));
    for (PetscInt v = 0; v < n; v++) index->sorted[v] = (SbNumbered){number[v], v};
    qsort(index->sorted, (size_t)n, sizeof(*index->sorted), compare_numbers);
    for (PetscInt v = 1; v < n; v++) {
      if (index->sorted[v].number != index->sorted[v - 1].number) continue;
      index->repeated = PETSC_TRUE;
      index->twice = index->sorted[v].number;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbNumbersDestroy(SbNumbers *index)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(index->table));
  PetscCall(PetscFree(index->sorted));
  PetscCall(PetscMemzero(index, sizeof(*index)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt SbNumbersFind(const SbNumbers *index, int64_t number)
{
  const SbNumbered key = {number, 0};
  const SbNumbered *found;

  if (index->table) {
    const uint64_t i = (uint64_t)number - (uint64_t)index->first;

    return number < index->first || i >= (uint64_t)index->ntable ? -1 : index->table[i];
  }
  if (!index->sorted) return -1;
  found = (const SbNumbered *)bsearch(&key, index->sorted, (size_t)index->n, sizeof(key), compare_numbers);
  return found ? found->vert : -1;
}
