/*
  idle.c - absolute tolerances, of PETSc's options, that are above all loads: a run that begins
  without an iteration is told so.
*/
#include "time_impl.h"

PetscErrorCode SbRunWarnIdle(SbRun run, const char *option, PetscReal norm, const char *what)
{
  PetscReal atol;
  PetscBool given;

  PetscFunctionBeginUser;
  if (run->solve.warned_idle || run->counters.linear + run->counters.linear_step ||
      norm <= run->solve.rounding)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsGetReal(NULL, NULL, option, &atol, &given));
  if (!given || norm > atol)
    PetscFunctionReturn(PETSC_SUCCESS);
  run->solve.warned_idle = PETSC_TRUE;
  PetscCall(SbWarning(run->model->comm,
                      "%s %g N lets the run begin without an iteration, as %s of %.3g N is "
                      "below: loads and motions have no effect until it is above. Give less, at "
                      "least %.1g N, or leave it out",
                      option, (double)atol, what, (double)norm, (double)run->solve.rounding));
  PetscFunctionReturn(PETSC_SUCCESS);
}
