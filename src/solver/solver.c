/*
  Linear solvers by name. Each is a table row with PETSc options, set in the options database unless
  the user set them, so that everything stays adjustable by PETSc's own options, and the matrix type
  that its preconditioner needs.

  A -pc_type of the user other than the row's replaces the row: `by_type` gives the matrix type. The
  Krylov method is then CG, or that of -ksp_type. SbSolverFinish() reports unsupported combinations
  as errors before anything is computed.

  The convergence test uses the true residual wherever the method computes it: the preconditioned
  norm can be off by orders of magnitude for nearly incompressible bodies. Gauss-Seidel and SOR are
  wrapped in a PCCOMPOSITE with one member: a bare PCSOR takes over Richardson's loop and does the
  maximum number of sweeps without testing the residual. A solve that does not reach its tolerance
  fails; the next solver of a list is then tried on the same system (time/solver_list.c), and only
  if all fail is the step halved or the run stopped.
*/
#include "sbpc.h"
#include "solver_impl.h"

#define RESTART 100 /* restart length of FGMRES */
/* Thresholds from docs/reports/solver_choice.md. Largest number of unknowns for ... */
#define ROTATED 60000          /* the rotated factorisation */
#define ROTATED_SLIVERS 120000 /* the same, with slivers and nu up to NU_SLIVERS */
#define DIRECT_P1 80000 /* a factorisation for P1, from nu = NU_LOCKED on: faster than iterations */
#define P_MULTIGRID 5000 /* a factorisation for P2, up to nu = NU_SLIVERS: as fast as p-multigrid */
#define DIRECT_NEXT \
  200000 /* a factorisation with slivers from NU_PRESSURE on, or as first fallback */
/* Poisson's ratio ... */
#define NU_PRESSURE 0.45 /* from which on dynamic CR, too, has the pressures as unknowns */
#define NU_SLIVERS 0.49
#define NU_LOCKED 0.4995
#define NU_ROTATED 0.4999 /* up to which the rotated factorisation is used for CR and DG */
#define SLIVERS 0.001     /* fraction of the tets from which on slivers matter */

static PetscErrorCode create_frames(SbSpace s, Mat *A)
{
  PetscBool frames;

  PetscFunctionBeginUser;
  PetscCall(SbSpaceAllowsMatrixFree(s, &frames));
  PetscCheck(
    frames, s->comm, PETSC_ERR_USER,
    "-solver realtime is for -mass lumped, the elements p1 and p2 with straight edges, and the "
    "materials "
    "linear, and corotated with -body_<name>_tangent warped: choose these, or -solver rotated");
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
   "auto|direct|cg|cg_jacobi|cg_pbjacobi|cg_icc|cg_ssor|cg_two_level|cg_p_multigrid|cg_gamg|cg_"
   "hypre|"
   "gauss_seidel|sor|cholmod|umfpack|mumps|rotated|realtime|pressure",
   "linear solver. auto: chosen by size, ranks and material, and reported; direct: the fastest "
   "factorisation "
   "that this PETSc has; cg_...: conjugate gradients, preconditioned by Jacobi, point-block "
   "Jacobi, "
   "incomplete Cholesky, SSOR, two levels with rigid-body modes as coarse space, p-multigrid (p2), "
   "GAMG or "
   "BoomerAMG; gauss_seidel, sor: stationary iterations by blocks, or PETSc's; cholmod, umfpack, "
   "mumps: "
   "factorisations; rotated: CG with a Cholesky factor in low precision, computed once and rotated "
   "with the "
   "nodes from then on; realtime: the same without a matrix and warm-started, for p1 and p2, "
   "linear and "
   "corotated; pressure: GMRES with the pressures of cells as unknowns, for P2, CR and DG near "
   "incompressibility. PETSc's -ksp_ and -pc_ options refine it"},
  {"reproducible", SB_OPTION_BOOL, 1, "", "false", "",
   "bitwise identical results of every run on the same number of ranks: matrices are factored on "
   "one rank, "
   "and never by MUMPS or SuperLU_DIST, whose order of summation depends on the arrival of "
   "messages"},
  {0},
};

PetscErrorCode SbSolverSetFromOptions(char choice[], size_t size)
{
  int index;

  PetscFunctionBeginUser;
  PetscCall(SbOptionChoice(&SbRunScope, "solver", &index));
  PetscCall(SbOptionCheckEarly(&SbRunScope, "reproducible"));

  /* choice 0 is auto, 1 is direct, then follow the rows of the table */
  PetscCall(PetscStrncpy(choice,
                         index > 1 ? presets[index - 2].name
                         : index   ? "direct"
                                   : "auto",
                         size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static const SbSolverPreset *find_preset(const char *name)
{
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(presets); k++)
    if (!strcmp(presets[k].name, name))
      return &presets[k];
  return NULL;
}

/* Value of an option in a preset's option string, "" if it has none. */
static void preset_value(const SbSolverPreset *preset, const char *name, char value[SB_NAME_MAX])
{
  const char *at = strstr(preset->options, name);

  at = at ? at + strlen(name) + 1 : "";
  SbFormat(SB_NAME_MAX, value, "%.*s", (int)strcspn(at, " "), at);
}

/* Properties of the bodies that make systems hard to solve. */
typedef struct {
  PetscReal nu, face_nu; /* largest Poisson's ratio; that of bodies with nodes at faces, -1: none */
  PetscReal sliver_part; /* fraction of tets with an angle below SB_SLIVER */
  PetscBool slivers;     /* sliver_part is above SLIVERS */
  PetscBool dg;          /* some element has its nodes in one cell only (DG) */

  /* Some law always uses its exact tangent, which is indefinite in compression, so that CHOLMOD
     fails. Where Newton's method chooses the tangent (auto), such a failure makes it project the
     cells' tangents. */
  PetscBool indefinite;
} Hardness;

static PetscErrorCode find_hardness(SbSpace s, Hardness *h)
{
  PetscReal most[4] = {-1., -1., 0., 0.};
  PetscInt nsliver = 0;
  PetscInt ncell = 0;

  PetscFunctionBeginUser;
  for (PetscInt r = 0; r < s->nregion; r++) {
    const PetscInt *per = s->region[r].element->nodes_per;
    const SbMaterial m = s->region[r].material;

    most[0] = PetscMax(most[0], m->nu);
    if (!per[0])
      most[1] = PetscMax(most[1], m->nu);
    if (per[3])
      most[2] = 1.;
    if (!m->linear && !m->adaptive && m->tangent == SB_TANGENT_EXACT)
      most[3] = 1.;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 4, MPIU_REAL, MPI_MAX, s->comm));
  for (PetscInt b = 0; b < s->mesh->nbody; b++) {
    nsliver += s->mesh->body[b].nsliver;
    ncell += s->mesh->body[b].ncell;
  }
  h->nu = most[0];
  h->face_nu = most[1];
  h->sliver_part = (PetscReal)nsliver / (PetscReal)PetscMax(1, ncell);
  h->slivers = (PetscBool)(h->sliver_part >= SLIVERS);
  h->dg = (PetscBool)(most[2] > 0.);
  h->indefinite = (PetscBool)(most[3] > 0.);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the preset for a PETSc option of the user, *option. -pc_type: that of -solver if it has
   this type, else one of by_type. -pc_factor_mat_solver_type, if -solver is auto or direct: that of
   the package. NULL: the user set neither. */
static PetscErrorCode find_type(const char *choice, const SbSolverPreset **preset,
                                const char **option)
{
  const SbSolverPreset *base = find_preset(choice);
  char type[SB_NAME_MAX], own[SB_NAME_MAX];
  PetscBool given;

  PetscFunctionBeginUser;
  *preset = NULL;
  *option = "-pc_type";
  PetscCall(PetscOptionsGetString(NULL, NULL, *option, type, sizeof(type), &given));
  if (!given && (!base || base->direct)) {
    *option = "-pc_factor_mat_solver_type";
    PetscCall(PetscOptionsGetString(NULL, NULL, *option, type, sizeof(type), &given));
    if (given)
      *preset = find_preset(type);
    if (*preset && !(*preset)->direct)
      *preset = NULL;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!given)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (base) {
    preset_value(base, "-pc_type", own);
    *preset = strcmp(own, type) ? NULL : base;
  }
  for (size_t k = 0; !*preset; k++)
    if (!strcmp(by_type[k].name, type) || !by_type[k].name[0])
      *preset = &by_type[k];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverChoose(SbSpace s, PetscBool dynamic, PetscBool linear,
                              PetscBool explicit_run, const char *choice,
                              const SbSolverPreset **preset, char reason[], size_t size)
{
  const PetscInt unknowns = 3 * s->Nnode;
  const char *name = choice;
  const char *package;
  const char *option = NULL;
  char method[SB_NAME_MAX] = "";
  char count[48], system[64];
  PetscInt nface = 0;
  PetscInt most = 0;
  PetscBool has = PETSC_TRUE;
  PetscBool turns;
  Hardness hard;

  PetscFunctionBeginUser;
  PetscCall(find_hardness(s, &hard));
  PetscCall(SbDirectPackage(s->comm, unknowns, (PetscBool)!hard.indefinite, &package));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-ksp_type", method, sizeof(method), NULL));
  *preset = NULL;
  if (!explicit_run)
    PetscCall(find_type(choice, preset, &option));

  /* rotated factorisation, unless too many nodes are on interfaces between ranks */
  turns = (PetscBool)(!strcmp(choice, "rotated") || !strcmp(choice, "realtime"));
  if (!strcmp(choice, "auto"))
    turns =
      (PetscBool)(dynamic && !linear && hard.face_nu <= NU_ROTATED && strcmp(method, KSPMINRES) &&
                  unknowns <= (hard.slivers && hard.nu <= NU_SLIVERS ? ROTATED_SLIVERS : ROTATED));
  if (*preset)
    turns = PETSC_FALSE;
  if (turns && s->ghosted && !explicit_run)
    PetscCall(SbSpaceInterfaceSize(s, &nface, &most));
  if (nface > most) {
    if (strcmp(choice, "auto"))
      PetscCall(SbWarning(s->comm,
                          "-solver %s is for parts of ranks that meet at %" PetscInt_FMT
                          " nodes at most (-pc_rotated_interface), and these meet at %" PetscInt_FMT
                          ": another solver is taken; fewer ranks may be faster",
                          choice, most, nface));
    turns = PETSC_FALSE;
    choice = "auto";
  }
  SbFormat(sizeof(count), count, "%" PetscInt_FMT " unknowns", unknowns);
  SbFormat(sizeof(system), system, "%s, %s", dynamic ? "dynamic" : "static", count);
  if (explicit_run) {
    name = "cg";
    SbFormat(size, reason, "explicit integrator: no linear system");
  } else if (*preset) {
    SbFormat(size, reason, "chosen by %s", option);
  } else if (!strcmp(choice, "direct")) {
    PetscCheck(
      package, s->comm, PETSC_ERR_USER,
      "-solver direct needs SuiteSparse or MUMPS, and this PETSc was built without both: choose "
      "another solver, or auto");
    name = package;
    SbFormat(size, reason, "the factorisation for %s on %d rank%s%s", count, (int)s->size,
             s->ghosted ? "s" : "", hard.indefinite ? "; the exact tangent may be indefinite" : "");
  } else if (strcmp(choice, "auto")) {
    SbFormat(size, reason, "chosen by -solver");
  } else if (turns) {
    /* 51k unknowns of CR, 36k of DG, nu 0.4: ms per step of rotated and cg_two_level 22 and 89, 22
       and 94 on two ranks, 12 and 50, 16 and 76 on four (docs/reports/realtime_ranks.md). Ten steps
       of 1.3k to 2.3k unknowns, linear iterations of rotated and pressure, DG: 1150 and 1478 at nu
       0.4999, 14521 and 1652 at 0.49999, 634312 and 4348 at 0.499999 */
    name = "rotated";
    SbFormat(size, reason, "%s: one factorisation, rotated with the nodes, serves many steps",
             system);
  } else if (s->edge_node && !s->faces && hard.nu <= (hard.slivers ? NU_PRESSURE : NU_SLIVERS) &&
             unknowns > (hard.indefinite || hard.slivers ? SB_DIRECT_SMALL : P_MULTIGRID)) {
    /* measured in docs/reports/solver_choice.md */
    name = "cg_p_multigrid";
    SbFormat(size, reason,
             "%s of p2, nu up to %g: with P1 on the vertices below it iterations do not grow with "
             "the mesh",
             system, (double)hard.nu);
  } else if (unknowns <= SB_DIRECT_SMALL && package && !(nface > most && hard.nu <= NU_PRESSURE)) {
    /* 28k unknowns of P1 on 16 ranks, dynamic, ms per step of mumps and cg_two_level: 300 to 450
       and 50 (docs/reports/realtime_ranks.md) */
    name = package;
    SbFormat(size, reason, "%s: a factorisation is fast and works at any Poisson's ratio%s", count,
             hard.indefinite ? "; the exact tangent may be indefinite" : "");
  } else if (!dynamic && package &&
             unknowns <= (hard.nu > NU_PRESSURE && hard.slivers               ? DIRECT_NEXT
                          : s->edge_node && !s->faces && hard.nu > NU_SLIVERS ? DIRECT_NEXT
                          : !s->faces && hard.nu > NU_LOCKED                  ? DIRECT_P1
                                                                              : 0)) {
    /* measured in docs/reports/solver_choice.md */
    name = package;
    SbFormat(
      size, reason,
      "%s, nu up to %g, %.2g %% of the tets slivers (angles below %g degrees): a factorisation, "
      "iterations hardly get there",
      count, (double)hard.nu, 100. * (double)hard.sliver_part, SB_SLIVER);
  } else if (!s->constraints && !s->coupled &&
             (s->edge_node ? !s->faces && hard.nu > NU_SLIVERS
                           : s->faces && (hard.face_nu > NU_PRESSURE ||
                                          (!hard.slivers && (!dynamic || hard.dg))))) {
    /* docs/reports/solver_choice.md; 24k tets of CR, dynamic, CPU s of pressure and cg_two_level at
       nu 0.3 12 and 7, at 0.45 15 and 11, at 0.49 17 and 17 */
    name = "pressure";
    SbFormat(
      size, reason,
      "%s of %s, nu up to %g: with the pressures as unknowns iterations hardly grow towards 1/2",
      system, s->edge_node ? "p2" : "cr or dg", (double)(s->edge_node ? hard.nu : hard.face_nu));
  } else {
    /* 192k tets, CPU s of cg_two_level on one rank. Static: 0.36 (cg_gamg 1.7, cg_icc 1.4), at nu
       0.45 0.7 (2.3), at 0.499 4.2 (18); dynamic, h = 0.01 s: 0.22 (1.7, 0.40) */
    name = s->edge_node && !s->faces ? "cg_p_multigrid" : "cg_two_level";
    SbFormat(size, reason,
             "%s: motions of large parts are solved directly, the rest takes few iterations",
             system);
  }
  if (nface > most)
    SbAppend(size, reason,
             "; %d ranks meet at %" PetscInt_FMT
             " nodes, and rotated and realtime take %" PetscInt_FMT,
             (int)s->size, nface, most);
  if (!*preset)
    *preset = find_preset(name);
  PetscCheck(*preset, s->comm, PETSC_ERR_PLIB, "No solver preset %s", name);
  if ((*preset)->package)
    PetscCall(SbHasPackage((*preset)->package, &has));
  PetscCheck(
    has, s->comm, PETSC_ERR_USER,
    "%s %s needs %s, which this PETSc was built without: choose another one, or -solver auto",
    option && *preset ? option : "-solver", (*preset)->name, (*preset)->package);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverNextFallback(SbSpace s, KSPConvergedReason reason, PetscBool memory,
                                    uint32_t *tried, const SbSolverPreset **preset)
{
  /* in the order of trial, up to a number of unknowns: a factorisation fails rarely but costs
     most */
  static const struct {
    const char *name;
    PetscInt most;
  } others[] = {{"direct", DIRECT_NEXT},
                {"pressure", PETSC_MAX_INT},
                {"cg_gamg", PETSC_MAX_INT},
                {"direct", PETSC_MAX_INT}};
  const SbSolverPreset *failed = *preset;
  Hardness hard;

  PetscFunctionBeginUser;
  *preset = NULL;
  PetscCall(find_hardness(s, &hard));
  if (find_preset(failed->name) == failed)
    *tried |= 1U << (failed - presets);

  /* where the tangent may be indefinite, Newton's method changes it, and no other solver is
     tried */
  if (hard.indefinite && reason == KSP_DIVERGED_INDEFINITE_MAT)
    PetscFunctionReturn(PETSC_SUCCESS);
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(others) && !*preset; k++) {
    const PetscBool direct = (PetscBool)!strcmp(others[k].name, "direct");

    if (3 * s->Nnode > others[k].most || (memory && direct))
      continue;

    /* algebraic multigrid takes thousands of iterations on CR and DG near nu = 1/2 */
    if (!strcmp(others[k].name, "cg_gamg") && hard.face_nu > NU_PRESSURE)
      continue;

    /* a matrix that is singular for a factorisation is singular for iterations */
    if (failed->direct && !memory && !direct)
      continue;

    /* one that has not failed yet; a factorisation for definite matrices, then one for indefinite
       ones, which stress or rounding may cause */
    for (int j = direct ? (int)hard.indefinite : 1; j < 2 && !*preset; j++) {
      const char *name = others[k].name;

      if (direct)
        PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, (PetscBool)!j, &name));
      if (name)
        *preset = find_preset(name);
      if (*preset && (*tried) & 1U << (*preset - presets))
        *preset = NULL;
    }
    if (*preset && (*preset)->create && (!s->faces == !s->edge_node || s->constraints))
      *preset = NULL;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverCreateOperator(SbSpace s, const SbSolverPreset *preset, Mat *A)
{
  SbMatrixKind kind = preset->matrix;

  PetscFunctionBeginUser;

  /* PETSc's block ICC has no shift, and breaks down for CR and DG with any tangent; P1 needs no
     shift, and its block ICC takes two fifths less time than the scalar one */
  if (kind == SB_MATRIX_SBAIJ && !preset->precondition && s->faces)
    kind = SB_MATRIX_AIJ;
  if (kind == SB_MATRIX_SBAIJ && s->ghosted)
    kind = SB_MATRIX_BAIJ;
  if (preset->create)
    PetscCall(preset->create(s, A));
  else
    PetscCall(SbSpaceCreateMatrix(s, kind, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The package where the user names neither one nor -solver: PETSc's default ignores size and
   ranks. */
static PetscErrorCode choose_package(SbSpace s, PC pc, const char *type)
{
  const PetscBool lu = (PetscBool)!strcmp(type, PCLU);
  const char *package;
  PetscBool has;
  Hardness hard;

  PetscFunctionBeginUser;
  PetscCall(find_hardness(s, &hard));
  PetscCall(SbDirectPackage(s->comm, 3 * s->Nnode, (PetscBool)(!lu && !hard.indefinite), &package));
  if (s->ghosted) {
    /* on several ranks, MUMPS for any other matrix type */
    package = MATSOLVERMUMPS;
    PetscCall(SbHasPackage(package, &has));
    if (!has && lu)
      package = MATSOLVERSUPERLU_DIST;
    if (!has)
      PetscCall(SbHasPackage(package, &has));
    if (!has)
      package = NULL;
  } else if (package && !lu && !strcmp(package, MATSOLVERUMFPACK))
    package = NULL;
  if (package)
    PetscCall(PCFactorSetMatSolverType(pc, package));
  if (package && !strcmp(package, MATSOLVERMUMPS))
    PetscCall(
      SbOptionsSetDefaults("", "-mat_mumps_icntl_13 1 -mat_mumps_icntl_14 100", PETSC_FALSE));

  /* a non-positive pivot appears as a reason of the solve, not as an error */
  if (package && !strcmp(package, MATSOLVERCHOLMOD))
    PetscCall(SbOptionsSetDefaults("", "-mat_cholmod_print 0", PETSC_FALSE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the Krylov method is for symmetric systems only. */
static PetscErrorCode is_symmetric(KSP ksp, PetscBool *is)
{
  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, is, KSPCG, KSPFCG, KSPMINRES, KSPPIPECG,
                                      KSPPIPEFCG, KSPGROPPCG, KSPCR, KSPSYMMLQ, ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverSetUp(SNES snes, SbSpace s, const SbSolverPreset *preset)
{
  char method[SB_NAME_MAX], type[SB_NAME_MAX], users[SB_NAME_MAX];
  PetscBool given, symmetric, reproducible;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;

  /* algebraic multigrid sums its coarse matrices in the order in which messages arrive */
  PetscCall(SbOptionBool(&SbRunScope, "reproducible", &reproducible));
  if (reproducible && s->ghosted)
    PetscCall(
      SbOptionsSetDefaults("", "-matptap_via allatonce -matstash_reproduce yes", PETSC_FALSE));
  PetscCall(SNESGetKSP(snes, &ksp));
  if (s->constraints && s->constraints->general) { /* each solver starts from the original method */
    PetscCall(KSPSetNormType(ksp, s->constraints->norm));
    PetscCall(KSPSetPCSide(ksp, s->constraints->side));
    s->constraints->general = PETSC_FALSE;
  }
  PetscCall(KSPGetPC(ksp, &pc));

  /* the residual norm of CG in a null space may grow far before it decreases */
  PetscCall(KSPSetTolerances(ksp, 1e-8, PETSC_DEFAULT,
                             SbConstraintsSeparate(s) ? 1e10 : PETSC_DEFAULT, 5000));
  PetscCall(SbPCConstrainedCreate(s, pc, &pc));

  /* the preset's types, or those of the user */
  preset_value(preset, "-ksp_type", method);
  preset_value(preset, "-pc_type", type);
  PetscCall(PetscOptionsGetString(NULL, NULL, "-pc_type", type, sizeof(type), NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-ksp_type", users, sizeof(users), &given));
  PetscCall(KSPSetType(ksp, given ? users : method));
  PetscCall(is_symmetric(ksp, &symmetric));
  if (type[0])
    PetscCall(PCSetType(pc, type));

  /* variants that keep the preconditioner symmetric */
  if (symmetric && !strcmp(type, PCASM))
    PetscCall(SbOptionsSetDefaults("", "-pc_asm_type basic", PETSC_FALSE));
  if (symmetric && !strcmp(type, PCCOMPOSITE))
    PetscCall(SbOptionsSetDefaults("", "-sub_0_pc_sor_local_symmetric", PETSC_FALSE));

  /* PETSc keeps the eigenvalue estimate of the first matrix, too small once contact stiffness is
     added */
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &given));
  if (!given && !strcmp(type, PCGAMG))
    PetscCall(SbOptionsSetDefaults("", "-pc_gamg_use_sa_esteig no", PETSC_FALSE));
  PetscCall(SbOptionsSetDefaults("", preset->options, PETSC_FALSE));
  if (!strcmp(type, PCLU) || !strcmp(type, PCCHOLESKY))
    PetscCall(choose_package(s, pc, type));
  if (preset->direct)
    PetscCall(SbPCDirectSet(pc, preset->package, PETSC_TRUE));
  if (preset->precondition)
    PetscCall(preset->precondition(s, pc));
  PetscCall(SbKSPPreferTrueResidual(ksp));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverUpdateSymmetry(KSP ksp, SbSpace s)
{
  PetscInt restart = RESTART;
  PetscBool symmetric;
  SbConstraints c = s->constraints;
  KSPType type;

  PetscFunctionBeginUser;
  if (!c || !c->nonsymmetric || c->general == c->tilted)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(is_symmetric(ksp, &symmetric));
  if (!symmetric && !c->general)
    PetscFunctionReturn(PETSC_SUCCESS); /* handles nonsymmetric systems */
  if (symmetric) {
    PetscCall(KSPGetType(ksp, &type));
    PetscCall(PetscStrncpy(c->method, type, sizeof(c->method)));
    PetscCall(KSPGetNormType(ksp, &c->norm));
    PetscCall(KSPGetPCSide(ksp, &c->side));
  }
  PetscCall(KSPSetType(ksp, symmetric ? KSPFGMRES : c->method));
  PetscCall(KSPSetNormType(ksp, symmetric && c->norm != KSP_NORM_NONE ? KSP_NORM_UNPRECONDITIONED
                                                                      : c->norm));
  PetscCall(KSPSetPCSide(ksp, symmetric ? PC_RIGHT : c->side));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-ksp_gmres_restart", &restart, NULL));
  if (symmetric)
    PetscCall(KSPGMRESSetRestart(ksp, restart));
  c->general = symmetric;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors for a factorisation that the matrix type, the number of ranks or -reproducible rules
   out. */
static PetscErrorCode check_factor(SbSpace s, PC pc, Mat A)
{
  static const struct {
    PCType type;
    MatFactorType kind;
    const char *advice;
  } of[] = {
    {PCLU, MAT_FACTOR_LU, "-solver direct, or an iteration: -pc_type gamg"},
    {PCCHOLESKY, MAT_FACTOR_CHOLESKY, "-solver direct, or an iteration: -pc_type gamg"},
    {PCICC, MAT_FACTOR_ICC, "-pc_type bjacobi -sub_pc_type icc, which does it on each rank"},
    {PCILU, MAT_FACTOR_ILU, "-pc_type bjacobi -sub_pc_type ilu, which does it on each rank"},
  };
  MatSolverType package;
  PetscBool is, has, distributed, reproducible;

  PetscFunctionBeginUser;
  PetscCall(SbOptionBool(&SbRunScope, "reproducible", &reproducible));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &distributed, PCLU, PCCHOLESKY, ""));
  PetscCheck(
    !reproducible || !s->ghosted || !distributed, s->comm, PETSC_ERR_USER,
    "-reproducible: a factorisation on %d ranks has other last digits in each run; choose -solver "
    "direct, which factors on one of them",
    (int)s->size);
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(of); i++) {
    PetscCall(PetscObjectTypeCompare((PetscObject)pc, of[i].type, &is));
    if (!is)
      continue;
    PetscCall(PCFactorGetMatSolverType(pc, &package));
    PetscCall(MatGetFactorAvailable(A, package, of[i].kind, &has));
    PetscCheck(has, s->comm, PETSC_ERR_USER,
               "-pc_type %s%s%s has no factorisation on %d rank%s in this PETSc: choose %s",
               of[i].type, package ? " -pc_factor_mat_solver_type " : "", package ? package : "",
               (int)s->size, s->ghosted ? "s" : "", of[i].advice);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Errors for a single application of a preconditioner that is no solver, and for MINRES with a
   preconditioner that is symmetric to single precision only. */
static PetscErrorCode check_method(SbSpace s, KSP ksp, PC pc, const SbSolverPreset *preset,
                                   PetscBool *direct)
{
  PetscBool single, parts, minres;
  char sub[SB_NAME_MAX] = "";
  const char *package;
  PCType type;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPMINRES, &minres));
  PetscCheck(
    !minres || preset->precondition != SbPCRotatedCreate, s->comm, PETSC_ERR_USER,
    "-ksp_type minres does not converge with the single precision of -solver %s: choose -ksp_type "
    "cg, or another -solver",
    preset->name);
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &single));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, direct, PCLU, PCCHOLESKY, PCQR, PCSVD,
                                      PCREDUNDANT, ""));
  PetscCall(SbPCDirectGathered(pc, &package));
  if (package)
    *direct = PETSC_TRUE;
  if (!single)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &parts, PCBJACOBI, PCASM, ""));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-sub_pc_type", sub, sizeof(sub), NULL));
  parts = (PetscBool)(parts && (!strcmp(sub, PCLU) || !strcmp(sub, PCCHOLESKY)));
  PetscCall(PCGetType(pc, &type));
  PetscCheck(
    *direct || parts, s->comm, PETSC_ERR_USER,
    "-ksp_type preonly takes the preconditioner for the inverse, which %s %s is not: choose "
    "-pc_type cholesky or lu, or a -ksp_type that iterates (cg, minres, gmres)",
    strcmp(type, PCSHELL) ? "-pc_type" : "-solver", strcmp(type, PCSHELL) ? type : preset->name);
  PetscCheck(!SbConstraintsSeparate(s) || s->constraints->saddle == SB_SADDLE_DIRECT, s->comm,
             PETSC_ERR_USER,
             "-ksp_type preonly ignores the contact constraints, which are outside the matrix: "
             "choose -ksp_type cg or fgmres");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverFinish(SNES snes, SbSpace s, const SbSolverPreset *preset, Mat P)
{
  PetscInt restart = RESTART;
  PetscBool direct, single, symmetric;
  KSP ksp;
  Mat A;
  PC pc;

  PetscFunctionBeginUser;
  if (!P)
    PetscFunctionReturn(PETSC_SUCCESS); /* explicit: no linear system */
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(SbPCConstrainedGetInner(pc, &pc));
  if (SbConstraintsSeparate(s)) {
    PetscCall(PCSetOperators(pc, P, P));
    PetscCall(PCSetFromOptions(pc));
  }
  PetscCall(SbPCCheckPivots(pc));

  /* unsupported combinations are errors before anything is computed */
  PetscCall(check_factor(s, pc, P));
  PetscCall(check_method(s, ksp, pc, preset, &direct));

  /* the matrix without the nonsymmetric part is the preconditioner of the complete tangent */
  PetscCall(SNESGetJacobian(snes, &A, NULL, NULL, NULL));
  PetscCall(is_symmetric(ksp, &symmetric));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &single, KSPRICHARDSON, KSPPREONLY, ""));
  if (A && A != P && (!SbConstraintsSeparate(s) || s->constraints->whole != P) &&
      (symmetric || single)) {
    PetscCall(KSPSetType(ksp, KSPFGMRES));
    PetscCall(PetscOptionsGetInt(NULL, NULL, "-ksp_gmres_restart", &restart, NULL));
    PetscCall(KSPGMRESSetRestart(ksp, restart));
  }

  /* check true residuals where no Newton step does, or where the method's norm is unreliable */
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &single));
  if (s->constraints && s->constraints->saddle == SB_SADDLE_DIRECT)
    direct = PETSC_TRUE;
  PetscCall(SbKSPFinish(ksp, direct, single, (PetscBool)(s->constraints != NULL)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverDescribe(SNES snes, SbSpace s, size_t size, char text[])
{
  MatSolverType package = NULL;
  KSPType method;
  const char *name, *gathered;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetType(ksp, &method));
  if (s->constraints && s->constraints->general)
    method = s->constraints->method;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(SbPCConstrainedGetInner(pc, &pc));
  PetscCall(PCGetType(pc, &name));
  if (name && (!strcmp(name, PCLU) || !strcmp(name, PCCHOLESKY)))
    PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (name && !strcmp(name, PCSHELL))
    PetscCall(PCShellGetName(pc, &name));
  PetscCall(SbPCDirectGathered(pc, &gathered));
  if (gathered) {
    name = strcmp(gathered, MATSOLVERCHOLMOD) ? PCLU : PCCHOLESKY;
    package = gathered;
  }
  PetscCall(PetscSNPrintf(text, size, "%s, %s%s%s%s", method ? method : "", name ? name : "",
                          package ? " of " : "", package ? package : "",
                          gathered ? " on one rank" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverChooseIndefinite(MPI_Comm comm, size_t size, char choice[])
{
  const char *package;

  PetscFunctionBeginUser;
  if (strcmp(choice, "auto") && strcmp(choice, "direct"))
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SbDirectPackage(comm, PETSC_MAX_INT, PETSC_FALSE, &package));
  PetscCheck(package, comm, PETSC_ERR_USER,
             "-static_control arc_length factors indefinite matrices, which takes MUMPS or "
             "UMFPACK, and this "
             "PETSc has neither: choose another -solver");
  PetscCall(PetscStrncpy(choice, package, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbSolverCountNegativeEigenvalues(SNES snes, SbSpace s, PetscInt *negative)
{
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  *negative = -1;
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(SbPCConstrainedGetInner(pc, &pc));
  if (SbConstraintsFactored(s))
    pc = s->constraints->failed ? NULL : s->constraints->factored;
  if (pc)
    PetscCall(SbPCDirectCountNegative(pc, negative));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define DIRECT_STATIC \
  30000 /* static: largest number of unknowns that is factored; docs/reports/contact.md */
#define DIRECT_DYNAMIC 1000

PetscErrorCode SbSaddleChoose(SbSpace s, PetscBool dynamic, PetscInt choice, SbSaddle *saddle,
                              char reason[], size_t size)
{
  const PetscInt unknowns = 3 * s->Nnode;
  const char *package;

  PetscFunctionBeginUser;
  PetscCall(SbDirectPackage(s->comm, unknowns, PETSC_FALSE, &package));
  PetscCheck(
    choice != 1 || package, s->comm, PETSC_ERR_USER,
    "-saddle_solver direct needs MUMPS or SuiteSparse, and this PETSc was built without both: use "
    "-saddle_solver iterative");
  if (!choice)
    choice = package && unknowns <= (dynamic ? DIRECT_DYNAMIC : DIRECT_STATIC) ? 1 : 2;
  *saddle = choice == 1 ? SB_SADDLE_DIRECT : SB_SADDLE_NONE;
  if (choice == 1)
    PetscCall(PetscSNPrintf(reason, size, "multipliers of contact directly, by %s", package));
  else
    PetscCall(PetscSNPrintf(reason, size, "constraints of contact by their null space"));
  PetscFunctionReturn(PETSC_SUCCESS);
}
