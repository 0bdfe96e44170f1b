/*
  contact_blocks.c - the Hessian of contact, summed over pairs of surface vertices, then assembled at the nodes.

  A vertex of the surface is at x_v = X_v + sum_j w_vj u_j, so the derivative by the nodes is S^T H S with S = (w_vj). H is summed first, in blocks of two
  vertices: pairs of features share them, and a vertex of CR and DG has some twenty nodes. Then the rows of T = H S, and of S^T T, are formed, each
  column once.

  Sums run in the order of the pairs of features and in that of the vertices' numbers: neither depends on the partition.
*/
#include "sbbarrier.h"

PetscErrorCode SbContactBlocksFree(SbContactBlocks *b)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(b->v));
  PetscCall(PetscFree(b->block));
  PetscCall(PetscFree(b->slot));
  *b = (SbContactBlocks){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Slot of the vertex pair in the hash table: where it is, or the free one where it belongs. */
static inline PetscInt find_slot(const SbContactBlocks *b, PetscInt v, PetscInt w)
{
  PetscInt at =
    (PetscInt)((0x9e3779b97f4a7c15ULL * (((uint64_t)v << 32) ^ (uint64_t)w)) >> 32) & (b->nslot - 1);

  while (b->slot[at] >= 0 && (b->v[b->slot[at]][0] != v || b->v[b->slot[at]][1] != w))
    at = (at + 1) & (b->nslot - 1);
  return at;
}

PetscErrorCode SbContactBlocksClear(SbContactBlocks *b)
{
  PetscFunctionBeginUser;
  b->n = 0;
  for (PetscInt k = 0; k < b->nslot; k++) b->slot[k] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactBlocksAdd(SbContactBlocks *b, PetscInt v, PetscInt w, const PetscReal H[],
                                  PetscInt ld)
{
  const PetscInt low = PetscMin(v, w), high = PetscMax(v, w);
  PetscReal *to;
  PetscInt at;

  PetscFunctionBeginUser;
  /* room for one more, the table at most half full */
  if (b->n == b->size) {
    b->size = PetscMax(512, 2 * b->size);
    b->nslot = 2 * b->size;
    PetscCall(PetscRealloc((size_t)b->size * sizeof(*b->v), &b->v));
    PetscCall(PetscRealloc((size_t)b->size * sizeof(*b->block), &b->block));
    PetscCall(PetscRealloc((size_t)b->nslot * sizeof(*b->slot), &b->slot));
    for (PetscInt k = 0; k < b->nslot; k++) b->slot[k] = -1;
    for (PetscInt k = 0; k < b->n; k++) b->slot[find_slot(b, b->v[k][0], b->v[k][1])] = k;
  }
  at = find_slot(b, low, high);
  if (b->slot[at] < 0) {
    b->slot[at] = b->n;
    b->v[b->n][0] = low;
    b->v[b->n][1] = high;
    for (int e = 0; e < 9; e++) b->block[b->n][e] = 0.;
    b->n++;
  }
  to = b->block[b->slot[at]];
  for (int p = 0; p < 3; p++) {
    for (int q = 0; q < 3; q++) to[3 * p + q] += v <= w ? H[ld * p + q] : H[ld * q + p];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* to += weight times the block, its transpose, or either with columns of prescribed components zero. */
static inline void add_weighted(PetscReal weight, const PetscReal block[9], PetscBool transposed,
                                uint8_t fixed, PetscReal to[9])
{
  for (int e = 0; e < 9; e++) {
    if (!(fixed >> (e % 3) & 1)) to[e] += weight * block[transposed ? 3 * (e % 3) + e / 3 : e];
  }
}

PetscErrorCode SbContactBlocksToNodes(SbContactMesh m, const SbContactBlocks *b, SbBlocks *to)
{
  const SbSpace s = m->space;
  const PetscInt nv = m->nbody_vertex;
  PetscInt *row_of, *first, *entry, *begin, *holder, *at, *start, *column, n = 0, size = 0;
  PetscReal(*T)[9] = NULL;

  PetscFunctionBeginUser;
  if (!b->n) PetscFunctionReturn(PETSC_SUCCESS);

  /* blocks by their rows, those of vertices that have nodes here: twice the number, odd where it is the transpose */
  PetscCall(PetscCalloc2(s->nnode_owned + 2, &begin, s->Nnode, &at));
  PetscCall(PetscMalloc2(2 * b->n, &row_of, nv + 1, &start));
  for (PetscInt k = 0; k < 2 * b->n; k++) {
    const PetscInt *v = b->v[k / 2];

    row_of[k] = m->mine[v[k % 2]] && (k % 2 == 0 || v[0] != v[1]) ? v[k % 2] : -1;
  }
  PetscCall(SbBucketByKey(2 * b->n, row_of, nv, &first, &entry));

  /* T: for each of these vertices a row over nodes */
  column = NULL;
  for (PetscInt v = 0; v < nv; v++) {
    start[v] = n;
    for (PetscInt k = first[v]; k < first[v + 1]; k++) {
      const PetscInt w = b->v[entry[k] / 2][1 - entry[k] % 2];

      if (n + m->start[w + 1] - m->start[w] > size) {
        size = 2 * size + 1024 + m->start[w + 1] - m->start[w];
        PetscCall(PetscRealloc((size_t)size * sizeof(*column), &column));
        PetscCall(PetscRealloc((size_t)size * sizeof(*T), &T));
      }
      for (PetscInt j = m->start[w]; j < m->start[w + 1]; j++) {
        const PetscInt g = m->gnode[j];

        if (m->fixed[j] == 7) continue;
        if (at[g] < start[v] || at[g] >= n || column[at[g]] != g) {
          at[g] = n;
          column[n] = g;
          for (int e = 0; e < 9; e++) T[n][e] = 0.;
          n++;
        }
        add_weighted(m->weight[j], b->block[entry[k] / 2], (PetscBool)(entry[k] % 2), m->fixed[j], T[at[g]]);
      }
    }
  }
  start[nv] = n;

  /* own nodes and the vertices that they are part of */
  for (PetscInt v = 0; v < nv; v++) {
    for (PetscInt j = m->start[v]; j < (start[v + 1] > start[v] ? m->start[v + 1] : 0); j++) {
      if (m->node[j] >= 0 && m->node[j] < s->nnode_owned && m->fixed[j] != 7) begin[m->node[j] + 2]++;
    }
  }
  for (PetscInt i = 0; i < s->nnode_owned; i++) begin[i + 2] += begin[i + 1];
  PetscCall(PetscMalloc1(2 * begin[s->nnode_owned + 1], &holder));
  for (PetscInt v = 0; v < nv; v++) {
    for (PetscInt j = m->start[v]; j < (start[v + 1] > start[v] ? m->start[v + 1] : 0); j++) {
      PetscInt *next;

      if (m->node[j] < 0 || m->node[j] >= s->nnode_owned || m->fixed[j] == 7) continue;
      next = &begin[m->node[j] + 1];
      holder[2 * *next] = v;
      holder[2 * (*next)++ + 1] = j;
    }
  }

  /* S^T T, row by row */
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt row = to->n;
    PetscInt most = 0;

    for (PetscInt h = begin[i]; h < begin[i + 1]; h++)
      most += start[holder[2 * h] + 1] - start[holder[2 * h]];
    if (most) PetscCall(SbBlocksReserve(to, most));
    for (PetscInt h = begin[i]; h < begin[i + 1]; h++) {
      const PetscInt v = holder[2 * h], j = holder[2 * h + 1];

      for (PetscInt k = start[v]; k < start[v + 1]; k++) {
        const PetscInt g = column[k];
        PetscReal *sum;

        if (at[g] < row || at[g] >= to->n || to->node[at[g]][1] != g) {
          at[g] = to->n;
          to->node[to->n][0] = i;
          to->node[to->n][1] = g;
          for (int e = 0; e < 9; e++) to->block[to->n][e] = 0.;
          to->n++;
        }
        sum = to->block[at[g]];
        for (int e = 0; e < 9; e++) sum[e] += (m->fixed[j] >> (e / 3) & 1 ? 0. : m->weight[j]) * T[k][e];
      }
    }
  }
  PetscCall(PetscFree(holder));
  PetscCall(PetscFree(column));
  PetscCall(PetscFree(T));
  PetscCall(PetscFree2(row_of, start));
  PetscCall(PetscFree2(begin, at));
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(entry));
  PetscFunctionReturn(PETSC_SUCCESS);
}
