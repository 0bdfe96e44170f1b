/*
  gravity.c - a uniform acceleration field on all bodies.

  f_a = s(t) m_a g, with the mass matrix of the run, so that a body falls without strain. For linear elements a row of the consistent mass
  matrix sums to the lumped mass m_a of the node. For P2 it does not: static runs, and those with the consistent mass, have its row sums.
*/
#include "effect_impl.h"

typedef struct {
  PetscReal g[3]; /* m/s^2 */
  SbFormula time;
} Gravity;

static const SbOption rows[] = {
  {"vector", SB_OPTION_REALS, 3, "m/s^2", "0,0,-9.81", "", "acceleration"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the acceleration, a formula of the time t"},
};

static PetscErrorCode options_gravity(SbEffect e, const SbScope *scope)
{
  Gravity *gravity = (Gravity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionReals(scope, "vector", gravity->g));
  PetscCall(SbEffectFormulas(scope, "time", 1, PETSC_FALSE, &gravity->time, &e->steady));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_gravity(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Gravity *gravity = (const Gravity *)e->data;
  const PetscReal s = SbFormulaEval(gravity->time, stage->t, NULL);
  const PetscReal *mass = space->consistent_mass || !e->dynamic ? space->node_share : space->node_mass;
  const PetscReal g[3] = {s * gravity->g[0], s * gravity->g[1], s * gravity->g[2]};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < space->nnode_owned; i++) {
    for (int c = 0; c < 3; c++) f[3 * i + c] += mass[i] * g[c];
  }
  PetscCall(PetscLogFlops(6.0 * (PetscLogDouble)space->nnode_owned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_gravity(SbEffect e)
{
  Gravity *gravity = (Gravity *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbFormulaDestroy(&gravity->time));
  PetscCall(PetscFree(e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_gravity(SbEffect e)
{
  Gravity *gravity;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&gravity));
  e->data = gravity;
  e->ops.setfromoptions = options_gravity;
  e->ops.force = force_gravity;
  e->ops.destroy = destroy_gravity;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRegister_Gravity(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbEffectRegister("gravity", create_gravity, PETSC_STATIC_ARRAY_LENGTH(rows), rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
