/*
  contact_system.c - linear systems of bodies in contact: the sparse tangent plus contact blocks,
  which couple nodes without a common cell.

  Their sum is one matrix of 3x3 blocks, whose pattern grows as contact needs; blocks that contact
  has not used for KEEP solves are dropped at the next growth. So most Newton iterations change
  values only, and the symbolic factorisation and the coarse space are reused.

  Systems are solved by CG with the coarse space of two_level.c, to a tolerance of FORCING in the
  norm of the preconditioner, or factored on one rank (block_solver.c). The limit of CG's iterations
  costs as much as the factorisation: the operations of both factorisations follow from the symbolic
  ones, the work of an iteration from the numbers of blocks of the matrix and of the coarse factor.
  Unused iterations are credited to later solves. A system that needs more is factored, and so are
  those of the next PAUSE solves, twice as many each time that CG fails again at once. So thin
  bodies, those with much contact, and some near nu = 1/2 are factored. A solve with a matrix that
  is not positive definite fails: by a pivot of the factor, or by a direction of negative curvature
  in CG. With -pc_type or -contact_pc_type, PETSc's preconditioner of that name replaces both;
  -ksp_type and -contact_ksp_type replace CG. Options that go with -pc_type (-ksp_max_it,
  -sub_pc_type) apply here, too.
*/
#include "sbpc.h"
#include "solver_impl.h"

#define KEEP 20      /* solves after which an unused block is dropped from the pattern */
#define SMALL 2000   /* unknowns up to which all is factored: same numbers on any number of ranks */
#define FORCING 1e-2 /* relative tolerance of CG, norm of the preconditioned residual */
#define WORK \
  130 /* operations of a factorisation in the time that an iteration takes for one 3x3 block */
#define SET_UP 4 /* set-up time of the coarse space without its factor, in iterations */
#define SAVED 10 /* largest credit of iterations, over those that cost as much as a factorisation */
#define PAUSE 20 /* solves that are factored after CG was slower */
#define LARGE \
  100000         /* number of unknowns above which the cost of a factorisation is not computed */
#define MOST 300 /* limit of iterations in any case */
/* Relative tolerance with a preconditioner of the user: no factorisation follows, and its errors
   are in soft modes, which make a step look short. */
#define FORCING_USER 1e-4
#define MOST_USER 5000

/* The two copies of the rows: PETSc's matrix for CG, and the factor. */
enum {
  MATRIX,
  FACTOR
};

struct _p_SbContactSystem {
  SbSpace space;
  PetscInt choice; /* 0 by cost, 1 factorisation, 2 CG */
  SbContactRows rows;
  PetscInt *ka, *kj; /* pattern of the tangent: [n+1]; [ka[n]] global nodes */
  PetscInt *place;   /* [ka[n]] position of the tangent's blocks in rows.value */
  PetscInt
    *used; /* [rows.ia[n]] last solve in which contact used the block; -1: a block of the tangent */
  PetscInt
    *until; /* [n] last solve for which the node is in contact, KEEP after it was, 0: never */
  PetscInt nsolve;
  PetscInt limit, most; /* limits of CG's iterations: by options; by the cost of a factorisation */
  PetscInt budget;      /* credit of iterations */
  PetscInt resume, pause;    /* number of the solve in which CG is tried again; solves until then */
  PetscReal *tangent;        /* [ka[n]][9] blocks of the tangent */
  PetscBool stale_values[2]; /* MATRIX, FACTOR: lacks the current values */
  PetscBool stale_pattern[2];   /* MATRIX, FACTOR: has an old pattern */
  char method[32], type[32];    /* the user's Krylov method and preconditioner, "": none */
  SbBlockSolver factor, coarse; /* of all; of the coarse space, borrowed */
  KSP ksp;
  Mat A;
};

/* The user's Krylov method, unless NULL, and preconditioner, "" if not set; room for 32 characters
   each. */
static PetscErrorCode user_types(char method[], char type[])
{
  static const char *const options[] = {"-ksp_type", "-contact_ksp_type", "-pc_type",
                                        "-contact_pc_type"};

  PetscFunctionBeginUser;
  for (int k = method ? 0 : 2; k < 4; k++)
    PetscCall(PetscOptionsGetString(NULL, NULL, options[k], k < 2 ? method : type, 32, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemCreate(SbSpace s, PetscInt choice, SbContactSystem *system)
{
  const PetscInt n = s->nnode_owned;
  SbContactSystem c;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&c));
  *system = c;
  c->space = s;
  c->choice = choice;
  c->rows.n = n;
  PetscCall(PetscCalloc2(n, &c->until, n, &c->rows.contact));
  PetscCall(SbSpaceGetGraph(s, &c->ka, &c->kj));
  PetscCall(PetscMalloc2(c->ka[n], &c->place, 9 * (size_t)c->ka[n], &c->tangent));
  PetscCall(PetscCalloc3(n + 1, &c->rows.ia, 0, &c->rows.ja, 0, &c->used));
  PetscCall(user_types(c->method, c->type));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the system is factored by the user's choice. */
static PetscBool is_factored(PetscInt choice, const char type[])
{
  return (PetscBool)(type[0] ? !strcmp(type, PCCHOLESKY) || !strcmp(type, PCLU) : choice == 1);
}

PetscErrorCode SbContactSystemDescribe(PetscInt choice, char text[], size_t size)
{
  char type[32] = "";

  PetscFunctionBeginUser;
  PetscCall(user_types(NULL, type));
  if (is_factored(choice, type))
    SbFormat(size, text, "contact by a factorisation");
  else if (type[0])
    SbFormat(size, text, "contact with %s", type);
  else
    SbFormat(size, text, "contact by CG in two levels%s",
             choice ? "" : ", or factored where that is less work");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates a pattern that contains the blocks, and marks nodes in contact. */
static PetscErrorCode make_pattern(SbContactSystem c, const SbBlocks *b)
{
  const PetscInt n = c->rows.n;
  PetscInt *key, *first, *order, *ia, *ja, *used;
  PetscInt nz = 0;
  const SbContactRows old = c->rows;

  PetscFunctionBeginUser;

  /* contact blocks by rows */
  PetscCall(PetscMalloc1(b->n, &key));
  for (PetscInt k = 0; k < b->n; k++)
    key[k] = b->block[k].v[0];
  PetscCall(SbBucketByKey(b->n, key, n, &first, &order));
  PetscCall(PetscFree(key));

  /* each row: columns of the tangent, those of the old pattern still in use, those of contact */
  PetscCall(
    PetscMalloc3(n + 1, &ia, c->ka[n] + b->n + old.ia[n], &ja, c->ka[n] + b->n + old.ia[n], &used));
  ia[0] = 0;
  for (PetscInt r = 0; r < n; r++) {
    PetscInt *column = ja + nz;
    PetscInt *stamp = used + nz;
    PetscInt m = 0;

    for (PetscInt k = c->ka[r]; k < c->ka[r + 1]; k++, m++) {
      column[m] = c->kj[k];
      stamp[m] = -1;
    }
    for (PetscInt k = old.ia[r]; k < old.ia[r + 1]; k++) {
      if (c->used[k] < 0 || c->used[k] + KEEP < c->nsolve)
        continue;
      column[m] = old.ja[k];
      stamp[m++] = c->used[k];
    }
    for (PetscInt k = first[r]; k < first[r + 1]; k++, m++) {
      column[m] = b->block[order[k]].v[1];
      stamp[m] = c->nsolve;
    }
    PetscCall(PetscSortIntWithArray(m, column, stamp));
    for (PetscInt k = 0; k < m; k++)
      if (!k || column[k] != ja[nz - 1]) {
        ja[nz] = column[k];
        used[nz++] = stamp[k];
      } else
        used[nz - 1] = used[nz - 1] < 0 || stamp[k] < 0 ? -1 : PetscMax(used[nz - 1], stamp[k]);
    ia[r + 1] = nz;
    c->rows.contact[r] = (uint8_t)(c->space->fixed[r] != 7 && c->until[r] >= c->nsolve);
  }
  PetscCall(PetscFree(order));
  PetscCall(PetscFree(first));
  PetscCall(PetscFree3(c->rows.ia, c->rows.ja, c->used));
  PetscCall(PetscFree(c->rows.value));
  c->rows.ia = ia;
  c->rows.ja = ja;
  c->used = used;
  PetscCall(PetscMalloc1(9 * (size_t)nz, &c->rows.value));
  for (PetscInt r = 0; r < n; r++)
    for (PetscInt k = c->ka[r]; k < c->ka[r + 1]; k++)
      c->place[k] = SbRowFind(ia, ja, r, c->kj[k]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sums the tangent and the contact blocks into rows.value. */
static PetscErrorCode merge(SbContactSystem c, Mat K, const SbBlocks *b)
{
  SbContactRows *rows = &c->rows;
  PetscBool missing = (PetscBool)!rows->value;

  PetscFunctionBeginUser;
  c->nsolve++;
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt r = b->block[k].v[0];

    c->until[r] = c->nsolve + KEEP;
    missing = (PetscBool)(missing || SbRowFind(rows->ia, rows->ja, r, b->block[k].v[1]) < 0 ||
                          (c->space->fixed[r] != 7 && !rows->contact[r]));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &missing, 1, SB_MPI_BOOL, MPI_LOR, c->space->comm));
  if (missing) {
    PetscCall(make_pattern(c, b));
    c->stale_pattern[MATRIX] = c->stale_pattern[FACTOR] = PETSC_TRUE;
  }
  PetscCall(SbSpaceGetRows(c->space, K, rows->n, NULL, c->ka, NULL, c->tangent));

  /* blocks of the tangent are overwritten, those of contact alone start from zero */
  for (PetscInt k = 0; k < rows->ia[rows->n]; k++)
    if (c->used[k] >= 0)
      PetscCall(PetscArrayzero(rows->value + 9 * (size_t)k, 9));
  for (PetscInt k = 0; k < c->ka[rows->n]; k++)
    for (int e = 0; e < 9; e++)
      rows->value[9 * (size_t)c->place[k] + e] = c->tangent[9 * (size_t)k + e];
  for (PetscInt k = 0; k < b->n; k++) {
    const PetscInt place = SbRowFind(rows->ia, rows->ja, b->block[k].v[0], b->block[k].v[1]);
    PetscReal *to = rows->value + 9 * (size_t)place;

    if (c->used[place] >= 0)
      c->used[place] = c->nsolve;
    for (int e = 0; e < 9; e++)
      to[e] += b->block[k].H[e];
  }
  c->stale_values[MATRIX] = c->stale_values[FACTOR] = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies the rows into the parts of PETSc's matrix: column-major blocks, of SBAIJ from the diagonal
   on. */
static PetscErrorCode fill_matrix(SbContactSystem c)
{
  const SbContactRows *rows = &c->rows;
  const PetscInt first = c->space->gnode_start;
  PetscScalar *to[2];
  SbMatBlocks b;

  PetscFunctionBeginUser;
  PetscCall(SbMatGetBlocks(c->A, PETSC_FALSE, &b));
  for (int q = 0; q < 2; q++)
    to[q] = b.value[q];
  for (PetscInt i = 0; i < rows->n; i++) {
    for (PetscInt k = rows->ia[i]; k < rows->ia[i + 1]; k++) {
      const int q = rows->ja[k] < first || rows->ja[k] >= first + rows->n;

      if (b.symmetric && rows->ja[k] < i)
        continue;
      for (int e = 0; e < 9; e++)
        to[q][3 * (e % 3) + e / 3] = rows->value[9 * (size_t)k + (size_t)e];
      to[q] += 9;
    }
  }
  PetscCall(SbMatRestoreBlocks(&b));

  /* assembles the sequential parts as well: their state increases */
  PetscCall(MatAssemblyBegin(c->A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Creates PETSc's matrix, and CG or the user's method. */
static PetscErrorCode set_up_iteration(SbContactSystem c)
{
  const SbSpace s = c->space;
  const SbContactRows *rows = &c->rows;
  PetscBool own = (PetscBool)!c->type[0];
  PetscBool contact_type; /* the user gives -contact_pc_type */
  Mat P;
  PC pc;

  PetscFunctionBeginUser;
  if (c->stale_pattern[MATRIX]) {
    PetscCall(MatDestroy(&c->A));
    PetscCall(MatCreate(s->comm, &c->A));
    PetscCall(MatSetSizes(c->A, 3 * rows->n, 3 * rows->n, 3 * s->Nnode, 3 * s->Nnode));
    PetscCall(MatSetBlockSize(c->A, 3));
    PetscCall(MatSetType(c->A, own && !s->ghosted ? MATSBAIJ : MATBAIJ));
    if (own && !s->ghosted)
      PetscCall(MatSetOption(c->A, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
    PetscCall(MatSeqSBAIJSetPreallocationCSR(c->A, 3, rows->ia, rows->ja, NULL));
    PetscCall(MatSeqBAIJSetPreallocationCSR(c->A, 3, rows->ia, rows->ja, NULL));
    PetscCall(MatMPIBAIJSetPreallocationCSR(c->A, 3, rows->ia, rows->ja, NULL));
    if (own)
      PetscCall(SbProductAttach(c->A));
  }
  PetscCall(fill_matrix(c));
  if (!c->ksp) {
    PetscCall(KSPCreate(s->comm, &c->ksp));

    /* options for -pc_type, from its preset and the user, have no prefix in the
       database */
    PetscCall(PetscOptionsHasName(NULL, "contact_", "-pc_type", &contact_type));
    if (own || contact_type)
      PetscCall(KSPSetOptionsPrefix(c->ksp, "contact_"));
    PetscCall(KSPSetTolerances(c->ksp, own ? FORCING : FORCING_USER, PETSC_DEFAULT, 1e10,
                               own ? MOST : MOST_USER));
    PetscCall(KSPGetPC(c->ksp, &pc));
    if (own)
      PetscCall(SbPCContactCreate(s, rows, pc, &c->coarse));
    else
      PetscCall(PCSetType(pc, c->type));
    PetscCall(KSPSetFromOptions(c->ksp));
    PetscCall(KSPSetType(c->ksp, c->method[0] ? c->method : KSPCG));
    PetscCall(KSPGetTolerances(c->ksp, NULL, NULL, NULL, &c->limit));
  }
  P = c->A;
  if (!own) { /* most preconditioners take AIJ */
    PetscCall(MatConvert(c->A, MATAIJ, MAT_INITIAL_MATRIX, &P));
    PetscCall(MatSetOption(P, MAT_SYMMETRIC, PETSC_TRUE));
  }
  PetscCall(KSPSetOperators(c->ksp, P, P));
  if (!own)
    PetscCall(MatDestroy(&P));
  c->stale_pattern[MATRIX] = c->stale_values[MATRIX] = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Finds the number of iterations that cost as much as the factorisation. */
static PetscErrorCode find_most(SbContactSystem c)
{
  const SbContactRows *rows = &c->rows;
  PetscReal nblock = (PetscReal)rows->ia[rows->n];
  PetscReal flops[2], entries[2];

  PetscFunctionBeginUser;
  c->most = c->limit;
  if (c->choice || 3 * c->space->Nnode > LARGE)
    PetscFunctionReturn(PETSC_SUCCESS);

  /* a pattern with little more contact costs as much as the one examined last */
  if (!c->factor) {
    PetscCall(SbBlockSolverCreate(c->space->comm, &c->factor));
    PetscCall(SbBlockSolverAnalyze(c->factor, rows->n, rows->ia, rows->ja));
    c->stale_pattern[FACTOR] = PETSC_FALSE;
  }
  PetscCall(SbBlockSolverCost(c->factor, &flops[0], &entries[0]));
  PetscCall(SbBlockSolverCost(c->coarse, &flops[1], &entries[1]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nblock, 1, MPIU_REAL, MPI_SUM, c->space->comm));
  nblock += entries[1] / 9.;
  c->most = (PetscInt)PetscClipInterval((flops[0] - flops[1]) / (WORK * nblock) - SET_UP, 0.,
                                        (PetscReal)c->limit);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode iterate(SbContactSystem c, Vec F, Vec Y, KSPConvergedReason *reason,
                              PetscInt *iterations)
{
  const PetscBool changed = c->stale_pattern[MATRIX];

  PetscFunctionBeginUser;
  if (c->stale_values[MATRIX])
    PetscCall(set_up_iteration(c));

  /* PETSc's log events count the set-up and the iteration */
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  PetscCall(KSPSetUp(c->ksp));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  if (!c->type[0]) {
    if (changed)
      PetscCall(find_most(c));
    c->budget = PetscMin(c->budget + c->most, SAVED * c->most);
    PetscCall(KSPSetTolerances(c->ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT,
                               PetscMin(c->limit, c->budget)));
    if (!c->budget)
      PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  PetscCall(KSPSolve(c->ksp, F, Y));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  PetscCall(KSPGetConvergedReason(c->ksp, reason));
  PetscCall(KSPGetIterationNumber(c->ksp, iterations));
  c->budget -= *iterations;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The factor of the current matrix; ok: it is positive definite. */
static PetscErrorCode factor(SbContactSystem c, PetscBool *ok)
{
  const SbContactRows *rows = &c->rows;

  PetscFunctionBeginUser;
  *ok = PETSC_TRUE;
  if (!c->factor)
    PetscCall(SbBlockSolverCreate(c->space->comm, &c->factor));
  if (c->stale_values[FACTOR]) {
    PetscCall(SbBlockSolverSetUp(c->factor, rows->n, rows->ia, rows->ja, rows->value,
                                 c->stale_pattern[FACTOR], ok));
    c->stale_pattern[FACTOR] = PETSC_FALSE;
  }
  c->stale_values[FACTOR] = (PetscBool) !*ok;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemSolve(SbContactSystem c, Mat K, const SbBlocks *blocks,
                                    PetscBool fresh, Vec F, Vec Y, KSPConvergedReason *reason,
                                    PetscInt *iterations)
{
  PetscBool factored, slow;
  PetscBool ok = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  if (fresh || !c->nsolve)
    PetscCall(merge(c, K, blocks));

  /* factor by choice, if small, while CG pauses, or if a factor of these values exists */
  factored = (PetscBool)(is_factored(c->choice, c->type) ||
                         (!c->type[0] && !c->choice &&
                          (3 * c->space->Nnode <= SMALL || c->nsolve < c->resume ||
                           !c->stale_values[FACTOR])));
  *iterations = 0;
  *reason = KSP_DIVERGED_ITS;
  if (!factored)
    PetscCall(iterate(c, F, Y, reason, iterations));
  slow = (PetscBool)(!factored && *reason == KSP_DIVERGED_ITS && !c->type[0]);
  if (!factored)
    c->pause = slow ? PetscMax(PAUSE, 2 * c->pause) : 0;
  if (slow) {
    c->resume = c->nsolve + c->pause;
    c->budget = 0;
  }
  if (factored || slow) {
    PetscCall(factor(c, &ok));
    if (ok)
      PetscCall(SbBlockSolverSolve(c->factor, F, Y));
    *reason = ok ? KSP_CONVERGED_ITS : KSP_DIVERGED_PC_FAILED;
    ++*iterations;
  }
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemPrecondition(SbContactSystem c, Vec r, Vec z)
{
  PC pc;

  PetscFunctionBeginUser;
  if (c->factor && !c->stale_values[FACTOR])
    PetscCall(SbBlockSolverSolve(c->factor, r, z));
  else if (c->ksp && !c->stale_values[MATRIX]) {
    PetscCall(KSPGetPC(c->ksp, &pc));
    PetscCall(PCApply(pc, r, z));
  } else
    PetscCall(VecSet(z, PETSC_INFINITY));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemGetMatrix(SbContactSystem c, Mat K, const SbBlocks *blocks, Mat *A)
{
  PetscFunctionBeginUser;
  PetscCall(merge(c, K, blocks));
  PetscCall(set_up_iteration(c));
  *A = c->A;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = M^-1 r by the factor. */
static PetscErrorCode apply_factor(PC pc, Vec r, Vec z)
{
  SbContactSystem c;

  PetscFunctionBeginUser;
  PetscCall(PCShellGetContext(pc, &c));
  PetscCall(SbBlockSolverSolve(c->factor, r, z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemSolveConstrained(SbContactSystem c, Mat K, const SbBlocks *blocks,
                                               PetscBool saddle, const SbConstraintRows *rows,
                                               PetscReal weight, Vec F, Vec Y,
                                               KSPConvergedReason *reason, PetscInt *iterations)
{
  PetscInt all = rows->n;
  PetscBool factored;
  PetscBool ok = PETSC_TRUE;
  PC inner = NULL;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPIU_INT, MPI_SUM, c->space->comm));
  if (!all) {
    PetscCall(SbContactSystemSolve(c, K, blocks, PETSC_TRUE, F, Y, reason, iterations));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  PetscCall(merge(c, K, blocks));
  PetscCall(set_up_iteration(c));

  /* a preconditioner of the matrix: its factor, or that of CG */
  factored = (PetscBool)(is_factored(c->choice, c->type) ||
                         (!c->type[0] && !c->choice && 3 * c->space->Nnode <= SMALL));
  if (factored) {
    PetscCall(factor(c, &ok));
    PetscCall(PCCreate(c->space->comm, &inner));
    PetscCall(PCSetType(inner, PCSHELL));
    PetscCall(PCSetOperators(inner, c->A, c->A));
    PetscCall(PCShellSetContext(inner, c));
    PetscCall(PCShellSetApply(inner, apply_factor));
    PetscCall(PCShellSetName(inner, "factor"));
  } else {
    PetscCall(KSPSetUp(c->ksp));
    PetscCall(KSPGetPC(c->ksp, &inner));
    PetscCall(PetscObjectReference((PetscObject)inner));
  }
  *reason = KSP_DIVERGED_PC_FAILED;
  *iterations = 0;
  if (ok)
    PetscCall(SbSolveConstrained(c->A, inner, saddle, rows, weight, F, Y, reason, iterations));
  PetscCall(PCDestroy(&inner));
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_CONTACT_SOLVE], 0, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbContactSystemDestroy(SbContactSystem *system)
{
  SbContactSystem c = *system;

  PetscFunctionBeginUser;
  if (!c)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(KSPDestroy(&c->ksp));
  PetscCall(MatDestroy(&c->A));
  PetscCall(SbBlockSolverDestroy(&c->factor));
  PetscCall(PetscFree2(c->until, c->rows.contact));
  PetscCall(PetscFree2(c->ka, c->kj));
  PetscCall(PetscFree2(c->place, c->tangent));
  PetscCall(PetscFree3(c->rows.ia, c->rows.ja, c->used));
  PetscCall(PetscFree(c->rows.value));
  PetscCall(PetscFree(*system));
  PetscFunctionReturn(PETSC_SUCCESS);
}
