/*
  Time of a static solve: the bar of 200,000 tets (perf.h) under gravity, linear material, relative
  residual 1e-8: the residual, the tangent, the set-up of the preconditioner and the iterations, on
  the ranks of the program.

    solve -mesh box:0.4,0.1,0.1:20 -solver auto -rounds 3
*/
#include "perf.h"

int main(int argc, char **argv)
{
  char mesh[512] = "box:0.4,0.1,0.1:20";
  char solver[64] = "auto";
  char text[PERF_TEXT];
  PetscInt rounds = 3;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-solver", sizeof(solver), solver));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  for (PetscInt r = 0; r < rounds; r++) {
    PerfClock start, used;
    TestScene t;

    PetscCall(PetscSNPrintf(
      text, sizeof(text),
      "-bodies bar -body_bar_mesh %s -body_bar_material linear -body_bar_young 5e5 "
      "-body_bar_poisson 0.3 "
      "-sets end -set_end_at plane:1,0,0,0 -effects gravity,clamp -effect_gravity_vector 0,0,-9.81 "
      "-effect_clamp_type fixed -effect_clamp_on end -time static -ksp_rtol 1e-8 -solver %s",
      mesh, solver));
    PetscCall(perf_open(text, &t));
    start = perf_start();
    PetscCall(SbRunSolve(t.run));
    used = perf_stop(start);
    PetscCheck(!t.run->clock.stop_reason[0], PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "%s",
               t.run->clock.stop_reason);
    PetscCall(perf_sample("solve_wall", "s", used.wall));
    PetscCall(perf_sample("solve_cpu", "s", used.cpu));
    PetscCall(perf_sample("solve_iterations", "1", (double)t.run->counters.linear));
    if (!r)
      PetscCall(perf_fact("tets", (double)t.model->mesh->Ncell));
    if (!r)
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "note %s: %s\n", t.run->solve.solver,
                            t.run->solve.solver_reason));
    PetscCall(test_scene_close(&t));
  }
  PetscCall(PetscFinalize());
  return 0;
}
