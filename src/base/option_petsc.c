/*
  option_petsc.c - values of PETSc's options that PETSc takes, and that cannot be meant: a relative
  tolerance of one or more, which any iterate meets; numbers that are negative or not numbers, which
  PETSc replaces or never meets; no iteration at all; a package that factors and is not there. With
  any prefix (-sub_, -mg_levels_, -contact_), read or not.

  An absolute tolerance has no upper bound that is known here: time/solve.c and time/solver_list.c
  warn of one that lets a run begin without an iteration.
*/
#include <petscmat.h>
#include "option.h"

/* Ranges as in the table of options; `alone`: only without a prefix, since inner solvers of
   multigrid may do nothing; `unlimited`: -1 is no limit. */
static const struct {
  const char *key, *range, *what;
  PetscBool alone, unlimited;
} ranges[] = {
  {"snes_rtol", "[0, 1)", "a part of the first residual", PETSC_FALSE, PETSC_FALSE},
  {"snes_stol", "[0, 1)", "the length of a step over that of the solution", PETSC_FALSE,
   PETSC_FALSE},
  {"snes_atol", "[0, inf)", "a residual, N", PETSC_FALSE, PETSC_FALSE},
  {"snes_max_it", "[1, inf)", "a number of iterations", PETSC_FALSE, PETSC_FALSE},
  {"ksp_rtol", "[0, 1)", "a part of the right-hand side", PETSC_FALSE, PETSC_FALSE},
  {"ksp_atol", "[0, inf)", "a residual", PETSC_FALSE, PETSC_FALSE},
  {"ksp_divtol", "(1, inf]", "a multiple of the right-hand side", PETSC_FALSE, PETSC_FALSE},
  {"snes_divergence_tolerance", "(1, inf]", "a multiple of the first residual", PETSC_FALSE,
   PETSC_TRUE},
  {"snes_max_funcs", "[1, inf)", "a number of evaluations", PETSC_FALSE, PETSC_TRUE},
  {"snes_linesearch_damping", "(0, 1]", "a part of a step", PETSC_FALSE, PETSC_FALSE},
  {"snes_linesearch_max_it", "[1, inf)", "a number of iterations", PETSC_FALSE, PETSC_FALSE},
  {"ksp_gmres_restart", "[1, inf)", "a number of directions", PETSC_FALSE, PETSC_FALSE},
  {"ksp_max_it", "[1, inf)", "a number of iterations", PETSC_TRUE, PETSC_FALSE},
  {"ts_rtol", "[0, 1)", "a part of the solution", PETSC_FALSE, PETSC_FALSE},
  {"ts_atol", "[0, inf)", "an error of a step", PETSC_FALSE, PETSC_FALSE},
  {"ts_adapt_safety", "(0, 1]", "a part of the next step", PETSC_FALSE, PETSC_FALSE},
  {"ts_adapt_dt_min", "[0, inf)", "a time step, s", PETSC_FALSE, PETSC_FALSE},
  {"ts_adapt_dt_max", "(0, inf]", "a time step, s", PETSC_FALSE, PETSC_FALSE},
};

/* Packages that PETSc may have, for suggestions. */
static const char *const packages[] = {
  MATSOLVERPETSC,        MATSOLVERMUMPS,   MATSOLVERCHOLMOD, MATSOLVERUMFPACK, MATSOLVERKLU,
  MATSOLVERSUPERLU_DIST, MATSOLVERSUPERLU, MATSOLVERPASTIX,  MATSOLVERSPQR,    MATSOLVERSTRUMPACK,
};

/* Whether a name is a key, or a key behind a prefix. */
static PetscBool has_key(const char *name, const char *key, PetscBool alone)
{
  const size_t n = strlen(name);
  const size_t length = strlen(key);

  if (n < length || strcasecmp(name + n - length, key))
    return PETSC_FALSE;
  return (PetscBool)(n == length || (!alone && name[n - length - 1] == '_'));
}

/* Whether x is in a range such as "[0, 1)"; NaN is in none. */
static PetscBool is_in(double x, const char *range)
{
  char open, close;
  double lo, hi;

  if (sscanf(range, "%c%lf,%lf%c", &open, &lo, &hi, &close) != 4)
    return PETSC_FALSE;
  return (PetscBool)((open == '[' ? x >= lo : x > lo) && (close == ']' ? x <= hi : x < hi));
}

/* Whether this PETSc has a package that factors. */
static PetscErrorCode has_package(const char *package, PetscBool *has)
{
  PetscFunctionBeginUser;
  PetscCall(MatSolverTypeGet(package, MATSEQAIJ, MAT_FACTOR_LU, has, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Raises the error of a package that this PETSc lacks, with those that it has. */
static PetscErrorCode check_package(const char *name, const char *value)
{
  const char *here[PETSC_STATIC_ARRAY_LENGTH(packages)];
  char near[SB_NAME_MAX];
  char list[256] = "";
  PetscInt n = 0;
  PetscBool has;

  PetscFunctionBeginUser;
  PetscCall(has_package(value, &has));
  if (has)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(packages); i++) {
    PetscCall(has_package(packages[i], &has));
    if (!has)
      continue;
    here[n++] = packages[i];
    SbAppend(sizeof(list), list, "%s%s", list[0] ? ", " : "", packages[i]);
  }
  SbSuggestNames(value, n, here, sizeof(near), near);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER,
          "-%s %s: this PETSc has no such package: choose one of %s, or leave it to -solver%s%s%s",
          name, value, list, near[0] ? " (did you mean " : "", near, near[0] ? "?)" : "");
}

PetscErrorCode SbOptionsCheckPetsc(void)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < SbTheOptions.nuser; i++) {
    const char *name = SbTheOptions.user[i].name;
    const char *value = SbTheOptions.user[i].value;
    double x;
    char *end;

    if (!value)
      continue;
    if (has_key(name, "pc_factor_mat_solver_type", PETSC_FALSE))
      PetscCall(check_package(name, value));

    // words, such as "unlimited", are PETSc's to read
    x = strtod(value, &end);
    if (end == value)
      continue;
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(ranges); k++)
      PetscCheck(!has_key(name, ranges[k].key, ranges[k].alone) || is_in(x, ranges[k].range) ||
                   (ranges[k].unlimited && x == -1.),
                 PETSC_COMM_SELF, PETSC_ERR_USER, "-%s %s is not in %s: it is %s", name, value,
                 ranges[k].range, ranges[k].what);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
