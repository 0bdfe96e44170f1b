/*
  tree.c - trees over boxes.

  Bottom-up: Volino and Magnenat-Thalmann (1994, "Efficient self-collision detection on smoothly discretized surface animations using
  geometrical shape regularity") join regions that share an edge, so that each node is one piece of surface: its box follows the
  motion, and its normals differ little. Here this goes round by round: every region that is still single takes the neighbour with
  which the box gets smallest; those that found none come first in the next round. A round costs a time proportional to the
  regions left, and their number falls geometrically, so that the whole is linear. A round that joins less than a tenth of the
  regions is the last one (regions around one large one, or without neighbours).

  What is then left over is joined top-down: the longest axis of the box of all centres is cut at the median. Parts are kept apart
  first and joined at the end in the same way.
*/
#include "tree.h"

enum { STALLED = 10 }; /* one region of so many must find a partner */

static PetscReal box_size(const PetscReal b[6])
{
  const PetscReal e[3] = {b[3] - b[0], b[4] - b[1], b[5] - b[2]};

  return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}

static void box_union(const PetscReal a[6], const PetscReal b[6], PetscReal u[6])
{
  for (int i = 0; i < 3; i++) {
    u[i] = PetscMin(a[i], b[i]);
    u[3 + i] = PetscMax(a[3 + i], b[3 + i]);
  }
}

/* ------------------------------------------------------------------ binary trees */

static PetscErrorCode binary_start(const SbTreeItems *items, SbBinary *tree)
{
  PetscFunctionBeginUser;
  tree->n = tree->nnode = items->n;
  tree->root = -1;
  PetscCall(PetscMalloc2(PetscMax(items->n - 1, 0), &tree->child, PetscMax(2 * items->n - 1, 0), &tree->box));
  if (items->n) PetscCall(PetscArraycpy(&tree->box[0][0], items->box, 6 * (size_t)items->n));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbBinaryDestroy(SbBinary *tree)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree2(tree->child, tree->box));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscInt join(SbBinary *tree, PetscInt a, PetscInt b)
{
  const PetscInt node = tree->nnode++;

  tree->child[node - tree->n][0] = a;
  tree->child[node - tree->n][1] = b;
  box_union(tree->box[a], tree->box[b], tree->box[node]);
  return node;
}

/* ------------------------------------------------------------------ top-down */

/* Orders node[n] by key[] so that the m smallest come first (Hoare 1961); equal keys do no harm. */
static void select_smallest(PetscInt n, PetscInt m, PetscReal key[], PetscInt node[])
{
  PetscInt low = 0, high = n - 1;

  while (low < high) {
    const PetscReal pivot = key[low + (high - low) / 2];
    PetscInt i = low - 1, j = high + 1;

    for (;;) {
      do i++;
      while (key[i] < pivot);
      do j--;
      while (pivot < key[j]);
      if (i >= j) break;
      const PetscReal k = key[i];
      const PetscInt o = node[i];

      key[i] = key[j];
      node[i] = node[j];
      key[j] = k;
      node[j] = o;
    }
    if (m <= j)
      high = j;
    else
      low = j + 1;
  }
}

/* One node over node[n], n > 0; key[n] is work space. The depth of the recursion is log2 n. */
static PetscInt halve(SbBinary *tree, PetscInt n, PetscInt node[], PetscReal key[])
{
  PetscReal low[3], high[3];
  const PetscInt half = n / 2;
  int axis = 0;

  if (n == 1) return node[0];
  for (int i = 0; i < 3; i++) {
    low[i] = PETSC_MAX_REAL;
    high[i] = PETSC_MIN_REAL;
    for (PetscInt k = 0; k < n; k++) {
      const PetscReal c = tree->box[node[k]][i] + tree->box[node[k]][3 + i];

      low[i] = PetscMin(low[i], c);
      high[i] = PetscMax(high[i], c);
    }
    if (high[i] - low[i] > high[axis] - low[axis]) axis = i;
  }
  for (PetscInt k = 0; k < n; k++) key[k] = tree->box[node[k]][axis] + tree->box[node[k]][3 + axis];
  select_smallest(n, half, key, node);
  const PetscInt a = halve(tree, half, node, key), b = halve(tree, n - half, node + half, key + half);
  return join(tree, a, b);
}

/* Joins node[n], all of one part each, to the root. */
static PetscErrorCode join_rest(SbBinary *tree, PetscInt n, PetscInt node[], PetscInt part[])
{
  PetscReal *key;
  PetscInt nroot = 0;

  PetscFunctionBeginUser;
  if (!n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc1(n, &key));
  PetscCall(PetscSortIntWithArray(n, part, node));
  for (PetscInt i = 0, j; i < n; i = j) {
    for (j = i; j < n && part[j] == part[i]; j++) {
    }
    node[nroot++] = halve(tree, j - i, node + i, key);
  }
  tree->root = halve(tree, nroot, node, key);
  PetscCall(PetscFree(key));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ bottom-up */

/* The regions of one round and who borders on whom; `next` is where the regions of the following round go. */
typedef struct {
  PetscInt n, *node, *part; /* [n] node of the tree */
  PetscInt *start, *list;   /* [n+1] */
  PetscInt *mate;           /* [n] the region taken, itself when none, -1 not yet visited */
  PetscInt *to;             /* [n] number in the next round */
  PetscInt *seen;           /* [n] */
} Regions;

static PetscErrorCode regions_create(const SbTreeItems *items, const PetscInt start[], const PetscInt list[],
                                     Regions *r)
{
  PetscFunctionBeginUser;
  r->n = items->n;
  PetscCall(PetscMalloc7(r->n, &r->node, r->n, &r->part, r->n + 1, &r->start, start[r->n], &r->list, r->n,
                         &r->mate, r->n, &r->to, r->n, &r->seen));
  for (PetscInt i = 0; i < r->n; i++) r->node[i] = i;
  PetscCall(PetscArraycpy(r->part, items->part, r->n));
  PetscCall(PetscArraycpy(r->start, start, r->n + 1));
  PetscCall(PetscArraycpy(r->list, list, start[r->n]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode regions_destroy(Regions *r)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree7(r->node, r->part, r->start, r->list, r->mate, r->to, r->seen));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Each region takes a neighbour that is free. Returns how many pairs there are. */
static PetscInt take_mates(const SbBinary *tree, Regions *r)
{
  PetscInt pairs = 0;

  for (PetscInt i = 0; i < r->n; i++) r->mate[i] = -1;
  for (PetscInt i = 0; i < r->n; i++) {
    PetscReal best = PETSC_MAX_REAL;
    PetscInt mate = i;

    if (r->mate[i] >= 0) continue;
    for (PetscInt k = r->start[i]; k < r->start[i + 1]; k++) {
      const PetscInt j = r->list[k];
      PetscReal box[6], size;

      if (r->mate[j] >= 0 || r->part[j] != r->part[i]) continue;
      box_union(tree->box[r->node[i]], tree->box[r->node[j]], box);
      size = box_size(box);
      if (mate == i || size < best) {
        best = size;
        mate = j;
      }
    }
    r->mate[i] = mate;
    r->mate[mate] = i;
    if (mate != i) pairs++;
  }
  return pairs;
}

/* Appends the neighbours of old region i, renamed, to those of new region `me`; returns the new end. */
static PetscInt inherit(const Regions *r, PetscInt i, PetscInt me, PetscInt end, PetscInt list[])
{
  for (PetscInt k = r->start[i]; k < r->start[i + 1]; k++) {
    const PetscInt j = r->to[r->list[k]];

    if (j == me || r->seen[j] == me) continue;
    r->seen[j] = me;
    list[end++] = j;
  }
  return end;
}

/* The regions of the next round: those without a mate, then the pairs. `w` has room for them. */
static void next_round(SbBinary *tree, Regions *r, Regions *w)
{
  PetscInt n = 0, end = 0;

  for (int pairs = 0; pairs < 2; pairs++) {
    for (PetscInt i = 0; i < r->n; i++) {
      const PetscInt j = r->mate[i];

      if (j < i || (j > i) != pairs) continue;
      w->node[n] = pairs ? join(tree, r->node[i], r->node[j]) : r->node[i];
      w->part[n] = r->part[i];
      w->mate[n] = i; /* where it comes from, until the round begins */
      r->to[i] = r->to[j] = n++;
    }
  }
  for (PetscInt i = 0; i < n; i++) r->seen[i] = -1;
  for (PetscInt me = 0; me < n; me++) {
    const PetscInt i = w->mate[me], j = r->mate[i];

    w->start[me] = end;
    end = inherit(r, i, me, end, w->list);
    if (j != i) end = inherit(r, j, me, end, w->list);
  }
  w->start[n] = end;
  w->n = n;
}

PetscErrorCode SbBinaryCreate(const SbTreeItems *items, const PetscInt start[], const PetscInt list[],
                              SbBinary *tree)
{
  Regions a, b;

  PetscFunctionBeginUser;
  PetscCall(binary_start(items, tree));
  if (!items->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(regions_create(items, start, list, &a));
  PetscCall(regions_create(items, start, list, &b));
  while (a.n > 1) {
    const Regions swap = a;
    const PetscInt pairs = take_mates(tree, &a);

    if (pairs)
      next_round(tree, &a, &b);
    else
      break;
    a = b;
    b = swap;
    if (pairs * STALLED < b.n) break;
  }
  PetscCall(join_rest(tree, a.n, a.node, a.part));
  PetscCall(regions_destroy(&a));
  PetscCall(regions_destroy(&b));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ points that sit on facets */

/* Leaves of the points on each facet, then upwards what both children have. top[]: the node over the points of each facet node. */
static void hang(const SbBinary *facets, PetscInt n, const PetscInt seat[], SbBinary *tree, PetscInt top[])
{
  for (PetscInt i = 0; i < facets->nnode; i++) top[i] = -1;
  for (PetscInt p = 0; p < n; p++) {
    if (seat[p] >= 0) top[seat[p]] = top[seat[p]] < 0 ? p : join(tree, top[seat[p]], p);
  }
  for (PetscInt i = facets->n; i < facets->nnode; i++) {
    const PetscInt a = top[facets->child[i - facets->n][0]], b = top[facets->child[i - facets->n][1]];

    top[i] = a < 0 ? b : b < 0 ? a : join(tree, a, b);
  }
}

PetscErrorCode SbBinaryHang(const SbBinary *facets, const PetscInt seat[], const SbTreeItems *points,
                            SbBinary *tree)
{
  PetscInt *top, *node, *part, loose = 0, seated;

  PetscFunctionBeginUser;
  PetscCall(binary_start(points, tree));
  if (!points->n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(facets->nnode, &top, points->n, &node, points->n, &part));
  hang(facets, points->n, seat, tree, top);
  seated = facets->root < 0 ? -1 : top[facets->root];
  for (PetscInt p = 0; p < points->n; p++) {
    if (seat[p] >= 0) continue;
    node[loose] = p;
    part[loose++] = points->part[p];
  }
  PetscCall(join_rest(tree, loose, node, part));
  if (!loose)
    tree->root = seated;
  else if (seated >= 0)
    tree->root = join(tree, seated, tree->root);
  PetscCall(PetscFree3(top, node, part));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ wide nodes */

/* What of a binary tree decides how it is made wide. */
typedef struct {
  const SbBinary *tree;
  PetscReal *size; /* [nnode] of the box */
  PetscInt *nitem; /* [nnode] items below */
} Widening;

/*
  Which of n children to open when `room` more have a place, -1: none. Those with more items than a node holds, the largest first; then, the
  fewest items first, those whose items all have a place here. What has less stays one node, so that the lowest ones are full.
*/
static PetscInt to_open(const Widening *w, PetscInt n, const PetscInt list[], PetscInt room)
{
  PetscInt best = -1;

  for (PetscInt l = 0; l < n && room > 0; l++) {
    if (w->nitem[list[l]] > SB_TREE_WIDTH && (best < 0 || w->size[list[l]] > w->size[list[best]])) best = l;
  }
  if (best >= 0) return best;
  for (PetscInt l = 0; l < n; l++) {
    const PetscInt more = w->nitem[list[l]] - 1;

    if (more > 0 && more <= room && (best < 0 || more < w->nitem[list[best]] - 1)) best = l;
  }
  return best;
}

/* Children of a binary node: at first itself. */
static PetscInt open_children(const Widening *w, PetscInt node, PetscInt list[])
{
  const SbBinary *b = w->tree;
  PetscInt n = 1, best;

  list[0] = node;
  for (;;) {
    best = n == 1 ? 0 : to_open(w, n, list, SB_TREE_WIDTH - n);
    if (best < 0 || list[best] < b->n) break;
    const PetscInt *child = b->child[list[best] - b->n];

    list[best] = child[0];
    list[n++] = child[1];
  }
  return n;
}

typedef struct {
  PetscInt node;   /* of the binary tree */
  PetscInt parent; /* place of the child in tree->child, -1: the root */
  PetscInt depth;
} Pending;

/* Depth first: what is near in the tree is near in memory. */
static void make_wide(const Widening *w, Pending stack[], SbTree *t)
{
  const SbBinary *b = w->tree;
  PetscInt nstack = 1, list[SB_TREE_WIDTH];

  stack[0] = (Pending){b->root, -1, 1};
  while (nstack) {
    const Pending p = stack[--nstack];
    const PetscInt me = t->nnode++;
    PetscInt *child = t->child + me * SB_TREE_WIDTH;

    if (p.parent >= 0) t->child[p.parent] = me;
    t->depth = PetscMax(t->depth, p.depth);
    t->nchild[me] = open_children(w, p.node, list);
    for (PetscInt l = SB_TREE_WIDTH - 1; l >= 0; l--) {
      if (l >= t->nchild[me])
        child[l] = SB_TREE_NONE;
      else if (list[l] < b->n)
        child[l] = SB_TREE_ITEM(list[l]);
      else
        stack[nstack++] = (Pending){list[l], me * SB_TREE_WIDTH + l, p.depth + 1};
    }
  }
}

PetscErrorCode SbTreeCreate(const SbBinary *b, SbTree *t)
{
  const PetscInt most = PetscMax(b->n - 1, 1);
  Widening w = {.tree = b};
  Pending *stack;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(t, sizeof(*t)));
  t->n = b->n;
  if (b->root < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscMalloc3(b->nnode, &w.size, b->nnode, &w.nitem, most, &stack));
  PetscCall(PetscMalloc1(most * SB_TREE_WIDTH, &t->child));
  PetscCall(PetscMalloc1(most, &t->nchild));
  for (PetscInt i = 0; i < b->nnode; i++) {
    const PetscInt *child = i < b->n ? NULL : b->child[i - b->n];

    w.size[i] = box_size(b->box[i]);
    w.nitem[i] = child ? w.nitem[child[0]] + w.nitem[child[1]] : 1;
  }
  make_wide(&w, stack, t);
  PetscCall(PetscFree3(w.size, w.nitem, stack));
  PetscCall(PetscRealloc(sizeof(*t->child) * (size_t)(t->nnode * SB_TREE_WIDTH), &t->child));
  PetscCall(PetscRealloc(sizeof(*t->nchild) * (size_t)t->nnode, &t->nchild));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbTreeDestroy(SbTree *t)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(t->child));
  PetscCall(PetscFree(t->nchild));
  PetscCall(PetscMemzero(t, sizeof(*t)));
  PetscFunctionReturn(PETSC_SUCCESS);
}
