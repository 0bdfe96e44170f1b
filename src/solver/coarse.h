/*
  coarse.h - aggregates of nodes, their rigid-body modes, and the coarse operator of pc_coarse.c.
*/
#pragma once
#include "sbassembly.h"

/*
  SbAggregate - partitions the free nodes of this rank into connected, round aggregates of about equal size.

  Not collective. Input: space with its plan; wanted, approximate number of aggregates. Output: n, their number; agg[nnode_owned], the
  aggregate of each node, -1 for fully prescribed nodes. An aggregate has nodes of one body only.
*/
PetscErrorCode SbAggregate(SbSpace space, PetscInt wanted, PetscInt *n, PetscInt agg[]);

/*
  The coarse space: columns Z of six modes per aggregate, u(x) = t + w x d with d the position relative to the aggregate's centre
  over its radius; zero on prescribed unknowns. E = Z^T A Z is distributed by rows; one rank factors it,
  or a multigrid cycle approximates E^-1.
*/
typedef struct _p_SbCoarse *SbCoarse;
struct _p_SbCoarse {
  SbSpace space;
  PetscInt n, first, N;   /* number of own aggregates, of the first one, of all */
  PetscInt *agg;          /* [nnode] global number of the aggregate, -1 for fully prescribed nodes */
  PetscReal *d;           /* [nnode][3] position relative to the aggregate's centre, over its radius */
  PetscReal *centre;      /* [n][4] centre, m, and radius, m; 0 for a single node */
  PetscBool spread;       /* multigrid approximates E^-1, else one rank factors E */
  PetscReal *null;        /* [n][36] projector onto the modes that vanish (single nodes, nodes on a line) */
  PetscInt *member_start; /* [n+1] offsets into member */
  PetscInt *member;       /* own nodes by aggregate */
  PetscInt *start,
    *column; /* [n+1] offsets; block columns of own rows: the aggregate itself, then the others ascending */
  PetscReal *value; /* [start[n]][36] blocks, row-major, N/m */
  Mat E;            /* coarse matrix, rows of own aggregates */
  PC solver;        /* factorisation of E, or multigrid */
  Vec c, y;
  PetscBool ok;
};

/* Collective. wanted: approximate number of aggregates, all ranks; spread: E is not gathered. Options read: -pc_coarse_ (multigrid). */
PetscErrorCode SbCoarseCreate(SbSpace space, PetscInt wanted, PetscBool spread, SbCoarse *coarse);
PetscErrorCode SbCoarseDestroy(SbCoarse *coarse);
/* Computes E = Z^T A Z for a BAIJ or SBAIJ matrix of the space, and sets up its solver. coarse->ok is false if E was found not to be positive
   definite: with a factorisation always, with multigrid perhaps not. Collective. */
PetscErrorCode SbCoarseSetUp(SbCoarse coarse, Mat A);
/* c = Z^T r; share: a weighted norm of c over |r|, about 1 for r in the span of Z; 1 when spread. Collective. */
PetscErrorCode SbCoarseRestrict(SbCoarse coarse, Vec r, PetscReal *share);
/* z += Z E^-1 c, E = Z^T A Z, with the c of the last SbCoarseRestrict(). Collective. */
PetscErrorCode SbCoarseAdd(SbCoarse coarse, Vec z);
/* Creates E without values, and its solver, once (coarse_solver.c). Collective. */
PetscErrorCode SbCoarseCreateSolver(SbCoarse coarse);
/* Copies the blocks of coarse->value into E, and sets up the solver. Collective. */
PetscErrorCode SbCoarseSetUpSolver(SbCoarse coarse);

/* c += Z_i^T f for one node: force and torque. */
SB_INLINE void SbCoarseAddMoments(const PetscReal d[3], const PetscReal f[3], PetscReal m[6])
{
  for (int c = 0; c < 3; c++) m[c] += f[c];
  m[3] += d[1] * f[2] - d[2] * f[1];
  m[4] += d[2] * f[0] - d[0] * f[2];
  m[5] += d[0] * f[1] - d[1] * f[0];
}

SB_INLINE void SbCoarseMotion(const PetscReal d[3], const PetscReal m[6], PetscReal u[3])
{
  u[0] = m[0] + m[4] * d[2] - m[5] * d[1];
  u[1] = m[1] + m[5] * d[0] - m[3] * d[2];
  u[2] = m[2] + m[3] * d[1] - m[4] * d[0];
}
