/*
  Two-level preconditioner for CG: an incomplete factorisation and a coarse correction, combined as in balancing,

      P^-1 = Q + (1 - Q A) M (1 - A Q),   Q = Z E^-1 Z^T,   E = Z^T A Z

  with M the preconditioner of the fine level, Z six rigid-body modes for each of some hundred or thousand aggregates of nodes. It is symmetric and positive
  definite when M and A are. Mandel (1993), Balancing domain decomposition; Tang, Nabben, Vuik, Erlangga (2009),
  Comparison of two-level preconditioners derived from deflation, domain decomposition and multigrid methods, J. Sci. Comput. 39.

  PCPreSolve corrects the initial guess so that Z^T r = 0. All residuals keep this property, the factor 1 - A Q is left out, and P is
  A-DEF2 there, with one product by A and one coarse solve per application. Each application tests this; a
  residual with a part in the span of Z gets the complete P^-1.

  While E is small compared with a rank's part of A, one rank factors it for all, and few aggregates are best. On many ranks that would be most
  of the work, and the incomplete factorisation, which is block diagonal by ranks, is weaker. Then E stays distributed, a
  multigrid cycle C approximates E^-1 (coarse_solver.c), and there are more aggregates, of NODES_PER_SPREAD nodes each. Q = Z C Z^T is no
  exact coarse solve, so that the complete form is used, with two coarse corrections:

      P^-1 = 2 Q - Q A Q + (1 - Q A) M (1 - A Q),   symmetric, and positive definite if the eigenvalues of C E are below 2.

  docs/reports/many_ranks.md lists the iterations, messages and memory.

  Fine level: ICC(0) of the diagonal block of each rank, from the SBAIJ matrix of the fast product (product.h):
  for BAIJ PETSc would first convert. Where ICC(0) is not positive definite (at Poisson's ratio 0.45, not yet at 0.4;
  very flat tets), the diagonal: twice the iterations, each at half the cost. Bar of 192,000 tets, one rank, residual 1e-8, iterations
  and CPU s: at nu 0.3 ICC 39, 0.37 and diagonal 84, 0.48; at 0.45 diagonal 143, 0.70.

  PETSc's PCDEFLATION on the same aggregates takes AIJ only: 0.64 s on one rank, 0.83 on two (this: 0.37, 0.54). On a bar
  sixty times as long as thick CG with PCDEFLATION stopped with an indefinite preconditioner after 41 iterations (cause unknown; its
  fine level was ICC of AIJ); this one converges in 49.
*/
#include "coarse.h"
#include "sbassembly.h"
#include "sbsolver.h"
#include "sblog.h"

#define NAME "two-level"
#define NU_ICC 0.4   /* largest Poisson's ratio for which the incomplete factorisation is tried */
#define IN_SPAN 1e-5 /* relative size of the residual in the span of Z that counts as rounding */

/* Number of aggregates when one rank factors E: a rank's nodes over this, within these bounds. */
#define NODES_PER_FACTORED 10
#define LEAST_FACTORED 50
#define MOST_FACTORED 1000
#define NODES_PER_SPREAD 16 /* nodes per aggregate; 12, 16, 24: 37, 37, 38 iterations (80,000 tets) */

typedef struct {
  SbSpace space;
  SbCoarse coarse;
  PetscInt wanted;  /* number of aggregates, 0: by the number of nodes */
  PetscInt limit;   /* largest number of aggregates for one rank to factor, -1: by size */
  PC fine;          /* fine level on this rank, unless it is the diagonal */
  PetscBool simple; /* the fine level is the diagonal */
  Vec s, w, t;
  Vec own_in, own_out; /* owned rows; they borrow their arrays */
  PetscInt nsetup;
  PetscBool guess_given;
} TwoLevel;

/* ------------------------------------------------------------------ set-up */

/* Creates the incomplete Cholesky factorisation of this rank's diagonal block, or its replacement. */
static PetscErrorCode create_fine(TwoLevel *p, PC pc, Mat A)
{
  const char *prefix;
  PetscBool symmetric;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)A, MATSEQSBAIJ, &symmetric));
  PetscCall(PCCreate(p->simple ? p->space->comm : PETSC_COMM_SELF, &p->fine));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PCSetOptionsPrefix(p->fine, prefix));
  PetscCall(PCAppendOptionsPrefix(p->fine, "fine_"));
  if (p->simple)
    PetscCall(PCSetType(p->fine, symmetric ? PCJACOBI : PCPBJACOBI));
  else if (!p->space->nnode_owned) /* PETSc 3.26 fails for an empty matrix */
    PetscCall(PCSetType(p->fine, PCNONE));
  else {
    PetscCall(PCSetType(p->fine, PCICC));
    PetscCall(PCFactorSetShiftType(p->fine, MAT_SHIFT_POSITIVE_DEFINITE));
  }
  PetscCall(PCSetFromOptions(p->fine));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode set_up_fine(TwoLevel *p, PC pc, Mat A, PetscBool *ok)
{
  PCFailedReason reason;

  PetscFunctionBeginUser;
  if (!p->fine) PetscCall(create_fine(p, pc, A));
  if (!p->simple) PetscCall(SbProductGetSymmetric(A, &A));
  PetscCall(PCSetOperators(p->fine, A, A));
  PetscCall(PCSetReusePreconditioner(p->fine, PETSC_FALSE));
  PetscCall(PCSetUp(p->fine));
  /* else PETSc would renew it in an application after the values have changed, but not the coarse level */
  PetscCall(PCSetReusePreconditioner(p->fine, PETSC_TRUE));
  PetscCall(PCGetFailedReason(p->fine, &reason));
  *ok = (PetscBool)(reason == PC_NOERROR);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, p->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces the incomplete factorisation by the diagonal from here on. */
static PetscErrorCode simplify(TwoLevel *p)
{
  PetscFunctionBeginUser;
  p->simple = PETSC_TRUE;
  PetscCall(PCDestroy(&p->fine));
  PetscCall(
    SbWarning(p->space->comm,
              "the incomplete factorisation is not positive definite (very flat tets, or nu near 1/2): going "
              "on with the diagonal in its place, which is slower; -solver cg_gamg may be faster"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCSetUp_Coarse(PC pc)
{
  PetscBool ok;
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  if (!p->coarse) {
    const SbSpace s = p->space;
    PetscInt wanted = p->wanted, limit = p->limit;
    PetscReal nu = 0.;
    PetscBool spread;
    PetscMPIInt size;

    PetscCallMPI(MPI_Comm_size(s->comm, &size));
    /* 300 was best for 36,000 nodes (192,000 tets); the cost of the factor grows faster than the number of aggregates */
    if (!wanted)
      wanted = PetscMax(1, (PetscInt)(300. * PetscPowReal((PetscReal)s->Nnode / 36000., 0.7) + 0.5));
    if (limit < 0)
      limit = PetscMax(LEAST_FACTORED, PetscMin(MOST_FACTORED, s->Nnode / (size * NODES_PER_FACTORED)));
    spread = (PetscBool)(size > 1 && wanted > limit);
    if (spread && !p->wanted) wanted = s->Nnode / NODES_PER_SPREAD;
    PetscCall(SbCoarseCreate(s, wanted, spread, &p->coarse));
    for (PetscInt r = 0; r < s->nregion; r++) nu = PetscMax(nu, s->region[r].material->nu);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nu, 1, MPIU_REAL, MPI_MAX, s->comm));
    p->simple = (PetscBool)(nu > NU_ICC);
    PetscCall(MatCreateVecs(A, &p->s, &p->w));
    PetscCall(VecDuplicate(p->s, &p->t));
    PetscCall(VecCreateLocalVector(p->s, &p->own_in));
    PetscCall(VecCreateLocalVector(p->s, &p->own_out));
  }
  PetscCall(set_up_fine(p, pc, A, &ok));
  if (!ok && !p->simple && !p->space->tentative) {
    PetscCall(simplify(p));
    PetscCall(set_up_fine(p, pc, A, &ok));
  }
  PetscCall(SbCoarseSetUp(p->coarse, A));
  p->nsetup++;
  PetscCall(PetscInfo(pc, "%" PetscInt_FMT " aggregates, %s%s\n", p->coarse->N,
                      p->coarse->spread ? "spread over the ranks" : "factored by one of them",
                      p->coarse->ok ? "" : ": the coarse operator is not positive definite"));
  PetscCall(PCSetFailedReason(pc, ok && p->coarse->ok ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], pc, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ application */

static PetscErrorCode PCApply_Coarse(PC pc, Vec r, Vec z)
{
  PetscReal share;
  PetscBool whole;
  TwoLevel *p;
  Vec s = r;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(SbCoarseRestrict(p->coarse, r, &share));
  whole = (PetscBool)(share > IN_SPAN);
  if (whole) { /* z = Q r, s = r - A z */
    s = p->s;
    PetscCall(VecSet(z, 0.));
    PetscCall(SbCoarseAdd(p->coarse, z));
    PetscCall(MatMult(A, z, s));
    PetscCall(VecAYPX(s, -1., r));
  }
  /* w = M s + Q (s - A M s) */
  if (p->simple)
    PetscCall(PCApply(p->fine, s, p->w));
  else {
    PetscCall(VecGetLocalVectorRead(s, p->own_in));
    PetscCall(VecGetLocalVector(p->w, p->own_out));
    PetscCall(PCApply(p->fine, p->own_in, p->own_out));
    PetscCall(VecRestoreLocalVector(p->w, p->own_out));
    PetscCall(VecRestoreLocalVectorRead(s, p->own_in));
  }
  PetscCall(MatMult(A, p->w, p->t));
  PetscCall(VecAYPX(p->t, -1., s));
  PetscCall(SbCoarseRestrict(p->coarse, p->t, &share));
  PetscCall(SbCoarseAdd(p->coarse, p->w));
  if (whole)
    PetscCall(VecAXPY(z, 1., p->w));
  else
    PetscCall(VecCopy(p->w, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Corrects the initial guess, so that its residual has no part in the span of Z. */
static PetscErrorCode PCPreSolve_Coarse(PC pc, KSP ksp, Vec b, Vec x)
{
  PetscReal share;
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(PCGetOperators(pc, &A, NULL));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &p->guess_given));
  if (!p->coarse->ok) PetscFunctionReturn(PETSC_SUCCESS);
  if (p->guess_given) {
    PetscCall(MatMult(A, x, p->s));
    PetscCall(VecAYPX(p->s, -1., b));
  } else
    PetscCall(VecSet(x, 0.));
  PetscCall(SbCoarseRestrict(p->coarse, p->guess_given ? p->s : b, &share));
  PetscCall(SbCoarseAdd(p->coarse, x));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCPostSolve_Coarse(PC pc, KSP ksp, Vec b, Vec x)
{
  TwoLevel *p;

  PetscFunctionBeginUser;
  (void)b;
  (void)x;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(KSPSetInitialGuessNonzero(ksp, p->guess_given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ create and destroy */

static PetscErrorCode PCView_Coarse(PC pc, PetscViewer viewer)
{
  PetscMPIInt rank;
  PetscViewer own;
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)pc), &rank));
  PetscCall(PCShellGetContext(pc, &p));
  if (p->coarse)
    PetscCall(PetscViewerASCIIPrintf(
      viewer, "  %" PetscInt_FMT " aggregates with six rigid-body modes each, %s; fine level:\n",
      p->coarse->N, p->coarse->spread ? "spread over the ranks" : "factored by one of them"));
  if (p->fine && p->simple) PetscCall(PCView(p->fine, viewer));
  if (p->fine && !p->simple) {
    PetscCall(PetscViewerGetSubViewer(viewer, PETSC_COMM_SELF, &own));
    if (!rank) PetscCall(PCView(p->fine, own));
    PetscCall(PetscViewerRestoreSubViewer(viewer, PETSC_COMM_SELF, &own));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode PCDestroy_Coarse(PC pc)
{
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &p));
  PetscCall(SbCoarseDestroy(&p->coarse));
  PetscCall(PCDestroy(&p->fine));
  PetscCall(VecDestroy(&p->s));
  PetscCall(VecDestroy(&p->w));
  PetscCall(VecDestroy(&p->t));
  PetscCall(VecDestroy(&p->own_in));
  PetscCall(VecDestroy(&p->own_out));
  PetscCall(PetscFree(p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCCoarseCreate(SbSpace s, PC pc)
{
  const char *prefix;
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  p->space = s;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  p->limit = -1;
  PetscCall(PetscOptionsGetInt(NULL, prefix, "-pc_coarse_aggregates", &p->wanted, NULL));
  PetscCall(PetscOptionsGetInt(NULL, prefix, "-pc_coarse_gathered", &p->limit, NULL));
  PetscCheck(p->wanted >= 0, s->comm, PETSC_ERR_USER,
             "-pc_coarse_aggregates %" PetscInt_FMT
             " is negative: give a number of aggregates, or 0 to choose by size",
             p->wanted);
  PetscCheck(p->limit >= -1, s->comm, PETSC_ERR_USER,
             "-pc_coarse_gathered %" PetscInt_FMT " is below -1: give the largest number of aggregates that "
             "one rank factors, 0 for none, or -1 to choose by size",
             p->limit);
  PetscCall(PCSetType(pc, PCSHELL));
  PetscCall(PCShellSetContext(pc, p));
  PetscCall(PCShellSetName(pc, NAME));
  PetscCall(PCShellSetSetUp(pc, PCSetUp_Coarse));
  PetscCall(PCShellSetApply(pc, PCApply_Coarse));
  PetscCall(PCShellSetPreSolve(pc, PCPreSolve_Coarse));
  PetscCall(PCShellSetPostSolve(pc, PCPostSolve_Coarse));
  PetscCall(PCShellSetView(pc, PCView_Coarse));
  PetscCall(PCShellSetDestroy(pc, PCDestroy_Coarse));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The context of pc if it is of this type, else NULL. */
static PetscErrorCode context_of(PC pc, TwoLevel **p)
{
  PetscBool is;
  const char *name = NULL;

  PetscFunctionBeginUser;
  *p = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCSHELL, &is));
  if (is) PetscCall(PCShellGetName(pc, &name));
  if (name && !strcmp(name, NAME)) PetscCall(PCShellGetContext(pc, p));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCCoarseFallBack(PC pc, KSPConvergedReason reason, PetscBool *changed)
{
  PetscBool ok;
  TwoLevel *p;
  Mat A;

  PetscFunctionBeginUser;
  *changed = PETSC_FALSE;
  PetscCall(context_of(pc, &p));
  if (!p || p->simple || !p->coarse || !p->coarse->ok) PetscFunctionReturn(PETSC_SUCCESS);
  if (reason != KSP_DIVERGED_INDEFINITE_PC && reason != KSP_DIVERGED_PC_FAILED &&
      reason != KSP_DIVERGED_NANORINF)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(simplify(p));
  PetscCall(PCGetOperators(pc, NULL, &A));
  PetscCall(set_up_fine(p, pc, A, &ok));
  *changed = ok;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCCoarseGetStats(PC pc, PetscInt *naggregate, PetscInt *nsolved, PetscInt *nsetup,
                                  PetscBool *simple)
{
  PetscMPIInt rank;
  TwoLevel *p;

  PetscFunctionBeginUser;
  PetscCall(context_of(pc, &p));
  PetscCheck(p, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_WRONG, "Not a two-level preconditioner");
  PetscCallMPI(MPI_Comm_rank(p->space->comm, &rank));
  if (naggregate) *naggregate = p->coarse ? p->coarse->N : 0;
  if (nsolved) *nsolved = !p->coarse ? 0 : p->coarse->spread ? p->coarse->n : rank ? 0 : p->coarse->N;
  if (nsetup) *nsetup = p->nsetup;
  if (simple) *simple = p->simple;
  PetscFunctionReturn(PETSC_SUCCESS);
}
