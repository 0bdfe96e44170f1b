/*
  Aggregates of nodes for the coarse space: breadth-first balls, improved by Lloyd's iteration.

  Balls of equal numbers of nodes are grown breadth first over the graph, each from the first free neighbour
  of the balls before it; balls of less than half the size are dropped. Then, a few times, each node is
  assigned to the nearest seed, counted in edges, and the seeds are moved to the centres of their aggregates:
  Lloyd's iteration on a graph, Bell (2008), Algebraic multigrid for discontinuous and anisotropic problems,
  section 4. The cost is linear in the number of edges: about 20 ms for 200,000 tets.
*/
#include "coarse.h"

#define ROUNDS 3 /* iterations; further ones change the solver's iterations by less than 2 % */

/* Grows one ball of at most `size` free nodes from queue[0]; returns its number of nodes. */
static PetscInt grow(SbPlan p, PetscInt size, PetscInt name, PetscInt queue[], PetscInt agg[])
{
  PetscInt tail = 1;

  agg[queue[0]] = name;
  for (PetscInt head = 0; head < tail; head++) {
    for (PetscInt k = p->di[queue[head]]; k < p->di[queue[head] + 1]; k++) {
      if (tail == size) return tail;
      if (agg[p->dj[k]] != -1) continue;
      agg[p->dj[k]] = name;
      queue[tail++] = p->dj[k];
    }
  }
  return tail;
}

/* A free neighbour of the nodes in the front, -1 if there is none. */
static PetscInt free_neighbour(SbPlan p, const PetscInt agg[], const PetscInt front[], PetscInt *head,
                               PetscInt tail)
{
  for (; *head < tail; (*head)++) {
    for (PetscInt k = p->di[front[*head]]; k < p->di[front[*head] + 1]; k++) {
      if (agg[p->dj[k]] == -1) return p->dj[k];
    }
  }
  return -1;
}

/* Grows balls over all free nodes; returns the seeds of those kept. agg: -2 on prescribed nodes, -1 on
   others; overwritten. */
static void find_seeds(SbPlan p, PetscInt nnode, PetscInt size, PetscInt agg[], PetscInt queue[],
                       PetscInt front[], PetscInt *nseed, PetscInt seed[])
{
  PetscInt next = 0, head = 0, tail = 0, ball = 0, count = 0;

  while (PETSC_TRUE) {
    const PetscInt neighbour = free_neighbour(p, agg, front, &head, tail);
    PetscInt n;

    while (neighbour < 0 && next < nnode && agg[next] != -1) next++;
    if (neighbour < 0 && next == nnode) break;
    queue[0] = neighbour < 0 ? next : neighbour;
    n = grow(p, size, ball++, queue, agg);
    if (neighbour < 0 || 2 * n >= size) seed[count++] = queue[0];
    for (PetscInt q = 0; q < n; q++) front[tail++] = queue[q];
  }
  *nseed = count;
}

/* Assigns each free node to the nearest seed. */
static void flood(SbPlan p, PetscInt nseed, const PetscInt seed[], PetscInt queue[], PetscInt agg[])
{
  PetscInt tail = 0;

  for (PetscInt a = 0; a < nseed; a++) {
    agg[seed[a]] = a;
    queue[tail++] = seed[a];
  }
  for (PetscInt head = 0; head < tail; head++) {
    const PetscInt i = queue[head];

    for (PetscInt k = p->di[i]; k < p->di[i + 1]; k++) {
      if (agg[p->dj[k]] != -1) continue;
      agg[p->dj[k]] = agg[i];
      queue[tail++] = p->dj[k];
    }
  }
}

/* Moves each seed to the node nearest to the centroid of its aggregate. */
static void centre(SbSpace s, PetscInt nseed, const PetscInt agg[], PetscReal sum[], PetscReal best[],
                   PetscInt seed[])
{
  for (PetscInt k = 0; k < 4 * nseed; k++) sum[k] = 0.;
  for (PetscInt a = 0; a < nseed; a++) best[a] = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (agg[i] < 0) continue;
    for (PetscInt c = 0; c < 3; c++) sum[4 * agg[i] + c] += s->node_x[3 * i + c];
    sum[4 * agg[i] + 3] += 1.;
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt a = agg[i];
    PetscReal d2 = 0.;

    if (a < 0) continue;
    for (PetscInt c = 0; c < 3; c++) d2 += PetscSqr(s->node_x[3 * i + c] - sum[4 * a + c] / sum[4 * a + 3]);
    if (d2 < best[a]) {
      best[a] = d2;
      seed[a] = i;
    }
  }
}

static void clear(SbSpace s, PetscInt agg[])
{
  for (PetscInt i = 0; i < s->nnode_owned; i++) agg[i] = s->fixed[i] == 7 ? -2 : -1;
}

PetscErrorCode SbAggregate(SbSpace s, PetscInt wanted, PetscInt *n, PetscInt agg[])
{
  const PetscInt nnode = s->nnode_owned;
  PetscInt nfree = 0, *queue, *front, *seed;
  PetscReal *sum, *best;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc3(nnode, &queue, nnode, &front, nnode, &seed));
  clear(s, agg);
  for (PetscInt i = 0; i < nnode; i++) nfree += agg[i] == -1;
  wanted = PetscMax(1, PetscMin(wanted, nfree));
  find_seeds(s->plan, nnode, (nfree + wanted - 1) / wanted, agg, queue, front, n, seed);
  PetscCall(PetscMalloc2(4 * *n, &sum, *n, &best));
  for (PetscInt round = 0; round <= ROUNDS; round++) {
    clear(s, agg);
    flood(s->plan, *n, seed, queue, agg);
    if (round < ROUNDS) centre(s, *n, agg, sum, best, seed);
  }
  for (PetscInt i = 0; i < nnode; i++) agg[i] = PetscMax(-1, agg[i]);
  PetscCall(PetscFree2(sum, best));
  PetscCall(PetscFree3(queue, front, seed));
  PetscFunctionReturn(PETSC_SUCCESS);
}
