// @long
// @ranks 1
// @cpu 600
/*
  A neo-Hookean bar at nu = 0.499, its end turned by 90 degrees, in eight static steps.

  CR and DG agree on two cells across. CR converges: an error of order h^2 through two and four
  cells tells what three cells give. The energy there is 1.6 % away from it, because an odd number
  of cells has another pattern of diagonals (DG has the same energy to 3e-5).

  The limit of the energy is near that of St. Venant's torsion. For a neo-Hookean solid of nu = 1/2
  that cannot change its length, torsion without warping stores mu theta^2 J / (2 L) at any angle
  (Rivlin, "Large elastic deformations of isotropic materials IV", 1948); warping lowers J of a
  square of side a from a^4 / 6 to 0.14058 a^4 (Timoshenko and Goodier, "Theory of elasticity",
  section 109). Ends that are constrained plane raise it again by some per cent.
*/
#include "locking.h"

#define NU 0.499
#define OPTIONS "-solver direct -static_steps 8"

static PetscErrorCode twist(const char *element, PetscInt n, PetscReal value[4])
{
  LockingCost cost;
  char more[256];

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(more, sizeof(more), "-body_a_element %s " OPTIONS, element));
  PetscCall(locking_twist(n, NU, more, value, &cost));
  test_print("  %s n %d: %.5f %.5f %.5f m, %.5f J, %d Newton iterations, %.1f s\n", element, (int)n,
             value[0], value[1], value[2], value[3], (int)cost.newton, cost.seconds);
  PetscFunctionReturn(PETSC_SUCCESS);
}

int main(int argc, char **argv)
{
  const PetscReal size = 0.02;
  const PetscReal turn = 0.5 * PETSC_PI;
  const PetscReal width = 0.1;
  const PetscReal length = 0.4;
  const PetscReal torsion =
    0.14058 * PetscPowReal(width, 4.) * 1e5 / (2. * (1. + NU)) * turn * turn / (2. * length);
  PetscReal dg[4], p2[4], cr[5][4], expected[4], limit[4], d[2];

  SB_TEST_BEGIN(argc, argv);
  PetscCall(twist("dg", 2, dg));
  for (PetscInt n = 2; n <= 4; n++)
    PetscCall(twist("cr", n, cr[n]));
  PetscCall(twist("p2", 2, p2));
  locking_difference(dg, cr[2], d);
  SB_CHECK(d[0] < 1e-3 * size && d[1] < 1e-3, "CR and DG differ by %g m, %g of the energy", d[0],
           d[1]);

  /* error e / n^2 */
  for (int k = 0; k < 4; k++) {
    limit[k] = verify_extrapolate(cr[2][k], cr[4][k], 2.);
    expected[k] = limit[k] + (cr[2][k] - limit[k]) * 4. / 9.;
  }
  locking_difference(cr[3], expected, d);
  test_print("  n 3 - expected %.1e m, %.1e of the energy; limit %.5f J, torsion %.5f J\n", d[0],
             d[1], limit[3], torsion);
  SB_CHECK(d[0] < 0.01 * size && d[1] < 0.03,
           "three cells: %g m and %g of the energy away from second order", d[0], d[1]);
  SB_CHECK_NEAR(p2[3], limit[3], 0.05 * limit[3], "energy of P2 against the limit of CR");
  SB_CHECK(limit[3] > torsion && limit[3] < 1.05 * torsion,
           "limit of the energy %g J, of torsion %g J", limit[3], torsion);
  SB_TEST_END();
}
