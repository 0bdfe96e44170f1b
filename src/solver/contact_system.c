/*
  contact_system.c - linear systems of bodies that touch: the tangent and blocks between nodes that share no cell.

  The places of the blocks change from iteration to iteration, those of the tangent never do. So both are merged row by row into one matrix, which is
  made anew each time, and factored.
*/
#include "sbassembly.h"
#include "sbsolver.h"

struct _p_SbContactSystem {
  SbSpace space;
  KSP ksp;
  Mat A;
  PetscInt *all;     /* [nnode_owned] their numbers */
  PetscInt *ia, *ja; /* of the tangent */
};

PetscErrorCode SbBlocksAdd(SbBlocks *b, PetscInt row, PetscInt column, const PetscReal block[9])
{
  PetscFunctionBeginUser;
  if (b->n == b->size) {
    b->size = PetscMax(1024, 2 * b->size);
    PetscCall(PetscRealloc((size_t)b->size * sizeof(*b->node), &b->node));
    PetscCall(PetscRealloc((size_t)b->size * sizeof(*b->block), &b->block));
  }
  b->node[b->n][0] = row;
  b->node[b->n][1] = column;
  PetscCall(PetscArraycpy(b->block[b->n], block, 9));
  b->n++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBlocksFree(SbBlocks *b)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(b->node));
  PetscCall(PetscFree(b->block));
  *b = (SbBlocks){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemCreate(SbSpace s, SbContactSystem *system)
{
  SbContactSystem c;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&c));
  *system = c;
  c->space = s;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What does not change: where the tangent has its blocks. */
static PetscErrorCode set_up(SbContactSystem c)
{
  const SbSpace s = c->space;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(s->nnode_owned, &c->all, s->nnode_owned + 1, &c->ia));
  for (PetscInt i = 0; i < s->nnode_owned; i++) c->all[i] = i;
  PetscCall(SbSpaceGetRows(s, NULL, s->nnode_owned, c->all, c->ia, NULL, NULL));
  PetscCall(PetscMalloc1(c->ia[s->nnode_owned], &c->ja));
  PetscCall(SbSpaceGetRows(s, NULL, s->nnode_owned, c->all, c->ia, c->ja, NULL));
  for (PetscInt k = 0; k < c->ia[s->nnode_owned]; k++) c->ja[k] = s->gnode[c->ja[k]];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A factorisation for c->A; a new one each time, as one that gathers the matrix on a rank (PCTELESCOPE) cannot be given another. */
static PetscErrorCode create_solver(SbContactSystem c)
{
  const SbSpace s = c->space;
  const char *package;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&c->ksp));
  PetscCall(KSPCreate(s->comm, &c->ksp));
  PetscCall(KSPSetOptionsPrefix(c->ksp, "contact_"));
  PetscCall(KSPSetType(c->ksp, KSPPREONLY));
  PetscCall(KSPGetPC(c->ksp, &pc));
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, PETSC_TRUE, &package));
  PetscCheck(package, s->comm, PETSC_ERR_USER,
             "Contact with -effect_NAME_response barrier needs a factorisation: build PETSc with SuiteSparse "
             "or MUMPS");
  PetscCall(SbPCDirectSet(pc, package, PETSC_TRUE));
  PetscCall(KSPSetOperators(c->ksp, c->A, c->A));
  PetscCall(KSPSetFromOptions(c->ksp));
  PetscCall(SbPCCheckPivots(pc));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The matrix of both, rows in ascending columns. */
static PetscErrorCode merge(SbContactSystem c, Mat K, const SbBlocks *b)
{
  const SbSpace s = c->space;
  const PetscInt n = s->nnode_owned;
  PetscInt *first, *order, *i, *j, *slot, *column, *from, most = 0, nnz = 0;
  PetscReal *value;
  PetscScalar *a;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(9 * (size_t)c->ia[n], &value));
  PetscCall(SbSpaceGetRows(s, K, n, c->all, c->ia, NULL, value));

  /* blocks by rows */
  PetscCall(PetscCalloc1(n + 2, &first));
  PetscCall(PetscMalloc1(b->n, &order));
  for (PetscInt k = 0; k < b->n; k++) first[b->node[k][0] + 2]++;
  for (PetscInt r = 0; r < n; r++) first[r + 2] += first[r + 1];
  for (PetscInt k = 0; k < b->n; k++) order[first[b->node[k][0] + 1]++] = k;
  for (PetscInt r = 0; r < n; r++) most = PetscMax(most, c->ia[r + 1] - c->ia[r] + first[r + 1] - first[r]);

  /* each row: its columns in order, every entry of the tangent and of the blocks added at its place */
  PetscCall(PetscMalloc3(most, &slot, most, &column, most, &from));
  PetscCall(PetscMalloc1(3 * n + 1, &i));
  PetscCall(PetscMalloc1(9 * (size_t)(c->ia[n] + b->n), &j));
  PetscCall(PetscCalloc1(9 * (size_t)(c->ia[n] + b->n), &a));
  i[0] = 0;
  for (PetscInt r = 0; r < n; r++) {
    const PetscInt own = c->ia[r + 1] - c->ia[r], more = first[r + 1] - first[r];
    PetscInt ncolumn = 0;

    for (PetscInt k = 0; k < own + more; k++) {
      column[k] = k < own ? c->ja[c->ia[r] + k] : b->node[order[first[r] + k - own]][1];
      from[k] = k;
    }
    PetscCall(PetscSortIntWithArray(own + more, column, from));
    for (PetscInt k = 0; k < own + more; k++) {
      if (!k || column[k] != column[k - 1]) column[ncolumn++] = column[k];
      slot[k] = ncolumn - 1;
    }
    for (int p = 0; p < 3; p++) {
      for (PetscInt k = 0; k < 3 * ncolumn; k++) j[nnz + 3 * ncolumn * p + k] = 3 * column[k / 3] + k % 3;
      i[3 * r + p + 1] = nnz + 3 * ncolumn * (p + 1);
    }
    for (PetscInt k = 0; k < own + more; k++) {
      const PetscReal *block =
        from[k] < own ? value + 9 * (size_t)(c->ia[r] + from[k]) : b->block[order[first[r] + from[k] - own]];

      for (int p = 0; p < 9; p++) a[nnz + 3 * ncolumn * (p / 3) + 3 * slot[k] + p % 3] += block[p];
    }
    nnz += 9 * ncolumn;
  }
  PetscCall(MatDestroy(&c->A));
  PetscCall(MatCreate(s->comm, &c->A));
  PetscCall(MatSetSizes(c->A, 3 * n, 3 * n, 3 * s->Nnode, 3 * s->Nnode));
  PetscCall(MatSetType(c->A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocationCSR(c->A, i, j, a));
  PetscCall(MatMPIAIJSetPreallocationCSR(c->A, i, j, a));
  PetscCall(MatSetOption(c->A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(PetscFree(a));
  PetscCall(PetscFree(j));
  PetscCall(PetscFree(i));
  PetscCall(PetscFree3(slot, column, from));
  PetscCall(PetscFree(order));
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemSolve(SbContactSystem c, Mat K, const SbBlocks *blocks, PetscBool fresh, Vec F,
                                    Vec Y, KSPConvergedReason *reason, PetscInt *iterations)
{
  PetscFunctionBeginUser;
  if (!c->ja) PetscCall(set_up(c));
  if (fresh || !c->A) {
    PetscCall(merge(c, K, blocks));
    PetscCall(create_solver(c));
  }
  PetscCall(KSPSolve(c->ksp, F, Y));
  PetscCall(KSPGetConvergedReason(c->ksp, reason));
  PetscCall(KSPGetIterationNumber(c->ksp, iterations));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemDestroy(SbContactSystem *system)
{
  SbContactSystem c = *system;

  PetscFunctionBeginUser;
  if (!c) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPDestroy(&c->ksp));
  PetscCall(MatDestroy(&c->A));
  PetscCall(PetscFree2(c->all, c->ia));
  PetscCall(PetscFree(c->ja));
  PetscCall(PetscFree(*system));
  PetscFunctionReturn(PETSC_SUCCESS);
}
