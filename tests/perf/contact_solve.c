/*
  Time of a linear solve with contact: contact_solve -cells 10 [-element p1] [-step 0.01] [-rtol
  1e-3] [-rounds 3]

  Two blocks in barrier contact, whose stiffness is 1, 1e2, 1e4, 1e6 times the diagonal of K + M /
  step^2. For each, alternately: CPU ms of a two-level solve with new values, and with a new
  sparsity pattern too, its iterations, and the same of the factorisation.
*/
#include "../contact_problem.h"
#include "perf.h"

int main(int argc, char **argv)
{
  static const char *const ways[] = {"", "direct", "iterative"};
  char element[16] = "p1";
  char rtol[32] = "1e-3";
  char name[64], set[64];
  PetscInt cells = 10;
  PetscInt rounds = 3;
  PetscReal step = 0.01;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-element", sizeof(element), element));
  PetscCall(perf_argument("-rtol", sizeof(rtol), rtol));
  PetscCall(PetscSNPrintf(set, sizeof(set), "-contact_ksp_rtol %s", rtol));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-cells", &cells, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-rounds", &rounds, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-step", &step, NULL));
  for (PetscInt round = 0; round < rounds; round++) {
    ContactProblem p;

    PetscCall(contact_problem_open(cells, element, step, set, &p));
    if (!round) {
      PetscCall(perf_fact("tets", (double)p.scene.model->mesh->Ncell));
      PetscCall(perf_fact("blocks", (double)p.npair));
      PetscCall(perf_fact("unknowns", 3. * (double)p.scene.model->space->Nnode));
    }
    for (int power = 0; power <= 6; power += 2) {
      PetscCall(contact_problem_scale(&p, PetscPowReal(10., power)));
      for (PetscInt way = 2; way > 0; way--) {
        SbContactSystem system;
        KSPConvergedReason reason;
        PetscInt its;

        PetscCall(SbContactSystemCreate(p.scene.model->space, way, &system));
        for (int again = 0; again < 2; again++) {
          const PerfClock from = perf_start();
          PerfClock took;

          PetscCall(
            SbContactSystemSolve(system, p.K, &p.blocks, PETSC_TRUE, p.F, p.Y, &reason, &its));
          took = perf_stop(from);
          PetscCheck(reason > 0, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "ratio 1e%d: %s", power,
                     KSPConvergedReasons[reason]);
          PetscCall(PetscSNPrintf(name, sizeof(name), "%s/1e%d/%s", ways[way], power,
                                  again ? "values" : "pattern"));
          PetscCall(perf_sample(name, "ms", 1e3 * took.cpu));
        }
        PetscCall(PetscSNPrintf(name, sizeof(name), "%s/1e%d/iterations", ways[way], power));
        PetscCall(perf_sample(name, "1", (double)its));
        PetscCall(SbContactSystemDestroy(&system));
      }
    }
    PetscCall(contact_problem_close(&p));
  }
  PetscCall(PetscFinalize());
  return 0;
}
