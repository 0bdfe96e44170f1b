/*
  deadload.c - a force per volume or area integrated against the basis functions.

  f_a = integral of psi_a q(X, t) over each cell (or facet), at the rest position. With the barycentric coordinates b_c
  of the corners c one loop serves tetrahedra and triangles:

    l_c += |T| sum_k w_k b_kc q(sum_d b_kd X_d, t),   f_a = sum_c psi_a(X_c) l_c,

  psi_a the basis of the element, of which b_c are the combinations (for P1 they are the same). P2's own basis b_c (2 b_c - 1), 4 b_c b_d is
  integrated as it is, with one function for each corner and each edge between corners.

  Rules, both with positive weights, inner points and degree 5, hence exact for q of degree 4: 14 points on
  the tetrahedron (Walkington, "Quadrature on simplices of arbitrary dimension", 2000), 7 points on the
  triangle (Radon 1948; Stroud, "Approximate calculation of multiple integrals", 1971, T2:5-1). Second-order
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

#define NPOINT_MAX 14

/* Barycentric points [npoint][4] and weights (sum 1) of the rule for tetrahedra or triangles. */
static PetscInt tabulate_rule(PetscInt ncorner, PetscReal b[NPOINT_MAX][4], PetscReal w[NPOINT_MAX])
{
  const PetscReal s15 = PetscSqrtReal(15.0);
  const PetscReal a4[] = {0.31088591926330060980, 0.092735250310891226402},
                  w4[] = {0.11268792571801585080, 0.073493043116361949544};
  const PetscReal a3[] = {(6 - s15) / 21, (6 + s15) / 21}, w3[] = {(155 - s15) / 1200, (155 + s15) / 1200};
  const PetscReal *a = ncorner == 4 ? a4 : a3, *wa = ncorner == 4 ? w4 : w3;
  PetscInt n = 0;

  // Two orbits with one corner apart.
  for (int orbit = 0; orbit < 2; orbit++) {
    for (PetscInt c = 0; c < ncorner; c++, n++) {
      for (PetscInt d = 0; d < ncorner; d++) b[n][d] = a[orbit];
      b[n][c] = 1 - (PetscReal)(ncorner - 1) * a[orbit];
      w[n] = wa[orbit];
    }
  }
  if (ncorner == 4) {
    // One orbit near the six edges.
    const PetscReal e = 0.045503704125649649492;

    for (int c = 0; c < 4; c++) {
      for (int d = c + 1; d < 4; d++, n++) {
        for (int i = 0; i < 4; i++) b[n][i] = e;
        b[n][c] = b[n][d] = 0.5 - e;
        w[n] = 0.042546020777081466438;
      }
    }
  } else {
    for (int i = 0; i < 3; i++) b[n][i] = 1.0 / 3.0;
    w[n++] = 9.0 / 40.0;
  }
  return n;
}

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
  PetscReal b[NPOINT_MAX][4], w[NPOINT_MAX];
  const PetscInt npoint = tabulate_rule(nc, b, w);

  for (PetscInt i = 0; i < 3 * load->n; i++) load->value[i] = 0;
  for (PetscInt item = 0; item < load->nitem; item++) {
    const PetscInt *corner = &load->corner[nc * item];
    const SbElement element = SbSpaceCellElement(load->space, corner[0] / 4);
    const SbElementOps *e = &element->ops;
    const PetscBool quadratic = (PetscBool)(element->nodes_per[1] > 0);
    PetscReal l[SB_CELL_NODES][3], measure;
    const SbMesh mesh = load->space->mesh;
    const PetscReal *x[4];

    /* l of one item: what its barycentric coordinates receive, [ncorner]; quadratic: its nodes of P2, [10], as the cell numbers them. */
    for (int k = 0; k < 3 * SB_CELL_NODES; k++) l[k / 3][k % 3] = 0;
    for (PetscInt c = 0; c < nc; c++) x[c] = &mesh->x[3 * mesh->cell[corner[c]]];
    measure = simplex_measure(nc, x);
    for (PetscInt k = 0; k < npoint; k++) {
      PetscReal p[3] = {0, 0, 0}, q[3];

      for (PetscInt c = 0; c < nc; c++) {
        for (int i = 0; i < 3; i++) p[i] += b[k][c] * x[c][i];
      }
      for (int i = 0; i < 3; i++) q[i] = measure * w[k] * SbFormulaEval(load->density[i], t, p);
      for (PetscInt c = 0; c < nc && !quadratic; c++) {
        for (int i = 0; i < 3; i++) l[c][i] += b[k][c] * q[i];
      }
      if (quadratic) {
        PetscReal L[4] = {0, 0, 0, 0};

        for (PetscInt c = 0; c < nc; c++) L[corner[c] % 4] = b[k][c];
        for (int a = 0; a < SB_CELL_NODES; a++) {
          const PetscReal phi =
            a < 4 ? L[a] * (2 * L[a] - 1) : 4 * L[SbTetEdge[a - 4][0]] * L[SbTetEdge[a - 4][1]];

          for (int i = 0; i < 3; i++) l[a][i] += phi * q[i];
        }
      }
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
    PetscBool time, position;

    load->density[i] = density[i];
    PetscCall(SbFormulaUses(density[i], &time, &position));
    if (time) steady = PETSC_FALSE;
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
