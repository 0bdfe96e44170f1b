/*
  The assembly plan: the graph of node blocks and, for each cell, the positions of its blocks in the
  matrix.

  Built in one loop over nodes: the cells (and with CR and DG the faces) around an owned node give
  the columns of its row; at the same time the positions of the blocks of that row are stored for
  the cells, without a search. The face terms are constant within a step: they are summed here, and
  every assembly starts from them. At 200k tets this takes a small fraction of the time of
  DMCreateMatrix (`make bench`).
*/
#include "fem_impl.h"

/* Cliques of nodes in lanes: those of the cells (width nodes each) or of the faces (eight).
   The slot of node a, lane l, batch b is SB_BATCH (nodes b + a) + l. Padding lanes count as the
   group that they repeat. */
typedef struct {
  const PetscInt *node;
  PetscInt nodes; /* number of nodes in a group */
  PetscInt *start,
    *slot; /* [nnode_owned+1] offsets; slots of each owned node, one per group around it */
} Groups;

/* Node 0 of the group of a slot; node b of the group is at SB_BATCH b. */
static inline const PetscInt *slot_group(const Groups *g, PetscInt slot)
{
  return g->node + slot / (g->nodes * SB_BATCH) * (g->nodes * SB_BATCH) + slot % SB_BATCH;
}

/* Number of nodes of a coupling. */
static inline PetscInt group_size(SbSpace s, PetscInt c)
{
  return s->couplings.start[c + 1] - s->couplings.start[c];
}

/* Couplings around each owned node: around[nnode_owned+1] into at_group, entries of couplings.node,
   and group_of each entry; room for the positions of their blocks. The caller frees the arrays. */
static PetscErrorCode plan_couplings(SbSpace s, SbPlan p, PetscInt **around, PetscInt **at_group,
                                     PetscInt **group_of)
{
  const SbCouplings *g = &s->couplings;
  PetscInt total = 0;

  PetscFunctionBeginUser;
  PetscCall(SbBucketByKey(g->start[g->n], g->node, s->nnode_owned, around, at_group));
  PetscCall(PetscMalloc1(g->start[g->n], group_of));
  for (PetscInt c = 0; c < g->n; c++)
    total += PetscSqr(group_size(s, c));
  PetscCall(PetscMalloc2(g->n, &p->coupling_start, total, &p->coupling));
  total = 0;
  for (PetscInt c = 0; c < g->n; c++) {
    for (PetscInt e = g->start[c]; e < g->start[c + 1]; e++)
      (*group_of)[e] = c;
    p->coupling_start[c] = total;
    for (PetscInt e = 0; e < PetscSqr(group_size(s, c)); e++)
      p->coupling[total++] = SB_NOT_OWNED;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sorts the ghosts among n local nodes, which are ascending, by their global numbers. */
static PetscErrorCode sort_ghosts(SbSpace s, PetscInt n, PetscInt column[])
{
  PetscInt first = 0;
  PetscInt *gnode;

  PetscFunctionBeginUser;
  while (column[first] < s->nnode_owned)
    first++;
  PetscCall(PetscMalloc1(n - first, &gnode));
  for (PetscInt k = first; k < n; k++)
    gnode[k - first] = s->gnode[column[k]];
  PetscCall(PetscSortIntWithArray(n - first, gnode, column + first));
  PetscCall(PetscFree(gnode));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPlanCreate(SbSpace s, SbPlan *plan)
{
  const PetscInt nrow = s->nnode_owned;
  const PetscInt ngroup = s->jump ? 2 : 1;
  const PetscInt w = s->width;
  const size_t npoint = (size_t)s->nbatch * (size_t)(w * w) * SB_BATCH;
  PetscInt *seen, *position, *column;
  PetscInt widest = 1;
  PetscInt capacity = nrow;
  PetscInt nfresh = 0;
  PetscInt *around = NULL; /* [nnode_owned+1] offsets into `at_group`: entries of couplings.node of
                              each owned node */
  PetscInt *at_group = NULL;
  PetscInt *group_of = NULL; /* [couplings.start[n]] the coupling of an entry */
  Groups group[2] = {{.node = s->batch_clique, .nodes = w}, {.nodes = 8}};
  SbPlan p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(plan));
  p = *plan;

  // for each owned node: the cells around it, and the faces with a penalty on jumps
  for (PetscInt k = 0; k < ngroup; k++) {
    const PetscInt nbatch = k ? SbJumpCliques(s, &group[k].node) : s->nbatch;
    Groups *g = &group[k];

    PetscCall(SbBucketByKey(g->nodes * SB_BATCH * nbatch, g->node, nrow, &g->start, &g->slot));
  }

  // the groups of nodes that effects couple
  if (s->couplings.n)
    PetscCall(plan_couplings(s, p, &around, &at_group, &group_of));

  // upper bound for the graph: a node shares each group with all its other nodes
  for (PetscInt i = 0; i < nrow; i++) {
    PetscInt most = 1;

    for (PetscInt k = 0; k < ngroup; k++)
      most += (group[k].nodes - 1) * (group[k].start[i + 1] - group[k].start[i]);
    for (PetscInt k = around ? around[i] : 0; around && k < around[i + 1]; k++)
      most += group_size(s, group_of[at_group[k]]) - 1;
    widest = PetscMax(widest, most);
    capacity += most - 1;
  }
  PetscCall(PetscMalloc3(s->nnode, &seen, s->nnode, &position, widest, &column));
  PetscCall(PetscMalloc4(nrow + 1, &p->di, capacity, &p->dj, nrow + 1, &p->oi, capacity, &p->oj));
  PetscCall(PetscMalloc2(nrow, &p->diagonal, npoint, &p->offset));
  for (size_t k = 0; k < npoint; k++)
    p->offset[k] = SB_NOT_OWNED;
  for (PetscInt i = 0; i < s->nnode; i++)
    seen[i] = -1;
  p->di[0] = p->oi[0] = 0;
  for (PetscInt i = 0; i < nrow; i++) {
    PetscInt n = 0;
    PetscInt nd = p->di[i];
    PetscInt no = p->oi[i];

    // the columns of the row: every node that shares a group with it, once
    for (PetscInt k = 0; k < ngroup; k++) {
      const Groups *g = &group[k];

      for (PetscInt at = g->start[i]; at < g->start[i + 1]; at++) {
        const PetscInt *node = slot_group(g, g->slot[at]);

        for (PetscInt b = 0; b < g->nodes * SB_BATCH; b += SB_BATCH) {
          if (seen[node[b]] == i)
            continue;
          seen[node[b]] = i;
          column[n++] = node[b];
        }
      }
    }

    for (PetscInt k = around ? around[i] : 0; around && k < around[i + 1]; k++) {
      const PetscInt c = group_of[at_group[k]];

      for (PetscInt e = s->couplings.start[c]; e < s->couplings.start[c + 1]; e++) {
        if (seen[s->couplings.node[e]] == i)
          continue;
        seen[s->couplings.node[e]] = i;
        column[n++] = s->couplings.node[e];
      }
    }

    // sort in local order: ghosts are sorted by global number, so each part is in global order, but
    // for ghosts of couplings alone
    PetscCall(PetscSortInt(n, column));
    if (around && n && column[n - 1] >= s->nnode_cell)
      PetscCall(sort_ghosts(s, n, column));

    // the row of the graph: owned columns in the diagonal part, ghosts in the off-diagonal part
    for (PetscInt k = 0; k < n; k++) {
      if (column[k] < nrow) {
        position[column[k]] = nd;
        p->dj[nd++] = column[k];
      } else {
        position[column[k]] = ~no;
        p->oj[no++] = column[k];
      }
    }
    p->diagonal[i] = position[i];
    p->di[i + 1] = nd;
    p->oi[i + 1] = no;

    // store the positions of the row's blocks for the cells around the node
    for (PetscInt at = group[0].start[i]; at < group[0].start[i + 1]; at++) {
      const PetscInt slot = group[0].slot[at];
      const PetscInt lane = slot % SB_BATCH;
      const PetscInt *node = slot_group(&group[0], slot);
      PetscInt *offset = p->offset + w * (size_t)(slot - lane) + lane;

      for (PetscInt b = 0; b < w * SB_BATCH; b += SB_BATCH)
        offset[b] = position[node[b]];
    }

    // and those of the blocks of its couplings
    for (PetscInt k = around ? around[i] : 0; around && k < around[i + 1]; k++) {
      const PetscInt c = group_of[at_group[k]];
      const PetscInt size = group_size(s, c);
      const PetscInt *node = s->couplings.node + s->couplings.start[c];
      const PetscInt a = at_group[k] - s->couplings.start[c];

      for (PetscInt b = 0; b < size; b++)
        p->coupling[p->coupling_start[c] + size * a + b] = position[node[b]];
    }
  }
  if (s->jump) {
    PetscCall(PetscMalloc2(p->di[nrow], &p->face_term[0], p->oi[nrow], &p->face_term[1]));
    PetscCall(SbJumpSumTerms(s));
  }

  // the rows in the order in which the batches add to them first: the first batch clears a row in
  // the cache
  PetscCall(PetscMalloc2(s->nbatch + 1, &p->fresh_start, nrow, &p->fresh));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    p->fresh_start[b] = nfresh;
    for (PetscInt k = w * SB_BATCH * b; k < w * SB_BATCH * (b + 1); k++) {
      const PetscInt row = s->batch_clique[k];

      if (row >= nrow || seen[row] == nrow)
        continue;
      seen[row] = nrow;
      p->fresh[nfresh++] = row;
    }
  }
  p->fresh_start[s->nbatch] = nfresh;
  for (PetscInt k = 0; k < ngroup; k++) {
    PetscCall(PetscFree(group[k].start));
    PetscCall(PetscFree(group[k].slot));
  }
  PetscCall(PetscFree(around));
  PetscCall(PetscFree(at_group));
  PetscCall(PetscFree(group_of));
  PetscCall(PetscFree3(seen, position, column));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPlanDestroy(SbPlan *plan)
{
  SbPlan p = *plan;

  PetscFunctionBeginUser;
  if (!p)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree4(p->di, p->dj, p->oi, p->oj));
  PetscCall(PetscFree2(p->diagonal, p->offset));
  PetscCall(PetscFree2(p->coupling_start, p->coupling));
  PetscCall(PetscFree2(p->ui, p->upper));
  PetscCall(PetscFree2(p->face_term[0], p->face_term[1]));
  PetscCall(PetscFree2(p->edge_term[0], p->edge_term[1]));
  PetscCall(PetscFree2(p->wall_term[0], p->wall_term[1]));
  PetscCall(PetscFree2(p->fresh_start, p->fresh));
  PetscCall(PetscFree3(p->fix_block, p->fix_row, p->fix_mask));
  PetscCall(PetscFree(*plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SBAIJ on one rank: the first upper block of each row, and of each cell's blocks in the upper
   triangle. */
static PetscErrorCode plan_upper(SbSpace s, SbPlan p)
{
  const PetscInt nrow = s->nnode_owned;

  PetscFunctionBeginUser;
  if (p->upper)
    PetscFunctionReturn(PETSC_SUCCESS);
  p->npair = s->edge_node ? SB_PAIRS : 10;
  PetscCall(PetscMalloc2(nrow + 1, &p->ui, (size_t)(s->nbatch * p->npair) * SB_BATCH, &p->upper));

  /* a row consists of the blocks from its diagonal on */
  p->ui[0] = 0;
  for (PetscInt i = 0; i < nrow; i++)
    p->ui[i + 1] = p->ui[i] + p->di[i + 1] - p->diagonal[i];

  /* a pair of nodes belongs to the row of the lower one; ~u: its block has to be transposed */
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const PetscInt *node = sb_batch_nodes(s, b);
    const PetscInt *offset = p->offset + (size_t)b * (size_t)(s->width * s->width) * SB_BATCH;
    PetscInt *upper = p->upper + (size_t)(b * p->npair) * SB_BATCH;

    for (PetscInt q = 0; q < p->npair; q++) {
      for (PetscInt l = 0; l < SB_BATCH; l++) {
        const PetscInt a = SbPairA[q];
        const PetscInt c = SbPairB[q];
        const PetscInt na = node[SB_BATCH * a + l];
        const PetscInt nc = node[SB_BATCH * c + l];
        const PetscInt row = PetscMin(na, nc);
        const PetscInt u = p->ui[row] - p->diagonal[row];
        const PetscInt k = offset[SB_BATCH * (na <= nc ? s->width * a + c : s->width * c + a) + l];

        upper[SB_BATCH * q + l] = na <= nc ? u + k : ~(u + k);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Lists the blocks with a prescribed unknown in their row or column, to be cleared after each
   assembly. */
static PetscErrorCode plan_fixed(SbSpace s, SbPlan p)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree3(p->fix_block, p->fix_row, p->fix_mask));

  /* counted in the first pass, listed in the second */
  for (PetscInt pass = 0; pass < 2; pass++) {
    PetscInt n = 0;

    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      for (PetscInt part = 0; part < 2; part++) {
        const PetscInt *ptr = part ? p->oi : p->di;
        const PetscInt *col = part ? p->oj : p->dj;

        for (PetscInt k = ptr[i]; k < ptr[i + 1]; k++) {
          const int mask = s->fixed[i] | (s->fixed[col[k]] << 3) | (!part && col[k] == i ? 64 : 0);

          if (!(mask & 63))
            continue;
          if (pass) {
            p->fix_block[n] = part ? ~k : k;
            p->fix_row[n] = i;
            p->fix_mask[n] = (uint8_t)mask;
          }
          n++;
        }
      }
    }
    if (!pass)
      PetscCall(PetscMalloc3(n, &p->fix_block, n, &p->fix_row, n, &p->fix_mask));
    p->nfix = n;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbRigidMode(PetscInt kind, const PetscReal x[3], const PetscReal box[6], PetscReal value[3])
{
  const PetscReal extent = SbRigidSize(box);

  value[0] = value[1] = value[2] = 0.;
  if (kind < 3) {
    value[kind] = 1.;
  } else {
    const PetscInt i = (kind + 1) % 3;
    const PetscInt j = (kind + 2) % 3;

    value[i] = -(x[j] - 0.5 * (box[j] + box[3 + j])) / extent;
    value[j] = (x[i] - 0.5 * (box[i] + box[3 + i])) / extent;
  }
}

PetscErrorCode
SbAttachModes(Mat A, PetscErrorCode (*fill)(PetscInt mode, PetscScalar v[], const void *ctx),
              const void *ctx)
{
  Vec mode[6];
  PetscInt kept = 0;
  MatNullSpace near;

  PetscFunctionBeginUser;
  for (PetscInt m = 0; m < 6; m++) {
    PetscScalar *v, dot;
    PetscReal norm;

    /* the mode as a vector of the matrix */
    PetscCall(MatCreateVecs(A, &mode[kept], NULL));
    PetscCall(VecGetArray(mode[kept], &v));
    PetscCall(fill(m, v, ctx));
    PetscCall(VecRestoreArray(mode[kept], &v));

    /* orthonormal to the earlier modes, as MatNullSpaceCreate() requires; modes that vanish are
       left out */
    PetscCall(VecNormalize(mode[kept], &norm));
    for (PetscInt k = 0; k < kept; k++) {
      PetscCall(VecDot(mode[kept], mode[k], &dot));
      PetscCall(VecAXPY(mode[kept], -dot, mode[k]));
    }
    PetscCall(VecNormalize(mode[kept], &norm));
    if (norm > 1e-8)
      kept++;
    else
      PetscCall(VecDestroy(&mode[kept]));
  }
  PetscCall(MatNullSpaceCreate(PetscObjectComm((PetscObject)A), PETSC_FALSE, kept, mode, &near));
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (PetscInt k = 0; k < kept; k++)
    PetscCall(VecDestroy(&mode[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills v with rigid-body mode m of a body, zero at prescribed unknowns. */
static PetscErrorCode fill_rigid_mode(PetscInt m, PetscScalar v[], const void *ctx)
{
  const struct _p_SbSpace *s = ctx;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal value[3];

    SbRigidMode(m, s->node_x + 3 * i, s->mesh->body[s->node_body[i]].bbox, value);
    for (PetscInt c = 0; c < 3; c++)
      v[3 * i + c] = s->fixed[i] & (1 << c) ? 0. : value[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceCreateMatrix(SbSpace s, SbMatrixKind kind, Mat *A)
{
  static const MatType types[] = {MATAIJ, MATBAIJ, MATSBAIJ};
  const PetscBool aij = (PetscBool)(kind == SB_MATRIX_AIJ);
  PetscInt *dnnz, *onnz, *unnz, *column;
  PetscInt widest = 0;
  PetscScalar *zeros;
  Mat part;
  SbPlan p;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_MATRIX_SETUP], 0, 0, 0, 0));
  PetscCheck(
    kind != SB_MATRIX_SBAIJ || !s->ghosted, s->comm, PETSC_ERR_SUP,
    "Symmetric block storage is for one rank: there is no public access to its parallel parts");

  /* parts of the plan for this storage and these prescribed unknowns */
  if (!s->plan)
    PetscCall(SbPlanCreate(s, &s->plan));
  p = s->plan;
  PetscCall(plan_fixed(s, p));
  if (kind == SB_MATRIX_SBAIJ)
    PetscCall(plan_upper(s, p));

  /* a matrix of the type, with exact preallocation */
  PetscCall(PetscMalloc3(s->nnode_owned, &dnnz, s->nnode_owned, &onnz, s->nnode_owned, &unnz));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    dnnz[i] = p->di[i + 1] - p->di[i];
    onnz[i] = p->oi[i + 1] - p->oi[i];
    unnz[i] = p->di[i + 1] - p->diagonal[i];
    widest = PetscMax(widest, dnnz[i] + onnz[i]);
  }
  PetscCall(MatCreate(s->comm, A));
  PetscCall(
    MatSetSizes(*A, 3 * s->nnode_owned, 3 * s->nnode_owned, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, types[kind]));
  PetscCall(MatXAIJSetPreallocation(*A, 3, dnnz, onnz, unnz, onnz));
  PetscCall(PetscFree3(dnnz, onnz, unnz));

  /* its pattern: zero blocks, row by row. The diagonal part of AIJ is set three scalar rows at a
     time: with MAT_SORTED_FULL (sorted, complete rows) PETSc copies them unchanged, six times
     faster at 200,000 tets than block by block. */
  PetscCall(PetscCalloc2(3 * widest, &column, 9 * widest, &zeros));
  part = *A;
  if (aij && s->ghosted)
    PetscCall(MatMPIAIJGetSeqAIJ(*A, &part, NULL, NULL));
  if (aij)
    PetscCall(MatSetOption(part, MAT_SORTED_FULL, PETSC_TRUE));
  for (PetscInt i = 0; aij && i < s->nnode_owned; i++) {
    const PetscInt rows[3] = {3 * i, 3 * i + 1, 3 * i + 2};
    const PetscInt n = 3 * (p->di[i + 1] - p->di[i]);

    for (PetscInt k = 0; k < n; k++)
      column[k] = 3 * p->dj[p->di[i] + k / 3] + k % 3;
    PetscCall(MatSetValues(part, 3, rows, n, column, zeros, INSERT_VALUES));
  }
  if (aij)
    PetscCall(MatSetOption(part, MAT_SORTED_FULL, PETSC_FALSE));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt grow = s->gnode_start + i;
    PetscInt n = 0;

    for (PetscInt k = kind == SB_MATRIX_SBAIJ ? p->diagonal[i] : p->di[i]; !aij && k < p->di[i + 1];
         k++)
      column[n++] = s->gnode_start + p->dj[k];
    for (PetscInt k = p->oi[i]; k < p->oi[i + 1]; k++)
      column[n++] = s->gnode[p->oj[k]];
    if (n)
      PetscCall(MatSetValuesBlocked(*A, 1, &grow, n, column, zeros, INSERT_VALUES));
  }
  PetscCall(PetscFree2(column, zeros));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));

  /* AIJ is for multigrid, which needs the rigid-body modes; block storages get the fast product */
  if (kind == SB_MATRIX_AIJ)
    PetscCall(SbAttachModes(*A, fill_rigid_mode, s));
  else
    PetscCall(SbProductAttach(*A));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_MATRIX_SETUP], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
