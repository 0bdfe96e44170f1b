/*
  pairs.h - surfaces in contact: vertices, edges and triangles of bodies and of an obstacle, contact
  pairs, continuous collision detection, penetrations, the barrier potential of a pair.

  A rank holds the features (vertices, edges, triangles) that have a node of it, and those of other
  ranks that may meet them; a vertex of a body is a weighted mean of nodes, for every element. It
  evaluates every pair that has one of its own nodes: forces on them are complete without
  communication, and summed in an order that no partition changes.
*/
#pragma once
#include "obstacle.h"
#include "sbsolver.h"

typedef struct _p_SbContactSurface *SbContactSurface;
#define SB_CONTACT_ARRAYS 16 /* most arrays of a surface */
struct _p_SbContactSurface {
  SbSpace space;  /* borrowed */
  PetscBool self; /* self-contact, too; set by the caller, false at first */
  PetscReal
    rim; /* prescribed vertices less deep in another body than this stand there like the rims
                     of two blocks on one clamped base, m; set by the caller, 0 at first */
  /* what this rank holds. Kept features come first, in the order of their numbers, then those of
     other ranks, last the obstacle's; of vertices: a number stays the same within a step */
  PetscInt nvertex, nbody_vertex;
  PetscInt ntriangle, nbody_triangle, nedge;
  PetscInt nkept_vertex, nkept_triangle, nkept_edge; /* without the obstacle's; all its edges */
  PetscInt *start, *gnode;   /* [nbody_vertex+1]; nodes of a vertex, [start[nbody_vertex]] as those
                              below, global numbers ascending */
  PetscInt *node;            /* the same as local nodes, -1: not known here */
  PetscInt *column, ncolumn; /* the same by numbers 0 to ncolumn - 1; NULL: gnode below Nnode */
  PetscReal *weight;
  uint8_t *fixed;   /* bit c: component c of the node is prescribed; SbContactSurfaceMarkDriven() */
  PetscInt *part;   /* [nvertex] body, nbody: the obstacle */
  PetscInt *number; /* [nvertex] among those of all ranks, no partition changes it; NULL: as here */
  PetscSFNode *remote; /* [nbody_vertex] rank that owns it, number there */
  uint8_t *mine;       /* [nvertex] some node is owned here */
  uint8_t *own; /* [nvertex] this rank counts it: exactly one rank does; the obstacle's: rank 0 */
  uint8_t *driven;           /* [nvertex] its motion is prescribed in all directions */
  PetscInt *triangle;        /* [ntriangle][3] counter-clockwise seen from outside */
  PetscInt *edge;            /* [nedge][2], the lower number first */
  PetscInt *triangle_number; /* [ntriangle], as number[] */
  PetscInt *edge_number;     /* [nedge] */
  PetscReal *X;              /* [nvertex][3] at rest, m; obstacle: its rest frame */
  PetscReal *area,
    *edge_area;     /* [nvertex], [nedge] a third of the triangles around, at rest, m^2 */
  PetscBool once;   /* what pairs share counts once (pair_energy.c); set by the caller, false at
                            first */
  PetscReal *share; /* [ntriangle][6] parts of its sides 01, 12, 20 and corners, as below */
  PetscReal *edge_share;         /* [nedge][2] parts of its ends */
  PetscReal radius;              /* of the obstacle's vertices and edges (sphere, capsule), m */
  SbObstacleSide side;           /* half-space or bowl, whose vertices are described there */
  PetscInt Nbody_vertex;         /* of all ranks */
  PetscReal shortest, mean_edge; /* shortest and mean edge of the bodies at rest, m */
  PetscReal size;                /* diagonal of the smallest body, m */
  PetscReal farthest;            /* largest coordinate at rest, m */
  /* several ranks (contact_halo.c) */
  PetscBool halo;   /* features of other ranks are held */
  PetscBool drop;   /* the next search drops vertices that are no longer near */
  PetscInt nneeded; /* of other ranks in the last search */
  PetscSF sf;       /* from own vertices to those that others hold; NULL: one rank */
  PetscInt *halo_number, *halo_vertex; /* [nbody_vertex - nkept_vertex] of other ranks, ascending */
  PetscInt *group;                     /* [nkept_triangle] group of neighbours of one body */
  PetscMPIInt *ngroup;                 /* [ranks] */
  PetscInt room[4];                    /* of vertices, nodes of vertices, triangles, edges */
  int narray;
  PetscReal **array[SB_CONTACT_ARRAYS]; /* of SbContactSurfaceCreateArray() */
};
static inline PetscInt SbContactNumber(SbContactSurface mesh, PetscInt v)
{
  return mesh->number ? mesh->number[v] : v;
}

/* The surface of the facets of SbEffectFacets() and of an obstacle that is set up (NULL: none).
   MarkDriven, once all effects are set up: marks prescribed unknowns. Collective. */
PetscErrorCode SbContactSurfaceCreate(SbSpace space, PetscInt n, const SbFacet facet[],
                                      SbObstacle obstacle, SbContactSurface *mesh);
PetscErrorCode SbContactSurfaceDestroy(SbContactSurface *mesh);
PetscErrorCode SbContactSurfaceMarkDriven(SbContactSurface mesh);
/* An array x[nvertex][3], zeros, that grows with the vertices that this rank holds, *x moves then;
   released with the surface or by Destroy. Not collective. */
PetscErrorCode SbContactSurfaceCreateArray(SbContactSurface mesh, PetscReal **x);
PetscErrorCode SbContactSurfaceDestroyArray(SbContactSurface mesh, PetscReal **x);
/* x[nvertex][3] of the bodies' vertices from local displacements u (ghosts up to date), m.
   Collective. */
PetscErrorCode SbContactSurfaceGetPositions(SbContactSurface mesh, const PetscReal u[],
                                            PetscReal x[]);
/* x[nvertex][3] of bodies' vertices from their owners. Sum: x[nvertex][n], sums over all ranks that
   hold a vertex. Collective. */
PetscErrorCode SbContactSurfaceUpdate(SbContactSurface mesh, PetscReal x[]);
PetscErrorCode SbContactSurfaceSum(SbContactSurface mesh, PetscMPIInt n, PetscReal x[]);
/* Outward normals of all vertices at x, of twice the area of the triangles around, m^2.
   Collective. */
PetscErrorCode SbContactSurfaceNormals(SbContactSurface mesh, const PetscReal x[],
                                       PetscReal normal[]);
/*
  SbContactSurfaceReach - holds the features of other ranks that may meet those of this one on the
  linear motion of the vertices from x0 to x1, grown by `grown` on each side, m, in place of those
  held so far; vertices stay.

  Collective. x0 and x1 are of SbContactSurfaceCreateArray(), and may move.
*/
PetscErrorCode SbContactSurfaceReach(SbContactSurface mesh, PetscReal grown, const PetscReal x0[],
                                     const PetscReal x1[]);
/* The whole surface on every rank with positions y[nvertex][3] of x[nvertex][3], without nodes of
   vertices. The caller frees both. Collective. */
PetscErrorCode SbContactSurfaceGather(SbContactSurface mesh, const PetscReal x[],
                                      SbContactSurface *whole, PetscReal **y);
/* Holds the vertices with these numbers, the same on all ranks; returns v[n], what they are here.
   Collective. */
PetscErrorCode SbContactSurfaceHold(SbContactSurface mesh, PetscInt n, const PetscInt number[],
                                    PetscInt v[]);
/* The address of an array of SbContactSurfaceCreateArray(), which follows it; NULL: another one. */
static inline PetscReal *const *SbContactSurfaceFollow(SbContactSurface mesh, const PetscReal x[])
{
  for (int i = 0; i < mesh->narray; i++)
    if (*mesh->array[i] == x)
      return mesh->array[i];
  return NULL;
}
/* Of contact_array.c and contact_halo.c: room for features; nodes of vertex v; where groups, the
   star forest and columns are set up. */
PetscErrorCode SbContactSurfaceRoom(SbContactSurface mesh, PetscInt nvertex, PetscInt nentry,
                                    PetscInt ntriangle, PetscInt nedge);
PetscErrorCode SbContactSurfaceFindNodes(SbContactSurface mesh, PetscInt v);
PetscErrorCode SbContactSurfaceShareOut(SbContactSurface mesh);
/* Area of a triangle of the vertices v; n[3], its normal, twice as long. */
static inline PetscReal SbContactTriangleArea(const PetscReal x[], const PetscInt v[3],
                                              PetscReal n[3])
{
  PetscReal a[3], b[3];

  SbSubtract(x + 3 * v[1], x + 3 * v[0], a);
  SbSubtract(x + 3 * v[2], x + 3 * v[0], b);
  SbCross(a, b, n);
  return 0.5 * PetscSqrtReal(SbDot3(n, n));
}

/* Two features: vertex 0 and triangle 1 to 3; edges 0 1 and 2 3; or vertex 0 and the side of the
   obstacle. */
typedef struct {
  PetscBool side;
  SbPairKind
    kind; /* SB_PAIR_VERTEX_TRIANGLE or SB_PAIR_EDGE_EDGE; with a side SB_PAIR_VERTEX_VERTEX */
  PetscInt v[4];      /* vertices of the mesh */
  PetscReal area;     /* m^2 */
  PetscReal share[6]; /* parts of lower features that other pairs count too: of the sides and
                         corners of the triangle, or of the four ends of edges; 0: each pair counts */
  PetscBool rims;     /* both sides have prescribed vertices, and one has others */
} SbContactPair;

/* Number of vertices on the first side. */
static inline int SbContactPairSplit(const SbContactPair *pair)
{
  return pair->kind == SB_PAIR_EDGE_EDGE ? 2 : 1;
}

/* The part, a body or the obstacle, of side 0 or 1. */
static inline PetscInt SbContactPairPart(SbContactSurface mesh, const SbContactPair *pair, int side)
{
  return mesh->part[pair->v[side ? SbContactPairSplit(pair) : 0]];
}

/* Radius of the obstacle if it is one of the sides, m. */
static inline PetscReal SbContactPairRadius(SbContactSurface mesh, const SbContactPair *pair)
{
  return PetscMax(pair->v[0], pair->v[SbContactPairSplit(pair)]) >= mesh->nbody_vertex
           ? mesh->radius
           : 0.;
}

/* How pairs are searched for, -effect_X_search; the pairs are the same. */
typedef enum {
  SB_SEARCH_AUTO,
  SB_SEARCH_HASH,
  SB_SEARCH_TREE
} SbContactSearch;

/* Search and its results; x0 and x1 below are arrays of SbContactSurfaceGetPositions(). */
typedef struct _p_SbContactPairs *SbContactPairs;
struct _p_SbContactPairs {
  SbContactSurface mesh; /* borrowed */
  PetscReal reach;       /* pairs nearer than this are found, m */
  PetscReal margin;      /* by which boxes are grown, m */
  PetscInt nbox;
  PetscReal *box; /* [nbox][6] within which vertices may move before pairs are searched for again */
  PetscReal *shorter; /* [nvertex][3] end of a motion that was halved */
  SbSpatialHash hash; /* NULL: trees */
  struct SbContactFeatures
    *features;         /* [6] vertices, triangles and edges, each of this rank and of others */
  PetscBool known;     /* cleared by who changes `near` */
  const uint8_t *near; /* [all] SbContactOverlap.near, borrowed: excludes such pairs; NULL: none */
  PetscInt n, size;
  SbContactPair *pair; /* [n] all that have nodes of this rank; by kind, then vertices; last those
                          with a side of the obstacle */
  PetscInt box_room, first_room, other_size, *first, *place; /* work of ordering them */
  SbContactPair *other;
  PetscInt ncandidate; /* pairs of boxes that met in the last search */
  PetscInt nsearch,
    most; /* searches; number of pairs at which they end, and whether the last one did */
  PetscBool full;
};
PetscErrorCode SbContactPairsCreate(SbContactSurface mesh, PetscReal reach, SbContactSearch search,
                                    SbContactPairs *pairs);
PetscErrorCode SbContactPairsDestroy(SbContactPairs *pairs);
/* At the start of a step, when nothing names vertices of other ranks: the next search lets go of
   those that are not near, if they are many. Not collective. */
void SbContactPairsForget(SbContactPairs pairs);
/* All pairs that come within the reach on the linear motion from x0 to x1, and some more. x0 and x1
   may move (SbContactSurfaceReach()). Collective. */
PetscErrorCode SbContactPairsFind(SbContactPairs pairs, const PetscReal x0[], const PetscReal x1[]);
/* The gap, m: the distance less the radius; closest points and direction in `distance`. Not
   collective. */
PetscReal SbContactPairGap(SbContactSurface mesh, const SbContactPair *pair, const PetscReal x[],
                           SbDistance *distance);
/* Distance of the prescribed parts of a pair with rims, m: nothing else changes it. */
PetscReal SbContactPairRimGap(SbContactSurface mesh, const SbContactPair *pair,
                              const PetscReal x[]);
/* Whether the boxes of both features swept from x0 to x1 are farther apart than `distance`, m. */
static inline PetscBool SbContactPairSweptApart(SbContactSurface mesh, const SbContactPair *pair,
                                                const PetscReal x0[], const PetscReal x1[],
                                                PetscReal distance)
{
  const int split = SbContactPairSplit(pair);
  const PetscReal reach = distance + SbContactPairRadius(mesh, pair);

  for (int k = 0; k < 3 && !pair->side; k++) {
    PetscReal low[2] = {PETSC_MAX_REAL, PETSC_MAX_REAL};
    PetscReal high[2] = {PETSC_MIN_REAL, PETSC_MIN_REAL};

    for (int a = 0; a < 4; a++) {
      const PetscReal p = x0[3 * pair->v[a] + k];
      const PetscReal q = x1[3 * pair->v[a] + k];
      const int side = a >= split;

      low[side] = PetscMin(low[side], PetscMin(p, q));
      high[side] = PetscMax(high[side], PetscMax(p, q));
    }
    if (low[0] > high[1] + reach || low[1] > high[0] + reach)
      return PETSC_TRUE;
  }
  return PETSC_FALSE;
}
/* Largest collision-free fraction, 0..1, of the motion from x0 to x1, for this rank's pairs; each
   keeps a tenth of its gap; body[nbody], unless NULL, is lowered to that of the body's own pairs.
   As SbContactPairsFind(). Collective. */
PetscErrorCode SbContactPairsMaxStep(SbContactPairs pairs, const PetscReal x0[],
                                     const PetscReal x1[], PetscReal body[], PetscReal *part);
/* A penetrating vertex, or the midpoint of the penetrating part of an edge. */
typedef struct {
  PetscInt number; /* among those of all ranks */
  PetscInt n, v[5];
  PetscReal weight[5]; /* sum 0, n . sum weight x = -depth; for a round obstacle less its radius */
  PetscReal normal[3], depth, area; /* separation direction; m, m^2 */
} SbPenetration;
/* Of a vertex: adjacent to intersected ones; its edges or triangles intersect a surface; it is
   inside one. */
enum {
  SB_OVERLAP_ADJACENT = 1,
  SB_OVERLAP_INTERSECTED,
  SB_OVERLAP_INSIDE
};
/* Of a part: its surface touched another one face to face when the run began; it does now; some
   vertex and triangle do; it overlaps another part; it did, and is not yet apart by the width. */
enum {
  SB_TOUCH_ONCE = 1,
  SB_TOUCH_NOW = 2,
  SB_TOUCH_VERTICES = 4,
  SB_TOUCH_OVERLAP = 8,
  SB_TOUCH_PARTED = 16
};
/* The direction in which two parts separate as a whole, the lower one along n; 0: none. */
typedef struct {
  PetscInt part[2];
  PetscReal n[3];
} SbOverlapWay;
/* Start with {0}; release with SbContactOverlapFree(). The same on every rank but for
   the points, of which a rank has those with nodes of it. */
typedef struct {
  PetscInt
    ncrossing; /* edges that intersect triangles, or features behind a round or one-sided obstacle */
  PetscBool coplanar; /* set by the caller: also overlaps whose sides lie in common planes, which
                         hide that an edge goes through a triangle */
  PetscInt part[2];   /* of the first of them, or of the largest depth: body, or nbody for the
                       obstacle */
  PetscReal place[3], deepest; /* position of it; largest depth of a point along its direction, m */
  PetscInt npoint, n, size;    /* of all ranks, of this one */
  SbPenetration *point;        /* [n] with a separation direction */
  uint8_t *near; /* by number, of all ranks: SB_OVERLAP_ADJACENT, _INTERSECTED, _INSIDE or 0 */

  PetscInt nway, way_size; /* directions of the last search, which the next one prefers */
  SbOverlapWay *way;

  /* Surfaces of different parts that are in each other by less than the distance `touch`, m, which
     the caller sets (0: none are), only touch: they get no points. */
  PetscReal touch;
  PetscBool touches;  /* there are intersections, and all of them are of such surfaces */
  PetscReal farthest; /* with `touch`: largest depth of parts in each other, m: their surfaces'
                         distance, by less than which no motion separates them */
  uint8_t *touching;  /* [nbody+1] SB_TOUCH_... of the part, kept from search to search */
} SbContactOverlap;
/* Penetration at x, which may move (SbContactSurfaceReach()); `inside`: there is some, even if no
   edge intersects a triangle. Collective. */
PetscErrorCode SbContactOverlapFind(SbContactSurface mesh, const PetscReal x[], PetscBool inside,
                                    SbContactOverlap *overlap);
PetscErrorCode SbContactOverlapCreate(SbContactSurface mesh, SbContactOverlap *o);
PetscErrorCode SbContactOverlapFree(SbContactOverlap *overlap);
/* Whether one body is wholly inside another, so that no edge intersects a triangle: the centroid of
   a tet of body[0] is within the surface of body[1] at x. Slow: for the start of a run.
   Collective. */
PetscErrorCode SbContactSurfaceIsInside(SbContactSurface mesh, const PetscReal x[],
                                        PetscInt body[2], PetscBool *found);

/* How a pair resists a gap below its width: a barrier, or a spring with a multiplier, the energy of
   an augmented Lagrangian. */
typedef struct {
  PetscBool spring;
  PetscReal width;     /* m */
  PetscReal stiffness; /* of a barrier: its pressure, Pa; of a spring: Pa/m */
  PetscReal force;     /* multiplier of a spring at its width, N */
  PetscReal guard; /* of a spring: pressure of a barrier that begins at SB_GUARD of its width, Pa */
} SbPairLaw;
#define SB_GUARD 0.2
/* Energy of a gap d, J, and its first two derivatives, of a pair with this area, m^2. */
void SbPairLawEvaluate(const SbPairLaw *law, PetscReal d, PetscReal area, PetscReal b[3]);
/* The same of a barrier of the width w (m) and pressure k (Pa): 0 from w on, infinite at 0. */
void SbBarrier(PetscReal d, PetscReal w, PetscReal k, PetscReal area, PetscReal b[3]);
/*
  SbPairEnergy - energy, gradient and Hessian of a pair at x; edges that are nearly parallel count
  less.

  Not collective. Input: gap > 0 and distance of SbContactPairGap(). Output: energy, J;
  gradient[12], N; H[12][12], row-major, with `clamp` its positive part, N/m (NULL: not wanted).
*/
void SbPairEnergy(SbContactSurface mesh, const SbContactPair *pair, const SbPairLaw *law,
                  PetscReal gap, const SbDistance *distance, const PetscReal x[], PetscReal *energy,
                  PetscReal gradient[12], PetscBool clamp, PetscReal H[144]);
/* Whether an edge pair is nearly parallel, so that it counts less, or not at all. */
PetscBool SbPairIsMollified(SbContactSurface mesh, const SbContactPair *pair, PetscReal gap,
                            const SbDistance *distance, const PetscReal x[]);

/* Second derivatives by the motion of pairs of surface vertices, a symmetric matrix. Start with
   {0}; release with PetscFree(block) and PetscFree(slot). */
typedef struct {
  PetscInt n, size;
  SbBlock *block;        /* [n] the lower number first */
  PetscInt nslot, *slot; /* [nslot] hash table of block numbers, -1: free; nslot: a power of two */
} SbContactBlocks;
/* Adds the 3x3 block of bodies' vertices v and w, rows `ld` numbers apart, and its transpose for w
   and v. */
PetscErrorCode SbContactBlocksAdd(SbContactBlocks *blocks, PetscInt v, PetscInt w,
                                  const PetscReal H[], PetscInt ld);
/* Moves the blocks to `nodes`: rows of own nodes, columns of all nodes of the vertices, zero at
   prescribed components, each pair of nodes once. Not collective. */
PetscErrorCode SbContactBlocksToNodes(SbContactSurface mesh, SbContactBlocks *blocks,
                                      SbBlocks *nodes);
