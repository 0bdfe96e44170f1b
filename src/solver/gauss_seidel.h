/*
  gauss_seidel.h - Gauss-Seidel for symmetric block matrices of a space.
*/
#pragma once
#include "sbassembly.h"
#include "sbkernel.h"

typedef enum { SB_GAUSS_SEIDEL_FORWARD, SB_GAUSS_SEIDEL_BACKWARD } SbGaussSeidelDirection;
/* inverse[nnode_owned][9] of the diagonal blocks of a BAIJ or SBAIJ matrix of the space. Zero and *positive = false
   where a determinant is not positive on this rank. Not collective. */
PetscErrorCode SbGaussSeidelSetUp(SbSpace space, Mat A, PetscReal inverse[], PetscBool *positive);
/* z = (D + L)^-1 r or (D + L^T)^-1 r on the part of this rank. z is not r. Not collective. */
PetscErrorCode SbGaussSeidel(SbSpace space, Mat A, const PetscReal inverse[],
                             SbGaussSeidelDirection direction, Vec r, Vec z);
