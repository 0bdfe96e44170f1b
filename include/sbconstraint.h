/*
  sbconstraint.h - constraints between nodes: what constraint.c and the solvers of saddle-point systems share.
*/
#pragma once
#include "sbfem.h"

/* Constraints of one kind as a matrix with three columns per node. */
typedef struct {
  PetscInt n;                   /* constraints of this rank */
  PetscInt N;                   /* of all ranks */
  Mat full, free;               /* G, and G without prescribed and constrained directions */
  Mat push, push_free;          /* F likewise; G itself where all constraints push along themselves */
  Vec value, force, work, step; /* by constraints */
} SbConstraintMatrix;

/*
  Scaled part of G D G^T on the diagonal of what is factored: constraints that depend on others leave it regular. Constraints of a soft and a hard surface on
  each other are nearly dependent in the measure of D, to the ratio of stiffness: with 1e6 a part of 1e-8 is so much of the smallest
  eigenvalues that no few passes of the projection make up for it.
*/
#define SB_CONSTRAINT_REGULARIZATION 1e-11

typedef struct _p_SbSaddleFactor *SbSaddleFactor; /* saddle_factor.c */

struct _p_SbConstraints {
  SbSaddle saddle;          /* how solves find the multipliers */
  PetscInt version, matrix; /* raised when the constraints change, and when K does */
  SbSaddleFactor factored;  /* NULL before the first solve with SB_SADDLE_DIRECT */
  PetscErrorCode (*destroy_factored)(SbSaddleFactor *); /* by who made it */
  PetscInt n, size;                                     /* constraints, room */
  PetscInt ntotal;                                      /* constraints of all ranks */
  PetscInt *start;                                      /* [n+1] */
  PetscInt nentry, entry_size;
  PetscInt *gnode;                         /* [nentry] */
  PetscReal *coef, *along;                 /* [nentry][3] of the sum, and of the force */
  PetscReal *value, *stiffness, *constant; /* [n]; stiffness -1: exact */
  PetscInt *id;                            /* [n] */
  int passes;                              /* of a projection: more where constraints are nearly dependent */
  PetscBool *redundant;                    /* [n] an exact constraint that earlier ones say already */
  PetscInt *position;                      /* [n] its row in its matrix on this rank */
  PetscReal *force, *sum;                  /* [n] */
  PetscReal *rate; /* [nrate] m/s, of constraints on what moves; constraints behind them: 0 */
  PetscInt nrate;
  SbConstraintMatrix exact, spring;
  Vec k, constants;       /* of springs */
  Mat K;                  /* borrowed; NULL before SbConstraintsCreateOperator() */
  PetscBool nonsymmetric; /* constraints may push along other coefficients than their own */
  PetscBool tilted;       /* some do now */
  PetscBool general;      /* a method for symmetric systems has given way to one for others */
  char method[SB_NAME_MAX];
  KSPNormType norm;
  PCSide side; /* of that method */
  Mat DFt;     /* D F^T */
  Mat gram;    /* G D F^T, its diagonal slightly larger */
  KSP solver;
  Vec anchor,
    added;  /* squares of the coefficients, and what K holds beside the tangent, N/m; NULL: nothing */
  Vec free; /* 1 at unknowns that are not prescribed, else 0 */
  Vec d;    /* D */
  Vec w[3];
};

/* x <- P x. Collective. */
PetscErrorCode SbConstraintsProject(SbConstraints c, Vec x);
/* r <- r - F^T lambda, what constraints cannot take; lambda into c->exact.force, N. Collective. */
PetscErrorCode SbConstraintsProjectForce(SbConstraints c, Vec r);
