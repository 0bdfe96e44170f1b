/*
  deadload.c - a force per volume or area integrated against the basis functions.

  f_a = integral of psi_a q(X, t) over each cell (or facet), at the rest position. With the barycentric coordinates b_c
  of the corners c one loop serves tetrahedra and triangles:

    l_c += |T| sum_k w_k b_kc q(sum_d b_kd X_d, t),   f_a = sum_c psi_a(X_c) l_c,

  psi_a the basis of the element, of which b_c are the combinations (for P1 they are the same). P2's own basis b_c (2 b_c - 1), 4 b_c b_d is
  integrated as it is, with one function for each corner and each edge between corners. Of a curved cell |T| is that of the tet (or
  triangle) with the derivatives of its map at the point, and X that of the map.

  Rules, both with positive weights, inner points and degree 5, hence exact for q of degree 4: SbRuleQuintic (Walkington, "Quadrature on simplices
  of arbitrary dimension", 2000), SbRuleFacet (Radon 1948; Stroud, "Approximate calculation of multiple integrals", 1971, T2:5-1). Second-order
  convergence of linear elements needs degree 2; the rest lowers the constant at no cost, because a load that
  does not change is integrated once.

  Sums are kept in a list of the nodes touched, not in a field over the whole body.
*/
#include "effect_impl.h"

struct _p_SbDeadLoad {
  PetscInt ncorner, nitem;
  PetscInt *corner; /* [nitem][ncorner] 4 cell + vertex of the cell; NULL once a steady load was integrated */
  PetscInt nslot;   /* nodes of a cell, at most: 4, or 10 with a P2 body */
  PetscInt *slot;   /* [nitem][nslot] index into node of the cell's nodes, -1: not touched; NULL likewise */
  SbSpace space;    /* borrowed */
  PetscInt n, nowned;
  PetscInt *node;       /* [n] local nodes, ascending, so owned ones first */
  PetscReal *value;     /* [n][3] N */
  PetscReal t;          /* s, of value */
  SbFormula density[3]; /* borrowed */
};

/* Volume of a tetrahedron or area of a triangle from its corners, m^3 or m^2. */
static PetscReal simplex_measure(PetscInt ncorner, const PetscReal *const x[4])
{
  PetscReal e[3][3] = {{0}}, n[3];

  for (PetscInt c = 1; c < ncorner; c++) {
    for (int i = 0; i < 3; i++) e[c - 1][i] = x[c][i] - x[0][i];
  }
  n[0] = e[0][1] * e[1][2] - e[0][2] * e[1][1];
  n[1] = e[0][2] * e[1][0] - e[0][0] * e[1][2];
  n[2] = e[0][0] * e[1][1] - e[0][1] * e[1][0];
  if (ncorner == 3) return 0.5 * PetscSqrtReal(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  return PetscAbsReal(n[0] * e[2][0] + n[1] * e[2][1] + n[2] * e[2][2]) / 6;
}

/* value = the load at time t. */
static void integrate(SbDeadLoad load, PetscReal t)
{
  const PetscInt nc = load->ncorner;
  const SbPointRule *rule = nc == 4 ? &SbRuleQuintic : &SbRuleFacet;

  for (PetscInt i = 0; i < 3 * load->n; i++) load->value[i] = 0;
  for (PetscInt item = 0; item < load->nitem; item++) {
    const PetscInt *corner = &load->corner[nc * item];
    const SbElement element = SbSpaceCellElement(load->space, corner[0] / 4);
    const SbElementOps *e = &element->ops;
    const SbMesh mesh = load->space->mesh;
    const PetscBool quadratic = (PetscBool)(element->nodes_per[1] > 0),
                    curved = (PetscBool)(mesh->cell_set[corner[0] / 4] & SB_CURVED);
    PetscReal l[SB_CELL_NODES][3], nodes[SB_CELL_NODES][3], corners[4][3], measure;
    const PetscReal *x[4];

    /* l of one item: what its barycentric coordinates receive, [ncorner]; quadratic: its nodes of P2, [10], as the cell numbers them. */
    for (int k = 0; k < 3 * SB_CELL_NODES; k++) l[k / 3][k % 3] = 0;
    for (PetscInt c = 0; c < nc; c++) x[c] = &mesh->x[3 * mesh->cell[corner[c]]];
    measure = simplex_measure(nc, x);
    if (curved) SbSpaceCellPositions(load->space, corner[0] / 4, nodes);
    for (int k = 0; k < rule->n; k++) {
      const PetscReal *b = rule->L[k];
      PetscReal p[3] = {0, 0, 0}, q[3], L[4] = {0, 0, 0, 0}, phi[SB_CELL_NODES];

      for (PetscInt c = 0; c < nc; c++) L[corner[c] % 4] = b[c];
      if (quadratic) SbQuadraticBasis(L, phi);
      if (curved) {
        SbQuadraticCorners(L, (const PetscReal(*)[3])nodes, corners);
        for (PetscInt c = 0; c < nc; c++) x[c] = corners[corner[c] % 4];
        measure = simplex_measure(nc, x);
        for (int n = 0; n < 3 * SB_CELL_NODES; n++) p[n % 3] += phi[n / 3] * nodes[n / 3][n % 3];
      }
      for (PetscInt c = 0; c < nc && !curved; c++) {
        for (int i = 0; i < 3; i++) p[i] += b[c] * x[c][i];
      }
      for (int i = 0; i < 3; i++) q[i] = measure * rule->weight[k] * SbFormulaEval(load->density[i], t, p);
      for (PetscInt c = 0; c < nc && !quadratic; c++) {
        for (int i = 0; i < 3; i++) l[c][i] += b[c] * q[i];
      }
      for (int n = 0; n < 3 * SB_CELL_NODES && quadratic; n++) l[n / 3][n % 3] += phi[n / 3] * q[n % 3];
    }
    for (PetscInt a = 0; a < load->nslot; a++) {
      const PetscInt slot = load->slot[load->nslot * item + a];

      for (int i = 0; quadratic && slot >= 0 && i < 3; i++) load->value[3 * slot + i] += l[a][i];
      for (PetscInt c = 0; !quadratic && slot >= 0 && c < nc; c++) {
        for (int i = 0; i < 3; i++) load->value[3 * slot + i] += e->vertex[corner[c] % 4][a] * l[c][i];
      }
    }
  }
  load->t = t;
}

/* The nodes touched, ascending, and where each cell finds its own. */
static PetscErrorCode find_nodes(SbDeadLoad load)
{
  const SbSpace space = load->space;
  PetscInt *at;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(space->nnode, &at));
  load->nslot = space->edge_node ? SB_CELL_NODES : 4;
  PetscCall(PetscMalloc1(load->nslot * load->nitem, &load->slot));
  for (PetscInt k = 0; k < load->nslot * load->nitem; k++) {
    const PetscInt *corner = &load->corner[load->ncorner * (k / load->nslot)], cell = corner[0] / 4,
                   a = k % load->nslot;
    const SbElement element = SbSpaceCellElement(space, cell);
    int ends = 0;

    load->slot[k] = -1;
    for (PetscInt c = 0; c < load->ncorner; c++) {
      if (a < 4 && element->ops.vertex[corner[c] % 4][a] != 0)
        load->slot[k] = SbSpaceCellNode(space, cell, a);
      if (a >= 4) ends += corner[c] % 4 == SbTetEdge[a - 4][0] || corner[c] % 4 == SbTetEdge[a - 4][1];
    }
    if (ends == 2 && element->nodes_per[1]) load->slot[k] = SbSpaceCellNode(space, cell, a);
    if (load->slot[k] >= 0) at[load->slot[k]] = 1;
  }
  for (PetscInt i = 0; i < space->nnode; i++) load->n += at[i];
  PetscCall(PetscMalloc2(load->n, &load->node, 3 * load->n, &load->value));
  load->n = 0;
  for (PetscInt i = 0; i < space->nnode; i++) {
    if (!at[i]) continue;
    at[i] = load->n;
    load->node[load->n++] = i;
    if (i < space->nnode_owned) load->nowned = load->n;
  }
  for (PetscInt k = 0; k < load->nslot * load->nitem; k++) {
    if (load->slot[k] >= 0) load->slot[k] = at[load->slot[k]];
  }
  PetscCall(PetscFree(at));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeadLoadCreate(SbSpace space, PetscInt ncorner, PetscInt nitem, const PetscInt corner[],
                                const SbFormula density[3], SbDeadLoad *deadload)
{
  SbDeadLoad load;
  PetscBool steady = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&load));
  load->ncorner = ncorner;
  load->nitem = nitem;
  load->space = space;
  for (int i = 0; i < 3; i++) {
    load->density[i] = density[i];
    if (SbFormulaUsesTime(density[i])) steady = PETSC_FALSE;
  }
  PetscCall(PetscMalloc1(ncorner * nitem, &load->corner));
  PetscCall(PetscArraycpy(load->corner, corner, ncorner * nitem));
  PetscCall(find_nodes(load));
  integrate(load, 0);
  if (steady) {
    load->nitem = 0;
    PetscCall(PetscFree(load->corner));
    PetscCall(PetscFree(load->slot));
  }
  *deadload = load;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeadLoadAdd(SbDeadLoad load, PetscReal t, PetscReal factor, PetscReal f[])
{
  PetscFunctionBeginUser;
  if (load->nitem && t != load->t) integrate(load, t);
  for (PetscInt i = 0; i < load->nowned; i++) {
    PetscReal *fi = &f[3 * load->node[i]];

    for (int c = 0; c < 3; c++) fi[c] += factor * load->value[3 * i + c];
  }
  PetscCall(PetscLogFlops(6.0 * (PetscLogDouble)load->nowned));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbDeadLoadDestroy(SbDeadLoad *load)
{
  PetscFunctionBeginUser;
  if (!*load) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscFree((*load)->corner));
  PetscCall(PetscFree((*load)->slot));
  PetscCall(PetscFree2((*load)->node, (*load)->value));
  PetscCall(PetscFree(*load));
  PetscFunctionReturn(PETSC_SUCCESS);
}
