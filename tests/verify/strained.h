/*
  strained.h - what tests of fibres that contract and of bodies that grow share: the corner of a
  cube, mean stresses, the tangent beside a state.
*/
#pragma once
#include "derivatives.h"

/* The displacement of the corner at (1, 1, 1) m at the end of a run, m. */
static inline PetscErrorCode strained_corner(PetscReal u[3], const char *format, ...)
  PETSC_ATTRIBUTE_FORMAT(2, 3);
static inline PetscErrorCode strained_corner(PetscReal u[3], const char *format, ...)
{
  PetscReal sum[4] = {0.};
  PetscReal *x;
  TestScene t;
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(test_vopen(PETSC_COMM_WORLD, NULL, &t, format, args));
  va_end(args);
  PetscCall(verify_solve(&t, verify_title));
  PetscCall(PetscMalloc1(3 * t.model->mesh->nvert, &x));
  PetscCall(SbSpaceVertexPositions(t.model->space, t.run->state.U, x));
  for (PetscInt v = 0; v < t.model->mesh->nvert_owned; v++) {
    const PetscReal *rest = t.model->mesh->x + 3 * v;

    if (rest[0] + rest[1] + rest[2] < 2.99)
      continue;
    for (int k = 0; k < 3; k++)
      sum[k] += x[3 * v + k] - 1.;
    sum[3] += 1.;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 4, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  for (int k = 0; k < 3; k++)
    u[k] = sum[k] / sum[3];
  PetscCall(PetscFree(x));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Mean Cauchy stress over the volume, Pa, xx yy zz xy yz xz. */
static inline PetscErrorCode strained_mean(TestScene *t, PetscReal mean[6])
{
  const SbMesh mesh = t->model->mesh;
  const PetscReal *u;
  PetscReal *sigma;
  PetscReal sum[7] = {0.};

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(6 * mesh->ncell_owned, &sigma));
  PetscCall(SbSpaceGetLocalRead(t->model->space, t->run->state.U, &u));
  SbSpaceCellState(t->model->space, u, sigma, NULL, NULL, NULL);
  PetscCall(SbSpaceRestoreLocalRead(t->model->space, t->run->state.U, &u));
  for (PetscInt c = 0; c < mesh->ncell_owned; c++) {
    const PetscReal V = SbTetDeterminant(mesh->x, mesh->cell + 4 * c) / 6.;

    for (int k = 0; k < 6; k++)
      sum[k] += V * sigma[6 * c + k];
    sum[6] += V;
  }
  PetscCall(PetscFree(sigma));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 7, MPIU_REAL, MPI_SUM, PETSC_COMM_WORLD));
  for (int k = 0; k < 6; k++)
    mean[k] = sum[k] / sum[6];
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline void strained_ripple(const PetscReal x[3], PetscReal v[3])
{
  v[0] = PetscSinReal(20. * x[1]) * x[0];
  v[1] = PetscCosReal(15. * x[2] + 5. * x[0]) * x[0];
  v[2] = PetscSinReal(12. * x[0] + 9. * x[1]) * x[0];
}

/* Beside the state of a scene: residuals change by the tangent times the change, the energy by the
   force. */
static inline PetscErrorCode strained_tangent(TestScene *t)
{
  Vec X, D;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(t->run->state.U, &X));
  PetscCall(VecDuplicate(X, &D));
  PetscCall(test_fill(t->model, strained_ripple, D));
  PetscCall(SbSpaceZeroPrescribed(t->model->space, PETSC_TRUE, D));
  PetscCall(VecWAXPY(X, 0.02, D, t->run->state.U));
  PetscCall(SbSpaceLineariseStress(t->model->space, NULL, NULL, 1.));
  PetscCall(verify_derivatives(t, 1., 1e-3, X, D));
  PetscCall(VecDestroy(&X));
  PetscCall(VecDestroy(&D));
  PetscFunctionReturn(PETSC_SUCCESS);
}
