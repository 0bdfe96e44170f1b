/*
  facing.c - sums over the parts of facets of one surface under those of another one.

  Each facet of the first surface is cut by those of the other one over it, in its own plane, and
  the rule SbRuleFacet taken in each of the triangles, so that sums over plane surfaces are exact on
  both sides. Displacements are taken from the bases of the cells behind the facets, at one and the
  same place.

  A facet may lie inside of the other body by a part of the cells behind both: else the far side of
  a sheet would be held through it.
*/
#include "facing.h"
#include "sbgeometry.h"

#define INSIDE 0.25 /* of the lower cell: how far the surfaces may overlap at rest */

/* A facet of an owned cell. */
static void set_side(SbSpace space, const SbFacet *facet, SbFacing *side)
{
  const SbMesh mesh = space->mesh;
  const PetscInt cell = facet->cell;
  const SbElement element = SbSpaceCellElement(space, cell);

  *side = (SbFacing){.area = facet->area,
                     .height = facet->height,
                     .number = 4 * mesh->cell_orig[cell] + facet->face};
  for (int c = 0; c < 3; c++)
    for (int k = 0; k < 3; k++)
      side->x[c][k] = mesh->x[3 * facet->vertex[c] + k];
  for (int c = 0; c < 3; c++) {
    side->normal[c] = facet->normal[c];
    side->size = PetscMax(side->size, PetscSqrtReal(SbDistance2(side->x[c], side->x[(c + 1) % 3])));
  }
  for (int c = 0; c < 4; c++) {
    for (int k = 0; k < 3; k++)
      side->corner[c][k] = mesh->x[3 * mesh->cell[4 * cell + c] + k];
    for (int a = 0; a < 4 && !element->nodes_per[1]; a++)
      side->basis[c][a] = SbSpaceCornerBasis(space, cell, c)[a];
  }
  side->curved = (PetscBool)((mesh->cell_set[cell] & SB_CURVED) != 0);
  for (int k = 0; k < 18 && side->curved; k++)
    side->off[k] = mesh->edge_off[18 * cell + k];
  if (!element->rigid) {
    const SbMaterial material = space->material[mesh->cell_material[cell]];

    side->young = SbMaterialYoungModulus(material);
    side->wave = SbMaterialWaveModulus(material);
  }
  side->n = element->nodes_per[1] ? SB_CELL_NODES : 4;
  for (PetscInt a = 0; a < side->n; a++)
    side->gnode[a] = space->gnode[SbSpaceCellNode(space, cell, a)];
}

/* The facets of a surface on all ranks. */
PetscErrorCode SbFacingGather(SbSpace space, const SbEffectOn *on, PetscInt *n, SbFacing **side)
{
  SbFacet *facets;
  SbFacing *mine;
  PetscInt nfacet;
  PetscInt nmine = 0;
  MPI_Datatype type;

  PetscFunctionBeginUser;
  PetscCall(SbEffectFacets(space, on, &nfacet, &facets));
  PetscCall(PetscMalloc1(nfacet, &mine));
  for (PetscInt i = 0; i < nfacet; i++)
    if (facets[i].cell < space->mesh->ncell_owned)
      set_side(space, &facets[i], &mine[nmine++]);
  PetscCall(PetscFree(facets));
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(SbFacing), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCall(SbAllgatherv(space->comm, type, nmine, mine, n, side, NULL));
  PetscCallMPI(MPI_Type_free(&type));
  PetscCall(PetscFree(mine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The basis functions of a side's cell at a place, in it or beyond; false: a curved cell has none
   there. */
PetscBool SbFacingBasis(const SbFacing *side, const PetscReal x[3], PetscReal phi[SB_CELL_NODES])
{
  static const PetscInt own[4] = {0, 1, 2, 3};
  PetscReal L[4];

  SbTetBarycentric(&side->corner[0][0], own, x, L);
  if (side->curved && !SbTetCurvedBarycentric(&side->corner[0][0], own, side->off, x, L))
    return PETSC_FALSE;
  if (side->n == SB_CELL_NODES) {
    SbQuadraticBasis(L, phi);
    return PETSC_TRUE;
  }
  for (int a = 0; a < 4; a++) {
    phi[a] = 0;
    for (int c = 0; c < 4; c++)
      phi[a] += L[c] * side->basis[c][a];
  }
  return PETSC_TRUE;
}

/* The nodes of both sides, each once. */
static void begin_sum(const SbFacing *a, const SbFacing *b, SbFacingSum *sum)
{
  *sum = (SbFacingSum){.n = a->n};
  for (PetscInt i = 0; i < a->n; i++)
    sum->gnode[i] = a->gnode[i];
  for (PetscInt i = 0; i < b->n; i++) {
    PetscInt k = 0;

    while (k < sum->n && sum->gnode[k] != b->gnode[i])
      k++;
    if (k == sum->n)
      sum->gnode[sum->n++] = b->gnode[i];
    sum->of_b[i] = k;
  }
}

/* Adds a point of the rule: a place x of A's facet, and its area. */
static void add_point(const SbFacing *a, const SbFacing *b, const PetscReal x[3], PetscReal area,
                      PetscReal k, SbFacingSum *sum)
{
  PetscReal phi[2][SB_CELL_NODES];
  PetscReal s[2 * SB_CELL_NODES] = {0};

  if (!SbFacingBasis(a, x, phi[0]) || !SbFacingBasis(b, x, phi[1]))
    return;
  for (PetscInt i = 0; i < a->n; i++)
    s[i] += phi[0][i];
  for (PetscInt i = 0; i < b->n; i++)
    s[sum->of_b[i]] -= phi[1][i];
  for (PetscInt i = 0; i < sum->n; i++) {
    sum->mean[i] += k * area * s[i];
    for (PetscInt j = 0; j < sum->n; j++)
      sum->S[i][j] += k * area * s[i] * s[j];
  }
  sum->area += area;
}

/* Sums over the part of A's facet that lies under one of B, no farther from it than `distance`. */
void SbFacingSumUp(const SbFacing *a, const SbFacing *b, PetscReal distance, PetscReal k,
                   SbFacingSum *sum)
{
  const PetscReal *const of_a[3] = {a->x[0], a->x[1], a->x[2]};
  const PetscReal *const of_b[3] = {b->x[0], b->x[1], b->x[2]};
  PetscReal corner[SB_OVER][3];
  const int n = SbTriangleOver(of_a, a->normal, of_b, corner);

  begin_sum(a, b, sum);
  for (int t = 1; t + 1 < n; t++) {
    PetscReal side[2][3], normal[3];

    SbSubtract(corner[t], corner[0], side[0]);
    SbSubtract(corner[t + 1], corner[0], side[1]);
    SbCross(side[1], side[0], normal);

    /* B's triangle is seen from behind: its part in A's plane */
    const PetscReal area = SbDot3(normal, a->normal) / 2;

    if (!(area > SB_FACING_SLIVER * a->area))
      continue;
    for (int q = 0; q < SbRuleFacet.n; q++) {
      const PetscReal *L = SbRuleFacet.L[q];
      PetscReal x[3], to[3];

      for (int i = 0; i < 3; i++)
        x[i] = L[0] * corner[0][i] + L[1] * corner[t][i] + L[2] * corner[t + 1][i];
      SbSubtract(x, a->x[0], to);

      const PetscReal gap = SbDot3(to, a->normal);

      for (int i = 0; i < 3; i++)
        x[i] -= gap * a->normal[i];
      if (gap < -INSIDE * PetscMin(a->height, b->height) || gap > SB_FACING_BESIDE * distance)
        continue;
      if (PetscAbsReal(gap) <= distance) {
        add_point(a, b, x, area * SbRuleFacet.weight[q], k, sum);
        continue;
      }
      sum->missed += area * SbRuleFacet.weight[q];
      sum->farthest = PetscMax(sum->farthest, PetscAbsReal(gap));
    }
  }
}
