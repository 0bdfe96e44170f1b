/*
  facet_point.h - points of facets with the derivatives of their maps, for effects whose forces
  depend on how a facet moves: pressure.c, membrane.c, water.c.
*/
#pragma once
#include "effect_impl.h"

/* A point of a facet: basis of the cell, and coefficients of its nodes in the corners x0, x1, x2
   there. */
typedef struct {
  PetscInt n, node[SB_CELL_NODES]; /* nodes of the cell */
  PetscReal weight; /* of the integral, times half, the area of the triangle of the coordinates */
  PetscReal phi[SB_CELL_NODES];
  PetscReal along[2][SB_CELL_NODES]; /* derivatives phi,X and phi,Y */
} FacetPoint;

/* Points of a facet: the last one of SbRuleFacet, its centre, for linear elements, all of them for
   P2. */
static inline int first_point(SbSpace space, const SbFacet *facet)
{
  return SbSpaceCellElement(space, facet->cell)->nodes_per[1] ? 0 : SbRuleFacet.n - 1;
}

/* The point with the barycentric coordinates at[3] in the facet; the weight is the caller's. */
static inline void facet_point_at(SbSpace space, const SbFacet *facet, const PetscReal at[3],
                                  FacetPoint *p)
{
  const PetscInt *v = facet->corner;
  PetscReal L[4] = {0};
  PetscReal corner[3][SB_CELL_NODES];

  for (int c = 0; c < 3; c++)
    L[v[c]] = at[c];
  p->n = SbCellBasis(space, facet->cell, L, p->phi);
  for (int a = 0; a < p->n; a++) {
    p->node[a] = SbSpaceCellNode(space, facet->cell, a);
    for (int c = 0; c < 3; c++) {
      if (p->n == 4)
        corner[c][a] = SbSpaceCornerBasis(space, facet->cell, v[c])[a];
      else if (a < 4)
        corner[c][a] = a == v[c] ? 4 * L[a] - 1 : 0;
      else
        corner[c][a] = 4 * ((SbTetEdge[a - 4][0] == v[c]) * L[SbTetEdge[a - 4][1]] +
                            (SbTetEdge[a - 4][1] == v[c]) * L[SbTetEdge[a - 4][0]]);
    }
    for (int k = 0; k < 2; k++)
      p->along[k][a] = corner[k + 1][a] - corner[0][a];
  }
}

static inline void facet_point(SbSpace space, const SbFacet *facet, int q, FacetPoint *p)
{
  facet_point_at(space, facet, SbRuleFacet.L[q], p);
  p->weight = p->n == 4 ? 0.5 : 0.5 * SbRuleFacet.weight[q];
}

/* side += the derivatives of a field w[nnode][3] there; NULL: none. */
static inline void add_sides(const FacetPoint *p, const PetscReal w[], PetscReal side[2][3])
{
  for (int a = 0; w && a < p->n; a++)
    for (int k = 0; k < 6; k++)
      side[k / 3][k % 3] += p->along[k / 3][a] * w[3 * p->node[a] + k % 3];
}
