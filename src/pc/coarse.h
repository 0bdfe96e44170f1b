/*
  coarse.h - coarse spaces: aggregates of nodes, single nodes, vertices of P2; their operator and
  its solver. Used by two_level.c.
*/
#pragma once
#include "sbpc.h"

/*
  SbAggregate - partitions the free nodes of this rank into connected, round aggregates of about
  equal size.

  Not collective. Input: space with its plan; wanted, approximate number of aggregates. Output: n,
  their number; agg[nnode_owned], the aggregate of each node, -1 for fully prescribed nodes. An
  aggregate has nodes of one body only.
*/
PetscErrorCode SbAggregate(SbSpace space, PetscInt wanted, PetscInt *n, PetscInt agg[]);

/* Motion of a node by the coarse space: with its aggregate, t + w x d, zero on prescribed unknowns;
   by unknowns of its own; of P2's edge nodes by the mean of two vertices. */
typedef enum {
  SB_MEMBER,
  SB_ITSELF,
  SB_MEAN
} SbWay;

/* The coarse space, columns Z, and E = Z^T A Z, which consists of 3x3 blocks: one block row for a
   node that moves by itself, two for an aggregate, translation t and rotation w. They are
   distributed over the ranks as the nodes are. */
typedef struct _p_SbCoarse *SbCoarse;
struct _p_SbCoarse {
  SbSpace space;
  PetscBool aggregated; /* nodes are aggregated; else all are themselves or means */
  PetscInt nagg,
    *agg; /* number of own aggregates; [nnode_owned] that of each node, -1: fully prescribed */
  PetscInt
    *parent; /* [nnode][2] vertices of an edge node of P2, else the node twice; NULL: not in use */
  /* of own nodes, then those of other ranks in the rows of A, ascending: */
  PetscInt nall;
  uint8_t *way; /* [nall] SbWay */
  uint8_t *
    moved; /* [nall] SB_MEAN: bits of the components that move by the first, by the second vertex */
  PetscInt *unit; /* [nall][2] block rows of E by which the node moves, own ones first, -1: none */
  PetscReal *d;   /* [nall][3] position relative to the aggregate's centre, over its radius */
  PetscReal *centre; /* [nagg][4] centre, m, and radius, m, 0 for a single node */
  PetscReal
    *null; /* [nagg][36] projector onto the modes that vanish (single nodes, nodes on a line) */
  PetscInt *row_of; /* [nagg] its first own block row, -1: it has no nodes */
  PetscInt n, first,
    N; /* number of own block rows, number of the first one, of those of all ranks */
  PetscInt nother,
    *other; /* [nother] numbers of block rows of other ranks, ascending: units n, n + 1, ... */
  PetscReal *weight; /* [n] 1 / number of nodes of the row's aggregate */
  PetscInt *ia, *ja; /* pattern of the own rows: [n+1]; [ia[n]] numbers of columns, ascending */
  PetscInt widest;   /* largest number of units in a row of A Z */
  PetscReal *value;  /* [ia[n]][9] blocks, row-major, N/m */
  PetscBool changed; /* the pattern is new to the solver */
  PetscBool ok;
  /* the solver: SbBlockSolver; or a factorisation, or multigrid, of E */
  SbBlockSolver direct;
  PetscBool spread; /* multigrid approximates E^-1 */
  Mat E;
  PC solver;
  PetscBool ready; /* the latter has been set up */
  Vec c, y;        /* restricted residual, correction */
  PetscBool wide;  /* nodes move by units of other ranks, too: c and y have ghosts */
  Vec s, t, w;     /* work vectors of the nodes */
};

/* Collective. wanted: number of aggregates on this rank, negative: no node is aggregated; vertices:
   edge nodes of P2 move by the mean of their vertices, in the presence of aggregates only if both
   are this rank's. */
PetscErrorCode SbCoarseCreate(SbSpace space, PetscInt wanted, PetscBool vertices, SbCoarse *coarse);
PetscErrorCode SbCoarseDestroy(SbCoarse *coarse);

/* Finds the units and the pattern of E. A: BAIJ or SBAIJ; rows: its pattern, and nodes in contact,
   which move by themselves; NULL: that of the space, and none. Collective. */
PetscErrorCode SbCoarseSetPattern(SbCoarse coarse, Mat A, const SbContactRows *rows);

/* A solver with the options -pc_coarse_: a factorisation, or multigrid; after the pattern.
   Collective. */
PetscErrorCode SbCoarseCreateSolver(SbCoarse coarse, PetscBool factored);

/* Computes E = Z^T A Z, and sets up its solver. coarse->ok is false if E was found not to be
   positive definite: with a factorisation always, with multigrid perhaps not. Collective. */
PetscErrorCode SbCoarseSetUp(SbCoarse coarse, Mat A);

/* The second half of SbCoarseSetUp(), after coarse->value. Collective. */
PetscErrorCode SbCoarseSetUpSolver(SbCoarse coarse);

/* c = Z^T r; share: a weighted norm of c over |r|, about 1 for r in the span of Z, or NULL.
   Collective. */
PetscErrorCode SbCoarseRestrict(SbCoarse coarse, Vec r, PetscReal *share);

/* z += Z E^-1 c with the c of the last SbCoarseRestrict(). Collective. */
PetscErrorCode SbCoarseAdd(SbCoarse coarse, Vec z);

/* x += Z E^-1 Z^T (b - A x). Collective. */
PetscErrorCode SbCoarseCorrect(SbCoarse coarse, Mat A, Vec b, Vec x);

/* Makes pc algebraic multigrid that needs few messages. threshold of strong couplings: 0, zero
   couplings, of which P1 on boxes has many, are ignored; -1, all are kept. Not collective. */
PetscErrorCode SbPCMultigridSet(PC pc, PetscReal threshold);
