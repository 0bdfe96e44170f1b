/*
  Why a run ends before its end: the reason that it gives, and when steps are no longer worth halving.
*/
#include <stdarg.h>
#include "time_impl.h"

PetscErrorCode SbRunFail(SbRun run, const char *format, ...)
{
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(PetscVSNPrintf(run->stop_reason, sizeof(run->stop_reason), format, NULL, args));
  va_end(args);
  PetscCall(PetscInfo(NULL, "%s\n", run->stop_reason));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool SbRunTooShort(SbRun run, PetscReal dt)
{
  return (PetscBool)(run->rejected_inverted &&
                     dt < 0.999 * PetscPowReal(0.5, (PetscReal)run->max_halvings) * run->dt);
}
