/*
  product.h - what else the fast products of product.c have at hand.
*/
#pragma once
#include "sbfem.h"

/*
  SbProductGetSymmetric - the rows and columns of this rank of a matrix with the fast product, as SBAIJ.

  Not collective. Input: A, BAIJ or SBAIJ of SbSpaceCreateMatrix(). Output: local, borrowed from A, up to date until values of A
  change; A itself when that is SBAIJ on one rank. Ask again after each assembly: the same matrix, with a new state.
*/
PetscErrorCode SbProductGetSymmetric(Mat A, Mat *local);
/*
  SbMatReturnRead - gives back the values of a matrix that were only read, by its own function, say MatSeqSBAIJRestoreArray.

  Not collective. Since 3.25 PETSc takes these functions for a change of the matrix, after which fast products and preconditioners are set up anew,
  in each iteration if one reads the values in its set-up.
*/
PetscErrorCode SbMatReturnRead(Mat A, PetscErrorCode (*restore)(Mat, PetscScalar *[]), PetscScalar *value[]);
