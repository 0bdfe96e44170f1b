/*
  Rows of an operator as 3x3 blocks with local columns, for a matrix-free operator, AIJ, BAIJ or SBAIJ.

  BAIJ and SBAIJ are read in place, by the assembly plan (both store a block column-major; SBAIJ only the
  upper triangle), AIJ by MatGetValues(), several times slower.
*/
#include "fem_impl.h"

/* Copies a column-major block to a row-major one; `turned`: its transpose. */
static inline void copy_block(const PetscScalar *from, PetscBool turned, PetscReal to[9])
{
  for (int e = 0; e < 9; e++) to[e] = from[turned ? e : 3 * (e % 3) + e / 3];
}

PetscErrorCode SbSpaceGetRows(SbSpace s, Mat A, PetscInt n, const PetscInt node[], PetscInt ia[],
                              PetscInt ja[], PetscReal block[])
{
  const SbPlan p = s->plan;
  const SbPack *R;
  PetscBool blocks;
  PetscInt widest = 0;

  PetscFunctionBeginUser;
  ia[0] = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = node[k], nd = p->di[i + 1] - p->di[i], no = p->oi[i + 1] - p->oi[i];

    ia[k + 1] = ia[k] + nd + no;
    widest = PetscMax(widest, nd + no);
    if (!ja) continue;
    PetscCall(PetscArraycpy(ja + ia[k], p->dj + p->di[i], nd));
    PetscCall(PetscArraycpy(ja + ia[k] + nd, p->oj + p->oi[i], no));
  }
  if (!block) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)A, &blocks, MATSEQBAIJ, MATMPIBAIJ, MATSEQSBAIJ, ""));
  PetscCall(SbMatrixFreeGetRotations(A, &R));
  PetscCall(PetscArrayzero(block, 9 * ia[n]));
  if (R)
    PetscCall(SbMatrixFreeAddRows(A, n, node, ia, block));
  else if (blocks) {
    SbMatBlocks b;

    PetscCall(SbMatGetBlocks(A, &b));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt i = node[k];
      PetscReal *to = block + 9 * ia[k];

      /* for SBAIJ, blocks left of the diagonal are transposed from the rows of their columns */
      for (PetscInt e = p->di[i]; e < p->di[i + 1]; e++, to += 9) {
        const PetscBool lower = (PetscBool)(b.symmetric && p->dj[e] < i);
        const PetscInt row = lower ? p->dj[e] : i;
        PetscInt at = e;

        if (lower) {
          PetscCall(PetscFindInt(i, p->di[row + 1] - p->di[row], p->dj + p->di[row], &at));
          at += p->di[row];
        }
        copy_block(b.value[0] + 9 * (size_t)(b.symmetric ? p->ui[row] + at - p->diagonal[row] : at), lower,
                   to);
      }
      for (PetscInt e = p->oi[i]; e < p->oi[i + 1]; e++, to += 9)
        copy_block(b.value[1] + 9 * (size_t)e, PETSC_FALSE, to);
    }
    PetscCall(SbMatRestoreBlocks(&b));
  } else {
    PetscInt *column;
    PetscScalar *value;

    PetscCall(PetscMalloc2(3 * widest, &column, 9 * widest, &value));
    for (PetscInt k = 0; k < n; k++) {
      const PetscInt i = node[k], nd = p->di[i + 1] - p->di[i], ncol = 3 * (ia[k + 1] - ia[k]);
      const PetscInt first = 3 * (s->gnode_start + i), row[3] = {first, first + 1, first + 2};

      for (PetscInt e = 0; e < ncol; e++)
        column[e] = 3 * s->gnode[e / 3 < nd ? p->dj[p->di[i] + e / 3] : p->oj[p->oi[i] + e / 3 - nd]] + e % 3;
      PetscCall(MatGetValues(A, 3, row, ncol, column, value));
      for (PetscInt e = 0; e < 3 * ncol; e++)
        block[9 * (ia[k] + e % ncol / 3) + 3 * (e / ncol) + e % 3] = value[e];
    }
    PetscCall(PetscFree2(column, value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
