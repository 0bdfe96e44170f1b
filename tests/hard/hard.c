/*
  Runs hard cases (hard.h): hard -case NAME [-runs N] [-verbose] [-more "OPTIONS"], or -list.

  -list writes one line per case: name, ranks with commas, quick runs, processor time in s on each
  rank, difficulty, separated by tabs. A case prints one line per limit, which tests/run and
  scripts/stability read:
    limit|case|ranks|runs|quantity|measured|relation|bound|unit
    work|case|run|steps|rejected|Newton|linear iterations|CPU s of rank 0
*/
#include <time.h>
#include "hard.h"
#include "../verify/verify.h"

extern const HardCase HardCasesContact[], HardCasesMaterial[], HardCasesMesh[], HardCasesMotion[],
  HardCasesRecovery[], HardCasesSolver[], HardCasesTime[], HardCasesTouch[];
static const HardCase *const tables[] = {HardCasesContact, HardCasesMaterial, HardCasesMesh,
                                         HardCasesMotion,  HardCasesRecovery, HardCasesSolver,
                                         HardCasesTime,    HardCasesTouch};

/* ------------------------------------------------------------------ the table */

static int case_runs(const HardCase *c)
{
  return c->runs ? c->runs : c->jitter > 0. || c->jitter_speed > 0. ? 10 : 1;
}

static void list_cases(void)
{
  for (size_t t = 0; t < PETSC_STATIC_ARRAY_LENGTH(tables); t++) {
    for (const HardCase *c = tables[t]; c->name; c++) {
      const int *n = c->ranks;

      if (!n[0])
        printf("%s\t1,2,3", c->name);
      else
        printf("%s\t%d", c->name, n[0]);
      for (int k = 1; k < 3 && n[k]; k++)
        printf(",%d", n[k]);
      printf("\t%d\t%d\t%s\n", PetscMin(c->quick, case_runs(c)), c->seconds ? c->seconds : 300,
             c->what);
    }
  }
}

static PetscErrorCode find_case(const char *name, const HardCase **found)
{
  PetscFunctionBeginUser;
  *found = NULL;
  for (size_t t = 0; t < PETSC_STATIC_ARRAY_LENGTH(tables); t++) {
    for (const HardCase *c = tables[t]; c->name; c++) {
      if (strcmp(c->name, name))
        continue;
      PetscCheck(!*found, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "Two cases are called '%s'", name);
      *found = c;
    }
  }
  PetscCheck(*found, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "No case '%s': -list names them",
             name);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ one run */

static PetscErrorCode prepare(HardRun *r, PetscInt k)
{
  const HardCase *c = r->c;

  PetscFunctionBeginUser;
  PetscCall(PetscRandomCreate(PETSC_COMM_SELF, &r->random));
  PetscCall(PetscRandomSetSeed(r->random, 20250101 + (unsigned long)k));
  PetscCall(PetscRandomSeed(r->random));
  PetscCall(HardMeasureBegin(r));
  if (k && c->jitter > 0.)
    PetscCall(HardNoise(r, c->jitter * r->size, r->run->state.U));
  if (k && c->jitter_speed > 0.)
    PetscCall(HardNoise(r, c->jitter_speed, r->run->state.V));
  if (c->start)
    PetscCall((*c->start)(r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Checks that a run ended as the case requires. */
static void check_end(const HardRun *r)
{
  const char *reason = r->run->clock.stop_reason;
  const char *stops = r->c->stops;

  if (!stops)
    SB_CHECK(!reason[0], "%s, run %d: %s", r->c->name, (int)r->k, reason);
  else
    SB_CHECK(strstr(reason, stops), "%s, run %d: should end with '%s', not '%s'", r->c->name,
             (int)r->k, stops, reason);
  SB_CHECK(!r->wild, "%s, run %d: something is not finite", r->c->name, (int)r->k);
}

static PetscErrorCode run_once(const HardCase *c, const char *options, PetscInt k,
                               PetscBool verbose, PetscReal value[])
{
  HardRun r = {.c = c, .k = k, .verbose = verbose};
  const clock_t began = clock();
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(test_scene_open(options, &t));
  r.model = t.model;
  r.run = t.run;
  PetscCall(prepare(&r, k));
  if (c->solve)
    PetscCall((*c->solve)(&r));
  else
    PetscCall(SbRunSolve(r.run));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "work|%s|%d|%d|%d|%d|%d|%.2f\n", c->name, (int)k,
                        (int)t.run->counters.steps, (int)t.run->counters.rejected,
                        (int)t.run->counters.newton, (int)t.run->counters.linear,
                        (double)(clock() - began) / CLOCKS_PER_SEC));
  PetscCall(HardMeasureEnd(&r));
  check_end(&r);
  PetscCall(PetscArraycpy(value, r.value, HARD_QUANTITIES));
  PetscCall(PetscFree(r.ctx));
  PetscCall(PetscRandomDestroy(&r.random));
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* ------------------------------------------------------------------ all runs */

static PetscErrorCode report(const HardCase *c, int runs, const PetscReal worst[])
{
  PetscMPIInt size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  for (const HardLimit *l = c->limits; l->relation; l++) {
    const PetscReal measured = worst[l - c->limits];
    const char *name = l->name ? l->name : HardQuantityName(l->quantity);

    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "limit|%s|%d|%d|%s|%.4g|%c|%g|%s\n", c->name, (int)size,
                          runs, name, (double)measured, l->relation, (double)l->bound,
                          l->unit ? l->unit : ""));
    SB_CHECK(l->relation == '<' ? measured < l->bound : measured > l->bound,
             "%s: %s is %g, not %c %g", c->name, name, (double)measured, l->relation,
             (double)l->bound);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode run_case(const HardCase *c, int runs, const char *more, PetscBool verbose)
{
  char options[HARD_TEXT];
  char path[512] = "";
  PetscReal worst[HARD_LIMITS];

  PetscFunctionBeginUser;
  if (c->mesh)
    PetscCall((*c->mesh)(path));
  (void)snprintf(options, sizeof(options), c->options, path);
  PetscCall(PetscStrlcat(options, " ", sizeof(options)));
  PetscCall(PetscStrlcat(options, more, sizeof(options)));
  PetscCheck(strlen(options) < HARD_TEXT - 1, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "The options of %s have more than %d characters", c->name, HARD_TEXT);
  for (PetscInt k = 0; k < runs; k++) {
    PetscReal value[HARD_QUANTITIES];

    PetscCall(run_once(c, options, k, verbose, value));
    for (const HardLimit *l = c->limits; l->relation; l++) {
      const PetscReal now = value[l->quantity];
      const PetscReal before = worst[l - c->limits];
      const PetscBool holds = (PetscBool)(l->relation == '<' ? now < l->bound : now > l->bound);
      const PetscBool worse = (PetscBool)(l->relation == '<' ? !(now <= before) : !(now >= before));

      worst[l - c->limits] = !k || worse ? now : before;
      if (!holds)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  run %d: %s %g\n", (int)k,
                              l->name ? l->name : HardQuantityName(l->quantity), (double)now));
    }
  }
  PetscCall(report(c, runs, worst));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char name[128];
  char more[HARD_TEXT] = "";
  PetscBool named, list, verbose;
  PetscInt runs = 0;
  const HardCase *c;

  SB_TEST_BEGIN(argc, argv);
  PetscCall(PetscOptionsHasName(NULL, NULL, "-list", &list));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-verbose", &verbose));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-case", name, sizeof(name), &named));

  /* options after -more must not be parsed by PETSc */
  for (int i = 1; i + 1 < argc; i++)
    if (!strcmp(argv[i], "-more"))
      PetscCall(PetscStrncpy(more, argv[i + 1], sizeof(more)));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-runs", &runs, NULL));
  if (list) {
    list_cases();
    return PetscFinalize() ? 1 : 0;
  }
  PetscCheck(named, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "Give -case NAME, or -list");
  PetscCall(find_case(name, &c));
  PetscCall(run_case(c, runs ? (int)runs : case_runs(c), more, verbose));
  SB_TEST_END();
}
