/*
  Milliseconds per step of the swinging bar (perf.h) with one linear solver, without output; -mesh
  and -hold select another body.

    swing -mesh box:0.4,0.1,0.1:8 -solver realtime -element p1 -steps 120 -seconds 10

  The bar is released at rest, falls and swings for 2 s in 120 steps of 1/60 s. Ends early after
  -seconds. The first step is reported separately: it includes the set-up of the solver. Iterations
  are those of CG.
*/
#include "sbsolver.h"
#include "perf.h"

/* Bytes that one application of a factor that turns reads, on the busiest rank and on all. */
static PetscErrorCode tell_work(SNES snes)
{
  double nface, most, all;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(test_pc_number(pc, "interface of ", &nface));
  if (nface < 0.)
    PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(test_pc_number(pc, "at most ", &most));
  PetscCall(test_pc_number(pc, "reads ", &all));
  PetscCall(perf_fact("interface_nodes", nface));
  PetscCall(perf_fact("busiest_bytes", 1e6 * most));
  PetscCall(perf_fact("bytes", 1e6 * all));
  PetscFunctionReturn(PETSC_SUCCESS);
}

typedef struct {
  double limit, before; /* s of wall time: after these the run ends; at the end of the last step */
} Watch;

static PetscErrorCode watch(SbRun run, const SbStep *step, void *ctx)
{
  Watch *w = (Watch *)ctx;
  double wall = step->wall;

  PetscFunctionBeginUser;

  /* all ranks must agree on the end */
  PetscCallMPI(MPI_Bcast(&wall, 1, MPI_DOUBLE, 0, PETSC_COMM_WORLD));
  if (step->step > 0) {
    PetscCall(perf_sample(step->step == 1 ? "first_step" : "step", "ms", 1e3 * (wall - w->before)));
    if (step->step > 1)
      PetscCall(perf_sample("iterations", "1", (double)step->linear));
  }
  if (wall > w->limit)
    PetscCall(TSSetConvergedReason(run->solve.ts, TS_CONVERGED_USER));
  w->before = wall;
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:8";
  char solver[64] = "cg_icc";
  char element[64] = "p1";
  char hold[256] = "plane:1,0,0,0";
  char more[512], text[PERF_TEXT];
  PetscInt steps = 120;
  PetscReal seconds = 10.;
  Watch w = {0., 0.};
  PerfClock start;
  TestScene t;
  SNES snes;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-solver", sizeof(solver), solver));
  PetscCall(perf_argument("-element", sizeof(element), element));
  PetscCall(perf_argument("-hold", sizeof(hold), hold));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-steps", &steps, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-seconds", &seconds, NULL));
  PetscCall(PetscSNPrintf(more, sizeof(more),
                          "-solver %s -body_bar_element %s -ts_max_time %.10g -time_max_halvings 0 "
                          "-set_end_at %s",
                          solver, element, (double)steps / 60., hold));
  PetscCall(perf_bar(mesh, more, text));
  PetscCall(perf_open(text, &t));
  w.limit = (double)seconds;
  PetscCall(perf_fact("tets", (double)t.model->mesh->Ncell));
  PetscCall(SbRunAddMonitor(t.run, watch, &w));
  start = perf_start();
  PetscCall(SbRunSolve(t.run));
  PetscCall(perf_fact("cpu_per_step_ms",
                      1e3 * perf_stop(start).cpu / (double)PetscMax(t.run->counters.steps, 1)));
  PetscCall(TSGetSNES(t.run->solve.ts, &snes));
  PetscCall(tell_work(snes));
  if (t.run->clock.stop_reason[0])
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "fact failed 1\nnote %s\n", t.run->clock.stop_reason));
  PetscCall(test_scene_close(&t));
  PetscCall(PetscFinalize());
  return 0;
}
