/*
  The Schur complement on the interface between ranks, for substructuring.

  The interface nodes (interface_nodes.c) separate the ranks, so each rank eliminates its interior. The
  remaining matrix on the interface is a dense S, the sum of the ranks' Schur complements. The factorisation S
  = L L^T works on block columns, distributed cyclically, and S^-1 = W^T W with W = L^-1. Each rank has some
  rows W_r of the triangle W and adds W_r^T (W_r b): symmetric and positive definite for any rounding of W,
  unlike a rounded inverse. Hence W is stored in 16-bit integers (quantized.h); a block of rows is used twice
  while it is in the cache, so memory is read once: a quarter of the bytes of the inverse in single precision.
  An application sums two short vectors over the ranks. Ranks with less work in their interior have more rows.

  Not handled: zeros of W between parts of the interface that are not connected.
*/
#include "sbsolver.h"
#include "rotated.h"
#include "quantized.h"
#include <petscblaslapack.h>

#define BLOCK 48        /* unknowns in a block of rows of W and of block columns of L */
#define MOST_NODES 1500 /* most interface nodes: 162 MB per rank during the factorisation */

/* A block of rows of W on this rank; its transpose is a panel. */
typedef struct {
  PetscInt first, nrow;
  size_t offset; /* position in word */
} Rows;

struct _p_SbInterfaceFactor {
  PetscInt nblock; /* number of row blocks, all ranks */
  PetscInt nrows;
  Rows *rows;     /* [nrows] row blocks of this rank */
  size_t nword;   /* number of words in use */
  int32_t *word;  /* words, with room for reads beyond the last panel */
  float *scale;   /* [3 n][2] scales of the rows; the second ones are unused */
  float *sum, *y; /* [3 n] sum of the right-hand sides; own part of the solution; room for one block more */
};

PetscErrorCode SbSpaceInterfaceSize(SbSpace s, PetscInt *n, PetscInt *most)
{
  PetscInt *index, nmine;

  PetscFunctionBeginUser;
  *most = MOST_NODES;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-pc_rotated_interface", most, NULL));
  if (!s->plan) PetscCall(SbPlanCreate(s, &s->plan));
  PetscCall(PetscMalloc1(s->nnode, &index));
  PetscCall(SbInterfaceChooseNodes(s, index, &nmine, n));
  PetscCall(PetscFree(index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceCreate(SbSpace s, SbInterface *face)
{
  SbInterface f;
  PetscInt k = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&f));
  PetscCall(PetscNew(&f->factor));
  f->comm = s->comm;
  PetscCall(PetscMalloc1(s->nnode, &f->index));
  PetscCall(SbInterfaceChooseNodes(s, f->index, &f->nmine, &f->n));
  PetscCall(PetscMalloc1(f->nmine, &f->mine));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (f->index[i] >= 0) f->mine[k++] = i;
  }
  f->factor->nblock = (3 * f->n + BLOCK - 1) / BLOCK;
  PetscCall(PetscMalloc1(f->factor->nblock, &f->factor->rows));
  PetscCall(allocate_pages(sizeof(float) * 6 * (size_t)f->n, &f->factor->scale));
  PetscCall(allocate_pages(sizeof(float) * (3 * (size_t)f->n + ROWS), &f->factor->sum));
  PetscCall(allocate_pages(sizeof(float) * (3 * (size_t)f->n + ROWS), &f->factor->y));
  *face = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceDestroy(SbInterface *f)
{
  PetscFunctionBeginUser;
  if (!*f) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*f)->factor->rows));
  free((*f)->factor->word);
  free((*f)->factor->scale);
  free((*f)->factor->sum);
  free((*f)->factor->y);
  PetscCall(PetscFree((*f)->factor));
  PetscCall(PetscFree((*f)->index));
  PetscCall(PetscFree((*f)->mine));
  PetscCall(PetscFree(*f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscInt64 SbInterfaceBytes(SbInterface f)
{
  return (PetscInt64)(sizeof(*f->factor->word) * f->factor->nword);
}

/* ------------------------------------------------------------------ factorisation */

/* First column of block k of n columns; returns its width. */
static inline PetscInt block_of(PetscInt n, PetscInt k, PetscInt *first)
{
  *first = k * BLOCK;
  return PetscMin(BLOCK, n - *first);
}

/* S = L L^T in place, S a lower triangle [n][n], column-major; at the end each rank has all of L. Block
   column k belongs to rank k modulo the number of ranks. */
static PetscErrorCode factor_columns(MPI_Comm comm, PetscInt n, PetscInt nblock, PetscReal S[], PetscBool *ok)
{
  const PetscScalar one = 1., minus = -1.;
  PetscMPIInt size, rank, count;
  PetscBLASInt ld, nc, nj, below, info;
  PetscInt c, j;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(PetscBLASIntCast(n, &ld));
  *ok = PETSC_TRUE;
  for (PetscInt k = 0; k < nblock && *ok; k++) {
    PetscReal *column, *corner;

    PetscCall(PetscBLASIntCast(block_of(n, k, &c), &nc));
    column = S + (size_t)c * (size_t)n;
    corner = column + c;
    if (k % size == rank) {
      PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &nc, corner, &ld, &info));
      below = ld - (PetscBLASInt)c - nc;
      if (info)
        corner[0] = -1.; /* tells the other ranks of the failure */
      else if (below)
        PetscCallBLAS("BLAStrsm",
                      BLAStrsm_("R", "L", "T", "N", &below, &nc, &one, corner, &ld, corner + nc, &ld));
    }
    PetscCall(PetscMPIIntCast((PetscInt)nc * n, &count));
    PetscCallMPI(MPI_Bcast(column, count, MPIU_REAL, (PetscMPIInt)(k % size), comm));
    *ok = (PetscBool)(corner[0] > 0.);
    /* contribution of this rank's columns */
    for (PetscInt b = k + 1; b < nblock && *ok; b++) {
      if (b % size != rank) continue;
      PetscCall(PetscBLASIntCast(block_of(n, b, &j), &nj));
      below = ld - (PetscBLASInt)j;
      PetscCallBLAS("BLASgemm", BLASgemm_("N", "T", &below, &nj, &nc, &minus, column + j, &ld, column + j,
                                          &ld, &one, S + (size_t)j * (size_t)(n + 1), &ld));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Distributes the row blocks of W, long ones first, each to the rank with the least work so far. */
static PetscErrorCode share_rows(SbInterface f, PetscInt64 work)
{
  SbInterfaceFactor w = f->factor;
  const PetscInt n = 3 * f->n;
  PetscInt64 *load;
  PetscMPIInt size, rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(f->comm, &size));
  PetscCallMPI(MPI_Comm_rank(f->comm, &rank));
  PetscCall(PetscMalloc1(size, &load));
  PetscCallMPI(MPI_Allgather(&work, 1, MPIU_INT64, load, 1, MPIU_INT64, f->comm));
  w->nrows = 0;
  w->nword = 0;
  for (PetscInt b = w->nblock - 1; b >= 0; b--) {
    PetscMPIInt least = 0;
    Rows r;

    r.nrow = block_of(n, b, &r.first);
    r.offset = w->nword;
    for (PetscMPIInt k = 1; k < size; k++) {
      if (load[k] < load[least]) least = k;
    }
    const size_t words = round_up(r.first + r.nrow) * (size_t)r.nrow / 2;
    load[least] += (PetscInt64)(sizeof(*w->word) * words);
    if (least != rank) continue;
    w->nword += words;
    w->rows[w->nrows++] = r;
  }
  PetscCall(PetscFree(load));
  free(w->word);
  PetscCall(allocate_pages(sizeof(*w->word) * (w->nword + 4096), &w->word));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes and stores the rows of W = L^-1 of this rank: L^T w = e for each of them. */
static PetscErrorCode store_rows(SbInterface f, const PetscReal L[])
{
  const SbInterfaceFactor w = f->factor;
  const PetscScalar one = 1.;
  const size_t n = 3 * (size_t)f->n;
  PetscReal *x;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n * BLOCK, &x));
  for (PetscInt b = 0; b < w->nrows; b++) {
    const Rows *r = &w->rows[b];
    const size_t height = (size_t)r->first + (size_t)r->nrow;
    PetscBLASInt order, nrow, ld;

    PetscCall(PetscArrayzero(x, height * (size_t)r->nrow));
    for (PetscInt i = 0; i < r->nrow; i++) x[(size_t)i * height + (size_t)(r->first + i)] = 1.;
    PetscCall(PetscBLASIntCast(r->first + r->nrow, &order));
    PetscCall(PetscBLASIntCast(r->nrow, &nrow));
    PetscCall(PetscBLASIntCast(3 * f->n, &ld));
    PetscCallBLAS("BLAStrsm",
                  BLAStrsm_("L", "L", "T", "N", &order, &nrow, &one, (PetscScalar *)L, &ld, x, &order));
    for (size_t i = 0; i < (size_t)r->nrow; i++)
      w->scale[2 * ((size_t)r->first + i)] =
        store_column(height, 0, x + i * height, (size_t)r->nrow, i, w->word + r->offset);
  }
  PetscCall(PetscFree(x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceFactorise(SbInterface f, PetscInt64 work, PetscReal schur[], PetscBool *ok)
{
  const PetscInt n = 3 * f->n;
  PetscMPIInt size, rank;

  PetscFunctionBeginUser;
  *ok = PETSC_TRUE;
  if (!f->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_size(f->comm, &size));
  PetscCallMPI(MPI_Comm_rank(f->comm, &rank));
  /* each block column is summed on the rank that factors it */
  for (PetscInt k = 0; k < f->factor->nblock; k++) {
    const PetscMPIInt owner = (PetscMPIInt)(k % size);
    PetscInt first;
    PetscMPIInt count;

    PetscCall(PetscMPIIntCast(block_of(n, k, &first) * n, &count));
    PetscReal *column = schur + (size_t)first * (size_t)n;
    PetscCallMPI(
      MPI_Reduce(rank == owner ? MPI_IN_PLACE : column, column, count, MPIU_REAL, MPI_SUM, owner, f->comm));
  }
  PetscCall(factor_columns(f->comm, n, f->factor->nblock, schur, ok));
  if (!*ok) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(share_rows(f, work));
  PetscCall(store_rows(f, schur));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ solves */

/* x += W_r^T W_r sum */
SB_KERNEL static void multiply_rows(const struct _p_SbInterfaceFactor *w, float *x)
{
  float part[BLOCK];

  for (PetscInt b = 0; b < w->nrows; b++) {
    const Rows *r = &w->rows[b];
    const PetscInt n = r->first + r->nrow;
    const float *scale = w->scale + 2 * r->first;
    const int32_t *a = w->word + r->offset;

    panel_transposed(round_up(n), r->nrow, a, w->sum, scale, part);
    panel_multiply(round_up(n), r->nrow, a, part, scale, w->y);
    for (PetscInt i = 0; i < n; i++) x[i] += w->y[i];
  }
}

PetscErrorCode SbInterfaceSolve(SbInterface f, float x[])
{
  PetscMPIInt n;

  PetscFunctionBeginUser;
  if (!f->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMPIIntCast(3 * f->n, &n));
  PetscCallMPI(MPI_Allreduce(x, f->factor->sum, n, MPI_FLOAT, MPI_SUM, f->comm));
  PetscCall(PetscArrayzero(x, n));
  multiply_rows(f->factor, x);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_FLOAT, MPI_SUM, f->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
