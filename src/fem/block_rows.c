/*
  Rows of an operator as 3x3 blocks with local columns, for a matrix-free operator, AIJ, BAIJ or
  SBAIJ, whose values are read in place, by the assembly plan; SBAIJ stores only the upper triangle.
*/
#include "fem_impl.h"

PetscErrorCode SbSpaceGetRows(SbSpace s, Mat A, PetscInt n, const PetscInt node[], PetscInt ia[],
                              PetscInt ja[], PetscReal block[])
{
  const SbPlan p = s->plan;
  const SbPack *R;
  SbMatBlocks b;

  PetscFunctionBeginUser;
  ia[0] = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = node ? node[k] : k;
    const PetscInt nd = p->di[i + 1] - p->di[i];
    const PetscInt no = p->oi[i + 1] - p->oi[i];

    ia[k + 1] = ia[k] + nd + no;
    if (!ja)
      continue;
    PetscCall(PetscArraycpy(ja + ia[k], p->dj + p->di[i], nd));
    PetscCall(PetscArraycpy(ja + ia[k] + nd, p->oj + p->oi[i], no));
  }
  if (!block)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbMatrixFreeGetRotations(A, &R));
  if (R) {
    PetscCall(PetscArrayzero(block, 9 * ia[n]));
    PetscCall(SbMatrixFreeAddRows(A, n, node, ia, block));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbMatGetBlocks(A, PETSC_TRUE, &b));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = node ? node[k] : k;
    const PetscInt nd = p->di[i + 1] - p->di[i];

    for (PetscInt e = 0; e < ia[k + 1] - ia[k]; e++) {
      PetscInt row = i;
      PetscInt at = e < nd ? p->di[i] + e : ~(p->oi[i] + e - nd);
      const PetscBool lower = (PetscBool)(b.symmetric && p->dj[at] < i);
      PetscReal *to = block + 9 * (ia[k] + e);
      const PetscScalar *v;
      size_t rs, cs;

      /* for SBAIJ, blocks left of the diagonal are transposed from the rows of their columns */
      if (lower) {
        row = p->dj[at];
        PetscCall(PetscFindInt(i, p->di[row + 1] - p->di[row], p->dj + p->di[row], &at));
        at += p->di[row];
      }
      v = sb_block(&b, p, row, at, &rs, &cs);
      for (size_t m = 0; m < 9; m++)
        to[m] = lower ? v[m % 3 * rs + m / 3 * cs] : v[m / 3 * rs + m % 3 * cs];
    }
  }
  PetscCall(SbMatRestoreBlocks(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceGetGraph(SbSpace s, PetscInt **ia, PetscInt **ja)
{
  const PetscInt n = s->nnode_owned;
  const PetscInt nz = s->plan->di[n] + s->plan->oi[n];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(n + 1, ia, nz, ja));
  PetscCall(SbSpaceGetRows(s, NULL, n, NULL, *ia, *ja, NULL));
  for (PetscInt k = 0; k < nz; k++)
    (*ja)[k] = s->gnode[(*ja)[k]];
  PetscFunctionReturn(PETSC_SUCCESS);
}
