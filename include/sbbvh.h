/*
  sbbvh.h - settings and counts of the detector that walks through a tree of bounding volumes.
*/
#pragma once
#include "sbdetect.h"

typedef enum { SB_BVH_CONNECTIVITY, SB_BVH_TOP_DOWN } SbBvhBuild;

typedef struct {
  PetscInt branching; /* children of a node: 2, 4 or 8 */
  PetscInt k;         /* planes that bound a volume: 6 (box), 14, 18 or 26; 0: spheres */
  SbBvhBuild build;
  PetscReal growth; /* built anew when the volumes have grown by this factor, (1, inf) */
} SbBvhSettings;

typedef struct {
  PetscInt nodes;    /* of the tree over the facets, without the facets themselves */
  PetscInt depth;    /* nodes on the longest way to a facet */
  PetscInt64 visits; /* tests of one node or point against all children of another node, last call */
} SbBvhCounts;

void SbBvhSettingsDefault(SbBvhSettings *settings);
/*
  SbBvhSet - other settings; the next call builds the tree anew.

  Not collective.
  Errors: PETSC_ERR_ARG_OUTOFRANGE for a value that is not among those above, PETSC_ERR_ARG_WRONG for another kind of detector.
*/
PetscErrorCode SbBvhSet(SbDetector detector, const SbBvhSettings *settings);
/* What the last call did. Not collective. Error: PETSC_ERR_ARG_WRONG for another kind of detector. */
PetscErrorCode SbBvhGetCounts(SbDetector detector, SbBvhCounts *counts);
