/*
  sbsolver.h - layer 4: linear solvers by name, and the choice of one by problem and rank count.
*/
#pragma once
#include "sbconstraint.h"

/* A row of the solver table: a matrix type and default PETSc options. */
typedef struct _SbSolverPreset {
  const char *name;
  SbMatrixKind matrix;   /* on several ranks SBAIJ becomes BAIJ */
  const char *options;   /* "-ksp_type cg -pc_type gamg ..." */
  const char *package;   /* of PETSc's that the row needs; NULL: none */
  PetscBool direct;      /* a factorisation by that package */
  PetscBool matrix_free; /* a matrix-free operator instead of the matrix */
  PetscErrorCode (*create)(SbSpace space, Mat *K); /* an operator of our own; NULL: the matrix */
  PetscErrorCode (*precondition)(SbSpace space, PC pc); /* one of our own; NULL: by the options */
  PetscBool by_type;                                    /* the name is a -pc_type of the user */
} SbSolverPreset;

extern const SbOption SbSolverRows[];
/* Reads -solver: "auto" or a name of the table. */
PetscErrorCode SbSolverSetFromOptions(char choice[], size_t size);
/* The preset for `choice`; with "auto" by number of unknowns, ranks and law; with -pc_type, a row
   whose matrix type it supports. The reason in words. Collective. */
PetscErrorCode SbSolverChoose(SbSpace space, PetscBool dynamic, PetscBool linear,
                              PetscBool explicit_run, const char *choice,
                              const SbSolverPreset **preset, char reason[], size_t size);
/* Names a factorisation for matrices that may be indefinite when `choice` is auto. Not collective.
   Errors: PETSC_ERR_USER where this PETSc has none for this number of ranks. */
PetscErrorCode SbSolverChooseIndefinite(MPI_Comm comm, size_t size, char choice[]);
/*
  SbSolverCountNegativeEigenvalues - eigenvalues below zero of the matrix that `snes` has factored
  last, in the null space of its contact constraints; -1: the solver does not count them.
  Collective.
*/
PetscErrorCode SbSolverCountNegativeEigenvalues(SNES snes, SbSpace space, PetscInt *negative);
/*
  SbSolverNextFallback - the next solver after one that failed: a factorisation, for large systems
  iterations.

  Collective. Input: reason - why it failed; memory - for want of memory. In and out: tried, bits of
  the rows that failed in this run; preset, the one that failed, then the next one that this PETSc
  has and that can solve for the space, NULL when there is none.
*/
PetscErrorCode SbSolverNextFallback(SbSpace space, KSPConvergedReason reason, PetscBool memory,
                                    uint32_t *tried, const SbSolverPreset **preset);
/* Adds options, such as "-key value", with a prefix to PETSc's database unless the user set them,
   or (clear) removes those whose values are still the same. -ksp_type and -pc_type are skipped:
   they are set by calls, so that types in the database are always the user's. Not collective. */
PetscErrorCode SbSolverSetDefaults(const char *prefix, const char *options, PetscBool clear);
/* Gives the solver of `snes` the preset's options and tolerances; before SNESSetFromOptions().
   Collective. */
PetscErrorCode SbSolverSetUp(SNES snes, SbSpace space, const SbSolverPreset *preset);
/* Replaces a method for symmetric systems by FGMRES while nodes in contact slide with friction, and
   restores it after. Collective; before each solve. */
PetscErrorCode SbSolverUpdateSymmetry(KSP ksp, SbSpace space);
/* M of such a pc, else pc itself. Not collective. */
PetscErrorCode SbPCConstrainedGetInner(PC pc, PC *inner);
/*
  SbSaddleChoose - how the saddle-point system of constraints is solved: `choice` 0 by size, 1
  directly, 2 by iterations, with the reason in words. Collective. Errors: PETSC_ERR_USER for 1
  without a package.
*/
PetscErrorCode SbSaddleChoose(SbSpace space, PetscBool dynamic, PetscInt choice, SbSaddle *saddle,
                              char reason[], size_t size);
#define SB_DIRECT_SMALL \
  30000 /* largest number of unknowns for which auto lets one rank factor for all */
/*
  SbDirectPackage - the fastest factorisation package of this PETSc for a symmetric matrix of this
  many unknowns on the ranks of comm: one of PETSc's MATSOLVER names, NULL without any; with
  -reproducible one that works on one rank. Indefinite matrices need other packages than positive
  definite ones. Not collective.
*/
PetscErrorCode SbDirectPackage(MPI_Comm comm, PetscInt unknowns, PetscBool definite,
                               const char **package);
/*
  SbPCDirectSet - makes pc a factorisation by `package` (MUMPS, CHOLMOD or UMFPACK) of an AIJ
  matrix, gathered on one rank where there are several and the package works on one (PCTELESCOPE).

  Not collective. PCSetFromOptions() and SbPCCheckPivots() have to follow. Input: symmetric, L L^T
  or L D L^T where the package has it, else LU. Options read: those of PETSc's PCCHOLESKY or PCLU,
  with the prefix telescope_ where the matrix is gathered.
*/
PetscErrorCode SbPCDirectSet(PC pc, const char *package, PetscBool symmetric);
/* Makes non-positive pivots of a Cholesky factorisation, also a gathered one, fail the solve
   (KSP_DIVERGED_PC_FAILED). After PCSetFromOptions(). Not collective. */
PetscErrorCode SbPCCheckPivots(PC pc);
/*
  SbSolverFinish - the last set-up of the solver of `snes` after SNESSetFromOptions().

  Collective. P: the matrix of the preconditioner; NULL without linear systems. Errors:
  PETSC_ERR_USER, in one line that says what to choose, for a -ksp_type, -pc_type, norm, side or
  package that cannot work here.
*/
PetscErrorCode SbSolverFinish(SNES snes, SbSpace space, const SbSolverPreset *preset, Mat P);
/* "cg, cholesky of mumps": what the solver of `snes` is now. Not collective. */
PetscErrorCode SbSolverDescribe(SNES snes, SbSpace space, size_t size, char text[]);
/* The operator that the preset works on. Collective; caller destroys. */
PetscErrorCode SbSolverCreateOperator(SbSpace space, const SbSolverPreset *preset, Mat *A);

/*
  SbPCCoarseCreate - makes pc a two-level preconditioner for CG: incomplete Cholesky on each rank,
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
PetscErrorCode SbPCCoarseCreate(SbSpace space, PC pc);
/* After a solve that ended with `reason`: the diagonal for the incomplete factorisation. changed:
   false for other preconditioners and failures, or when that is done already. Collective. */
PetscErrorCode SbPCCoarseFallBack(PC pc, KSPConvergedReason reason, PetscBool *changed);

/*
  SbPCPMultigridCreate - makes pc p-multigrid for CG: Gauss-Seidel on P2, P1 on the vertices below
  it.

  Collective. The operator is a BAIJ or SBAIJ matrix of the space, symmetric; the space is borrowed.
  The lower level is renewed whenever the matrix has changed. One that is not positive definite
  fails the solve. Options read: -pc_coarse_ (of the lower level). Errors: PETSC_ERR_USER for a
  space without P2 bodies.
*/
PetscErrorCode SbPCPMultigridCreate(SbSpace space, PC pc);

/*
  SbPressureOperatorCreate - the tangent of CR or DG with its volumetric part stored separately, for
  nu near 1/2.

  Collective, after SbSpacePrescribeDone(). K is a MATSHELL owned by the caller; the space is
  borrowed. It is filled by SbSpaceAssembleTangent() and SbSpaceFinishTangent() as a matrix is, and
  effects may add to it. Errors: PETSC_ERR_USER for a space without face nodes.
*/
PetscErrorCode SbPressureOperatorCreate(SbSpace space, Mat *K);

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
/*
  SbSpaceInterfaceSize - number n of interface nodes between ranks, and the largest for -solver
  rotated.

  Collective. Makes the plan of the space. Options read: -pc_rotated_interface (1500).
*/
PetscErrorCode SbSpaceInterfaceSize(SbSpace space, PetscInt *n, PetscInt *most);

/* The operator of solves: `whole`, the complete tangent, plus springs, projected onto the
   constraints. singular: K may be, if only constraints support some body: it is regularised for
   preconditioners, not for the operator; SB_SADDLE_DIRECT needs none of that. Collective; the
   caller destroys it; K and `whole` are borrowed until then. */
PetscErrorCode SbConstraintsCreateOperator(SbSpace space, Mat K, Mat whole, PetscBool singular,
                                           SbSaddle saddle, Mat *A);

/* tangent and contact blocks */

typedef struct {
  PetscInt v[2];  /* row and column */
  PetscReal H[9]; /* row-major, N/m */
} SbBlock;
/* Rows of owned nodes, by local numbers, columns of any nodes, by global ones, best in row order;
   start with {0}, PetscFree() the blocks. Duplicates are summed. */
typedef struct {
  PetscInt n, size;
  SbBlock *block; /* [n] */
} SbBlocks;
/* Hessian of the contact energy in Newton's method: exact; each pair projected to positive
   semi-definite; the same with friction majorized by quadratics, as its energy has a kink where
   slip reverses. */
typedef enum {
  SB_HESSIAN_EXACT,
  SB_HESSIAN_PROJECTED,
  SB_HESSIAN_MAJORIZED
} SbContactHessian;
typedef struct _p_SbContactSystem *SbContactSystem;
/* choice: 0 by cost, 1 factored, 2 by iterations. Not collective. Options read: those of
   contact_system.c. */
PetscErrorCode SbContactSystemCreate(SbSpace space, PetscInt choice, SbContactSystem *system);
/* In words, how such systems are solved. Not collective. */
PetscErrorCode SbContactSystemDescribe(PetscInt choice, char text[], size_t size);
PetscErrorCode SbContactSystemDestroy(SbContactSystem *system);
/*
  SbContactSystemSolve - Y = (K + blocks)^-1 F. The sparsity of the blocks may change with each
  call.

  Collective. Input: K, the tangent of the space, prescribed unknowns replaced; blocks, symmetric
  when those of all ranks are taken together, none for prescribed unknowns; fresh, K or blocks have
  changed since the last call. Output: reason, negative where the matrix is not positive definite;
  iterations.
*/
PetscErrorCode SbContactSystemSolve(SbContactSystem system, Mat K, const SbBlocks *blocks,
                                    PetscBool fresh, Vec F, Vec Y, KSPConvergedReason *reason,
                                    PetscInt *iterations);
