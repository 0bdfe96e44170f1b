/*
  The interface between the parts of several ranks, for substructuring.

  A node belongs to it when a cell joins it to a node of a lower rank. All others are interior: those of different ranks are
  never neighbours, so each rank eliminates its own, and what is left is a small dense system on the interface. It is
  inverted once, and each application multiplies some rows of the inverse on each rank: one sum over ranks and one
  gathering of at most a few thousand numbers.
*/
#include "rotated.h"
#include <petscblaslapack.h>

#define MOST_NODES 1500 /* 162 MB while it is inverted */

/* Owned nodes that touch a lower rank, numbered over all ranks. */
static PetscErrorCode mark_owned(SbSpace s, SbInterface f)
{
  const SbPlan p = s->plan;
  PetscInt first = 0;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode; i++) f->index[i] = -1;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (PetscInt k = p->oi[i]; k < p->oi[i + 1] && s->fixed[i] != 7; k++) {
      const PetscInt j = p->oj[k];

      if (s->gnode[j] < s->gnode_start && s->fixed[j] != 7) {
        f->index[i] = f->nmine++;
        break;
      }
    }
  }
  PetscCall(PetscMalloc1(f->nmine, &f->mine));
  PetscCallMPI(MPI_Exscan(&f->nmine, &first, 1, MPIU_INT, MPI_SUM, s->comm));
  PetscCallMPI(MPI_Allreduce(&f->nmine, &f->n, 1, MPIU_INT, MPI_SUM, s->comm));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (f->index[i] < 0) continue;
    f->mine[f->index[i]] = i;
    f->index[i] += first;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ghosts learn their numbers from their owners, one more than them so that zero means none. */
static PetscErrorCode mark_ghosts(SbSpace s, SbInterface f)
{
  const PetscReal *read;
  PetscReal *write;
  Vec number;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceCreateVec(s, &number));
  PetscCall(SbSpaceGetLocalWrite(s, number, &write));
  for (PetscInt i = 0; i < s->nnode_owned; i++) write[3 * i] = (PetscReal)(f->index[i] + 1);
  PetscCall(SbSpaceRestoreLocalWrite(s, number, &write));
  PetscCall(SbSpaceGetLocalRead(s, number, &read));
  for (PetscInt i = s->nnode_owned; i < s->nnode; i++) f->index[i] = (PetscInt)(read[3 * i] + 0.5) - 1;
  PetscCall(SbSpaceRestoreLocalRead(s, number, &read));
  PetscCall(VecDestroy(&number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceCreate(SbSpace s, SbInterface *face)
{
  SbInterface f;
  PetscMPIInt size, rank;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&f));
  f->comm = s->comm;
  PetscCall(PetscMalloc1(s->nnode, &f->index));
  PetscCall(mark_owned(s, f));
  PetscCallMPI(MPI_Comm_size(s->comm, &size));
  PetscCallMPI(MPI_Comm_rank(s->comm, &rank));
  PetscCheck(f->n <= MOST_NODES, s->comm, PETSC_ERR_USER,
             "The parts of %d ranks meet at %" PetscInt_FMT
             " nodes, and the factored preconditioner takes at most %d: use fewer ranks, or -solver cg_icc",
             (int)size, f->n, MOST_NODES);
  if (size > 1) PetscCall(mark_ghosts(s, f));
  PetscCall(PetscMalloc2(size, &f->counts, size, &f->offsets));
  for (PetscMPIInt r = 0; r < size; r++) {
    const PetscInt from = 3 * f->n * r / size, to = 3 * f->n * (r + 1) / size;

    PetscCall(PetscMPIIntCast(from, &f->offsets[r]));
    PetscCall(PetscMPIIntCast(to - from, &f->counts[r]));
  }
  f->row0 = f->offsets[rank];
  f->nrow = f->counts[rank];
  PetscCall(PetscMalloc2((size_t)f->nrow * 3 * (size_t)f->n, &f->inverse, 3 * f->n, &f->sum));
  *face = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceDestroy(SbInterface *f)
{
  PetscFunctionBeginUser;
  if (!*f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*f)->index));
  PetscCall(PetscFree((*f)->mine));
  PetscCall(PetscFree2((*f)->counts, (*f)->offsets));
  PetscCall(PetscFree2((*f)->inverse, (*f)->sum));
  PetscCall(PetscFree(*f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceInvert(SbInterface f, PetscReal schur[], PetscBool *ok)
{
  const size_t n = 3 * (size_t)f->n;
  PetscBLASInt order, info;

  PetscFunctionBeginUser;
  *ok = PETSC_TRUE;
  if (!f->n) PetscFunctionReturn(PETSC_SUCCESS);
  /* one column at a time: a count of MPI may not hold them all */
  for (size_t j = 0; j < n; j++) {
    PetscMPIInt count;

    PetscCall(PetscMPIIntCast((PetscInt)(n - j), &count));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, schur + j * n + j, count, MPIU_REAL, MPI_SUM, f->comm));
  }
  PetscCall(PetscBLASIntCast(3 * f->n, &order));
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &order, schur, &order, &info));
  *ok = (PetscBool)(info == 0);
  if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallBLAS("LAPACKpotri", LAPACKpotri_("L", &order, schur, &order, &info));
  for (size_t i = 0; i < (size_t)f->nrow; i++) {
    const size_t row = (size_t)f->row0 + i;

    for (size_t j = 0; j < n; j++)
      f->inverse[i * n + j] = (float)(j <= row ? schur[j * n + row] : schur[row * n + j]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = A x by rows of A. */
SB_KERNEL static void multiply(PetscInt nrow, PetscInt n, const float *A, const float *x, float *y)
{
  for (PetscInt i = 0; i < nrow; i++, A += n) {
    float lane[16] = {0.f}, sum = 0.f;
    PetscInt j = 0;

    for (; j + 16 <= n; j += 16) {
      for (int l = 0; l < 16; l++) lane[l] += A[j + l] * x[j + l];
    }
    for (; j < n; j++) sum += A[j] * x[j];
    for (int l = 0; l < 16; l++) sum += lane[l];
    y[i] = sum;
  }
}

PetscErrorCode SbInterfaceSolve(SbInterface f, float x[])
{
  PetscMPIInt n;

  PetscFunctionBeginUser;
  if (!f->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMPIIntCast(3 * f->n, &n));
  PetscCallMPI(MPI_Allreduce(x, f->sum, n, MPI_FLOAT, MPI_SUM, f->comm));
  multiply(f->nrow, 3 * f->n, f->inverse, f->sum, x + f->row0);
  PetscCallMPI(
    MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, x, f->counts, f->offsets, MPI_FLOAT, f->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
