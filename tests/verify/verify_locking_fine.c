// @long
// @ranks 1
// @cpu 1500
/*
  The last refinement of the convergence that verify_locking.c begins, n = 8 and 16, at the smallest
  and the largest Poisson's ratio: 152,064 unknowns with CR, 294,912 with DG.
*/
#include "locking.h"

static PetscErrorCode measure(const char *element, PetscInt n, PetscReal nu, PetscReal error[2])
{
  char more[256];
  LockingCost cost;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s -solver pressure", element));
  PetscCall(locking_cube(n, "", nu, more, error, &cost));
  test_print("  %s nu %-8g n %2d: L2 %.5f  H1 %.5f, %.1f s\n", element, nu, (int)n, error[0],
             error[1], cost.seconds);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static PetscErrorCode check_order(const char *element, PetscReal nu)
{
  PetscReal coarse[2], fine[2], order[2];

  PetscFunctionBeginUser;
  PetscCall(measure(element, 8, nu, coarse));
  PetscCall(measure(element, 16, nu, fine));
  for (int k = 0; k < 2; k++)
    order[k] = PetscLog2Real(coarse[k] / fine[k]);
  test_print("  %s nu %-8g orders %.3f %.3f\n", element, nu, order[0], order[1]);
  SB_CHECK(order[0] >= 1.9, "%s, nu %g: order %g in L2", element, nu, order[0]);
  SB_CHECK(order[1] >= 0.95, "%s, nu %g: order %g in H1", element, nu, order[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_order("cr", 0.3));
  PetscCall(check_order("cr", 0.499999));
  PetscCall(check_order("dg", 0.3));
  PetscCall(check_order("dg", 0.499999));
  SB_TEST_END();
}
