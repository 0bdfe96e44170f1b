/*
  rotated.h - what the files of the real-time solver share: rotations of cells, rows of an operator, the exactly solved nodes.
*/
#pragma once
#include "sbassembly.h"
#include "sbsolver.h"
#include "factor.h"

/* ------------------------------------------------------------------ nodes between the parts of several ranks */

/*
  SbInterfaceChooseNodes - few nodes, without which the parts of the ranks are not coupled.

  Collective; the space has a plan. Fully prescribed nodes are left out. Output: index[nnode] number among them of a local node, -1 for
  others; those of a rank are consecutive. nmine: owned by this rank; n: of all ranks.
*/
PetscErrorCode SbInterfaceChooseNodes(SbSpace space, PetscInt index[], PetscInt *nmine, PetscInt *n);

/* These nodes, and the factored inverse of their Schur complement, of which each rank has some rows (interface.c). */
typedef struct _p_SbInterface *SbInterface;
typedef struct _p_SbInterfaceFactor *SbInterfaceFactor;
struct _p_SbInterface {
  MPI_Comm comm;
  PetscInt n;               /* nodes of all ranks */
  PetscInt *index;          /* [nnode] number among them of a local node, -1 for others */
  PetscInt nmine;           /* owned by this rank */
  PetscInt *mine;           /* [nmine] local nodes */
  SbInterfaceFactor factor; /* owned */
};

/* Finds the interface. Collective. */
PetscErrorCode SbInterfaceCreate(SbSpace space, SbInterface *face);
PetscErrorCode SbInterfaceDestroy(SbInterface *face);
/*
  SbInterfaceFactorise - factors the sum over ranks of their contributions.

  Collective. Input: work, bytes that this rank reads for its interior in each application, which is evened out. In and out:
  schur[(3 n)^2], column-major, lower triangle: this rank's contribution; destroyed. Output: ok, PETSC_FALSE on all ranks when the
  sum is not positive definite.
*/
PetscErrorCode SbInterfaceFactorise(SbInterface face, PetscInt64 work, PetscReal schur[], PetscBool *ok);
/* x[3 n] <- inverse times the sum of x over ranks. Collective. */
PetscErrorCode SbInterfaceSolve(SbInterface face, float x[]);
/* Bytes of the factored inverse that this rank reads in a solve. Not collective. */
PetscInt64 SbInterfaceBytes(SbInterface face);

/* ------------------------------------------------------------------ nodes solved exactly */

/*
  Where cells around a node are turned very differently (creases, inverted cells) no rotation of the node is right, and a few
  such nodes spoil the whole iteration. They are solved exactly: with B = A_BB^-1 on them the preconditioner is
  B + (1 - B A) P (1 - A B), symmetric and positive definite for any P that is.
*/
typedef struct {
  PetscInt n;         /* how many */
  PetscInt *node;     /* [n] owned local nodes */
  PetscInt *index;    /* [nnode_owned] position in node, -1 for others */
  PetscInt *ia, *ja;  /* rows of the operator */
  PetscReal *block;   /* [ia[n]][9] */
  float *value;       /* [ia[n]][9] the same */
  PetscInt *ka, *kja; /* graph among the nodes themselves */
  PetscReal *kblock;
  float *x, *y; /* [n][3] */
  SbFactor factor;
} SbExactNodes;

PetscErrorCode SbExactNodesCreate(SbSpace space, SbExactNodes *e);
PetscErrorCode SbExactNodesDestroy(SbExactNodes *e);
/* Chooses the free nodes whose spread exceeds `limit` (raised while they are too many) and whose row is local, and factors. */
PetscErrorCode SbExactNodesSetUp(SbExactNodes *e, SbSpace space, Mat A, const PetscReal spread[],
                                 PetscReal limit);
/* y = B r on the nodes, r -= A B r, in place on r[nnode_owned][3]; to be called before P. */
void SbExactNodesBefore(SbExactNodes *e, float r[]);
/* z += B (r - A (z + y)) + y after z = P r; r is the residual from before. */
void SbExactNodesAfter(SbExactNodes *e, const float r[], float z[]);
