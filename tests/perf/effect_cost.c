/*
  Cost of each effect, element, material, integrator, field and other output on one scene, by
  alternate runs with and without it.

    effect_cost -mesh box:0.4,0.1,0.1:8 -rounds 3 -folder DIR [-family effect]

  Output goes to DIR. The scene and the options of each part are in tests/parts.h, which lists them
  from the registries. Every run has eight steps; the first one, with the set-up of the solver, is
  excluded. Per round and part:

    FAMILY/NAME/without   ms of CPU time per step without it
    FAMILY/NAME/with      the same with it
    FAMILY/NAME/own       ms per step within its own log event, if it has one in steps
    FAMILY/NAME/setup     additional bytes in use at the end of the set-up
    FAMILY/NAME/step      additional bytes allocated per step, most of them freed when it ends

  A run without serves up to three parts of the same scene that follow it. Memory of MUMPS, METIS
  and HDF5 is not included.
*/
#include "../parts.h"
#include "perf.h"

#define SHARE 3 /* parts that share a run without them */

typedef struct {
  double ms[64]; /* CPU time of each step but the first */
  PetscInt n;
  double before;             /* CPU time at the end of the last step, s */
  double own;                /* ms per step in the part's log event */
  double setup, step;        /* bytes in use after set-up; bytes allocated per step */
  double bytes, seconds_own; /* allocated before the second step; in the event, s */
  const char *event;
} Cost;

static char folder[PETSC_MAX_PATH_LEN];
static PetscInt tets; /* of the bar alone: the first scene */

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Cost *cost = (Cost *)ctx;
  const double now = perf_seconds(CLOCK_PROCESS_CPUTIME_ID);
  PetscLogDouble seconds = 0.;
  PetscInt count = 0;

  PetscFunctionBeginUser;
  (void)run;
  if (cost->event)
    PetscCall(part_event(cost->event, &count, &seconds));
  if (step->step > 1 && cost->n < 64)
    cost->ms[cost->n++] = 1e3 * (now - cost->before);
  if (step->step == 1) {
    cost->bytes = part_allocated.bytes;
    cost->seconds_own = seconds;
  }
  if (cost->n) {
    cost->step = (part_allocated.bytes - cost->bytes) / (double)cost->n;
    cost->own = 1e3 * (seconds - cost->seconds_own) / (double)cost->n;
  }
  cost->before = perf_seconds(CLOCK_PROCESS_CPUTIME_ID);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static int ascending(const void *a, const void *b)
{
  const double x = *(const double *)a;
  const double y = *(const double *)b;

  return (x > y) - (x < y);
}

static double median(Cost *cost)
{
  qsort(cost->ms, (size_t)cost->n, sizeof(double), ascending);
  return cost->n ? 0.5 * (cost->ms[(cost->n - 1) / 2] + cost->ms[cost->n / 2]) : 0.;
}

static PetscErrorCode run(const char *mesh, const Part *part, PetscBool named, Cost *cost)
{
  char text[PART_TEXT];
  PetscLogDouble before, after;
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(cost, sizeof(*cost)));
  cost->event = named && part->events[0] ? strrchr(part->events, ',') : NULL;
  if (cost->event)
    cost->event++;
  else if (named && part->events[0])
    cost->event = part->events;
  if (!strcmp(part->name, "fields"))
    cost->event = "SbOut_fields";
  PetscCall(part_text(mesh, part->scene, named ? part->options : "", text));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(PetscMallocGetCurrentUsage(&before));
  PetscCall(test_scene_open_in(folder, text, &t));
  if (!tets)
    tets = t.model->mesh->Ncell;
  PetscCall(SbRunAddMonitor(t.run, watch, cost));
  PetscCall(PetscMallocGetCurrentUsage(&after));
  cost->setup = after - before;
  PetscCall(SbRunSolve(t.run));
  PetscCheck(!t.run->clock.stop_reason[0], PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s %s: %s",
             part->family, part->name, t.run->clock.stop_reason);
  PetscCall(test_scene_close(&t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode sample(const Part *part, const char *what, const char *unit, double value)
{
  char name[3 * SB_NAME_MAX];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(name, sizeof(name), "%s/%s/%s", part->family, part->name, what));
  PetscCall(perf_sample(name, unit, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One round through a family. */
static PetscErrorCode price(const char *mesh, const char *family)
{
  static char names[PART_NAMES][SB_NAME_MAX];
  char scene[PART_TEXT] = "";
  PetscInt n;
  PetscInt shared = SHARE;
  Cost without = {.n = 0};
  Cost with;

  PetscFunctionBeginUser;
  PetscCall(part_names(family, &n, names));
  for (PetscInt i = 0; i < n; i++) {
    PetscBool found;
    Part part;

    PetscCall(part_find(family, names[i], &part, &found));
    PetscCheck(found, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%s %s has no row in tests/parts.h", family,
               names[i]);
    if (shared == SHARE || strcmp(scene, part.scene)) {
      PetscCall(run(mesh, &part, PETSC_FALSE, &without));
      PetscCall(PetscStrncpy(scene, part.scene, sizeof(scene)));
      shared = 0;
    }
    shared++;
    PetscCall(run(mesh, &part, PETSC_TRUE, &with));
    PetscCall(sample(&part, "setup", "B", with.setup - without.setup));
    PetscCall(sample(&part, "step", "B", with.step - without.step));
    PetscCall(sample(&part, "without", "ms", median(&without)));
    PetscCall(sample(&part, "with", "ms", median(&with)));
    if (with.event)
      PetscCall(sample(&part, "own", "ms", with.own));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:8";
  char only[64] = "";
  PetscInt rounds = 3;

  PetscFunctionBeginUser;

  /* the count of bytes wants PETSc's own malloc; the base scene allocates nothing in its steps */
  (void)setenv("PETSC_OPTIONS", "-malloc_debug", 1);
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-family", sizeof(only), only));
  PetscCall(perf_argument("-folder", sizeof(folder), folder));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCheck(folder[0], PETSC_COMM_WORLD, PETSC_ERR_USER, "-folder DIR says where the output goes");
  PetscCall(PetscLogDefaultBegin());
  part_watch();
  PetscCall(SbRegisterAll());
  {
    Part base;
    PetscBool found;
    Cost first;

    /* parts of PETSc are set up by the first run that needs them */
    PetscCall(part_find("element", "p1", &base, &found));
    if (found)
      PetscCall(run(mesh, &base, PETSC_FALSE, &first));
  }
  for (PetscInt round = 0; round < rounds; round++) {
    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(part_families); k++) {
      if (only[0] && strcmp(only, part_families[k].name))
        continue;

      /* a step of theirs takes longer than those of all others together, and differs by more than
         rounds do */
      if (!only[0] && round > 0 && !strcmp(part_families[k].name, "element"))
        continue;
      PetscCall(price(mesh, part_families[k].name));
    }
  }
  PetscCall(perf_fact("tets", (double)tets));
  part_unwatch();
  PetscCall(PetscFinalize());
  return 0;
}
