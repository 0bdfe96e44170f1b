/*
  solver_impl.h - functions shared by the files of src/solver.
*/
#pragma once
#include "sbsolver.h"

/*
  SbKSPFinish - the norm and the convergence test of ksp, after KSPSetFromOptions().

  Not collective. A solve with a true residual far above the tolerance fails
  (KSP_DIVERGED_BREAKDOWN); no check is added to an iteration that tests the true residual or no
  norm, nor to one that tests another norm inside Newton's method. Input: direct, the preconditioner
  is a factorisation; alone, no Newton step tests the residual afterwards; forces, the absolute
  tolerance is one of the true residual, N, for any norm in the convergence test: another norm has
  to decrease by the factor by which the true residual has to; without effect with
  -ksp_convergence_test of the user. Errors: PETSC_ERR_USER if the method lacks the norm or side.
*/
PetscErrorCode SbKSPFinish(KSP ksp, PetscBool direct, PetscBool alone, PetscBool forces);

/* Makes ksp test the true residual, unless the user chose a norm or side, or the method does not
   compute it. After KSPSetType(). Not collective. */
PetscErrorCode SbKSPPreferTrueResidual(KSP ksp);

/*
  SbPCConstrainedCreate - for a space with constraints outside the matrix: makes pc a preconditioner
  in the null space of the exact constraints, P M^-1 P.

  Collective. Output: inner, M; borrowed. inner gets the options prefix of pc. inner is pc itself
  for a space without such constraints.
*/
PetscErrorCode SbPCConstrainedCreate(SbSpace space, PC pc, PC *inner);

/* Number of negative pivots of a factorisation, -1: unknown; only MUMPS' L D L^T counts them.
   Collective. */
PetscErrorCode SbPCDirectCountNegative(PC pc, PetscInt *negative);

/* Makes pc algebraic multigrid that needs few messages. threshold of strong couplings: 0, zero
   couplings, of which P1 on boxes has many, are ignored; -1, all are kept. Not collective. */
PetscErrorCode SbPCMultigridSet(PC pc, PetscReal threshold);

/* The package of a factorisation that is gathered on one rank, NULL for any other pc. Not
   collective. */
PetscErrorCode SbPCDirectGathered(PC pc, const char **package);

/*
  SbPCPressureCreate - makes pc the solver for a SbPressureOperator: GMRES for displacements and
  pressures. Use it in KSPRICHARDSON with the unpreconditioned norm, which refines until -ksp_rtol
  holds for the true residual, or the residual is one of rounding.

  Collective. The space is borrowed. -ksp_max_it limits the iterations of GMRES, and they are what
  the KSP reports. A residual that two corrections no longer halve fails the solve
  (KSP_DIVERGED_BREAKDOWN). Options read: -pressure_ksp_ (GMRES), -pressure_coarse_ (P1).
*/
PetscErrorCode SbPCPressureCreate(SbSpace space, PC pc);

/*
  Solves [K + F^T k G, F^T; G, 0] [z; m] = [r; 0] for z by a factorisation, renewed when K or the
  constraints have changed; r must be projected. Collective.

  Output: failed, the reason of a failed factorisation; z is NaN then.
*/
PetscErrorCode SbSaddleFactorSolve(SbSpace space, Vec r, Vec z, PCFailedReason *failed);

/* The context of a PCSHELL with this name, NULL for any other pc. Not collective. */
PetscErrorCode SbPCShellFind(PC pc, const char *name, void *context);

/* inverse[n][9]: inverse diagonal blocks of a matrix with the fast product, n own nodes.
   extra[n][3] (output; NULL: none): l1 terms, added to the diagonal, with which sweeps converge on
   several ranks. Zero and *positive = false where a determinant is not positive on this rank. Not
   collective. */
PetscErrorCode SbGaussSeidelSetUp(Mat A, PetscReal inverse[], PetscReal extra[],
                                  PetscBool *positive);
/* z = (D + L^T)^-1 r, D and L of this rank's part, and t = r - A z. r differs from z and t.
   Collective. */
PetscErrorCode SbGaussSeidelDown(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r,
                                 Vec z, Vec t);
/* z += (D + L)^-1 (r - A z); t is work space. Collective. */
PetscErrorCode SbGaussSeidelUp(Mat A, const PetscReal inverse[], const PetscReal extra[], Vec r,
                               Vec z, Vec t);
