/*
  sbgeometry.h - layer 1: distances, intersection, continuous collision detection, trees of boxes,
  spatial hash, location: arrays in, arrays out. Not collective throughout; nothing here knows a
  mesh, a surface or contact. Lengths in any unit, the same throughout a call.
*/
#pragma once
#include "sbbase.h"
#include "sbkernel.h"

#define SB_BOX_ROUNDING 16 /* rounding of a box's corners, in units of eps |x| */

/* Boxes: lower and upper corner, m. An empty one has its lower corner above the upper. */
static inline void SbBoxClear(PetscReal box[6])
{
  for (int k = 0; k < 3; k++) {
    box[k] = PETSC_MAX_REAL;
    box[3 + k] = -PETSC_MAX_REAL;
  }
}

/* NaN is ignored, so that ranks agree also after a diverged solve. */
static inline void SbBoxMerge(PetscReal box[6], const PetscReal other[6])
{
  for (int k = 0; k < 3; k++) {
    if (other[k] < box[k])
      box[k] = other[k];
    if (other[3 + k] > box[3 + k])
      box[3 + k] = other[3 + k];
  }
}

static inline void SbBoxAdd(PetscReal box[6], const PetscReal x[3])
{
  SbBoxMerge(box, (const PetscReal[6]){x[0], x[1], x[2], x[0], x[1], x[2]});
}

/* Length of the diagonal of a box that is not empty. */
static inline PetscReal SbBoxDiagonal(const PetscReal box[6])
{
  return PetscSqrtReal(PetscSqr(box[3] - box[0]) + PetscSqr(box[4] - box[1]) +
                       PetscSqr(box[5] - box[2]));
}

/* The axis along which a box is longest, the first of equal ones. */
static inline int SbBoxLongest(const PetscReal box[6])
{
  int axis = 0;

  for (int k = 1; k < 3; k++)
    if (box[3 + k] - box[k] > box[3 + axis] - box[axis])
      axis = k;
  return axis;
}

/* Where on a triangle: its corner 0, 1 or 2, its edge from corner 0 to 1, 1 to 2, 2 to 0, or its
   inside. */
typedef enum {
  SB_FEATURE_CORNER_0,
  SB_FEATURE_CORNER_1,
  SB_FEATURE_CORNER_2,
  SB_FEATURE_EDGE_0,
  SB_FEATURE_EDGE_1,
  SB_FEATURE_EDGE_2,
  SB_FEATURE_FACE
} SbTriangleFeature;

/*
  SbTriangleClosestPoint - the point of a triangle nearest to p.

  Input: p[3]; x[k][3], corners, m. Output: weight[3], none negative, sum 1; d2, squared distance,
  m^2. Triangles without area are segments or points; the place then is never SB_FEATURE_FACE. NaN
  in, NaN out.
*/
SbTriangleFeature SbTriangleClosestPoint(const PetscReal p[3], const PetscReal *const x[3],
                                         PetscReal weight[3], PetscReal *d2);

/*
  SbRayTriangle - where the half-line p + t way meets a triangle.

  Output: t >= 0, in lengths of way; weight[3] of the corners; out, whether from back to front.
*/
PetscBool SbRayTriangle(const PetscReal p[3], const PetscReal way[3], const PetscReal *const x[3],
                        PetscReal *t, PetscReal weight[3], PetscBool *out);

/*
  SbTriangleOver - the part of triangle w that lies over triangle v, seen along v's normal n[3], of
  any length.

  Input: corners, m; v counter-clockwise about n. Output: corners of a convex polygon in the plane
  of w, in w's order. Returns their number, at most SB_OVER, below 3: there is none (Sutherland and
  Hodgman, 1974).
*/
#define SB_OVER 8
int SbTriangleOver(const PetscReal *const v[3], const PetscReal n[3], const PetscReal *const w[3],
                   PetscReal corner[SB_OVER][3]);

/* intersection.c */

/*
  Whether a segment from p to q and a triangle with the corners t share a point; whether two
  triangles with the vertices a[3] and b[3] of x[][3] share more than common vertices and a common
  edge. Touching counts; rounding: src/geometry/intersection.c.
*/
PetscBool SbSegmentMeetsTriangle(const PetscReal p[3], const PetscReal q[3],
                                 PetscReal const *const t[3]);
PetscBool SbTrianglesCross(const PetscReal x[], const PetscInt a[3], const PetscInt b[3]);

/* distance.c, ccd.c: pairs */

/* Kind of a pair, or of its closest features; vertices of the first side before the bar. */
typedef enum {
  SB_PAIR_VERTEX_VERTEX,   /* 0 | 1 */
  SB_PAIR_VERTEX_EDGE,     /* 0 | 1 2 */
  SB_PAIR_VERTEX_TRIANGLE, /* 0 | 1 2 3 */
  SB_PAIR_EDGE_EDGE        /* 0 1 | 2 3 */
} SbPairKind;

typedef struct {
  SbPairKind feature; /* closest: of an edge pair also a vertex and an edge, or two vertices */
  int mask;           /* bit a: vertex a belongs to the closest feature */
  /* sum 0; sum_a weight[a] x_a leads from the closest point of the second side to the first; 0 off
     mask */
  PetscReal weight[4];
  PetscReal d;    /* the distance, m */
  PetscReal n[3]; /* unit vector from the second side to the first; 0 where it has none */
} SbDistance;

/*
  SbDistanceFind - the closest features of a pair, their distance, direction and closest points.

  Input: x[4][3], vertices, m; those that the kind has are read. Edges and triangles may be
  degenerate: then the closest feature is a lower one. The gradient of d with respect to vertex a is
  weight[a] n.
*/
void SbDistanceFind(SbPairKind kind, const PetscReal x[], SbDistance *distance);

/*
  SbDistanceHessian - a grad d grad d^T + b Hess d for the closest features as found, with factor[2]
  = (a, b).

  For an energy f(d): a = f'', b = f'. Input: x[4][3] as for SbDistanceFind(), m; distance, d > 0;
  clamp, whether its positive semi-definite part (the nearest such matrix) is wanted. Output:
  H[12][12], rows and columns 3 a + k; symmetric.
*/
void SbDistanceHessian(const PetscReal x[], const SbDistance *distance, const PetscReal factor[2],
                       PetscBool clamp, PetscReal H[]);

/*
  SbEdgeCross - |u x v|^2 of two edges u, v, m^4: zero where they are parallel: no smooth distance.

  Input: x[4][3], ends of the first and of the second edge, m. Output: g[12], H[12][12], its first
  and second derivatives; either may be NULL.
*/
PetscReal SbEdgeCross(const PetscReal x[], PetscReal g[], PetscReal H[]);

/* Replaces a symmetric matrix A[n][n] by its positive semi-definite part; n <= 12. */
void SbSymmetricProjectPSD(int n, PetscReal A[]);

/*
  SbTimeOfImpact - a conservative time of impact of a pair of features: never later than the true
  one.

  The vertices go on straight lines from x0[4][3] to x1[4][3], m. The gap is their distance less the
  radius, g at the start; least = min(separation, g / 2). At the time returned the gap is between
  least + 0.9 k and least + k, k = min(keep (g - least), most), and nowhere before smaller. Much
  rotation at a small gap takes many steps; after 1024 the time reached is returned, at which more
  is left.

  least is not below SB_CCD_ROUNDING eps |x|, the rounding of coordinates, plus the same of |x1 -
  x0|. For a gap not larger than this at the start, or negative, or NaN, the time is 0, unless they
  move alike.

  Output: time, in [0, 1]; 1 if there is no impact. Returns whether there is one.
*/
typedef struct {
  PetscReal radius;     /* sum of the radii of the balls or capsules around vertices and edges, m */
  PetscReal separation; /* gap that remains, m */
  PetscReal keep; /* fraction of the gap beyond it that remains, above 0 and below 1; usually 0.1 */
  PetscReal most; /* largest gap kept by `keep`, m; 0: no limit */
} SbCCDLimits;
#define SB_CCD_ROUNDING 32
PetscBool SbTimeOfImpact(SbPairKind kind, const PetscReal x0[], const PetscReal x1[],
                         const SbCCDLimits *limits, PetscReal *time);

/* box_tree.c: boxes that meet or are near */

/*
  A tree over boxes with four children to a node: four boxes form a group, four groups one of the
  next level. Boxes that are empty or have NaN coordinates intersect nothing; that may change with
  the positions.
*/
#define SB_BOX_TREE_LEVELS 32
typedef struct {
  PetscInt n;
  int nlevel;
  PetscInt start[SB_BOX_TREE_LEVELS +
                 1]; /* first group of each level; level 0: boxes, the last: one group */
  PetscInt *order;   /* [4 start[1]] box at each place of level 0, -1: none */
  PetscReal (
    *group)[6]
           [4]; /* [start[nlevel] + 1] corners of the four boxes or groups in it, m; last: hull */
  PetscReal hull[6]; /* of all, m */
  PetscReal size;    /* of all hulls over that of the boxes, when the order was made */
} SbBoxTree;
PetscErrorCode SbBoxTreeCreate(PetscInt n, const PetscReal (*box)[6], SbBoxTree *tree);
PetscErrorCode SbBoxTreeDestroy(SbBoxTree *tree);
/* Refits the tree to moved boxes[n][6], m, O(n); rebuilds it when groups have grown by half over
   them. */
PetscErrorCode SbBoxTreeRefit(SbBoxTree *tree, const PetscReal (*box)[6]);

/*
  The boxes not farther from a box (or a point, as a box without extent) than sqrt(limit2), near
  ones first on the whole; 0: those that meet it. The caller lowers `limit2` as it measures what is
  in them, until nothing nearer is left:

      for (SbBoxNearestBegin(&tree, box, limit2, &nearest); SbBoxNearestNext(&nearest, &i);) {
        const PetscReal d2 = ...;
        if (d2 < nearest.limit2) { nearest.limit2 = d2; found = i; }
      }
*/
typedef struct {
  int level; /* -1: a box */
  PetscInt index;
  PetscReal d2;
} SbBoxNearestEntry;
typedef struct {
  const SbBoxTree *tree; /* borrowed */
  PetscReal box[6], limit2;
  int depth;
  SbBoxNearestEntry stack[3 * SB_BOX_TREE_LEVELS + 4];
} SbBoxNearest;
void SbBoxNearestBegin(const SbBoxTree *tree, const PetscReal box[6], PetscReal limit2,
                       SbBoxNearest *nearest);
PetscBool SbBoxNearestNext(SbBoxNearest *nearest, PetscInt *i);

/*
  All pairs of a box of one tree, grown by `grown` on each side, m, and a box of another that meet;
  with the same tree twice all pairs of two boxes of it, each once, in either order. Next writes up
  to `room` >= 16 pairs to pair[room][2] and returns how many: 0 at the end.
*/
typedef struct {
  int level[2];
  PetscInt group[2];
} SbBoxPairsEntry;
typedef struct {
  const SbBoxTree *tree[2]; /* borrowed */
  PetscReal grown;
  int depth;
  SbBoxPairsEntry stack[15 * SB_BOX_TREE_LEVELS + 16];
} SbBoxPairs;
void SbBoxPairsBegin(const SbBoxTree *a, const SbBoxTree *b, PetscReal grown, SbBoxPairs *pairs);
PetscInt SbBoxPairsNext(SbBoxPairs *pairs, PetscInt room, PetscInt pair[]);

/* Box of a triangle, vert[3]; the tree over those of n triangles. */
void SbTriangleBox(const PetscReal x[], const PetscInt vert[], PetscReal box[6]);
PetscErrorCode SbBoxTreeCreateTriangles(PetscInt n, const PetscInt vert[], const PetscReal x[],
                                        SbBoxTree *tree);

/* spatial_hash.c: boxes that meet, by a hashed grid */

/*
  A hash table of the cells of an infinite grid, for boxes of up to SB_HASH_SETS sets: which of them
  meet. Any number, size and place of boxes; quadratic only where all of them meet. Nothing is
  allocated once a fill as large as the present one has been.

  Create  - an empty table; cell, m: somewhat more than the longest side of most boxes.
  Clear   - empties it, to be filled again.
  Add     - the next set: boxes[n][6], m. near: only those that may meet boxes of earlier sets are
            kept, so that pairs of two such sets are incomplete; such sets come last. Empty boxes
            and those with NaN coordinates take part in no pair.
  Count   - boxes, entries (a box in a cell), cells in use.

  All pairs of boxes that meet, touching included, each once, in any order: those of the two sets
  meeting[m] for each m < nmeeting; with the same set twice, those within it. Next returns at least
  `least` of them, or the rest; 0: the end. `meeting` and the pairs are borrowed, the pairs until
  the next call.
*/
#define SB_HASH_SETS 6
typedef struct _p_SbSpatialHash *SbSpatialHash;
PetscErrorCode SbSpatialHashCreate(PetscReal cell, SbSpatialHash *hash);
PetscErrorCode SbSpatialHashDestroy(SbSpatialHash *hash);
PetscErrorCode SbSpatialHashClear(SbSpatialHash hash);
PetscErrorCode SbSpatialHashAdd(SbSpatialHash hash, PetscInt n, const PetscReal (*box)[6],
                                PetscBool near);
void SbSpatialHashCount(SbSpatialHash hash, PetscInt count[3]);
typedef struct {
  int meeting;
  PetscInt a, b; /* numbers in their sets */
} SbHashPair;
typedef struct {
  SbSpatialHash hash; /* borrowed */
  int nmeeting;
  const int (*meeting)[2];
  PetscInt cell; /* the next one */
} SbHashPairs;
PetscErrorCode SbHashPairsBegin(SbSpatialHash hash, int nmeeting, const int meeting[][2],
                                SbHashPairs *pairs);
PetscErrorCode SbHashPairsNext(SbHashPairs *pairs, PetscInt least, PetscInt *n,
                               const SbHashPair **pair);

/* signed_distance.c */

/*
  SbSignedDistance - distance from a closed surface of triangles, m, negative inside.

  Input: x[nvert][3], m; tri[ntri][3], counter-clockwise seen from outside; across[ntri][3],
  triangle beyond edge k, which runs from corner k to the next: borrowed. Evaluate: x[3], m; output:
  n[3], unit outward normal at the nearest point of the surface, or one of them.
*/
typedef struct _p_SbSignedDistance *SbSignedDistance;
PetscErrorCode SbSignedDistanceCreate(PetscInt nvert, const PetscReal x[], PetscInt ntri,
                                      const PetscInt tri[], const PetscInt across[],
                                      SbSignedDistance *distance);
PetscErrorCode SbSignedDistanceDestroy(SbSignedDistance *distance);
PetscReal SbSignedDistanceEvaluate(SbSignedDistance distance, const PetscReal x[3], PetscReal n[3]);

/* weld.c */

/* The root of a vertex in a forest of parents up[], whose paths are halved on the way. */
static inline PetscInt SbUnionRoot(PetscInt up[], PetscInt v)
{
  for (; up[v] != v; v = up[v])
    up[v] = up[up[v]];
  return v;
}

/* Joins the trees of a and b below the lower root; false when they were one. */
static inline PetscBool SbUnionJoin(PetscInt up[], PetscInt a, PetscInt b)
{
  a = SbUnionRoot(up, a);
  b = SbUnionRoot(up, b);
  up[PetscMax(a, b)] = PetscMin(a, b);
  return (PetscBool)(a != b);
}

/*
  SbWeld - merges points within `tolerance` of each other, m; 0: at the same position.

  Input: x[n][3], m; chains, whether chains of such pairs are merged as a whole, else each point
  joins the first earlier one that is not merged itself. Output: map[n], the first of the points
  merged with each point.
*/
PetscErrorCode SbWeld(PetscInt n, const PetscReal x[], PetscReal tolerance, PetscBool chains,
                      PetscInt map[]);
/* Numbers the trees in the order of their roots: up[n] becomes the tree of each; returns their
   number. */
PetscInt SbUnionLabel(PetscInt n, PetscInt up[]);
/* Removes points that are not in used[nused], and renumbers these. Keeps the order. */
PetscErrorCode SbDropUnusedPoints(PetscInt *n, PetscReal x[], PetscInt nused, PetscInt used[]);

/* keys.c: which edges or faces are the same */
typedef struct {
  uint64_t key;
  PetscInt slot; /* index of the item */
} SbKey;
/* Key of an edge, or of any two numbers below 2^32, independent of their order. */
static inline uint64_t SbKeyOfPair(PetscInt a, PetscInt b)
{
  return (uint64_t)PetscMin(a, b) << 32 | (uint64_t)PetscMax(a, b);
}
/* Sorts by key, then by slot. */
void SbKeysSort(PetscInt n, SbKey item[]);
/* Of sorted items: number of those from i on with its key; the first one with a key, -1: there is
   none. */
PetscInt SbKeysAlike(PetscInt n, const SbKey item[], PetscInt i);
PetscInt SbKeysFind(PetscInt n, const SbKey item[], uint64_t key);

/* Six times the signed volume of a tet, m^3. */
PetscReal SbTetDeterminant(const PetscReal x[], const PetscInt vert[4]);

/* locate.c */

/*
  SbLocator - which tet holds a point. The arrays are borrowed. Flat and inverted tets contain no
  point. Tets are curved by edge_off[ncell][6][3], nodes at edges 01 02 03 12 13 23 from their
  middles; NULL: straight. The weights of a curved one are l of its map x(l) (sbkernel.h).

  SbLocatorFind: the tet and the weights of its corners, none negative, sum 1. Of several that hold
  the point the one in which it lies deepest, or the first of equal ones; of a point in none the
  nearest place. Returns the distance from there, m. No tet with a volume, or a point that is not
  finite: PETSC_MAX_REAL, the tet -1, weights 0; a caller that cannot rule this out looks for it.
*/
typedef struct _p_SbLocator *SbLocator;
PetscErrorCode SbLocatorCreate(PetscInt ncell, const PetscInt cell[], const PetscReal x[],
                               const PetscReal edge_off[], SbLocator *locator);
PetscErrorCode SbLocatorDestroy(SbLocator *locator);
PetscReal SbLocatorFind(SbLocator locator, const PetscReal point[3], PetscInt *cell,
                        PetscReal weight[4]);
/* The l of the map of a tet with curved edges: x(l) = point, sum 1; false: Newton's method found
   none. */
PetscBool SbTetCurvedBarycentric(const PetscReal x[], const PetscInt v[4], const PetscReal off[18],
                                 const PetscReal point[3], PetscReal l[4]);
/* The ten nodes of a tet with its edges off their middles by off[6][3]. */
void SbTetNodes(const PetscReal x[], const PetscInt v[4], const PetscReal off[18],
                PetscReal node[SB_CELL_NODES][3]);
/* The weights of the corners v of a tet at a point: sum w_a x_a = point, sum 1; negative
   outside. */
void SbTetBarycentric(const PetscReal x[], const PetscInt v[4], const PetscReal point[3],
                      PetscReal weight[4]);

/* A rigid motion: x = c + R (X - c) + d; R turns by an angle (rad) about the unit axis. */
typedef struct {
  PetscReal R[9], c[3], d[3], axis[3], angle;
} SbPose;
/* Tangent of the arc from pose `from` to pose `to` at the end `at`, for the point x there: way = d1
   - d0 + (angle1 - angle0) axis x (x - c - d), m. Not collective. */
void SbPoseWay(const SbPose *from, const SbPose *to, const SbPose *at, const PetscReal x[3],
               PetscReal way[3]);
/* Rotation by an angle (rad) about the unit axis through c, then the translation d. */
void SbPoseSet(const PetscReal axis[3], PetscReal angle, const PetscReal c[3], const PetscReal d[3],
               SbPose *pose);
void SbPoseApply(const SbPose *pose, const PetscReal X[3], PetscReal x[3]);
void SbPoseInvert(const SbPose *pose, const PetscReal x[3], PetscReal X[3]);
