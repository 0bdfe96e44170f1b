/*
  Multifrontal Cholesky factorisation of a matrix of 3x3 blocks (Duff and Reid 1983; Liu, "The
  multifrontal method for sparse matrix solution", 1992), with triangular solves that read as little
  memory as possible.

  Each supernode, a group of columns with one pattern (elimination.c), has a dense front: its
  entries of A and the updates of its children. LAPACK factors the leading block, BLAS forms the
  update for the parent. Some nodes may be kept, that is, not eliminated: the updates (contribution
  blocks) of the roots sum to the Schur complement on them. An exact factor has L in double
  precision.

  A solve reads every entry of L twice, and memory bandwidth limits its speed. Entries are therefore
  stored as 16-bit integers times a scale per column: the rounding, 1.5e-5 of the largest entry of a
  column, does not change the iterations of a preconditioned solver, and 2 bytes instead of 8 per
  entry make it three to four times faster. Two entries share a 32-bit word; quantized.h describes
  the format. The columns of a supernode are divided into panels of at most PANEL nodes, whose
  diagonal block is stored inverted; the rows below lie in blocks of ROWS, each [column][row], so
  that both substitutions read memory in order.

  Not handled: indefinite matrices (ok = PETSC_FALSE), iterative refinement.
*/
#include "sbfactor.h"
#include "elimination.h"
#include "quantized.h"
#include <petscblaslapack.h>

typedef struct {
  PetscInt first, ncol; /* first position; number of nodes in the panel */
  PetscInt group;       /* supernode of the panel */
  PetscInt nrow;        /* number of nodes in the rows below */
  const PetscInt *row;  /* [nrow] positions of these, borrowed from the elimination */
  size_t offset; /* position of the inverted diagonal block in word[]; the rows below follow it */
} Panel;

struct _p_SbFactor {
  SbElimination e;
  PetscInt npanel, tallest; /* panels; unknowns in the largest front */
  Panel *panel;
  size_t nword;
  int32_t *word; /* [nword] stored entries */
  float *scale;  /* [3 nfree][2] scale of each column in the diagonal block and below */
  float *w;      /* [3 n] right-hand side and solution in order of elimination */
  float *below;  /* [tallest] values in the rows below a panel */

  /* an exact factor, in place of the panels */
  size_t
    *column; /* [nsuper+1] position in L of a supernode's columns; NULL: L is stored in panels */
  PetscScalar *L,
    *y; /* factored fronts, column-major; [3 n + tallest] solution, then rows below a supernode */
};

PetscErrorCode SbFactorCreate(PetscInt n, PetscInt nkeep, const PetscInt ia[], const PetscInt ja[],
                              SbFactor old, SbFactor *factor)
{
  const PetscBool exact = (PetscBool)(nkeep == SB_FACTOR_EXACT);
  const SbElimination *e;
  SbFactor f;

  PetscFunctionBeginUser;

  // order of elimination and pattern of L
  PetscCall(PetscNew(&f));
  *factor = f;
  e = &f->e;
  PetscCall(SbEliminationCreate(n, exact ? 0 : nkeep, ia, ja, old ? old->e.order : NULL, &f->e));
  if (exact) {
    // positions of the supernodes' columns in L
    PetscCall(PetscCalloc1(e->nsuper + 1, &f->column));
    for (PetscInt g = 0; g < e->nsuper; g++) {
      const PetscInt ncol = 3 * (e->first[g + 1] - e->first[g]);
      const PetscInt nall = 3 * (e->start[g + 1] - e->start[g]);

      f->column[g + 1] = f->column[g] + (size_t)ncol * (size_t)nall;
      f->tallest = PetscMax(f->tallest, nall);
    }
    PetscCall(PetscMalloc2(f->column[e->nsuper], &f->L, 3 * n + f->tallest, &f->y));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(
    PetscMalloc3(e->nsuper + e->nfree / PANEL, &f->panel, 6 * e->nfree, &f->scale, 3 * n, &f->w));

  // a supernode is divided evenly into panels of at most PANEL nodes: their rows below and position
  // of words
  for (PetscInt g = 0; g < e->nsuper; g++) {
    const PetscInt ncol = e->first[g + 1] - e->first[g];
    const PetscInt nall = e->start[g + 1] - e->start[g];
    const PetscInt npart = (ncol + PANEL - 1) / PANEL;

    for (PetscInt part = 0; part < npart; part++) {
      const PetscInt from = ncol * part / npart;
      const PetscInt to = ncol * (part + 1) / npart;
      Panel *p = &f->panel[f->npanel++];

      *p =
        (Panel){e->first[g] + from, to - from, g, nall - to, e->list + e->start[g] + to, f->nword};
      f->nword += 3 * (size_t)p->ncol * (round_up(3 * p->ncol) + round_up(3 * p->nrow)) / 2;
    }
    f->tallest = PetscMax(f->tallest, 3 * nall);
  }

  // storage of the panels, with room for reads beyond the end, and of the rows below one of them
  PetscCall(allocate_pages(sizeof(*f->word) * (f->nword + 4096), &f->word));
  PetscCall(allocate_pages(sizeof(float) * (size_t)(f->tallest + ROWS), &f->below));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFactorDestroy(SbFactor *f)
{
  PetscFunctionBeginUser;
  if (!*f)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbEliminationDestroy(&(*f)->e));
  PetscCall(PetscFree3((*f)->panel, (*f)->scale, (*f)->w));
  PetscCall(PetscFree((*f)->column));
  PetscCall(PetscFree2((*f)->L, (*f)->y));
  free((*f)->word);
  free((*f)->below);
  PetscCall(PetscFree(*f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbFactorCost(SbFactor f, PetscReal *flops, PetscReal *entries)
{
  const SbElimination *e = &f->e;

  // of n columns with m rows below; operations for the leading block, the rows below, the update
  *flops = *entries = 0.;
  for (PetscInt g = 0; g < e->nsuper; g++) {
    const PetscReal n = 3. * (PetscReal)(e->first[g + 1] - e->first[g]);
    const PetscReal m = 3. * (PetscReal)(e->start[g + 1] - e->start[g]) - n;

    *flops += n * (n * n / 3. + n * m + m * m);
    *entries += f->column ? n * (n + m) : n * (n + 1.) / 2. + n * m;
  }
}

PetscInt64 SbFactorBytes(SbFactor f)
{
  return (PetscInt64)(sizeof(*f->word) * f->nword);
}

/* Work space of a factorisation. */
typedef struct {
  PetscInt *position,
    *kept;              /* [n] index of a position in the current front, among the kept nodes */
  PetscInt *at;         /* [tallest / 3] index of the rows of an update */
  PetscScalar *front;   /* [tallest^2] column-major, lower triangle */
  PetscScalar **update; /* [nsuper] update of each supernode for its parent; NULL: none, or used */
  PetscInt *child, *sibling; /* [nsuper] lists of children in the assembly tree */
} Work;

/* Adds the update of supernode g to a lower triangle of order ld, and frees it; index: of positions
   there. */
static PetscErrorCode add_update(const SbElimination *e, PetscInt g, Work *work,
                                 const PetscInt index[], PetscScalar *to, PetscInt ld)
{
  const PetscInt *list = e->list + e->start[g] + e->first[g + 1] - e->first[g];
  const PetscInt nrow = (PetscInt)(e->list + e->start[g + 1] - list);
  PetscInt *at = work->at;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < nrow; k++)
    at[k] = index[list[k]];
  for (PetscInt j = 0; j < nrow; j++) {
    for (PetscInt a = 0; a < 3; a++) {
      const PetscScalar *from = work->update[g] + (size_t)(3 * j + a) * (size_t)(3 * nrow);
      PetscScalar *column = to + (size_t)(3 * at[j] + a) * (size_t)ld;

      for (PetscInt b = a; b < 3; b++)
        column[3 * at[j] + b] += from[3 * j + b];
      for (PetscInt i = j + 1; i < nrow; i++)
        for (PetscInt b = 0; b < 3; b++)
          column[3 * at[i] + b] += from[3 * i + b];
    }
  }
  PetscCall(PetscFree(work->update[g]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One supernode: assembles its front, factors it, keeps its update for the parent. */
static PetscErrorCode eliminate(SbFactor f, PetscInt g, const PetscInt ia[], const PetscInt ja[],
                                const PetscReal block[], Work *work, PetscBool *ok)
{
  const SbElimination *e = &f->e;
  const PetscInt ncol = e->first[g + 1] - e->first[g];
  const PetscInt nall = e->start[g + 1] - e->start[g];
  const PetscInt *list = e->list + e->start[g];
  const PetscInt nrow = nall - ncol;
  const PetscScalar one = 1.;
  const PetscScalar minus = -1.;
  PetscScalar *front = work->front;
  PetscScalar *update;
  PetscBLASInt n, m, ld, info;

  PetscFunctionBeginUser;

  // start the front from the entries of A in the columns of the supernode
  for (PetscInt k = 0; k < nall; k++)
    work->position[list[k]] = k;
  for (size_t j = 0, size = 3 * (size_t)nall; j < size; j++)
    PetscCall(PetscArrayzero(front + size * j + j / 3 * 3, size - j / 3 * 3));

  // row-major block (node, neighbour) is column-major block (neighbour, node)
  for (PetscInt j = e->first[g]; j < e->first[g + 1]; j++) {
    const PetscInt node = e->order[j];
    const PetscInt column = 3 * (j - e->first[g]);

    for (PetscInt k = ia[node]; k < ia[node + 1]; k++) {
      const PetscInt i = e->inverse[ja[k]];

      if (i < j)
        continue;
      for (PetscInt a = 0; a < 3; a++) {
        PetscScalar *to =
          work->front + (size_t)(column + a) * (size_t)(3 * nall) + 3 * work->position[i];

        for (PetscInt b = 0; b < 3; b++)
          to[b] += block[9 * k + 3 * a + b];
      }
    }
  }

  // add the updates of the children and free them
  for (PetscInt c = work->child[g]; c >= 0; c = work->sibling[c])
    PetscCall(add_update(e, c, work, work->position, work->front, 3 * nall));

  // factor the columns of the supernode; the update is for its parent
  if (nrow)
    PetscCall(PetscMalloc1(9 * (size_t)nrow * (size_t)nrow, &work->update[g]));
  update = work->update[g];
  PetscCall(PetscBLASIntCast(3 * ncol, &n));
  PetscCall(PetscBLASIntCast(3 * nrow, &m));
  PetscCall(PetscBLASIntCast(3 * nall, &ld));

  // leading block = L L^T; stop at a non-positive pivot
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &n, front, &ld, &info));
  *ok = (PetscBool)(info == 0);
  if (info || !m)
    PetscFunctionReturn(PETSC_SUCCESS);

  // the rows below it: L21 = A21 L^-T
  PetscCallBLAS("BLAStrsm",
                BLAStrsm_("R", "L", "T", "N", &m, &n, &one, front, &ld, front + n, &ld));

  // the update: A22 - L21 L21^T
  for (PetscInt j = 0; j < m; j++)
    PetscCall(PetscArraycpy(update + (size_t)j * (size_t)m + j,
                            front + (size_t)(n + j) * (size_t)ld + n + j, (size_t)(m - j)));
  PetscCallBLAS("BLASsyrk", BLASsyrk_("L", "N", &m, &n, &minus, front + n, &ld, &one, update, &m));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbFactorNumeric(SbFactor f, const PetscInt ia[], const PetscInt ja[],
                               const PetscReal block[], PetscReal schur[], PetscBool *ok)
{
  const SbElimination *e = &f->e;
  PetscInt q = 0;
  Work work;

  PetscFunctionBeginUser;

  // storage for the largest front, and lists of children
  PetscCall(PetscMalloc6(e->n, &work.position, e->n, &work.kept, e->nsuper, &work.child, e->nsuper,
                         &work.sibling, f->tallest / 3, &work.at,
                         (size_t)f->tallest * (size_t)f->tallest, &work.front));
  PetscCall(PetscCalloc1(e->nsuper, &work.update));
  for (PetscInt k = 0; k < e->n; k++)
    work.kept[k] = k - e->nfree;
  for (PetscInt g = 0; g < e->nsuper; g++)
    work.child[g] = -1;

  // postorder: supernodes come after all their children
  *ok = PETSC_TRUE;
  for (PetscInt g = 0; g < e->nsuper && *ok; g++) {
    PetscCall(eliminate(f, g, ia, ja, block, &work, ok));
    if (!*ok)
      break;

    // store the factored columns, or round them into panels: diagonal blocks inverted, rows below
    // unchanged
    if (f->column)
      PetscCall(PetscArraycpy(f->L + f->column[g], work.front, f->column[g + 1] - f->column[g]));
    for (; q < f->npanel && f->panel[q].group == g; q++) {
      const Panel *p = &f->panel[q];
      const size_t m = 3 * (size_t)p->ncol;
      const size_t ld = 3 * (size_t)(e->start[g + 1] - e->start[g]);
      const PetscScalar *L = work.front + 3 * (size_t)(p->first - e->first[g]) * (ld + 1);
      int32_t *inverse = f->word + p->offset;
      int32_t *below = inverse + m * round_up(3 * p->ncol) / 2;
      float *scale = f->scale + 6 * p->first;

      for (size_t j = 0; j < m; j++) {
        PetscScalar y[3 * PANEL] = {0.};

        // column j of the inverse: L y = e_j
        y[j] = 1.;
        for (size_t c = j; c < m; c++) {
          y[c] /= L[c + c * ld];
          for (size_t i = c + 1; i < m; i++)
            y[i] -= L[i + c * ld] * y[c];
        }
        scale[2 * j] = store_column(m, j, y, m, j, inverse);
        scale[2 * j + 1] = store_column(3 * (size_t)p->nrow, 0, L + m + j * ld, m, j, below);
      }
    }

    // its update is for the parent; without one it has kept nodes only and is added to the Schur
    // complement
    if (e->parent[g] >= 0) {
      work.sibling[g] = work.child[e->parent[g]];
      work.child[e->parent[g]] = g;
    } else if (work.update[g])
      PetscCall(add_update(e, g, &work, work.kept, schur, 3 * (e->n - e->nfree)));
  }

  // after a failure: free the updates that no parent has used
  for (PetscInt g = 0; g < e->nsuper; g++)
    PetscCall(PetscFree(work.update[g]));
  PetscCall(PetscFree6(work.position, work.kept, work.child, work.sibling, work.at, work.front));
  PetscCall(PetscFree(work.update));
  PetscFunctionReturn(PETSC_SUCCESS);
}

SB_KERNEL void SbFactorForward(SbFactor f, const float b[], float kept[])
{
  const SbElimination *e = &f->e;
  float *w = f->w, *below = f->below, pivot[3 * PANEL + PAIR] __attribute__((aligned(64)));

  // copy into the order of elimination; w <- L^-1 w, from the first panel to the last
  for (PetscInt i = 0; i < e->n; i++)
    for (PetscInt c = 0; c < 3; c++)
      w[3 * i + c] = b[3 * e->order[i] + c];
  for (PetscInt q = 0; q < f->npanel; q++) {
    const Panel *p = &f->panel[q];
    const PetscInt ncol = 3 * p->ncol;
    const float *scale = f->scale + 6 * p->first;
    float *x = w + 3 * p->first;

    // the unknowns of the panel: inverse of its diagonal block times their right-hand side
    const int32_t *a = panel_multiply(round_up(ncol), ncol, f->word + p->offset, x, scale, pivot);

    // subtract their contribution from the rows below
    for (PetscInt j = 0; j < ncol; j++)
      x[j] = pivot[j];
    panel_multiply(round_up(3 * p->nrow), ncol, a, pivot, scale + 1, below);
    for (PetscInt k = 0; k < p->nrow; k++)
      for (int c = 0; c < 3; c++)
        w[3 * p->row[k] + c] -= below[3 * k + c];
  }

  // the right-hand side of the kept nodes
  for (PetscInt i = 3 * e->nfree; i < 3 * e->n; i++)
    kept[i - 3 * e->nfree] = w[i];
}

SB_KERNEL void SbFactorBackward(SbFactor f, const float kept[], float x[])
{
  const SbElimination *e = &f->e;
  float *w = f->w, *below = f->below, pivot[3 * PANEL + PAIR] __attribute__((aligned(64)));

  // w <- L^-T w from the values at the kept nodes, from the last panel to the first
  for (PetscInt i = 3 * e->nfree; i < 3 * e->n; i++)
    w[i] = kept[i - 3 * e->nfree];
  for (PetscInt q = f->npanel - 1; q >= 0; q--) {
    const Panel *p = &f->panel[q];
    const PetscInt ncol = 3 * p->ncol;
    const size_t height = round_up(3 * p->nrow);
    const size_t square = round_up(ncol);
    const float *scale = f->scale + 6 * p->first;
    const int32_t *a = f->word + p->offset;
    float *own = w + 3 * p->first;

    // contribution of the solution in the rows below to the right-hand side of the panel
    for (PetscInt k = 0; k < p->nrow; k++)
      for (int c = 0; c < 3; c++)
        below[3 * k + c] = w[3 * p->row[k] + c];
    for (size_t k = 3 * (size_t)p->nrow; k < height; k++)
      below[k] = 0.f;
    panel_transposed(height, ncol, a + (size_t)ncol * square / 2, below, scale + 1, pivot);

    // the unknowns of the panel: transposed inverse times the difference
    for (PetscInt j = 0; j < ncol; j++)
      pivot[j] = own[j] - pivot[j];
    for (size_t j = (size_t)ncol; j < square; j++)
      pivot[j] = 0.f;
    panel_transposed(square, ncol, a, pivot, scale, own);
  }

  // into the order of the caller
  for (PetscInt i = 0; i < e->n; i++)
    for (PetscInt c = 0; c < 3; c++)
      x[3 * e->order[i] + c] = w[3 * i + c];
}

PetscErrorCode SbFactorSolve(SbFactor f, const PetscReal b[], PetscReal x[])
{
  const SbElimination *e = &f->e;
  const PetscScalar one = 1.;
  const PetscScalar minus = -1.;
  const PetscScalar zero = 0.;
  const PetscBLASInt unit = 1;
  PetscScalar *y = f->y;
  PetscScalar *below = f->y + 3 * e->n;

  PetscFunctionBeginUser;

  // copy into the order of elimination
  for (PetscInt i = 0; i < 3 * e->n; i++)
    y[i] = b[3 * e->order[i / 3] + i % 3];

  // L y = b from the first supernode to the last, then L^T x = y from the last to the first
  for (PetscInt step = 0; step < 2 * e->nsuper; step++) {
    const PetscBool back = (PetscBool)(step >= e->nsuper);
    const PetscInt g = back ? 2 * e->nsuper - 1 - step : step;
    const PetscInt *row = e->list + e->start[g];
    const PetscInt ncol = e->first[g + 1] - e->first[g];
    const PetscInt nall = e->start[g + 1] - e->start[g];
    const PetscScalar *L = f->L + f->column[g];
    PetscBLASInt n, m, ld;

    PetscCall(PetscBLASIntCast(3 * ncol, &n));
    PetscCall(PetscBLASIntCast(3 * (nall - ncol), &m));
    PetscCall(PetscBLASIntCast(3 * nall, &ld));
    if (back) {
      for (PetscInt k = 0; k < m; k++)
        below[k] = y[3 * row[ncol + k / 3] + k % 3];
      if (m)
        PetscCallBLAS("BLASgemv", BLASgemv_("T", &m, &n, &minus, L + n, &ld, below, &unit, &one,
                                            y + 3 * e->first[g], &unit));
      PetscCallBLAS("BLAStrsm", BLAStrsm_("L", "L", "T", "N", &n, &unit, &one, L, &ld,
                                          y + 3 * e->first[g], &n));
    } else {
      PetscCallBLAS("BLAStrsm", BLAStrsm_("L", "L", "N", "N", &n, &unit, &one, L, &ld,
                                          y + 3 * e->first[g], &n));
      if (m)
        PetscCallBLAS("BLASgemv", BLASgemv_("N", &m, &n, &one, L + n, &ld, y + 3 * e->first[g],
                                            &unit, &zero, below, &unit));
      for (PetscInt k = 0; k < m; k++)
        y[3 * row[ncol + k / 3] + k % 3] -= below[k];
    }
  }

  // copy back into the order of the caller
  for (PetscInt i = 0; i < 3 * e->n; i++)
    x[3 * e->order[i / 3] + i % 3] = y[i];
  PetscFunctionReturn(PETSC_SUCCESS);
}
