/*
  contact_coarse.h - the two-level preconditioner of bodies that touch (contact_coarse.c), and what it works on.
*/
#pragma once
#include "block_solver.h"
#include "sbassembly.h"

/* Rows of a symmetric matrix of 3x3 blocks on the own nodes of a space. */
typedef struct {
  PetscInt n;       /* own nodes */
  PetscInt *ia;     /* [n+1] */
  PetscInt *ja;     /* [ia[n]] global nodes, ascending in a row */
  PetscReal *value; /* [ia[n]][9] row-major, N/m */
  uint8_t *contact; /* [n] the node is one of contact */
} SbContactRows;

/*
  SbPCContactCreate - makes pc a preconditioner for CG: Chebyshev's iteration with the blocks on the diagonal, or Gauss-Seidel where there are P2 bodies that are not too large,
  and a coarse space of the unknowns of contact nodes and of rigid-body modes of aggregates of the others, or of P2's vertices, which is solved exactly.

  Collective; space and rows are borrowed. The operator of pc is a matrix with these rows and the fast product. Right for a first guess from SbPCContactGuess().
*/
PetscErrorCode SbPCContactCreate(SbSpace space, const SbContactRows *rows, PC pc);
/* Before a solve: the values of the rows are others; changed, on some rank their pattern or contact nodes, too. Collective. */
PetscErrorCode SbPCContactUpdate(PC pc, PetscBool changed);
/* X = Z E^-1 Z^T F, zero where the preconditioner could not be made. Collective; after PCSetUp(). */
PetscErrorCode SbPCContactGuess(PC pc, Vec F, Vec X);
/* X += Z E^-1 Z^T (F - A X): leaves the residual no net force on a body, so that momentum is as exact as with a factor. Collective. */
PetscErrorCode SbPCContactCorrect(PC pc, Vec F, Vec X);
/* SbBlockSolverCost() of the coarse space. Collective; after PCSetUp(). */
PetscErrorCode SbPCContactCost(PC pc, PetscReal *flops, PetscReal *entries);
