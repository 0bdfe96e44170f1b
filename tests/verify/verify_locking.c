// @ranks 1 2
/*
  CR and DG do not lock: a divergence-free solution (manufactured.h) at nu = 0.3, 0.49, 0.4999,
  0.499999, meshes with perturbed vertices. Orders 2 in L2 and 1 in H1 at every nu, and nearly equal
  errors. P1 locks on these meshes: its solution is nearly zero. verify_locking_fine.c has finer
  meshes.
*/
#include "locking.h"

static PetscErrorCode measure(const char *element, PetscInt n, PetscReal nu, PetscReal error[2])
{
  char more[256];
  LockingCost cost;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s -solver direct", element));
  PetscCall(locking_cube(n, "", nu, more, error, &cost));
  test_print("  %s nu %-8g n %2d: L2 %.5f  H1 %.5f\n", element, nu, (int)n, error[0], error[1]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* `times`: ratio of the largest allowed errors to those at nu = 0.3. */
static PetscErrorCode check_element(const char *element, PetscInt nnu, const PetscReal nu[],
                                    PetscReal times)
{
  PetscReal first[2] = {0., 0.};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < nnu; i++) {
    PetscReal coarse[2], fine[2], order[2];

    PetscCall(measure(element, 4, nu[i], coarse));
    PetscCall(measure(element, 8, nu[i], fine));
    for (int k = 0; k < 2; k++) {
      order[k] = PetscLog2Real(coarse[k] / fine[k]);
      if (i == 0)
        first[k] = fine[k];
      SB_CHECK(fine[k] <= times * first[k], "%s: nu %g multiplies the error by %g", element, nu[i],
               fine[k] / first[k]);
    }
    SB_CHECK(order[0] >= 1.9, "%s, nu %g: order %g in L2", element, nu[i], order[0]);
    SB_CHECK(order[1] >= 0.95, "%s, nu %g: order %g in H1", element, nu[i], order[1]);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscReal nu[4] = {0.3, 0.49, 0.4999, 0.499999};
  const PetscReal ends[2] = {0.3, 0.499999};
  PetscReal locked[2];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_element("cr", 4, nu, 1.2));
  PetscCall(check_element("dg", 2, ends, 1.2));

  /* the motivation for the other two elements */
  PetscCall(measure("p1", 8, 0.4999, locked));
  SB_CHECK(locked[0] > 0.9, "P1 has an error of %g only: this mesh shows no locking", locked[0]);
  SB_TEST_END();
}
