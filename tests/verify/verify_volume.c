// @ranks 1
/*
  A block of soft tissue, nu = 0.4999, hangs from its top under gravity: its volume changes by less
  than 0.1 %.

  Neo-Hookean, E = 5 kPa: stretched by a quarter. Co-rotated material preserves tr S, not det F: at
  a stretch of 1 + e it loses 3/4 e^2 of its volume, with any element; so it is measured at E = 50
  kPa, stretches of 4 % at the top. No cell is inverted.
*/
#include "locking.h"

/*
  Many small load steps on a stiffer block: their residuals begin near what lambda leaves of 16
  digits, and Newton's method must know that it cannot do better.
*/
static PetscErrorCode check_small_steps(void)
{
  PetscReal value[3];
  LockingCost cost;

  PetscFunctionBeginUser;
  PetscCall(locking_hang(
    2, 0.4999,
    "-body_a_material stable_neohookean -body_a_young 1e5 -body_a_element cr -solver cholmod "
    "-static_steps 20",
    value, &cost));
  SB_CHECK(cost.newton <= 120, "20 small load steps take %d iterations", (int)cost.newton);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  static const char *const laws[2] = {"-body_a_material stable_neohookean -body_a_young 5e3",
                                      "-body_a_material corotated -body_a_young 5e4"};
  static const char *const elements[] = {"cr", "dg", "p2"};

  SB_TEST_BEGIN(argc, argv);
  for (int e = 0; e < 3; e++) {
    for (int k = 0; k < 2; k++) {
      PetscReal value[3] = {0., 0., 0.};
      LockingCost cost;
      char more[256];

      PetscCall(PetscSNPrintf(more, sizeof(more), "%s -body_a_element %s -solver cholmod", laws[k],
                              elements[e]));
      PetscCall(locking_hang(4, 0.4999, more, value, &cost));
      test_print("  %s %s: longer by %.4f m, volume %+.2e, smallest J %.4f\n", elements[e], laws[k],
                 value[0], value[1], value[2]);
      SB_CHECK(PetscAbsReal(value[1]) < 1e-3, "the volume changes by %g", value[1]);

      /* P2 preserves the mean volume of each tet: at its points the volume deviates near the
         clamp */
      SB_CHECK(value[2] > (e == 2 ? 0.75 : 0.99), "smallest J %g", value[2]);

      /* the block does stretch: P1 gives about 3/4 of this */
      SB_CHECK(value[0] > (k ? 3.3e-3 : 0.04), "longer by %g m only", value[0]);
    }
  }
  PetscCall(check_small_steps());
  SB_TEST_END();
}
