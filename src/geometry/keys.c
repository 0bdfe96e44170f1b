/*
  keys.c - sorts items by keys, so that items with equal keys are consecutive.
*/
#include <stdlib.h>
#include "sbgeometry.h"

static int compare_items(const void *a, const void *b)
{
  const SbKey *p = (const SbKey *)a;
  const SbKey *q = (const SbKey *)b;

  if (p->key != q->key)
    return p->key < q->key ? -1 : 1;
  return (p->slot > q->slot) - (p->slot < q->slot);
}

void SbKeysSort(PetscInt n, SbKey item[])
{
  if (n > 0)
    qsort(item, (size_t)n, sizeof(*item), compare_items);
}

PetscInt SbKeysAlike(PetscInt n, const SbKey item[], PetscInt i)
{
  PetscInt m = 1;

  while (i + m < n && item[i + m].key == item[i].key)
    m++;
  return m;
}

PetscInt SbKeysFind(PetscInt n, const SbKey item[], uint64_t key)
{
  PetscInt begin = 0;
  PetscInt left = n;

  while (left > 0) {
    const PetscInt half = left / 2;
    const PetscBool below = (PetscBool)(item[begin + half].key < key);

    begin += below ? half + 1 : 0;
    left = below ? left - half - 1 : half;
  }
  return begin < n && item[begin].key == key ? begin : -1;
}
