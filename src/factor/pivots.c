/*
  CHOLMOD through PETSc raises an error with a trace at a non-positive pivot: a body without
  supports, or a tangent that is indefinite in compression. Here it is a failed factorisation, as
  with other packages: the solve fails, and the step is halved or the run stops with one line. If
  the matrix is gathered on one rank (direct.c), all ranks get the failure. MUMPS can factor
  again after a failure.

  petsc/private/pcimpl.h: the operations of a PC that PETSc implements have no public setter.
*/
#include "sbfactor.h"
#include <petsc/private/pcimpl.h>

#define ORIGINAL "SbPCSetUpOriginal_C"
#define ORIGINAL_APPLY "SbPCApplyOriginal_C"

/* PETSc's error path leaks the arrays that wrap the matrix for CHOLMOD (MatWrapCholmod_seqaij: as
   large as the matrix, at each failed factorisation). A wrapper of PetscTrMalloc records them
   during the factorisation, and they are freed after a failure.

   They are recognised by the name of the function that allocates. PETSc gives no better handle: the
   arrays are local variables of its numeric factorisation, and what the set-up of the PC allocates
   before and keeps (the factor, its ordering) goes through the same allocator in the same call. The
   operation of the numeric factorisation alone cannot be wrapped, since each symbolic one replaces
   it. An SBAIJ matrix needs no such arrays, but costs a copy of the matrix at every factorisation.
   A changed name does no harm but the leak; an array that PETSc frees is forgotten
   (note_release). */
static struct {
  PetscErrorCode (*allocate)(size_t, PetscBool, int, const char[], const char[], void **);
  PetscErrorCode (*release)(void *, int, const char[], const char[]);
  void *wrapped[8];
  int n;
} noted;

static PetscErrorCode note_allocate(size_t size, PetscBool clear, int line, const char function[],
                                    const char file[], void **p)
{
  const PetscErrorCode error = (*noted.allocate)(size, clear, line, function, file, p);

  if (!error && *p && noted.n < (int)PETSC_STATIC_ARRAY_LENGTH(noted.wrapped) &&
      strstr(function, "MatWrapCholmod"))
    noted.wrapped[noted.n++] = *p;
  return error;
}

static PetscErrorCode note_release(void *p, int line, const char function[], const char file[])
{
  for (int k = 0; k < noted.n; k++)
    if (noted.wrapped[k] == p)
      noted.wrapped[k] = NULL;
  return (*noted.release)(p, line, function, file);
}

/* The first error of a set-up. */
typedef struct {
  int line;
  const char *function, *file;
  PetscErrorCode code;
  char text[512];
} First;

static PetscErrorCode keep_first(MPI_Comm comm, int line, const char *function, const char *file,
                                 PetscErrorCode code, PetscErrorType type, const char *text,
                                 void *ctx)
{
  First *first = (First *)ctx;

  (void)comm;
  if (type == PETSC_ERROR_INITIAL) {
    *first = (First){.line = line, .function = function, .file = file, .code = code};
    SbFormat(sizeof(first->text), first->text, "%s", text ? text : "");
  }
  return code;
}

static PetscErrorCode guarded_setup(PC pc)
{
  First first = {.code = PETSC_SUCCESS};
  PetscErrorCode (*original)(PC) = NULL;
  PetscErrorCode error;
  MatFactorError before = MAT_FACTOR_NOERROR;
  MatSolverType package;
  Mat factor;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL, &original));

  // after a failure PETSc treats MUMPS' analysis as failed, and does not factor again: create a new
  // factor
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (package && !strcmp(package, MATSOLVERMUMPS) && pc->setupcalled) {
    PetscCall(PCFactorGetMatrix(pc, &factor));
    PetscCall(MatFactorGetError(factor, &before));
    if (before)
      pc->flag = DIFFERENT_NONZERO_PATTERN;
  }
  noted.allocate = PetscTrMalloc;
  noted.release = PetscTrFree;
  noted.n = 0;
  PetscTrMalloc = note_allocate;
  PetscTrFree = note_release;
  PetscCall(PetscPushErrorHandler(keep_first, &first));
  error = (*original)(pc);
  PetscCall(PetscPopErrorHandler());
  PetscTrMalloc = noted.allocate;
  PetscTrFree = noted.release;
  if (error == PETSC_ERR_MAT_CH_ZRPVT) {
    for (int k = 0; k < noted.n; k++)
      PetscCall(PetscFree(noted.wrapped[k]));
    PetscCall(PCSetFailedReason(pc, PC_FACTOR_NUMERIC_ZEROPIVOT));
    PetscCall(PetscInfo(pc, "CHOLMOD: a pivot is not positive\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  // other errors are reported as usual
  if (error && first.code)
    error = PetscError(PETSC_COMM_SELF, first.line, first.function, first.file, first.code,
                       PETSC_ERROR_INITIAL, "%s", first.text);
  PetscCall(error);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a failed set-up PETSc's solvers continue until NaN; CHOLMOD has no factor to solve with. */
static PetscErrorCode guarded_apply(PC pc, Vec x, Vec y)
{
  PetscErrorCode (*original)(PC, Vec, Vec) = NULL;

  PetscFunctionBeginUser;
  if (pc->failedreason) {
    PetscCall(VecSet(y, PETSC_INFINITY));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL_APPLY, &original));
  PetscCall((*original)(pc, x, y));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Factors in the set-up instead of the first solve, and tells all ranks whether the factorisation
   failed. */
static PetscErrorCode gathered_setup(PC pc)
{
  PetscErrorCode (*original)(PC) = NULL;
  PCFailedReason reason = PC_NOERROR;
  PetscMPIInt failed;
  PC inner;
  KSP ksp;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL, &original));
  PetscCall((*original)(pc));
  PetscCall(PCTelescopeGetKSP(pc, &ksp));
  if (ksp) {
    const char *package;

    /* idle ranks have no inner KSP */
    PetscCall(KSPGetPC(ksp, &inner));

    /* before the first set-up the telescope is empty: wrap the factorisation now */
    PetscCall(PCGetApplicationContext(pc, &package));
    if (package && !inner->setupcalled) {
      PetscCall(PCSetType(inner, strcmp(package, MATSOLVERCHOLMOD) ? PCLU : PCCHOLESKY));
      PetscCall(PCFactorSetMatSolverType(inner, package));
      PetscCall(PCSetFromOptions(inner));
    }
    PetscCall(SbPCCheckPivots(inner));
    PetscCall(PCSetUp(inner));
    PetscCall(PCGetFailedReason(inner, &reason));
  }
  failed = (PetscMPIInt)reason;
  PetscCallMPI(
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)pc)));
  PetscCall(PCSetFailedReason(pc, (PCFailedReason)failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCCheckPivots(PC pc)
{
  PetscBool factored, gathered;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factored, PCCHOLESKY, PCLU, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCTELESCOPE, &gathered));
  if (!factored && !gathered)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (pc->ops->setup == guarded_setup || pc->ops->setup == gathered_setup)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, ORIGINAL, pc->ops->setup));
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, ORIGINAL_APPLY, pc->ops->apply));
  pc->ops->setup = factored ? guarded_setup : gathered_setup;
  pc->ops->apply = guarded_apply;
  PetscFunctionReturn(PETSC_SUCCESS);
}
