/*
  deadload.c - the effects `body_force`, a force per rest volume, and `traction`, a force per rest area; of
  fixed direction (dead loads), given as three formulas of time and rest position.

  f_a = s(t) integral of phi_a q(X, t) over each tet (or facet), phi_a the basis of the element, X its map. A
  total force of a traction is uniform over the rest area of its facets, and adds up with the formulas. Every
  rank integrates its owned and its ghost cells, so rows of owned nodes are complete without communication.

  Rules, both with positive weights, inner points and degree 5, hence exact for q of degree 4: SbRuleQuintic
  (Walkington, "Quadrature on simplices of arbitrary dimension", 2000), SbRuleFacet (Radon 1948; Stroud,
  "Approximate calculation of multiple integrals", 1971, T2:5-1). Second-order convergence of linear elements
  needs degree 2; the rest lowers the constant at no cost, because a steady load is integrated once.
*/
#include "effect_impl.h"

typedef struct {
  SbFormula density[3];    /* N/m^3 or Pa */
  PetscReal uniform[3];    /* traction: total force, N, from set-up on per area, Pa */
  PetscInt ncorner, nitem; /* 4 for tets, 3 for facets */
  PetscInt *corner;  /* [nitem][ncorner] 4 cell + vertex of it; NULL once a steady load was integrated */
  PetscInt n, *node; /* [n] owned nodes of these cells */
  PetscReal *value;  /* [nnode][3] load at time t, right on owned nodes, N */
  PetscReal t;       /* s */
} DeadLoad;

static const SbOption body_force_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "", "", "sets on whose tets the force acts; default: all bodies"},
  {"density", SB_OPTION_FORMULA, 3, "N/m^3", NULL, "",
   "force per reference volume, three formulas of t and the reference position x, y, z"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "amplitude: factor on the force, a formula of the time t"},
};

static const SbOption traction_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets on whose boundary facets the traction acts"},
  {"vector", SB_OPTION_FORMULA, 3, "Pa", "0;0;0", "",
   "force per reference area, three formulas of t and the reference position x, y, z"},
  {"total", SB_OPTION_REALS, 3, "N", "0,0,0", "",
   "total force, spread evenly over the reference area of the sets"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "amplitude: factor on the traction, a formula of the time t"},
};

static PetscErrorCode options_body_force(SbEffect e, const SbScope *scope)
{
  DeadLoad *load = (DeadLoad *)e->data;

  PetscFunctionBeginUser;
  load->ncorner = 4;
  PetscCall(SbEffectFormulas(scope, "density", 3, PETSC_TRUE, load->density, &e->steady));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_traction(SbEffect e, const SbScope *scope)
{
  DeadLoad *load = (DeadLoad *)e->data;
  PetscBool vector, total;

  PetscFunctionBeginUser;
  load->ncorner = 3;
  PetscCall(SbOptionGiven(scope, "vector", &vector));
  PetscCall(SbOptionGiven(scope, "total", &total));
  PetscCheck(vector || total, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_vector (Pa, three formulas) or -effect_%s_total (N, three numbers)",
             e->name, e->name, e->name);
  PetscCall(SbEffectFormulas(scope, "vector", 3, PETSC_TRUE, load->density, &e->steady));
  PetscCall(SbOptionReals(scope, "total", load->uniform));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* value = the load at time t. */
static void integrate(DeadLoad *load, SbSpace space, PetscReal t)
{
  const PetscInt nc = load->ncorner;
  const SbPointRule *rule = nc == 4 ? &SbRuleQuintic : &SbRuleFacet;

  load->t = t;
  for (PetscInt i = 0; i < 3 * space->nnode; i++) load->value[i] = 0;
  for (PetscInt item = 0; item < load->nitem; item++) {
    const PetscInt *corner = &load->corner[nc * item], cell = corner[0] / 4;
    const PetscBool curved = (PetscBool)(space->mesh->cell_set[cell] & SB_CURVED);
    PetscReal nodes[SB_CELL_NODES][3], x[4][3], e[3][3], normal[3];

    if (curved) SbSpaceCellPositions(space, cell, nodes);
    for (int k = 0; k < 12; k++)
      x[k / 3][k % 3] = space->mesh->x[3 * space->mesh->cell[4 * cell + k / 3] + k % 3];
    for (int k = 0; k < rule->n; k++) {
      PetscReal L[4] = {0}, phi[SB_CELL_NODES], p[3] = {0}, q[3], measure;
      PetscInt n;

      for (PetscInt c = 0; c < nc; c++) L[corner[c] % 4] = rule->L[k][c];
      n = SbCellBasis(SbSpaceCellElement(space, cell), L, phi);
      for (PetscInt a = 0; a < 3 * n; a++)
        p[a % 3] += phi[a / 3] * space->node_x[3 * SbSpaceCellNode(space, cell, a / 3) + a % 3];

      /* volume or area of the simplex with the derivatives of the map at the point */
      if (curved) SbQuadraticCorners(L, (const PetscReal(*)[3])nodes, x);
      for (PetscInt c = 1; c < nc; c++) SbSubtract(x[corner[c] % 4], x[corner[0] % 4], e[c - 1]);
      SbCross(e[0], e[1], normal);
      measure = nc == 3 ? PetscSqrtReal(SbDot3(normal, normal)) / 2 : PetscAbsReal(SbDot3(normal, e[2])) / 6;
      for (int i = 0; i < 3; i++)
        q[i] = measure * rule->weight[k] * (SbFormulaEval(load->density[i], t, p) + load->uniform[i]);
      for (PetscInt a = 0; a < 3 * n; a++)
        load->value[3 * SbSpaceCellNode(space, cell, a / 3) + a % 3] += phi[a / 3] * q[a % 3];
    }
  }
}

static PetscErrorCode setup_deadload(SbEffect e, SbSpace space)
{
  DeadLoad *load = (DeadLoad *)e->data;
  const PetscInt nc = load->ncorner;
  PetscBool steady = PETSC_TRUE, *touched;
  PetscReal area = 0;
  PetscInt *cells = NULL;
  SbFacet *facets = NULL;

  PetscFunctionBeginUser;
  if (nc == 4)
    PetscCall(SbEffectItems(space, &e->on, SB_ON_CELLS, &load->nitem, &cells));
  else
    PetscCall(SbEffectFacets(space, &e->on, &load->nitem, &facets));
  PetscCall(PetscMalloc1(nc * load->nitem, &load->corner));
  for (PetscInt i = 0; i < load->nitem; i++) {
    for (PetscInt a = 0; a < nc; a++)
      load->corner[nc * i + a] = nc == 4 ? 4 * cells[i] + a : 4 * facets[i].cell + facets[i].corner[a];
    if (nc == 3 && facets[i].cell < space->mesh->ncell_owned) area += facets[i].area;
  }
  PetscCall(PetscFree(cells));
  PetscCall(PetscFree(facets));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPIU_REAL, MPI_SUM, space->comm));
  for (int i = 0; i < 3 && nc == 3; i++) load->uniform[i] /= area;

  /* the owned nodes of these cells: a load on few costs little in a large mesh */
  PetscCall(PetscCalloc1(space->nnode, &touched));
  for (PetscInt i = 0; i < load->nitem; i++) {
    const PetscInt cell = load->corner[nc * i] / 4;

    for (PetscInt a = 0; a < (SbSpaceCellElement(space, cell)->nodes_per[1] ? SB_CELL_NODES : 4); a++)
      touched[SbSpaceCellNode(space, cell, a)] = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < space->nnode_owned; i++) load->n += touched[i];
  PetscCall(PetscMalloc1(load->n, &load->node));
  for (PetscInt i = space->nnode_owned - 1, k = load->n; i >= 0; i--)
    if (touched[i]) load->node[--k] = i;
  PetscCall(PetscFree(touched));

  /* a steady load is integrated once */
  PetscCall(PetscMalloc1(3 * space->nnode, &load->value));
  integrate(load, space, 0);
  for (int i = 0; i < 3; i++) steady = (PetscBool)(steady && !SbFormulaUses(load->density[i], 't'));
  if (steady) PetscCall(PetscFree(load->corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_deadload(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  DeadLoad *load = (DeadLoad *)e->data;
  const PetscReal s = SbFormulaEval(e->time, stage->t, NULL);

  PetscFunctionBeginUser;
  if (load->corner && stage->t != load->t) integrate(load, space, stage->t);
  for (PetscInt i = 0; i < load->n; i++) {
    const PetscInt node = 3 * load->node[i];

    for (int c = 0; c < 3; c++) f[node + c] += s * load->value[node + c];
  }
  PetscCall(PetscLogFlops(6.0 * (PetscLogDouble)load->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_deadload(SbEffect e)
{
  DeadLoad *load = (DeadLoad *)e->data;

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) PetscCall(SbFormulaDestroy(&load->density[i]));
  PetscCall(PetscFree(load->corner));
  PetscCall(PetscFree(load->node));
  PetscCall(PetscFree(load->value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectBodyForce = {
  .name = "body_force",
  .size = sizeof(DeadLoad),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(body_force_rows),
  .row = body_force_rows,
  .ops = {.setfromoptions = options_body_force,
          .setup = setup_deadload,
          .force = force_deadload,
          .destroy = destroy_deadload},
};

const SbEffectType SbEffectTraction = {
  .name = "traction",
  .size = sizeof(DeadLoad),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(traction_rows),
  .row = traction_rows,
  .ops = {.setfromoptions = options_traction,
          .setup = setup_deadload,
          .force = force_deadload,
          .destroy = destroy_deadload},
};
