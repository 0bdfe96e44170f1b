/*
  tree.h - trees over boxes: a binary one by joining neighbours, then one with eight children to a node.
*/
#pragma once
#include "volume.h"

/* What a tree is made of: facets or points. Arrays are borrowed. */
typedef struct {
  PetscInt n;
  const PetscReal *box; /* [n][6] lower and upper corner, m */
  const PetscInt *part; /* [n] items of one part stay together */
} SbTreeItems;

/* Items 0..n-1 are the leaves; an inner node comes after its children. */
typedef struct {
  PetscInt n, nnode, root; /* root = -1 when there are no items */
  PetscInt (*child)[2];    /* [n-1], of node n + i */
  PetscReal (*box)[6];     /* [2n-1], m */
} SbBinary;

typedef struct {
  PetscInt *start, *list; /* [nfacet+1] neighbours of each facet across its edges */
  PetscInt *seat;         /* [npoint] a facet on which the point sits, -1: it is not in the scene */
  PetscBool *open; /* [nvertex of the rings] not all edges there are between two facets of one orientation */
} SbFacetLinks;

/* Not collective. */
PetscErrorCode SbFacetLinksCreate(const SbDetectScene *scene, const SbDetectRings *rings,
                                  SbFacetLinks *links);
PetscErrorCode SbFacetLinksDestroy(SbFacetLinks *links);

/*
  SbBinaryCreate - tree over the items: neighbours are joined bottom-up, the rest is halved top-down.

  Not collective. Input: start, list - neighbours of each item.
*/
PetscErrorCode SbBinaryCreate(const SbTreeItems *items, const PetscInt start[], const PetscInt list[],
                              SbBinary *tree);
/* Tree over points with the shape of the tree over facets on which they sit (seat[n], -1: nowhere). Not collective. */
PetscErrorCode SbBinaryHang(const SbBinary *facets, const PetscInt seat[], const SbTreeItems *points,
                            SbBinary *tree);
PetscErrorCode SbBinaryDestroy(SbBinary *tree);

#define SB_TREE_NONE (-1)
/* Item i as a child, and back. */
#define SB_TREE_ITEM(i) (-2 - (i))

/* Nodes with up to SB_TREE_WIDTH children; the children of a node come after it. The first `nchild` lanes are used. */
typedef struct {
  PetscInt n, nnode, depth;
  PetscInt *child;  /* [nnode][SB_TREE_WIDTH] node, SB_TREE_ITEM(item), or SB_TREE_NONE */
  PetscInt *nchild; /* [nnode] */
} SbTree;

/* Takes grandchildren for children, the largest first, until each node is full. Not collective. */
PetscErrorCode SbTreeCreate(const SbBinary *binary, SbTree *tree);
PetscErrorCode SbTreeDestroy(SbTree *tree);
