/*
  A preconditioner that rarely factors: P^-1 = Q A0^-1 Q^T.

  The tangent A of a rotated body is nearly the rotated old tangent A0: with Q block diagonal, one
  rotation per node since the factorisation, P = Q A0 Q^T differs from A only as far as rotations
  vary across a cell. Small variations hardly change the number of iterations; nodes with large ones
  are solved exactly (exact_nodes.c). So one factorisation serves a whole run, and a step of a
  swinging bar takes six to ten iterations to 1e-4.

  A0^-1 is applied by a factor in 16-bit integers (factor.c). On several ranks each eliminates its
  interior nodes, and all ranks together solve the Schur complement on the interface nodes
  (interface.c): up to rounding the same preconditioner as on one rank.

  Prescribed unknowns: fully prescribed nodes are left out and divided by their diagonal; nodes with
  one or two are not rotated. Renewal of the factor: see SbPCRotatedCreate(); by iteration counts
  only, so that runs are repeatable.
*/
#include "rotated.h"

#define WORSE_FACTOR \
  4 /* refactor when a solve takes this many times the iterations of the first solve */
#define WORSE_PLUS 16 /* and at least this many more */

typedef struct {
  SbSpace space;
  SbInterface interface;
  PetscInt n,
    nkeep; /* nodes of the factor: interior ones, then the nkeep interface nodes adjacent to them */
  PetscInt *node;    /* [n] local nodes of the space */
  PetscInt *local;   /* [nnode] inverse of node, -1 for nodes not in the factor */
  PetscInt *ia, *ja; /* graph of the interior rows */
  SbFactor factor;
  SbPack *cells;        /* rotations of the cells, owned; NULL: the operator has them */
  PetscReal *rotation;  /* [nnode_owned][9] current rotations of the nodes */
  PetscReal *rotation0; /* [nnode_owned][9] rotations at the factorisation */
  PetscReal *spread;    /* [nnode_owned] variation of the rotation in the cells around a node */
  float *Q;             /* [nnode_owned][9] rotation since the factorisation */
  float *diagonal;      /* [nnode_owned][3] inverse diagonal of fully prescribed nodes */
  float *b, *x;         /* [n][3] right-hand side and solution of the factor */
  float *kept;          /* [nkeep][3] values at the kept nodes */
  float *shared;        /* [3 interface->n] values at the interface */
  float *r, *r1, *z;    /* [nnode_owned][3] work vectors */
  SbExactNodes exact;
  PetscReal limit; /* spread above which a node is solved exactly */
  PetscReal scale; /* factor on residuals, to stay inside the range of float */
  PetscInt fresh;  /* iterations of the first solve with this factor, -1: not known */
  PetscInt nfactor;
  PetscBool renew; /* the next set-up has to factor */
} Rotated;

/* Numbers the nodes of the factor and finds the graph of its rows. */
static PetscErrorCode number_nodes(Rotated *p)
{
  SbSpace s = p->space;
  const SbPlan plan = s->plan;
  PetscInt nz = 0;
  PetscInt ninterior;

  PetscFunctionBeginUser;

  // free nodes of the interior first
  PetscCall(PetscMalloc2(s->nnode, &p->node, s->nnode, &p->local));
  for (PetscInt i = 0; i < s->nnode; i++)
    p->local[i] = -1;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    if (s->fixed[i] == 7 || p->interface->index[i] >= 0)
      continue;
    p->local[i] = p->n;
    p->node[p->n++] = i;
    nz += plan->di[i + 1] - plan->di[i] + plan->oi[i + 1] - plan->oi[i];
  }

  // then the adjacent interface nodes, which are kept
  ninterior = p->n;
  for (PetscInt i = 0; i < s->nnode; i++) {
    if (p->interface->index[i] < 0)
      continue;
    p->local[i] = p->n;
    p->node[p->n++] = i;
  }
  p->nkeep = p->n - ninterior;

  // rows of the interior: columns in the factor
  PetscCall(PetscMalloc2(ninterior + 1, &p->ia, nz, &p->ja));
  PetscCall(SbSpaceGetRows(s, NULL, ninterior, p->node, p->ia, p->ja, NULL));
  nz = 0;
  for (PetscInt k = 0, e = 0; k < ninterior; k++) {
    for (; e < p->ia[k + 1]; e++)
      if (p->local[p->ja[e]] >= 0)
        p->ja[nz++] = p->local[p->ja[e]];
    p->ia[k + 1] = nz;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Set-up for a new operator. */
static PetscErrorCode factor_operator(Rotated *p, Mat A, PetscBool *ok)
{
  SbSpace s = p->space;
  const PetscInt n = s->nnode_owned;
  const PetscInt ninterior = p->n - p->nkeep;
  const PetscInt *kept = p->node + ninterior;
  const PetscInt *index = p->interface->index;
  const PetscInt nall = s->plan->di[n] + s->plan->oi[n];
  const size_t m = 3 * (size_t)p->interface->n;
  const size_t nkept = 3 * (size_t)p->nkeep;
  PetscInt *node, *ia, *ja;
  PetscInt nz = 0;
  PetscInt count = ninterior;
  PetscReal *block, *own, *schur;

  PetscFunctionBeginUser;

  /* the operator's rows of the interior, then those of interface and fully prescribed nodes */
  PetscCall(PetscMalloc4(n, &node, n + 1, &ia, nall, &ja, 9 * (size_t)nall, &block));
  PetscCall(PetscArraycpy(node, p->node, ninterior));
  for (PetscInt i = 0; i < n; i++)
    if (index[i] >= 0 || s->fixed[i] == 7)
      node[count++] = i;
  PetscCall(SbSpaceGetRows(s, A, n, node, ia, ja, block));

  /* factor the interior, without the columns of fully prescribed nodes */
  for (PetscInt at = 0; at < ia[ninterior]; at++) {
    if (p->local[ja[at]] < 0)
      continue;
    for (PetscInt e = 0; e < 9; e++)
      block[9 * nz + e] = block[9 * at + e];
    nz++;
  }
  PetscCall(PetscCalloc2(nkept * nkept, &own, m * m, &schur));
  PetscCall(SbFactorNumeric(p->factor, p->ia, p->ja, block, own, ok));

  /* Schur complement of the interface: its own rows, and the complement of the interior, numbered
     locally; diagonals of prescribed nodes */
  for (PetscInt k = ninterior; k < n; k++) {
    const PetscInt i = node[k];

    for (PetscInt at = ia[k]; at < ia[k + 1]; at++) {
      const PetscInt j = ja[at];
      const PetscInt row = index[i];
      const PetscInt column = index[j];

      for (PetscInt c = 0; c < 3 && i == j && s->fixed[i] == 7; c++)
        p->diagonal[3 * i + c] = (float)(1. / block[9 * at + 4 * c]);
      for (PetscInt e = 0; e < 9 && column >= 0 && row >= column; e++)
        schur[(size_t)(3 * column + e % 3) * m + (size_t)(3 * row + e / 3)] += block[9 * at + e];
    }
  }
  for (size_t j = 0; j < nkept; j++) {
    for (size_t i = j; i < nkept; i++) {
      const size_t row = 3 * (size_t)index[kept[i / 3]] + i % 3;
      const size_t column = 3 * (size_t)index[kept[j / 3]] + j % 3;

      schur[PetscMin(row, column) * m + PetscMax(row, column)] += own[j * nkept + i];
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, s->comm));
  if (*ok)
    PetscCall(SbInterfaceFactorise(p->interface, 2 * SbFactorBytes(p->factor), schur, ok));
  PetscCall(PetscFree2(own, schur));
  PetscCall(PetscFree4(node, ia, ja, block));
  p->nfactor++;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Rotated(PC pc)
{
  const SbPack *cells;
  Rotated *p;
  SbSpace s;
  PetscInt n;
  PetscBool ok = PETSC_TRUE;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  s = p->space;
  n = s->nnode_owned;
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  if (!p->factor) {
    if (!s->plan)
      PetscCall(SbPlanCreate(s, &s->plan));
    PetscCall(SbInterfaceCreate(s, &p->interface));
    PetscCall(number_nodes(p));
    PetscCall(SbFactorCreate(p->n, p->nkeep, p->ia, p->ja, NULL, &p->factor));
    PetscCall(PetscMalloc5(9 * n, &p->rotation, 9 * n, &p->rotation0, n, &p->spread, 9 * n, &p->Q,
                           3 * n, &p->diagonal));
    PetscCall(PetscMalloc7(3 * n, &p->r, 3 * n, &p->r1, 3 * n, &p->z, 3 * p->n, &p->b, 3 * p->n,
                           &p->x, 3 * p->nkeep, &p->kept, 3 * p->interface->n, &p->shared));
  }

  /* the rotations of cells that belong to the operator */
  PetscCall(SbMatrixFreeGetRotations(A, &cells));
  if (!cells) {
    const PetscReal *u = NULL;
    Vec state;

    PetscCall(PetscObjectQuery((PetscObject)A, "sb_state", (PetscObject *)&state));
    PetscCheck(state || s->linear, s->comm, PETSC_ERR_ARG_WRONGSTATE,
               "The operator does not carry its displacement: compose it as sb_state");
    if (!p->cells)
      PetscCall(PetscMalloc1(9 * sb_rotation_points(s) * s->nbatch, &p->cells));
    if (!s->linear)
      PetscCall(SbSpaceGetLocalRead(s, state, &u));
    SbSpaceCellRotations(s, u, p->cells);
    if (!s->linear)
      PetscCall(SbSpaceRestoreLocalRead(s, state, &u));
    cells = (const SbPack *)p->cells;
  }
  PetscCall(SbSpaceAverageRotations(s, cells, p->rotation, p->spread));
  if (p->renew) {
    PetscCall(factor_operator(p, A, &ok));
    PetscCall(PetscArraycpy(p->rotation0, p->rotation, 9 * n));
    p->fresh = -1;
    p->renew = (PetscBool)!ok;
    PetscCall(PetscInfo(pc, "factorisation %" PetscInt_FMT "%s\n", p->nfactor,
                        ok ? "" : " failed: not positive definite"));
  }

  // the rotation of each node since the factorisation
  for (PetscInt i = 0; i < n; i++) {
    PetscReal Q[9] = {1., 0., 0., 0., 1., 0., 0., 0., 1.};

    if (!s->fixed[i])
      SbMatMulTranspose(p->rotation + 9 * i, p->rotation0 + 9 * i, Q);
    for (int k = 0; k < 9; k++)
      p->Q[9 * i + k] = (float)Q[k];
  }
  PetscCall(SbExactNodesSetUp(&p->exact, s, A, p->spread,
                              p->nfactor && p->fresh >= 0 ? p->limit : PETSC_MAX_REAL));
  PetscCall(PCSetFailedReason(pc, ok ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = Q x of one node or, back, Q^T x. */
SB_INLINE void rotate(const float Q[9], int back, const float x[3], float y[3])
{
  const int row = back ? 1 : 3;
  const int column = back ? 3 : 1;

  for (int c = 0; c < 3; c++)
    y[c] = Q[row * c] * x[0] + Q[row * c + column] * x[1] + Q[row * c + 2 * column] * x[2];
}

static PetscErrorCode PCApply_Rotated(PC pc, Vec R, Vec Z)
{
  const PetscScalar *in;
  PetscScalar *out;
  PetscInt n, ninterior;
  float *r, *z;
  SbInterface f;
  Rotated *p;
  SbSpace s;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  s = p->space;
  f = p->interface;
  n = 3 * s->nnode_owned;
  ninterior = p->n - p->nkeep;
  r = p->r1;
  z = p->z;

  // the residual in single precision, without the part of the exact nodes
  PetscCall(VecGetArrayRead(R, &in));
  for (PetscInt i = 0; i < n; i++)
    p->r[i] = r[i] = (float)(p->scale * in[i]);
  PetscCall(VecRestoreArrayRead(R, &in));
  SbExactNodesBefore(&p->exact, r);

  // Q^T r in the interior, and forward substitution
  for (PetscInt k = 0; k < ninterior; k++)
    rotate(p->Q + 9 * p->node[k], 1, r + 3 * p->node[k], p->b + 3 * k);
  PetscCall(PetscArrayzero(p->b + 3 * ninterior, 3 * p->nkeep));
  SbFactorForward(p->factor, p->b, p->kept);

  // interface: right-hand side of own rows plus the contributions of the interior
  PetscCall(PetscArrayzero(p->shared, 3 * f->n));
  for (PetscInt k = 0; k < f->nmine; k++)
    rotate(p->Q + 9 * f->mine[k], 1, r + 3 * f->mine[k], p->shared + 3 * f->index[f->mine[k]]);
  for (PetscInt k = 0; k < 3 * p->nkeep; k++)
    p->shared[3 * f->index[p->node[ninterior + k / 3]] + k % 3] += p->kept[k];
  PetscCall(SbInterfaceSolve(f, p->shared));
  for (PetscInt k = 0; k < 3 * p->nkeep; k++)
    p->kept[k] = p->shared[3 * f->index[p->node[ninterior + k / 3]] + k % 3];

  // backward substitution, and multiplication by Q
  SbFactorBackward(p->factor, p->kept, p->x);
  for (PetscInt k = 0; k < ninterior; k++)
    rotate(p->Q + 9 * p->node[k], 0, p->x + 3 * k, z + 3 * p->node[k]);
  for (PetscInt k = 0; k < f->nmine; k++)
    rotate(p->Q + 9 * f->mine[k], 0, p->shared + 3 * f->index[f->mine[k]], z + 3 * f->mine[k]);

  // prescribed nodes: divide by the diagonal
  for (PetscInt k = 0; k < 3 * s->nfixed && s->fixed_node[k / 3] < s->nnode_owned; k++) {
    const PetscInt c = 3 * s->fixed_node[k / 3] + k % 3;

    if (s->fixed[c / 3] == 7)
      z[c] = p->diagonal[c] * r[c];
  }
  SbExactNodesAfter(&p->exact, p->r, z);
  PetscCall(VecGetArrayWrite(Z, &out));
  for (PetscInt i = 0; i < n; i++)
    out[i] = z[i] / p->scale;
  PetscCall(VecRestoreArrayWrite(Z, &out));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPreSolve_Rotated(PC pc, KSP ksp, Vec b, Vec x)
{
  Rotated *p;
  PetscReal norm;

  PetscFunctionBeginUser;
  (void)ksp;
  (void)x;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(VecNorm(b, NORM_INFINITY, &norm));
  p->scale = norm > 0. && !PetscIsInfOrNanReal(norm) ? 1. / norm : 1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Decides by the number of iterations whether the next operator is factored. */
static PetscErrorCode PCPostSolve_Rotated(PC pc, KSP ksp, Vec b, Vec x)
{
  KSPConvergedReason reason;
  PetscInt its;
  Rotated *p;

  PetscFunctionBeginUser;
  (void)b;
  (void)x;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (p->fresh < 0)
    p->fresh = its;
  else if (reason < 0 || its > WORSE_FACTOR * p->fresh + WORSE_PLUS)
    p->renew = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCView_Rotated(PC pc, PetscViewer viewer)
{
  PetscReal flops, entries, all, most;
  Rotated *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  if (!p->factor)
    PetscFunctionReturn(PETSC_SUCCESS);
  SbFactorCost(p->factor, &flops, &entries);

  /* an application reads the factor of the interior twice */
  all = most = 1e-6 * (PetscReal)(2 * SbFactorBytes(p->factor) +
                                  (PetscInt64)(sizeof(*p->interface->word) * p->interface->nword));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPIU_REAL, MPI_SUM, p->space->comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPIU_REAL, MPI_MAX, p->space->comm));
  PetscCall(PetscViewerASCIIPrintf(
    viewer,
    "  factor of a past operator turned with the nodes: %" PetscInt_FMT
    " factorisations, rank 0: %g million entries, %" PetscInt_FMT
    " nodes exact, interface of %" PetscInt_FMT
    " nodes; an application reads %g MB, at most %g of them on one rank\n",
    p->nfactor, 1e-6 * (double)entries, p->exact.n, p->interface->n, (double)all, (double)most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Rotated(PC pc)
{
  Rotated *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(SbInterfaceDestroy(&p->interface));
  PetscCall(SbFactorDestroy(&p->factor));
  PetscCall(SbExactNodesDestroy(&p->exact));
  PetscCall(PetscFree2(p->node, p->local));
  PetscCall(PetscFree2(p->ia, p->ja));
  PetscCall(PetscFree(p->cells));
  PetscCall(PetscFree5(p->rotation, p->rotation0, p->spread, p->Q, p->diagonal));
  PetscCall(PetscFree7(p->r, p->r1, p->z, p->b, p->x, p->kept, p->shared));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCRotatedCreate(SbSpace s, PC pc)
{
  PetscReal angle = 0.35;
  const char *prefix;
  Rotated *p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  p->space = s;
  p->renew = PETSC_TRUE;
  p->fresh = -1;
  p->scale = 1.;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscOptionsGetReal(NULL, prefix, "-pc_rotated_spread", &angle, NULL));
  p->limit = 8. * PetscSqr(PetscSinReal(0.5 * angle));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, p));
  PetscCall(PCShellSetName(pc, "rotated factor"));
  PetscCall(PCShellSetSetUp(pc, PCSetUp_Rotated));
  PetscCall(PCShellSetApply(pc, PCApply_Rotated));
  PetscCall(PCShellSetPreSolve(pc, PCPreSolve_Rotated));
  PetscCall(PCShellSetPostSolve(pc, PCPostSolve_Rotated));
  PetscCall(PCShellSetView(pc, PCView_Rotated));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_Rotated));
  PetscFunctionReturn(PETSC_SUCCESS);
}
