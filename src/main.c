/*
  main.c - the program from its first to its last call.

    supple SCENARIO.opts [-option value ...]          or     mpirun -n 4 supple SCENARIO.yml

  Options are read and checked before anything is computed; a run that gives up keeps its output and ends with an error
  line and a non-zero code. Open MPI refuses to start as root unless OMPI_ALLOW_RUN_AS_ROOT=1 and
  OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 are set.
*/
#include <signal.h>
#include "sb.h"

/* -help, -version, -options_markdown: answers, and nothing is simulated. */
static PetscErrorCode answer(const SbCommand *command, PetscBool *answered)
{
  char petsc[256];

  PetscFunctionBeginUser;
  *answered = PETSC_TRUE;
  if (command->help) {
    PetscCall(SbOptionsHelp(PETSC_COMM_WORLD));
  } else if (command->version) {
    PetscCall(PetscGetVersion(petsc, sizeof(petsc)));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "supple %s\n%s\n", SB_VERSION, petsc));
  } else if (command->markdown[0]) {
    PetscCall(SbOptionsMarkdown(PETSC_COMM_WORLD, command->markdown));
  } else
    *answered = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Everything that options say, checked. Nothing is computed yet. */
static PetscErrorCode read_scenario(SbModel *model, SbRun *run, SbLedger *ledger)
{
  PetscFunctionBeginUser;
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, model));
  PetscCall(SbRunCreate(*model, run));
  PetscCall(SbLedgerSetFromOptions(*run, ledger));
  PetscCall(SbOutputSetFromOptions(*run));
  PetscCall(SbOptionsCheck());
  PetscCall(SbSceneCheck(*model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode view_scenario(const char *file)
{
  PetscViewer viewer;

  PetscFunctionBeginUser;
  PetscCall(SbViewerOpen(PETSC_COMM_WORLD, file, &viewer));
  PetscCall(SbOptionsView(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The run failed: says so in its folder. */
static void report_failure(const char *message, void *run)
{
  (void)SbReportFailure((SbRun)run, message);
}

static PetscErrorCode simulate(SbModel model, SbRun run, SbLedger ledger)
{
  char file[PETSC_MAX_PATH_LEN];
  PetscBool quiet;

  PetscFunctionBeginUser;
  SbErrorSetFarewell(report_failure, run);
  PetscCall(PetscLogStagePush(SbStageSetup));
  PetscCall(SbModelSetUp(model));
  PetscCall(SbSceneValidate(model));
  PetscCall(SbRunSetUp(run));
  PetscCall(SbLedgerAttach(ledger));
  PetscCall(SbOutputAttach(run));
  PetscCall(PetscLogStagePop());
  PetscCall(SbReportHeader(run));
  PetscCall(SbRunSolve(run));
  PetscCall(SbReportSummary(run));
  PetscCall(SbOutputFile(run, "ledger.csv", sizeof(file), file, &quiet));
  PetscCall(SbLedgerReport(ledger, file, quiet));
  SbErrorSetFarewell(NULL, NULL);
  if (run->stop_reason[0]) SbErrorPost("%s", run->stop_reason);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode supple(int argc, char *argv[])
{
  SbCommand command;
  SbModel model = NULL;
  SbRun run = NULL;
  SbLedger ledger = NULL;
  PetscBool answered, left;
  PetscInt unused;

  PetscFunctionBeginUser;
  PetscCall(SbErrorHandlerInstall());
  PetscCall(SbCommandLine(&argc, argv, &command));
  PetscCall(PetscInitialize(&argc, &argv, command.scenario[0] ? command.scenario : NULL, NULL));
  SbMemoryReturnLarge();
  (void)signal(SIGPIPE, SIG_IGN); /* a terminal that is gone must not end a run that writes files */
  PetscCheck(!command.problem[0], PETSC_COMM_SELF, PETSC_ERR_USER, "%s", command.problem);
  PetscCall(SbOptionsRemember());
  PetscCall(PetscOptionsHasName(NULL, NULL, "-options_left", &left));
  if (!left) PetscCall(PetscOptionsSetValue(NULL, "-options_left", "no")); /* SbOptionsUnused() says it */
  PetscCall(SbRegisterAll());
  PetscCall(SbErrorSetFromOptions());

  PetscCall(answer(&command, &answered));
  if (!answered) {
    PetscCall(read_scenario(&model, &run, &ledger));
    if (command.view)
      PetscCall(view_scenario(command.view_file));
    else
      PetscCall(simulate(model, run, ledger));
    PetscCall(SbLedgerDestroy(&ledger));
    PetscCall(SbRunDestroy(&run));
    PetscCall(SbModelDestroy(&model));
    if (!command.view) PetscCall(SbOptionsUnused(PETSC_COMM_WORLD, &unused));
  }
  PetscCall(PetscFinalize());
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  if (MPI_Init(&argc, &argv)) return 1;
  return SbErrorFinish(supple(argc, argv));
}
