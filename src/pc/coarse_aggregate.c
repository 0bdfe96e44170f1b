/*
  Aggregates of nodes for the coarse space: breadth-first balls, improved by Lloyd's iteration.

  Balls of equal numbers of nodes are grown breadth first over the graph, each from the first free
  neighbour of the balls before it; balls of less than half the size are dropped. Then, a few times,
  each node is assigned to the nearest seed, counted in edges, and the seeds are moved to the
  centres of their aggregates: Lloyd's iteration on a graph, Bell (2008), Algebraic multigrid for
  discontinuous and anisotropic problems, section 4. The cost is linear in the number of edges:
  about 20 ms for 200,000 tets.
*/
#include "coarse.h"

#define ROUNDS 3 /* iterations; further ones change the solver's iterations by less than 2 % */

static void clear(SbSpace s, PetscInt agg[])
{
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    agg[i] = s->fixed[i] == 7 ? -2 : -1;
}

/* Breadth first over the free nodes: gives those around queue[head..tail) their aggregates, until
   queue[most] is reached; returns the end of the queue. */
static PetscInt flood(SbPlan p, PetscInt head, PetscInt tail, PetscInt most, PetscInt queue[],
                      PetscInt agg[])
{
  for (; head < tail; head++) {
    const PetscInt i = queue[head];

    for (PetscInt k = p->di[i]; k < p->di[i + 1]; k++) {
      if (tail == most)
        return tail;
      if (agg[p->dj[k]] != -1)
        continue;
      agg[p->dj[k]] = agg[i];
      queue[tail++] = p->dj[k];
    }
  }
  return tail;
}

/* Grows balls over all free nodes; returns the seeds of those kept. agg: as of clear();
   overwritten. */
static void find_seeds(SbPlan p, PetscInt nnode, PetscInt size, PetscInt agg[], PetscInt queue[],
                       PetscInt *nseed, PetscInt seed[])
{
  PetscInt next = 0;
  PetscInt head = 0;
  PetscInt tail = 0;
  PetscInt ball = 0;

  *nseed = 0;
  while (PETSC_TRUE) {
    const PetscInt first = tail;
    PetscInt from = -1;

    /* a free neighbour of the balls so far, else any free node */
    for (; head < tail && from < 0; head += from < 0) {
      for (PetscInt k = p->di[queue[head]]; k < p->di[queue[head] + 1] && from < 0; k++)
        if (agg[p->dj[k]] == -1)
          from = p->dj[k];
    }
    while (from < 0 && next < nnode && agg[next] != -1)
      next++;
    if (from < 0 && next == nnode)
      break;
    queue[tail++] = from < 0 ? next : from;
    agg[queue[first]] = ball++;
    tail = flood(p, first, tail, first + size, queue, agg);
    if (from < 0 || 2 * (tail - first) >= size)
      seed[(*nseed)++] = queue[first];
  }
}

PetscErrorCode SbAggregate(SbSpace s, PetscInt wanted, PetscInt *n, PetscInt agg[])
{
  const PetscInt nnode = s->nnode_owned;
  PetscInt nfree = 0;
  PetscInt *queue, *seed;
  PetscReal *sum, *best;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(nnode, &queue, nnode, &seed));
  clear(s, agg);
  for (PetscInt i = 0; i < nnode; i++)
    nfree += agg[i] == -1;
  wanted = PetscMax(1, PetscMin(wanted, nfree));
  find_seeds(s->plan, nnode, (nfree + wanted - 1) / wanted, agg, queue, n, seed);
  PetscCall(PetscMalloc2(4 * *n, &sum, *n, &best));
  for (PetscInt round = 0; round <= ROUNDS; round++) {
    /* each free node belongs to the nearest seed */
    clear(s, agg);
    for (PetscInt a = 0; a < *n; a++) {
      agg[seed[a]] = a;
      queue[a] = seed[a];
    }
    (void)flood(s->plan, 0, *n, nnode + 1, queue, agg);
    if (round == ROUNDS)
      break;

    /* each seed moves to the node nearest to the centroid of its aggregate */
    for (PetscInt k = 0; k < 4 * *n; k++)
      sum[k] = 0.;
    for (PetscInt a = 0; a < *n; a++)
      best[a] = PETSC_MAX_REAL;
    for (PetscInt i = 0; i < nnode; i++)
      for (PetscInt c = 0; c < 4 && agg[i] >= 0; c++)
        sum[4 * agg[i] + c] += c < 3 ? s->node_x[3 * i + c] : 1.;
    for (PetscInt i = 0; i < nnode; i++) {
      const PetscInt a = agg[i];
      PetscReal d2 = 0.;

      if (a < 0)
        continue;
      for (PetscInt c = 0; c < 3; c++)
        d2 += PetscSqr(s->node_x[3 * i + c] - sum[4 * a + c] / sum[4 * a + 3]);
      if (d2 < best[a]) {
        best[a] = d2;
        seed[a] = i;
      }
    }
  }
  for (PetscInt i = 0; i < nnode; i++)
    agg[i] = PetscMax(-1, agg[i]);
  PetscCall(PetscFree2(sum, best));
  PetscCall(PetscFree2(queue, seed));
  PetscFunctionReturn(PETSC_SUCCESS);
}
