/*
  contact_coarse.h - the two-level preconditioner for bodies in contact (pc_coarse.c), and its matrix.
*/
#pragma once
#include "block_solver.h"
#include "sbassembly.h"

/* Own rows of a symmetric matrix of 3x3 blocks on the nodes of a space. */
typedef struct {
  PetscInt n;       /* number of own nodes */
  PetscInt *ia;     /* [n+1] offsets of the rows */
  PetscInt *ja;     /* [ia[n]] global nodes, ascending in a row */
  PetscReal *value; /* [ia[n]][9] row-major, N/m */
  uint8_t *contact; /* [n] the node is in contact */
} SbContactRows;

/* Position of a column in row r, whose columns are ascending; -1: none. */
static inline PetscInt SbRowFind(const PetscInt ia[], const PetscInt ja[], PetscInt r, PetscInt column)
{
  PetscInt low = ia[r], high = ia[r + 1];

  while (low < high) {
    const PetscInt middle = (low + high) / 2;

    if (ja[middle] < column)
      low = middle + 1;
    else
      high = middle;
  }
  return low < ia[r + 1] && ja[low] == column ? low : -1;
}

/*
  SbPCContactCreate - makes pc a preconditioner for CG: Chebyshev with the diagonal blocks, or Gauss-Seidel
  for P2 bodies that are not too large, and an exactly solved coarse space: nodes in contact, and rigid-body
  modes of aggregates of the others or the vertices of P2.

  Collective; space and rows are borrowed. The operator of pc is a matrix with these rows and the fast
  product, another matrix when their pattern or the nodes in contact have changed.
*/
PetscErrorCode SbPCContactCreate(SbSpace space, const SbContactRows *rows, PC pc);
/* SbBlockSolverCost() of the coarse space. Collective; after PCSetUp(). */
PetscErrorCode SbPCContactCost(PC pc, PetscReal *flops, PetscReal *entries);
