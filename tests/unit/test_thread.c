/*
  test_thread.c - a factorisation creates no threads: the threads of the process are counted before
  and after it, and no library reports that it would use more than one.
*/
#include <sbbase.h>
#include <stdio.h>
#include "test.h"

#define SIDE \
  24 /* unknowns along an edge of the cube: supernodes large enough for CHOLMOD's parallel loops */

/* Number of threads of this process, -1 if the system does not report it. */
static int count_threads(void)
{
  FILE *f = fopen("/proc/self/status", "r");
  char line[256];
  int n = -1;

  while (f && n < 0 && fgets(line, sizeof(line), f))
    (void)sscanf(line, "Threads: %d", &n);
  if (f)
    (void)fclose(f);
  return n;
}

/* Solves Laplace's equation on a cube of points with CHOLMOD. */
static PetscErrorCode factor_and_solve(PetscReal *residual)
{
  const PetscInt n = SIDE * SIDE * SIDE;
  const PetscInt step[3] = {1, SIDE, SIDE * SIDE};
  Mat A;
  Vec x, b;
  KSP ksp;
  PC pc;

  PetscFunctionBeginUser;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 7, NULL, &A));
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(MatSetValue(A, i, i, 6.1, INSERT_VALUES));
    for (int k = 0; k < 3; k++) {
      if ((i / step[k]) % SIDE == 0)
        continue;
      PetscCall(MatSetValue(A, i, i - step[k], -1., INSERT_VALUES));
      PetscCall(MatSetValue(A, i - step[k], i, -1., INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(VecSet(b, 1.));

  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERCHOLMOD));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(VecScale(b, -1.));
  PetscCall(MatMultAdd(A, x, b, b));
  PetscCall(VecNorm(b, NORM_INFINITY, residual));

  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&b));
  PetscCall(MatDestroy(&A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char *argv[])
{
  PetscReal residual = 1.;
  PetscBool cholmod;
  int before;

  SB_TEST_BEGIN(argc, argv);
  SB_CHECK(SbThreadsSetOne() == 1, "a library would use %d threads", SbThreadsSetOne());
  PetscCall(SbHasPackage("cholmod", &cholmod));
  before = count_threads();
  if (cholmod && before > 0) {
    PetscCall(factor_and_solve(&residual));
    SB_CHECK(residual < 1e-10, "residual %g", residual);
    SB_CHECK(count_threads() == before, "%d threads before the factorisation, %d after it", before,
             count_threads());
  }
  SB_TEST_END();
}
