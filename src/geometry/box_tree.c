/*
  box_tree.c - which of many boxes meet a given one: a binary tree over the boxes, sorted along a Morton curve of their middles.

  The tree is complete: leaves hold one box each (those beyond the last are empty), an inner node the hull of its two children, so
  that no pointers are needed. Building is a sort; a query visits the nodes whose box meets the given one.
*/
#include <stdlib.h>
#include "sbgeometry.h"

typedef struct {
  uint64_t key;
  PetscInt box;
} Place;

static int compare_places(const void *a, const void *b)
{
  const Place *p = (const Place *)a, *q = (const Place *)b;

  if (p->key != q->key) return p->key < q->key ? -1 : 1;
  return (p->box > q->box) - (p->box < q->box);
}

/* Two zero bits between the 21 bits of a coordinate. */
static uint64_t spread(uint64_t v)
{
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffULL;
  v = (v | v << 16) & 0x1f0000ff0000ffULL;
  v = (v | v << 8) & 0x100f00f00f00f00fULL;
  v = (v | v << 4) & 0x10c30c30c30c30c3ULL;
  return (v | v << 2) & 0x1249249249249249ULL;
}

static void join(const PetscReal a[6], const PetscReal b[6], PetscReal hull[6])
{
  for (int k = 0; k < 3; k++) {
    hull[k] = PetscMin(a[k], b[k]);
    hull[3 + k] = PetscMax(a[3 + k], b[3 + k]);
  }
}

/* Boxes along the Morton curve. */
static PetscErrorCode sort_boxes(PetscInt n, const PetscReal (*box)[6], PetscInt order[])
{
  PetscReal all[6], size = 0;
  Place *place;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, &place));
  PetscCall(PetscArraycpy(all, box[0], 6));
  for (PetscInt i = 1; i < n; i++) join(all, box[i], all);
  for (int k = 0; k < 3; k++) size = PetscMax(size, all[3 + k] - all[k]);
  for (PetscInt i = 0; i < n; i++) {
    place[i].key = 0;
    place[i].box = i;
    for (int k = 0; k < 3; k++) {
      const PetscReal at = size > 0 ? (0.5 * box[i][k] + 0.5 * box[i][3 + k] - all[k]) / size : 0;

      place[i].key |= spread((uint64_t)(at * 2097151)) << k;
    }
  }
  qsort(place, (size_t)n, sizeof(*place), compare_places);
  for (PetscInt i = 0; i < n; i++) order[i] = place[i].box;
  PetscCall(PetscFree(place));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBoxTreeCreate(PetscInt n, const PetscReal (*box)[6], SbBoxTree *tree)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(tree, sizeof(*tree)));
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  tree->n = n;
  for (tree->nleaf = 1; tree->nleaf < n;) tree->nleaf *= 2;
  PetscCall(PetscMalloc1(n, &tree->order));
  PetscCall(sort_boxes(n, box, tree->order));
  PetscCall(PetscMalloc1(2 * (size_t)tree->nleaf, &tree->box));
  for (PetscInt i = 0; i < tree->nleaf; i++) {
    PetscReal *leaf = tree->box[tree->nleaf + i];

    for (int k = 0; k < 6; k++) {
      if (i < n)
        leaf[k] = box[tree->order[i]][k];
      else
        leaf[k] = k < 3 ? PETSC_MAX_REAL : PETSC_MIN_REAL;
    }
  }
  for (PetscInt k = tree->nleaf - 1; k > 0; k--) join(tree->box[2 * k], tree->box[2 * k + 1], tree->box[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBoxTreeDestroy(SbBoxTree *tree)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(tree->order));
  PetscCall(PetscFree(tree->box));
  PetscCall(PetscMemzero(tree, sizeof(*tree)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void SbTriangleBox(const PetscReal x[], const PetscInt v[], PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    const PetscReal a = x[3 * v[0] + k], b = x[3 * v[1] + k], c = x[3 * v[2] + k];

    box[k] = PetscMin(PetscMin(a, b), c);
    box[3 + k] = PetscMax(PetscMax(a, b), c);
  }
}

static PetscBool meet(const PetscReal a[6], const PetscReal b[6])
{
  for (int k = 0; k < 3; k++) {
    if (a[k] > b[3 + k] || b[k] > a[3 + k]) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

PetscErrorCode SbBoxTreeVisit(const SbBoxTree *tree, const PetscReal box[6],
                              PetscErrorCode (*visit)(void *ctx, PetscInt i), void *ctx)
{
  PetscInt stack[64], depth = 0;

  PetscFunctionBeginUser;
  if (!tree->n) PetscFunctionReturn(PETSC_SUCCESS);
  stack[depth++] = 1;
  while (depth) {
    const PetscInt k = stack[--depth];

    if (!meet(tree->box[k], box)) continue;
    if (k >= tree->nleaf)
      PetscCall((*visit)(ctx, tree->order[k - tree->nleaf]));
    else {
      stack[depth++] = 2 * k + 1;
      stack[depth++] = 2 * k;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
