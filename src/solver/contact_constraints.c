/*
  contact_constraints.c - linear systems of bodies in contact with constraints between their nodes,
  for the responses `projected` and `multiplier`.

  A step Y back from an iterate with the gaps g beyond those that are kept, C being their
  derivative:

    M Y + C^T l = F,   C Y - D l = g

  M is the tangent with the geometric stiffness of contact and soft springs, so that it is regular
  where only contact supports a body. D, small, is the flexibility of constraints in the method of
  multipliers (src/contact/multipliers.c): it makes the system regular where rows depend on each
  other, as those of surfaces that lie flat on each other do: there the vertices of both sides and
  the crossings of their edges have rows. Rows of C have unit length.

  `projected`: conjugate gradients in the null space of the constraints (Gould, Hribar and Nocedal,
  On the solution of equality constrained quadratic programming problems arising in optimization,
  SIAM J. Sci. Comput. 23, 2001). With the further unknowns s = D l / sqrt(e) the constraints are
  exact, A (Y, s) = g with A = [C, -sqrt(e) I], and

    P = I - A^T (C C^T + e I)^-1 A

  projects onto their null space, whatever the rank of C. C C^T + e I is factored once per system. A
  KSP has the operator P K P, K = diag(M, e / D), and the preconditioner P N P, N that of
  contact_system.c, or a factorisation, of M.

  `multiplier`: the forces l are unknowns, in a MatNest, by FGMRES with PCFIELDSPLIT: N for M, and D
  and the flexibility of the soft springs for its Schur complement.
*/
#include "sbfactor.h"
#include "solver_impl.h"

#define GIVE 1e-2      /* e */
#define TOLERANCE 1e-8 /* relative, of the preconditioned residual */
#define MOST 2000      /* iterations */
#define RESTART 100    /* of FGMRES */

typedef struct {
  Mat M, C, Ct;      /* M borrowed; C with rows of unit length */
  PC inner;          /* N, borrowed */
  PetscReal *length; /* [rows] of the rows before */
  Vec flexible;      /* D of rows of unit length, m/N */

  /* projected */
  PC gram;    /* (C C^T + e I)^-1 */
  Vec row[3]; /* work */
  Vec x[2];   /* work, of bodies */
} Constrained;

PetscErrorCode SbConstraintRowsReserve(SbConstraintRows *rows, PetscInt n, PetscInt nentry)
{
  const PetscInt most = rows->n + n;

  PetscFunctionBeginUser;
  if (most > rows->size) {
    rows->size = PetscMax(most, 2 * rows->size);
    PetscCall(PetscRealloc(sizeof(PetscInt) * (size_t)(rows->size + 1), &rows->start));
    PetscCall(PetscRealloc(sizeof(PetscReal) * (size_t)rows->size, &rows->goal));
    PetscCall(PetscRealloc(sizeof(PetscReal) * (size_t)rows->size, &rows->stiffness));
    PetscCall(PetscRealloc(sizeof(PetscReal) * (size_t)rows->size, &rows->soft));
    rows->start[0] = 0;
  }
  if (rows->nentry + nentry > rows->entry_size) {
    rows->entry_size = PetscMax(rows->nentry + nentry, 2 * rows->entry_size);
    PetscCall(PetscRealloc(sizeof(PetscInt) * (size_t)rows->entry_size, &rows->column));
    PetscCall(PetscRealloc(sizeof(PetscReal) * (size_t)rows->entry_size, &rows->value));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintRowsFree(SbConstraintRows *rows)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(rows->start));
  PetscCall(PetscFree(rows->goal));
  PetscCall(PetscFree(rows->stiffness));
  PetscCall(PetscFree(rows->soft));
  PetscCall(PetscFree(rows->column));
  PetscCall(PetscFree(rows->value));
  *rows = (SbConstraintRows){0};
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintRowsMatrix(const SbConstraintRows *rows, MPI_Comm comm, PetscInt columns,
                                      PetscReal length[], Mat *to)
{
  PetscInt *nonzero, *column;
  PetscReal *value;
  PetscInt first;
  Mat C;
  PetscInt longest = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(rows->n, &nonzero));
  for (PetscInt r = 0; r < rows->n; r++) {
    nonzero[r] = rows->start[r + 1] - rows->start[r];
    longest = PetscMax(longest, nonzero[r]);
  }
  PetscCall(MatCreate(comm, &C));
  PetscCall(MatSetSizes(C, rows->n, columns, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(C, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(C, 0, nonzero));
  PetscCall(MatMPIAIJSetPreallocation(C, 0, nonzero, 0, nonzero));
  PetscCall(MatSetOption(C, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatGetOwnershipRange(C, &first, NULL));

  /* the entries of a row by column, each column once */
  PetscCall(PetscMalloc2(longest, &column, longest, &value));
  for (PetscInt r = 0; r < rows->n; r++) {
    const PetscInt row = first + r;
    PetscReal square = 0.;
    PetscInt n = 0;

    PetscCall(PetscArraycpy(column, rows->column + rows->start[r], nonzero[r]));
    PetscCall(PetscArraycpy(value, rows->value + rows->start[r], nonzero[r]));
    PetscCall(PetscSortIntWithScalarArray(nonzero[r], column, value));
    for (PetscInt k = 0; k < nonzero[r]; k++) {
      if (n && column[n - 1] == column[k])
        value[n - 1] += value[k];
      else {
        column[n] = column[k];
        value[n++] = value[k];
      }
    }
    for (PetscInt k = 0; k < n; k++)
      square += value[k] * value[k];
    length[r] = square > 0. ? PetscSqrtReal(square) : 1.;
    for (PetscInt k = 0; k < n; k++)
      value[k] /= length[r];
    PetscCall(MatSetValues(C, 1, &row, n, column, value, INSERT_VALUES));
  }
  PetscCall(PetscFree2(column, value));
  PetscCall(MatAssemblyBegin(C, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(C, MAT_FINAL_ASSEMBLY));
  PetscCall(PetscFree(nonzero));
  *to = C;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* C with rows of unit length, and its transpose. */
static PetscErrorCode create_rows(const SbConstraintRows *rows, Constrained *c)
{
  PetscInt columns;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(rows->n, &c->length));
  PetscCall(MatGetLocalSize(c->M, NULL, &columns));
  PetscCall(
    SbConstraintRowsMatrix(rows, PetscObjectComm((PetscObject)c->M), columns, c->length, &c->C));
  PetscCall(MatTranspose(c->C, MAT_INITIAL_MATRIX, &c->Ct));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (C C^T + e I)^-1. */
static PetscErrorCode factor_gram(Constrained *c)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)c->M);
  const char *package;
  PetscInt rows;
  Mat G;

  PetscFunctionBeginUser;
  PetscCall(MatMatMult(c->C, c->Ct, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &G));
  PetscCall(MatShift(G, GIVE));
  PetscCall(MatSetOption(G, MAT_SPD, PETSC_TRUE));
  PetscCall(MatGetSize(G, &rows, NULL));
  PetscCall(SbDirectPackage(comm, rows, PETSC_TRUE, &package));
  PetscCall(PCCreate(comm, &c->gram));
  PetscCall(PCSetOptionsPrefix(c->gram, "gram_"));
  PetscCall(PCSetOperators(c->gram, G, G));
  if (package)
    PetscCall(SbPCDirectSet(c->gram, package, PETSC_TRUE));
  else
    PetscCall(PCSetType(c->gram, PCREDUNDANT));
  PetscCall(PCSetFromOptions(c->gram));
  if (package)
    PetscCall(SbPCCheckPivots(c->gram));
  PetscCall(PCSetUp(c->gram));
  PetscCall(MatDestroy(&G));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies between a vector of all unknowns, those of bodies before those of rows on each rank, and
   its two parts. */
static PetscErrorCode split(Vec all, Vec bodies, Vec rows)
{
  const PetscScalar *from;
  PetscScalar *to[2];
  PetscInt n[2];

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(bodies, &n[0]));
  PetscCall(VecGetLocalSize(rows, &n[1]));
  PetscCall(VecGetArrayRead(all, &from));
  PetscCall(VecGetArray(bodies, &to[0]));
  PetscCall(VecGetArray(rows, &to[1]));
  PetscCall(PetscArraycpy(to[0], from, n[0]));
  PetscCall(PetscArraycpy(to[1], from + n[0], n[1]));
  PetscCall(VecRestoreArray(rows, &to[1]));
  PetscCall(VecRestoreArray(bodies, &to[0]));
  PetscCall(VecRestoreArrayRead(all, &from));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode join(Vec bodies, Vec rows, Vec all)
{
  const PetscScalar *from[2];
  PetscScalar *to;
  PetscInt n[2];

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(bodies, &n[0]));
  PetscCall(VecGetLocalSize(rows, &n[1]));
  PetscCall(VecGetArray(all, &to));
  PetscCall(VecGetArrayRead(bodies, &from[0]));
  PetscCall(VecGetArrayRead(rows, &from[1]));
  PetscCall(PetscArraycpy(to, from[0], n[0]));
  PetscCall(PetscArraycpy(to + n[0], from[1], n[1]));
  PetscCall(VecRestoreArrayRead(rows, &from[1]));
  PetscCall(VecRestoreArrayRead(bodies, &from[0]));
  PetscCall(VecRestoreArray(all, &to));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (Y, s) <- P (Y, s), with its log event. */
static PetscErrorCode project(Constrained *c, Vec Y, Vec s)
{
  const PetscReal root = PetscSqrtReal(GIVE);

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscCall(MatMult(c->C, Y, c->row[1]));
  PetscCall(VecAXPY(c->row[1], -root, s));
  PetscCall(PCApply(c->gram, c->row[1], c->row[2]));
  PetscCall(VecAXPY(s, root, c->row[2]));
  PetscCall(VecScale(c->row[2], -1.));
  PetscCall(MatMultAdd(c->Ct, c->row[2], Y, Y));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_PROJECT], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y = P K x. */
static PetscErrorCode multiply(Mat A, Vec x, Vec y)
{
  Constrained *c;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(A, &c));
  PetscCall(split(x, c->x[0], c->row[0]));
  PetscCall(MatMult(c->M, c->x[0], c->x[1]));
  PetscCall(VecPointwiseDivide(c->row[0], c->row[0], c->flexible));
  PetscCall(VecScale(c->row[0], GIVE));
  PetscCall(project(c, c->x[1], c->row[0]));
  PetscCall(join(c->x[1], c->row[0], y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = P diag(N, D / e) P r. */
static PetscErrorCode apply_projected(PC pc, Vec r, Vec z)
{
  Constrained *c;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &c));
  PetscCall(split(r, c->x[0], c->row[0]));
  PetscCall(project(c, c->x[0], c->row[0]));
  PetscCall(PCApply(c->inner, c->x[0], c->x[1]));
  PetscCall(VecPointwiseMult(c->row[0], c->row[0], c->flexible));
  PetscCall(VecScale(c->row[0], 1. / GIVE));
  PetscCall(project(c, c->x[1], c->row[0]));
  PetscCall(join(c->x[1], c->row[0], z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode solve_projected(Constrained *c, Vec F, Vec g, Vec Y,
                                      KSPConvergedReason *reason, PetscInt *iterations)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)F);
  PetscInt n, rows;
  Vec s, r, z;
  Mat A;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(factor_gram(c));
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetLocalSize(g, &rows));
  PetscCall(VecCreateMPI(comm, n + rows, PETSC_DETERMINE, &r));
  PetscCall(VecDuplicate(r, &z));
  PetscCall(VecDuplicate(g, &s));
  for (int k = 0; k < 3; k++)
    PetscCall(VecDuplicate(g, &c->row[k]));
  for (int k = 0; k < 2; k++)
    PetscCall(VecDuplicate(F, &c->x[k]));

  PetscCall(MatCreateShell(comm, n + rows, n + rows, PETSC_DETERMINE, PETSC_DETERMINE, c, &A));
  PetscCall(MatShellSetOperation(A, MATOP_MULT, SB_OPERATION(multiply)));
  PetscCall(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(KSPCreate(comm, &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "constraint_"));
  PetscCall(KSPSetType(ksp, KSPCG));
  PetscCall(KSPSetTolerances(ksp, TOLERANCE, PETSC_DEFAULT, 1e10, MOST));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, c));
  PetscCall(PCShellSetApply(pc, apply_projected));
  PetscCall(PCShellSetName(pc, "null space of contact"));
  PetscCall(KSPSetFromOptions(ksp));

  /* from the shortest (Y, s) that satisfies the constraints */
  PetscCall(PCApply(c->gram, g, s));
  PetscCall(MatMult(c->Ct, s, Y));
  PetscCall(VecScale(s, -PetscSqrtReal(GIVE)));
  PetscCall(MatMult(c->M, Y, c->x[0]));
  PetscCall(VecAYPX(c->x[0], -1., F));
  PetscCall(VecPointwiseDivide(c->row[0], s, c->flexible));
  PetscCall(VecScale(c->row[0], -GIVE));
  PetscCall(project(c, c->x[0], c->row[0]));
  PetscCall(join(c->x[0], c->row[0], r));
  PetscCall(KSPSolve(ksp, r, z));
  PetscCall(KSPGetConvergedReason(ksp, reason));
  PetscCall(KSPGetIterationNumber(ksp, iterations));
  PetscCall(split(z, c->x[0], c->row[0]));
  PetscCall(project(c, c->x[0], c->row[0]));
  PetscCall(VecAXPY(Y, 1., c->x[0]));

  for (int k = 0; k < 3; k++)
    PetscCall(VecDestroy(&c->row[k]));
  for (int k = 0; k < 2; k++)
    PetscCall(VecDestroy(&c->x[k]));
  PetscCall(VecDestroy(&s));
  PetscCall(VecDestroy(&r));
  PetscCall(VecDestroy(&z));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscCall(PCDestroy(&c->gram));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = N r. */
static PetscErrorCode apply_inner(PC pc, Vec r, Vec z)
{
  Constrained *c;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &c));
  PetscCall(PCApply(c->inner, r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A diagonal matrix, `factor` times d. */
static PetscErrorCode create_diagonal(Vec d, PetscReal factor, Mat *D)
{
  PetscInt n, first;
  const PetscReal *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetOwnershipRange(d, &first, NULL));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)d), D));
  PetscCall(MatSetSizes(*D, n, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*D, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*D, 1, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*D, 1, NULL, 0, NULL));
  PetscCall(VecGetArrayRead(d, &a));
  for (PetscInt k = first; k < first + n; k++)
    PetscCall(MatSetValue(*D, k, k, factor * a[k - first], INSERT_VALUES));
  PetscCall(VecRestoreArrayRead(d, &a));
  PetscCall(MatAssemblyBegin(*D, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*D, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* soft: flexibility of the springs in M and D together, m/N. The rows and their forces are scaled
   by the mean stiffness k, so that all residuals are forces: [M k C^T; k C -k^2 D] (Y, l / k). */
static PetscErrorCode solve_saddle(Constrained *c, Vec F, Vec g, Vec soft, Vec Y,
                                   KSPConvergedReason *reason, PetscInt *iterations)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)F);
  Mat A, block[4], schur;
  Vec rhs, x, part[2];
  KSP ksp, *sub;
  PetscScalar sum;
  PetscReal k;
  PetscInt n;
  IS is[2];
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(VecGetSize(soft, &n));
  PetscCall(VecSum(soft, &sum));
  k = n / PetscRealPart(sum);
  PetscCall(create_diagonal(soft, -k * k, &schur));
  PetscCall(create_diagonal(c->flexible, -k * k, &block[3]));
  PetscCall(MatScale(c->C, k));
  PetscCall(MatScale(c->Ct, k));
  block[0] = c->M;
  block[1] = c->Ct;
  block[2] = c->C;
  PetscCall(MatCreateNest(comm, 2, NULL, 2, NULL, block, &A));
  PetscCall(MatNestSetVecType(A, VECNEST));
  PetscCall(MatNestGetISs(A, is, NULL));
  PetscCall(MatCreateVecs(A, &x, &rhs));
  PetscCall(VecNestGetSubVec(rhs, 0, &part[0]));
  PetscCall(VecNestGetSubVec(rhs, 1, &part[1]));
  PetscCall(VecCopy(F, part[0]));
  PetscCall(VecAXPBY(part[1], k, 0., g));

  PetscCall(KSPCreate(comm, &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "constraint_"));
  PetscCall(KSPSetType(ksp, KSPFGMRES));
  PetscCall(KSPGMRESSetRestart(ksp, RESTART));
  PetscCall(KSPSetTolerances(ksp, TOLERANCE, PETSC_DEFAULT, 1e10, MOST));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCFIELDSPLIT));
  PetscCall(PCFieldSplitSetIS(pc, "bodies", is[0]));
  PetscCall(PCFieldSplitSetIS(pc, "forces", is[1]));
  PetscCall(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));
  PetscCall(PCFieldSplitSetSchurFactType(pc, PC_FIELDSPLIT_SCHUR_FACT_FULL));
  PetscCall(PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_USER, schur));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCFieldSplitSchurGetSubKSP(pc, &n, &sub));
  for (int i = 0; i < 2; i++) {
    PetscCall(KSPSetType(sub[i], KSPPREONLY));
    PetscCall(KSPGetPC(sub[i], &pc));
    PetscCall(PCSetType(pc, i ? PCJACOBI : PCSHELL));
    if (i)
      continue;
    PetscCall(PCShellSetContext(pc, c));
    PetscCall(PCShellSetApply(pc, apply_inner));
  }
  PetscCall(PetscFree(sub));
  PetscCall(KSPSolve(ksp, rhs, x));
  PetscCall(KSPGetConvergedReason(ksp, reason));
  PetscCall(KSPGetIterationNumber(ksp, iterations));
  PetscCall(VecNestGetSubVec(x, 0, &part[0]));
  PetscCall(VecCopy(part[0], Y));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&rhs));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&schur));
  PetscCall(MatDestroy(&block[3]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A vector over the rows: values[n], times `factor` and a power of the rows' length. */
static PetscErrorCode create_vector(const Constrained *c, PetscInt n, const PetscReal value[],
                                    PetscReal factor, PetscReal power, Vec *v)
{
  PetscReal *a;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(c->C, NULL, v));
  PetscCall(VecGetArray(*v, &a));
  for (PetscInt r = 0; r < n; r++)
    a[r] = factor * value[r] * PetscPowReal(c->length[r], power);
  PetscCall(VecRestoreArray(*v, &a));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolveConstrained(Mat M, PC inner, PetscBool saddle, const SbConstraintRows *rows,
                                  PetscReal weight, Vec F, Vec Y, KSPConvergedReason *reason,
                                  PetscInt *iterations)
{
  Constrained c = {.M = M, .inner = inner};
  Vec g, soft, right;

  PetscFunctionBeginUser;
  PetscCall(create_rows(rows, &c));
  PetscCall(create_vector(&c, rows->n, rows->goal, 1., -1., &g));
  PetscCall(create_vector(&c, rows->n, rows->stiffness, weight, 2., &c.flexible));
  PetscCall(create_vector(&c, rows->n, rows->soft, weight, 2., &soft));

  /* F has the forces of the stiff springs at the gaps g */
  PetscCall(VecDuplicate(F, &right));
  PetscCall(VecPointwiseMult(c.flexible, c.flexible, g));
  PetscCall(VecScale(c.flexible, -1.));
  PetscCall(MatMultAdd(c.Ct, c.flexible, F, right));
  PetscCall(VecDestroy(&c.flexible));
  PetscCall(create_vector(&c, rows->n, rows->stiffness, weight, 2., &c.flexible));
  PetscCall(VecReciprocal(c.flexible));
  PetscCall(VecReciprocal(soft));
  PetscCall(VecAXPY(soft, 1., c.flexible));
  if (saddle)
    PetscCall(solve_saddle(&c, right, g, soft, Y, reason, iterations));
  else
    PetscCall(solve_projected(&c, right, g, Y, reason, iterations));
  PetscCall(VecDestroy(&right));
  PetscCall(VecDestroy(&g));
  PetscCall(VecDestroy(&soft));
  PetscCall(VecDestroy(&c.flexible));
  PetscCall(MatDestroy(&c.C));
  PetscCall(MatDestroy(&c.Ct));
  PetscCall(PetscFree(c.length));
  PetscFunctionReturn(PETSC_SUCCESS);
}
