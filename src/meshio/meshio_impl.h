/*
  meshio_impl.h - shared by src/meshio/: readers, writers, decks of labelled nodes and elements,
  gmsh as a child.
*/
#pragma once
#include "sbmeshio.h"

/* The arrays of a body: vertices and simplices, then nodes of edges and groups. */
enum {
  SB_IMPORT_NMESH = 14,
  SB_IMPORT_NPART = 20
};
typedef struct {
  void **array;
  size_t bytes;
} SbImportPart;
void SbImportParts(SbImport *import, SbImportPart part[SB_IMPORT_NPART]);
/* Frees what only the reader needs: the text of the file and scratch arrays. */
PetscErrorCode SbImportForget(SbImport *import);
PetscErrorCode SbNumbersDestroy(SbNumbers *numbers);
/* Whether an array with this many numbers per cell is the one that is asked for. */
static inline PetscBool SbImportWants(const SbImport *import, const char *name, int64_t width)
{
  return (PetscBool)(import->field[0] && width == import->field_width &&
                     !strcmp(import->field, name));
}
/* Keeps it: row i is of the cell number[i] of the file, or first + i where number is NULL. */
PetscErrorCode SbImportKeep(SbImport *import, PetscInt n, const int64_t number[], int64_t first,
                            const double value[]);
/* The tag set that holds this group alone. */
PetscErrorCode SbImportTagsAlone(SbImport *import, PetscInt dim, int64_t tag, const char *name,
                                 PetscInt *tags);
/* Notes that an item belongs to a group; SbImportJoinGroups() adds to each item the groups noted
   for it. */
PetscErrorCode SbImportAddMember(SbImport *import, PetscInt dim, PetscInt item, PetscInt group);
PetscErrorCode SbImportJoinGroups(SbImport *import);
/* Names the group (dim, tag), if it exists. */
void SbImportNameGroup(SbImport *import, PetscInt dim, int64_t tag, const char *name);

/* scan.c: reads an integer, as text or binary of 4 or 8 bytes; `what` describes it in error
   messages. */
PetscErrorCode SbScanInt(SbScan *scan, int bytes, const char *what, int64_t *value);

/* Reads a file, or a mesh description `text`: sets x, vert_number, items and groups. */
typedef PetscErrorCode (*SbReader)(const char *text, SbImport *body);
PetscErrorCode SbImportRead_Nastran(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Netgen(const char *path, SbImport *body); /* .vol */
PetscErrorCode SbImportRead_NetgenNeutral(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Medit(const char *path,
                                  SbImport *body); /* or the neutral format of Netgen */
PetscErrorCode SbImportRead_VTK(const char *path, SbImport *body);
PetscErrorCode SbImportRead_VTU(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Abaqus(const char *path, SbImport *body);
PetscErrorCode SbImportRead_UNV(const char *path, SbImport *body);
PetscErrorCode SbImportRead_FEBio(const char *path, SbImport *body);
PetscErrorCode SbImportRead_MED(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Exodus(const char *path, SbImport *body);
PetscErrorCode SbImportRead_CGNS(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Box(const char *text, SbImport *body);
PetscErrorCode SbImportRead_H5(const char *path, SbImport *body);
PetscErrorCode SbImportRead_Xdmf(const char *path, SbImport *body);
/* Reads block k of n of all arrays of an .h5 mesh. */
PetscErrorCode SbImportSlab_H5(const char *path, PetscInt k, PetscInt n, SbImport *body,
                               SbSlabRows *rows);

/* gmsh's element types */
typedef struct {
  const char *name; /* "4-node tetrahedra" */
  int dim, nnode;
} SbGmshType;
extern const SbGmshType SbGmshTypes[SB_GMSH_NTYPES];
extern const char
  *const SbGroupKinds[4]; /* "point", "curve", ...; a group without name is "curve_12" */
/* Whether the element is a simplex of first or second order. */
static inline PetscBool SbGmshIsSimplex(int type)
{
  return (PetscBool)(SbGmshTypes[type].nnode == SbGmshTypes[type].dim + 1 ||
                     type == SB_GMSH_TET10 || type == SB_GMSH_TRIANGLE6 || type == SB_GMSH_LINE3);
}

/* Counts an element, and adds it if needed: a tet, a simplex in a group, a triangle of a surface.
   Of second-order ones the corners are kept, of a 10-node tet, vert[10] in gmsh's order, also edge
   nodes. */
PetscErrorCode SbImportAddElement(SbImport *import, int type, const PetscInt vert[], PetscInt tags,
                                  int64_t number);
/*
  SbImportCheckTypes - all volume elements must be tets of 4 or 10 nodes; there must be tets
  (surface: or triangles).

  Not collective. Errors: PETSC_ERR_FILE_UNEXPECTED, whose message lists the elements.
*/
PetscErrorCode SbImportCheckTypes(const SbImport *import);

/* Position in gmsh's order of node k of a 10-node tet of Abaqus, Nastran, VTK: the last two change
   places. */
static inline int SbGmshNode(int k)
{
  return k < 8 ? k : 17 - k;
}
/* Adds the edge nodes of a 10-node tet, vert[10] in gmsh's order; -1: the edge has none. */
PetscErrorCode SbImportAddMiddles(SbImport *import, const PetscInt vert[]);

/* deck.c: nodes and elements by labels */
typedef struct {
  int64_t label, property, node[10]; /* property: number of its group, -1: none */
  int type;                          /* gmsh's element type */
  const char *at;                    /* position in the file, for messages */
  PetscInt item; /* index of its item in the import, after conversion; -1: not a simplex */
} SbDeckElement;
/* Range of labels first, first + step, ... last, or all members of another set. */
typedef struct {
  int64_t first, last, step;
  PetscInt set; /* the other set; -1: a range of labels */
  const char *at;
} SbDeckRange;
typedef struct {
  char name[SB_GROUP_MAX];
  PetscBool of_nodes; /* a set of nodes, else of elements */
  SbCount nrange;
  SbDeckRange *range; /* [nrange] */
} SbDeckSet;
/* A file of labelled nodes and elements; zero but for the first five members. Arrays:
   SbImportScratch(). */
typedef struct {
  SbImport *im;
  int (*compare)(const char *,
                 const char *); /* comparison of set names: strcmp() or strcasecmp() */
  const char *cure;             /* advice in the message about a duplicate label */
  PetscBool unique;             /* duplicate element labels are an error too */
  PetscBool strict;             /* undefined nodes of sets and tets are an error */
  int64_t mask;   /* bits of a label that the file gives, 0: all; above is what it counts in */
  int64_t nscope; /* parts of the file in which labels count */
  SbCount nelement, nset, nfound;
  PetscInt capacity[2];   /* of im->x, im->vert_number */
  SbDeckElement *element; /* [nelement] */
  SbDeckSet *set;         /* [nset] */
  PetscInt *found;        /* [nfound] result of SbDeckFind(): indices of nodes or elements */
  PetscInt *stack;        /* [nset] sets to be visited */
  PetscBool *seen;        /* [nset] visited sets */
  int64_t nlooked;        /* number of labels searched for */
} SbDeck;
#define SB_DECK_TAG \
  ((int64_t)1 << 40) /* number of the group of set 0, larger than any property number */

/* A label as the file gives it, for messages. */
static inline long long SbDeckShown(const SbDeck *deck, int64_t label)
{
  return (long long)(deck->mask ? label & deck->mask : label);
}
/* Adds a node to `im`; the caller sets its coordinates, which are 0. */
PetscErrorCode SbDeckAddNode(SbDeck *deck, int64_t label, PetscReal **x);
PetscErrorCode SbDeckAddElement(SbDeck *deck, const SbDeckElement *element);
/* Finds or creates the set of this name. */
PetscErrorCode SbDeckFindSet(SbDeck *deck, PetscBool of_nodes, const char *name, PetscInt *set);
/* Adds to a set the labels first, first + step, ... last, or the members of the set `other`; -1:
   none. */
PetscErrorCode SbDeckAddRange(SbDeck *deck, PetscInt set, PetscInt other, int64_t first,
                              int64_t last, int64_t step);
/* Converts the deck to items, and groups for SbImportJoinGroups(). Undefined members: `strict`. */
PetscErrorCode SbDeckBuild(SbDeck *deck);
/* Finds the members of a set and of the sets in it, recursively, each once; result in
   deck->found. */
PetscErrorCode SbDeckFind(SbDeck *deck, PetscInt set);

/* vtk_grid.c: cells and cell arrays of a VTK file */
#define SB_VTK_ARRAYS 16    /* largest number of cell arrays that are examined */
#define SB_VTK_REGIONS 1000 /* an array with more distinct values is not a region number */

/* Cells of a grid. All numbers as double, exact for node indices. Arrays: SbImportScratch(). */
typedef struct {
  PetscInt ncell;
  int64_t nconnect;
  double *connect; /* [nconnect] points of the cells, from 0 */
  double *end;     /* [ncell] end of each cell in `connect` */
  double *type;    /* [ncell] VTK's cell type */
  double *ghost;   /* [ncell] not 0: a copy of a cell of another piece, or hidden; or NULL */
  int narray;
  struct {
    char name[SB_NAME_MAX];
    double *value; /* [ncell] */
  } array[SB_VTK_ARRAYS];
} SbVtkGrid;

/* Whether the array of this name marks ghost cells. */
static inline PetscBool SbVtkIsGhost(const char *name)
{
  return (PetscBool)(!strcmp(name, "vtkGhostType") || !strcmp(name, "vtkGhostLevels"));
}
/* Makes such an array 1 for cells that are copies, refined elsewhere, or hidden, else 0. */
void SbVtkGhostMarks(const char *name, PetscInt n, double mark[]);
/*
  SbVtkGridFill - adds the cells of a grid to a body that has its vertices; arrays of integers
  become groups.

  The array of region numbers (CellEntityIds, gmsh:physical, medit:ref, ...; or the only array)
  gives the groups volume_N, surface_N, ...; another one NAME_volume_N, ... Ghost cells are left
  out, and counted in the note. Errors of a cell name import->scan.token.
*/
PetscErrorCode SbVtkGridFill(SbVtkGrid *grid, SbImport *im);
/* Sets the vertices of the body from coordinates x[n][3]; an error names the index of an invalid
   one. */
PetscErrorCode SbVtkSetPoints(PetscInt n, const double x[], SbImport *im);

/* include.c: files that are a part of another one. What a line says of that: */
typedef struct {
  char name[PETSC_MAX_PATH_LEN]; /* of the file; "": it names none */
  PetscBool whole;               /* the text of the file replaces the line, else follows it */
  PetscBool stop;                /* the lines after this one name no files */
  const char *end;               /* behind the line, or the lines that a name needs */
} SbIncludeFile;
typedef PetscErrorCode (*SbIncludeLine)(SbScan *scan, const char *line, SbIncludeFile *file);
/*
  SbImportExpand - puts the files that the one in import->scan refers to into its text.

  Not collective; rank 0. Input: path of that file; nested, whether a relative name counts from the
  folder of the file that has it, and then of the first one, else always of the first one; line,
  which gets every line. Errors: files within themselves, too many, or that cannot be opened.
*/
PetscErrorCode SbImportExpand(SbImport *import, const char *path, PetscBool nested,
                              SbIncludeLine line);
/* Path of a file that another one in `folder` ("" or with a slash at its end) names; scratch. */
PetscErrorCode SbImportBeside(SbImport *import, const char *folder, const char *name, char **path);
/* Folder of a file, "" or with a slash at its end; scratch. */
PetscErrorCode SbImportFolder(SbImport *import, const char *path, char **folder);

/* write_gmsh.c, write_h5.c: one file */
extern const char
  *const SbH5Items[4]; /* "point", "line", ..., as in /mesh/points and /mesh/point_tags */
PetscErrorCode SbWrite_Gmsh(const SbImport *import, SbMeshFormat format, FILE *file);
PetscErrorCode SbWrite_H5(const SbImport *import, const char *path);
/* The .xmf for ParaView of a mesh that was written to `h5`. */
void SbWrite_Xdmf(const SbImport *import, const char *h5, FILE *file);

/* xml.c: the tags of a file, one after the other */
enum {
  SB_XML_DEPTH = 32
}; /* most elements in each other */
typedef struct {
  SbScan *scan;
  PetscBool opens;             /* a tag that opens an element, else one that ends it */
  PetscBool empty;             /* <name/>: its end comes next */
  char name[SB_NAME_MAX];      /* of the element */
  const char *begin, *end;     /* the tag, from its < to its > */
  const char *text, *text_end; /* between the tag before and this one, behind comments */
  int depth;                   /* open elements, this one too */
  char open[SB_XML_DEPTH][SB_NAME_MAX];
} SbXml;
/* The next tag; false at the end of the file. Errors: tags that do not nest, or have no end. */
PetscErrorCode SbXmlNext(SbXml *xml, PetscBool *more);
/* Behind a tag that opens: to the end of its element. */
PetscErrorCode SbXmlSkip(SbXml *xml);
/* Value of an attribute of the tag; false and "" if there is none. */
PetscBool SbXmlAttribute(const SbXml *xml, const char *name, size_t size, char value[]);

/* own_h5.c: SbH5IsOwn() of an open file. */
PetscBool SbH5FileIsOwn(hid_t file, const char *path, size_t size, char why[]);

/* child.c: work in a forked process; its result replaces the first `npart` of SbImportParts(), with
   all of them also groups and note. Not collective; rank 0. */
typedef struct {
  const char *where, *who, *doing; /* "FILE", "gmsh", "made tetrahedra": of messages */
  PetscReal seconds;               /* it is stopped after that time, s */
  int npart;
  PetscErrorCode (*work)(void *ctx, SbImport *result);
  void *ctx;
} SbChildJob;
PetscErrorCode SbChildRun(const SbChildJob *job, SbImport *result);

/* gmsh_library.c: the work of SbGmshRun() in the child process. */
PetscErrorCode SbGmshCall(const SbGmshJob *job, SbImport *result);

/* Opens a regular file and returns its size; an error describes the problem. */
PetscErrorCode SbScanOpenFile(const char *where, const char *path, FILE **file, size_t *size);
/* Replaces each byte of a name that belongs to no printable letter of UTF-8. */
void SbCleanName(char name[], char instead);
/* Moves to the beginning of a text; false if it does not occur. */
PetscBool SbScanFind(SbScan *scan, const char *text);

PetscErrorCode SbScanQuoted(SbScan *scan, const char *what, size_t size,
                            char value[]); /* value in quotes */
/* Reads the rest of the line as a name, trimmed; "" if empty. */
PetscErrorCode SbScanRestOfLine(SbScan *scan, size_t size, char name[]);

/* Adds to the note of an import; writes what SbImportSkip() counted into it. */
void SbImportRemark(SbImport *import, const char *format, ...) PETSC_ATTRIBUTE_FORMAT(2, 3);
void SbImportNoteSkipped(SbImport *import);
