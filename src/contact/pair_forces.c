/*
  pair_forces.c - the table of multipliers of pairs: entries are found by the features of a pair,
  whose numbers do not depend on the partition.
*/
#include "surfaces.h"

void SbPairKey(const Surfaces *b, const SbContactPair *pair, PetscInt key[PAIR_KEY])
{
  key[0] = pair->side;
  key[1] = pair->kind;
  for (int k = 0; k < 4; k++)
    key[2 + k] = SbContactNumber(b->surface, pair->v[k]);
}

int SbPairForceOrder(const void *p, const void *q)
{
  const PetscInt *one = ((const PairForce *)p)->key;
  const PetscInt *two = ((const PairForce *)q)->key;

  for (int k = 0; k < PAIR_KEY; k++)
    if (one[k] != two[k])
      return one[k] < two[k] ? -1 : 1;
  return 0;
}

const PairForce *SbMultiplierFind(const Surfaces *b, const SbContactPair *pair)
{
  const PairForces *m = &b->multipliers.now;
  PairForce at;

  if (!m->n)
    return NULL;
  SbPairKey(b, pair, at.key);
  return (const PairForce *)bsearch(&at, m->pair, (size_t)m->n, sizeof(at), SbPairForceOrder);
}
