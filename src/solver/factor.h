/*
  factor.h - sparse Cholesky factor of a matrix of 3x3 blocks, in 16-bit integers for
  preconditioners, or exact, in double precision.

  The last `nkeep` nodes are not eliminated: their Schur complement is returned, which couples the
  factors of several ranks (pc_rotated.c).
*/
#pragma once
#include "sbbase.h"

typedef struct _p_SbFactor *SbFactor;

/* Result of ordering and symbolic factorisation: nodes in order of elimination, columns in
   supernodes. */
typedef struct {
  PetscInt n, nfree; /* number of nodes; of nodes that are eliminated */
  PetscInt
    *order; /* [n] node at each position; positions nfree.. are the kept nodes in their own order */
  PetscInt *inverse; /* [n] inverse of order */
  PetscInt nsuper;
  PetscInt *first; /* [nsuper+1] first position (column) of each supernode */
  PetscInt *start; /* [nsuper+1] offsets into list */
  PetscInt
    *list; /* positions of each supernode's rows: its columns, then the rows below, ascending */
  PetscInt
    *parent; /* [nsuper] supernode that takes the update, -1: none, or only kept nodes below */
} SbElimination;

/*
  SbEliminationCreate - nested dissection by METIS, elimination tree, supernodes.

  Not collective. Input: n nodes; nkeep; ia[n-nkeep+1], ja: columns of the rows of the eliminated
  nodes (a symmetric graph; with or without the diagonal); order[n-nkeep], a given order of
  elimination, NULL: by METIS. Output: owned by the caller, freed by SbEliminationDestroy().
*/
PetscErrorCode SbEliminationCreate(PetscInt n, PetscInt nkeep, const PetscInt ia[],
                                   const PetscInt ja[], const PetscInt order[], SbElimination *e);
PetscErrorCode SbEliminationDestroy(SbElimination *e);

#define SB_FACTOR_EXACT -1 /* for nkeep: an exact factor, in double precision, without kept nodes */
/* SbFactorCreate - symbolic factorisation (arguments as above), in the order of elimination of an
   old factor or (NULL) of METIS. Not collective. */
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
