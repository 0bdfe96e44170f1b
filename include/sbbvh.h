/*
  sbbvh.h - volumes and counts of the detector that walks through a tree of bounding volumes.
*/
#pragma once
#include "sbdetect.h"

typedef struct {
  PetscInt nodes;    /* of the tree over the facets, without the facets themselves */
  PetscInt depth;    /* nodes on the longest way to a facet */
  PetscInt64 visits; /* tests of one node or point against all children of another node, last call */
} SbBvhCounts;

/*
  SbBvhSet - other volumes, bounded by k planes: 6 (a box, the default) or 14; the next call builds the tree again.

  Not collective.
  Errors: PETSC_ERR_ARG_OUTOFRANGE for another k, PETSC_ERR_ARG_WRONG for another kind of detector.
*/
PetscErrorCode SbBvhSet(SbDetector detector, PetscInt k);
/* What the last call did. Not collective. Error: PETSC_ERR_ARG_WRONG for another kind of detector. */
PetscErrorCode SbBvhGetCounts(SbDetector detector, SbBvhCounts *counts);
