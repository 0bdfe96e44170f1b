/*
  mesh_impl.h - shared declarations of src/mesh/: import of a body, edges and shape of its cells,
  its sets, the merged mesh of all bodies. A body is on rank 0, or in slabs on all ranks, until
  distribute.c sends the cells to their owners.
*/
#pragma once
#include <petscpartitioner.h>
#include <petscsf.h>
#include "sbmeshio.h"

/* Pseudorandom hash of an integer (splitmix64, Steele et al. 2014). */
static inline uint64_t SbMix(PetscInt i)
{
  uint64_t z = ((uint64_t)i + 1) * 0x9e3779b97f4a7c15u;

  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

/* memory_mesh.c: imports the body's mesh in memory. */
PetscErrorCode SbImportMemoryMesh(const SbBody *body, SbImport *import);

/* check.c, quality.c, sets.c */

/* Largest absolute coordinate, m. */
PetscReal SbImportLargest(const SbImport *import);
/* Orients cells, builds faces; `largest`: coordinate, m. Errors: flat, duplicate tets, faces of
   three. */
PetscErrorCode SbImportCheckCells(SbImport *import, PetscReal largest, SbFaces *faces);
/* Raise these two errors: file numbers of the tets, number of faces with more than two tets. */
PetscErrorCode SbImportTwice(const SbImport *import, int64_t a, int64_t b);
PetscErrorCode SbImportOverlap(const SbImport *import, const int64_t number[3], PetscInt nshared);
/* Edges of the boundary facets, edge[3 nboundary], each a key of two vertices or of their numbers
   (SbKeyOfPair); counts the edges with more than two facets. */
void SbBoundaryEdges(const SbImport *import, const SbFaces *faces, const PetscInt number[],
                     PetscInt64 edge[]);
PetscErrorCode SbCountPinched(PetscInt n, PetscInt64 edge[], PetscInt *npinched);
/* touching.c: boundary facets that lie on each other without being one face */
typedef struct {
  PetscInt n, ndoubled; /* pairs; those whose corners are at the same positions, as two vertices */
  PetscInt ntwice;      /* those on the same side, of parts that are there twice */
  PetscInt npart;       /* parts of the body that hang together by faces, when n > 0 */
  int64_t number[2];    /* tets of the first pair, in the file */
  PetscReal at[3];      /* its place, m */
} SbTouching;
PetscErrorCode SbImportTouching(const SbImport *import, const SbFaces *faces, SbTouching *touching);
/* What they are and, with the file, what to do. */
void SbTouchingText(const SbTouching *touching, const char *file, size_t size, char text[]);
/* Warns of them. Error: the body falls apart with an element whose unknowns are at faces. Its
   number of parts is known. */
PetscErrorCode SbImportCheckTouching(const SbImport *import, const SbFaces *faces, SbBody *body);
/* Size and shape of the cells of all ranks of comm: sets those of the "found" fields.
   Collective. */
PetscErrorCode SbImportMeasure(MPI_Comm comm, const SbImport *import, const SbFaces *faces,
                               SbBody *body);
/* Writes repairs and warnings to the note of the body, whose number of parts is known. */
void SbImportNote(const SbImport *import, SbBody *body);
/* Connected parts: parent[nvert] is the lowest vertex of the part that each vertex belongs to. */
void SbImportJoin(const SbImport *import, PetscInt parent[], PetscInt *npart);
/* The same of a whole body, its number of parts and its note: all "found" fields. */
PetscErrorCode SbImportQuality(const SbImport *import, const SbFaces *faces, SbBody *body);
/* Volume, cosines of the six dihedral angles, radius ratio of a tet. */
void SbTetShape(const PetscReal x[], const PetscInt vert[4], PetscReal *V, PetscReal cosine[6],
                PetscReal *ratio);
/* Whether a tet is flat as defined in check.c; `largest`: largest absolute coordinate, m. */
PetscBool SbTetFlat(const PetscReal x[], const PetscInt vert[4], PetscReal largest, PetscReal *det);

/* Set membership of the vertices, cells and faces of one body, bits SB_SET_BIT(). */
typedef struct {
  uint64_t *vert; /* [nvert] */
  uint64_t *cell; /* [ncell] */
  uint64_t *face; /* [ncell][4] */
} SbMasks;
/* Marks boundary faces and the members of all sets in body b; allocates the arrays. */
PetscErrorCode SbSetsMark(const SbImport *import, const SbFaces *faces, PetscInt nbody,
                          const SbBody body[], PetscInt b, PetscInt nset, const SbSet set[],
                          SbMasks *masks);
/* Bits of the sets that are groups, for each tag set: bits[ntags]. */
void SbSetsBits(const SbImport *import, PetscInt nbody, const SbBody body[], PetscInt b,
                PetscInt nset, const SbSet set[], uint64_t bits[]);
/* Adds the numbers of vertices, boundary facets and cells of each set, summed over all ranks.
   Collective. */
PetscErrorCode SbSetsCount(MPI_Comm comm, PetscInt nvert, PetscInt ncell, const SbMasks *masks,
                           PetscInt nset, SbSet set[]);
/* curve.c: edges made straight because a tet of them folds over itself, on this rank */
typedef struct {
  PetscInt ntet, nedge;
  int64_t number;  /* of the first tet, in the file */
  PetscReal at[3]; /* its place, m */
} SbStraightened;
/* Makes edges straight until the Jacobian of each curved tet is positive. Cells are those of all
   ranks of comm. Collective. */
PetscErrorCode SbImportStraighten(MPI_Comm comm, SbImport *import, SbStraightened *done);
/*
  Marks cells with curved edges if the body's element has edge nodes, and corrects the body's
  volume; other elements get a note. The cells are those of all ranks of comm. Collective.

  Output: edge_off[][6][3] of the marked cells, NULL if there are none; the note of the body counts
  those whose edges are made straight, as their Jacobian is not positive.
*/
PetscErrorCode SbImportCurve(MPI_Comm comm, SbImport *import, SbBody *body, uint64_t cell[],
                             PetscReal **edge_off);
/* Offsets of the edge nodes from the midpoints, edges 01 02 03 12 13 23 of a simplex of dim + 1
   vertices; zero for straight and missing edges. Returns whether one is curved. Not collective. */
PetscBool SbImportOffsets(const SbImport *import, int dim, const PetscInt vert[],
                          PetscReal off[18]);
/* Brings off[n][6][3] of the cells orig[n] (original numbers) to the ranks that have them.
   Collective. */
PetscErrorCode SbMeshCurve(SbMesh mesh, PetscInt n, const PetscInt orig[], const PetscReal off[]);
/* Adds the members of sets that are groups, for a mesh in memory. */
void SbMemoryMeshMark(const SbBody *body, const SbFaces *faces, SbMasks *masks);
/* Raises an error for a set without members; the message lists the existing groups. */
PetscErrorCode SbSetsCheck(PetscInt nbody, const SbBody body[], const SbImport import[],
                           PetscInt nset, const SbSet set[]);

/* route.c: see sbmesh.h */

/* A growing list of items that go to other ranks, zeroed at first; its arrays become those of a
   route. */
typedef struct {
  PetscInt n, room[2];
  PetscInt *item;    /* [n] */
  PetscMPIInt *rank; /* [n] */
} SbRouteList;
PetscErrorCode SbRouteAdd(SbRouteList *list, PetscInt item, PetscMPIInt rank);
/* Returns answer[nrecv] to the senders of the records: result[nsend], allocated by the caller.
   Collective. */
PetscErrorCode SbRouteReply(const SbRoute *route, size_t unit, const void *answer, void *result);

/* forest.c: ranks that have leaves of each root, user[start[k]] to user[start[k + 1] - 1]
   ascending; the caller frees both. Collective. */
PetscErrorCode SbForestRanks(PetscSF forest, PetscInt **start, PetscMPIInt **user);

/* merge.c, partition.c, distribute.c, order.c, number.c */

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

/* Merged mesh of all bodies before it is distributed: some cells on each rank, with all their
   vertices. A vertex of cells on several ranks is stored on each of them with the same data. */
typedef struct {
  PetscInt nbody;
  const SbBody *body;    /* [nbody] borrowed; NULL: no body has to be on one rank */
  PetscInt Nvert, Ncell; /* global counts */
  PetscInt nvert, ncell;
  SbVertexData *vertex; /* [nvert] ascending original numbers */
  PetscInt *cell;       /* [ncell][4] positions in vertex[] */
  SbCellData *data;     /* [ncell] */
  PetscInt *neighbour;  /* [ncell][4] cell across the face; -1: boundary; ncell + k: remote[k] */
  PetscInt nremote;
  PetscSFNode *remote; /* [nremote] cells of other ranks across faces */
  PetscInt ncurved;
  PetscInt *curved;    /* [ncurved] original numbers of curved cells, on the ranks that read them */
  PetscReal *edge_off; /* [ncurved][6][3] as in SbMesh */
} SbMergedMesh;

typedef enum {
  SB_READING_AUTO,  /* slabs for large meshes on several ranks, if the format supports them */
  SB_READING_RANK0, /* rank 0 reads everything */
  SB_READING_SLABS  /* each rank reads a slab, if the format supports it */
} SbReading;
/* Reads, checks and merges all bodies; sets their "found" fields and those of the sets.
   Collective. */
PetscErrorCode SbMergedMeshCreate(MPI_Comm comm, SbReading reading, PetscInt nbody, SbBody body[],
                                  PetscInt nset, SbSet set[], SbMergedMesh *merged);

/* This rank's part of a body before the merge, in addition to its SbImport. */
typedef struct {
  SbFaces faces; /* neighbour ncell + k is remote[k] */
  SbMasks masks;
  PetscInt first;                /* original number of the first cell, from the body's first one */
  PetscInt orig_vert, orig_cell; /* original numbers of the body's first vertex and cell */
  PetscInt vert0, cell0,
    remote0;           /* numbers of its first vertex, cell and remote cell on this rank */
  PetscInt *orig;      /* [nvert] original numbers, ascending; NULL: 0, 1, ... */
  PetscReal *edge_off; /* [][6][3] of cells with SB_CURVED */
  PetscInt nremote;
  PetscSFNode
    *remote; /* [nremote] cells of other ranks; indices count from the first body of that rank */
} SbPart;
/* touching.c: the same of a body in slabs; `before`: cells of earlier bodies on this rank; number:
   file numbers of its vertices. Then the warning or error on all ranks of comm, of a body whose
   number of parts is known. Collective. */
PetscErrorCode SbSlabTouching(MPI_Comm comm, PetscInt before, const SbImport *import,
                              const SbPart *part, const PetscInt number[], SbTouching *touching);
PetscErrorCode SbTouchingReport(MPI_Comm comm, const SbTouching *touching, const char *where,
                                const SbBody *body);
/* slab.c: reads and prepares body b in slabs; `before`: cells of earlier bodies on this rank.
   Collective. */
PetscErrorCode SbSlabPrepare(MPI_Comm comm, PetscInt before, PetscInt nbody, SbBody body[],
                             PetscInt b, PetscInt nset, SbSet set[], SbImport *import,
                             SbPart *part);
PetscErrorCode SbMergedMeshDestroy(SbMergedMesh *merged);

/* Our types of PetscPartitioner. Prepare: registers them and checks -petscpartitioner_type; error:
   a type that there is not. Collective. */
#define SB_PARTITIONER_METIS "metis"
#define SB_PARTITIONER_BISECTION "bisection"
PetscErrorCode SbPartitionerPrepare(MPI_Comm comm);
/* Owner rank of each cell: part[ncell], one rank for all cells of a rigid body; the type: that of
   the option, or metis for small meshes, else bisection. Collective. */
PetscErrorCode SbPartition(PetscPartitioner partitioner, const SbMergedMesh *merged,
                           PetscMPIInt part[]);

/* Mesh before renumbering: owned cells, then ghosts; their vertices, then others; by original
   number. */
typedef struct {
  PetscInt ncell_owned, ncell, nvert;
  PetscInt *cell;       /* [ncell][4] positions in vertex[] */
  SbCellData *data;     /* [ncell] */
  SbVertexData *vertex; /* [nvert] */
  PetscMPIInt *owner;   /* [nvert] */
} SbLocalMesh;

PetscErrorCode SbLocalMeshDestroy(SbLocalMesh *local);
/* Distributes the merged mesh, of which only the curved cells remain. `all`: ghosts are all cells
   that share a vertex with an owned cell, else those with an owned vertex. Collective. */
PetscErrorCode SbDistribute(PetscPartitioner partitioner, PetscBool all, SbMergedMesh *merged,
                            SbLocalMesh *local);
/* Local numbering: fills the arrays and counts of the mesh and frees the local mesh. Collective. */
PetscErrorCode SbMeshNumber(SbMesh mesh, SbLocalMesh *local);
/* faces.c */

/* Edges of the cells, each once: edge[ncell][6], the number of each edge of a cell, 01 02 03 12 13
   23; PetscFree(). */
PetscErrorCode SbTetEdges(PetscInt nvert, PetscInt ncell, const PetscInt cell[], PetscInt *nedge,
                          PetscInt **edge);

/* plex.c: the DMPLEX of the numbered mesh; sides: with faces and edges. Collective. */
PetscErrorCode SbPlexCreate(SbMesh mesh, PetscBool sides);
/* Reverse Cuthill-McKee order: order[i] is the vertex with new number i. Cell vertices of -1 are
   ignored. */
PetscErrorCode SbOrderRCM(PetscInt nvert, PetscInt ncell, const PetscInt cell[], PetscInt order[]);
