/*
  sbdetect.h - layer 3: where the surfaces of bodies come near each other.

  A surface is a set of triangles. What searches for it are points: the nodes that carry a surface, vertices of P1 and
  centroids of boundary faces of CR and DG. SbContactSurface brings to each rank what its points may meet; a detector then is
  geometry alone: arrays in, arrays out, no communication.
*/
#pragma once
#include "sbfem.h"
#include "sbgeometry.h"

/*
  Edges between two facets of one part. The first two corners are its ends, counter-clockwise in that of its facets with the lower identity; the
  third is the third one of this facet, the fourth that of the other facet. The identity is 3 facet + side of the first facet.
*/
typedef struct {
  PetscInt n, nown;
  PetscInt *corner; /* [n][4] */
  PetscInt *vertex; /* [n][2] identities of the mesh vertices at its ends */
  PetscInt *part;   /* [n] */
  PetscInt *id;     /* [n] */
  PetscReal *thick; /* [n] the part is at least so thick there at rest, m; 0: not known */
} SbEdges;

/*
  What a detector works on. Arrays are borrowed. A part is a body: points do not meet facets of their own part unless `self`.
  Identities (facet_id, facet_vertex, point_id) are the same on all ranks and for any partition: ties are broken by them.
*/
typedef struct {
  PetscInt ncorner;
  const PetscReal *x; /* [ncorner][3] where the corners are, m */
  const PetscReal
    *x0; /* [ncorner][3] where they were at the start of the step, m; NULL: motion is not examined */
  const PetscReal *X; /* [ncorner][3] rest position, m */
  PetscInt nfacet;
  const PetscInt *facet; /* [nfacet][3] corners, counter-clockwise seen from outside */
  const PetscInt
    *facet_vertex; /* [nfacet][3] identity of the mesh vertex at each: facets that share two are neighbours,
                                   also where their corners are apart (CR, DG) */
  const PetscInt *facet_part; /* [nfacet] */
  const PetscInt *facet_id;   /* [nfacet] */
  const SbEdges *edges;       /* own ones first; NULL: none */
  PetscInt npoint;
  const PetscReal *p, *p0, *P; /* [npoint][3] like x, x0, X */
  const PetscReal *p_normal;   /* [npoint][3] outward unit normal of the point's own surface now */
  const PetscReal *
    p_way; /* [npoint][3] unit vectors: the separation direction of the part `p_way_part` (-1: of none) for points in it; NULL: the
                                  nearest place */
  const PetscInt *p_way_part; /* [npoint] */
  const PetscInt *point_part; /* [npoint] */
  const PetscInt *point_id;   /* [npoint] */
  const PetscInt
    *point_vertex; /* [npoint] identity of the mesh vertex that the point is, -1: the centroid of a facet */
  const PetscInt *point_facet; /* [npoint] identity of that facet, -1: a vertex */
  PetscBool self;              /* parts may meet themselves */
  PetscReal reach;             /* pairs up to this distance are wanted, m; penetration likewise */
  PetscReal
    deep; /* penetration of other parts up to this depth, if it is more, m; costs like a reach of that size */
  PetscInt version; /* changes when facets or edges are other ones, not only elsewhere */
} SbDetectScene;

/*
  A point and the nearest point of another part's surface. The gap is the signed distance, negative inside; the normal is the
  direction in which it grows, outwards from the facet's part.
*/
typedef struct {
  PetscInt point, facet;
  PetscReal weight[3]; /* of the facet's corners, sum 1, none negative */
  PetscReal normal[3];
  PetscReal gap; /* m */
  PetscReal
    depth; /* how far it is in the part, which is less than -gap where the nearest separation direction is another one; 0: not, m */
  PetscBool crossed; /* found by its motion: within the step it went through the facet */
} SbNear;

/*
  Two edges of different parts that cross each other seen along the normal, which is perpendicular to both. The gap is the distance along it,
  negative when the edges are in each other's part; it grows when the first edge moves along the normal.
*/
typedef struct {
  PetscInt
    edge[2]; /* the first one is an own sharp one, with the lower identity if the second is sharp, too */
  PetscReal at[2]; /* the nearest places, 0 at the first end of the edge, 1 at its second */
  PetscReal normal[3];
  PetscReal gap; /* m */
  PetscReal
    depth; /* how far their nearest places are below the facets at the other edge, the least of these; 0: not, m */
  PetscBool crossed; /* found by its motion: within the step the edges went through each other */
} SbEdgePair;

/* How far from a point facets are searched for, m. */
static inline PetscReal SbDetectRange(const SbDetectScene *s)
{
  return PetscMax(s->reach, s->deep);
}

typedef enum { SB_DETECT_TREE, SB_DETECT_BRUTE } SbDetectKind;
typedef struct {
  PetscInt64 candidates; /* pairs of point and facet that were examined */
  PetscInt found;
  PetscInt64 memory; /* bytes of the tree */
  PetscInt rebuilt;  /* how often it was rebuilt, of all calls so far */
  char text[256];    /* what the detector says of itself */
} SbDetectStats;

typedef struct _p_SbDetector *SbDetector;
/* A tree over the boxes of facets, or all boxes. Not collective. */
PetscErrorCode SbDetectorCreate(SbDetectKind kind, SbDetector *detector);
PetscErrorCode SbDetectorDestroy(SbDetector *detector);
/*
  SbDetectorFind - all contacts of the scene within its reach: for each point and each other part at most one, the nearest.

  Not collective. Every kind of detector returns the same contacts, ordered by point and then by the facet's part. For `self`, pairs that
  are near each other at rest already (within twice the reach) do not count. A pair counts when the normals of point and facet oppose
  each other.

  Output: n; near[n], owned by the detector, valid until the next call.
*/
PetscErrorCode SbDetectorFind(SbDetector detector, const SbDetectScene *scene, PetscInt *n,
                              const SbNear **near);
/*
  SbDetectorFindEdges - all pairs of a sharp edge and a sharp or bent one, of two parts, that are within the reach of each other, or in each
  other by up to a quarter of it, or went through each other within the step.

  Not collective. Every kind of detector returns the same pairs, ordered by the first edge and by the identity of the second. An edge is bent
  where the surface is convex and its facets' normals are more than 3 degrees apart, sharp where it is more than 26. A pair counts when its normal leads away
  from both parts: where it does not, points and facets are nearer. For `self` as above.

  Output: n; pair[n], owned by the detector, valid until the next call.
*/
PetscErrorCode SbDetectorFindEdges(SbDetector detector, const SbDetectScene *scene, PetscInt *n,
                                   const SbEdgePair **pair);

PetscErrorCode SbDetectorGetStats(SbDetector detector, SbDetectStats *stats);

/*
  SbContactSurface - the surfaces that may meet, distributed: the scene of this rank, and which nodes its points and facets belong to.
  Own corners, facets and points come first, then the facets of other ranks that are near points or edges of this one.

  Each edge is owned by one rank: with P1 by the owner of that of its vertices with the lower identity, else by the owner of its first
  facet. The pairs that a rank finds are those of its own edges.
*/
typedef struct _p_SbSurface *SbContactSurface;
struct _p_SbSurface {
  SbSpace space; /* borrowed */
  SbDetectScene scene;
  PetscInt nfacet_owned;
  PetscInt *point_node;  /* [npoint] local node, owned by this rank */
  PetscReal *point_area; /* [npoint] rest area of its share of the surface, complete, m^2 */
  PetscInt *facet_node;  /* [nfacet][4] global numbers of the nodes of the facet's cell */
  PetscReal *
    facet_weight; /* [nfacet][3][4] displacement of corner k = sum_a facet_weight[3 f + k][a] u[facet_node[4 f + a]] */
  PetscReal *facet_height; /* [nfacet] rest height of the cell behind, m */
  PetscInt *edge_node;     /* [nedge][4] like facet_node, of the edge's first facet */
  PetscReal *edge_weight;  /* [nedge][2][4] like facet_weight, of its ends */
  PetscInt *
    edge_carrier; /* [edges->nown][2] global numbers of the nodes of its ends with P1, of its two facets with CR and DG */
  PetscInt *edge_facet; /* [edges->nown] the first facet, as one of those given to SbContactSurfaceCreate() */
  PetscReal size;       /* of all bodies at rest, m */
  PetscReal edge;       /* mean rest edge of all facets, m */
  void *data;           /* private */
};
/*
  SbContactSurfaceCreate - from boundary facets as SbEffectFacets() gives them (of owned and ghost cells; copied). Collective.
  A part is a body; own facets are those of owned cells.
*/
PetscErrorCode SbContactSurfaceCreate(SbSpace space, PetscInt n, const SbFacet facet[],
                                      SbContactSurface *surface);
PetscErrorCode SbContactSurfaceDestroy(SbContactSurface *surface);
/*
  SbContactSurfaceUpdate - moves corners and points to the local displacements u (m) and, when u0 is not NULL, those at the start of the step,
  and brings the facets of other ranks that may come within `reach` of own points or own edges. Collective.

  Output: close, whether two parts' boxes (swept, and grown by the reach) meet anywhere, the same on all ranks; when not, and no self-contact
  is wanted, nothing but the boxes has been exchanged and the scene holds no facets of others.
  The list of facets from other ranks is kept while nothing has moved by more than half the margin it was made with.
*/
PetscErrorCode SbContactSurfaceUpdate(SbContactSurface surface, const PetscReal u0[], const PetscReal u[],
                                      PetscReal reach, PetscBool self, PetscBool *close);

/*
  SbInside - which points of a surface lie in tets of another part or, with `self`, of their own (src/contact/inside.c).

  Create: collective; the surface is borrowed.
  Find: collective, after an SbContactSurfaceUpdate(), for local displacements u (m). Output: part[npoint], the part that a point is in, with the lowest number of several, -1: none.
  Points on the boundary of a body are not in it. In its own part a point is in those tets that were farther from it than twice the reach at rest.
*/
typedef struct _p_SbInside *SbInside;
PetscErrorCode SbInsideCreate(SbContactSurface surface, SbInside *inside);
PetscErrorCode SbInsideDestroy(SbInside *inside);
PetscErrorCode SbInsideFind(SbInside inside, const PetscReal u[], PetscBool self, PetscInt part[]);
