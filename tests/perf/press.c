/*
  Cost of contact between bodies in steps with contact: press -scene press|heap -cells 6 [-friction
  0.3] [-steps 10]

  press: a block is pushed by 6 % into a larger fixed one, with non-matching meshes, no friction:
  most of the points of one surface are always in contact. heap: eight boxes, each slightly rotated,
  in two layers, fall by 2 mm on a floor and onto each other, with friction.

  For each step with contact, except the first: milliseconds of the step and of the search for
  pairs, of the slowest rank. Work of the monitor is not counted.
*/
#include "../verify/contact.h"
#include "perf.h"

static const SbEvent parts[] = {SB_EVENT_SEARCH};
enum {
  SEARCH,
  PARTS
};

typedef struct {
  double from, part[PARTS]; /* s: begin of the step, events until then */
} Watch;

/* Seconds of an event in all stages, on this rank. */
static PetscErrorCode seconds(SbEvent event, double *sum)
{
  const PetscLogStage stages[] = {0, SbLogStageSetup, SbLogStageSolve, SbLogStageOutput};

  PetscFunctionBeginUser;
  *sum = 0;
  for (size_t s = 0; s < PETSC_STATIC_ARRAY_LENGTH(stages); s++) {
    PetscEventPerfInfo info;

    PetscCall(PetscLogEventGetPerfInfo(stages[s], SbEvents[event], &info));
    *sum += info.time;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Watch *w = (Watch *)ctx;
  double took[PARTS + 1];
  PetscReal contacts;

  PetscFunctionBeginUser;
  took[PARTS] = perf_seconds(CLOCK_MONOTONIC) - w->from;
  for (int i = 0; i < PARTS; i++) {
    const double before = w->part[i];

    PetscCall(seconds(parts[i], &w->part[i]));
    took[i] = w->part[i] - before;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, took, PARTS + 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(contact_column(run, step->t, "meet", "contacts", &contacts));
  if (step->step > 1 && contacts > 0) {
    PetscCall(perf_sample("step", "ms", 1e3 * took[PARTS]));
    PetscCall(perf_sample("search", "ms", 1e3 * took[SEARCH]));
    PetscCall(perf_sample("contacts", "1", (double)contacts));
    PetscCall(perf_sample("newton", "1", (double)step->newton));
    PetscCall(perf_sample("iterations", "1", (double)step->linear));
  }
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  for (int i = 0; i < PARTS; i++)
    PetscCall(seconds(parts[i], &w->part[i]));
  w->from = perf_seconds(CLOCK_MONOTONIC);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What all bodies are made of. */
static PetscErrorCode add_body(const char *name, const char *mesh, const char *where, size_t size,
                               char text[])
{
  char body[512];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(body, sizeof(body),
                          " -body_%s_mesh %s -body_%s_material corotated -body_%s_young 3e4 "
                          "-body_%s_poisson 0.4 -body_%s_density 1000 -body_%s_%s",
                          name, mesh, name, name, name, name, name, where));
  PetscCall(PetscStrlcat(text, body, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode press_scene(PetscInt cells, PetscInt steps, size_t size, char text[])
{
  char mesh[64], more[512];

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(text, "-bodies low,high", size));
  PetscCall(
    PetscSNPrintf(mesh, sizeof(mesh), "box:0.12,0.12,0.06:%d", (int)PetscMax(1, cells * 4 / 5)));
  PetscCall(add_body("low", mesh, "translate 0,0,0", size, text));
  PetscCall(PetscSNPrintf(mesh, sizeof(mesh), "box:0.08,0.08,0.06:%d", (int)cells));
  PetscCall(add_body("high", mesh, "translate 0.021,0.018,0.0601", size, text));
  PetscCall(
    PetscSNPrintf(more, sizeof(more),
                  " -effects hold,push,meet -effect_hold_type fixed -effect_hold_on low.zmin "
                  "-effect_push_type prescribed_displacement -effect_push_on high.zmax "
                  "-effect_push_displacement 0;0;-0.0037*t/%.10g -ts_dt 0.01",
                  0.01 * (double)steps));
  PetscCall(PetscStrlcat(text, more, size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode heap_scene(PetscInt cells, size_t size, char text[])
{
  char mesh[64];
  char name[2] = "a";
  char where[128];

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(text, "-bodies a,b,c,d,e,f,g,h", size));
  PetscCall(PetscSNPrintf(mesh, sizeof(mesh), "box:0.06,0.06,0.06:%d", (int)cells));
  for (int i = 0; i < 8; i++) {
    const int x = i % 2;
    const int y = i / 2 % 2;
    const int z = i / 4;

    name[0] = (char)('a' + i);
    PetscCall(PetscSNPrintf(where, sizeof(where), "rotate 0,0,1,%d -body_%s_translate %g,%g,%g",
                            5 * i - 17, name, 0.09 * x + 0.02 * z, 0.09 * y + 0.015 * z,
                            0.002 + 0.064 * z));
    PetscCall(add_body(name, mesh, where, size, text));
  }
  PetscCall(
    PetscStrlcat(text,
                 " -effects gravity,floor,meet -effect_floor_type contact "
                 "-effect_floor_obstacle plane:0,0,1,0 -effect_floor_friction 0.3 -ts_dt 0.004",
                 size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char scene[16] = "press";
  char text[2 * PERF_TEXT], more[256];
  PetscInt cells = 6;
  PetscInt steps = 10;
  PetscReal friction = 0;
  Watch w = {0};
  TestScene t;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(PetscLogDefaultBegin());
  PetscCall(perf_argument("-scene", sizeof(scene), scene));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-cells", &cells, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-steps", &steps, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-friction", &friction, NULL));
  if (!strcmp(scene, "heap"))
    PetscCall(heap_scene(cells, sizeof(text), text));
  else
    PetscCall(press_scene(cells, steps, sizeof(text), text));
  PetscCall(
    PetscSNPrintf(more, sizeof(more),
                  " -effect_meet_type contact "
                  "-effect_meet_friction %g -time euler_implicit -ts_max_steps %d -ts_max_time 100",
                  (double)friction, (int)steps));
  PetscCall(PetscStrlcat(text, more, sizeof(text)));
  PetscCall(perf_open(text, &t));
  t.run->monitors.want_energies = PETSC_TRUE;
  PetscCall(perf_fact("tets", (double)t.model->mesh->Ncell));
  PetscCall(SbRunAddMonitor(t.run, watch, &w));
  PetscCall(SbRunSolve(t.run));
  if (t.run->clock.stop_reason[0])
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "fact failed 1\nnote %s\n", t.run->clock.stop_reason));
  PetscCall(test_scene_close(&t));
  PetscCall(PetscFinalize());
  return 0;
}
