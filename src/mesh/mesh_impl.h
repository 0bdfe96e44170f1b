/*
  mesh_impl.h - what the files of src/mesh/ share: edges and shapes of a body, its sets, all bodies in one piece.

  Everything here lives on rank 0 until distribute.c hands the pieces to their ranks.
*/
#pragma once
#include "sbtet.h"

/* given.c: the mesh that a body has in memory. */
PetscErrorCode SbImportGiven(const SbBody *body, SbImport *import);

/* ------------------------------------------------------------------ edges.c: pairs of vertices that an item joins */

typedef struct {
  PetscInt nvert, nedge;
  PetscInt *start; /* [nvert + 1] into `high`: edges by lower vertex */
  PetscInt *high;  /* [nedge] the other vertex, ascending for each lower one */
} SbImportEdges;

/* Edges of tets, triangles and lines. */
PetscErrorCode SbImportEdgesCreate(const SbImport *import, SbImportEdges *edges);
PetscErrorCode SbImportEdgesDestroy(SbImportEdges *edges);
/* Number of the edge between two vertices, -1 when there is none. */
PetscInt SbImportEdgesFind(const SbImportEdges *edges, PetscInt a, PetscInt b);

/* ------------------------------------------------------------------ check.c, quality.c, sets.c */

/* Volume, shape, extent and number of parts: fills the "found" fields of the body. */
PetscErrorCode SbImportQuality(const SbImport *import, const SbFaces *faces, SbBody *body);
/* Volume, cosines of the six dihedral angles, radius ratio of a tet. */
void SbTetShape(const PetscReal x[], const PetscInt vert[4], PetscReal *V, PetscReal cosine[6],
                PetscReal *ratio);
/* Parts that share no vertex. */
PetscErrorCode SbImportParts(const SbImport *import, PetscInt *npart);
/* A tet that check.c refuses as flat; `largest` is the largest coordinate in size. */
PetscBool SbTetFlat(const PetscReal x[], const PetscInt vert[4], PetscReal largest, PetscReal *det);

/* Masks of one body, zero on entry. */
typedef struct {
  uint64_t *vert; /* [nvert] */
  uint64_t *cell; /* [ncell] */
  uint64_t *face; /* [ncell][4] */
} SbMasks;
/* Marks boundary faces and the members of all sets in body b; adds to the counts of the sets. */
PetscErrorCode SbSetsMark(const SbImport *import, const SbFaces *faces, PetscInt nbody, const SbBody body[],
                          PetscInt b, PetscInt nset, SbSet set[], SbMasks *masks);
/* Adds the members of sets that are groups. */
PetscErrorCode SbGivenMark(const SbBody *body, const SbFaces *faces, SbMasks *masks);
/* A set that selects nothing is an error, which lists the groups that exist. */
PetscErrorCode SbSetsCheck(PetscInt nbody, const SbBody body[], const SbImport import[], PetscInt nset,
                           const SbSet set[]);

/* ------------------------------------------------------------------ whole.c, distribute.c, order.c, number.c: from rank 0 to all */

/* What travels with a point of the DMPlex. */
typedef struct {
  PetscInt orig, body;
  uint64_t set;
  union {
    PetscReal x[3];   /* of a vertex */
    uint64_t face[4]; /* of a cell */
  } u;
} SbPoint;

/* All bodies in one piece; on ranks other than 0 it is empty. */
typedef struct {
  PetscInt nvert, ncell;
  PetscInt *cell;      /* [ncell][4] */
  PetscInt *neighbour; /* [ncell][4] cell across the face, -1 on the boundary */
  SbPoint *point;      /* [ncell + nvert] cells, then vertices */
} SbWhole;

/* Rank 0: reads, checks and merges all bodies, fills their "found" fields and those of the sets. */
PetscErrorCode SbWholeCreate(PetscInt nbody, SbBody body[], PetscInt nset, SbSet set[], SbWhole *whole);
PetscErrorCode SbWholeDestroy(SbWhole *whole);

/* DMPlex of cells and vertices, distributed with one layer of overlap; point[] of every local point. Destroys the whole. Collective. */
PetscErrorCode SbDistribute(MPI_Comm comm, const char *partitioner, SbWhole *whole, DM *dm, SbPoint **point);
/* Hands the neighbours of all cells (on rank 0) to a partitioner of type metis, which then needs no graph from PETSc. */
PetscErrorCode SbPartitionerSetNeighbours(PetscPartitioner part, PetscInt ncell, const PetscInt neighbour[]);
PetscErrorCode SbPartitionerRegister(void);
/* Reverse Cuthill-McKee order: order[i] is the vertex that gets number i. A cell's vertex may be -1: it takes no part. */
PetscErrorCode SbOrderRCM(PetscInt nvert, PetscInt ncell, const PetscInt cell[], PetscInt order[]);
/* Own local numbering: fills the arrays and counts of the mesh from its DM. Collective. */
PetscErrorCode SbMeshNumber(SbMesh mesh, const SbPoint point[]);
