/*
  couple.h - rows between nodes: what couple.c, couple_operator.c and couple_select.c share.
*/
#pragma once
#include "fem_impl.h"

/* Rows of one kind as a matrix with three columns per node. */
typedef struct {
  PetscInt n;                   /* rows of this rank */
  PetscInt N;                   /* of all ranks */
  Mat whole, free;              /* G, and G without prescribed and held directions */
  Vec value, force, work, step; /* by rows */
} Rows;

struct _p_SbCouple {
  PetscInt n, size; /* rows, room */
  PetscInt *start;  /* [n+1] */
  PetscInt nentry, entry_size;
  PetscInt *gnode;                         /* [nentry] */
  PetscReal *coef;                         /* [nentry][3] */
  PetscReal *value, *stiffness, *constant; /* [n]; stiffness -1: exact */
  PetscInt *id;                            /* [n] */
  PetscBool *rests;                        /* [n] an exact row that earlier ones say already */
  PetscInt *place;                         /* [n] row in its matrix on this rank */
  PetscReal *force, *sum;                  /* [n] */
  Rows exact, spring;
  Vec k, constants; /* of springs */
  Mat K;            /* borrowed; NULL before SbCoupleCreateOperator() */
  Mat DGt;          /* D G^T */
  Mat gram;         /* G D G^T, its diagonal slightly larger */
  KSP solver;
  Vec anchor,
    added;  /* squares of the coefficients, and what K holds beside the tangent, N/m; NULL: nothing */
  Vec free; /* 1 at unknowns that are not prescribed, else 0 */
  Vec d;    /* D */
  Vec w[2];
};

/* Finds the exact rows that rest: c->rests. Collective. */
PetscErrorCode SbCoupleSelect(SbSpace space);
/* x <- P x. Collective. */
PetscErrorCode SbCoupleProject(SbCouple c, Vec x);
/* r <- P^T r; the multipliers into c->exact.force, N. Collective. */
PetscErrorCode SbCoupleProjectForce(SbCouple c, Vec r);
