/*
  Insertion of the blocks of a batch of cells, ten or, for P2, 55 per cell, into the matrix's value
  arrays.

  The kernel returns interleaved blocks, K[pair][entry][lane]; BAIJ and SBAIJ store the nine entries
  of a block together, column-major. So the entries of four lanes are transposed in registers, and
  each block is added as two vectors of four and a last number: in cache 20 ns per tet for SBAIJ,
  entry by entry 52. Lanes are added sequentially: neighbouring cells of a batch share blocks.

  A row of the matrix is cleared by the first batch that adds to it (listed in the plan): it is in
  the cache then, and memory is accessed once, not twice. Measured at 200,000 tets, SBAIJ: 33 ns per
  tet instead of 49.

  AIJ does not store blocks contiguously: they are added entry by entry.
*/
#include "fem_impl.h"

void SbInsertClear(SbSpace s, const SbMatBlocks *x, PetscInt b, const SbStage *faces,
                   const PetscReal beta[])
{
  const SbPlan p = s->plan;

  for (PetscInt n = p->fresh_start[b]; n < p->fresh_start[b + 1]; n++) {
    const PetscInt i = p->fresh[n];

    for (int q = 0; q < (x->value[1] ? 2 : 1); q++) {
      const PetscInt *ptr = q ? p->oi : x->symmetric ? p->ui : p->di;
      const PetscReal factor = faces ? faces->shift_k + faces->shift_v * beta[s->node_body[i]] : 0.;
      size_t rs, cs;

      memset(x->value[q] + 9 * (size_t)ptr[i], 0, 72 * (size_t)(ptr[i + 1] - ptr[i]));
      if (!faces)
        continue;

      /* the face terms are a multiple of the identity in each block, those at walls diagonal */
      ptr = q ? p->oi : p->di;
      for (PetscInt k = x->symmetric ? p->diagonal[i] : ptr[i]; k < ptr[i + 1]; k++) {
        PetscScalar *v = sb_block(x, p, i, q ? ~k : k, &rs, &cs);

        for (size_t c = 0; c < 3; c++)
          v[c * (rs + cs)] = factor * p->face_term[q][k];
        for (size_t c = 0; p->wall_term[q] && c < 3; c++)
          v[c * (rs + cs)] += factor * p->wall_term[q][3 * (size_t)k + c];

        /* those of edges are skew, those at walls symmetric */
        for (size_t c = 0; p->edge_term[q] && c < 3; c++) {
          const size_t a = (c + 1) % 3;
          const size_t d = (c + 2) % 3;
          const PetscReal *edges = p->edge_term[q] + 6 * (size_t)k;

          v[d * rs + a * cs] = faces->shift_k * (edges[3 + c] + edges[c]);
          v[a * rs + d * cs] = faces->shift_k * (edges[3 + c] - edges[c]);
        }
      }
    }
  }
}

/* Any storage, any rank: adds the cells of batch b, block by block. DG: each block between means is
   distributed to the own nodes and those across the faces. */
SB_INLINE void insert_cells(SbSpace s, const SbMatBlocks *x, PetscInt b, int npair,
                            PetscBool broken, const SbPack K[][9])
{
  const PetscInt w = s->width;
  PetscReal weight[8], k[9];

  for (int l = 0; l < s->batch_n[b]; l++) {
    const PetscInt *node = sb_batch_nodes(s, b) + l;
    const PetscInt *offset = s->plan->offset + (size_t)(b * w * w) * SB_BATCH + l;

    for (int a = 0; a < 4 && broken; a++) {
      weight[a] = s->batch_weight[4 * b + a][l];
      weight[4 + a] = 1. - weight[a];
    }
    for (int p = 0; p < npair; p++) {
      SbPackGet(9, K[p], l, k);
      for (int n = 0; n < (SbPairA[p] == SbPairB[p] ? 4 : 8); n += broken ? 1 : 4) {
        const int turn = n / 4;
        const int row = (turn ? SbPairB[p] : SbPairA[p]) + 4 * (n & 1);
        const int column = (turn ? SbPairA[p] : SbPairB[p]) + 2 * (n & 2);
        const PetscReal factor = broken ? weight[row] * weight[column] : 1.;

        if (factor != 0.)
          sb_insert_block(s, x, node[SB_BATCH * row], node[SB_BATCH * column],
                          offset[SB_BATCH * (w * row + column)], factor, (PetscBool)turn, k);
      }
    }
  }
}

/* Index in the block of entry e of the transposed block. */
static const int swapped[9] = {0, 3, 6, 1, 4, 7, 2, 5, 8};

/* out[l][e] = in[e][l] */
SB_INLINE void transpose(const SbFour in[4], SbFour out[4])
{
  const SbFour a = SB_SHUFFLE(in[0], in[1], 0, 4, 2, 6);
  const SbFour b = SB_SHUFFLE(in[0], in[1], 1, 5, 3, 7);
  const SbFour c = SB_SHUFFLE(in[2], in[3], 0, 4, 2, 6);
  const SbFour d = SB_SHUFFLE(in[2], in[3], 1, 5, 3, 7);

  out[0] = SB_SHUFFLE(a, c, 0, 1, 4, 5);
  out[1] = SB_SHUFFLE(b, d, 0, 1, 4, 5);
  out[2] = SB_SHUFFLE(a, c, 2, 3, 6, 7);
  out[3] = SB_SHUFFLE(b, d, 2, 3, 6, 7);
}

/* Adds one block in each of four lanes: k[e] its entries, column-major, position[l] its position.
   With `edge` the position may be in the off-diagonal part, or on another rank. */
SB_INLINE void add_blocks(const SbFour k[9], const PetscInt position[4], PetscBool edge,
                          PetscScalar *const value[2])
{
  SbFour head[4], middle[4];

  transpose(k, head);
  transpose(k + 4, middle);
  for (int l = 0; l < 4; l++) {
    const PetscBool off = (PetscBool)(edge && position[l] < 0);
    PetscScalar *v;

    if (edge && position[l] == SB_NOT_OWNED)
      continue;
    v = value[off] + 9 * (size_t)(off ? ~position[l] : position[l]);
    *(SbFour *)v += head[l];
    *(SbFour *)(v + 4) += middle[l];
    v[8] += k[8][l];
  }
}

/* Both triangles, BAIJ. Padding lanes have volume zero and add nothing to the blocks of the first
   lane. */
SB_INLINE void insert_both(int npair, const SbPack K[][9], const PetscInt offset[], PetscInt width,
                           PetscBool edge, PetscScalar *const value[2])
{
  for (int p = 0; p < npair; p++) {
    const PetscInt ab = width * SbPairA[p] + SbPairB[p];
    const PetscInt ba = width * SbPairB[p] + SbPairA[p];

    for (int h = 0; h < SB_BATCH; h += 4) {
      SbFour k[9];

      for (int e = 0; e < 9; e++)
        k[e] = *(const SbFour *)&K[p][swapped[e]][h];
      add_blocks(k, offset + SB_BATCH * ab + h, edge, value);
      if (ab == ba)
        continue;
      for (int e = 0; e < 9; e++)
        k[e] = *(const SbFour *)&K[p][e][h];
      add_blocks(k, offset + SB_BATCH * ba + h, edge, value);
    }
  }
}

/* `edge`: batches with nodes of another rank. */
SB_KERNEL static void insert_baij(int npair, const SbPack K[restrict][9],
                                  const PetscInt offset[restrict], PetscInt width, PetscBool edge,
                                  PetscScalar *const value[2])
{
  if (npair == SB_PAIRS)
    insert_both(SB_PAIRS, K, offset, SB_CELL_NODES, PETSC_TRUE, value);
  else if (edge)
    insert_both(10, K, offset, width, PETSC_TRUE, value);
  else
    insert_both(10, K, offset, width, PETSC_FALSE, value);
}

/* The stored block is K_ab, or K_ba = K_ab^T when that lies in the row of the lower node. */
SB_INLINE void insert_upper(int npair, const SbPack K[restrict][9], const PetscInt upper[restrict],
                            PetscScalar *const value[2])
{
  for (int p = 0; p < npair; p++) {
    for (int h = 0; h < SB_BATCH; h += 4) {
      PetscInt position[4];
      SbFourMask turn;
      SbFour k[9];

      for (int l = 0; l < 4; l++) {
        const PetscInt u = upper[SB_BATCH * p + h + l];

        turn[l] = -(int64_t)(u < 0);
        position[l] = u < 0 ? ~u : u;
      }
      for (int e = 0; e < 9; e++) {
        const SbFourMask ab = *(const SbFourMask *)&K[p][swapped[e]][h];
        const SbFourMask ba = *(const SbFourMask *)&K[p][e][h];

        k[e] = (SbFour)((turn & ba) | (~turn & ab));
      }
      add_blocks(k, position, PETSC_FALSE, value);
    }
  }
}

SB_KERNEL static void insert_sbaij(int npair, const SbPack K[restrict][9],
                                   const PetscInt upper[restrict], PetscScalar *const value[2])
{
  if (npair == SB_PAIRS)
    insert_upper(SB_PAIRS, K, upper, value);
  else
    insert_upper(10, K, upper, value);
}

void SbInsertBatch(SbSpace s, const SbMatBlocks *x, PetscInt b, int npair, PetscBool broken,
                   const SbPack K[][9])
{
  const PetscInt *offset = s->plan->offset + (size_t)(b * s->width * s->width) * SB_BATCH;
  const PetscInt *node = sb_batch_nodes(s, b);
  PetscInt last = 0;

  if (broken)
    insert_cells(s, x, b, npair, PETSC_TRUE, K);
  else if (x->kind == SB_MATRIX_AIJ)
    insert_cells(s, x, b, npair, PETSC_FALSE, K);
  else if (x->symmetric)
    insert_sbaij(npair, K, s->plan->upper + (size_t)(b * s->plan->npair) * SB_BATCH, x->value);
  else {
    for (int k = 0; k < 4 * SB_BATCH; k++)
      last = PetscMax(last, node[k]);
    insert_baij(npair, K, offset, s->width, (PetscBool)(last >= s->nnode_owned), x->value);
  }
}
