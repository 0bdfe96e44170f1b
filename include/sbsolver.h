/*
  sbsolver.h - layer 6: linear solvers by name, and the choice of one by problem and rank count.
*/
#pragma once
#include "sbfem.h"

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

/* ---- which solver (preset.c, choice.c) */

/* Reads -solver: "auto", "direct" or a name of the table. */
PetscErrorCode SbSolverSetFromOptions(char choice[], size_t size);

/* What a run solves, and the value of -solver. */
typedef struct {
  PetscBool dynamic, linear;
  PetscBool explicit_run; /* nothing is solved */
  const char *choice;     /* "auto", "direct" or a name of the table */
} SbSolverProblem;

/*
  SbSolverChoose - the row for the problem's choice; with "auto" by the number of unknowns, ranks,
  elements and laws.

  Collective. Output: reason, in words; preset. Options read: -pc_type and
  -pc_factor_mat_solver_type, which take the place of `choice`; -ksp_type. Errors: PETSC_ERR_USER
  for a row that needs a package which this PETSc has not.
*/
PetscErrorCode SbSolverChoose(SbSpace space, const SbSolverProblem *problem, size_t size,
                              char reason[], const SbSolverPreset **preset);

/* Names a factorisation for matrices that may be indefinite when `choice` is auto. Not collective.
   Errors: PETSC_ERR_USER where this PETSc has none for this number of ranks. */
PetscErrorCode SbSolverChooseIndefinite(MPI_Comm comm, size_t size, char choice[]);

/*
  SbSolverNextFallback - the next solver after one that failed: a factorisation, for large systems
  iterations.

  Collective. Input: reason - why it failed; memory - for want of memory. In and out: tried, bits of
  the rows that failed in this run; preset, the one that failed, then the next one that this PETSc
  has and that can solve for the space, NULL when there is none.
*/
PetscErrorCode SbSolverNextFallback(SbSpace space, KSPConvergedReason reason, PetscBool memory,
                                    uint32_t *tried, const SbSolverPreset **preset);

/*
  SbSaddleChoose - how the saddle-point system of constraints is solved: `choice` 0 by size, 1
  directly, 2 by iterations, with the reason in words. Collective. Errors: PETSC_ERR_USER for 1
  without a package.
*/
PetscErrorCode SbSaddleChoose(SbSpace space, PetscBool dynamic, PetscInt choice, SbSaddle *saddle,
                              char reason[], size_t size);

/* ---- from a row of the table to a KSP that is set up (solver.c) */

/* The operator that the preset works on. Collective; caller destroys. */
PetscErrorCode SbSolverCreateOperator(SbSpace space, const SbSolverPreset *preset, Mat *A);

/* Gives the solver of `snes` the preset's options and tolerances; before SNESSetFromOptions().
   Collective. */
PetscErrorCode SbSolverSetUp(SNES snes, SbSpace space, const SbSolverPreset *preset);

/* Replaces a method for symmetric systems by FGMRES while nodes in contact slide with friction, and
   restores it after. Collective; before each solve. */
PetscErrorCode SbSolverUpdateSymmetry(KSP ksp, SbSpace space);

/*
  SbSolverFinish - the last set-up of the solver of `snes` after SNESSetFromOptions().

  Collective. P: the matrix of the preconditioner; NULL without linear systems. Errors:
  PETSC_ERR_USER, in one line that says what to choose, for a -ksp_type, -pc_type, norm, side or
  package that cannot work here.
*/
PetscErrorCode SbSolverFinish(SNES snes, SbSpace space, const SbSolverPreset *preset, Mat P);

/* "cg, cholesky of mumps": what the solver of `snes` is now. Not collective. */
PetscErrorCode SbSolverDescribe(SNES snes, SbSpace space, size_t size, char text[]);

/*
  SbSolverCountNegativeEigenvalues - eigenvalues below zero of the matrix that `snes` has factored
  last, in the null space of its contact constraints; -1: the solver does not count them.
  Collective.
*/
PetscErrorCode SbSolverCountNegativeEigenvalues(SNES snes, SbSpace space, PetscInt *negative);

/* ---- negative eigenvalues of a symmetric matrix K (negative_modes.c) */

/*
  K and a symmetric positive definite M, the nearer to K the better; both in the subspace that the
  right-hand sides of `start` are in. All operations are collective.

    multiply - y = K x
    solve    - z = M^-1 r
    start    - a right-hand side with a part along every mode, another one for each k = 0, 1, ...
*/
typedef struct {
  PetscErrorCode (*multiply)(void *ctx, Vec x, Vec y);
  PetscErrorCode (*solve)(void *ctx, Vec r, Vec z);
  PetscErrorCode (*start)(void *ctx, PetscInt k, Vec r);
  void *ctx; /* of all; borrowed */
} SbPencil;

typedef struct {
  PetscBool known;    /* all of the following, as far as `definite` */
  PetscInt negative;  /* number of negative eigenvalues */
  PetscBool more;     /* at least so many */
  PetscBool definite; /* M is, as far as it was seen; else nothing is known */
  PetscInt solves;    /* with M */
} SbInertia;

/*
  SbNegativeModes - whether K has negative eigenvalues, how many, and the mode of the lowest one of
  the pencil (K, M).

  Collective. Input: scale, the absolute values of K's diagonal, for the rounding below which an
  eigenvalue counts as zero; most, the largest number that is looked for. Output: mode, if there is
  one.
*/
PetscErrorCode SbNegativeModes(const SbPencil *pencil, Vec scale, PetscInt most, Vec mode,
                               SbInertia *found);

/* ---- systems with constraints outside of the matrix (constraint_operator.c) */

/* The operator of solves: `whole`, the complete tangent, plus springs, projected onto the
   constraints. singular: K may be, if only constraints support some body: it is regularised for
   preconditioners, not for the operator; SB_SADDLE_DIRECT needs none of that. Collective; the
   caller destroys it; K and `whole` are borrowed until then. */
PetscErrorCode SbConstraintsCreateOperator(SbSpace space, Mat K, Mat whole, PetscBool singular,
                                           SbSaddle saddle, Mat *A);

/* The preconditioner M of a pc that works in the null space of constraints, P M^-1 P; else pc
   itself. Not collective. */
PetscErrorCode SbPCConstrainedGetInner(PC pc, PC *inner);

/* ---- systems of the tangent and blocks of contact (contact_system.c) */

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

/* z = M^-1 r, M the factor of the last system or the preconditioner of CG for it. Collective. */
PetscErrorCode SbContactSystemPrecondition(SbContactSystem system, Vec r, Vec z);

/* A = K + blocks as a matrix, lent until the next call. Collective. */
PetscErrorCode SbContactSystemGetMatrix(SbContactSystem system, Mat K, const SbBlocks *blocks,
                                        Mat *A);

/* Rows of constraints between any nodes, on the rank that counts them: C Y - force / stiffness =
   goal. Start with {0}; release with SbConstraintRowsFree(). */
typedef struct {
  PetscInt n, size; /* rows of this rank */
  PetscInt nentry, entry_size;
  PetscInt *start;      /* [n+1] */
  PetscInt *column;     /* [nentry] global unknowns; values of equal ones are summed */
  PetscReal *value;     /* [nentry] */
  PetscReal *goal;      /* [n] m */
  PetscReal *stiffness; /* [n] of a constraint, N/m */
  PetscReal *soft;      /* [n] of its spring in the blocks, N/m */
} SbConstraintRows;
/* Room for further rows and entries. Not collective. */
PetscErrorCode SbConstraintRowsReserve(SbConstraintRows *rows, PetscInt n, PetscInt nentry);
PetscErrorCode SbConstraintRowsFree(SbConstraintRows *rows);
/* The rows of all ranks, of unit length, as a matrix with `columns` unknowns of this rank;
   length[]: what they had. Collective; the caller destroys it. */
PetscErrorCode SbConstraintRowsMatrix(const SbConstraintRows *rows, MPI_Comm comm, PetscInt columns,
                                      PetscReal length[], Mat *matrix);

/*
  SbContactSystemSolveConstrained - SbContactSystemSolve() with stiff constraints: in their null
  space, or (saddle) with their forces as unknowns.

  Collective. Input: blocks, without the stiffness of the rows, and F with their forces at the
  goals; weight, on the stiffness of rows and blocks.
*/
PetscErrorCode SbContactSystemSolveConstrained(SbContactSystem system, Mat K,
                                               const SbBlocks *blocks, PetscBool saddle,
                                               const SbConstraintRows *rows, PetscReal weight,
                                               Vec F, Vec Y, KSPConvergedReason *reason,
                                               PetscInt *iterations);
