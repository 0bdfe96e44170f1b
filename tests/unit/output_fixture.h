/*
  output_fixture.h - a scene with prescribed motion, for the tests of the output: no solve, exact
  numbers.

  The vectors of the run are set by formulas of rest position and time, and the monitors are called
  in the order of the time loop. Output goes to a temporary folder.
*/
#pragma once
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include "../file.h"
#include "../scene.h"
#include "../../src/output/output_impl.h"

#define MATERIAL \
  " -body_a_material linear -body_a_young 1000 -body_a_poisson 0.25 -body_a_density 10"
#define BOX "-bodies a -body_a_mesh box:0.4,0.1,0.2:4,1,2" MATERIAL
#define HELD                                                                          \
  BOX " -sets left -set_left_at plane:1,0,0,0 -effects hold -effect_hold_type fixed " \
      "-effect_hold_on left"
#define EULER " -time euler_implicit -ts_dt 0.1 -ts_max_time 1 -quiet "

/* The motion: u = t G x with a constant gradient, so that stresses are known; v = G x; a another
   affine function, so that CR and DG hold it exactly, too. */
#define G00 0.01
#define G11 -0.02
#define G02 0.03
static inline void motion(const PetscReal x[3], PetscReal t, PetscReal u[3], PetscReal v[3],
                          PetscReal a[3])
{
  v[0] = G00 * x[0] + G02 * x[2];
  v[1] = G11 * x[1];
  v[2] = 0.;
  for (int c = 0; c < 3; c++) {
    u[c] = t * v[c];
    a[c] = 0.1 * x[c] + 0.01;
  }
}

/* Opens the fields.h5 of the run; the caller closes it. */
static inline PetscErrorCode fixture_fields(const char *dir, SbH5 *h)
{
  char path[PETSC_MAX_PATH_LEN];
  PetscBool ok;

  PetscFunctionBeginUser;
  SbFormat(sizeof(path), path, "%s/fields.h5", dir);
  PetscCall(SbH5Open(PETSC_COMM_WORLD, path, PETSC_FALSE, h, &ok));
  SB_CHECK(ok, "fields.h5 cannot be opened");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the time loop does at a step: state, then monitors. Energies are numbers that tell their
   column. */
static inline PetscErrorCode fixture_step(TestScene *scene, PetscInt k, PetscReal dt,
                                          PetscBool last)
{
  SbRun run = scene->run;
  const SbSpace space = scene->model->space;
  SbStep step = {.step = k,
                 .t = (PetscReal)k * dt,
                 .dt = k == run->clock.step0 ? 0. : dt,
                 .t_end = run->clock.t_end,
                 .step_end = 10,
                 .last = last};
  PetscScalar *u, *v, *a;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(run->state.U, &u));
  PetscCall(VecGetArray(run->state.V, &v));
  PetscCall(VecGetArray(run->state.A, &a));
  for (PetscInt i = 0; i < space->nnode_owned; i++)
    motion(space->node_x + 3 * i, step.t, u + 3 * i, v + 3 * i, a + 3 * i);
  PetscCall(VecRestoreArray(run->state.U, &u));
  PetscCall(VecRestoreArray(run->state.V, &v));
  PetscCall(VecRestoreArray(run->state.A, &a));
  step.U = run->state.U;
  step.V = run->state.V;
  step.A = run->state.A;
  if (run->monitors.want_residual && !run->state.reaction)
    PetscCall(VecDuplicate(run->state.U, &run->state.reaction));
  if (run->monitors.want_residual)
    PetscCall(VecSet(run->state.reaction, 0.5));
  step.R = run->state.reaction;
  step.energies = (SbEnergies){.kinetic = 100. + k,
                               .strain = 200. + k,
                               .load_work = 300. + k,
                               .prescribed_work = 400.,
                               .volume = 0.008,
                               .min_J = 1. / 3.,
                               .ninverted = 7};
  run->state.energies = step.energies;
  step.newton = 2;
  step.linear = 30;
  step.wall = 0.01 * (PetscReal)k;
  run->counters.steps = k;
  for (PetscInt m = 0; m < run->monitors.n; m++)
    PetscCall(run->monitors.list[m].fn(run, &step, run->monitors.list[m].ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes a whole file; one rank. */
static inline void fixture_write(const char *path, const char *text, size_t size)
{
  FILE *file = fopen(path, "w");

  SB_CHECK(file && fwrite(text, 1, size, file) == size && !fclose(file), "cannot write %s", path);
}

/* A whole file; NULL when it cannot be read. PetscFree. */
static inline PetscErrorCode fixture_read_file(const char *path, char **text, size_t *size)
{
  FILE *file = fopen(path, "r");
  long end;

  PetscFunctionBeginUser;
  *text = NULL;
  *size = 0;
  if (!file)
    PetscFunctionReturn(PETSC_SUCCESS);
  if (!fseek(file, 0, SEEK_END) && (end = ftell(file)) >= 0 && !fseek(file, 0, SEEK_SET)) {
    PetscCall(PetscMalloc1((size_t)end + 1, text));
    *size = fread(*text, 1, (size_t)end, file);
    (*text)[*size] = 0;
  }
  (void)fclose(file);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A file of the folder as text, on every rank; empty when it is missing. PetscFree. */
static inline PetscErrorCode fixture_read(const char *dir, const char *name, char **text)
{
  char path[PETSC_MAX_PATH_LEN];
  size_t size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(PETSC_COMM_WORLD));
  SbFormat(sizeof(path), path, "%s/%s", dir, name);
  PetscCall(fixture_read_file(path, text, &size));
  if (!*text)
    PetscCall(PetscCalloc1(1, text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscBool fixture_exists(const char *dir, const char *name)
{
  char path[PETSC_MAX_PATH_LEN];

  SbFormat(sizeof(path), path, "%s/%s", dir, name);
  return (PetscBool)!access(path, F_OK);
}
