/*
  perf.h - common functions of the benchmark programs: clocks, samples, the swinging bar.

  A program prints one line per measurement, `sample NAME UNIT VALUE`, and properties of its case as `fact NAME VALUE`;
  scripts/bench runs the programs, interleaves them, and computes medians, ratios and tables. Alternatives within one
  program alternate, round by round, so that a disturbance of the machine affects all of them.

  Work without communication is measured in CPU seconds of the slowest rank, which other programs on the machine disturb
  less than wall time; communication, and real-time performance, are measured in wall time.
*/
#pragma once
#include <time.h>
#include <petscdmplex.h>
#include "../scene.h"

typedef struct {
  double cpu, wall; /* s */
} PerfClock;

static inline double perf_seconds(clockid_t id)
{
  struct timespec t;

  (void)clock_gettime(id, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* All ranks start together. */
static inline PerfClock perf_start(void)
{
  PerfClock c;

  (void)MPI_Barrier(PETSC_COMM_WORLD);
  c.cpu = perf_seconds(CLOCK_PROCESS_CPUTIME_ID);
  c.wall = perf_seconds(CLOCK_MONOTONIC);
  return c;
}

/* Seconds since `start` on the slowest rank. Collective. */
static inline PerfClock perf_stop(PerfClock start)
{
  double mine[2], all[2] = {0., 0.};

  mine[0] = perf_seconds(CLOCK_PROCESS_CPUTIME_ID) - start.cpu;
  mine[1] = perf_seconds(CLOCK_MONOTONIC) - start.wall;
  (void)MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return (PerfClock){all[0], all[1]};
}

static inline PetscErrorCode perf_sample(const char *name, const char *unit, double value)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "sample %s %s %.6g\n", name, unit, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode perf_fact(const char *name, double value)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "fact %s %.10g\n", name, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The scene of an option string up to where nothing is computed yet; test_scene_close() frees it. */
static inline PetscErrorCode perf_read(const char *options, TestScene *scene)
{
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscCall(SbSceneCreate(PETSC_COMM_WORLD, &scene->model));
  PetscCall(test_scene_run(scene));
  PetscCall(SbOptionsCheck());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Ready for SbRunSolve(). */
static inline PetscErrorCode perf_open(const char *options, TestScene *scene)
{
  PetscFunctionBeginUser;
  PetscCall(perf_read(options, scene));
  PetscCall(SbModelSetUp(scene->model));
  PetscCall(SbRunSetUp(scene->run));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The value of -name among the program's own arguments, or what is there already. */
static inline PetscErrorCode perf_argument(const char *name, size_t size, char value[])
{
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(NULL, NULL, name, value, size, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

#define PERF_TEXT 4096 /* longest scenario */

/* A soft bar of co-rotated material along x, clamped at its end x = 0, under gravity; one implicit step per picture. */
static inline PetscErrorCode perf_bar(const char *mesh, const char *more, char text[PERF_TEXT])
{
  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(
    text, PERF_TEXT,
    "-bodies bar -body_bar_mesh %s -body_bar_material corotated -body_bar_young 5e4 -body_bar_poisson 0.4 "
    "-body_bar_density 1000 -body_bar_tangent warped -sets end -set_end_at plane:1,0,0,0 "
    "-effects gravity,clamp -effect_gravity_vector 0,0,-9.81 -effect_clamp_type fixed -effect_clamp_on end "
    "-time euler_implicit -ts_dt 0.0166666666666666667 -snes_type ksponly -ksp_rtol 1e-4 %s",
    mesh, more));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A DMPlex of this rank's tets, in their order, with the layer of overlap that DMPlex makes: what others would build a matrix on. */
static inline PetscErrorCode perf_plex(SbMesh mesh, DM *dm)
{
  PetscInt *cell;
  PetscSF sf;
  DM overlapped = NULL;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(4 * (size_t)mesh->ncell_owned, &cell));
  for (PetscInt i = 0; i < 4 * mesh->ncell_owned; i++) cell[i] = mesh->gvert[mesh->cell[i]];
  PetscCall(DMPlexCreateFromCellListParallelPetsc(PETSC_COMM_WORLD, 3, mesh->ncell_owned, mesh->nvert_owned,
                                                  mesh->Nvert, 4, PETSC_FALSE, cell, 3, mesh->x, &sf, NULL,
                                                  dm));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree(cell));
  PetscCall(DMPlexDistributeOverlap(*dm, 1, NULL, &overlapped));
  if (overlapped) {
    PetscCall(DMDestroy(dm));
    *dm = overlapped;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}
