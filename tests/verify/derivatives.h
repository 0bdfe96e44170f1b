/*
  derivatives.h - the tangent and the force of a scene beside differences of residuals and energies.
*/
#pragma once
#include "verify.h"

/* At X, along D, at a time: residuals change by the tangent times the step, h and a tenth of it, up
   to a remainder of second order; the energy by the force. X is the same after. Collective. */
static inline PetscErrorCode verify_derivatives(TestScene *t, PetscReal time, PetscReal h, Vec X,
                                                Vec D)
{
  PetscReal error[2], psi[2], slope, size, force;
  PetscInt n;
  Vec R, R0, AD;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(X, &R));
  PetscCall(VecDuplicate(X, &R0));
  PetscCall(VecDuplicate(X, &AD));
  PetscCall(SbModelTangent(t->model, time, 0., 0., 1., X, NULL, t->run->solve.J));
  PetscCall(MatMult(t->run->solve.J, D, AD));
  PetscCall(SbModelResidual(t->model, time, X, NULL, NULL, PETSC_TRUE, R0));
  for (int k = 0; k < 2; k++) {
    const PetscReal step = k ? h / 10. : h;

    PetscCall(VecAXPY(X, step, D));
    PetscCall(SbModelResidual(t->model, time, X, NULL, NULL, PETSC_TRUE, R));
    PetscCall(VecAXPY(X, -step, D));
    PetscCall(VecAXPY(R, -1., R0));
    PetscCall(VecNorm(R, NORM_2, &size));
    PetscCall(VecAXPY(R, -step, AD));
    PetscCall(VecNorm(R, NORM_2, &error[k]));
    error[k] /= size;
  }
  VERIFY_NEAR(PetscLog10Real(error[0] / error[1]), 1., 0.1, "order of the remainder, less one");
  for (int k = 0; k < 2; k++) {
    PetscCall(VecAXPY(X, k ? 2e-6 : -1e-6, D));
    PetscCall(SbModelStrainEnergy(t->model, X, NULL, &psi[k], &n));
  }
  PetscCall(VecAXPY(X, -1e-6, D));
  PetscCall(SbModelStrainEnergy(t->model, X, R, &slope, &n));
  PetscCall(VecDot(R, D, &force));
  VERIFY_NEAR((psi[1] - psi[0]) / 2e-6 / force, 1., 1e-5,
              "derivative of the energy over the force");
  PetscCall(VecDestroy(&R));
  PetscCall(VecDestroy(&R0));
  PetscCall(VecDestroy(&AD));
  PetscFunctionReturn(PETSC_SUCCESS);
}
