/*
  sbnewton.h - layer 5: Newton's method as the minimisation of a potential E, a SNESType.

  The gradient of E and its Hessian are the function and the Jacobian of the SNES; what else the
  method needs to know is an SbNewtonProblem. It knows no mesh, model or time step.
*/
#pragma once
#include "sbsolver.h"

#define SB_SNES_NEWTON "newton"
#define SB_NEWTON_ITERATIONS 100 /* default of -snes_max_it; barriers may take more */

/* The parts of E that are evaluated directly. The rest of E has the gradient that they leave. */
typedef struct {
  PetscReal strain;   /* J */
  PetscReal contact;  /* of barriers, J */
  PetscInt ninverted; /* cells with det F <= 0, all ranks */
} SbNewtonEnergy;

/*
  Barriers: a part of E that is infinite where surfaces intersect, so that steps have a largest safe
  length. X: an iterate, Y: a direction, X - s Y the next iterate, m. All are collective.

    max_step         - part: largest s in [0, 1] without a collision; nactive: number of pairs
                       within a barrier, all ranks (may be NULL)
    body_steps       - NULL: all keep a common length. part: as max_step. Z: Y, shortened body by
                       body as far as each is held up by collisions; bodies that touch or are
                       coupled keep a common length. farther: some go farther than that part
    advance          - obstacles move to this fraction of their motion in the step
    inverted         - strain energy at X, J, and number of inverted cells, all ranks
    hessian          - assembles the Hessian of the barriers at X, or its substitute; nblock: number
                       of its blocks, all ranks, 0: no contact, and the other outputs are not used.
                       rhs: F, the residual at X, as it is in the quadratic model
    solve            - Y = (P + that Hessian)^-1 rhs, P the matrix of the SNES
    step_tolerance   - longest last step of the solution, m, in the maximum norm
    update_friction  - lagged friction takes the normal forces at X, an iterate or (solved) the
                       solution; again: E has changed
*/
typedef struct {
  PetscErrorCode (*max_step)(void *ctx, Vec X, Vec Y, PetscReal *part, PetscInt *nactive);
  PetscErrorCode (*body_steps)(void *ctx, Vec X, Vec Y, Vec Z, PetscReal *part, PetscBool *farther);
  PetscErrorCode (*advance)(void *ctx, PetscReal fraction);
  PetscErrorCode (*inverted)(void *ctx, Vec X, PetscReal *energy, PetscInt *n);
  PetscErrorCode (*hessian)(void *ctx, Vec X, Vec F, SbContactHessian kind, Vec rhs,
                            PetscInt *nblock);
  PetscErrorCode (*solve)(void *ctx, Mat P, Vec rhs, Vec Y, KSPConvergedReason *reason,
                          PetscInt *iterations);
  PetscErrorCode (*step_tolerance)(void *ctx, PetscReal *longest);
  PetscErrorCode (*update_friction)(void *ctx, Vec X, PetscBool solved, PetscBool *again);
  Vec start; /* an iterate without intersections, at the start of the step, m; borrowed */
  Vec mass;  /* of each unknown, kg, for shifts of indefinite tangents; borrowed */
  PetscReal total_mass; /* kg */
} SbNewtonBarrier;

/*
  A minimisation, beside the function and the Jacobian of the SNES. Fields may change between
  solves. All operations are collective.

    energy               - E's parts at X, and their gradients, N; contact is NULL without barriers
    filter               - NULL: tangents are exact, or never indefinite. Else following Jacobians
                           are exact or, `filtered`, positive semi-definite in each cell. required:
                           the solve with it will not be repeated
    negative_eigenvalues - NULL: unknown. Number in the last factorisation, -1: unknown
    linearise            - NULL: nothing to linearise. Tangents take the stresses linearised at X,
                           or at X for the step to X - s Y; X NULL: of the iterate again
    freeze               - NULL: nothing to freeze. Laws with a factor whose slope jumps keep the
                           factor that they have at X; X NULL: no longer
    longest              - NULL: any. part: the longest s in [0, 1] for which E stays finite from X
                           to X - s Y
    prescribed_part      - sets all of D but the prescribed unknowns to zero
    interrupted          - NULL: never. Whether the solve is to be given up
*/
typedef struct {
  PetscErrorCode (*energy)(void *ctx, Vec X, SbNewtonEnergy *value, Vec strain, Vec contact);
  PetscErrorCode (*filter)(void *ctx, PetscBool filtered, PetscBool required);
  PetscErrorCode (*negative_eigenvalues)(void *ctx, PetscInt *n);
  PetscErrorCode (*linearise)(void *ctx, Vec X, Vec Y, PetscReal s);
  PetscErrorCode (*freeze)(void *ctx, Vec X);
  PetscErrorCode (*longest)(void *ctx, Vec X, Vec Y, PetscReal *part);
  PetscErrorCode (*prescribed_part)(void *ctx, Vec D);
  PetscErrorCode (*interrupted)(void *ctx, PetscBool *is);
  const SbNewtonBarrier *barrier; /* borrowed; NULL: none */
  Vec start; /* static, without barriers: the last equilibrium, m; borrowed. NULL: unknown */
  void *ctx; /* of all operations; borrowed */
  PetscReal rounding;     /* of the strain energy, J */
  PetscReal dt;           /* length of the step, s; 0: without inertia */
  PetscBool nonsymmetric; /* some forces have no potential */
  PetscBool quadratic;    /* static: tangents are exact */
  PetscBool may_give_up;  /* static: the load step can be shortened */
  PetscInt iterations;    /* barriers: after so many the solve ends where it is, and in each of them
                          bodies go as far as collisions let them, one by one; 0: when it is solved */
  Vec left; /* with them: what the last direction had beyond the solution, m, 0 if it is solved;
               borrowed */
  PetscBool warm_start; /* the solve starts from the last one's solution, with its tolerance */
} SbNewtonProblem;

/* Constructor of the SNESType, for SNESRegister(). */
PetscErrorCode SbNewtonCreate(SNES snes);
/* After SNESSetType() and before the first solve; nothing for another SNESType. The problem is
   borrowed. Option: -snes_max_it. Not collective. */
PetscErrorCode SbNewtonSetProblem(SNES snes, const SbNewtonProblem *problem);
/* Whether a tangent of the last solve was indefinite; false for another SNESType or tangent. Not
   collective. */
PetscErrorCode SbNewtonUnstable(SNES snes, PetscBool *is);
/* Change of E over the last iteration, J. Not collective. */
PetscErrorCode SbNewtonChange(SNES snes, PetscReal *change);
