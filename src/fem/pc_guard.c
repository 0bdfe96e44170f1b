/*
  CHOLMOD through PETSc ends the program with a trace when it meets a pivot that is not positive: a body that nothing holds, or a
  tangent that is indefinite in compression. Here that is a factorisation that failed, like those of other packages: the solve fails, the
  step is cut or the run stops with one line.

  petsc/private/pcimpl.h: the set-up of a PC that PETSc implements has no public setter.
*/
#include "sbsolver.h"
#include <petsc/private/pcimpl.h>

#define ORIGINAL "SbPCSetUpOriginal_C"

static PetscErrorCode guarded_setup(PC pc)
{
  PetscErrorCode (*original)(PC) = NULL;
  PetscErrorCode error;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL, &original));
  PetscCall(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  error = (*original)(pc);
  PetscCall(PetscPopErrorHandler());
  if (error == PETSC_ERR_MAT_CH_ZRPVT) {
    PetscCall(PCSetFailedReason(pc, PC_FACTOR_NUMERIC_ZEROPIVOT));
    PetscCall(PetscInfo(pc, "CHOLMOD: a pivot is not positive\n"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(error); /* what else went wrong is told as ever, but for its trace */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SbPCGuardFactor(PC pc)
{
  PetscErrorCode (*original)(PC) = NULL;
  PetscBool cholesky;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &cholesky));
  PetscCall(PetscObjectQueryFunction((PetscObject)pc, ORIGINAL, &original));
  if (!cholesky || original) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, ORIGINAL, pc->ops->setup));
  pc->ops->setup = guarded_setup;
  PetscFunctionReturn(PETSC_SUCCESS);
}
