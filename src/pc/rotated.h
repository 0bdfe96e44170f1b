/*
  rotated.h - the real-time solver: rotations of cells, rows of an operator, interface nodes,
  exactly solved nodes.
*/
#pragma once
#include "sbpc.h"

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
