/*
  Direct solver for a distributed matrix of 3x3 blocks: rank 0 gathers and factors it (factor.c),
  gathers right-hand sides and scatters solutions.

  The order of elimination is kept while the pattern grows little, as in contact from iteration to
  iteration: METIS computes a new one only when the factor has more than WORSE times the entries of
  the one that METIS ordered last.
*/
#include "sbfactor.h"

#define WORSE 1.25

struct _p_SbBlockSolver {
  MPI_Comm comm;
  PetscMPIInt rank, size;
  PetscInt n, N; /* number of block rows of this rank; of all ranks, 0 on the others than rank 0 */
  MPI_Datatype triple, block;
  PetscMPIInt *row_count, *row_first, *entry_count,
    *entry_first;       /* [size] MPI counts and displacements */
  PetscInt *ia, *ja;    /* rank 0: pattern of all rows */
  PetscReal *value, *x; /* rank 0 of several: blocks of all rows; right-hand side, solution */
  SbFactor factor;
  PetscReal dissected; /* number of entries of the factor when METIS ordered it */
};

PetscErrorCode SbBlockSolverCreate(MPI_Comm comm, SbBlockSolver *solver)
{
  SbBlockSolver b;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&b));
  *solver = b;
  b->comm = comm;
  PetscCallMPI(MPI_Comm_size(comm, &b->size));
  PetscCallMPI(MPI_Comm_rank(comm, &b->rank));
  PetscCallMPI(MPI_Type_contiguous(3, MPIU_REAL, &b->triple));
  PetscCallMPI(MPI_Type_commit(&b->triple));
  PetscCallMPI(MPI_Type_contiguous(9, MPIU_REAL, &b->block));
  PetscCallMPI(MPI_Type_commit(&b->block));
  PetscCall(PetscCalloc4(b->size, &b->row_count, b->size, &b->row_first, b->size, &b->entry_count,
                         b->size, &b->entry_first));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBlockSolverDestroy(SbBlockSolver *solver)
{
  SbBlockSolver b = *solver;

  PetscFunctionBeginUser;
  if (!b)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Type_free(&b->triple));
  PetscCallMPI(MPI_Type_free(&b->block));
  PetscCall(SbFactorDestroy(&b->factor));
  PetscCall(PetscFree4(b->row_count, b->row_first, b->entry_count, b->entry_first));
  PetscCall(PetscFree4(b->ia, b->ja, b->value, b->x));
  PetscCall(PetscFree(*solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Gathers the counts of all ranks and their displacements; returns the sum. */
static PetscInt sum_counts(PetscMPIInt size, const PetscMPIInt count[], PetscMPIInt first[])
{
  PetscInt sum = 0;

  for (PetscMPIInt r = 0; r < size; r++) {
    first[r] = (PetscMPIInt)sum;
    sum += count[r];
  }
  return sum;
}

/* Gathers the pattern on rank 0, and factors it symbolically. */
PetscErrorCode SbBlockSolverAnalyze(SbBlockSolver b, PetscInt n, const PetscInt ia[],
                                    const PetscInt ja[])
{
  PetscMPIInt rows, entries;
  PetscInt nentry;
  PetscInt before = b->N;
  PetscInt *length;
  SbFactor old = b->factor;
  PetscReal flops, size;

  PetscFunctionBeginUser;
  b->n = n;
  PetscCall(PetscMPIIntCast(n, &rows));
  PetscCall(PetscMPIIntCast(ia[n], &entries));
  PetscCallMPI(MPI_Gather(&rows, 1, MPI_INT, b->row_count, 1, MPI_INT, 0, b->comm));
  PetscCallMPI(MPI_Gather(&entries, 1, MPI_INT, b->entry_count, 1, MPI_INT, 0, b->comm));
  PetscCall(PetscFree4(b->ia, b->ja, b->value, b->x));
  b->N = sum_counts(b->size, b->row_count, b->row_first);
  nentry = sum_counts(b->size, b->entry_count, b->entry_first);
  PetscCall(PetscMalloc4(b->N + 1, &b->ia, nentry, &b->ja, b->size > 1 ? 9 * (size_t)nentry : 0,
                         &b->value, 3 * (size_t)b->N, &b->x));
  PetscCall(PetscMalloc1(n, &length));
  for (PetscInt i = 0; i < n; i++)
    length[i] = ia[i + 1] - ia[i];
  PetscCallMPI(MPI_Gatherv(length, rows, MPIU_INT, b->ia + 1, b->row_count, b->row_first, MPIU_INT,
                           0, b->comm));
  PetscCallMPI(MPI_Gatherv(ja, entries, MPIU_INT, b->ja, b->entry_count, b->entry_first, MPIU_INT,
                           0, b->comm));
  PetscCall(PetscFree(length));
  if (b->rank)
    PetscFunctionReturn(PETSC_SUCCESS);
  b->ia[0] = 0;
  for (PetscInt i = 0; i < b->N; i++)
    b->ia[i + 1] += b->ia[i];

  /* keep the old order while its factor is not too large */
  b->factor = NULL;
  if (old && before == b->N) {
    PetscCall(SbFactorCreate(b->N, SB_FACTOR_EXACT, b->ia, b->ja, old, &b->factor));
    SbFactorCost(b->factor, &flops, &size);
    if (size > WORSE * b->dissected)
      PetscCall(SbFactorDestroy(&b->factor));
  }
  PetscCall(SbFactorDestroy(&old));
  if (!b->factor) {
    PetscCall(SbFactorCreate(b->N, SB_FACTOR_EXACT, b->ia, b->ja, NULL, &b->factor));
    SbFactorCost(b->factor, &flops, &b->dissected);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBlockSolverSetUp(SbBlockSolver b, PetscInt n, const PetscInt ia[],
                                  const PetscInt ja[], const PetscReal block[], PetscBool changed,
                                  PetscBool *ok)
{
  PetscFunctionBeginUser;
  if (changed)
    PetscCall(SbBlockSolverAnalyze(b, n, ia, ja));
  if (b->size > 1)
    PetscCallMPI(MPI_Gatherv(block, (PetscMPIInt)ia[n], b->block, b->value, b->entry_count,
                             b->entry_first, b->block, 0, b->comm));
  *ok = PETSC_TRUE;
  if (!b->rank)
    PetscCall(SbFactorNumeric(b->factor, b->ia, b->ja, b->size > 1 ? b->value : block, NULL, ok));
  PetscCallMPI(MPI_Bcast(ok, 1, SB_MPI_BOOL, 0, b->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBlockSolverCost(SbBlockSolver b, PetscReal *flops, PetscReal *entries)
{
  PetscReal cost[2] = {0., 0.};

  PetscFunctionBeginUser;
  if (!b->rank)
    SbFactorCost(b->factor, &cost[0], &cost[1]);
  PetscCallMPI(MPI_Bcast(cost, 2, MPIU_REAL, 0, b->comm));
  *flops = cost[0];
  *entries = cost[1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBlockSolverSolve(SbBlockSolver b, Vec R, Vec X)
{
  const PetscMPIInt n = (PetscMPIInt)b->n;
  const PetscScalar *r;
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(R, &r));
  PetscCall(VecGetArray(X, &x));
  if (b->size > 1)
    PetscCallMPI(
      MPI_Gatherv(r, n, b->triple, b->x, b->row_count, b->row_first, b->triple, 0, b->comm));
  if (!b->rank)
    PetscCall(SbFactorSolve(b->factor, b->size > 1 ? b->x : r, b->size > 1 ? b->x : x));
  if (b->size > 1)
    PetscCallMPI(
      MPI_Scatterv(b->x, b->row_count, b->row_first, b->triple, x, n, b->triple, 0, b->comm));
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}
