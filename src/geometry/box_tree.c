/*
  box_tree.c - bounding volume hierarchy of axis-aligned boxes, four children per node: overlap with
  a box, with another tree or within a tree, and nearest-neighbour search.

  The order of the boxes is found by recursive bisection: a range is split at the median of the box
  centres along the longest axis, at a multiple of the number of boxes below a child. Four
  consecutive boxes form a group, four groups one of the next level; a group stores the bounding
  boxes (hulls) of its children as arrays, so that they are tested together, and only the order has
  to be stored. When boxes move, the tree is refitted: the order is kept and the hulls are updated.
  It is rebuilt when hulls have grown too large.

  Traversals use a stack of the caller and return one result per call: nothing is allocated.
*/
#include "sbgeometry.h"

#define WORSE \
  1.5 /* largest growth of hulls relative to boxes since the last build, before a rebuild */

typedef struct {
  PetscReal middle[3];
  PetscInt box;
} Item;

static inline PetscBool before(const Item *a, const Item *b, int axis)
{
  return (PetscBool)(a->middle[axis] != b->middle[axis] ? a->middle[axis] < b->middle[axis]
                                                        : a->box < b->box);
}

static inline void swap(Item *a, Item *b)
{
  const Item keep = *a;

  *a = *b;
  *b = keep;
}

/* Quickselect: moves the m smallest items along the axis to the front (Hoare, "Algorithm 65: Find",
   1961). */
static void select_first(Item item[], PetscInt n, PetscInt m, int axis)
{
  PetscInt low = 0;
  PetscInt high = n - 1;

  while (low < high) {
    const PetscInt centre = low + (high - low) / 2;
    PetscInt i = low;
    PetscInt j = high;
    Item pivot;

    // median-of-three pivot; partition
    if (before(&item[centre], &item[low], axis))
      swap(&item[centre], &item[low]);
    if (before(&item[high], &item[low], axis))
      swap(&item[high], &item[low]);
    if (before(&item[high], &item[centre], axis))
      swap(&item[high], &item[centre]);
    pivot = item[centre];
    while (i <= j) {
      while (before(&item[i], &pivot, axis))
        i++;
      while (before(&pivot, &item[j], axis))
        j--;
      if (i <= j)
        swap(&item[i++], &item[j--]);
    }

    // continue in the part with position m
    if (m <= j)
      high = j;
    else if (m >= i)
      low = i;
    else
      break;
  }
}

/* Orders n boxes by recursive bisection along the longest axis; `below`: number of boxes below each
   child. */
static void order_items(Item item[], PetscInt n, PetscInt below)
{
  PetscReal box[6];
  PetscInt nchild, left;
  int axis;

  // the left half has a whole number of children
  while (below >= n)
    below /= 4;
  if (below == 0)
    return;
  nchild = (n + below - 1) / below;
  left = (nchild + 1) / 2 * below;

  // longest axis of the bounding box of the box centres
  SbBoxClear(box);
  for (PetscInt i = 0; i < n; i++)
    SbBoxAdd(box, item[i].middle);
  axis = SbBoxLongest(box);

  // partition, and recurse into both halves
  select_first(item, n, left, axis);
  order_items(item, left, below);
  order_items(item + left, n - left, below);
}

/* Size of a box: sum of its edge lengths; 0 for an empty box. */
static inline PetscReal size_of(const PetscReal box[6])
{
  const PetscReal size = box[3] - box[0] + (box[4] - box[1]) + (box[5] - box[2]);

  return size > 0 ? size : 0;
}

/* Refit: updates the hulls from the lowest level up; returns their total size over that of the
   boxes. */
static PetscReal fill(SbBoxTree *tree, const PetscReal (*box)[6])
{
  PetscReal groups = 0;
  PetscReal boxes = 0;

  for (int level = 0; level < tree->nlevel; level++) {
    const PetscInt first = tree->start[level];
    const PetscInt n = tree->start[level + 1] - first;

    for (PetscInt g = 0; g < n; g++) {
      PetscReal hull[6];

      // hull of the four children; on the lowest level these are boxes
      SbBoxClear(hull);
      for (int l = 0; l < 4; l++) {
        const PetscInt i = level == 0 ? tree->order[4 * g + l] : -1;
        PetscReal child[6];

        for (int k = 0; k < 6 && i >= 0; k++)
          tree->group[g][k][l] = box[i][k];
        for (int k = 0; k < 6; k++)
          child[k] = tree->group[first + g][k][l];
        SbBoxMerge(hull, child);
        if (level == 0)
          boxes += size_of(child);
      }
      groups += size_of(hull);

      // store it as a child of the next level; above the last one there is another group for the
      // hull of all
      for (int k = 0; k < 6; k++)
        tree->group[tree->start[level + 1] + g / 4][k][g % 4] = hull[k];
    }
  }
  for (int k = 0; k < 6; k++)
    tree->hull[k] = tree->group[tree->start[tree->nlevel]][k][0];
  return groups / PetscMax(boxes + size_of(tree->hull), PETSC_SMALL * PETSC_SMALL);
}

/* Builds the order of the boxes from their centres, then the hulls. */
static PetscErrorCode build(SbBoxTree *tree, const PetscReal (*box)[6])
{
  PetscInt below = 1;
  Item *item;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(tree->n, &item));
  for (PetscInt i = 0; i < tree->n; i++) {
    for (int k = 0; k < 3; k++)
      item[i].middle[k] = 0.5 * box[i][k] + 0.5 * box[i][3 + k];
    item[i].box = i;
  }
  while (below <= tree->n / 4)
    below *= 4;
  order_items(item, tree->n, below);
  for (PetscInt i = 0; i < tree->n; i++)
    tree->order[i] = item[i].box;
  PetscCall(PetscFree(item));
  tree->size = fill(tree, box);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBoxTreeRefit(SbBoxTree *tree, const PetscReal (*box)[6])
{
  PetscFunctionBeginUser;
  if (tree->n && fill(tree, box) > WORSE * tree->size)
    PetscCall(build(tree, box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBoxTreeCreate(PetscInt n, const PetscReal (*box)[6], SbBoxTree *tree)
{
  PetscInt ngroup;

  PetscFunctionBeginUser;
  *tree = (SbBoxTree){.n = n};
  SbBoxClear(tree->hull);
  if (!n)
    PetscFunctionReturn(PETSC_SUCCESS);

  // number of groups per level: a quarter of the level below, down to one
  for (ngroup = n; ngroup > 1 || !tree->nlevel;) {
    ngroup = (ngroup + 3) / 4;
    tree->start[tree->nlevel + 1] = tree->start[tree->nlevel] + ngroup;
    tree->nlevel++;
  }
  PetscCall(PetscMalloc2(4 * (size_t)tree->start[1], &tree->order, tree->start[tree->nlevel] + 1,
                         &tree->group));
  for (PetscInt i = n; i < 4 * tree->start[1]; i++)
    tree->order[i] = -1;

  // initialise unused children as empty boxes
  for (PetscInt g = 0; g <= tree->start[tree->nlevel]; g++)
    for (int k = 0; k < 24; k++)
      tree->group[g][k / 4][k % 4] = k < 12 ? PETSC_MAX_REAL : -PETSC_MAX_REAL;
  PetscCall(build(tree, box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBoxTreeDestroy(SbBoxTree *tree)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(tree->order, tree->group));
  PetscCall(PetscMemzero(tree, sizeof(*tree)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Bit l is set if child l of the group overlaps the box. */
static inline unsigned meeting(const PetscReal (*group)[4], const PetscReal box[6])
{
  unsigned mask = 0;

  for (int l = 0; l < 4; l++)
    mask |= (unsigned)((group[0][l] <= box[3]) & (group[1][l] <= box[4]) & (group[2][l] <= box[5]) &
                       (group[3][l] >= box[0]) & (group[4][l] >= box[1]) & (group[5][l] >= box[2]))
            << l;
  return mask;
}

/* Hull of child l, enlarged by `grown` on all sides. */
static inline void grow(PetscReal (*group)[4], int l, PetscReal grown, PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = group[k][l] - grown;
    box[3 + k] = group[3 + k][l] + grown;
  }
}

void SbBoxNearestBegin(const SbBoxTree *tree, const PetscReal box[6], PetscReal limit2,
                       SbBoxNearest *nearest)
{
  nearest->tree = tree;
  for (int k = 0; k < 6; k++)
    nearest->box[k] = box[k];
  nearest->limit2 = limit2;
  nearest->depth = tree->n > 0;
  nearest->stack[0] = (SbBoxNearestEntry){.level = tree->nlevel - 1};
}

PetscBool SbBoxNearestNext(SbBoxNearest *nearest, PetscInt *i)
{
  const SbBoxTree *tree = nearest->tree;

  while (nearest->depth) {
    const SbBoxNearestEntry top = nearest->stack[--nearest->depth];
    SbBoxNearestEntry *child = nearest->stack + nearest->depth;
    const PetscReal(*group)[4];
    PetscReal d2[4] = {0, 0, 0, 0};
    int n = 0;

    // skip what is farther than the limit, which the caller lowers; return a box
    if (!(top.d2 <= nearest->limit2))
      continue;
    if (top.level < 0) {
      *i = tree->order[top.index];
      return PETSC_TRUE;
    }
    group = (const PetscReal(*)[4])tree->group[tree->start[top.level] + top.index];

    // squared distances to the children; infinite for empty ones, NaN for those with NaN
    for (int k = 0; k < 3; k++) {
      for (int l = 0; l < 4; l++) {
        const PetscReal above = group[k][l] - nearest->box[3 + k];
        const PetscReal below = nearest->box[k] - group[3 + k][l];

        PetscReal gap = 0;

        if (!(above <= 0))
          gap = above;
        else if (!(below <= 0))
          gap = below;
        d2[l] += gap * gap;
      }
    }

    // push the children within the limit; visited first: the nearest, of equal ones the first
    for (int l = 0; l < 4; l++) {
      int at = n;

      if (!(d2[l] <= nearest->limit2))
        continue;
      for (; at > 0 && child[at - 1].d2 <= d2[l]; at--)
        child[at] = child[at - 1];
      child[at] =
        (SbBoxNearestEntry){.level = top.level - 1, .index = 4 * top.index + l, .d2 = d2[l]};
      n++;
    }
    nearest->depth += n;
  }
  return PETSC_FALSE;
}

void SbBoxPairsBegin(const SbBoxTree *a, const SbBoxTree *b, PetscReal grown, SbBoxPairs *pairs)
{
  pairs->tree[0] = a;
  pairs->tree[1] = b;
  pairs->grown = grown;
  pairs->depth = a->n > 0 && b->n > 0;
  pairs->stack[0] = (SbBoxPairsEntry){.level = {a->nlevel - 1, b->nlevel - 1}, .group = {0, 0}};
}

PetscInt SbBoxPairsNext(SbBoxPairs *pairs, PetscInt room, PetscInt pair[])
{
  PetscInt n = 0;

  while (pairs->depth && n + 16 <= room) {
    const SbBoxPairsEntry top = pairs->stack[--pairs->depth];
    const SbBoxTree *a = pairs->tree[0];
    const SbBoxTree *b = pairs->tree[1];
    PetscReal(*group)[6][4] = a->group + a->start[top.level[0]] + top.group[0];
    PetscReal(*other)[6][4] = b->group + b->start[top.level[1]] + top.group[1];
    const PetscBool same = (PetscBool)(group == other);
    PetscReal box[6];

    if (top.level[0] != top.level[1]) {
      // test the children of the group on the higher level against the hull of the other
      const int up = top.level[1] > top.level[0];
      const int down = 1 - up;
      const int level = top.level[down] + 1;
      const SbBoxTree *t = pairs->tree[down];
      unsigned mask;

      grow(t->group[t->start[level] + top.group[down] / 4], top.group[down] % 4, pairs->grown, box);
      mask = meeting((const PetscReal(*)[4])(up ? other : group)[0], box);
      for (int l = 3; l >= 0; l--) {
        if (!(mask >> l & 1))
          continue;
        pairs->stack[pairs->depth] = top;
        pairs->stack[pairs->depth].level[up]--;
        pairs->stack[pairs->depth++].group[up] = 4 * top.group[up] + l;
      }
      continue;
    }

    // same level: children of the first against those of the second; for a tree against itself each
    // pair once
    for (int i = 3; i >= 0; i--) {
      unsigned mask;

      grow(*group, i, pairs->grown, box);
      mask = meeting((const PetscReal(*)[4])(*other), box);
      if (same)
        mask &= top.level[0] ? 15U << i : 15U << i << 1;
      for (int j = 3; mask && j >= 0; j--) {
        if (!(mask >> j & 1))
          continue;
        if (top.level[0] > 0)
          pairs->stack[pairs->depth++] =
            (SbBoxPairsEntry){.level = {top.level[0] - 1, top.level[1] - 1},
                              .group = {4 * top.group[0] + i, 4 * top.group[1] + j}};
        else {
          pair[2 * n] = a->order[4 * top.group[0] + i];
          pair[2 * n++ + 1] = b->order[4 * top.group[1] + j];
        }
      }
    }
  }
  return n;
}

void SbTriangleBox(const PetscReal x[], const PetscInt v[], PetscReal box[6])
{
  SbBoxClear(box);
  for (int k = 0; k < 3; k++)
    SbBoxAdd(box, x + 3 * v[k]);
}

PetscErrorCode SbBoxTreeCreateTriangles(PetscInt n, const PetscInt vert[], const PetscReal x[],
                                        SbBoxTree *tree)
{
  PetscReal(*box)[6];

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(n, &box));
  for (PetscInt t = 0; t < n; t++)
    SbTriangleBox(x, vert + 3 * t, box[t]);
  PetscCall(SbBoxTreeCreate(n, (const PetscReal(*)[6])box, tree));
  PetscCall(PetscFree(box));
  PetscFunctionReturn(PETSC_SUCCESS);
}
