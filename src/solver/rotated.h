/*
  rotated.h - the real-time solver: rotations of cells, rows of an operator, interface nodes,
  exactly solved nodes.
*/
#pragma once
#include "sbassembly.h"
#include "sbsolver.h"
#include "factor.h"

/* The interface nodes, and W of their inverse Schur complement W^T W, distributed by rows
   (interface.c). */
typedef struct _p_SbInterface *SbInterface;
struct _p_SbInterface {
  SbSpace space;          /* borrowed */
  PetscInt n;             /* number of interface nodes, all ranks */
  PetscInt *index;        /* [nnode] number of a local node in the interface, -1 for others */
  PetscInt nmine;         /* number owned by this rank */
  PetscInt *mine;         /* [nmine] local nodes */
  PetscInt nblock, nrows; /* number of row blocks of W, of all ranks, of this one */
  struct _SbRows *rows;   /* [nrows] row blocks of this rank */
  size_t nword;           /* number of words in use: this rank reads them in a solve */
  int32_t *word;          /* words, with room for reads beyond the last panel */
  float *scale;           /* [3 n][2] scales of the rows; the second ones are unused */
  float *sum,
    *y; /* [3 n] sum of the right-hand sides; own part of the solution; room for one block more */
};

/* Finds the interface. Collective. */
PetscErrorCode SbInterfaceCreate(SbSpace space, SbInterface *face);
PetscErrorCode SbInterfaceDestroy(SbInterface *face);
/*
  SbInterfaceFactorise - factors the sum over ranks of their Schur complements.

  Collective. Input: work, bytes that this rank reads for its interior in each application, for load
  balance. In and out: schur[(3 n)^2], column-major, lower triangle: this rank's contribution;
  overwritten. Output: ok, PETSC_FALSE on all ranks if the sum is not positive definite.
*/
PetscErrorCode SbInterfaceFactorise(SbInterface face, PetscInt64 work, PetscReal schur[],
                                    PetscBool *ok);
/* x[3 n] <- inverse times the sum of x over ranks. Collective. */
PetscErrorCode SbInterfaceSolve(SbInterface face, float x[]);

/* Where the rotations of the cells around a node differ much (creases, inverted cells) no rotation
   of the node fits, and a few such nodes dominate the number of iterations. They are solved
   exactly: with B = A_BB^-1 on them the preconditioner is B + (1 - B A) P (1 - A B), symmetric and
   positive definite for any P that is. */
typedef struct {
  PetscInt n;        /* number of nodes */
  PetscInt *node;    /* [n] owned local nodes */
  PetscInt *index;   /* [nnode_owned] position in node, -1 for others */
  PetscInt *ia, *ja; /* pattern of their rows in the operator */
  float *value;      /* [ia[n]][9] blocks of these rows */
  float *x, *y;      /* [n][3] work vectors */
  SbFactor factor;   /* of the blocks between exact nodes */
} SbExactNodes;

PetscErrorCode SbExactNodesDestroy(SbExactNodes *e);
/* Chooses in e, {0} before, free nodes with a spread above `limit`, raised if they are too many;
   factors. */
PetscErrorCode SbExactNodesSetUp(SbExactNodes *e, SbSpace space, Mat A, const PetscReal spread[],
                                 PetscReal limit);
/* y = B r on the nodes, r -= A y, in place on r[nnode_owned][3]; to be called before P. */
void SbExactNodesBefore(SbExactNodes *e, float r[]);
/* z += B (r - A (z + y)) + y after z = P r; r is the residual before SbExactNodesBefore(). */
void SbExactNodesAfter(SbExactNodes *e, const float r[], float z[]);
