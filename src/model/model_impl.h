/*
  model_impl.h - shared by the files of src/model.
*/
#pragma once
#include "sbmodel.h"

/* restitution.c, for SbModelContactBeginStep() and SbModelContactUpdateActiveSet(): Begin starts an attempt at a step; Update, once the active set has converged, checks the energy: `again` when
   coefficients were reduced. Collective. */
void SbModelRestitutionBegin(SbModel model, PetscReal dt, Vec U0, Vec V0);
PetscErrorCode SbModelRestitutionUpdate(SbModel model, Vec U, PetscBool *again);
/* model.c: f[nnode][3] = sign * f_ext, N; apart: without barrier contact. Not collective. */
PetscErrorCode SbModelExternalForces(SbModel model, const SbStage *stage, PetscBool apart, PetscReal sign,
                                     PetscReal f[]);
