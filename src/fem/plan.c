/*
  The assembly plan: the graph of node blocks and, for each cell, where its 16 blocks lie in it.

  Built in one sweep over nodes: the cells around an owned node give the columns of its row; while they are at hand, the
  places of the blocks of that row are written into the cells' tables. There is no search. Measured at 200k tets this
  takes a small part of what DMCreateMatrix takes for the same graph (`make bench`, row matrix_setup).
*/
#include "fem_impl.h"

/*
  Places in batch_node at which each owned node stands: one for each cell around it. Padding lanes count as the cell that they
  repeat: its columns are marked once more, and they get its places.
*/
static PetscErrorCode invert_batches(SbSpace s, PetscInt **start, PetscInt **slot)
{
  const PetscInt n = 4 * SB_BATCH * s->nbatch;
  PetscInt *next;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(s->nnode_owned + 2, start));
  for (PetscInt k = 0; k < n; k++) {
    if (s->batch_node[k] < s->nnode_owned) (*start)[s->batch_node[k] + 2]++;
  }
  for (PetscInt i = 1; i <= s->nnode_owned; i++) (*start)[i + 1] += (*start)[i];
  PetscCall(PetscMalloc1((*start)[s->nnode_owned + 1], slot));
  next = *start + 1;
  for (PetscInt k = 0; k < n; k++) {
    if (s->batch_node[k] < s->nnode_owned) (*slot)[next[s->batch_node[k]]++] = k;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Node 0 of the cell that has node a at slot[a]; its node b follows SB_BATCH b behind. */
static inline const PetscInt *slot_cell(SbSpace s, PetscInt slot)
{
  return s->batch_node + slot / (4 * SB_BATCH) * (4 * SB_BATCH) + slot % SB_BATCH;
}

/* Insertion sort: rows hold about fifteen columns. */
static void sort_columns(PetscInt n, PetscInt column[])
{
  for (PetscInt i = 1; i < n; i++) {
    const PetscInt c = column[i];
    PetscInt j = i;

    for (; j > 0 && column[j - 1] > c; j--) column[j] = column[j - 1];
    column[j] = c;
  }
}

/* Columns of one row, sorted; seen[] marks them with the row's number. Local ghosts are sorted globally, so local order is global order within each part. */
static PetscInt row_columns(SbSpace s, PetscInt row, PetscInt n, const PetscInt slot[], PetscInt seen[],
                            PetscInt column[])
{
  PetscInt count = 0;

  for (PetscInt k = 0; k < n; k++) {
    const PetscInt *node = slot_cell(s, slot[k]);

    for (PetscInt b = 0; b < 4 * SB_BATCH; b += SB_BATCH) {
      if (seen[node[b]] == row) continue;
      seen[node[b]] = row;
      column[count++] = node[b];
    }
  }
  sort_columns(count, column);
  return count;
}

/* Regions are runs of cells and of batches. */
size_t SbPlanCellOffset(SbSpace s, PetscInt cell)
{
  PetscInt low = 0, high = s->nregion - 1, lane;
  const SbRegion *region;

  while (low < high) {
    const PetscInt middle = (low + high + 1) / 2;

    if (s->region[middle].cstart <= cell)
      low = middle;
    else
      high = middle - 1;
  }
  region = &s->region[low];
  lane = (cell - region->cstart) % SB_BATCH;
  return (size_t)(region->bstart + (cell - region->cstart) / SB_BATCH) * 16 * SB_BATCH + (size_t)lane;
}

/* Rows in the order in which the batches reach them. */
static PetscErrorCode plan_fresh(SbSpace s, SbPlan p)
{
  PetscBool *seen;
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(s->nbatch + 1, &p->fresh_start, s->nnode_owned, &p->fresh));
  PetscCall(PetscCalloc1(s->nnode_owned, &seen));
  for (PetscInt b = 0; b < s->nbatch; b++) {
    p->fresh_start[b] = n;
    for (PetscInt k = 4 * SB_BATCH * b; k < 4 * SB_BATCH * (b + 1); k++) {
      const PetscInt row = s->batch_node[k];

      if (row >= s->nnode_owned || seen[row]) continue;
      seen[row] = PETSC_TRUE;
      p->fresh[n++] = row;
    }
  }
  p->fresh_start[s->nbatch] = n;
  PetscCall(PetscFree(seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Row i: its columns go to the graph, the places of its blocks to the cells around. */
static void plan_row(SbSpace s, PetscInt i, PetscInt n, const PetscInt slot[], PetscInt ncolumn,
                     const PetscInt column[], PetscInt place[], SbPlan p)
{
  PetscInt nd = p->di[i], no = p->oi[i];

  for (PetscInt k = 0; k < ncolumn; k++) {
    if (column[k] < s->nnode_owned) {
      place[column[k]] = nd;
      p->dj[nd++] = column[k];
    } else {
      place[column[k]] = ~no;
      p->oj[no++] = column[k];
    }
  }
  p->diagonal[i] = place[i];
  p->di[i + 1] = nd;
  p->oi[i + 1] = no;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt *node = slot_cell(s, slot[k]), lane = slot[k] % SB_BATCH;
    PetscInt *offset = p->offset + 4 * (size_t)(slot[k] - lane) + lane;

    for (PetscInt b = 0; b < 4 * SB_BATCH; b += SB_BATCH) offset[b] = place[node[b]];
  }
}

PetscErrorCode SbPlanCreate(SbSpace s, SbPlan *plan)
{
  const PetscInt nrow = s->nnode_owned;
  const size_t nplace = (size_t)s->nbatch * 16 * SB_BATCH;
  PetscInt *start, *slot, *seen, *place, *column, widest = 0, capacity;
  SbPlan p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  PetscCall(invert_batches(s, &start, &slot));
  for (PetscInt i = 0; i < nrow; i++) widest = PetscMax(widest, start[i + 1] - start[i]);
  capacity = nrow + 3 * start[nrow];
  PetscCall(PetscMalloc3(s->nnode, &seen, s->nnode, &place, 3 * widest + 1, &column));
  PetscCall(PetscMalloc4(nrow + 1, &p->di, capacity, &p->dj, nrow + 1, &p->oi, capacity, &p->oj));
  PetscCall(PetscMalloc1(nrow, &p->diagonal));
  PetscCall(PetscMalloc1(nplace, &p->offset));
  for (PetscInt i = 0; i < s->nnode; i++) seen[i] = -1;
  for (size_t k = 0; k < nplace; k++) p->offset[k] = SB_NOT_OWNED;
  p->di[0] = p->oi[0] = 0;
  for (PetscInt i = 0; i < nrow; i++) {
    const PetscInt n = start[i + 1] - start[i], *around = slot + start[i];
    const PetscInt ncolumn = row_columns(s, i, n, around, seen, column);

    plan_row(s, i, n, around, ncolumn, column, place, p);
  }
  PetscCall(PetscFree(start));
  PetscCall(PetscFree(slot));
  PetscCall(PetscFree3(seen, place, column));
  PetscCall(plan_fresh(s, p));
  *plan = p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPlanDestroy(SbPlan *plan)
{
  SbPlan p = *plan;

  PetscFunctionBeginUser;
  if (!p) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree4(p->di, p->dj, p->oi, p->oj));
  PetscCall(PetscFree(p->diagonal));
  PetscCall(PetscFree(p->offset));
  PetscCall(PetscFree(p->ui));
  PetscCall(PetscFree(p->upper));
  PetscCall(PetscFree2(p->fresh_start, p->fresh));
  PetscCall(PetscFree3(p->fix_block, p->fix_row, p->fix_mask));
  PetscCall(PetscFree(*plan));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First upper block of each row and the ten places of each cell, for the symmetric storage of one rank. */
static PetscErrorCode plan_upper(SbSpace s, SbPlan p)
{
  const PetscInt nrow = s->nnode_owned;

  PetscFunctionBeginUser;
  if (p->upper) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(nrow + 1, &p->ui));
  PetscCall(PetscMalloc1((size_t)s->nbatch * 10 * SB_BATCH, &p->upper));
  p->ui[0] = 0;
  for (PetscInt i = 0; i < nrow; i++) p->ui[i + 1] = p->ui[i] + p->di[i + 1] - p->diagonal[i];
  for (PetscInt b = 0; b < s->nbatch; b++) {
    const PetscInt *node = s->batch_node + 4 * SB_BATCH * b, *offset = p->offset + (size_t)b * 16 * SB_BATCH;
    PetscInt *upper = p->upper + (size_t)b * 10 * SB_BATCH;

    for (PetscInt q = 0; q < 10; q++) {
      for (PetscInt l = 0; l < SB_BATCH; l++) {
        const PetscInt na = node[SB_BATCH * SbPairA[q] + l], nb = node[SB_BATCH * SbPairB[q] + l],
                       row = PetscMin(na, nb);
        const PetscInt k =
          offset[SB_BATCH * (na <= nb ? 4 * SbPairA[q] + SbPairB[q] : 4 * SbPairB[q] + SbPairA[q]) + l];
        const PetscInt u = p->ui[row] + k - p->diagonal[row];

        upper[SB_BATCH * q + l] = na <= nb ? u : ~u;
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt widest_row(SbSpace s, SbPlan p)
{
  PetscInt widest = 0;

  for (PetscInt i = 0; i < s->nnode_owned; i++)
    widest = PetscMax(widest, p->di[i + 1] - p->di[i] + p->oi[i + 1] - p->oi[i]);
  return widest;
}

/*
  The diagonal part of AIJ. Told that rows come sorted and complete, it copies them as they are: six times faster at 200k
  tets than block by block.
*/
static PetscErrorCode fill_diagonal_aij(SbSpace s, SbPlan p, Mat A)
{
  const PetscInt widest = 3 * widest_row(s, p);
  PetscInt *column;
  PetscScalar *zeros;
  PetscBool parallel;
  Mat part = A;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)A, MATMPIAIJ, &parallel));
  if (parallel) PetscCall(MatMPIAIJGetSeqAIJ(A, &part, NULL, NULL));
  PetscCall(MatSetOption(part, MAT_SORTED_FULL, PETSC_TRUE));
  PetscCall(PetscMalloc1(widest, &column));
  PetscCall(PetscCalloc1(3 * widest, &zeros));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt rows[3] = {3 * i, 3 * i + 1, 3 * i + 2}, n = 3 * (p->di[i + 1] - p->di[i]);

    for (PetscInt k = 0; k < n; k++) column[k] = 3 * p->dj[p->di[i] + k / 3] + k % 3;
    PetscCall(MatSetValues(part, 3, rows, n, column, zeros, INSERT_VALUES));
  }
  PetscCall(MatSetOption(part, MAT_SORTED_FULL, PETSC_FALSE));
  PetscCall(PetscFree(column));
  PetscCall(PetscFree(zeros));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inserts zero blocks row by row: afterwards the matrix has its pattern and is assembled. */
static PetscErrorCode fill_pattern(SbSpace s, SbPlan p, Mat A, SbMatrixKind kind)
{
  const PetscInt *first = kind == SB_MATRIX_AIJ ? p->di + 1 : kind == SB_MATRIX_SBAIJ ? p->diagonal : p->di;
  const PetscInt widest = widest_row(s, p);
  PetscInt *column;
  PetscScalar *zeros;

  PetscFunctionBeginUser;
  if (kind == SB_MATRIX_AIJ) PetscCall(fill_diagonal_aij(s, p, A));
  PetscCall(PetscMalloc1(widest, &column));
  PetscCall(PetscCalloc1(9 * widest, &zeros));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt grow = s->gnode_start + i;
    PetscInt n = 0;

    for (PetscInt k = first[i]; k < p->di[i + 1]; k++) column[n++] = s->gnode_start + p->dj[k];
    for (PetscInt k = p->oi[i]; k < p->oi[i + 1]; k++) column[n++] = s->gnode[p->oj[k]];
    if (n) PetscCall(MatSetValuesBlocked(A, 1, &grow, n, column, zeros, INSERT_VALUES));
  }
  PetscCall(PetscFree(column));
  PetscCall(PetscFree(zeros));
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Remembers which blocks the prescribed unknowns touch. */
static PetscErrorCode plan_fixed(SbSpace s, SbPlan p)
{
  PetscInt n = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscFree3(p->fix_block, p->fix_row, p->fix_mask));
  p->nfix = 0;
  for (PetscInt pass = 0; pass < 2; pass++) {
    n = 0;
    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      for (PetscInt part = 0; part < 2; part++) {
        const PetscInt *ptr = part ? p->oi : p->di, *col = part ? p->oj : p->dj;

        for (PetscInt k = ptr[i]; k < ptr[i + 1]; k++) {
          const int mask = s->fixed[i] | (s->fixed[col[k]] << 3) | (!part && col[k] == i ? 64 : 0);

          if (!(mask & 63)) continue;
          if (pass) {
            p->fix_block[n] = part ? ~k : k;
            p->fix_row[n] = i;
            p->fix_mask[n] = (uint8_t)mask;
          }
          n++;
        }
      }
    }
    if (!pass) PetscCall(PetscMalloc3(n, &p->fix_block, n, &p->fix_row, n, &p->fix_mask));
  }
  p->nfix = n;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Value of rigid-body mode `kind` (three translations, three rotations) at x, relative to the body's size. */
static void rigid_mode(PetscInt kind, const PetscReal x[3], const PetscReal box[6], PetscReal value[3])
{
  const PetscReal extent = PetscMax(box[3] - box[0], PetscMax(box[4] - box[1], box[5] - box[2]));

  value[0] = value[1] = value[2] = 0.;
  if (kind < 3) {
    value[kind] = 1.;
  } else {
    const PetscInt i = (kind + 1) % 3, j = (kind + 2) % 3;

    value[i] = -(x[j] - 0.5 * (box[j] + box[3 + j])) / extent;
    value[j] = (x[i] - 0.5 * (box[i] + box[3 + i])) / extent;
  }
}

/*
  The six rigid-body modes, zero on prescribed unknowns: what algebraic multigrid must reproduce. Six serve any number of
  bodies: an aggregate never spans two of them, and each body turns about its own centre.
*/
static PetscErrorCode attach_rigid_modes(SbSpace s, Mat A)
{
  Vec mode[6];
  PetscInt kept = 0;
  MatNullSpace near;

  PetscFunctionBeginUser;
  for (PetscInt m = 0; m < 6; m++) {
    PetscScalar *v, dot;
    PetscReal norm;

    PetscCall(MatCreateVecs(A, &mode[kept], NULL));
    PetscCall(VecGetArray(mode[kept], &v));
    for (PetscInt i = 0; i < s->nnode_owned; i++) {
      PetscReal value[3];

      rigid_mode(m, s->node_x + 3 * i, s->mesh->body[s->mesh->vert_body[i]].bbox, value);
      for (PetscInt c = 0; c < 3; c++) v[3 * i + c] = s->fixed[i] & (1 << c) ? 0. : value[c];
    }
    PetscCall(VecRestoreArray(mode[kept], &v));
    /* orthonormal, as MatNullSpaceCreate() demands; what vanishes on fully held bodies drops out */
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
  PetscCall(MatNullSpaceCreate(s->comm, PETSC_FALSE, kept, mode, &near));
  PetscCall(MatSetNearNullSpace(A, near));
  PetscCall(MatNullSpaceDestroy(&near));
  for (PetscInt k = 0; k < kept; k++) PetscCall(VecDestroy(&mode[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceCreateMatrix(SbSpace s, SbMatrixKind kind, Mat *A)
{
  static const MatType types[] = {MATAIJ, MATBAIJ, MATSBAIJ};
  PetscInt *dnnz, *onnz, *unnz;
  PetscMPIInt size;
  SbPlan p;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_MATRIX_SETUP], 0, 0, 0, 0));
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  PetscCheck(kind != SB_MATRIX_SBAIJ || size == 1, s->comm, PETSC_ERR_SUP,
             "Symmetric block storage is for one rank: there is no public access to its parallel parts");
  if (!s->plan) PetscCall(SbPlanCreate(s, &s->plan));
  p = s->plan;
  PetscCall(plan_fixed(s, p));
  if (kind == SB_MATRIX_SBAIJ) PetscCall(plan_upper(s, p));
  PetscCall(PetscMalloc3(s->nnode_owned, &dnnz, s->nnode_owned, &onnz, s->nnode_owned, &unnz));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    dnnz[i] = p->di[i + 1] - p->di[i];
    onnz[i] = p->oi[i + 1] - p->oi[i];
    unnz[i] = p->di[i + 1] - p->diagonal[i];
  }
  PetscCall(MatCreate(s->comm, A));
  PetscCall(MatSetSizes(*A, 3 * s->nnode_owned, 3 * s->nnode_owned, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, types[kind]));
  PetscCall(MatXAIJSetPreallocation(*A, 3, dnnz, onnz, unnz, onnz));
  PetscCall(PetscFree3(dnnz, onnz, unnz));
  PetscCall(fill_pattern(s, p, *A, kind));
  PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  if (kind == SB_MATRIX_AIJ)
    PetscCall(attach_rigid_modes(s, *A));
  else
    PetscCall(SbProductAttach(s, kind, *A));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_MATRIX_SETUP], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}
