/*
  sweep.h - Gauss-Seidel for symmetric block matrices of a space.
*/
#pragma once
#include "fem_impl.h"
#include "sbkernel.h"

typedef enum { SB_SWEEP_FORWARD, SB_SWEEP_BACKWARD } SbSweepDirection;
/* inverse[nnode_owned][9] of the diagonal blocks of a BAIJ or SBAIJ matrix of the space. Zero and *positive = false
   where a determinant is not positive on this rank. Not collective. */
PetscErrorCode SbSweepSetUp(SbSpace space, Mat A, PetscReal inverse[], PetscBool *positive);
/* z = (D + L)^-1 r or (D + L^T)^-1 r on the part of this rank. z is not r. Not collective. */
PetscErrorCode SbSweep(SbSpace space, Mat A, const PetscReal inverse[], SbSweepDirection direction, Vec r,
                       Vec z);
