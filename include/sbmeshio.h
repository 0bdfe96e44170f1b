/*
  sbmeshio.h - layer 2: a body as its reader delivers it, services for readers. Not collective
  throughout.
*/
#pragma once
#include <hdf5.h>
#include <sys/types.h>
#include "sbmesh.h"

#define SB_GROUP_MAX \
  (2 * SB_NAME_MAX) /* longest name of a physical group, with the terminating zero */

/* numbers.c: from numbers of a file to indices in memory */
typedef struct {
  PetscInt n, capacity, nslot; /* nslot: a power of two; 0 while the numbers are consecutive */
  int64_t *number;             /* [n] */
  PetscInt *slot;              /* [nslot] indices by a hash of their number, or -1 */
} SbNumbers;

/* Adds a number, whose index is n. Zeroed before the first one. */
PetscErrorCode SbNumbersAdd(SbNumbers *numbers, int64_t number);
/* Index of a number, the last one when it was added twice, -1 when there is none. */
PetscInt SbNumbersFind(const SbNumbers *numbers, int64_t number);

/* scan.c: a file in memory */

/* Where bytes from `at` on come from, when a text is put together of several files. */
typedef struct {
  size_t at;
  const char *where;
  size_t line; /* number of the first line there */
} SbScanPiece;
typedef struct {
  const char *where; /* begins every message */
  char *data;        /* whole file and a terminating zero; PetscFree() */
  const char *end;
  const char *at;    /* next byte */
  const char *token; /* the last token, for messages */
  char comment; /* begins a comment up to the end of the line, which is passed over; 0: none does */
  PetscBool binary; /* the numbers that follow are binary */
  PetscBool bytes;  /* messages count bytes instead of lines */
  PetscBool swap;   /* from a machine with the other byte order */
  PetscInt npiece;
  const SbScanPiece *piece; /* [npiece] ascending; none: all is of one file */
} SbScan;

PetscErrorCode SbScanOpen(const char *where, const char *path, SbScan *scan);
/* What begins a message about the last token: `where`, or that of its piece. */
const char *SbScanWhere(const SbScan *scan);
/* "line 12" or "byte 4711" of the last token. */
const char *SbScanPosition(const SbScan *scan, char position[64]);
/* Numbers, as text or, but for SbScanText(), in binary; `what` names the expected item, for
   messages, that of `number`. A point: three finite ones. */
PetscErrorCode SbScanText(SbScan *scan, const char *what, int64_t *value);
PetscErrorCode SbScanReal(SbScan *scan, const char *what, int64_t number, PetscReal *value);
PetscErrorCode SbScanPoint(SbScan *scan, const char *what, int64_t number, PetscReal x[3]);
/* A count of items with at least these bytes each, as text and in binary: an error if the file is
   shorter. */
PetscErrorCode SbScanRoom(SbScan *scan, const char *what, int64_t n, int64_t text_bytes,
                          int64_t binary_bytes);
/* The same of a "number of <what>" that it reads, in binary of 8 bytes. */
PetscErrorCode SbScanCount(SbScan *scan, const char *what, int text_bytes, int binary_bytes,
                           int64_t *n);
/* Binary format of a number. */
typedef struct {
  char kind; /* 'i' signed, 'u' unsigned, 'f' floating point */
  int size;  /* bytes */
} SbNumberType;
/* The next word, one of the names that VTK's and PLY files have for types. */
PetscErrorCode SbScanType(SbScan *scan, SbNumberType *type);
/* n numbers of this type from bytes. */
void SbNumbersConvert(SbNumberType type, PetscBool big_endian, size_t n, const void *bytes,
                      double value[]);
/* Whether there is a next word; empty at the end of the file. */
PetscBool SbScanWord(SbScan *scan, size_t size, char word[]);
void SbScanEndOfLine(SbScan *scan); /* to the first byte after it */
void SbScanNext(SbScan *scan);      /* to the next word, over blank lines and comments */
PetscBool SbScanMore(SbScan *scan, char comment);
#define SB_SCAN_ERROR(scan, ...)                                                        \
  do {                                                                                  \
    char sb_position[64], sb_text[512];                                                 \
    (void)snprintf(sb_text, sizeof(sb_text), __VA_ARGS__);                              \
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s %s: %s", SbScanWhere(scan), \
            SbScanPosition(scan, sb_position), sb_text);                                \
  } while (0)
#define SB_SCAN_ENDS(scan, what, ...)                                                          \
  SB_SCAN_ERROR(                                                                               \
    scan, "the file ends where " what " is expected; it is truncated, write or copy it again", \
    __VA_ARGS__)

/* import.c: one body in memory */

/* A physical group of a file, or a side of a box: a name for entities of one dimension. */
typedef struct {
  PetscInt dim; /* 0 points, 1 curves, 2 surfaces, 3 volumes */
  int64_t tag;  /* number in the file */
  char name[SB_GROUP_MAX];
  PetscInt alone; /* tag set with only this group; -1: not created yet */
} SbGroup;

/* Compares the name of a group; option values have no blanks, so an underscore matches a blank. */
PetscBool SbGroupIsNamed(const SbGroup *group, const char *name);

/* gmsh's numbers of element types, by which readers of all formats count. */
enum {
  SB_GMSH_LINE = 1,
  SB_GMSH_TRIANGLE = 2,
  SB_GMSH_TET = 4,
  SB_GMSH_LINE3 = 8,
  SB_GMSH_TRIANGLE6 = 9,
  SB_GMSH_TET10 = 11,
  SB_GMSH_POINT = 15,
  SB_GMSH_NTYPES = 32
};

/* Progress callback: `done` of `total` items, named by `what` ("tets read"); total 0: not known. */
typedef PetscErrorCode (*SbMeshProgress)(const char *what, PetscInt64 done, PetscInt64 total,
                                         void *ctx);

/* Simplices of one dimension. */
typedef struct {
  PetscInt n, capacity;
  PetscInt *vert;  /* [n][dim + 1] */
  PetscInt *tags;  /* [n] tag set */
  int64_t *number; /* [n] number in the file, for messages */
} SbItems;

/* Item `item` of dimension dim belongs to a group. */
typedef struct {
  PetscInt dim, item, group;
} SbGroupMember;

/* An array that grows by one at its end, of which there are n. */
typedef struct {
  PetscInt n, capacity;
} SbCount;

/* The node of an edge of 10-node tets. */
typedef struct {
  PetscInt end[2],
    node; /* vertices, end[0] < end[1]; -1: off is known, -1 - r: from row r of a file's list */
  PetscReal off[3]; /* from the middle of the edge, m once placed */
} SbMiddle;

/* A body as its reader delivers it. Zeroed before; freed by SbImportDestroy(), also after an
   error. */
struct _p_SbImport {
  char where[PETSC_MAX_PATH_LEN +
             2 * SB_NAME_MAX]; /* "body 'liver': liver.msh", begins every message */
  char body[SB_NAME_MAX];      /* "liver"; "" in supple-mesh */
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
  SbNumbers groups;     /* by 4 tag + dim */
  SbCount nmiddle;
  SbMiddle
    *middle; /* [nmiddle] edges of 10-node tets; once read those off the middle, once, ascending */
  PetscBool surface; /* input: all triangles are read, and tets are optional */
  SbTetOptions tet;  /* input: parameters for filling a surface with tets */
  PetscReal
    scale; /* input: scale factor, applied after reading; a reader that has scaled sets it to 1 */
  char note[512]; /* repairs by the reader, for SbBody.note */
  PetscInt
    step; /* input: step of a run's output whose positions are read; 0 at rest, -1 the last one */
  /* input: name of an array that is kept, "": none, and its numbers per tet, 1 or 3; by the number
     of the tet in the file */
  char field[SB_NAME_MAX];
  int field_width;
  PetscInt nfield;         /* 0: the file has none of this name */
  int64_t *field_number;   /* [nfield] */
  PetscReal *field_value;  /* [nfield][width]; three numbers: turned as the mesh, once placed */
  SbMeshProgress progress; /* input: progress callback of long reads; may be NULL */
  void *progress_ctx;
  /* while a file is read; SbImportForget() */
  SbScan scan;
  SbNumbers nodes, elements;     /* by the numbers that the file gives them */
  int64_t count[SB_GMSH_NTYPES]; /* elements that the file holds, by type */
  SbCount nmember;
  SbGroupMember *member;        /* [nmember] sets that the file lists apart from their items */
  struct _p_SbScratch *scratch; /* arrays of the reader */
  SbCount nskipped;
  struct {
    char name[SB_NAME_MAX];
    PetscInt n;
  } * skipped; /* [nskipped] what the file holds and a mesh does not need, and how often */
  /* found by SbImportCheck() */
  PetscInt nunused;     /* vertices left out */
  PetscInt nreoriented; /* cells turned */
  PetscInt nlost;       /* triangles of groups that are no face of a tet */
  PetscInt npinched;    /* surface edges with more than two facets */
};

/* Reads a mesh of any kind that -body_<name>_mesh takes, and places it; nothing in it is checked.
   Of the body: name (for messages; "": the file alone), mesh, mesh_step, scale, rotate, translate,
   tet. */
PetscErrorCode SbImportRead(const SbBody *body, SbImport *import);
PetscErrorCode SbImportDestroy(SbImport *import);
/*
  SbImportCellData - an array of numbers, width 1, or vectors, 3, of the tets in a body's mesh file:
  ElementData of gmsh, CellData of VTK, /mesh/NAME of an .h5; not collective.

  Output, to be freed by PetscFree(): centre[n][3], m, of the tets, and value[n][width] as in the
    file, centres and vectors placed as the body is.
  Errors: PETSC_ERR_USER_INPUT if there is no array of this name and width, or it lacks a tet.
*/
PetscErrorCode SbImportCellData(const SbBody *body, const char *option, const char *name, int width,
                                PetscInt *n, PetscReal **centre, PetscReal **value);
/* Leaves out vertices with keep[] 0, and items with one; keep[nvert] becomes the new numbers, or
   -1. */
void SbImportDropVertices(SbImport *import, PetscInt keep[]);
/* Once tets and nodes of edges are read: edges of tets off their middle, each once, ascending;
   nodes that are no corner of a tet are no vertices any more. Output: found[nmiddle], which of
   those in a list are edges of tets, or NULL: it is an error if one is not; largest, off the middle
   over the length. Errors: an edge with two nodes at different places, or twice in a list. Not
   collective. */
PetscErrorCode SbImportMiddles(SbImport *import, PetscBool found[], PetscReal *largest);
/* The error of one that is listed and of no tet. */
PetscErrorCode SbImportLostMiddle(const SbImport *import, const SbMiddle *lost);
/* The note of the reader about n edges off their middle. */
void SbImportNoteMiddles(SbImport *import, PetscInt n, PetscReal largest);
/* The same of a body that may be one of many copies: `before`, the body before it or NULL, and
   `shared`, zeroed at first, in which the mesh of its file is kept for the next one; destroy it. */
PetscErrorCode SbImportReadCopy(const SbBody *body, const SbBody *before, SbImport *shared,
                                SbImport *import);
/* Which rows of the arrays of an .h5 mesh a slab has: from first, in blocks of `block`, N in the
   file. */
typedef struct {
  PetscInt N, block, first;
} SbSlabRows;
/* Tets of a mesh that can be read in slabs, an .h5 of supple's own; 0: it cannot, or is not
   there. */
void SbImportSlabs(const SbBody *body, PetscInt *ncell);
/*
  SbImportSlab - slab k of n of such a mesh, placed. Not collective.

  Output:
    import - the k-th block of the vertices and that of the simplices of each dimension, with
    numbers of
             vertices in the file, from 0 on; all groups
    rows   - of the vertices
  Errors: those of SbImportRead() that these blocks show.
*/
PetscErrorCode SbImportSlab(const SbBody *body, PetscInt k, PetscInt n, SbImport *import,
                            SbSlabRows *rows);
/* How the user writes an option of this body, for messages: "-body_liver_tet_size"; supple-mesh:
   "-size". */
#define SB_IMPORT_OPTION_MAX (SB_NAME_MAX + 32)
const char *SbImportOption(const SbImport *import, const char *key,
                           char name[SB_IMPORT_OPTION_MAX]);
/* A .msh of any version. */
PetscErrorCode SbImportRead_Gmsh(const char *path, SbImport *body);
/* TetGen's files; path: one of them, or what they have in common. */
PetscErrorCode SbImportRead_TetGen(const char *path, SbImport *body);

/* In a forked child of `parent`: resets signal handlers, masks and terminal of the parent; the
   child ends with the parent, and after `seconds` by SIGALRM, also after exec. */
void SbChildIsolate(pid_t parent, PetscReal seconds);
/* Allocates (*array NULL) or enlarges an array of a reader; freed by SbImportDestroy() at the
   latest. */
PetscErrorCode SbImportScratch(SbImport *import, size_t bytes, void *array);
/* The same for one more of `unit` bytes each. */
PetscErrorCode SbImportGrow(SbImport *import, SbCount *count, size_t unit, void *array);
/* Allocates n vertices, numbered from 1 on. */
PetscErrorCode SbImportSetVertices(SbImport *import, PetscInt n);
/* Adds to the note what the reader has done, or what a mesh does not need and is left out: each
   kind once, with its count. */
PetscErrorCode SbImportSkip(SbImport *import, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(2, 3);
/* Appends a simplex; vert[dim + 1]. */
PetscErrorCode SbImportAddItem(SbImport *import, int dim, const PetscInt vert[], PetscInt tags,
                               int64_t number);
/* Allocates n simplices of a dimension that has none yet, numbered from 1 on; the caller fills
   them. */
PetscErrorCode SbImportSetItems(SbImport *import, int dim, PetscInt n);
PetscErrorCode SbItemsFree(SbItems *items);
/* Copies item `from` to item `to`. */
void SbItemsMove(SbItems *items, int dim, PetscInt to, PetscInt from);
/* The group (dim, tag), made when new; a NULL name means "surface_12" until somebody gives one. */
PetscErrorCode SbImportGroup(SbImport *import, PetscInt dim, int64_t tag, const char *name,
                             PetscInt *group);
/* The tag set that holds exactly these groups (any order, repeats allowed, reordered here), made
   when new. */
PetscErrorCode SbImportTagSet(SbImport *import, PetscInt n, PetscInt groups[], PetscInt *tags);
/* Of simplices with the same vertices the first stays, with the groups of all; but for `all` only
   of those that have groups and share none. Adds how many went. */
PetscErrorCode SbImportJoinRepeats(SbImport *import, int dim, PetscBool all, PetscInt *ndropped);

/* edges.c: pairs of vertices that an item joins */
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
/* x[nedge][3]: the middle of each edge, or where its node is off it. */
void SbImportEdgeNodes(const SbImport *import, const SbImportEdges *edges, PetscReal x[]);

/* write_h5.c: indices of HDF5 files for ParaView */

/* An array [n] or [n][ncomp] of type "Int" or "Float" as a DataItem of XDMF; file, path: a printf
   format. */
void SbXdmfArray(FILE *file, PetscInt64 n, int ncomp, const char *type, int bytes,
                 const char *format, ...) PETSC_ATTRIBUTE_FORMAT(6, 7);

/* own_h5.c */

/*
  SbH5IsOwn - whether all that an HDF5 file holds is in the file itself: no external or soft link,
  no dataset stored in other files (external storage, virtual). Others could make a reader show, or
  change, any file of the user.

  Not collective. why: the reason, "FILE: /mesh/x is a link ...", as a part of a message. True for a
  file that is missing or no HDF5, which its reader says; false for a pipe or device.
*/
PetscBool SbH5IsOwn(const char *path, size_t size, char why[]);

/* import_h5.c: what is in the fields.h5 of a run */

/* Its frames. Start with {.wanted = step}, negative: the last one. */
typedef struct {
  int64_t wanted, first, last; /* steps */
  PetscInt n;
  char found[64]; /* group of the wanted one, "": there is none */
  const char *hundred;
} SbH5Frames;
void SbH5FindFrame(hid_t file, SbH5Frames *frames);
/* Names of the bodies of a mesh, between commas, "" where it does not say. PetscFree. */
PetscErrorCode SbH5BodyNames(hid_t file, const char *mesh, char **names);

/* write.c: files of meshes */

typedef enum {
  SB_MESH_AUTO, /* by the name: .msh is text of version 4.1 */
  SB_MESH_MSH41,
  SB_MESH_MSH41_BINARY,
  SB_MESH_MSH22,
  SB_MESH_MSH22_BINARY,
  SB_MESH_H5
} SbMeshFormat;
/*
  SbMeshFileWrite - writes a mesh with all its groups: gmsh's .msh, or supple's .h5 with an .xmf
  beside it.

  The file is written beside its target and renamed when it is whole.
*/
PetscErrorCode SbMeshFileWrite(const SbImport *import, const char *path, SbMeshFormat format);

/*
  gmsh_library.c: the gmsh library at work in a process of its own: it makes tetrahedra. Rank 0
  only.

  SbGmshRun() forks; the child loads libgmsh and calls a function of type SbGmshWork with a fresh,
  empty model. What this puts into its SbImport comes back to the caller. It sees all memory of the
  caller as it was (its ctx may point anywhere), but what it changes there stays in the child. A
  PETSc error in the function is raised in the caller with the same code and text. A crash of gmsh,
  or one that does not end in time, is an error of the caller too; the memory of gmsh goes with the
  child. A scene that does not call SbGmshRun() never loads the library. For an example see
  src/surface/tet_gmsh.c.

  The functions are those of gmshc.h without the prefix `gmsh` (reference manual of gmsh, "Gmsh
  API"; one that is missing below is a line more), with the same arguments but the last, the error
  code, which SB_GMSH() adds and checks. Arrays of gmsh go back by gmsh->Free(). It prints nothing;
  with its one thread the same input gives the same mesh.
*/

/* type, name, arguments: as in gmshc.h from 4.8 to 4.15, alike (gmshModelAddPhysicalGroup() is
   not). */
#define SB_GMSH_FUNCTIONS(X)                                                                    \
  X(void, OptionSetNumber, (const char *, double, int *))                                       \
  X(void, ModelAdd, (const char *, int *))                                                      \
  X(void, ModelGetEntities, (int **, size_t *, int, int *))                                     \
  X(int, ModelAddDiscreteEntity, (int, int, int *, size_t, int *))                              \
  X(void, ModelMeshGenerate, (int, int *))                                                      \
  X(void, ModelMeshOptimize, (const char *, int, int, int *, size_t, int *))                    \
  X(int, ModelMeshFieldAdd, (const char *, int, int *))                                         \
  X(void, ModelMeshFieldSetString, (int, const char *, const char *, int *))                    \
  X(void, ModelMeshFieldSetAsBackgroundMesh, (int, int *))                                      \
  X(void, ModelMeshClassifySurfaces, (double, int, int, double, int, int *))                    \
  X(void, ModelMeshCreateGeometry, (int *, size_t, int *))                                      \
  X(void, ModelMeshAddNodes,                                                                    \
    (int, int, size_t *, size_t, double *, size_t, double *, size_t, int *))                    \
  X(void, ModelMeshAddElementsByType, (int, int, size_t *, size_t, size_t *, size_t, int *))    \
  X(void, ModelMeshGetNodes,                                                                    \
    (size_t **, size_t *, double **, size_t *, double **, size_t *, int, int, int, int, int *)) \
  X(void, ModelMeshGetElementsByType,                                                           \
    (int, size_t **, size_t *, size_t **, size_t *, int, size_t, size_t, int *))                \
  X(int, ModelGeoAddSurfaceLoop, (int *, size_t, int, int *))                                   \
  X(int, ModelGeoAddVolume, (int *, size_t, int, int *))                                        \
  X(void, ModelGeoSynchronize, (int *))                                                         \
  X(void, LoggerStart, (int *))                                                                 \
  X(void, LoggerGet, (char ***, size_t *, int *))

typedef struct {
  const char *where; /* begins every message */
  void (*Free)(void *);
#define SB_GMSH_MEMBER(type, name, arguments) type(*name) arguments;
  SB_GMSH_FUNCTIONS(SB_GMSH_MEMBER)
#undef SB_GMSH_MEMBER
} SbGmsh;

/* Calls a function of gmsh; its error becomes one of PETSc with its message. SB_GMSH0(): no
   arguments. */
#define SB_GMSH(gmsh, function, ...)                  \
  do {                                                \
    int sb_error = 0;                                 \
    (void)(gmsh)->function(__VA_ARGS__, &sb_error);   \
    if (sb_error)                                     \
      PetscCall(SbGmshError(gmsh, "gmsh" #function)); \
  } while (0)
#define SB_GMSH0(gmsh, function)                      \
  do {                                                \
    int sb_error = 0;                                 \
    (void)(gmsh)->function(&sb_error);                \
    if (sb_error)                                     \
      PetscCall(SbGmshError(gmsh, "gmsh" #function)); \
  } while (0)

typedef PetscErrorCode (*SbGmshWork)(const SbGmsh *gmsh, void *ctx, SbImport *result);

typedef struct {
  const char *where; /* begins every message, as SbImport.where */
  const char *doing; /* "read the file": for "gmsh crashed while it read the file" */
  PetscReal seconds; /* it is stopped after that time, s */
  SbGmshWork work;
  void *ctx;
} SbGmshJob;

/*
  SbGmshRun - runs job->work in a child process with the gmsh library, and brings back what it
  filled in.

  Not collective; for rank 0. Replaces vertices and items of `result`; groups do not come back.

  Errors: those of the work function; PETSC_ERR_USER_INPUT: no library; PETSC_ERR_FILE_UNEXPECTED:
  gmsh crashes or takes longer than job->seconds; PETSC_ERR_SYS: no child process.
*/
PetscErrorCode SbGmshRun(const SbGmshJob *job, SbImport *result);

/* The error of a function of gmsh that failed. */
PetscErrorCode SbGmshError(const SbGmsh *gmsh, const char *function);
