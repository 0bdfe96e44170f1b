/*
  index.h - the contents of the frames of fields.h5, for the index files of viewers.
*/
#pragma once
#include "output_impl.h"

/* A piece of an array: rows of one dataset of fields.h5, in one frame or one mesh. */
typedef struct {
  PetscInt block; /* number of the frame; of the part for what does not change with time */
  int bytes;      /* per number */
  char path[96];  /* of the dataset */
} SbPiece;

typedef struct {
  char name[SB_NAME_MAX + 8];
  int ncomp, bytes;                /* most bytes of its pieces */
  PetscBool whole, cell, constant; /* whole numbers; per cell; one piece per part, else per frame */
  PetscInt npiece, size;
  SbPiece *piece; /* [npiece], blocks ascending */
} SbArray;

/* A mesh, or the contact points of one frame. */
typedef struct {
  PetscInt npoint, ncell;
  char group[64];
} SbPart;

struct _p_SbIndex {
  char xmf[PETSC_MAX_PATH_LEN], vtkhdf[PETSC_MAX_PATH_LEN]; /* the two files */
  PetscBool points;                                         /* contact points, else tets */
  PetscInt corners;                                         /* of a tet: 4, or 10 nodes of a quadratic one */
  PetscReal nowhere[3]; /* where a frame without contact points shows one without force, m */
  PetscInt npart, part_size, nframe, frame_size, narray, array_size;
  SbPart *part;
  struct {
    PetscReal time; /* s */
    PetscInt part;
  } * frame;
  SbArray *array;
  FILE *file; /* xdmf.c: head and grids so far, in memory: text[size] once it is flushed */
  char *text;
  size_t size;
  PetscInt nwritten; /* vtkhdf.c: frames that the file on disk has */
  double next;       /* when it is made again, in s of MPI_Wtime() */
};

/* xdmf.c: adds the last frame to the text, replaces the file by it. */
void SbXdmfAdd(SbIndex index);
void SbXdmfWrite(SbIndex index, char message[SB_MESSAGE_MAX]);
/* vtkhdf.c: replaces the file when enough frames have come since, or these are the last ones. */
void SbVtkhdfWrite(SbIndex index, PetscBool last, char message[SB_MESSAGE_MAX]);
