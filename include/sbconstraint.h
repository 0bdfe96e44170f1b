/*
  sbconstraint.h - layer 2: constraints of single nodes, n . u = value, exactly or by springs: what contact with rigid obstacles needs beside
  prescribed unknowns (src/fem/constraint.c, which describes the method).

  SbSpaceCreateConstraints() during set-up of an effect that may need them. Then, as often as they change: SbSpaceClearConstraints(),
  SbSpaceAddConstraint() by the owners of the nodes, SbSpaceAssembleConstraints(). SbModelPrescribe(), residuals, tangents and solves follow.
*/
#pragma once
#include "sbfem.h"

/* How solves that see K as it is treat exact constraints: in their null space by iterations, or by a factorisation in which their forces are eliminated. */
typedef enum { SB_SADDLE_NONE, SB_SADDLE_DIRECT } SbSaddle;

typedef struct {
  PetscInt node;     /* owned local node */
  PetscReal n[3];    /* of the sum n . u, of length one */
  PetscReal push[3]; /* of the force; other than n where the node slides with friction */
  PetscReal value;   /* of the sum, m */
  PetscBool spring;  /* the force is constant + stiffness (value - n . u); else what keeps the sum */
  PetscReal stiffness, constant; /* N/m, >= 0, and N */
  PetscReal velocity;            /* of the sum at the end of the step, m/s */
  PetscReal force; /* of the last SbConstraintsComputeForces(), N; positive: it raises the sum */
  PetscReal sum;   /* n . u then, m */
  PetscInt next;   /* another one of the node, -1: none; filled by SbSpaceAddConstraint() */
} SbConstraint;

typedef struct _p_SbSaddleFactor *SbSaddleFactor; /* src/solver/saddle_factor.c */

struct _p_SbConstraints {
  PetscBool beside;       /* solves see them beside K (SbConstraintsCreateOperator()), else in it */
  PetscBool nonsymmetric; /* some may push along another direction than n */
  PetscInt n, size;
  SbConstraint *constraint; /* [n] */
  PetscInt *first;          /* [nnode_owned] the latest one of a node, -1: none */
  PetscReal *Q;             /* [nnode][9] what they take of a residual at a node is Q r */
  /* of all ranks, since the last SbSpaceAssembleConstraints() */
  PetscInt ntotal, nexact;
  PetscBool tilted; /* some push along another direction */

  /* src/solver: the solves beside K */
  SbSaddle saddle;
  Mat K;                    /* borrowed; NULL before SbConstraintsCreateOperator() */
  Mat whole;                /* borrowed: K with the part of the tangent that it lacks, or K */
  PetscReal *added;         /* [nnode_owned][3] what K holds beside the tangent, N/m; NULL: nothing */
  PetscInt version, matrix; /* raised when the constraints change, and when K does */
  SbSaddleFactor factored;  /* NULL before the first solve with SB_SADDLE_DIRECT */
  PetscErrorCode (*destroy_factored)(SbSaddleFactor *); /* by who made it */
  PetscBool general; /* a method for symmetric systems has given way to one for others */
  char method[SB_NAME_MAX];
  KSPNormType norm;
  PCSide side; /* of that method */
};

/* The constraints that solves see beside K; NULL: there are none. Not collective. */
static inline SbConstraints SbConstraintsSeparate(SbSpace space)
{
  return space->constraints && space->constraints->beside ? space->constraints : NULL;
}

/* beside: solves see K as it is, and the constraints beside it; nonsymmetric: they may push along other directions than n, which needs that. The
   most that an effect asks for holds for all. Alike on all ranks. Not collective. */
PetscErrorCode SbSpaceCreateConstraints(SbSpace space, PetscBool beside, PetscBool nonsymmetric);
void SbSpaceClearConstraints(SbSpace space);
/* Output: number of the constraint on this rank; -1, and nothing is done, for an exact one that earlier exact ones of the node and supports say already.
   Not collective. */
PetscErrorCode SbSpaceAddConstraint(SbSpace space, const SbConstraint *constraint, PetscInt *number);
/* Collective. */
PetscErrorCode SbSpaceAssembleConstraints(SbSpace space);
/* Whether there is one on any rank. Not collective, alike on all ranks. */
PetscBool SbSpaceIsConstrained(SbSpace space);
/* Lends constraint `number` of this rank till the next one is added. */
SbConstraint *SbSpaceGetConstraint(SbSpace space, PetscInt number);

/* Not collective, on owned nodes [nnode_owned][3]: u <- where exact constraints hold; x <- x - Q x: a residual without what they take, a direction that leaves their sums. */
void SbConstraintsPrescribe(SbSpace space, PetscReal u[]);
void SbConstraintsProject(SbSpace space, PetscReal x[]);
/* z <- the part of it that moves nothing that is prescribed or constrained exactly. Not collective. */
PetscErrorCode SbSpaceProjectAdmissible(SbSpace space, Vec z);
/* f <- f less the springs' forces, and less what exact constraints take when `constrain`. */
void SbConstraintsResidual(SbSpace space, const PetscReal u[], PetscBool constrain, PetscReal f[]);
/* y <- y + (F^T k G) x of springs, less what K holds beside the tangent; that matrix of one node added to its block. */
void SbConstraintsAddTangent(SbSpace space, const PetscReal x[], PetscReal y[]);
void SbConstraintsAddSprings(SbSpace space, PetscInt node, PetscReal block[9]);
/* Forces and sums of all constraints, for the displacement u and its residual r without constraints (but with springs), N. */
void SbConstraintsComputeForces(SbSpace space, const PetscReal u[], const PetscReal r[]);
/* After it: f <- f + what all constraints push with, N. */
void SbConstraintsAddForces(SbSpace space, PetscReal f[]);
/* After it: of that residual r what supports exert, at prescribed unknowns, and what constraints exert, elsewhere. */
void SbConstraintsReactions(SbSpace space, PetscReal r[]);
/* v <- the nearest velocity at which exact constraints' sums have theirs. Not for those that push along another direction. */
void SbConstraintsVelocity(SbSpace space, PetscReal v[]);
/* For a block of a matrix between local nodes i and j: B <- P_i B P_j, on the diagonal with its size times Q_i added; its rows are rs apart, its columns cs. */
void SbConstraintsProjectBlock(SbSpace space, PetscInt i, PetscInt j, size_t rs, size_t cs, PetscScalar *v);
