/* sbremesh.h - layer 10: re-meshing of bodies during a run. */
#pragma once
#include "sbledger.h"

/*
  SbRemesh - re-meshing of bodies during a run (src/remesh/remesh.c).

  Order of calls: SbRemeshSetFromOptions() after SbSceneCreate(); SbRemeshAttach() after
  SbRunSetUp() and SbLedgerAttach(), before SbOutputAttach(), whose history gets the column
  remesh_loss; SbRemeshSolve() instead of SbRunSolve(); SbRemeshDestroy().
*/
typedef struct _p_SbRemesh *SbRemesh;
extern const SbOption SbRemeshRows[], SbRemeshBodyRows[];
/* Options read: -remesh_..., -body_<name>_remesh_quality. remesh: NULL when none asks for it.
   Collective. */
PetscErrorCode SbRemeshSetFromOptions(SbModel model, SbRemesh *remesh);
/* NULL: nothing. Not collective. */
PetscErrorCode SbRemeshAttach(SbRemesh remesh, SbRun run);
/*
  The whole time loop or load path, as SbRunSolve(). model, run and ledger (NULL: there is none) are
  replaced when a body is re-meshed; the old ones are destroyed. remesh NULL: SbRunSolve() alone.
  Collective.
*/
PetscErrorCode SbRemeshSolve(SbRemesh remesh, SbModel *model, SbRun *run, SbLedger *ledger);
/*
  SbFinerRun - where the ledger asks for it (SbLedgerWantsFiner()), the same scene once more with P2
  on the same or finer tets, for the error of the ledger's quantity by the mesh. After the static
  run, before SbLedgerReport(). Neither output nor state of the run change. Collective.
*/
PetscErrorCode SbFinerRun(SbRun run, SbLedger ledger);
PetscErrorCode SbRemeshDestroy(SbRemesh *remesh);
