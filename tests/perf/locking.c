/*
  One problem of tests/verify/locking.h, for scripts/locking: accuracy and cost.

    locking -problem cube -n 8 -nu 0.4999 -with " -body_a_element cr -solver cholmod"

  problem: cube, bar, cook, shell, beam, swing, twist, hang, modes. `n` cells across, or a file as
  -mesh (cook, shell, cube). beam: -mu, Pa. The text after -with must begin with a blank, or PETSc
  takes it for another option. Prints `fact NAME VALUE`.
*/
#include "perf.h"
#include "../verify/locking.h"

static PetscErrorCode print(const char *const names, const PetscReal value[])
{
  char **name;
  int n;

  PetscFunctionBeginUser;
  PetscCall(PetscStrToArray(names, ' ', &n, &name));
  for (int k = 0; k < n; k++)
    PetscCall(perf_fact(name[k], (double)value[k]));
  PetscCall(PetscStrToArrayDestroy(n, name));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  char problem[64] = "cube";
  char mesh[512] = "";
  char with[2048] = "";
  PetscInt n = 4;
  PetscReal nu = 0.3;
  PetscReal mu = 0.5e6;
  PetscReal value[12];
  LockingCost cost = {0};

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(perf_argument("-problem", sizeof(problem), problem));
  PetscCall(perf_argument("-mesh", sizeof(mesh), mesh));
  PetscCall(perf_argument("-with", sizeof(with), with));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-nu", &nu, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-mu", &mu, NULL));
  if (!strcmp(problem, "cube")) {
    PetscCall(locking_cube(n, mesh, nu, with, value, &cost));
    PetscCall(print("l2 h1", value));
  } else if (!strcmp(problem, "bar")) {
    PetscCall(locking_bar(n, nu, with, value, &cost));
    PetscCall(print("tip energy", value));
  } else if (!strcmp(problem, "cook")) {
    PetscCall(locking_cook(mesh, nu, with, value, &cost));
    PetscCall(print("corner middle", value));
  } else if (!strcmp(problem, "shell")) {
    LockingShell e;

    PetscCall(PetscMemzero(&e, sizeof(e)));
    PetscCall(locking_shell(mesh, nu, with, &e, &cost));
    PetscCall(
      print("u radial hoop wall_radial wall_hoop at_wall",
            (const PetscReal[]){e.u, e.stress[0], e.stress[1], e.wall[0], e.wall[1], e.at_wall}));
  } else if (!strcmp(problem, "beam")) {
    PetscCall(locking_beam(n, mu, with, value, &cost));
    PetscCall(print("x y", value));
  } else if (!strcmp(problem, "swing")) {
    PetscCall(locking_swing(n, nu, with, value, &cost));
    PetscCall(print("x y z energy", value));
  } else if (!strcmp(problem, "twist")) {
    PetscCall(locking_twist(n, nu, with, value, &cost));
    PetscCall(print("x y z energy", value));
  } else if (!strcmp(problem, "hang")) {
    PetscCall(locking_hang(n, nu, with, value, &cost));
    PetscCall(print("largest volume min_J", value));
  } else if (!strcmp(problem, "modes")) {
    PetscCall(locking_modes(n, nu, with, value));
    PetscCall(print("zero first second", value));
  } else {
    SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_USER, "-problem %s: there is none of that name", problem);
  }
  PetscCheck(!sb_test_failed, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED,
             "The run did not reach its end");
  PetscCall(
    print("cells unknowns newton linear seconds",
          (const PetscReal[]){(PetscReal)cost.cells, (PetscReal)cost.unknowns,
                              (PetscReal)cost.newton, (PetscReal)cost.linear, cost.seconds}));
  PetscCall(PetscFinalize());
  return 0;
}
