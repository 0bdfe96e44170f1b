/*
  gauss_seidel.h - Gauss-Seidel for symmetric block matrices of a space.
*/
#pragma once
#include "sbassembly.h"
#include "sbkernel.h"

/* inverse[n][9] of the diagonal blocks of a matrix with the fast product, n own nodes; with extra[n][3], which is computed (NULL: without), on their diagonals: what
   keeps sweeps convergent between ranks. Zero and *positive = false where a determinant is not positive on this rank. Not collective. */
PetscErrorCode SbGaussSeidelSetUp(Mat A, PetscReal inverse[], PetscReal extra[], PetscBool *positive);
/* z = (D + L^T)^-1 r, D and L of this rank's part, and t = r - A z. r, z and t are others. Collective. */
PetscErrorCode SbGaussSeidelDown(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r, Vec z,
                                 Vec t);
/* z += (D + L)^-1 (r - A z); t is for work. Collective. */
PetscErrorCode SbGaussSeidelUp(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r, Vec z,
                               Vec t);
