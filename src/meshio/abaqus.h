/*
  abaqus.h - shared by the files of the Abaqus reader: the state of the reader, lines and values.
*/
#pragma once
#include "meshio_impl.h"

enum {
  SB_ABAQUS_WORD = 128,
  SB_ABAQUS_PARAMETERS = 16,
  SB_ABAQUS_SCOPE = 40 /* a label is below 2^40; above stands the number of its instance */
};

/* Part or instance: labels and names of sets count within it. */
typedef struct {
  char name[SB_ABAQUS_WORD];
  const char *text; /* of a part: the lines after *PART */
} SbAbaqusPart;

/* A side of an element, or of all elements of a set, in a surface. */
typedef struct {
  PetscInt surface, set; /* index of the surface; set of elements, -1: a single element */
  int64_t element;
  int side; /* side 0 to 5; -1: the element itself, a triangle */
  const char *at;
} SbAbaqusSide;

typedef struct {
  SbDeck deck;
  SbScan *scan;
  SbCount nside, nsurface, npart, ninstance, npair;
  SbAbaqusSide *side;
  char (*surface)[SB_GROUP_MAX];
  SbAbaqusPart *part, *instance;
  PetscInt (*pair)[2]; /* set of nodes, and set of elements whose nodes are in it */
  PetscBool instances; /* the file has *INSTANCE: parts count only there */
  int64_t generated;   /* nodes and elements made by generators */

  /* the keyword line: its name and parameters */
  const char *line;
  char keyword[SB_ABAQUS_WORD];
  int nparameter;
  char parameter[SB_ABAQUS_PARAMETERS][2][SB_ABAQUS_WORD]; /* name, value */

  /* the part or instance that is read */
  int64_t scope;
  char prefix[SB_ABAQUS_WORD]; /* "instance.", begins the names of its sets */
  PetscReal R[3][3], t[3];     /* its place: x <- R x + t */
  PetscReal S[3][3], o[3];     /* *SYSTEM: x <- S x + o, before it is placed */
} SbAbaqus;

/* abaqus_lines.c */

/* Goes to the next line that is not a comment; false at the end of the file. */
PetscBool SbAbaqusNextLine(SbScan *scan);
/* Reads a keyword and its parameters, up to the end of its last line. */
void SbAbaqusKeyword(SbAbaqus *a);
/* The number that a word says, 0 and above. */
PetscErrorCode SbAbaqusParse(SbAbaqus *a, const char *word, const char *what, int64_t *value);
/* Finds or creates the set of this name, with what stands before it. */
PetscErrorCode SbAbaqusPrefixedSet(SbAbaqus *a, PetscBool of_nodes, const char *prefix,
                                   const char *name, PetscInt *set);
/* Goes to the next data line of the keyword; false at the next keyword and at the end of the
   file. */
PetscBool SbAbaqusDataLine(SbAbaqus *a);
/* Next comma-separated value on this line, trimmed; false if there is none. */
PetscBool SbAbaqusNext(SbAbaqus *a, char word[SB_ABAQUS_WORD]);
/* Value of a parameter of the keyword; NULL if absent, "" if it has none. */
const char *SbAbaqusParameter(const SbAbaqus *a, const char *name);
/* The next value, a label or another number of 0 and above; an absent one stays as it is. */
PetscErrorCode SbAbaqusNumber(SbAbaqus *a, const char *what, int64_t *value);
/* Up to n real numbers of this line; omitted ones are 0. */
PetscErrorCode SbAbaqusReals(SbAbaqus *a, const char *what, int n, PetscReal x[]);
/* Finds or creates the set of this name, of the current part or instance. */
PetscErrorCode SbAbaqusSet(SbAbaqus *a, PetscBool of_nodes, const char *name, PetscInt *set);

/* The file that a keyword line refers to: *INCLUDE, or the data of *NODE and *ELEMENT with INPUT,
   which follow it. A relative name counts from the folder of the first file. */
PetscErrorCode SbAbaqusIncluded(SbScan *scan, const char *line, SbIncludeFile *file);

/* abaqus_generate.c: *NGEN, *NFILL, *NCOPY, *ELGEN, *ELCOPY; known false: another keyword */
PetscErrorCode SbAbaqusGenerate(SbAbaqus *a, PetscBool *known);
