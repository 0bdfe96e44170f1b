/*
  mesh_impl.h - what the files of src/mesh/ share: a body as its reader delivers it, its faces, all bodies in one piece.

  Everything here lives on rank 0 until distribute.c hands the pieces to their ranks.
*/
#pragma once
#include "sbmeshfile.h"

#define SB_GROUP_MAX (2 * SB_NAME_MAX) /* longest name of a physical group, with the terminating zero */

/* ------------------------------------------------------------------ import.c: one body in memory */

/* A physical group of a file, or a side of a box: a name for entities of one dimension. */
typedef struct {
  PetscInt dim; /* 0 points, 1 curves, 2 surfaces, 3 volumes */
  int64_t tag;  /* number in the file */
  char name[SB_GROUP_MAX];
  PetscInt alone; /* tag set that holds only this group; -1 until somebody wants it */
} SbGroup;

/* Simplices of one dimension. */
typedef struct {
  PetscInt n, capacity;
  PetscInt *vert;  /* [n][dim + 1] */
  PetscInt *tags;  /* [n] tag set */
  int64_t *number; /* [n] number in the file, for messages */
} SbItems;

/* A body as its reader delivers it. Zeroed before the reader is called; freed by SbImportDestroy(), also after an error. */
struct _p_SbImport {
  char where[PETSC_MAX_PATH_LEN + 2 * SB_NAME_MAX]; /* "body 'liver': liver.msh", begins every message */
  PetscInt nvert;
  PetscReal *x;         /* [nvert][3] m once placed */
  int64_t *vert_number; /* [nvert] number in the file */
  SbItems item[4];      /* by dimension; item[3] are the tets */
  PetscInt ngroup;
  SbGroup *group;       /* [ngroup] */
  PetscInt ntags;       /* tag sets: which groups an item belongs to. Set 0 is empty */
  PetscInt *tags_start; /* [ntags + 1] */
  PetscInt *tags_group; /* [tags_start[ntags]] groups, ascending in each set */
  PetscInt capacity[3]; /* of group, tags_start, tags_group */
  PetscInt nslot;       /* a power of two */
  PetscInt *slot;       /* [nslot] groups by a hash of (dim, tag), or -1; made when needed */
  PetscBool surface;    /* given: all triangles are wanted, and tets need not be there */
  SbTetOptions tet;     /* given: how a surface becomes tets */
  PetscReal scale;      /* given: factor that placing will use; a reader that has scaled sets it to 1 */
  char note[512];       /* what the reader mended, for SbBody.note */
  PetscInt step; /* given: step of a run's output whose positions are wanted; 0 at rest, -1 the last one */
  SbMeshProgress progress; /* given: told how far a long read is; may be NULL */
  void *progress_ctx;
  /* found by SbImportCheck() */
  PetscInt nunused;     /* vertices left out */
  PetscInt nreoriented; /* cells turned */
  PetscInt nlost;       /* triangles of groups that are no face of a tet */
  PetscInt npinched;    /* surface edges with more than two facets */
};

/* A reader fills x, vert_number, items and groups from the file or description `text`. */
typedef PetscErrorCode (*SbReader)(const char *text, SbImport *body);
PetscErrorCode SbImportRead_Msh(const char *path,
                                SbImport *body); /* any version: by the next one, or by the gmsh library */
PetscErrorCode SbImportRead_Gmsh(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *body);
PetscErrorCode SbImportRead_TetGen(const char *path,
                                   SbImport *body); /* one of the files, or what they have in common */
PetscErrorCode SbImportRead_Netgen(const char *path, SbImport *body); /* .vol */
PetscErrorCode SbImportRead_NetgenNeutral(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Medit(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Mesh(const char *path,
                                 SbImport *body); /* .mesh: Medit, or the neutral format of Netgen */
PetscErrorCode SbImportRead_VTK(const char *path, SbImport *body);
PetscErrorCode SbImportRead_VTU(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Abaqus(const char *path, SbImport *body);
PetscErrorCode SbImportRead_UNV(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Box(const char *text, SbImport *body);
PetscErrorCode SbImportRead_Surface(const char *path, SbImport *body); /* which becomes tets by body->tet */
PetscErrorCode SbTetRegister(void);                                    /* rows of the option table */
PetscErrorCode SbImportRead_H5(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Xdmf(const char *path, SbImport *body);

/* Chooses the reader by the name of the mesh, reads, places. Not collective. */
PetscErrorCode SbImportRead(const SbBody *body, SbImport *import);
PetscErrorCode SbImportDestroy(SbImport *import);
/* given.c: the mesh that a body has in memory. */
PetscErrorCode SbImportGiven(const SbBody *body, SbImport *import);
/* Room for n vertices. */
PetscErrorCode SbImportSetVertices(SbImport *import, PetscInt n);
/* Appends a simplex; vert[dim + 1]. */
PetscErrorCode SbImportAddItem(SbImport *import, int dim, const PetscInt vert[], PetscInt tags,
                               int64_t number);
/* Room for exactly n simplices of a dimension that has none yet, numbered from 1 on, for the caller to fill. */
PetscErrorCode SbImportSetItems(SbImport *import, int dim, PetscInt n);
/* The group (dim, tag), made when new; a NULL name means "surface_12" until somebody gives one. */
PetscErrorCode SbImportGroup(SbImport *import, PetscInt dim, int64_t tag, const char *name, PetscInt *group);
/* The tag set that holds this group alone. */
PetscErrorCode SbImportTagsAlone(SbImport *import, PetscInt dim, int64_t tag, const char *name,
                                 PetscInt *tags);
/* The tag set that holds exactly these groups (any order, repeats allowed, reordered here), made when new. */
PetscErrorCode SbImportTagSet(SbImport *import, PetscInt n, PetscInt groups[], PetscInt *tags);

/* ------------------------------------------------------------------ members.c: sets that are listed apart from their items */

/* Item `item` of dimension dim belongs to a group. */
typedef struct {
  PetscInt dim, item, group;
} SbMember;
typedef struct {
  PetscInt n, capacity;
  SbMember *row; /* [n] */
} SbMembers;

PetscErrorCode SbMembersAdd(SbMembers *members, PetscInt dim, PetscInt item, PetscInt group);
/* Gives every item the groups listed for it, beside those that it has; frees the list. */
PetscErrorCode SbMembersApply(SbMembers *members, SbImport *im);
PetscErrorCode SbMembersDestroy(SbMembers *members);

/* ------------------------------------------------------------------ numbers.c: from numbers of a file to places in memory */

typedef struct {
  int64_t number;
  PetscInt vert;
} SbNumbered;
typedef struct {
  PetscInt n;
  int64_t first, ntable;
  PetscInt *table;    /* [ntable] place of number first + i, or -1; NULL when the numbers are far apart */
  SbNumbered *sorted; /* [n] then this */
  PetscBool repeated; /* a number stands twice */
  int64_t twice;      /* this one */
} SbNumbers;

/* Prepares the way from number[n] to 0 ... n - 1; zeroed, or made before: then it is made again. */
PetscErrorCode SbNumbersCreate(PetscInt n, const int64_t number[], SbNumbers *index);
PetscErrorCode SbNumbersDestroy(SbNumbers *index);
/* Place of a number, -1 when there is none. */
PetscInt SbNumbersFind(const SbNumbers *index, int64_t number);

/* ------------------------------------------------------------------ faces.c: which cells share a face */

typedef struct {
  uint64_t key;  /* middle and highest vertex */
  PetscInt slot; /* 4 * cell + face */
} SbFaceKey;

typedef struct {
  PetscInt nvert, ncell;
  PetscInt *start;     /* [nvert + 1] into `face`: faces by lowest vertex */
  SbFaceKey *face;     /* [4 * ncell] ascending keys below each lowest vertex */
  PetscInt *neighbour; /* [ncell][4] cell across face f (opposite vertex f), -1 on the boundary */
  PetscInt nboundary;
  PetscInt nshared;   /* faces of more than two cells */
  PetscInt shared[3]; /* three cells at the first one of these */
} SbFaces;

extern const int
  SbFaceVertex[4][3]; /* of face f, counter-clockwise seen from outside a positively oriented tet */

PetscErrorCode SbFacesCreate(PetscInt nvert, PetscInt ncell, const PetscInt cell[], SbFaces *faces);
PetscErrorCode SbFacesDestroy(SbFaces *faces);
/* Slots of the face with these vertices: 0 (no such face), 1 (boundary) or 2. */
PetscInt SbFacesFind(const SbFaces *faces, const PetscInt vert[3], PetscInt slots[2]);

/* ------------------------------------------------------------------ import_edges.c: edges, pairs of vertices that an item joins */

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

/* ------------------------------------------------------------------ write_gmsh.c, write_h5.c: one file, written to `path` as it is */

PetscErrorCode SbWrite_Gmsh(const SbImport *import, const char *path, SbMeshFormat format);
PetscErrorCode SbWrite_H5(const SbImport *import, const char *path);
/* The index for ParaView of a mesh that was written to `h5`. */
PetscErrorCode SbWrite_Xdmf(const SbImport *import, const char *path, const char *h5);

/* ------------------------------------------------------------------ check.c, quality.c, sets.c */

/* Drops unused vertices, turns cells, refuses what would make the physics wrong; builds the faces. */
PetscErrorCode SbImportCheck(SbImport *import, SbFaces *faces);
/* Volume, shape, extent and number of parts: fills the "found" fields of the body. */
PetscErrorCode SbImportQuality(const SbImport *import, const SbFaces *faces, SbBody *body);
/* How many tets have a dihedral angle below this, and the smallest of all, degrees. */
PetscErrorCode SbImportSlivers(const SbImport *import, PetscReal degrees, PetscInt *n, PetscReal *smallest);
/* Volume, cosines of the six dihedral angles, radius ratio of a tet. */
void SbTetShape(const PetscReal x[], const PetscInt vert[4], PetscReal *V, PetscReal cosine[6],
                PetscReal *ratio);
/* Parts that share no vertex. */
PetscErrorCode SbImportParts(const SbImport *import, PetscInt *npart);
/* A tet that check.c refuses as flat; `largest` is the largest coordinate in size. */
PetscBool SbTetFlat(const PetscReal x[], const PetscInt vert[4], PetscReal largest, PetscReal *det);
/* Six times the signed volume of a tet, m^3. */
PetscReal SbTetDet(const PetscReal x[], const PetscInt vert[4]);

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

/* ------------------------------------------------------------------ create.c: errors of rank 0 */

/* What rank 0 has to say, to be raised by all ranks. */
typedef struct {
  int code;
  char text[1024];
} SbCaught;
/* For PetscPushErrorHandler(), ctx an SbCaught: keeps the message. An error that is not the user's is also printed with its trace. */
PetscErrorCode SbCatchError(MPI_Comm comm, int line, const char *function, const char *file,
                            PetscErrorCode code, PetscErrorType kind, const char *text, void *ctx);

/* ------------------------------------------------------------------ scan.c: a file in memory */

typedef struct {
  const char *where; /* begins every message */
  char *data;        /* whole file and a terminating zero */
  const char *end;
  const char *at;    /* next byte */
  const char *token; /* what was read last, for messages */
  PetscBool binary;  /* the numbers that follow are binary */
  PetscBool bytes;   /* messages count bytes instead of lines */
  PetscBool swap;    /* from a machine with the other byte order */
} SbScan;

PetscErrorCode SbScanOpen(const char *where, const char *path, SbScan *scan);
PetscErrorCode SbScanClose(SbScan *scan);
/* "line 12" or "byte 4711" of the last token. */
const char *SbScanPlace(const SbScan *scan, char place[64]);
/* Numbers, as text or in binary of 4 or 8 bytes; `what` tells what is expected there. */
PetscErrorCode SbScanText(SbScan *scan, const char *what, int64_t *value); /* always text */
PetscErrorCode SbScanInt4(SbScan *scan, const char *what, int64_t *value);
PetscErrorCode SbScanInt8(SbScan *scan, const char *what, int64_t *value);
PetscErrorCode SbScanReal(SbScan *scan, const char *what, int64_t number,
                          PetscReal *value); /* `what` of `number` */
/* A count of things that take at least so many bytes each as text and in binary: more than the file holds is an error. */
PetscErrorCode SbScanRoom(SbScan *scan, const char *what, int64_t n, int64_t text_bytes,
                          int64_t binary_bytes);
PetscErrorCode SbScanQuoted(SbScan *scan, const char *what, size_t size, char value[]); /* "in quotes" */
/* The next word; empty at the end of the file. */
PetscErrorCode SbScanWord(SbScan *scan, size_t size, char word[]);
PetscErrorCode SbScanEndOfLine(SbScan *scan); /* to the first byte after it */
void SbScanNext(SbScan *scan,
                char comment); /* to the next word, over blank lines and comments to the end of a line */
PetscBool SbScanMore(SbScan *scan, char comment);     /* whether another word stands on this line */
PetscBool SbScanFind(SbScan *scan, const char *text); /* moves to its beginning */

#define SB_SCAN_ERROR(scan, ...)                                                    \
  do {                                                                              \
    char sb_place[64], sb_text[512];                                                \
    (void)snprintf(sb_text, sizeof(sb_text), __VA_ARGS__);                          \
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s %s: %s", (scan)->where, \
            SbScanPlace(scan, sb_place), sb_text);                                  \
  } while (0)
