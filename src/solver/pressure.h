/*
  pressure.h - what the parts of the solver for nearly incompressible bodies share: the mixed operator, with the pressures of the cells as unknowns,
  and the preconditioner of its displacement block (pc_pressure.c says why).
*/
#pragma once
#include "sbassembly.h"

/*
  Up to three spaces of one mesh: the space itself; the same with CR instead of DG, when some body is DG; and P1 for every body.
  The tangent without its volumetric part is assembled in each. With a P2 body there is the space itself only, and pc_p_multigrid.c.
*/
typedef struct _p_SbLevels *SbLevels;
struct _p_SbLevels {
  SbSpace space; /* borrowed */
  PetscInt n;    /* number of levels: 2, or 3 with a DG body, 1 with a P2 body */
  SbSpace at[3]; /* at[0] = space; the others are owned */
  Mat A[3];      /* BAIJ; the last one AIJ */
  SbElement *element[3];
  PetscReal shift_a, shift_v, shift_k; /* of the last assembly */
  PetscInt *mean;                      /* [nnode] node of at[1]; NULL without a DG body, as the next three */
  PetscInt *across;                    /* [nnode] node on the other side of the face, -1: none */
  PetscReal *weight;                   /* [nnode] own weight in the mean of the two */
  PetscReal *jump;                     /* [nnode_owned] inverse stiffness of the jump, m/N */
  PetscInt *corner; /* [nodes of at[n-2]][3] local vertices of the face; a P1 node has its vertex thrice */
  Vec r[3], z[3], g[3]; /* work vectors of each level, with ghosts */
  Vec t[3], w[3];       /* and without; t[0] is the diagonal of A[0] with a DG body */
  PetscBool sprung;     /* this rank has springs since the last assembly */
  PetscReal *spring;    /* [nnode_owned][9] sum of the springs of effects, N/m; NULL: none */
  PetscReal *shared;    /* [nodes of at[n-2]][9] the same there; NULL before the first one of any rank */
  KSP coarse;           /* NULL with a P2 body */
  PC multigrid;         /* of a space with a P2 body, else NULL */
  PetscReal *inverse;   /* [nodes of at[n-2]][9] inverses of the diagonal blocks there, m/N */
};
/* Collective. The space's prescribed unknowns are known. Options read: -pressure_coarse_. */
PetscErrorCode SbLevelsCreate(SbSpace space, SbLevels *levels);
PetscErrorCode SbLevelsDestroy(SbLevels *levels);
/* Fills the matrices; `out` gets the volumetric part. Not collective. */
PetscErrorCode SbLevelsAssemble(SbLevels levels, const SbStage *stage, const SbVolumetric *out);
/* factor times a block at a node, which is in A[0] already; nodes of other ranks are left to these. Not collective. */
PetscErrorCode SbLevelsAddSpring(SbLevels levels, PetscInt node, PetscReal factor, const PetscReal block[9]);
/* Brings the springs of all ranks into the other matrices, before these are finished. Collective. */
PetscErrorCode SbLevelsShareSprings(SbLevels levels);
/* After the matrices have been finished. *positive = false: a diagonal block is not, and nothing may be applied. Collective. */
PetscErrorCode SbLevelsSetUp(SbLevels levels, PetscBool *positive);
/* z = a symmetric approximation of A[0]^-1 times r. Collective. */
PetscErrorCode SbLevelsApply(SbLevels levels, Vec r, Vec z);

/*
  The tangent as K = A + B^T C^-1 B: A has no volumetric part, B u is the change of volume of the cells, C = V / lambda.
*/
typedef struct _p_SbPressureOperator *SbPressureOperator;
struct _p_SbPressureOperator {
  SbSpace space; /* borrowed */
  SbLevels levels;
  SbAssembly assembly; /* of the matrix */
  SbVolumetric volume;
  void *memory;    /* memory of volume */
  PetscReal *C;    /* [ncell_owned] m^3/Pa; 1 where the cell is whole in A */
  PetscReal *Cinv; /* [ncell_owned] Pa/m^3; 0 there */
  PetscReal *S;    /* [ncell_owned] C + S0 V / (2 mu), m^3/Pa: stands for C + B A^-1 B^T */
  PetscReal *norm; /* [ncell_owned] Euclidean norm of the cell's row of B, m^2 */
  Vec u, y;        /* ghosted work vectors */
  Vec p;           /* pressures of cells with ghosts, Pa */
  Vec a, b;        /* vectors of A without storage of their own in use */
};
/* The operator behind a matrix of SbPressureOperatorCreate(), else NULL. Not collective. */
PetscErrorCode SbPressureOperatorGet(Mat K, SbPressureOperator *op);
/* y[3 nnode_owned] = A u + B^T p, d[ncell_owned] = B u; u, p owned parts; p or d may be NULL. Collective. */
PetscErrorCode SbPressureOperatorApply(SbPressureOperator op, const PetscScalar u[], const PetscScalar p[],
                                       PetscScalar y[], PetscScalar d[]);
/* y[3 nnode_owned] -= B^T p. Collective. */
PetscErrorCode SbPressureOperatorSubtract(SbPressureOperator op, const PetscScalar p[], PetscScalar y[]);
/* Norm of the rounding errors that K x has from its volumetric part and from the diagonal of A, N. Collective. */
PetscErrorCode SbPressureOperatorRounding(SbPressureOperator op, Vec x, PetscReal *level);
