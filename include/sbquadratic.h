/*
  sbquadratic.h - layer 0: tets with ten nodes, at corners and edges: basis, map, rules. Not
  collective.
*/
#pragma once
#include "sbbase.h"

#define SB_CELL_NODES 10 /* of a cell at most: P2 has them at its vertices, then at its edges */
/* Vertices of the edges of a cell: P2's node 4 + e is at the middle of edge e. */
static const int SbTetEdge[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

/* Points by their barycentric coordinates, with their parts of the volume. */
#define SB_POINTS 14 /* of a rule at most */
typedef struct {
  int n;
  PetscReal L[SB_POINTS][4], weight[SB_POINTS];
} SbPointRule;
extern const SbPointRule SbRuleQuintic; /* degree 5, positive weights: stresses of curved tets */
extern const SbPointRule SbRuleFacet;   /* degree 5 on a triangle, L[3] (Radon 1948) */
/* The ten basis functions at L. */
void SbQuadraticBasis(const PetscReal L[4], PetscReal phi[SB_CELL_NODES]);
/* Corners of the P1 tet with the derivatives of the map x of ten nodes at L, but for a
   translation. */
void SbQuadraticCorners(const PetscReal L[4], const PetscReal x[SB_CELL_NODES][3],
                        PetscReal corner[4][3]);
