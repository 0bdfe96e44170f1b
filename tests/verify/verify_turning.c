// @ranks 1
/*
  Large rotations with CR, DG and P2: Turek and Hron's CSM1 and CSM2 (St. Venant-Kirchhoff, and
  co-rotated, which is equal for small strains), and the swinging bar at nu = 0.499: CR and DG
  agree, and converge to a finer mesh. verify_twist.c has a twisted bar.
*/
#include "locking.h"

static const char *const elements[3] = {"cr", "dg", "p2"};

static PetscErrorCode check_beam(const char *what, PetscReal mu, PetscReal ux, PetscReal uy)
{
  PetscFunctionBeginUser;
  for (int e = 0; e < 3; e++) {
    for (int law = 0; law < 2; law++) {
      /* one mesh suffices for the difference of the materials */
      for (PetscInt n = 2; n <= (law ? 2 : 4); n += 2) {
        const PetscReal tolerance = n == 2 ? 0.08 : 0.015;
        PetscReal u[3];
        LockingCost cost;
        char more[256];

        PetscCall(PetscSNPrintf(more, sizeof(more),
                                "-body_a_element %s -body_a_material %s -solver direct",
                                elements[e], law ? "corotated" : "stvk"));
        PetscCall(locking_beam(n, mu, more, u, &cost));
        test_print("  %s %s %s n %d: %.4f %.3f mm (%.2f %%, %.2f %%), %d Newton\n", what,
                   elements[e], law ? "corotated" : "stvk", (int)n, 1e3 * u[0], 1e3 * u[1],
                   100. * (u[0] / ux - 1.), 100. * (u[1] / uy - 1.), (int)cost.newton);

        /* shortening is proportional to the square of the deflection */
        SB_CHECK_NEAR(u[1], uy, tolerance * PetscAbsReal(uy), what);
        SB_CHECK_NEAR(u[0], ux, 2. * tolerance * PetscAbsReal(ux), what);
      }
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  SB_TEST_BEGIN(argc, argv);
  PetscCall(check_beam("CSM1", 0.5e6, -7.1878e-3, -66.103e-3));
  PetscCall(check_beam("CSM2", 2e6, -0.46901e-3, -16.974e-3));
  PetscCall(
    locking_check_pair("swing", locking_swing, "", 0.4, 4, (const PetscReal[2]){1e-3, 0.1}));
  SB_TEST_END();
}
