/*
  main.c - main program of supple.

    supple SCENARIO.opts [-option value ...]          or     mpirun -n 4 supple SCENARIO.yml

  Options are read and checked before the computation; a run that fails keeps its output and ends
  with an error line and a non-zero code. Open MPI refuses to start as root unless
  OMPI_ALLOW_RUN_AS_ROOT=1 and OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 are set.
*/
#include <hdf5.h>
#include <signal.h>
#include "sb.h"
#include "version.h"

/* Objects of a simulation; re-meshing replaces the first three. */
typedef struct {
  SbModel model;
  SbRun run;
  SbLedger ledger;
  SbRemesh remesh;
} Scene;

/* Failure handler: writes the failure to the folder of the run. */
static void report_failure(const char *message, void *scene)
{
  (void)SbReportFailure(((Scene *)scene)->run, message);
}

static PetscErrorCode simulate(Scene *s)
{
  char file[PETSC_MAX_PATH_LEN];
  PetscBool quiet, overlap, show;

  PetscFunctionBeginUser;
  SbErrorSetFailureHandler(report_failure, s);

  /* set-up: meshes of a restart, space, integrator, monitors */
  PetscCall(PetscLogStagePush(SbLogStageSetup));
  PetscCall(SbOutputLock(s->run));
  PetscCall(SbOutputRestoreMeshes(s->run));
  PetscCall(SbModelSetUp(s->model));
  PetscCall(SbSceneCheckSizes(s->model));
  PetscCall(SbRunSetUp(s->run));
  PetscCall(SbOutputLoadState(s->run));
  PetscCall(SbSceneWarnOverlap(s->run, "at the start", &overlap));
  PetscCall(SbLedgerAttach(s->ledger));
  PetscCall(SbRemeshAttach(s->remesh, s->run));
  PetscCall(SbRunCatchSignals(s->run));
  PetscCall(SbOutputAttach(s->run));
  PetscCall(PetscLogStagePop());

  /* run, from header to summary */
  PetscCall(SbReportHeader(s->run));
  PetscCall(SbOptionBool(&SbRunScope, "show", &show));
  if (show) {
    PetscCall(SbSceneShow(s->run));
    PetscCall(SbRunShow(s->run));
    PetscCall(SbReportShown(s->run));
    SbErrorSetFailureHandler(NULL, NULL);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(SbRemeshSolve(s->remesh, &s->model, &s->run, &s->ledger));
  PetscCall(SbReportSummary(s->run));
  if (!overlap)
    PetscCall(SbSceneWarnOverlap(s->run, "at the end", &overlap));
  PetscCall(SbFinerRun(s->run, s->ledger));
  SbOutputFile(s->run, "ledger.csv", file, &quiet);
  PetscCall(SbLedgerReport(s->ledger, file, quiet));
  SbErrorSetFailureHandler(NULL, NULL);
  if (s->run->clock.stop_reason[0])
    SbErrorPost(s->run->clock.stopped, s->run->clock.stop_reason);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode supple(MPI_Comm comm, int argc, char *argv[])
{
  SbCommand command;
  static Scene scene; /* static: used by the failure handler */
  const PetscBool bare = (PetscBool)(argc < 2);
  PetscErrorCode ierr;
  PetscBool left, trace;
  PetscInt unused;

  PetscFunctionBeginUser;

  /* initialise libraries and error handling */
  PetscCall(SbErrorHandlerInstall(comm, "supple"));
  PetscCall(SbCommandLine(comm, &argc, argv, &command));
  PETSC_COMM_WORLD = comm; /* where PETSc begins */
  ierr = SbOptionsInitialize(&argc, &argv, command.scenario);
  if (ierr)
    SbErrorFindYamlLine();
  PetscCall(ierr);
  PetscCall(SbErrorCatchCrashes());
  SbMemoryReturnLarge();
  (void)SbThreadsSetOne();
  (void)signal(SIGPIPE, SIG_IGN); /* a closed terminal must not end a run that writes files */

  /* register and read options */
  PetscCheck(!command.problem[0], PETSC_COMM_SELF, PETSC_ERR_USER, "%s", command.problem);
  PetscCall(SbOptionsRemember());
  PetscCall(PetscOptionsHasName(NULL, NULL, "-options_left", &left));
  if (!left)
    PetscCall(PetscOptionsSetValue(NULL, "-options_left", "no")); /* SbOptionsUnused() does it */
  PetscCall(SbRegisterAll());
  PetscCall(SbOptionBool(&SbRunScope, "error_trace", &trace));
  SbErrorSetTrace(trace);
  if (!trace)
    (void)H5Eset_auto2(H5E_DEFAULT, NULL, NULL); /* errors have a message without HDF5's stack */
  for (PetscInt i = 0; i < command.nfile; i++)
    PetscCall(SbOptionsFile(comm, command.file[i]));

  if (bare)
    PetscCall(SbOptionsHelp(comm, "")); /* followed by the error that there is nothing to run */

  /* -help, -version, -options_table: print, without a simulation */
  if (command.help) {
    PetscCall(SbOptionsHelp(comm, command.help));
  } else if (command.version) {
    PetscCall(SbVersionPrint(comm, "supple"));
    PetscCall(SbStandardOutputCheck(comm));
  } else if (command.table) {
    PetscCall(SbOptionsTable(comm, command.table));
  } else {
    /* check options; nothing is computed yet */
    PetscCall(SbSceneCreate(comm, &scene.model));
    PetscCall(SbRunCreate(scene.model, &scene.run));
    PetscCall(SbLedgerSetFromOptions(scene.run, &scene.ledger));
    PetscCall(SbRemeshSetFromOptions(scene.model, &scene.remesh));
    PetscCall(SbOutputSetFromOptions(scene.run, command.nfile ? command.file[0] : ""));
    PetscCall(SbOptionsCheck());
    PetscCall(SbSceneCheck(scene.model));

    /* print the scenario with all defaults, or run the simulation */
    if (command.view) {
      PetscViewer viewer;

      PetscCall(SbViewerOpen(comm, command.view, &viewer));
      PetscCall(SbOptionsView(viewer));
      PetscCall(SbViewerClose(comm, command.view, &viewer));
    } else
      PetscCall(simulate(&scene));

    /* clean up; report unread options */
    PetscCall(SbRemeshDestroy(&scene.remesh));
    PetscCall(SbLedgerDestroy(&scene.ledger));
    PetscCall(SbRunDestroy(&scene.run));
    PetscCall(SbModelDestroy(&scene.model));
    if (!command.view)
      PetscCall(SbOptionsUnused(comm, &unused));
  }
  PetscCall(SbOptionsReset());
  PetscCall(PetscFinalize());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  // Open MPI would create an unused lock file for each HDF5 file, and abort above 255 characters of
  // path
  (void)setenv("OMPI_MCA_sharedfp", "^lockedfile", 0);
  if (!SbMemoryIsEnough("supple") || MPI_Init(&argc, &argv))
    return 1;
  return SbErrorFinish(supple(MPI_COMM_WORLD, argc, argv));
}
