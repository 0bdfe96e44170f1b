/*
  Two-level preconditioner for CG: an incomplete factorisation and a coarse correction, joined as balancing does,

      P^-1 = Q + (1 - Q A) M (1 - A Q),   Q = Z E^-1 Z^T,   E = Z^T A Z

  with M the fine level, Z six rigid-body modes for each of some hundred or thousand aggregates of nodes. It is symmetric and positive
  definite when M and A are. Mandel (1993), Balancing domain decomposition; Tang, Nabben, Vuik, Erlangga (2009),
  Comparison of two-level preconditioners derived from deflation, domain decomposition and multigrid methods, J. Sci. Comput. 39.

  When the start of the iteration makes Z^T r = 0, which the hook before a solve does, it stays so and the right factor is 1: what
  is left is their A-DEF2, with one product by A and one coarse solve for each application. That is examined each time; a
  residual with a part in the span of Z gets the whole.

  While E is small beside a rank's own part, one rank factors it for all: few aggregates are best. On many ranks that would soon be most
  of the work, and the incomplete factorisation, which ends at the border of a rank, is weaker. E stays with its ranks then, a
  cycle of multigrid C stands for E^-1 (coarse_solver.c), and there are more aggregates, of NODES_PER_SPREAD nodes each. Q = Z C Z^T corrects
  only in part, so that the whole is always taken, with what the correction leaves corrected once more:

      P^-1 = 2 Q - Q A Q + (1 - Q A) M (1 - A Q),   symmetric, and positive definite as C has no eigenvalue of C E above 2.

  docs/reports/many_ranks.md lists the iterations, messages and memory.

  Fine level: ICC(0) of the rows and columns of each rank, made from the SBAIJ matrix that the product has at hand (product.h):
  given BAIJ, PETSc would first make one. Where that is not positive definite (at Poisson's ratio 0.45, not yet at 0.4;
  very flat tets), the diagonal: twice the iterations, each at half the price. Bar of 192,000 tets, one rank, residual 1e-8, iterations
  and CPU s: at nu 0.3 ICC 39, 0.37 and diagonal 84, 0.48; at 0.45 diagonal 143, 0.70.

  PETSc's PCDEFLATION on the same aggregates takes AIJ only: 0.64 s on one rank, 0.83 on two (this: 0.37, 0.54). On a bar
  sixty times as long as thick CG stopped there with an indefinite preconditioner after 41 iterations (why was not found out; its
  fine level was the ICC of AIJ); this takes 49.
*/
#include "coarse.h"
#include "sbassembly.h"
#include "sbsolver.h"
#include "sblog.h"

#define NAME "two-level"
#define NU_ICC 0.4   /* up to this Poisson's ratio the incomplete factorisation is tried */
#define IN_SPAN 1e-5 /* share of the residual in the span of Z below which the right factor is 1 */

/* Aggregates that one rank factors: one for so many nodes of a rank, within these bounds. */
#define NODES_PER_FACTORED 10
#define LEAST_FACTORED 50
#define MOST_FACTORED 1000
#define NODES_PER_SPREAD 16 /* bar of 80,000 tets on 16 ranks: 12, 16 and 24 take 37, 37 and 38 iterations */

typedef struct {
  SbSpace space;
  SbCoarse coarse;
  PetscInt wanted;  /* aggregates, 0: by size */
  PetscInt limit;   /* of the aggregates that one rank factors, -1: by size */
  PC fine;          /* of this rank alone, unless it is the diagonal */
  PetscBool simple; /* the diagonal as fine level */
  Vec s, w, t;
  Vec own_in, own_out; /* rows of this rank, without memory of their own */
  PetscInt nsetup;
  PetscBool guess_given;
} TwoLevel;

/* ------------------------------------------------------------------ set-up */

/* Incomplete Cholesky of the rows and columns of this rank, or what replaces it. */
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
  else if (!p->space->nnode_owned) /* PETSc 3.26 does not survive the factorisation of nothing */
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
  /* else PETSc would renew it in an application after the values have changed, the coarse level not */
  PetscCall(PCSetReusePreconditioner(p->fine, PETSC_TRUE));
  PetscCall(PCGetFailedReason(p->fine, &reason));
  *ok = (PetscBool)(reason == PC_NOERROR);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ok, 1, SB_MPI_BOOL, MPI_LAND, p->space->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From here on without the incomplete factorisation. */
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
    /* 300 at 36,000 nodes (192,000 tets) was best; the work of a factor grows faster than the number of aggregates */
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

/* Corrects the first guess, so that its residual has no part in the span of Z. */
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

/* ------------------------------------------------------------------ life */

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

/* The context when pc is one of these, else NULL. */
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
