/*
  Linear solvers from a row of the table (preset.c) to a KSP of PETSc that is set up. The row's
  options are set in the options database unless the user set them, so that everything stays
  adjustable by PETSc's own options. SbSolverFinish() reports unsupported combinations as errors
  before anything is computed.

  The convergence test uses the true residual wherever the method computes it (true_residual.c): the
  preconditioned norm can be off by orders of magnitude for nearly incompressible bodies. A solve
  that does not reach its tolerance fails; the next solver (choice.c) is then tried on the same
  system (time/solver_list.c), and only if all fail is the step halved or the run stopped.
*/
#include "choice.h"
#include "sbfactor.h"
#include "sbpc.h"
#include "solver_impl.h"

#define RESTART 100 /* restart length of FGMRES */

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

/* The package of a PCLU or PCCHOLESKY where the user names neither one nor -solver: PETSc's default
   ignores size and ranks. */
static PetscErrorCode choose_package(SbSpace s, PC pc, const char *type)
{
  const PetscBool lu = (PetscBool)!strcmp(type, PCLU);
  const char *package = NULL;
  PetscBool has;
  SbSolverFacts f;

  PetscFunctionBeginUser;
  if (s->ghosted) {
    /* the matrix is distributed: MUMPS, or SuperLU_DIST */
    PetscCall(SbHasPackage(MATSOLVERMUMPS, &has));
    if (has)
      package = MATSOLVERMUMPS;
    else if (lu) {
      PetscCall(SbHasPackage(MATSOLVERSUPERLU_DIST, &has));
      if (has)
        package = MATSOLVERSUPERLU_DIST;
    }
  } else {
    /* the fastest on one rank; UMFPACK has no Cholesky factorisation */
    PetscCall(SbSolverFindFacts(s, &f));
    PetscCall(SbDirectPackage(s->comm, f.unknowns, (PetscBool)(!lu && !f.indefinite), &package));
    if (package && !lu && !strcmp(package, MATSOLVERUMFPACK))
      package = NULL;
  }
  if (!package)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCFactorSetMatSolverType(pc, package));
  if (!strcmp(package, MATSOLVERMUMPS))
    PetscCall(
      SbOptionsSetDefaults("", "-mat_mumps_icntl_13 1 -mat_mumps_icntl_14 100", PETSC_FALSE));

  /* a non-positive pivot appears as a reason of the solve, not as an error */
  if (!strcmp(package, MATSOLVERCHOLMOD))
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
  PetscBool given, symmetric, reproducible, one_solve;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;

  /* algebraic multigrid sums its coarse matrices in the order in which messages arrive */
  PetscCall(SbOptionBool(&SbRunScope, "reproducible", &reproducible));
  if (reproducible && s->ghosted)
    PetscCall(
      SbOptionsSetDefaults("", "-matptap_via allatonce -matstash_reproduce yes", PETSC_FALSE));
  PetscCall(SNESGetKSP(snes, &ksp));
  if (s->constraints && s->constraints->general) { /* norm and side were those of FGMRES */
    PetscCall(KSPSetNormType(ksp, KSP_NORM_DEFAULT));
    PetscCall(KSPSetPCSide(ksp, PC_SIDE_DEFAULT));
    s->constraints->general = PETSC_FALSE;
  }
  PetscCall(KSPGetPC(ksp, &pc));

  /* the residual norm of CG in a null space may grow far before it decreases */
  PetscCall(KSPSetTolerances(ksp, 1e-8, PETSC_DEFAULT,
                             SbConstraintsSeparate(s) ? 1e10 : PETSC_DEFAULT, 5000));
  PetscCall(SbPCConstrainedCreate(s, pc, &pc));

  /* the preset's types, or those of the user */
  SbSolverPresetValue(preset, "-ksp_type", method);
  SbSolverPresetValue(preset, "-pc_type", type);
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
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESKSPONLY, &one_solve));
  if (!one_solve && !strcmp(type, PCGAMG))
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
  PetscCall(SbPCMultigridAvoid(s, pc));
  PetscCall(SbPCCheckPivots(pc));
  PetscCall(SbPCAllowEmptyBlocks(pc));

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
