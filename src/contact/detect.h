/*
  detect.h - boxes in, candidates out, one narrow phase.

  SbDetectorFind() makes the boxes and lists candidates, near.c examines them. Results do not depend on what else is among the
  candidates, nor on their order.
*/
#pragma once
#include "sbdetect.h"
#include "sbkernel.h"

/* Who touches whom among the facets, by identity of part and vertex; rebuilt when the facets are other ones. */
typedef struct {
  PetscInt nvertex;
  PetscInt *vertex;     /* [nfacet][3] number in 0..nvertex-1 */
  PetscInt *ring_start; /* [nvertex+1] */
  PetscInt *ring;       /* [3 nfacet] 3 facet + corner, for each vertex the corners that lie on it */
} SbDetectRings;

struct _p_SbDetector {
  SbDetectKind kind;
  SbBoxTree tree; /* over facet_box */
  /* of the scene in this call */
  PetscReal *
    facet_box; /* [nfacet][6] lower and upper corner, m: of now and the start of the step, grown by reach and rounding */
  PetscReal *point_box;  /* [npoint][6] the same, not grown; without p0 both corners are p */
  PetscBool same_facets; /* they are those of the last call, elsewhere */
  PetscInt *start;       /* [npoint+1] */
  PetscInt *candidate;   /* [start[npoint]] */
  PetscInt candidate_size;
  /* detect.c and near.c */
  PetscInt facet_size, point_size, ring_size, hit_size, near_size; /* what is allocated, in items */
  PetscInt version, nfacet; /* of the last call; nfacet = -1: none yet */
  SbDetectRings rings;
  struct SbDetectHit *hit; /* [2 hit_size] of one point: near facets, then those it went through */
  SbNear *near;
  struct SbDetectSharp *sharp; /* edge_find.c; NULL until edges are searched for */
  SbDetectStats stats;
};

/* Room for the boxes of this scene; d->same_facets. Not collective. */
PetscErrorCode SbDetectBegin(SbDetector d, const SbDetectScene *scene);
/* The candidates, boxes being there. Not collective. */
PetscErrorCode SbDetectCandidates(SbDetector d, const SbDetectScene *scene);
/* Not collective. */
PetscErrorCode SbDetectSharpDestroy(SbDetector d);

/*
  SbDetectNarrow - the contacts among the candidates, into d->near. Not collective.

  Output: n; d->stats.candidates is set.
*/
PetscErrorCode SbDetectNarrow(SbDetector d, const SbDetectScene *scene, PetscInt *n);
/* Makes or keeps d->rings (d->same_facets). Not collective. */
PetscErrorCode SbDetectRingsUpdate(SbDetector d, const SbDetectScene *scene);
PetscErrorCode SbDetectRingsDestroy(SbDetector d);
