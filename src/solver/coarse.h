/*
  coarse.h - aggregates of nodes, their rigid-body modes, and the operator on them: what pc_coarse.c corrects with.
*/
#pragma once
#include "sbassembly.h"

/*
  SbAggregate - parts the free nodes of this rank into connected, round aggregates of about equal size.

  Not collective. Input: space with its plan; wanted, about how many. Output: n, how many; agg[nnode_owned], number of
  each node's aggregate, -1 for fully prescribed nodes. Parts that do not touch (bodies) share no aggregate.
*/
PetscErrorCode SbAggregate(SbSpace space, PetscInt wanted, PetscInt *n, PetscInt agg[]);

/*
  The coarse space: columns Z of six modes per aggregate, u(x) = t + w x d with d the position relative to the aggregate's centre
  in units of its radius; zero on prescribed unknowns. The rows of E = Z^T A Z stay with their ranks; one rank factors it,
  or a cycle of multigrid stands for E^-1.
*/
typedef struct _p_SbCoarse *SbCoarse;
struct _p_SbCoarse {
  SbSpace space;
  PetscInt n, first, N;     /* aggregates of this rank, number of its first one, all of them */
  PetscInt *agg;            /* [nnode] aggregate by global number, -1 for fully prescribed nodes */
  PetscReal *d;             /* [nnode][3] */
  PetscReal *centre;        /* [n][4] position, m, and radius, m; 0 for a single node */
  PetscBool spread;         /* multigrid approximates E^-1, else one rank factors E */
  PetscReal *null;          /* [n][36] projector onto the modes that vanish (single nodes, nodes on a line) */
  PetscInt *member_start;   /* [n+1] */
  PetscInt *member;         /* own nodes by aggregate */
  PetscInt *start, *column; /* [n+1] blocks of own rows: the aggregate itself, then all others ascending */
  PetscReal *value;         /* [start[n]][36], row-major, N/m */
  Mat E;                    /* rows of own aggregates */
  PC solver;                /* its factorisation, or multigrid */
  Vec c, y;
  PetscBool ok;
};

/* Collective. wanted: aggregates of all ranks, about; spread: E is not to be gathered. Options read: -pc_coarse_ (multigrid). */
PetscErrorCode SbCoarseCreate(SbSpace space, PetscInt wanted, PetscBool spread, SbCoarse *coarse);
PetscErrorCode SbCoarseDestroy(SbCoarse *coarse);
/* E = Z^T A Z for a BAIJ or SBAIJ matrix of the space, and its factor or cycle. coarse->ok: nothing shows that E is not positive
   definite, which a factor finds out for certain. Collective. */
PetscErrorCode SbCoarseSetUp(SbCoarse coarse, Mat A);
/* c = Z^T r; share: |c|, weighted so that it is about |r| when r is in the span of Z, over |r|; 1 when spread. Collective. */
PetscErrorCode SbCoarseRestrict(SbCoarse coarse, Vec r, PetscReal *share);
/* z += Z E^-1 c, E = Z^T A Z, with the c of the last SbCoarseRestrict(). Collective. */
PetscErrorCode SbCoarseAdd(SbCoarse coarse, Vec z);
/* E without values, and its solver, once (coarse_solver.c). Collective. */
PetscErrorCode SbCoarseCreateSolver(SbCoarse coarse);
/* Brings the blocks in coarse->value into them. Collective. */
PetscErrorCode SbCoarseSetUpSolver(SbCoarse coarse);

/* Z^T f of one node, added: force and torque. */
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
