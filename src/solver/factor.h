/*
  factor.h - sparse Cholesky factor of a matrix of 3x3 blocks, kept in 16-bit integers for preconditioners, or as it is.

  The last `nkeep` nodes are not eliminated: their Schur complement is handed out, which is what joins the factors of
  several ranks (pc_rotated.c).
*/
#pragma once
#include "sbbase.h"

typedef struct _p_SbFactor *SbFactor;

/* What ordering and symbolic elimination leave: nodes in order of elimination, columns in groups with equal rows. */
typedef struct {
  PetscInt n, nfree; /* nodes; those that are eliminated */
  PetscInt *order;   /* [n] node at each position; positions nfree.. are the kept nodes in their own order */
  PetscInt *inverse; /* [n] inverse of order */
  PetscInt nsuper;
  PetscInt *first;  /* [nsuper+1] first position (column) of each group */
  PetscInt *start;  /* [nsuper+1] offsets into list */
  PetscInt *list;   /* positions of each group's rows: its columns, then the rows below, ascending */
  PetscInt *parent; /* [nsuper] group that takes the update, -1: only kept nodes are below, or none */
} SbElimination;

/*
  SbEliminationCreate - nested dissection by METIS, elimination tree, groups of columns.

  Not collective. Input: n nodes; nkeep; ia[n-nkeep+1], ja: columns of the rows of the eliminated nodes (a symmetric graph;
  the node itself may be among them); order[n-nkeep], an order to take instead, NULL: METIS finds one. Output: owned by the
  caller, freed by SbEliminationDestroy().
*/
PetscErrorCode SbEliminationCreate(PetscInt n, PetscInt nkeep, const PetscInt ia[], const PetscInt ja[],
                                   const PetscInt order[], SbElimination *e);
PetscErrorCode SbEliminationDestroy(SbElimination *e);

/* SbFactorCreate - everything that depends on the graph only (arguments as above). Not collective. */
PetscErrorCode SbFactorCreate(PetscInt n, PetscInt nkeep, const PetscInt ia[], const PetscInt ja[],
                              SbFactor *f);
/* The same with nkeep = 0 for a factor that is kept as it is: SbFactorSolve(). order: as above. Not collective. */
PetscErrorCode SbFactorCreateExact(PetscInt n, const PetscInt ia[], const PetscInt ja[],
                                   const PetscInt order[], SbFactor *f);
/* The order of elimination, borrowed: [n] node at each position. */
const PetscInt *SbFactorOrder(SbFactor f);
/*
  SbFactorNumeric - factors new values.

  Not collective. Input: ia, ja as given to SbFactorCreate(); block[ia[n-nkeep]][9], row-major 3x3 blocks A_ij of the rows of
  the eliminated nodes, N/m. In and out: schur[(3 nkeep)^2], column-major, from which A_ki A_ii^-1 A_ik is subtracted (lower
  triangle only); NULL when nkeep = 0. Output: ok, PETSC_FALSE when the matrix is not positive definite: then there is no
  factor until the next success.
*/
PetscErrorCode SbFactorNumeric(SbFactor f, const PetscInt ia[], const PetscInt ja[], const PetscReal block[],
                               PetscReal schur[], PetscBool *ok);
/*
  SbFactorForward, SbFactorBackward - the two halves of a solve; Backward goes on where the last Forward stopped.

  Not collective. Forward, input: b[n][3] in the numbering of the caller; output: kept[nkeep][3] = b_k - A_ki A_ii^-1 b_i.
  Backward, input: kept, the solution at the kept nodes; output: x[n][3]. With nkeep = 0 the two in turn solve A x = b, to
  about 1e-5 times the root of the condition number.
*/
void SbFactorForward(SbFactor f, const float b[], float kept[]);
void SbFactorBackward(SbFactor f, const float kept[], float x[]);
/* A x = b with a factor of SbFactorCreateExact(); b and x [n][3] may be the same. Not collective. */
PetscErrorCode SbFactorSolve(SbFactor f, const PetscReal b[], PetscReal x[]);
/* Entries of the factor, and bytes that one pass reads. */
void SbFactorSize(SbFactor f, PetscInt64 *entries, PetscInt64 *bytes);
/* Multiplications and additions of a factorisation that is kept as it is. */
PetscReal SbFactorFlops(SbFactor f);
PetscErrorCode SbFactorDestroy(SbFactor *f);
