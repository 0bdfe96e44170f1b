/*
  triangles.h - a surface of triangles on its way from a file to a rigid obstacle: what the files triangles*.c share. Rank 0 only.
*/
#pragma once
#include "sbgeometry.h"
#include "sbmeshio.h"
#include "sbtriangles.h"

#define SB_TRIANGLE_FLAT 1e-10 /* twice the area over the longest edge squared, below which it has no side */
#define SB_TRIANGLE_EMPTY 1e-9 /* volume over (area / 6)^1.5, below which a part encloses nothing */

/* A point that a file gives for the region around it. */
typedef struct {
  PetscReal x[3];
  int64_t attribute; /* of a region */
  int64_t number;    /* in the file */
} SbSeed;

/* Filled by a reader, item by item. */
typedef struct {
  SbImport *im;      /* gets the groups of the triangles; arrays here are its own, see SbImportScratch() */
  const char *where; /* im->where: begins every message */
  const char *path;  /* while it is read */
  PetscBool body;    /* it becomes one, by the options of im; else an obstacle */
  SbTriangles *t;
  PetscInt vert_size, tri_size; /* allocated */
  int64_t *number;              /* [ntri] of the face in the file, from 1 */
  PetscInt now;                 /* tag set of the triangles that come next */
  PetscInt *tags;               /* [ntri] tag set */
  SbCount ncorner;
  PetscInt *corner; /* [ncorner] of the face that is being read */
  PetscBool sheets; /* the order of corners says nothing about the side: .poly, .smesh */
  PetscInt nhole, nregion;
  SbSeed *hole, *region;
} SbTriangleFile;

/* Readers of a file in memory. Errors name the file, and the line or byte. Not collective. */
PetscErrorCode SbTrianglesRead_STL(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OBJ(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OFF(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_PLY(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_Poly(SbScan *scan, SbTriangleFile *file); /* and .smesh */
/* Appends a vertex, or a triangle of vertices that are there. */
PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *file, const PetscReal x[3]);
PetscErrorCode SbTrianglesAdd(SbTriangleFile *file, PetscInt a, PetscInt b, PetscInt c, int64_t number);
/* Adds corner v, from 0, to the face `number` that is being read, and the face when it has all. Errors: a vertex that is not there; fewer than three. */
PetscErrorCode SbTrianglesAddCorner(SbScan *scan, int64_t number, int64_t v, SbTriangleFile *file);
PetscErrorCode SbTrianglesAddFace(SbScan *scan, int64_t number, SbTriangleFile *file);
/* Appends a polygon, convex or not, as triangles between its corners; vert[n] from 0. An error names what was scanned last. */
PetscErrorCode SbTrianglesAddPolygon(SbScan *scan, PetscInt n, const PetscInt vert[], int64_t number,
                                     SbTriangleFile *file);
/*
  The same for polygons within each other: vert[start[k]] to vert[start[k + 1] - 1] is the k-th of nloop; those around one of the points
  hole[nhole][3] are left empty, whatever else is enclosed is filled.
*/
PetscErrorCode SbTrianglesAddLoops(SbScan *scan, PetscInt nloop, const PetscInt start[],
                                   const PetscInt vert[], PetscInt nhole, const PetscReal hole[],
                                   int64_t number, SbTriangleFile *file);
/* The triangles that come next belong to these groups; blanks in names become underscores. n = 0: to none. */
PetscErrorCode SbTrianglesGroups(SbTriangleFile *file, PetscInt n, const char *const names[]);
/* What is known of a kind of file, by its name; NULL: of no known kind. */
typedef struct {
  const char *extension;
  PetscErrorCode (*read)(SbScan *, SbTriangleFile *); /* NULL: gmsh's, which the reader of meshes reads */
  PetscBool sheets;                                   /* as of SbTriangleFile */
} SbTriangleFormat;
const SbTriangleFormat *SbTrianglesFormat(const char *path);
/* Reads a file of a known kind. */
PetscErrorCode SbTrianglesReadFile(const char *path, SbTriangleFile *file);

/* ------------------------------------------------------------------ triangles_measure.c */

/* edge[3 ntri], sorted: those with one key are one edge. Slots 3 triangle + edge; edge k runs from corner k to the next. */
void SbTrianglesEdges(const SbTriangles *triangles, SbKey edge[]);
/* Twice the area of a triangle, m^2, its longest edge squared and the sum of its edges. */
PetscReal SbTriangleMeasure(const SbTriangles *triangles, PetscInt f, PetscReal *longest2, PetscReal *around);
/* Volume of the tet between a triangle and the point o, m^3, positive when o is behind. */
PetscReal SbTetVolumeTo(const SbTriangles *triangles, PetscInt f, const PetscReal o[3]);
/* Solid angle of a triangle seen from o, positive from behind. */
PetscReal SbTriangleSolidAngle(const SbTriangles *triangles, PetscInt f, const PetscReal o[3]);
