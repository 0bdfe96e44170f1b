/*
  The table of the linear solvers: name, matrix type, options for PETSc, and the preconditioners of
  our own. To add a solver is to add a row here and its name to the option -solver below.

  A -pc_type of the user other than the row's replaces the row: `by_type` gives the matrix type. The
  Krylov method is then CG, or that of -ksp_type.

  Gauss-Seidel and SOR are wrapped in a PCCOMPOSITE with one member: a bare PCSOR takes over
  Richardson's loop and does the maximum number of sweeps without testing the residual.
*/
#include "sbfactor.h"
#include "sbpc.h"
#include "solver_impl.h"

static PetscErrorCode create_frames(SbSpace s, Mat *A)
{
  PetscBool frames;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceAllowsMatrixFree(s, &frames));
  PetscCheck(
    frames, s->comm, PETSC_ERR_USER,
    "-solver realtime is for -mass lumped, the elements p1 and p2 with straight edges, and the "
    "materials linear, and corotated with -body_<name>_tangent warped and without "
    "active_tension, growth and temperature: choose these, or -solver rotated");
  PetscCall(SbSpaceCreateMatrixFree(s, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The names are explained at the option below. */
static const SbSolverPreset presets[] = {
  {"cg", SB_MATRIX_BAIJ, .options = "-ksp_type cg -pc_type none"},
  {"cg_jacobi", SB_MATRIX_BAIJ, .options = "-ksp_type cg -pc_type jacobi"},
  {"cg_pbjacobi", SB_MATRIX_BAIJ, .options = "-ksp_type cg -pc_type pbjacobi"},
  {"cg_icc", SB_MATRIX_SBAIJ,
   .options =
     "-ksp_type cg -pc_type bjacobi -sub_pc_type icc -sub_pc_factor_shift_type positive_definite"},
  {"cg_ssor", SB_MATRIX_AIJ, .options = "-ksp_type cg -pc_type sor -pc_sor_local_symmetric"},
  {"cg_two_level", SB_MATRIX_SBAIJ, "-ksp_type cg", .precondition = SbPCTwoLevelCreate},
  {"cg_p_multigrid", SB_MATRIX_SBAIJ, "-ksp_type cg", .precondition = SbPCPMultigridCreate},
  {"cg_gamg", SB_MATRIX_AIJ, .options = "-ksp_type cg -pc_type gamg"},
  {"cg_hypre", SB_MATRIX_AIJ,
   "-ksp_type cg -pc_type hypre -pc_hypre_type boomeramg -pc_hypre_boomeramg_strong_threshold 0.5",
   .package = "hypre"},
  /* these two are block Jacobi between ranks */
  {"gauss_seidel", SB_MATRIX_AIJ,
   .options = "-ksp_type richardson -pc_type composite -pc_composite_pcs sor -sub_0_pc_sor_omega 1 "
              "-ksp_max_it 100000"},
  {"sor", SB_MATRIX_AIJ,
   .options =
     "-ksp_type richardson -pc_type composite -pc_composite_pcs sor -sub_0_pc_sor_omega 1.6 "
     "-ksp_max_it 100000"},
  {"cholmod", SB_MATRIX_AIJ, "-ksp_type cg", .package = MATSOLVERCHOLMOD, .direct = PETSC_TRUE},
  {"umfpack", SB_MATRIX_AIJ, "-ksp_type fgmres", .package = MATSOLVERUMFPACK, .direct = PETSC_TRUE},
  {"mumps", SB_MATRIX_AIJ, "-ksp_type fgmres", .package = MATSOLVERMUMPS, .direct = PETSC_TRUE},
  {"rotated", SB_MATRIX_BAIJ, "-ksp_type cg", .precondition = SbPCRotatedCreate},
  /* fastest with -snes_type ksponly and -ksp_rtol 1e-4 */
  {"realtime", SB_MATRIX_BAIJ, "-ksp_type cg -ksp_initial_guess_nonzero", .matrix_free = PETSC_TRUE,
   .create = create_frames, .precondition = SbPCRotatedCreate},
  {"pressure", SB_MATRIX_BAIJ, "-ksp_type richardson -ksp_max_it 300",
   .create = SbPressureOperatorCreate, .precondition = SbPCPressureCreate},
};

/* Matrix types and options for preconditioners of -pc_type. The last row: all others. */
static const SbSolverPreset by_type[] = {
  {PCNONE, SB_MATRIX_BAIJ, "-ksp_type cg", .by_type = PETSC_TRUE},
  {PCJACOBI, SB_MATRIX_BAIJ, "-ksp_type cg", .by_type = PETSC_TRUE},
  {PCPBJACOBI, SB_MATRIX_BAIJ, "-ksp_type cg", .by_type = PETSC_TRUE},
  {PCICC, SB_MATRIX_SBAIJ, "-ksp_type cg", .by_type = PETSC_TRUE},
  {PCBJACOBI, SB_MATRIX_AIJ, "-ksp_type cg -sub_pc_factor_shift_type positive_definite",
   .by_type = PETSC_TRUE},
  {PCASM, SB_MATRIX_AIJ, "-ksp_type cg -sub_pc_factor_shift_type positive_definite",
   .by_type = PETSC_TRUE},
  {PCSOR, SB_MATRIX_AIJ, "-ksp_type cg -pc_sor_local_symmetric", .by_type = PETSC_TRUE},
  {PCHYPRE, SB_MATRIX_AIJ, "-ksp_type cg", .package = "hypre", .by_type = PETSC_TRUE},
  {"", SB_MATRIX_AIJ, "-ksp_type cg", .by_type = PETSC_TRUE},
};

const SbOption SbSolverRows[] = {
  {"solver", SB_OPTION_CHOICE, 1, "", "auto",
   "auto|direct|cg|cg_jacobi|cg_pbjacobi|cg_icc|cg_ssor|cg_two_level|cg_p_multigrid|cg_gamg|"
   "cg_hypre|gauss_seidel|sor|cholmod|umfpack|mumps|rotated|realtime|pressure",
   "linear solver. auto: chosen by size, ranks and material, and reported; direct: the fastest "
   "factorisation that this PETSc has; cg_...: conjugate gradients, preconditioned by Jacobi, "
   "point-block Jacobi, incomplete Cholesky, SSOR, two levels with rigid-body modes as coarse "
   "space, p-multigrid (p2), GAMG or BoomerAMG; gauss_seidel, sor: stationary iterations by "
   "blocks, or PETSc's; cholmod, umfpack, mumps: factorisations; rotated: CG with a Cholesky "
   "factor in low precision, computed once and rotated with the nodes from then on; realtime: the "
   "same without a matrix and warm-started, for p1 and p2, linear and corotated; pressure: GMRES "
   "with the pressures of cells as unknowns, for P2, CR and DG near incompressibility. PETSc's "
   "-ksp_ and -pc_ options refine it"},
  {"reproducible", SB_OPTION_BOOL, 1, "", "false", "",
   "bitwise identical results of every run on the same number of ranks: matrices are factored on "
   "one rank, and never by MUMPS or SuperLU_DIST, whose order of summation depends on the arrival "
   "of messages"},
  {0},
};

PetscErrorCode SbSolverSetFromOptions(char choice[], size_t size)
{
  const char *name = "auto";
  int index;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(&SbRunScope, "solver", &index));
  PetscCall(SbOptionCheckEarly(&SbRunScope, "reproducible"));

  /* the values of -solver: auto, direct, then the rows of the table in their order */
  if (index == 1)
    name = "direct";
  if (index > 1)
    name = presets[index - 2].name;
  PetscCall(PetscStrncpy(choice, name, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

const SbSolverPreset *SbSolverPresetFind(const char *name)
{
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(presets); k++)
    if (!strcmp(presets[k].name, name))
      return &presets[k];
  return NULL;
}

uint32_t SbSolverPresetBit(const SbSolverPreset *preset)
{
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(presets); k++)
    if (&presets[k] == preset)
      return 1U << k;
  return 0;
}

void SbSolverPresetValue(const SbSolverPreset *preset, const char *option, char value[SB_NAME_MAX])
{
  const char *at = strstr(preset->options, option);

  at = at ? at + strlen(option) + 1 : "";
  SbFormat(SB_NAME_MAX, value, "%.*s", (int)strcspn(at, " "), at);
}

PetscErrorCode SbSolverPresetOfUser(const char *choice, const SbSolverPreset **preset,
                                    const char **option)
{
  const SbSolverPreset *base = SbSolverPresetFind(choice);
  char type[SB_NAME_MAX], own[SB_NAME_MAX];
  PetscBool given;

  PetscFunctionBeginUser;
  *preset = NULL;

  /* -pc_type: the row of -solver if that has this type, else the row of the type */
  *option = "-pc_type";
  PetscCall(PetscOptionsGetString(NULL, NULL, *option, type, sizeof(type), &given));
  if (given) {
    if (base) {
      SbSolverPresetValue(base, "-pc_type", own);
      if (!strcmp(own, type))
        *preset = base;
    }
    for (size_t k = 0; !*preset; k++)
      if (!strcmp(by_type[k].name, type) || !by_type[k].name[0])
        *preset = &by_type[k];
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* the package of a factorisation, unless -solver names an iteration */
  *option = "-pc_factor_mat_solver_type";
  if (base && !base->direct)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsGetString(NULL, NULL, *option, type, sizeof(type), &given));
  if (given)
    *preset = SbSolverPresetFind(type);
  if (*preset && !(*preset)->direct)
    *preset = NULL;
  PetscCheck(
    !given || *preset || base, PETSC_COMM_SELF, PETSC_ERR_USER,
    "%s %s is none of the packages that -solver %s chooses from, which are cholmod, umfpack "
    "and mumps: add -pc_type lu, or cholesky where it has that",
    *option, type, choice);
  PetscFunctionReturn(PETSC_SUCCESS);
}
