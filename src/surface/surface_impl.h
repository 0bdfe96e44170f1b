/*
  surface_impl.h - shared declarations of src/surface/: triangles of a file, a surface with regions,
  mesh generators. Rank 0 only.
*/
#pragma once
#include "sbmeshio.h"
#include "sbsurface.h"

#define SB_TRIANGLE_FLAT \
  1e-10 /* flat triangle: largest twice the area over the longest edge squared */
#define SB_TRIANGLE_EMPTY 1e-9 /* a part without volume: largest volume over (area / 6)^1.5 */

/* Hole or region point of a file. */
typedef struct {
  PetscReal x[3];
  int64_t attribute; /* attribute of a region */
  int64_t number;    /* number in the file */
} SbSeed;

/* triangles.c, triangles_*.c: surface file being read, before it becomes a body or a rigid
   obstacle; the readers add vertices and triangles. */
typedef struct {
  SbImport
    *im; /* owner of the groups, and of arrays here as scratch memory, see SbImportScratch() */
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

/* Readers of a file in memory. Error messages name the file and the line or byte. Not
   collective. */
PetscErrorCode SbTrianglesRead_STL(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OBJ(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_OFF(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_PLY(SbScan *scan, SbTriangleFile *file);
PetscErrorCode SbTrianglesRead_Poly(SbScan *scan, SbTriangleFile *file); /* .poly and .smesh */
/* Add a vertex, or a triangle of existing vertices. */
PetscErrorCode SbTrianglesAddVertex(SbTriangleFile *file, const PetscReal x[3]);
PetscErrorCode SbTrianglesAdd(SbTriangleFile *file, PetscInt a, PetscInt b, PetscInt c,
                              int64_t number);
/* Add corner v, from 0, to the face `number` being read; add the face after its last corner.
   Errors: a missing vertex; fewer than three corners. */
PetscErrorCode SbTrianglesAddCorner(SbScan *scan, int64_t number, int64_t v, SbTriangleFile *file);
PetscErrorCode SbTrianglesAddFace(SbScan *scan, int64_t number, SbTriangleFile *file);
/* Triangulates nested polygons, convex or not, without new vertices: vert[start[k]] to vert[start[k
   + 1] - 1] is polygon k of nloop; the areas with a point of hole[nhole][3] are left empty, all
   other enclosed areas are filled. An error names the last scanned token. */
PetscErrorCode SbTrianglesAddLoops(SbScan *scan, PetscInt nloop, const PetscInt start[],
                                   const PetscInt vert[], PetscInt nhole, const PetscReal hole[],
                                   int64_t number, SbTriangleFile *file);
/* Sets the groups of the triangles that are added next; blanks in names become underscores. n = 0:
   none. */
PetscErrorCode SbTrianglesGroups(SbTriangleFile *file, PetscInt n, const char *const names[]);
/* File format by file name; NULL if unknown. */
typedef struct {
  const char *extension;
  PetscErrorCode (*read)(SbScan *, SbTriangleFile *); /* reader; NULL: gmsh, read by src/meshio */
} SbTriangleFormat;
const SbTriangleFormat *SbTrianglesFormat(const char *path);
/* Reads a file of a known format. */
PetscErrorCode SbTrianglesReadFile(const char *path, SbTriangleFile *file);

/* Corner k of triangle f has the slot 3 f + k, as its edge to the next corner, whose slot this
   is. */
static inline PetscInt SbSlotNext(PetscInt slot)
{
  return slot % 3 == 2 ? slot - 2 : slot + 1;
}
/* edge[3 ntri], sorted: slots with equal keys are one edge. */
void SbTrianglesEdges(const SbTriangles *triangles, SbKey edge[]);
/* Area of a triangle, m^2; flat: whether it has none (SB_TRIANGLE_FLAT), NULL: not wanted. */
PetscReal SbTriangleArea(const PetscReal x[], const PetscInt v[3], PetscBool *flat);
/* Mean length of the edges, m. */
PetscReal SbTrianglesMeanEdge(const PetscReal x[], PetscInt ntri, const PetscInt tri[]);
/* Signed volume of the tet between a triangle and the point o, m^3, positive if o is behind it. */
PetscReal SbTetVolumeTo(const PetscReal x[], const PetscInt v[3], const PetscReal o[3]);

/* import_surface.c, clean.c, self_intersection.c, region.c: from a file to a surface with
   regions */

/*
  SbSurfaceRead - reads a surface, repairs and checks it, and finds its regions; sets groups and
  im->note of the body `im`. Not collective.

  Input: path; im->where, im->scale (1 afterwards: the surface is in metres), im->tet
  (merge_tolerance and untangle).
  Errors: PETSC_ERR_FILE_*, PETSC_ERR_USER_INPUT, one line that names the triangles and a remedy; no
  surface is left.
*/
PetscErrorCode SbSurfaceRead(const char *path, SbImport *im, SbSurface *body_surface);

/* Counts of repairs, for the note of the body. */
typedef struct {
  PetscReal tolerance, moved; /* merge tolerance, m; largest distance of merged vertices, m */
  PetscInt nwelded;           /* vertices merged with another one */
  PetscInt ncollapsed;        /* triangles removed because two of their corners were merged */
  PetscInt ndoubled;          /* duplicate triangles removed */
  PetscInt nwall; /* pairs of coincident triangles of opposite orientation: one is kept as a wall */
  PetscInt nflat; /* flat triangles merged into their neighbours */
  PetscInt nturned;            /* triangles reversed for consistent orientation */
  PetscInt ncavity;            /* parts that are cavities */
  PetscInt npairs, nuntangled; /* pairs of intersecting triangles; vertices moved by smoothing */
  PetscReal untangled;         /* largest displacement by smoothing, m */
  PetscInt nidle;              /* triangles without material on either side, removed */
  PetscInt ninner;             /* triangles of an obstacle with material on both sides, removed */
} SbSurfaceRepairs;

/* Merges vertices within the tolerance, m; removes collapsed and duplicate triangles and unused
   vertices. */
PetscErrorCode SbSurfaceMergeVertices(SbTriangleFile *file, PetscReal tolerance,
                                      SbSurfaceRepairs *repairs);
/* Merges flat triangles into their neighbours. Errors: remaining flat triangles, open edges. */
PetscErrorCode SbSurfaceRepairTriangles(SbTriangleFile *file, SbSurfaceRepairs *repairs);
/* Removes small self-intersections by moving vertices at most by `reach`, m. Error: some remain. */
PetscErrorCode SbSurfaceUntangle(SbTriangleFile *file, PetscReal reach, SbSurfaceRepairs *repairs);
/* Finds the regions: the sides of each triangle; they get the groups region_1, ... and those of the
   file. */
PetscErrorCode SbSurfaceFindRegions(SbTriangleFile *file, SbSurfaceRepairs *repairs,
                                    SbSurface *surface);

/* tet_gmsh.c, tet_tetgen.c: the mesh generators, for tetrahedralize.c */
#define SB_TET_MOST 5e7 /* largest expected number of tets for one surface */

typedef struct {
  const char *where;    /* beginning of error messages */
  const SbImport *body; /* body whose options messages name */
  const SbSurface *surface;
  SbTetOptions options;
  PetscReal size, edge; /* target edge length, mean edge length of the surface */
  PetscBool
    remesh; /* remesh the surface with triangles of the target size; else keep its triangles */
} SbTetJob;

/* tet_near.c: finer tets near places. Checks them with the size of the job, before it is scaled;
   volume of the regions, m^3; adds the tets in them to the number that is expected. */
PetscErrorCode SbTetNearCheck(const SbTetJob *job, PetscReal volume, PetscReal *expected);
/* The size by x, y and z as a formula of gmsh's field MathEval. */
#define SB_TET_FORMULA_MAX (640 * SB_TET_NEAR_MAX)
void SbTetNearFormula(const SbTetOptions *options, size_t size, char text[]);

/* Each backend sets x, vert_number, item[3] with the region number as tags, and item[2], the facets
   between regions and outside, with the number of a surface triangle as tags: the facet's own or,
   after remeshing, the nearest one. Errors: PETSC_ERR_USER_INPUT, PETSC_ERR_FILE_*: the reason of
   the failure. */
PetscErrorCode SbTetRun_Gmsh(const SbTetJob *job, SbImport *tets);
PetscErrorCode SbTetRun_TetGen(const SbTetJob *job, SbImport *tets);
