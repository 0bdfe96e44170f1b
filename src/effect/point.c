/*
  point.c - a point of a quadrature rule in a cell or its facet at rest: basis functions, place, and
  the derivatives of the cell's map there.
*/
#include "effect_impl.h"
#include "sbgeometry.h"

PetscInt SbEffectPoint(SbSpace space, PetscInt cell, const PetscReal L[4],
                       PetscReal phi[SB_CELL_NODES], PetscReal x[3], PetscReal corner[4][3])
{
  const SbMesh mesh = space->mesh;
  const PetscInt n = SbCellBasis(space, cell, L, phi);

  for (int k = 0; k < 3; k++)
    x[k] = 0;
  for (PetscInt a = 0; a < 3 * n; a++)
    x[a % 3] += phi[a / 3] * space->node_x[3 * SbSpaceCellNode(space, cell, a / 3) + a % 3];
  for (int k = 0; k < 12; k++)
    corner[k / 3][k % 3] = mesh->x[3 * mesh->cell[4 * cell + k / 3] + k % 3];
  if (mesh->cell_set[cell] & SB_CURVED) {
    PetscReal nodes[SB_CELL_NODES][3];

    SbSpaceCellPositions(space, cell, nodes);
    SbQuadraticCorners(L, (const PetscReal(*)[3])nodes, corner);
  }
  return n;
}
