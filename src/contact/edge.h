/*
  edge.h - edges: made from facets, and when two of them meet.
*/
#pragma once
#include "sbdetect.h"
#include "sbkernel.h"

/* A side of a facet, from its corner k to the next one. */
typedef struct {
  PetscInt low, high; /* identities of the mesh vertices at its ends, low < high */
  PetscInt part, id;  /* of the facet */
  PetscInt at;        /* 3 facet + k, the facet by any number of the caller's */
  PetscBool forward;  /* it leads from low to high */
} SbSide;

/*
  SbSidesPair - the edges: where two sides, and no more, have the same ends and opposite directions. Not collective.

  Input: side[n], sorted here; those with low = high are passed over. Output: nedge; edge[nedge][2], room for n/2: `at` of both sides, that
  of the facet with the lower identity first.
*/
PetscErrorCode SbSidesPair(PetscInt n, SbSide side[], PetscInt *nedge, PetscInt edge[][2]);
/* Side k of a facet with these vertices. */
void SbSideSet(const PetscInt vertex[3], PetscInt part, PetscInt id, PetscInt at, SbSide *side);
/* All edges of a scene, all own ones. For scenes that are whole on one rank. Not collective; SbEdgesDestroy(). */
PetscErrorCode SbEdgesCreate(const SbDetectScene *scene, SbEdges *edges);
PetscErrorCode SbEdgesDestroy(SbEdges *edges);

/* An edge where it is. */
typedef struct {
  const PetscReal *x[4];  /* ends, third corners of its two facets, m */
  const PetscReal *x0[2]; /* ends at the start of the step, m; NULL: motion is not examined */
  PetscReal thick;        /* as in SbEdges, m */
  PetscReal into[2][3];   /* unit vectors across the edge into its facets */
} SbEdgePlace;

typedef enum { SB_EDGE_FLAT, SB_EDGE_BENT, SB_EDGE_SHARP } SbEdgeKind;
/* How much the surface bends at the edge with these corners; flat where it is not convex. */
SbEdgeKind SbEdgeKindOf(const PetscReal *const x[4]);
/* Sets place->into. The facets have an area. */
void SbEdgeInto(SbEdgePlace *place);
/*
  SbEdgesMeet - whether two edges that are not flat are a pair: the normal, which leads away from the second one, is within both normal cones, and they
  are within the reach and cross between their ends, or went through each other within the step.

  Not collective. Output: at, normal, gap and crossed of pair.
*/
PetscBool SbEdgesMeet(const SbEdgePlace *first, const SbEdgePlace *second, PetscReal reach, SbEdgePair *pair);
/* Squared distance of two segments with these ends, m^2; also where they have no length. */
PetscReal SbEdgesDistance2(const PetscReal *const a[2], const PetscReal *const b[2]);
