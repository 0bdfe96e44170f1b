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
/*
  SbLedgerWantsFiner - whether the error of the quantity by the mesh of a static run that has ended
  is to be found by a second, finer run; if it cannot be, the report says why. Collective; ledger
  NULL: it is not.

  Output: refine - how often the second run divides each tet into eight; all its bodies are P2.

  SbLedgerSetFiner() takes the quantity from that run, after SbRunSolve(), with want_energies and
  want_residual of its monitors; seconds: of the phases of that run, on this rank. Collective.
*/
PetscErrorCode SbLedgerWantsFiner(SbLedger ledger, PetscInt *refine, PetscBool *wanted);
PetscErrorCode SbLedgerSetFiner(SbLedger ledger, SbRun finer,
                                const PetscReal seconds[SB_PHASE_COUNT]);
/* Writes the table as `file`, and prints it unless quiet. NULL: nothing. Collective. */
PetscErrorCode SbLedgerReport(SbLedger ledger, const char *file, PetscBool quiet);
PetscErrorCode SbLedgerDestroy(SbLedger *ledger);
