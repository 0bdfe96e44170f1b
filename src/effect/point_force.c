/*
  point_force.c - a total force shared equally by the nodes of the named sets.

  f_a = s(t) F(t) / n for each of the n nodes, counted once over all ranks. A force on a single node has no
  limit under mesh refinement (the displacement under it grows like 1/h); use a traction where the area
  matters.
*/
#include "sbeffect.h"

typedef struct {
  SbEffectOn on;
  SbFormula vector[3], time;
  PetscInt n;      /* owned nodes of the sets on this rank */
  PetscInt *node;  /* [n] local */
  PetscReal share; /* 1 / global number of nodes */
} PointForce;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose nodes share the force equally"},
  {"vector", SB_OPTION_FORMULA, 3, "N", NULL, "", "total force, three formulas of the time t"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "factor on the force, a formula of the time t"},
};

static PetscErrorCode options_point_force(SbEffect e, const SbScope *scope)
{
  PointForce *p = (PointForce *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectReadOn(scope, &p->on));
  PetscCall(SbEffectFormulas(scope, "vector", 3, PETSC_FALSE, p->vector, &e->steady));
  PetscCall(SbEffectFormulas(scope, "time", 1, PETSC_FALSE, &p->time, &e->steady));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_point_force(SbEffect e, SbSpace space)
{
  PointForce *p = (PointForce *)e->data;
  PetscInt n, total;

  PetscFunctionBeginUser;
  PetscCall(SbEffectNodes(space, &p->on, &n, &p->node));
  // Owned nodes come first.
  while (p->n < n && p->node[p->n] < space->nnode_owned) p->n++;
  PetscCallMPI(MPI_Allreduce(&p->n, &total, 1, MPIU_INT, MPI_SUM, space->comm));
  p->share = 1 / (PetscReal)total;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_point_force(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const PointForce *p = (const PointForce *)e->data;
  const PetscReal s = p->share * SbFormulaEval(p->time, stage->t, NULL);
  PetscReal F[3];

  PetscFunctionBeginUser;
  (void)space;
  for (int c = 0; c < 3; c++) F[c] = s * SbFormulaEval(p->vector[c], stage->t, NULL);
  for (PetscInt i = 0; i < p->n; i++) {
    for (int c = 0; c < 3; c++) f[3 * p->node[i] + c] += F[c];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_point_force(SbEffect e)
{
  PointForce *p = (PointForce *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFreeOn(&p->on));
  for (int c = 0; c < 3; c++) PetscCall(SbFormulaDestroy(&p->vector[c]));
  PetscCall(SbFormulaDestroy(&p->time));
  PetscCall(PetscFree(p->node));
  PetscCall(PetscFree(e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_point_force(SbEffect e)
{
  PointForce *p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  e->data = p;
  e->ops.setfromoptions = options_point_force;
  e->ops.setup = setup_point_force;
  e->ops.force = force_point_force;
  e->ops.destroy = destroy_point_force;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRegister_PointForce(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbEffectRegister("point_force", create_point_force, PETSC_STATIC_ARRAY_LENGTH(rows), rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
