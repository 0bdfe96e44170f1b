/*
  sbconstraint.h - layer 3: constraints of single nodes, n . u = value, exactly or by springs, for
  contact with rigid obstacles (method: src/fem/constraint.c).

  SbSpaceCreateConstraints() during set-up of an effect that may need them. Then, as often as they
  change: SbSpaceClearConstraints(), SbSpaceAddConstraint() by the owners of the nodes,
  SbSpaceAssembleConstraints(). SbModelPrescribe(), residuals, tangents and solves follow.
*/
#pragma once
#include "sbfem.h"

/* Treatment of exact constraints outside K: iterations in their null space, or a factorisation. */
typedef enum {
  SB_SADDLE_NONE,
  SB_SADDLE_DIRECT
} SbSaddle;

typedef struct {
  PetscInt node;  /* owned local node */
  PetscReal n[3]; /* unit vector of the constraint n . u */
  PetscReal
    push[3];        /* direction of the force; differs from n where the node slides with friction */
  PetscReal value;  /* right-hand side: n . u = value, m */
  PetscBool spring; /* the force is constant + stiffness (value - n . u); else a multiplier */
  PetscReal stiffness, constant; /* N/m, >= 0, and N */
  PetscReal velocity;            /* of n . u at the end of the step, m/s */
  PetscReal force; /* by the last SbConstraintsComputeForces(), N; positive: along push */
  PetscReal sum;   /* n . u then, m */
  PetscInt next;   /* next constraint of the node, -1: none; filled by SbSpaceAddConstraint() */
} SbConstraint;

struct _p_SbConstraints {
  PetscBool
    beside; /* solves treat them outside K (SbConstraintsCreateOperator()), else K is projected */
  PetscBool nonsymmetric; /* some may have push other than n */
  PetscInt n, size;
  SbConstraint *constraint; /* [n] */
  PetscInt *first;          /* [nnode_owned] last constraint of a node, -1: none */
  PetscReal *Q;             /* [nnode][9] the projection of a residual at a node is r - Q r */
  /* of all ranks, since the last SbSpaceAssembleConstraints() */
  PetscInt ntotal, nexact;
  PetscBool tilted; /* some have push other than n */

  /* src/solver: solves with constraints outside K */
  SbSaddle saddle;
  Mat K;            /* borrowed; NULL before SbConstraintsCreateOperator() */
  Mat whole;        /* borrowed: the complete tangent, K plus SbModelNonsymmetric(), or K */
  PetscReal *added; /* [nnode_owned][3] diagonal regularisation added to K, N/m; NULL: none */
  PetscInt version, matrix; /* raised when the constraints change, and when K does */
  PC
    factored; /* factorisation of the system, owned; NULL before the first solve with SB_SADDLE_DIRECT */
  PetscInt factored_version, factored_matrix; /* version and matrix then */
  PCFailedReason failed;                      /* of this factorisation */
  PetscBool general;                          /* FGMRES replaces a method for symmetric systems */
  char method[SB_NAME_MAX];
  KSPNormType norm;
  PCSide side; /* of the replaced method */
};

/* The constraints that solves treat outside K; NULL: there are none. Not collective. */
static inline SbConstraints SbConstraintsSeparate(SbSpace space)
{
  return space->constraints && space->constraints->beside ? space->constraints : NULL;
}

/* Whether a factorisation of the saddle-point system replaces the preconditioner now. Not
   collective. */
static inline PetscBool SbConstraintsFactored(SbSpace space)
{
  const SbConstraints c = space->constraints;

  return (PetscBool)(c && c->saddle == SB_SADDLE_DIRECT && c->nexact);
}

/* beside: solves treat the constraints outside K; nonsymmetric: push may differ from n, which needs
   `beside`. Flags of several calls are joined by or. Alike on all ranks. Not collective. */
PetscErrorCode SbSpaceCreateConstraints(SbSpace space, PetscBool beside, PetscBool nonsymmetric);
void SbSpaceClearConstraints(SbSpace space);
/* Output: number of the constraint on this rank; -1: redundant, as it follows from earlier exact
   ones and supports of the node, and not added. Not collective. */
PetscErrorCode SbSpaceAddConstraint(SbSpace space, const SbConstraint *constraint,
                                    PetscInt *number);
/* After the last SbSpaceAddConstraint(): builds Q and the global counts. Collective. */
PetscErrorCode SbSpaceAssembleConstraints(SbSpace space);
/* Whether there is one on any rank. Not collective, alike on all ranks. */
static inline PetscBool SbSpaceIsConstrained(SbSpace space)
{
  return (PetscBool)(space->constraints && space->constraints->ntotal);
}
/* Lends constraint `number` of this rank till the next one is added. */
static inline SbConstraint *SbSpaceGetConstraint(SbSpace space, PetscInt number)
{
  return &space->constraints->constraint[number];
}

/*
  Not collective, on owned nodes [nnode_owned][3]: x <- the closest displacement, m, that satisfies
  exact constraints, or velocity, m/s, of which n . x is theirs (if push is n); x <- x - Q x:
  projected residual.
*/
void SbConstraintsPrescribe(SbSpace space, PetscBool velocities, PetscReal x[]);
void SbConstraintsProject(SbSpace space, PetscReal x[]);
/* z <- its projection onto directions that supports and exact constraints admit. Not collective. */
PetscErrorCode SbSpaceProjectAdmissible(SbSpace space, Vec z);
/* f[nnode_owned][3], N, less springs' forces; projected by exact constraints if `constrain`. */
void SbConstraintsResidual(SbSpace space, const PetscReal u[], PetscBool constrain, PetscReal f[]);
/* y <- y + (F^T k G - added) x, F, G, k: push, n and stiffness of springs; the same added to the
   diagonal block of a node. */
void SbConstraintsAddTangent(SbSpace space, const PetscReal x[], PetscReal y[]);
void SbConstraintsAddSprings(SbSpace space, PetscInt node, PetscReal block[9]);
/* Computes `force` and `sum` of all, for u[nnode_owned][3], m, and its residual r without
   constraints (but with springs), N. */
void SbConstraintsComputeForces(SbSpace space, const PetscReal u[], const PetscReal r[]);
/* After it: adds the forces of all constraints to f[nnode_owned][3], N. */
void SbConstraintsAddForces(SbSpace space, PetscReal f[]);
/* After it: turns this residual r into reactions: of supports, elsewhere constraints, N. */
void SbConstraintsReactions(SbSpace space, PetscReal r[]);
/* Block of local nodes i, j: B <- P_i B P_j (P = I - Q), if i = j plus |B| Q_i; strides of rows,
   columns. */
void SbConstraintsProjectBlock(SbSpace space, PetscInt i, PetscInt j, size_t rs, size_t cs,
                               PetscScalar *v);
