/*
  elimination.h - order of elimination and structure of a sparse Cholesky factor: elimination.c for
  factor.c.
*/
#pragma once
#include "sbbase.h"

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
