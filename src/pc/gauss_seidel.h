/*
  gauss_seidel.h - Gauss-Seidel sweeps over the blocks of a matrix: gauss_seidel.c for two_level.c
  and levels.c.
*/
#pragma once
#include "sbfem.h"

/* inverse[n][9]: inverse diagonal blocks of a matrix with the fast product, n own nodes.
   extra[n][3] (output; NULL: none): l1 terms, added to the diagonal, with which sweeps converge on
   several ranks. Zero and *positive = false where a determinant is not positive on this rank. Not
   collective. */
PetscErrorCode SbGaussSeidelSetUp(Mat A, PetscReal inverse[], PetscReal extra[],
                                  PetscBool *positive);

/* z = (D + L^T)^-1 r, D and L of this rank's part, and t = r - A z. r differs from z and t.
   Collective. */
PetscErrorCode SbGaussSeidelDown(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r,
                                 Vec z, Vec t);

/* z += (D + L)^-1 (r - A z); t is work space. Collective. */
PetscErrorCode SbGaussSeidelUp(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r,
                               Vec z, Vec t);
