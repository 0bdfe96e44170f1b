/*
  scene.h - builds a scene from an option string in a test program. Each call begins with an empty
  option database.
*/
#pragma once
#include <sb.h>
#include "test.h"

#define TEST_TEXT 4096 /* longest scenario of a test, characters */

typedef struct {
  SbModel model;
  SbRun run;
  SbLedger ledger; /* NULL unless requested by the options */
  SbRemesh remesh; /* NULL unless requested by the options */
} TestScene;

/* Creates the run of a scene that has a model, and its ledger if requested by the options. */
static inline PetscErrorCode test_scene_run(TestScene *scene)
{
  PetscFunctionBeginUser;
  PetscCall(SbRunCreate(scene->model, &scene->run));
  PetscCall(SbLedgerSetFromOptions(scene->run, &scene->ledger));
  PetscCall(SbRemeshSetFromOptions(scene->model, &scene->remesh));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Replaces all options by these, with every type registered again. */
static inline PetscErrorCode test_options(const char *options)
{
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(SbOptionsReset());
  PetscCall(SbRegisterAll());
  PetscCall(PetscOptionsInsertString(NULL, options));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*
  Creates model and run on the ranks of `comm`, as the program does, ready for SbRunSolve(); with
  output to the folder `dir` unless it is NULL.
*/
static inline PetscErrorCode test_scene_open_on(MPI_Comm comm, const char *dir, const char *options,
                                                TestScene *scene)
{
  PetscFunctionBeginUser;
  *scene = (TestScene){NULL, NULL, NULL, NULL}; /* so that the scene can be closed after an error */
  PetscCall(test_options(options));
  if (dir) {
    PetscCall(PetscOptionsSetValue(NULL, "-output_dir", dir));
    PetscCall(PetscOptionsSetValue(NULL, "-output_overwrite", "yes"));
  }
  PetscCall(SbSceneCreate(comm, &scene->model));
  PetscCall(test_scene_run(scene));
  if (dir)
    PetscCall(SbOutputSetFromOptions(scene->run, ""));
  PetscCall(SbOptionsCheck());
  PetscCall(SbModelSetUp(scene->model));
  PetscCall(SbRunSetUp(scene->run));
  PetscCall(SbLedgerAttach(scene->ledger));
  PetscCall(SbRemeshAttach(scene->remesh, scene->run));
  if (dir)
    PetscCall(SbOutputAttach(scene->run));
  PetscCall(SbMeshValidate(scene->model->mesh));
  PetscCall(SbSpaceValidate(scene->model->space));
  PetscFunctionReturn(PETSC_SUCCESS);
}
#define test_scene_open_in(dir, options, scene) \
  test_scene_open_on(PETSC_COMM_WORLD, dir, options, scene)
#define test_scene_open(options, scene) test_scene_open_in(NULL, options, scene)

/* The same of options in printf format. */
static inline PetscErrorCode test_vopen(MPI_Comm comm, const char *dir, TestScene *scene,
                                        const char *format, va_list args)
{
  char text[TEST_TEXT];
  size_t length;

  PetscFunctionBeginUser;
  PetscCall(PetscVSNPrintf(text, sizeof(text), format, &length, args));
  PetscCheck(length <= sizeof(text), PETSC_COMM_SELF, PETSC_ERR_PLIB, "%d characters, room for %d",
             (int)length, TEST_TEXT);
  PetscCall(test_scene_open_on(comm, dir, text, scene));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode PETSC_ATTRIBUTE_FORMAT(4, 5)
  test_open_on(MPI_Comm comm, const char *dir, TestScene *scene, const char *format, ...)
{
  va_list args;

  PetscFunctionBeginUser;
  va_start(args, format);
  PetscCall(test_vopen(comm, dir, scene, format, args));
  va_end(args);
  PetscFunctionReturn(PETSC_SUCCESS);
}
#define test_open_in(dir, scene, ...) test_open_on(PETSC_COMM_WORLD, dir, scene, __VA_ARGS__)
#define test_open(scene, ...) test_open_in(NULL, scene, __VA_ARGS__)

/* Time loop, with re-meshing if requested by the options, which replaces model, run and ledger. */
static inline PetscErrorCode test_scene_solve(TestScene *scene)
{
  PetscFunctionBeginUser;
  PetscCall(SbRemeshSolve(scene->remesh, &scene->model, &scene->run, &scene->ledger));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What PCView() prints, on all ranks. Collective. */
static inline PetscErrorCode test_pc_view(PC pc, size_t size, char text[])
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)pc);
  PetscViewer viewer;
  char *all = NULL;
  size_t length;
  FILE *file = open_memstream(&all, &length);

  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIOpenWithFILE(comm, file, &viewer));
  PetscCall(PCView(pc, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  (void)fclose(file);
  PetscCall(PetscStrncpy(text, all, size));
  free(all);
  PetscCallMPI(MPI_Bcast(text, (PetscMPIInt)size, MPI_CHAR, 0, comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static inline PetscErrorCode test_scene_close(TestScene *scene)
{
  PetscFunctionBeginUser;
  PetscCall(SbRemeshDestroy(&scene->remesh));
  PetscCall(SbLedgerDestroy(&scene->ledger));
  PetscCall(SbRunDestroy(&scene->run));
  PetscCall(SbModelDestroy(&scene->model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The error of a source (SB_ERROR_... of ledger_impl.h), J^(1/2), and the energy that it is
   relative to, J: as in history.csv, checkpoints. */
static inline PetscErrorCode test_ledger(SbRun run, int source, PetscReal *error, PetscReal *stored)
{
  PetscInt k = 0;

  PetscFunctionBeginUser;
  while (k < run->monitors.ncheckpoint &&
         strcmp(run->monitors.checkpoint[k].name, "ledger_stored_0"))
    k++;
  PetscCheck(k < run->monitors.ncheckpoint, PETSC_COMM_SELF, PETSC_ERR_PLIB, "there is no ledger");
  *stored = *run->monitors.checkpoint[k].value;
  *error = *run->monitors.column[source].value * PetscSqrtReal(*stored);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Displacement (or any vector of the run) at the vertex nearest to a rest position, on every
   rank. */
static inline PetscErrorCode test_value_at(SbModel m, Vec U, const PetscReal at[3],
                                           PetscReal value[3])
{
  SbSpace s = m->space;
  const PetscScalar *u;
  struct {
    double distance;
    int rank;
  } mine = {1e300, 0}, best;
  PetscInt node = 0;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(m->comm, &rank));
  mine.rank = rank;
  for (PetscInt i = 0; i < s->nnode_owned; i++) {
    PetscReal d2 = 0.;

    for (PetscInt k = 0; k < 3; k++)
      d2 += PetscSqr(s->node_x[3 * i + k] - at[k]);
    if (d2 < mine.distance) {
      mine.distance = d2;
      node = i;
    }
  }
  PetscCallMPI(MPI_Allreduce(&mine, &best, 1, MPI_DOUBLE_INT, MPI_MINLOC, m->comm));
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt k = 0; k < 3; k++)
    value[k] = rank == best.rank ? u[3 * node + k] : 0.;
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCallMPI(MPI_Bcast(value, 3, MPIU_REAL, best.rank, m->comm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets a vector by a function of the rest position, independent of the partition. */
static inline PetscErrorCode test_fill(SbModel m,
                                       void (*f)(const PetscReal x[3], PetscReal value[3]), Vec U)
{
  SbSpace s = m->space;
  PetscScalar *u;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(U, &u));
  for (PetscInt i = 0; i < s->nnode_owned; i++)
    f(s->node_x + 3 * i, u + 3 * i);
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The number behind these words in what PCView() prints, -1: they are not there. Collective. */
static inline PetscErrorCode test_pc_number(PC pc, const char *words, double *number)
{
  char text[4096];
  const char *at;

  PetscFunctionBeginUser;
  PetscCall(test_pc_view(pc, sizeof(text), text));
  at = strstr(text, words);
  *number = at ? atof(at + strlen(words)) : -1.;
  PetscFunctionReturn(PETSC_SUCCESS);
}
