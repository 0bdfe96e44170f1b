/*
  The coarse operator E = Z^T A Z, by loops over the block rows of A.

  For a node i and an aggregate b among its neighbours, W_ib = sum_j A_ij Z_j over the neighbours in b, 3x6; then
  E_ab += Z_i^T W_ib with a the aggregate of i. Each rank computes the rows of its own aggregates; where A has
  only the upper triangle, blocks of E below the diagonal are transposes.

  Vanishing modes have zero rows and columns in E: their diagonal is set to the mean diagonal of their block, and right-hand sides are zero there.
*/
#include "coarse.h"
#include "sbassembly.h"

/* W[3][6] += factor K Z_j; K column-major. */
static inline void add_column(const PetscScalar K[9], PetscReal factor, const PetscReal d[3], PetscReal W[18])
{
  for (int r = 0; r < 3; r++) {
    const PetscReal k0 = factor * K[r], k1 = factor * K[3 + r], k2 = factor * K[6 + r];

    W[6 * r] += k0;
    W[6 * r + 1] += k1;
    W[6 * r + 2] += k2;
    W[6 * r + 3] += d[1] * k2 - d[2] * k1;
    W[6 * r + 4] += d[2] * k0 - d[0] * k2;
    W[6 * r + 5] += d[0] * k1 - d[1] * k0;
  }
}

/* The sums W of one row, by aggregate. */
typedef struct {
  PetscInt n;
  PetscInt *b;  /* number of aggregates; [n] aggregates */
  PetscReal *W; /* [n][18] */
} RowSums;

static inline PetscReal *sum_of(RowSums *row, PetscInt b)
{
  PetscInt k = 0;

  while (k < row->n && row->b[k] != b) k++;
  if (k == row->n) {
    row->b[row->n++] = b;
    for (int e = 0; e < 18; e++) row->W[18 * k + e] = 0.;
  }
  return row->W + 18 * k;
}

/* W of row i. Prescribed components are left out: their rows and columns have only the diagonal. */
static void sum_row(SbCoarse c, const SbMatBlocks *x, PetscInt i, RowSums *row)
{
  const SbPlan p = c->space->plan;
  const PetscInt first = x->symmetric ? p->diagonal[i] : p->di[i];
  const PetscScalar *K = x->value[0] + 9 * (size_t)(x->symmetric ? p->ui[i] : p->di[i]);

  row->n = 0;
  for (PetscInt k = first; k < p->di[i + 1]; k++, K += 9) {
    const PetscInt j = p->dj[k], b = c->agg[j];

    if (b < 0) continue;
    if (j == i) {
      PetscScalar D[9];

      for (int e = 0; e < 9; e++) D[e] = c->space->fixed[i] & (1 << (e / 3)) ? 0. : K[e];
      add_column(D, x->symmetric ? 0.5 : 1., c->d + 3 * j, sum_of(row, b));
    } else
      add_column(K, 1., c->d + 3 * j, sum_of(row, b));
  }
  for (PetscInt k = p->oi[i]; k < p->oi[i + 1]; k++) {
    const PetscInt j = p->oj[k], b = c->agg[j];

    if (b >= 0) add_column(x->value[1] + 9 * (size_t)k, 1., c->d + 3 * j, sum_of(row, b));
  }
}

/* Pointer to block (a, b) of E, a own. */
static inline PetscReal *block_of(SbCoarse c, PetscInt a, PetscInt b)
{
  PetscInt k = c->start[a - c->first];

  while (c->column[k] != b) k++;
  return c->value + 36 * k;
}

PetscErrorCode SbCoarseSetUp(SbCoarse c, Mat A)
{
  SbPlan p;
  PetscInt widest = 1;
  SbMatBlocks x;
  RowSums row;

  PetscFunctionBeginUser;
  c->ok = PETSC_TRUE;
  if (!c->N) PetscFunctionReturn(PETSC_SUCCESS);
  p = c->space->plan;
  for (PetscInt i = 0; i < c->space->nnode_owned; i++)
    widest = PetscMax(widest, p->di[i + 1] - p->di[i] + p->oi[i + 1] - p->oi[i]);
  PetscCall(PetscMalloc2(widest, &row.b, 18 * widest, &row.W));
  PetscCall(PetscArrayzero(c->value, 36 * c->start[c->n]));
  PetscCall(SbMatGetBlocks(A, &x));
  for (PetscInt i = 0; i < c->space->nnode_owned; i++) {
    PetscInt a;

    if (c->agg[i] < 0) continue;
    sum_row(c, &x, i, &row);
    /* E_ab += Z_i^T W_ib for the aggregates b around node i. With symmetric storage blocks below the diagonal are transposed. */
    a = c->agg[i];
    for (PetscInt k = 0; k < row.n; k++) {
      const PetscInt b = row.b[k];
      const PetscBool below = (PetscBool)(x.symmetric && b < a);
      PetscReal *E = below ? block_of(c, b, a) : block_of(c, a, b);

      for (int q = 0; q < 6; q++) {
        const PetscReal f[3] = {row.W[18 * k + q], row.W[18 * k + 6 + q], row.W[18 * k + 12 + q]};
        PetscReal m[6] = {0.};

        SbCoarseAddMoments(c->d + 3 * i, f, m);
        for (int e = 0; e < 6; e++) E[below ? 6 * q + e : 6 * e + q] += m[e];
      }
    }
  }
  PetscCall(SbMatRestoreBlocks(&x));
  /* Diagonal blocks: made symmetric, vanishing modes filled. With symmetric storage, blocks below them are copied from above. */
  for (PetscInt a = 0; a < c->n; a++) {
    PetscReal *E = c->value + 36 * c->start[a], trace = 0.;

    for (int i = 0; i < 6; i++) {
      for (int j = 0; j <= i; j++)
        E[6 * i + j] = E[6 * j + i] = (x.symmetric ? 1. : 0.5) * (E[6 * i + j] + E[6 * j + i]);
      trace += E[7 * i];
    }
    for (int e = 0; e < 36; e++) E[e] += trace / 6. * c->null[36 * a + e];
    for (PetscInt k = c->start[a] + 1; x.symmetric && k < c->start[a + 1] && c->column[k] < a; k++) {
      const PetscReal *above = block_of(c, c->column[k], a);

      for (int e = 0; e < 36; e++) c->value[36 * k + e] = above[6 * (e % 6) + e / 6];
    }
  }
  PetscCall(PetscFree2(row.b, row.W));
  PetscCall(SbCoarseSetUpSolver(c));
  PetscFunctionReturn(PETSC_SUCCESS);
}
