/*
  meshio_impl.h - what the files of src/meshio/ share: the readers, the writers, sets that a file lists apart, a child process.
*/
#pragma once
#include "sbgmsh.h"

/* Gives back what only reading needs: the text of the file, arrays of the reader. */
PetscErrorCode SbImportForget(SbImport *import);
/* Gives a name to the group (dim, tag), if there is one. */
PetscErrorCode SbImportNameGroup(SbImport *import, PetscInt dim, int64_t tag, const char *name);

/* scan.c: an integer as text or in binary of 4 or 8 bytes; `what` names what is expected there. */
PetscErrorCode SbScanInt4(SbScan *scan, const char *what, int64_t *value);
PetscErrorCode SbScanInt8(SbScan *scan, const char *what, int64_t *value);

/* A reader fills x, vert_number, items and groups from the file or description `text`. */
typedef PetscErrorCode (*SbReader)(const char *text, SbImport *body);
PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *body);
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
PetscErrorCode SbImportRead_H5(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Xdmf(const char *path, SbImport *body);
/* Block k of n of everything in an .h5 mesh of supple's own; its tets, without an error when there is no such mesh. */
PetscErrorCode SbImportSlab_H5(const char *path, PetscInt k, PetscInt n, SbImport *body, SbSlabRows *rows);
PetscErrorCode SbImportSlabs_H5(const char *path, PetscInt *ncell);

/* ------------------------------------------------------------------ elements by the types of gmsh */

typedef struct {
  const char *name; /* "4-node tetrahedra" */
  int dim, nnode;
} SbGmshType;
extern const SbGmshType SbGmshTypes[SB_GMSH_NTYPES];
/* Whether it is a simplex, of first or second order. */
static inline PetscBool SbGmshIsSimplex(int type)
{
  return (PetscBool)(SbGmshTypes[type].nnode == SbGmshTypes[type].dim + 1 || type == SB_GMSH_TET10 ||
                     type == SB_GMSH_TRIANGLE6 || type == SB_GMSH_LINE3);
}

/* Counts an element, and keeps it when it is of use: a tet, a simplex of groups, a triangle where a surface is wanted. Of second order the corners count;
   vert[10] of a 10-node tet, in the order of gmsh. */
PetscErrorCode SbImportAddElement(SbImport *import, int type, const PetscInt vert[], PetscInt tags,
                                  int64_t number);
/*
  SbImportCheckTypes - what was read must be a mesh of tets of 4 or 10 nodes and of nothing else in the volume (or triangles, for a surface).

  Not collective. Errors: PETSC_ERR_FILE_UNEXPECTED, which says what is there.
*/
PetscErrorCode SbImportCheckTypes(const SbImport *import);

/* Where gmsh has node k of a 10-node tet of Abaqus, Nastran and VTK: the last two are the other way round. */
static inline int SbGmshNode(int k)
{
  return k < 8 ? k : 17 - k;
}
/* Adds the nodes of the edges of a 10-node tet, vert[10] in the order of gmsh; -1: the edge has none. */
PetscErrorCode SbImportAddMiddles(SbImport *import, const PetscInt vert[]);

/* ------------------------------------------------------------------ deck.c: a file that names nodes and elements by labels */

typedef struct {
  int64_t label;
  PetscReal x[3];
  const char *at; /* in the file, for messages */
} SbDeckNode;
typedef struct {
  int64_t label, property, node[10]; /* property: number of its group; -1: none */
  int type;                          /* as gmsh numbers it */
  const char *at;
  PetscInt item; /* when put together: of the import; -1: it is no simplex */
} SbDeckElement;
/* Labels from first to last, or all those of another set. */
typedef struct {
  int64_t first, last, step;
  PetscInt set; /* -1: the labels */
  const char *at;
} SbDeckRange;
typedef struct {
  char name[SB_GROUP_MAX];
  PetscBool of_nodes; /* else of elements */
  SbCount nrange;
  SbDeckRange *range; /* [nrange] */
} SbDeckSet;
/* What was read so far; zeroed but for the first five. Arrays are the reader's, see SbImportScratch(). */
typedef struct {
  SbImport *im;
  int (*compare)(const char *, const char *); /* of names of sets: strcmp() or strcasecmp() */
  const char *cure;                           /* what to do about a label that is given twice */
  PetscBool unique;                           /* labels of elements, too, may be given once only */
  PetscBool strict;                           /* nodes of sets, and all those of tets, must be there */
  SbCount nnode, nelement, nset, nfound;
  SbDeckNode *node;       /* [nnode] */
  SbDeckElement *element; /* [nelement] */
  SbDeckSet *set;         /* [nset] */
  PetscInt *found;        /* [nfound] by SbDeckFind(): nodes or elements */
  PetscInt *stack;        /* [nset] sets to look into */
  PetscBool *seen;        /* [nset] */
  int64_t nlooked;        /* labels looked for */
} SbDeck;
#define SB_DECK_TAG ((int64_t)1 << 40) /* number of the group of set 0: no property has it */

/* A node at the last token; its coordinates, 0, are for the caller to fill. */
PetscErrorCode SbDeckAddNode(SbDeck *deck, int64_t label, PetscReal **x);
PetscErrorCode SbDeckAddElement(SbDeck *deck, const SbDeckElement *element);
/* The set of this name, made when new. */
PetscErrorCode SbDeckFindSet(SbDeck *deck, PetscBool of_nodes, const char *name, PetscInt *set);
PetscErrorCode SbDeckAddRange(SbDeck *deck, PetscInt set, int64_t first, int64_t last, int64_t step);
/* The members of `other` belong to the set, too. */
PetscErrorCode SbDeckAddSet(SbDeck *deck, PetscInt set, PetscInt other);
/* Vertices, items, and the sets as groups noted for SbImportJoinGroups(). What a set lists and the file does not define is left out. */
PetscErrorCode SbDeckBuild(SbDeck *deck);
/* The members of a set and of those that it names, each of these once, whatever circles they form; in deck->found. */
PetscErrorCode SbDeckFind(SbDeck *deck, PetscInt set);

/* ------------------------------------------------------------------ write_gmsh.c, write_h5.c: one file, written to `path` as it is */

PetscErrorCode SbWrite_Gmsh(const SbImport *import, const char *path, SbMeshFormat format);
PetscErrorCode SbWrite_H5(const SbImport *import, const char *path);
/* Closes a file; a write that failed since errno was 0 is an error. */
PetscErrorCode SbWriteEnd(FILE *file, const char *path);
/* The index for ParaView of a mesh that was written to `h5`. */
PetscErrorCode SbWrite_Xdmf(const SbImport *import, const char *path, const char *h5);

/* gmsh_library.c: what SbGmshRun() does in the child. */
PetscErrorCode SbGmshCall(const SbGmshJob *job, SbImport *result);

/* Opens a regular file and tells its size; else says what is wrong with the name. */
PetscErrorCode SbScanOpenFile(const char *where, const char *path, FILE **file, size_t *size);
/* Moves to the beginning of a text; false when it does not come. */
PetscBool SbScanFind(SbScan *scan, const char *text);

PetscErrorCode SbScanQuoted(SbScan *scan, const char *what, size_t size, char value[]); /* "in quotes" */
/* A name, up to the end of the line, without blanks around it; "" when there is none. */
PetscErrorCode SbScanRestOfLine(SbScan *scan, size_t size, char name[]);
