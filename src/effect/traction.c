/*
  traction.c - a force per rest area on part of the surface, of fixed direction (a dead load).

  f_a = s(t) integral of phi_a q(X, t) over the rest area, by the quadrature of deadload.c. A given total
  force F is the uniform traction F / |S|, with the area |S| summed over the facets of owned cells of all
  ranks. Vector and total add up.
*/
#include "effect_impl.h"

typedef struct {
  char option[3 * SB_NAME_MAX]; /* full name of the option "total" */
  SbFormula vector[3];
  PetscReal total[3];             /* N */
  SbFormula uniform[3];           /* total per area, Pa */
  SbDeadLoad by_vector, by_total; /* NULL when not given */
  PetscBool vector_given, total_given;
} Traction;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets on whose boundary facets the traction acts"},
  {"vector", SB_OPTION_FORMULA, 3, "Pa", "0;0;0", "",
   "force per reference area, three formulas of t and the reference position x, y, z"},
  {"total", SB_OPTION_REALS, 3, "N", "0,0,0", "",
   "total force, spread evenly over the reference area of the sets"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "amplitude: factor on the traction, a formula of the time t"},
};

static PetscErrorCode options_traction(SbEffect e, const SbScope *scope)
{
  Traction *q = (Traction *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbOptionName(scope, "total", sizeof(q->option), q->option));
  PetscCall(SbOptionGiven(scope, "vector", &q->vector_given));
  PetscCall(SbOptionGiven(scope, "total", &q->total_given));
  PetscCheck(q->vector_given || q->total_given, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_vector (Pa, three formulas) or -effect_%s_total (N, three numbers)",
             e->name, e->name, e->name);
  PetscCall(SbEffectFormulas(scope, "vector", 3, PETSC_TRUE, q->vector, &e->steady));
  PetscCall(SbOptionReals(scope, "total", q->total));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_traction(SbEffect e, SbSpace space)
{
  Traction *q = (Traction *)e->data;
  SbFacet *facets;
  PetscInt n, *corners;
  PetscReal area = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &n, &facets));
  PetscCall(PetscMalloc1(3 * n, &corners));
  for (PetscInt i = 0; i < n; i++) {
    for (int a = 0; a < 3; a++) corners[3 * i + a] = 4 * facets[i].cell + facets[i].corner[a];
    if (facets[i].cell < space->mesh->ncell_owned) area += facets[i].area;
  }
  if (q->vector_given) PetscCall(SbDeadLoadCreate(space, 3, n, corners, q->vector, &q->by_vector));
  if (q->total_given) { /* as a uniform traction */
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPIU_REAL, MPI_SUM, space->comm));
    for (int i = 0; i < 3; i++) {
      char text[64];

      PetscCall(PetscSNPrintf(text, sizeof(text), "%.17g", (double)(q->total[i] / area)));
      PetscCall(SbFormulaCreate(PETSC_COMM_SELF, text, q->option, &q->uniform[i]));
    }
    PetscCall(SbDeadLoadCreate(space, 3, n, corners, q->uniform, &q->by_total));
  }
  PetscCall(PetscFree(corners));
  PetscCall(PetscFree(facets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_traction(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Traction *q = (const Traction *)e->data;
  const PetscReal s = SbFormulaEval(e->time, stage->t, NULL);

  PetscFunctionBeginUser;
  (void)space;
  if (q->by_vector) PetscCall(SbDeadLoadAdd(q->by_vector, stage->t, s, f));
  if (q->by_total) PetscCall(SbDeadLoadAdd(q->by_total, stage->t, s, f));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_traction(SbEffect e)
{
  Traction *q = (Traction *)e->data;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) {
    PetscCall(SbFormulaDestroy(&q->vector[i]));
    PetscCall(SbFormulaDestroy(&q->uniform[i]));
  }
  PetscCall(SbDeadLoadDestroy(&q->by_vector));
  PetscCall(SbDeadLoadDestroy(&q->by_total));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectTraction = {
  .name = "traction",
  .size = sizeof(Traction),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_traction,
          .setup = setup_traction,
          .force = force_traction,
          .destroy = destroy_traction},
};
