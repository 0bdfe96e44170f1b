/*
  Rows of an operator as 3x3 blocks with local columns, whatever the operator is: a frame operator, AIJ or BAIJ.

  The assembled matrices are read by MatGetRow(): three times slower than knowing their storage, and done for all rows only
  when something is factored.
*/
#include "rotated.h"

/* Place in the row (as ia counts) of the block with global node column g; -1: not in the graph. */
static PetscInt find_column(SbSpace s, PetscInt row, PetscInt g)
{
  const SbPlan p = s->plan;
  const PetscInt nd = p->di[row + 1] - p->di[row];
  const PetscBool owned = (PetscBool)(g >= s->gnode_start && g < s->gnode_start + s->nnode_owned);
  PetscInt lo = owned ? p->di[row] : p->oi[row], hi = owned ? p->di[row + 1] : p->oi[row + 1];

  while (lo < hi) {
    const PetscInt mid = lo + (hi - lo) / 2, node = owned ? p->dj[mid] : p->oj[mid];

    if (s->gnode[node] == g) return owned ? mid - p->di[row] : nd + mid - p->oi[row];
    if (s->gnode[node] < g)
      lo = mid + 1;
    else
      hi = mid;
  }
  return -1;
}

static PetscErrorCode read_rows(SbSpace s, Mat A, PetscInt n, const PetscInt node[], const PetscInt ia[],
                                PetscReal block[])
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < n; k++) {
    for (PetscInt c = 0; c < 3; c++) {
      const PetscInt row = 3 * (s->gnode_start + node[k]) + c, *column;
      const PetscScalar *value;
      PetscInt ncol, at = -1;

      PetscCall(MatGetRow(A, row, &ncol, &column, &value));
      for (PetscInt e = 0; e < ncol; e++) {
        if (!e || column[e] / 3 != column[e - 1] / 3) at = find_column(s, node[k], column[e] / 3);
        if (at >= 0) block[9 * (ia[k] + at) + 3 * c + column[e] % 3] = value[e];
      }
      PetscCall(MatRestoreRow(A, row, &ncol, &column, &value));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceGetRows(SbSpace s, Mat A, PetscInt n, const PetscInt node[], PetscInt ia[],
                              PetscInt ja[], PetscReal block[])
{
  const SbPlan p = s->plan;
  const SbLane *R;

  PetscFunctionBeginUser;
  ia[0] = 0;
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = node[k], nd = p->di[i + 1] - p->di[i], no = p->oi[i + 1] - p->oi[i];

    ia[k + 1] = ia[k] + nd + no;
    if (!ja) continue;
    PetscCall(PetscArraycpy(ja + ia[k], p->dj + p->di[i], nd));
    PetscCall(PetscArraycpy(ja + ia[k] + nd, p->oj + p->oi[i], no));
  }
  if (!block) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscArrayzero(block, 9 * ia[n]));
  PetscCall(SbFrameOperatorGetRotations(A, &R));
  if (R)
    PetscCall(SbFrameOperatorAddRows(A, n, node, ia, block));
  else
    PetscCall(read_rows(s, A, n, node, ia, block));
  PetscFunctionReturn(PETSC_SUCCESS);
}
