/*
  Products with symmetric block matrices that read the upper triangle of the diagonal part only.

  Memory bandwidth limits a product. BAIJ stores both triangles and reads twice as much as SBAIJ;
  PETSc's SBAIJ product is not vectorised, and the parallel one not accessible. Here a row i
  computes y_i += A_ij x_j and y_j += A_ij^T x_i block by block, four numbers at a time. The upper
  blocks of BAIJ are copied when the values have changed, at the cost of about two products; reading
  them in place would leave gaps, which defeat the prefetcher (measured: three times slower than
  reading both triangles). PETSc adds the columns of other ranks. The copy is a SBAIJ matrix, which
  an incomplete factorisation can use, too (SbProductGetSymmetric).

  petsc/private/petscimpl.h: there is no public call that tells whether a matrix has changed.

  Measured at 200,000 tets on one rank: 0.9 ms instead of 1.4 (SBAIJ) and 1.7 (BAIJ); in cache half
  the time.
*/
#include "fem_impl.h"
#include <petsc/private/petscimpl.h>

typedef struct {
  Mat diagonal, other; /* parts of the matrix, borrowed; off-diagonal: NULL on one rank */
  PetscScalar *full;   /* values of BAIJ's diagonal part; NULL for SBAIJ, and without rows */
  Mat symmetric;       /* the upper blocks: SBAIJ itself (borrowed), or a copy of BAIJ's (owned) */
  PetscScalar *upper;  /* values of `symmetric`, by rows */
  PetscObjectState copied; /* state of `diagonal` at the last copy */
  VecScatter scatter;      /* scatter of x to the ghosts */
  Vec ghosts;
} Product;

/* y += A x. Row i has the columns column[start[i]..start[i+1]), i first: y_i += A_ii x_i, and for
   each block right of the diagonal y_i += A_ij x_j and y_j += A_ij^T x_i. */
SB_KERNEL static void multiply(PetscInt nrow, const PetscInt start[restrict],
                               const PetscInt column[restrict], const PetscScalar value[restrict],
                               const PetscScalar x[restrict], PetscScalar y[restrict])
{
  for (PetscInt i = 0; i < nrow; i++) {
    const PetscScalar *a = value + 9 * (size_t)start[i];
    const PetscScalar *u = x + 3 * (size_t)column[start[i]];
    PetscScalar *w = y + 3 * (size_t)column[start[i]];
    const SbFour xi = {u[0], u[1], u[2], 0.};
    const SbFour last = {a[6], a[7], a[8], 0.};
    SbFour sum = *(const SbFour *)a * u[0] + *(const SbFour *)(a + 3) * u[1] + last * u[2];

    for (PetscInt k = 1; k < start[i + 1] - start[i]; k++) {
      /* the columns of the block; the fourth lane is multiplied by the zero of xi, and not added to
         y_i */
      const PetscScalar *b = a + 9 * k;
      const PetscScalar *xj = x + 3 * (size_t)column[start[i] + k];
      PetscScalar *yj = y + 3 * (size_t)column[start[i] + k];
      const SbFour c0 = *(const SbFour *)b;
      const SbFour c1 = *(const SbFour *)(b + 3);
      const SbFour c5 = *(const SbFour *)(b + 5);
      const SbFour c2 = SB_SHUFFLE(c5, c5, 1, 2, 3, 0);
      const SbFour p0 = c0 * xi;
      const SbFour p1 = c1 * xi;
      const SbFour p2 = c2 * xi;
      const SbFour s = SB_SHUFFLE(p0, p1, 0, 4, 2, 6) + SB_SHUFFLE(p0, p1, 1, 5, 3, 7);
      const SbTwo low = {s[0], s[1]};
      const SbTwo high = {s[2], s[3]};

      sum += c0 * xj[0] + c1 * xj[1] + c2 * xj[2];
      *(SbTwo *)yj += low + high;
      yj[2] += (p2[0] + p2[2]) + (p2[1] + p2[3]);
    }
    for (int k = 0; k < 3; k++)
      w[k] += sum[k];
  }
}

/* Borrows the block pattern of a sequential BAIJ or SBAIJ matrix. */
PetscErrorCode SbMatGetPattern(Mat A, PetscInt *n, const PetscInt *start[],
                               const PetscInt *column[])
{
  PetscBool done;

  PetscFunctionBeginUser;
  PetscCall(MatGetRowIJ(A, 0, PETSC_FALSE, PETSC_TRUE, n, start, column, &done));
  PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "PETSc does not show the rows of a block matrix");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The data of A, with an updated copy of BAIJ's upper blocks. */
static PetscErrorCode product_of(Mat A, Product **product)
{
  const PetscInt *all, *start, *column;
  PetscObjectState state;
  PetscObject container;
  PetscInt n;
  Product *p;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectQuery((PetscObject)A, "sb_product", &container));
  PetscCheck(container, PetscObjectComm((PetscObject)A), PETSC_ERR_ARG_WRONG,
             "Not a block matrix of a space");
  PetscCall(PetscContainerGetPointer((PetscContainer)container, (void **)product));
  p = *product;
  PetscCall(PetscObjectStateGet((PetscObject)p->diagonal, &state));
  if (!p->full || state == p->copied)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMatGetPattern(p->diagonal, &n, &all, &column));
  PetscCall(SbMatGetPattern(p->symmetric, &n, &start, &column));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt length = start[i + 1] - start[i];

    PetscCall(PetscArraycpy(p->upper + 9 * (size_t)start[i],
                            p->full + 9 * (size_t)(all[i + 1] - length), 9 * (size_t)length));
  }
  p->copied = state;
  PetscCall(PetscObjectStateIncrease((PetscObject)p->symmetric));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProductGetSymmetric(Mat A, Mat *local)
{
  Product *p;

  PetscFunctionBeginUser;
  PetscCall(product_of(A, &p));
  *local = p->symmetric;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProductSubtractOffDiagonal(Mat A, Vec x, Vec y)
{
  Product *p;

  PetscFunctionBeginUser;
  PetscCall(product_of(A, &p));
  if (!p->other)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecScatterBegin(p->scatter, x, p->ghosts, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(p->scatter, x, p->ghosts, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScale(p->ghosts, -1.));
  PetscCall(MatMultAdd(p->other, p->ghosts, y, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode MatMult_Product(Mat A, Vec x, Vec y)
{
  const PetscInt *start, *column;
  const PetscScalar *in;
  PetscScalar *out;
  PetscInt n;
  Product *p;

  PetscFunctionBeginUser;
  PetscCall(product_of(A, &p));
  PetscCall(SbMatGetPattern(p->symmetric, &n, &start, &column));
  if (p->other)
    PetscCall(VecScatterBegin(p->scatter, x, p->ghosts, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(x, &in));
  PetscCall(VecGetArrayWrite(y, &out));
  PetscCall(PetscArrayzero(out, 3 * n));
  multiply(n, start, column, p->upper, in, out);
  PetscCall(VecRestoreArrayWrite(y, &out));
  PetscCall(VecRestoreArrayRead(x, &in));
  if (p->other) {
    PetscCall(VecScatterEnd(p->scatter, x, p->ghosts, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(MatMultAdd(p->other, p->ghosts, y, y));
  }
  PetscCall(PetscLogFlops(36. * (double)start[n]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_product(void *ctx)
{
  Product *p = SB_DESTROY_CTX(Product, ctx);

  PetscFunctionBeginUser;
  if (p->symmetric != p->diagonal)
    PetscCall(MatDestroy(&p->symmetric));
  PetscCall(VecScatterDestroy(&p->scatter));
  PetscCall(VecDestroy(&p->ghosts));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbProductAttach(Mat A)
{
  const PetscInt *columns;
  PetscBool parallel, symmetric;
  PetscContainer container;
  PetscInt n;
  Product *p;
  Vec x;
  IS from;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  p->copied = -1;
  p->diagonal = p->symmetric = A;
  PetscCall(PetscObjectTypeCompare((PetscObject)A, MATSEQSBAIJ, &symmetric));
  PetscCall(PetscObjectTypeCompare((PetscObject)A, MATMPIBAIJ, &parallel));
  if (parallel) {
    PetscCall(MatMPIBAIJGetSeqBAIJ(A, &p->diagonal, &p->other, &columns));

    /* ghosts in the order of the off-diagonal part's columns */
    PetscCall(MatCreateVecs(p->other, &p->ghosts, NULL));
    PetscCall(MatCreateVecs(A, &x, NULL));
    PetscCall(VecGetLocalSize(p->ghosts, &n));
    PetscCall(ISCreateBlock(PETSC_COMM_SELF, 3, n / 3, columns, PETSC_COPY_VALUES, &from));
    PetscCall(VecScatterCreate(x, from, p->ghosts, NULL, &p->scatter));
    PetscCall(ISDestroy(&from));
    PetscCall(VecDestroy(&x));
  }

  /* the value arrays keep their addresses for the life of the matrix: its pattern is fixed */
  if (!symmetric) {
    PetscCall(MatSeqBAIJGetArray(p->diagonal, &p->full));
    PetscCall(MatSetOption(p->diagonal, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatConvert(p->diagonal, MATSEQSBAIJ, MAT_INITIAL_MATRIX, &p->symmetric));
    PetscCall(MatSetOption(p->symmetric, MAT_SYMMETRIC, PETSC_TRUE));
    PetscCall(MatSetOption(p->symmetric, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  }
  PetscCall(MatSeqSBAIJGetArray(p->symmetric, &p->upper));
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)A), &container));
  PetscCall(PetscContainerSetPointer(container, p));
  PetscCall(SbContainerSetDestroy(container, destroy_product));
  PetscCall(PetscObjectCompose((PetscObject)A, "sb_product", (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscCall(MatSetOperation(A, MATOP_MULT, SB_OPERATION(MatMult_Product)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
