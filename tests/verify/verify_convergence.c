// @ranks 1 2
/*
  Convergence of P1 on a divergence-free manufactured solution (manufactured.h): order 2 in L2 and 1
  in H1. P1 locks near nu = 1/2: not on the mirrored cells of a box, which have enough
  divergence-free displacements, but on perturbed meshes. verify_locking.c tests the elements that
  do not lock.

  Orders from n = 8 to 16 are slightly below the limit, because a period of u has only n cells: the
  tolerance is 0.1.
*/
#include "locking.h"

static PetscErrorCode solve(PetscInt n, PetscReal nu, PetscBool distorted, PetscReal error[2])
{
  char mesh[64] = "";
  LockingCost cost;

  PetscFunctionBeginUser;
  if (!distorted)
    PetscCall(PetscSNPrintf(mesh, sizeof(mesh), "box:1,1,1:%d", (int)n));
  PetscCall(locking_cube(n, mesh, nu, "-body_a_element p1", error, &cost));
  test_print("  %-9s nu %-6g n %2d: L2 %.4f  H1 %.4f\n", distorted ? "distorted" : "regular", nu,
             (int)n, error[0], error[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  PetscReal coarse[2], fine[2], locked[2];

  SB_TEST_BEGIN(argc, argv);
  for (int distorted = 0; distorted < 2; distorted++) {
    PetscReal order[2];

    PetscCall(solve(8, 0.3, (PetscBool)distorted, coarse));
    PetscCall(solve(16, 0.3, (PetscBool)distorted, fine));
    PetscCall(solve(16, 0.4999, (PetscBool)distorted, locked));
    for (int k = 0; k < 2; k++)
      order[k] = PetscLog2Real(coarse[k] / fine[k]);
    test_print("  orders at nu 0.3: L2 %.3f  H1 %.3f\n", order[0], order[1]);
    SB_CHECK_NEAR(order[0], 2., 0.1, "order in L2");
    SB_CHECK_NEAR(order[1], 1., 0.1, "order in H1");
    SB_CHECK(fine[0] < 0.06 && fine[1] < 0.2, "errors of n = 16: %g and %g", fine[0], fine[1]);

    /* known locking, printed: the displacement is too small, but its error is below the exact
       solution */
    SB_CHECK(locked[0] > fine[0] && locked[0] < 1., "nu 0.4999: an error of %g", locked[0]);
  }
  SB_TEST_END();
}
