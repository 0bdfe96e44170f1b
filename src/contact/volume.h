/*
  volume.h - bounding volumes of a tree: intersections of slabs, boxes or k-DOPs; and cones of normals.

  A volume is a column of numbers: lower and upper bound along each of k/2 directions; then, for self-contact, its cone: axis,
  cosine and sine of the half-angle. A node of the tree holds the columns of its children as a block, either row by row (a number of
  all children side by side: what is tested against) or column by column (what is tested).

  Numbers are single precision, relative to an origin and rounded outwards: half the memory, and four at a time everywhere.
*/
#pragma once
#include "detect.h"

typedef float SbBound;

enum {
  SB_VOLUME_CONE = 5,                   /* rows of the cone, the last ones */
  SB_VOLUME_ROWS = 14 + SB_VOLUME_CONE, /* most rows of a column */
  SB_TREE_WIDTH = 8                     /* children of a node, and lanes of a block */
};

/* Which children of a node of points meet which of a node of facets: bit 8 c + l for child c of the first and l of the second. */
typedef uint64_t SbMeets;

/*
  Children of a node of points against those of a node of facets: which of the pairs in `wanted` may meet, by column c of `a` and lane l of
  block f. Columns are `rows` apart.
*/
typedef SbMeets (*SbVolumeMeet)(const SbBound a[], PetscInt rows, SbMeets wanted, const SbBound f[]);

typedef struct {
  int nslab; /* k/2 */
  int cone;  /* the first row of the cone */
  int rows;  /* of a column, with its cone where there are cones */
  PetscReal origin[3];
  SbVolumeMeet meet[2]; /* without and with a examine the cones */
} SbVolume;

/* k = 6 or 14; cones: there is room for them. The origin is 0. */
void SbVolumeSet(PetscInt k, PetscBool cones, SbVolume *volume);
/*
  SbVolumeOf - column of n corners, m, all within `box` grown by `grow` to all sides, m; rounding is allowed for.

  `grow` widens what box does not tell: the slanted slabs. The cone is not set.
*/
void SbVolumeOf(const SbVolume *volume, int n, const PetscReal *const corner[], const PetscReal box[6],
                PetscReal grow, SbBound column[]);
/*
  SbVolumeMerge - column around the children of a block, without the cone. Lanes without a child are as SbVolumeNone() has them.

  The number in row r of child l is block[row * r + lane * l].
*/
void SbVolumeMerge(const SbVolume *volume, const SbBound block[], PetscInt row, PetscInt lane,
                   SbBound column[]);
/* A column that meets nothing. */
void SbVolumeNone(const SbVolume *volume, SbBound column[]);
/* What stands for the surface of a volume, m^2. */
PetscReal SbVolumeSize(const SbBound column[]);

/* ------------------------------------------------------------------ cones of normals, cone.c */

/* Room for the rounding of products of unit vectors and of sums of angles along all levels. */
#define SB_CONE_GUARD 2e-5f

/* Cone of one normal of any length; without length the widest one. */
void SbConeOf(const PetscReal normal[3], SbBound cone[SB_VOLUME_CONE]);
/* Cone around the first n cones of a block; the number in row r of cone l is block[row * r + lane * l]. */
void SbConeMerge(const SbBound block[], PetscInt row, PetscInt lane, PetscInt n,
                 SbBound cone[SB_VOLUME_CONE]);
/*
  SbConesOfVertices - for each vertex of the rings the cone of all contact normals there; the widest where none is known.

  Not collective. Input: open - as in SbFacetLinks. Work: normal[nfacet][3]. Output: cone[nvertex][SB_VOLUME_CONE].
*/
void SbConesOfVertices(const SbDetectScene *scene, const SbDetectRings *rings, const PetscBool open[],
                       PetscReal normal[], SbBound cone[]);
