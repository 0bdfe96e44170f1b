/*
  sbledger.h - layer 9: error estimates of a run by source, beside the seconds spent on each.

  Errors are in the norm of the energy: the square of an error is its energy, J, as a strain and a
  velocity of the bodies; relative is the root of its share of the largest energy, kinetic and
  strain, of the run so far (static: of the strain energy).

  The ledger examines each solved step (SbRunMonitors.post_solve) and is a monitor. Without -ledger,
  -accuracy or -step_time_budget there is none: no vector, no callback, no column. With -ledger
  alone it changes no result.

  Order of calls: SbRunCreate(), SbLedgerSetFromOptions(), SbModelSetUp(), SbRunSetUp(),
  SbLedgerAttach(), SbOutputAttach(), SbRunSolve(), SbLedgerReport(), SbLedgerDestroy().
*/
#pragma once
#include "sbtime.h"

typedef struct _p_SbLedger *SbLedger;

extern const SbOption SbLedgerRows[];
/*
  SbLedgerSetFromOptions - reads the options -ledger, -ledger_..., -accuracy, -step_time_budget.
  Collective.

  Output: ledger, NULL when none of them asks for one. Errors (PETSC_ERR_USER_INPUT): -accuracy and
  -step_time_budget; -time alpha2.
*/
PetscErrorCode SbLedgerSetFromOptions(SbRun run, SbLedger *ledger);
/* After SbRunSetUp(), before SbOutputAttach(), whose history has its columns. NULL: nothing.
   Collective. */
PetscErrorCode SbLedgerAttach(SbLedger ledger);
/* `to`, attached, continues the sums of errors and work of `from`, on a re-meshed model. Not
   collective. */
PetscErrorCode SbLedgerContinue(SbLedger from, SbLedger to);
/* Writes the table as `file`, and prints it unless quiet. NULL: nothing. Collective. */
PetscErrorCode SbLedgerReport(SbLedger ledger, const char *file, PetscBool quiet);
PetscErrorCode SbLedgerDestroy(SbLedger *ledger);
