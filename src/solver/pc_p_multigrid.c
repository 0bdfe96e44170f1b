/*
  p-multigrid for spaces with P2 bodies: the coarse level is P1 on the vertices of P2.

  One application: a backward Gauss-Seidel sweep, the correction z += P E^-1 P^T (r - A z), a forward Gauss-Seidel sweep (gauss_seidel.c). P interpolates an
  edge node by the mean of its two vertices and is the identity at other nodes, so that bodies with other elements are unchanged on the coarse level. E =
  P^T A P is summed from the rows of A, contributions of effects included. It is factored by the fastest package up to
  FACTORED unknowns; beyond that one cycle of algebraic multigrid, with the rigid-body modes of the bodies, approximates E^-1. Between ranks the
  sweeps are block Jacobi. Symmetric, and positive definite when A is.

  Ronquist and Patera (1987), Spectral element multigrid I, J. Sci. Comput. 2; Helenbrook, Mavriplis, Atkins (2003), Analysis of p-multigrid.

  The number of iterations does not depend on the mesh size. It grows towards nu = 1/2, where the sweeps do not reduce errors with a change of volume of cells
  (docs/reports/solvers.md).

  Prescribed unknowns: those of an edge node are left out; those of a vertex have their diagonal in E and are not interpolated.
*/
#include "sbassembly.h"
#include "sbsolver.h"
#include "sblog.h"
#include "gauss_seidel.h"
#include "solver_impl.h"

#define NAME "p-multigrid"
#define FACTORED 200000 /* largest number of unknowns of E that is factored */
/* Algebraic multigrid, as in pc_levels.c: threshold of strong couplings, unknowns of the coarsest level, least unknowns per rank on finer ones. */
#define WEAK 0.
#define LAST_LEVEL 600
#define PER_RANK 300

typedef struct {
  SbSpace space;
  PetscInt *parent;   /* [nnode][2] local nodes: the vertices of an edge node, else the node itself twice */
  PetscInt *gcoarse;  /* [nnode] global numbers on the coarse level, -1 at edge nodes */
  PetscInt n;         /* number of own nodes of the coarse level */
  PetscInt *node;     /* [n] local nodes */
  PetscInt *row;      /* [nnode_owned] inverse of node, -1 at edge nodes */
  PetscInt *start;    /* [n+1] first block of each row of E */
  PetscInt *column;   /* [start[n]] blocks of own rows: local nodes, ascending */
  PetscReal *value;   /* [start[n]][9], row-major, N/m */
  PetscReal *inverse; /* [nnode_owned][9] inverse diagonal blocks of A */
  PetscReal *extra;   /* [nnode_owned][3] diagonal added in the sweeps (gauss_seidel.c) */
  Mat E;
  PC solver;
  Vec t, g; /* residual; vector with ghosts */
  Vec r, w; /* residual and correction of the coarse level */
} Multigrid;

/* ------------------------------------------------------------------ set-up, once */

PetscErrorCode SbSpaceEdgeParents(SbSpace s, PetscInt **parent)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(2 * s->nnode, parent));
  for (PetscInt k = 0; k < 2 * s->nnode; k++) (*parent)[k] = k / 2;
  for (PetscInt k = 0; s->edge_node && k < 6 * s->mesh->ncell; k++) {
    const PetscInt i = s->edge_node[k];

    for (int v = 0; i >= 0 && v < 2; v++)
      (*parent)[2 * i + v] = s->cell_node[4 * (k / 6) + SbTetEdge[k % 6][v]];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode number_nodes(Multigrid *p)
{
  SbSpace s = p->space;
  PetscInt first = 0;
  PetscReal *number;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceEdgeParents(s, &p->parent));
  PetscCall(PetscMalloc1(s->nnode, &p->gcoarse));
  // own nodes of the coarse level, and their global numbers on all ranks
  PetscCall(PetscMalloc2(s->nnode_owned, &p->node, s->nnode_owned, &p->row));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    p->row[i] = -1;
    if (p->parent[2 * i] != i) continue;
    p->row[i] = p->n;
    p->node[p->n++] = i;
  }
  PetscCallMPI(MPI_Scan(&p->n, &first, 1, MPIU_INT, MPI_SUM, s->comm));
  first -= p->n;
  PetscCall(PetscCalloc1(3 * s->nnode, &number));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    number[3 * i] = p->row[i] < 0 ? -1. : (PetscReal)(first + p->row[i]);
  PetscCall(SbSpaceUpdateGhosts(s, number));
  for (PetscInt i = 0; i < s->nnode; i++) p->gcoarse[i] = (PetscInt)number[3 * i];
  PetscCall(PetscFree(number));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Fills v with rigid-body mode m of a body on the coarse level, zero at prescribed unknowns. */
static PetscErrorCode fill_mode(PetscInt m, PetscScalar v[], const void *ctx)
{
  const Multigrid *p = ctx;
  const SbSpace s = p->space;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < p->n; k++) {
    const PetscInt i = p->node[k];
    PetscReal value[3];

    SbRigidMode(m, s->node_x + 3 * i, s->mesh->body[s->node_body[i]].bbox, value);
    for (PetscInt c = 0; c < 3; c++) v[3 * k + c] = s->fixed[i] & (1 << c) ? 0. : value[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Pattern of E: each coarse node couples to those with which it shares a cell. */
static PetscErrorCode create_operator(Multigrid *p)
{
  const SbSpace s = p->space;
  const SbPlan plan = s->plan;
  PetscInt nz = 0, *own, *foreign;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(p->n + 1, &p->start));
  PetscCall(PetscCalloc2(3 * p->n, &own, 3 * p->n, &foreign));
  for (PetscInt pass = 0; pass < 2; pass++) {
    nz = 0;
    for (PetscInt k = 0; k < p->n; k++) {
      const PetscInt i = p->node[k], nd = plan->di[i + 1] - plan->di[i], no = plan->oi[i + 1] - plan->oi[i];

      p->start[k] = nz;
      for (PetscInt e = 0; e < nd + no; e++) {
        const PetscInt j = e < nd ? plan->dj[plan->di[i] + e] : plan->oj[plan->oi[i] + e - nd];

        if (p->parent[2 * j] != j) continue;
        if (pass) p->column[nz] = j;
        for (PetscInt c = 0; c < 3 && !pass; c++) (e < nd ? own : foreign)[3 * k + c] += 3;
        nz++;
      }
    }
    if (!pass) PetscCall(PetscMalloc2(nz, &p->column, 9 * nz, &p->value));
  }
  p->start[p->n] = nz;
  PetscCall(MatCreate(s->comm, &p->E));
  PetscCall(MatSetSizes(p->E, 3 * p->n, 3 * p->n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(p->E, 3));
  PetscCall(MatSetType(p->E, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(p->E, 0, own));
  PetscCall(MatMPIAIJSetPreallocation(p->E, 0, own, 0, foreign));
  PetscCall(PetscFree2(own, foreign));
  PetscCall(MatSetOption(p->E, MAT_SPD, PETSC_TRUE));
  PetscCall(MatCreateVecs(p->E, &p->r, &p->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_solver(Multigrid *p)
{
  const PetscReal weak = WEAK;
  const char *package;
  char type[SB_NAME_MAX] = "";
  PetscInt N;

  PetscFunctionBeginUser;
  PetscCall(PCCreate(p->space->comm, &p->solver));
  PetscCall(PCSetOptionsPrefix(p->solver, "pc_coarse_"));
  PetscCall(MatGetSize(p->E, &N, NULL));
  PetscCall(SbDirectPackage(p->space->comm, N, PETSC_TRUE, &package));
  PetscCall(PetscOptionsGetString(NULL, "pc_coarse_", "-pc_type", type, sizeof(type), NULL));
  if (package && N <= FACTORED && strcmp(type, PCGAMG))
    PetscCall(SbPCDirectSet(p->solver, package, PETSC_TRUE));
  else {
    PetscCall(SbAttachModes(p->E, fill_mode, p));
    PetscCall(PCSetType(p->solver, PCGAMG));
    PetscCall(PCGAMGSetReuseInterpolation(p->solver, PETSC_TRUE));
    PetscCall(PCGAMGSetThreshold(p->solver, (PetscReal *)&weak, 1));
    PetscCall(PCGAMGSetCoarseEqLim(p->solver, LAST_LEVEL));
    PetscCall(PCGAMGSetProcEqLim(p->solver, PER_RANK));
  }
  PetscCall(PCSetFromOptions(p->solver));
  PetscCall(SbPCCheckPivots(p->solver));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ E = P^T A P */

/* Blocks of one row of A P, by nodes of the coarse level. */
typedef struct {
  PetscInt n;
  PetscInt *node;    /* [n] local nodes */
  PetscInt *slot;    /* [nnode] index of a node in the row, -1: not in it */
  PetscReal (*W)[9]; /* [n] blocks, row-major */
} RowSums;

/* W += weight K for the column of node j, K column-major; columns prescribed at a vertex are left out. */
static void add_column(const Multigrid *p, const PetscScalar K[9], PetscReal weight, PetscInt j, RowSums *row)
{
  const PetscInt *parent = p->parent + 2 * j;
  const PetscBool edge = (PetscBool)(parent[0] != parent[1]);

  for (int v = 0; v < 1 + (int)edge; v++) {
    const PetscInt u = parent[v];
    const PetscReal factor = edge ? 0.5 * weight : weight;
    PetscReal *W;

    if (row->slot[u] < 0) {
      row->slot[u] = row->n;
      row->node[row->n] = u;
      for (int e = 0; e < 9; e++) row->W[row->n][e] = 0.;
      row->n++;
    }
    W = row->W[row->slot[u]];
    for (int e = 0; e < 9; e++) {
      if (!edge || !(p->space->fixed[u] & (1 << (e % 3)))) W[e] += factor * K[3 * (e % 3) + e / 3];
    }
  }
}

/* Sums row i of A P; for symmetric storage from the diagonal on, with half of the diagonal block. */
static void sum_row(const Multigrid *p, const SbMatBlocks *A, PetscInt i, RowSums *row)
{
  const SbPlan plan = p->space->plan;
  const PetscBool symmetric = A->symmetric;
  const PetscInt first = symmetric ? plan->diagonal[i] : plan->di[i];
  const PetscScalar *K = A->value[0] + 9 * (size_t)(symmetric ? plan->ui[i] : first);
  const PetscBool edge = (PetscBool)(p->parent[2 * i] != i);

  row->n = 0;
  for (PetscInt k = first; k < plan->di[i + 1]; k++, K += 9) {
    const PetscInt j = plan->dj[k];
    PetscScalar D[9];

    // rows of prescribed unknowns contain only their diagonal, kept at vertices only
    for (int e = 0; j == i && e < 9; e++) D[e] = edge && p->space->fixed[i] & (1 << (e / 3)) ? 0. : K[e];
    add_column(p, j == i ? D : K, symmetric && j == i ? 0.5 : 1., j, row);
  }
  for (PetscInt k = plan->oi[i]; k < plan->oi[i + 1]; k++)
    add_column(p, A->value[1] + 9 * (size_t)k, 1., plan->oj[k], row);
}

static inline PetscReal *block_of(const Multigrid *p, PetscInt row, PetscInt node)
{
  PetscInt low = p->start[row], high = p->start[row + 1] - 1;

  while (low < high) {
    const PetscInt middle = (low + high) / 2;

    if (p->column[middle] < node)
      low = middle + 1;
    else
      high = middle;
  }
  return p->value + 9 * (size_t)low;
}

/* Adds P^T times the row to the rows of its parents in E; PETSc sends those of other ranks. */
static PetscErrorCode add_row(Multigrid *p, PetscInt i, const RowSums *row, PetscScalar text[],
                              PetscInt columns[])
{
  const SbSpace s = p->space;
  const PetscInt *parent = p->parent + 2 * i;
  const PetscBool edge = (PetscBool)(parent[0] != parent[1]);

  PetscFunctionBeginUser;
  for (int v = 0; v < 1 + (int)edge; v++) {
    const PetscInt u = parent[v];
    const uint8_t skip = edge ? s->fixed[u] : 0;
    const PetscReal factor = edge ? 0.5 : 1.;

    for (PetscInt k = 0; k < row->n; k++) {
      PetscReal *E = u < s->nnode_owned ? block_of(p, p->row[u], row->node[k]) : NULL;

      for (int e = 0; e < 9; e++) {
        const PetscReal x = skip & (1 << (e / 3)) ? 0. : factor * row->W[k][e];

        if (E)
          E[e] += x;
        else
          text[3 * row->n * (e / 3) + 3 * k + e % 3] = x;
      }
      columns[k] = p->gcoarse[row->node[k]];
    }
    if (u >= s->nnode_owned)
      PetscCall(MatSetValuesBlocked(p->E, 1, &p->gcoarse[u], row->n, columns, text, ADD_VALUES));
  }
  for (PetscInt k = 0; k < row->n; k++) row->slot[row->node[k]] = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode assemble(Multigrid *p, Mat A)
{
  const SbSpace s = p->space;
  const SbPlan plan = s->plan;
  PetscInt widest = 1, *columns;
  PetscScalar *text;
  SbMatBlocks blocks;
  RowSums row;

  PetscFunctionBeginUser;
  // the arrays of A, and storage for one row
  PetscCall(SbMatGetBlocks(A, &blocks));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    widest = PetscMax(widest, 2 * (plan->di[i + 1] - plan->di[i] + plan->oi[i + 1] - plan->oi[i]));
  PetscCall(PetscMalloc5(widest, &row.node, s->nnode, &row.slot, widest, &row.W, 9 * widest, &text, widest,
                         &columns));
  for (PetscInt i = 0; i < s->nnode; i++) row.slot[i] = -1;

  // own rows are summed here; PETSc adds contributions of other ranks
  PetscCall(MatZeroEntries(p->E));
  PetscCall(PetscArrayzero(p->value, 9 * (size_t)p->start[p->n]));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    sum_row(p, &blocks, i, &row);
    PetscCall(add_row(p, i, &row, text, columns));
  }
  PetscCall(SbMatRestoreBlocks(&blocks));
  PetscCall(PetscFree5(row.node, row.slot, row.W, text, columns));

  // into E; for symmetric storage the other half is the transpose
  PetscCall(PetscMalloc2(9 * widest, &text, widest, &columns));
  for (PetscInt k = 0; k < p->n; k++) {
    const PetscInt n = p->start[k + 1] - p->start[k];

    for (PetscInt e = 0; e < 9 * n; e++) {
      const PetscInt j = p->column[p->start[k] + e / 9], i = e % 9 / 3, c = e % 3;
      PetscReal x = p->value[9 * (size_t)p->start[k] + (size_t)e];

      if (blocks.symmetric) x += block_of(p, p->row[j], p->node[k])[3 * c + i];
      text[3 * n * i + 3 * (e / 9) + c] = x;
      columns[e / 9] = p->gcoarse[j];
    }
    if (n) PetscCall(MatSetValuesBlocked(p->E, 1, &p->gcoarse[p->node[k]], n, columns, text, ADD_VALUES));
  }
  PetscCall(PetscFree2(text, columns));
  PetscCall(MatAssemblyBegin(p->E, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(p->E, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Multigrid(PC pc)
{
  PCFailedReason reason = PC_NOERROR;
  Multigrid *p;
  PetscBool ok;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  if (!p->parent) {
    PetscCall(number_nodes(p));
    PetscCall(create_operator(p));
    PetscCall(create_solver(p));
    PetscCall(MatCreateVecs(A, &p->t, NULL));
    PetscCall(SbSpaceCreateVec(p->space, &p->g));
    PetscCall(
      PetscMalloc2(9 * (size_t)p->space->nnode_owned, &p->inverse, 3 * p->space->nnode_owned, &p->extra));
  }
  PetscCall(SbGaussSeidelSetUp(A, p->inverse, p->extra, &ok));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &ok, 1, SB_MPI_BOOL, MPI_LAND, p->space->comm));
  if (ok) {
    PetscCall(assemble(p, A));
    PetscCall(PCSetOperators(p->solver, p->E, p->E));
    PetscCall(PCSetUp(p->solver));
    PetscCall(PCGetFailedReason(p->solver, &reason));
  }
  PetscCall(PCSetFailedReason(pc, ok ? reason : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ application */

/* r of the coarse level = P^T t */
static PetscErrorCode restrict_residual(Multigrid *p)
{
  const SbSpace s = p->space;
  const PetscReal *t;
  PetscScalar *r;

  PetscFunctionBeginUser;
  PetscCall(VecCopy(p->t, p->g));
  PetscCall(SbSpaceGetLocalRead(s, p->g, &t));
  PetscCall(VecZeroEntries(p->r));
  PetscCall(VecGetArray(p->r, &r));
  for (PetscInt i = 0; i < s->nnode; i++) {
    const PetscInt *parent = p->parent + 2 * i;
    const PetscReal weight = parent[0] == parent[1] ? 1. : 0.5;

    for (int v = 0; v < (weight < 1. ? 2 : 1); v++) {
      const PetscInt u = parent[v], at = u < s->nnode_owned ? 3 * p->row[u] : -1;

      for (PetscInt c = 0; at >= 0 && c < 3; c++) {
        if (!((s->fixed[i] | s->fixed[u]) & (1 << c))) r[at + c] += weight * t[3 * i + c];
      }
    }
  }
  PetscCall(VecRestoreArray(p->r, &r));
  PetscCall(SbSpaceRestoreLocalRead(s, p->g, &t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z += P w */
static PetscErrorCode add_correction(Multigrid *p, Vec z)
{
  const SbSpace s = p->space;
  const PetscScalar *w;
  const PetscReal *x;
  PetscReal *at;
  PetscScalar *out;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(p->w, &w));
  PetscCall(SbSpaceGetLocalWrite(s, p->g, &at));
  for (PetscInt k = 0; k < p->n; k++) {
    for (PetscInt c = 0; c < 3; c++)
      at[3 * p->node[k] + c] = s->fixed[p->node[k]] & (1 << c) ? 0. : w[3 * k + c];
  }
  PetscCall(SbSpaceRestoreLocalWrite(s, p->g, &at));
  PetscCall(VecRestoreArrayRead(p->w, &w));
  PetscCall(SbSpaceGetLocalRead(s, p->g, &x));
  PetscCall(VecGetArray(z, &out));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscInt *u = p->parent + 2 * i;

    for (PetscInt c = 0; c < 3; c++) {
      if (!(s->fixed[i] & (1 << c))) out[3 * i + c] += 0.5 * (x[3 * u[0] + c] + x[3 * u[1] + c]);
    }
  }
  PetscCall(VecRestoreArray(z, &out));
  PetscCall(SbSpaceRestoreLocalRead(s, p->g, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCApply_Multigrid(PC pc, Vec r, Vec z)
{
  Multigrid *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(SbGaussSeidelDown(A, p->inverse, p->extra, r, z, p->t));
  PetscCall(restrict_residual(p));
  PetscCall(PCApply(p->solver, p->r, p->w));
  PetscCall(add_correction(p, z));
  PetscCall(SbGaussSeidelUp(A, p->inverse, p->extra, r, z, p->t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ create and destroy */

static PetscErrorCode PCView_Multigrid(PC pc, PetscViewer viewer)
{
  Multigrid *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  Gauss-Seidel on P2; P1 on the vertices by:\n"));
  if (p->solver) PetscCall(PCView(p->solver, viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Multigrid(PC pc)
{
  Multigrid *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCDestroy(&p->solver));
  PetscCall(MatDestroy(&p->E));
  PetscCall(VecDestroy(&p->t));
  PetscCall(VecDestroy(&p->g));
  PetscCall(VecDestroy(&p->r));
  PetscCall(VecDestroy(&p->w));
  PetscCall(PetscFree(p->parent));
  PetscCall(PetscFree(p->gcoarse));
  PetscCall(PetscFree2(p->node, p->row));
  PetscCall(PetscFree2(p->column, p->value));
  PetscCall(PetscFree(p->start));
  PetscCall(PetscFree2(p->inverse, p->extra));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCPMultigridCreate(SbSpace s, PC pc)
{
  Multigrid *p;

  PetscFunctionBeginUser;
  PetscCheck(s->edge_node, s->comm, PETSC_ERR_USER,
             "-solver cg_p_multigrid is for runs with a body of -body_<name>_element p2: choose auto, or "
             "cg_two_level");
  PetscCall(PetscNew(&p));
  p->space = s;
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, p));
  PetscCall(PCShellSetName(pc, NAME));
  PetscCall(PCShellSetSetUp(pc, PCSetUp_Multigrid));
  PetscCall(PCShellSetApply(pc, PCApply_Multigrid));
  PetscCall(PCShellSetView(pc, PCView_Multigrid));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_Multigrid));
  PetscFunctionReturn(PETSC_SUCCESS);
}
