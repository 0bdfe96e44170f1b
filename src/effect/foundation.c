/*
  foundation.c - an elastic foundation: springs and dampers between a surface and a rigid ground, so
  much per area (Winkler; a Robin condition). Surrounding tissue, a bed of foam, a boundary that
  lets waves out (damping rho c per area, c the speed of the wave).

  With u the displacement, n the rest normal and P = n n^T or I, in integrals over rest areas,

    f_a = - integral phi_a P (s(t) k u + c du/dt).

  For constant s the springs have the energy integral s k/2 |P u|^2, a column of the history. They
  are there at any load factor of a static run. The rule SbRuleFacet has degree 5: exact for P2.
*/
#include "effect_impl.h"
#include "sbgeometry.h"

/* A point of the rule in a facet. */
typedef struct {
  PetscInt cell, n;             /* its basis functions: those of the cell */
  PetscReal phi[SB_CELL_NODES]; /* at the point */
  PetscReal P[9];               /* projection, symmetric */
  PetscReal k, c;               /* stiffness and damping times the point's area, N/m and N s/m */
  PetscBool counts;             /* the cell is owned */
} Point;

typedef struct {
  SbFormula stiffness, damping; /* Pa/m, Pa s/m */
  int direction;                /* 0: normal, 1: all */
  PetscInt n;
  Point *point; /* [n] of owned and ghost cells; those of a facet follow each other */
} Foundation;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets on whose boundary facets it acts"},
  {"stiffness", SB_OPTION_FORMULA, 1, "Pa/m", "0", "",
   "of the springs per rest area: stress over displacement, a formula of the rest position x, y, "
   "z, at least 0"},
  {"damping", SB_OPTION_FORMULA, 1, "Pa s/m", "0", "",
   "of the dampers per rest area: stress over velocity, a formula of x, y, z, at least 0; implicit "
   "integrators only"},
  {"direction", SB_OPTION_CHOICE, 1, "", "normal", "normal|all",
   "which displacement is resisted: normal to the rest surface, or all of it"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the stiffness, a formula of the time t, at least 0"},
};

static PetscErrorCode options_foundation(SbEffect e, const SbScope *scope)
{
  Foundation *b = (Foundation *)e->data;
  PetscBool given[2];

  PetscFunctionBeginUser;
  PetscCall(SbOptionGiven(scope, "stiffness", &given[0]));
  PetscCall(SbOptionGiven(scope, "damping", &given[1]));
  PetscCheck(given[0] || given[1], PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_stiffness (Pa/m), -effect_%s_damping (Pa s/m) or both",
             e->name, e->name, e->name);
  PetscCall(SbEffectFormulas(e, scope, "stiffness", 1, PETSC_TRUE, &b->stiffness));
  PetscCall(SbEffectFormulas(e, scope, "damping", 1, PETSC_TRUE, &b->damping));
  for (int i = 0; i < 2; i++)
    PetscCheck(!SbFormulaUses(i ? b->damping : b->stiffness, 't'), PETSC_COMM_WORLD,
               PETSC_ERR_USER_INPUT,
               "-effect_%s_%s is a formula of the place x, y, z, not of the time; "
               "-effect_%s_time is a factor on the stiffness that may change",
               e->name, i ? "damping" : "stiffness", e->name);
  PetscCall(SbOptionChoice(scope, "direction", &b->direction));
  e->linear = PETSC_FALSE;
  e->stiff = PETSC_TRUE;
  e->holds = given[0];
  e->steady = PETSC_FALSE; /* a load factor does not make the ground softer */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A coefficient at the rest position x, at least 0. */
static PetscErrorCode coefficient(SbEffect e, const char *key, SbFormula formula,
                                  const PetscReal x[3], PetscReal *value)
{
  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(formula, 0, x, value));
  PetscCheck(*value >= 0 && !PetscIsInfOrNanReal(*value), PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "-effect_%s_%s is %g at (%g, %g, %g) m: it has to be at least 0", e->name, key,
             (double)*value, (double)x[0], (double)x[1], (double)x[2]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode set_point(SbEffect e, SbSpace space, const SbFacet *facet, int q, Point *at)
{
  const Foundation *b = (const Foundation *)e->data;
  PetscReal x[3], corner[4][3], side[2][3], normal[3];
  PetscReal L[4] = {0};

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++)
    L[facet->corner[i]] = SbRuleFacet.L[q][i];
  *at = (Point){.cell = facet->cell, .counts = (PetscBool)(facet->cell < space->mesh->ncell_owned)};
  at->n = SbEffectPoint(space, facet->cell, L, at->phi, x, corner);

  /* area and normal, by the derivatives of the map */
  for (int i = 0; i < 2; i++)
    SbSubtract(corner[facet->corner[i + 1]], corner[facet->corner[0]], side[i]);
  SbCross(side[0], side[1], normal);
  const PetscReal area = SbNormalise(normal) / 2 * SbRuleFacet.weight[q];

  for (int k = 0; k < 9; k++)
    at->P[k] = b->direction ? (PetscReal)(k % 4 == 0) : normal[k / 3] * normal[k % 3];
  PetscCall(coefficient(e, "stiffness", b->stiffness, x, &at->k));
  PetscCall(coefficient(e, "damping", b->damping, x, &at->c));
  at->k *= area;
  at->c *= area;
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_foundation(SbEffect e, SbSpace space)
{
  Foundation *b = (Foundation *)e->data;
  SbFacet *facets = NULL;
  PetscInt n;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &n, &facets));
  PetscCall(PetscMalloc1(n * SbRuleFacet.n, &b->point));
  for (PetscInt i = 0; i < n; i++)
    for (int q = 0; q < SbRuleFacet.n; q++)
      PetscCall(set_point(e, space, &facets[i], q, &b->point[b->n++]));
  PetscCall(PetscFree(facets));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor on the stiffness at a time, at least 0: bodies would run away from the ground. */
static PetscErrorCode factor_at(SbEffect e, PetscReal t, PetscReal *s)
{
  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(e->time, t, NULL, s));
  PetscCheck(
    *s >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
    "-effect_%s_time is %g at t = %g: a factor on the stiffness of the foundation has to be "
    "at least 0",
    e->name, (double)*s, (double)t);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* P times the value at a point of a field of the nodes. */
static void value_at(SbSpace space, const Point *at, const PetscReal u[], PetscReal Pu[3])
{
  PetscReal sum[3] = {0};

  for (PetscInt a = 0; a < at->n; a++)
    for (int i = 0; i < 3; i++)
      sum[i] += at->phi[a] * u[3 * SbSpaceCellNode(space, at->cell, a) + i];
  for (int i = 0; i < 3; i++)
    Pu[i] = SbDot3(at->P + 3 * i, sum);
}

static PetscErrorCode force_foundation(SbEffect e, SbSpace space, const SbStage *stage,
                                       PetscReal f[])
{
  const Foundation *b = (const Foundation *)e->data;
  PetscReal s;

  PetscFunctionBeginUser;
  PetscCall(factor_at(e, stage->t, &s));
  for (PetscInt k = 0; k < b->n; k++) {
    const Point *at = &b->point[k];
    PetscReal u[3];
    PetscReal v[3] = {0};

    value_at(space, at, stage->u, u);
    if (stage->v && at->c > 0)
      value_at(space, at, stage->v, v);
    for (PetscInt a = 0; a < at->n; a++)
      for (int i = 0; i < 3; i++)
        f[3 * SbSpaceCellNode(space, at->cell, a) + i] -=
          at->phi[a] * (s * at->k * u[i] + at->c * v[i]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_foundation(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Foundation *b = (const Foundation *)e->data;
  PetscReal s;

  PetscFunctionBeginUser;
  PetscCall(factor_at(e, stage->t, &s));
  for (const Point *facet = b->point; facet < b->point + b->n; facet += SbRuleFacet.n) {
    for (PetscInt pair = 0; pair < facet->n * facet->n; pair++) {
      const PetscInt a = pair / facet->n;
      const PetscInt c = pair % facet->n;
      PetscReal block[9] = {0};

      for (const Point *at = facet; at < facet + SbRuleFacet.n; at++)
        for (int k = 0; k < 9; k++)
          block[k] += (stage->shift_k * s * at->k + stage->shift_v * at->c) * at->phi[a] *
                      at->phi[c] * at->P[k];
      PetscCall(SbSpaceAddCellBlock(space, A, facet->cell, a, c, block));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The force on the body, N, and the energy of the springs, J. */
static PetscErrorCode history_foundation(SbEffect e, SbSpace space, const SbStage *stage,
                                         const PetscReal residual[], PetscReal values[])
{
  const Foundation *b = (const Foundation *)e->data;
  PetscReal s;

  PetscFunctionBeginUser;
  (void)residual;
  if (!SbEffectActs(e, stage->t))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(factor_at(e, stage->t, &s));
  for (PetscInt k = 0; k < b->n; k++) {
    const Point *at = &b->point[k];
    PetscReal u[3];
    PetscReal v[3] = {0};

    if (!at->counts)
      continue;
    value_at(space, at, stage->u, u);
    if (stage->v)
      value_at(space, at, stage->v, v);
    for (int i = 0; i < 3; i++)
      values[i] -= s * at->k * u[i] + at->c * v[i];
    values[3] += s * at->k / 2 * SbDot3(u, u);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_foundation(SbEffect e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(((Foundation *)e->data)->point));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const char *const columns[] = {"force_x", "force_y", "force_z", "energy"};

const SbEffectType SbEffectFoundation = {
  .name = "foundation",
  .size = sizeof(Foundation),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ncolumn = PETSC_STATIC_ARRAY_LENGTH(columns),
  .column = columns,
  .ops = {.setfromoptions = options_foundation,
          .setup = setup_foundation,
          .force = force_foundation,
          .tangent = tangent_foundation,
          .history = history_foundation,
          .destroy = destroy_foundation},
};
