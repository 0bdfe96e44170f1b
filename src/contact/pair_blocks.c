/*
  pair_blocks.c - the Hessian of contact, summed over pairs of vertices, then assembled at the
  nodes.

  A vertex of the surface is at x_v = X_v + sum_j w_vj u_j, so the derivative by the nodes is S^T H
  S with S = (w_vj). H is summed first, in blocks of two vertices: pairs of features share them, and
  a vertex of CR and DG has some twenty nodes. Then the rows of T = H S, and of S^T T, are formed,
  each column once.

  Sums run in the order of pairs of features and of vertices, which does not depend on the
  partition.
*/
#include "pairs.h"

/* Slot of the vertex pair in the hash table: where it is, or the free one where it belongs. */
static inline PetscInt find_slot(const SbContactBlocks *b, PetscInt v, PetscInt w)
{
  PetscInt at = (PetscInt)((0x9e3779b97f4a7c15ULL * (((uint64_t)v << 32) ^ (uint64_t)w)) >> 32) &
                (b->nslot - 1);

  while (b->slot[at] >= 0 && (b->block[b->slot[at]].v[0] != v || b->block[b->slot[at]].v[1] != w))
    at = (at + 1) & (b->nslot - 1);
  return at;
}

PetscErrorCode SbContactBlocksAdd(SbContactBlocks *b, PetscInt v, PetscInt w, const PetscReal H[],
                                  PetscInt ld)
{
  const PetscInt low = PetscMin(v, w);
  const PetscInt high = PetscMax(v, w);
  PetscReal *to;
  PetscInt at;

  PetscFunctionBeginUser;

  /* room for one more, the table at most half full */
  if (b->n == b->size) {
    PetscCall(SbReserve(b->n + 1, sizeof(*b->block), &b->size, &b->block));
    b->nslot = 2 * b->size;
    PetscCall(PetscRealloc((size_t)b->nslot * sizeof(*b->slot), &b->slot));
    for (PetscInt k = 0; k < b->nslot; k++)
      b->slot[k] = -1;
    for (PetscInt k = 0; k < b->n; k++)
      b->slot[find_slot(b, b->block[k].v[0], b->block[k].v[1])] = k;
  }
  at = find_slot(b, low, high);
  if (b->slot[at] < 0) {
    b->slot[at] = b->n;
    b->block[b->n++] = (SbBlock){.v = {low, high}};
  }
  to = b->block[b->slot[at]].H;
  for (int p = 0; p < 3; p++)
    for (int q = 0; q < 3; q++)
      to[3 * p + q] += v <= w ? H[ld * p + q] : H[ld * q + p];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactBlocksToNodes(SbContactSurface m, SbContactBlocks *b, SbBlocks *to)
{
  const SbSpace s = m->space;
  const PetscInt nv = m->nbody_vertex;
  PetscInt *row_of, *first, *entry, *begin, *holder, *at, *start, *key, *vertex;
  PetscInt n = 0;
  PetscInt size = 0;
  struct {
    PetscInt column, gnode;
    PetscReal H[9];
  } *T = NULL;

  PetscFunctionBeginUser;
  if (!b->n)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* blocks by their rows, of vertices that have nodes here: twice the number, odd for the
     transpose */
  PetscCall(PetscCalloc1(m->column ? m->ncolumn : s->Nnode, &at));
  PetscCall(
    PetscMalloc4(2 * b->n, &row_of, nv + 1, &start, m->start[nv], &key, m->start[nv], &vertex));
  for (PetscInt k = 0; k < 2 * b->n; k++) {
    const PetscInt *v = b->block[k / 2].v;

    row_of[k] = m->mine[v[k % 2]] && (k % 2 == 0 || v[0] != v[1]) ? v[k % 2] : -1;
  }
  PetscCall(SbBucketByKey(2 * b->n, row_of, nv, &first, &entry));

  /* T: for each of these vertices a row over nodes */
  for (PetscInt v = 0; v < nv; v++) {
    start[v] = n;
    for (PetscInt k = first[v]; k < first[v + 1]; k++) {
      const PetscInt w = b->block[entry[k] / 2].v[1 - entry[k] % 2];
      const PetscReal *H = b->block[entry[k] / 2].H;

      PetscCall(SbReserve(n + m->start[w + 1] - m->start[w], sizeof(*T), &size, &T));
      for (PetscInt j = m->start[w]; j < m->start[w + 1]; j++) {
        const PetscInt g = m->column ? m->column[j] : m->gnode[j];

        if (m->fixed[j] == 7)
          continue;
        if (at[g] < start[v] || at[g] >= n || T[at[g]].column != g) {
          at[g] = n;
          T[n].column = g;
          T[n].gnode = m->gnode[j];
          for (int e = 0; e < 9; e++)
            T[n].H[e] = 0.;
          n++;
        }
        for (int e = 0; e < 9; e++)
          if (!(m->fixed[j] >> (e % 3) & 1))
            T[at[g]].H[e] += m->weight[j] * H[entry[k] % 2 ? 3 * (e % 3) + e / 3 : e];
      }
    }
  }
  start[nv] = n;

  /* own nodes and the vertices that they are part of */
  for (PetscInt v = 0; v < nv; v++) {
    for (PetscInt j = m->start[v]; j < m->start[v + 1]; j++) {
      vertex[j] = v;
      key[j] = start[v + 1] > start[v] && m->fixed[j] != 7 ? m->node[j] : -1;
    }
  }
  PetscCall(SbBucketByKey(m->start[nv], key, s->nnode_owned, &begin, &holder));

  /* S^T T, row by row */
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt row = to->n;
    PetscInt most = 0;

    for (PetscInt h = begin[i]; h < begin[i + 1]; h++)
      most += start[vertex[holder[h]] + 1] - start[vertex[holder[h]]];
    if (most)
      PetscCall(SbReserve(to->n + most, sizeof(*to->block), &to->size, &to->block));
    for (PetscInt h = begin[i]; h < begin[i + 1]; h++) {
      const PetscInt j = holder[h];
      const PetscInt v = vertex[j];

      for (PetscInt k = start[v]; k < start[v + 1]; k++) {
        const PetscInt g = T[k].column;
        PetscReal *sum;

        if (at[g] < row || at[g] >= to->n || to->block[at[g]].v[1] != T[k].gnode) {
          at[g] = to->n;
          to->block[to->n++] = (SbBlock){.v = {i, T[k].gnode}};
        }
        sum = to->block[at[g]].H;
        for (int e = 0; e < 9; e++)
          sum[e] += (m->fixed[j] >> (e / 3) & 1 ? 0. : m->weight[j]) * T[k].H[e];
      }
    }
  }
  PetscCall(PetscFree(holder));
  PetscCall(PetscFree(T));
  PetscCall(PetscFree4(row_of, start, key, vertex));
  PetscCall(PetscFree(begin));
  PetscCall(PetscFree(at));
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(entry));
  b->n = 0;
  for (PetscInt k = 0; k < b->nslot; k++)
    b->slot[k] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}
