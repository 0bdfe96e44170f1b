/*
  gravity.c - a uniform acceleration field on all bodies.

  f_a = s(t) m_a g, with the mass matrix of the run, so that a body falls without strain. For linear
  elements a row of the consistent mass matrix sums to the lumped mass m_a of the node. For P2 it
  does not: static runs, and those with the consistent mass, have its row sums.
*/
#include "effect_impl.h"

static const SbOption rows[] = {
  {"vector", SB_OPTION_REALS, 3, "m/s^2", "0,0,-9.81", "", "acceleration"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the acceleration, a formula of the time t"},
};

static PetscErrorCode options_gravity(SbEffect e, const SbScope *scope)
{
  PetscFunctionBeginUser;
  PetscCall(SbOptionReals(scope, "vector", (PetscReal *)e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_gravity(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const PetscReal *vector = (const PetscReal *)e->data;
  const PetscReal *mass =
    space->consistent_mass || !e->dynamic ? space->node_share : space->node_mass;
  PetscReal s;

  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(e->time, stage->t, NULL, &s));
  for (PetscInt i = 0; i < space->nnode_owned; i++)
    for (int c = 0; c < 3; c++)
      f[3 * i + c] += mass[i] * (s * vector[c]);
  PetscCall(PetscLogFlops(6.0 * (PetscLogDouble)space->nnode_owned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectGravity = {
  .name = "gravity",
  .size = sizeof(PetscReal[3]),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_gravity, .force = force_gravity},
};
