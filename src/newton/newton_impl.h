/*
  newton_impl.h - data and functions shared by the files of src/newton.
*/
#pragma once
#include <petsc/private/snesimpl.h> /* PETSc has no public way to write a SNESType */
#include "sbnewton.h"

#define SHORTEST 1e-7 /* shortest fraction of a step that is tried */

/* The potential at an iterate, as the line search needs it. */
typedef struct {
  Vec x, r;        /* the iterate and its residual; of the last iterate borrowed from the SNES */
  Vec elastic;     /* gradient of the strain energy, N */
  Vec contact;     /* barriers: the same of their energy; else NULL */
  PetscReal norm;  /* norm of the residual, N */
  PetscReal psi;   /* strain energy and energy of barriers, J */
  PetscReal gaps;  /* energy of barriers, J */
  PetscReal rest;  /* slope of all but strain and barriers along the step, J */
  PetscReal slope; /* slope of E along the step, J */
  PetscReal s, change; /* fraction of the step; change of E over it, J */
  PetscInt ninverted;
} Iterate;

/* Data of a solve. */
typedef struct {
  const SbNewtonProblem *problem; /* borrowed */

  /* the line search */
  Iterate from;       /* the last iterate */
  PetscBool known;    /* `from` is up to date, but for its slopes */
  Iterate to;         /* a trial */
  Iterate best;       /* barriers: the longest sufficient trial */
  PetscReal change;   /* change of E over the last step, J */
  PetscBool rounding; /* the last step changed nothing beyond rounding */
  PetscReal held;     /* Y was shortened body by body: least fraction that is left; 1: it was not */

  /* provisional steps, which may raise E */
  struct {
    PetscInt n;      /* number of them since E was below the value at X */
    Vec X, Y;        /* iterate before them; the first one led to X - Y */
    PetscReal slope; /* slope of E at X along that step, J */
    PetscReal norm;  /* norm of the residual there, N */
    PetscReal first; /* change of E over it, J, */
    PetscReal part;  /* and the fraction of Y that it was */
    PetscReal rise;  /* change of E over all of them, J */
  } provisional;

  /* the direction */
  PetscBool filtered;    /* the next tangent is positive semi-definite in each cell */
  PetscBool unstable;    /* an exact tangent of this solve was not positive definite */
  PetscInt branch;       /* static, forces without a potential: negative eigenvalues at the start */
  SbContactHessian kind; /* barriers: of the next linear solve */
  PetscInt nblock;       /* blocks of barriers in the last one, all ranks */
  Vec rhs;               /* barriers: right-hand side of the quadratic model */
  PetscReal shift;       /* factor on the mass matrix added to the last tangent, 1/s^2 */

  /* the loop */
  PetscBool full;               /* the last step was a full one */
  PetscReal initial;            /* norm of the first residual, N */
  PetscReal before;             /* norm of the last residual, N */
  PetscReal tolerance;          /* absolute tolerance of the last solve, N */
  PetscBool patient;            /* barriers, without -snes_max_it: may exceed its default */
  PetscReal fall, fall_checked; /* of E in this solve, and until the last check of progress, J */
  PetscInt first;               /* iteration at which friction's lag was updated last */
  PetscInt stagnant;            /* very short steps in a row */
  PetscInt nshort;              /* barriers: steps in a row that are short enough to be the last */
} Newton;

/* direction.c: solves for Y, X - Y being the next iterate, and for the slope of E along -Y, J. Sets
   snes->reason on failure. Collective. */
PetscErrorCode SbNewtonFindDirection(SNES snes, PetscReal *slope);
/* Solves once more, accurately; `better`: the old direction was less accurate. Collective. */
PetscErrorCode SbNewtonSolveAccurately(SNES snes, PetscReal *slope, PetscBool *better);

/* direction.c: the longest safe fraction s of the step Y from the iterate; left as it is where
   nothing limits it. Collective. */
PetscErrorCode SbNewtonLongestStep(SNES snes, PetscReal *s);

/* search.c: line search from X along -Y, where E has this slope, J, to the next X and F; s:
   fraction of Y, in: the largest. Sets snes->reason on failure. Collective. */
PetscErrorCode SbNewtonSearch(SNES snes, PetscReal slope, PetscReal *s);

/* approach.c: with barriers, from the start of the step to a first X with the prescribed
   displacements of its end. Sets snes->reason on failure. Collective. */
PetscErrorCode SbNewtonApproach(SNES snes);
