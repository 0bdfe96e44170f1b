/*
  Seconds by source of error, those of the slowest rank.

  space: residuals and tangents; linear: the solves, both without what Newton's iterations beyond the first of a step took, which are the
  nonlinear source's; contact: its search and what it decides; time: the remainder of the loop. Estimates are counted apart, also where they
  call what the run calls.
*/
#include "ledger_impl.h"
#include "sblog.h"

PetscErrorCode SbLedgerGetSeconds(SbLedger l, SbLedgerSeconds *s)
{
  enum { ASSEMBLY, SOLVE, CONTACT, SEARCH, SETUP, OUTPUT, ESTIMATES, TOTAL, COUNT };
  static const struct {
    int to;
    SbEvent event;
  } ours[] = {
    {ASSEMBLY, SB_EVENT_RESIDUAL}, {ASSEMBLY, SB_EVENT_TANGENT},   {CONTACT, SB_EVENT_CONTACT},
    {SEARCH, SB_EVENT_SEARCH},     {SETUP, SB_EVENT_MESH_READ},    {SETUP, SB_EVENT_MESH_DISTRIBUTE},
    {SETUP, SB_EVENT_SPACE_SETUP}, {SETUP, SB_EVENT_MATRIX_SETUP}, {SETUP, SB_EVENT_SOLVER_SETUP},
    {OUTPUT, SB_EVENT_OUTPUT},     {OUTPUT, SB_EVENT_CHECKPOINT},  {SOLVE, SB_EVENT_CONTACT_SOLVE}};
  static const char *const solve[] = {"KSPSolve", "PCSetUp", "PCSetUpOnBlocks"};
  const SbRun run = l->run;
  PetscReal mine[COUNT] = {0.}, t[COUNT], beyond;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(ours); i++)
    PetscCall(SbLogSeconds(SbEvents[ours[i].event], &mine[ours[i].to]));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(solve); i++)
    PetscCall(SbLogSecondsNamed(solve[i], &mine[SOLVE]));
  mine[ASSEMBLY] -= l->residuals;
  mine[SOLVE] -= l->solving;
  mine[CONTACT] -= mine[SEARCH];
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
