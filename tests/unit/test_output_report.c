// Printed report: header, progress, final table within 80 columns; run.json at the start, at the
// end, after a failure.
#include "output_fixture.h"

static char dir[512];

/* Runs `call` and stores PETSc's output in a text. */
#define CAPTURE(text, call)                         \
  do {                                              \
    FILE *stdout_ = PETSC_STDOUT;                   \
    size_t size_;                                   \
    PETSC_STDOUT = open_memstream(&(text), &size_); \
    call;                                           \
    (void)fclose(PETSC_STDOUT);                     \
    PETSC_STDOUT = stdout_;                         \
  } while (0)

static void check_width(const char *text, const char *what)
{
  for (const char *line = text; *line;) {
    const int n = (int)strcspn(line, "\r\n");

    SB_CHECK(n <= 79, "%s: %d columns in '%.*s'", what, n, n, line);
    line += n + (line[n] != 0);
  }
}

static PetscErrorCode run_steps(TestScene *scene)
{
  PetscFunctionBeginUser;
  for (PetscInt k = 0; k <= 10; k++)
    PetscCall(fixture_step(scene, k, 0.1, (PetscBool)(k == 10)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_report(void)
{
  TestScene scene;
  char *header, *progress, *summary, *json;
  const char *cpu;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir, HELD " -time euler_implicit -ts_dt 0.1 -ts_max_time 1 -probes p -probe_p_at 0,0,0",
    &scene));
  PetscCall(fixture_read(dir, "run.json", &json));
  SB_CHECK(strstr(json, "\"status\": \"running\"") && strstr(json, "\"petsc\": \"3."),
           "run.json at the start: %s", json);
  PetscCall(PetscFree(json));
  CAPTURE(header, PetscCall(SbReportHeader(scene.run)));
  CAPTURE(progress, PetscCall(run_steps(&scene)));
  CAPTURE(summary, PetscCall(SbReportSummary(scene.run)));
  if (!test_rank) {
    static const char *const in_header[] = {"supple " SB_VERSION " with PETSc 3.",
                                            "48        30        90",
                                            "linear",
                                            "1000",
                                            "0.25",
                                            "effects    hold (fixed)",
                                            "euler_implicit",
                                            "solver     ",
                                            "probe      p at vertex"};
    static const char *const in_summary[] = {
      "mesh ",  "set-up ", "residual ", "tangent ",   "linear solve ", "output ",
      "other ", "total ",  "memory ",   "fields.h5 ", "history.csv "};

    check_width(header, "header");
    check_width(progress, "progress");
    check_width(summary, "summary");
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(in_header); i++)
      SB_CHECK(strstr(header, in_header[i]), "no '%s' in the header:\n%s", in_header[i], header);
    for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(in_summary); i++)
      SB_CHECK(strstr(summary, in_summary[i]), "no '%s' in the summary:\n%s", in_summary[i],
               summary);

    // the first and the last step: the others follow within two seconds
    SB_CHECK(strstr(progress, "0/10 ") && strstr(progress, "10/10 "), "progress:\n%s", progress);
    SB_CHECK(strstr(progress, " 2.0 ") && strstr(progress, "30.0"), "iterations per step:\n%s",
             progress);
  } else
    SB_CHECK(!header[0] && !progress[0] && !summary[0], "rank %d prints", (int)test_rank);
  PetscCall(fixture_read(dir, "run.json", &json));
  SB_CHECK(strstr(json, "\"status\": \"completed\"") && strstr(json, "\"steps\": 10") &&
             strstr(json, "\"linear solve\": "),
           "run.json at the end: %s", json);
  cpu = strstr(json, "\"cpu_seconds_max\": ");
  SB_CHECK(cpu && strtod(strchr(cpu, ':') + 1, NULL) > 0, "CPU seconds in run.json: %s",
           cpu ? cpu : "none");
  PetscCall(PetscFree(json));
  free(header);
  free(progress);
  free(summary);
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Numbers of nodes and unknowns depend on the element: 30 vertices, 124 faces, 48 cells with four
   each. */
static PetscErrorCode test_elements(void)
{
  static const struct {
    const char *element, *in_header, *in_json;
  } cases[] = {
    {"p1", "p1            48        30        90", "\"nodes\": 30, \"unknowns\": 90,"},
    {"cr", "cr            48       124       372", "\"nodes\": 124, \"unknowns\": 372,"},
    {"dg", "dg            48       192       576", "\"nodes\": 192, \"unknowns\": 576,"},
  };
  TestScene scene;
  char *header, *json;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(cases); i++) {
    PetscCall(test_open_in(
      dir, &scene,
      BOX " -time euler_implicit -ts_dt 0.1 -ts_max_time 1 -progress false -body_a_element %s",
      cases[i].element));
    CAPTURE(header, PetscCall(SbReportHeader(scene.run)));
    SB_CHECK(test_rank || strstr(header, cases[i].in_header), "no '%s' in the header:\n%s",
             cases[i].in_header, header);
    check_width(header, "header");
    PetscCall(fixture_read(dir, "run.json", &json));
    SB_CHECK(strstr(json, cases[i].in_json), "no '%s' in run.json: %s", cases[i].in_json, json);
    PetscCall(PetscFree(json));
    free(header);
    PetscCall(test_scene_close(&scene));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_early_end(void)
{
  TestScene scene;
  char *summary, *json;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open_in(
    dir, BOX " -time euler_implicit -ts_dt 0.1 -ts_max_time 1 -progress false", &scene));
  SB_CHECK(scene.run->monitors.n == 2, "%d monitors without progress", (int)scene.run->monitors.n);
  PetscCall(PetscStrncpy(scene.run->clock.stop_reason, "the \"solver\" gave\nup",
                         sizeof(scene.run->clock.stop_reason)));
  CAPTURE(summary, PetscCall(SbReportSummary(scene.run)));
  SB_CHECK(test_rank || strstr(summary, "stopped    the \"solver\""), "summary:\n%s", summary);
  PetscCall(fixture_read(dir, "run.json", &json));
  SB_CHECK(strstr(json, "\"status\": \"stopped\"") &&
             strstr(json, "\"reason\": \"the \\\"solver\\\" gave\\u000aup\""),
           "run.json: %s", json);
  PetscCall(PetscFree(json));
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  if (!test_rank)
    PetscCall(SbReportFailure(scene.run, "disk full"));
  PetscCall(fixture_read(dir, "run.json", &json));
  SB_CHECK(strstr(json, "\"status\": \"failed\"") && strstr(json, "\"reason\": \"disk full\""),
           "run.json: %s", json);
  PetscCall(PetscFree(json));
  free(summary);
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode test_quiet(void)
{
  TestScene scene;
  char *text;

  PetscFunctionBeginUser;
  CAPTURE(text, {
    PetscCall(test_scene_open_in(dir, BOX EULER, &scene));
    PetscCall(SbReportHeader(scene.run));
    PetscCall(run_steps(&scene));
    PetscCall(SbReportSummary(scene.run));
  });
  SB_CHECK(!text[0], "-quiet prints: %s", text);
  free(text);
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Spends so many seconds. */
static void spend(double seconds)
{
  const double end = MPI_Wtime() + seconds;

  while (MPI_Wtime() < end)
    continue;
}

/* Phases are parts of the whole: also where one is within another, and where ranks are in different
   ones. */
static PetscErrorCode test_phases(void)
{
  TestScene scene;
  SbPhases phases;
  PetscReal sum = 0.;
  PetscLogEvent setup;
  const PetscLogEvent own = SbEvents[test_rank ? SB_EVENT_RESIDUAL : SB_EVENT_ENERGY];

  PetscFunctionBeginUser;
  PetscCall(
    test_scene_open_in(dir, HELD " -time euler_implicit -ts_dt 0.1 -ts_max_time 1", &scene));
  PetscCall(PetscLogEventGetId("PCSetUp", &setup));
  PetscCall(PetscLogEventBegin(setup, 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(SbEvents[SB_EVENT_SOLVER_SETUP], 0, 0, 0, 0));
  spend(0.2);
  PetscCall(PetscLogEventEnd(SbEvents[SB_EVENT_SOLVER_SETUP], 0, 0, 0, 0));
  PetscCall(PetscLogEventEnd(setup, 0, 0, 0, 0));
  PetscCall(PetscLogEventBegin(own, 0, 0, 0, 0));
  spend(0.2);
  PetscCall(PetscLogEventEnd(own, 0, 0, 0, 0));
  PetscCall(SbPhasesGet((SbOutput)scene.run->monitors.output, &phases));
  for (int i = 0; i < SB_PHASE_COUNT; i++)
    sum += phases.seconds[i];
  SB_CHECK(sum <= phases.total * (1. + 1e-9), "phases of %g s in %g s", (double)sum,
           (double)phases.total);
  PetscCall(test_scene_close(&scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(test_file_folder(dir));
  PetscCall(test_phases()); // first: events count from the start of the program
  PetscCall(test_report());
  PetscCall(test_elements());
  PetscCall(test_early_end());
  PetscCall(test_quiet());
  PetscCall(SbOptionsReset());
  SB_TEST_END();
}
