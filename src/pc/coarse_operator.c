/*
  The coarse operator E = Z^T A Z, by loops over the block rows of A.

  For a node i and a unit b of its neighbours, W_ib = sum_j A_ij Z_j over the neighbours that move
  by b; then E_ab += Z_i^T W_ib with the units a of i. Where A has only the upper triangle U, with
  half of the diagonal blocks, E is the sum of Z^T U Z and its transpose. Each rank computes the
  rows of its own units; PETSc sends what edge nodes of P2 add to those of other ranks.

  Vanishing modes have zero rows and columns in E: their diagonal is set to the mean diagonal of
  their aggregate, and right-hand sides are zero there.
*/
#include "coarse.h"

/* The sums W of one row, by units. */
typedef struct {
  PetscInt n, *unit;  /* number of units; [n] units */
  PetscInt *slot;     /* [number of units] index of a unit in the row, -1: not in it */
  uint8_t *tall;      /* [n] the unit is an aggregate: translation and rotation */
  PetscReal (*W)[18]; /* [n] one or two blocks, row-major */
  PetscInt *column;   /* [n] and [n][9]: a row for other ranks */
  PetscScalar *block;
} RowSums;

/* The share of its unit v, 0 or 1, in the motion of component k of node i. */
static inline PetscReal share_of(SbCoarse c, PetscInt i, int v, int k)
{
  if (c->way[i] != SB_MEAN)
    return 1.;
  return c->moved[i] & (1 << (3 * v + k)) ? 0.5 : 0.;
}

/* W += weight K Z_j; K column-major. */
static inline void add_column(SbCoarse c, const PetscScalar K[9], PetscReal weight, PetscInt j,
                              RowSums *row)
{
  const PetscReal *d = c->d + 3 * j;

  for (int v = 0; v < (c->way[j] == SB_MEAN ? 2 : 1); v++) {
    const PetscInt u = c->unit[2 * j + v];
    PetscReal share[3], *W;

    if (u < 0)
      continue;
    if (row->slot[u] < 0) {
      row->slot[u] = row->n;
      row->unit[row->n] = u;
      row->tall[row->n] = c->way[j] == SB_MEMBER;
      for (int e = 0; e < 18; e++)
        row->W[row->n][e] = 0.;
      row->n++;
    }
    W = row->W[row->slot[u]];
    for (int k = 0; k < 3; k++)
      share[k] = weight * share_of(c, j, v, k);
    for (int r = 0; r < 3; r++) {
      const PetscReal k0 = share[0] * K[r];
      const PetscReal k1 = share[1] * K[3 + r];
      const PetscReal k2 = share[2] * K[6 + r];

      W[3 * r] += k0;
      W[3 * r + 1] += k1;
      W[3 * r + 2] += k2;
      if (c->way[j] != SB_MEMBER)
        continue;
      W[9 + 3 * r] += d[1] * k2 - d[2] * k1;
      W[9 + 3 * r + 1] += d[2] * k0 - d[0] * k2;
      W[9 + 3 * r + 2] += d[0] * k1 - d[1] * k0;
    }
  }
}

/* The block of an own row in a column, by its number over all ranks. */
static inline PetscReal *block_of(SbCoarse c, PetscInt row, PetscInt column)
{
  return c->value + 9 * (size_t)SbRowFind(c->ia, c->ja, row, column);
}

/* E += Z_i^T W for row i. */
static PetscErrorCode add_row(SbCoarse c, PetscInt i, RowSums *row)
{
  const PetscReal *x = c->d + 3 * i;

  PetscFunctionBeginUser;
  for (int v = 0; v < (c->way[i] == SB_MEAN ? 2 : 1); v++) {
    const PetscInt a = c->unit[2 * i + v];

    for (PetscInt k = 0; k < row->n && a >= 0; k++) {
      const PetscInt b = row->unit[k];
      const PetscInt column = b < c->n ? c->first + b : c->other[b - c->n];

      row->column[k] = column;
      for (int half = 0; half <= row->tall[k]; half++) {
        const PetscReal *B = row->W[k] + 9 * half;
        PetscReal *E = a < c->n ? block_of(c, a, column) + 9 * half : NULL;
        PetscReal *rotation;

        for (int e = 0; e < 9; e++) {
          const PetscReal share = share_of(c, i, v, e / 3);
          const PetscReal y = share > 0. ? share * B[e] : 0.;

          if (a < c->n)
            E[e] += y;
          else
            row->block[3 * row->n * (e / 3) + 3 * k + e % 3] = y;
        }
        if (c->way[i] != SB_MEMBER)
          continue;

        /* the next row has the same columns */
        rotation = E + 9 * (size_t)(c->ia[a + 1] - c->ia[a]);
        for (int e = 0; e < 3; e++) {
          rotation[e] += x[1] * B[6 + e] - x[2] * B[3 + e];
          rotation[3 + e] += x[2] * B[e] - x[0] * B[6 + e];
          rotation[6 + e] += x[0] * B[3 + e] - x[1] * B[e];
        }
      }
    }
    if (a >= c->n)
      PetscCall(MatSetValuesBlocked(c->E, 1, &c->other[a - c->n], row->n, row->column, row->block,
                                    ADD_VALUES));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbCoarseSetUp(SbCoarse c, Mat A)
{
  const PetscInt *start[2], *column[2];
  const PetscInt n = c->space->nnode_owned;
  const PetscInt w = c->widest;
  PetscInt nrow;
  SbMatBlocks x;
  RowSums row;

  PetscFunctionBeginUser;
  c->ok = PETSC_TRUE;
  if (!c->N && !c->direct)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMatGetBlocks(A, PETSC_FALSE, &x));
  for (int q = 0; q < 2 && x.part[q]; q++)
    PetscCall(SbMatGetPattern(x.part[q], &nrow, &start[q], &column[q]));
  PetscCall(PetscMalloc6(w, &row.unit, c->n + c->nother, &row.slot, w, &row.tall, w, &row.W, w,
                         &row.column, 9 * w, &row.block));
  for (PetscInt u = 0; u < c->n + c->nother; u++)
    row.slot[u] = -1;
  PetscCall(PetscArrayzero(c->value, 9 * (size_t)c->ia[c->n]));
  if (c->E)
    PetscCall(MatZeroEntries(c->E));
  for (PetscInt i = 0; i < n; i++) {
    if (c->unit[2 * i] < 0 && c->unit[2 * i + 1] < 0)
      continue;
    row.n = 0;
    for (int q = 0; q < 2 && x.part[q]; q++) {
      for (PetscInt k = start[q][i]; k < start[q][i + 1]; k++) {
        const PetscInt j = column[q][k] + (q ? n : 0);
        const PetscScalar *K = x.value[q] + 9 * (size_t)k;
        PetscScalar D[9];

        /* rows of prescribed unknowns have only their diagonal, which counts if the node moves by
           itself */
        for (int e = 0; j == i && e < 9; e++)
          D[e] = c->way[i] != SB_ITSELF && c->space->fixed[i] & (1 << (e / 3)) ? 0. : K[e];
        add_column(c, j == i ? D : K, x.symmetric && j == i ? 0.5 : 1., j, &row);
      }
    }
    PetscCall(add_row(c, i, &row));
    for (PetscInt k = 0; k < row.n; k++)
      row.slot[row.unit[k]] = -1;
  }
  PetscCall(SbMatRestoreBlocks(&x));
  PetscCall(PetscFree6(row.unit, row.slot, row.tall, row.W, row.column, row.block));

  /* with half of A its transpose is added */
  for (PetscInt u = 0; u < c->n && x.symmetric; u++) {
    for (PetscInt k = c->ia[u]; k < c->ia[u + 1]; k++) {
      PetscReal *above = c->value + 9 * (size_t)k;
      PetscReal *below = block_of(c, c->ja[k], u);

      for (int e = 0; e < 9 && c->ja[k] >= u; e++) {
        const int t = 3 * (e % 3) + e / 3;

        if (c->ja[k] > u || e <= t)
          above[e] = below[t] = above[e] + below[t];
      }
    }
  }

  /* modes that vanish: the mean diagonal */
  for (PetscInt a = 0; a < c->nagg; a++) {
    const PetscInt u = c->row_of[a];
    PetscReal trace = 0.;

    if (u < 0)
      continue;
    for (int m = 0; m < 6; m++)
      trace += block_of(c, u + m / 3, c->first + u + m / 3)[4 * (m % 3)];
    for (int e = 0; e < 36; e++)
      block_of(c, u + e / 18, c->first + u + e % 6 / 3)[3 * (e / 6 % 3) + e % 3] +=
        trace / 6. * c->null[36 * a + e];
  }
  PetscCall(SbCoarseSetUpSolver(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
