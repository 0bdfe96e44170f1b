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

/* ---- the table of solvers (preset.c) */

/* The row of the table, NULL if there is none. Not collective. */
const SbSolverPreset *SbSolverPresetFind(const char *name);

/* The row as a bit, for sets of rows; 0 for a row that a -pc_type gave. Not collective. */
uint32_t SbSolverPresetBit(const SbSolverPreset *preset);

/* The value of an option of PETSc in the row's options, "" if it has none. Not collective. */
void SbSolverPresetValue(const SbSolverPreset *preset, const char *option, char value[SB_NAME_MAX]);

/*
  SbSolverPresetOfUser - the row that an option of PETSc asks for.

  Not collective. Input: choice, the value of -solver. Output: preset, NULL if the user gives no
  such option; option, its name. Options read: -pc_type; -pc_factor_mat_solver_type where `choice`
  is auto, direct or a factorisation. Errors: PETSC_ERR_USER for a package that is in no row, where
  nothing else says that it factors.
*/
PetscErrorCode SbSolverPresetOfUser(const char *choice, const SbSolverPreset **preset,
                                    const char **option);

/* ---- constraints between nodes (contact_constraints.c) */

/*
  SbSolveConstrained - Y of M Y + C^T l = F', C Y - l / stiffness = goal, F' being F without the
  forces of rows at their goals.

  Collective. Input: M, symmetric; inner, a preconditioner of it; saddle, by the saddle-point
  system, else in the null space; weight, on the stiffness of rows. Output: Y, reason, iterations.
*/
PetscErrorCode SbSolveConstrained(Mat M, PC inner, PetscBool saddle, const SbConstraintRows *rows,
                                  PetscReal weight, Vec F, Vec Y, KSPConvergedReason *reason,
                                  PetscInt *iterations);
