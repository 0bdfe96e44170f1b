/*
  sbfactor.h - layer 4: factorisations. A sparse Cholesky factor of our own, on one rank and, by the
  interface nodes, on several; PETSc's packages; the saddle-point system of constraints.
*/
#pragma once
#include "sbfem.h"

/* ---- the packages of PETSc (direct.c, pivots.c) */

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

/* The package of a factorisation that is gathered on one rank, NULL for any other pc. Not
   collective. */
PetscErrorCode SbPCDirectGathered(PC pc, const char **package);

/* Number of negative pivots of a factorisation, -1: unknown; only MUMPS' L D L^T counts them.
   Collective. */
PetscErrorCode SbPCDirectCountNegative(PC pc, PetscInt *negative);

/* Makes non-positive pivots of a Cholesky factorisation, also a gathered one, fail the solve
   (KSP_DIVERGED_PC_FAILED). After PCSetFromOptions(). Not collective. */
PetscErrorCode SbPCCheckPivots(PC pc);

/* Block Jacobi and additive Schwarz: blocks without rows, of ranks without unknowns, get no
   preconditioner. Other types: nothing. Before the set-up. Not collective. */
PetscErrorCode SbPCAllowEmptyBlocks(PC pc);

/* ---- a sparse Cholesky factor on one rank (factor.c): of a matrix of 3x3 blocks, in 16-bit
   integers for preconditioners, or exact, in double precision. The last `nkeep` nodes are not
   eliminated: their Schur complement is returned, which couples the factors of several ranks. */

typedef struct _p_SbFactor *SbFactor;
#define SB_FACTOR_EXACT -1 /* for nkeep: an exact factor, in double precision, without kept nodes */
/*
  SbFactorCreate - symbolic factorisation, in the order of elimination of an old factor or (NULL) of
  METIS.

  Not collective. Input: n nodes; nkeep; ia[n-nkeep+1], ja: columns of the rows of the eliminated
  nodes (a symmetric graph; with or without the diagonal).
*/
PetscErrorCode SbFactorCreate(PetscInt n, PetscInt nkeep, const PetscInt ia[], const PetscInt ja[],
                              SbFactor old, SbFactor *f);

/*
  SbFactorNumeric - numeric factorisation.

  Not collective. Input: ia, ja as given to SbFactorCreate(); block[ia[n-nkeep]][9], row-major 3x3
  blocks A_ij of the rows of the eliminated nodes, N/m. In and out: schur[(3 nkeep)^2],
  column-major, from which A_ki A_ii^-1 A_ik is subtracted (lower triangle only); NULL when nkeep =
  0. Output: ok, PETSC_FALSE if the matrix is not positive definite: the factor is then invalid
  until the next success.
*/
PetscErrorCode SbFactorNumeric(SbFactor f, const PetscInt ia[], const PetscInt ja[],
                               const PetscReal block[], PetscReal schur[], PetscBool *ok);

/*
  SbFactorForward, SbFactorBackward - the two halves of a solve; Backward continues the last
  Forward.

  Not collective. Forward, input: b[n][3] in the numbering of the caller; output: kept[nkeep][3] =
  b_k - A_ki A_ii^-1 b_i. Backward, input: kept, the solution at the kept nodes; output: x[n][3].
  With nkeep = 0 both solve A x = b, with a relative error of about 1e-5 times the root of the
  condition number.
*/
void SbFactorForward(SbFactor f, const float b[], float kept[]);
void SbFactorBackward(SbFactor f, const float kept[], float x[]);

/* A x = b with an exact factor; b and x [n][3] may be the same. Not collective. */
PetscErrorCode SbFactorSolve(SbFactor f, const PetscReal b[], PetscReal x[]);

/* Multiplications and additions of an exact factorisation; number of entries of the factor. */
void SbFactorCost(SbFactor f, PetscReal *flops, PetscReal *entries);

/* Bytes that one substitution reads, of a factor in integers. */
PetscInt64 SbFactorBytes(SbFactor f);
PetscErrorCode SbFactorDestroy(SbFactor *f);

/* ---- a direct solver for a symmetric positive definite matrix of 3x3 blocks, distributed by rows
   and factored on one rank (block_solver.c) */

typedef struct _p_SbBlockSolver *SbBlockSolver;
PetscErrorCode SbBlockSolverCreate(MPI_Comm comm, SbBlockSolver *solver);
PetscErrorCode SbBlockSolverDestroy(SbBlockSolver *solver);

/* Symbolic factorisation, as done by SbBlockSolverSetUp() with `changed`; arguments as there.
   Collective. */
PetscErrorCode SbBlockSolverAnalyze(SbBlockSolver solver, PetscInt n, const PetscInt ia[],
                                    const PetscInt ja[]);

/*
  SbBlockSolverSetUp - factors the matrix.

  Collective. Input: n own block rows; ia[n+1], ja: their columns, global, each once;
  block[ia[n]][9], row-major; changed: ia and ja differ from the last call on some rank. Output: ok,
  PETSC_FALSE on all ranks if the matrix is not positive definite.
*/
PetscErrorCode SbBlockSolverSetUp(SbBlockSolver solver, PetscInt n, const PetscInt ia[],
                                  const PetscInt ja[], const PetscReal block[], PetscBool changed,
                                  PetscBool *ok);

/* Operations of a factorisation, entries of the factor. Collective; after
   SbBlockSolverAnalyze(). */
PetscErrorCode SbBlockSolverCost(SbBlockSolver solver, PetscReal *flops, PetscReal *entries);

/* x = A^-1 b, by own rows. Collective. */
PetscErrorCode SbBlockSolverSolve(SbBlockSolver solver, Vec b, Vec x);

/* ---- the Schur complement on the interface between ranks (interface.c) */

/* The interface nodes, and W of their inverse Schur complement W^T W, distributed by rows
   (interface.c). */
typedef struct _p_SbInterface *SbInterface;
struct _p_SbInterface {
  SbSpace space;          /* borrowed */
  PetscInt n;             /* number of interface nodes, all ranks */
  PetscInt *index;        /* [nnode] number of a local node in the interface, -1 for others */
  PetscInt nmine;         /* number owned by this rank */
  PetscInt *mine;         /* [nmine] local nodes */
  PetscInt nblock, nrows; /* number of row blocks of W, of all ranks, of this one */
  struct _SbRows *rows;   /* [nrows] row blocks of this rank */
  size_t nword;           /* number of words in use: this rank reads them in a solve */
  int32_t *word;          /* words, with room for reads beyond the last panel */
  float *scale;           /* [3 n][2] scales of the rows; the second ones are unused */
  float *sum,
    *y; /* [3 n] sum of the right-hand sides; own part of the solution; room for one block more */
};

/* Finds the interface. Collective. */
PetscErrorCode SbInterfaceCreate(SbSpace space, SbInterface *face);
PetscErrorCode SbInterfaceDestroy(SbInterface *face);

/*
  SbInterfaceFactorise - factors the sum over ranks of their Schur complements.

  Collective. Input: work, bytes that this rank reads for its interior in each application, for load
  balance. In and out: schur[(3 n)^2], column-major, lower triangle: this rank's contribution;
  overwritten. Output: ok, PETSC_FALSE on all ranks if the sum is not positive definite.
*/
PetscErrorCode SbInterfaceFactorise(SbInterface face, PetscInt64 work, PetscReal schur[],
                                    PetscBool *ok);

/* x[3 n] <- inverse times the sum of x over ranks. Collective. */
PetscErrorCode SbInterfaceSolve(SbInterface face, float x[]);

/*
  SbSpaceInterfaceSize - number n of interface nodes between ranks, and the largest for -solver
  rotated.

  Collective. Makes the plan of the space. Options read: -pc_rotated_interface (1500).
*/
PetscErrorCode SbSpaceInterfaceSize(SbSpace space, PetscInt *n, PetscInt *most);

/* ---- the saddle-point system of constraints (saddle_factor.c) */

/*
  Solves [K + F^T k G, F^T; G, 0] [z; m] = [r; 0] for z by a factorisation, renewed when K or the
  constraints have changed; r must be projected. Collective.

  Output: failed, the reason of a failed factorisation; z is NaN then.
*/
PetscErrorCode SbSaddleFactorSolve(SbSpace space, Vec r, Vec z, PCFailedReason *failed);
