/*
  pressure.c - a pressure on part of the surface, pushing inwards where it is positive.

  On a facet with current corners x0, x1, x2, counter-clockwise seen from outside, N = (x1 - x0) x (x2 - x0)
  is twice the outward area vector, and each corner receives

    f_a = -p/6 N,   p = value(t) time(t).

  On a closed surface this is -p dV/dx_a, V the enclosed volume: total force and moment vanish and the work is
  -p times the change of volume.

  Tangent: with the opposite edges c_b = x_{b+1} - x_{b+2} (indices modulo 3), dN/dx_b w = w x c_b, so
  df_a/dx_b = p/6 [c_b]x, where [c]x w = c x w. It is not symmetric facet by facet; what the facets add to the
  matrix here is the symmetric part, the blocks p/12 [c_b - c_a]x. On a closed surface, or one whose rim is
  held, the other part cancels and the tangent is the exact derivative (Bufler, "Pressure loaded structures
  under large deformations", 1984); at a free rim it is not, and Newton converges a little more slowly to the
  same answer.

  With follower = no the pressure acts on the rest area and normal, as small-strain theory has it; then there
  is no tangent.
*/
#include "sbeffect.h"

/* One facet of the loaded surface. */
typedef struct {
  PetscInt node[3];   /* local nodes, counter-clockwise seen from outside */
  PetscInt cell;      /* local cell */
  PetscInt corner[3]; /* 0..3, which nodes of the cell these are */
} Facet;

typedef struct {
  SbEffectOn on;
  SbFormula value, time;
  PetscBool follower;
  PetscInt nfacet;
  Facet *facet; /* [nfacet] of owned and ghost cells */
} Pressure;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose boundary facets are under pressure"},
  {"value", SB_OPTION_FORMULA, 1, "Pa", NULL, "",
   "pressure, a formula of the time t; positive pushes inwards"},
  {"follower", SB_OPTION_BOOL, 1, "", "true", "",
   "act on the current area and normal; if not, on those at rest"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "factor on the pressure, a formula of the time t"},
};

static PetscErrorCode options_pressure(SbEffect e, const SbScope *scope)
{
  Pressure *p = (Pressure *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectReadOn(scope, &p->on));
  PetscCall(SbEffectFormulas(scope, "value", 1, PETSC_FALSE, &p->value, &e->steady));
  PetscCall(SbOptionBool(scope, "follower", &p->follower));
  PetscCall(SbEffectFormulas(scope, "time", 1, PETSC_FALSE, &p->time, &e->steady));
  if (p->follower)
    e->linear = PETSC_FALSE;
  else
    e->ops.tangent = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_pressure(SbEffect e, SbSpace space)
{
  Pressure *p = (Pressure *)e->data;
  SbFacet *facets;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &p->on, &p->nfacet, &facets));
  PetscCall(PetscMalloc1(p->nfacet, &p->facet));
  for (PetscInt i = 0; i < p->nfacet; i++) {
    Facet *facet = &p->facet[i];

    facet->cell = facets[i].cell;
    for (int k = 0; k < 3; k++) {
      facet->node[k] = facets[i].node[k];
      for (int a = 0; a < 4; a++) {
        if (space->cell_node[4 * facet->cell + a] == facet->node[k]) facet->corner[k] = a;
      }
    }
  }
  PetscCall(PetscFree(facets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners of a facet, one per row, m: at rest when u is NULL, else where they are now. */
static inline void corners(const Facet *facet, const PetscReal X[], const PetscReal u[], PetscReal x[3][3])
{
  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++) x[k][i] = X[3 * facet->node[k] + i] + (u ? u[3 * facet->node[k] + i] : 0);
  }
}

static PetscErrorCode force_pressure(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Pressure *load = (const Pressure *)e->data;
  const PetscReal p = SbFormulaEval(load->value, stage->t, NULL) * SbFormulaEval(load->time, stage->t, NULL);
  const PetscReal *u = load->follower ? stage->u : NULL;

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < load->nfacet; k++) {
    const PetscInt *node = load->facet[k].node;
    PetscReal x[3][3], d[3], b[3], N[3];

    corners(&load->facet[k], space->node_x, u, x);
    for (int i = 0; i < 3; i++) {
      d[i] = x[1][i] - x[0][i];
      b[i] = x[2][i] - x[0][i];
    }
    N[0] = d[1] * b[2] - d[2] * b[1];
    N[1] = d[2] * b[0] - d[0] * b[2];
    N[2] = d[0] * b[1] - d[1] * b[0];
    for (int a = 0; a < 3; a++) {
      for (int i = 0; i < 3; i++) f[3 * node[a] + i] -= p / 6 * N[i];
    }
  }
  PetscCall(PetscLogFlops(45.0 * (PetscLogDouble)load->nfacet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_pressure(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Pressure *load = (const Pressure *)e->data;
  const PetscReal p =
    stage->shift_k * SbFormulaEval(load->value, stage->t, NULL) * SbFormulaEval(load->time, stage->t, NULL);

  PetscFunctionBeginUser;
  if (p == 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt k = 0; k < load->nfacet; k++) {
    const Facet *facet = &load->facet[k];
    PetscReal x[3][3], c[3][3];

    corners(facet, space->node_x, stage->u, x);
    for (int b = 0; b < 3; b++) {
      for (int i = 0; i < 3; i++) c[b][i] = x[(b + 1) % 3][i] - x[(b + 2) % 3][i];
    }
    // Minus the derivative of the force: -p/12 [c_b - c_a]x; the diagonal blocks vanish.
    for (int a = 0; a < 3; a++) {
      for (int b = 0; b < 3; b++) {
        if (a == b) continue;
        const PetscReal d[3] = {-p / 12 * (c[b][0] - c[a][0]), -p / 12 * (c[b][1] - c[a][1]),
                                -p / 12 * (c[b][2] - c[a][2])};
        const PetscReal block[9] = {0, -d[2], d[1], d[2], 0, -d[0], -d[1], d[0], 0};

        PetscCall(SbSpaceAddCellBlock(space, A, facet->cell, facet->corner[a], facet->corner[b], block));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_pressure(SbEffect e)
{
  Pressure *p = (Pressure *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFreeOn(&p->on));
  PetscCall(SbFormulaDestroy(&p->value));
  PetscCall(SbFormulaDestroy(&p->time));
  PetscCall(PetscFree(p->facet));
  PetscCall(PetscFree(e->data));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode create_pressure(SbEffect e)
{
  Pressure *p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  e->data = p;
  e->ops.setfromoptions = options_pressure;
  e->ops.setup = setup_pressure;
  e->ops.force = force_pressure;
  e->ops.tangent = tangent_pressure;
  e->ops.destroy = destroy_pressure;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEffectRegister_Pressure(void)
{
  PetscFunctionBeginUser;
  PetscCall(SbEffectRegister("pressure", create_pressure, PETSC_STATIC_ARRAY_LENGTH(rows), rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}
