/*
  A complete static run of a clamped bar under its weight: the cost of -solver auto and of single
  solvers, for docs/reports/solver_choice.md.

    choice -cells 30,7,8 -slivers 0.01 -element cr -nu 0.4999 -with " -solver auto"

  -slivers: fraction of the tets with a smallest dihedral angle of -degrees 0.1 (slivers.h). -with:
  further options; they must begin with a blank, or PETSc takes them for another option. -write
  PATH: writes the mesh and solves nothing.

  Prints the solver and the reason if the run stopped, then `fact NAME VALUE`: tets, slivers,
  unknowns, newton, linear, rejected, cpu (seconds of set-up and solve on the slower rank, which
  sleeps while it waits), memory (MB of the larger rank).
*/
#include <sys/resource.h>
#include "perf.h"
#include "../slivers.h"

/* What Open MPI calls in its loop while a message is awaited, if told so (mpi_yield_when_idle). */
int sched_yield(void);
int sched_yield(void)
{
  const struct timespec nap = {0, 100000};

  (void)nanosleep(&nap, NULL);
  return 0;
}

static PetscErrorCode report(const TestScene *scene, PetscInt made, double seconds)
{
  struct rusage use;
  double mb, most;

  PetscFunctionBeginUser;
  (void)getrusage(RUSAGE_SELF, &use);
  mb = (double)use.ru_maxrss / 1024.;
  PetscCallMPI(MPI_Allreduce(&mb, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "solver %s: %s\n", scene->run->solve.solver,
                        scene->run->solve.solver_reason));
  if (scene->run->clock.stop_reason[0])
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "stopped: %s\n", scene->run->clock.stop_reason));
  PetscCall(perf_fact("tets", (double)scene->model->mesh->Ncell));
  PetscCall(perf_fact("slivers", (double)made));
  PetscCall(perf_fact("unknowns", 3. * (double)scene->model->space->Nnode));
  PetscCall(perf_fact("newton", (double)scene->run->counters.newton));
  PetscCall(perf_fact("linear", (double)scene->run->counters.linear));
  PetscCall(perf_fact("rejected", (double)scene->run->counters.rejected));
  PetscCall(perf_fact("cpu", seconds));
  PetscCall(perf_fact("memory", most));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  Slivers s = {.n = {30, 7, 8}, .size = {0.4, 0.1, 0.1}, .degrees = 0.1};
  char path[512];
  char element[64] = "cr";
  char with[1024] = "";
  char keep[512] = "";
  char text[PERF_TEXT];
  PetscInt three = 3;
  PetscInt made = 0;
  PetscReal nu = 0.4999;
  TestScene scene;
  PerfClock start;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  (void)SbThreadsSetOne();
  PetscCall(perf_argument("-element", sizeof(element), element));
  PetscCall(perf_argument("-with", sizeof(with), with));
  PetscCall(perf_argument("-write", sizeof(keep), keep));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-nu", &nu, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-slivers", &s.part, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-degrees", &s.degrees, NULL));
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-cells", s.n, &three, NULL));
  PetscCall(slivers_write(&s, path, &made));
  if (keep[0]) {
    PetscCheck(!rename(path, keep), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "Cannot write %s", keep);
    PetscCall(PetscFinalize());
    return 0;
  }
  PetscCall(PetscSNPrintf(
    text, sizeof(text),
    "-bodies a -body_a_mesh %s -body_a_element %s -body_a_material linear -body_a_young 1e6 "
    "-body_a_poisson %.17g -body_a_density 1000 -sets held -set_held_at plane:1,0,0,0 -effects "
    "gravity,clamp "
    "-effect_gravity_vector 0,0,-9.81 -effect_clamp_type fixed -effect_clamp_on held -time static "
    "%s",
    path, element, (double)nu, with));
  PetscCall(perf_read(text, &scene));
  PetscCall(SbModelSetUp(scene.model));
  start = perf_start();
  PetscCall(SbRunSetUp(scene.run));
  PetscCall(SbRunSolve(scene.run));
  PetscCall(report(&scene, made, perf_stop(start).cpu));
  PetscCall(test_scene_close(&scene));
  PetscCall(PetscFinalize());
  return 0;
}
