/*
  pressure.c - a pressure on part of the surface, positive in compression.

  On a facet with current corners x0, x1, x2, counter-clockwise seen from outside, N = (x1 - x0) x (x2 - x0)
  is twice the outward area vector, and each corner receives

    f_a = -p/6 N,   p = value(t) time(t).

  On a closed surface this is -p dV/dx_a, V the enclosed volume: total force and moment vanish and the work is
  -p times the change of volume.

  Tangent: with the opposite edges c_b = x_{b+1} - x_{b+2} (indices modulo 3), dN/dx_b w = w x c_b, so
  df_a/dx_b = p/6 [c_b]x, where [c]x w = c x w. It is not symmetric facet by facet; what the facets add to the
  matrix here is the symmetric part, the blocks p/12 [c_b - c_a]x. On a closed surface, or one whose rim is
  constrained, the other part cancels and the tangent is the exact derivative (Bufler, "Pressure loaded structures
  under large deformations", 1984). What is left of it is an integral along the rim R, counter-clockwise,

    -df_a = -p/2 int_R phi_a dx x w.

  Where the rim is free the operator of the linear solver applies it, and the matrix is the preconditioner. Without it Newton's method
  converges linearly, and not at all for large rotations.

  The facets of CR and DG bodies do not meet at their edges, so that forces facet by facet do not quite add up to
  zero. Where the pressure acts on the whole surface of such a body, it is taken as -p dV/du of the volume inside
  (src/fem/body_volume.c): at rest that is the same, and force and moment vanish for every displacement. On part of the
  surface small gaps remain, which vanish with mesh refinement. There contributions of facets do not cancel: with CR the force acts at the facet's own
  node, while N depends on the other three of the cell, so the derivative is far from symmetric.
  Newton's method with its symmetric part stalls near p = mu. So the operator of the linear solver applies the derivative
  exactly, facet by facet, dN = sum_b w_b x c_b, and the matrix, without it, is the preconditioner.

  A facet of P2 has six nodes and is curved once it moves. With X, Y its derivatives along two of its barycentric coordinates, and phi_a its basis,

    f_a = -p int phi_a X x Y,   symmetric part of -df_a/dx_b: p/2 int (phi_a phi_b,Y - phi_b phi_a,Y) [X]x - (phi_a phi_b,X - phi_b phi_a,X) [Y]x,

  integrated by a rule of degree 5 (polynomials of degree 4).

  With follower = no the pressure acts on the rest area and normal, as small-strain theory has it; then there
  is no tangent.
*/
#include "effect_impl.h"
#include "sbgeometry.h"

#define STRAIGHT 1e-9 /* relative: components of an edge below which it has none, as in a plane of symmetry */

/* An edge of the free rim of the surface under pressure: nodes from, to, and between them (-1: none, it is straight). The
   surface lies to the left, seen from outside. */
typedef struct {
  PetscInt node[3];
} RimEdge;

typedef struct {
  SbFormula value;
  PetscBool follower;
  PetscInt nfacet, nedge;
  SbFacet *facet;   /* [nfacet] of owned and ghost cells */
  RimEdge *rim;     /* [nedge] of P1 and P2, with an owned node */
  PetscBool *whole; /* [nbody] pressure on the whole body, by its volume: its facets are not in the list */
} Pressure;

static const SbOption rows[] = {
  {"on", SB_OPTION_NAMES, 1, "", NULL, "", "sets whose boundary facets are under pressure"},
  {"value", SB_OPTION_FORMULA, 1, "Pa", NULL, "",
   "pressure, a formula of the time t; positive is compressive"},
  {"follower", SB_OPTION_BOOL, 1, "", "true", "",
   "follower load, on the current area and normal; if not, a dead load on those of the reference "
   "configuration"},
  {"time", SB_OPTION_FORMULA, 1, "", "1", "", "amplitude: factor on the pressure, a formula of the time t"},
};

static PetscErrorCode options_pressure(SbEffect e, const SbScope *scope)
{
  Pressure *p = (Pressure *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFormulas(scope, "value", 1, PETSC_FALSE, &p->value, &e->steady));
  PetscCall(SbOptionBool(scope, "follower", &p->follower));
  if (p->follower)
    e->linear = PETSC_FALSE;
  else {
    e->ops.tangent = NULL;
    e->ops.nonsymmetric = NULL;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool quadratic(SbSpace space, const SbFacet *facet)
{
  return (PetscBool)(SbSpaceCellElement(space, facet->cell)->nodes_per[1] > 0);
}

/* The nodes of a P2 facet in their cell. */
static void facet_nodes(const SbFacet *facet, int node[6])
{
  for (int c = 0; c < 3; c++) {
    const int a = (int)facet->corner[c], b = (int)facet->corner[(c + 1) % 3];

    node[c] = a;
    node[3 + c] = 4;
    for (int e = 0; e < 6; e++) {
      if (SbTetEdge[e][0] == PetscMin(a, b) && SbTetEdge[e][1] == PetscMax(a, b)) node[3 + c] = 4 + e;
    }
  }
}

/* Side c of a facet of P1 or P2. */
static RimEdge side_of(SbSpace space, const SbFacet *facet, PetscInt c)
{
  RimEdge e = {{SbSpaceCellNode(space, facet->cell, facet->corner[c]),
                SbSpaceCellNode(space, facet->cell, facet->corner[(c + 1) % 3]), -1}};
  int node[6];

  if (quadratic(space, facet)) {
    facet_nodes(facet, node);
    e.node[2] = SbSpaceCellNode(space, facet->cell, node[3 + c]);
  }
  return e;
}

/* Whether the tangent has a part along the edge, not eliminated by supports. */
static PetscBool is_free(SbSpace space, const RimEdge *edge)
{
  const PetscInt n = edge->node[2] < 0 ? 2 : 3;
  PetscReal e[3], longest = 0;

  for (int i = 0; i < 3; i++) {
    e[i] = space->node_x[3 * edge->node[1] + i] - space->node_x[3 * edge->node[0] + i];
    longest = PetscMax(longest, PetscAbsReal(e[i]));
  }
  for (PetscInt a = 0; a < n; a++) {
    for (PetscInt b = 0; b < n; b++) {
      for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        const uint8_t row = space->fixed[edge->node[a]], column = space->fixed[edge->node[b]];

        /* e_k couples components i and j */
        if (PetscAbsReal(e[k]) > STRAIGHT * longest && !(row >> i & 1) && !(column >> j & 1))
          return PETSC_TRUE;
      }
    }
  }
  return PETSC_FALSE;
}

/* The free rim of the facets of P1 and P2: edges that facets go along one way more often than the other. */
static PetscErrorCode find_rim(Pressure *p, SbSpace space)
{
  PetscInt n = 0;
  SbKey *edge; /* slot 3 facet + side */

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(3 * p->nfacet, &edge));
  for (PetscInt i = 0; i < 3 * p->nfacet; i++) {
    RimEdge e;

    if (!SbSpaceCellElement(space, p->facet[i / 3].cell)->nodes_per[0]) continue;
    e = side_of(space, &p->facet[i / 3], i % 3);
    edge[n++] = (SbKey){SbKeyOfPair(e.node[0], e.node[1]), i};
  }
  SbKeysSort(n, edge);
  PetscCall(PetscMalloc1(n, &p->rim));
  for (PetscInt i = 0, m; i < n; i += m) {
    PetscInt ways[2] = {0, 0}; /* from the lower node to the higher one, and back */
    RimEdge e[2] = {{{0}}};
    PetscBool owned = PETSC_FALSE;

    m = SbKeysAlike(n, edge, i);
    for (PetscInt k = i; k < i + m; k++) {
      const RimEdge side = side_of(space, &p->facet[edge[k].slot / 3], edge[k].slot % 3);
      const int back = side.node[0] > side.node[1];

      e[back] = side;
      ways[back]++;
    }
    if (ways[0] == ways[1]) continue;
    /* all facets of an edge with an owned node are here */
    e[0] = e[ways[1] > ways[0]];
    for (int a = 0; a < 3; a++)
      owned = (PetscBool)(owned || (e[0].node[a] >= 0 && e[0].node[a] < space->nnode_owned));
    if (owned && is_free(space, &e[0])) p->rim[p->nedge++] = e[0];
  }
  PetscCall(PetscFree(edge));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode setup_pressure(SbEffect e, SbSpace space)
{
  Pressure *p = (Pressure *)e->data;
  PetscBool some = PETSC_FALSE;
  const SbMesh mesh = space->mesh;
  PetscInt *count, n = 0;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, &e->on, &p->nfacet, &p->facet));
  PetscCall(PetscCalloc1(mesh->nbody, &p->whole));
  PetscCall(PetscCalloc1(mesh->nbody, &count));
  /* bodies with nodes at faces whose every boundary facet is in the list: their facets leave it */
  for (PetscInt k = 0; k < p->nfacet; k++)
    count[mesh->cell_body[p->facet[k].cell]] += p->facet[k].cell < mesh->ncell_owned;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, (PetscMPIInt)mesh->nbody, MPIU_INT, MPI_SUM, space->comm));
  for (PetscInt b = 0; b < mesh->nbody; b++)
    p->whole[b] =
      (PetscBool)(p->follower && !space->element[b]->nodes_per[0] && count[b] == mesh->body[b].nfacet);
  for (PetscInt k = 0; k < p->nfacet; k++) {
    if (!p->whole[mesh->cell_body[p->facet[k].cell]]) p->facet[n++] = p->facet[k];
  }
  p->nfacet = n;
  PetscCall(PetscFree(count));
  if (p->follower && !(e->steady && SbFormulaEval(p->value, 0, NULL) == 0)) PetscCall(find_rim(p, space));
  /* the remainder of bodies with nodes at faces, and free rims */
  some = (PetscBool)(p->nedge > 0);
  for (PetscInt k = 0; k < p->nfacet && !some; k++)
    some = (PetscBool)!SbSpaceCellElement(space, p->facet[k].cell)->nodes_per[0];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &some, 1, SB_MPI_BOOL, MPI_LOR, space->comm));
  if (!some) e->ops.nonsymmetric = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corners of a facet, one per row, m: at rest when u is NULL, else where they are now. */
static inline void corners(SbSpace space, const SbFacet *facet, const PetscReal u[], PetscReal x[3][3])
{
  const SbElementOps *e = &SbSpaceCellElement(space, facet->cell)->ops;
  const PetscInt *node = space->cell_node + 4 * facet->cell;

  for (int k = 0; k < 3; k++) {
    for (int i = 0; i < 3; i++) x[k][i] = space->mesh->x[3 * facet->vertex[k] + i];
    for (int a = 0; u && a < 4; a++) {
      for (int i = 0; i < 3; i++) x[k][i] += e->vertex[facet->corner[k]][a] * u[3 * node[a] + i];
    }
  }
}

/* f += factor N at each corner. */
static inline void add_to_corners(SbSpace space, const SbFacet *facet, PetscReal factor, const PetscReal N[3],
                                  PetscReal f[])
{
  const SbElementOps *e = &SbSpaceCellElement(space, facet->cell)->ops;

  for (int a = 0; a < 4; a++) {
    const PetscInt node = space->cell_node[4 * facet->cell + a];
    PetscReal share = 0;

    for (int c = 0; c < 3; c++) share += e->vertex[facet->corner[c]][a];
    for (int i = 0; i < 3; i++) f[3 * node + i] += share * factor * N[i];
  }
}

/* SbRuleFacet: where a facet of P2 is integrated, with values and derivatives of its basis. */
#define NPOINT 7
typedef struct {
  PetscReal weight;              /* times half, the area of the triangle of the coordinates */
  PetscReal phi[6], along[2][6]; /* at the corners, then between corners 01, 12, 20 */
} FacetPoint;

static void facet_points(FacetPoint point[NPOINT])
{
  for (int n = 0; n < NPOINT; n++) {
    const PetscReal *L = SbRuleFacet.L[n];
    FacetPoint *p = &point[n];

    p->weight = 0.5 * SbRuleFacet.weight[n];
    for (int c = 0; c < 3; c++) {
      const int d = (c + 1) % 3;

      p->phi[c] = L[c] * (2 * L[c] - 1);
      p->phi[3 + c] = 4 * L[c] * L[d];
      /* along the edges from corner 0 to 1, and to 2 */
      for (int k = 0; k < 2; k++) {
        const PetscReal dc = c == 0 ? -1 : c == k + 1, dd = d == 0 ? -1 : d == k + 1;

        p->along[k][c] = (4 * L[c] - 1) * dc;
        p->along[k][3 + c] = 4 * (L[c] * dd + L[d] * dc);
      }
    }
  }
}

/* The derivatives X, Y of a P2 facet at a point. */
static void facet_sides(SbSpace space, const SbFacet *facet, const int node[6], const FacetPoint *point,
                        const PetscReal u[], PetscReal side[2][3])
{
  for (int k = 0; k < 6; k++) side[k / 3][k % 3] = 0;
  for (int a = 0; a < 6; a++) {
    const PetscInt n = SbSpaceCellNode(space, facet->cell, node[a]);

    for (int i = 0; i < 3; i++) {
      const PetscReal x = space->node_x[3 * n + i] + (u ? u[3 * n + i] : 0);

      side[0][i] += point->along[0][a] * x;
      side[1][i] += point->along[1][a] * x;
    }
  }
}

/* [c]x */
static inline void cross_block(const PetscReal c[3], PetscReal block[9])
{
  block[0] = block[4] = block[8] = 0;
  block[1] = -c[2];
  block[2] = c[1];
  block[3] = c[2];
  block[5] = -c[0];
  block[6] = -c[1];
  block[7] = c[0];
}

static PetscErrorCode add_quadratic_tangent(SbSpace space, const SbFacet *facet,
                                            const FacetPoint point[NPOINT], const PetscReal u[], PetscReal p,
                                            Mat A)
{
  PetscReal c[6][6][3] = {{{0}}}, block[9];
  int node[6];

  PetscFunctionBeginUser;
  facet_nodes(facet, node);
  for (int q = 0; q < NPOINT; q++) {
    const FacetPoint *at = &point[q];
    PetscReal side[2][3];

    facet_sides(space, facet, node, at, u, side);
    for (int a = 0; a < 6; a++) {
      for (int b = 0; b < 6; b++) {
        const PetscReal y = at->phi[a] * at->along[1][b] - at->phi[b] * at->along[1][a],
                        x = at->phi[a] * at->along[0][b] - at->phi[b] * at->along[0][a];

        for (int i = 0; i < 3; i++) c[a][b][i] += 0.5 * p * at->weight * (y * side[0][i] - x * side[1][i]);
      }
    }
  }
  for (int a = 0; a < 6; a++) {
    for (int b = 0; b < 6; b++) {
      if (a == b) continue;
      cross_block(c[a][b], block);
      PetscCall(SbSpaceAddCellBlock(space, A, facet->cell, node[a], node[b], block));
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether it does not share edges with other facets (CR, DG): its tangent is applied outside the matrix. */
static inline PetscBool apart(SbSpace space, const SbFacet *facet)
{
  return (PetscBool)!SbSpaceCellElement(space, facet->cell)->nodes_per[0];
}

static PetscErrorCode force_pressure(SbEffect e, SbSpace space, const SbStage *stage, PetscReal f[])
{
  const Pressure *load = (const Pressure *)e->data;
  const PetscReal p = SbFormulaEval(load->value, stage->t, NULL) * SbFormulaEval(e->time, stage->t, NULL);
  const PetscReal *u = load->follower ? stage->u : NULL;
  FacetPoint point[NPOINT];

  PetscFunctionBeginUser;
  facet_points(point);
  for (PetscInt b = 0; b < space->mesh->nbody; b++) {
    if (load->whole[b]) SbSpaceAddVolumeForce(space, b, u, -p, f);
  }
  for (PetscInt k = 0; k < load->nfacet; k++) {
    const SbFacet *facet = &load->facet[k];
    PetscReal x[3][3], d[3], b[3], N[3];

    if (quadratic(space, facet)) {
      int node[6];

      /* f -= p phi_a X x Y */
      facet_nodes(facet, node);
      for (int q = 0; q < NPOINT; q++) {
        PetscReal side[2][3], area[3];

        facet_sides(space, facet, node, &point[q], u, side);
        SbCross(side[0], side[1], area);
        for (int a = 0; a < 6; a++) {
          const PetscInt n = SbSpaceCellNode(space, facet->cell, node[a]);

          for (int i = 0; i < 3; i++) f[3 * n + i] -= p * point[q].weight * point[q].phi[a] * area[i];
        }
      }
      continue;
    }
    corners(space, facet, u, x);
    for (int i = 0; i < 3; i++) {
      d[i] = x[1][i] - x[0][i];
      b[i] = x[2][i] - x[0][i];
    }
    SbCross(d, b, N);
    add_to_corners(space, facet, -p / 6, N, f);
  }
  PetscCall(PetscLogFlops(45.0 * (PetscLogDouble)load->nfacet));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode tangent_pressure(SbEffect e, SbSpace space, const SbStage *stage, Mat A)
{
  const Pressure *load = (const Pressure *)e->data;
  const PetscReal p =
    stage->shift_k * SbFormulaEval(load->value, stage->t, NULL) * SbFormulaEval(e->time, stage->t, NULL);
  FacetPoint point[NPOINT];

  PetscFunctionBeginUser;
  facet_points(point);
  if (p == 0) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt b = 0; b < space->mesh->nbody; b++) {
    if (load->whole[b]) PetscCall(SbSpaceAddVolumeTangent(space, b, stage->u, p, A));
  }
  for (PetscInt k = 0; k < load->nfacet; k++) {
    const SbFacet *facet = &load->facet[k];
    const SbElementOps *element = &SbSpaceCellElement(space, facet->cell)->ops;
    PetscReal x[3][3], c[3][3], block[9];

    if (apart(space, facet)) continue;
    if (quadratic(space, facet)) {
      PetscCall(add_quadratic_tangent(space, facet, point, stage->u, p, A));
      continue;
    }
    corners(space, facet, stage->u, x);
    for (int b = 0; b < 3; b++) {
      for (int i = 0; i < 3; i++) c[b][i] = x[(b + 1) % 3][i] - x[(b + 2) % 3][i];
    }
    /* minus the derivatives between corners, -p/12 [c_l - c_k]x, which the element spreads over its nodes */
    for (int a = 0; a < 4; a++) {
      for (int b = 0; b < 4; b++) {
        PetscReal d[3] = {0, 0, 0};

        for (int q = 0; q < 9; q++) {
          const PetscReal weight =
            element->vertex[facet->corner[q / 3]][a] * element->vertex[facet->corner[q % 3]][b];

          for (int i = 0; i < 3; i++) d[i] -= weight * p / 12 * (c[q % 3][i] - c[q / 3][i]);
        }
        cross_block(d, block);
        if (block[1] == 0 && block[2] == 0 && block[5] == 0) continue;
        PetscCall(SbSpaceAddCellBlock(space, A, facet->cell, a, b, block));
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* y_a -= factor int phi_a dx x w along an edge of the rim, by Gauss' rule of three points: exact for curved ones. */
static void add_rim(SbSpace space, const RimEdge *edge, PetscReal factor, const PetscReal u[],
                    const PetscReal w[], PetscReal y[])
{
  const PetscInt n = edge->node[2] < 0 ? 2 : 3;

  for (int q = -1; q < 2; q++) {
    const PetscReal s = 0.5 + q * 0.5 * PetscSqrtReal(0.6), weight = factor * (q ? 5. : 8.) / 18.;
    const PetscReal straight[2] = {1 - s, s},
                    curved[3] = {(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)},
                    straight_along[2] = {-1, 1}, curved_along[3] = {4 * s - 3, 4 * s - 1, 4 - 8 * s};
    const PetscReal *phi = n == 2 ? straight : curved, *along = n == 2 ? straight_along : curved_along;
    PetscReal dx[3] = {0, 0, 0}, W[3] = {0, 0, 0}, turn[3];

    for (PetscInt a = 0; a < n; a++) {
      for (int i = 0; i < 3; i++) {
        const PetscInt k = 3 * edge->node[a] + i;

        dx[i] += along[a] * (space->node_x[k] + u[k]);
        W[i] += phi[a] * w[k];
      }
    }
    SbCross(dx, W, turn);
    for (PetscInt a = 0; a < n; a++) {
      for (int i = 0; i < 3; i++) y[3 * edge->node[a] + i] -= weight * phi[a] * turn[i];
    }
  }
}

static PetscErrorCode unsymmetric_pressure(SbEffect e, SbSpace space, const SbStage *stage,
                                           const PetscReal x[], PetscReal y[])
{
  const Pressure *load = (const Pressure *)e->data;
  const PetscReal p =
    stage->shift_k * SbFormulaEval(load->value, stage->t, NULL) * SbFormulaEval(e->time, stage->t, NULL);

  PetscFunctionBeginUser;
  for (PetscInt k = 0; k < load->nfacet; k++) {
    const SbFacet *facet = &load->facet[k];
    const PetscInt *node = space->cell_node + 4 * facet->cell;
    PetscReal z[3][3], w[3], c[3], turn[3], dN[3] = {0, 0, 0};

    if (!apart(space, facet)) continue;
    /* dN = sum_b w_b x c_b, w_b the direction at corner b */
    corners(space, facet, stage->u, z);
    for (int b = 0; b < 3; b++) {
      for (int i = 0; i < 3; i++) {
        c[i] = z[(b + 1) % 3][i] - z[(b + 2) % 3][i];
        w[i] = 0;
        for (int a = 0; a < 4; a++)
          w[i] +=
            SbSpaceCellElement(space, facet->cell)->ops.vertex[facet->corner[b]][a] * x[3 * node[a] + i];
      }
      SbCross(w, c, turn);
      for (int i = 0; i < 3; i++) dN[i] += turn[i];
    }
    add_to_corners(space, facet, p / 6, dN, y);
  }
  for (PetscInt k = 0; k < load->nedge; k++) add_rim(space, &load->rim[k], 0.5 * p, stage->u, x, y);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode destroy_pressure(SbEffect e)
{
  Pressure *p = (Pressure *)e->data;

  PetscFunctionBeginUser;
  PetscCall(SbFormulaDestroy(&p->value));
  PetscCall(PetscFree(p->facet));
  PetscCall(PetscFree(p->rim));
  PetscCall(PetscFree(p->whole));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbEffectType SbEffectPressure = {
  .name = "pressure",
  .size = sizeof(Pressure),
  .nrow = PETSC_STATIC_ARRAY_LENGTH(rows),
  .row = rows,
  .ops = {.setfromoptions = options_pressure,
          .setup = setup_pressure,
          .force = force_pressure,
          .tangent = tangent_pressure,
          .nonsymmetric = unsymmetric_pressure,
          .destroy = destroy_pressure},
};
