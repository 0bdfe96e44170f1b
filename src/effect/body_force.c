/*
  body_force.c - a force per rest volume, given as three formulas of time and rest position.

  f_a = s(t) integral of phi_a b(X, t) over the rest volume, by the quadrature of deadload.c. Every rank
  integrates its owned and its ghost cells, so rows of owned nodes are complete without communication.
*/
#include "effect_impl.h"

typedef struct {
  SbFormula density[3];
  SbDeadLoad load;
} BodyForce;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "", "", "sets on whose tets the force acts; default: all bodies"},
  {"density", SB_OPTION_FORMULA, 3, "N/m^3", NULL, "",
   "force per reference volume, three formulas of t and the reference position x, y, z"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "amplitude: factor on the force, a formula of the time t"},
};

static PetscErrorCode options_body_force(SbEffect e, const SbScope *scope)
{
  BodyForce *b = (BodyForce *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(scope, "density", 3, PETSC_TRUE, b->density, &e->steady));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_body_force(SbEffect e, SbSpace space)
{
  BodyForce *b = (BodyForce *)e->data;
  PetscInt n, *cells, *corners;

  PetscFunctionBeginUser;
  PetscCall(SbEffectCells(space, &e->on, &n, &cells));
  PetscCall(PetscMalloc1(4 * n, &corners));
  for (PetscInt i = 0; i < 4 * n; i++) corners[i] = 4 * cells[i / 4] + i % 4;
  PetscCall(SbDeadLoadCreate(space, 4, n, corners, b->density, &b->load));
  PetscCall(PetscFree(corners));
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_body_force(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const BodyForce *b = (const BodyForce *)e->data;

  PetscFunctionBeginUser;
  (void)space;
  PetscCall(SbDeadLoadAdd(b->load, stage->t, SbFormulaEval(e->time, stage->t, NULL), f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_body_force(SbEffect e)
{
  BodyForce *b = (BodyForce *)e->data;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) PetscCall(SbFormulaDestroy(&b->density[i]));
  PetscCall(SbDeadLoadDestroy(&b->load));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectBodyForce = {
  .name = "body_force",
  .size = sizeof(BodyForce),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_body_force,
          .setup = setup_body_force,
          .force = force_body_force,
          .destroy = destroy_body_force},
};
