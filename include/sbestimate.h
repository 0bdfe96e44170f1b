/*
  sbestimate.h - layer 9: how large the errors of a run are. The errors of space:
  src/ledger/estimate_space.c.
*/
#pragma once
#include "sbmodel.h"

/*
  Estimate of the error |e| of the space discretisation in the energy norm: of the first
  Piola-Kirchhoff stress, to that of the continuum under the loads, inertia and prescribed
  displacements of the moment, in the strain energy norm of Hooke's law in the rotated frame of the
  cell. sqrt(body2 / strain) is the relative error. For CR and DG it is the error inside of cells,
  without the energy of jumps at faces; for P2 that of the deviator and of each cell's mean
  pressure.
*/
typedef struct _p_SbSpaceEstimate *SbSpaceEstimate;
struct _p_SbSpaceEstimate {
  SbModel model;    /* borrowed */
  PetscReal *cell2; /* [ncell_owned] square of the error of each owned cell, J */
  PetscReal *body2; /* [nbody] sums over the cells of each body and all ranks, J */
  PetscReal total2; /* their sum, J */
  PetscReal
    *strain; /* [nbody] the laws' strain energy of the cells of each body and all ranks, J */
  PetscReal *factor; /* [nbody] cell2, body2 over the square of recovery alone, 1 but for P1 */
  struct _p_SbRecovery *recovery;
  PetscReal *P;                 /* [ncell][9] stresses, Pa */
  struct SbPointStress *stress; /* [ncell] those of P2, NULL without a body of it */
  PetscReal *R;                 /* [ncell_owned][9] rotations; NULL when every law is linear */
  PetscReal *psi;               /* [ncell_owned] energy densities, J/m^3 */
  Vec residual;                 /* NULL without a body of P1 */
};
/* Patches and links between ranks, once. Collective. The model is borrowed; destroy the
   estimate. */
PetscErrorCode SbSpaceEstimateCreate(SbModel model, SbSpaceEstimate *est);
/*
  SbSpaceEstimateCompute - fills cell2, body2, total2, strain and factor.

  Collective. Input: displacement U (m), velocity V (m/s), acceleration A (m/s^2) at t (s), the last
  two NULL in a static run. Results are the same on any number of ranks up to rounding. Measured:
  0.2 us for a cell of the linear law, 0.4 us of another (the residual: 0.02 to 0.05 us for P1, 0.1
  to 0.2 us for DG), and 155 and 227 bytes for a cell from SbSpaceEstimateCreate() on.
*/
PetscErrorCode SbSpaceEstimateCompute(SbSpaceEstimate est, PetscReal t, Vec U, Vec V, Vec A);
PetscErrorCode
SbSpaceEstimateDestroy(SbSpaceEstimate *est); /* sets *est to NULL; NULL is accepted */
