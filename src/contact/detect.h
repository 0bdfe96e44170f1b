/*
  detect.h - what the kinds of detector share: boxes in, candidates out, one narrow phase.

  SbDetectorFind() makes the boxes, the kind lists candidates, near.c looks at them closely. Results do not depend on what else is
  among the candidates, nor on their order, so all kinds return the same contacts.
*/
#pragma once
#include "sbdetect.h"
#include "sbkernel.h"

#define SB_BOX_ROUNDING 16 /* in units of eps |x|: what the corners of a box may be off */

/*
  A kind of detector. Not collective.

  search - candidates of each point of the scene, from d->facet_box and d->point_box into d->start and d->candidate. Each pair once. A
  pair may be missing only when its boxes do not meet (SbBoxesMeet), or when the kind proves that point and facet stay farther apart
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

/* Who touches whom among the facets, by identity of part and vertex; made anew when the facets are other ones. */
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
  struct SbDetectSharp *sharp; /* edge_find.c; NULL until edges are looked for */
  SbDetectStats stats;
};

/* Room for the boxes of this scene; d->same_facets. Not collective. */
PetscErrorCode SbDetectBegin(SbDetector d, const SbDetectScene *scene);
/* The candidates, boxes being there. Not collective. */
PetscErrorCode SbDetectCandidates(SbDetector d, const SbDetectScene *scene);
/* Not collective. */
PetscErrorCode SbDetectSharpDestroy(SbDetector d);

/* Grows the box of what is within it now to what may come within the reach. */
static inline void SbDetectBoxGrow(PetscReal reach, PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    const PetscReal far = PetscMax(PetscAbsReal(box[k]), PetscAbsReal(box[3 + k]));
    const PetscReal margin = reach + SB_BOX_ROUNDING * PETSC_MACHINE_EPSILON * (far + reach);

    box[k] -= margin;
    box[3 + k] += margin;
  }
}

/* Makes room for n candidates; those there are kept. Not collective. */
PetscErrorCode SbCandidatesReserve(SbDetector d, PetscInt64 n);

/* Whether two boxes share a point. */
static inline PetscBool SbBoxesMeet(const PetscReal a[6], const PetscReal b[6])
{
  return (PetscBool)(a[0] <= b[3] && b[0] <= a[3] && a[1] <= b[4] && b[1] <= a[4] && a[2] <= b[5] &&
                     b[2] <= a[5]);
}

/* Whether the scene wants this pair at all; near.c looks at the finer conditions of self-contact. */
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

/* Where on a triangle: its corner 0, 1 or 2, its edge from corner 0 to 1, 1 to 2, 2 to 0, or its inside. */
typedef enum {
  SB_CORNER_0,
  SB_CORNER_1,
  SB_CORNER_2,
  SB_EDGE_0,
  SB_EDGE_1,
  SB_EDGE_2,
  SB_INSIDE
} SbTrianglePlace;

/*
  SbClosestPoint - the point of a triangle nearest to p.

  Not collective. Input: p[3]; x[k][3], corners, m. Output: weight[3], none negative, sum 1; d2, squared distance, m^2. Triangles without
  area are segments or points; the place then is never SB_INSIDE. NaN in, NaN out.
*/
SbTrianglePlace SbClosestPoint(const PetscReal p[3], const PetscReal *const x[3], PetscReal weight[3],
                               PetscReal *d2);

/*
  SbCrossing - whether a point goes through a triangle from its front to its back and stays behind it.

  Not collective. Point and corners move on straight lines. Input: p0[3], p1[3], point at the start and end of the step; x0[k][3], x1[k][3],
  corners, m; slack, a start behind the triangle by no more than this is in front of it; rest, an end behind it by no more than this does not count, m.
  Output: time, of the step, in [0, 1]; behind, the start was behind it.
*/
PetscBool SbCrossing(const PetscReal p0[3], const PetscReal p1[3], const PetscReal *const x0[3],
                     const PetscReal *const x1[3], const PetscReal tolerance[2], PetscReal *time,
                     PetscBool *behind);

/*
  SbEdgeCrossing - whether an edge goes through another one from its front to its back and stays behind it.

  Not collective. In front is where (e[0] - f[0]) . (e x f) is positive, e and f from the first to the second end; with the ends of
  one edge exchanged it is the other side. Input: ends at the start and end of the step, m. The rest as for SbCrossing().
*/
PetscBool SbEdgeCrossing(const PetscReal *const e0[2], const PetscReal *const e1[2],
                         const PetscReal *const f0[2], const PetscReal *const f1[2],
                         const PetscReal tolerance[2], PetscReal *time, PetscBool *behind);

/* Constructors: fill d->ops and d->data. */
PetscErrorCode sb_detector_hash(SbDetector d);
PetscErrorCode sb_detector_brute(SbDetector d);
PetscErrorCode sb_detector_bvh(SbDetector d);
