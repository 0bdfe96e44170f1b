/*
  pressure.h - the solver for nearly incompressible bodies (pressure.c): the mixed operator, with
  the pressures of the cells as unknowns, and the preconditioner of its displacement block.
*/
#pragma once
#include "sbpc.h"

/* Up to three spaces on one mesh: the space itself; if some body is DG, the same with CR for DG; P1
   for every body. The tangent without its volumetric part is assembled in each. With a P2 body only
   the space itself, with two_level.c. */
typedef struct _p_SbLevels *SbLevels;
struct _p_SbLevels {
  PetscInt n;    /* number of levels: 2, or 3 with a DG body, 1 with a P2 body */
  SbSpace at[3]; /* at[0]: the space, borrowed; the others are owned */
  Mat A[3];      /* matrices of the levels: BAIJ; the last one AIJ */
  SbElement *element[3];
  SbStage stage;     /* of the last assembly: its shifts */
  PetscInt *mean;    /* [nnode] CR node (at[1]) of a DG node; NULL without DG, as the next three */
  PetscInt *across;  /* [nnode] node on the other side of the face, -1: none */
  PetscReal *weight; /* [nnode] own weight in the mean of the two sides */
  PetscReal *jump;   /* [nnode_owned] inverse stiffness of the jump, m/N */
  Mat P; /* of at[n-2] and at[n-1]: a face has the mean of its vertices; else the node itself */
  Vec r[3], z[3], t[3]; /* work vectors with ghosts; t[0] is the diagonal of A[0] with a DG body */
  PetscReal *spring;    /* [nnode_owned][9] sum of the springs of effects, N/m; NULL: none so far */
  PetscReal *shared;    /* [nodes of at[n-2]][9] the same there; NULL before any rank has springs */
  KSP coarse;           /* solver of the P1 level; NULL with a P2 body */
  PC multigrid;         /* preconditioner of a space with a P2 body, else NULL */
  PetscReal *inverse;   /* [nodes of at[n-2]][9] inverse diagonal blocks of that level, m/N */
};
/* Collective. Prescribed unknowns must have been marked. Options read: -pressure_coarse_. */
PetscErrorCode SbLevelsCreate(SbSpace space, SbLevels *levels);
PetscErrorCode SbLevelsDestroy(SbLevels *levels);

/* Adds the springs of all ranks to the other matrices, before their final assembly. Collective. */
PetscErrorCode SbLevelsShareSprings(SbLevels levels);

/* After the final assembly. *positive = false: a diagonal block is not positive definite, and
   SbLevelsApply() must not be called. Collective. */
PetscErrorCode SbLevelsSetUp(SbLevels levels, PetscBool *positive);

/* z = a symmetric approximation of A[0]^-1, applied to r. Collective. */
PetscErrorCode SbLevelsApply(SbLevels levels, Vec r, Vec z);

/* The tangent as K = A + B^T C^-1 B: A has no volumetric part, B u is the change of volume of the
   cells, C = V / lambda. The context of the matrix of SbPressureOperatorCreate(). */
typedef struct _p_SbPressureOperator *SbPressureOperator;
struct _p_SbPressureOperator {
  SbSpace space; /* borrowed */
  SbLevels levels;
  SbAssembly assembly; /* how the matrix is assembled */
  SbVolumetric volume;
  void *memory;      /* data of SbVolumetric, owned */
  PetscReal *C;      /* [ncell_owned] m^3/Pa; 1 where the cell's volumetric part stays in A */
  PetscReal *Cinv;   /* [ncell_owned] Pa/m^3; 0 for such cells */
  PetscReal *S;      /* [ncell_owned] C + S0 V / (2 mu), m^3/Pa: approximates C + B A^-1 B^T */
  PetscReal *weight; /* [ncell_owned] of the cells' rows in the norm of GMRES, N/m^3 */
  PetscReal *p;      /* [ncell] pressures of the cells, Pa */
  Vec u;             /* work vector with ghosts */
  Vec a, b;          /* vectors for A that borrow their arrays */
};
/* y[3 nnode_owned] = A u + B^T p, d[ncell_owned] = B u; u, p owned parts. Collective. */
PetscErrorCode SbPressureOperatorApply(SbPressureOperator op, const PetscScalar u[],
                                       const PetscScalar p[], PetscScalar y[], PetscScalar d[]);

/* y[3 nnode_owned] += factor B^T p; absolute: with |B|. Collective. */
PetscErrorCode SbPressureOperatorAddGradient(SbPressureOperator op, const PetscScalar p[],
                                             PetscBool absolute, PetscReal factor, PetscScalar y[]);

/* Norm of the rounding errors of K x from its volumetric part and from the diagonal of A, N.
   Collective. */
PetscErrorCode SbPressureOperatorRounding(SbPressureOperator op, Vec x, PetscReal *level);
