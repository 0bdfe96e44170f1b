/*
  start.c - initial states of hard cases: perturbations, and bodies far from their rest shape.

  Random numbers are generated from the original node number (SbSpace.node_orig), so that a run is
  the same on any number of ranks.
*/
#include "hard.h"
#include "../verify/verify.h"

#define POINT \
  1e-4 /* over the size; exactly one point is an equilibrium of the neo-Hookean material */

/* Random numbers in [-1, 1] for each original node number, [verify_numbers()][3]; the caller frees
   them. */
static PetscErrorCode draw(HardRun *r, PetscReal **value)
{
  const PetscInt n = 3 * verify_numbers(r->model);

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, value));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(PetscRandomGetValueReal(r->random, &(*value)[i]));
    (*value)[i] = 2. * (*value)[i] - 1.;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HardNoise(HardRun *r, PetscReal amplitude, Vec X)
{
  const SbSpace s = r->model->space;
  PetscReal *noise;
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(draw(r, &noise));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    for (int k = 0; k < 3; k++)
      if (!(s->fixed[i] & (1 << k)))
        x[3 * i + k] += amplitude * noise[3 * s->node_orig[i] + k];
  }
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(PetscFree(noise));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HardPlace(HardRun *r,
                         void (*place)(const HardRun *r, const PetscReal x[3], PetscReal to[3]))
{
  const SbSpace s = r->model->space;
  PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(r->run->state.U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    const PetscReal *x = s->node_x + 3 * i;
    PetscReal to[3];

    place(r, x, to);
    for (int k = 0; k < 3; k++)
      if (!(s->fixed[i] & (1 << k)))
        u[3 * i + k] += to[k] - x[k];
  }
  PetscCall(VecRestoreArray(r->run->state.U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void at_origin(const HardRun *r, const PetscReal x[3], PetscReal to[3])
{
  (void)r;
  (void)x;
  to[0] = to[1] = to[2] = 0.;
}

static void mirrored(const HardRun *r, const PetscReal x[3], PetscReal to[3])
{
  (void)r;
  to[0] = -x[0];
  to[1] = x[1];
  to[2] = x[2];
}

static void flat(const HardRun *r, const PetscReal x[3], PetscReal to[3])
{
  (void)r;
  to[0] = x[0];
  to[1] = x[1];
  to[2] = 0.;
}

PetscErrorCode HardStartRandom(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(HardPlace(r, at_origin));
  PetscCall(HardNoise(r, 0.5 * r->size, r->run->state.U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HardStartExactPoint(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(HardPlace(r, at_origin));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HardStartPoint(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(HardStartExactPoint(r));
  PetscCall(HardNoise(r, POINT * r->size, r->run->state.U));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HardStartMirror(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(HardPlace(r, mirrored));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HardStartFlat(HardRun *r)
{
  PetscFunctionBeginUser;
  PetscCall(HardPlace(r, flat));
  PetscFunctionReturn(PETSC_SUCCESS);
}
