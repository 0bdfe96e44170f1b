/*
  edges.c - from facets to edges: sides of facets are sorted by their ends; two with the same ends are an edge.

  A side that has no partner is the border of a surface; three and more sides at one place, or two in the same direction, bound no
  region in a simple way: these are no edges, and what comes near them is found by points and facets alone.
*/
#include "edge.h"

static int by_ends(const void *first, const void *second, void *ctx)
{
  const SbSide *a = (const SbSide *)first, *b = (const SbSide *)second;

  (void)ctx;
  if (a->low != b->low) return a->low < b->low ? -1 : 1;
  if (a->high != b->high) return a->high < b->high ? -1 : 1;
  if (a->part != b->part) return a->part < b->part ? -1 : 1;
  if (a->id != b->id) return a->id < b->id ? -1 : 1;
  return a->at < b->at ? -1 : a->at > b->at;
}

static inline PetscBool same_ends(const SbSide *a, const SbSide *b)
{
  return (PetscBool)(a->low == b->low && a->high == b->high && a->part == b->part);
}

PetscErrorCode SbSidesPair(PetscInt n, SbSide side[], PetscInt *nedge, PetscInt edge[][2])
{
  PetscFunctionBeginUser;
  if (n > 1) PetscCall(PetscTimSort(n, side, sizeof(*side), by_ends, NULL));
  *nedge = 0;
  for (PetscInt i = 0, end; i < n; i = end) {
    for (end = i + 1; end < n && same_ends(side + i, side + end);) end++;
    if (end - i != 2 || side[i].low == side[i].high || side[i].forward == side[i + 1].forward) continue;
    edge[*nedge][0] = side[i].at;
    edge[(*nedge)++][1] = side[i + 1].at;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbSideSet(const PetscInt vertex[3], PetscInt part, PetscInt id, PetscInt at, SbSide *side)
{
  const PetscInt a = vertex[at % 3], b = vertex[(at + 1) % 3];

  *side = (SbSide){PetscMin(a, b), PetscMax(a, b), part, id, at, (PetscBool)(a < b)};
}

PetscErrorCode SbEdgesCreate(const SbDetectScene *s, SbEdges *e)
{
  const PetscInt n = 3 * s->nfacet;
  PetscInt(*pair)[2];
  SbSide *side;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc2(n, &side, n / 2 + 1, &pair));
  for (PetscInt i = 0; i < n; i++)
    SbSideSet(s->facet_vertex + i - i % 3, s->facet_part[i / 3], s->facet_id[i / 3], i, side + i);
  PetscCall(SbSidesPair(n, side, &e->n, pair));
  e->nown = e->n;
  PetscCall(PetscMalloc4(4 * e->n, &e->corner, 2 * e->n, &e->vertex, e->n, &e->part, e->n, &e->id));
  PetscCall(PetscCalloc1(e->n, &e->thick));
  for (PetscInt i = 0; i < e->n; i++) {
    const PetscInt f = pair[i][0] / 3, k = pair[i][0] % 3, g = pair[i][1] / 3, l = pair[i][1] % 3;

    for (int j = 0; j < 3; j++) e->corner[4 * i + j] = s->facet[3 * f + (k + j) % 3];
    e->corner[4 * i + 3] = s->facet[3 * g + (l + 2) % 3];
    for (int j = 0; j < 2; j++) e->vertex[2 * i + j] = s->facet_vertex[3 * f + (k + j) % 3];
    e->part[i] = s->facet_part[f];
    e->id[i] = 3 * s->facet_id[f] + k;
  }
  PetscCall(PetscFree2(side, pair));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbEdgesDestroy(SbEdges *e)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree4(e->corner, e->vertex, e->part, e->id));
  PetscCall(PetscFree(e->thick));
  e->n = e->nown = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}
