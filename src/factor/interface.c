/*
  The Schur complement on the interface between ranks, for substructuring.

  The interface nodes separate the ranks, so each rank eliminates its interior. The remaining matrix
  on the interface is a dense S, the sum of the ranks' Schur complements. The factorisation S = L
  L^T works on block columns, distributed cyclically, and S^-1 = W^T W with W = L^-1. Each rank has
  some rows W_r of the triangle W and adds W_r^T (W_r b): symmetric and positive definite for any
  rounding of W, unlike a rounded inverse. Hence W is stored in 16-bit integers (quantized.h); a
  block of rows is used twice while it is in the cache, so memory is read once: a quarter of the
  bytes of the inverse in single precision. An application sums two short vectors over the ranks.
  Ranks with less work in their interior have more rows.

  Not handled: zeros of W between parts of the interface that are not connected.
*/
#include "sbfactor.h"
#include "quantized.h"
#include <petscblaslapack.h>

#define BLOCK 48        /* unknowns in a block of rows of W and of block columns of L */
#define MOST_NODES 1500 /* most interface nodes: 162 MB per rank during the factorisation */

/* A block of rows of W on this rank; its transpose is a panel. */
typedef struct _SbRows {
  PetscInt first, nrow;
  size_t offset; /* position in word */
} Rows;

/*
  Few nodes that separate the interiors of the ranks, without fully prescribed ones. Output:
  index[nnode], number of a local node among them, -1 for others; those of a rank are consecutive.
  n: their number.

  They are a vertex cover of the graph's edges between nodes of different ranks. The greedy cover
  repeatedly takes the node with the most uncovered edges. A minimum cover, from matchings, has 2 to
  5 % fewer nodes (docs/reports/decisions.md). These edges are few: each rank gathers all of them
  and chooses the same nodes.
*/
static PetscErrorCode choose_nodes(SbSpace s, PetscInt index[], PetscInt *n)
{
  const SbPlan p = s->plan;
  PetscInt count = 0;
  PetscInt nend, nnode;
  PetscInt most = 0;
  PetscInt *mine, *end, *node, *left, *ia, *ja;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < s->nnode; i++)
    index[i] = -1;
  *n = 0;
  if (!s->ghosted)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* global numbers of the ends of edges between free own nodes and those of lower ranks, of all
     ranks */
  PetscCall(PetscMalloc1(2 * p->oi[s->nnode_owned], &mine));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (PetscInt k = p->oi[i]; k < p->oi[i + 1] && s->fixed[i] != 7; k++) {
      const PetscInt j = p->oj[k];

      if (s->gnode[j] >= s->gnode_start || s->fixed[j] == 7)
        continue;
      mine[count++] = s->gnode[j];
      mine[count++] = s->gnode[i];
    }
  }
  PetscCall(SbAllgatherv(s->comm, MPIU_INT, count, mine, &nend, &end, NULL));
  PetscCall(PetscFree(mine));

  /* the nodes, ascending, and their graph by positions among them; left: uncovered edges of each */
  nnode = nend;
  PetscCall(PetscMalloc2(nend, &node, nend, &left));
  PetscCall(PetscArraycpy(node, end, nend));
  PetscCall(PetscSortRemoveDupsInt(&nnode, node));
  for (PetscInt e = 0; e < nend; e++)
    PetscCall(PetscFindInt(end[e], nnode, node, &end[e]));
  PetscCall(SbBucketByKey(nend, end, nnode, &ia, &ja));
  for (PetscInt e = 0; e < nend; e++)
    ja[e] = end[ja[e] ^ 1];
  for (PetscInt k = 0; k < nnode; k++) {
    left[k] = ia[k + 1] - ia[k];
    most = PetscMax(most, left[k]);
  }

  /* taken nodes: -1 */
  for (; most > 0; most--) {
    for (PetscInt k = 0; k < nnode; k++) {
      if (left[k] < most)
        continue;
      left[k] = -1;
      for (PetscInt e = ia[k]; e < ia[k + 1]; e++)
        left[ja[e]] -= left[ja[e]] > 0;
    }
  }

  /* number them over all ranks: the nodes of a rank are consecutive */
  for (PetscInt k = 0; k < nnode; k++)
    left[k] = left[k] < 0 ? (*n)++ : -1;
  for (PetscInt i = 0; i < s->nnode; i++) {
    PetscInt k;

    PetscCall(PetscFindInt(s->gnode[i], nnode, node, &k));
    if (k >= 0)
      index[i] = left[k];
  }
  PetscCall(PetscFree2(node, left));
  PetscCall(PetscFree(end));
  PetscCall(PetscFree(ia));
  PetscCall(PetscFree(ja));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSpaceInterfaceSize(SbSpace s, PetscInt *n, PetscInt *most)
{
  PetscInt *index;

  PetscFunctionBeginUser;
  *most = MOST_NODES;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-pc_rotated_interface", most, NULL));
  if (!s->plan)
    PetscCall(SbPlanCreate(s, &s->plan));
  PetscCall(PetscMalloc1(s->nnode, &index));
  PetscCall(choose_nodes(s, index, n));
  PetscCall(PetscFree(index));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceCreate(SbSpace s, SbInterface *face)
{
  SbInterface f;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&f));
  f->space = s;
  PetscCall(PetscMalloc1(s->nnode, &f->index));
  PetscCall(choose_nodes(s, f->index, &f->n));
  f->nblock = (3 * f->n + BLOCK - 1) / BLOCK;
  PetscCall(PetscMalloc3(f->n, &f->mine, f->nblock, &f->rows, 6 * f->n, &f->scale));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    if (f->index[i] >= 0)
      f->mine[f->nmine++] = i;
  PetscCall(allocate_pages(sizeof(float) * (3 * (size_t)f->n + ROWS), &f->sum));
  PetscCall(allocate_pages(sizeof(float) * (3 * (size_t)f->n + ROWS), &f->y));
  *face = f;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceDestroy(SbInterface *f)
{
  PetscFunctionBeginUser;
  if (!*f)
    PetscFunctionReturn(PETSC_SUCCESS);
  free((*f)->word);
  free((*f)->sum);
  free((*f)->y);
  PetscCall(PetscFree((*f)->index));
  PetscCall(PetscFree3((*f)->mine, (*f)->rows, (*f)->scale));
  PetscCall(PetscFree(*f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First column of block k of n columns; returns its width. */
static inline PetscInt block_of(PetscInt n, PetscInt k, PetscInt *first)
{
  *first = k * BLOCK;
  return PetscMin(BLOCK, n - *first);
}

/* S = L L^T in place, S a lower triangle [n][n], column-major; at the end each rank has all of L.
   Block column k belongs to rank k modulo the number of ranks. */
static PetscErrorCode factor_columns(SbInterface f, PetscReal S[], PetscBool *ok)
{
  const PetscMPIInt size = f->space->size;
  const PetscMPIInt rank = f->space->rank;
  const PetscInt n = 3 * f->n;
  const PetscScalar one = 1.;
  const PetscScalar minus = -1.;
  PetscMPIInt count;
  PetscBLASInt ld, nc, nj, below, info;
  PetscInt c, j;

  PetscFunctionBeginUser;
  PetscCall(PetscBLASIntCast(n, &ld));
  *ok = PETSC_TRUE;
  for (PetscInt k = 0; k < f->nblock && *ok; k++) {
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
        PetscCallBLAS("BLAStrsm", BLAStrsm_("R", "L", "T", "N", &below, &nc, &one, corner, &ld,
                                            corner + nc, &ld));
    }
    PetscCall(PetscMPIIntCast((PetscInt)nc * n, &count));
    PetscCallMPI(MPI_Bcast(column, count, MPIU_REAL, (PetscMPIInt)(k % size), f->space->comm));
    *ok = (PetscBool)(corner[0] > 0.);

    /* contribution of this rank's columns */
    for (PetscInt b = k + 1; b < f->nblock && *ok; b++) {
      if (b % size != rank)
        continue;
      PetscCall(PetscBLASIntCast(block_of(n, b, &j), &nj));
      below = ld - (PetscBLASInt)j;
      PetscCallBLAS("BLASgemm",
                    BLASgemm_("N", "T", &below, &nj, &nc, &minus, column + j, &ld, column + j, &ld,
                              &one, S + (size_t)j * (size_t)(n + 1), &ld));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbInterfaceFactorise(SbInterface f, PetscInt64 work, PetscReal schur[],
                                    PetscBool *ok)
{
  const MPI_Comm comm = f->space->comm;
  const PetscMPIInt size = f->space->size;
  const PetscMPIInt rank = f->space->rank;
  const PetscInt n = 3 * f->n;
  const PetscScalar one = 1.;
  PetscMPIInt count;
  PetscInt64 *load;
  PetscReal *x;

  PetscFunctionBeginUser;
  *ok = PETSC_TRUE;
  if (!n)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* each block column is summed on the rank that factors it */
  for (PetscInt k = 0; k < f->nblock; k++) {
    const PetscMPIInt owner = (PetscMPIInt)(k % size);
    PetscReal *column;
    PetscInt first;

    PetscCall(PetscMPIIntCast(block_of(n, k, &first) * n, &count));
    column = schur + (size_t)first * (size_t)n;
    PetscCallMPI(MPI_Reduce(rank == owner ? MPI_IN_PLACE : column, column, count, MPIU_REAL,
                            MPI_SUM, owner, comm));
  }
  PetscCall(factor_columns(f, schur, ok));
  if (!*ok)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* distribute the row blocks of W, long ones first, each to the rank with the least work so far */
  PetscCall(PetscMalloc2(size, &load, (size_t)n * BLOCK, &x));
  PetscCallMPI(MPI_Allgather(&work, 1, MPIU_INT64, load, 1, MPIU_INT64, comm));
  f->nrows = 0;
  f->nword = 0;
  for (PetscInt b = f->nblock - 1; b >= 0; b--) {
    PetscMPIInt least = 0;
    size_t words;
    Rows r;

    r.nrow = block_of(n, b, &r.first);
    r.offset = f->nword;
    for (PetscMPIInt k = 1; k < size; k++)
      if (load[k] < load[least])
        least = k;
    words = round_up(r.first + r.nrow) * (size_t)r.nrow / 2;
    load[least] += (PetscInt64)(sizeof(*f->word) * words);
    if (least != rank)
      continue;
    f->nword += words;
    f->rows[f->nrows++] = r;
  }
  free(f->word);
  PetscCall(allocate_pages(sizeof(*f->word) * (f->nword + 4096), &f->word));

  /* compute and store those of this rank: L^T w = e for each row w of W = L^-1 */
  for (PetscInt b = 0; b < f->nrows; b++) {
    const Rows *r = &f->rows[b];
    const size_t height = (size_t)r->first + (size_t)r->nrow;
    PetscBLASInt order, nrow, ld;

    PetscCall(PetscArrayzero(x, height * (size_t)r->nrow));
    for (PetscInt i = 0; i < r->nrow; i++)
      x[(size_t)i * height + (size_t)(r->first + i)] = 1.;
    PetscCall(PetscBLASIntCast(r->first + r->nrow, &order));
    PetscCall(PetscBLASIntCast(r->nrow, &nrow));
    PetscCall(PetscBLASIntCast(n, &ld));
    PetscCallBLAS("BLAStrsm",
                  BLAStrsm_("L", "L", "T", "N", &order, &nrow, &one, schur, &ld, x, &order));
    for (size_t i = 0; i < (size_t)r->nrow; i++)
      f->scale[2 * ((size_t)r->first + i)] =
        store_column(height, 0, x + i * height, (size_t)r->nrow, i, f->word + r->offset);
  }
  PetscCall(PetscFree2(load, x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* x += W_r^T W_r sum */
SB_KERNEL static void multiply_rows(SbInterface f, float *x)
{
  float part[BLOCK];

  for (PetscInt b = 0; b < f->nrows; b++) {
    const Rows *r = &f->rows[b];
    const PetscInt n = r->first + r->nrow;
    const float *scale = f->scale + 2 * r->first;
    const int32_t *a = f->word + r->offset;

    panel_transposed(round_up(n), r->nrow, a, f->sum, scale, part);
    panel_multiply(round_up(n), r->nrow, a, part, scale, f->y);
    for (PetscInt i = 0; i < n; i++)
      x[i] += f->y[i];
  }
}

PetscErrorCode SbInterfaceSolve(SbInterface f, float x[])
{
  PetscMPIInt n;

  PetscFunctionBeginUser;
  if (!f->n)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMPIIntCast(3 * f->n, &n));
  PetscCallMPI(MPI_Allreduce(x, f->sum, n, MPI_FLOAT, MPI_SUM, f->space->comm));
  PetscCall(PetscArrayzero(x, n));
  multiply_rows(f, x);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, x, n, MPI_FLOAT, MPI_SUM, f->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}
