/*
  deadload.c - the effects `body_force`, a force per rest volume, `traction`, a force per rest area,
  and `point_force`, shared equally by the vertices of the named sets; of fixed direction (dead
  loads), given as three formulas of time and, but for vertices, of rest position.

  f_a = s(t) integral of phi_a q(X, t) over each tet (or facet), phi_a the basis of the element, X
  its map. A total force of a traction is uniform over the rest area of its facets, and adds up with
  the formulas. Every rank integrates its owned and its ghost cells, so rows of owned nodes are
  complete without communication.

  Rules, both with positive weights, inner points and degree 5, hence exact for q of degree 4:
  SbRuleQuintic (Walkington, "Quadrature on simplices of arbitrary dimension", 2000), SbRuleFacet
  (Radon 1948; Stroud, "Approximate calculation of multiple integrals", 1971, T2:5-1). Second-order
  convergence of linear elements needs degree 2; the rest lowers the constant at no cost, because a
  steady load is integrated once.

  Point force: the displacement of vertex v is the mean over the cells c around it, weighted by
  their volumes w_c, and its part of the force goes the same way back: node a of cell c has w_c
  phi_a(v) / sum w of it. With P1 and P2 that is the force on the node at v; with CR and DG, where
  phi_a(v) is 1 or -2, total force and moment are those of the force on the vertices, since mean and
  elements reproduce linear functions. A force on a single vertex has no limit under mesh refinement
  (the displacement under it grows like 1/h); use a traction where the area matters.
*/
#include "effect_impl.h"
#include "sbgeometry.h"

/* What a dead load acts on. An item is a tet, a facet or a vertex of a tet. */
typedef struct {
  PetscInt ncorner;                                  /* corners of an item: 4, 3 or 1 */
  const SbPointRule *rule;                           /* integrates over an item */
  PetscErrorCode (*list)(SbEffect e, SbSpace space); /* fills `corner` of the load */
} Domain;

typedef struct {
  const Domain *on;
  SbFormula density[3]; /* N/m^3 or Pa; of points the total force, N */
  PetscReal uniform[3]; /* traction: total force, N, from set-up on per area, Pa */
  PetscInt nitem;

  /* [nitem][ncorner] 4 cell + vertex of it; NULL once a steady load was integrated */
  PetscInt *corner;

  /* [nvert] of points: six times the volume of the tets around, times the number of points */
  PetscReal *around;
  PetscInt n, *node; /* [n] owned nodes of these cells */
  PetscReal *value;  /* [nnode][3] load at time t, right on owned nodes, N */
  PetscReal t;       /* s */
} DeadLoad;

static const SbOption body_force_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", "", "", "sets on whose tets the force acts; default: all bodies"},
  {"density", SB_OPTION_FORMULA, 3, "N/m^3", NULL, "",
   "force per reference volume, three formulas of t and the reference position x, y, z"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the force, a formula of the time t"},
};

static const SbOption traction_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets on whose boundary facets the traction acts"},
  {"vector", SB_OPTION_FORMULA, 3, "Pa", "0;0;0", "",
   "force per reference area, three formulas of t and the reference position x, y, z"},
  {"total", SB_OPTION_REALS, 3, "N", "0,0,0", "",
   "total force, spread evenly over the reference area of the sets"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the traction, a formula of the time t"},
};

static const SbOption point_force_rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose vertices share the force equally"},
  {"vector", SB_OPTION_FORMULA, 3, "N", NULL, "", "total force, three formulas of the time t"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "",
   "amplitude: factor on the force, a formula of the time t"},
};

/* body_force: all corners of the tets. */
static PetscErrorCode list_tets(SbEffect e, SbSpace space)
{
  DeadLoad *load = (DeadLoad *)e->data;
  PetscInt *cells = NULL;

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(space, &e->on, SB_ON_CELLS, &load->nitem, &cells));
  PetscCall(PetscMalloc1(4 * load->nitem, &load->corner));
  for (PetscInt i = 0; i < 4 * load->nitem; i++)
    load->corner[i] = 4 * cells[i / 4] + i % 4;
  PetscCall(PetscFree(cells));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* traction: the corners of the facets; a total force becomes one per area. */
static PetscErrorCode list_facets(SbEffect e, SbSpace space)
{
  DeadLoad *load = (DeadLoad *)e->data;
  SbFacet *facets = NULL;
  PetscReal area = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &load->nitem, &facets));
  PetscCall(PetscMalloc1(3 * load->nitem, &load->corner));
  for (PetscInt i = 0; i < load->nitem; i++) {
    for (PetscInt a = 0; a < 3; a++)
      load->corner[3 * i + a] = 4 * facets[i].cell + facets[i].corner[a];
    if (facets[i].cell < space->mesh->ncell_owned)
      area += facets[i].area;
  }
  PetscCall(PetscFree(facets));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &area, 1, MPIU_REAL, MPI_SUM, space->comm));
  for (int i = 0; i < 3; i++)
    load->uniform[i] /= area;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* point_force: each corner of a tet that is one of the vertices. */
static PetscErrorCode list_vertices(SbEffect e, SbSpace space)
{
  DeadLoad *load = (DeadLoad *)e->data;
  const SbMesh mesh = space->mesh;
  PetscInt *vertices = NULL;
  PetscInt n;
  PetscInt size = 0;
  PetscReal count = 0; /* of the vertices on all ranks */

  PetscFunctionBeginUser;
  PetscCall(SbEffectItems(space, &e->on, SB_ON_VERTICES, &n, &vertices));
  for (PetscInt i = 0; i < n; i++)
    count += vertices[i] < mesh->nvert_owned;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_REAL, MPI_SUM, space->comm));
  PetscCall(PetscCalloc1(mesh->nvert, &load->around));
  for (PetscInt i = 0; i < 4 * mesh->ncell; i++) {
    PetscInt at;

    PetscCall(PetscFindInt(mesh->cell[i], n, vertices, &at));
    if (at < 0)
      continue;
    PetscCall(SbReserve(load->nitem + 1, sizeof(*load->corner), &size, &load->corner));
    load->corner[load->nitem++] = i;
    load->around[mesh->cell[i]] += SbTetDeterminant(mesh->x, mesh->cell + 4 * (i / 4));
  }
  for (PetscInt v = 0; v < mesh->nvert; v++)
    load->around[v] *= count;
  PetscCall(PetscFree(vertices));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbPointRule at_vertex = {.n = 1, .L = {{1}}, .weight = {1}};
static const Domain tets = {4, &SbRuleQuintic, list_tets};
static const Domain facets = {3, &SbRuleFacet, list_facets};
static const Domain vertices = {1, &at_vertex, list_vertices};

static PetscErrorCode options_body_force(SbEffect e, const SbScope *scope)
{
  DeadLoad *load = (DeadLoad *)e->data;

  PetscFunctionBeginUser;
  load->on = &tets;
  PetscCall(SbEffectFormulas(e, scope, "density", 3, PETSC_TRUE, load->density));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_traction(SbEffect e, const SbScope *scope)
{
  DeadLoad *load = (DeadLoad *)e->data;
  PetscBool vector, total;

  PetscFunctionBeginUser;
  load->on = &facets;
  PetscCall(SbOptionGiven(scope, "vector", &vector));
  PetscCall(SbOptionGiven(scope, "total", &total));
  PetscCheck(vector || total, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "effect %s: give -effect_%s_vector (Pa, three formulas) or -effect_%s_total (N, "
             "three numbers)",
             e->name, e->name, e->name);
  PetscCall(SbEffectFormulas(e, scope, "vector", 3, PETSC_TRUE, load->density));
  PetscCall(SbOptionReals(scope, "total", load->uniform));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode options_point_force(SbEffect e, const SbScope *scope)
{
  DeadLoad *load = (DeadLoad *)e->data;

  PetscFunctionBeginUser;
  load->on = &vertices;
  PetscCall(SbEffectFormulas(e, scope, "vector", 3, PETSC_FALSE, load->density));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Volume or area of a simplex with these edges from its first corner; 1 for a vertex. */
static PetscReal measure_of(PetscInt ncorner, const PetscReal e[3][3])
{
  PetscReal normal[3];

  if (ncorner == 1)
    return 1;
  SbCross(e[0], e[1], normal);
  if (ncorner == 3)
    return PetscSqrtReal(SbDot3(normal, normal)) / 2;
  return PetscAbsReal(SbDot3(normal, e[2])) / 6;
}

/* value = the load at time t. */
static PetscErrorCode integrate(DeadLoad *load, SbSpace space, PetscReal t)
{
  const SbMesh mesh = space->mesh;
  const PetscInt nc = load->on->ncorner;
  const SbPointRule *rule = load->on->rule;

  PetscFunctionBeginUser;
  load->t = t;
  for (PetscInt i = 0; i < 3 * space->nnode; i++)
    load->value[i] = 0;
  for (PetscInt item = 0; item < load->nitem; item++) {
    const PetscInt *corner = &load->corner[nc * item];
    const PetscInt cell = corner[0] / 4;
    PetscReal e[3][3] = {{0}};
    PetscReal part = 1;

    // the part of a vertex's force that goes to this cell
    if (load->around)
      part = SbTetDeterminant(mesh->x, mesh->cell + 4 * cell) / load->around[mesh->cell[corner[0]]];

    for (int k = 0; k < rule->n; k++) {
      PetscReal L[4] = {0};
      PetscReal phi[SB_CELL_NODES], p[3], q[3], x[4][3], measure;
      PetscInt n;

      for (PetscInt c = 0; c < nc; c++)
        L[corner[c] % 4] = rule->L[k][c];
      n = SbEffectPoint(space, cell, L, phi, p, x);

      // volume or area of the simplex with the derivatives of the map at the point
      for (PetscInt c = 1; c < nc; c++)
        SbSubtract(x[corner[c] % 4], x[corner[0] % 4], e[c - 1]);
      measure = part * measure_of(nc, (const PetscReal(*)[3])e);

      // the load there, spread over the nodes
      for (int i = 0; i < 3; i++) {
        PetscCall(SbFormulaEval(load->density[i], t, p, &q[i]));
        q[i] = measure * rule->weight[k] * (q[i] + load->uniform[i]);
      }
      for (PetscInt a = 0; a < 3 * n; a++)
        load->value[3 * SbSpaceCellNode(space, cell, a / 3) + a % 3] += phi[a / 3] * q[a % 3];
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_deadload(SbEffect e, SbSpace space)
{
  DeadLoad *load = (DeadLoad *)e->data;
  PetscBool steady = PETSC_TRUE;
  PetscBool *touched;

  PetscFunctionBeginUser;
  PetscCall((*load->on->list)(e, space));

  // the owned nodes of these cells: a load on few costs little in a large mesh
  PetscCall(PetscCalloc1(space->nnode, &touched));
  for (PetscInt i = 0; i < load->nitem; i++) {
    const PetscInt cell = load->corner[load->on->ncorner * i] / 4;
    const PetscInt n = SbSpaceCellElement(space, cell)->nodes_per[1] ? SB_CELL_NODES : 4;

    for (PetscInt a = 0; a < n; a++)
      touched[SbSpaceCellNode(space, cell, a)] = PETSC_TRUE;
  }
  for (PetscInt i = 0; i < space->nnode_owned; i++)
    load->n += touched[i];
  PetscCall(PetscMalloc1(load->n, &load->node));
  for (PetscInt i = space->nnode_owned - 1, k = load->n; i >= 0; i--)
    if (touched[i])
      load->node[--k] = i;
  PetscCall(PetscFree(touched));

  // a steady load is integrated once
  PetscCall(PetscMalloc1(3 * space->nnode, &load->value));
  PetscCall(integrate(load, space, 0));
  for (int i = 0; i < 3; i++)
    steady = (PetscBool)(steady && !SbFormulaUses(load->density[i], 't'));
  if (steady)
    PetscCall(PetscFree(load->corner));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode force_deadload(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  DeadLoad *load = (DeadLoad *)e->data;
  PetscReal s;

  PetscFunctionBeginUser;
  PetscCall(SbFormulaEval(e->time, stage->t, NULL, &s));
  if (load->corner && stage->t != load->t)
    PetscCall(integrate(load, space, stage->t));
  for (PetscInt i = 0; i < load->n; i++) {
    const PetscInt node = 3 * load->node[i];

    for (int c = 0; c < 3; c++)
      f[node + c] += s * load->value[node + c];
  }
  PetscCall(PetscLogFlops(6.0 * (PetscLogDouble)load->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_deadload(SbEffect e)
{
  DeadLoad *load = (DeadLoad *)e->data;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(load->corner));
  PetscCall(PetscFree(load->around));
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

const SbEffectType SbEffectPointForce = {
  .name = "point_force",
  .size = sizeof(DeadLoad),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(point_force_rows),
  .row = point_force_rows,
  .ops = {.setfromoptions = options_point_force,
          .setup = setup_deadload,
          .force = force_deadload,
          .destroy = destroy_deadload},
};
