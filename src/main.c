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
    PetscCall(SbOptionsHelp(PETSC_COMM_WORLD, command->topic));
  } else if (command->version) {
    PetscCall(PetscGetVersion(petsc, sizeof(petsc)));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "supple %s\n%s\n", SB_VERSION, petsc));
  } else if (command->markdown[0]) {
    PetscCall(SbOptionsMarkdown(PETSC_COMM_WORLD, command->markdown));
  } else
    *answered = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What there is of a simulation; re-meshing replaces the first three. */
typedef struct {
  SbModel model;
  SbRun run;
  SbLedger ledger;
  SbRemesh remesh;
} Scene;

/* Everything that options say, checked. Nothing is computed yet. */
static PetscErrorCode read_scenario(Scene *s)
{
  PetscFunctionBeginUser;
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &s->model));
  PetscCall(SbRunCreate(s->model, &s->run));
  PetscCall(SbLedgerSetFromOptions(s->run, &s->ledger));
  PetscCall(SbRemeshSetFromOptions(s->model, &s->remesh));
  PetscCall(SbOutputSetFromOptions(s->run));
  PetscCall(SbOptionsCheck());
  PetscCall(SbSceneCheck(s->model));
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
static void report_failure(const char *message, void *scene)
{
  (void)SbReportFailure(((Scene *)scene)->run, message);
}

static PetscErrorCode simulate(Scene *s)
{
  char file[PETSC_MAX_PATH_LEN];
  PetscBool quiet;

  PetscFunctionBeginUser;
  SbErrorSetFailureHandler(report_failure, s);
  PetscCall(PetscLogStagePush(SbStageSetup));
  PetscCall(SbOutputRestoreMeshes(s->run));
  PetscCall(SbModelSetUp(s->model));
  PetscCall(SbSceneValidate(s->model));
  PetscCall(SbRunSetUp(s->run));
  PetscCall(SbLedgerAttach(s->ledger));
  PetscCall(SbRemeshAttach(s->remesh, s->run));
  PetscCall(SbOutputAttach(s->run));
  PetscCall(PetscLogStagePop());
  PetscCall(SbReportHeader(s->run));
  PetscCall(SbRemeshSolve(s->remesh, &s->model, &s->run, &s->ledger));
  PetscCall(SbReportSummary(s->run));
  PetscCall(SbOutputFile(s->run, "ledger.csv", sizeof(file), file, &quiet));
  PetscCall(SbLedgerReport(s->ledger, file, quiet));
  SbErrorSetFailureHandler(NULL, NULL);
  if (s->run->stop_reason[0]) SbErrorPost("%s", s->run->stop_reason);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode supple(int argc, char *argv[])
{
  SbCommand command;
  static Scene scene; /* an error that ends the program asks for it */
  const PetscBool bare = (PetscBool)(argc < 2);
  PetscBool answered, left;
  PetscInt unused;

  PetscFunctionBeginUser;
  PetscCall(SbErrorHandlerInstall());
  PetscCall(SbCommandLine(&argc, argv, &command));
  PetscCall(PetscInitialize(&argc, &argv, command.scenario[0] ? command.scenario : NULL, NULL));
  SbMemoryReturnLarge();
  (void)SbThreadsSetOne();
  (void)signal(SIGPIPE, SIG_IGN); /* a terminal that is gone must not end a run that writes files */
  PetscCheck(!command.problem[0], PETSC_COMM_SELF, PETSC_ERR_USER, "%s", command.problem);
  PetscCall(SbOptionsRemember());
  PetscCall(PetscOptionsHasName(NULL, NULL, "-options_left", &left));
  if (!left) PetscCall(PetscOptionsSetValue(NULL, "-options_left", "no")); /* SbOptionsUnused() says it */
  PetscCall(SbRegisterAll());
  PetscCall(SbErrorSetFromOptions());
  for (PetscInt i = 0; i < command.nfile; i++) PetscCall(SbOptionsFile(PETSC_COMM_WORLD, command.file[i]));

  if (bare)
    PetscCall(SbOptionsHelp(PETSC_COMM_WORLD, "")); /* and then the error that there is nothing to run */
  PetscCall(answer(&command, &answered));
  if (!answered) {
    PetscCall(read_scenario(&scene));
    if (command.view)
      PetscCall(view_scenario(command.view_file));
    else
      PetscCall(simulate(&scene));
    PetscCall(SbRemeshDestroy(&scene.remesh));
    PetscCall(SbLedgerDestroy(&scene.ledger));
    PetscCall(SbRunDestroy(&scene.run));
    PetscCall(SbModelDestroy(&scene.model));
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
