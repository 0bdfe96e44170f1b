/*
  mesh_impl.h - what the files of src/mesh/ share: edges and shapes of a body, its sets, all bodies in one mesh.

  A body lives on rank 0 until distribute.c hands the pieces to their ranks.
*/
#pragma once
#include <petscsf.h>
#include "sbquadratic.h"
#include "sbtet.h"

/* A number for a number, without pattern (splitmix64, Steele et al. 2014). */
static inline uint64_t SbMix(PetscInt i)
{
  uint64_t z = ((uint64_t)i + 1) * 0x9e3779b97f4a7c15u;

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/* memory_mesh.c: the mesh that a body has in memory. */
PetscErrorCode SbImportMemoryMesh(const SbBody *body, SbImport *import);

/* ------------------------------------------------------------------ check.c, quality.c, sets.c */

/* Largest coordinate in size, m. */
PetscReal SbImportLargest(const SbImport *import);
/* Turns inverted tets, refuses flat ones; `largest` is the largest coordinate in size. */
PetscErrorCode SbImportOrient(SbImport *import, PetscReal largest);
/* Refuses tets given twice and faces of three tets. */
PetscErrorCode SbImportCheckFaces(const SbImport *import, const SbFaces *faces);
/* Their errors: numbers of the tets in the file, and how many faces have more than two. */
PetscErrorCode SbImportTwice(const SbImport *import, int64_t a, int64_t b);
PetscErrorCode SbImportOverlap(const SbImport *import, const int64_t number[3], PetscInt nshared);
/* The edges of the boundary facets, edge[3 nboundary], each a pair of vertices or of their numbers (SbKeyOfPair); those with more than two facets are counted. */
void SbBoundaryEdges(const SbImport *import, const SbFaces *faces, const PetscInt number[],
                     PetscInt64 edge[]);
PetscErrorCode SbCountPinched(PetscInt n, PetscInt64 edge[], PetscInt *npinched);
/* The "found" fields that follow from them. */
void SbShapeKeep(const SbShape *shape, SbBody *body);
/* What was repaired or is odd: fills the note of the body, whose number of parts is known. */
PetscErrorCode SbImportNote(const SbImport *import, SbBody *body);
/* parent[nvert]: the lowest vertex of the part that each vertex belongs to. */
void SbImportJoin(const SbImport *import, PetscInt parent[], PetscInt *npart);
/* Volume, shape, extent and number of parts: fills the "found" fields of the body. */
PetscErrorCode SbImportQuality(const SbImport *import, const SbFaces *faces, SbBody *body);
/* Volume, cosines of the six dihedral angles, radius ratio of a tet. */
void SbTetShape(const PetscReal x[], const PetscInt vert[4], PetscReal *V, PetscReal cosine[6],
                PetscReal *ratio);
/* A tet that check.c refuses as flat; `largest` is the largest coordinate in size. */
PetscBool SbTetFlat(const PetscReal x[], const PetscInt vert[4], PetscReal largest, PetscReal *det);

/* Masks of one body. */
typedef struct {
  uint64_t *vert; /* [nvert] */
  uint64_t *cell; /* [ncell] */
  uint64_t *face; /* [ncell][4] */
} SbMasks;
/* Marks boundary faces and the members of all sets in body b; the arrays are made here. */
PetscErrorCode SbSetsMark(const SbImport *import, const SbFaces *faces, PetscInt nbody, const SbBody body[],
                          PetscInt b, PetscInt nset, const SbSet set[], SbMasks *masks);
/* The bits of sets that are groups, for each tag set: bits[ntags]. */
PetscErrorCode SbSetsBits(const SbImport *import, PetscInt nbody, const SbBody body[], PetscInt b,
                          PetscInt nset, const SbSet set[], uint64_t bits[]);
/* Adds the vertices, boundary facets and cells that each set holds on all ranks. Collective. */
PetscErrorCode SbSetsCount(MPI_Comm comm, PetscInt nvert, PetscInt ncell, const SbMasks *masks, PetscInt nset,
                           SbSet set[]);
/*
  curve.c: cells with curved edges of a body whose element has nodes there are marked; the volume of the body becomes that of them; a note for other elements.
  The cells are those of all ranks of comm. Collective.

  Output: edge_off[][6][3] of the marked cells, NULL where there are none. Error: a cell whose map has no positive Jacobian at a point; with cell NULL they are counted
  in the note of the body.
*/
PetscErrorCode SbImportCurve(MPI_Comm comm, const SbImport *import, SbBody *body, uint64_t cell[],
                             PetscReal **edge_off);
/* Offsets of the edges 01 02 03 12 13 23 of a simplex of dim + 1 vertices, zero where it has none or straight ones; whether one is curved. Not collective. */
PetscBool SbImportOffsets(const SbImport *import, int dim, const PetscInt vert[], PetscReal off[18]);
/* Brings off[n][6][3] of cells orig[n], by original number, to where the cells are. Collective. */
PetscErrorCode SbMeshCurve(SbMesh mesh, PetscInt n, const PetscInt orig[], const PetscReal off[]);
/* Adds the members of sets that are groups. */
void SbMemoryMeshMark(const SbBody *body, const SbFaces *faces, SbMasks *masks);
/* A set that selects nothing is an error, which lists the groups that exist. */
PetscErrorCode SbSetsCheck(PetscInt nbody, const SbBody body[], const SbImport import[], PetscInt nset,
                           const SbSet set[]);

/* ------------------------------------------------------------------ route.c: see sbmesh.h */

/* Returns answer[nrecv] to the senders of the records: result[nsend], allocated by the caller. Collective. */
PetscErrorCode SbRouteReply(const SbRoute *route, size_t unit, const void *answer, void *result);
/* The rank that sent record i of those received. */
PetscMPIInt SbRouteSource(const SbRoute *route, PetscInt i);

/* ------------------------------------------------------------------ merge.c, partition.c, distribute.c, order.c, number.c */

/* Data sent with a vertex and with a cell. */
typedef struct {
  PetscInt orig, body;
  uint64_t set;
  PetscReal x[3];
} SbVertexData;
typedef struct {
  PetscInt orig, body;
  uint64_t set, face[4];
} SbCellData;

/*
  All bodies in one mesh, before it is cut into parts: some cells on each rank, with all their vertices. A vertex of cells on several ranks is on each of
  them with the same data.
*/
typedef struct {
  PetscInt Nvert, Ncell; /* on all ranks together */
  PetscInt nvert, ncell;
  SbVertexData *vertex; /* [nvert] ascending original numbers */
  PetscInt *cell;       /* [ncell][4] positions in vertex[] */
  SbCellData *data;     /* [ncell] */
  PetscInt *neighbour;  /* [ncell][4] cell across the face, -1: boundary, ncell + k: remote[k] */
  PetscInt nremote;
  PetscSFNode *remote; /* [nremote] */
  PetscInt ncurved;
  PetscInt *curved;    /* [ncurved] original numbers of curved cells, some on each rank */
  PetscReal *edge_off; /* [ncurved][6][3] as in SbMesh */
} SbMergedMesh;

typedef enum {
  SB_READING_AUTO,  /* slabs of large meshes on several ranks, where the format has them */
  SB_READING_RANK0, /* rank 0 reads all */
  SB_READING_SLABS  /* each rank a slab, where the format has them */
} SbReading;
/* Reads, checks and merges all bodies, fills their "found" fields and those of the sets, alike on all ranks. Collective. */
PetscErrorCode SbMergedMeshCreate(MPI_Comm comm, SbReading reading, PetscInt nbody, SbBody body[],
                                  PetscInt nset, SbSet set[], SbMergedMesh *merged);

/* A body before the merge: what this rank has of it, beside its SbImport. */
typedef struct {
  SbFaces faces; /* neighbours: ncell + k is remote[k] */
  SbMasks masks;
  PetscInt first;      /* original number of the first cell */
  PetscInt *orig;      /* [nvert] original numbers, ascending; NULL: 0, 1, ... */
  PetscReal *edge_off; /* [][6][3] of cells with SB_CURVED */
  PetscInt nremote;
  PetscSFNode *remote; /* [nremote] cells of other ranks, numbered there from its first body on */
} SbPart;
/* slab.c: reads and prepares body b of `body` in slabs; `before` cells of earlier bodies are on this rank. Collective. */
PetscErrorCode SbSlabPrepare(MPI_Comm comm, PetscInt before, PetscInt nbody, SbBody body[], PetscInt b,
                             PetscInt nset, SbSet set[], SbImport *import, SbPart *part);
PetscErrorCode SbMergedMeshDestroy(SbMergedMesh *merged);

typedef enum {
  SB_PARTITION_AUTO, /* METIS for small meshes, bisection for others */
  SB_PARTITION_METIS,
  SB_PARTITION_BISECTION
} SbPartitioner;
/* The rank that will own each cell: part[ncell]. Collective. */
PetscErrorCode SbPartition(MPI_Comm comm, SbPartitioner type, const SbMergedMesh *merged, PetscMPIInt part[]);

/* What a rank has of the mesh before it is numbered: owned cells by original number, then ghost ones; vertices of owned cells by original number, then the others. */
typedef struct {
  PetscInt ncell_owned, ncell, nvert;
  PetscInt *cell;       /* [ncell][4] positions in vertex[] */
  SbCellData *data;     /* [ncell] */
  SbVertexData *vertex; /* [nvert] */
  PetscMPIInt *owner;   /* [nvert] */
  SbRoute ghost;        /* copies of owned cells to other ranks, on several ranks */
  PetscInt *copied;     /* [ghost.nsend] the cell that is copied */
  PetscInt nvert_cells; /* vertices of owned cells */
} SbLocalMesh;

/* Hands the whole out to the ranks and destroys it. `all`: ghosts are all cells that share a vertex with an owned cell, else those with an owned vertex. Collective. */
PetscErrorCode SbDistribute(MPI_Comm comm, SbPartitioner type, PetscBool all, SbMergedMesh *merged,
                            SbLocalMesh *local);
/* Own local numbering: fills the arrays and counts of the mesh and destroys the local mesh. Collective. */
PetscErrorCode SbMeshNumber(SbMesh mesh, SbLocalMesh *local);
/* Reverse Cuthill-McKee order: order[i] is the vertex that gets number i. A cell's vertex may be -1: it takes no part. */
PetscErrorCode SbOrderRCM(PetscInt nvert, PetscInt ncell, const PetscInt cell[], PetscInt order[]);
