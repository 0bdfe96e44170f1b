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
