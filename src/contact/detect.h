/*
  detect.h - what the kinds of detector share: boxes in, candidates out, one narrow phase.

  SbDetectorFind() makes the boxes, the kind lists candidates, near.c examines them. Results do not depend on what else is
  among the candidates, nor on their order, so all kinds return the same contacts.
*/
#pragma once
#include "sbdetect.h"
#include "sbkernel.h"

/*
  A kind of detector. Not collective.

  search - candidates of each point of the scene, from d->facet_box and d->point_box into d->start and d->candidate. Each pair once. A
  pair may be missing only when its boxes do not meet (SbBoxesOverlap), or when the kind proves that point and facet stay farther apart
  than the reach and do not cross, or when the scene does not want it (SbDetectPairWanted). Facets that do not face the point must not be
  missing where others are there: near.c learns from them whether the point is inside. The candidates of one point may come in any order. The scene may be
  empty, and may differ in all counts from that of the last call: what depends on the choice of facets is kept while d->same_facets
  holds. Sets d->stats.memory, .rebuilt and .text.
  destroy - frees d->data. NULL when there is nothing.
*/
typedef struct {
  const char *name;
  PetscErrorCode (*search)(SbDetector d, const SbDetectScene *scene);
  PetscErrorCode (*destroy)(SbDetector d);
} SbDetectorOps;

/* Who touches whom among the facets, by identity of part and vertex; rebuilt when the facets are other ones. */
typedef struct {
  PetscInt nvertex;
  PetscInt *vertex;     /* [nfacet][3] number in 0..nvertex-1 */
  PetscInt *ring_start; /* [nvertex+1] */
  PetscInt *ring;       /* [3 nfacet] 3 facet + corner, for each vertex the corners that lie on it */
} SbDetectRings;

struct _p_SbDetector {
  SbDetectKind kind;
  SbDetectorOps ops;
  void *data; /* the kind's own */
  /* of the scene in this call; the kind reads them */
  PetscReal *
    facet_box; /* [nfacet][6] lower and upper corner, m: of now and the start of the step, grown by reach and rounding */
  PetscReal *point_box;  /* [npoint][6] the same, not grown; without p0 both corners are p */
  PetscBool same_facets; /* they are those of the last call, elsewhere */
  /* candidates; the kind fills them */
  PetscInt *start;     /* [npoint+1], allocated before search() */
  PetscInt *candidate; /* [start[npoint]], grown by SbCandidatesReserve() */
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

/* Makes room for n candidates; those there are kept. Not collective. */
PetscErrorCode SbCandidatesReserve(SbDetector d, PetscInt64 n);

/* Whether the scene wants this pair at all; near.c examines the finer conditions of self-contact. */
static inline PetscBool SbDetectPairWanted(const SbDetectScene *s, PetscInt point, PetscInt facet)
{
  return (PetscBool)(s->self || s->point_part[point] != s->facet_part[facet]);
}

/*
  SbDetectNarrow - the contacts among the candidates, into d->near. Not collective.

  Output: n; d->stats.candidates is set.
*/
PetscErrorCode SbDetectNarrow(SbDetector d, const SbDetectScene *scene, PetscInt *n);
/* Makes or keeps d->rings (d->same_facets). Not collective. */
PetscErrorCode SbDetectRingsUpdate(SbDetector d, const SbDetectScene *scene);
PetscErrorCode SbDetectRingsDestroy(SbDetector d);

/* Constructors: fill d->ops and d->data. */
PetscErrorCode SbDetectorCreate_Hash(SbDetector d);
PetscErrorCode SbDetectorCreate_Brute(SbDetector d);
PetscErrorCode SbDetectorCreate_BVH(SbDetector d);
