/*
  triangles.h - triangles read from a surface file, before they become a body or a rigid obstacle. Rank 0
  only.
*/
#pragma once
#include "sbgeometry.h"
#include "sbmeshio.h"
#include "sbtriangles.h"

#define SB_TRIANGLE_FLAT 1e-10 /* flat triangle: largest twice the area over the longest edge squared */
#define SB_TRIANGLE_EMPTY 1e-9 /* a part without volume: largest volume over (area / 6)^1.5 */

/* Hole or region point of a file. */
typedef struct {
  PetscReal x[3];
  int64_t attribute; /* attribute of a region */
  int64_t number;    /* number in the file */
} SbSeed;

/* Surface file being read; the readers add vertices and triangles. */
typedef struct {
  SbImport *im;      /* owner of the groups, and of arrays here as scratch memory, see SbImportScratch() */
  const char *where; /* im->where: beginning of error messages */
  const char *path;  /* file name during reading */
  PetscBool body;    /* a body, with the options of im; else an obstacle */
  SbTriangles *t;
  PetscInt vert_size, tri_size; /* allocated capacity */
  int64_t *number;              /* [ntri] number of the face in the file, from 1 */
  PetscInt now;                 /* tag set of the triangles that are added next */
  PetscInt *tags;               /* [ntri] tag set of each triangle */
  SbCount ncorner;
  PetscInt *corner; /* [ncorner] corners of the face being read */
  PetscBool sheets; /* the order of corners has no meaning: .poly, .smesh */
  PetscInt nhole, nregion;
  SbSeed *hole, *region;
} SbTriangleFile;

/* Readers of a file in memory. Error messages name the file and the line or byte. Not collective. */
PetscErrorCode SbTrianglesRead_STL(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OBJ(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OFF(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_PLY(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_Poly(SbScan *scan, SbTriangleFile *file); /* .poly and .smesh */
/* Add a vertex, or a triangle of existing vertices. */
PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *file, const PetscReal x[3]);
PetscErrorCode SbTrianglesAdd(SbTriangleFile *file, PetscInt a, PetscInt b, PetscInt c, int64_t number);
/* Add corner v, from 0, to the face `number` being read; add the face after its last corner. Errors: a
   missing vertex; fewer than three corners. */
PetscErrorCode SbTrianglesAddCorner(SbScan *scan, int64_t number, int64_t v, SbTriangleFile *file);
PetscErrorCode SbTrianglesAddFace(SbScan *scan, int64_t number, SbTriangleFile *file);
/* Triangulates nested polygons, convex or not, without new vertices: vert[start[k]] to vert[start[k + 1] - 1]
   is polygon k of nloop; the areas with a point of hole[nhole][3] are left empty, all other enclosed areas
   are filled. An error names the last scanned token. */
PetscErrorCode SbTrianglesAddLoops(SbScan *scan, PetscInt nloop, const PetscInt start[],
                                   const PetscInt vert[], PetscInt nhole, const PetscReal hole[],
                                   int64_t number, SbTriangleFile *file);
/* Sets the groups of the triangles that are added next; blanks in names become underscores. n = 0: none. */
PetscErrorCode SbTrianglesGroups(SbTriangleFile *file, PetscInt n, const char *const names[]);
/* File format by file name; NULL if unknown. */
typedef struct {
  const char *extension;
  PetscErrorCode (*read)(SbScan *, SbTriangleFile *); /* reader; NULL: gmsh, read by src/meshio */
  PetscBool sheets;                                   /* as in SbTriangleFile */
} SbTriangleFormat;
const SbTriangleFormat *SbTrianglesFormat(const char *path);
/* Reads a file of a known format. */
PetscErrorCode SbTrianglesReadFile(const char *path, SbTriangleFile *file);

/* triangles_measure.c */

/* Corner k of triangle f has the slot 3 f + k, as its edge to the next corner, whose slot this is. */
static inline PetscInt SbSlotNext(PetscInt slot)
{
  return slot % 3 == 2 ? slot - 2 : slot + 1;
}
/* edge[3 ntri], sorted: slots with equal keys are one edge. */
void SbTrianglesEdges(const SbTriangles *triangles, SbKey edge[]);
/* Area of a triangle, m^2; flat: whether it has none (SB_TRIANGLE_FLAT), NULL: not wanted. */
PetscReal SbTriangleArea(const SbTriangles *triangles, PetscInt f, PetscBool *flat);
/* Mean length of the edges, m. */
PetscReal SbTrianglesMeanEdge(const SbTriangles *triangles);
/* Signed volume of the tet between a triangle and the point o, m^3, positive if o is behind it. */
PetscReal SbTetVolumeTo(const SbTriangles *triangles, PetscInt f, const PetscReal o[3]);
