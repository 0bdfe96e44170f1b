/*
  Seconds by source of error, on the slowest rank.

  space: residuals and tangents; linear: linear solves; nonlinear: both of these in Newton's iterations after the first of a step;
  contact: search and active-set decisions; time: the remainder of the loop. Estimates are counted separately, including their
  residuals and solves.
*/
#include "ledger_impl.h"
#include "sblog.h"

PetscErrorCode SbLedgerGetSeconds(SbLedger l, SbLedgerSeconds *s)
{
  enum { ASSEMBLY, SOLVE, CONTACT, SEARCH, SETUP, OUTPUT, ESTIMATES, TOTAL, COUNT };
  const SbRun run = l->run;
  PetscReal phase[SB_PHASE_COUNT], mine[COUNT], t[COUNT], beyond;

  PetscFunctionBeginUser;
  PetscCall(SbLogSeconds(phase));
  mine[ASSEMBLY] = phase[SB_PHASE_RESIDUAL] + phase[SB_PHASE_TANGENT] - l->residuals;
  mine[SOLVE] = phase[SB_PHASE_SOLVE] - l->solving;
  mine[CONTACT] = phase[SB_PHASE_CONTACT];
  mine[SEARCH] = phase[SB_PHASE_SEARCH];
  mine[SETUP] = phase[SB_PHASE_MESH] + phase[SB_PHASE_SETUP];
  mine[OUTPUT] = phase[SB_PHASE_OUTPUT];
  mine[ESTIMATES] = l->seconds;
  mine[TOTAL] = run->seconds_solve;
  for (int i = 0; i < COUNT; i++) mine[i] = PetscMax(mine[i], 0.);
  PetscCallMPI(MPI_Allreduce(mine, t, COUNT, MPIU_REAL, MPI_MAX, run->model->comm));
  beyond = run->newton_total > run->steps_total
             ? 1. - (PetscReal)PetscMax(run->steps_total, 1) / (PetscReal)run->newton_total
             : 0.;
  *s =
    (SbLedgerSeconds){.search = t[SEARCH], .setup = t[SETUP], .output = t[OUTPUT], .estimates = t[ESTIMATES]};
  s->total = t[TOTAL] + t[SETUP];
  s->source[SB_ERROR_SPACE] = (1. - beyond) * t[ASSEMBLY];
  s->source[SB_ERROR_LINEAR] = (1. - beyond) * t[SOLVE];
  s->source[SB_ERROR_NONLINEAR] = beyond * (t[ASSEMBLY] + t[SOLVE]);
  s->source[SB_ERROR_CONTACT] = t[CONTACT] + t[SEARCH];
  s->source[SB_ERROR_TIME] =
    PetscMax(0., t[TOTAL] - t[ASSEMBLY] - t[SOLVE] - t[CONTACT] - t[SEARCH] - t[OUTPUT] - t[ESTIMATES]);
  PetscFunctionReturn(PETSC_SUCCESS);
}
