/*
  solver_impl.h - shared by the files of src/solver.
*/
#pragma once
#include "sbsolver.h"

/* Errors: PETSC_ERR_USER for a norm or side that the type of ksp does not have. After KSPSetFromOptions(). Not collective. */
PetscErrorCode SbKSPCheckNorm(KSP ksp);

/*
  SbKSPCheckTrueResidual - solves of ksp whose true residual is far above the tolerance fail (KSP_DIVERGED_BREAKDOWN).

  Not collective; after KSPSetFromOptions(). Input: direct, the preconditioner is a factorisation; alone, no Newton step examines what a solve has left.
  Nothing is done for an iteration that is judged by the true residual, or by none, nor for one with a norm of its own inside Newton's method.
*/
PetscErrorCode SbKSPCheckTrueResidual(KSP ksp, PetscBool direct, PetscBool alone);

/* The true residual decides, unless the user chose a norm or a side, or the type of ksp does not compute it. After KSPSetType(). Not collective. */
PetscErrorCode SbKSPPreferTrueResidual(KSP ksp);

/*
  SbKSPSetForceTolerance - makes the absolute tolerance of ksp one of the true residual, N, whatever norm it is judged by.

  Not collective; after KSPSetFromOptions(). A norm that is not the true one is compared with its own start, by the factor that the true residual has to fall by.
  Nothing is done for a method that is judged by the true residual, or with -ksp_convergence_test of the user's.
*/
PetscErrorCode SbKSPSetForceTolerance(KSP ksp);

/*
  SbPCConstrainedCreate - for a space with constraints beside the matrix: makes pc a preconditioner in the null space of the exact ones, P M^-1 P.

  Collective. Output: inner, M; borrowed. It takes the options of pc, which gives up its prefix. inner is pc itself for a space
  without such constraints.
*/
PetscErrorCode SbPCConstrainedCreate(SbSpace space, PC pc, PC *inner);

/* negative: pivots below zero of a factorisation that is done, -1 where it is unknown: L D L^T of MUMPS counts them. Collective. */
PetscErrorCode SbPCDirectCountNegative(PC pc, PetscInt *negative);

/* parent[nnode][2], to be freed by the caller: local nodes, the vertices of a node at an edge of P2, else the node itself twice. Not collective. */
PetscErrorCode SbSpaceEdgeParents(SbSpace space, PetscInt **parent);

/* The package of such a factorisation that is gathered on one rank, NULL for any other pc. Not collective. */
PetscErrorCode SbPCDirectGathered(PC pc, const char **package);

/*
  SbPCPressureCreate - makes pc the solver for such an operator: GMRES in nodes and pressures. Put it into KSPRICHARDSON with
  the unpreconditioned norm, which then refines until -ksp_rtol holds for the true residual, or it is one of rounding.

  Collective. The space is borrowed. -ksp_max_it limits the iterations of GMRES, and they are what the KSP reports. A residual
  that two corrections no longer halve fails the solve (KSP_DIVERGED_BREAKDOWN).
  Options read: -pressure_ksp_ (GMRES), -pressure_coarse_ (P1).
*/
PetscErrorCode SbPCPressureCreate(SbSpace space, PC pc);

/*
  z of [K + F^T k G, F^T; G, 0] [z; m] = [r; 0] by a factorisation, which is renewed when K or the constraints have changed; r is projected already. Collective.

  Output: failed, why the matrix could not be factored; z is not a number then.
*/
PetscErrorCode SbSaddleFactorSolve(SbSpace space, Vec r, Vec z, PCFailedReason *failed);
/* Negative eigenvalues of K + F^T k G in the null space of the constraints, from that factorisation; -1: it is unknown. Collective. */
PetscErrorCode SbSaddleFactorCountNegative(SbSpace space, PetscInt *negative);

/* Puts -<prefix><key> into PETSc's database where the user is silent. Not collective. */
PetscErrorCode SbSolverSetDefault(const char *prefix, const char *key, const char *value);

/* -reproducible: runs on the same number of ranks have the same bits. Not collective. */
PetscErrorCode SbSolverReproducible(PetscBool *reproducible);
