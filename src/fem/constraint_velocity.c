/*
  Velocities that go with what is constrained: after a step of Newmark, what stays in touch must not move along its normals.

  With G the constraints of what touches, w the speeds that obstacles have along them and M the lumped mass

    v <- v + M^-1 G^T mu,   G M^-1 G^T mu = w - G v:

  the nearest velocity in the norm of the mass, so that the kinetic energy falls (w = 0) and momentum stays between bodies (Laursen and
  Love, "Improved implicit integrators for transient impact problems", IJNME 53, 2002, correct velocities in this way). Held nodes
  come first, each with its own directions; constraints then have no say along these.

  Not for constraints that push along other coefficients than their own (friction).
*/
#include "fem_impl.h"
#include "sbconstraint.h"

#define PASSES 2 /* of the projection: the factorisation is of a slightly larger matrix */
#define NOTHING \
  1e-20 /* of the largest on the diagonal: constraints below it have no free node but for rounding */

PetscErrorCode SbSpaceSetConstraintVelocity(SbSpace s, PetscInt constraint, PetscReal rate)
{
  SbConstraints c = s->constraints;

  PetscFunctionBeginUser;
  if (c->nrate < c->n) {
    PetscCall(PetscRealloc((size_t)c->size * sizeof(PetscReal), &c->rate));
    PetscCall(PetscArrayzero(c->rate + c->nrate, c->size - c->nrate));
    c->nrate = c->size;
  }
  c->rate[constraint] = rate;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (G M^-1 G^T), with its diagonal slightly larger, and M^-1 G^T of the exact constraints. */
static PetscErrorCode create_gram(SbSpace s, Mat *MGt, Mat *gram)
{
  SbConstraints c = s->constraints;
  PetscReal largest;
  PetscScalar *x;
  PetscInt n;
  Vec d;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(c->w[0], &x));
  for (PetscInt i = 0; i < 3 * s->nnode_owned; i++)
    x[i] = s->node_mass[i / 3] > 0. ? 1. / s->node_mass[i / 3] : 0.;
  PetscCall(VecRestoreArray(c->w[0], &x));
  PetscCall(MatTranspose(c->exact.free, MAT_INITIAL_MATRIX, MGt));
  PetscCall(MatDiagonalScale(*MGt, c->w[0], NULL));
  PetscCall(MatMatMult(c->exact.free, *MGt, MAT_INITIAL_MATRIX, PETSC_DEFAULT, gram));
  PetscCall(MatCreateVecs(*gram, &d, NULL));
  PetscCall(MatGetDiagonal(*gram, d));
  PetscCall(VecNorm(d, NORM_INFINITY, &largest));
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetArray(d, &x));
  for (PetscInt i = 0; i < n; i++)
    x[i] = x[i] > NOTHING * largest ? x[i] * (1. + SB_CONSTRAINT_REGULARIZATION) : PetscMax(largest, 1.);
  PetscCall(VecRestoreArray(d, &x));
  PetscCall(MatDiagonalSet(*gram, d, INSERT_VALUES));
  PetscCall(VecDestroy(&d));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rates of the exact constraints, m/s. */
static PetscErrorCode get_rates(SbConstraints c, Vec rate)
{
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(rate));
  PetscCall(VecGetArray(rate, &x));
  for (PetscInt i = 0; i < c->n && c->nrate; i++) {
    if (c->stiffness[i] < 0. && !c->redundant[i]) x[c->position[i]] = c->rate[i];
  }
  PetscCall(VecRestoreArray(rate, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the mean forces of the impulses mu, N s, over a step to those of the constraints. */
static PetscErrorCode add_forces(SbConstraints c, PetscReal dt, Vec mu)
{
  const PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(VecAXPY(c->exact.force, 1. / dt, mu));
  PetscCall(VecGetArrayRead(mu, &x));
  for (PetscInt i = 0; i < c->n; i++) {
    if (c->stiffness[i] < 0. && !c->redundant[i]) c->force[i] += x[c->position[i]] / dt;
  }
  PetscCall(VecRestoreArrayRead(mu, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbConstraintsProjectVelocity(SbSpace s, PetscReal dt, Vec V)
{
  SbConstraints c = s->constraints;
  Mat MGt, gram;
  Vec rate, mu;
  KSP solver;

  PetscFunctionBeginUser;
  if (!c->exact.N) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(create_gram(s, &MGt, &gram));
  PetscCall(SbConstraintsCreateGramSolver(s, gram, &solver));
  PetscCall(VecDuplicate(c->exact.value, &rate));
  PetscCall(VecDuplicate(c->exact.value, &mu));
  PetscCall(VecZeroEntries(mu));
  PetscCall(get_rates(c, rate));
  for (int pass = 0; pass < PASSES; pass++) {
    PetscCall(MatMult(c->exact.full, V, c->exact.work));
    PetscCall(VecAYPX(c->exact.work, -1., rate));
    PetscCall(KSPSolve(solver, c->exact.work, c->exact.step));
    PetscCall(VecAXPY(mu, 1., c->exact.step));
    PetscCall(MatMultAdd(MGt, c->exact.step, V, V));
  }
  PetscCall(add_forces(c, dt, mu));
  PetscCall(KSPDestroy(&solver));
  PetscCall(MatDestroy(&gram));
  PetscCall(MatDestroy(&MGt));
  PetscCall(VecDestroy(&rate));
  PetscCall(VecDestroy(&mu));
  PetscFunctionReturn(PETSC_SUCCESS);
}
