/*
  Gauss-Seidel sweeps that read the upper triangle only, and return the residual; block Jacobi
  between ranks.

  With A = L + D + L^T by 3x3 blocks, for the rows and columns of this rank, and A_o those of other
  ranks,
    down   z = (D + L^T)^-1 r, from the last row on: z_i = D_i^-1 (r_i - sum_{j > i} A_ij z_j). The
    residual,
           -L z - A_o z, needs the same blocks: t_j -= A_ij^T z_i for j > i, while they are in the
           cache;
    up     z + (D + L)^-1 (r - A z), from the first row on: z_i = D_i^-1 (b_i - sum_{j > i} A_ij
    z_j) with the
           old z_j, then b_j -= A_ij^T z_i for j > i; b = r - A_o z at first.
  So a sweep with its residual reads the stored half of the matrix once, as a product does. The two
  sweeps are adjoint: with a symmetric correction between them the preconditioner is symmetric.

  Block Jacobi between ranks may increase the energy norm of the error, and does near nu = 1/2. With
  D' = D + E for D it converges; E is diagonal, half the sum of the magnitudes in the columns of
  other ranks (Baker, Falgout, Kolev, Yang 2011, Multigrid smoothers for ultraparallel computing,
  SIAM J. Sci. Comput. 33). t then starts from E z, and D_i^-1 (b_i - ..) becomes D'_i^-1 (b_i + E_i
  z_i - ..).
*/
#include "sbkernel.h"
#include "gauss_seidel.h"

/* z_j -= A_ij^T x for the n blocks right of the diagonal; the fourth lane of x is zero. */
SB_INLINE void subtract_transposed(const PetscScalar *a, PetscInt n, const PetscInt column[],
                                   const PetscReal x[3], PetscScalar z[])
{
  const SbFour xi = {x[0], x[1], x[2], 0.};

  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *b = a + 9 * k;
    PetscScalar *zj = z + 3 * (size_t)column[k];
    const SbFour c0 = *(const SbFour *)b;
    const SbFour c1 = *(const SbFour *)(b + 3);
    const SbFour c5 = *(const SbFour *)(b + 5);
    const SbFour p0 = c0 * xi;
    const SbFour p1 = c1 * xi;
    const SbFour p2 = SB_SHUFFLE(c5, c5, 1, 2, 3, 0) * xi;
    const SbFour s = SB_SHUFFLE(p0, p1, 0, 4, 2, 6) + SB_SHUFFLE(p0, p1, 1, 5, 3, 7);
    const SbTwo low = {s[0], s[1]};
    const SbTwo high = {s[2], s[3]};

    *(SbTwo *)zj -= low + high;
    zj[2] -= (p2[0] + p2[2]) + (p2[1] + p2[3]);
  }
}

#define AHEAD \
  (9 * 32) /* prefetch distance in numbers: the hardware does not predict backward row order */

/* sum_j A_ij z_j over the n blocks right of the diagonal. */
SB_INLINE void row_product(const PetscScalar *a, PetscInt n, const PetscInt column[],
                           const PetscScalar z[], PetscReal sum[3])
{
  SbFour s = {0., 0., 0., 0.};

  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *b = a + 9 * k;
    const PetscScalar *zj = z + 3 * (size_t)column[k];
    const SbFour c5 = *(const SbFour *)(b + 5);

    __builtin_prefetch(b - AHEAD);
    s += *(const SbFour *)b * zj[0] + *(const SbFour *)(b + 3) * zj[1] +
         SB_SHUFFLE(c5, c5, 1, 2, 3, 0) * zj[2];
  }
  for (int c = 0; c < 3; c++)
    sum[c] = s[c];
}

/* y = D^-1 x, D^-1 row-major. */
SB_INLINE void divide(const PetscReal inverse[9], const PetscReal x[3], PetscScalar y[3])
{
  for (int i = 0; i < 3; i++)
    y[i] = SbDot3(inverse + 3 * i, x);
}

SB_KERNEL static void down(PetscInt nrow, const PetscInt start[restrict],
                           const PetscInt column[restrict], const PetscScalar *a,
                           const PetscReal inverse[restrict], const PetscReal *extra,
                           const PetscScalar r[restrict], PetscScalar z[restrict],
                           PetscScalar t[restrict])
{
  a += 9 * (size_t)start[nrow];
  for (PetscInt i = nrow - 1; i >= 0; i--) {
    const PetscInt n = start[i + 1] - start[i];
    PetscReal sum[3];

    a -= 9 * (size_t)n;
    row_product(a + 9, n - 1, column + start[i] + 1, z, sum);
    for (int c = 0; c < 3; c++)
      sum[c] = r[3 * i + c] - sum[c];
    divide(inverse + 9 * (size_t)i, sum, z + 3 * i);
    subtract_transposed(a + 9, n - 1, column + start[i] + 1, z + 3 * i, t);
    for (int c = 0; extra && c < 3; c++)
      t[3 * i + c] += extra[3 * i + c] * z[3 * i + c];
  }
}

SB_KERNEL static void up(PetscInt nrow, const PetscInt start[restrict],
                         const PetscInt column[restrict], const PetscScalar *a,
                         const PetscReal inverse[restrict], const PetscReal *extra,
                         PetscScalar b[restrict], PetscScalar z[restrict])
{
  for (PetscInt i = 0; i < nrow; i++) {
    const PetscInt n = start[i + 1] - start[i];
    PetscReal sum[3];

    row_product(a + 9, n - 1, column + start[i] + 1, z, sum);
    for (int c = 0; c < 3; c++)
      sum[c] = b[3 * i + c] - sum[c];
    for (int c = 0; extra && c < 3; c++)
      sum[c] += extra[3 * i + c] * z[3 * i + c];
    divide(inverse + 9 * (size_t)i, sum, z + 3 * i);
    subtract_transposed(a + 9, n - 1, column + start[i] + 1, z + 3 * i, b);
    a += 9 * (size_t)n;
  }
}

PetscErrorCode SbGaussSeidelSetUp(Mat A, PetscReal inverse[], PetscReal extra[],
                                  PetscBool *positive)
{
  const PetscInt *start;
  const PetscInt *far = NULL;
  const PetscInt *column;
  PetscScalar *a;
  PetscInt n;
  SbMatBlocks b;
  Mat local;

  PetscFunctionBeginUser;
  PetscCall(SbProductGetSymmetric(A, &local));
  PetscCall(SbMatGetPattern(local, &n, &start, &column));

  /* l1-Gauss-Seidel: half the sums of the magnitudes of each row in the columns of other ranks */
  if (extra) {
    PetscCall(PetscArrayzero(extra, 3 * n));
    PetscCall(SbMatGetBlocks(A, PETSC_FALSE, &b));
    if (b.part[1])
      PetscCall(SbMatGetPattern(b.part[1], &n, &far, &column));
    for (PetscInt i = 0; i < n && far; i++)
      for (PetscInt k = 9 * far[i]; k < 9 * far[i + 1]; k++)
        extra[3 * i + k % 3] += 0.5 * PetscAbsReal(b.value[1][k]);
    PetscCall(SbMatRestoreBlocks(&b));
  }
  PetscCall(MatSeqSBAIJGetArray(local, &a));
  *positive = PETSC_TRUE;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal D[9], C[9], det;

    for (int k = 0; k < 9; k++)
      D[k] = a[k] + (extra && k % 4 == 0 ? extra[3 * i + k / 4] : 0.);
    SbMatCofactor(D, C);
    det = SbDot3(D, C);
    if (!(det > 0.))
      *positive = PETSC_FALSE;
    for (int k = 0; k < 9; k++)
      inverse[9 * (size_t)i + (size_t)k] = det > 0. ? C[k] / det : 0.;
    a += 9 * (size_t)(start[i + 1] - start[i]);
  }
  PetscCall(SbMatRestoreRead(local, MatSeqSBAIJRestoreArray, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* down() with the residual R, or up() if it is NULL. */
static PetscErrorCode sweep(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec R, Vec Z,
                            Vec T)
{
  const PetscInt *start, *column;
  const PetscScalar *r;
  PetscScalar *a, *z, *t;
  PetscInt n;
  Mat local;

  PetscFunctionBeginUser;
  PetscCall(SbProductGetSymmetric(A, &local));
  PetscCall(SbMatGetPattern(local, &n, &start, &column));
  PetscCall(MatSeqSBAIJGetArray(local, &a));
  PetscCall(VecGetArray(Z, &z));
  PetscCall(VecGetArray(T, &t));
  if (R) {
    PetscCall(VecGetArrayRead(R, &r));
    down(n, start, column, a, inverse, extra, r, z, t);
    PetscCall(VecRestoreArrayRead(R, &r));
  } else
    up(n, start, column, a, inverse, extra, t, z);
  PetscCall(VecRestoreArray(T, &t));
  PetscCall(VecRestoreArray(Z, &z));
  PetscCall(SbMatRestoreRead(local, MatSeqSBAIJRestoreArray, &a));
  PetscCall(PetscLogFlops(36. * (double)start[n]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGaussSeidelDown(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r,
                                 Vec z, Vec t)
{
  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(t));
  PetscCall(sweep(A, inverse, extra, r, z, t));
  PetscCall(SbProductSubtractOffDiagonal(A, z, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGaussSeidelUp(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r,
                               Vec z, Vec t)
{
  PetscFunctionBeginUser;
  PetscCall(VecCopy(r, t));
  PetscCall(SbProductSubtractOffDiagonal(A, z, t));
  PetscCall(sweep(A, inverse, extra, NULL, z, t));
  PetscFunctionReturn(PETSC_SUCCESS);
}
