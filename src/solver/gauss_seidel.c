/*
  Gauss-Seidel sweeps from the upper triangle alone, with the zero vector as first guess: between ranks block Jacobi.

  With A = L + D + L^T by 3x3 blocks, of the rows and columns of this rank,
    forward   z = (D + L)^-1 r:    row by row z_i = D_i^-1 z_i, then z_j -= A_ij^T z_i for j > i, z = r at first;
    backward  z = (D + L^T)^-1 r:  from the last row z_i = D_i^-1 (r_i - sum_{j > i} A_ij z_j).
  Each reads the stored half of the matrix once. PETSc's MatSOR() reads whole rows, block by block: three times as slow here.
*/
#include "sbfour.h"
#include "sbassembly.h"
#include "gauss_seidel.h"

#if defined(SB_HAS_FOUR)
/* z_j -= A_ij^T x for the n blocks behind the diagonal; what is in the fourth lane meets a zero of x. */
SB_INLINE void push(const PetscScalar *a, PetscInt n, const PetscInt column[], const PetscReal x[3],
                    PetscScalar z[])
{
  const Four xi = {x[0], x[1], x[2], 0.};

  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *b = a + 9 * k;
    PetscScalar *zj = z + 3 * (size_t)column[k];
    const Four c0 = *(const Four *)b, c1 = *(const Four *)(b + 3), c5 = *(const Four *)(b + 5);
    const Four p0 = c0 * xi, p1 = c1 * xi, p2 = SHUFFLE(c5, c5, 1, 2, 3, 0) * xi;
    const Four s = SHUFFLE(p0, p1, 0, 4, 2, 6) + SHUFFLE(p0, p1, 1, 5, 3, 7);
    const Two low = {s[0], s[1]}, high = {s[2], s[3]};

    *(Two *)zj -= low + high;
    zj[2] -= (p2[0] + p2[2]) + (p2[1] + p2[3]);
  }
}

  #define AHEAD \
    (9 * 32) /* numbers: rows are taken from the last one on, which the processor does not foresee */

/* sum_j A_ij z_j over the n blocks behind the diagonal. */
SB_INLINE void pull(const PetscScalar *a, PetscInt n, const PetscInt column[], const PetscScalar z[],
                    PetscReal sum[3])
{
  Four s = {0., 0., 0., 0.};

  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *b = a + 9 * k, *zj = z + 3 * (size_t)column[k];
    const Four c5 = *(const Four *)(b + 5);

    __builtin_prefetch(b - AHEAD);
    s += *(const Four *)b * zj[0] + *(const Four *)(b + 3) * zj[1] + SHUFFLE(c5, c5, 1, 2, 3, 0) * zj[2];
  }
  for (int c = 0; c < 3; c++) sum[c] = s[c];
}
#else
SB_INLINE void push(const PetscScalar *a, PetscInt n, const PetscInt column[], const PetscReal x[3],
                    PetscScalar z[])
{
  for (PetscInt k = 0; k < n; k++) {
    for (int c = 0; c < 3; c++) z[3 * (size_t)column[k] + (size_t)c] -= SbDot3(a + 9 * k + 3 * c, x);
  }
}

SB_INLINE void pull(const PetscScalar *a, PetscInt n, const PetscInt column[], const PetscScalar z[],
                    PetscReal sum[3])
{
  sum[0] = sum[1] = sum[2] = 0.;
  for (PetscInt k = 0; k < 9 * n; k++)
    sum[k % 3] += a[k] * z[3 * (size_t)column[k / 9] + (size_t)(k / 3 % 3)];
}
#endif

/* y = D^-1 x, D^-1 by rows. */
SB_INLINE void divide(const PetscReal inverse[9], const PetscReal x[3], PetscScalar y[3])
{
  for (int i = 0; i < 3; i++) y[i] = SbDot3(inverse + 3 * i, x);
}

SB_KERNEL static void forward(PetscInt nrow, const PetscInt first[restrict], const PetscInt end[restrict],
                              const PetscInt column[restrict], const PetscScalar *a,
                              const PetscReal inverse[restrict], PetscScalar z[restrict])
{
  for (PetscInt i = 0; i < nrow; i++) {
    const PetscInt n = end[i] - first[i];
    const PetscReal r[3] = {z[3 * i], z[3 * i + 1], z[3 * i + 2]};

    divide(inverse + 9 * (size_t)i, r, z + 3 * i);
    push(a + 9, n - 1, column + first[i] + 1, z + 3 * i, z);
    a += 9 * (size_t)n;
  }
}

SB_KERNEL static void backward(PetscInt nrow, const PetscInt first[restrict], const PetscInt end[restrict],
                               const PetscInt column[restrict], const PetscScalar *a,
                               const PetscReal inverse[restrict], PetscScalar z[restrict])
{
  for (PetscInt i = nrow - 1; i >= 0; i--) {
    const PetscInt n = end[i] - first[i];
    PetscReal sum[3], r[3];

    a -= 9 * (size_t)n;
    pull(a + 9, n - 1, column + first[i] + 1, z, sum);
    for (int c = 0; c < 3; c++) r[c] = z[3 * i + c] - sum[c];
    divide(inverse + 9 * (size_t)i, r, z + 3 * i);
  }
}

PetscErrorCode SbGaussSeidelSetUp(SbSpace s, Mat A, PetscReal inverse[], PetscBool *positive)
{
  const SbPlan p = s->plan;
  PetscScalar *a;
  Mat local;

  PetscFunctionBeginUser;
  PetscCall(SbProductGetSymmetric(A, &local));
  PetscCall(MatSeqSBAIJGetArray(local, &a));
  *positive = PETSC_TRUE;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal C[9], det;

    SbMatCofactor(a, C);
    det = SbDot3(a, C);
    if (!(det > 0.)) *positive = PETSC_FALSE;
    for (int k = 0; k < 9; k++) inverse[9 * (size_t)i + (size_t)k] = det > 0. ? C[k] / det : 0.;
    a += 9 * (size_t)(p->di[i + 1] - p->diagonal[i]);
  }
  PetscCall(SbMatRestoreRead(local, MatSeqSBAIJRestoreArray, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbGaussSeidel(SbSpace s, Mat A, const PetscReal inverse[], SbGaussSeidelDirection direction,
                             Vec r, Vec z)
{
  const SbPlan p = s->plan;
  const PetscInt n = s->nnode_owned;
  PetscScalar *a, *out;
  Mat local;

  PetscFunctionBeginUser;
  PetscCall(SbProductGetSymmetric(A, &local));
  PetscCall(MatSeqSBAIJGetArray(local, &a));
  PetscCall(VecCopy(r, z));
  PetscCall(VecGetArray(z, &out));
  if (direction == SB_GAUSS_SEIDEL_FORWARD)
    forward(n, p->diagonal, p->di + 1, p->dj, a, inverse, out);
  else
    backward(n, p->diagonal, p->di + 1, p->dj, a + 9 * (size_t)(p->di[n] + n) / 2, inverse, out);
  PetscCall(VecRestoreArray(z, &out));
  PetscCall(SbMatRestoreRead(local, MatSeqSBAIJRestoreArray, &a));
  PetscCall(PetscLogFlops(9. * (double)(p->di[n] + n)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
