/*
  sbpc.h - layer 5: preconditioners, each made from a PC of PETSc.
*/
#pragma once
#include "sbfactor.h"

/* ---- two levels (two_level.c) */

/*
  SbPCTwoLevelCreate - makes pc a two-level preconditioner for CG: incomplete Cholesky on each rank,
  and a coarse space of some hundred aggregates of nodes with six rigid-body modes each, factored on
  one rank; on many ranks some thousand, with multigrid.

  Collective. The operator is a BAIJ or SBAIJ matrix of the space, symmetric; the space is borrowed.
  The aggregates are found at the first set-up, the coarse operator is renewed whenever the matrix
  has changed. Symmetric and positive definite when the operator is; an operator that is not fails
  the solve (KSP_DIVERGED_PC_FAILED). Where the incomplete factorisation breaks down, the diagonal
  takes its place with a warning. Options read: -pc_coarse_aggregates (0: by size),
  -pc_coarse_gathered (largest number of aggregates that one rank factors; -1: by size),
  -pc_coarse_pc_ and -pc_coarse_mg_ (multigrid), -fine_pc_ (fine level). Errors: PETSC_ERR_USER for
  a negative number.
*/
PetscErrorCode SbPCTwoLevelCreate(SbSpace space, PC pc);
/* Jacobi's method, which is exact there, in place of PETSc's algebraic multigrid where no unknown
   of the space is free: it fails without anything to coarsen. Collective. */
PetscErrorCode SbPCMultigridAvoid(SbSpace space, PC pc);

/* After a solve that ended with `reason`: the diagonal for the incomplete factorisation. changed:
   false for other preconditioners and failures, or when that is done already. Collective. */
PetscErrorCode SbPCTwoLevelSimplify(PC pc, KSPConvergedReason reason, PetscBool *changed);

/*
  SbPCPMultigridCreate - makes pc p-multigrid for CG: Gauss-Seidel on P2, P1 on the vertices below
  it.

  Collective. The operator is a BAIJ or SBAIJ matrix of the space, symmetric; the space is borrowed.
  The lower level is renewed whenever the matrix has changed. One that is not positive definite
  fails the solve. Options read: -pc_coarse_ (of the lower level). Errors: PETSC_ERR_USER for a
  space without P2 bodies.
*/
PetscErrorCode SbPCPMultigridCreate(SbSpace space, PC pc);

/* Bodies in contact: own rows of a symmetric matrix of 3x3 blocks on the nodes of a space. */
typedef struct {
  PetscInt n;       /* number of own nodes */
  PetscInt *ia;     /* [n+1] offsets of the rows */
  PetscInt *ja;     /* [ia[n]] global nodes, ascending in a row */
  PetscReal *value; /* [ia[n]][9] row-major, N/m */
  uint8_t *contact; /* [n] the node is in contact */
} SbContactRows;

/* Position of a column in row r, whose columns are ascending; -1: none. */
static inline PetscInt SbRowFind(const PetscInt ia[], const PetscInt ja[], PetscInt r,
                                 PetscInt column)
{
  PetscInt place;

  (void)PetscFindInt(column, ia[r + 1] - ia[r], ja + ia[r], &place);
  return place < 0 ? -1 : ia[r] + place;
}

/*
  SbPCContactCreate - makes pc a preconditioner for CG: Chebyshev with the diagonal blocks, or
  Gauss-Seidel for P2 bodies that are not too large, and an exactly solved coarse space: nodes in
  contact, and rigid-body modes of aggregates of the others or the vertices of P2.

  Collective; space and rows are borrowed. The operator of pc is a matrix with these rows and the
  fast product, another matrix when their pattern or the nodes in contact have changed. Output: the
  solver of the coarse space, borrowed.
*/
PetscErrorCode SbPCContactCreate(SbSpace space, const SbContactRows *rows, PC pc,
                                 SbBlockSolver *coarse);

/* ---- pressures of cells as unknowns (pressure.c) */

/*
  SbPressureOperatorCreate - the tangent of CR or DG with its volumetric part stored separately, for
  nu near 1/2.

  Collective, after SbSpacePrescribeDone(). K is a MATSHELL owned by the caller; the space is
  borrowed. It is filled by SbSpaceAssembleTangent() and SbSpaceFinishTangent() as a matrix is, and
  effects may add to it. Errors: PETSC_ERR_USER for a space without face nodes.
*/
PetscErrorCode SbPressureOperatorCreate(SbSpace space, Mat *K);

/*
  SbPCPressureCreate - makes pc the solver for a SbPressureOperator: GMRES for displacements and
  pressures. Use it in KSPRICHARDSON with the unpreconditioned norm, which refines until -ksp_rtol
  holds for the true residual, or the residual is one of rounding.

  Collective. The space is borrowed. -ksp_max_it limits the iterations of GMRES, and they are what
  the KSP reports. A residual that two corrections no longer halve fails the solve
  (KSP_DIVERGED_BREAKDOWN). Options read: -pressure_ksp_ (GMRES), -pressure_coarse_ (P1).
*/
PetscErrorCode SbPCPressureCreate(SbSpace space, PC pc);

/* ---- a factorisation that rotates with the nodes (rotated.c) */

/*
  SbPCRotatedCreate - makes pc a preconditioner with a reused factorisation: P = Q A0 Q^T, A0 a past
  operator, Q the nodes' rotations since.

  Collective. The operator is a matrix-free operator, or an assembled matrix of the space on which
  the displacement belonging to it is composed as "sb_state" (PetscObjectCompose() with a vector of
  SbSpaceCreateVec()). One factorisation lasts as long as the iterations stay low; it is renewed at
  the next change of the operator when they do not, or when the solver fails.
  Options read: -pc_rotated_spread (rad), the angle between a cell's and its node's rotation above
  which the node is solved exactly. Memory: besides the factor 72 n^2 bytes on each rank during a
  factorisation, with n of SbSpaceInterfaceSize(); 9 n^2 of all ranks together stay. An operator
  that is not positive definite fails the solve.
*/
PetscErrorCode SbPCRotatedCreate(SbSpace space, PC pc);

/* The context of a PCSHELL with this name, NULL for any other pc. Not collective. */
PetscErrorCode SbPCShellFind(PC pc, const char *name, void *context);
