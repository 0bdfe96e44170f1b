/*
  contact_coarse.h - the two-level preconditioner for bodies in contact (contact_coarse.c), and its matrix.
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

/*
  SbPCContactCreate - makes pc a preconditioner for CG: Chebyshev with the diagonal blocks, or Gauss-Seidel for P2 bodies that are not too large,
  and an exactly solved coarse space: nodes in contact, and rigid-body modes of aggregates of the others or the vertices of P2.

  Collective; space and rows are borrowed. The operator of pc is a matrix with these rows and the fast product. The initial guess must be that of SbPCContactGuess().
*/
PetscErrorCode SbPCContactCreate(SbSpace space, const SbContactRows *rows, PC pc);
/* Before a solve: the values of the rows have changed; changed: on some rank also their pattern or the nodes in contact. Collective. */
PetscErrorCode SbPCContactUpdate(PC pc, PetscBool changed);
/* X = Z E^-1 Z^T F, zero if the preconditioner could not be set up. Collective; after PCSetUp(). */
PetscErrorCode SbPCContactGuess(PC pc, Vec F, Vec X);
/* X += Z E^-1 Z^T (F - A X): no net force on a body remains in the residual, so that momentum is as exact as with a factorisation. Collective. */
PetscErrorCode SbPCContactCorrect(PC pc, Vec F, Vec X);
/* SbBlockSolverCost() of the coarse space. Collective; after PCSetUp(). */
PetscErrorCode SbPCContactCost(PC pc, PetscReal *flops, PetscReal *entries);
